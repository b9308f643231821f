#!/usr/bin/env python3
"""Candidates made with SciPy and with a bare Runge-Kutta method are judged rightly.

    .ci/compare.py PROGRAM RESULT TRUTH FOLDER

What `stickslip compare` says about their events has to be what a direct computation against the multiprecision events
says, but for the error of the reference itself.
"""

import csv
import json
import pathlib
import subprocess
import sys

import numpy as np

# The reference errs by less than this, s (README.md).
REFERENCE = 1e-11
EXAMPLES = pathlib.Path(__file__).parent.parent / "examples" / "validate"


def compare(program, result, candidate, *options):
    """The program's judgement."""
    command = [program, "compare", result, candidate, "--json", *options]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["comparisons"][0]


def make(script, *arguments):
    subprocess.run([sys.executable, EXAMPLES / script, *arguments], check=True)


def direct(events, truth):
    """Largest and root mean square error of event times by the truth."""
    assert [kind for _, kind in events] == [kind for _, kind in truth]
    errors = np.array([time - true for (time, _), (true, _) in zip(events, truth)])
    return abs(errors).max(), np.sqrt((errors**2).mean())


def agree(name, comparison, events, truth):
    largest, rms = direct(events, truth)
    found = comparison["event_errors"]
    print(f"{name}: {comparison['verdict']}; directly {largest:.2e} s, rms {rms:.2e} s")
    assert comparison["missing"] == comparison["spurious"] == 0
    assert abs(found["max"] - largest) < REFERENCE and abs(found["rms"] - rms) < REFERENCE


def main(program, result, truth, folder):
    folder = pathlib.Path(folder)
    with open(truth) as file:
        truth = [(float(event["time"]), event["kind"]) for event in json.load(file)["events"]]

    series, table = folder / "dop853.csv", folder / "dop853.events.csv"
    make("scipy_events.py", result, "DOP853", series)
    with open(table) as file:
        events = [(float(row["time"]), row["kind"]) for row in csv.DictReader(file)]
    agree("DOP853", compare(program, result, series, "--events", table), events, truth)
    agree("DOP853, events alone", compare(program, result, table), events, truth)
    found = compare(program, result, series)
    # Found in samples of 2 us, they are good to two percent of that.
    assert found["missing"] == found["spurious"] == 0 and found["event_errors"]["max"] < 4e-8, found["verdict"]

    archive = folder / "radau.npz"
    make("scipy_events.py", result, "Radau", archive)
    data = np.load(archive)
    events = list(zip(data["event_time"].tolist(), data["event_kind"].tolist()))
    agree("Radau", compare(program, result, archive), events, truth)

    series = folder / "rk4.csv"
    make("rk4.py", result, "1e-6", series)
    rk4 = compare(program, result, series)
    print(f"RK4: {rk4['verdict']}")
    # Its events are those of the truth, late by up to a step and what that does to the later ones.
    assert rk4["missing"] == rk4["spurious"] == 0 and 1e-7 < rk4["event_errors"]["max"] < 5e-6
    assert not rk4["causes"]

    belt(program, folder)


def belt(program, folder):
    """The block on a belt of Leine and others, by its known slip and period, s."""
    reference = folder / "belt-leine.h5"
    subprocess.run([program, "run", "belt-leine", "-q", "--method", "series", "--force", "-o", reference], check=True)
    series, table = folder / "belt.csv", folder / "belt.events.csv"
    make("belt.py", "events", series)
    with open(table) as file:
        events = [(float(row["time"]), row["kind"]) for row in csv.DictReader(file)]
    slip, period = 4.295999525480154883, 12.00103129483057865
    truth = [(5 + period * (k // 2) + slip * (k % 2), "stick" if k % 2 else "slip") for k in range(len(events))]
    agree("belt", compare(program, reference, series, "--events", table), events, truth)
    smooth = folder / "tanh.csv"
    make("belt.py", "tanh", smooth)
    found = compare(program, reference, smooth, "--velocity-tolerance", "1e-2")
    print(f"belt, tanh: {found['verdict']}")
    assert found["missing"] == 0 and found["causes"][0]["cause"] == "regularised-law"
    assert "tanh" in found["causes"][0]["evidence"]
    # The period of the regularised law is 11.90059994 s.
    assert abs(found["cycles"]["per_cycle"] - (11.90059994 - period)) < 1e-4


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
