#!/usr/bin/env python3
"""Leine's block on a belt with a Runge-Kutta method of fixed step that locates its events, and two mistakes to try.

    stickslip run belt-leine
    python3 examples/validate/block.py mine.csv               # correct
    python3 examples/validate/block.py mine.csv scale         # another value of a parameter
    python3 examples/validate/block.py mine.csv hard          # a spring that hardens: the case has no such term
    stickslip compare belt-leine.h5 mine.csv

Needs Python alone.
"""

import sys

output, *mistakes = sys.argv[1:] or sys.exit(__doc__)
BELT = 0.2  # m/s
STEP = 5e-3  # s
SCALE = 0.35 if "scale" in mistakes else 1 / 3  # m/s, in friction = 1 N / (1 + sliding speed / SCALE)
HARD = 0.05 if "hard" in mistakes else 0.0  # N/m^3
BREAKAWAY = 1.0  # m; here the spring of 1 N/m has the force at which a stick ends


def acceleration(x, v):
    """Of the block of 1 kg while it is slower than the belt, m/s^2."""
    return 1 / (1 + (BELT - v) / SCALE) - x - HARD * x**3


def slide(x, v, h):
    """A step of the classical Runge-Kutta method in slip."""
    k1, l1 = v, acceleration(x, v)
    k2, l2 = v + h / 2 * l1, acceleration(x + h / 2 * k1, v + h / 2 * l1)
    k3, l3 = v + h / 2 * l2, acceleration(x + h / 2 * k2, v + h / 2 * l2)
    k4, l4 = v + h * l3, acceleration(x + h * k3, v + h * l3)
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), v + h / 6 * (l1 + 2 * l2 + 2 * l3 + l4)


def advance(x, v, sticks, h):
    """A step with at most one event, which is located within it."""
    if sticks:
        held = min(h, (BREAKAWAY - x) / BELT)
        x += BELT * held
        return (x, BELT, True) if x < BREAKAWAY - 1e-15 else (*slide(x, BELT, h - held), False)
    x_end, v_end = slide(x, v, h)
    if v_end < BELT:
        return x_end, v_end, False
    low, high = 0.0, h
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if slide(x, v, middle)[1] < BELT else (low, middle)
    return slide(x, v, high)[0] + BELT * (h - high), BELT, True


state = (0.0, BELT, True)
with open(output, "w") as file:
    print("time,x,v", file=file)
    for n in range(20001):
        print(f"{n * STEP:.17g},{state[0]:.17g},{state[1]:.17g}", file=file)
        state = advance(*state, STEP)
