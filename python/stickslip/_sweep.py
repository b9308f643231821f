"""Many runs: a study over axes, as a dataset."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._case import CaseLike, Overrides, PathLike, is_hdf5, settings, source, toml
from ._command import worded
from ._errors import InputError, RunError, needs_xarray
from ._executor import Executor, Tasks
from ._progress import Progress, shown
from ._scratch import Scratch

if TYPE_CHECKING:
    import xarray

SWEEP_SETTINGS = ("sample", "boundary", "keep")


def is_sweep(path: str) -> bool:
    """Whether a file is one of a sweep."""
    return is_hdf5(Path(path)) and _native.is_study(path)


def read_sweep(path: PathLike) -> xarray.Dataset:
    """The points of a sweep file as a dataset: the axes are coordinates, with units."""
    needs_xarray()
    import xarray

    study = _native.read_study(os.fspath(path))
    axes = study["axes"]
    variables: dict[str, xarray.Variable] = {}
    for name, variable in study["variables"].items():
        attributes: dict[str, Any] = {"units": variable["units"], "long_name": variable["long_name"]}
        flags = dict(variable["flags"])
        values = variable["values"]
        if name in axes and flags:
            values = np.array([flags.get(int(code), "") if not math.isnan(code) else "" for code in values])
            attributes.pop("units")
        elif flags:
            attributes["flag_values"] = np.array(list(flags))
            attributes["flag_meanings"] = " ".join(word.replace(" ", "_") for word in flags.values())
        if variable["keys"]:
            attributes["keys"] = variable["keys"]
        if study["grid"]:
            dimensions = (name,) if name in axes else tuple(axes)
        else:
            dimensions = ("point",)
        if values.dtype == np.float64 and (variable["whole"] or flags) and not np.isnan(values).any():
            values = values.astype(np.int64)
        variables[name] = xarray.Variable(dimensions, values.reshape(variable["shape"]), attributes)
    attributes = {"title": study["title"], "status": study["status"]}
    dataset = xarray.Dataset(variables, attrs=attributes)
    dataset.attrs["failures"] = [f"point {number}: {message}" for number, message in study["failures"]]
    return dataset.set_coords([name for name in axes if name in variables])


def study_of(
    axes: Mapping[str, Any], case: CaseLike, overrides: Overrides, others: Mapping[str, Any], folder: Path
) -> str:
    """The text of a study over axes; a case that is a text stands beside it."""
    kind, text = source(case)
    if kind == "text":
        (folder / "case.toml").write_text(text, encoding="utf-8")
        text = "case.toml"
    elif kind != "built-in":
        text = os.path.abspath(text)
    lines = [f"case = {toml(text)}"]
    lines += [f"{name} = {toml(value, name)}" for name, value in others.items() if value is not None]
    if overrides:
        lines.append("[set]")
        lines += [f"{key} = {toml(value, key)}" for key, value in overrides.items()]
    for key, axis in axes.items():
        lines.append("[[axis]]")
        lines.append(f"key = {toml(key)}")
        if isinstance(axis, Mapping):
            lines += [f"{name} = {toml(value, name)}" for name, value in axis.items()]
        else:
            values = axis.tolist() if hasattr(axis, "tolist") else list(axis)
            lines.append(f"values = {toml(values, key)}")
    return "\n".join(lines) + "\n"


class StudyFiles:
    """The files of a study: its text, unless it is a file already or built in, and its output."""

    def __init__(self, noun: str, output: PathLike | None, replace: bool, resume: bool) -> None:
        if resume and output is None:
            raise InputError(f"resume=True goes on with the file of an interrupted {noun}: name it with output=")
        if resume and replace:
            raise InputError("resume=True goes on with an output, and replace=True starts it anew; leave one of them out")
        self._scratch = Scratch()
        self.names = {self._scratch.file("study.toml"): "the study", self._scratch.file("case.toml"): "the case"}
        self.output = self._scratch.file("study.h5") if output is None else os.path.abspath(output)
        if output is None:
            self.names[self.output] = f"the {noun} (keep it with output=)"
            self.names[self._scratch.file("study.journal")] = "a temporary journal (keep it with output=)"

    def of_axes(self, axes: Mapping[str, Any], case: CaseLike, overrides: Overrides, others: Mapping[str, Any]) -> str:
        """The text of a study over axes."""
        return study_of(axes, case, overrides, others, self._scratch.folder)

    def path(self, study: str) -> str:
        """The name or path of a study that is a name, a path or a text."""
        if "\n" not in study:
            return os.path.abspath(study) if study.startswith("-") else study
        path = self._scratch.file("study.toml")
        Path(path).write_text(study, encoding="utf-8")
        return path


def sweep(
    study: PathLike | Mapping[str, Any],
    case: CaseLike | None = None,
    overrides: Overrides = None,
    *,
    method: str | None = None,
    keep: Mapping[str, Any] | None = None,
    sample: Mapping[str, Any] | None = None,
    jobs: int | None = None,
    executor: Executor | None = None,
    output: PathLike | None = None,
    replace: bool = False,
    resume: bool = False,
    progress: bool | Progress = False,
) -> xarray.Dataset:
    """Runs a study, and returns its points as a dataset with the axes as coordinates.

        stickslip.sweep({"friction.decay": [3, 4, 5], "torsion.damping": {"from": 10, "to": 40, "count": 31}}, "paper")
        stickslip.sweep("critical-curve")

    :param study: axes, each a dotted key of the case with its values, or with the range of a study file; or the name of a
        built-in study, the path of a study file, or its TOML text.
    :param case: base case of axes, as :func:`run` takes it; by default the paper's.
    :param overrides: keys set in the base case.
    :param keep: for axes, ``{"events": True}`` to keep the events in ``output``.
    :param sample: for axes, ``{"method": "sobol", "count": 64, "seed": 1}`` for a sample instead of a grid.
    :param jobs: threads; by default one for each processor.
    :param executor: runs the points in other processes, instead of threads of this one: an executor of
        :mod:`concurrent.futures`, of mpi4py.futures or of dask.distributed, whose workers have this module. The result is
        the same.
    :param output: the sweep file, which :func:`open` opens again; without it none is kept.
    :param replace: replace any file there, and start anew.
    :param resume: continue an interrupted sweep into ``output``, or begin one.
    :param progress: ``True`` shows a bar of tqdm, in a notebook as a widget; without tqdm it counts the points on standard error.
        A function is called with the points done and their total, in the thread that called this. An exception that it raises
        ends the sweep.
    :raises KeyboardInterrupt: Ctrl-C; with an ``output`` the points that are done are kept for ``resume=True``.
    :raises InputError: an invalid study.
    :raises RunError: all points failed, or the executor did.
    """
    needs_xarray()
    files = StudyFiles("sweep", output, replace, resume)
    if jobs is not None and executor is not None:
        raise InputError("jobs is a number of threads, and an executor has workers of its own; leave one of them out")
    tasks = None if executor is None else Tasks(executor)

    if isinstance(study, Mapping):
        base = "paper" if case is None else case
        text = files.of_axes(study, base, overrides, {"keep": keep, "sample": sample})
        overrides = None
    elif case is not None or keep is not None or sample is not None:
        raise InputError("case, keep and sample go with axes; a study says them itself")
    else:
        text = os.fspath(study)
    chosen = settings(overrides, **{"solver.method": method})
    try:
        with worded(files.names), shown(progress, "points") as told:
            unfinished = _native.sweep(files.path(text), chosen, files.output, replace, resume, jobs, told, tasks)
    except RunError as error:
        # Nothing is kept of what goes to a temporary file.
        text = str(error) if output is not None else re.split(r"\. (?:What was computed is|The messages are) in", str(error))[0]
        raise RunError(text) from None if tasks is None else tasks.failure
    dataset = read_sweep(files.output)
    dataset.attrs["unfinished"] = unfinished
    return dataset
