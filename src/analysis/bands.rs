//! How far the rows of a trajectory can be off, between its events.
//!
//! At a fixed time, a row near a switch differs between two runs by its rate times the difference of the switches' times,
//! and beside a switch the modes differ: that says again what the events' uncertainties say. So runs are compared at equal
//! phase: each stretch between two neighbouring events is held against the same stretch of the other run, at the same
//! share of the way between its own two events. The band of a stretch is how far the exact solution can be at the phase of
//! a row. What it can be at the row's time is more by the rate times the uncertainty of the times at the stretch's ends.

use super::ladder::{Finished, counterparts, finest_arkode, shares_errors, time_scale, witnesses as witnesses_of};
use super::verdict::{CertifiedEvent, LEAST_WITNESSES, Verdict};
use crate::case::Case;
use crate::friction::Law;
use crate::model::Mode;
use crate::model::system::Pressing;
use crate::provenance::extension;
use crate::record::{Channels, Event, EventKind, MemoryRecorder, Sample, State};
use crate::results::schema;
use crate::simulation::Course;
use crate::simulation::sampling::SampleTimes;
use crate::simulation::{Following, OutputOptions};
use std::ops::Range;

/// No channel is known better than to some roundings of its size. The axial motion is one closed form in every method: there
/// no two runs differ, and this is all that its band says.
const LEAST_BAND: f64 = 16.0 * f64::EPSILON;

/// Name and unit of every column of a row: states, channels and the further ones, as a file of the case has them.
pub fn columns(case: &Case) -> impl Iterator<Item = (String, String)> + use<> {
    let [trajectory, ..] = schema::extended_tables(&extension(case));
    // Time, mode and segment stand before the values.
    let first = State::DESCRIPTIONS[0].0;
    let variables = trajectory.variables.into_iter().skip_while(move |v| v.name != first);
    variables.map(|variable| (variable.name, variable.units))
}

/// At most so many rows are compared, which bounds memory: the ladder keeps them of five runs.
const MOST_ROWS: usize = 200_000;

/// Share of the natural period over which rates are taken, and of the time in which the fastest motion turns by a radian.
const TICK: (f64, f64) = (1e-3, 0.1);

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
    /// For each column, in its unit per second: the largest rate of change in the rows.
    pub rates: Vec<f64>,
}

impl Stretch {
    /// How far the exact solution can be at the time of a row that is further from both events than their uncertainty, in
    /// the unit of the column.
    pub fn at_fixed_time(&self, column: usize) -> f64 {
        self.bands[column] + self.rates[column] * self.time_uncertainty
    }
}

/// How far a channel of the trajectory can be off.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
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
    let rows = times(&plain).count();
    let share = rows.div_ceil(MOST_ROWS).max(1) as f64;
    let mut thinned = plain;
    thinned.interval *= share;
    for window in &mut thinned.windows {
        window.interval *= share;
    }
    thinned
}

/// When samples are due, s.
fn times(output: &OutputOptions) -> Box<dyn Iterator<Item = f64>> {
    let mut due = SampleTimes::new(output);
    Box::new(std::iter::from_fn(move || {
        let time = due.next;
        due.advance();
        time.is_finite().then_some(time)
    }))
}

/// Two times of the same row: origins and intervals are multiplied out in different ways.
pub(super) fn same_row(a: f64, b: f64) -> bool {
    (a - b).abs() <= 16.0 * f64::EPSILON * a.abs().max(b.abs())
}

/// Picks the rows of [`compared_output`] from those of a file, in order of time.
pub struct Compared {
    times: std::iter::Peekable<Box<dyn Iterator<Item = f64>>>,
}

impl Compared {
    /// Of these settings.
    pub fn new(compared: &OutputOptions) -> Compared {
        let times = times(compared).peekable();
        Compared { times }
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
            let first = index
                .checked_sub(1)
                .map_or(Some(None), |before| events[before].map(Some))?;
            let last = events.get(index).map_or(Some(None), |event| event.map(Some))?;
            Some(Span {
                start: first.map_or(0.0, |event| event.time),
                end: last.map_or(end, |event| event.time),
                first,
                last,
            })
        })
        .collect()
}

/// A run, cut at the events that it shares with the result.
struct Cut<'a> {
    spans: Vec<Option<Span<'a>>>,
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

    /// The rows strictly inside of a stretch.
    fn inside(&self, span: &Span) -> Range<usize> {
        let samples = &self.record.samples;
        let from = samples.partition_point(|sample| sample.time <= span.start);
        let to = samples.partition_point(|sample| sample.time < span.end);
        from..to.max(from)
    }
}

/// The larger of two numbers; none if either is none.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Largest difference of each column, and how many rows it is over.
struct Difference {
    largest: Vec<f64>,
    rows: usize,
}

/// A result that is compared, with the equations near its rows.
struct Compare<'a> {
    course: Course,
    result: Cut<'a>,
    /// Number of columns.
    columns: usize,
    /// Further numbers without which the state of a row is not known.
    needed: usize,
    /// Step in time (s) over which rates are taken.
    tick: f64,
}

impl Compare<'_> {
    /// The change of a row in a time `dt` (s); no numbers where its state is not known.
    fn change(&self, row: &Sample, further: &[f64], dt: f64) -> Vec<f64> {
        match further.len() < self.needed {
            true => vec![f64::NAN; self.columns],
            false => self.course.change(row, further, dt),
        }
    }

    /// Holds a stretch of the result against that of another run; `None` if that run has not all of it.
    fn difference(&self, index: usize, span: &Span, other: &Cut) -> Option<Difference> {
        let theirs = other.spans[index].as_ref()?;
        let mut difference = Difference {
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
            // Their row of this time can lie beyond their event: then the states at the event itself stand for it.
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

    /// The largest rate of change of each column in the rows of a stretch and at its ends. The stretch ends with the event of the
    /// same index.
    fn rates(&self, index: usize, span: &Span, mode: Mode) -> Vec<f64> {
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
        // Backward, into the stretch.
        if let Some(event) = span.last {
            let (before, _) = record.further_at_event(index);
            add(&at_event(event, event.before), before, -self.tick);
        }
        rates
    }

    /// The kinetic energies on both sides of all kicks together, J.
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

    /// The least band of each column, in its unit, from its largest magnitude. Two columns are differences of numbers that may
    /// be far larger than they are: the work of a kick is one of kinetic energies, and the residual one of all energies. A normal
    /// force that is given directly is a sum of signals, which may be far larger than it is while the contact is closed. Runs that
    /// share those numbers to the last digit do not show how they are rounded.
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
        let coefficient = system.breakaway.max(system.law.typical_coefficient(fastest));
        let size = |(name, largest): (&str, f64)| match name {
            "work_perturbation" => largest + at_kicks,
            "energy_residual" => energies + at_kicks,
            "applied_force" | "normal_force" => largest.max(force),
            "friction_torque" => largest.max(coefficient * system.radius * force),
            _ => largest,
        };
        named().map(|one| LEAST_BAND * size(one)).collect()
    }
}

/// The distances to the two nearest witnesses, the distance to the finest run of `arkode`, what rounding does to the times at
/// the ends in terms of the channel, and the channel's own rounding. One witness alone may share an error by chance, and
/// one that comes of the long sliding, such as an angle's, is the same in all stretches. A witness that shares errors with
/// the result counts for no less than the nearest that does not.
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
    // The bands and the rates of a stretch; `None` where too few runs have all of it.
    let measured = |index: usize, span: &Span, mode: Mode, rounding: f64| {
        let against = |other: &Cut| compare.difference(index, span, other);
        let seen: Vec<(bool, Difference)> = witnesses
            .iter()
            .filter_map(|(independent, other)| Some((*independent, against(other)?)))
            .collect();
        let finer = arkode
            .as_ref()
            .and_then(against)
            .filter(|_| seen.len() >= LEAST_WITNESSES)?;
        let rates = compare.rates(index, span, mode);
        let band = |(column, least): (usize, &f64)| {
            let distance = |d: &Difference| {
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
    let stretch = |(index, span): (usize, &Span)| {
        let ends = || events[index.saturating_sub(1)..events.len().min(index + 1)].iter();
        // The run up to the first event that is not converged, and no further.
        let known = |event: &CertifiedEvent| event.verdict == Verdict::Converged && event.uncertainty.is_finite();
        let converged = span.end > span.start && events.iter().take(index + 1).all(known);
        let mode = span.first.map_or(first_mode, |event| event.mode_after);
        let rounding = ends().map(|event| event.rounding).fold(0.0, f64::max);
        let found = converged.then(|| measured(index, span, mode, rounding)).flatten();
        let converged = found.is_some();
        let (bands, rates) = found.unwrap_or_else(|| (unknown(), unknown()));
        let of_ends = ends().map(|event| event.uncertainty).fold(0.0, f64::max);
        Stretch {
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
    let stretches: Vec<Stretch> = spans.map(stretch).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource};
    use crate::run::Run;

    /// From each sample of a run to the next, forward and backward, over a two-hundredth of the natural period, through slip,
    /// stick and separation: the run's own columns, to its tolerance.
    #[test]
    fn property_a_sample_moved_to_its_neighbour_is_the_neighbour() {
        let case = Case::read(&CaseSource::built_in("release").unwrap(), &[]).unwrap();
        let case = &case;
        let course = Course::new(&case.system, case.threshold, &case.solver);
        let output = OutputOptions {
            end_time: 0.9,
            interval: 1.2e-6,
            windows: Vec::new(),
            steps: false,
            follow: Following::default(),
        };
        let mut record = MemoryRecorder::default();
        Run::new(case).output(&output).record(&mut record).start().unwrap();
        let names: Vec<(String, String)> = columns(case).collect();
        let mut largest = vec![0.0_f64; names.len()];
        for row in 0..record.samples.len() {
            for (largest, x) in largest.iter_mut().zip(record.values(row)) {
                *largest = largest.max(x.abs());
            }
        }
        let mut modes = Vec::new();
        for next in 1..record.samples.len() {
            let (a, b) = (&record.samples[next - 1], &record.samples[next]);
            let between = record.events.iter().any(|e| (a.time..=b.time).contains(&e.time));
            if a.segment != b.segment || between {
                continue;
            }
            for (from, to) in [(next - 1, next), (next, next - 1)] {
                let row = &record.samples[from];
                let dt = record.samples[to].time - row.time;
                let change = course.change(row, record.further(from), dt);
                let values = record.values(from).into_iter().zip(record.values(to)).zip(change);
                for (k, ((before, after), change)) in values.enumerate() {
                    let error = (before + change - after).abs();
                    // 1e-10 for the run, and a step's (2 pi/200)^5/120 = 3e-10 of an oscillation, which is no larger than
                    // the column; damping and friction have terms of that order too: together below 2e-8. The residual is
                    // rounding itself, of energies.
                    let residual = names[k].0 == "energy_residual";
                    let scale = if residual { 1e-3 } else { largest[k] };
                    let (name, t) = (&names[k].0, row.time);
                    assert!(error <= 2e-8 * scale, "{name} at {t}: {error:e} of {scale:e}");
                }
            }
            if !modes.contains(&a.mode) {
                modes.push(a.mode);
            }
        }
        assert_eq!(modes.len(), 3, "{modes:?}");
    }
}
