#!/usr/bin/env python3
"""Check that a result file opens, and reads the same, in the programs of others.

    python .ci/interop.py paper.h5 [--program] [--certified]

With --program the file is one that the program itself wrote, and /meta names what made it. With
--certified it has what `stickslip certify` adds.
Needs .ci/requirements.txt; h5dump and ncdump are used where they are installed. The expected names,
units and codes are written out here a second time, independently of the program. Exits with 1 if a
check fails.
"""

import re
import shutil
import subprocess
import sys

import h5py
import netCDF4
import numpy as np
import xarray as xr

STATE = {
    "z": "m", "z_dot": "m s-1", "theta": "rad", "theta_dot": "rad s-1", "phi1": "rad", "phi1_dot": "rad s-1",
    "phi2": "rad", "phi2_dot": "rad s-1", "rotor_twist": "rad", "rotor_twist_rate": "rad s-1",
    "relative_velocity": "rad s-1", "slip_displacement": "rad",
}
CHANNELS = {
    "applied_force": "N", "normal_force": "N", "friction_torque": "N m", "transmitted_torque": "N m",
    "energy_kinetic": "J", "energy_elastic": "J", "work_applied": "J", "work_perturbation": "J",
    "dissipated_friction": "J", "dissipated_damping": "J", "energy_residual": "J",
    "contact_power": "W",
}
COUNTS = (
    "steps", "rhs_evaluations", "jacobian_evaluations", "linear_solver_setups", "error_test_failures",
    "nonlinear_iterations", "nonlinear_convergence_failures", "root_evaluations",
)
MODES = "separated stick slip-forward slip-backward"
KINDS = "stick slip reversal separation contact kick corner destabilised restabilised"
SOLVERS = "other cvode-bdf cvode-adams erk esdirk closed-form series paper rk4"
FLAGS = {
    ("trajectory", "mode"): (0, MODES),
    ("events", "kind"): (0, KINDS),
    ("events", "mode_after"): (0, MODES),
    ("events", "sense"): (-1, "backward none forward"),
    ("segments", "mode"): (0, MODES),
    ("segments", "solver"): (-1, SOLVERS),
}


def doubles(units):
    return {name: ("float64", unit) for name, unit in units.items()}


# group: (dimension, {variable: (type, units)})
TABLES = {
    "trajectory": ("time", {
        "time": ("float64", "s"), "mode": ("int8", "1"), "segment": ("int32", "1"),
        **doubles(STATE), **doubles(CHANNELS),
    }),
    "events": ("event", {
        "event": ("int32", "1"), "time": ("float64", "s"), "kind": ("int8", "1"), "mode_after": ("int8", "1"),
        "sense": ("int8", "1"), "segment": ("int32", "1"), "internal_force": ("float64", "N"),
        **doubles({f"{name}_{side}": unit for side in ("before", "after") for name, unit in STATE.items()}),
    }),
    "segments": ("segment", {
        "segment": ("int32", "1"), "start": ("float64", "s"), "end": ("float64", "s"), "mode": ("int8", "1"),
        "solver": ("int8", "1"), "last_order": ("int32", "1"), "last_step": ("float64", "s"),
        **{name: ("int64", "1") for name in COUNTS},
    }),
    "stick_slip": ("cycle", {
        "cycle": ("int32", "1"),
        **doubles({"stick_duration": "s", "slip_duration": "s", "period": "s"}),
    }),
}
ROOT = ("Conventions", "title", "source", "history", "references", "format", "format_version", "status")
META = (
    "program_version", "program_commit", "sundials_version", "hdf5_version", "rustc_version", "platform",
    "command_line", "method", "rtol", "started", "wall_time_s",
    *(f"{phase}_{name}" for phase in ("sliding", "resolved") for name in ("rtol", "atol_twist", "atol_rate", "atol_speed")),
)
TEXTS = ("case", "resolved")
STICK_SLIP = (
    "onset_time", "final_stick_time", "stick_count", "slip_count", "first_period", "last_period", "natural_period",
    "growth_exponent",
)

# What `stickslip certify` adds. group: {variable: (type, units, dimensions)}
RUNG = ("rung",)
STRETCH = ("stretch",)


def per_second(units):
    return units[:-3] + "s-2" if units.endswith("s-1") else units + " s-1"


CERTIFICATE = {
    "events": {"time_uncertainty": ("float64", "s", ("event",))},
    "certificate": {
        "event": ("int32", "1", ("event",)), "rung": ("int32", "1", RUNG), "stretch": ("int32", "1", STRETCH),
        "verdict": ("int8", "1", ("event",)), "rounding": ("float64", "s", ("event",)),
        "growth": ("float64", "1", ("event",)), "rung_method": ("int8", "1", RUNG),
        "rung_rtol": ("float64", "1", RUNG), "rung_agreeing": ("int64", "1", RUNG),
        "rung_distance": ("float64", "s", RUNG), "stretch_start": ("float64", "s", STRETCH),
        "stretch_end": ("float64", "s", STRETCH), "stretch_mode": ("int8", "1", STRETCH),
        "stretch_time_uncertainty": ("float64", "s", STRETCH),
        **{f"band_{name}": ("float64", unit, STRETCH) for name, unit in {**STATE, **CHANNELS}.items()},
        **{f"rate_{name}": ("float64", per_second(unit), STRETCH) for name, unit in {**STATE, **CHANNELS}.items()},
    },
    "sensitivity": {
        "event": ("int32", "1", ("event",)), "parameter": ("int32", "1", ("parameter",)),
        "time_sensitivity": ("float64", "s", ("event", "parameter")),
    },
}
CERTIFICATE_FLAGS = {
    "verdict": "converged noise-determined sequence-differs", "stretch_mode": MODES,
    "rung_method": "arkode erk cvode-adams cvode-bdf series",
}
CERTIFICATE_TEXTS = ("verdict_of_all", "remedy")
CERTIFICATE_NUMBERS = (
    "digits", "digits_of_double", "growth_exponent", "growth_to_onset", "kick_above_noise", "kick_above_methods",
)

passed = failed = 0


def check(what, holds):
    """Count a check, and name it if it fails."""
    global passed, failed
    if holds:
        passed += 1
    else:
        failed += 1
        print(f"FAILED: {what}")


def same(a, b):
    """Equal in type and value, NaN equal to NaN."""
    a, b = np.ma.getdata(a), np.ma.getdata(b)
    return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")


def text(value):
    """A text, whatever the reader makes of a fixed-length string."""
    value = np.asarray(value).item()
    return value.decode() if isinstance(value, bytes) else value


def check_h5py(path, by_program):
    """Names, types, units, dimension scales and codes; returns every value for the other readers."""
    values = {}
    with h5py.File(path) as file:
        for name in ROOT:
            check(f"h5py: root attribute {name}", name in file.attrs)
        check("h5py: Conventions", file.attrs.get("Conventions") == "CF-1.11")
        check("h5py: format", file.attrs.get("format") == "stickslip-result")
        check("h5py: status", file.attrs.get("status") in ("complete", "interrupted", "failed"))
        check("h5py: a witness has the times of its events", ("witness" in file) == ("witness_time" in file["events"]))
        if "witness" in file:
            data = file["events/witness_time"]
            check("h5py: /events/witness_time", data.dtype == "float64" and data.attrs.get("units") == "s")
            check("h5py: /events/witness_time is over event", [scale.name for scale in data.dims[0].values()] == ["/events/event"])
            apart = np.abs(data[...] - file["events/time"][...])
            check("h5py: /events/witness_time is near where it agrees", np.nanmax(apart) <= 1e-9)
        for group, (dimension, variables) in TABLES.items():
            for name, (kind, units) in variables.items():
                where = f"h5py: /{group}/{name}"
                if name not in file.get(group, {}):
                    check(f"{where} exists", False)
                    continue
                data = file[group][name]
                values[group, name] = data[...]
                check(f"{where} is {kind}", data.dtype == kind)
                check(f"{where} has one dimension", data.ndim == 1)
                check(f"{where} has units {units}", data.attrs.get("units") == units)
                check(f"{where} has a long_name", bool(data.attrs.get("long_name")))
                check(f"{where} has no fill value", "_FillValue" not in data.attrs)
                check(f"{where} is compressed and has checksums", data.compression == "gzip" and data.fletcher32)
                if name == dimension:
                    check(f"{where} is a dimension scale", data.is_scale)
                else:
                    scales = [scale.name for scale in data.dims[0].values()]
                    check(f"{where} is over {dimension}", scales == [f"/{group}/{dimension}"])
                if (group, name) in FLAGS:
                    first, meanings = FLAGS[group, name]
                    codes = data.attrs.get("flag_values", np.array([]))
                    expected = np.arange(first, first + len(meanings.split()), dtype="int8")
                    check(f"{where} has flag_values", same(codes, expected))
                    check(f"{where} has flag_meanings", data.attrs.get("flag_meanings") == meanings)
                    check(f"{where} has known codes only", bool(np.isin(values[group, name], codes).all()))
        for name in TEXTS:
            values["input", name] = text(file["input"][name][()])
            check(f"h5py: /input/{name} is a text", bool(values["input", name]))
        check("h5py: /meta has attributes", len(file["meta"].attrs) > 0)
        for name in META if by_program else ():
            check(f"h5py: /meta attribute {name}", name in file["meta"].attrs)
        if file.attrs.get("status") == "complete":
            attributes = file["stick_slip"].attrs
            for name in STICK_SLIP:
                check(f"h5py: /stick_slip attribute {name}", name in attributes)
            check("h5py: sticks are cycles + 1", attributes["stick_count"] in (0, len(file["stick_slip/cycle"]) + 1))
        values["attributes"] = {
            name: dict(file[name].attrs) for name in ("/", "input", "meta", *TABLES) if name in file
        }
    return values


def check_values(values):
    """What holds of every run."""
    time = values["trajectory", "time"]
    check("time increases strictly", bool((np.diff(time) > 0).all()))
    check("events are in order of time", bool((np.diff(values["events", "time"]) >= 0).all()))
    check("segments are in order of time", bool((values["segments", "end"] >= values["segments", "start"]).all()))
    for group, dimension in (("events", "event"), ("segments", "segment"), ("stick_slip", "cycle")):
        index = values[group, dimension]
        check(f"/{group}/{dimension} counts from 0", same(index, np.arange(len(index), dtype="int32")))
    sense = np.array([0, 0, 1, -1], dtype="int8")[values["events", "mode_after"]]
    check("sense follows from mode_after", same(values["events", "sense"], sense))


def check_netcdf4(path, values):
    with netCDF4.Dataset(path) as file:
        file.set_auto_mask(False)
        check("netCDF4: root attributes", all(same_attribute(file.getncattr(name), values["attributes"]["/"][name])
                                              for name in file.ncattrs()))
        for group, (dimension, variables) in TABLES.items():
            check(f"netCDF4: /{group} has the dimension {dimension} only", list(file[group].dimensions) == [dimension])
            check(f"netCDF4: {dimension} can grow", file[group].dimensions[dimension].isunlimited())
            for name, (_, units) in variables.items():
                where = f"netCDF4: /{group}/{name}"
                variable = file[group][name]
                check(f"{where} is over {dimension}", variable.dimensions == (dimension,))
                check(f"{where} has units {units}", variable.units == units)
                check(f"{where} has the values of h5py", same(variable[:], values[group, name]))
        for name in TEXTS:
            check(f"netCDF4: /input/{name}", text(file["input"][name][...]) == values["input", name])


def check_xarray(path, engine, values):
    for group, (dimension, variables) in TABLES.items():
        with xr.open_dataset(path, group=group, engine=engine) as data:
            check(f"xarray {engine}: /{group} has the dimension {dimension} only", list(data.sizes) == [dimension])
            check(f"xarray {engine}: {dimension} is an index", dimension in data.indexes)
            check(f"xarray {engine}: /{group} has its variables", set(variables) <= set(data.variables))
            for name, (_, units) in variables.items():
                where = f"xarray {engine}: /{group}/{name}"
                check(f"{where} has units {units}", data[name].attrs.get("units") == units)
                check(f"{where} has a long_name", bool(data[name].attrs.get("long_name")))
                check(f"{where} has the values of h5py", same(data[name].values, values[group, name]))
    with xr.open_dataset(path, group="input", engine=engine) as data:
        for name in TEXTS:
            check(f"xarray {engine}: /input/{name}", text(data[name].values) == values["input", name])
    with xr.open_dataset(path, group="meta", engine=engine) as data:
        check(f"xarray {engine}: attributes of /meta", set(data.attrs) == set(values["attributes"]["meta"]))
    with xr.open_datatree(path, engine=engine) as tree:
        check(f"xarray {engine}: the file as a tree", {"/", *(f"/{group}" for group in TABLES)} <= set(tree.groups))


def check_certificate(path):
    """What a certified file has more: the same in every reader, and what its numbers must obey."""
    values = {}
    with h5py.File(path) as file:
        for group, variables in CERTIFICATE.items():
            for name, (kind, units, dimensions) in variables.items():
                where = f"h5py: /{group}/{name}"
                if name not in file.get(group, {}):
                    check(f"{where} exists", False)
                    continue
                data = file[group][name]
                values[group, name] = data[...]
                check(f"{where} is {kind}", data.dtype == kind)
                check(f"{where} has units {units}", data.attrs.get("units") == units)
                check(f"{where} has a long_name", bool(data.attrs.get("long_name")))
                if dimensions == (name,):
                    check(f"{where} is a dimension scale", data.is_scale)
                else:
                    scales = tuple(scale.name for axis in data.dims for scale in axis.values())
                    check(f"{where} is over {dimensions}", scales == tuple(f"/{group}/{d}" for d in dimensions))
        for name, meanings in CERTIFICATE_FLAGS.items():
            attributes = file["certificate"][name].attrs
            codes = np.arange(len(meanings.split()), dtype="int8")
            check(f"h5py: /certificate/{name} has flag_values", same(attributes.get("flag_values"), codes))
            check(f"h5py: /certificate/{name} has flag_meanings", attributes.get("flag_meanings") == meanings)
        attributes = file["certificate"].attrs
        for name in CERTIFICATE_TEXTS:
            check(f"h5py: /certificate attribute {name} is a text", isinstance(attributes.get(name), str))
        for name in CERTIFICATE_NUMBERS:
            check(f"h5py: /certificate attribute {name} is a number", np.asarray(attributes.get(name)).dtype.kind == "f")
        for name in ("parameters", "parameter_units"):
            count = len(file["sensitivity"].attrs[name].split(", "))
            check(f"h5py: /sensitivity has as many {name}", count == file["sensitivity/parameter"].size)
        oracle = text(file["certificate/oracle"][()]) if "oracle" in file["certificate"] else None
        times = file["events/time"][...]
        end = file["trajectory/time"][-1]
    uncertainty, verdict = values["events", "time_uncertainty"], values["certificate", "verdict"]
    check("certificate: an uncertainty where an event is converged", bool(np.isfinite(uncertainty[verdict == 0]).all()))
    start, stop = (values["certificate", f"stretch_{name}"] for name in ("start", "end"))
    check("certificate: stretches from event to event", same(start, np.insert(times, 0, 0.0)))
    check("certificate: the last stretch to the end", same(stop, np.append(times, end)))
    around = np.maximum(np.insert(uncertainty, 0, 0.0), np.append(uncertainty, 0.0))
    known = np.isfinite(values["certificate", "stretch_time_uncertainty"])
    check("certificate: stretches between converged events", same(
        values["certificate", "stretch_time_uncertainty"][known], around[known]))
    for name in {**STATE, **CHANNELS}:
        band = values["certificate", f"band_{name}"]
        check(f"certificate: band_{name} where it is known", not (np.isfinite(band) & ~known).any())
        check(f"certificate: band_{name} is not negative", not (band < 0).any())
    if oracle is not None:
        rows = [line.split(",") for line in oracle.splitlines()]
        true = np.array([float(row[0]) for row in rows[1:]])
        check("certificate: the oracle's events are as many", rows[0][:2] == ["time", "kind"] and len(true) == len(times))
        if len(true) == len(times):
            # A unit in the last place of a time, for the reading of decimals.
            covered = np.abs(true - times) <= uncertainty + np.spacing(times)
            check("certificate: uncertainties cover the oracle's times", bool(covered[verdict == 0].all()))
    with netCDF4.Dataset(path) as file:
        file.set_auto_mask(False)
        for (group, name), value in values.items():
            kind, units, dimensions = CERTIFICATE[group][name]
            variable = file[group][name]
            check(f"netCDF4: /{group}/{name} is over {dimensions}", variable.dimensions == dimensions)
            check(f"netCDF4: /{group}/{name} has units {units}", variable.units == units)
            check(f"netCDF4: /{group}/{name} has the values of h5py", same(variable[:], value))
    for engine in ("h5netcdf", "netcdf4"):
        for group, variables in CERTIFICATE.items():
            with xr.open_dataset(path, group=group, engine=engine) as data:
                for name, (_, units, dimensions) in variables.items():
                    where = f"xarray {engine}: /{group}/{name}"
                    check(f"{where} is over {dimensions}", data[name].dims == dimensions)
                    check(f"{where} has units {units}", data[name].attrs.get("units") == units)
                    check(f"{where} has the values of h5py", same(data[name].values, values[group, name]))
                if group == "certificate" and oracle is not None:
                    check(f"xarray {engine}: /certificate/oracle", text(data["oracle"].values) == oracle)
        with xr.open_datatree(path, engine=engine) as tree:
            check(f"xarray {engine}: the certified file as a tree", {"/certificate", "/sensitivity"} <= set(tree.groups))


def same_attribute(a, b):
    return np.array_equal(a, b) or (np.asarray(a).dtype.kind == "f" and np.isnan(a) and np.isnan(b))


def run(command):
    """A program's output; None, with a word about it, where it is not installed."""
    if shutil.which(command[0]) is None:
        print(f"{command[0]}: not installed, skipped")
        return None
    result = subprocess.run(command, capture_output=True, text=True, errors="replace")
    check(f"{command[0]} reads the file", result.returncode == 0 and not result.stderr)
    return result.stdout


def check_h5dump(path, values):
    if (header := run(["h5dump", "-H", "-A", "0", path])) is not None:
        for kind in ("H5T_COMPOUND", "H5T_VLEN", "H5T_VARIABLE", "H5T_REFERENCE"):
            check(f"h5dump: no variable is {kind}", kind not in header)
        count = sum(len(variables) for _, variables in TABLES.values()) + len(TEXTS)
        check("h5dump: all variables", header.count("DATASET \"") >= count)
    output = run(["h5dump", "-y", "-w", "1", "-m", "%.17g", "-d", "/trajectory/time", path])
    if output is not None:
        numbers = output.split("DATA {")[1].split("}")[0].replace(",", " ").split()
        check("h5dump: the times of h5py", same(np.array(numbers, dtype=float), values["trajectory", "time"]))


def check_ncdump(path, values):
    if (header := run(["ncdump", "-h", path])) is not None:
        for dimension, variables in TABLES.values():
            check(f"ncdump: dimension {dimension}", f"{dimension} = UNLIMITED" in header)
            for name in variables:
                check(f"ncdump: {name}({dimension})", f" {name}({dimension}) ;" in header)
        check("ncdump: no dimension without a name", "phony_dim" not in header)
    output = run(["ncdump", "-p", "9,17", "-v", "trajectory/time", path])
    if output is not None:
        times = re.search(r"data:\s+time = ([^;]*);", output)
        numbers = times.group(1).replace(",", " ").split() if times else []
        check("ncdump: the times of h5py", same(np.array(numbers, dtype=float), values["trajectory", "time"]))


def main():
    arguments = [argument for argument in sys.argv[1:] if argument not in ("--program", "--certified")]
    if len(arguments) != 1:
        sys.exit(__doc__)
    path = arguments[0]
    values = check_h5py(path, "--program" in sys.argv)
    if all((group, name) in values for group, (_, variables) in TABLES.items() for name in variables):
        check_values(values)
        check_netcdf4(path, values)
        for engine in ("h5netcdf", "netcdf4"):
            check_xarray(path, engine, values)
        check_h5dump(path, values)
        check_ncdump(path, values)
        if "--certified" in sys.argv:
            check_certificate(path)
    print(f"{passed} passed, {failed} failed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
