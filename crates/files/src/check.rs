//! Checks whether a file of this program is sound.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::reader::{blocks, not_finite};
use super::schema::{self, TableSchema, group, root};
use super::seal::{self, Seal};
use super::source::{BLOCK, FileSource, Holds, Object};
use super::{Reason, ResultError, ResultFile, Status};
use stickslip_system::model::Mode;
use stickslip_system::record::{Event, EventKind, Sample, Segment};

/// Result of a check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckReport {
    /// Path as given.
    pub file: PathBuf,
    /// Root attribute `format`.
    pub format: String,
    /// Root attribute `status`.
    pub status: String,
    /// Whether the file has a seal, a checksum of all bytes. Killed runs, and changes by other programs, leave none.
    pub sealed: bool,
    /// Number of variables whose every value was read.
    pub variables: usize,
    /// Number of rows of the trajectory; 0 in other files.
    pub samples: usize,
    /// Problems; empty if the file is sound.
    pub problems: Vec<FileDefect>,
}

/// A defect of a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FileDefect {
    /// Group or variable, with a row if there is one.
    pub place: String,
    /// Description.
    pub what: String,
}

impl std::fmt::Display for FileDefect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.place, self.what)
    }
}

const STATUSES: [&str; 3] = ["complete", "interrupted", "failed"];
const MOST: usize = 100;
const NAMED: usize = 3;

/// Reads every value of a file of this program, and verifies HDF5's chunk checksums and the seal. For the result of a
/// run it also checks the structure, increasing times, finite values, and the consistency of trajectory, events,
/// segments and statistics.
///
/// # Errors
/// The file is missing, cannot be opened, or is not of this program. Problems inside the file are in the report.
pub fn check(path: &Path) -> Result<CheckReport, ResultError> {
    let mut check = Check::open(path)?;
    check.stored();
    check.meant();
    check.report.problems.truncate(MOST);
    Ok(check.report)
}

/// Opens the result of a run as the source of a new computation.
///
/// # Errors
/// Errors of [`ResultFile::open`]; [`Reason::NotAsWritten`] if it is damaged.
pub fn open_sound(path: &Path) -> Result<ResultFile, ResultError> {
    let file = ResultFile::open(path)?;
    check_sound(path)?;
    Ok(file)
}

/// Refuses a file with a broken seal as a source. The file is read once, without HDF5. A file without a seal (from a
/// killed run or another program) is accepted.
///
/// # Errors
/// [`Reason::NotAsWritten`] with the first problems of [`check`]; failures to read the file.
pub fn check_sound(path: &Path) -> Result<(), ResultError> {
    if read_seal(path)? != Seal::Broken {
        return Ok(());
    }
    let mut check = match Check::open(path) {
        // A sealed file was a result once, so that it is damaged now.
        Err(error) if matches!(error.reason, Reason::NotAResult(_)) => {
            return Err(Reason::NotAsWritten(error.to_string()).of(path));
        }
        check => check?,
    };
    check.stored();
    check.meant();
    let problems = &check.report.problems;
    let named: Vec<String> = problems.iter().take(NAMED).map(FileDefect::to_string).collect();
    let more = match problems.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!("; and {more} more"),
    };
    Err(Reason::NotAsWritten(named.join("; ") + &more).of(path))
}

fn read_seal(path: &Path) -> Result<Seal, ResultError> {
    seal::read(path).map_err(|error| ResultError::io(path, "reading the file", error))
}

/// A time may lie beyond the segment by rounding: a clock that restarts in each segment is rounded again at its ends.
fn within(time: f64, segment: &Segment) -> bool {
    let rounding = 4.0 * f64::EPSILON * time.abs();
    (segment.start - rounding..=segment.end + rounding).contains(&time)
}

fn brings_about(kind: EventKind, before: Option<Mode>, after: Mode) -> bool {
    let slips = |mode: Mode| mode.sense() != 0;
    let was = |fits: &dyn Fn(Mode) -> bool| before.is_none_or(fits);
    match kind {
        // A contact without stick reports crossings of a speed as these events.
        EventKind::Stick | EventKind::Slip if after == Mode::Engaged => was(&|mode| mode == Mode::Engaged),
        EventKind::Stick => after == Mode::Stick && was(&slips),
        EventKind::Slip => slips(after) && was(&|mode| mode == Mode::Stick),
        EventKind::Reversal => slips(after) && was(&|mode| slips(mode) && mode != after),
        EventKind::Separation => after == Mode::Separated && was(&|mode| mode != Mode::Separated),
        EventKind::Contact => after != Mode::Separated && was(&|mode| mode == Mode::Separated),
        EventKind::Kick | EventKind::Corner | EventKind::Destabilised | EventKind::Restabilised => {
            was(&|mode| mode == after)
        }
    }
}

struct Check {
    source: FileSource,
    seal: Seal,
    report: CheckReport,
    absent: HashSet<String>,
}

impl Check {
    fn open(path: &Path) -> Result<Check, ResultError> {
        let source = FileSource::open(path)?;
        let seal = read_seal(path)?;
        let found = source.text_attribute("", root::FORMAT)?;
        let format = match found {
            Some(format) if schema::own_format(Some(&format)).is_some() => format,
            found => return Err(Reason::NotAResult(found).of(path)),
        };
        let report = CheckReport {
            file: path.to_owned(),
            status: source.text_attribute("", root::STATUS)?.unwrap_or_default(),
            sealed: seal != Seal::Absent,
            variables: 0,
            samples: 0,
            problems: Vec::new(),
            format,
        };
        Ok(Check {
            source,
            seal,
            report,
            absent: HashSet::new(),
        })
    }

    fn stored(&mut self) {
        let status = &self.report.status;
        if !STATUSES.contains(&status.as_str()) {
            let what = match status.is_empty() {
                true => "the attribute status is missing".to_owned(),
                false => format!(
                    "the attribute status is \"{status}\", not one of: {}",
                    STATUSES.join(", ")
                ),
            };
            self.problem("/", what);
        }
        let everything = self.everything();
        self.note("/", everything);
        // A killed run leaves columns of different lengths.
        if self.report.format != schema::FORMAT || self.report.status == Status::Complete.name() {
            let uneven = self.source.uneven(MOST);
            let uneven = uneven.map(|found| found.into_iter().for_each(|error| self.note("/", Err(error))));
            self.note("/", uneven);
        }
        if self.seal == Seal::Broken && self.report.problems.is_empty() {
            self.problem(
                "/",
                "some bytes are not those that were written, or others follow them, though HDF5 reads every value without an \
                 error",
            );
        }
    }

    fn meant(&mut self) {
        if self.report.format == schema::FORMAT {
            let result = self.result();
            self.note("/", result);
        }
    }

    fn problem(&mut self, place: impl Into<String>, what: impl Into<String>) {
        if self.report.problems.len() < MOST {
            let (place, what) = (place.into(), what.into());
            self.report.problems.push(FileDefect { place, what });
        }
    }

    fn odd(&mut self, group: &str, row: usize, what: impl Into<String>) {
        self.problem(format!("row {row} of /{group}"), what);
    }

    /// A missing file affects every variable, and is listed once.
    fn note(&mut self, place: &str, result: Result<(), ResultError>) {
        if let Err(ResultError {
            reason: Reason::Absent(what),
            ..
        }) = &result
        {
            let file = what.split_once(": ").map_or(what.as_str(), |(_, file)| file);
            if !self.absent.insert(file.to_owned()) {
                return;
            }
        }
        let Err(error) = result else { return };
        let listed = |place: &String| self.report.problems.iter().any(|problem| problem.place == *place);
        match &error.reason {
            // The reader of the table may have listed it already.
            Reason::Uneven { variable, .. } if listed(variable) => {}
            Reason::Uneven { variable, .. } => self.problem(variable, error.to_string()),
            _ => self.problem(place, error.to_string()),
        }
    }

    fn everything(&mut self) -> Result<(), ResultError> {
        let mut variables = Vec::new();
        self.source.walk(&mut |path, member| {
            match member.is {
                Object::Dataset(info) => variables.push((path.to_owned(), Ok(info))),
                Object::Not(reason) => variables.push((path.to_owned(), Err(reason.of(self.source.path())))),
                _ => {}
            }
            Ok(())
        })?;
        for (path, info) in variables {
            let read = info.and_then(|info| match info.holds {
                Holds::Texts if info.shape.is_empty() => match self.source.text(&path) {
                    Ok(None) => {
                        self.problem(format!("/{path}"), "is no text of fixed length in UTF-8");
                        Ok(())
                    }
                    read => read.map(drop),
                },
                Holds::Texts => self.source.texts(&path).map(drop),
                ref holds if holds.is_number() => self.source.blocks(&path, &info.shape, BLOCK, &mut |_: Vec<f64>| {}),
                _ => Ok(()),
            });
            self.report.variables += 1;
            self.note(&format!("/{path}"), read);
        }
        Ok(())
    }

    fn result(&mut self) -> Result<(), ResultError> {
        let file = ResultFile::open_unchecked(&self.report.file)?;
        let complete = *file.status() == Status::Complete;
        let extension = file.extension()?;
        if extension.dense {
            file.dense().map(drop)?;
        }
        let tables = schema::all_tables(&extension);
        for table in tables {
            let structure = self.structure(&file, &table);
            self.note(&format!("/{}", table.group), structure);
        }
        let segments = file.segments()?;
        let events = file.events()?;
        self.report.samples = file.sample_count()?;
        self.segments(&segments);
        self.events(&events, &segments, complete);
        self.modes(&events, &segments, complete);
        self.trajectory(&file, &segments, complete)?;
        file.resolved().map(drop)?;
        if complete && let Some(statistics) = file.stick_slip()? {
            let count = |kind: EventKind| events.iter().filter(|event| event.kind == kind).count() as u64;
            for (name, kind) in [("stick_count", EventKind::Stick), ("slip_count", EventKind::Slip)] {
                let (said, found) = (statistics.value(name).unwrap_or(0.0) as u64, count(kind));
                if said != found {
                    let what = format!("{name} is {said}, but /events has {found}");
                    self.problem(format!("/{}", group::STICK_SLIP), what);
                }
            }
        }
        Ok(())
    }

    /// Every variable of the schema must exist with its type, unless an earlier version did not write it.
    fn structure(&mut self, file: &ResultFile, table: &TableSchema) -> Result<(), ResultError> {
        for variable in &table.variables {
            let path = format!("{}/{}", table.group, variable.name);
            if file.lacking(table.group, &variable.name)?.is_some() {
                continue;
            }
            let Some(info) = self.source.dataset(&path)? else {
                self.problem(format!("/{path}"), "is missing");
                continue;
            };
            let wanted = variable.kind.name();
            if info.holds.name() != wanted || info.shape.len() != 1 {
                let (found, shape) = (info.holds.name(), &info.shape);
                let what = format!("is {found} of shape {shape:?}, not a column of {wanted}");
                self.problem(format!("/{path}"), what);
                continue;
            }
            let units = self.source.text_attribute(&path, schema::attribute::UNITS)?;
            if units.as_deref() != Some(variable.units.as_str()) {
                let found = units.map_or("missing".to_owned(), |units| format!("\"{units}\""));
                let what = format!("the attribute units is {found}, not \"{}\"", variable.units);
                self.problem(format!("/{path}"), what);
            }
        }
        Ok(())
    }

    fn segments(&mut self, segments: &[Segment]) {
        let mut last = f64::NEG_INFINITY;
        for (row, Segment { start, end, .. }) in segments.iter().enumerate() {
            if !(start.is_finite() && end.is_finite() && start <= end) {
                self.odd(group::SEGMENTS, row, format!("goes from {start:?} to {end:?} s"));
            } else if *start < last {
                let what = format!("starts at {start:?} s, before the end {last:?} s of the one before");
                self.odd(group::SEGMENTS, row, what);
            }
            last = *end;
        }
    }

    fn events(&mut self, events: &[Event], segments: &[Segment], complete: bool) {
        let mut last = f64::NEG_INFINITY;
        for (row, event) in events.iter().enumerate() {
            let time = event.time;
            if !time.is_finite() || time < last {
                self.odd(
                    group::EVENTS,
                    row,
                    format!("the time {time:?} s comes after {last:?} s"),
                );
                continue;
            }
            last = time;
            let number = event.segment;
            match segments.get(number as usize) {
                Some(segment) if !within(time, segment) => {
                    let (start, end) = (segment.start, segment.end);
                    let what = format!("the time {time:?} s is not in its segment {number}, {start:?} to {end:?} s");
                    self.odd(group::EVENTS, row, what);
                }
                None if complete => self.odd(group::EVENTS, row, format!("there is no segment {number}")),
                _ => {}
            }
            let mut states = event.before.values().into_iter().chain(event.after.values());
            if states.any(|value| !value.is_finite()) {
                self.odd(group::EVENTS, row, "a state is not finite");
            }
        }
    }

    fn modes(&mut self, events: &[Event], segments: &[Segment], complete: bool) {
        let (mut mode, mut begun) = (None, 0);
        for (row, event) in events.iter().enumerate() {
            let number = event.segment as usize;
            let Some(segment) = segments.get(number) else {
                // A killed run may lack this segment.
                return;
            };
            if number + 1 < begun {
                let what = format!("its segment is {number}, that of the one before {}", begun - 1);
                self.odd(group::EVENTS, row, what);
                return;
            }
            // At the start of a run events precede the first segment.
            if number > 0 || event.time > segment.start {
                while begun <= number {
                    self.follows(mode, segments[begun].mode, begun);
                    mode = Some(segments[begun].mode);
                    begun += 1;
                }
            }
            if !brings_about(event.kind, mode, event.mode_after) {
                let from = mode.map_or(String::new(), |mode| format!("from {} ", mode.name()));
                let (kind, after) = (event.kind.name(), event.mode_after.name());
                self.odd(group::EVENTS, row, format!("a {kind} does not lead {from}to {after}"));
            }
            mode = Some(event.mode_after);
        }
        // A killed run may lack the events of its last segments.
        let known = if complete { segments.len() } else { begun };
        for (number, segment) in segments.iter().enumerate().take(known).skip(begun) {
            self.follows(mode, segment.mode, number);
            mode = Some(segment.mode);
        }
    }

    fn follows(&mut self, before: Option<Mode>, mode: Mode, segment: usize) {
        if let Some(before) = before.filter(|before| *before != mode) {
            let (mode, before) = (mode.name(), before.name());
            let what = format!("its mode is {mode}, but {before} after what comes before it");
            self.odd(group::SEGMENTS, segment, what);
        }
    }

    fn trajectory(&mut self, file: &ResultFile, segments: &[Segment], complete: bool) -> Result<(), ResultError> {
        let (rows, stored) = (self.report.samples, file.stored_channels()?);
        let (mut last, mut odd) = (f64::NEG_INFINITY, 0);
        for block in blocks(rows) {
            for (row, sample) in block.clone().zip(file.samples(block)?) {
                let Sample { time, mode, .. } = sample;
                let mut found = Vec::new();
                if !time.is_finite() || time <= last {
                    found.push(format!("the time {time:?} s comes after {last:?} s"));
                }
                last = time;
                let values = sample.state.values().into_iter().chain(sample.channels.values());
                if let Some((name, value)) = not_finite(&stored, values) {
                    found.push(format!("{name} is {value}"));
                }
                let number = sample.segment;
                match segments.get(number as usize) {
                    Some(segment) if segment.mode != mode => {
                        let of_segment = segment.mode;
                        found.push(format!(
                            "its mode is {mode:?}, that of its segment {number} is {of_segment:?}"
                        ));
                    }
                    Some(segment) if !within(time, segment) => {
                        let (start, end) = (segment.start, segment.end);
                        found.push(format!(
                            "the time {time:?} s is not in its segment, {start:?} to {end:?} s"
                        ));
                    }
                    None if complete => found.push(format!("there is no segment {number}")),
                    _ => {}
                }
                if !found.is_empty() {
                    self.odd(group::TRAJECTORY, row, found.join("; "));
                    odd += 1;
                    if odd >= MOST {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }
}
