#!/usr/bin/env python3
"""The block on a belt of `belt-leine` with SciPy's solve_ivp and its events, or with regularised friction.

    stickslip run belt-leine
    python examples/validate/belt.py events belt.csv
    stickslip compare belt-leine.h5 belt.csv --events belt.events.csv
    python examples/validate/belt.py tanh tanh.csv
    stickslip compare belt-leine.h5 tanh.csv --velocity-tolerance 1e-2

The columns are the time, the position and the speed of the block. Needs numpy and scipy.
"""

import pathlib
import sys

import numpy as np
from scipy.integrate import solve_ivp

BELT, END = 0.2, 100.0
EXACT = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-12}


def friction(w):
    return 1 / (1 + 3 * abs(w))


def with_events():
    """Stick in closed form, slip by solve_ivp up to the speed of the belt."""

    def stops(_, y):
        return BELT - y[1]

    stops.terminal, stops.direction = True, -1
    grid = np.arange(0, END, 0.01)
    t, x, rows, events = 0.0, 0.0, [], []
    while t < END:
        release = t + (1 - x) / BELT
        times = grid[(grid >= t) & (grid < release)]
        rows.append(np.column_stack([times, x + BELT * (times - t), np.full(len(times), BELT)]))
        if release >= END:
            break
        events.append((release, "slip"))
        slip = solve_ivp(
            lambda _, y: [y[1], -y[0] + friction(BELT - y[1])],
            (release, END),
            [1.0, BELT],
            t_eval=grid[grid > release],
            events=stops,
            **EXACT,
        )
        rows.append(np.column_stack([slip.t, *slip.y]))
        if slip.status != 1:
            break
        t, x = slip.t_events[0][0], slip.y_events[0][0][0]
        events.append((t, "stick"))
    return np.concatenate(rows), events


def regularised(eps=1e-3):
    """The tanh of an explicit code in the place of the sign."""
    grid = np.arange(0, END, 0.001)
    run = solve_ivp(
        lambda _, y: [y[1], -y[0] + friction(BELT - y[1]) * np.tanh((BELT - y[1]) / eps)],
        (0, END),
        [0.0, BELT],
        "Radau",
        t_eval=grid,
        rtol=1e-8,
        atol=1e-10,
    )
    return np.column_stack([run.t, *run.y]), []


if __name__ == "__main__":
    how, path = sys.argv[1], pathlib.Path(sys.argv[2])
    table, found = with_events() if how == "events" else regularised()
    np.savetxt(path, table, "%.17g", ",", header="t,x,v", comments="")
    if found:
        lines = [f"{time!r},{kind}" for time, kind in ((float(time), kind) for time, kind in found)]
        path.with_suffix(".events.csv").write_text("\n".join(["time,kind", *lines]) + "\n")
