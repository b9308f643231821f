"""The part of the module that is Rust."""

from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str
PRODUCTS: dict[str, list[str]]

_Column = tuple[str, str, str, list[tuple[int, str]], str]
_Told = tuple[str, str]

class Run:
    title: str
    case_text: str
    resolved: str
    status: str
    failure: str | None
    warnings: list[str]
    report: str | None
    witness: str | None
    headline: list[tuple[str, str, str]]
    quantities: list[tuple[str, float, str, str]]
    tables: list[tuple[str, list[_Column]]]
    event_count: int
    @property
    def path(self) -> Path | None: ...
    @property
    def meta(self) -> dict[str, str | float]: ...
    def at_events(self) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]: ...
    def column(self, group: str, name: str) -> NDArray[Any]: ...
    def save(self, path: str | PathLike[str], replace: bool) -> Path: ...

def run(
    kind: str,
    text: str,
    settings: list[str],
    witness: bool,
    trajectory: bool,
    progress: Callable[[float, float], object] | None,
) -> Run: ...
def open_result(path: str | PathLike[str]) -> Run: ...
def resolve(kind: str, text: str, settings: list[str]) -> str: ...
def is_study(path: str | PathLike[str]) -> bool: ...
def read_study(path: str | PathLike[str]) -> dict[str, Any]: ...
def is_continuation(path: str | PathLike[str]) -> bool: ...
def read_continuation(path: str | PathLike[str]) -> dict[str, Any]: ...
def set_probe(command: list[str]) -> None: ...
def probe(arguments: list[str]) -> int: ...
def evaluate(study: str, points: str) -> bytes: ...
def sweep(
    study: str,
    settings: list[str],
    path: str | PathLike[str],
    replace: bool,
    resume: bool,
    jobs: int | None,
    progress: Callable[[int, int], object] | None,
    tasks: object | None,
) -> int: ...
def follow(
    study: str,
    settings: list[str],
    path: str | PathLike[str],
    replace: bool,
    resume: bool,
    progress: Callable[[int, int], object] | None,
) -> list[str]: ...
def certify(
    path: str,
    target: str,
    digits: int | None,
    oracle: bool,
    progress: Callable[[float, float], object] | None,
) -> tuple[_Told, list[str], str | None]: ...
def compare(
    reference: str,
    candidate: str,
    map: str | PathLike[str] | None,
    columns: list[str],
    events: Path | None,
    time_offset: str | None,
    velocity_tolerance: str | None,
    hysteresis: float | None,
    max_wall_time: str | None,
    require: list[str],
    progress: Callable[[float, float], object] | None,
) -> _Told: ...
def modes(kind: str, text: str, settings: list[str]) -> _Told: ...
def cycle(
    kind: str,
    text: str,
    settings: list[str],
    from_initial: bool,
    period: float | None,
    periods: int | None,
    place: tuple[int, int] | None,
    path: str,
    replace: bool,
) -> _Told: ...
def cases() -> list[tuple[str, str]]: ...
