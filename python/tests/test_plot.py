"""Plots: what is drawn is what the data hold. Nothing is shown: matplotlib draws into memory."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import stickslip

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402


@pytest.fixture(autouse=True)
def closed():
    yield
    pyplot.close("all")


def drawn(axes):
    """The longest curve of axes."""
    line = max(axes.get_lines(), key=lambda line: len(line.get_xdata()))
    return np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)


def test_property_run_plot_shows_the_stick_slip(paper):
    upper, lower = paper.plot()
    onset, final = paper.summary["onset_time"], paper.summary["final_stick_time"]
    start, end = lower.get_xlim()
    assert paper.time[0] < start < onset < final < end < onset + 2 * (final - onset)
    assert upper.get_ylabel() == "relative velocity (rad s⁻¹)" and lower.get_ylabel() == "friction torque (N m)"
    # The curve goes through the state on both sides of each event.
    times, values = drawn(upper)
    for event in paper.events[paper.events["kind"] == "slip"]:
        assert np.count_nonzero(times == event["time"]) >= 2
        assert np.any(values[times == event["time"]] == event["relative_velocity_after"])
    # Every stick is shaded, from its start to its end.
    (shaded,) = upper.collections
    spans = sorted((path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in shaded.get_paths())
    assert len(spans) == paper.summary["stick_count"]
    sticks = paper.events["time"][paper.events["kind"] == "stick"]
    assert np.allclose([span[0] for span in spans], sticks, rtol=0, atol=1e-12)
    assert {text.get_text() for text in upper.get_legend().get_texts()} == {"stick", "slip", "sticking"}


def test_property_run_plot_arguments(paper):
    figure, ax = pyplot.subplots()
    returned = paper.plot("normal_force", window=(6.9, 7.0), ax=ax, events=False, sticks=False, color="red")
    assert returned is ax and ax.get_xlim() == (6.9, 7.0)
    (line,) = ax.get_lines()
    assert line.get_color() == "red" and not ax.collections
    times, values = drawn(ax)
    assert np.interp(6.95, times, values) == pytest.approx(np.interp(6.95, paper.time, paper.trajectory["normal_force"]))
    with pytest.raises(stickslip.InputError, match="no channel normal_froce; there are time"):
        paper.plot("normal_froce")
    with pytest.raises(stickslip.InputError, match="start has to be before the end"):
        paper.plot(window=(7.0, 6.9))
    with pytest.raises(stickslip.InputError, match="no sample in the window"):
        paper.plot(window=(20.0, 21.0))
    with pytest.raises(stickslip.InputError, match="give one for each"):
        paper.plot("normal_force", "friction_torque", ax=ax)
    figure.canvas.draw()


def test_property_run_without_sticks_is_drawn_whole():
    run = stickslip.run("paper", {"output.end_time": 0.5})
    upper, _ = run.plot()
    assert upper.get_xlim() == (run.time[0], run.time[-1])


def test_property_channel_with_a_history_goes_through_its_samples(paper):
    ax = paper.plot("dissipated_friction")
    _, values = drawn(ax)
    assert np.isfinite(values).all() and np.all(np.diff(values) >= -1e-9)


def test_property_sweep_lines_maps_and_samples():
    axes = {"friction.decay": [3.0, 5.0, 8.0], "torsion.damping": {"from": 15, "to": 30, "count": 2}}
    study = stickslip.sweep(axes, "paper", method="series")
    ax = stickslip.plot(study, "stick_count")
    (mesh,) = ax.collections
    assert np.array_equal(mesh.get_array().ravel(), study["stick_count"].values.T.ravel())
    assert ax.get_xlabel() == "friction.decay (s/rad)"
    line = stickslip.plot(study.isel(torsion_damping=0), "onset_time")
    assert np.array_equal(drawn(line)[1], study["onset_time"].values[:, 0])
    with pytest.raises(stickslip.InputError, match="no quantity stick_cuont"):
        stickslip.plot(study, "stick_cuont")
    chosen = {"method": "sobol", "count": 4, "seed": 1}
    sample = stickslip.sweep({"friction.decay": {"from": 3, "to": 8}}, sample=chosen, method="series")
    x, y = drawn(stickslip.plot(sample, "stick_count"))
    assert np.array_equal(x, sample["friction_decay"].values) and np.array_equal(y, sample["stick_count"].values)


def test_property_sweep_of_three_axes_wants_a_choice():
    axes = {"friction.decay": [4.0, 5.0], "torsion.damping": [20, 22], "friction.high_speed": [0.3, 0.35]}
    study = stickslip.sweep(axes, "paper", {"output.end_time": 0.01})
    with pytest.raises(stickslip.InputError, match="has 3 axes, and a plot one or two"):
        stickslip.plot(study)
    ax = stickslip.plot(study, at={"friction_high_speed": 0.35})
    assert ax.get_ylabel() == "torsion.damping (N m s/rad)"


def test_property_branches_are_drawn_by_stability():
    branches = stickslip.follow(
        {"rotor.speed": {"from": 0.3, "to": 0.6}}, "belt-exponential", of=("steady", "cycle"), points=15
    )
    ax = stickslip.plot(branches)
    lines = [line for line in ax.get_lines() if line.get_linestyle() in ("-", "--")]
    assert {line.get_linestyle() for line in lines} == {"-", "--"}
    seen = {(x, y) for line in lines for x, y in zip(*line.get_data())}
    assert seen == set(zip(branches["rotor_speed"].values.tolist(), branches["amplitude"].values.tolist()))
    assert stickslip.continue_ is stickslip.follow


def test_property_cycle_closes():
    cycle = stickslip.cycle("belt-exponential", {"rotor.speed": 0.3})
    x, y = drawn(cycle.plot())
    assert x[0] == pytest.approx(x[-1], abs=1e-9) and y[0] == pytest.approx(y[-1], abs=1e-9)
    assert stickslip.plot(cycle).get_xlabel() == "phi1 (m)"


def test_property_comparison_shows_the_errors(paper):
    other = stickslip.run("paper", method="cvode-bdf")
    comparison = stickslip.compare(paper, other)
    times, errors = drawn(comparison.plot())
    rows = comparison.event_errors["events"]
    assert times.tolist() == [row["time"] for row in rows]
    assert errors.max() == comparison.event_errors["max"]


def test_property_what_cannot_be_drawn():
    with pytest.raises(stickslip.InputError, match="a str cannot be drawn"):
        stickslip.plot("paper.h5")


def test_property_without_matplotlib_it_says_what_to_install():
    program = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "import stickslip\n"
        "run = stickslip.run('paper', {'output.end_time': 0.02})\n"
        "try:\n    run.plot()\nexcept stickslip.InputError as error:\n    print(error)\n"
    )
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert said == "plots are drawn by matplotlib, which is not installed: pip install matplotlib\n"


def test_property_matplotlib_is_imported_when_called():
    program = "import sys, stickslip; print('matplotlib' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert said == "False\n"
