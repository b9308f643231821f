#!/usr/bin/env python3
"""The notebooks of examples/notebooks run from top to bottom, and say what they should.

    .ci/notebooks.py FOLDER

in a Python that has the module stickslip and .ci/notebooks.txt; what they write goes to FOLDER, with the executed notebooks.
They are committed without outputs.
"""

import pathlib
import re
import sys

import nbformat
from nbclient import NotebookClient

NOTEBOOKS = pathlib.Path(__file__).resolve().parent.parent / "examples/notebooks"


def text_of(cell):
    """What a cell has shown, as text."""
    parts = []
    for output in cell.get("outputs", []):
        parts.append(output.get("text", ""))
        parts.append(output.get("data", {}).get("text/plain", ""))
    return "\n".join(parts)


def first_reference(shown, drawn):
    assert "events" in shown and "(48 sticks, 47 slips)" in shown, shown
    assert "48 sticks, from 6.975001494 s to 6.989377156 s" in shown, shown
    # From the polynomials of a file: 69.909 N m (.ci/run).
    assert "highest friction torque: 69.909 N m" in shown, shown
    digits = int(re.search(r"at least (\d+) digits", shown)[1])
    assert digits >= 11, shown
    assert drawn == 1


def validate_solve_ivp(shown, drawn):
    # The solver at 1e-10; then the four tolerances, of which the last is the same.
    errors = [float(error) for error in re.findall(r"matched events are within (\S+) s", shown)]
    assert errors[0] < 1e-9, errors
    tolerances = dict(re.findall(r"^(1e-\d+): (.*)$", shown, re.MULTILINE))
    assert list(tolerances) == ["1e-04", "1e-06", "1e-08", "1e-10"], shown
    # The planted error is found, and called by its name: 0.0113 kg m^2 times 1.001.
    assert "another parameter: torsion.surface_inertia (J) = 0.0113113 " in shown, shown
    assert drawn == 1


def main(folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for check in (first_reference, validate_solve_ivp):
        path = NOTEBOOKS / f"{check.__name__}.ipynb"
        notebook = nbformat.read(path, as_version=4)
        cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
        assert all(not cell.outputs and cell.execution_count is None for cell in cells), f"{path} has outputs: clear them"
        NotebookClient(notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(folder)}}).execute()
        nbformat.write(notebook, folder / path.name)
        outputs = [output for cell in cells for output in cell.outputs]
        drawn = sum("image/png" in output.get("data", {}) for output in outputs)
        shown = "\n".join(text_of(cell) for cell in cells)
        assert "Warning" not in shown, shown
        check(shown, drawn)
        print(f"{path.name}: {len(cells)} cells of code, {drawn} figure")


main(*sys.argv[1:])
