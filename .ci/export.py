#!/usr/bin/env python3
"""Check that what `stickslip export` writes reads the same in the programs of others.

    python .ci/export.py PROGRAM CERTIFIED.h5 FOLDER

Tables as CSV, NPZ and MAT, against the result file itself; the benchmark package by the validators of
Frictionless and RO-Crate, and by its own script. Needs .ci/requirements.txt. Exits with 1 if a check fails.
"""

import json
import subprocess
import sys
from importlib.resources import files
from pathlib import Path
from unittest import mock

import h5py
import numpy as np
import pandas as pd
import requests
import scipy.io
from frictionless import validate
from rocrate_validator import models, services

GROUPS = ("trajectory", "events", "segments", "stick_slip")
failures = []


def check(what, holds):
    if not holds:
        failures.append(what)
        print(f"FAILED: {what}")


def same(a, b):
    a, b = np.asarray(a, dtype=float).ravel(), np.asarray(b, dtype=float).ravel()
    return a.shape == b.shape and bool(np.all((a == b) | (np.isnan(a) & np.isnan(b))))


def words(data, meanings):
    codes = np.atleast_1d(data.attrs["flag_values"]).tolist()
    names = dict(zip(codes, meanings.split()))
    return [names[code] for code in data[...].tolist()]


def tables(program, result, folder):
    with h5py.File(result) as file:
        for group in GROUPS:
            paths = {form: folder / f"{group}.{form}" for form in ("csv", "npz", "mat")}
            for path in paths.values():
                subprocess.run([program, "export", result, "-o", path, "--table", group, "--quiet"], check=True)
            table = pd.read_csv(paths["csv"], float_precision="round_trip")
            table.columns = [name.split(" [")[0] for name in table.columns]
            arrays, vectors = np.load(paths["npz"]), scipy.io.loadmat(paths["mat"])
            texts = (str(arrays["metadata"]), str(vectors["metadata"][0]))
            for text in texts:
                described = {column["name"]: column for column in json.loads(text)["columns"]}
                check(f"{group}: the metadata describe every column", list(described) == list(table.columns))
            for name in table.columns:
                data = file[group][name] if name in file[group] else file["certificate"][name]
                where = f"{group}/{name}"
                check(f"{where} has its unit", described[name]["units"] == data.attrs["units"])
                check(f"npz: {where} has the values of the file", same(arrays[name], data[...]))
                check(f"mat: {where} has the values of the file", same(vectors[name], data[...]))
                check(f"mat: {where} is a column", vectors[name].shape == (len(data), 1))
                meanings = data.attrs.get("flag_meanings")
                if meanings is None:
                    check(f"csv: {where} has the values of the file", same(table[name], data[...]))
                else:
                    check(f"csv: {where} has the words of the file", table[name].tolist() == words(data, meanings))


def crate_issues(bench):
    """What an RO-Crate 1.1 must have and the folder has not. The context is that which the package rocrate brings, so that
    nothing is fetched."""
    context = (files("rocrate") / "data/ro-crate.jsonld").read_bytes()

    def answer(_, request, **options):
        assert request.url == "https://w3id.org/ro/crate/1.1/context", request.url
        response = requests.Response()
        response.status_code, response.url, response.request = 200, request.url, request
        response._content, response.headers["Content-Type"] = context, "application/ld+json"
        return response

    with mock.patch.object(requests.Session, "send", answer):
        settings = services.ValidationSettings(rocrate_uri=str(bench), profile_identifier="ro-crate-1.1", no_cache=True,
                                               requirement_severity=models.Severity.REQUIRED)
        return services.validate(settings).get_issues()


def package(program, result, folder):
    bench = folder / "benchmark"
    subprocess.run([program, "export", result, "--benchmark", "-o", bench, "--quiet", "--license", "CC-BY-4.0"], check=True)
    report = validate(str(bench / "datapackage.json"))
    check(f"frictionless: {report.flatten(['type', 'message'])[:5]}", report.valid)
    checked = {task.name for task in report.tasks}
    check("frictionless: every table is looked at", {"events", "sensitivities", "samples"} <= checked)
    issues = [f"{issue.check.identifier}: {issue.message}" for issue in crate_issues(bench)]
    check(f"roc-validator: {issues}", not issues)
    unlicensed = folder / "unlicensed"
    subprocess.run([program, "export", result, "--benchmark", "-o", unlicensed, "--quiet"], check=True)
    report = validate(str(unlicensed / "datapackage.json"))
    issues = [f"{issue.check.identifier}: {issue.message}" for issue in crate_issues(unlicensed)]
    check(f"without a licence: {report.flatten(['type', 'message'])[:5]} {issues}", report.valid and not issues)
    # Without this program: SciPy's solver, held against the events.
    script = subprocess.run([sys.executable, bench / "example.py"], capture_output=True, text=True)
    check(f"example.py: {script.stdout}{script.stderr}", script.returncode == 0)
    print(script.stdout.strip())
    # Errors of DOP853 at 1e-12 are amplified by e^14 from the kick to the first stick.
    error = float(script.stdout.split()[-2]) if script.returncode == 0 else np.inf
    check(f"example.py: the largest error of a time is {error} s", error < 1e-7)


def main(program, result, folder):
    folder = Path(folder) / "export"
    folder.mkdir(parents=True, exist_ok=True)
    tables(program, result, folder)
    package(program, result, folder)
    if failures:
        sys.exit(f"{len(failures)} checks failed")
    print("exports read the same everywhere")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
