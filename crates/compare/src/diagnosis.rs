//! Causes of a difference, in words.
//!
//! A cause is named if the reference's run with it reproduces the candidate ([`super::hypotheses`]). Symptoms propose
//! what to try.

use super::case_differences::{CaseDifference, NOT_SET};
use super::creep::{Creep, SHAPES};
use super::detect::Found;
use super::hypotheses::{Change, Judged, Proposals, Scheme, Stepper, Stop};
use super::parameters::{EventAgreement, FoundBy, OtherParameters};
use super::reference::Physics;
use super::states::Grid;
use super::units::UnitFault;
use super::{Agreement, Channel, OtherNumber};
use serde::Serialize;
use stickslip_case::{Motion, WrittenCase};
use stickslip_system::friction::Law;
use stickslip_system::model::BreakawayTest;
use stickslip_system::model::system::KickSide;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::{Alignment, Difference, Fault, SequenceEvent};

/// What is wrong with a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// A channel, or the time, is in another unit or of the other sign.
    WrongUnits,
    /// It is a run of another case.
    AnotherCase,
    /// The reference has a kick, the candidate has none.
    UnperturbedRun,
    /// The fast mode is not followed: steps or samples are too far apart, or the method damps it.
    UnresolvedMode,
    /// Short sticks pass between two steps.
    StepTooLarge,
    /// A stick is declared while the disks still slide.
    VelocityTolerance,
    /// Breakaway is decided by another torque than the reference's.
    StickTest,
    /// Angles instead of twists: their rounding is a floor under the torques.
    AbsoluteAngles,
    /// A parameter of the case differs.
    AnotherParameter,
    /// The kick has another size or another split.
    AnotherKick,
    /// Friction is smooth at rest, so sticks creep.
    RegularisedLaw,
    /// Events are taken at the ends of steps.
    EventsLate,
    /// A single event is late or early.
    EventLate,
    /// A method of low order with the candidate's steps.
    LowOrderMethod,
    /// The initial state differs.
    AnotherState,
    /// All times differ by a constant.
    TimeOffset,
}

impl Cause {
    /// Name of the cause.
    pub fn name(self) -> &'static str {
        match self {
            Cause::WrongUnits => "wrong units",
            Cause::AnotherCase => "another case",
            Cause::UnperturbedRun => "unperturbed run",
            Cause::UnresolvedMode => "unresolved mode",
            Cause::StepTooLarge => "step too large",
            Cause::VelocityTolerance => "velocity tolerance too wide",
            Cause::StickTest => "another stick test",
            Cause::AbsoluteAngles => "absolute angles",
            Cause::AnotherParameter => "another parameter",
            Cause::AnotherKick => "another kick",
            Cause::RegularisedLaw => "regularised friction law",
            Cause::EventsLate => "events late by a step",
            Cause::EventLate => "one event late",
            Cause::LowOrderMethod => "method of low order",
            Cause::AnotherState => "another initial state",
            Cause::TimeOffset => "times offset",
        }
    }
}

/// A cause with its evidence in words.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The cause.
    pub cause: Cause,
    /// Evidence, with numbers.
    pub evidence: String,
    /// Part of the squared difference from the reference, of samples or else of event times, that the reference's run
    /// with this change removes, 0 to 1; `None` if the candidate's own case shows the cause.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explained: Option<f64>,
}

impl Diagnosis {
    fn of(cause: Cause, evidence: String) -> Diagnosis {
        Diagnosis {
            cause,
            evidence,
            explained: None,
        }
    }

    pub(super) fn shown(cause: Cause, evidence: String) -> Diagnosis {
        Diagnosis::of(cause, evidence)
    }

    pub(super) fn tried(cause: Cause, evidence: String, explained: f64) -> Diagnosis {
        Diagnosis {
            explained: Some(explained),
            ..Diagnosis::of(cause, evidence)
        }
    }
}

pub(super) fn percent(share: f64) -> String {
    match 100.0 * share {
        all if all > 99.99 => "over 99.99".to_owned(),
        part => format!("{part:.2}"),
    }
}

pub(super) fn wrong_units(fault: &UnitFault) -> Diagnosis {
    let UnitFault {
        name,
        found,
        expected,
        explained,
    } = fault;
    let evidence = if found.contains(' ') && found.starts_with("the") {
        format!("{name} has {found}")
    } else {
        format!("{name} looks like {found} where {expected} is meant")
    };
    Diagnosis::tried(Cause::WrongUnits, evidence, *explained)
}

pub(super) struct Symptoms<'a> {
    pub physics: &'a Physics,
    pub reference: &'a [SequenceEvent],
    pub all: &'a [SequenceEvent],
    pub found: &'a [Found],
    pub alignment: &'a Alignment,
    pub grid: Grid,
    /// |omega_r| at which the candidate stands still outside the tolerance, rad/s.
    pub plateau: f64,
    pub creep: Option<Creep>,
}

impl Symptoms<'_> {
    pub fn proposals(&self) -> Proposals {
        let mut changes = Vec::new();
        if let Some(creep) = self.creep {
            changes.push(Change::Smooth(creep.shape, creep.speed));
        }
        let dropped = self.found.iter().filter(|f| f.kind == EventKind::Stick);
        let mut dropped: Vec<f64> = dropped.filter_map(|f| f.dropped).collect();
        dropped.sort_by(f64::total_cmp);
        let largest = [dropped.last().copied().unwrap_or(0.0), self.plateau];
        let tolerances = largest
            .into_iter()
            .filter(|w| *w > 1e-6 * self.physics.speed())
            .flat_map(round_above);
        let mut tolerances: Vec<f64> = tolerances.collect();
        tolerances.sort_by(f64::total_cmp);
        tolerances.dedup();
        Proposals {
            changes,
            tolerances,
            ..Proposals::default()
        }
    }

    /// The cause of a change that reproduces the candidate, and the change in words.
    pub fn named(&self, change: &Change) -> (Cause, String) {
        let unit = self.physics.vocabulary().unit(Channel::RelativeVelocity);
        match change {
            Change::State => (Cause::AnotherState, "it begins in another state".to_owned()),
            Change::NoKick => (
                Cause::UnperturbedRun,
                "the reference is kicked, the candidate is not".to_owned(),
            ),
            Change::KickOn(side) => {
                let on = match side {
                    KickSide::Both => "both surfaces",
                    KickSide::Rotor => "the rotor's surface alone",
                    KickSide::Stator => "the stator's surface alone",
                };
                (Cause::AnotherKick, format!("its kick acts on {on}"))
            }
            Change::Late(time, late, _) => (Cause::EventLate, self.one_late(*time, *late)),
            Change::Numbers(_) | Change::Both(..) => (Cause::AnotherParameter, String::new()),
            Change::Smooth(shape, speed) => {
                let words = format!(
                    "its friction has {} in the place of the sign, eps = {speed:.2e} {unit}",
                    SHAPES[*shape].name
                );
                (Cause::RegularisedLaw, words)
            }
            Change::Test(test) => {
                let motion = self.physics.vocabulary().motion();
                let name = |test: &BreakawayTest| match (test, motion) {
                    (BreakawayTest::Transmitted, Motion::Rotation) => "T_f = (T_r + T_s)/2",
                    (BreakawayTest::Stator, Motion::Rotation) => "the stator torque T_s",
                    (BreakawayTest::Rotor, Motion::Rotation) => "the rotor torque T_r",
                    (BreakawayTest::Transmitted, Motion::Translation) => "the transmitted force",
                    (BreakawayTest::Stator, Motion::Translation) => "the stator's internal force",
                    (BreakawayTest::Rotor, Motion::Translation) => "the rotor's internal force",
                };
                let (limit, ours) = (limit_of(self.physics), &self.physics.trains.breakaway_test);
                let words = format!(
                    "it holds {} against {limit}, where the reference tests {}",
                    name(test),
                    name(ours)
                );
                (Cause::StickTest, words)
            }
            Change::Stepper(stepper) => self.of_steps(stepper),
        }
    }

    fn one_late(&self, time: f64, late: f64) -> String {
        let off = |event: &SequenceEvent| (event.time - time).abs();
        let events = self.all.iter().enumerate();
        let nearest = events.min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
        let (number, kind) = nearest.map_or((0, "event"), |(number, event)| (number, event.kind.name()));
        let side = if late < 0.0 { "early" } else { "late" };
        format!(
            "one event alone is wrong: its {kind} at {time:.6} s, event {number} of the sequence, is {:.3e} s {side}, and what comes \
             after follows from that",
            late.abs()
        )
    }

    fn of_steps(&self, stepper: &Stepper) -> (Cause, String) {
        let Stepper {
            step,
            scheme,
            stop,
            breakaway,
            located,
            late_slips,
            ..
        } = *stepper;
        let unit = self.physics.vocabulary().unit(Channel::RelativeVelocity);
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
            let words = format!("it breaks away at {breakaway:.3} {}, and {by}", limit_of(self.physics));
            return (Cause::StickTest, words);
        }
        let coarse = step * 8.0 > self.physics.natural_period();
        match (stop, self.missing_sticks(step)) {
            // The method damps a motion that should grow.
            _ if scheme == Scheme::ImplicitEuler
                && self.physics.coasts()
                && step * 40.0 > self.physics.natural_period() =>
            {
                (Cause::UnresolvedMode, by)
            }
            _ if coarse && (scheme.is_low() && self.physics.coasts() || scheme == Scheme::RungeKutta) => {
                (Cause::UnresolvedMode, by)
            }
            _ if scheme.is_low() || scheme == Scheme::RungeKutta && located && !late_slips => {
                (Cause::LowOrderMethod, by)
            }
            (Stop::Sign | Stop::Frozen(0.0), _) => (Cause::EventsLate, by),
            (_, Some(missing)) => (Cause::StepTooLarge, format!("{missing}: {by}")),
            (_, None) => (Cause::VelocityTolerance, by),
        }
    }

    /// Counts sticks of the reference that are missing, or are reversals, and shorter than four of the candidate's
    /// steps (s).
    fn missing_sticks(&self, step: f64) -> Option<String> {
        let is_missing =
            |d: &&Difference| matches!(d.fault, Fault::Missing | Fault::Renamed) && d.kind == EventKind::Stick.name();
        let time = |position: usize| Some(self.reference.get(position)?.time);
        let duration = |d: &Difference| Some(time(d.position + 1)? - time(d.position)?);
        const STEPS: f64 = 4.0;
        let missing = self.alignment.differences.iter().filter(is_missing);
        let short = missing.filter_map(duration).filter(|d| *d < STEPS * step).count();
        (short > 0).then(|| format!("{short} missing stick(s) are shorter than four of its steps"))
    }

    /// Last digit of the rotor's angle (rad), if its twist is a multiple of it in nearly all samples.
    pub fn last_digit_of_angles(&self) -> Option<f64> {
        const DIGIT: f64 = f64::EPSILON * 256.0;
        let nearly_all = self.grid.of >= 16 && self.grid.on as f64 >= 0.999 * self.grid.of as f64;
        // Rounding is a cause if an instability amplifies it.
        (self.physics.coasts() && nearly_all).then_some(DIGIT)
    }

    /// Evidence for the last digit of angles (rad): rounding to it makes this part of the candidate's difference.
    pub fn absolute_angles(&self, digit: f64, part: f64) -> String {
        let stiffness = self.physics.system().rotor.stiffness.first().copied().unwrap_or(0.0);
        let (floor, percent) = (stiffness * digit, 100.0 * part);
        format!(
            "its rotor twist is a difference of two angles, rounded to their last digit: a floor of about {floor:.0e} N m \
             under its torques, which the instability amplifies; a run of the case with its steps, whose twist is rounded to that digit, \
             differs from one that is not by {percent:.0} % as much as the candidate does from the reference; integrate the twist itself"
        )
    }
}

/// The next round numbers above a speed, and one just above it: values in between declare the same sticks.
pub(super) fn round_above(speed: f64) -> impl Iterator<Item = f64> {
    const DIGITS: [f64; 13] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0];
    let power = 10f64.powf(speed.log10().floor());
    let round = DIGITS.into_iter().map(move |digit| digit * power);
    round
        .filter(move |round| *round >= speed)
        .take(3)
        .chain([1.001 * speed])
}

fn limit_of(physics: &Physics) -> &'static str {
    match physics.vocabulary().motion() {
        Motion::Rotation => "mu_0 r F_n",
        Motion::Translation => "mu_0 F_n",
    }
}

pub(super) fn reproduced(judged: &Judged, of_samples: bool, events: usize) -> String {
    let what = if of_samples {
        "the squared difference of its samples"
    } else {
        "the squared errors of its events"
    };
    let mut text = format!("explains {} % of {what}", percent(judged.explained));
    if events > 0 && judged.has_events() {
        text += &format!("; {}", tried(&EventAgreement::of(events, judged.before, judged.after)));
    }
    text
}

pub(super) fn of_numbers(
    other: &OtherParameters,
    physics: &Physics,
    numbers: &WrittenCase,
    outcome: &str,
) -> (Cause, String) {
    let words: Vec<String> = other.numbers.iter().map(OtherNumber::words).collect();
    let mut evidence = words.join(" and ");
    let mut cause = Cause::AnotherParameter;
    if let [only] = &other.numbers[..]
        && only.path == "friction.breakaway"
        && !only.error.is_nan()
    {
        cause = Cause::StickTest;
        let own = numbers.number(&only.path).map_or(f64::NAN, |number| number.value);
        let mut at = format!("it breaks away at {:.3} {}", only.value / own, limit_of(physics));
        let sliding = physics.system().law.coefficient(0.0);
        if (only.value / sliding - 1.0).abs() < 0.01 {
            at += &format!(": that is the limit of slip, mu(0) = {sliding}, and not mu_0 = {own}");
        }
        evidence = format!("{at}; {evidence}");
    }
    evidence += match other.found_by {
        FoundBy::Equations => ", by the equations between its samples",
        FoundBy::Breakaways => ", by the torque at which its sticks end",
        FoundBy::Events => ", by its events",
        FoundBy::Samples => ", by its samples",
    };
    evidence += &format!(": {outcome}");
    for number in &other.or {
        evidence += &format!("; {} explains as much", number.words());
    }
    (cause, evidence)
}

/// Adds the differences of a result file's case, which are the best evidence.
pub(super) fn add_case(causes: &mut Vec<Diagnosis>, differences: &[CaseDifference]) {
    if differences.is_empty() {
        return;
    }
    let names: Vec<&str> = differences.iter().take(3).map(|d| d.key.as_str()).collect();
    let more = if differences.len() > 3 { " and more" } else { "" };
    let evidence = format!(
        "it is a run of another case, which differs in {}{more}",
        names.join(", ")
    );
    let all = |test: fn(&CaseDifference) -> bool| differences.iter().all(test);
    // A contact without stick has no breakaway test.
    const SMOOTH: [&str; 4] = [
        "friction.regularisation.",
        "friction.breakaway",
        "friction.threshold",
        "contact.breakaway_test",
    ];
    let smooth = |d: &CaseDifference| SMOOTH.iter().any(|key| d.key.starts_with(key));
    // A regularised reference, alone or together with the candidate, is no fault of the candidate.
    let regularised = |d: &&CaseDifference| d.key.starts_with("friction.regularisation.");
    let of_candidate = differences.iter().any(|d| regularised(&d))
        && differences.iter().filter(regularised).all(|d| d.reference == NOT_SET);
    let cause = if all(smooth) && of_candidate {
        Cause::RegularisedLaw
    } else if all(|d| d.key == "contact.breakaway_test") {
        Cause::StickTest
    } else if all(|d| d.key.starts_with("perturbation") && d.candidate == NOT_SET) {
        Cause::UnperturbedRun
    } else {
        Cause::AnotherCase
    };
    causes.retain(|known| known.cause != cause);
    if cause == Cause::RegularisedLaw {
        causes.retain(|known| !matches!(known.cause, Cause::VelocityTolerance | Cause::StickTest));
    }
    causes.insert(0, Diagnosis::of(cause, evidence));
}

pub(super) fn tried(rerun: &EventAgreement) -> String {
    let outcome = |agreement: &Agreement, events: &str, of: &str| match agreement.unmatched {
        0 if agreement.max == 0.0 => format!("has {events} at the same times"),
        0 => format!("has {events} within {:.1e} s", agreement.max),
        // Both events of an exchanged pair lack a partner.
        many => {
            let missed = many.div_ceil(2);
            format!("misses {missed} of {of}, or has them more than a quarter of the natural period off")
        }
    };
    let events = match rerun.events {
        1 => "the event".to_owned(),
        all => format!("all {all} events"),
    };
    let (after, before) = (
        outcome(&rerun.after, &events, &events),
        outcome(&rerun.before, "them", "them"),
    );
    format!("run with it, the case {after}; run without it, it {before}")
}
