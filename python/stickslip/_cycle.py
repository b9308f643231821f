"""Periodic motions: found by Newton's method, whether they are stable or not."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._case import CaseLike, Overrides, PathLike, settings, source
from ._command import Report, worded
from ._errors import InputError
from ._open import open_run
from ._plot import plot_cycle
from ._run import structured
from ._scratch import Scratch


class Cycle(Report):
    """A periodic motion. ``print(cycle)`` shows the report of ``stickslip cycle``.

    :ivar document: the dictionary that ``--json`` prints.
    :ivar run: the run over one period: ``run.trajectory``, ``run.events``, and ``run.at`` for the motion at any time.
    :ivar path: the file of that run; ``None`` if it was not kept.
    """

    def __init__(self, told: tuple[str, str], names: dict[str, str], file: Path, scratch: Scratch | None) -> None:
        super().__init__(told, names)
        self.path = file if scratch is None else None
        if scratch is not None:
            # Where the file is for now is nobody's business.
            self.document.pop("file", None)
        self.run = open_run(file, scratch)

    @property
    def period(self) -> float:
        """s."""
        return float(self.document["period"])

    @property
    def stability(self) -> str:
        """``"stable"``, ``"unstable"`` or ``"neutral"``."""
        return str(self.document["stability"])

    @property
    def amplitude(self) -> float:
        """Half of the range of the position, rad (m in translation); NaN where the contact has no position."""
        amplitude = self.document["amplitude"]
        return math.nan if amplitude is None else float(amplitude)

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Factors of small disturbances in a period, the largest first. 1 along an autonomous motion leads; a stick has an exact
        0. :attr:`multiplier_kinds` says which is which."""
        found = self.document["multipliers"]
        return np.array([complex(one["real"], one["imaginary"]) for one in found], dtype=np.complex128)

    @property
    def multiplier_kinds(self) -> list[str]:
        """Why each multiplier has its value: ``"free"``, ``"along"`` (1, along the motion) or ``"stick"`` (0, exactly)."""
        return [str(one["kind"]) for one in self.document["multipliers"]]

    @property
    def events(self) -> NDArray[np.void]:
        """The events of the period: ``time`` (s, since the start of :attr:`run`), ``kind`` and ``mode_after`` in words."""
        rows = self.document["events"]
        columns = {"time": np.array([row["time"] for row in rows], dtype=np.float64)}
        for name in ("kind", "mode_after"):
            columns[name] = np.array([row[name] for row in rows], dtype=str)
        return structured(columns)

    def plot(self, x: str = "phi1", y: str = "relative_velocity", *, ax: Any = None, **style: Any) -> Any:
        """Draws one channel over another for one period by matplotlib; dots are sticks and slips. Returns the axes.

            cycle.plot()                          # relative velocity over the position of the stator's surface
            cycle.run.plot(window=(0, cycle.period))

        :param ax: axes to draw into; by default a new figure.
        :param style: passed to matplotlib's ``plot``.
        :raises InputError: no such channel, or matplotlib is not installed.
        """
        return plot_cycle(self, x, y, ax=ax, **style)

    def __repr__(self) -> str:
        count = len(self.document["events"])
        return f"<Cycle: period {self.period:.12g} s, {self.stability}, {count} events>"


def cycle(
    case: CaseLike,
    overrides: Overrides = None,
    *,
    start: str = "end",
    period: float | None = None,
    periods: int | None = None,
    branch: int | None = None,
    point: int | None = None,
    output: PathLike | None = None,
    replace: bool = False,
) -> Cycle:
    """Finds the periodic motion of a case, stable or not, with its multipliers.

        cycle = stickslip.cycle("belt-exponential", {"rotor.speed": 0.3})
        cycle.period, cycle.multipliers, cycle.stability

    :param case: as :func:`run` takes it; or the path of the file of a continuation, with ``branch`` and ``point``.
    :param start: ``"end"`` starts from the end of the run of the case, ``"initial"`` from its initial state, for an unstable
        cycle.
    :param period: look for a period of about this length, s.
    :param periods: length of the cycle in drive periods, or in turns if nothing drives the system.
    :param branch: with the file of a continuation, the branch of the cycle.
    :param point: its point on the branch, counted from 0.
    :param output: the result file of one period, which :func:`open` opens again; without it none is kept.
    :param replace: replace any file there.
    :raises InputError: the case has no periodic motion; no such branch or point.
    :raises RunError: none was found; the text says what was tried.
    """
    if start not in ("end", "initial"):
        raise InputError(f'start="{start}": give "end" for the end of the run, or "initial" for the initial state of the case')
    if (branch is None) != (point is None):
        raise InputError("branch and point choose a point of a continuation together; give both")
    if branch is not None and (start != "end" or period is not None or periods is not None):
        raise InputError("branch and point name a cycle that is known already; leave start, period and periods out")
    if period is not None and periods is not None:
        raise InputError("period and periods both give the length of the cycle; leave one of them out")
    if period is not None and not 0 < period < math.inf:
        raise InputError(f"period={period}: give a time greater than 0 s")
    place = None if branch is None or point is None else (branch, point)
    scratch, names = None, {}
    if output is None:
        scratch = Scratch()
        output = scratch.file("cycle.h5")
        names[output] = "the cycle (keep it with output=)"
    file = os.path.abspath(output)
    kind, text = source(case, absolute=True)
    if place is not None and kind == "text":
        raise InputError("branch and point choose a point of a continuation; give the path of its file as the case")
    with worded(names):
        told = _native.cycle(
            kind, text, settings(overrides), start == "initial", period, periods, place, file, replace
        )
    return Cycle(told, names, Path(file), scratch)
