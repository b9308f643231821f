"""How many digits of a run are true."""

from __future__ import annotations

import html
import math
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._case import CaseLike, Overrides, PathLike
from ._command import Report, in_python, named, worded
from ._errors import FileError, InputError
from ._open import open as open_file, open_run
from ._progress import RunProgress, shown
from ._run import Run, run, structured
from ._scratch import Scratch

MOST_ROWS = 20
"""Of events in a notebook: the first half of them, and the last."""

MOST_DIGITS = 16
"""That a double holds."""


def digits_of(time: float, uncertainty: float | None) -> int:
    """Significant decimal digits of a time that are true."""
    if uncertainty is None or not math.isfinite(uncertainty):
        return 0
    if uncertainty <= 0.0 or time <= 0.0:
        return MOST_DIGITS
    return min(max(math.floor(math.log10(time / uncertainty)), 0), MOST_DIGITS)


def _as_of_a_run(row: dict[str, Any]) -> dict[str, Any]:
    """An event of the certificate of a run, or of that of a cycle, whose times are decimals with their own uncertainty."""
    time = row["time"]
    if not isinstance(time, dict):
        return row
    return {**row, "time": time["value"], "uncertainty": time["uncertainty"], "verdict": "converged"}


class Certificate(Report):
    """The certificate of a run by ``stickslip certify``. ``print(certificate)`` shows its report.

    :ivar document: the dictionary that ``--json`` prints.
    :ivar warnings: its messages on standard error.
    :ivar shortfall: why requested digits (``digits=``) were not met, or why it did not converge; ``None`` if all is met.
    :ivar run: the run with its certificate: ``run.events`` has ``time_uncertainty`` (s), and :meth:`Run.table` has
        ``"certificate"`` and ``"sensitivity"``.
    """

    def __init__(
        self, outcome: tuple[tuple[str, str], list[str], str | None], names: dict[str, str], file: str, scratch: Scratch
    ) -> None:
        told, warnings, shortfall = outcome
        super().__init__(told, names)
        # Where the file is for now is nobody's business.
        self.document.pop("file", None)
        self.warnings = [in_python(named(warning, names)) for warning in warnings]
        self.shortfall = None if shortfall is None else in_python(named(shortfall, names))
        self.run = open_run(file, scratch)
        self._file = Path(file)

    @property
    def events(self) -> NDArray[np.void]:
        """Every event: ``time`` (s), ``kind``, ``uncertainty`` (s, how far from the exact solution it can be; NaN unless it is
        converged), ``digits`` (significant decimal digits of the time that are true), ``verdict`` (in words), ``true_error`` (s,
        own less exact; NaN without the exact solver). For a cycle, times count from the start of its period, and each is converged; every
        true digit is in ``document``."""
        rows = [_as_of_a_run(row) for row in self.document.get("events", [])]

        def number(value: float | None) -> float:
            return math.nan if value is None else value

        return structured(
            {
                "time": np.array([row["time"] for row in rows], dtype=np.float64),
                "kind": np.array([row["kind"] for row in rows], dtype=str),
                "uncertainty": np.array([number(row["uncertainty"]) for row in rows], dtype=np.float64),
                "digits": np.array([digits_of(row["time"], row["uncertainty"]) for row in rows], dtype=np.int64),
                "verdict": np.array([row["verdict"] for row in rows], dtype=str),
                "true_error": np.array([number(row.get("true_error")) for row in rows], dtype=np.float64),
            }
        )

    @property
    def digits(self) -> int | None:
        """The fewest digits of any event; ``None`` without events."""
        events = self.events
        return int(events["digits"].min()) if len(events) else None

    @property
    def converged(self) -> bool:
        """Whether every event is converged."""
        return bool((self.events["verdict"] == "converged").all())

    @property
    def sensitivities(self) -> list[dict[str, Any]]:
        """The effect of each parameter on the events: key, unit, derivatives of the event times and more."""
        found: list[dict[str, Any]] = self.document.get("sensitivity", [])
        return found

    def save(self, path: PathLike, *, replace: bool = False) -> Path:
        """Writes the result file with its certificate, and returns where it is.

        An earlier result of this program there is replaced, any other file only with ``replace``.
        """
        target = Path(path)
        if target.exists() and not replace:
            try:
                open_file(target)
            except FileError:
                text = f"{target}: exists and is not a result of this program; choose another name, or replace it with replace=True"
                raise FileError(text) from None
        beside = None
        try:
            # Under its name only when it is whole.
            with tempfile.NamedTemporaryFile(dir=target.parent, prefix=f".{target.name}-", delete=False) as file:
                beside = file.name
                with self._file.open("rb") as source:
                    shutil.copyfileobj(source, file)
            shutil.copymode(self._file, beside)
            os.replace(beside, target)
        except OSError as error:
            if beside is not None and os.path.exists(beside):
                os.remove(beside)
            raise FileError(f"{target}: writing the file failed: {error.strerror}; check the folder") from error
        return target

    def __repr__(self) -> str:
        events = self.events
        least = f", at least {self.digits} digits" if self.converged and len(events) else ""
        state = "converged" if self.converged else "not converged"
        return f"<Certificate: {len(events)} events, {state}{least}>"

    def _repr_html_(self) -> str:
        events = self.events
        rows: list[str] = []
        for number, event in enumerate(events):
            if len(events) > MOST_ROWS and MOST_ROWS // 2 <= number < len(events) - MOST_ROWS // 2:
                if number == MOST_ROWS // 2:
                    rows.append(f"<tr><td colspan='5'>... {len(events) - MOST_ROWS} more ...</td></tr>")
                continue
            time = f"{float(event['time']):.16g}"
            band = float(event["uncertainty"])
            said = [event["kind"], time, "" if math.isnan(band) else f"{band:.1e}", event["digits"], event["verdict"]]
            rows.append("<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in said) + "</tr>")
        heads = ("event", "time, s", "uncertainty, s", "digits", "verdict")
        head = "".join(f"<th>{name}</th>" for name in heads)
        doubts = [self.shortfall] if self.shortfall else []
        doubts += [warning for warning in self.warnings if warning not in doubts]
        said_more = "".join(f"<p>{html.escape(doubt)}</p>" for doubt in doubts)
        table = f"<table><caption>{html.escape(repr(self)[1:-1])}</caption><tr>{head}</tr>{''.join(rows)}</table>"
        return f"{table}{said_more}<details><summary>report</summary><pre>{html.escape(str(self))}</pre></details>"


def certify(
    what: Run | CaseLike,
    overrides: Overrides = None,
    *,
    digits: int | None = None,
    oracle: bool = False,
    progress: bool | RunProgress = False,
) -> Certificate:
    """Certifies a run: how far the time of every event can be from the exact solution of the stated model.

    :param what: a :class:`Run`, or a case that is run first, as :func:`run` takes it with ``overrides``.
    :param digits: digits required of every event; unmet ones are in ``certificate.shortfall``.
    :param oracle: also run the exact solver (oracle), in multiple precision, and compare the run with its solution.
    :param progress: of the exact solver: ``True`` shows a bar of tqdm, in a notebook as a widget; a function is called with the
        simulated time and its end, s.
    :raises RunError: the run is not complete, or could not be certified.
    """
    if isinstance(what, Run) and overrides:
        raise InputError("a run is certified as it is; give overrides with a case, or to stickslip.run")
    certified = what if isinstance(what, Run) else run(what, overrides)
    if digits is not None and digits < 1:
        raise InputError(f"digits={digits}: give at least 1")
    scratch = Scratch()
    given, file = os.path.abspath(certified._file()), scratch.file("certified.h5")
    names = {file: "the certificate (keep it with save)"}
    if certified.path is None:
        names[given] = "the run"
    with worded(names), shown(progress, "s") as told:
        outcome = _native.certify(given, file, digits, oracle, told)
    return Certificate(outcome, names, file, scratch)
