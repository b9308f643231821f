//! Solvers with steps; the step sizes and tolerances follow from the candidate.

use super::evidence::Evidence;
use super::fit::fitted;
use super::judge::{ALL, CLOSE, Judged, OF_FITTED};
use super::motion::Played;
use super::number::{self, ChangedNumber};
use super::search::{Search, Tried};
use super::stepper::{Scheme, Stepper, Stop};
use super::{Cause, Causes, Proposal, proposals};
use crate::Channel;
use crate::diagnosis::{CauseKind, Diagnosis, limit_of, round_above};
use crate::reference::Physics;
use stickslip_engine::workers::over_processors;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::{Difference, Fault};

/// Steps up to this times the interval of samples are as long as it.
const LONGER: f64 = 1.001;
/// Longer steps than a natural period divided by this are long.
const LONG: f64 = 20.0;
const PARTS: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
/// Steps in a natural period for a first estimate of a method's error.
const FINE: f64 = 100.0;

fn fine(order: i32) -> f64 {
    match order {
        1 => 2000.0,
        2 => 200.0,
        _ => 40.0,
    }
}
/// Tolerance of whole numbers of steps in an interval, and of intervals in a step.
const WHOLE: f64 = 0.05;
/// Most multiples of a step; tolerance of event times, in steps; and fewest events.
const MOST_MULTIPLES: u32 = 200_000;
const OFF: f64 = 1e-3;
const FEWEST_EVENTS: usize = 5;
/// A stick begins below this part of slip speeds.
const SLOW: f64 = 0.3;
const STICKS: usize = 20;
const FITTED: usize = 2;
/// Typical digits of tolerances, over this many decades below the largest.
const USUAL: [f64; 3] = [1.0, 2.0, 5.0];
const DECADES: i32 = 4;
/// Most natural periods by which a stick is earlier than the reference's.
const NEAR: f64 = 0.125;

impl Evidence<'_> {
    /// Solvers with a step that ends at each sample, or with several steps between two samples. At the end of a step a sample may show
    /// either side of an event.
    fn possible(&self, steppers: impl IntoIterator<Item = Stepper>) -> Vec<Stepper> {
        let longest = self
            .observation
            .map_or(f64::INFINITY, |seen| seen.interval.unwrap_or(seen.spacing));
        let mut possible = Vec::new();
        for stepper in steppers.into_iter().filter(|stepper| stepper.step <= LONGER * longest) {
            let other = Stepper {
                shows_before: true,
                ..stepper
            };
            possible.push(stepper);
            possible.extend((!stepper.located).then_some(other));
        }
        possible
    }

    /// Variants of a solver by its handling of an event.
    fn variants(&self, stepper: Stepper) -> Vec<Stepper> {
        let has_band = matches!(stepper.stop, Stop::Within(band) | Stop::Frozen(band) if band > 0.0);
        // The law in a step through zero matters if a step is long, or if a slip begins with a remaining speed.
        let matters = stepper.step * LONG > self.period || matches!(stepper.stop, Stop::Frozen(_));
        let with_law = stepper.scheme != Scheme::Exact && matters;
        let each = [(false, false), (false, true), (true, false), (true, true)].into_iter();
        let possible = each.filter(|(strict, even)| (has_band || !strict) && (with_law || !even) && !stepper.located);
        let variant = |(strict, even)| Stepper {
            strict,
            even,
            ..stepper
        };
        possible.map(variant).collect()
    }

    fn stepped(&self, stepper: &Stepper, rows: usize) -> Option<Played> {
        self.stepped_from(self.physics, stepper, 1.0, rows)
    }

    /// Like [`Self::stepped`], with other parameters of the case, or from a multiple of the state.
    fn stepped_from(&self, physics: &Physics, stepper: &Stepper, factor: f64, rows: usize) -> Option<Played> {
        let (time, state) = self.origin.as_ref()?;
        self.count_run()?;
        let state: Vec<f64> = state.iter().map(|y| factor * y).collect();
        let seen = self.observation;
        let kicks = &self.kicked(&physics.trains).kicks;
        let mut played = stepper.play(physics, (*time, &state), kicks, seen, (self.covered.1, rows))?;
        if let Some(seen) = seen {
            seen.complete(&mut played.values, self.physics, &physics.course, 0.0);
        }
        Some(played)
    }

    /// Number of samples up to a time, s.
    fn shown(&self, until: f64) -> usize {
        self.observation
            .map_or(0, |seen| seen.time.partition_point(|time| *time <= until))
    }

    fn interval(&self) -> Option<f64> {
        self.observation.and_then(|observation| observation.interval)
    }

    /// The longest step of which the candidate's event times, counted from its start, are multiples, s.
    fn grid_of_events(&self) -> Option<f64> {
        let (from, _) = self.origin.as_ref()?;
        let times = self.word.iter().map(|event| event.time - from);
        let times: Vec<f64> = times.filter(|time| *time > 0.0).collect();
        let are_many = times.len() >= FEWEST_EVENTS && self.detected.is_none();
        let first = *times.first().filter(|_| are_many)?;
        let is_step = |step: &f64| {
            let off = |time: &f64| (time / step - (time / step).round()).abs();
            times.iter().all(|time| off(time) <= OFF)
        };
        (1..MOST_MULTIPLES).map(|n| first / f64::from(n)).find(is_step)
    }

    fn lengths(&self) -> Vec<f64> {
        let interval = self.interval().into_iter();
        let of_samples = interval.flat_map(|interval| PARTS.map(|parts| interval / parts));
        let mut lengths: Vec<f64> = of_samples.chain(self.grid_of_events()).collect();
        lengths.sort_by(f64::total_cmp);
        lengths.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-6);
        lengths
    }

    /// The steps at which the error of a method is most like the candidate's difference.
    fn length_of(&self, scheme: Scheme, located: bool) -> Vec<f64> {
        let order = scheme.order();
        let begin = self.interval().unwrap_or(f64::INFINITY).min(self.period / fine(order));
        let window = self.window(&self.reference());
        let play = |step: f64, _: f64| self.stepped(&Stepper::new(scheme, located, step), window);
        let Some(step) = self.projected(begin, order, &play) else {
            return Vec::new();
        };
        let Some(interval) = self.interval() else {
            return vec![step];
        };
        // Most solvers take a whole number of steps in an interval of samples.
        let parts = [(interval / step).floor(), (interval / step).ceil()].into_iter();
        let whole = parts.filter(|parts| *parts >= 1.0).map(|parts| interval / parts);
        let is_near = |whole: &f64| (whole / step - 1.0).abs() <= WHOLE || *whole > 0.5 * step;
        let mut near: Vec<f64> = whole.filter(is_near).collect();
        near.push(step);
        near.dedup();
        near
    }

    /// Exact and classical solvers with steps of these lengths and sticks of these kinds.
    fn with_stops(&self, lengths: &[f64], stops: &[Stop]) -> Vec<Stepper> {
        let schemes = [Scheme::Exact, Scheme::RungeKutta].into_iter();
        let each = schemes.flat_map(|scheme| lengths.iter().map(move |&step| Stepper::new(scheme, false, step)));
        each.flat_map(|stepper| stops.iter().map(move |&stop| Stepper { stop, ..stepper }))
            .collect()
    }

    fn steppers(&self, tolerances: &[f64], breakaway: Option<f64>) -> Vec<Stepper> {
        let mut stops = vec![Stop::Sign, Stop::Frozen(0.0)];
        stops.extend(bands(tolerances));
        let plain = self.with_stops(&self.lengths(), &[Stop::Sign]);
        let late_slips = plain.iter().map(|stepper| Stepper {
            located: true,
            late_slips: true,
            ..*stepper
        });
        // Torques at the ends of steps exceed the limit; the intended limit is a round number.
        let shares = breakaway.map(|share| [share, (100.0 * share).round() / 100.0]);
        let shares = shares.into_iter().flatten().filter(|share| *share != 1.0);
        let shares = shares.flat_map(|breakaway| plain.iter().map(move |stepper| Stepper { breakaway, ..*stepper }));
        let at_ends = self.with_stops(&self.lengths(), &stops).into_iter();
        self.possible(at_ends.chain(late_slips).chain(shares))
    }

    /// Typical velocity tolerances for the candidate's own steps. They are needed if no sample shows a speed at a
    /// stick.
    fn usual_bands(&self) -> Vec<Stepper> {
        if !self.physics.sticks() {
            return Vec::new();
        }
        let lengths: Vec<f64> = self.interval().into_iter().chain(self.grid_of_events()).collect();
        let largest = SLOW * self.physics.speed();
        let power = 10f64.powf(largest.log10().floor());
        let digits = (0..DECADES).flat_map(|decade| USUAL.map(|digit| digit * power * 0.1f64.powi(decade)));
        let speeds: Vec<f64> = digits.filter(|band| *band <= largest).collect();
        self.possible(self.with_stops(&lengths, &bands(&speeds)))
    }

    fn methods(&self) -> Vec<Stepper> {
        let methods = Scheme::METHODS.map(|scheme| [(scheme, false), (scheme, true)]).concat();
        let lengths = self.lengths();
        let found = over_processors(methods.len(), &|| false, |k| {
            let (scheme, located) = methods[k];
            let mut steps = self.length_of(scheme, located);
            if !located {
                steps.extend(&lengths);
            }
            self.possible(steps.into_iter().map(|step| Stepper::new(scheme, located, step)))
        });
        found.into_iter().flatten().collect()
    }

    /// Speeds (rad/s) of the reference when the candidate begins to stick early, and the largest of the candidate's own
    /// in the samples before and after its sticks begin.
    fn speeds_at_sticks(&self) -> (Vec<f64>, [f64; 2]) {
        let Some(traced) = self.unchanged.first().and_then(Option::as_ref) else {
            return (Vec::new(), [0.0; 2]);
        };
        let sticks = self.word.iter().filter(|event| event.kind == EventKind::Stick);
        let at = |time: f64| {
            let (_, y) = traced.state_at(self.physics, time)?;
            let system = self.physics.system();
            Some(system.relative_velocity(&self.physics.course.outside(time), &y).abs())
        };
        // If a stick is early, the reference has the speed at which it begins.
        let close = |time: f64| {
            let mut near = self.reference.iter().filter(|event| event.kind == EventKind::Stick);
            near.any(|event| event.time > time && event.time - time < NEAR * self.period)
        };
        let early = sticks.map(|event| event.time).filter(|time| close(*time)).take(STICKS);
        let is_shown = |speed: &f64| is_band(self.physics, *speed);
        let speeds: Vec<f64> = early.filter_map(at).filter(is_shown).collect();
        // A stick declared at the end of a step shows less than the tolerance then, or after it if the surfaces keep
        // moving.
        let shown: Vec<[f64; 2]> = self.observation.map_or_else(Vec::new, |seen| {
            let sticks = self.word.iter().filter(|event| event.kind == EventKind::Stick);
            sticks.filter_map(|event| seen.speeds_near(event.time)).collect()
        });
        let largest = [0, 1].map(|side| shown.iter().map(|speeds| speeds[side]).fold(0.0, f64::max));
        (speeds, largest)
    }
}

/// A solver with steps, with the reference's parameters or with others.
#[derive(Debug)]
pub(crate) struct SteppingSolver {
    stepper: Stepper,
    /// Other parameters of the case.
    with: Option<Proposal>,
    /// End of the judged part, s, if rounding decides what the solver does from there on.
    until: Option<f64>,
}

/// Two runs that start this far apart, in parts of the state, differ by rounding only. They have parted when they
/// differ by this part of a channel's size.
const ROUNDED: f64 = 1e-12;
const PARTED: f64 = 1e-3;
/// Fewest events of such a run after the candidate has departed from the reference.
const FEWEST_EVENTS_KNOWN: usize = 2;
const CLOSEST_STEPPERS: usize = 8;
const CLOSEST_VARIANTS: usize = 64;
/// Number of parameters that are tried together with steps.
const CLOSEST: usize = 2;

fn bands(speeds: &[f64]) -> Vec<Stop> {
    let each = speeds.iter();
    each.flat_map(|&speed| [Stop::Within(speed), Stop::Frozen(speed)])
        .collect()
}

impl From<Stepper> for SteppingSolver {
    fn from(stepper: Stepper) -> SteppingSolver {
        SteppingSolver {
            stepper,
            with: None,
            until: None,
        }
    }
}

fn of_steppers(steppers: impl IntoIterator<Item = Stepper>) -> Vec<Proposal> {
    proposals(steppers.into_iter().map(SteppingSolver::from))
}

/// The solvers that were tried with the parameters of the case, those that stay close to the candidate longest first,
/// and how many samples that is.
fn closest_steppers(search: &Search<'_>) -> Vec<(usize, Stepper)> {
    let tried = search.tried.iter().filter(|tried| tried.cause.numbers().is_empty());
    let steppers = tried.filter_map(|tried| Some((tried.close, *tried.cause.stepper()?)));
    let mut close: Vec<(usize, Stepper)> = steppers.collect();
    close.sort_by_key(|(rows, _)| std::cmp::Reverse(*rows));
    close
}

fn is_band(physics: &Physics, speed: f64) -> bool {
    speed > 1e-6 * physics.speed() && speed < SLOW * physics.speed()
}

/// Speeds up to which the candidate may stick, rad/s.
fn tolerances(search: &Search<'_>) -> Vec<f64> {
    let (evidence, shown) = (search.evidence, search.shown);
    let physics = evidence.physics;
    let dropped = shown.found.iter().filter(|found| found.kind == EventKind::Stick);
    let dropped = dropped.filter_map(|found| found.dropped).fold(0.0, f64::max);
    let speeds = [dropped, shown.plateau].into_iter();
    let speeds = speeds.filter(|speed| *speed > 1e-6 * physics.speed());
    let mut all: Vec<f64> = speeds.flat_map(round_above).collect();
    if physics.sticks() {
        let (speeds, declared) = evidence.speeds_at_sticks();
        let early = speeds.into_iter().fold(0.0, f64::max);
        let speeds = [early].into_iter().chain(declared);
        all.extend(speeds.filter(|speed| is_band(physics, *speed)).flat_map(round_above));
    }
    all.sort_by(f64::total_cmp);
    all.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-4);
    all
}

impl SteppingSolver {
    /// Sticks that begin within a fitted velocity tolerance, located.
    pub fn of_tolerances(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        if !evidence.physics.sticks() {
            return Vec::new();
        }
        let (speeds, _) = evidence.speeds_at_sticks();
        let step = evidence.period / FINE;
        let least = 1e-3 * evidence.physics.speed();
        let kinds = speeds.iter().take(FITTED).chain([&least]);
        let kinds: Vec<(f64, bool)> = kinds.flat_map(|&speed| [(speed, false), (speed, true)]).collect();
        let found = over_processors(kinds.len(), &|| false, |k| {
            let (speed, frozen) = kinds[k];
            let stop = if frozen { Stop::Frozen } else { Stop::Within };
            let of = |speed: f64| Stepper {
                stop: stop(speed.abs()),
                ..Stepper::new(Scheme::Exact, true, step)
            };
            let play = |speed: f64, until: f64| evidence.stepped(&of(speed), evidence.shown(until));
            let speed = match speed == least {
                true => evidence.projected(speed, 1, &play)?,
                false => speed,
            };
            Some(of(fitted(evidence, speed, speed, &play)?))
        });
        of_steppers(found.into_iter().flatten())
    }

    /// Variants of the solvers that stay close to the candidate longest, and of those that come to no end.
    pub fn variants_of_closest(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let mut close = closest_steppers(search);
        close.retain(|(_, stepper)| !stepper.is_variant());
        let closest = close.into_iter().enumerate();
        let closest = closest.filter(|(place, (rows, _))| *place < CLOSEST_VARIANTS || *rows == 0);
        let variants = closest.flat_map(|(_, (_, stepper))| evidence.variants(stepper));
        let is_new = |stepper: &Stepper| search.tried.iter().all(|tried| tried.cause.stepper() != Some(stepper));
        of_steppers(variants.filter(|stepper| stepper.is_variant() && is_new(stepper)))
    }

    /// Methods of low order, each with the steps that its error shows, and with those of the samples.
    pub fn of_low_order(search: &Search<'_>) -> Vec<Proposal> {
        of_steppers(search.evidence.methods())
    }

    pub fn of_usual_tolerances(search: &Search<'_>) -> Vec<Proposal> {
        of_steppers(search.evidence.usual_bands())
    }

    /// The closest parameters, together with steps.
    pub fn with_numbers(search: &Search<'_>) -> Vec<Proposal> {
        let numbers = search
            .tried
            .iter()
            .filter(|tried| !tried.cause.numbers().is_empty() && tried.cause.stepper().is_none());
        let mut numbers: Vec<&Tried> = numbers.collect();
        numbers.sort_by(|a, b| a.judged.left.total_cmp(&b.judged.left));
        let steppers = search.evidence.steppers(&[], None);
        let both = numbers.into_iter().take(CLOSEST).flat_map(|number| {
            steppers.iter().map(|&stepper| SteppingSolver {
                with: Some(number.cause.clone()),
                ..stepper.into()
            })
        });
        proposals(both)
    }

    /// Solvers with steps, judged before rounding decides what they do. Events move by whole steps, so two of their runs
    /// that start [`ROUNDED`] apart diverge. The candidate must depart from the reference before that.
    pub fn up_to_where_known(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let Some(seen) = evidence.observation else {
            return Vec::new();
        };
        let parts = seen.close(&seen.reference, CLOSE);
        let mut close = closest_steppers(search);
        close.retain(|(rows, _)| *rows > parts);
        close.truncate(CLOSEST_STEPPERS);
        let known = over_processors(close.len(), &|| false, |k| {
            let (_, stepper) = close[k];
            let played = evidence.stepped(&stepper, usize::MAX)?;
            let other = evidence.stepped_from(evidence.physics, &stepper, 1.0 + ROUNDED, usize::MAX)?;
            let until = seen
                .parting(&played.values, &other.values, PARTED)
                .filter(|until| *until > parts)?;
            let (from, until) = (seen.time[parts], seen.time[until]);
            let events = played.events.iter().filter(|event| (from..until).contains(&event.time));
            let steps = SteppingSolver {
                until: Some(until),
                ..stepper.into()
            };
            let judged = steps.judge(evidence, &played)?;
            let is_cause = judged.is_cause() && judged.explained >= steps.least(evidence);
            (events.count() >= FEWEST_EVENTS_KNOWN && is_cause).then_some((until, steps))
        });
        let longest = known.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0));
        proposals(longest.map(|(_, steps)| steps))
    }

    fn stepper_words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let Stepper {
            step,
            scheme,
            stop,
            breakaway,
            located,
            late_slips,
            ..
        } = self.stepper;
        let physics = search.evidence.physics;
        let unit = physics.vocabulary().unit(Channel::RELATIVE_VELOCITY);
        let short = match step < 1e-3 {
            true => format!("{:.1} us", step * 1e6),
            false => format!("{step:.3e} s"),
        };
        let at = if located { "" } else { " at the end of a step" };
        let stops = match stop {
            Stop::Sign if late_slips => "its slips begin at the ends of steps".to_owned(),
            Stop::Sign if located => "its events are located within steps".to_owned(),
            Stop::Sign => "its events are taken at the ends of steps".to_owned(),
            Stop::Frozen(0.0) => {
                format!("its events are taken{at}, and the relative velocity stays in stick what it was then")
            }
            Stop::Within(speed) => format!("a stick is declared{at} within {speed:.1e} {unit}"),
            Stop::Frozen(speed) => {
                format!(
                    "a stick is declared{at} within {speed:.1e} {unit}, and the relative velocity stays what it was"
                )
            }
        };
        let by = match (scheme, located) {
            (Scheme::Exact, true) if !late_slips => stops,
            _ => format!("{stops}, with {} and steps of {short}", scheme.name()),
        };
        if breakaway != 1.0 {
            let words = format!("it breaks away at {breakaway:.3} {}, and {by}", limit_of(physics));
            return (CauseKind::StickTest, words);
        }
        let period = physics.natural_period();
        let coarse = step * 8.0 > period;
        match (stop, missing_sticks(search, step)) {
            // The method damps a motion that should grow.
            _ if scheme == Scheme::ImplicitEuler && physics.coasts() && step * 40.0 > period => {
                (CauseKind::UnresolvedMode, by)
            }
            _ if coarse && (scheme.is_low() && physics.coasts() || scheme == Scheme::RungeKutta) => {
                (CauseKind::UnresolvedMode, by)
            }
            _ if scheme.is_low() || scheme == Scheme::RungeKutta && located && !late_slips => {
                (CauseKind::LowOrderMethod, by)
            }
            (Stop::Sign | Stop::Frozen(0.0), _) => (CauseKind::EventsLate, by),
            (_, Some(missing)) => (CauseKind::StepTooLarge, format!("{missing}: {by}")),
            (_, None) => (CauseKind::VelocityTolerance, by),
        }
    }
}

/// Counts sticks of the reference that are missing, or are reversals, and shorter than four of the candidate's steps
/// (s).
fn missing_sticks(search: &Search<'_>, step: f64) -> Option<String> {
    const STEPS: f64 = 4.0;
    let shown = search.shown;
    let is_missing =
        |d: &&Difference| matches!(d.fault, Fault::Missing | Fault::Renamed) && d.kind == EventKind::Stick.name();
    let time = |position: usize| Some(shown.covered.get(position)?.time);
    let duration = |d: &Difference| Some(time(d.position + 1)? - time(d.position)?);
    let missing = shown.alignment.differences.iter().filter(is_missing);
    let short = missing.filter_map(duration).filter(|d| *d < STEPS * step).count();
    (short > 0).then(|| format!("{short} missing stick(s) are shorter than four of its steps"))
}

impl Cause for SteppingSolver {
    /// Solvers that take events at the ends of steps, or sticks within a tolerance.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let share = search
            .breakaway
            .map(|value| value / search.evidence.physics.system().breakaway);
        let share = share.filter(|share| (share - 1.0).abs() > 1e-3);
        of_steppers(search.evidence.steppers(&tolerances(search), share))
    }

    fn run(&self, evidence: &Evidence<'_>, _: usize) -> Option<Played> {
        let Some(with) = &self.with else {
            return evidence.stepped(&self.stepper, usize::MAX);
        };
        let case = evidence.case.with_all(with.numbers()).ok()?;
        let physics = Physics::new(case, evidence.reference, evidence.covered.1);
        evidence.stepped_from(&physics, &self.stepper, 1.0, usize::MAX)
    }

    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        let judged = evidence.judged(played, self.until.unwrap_or(f64::INFINITY));
        match (self.until, &self.with) {
            (Some(_), _) => judged.map(|judged| judged.by_samples_if(evidence.detected.is_some())),
            (None, Some(_)) => judged,
            // A motion that was given up may be close to the candidate before that.
            (None, None) => Some(judged.unwrap_or_else(Judged::far)),
        }
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        if self.with.is_some() { 1.0 - ALL } else { OF_FITTED }
    }

    fn complexity(&self, evidence: &Evidence<'_>) -> usize {
        3 + self.with.as_ref().map_or(0, |with| with.complexity(evidence))
    }

    fn parameters(&self) -> Option<&ChangedNumber> {
        self.with.as_ref()?.parameters()
    }

    fn stepper(&self) -> Option<&Stepper> {
        Some(&self.stepper)
    }

    fn up_to(&self) -> Option<f64> {
        self.until
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        match self.with {
            Some(_) => (CauseKind::AnotherParameter, String::new()),
            None => self.stepper_words(search),
        }
    }

    fn report(&self, search: &Search<'_>, all: &[Tried], causes: &mut Causes) -> (CauseKind, String) {
        let (kind, words) = self.stepper_words(search);
        if self.with.is_none() {
            return (kind, format!("{words}: {}", search.outcome(&all[0])));
        }
        let words = words + ", at once with the other number";
        causes.said.push(Diagnosis::tried(kind, words, all[0].judged.explained));
        number::report(search, all, causes)
    }
}

/// Effect of rounding the twist to multiples of a digit (rad) on the motion with the candidate's steps, in parts of the
/// candidate's difference. `None` if the motion departs from the candidate before the rounding shows.
pub(crate) fn amplified(evidence: &Evidence<'_>, digit: f64) -> Option<f64> {
    let observation = evidence.observation?;
    let motion = |digit: f64| {
        let stepper = Stepper {
            digit,
            ..Stepper::new(Scheme::RungeKutta, false, observation.interval?)
        };
        Some(evidence.stepped(&stepper, observation.time.len())?.values)
    };
    let (exact, rounded) = (motion(0.0)?, motion(digit)?);
    // The motion must be the candidate's before rounding shows.
    let parts = observation.parting(&exact, &rounded, PARTED)?;
    if observation.close(&exact, CLOSE) < parts {
        return None;
    }
    let square = observation.between(&exact, &rounded);
    Some((square / observation.left(&observation.reference, f64::INFINITY)).sqrt())
}
