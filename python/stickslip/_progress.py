"""Progress of long computations: a bar of tqdm, a count on standard error, or a function."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Union

Progress = Callable[[int, int], object]
"""Called with what is done, of how much."""

RunProgress = Callable[[float, float], object]
"""Called with the simulated time and the end of the run, s."""


def _tqdm() -> Any:
    """The bar that fits a notebook or a terminal; ``None`` without tqdm."""
    try:
        with warnings.catch_warnings():
            # In a notebook without ipywidgets it takes the bar of a terminal.
            warnings.simplefilter("ignore")
            from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm


@contextmanager
def shown(progress: Union[bool, Callable[[Any, Any], object]], unit: str) -> Iterator[Union[Callable[[Any, Any], object], None]]:
    """What to call with what is done, of how much: a bar for ``True``, else the function itself, or ``None``."""
    if progress is not True:
        yield progress or None
        return
    tqdm = _tqdm()
    if tqdm is None:
        told: list[float] = []

        def count(done: float, total: float) -> None:
            told[:] = [done, total]
            print(f"\r{done:.6g} of {total:.6g} {unit}", end="", file=sys.stderr, flush=True)

        yield count
        if told:
            # The last part of a computation may be too short to be told.
            print(f"\r{told[1]:.6g} of {told[1]:.6g} {unit}", file=sys.stderr, flush=True)
        return
    bars: list[Any] = []

    def update(done: float, total: float) -> None:
        if not bars:
            bars.append(tqdm(total=total, unit=f" {unit}"))
        bars[0].total = total
        bars[0].n = done
        bars[0].refresh()

    try:
        yield update
        for bar in bars:
            update(bar.total, bar.total)
    finally:
        for bar in bars:
            bar.close()
