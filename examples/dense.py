#!/usr/bin/env python3
"""Evaluate the dense output of a result file: any channel at any time, here the highest torque and when it occurs.

    stickslip run paper --set output.dense=true -o dense.h5
    python examples/dense.py dense.h5

Needs NumPy and h5py.
"""

import sys

import h5py
import numpy as np


def evaluate(file, channel, t, side="right"):
    """The channel at the times t (s); at an event its value after it, or before it with side="left"."""
    start, end = file["dense/start"][:], file["dense/end"][:]
    t = np.atleast_1d(np.asarray(t, dtype=float))
    piece = np.searchsorted(start, t, "right") - 1 if side == "right" else np.searchsorted(end, t, "left")
    piece = np.clip(piece, 0, len(start) - 1)
    coefficients = file["dense/coefficients/" + channel][:].reshape(len(start), -1)
    x = (2 * (t - start[piece]) - (end - start)[piece]) / (end - start)[piece]
    inside = (start[0] <= t) & (t <= end[-1])
    return np.where(inside, np.polynomial.chebyshev.chebval(x, coefficients[piece].T, tensor=False), np.nan)


def main(path):
    with h5py.File(path) as file:
        # Between the events of the stick-slip, and on both sides of each.
        events = file["events/time"][:][np.isin(file["events/kind"][:], (0, 1))]
        t = np.linspace(events[0], events[-1], 200_001)
        times = np.concatenate([t, events, events])
        torque = np.concatenate(
            [evaluate(file, "friction_torque", at, side) for at, side in ((t, "right"), (events, "left"), (events, "right"))]
        )
        largest = torque.argmax()
        print(f"highest friction torque: {torque[largest]:.6f} N m at {times[largest]:.9f} s")
        # The samples of the file are on the curve.
        rows = slice(None, None, 97)
        samples = file["trajectory/friction_torque"][rows]
        difference = np.abs(evaluate(file, "friction_torque", file["trajectory/time"][rows]) - samples).max()
        print(f"largest difference from {len(samples)} samples: {difference:.1e} N m")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
