"""Branches of cycles and of steady sliding as a parameter varies, as a dataset."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._case import CaseLike, Overrides, PathLike, is_hdf5, settings
from ._command import worded
from ._errors import InputError, needs_xarray
from ._progress import Progress, shown
from ._sweep import StudyFiles

if TYPE_CHECKING:
    import xarray

DIMENSIONS = {"points": "point", "branches": "branches", "curves": "curve_point"}
"""Of each group of the file."""

SECOND = {"state": "component", "real": "value", "imaginary": "value"}
"""The second dimension of the variables of points that have one."""


def is_continuation(path: str) -> bool:
    """Whether a file is one of a continuation."""
    return is_hdf5(Path(path)) and _native.is_continuation(path)


def _name(group: str, name: str) -> str:
    """Of a variable of a group in the dataset, where those of points go without a prefix."""
    prefix = {"points": "", "branches": "branch_", "curves": "curve_"}[group]
    return name if name.startswith(prefix.rstrip("_")) else prefix + name


def read_continuation(path: PathLike) -> xarray.Dataset:
    """The points of a continuation's file as a dataset, with the varying parameter as a coordinate."""
    needs_xarray()
    import xarray

    file = _native.read_continuation(os.fspath(path))
    variables: dict[str, xarray.Variable] = {}
    for column in file["columns"]:
        group, name = column["group"], column["name"]
        if name in (DIMENSIONS[group], "branch" if group == "branches" else "", *SECOND.values()):
            # Of a dimension its number alone.
            continue
        attributes: dict[str, Any] = {"units": column["units"], "long_name": column["long_name"]}
        values = column["values"]
        if column["flags"]:
            attributes["flag_values"] = np.array([code for code, _ in column["flags"]])
            attributes["flag_meanings"] = " ".join(word for _, word in column["flags"])
        if column["whole"]:
            values = values.astype(np.int64)
        if group == "points" and name == file["number"]:
            attributes["keys"] = file["keys"]
        dimensions = [DIMENSIONS[group]]
        if len(column["shape"]) > 1:
            dimensions.append(SECOND[name])
        known = {"real": "multiplier_real", "imaginary": "multiplier_imaginary"}.get(name, name)
        variables[_name(group, known)] = xarray.Variable(dimensions, values.reshape(column["shape"]), attributes)
    dataset = xarray.Dataset(variables, attrs={"title": file["title"], "status": file["status"], "number": file["number"]})
    for dimension, length in dict(dataset.sizes).items():
        dataset.coords[dimension] = np.arange(length)
    return dataset.set_coords([name for name in ("branch", file["number"]) if name in variables])


def follow(
    study: PathLike | Mapping[str, Any],
    case: CaseLike | None = None,
    overrides: Overrides = None,
    *,
    of: Sequence[str] = ("cycle",),
    start: str | None = None,
    period: float | None = None,
    periods: int | None = None,
    direction: str | None = None,
    points: int | None = None,
    step: float | None = None,
    follow: Sequence[str] | None = None,
    curves: Sequence[str] | None = None,
    output: PathLike | None = None,
    replace: bool = False,
    resume: bool = False,
    progress: bool | Progress = False,
) -> xarray.Dataset:
    """Follows branches of cycles and of steady sliding as a parameter varies.

        branches = stickslip.follow({"rotor.speed": {"from": 0.1, "to": 1.5}}, "belt-exponential", of=("steady", "cycle"))
        branches.isel(point=branches["branch"] == 0)["amplitude"]

    The dataset has a value for each ``point``, with ``branch`` and the varying parameter as coordinates; ``branch_what``,
    ``branch_end`` and others for each of the ``branches``; and ``curve_...`` for each ``curve_point`` of special points in two
    parameters. Multipliers are in ``multiplier_real`` and ``multiplier_imaginary``; codes have ``flag_meanings``.

    :param study: a dotted key of the case with its range, ``{"from": ..., "to": ...}``, and a second one for ``curves``; or the name
        of a built-in study, the path of a study file, or its TOML text.
    :param case: base case of a range, as :func:`run` takes it. Branches start at its value of the parameter.
    :param overrides: keys set in the base case.
    :param of: motions to follow: ``"cycle"``, ``"steady"``, or both.
    :param start: ``"end"`` looks for the first cycle from the end of the run, ``"initial"`` from the initial state of the case.
    :param period: approximate period of the first cycle, s.
    :param periods: length of the first cycle in drive periods, or in turns.
    :param direction: ``"both"``, ``"up"`` or ``"down"``.
    :param points: largest number of points of a branch in one direction.
    :param step: the longest step, as a share of the range.
    :param follow: kinds of special points whose branches are followed: ``"hopf"``, ``"flip"``.
    :param curves: kinds of special points that are followed in two parameters.
    :param output: the file, which :func:`open` opens again; without it none is kept.
    :param replace: replace any file there, and start anew.
    :param resume: continue an interrupted continuation into ``output``.
    :param progress: ``True`` shows a bar of tqdm, or counts the points; a function is called with the points done, and again with
        their number, as their total is not known.
    :raises InputError: an invalid study.
    :raises RunError: no first cycle was found.
    """
    needs_xarray()
    files = StudyFiles("continuation", output, replace, resume)
    more = {
        "from": start,
        "period": period,
        "periods": periods,
        "direction": direction,
        "points": points,
        "step": step,
        "follow": None if follow is None else list(follow),
        "curves": None if curves is None else list(curves),
    }
    branch = {name: value for name, value in more.items() if value is not None}
    if isinstance(study, Mapping):
        if case is None:
            raise InputError("a range is of a case: name it, as stickslip.run takes it")
        text = files.of_axes(study, case, overrides, {"branch": {"of": list(of), **branch}})
        overrides = None
    elif case is not None or branch or tuple(of) != ("cycle",):
        raise InputError("case, of, start and what else is said of branches go with a range; a study says them itself")
    else:
        text = os.fspath(study)
    with worded(files.names), shown(progress, "points") as told:
        remarks = _native.follow(files.path(text), settings(overrides), files.output, replace, resume, told)
    dataset = read_continuation(files.output)
    if remarks:
        dataset.attrs["remarks"] = remarks
    return dataset


continue_ = follow
"""Its first name."""
