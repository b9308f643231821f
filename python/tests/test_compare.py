"""Candidates of arrays, files, runs and events."""

from __future__ import annotations

import json
import subprocess

import numpy as np
import pytest

import stickslip


def test_property_a_run_agrees_with_itself(paper):
    comparison = stickslip.compare(paper, paper)
    assert comparison.document["missing"] == comparison.document["spurious"] == 0
    assert "agree" in comparison.verdict
    assert comparison.verdict in str(comparison)


def test_cli_arrays_are_compared_as_their_file(paper, tmp_path, program):
    window = (paper.time >= 6.9) & (paper.time <= 7.0)
    time, velocity = paper.time[window], paper.trajectory["relative_velocity"][window]
    comparison = stickslip.compare(paper, time=time, relative_velocity=velocity)
    np.savez(tmp_path / "mine.npz", time=time, relative_velocity=velocity)
    paper.save(tmp_path / "paper.h5")
    command = [program, "compare", tmp_path / "paper.h5", tmp_path / "mine.npz", "--json"]
    document = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)["comparisons"][0]
    ours = dict(comparison.document)
    for names in ("reference", "candidate"):
        ours.pop(names), document.pop(names)
    assert ours == document


def test_property_units_of_arrays(paper):
    window = (paper.time >= 6.97) & (paper.time <= 6.99)
    time, velocity = paper.time[window], paper.trajectory["relative_velocity"][window]
    plain = stickslip.compare(paper, time=time, relative_velocity=velocity, max_wall_time="5 min")
    rpm = velocity * 60 / (2 * np.pi)
    other = stickslip.compare(paper, time=time, relative_velocity=rpm, units={"relative_velocity": "rpm"})
    # Without the unit the velocities are 9.5 times too large; with it they are what they were, to their rounding.
    assert other.causes == plain.causes
    assert other.verdict == plain.verdict
    wrong = stickslip.compare(paper, time=time, relative_velocity=rpm)
    assert "wrong-units" in [cause["cause"] for cause in wrong.causes]


def test_property_events_alone(paper):
    events = paper.events[np.isin(paper.events["kind"], ("stick", "slip"))]
    comparison = stickslip.compare(paper, events={"time": events["time"] + 1e-7, "kind": events["kind"]})
    assert comparison.document["missing"] == 0
    again = stickslip.compare(paper, events=events, require=["onset<1e-12", "missing<1"])
    assert again.shortfalls == []
    short = stickslip.compare(paper, events={"time": events["time"] + 1e-7, "kind": events["kind"]}, require=["onset<1e-9"])
    assert len(short.shortfalls) == 1


def test_property_wrong_candidates(paper, tmp_path):
    with pytest.raises(stickslip.InputError, match="different lengths"):
        stickslip.compare(paper, time=[1.0, 2.0], relative_velocity=[1.0])
    with pytest.raises(stickslip.InputError, match="max_wall_time"):
        stickslip.compare(paper, time=[1.0, 2.0], relative_velocity=[1.0, 1.0], max_wall_time="soon")
    with pytest.raises(stickslip.InputError, match="no array time"):
        stickslip.compare(paper, relative_velocity=[1.0])
    with pytest.raises(stickslip.InputError, match="no candidate"):
        stickslip.compare(paper)
    with pytest.raises(stickslip.FileError, match="no such file"):
        stickslip.compare(paper, tmp_path / "none.csv")
    with pytest.raises(stickslip.InputError):
        stickslip.compare(paper, time=[1.0, 2.0], no_such_channel=[1.0, 2.0], units={"no_such_channel": "m"})


def test_regression_reports_and_errors_name_no_file_of_their_own():
    reference = stickslip.run("paper")
    window = (reference.time > 6.966) & (reference.time < 6.99)
    t, w = reference.time[window], reference.trajectory["relative_velocity"][window]
    comparison = stickslip.compare(reference, time=t, relative_velocity=w)
    assert str(comparison).startswith("the arrays against the reference")
    assert comparison.candidate == "the arrays"
    assert str(stickslip.compare(reference, stickslip.run("paper"))).startswith("the run against the reference")
    with pytest.raises(stickslip.InputError, match="^the arrays, row 1 of time: "):
        stickslip.compare(reference, time=t[::-1], relative_velocity=w)
    assert "/stickslip-" not in str(stickslip.certify(reference)) + str(comparison)


def test_regression_events_of_a_data_frame_and_names_of_any_kind(paper, tmp_path, monkeypatch):
    assert stickslip.compare(paper, events=paper.events_table()).document["missing"] == 0
    with pytest.raises(stickslip.InputError, match="real numbers, not complex128"):
        stickslip.compare(paper, time=[0j, 1j], relative_velocity=[0.0, 1.0])
    window = slice(0, 100)
    arrays = {name: paper.trajectory[name][window] for name in ("time", "relative_velocity")}
    stickslip.compare(paper, **arrays, file=paper.time[window])
    monkeypatch.chdir(tmp_path)
    paper.save("-x.h5")
    assert str(stickslip.compare("-x.h5", paper)).startswith("the run against -x.h5")
    with pytest.raises(stickslip.FileError, match="^none.h5: no such file"):
        stickslip.compare(paper, "none.h5")


def test_regression_what_a_failed_run_computed_can_be_compared(paper):
    with pytest.raises(stickslip.RunError) as failed:
        stickslip.run("paper", {"solver.max_events": 60})
    assert failed.value.run.status == "failed"
    assert stickslip.compare(paper, failed.value.run).document["candidate_events"] < 95
