//! How far the rows of a trajectory can be off, between its events.
//!
//! At a fixed time, a row near a switch differs between two runs by its rate times the difference of the switches' times,
//! and beside a switch the modes differ: that says again what the events' uncertainties say. So runs are compared at equal
//! phase: each stretch between two neighbouring events is held against the same stretch of the other run, at the same
//! share of the way between its own two events. The band of a stretch is how far the exact solution can be at the phase of
//! a row. What it can be at the row's time is more by the rate times the uncertainty of the times at the stretch's ends.

use super::ladder::{Finished, counterparts, shares_errors};
use super::verdict::{CertifiedEvent, LEAST_WITNESSES, Verdict};
use crate::case::Case;
use crate::model::torsion::TorsionModel;
use crate::model::{Mode, Parameters};
use crate::record::{Channels, Event, EventKind, MemoryRecorder, Sample, State};
use crate::simulation::nearby::{COLUMNS, Nearby, columns, values};
use crate::simulation::sampling::SampleTimes;
use crate::simulation::{Following, OutputOptions};

/// No channel is known better than to some roundings of its size. The axial motion is one closed form in every method: there
/// no two runs differ, and this is all that its band says.
const LEAST_BAND: f64 = 16.0 * f64::EPSILON;

/// The least band of each column, in its unit, of the largest magnitudes of the columns (and, J, the kinetic energies on both
/// sides of all kicks together). Two columns are differences of numbers that may be far larger than they are: the work of a kick
/// is one of kinetic energies, and the residual one of all energies. Runs that share those numbers to the last digit do not show
/// how they are rounded.
pub(super) fn roundings<'n>(names: impl Iterator<Item = &'n str>, largest: &[f64], at_kicks: f64) -> Vec<f64> {
    let named: Vec<(&str, f64)> = names.zip(largest.iter().copied()).collect();
    let is_energy = |name: &str| {
        let starts = ["energy_", "work_", "dissipated_"];
        starts.iter().any(|start| name.starts_with(start)) && name != "energy_residual"
    };
    let energies: f64 = named.iter().filter(|one| is_energy(one.0)).map(|one| one.1).sum();
    let size = |&(name, largest): &(&str, f64)| match name {
        "work_perturbation" => largest + at_kicks,
        "energy_residual" => energies + at_kicks,
        _ => largest,
    };
    named.iter().map(|one| LEAST_BAND * size(one)).collect()
}

/// At most so many rows are compared, which bounds memory: the ladder keeps them of five runs.
const MOST_ROWS: usize = 100_000;

/// Share of the natural period over which rates are taken.
const TICK: f64 = 1e-3;

/// The stretch up to an event, from the one before it; the last goes to the end of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
    /// What the contact does in it.
    pub mode: Mode,
    /// Whether anything can be said of it: the events at its ends are converged. If not, all else is NaN.
    pub converged: bool,
    /// The larger uncertainty of the events at its ends, s.
    pub time_uncertainty: f64,
    /// For each column, in its unit: how far the exact solution can be at the same share of its own way between the two
    /// events. NaN where no row lies in the stretch.
    pub bands: Vec<f64>,
    /// For each column, in its unit per second: the largest rate of change in the rows. None where the bands are at a fixed time.
    pub rates: Vec<f64>,
}

impl Stretch {
    /// How far the exact solution can be at the time of a row that is further from both events than their uncertainty, in
    /// the unit of the column.
    pub fn at_fixed_time(&self, column: usize) -> f64 {
        let of_time = self.rates.get(column).map_or(0.0, |rate| rate * self.time_uncertainty);
        self.bands[column] + of_time
    }
}

/// How far a channel of the trajectory can be off.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelBand {
    /// Of the channel.
    pub name: String,
    /// UDUNITS.
    pub unit: String,
    /// The largest band of a stretch, in the channel's unit; infinite if nothing can be said.
    pub band: f64,
    /// The largest at fixed time.
    pub at_fixed_time: f64,
    /// Largest magnitude of the channel in the rows.
    pub largest: f64,
}

/// The bands of a result.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bands {
    /// One for each event, and one to the end of the run.
    pub stretches: Vec<Stretch>,
    /// Over all stretches that are converged.
    pub channels: Vec<ChannelBand>,
}

impl Bands {
    /// Takes the uncertainties of the events for those at the ends of the stretches. A stretch with an end that is not
    /// converged any more is not either.
    pub(super) fn retime(&mut self, events: &[CertifiedEvent]) {
        for (index, stretch) in self.stretches.iter_mut().enumerate() {
            let last = events.len().min(index + 1);
            let ends = || events[index.saturating_sub(1).min(last)..last].iter();
            stretch.converged &= ends().all(|event| event.verdict == Verdict::Converged);
            if stretch.converged {
                stretch.time_uncertainty = ends().map(|event| event.uncertainty).fold(0.0, f64::max);
            } else {
                stretch.time_uncertainty = f64::NAN;
                stretch.bands.fill(f64::NAN);
                stretch.rates.fill(f64::NAN);
            }
        }
        for (column, channel) in self.channels.iter_mut().enumerate() {
            channel.band = over(&self.stretches, &|s| s.bands[column]);
            channel.at_fixed_time = over(&self.stretches, &|s| s.at_fixed_time(column));
        }
    }
}

/// The largest of a value over the stretches that are converged; infinite if nothing can be said.
fn over(stretches: &[Stretch], value: &dyn Fn(&Stretch) -> f64) -> f64 {
    let known = stretches
        .iter()
        .filter(|s| s.converged)
        .map(value)
        .filter(|x| x.is_finite());
    known.reduce(f64::max).unwrap_or(f64::INFINITY)
}

/// The rows that are compared: those that the settings ask for, without the integrator's own steps, or, where they are more
/// than can be kept of several runs, every second, third, ... of them. Samples around events are left out: runs that differ have
/// them at other times.
pub fn compared_output(output: &OutputOptions) -> OutputOptions {
    let plain = OutputOptions {
        steps: false,
        follow: Following::default(),
        ..output.clone()
    };
    let rows = Times::new(&plain).count();
    let share = rows.div_ceil(MOST_ROWS).max(1) as f64;
    let mut thinned = plain;
    thinned.interval *= share;
    for window in &mut thinned.windows {
        window.interval *= share;
    }
    thinned
}

struct Times(SampleTimes);

impl Times {
    fn new(output: &OutputOptions) -> Times {
        Times(SampleTimes::new(output))
    }
}

impl Iterator for Times {
    type Item = f64;
    fn next(&mut self) -> Option<f64> {
        let time = Some(self.0.next()).filter(|time| time.is_finite());
        self.0.advance();
        time
    }
}

/// Two times of the same row: origins and intervals are multiplied out in different ways.
pub(super) fn same_row(a: f64, b: f64) -> bool {
    (a - b).abs() <= 16.0 * f64::EPSILON * a.abs().max(b.abs())
}

/// Picks the rows of [`compared_output`] from those of a file, in order of time.
pub struct Compared {
    times: std::iter::Peekable<Times>,
}

impl Compared {
    /// Of these settings.
    pub fn new(compared: &OutputOptions) -> Compared {
        Compared {
            times: Times::new(compared).peekable(),
        }
    }

    /// Whether the row of this time (s), later than all before, is one of them.
    pub fn takes(&mut self, time: f64) -> bool {
        while self.times.next_if(|due| *due < time && !same_row(*due, time)).is_some() {}
        self.times.next_if(|due| same_row(*due, time)).is_some()
    }
}

/// A stretch of one run: from and to (s), and the events at its ends.
struct Span<'a> {
    start: f64,
    end: f64,
    first: Option<&'a Event>,
    last: Option<&'a Event>,
}

/// The stretch before each event, and that after the last if the run has no more of them. `None` where an event at an end
/// is missing.
fn spans<'a>(events: &[Option<&'a Event>], no_more: bool, end: f64) -> Vec<Option<Span<'a>>> {
    (0..=events.len())
        .map(|index| {
            if index == events.len() && !no_more {
                return None;
            }
            let first = match index {
                0 => None,
                _ => Some(events[index - 1]?),
            };
            let last = match events.get(index) {
                None => None,
                Some(event) => Some((*event)?),
            };
            Some(Span {
                start: first.map_or(0.0, |event| event.time),
                end: last.map_or(end, |event| event.time),
                first,
                last,
            })
        })
        .collect()
}

/// Another run, cut at the events that it shares with the result.
struct Other<'a> {
    spans: Vec<Option<Span<'a>>>,
    samples: &'a [Sample],
}

impl<'a> Other<'a> {
    fn new(events: &[Event], run: &'a Finished, end: f64) -> Other<'a> {
        let no_more = run.rung.events == run.rung.agreeing;
        Other {
            spans: spans(&counterparts(events, run), no_more, end),
            samples: &run.recorder.samples,
        }
    }
}

/// Largest difference of each column, and how many rows it is over.
struct Difference {
    largest: [f64; COLUMNS],
    rows: usize,
}

/// Holds a stretch of the result against that of another run.
fn difference(nearby: &Nearby, own: (&Span, &[Sample]), other: (&Span, &[Sample])) -> Difference {
    let mut difference = Difference {
        largest: [0.0; COLUMNS],
        rows: 0,
    };
    let mut add = |column: usize, distance: f64| {
        let largest = &mut difference.largest[column];
        *largest = if distance.is_nan() {
            distance
        } else {
            largest.max(distance)
        };
    };
    let (span, theirs) = (own.0, other.0);
    let mut ends = |a: Option<&State>, b: Option<&State>| {
        if let (Some(a), Some(b)) = (a, b) {
            for (column, (a, b)) in a.values().into_iter().zip(b.values()).enumerate() {
                add(column, (a - b).abs());
            }
        }
    };
    ends(span.first.map(|e| &e.after), theirs.first.map(|e| &e.after));
    ends(span.last.map(|e| &e.before), theirs.last.map(|e| &e.before));
    let mut rest = other.1.iter().peekable();
    for row in own.1 {
        while rest
            .next_if(|near| near.time < row.time && !same_row(near.time, row.time))
            .is_some()
        {}
        // Their row of this time can lie beyond their event: then the states at the event itself stand for it.
        let inside = |near: &&&Sample| {
            near.mode == row.mode && same_row(near.time, row.time) && near.time > theirs.start && near.time < theirs.end
        };
        let Some(near) = rest.peek().filter(inside) else {
            continue;
        };
        let share = (row.time - span.start) / (span.end - span.start);
        let time = theirs.start + share * (theirs.end - theirs.start);
        let change = nearby.change(near, time - near.time);
        let (own, other) = (values(row), values(near));
        for column in 0..COLUMNS {
            add(column, (own[column] - other[column] - change[column]).abs());
        }
        difference.rows += 1;
    }
    difference
}

/// The rows strictly inside of a stretch.
fn inside<'a>(samples: &'a [Sample], span: &Span) -> &'a [Sample] {
    let from = samples.partition_point(|sample| sample.time <= span.start);
    let to = samples.partition_point(|sample| sample.time < span.end);
    &samples[from..to.max(from)]
}

/// The distances to the two nearest witnesses, the distance to the finest run of `auto`, what rounding does to the times at
/// the ends in terms of the channel, and the channel's own rounding. One witness alone may share an error by chance, and
/// one that comes of the long sliding, such as an angle's, is the same in all stretches. A witness that shares errors with
/// the result counts for no less than the nearest that does not.
pub(super) fn bands(
    (case, disks): (&Case, &Parameters),
    result: &MemoryRecorder,
    witnesses: &[&Finished],
    auto: Option<&Finished>,
    events: &[CertifiedEvent],
) -> Bands {
    let nearby = Nearby::new(disks);
    let torsion = TorsionModel::new(disks);
    let tick = TICK * torsion.natural_period();
    let end_time = case.output.end_time;
    let mut largest = [0.0_f64; COLUMNS];
    for row in &result.samples {
        for (largest, value) in largest.iter_mut().zip(values(row)) {
            *largest = largest.max(value.abs());
        }
    }
    let kicks = result.events.iter().filter(|event| event.kind == EventKind::Kick);
    let kinetic = |state: &State| torsion.torsion.kinetic_energy(&state.torsional().state());
    let at_kicks = kicks.map(|event| kinetic(&event.before) + kinetic(&event.after)).sum();
    let least = roundings(columns().map(|column| column.0), &largest, at_kicks);
    let witnesses: Vec<(bool, Other)> = witnesses
        .iter()
        .map(|run| {
            let independent = !shares_errors(run, case.solver.method);
            (independent, Other::new(&result.events, run, end_time))
        })
        .collect();
    let auto = auto.map(|run| Other::new(&result.events, run, end_time));
    let own: Vec<Option<&Event>> = result.events.iter().map(Some).collect();
    let stretches: Vec<Stretch> = spans(&own, true, end_time)
        .into_iter()
        .flatten()
        .enumerate()
        .map(|(index, span)| {
            let rows = inside(&result.samples, &span);
            let ends = || events[index.saturating_sub(1)..events.len().min(index + 1)].iter();
            // The run up to the first event that is not converged, and no further.
            let known = |event: &CertifiedEvent| event.verdict == Verdict::Converged && event.uncertainty.is_finite();
            let mut stretch = Stretch {
                start: span.start,
                end: span.end,
                mode: span.first.map_or_else(|| first_mode(result), |event| event.mode_after),
                converged: span.end > span.start && events.iter().take(index + 1).all(known),
                time_uncertainty: ends().map(|event| event.uncertainty).fold(0.0, f64::max),
                bands: vec![f64::NAN; COLUMNS],
                rates: vec![f64::NAN; COLUMNS],
            };
            if !stretch.converged {
                stretch.time_uncertainty = f64::NAN;
                return stretch;
            }
            let against = |other: &Other| -> Option<Difference> {
                let theirs = other.spans[index].as_ref()?;
                Some(difference(
                    &nearby,
                    (&span, rows),
                    (theirs, inside(other.samples, theirs)),
                ))
            };
            let seen: Vec<(bool, Difference)> = witnesses
                .iter()
                .filter_map(|(independent, other)| Some((*independent, against(other)?)))
                .collect();
            let finer = auto.as_ref().and_then(against);
            stretch.converged &= seen.len() >= LEAST_WITNESSES && finer.is_some();
            if !stretch.converged {
                stretch.time_uncertainty = f64::NAN;
                return stretch;
            }
            let rounding = ends().map(|event| event.rounding).fold(0.0, f64::max);
            stretch.rates = rates(&nearby, &span, stretch.mode, rows, tick).to_vec();
            for (column, least) in least.iter().enumerate() {
                let compared = |d: &&Difference| column < State::COUNT || d.rows > 0;
                let two_nearest = two_nearest(
                    seen.iter()
                        .filter(|(_, d)| compared(&d))
                        .map(|(independent, d)| (*independent, d.largest[column])),
                );
                let finer = finer
                    .iter()
                    .find(|d| compared(d))
                    .map_or(f64::NAN, |d| d.largest[column]);
                let rounding = stretch.rates[column] * rounding + least;
                stretch.bands[column] = two_nearest + finer + rounding;
            }
            stretch
        })
        .collect();
    let channels = columns().enumerate().map(|(column, (name, unit, _))| ChannelBand {
        name: (*name).to_owned(),
        unit: (*unit).to_owned(),
        band: over(&stretches, &|s| s.bands[column]),
        at_fixed_time: over(&stretches, &|s| s.at_fixed_time(column)),
        largest: largest[column],
    });
    let channels = channels.collect();
    Bands { stretches, channels }
}

/// The sum of the two least distances, of (whether it is to an independent witness, distance): one that is not counts for
/// no less than the least of those that are. NaN without an independent one and another.
fn two_nearest(distances: impl Iterator<Item = (bool, f64)>) -> f64 {
    let (mut independent, mut others) = (Vec::new(), Vec::new());
    for (is_independent, distance) in distances {
        if is_independent { &mut independent } else { &mut others }.push(distance);
    }
    independent.sort_by(f64::total_cmp);
    let Some(nearest) = independent.first().copied() else {
        return f64::NAN;
    };
    others.extend(&independent[1..]);
    others.sort_by(f64::total_cmp);
    match others.first() {
        Some(second) if *second < nearest => 2.0 * nearest,
        Some(second) => nearest + second,
        None => f64::NAN,
    }
}

/// Before any event.
fn first_mode(result: &MemoryRecorder) -> Mode {
    result.samples.first().map_or(Mode::SlipForward, |row| row.mode)
}

/// The largest rate of change of each column in the rows and at the events.
fn rates(nearby: &Nearby, span: &Span, mode: Mode, rows: &[Sample], tick: f64) -> [f64; COLUMNS] {
    let mut rates = [0.0_f64; COLUMNS];
    let mut add = |row: &Sample, tick: f64| {
        for (rate, change) in rates.iter_mut().zip(nearby.change(row, tick)) {
            *rate = rate.max((change / tick).abs());
        }
    };
    let at_event = |event: &Event, state: State| Sample {
        time: event.time,
        mode,
        segment: 0,
        state,
        channels: Channels::default(),
    };
    rows.iter().for_each(|row| add(row, tick));
    span.first
        .iter()
        .for_each(|event| add(&at_event(event, event.after), tick));
    // Backward, into the stretch.
    span.last
        .iter()
        .for_each(|event| add(&at_event(event, event.before), -tick));
    rates
}
