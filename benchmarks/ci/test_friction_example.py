"""An example for pytest: a fixture that holds rows against a problem, and tests that use it.

Put the fixture into conftest.py, and the path of check.py into CHECK.
"""

import os
import subprocess
import sys
from typing import Any, Callable, Iterable, Sequence

import example_solver
import pytest

CHECK = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "check.py")


@pytest.fixture
def friction(tmp_path: Any) -> Callable[..., None]:
    """Fails with the report of check.py unless rows under a header meet what is required of a problem."""

    def check(problem: str, header: str, rows: Iterable[Sequence[Any]], *require: str) -> None:
        path = tmp_path / "result.csv"
        path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n", encoding="utf-8")
        options = [f"--require={bound}" for bound in require]
        done = subprocess.run(
            [sys.executable, CHECK, problem, path, *options], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr

    return check


def test_events(friction: Callable[..., None]) -> None:
    """The stop of the launched mass, as an events table."""
    friction("01", "time,kind", example_solver.solve()[1], "budget")


def test_samples(friction: Callable[..., None]) -> None:
    """The motion, in which check.py finds the stop."""
    friction("01", "time,x,v", example_solver.solve()[0], "digits=9", "position=1e-9")


def test_a_coarse_run_is_not_enough(friction: Callable[..., None]) -> None:
    """Four steps to the end are too few."""
    with pytest.raises(AssertionError, match="too coarse"):
        friction("01", "time,x,v", example_solver.solve(4)[0], "samples=9")
