"""``python -m stickslip`` runs the program."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig


def program() -> str | None:
    """Path of this installation's program, or of the one on the search path."""
    name = "stickslip.exe" if os.name == "nt" else "stickslip"
    for folder in (sysconfig.get_path("scripts"), os.path.dirname(sys.executable)):
        path = os.path.join(folder, name)
        if os.path.isfile(path) and os.access(path, os.X_OK):
            return path
    return shutil.which(name)


def main() -> int:
    """Runs it with the arguments of this process."""
    path = program()
    if path is None:
        print(
            "stickslip: the program is not installed beside the module, and none is on the path; install the wheel that has "
            "it, or build it with cargo",
            file=sys.stderr,
        )
        return 2
    arguments = [path, *sys.argv[1:]]
    if os.name == "nt":
        return subprocess.call(arguments)
    os.execv(path, arguments)


if __name__ == "__main__":
    sys.exit(main())
