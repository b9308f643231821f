"""Reports and errors of the library in the words of Python."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

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
    """A message of the library with the arguments of this module in place of its options; commands to be typed stay."""
    parts = SHELL.split(text)
    parts[::2] = [OPTION.sub(_option, SETTING.sub(_setting, START.sub(r'start="\1"', part))) for part in parts[::2]]
    return "".join(parts)


def named(text: str, names: Mapping[str, str]) -> str:
    for file, name in names.items():
        text = text.replace(file, name)
    return text


@contextmanager
def worded(names: Mapping[str, str]) -> Iterator[None]:
    """Errors of the library name files as ``names`` says, and arguments of this module in place of options."""
    try:
        yield
    except StickslipError as error:
        raise type(error)(in_python(named(str(error), names))) from error.__cause__


class Report:
    """A result with its report: ``print`` shows it.

    :ivar document: the dictionary that ``--json`` of the program prints.
    """

    def __init__(self, told: tuple[str, str], names: Mapping[str, str]) -> None:
        """Files are called by their ``names`` in report and document, and a line that is such a file alone is left out. Options
        of the program are replaced in the report alone."""
        text, document = told
        lines = (line for line in text.splitlines() if line not in names)
        self._text = in_python(named("\n".join(lines), names)).rstrip()
        self.document: dict[str, Any] = json.loads(named(document, names))

    def __str__(self) -> str:
        return self._text
