"""The league table and the figures, from the results of run.py.
"""
import json
import statistics

NO_EVENTS = ("02", "03")                    # not ranked: a threshold that is large enough makes everything rest
COLOURS = {"events": "#1b5e9e", "complementarity": "#b3541e", "time stepping, soft contact": "#3b7d3b",
           "regularised": "#7a4a8c"}
MARKS = "osD^vP*X<>hp"


def standing(runs):
    """What a solver is ranked by, and what is shown beside it."""
    runs = [r for r in runs if r["problem"][:2] not in NO_EVENTS]
    tried = [r for r in runs if r["status"] in ("scored", "out of time", "failed")]
    right = [r for r in runs if r.get("agrees")]
    digits = [r["digits"] for r in right]
    ratio = {k: [r["time_ratio"][k] for r in runs if "time_ratio" in r] for k in ("first", "again")}
    middle = {k: statistics.median(v) if v else None for k, v in ratio.items()}
    return {"tried": len(tried), "right": len(right), "digits": statistics.median(digits) if digits else None, **middle}


def number(x, form=".1f"):
    return "-" if x is None else format(x, form)


def cell(run, notes):
    """The digits of the events; where the sequence is wrong, how many are missing and spurious; or why neither."""
    if run is None:
        return ""
    if run["status"] != "scored":
        reason = run["reason"] if run["status"] in ("unsupported", "skipped") else f"{run['status']}: {run['reason']}"
        if reason not in notes:
            notes.append(reason)
        return f"[{notes.index(reason) + 1}]"
    if not run["agrees"]:
        return f"−{run['missing']} +{run['spurious']}"
    if run["digits"] is None:
        return f"({run['position_rms']:.0e})" if run["position_rms"] is not None else "right"
    return number(run["digits"])


def write(results, target, adapters, figures):
    for r in results:
        r.pop("key", None)
    order = sorted(results, key=lambda r: (r["class"], r["adapter"], r["setting"], r["problem"]))
    document = json.dumps({"results": order}, indent=1, ensure_ascii=False) + "\n"
    (target / "results.json").write_text(document, encoding="utf-8")
    (target / "league.md").write_text("\n".join(text(results, adapters)) + "\n", encoding="utf-8")
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        print("no figures: the package matplotlib is not installed")
        return
    for problem in figures:
        draw(results, problem, target / f"figure-{problem}.svg")


def text(results, adapters):
    problems = sorted({r["problem"] for r in results})
    lines = ["# League table", "", *INTRODUCTION.strip().splitlines()]
    for kind in COLOURS:
        rows = {}
        for r in results:
            if r["class"] == kind and r["setting"] in adapters[r["adapter"]]["table"]:
                rows.setdefault((r["adapter"], r["setting"]), {})[r["problem"]] = r
        table = [(key, runs, standing(list(runs.values()))) for key, runs in rows.items()]
        table.sort(key=lambda row: (-row[2]["right"], -(row[2]["digits"] or 0.0), row[0]))
        if not table:
            continue
        lines += ["", f"## {kind[0].upper()}{kind[1:]}", "",
                  "| rank | adapter, setting | solver | right/tried | digits | time | with compilation |",
                  "|---|---|---|---|---|---|---|"]
        for rank, ((name, setting), runs, s) in enumerate(table, 1):
            said = next((f"{r['solver']} {r['version']}" for r in runs.values() if r.get("solver")), "-")
            lines.append(f"| {rank} | [`{name}`]({name}.py), {setting} | {said} | {s['right']}/{s['tried']} | "
                         f"{number(s['digits'])} | {number(s['again'], '.2g')} | {number(s['first'], '.2g')} |")
        notes = []
        ranks = " | ".join(str(k) for k in range(1, len(table) + 1))
        lines += ["", f"| problem | {ranks} |", "|---|" + "---|" * len(table)]
        lines += [f"| {p} | " + " | ".join(cell(runs.get(p), notes) for _, runs, _ in table) + " |" for p in problems]
        lines += [""] + [f"[{k}] {reason}  " for k, reason in enumerate(notes, 1)]
    return lines


INTRODUCTION = """
Made by `run.py`; how to read and correct it is in [README.md](README.md). Solvers are ranked within their class: by the
number of problems whose sequence of events is right, then by the median of the digits of these. Wall times are not
ranked; they are medians, in parts of the time of `scipy_events` on the same problem, without and with compilation.
Python's share in them is large.

A cell has the fewest correct digits of any event, in parts of the problem's time scale. Where the sequence of events is
wrong, −m +n says that m events are missing and n spurious. The problems 02 and 03 have no events, and do not count in
the rank: in parentheses is the error of the position, root mean square, m. A number in brackets is a reason, below the
table.
"""


def draw(results, problem, path):
    """Work against precision: largest error of the events against the relative wall time."""
    import matplotlib
    matplotlib.use("Agg")
    matplotlib.rcParams.update({"svg.hashsalt": "friction benchmark set", "svg.fonttype": "none", "font.size": 9})
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7.2, 4.6), layout="constrained")
    title = ""
    for kind, colour in COLOURS.items():
        names = sorted({r["adapter"] for r in results if r["class"] == kind})
        for mark, name in zip(MARKS, names):
            runs = [r for r in results if r["adapter"] == name and r["problem"][:2] == problem]
            runs = [r for r in runs if r.get("largest_event_error") and "time_ratio" in r]
            points = sorted((r["time_ratio"]["again"], r["largest_event_error"]) for r in runs)
            if points:
                title = next(r["problem"] for r in runs)
                axes.plot(*zip(*points), mark, color=colour, markersize=5, label=f"{name} ({kind.split(',')[0]})",
                          linestyle=":", linewidth=0.7)
    axes.set(xscale="log", yscale="log", xlabel="wall time in parts of scipy_events, without compilation",
             ylabel="largest error of an event, s", title=f"{title}: settings with the right sequence of events")
    axes.grid(True, which="major", linewidth=0.3)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right upper", fontsize=7, frameon=False)
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)
