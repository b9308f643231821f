"""Runs: what they hold, in which form, and that it is what a result file holds."""

from __future__ import annotations

import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

import stickslip

# In the standard library since 3.11
tomllib = pytest.importorskip("tomllib")
from conftest import SHORT


def test_regression_paper_onset(paper):
    # The onset of the built-in case, docs/theory.md: 6.975001494 s.
    assert paper.summary["onset_time"] == pytest.approx(6.975001494, abs=1e-9)
    assert paper.status == "complete"
    sticks = paper.events[paper.events["kind"] == "stick"]
    assert len(sticks) == paper.summary["stick_count"]
    assert sticks["time"][0] == paper.summary["onset_time"]


def test_published_belt_period(belt):
    # Leine and others 1998: duration of a slip, and the position at its end (docs/theory.md).
    slip = belt.events[belt.events["kind"] == "slip"][0]
    stick = belt.events[belt.events["time"] > slip["time"]][0]
    assert stick["kind"] == "stick"
    assert stick["time"] - slip["time"] == pytest.approx(4.295999525480155, abs=1e-10)
    assert stick["phi1_before"] == pytest.approx(-0.5410063538700847, abs=1e-10)
    assert belt.units["relative_velocity"] == "m s-1"


def test_property_arrays_are_not_copied(paper):
    first = paper.trajectory["normal_force"]
    assert paper.trajectory["normal_force"] is first
    # The memory is that of the Rust vector: the array owns nothing, and what it stands on is no array.
    assert not first.flags.owndata
    assert first.base is not None and not isinstance(first.base, np.ndarray)
    assert first.flags.c_contiguous and not first.flags.writeable
    assert first.dtype == np.float64
    with pytest.raises(ValueError):
        first[0] = 1.0
    # Nor does xarray copy it.
    assert np.shares_memory(paper.to_xarray()["normal_force"].values, first)


def test_property_columns_are_of_one_length(paper):
    for group in paper.tables:
        table = paper.table(group)
        assert len({len(table[name]) for name in table}) == 1, group
    assert np.all(np.diff(paper.time) > 0)


def normal(path: Path) -> dict[str, bytes]:
    """What a file holds but for when and by which command it was made."""
    found: dict[str, bytes] = {}
    with h5py.File(path) as file:

        def visit(name, item):
            if isinstance(item, h5py.Dataset):
                found[name] = np.asarray(item[()]).tobytes() if item.dtype.kind != "O" else bytes(item[()])
            if name != "meta":
                for key, value in item.attrs.items():
                    if key not in ("DIMENSION_LIST", "REFERENCE_LIST"):
                        found[f"{name}@{key}"] = np.asarray(value).tobytes() if not isinstance(value, str) else value.encode()

        file.visititems(visit)
        for key, value in file.attrs.items():
            if key != "history":
                found[f"@{key}"] = str(value).encode()
    # Checksums of /meta itself differ with it.
    return {name: value for name, value in found.items() if not name.startswith("meta/")}


@pytest.mark.parametrize(("case", "overrides"), [("paper", {}), ("belt-leine", {"output.end_time": 30, "output.dense": True})])
def test_results_save_is_the_file_of_the_program(tmp_path, program, case, overrides):
    saved = stickslip.run(case, overrides).save(tmp_path / "saved.h5")
    settings = [f"--set={key}={str(value).lower()}" for key, value in overrides.items()]
    subprocess.run([program, "run", case, "-q", "-o", tmp_path / "program.h5", *settings], check=True)
    ours, theirs = normal(saved), normal(tmp_path / "program.h5")
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []
    assert os.path.getsize(saved) == pytest.approx(os.path.getsize(tmp_path / "program.h5"), abs=4096)


def test_results_save_and_open(tmp_path, paper):
    path = paper.save(tmp_path / "paper.h5")
    opened = stickslip.open(path)
    assert isinstance(opened, stickslip.Run)
    assert opened.summary == paper.summary
    assert opened.events.dtype == paper.events.dtype
    assert np.array_equal(opened.events, paper.events)
    for name in paper.trajectory:
        column = opened.trajectory[name]
        assert column.dtype == paper.trajectory[name].dtype
        assert np.array_equal(column, paper.trajectory[name], equal_nan=True)
    assert opened.case == paper.case
    assert opened.path == path
    assert str(opened).split("\n")[1:] == str(paper).split("\n")[1:]


@pytest.mark.parametrize("group", ["trajectory", "events", "segments", "stick_slip"])
def test_results_xarray_is_as_the_file_opens(tmp_path, paper, group):
    path = paper.save(tmp_path / "paper.h5")
    with xarray.open_dataset(path, group=group, engine="h5netcdf") as file:
        ours = paper.to_xarray(group)
        assert set(ours.variables) == set(file.variables)
        assert ours.sizes == file.sizes
        assert set(ours.coords) == set(file.coords)
        for name, variable in file.variables.items():
            np.testing.assert_array_equal(ours[name].values, variable.values)
            assert ours[name].attrs["units"] == variable.attrs["units"]
            assert ours[name].attrs["long_name"] == variable.attrs["long_name"]
            assert ours[name].attrs.get("flag_meanings") == variable.attrs.get("flag_meanings")


def test_property_events_table(paper):
    frame = paper.events_table()
    assert list(frame["kind"]) == list(paper.events["kind"])
    assert frame.attrs["units"]["time"] == "s"


def test_property_events_are_merged_into_the_trajectory(paper):
    rows = paper.trajectory_with_events()
    of_sample = rows["event"] < 0
    for name in paper.trajectory:
        assert rows[name].dtype == paper.trajectory[name].dtype
        assert np.array_equal(rows[name][of_sample], paper.trajectory[name], equal_nan=True)
    some = paper.trajectory_with_events("normal_force")
    assert list(some) == ["time", "normal_force", "event", "side"]
    assert np.array_equal(some["normal_force"], rows["normal_force"])
    assert len(rows["time"]) == len(paper.time) + 2 * len(paper.events)
    assert np.all(np.diff(rows["time"]) >= 0)
    # Before and after, next to each other.
    assert rows["side"][~of_sample].tolist() == [-1, 1] * len(paper.events)
    assert np.array_equal(rows["event"][~of_sample], np.repeat(np.arange(len(paper.events)), 2))
    after = rows["side"] == 1
    assert np.array_equal(rows["relative_velocity"][after], paper.events["relative_velocity_after"])
    assert np.array_equal(paper.trajectory.words("mode")[-1:], paper.events["mode_after"][-1:])
    # The mode before an event is that of the sample before it, unless another event lies between.
    k = np.flatnonzero(rows["side"] == -1)
    k = k[(k > 0) & of_sample[k - 1]]
    assert np.array_equal(rows["mode"][k], rows["mode"][k - 1])
    assert np.array_equal(rows["segment"][k], rows["segment"][k - 1])


def test_property_forces_at_events_are_those_of_the_dense_output(belt):
    rows = belt.trajectory_with_events()
    # A kick or a corner has two states at one time as any event.
    for side, name in ((-1, "left"), (1, "right")):
        at = rows["side"] == side
        for channel in ("friction_torque", "normal_force", "energy_kinetic", "phi1"):
            expected = belt.at(rows["time"][at], channel, side=name)
            np.testing.assert_allclose(rows[channel][at], expected, rtol=0, atol=1e-8, err_msg=channel)
    assert np.isnan(rows["dissipated_friction"][rows["side"] != 0]).all()


def test_property_events_in_frames_and_datasets(paper):
    rows = paper.trajectory_with_events()
    frame = paper.to_pandas(events=True)
    assert frame.attrs["units"]["normal_force"] == "N"
    assert np.array_equal(frame["friction_torque"], rows["friction_torque"], equal_nan=True)
    assert len(paper.to_pandas()) == len(paper.time) and len(paper.to_pandas("events")) == len(paper.events)
    data = paper.to_xarray(events=True)
    assert dict(data.sizes) == {"time": len(rows["time"])}
    assert data["side"].attrs["long_name"].startswith("-1 before") and data["normal_force"].attrs["units"] == "N"
    assert data.sel(time=slice(6.97, 6.99))["event"].max() > 90
    with pytest.raises(stickslip.InputError, match="leave it out"):
        paper.to_xarray("events", events=True)


def test_property_events_of_a_file_are_merged_alike(tmp_path, paper):
    opened = stickslip.open(paper.save(tmp_path / "paper.h5"))
    ours, theirs = paper.trajectory_with_events(), opened.trajectory_with_events()
    assert list(ours) == list(theirs)
    for name in ours:
        assert np.array_equal(ours[name], theirs[name], equal_nan=True), name


def test_property_progress_of_a_run(capsys):
    told: list[tuple[float, float]] = []
    stickslip.run("belt-leine", {"output.end_time": 2000}, progress=lambda done, end: told.append((done, end)))
    assert told and all(0 <= done <= end for done, end in told)

    class Enough(Exception):
        """Of the user, while the run goes on."""

    def stop(done: float, end: float) -> None:
        raise Enough

    with pytest.raises(Enough):
        stickslip.run("belt-leine", {"output.end_time": 2000}, progress=stop)
    pytest.importorskip("tqdm")
    stickslip.run("belt-leine", {"output.end_time": 2000}, progress=True)
    assert "100%" in capsys.readouterr().err


def test_property_dense_output_goes_through_the_samples(belt):
    rows = slice(None, None, 7)
    times = belt.time[rows]
    # As examples/dense.py: samples at events are those before or after them.
    near = np.abs(times[:, None] - belt.events["time"][None, :]).min(axis=1) < 1e-9
    for channel in ("phi1", "relative_velocity", "normal_force"):
        values = belt.at(times, channel)
        scale = np.abs(belt.trajectory[channel]).max()
        # The pieces are within 1e-12 of the size of a channel (docs/reference/columns.md).
        assert np.abs(values - belt.trajectory[channel][rows])[~near].max() <= 1e-10 * scale
    everything = belt.at(1.0)
    assert set(everything) == {name for name in belt.trajectory if name not in ("time", "mode", "segment")}
    assert np.isnan(belt.at(-1.0, "phi1"))
    assert belt.at([[1.0, 2.0]], "phi1").shape == (1, 2)
    kick = belt.events["time"][0]
    assert belt.at(kick, "phi1", side="left") == pytest.approx(float(belt.events["phi1_before"][0]), abs=1e-12)


def test_property_events_alone(paper):
    run = stickslip.run("paper", trajectory=False)
    assert len(run.time) == 0
    assert np.array_equal(run.events["time"], paper.events["time"])
    assert run.summary["onset_time"] == paper.summary["onset_time"]


def test_property_dense_output_that_was_not_kept(paper):
    with pytest.raises(stickslip.InputError, match="dense=True"):
        paper.at(1.0)


def test_property_cases_in_every_form(tmp_path):
    text = stickslip.cases()[0].text
    file = tmp_path / "case.toml"
    file.write_text(text)
    by_name = stickslip.run("paper", SHORT)
    for case in (text, file, str(file), tomllib.loads(text), by_name.case):
        other = stickslip.run(case, SHORT)
        assert np.array_equal(other.trajectory["theta_dot"], by_name.trajectory["theta_dot"])
    saved = by_name.save(tmp_path / "saved.h5")
    assert stickslip.run(saved).case == by_name.case


def test_property_overrides_of_every_kind():
    run = stickslip.run(
        "paper",
        {
            "friction.decay": "4.8 s/rad",
            "torsion.damping": np.float64(22.0),
            "output.steps": True,
            "perturbation": [{"kind": "kick", "time": 0.01, "relative_velocity": 1e-3}],
            **SHORT,
        },
        method="series",
        rtol=1e-9,
    )
    case = tomllib.loads(run.case)
    assert case["friction"]["decay"] == 4.8
    assert case["torsion"]["damping"] == 22.0
    assert case["solver"]["method"] == "series"
    assert case["solver"]["rtol"] == 1e-9
    assert run.events["kind"].tolist() == ["kick"]


def test_cli_errors_are_those_of_the_program(program, tmp_path):
    with pytest.raises(stickslip.CaseError) as raised:
        stickslip.run("paper", {"friction.deacy": 4})
    ended = subprocess.run(
        [program, "run", "paper", "--set", "friction.deacy=4"], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert ended.returncode == 2
    assert str(raised.value) in ended.stderr
    assert isinstance(raised.value, ValueError) and isinstance(raised.value, stickslip.StickslipError)


@pytest.mark.parametrize(
    ("case", "error"),
    [
        ("no-such-case", stickslip.CaseError),
        ("no-such-file.toml", stickslip.CaseError),
        ("no-such-file.h5", stickslip.FileError),
        ("torsion = 3\n", stickslip.CaseError),
        ({"friction": {"decay": object()}}, stickslip.InputError),
    ],
)
def test_property_wrong_cases(case, error):
    with pytest.raises(error):
        stickslip.run(case)


def test_property_a_run_that_fails_keeps_what_it_has():
    with pytest.raises(stickslip.RunError) as raised:
        stickslip.run("paper", {"solver.max_events": 5})
    run = raised.value.run
    assert isinstance(run, stickslip.Run)
    assert run.status == "failed"
    assert len(run.events) >= 5


def test_property_wrong_files(tmp_path):
    with pytest.raises(stickslip.FileError):
        stickslip.open(tmp_path / "none.h5")
    wrong = tmp_path / "wrong.h5"
    wrong.write_bytes(b"not HDF5")
    with pytest.raises(stickslip.FileError):
        stickslip.open(wrong)
    with pytest.raises(stickslip.FileError):
        stickslip.run("paper", SHORT).save(tmp_path / "missing" / "x.h5")
    with pytest.raises(stickslip.FileError):
        stickslip.run("paper", SHORT).save(wrong)
    assert stickslip.run("paper", SHORT).save(wrong, replace=True) == wrong


def test_property_a_damaged_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    stickslip.run("paper", SHORT).save("run.h5")
    stickslip.sweep({"friction.decay": [3, 4]}, "paper", SHORT, output="sweep.h5")
    for name in ["run.h5", "sweep.h5"]:
        stickslip.open(name)
        damaged = bytearray((tmp_path / name).read_bytes())
        damaged[len(damaged) // 2] ^= 4
        (tmp_path / name).write_bytes(damaged)
        with pytest.raises(stickslip.FileError, match=f"^{name}: damaged"):
            stickslip.open(name)


# What was started in the background by a shell ignores Ctrl-C.
INTERRUPTED = """
import signal, sys, stickslip
signal.signal(signal.SIGINT, signal.default_int_handler)
print("begins", flush=True)
try:
    {call}
except KeyboardInterrupt:
    sys.exit(42)
"""


@pytest.mark.parametrize(
    "call",
    [
        'stickslip.run("belt-leine", {"output.end_time": 1e8, "output.interval": 1e6, "solver.max_events": 10**9})',
        'stickslip.sweep("critical-curve", jobs=1, progress=True)',
        'stickslip.follow("belt-branches")',
    ],
)
def test_cli_control_c_raises_keyboard_interrupt(call):
    process = subprocess.Popen([sys.executable, "-c", INTERRUPTED.format(call=call)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 42


def test_property_other_threads_go_on_while_a_run_computes():
    # Of a run that takes tenths of a second; a thread that held the lock would count to a handful.
    turns, done = 0, threading.Event()

    def work():
        try:
            stickslip.run("paper", {"solver.method": "cvode-bdf"})
        finally:
            done.set()

    thread = threading.Thread(target=work)
    thread.start()
    while not done.is_set():
        turns += 1
        time.sleep(0.001)
    thread.join()
    assert turns > 20


def test_property_representations(paper, belt):
    assert "onset of stick-slip" in repr(paper)
    page = paper._repr_html_()
    assert page.startswith("<table>") and "6.975 s" in page and "<th>paper</th>" in page
    assert "<th>paper</th>" not in belt._repr_html_()
    assert "period" in repr(belt)


def test_property_witness():
    run = stickslip.run("belt-leine", {"output.end_time": 30})
    assert run.witness is not None and run.witness["testimony"] == "same-sequence"
    assert run.witness["method"] == "series"
    apart = np.abs(run.events["witness_time"] - run.events["time"])
    assert len(apart) == len(run.events["time"]) and (apart < 1e-9).all()
    for unasked in ({"witness": False}, {"trajectory": False}):
        assert stickslip.run("belt-leine", {"output.end_time": 30}, **unasked).witness is None


def test_property_modes():
    modes = stickslip.modes("paper")
    assert modes["natural_period"] == pytest.approx(2.406e-4, rel=1e-3)
    assert "natural period" in str(modes)


def test_property_types():
    # The stubs are checked, not believed: those beside the tests, or, without them, the installed ones.
    pytest.importorskip("mypy")
    folder = Path(__file__).parents[1]
    whole = [[]] if (folder / "stickslip").is_dir() else [["-p", "stickslip"], ["tests/typed_use.py"]]
    for what in whole:
        command = [sys.executable, "-m", "mypy", *what]
        checked = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert checked.returncode == 0, checked.stdout + checked.stderr


def test_regression_warnings_are_seen():
    with pytest.warns(stickslip.StickslipWarning, match="."):
        run = stickslip.run("unperturbed")
    assert run.warnings and "warning: " in repr(run) and "warning: " in run._repr_html_()


def test_regression_a_run_without_trajectory_repeats_whole():
    run = stickslip.run("paper", SHORT, trajectory=False)
    assert len(stickslip.run(run.case).time) == len(stickslip.run("paper", SHORT).time)
    with pytest.raises(stickslip.InputError, match="trajectory=False"):
        stickslip.run("paper", {"output.dense": True}, trajectory=False)
    with pytest.raises(stickslip.InputError, match=r"run\.case"):
        stickslip.run(run)


def test_property_pickled_runs_are_the_run(tmp_path):
    made = stickslip.run("paper", method="series")
    for again in (pickle.loads(pickle.dumps(made)), pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(made))))):
        assert again.path is None and again.case == made.case and again.summary == made.summary
        assert (again.report, again.warnings, again.witness) == (made.report, made.warnings, made.witness)
        np.testing.assert_array_equal(again.events, made.events)
        for name in made.trajectory:
            np.testing.assert_array_equal(again.trajectory[name], made.trajectory[name])
    few = stickslip.run("paper", method="series", trajectory=False)
    assert pickle.loads(pickle.dumps(few)).case == few.case
    # A file is not copied; another one in its place is not the run.
    opened = stickslip.open(made.save(tmp_path / "run.h5"))
    pickled = pickle.dumps(opened)
    assert len(pickled) < 1000 and pickle.loads(pickled).path == opened.path
    few.save(tmp_path / "run.h5", replace=True)
    with pytest.raises(stickslip.FileError, match="open it again"):
        pickle.loads(pickled)


def test_property_modules_know_each_other_in_no_circle():
    folder = Path(stickslip.__file__).parent
    known = {
        file.stem: set(re.findall(r"^\s*from \.(\w+) import", file.read_text(encoding="utf-8"), re.M)) - {"_native"}
        for file in folder.glob("_*.py")
        if not file.stem.startswith("__")
    }
    while known:
        free = {name for name, others in known.items() if not others & known.keys()}
        assert free, f"these know each other in a circle: {', '.join(sorted(known))}"
        known = {name: others for name, others in known.items() if name not in free}
