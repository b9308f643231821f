"""Studies over executors: the bytes of one machine, whoever runs the points."""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import os
import threading

import pytest

import stickslip
from stickslip import _native
from stickslip._executor import Tasks

MAP = """
case = "case.toml"
[set]
solver.method = "series"
initial.speed = 3
actuation = { profile = "ramp", force = 2225, rise_time = "20 ms" }
perturbation = [{ kind = "kick", time = "instability", relative_velocity = 1e-4 }]
[keep]
events = true
[[axis]]
key = "friction.decay"
from = 1
to = 120
count = 9
spacing = "log"
[[axis]]
key = "friction.breakaway"                      # below friction.low_speed no case is valid
values = [0.5, 0.6, 0.7]
[[axis]]
key = "solver.method"
values = ["series", "cvode"]
"""

BOUNDARY = """
case = "paper"
set = { perturbation = [], axial.damping = "20000 lbf s/in", actuation.rise_time = 0, torsion.rotor_inertia = 0.002,
    initial.speed = 10, output.end_time = 0.01 }
axis = [
    { key = "friction.decay", from = 0.05, to = 0.8, count = 5, spacing = "log" },
    { key = "torsion.damping", from = 5, to = 40, count = 4 },
]
boundary = { criterion = "instability_time > 0", refinements = 1, growth_contours = [0.5] }
"""


@pytest.fixture(scope="module")
def processes():
    """Two processes that share nothing with this one."""
    with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        yield executor


@pytest.fixture
def study(tmp_path):
    """A map in a file, whose case is in another one: no worker can read them."""
    (tmp_path / "case.toml").write_text(next(case.text for case in stickslip.cases() if case.name == "paper"))
    (tmp_path / "map.toml").write_text(MAP)
    return tmp_path / "map.toml"


def test_property_a_map_is_that_of_one_machine(processes, study, tmp_path):
    one = stickslip.sweep(study, output=tmp_path / "one.h5")
    told = []

    def progress(done: int, total: int) -> None:
        assert threading.current_thread() is threading.main_thread()
        told.append((done, total))

    many = stickslip.sweep(study, executor=processes, output=tmp_path / "many.h5", progress=progress)
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "many.h5").read_bytes()
    # The points without a valid case are failed ones as ever, and the sweep goes on.
    assert many.attrs["failures"] == one.attrs["failures"] and len(one.attrs["failures"]) >= 5
    assert told[-1] == (54, 54)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml", "many.h5", "map.toml", "one.h5"]


def test_property_a_boundary_is_that_of_one_machine(processes, tmp_path):
    stickslip.sweep(BOUNDARY, output=tmp_path / "one.h5")
    stickslip.sweep(BOUNDARY, executor=processes, output=tmp_path / "many.h5")
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "many.h5").read_bytes()


def test_property_overrides_and_samples_reach_the_workers(processes, tmp_path):
    axes = {"rotor.speed": {"from": 0.1, "to": 0.3}}
    options = {"sample": {"method": "latin-hypercube", "count": 40, "seed": 3}, "method": "series"}
    overrides = {"output.end_time": "2 s"}
    one = stickslip.sweep(axes, "belt-exponential", overrides, output=tmp_path / "one.h5", **options)
    many = stickslip.sweep(axes, "belt-exponential", overrides, output=tmp_path / "many.h5", executor=processes, **options)
    assert dict(one.sizes) == dict(many.sizes) == {"point": 40}
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "many.h5").read_bytes()


class Enough(Exception):
    """Of the user, while the sweep runs."""


def test_regression_an_interrupted_sweep_goes_on(processes, tmp_path):
    axes = {"torsion.damping": {"from": 15, "to": 30, "count": 400}}
    options = {"method": "series", "output": tmp_path / "map.h5"}
    told = []

    def stop_after_some(done: int, total: int) -> None:
        told.append(done)
        if done >= 3:
            raise Enough

    with pytest.raises(Enough):
        stickslip.sweep(axes, "paper", executor=processes, progress=stop_after_some, **options)
    kept = told[-1]
    assert 3 <= kept < 400 and (tmp_path / "map.journal").exists()
    told.clear()
    stickslip.sweep(axes, "paper", executor=processes, resume=True, progress=lambda done, _: told.append(done), **options)
    assert told[0] >= kept and told[-1] == 400
    stickslip.sweep(axes, "paper", method="series", output=tmp_path / "one.h5")
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "map.h5").read_bytes()


class Mortal:
    """Gives its workers so many tasks; the next one kills its worker."""

    def __init__(self, executor: concurrent.futures.Executor, tasks: int) -> None:
        self.executor = executor
        self.tasks = tasks
        self.before = []

    def submit(self, function, *arguments):
        self.tasks -= 1
        if self.tasks == 0:
            concurrent.futures.wait(self.before)
            return self.executor.submit(os._exit, 1)
        self.before.append(self.executor.submit(function, *arguments))
        return self.before[-1]


def test_regression_a_worker_that_dies_loses_no_point_that_was_done(study, tmp_path):
    context = multiprocessing.get_context("spawn")
    options = {"output": tmp_path / "map.h5"}
    with concurrent.futures.ProcessPoolExecutor(2, context) as executor:
        with pytest.raises(stickslip.RunError, match="BrokenProcessPool.*map.journal; resume=True goes on") as raised:
            stickslip.sweep(study, executor=Mortal(executor, 10), **options)
    assert str(raised.value).startswith("the executor failed: ")
    assert isinstance(raised.value.__cause__, concurrent.futures.BrokenExecutor)
    told = []
    stickslip.sweep(study, resume=True, progress=lambda done, _: told.append(done), **options)
    assert told[0] >= 9
    stickslip.sweep(study, output=tmp_path / "one.h5")
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "map.h5").read_bytes()


def test_property_what_cannot_be_is_said(processes, study):
    with pytest.raises(stickslip.InputError, match="executor: 2 has no submit; give an executor of concurrent.futures"):
        stickslip.sweep(study, executor=2)
    with pytest.raises(stickslip.InputError, match="ProcessPoolExecutor is a class"):
        stickslip.sweep(study, executor=concurrent.futures.ProcessPoolExecutor)
    with pytest.raises(stickslip.InputError, match="leave one of them out"):
        stickslip.sweep(study, executor=processes, jobs=2)
    with pytest.raises(stickslip.InputError, match="keep.trajectory: .*leave it out, or the executor"):
        stickslip.sweep({"torsion.damping": [20, 21]}, keep={"trajectory": True}, executor=processes)


def test_property_a_worker_of_another_build_is_refused():
    sent = []

    class Listening:
        def submit(self, function, *arguments):
            sent.append(arguments)
            raise Enough("of the user")

    with pytest.raises(stickslip.RunError, match=r"the executor failed: Enough: of the user$"):
        stickslip.sweep({"torsion.damping": [20, 21]}, executor=Listening())
    task, points = sent[0]
    assert len(_native.evaluate(task, points)) > 100
    with pytest.raises(stickslip.RunError, match="another build of stickslip"):
        _native.evaluate(task.replace("program_version", "program_virsion"), points)
    with pytest.raises(stickslip.RunError, match="no task of a sweep"):
        _native.evaluate("{}", points)
    assert Tasks(Listening()).finished(0.0) is None
