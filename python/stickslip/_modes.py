"""Natural frequencies, damping and loss of stability of a case."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any

from . import _native
from ._case import CaseLike, Overrides, settings, source


class Modes:
    """What ``stickslip modes`` finds. ``print(modes)`` shows its report; ``document`` is the dictionary of ``--json``."""

    def __init__(self, text: str, document: dict[str, Any]) -> None:
        self._text = text
        self.document = document

    def __getitem__(self, name: str) -> Any:
        return self.document[name]

    def __str__(self) -> str:
        return self._text.rstrip()

    def __repr__(self) -> str:
        return f"<Modes of {self.document.get('title', '')}>"


def modes(case: CaseLike = "paper", overrides: Overrides = None) -> Modes:
    """Natural frequencies (Hz), damping and loss of stability of a case, as :func:`run` takes it."""
    kind, text = source(case)
    with tempfile.TemporaryDirectory(prefix="stickslip-") as folder:
        if kind == "text":
            path = Path(folder) / "case.toml"
            path.write_text(text, encoding="utf-8")
            text = os.fspath(path)
        arguments = ["modes", text, *(f"--set={setting}" for setting in settings(overrides))]
        report, document, _, _ = _native.command(arguments)
    return Modes(report, json.loads(document or "{}"))
