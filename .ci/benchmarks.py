#!/usr/bin/env python3
"""Check the benchmark set as others use it.

    python .ci/benchmarks.py PROGRAM FOLDER

The answers and runs of PROGRAM on every problem by the set's checker, which `compare` names; the set as a Data Package and as
an RO-Crate; checksums, size, the checker's tests, and the examples for continuous integration; SciPy's adapter. Needs
.ci/requirements.txt and CMake. Exits with 1 if a check fails.
"""

import csv
import hashlib
import json
import shlex
import subprocess
import sys
from pathlib import Path

import pandas as pd
import tomllib
from frictionless import validate

sys.path.insert(0, str(Path(__file__).parent))
from export import crate_issues

SET = Path(__file__).parent.parent / "benchmarks"
LARGEST = 5_000_000
failures = []


def check(what, holds):
    if not holds:
        failures.append(what)
        print(f"FAILED: {what}", flush=True)


def score(program, problem, file, events=None):
    """The score by the command that `compare` names."""
    others = ["--events", events] if events else []
    compare = subprocess.run([program, "compare", SET / problem, file, *others, "--quick", "--json"], capture_output=True,
                             text=True)
    where = f"{problem}, {Path(file).name}"
    check(f"{where}: {compare.stderr}", compare.returncode == 0)
    if compare.returncode:
        return None
    command = shlex.split(json.loads(compare.stdout)["comparisons"][0]["score_command"])
    checker = subprocess.run([sys.executable, *command[1:], "--json"], capture_output=True, text=True)
    check(f"{where}: {checker.stderr}", checker.returncode == 0)
    return json.loads(checker.stdout) if checker.returncode == 0 else None


def run(program, problem, folder):
    """A run of the program on a problem, as tables with the problem's columns: samples, and events."""
    result, name = folder / f"{problem['name']}.h5", problem["name"]
    subprocess.run([program, "run", SET / "cases" / f"{name}.toml", "--quiet", "--no-witness", "-o", result], check=True)
    tables = {}
    for table in ("trajectory", "events"):
        path = folder / f"{name}.{table}.csv"
        subprocess.run([program, "export", result, "--table", table, "-o", path, "--quiet"], check=True)
        frame = pd.read_csv(path, float_precision="round_trip")
        frame.columns = [column.split(" [")[0] for column in frame.columns]
        tables[table] = frame
    samples = tables["trajectory"]
    others = {"rotor_angle": ["rotor_angle_0", "rotor_position_0", "theta"], "stator_angle": ["stator_angle_0"],
              "deflection": ["bristle_deflection", "deflection"],
              "rotor_twist_0": ["rotor_twist"], "rotor_twist_rate_0": ["rotor_twist_rate"],
              "stator_twist_0": ["stator_twist", "phi1"], "stator_twist_rate_0": ["stator_twist_rate", "phi1_dot"],
              "rotor_speed_1": ["theta_dot"], "rotor_speed_0": ["phi2_dot"], "stator_speed_0": ["phi1_dot"],
              "stator_angle_0": ["phi1"]}
    columns = {"time": samples["time"]}
    for column, _, _, channel in problem["columns"]:
        known = [channel, *others.get(channel, [])]
        if channel == "stator_angle":
            known.append("phi1")
        source = next((one for one in known if one in samples), None)
        check(f"{name}: the run has {channel}: {list(samples.columns)}", source is not None)
        if source:
            columns[column] = samples[source]
    paths = folder / f"{name}.samples.csv", folder / f"{name}.only-events.csv"
    pd.DataFrame(columns).to_csv(paths[0], index=False, float_format="%.17g")
    events = tables["events"]
    events[["time", "kind"]].to_csv(paths[1], index=False, float_format="%.17g")
    return paths


def problems(program, folder):
    settings = tomllib.loads((SET / "set.toml").read_text())
    for problem in settings["problem"]:
        name = problem["name"]
        answer = json.loads((SET / name / "problem.json").read_text())
        count = len((SET / name / "events.csv").read_text().splitlines()) - 1
        if count:
            found = score(program, name, SET / name / "events.csv")
            check(f"{name}: the answer has all digits of a double: {found and found['digits']}",
                  found and found["digits"] > 10)
        samples, events = run(program, problem, folder)
        found = score(program, name, samples)
        check(f"{name}: the run covers the grid", found and found["samples"]["points"] == found["samples"]["of"])
        if count:
            found = score(program, name, samples, events)
            digits = found["digits"] if found else None
            check(f"{name}: the program's own events have {digits} digits",
                  name.startswith("23") or digits and digits >= answer["budget"]["events"]["digits"])


def described():
    report = validate(str(SET / "datapackage.json"))
    check(f"frictionless: {report.flatten(['type', 'message'])[:5]}", report.valid)
    check("frictionless: every table is looked at", len(report.tasks) >= 46)
    issues = [f"{issue.check.identifier}: {issue.message}" for issue in crate_issues(SET)]
    check(f"roc-validator: {issues}", not issues)
    sums = [line.split("  ") for line in (SET / "SHA256SUMS").read_text().splitlines()]
    for digest, path in sums:
        check(f"{path} has its checksum", hashlib.sha256((SET / path).read_bytes()).hexdigest() == digest)
    size = sum(path.stat().st_size for path in SET.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    check(f"the set has {size} bytes", size <= LARGEST)


def users(folder):
    """The checker's own tests, and the examples for continuous integration."""
    tests = subprocess.run([sys.executable, SET / "test_check.py"], capture_output=True, text=True)
    check(f"test_check.py: {tests.stderr[-3000:]}", tests.returncode == 0)
    build = folder / "ctest"
    for command in (["cmake", "-S", SET / "ci", "-B", build], ["ctest", "--test-dir", build, "--output-on-failure"]):
        done = subprocess.run(command, capture_output=True, text=True)
        check(f"{command[0]}: {done.stdout[-2000:]}{done.stderr[-2000:]}", done.returncode == 0)
    # The tests of the checker run the action's steps in bash.
    tests = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", SET / "ci" / "test_friction_example.py"]
    done = subprocess.run(tests, capture_output=True, text=True, cwd=folder)
    check(f"pytest: {done.stdout[-2000:]}{done.stderr[-2000:]}", done.returncode == 0)


def solvers(folder):
    """SciPy's adapter within the budgets."""
    adapter = SET / "solvers" / "scipy_events.py"
    for name in ("01-launched-mass", "04-block", "09-belt-coulomb", "10-belt-leine", "21-brake-from-kick"):
        out = folder / f"{name}.scipy.csv"
        done = subprocess.run([sys.executable, adapter, SET / name, out], capture_output=True, text=True)
        check(f"{adapter.name}, {name}: {done.stderr[-500:]}", done.returncode == 0)
        events = out.with_suffix(".events.csv")
        scored = subprocess.run([sys.executable, SET / "check.py", name, out, "--events", events, "--require", "budget",
                                 "--quiet"], capture_output=True, text=True)
        check(f"{adapter.name}, {name}: {scored.stdout}{scored.stderr}", scored.returncode == 0)


def main(program, folder):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    described()
    problems(program, folder)
    users(folder)
    solvers(folder)
    if failures:
        sys.exit(f"{len(failures)} checks failed")
    print("the benchmark set: all checks passed")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
