//! Error bands of a trajectory's rows between its events.
//!
//! At a fixed time, a row near an event differs between two runs by its rate times the difference of the event times.
//! This difference only repeats the events' uncertainties, so runs are compared at equal phase: a stretch between two
//! events is compared with the same stretch of the other run, at the same fraction of the way between its events. The
//! band of a stretch bounds the error at the phase of a row. At the row's time, the rate times the uncertainty of the
//! stretch's ends is added.

use super::ladder::{
    CertifiedEvent, Finished, LEAST_WITNESSES, Verdict, counterparts, finest_arkode, shares_errors, time_scale,
    witnesses as witnesses_of,
};
use crate::provenance::extension;
use std::ops::Range;
use stickslip_case::Case;
use stickslip_engine::simulation::sampling::SampleTimes;
use stickslip_engine::simulation::{Course, Following, OutputOptions};
use stickslip_files::schema;
use stickslip_system::friction::Law;
use stickslip_system::model::Mode;
use stickslip_system::model::system::Pressing;
use stickslip_system::record::{Channels, Event, EventKind, MemoryRecorder, Sample, State, channel};

/// Several roundings of the channel's size. The axial motion, a closed form in every method, has only this band.
const LEAST_BAND: f64 = 16.0 * f64::EPSILON;

/// Name and unit of every column of a result's rows: states, channels, then further columns.
pub fn columns(case: &Case) -> impl Iterator<Item = (String, String)> + use<> {
    let [trajectory, ..] = schema::extended_tables(&extension(case));
    // Time, mode and segment precede the values.
    let first = State::CHANNELS[0].name;
    let variables = trajectory.variables.into_iter().skip_while(move |v| v.name != first);
    variables.map(|variable| (variable.name, variable.units))
}

/// Largest number of compared rows. It bounds memory: the ladder keeps the rows of five runs.
const MOST_ROWS: usize = 200_000;

/// Time step of the rates: fraction of the natural period, and of the time for one radian of the fastest motion.
const TICK: (f64, f64) = (1e-3, 0.1);

/// Stretch between an event and its predecessor. The last stretch ends with the run.
#[derive(Debug, Clone, PartialEq)]
pub struct BandStretch {
    /// Start, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
    /// Mode of the contact.
    pub mode: Mode,
    /// Whether the events at both ends have converged. If not, all numbers are NaN.
    pub converged: bool,
    /// The larger uncertainty of the events at both ends, s.
    pub time_uncertainty: f64,
    /// Error bound of each column at equal phase, in its unit; NaN if no row lies in the stretch.
    pub bands: Vec<f64>,
    /// Largest rate of each column in the rows, in its unit per second.
    pub rates: Vec<f64>,
}

impl BandStretch {
    /// Error bound at the time of a row, in the column's unit. It holds beyond the uncertainty of both events.
    pub fn at_fixed_time(&self, column: usize) -> f64 {
        self.bands[column] + self.rates[column] * self.time_uncertainty
    }
}

/// Error bound of a channel of the trajectory.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ChannelBand {
    /// Name of the channel.
    pub name: String,
    /// Unit of the channel (UDUNITS).
    pub unit: String,
    /// Largest band of a stretch, in the channel's unit; infinite if no stretch has converged.
    pub band: f64,
    /// Largest error bound at fixed time, in the channel's unit.
    pub at_fixed_time: f64,
    /// Largest magnitude of the channel in the rows.
    pub largest: f64,
}

/// Bands of a result.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bands {
    /// One stretch before each event, and one to the end of the run.
    pub stretches: Vec<BandStretch>,
    /// Maxima over all converged stretches.
    pub channels: Vec<ChannelBand>,
}

impl Bands {
    /// Replaces the uncertainties at the ends of the stretches. A stretch stays converged only if both its events are.
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

fn over(stretches: &[BandStretch], value: &dyn Fn(&BandStretch) -> f64) -> f64 {
    let known = stretches
        .iter()
        .filter(|s| s.converged)
        .map(value)
        .filter(|x| x.is_finite());
    known.reduce(f64::max).unwrap_or(f64::INFINITY)
}

/// Output settings of the compared rows: the case's samples, thinned if too many, without steps and event samples.
pub fn compared_output(output: &OutputOptions) -> OutputOptions {
    let plain = OutputOptions {
        steps: false,
        follow: Following::default(),
        ..output.clone()
    };
    let rows = times(&plain).count();
    let share = rows.div_ceil(MOST_ROWS).max(1) as f64;
    let mut thinned = plain;
    thinned.interval *= share;
    for window in &mut thinned.windows {
        window.interval *= share;
    }
    thinned
}

fn times(output: &OutputOptions) -> Box<dyn Iterator<Item = f64>> {
    let mut due = SampleTimes::new(output);
    Box::new(std::iter::from_fn(move || {
        let time = due.next;
        due.advance();
        time.is_finite().then_some(time)
    }))
}

/// Whether two times belong to one row. Runs round sums of intervals differently.
pub(super) fn same_row(a: f64, b: f64) -> bool {
    (a - b).abs() <= 16.0 * f64::EPSILON * a.abs().max(b.abs())
}

/// Selects the rows of [`compared_output`] from a file's rows in order of time.
pub struct Compared {
    times: std::iter::Peekable<Box<dyn Iterator<Item = f64>>>,
}

impl Compared {
    /// Selection for these settings.
    pub fn new(compared: &OutputOptions) -> Compared {
        let times = times(compared).peekable();
        Compared { times }
    }

    /// Whether the row at this time (s) is selected. Times must increase.
    pub fn takes(&mut self, time: f64) -> bool {
        while self.times.next_if(|due| *due < time && !same_row(*due, time)).is_some() {}
        self.times.next_if(|due| same_row(*due, time)).is_some()
    }
}

struct BandSpan<'a> {
    start: f64,
    end: f64,
    first: Option<&'a Event>,
    last: Option<&'a Event>,
}

/// One stretch before each event, and one after the last event if the run has no more; `None` if an end is missing.
fn spans<'a>(events: &[Option<&'a Event>], no_more: bool, end: f64) -> Vec<Option<BandSpan<'a>>> {
    (0..=events.len())
        .map(|index| {
            if index == events.len() && !no_more {
                return None;
            }
            let first = index
                .checked_sub(1)
                .map_or(Some(None), |before| events[before].map(Some))?;
            let last = events.get(index).map_or(Some(None), |event| event.map(Some))?;
            Some(BandSpan {
                start: first.map_or(0.0, |event| event.time),
                end: last.map_or(end, |event| event.time),
                first,
                last,
            })
        })
        .collect()
}

struct Cut<'a> {
    spans: Vec<Option<BandSpan<'a>>>,
    record: &'a MemoryRecorder,
}

impl<'a> Cut<'a> {
    fn new(events: &[Event], run: &'a Finished, end: f64) -> Cut<'a> {
        let no_more = run.rung.events == run.rung.agreeing;
        Cut {
            spans: spans(&counterparts(events, run), no_more, end),
            record: &run.recorder,
        }
    }

    fn inside(&self, span: &BandSpan) -> Range<usize> {
        let samples = &self.record.samples;
        let from = samples.partition_point(|sample| sample.time <= span.start);
        let to = samples.partition_point(|sample| sample.time < span.end);
        from..to.max(from)
    }
}

fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

struct BandDifference {
    largest: Vec<f64>,
    rows: usize,
}

struct Compare<'a> {
    course: Course,
    result: Cut<'a>,
    columns: usize,
    /// Required length of the further state; the state of a shorter row is unknown.
    needed: usize,
    tick: f64,
}

impl Compare<'_> {
    fn change(&self, row: &Sample, further: &[f64], dt: f64) -> Vec<f64> {
        match further.len() < self.needed {
            true => vec![f64::NAN; self.columns],
            false => self.course.change(row, further, dt),
        }
    }

    fn difference(&self, index: usize, span: &BandSpan, other: &Cut) -> Option<BandDifference> {
        let theirs = other.spans[index].as_ref()?;
        let mut difference = BandDifference {
            largest: vec![0.0; self.columns],
            rows: 0,
        };
        let mut add = |column: usize, distance: f64| {
            difference.largest[column] = larger(difference.largest[column], distance);
        };
        let mut ends = |a: Option<&State>, b: Option<&State>| {
            if let (Some(a), Some(b)) = (a, b) {
                for (column, (a, b)) in a.values().into_iter().zip(b.values()).enumerate() {
                    add(column, (a - b).abs());
                }
            }
        };
        ends(span.first.map(|e| &e.after), theirs.first.map(|e| &e.after));
        ends(span.last.map(|e| &e.before), theirs.last.map(|e| &e.before));
        let (result, record) = (self.result.record, other.record);
        let mut rest = other.inside(theirs).peekable();
        for own in self.result.inside(span) {
            let row = &result.samples[own];
            let is_earlier = |near: &Sample| near.time < row.time && !same_row(near.time, row.time);
            while rest.next_if(|near| is_earlier(&record.samples[*near])).is_some() {}
            // Their row at this time can lie beyond their event. The states at the event then replace it.
            let Some(&place) = rest.peek() else { break };
            let near = &record.samples[place];
            let inside = near.time > theirs.start && near.time < theirs.end;
            if near.mode != row.mode || !same_row(near.time, row.time) || !inside {
                continue;
            }
            let share = (row.time - span.start) / (span.end - span.start);
            let time = theirs.start + share * (theirs.end - theirs.start);
            let change = self.change(near, record.further(place), time - near.time);
            let pairs = result.values(own).into_iter().zip(record.values(place)).zip(change);
            for (column, ((own, other), change)) in pairs.enumerate() {
                add(column, (own - other - change).abs());
            }
            difference.rows += 1;
        }
        Some(difference)
    }

    fn rates(&self, index: usize, span: &BandSpan, mode: Mode) -> Vec<f64> {
        let record = self.result.record;
        let mut rates = vec![0.0_f64; self.columns];
        let mut add = |row: &Sample, further: &[f64], tick: f64| {
            for (rate, change) in rates.iter_mut().zip(self.change(row, further, tick)) {
                *rate = larger(*rate, (change / tick).abs());
            }
        };
        let at_event = |event: &Event, state: State| Sample {
            time: event.time,
            mode,
            segment: 0,
            state,
            channels: Channels::default(),
        };
        for row in self.result.inside(span) {
            add(&record.samples[row], record.further(row), self.tick);
        }
        if let Some(event) = span.first {
            let (_, after) = record.further_at_event(index - 1);
            add(&at_event(event, event.after), after, self.tick);
        }
        // Backward difference, into the stretch.
        if let Some(event) = span.last {
            let (before, _) = record.further_at_event(index);
            add(&at_event(event, event.before), before, -self.tick);
        }
        rates
    }

    fn kinetic_energy_at_kicks(&self) -> f64 {
        let (record, system) = (self.result.record, self.course.system());
        let kinetic = |t: f64, state: &State, further: &[f64]| {
            if further.len() < self.needed {
                return f64::NAN;
            }
            let y = self.course.state(state, further);
            system.kinetic_energy(&self.course.outside(t), &y)
        };
        let kicks = record.events.iter().enumerate();
        let kicks = kicks.filter(|(_, event)| event.kind == EventKind::Kick);
        kicks
            .map(|(index, event)| {
                let (before, after) = record.further_at_event(index);
                kinetic(event.time, &event.before, before) + kinetic(event.time, &event.after, after)
            })
            .sum()
    }

    /// Least band of each column, in its unit, from the column's largest magnitude. The work of a kick, the residual
    /// and a prescribed normal force are small differences of large numbers: equal runs do not show their rounding.
    fn roundings(&self, case: &Case, names: &[(String, String)], largest: &[f64]) -> Vec<f64> {
        let named = || names.iter().map(|one| one.0.as_str()).zip(largest.iter().copied());
        let is_energy = |name: &str| {
            let starts = ["energy_", "work_", "dissipated_"];
            starts.iter().any(|start| name.starts_with(start)) && name != "energy_residual"
        };
        let energies: f64 = named().filter(|one| is_energy(one.0)).map(|one| one.1).sum();
        let at_kicks = self.kinetic_energy_at_kicks();
        let is_direct = matches!(case.system.pressing, Pressing::Force(_));
        let force = if is_direct { self.course.largest_force() } else { 0.0 };
        let (system, fastest) = (
            self.course.system(),
            named()
                .find(|one| one.0 == "relative_velocity")
                .map_or(0.0, |one| one.1),
        );
        let coefficient = system.larger_breakaway().1.max(system.law.typical_coefficient(fastest));
        let size_of = |(name, largest): (&str, f64)| match name {
            "work_perturbation" => largest + at_kicks,
            "energy_residual" => energies + at_kicks,
            "applied_force" | "normal_force" => largest.max(force),
            "friction_torque" => largest.max(coefficient * system.radius * force),
            _ => largest,
        };
        let size = |one: (&str, f64)| match channel::factors(one.0) {
            Some(factors) => named().filter(|one| factors.contains(&one.0)).map(size_of).product(),
            None => size_of(one),
        };
        named().map(|one| LEAST_BAND * size(one)).collect()
    }
}

/// A band is the sum of the distances to the two nearest witnesses, the distance to the finest run of `arkode`, the
/// effect of the rounded event times on the channel, and the channel's own rounding. One witness may share an error by
/// chance. An error from the long sliding, such as an angle's, is the same in all stretches. A witness that shares
/// errors with the result counts no less than the nearest independent witness.
pub(super) fn bands(case: &Case, result: &MemoryRecorder, ladder: &[Finished], events: &[CertifiedEvent]) -> Bands {
    let names: Vec<(String, String)> = columns(case).collect();
    let (method, end_time) = (case.solver.method, case.output.end_time);
    let course = Course::new(&case.system, case.threshold, &case.solver);
    let own: Vec<Option<&Event>> = result.events.iter().map(Some).collect();
    let needed = course.further().len();
    let compare = Compare {
        tick: (TICK.0 * time_scale(case)).min(TICK.1 / course.fastest_rate()),
        course,
        result: Cut {
            spans: spans(&own, true, end_time),
            record: result,
        },
        columns: names.len(),
        needed,
    };
    let mut largest = vec![0.0_f64; names.len()];
    for row in 0..result.samples.len() {
        for (largest, value) in largest.iter_mut().zip(result.values(row)) {
            *largest = largest.max(value.abs());
        }
    }
    let least = compare.roundings(case, &names, &largest);
    let cut = |run| Cut::new(&result.events, run, end_time);
    let witnesses: Vec<(bool, Cut)> = witnesses_of(ladder, method)
        .into_iter()
        .map(|run| (!shares_errors(run, method), cut(run)))
        .collect();
    let arkode = finest_arkode(ladder).map(cut);
    let first_mode = result.samples.first().map_or(Mode::SlipForward, |row| row.mode);
    let unknown = || vec![f64::NAN; names.len()];
    let measured = |index: usize, span: &BandSpan, mode: Mode, rounding: f64| {
        let against = |other: &Cut| compare.difference(index, span, other);
        let seen: Vec<(bool, BandDifference)> = witnesses
            .iter()
            .filter_map(|(independent, other)| Some((*independent, against(other)?)))
            .collect();
        let finer = arkode
            .as_ref()
            .and_then(against)
            .filter(|_| seen.len() >= LEAST_WITNESSES)?;
        let rates = compare.rates(index, span, mode);
        let band = |(column, least): (usize, &f64)| {
            let distance = |d: &BandDifference| {
                let is_compared = column < State::COUNT || d.rows > 0;
                is_compared.then(|| d.largest[column])
            };
            let distances = seen
                .iter()
                .filter_map(|(independent, d)| Some((*independent, distance(d)?)));
            two_nearest(distances) + distance(&finer).unwrap_or(f64::NAN) + (rates[column] * rounding + least)
        };
        let bands = least.iter().enumerate().map(band).collect();
        Some((bands, rates))
    };
    let stretch = |(index, span): (usize, &BandSpan)| {
        let ends = || events[index.saturating_sub(1)..events.len().min(index + 1)].iter();
        // Bands stop at the first event that has not converged.
        let known = |event: &CertifiedEvent| event.verdict == Verdict::Converged && event.uncertainty.is_finite();
        let converged = span.end > span.start && events.iter().take(index + 1).all(known);
        let mode = span.first.map_or(first_mode, |event| event.mode_after);
        let rounding = ends().map(|event| event.rounding).fold(0.0, f64::max);
        let found = converged.then(|| measured(index, span, mode, rounding)).flatten();
        let converged = found.is_some();
        let (bands, rates) = found.unwrap_or_else(|| (unknown(), unknown()));
        let of_ends = ends().map(|event| event.uncertainty).fold(0.0, f64::max);
        BandStretch {
            start: span.start,
            end: span.end,
            mode,
            converged,
            time_uncertainty: if converged { of_ends } else { f64::NAN },
            bands,
            rates,
        }
    };
    let spans = compare.result.spans.iter().flatten().enumerate();
    let stretches: Vec<BandStretch> = spans.map(stretch).collect();
    let channels = names.into_iter().enumerate().map(|(column, (name, unit))| ChannelBand {
        name,
        unit,
        band: over(&stretches, &|s| s.bands[column]),
        at_fixed_time: over(&stretches, &|s| s.at_fixed_time(column)),
        largest: largest[column],
    });
    let channels = channels.collect();
    Bands { stretches, channels }
}

/// Sum of the two least (independent, distance) pairs. A dependent distance counts no less than the least independent
/// distance. NaN if there is no independent distance, or only one distance.
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
