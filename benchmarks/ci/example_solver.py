"""Solves problem 01 in plain Python, and writes samples and events: an example of a solver under test.

    python example_solver.py samples.csv [events.csv]

The classical Runge-Kutta method with a fixed step; the step in which the mass stops is divided where its speed is zero.
"""

import json
import os
import sys
from typing import List, Tuple

PROBLEM = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "01-launched-mass", "problem.json")
Row = Tuple[float, float, float]


def step(x: float, v: float, h: float, deceleration: float) -> Tuple[float, float]:
    """One step of length `h` of a mass that slides forward."""

    def slope(_x: float, speed: float) -> Tuple[float, float]:
        return speed, -deceleration

    a = slope(x, v)
    b = slope(x + 0.5 * h * a[0], v + 0.5 * h * a[1])
    c = slope(x + 0.5 * h * b[0], v + 0.5 * h * b[1])
    d = slope(x + h * c[0], v + h * c[1])
    return x + h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]), v + h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1])


def solve(intervals: int = 100) -> Tuple[List[Row], List[Tuple[float, str]]]:
    """Rows of time, position and speed, and the events."""
    with open(PROBLEM, encoding="utf-8") as file:
        problem = json.load(file)
    system = problem["system"]
    limit = system["friction"]["kinetic"] * system["normal_force"]["value"]
    deceleration = limit / system["first"]["inertia"][0]
    h = problem["end_time"] / intervals
    x, v = 0.0, system["initial"]["first_speed"][0]
    rows, events = [(0.0, x, v)], []
    for k in range(intervals):
        if v > 0.0:
            end = step(x, v, h, deceleration)
            if end[1] <= 0.0:
                low, high = 0.0, h
                for _ in range(60):
                    middle = 0.5 * (low + high)
                    low, high = (middle, high) if step(x, v, middle, deceleration)[1] > 0.0 else (low, middle)
                events.append((k * h + high, "stick"))
                end = step(x, v, high, deceleration)[0], 0.0
            x, v = end
        rows.append(((k + 1) * h, x, v))
    return rows, events


def main() -> None:
    """Writes the files."""
    rows, events = solve()
    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write("# solver: example_solver.py\n# settings: 100 steps\ntime,x,v\n")
        file.writelines(f"{time!r},{x!r},{v!r}\n" for time, x, v in rows)
    if len(sys.argv) > 2:
        with open(sys.argv[2], "w", encoding="utf-8") as file:
            file.write("# solver: example_solver.py\ntime,kind\n")
            file.writelines(f"{time!r},{kind}\n" for time, kind in events)


if __name__ == "__main__":
    main()
