#!/usr/bin/env python3
"""The stick-slip of a brake with SciPy's solve_ivp and its events, written as CSV or NPZ for `stickslip compare`.

    stickslip run
    python examples/validate/scipy_events.py paper.h5 DOP853 dop853.csv
    stickslip compare paper.h5 dop853.csv --events dop853.events.csv
    stickslip compare paper.h5 dop853.csv          # the events found in the time series instead

The method is any that solve_ivp knows. Needs numpy, scipy and h5py.
"""

import pathlib
import sys

import numpy as np
from scipy.integrate import solve_ivp

from brake import Brake

INTERVAL = 2e-6
TOLERANCE = 1e-10


def run(brake, method):
    """Times, states and events, one segment after the other."""
    # The absolute tolerances are 1e-10 of the size of each component in stick-slip.
    twist = brake.limit() / brake.stiffness
    rate = twist * np.sqrt(brake.stiffness / brake.surface)
    scale = TOLERANCE * np.array([twist, rate, twist, rate, rate])
    # The explicit and the implicit method alike have to resolve the fast mode.
    period = 2 * np.pi * np.sqrt(brake.surface / brake.stiffness)
    times, states, events = [], [], []
    t, y, sense = brake.start, brake.state, 1.0
    while t < brake.stop:
        stuck = sense == 0

        def stops(_, y, sense=sense):
            return sense * brake.relative_velocity(y)

        def breaks_forward(_, y):
            return brake.limit() - brake.transmitted(y)

        def breaks_backward(_, y):
            return brake.limit() + brake.transmitted(y)

        guards = [breaks_forward, breaks_backward] if stuck else [stops]
        for guard in guards:
            guard.terminal, guard.direction = True, -1
        # A breakaway leaves omega_r = 0 with no slope: the guard of slip is looked at again a little later.
        if not stuck and events:
            ahead = period / 1000
            part = solve_ivp(brake.slip(sense), (t, t + ahead), y, method, rtol=TOLERANCE, atol=scale)
            t, y = part.t[-1], part.y[:, -1]
        grid = np.arange(np.ceil(t / INTERVAL), np.ceil(brake.stop / INTERVAL)) * INTERVAL
        part = solve_ivp(
            brake.stick if stuck else brake.slip(sense),
            (t, brake.stop),
            y,
            method,
            t_eval=grid[grid > t],
            events=guards,
            rtol=TOLERANCE,
            atol=scale,
            max_step=period / 20,
        )
        times.append(part.t)
        states.append(part.y)
        if part.status != 1:
            break
        which = 0 if len(part.t_events[0]) else 1
        t, y = part.t_events[which][0], part.y_events[which][0]
        if stuck:
            sense = 1.0 if which == 0 else -1.0
            events.append((t, "slip"))
        else:
            y = brake.joined(y)
            torque = brake.transmitted(y)
            sense = 0.0 if abs(torque) <= brake.limit() else np.sign(torque)
            events.append((t, "stick" if sense == 0 else "reversal"))
    return np.concatenate(times), np.concatenate(states, axis=1), events


def main(reference, method, output):
    brake = Brake(reference)
    t, y, events = run(brake, method)
    names = ["rotor_twist", "rotor_twist_rate", "phi1", "phi1_dot", "theta_dot"]
    channels = dict(zip(names, y), relative_velocity=brake.relative_velocity(y))
    output = pathlib.Path(output)
    if output.suffix == ".npz":
        kinds = np.array([kind for _, kind in events])
        np.savez(output, time=t, event_time=np.array([time for time, _ in events]), event_kind=kinds, **channels)
    else:
        table = np.column_stack([t, *channels.values()])
        np.savetxt(output, table, "%.17g", ",", header=",".join(["time", *channels]), comments="")
        with open(output.with_suffix(".events.csv"), "w") as file:
            file.write("time,kind\n")
            file.writelines(f"{float(time)!r},{kind}\n" for time, kind in events)
    print(f"{output}: {len(t)} samples, {len(events)} events")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
