//! A result file as data for figures: columns thinned block by block, events with the states on both sides, and stretches of modes.

use super::figure::Axis;
use super::labels;
use super::thinning::{DecimatedPortrait, MinMax};
use crate::error::{Error, ErrorKind};
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;
use std::rc::Rc;
use stickslip_analysis::provenance;
use stickslip_case::{Case, CaseSource};
use stickslip_compare::reference::states_at_events;
use stickslip_engine::simulation::{Course, further, is_short};
use stickslip_files::{AddedGroup, DenseOutput, EventSide, ResultError, ResultFile, Status, schema};
use stickslip_system::model::Mode;
use stickslip_system::model::system::{Pressing, System};
use stickslip_system::record::{Channels, Cycle, CycleStatistics, Event, EventKind, State};

/// Number of rows read at once. All columns of a figure then take a few megabytes.
const BLOCK: usize = 65_536;

/// Number of buckets of a curve over time. They are narrower than the pixel columns at 300 dots per inch.
pub(super) const BUCKETS: usize = 1200;

/// Number of samples per period of the fast motion that show the motion rather than the sampling.
pub(super) const SAMPLES_PER_PERIOD: f64 = 12.0;

/// A stretch longer than this, in periods, needs only the samples of this many, because in long slip the fast motion
/// decays.
const LONGEST_FAST: f64 = 20.0;

/// Number of periods that are drawn of the growing oscillation before the first stick.
const GROWTH: f64 = 12.0;

/// The narrowest stretch of a mode in the background is 1/600 of the panel's width.
const GROUND_CELLS: usize = 600;

/// Widest gap (s) between samples of a motion with this period (s). It has a margin for intervals rounded to two
/// digits.
pub(super) fn widest_gap(period: f64) -> f64 {
    1.05 * period / SAMPLES_PER_PERIOD
}

const POINTS_OF_PIECE: usize = 16;

/// The trajectory of a file in rows: samples, or points of its dense output.
#[derive(Debug)]
pub(super) struct RunRows<'f> {
    file: &'f ResultFile,
    dense: Option<(DenseOutput<'f>, Vec<f64>)>,
    rows: Range<usize>,
}

impl<'f> RunRows<'f> {
    pub(super) fn of_samples(file: &'f ResultFile, rows: Range<usize>) -> RunRows<'f> {
        let dense = None;
        RunRows { file, dense, rows }
    }

    /// Points of a window (s): its ends and, in each piece, at least 16 points with a density of `count` per window.
    pub(super) fn of_dense(
        file: &'f ResultFile,
        dense: DenseOutput<'f>,
        (from, to): (f64, f64),
        count: f64,
    ) -> RunRows<'f> {
        let mut times = vec![from];
        for (start, end) in dense.spans().filter(|piece| piece.1 > from && piece.0 < to) {
            let (start, end) = (start.max(from), end.min(to));
            let count = (count * (end - start) / (to - from)).ceil().max(POINTS_OF_PIECE as f64) as usize;
            let inside = (0..count).map(|k| start + (end - start) * (k as f64 + 0.5) / count as f64);
            times.extend(inside.filter(|t| *t > from && *t < to));
        }
        times.push(to);
        times.dedup();
        RunRows {
            file,
            rows: 0..times.len(),
            dense: Some((dense, times)),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.rows.len()
    }

    pub(super) fn is_dense(&self) -> bool {
        self.dense.is_some()
    }

    pub(super) fn blocks(&self, size: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let rows = self.len();
        (0..rows).step_by(size).map(move |start| start..rows.min(start + size))
    }

    pub(super) fn column(&self, name: &str, rows: Range<usize>) -> Result<Vec<f64>, ResultError> {
        match &self.dense {
            Some((dense, times)) => dense.column(name, &times[rows], EventSide::After),
            None => self
                .file
                .column(name, self.rows.start + rows.start..self.rows.start + rows.end),
        }
    }

    pub(super) fn first_row(&self, t: f64) -> Result<usize, ResultError> {
        match &self.dense {
            Some((_, times)) => Ok(times.partition_point(|time| *time < t)),
            None => self
                .file
                .first_row(schema::group::TRAJECTORY, "time", self.rows.clone(), |time| time >= t),
        }
    }
}

type RunPoints = Vec<(f64, f64)>;

/// Variables that jump with the mode. No line joins their values on both sides.
const JUMPING: [&str; 3] = ["mode", "segment", "friction_torque"];

/// A result file, open for drawing.
#[derive(Debug)]
pub struct DrawnRun {
    file: ResultFile,
    rows: usize,
    /// Times of the first and the last sample, s.
    pub times: (f64, f64),
    /// All events in order of time.
    pub events: Vec<Event>,
    /// Sticks and slips, from the events.
    pub stick_slip: CycleStatistics,
    /// Each stick that ends, with the slip after it.
    pub cycles: Vec<Cycle>,
    /// The case in the file.
    pub case: Case,
    /// The system of the case.
    pub system: System,
    pub(super) course: Course,
    /// Period of the attractor, s; `None` if the attractor is not periodic.
    pub attractor_period: Option<f64>,
    /// Natural period of the surfaces on their shafts, s; `None` without one.
    pub(crate) natural_period: Option<f64>,
    /// Time span of the dense output, s.
    dense: Option<(f64, f64)>,
    /// (start, end, mode). Neighbours with the same mode are joined.
    stretches: Vec<(f64, f64, Mode)>,
    pub(super) variables: Vec<schema::Variable>,
    /// Curves that several figures use, by channel and window.
    cache: RefCell<HashMap<(String, u64, u64), RunPoints>>,
    /// Requested channels on both sides of each event; `None` if a channel is not available there.
    at_events: RefCell<HashMap<String, Option<Rc<Sides>>>>,
}

/// Most characters of the overrides in a title or legend.
const LONGEST_CHANGES: usize = 40;

/// Overrides for a title or legend. Those of the output change no curve. The first ones are listed as far as there is
/// room, and the others are counted.
fn shortened_changes(changed: &[String]) -> Option<String> {
    let changed: Vec<&str> = changed
        .iter()
        .map(String::as_str)
        .filter(|change| !change.starts_with("output."))
        .collect();
    let mut room = LONGEST_CHANGES;
    let fits = |change: &&&str| {
        let left = room.checked_sub(change.chars().count());
        room = left.unwrap_or(0);
        left.is_some()
    };
    let listed: Vec<&str> = changed.iter().take_while(fits).copied().collect();
    match (listed.len(), changed.len() - listed.len()) {
        (0, 0) => None,
        (_, 0) => Some(listed.join(", ")),
        (0, 1) => changed[0].split(" = ").next().map(|key| format!("other {key}")),
        (0, more) => Some(format!("{more} keys changed")),
        (_, more) => Some(format!("{} and {more} more", listed.join(", "))),
    }
}

/// Stretches between contact events that have too few samples to be drawn.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Undersampled {
    /// (start, end), s, in order.
    pub(crate) stretches: Vec<(f64, f64)>,
    pub(crate) of: usize,
}

impl Undersampled {
    pub(crate) fn seen(&self, (from, to): (f64, f64)) -> Vec<(f64, f64)> {
        let least = 3.0 * (to - from) / BUCKETS as f64;
        let wide = |stretch: &&(f64, f64)| stretch.1 - stretch.0 > least;
        self.stretches.iter().filter(wide).copied().collect()
    }
}

pub(super) fn samples(file: &ResultFile) -> Result<usize, Error> {
    let samples = file.sample_count()?;
    if samples == 0 {
        let path = file.path();
        let ended = match file.status() {
            Status::Complete => "",
            _ => ", as the run was ended before the first block was saved",
        };
        let (why, shown) = ("has no trajectory: there is not one sample in it", path.display());
        return Err(Error::of_file(
            path,
            format!("{why}{ended}; repeat the run (`stickslip run {shown}`)"),
        ));
    }
    file.check_times()?;
    Ok(samples)
}

enum RunMoment<'a> {
    Sample(&'a [f64]),
    Event(usize),
}

impl DrawnRun {
    /// Opens a result file that contains a trajectory, complete or not.
    ///
    /// # Errors
    /// The file is no result file, damaged, in use, or without samples.
    pub fn open(path: &Path) -> Result<DrawnRun, Error> {
        let file = ResultFile::open(path)?;
        let rows = samples(&file)?;
        let times = file.span()?.unwrap_or_default();
        let events = file.events()?;
        let case = Case::read(&CaseSource::result(path, file.resolved()?), &[])?;
        let system = case.system.clone();
        let course = Course::new(&system, case.threshold, &case.solver);
        let [trajectory, ..] = schema::extended_tables(&provenance::extension(&case));
        let pairs = events.iter().map(|event| (event.time, event.kind));
        let (stick_slip, cycles) = CycleStatistics::of_events(pairs);
        let attractor_period = file.stick_slip()?.and_then(|table| table.value("attractor_period"));
        let attractor_period = attractor_period.filter(|period| *period > 0.0);
        let mut stretches: Vec<(f64, f64, Mode)> = Vec::new();
        for segment in file.segments()? {
            match stretches.last_mut() {
                Some(last) if last.2 == segment.mode => last.1 = segment.end,
                _ => stretches.push((segment.start, segment.end, segment.mode)),
            }
        }
        let dense = file.dense()?.and_then(|dense| dense.span());
        Ok(DrawnRun {
            rows,
            times,
            dense,
            stick_slip,
            cycles,
            events,
            natural_period: course.natural_period(),
            case,
            system,
            course,
            attractor_period,
            variables: trajectory.variables,
            stretches,
            file,
            cache: RefCell::default(),
            at_events: RefCell::default(),
        })
    }

    /// Whether sliding slows down to a stop by itself, because nothing drives the only free train.
    pub(crate) fn stops(&self) -> bool {
        self.course.system().twice_resistance.is_some()
    }

    /// Whether the chains are the paper's brake: a free rotor of two inertias on a shaft, a stator on a fixed one.
    pub(super) fn is_short(&self) -> bool {
        is_short(&self.system)
    }

    pub(super) fn has_drive(&self) -> bool {
        !self.has_axial_mode() || !self.system.drives().is_empty()
    }

    pub(crate) fn has_axial_mode(&self) -> bool {
        matches!(self.system.pressing, Pressing::Axial { .. })
    }

    /// How the run ended.
    pub fn status(&self) -> &Status {
        self.file.status()
    }

    pub(super) fn certificate(&self) -> Result<Option<AddedGroup>, Error> {
        Ok(self.file.added_group(schema::group::CERTIFICATE, usize::MAX)?)
    }

    /// Certified uncertainties of event times, s; NaN for events that have not converged.
    pub(super) fn time_uncertainty(&self) -> Option<Vec<f64>> {
        self.file.event_column(schema::TIME_UNCERTAINTY).ok()
    }

    /// The file.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Label in a legend: the file name without extension.
    pub fn label(&self) -> String {
        match self.changes() {
            None => self.name(),
            Some(changes) => format!("{} ({changes})", self.name()),
        }
    }

    /// Name of the file without its extension.
    pub(crate) fn name(&self) -> String {
        let stem = self.path().file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// Overrides of the case, in few words; `None` without any.
    pub(crate) fn changes(&self) -> Option<String> {
        shortened_changes(&self.file.changed())
    }

    /// The window. Its start is later if it has more than `most` points: one for each sample, two for each event.
    pub(super) fn shortened(&self, (from, to): (f64, f64), most: usize) -> Result<(f64, f64), Error> {
        let rows = self.rows_in((from, to))?;
        let mut start = rows.end.saturating_sub(most).max(rows.start);
        loop {
            let first = self.file.column("time", start..start + 1)?[0];
            // The state before the first sample belongs to the window if no sample is left out.
            let window = (if start == rows.start { from } else { first }, to);
            if rows.end - start + 2 * self.events_in(window).len() <= most || start + 1 >= rows.end {
                return Ok(window);
            }
            start += (rows.end - start).div_ceil(2).min(rows.end - start - 1);
        }
    }

    /// The axis of a variable of /trajectory. The error for an unknown variable lists the known ones.
    pub fn axis(&self, channel: &str) -> Result<Axis, Error> {
        let variable = self.variables.iter().find(|variable| variable.name == channel);
        let axis = variable.map(|variable| labels::of_variable(variable, self.case.motion(), self.is_short()));
        axis.ok_or_else(|| {
            let known: Vec<&str> = self.variables.iter().map(|variable| variable.name.as_str()).collect();
            let what = format!("{}: /trajectory has no variable", self.path().display());
            Error::unknown(what, channel, &known, " (`stickslip inspect` says what each is)")
        })
    }

    /// The rows in a time window, including both ends. A window without rows is an error.
    pub(crate) fn rows_in(&self, (from, to): (f64, f64)) -> Result<Range<usize>, Error> {
        let (table, rows, (first, last)) = (schema::group::TRAJECTORY, 0..self.rows, self.times);
        let start = self.file.first_row(table, "time", rows.clone(), |time| time >= from)?;
        let end = match to >= last {
            true => self.rows,
            false => self.file.first_row(table, "time", rows, |time| time > to)?,
        };
        if start < end {
            return Ok(start..end);
        }
        let why = format!("no samples from {from} to {to} s; they reach from {first} to {last} s");
        Err(Error {
            kind: ErrorKind::NothingInRange,
            ..Error::of_file(self.path(), why)
        })
    }

    /// Whether the dense output covers the window, as far as the run extends, and therefore replaces the samples.
    pub(crate) fn is_dense(&self, (from, to): (f64, f64)) -> bool {
        let (first, last) = (from.max(self.times.0), to.min(self.times.1));
        first < last && self.dense.is_some_and(|span| span.0 <= first && last <= span.1)
    }

    fn drawn_rows(&self, window: (f64, f64)) -> Result<RunRows<'_>, Error> {
        if self.is_dense(window) {
            let window = (window.0.max(self.times.0), window.1.min(self.times.1));
            if let Some(dense) = self.file.dense()? {
                return Ok(RunRows::of_dense(&self.file, dense, window, 4.0 * BUCKETS as f64));
            }
        }
        Ok(RunRows::of_samples(&self.file, self.rows_in(window)?))
    }

    pub(crate) fn each_sample(
        &self,
        channels: &[&str],
        window: (f64, f64),
        mut take: impl FnMut(&[f64]),
    ) -> Result<(), Error> {
        for channel in channels {
            self.axis(channel)?;
        }
        let mut row = vec![0.0; channels.len()];
        let rows = self.drawn_rows(window)?;
        for block in rows.blocks(BLOCK) {
            let columns = channels.iter().map(|channel| rows.column(channel, block.clone()));
            let columns = columns.collect::<Result<Vec<_>, _>>()?;
            for k in 0..block.len() {
                for (value, column) in row.iter_mut().zip(&columns) {
                    *value = column[k];
                }
                take(&row);
            }
        }
        Ok(())
    }

    /// A channel on both sides of every event, from the file or the equations; `None` if it depends on the history.
    pub(super) fn at_events(&self, channel: &str) -> Result<Option<Rc<Sides>>, Error> {
        if let Some(known) = self.at_events.borrow().get(channel) {
            return Ok(known.clone());
        }
        let known = |name: &str| self.variables.iter().any(|variable| variable.name == name);
        let further = || known(channel) && further(&self.system).iter().any(|one| one.name == channel);
        let is_state = State::CHANNELS.iter().any(|state| state.name == channel);
        let sides = if is_state || further() {
            Some(Sides::of_file(&self.file, channel)?)
        } else {
            let first = self.stretches.first().map(|stretch| stretch.2);
            Sides::of(&self.course, &self.file, &self.events, first, channel)?
        };
        let sides = sides.map(Rc::new);
        self.at_events.borrow_mut().insert(channel.to_owned(), sides.clone());
        Ok(sides)
    }

    fn events_in(&self, (from, to): (f64, f64)) -> Range<usize> {
        let start = self.events.partition_point(|event| event.time < from);
        start..self.events.partition_point(|event| event.time <= to).max(start)
    }

    /// Start and end (s) of the growing oscillation, from the loss of stability to the first contact event.
    pub(crate) fn growth(&self) -> Option<(f64, f64)> {
        let first = |is: &dyn Fn(&Event) -> bool| self.events.iter().find(|event| is(event)).map(|event| event.time);
        let unstable = first(&|event| event.kind == EventKind::Destabilised)?;
        let contact = first(&|event| event.kind.in_event_sequence() && event.time > 0.0)?;
        (unstable < contact).then_some((unstable, contact))
    }

    fn is_rigid_in_stick(&self) -> bool {
        self.system.rotor.inertia.len() + self.system.stator.inertia.len() < 2
    }

    /// Undersampled stretches in a window: between contact events, and the growth before the first one. A stretch is
    /// undersampled if a gap between samples exceeds 1/12 of the natural period or, without one, of the stretch.
    pub(crate) fn undersampled(&self, window: (f64, f64)) -> Result<Undersampled, Error> {
        if self.is_dense(window) {
            return Ok(Undersampled::default());
        }
        let (period, rigid) = (self.natural_period, self.is_rigid_in_stick());
        let events = &self.events[self.events_in(window)];
        let of_contact: Vec<&Event> = events.iter().filter(|event| event.kind.in_event_sequence()).collect();
        let mut stretches: Vec<(f64, f64)> = Vec::new();
        // The growth before the first stick contains the fast motion, too.
        if let (Some(period), Some((unstable, first))) = (period, self.growth()) {
            let from = unstable.max(first - GROWTH * period).max(window.0);
            let to = first.min(window.1);
            if from < to {
                stretches.push((from, to));
            }
        }
        let growth = stretches.first().map(|stretch| stretch.1);
        for pair in of_contact.windows(2) {
            // The sliding before the growth is smooth.
            if growth == Some(pair[1].time) {
                continue;
            }
            let is_stick = pair[0].kind == EventKind::Stick || pair[0].mode_after == Mode::Stick;
            if pair[1].time > pair[0].time && !(is_stick && rigid) {
                stretches.push((pair[0].time, pair[1].time));
            }
        }
        let all = stretches.len();
        let (Some(first), Some(last)) = (stretches.first(), stretches.last()) else {
            return Ok(Undersampled::default());
        };
        let window = (first.0, last.1);
        let enough =
            |(from, to): (f64, f64)| widest_gap(period.map_or(to - from, |one| one.max((to - from) / LONGEST_FAST)));
        // Widest gap of each stretch.
        let mut gaps = vec![0.0f64; all];
        let (mut next, mut before) = (0, window.0);
        let mut pass = |t: f64| {
            while let Some(&(from, to)) = stretches.get(next).filter(|stretch| stretch.0 < t) {
                gaps[next] = gaps[next].max(t.min(to) - before.max(from));
                if t < to {
                    break;
                }
                next += 1;
            }
            before = t;
        };
        match self.each_sample(&["time"], window, |row| pass(row[0])) {
            Err(error) if error.kind != ErrorKind::NothingInRange => return Err(error),
            _ => {}
        }
        pass(window.1);
        let short = stretches.into_iter().zip(gaps);
        let short = short.filter(|(stretch, widest)| *widest > enough(*stretch));
        Ok(Undersampled {
            stretches: short.map(|(stretch, _)| stretch).collect(),
            of: all,
        })
    }

    /// Curves of channels over a time window. They are thinned without losing extremes, in one pass over the file.
    ///
    /// # Errors
    /// A channel is unknown, the window contains no sample, or the file is unreadable.
    pub fn curves(&self, channels: &[&str], window: (f64, f64)) -> Result<Vec<RunPoints>, Error> {
        let key = |channel: &str| (channel.to_owned(), window.0.to_bits(), window.1.to_bits());
        let new: Vec<&str> = channels
            .iter()
            .copied()
            .filter(|c| !self.cache.borrow().contains_key(&key(c)))
            .collect();
        if !new.is_empty() {
            let (from, to) = (window.0.max(self.times.0), window.1.min(self.times.1));
            let mut thinned = vec![MinMax::new(from, to, BUCKETS); new.len()];
            let sides = new.iter().map(|channel| self.at_events(channel));
            let sides: Vec<Option<Rc<Sides>>> = sides.collect::<Result<_, _>>()?;
            let columns: Vec<&str> = std::iter::once("time").chain(new.iter().copied()).collect();
            self.in_order(&columns, window, self.events_in(window), |moment| match moment {
                RunMoment::Sample(row) => {
                    for (thin, value) in thinned.iter_mut().zip(&row[1..]) {
                        thin.push(row[0], *value);
                    }
                }
                RunMoment::Event(k) => {
                    for (thin, sides) in thinned.iter_mut().zip(&sides) {
                        if let Some(sides) = sides {
                            thin.push(self.events[k].time, sides.before[k]);
                            thin.push(self.events[k].time, sides.after[k]);
                        }
                    }
                }
            })?;
            let mut cache = self.cache.borrow_mut();
            for (channel, thin) in new.iter().zip(thinned) {
                cache.insert(key(channel), thin.finish());
            }
        }
        let cache = self.cache.borrow();
        Ok(channels
            .iter()
            .map(|c| cache.get(&key(c)).cloned().unwrap_or_default())
            .collect())
    }

    /// Passes the samples of a window to `take`, the time first, and between them the indices of events.
    fn in_order(
        &self,
        channels: &[&str],
        window: (f64, f64),
        mut events: Range<usize>,
        mut take: impl FnMut(RunMoment),
    ) -> Result<(), Error> {
        self.each_sample(channels, window, |row| {
            while !events.is_empty() && self.events[events.start].time <= row[0] {
                take(RunMoment::Event(events.start));
                events.start += 1;
            }
            take(RunMoment::Sample(row));
        })?;
        events.for_each(|k| take(RunMoment::Event(k)));
        Ok(())
    }

    /// Passes two channels and the code of the mode to `take`, at each sample and, if known, around each event.
    fn each_state(
        &self,
        (x, y): (&str, &str),
        window: (f64, f64),
        mut take: impl FnMut(usize, f64, f64),
    ) -> Result<(), Error> {
        let sides = self.at_events(x)?.zip(self.at_events(y)?);
        let inside = self.events_in((window.0.next_up(), window.1));
        let before = self.events[..inside.start].last().map(|event| event.mode_after);
        let first = self.stretches.first().map(|stretch| stretch.2);
        let mut mode = before.or(first).map_or(0, |mode| mode as usize);
        self.in_order(&["time", "mode", x, y], window, inside, |moment| {
            match (moment, &sides) {
                (RunMoment::Sample(row), _) => {
                    mode = row[1] as usize;
                    take(mode, row[2], row[3]);
                }
                // Events of other kinds are no turn of the motion. A kick is a jump.
                (RunMoment::Event(k), Some((x, y))) if self.events[k].kind.in_event_sequence() => {
                    take(mode, x.before[k], y.before[k]);
                    // A window that ends with an event shows the state before the event.
                    if self.events[k].time < window.1 {
                        mode = self.events[k].mode_after as usize;
                        take(mode, x.after[k], y.after[k]);
                    }
                }
                _ => {}
            }
        })
    }

    /// One channel over another in a time window, thinned: the lines of each mode that occurs.
    pub fn portrait(&self, x: &str, y: &str, window: (f64, f64)) -> Result<Vec<(Mode, Vec<RunPoints>)>, Error> {
        let empty = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut x_range, mut y_range) = (empty, empty);
        self.each_state((x, y), window, |_, x, y| {
            x_range = (x_range.0.min(x), x_range.1.max(x));
            y_range = (y_range.0.min(y), y_range.1.max(y));
        })?;
        let mut by_mode: Vec<(Mode, DecimatedPortrait)> = Mode::ALL
            .into_iter()
            .map(|mode| (mode, DecimatedPortrait::new(x_range, y_range)))
            .collect();
        let joined = !JUMPING.contains(&x) && !JUMPING.contains(&y);
        let mut current = None;
        self.each_state((x, y), window, |mode, x, y| {
            let left = current.replace(mode).filter(|&before| before != mode);
            if let Some((_, portrait)) = left.and_then(|before| by_mode.get_mut(before)) {
                if joined {
                    portrait.push(x, y);
                }
                portrait.lift();
            }
            if let Some((_, portrait)) = by_mode.get_mut(mode) {
                portrait.push(x, y);
            }
        })?;
        Ok(by_mode
            .into_iter()
            .map(|(mode, portrait)| (mode, portrait.finish()))
            .filter(|(_, lines)| !lines.is_empty())
            .collect())
    }

    /// Values of two channels at the first sample of a window.
    pub fn start(&self, x: &str, y: &str, window: (f64, f64)) -> Result<(f64, f64), Error> {
        let rows = self.drawn_rows(window)?;
        let value = |channel: &str| -> Result<f64, Error> {
            self.axis(channel)?;
            Ok(rows.column(channel, 0..1)?[0])
        };
        Ok((value(x)?, value(y)?))
    }

    /// The end (s) of the part of a window, from its first sample on, without gaps wider than `gap` (s).
    pub(crate) fn dense_until(&self, window: (f64, f64), gap: f64) -> Result<Option<f64>, Error> {
        if self.is_dense(window) {
            return Ok(Some(window.1.min(self.times.1)));
        }
        match self.rows_in(window) {
            Err(error) if error.kind == ErrorKind::NothingInRange => return Ok(None),
            other => other?,
        };
        let (mut last, mut open) = (window.0, true);
        self.each_sample(&["time"], window, |row| {
            open &= row[0] - last <= gap;
            if open {
                last = row[0];
            }
        })?;
        Ok((last > window.0).then_some(last))
    }

    /// Stretches of modes in a window, for the background of a panel. Narrow stretches are merged, with the mode that
    /// has the largest share.
    pub fn ground(&self, (from, to): (f64, f64)) -> Vec<(f64, f64, Mode)> {
        let width = (to - from) / GROUND_CELLS as f64;
        let inside = |s: &&(f64, f64, Mode)| s.1 > from && s.0 < to;
        let shown: Vec<_> = self.stretches.iter().filter(inside).collect();
        if shown.iter().all(|s| s.1.min(to) - s.0.max(from) > width) {
            return shown.iter().map(|s| (s.0.max(from), s.1.min(to), s.2)).collect();
        }
        let mut ground: Vec<(f64, f64, Mode)> = Vec::new();
        let mut first = 0;
        for cell in 0..GROUND_CELLS {
            let (left, right) = (from + width * cell as f64, from + width * (cell + 1) as f64);
            while first < shown.len() && shown[first].1 <= left {
                first += 1;
            }
            let mut shares = [0.0; Mode::ALL.len()];
            for stretch in shown[first..].iter().take_while(|s| s.0 < right) {
                shares[stretch.2 as usize] += stretch.1.min(right) - stretch.0.max(left);
            }
            let largest = Mode::ALL
                .into_iter()
                .max_by(|a, b| shares[*a as usize].total_cmp(&shares[*b as usize]));
            let Some(mode) = largest.filter(|mode| shares[*mode as usize] > 0.0) else {
                continue;
            };
            match ground.last_mut() {
                Some(last) if last.2 == mode && last.1 >= left - 0.5 * width => last.1 = right,
                _ => ground.push((left, right, mode)),
            }
        }
        ground
    }

    /// Events to mark in a window. Only the first change of stability is included, because the grown oscillation
    /// causes the later ones.
    pub fn marks(&self, (from, to): (f64, f64)) -> Vec<(f64, EventKind)> {
        let is_stability = |e: &Event| matches!(e.kind, EventKind::Destabilised | EventKind::Restabilised);
        let first = self.events.iter().position(is_stability);
        let events = self.events.iter().enumerate();
        events
            .filter(|(k, e)| e.time >= from && e.time <= to && (!is_stability(e) || Some(*k) == first))
            .map(|(_, e)| (e.time, e.kind))
            .collect()
    }
}

#[derive(Debug)]
pub(super) struct Sides {
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
}

impl Sides {
    pub(super) fn of_file(file: &ResultFile, channel: &str) -> Result<Sides, Error> {
        Ok(Sides {
            before: file.event_column(&format!("{channel}_before"))?,
            after: file.event_column(&format!("{channel}_after"))?,
        })
    }

    /// A force, a torque, an energy or the mode from the equations, if the state determines it. `first`: initial
    /// mode.
    pub(super) fn of(
        course: &Course,
        file: &ResultFile,
        events: &[Event],
        first: Option<Mode>,
        channel: &str,
    ) -> Result<Option<Sides>, Error> {
        let mut channels = Channels::CHANNELS.iter();
        let of_state = channels.position(|known| known.name == channel && !known.has_history);
        if of_state.is_none() && channel != "mode" {
            return Ok(None);
        }
        let states = states_at_events(file, course, events)?;
        let value = |t: f64, mode: Mode, y: &[f64]| match of_state {
            Some(place) => course.channels(mode, t, y).values()[place],
            None => f64::from(mode as u8),
        };
        let (mut before, mut after) = (Vec::with_capacity(events.len()), Vec::with_capacity(events.len()));
        let mut mode = first.unwrap_or(Mode::SlipForward);
        for (event, (y_before, y_after)) in events.iter().zip(&states) {
            before.push(value(event.time.next_down().max(0.0), mode, y_before));
            mode = event.mode_after;
            after.push(value(event.time, mode, y_after));
        }
        Ok(Some(Sides { before, after }))
    }
}
