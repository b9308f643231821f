"""Exceptions. Their texts are those of the program: what, where, and what to do."""

from __future__ import annotations

from typing import Any


class StickslipError(Exception):
    """Any error of this module."""


class InputError(StickslipError, ValueError):
    """Wrong input: an argument, a candidate, a study."""


class CaseError(InputError):
    """A case that is none: every problem with its line and key."""


class FileError(StickslipError, OSError):
    """A file that is not there, is none of this program, is damaged, or cannot be written."""


class StickslipWarning(UserWarning):
    """What a reader of the numbers of a run has to know, such as that its onset is rounding; also in ``run.warnings``."""


def needs_xarray() -> None:
    """Says, before anything is computed, what to install where datasets are made."""
    try:
        import xarray  # noqa: F401
    except ImportError as error:
        raise InputError("datasets are those of xarray, which is not installed: pip install 'stickslip[xarray]'") from error


class RunError(StickslipError, RuntimeError):
    """A computation that failed.

    ``run`` is what was computed until then, where a run failed, else ``None``.
    """

    run: Any = None
