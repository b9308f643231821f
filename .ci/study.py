#!/usr/bin/env python3
"""A work-precision study reads the same in the programs of others.

    .ci/study.py PROGRAM FOLDER

Runs a small study; its file in h5py, netCDF4 and xarray has to hold what the program prints as JSON. Names, units and
codes are written out here a second time, independently of the program.
"""

import json
import math
import pathlib
import subprocess
import sys

import h5py
import netCDF4
import numpy as np
import xarray as xr

STUDY = """
title = "two methods"
case = "paper-si"
set = ["output.end_time=7"]

[[series]]
methods = ["cvode", "paper"]
tolerances = [1e-6]

[[series]]
methods = ["erk"]
steps = ["20 us"]
"""
# group: (dimension, {variable: (type, units)})
TABLES = {
    "runs": ("run", {
        "run": ("int32", "1"), "method": ("int8", "1"), "rtol": ("float64", "1"), "fixed_step": ("float64", "s"),
        "outcome": ("int8", "1"), "same_sequence": ("int8", "1"), "events": ("int64", "1"),
        "onset_error": ("float64", "s"), "final_stick_error": ("float64", "s"), "largest_event_error": ("float64", "s"),
        "steps": ("int64", "1"), "rhs_evaluations": ("int64", "1"), "jacobian_evaluations": ("int64", "1"),
        "wall_time": ("float64", "s"),
    }),
    "reference": ("event", {
        "event": ("int32", "1"), "kind": ("int8", "1"), "time": ("float64", "s"), "time_uncertainty": ("float64", "s"),
    }),
}
KINDS = "stick slip reversal separation contact kick corner destabilised restabilised"
# Column of /runs: where the JSON document has it.
PRINTED = {
    "rtol": ("rtol",), "fixed_step": ("fixed_step",), "events": ("events",), "steps": ("steps",),
    "same_sequence": ("same_sequence",), "rhs_evaluations": ("rhs_evaluations",),
    "jacobian_evaluations": ("jacobian_evaluations",), "wall_time": ("wall_time",),
    "onset_error": ("error", "onset"), "final_stick_error": ("error", "final_stick"),
    "largest_event_error": ("error", "largest_event"),
}


def equal(a, b):
    """Equal, or absent on both sides: NaN in the file is null in JSON."""
    return a == b if b is not None else math.isnan(a)


def main(program, folder):
    study, path = pathlib.Path(folder) / "small.toml", pathlib.Path(folder) / "small.h5"
    study.write_text(STUDY)
    command = [program, "work-precision", study, "-o", path, "--json", "--force"]
    document = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)

    values = {}
    with h5py.File(path) as file:
        assert file.attrs["format"] == "stickslip-work-precision" and file.attrs["status"] == "complete"
        for group, (dimension, variables) in TABLES.items():
            assert set(file[group]) == set(variables), sorted(file[group])
            for name, (kind, units) in variables.items():
                data = file[group][name]
                values[group, name] = data[...]
                assert data.dtype == kind and data.attrs["units"] == units, (group, name)
                assert data.attrs["long_name"] and data.ndim == 1
                scales = [scale.name for scale in data.dims[0].values()]
                assert data.is_scale if name == dimension else scales == [f"/{group}/{dimension}"], (group, name)
        methods = file["runs/method"].attrs["flag_meanings"].split()
        assert file["reference/kind"].attrs["flag_meanings"] == KINDS
        reference = dict(file["reference"].attrs)

    runs = document["runs"]
    assert [methods[code] for code in values["runs", "method"]] == [run["method"] for run in runs]
    assert [run["method"] for run in runs] == ["cvode", "paper", "erk"]
    for name, keys in PRINTED.items():
        for row, run in zip(values["runs", name], runs, strict=True):
            for key in keys:
                run = run[key]
            assert equal(row.item(), run), (name, row, run)
    for name, uncertainty in document["reference"]["uncertainty"].items():
        assert equal(reference[f"{name}_uncertainty"], uncertainty), name
    assert len(values["reference", "time"]) == document["reference"]["events"]
    assert (np.diff(values["reference", "time"]) > 0).all()

    with netCDF4.Dataset(path) as file:
        file.set_auto_mask(False)
        for group, name in values:
            assert np.array_equal(file[group][name][:], values[group, name], equal_nan=True), (group, name)
    for engine in ("h5netcdf", "netcdf4"):
        for group, (dimension, variables) in TABLES.items():
            with xr.open_dataset(path, group=group, engine=engine) as data:
                assert list(data.sizes) == [dimension] and set(data.variables) == set(variables)
                for name in variables:
                    assert np.array_equal(data[name], values[group, name], equal_nan=True), (engine, group, name)
    print(f"{len(runs)} runs, {len(values)} variables: the same in h5py, netCDF4 and xarray")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
