#!/usr/bin/env python3
"""What the module costs: a run beside the program's own, and many short runs beside a sweep.

    python python/benches/overhead.py [PROGRAM]

Ratios within one run of this script, interleaved: medians of the ratios of neighbours. PROGRAM is the program of the same
sources, target/release/stickslip without it. Needs Linux or macOS.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import stickslip

RUNS = 15
POINTS = 1000
ROUNDS = 5


def user_time(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def of_program(program: str, folder: str) -> tuple[float, float]:
    """Wall and processor time of the program's own run, s."""
    clock, used = time.perf_counter(), user_time(resource.RUSAGE_CHILDREN)
    subprocess.run([program, "run", "paper", "-q", "--no-witness", "--force", "-o", f"{folder}/p.h5"], check=True)
    return time.perf_counter() - clock, user_time(resource.RUSAGE_CHILDREN) - used


def of_module() -> tuple[float, float]:
    clock, used = time.perf_counter(), user_time(resource.RUSAGE_SELF)
    stickslip.run("paper")
    return time.perf_counter() - clock, user_time(resource.RUSAGE_SELF) - used


def paper(program: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        of_program(program, folder), of_module()
        pairs = [(of_module(), of_program(program, folder)) for _ in range(RUNS)]
    for index, name in enumerate(("wall", "processor")):
        ratios = [module[index] / own[index] for module, own in pairs]
        module = statistics.median(pair[0][index] for pair in pairs)
        print(f'run("paper"): {name} time {module * 1e3:.1f} ms, over the program\'s own run {statistics.median(ratios):.3f}')


def short_runs() -> None:
    values = [15.0 + 10.0 * point / POINTS for point in range(POINTS)]
    axes = {"torsion.damping": values}
    settings = {"solver.method": "series", "solver.rtol": 1e-8}

    def by_sweep() -> None:
        stickslip.sweep(axes, "paper", settings, jobs=1)

    def by_runs() -> None:
        for value in values:
            stickslip.run("paper", {**settings, "torsion.damping": value}, trajectory=False).summary["onset_time"]

    def times(call: Callable[[], None]) -> tuple[float, float]:
        clock, used = time.perf_counter(), time.process_time()
        call()
        return time.perf_counter() - clock, time.process_time() - used

    times(by_runs)
    pairs = [(times(by_sweep), times(by_runs)) for _ in range(ROUNDS)]
    for index, name in enumerate(("wall", "processor")):
        ratio = statistics.median(sweep[index] / runs[index] for sweep, runs in pairs)
        runs = statistics.median(pair[1][index] for pair in pairs)
        print(f"{POINTS} short runs: {name} time {runs / POINTS * 1e3:.2f} ms each, {ratio:.2f} of the rate of sweep on one thread")


if __name__ == "__main__":
    built = Path(__file__).parents[2] / "target" / "release" / "stickslip"
    paper(sys.argv[1] if len(sys.argv) > 1 else os.fspath(built))
    short_runs()
