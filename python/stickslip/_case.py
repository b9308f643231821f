"""Cases and their sources."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Union

from . import _native
from ._errors import InputError

PathLike = Union[str, "os.PathLike[str]"]

CaseLike = Union[str, "os.PathLike[str]", Mapping[str, Any]]
"""A built-in name, the path of a TOML file or of a result, a TOML text, or a nested mapping of its keys."""

Overrides = Union[Mapping[str, Any], None]
"""Dotted key to value: a number in SI, a text with a unit such as ``"4.8 s/rad"``, a bool, a list, or a mapping."""


class Case(NamedTuple):
    """A built-in case."""

    name: str
    text: str
    """TOML."""

    @property
    def title(self) -> str:
        """What it is."""
        for line in self.text.splitlines():
            key, _, value = line.partition("=")
            if key.strip() == "title":
                return value.strip().strip('"')
        return self.name


def cases() -> list[Case]:
    """The built-in cases. ``print(stickslip.cases()[0].text)`` shows one to start from."""
    return [Case(name, text) for name, text in _native.cases()]


def toml(value: Any, key: str = "") -> str:
    """A value of a case as TOML on one line."""
    if hasattr(value, "tolist") and not isinstance(value, (str, bytes)):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, str):
        # A basic string of TOML has the escapes of JSON; only DEL is allowed there and not here.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Mapping):
        entries = (f"{json.dumps(str(k), ensure_ascii=False)} = {toml(v, f'{key}.{k}')}" for k, v in value.items())
        return "{ " + ", ".join(entries) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(toml(item, key) for item in value) + "]"
    raise InputError(
        f"{key.strip('.') or 'the value'}: a {type(value).__name__} is no value of a case; give a number in SI, a text "
        "with a unit, a bool, a list or a mapping"
    )


def settings(overrides: Overrides, **others: Any) -> list[str]:
    """Overrides as ``--set`` takes them."""
    found = []
    for key, value in {**(overrides or {}), **{k: v for k, v in others.items() if v is not None}}.items():
        # A text with a unit is taken as it is; the rest is TOML.
        written = value if isinstance(value, str) else toml(value, key)
        found.append(f"{key}={written}")
    return found


def is_hdf5(path: Path) -> bool:
    """Whether a file is HDF5, by its first bytes."""
    try:
        with path.open("rb") as file:
            return file.read(8) == b"\x89HDF\r\n\x1a\n"
    except OSError:
        return False


def source(case: CaseLike, *, absolute: bool = False) -> tuple[str, str]:
    """Kind of a case's source, and its text; a path, if asked for, without the folder of this process."""
    if isinstance(case, Mapping):
        return "text", "".join(f"{json.dumps(str(k))} = {toml(v, str(k))}\n" for k, v in case.items())
    if not isinstance(case, (str, os.PathLike)):
        raise InputError(
            f"a {type(case).__name__} is no case; give a built-in name, a path, a TOML text or a mapping; of a run, run.case"
        )
    named = isinstance(case, str) and case.endswith((".toml", ".h5"))
    if isinstance(case, str) and ("\n" in case or ("=" in case and not named and not os.path.exists(case))):
        return "text", case
    text = os.fspath(case)
    path = Path(text)
    if path.exists() or not isinstance(case, str) or path.suffix or os.sep in text:
        kind = "result" if path.suffix == ".h5" or is_hdf5(path) else "file"
        return kind, os.path.abspath(text) if absolute else text
    return "built-in", text
