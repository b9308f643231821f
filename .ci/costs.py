#!/usr/bin/env python3
"""What building costs: lines of each crate, dependencies, seconds of builds and tests.

    .ci/costs.py [--build SECONDS] [--edit SECONDS] [--tests SECONDS]    prints the table; CI gives the seconds that it has measured
    .ci/costs.py --measure [--write]                    measures builds and tests; --write puts the table into CONTRIBUTING.md

--measure builds in a copy of the repository, from nothing; then again after an edit in each crate; then runs the tests. It takes a
quarter of an hour on two idle processors. Seconds are of the wall clock."""
import argparse
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GUIDE = ROOT / "CONTRIBUTING.md"
BEGIN, END = "<!-- costs: begin -->\n", "<!-- costs: end -->\n"


def crates():
    """(name, folder of the sources) of each crate, from the first in the order of dependence to the root."""
    listed = subprocess.run(["cargo", "metadata", "--format-version", "1", "--no-deps"], cwd=ROOT, capture_output=True, text=True, check=True)
    packages = {p["name"]: p for p in json.loads(listed.stdout)["packages"] if p["name"].startswith("stickslip") and p["name"] != "stickslip-python"}
    order, left = [], dict(packages)
    while left:
        ready = [n for n, p in left.items() if not any(d["name"] in left and d["name"] != n for d in p["dependencies"] if d["kind"] is None)]
        order += sorted(ready)
        for name in ready:
            del left[name]
    return [(name, Path(packages[name]["manifest_path"]).parent / "src") for name in order]


def lines(folder):
    files = sorted(folder.rglob("*.rs"))
    return sum(len(file.read_text().splitlines()) for file in files), len(files)


def dependencies():
    """Crates that the program needs to be built, without its own."""
    tree = subprocess.run(["cargo", "tree", "--edges", "normal,build", "--prefix", "none", "--format", "{p}"], cwd=ROOT, capture_output=True, text=True, check=True)
    names = {" ".join(line.split()[:2]) for line in tree.stdout.splitlines() if line.strip()}
    return len([name for name in names if not name.startswith("stickslip")])


def seconds(command, copy):
    start = time.monotonic()
    subprocess.run(command, cwd=copy, check=True, env=os.environ | {"CARGO_TARGET_DIR": str(copy / "target")}, stdout=subprocess.DEVNULL)
    return time.monotonic() - start


def measured():
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
        for name in listed.stdout.split("\0")[:-1]:
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, copy / name, follow_symlinks=False)
        build = ["cargo", "build", "--release", "--quiet"]
        found = {"build": seconds(build, copy), "edits": {}}
        for name, sources in crates():
            with open(copy / sources.relative_to(ROOT) / "lib.rs", "a") as first:
                first.write("\n// An edit.\n")
            found["edits"][name] = seconds(build, copy)
        found["tests"] = seconds(["cargo", "test", "--release", "--quiet"], copy)
    return found


def table(found):
    edits = found.get("edits")
    rows = [["crate", "lines", "files"] + (["build after an edit, s"] if edits else [])]
    total = [0, 0]
    for name, sources in crates():
        count = lines(sources)
        total = [a + b for a, b in zip(total, count)]
        rows.append([f"`{name}`", f"{count[0]:,}", str(count[1])] + ([f"{edits[name]:.0f}"] if edits else []))
    rows.append(["together", f"{total[0]:,}", str(total[1])] + ([""] if edits else []))
    text = "\n".join("| " + " | ".join(row) + " |" for row in rows[:1])
    text += "\n|" + "---|" * len(rows[0]) + "\n" + "\n".join("| " + " | ".join(row) + " |" for row in rows[1:]) + "\n\n"
    tests, files = lines(ROOT / "tests")
    facts = [f"Tests: {tests:,} lines in {files} files. Dependencies of the program: {dependencies()} crates."]
    if found.get("build"):
        facts.append(f"`cargo build --release` from nothing: {found['build']:.0f} s.")
    if found.get("edit"):
        facts.append(f"The same after an edit of the command line: {found['edit']:.0f} s.")
    if found.get("tests"):
        facts.append(f"`cargo test --release` after it: {found['tests']:.0f} s.")
    return text + "\n".join(facts) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=float)
    parser.add_argument("--edit", type=float)
    parser.add_argument("--tests", type=float)
    parser.add_argument("--measure", action="store_true")
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    text = table(measured() if options.measure else {"build": options.build, "edit": options.edit, "tests": options.tests})
    print(text, end="")
    if options.write:
        guide = GUIDE.read_text()
        pattern = re.escape(BEGIN) + ".*?" + re.escape(END)
        if not re.search(pattern, guide, re.S):
            raise SystemExit(f"{GUIDE.name} has no place for the table: {BEGIN.strip()} ... {END.strip()}")
        GUIDE.write_text(re.sub(pattern, lambda _: BEGIN + text + END, guide, flags=re.S))


if __name__ == "__main__":
    main()
