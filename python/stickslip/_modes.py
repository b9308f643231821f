"""Natural frequencies, damping and loss of stability of a case."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any

from ._case import CaseLike, Overrides, settings, source
from ._command import command


class Modes:
    """The result of ``stickslip modes``. ``print(modes)`` shows its report; ``document`` is the dictionary of ``--json``."""

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
        elif kind != "built-in":
            text = os.path.abspath(text)
        arguments = ["modes", text, *(f"--set={setting}" for setting in settings(overrides))]
        report, document, _, _ = command(arguments, {text: "the case"} if kind == "text" else {}, keeps=False)
    return Modes(report, json.loads(document or "{}"))
