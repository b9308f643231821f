#!/usr/bin/env python3
"""The stick-slip of a brake with a bare Runge-Kutta method of fixed step, as many a thesis has it.

    python examples/validate/rk4.py paper.h5 1e-6 rk4.csv
    stickslip compare paper.h5 rk4.csv

The friction state is tested at the steps, events are not located: an event is late by up to a step. Needs numpy and h5py.
"""

import sys

import numpy as np

from brake import Brake


def step(rates, t, y, h):
    k1 = rates(t, y)
    k2 = rates(t, y + h / 2 * k1)
    k3 = rates(t, y + h / 2 * k2)
    k4 = rates(t, y + h * k3)
    return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def main(reference, h, output):
    h = float(h)
    brake = Brake(reference)
    y, sense = brake.state, 1.0
    rows = [[brake.start, *y, brake.relative_velocity(y)]]
    for n in range(int((brake.stop - brake.start) / h)):
        y = step(brake.stick if sense == 0 else brake.slip(sense), 0.0, y, h)
        torque = brake.transmitted(y)
        if sense == 0:
            if abs(torque) > brake.limit():
                sense = np.sign(torque)
        elif sense * brake.relative_velocity(y) <= 0:
            # Both surfaces at their mean speed, then the test of the paper's (8) and (10).
            y = brake.joined(y)
            sense = 0.0 if abs(torque) <= brake.limit() else np.sign(torque)
        w = 0.0 if sense == 0 else brake.relative_velocity(y)
        rows.append([brake.start + (n + 1) * h, *y, w])
    header = "t [s],u [rad],u_dot [rad/s],v [rad],v_dot [rad/s],theta_dot [rad/s],omega_r [rad/s]"
    np.savetxt(output, rows, "%.17g", ",", header=header, comments="")
    print(f"{output}: {len(rows)} samples")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
