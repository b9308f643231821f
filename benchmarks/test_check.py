"""Tests of check.py: mistakes are planted in answers of the set and in motions of known closed form.

python -m unittest test_check.py        (in this folder; the standard library is enough)
"""

import ast
import contextlib
import csv
import functools
import io
import json
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import types
import unittest
import unittest.mock
import xml.etree.ElementTree as ElementTree
from array import array
from typing import Any, Callable, Dict, Iterable, List, Optional, Sequence, Tuple

import check

HERE = os.path.dirname(os.path.abspath(__file__))
FOLDERS = sorted(name for name in os.listdir(HERE) if os.path.isfile(os.path.join(HERE, name, "problem.json")))
PERIOD = 0.2 + 0.15 * math.pi  # of the belt of problem 09: a stick of 0.2 s and a slip of 3 pi/20 s


# --- Motions in closed form -------------------------------------------------------------------------------------------


def launched(t: float) -> Tuple[float, float]:
    """Position and speed of problem 01: a mass with 3 m/s and the deceleration 0.5 9.81 m/s^2."""
    stop = 3.0 / 4.905
    t = min(t, stop)
    return 3.0 * t - 2.4525 * t * t, 3.0 - 4.905 * t if t < stop else 0.0


def belt(t: float) -> Tuple[float, float]:
    """Position and speed of problem 09: w = 10 rad/s, static limit 4 N, kinetic friction 3 N, belt 0.1 m/s."""
    phase = math.fmod(t, PERIOD)
    if phase <= 0.2:
        return 0.02 + 0.1 * phase, 0.1
    x = 10.0 * (phase - 0.2)
    return 0.03 + 0.01 * (math.cos(x) + math.sin(x)), 0.1 * (math.cos(x) - math.sin(x))


def belt_events(end: float = 10.0) -> List[Tuple[float, str]]:
    """Events of problem 09."""
    each = [[(k * PERIOD + 0.2, "slip"), ((k + 1) * PERIOD, "stick")] for k in range(20)]
    return [event for pair in each for event in pair if event[0] <= end]


def block_events(static: float, kinetic: float, end: float = 50.0) -> List[Tuple[float, str]]:
    """Events of a mass of 1 kg under 8 cos t N that slips from rest at t = 0; limits in N."""
    events: List[Tuple[float, str]] = []
    at, sense = 0.0, 1.0

    def has_stopped(start: float, sense: float, t: float) -> bool:
        return sense * 8.0 * (math.sin(t) - math.sin(start)) <= kinetic * (t - start)

    while True:
        stop = first_change(functools.partial(has_stopped, at, sense), at + 1e-3, 1e-3)
        stick = (stop, "stick")
        slip_at = first_change(lambda t: abs(8.0 * math.cos(t)) > static, stop, 1e-3)
        if stop > end:
            return events
        events.append(stick)
        if slip_at > end:
            return events
        if slip_at > stop:
            events.append((slip_at, "slip"))
        at, sense = slip_at, math.copysign(1.0, math.cos(slip_at))


def first_change(is_past: Callable[[float], bool], start: float, step: float) -> float:
    """Where a condition becomes true, by bisection; `start` if it is true there."""
    if is_past(start):
        return start
    low = start
    while not is_past(low + step):
        low += step
    high = low + step
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_past(middle) else (middle, high)
    return high


def regularised_belt(eps: float, step: float, every: int) -> List[List[float]]:
    """Rows of the belt with 3 N tanh(v_rel/eps) + the static excess near rest, by the classical Runge-Kutta method."""

    def slope(x: float, v: float) -> Tuple[float, float]:
        r = 0.1 - v
        return v, (3.0 + math.exp(-abs(r) / (3.0 * eps))) * math.tanh(r / eps) - 100.0 * x

    rows, x, v = [], 0.02, 0.1
    for k in range(round(10.0 / step) + 1):
        if k % every == 0:
            rows.append([k * step, x, v])
        a = slope(x, v)
        b = slope(x + 0.5 * step * a[0], v + 0.5 * step * a[1])
        c = slope(x + 0.5 * step * b[0], v + 0.5 * step * b[1])
        d = slope(x + step * c[0], v + step * c[1])
        x += step / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0])
        v += step / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1])
    return rows


def steps(end: float, count: int) -> List[float]:
    """Times from 0 to `end`."""
    return [end * k / count for k in range(count + 1)]


def belt_rows(count: int = 2000) -> List[List[float]]:
    """Rows of problem 09."""
    return [[t, *belt(t)] for t in steps(10.0, count)]


# --- Running the checker ----------------------------------------------------------------------------------------------


class Case(unittest.TestCase):
    """Writes candidates to a folder of its own, and runs the checker on them."""

    def setUp(self) -> None:
        """Makes the folder."""
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = holder.name

    def path(self, name: str) -> str:
        """A path in the folder."""
        return os.path.join(self.folder, name)

    def write(self, name: str, text: str) -> str:
        """A text file."""
        with open(self.path(name), "w", encoding="utf-8", newline="") as file:
            file.write(text)
        return self.path(name)

    def table(self, header: str, rows: Iterable[Sequence[Any]], before: str = "", name: str = "mine.csv") -> str:
        """A candidate."""
        lines = [",".join(value if isinstance(value, str) else repr(value) for value in row) for row in rows]
        return self.write(name, before + "\n".join([header, *lines]) + "\n")

    def run_main(self, *arguments: str) -> Tuple[int, str, str]:
        """Exit status, output and errors."""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = check.main(arguments)
        return status, out.getvalue(), err.getvalue()

    def check(self, problem: str, path: str, *arguments: str, status: int = 0) -> Dict[str, Any]:
        """The document; the exit status has to be `status`."""
        found, out, err = self.run_main(problem, path, *arguments, "--json")
        self.assertEqual(found, status, err)
        document: Dict[str, Any] = json.loads(out)
        self.assertEqual(document["exit_status"], status)
        return document

    def text(self, problem: str, path: str, *arguments: str) -> str:
        """What is printed."""
        return self.run_main(problem, path, *arguments)[1]

    def refused(self, problem: str, path: str, *arguments: str) -> str:
        """The one line that is printed of an input that cannot be used."""
        status, out, err = self.run_main(problem, path, *arguments)
        self.assertEqual((status, out), (2, ""), err)
        self.assertEqual(err.count("\n"), 1, err)
        return err

    def copy(self, problem: str, **changes: Any) -> str:
        """A copy of a problem, with other entries in its problem.json."""
        folder = tempfile.mkdtemp(dir=self.folder)
        shutil.copytree(os.path.join(HERE, next(f for f in FOLDERS if f.startswith(problem))), folder,
                        dirs_exist_ok=True)
        path = os.path.join(folder, "problem.json")
        with open(path, encoding="utf-8") as file:
            data = {**json.load(file), **changes}
        with open(path, "w", encoding="utf-8") as file:
            json.dump(data, file)
        return folder

    def assert_note(self, document: Dict[str, Any], part: str) -> None:
        """One of the notes says this."""
        self.assertTrue(any(part in note for note in document["notes"]), document["notes"])


def answer(problem: str, name: str) -> List[Dict[str, str]]:
    """A table of the set."""
    folder = next(folder for folder in FOLDERS if folder.startswith(problem))
    with open(os.path.join(HERE, folder, name), encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def answer_events(problem: str) -> List[Tuple[float, str]]:
    """Times and kinds of the reference."""
    return [(float(row["time"]), row["kind"]) for row in answer(problem, "events.csv")]


def answer_samples(problem: str) -> Tuple[str, List[List[float]]]:
    """Header and rows of samples.csv."""
    rows = answer(problem, "samples.csv")
    return ",".join(rows[0]), [[float(value) for value in row.values()] for row in rows]


# --- The set's own answers --------------------------------------------------------------------------------------------


class OwnAnswers(Case):
    """Every answer, held against itself."""

    def test_the_set_is_there(self) -> None:
        """Twenty-three problems, by number, name and path."""
        self.assertEqual([folder[:2] for folder in FOLDERS], [f"{k:02}" for k in range(1, 24)])
        path = os.path.join(HERE, FOLDERS[8], "events.csv")
        for name in ("9", "09", FOLDERS[8], FOLDERS[8] + "/", os.path.join(HERE, FOLDERS[8])):
            self.assertEqual(self.check(name, path)["problem"], FOLDERS[8])

    def test_events_agree_with_themselves(self) -> None:
        """To rounding, and within the budget."""
        for folder in FOLDERS:
            with self.subTest(folder):
                count = len(answer(folder, "events.csv"))
                # Without events the budget is one of samples.
                path = os.path.join(HERE, folder, "events.csv" if count else "samples.csv")
                bounds = ("missing=0", "spurious=0", "budget")
                document = self.check(folder, path, *(word for bound in bounds for word in ("--require", bound)))
                self.assertEqual(document["sequence"]["candidate_events"], count)
                self.assertEqual(len(document["events"]), count)
                for event in document["events"]:
                    self.assertEqual(event["error"], 0.0)
                if count:
                    self.assertGreater(document["digits"], 11.0)
                for value in document["summary"]:
                    if value["candidate"] is not None:
                        self.assertLess(abs(value["error"]), 1e-12)

    def test_samples_agree_with_themselves(self) -> None:
        """Every column to the last bit; every event but those that the rows cannot show."""
        for folder in FOLDERS:
            with self.subTest(folder):
                document = self.check(folder, os.path.join(HERE, folder, "samples.csv"))
                samples = document["samples"]
                self.assertEqual(samples["points"], samples["of"])
                self.assertEqual(samples["too_coarse"], [])
                self.assertEqual([column["largest"] for column in samples["columns"] if column["largest"] != 0.0], [])
                self.assertEqual(document["scores"]["position"]["relative"], 0.0)
                self.assertEqual(document["sequence"]["spurious"], 0)
                if document["sequence"]["missing"]:
                    self.assert_note(document, "Between two rows lies a whole stick or slip")

    def test_a_problem_that_does_not_exist(self) -> None:
        """Those that do are listed."""
        self.assertIn(FOLDERS[3], self.refused("99", os.path.join(HERE, FOLDERS[0], "events.csv")))


# --- Motions in closed form against the answers -----------------------------------------------------------------------


class ClosedForms(Case):
    """Right answers, which owe nothing to the set."""

    def test_launched_mass(self) -> None:
        """The stop, where it stays, and no error of the samples but rounding."""
        path = self.table(
            "time,x,v", ([t, *launched(t)] for t in steps(1.0, 100)), "# solver: by hand\n# version: 1.2\n"
        )
        document = self.check("01", path, "--require", "digits=9", "--require", "samples=13", "--require", "summary=12")
        self.assertEqual((document["candidate"]["solver"], document["candidate"]["version"]), ("by hand", "1.2"))
        self.assertEqual([event["kind"] for event in document["events"]], ["stick"])
        self.assertAlmostEqual(document["events"][0]["candidate_time"], 3.0 / 4.905, delta=1e-12)
        self.assertEqual(document["scores"]["creep"]["rms"], 0.0)
        self.assertLess(document["scores"]["rest"]["rms"], 1e-14)

    def test_belt_by_its_events(self) -> None:
        """Twelve digits; other kinds, and what is outside of the time, are counted and ignored."""
        events = [(0.0, "slip"), *belt_events(), (10.5, "stick"), (11.0, "slip")]
        lines = [
            f'{time!r}, "{kind.upper()}" ,"free text, with a comma"'
            for time, kind in (*events, (12.0, "corner"), (12.0, "corner"))
        ]
        path = self.write("events.csv", "time,kind,remark\r\n" + "\r\n\r\n".join(lines) + "\r\n")
        document = self.check("09", path, "--require", "digits=12")
        values = {value["name"]: value for value in document["summary"]}
        self.assertGreater(values["period"]["digits"], 12.0)
        self.assertEqual(document["sequence"]["outside"], 3)
        self.assertEqual(document["ignored_events"], {"corner": 2})
        self.assertEqual(document["candidate"]["ignored_columns"], ["remark"])
        self.assertIsNone(document["samples"])

    def test_belt_by_its_samples(self) -> None:
        """Stops to the fourth power of the interval; the period; nothing to complain of."""
        document = self.check(
            "09", self.table("time,x,v", belt_rows()), "--require", "digits=6", "--require", "samples=12"
        )
        self.assertTrue(document["sequence"]["agrees"])
        self.assertEqual(document["notes"], [])
        self.assertAlmostEqual(document["scores"]["period"]["candidate"], PERIOD, delta=2e-4)
        self.assertLess(document["scores"]["period"]["relative"], 1e-12)
        period = {value["name"]: value["candidate"] for value in document["summary"]}["period"]
        self.assertAlmostEqual(period, PERIOD, delta=1e-7)

    def test_samples_at_other_times(self) -> None:
        """The cubic through four rows; the error of a smooth stretch falls with the fourth power of the interval."""
        found = []
        for count in (777, 1554):
            # Within the first stick and slip only the end of the stick is not smooth.
            path = self.table("time,x", ([t, *belt(t)[:1]] for t in steps(10.0, count)))
            document = self.check("09", path)
            self.assertIsNone(document["sequence"]["agrees"])
            self.assertIsNone(document["digits"])
            found.append(document["samples"]["columns"][0]["rms"])
        self.assertLess(found[1], 0.5 * found[0])
        self.assertLess(found[0], 1e-5)

    def test_relative_velocity_itself(self) -> None:
        """The column may stand for those that make it up."""
        path = self.table("time,relative_velocity", ([t, 0.1 - v] for t, _, v in belt_rows()))
        document = self.check("09", path, "--require", "digits=6")
        self.assertEqual(document["candidate"]["columns"], ["relative_velocity"])
        self.assertIsNone(document["scores"]["position"])
        self.assertEqual(document["scores"]["creep"]["rms"], 0.0)

    def test_the_example_of_a_solver(self) -> None:
        """That of the folder ci meets the budget, by its samples and by its events."""
        samples, events = self.path("samples.csv"), self.path("events.csv")
        subprocess.run([sys.executable, os.path.join(HERE, "ci", "example_solver.py"), samples, events], check=True)
        for path in (samples, events):
            document = self.check("01", path, "--require", "budget")
            self.assertEqual(document["candidate"]["solver"], "example_solver.py")

    def test_block_by_its_events(self) -> None:
        """The two blocks, whose limits are equal and are not."""
        for problem, kinetic in (("04", 0.8 * 9.81), ("06", 0.6 * 9.81)):
            path = self.table("time,kind", block_events(0.8 * 9.81, kinetic))
            self.assertGreater(self.check(problem, path)["digits"], 12.0)

    def test_events_beside_samples(self) -> None:
        """Events are those stated; the samples are scored as they are."""
        events = self.table("time,kind", belt_events(), "# solver: theirs\n# version: 2\n", "events.csv")
        samples = self.table("time,x,v", belt_rows(100), "# version: 3\n")
        document = self.check("09", samples, "--events", events, "--require", "digits=12")
        self.assertEqual((document["candidate"]["solver"], document["candidate"]["version"]), ("theirs", "3"))
        self.assertEqual(document["candidate"]["form"], "samples and events")
        self.assertIsNone(document["candidate"]["threshold"])
        self.assert_note(document, "The rows are too coarse")


# --- Planted mistakes -------------------------------------------------------------------------------------------------


class PlantedMistakes(Case):
    """What is said of each."""

    def test_late_events(self) -> None:
        """Each event a little later than the one before."""
        late = [(time + 1e-5 * k, kind) for k, (time, kind) in enumerate(belt_events())]
        path = self.table("time,kind", late)
        document = self.check("09", path, "--require", "digits=5", status=1)
        self.assertTrue(document["sequence"]["agrees"])
        self.assertAlmostEqual(document["largest_event_error"], 28e-5, delta=1e-12)
        scale = 0.6283185307179586
        self.assertAlmostEqual(document["digits"], -math.log10(28e-5 / scale), delta=1e-9)
        self.assertIn("the fewest at event 28, a slip", document["verdict"])
        self.assertEqual(document["notes"], [])
        self.assertIsNone(document["samples"])
        self.check("09", path, "--require", "events<2.9e-4", "--require", "digits>3.3")
        self.check("09", path, "--require", "events=2.7e-4", status=1)

    def test_far_events_of_the_right_kinds_are_matched(self) -> None:
        """However far apart they are."""
        document = self.check("09", self.table("time,kind", [(0.5 * time, kind) for time, kind in belt_events()]))
        self.assertTrue(document["sequence"]["agrees"])
        self.assertEqual(len(document["events"]), 29)
        self.assertAlmostEqual(document["largest_event_error"], 0.5 * belt_events()[-1][0], delta=1e-9)
        # A cycle late from the second event on, and caught up in the end: nearly all have another event near by.
        events = belt_events()
        times = [events[0][0], *(time for time, _ in events[3:27]), *(9.5 + 0.01 * k for k in range(3)), events[28][0]]
        document = self.check("09", self.table("time,kind", zip(times, (kind for _, kind in events))))
        self.assertAlmostEqual(document["events"][5]["error"], PERIOD, delta=1e-12)
        self.assertEqual(document["sequence"]["missing"], 0)

    def test_breakaway_at_the_kinetic_limit(self) -> None:
        """The stop is right, and the breakaway after it early."""
        document = self.check(
            "06", self.table("time,kind", block_events(0.6 * 9.81, 0.6 * 9.81)), "--require", "digits=3", status=1
        )
        first = {event["event"]: event for event in document["events"]}
        self.assertLess(abs(first[0]["error"]), 1e-12)
        self.assertEqual(first[1]["kind"], "slip")
        self.assertLess(first[1]["error"], -0.1)
        self.assertLess(document["digits"], 2.0)

    def test_regularised_law(self) -> None:
        """It creeps; no stick is found by the default, and some are by the speed at which it creeps."""
        rows = regularised_belt(2e-4, 1e-4, 50)
        path = self.table("time,x,v", rows)
        document = self.check("09", path, "--require", "digits=2", status=1)
        self.assertFalse(document["sequence"]["agrees"])
        self.assertEqual(document["digits"], 0.0)
        self.assertGreater(document["sequence"]["missing"], 10)
        self.assertTrue(document["verdict"].startswith("The sequence is wrong."))
        self.assert_note(document, "Few sticks were found: 0, where the reference has 14.")
        slow = sorted(abs(0.1 - v) for _, _, v in rows)[len(rows) // 10]
        self.assertTrue(2e-5 < slow < 2e-3, slow)
        self.assert_note(document, f"|v_rel| below {slow:.3g} m/s")
        # Scores need no event: they can be required without the sequence.
        self.assertGreater(document["scores"]["creep"]["relative"], 1e-3)
        self.check("09", path, "--require", "period=0.1")
        self.check("09", path, "--require", "period=0.01", status=1)
        found = self.check("09", path, "--threshold", "1e-3")
        self.assertEqual(found["candidate"]["threshold_from"], "option")
        self.assertGreater(found["sequence"]["candidate_sticks"], 12)
        self.assertLess(found["events"][0]["error"], -0.01)

    def test_missed_short_stick(self) -> None:
        """Found where it is, although the kinds differ only at the end."""
        events = answer_events("21")
        at = min(
            (k for k in range(len(events) - 1) if events[k][1] == "stick" and k > 10),
            key=lambda k: events[k + 1][0] - events[k][0],
        )
        path = self.table("time,kind", events[:at] + events[at + 2 :])
        document = self.check("21", path, "--require", "missing=1", status=1)
        sequence = document["sequence"]
        self.assertEqual((sequence["missing"], sequence["spurious"], document["digits"]), (2, 0, 0.0))
        self.assertEqual([event["event"] for event in sequence["unmatched"]], [at, at + 1])
        self.assertEqual(sequence["parts"]["position"], len(events) - 2)
        self.assertIsNone(sequence["parts"]["candidate"])
        self.assertIn(f"It parts at event {at} (stick at ", document["verdict"])
        self.assertIn("the candidate has none. 2 missing, 0 spurious.", document["verdict"])
        self.check("21", path, "--require", "missing=2")
        self.check("21", path, "--require", "missing=2", "--require", "spurious<1", "--require", "digits=1", status=1)

    def test_spurious_and_renamed_events(self) -> None:
        """The place where the sequences part has both kinds and times, and what is around."""
        events = belt_events()
        doubled = events[:7] + [(events[6][0] + 1e-4, "slip")] + events[7:]
        document = self.check("09", self.table("time,kind", doubled), "--require", "spurious=0", status=1)
        self.assertEqual((document["sequence"]["missing"], document["sequence"]["spurious"]), (0, 1))
        parts = document["sequence"]["parts"]
        self.assertEqual(
            (parts["position"], parts["reference"]["kind"], parts["candidate"]["kind"]), (7, "stick", "slip")
        )
        self.assertEqual([event["event"] for event in parts["reference_around"]], [5, 6, 7, 8, 9])
        self.assertEqual(parts["candidate_around"][2]["time"], events[6][0] + 1e-4)
        self.assertIn(f"It parts where the candidate has slip at {events[6][0] + 1e-4:.9g} s", document["verdict"])
        renamed = events[:4] + [(events[4][0], "reversal")] + events[5:]
        path = self.table("time,kind", renamed)
        document = self.check("09", path)
        self.assertEqual((document["sequence"]["missing"], document["sequence"]["spurious"]), (1, 1))
        self.assertIn("It parts at event 4 (slip at 1.54247780 s)".replace("80 s", "8 s"), document["verdict"])
        self.assertIn("s): the candidate has reversal at 1.5424", document["verdict"])
        self.assertIn("spurious: 4, reversal", self.text("09", path))
        document = self.check("09", self.table("time,kind", events[:6] + events[8:]))
        self.assertIn("It parts at event 6 (slip at ", document["verdict"])
        self.assertEqual(document["sequence"]["parts"]["position"], 27)

    def test_start(self) -> None:
        """A mass that slides where the answer holds it, or stands where it slides, has no event, and is wrong."""
        slides, stands = (self.table(*answer_samples(name), name=name) for name in ("03", "02"))
        for problem, right, wrong, fault in (
            ("02", stands, slides, "at t = 0: the candidate slips, the answer sticks"),
            ("03", slides, stands, "at t = 0: the candidate rests, the answer slips"),
        ):
            self.assertEqual(self.check(problem, right, "--require", "digits=6")["sequence"]["start"], "agrees")
            document = self.check(problem, wrong, "--require", "digits=6", status=1)
            sequence = document["sequence"]
            self.assertEqual((sequence["start"], sequence["agrees"], document["digits"]), ("contradicts", False, 0.0))
            self.assertEqual(sequence["faults"], [fault])
            self.assertEqual((sequence["missing"], sequence["spurious"], sequence["parts"]), (0, 0, None))
            self.assertIn(fault[1:], document["verdict"])
            self.check(problem, wrong, "--require", "spurious=0", status=1)
            self.check(problem, wrong, "--require", "position=1e99", status=1 if problem == "02" else 0)
        self.assertIsNone(self.check("02", self.table("time,kind", []))["sequence"]["start"])
        self.assertIsNone(self.check("11", self.table(*answer_samples("11")))["sequence"]["start"])
        # Events of the answer do not hide it.
        rows = [[t, x, v + (0.01 if t < 0.2 else 0.0)] for t, x, v in belt_rows()]
        self.assertEqual(self.check("09", self.table("time,x,v", rows))["sequence"]["start"], "contradicts")
        for folder in FOLDERS:
            header, rows = answer_samples(folder)
            for every in (1, 3):
                found = self.check(folder, self.table(header, rows[::every]))["sequence"]["start"]
                self.assertIn(found, ("agrees", None), (folder, every))

    def test_start_in_every_row(self) -> None:
        """Of those that count: after the first, before the first event, above the speed at which a stick ends."""

        def contradicts(
            velocities: Sequence[float], slips: bool, event: float = 3.0, own: float = 0.0, step: float = 1.0,
            threshold: Optional[float] = None,
        ) -> bool:
            problem = types.SimpleNamespace(
                threshold=threshold, starts_in_slip=slips, events=[check.Event(0, event, "slip")],
                times=[0.0, 1.0], samples={"relative_velocity": [own]},
            )
            times = [step * k for k in range(len(velocities))]
            return check.start_contradicts(problem, times, velocities, 1.0, 2.0)  # type: ignore[arg-type]

        self.assertTrue(contradicts([0.0, 2.1, -2.1, 0.0], False))
        self.assertFalse(contradicts([0.0, 2.1, 2.0, 9.0], False))
        self.assertFalse(contradicts([0.0, 2.0, 2.1, 9.0], False))
        self.assertFalse(contradicts([9.0], False))
        self.assertFalse(contradicts([9.0, 9.0, 9.0], False, event=1.0))
        self.assertFalse(contradicts([9.0, 9.0, 9.0], False, own=1e-300))
        self.assertTrue(contradicts([0.0, 1.0, -1.0, 9.0], True))
        self.assertFalse(contradicts([1.1, 1.0, 1.0, 9.0], True))
        self.assertFalse(contradicts([0.0, 0.0, 1.1, 0.0], True))
        self.assertFalse(contradicts([0.0, 1.0, -1.0, 9.0], True, threshold=1.0))
        self.assertFalse(contradicts([0.0, 0.0, 0.0], True, event=1.0, step=0.25))
        self.assertTrue(contradicts([0.0, 0.0], True, event=1.1))

    def test_clock_offset(self) -> None:
        """All events are late by the same; in an alignment by shifted times too."""
        shifted = [(time + 0.05, kind) for time, kind in belt_events()]
        document = self.check("09", self.table("time,kind", shifted), "--require", "digits=3", status=1)
        self.assert_note(document, "All events are late by 0.05 s")
        early = [[t - 0.004, *belt(t)] for t in steps(10.0, 2000)]
        document = self.check("09", self.table("time,x,v", early))
        self.assert_note(document, "All events are early by 0.004 s")
        # One event is missing, and the others are late by more than a quarter of the time scale.
        late = [(time + 0.6, kind) for time, kind in belt_events(9.39)]
        document = self.check("09", self.table("time,kind", late[:9] + late[10:]))
        self.assert_note(document, "All events are late by 0.6 s")
        self.assertEqual([event["event"] for event in document["sequence"]["unmatched"]], [9, 27, 28])

    def test_too_coarse_rows(self) -> None:
        """Said, with both intervals."""
        header, rows = answer_samples("04")
        document = self.check("04", self.table(header, rows[::10]))
        piece = document["samples"]["too_coarse"][0]
        self.assertAlmostEqual(piece["interval"], 0.5, delta=1e-12)
        self.assertEqual((piece["from"], piece["to"]), (0.0, 50.0))
        self.assert_note(document, "The rows are too coarse: from 0 to 50 s their interval is 0.5 s")
        self.assertGreater(document["samples"]["columns"][0]["rms"], 0.0)
        self.assertEqual(self.check("04", self.table(header, rows[::4]))["samples"]["too_coarse"], [])
        # The median interval counts, not the smallest or the largest one.
        uneven = [row for k, row in enumerate(rows) if k % 10 == 0 or k < 9]
        self.assertAlmostEqual(
            self.check("04", self.table(header, uneven))["samples"]["too_coarse"][0]["interval"], 0.5
        )
        uneven = [row for k, row in enumerate(rows) if not 300 < k < 700]
        self.assertEqual(self.check("04", self.table(header, uneven))["samples"]["too_coarse"], [])

    def test_slip_between_two_rows(self) -> None:
        """A stick or slip that is shorter than the interval is named as such."""
        t, end = steps(10.0, 14), 10.0
        document = self.check("09", self.table("time,x,v", [[x, *belt(x)] for x in t if x <= end]))
        self.assertFalse(document["sequence"]["agrees"])
        self.assert_note(document, "Between two rows lies a whole stick or slip")

    def test_wrong_unit(self) -> None:
        """Millimetres, and milliseconds."""
        document = self.check(
            "09",
            self.table("time,x,v", ([t, 1e3 * x, v] for t, x, v in belt_rows())),
            "--require",
            "samples=2",
            status=1,
        )
        self.assert_note(document, "Column x is 1000 times the reference's: check the unit, which has to be m.")
        self.assertTrue(document["sequence"]["agrees"])
        self.assertGreater(document["scores"]["position"]["relative"], 100.0)
        # What is only of that size is no other unit.
        rows = [[t, 1e3 * x + 20.0 * (-1) ** k, v] for k, (t, x, v) in enumerate(belt_rows(1000))]
        self.assertEqual(self.check("09", self.table("time,x,v", rows))["notes"], [])
        document = self.check("09", self.table("time,x,v", ([1e3 * t, x, v] for t, x, v in belt_rows())))
        self.assert_note(document, "Is the time in seconds?")
        self.assertEqual(document["notes"].count("Is the time in seconds?"), 1)
        self.assertFalse(document["sequence"]["agrees"])
        events = [(1e3 * time, kind) for time, kind in belt_events()]
        for before in ([], [(0.0, "stick")]):
            document = self.check("09", self.table("time,kind", before + events))
            self.assert_note(document, "Is the time in seconds?")
        samples = self.table("time,x,v", belt_rows(), name="samples.csv")
        document = self.check("09", samples, "--events", self.table("time,kind", events))
        self.assertEqual(document["notes"], ["Not compared: 29 events after 10 s.", "Is the time in seconds?"])
        late = [(10.0 + time, kind) for time, kind in belt_events(1.0)]
        document = self.check("09", self.table("time,kind", [(-1.0, "stick"), (0.0, "slip"), *belt_events(), *late]))
        self.assertEqual(document["notes"], ["Not compared: 2 events at t = 0 or before, 3 events after 10 s."])

    def test_wrong_sign(self) -> None:
        """Of the speed: the column is named, and the sequence is wrong."""
        document = self.check(
            "09", self.table("time,x,v", ([t, x, -v] for t, x, v in belt_rows())), "--require", "digits=1", status=1
        )
        self.assert_note(document, "Column v is -1 times the reference's: check the sign.")
        self.assertFalse(document["sequence"]["agrees"])

    def test_part_of_the_time(self) -> None:
        """Events outside are not covered; a bound on the sequence needs them, unless it says how many may lack."""
        rows = belt_rows()
        path = self.table("time,x,v", rows[:1001])
        document = self.check("09", path, "--require", "digits=5", status=1)
        sequence = document["sequence"]
        inside = len(belt_events(5.0))
        self.assertTrue(sequence["agrees"])
        self.assertEqual((sequence["reference_events"], sequence["uncovered"]), (inside, 29 - inside))
        self.assertTrue(document["requirements"][0]["met"])
        self.assertFalse(sequence["accepted"])
        self.assertIn(f"{29 - inside} events of the reference not covered", document["verdict"])
        self.assert_note(document, "The rows go from 0 to 5 s")
        self.assertEqual(document["samples"]["points"], 501)
        self.check("09", path, "--require", "digits=5", "--require", f"uncovered={29 - inside}")
        self.check("09", path, "--require", f"uncovered={28 - inside}", status=1)
        self.check("09", path, "--require", "position=1e-6")
        # Of the last moments alone nothing can be said of the sequence.
        path = self.table("time,x,v", rows[1960:], name="end.csv")
        self.assertEqual(self.check("09", path)["sequence"]["reference_events"], 0)
        self.check("09", path, "--require", "uncovered=29", status=1)
        self.check("09", path, "--require", "uncovered=29", "--require", "missing=0", status=1)
        later = self.check("09", self.table("time,x,v", rows[700:]))
        self.assertTrue(later["sequence"]["agrees"])
        self.assertEqual(later["events"][0]["event"], len(belt_events(3.5)))

    def test_a_run_without_events_that_ends_early(self) -> None:
        """Is not accepted, although it has no event to miss."""
        path = self.table("time,x,v", ([float(t), 0.0, 0.0] for t in range(40)))
        document = self.check("02", path, "--require", "digits=6", status=1)
        self.assertTrue(document["sequence"]["agrees"])
        self.assertEqual(document["sequence"]["faults"], ["covered: 0 to 39 s"])
        whole = self.table("time,x,v", ([float(t), 0.0, 0.0] for t in range(101)))
        self.assertIsNone(self.check("02", whole, "--require", "digits=6")["requirements"][0]["value"])

    def test_drift_of_a_mass_that_holds(self) -> None:
        """In units, where the reference has no size."""
        path = self.table("time,x,v", ([float(t), 1e-7 * t, 1e-7] for t in range(101)))
        document = self.check("02", path, "--require", "creep_absolute=1e-6", "--require", "rest_absolute=1e-4")
        self.assertAlmostEqual(document["scores"]["creep"]["rms"], 1e-7, delta=1e-20)
        self.assertIsNone(document["scores"]["creep"]["relative"])
        self.assertIsNone(document["samples"]["columns"][0]["digits"])
        self.check("02", path, "--require", "creep=1", status=1)
        self.check("02", path, "--require", "samples=1", status=1)

    def test_chatter(self) -> None:
        """More events than are looked for."""
        source = random.Random(1)
        path = self.table("time,relative_velocity", ([1e-4 * k, source.uniform(-1.0, 1.0)] for k in range(60000)))
        document = self.check("09", path)
        self.assertEqual(document["sequence"]["candidate_events"], 20000)
        self.assert_note(document, "No more than 20000 events were looked for")


def open_text(path: str) -> str:
    """A text file."""
    with open(path, encoding="utf-8", newline="") as file:
        return file.read()


# --- Thresholds -------------------------------------------------------------------------------------------------------


class Thresholds(Case):
    """What counts as rest."""

    def noisy(self, size: float, before: str = "") -> str:
        """The belt with a speed that errs by up to `size` m/s where it sticks."""
        source = random.Random(2)
        rows = [[t, x, v + (source.choice((-size, size)) if v == 0.1 else 0.0)] for t, x, v in belt_rows()]
        return self.table("time,x,v", rows, before)

    def test_order(self) -> None:
        """The option wins over the file, and the file over the default; all are printed."""
        document = self.check("09", self.noisy(1e-6))
        self.assertEqual(
            (document["candidate"]["threshold"], document["candidate"]["threshold_from"]), (1e-8, "default")
        )
        self.assertFalse(document["sequence"]["agrees"])
        self.assert_note(document, "A tenth of the rows have |v_rel| below 1e-06 m/s")
        path = self.noisy(1e-6, "# threshold: 2e-6 m/s\n# threshold: 5\n")
        document = self.check("09", path)
        self.assertEqual((document["candidate"]["threshold"], document["candidate"]["threshold_from"]), (2e-6, "file"))
        self.assertTrue(document["sequence"]["agrees"])
        self.assertIn("|v_rel| up to 2e-06 is rest (file)", self.text("09", path))
        document = self.check("09", path, "--threshold", "1e-7")
        self.assertEqual(
            (document["candidate"]["threshold"], document["candidate"]["threshold_from"]), (1e-7, "option")
        )
        self.assertFalse(document["sequence"]["agrees"])

    def test_without_effect(self) -> None:
        """Of an events table the threshold changes nothing, and that is said; of rows it does."""
        document = self.check("09", self.table("time,kind", belt_events()), "--threshold", "1")
        self.assertEqual(document["notes"], ["--threshold has no effect: the events are stated."])
        document = self.check("09", self.table("time,x,v", belt_rows()), "--threshold", "1e-7")
        self.assertEqual(document["notes"], [])

    def test_a_speed_below_the_threshold(self) -> None:
        """Is no reason for few sticks."""
        rows = [[t, x, 0.1 if t < 2.0 else v + 1e-3] for t, x, v in belt_rows()]
        document = self.check("09", self.table("time,x,v", rows))
        self.assertLess(document["sequence"]["candidate_sticks"], 7)
        self.assertEqual([note for note in document["notes"] if "tenth" in note], [])

    def test_hysteresis(self) -> None:
        """A stick ends above so many thresholds."""
        rows = [
            [t, x, v + (1.5e-6 if v == 0.1 and 0.05 < math.fmod(t, PERIOD) < 0.1 else 0.0)] for t, x, v in belt_rows()
        ]
        path = self.table("time,x,v", rows)
        self.assertTrue(self.check("09", path, "--threshold", "1e-6")["sequence"]["agrees"])
        self.assertTrue(self.check("09", path, "--threshold", "1e-6", "--hysteresis", "1.6")["sequence"]["agrees"])
        self.assertFalse(self.check("09", path, "--threshold", "1e-6", "--hysteresis", "1.4")["sequence"]["agrees"])

    def test_the_problem_sets_the_threshold_of_contacts_without_stick(self) -> None:
        """No option changes it."""
        folder = next(folder for folder in FOLDERS if folder.startswith("11"))
        document = self.check("11", os.path.join(HERE, folder, "samples.csv"), "--threshold", "1e-4")
        self.assertEqual(document["candidate"]["threshold_from"], "problem")
        self.assertTrue(document["sequence"]["agrees"])
        self.assert_note(document, "--threshold has no effect: the problem has a threshold of its own.")
        # The creep is held against the reference's own.
        header, rows = answer_samples("11")
        document = self.check("11", self.table(header, ([t, x, v + 1e-3] for t, x, v in rows)))
        self.assertAlmostEqual(document["scores"]["creep"]["rms"], 1e-3, delta=1e-12)

    def test_wrong_settings(self) -> None:
        """Refused in one line each."""
        path = self.table("time,x,v", belt_rows(10))
        for option, value in (
            ("--threshold", "-1"),
            ("--threshold", "fast"),
            ("--threshold", "nan"),
            ("--hysteresis", "0.5"),
        ):
            self.assertIn(value, self.refused("09", path, f"{option}={value}"))


# Of test_last_bits, without and with a linear breakaway.
LAST_BITS: List[List[str]] = [
    [
        "slip 0x1.b266a466f3495p-3",
        "stick 0x1.74493c1374778p-1",
        "slip 0x1.364cd48cde693p+0",
        "stick 0x1.ba249e09ba3bcp+0",
        "slip 0x1.0000000000000p+1",
        "reversal 0x1.2762762762762p+1",
        "reversal 0x1.3800000000000p+1",
        "reversal 0x1.4555555555555p+1",
        "stick 0x1.60ede11d21678p+1",
        "slip 0x1.7400000000000p+1",
    ],
    [
        "slip 0x1.c000000000000p-3",
        "stick 0x1.74493c1374778p-1",
        "slip 0x1.3800000000000p+0",
        "stick 0x1.ba249e09ba3bcp+0",
        "slip 0x1.040fe9cc59366p+1",
        "reversal 0x1.2762762762762p+1",
        "reversal 0x1.3800000000000p+1",
        "reversal 0x1.4555555555555p+1",
        "stick 0x1.60ede11d21678p+1",
        "slip 0x1.7400000000000p+1",
    ],
]
CROSSINGS: List[str] = [
    "slip 0x1.513a2fd0a42f6p-2",
    "stick 0x1.73fc84a0ff622p-1",
    "slip 0x1.544e8bf4290bep+0",
    "stick 0x1.b9fe42507fb10p+0",
    "slip 0x1.0b7def58a7a76p+1",
    "stick 0x1.26ce2ef22aa96p+1",
    "slip 0x1.3f6e19660dcdcp+1",
    "stick 0x1.44dc6a9c4dd42p+1",
    "slip 0x1.4d72bd37dc7dap+1",
    "stick 0x1.599999999999ap+1",
    "slip 0x1.75859b89b9c14p+1",
]


def rugged(k: int) -> float:
    """Sample k of a velocity that sticks, slips and turns; no operation of it is rounded."""
    j = k % 16
    x, sense = j - 3.375, 1.0 - 2.0 * (k // 16 % 2)
    if k < 32:
        return sense * x * x * (1.0 + 0.125 * x) * (11.625 - j) / 16.0 if 4 <= j <= 11 else 0.0
    return (0.0, 1.0, 3.0, 4.75, 6.0, -0.5, -1.25, 0.0, 2.0, -1.0, -2.5, -2.0, -0.25, 0.0, 0.0, 3.0)[j]


# --- Numbers ----------------------------------------------------------------------------------------------------------


def detected(
    velocity: Callable[[float], float], times: Iterable[float], linear: bool = False, threshold: float = 1e-6
) -> List[Tuple[float, str]]:
    """Events of a function of time."""
    detector = check.Detector(threshold, 2.0, linear)
    for time in times:
        detector.add(time, velocity(time))
    return [(event.time, event.kind) for event in detector.finish()]


class Numbers(Case):
    """Each rule against what it is exact for."""

    def assert_events(
        self, found: Sequence[Tuple[float, str]], expected: Sequence[Tuple[float, str]], delta: float
    ) -> None:
        """Kinds, and times within `delta`."""
        self.assertEqual([kind for _, kind in found], [kind for _, kind in expected])
        for (time, _), (right, _) in zip(found, expected):
            self.assertAlmostEqual(time, right, delta=delta)

    def test_stop_and_quadratic_breakaway(self) -> None:
        """A stop by a parabola, a breakaway by a square and a cube: both exact but for rounding."""

        def velocity(t: float) -> float:
            if t < 1.2345:
                return (1.2345 - t) + 0.3 * (1.2345 - t) ** 2
            return 0.7 * (t - 2.3456) ** 2 - 0.4 * (t - 2.3456) ** 3 if t > 2.3456 else 0.0

        times = [0.01 * k for k in range(300)]
        self.assert_events(detected(velocity, times), [(1.2345, "stick"), (2.3456, "slip")], 1e-10)
        # The rule for the other growth is far less exact here.
        self.assertGreater(abs(detected(velocity, times, linear=True)[1][0] - 2.3456), 1e-4)

    def test_take_off(self) -> None:
        """By a parabola, also from far away; where the secant method leaves the interval, the parabola stays."""
        squares = [(13.0, 100.0), (14.0, 121.0), (15.0, 144.0)]
        self.assertAlmostEqual(check.take_off(squares[:2]) or 0.0, 3.0, delta=1e-12)
        self.assertAlmostEqual(check.take_off(squares) or 0.0, 3.0, delta=1e-7)
        self.assertIsNone(check.take_off([(10.0, 100.0), (11.0, 100.0), (12.0, 144.0)]))
        for p, q, r in ((1.5, 4.75, 7.25), (2.75, 7.25, 8.5), (2.5, 6.75, 7.75)):
            ratio = math.sqrt(p / q)
            self.assertEqual(check.take_off([(1.0, p), (2.0, q), (3.0, r)]), (1.0 - ratio * 2.0) / (1.0 - ratio))

    def test_stop_soon_after_a_reversal(self) -> None:
        """The rows before the reversal say nothing of the stop: friction has changed its sign."""
        found = detected(
            lambda t: (
                4.0 * (1.03 - t) if t < 1.03 else max(1.03 - t, -1.0) + 2.0 * max(t - 1.19, 0.0) if t < 1.35 else 0.0
            ),
            [0.1 * k for k in range(20)],
        )
        self.assertEqual([kind for _, kind in found], ["reversal", "stick"])
        self.assertAlmostEqual(found[0][0], 1.03, delta=1e-12)
        self.assertTrue(1.3 <= found[1][0] <= 1.4, found)

    def test_last_bits(self) -> None:
        """Times found in a rugged sequence, bit by bit: whoever follows scoring.md gets the same."""
        times = [k / 16.0 for k in range(48)]
        for linear in (False, True):
            detector = check.Detector(1e-8, 2.0, linear)
            for k, time in enumerate(times):
                detector.add(time, rugged(k))
            found = detector.finish()
            self.assertEqual([event.kind for event in found], [line.split()[0] for line in LAST_BITS[linear]])
            self.assertEqual([f"{event.kind} {event.time.hex()}" for event in found], LAST_BITS[linear])
        found = check.crossings(times, [rugged(k) for k in range(48)], 1.75)
        self.assertEqual([f"{event.kind} {event.time.hex()}" for event in found], CROSSINGS)

    def test_linear_breakaway(self) -> None:
        """By a cubic of the time; at a row; by too few rows."""

        def velocity(t: float) -> float:
            x = t - 2.3456
            return 0.7 * x + 0.2 * x * x - 0.4 * x**3 if x > 0.0 else 0.0

        times = [0.01 * k for k in range(300)]
        self.assert_events(detected(velocity, times, linear=True), [(2.3456, "slip")], 1e-11)
        at_row = detected(lambda t: max(t - 0.5, 0.0) * (1.0 + 0.1 * t), [0.125 * k for k in range(9)], linear=True)
        self.assert_events(at_row, [(0.5, "slip")], 1e-9)
        one = detected(lambda t: max(t - 0.9, 0.0), [0.0, 0.5, 1.0], linear=True)
        self.assert_events(one, [(0.75, "slip")], 0.0)

    def test_reversals(self) -> None:
        """Between two rows, and through a row at zero; two zeros in an interval are a stop at the first."""
        times = [0.1 * k - 1.0 for k in range(21)]
        self.assert_events(detected(lambda t: 0.05 - t, times), [(0.05, "reversal")], 1e-12)
        self.assert_events(detected(lambda t: 0.0 if abs(t) < 1e-9 else -t, times), [(0.0, "reversal")], 1e-12)
        self.assert_events(
            detected(lambda t: (t - 0.03) * (t - 0.04) if t < 0.03 else 0.0, times), [(0.03, "stick")], 1e-9
        )

    def test_a_slip_that_ends_at_once(self) -> None:
        """The breakaway by fewer rows comes before the stop."""
        velocity = {3: 0.01, 4: 0.03}
        found = detected(lambda t: velocity.get(round(t), 0.0), range(10))
        self.assertEqual([kind for _, kind in found], ["slip", "stick"])
        self.assertTrue(2.0 <= found[0][0] <= 3.0 and 4.0 <= found[1][0] <= 5.0, found)

    def test_crossings(self) -> None:
        """|1 - x^2| = 1/2 at x = -+ sqrt(3/2) and -+ sqrt(1/2): parabolas, which are exact."""
        times = [0.1 * k for k in range(40)]
        found = check.crossings(times, [1.0 - (t - 1.93) ** 2 for t in times], 0.5)
        expected = [-math.sqrt(1.5), -math.sqrt(0.5), math.sqrt(0.5), math.sqrt(1.5)]
        self.assertEqual([event.kind for event in found], ["stick", "slip", "stick", "slip"])
        for event, x in zip(found, expected):
            self.assertAlmostEqual(event.time - 1.93, x, delta=1e-12)

    def test_kick(self) -> None:
        """A jump through zero is at the time of the kick, in rows on either side of it and at it."""
        header, rows = answer_samples("19")
        for chosen in (rows, [row for row in rows if abs(row[0] - 0.1) > 1e-9]):
            event = self.check("19", self.table(header, chosen))["events"][0]
            self.assertEqual((event["kind"], event["error"]), ("reversal", 0.0))

    def test_start_in_slip(self) -> None:
        """What slips at once from rest has no event there."""
        header, rows = answer_samples("04")
        self.assertEqual(rows[0][2], 0.0)
        document = self.check("04", self.table(header, rows))
        self.assertEqual(document["events"][0]["kind"], "stick")
        self.assertEqual(document["sequence"]["spurious"], 0)

    def test_alignment(self) -> None:
        """Against every alignment there is, of short sequences."""
        source = random.Random(3)
        for _ in range(200):
            reference, candidate = [
                sorted((source.uniform(0.0, 3.0), source.choice(("stick", "slip"))) for _ in range(source.randrange(6)))
                for _ in range(2)
            ]
            sides = [
                [check.Event(k, time, kind) for k, (time, kind) in enumerate(side)] for side in (reference, candidate)
            ]
            cost, pairs = check.align_shifted(sides[0], sides[1], 0.0, 0.25)
            self.assertAlmostEqual(cost, least_cost(reference, candidate, 0.25), delta=1e-2)
            self.assertAlmostEqual(cost, sum(pair_cost(reference, candidate, pair, 0.25) for pair in pairs), delta=1e-2)
            self.assertEqual([r for r, _ in pairs if r is not None], list(range(len(reference))))
            self.assertEqual([c for _, c in pairs if c is not None], list(range(len(candidate))))

    def test_alignment_of_equal_costs(self) -> None:
        """Unrelated times cost the same however far apart; of equal ones the last is matched, and no shift is taken."""

        def aligned(reference: Sequence[Tuple[float, str]], candidate: Sequence[Tuple[float, str]]) -> List[Any]:
            sides = [[check.Event(k, *event) for k, event in enumerate(side)] for side in (reference, candidate)]
            return [pair for pair in check.align(sides[0], sides[1], 1.0) if None not in pair]

        turns = [(float(k), ("slip", "stick")[k % 2]) for k in range(7)]
        found = aligned(turns, [turns[0], turns[1], (2.9, "slip"), turns[5], turns[6]])
        self.assertEqual(found, [(0, 0), (1, 1), (4, 2), (5, 3), (6, 4)])
        self.assertEqual(aligned([(1.0, "slip"), (2.0, "slip")], [(1.0, "slip")]), [(0, 0)])

    def test_alignment_of_long_sequences(self) -> None:
        """What is equal at both ends needs no table."""
        turns = [check.Event(k, float(k), ("slip", "stick")[k % 2]) for k in range(3000)]
        for at in (1, 2998):
            other = turns[:at] + [check.Event(at, float(at), "reversal")] + turns[at + 1 :]
            pairs = check.align(turns, other, 1.0)
            self.assertEqual([pair for pair in pairs if None in pair], [(None, at), (at, None)])

    def test_alignment_of_more_than_its_table_holds(self) -> None:
        """The rest has no partner."""
        reference = [check.Event(k, 10.0 + k, "stick") for k in range(1023)]
        candidate = [check.Event(k, 1e-3 * k, "slip") for k in range(2000)]
        with unittest.mock.patch.object(check, "MOST_CELLS", 1 << 20):
            cost, pairs = check.align_shifted(reference, candidate, 0.0, 0.25)
        self.assertEqual((cost, len(pairs)), (3023.0, 3023))
        self.assertEqual(pairs[-1], (None, 1999))

    def samples(self, times: List[float], columns: Dict[str, List[float]]) -> Any:
        """Rows beside a grid with an interval of 0.1 s."""

        grid, rows = types.SimpleNamespace(times=[0.1 * k for k in range(-5, 40)]), check.Table("rows")
        rows.times = array("d", times)
        rows.columns = {name: array("d", values) for name, values in columns.items()}
        return check.Samples(grid, rows)  # type: ignore[arg-type]

    def test_interpolation(self) -> None:
        """A cubic of the time is found anywhere within the rows, also near their ends, and nothing outside."""
        times = [0.0, 0.4, 0.5, 0.9, 1.3, 1.4, 2.0]
        samples = self.samples(times, {"x": [t**3 - t for t in times], "y": [t * t for t in times]})
        for t in (0.45, 0.7, 1.0, 1.35):
            self.assertAlmostEqual(samples.at("x", t), t**3 - t, delta=1e-14)
        for t in (0.0, 0.1, 1.7, 2.0):
            self.assertAlmostEqual(samples.at("y", t), t * t, delta=1e-14)
        self.assertIsNone(samples.at("x", -0.1))
        self.assertIsNone(samples.at("x", 2.1))
        self.assertEqual(samples.at("x", 2.0 + 1e-11), 6.0)
        self.assertIsNone(samples.at("x", 2.0 + 1e-9))

    def test_extremum(self) -> None:
        """By a parabola, but not at a rest, and only where the rows cover the interval."""
        times = [0.1 * k for k in range(31)]
        columns = {"x": [2.0 - (t - 1.234) ** 2 for t in times], "y": [min(t, 1.0) for t in times]}
        samples = self.samples(times, columns)
        self.assertAlmostEqual(samples.extremum("x", 1.0, 0.5, 2.0), 2.0, delta=1e-14)
        self.assertAlmostEqual(samples.extremum("x", -1.0, 0.5, 2.0), 2.0 - 0.766**2, delta=1e-2)
        self.assertEqual(samples.extremum("y", 1.0, 0.5, 2.0), 1.0)
        uneven = [t * t / 3.0 for t in times]
        bent = self.samples(uneven, {"x": [2.0 - (t - 1.234) ** 2 for t in uneven]})
        self.assertAlmostEqual(bent.extremum("x", 1.0, 0.5, 2.0), 2.0, delta=1e-14)
        self.assertIsNone(samples.extremum("x", 1.0, 0.5, 3.5))

    def test_extremum_in_a_summary(self) -> None:
        """Of a problem of its own, whose values are of all three kinds."""
        folder = self.problem(
            [
                {
                    "name": "largest",
                    "unit": "m",
                    "value": 0.03 + 0.01 * math.sqrt(2.0),
                    "from": "extremum",
                    "column": "x",
                    "what": "maximum",
                    "between": [0.1, 0.6],
                },
                {
                    "name": "last",
                    "unit": "m",
                    "value": belt(1.0)[0],
                    "from": "samples",
                    "column": "x",
                    "time": 1.0,
                    "digits": 5,
                },
                {"name": "stick", "unit": "s", "value": 0.2, "from": "events", "first": 1, "last": 2, "count": 1},
            ]
        )
        document = self.check(folder, self.table("time,x,v", belt_rows()))
        largest, last, stick = document["summary"]
        self.assertLess(abs(largest["error"]), 1e-8)
        self.assertGreater(largest["digits"], 6.0)
        self.assertEqual(last["digits"], 5)
        self.assertLess(abs(stick["error"]), 1e-6)
        self.assertEqual(document["events"][0]["floor"], 1e-3)
        self.assertAlmostEqual(document["events"][0]["digits"], -math.log10(1e-3 / 0.5), delta=1e-12)
        # A column that stands still has no digits, and the others have.
        path = self.table("time,x,v,still", ([t, x, v + 1e-6, 1.5] for t, x, v in belt_rows()), name="still.csv")
        columns = self.check(folder, path, "--require", "samples=4")["samples"]["columns"]
        self.assertIsNone(columns[2]["digits"])
        self.check(folder, path, "--require", "samples=6", status=1)
        # Two values are lacking.
        self.check(folder, self.table("time,kind", belt_events(1.0)), "--require", "summary=1", status=1)

    def problem(self, summary: List[Dict[str, Any]], end: float = 1.0, count: int = 100) -> str:
        """The belt as a problem, with events to 1 ms and a time scale of 0.5 s."""
        folder = self.path("problem")
        os.mkdir(folder)
        data = {
            "set": "1.0",
            "problem": "belt",
            "title": "Belt",
            "motion": "translation",
            "end_time": end,
            "time_scale": 0.5,
            "columns": [{"name": "x", "unit": "m"}, {"name": "v", "unit": "m/s"}, {"name": "still", "unit": "m"}],
            "position": "x",
            "relative_velocity": {"constant": 0.1, "v": -1.0},
            "leaves_rest": "linear",
            "threshold": None,
            "starts_in_slip": False,
            "grid": [{"from": 0, "to": end, "step": end / count}],
            "system": {"kicks": []},
        }
        self.write("problem/problem.json", json.dumps(data))
        self.write("problem/summary.json", json.dumps({"values": summary}))
        events = [(k, time, kind, 1e-3) for k, (time, kind) in enumerate(belt_events(end))]
        self.table("event,time,kind,time_uncertainty", events, name="problem/events.csv")
        rows = [[t, *belt(t), 1.0] for t in steps(end, count)]
        self.table("time,x,v,still", rows, name="problem/samples.csv")
        return folder

    def test_scores_of_a_known_error(self) -> None:
        """A constant error is the rms of the position and of the rests; a creep is itself."""
        rows = [[t, x + 3e-4, v + 2e-9] for t, x, v in belt_rows(1000)]
        document = self.check("09", self.table("time,x,v", rows))
        scores = document["scores"]
        self.assertAlmostEqual(scores["position"]["rms"], 3e-4, delta=1e-12)
        self.assertAlmostEqual(scores["rest"]["rms"], 3e-4, delta=1e-12)
        self.assertAlmostEqual(scores["creep"]["rms"], 2e-9, delta=1e-14)
        self.assertEqual(scores["rest"]["sticks"], 15)
        x = [belt(t)[0] for t in steps(10.0, 1000)]
        mean = sum(x) / len(x)
        size = math.sqrt(sum((value - mean) ** 2 for value in x) / len(x))
        self.assertAlmostEqual(scores["position"]["size"], size, delta=1e-14)
        self.assertAlmostEqual(scores["position"]["relative"], 3e-4 / size, delta=1e-10)
        column = document["samples"]["columns"][0]
        self.assertAlmostEqual(column["digits"], -math.log10(3e-4 / size), delta=1e-9)
        speed = math.sqrt(sum((0.1 - belt(t)[1]) ** 2 for t in steps(10.0, 1000)) / 1001)
        self.assertAlmostEqual(scores["creep"]["size"], speed, delta=1e-12)
        quarters = [t for t in steps(10.0, 1000) if 0.05 <= math.fmod(t, PERIOD) <= 0.15]
        self.assertEqual(scores["creep"]["points"], len(quarters))

    def test_nearest_point(self) -> None:
        """Of two the earlier one."""
        found = [check.nearest_index([0.0, 1.0, 2.0], time) for time in (-1.0, 0.0, 0.4, 0.5, 0.6, 1.5, 2.0, 3.0)]
        self.assertEqual(found, [0, 0, 0, 0, 1, 1, 2, 2])

    def test_rest_within_the_sticks(self) -> None:
        """A stick between two points of the grid has none in it."""
        folder = self.problem([], 10.0, 25)
        sticks = [(k * PERIOD, k * PERIOD + 0.2) for k in range(15)]
        grid = [0.4 * k for k in range(26)]
        near = [(a, b, min(grid, key=functools.partial(distance, 0.5 * (a + b)))) for a, b in sticks]
        within = sum(a <= t <= b for a, b, t in near)
        self.assertTrue(0 < within < len(sticks), within)
        self.assertEqual(self.check(folder, self.table("time,x,v", belt_rows()))["scores"]["rest"]["sticks"], within)

    def test_largest_error(self) -> None:
        """Where it is."""
        rows = [[t, x + (0.01 if abs(t - 4.0) < 1e-9 else 0.001), v] for t, x, v in belt_rows(1000)]
        column = self.check("09", self.table("time,x,v", rows))["samples"]["columns"][0]
        self.assertAlmostEqual(column["largest"], 0.01, delta=1e-12)
        self.assertEqual(column["largest_at"], 4.0)

    def test_period_of_a_noisy_crossing(self) -> None:
        """One that is not approached from well below does not count; only a value named period asks for one."""
        times = [0.05 * k for k in range(200)]
        values = [math.sin(2.0 * t) + 0.1 * (-1) ** k for k, t in enumerate(times)]
        self.assertAlmostEqual(check.mean_period(times, values, 0.0, 0.7) or math.nan, math.pi, delta=0.1)
        path = self.table("time,x,v", belt_rows())
        self.assertIsNone(self.check(self.problem([], 10.0, 1000), path)["scores"]["period"])
        self.assertIsNotNone(self.check("09", path)["scores"]["period"])

    def test_period_score(self) -> None:
        """A clock that is a thousandth slow."""
        document = self.check("09", self.table("time,x,v", ([1.001 * t, *belt(t)] for t in steps(10.0, 2000))))
        self.assertAlmostEqual(document["scores"]["period"]["relative"], 1e-3, delta=2e-4)
        self.assertGreater(document["scores"]["period"]["error"], 0.0)

    def test_rows_at_one_time(self) -> None:
        """The last one counts."""
        rows = belt_rows()
        doubled = [row for k, row in enumerate(rows) for row in ([[row[0], 9.0, 9.0], row] if k % 50 == 0 else [row])]
        document = self.check("09", self.table("time,x,v", doubled), "--require", "samples=12", "--require", "digits=6")
        self.assertEqual(document["candidate"]["repeated_times"], 41)
        self.assertEqual(document["candidate"]["rows"], 2001)


def distance(a: float, b: float) -> float:
    """Of two times."""
    return abs(a - b)


def pair_cost(
    reference: Sequence[Tuple[float, str]],
    candidate: Sequence[Tuple[float, str]],
    pair: Tuple[Optional[int], Optional[int]],
    related: float,
) -> float:
    """Cost of a pair, or of an event alone."""
    r, c = pair
    if r is None or c is None:
        return 1.0
    if reference[r][1] != candidate[c][1]:
        return math.inf
    return min(abs(reference[r][0] - candidate[c][0]) / related, 1.0)


def least_cost(reference: Sequence[Tuple[float, str]], candidate: Sequence[Tuple[float, str]], related: float) -> float:
    """Cost of the cheapest alignment, by trying all."""
    if not reference or not candidate:
        return float(len(reference) + len(candidate))
    return min(
        pair_cost(reference, candidate, (0, 0), related) + least_cost(reference[1:], candidate[1:], related),
        1.0 + least_cost(reference[1:], candidate, related),
        1.0 + least_cost(reference, candidate[1:], related),
    )


# --- Requirements and outputs -----------------------------------------------------------------------------------------


class Outputs(Case):
    """Exit status, JUnit, JSON and text."""

    def test_requirements_are_read(self) -> None:
        """With every sign; and what is none is refused."""
        read = check.parse_requirements(
            ["digits=6", "rest = 1e-3", "missing<2", "samples>=3", "budget"], {"events": {"digits": 9.0}}
        )
        self.assertEqual([r.text() for r in read], ["digits>=6", "rest<=0.001", "missing<2", "samples>=3", "digits>=9"])
        self.assertEqual([r.is_met(2.0) for r in read], [False, False, False, False, False])
        self.assertEqual([r.is_met(9.0) for r in read], [True, False, False, True, True])
        self.assertFalse(read[2].is_met(None))
        path = self.table("time,kind", belt_events())
        for text in ("digits", "digits=", "digits=six", "digits=nan", "speed=1", "digits==6", "6=digits"):
            self.assertIn(f'"{text}"', self.refused("09", path, f"--require={text}"))
        with self.assertRaisesRegex(check.BadInput, "no budget"):
            check.parse_requirements(["budget"], {"events": {}})

    def test_budget(self) -> None:
        """Its parts are for stated events and for samples; who has both is held to both."""
        events = self.table("time,kind", belt_events(), name="events.csv")
        samples = self.table("time,x,v", belt_rows())

        def required(folder: str, *arguments: str) -> List[str]:
            document = self.check(folder, *arguments, "--require", "budget")
            return [row["requirement"] for row in document["requirements"]]

        both = self.copy("09", budget={"events": {"digits": 9, "lacking": 0}, "samples": {"samples": 12, "lacking": 0}})
        self.assertEqual(required(both, samples), ["samples>=12", "lacking<=0"])
        self.assertEqual(required(both, samples, "--events", events), ["digits>=9", "lacking<=0", "samples>=12"])
        self.check(both, events, "--require", "budget", status=1)
        for budget in ({"events": {"digits": 9}}, {"events": {"digits": 9}, "samples": {}}):
            folder = self.copy("09", budget=budget)
            self.assertEqual(required(folder, events), ["digits>=9"])
            self.assertEqual(required(folder, samples, "--events", events), ["digits>=9"])
            self.assertIn("no budget for samples", self.refused(folder, samples, "--require", "budget"))
        self.assertIn("no budget for events", self.refused(self.copy("09", budget={}), events, "--require", "budget"))
        for wrong in ({"digits": 6}, {"events": 6}):
            self.assertIn("problem.json: cannot be used", self.refused(self.copy("09", budget=wrong), events))

    def test_lacking(self) -> None:
        """Points of the grid that no row covers; the sequence is another matter."""
        path = self.table("time,x,v", ([float(t), 0.0, 0.0] for t in range(40)))
        self.check("02", path, "--require", "lacking=61")
        self.check("02", path, "--require", "lacking=60", status=1)
        self.check("02", path, "--require", "lacking<61", status=1)
        document = self.check("02", self.table("time,kind", []), "--require", "lacking=100", status=1)
        self.assertIsNone(document["requirements"][0]["value"])

    def test_inputs_are_not_written_over(self) -> None:
        """By no other name either; nor is one file written twice."""
        samples = self.table("time,x,v", belt_rows(100))
        events = self.table("time,kind", belt_events(), name="events.csv")
        linked, second = self.path("linked.csv"), self.path("second.csv")
        os.symlink(samples, linked)
        os.link(events, second)
        before = [open_text(path) for path in (samples, events)]
        for option in ("--json", "--junit"):
            for path in (samples, events, linked, second, os.path.join(self.folder, ".", "mine.csv")):
                line = self.refused("09", samples, "--events", events, option, path)
                self.assertIn(f"{option} {path}: is the same file as", line)
                self.refused("99", samples, "--events", events, option, path)
        self.assertEqual([open_text(path) for path in (samples, events)], before)
        out = self.path("out")
        self.assertIn("give a file of its own", self.refused("09", samples, "--json", out, "--junit", out))
        other = os.path.join(self.folder, ".", "out")
        self.assertIn("give a file of its own", self.refused("09", samples, "--json", out, "--junit", other))
        self.assertFalse(os.path.exists(out))
        self.assertEqual(self.run_main("09", samples, "--json", os.devnull, "--junit", os.devnull)[0], 0)

    def test_pipes(self) -> None:
        """Are read once, from the beginning to the end."""
        text = open_text(self.table("time,x,v", belt_rows(), "\ufeff"))
        self.assertGreater(len(text), 10 * 4096)
        program = [sys.executable, os.path.join(HERE, "check.py"), "09", "/dev/stdin", "--json"]
        for data in (text, text.rstrip("\n")):
            done = subprocess.run(program, input=data.encode(), stdout=subprocess.PIPE, check=True)
            found = json.loads(done.stdout)
            self.assertEqual(found["candidate"]["rows"], 2001)
            self.assertTrue(found["sequence"]["agrees"])
        with unittest.mock.patch.object(check, "MOST_BYTES", 50):
            self.assertEqual(list(check.lines_of("a", b"1\n2", io.BytesIO(b"3\n" + 4 * b"456789012\n")))[1], b"23\n")
            with self.assertRaisesRegex(check.BadInput, "more than 50 bytes"):
                list(check.lines_of("a", b"1\n2", io.BytesIO(b"3\n" + 5 * b"456789012\n")))

    def test_junit(self) -> None:
        """A case for the sequence and for each requirement; also when it fails, and of what cannot be read."""
        late = self.table("time,kind", [(time + 1e-4, kind) for time, kind in belt_events()])
        report = self.path("report.xml")

        def cases(*arguments: str, status: int) -> Dict[str, List[str]]:
            self.assertEqual(self.run_main("09", *arguments, "--quiet", "--junit", report)[0], status)
            suite = ElementTree.parse(report).getroot()
            found = {case.get("name", ""): [child.tag for child in case] for case in suite}
            self.assertEqual(suite.get("tests"), str(len(found)))
            self.assertEqual(suite.get("failures"), str(sum(tags == ["failure"] for tags in found.values())))
            return found

        self.assertEqual(
            cases(late, "--require", "digits=3", "--require", "events=1e-5", status=1),
            {"sequence": [], "digits>=3": [], "events<=1e-05": ["failure"]},
        )
        wrong = self.table("time,kind", belt_events()[:-1], name="wrong.csv")
        self.assertEqual(cases(wrong, status=0), {"sequence": ["skipped"]})
        self.assertEqual(
            cases(wrong, "--require", "digits=3", status=1), {"sequence": ["failure"], "digits>=3": ["failure"]}
        )
        self.assertEqual(cases(self.path("none.csv"), status=2), {"input": ["error"]})

    def test_json(self) -> None:
        """To a file, beside the text; numbers are read back to the last bit, and there is no NaN."""
        target, path = self.path("out.json"), self.table("time,x,v", belt_rows())
        text = self.text("09", path, "--json", target)
        self.assertIn("The sequence agrees: 29 events", text)
        with open(target, encoding="utf-8") as file:
            document = json.load(file, parse_constant=self.fail)
        event = document["events"][3]
        self.assertEqual(event["error"], event["candidate_time"] - event["time"])
        self.assertEqual(
            event["floor"], max(float(answer("09", "events.csv")[3]["time_uncertainty"]), math.ulp(event["time"]))
        )
        self.assertEqual(event["digits"], -math.log10(max(abs(event["error"]), event["floor"]) / 0.6283185307179586))

    def test_text(self) -> None:
        """What was read, every event, the scores and the verdict."""
        path = self.table(
            "time,x,v,energy", ([*row, 0] for row in belt_rows()), "# solver: Mine\n# settings: rtol 1e-9\n"
        )
        text = self.text("09", path, "--require", "digits=6", "--require", "rest=1")
        for part in (
            "2001 rows, 0 to 10 s",
            "solver: Mine",
            "settings: rtol 1e-9",
            'columns ignored: "energy"',
            "  28      slip",
            "position",
            "creep",
            "period",
            "digits>=6: met (digits is 6.",
            "rest<=1: met",
            "sequence: met",
        ):
            self.assertIn(part, text)
        self.assertEqual(text.count("     stick  "), 14)

    def test_quiet(self) -> None:
        """Nothing but what is not met."""
        path = self.table("time,kind", belt_events())
        self.assertEqual(self.run_main("09", path, "--quiet", "--require", "digits=3"), (0, "", ""))
        status, out, err = self.run_main("09", path, "--quiet", "--require", "rest=3")
        self.assertEqual((status, out), (1, ""))
        self.assertIn("rest<=3: not met (rest does not exist)", err)

    def test_as_a_program(self) -> None:
        """Exit status, and no traceback, from another folder; also into a pipe that is closed."""
        program = [sys.executable, os.path.join(HERE, "check.py")]
        good = self.table("time,kind", belt_events())
        for arguments, status in (
            (["09", good, "--require", "digits=9"], 0),
            (["09", good, "--require", "digits=17"], 1),
            (["09", self.path("none.csv")], 2),
            (["09"], 2),
            (["09", good, "--what"], 2),
        ):
            done = subprocess.run(
                program + arguments, check=False, cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE
            )
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertNotIn(b"Traceback", done.stderr)
        with subprocess.Popen(program + ["09", good], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdout is not None and process.stderr is not None
            process.stdout.close()
            self.assertNotIn(b"Traceback", process.stderr.read())

    def test_outputs_that_cannot_be_written(self) -> None:
        """Are named."""
        path = self.table("time,kind", belt_events())
        for option in ("--json", "--junit"):
            self.assertIn("cannot.be", self.refused("09", path, option, self.path("no/cannot.be")))

    def test_python_3_9(self) -> None:
        """The grammar is that of Python 3.9, and the lines fit."""
        with open(os.path.join(HERE, "check.py"), encoding="utf-8") as file:
            source = file.read()
        ast.parse(source, feature_version=(3, 9))
        self.assertEqual([line for line in source.splitlines() if len(line) > 120], [])


# --- In other projects ------------------------------------------------------------------------------------------------


class OtherProjects(Case):
    """The files of the folder ci."""

    @unittest.skipUnless(shutil.which("cmake") and shutil.which("ctest"), "needs CMake")
    def test_cmake(self) -> None:
        """The function is included by another project, which has several tests of one problem, in two folders."""
        ci = os.path.join(HERE, "ci")
        solver = f'"{sys.executable}" "{ci}/example_solver.py"'
        self.write("CMakeLists.txt", f"""cmake_minimum_required(VERSION 3.20)
project(other LANGUAGES NONE)
enable_testing()
add_subdirectory(inner)
friction_test(01 a.csv REQUIRE samples=9 position=1e-9 COMMAND {solver} a.csv)
friction_test(01 b.csv EVENTS e.csv REQUIRE budget digits=12 COMMAND {solver} b.csv e.csv)
friction_test(01 c.csv REQUIRE rest=1e-30 COMMAND {solver} c.csv)
""")
        os.mkdir(self.path("inner"))
        self.write("inner/CMakeLists.txt", f'include("{ci}/FrictionTest.cmake")\n')
        build = self.path("build")
        commands = [["cmake", "-S", self.folder, "-B", build], ["ctest", "--test-dir", build]]
        done = [subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
                for command in commands]
        self.assertEqual(done[0].returncode, 0, done[0].stdout.decode())
        said = {line.split()[3]: "Passed" in line for line in done[1].stdout.decode().splitlines() if " Test #" in line}
        names = [f"{what}-01-{name}.csv" for name in "abc" for what in ("solve", "check")]
        self.assertEqual(said, {name: name != "check-01-c.csv" for name in names}, done[1].stdout.decode())
        suite = ElementTree.parse(os.path.join(build, "friction-01-b.csv.xml")).getroot()
        self.assertEqual([case.get("name") for case in suite][-1], "digits>=12")

    @unittest.skipUnless(shutil.which("bash"), "needs bash")
    def test_action(self) -> None:
        """The commands of the action, with samples and events, with a result that fails, and with none."""
        commands = open_text(os.path.join(HERE, "ci", "action.yml")).partition("run: |\n")[2]
        script = self.write("action.sh", "".join(line[8:] for line in commands.splitlines(keepends=True)))
        samples = self.table("time,x,v", belt_rows(), name="samples.csv")
        events = self.table("time,kind", belt_events(), name="events.csv")
        summary = self.path("summary")
        environment = {**os.environ, "PROBLEM": "09", "PYTHON": sys.executable, "GITHUB_STEP_SUMMARY": summary,
                       "GITHUB_ACTION_PATH": os.path.join(HERE, "ci"), "GITHUB_OUTPUT": self.path("output")}
        for results, table, require, status, said in (
            (samples, events, "budget\nposition=1e-6\n", 0, "met. The sequence agrees"),
            (samples, "", "samples=6 digits=17", 1, "**not met**. The sequence agrees"),
            (self.path("none.csv"), "", "budget", 2, "**not checked**. check.py: "),
        ):
            chosen = {"RESULTS": results, "EVENTS": table, "REQUIRE": require}
            done = subprocess.run(["bash", "-e", "-o", "pipefail", script], env={**environment, **chosen}, check=False,
                                  cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            self.assertEqual(done.returncode, status, done.stdout.decode())
            self.assertIn(said, open_text(summary).splitlines()[-1])
            self.assertTrue(os.path.exists(self.path("friction-09.xml")))


# --- Input that cannot be used ----------------------------------------------------------------------------------------

BAD_FILES: List[Tuple[str, bytes, List[str]]] = [
    ("empty", b"", ["is empty", "time,x,v"]),
    ("comments alone", b"# solver: none\n\n", ["is empty"]),
    ("binary", b"\x89HDF\r\n\x1a\n\0\0\0", ["is binary", "export it as CSV"]),
    ("another encoding", "time,x,v\n".encode("utf-16"), ["UTF-16"]),
    ("no text", b"time,\xff\xfe\n1,2\n", ["line 1", "is no text"]),
    ("lines of an old Macintosh", b"time,x,v\r0,1,1\r1,1,1\r", ["line 1", "end in CR alone"]),
    ("no header", b"0,1,2\n1,2,3\n", ["line 1", "is no header"]),
    ("a header in a comment", b"# time,x,v\n0,1,2\n", ["line 2", "no header", "line 1 begins with # and is a comment"]),
    ("Kind", b"time,Kind\n0,slip\n", ["an events table needs a column named kind", 'rename "Kind"']),
    ("a type", b"time,type,force\n0,slip,1\n", ["an events table needs a column named kind", 'rename "type"']),
    ("semicolons", b"time;x;v\n0;1;2\n", ["line 1", "separate the columns by commas"]),
    ("another name of the time", b"t,x,v\n0,1,2\n1,1,1\n", ["line 1", 'rename "t" to time']),
    ("no time", b"x,v\n0,1\n1,2\n", ["line 1", "no column is named time", "time,x,v"]),
    (
        "unknown columns alone",
        b"time,force\n0,1\n1,2\n",
        ["line 1", "no column is one of x, v, relative_velocity", '"force"'],
    ),
    ("one name twice", b"time,x,x\n0,1,2\n", ["line 1", 'column "x"', "twice"]),
    ("header alone", b"time,x,v\n", ["has 0 rows", "need two"]),
    ("one row", b"time,x,v\n0,1,1\n", ["has 1 row of"]),
    ("ragged", b"time,x,v\n0,1,1\n1,2\n", ["line 3", "2 values for 3 columns"]),
    ("too long a row", b"time,x,v\n0,1,1,\n", ["line 2", "4 values for 3 columns"]),
    ("NaN", b"# by me\ntime,x,v\n0,1,1\n1,nan,1\n", ["line 4, column x", '"nan" is no finite number']),
    ("infinite", b"time,x,v\n0,1,1\n1,1,-inf\n", ["line 3, column v", "end the rows where the run has failed"]),
    ("too large", b"time,x,v\n0,1,1\n1,1,1e200\n", ["line 3, column v", '"1e200"']),
    ("too large together", b"time,x,v\n0,9e99,9e99\n1,1,1\n", ["line 2", "too large together"]),
    ("empty value", b"time,x,v\n0,,1\n1,1,1\n", ["line 2, column x", "is empty"]),
    ("a word", b"time,x,v\n0,one,1\n", ["line 2, column x", '"one"']),
    ("digits in groups", b"time,x,v\n0,1_000,1\n", ["line 2, column x", '"1_000"']),
    ("digits of another script", "time,x,v\n0,\u0661,1\n".encode(), ["line 2, column x"]),
    ("exponents of Fortran", b"time,x,v\n0,1.5D+02,1\n", ["line 2, column x", "write E for the exponent"]),
    (
        "times that go back",
        b"time,x,v\n0,1,1\n2,1,1\n1,1,1\n",
        ["line 4, column time", "1.0 comes after 2.0", "sort the rows"],
    ),
    ("two tables", b"time,x,v\n0,1,1\n1,1,1\ntime,x,v\n2,1,1\n", ["line 4", "a second header", "file of its own"]),
    ("two unlike tables", b"time,x,v\n0,1,1\n1,1,1\n\ntime,kind\n2,slip\n", ["line 5", "a second header"]),
    ("kinds by number", b"time,kind\n0.2,1\n", ["line 2, column kind", '"1"', "stick, slip or reversal"]),
    ("no kind", b"time,kind\n0.2,\n", ["line 2, column kind"]),
    ("unknown kinds alone", b"time,kind\n0.2,Haften\n0.4,Gleiten\n", ["column kind", '"haften"']),
    ("event without time", b"time,kind\nNaN,slip\n", ["line 2, column time"]),
    ("events out of order", b"time,kind\n2,slip\n1,stick\n", ["line 3, column time"]),
    (
        "threshold that is none",
        b"# threshold: small\ntime,x,v\n0,1,1\n1,1,1\n",
        ["line 1", '"small"', "# threshold: 1e-6"],
    ),
    ("threshold that is no number", b"# threshold: nan\ntime,x,v\n0,1,1\n1,1,1\n", ["line 1", '"nan"']),
    ("threshold below zero", b"# threshold: -1\ntime,x,v\n0,1,1\n1,1,1\n", ["line 1", '"-1"']),
    ("control characters", b"time,x,v\n0,\x1b[31mred,1\n", ["line 2, column x", '"?[31mred"']),
    ("one endless line", b"time,x,v\n0,1," + b"1" * 5000 + b"\n", ["line 2, column v"]),
    ("a quote that does not end", b'time,x,v\n0,"1,1\n', ["line 2", "2 values for 3 columns"]),
]


class BadInput(Case):
    """One line each, with file, place and remedy."""

    def test_bad_files(self) -> None:
        """Every file of the list, as it is and as a table of events beside good samples."""
        good = self.table("time,x,v", belt_rows(100), name="good.csv")
        for name, data, parts in BAD_FILES:
            with self.subTest(name):
                path = self.path("bad.csv")
                with open(path, "wb") as file:
                    file.write(data)
                line = self.refused("09", path)
                self.assertTrue(line.startswith(f"check.py: {path}: "), line)
                for part in parts:
                    self.assertIn(part, line)
                self.assertIn(path, self.refused("09", good, "--events", path))

    def test_files_that_cannot_be_opened(self) -> None:
        """None there, and a folder."""
        self.assertIn("No such file", self.refused("09", self.path("none.csv")))
        self.assertIn("directory", self.refused("09", self.folder))

    def test_a_huge_file(self) -> None:
        """Is not even opened."""
        path = self.path("huge.csv")
        with open(path, "wb") as file:
            file.truncate(check.MOST_BYTES + 1)
        self.assertIn(f"{check.MOST_BYTES + 1} bytes", self.refused("09", path))

    def test_a_threshold_above_all_speeds(self) -> None:
        """By it whatever slides is at rest; a table of events has no use for it."""
        slides = [[float(t), 5.0 * t, 5.0] for t in range(101)]
        for problem, speed in (("02", "0.01"), ("09", "")):
            for given in ("1e99", "7"):
                path = self.table("time,x,v", slides, before=f"# threshold: {given}\n")
                self.assertIn(f"above every speed of the problem, {speed}", self.refused(problem, path))
                path = self.table("time,x,v", slides)
                self.assertIn("give one that only rest is below", self.refused(problem, path, "--threshold", given))
        self.check("02", self.table("time,x,v", slides, before="# threshold: 0.01\n"), "--require", "digits=6", status=1)
        self.check("09", self.table("time,kind", belt_events()), "--threshold", "1e99")

    def test_a_million_columns(self) -> None:
        """The time follows their number."""
        names = ",".join(f"c{k}" for k in range(10**6))
        row = ",1" * 10**6
        document = self.check("02", self.write("wide.csv", f"time,v,{names}\n0,0{row}\n100,0{row}\n"))
        self.assertEqual(len(document["candidate"]["ignored_columns"]), 10**6)

    def test_tables_in_the_wrong_place(self) -> None:
        """Events where samples belong, and the other way round."""
        events = self.table("time,kind", belt_events(), name="events.csv")
        samples = self.table("time,x,v", belt_rows(100), name="samples.csv")
        self.assertIn("is an events table", self.refused("09", events, "--events", events))
        self.assertIn("has no column kind", self.refused("09", samples, "--events", samples))

    def test_a_damaged_problem(self) -> None:
        """Names the file that cannot be used."""
        folder = self.path("problem")
        os.mkdir(folder)
        path = self.table("time,kind", belt_events())
        for text in ("{", "[]", "{}"):
            self.write("problem/problem.json", text)
            self.assertIn("problem.json: cannot be used", self.refused(folder, path))
        shutil.rmtree(folder)
        shutil.copytree(os.path.join(HERE, FOLDERS[8]), folder)
        self.write("problem/summary.json", '{"values": [{"name": "a", "unit": "m", "value": 1, "from": "samples"}]}')
        self.assertIn("summary.json: cannot be used (KeyError('column')", self.refused(folder, path))

    def test_a_problem_that_is_no_text(self) -> None:
        """Quotes the line, not the file."""
        folder = self.copy("09")
        path = os.path.join(folder, "samples.csv")
        with open(path, "rb") as file:
            lines = file.read().split(b"\n")
        lines[3] = b"0.5,\xff\xfe,1"
        with open(path, "wb") as file:
            file.write(b"\n".join(lines))
        said = self.refused(folder, self.table("time,kind", belt_events()))
        self.assertIn("samples.csv: cannot be used", said)
        self.assertIn("line 4 is no UTF-8", said)
        self.assertLess(len(said), 400)

    def test_a_problem_with_wrong_values(self) -> None:
        """Each is refused in one line."""
        path, whole = self.table("time,x,v", belt_rows(100)), self.copy("09")
        self.run_main(whole, path)
        changes: Tuple[Dict[str, Any], ...] = (
            {"time_scale": 0}, {"time_scale": math.nan}, {"time_scale": -1}, {"end_time": math.inf}, {"end_time": 0},
            {"threshold": math.nan}, {"position": "y"}, {"relative_velocity": {"w": 1}}, {"budget": [1]},
            {"relative_velocity": {"v": math.inf}}, {"grid": [{"from": 0, "to": 1, "step": 0}]},
            {"budget": {"events": {"digits": math.inf}}}, {"end_time": 10**400}, {"columns": []},
        )
        for change in changes:
            with self.subTest(change):
                self.assertIn("problem.json: cannot be used", self.refused(self.copy("09", **change), path))
        value = {"name": "a", "unit": "s", "value": 1.0}
        events = {"from": "events", "first": 0, "last": 2, "count": 1}
        sample = {"from": "samples", "column": "x", "time": 1}
        extremum = {"from": "extremum", "column": "x", "what": "maximum", "between": [0, 1]}
        for good in (events, sample, extremum):
            self.write_text(whole, "summary.json", json.dumps({"values": [{**value, **good}]}))
            self.assertEqual(self.run_main(whole, path)[0], 0)
        for wrong in (
            {**events, "count": 0}, {**events, "first": []}, {**events, "value": math.nan}, {**sample, "column": "y"},
            {**sample, "time": math.inf}, {**sample, "digits": math.nan}, {**extremum, "between": [1, 1]},
            {**extremum, "between": [1]}, {**extremum, "column": "y"},
        ):
            with self.subTest(wrong):
                self.write_text(whole, "summary.json", json.dumps({"values": [{**value, **wrong}]}))
                self.assertIn("summary.json: cannot be used", self.refused(whole, path))
        self.write_text(whole, "summary.json", '{"values": []}')
        self.assertEqual(self.run_main(whole, path)[0], 0)
        for name, text in (
            ("problem.json", "[" * 100000), ("samples.csv", ""), ("samples.csv", "time,x,v\n"),
            ("samples.csv", "time,x,v\n0,1,1\n"), ("samples.csv", "time,x\n0,1\n1,1\n"),
            ("samples.csv", "time,x,v\n0,1,1\n1,nan,1\n"), ("samples.csv", "time,x,v\n0,1,1\n0,1,1\n"),
            ("samples.csv", "time,x,v\n0,1,1\n1,1\n"),
            ("events.csv", "event,time,kind,time_uncertainty\n0,inf,slip,0\n"),
            ("events.csv", "event,time,kind,time_uncertainty\n0,1,slip,nan\n"),
            ("events.csv", "event,time,kind,time_uncertainty\n0,1,jump,0\n"), ("events.csv", "event,time\n0,1\n"),
        ):
            with self.subTest((name, text[:60])):
                kept = open_text(os.path.join(whole, name))
                self.write_text(whole, name, text)
                self.assertIn(f"{name}: cannot be used", self.refused(whole, path))
                self.write_text(whole, name, kept)

    def write_text(self, folder: str, name: str, text: str) -> None:
        """A file of a problem."""
        self.write(os.path.join(os.path.basename(folder), name), text)

    def test_what_is_lenient(self) -> None:
        """A byte order mark, line ends of other systems, spaces, quotes, empty lines, and columns without a name."""
        head, rows = '\ufeff"time" , x,v,\r\n', "".join(f' {t!r} ,"{x!r}",{v!r},\r\n\r\n' for t, x, v in belt_rows())
        self.check("09", self.write("mine.csv", head + rows), "--require", "digits=6", "--require", "samples=12")

    def test_an_events_table_without_rows(self) -> None:
        """Is an answer: no event."""
        path = self.table("time,kind", [])
        self.check("02", path, "--require", "digits=6", "--require", "spurious=0")
        document = self.check("09", path, "--require", "digits=1", status=1)
        self.assertEqual(document["sequence"]["missing"], 29)
        self.assertEqual(self.check("09", self.table("time,kind", [[1.0, "kick"]]))["ignored_events"], {"kick": 1})
        path = self.table("time,kind", [[0.2, "slip"], [1.0, "\x1b[31mred"]])
        self.assertIn('ignored: 1 "?[31mred"', self.text("09", path))


if __name__ == "__main__":
    unittest.main()
