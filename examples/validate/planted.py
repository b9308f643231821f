#!/usr/bin/env python3
"""Solvers of the brake with one mistake each, and what `stickslip compare` says of them, as a table in Markdown.

    stickslip run
    python examples/validate/planted.py paper.h5

Each is SciPy's DOP853 with events, as in scipy_events.py, from the kick on, with one number changed. The regularised ones have a
smooth function in the place of the sign of omega_r, and no stick. Needs numpy, scipy and h5py; STICKSLIP names the program.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy.integrate import solve_ivp

from brake import Brake
from scipy_events import run

NAMES = ["rotor_twist", "rotor_twist_rate", "phi1", "phi1_dot", "theta_dot"]


def times(name, factor):
    return lambda brake: setattr(brake, name, factor * getattr(brake, name))


def to(name, value):
    return lambda brake: setattr(brake, name, value)


def kick(rotor, stator):
    """A kick that adds these parts of the reference's to the rotor's and to the stator's surface speed."""

    def change(brake):
        before, after = brake.unkicked, brake.state
        state = before.copy()
        state[1] += rotor * (after[1] - before[1])
        state[3] += stator * (after[3] - before[3])
        brake.state = state

    return change


def both(*changes):
    def change(brake):
        for one in changes:
            one(brake)

    return change


MISTAKES = {
    "none": both(),
    "alpha 4.9": to("decay", 4.9),
    "r x 1.001": times("radius", 1.001),
    "c_t x 0.9": times("damping", 0.9),
    "mu_s 0.59": to("low", 0.59),
    "mu_d 0.31": to("high", 0.31),
    "mu_0 0.62": to("breakaway", 0.62),
    "J x 2": times("surface", 2),
    "k_t x 1.01": times("stiffness", 1.01),
    "I x 1.01": times("inertia", 1.01),
    "kick x 2": kick(2, 2),
    "kick on the rotor's surface only": kick(2, 0),
    "kick on the stator's surface only": kick(0, 2),
    "half of the kick, on the rotor's surface": kick(1, 0),
    "alpha 4.9 and c_t x 0.9": both(to("decay", 4.9), times("damping", 0.9)),
    "alpha 4.9, c_t x 0.9 and k_t x 1.01": both(to("decay", 4.9), times("damping", 0.9), times("stiffness", 1.01)),
}

SMOOTH = {
    "tanh(omega_r/eps), eps = 0.001 rad/s": lambda w: np.tanh(w / 1e-3),
}


def regularised(brake, function):
    """Times and states with friction mu(|omega_r|) function(omega_r)."""

    def rates(t, y):
        rotor, stator = brake.torques(y)
        w = brake.relative_velocity(y)
        mu = brake.high + (brake.low - brake.high) * np.exp(-brake.decay * abs(w))
        friction = function(w) * mu * brake.radius * brake.normal_force
        theta = -rotor / brake.inertia
        v = (friction - stator) / brake.surface
        return [y[1], theta - (rotor - friction) / brake.surface, y[3], v, theta]

    grid = np.arange(brake.start, brake.stop, 2e-6)
    grid = grid[grid <= brake.stop]
    twist = brake.limit() / brake.stiffness
    rate = twist * np.sqrt(brake.stiffness / brake.surface)
    scale = 1e-9 * np.array([twist, rate, twist, rate, rate])
    part = solve_ivp(rates, (brake.start, brake.stop), brake.state, "Radau", t_eval=grid, rtol=1e-8, atol=scale)
    return part.t, part.y


def save(path, brake, t, y):
    table = np.column_stack([t, *y, brake.relative_velocity(y)])
    header = ",".join(["time", *NAMES, "relative_velocity"])
    np.savetxt(path, table, "%.17g", ",", header=header, comments="")


def said(reference, path, *options):
    program = os.environ.get("STICKSLIP", "stickslip")
    command = [program, "compare", "--json", reference, path, *options]
    comparison = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)["comparisons"][0]
    return [f"{cause['cause']}: {cause['evidence']}" for cause in comparison["causes"]]


def main(reference):
    print("| planted | said |\n|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "candidate.csv"
        events = path.with_suffix(".events.csv")

        def row(name, *options):
            causes = said(reference, path, *options)
            print(f"| {name} | {'; also '.join(causes) or 'nothing'} |", flush=True)

        for name, change in MISTAKES.items():
            brake = Brake(reference)
            change(brake)
            t, y, word = run(brake, "DOP853")
            save(path, brake, t, y)
            events.write_text("time,kind\n" + "".join(f"{float(at)!r},{kind}\n" for at, kind in word))
            row(name, "--events", events)
            if name == "none":
                save(path, brake, t - brake.start, y)
                row("times counted from the kick")
        for name, function in SMOOTH.items():
            brake = Brake(reference)
            save(path, brake, *regularised(brake, function))
            row(name)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
