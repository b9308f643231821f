//! The requested table: its columns, and its rows or the times at which it is evaluated.

use super::{BLOCK, Export, ExportTable, Spool, TableOrigin};
use crate::Error;
use crate::plot::html::file_name;
use std::fs::File;
use std::ops::Range;
use std::path::Path;
use stickslip_analysis::provenance;
use stickslip_case::input::{InputRows, LONGEST_LINE};
use stickslip_case::suggest;
use stickslip_compare::Reference;
use stickslip_files::ResultFile;
use stickslip_files::schema::{Variable, group};
use stickslip_system::quote::{quoted, shown};

/// Limits: number of times in a list, and number of evaluated rows.
const MOST_TIMES: usize = 1 << 26;
const MOST_ROWS: f64 = 1e9;

/// The tables of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Which {
    /// The samples, or the channels at other times.
    Trajectory,
    /// Every event, with what a certificate says of it.
    Events,
    /// Every stretch between restarts, with what it cost.
    Segments,
    /// Every cycle.
    #[value(name = "stick_slip", alias = "stick-slip")]
    StickSlip,
}

impl Which {
    /// The group in the file.
    pub fn name(self) -> &'static str {
        match self {
            Which::Trajectory => group::TRAJECTORY,
            Which::Events => group::EVENTS,
            Which::Segments => group::SEGMENTS,
            Which::StickSlip => group::STICK_SLIP,
        }
    }
}

/// Times at which a trajectory is evaluated.
#[derive(Debug, Clone, PartialEq)]
pub enum Times {
    /// Multiples of an interval (s), from the start.
    Every(f64),
    /// A sampling rate (Hz), from the start.
    Rate(f64),
    /// Increasing times, s.
    At(Vec<f64>),
}

/// The requested part of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The table.
    pub table: Which,
    /// Names of columns in the order of the export; all columns if empty.
    pub columns: Vec<String>,
    /// First and last time, s. Both may be infinite.
    pub window: (f64, f64),
}

/// Columns of /certificate for each event; `time_uncertainty` is in /events.
const OF_EVENTS: [&str; 6] = [
    "verdict",
    "ladder_uncertainty",
    "ladder_verdict",
    "rounding",
    "growth",
    "true_error",
];

/// A column, and its group in the file.
pub(super) type TableColumn = (Variable, String);

pub(super) fn columns(file: &ResultFile, which: Which) -> Result<Vec<TableColumn>, Error> {
    let of = |group: &str| -> Result<Vec<TableColumn>, Error> {
        let found = file.table(group)?.into_iter();
        Ok(found.map(|one| (one, group.to_owned())).collect())
    };
    let mut all = of(which.name())?;
    if which == Which::Events {
        let certificate = of(group::CERTIFICATE)?;
        all.extend(
            certificate
                .into_iter()
                .filter(|(column, _)| OF_EVENTS.contains(&column.name.as_str())),
        );
    }
    Ok(all)
}

fn origin(file: &ResultFile, evaluated: Option<String>) -> TableOrigin {
    TableOrigin {
        source: provenance::source(),
        title: file.title().to_owned(),
        file: file_name(file.path()),
        status: file.status().name().to_owned(),
        evaluated,
    }
}

/// The `wanted` ones of a table's columns, in their order; all if none is named.
pub(super) fn chosen<T: Clone>(
    path: &Path,
    table: &str,
    all: Vec<(Variable, T)>,
    wanted: &[String],
) -> Result<Vec<(Variable, T)>, Error> {
    if wanted.is_empty() {
        return Ok(all);
    }
    let mut found: Vec<(Variable, T)> = Vec::with_capacity(wanted.len());
    for one in wanted {
        if found.iter().any(|(column, _)| column.name == *one) {
            let one = quoted(one);
            return Err(Error::input(format!("--channels names {one} twice; leave one out")));
        }
        let Some(column) = all.iter().find(|(column, _)| column.name == *one) else {
            let known: Vec<&str> = all.iter().map(|(column, _)| column.name.as_str()).collect();
            let close = suggest(one, known.iter().copied());
            let hint = close.map_or(String::new(), |close| format!(" (did you mean {close}?)"));
            let (path, one, known) = (path.display(), quoted(one), known.join(", "));
            return Err(Error::input(format!(
                "{path}: no column {one}{hint} in /{table}; there are {known}"
            )));
        };
        found.push(column.clone());
    }
    Ok(found)
}

/// Selects rows of a table as the file stores them.
///
/// # Errors
/// A column is unknown, the window contains no row, or the file is unreadable.
pub fn stored<'a>(file: &'a ResultFile, request: &Request) -> Result<Export<'a>, Error> {
    let name = request.table.name();
    let all = columns(file, request.table)?;
    if all.is_empty() {
        let why = format!("it has no /{name}; repeat the run");
        return Err(Error::of_file(file.path(), why));
    }
    let mut rows = 0..file.table_rows(name)?;
    if request.window != (f64::NEG_INFINITY, f64::INFINITY) {
        rows = rows_within(file, request, rows)?;
    }
    let mut wanted = request.columns.clone();
    // A trajectory always contains its times.
    if request.table == Which::Trajectory && !wanted.is_empty() && !wanted.iter().any(|one| one == "time") {
        wanted.insert(0, "time".to_owned());
    }
    let columns = chosen(file.path(), name, all, &wanted)?;
    Ok(Export {
        table: ExportTable::of_file(name, file, columns, rows),
        origin: origin(file, None),
        left_out: Vec::new(),
    })
}

/// Refuses a window (s) outside the run, which extends over `span`.
fn check_window(file: &ResultFile, (from, to): (f64, f64), (start, end): (f64, f64)) -> Result<(), Error> {
    if from <= end && to >= start {
        return Ok(());
    }
    let why = format!(
        "the window from {from:?} to {to:?} s has no part of the run, which goes from {start:?} to {end:?} s; give one that has"
    );
    Err(Error::of_file(file.path(), why))
}

/// The `rows` whose times are in the window. For segments, those that overlap the window.
fn rows_within(file: &ResultFile, request: &Request, rows: Range<usize>) -> Result<Range<usize>, Error> {
    let (from, to) = request.window;
    let (starts, ends) = match request.table {
        Which::Trajectory | Which::Events => ("time", "time"),
        Which::Segments => ("start", "end"),
        Which::StickSlip => {
            return Err(Error::input(
                "--window is of times, and the cycles of /stick_slip have none; leave it out, or export --table events"
                    .to_owned(),
            ));
        }
    };
    if let Some(span) = file.span()? {
        check_window(file, request.window, span)?;
    }
    let name = request.table.name();
    let start = file.first_row(name, ends, rows.clone(), |time| time >= from)?;
    let end = file.first_row(name, starts, rows, |time| time > to)?;
    Ok(start..end.max(start))
}

/// Evaluates the trajectory at other times than its samples, from its dense output or the equations of motion.
///
/// # Errors
/// The table is not the trajectory, a column exists only at the samples, a time is outside the run, the run has too
/// sparse samples and cannot be repeated, or the file is unreadable.
pub fn evaluated(reference: &Reference, request: &Request, times: &Times) -> Result<Export<'static>, Error> {
    let (file, asked) = (reference.file(), &request.columns);
    if request.table != Which::Trajectory {
        return Err(Error::input(format!(
            "--rate, --interval and --at evaluate a trajectory at other times, and /{} has rows of its own; leave them out",
            request.table.name()
        )));
    }
    let all = columns(file, Which::Trajectory)?;
    let mut grid = grid(reference, request.window, times)?;
    let (mut known, mut left_out) = (Vec::new(), Vec::new());
    for column in all {
        match reference.evaluates(&column.0.name)? {
            true => known.push(column),
            false => left_out.push(column.0.name),
        }
    }
    if let Some(one) = asked.iter().find(|one| left_out.contains(one)) {
        let path = file.path().display();
        let evaluable: Vec<&str> = known.iter().map(|(column, _)| column.name.as_str()).collect();
        return Err(Error::input(format!(
            "{path}: {one} is known at the samples of the run alone; export it without --rate, --interval and --at. At any time \
             there are {}",
            evaluable.join(", ")
        )));
    }
    left_out.retain(|name| asked.is_empty() && name != "segment");
    let mut wanted = asked.clone();
    if !wanted.is_empty() {
        wanted.retain(|one| one != "time");
        wanted.insert(0, "time".to_owned());
    }
    let chosen = chosen(file.path(), group::TRAJECTORY, known, &wanted)?;
    let columns: Vec<Variable> = chosen.into_iter().map(|(column, _)| column).collect();
    let mut trajectory = reference.trajectory(columns.iter().map(|column| column.name.clone()).collect())?;
    let mut spool = Spool::new()?;
    loop {
        let times: Vec<f64> = grid.by_ref().take(BLOCK).collect();
        if times.is_empty() {
            break;
        }
        spool.push(&trajectory.at(&times)?)?;
    }
    Ok(Export {
        table: spool.finish(group::TRAJECTORY, columns),
        origin: origin(file, Some(trajectory.source().to_owned())),
        left_out,
    })
}

type TimeGrid<'a> = Box<dyn Iterator<Item = f64> + 'a>;

fn grid<'a>(reference: &Reference, window: (f64, f64), times: &'a Times) -> Result<TimeGrid<'a>, Error> {
    let (start, end) = reference.times();
    let path = reference.file().path().display();
    check_window(reference.file(), window, (start, end))?;
    let (from, to) = (window.0.max(start), window.1.min(end));
    // Multiples of the interval, or of 1/rate, have no summation error.
    let (rows, interval, rate) = match times {
        Times::At(times) => {
            let first = times.partition_point(|time| *time < window.0);
            let last = times.partition_point(|time| *time <= window.1);
            let times = &times[first..last];
            if let Some(time) = times.iter().find(|time| !(start..=end).contains(*time)) {
                return Err(Error::input(format!(
                    "{path}: the run goes from {start:?} to {end:?} s, and --at asks for t = {time:?} s; leave such times out, or \
                     give a --window"
                )));
            }
            return Ok(Box::new(times.iter().copied()));
        }
        Times::Rate(rate) => ((to - from) * rate, 1.0, *rate),
        Times::Every(interval) => ((to - from) / interval, *interval, 1.0),
    };
    if !(0.0..MOST_ROWS).contains(&rows) {
        return Err(Error::input(format!(
            "{rows:.1e} rows are more than the {MOST_ROWS:e} that an export has; give a --window, or a lower --rate"
        )));
    }
    let time = move |k: usize| from + k as f64 * interval / rate;
    // Rounding may put the last time outside the window.
    let mut count = rows.floor() as usize + 2;
    while count > 1 && time(count - 1) > to {
        count -= 1;
    }
    Ok(Box::new((0..count).map(time)))
}

/// Reads the times in a CSV file, s. They are in the column `time` or `t`, with or without a unit in brackets, or
/// else in the first column.
///
/// # Errors
/// The file is unreadable, a cell is no number, or the times do not increase.
pub fn read_times(path: &Path) -> Result<Vec<f64>, Error> {
    let asked = |what: String| Error::input(format!("{}{what}", path.display()));
    let file =
        File::open(path).map_err(|error| asked(format!(": the times cannot be read: {error}; check the name")))?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(InputRows::new(file));
    let mut record = csv::StringRecord::new();
    let (mut times, mut place, mut first) = (Vec::<f64>::new(), 0, true);
    loop {
        let more = reader.read_record(&mut record).map_err(|error| {
            let most = LONGEST_LINE >> 20;
            asked(format!(
                ": {}; a table of times has lines of text, up to {most} MB each",
                shown(&error.to_string())
            ))
        })?;
        if !more {
            break;
        }
        reader.get_mut().taken();
        let line = record.position().map_or(0, csv::Position::line);
        if std::mem::take(&mut first) && record.iter().all(|cell| cell.parse::<f64>().is_err()) {
            let is_time = |cell: &str| {
                let name = cell.split(['[', '(']).next().unwrap_or_default().trim().to_lowercase();
                matches!(name.as_str(), "time" | "t")
            };
            place = record.iter().position(is_time).unwrap_or(0);
            continue;
        }
        let cell = record.get(place).unwrap_or_default();
        let time = cell.parse::<f64>().ok().filter(|time| time.is_finite());
        let time = time.ok_or_else(|| {
            asked(format!(
                ":{line}: {} is no time in seconds; correct the file",
                quoted(cell)
            ))
        })?;
        if let Some(before) = times.last().filter(|before| **before >= time) {
            return Err(asked(format!(
                ":{line}: the time {time:?} s comes after {before:?} s; put the times in increasing order"
            )));
        }
        if times.len() == MOST_TIMES {
            return Err(asked(format!(
                ": more than {MOST_TIMES} times; split the file, or use --rate"
            )));
        }
        times.push(time);
    }
    if times.is_empty() {
        return Err(asked(
            ": holds no times; give a table with a column of times in seconds".to_owned(),
        ));
    }
    Ok(times)
}
