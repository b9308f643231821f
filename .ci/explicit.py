#!/usr/bin/env python3
"""A binout that LSTC's own library writes is read rightly.

    .ci/explicit.py PROGRAM RESULT FOLDER

`lasso.dyna.lsda_py3` of lasso-python is LSTC's Python library of the format, which also writes it. It writes the speeds of
both surfaces of RESULT in both precisions, over two files, and `stickslip compare` has to find RESULT's events in them.
"""

import json
import pathlib
import subprocess
import sys

import h5py
import numpy as np
from lasso.dyna.lsda_py3 import Lsda

START = 6.9665


def write(folder, real, time, rotor, stator):
    """Writes a run of two files; its members are 5, 11 and 12."""
    folder.mkdir(exist_ok=True)
    half = len(time) // 2
    for number, states in enumerate([range(half), range(half, len(time))]):
        file = Lsda(str(folder / f"binout{number:04}"), "w")
        file.cd("/nodout/metadata")
        file.write("ids", Lsda.I4, [5, 11, 12])
        for k in states:
            file.cd(f"/nodout/d{k + 1:06}")
            file.write("time", real, [time[k]])
            file.write("rz_velocity", real, [0.0, rotor[k], stator[k]])
            if k % 1000 == 0:
                file.flush()
        file.close()
    return folder / "binout0000"


def main(program, result, folder):
    with h5py.File(result) as file:
        trajectory = file["trajectory"]
        rows = trajectory["time"][:] >= START
        time, stator, velocity = (trajectory[name][rows] for name in ["time", "phi1_dot", "relative_velocity"])
    # In stick both surfaces have the same number.
    rotor = stator + velocity
    for name, real in [("double", Lsda.R8), ("single", Lsda.R4)]:
        file = write(pathlib.Path(folder) / f"binout-{name}", real, time, rotor, stator)
        command = [program, "compare", result, file, "--json", "--velocity-tolerance", "1e-6"]
        for channel, member in [("phi2_dot", 11), ("phi1_dot", 12)]:
            command += ["--column", f"{channel}=nodout/{member}/rz_velocity"]
        run = subprocess.run(command, check=True, capture_output=True, text=True)
        found = json.loads(run.stdout)["comparisons"][0]
        print(f"{name}: {found['format']}, {found['verdict']}")
        assert found["missing"] == found["spurious"] == 0, found["verdict"]
        assert found["event_errors"]["matched"] == found["reference_events"] == 95
        spacing = found.get("resolution", {}).get("seconds")
        assert spacing == (None if real == Lsda.R8 else np.spacing(np.float32(6.99))), spacing


if __name__ == "__main__":
    main(*sys.argv[1:])
