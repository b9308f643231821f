"""High-accuracy reference runs of friction-induced stick-slip vibration.

    import stickslip
    run = stickslip.run("paper", {"friction.decay": "4.8 s/rad"})
    run.events["time"]            # s
    run.trajectory["normal_force"]  # N; see run.units

All numbers are in SI and radians. The columns are described in docs/reference/columns.md, the module in docs/reference/python.md.
"""

import sys as _sys

from . import _native, _probe
from ._case import Case, cases
from ._branches import continue_, follow
from ._certificate import Certificate, certify
from ._comparison import Comparison, compare
from ._cycle import Cycle, cycle
from ._draw import plot
from ._errors import CaseError, FileError, InputError, RunError, StickslipError, StickslipWarning
from ._modes import Modes, modes
from ._native import __version__
from ._open import open
from ._run import Run, run
from ._sweep import sweep

# An interpreter within another program does not know where one is. There files are read without a probe.
if _sys.executable:
    _native.set_probe(_probe.command(_native.__file__))

__all__ = [
    "Case",
    "CaseError",
    "Certificate",
    "Comparison",
    "Cycle",
    "FileError",
    "InputError",
    "Modes",
    "Run",
    "RunError",
    "StickslipError",
    "StickslipWarning",
    "__version__",
    "cases",
    "certify",
    "compare",
    "continue_",
    "cycle",
    "follow",
    "modes",
    "open",
    "plot",
    "run",
    "sweep",
]
