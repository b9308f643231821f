"""The result of another solver compared with a reference."""

from __future__ import annotations

import html
import json
import os
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._case import PathLike
from ._command import Report, in_python, worded
from ._errors import FileError, InputError
from ._plot import plot_comparison
from ._progress import RunProgress, shown
from ._run import Run
from ._scratch import Scratch

Events = Union[Mapping[str, ArrayLike], "np.ndarray[Any, Any]"]


class Comparison(Report):
    """The result of ``stickslip compare``. ``print(comparison)`` shows its report.

    :ivar document: the dictionary that ``--json`` prints for the candidate; its entries are attributes as well,
        such as ``comparison.verdict`` or ``comparison.reference_events``.
    :ivar shortfalls: the requirements that were not met, in words.
    """

    def __init__(self, told: tuple[str, str], names: Mapping[str, str]) -> None:
        super().__init__(told, names)
        self.shortfalls: list[str] = self.document["shortfalls"]
        self.document = self.document["comparisons"][0]

    @property
    def verdict(self) -> str:
        """In one line."""
        return str(self.document["verdict"])

    @property
    def causes(self) -> list[dict[str, Any]]:
        """The causes that reproduce the differences, the most fundamental first."""
        return list(self.document["causes"])

    def plot(self, *, ax: Any = None, **style: Any) -> Any:
        """Draws the error of each matched event over its time by matplotlib, on a logarithmic scale. Returns the axes.

        :param ax: axes to draw into; by default a new figure.
        :param style: passed to matplotlib's ``plot``.
        :raises InputError: no event is matched, or matplotlib is not installed.
        """
        return plot_comparison(self, ax=ax, **style)

    def __getattr__(self, name: str) -> Any:
        document = self.__dict__.get("document", {})
        if name in document:
            return document[name]
        raise AttributeError(f"a comparison has no {name}; there are {', '.join(document)}")

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.document})

    def __repr__(self) -> str:
        return f"<Comparison: {self.verdict}>"

    def _repr_html_(self) -> str:
        lines = [self.verdict, *self.shortfalls]
        text = "".join(f"<p>{html.escape(in_python(line))}</p>" for line in lines)
        return f"{text}<details open><summary>report</summary><pre>{html.escape(str(self))}</pre></details>"


def _arrays(folder: Path, arrays: dict[str, ArrayLike], stem: str) -> Path:
    found = {}
    for name, values in arrays.items():
        array = np.asarray(values)
        if array.dtype.kind == "O" and all(isinstance(value, str) for value in array.flat):
            array = array.astype(str)
        if array.ndim != 1:
            raise InputError(f"{name}: give an array of one dimension, not one of shape {array.shape}")
        if array.dtype.kind not in "iufbU":
            raise InputError(f"{name}: give real numbers, not {array.dtype}")
        found[name] = array if array.dtype.kind == "U" else array.astype(np.float64)
    lengths = {name: len(array) for name, array in found.items()}
    if len(set(lengths.values())) > 1:
        sizes = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"the arrays are of different lengths: {sizes}; give one value of each for every time")
    if stem == "events":
        path = folder / "events.csv"
        rows = zip(*(array.tolist() for array in found.values()))
        lines = [",".join(found), *(",".join(map(repr_of, row)) for row in rows)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path
    path = folder / "candidate.npz"
    # Not compressed: what reads it goes through it block by block. Without savez, which takes some names for its own arguments.
    with zipfile.ZipFile(path, "w") as archive:
        for name, array in found.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array)
    return path


def repr_of(value: Any) -> str:
    """A number with all its digits, a text as it is."""
    return value if isinstance(value, str) else repr(value)


def compare(
    reference: Run | PathLike,
    candidate: Run | PathLike | None = None,
    *,
    units: Mapping[str, str] | None = None,
    events: Events | PathLike | None = None,
    mapping: PathLike | None = None,
    columns: Mapping[str, str] | None = None,
    time_offset: float | str | None = None,
    velocity_tolerance: float | str | None = None,
    hysteresis: float | None = None,
    max_wall_time: float | str | None = None,
    require: Sequence[str] = (),
    progress: bool | RunProgress = False,
    **arrays: ArrayLike,
) -> Comparison:
    """Compares a candidate with a reference.

    The candidate is a file that ``stickslip compare`` reads, a :class:`Run`, arrays by keyword, or events alone:

        stickslip.compare(reference, time=t, relative_velocity=w)
        stickslip.compare(reference, time=t, phi1=v, theta_dot=n, units={"theta_dot": "rpm"})
        stickslip.compare(reference, events={"time": times, "kind": kinds})

    :param reference: a run, or the path of a result file, certified or not, or of a problem of the benchmark set.
    :param units: units of arrays that are not in SI.
    :param events: events that the candidate states, instead of finding them by its relative velocity: columns ``time`` (s) and
        ``kind``, or a file.
    :param mapping: a mapping file, as ``--map``; ``columns`` are single ones, ``{"relative_velocity": "w:rpm"}``, of a file.
    :param time_offset: added to the candidate's times, s or with a unit; ``"auto"`` finds it.
    :param velocity_tolerance: a relative velocity up to this counts as zero, rad/s or with a unit.
    :param hysteresis: a stick ends where the relative velocity exceeds this many tolerances.
    :param max_wall_time: the search for causes ends after this wall time, s or with a unit; 10 min by default.
    :param require: requirements such as ``"onset<1e-6"``; unmet ones are in ``comparison.shortfalls``.
    :param progress: ``True`` shows a bar of tqdm, in a notebook as a widget; a function is called with the share that is done, of 1.
    :raises InputError: a candidate that cannot be compared.
    """
    if candidate is not None and arrays:
        raise InputError(f"give a candidate, or arrays ({', '.join(arrays)}), not both")
    if candidate is None and not arrays and events is None:
        raise InputError("there is no candidate: give its file, or arrays such as time=t, relative_velocity=w")
    scratch = Scratch()
    # What is written for the library alone is called by what it is.
    names = {scratch.file("candidate.npz"): "the arrays", scratch.file("events.csv"): "the events"}
    event_file = None
    if events is not None:
        if isinstance(events, (str, os.PathLike)):
            event_file = Path(events)
        else:
            columns_given = list(events.dtype.names or ()) if isinstance(events, np.ndarray) else list(events)
            missing = [column for column in ("time", "kind") if column not in columns_given]
            if missing:
                raise InputError(f"events have no {' and no '.join(missing)}: give the columns time (s) and kind")
            event_file = _arrays(scratch.folder, {"time": events["time"], "kind": events["kind"]}, "events")
    if arrays:
        if "time" not in arrays:
            raise InputError("there is no array time: give the times of the samples, s")
        candidate = _arrays(scratch.folder, dict(arrays), "candidate")
    elif candidate is None:
        candidate, event_file = event_file, None

    def path_of(given: Run | PathLike, in_memory: str) -> str:
        file = given._file() if isinstance(given, Run) else Path(given)
        if not file.exists():
            raise FileError(f"{file}: no such file; check the name")
        path = os.path.abspath(file)
        if not isinstance(given, Run):
            names.setdefault(path, os.fspath(given))
        elif given.path is None:
            names[path] = in_memory
        return path

    assert candidate is not None
    against, path = path_of(reference, "the reference"), path_of(candidate, "the run")
    single = [f"{channel}={column}" for channel, column in (columns or {}).items()]
    for channel, unit in (units or {}).items():
        single.append(f"{channel}={channel}:{unit}")
        names[f"--column {single[-1]}"] = f"units={{{json.dumps(channel)}: {json.dumps(unit)}}}"
    texts = (None if value is None else str(value) for value in (time_offset, velocity_tolerance, max_wall_time))
    offset, tolerance, longest = texts
    with worded(names), shown(progress, "comparison") as told:
        compared = _native.compare(
            against, path, mapping, single, event_file, offset, tolerance, hysteresis, longest, list(require), told
        )
    return Comparison(compared, names)
