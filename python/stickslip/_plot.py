"""Plots by matplotlib, which is imported when one is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

Window = Union[tuple[float, float], "list[float]", None]

# The colours of the program's figures (Okabe and Ito).
BLUE, VERMILLION, GREEN, PURPLE, GREY, YELLOW = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#787878", "#F0E442"
CURVES = (BLUE, VERMILLION, GREEN, PURPLE, "#000000")
OF_EVENTS = {"stick": VERMILLION, "slip": BLUE, "reversal": PURPLE, "kick": GREEN, "destabilised": "#000000"}
"""Of the vertical lines; changes of stability after the first are left out, as the grown oscillation causes them."""

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MOST_LINES = 150
"""Of events: more would cover the curve."""


def pyplot() -> Any:
    """matplotlib.pyplot, or what to install."""
    try:
        import matplotlib.pyplot
    except ImportError as error:
        raise InputError("plots are drawn by matplotlib, which is not installed: pip install matplotlib") from error
    return matplotlib.pyplot


def unit_of(units: str) -> str:
    """A unit of UDUNITS in print: ``"rad s-1"`` becomes ``"rad s⁻¹"``."""
    words = []
    for word in units.split(" "):
        stem = word.rstrip("-0123456789")
        words.append(stem + word[len(stem) :].translate(SUPERSCRIPTS) if stem else word)
    return " ".join(words)


def label_of(name: str, units: str) -> str:
    """Of an axis."""
    words = name.replace("_", " ")
    if units == "N":
        # In translation the column of the friction torque holds a force.
        words = words.replace("torque", "force")
    return words if units in ("", "1") else f"{words} ({unit_of(units)})"


def axes_for(count: int, ax: Any, *, sharex: bool = True) -> list[Axes]:
    """As many axes as wanted: the given ones, or new ones below each other."""
    if ax is None:
        figure, made = pyplot().subplots(
            count, 1, sharex=sharex, squeeze=False, figsize=(7.0, 1.4 + 2.1 * count), layout="constrained"
        )
        return list(made[:, 0])
    given = list(np.atleast_1d(np.asarray(ax, dtype=object)).ravel())
    if len(given) != count:
        raise InputError(f"there are {count} channels, and ax has {len(given)} axes; give one for each")
    return given


def returned(axes: list[Axes]) -> Any:
    """One, or an array of several."""
    return axes[0] if len(axes) == 1 else np.array(axes, dtype=object)


# ---- a run


def sticks_of(run: Any) -> list[tuple[float, float]]:
    """Start and end of each stick, s."""
    segments = run.table("segments")
    stuck = segments.words("mode") == "stick"
    found: list[tuple[float, float]] = []
    for start, end in zip(segments["start"][stuck], segments["end"][stuck]):
        if found and found[-1][1] == start:
            found[-1] = (found[-1][0], float(end))
        else:
            found.append((float(start), float(end)))
    return found


def stick_slip_window(run: Any) -> tuple[float, float]:
    """From the first stick or slip to the last, with a margin; the whole run without any."""
    events = run.events
    times = events["time"][np.isin(events["kind"], ("stick", "slip"))]
    first, last = float(run.time[0]), float(run.time[-1])
    if len(times) == 0:
        return first, last
    if len(times) == 1:
        natural = run.summary.get("natural_period")
        margin = 5 * natural if natural else 0.05 * (last - first)
    else:
        margin = 0.06 * float(times[-1] - times[0])
    return max(first, float(times[0]) - margin), min(last, float(times[-1]) + margin)


def seen(window: Window, whole: tuple[float, float]) -> tuple[float, float]:
    """A window that was given, or the whole."""
    if window is None:
        return whole
    try:
        start, end = (float(bound) for bound in window)
    except (TypeError, ValueError) as error:
        raise InputError(f"window={window!r}: give start and end in s, such as window=(6.97, 6.99)") from error
    if not start < end:
        raise InputError(f"window={window!r}: the start has to be before the end")
    return start, end


def plot_run(
    run: Any,
    channels: Sequence[str],
    *,
    window: Window,
    ax: Any,
    events: bool,
    sticks: bool,
    **style: Any,
) -> Any:
    """See :meth:`Run.plot`."""
    names = list(channels) or ["relative_velocity", "friction_torque"]
    # Before matplotlib is asked for: a wrong name is a wrong name without it, too.
    unknown = [name for name in names if name not in run.trajectory]
    if unknown:
        raise InputError(f"the run has no channel {', '.join(unknown)}; there are {', '.join(run.trajectory)}")
    if len(run.time) == 0:
        raise InputError("the run has no samples; compute it with trajectory=True")
    start, end = seen(window, stick_slip_window(run))
    axes = axes_for(len(names), ax)
    rows = run.trajectory_with_events(*names)
    time = rows["time"]
    # With a sample on either side, so that curves reach the edges.
    inside = slice(max(int(np.searchsorted(time, start)) - 1, 0), int(np.searchsorted(time, end, "right")) + 1)
    if not np.any((time >= start) & (time <= end)):
        raise InputError(f"the run has no sample in the window {start:g} s to {end:g} s; it is from {time[0]:g} s to {time[-1]:g} s")
    marks = run.events
    marks = marks[(marks["time"] >= start) & (marks["time"] <= end) & np.isin(marks["kind"], list(OF_EVENTS))]
    later = np.flatnonzero(marks["kind"] == "destabilised")[1:]
    marks = np.delete(marks, later)
    contact = np.isin(marks["kind"], ("stick", "slip"))
    for number, (name, one) in enumerate(zip(names, axes)):
        if sticks:
            shaded = [(max(begin, start), min(over, end)) for begin, over in sticks_of(run) if over > start and begin < end]
            spans = [(begin, over - begin) for begin, over in shaded]
            one.broken_barh(
                spans, (0, 1), transform=one.get_xaxis_transform(), color=YELLOW, alpha=0.34, linewidth=0, zorder=0
            )
        if events:
            # Where sticks are shaded, their edges are the sticks and slips.
            shown = marks[~contact] if sticks or len(marks) > MOST_LINES else marks
            for mark in shown:
                one.axvline(mark["time"], color=OF_EVENTS[str(mark["kind"])], linewidth=0.8, linestyle="--", zorder=1)
        values = rows[name]
        # Values that the state at an event does not determine are left out there, and the curve goes through the samples.
        known = np.isfinite(values[inside])
        drawn = {"color": CURVES[number % len(CURVES)], "linewidth": 1.2, **style}
        one.plot(time[inside][known], values[inside][known], **drawn)
        if events and len(marks) <= MOST_LINES:
            for kind in ("stick", "slip"):
                at = np.isin(rows["event"][inside], np.flatnonzero(run.events["kind"] == kind)) & (rows["side"][inside] > 0)
                at &= known & (time[inside] >= start) & (time[inside] <= end)
                one.plot(time[inside][at], values[inside][at], "o", color=OF_EVENTS[kind], markersize=3, label=kind)
        one.set_ylabel(label_of(name, run.units[name]))
        one.set_xlim(start, end)
    axes[-1].set_xlabel("time (s)")
    if ax is None:
        axes[0].set_title(run.title, fontsize="medium", loc="left")
        handles, _ = axes[0].get_legend_handles_labels()
        if axes[0].collections and axes[0].collections[0].get_paths():
            handles.append(pyplot().Rectangle((0, 0), 1, 1, color=YELLOW, alpha=0.34, linewidth=0, label="sticking"))
        if handles:
            # Above the axes, where it covers no curve.
            place: dict[str, Any] = {"bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.1, "frameon": False}
            text: dict[str, Any] = {"fontsize": "small", "handletextpad": 0.3, "columnspacing": 1.0}
            axes[0].legend(handles=handles, loc="lower right", ncols=3, **place, **text)
    return returned(axes)


def plot_cycle(cycle: Any, x: str, y: str, *, ax: Any, **style: Any) -> Any:
    """See :meth:`Cycle.plot`."""
    run = cycle.run
    for name in (x, y):
        if name not in run.trajectory:
            raise InputError(f"the run has no channel {name}; there are {', '.join(run.trajectory)}")
    (one,) = axes_for(1, ax)
    rows = run.trajectory_with_events(x, y)
    known = np.isfinite(rows[x]) & np.isfinite(rows[y])
    one.plot(rows[x][known], rows[y][known], **{"color": BLUE, "linewidth": 1.2, **style})
    for kind in ("stick", "slip"):
        at = np.isin(rows["event"], np.flatnonzero(run.events["kind"] == kind)) & (rows["side"] > 0)
        if at.any():
            one.plot(rows[x][at], rows[y][at], "o", color=OF_EVENTS[kind], markersize=4, label=kind)
    one.set_xlabel(label_of(x, run.units[x]))
    one.set_ylabel(label_of(y, run.units[y]))
    if ax is None:
        one.set_title(f"{run.title}: {cycle.stability}, period {cycle.period:.6g} s", fontsize="medium")
        if one.get_legend_handles_labels()[0]:
            one.legend(fontsize="small")
    return one


def plot_comparison(comparison: Any, *, ax: Any, **style: Any) -> Any:
    """See :meth:`Comparison.plot`."""
    rows = (comparison.document.get("event_errors") or {}).get("events") or []
    times, errors = (np.array([row[name] for row in rows], dtype=np.float64) for name in ("time", "error"))
    if len(times) == 0:
        raise InputError("no event of the candidate matches one of the reference, so there is no error to draw")
    (one,) = axes_for(1, ax)
    size = np.abs(errors)
    least = float(np.spacing(np.abs(times).max()))
    one.plot(times, np.maximum(size, least), "o", **{"color": BLUE, "markersize": 3.5, **style})
    one.set_yscale("log")
    one.set_xlabel("time of the event in the reference (s)")
    one.set_ylabel("error of the event time (s)")
    if np.any(size < least):
        one.axhline(least, color=GREY, linewidth=0.8, linestyle="--", label="spacing of doubles")
        one.legend(fontsize="small")
    if ax is None:
        one.set_title(comparison.verdict, fontsize="small", wrap=True)
    return one


# ---- datasets


def label_of_variable(variable: xarray.DataArray) -> str:
    """The key of an axis or the description of a quantity, with the unit."""
    name = str(variable.attrs.get("keys") or variable.attrs.get("long_name") or variable.name)
    units = str(variable.attrs.get("units", "1"))
    return f"{name} ({unit_of(units)})" if units not in ("", "1") else name


def set_title(one: Axes, dataset: xarray.Dataset) -> None:
    """That of the study; one of axes given in Python has none."""
    title = str(dataset.attrs.get("title", ""))
    if title != "study":
        one.set_title(title, fontsize="medium")


def is_log(values: NDArray[np.float64]) -> bool:
    """Whether numbers are spaced as on a logarithmic scale, and not evenly."""
    if values.dtype.kind not in "iuf" or len(values) < 3 or np.any(values <= 0):
        return False
    steps, ratios = np.diff(values), np.diff(np.log(values))
    return bool(np.ptp(ratios) < 1e-6 * abs(ratios.mean()) < np.ptp(steps) / abs(steps.mean()))


def axes_of(study: xarray.Dataset) -> list[str]:
    """The axes of a sweep."""
    return [str(name) for name in study.coords if "keys" in study[name].attrs]


def first_quantity(study: xarray.Dataset) -> str:
    """What is drawn if nothing is named."""
    for name in ("stick_count", "attractor_period", "growth_exponent"):
        if name in study and np.isfinite(study[name].values.astype(float)).any():
            return name
    return next(str(name) for name in study.data_vars if study[name].dtype.kind in "iuf")


def plot_sweep(study: xarray.Dataset, quantity: str | None, ax: Any, at: dict[str, Any], **style: Any) -> Any:
    """A line over one axis, a map over two, points of a sample."""
    axes = axes_of(study)
    quantity = first_quantity(study) if quantity is None else quantity
    if quantity not in study.data_vars:
        raise InputError(f"the study has no quantity {quantity}; there are {', '.join(map(str, study.data_vars))}")
    for name in at:
        if name not in axes:
            raise InputError(f"the study has no axis {name}; there are {', '.join(axes)}")
    if "point" in study.dims:
        return plot_points(study, axes, quantity, ax, **style)
    chosen = study.sel(at, method=None if any(study[name].dtype.kind == "U" for name in at) else "nearest") if at else study
    values = chosen[quantity]
    free = [name for name in axes if name in values.dims]
    if len(free) not in (1, 2):
        several = ", ".join(f"{name}={study[name].values[0]!s}" for name in free[2:]) or "none"
        raise InputError(f"the study has {len(free)} axes, and a plot one or two; choose values of the others, such as {several}")
    (one,) = axes_for(1, ax)
    if len(free) == 1:
        one.plot(values[free[0]].values, values.values, **{"color": BLUE, "marker": "o", "markersize": 3, "linewidth": 1.0, **style})
        one.set_ylabel(label_of_variable(values))
    else:
        x, y = free
        mesh = one.pcolormesh(
            chosen[x].values, chosen[y].values, values.transpose(y, x).values.astype(float), **{"shading": "nearest", **style}
        )
        one.figure.colorbar(mesh, ax=one, label=label_of_variable(values))
        one.set_ylabel(label_of_variable(chosen[y]))
        if is_log(chosen[y].values):
            one.set_yscale("log")
    x = free[0]
    one.set_xlabel(label_of_variable(chosen[x]))
    if is_log(chosen[x].values):
        one.set_xscale("log")
    if ax is None:
        set_title(one, study)
    return one


def plot_points(study: xarray.Dataset, axes: list[str], quantity: str, ax: Any, **style: Any) -> Any:
    """Of a sample: the quantity over its only axis, or in colour over the first two; the distribution without an axis."""
    (one,) = axes_for(1, ax)
    values = study[quantity].values.astype(float)
    x = study[axes[0]]
    if len(axes) == 1:
        one.plot(x.values, values, "o", **{"color": BLUE, "markersize": 3, **style})
        one.set_ylabel(label_of_variable(study[quantity]))
    else:
        marks = one.scatter(x.values, study[axes[1]].values, c=values, **{"s": 12, **style})
        one.figure.colorbar(marks, ax=one, label=label_of_variable(study[quantity]))
        one.set_ylabel(label_of_variable(study[axes[1]]))
    one.set_xlabel(label_of_variable(x))
    if ax is None:
        set_title(one, study)
    return one


def words(variable: xarray.DataArray) -> dict[int, str]:
    """Meaning of its codes."""
    codes = np.atleast_1d(variable.attrs.get("flag_values", []))
    return dict(zip((int(code) for code in codes), str(variable.attrs.get("flag_meanings", "")).split()))


def plot_branches(branches: xarray.Dataset, quantity: str | None, ax: Any, **style: Any) -> Any:
    """Branches over the parameter: stable drawn, unstable dashed, special points marked."""
    parameter = str(branches.attrs["number"])
    if quantity is None:
        quantity = "amplitude" if np.isfinite(branches["amplitude"].values).any() else "largest_relative_velocity"
    if quantity not in branches or branches[quantity].dims != ("point",):
        names = [str(name) for name in branches.data_vars if branches[name].dims == ("point",)]
        raise InputError(f"the branches have no quantity {quantity}; there are {', '.join(names)}")
    (one,) = axes_for(1, ax)
    stability = branches["stability"]
    stable = [code for code, word in words(stability).items() if word == "stable"]
    x, y = branches[parameter].values, branches[quantity].values.astype(float)
    for number in np.unique(branches["branch"].values):
        of_branch = np.flatnonzero(branches["branch"].values == number)
        is_stable = np.isin(stability.values[of_branch], stable)
        colour = CURVES[int(number) % len(CURVES)]
        ends = np.flatnonzero(np.diff(is_stable.astype(int))) + 1
        for piece in np.split(np.arange(len(of_branch)), ends):
            # To the first point of the next piece, so that a branch has no gaps.
            rows = of_branch[piece[0] : piece[-1] + 2]
            drawn = {"color": colour, "linewidth": 1.4, "linestyle": "-" if is_stable[piece[0]] else "--", **style}
            one.plot(x[rows], y[rows], **drawn)
    special = branches["special"]
    meanings = words(special)
    for number, (code, word) in enumerate((code, word) for code, word in meanings.items() if word not in ("none", "no")):
        at = special.values == code
        if at.any():
            marker = "osD^vP*X"[number % 8]
            one.plot(x[at], y[at], marker, color="black", markersize=5, label=word.replace("_", " "))
    one.set_xlabel(label_of_variable(branches[parameter]))
    one.set_ylabel(label_of_variable(branches[quantity]))
    if ax is None:
        set_title(one, branches)
        if one.get_legend_handles_labels()[0]:
            one.legend(fontsize="small")
    return one
