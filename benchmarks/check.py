#!/usr/bin/env python3
"""Holds a result of any solver against the answer of a problem of this set.

    python check.py 09 mine.csv
    python check.py 09 mine.csv --require digits=6 --junit report.xml

The rules are in scoring.md. Python 3.9 or newer; nothing else is needed.
Exit status: 0 the requirements are met; 1 one is not; 2 the input or the call is wrong.
"""

import argparse
import csv
import itertools
import json
import math
import os
import re
import sys
import xml.etree.ElementTree as ElementTree
from array import array
from bisect import bisect_left, bisect_right
from typing import Any, BinaryIO, Dict, Iterable, Iterator, List, NamedTuple, NoReturn, Optional, Sequence, Tuple

HERE = os.path.dirname(os.path.abspath(__file__))
KINDS = ("stick", "slip", "reversal")
OTHER_KINDS = ("kick", "corner", "separation", "contact")  # may stand in an events table, and are not compared
LIKE_KIND = ("kind", "kinds", "type", "event_kind", "event_type", "event kind", "event type", "event")
SUMMARY = {
    "events": ("first", "last", "count"), "samples": ("column", "time"), "extremum": ("column", "what", "between"),
}
DEFAULT_THRESHOLD = 1e-8
DEFAULT_HYSTERESIS = 2.0
LEAST_LIMIT = 0.01  # a threshold may be so large in a problem without higher speeds
SAME_TIME = 1e-9  # rows nearer to a grid point than this part of the grid's step are at it
LARGEST = 1e100  # of numbers; no power of them that is taken here overflows
MOST_BYTES = 1 << 30
FEWER = "write fewer rows, those at the times of samples.csv"
RELATED = 0.25  # times further apart than this part of the time scale are unrelated
MOST_CELLS = 64 << 20  # of the table of the alignment
MOST_EVENTS = 20000  # that are looked for in rows; more are chatter
PARTS = 8  # of an interval in which a zero is looked for
BISECTIONS = 60
BUDGETS = ("events", "samples")
COARSE = 4.0  # grid steps between rows from which they are too coarse
ROUNDING = 2.0 ** -53  # no relative error counts as smaller


class BadInput(Exception):
    """A file or a call that cannot be used; the text is one line, with the remedy."""


# --- Problems ---------------------------------------------------------------------------------------------------------


class Event(NamedTuple):
    """An event of the reference, with its number in events.csv, or of the candidate."""

    number: int
    time: float
    kind: str
    uncertainty: float = 0.0


class Problem:
    """A problem with its answer, from its folder."""

    def __init__(self, folder: str) -> None:
        """Reads problem.json, summary.json, events.csv and samples.csv."""
        name = "problem.json"
        try:
            data = json.loads(self.text(folder, name))
            self.set, self.name, self.title = str(data["set"]), str(data["problem"]), str(data["title"])
            self.end_time, self.time_scale = positive(data["end_time"]), positive(data["time_scale"])
            self.units = {str(c["name"]): str(c["unit"]) for c in data["columns"]}
            self.position = str(data["position"])
            self.velocity = {str(k): bounded(v) for k, v in data["relative_velocity"].items()}
            self.constant = self.velocity.pop("constant", 0.0)
            for column in (self.position, *self.velocity):
                self.units[column]
            self.linear = data["leaves_rest"] == "linear"
            self.threshold = None if data["threshold"] is None else bounded(data["threshold"])
            self.starts_in_slip = bool(data["starts_in_slip"])
            self.grid = [(bounded(g["from"]), bounded(g["to"]), positive(g["step"])) for g in data["grid"]]
            budget = data.get("budget") or {}
            if not set(budget) <= set(BUDGETS):
                raise ValueError(f"budget has other parts than {' and '.join(BUDGETS)}")
            self.budget = {part: {str(k): bounded(v) for k, v in budget.get(part, {}).items()} for part in BUDGETS}
            self.kicks = [bounded(kick["time"]) for kick in data["system"].get("kicks", [])]
            self.velocity_unit = "m/s" if data["motion"] == "translation" else "rad/s"
            name = "summary.json"
            self.summary: List[Dict[str, Any]] = list(json.loads(self.text(folder, name))["values"])
            for value in self.summary:
                self.check_value(value)
            name = "events.csv"
            rows = list(csv.DictReader(self.text(folder, name).splitlines()))
            self.events = [
                Event(int(r["event"]), bounded(r["time"]), r["kind"], bounded(r["time_uncertainty"])) for r in rows
            ]
            if any(event.kind not in KINDS for event in self.events):
                raise ValueError("an event is of no known kind")
            name = "samples.csv"
            rows = list(csv.DictReader(self.text(folder, name).splitlines()))
            self.times = array("d", (bounded(r["time"]) for r in rows))
            self.samples = {name: array("d", (bounded(r[name]) for r in rows)) for name in self.units}
            if len(rows) < 2 or any(b <= a for a, b in zip(self.times, self.times[1:])):
                raise ValueError("there are not two rows, or their times do not increase")
        except (OSError, ArithmeticError, LookupError, RecursionError, TypeError, ValueError, AttributeError) as error:
            path = os.path.join(folder, name)
            raise BadInput(f"{path}: cannot be used ({error!r}); take this file from the set again") from error
        self.samples.setdefault("relative_velocity", relative_velocity(self, self.samples, len(self.times)))

    def check_value(self, value: Dict[str, Any]) -> None:
        """Raises an error if a value of the summary cannot be used."""
        for key in ("name", "unit", *SUMMARY[value["from"]]):
            value[key]
        bounded(value["value"])
        if value.get("digits") is not None:
            bounded(value["digits"])
        if value["from"] == "events":
            int(value["first"]), int(value["last"]), positive(value["count"])
        elif value["column"] != "relative_velocity":
            self.units[value["column"]]
        if value["from"] == "extremum":
            start, end = (bounded(time) for time in value["between"])
            positive(end - start)
        elif value["from"] == "samples":
            bounded(value["time"])

    def budget_of(self, events: bool, samples: bool) -> Dict[str, Dict[str, float]]:
        """The parts of the budget for a candidate that states events, has samples, or both."""
        return {part: self.budget[part] for part, has in zip(BUDGETS, (events, samples)) if has}

    @staticmethod
    def text(folder: str, name: str) -> str:
        """A file of the folder."""
        with open(os.path.join(folder, name), "rb") as file:
            data = file.read()
        try:
            return data.decode("utf-8")
        except UnicodeDecodeError as error:
            start = data.rfind(b"\n", 0, error.start) + 1
            line = shown(data[start:start + 200].split(b"\n")[0].decode("utf-8", "replace"))
            raise ValueError(f"line {data.count(10, 0, start) + 1} is no UTF-8: {line}") from None


def bounded(value: Any) -> float:
    """A finite number of a problem."""
    result = float(value)
    if not abs(result) <= LARGEST:
        raise ValueError(f"{value!r} is no finite number")
    return result


def positive(value: Any) -> float:
    """A number above zero of a problem."""
    result = bounded(value)
    if result <= 0.0:
        raise ValueError(f"{value!r} is not above zero")
    return result


def find_problem(name: str) -> Problem:
    """The problem with this number, folder name or folder."""
    if os.path.isfile(os.path.join(name, "problem.json")):
        return Problem(name)
    folders = sorted(f for f in os.listdir(HERE) if os.path.isfile(os.path.join(HERE, f, "problem.json")))
    wanted = name.rstrip("/")
    for folder in folders:
        if wanted == folder or (wanted.isdigit() and wanted.zfill(2) == folder.split("-")[0]):
            return Problem(os.path.join(HERE, folder))
    known = ", ".join(folders) or f"none beside {os.path.basename(__file__)}"
    raise BadInput(f"{name}: no such problem; give a number, a folder with a problem.json, or one of: {known}")


def relative_velocity(problem: Problem, columns: Dict[str, "array[float]"], rows: int) -> "array[float]":
    """The relative velocity by the problem's linear combination, in the order of problem.json."""
    result = array("d", [problem.constant]) * rows
    for name, factor in problem.velocity.items():
        result = array("d", [known + factor * value for known, value in zip(result, columns[name])])
    return result


# --- Candidates -------------------------------------------------------------------------------------------------------


class Table:
    """A table of a candidate: samples, or events if it has a column `kind`."""

    def __init__(self, path: str) -> None:
        """An empty table."""
        self.path = path
        self.said: Dict[str, str] = {}
        self.commented = 0  # the number of a line that would be a header but for its #
        self.threshold: Optional[float] = None
        self.header: List[str] = []
        self.is_events = False
        self.times = array("d")
        self.columns: Dict[str, "array[float]"] = {}
        self.kinds: List[str] = []
        self.ignored: List[str] = []
        self.repeated = 0


def lines_of(path: str, start: bytes, file: BinaryIO) -> Iterator[bytes]:
    """The lines of a file whose first bytes have been read; no more of them than may be read."""
    head = start.split(b"\n")
    for line in head[:-1]:
        yield line + b"\n"
    last = head[-1] + file.readline()
    if last:
        yield last
    size = len(start)
    for line in file:
        size += len(line)
        if size > MOST_BYTES:
            raise BadInput(f"{path}: has more than {MOST_BYTES} bytes; {FEWER}")
        yield line


def read_table(path: str, problem: Problem) -> Table:
    """Reads a candidate's file."""
    table = Table(path)
    try:
        size = os.path.getsize(path)
        if size > MOST_BYTES:
            raise BadInput(f"{path}: has {size} bytes, and at most {MOST_BYTES} are read; {FEWER}")
        with open(path, "rb") as file:
            # What is read for a look at it is not read again: a pipe has no way back.
            start = file.read(4096)
            if start.startswith((b"\xff\xfe", b"\xfe\xff")):
                raise BadInput(f"{path}: is UTF-16; write it as UTF-8")
            if b"\0" in start:
                raise BadInput(f"{path}: is binary; export it as CSV, text with commas between the columns")
            read_rows(table, problem, lines_of(path, start[3 if start.startswith(b"\xef\xbb\xbf") else 0:], file))
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror or error}; give a CSV file that can be read") from error
    if table.is_events:
        known = [kind for kind in table.kinds if kind in KINDS or kind in OTHER_KINDS]
        if table.kinds and not known:
            found = shown(table.kinds[0])
            raise BadInput(f"{path}: column kind: none is stick, slip or reversal, the first is {found}; rename them")
    elif len(table.times) < 2:
        remedy = "write a row for each time of samples.csv"
        raise BadInput(f"{path}: has {counted(len(table.times), 'row')} of numbers, and samples need two; {remedy}")
    return table


def read_rows(table: Table, problem: Problem, lines: Iterable[bytes]) -> None:
    """Reads comments, the header and the rows."""
    path, wanted, columns, appends, kind_at, last = table.path, [], [], [], -1, -math.inf
    for number, raw in enumerate(lines, 1):
        if raw.startswith(b"#"):
            read_comment(table, raw, number)
            continue
        if not raw.strip():
            continue
        cells = raw.split(b",") if b'"' not in raw else split_quoted(raw)
        if not table.header:
            read_header(table, problem, cells, number)
            wanted = [table.header.index(name) for name in ("time", *table.columns)]
            columns = [table.times, *table.columns.values()]
            appends = [column.append for column in columns]
            kind_at = table.header.index("kind") if table.is_events else -1
            continue
        if len(cells) != len(table.header):
            refuse_row(table, cells, wanted, number)
        try:
            used = [cells[k] for k in wanted]
            values = list(map(float, used))
        except ValueError:
            refuse_row(table, cells, wanted, number)
        # The sum is not finite where a value is not; float() takes 1_000.
        if not sum(map(abs, values)) <= LARGEST or (b"_" in raw and b"_" in b",".join(used)):
            refuse_row(table, cells, wanted, number)
        time = values[0]
        if time <= last:
            if time < last:
                remedy = "sort the rows by time, and give one run in a file"
                raise BadInput(f"{path}: line {number}, column time: {time!r} comes after {last!r}; {remedy}")
            if kind_at < 0:
                # Of rows at one time the last one has the state right after an event.
                table.repeated += 1
                for column in columns:
                    column.pop()
        last = time
        for append, value in zip(appends, values):
            append(value)
        if kind_at >= 0:
            table.kinds.append(read_kind(table, cells[kind_at], number))
    if not table.header:
        raise BadInput(f"{path}: is empty; write a header, such as time,{','.join(problem.units)}, and rows")


def split_quoted(raw: bytes) -> List[bytes]:
    """The cells of a line, of which some are in quotes."""
    line = raw.decode("utf-8", "replace").rstrip("\r\n")
    return [cell.encode() for row in csv.reader([line], skipinitialspace=True) for cell in row]


def read_comment(table: Table, raw: bytes, number: int) -> None:
    """What a comment says of the solver; of several that say the same, the first counts."""
    line = raw.decode("utf-8", "replace").lstrip("#")
    if not table.commented and "," in line and "time" in [cell.strip() for cell in line.split(",")]:
        table.commented = number
    name, colon, text = line.partition(":")
    name, text = name.strip().lower(), text.strip()
    if not colon or name not in ("solver", "version", "settings", "threshold") or name in table.said:
        return
    table.said[name] = text
    if name == "threshold":
        words = text.split()
        table.threshold = to_float(words[0]) if words else None
        if table.threshold is None or not 0.0 <= table.threshold <= LARGEST:
            remedy = "write a speed in the problem's unit, such as # threshold: 1e-6"
            raise BadInput(f"{table.path}: line {number}: threshold {shown(text)} is no speed; {remedy}")


def read_header(table: Table, problem: Problem, cells: Sequence[bytes], number: int) -> None:
    """Finds the columns."""
    place = f"{table.path}: line {number}"
    try:
        table.header = [cell.decode("utf-8").strip() for cell in cells]
    except UnicodeDecodeError as error:
        raise BadInput(f"{place}: is no text; export it as CSV in UTF-8, with commas between the columns") from error
    if any("\r" in name for name in table.header):
        raise BadInput(f"{place}: its lines end in CR alone; end them in LF")
    named = [name for name in table.header if name]
    columns = list(dict.fromkeys((*problem.units, "relative_velocity")))
    example = f"begin with a line such as time,{','.join(problem.units)} or time,kind"
    if all(to_float(name) is not None for name in named):
        remedy = f"line {table.commented} begins with # and is a comment: write it without #"
        raise BadInput(f"{place}: is no header, but numbers; {remedy if table.commented else example}")
    if len(named) == 1 and re.search(r"[;\t ]", named[0]):
        raise BadInput(f"{place}: has no comma; separate the columns by commas, and write decimal points")
    seen = set()
    for name in named:
        if name in seen:
            raise BadInput(f"{place}, column {shown(name)}: stands there twice; leave one out or rename it")
        seen.add(name)
    if "time" not in named:
        near = [f"rename {shown(name)} to time" for name in named if name.lower().startswith("t")]
        raise BadInput(f"{place}: no column is named time, but {listed(named)}; {(near or [example])[0]}")
    table.is_events = "kind" in named
    used = ["kind"] if table.is_events else [name for name in columns if name in named]
    if not used:
        for name in named:
            if name.lower() in LIKE_KIND:
                raise BadInput(f"{place}: an events table needs a column named kind; rename {shown(name)} to kind")
        raise BadInput(f"{place}: no column is one of {', '.join(columns)}, but {listed(named)}; rename the columns")
    table.columns = {} if table.is_events else {name: array("d") for name in used}
    table.ignored = [name for name in named if name not in ("time", *used)]


def read_kind(table: Table, cell: bytes, number: int) -> str:
    """The kind of an event, in small letters."""
    kind = cell.decode("utf-8", "replace").strip().lower()
    if not kind or to_float(kind) is not None:
        remedy = "write stick, slip or reversal"
        raise BadInput(f"{table.path}: line {number}, column kind: {shown(kind)} is no kind of event; {remedy}")
    return kind


def refuse_row(table: Table, cells: Sequence[bytes], wanted: Sequence[int], number: int) -> NoReturn:
    """Says why a row cannot be used."""
    place, texts = f"{table.path}: line {number}", [cell.decode("utf-8", "replace").strip() for cell in cells]
    if "time" in texts:
        raise BadInput(f"{place}: a second header; write each table to a file of its own")
    if len(cells) != len(table.header):
        remedy = "give every row one value for each column"
        raise BadInput(f"{place}: {len(cells)} values for {len(table.header)} columns; {remedy}")
    for k in wanted:
        text, value = texts[k], to_float(texts[k])
        remedy = "write E for the exponent, or leave the column out"
        if value is not None:
            if abs(value) <= LARGEST:
                continue
            remedy = "end the rows where the run has failed"
        elif not re.fullmatch(r"[-+.\d]+[dD][-+\d]+", text):
            remedy = "write numbers with a decimal point, or leave the column out"
        what = f"{shown(text)} is no finite number" if text else "is empty"
        raise BadInput(f"{place}, column {table.header[k]}: {what}; {remedy}")
    raise BadInput(f"{place}: its values are too large together; check their units")


def to_float(text: str) -> Optional[float]:
    """A number, or None."""
    try:
        return float(text) if text.isascii() and "_" not in text else None
    except ValueError:
        return None


def shown(text: str) -> str:
    """A foreign text as a short one."""
    return '"' + printable(text if len(text) <= 40 else text[:37] + "...") + '"'


def printable(text: str) -> str:
    """A text on one line, without control characters."""
    return "".join(c if c.isprintable() else "?" for c in text)


def listed(names: Sequence[str]) -> str:
    """Foreign names, the first of them."""
    return ", ".join(shown(name) for name in names[:8]) + (", ..." if len(names) > 8 else "")


# --- Numbers: every operation in the order of scoring.md --------------------------------------------------------------


def quotient(a: float, b: float) -> float:
    """a/b by IEEE 754, also where b is zero."""
    if b != 0.0:
        return a / b
    return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def rms(values: Sequence[float]) -> float:
    """Root mean square; there is at least one value."""
    total = 0.0
    for value in values:
        total += value * value
    return math.sqrt(total / len(values))


def mean_and_size(values: Sequence[float]) -> Tuple[float, float]:
    """The mean, and the root mean square about it."""
    total = 0.0
    for value in values:
        total += value
    mean = total / len(values)
    return mean, rms([value - mean for value in values])


def relative(error: float, size: float) -> Optional[float]:
    """A magnitude of error in parts of a size; of no size there is none, but for no error."""
    if error == 0.0:
        return 0.0
    return error / size if size > 0.0 else None


def digits_of(error: Optional[float], floor: float = ROUNDING) -> Optional[float]:
    """Correct digits by a relative error."""
    return None if error is None else max(0.0, -math.log10(max(error, floor)))


def neville(points: Sequence[Tuple[float, float]], time: float) -> float:
    """The polynomial through points (time, value), by Neville's scheme."""
    values = [point[1] for point in points]
    for width in range(1, len(points)):
        for k in range(len(points) - width):
            near, far = points[k][0], points[k + width][0]
            part = (time - near) / (far - near)
            values[k] += part * (values[k + 1] - values[k])
    return values[0]


def first_zero(points: Sequence[Tuple[float, float]], end: float) -> Optional[float]:
    """The zero of the polynomial through points that is met first on the way from the first of them to `end`."""
    start, speed = points[0]

    def passed(time: float) -> bool:
        return neville(points, time) * speed <= 0.0

    def at(k: int) -> float:
        return start + (end - start) * k / PARTS

    for k in range(1, PARTS + 1):
        if passed(at(k)):
            low, high = at(k - 1), at(k)
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                if passed(middle):
                    high = middle
                else:
                    low = middle
            return 0.5 * (low + high)
    return None


def take_off(points: Sequence[Tuple[float, float]]) -> Optional[float]:
    """The time at which a velocity that grows as a x^2 + b x^3 was zero; as a x^2 if there are but two points."""
    if len(points) < 2:
        return None
    (tp, vp), (tq, vq) = points[0], points[1]
    if quotient(vq, vp) <= 1.0:
        return None
    ratio = math.sqrt(quotient(vp, vq))
    parabola = quotient(tp - ratio * tq, 1.0 - ratio)
    if len(points) < 3:
        return parabola
    tr, vr = points[2]

    def bend(zero: float) -> float:
        # v/(t - zero)^2 is a straight line through the points for the right zero.
        a = quotient(vp, (tp - zero) * (tp - zero))
        b = quotient(vq, (tq - zero) * (tq - zero))
        c = quotient(vr, (tr - zero) * (tr - zero))
        return (c - b) / (tr - tq) - (b - a) / (tq - tp)

    x, y = parabola, parabola - 0.01 * (tq - tp)
    f, g = bend(x), bend(y)
    for _ in range(20):
        z = y - quotient(g * (y - x), g - f)
        if not math.isfinite(z) or z >= tp or abs(z - parabola) > tq - tp:
            return parabola
        x, f = y, g
        y, g = z, bend(z)
        if abs(y - x) <= 1e-9 * (tq - tp) or g == 0.0:
            return y
    return parabola


class Found(NamedTuple):
    """An event found between two rows (times of both)."""

    time: float
    kind: str
    before: float
    after: float


class Detector:
    """Finds sticks, slips and reversals in a relative velocity, sample by sample."""

    def __init__(self, threshold: float, hysteresis: float, linear: bool) -> None:
        """`linear`: the relative velocity grows linearly after a breakaway."""
        self.threshold, self.leaves_at, self.linear = threshold, threshold * hysteresis, linear
        self.events: List[Found] = []
        self.phase, self.sense = "start", 0.0  # of a stick: the sense of the slip before it
        self.recent: List[Tuple[float, float]] = []  # the last four samples in slip, the latest first
        self.entry: Optional[Found] = None  # the stick under way, until its second sample reports it
        self.stick_last = 0.0
        self.after: List[Tuple[float, float]] = []  # the first samples after a stick of which the end is open
        self.left_at = 0.0  # the last sample of that

    def add(self, time: float, velocity: float) -> None:
        """Takes the next sample."""
        at_rest = abs(velocity) <= self.threshold
        if self.after:
            goes_on = not at_rest and (velocity > 0.0) == (self.after[0][1] > 0.0)
            if goes_on:
                self.after.append((time, velocity))
            if not goes_on or len(self.after) == (4 if self.linear else 3):
                self.break_away()
        if self.phase == "stick":
            if abs(velocity) > self.leaves_at:
                self.leave(time, velocity)
            else:
                self.report_entry()
                self.stick_last = time
        elif at_rest:
            self.entry = self.stop(time) if self.phase == "slip" else None
            self.phase, self.stick_last = "stick", time
        else:
            if self.phase == "slip" and velocity * self.sense < 0.0:
                self.events.append(self.crossing(time, velocity))
                self.recent = []
            self.phase, self.sense = "slip", math.copysign(1.0, velocity)
            self.recent = [(time, velocity)] + self.recent[:3]

    def finish(self) -> List[Found]:
        """The events, after the last sample."""
        if self.after:
            self.break_away()
        self.report_entry()
        return self.events

    def report_entry(self) -> None:
        """The stick under way has begun."""
        if self.entry is not None:
            self.events.append(self.entry)
            self.entry = None

    def leave(self, time: float, velocity: float) -> None:
        """A stick ends before this sample."""
        if self.entry is not None and velocity * self.sense < 0.0:
            # One sample at zero between two signs is a crossing that happened to be hit.
            self.events.append(Found(self.entry.time, "reversal", self.entry.before, time))
            self.entry = None
        else:
            self.report_entry()
            self.after, self.left_at = [(time, velocity)], self.stick_last
        self.phase, self.sense = "slip", math.copysign(1.0, velocity)
        self.recent = [(time, velocity)]

    def break_away(self) -> None:
        """The end of a stick, by the first samples after it."""
        after, last, first = self.after, self.left_at, self.after[0][0]
        zero = first_zero(after, last) if self.linear else take_off(after)
        if zero is None and self.linear and abs(neville(after, last)) < abs(after[0][1]):
            # The polynomial falls towards a zero before the last sample at rest.
            zero = last
        time = 0.5 * (last + first) if zero is None else zero
        self.events.append(Found(min(max(time, last), first), "slip", last, first))
        self.after = []

    def crossing(self, time: float, velocity: float) -> Found:
        """The change of sign between the last sample and this one."""
        last_time, last_velocity = self.recent[0]
        zero = first_zero(self.recent, time)
        if zero is None:
            zero = last_time + (time - last_time) * last_velocity / (last_velocity - velocity)
        return Found(zero, "reversal", last_time, time)

    def stop(self, time: float) -> Found:
        """The stick that begins between the last sample and this one."""
        zero = first_zero(self.recent, time) if len(self.recent) >= 2 else None
        return Found(time if zero is None else zero, "stick", self.recent[0][0], time)


def crossings(times: Sequence[float], velocities: Sequence[float], threshold: float) -> List[Found]:
    """Where |v_rel| passes a threshold: down as a stick, up as a slip; between samples by a parabola."""
    events: List[Found] = []
    recent: List[Tuple[float, float]] = []  # the last two samples, the latest first
    for time, velocity in zip(times, velocities):
        now = (time, abs(velocity) - threshold)
        if recent and (recent[0][1] > 0.0) != (now[1] > 0.0):
            b, c = recent[0], now
            slope = (c[1] - b[1]) / (c[0] - b[0])
            bend = 0.0
            if len(recent) == 2:
                a = recent[1]
                bend = (slope - (b[1] - a[1]) / (b[0] - a[0])) / (c[0] - a[0])
            low, high = b[0], c[0]
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                value = b[1] + (middle - b[0]) * (slope + bend * (middle - c[0]))
                if (value > 0.0) == (b[1] > 0.0):
                    low = middle
                else:
                    high = middle
            events.append(Found(0.5 * (low + high), "slip" if now[1] > 0.0 else "stick", b[0], c[0]))
            if len(events) >= MOST_EVENTS:
                break
        recent = [now] + recent[:1]
    return events


def find_events(problem: Problem, times: Sequence[float], velocities: Sequence[float], threshold: float,
                hysteresis: float) -> List[Found]:
    """The events of samples."""
    if problem.threshold is not None:
        return crossings(times, velocities, threshold)
    detector = Detector(threshold, hysteresis, problem.linear)
    for time, velocity in zip(times, velocities):
        detector.add(time, velocity)
        if len(detector.events) >= MOST_EVENTS:
            break
    found = detector.finish()
    if problem.starts_in_slip and found and found[0].kind == "slip" and found[0].time <= times[1]:
        # What slips from rest at once has v_rel = 0 in its first sample, which is no stick.
        del found[0]
    for k, event in enumerate(found):
        for kick in problem.kicks:
            # The time of a jump is given; samples on both sides do not show it.
            if event.kind != "stick" and event.before <= kick <= event.after:
                found[k] = event._replace(time=kick)
    return found


def start_contradicts(problem: Problem, times: Sequence[float], velocities: Sequence[float], threshold: float,
                      hysteresis: float) -> bool:
    """Whether samples slip from the start where the answer sticks there, or rest where it slips."""
    if problem.threshold is not None:
        return False
    first = problem.events[0].time if problem.events else math.inf
    end = bisect_left(times, first)  # of the rows before the first event of the answer
    if end < 2:
        return False
    if problem.starts_in_slip:
        return first > problem.times[1] and all(abs(velocity) <= threshold for velocity in velocities[:end])
    stuck = problem.samples["relative_velocity"][0] == 0.0
    return stuck and all(abs(velocity) > threshold * hysteresis for velocity in velocities[1:end])


Pair = Tuple[Optional[int], Optional[int]]


def align(reference: Sequence[Event], candidate: Sequence[Event], time_scale: float) -> List[Pair]:
    """Which event of the candidate stands for which one of the reference: indices, None where there is no partner."""
    if [r.kind for r in reference] == [c.kind for c in candidate]:
        return [(k, k) for k in range(len(reference))]
    shifts = [0.0]
    if reference and candidate:
        shifts += [candidate[0].time - reference[0].time, candidate[-1].time - reference[-1].time]
    least, best = math.inf, []
    for shift in shifts:
        cost, pairs = align_shifted(reference, candidate, shift, RELATED * time_scale)
        # A shift has to earn its place: the same cost without one is better.
        if cost < least - 1e-9:
            least, best = cost, pairs
    return best


def match_cost(r: Event, c: Event, shift: float, related: float) -> float:
    """Cost of matching two events; infinite if they are of different kinds."""
    return min(abs(c.time - r.time - shift) / related, 1.0) if r.kind == c.kind else math.inf


def align_shifted(reference: Sequence[Event], candidate: Sequence[Event], shift: float,
                  related: float) -> Tuple[float, List[Pair]]:
    """The cheapest alignment, and its cost: what is equal at both ends, and the table of the rest."""
    head, most = 0, min(len(reference), len(candidate))
    while head < most and match_cost(reference[head], candidate[head], shift, related) < 1e-3:
        head += 1
    tail = 0
    while tail < most - head and match_cost(reference[-1 - tail], candidate[-1 - tail], shift, related) < 1e-3:
        tail += 1
    r_end, c_end = len(reference) - tail, len(candidate) - tail
    cost, middle = align_middle(reference[head:r_end], candidate[head:c_end], shift, related)
    pairs: List[Pair] = [(k, k) for k in range(head)]
    pairs += [(None if r is None else head + r, None if c is None else head + c) for r, c in middle]
    pairs += [(r_end + k, c_end + k) for k in range(tail)]
    return cost, pairs


def align_middle(reference: Sequence[Event], candidate: Sequence[Event], shift: float,
                 related: float) -> Tuple[float, List[Pair]]:
    """The classical table of prefixes. Events beyond its largest size have no partner."""
    both, of_reference, of_candidate = 0, 1, 2
    rows = min(len(reference), MOST_CELLS)
    columns = min(len(candidate), MOST_CELLS // (rows + 1))
    width = columns + 1
    steps = bytearray([of_candidate]) * ((rows + 1) * width)
    above = [float(j) for j in range(width)]
    for i in range(1, rows + 1):
        left, diagonal = float(i), above[0]
        above[0] = left
        steps[i * width] = of_reference
        for j in range(1, width):
            best, step = above[j] + 1.0, of_reference
            if left + 1.0 < best:
                best, step = left + 1.0, of_candidate
            cost = match_cost(reference[i - 1], candidate[j - 1], shift, related)
            if diagonal + cost <= best:
                best, step = diagonal + cost, both
            diagonal = above[j]
            above[j] = left = best
            steps[i * width + j] = step
    total = above[columns] + (len(candidate) - columns) + (len(reference) - rows)
    pairs: List[Pair] = []
    i, j = rows, columns
    while i > 0 or j > 0:
        step = steps[i * width + j]
        i -= step != of_candidate
        j -= step != of_reference
        pairs.append((i if step != of_candidate else None, j if step != of_reference else None))
    pairs.reverse()
    pairs += [(k, None) for k in range(rows, len(reference))]
    pairs += [(None, k) for k in range(columns, len(candidate))]
    return total, pairs


class Samples:
    """A candidate's rows as functions of time."""

    def __init__(self, problem: Problem, table: Table) -> None:
        """`table` holds samples."""
        self.grid, self.times, self.columns = problem.times, table.times, table.columns

    def step(self, k: int) -> float:
        """The smaller interval beside grid point k."""
        grid = self.grid
        before = grid[k] - grid[k - 1] if k > 0 else math.inf
        after = grid[k + 1] - grid[k] if k + 1 < len(grid) else math.inf
        return min(before, after)

    def place(self, time: float, near: float) -> Optional[Tuple[int, int]]:
        """The rows from which a value at `time` follows, first and end; None outside of the rows."""
        times = self.times
        after = bisect_left(times, time)
        nearest = min(after, len(times) - 1)
        if after > 0 and (after == len(times) or time - times[after - 1] <= times[after] - time):
            nearest = after - 1
        if abs(times[nearest] - time) <= near:
            return nearest, nearest + 1
        if after == 0 or after == len(times):
            return None
        return max(after - 2, 0), min(after + 2, len(times))

    def value(self, name: str, place: Tuple[int, int], time: float) -> float:
        """The value of a column at `time`."""
        first, end = place
        column = self.columns[name]
        if end - first == 1:
            return column[first]
        return neville([(self.times[k], column[k]) for k in range(first, end)], time)

    def at(self, name: str, time: float) -> Optional[float]:
        """The value of a column at any time within the rows."""
        place = self.place(time, SAME_TIME * self.step(nearest_index(self.grid, time)))
        return None if place is None else self.value(name, place, time)

    def extremum(self, name: str, sign: float, start: float, end: float) -> Optional[float]:
        """The largest (sign 1) or smallest (-1) value from `start` to `end`, by the parabola through three rows."""
        times, column, near = self.times, self.columns[name], SAME_TIME * (end - start)
        first, last = bisect_left(times, start - near), bisect_right(times, end + near) - 1
        if first > last or times[0] > start + near or times[-1] < end - near:
            return None
        best = first
        for k in range(first + 1, last + 1):
            if sign * column[k] > sign * column[best]:
                best = k
        top = column[best]
        if first < best < last and column[best - 1] != top and column[best + 1] != top:
            before, after = times[best] - times[best - 1], times[best + 1] - times[best]
            rise, fall = (top - column[best - 1]) / before, (column[best + 1] - top) / after
            bend = (fall - rise) / (before + after)
            slope = (rise * after + fall * before) / (before + after)
            return top if bend == 0.0 else top - slope * slope / (4.0 * bend)
        return top


def nearest_index(times: Sequence[float], time: float) -> int:
    """The index of the nearest time; of two that are equally near, the earlier one."""
    after = bisect_left(times, time)
    if after == len(times) or (after > 0 and time - times[after - 1] <= times[after] - time):
        return after - 1
    return after


def mean_period(times: Sequence[float], values: Sequence[float], level: float, size: float) -> Optional[float]:
    """Mean time between upward crossings of a level that are approached from a quarter of the size below it."""
    below, first, last, count = False, 0.0, 0.0, 0
    for k in range(1, len(times)):
        a, b = values[k - 1], values[k]
        below = below or a < level - 0.25 * size
        if below and a < level <= b:
            last = times[k - 1] + (times[k] - times[k - 1]) * (level - a) / (b - a)
            if count == 0:
                first = last
            below, count = False, count + 1
    return (last - first) / (count - 1) if count > 1 else None


# --- The comparison ---------------------------------------------------------------------------------------------------


def check_threshold(problem: Problem, path: str, threshold: float) -> None:
    """Refuses a threshold above the speeds of the answer, by which whatever slides is at rest."""
    largest = max(LEAST_LIMIT, max(map(abs, problem.samples["relative_velocity"])))
    if threshold > largest:
        what = f"threshold {threshold:g} {problem.velocity_unit}: is above every speed of the problem, {largest:g}"
        raise BadInput(f"{path}: {what}; give one that only rest is below")


def compare(problem: Problem, main: Table, events: Optional[Table], threshold: Optional[float],
            hysteresis: float) -> Dict[str, Any]:
    """Everything that is said of a candidate, in the layout of scoring.md."""
    if events is not None and main.is_events:
        raise BadInput(f"{main.path}: is an events table; give it alone, or samples first and the events by --events")
    if events is not None and not events.is_events:
        raise BadInput(f"{events.path}: has no column kind; give a table with the columns time and kind by --events")
    stated, rows = main if main.is_events else events, None if main.is_events else main
    said = {**(events.said if events else {}), **main.said}
    known = (("problem", problem.threshold), ("option", threshold), ("file", main.threshold))
    source, used = next(((name, v) for name, v in known if v is not None), ("default", DEFAULT_THRESHOLD))
    if source in ("option", "file") and not stated:
        check_threshold(problem, main.path, used)
    span = (0.0, problem.end_time) if stated or not rows else (rows.times[0], rows.times[-1])
    result: Dict[str, Any] = {
        "set": problem.set, "problem": problem.name, "title": problem.title,
        "candidate": {
            "file": main.path, "events_file": events.path if events else None,
            "solver": said.get("solver"), "version": said.get("version"), "settings": said.get("settings"),
            "form": "events" if main.is_events else "samples and events" if events else "samples",
            "rows": len(main.times), "columns": list(main.columns), "ignored_columns": main.ignored,
            "repeated_times": main.repeated, "from": span[0], "to": span[1],
            "threshold": None if stated else used, "threshold_from": None if stated else source,
            "hysteresis": None if stated or problem.threshold is not None else hysteresis,
        },
        "ignored_events": {}, "notes": [],
    }
    if rows is not None and "relative_velocity" not in rows.columns and set(problem.velocity) <= set(rows.columns):
        rows.columns["relative_velocity"] = relative_velocity(problem, rows.columns, len(rows.times))
    found: Optional[List[Tuple[float, str]]] = None
    if stated is not None:
        found = [(time, kind) for time, kind in zip(stated.times, stated.kinds) if kind in KINDS]
        for kind in stated.kinds:
            if kind not in KINDS:
                result["ignored_events"][kind] = result["ignored_events"].get(kind, 0) + 1
    elif rows is not None and "relative_velocity" in rows.columns:
        velocities = rows.columns["relative_velocity"]
        found = [event[:2] for event in find_events(problem, rows.times, velocities, used, hysteresis)]
    matched, parting_place = compare_events(problem, found, span, result)
    if stated is None and rows is not None and found is not None and problem.threshold is None:
        velocities = rows.columns["relative_velocity"]
        contradicts = start_contradicts(problem, rows.times, velocities, used, hysteresis)
        result["sequence"]["start"] = "contradicts" if contradicts else "agrees"
        if contradicts:
            result["sequence"]["agrees"], result["digits"] = False, 0.0
    result.update({"samples": None, "scores": dict.fromkeys(("position", "period", "rest", "creep"))})
    samples = None if rows is None else Samples(problem, rows)
    if rows is not None and samples is not None:
        compare_samples(problem, samples, rows, result)
    result["summary"] = [compare_value(value, samples, matched) for value in problem.summary]
    if threshold is not None and (stated is not None or problem.threshold is not None):
        reason = "the events are stated" if stated is not None else "the problem has a threshold of its own"
        result["notes"].append(f"--threshold has no effect: {reason}.")
    add_outside(problem, found or [], stated is not None, result)
    add_notes(problem, rows, result)
    result["verdict"] = verdict(problem, parting_place, result)
    return result


def compare_events(problem: Problem, found: Optional[List[Tuple[float, str]]], span: Tuple[float, float],
                   result: Dict[str, Any]) -> Tuple[Dict[int, float], str]:
    """The sequence and the errors of its events.

    Returns the candidate's time by the number of the event, and in words where the sequences part.
    """
    reference = [event for event in problem.events if span[0] <= event.time <= span[1]]
    unknown = ("agrees", "candidate_events", "candidate_sticks", "missing", "spurious", "outside", "parts")
    sequence: Dict[str, Any] = {
        **dict.fromkeys(unknown), "reference_events": len(reference),
        "reference_sticks": [event.kind for event in reference].count("stick"),
        "uncovered": len(problem.events) - len(reference), "start": None, "unmatched": [],
    }
    result.update({"sequence": sequence, "events": [], "digits": None, "largest_event_error": None})
    if found is None:
        return {}, ""
    inside = [f for f in found if 0.0 < f[0] <= problem.end_time and span[0] <= f[0] <= span[1]]
    candidate = [Event(k, time, kind) for k, (time, kind) in enumerate(inside)]
    pairs = align(reference, candidate, problem.time_scale)
    missing, spurious = [r for r, c in pairs if c is None], [c for r, c in pairs if r is None]
    agrees = not missing and not spurious
    sequence.update({
        "agrees": agrees, "candidate_events": len(candidate), "missing": len(missing), "spurious": len(spurious),
        "candidate_sticks": [event.kind for event in candidate].count("stick"),
        "outside": len(found) - len(inside), "parts": None if agrees else parting(reference, candidate),
        "unmatched": [{"is": "missing", **brief(reference[r])} for r in missing[:10] if r is not None]
        + [{"is": "spurious", **brief(candidate[c])} for c in spurious[:10] if c is not None],
    })
    matched: Dict[int, float] = {}
    for r, c in pairs:
        if r is not None and c is not None:
            event, time = reference[r], candidate[c].time
            error, floor = time - event.time, max(event.uncertainty, math.ulp(event.time))
            matched[event.number] = time
            result["events"].append({
                **brief(event), "candidate_event": c, "candidate_time": time, "error": error, "floor": floor,
                "digits": digits_of(max(abs(error), floor) / problem.time_scale, 0.0),
            })
    if result["events"]:
        result["largest_event_error"] = max(abs(row["error"]) for row in result["events"])
        result["digits"] = min(row["digits"] for row in result["events"])
    if not agrees:
        result["digits"] = 0.0
    return matched, "" if agrees else first_unmatched(reference, candidate, pairs)


def first_unmatched(reference: Sequence[Event], candidate: Sequence[Event], pairs: Sequence[Pair]) -> str:
    """The first event without a partner in words, with that of the other side if there is one at the same place."""
    first = next(k for k, pair in enumerate(pairs) if None in pair)
    alone = list(itertools.takewhile(lambda pair: None in pair, pairs[first:]))
    ours = [reference[r] for r, _ in alone if r is not None]
    theirs = [candidate[c] for _, c in alone if c is not None]
    if not ours:
        return f"It parts where the candidate has {theirs[0].kind} at {theirs[0].time:.9g} s: the reference has none."
    text = f"It parts at event {ours[0].number} ({ours[0].kind} at {ours[0].time:.9g} s): the candidate has "
    return text + (f"{theirs[0].kind} at {theirs[0].time:.9g} s." if theirs else "none.")


def brief(event: Event) -> Dict[str, Any]:
    """An event in the document."""
    return {"event": event.number, "kind": event.kind, "time": event.time}


def parting(reference: Sequence[Event], candidate: Sequence[Event]) -> Dict[str, Any]:
    """Where the sequences of kinds differ first, with two events on either side."""
    at = 0
    while at < min(len(reference), len(candidate)) and reference[at].kind == candidate[at].kind:
        at += 1
    result: Dict[str, Any] = {"position": at}
    for name, events in (("reference", reference), ("candidate", candidate)):
        result[name] = brief(events[at]) if at < len(events) else None
        result[name + "_around"] = [brief(event) for event in events[max(at - 2, 0):at + 3]]
    return result


def compare_samples(problem: Problem, samples: Samples, rows: Table, result: Dict[str, Any]) -> None:
    """Errors of the columns at the points of the grid, and the scores without a threshold."""
    places = [samples.place(time, SAME_TIME * samples.step(k)) for k, time in enumerate(problem.times)]
    covered = [k for k, place in enumerate(places) if place is not None]
    times, at_rest = [problem.times[k] for k in covered], sticks(problem)
    columns: List[Dict[str, Any]] = []
    scores = result["scores"]
    result["samples"] = {"points": len(covered), "of": len(problem.times), "too_coarse": coarse(problem, rows.times),
                         "columns": columns}
    for name in rows.columns if covered else ():
        theirs = [samples.value(name, place, time) for time, place in zip(problem.times, places) if place is not None]
        ours = [problem.samples[name][k] for k in covered]
        errors = [c - r for c, r in zip(theirs, ours)]
        worst = max(range(len(errors)), key=lambda k: abs(errors[k]))
        size, error = mean_and_size(ours)[1], rms(errors)
        unit, part = problem.units.get(name, problem.velocity_unit), relative(error, size)
        if name in result["candidate"]["columns"]:
            columns.append({
                "name": name, "unit": unit, "largest": abs(errors[worst]), "largest_at": times[worst], "rms": error,
                "size": size, "relative": part, "digits": digits_of(part),
            })
            if part is not None and part > 0.1:
                add_factor(name, unit, ours, theirs, result)
        if name == problem.position:
            scores["position"] = {"unit": unit, "rms": error, "size": size, "relative": part}
            scores["period"] = period_score(problem, times, ours, theirs)
            middles = [(start, end, nearest_index(problem.times, 0.5 * (start + end))) for start, end in at_rest]
            by_point = dict(zip(covered, errors))
            rest = [by_point[k] for start, end, k in middles if k in by_point and start <= problem.times[k] <= end]
            if rest:
                error = rms(rest)
                scores["rest"] = {"unit": unit, "sticks": len(rest), "rms": error, "size": size,
                                  "relative": relative(error, size)}
        if name == "relative_velocity":
            slow: List[float] = []
            for start, end in at_rest:
                quarter = 0.25 * (end - start)
                first, last = bisect_left(times, start + quarter), bisect_right(times, end - quarter)
                slow.extend((theirs if problem.threshold is None else errors)[first:last])
            if slow:
                error, size = rms(slow), rms(ours)
                scores["creep"] = {"unit": unit, "points": len(slow), "rms": error, "size": size,
                                   "relative": relative(error, size)}


def coarse(problem: Problem, times: Sequence[float]) -> List[Dict[str, Any]]:
    """The pieces of the grid in which rows are far apart."""
    result = []
    for start, end, step in problem.grid:
        first, last = bisect_left(times, start), bisect_right(times, end)
        intervals = sorted(times[k] - times[k - 1] for k in range(first + 1, last))
        interval = intervals[len(intervals) // 2] if intervals else None
        overlaps = max(start, times[0]) < min(end, times[-1])
        if overlaps and (interval is None or interval > COARSE * step):
            result.append({"from": start, "to": end, "step": step, "interval": interval})
    return result


def period_score(problem: Problem, times: Sequence[float], ours: Sequence[float],
                 theirs: Sequence[float]) -> Optional[Dict[str, Any]]:
    """The error of the mean period, of a problem whose summary has one."""
    level, size = mean_and_size(ours)
    own, other = mean_period(times, ours, level, size), mean_period(times, theirs, level, size)
    if own is None or other is None or all(value["name"] != "period" for value in problem.summary):
        return None
    return {"unit": "s", "reference": own, "candidate": other, "error": other - own, "relative": abs(other - own) / own}


def sticks(problem: Problem) -> List[Tuple[float, float]]:
    """Where the reference sticks, also before its first event and after its last one."""
    events, result = problem.events, []
    starts_at_rest = not problem.starts_in_slip and (not events or events[0].kind == "slip")
    if problem.threshold is not None:
        starts_at_rest = starts_at_rest and abs(problem.samples["relative_velocity"][0]) <= problem.threshold
    begins = [0.0] if starts_at_rest else []
    for event in events:
        if begins:
            result.append((begins.pop(), event.time))
        if event.kind == "stick":
            begins.append(event.time)
    return result + [(begin, problem.end_time) for begin in begins]


def compare_value(value: Dict[str, Any], samples: Optional[Samples], matched: Dict[int, float]) -> Dict[str, Any]:
    """A value of the summary."""
    own: Optional[float] = None
    if value["from"] == "events":
        # Event -1 is t = 0.
        first, last = (0.0 if number == -1 else matched.get(number) for number in (value["first"], value["last"]))
        own = None if first is None or last is None else (last - first) / float(value["count"])
    elif samples is not None and value["column"] in samples.columns:
        if value["from"] == "extremum":
            sign = 1.0 if value["what"] == "maximum" else -1.0
            own = samples.extremum(value["column"], sign, *(float(time) for time in value["between"]))
        else:
            own = samples.at(value["column"], float(value["time"]))
    row = {"name": value["name"], "unit": value["unit"], "reference": float(value["value"]), "candidate": own,
           "error": None, "relative": None, "digits": None}
    if own is not None:
        row["error"] = own - row["reference"]
        row["relative"] = relative(abs(row["error"]), abs(row["reference"]))
        row["digits"] = digits_of(row["relative"])
        if row["digits"] is not None and value.get("digits") is not None:
            row["digits"] = min(row["digits"], float(value["digits"]))
    return row


def add_factor(name: str, unit: str, ours: Sequence[float], theirs: Sequence[float], result: Dict[str, Any]) -> None:
    """Notes that a column is the reference's but for a factor: it has another unit, or the other sign."""
    norm = sum(r * r for r in ours)
    factor = sum(c * r for c, r in zip(theirs, ours)) / norm if norm > 0.0 else 0.0
    left = sum((c - factor * r) * (c - factor * r) for c, r in zip(theirs, ours))
    known = (-1.0, 1e3, 1e-3, 1e2, 1e-2, 180.0 / math.pi, 30.0 / math.pi)
    if left < 0.01 * factor * factor * norm and any(abs(factor / k - 1.0) < 0.01 for k in known):
        check = "the sign" if factor < 0.0 else f"the unit, which has to be {unit}"
        result["notes"].append(f"Column {name} is {factor:.4g} times the reference's: check {check}.")


def add_outside(problem: Problem, found: Sequence[Tuple[float, str]], stated: bool,
                result: Dict[str, Any]) -> None:
    """Notes which events of the candidate are not compared."""
    early = sum(time <= 0.0 for time, _ in found)
    late = sum(time > problem.end_time for time, _ in found)
    said = [f"{counted(early, 'event')} at t = 0 or before"] if early else []
    said += [f"{counted(late, 'event')} after {problem.end_time:.6g} s"] if late else []
    if said:
        result["notes"].append(f"Not compared: {', '.join(said)}.")
    if stated and late and early + late == len(found):
        result["notes"].append("Is the time in seconds?")


def add_notes(problem: Problem, rows: Optional[Table], result: Dict[str, Any]) -> None:
    """What a person should know; notes change no number."""
    say, sequence, candidate = result["notes"].append, result["sequence"], result["candidate"]
    start, end = candidate["from"], candidate["to"]
    if rows is not None:
        if falls_short(problem, start, end):
            say(f"The rows go from {start:.6g} to {end:.6g} s, the answer's from {problem.times[0]:.6g} to "
                f"{problem.times[-1]:.6g} s.")
        if end > 10.0 * problem.end_time or end < 0.1 * problem.end_time:
            say("Is the time in seconds?")
        if sequence["agrees"] is None:
            lacking = [name for name in problem.velocity if name not in rows.columns]
            say(f"No event can be found: the relative velocity needs {', '.join(lacking)}.")
        if candidate["threshold"] is not None and sequence["spurious"] and sequence["candidate_events"] >= MOST_EVENTS:
            say(f"No more than {MOST_EVENTS} events were looked for: v_rel chatters about zero.")
        for piece in result["samples"]["too_coarse"]:
            interval = "more" if piece["interval"] is None else f"{piece['interval']:.3g} s"
            say(f"The rows are too coarse: from {piece['from']:.6g} to {piece['to']:.6g} s their interval is "
                f"{interval}, the grid's {piece['step']:.3g} s.")
    if candidate["threshold"] is not None:
        own, ours = sequence["candidate_sticks"], sequence["reference_sticks"]
        if rows is not None and problem.threshold is None and sequence["agrees"] is False and 2 * own < ours:
            slow = sorted(map(abs, rows.columns["relative_velocity"]))[len(rows.times) // 10]
            if slow > candidate["threshold"]:
                say(f"Few sticks were found: {own}, where the reference has {ours}. A tenth of the rows have |v_rel| "
                    f"below {slow:.3g} {problem.velocity_unit}: if it creeps in a stick, --threshold sets what counts "
                    "as rest.")
        missing = [event["event"] for event in sequence["unmatched"] if event["is"] == "missing"]
        unseen = [str(number) for number in missing if is_unseen(problem, rows, number)]
        if unseen:
            say(f"Between two rows lies a whole stick or slip of the reference (missing events {', '.join(unseen)}): "
                "give more rows, or the events by --events.")
    errors = [row["error"] for row in result["events"]]
    if len(errors) > 1 and max(abs(error) for error in errors) > 1e-6 * problem.time_scale:
        middle = 0.5 * (min(errors) + max(errors))
        if max(errors) - min(errors) <= 0.01 * abs(middle):
            late = "late" if middle > 0.0 else "early"
            say(f"All events are {late} by {abs(middle):.3g} s: does the clock begin at t = 0?")


def falls_short(problem: Problem, start: float, end: float) -> bool:
    """Whether a span lacks more than the time scale at either end."""
    return start > problem.times[0] + problem.time_scale or end < problem.times[-1] - problem.time_scale


def is_unseen(problem: Problem, rows: Optional[Table], number: int) -> bool:
    """Whether an event of the reference lies between two rows together with another one, or with a start in slip."""
    times = [0.0] + [event.time for event in problem.events]
    k = number + 1
    near = times[max(k - 1, 0):k + 2]
    after = [bisect_left(rows.times, time) for time in near] if rows else []
    return any(a == b for a, b in zip(after, after[1:])) or bool(after and number == 0 and after[1] == 1)


def verdict(problem: Problem, parting_place: str, result: Dict[str, Any]) -> str:
    """The outcome in words."""
    sequence = result["sequence"]
    if sequence["agrees"] is None:
        return "The sequence of events is not known: the candidate has neither events nor a relative velocity."
    rest = f" {counted(sequence['uncovered'], 'event')} of the reference not covered." if sequence["uncovered"] else ""
    if sequence["agrees"]:
        text = f"The sequence agrees: {counted(sequence['reference_events'], 'event')}"
        if result["events"]:
            worst = min(result["events"], key=lambda row: row["digits"])
            text += f", {result['digits']:.1f} digits (the fewest at event {worst['event']}, a {worst['kind']})"
        return text + "." + rest
    said = [f"A{fault[1:]}." for fault in faults_at_start(problem, sequence)]
    said += [parting_place] if parting_place else []
    numbers = f"{sequence['missing']} missing, {sequence['spurious']} spurious."
    return f"The sequence is wrong. {' '.join(said)} {numbers}{rest}"


def faults_at_start(problem: Problem, sequence: Dict[str, Any]) -> List[str]:
    """In words how the motion of the candidate contradicts the answer at the start, if it does."""
    own, other = ("rests", "slips") if problem.starts_in_slip else ("slips", "sticks")
    return [f"at t = 0: the candidate {own}, the answer {other}"] if sequence["start"] == "contradicts" else []


def counted(number: int, noun: str) -> str:
    """3 events, 1 event."""
    return f"{number} {noun}" + ("" if number == 1 else "s")


# --- Requirements -----------------------------------------------------------------------------------------------------

AT_LEAST = ("digits", "samples", "summary")
SCORES = ("position", "period", "rest", "creep", "rest_absolute", "creep_absolute")
COUNTS = ("missing", "spurious", "uncovered")
OF_SAMPLES = (*SCORES, "samples", "lacking")  # they do not depend on the sequence
METRICS = (*AT_LEAST, *COUNTS, "lacking", "events", *SCORES)


class Requirement(NamedTuple):
    """A bound on a metric."""

    metric: str
    comparator: str
    bound: float

    def text(self) -> str:
        """As it may be written on the command line."""
        return f"{self.metric}{self.comparator}{self.bound:.12g}"

    def is_met(self, value: Optional[float]) -> bool:
        """What does not exist meets no requirement."""
        if value is None:
            return False
        bound = self.bound
        return {"<": value < bound, "<=": value <= bound, ">": value > bound, ">=": value >= bound}[self.comparator]


def parse_requirements(texts: Sequence[str], budget: Dict[str, Dict[str, float]]) -> List[Requirement]:
    """Reads `NAME=NUMBER`, `NAME<NUMBER`, `NAME>NUMBER` (also <=, >=), or `budget`: what both parts say counts once."""
    result: List[Requirement] = []
    if "budget" in texts and not any(budget.values()):
        form = " and ".join(budget) or "this result"
        raise BadInput(f"--require budget: this problem has no budget for {form}; give a metric, such as --require "
                       "digits=6")
    whole = list(dict.fromkeys(f"{name}={bound!r}" for part in budget.values() for name, bound in part.items()))
    for text in texts:
        for part in whole if text == "budget" else [text]:
            found = re.fullmatch(r"\s*([a-z_]+)\s*(<=|>=|=|<|>)\s*(\S+)\s*", part)
            bound = to_float(found.group(3)) if found else None
            if found is None or bound is None or not math.isfinite(bound):
                raise BadInput(f"--require {shown(text)}: is no bound; write NAME=NUMBER, such as digits=6, or budget")
            name, sign = found.group(1), found.group(2)
            if name not in METRICS:
                raise BadInput(f"--require {shown(text)}: no metric is named {name}; there are {', '.join(METRICS)}")
            result.append(Requirement(name, (">=" if name in AT_LEAST else "<=") if sign == "=" else sign, bound))
    return result


def metric(result: Dict[str, Any], name: str) -> Optional[float]:
    """A number that can be required; None if it does not exist."""
    sequence, covered = result["sequence"], result["sequence"]["reference_events"]
    if name == "uncovered":
        return float(sequence["uncovered"])
    if name == "lacking":
        return float(result["samples"]["of"] - result["samples"]["points"]) if result["samples"] else None
    if name in ("missing", "spurious", "digits", "events"):
        if sequence["agrees"] is None or (covered == 0 and sequence["uncovered"] > 0):
            return None
        if name in COUNTS:
            return float(sequence[name])
        if covered == 0 and sequence["agrees"]:
            # Where there is no event, none errs.
            return math.inf if name == "digits" else 0.0
        name = "digits" if name == "digits" else "largest_event_error"
        return None if result[name] is None else float(result[name])
    if name in ("samples", "summary"):
        rows = result["summary"] if name == "summary" else result["samples"]["columns"] if result["samples"] else []
        digits = [row["digits"] for row in rows]
        if name == "samples":
            # A column that stands still in the reference has no relative error.
            digits = [value for value in digits if value is not None]
        return min(digits) if digits and None not in digits else None
    score = result["scores"][name.split("_")[0]]
    value = score and score["rms" if name.endswith("_absolute") else "relative"]
    return None if value is None else float(value)


def judge(problem: Problem, requirements: Sequence[Requirement], result: Dict[str, Any]) -> None:
    """Enters the requirements, whether the sequence is accepted, and the exit status."""
    sequence, candidate = result["sequence"], result["candidate"]
    result["requirements"] = [
        {"requirement": r.text(), "metric": r.metric, "comparator": r.comparator, "bound": r.bound,
         "value": metric(result, r.metric), "met": r.is_met(metric(result, r.metric))} for r in requirements]
    allowed = {r.metric: r.bound for r in requirements if r.comparator in ("<", "<=")}
    counts = {name: metric(result, name) for name in COUNTS}
    faults = [f"{name}: {'unknown' if value is None else int(value)}" for name, value in counts.items()
              if value is None or value > allowed.get(name, 0.0)]
    faults += faults_at_start(problem, sequence)
    if "uncovered" not in allowed and falls_short(problem, candidate["from"], candidate["to"]):
        faults.append(f"covered: {candidate['from']:.6g} to {candidate['to']:.6g} s")
    required = any(r.metric not in OF_SAMPLES for r in requirements)
    sequence.update({"required": required, "accepted": not faults, "faults": faults})
    met = all(row["met"] for row in result["requirements"]) and (not faults or not required)
    result["exit_status"] = 0 if met else 1


def outcomes(result: Dict[str, Any]) -> List[Tuple[str, str, str]]:
    """Name, outcome ("met", "not met" or "not required") and what it is, of the sequence and of each requirement."""
    sequence = result["sequence"]
    outcome = "met" if sequence["accepted"] else "not met" if sequence["required"] else "not required"
    said = [("sequence", outcome, ", ".join(sequence["faults"]) or "accepted")]
    for row in result["requirements"]:
        value = "does not exist" if row["value"] is None else f"is {row['value']:.6g}"
        said.append((row["requirement"], "met" if row["met"] else "not met", f"{row['metric']} {value}"))
    return said


# --- Output -----------------------------------------------------------------------------------------------------------


def text_of(value: Optional[float], form: str = ".3e") -> str:
    """A number that may be absent."""
    return "-" if value is None else format(value, form)


def table_lines(rows: Sequence[Sequence[str]]) -> List[str]:
    """Columns side by side, the first to the left, the others to the right; none if there is but a header."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = [[c.rjust(w) if k else c.ljust(w) for k, (c, w) in enumerate(zip(row, widths))] for row in rows]
    return ["  " + "  ".join(line) for line in lines] if len(rows) > 1 else []


def report(result: Dict[str, Any]) -> List[str]:
    """The outcome as lines of text."""
    candidate, sequence, found = result["candidate"], result["sequence"], result["samples"]
    lines = [f"Problem {result['problem']}, set {result['set']}: {result['title']}",
             f"{candidate['file']}: {candidate['form']}, {counted(candidate['rows'], 'row')}, "
             f"{candidate['from']:.9g} to {candidate['to']:.9g} s"]
    said = {name: candidate[name] for name in ("solver", "version", "settings") if candidate[name]}
    said.update({"events from": candidate["events_file"], "columns": ", ".join(candidate["columns"]),
                 "columns ignored": listed(candidate["ignored_columns"]),
                 "rows left out, of several at one time all but the last": candidate["repeated_times"]})
    lines += [f"  {name}: {printable(str(text))}" for name, text in said.items() if text]
    if sequence["agrees"] is not None:
        numbers = sequence["candidate_events"], sequence["reference_events"]
        lines += ["", "Events: {} of the candidate, {} of the reference".format(*numbers)]
        if candidate["threshold"] is not None:
            rest = f"|v_rel| up to {candidate['threshold']:.3g} is rest ({candidate['threshold_from']})"
            lines.append(f"  found in the rows: {rest}; their errors may be due to this, and to the rows' intervals")
        ignored = [f"{count} {shown(kind)}" for kind, count in sorted(result["ignored_events"].items())]
        lines += [f"  ignored: {', '.join(ignored[:9])}"] if ignored else []
        lines += table_lines([["event", "kind", "reference/s", "candidate/s", "error/s", "digits"]] + [
            [str(e["event"]), e["kind"], f"{e['time']:.12g}", f"{e['candidate_time']:.12g}", text_of(e["error"]),
             f"{e['digits']:.1f}"] for e in result["events"]])
    for event in sequence["unmatched"]:
        lines.append(f"  {event['is']}: {event['event']}, {event['kind']} at {event['time']:.9g} s")
    for side in ("reference", "candidate") if sequence["parts"] else ():
        each = [f"{e['event']} {e['kind']} {e['time']:.9g} s" for e in sequence["parts"][f"{side}_around"]]
        lines.append(f"  where the kinds first differ, {side}: {', '.join(each) or 'no event'}")
    if found is not None:
        lines += ["", f"Samples: {found['points']} of {found['of']} points of the grid"]
        lines += table_lines([["column", "largest error", "at/s", "rms error", "relative", "digits"]] + [
            [c["name"], f"{c['largest']:.3e} {c['unit']}", f"{c['largest_at']:.9g}", f"{c['rms']:.3e} {c['unit']}",
             text_of(c["relative"]), text_of(c["digits"], ".1f")] for c in found["columns"]])
        lines += table_lines([["score", "error", "relative"]] + [
            [name, f"{s.get('rms', s.get('error')):.3e} {s['unit']}", text_of(s["relative"])]
            for name, s in result["scores"].items() if s])
    if result["summary"]:
        lines += ["", "Summary", *table_lines([["value", "reference", "candidate", "error", "digits"]] + [
            [v["name"], f"{v['reference']:.12g} {v['unit']}", text_of(v["candidate"], ".12g"), text_of(v["error"]),
             text_of(v["digits"], ".1f")] for v in result["summary"]])]
    lines += ["", *result["notes"], result["verdict"]]
    lines += [f"{name}: {outcome} ({what})" for name, outcome, what in outcomes(result) if result["requirements"]]
    return lines + (["Give your events (--events) to have the solver judged, not its sampling."] if is_sampling(result)
                    else [])


def is_sampling(result: Dict[str, Any]) -> bool:
    """Whether events found in the rows have fewer digits, by one at least, than every column of the samples."""
    found, threshold = result["samples"], result["candidate"]["threshold"]
    if not found or threshold is None or not result["events"] or not result["sequence"]["agrees"]:
        return False
    digits = [column["digits"] for column in found["columns"] if column["digits"] is not None]
    return bool(digits) and bool(result["digits"] + 1.0 <= min(digits))


def finite(value: Any) -> Any:
    """A document in which numbers that JSON does not have are null."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def junit(name: str, cases: Sequence[Tuple[str, str, str]]) -> bytes:
    """Names, outcomes and messages in the format of JUnit."""
    elements, name = {"not met": "failure", "not required": "skipped", "error": "error"}, printable(name)
    suite = ElementTree.Element("testsuite", name=name, tests=str(len(cases)))
    for outcome, plural in (("not met", "failures"), ("error", "errors"), ("not required", "skipped")):
        suite.set(plural, str([case[1] for case in cases].count(outcome)))
    for title, outcome, message in cases:
        case = ElementTree.SubElement(suite, "testcase", classname=f"friction.{name}", name=title)
        if outcome in elements:
            ElementTree.SubElement(case, elements[outcome], message=printable(message))
    return bytes(ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True))


def write_file(path: str, data: bytes) -> None:
    """Writes a file."""
    try:
        with open(path, "wb") as file:
            file.write(data)
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}; give a file that can be written") from error


def is_same_file(a: str, b: str) -> bool:
    """Whether two paths lead to one file; a device or a pipe does not count."""
    try:
        if not all(os.path.isfile(path) or not os.path.exists(path) for path in (a, b)):
            return False
        return os.path.realpath(a) == os.path.realpath(b) or os.path.samefile(a, b)
    except (OSError, ValueError):
        return False


def check_outputs(options: argparse.Namespace) -> None:
    """Refuses to write over what is read, and to one file twice."""
    used = [path for path in (options.candidate, options.events) if path]
    for name, path in (("--junit", options.junit), ("--json", options.json)):
        if path and not (name == "--json" and path == "-"):
            for other in used:
                if is_same_file(path, other):
                    raise BadInput(f"{name} {path}: is the same file as {other}; give a file of its own")
            used.append(path)


def arguments() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="check.py", description="Holds a result against the answer of a problem. Rules: scoring.md.",
        epilog="Exit status: 0 the requirements are met; 1 one is not; 2 the input or the call is wrong.")
    parser.add_argument("problem", help="a number (09), a folder's name, or a folder with a problem.json")
    parser.add_argument("candidate", help="CSV: an events table (time, kind), or samples (time, the problem's columns)")
    parser.add_argument("--events", metavar="FILE", help="an events table beside the samples")
    parser.add_argument("--threshold", metavar="V", help="speed up to which v_rel counts as rest, in the problem's "
                        f"unit [default: what the file says, or {DEFAULT_THRESHOLD:g}]")
    parser.add_argument("--hysteresis", metavar="H", help="a stick ends where |v_rel| exceeds H times V [default: 2]")
    parser.add_argument("--require", metavar="BOUND", action="append", default=[],
                        help="digits=6, or budget for the problem's own, of events, samples or both; repeatable. "
                        "Metrics: " + ", ".join(METRICS))
    parser.add_argument("--junit", metavar="FILE", help="write the outcome as JUnit XML")
    parser.add_argument("--json", metavar="FILE", nargs="?", const="-", help="write one JSON document [to stdout]")
    parser.add_argument("--quiet", action="store_true", help="print nothing but what is not met")
    return parser


def setting(text: Optional[str], least: float, name: str) -> Optional[float]:
    """A number of the command line."""
    value = None if text is None else to_float(text)
    if text is not None and (value is None or not least <= value <= LARGEST):
        raise BadInput(f"--{name} {shown(text)}: is no number of at least {least:g}; give one")
    return value


def run(options: argparse.Namespace) -> Dict[str, Any]:
    """Reads, compares and judges."""
    problem = find_problem(options.problem)
    threshold, hysteresis = setting(options.threshold, 0.0, "threshold"), setting(options.hysteresis, 1.0, "hysteresis")
    table = read_table(options.candidate, problem)
    events = read_table(options.events, problem) if options.events else None
    budget = problem.budget_of(table.is_events or events is not None, not table.is_events)
    requirements = parse_requirements(options.require, budget)
    result = compare(problem, table, events, threshold, DEFAULT_HYSTERESIS if hysteresis is None else hysteresis)
    judge(problem, requirements, result)
    return result


def main(argv: Optional[Sequence[str]] = None) -> int:
    """The exit status."""
    options = arguments().parse_args(argv)
    try:
        check_outputs(options)
        try:
            result = run(options)
        except BadInput as error:
            if options.junit:
                write_file(options.junit, junit(os.path.basename(options.problem), [("input", "error", str(error))]))
            raise
        if options.junit:
            cases = [(name, outcome, f"{what}. {result['verdict']}") for name, outcome, what in outcomes(result)]
            write_file(options.junit, junit(result["problem"], cases))
        document = json.dumps(finite(result), indent=1, allow_nan=False) + "\n"
        if options.json and options.json != "-":
            write_file(options.json, document.encode())
        if options.json == "-":
            sys.stdout.write(document)
        elif not options.quiet:
            encoding = sys.stdout.encoding or "ascii"
            print("\n".join(report(result)).encode(encoding, "replace").decode(encoding))
            return int(result["exit_status"])
        for name, outcome, what in outcomes(result):
            if outcome == "not met":
                print(f"{options.candidate}: {name}: not met ({what})", file=sys.stderr)
        return int(result["exit_status"])
    except BadInput as error:
        print(f"check.py: {printable(str(error))}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    try:
        status = main()
        sys.stdout.flush()
    except BrokenPipeError:
        # Whoever reads the output has closed it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 2
    sys.exit(status)
