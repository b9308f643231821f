"""Exceptions. Their texts are those of the program: what, where, and what to do."""

from __future__ import annotations

from typing import Any


class StickslipError(Exception):
    """Any error of this module."""


class InputError(StickslipError, ValueError):
    """Wrong input: an argument, a candidate, a study."""


class CaseError(InputError):
    """An invalid case: every problem with its line and key."""


class FileError(StickslipError, OSError):
    """A file that is missing, damaged, of another program, or cannot be written."""


class StickslipWarning(UserWarning):
    """A warning about a run, such as that its onset is amplified rounding; also in ``run.warnings``."""


def needs_xarray() -> None:
    """Says, before anything is computed, what to install where datasets are made."""
    try:
        import xarray  # noqa: F401
    except ImportError as error:
        raise InputError("datasets are those of xarray, which is not installed: pip install 'stickslip[xarray]'") from error


class RunError(StickslipError, RuntimeError):
    """A computation that failed.

    ``run`` is the run up to its failure; ``None`` if no run failed.
    """

    run: Any = None
