"""Periodic motions: found by Newton's method, whether they are stable or not."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._case import CaseLike, Overrides, PathLike, settings, source
from ._command import command
from ._errors import InputError
from ._open import open as open_file
from ._plot import plot_cycle
from ._run import Run


class Cycle:
    """A periodic motion. ``print(cycle)`` shows the report of ``stickslip cycle``.

    :ivar document: the dictionary that ``--json`` prints.
    :ivar run: the run over one period: ``run.trajectory``, ``run.events``, and ``run.at`` for the motion at any time.
    :ivar path: the file of that run; ``None`` if it was not kept.
    """

    def __init__(self, text: str, document: dict[str, Any], file: Path, folder: Path | None) -> None:
        self._text = text
        self._file = os.fspath(file)
        self.path = file if folder is None else None
        self.document = document
        if folder is not None:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
            # Where the file is for now is nobody's business.
            self.document.pop("file", None)
        run = open_file(file)
        assert isinstance(run, Run)
        if folder is not None:
            # The file is there as long as anything that reads it.
            run._owner = self
        self.run = run

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
        return float("nan") if amplitude is None else float(amplitude)

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
            words = [row[name] for row in rows]
            columns[name] = np.array(words, dtype=f"U{max(map(len, words), default=1)}")
        events = np.empty(len(rows), dtype=[(name, column.dtype) for name, column in columns.items()])
        for name, column in columns.items():
            events[name] = column
        return events

    def plot(self, x: str = "phi1", y: str = "relative_velocity", *, ax: Any = None, **style: Any) -> Any:
        """Draws one channel over another for one period by matplotlib; dots are sticks and slips. Returns the axes.

            cycle.plot()                          # relative velocity over the position of the stator's surface
            cycle.run.plot(window=(0, cycle.period))

        :param ax: axes to draw into; by default a new figure.
        :param style: passed to matplotlib's ``plot``.
        :raises InputError: no such channel, or matplotlib is not installed.
        """
        return plot_cycle(self, x, y, ax=ax, **style)

    def __str__(self) -> str:
        if self.path is not None:
            return self._text.rstrip()
        # Without the name of the file, which is not there for long.
        return "\n".join(line for line in self._text.rstrip().splitlines() if line != self._file).rstrip()

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
    folder = Path(tempfile.mkdtemp(prefix="stickslip-"))
    try:
        kind, text = source(case)
        known_as = {}
        if kind == "text":
            (folder / "case.toml").write_text(text, encoding="utf-8")
            text = os.fspath(folder / "case.toml")
            known_as[text] = "the case"
        elif kind != "built-in":
            text = os.path.abspath(text)
        file = folder / "cycle.h5" if output is None else Path(os.path.abspath(output))
        if output is None:
            known_as[os.fspath(file)] = "the cycle (keep it with output=)"
        arguments = ["cycle", text, "-o", os.fspath(file)]
        if start != "end":
            arguments += ["--from", start]
        for name, value in (("period", period), ("periods", periods), ("branch", branch), ("point", point)):
            if value is not None:
                arguments.append(f"--{name}={value}")
        if replace:
            arguments.append("--force")
        arguments += [f"--set={setting}" for setting in settings(overrides)]
        report, document, _, _ = command(arguments, known_as, keeps=False)
        # Of a file that is not kept, the report names none.
        report = "\n".join(line for line in report.splitlines() if line not in known_as.values())
        made = Cycle(report, json.loads(document or "{}"), file, folder if output is None else None)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    if output is not None:
        shutil.rmtree(folder, ignore_errors=True)
    return made
