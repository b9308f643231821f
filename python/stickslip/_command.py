"""Reports and errors of the program in the words of Python."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from . import _native
from ._errors import StickslipError

ARGUMENTS = {
    "-o": "output",
    "--force": "replace=True",
    "--resume": "resume=True",
    "--jobs": "jobs",
    "--method": "method",
    "--set": "overrides",
    "--digits": "digits",
    "--oracle": "oracle=True",
    "--map": "mapping",
    "--column": "columns",
    "--events": "events",
    "--period": "period",
    "--periods": "periods",
    "--branch": "branch",
    "--point": "point",
    "--time-offset": "time_offset",
    "--velocity-tolerance": "velocity_tolerance",
    "--hysteresis": "hysteresis",
    "--max-wall-time": "max_wall_time",
    "--require": "require",
}
"""Options of the program, and the arguments that they are here."""

SHELL = re.compile(r"(stickslip [a-z][^;`\n]*)")
"""A command to be typed, which stays as it is."""

START = re.compile(r"--from (end|initial)")
SETTING = re.compile(r"--(set|column) (?:'([\w.]+)=([^']*)'|([\w.]+)(?:=([^\s;,]*[^\s;,.:]))?)")
OPTION = re.compile(r"(?<![\w-])(--[a-z][a-z-]*|-o)(?:[ =]([0-9][^\s;,:]*))?(?![\w-])")


def _setting(found: re.Match[str]) -> str:
    argument = ARGUMENTS[f"--{found[1]}"]
    key, value = found[2] or found[4], found[3] or found[5]
    if value is None:
        return f'{argument}["{key}"]'
    # A number, a list or a text of TOML is one of Python, too.
    plain = re.fullmatch(r'[-+]?[0-9.]+(e[-+]?[0-9]+)?|"[^"]*"', value)
    return f'{argument}={{"{key}": {value if plain else json.dumps(value)}}}'


def _option(found: re.Match[str]) -> str:
    argument = ARGUMENTS.get(found[1])
    if argument is None:
        return found[0]
    return argument if found[2] is None else f"{argument}={found[2]}"


def in_python(text: str) -> str:
    """A message of the program with the arguments of this module in place of its options; commands to be typed stay."""
    parts = SHELL.split(text)
    parts[::2] = [OPTION.sub(_option, SETTING.sub(_setting, START.sub(r'start="\1"', part))) for part in parts[::2]]
    return "".join(parts)


def _named(text: str, names: Mapping[str, str]) -> str:
    for file, name in names.items():
        text = text.replace(file, name)
    return text


@contextmanager
def worded(names: Mapping[str, str]) -> Iterator[None]:
    """Errors of the library name files as ``names`` says, and arguments of this module in place of options."""
    try:
        yield
    except StickslipError as error:
        raise type(error)(in_python(_named(str(error), names))) from error.__cause__


def command(
    arguments: list[str], names: Mapping[str, str], *, keeps: bool = True
) -> tuple[str, str | None, list[str], str | None]:
    """A command of the program: its report, its JSON document, its messages, and why it fell short. The names of files are
    replaced in all of them, the options of the program in all but the document."""
    with worded(names):
        text, document, messages, shortfall = _native.command(arguments, keeps)
    return (
        in_python(_named(text, names)),
        None if document is None else _named(document, names),
        [in_python(_named(message, names)) for message in messages],
        None if shortfall is None else in_python(_named(shortfall, names)),
    )
