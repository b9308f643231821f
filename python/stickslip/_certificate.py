"""How many digits of a run are true."""

from __future__ import annotations

import html
import json
import math
import os
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._case import CaseLike, Overrides, PathLike
from ._command import command
from ._errors import FileError, InputError
from ._open import open as open_file
from ._run import Run, run

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


class Certificate:
    """The certificate of a run by ``stickslip certify``. ``print(certificate)`` shows its report.

    :ivar document: the dictionary that ``--json`` prints.
    :ivar warnings: its messages on standard error.
    :ivar shortfall: why requested digits (``digits=``) were not met, or why it did not converge; ``None`` if all is met.
    :ivar run: the run with its certificate: ``run.events`` has ``time_uncertainty`` (s), and :meth:`Run.table` has
        ``"certificate"`` and ``"sensitivity"``.
    """

    def __init__(self, outcome: tuple[str, str | None, list[str], str | None], folder: Path, file: Path) -> None:
        text, document, warnings, shortfall = outcome
        self._text = text
        self._file = file
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self.document: dict[str, Any] = json.loads(document or "{}")
        # Where the file is for now is nobody's business.
        self.document.pop("file", None)
        self.warnings = warnings
        self.shortfall = shortfall
        certified = open_file(file)
        assert isinstance(certified, Run)
        # The file is there as long as anything that reads it.
        certified._owner = self
        self.run = certified

    @property
    def events(self) -> NDArray[np.void]:
        """Every event: ``time`` (s), ``kind``, ``uncertainty`` (s, how far from the exact solution it can be; NaN unless it is
        converged), ``digits`` (significant decimal digits of the time that are true), ``verdict`` (in words), ``true_error`` (s,
        own less exact; NaN without the exact solver). For a cycle, times count from the start of its period, and each is converged; every
        true digit is in ``document``."""
        rows = [_as_of_a_run(row) for row in self.document.get("events", [])]

        def number(value: float | None) -> float:
            return math.nan if value is None else value

        kinds = [row["kind"] for row in rows]
        verdicts = [row["verdict"] for row in rows]
        times = np.array([row["time"] for row in rows], dtype=np.float64)
        columns = {
            "time": times,
            "kind": np.array(kinds, dtype=f"U{max(map(len, kinds), default=1)}"),
            "uncertainty": np.array([number(row["uncertainty"]) for row in rows], dtype=np.float64),
            "digits": np.array([digits_of(row["time"], row["uncertainty"]) for row in rows], dtype=np.int64),
            "verdict": np.array(verdicts, dtype=f"U{max(map(len, verdicts), default=1)}"),
            "true_error": np.array([number(row.get("true_error")) for row in rows], dtype=np.float64),
        }
        events = np.empty(len(rows), dtype=[(name, column.dtype) for name, column in columns.items()])
        for name, column in columns.items():
            events[name] = column
        return events

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

    def __str__(self) -> str:
        # Without the name of the file, which is not there for long.
        lines = self._text.rstrip().splitlines()
        return "\n".join(line for line in lines if line != str(self._file)).rstrip()

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
) -> Certificate:
    """Certifies a run: how far the time of every event can be from the exact solution of the stated model.

    :param what: a :class:`Run`, or a case that is run first, as :func:`run` takes it with ``overrides``.
    :param digits: digits required of every event; unmet ones are in ``certificate.shortfall``.
    :param oracle: also run the exact solver (oracle), in multiple precision, and compare the run with its solution.
    :raises RunError: the run is not complete, or could not be certified.
    """
    if isinstance(what, Run) and overrides:
        raise InputError("a run is certified as it is; give overrides with a case, or to stickslip.run")
    certified = what if isinstance(what, Run) else run(what, overrides)
    folder = Path(tempfile.mkdtemp(prefix="stickslip-"))
    try:
        file = folder / "certified.h5"
        arguments = ["certify", os.path.abspath(certified._file()), "-o", os.fspath(file)]
        if digits is not None:
            arguments += ["--digits", str(digits)]
        if oracle:
            arguments.append("--oracle")
        names = {} if certified.path is not None else {os.fspath(certified._file()): "the run"}
        return Certificate(command(arguments, names), folder, file)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
