"""Natural frequencies, damping and loss of stability of a case."""

from __future__ import annotations

from typing import Any

from . import _native
from ._case import CaseLike, Overrides, settings, source
from ._command import Report, worded


class Modes(Report):
    """The result of ``stickslip modes``. ``print(modes)`` shows its report; ``document`` is the dictionary of ``--json``."""

    def __getitem__(self, name: str) -> Any:
        return self.document[name]

    def __repr__(self) -> str:
        return f"<Modes of {self.document.get('title', '')}>"


def modes(case: CaseLike = "paper", overrides: Overrides = None) -> Modes:
    """Natural frequencies (Hz), damping and loss of stability of a case, as :func:`run` takes it."""
    with worded({}):
        return Modes(_native.modes(*source(case, absolute=True), settings(overrides)), {})
