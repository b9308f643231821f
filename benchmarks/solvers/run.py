#!/usr/bin/env python3
"""Runs every adapter on every problem that it can state, and writes results.json, league.md and the figures.

    python run.py
    python run.py --only scipy_events --problems 01 04

Each run is a process of its own with a time limit. Results are kept, and a run is made again only if its adapter, the
shared files or the problem have changed. The scores are those of ../check.py.
"""
import argparse
import ast
import concurrent.futures
import csv
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
SET = HERE.parent
REFERENCE = ("scipy_events", "default")     # whose wall time is 1
FIGURES = ("08", "09")                      # problems of the figures, with the settings that are for these alone
SHARED = ("problem.py", "hybrid.py")


def adapters():
    """Name -> class and settings, from the text at the head of each adapter."""
    found = {}
    for path in sorted(HERE.glob("*.py")):
        text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        said = dict(re.findall(r"^(class|table|figure): (.*)$", text, re.M))
        if "class" in said:
            settings = {key: said.get(key, "").split() for key in ("table", "figure")}
            found[path.stem] = {"class": said["class"], **settings}
    return found


def digest(*paths):
    return hashlib.sha256(b"".join(p.read_bytes() for p in paths)).hexdigest()[:16]


def run(name, setting, folder, place, limit):
    """One run of an adapter: the status, and what it said."""
    place.mkdir(parents=True, exist_ok=True)
    output = place / (folder.name + ".csv")
    command = [sys.executable, str(HERE / (name + ".py")), str(folder), str(output), "--setting", setting]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, cwd=place)
    except subprocess.TimeoutExpired:
        return {"status": "out of time", "reason": f"not done after {limit:g} s"}
    if done.returncode == 0:
        seconds = re.search(r"^# seconds: first=(\S+) again=(\S+)", output.read_text(encoding="utf-8"), re.M)
        return {"status": "run", "first": float(seconds[1]), "again": float(seconds[2])}
    if done.returncode == 3:
        return {"status": "unsupported", "reason": done.stdout.strip().splitlines()[-1].partition(": ")[2]}
    missing = re.search(r"ModuleNotFoundError: No module named '([^']+)'", done.stderr)
    if missing:
        return {"status": "skipped", "reason": f"the package {missing[1]} is not installed"}
    errors = [line for line in done.stderr.strip().splitlines() if re.match(r"\w*(\.\w+)*(Error|Exception)\b", line)]
    return {"status": "failed", "reason": (errors or [f"exit status {done.returncode}"])[-1][:160]}


def score(folder, output):
    """The outcome of check.py; without events of its own, the best of nine thresholds."""
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(SET))
    import check
    stated, document = output.with_suffix(".events.csv"), output.with_suffix(".check.json")
    command = [str(folder), str(output)] + (["--events", str(stated)] if stated.exists() else [])
    found = []
    for threshold in [None] if stated.exists() else thresholds(folder):
        option = [] if threshold is None else ["--threshold", repr(threshold)]
        if check.main(command + option + ["--quiet", "--json", str(document)]) == 2:
            raise RuntimeError(f"check.py refuses {output}")
        found.append({"threshold": threshold, **outcome(json.loads(document.read_text(encoding="utf-8")))})
    document.unlink()
    return min(found, key=lambda f: (not f["agrees"], f["missing"] + f["spurious"], -(f["digits"] or 0.0)))


def thresholds(folder):
    """A tenth to a billionth of the largest relative velocity, or none where the problem has its own."""
    problem = json.loads((folder / "problem.json").read_text(encoding="utf-8"))
    if problem["threshold"] is not None:
        return [None]
    factors = dict(problem["relative_velocity"])
    constant = factors.pop("constant", 0.0)
    with (folder / "samples.csv").open(encoding="utf-8") as rows:
        largest = max(abs(constant + sum(f * float(r[n]) for n, f in factors.items())) for r in csv.DictReader(rows))
    return [float(f"{(largest or 1.0) * 10.0 ** -k:.3g}") for k in range(1, 10)]


def outcome(result):
    sequence, position, candidate = result["sequence"], result["scores"]["position"], result["candidate"]
    return {**{k: candidate[k] for k in ("solver", "version", "settings")},
            **{k: sequence[k] for k in ("agrees", "reference_events", "missing", "spurious")},
            "events_stated": candidate["events_file"] is not None,
            "digits": result["digits"] if sequence["reference_events"] else None,
            "largest_event_error": result["largest_event_error"] if sequence["agrees"] else None,
            "position_rms": position and position["rms"], "position_relative": position and position["relative"]}


def tasks(options):
    """The runs, that of the reference first for each problem."""
    known = adapters()
    unknown = set(options.only) - set(known)
    if unknown:
        sys.exit(f"no such adapter: {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    folders = [f for f in sorted(SET.glob("[0-9][0-9]-*")) if (f / "problem.json").exists()]
    wanted = options.problems
    folders = [f for f in folders if not wanted or f.name[:2] in wanted or f.name in wanted]
    names = sorted(options.only or known, key=lambda n: (n != REFERENCE[0], n))
    for folder in folders:
        for name in names:
            for setting in known[name]["table"] + (known[name]["figure"] if folder.name[:2] in FIGURES else []):
                yield known[name]["class"], name, setting, folder


def make_runs(options):
    results, waiting = [], []
    # scores are made beside the next run
    with concurrent.futures.ProcessPoolExecutor(max_workers=1) as pool:
        for kind, name, setting, folder in tasks(options):
            place = options.results / name / setting
            kept, output = place / (folder.name + ".json"), place / (folder.name + ".csv")
            sources = [HERE / s for s in (name + ".py", *SHARED)] + [folder / s for s in ("problem.json", "events.csv")]
            entry = {"class": kind, "adapter": name, "setting": setting, "problem": folder.name}
            entry["key"] = digest(*sources)
            old = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() and not options.again else {}
            if old.get("key") == entry["key"] and old["status"] != "skipped":
                results.append(old)
                continue
            start = time.perf_counter()
            entry.update(run(name, setting, folder, place, options.limit))
            print(f"{folder.name:22} {name} {setting}: {entry.get('reason') or entry['status']}, "
                  f"{time.perf_counter() - start:.1f} s", flush=True)
            future = pool.submit(score, folder, output) if entry["status"] == "run" else None
            waiting.append((entry, kept, output, future))
            while waiting and (waiting[0][3] is None or waiting[0][3].done()):
                results.append(finished(options, *waiting.pop(0)))
        results += [finished(options, *item) for item in waiting]
    return results


def finished(options, entry, kept, output, future):
    """The entry of a run with its score, which is kept."""
    if future:
        entry.update(future.result(), status="scored")
    for left in (output, output.with_suffix(".events.csv")) if not options.keep else ():
        left.unlink(missing_ok=True)
    kept.write_text(json.dumps(entry, indent=1) + "\n", encoding="utf-8")
    return entry


def add_ratios(results):
    """The wall times in parts of that of the reference on the same problem, without compilation."""
    times = {r["problem"]: r["again"] for r in results if (r["adapter"], r["setting"]) == REFERENCE and "again" in r}
    for r in results:
        if "again" in r and r["problem"] in times:
            r["time_ratio"] = {k: float(f"{r[k] / times[r['problem']]:.3g}") for k in ("first", "again")}


def main():
    parser = argparse.ArgumentParser(description="Runs the adapters and makes the league table.")
    parser.add_argument("--only", nargs="+", default=[], metavar="ADAPTER", help="these adapters alone")
    parser.add_argument("--problems", nargs="+", default=[], metavar="NN", help="these problems alone")
    parser.add_argument("--limit", type=float, default=100.0, metavar="S", help="time limit of a run [default: 100]")
    parser.add_argument("--results", type=pathlib.Path, default=HERE / "results", help="where runs are kept")
    parser.add_argument("--again", action="store_true", help="make all runs again")
    parser.add_argument("--keep", action="store_true", help="keep the submissions too")
    options = parser.parse_args()
    options.results = options.results.resolve()
    results = make_runs(options)
    add_ratios(results)
    import league
    whole = not (options.only or options.problems)
    target = HERE if whole else options.results     # a part of the runs does not replace the table of all
    league.write(results, target, adapters(), FIGURES)
    print(f"{len(results)} results; see {target / 'league.md'}")


if __name__ == "__main__":
    main()
