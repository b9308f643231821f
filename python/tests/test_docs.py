"""The manual: its Python runs, block after block in one namespace."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

MANUAL = Path(__file__).parents[2] / "docs" / "reference" / "python.md"


@pytest.mark.skipif(not MANUAL.exists(), reason="the manual is not beside the tests")
def test_property_the_manual_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```", MANUAL.read_text(encoding="utf-8"), re.S | re.M)
    assert len(blocks) >= 8
    namespace: dict[str, object] = {"__name__": "__main__"}
    for block in blocks:
        exec(compile(block, str(MANUAL), "exec"), namespace)
    printed = capsys.readouterr().out
    assert "did you mean friction.decay" in printed
    assert "converged: every event within" in printed
