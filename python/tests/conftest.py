"""Runs that several tests share."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import stickslip
from stickslip.__main__ import program as installed

SHORT = {"output.end_time": 0.02}
"""Of a run that takes milliseconds."""


@pytest.fixture(scope="session")
def paper() -> stickslip.Run:
    return stickslip.run("paper")


@pytest.fixture(scope="session")
def belt() -> stickslip.Run:
    return stickslip.run("belt-leine", {"output.end_time": 30}, dense=True)


@pytest.fixture(scope="session")
def program() -> str:
    """The program of the same sources: that of the installation, of STICKSLIP_PROGRAM, or of cargo build --release."""
    found = os.environ.get("STICKSLIP_PROGRAM")
    built = Path(__file__).parents[2] / "target" / "release" / "stickslip"
    for path in (found, installed(), str(built)):
        if path and os.access(path, os.X_OK):
            return path
    pytest.skip("there is no program stickslip; build it, or name it by STICKSLIP_PROGRAM")
