"""The manual: its Python runs, block after block in one namespace."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import stickslip

DOCS = Path(__file__).parents[2] / "docs"
beside_the_manual = pytest.mark.skipif(not DOCS.exists(), reason="the manual is not beside the tests")


def run_page(name):
    """Number of blocks of a page that were run."""
    page = DOCS / name
    blocks = re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M)
    namespace: dict[str, object] = {"__name__": "__main__"}
    for block in blocks:
        exec(compile(block, str(page), "exec"), namespace)
    return len(blocks)


@beside_the_manual
def test_property_data_out_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    stickslip.run("paper", method="series").save("paper.h5")
    axes = {"friction.decay": [4.0, 5.0], "torsion.damping": [20.0, 22.0]}
    stickslip.sweep(axes, "paper", method="series", output="map.h5")
    assert run_page("5-data-out.md") == 2
    printed = capsys.readouterr().out
    # The period of Leine and others.
    assert "12.0010312948" in printed


@beside_the_manual
def test_property_the_manual_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run_page("reference/python.md") >= 8
    printed = capsys.readouterr().out
    assert "did you mean friction.decay" in printed
    assert "converged: every event within" in printed
