"""Reads an HDF5 file without an intact seal before the module does, in a process of its own: a damaged file can crash it.

The process starts this file as a script, which loads the compiled part of the module alone. The package itself, with NumPy, would
take ten times as long.
"""

from __future__ import annotations

import importlib.util
import sys


def command(native: str) -> list[str]:
    """What starts a probe with the compiled part of the module at this path; two arguments follow."""
    return [sys.executable, "-I", "-S", __file__, native]


def main() -> int:
    """Probes the file that the arguments name."""
    native = sys.argv[1]
    spec = importlib.util.spec_from_file_location("_native", native)
    if spec is None or spec.loader is None:
        return 2
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    status: int = module.probe(sys.argv[2:])
    return status


if __name__ == "__main__":
    sys.exit(main())
