"""A run: its events, its trajectory and its summary."""

from __future__ import annotations

import html
import json
import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._case import CaseLike, Overrides, PathLike, settings, source
from ._errors import FileError, InputError, RunError, StickslipWarning, needs_xarray
from ._plot import Window, plot_run
from ._progress import RunProgress, shown
from ._scratch import Scratch

if TYPE_CHECKING:
    import pandas
    import xarray

SCALES = ("rung", "stretch", "parameter")
"""Of groups with more than one dimension (docs/reference/columns.md), the columns that begin the next."""

COEFFICIENTS = 16
"""Chebyshev coefficients of a piece of the dense output."""


class Table(Mapping[str, NDArray[Any]]):
    """The columns of a table: a mapping from their names to one-dimensional arrays, of one length except in the groups of a
    certificate, which have several dimensions.

    A column becomes an array when it is first asked for, without a copy where the run is in memory, and is the same array
    each time. It is read-only; ``array.copy()`` gives one to write into.
    """

    def __init__(self, native: _native.Run, group: str, columns: list[_native._Column]) -> None:
        self._native = native
        self._group = group
        self._columns = {column[0]: column for column in columns}

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._columns:
            raise KeyError(f"{name}; there are {', '.join(self._columns)}")
        return self._native.column(self._group, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        rows = len(self[next(iter(self))]) if self._columns else 0
        return f"<{self._group}: {rows} rows of {', '.join(self)}>"

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column, as UDUNITS writes it; "1" of a pure number."""
        return {name: column[1] for name, column in self._columns.items()}

    @property
    def descriptions(self) -> dict[str, str]:
        """Description of each column, with the symbol of the paper."""
        return {name: column[2] for name, column in self._columns.items()}

    def flags(self, name: str) -> dict[int, str]:
        """Meaning of the codes of a column; empty if it has none."""
        return dict(self._columns[name][3])

    def dimensions(self) -> dict[str, str]:
        """The dimension of each column: the column that counts its rows."""
        found, dimension = {}, next(iter(self), "")
        for name in self:
            if name in SCALES:
                dimension = name
            found[name] = dimension
        return found

    def words(self, name: str) -> NDArray[np.str_]:
        """A column of codes in words."""
        flags = self.flags(name)
        longest = max((len(word) for word in flags.values()), default=1)
        words = np.zeros(256, dtype=f"U{longest}")
        for code, word in flags.items():
            words[code % 256] = word
        return np.asarray(words[self[name].astype(np.int64) % 256])


class Run:
    """A run of a case, in memory or in a result file.

    :func:`run` computes one, :func:`open` opens one. Columns, units and codes are those of the result file
    (docs/reference/columns.md); all is in SI and radians.
    """

    def __init__(self, native: _native.Run) -> None:
        self._native = native
        self._known_tables: dict[str, Table] | None = None
        self._events: NDArray[np.void] | None = None
        # Of a run in memory the file that others read, once it has been asked for, and its folder.
        self._saved: Path | None = None
        self._scratch: Scratch | None = None
        # Of one from a file, which file that was.
        self._identity: tuple[int, ...] | None = None
        # The case that repeats the run, where the native one has been thinned.
        self._resolved: str | None = None
        # The folder of a file that is gone with the run.
        self._owner: object = None
        # Of one that was pickled: what its file does not keep.
        self._carried: dict[str, Any] = {}

    # ---- what it is

    @property
    def title(self) -> str:
        """Of the case."""
        return self._native.title

    @property
    def status(self) -> str:
        """``"complete"``, ``"interrupted"`` or ``"failed"``."""
        return self._native.status

    @property
    def path(self) -> Path | None:
        """The file that it was opened from; ``None`` for a run in memory."""
        path = self._native.path
        return None if path is None or self._owner is not None else Path(path)

    @property
    def case(self) -> str:
        """The case in SI and in full precision, as TOML: ``stickslip.run(run.case)`` repeats the run."""
        return self._native.resolved if self._resolved is None else self._resolved

    @property
    def case_text(self) -> str:
        """The case as it was given, as TOML."""
        return self._native.case_text

    @property
    def summary(self) -> dict[str, float | int | None]:
        """The summary: the attributes of /stick_slip in a result file, and the number of events.

        ``onset_time``, ``final_stick_time``, the periods in s, ``stick_count``, ``growth_exponent`` and so on; ``None`` if the
        run lacks it. The units are in :attr:`summary_units`.
        """
        found: dict[str, float | int | None] = {"events": self._native.event_count}
        for name, value, _, _ in self._native.quantities:
            count = name in ("stick_count", "slip_count")
            found[name] = None if math.isnan(value) else int(value) if count else value
        return found

    @property
    def summary_units(self) -> dict[str, str]:
        """The unit of each number of :attr:`summary`, as UDUNITS writes it."""
        return {"events": "1", **{name: units for name, _, units, _ in self._native.quantities}}

    @property
    def report(self) -> dict[str, Any] | None:
        """The ``summary`` of ``stickslip run --json``, with the work of the solvers; ``None`` for a run from a file."""
        report = self._carried.get("report", self._native.report)
        return None if report is None else json.loads(report)

    @property
    def warnings(self) -> list[str]:
        """Warnings about the run; none for a run from a file, as files do not keep them."""
        return list(self._carried.get("warnings", self._native.warnings))

    @property
    def witness(self) -> dict[str, Any] | None:
        """The reference check by another method, if it was made; for a run from a file only its ``statement``."""
        witness = self._carried.get("witness", self._native.witness)
        return None if witness is None else json.loads(witness)

    @property
    def meta(self) -> dict[str, str | float]:
        """Versions, platform, method and tolerances."""
        return self._native.meta

    # ---- its rows

    @property
    def _tables(self) -> dict[str, Table]:
        if self._known_tables is None:
            native = self._native
            self._known_tables = {group: Table(native, group, columns) for group, columns in native.tables}
        return self._known_tables

    def table(self, group: str) -> Table:
        """The table of a group of the result file: ``"trajectory"``, ``"events"``, ``"segments"``, ``"stick_slip"``, of a
        certified file ``"certificate"`` and others; :attr:`tables` lists them."""
        if group not in self._tables:
            raise InputError(f"the run has no table {group}; there are {', '.join(self._tables)}")
        return self._tables[group]

    @property
    def tables(self) -> list[str]:
        """The names that :meth:`table` takes."""
        return list(self._tables)

    @property
    def trajectory(self) -> Table:
        """The samples: a mapping from channel to array, one value for each sample.

        ``time`` in s strictly increases; the unit of each channel is in :attr:`units`.
        """
        return self.table("trajectory")

    @property
    def time(self) -> NDArray[np.float64]:
        """The times of the samples, s."""
        return self.trajectory["time"]

    @property
    def units(self) -> dict[str, str]:
        """The unit of each channel of the trajectory."""
        return self.trajectory.units

    @property
    def events(self) -> NDArray[np.void]:
        """The events in order of time: a structured array with the columns of /events.

        ``time`` (s), ``kind`` and ``mode_after`` (in words, such as ``"stick"``), ``sense``, ``segment``, every state as
        ``NAME_before`` and ``NAME_after``, ``internal_force`` (N); with a reference check also ``witness_time`` (s),
        for a certified run ``time_uncertainty`` (s).
        """
        if self._events is None:
            table = self.table("events")
            words = {name: table.words(name) for name in ("kind", "mode_after")}
            columns = {name: words[name] if name in words else table[name] for name in table}
            columns.pop("event", None)
            self._events = structured(columns)
            self._events.flags.writeable = False
        return self._events

    def events_table(self) -> pandas.DataFrame:
        """:attr:`events` as a data frame; the units are in its ``attrs["units"]``."""
        import pandas

        frame = pandas.DataFrame(self.events)
        frame.attrs["units"] = {name: self.table("events").units[name] for name in frame.columns}
        return frame

    def trajectory_with_events(self, *channels: str) -> dict[str, NDArray[Any]]:
        """The samples with two more rows for each event, the states before and after it, in order of time.

        The columns are those of :attr:`trajectory`, and ``event``, the index of the event in :attr:`events` (-1 for a sample),
        and ``side``: -1 before the event, 1 after it, 0 for a sample. The two rows of an event have the same time. Works,
        dissipated energies and the energy residual depend on the past and not on the state: they are NaN in these rows.

        :param channels: only these columns, with ``time``, ``event`` and ``side``; by default all.
        """
        table, events = self.trajectory, self.table("events")
        times, count = events["time"], len(events["time"])
        mode_after = events["mode_after"].astype(np.int64)
        segments = self.table("segments")
        mode_before = np.concatenate([segments["mode"][:1].astype(np.int64), mode_after[:-1]])[:count]
        # A segment begins where the last one ends; an event within a segment leaves it the same.
        segment = events["segment"].astype(np.int64)
        following = np.minimum(segment + 1, max(len(segments["start"]) - 1, 0))
        begins = segments["start"][following] == times if count else np.zeros(0, dtype=bool)
        known: dict[str, tuple[NDArray[Any], NDArray[Any]]] = {
            "time": (times, times),
            "mode": (mode_before, mode_after),
            "segment": (segment, np.where(begins, following, segment)),
            **self._native.at_events(),
        }
        # In front of a sample at the same time, which has the state after the event.
        places = np.repeat(np.searchsorted(table["time"], times), 2)

        def merged(name: str) -> NDArray[Any]:
            column = table[name]
            if f"{name}_before" in events:
                before, after = events[f"{name}_before"], events[f"{name}_after"]
            else:
                before, after = known.get(name, (np.full(count, np.nan), np.full(count, np.nan)))
            both = np.column_stack([before, after]).ravel().astype(column.dtype)
            return np.insert(column, places, both)

        found = {name: merged(name) for name in (dict.fromkeys(("time", *channels)) if channels else table)}
        samples = np.full(len(table["time"]), -1, dtype=np.int64)
        found["event"] = np.insert(samples, places, np.repeat(np.arange(count), 2))
        found["side"] = np.insert(np.zeros(len(samples), dtype=np.int8), places, np.tile([-1, 1], count))
        return found

    def _rows(self, group: str, events: bool) -> tuple[Mapping[str, NDArray[Any]], dict[str, str], dict[str, str]]:
        """Columns with their units and descriptions."""
        table = self.table(group)
        if not events:
            return table, table.units, table.descriptions
        if group != "trajectory":
            raise InputError(f'events=True puts the states at events into the trajectory, and not into "{group}"; leave it out')
        more = {"event": "index of the event, -1 for a sample", "side": "-1 before the event, 1 after it, 0 for a sample"}
        units = {**table.units, **dict.fromkeys(more, "1")}
        return self.trajectory_with_events(), units, {**table.descriptions, **more}

    def to_pandas(self, group: str = "trajectory", *, events: bool = False) -> pandas.DataFrame:
        """A table as a data frame; the units are in its ``attrs["units"]``.

        :param events: of the trajectory, with the rows before and after each event (:meth:`trajectory_with_events`).
        """
        import pandas

        rows, units, _ = self._rows(group, events)
        frame = pandas.DataFrame({name: rows[name] for name in rows})
        frame.attrs["units"] = units
        return frame

    def to_xarray(self, group: str = "trajectory", *, events: bool = False) -> xarray.Dataset:
        """A table as a dataset, as ``xarray.open_dataset(FILE, group=group)`` opens it: the dimension is ``time`` of the
        trajectory and ``event`` of the events, and every variable has ``units`` and ``long_name``. Nothing is copied.

        :param events: of the trajectory, with the rows before and after each event (:meth:`trajectory_with_events`); their time
            is there twice.
        """
        needs_xarray()
        import xarray

        table = self.table(group)
        rows, units, descriptions = self._rows(group, events)
        dimensions = {**dict.fromkeys(rows, "time"), **table.dimensions()}

        def variable(name: str) -> xarray.Variable:
            attributes: dict[str, Any] = {"units": units[name], "long_name": descriptions[name]}
            flags = table.flags(name) if name in table else {}
            if flags:
                attributes["flag_values"] = np.array(list(flags), dtype=rows[name].dtype)
                attributes["flag_meanings"] = " ".join(flags.values())
            return xarray.Variable((dimensions[name],), rows[name], attributes)

        variables = {name: variable(name) for name in rows}
        attributes = {name: value for name, value in self.summary.items() if value is not None and name != "events"}
        dataset = xarray.Dataset(variables, attrs=attributes if group == "stick_slip" else {"title": self.title})
        return dataset.set_coords(sorted(set(dimensions.values())))

    # ---- plots

    def plot(
        self,
        *channels: str,
        window: Window = None,
        ax: Any = None,
        events: bool = True,
        sticks: bool = True,
        **style: Any,
    ) -> Any:
        """Draws channels over time by matplotlib, through the samples and the states at events; sticks are shaded.

            run.plot()                                       # the stick-slip: relative velocity and friction torque
            run.plot("normal_force", window=(6.9, 7.0))

        :param channels: of the trajectory, each in axes of its own; by default the relative velocity and the friction torque.
        :param window: start and end, s; by default the stick-slip.
        :param ax: axes to draw into, as many as channels; by default a new figure.
        :param events: mark sticks and slips by dots, and kicks and the loss of stability by lines.
        :param sticks: shade the sticks.
        :param style: passed to matplotlib's ``plot``.
        :returns: the axes; an array of them for several channels.
        :raises InputError: no such channel, nothing in the window, or matplotlib is not installed.
        """
        return plot_run(self, channels, window=window, ax=ax, events=events, sticks=sticks, **style)

    # ---- dense output

    @property
    def is_dense(self) -> bool:
        """Whether the motion between the samples was kept: see :meth:`at`."""
        return "dense" in self._tables

    def at(
        self, time: ArrayLike, channel: str | None = None, *, side: str = "right"
    ) -> dict[str, NDArray[np.float64]] | NDArray[np.float64]:
        """The motion at any times (s), from its dense output: as accurate as the run itself, not interpolated from samples.

        Returns an array of the shape of ``time`` for one channel, or without a ``channel`` a mapping with all of them; NaN
        outside of the run. At an event there are two values: ``side="right"`` gives the one after it, ``"left"`` before it.

        The run has to have been computed with ``dense=True``.
        """
        if not self.is_dense:
            raise InputError(
                "the motion between the samples was not kept; run the case with dense=True (output.dense=true in a case)"
            )
        if side not in ("left", "right"):
            raise InputError(f'side="{side}": give "right" for the state after an event, or "left" for the one before it')
        pieces, coefficients = self.table("dense"), self.table("dense/coefficients")
        channels = [name for name in coefficients if name != "coefficient"] + list(_native.PRODUCTS)
        if channel is not None and channel not in channels:
            raise InputError(f"the dense output has no channel {channel}; there are {', '.join(channels)}")
        start, end = pieces["start"], pieces["end"]
        t = np.asarray(time, dtype=np.float64)
        flat = np.atleast_1d(t).ravel()
        if len(start) == 0:
            places = None
        elif side == "right":
            places = np.clip(np.searchsorted(start, flat, "right") - 1, 0, len(start) - 1)
        else:
            places = np.clip(np.searchsorted(end, flat, "left"), 0, len(start) - 1)

        def values(name: str) -> NDArray[np.float64]:
            if name in _native.PRODUCTS:
                one, other = _native.PRODUCTS[name]
                return values(one) * values(other) + 0.0
            if places is None:
                return np.full(t.shape, np.nan)
            a, b = start[places], end[places]
            x = (2 * flat - a - b) / (b - a)
            of_pieces = coefficients[name][: len(start) * COEFFICIENTS].reshape(len(start), COEFFICIENTS)
            found = np.polynomial.chebyshev.chebval(x, of_pieces[places].T, tensor=False)
            inside = (a <= flat) & (flat <= b)
            return np.asarray(np.where(inside, found, np.nan).reshape(t.shape))

        if channel is not None:
            return values(channel)
        return {name: values(name) for name in channels}

    # ---- files

    def save(self, path: PathLike, *, replace: bool = False) -> Path:
        """Writes the result file, and returns where it is.

        It is the file that ``stickslip run`` writes (with ``witness=False`` that of ``--no-witness``), byte by byte but for
        /meta, whose ``command_line`` is that of this process, and ``history``. An earlier result of this program there is
        replaced, any other file only with ``replace``. For an unfinished run it is the partial file,
        ``NAME.partial.h5``.
        """
        return Path(self._native.save(os.fspath(path), replace))

    def _file(self) -> Path:
        """A file with this run: that which it is from, or one that is gone with it."""
        if self._native.path is not None:
            if self._identity is not None and self._identity != identity(self._native.path):
                raise FileError(f"{self._native.path}: has been replaced or changed since it was opened; open it again")
            return Path(self._native.path)
        if self._saved is None:
            self._scratch = Scratch()
            self._saved = self.save(self._scratch.file("run.h5"))
        return self._saved

    def __reduce__(self) -> tuple[Callable[..., Run], tuple[Any, ...]]:
        """Pickled, a run from a file is the name of the file; any other is the content of its file."""
        path = self.path
        if path is not None:
            return _of_file, (os.fspath(self._file()), self._identity)
        carried = {"report": self._native.report, "warnings": self._native.warnings, "witness": self._native.witness}
        return _of_content, (self._file().read_bytes(), {**carried, **self._carried}, self._resolved)

    # ---- how it looks

    def _caption(self) -> str:
        method = self.meta.get("method", "")
        where = self.path or "in memory"
        return f"{self.title} ({method}, rtol {self.meta.get('rtol', math.nan):.3g}, {self.status}, {where})"

    def __repr__(self) -> str:
        lines = self._native.headline
        width = max((len(name) for name, _, _ in lines), default=0)
        warned = (f"  warning: {warning}" for warning in self.warnings)
        return "\n".join([self._caption(), *(f"  {name:<{width}}  {value}" for name, value, _ in lines), *warned])

    def _repr_html_(self) -> str:
        lines = self._native.headline
        with_paper = any(paper for _, _, paper in lines)
        head = "<tr><th></th><th>this run</th><th>paper</th></tr>" if with_paper else ""
        rows = []
        for line in lines:
            cells = [html.escape(cell) for cell in line]
            paper = f"<td>{cells[2]}</td>" if with_paper else ""
            rows.append(f"<tr><td style='text-align:left'>{cells[0]}</td><td>{cells[1]}</td>{paper}</tr>")
        warned = "".join(f"<p>warning: {html.escape(warning)}</p>" for warning in self.warnings)
        return f"<table><caption>{html.escape(self._caption())}</caption>{head}{''.join(rows)}</table>{warned}"


def structured(columns: Mapping[str, NDArray[Any]]) -> NDArray[np.void]:
    """A structured array of columns of one length."""
    lengths = [len(column) for column in columns.values()]
    rows = np.empty(lengths[0], dtype=[(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        rows[name] = column
    return rows


def identity(path: PathLike) -> tuple[int, ...] | None:
    """What tells a file from another that has come in its place; ``None`` if there is none."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _of_file(path: str, known: tuple[int, ...] | None) -> Run:
    made = Run(_native.open_result(path))
    made._identity = known
    # Another file that has come there is none of this run.
    made._file()
    return made


def _of_content(content: bytes, carried: dict[str, Any], resolved: str | None) -> Run:
    scratch = Scratch()
    path = scratch.file("run.h5")
    Path(path).write_bytes(content)
    made = Run(_native.open_result(path))
    made._owner, made._carried, made._resolved = scratch, carried, resolved
    return made


def run(
    case: CaseLike = "paper",
    overrides: Overrides = None,
    *,
    method: str | None = None,
    rtol: float | None = None,
    end_time: float | str | None = None,
    dense: bool = False,
    witness: bool | None = None,
    trajectory: bool = True,
    progress: bool | RunProgress = False,
) -> Run:
    """Integrates a case in memory.

    :param case: a built-in name (:func:`cases`), the path of a TOML file or of a result to repeat, a TOML text, or a nested
        mapping such as ``{"friction": {"decay": "5 s/rad"}, ...}``.
    :param overrides: dotted key to value, such as ``{"friction.decay": "4.8 s/rad", "torsion.damping": 22.6}``: a number in
        SI, a text with a unit, a bool, a list or a mapping.
    :param method: as ``--method``: ``"cvode"``, ``"series"``, ``"cvode-bdf"`` ...
    :param rtol: the relative tolerance, ``solver.rtol``.
    :param end_time: s, or a text with a unit.
    :param dense: keep the motion between the samples, for :meth:`Run.at`.
    :param witness: make a reference check (witness), as the program does: a second run by another method. If the two do not
        agree, the run is repeated with finer settings, if these help. By default it is made unless the events are kept alone.
    :param trajectory: ``False`` keeps the events alone, which is several times faster, for many runs.
    :param progress: ``True`` shows a bar of tqdm, or the simulated time on standard error; a function is called with the simulated
        time and the end of the run, s. With a reference check both start again.
    :raises CaseError: with every problem of the case, its line and key.
    :raises RunError: the run failed; ``error.run`` is the run up to the failure.
    :warns StickslipWarning: a warning about the run, such as that its onset is amplified rounding.
    :raises KeyboardInterrupt: Ctrl-C ended the run.
    """
    kind, text = source(case)
    if not trajectory and (dense or (overrides or {}).get("output.dense")):
        raise InputError("dense=True keeps the motion, and trajectory=False does not; leave one of them out")
    others = {"solver.method": method, "solver.rtol": rtol, "output.end_time": end_time, "output.dense": dense or None}
    chosen = settings(overrides, **others)
    asked = trajectory if witness is None else witness
    with shown(progress, "s") as told:
        native = _native.run(kind, text, chosen, asked, trajectory, told)
    made = Run(native)
    if not trajectory:
        made._resolved = _native.resolve(kind, text, chosen)
    for warning in made.warnings:
        warnings.warn(warning, StickslipWarning, stacklevel=2)
    if native.failure is not None:
        error = RunError(native.failure)
        error.run = made
        raise error
    return made
