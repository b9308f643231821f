//! Why a candidate differs: causes for which its own numbers are evidence.
//!
//! Each cause has a rule, stated at its function. A rule that does not hold says nothing; none guesses.

use super::case_differences::{CaseDifference, NOT_SET};
use super::clock::{FoundOffset, OtherClock};
use super::creep::Creep;
use super::detect::Found;
use super::event_errors::EventErrors;
use super::parameters::{FoundBy, OtherKick, OtherParameters, Rerun};
use super::reference::Physics;
use super::states::{Grid, Probe};
use super::torques::breakaway_ratios;
use super::units::UnitFault;
use super::{Agreement, Channel, OtherNumber};
use crate::case::Motion;
use crate::friction::Law;
use crate::model::BreakawayTest;
use crate::record::sequence::{Alignment, Difference, Fault, SequenceEvent};
use crate::record::{Event, EventKind};
use serde::Serialize;

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
    /// A number of the case is another.
    AnotherParameter,
    /// The kick is of another size, or split otherwise.
    AnotherKick,
    /// Friction is smooth at rest, so that sticks creep.
    RegularisedLaw,
    /// Sticks end at the step after the one at which they should.
    EventsLate,
    /// All times differ by the same.
    TimeOffset,
}

impl Cause {
    /// In words.
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
            Cause::TimeOffset => "times offset",
        }
    }
}

/// A cause with its evidence in words.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// What is wrong.
    pub cause: Cause,
    /// What shows it, with numbers.
    pub evidence: String,
}

impl Diagnosis {
    fn of(cause: Cause, evidence: String) -> Diagnosis {
        Diagnosis { cause, evidence }
    }
}

/// Everything that the rules look at.
pub(super) struct Evidence<'a> {
    pub physics: &'a Physics,
    /// Up to this an error of an event is one of the file, s.
    pub floor: f64,
    /// What would have to be added to the candidate's times, if that is much.
    pub offset: Option<FoundOffset>,
    pub reference: &'a [SequenceEvent],
    pub found: &'a [Found],
    pub alignment: &'a Alignment,
    pub errors: &'a EventErrors,
    pub units: Vec<UnitFault>,
    /// The reference's.
    pub kick: Option<&'a Event>,
    /// Before the kick, after it, and before the first event of either run.
    pub probes: &'a [Probe],
    pub grid: Grid,
    /// Mean interval of the candidate's samples in the stick-slip, s.
    pub interval: Option<f64>,
    /// omega_r at which the candidate stands still outside the tolerance, rad/s.
    pub plateau: f64,
    /// Whether events were found by the relative velocity, and not given.
    pub detected: bool,
    /// Of a candidate by another program.
    pub creep: Option<Creep>,
}

/// Event times that agree to this, s, need no explanation: it is what the references promise.
const AGREED: f64 = 1e-9;

/// What shows a cause, in words; `None` without evidence.
type Rule = fn(&Evidence<'_>) -> Option<String>;

/// The most fundamental first.
const RULES: [(Cause, Rule); 8] = [
    (Cause::RegularisedLaw, regularised),
    (Cause::UnperturbedRun, unperturbed),
    (Cause::UnresolvedMode, unresolved),
    (Cause::StepTooLarge, step_too_large),
    (Cause::VelocityTolerance, velocity_tolerance),
    (Cause::StickTest, stick_test),
    (Cause::AbsoluteAngles, absolute_angles),
    (Cause::EventsLate, events_late),
];

/// The causes that have evidence, the most fundamental first.
pub(super) fn diagnose(e: &Evidence<'_>) -> Vec<Diagnosis> {
    let mut causes: Vec<Diagnosis> = e.units.iter().map(wrong_units).collect();
    if let Some(offset) = e.offset {
        causes.insert(0, Diagnosis::of(Cause::TimeOffset, other_clock(offset)));
        return causes;
    }
    let agrees = e.alignment.differences.is_empty() && e.errors.max.is_none_or(|max| max <= AGREED.max(e.floor));
    // By another clock nothing else can be said.
    if !agrees && e.units.iter().all(|fault| fault.name != "time") {
        let found = |(cause, rule): (Cause, Rule)| Some(Diagnosis::of(cause, rule(e)?));
        causes.extend(RULES.into_iter().filter_map(found));
    }
    causes
}

impl Evidence<'_> {
    /// What the reference's kick adds to omega_r, rad/s.
    fn jump(&self) -> Option<f64> {
        self.kick
            .map(|kick| kick.after.relative_velocity - kick.before.relative_velocity)
    }

    /// Of a relative velocity.
    fn unit(&self) -> &'static str {
        self.physics.vocabulary().unit(Channel::RelativeVelocity)
    }
}

/// Whether torques can be judged: they follow from a state in the right units, and are compared with what stick can carry.
fn torques_count(e: &Evidence<'_>) -> bool {
    e.units.is_empty() && e.physics.sticks()
}

/// Its events agree when a time is added to them.
fn other_clock(offset: FoundOffset) -> String {
    let (seconds, rms) = (offset.seconds, offset.rms);
    format!(
        "its clock starts elsewhere: with {seconds:.9} s added to its times, {} of its {} events agree, rms {rms:.1e} s; repeat \
         with --time-offset {seconds:.9}, or auto",
        offset.agree, offset.of
    )
}

/// Where it should stick it creeps, at a speed that follows from T_f as with a smooth function in the place of the sign; see
/// [`super::creep`].
fn regularised(e: &Evidence<'_>) -> Option<String> {
    let creep = e.creep.filter(|_| torques_count(e))?;
    let (unit, function, speed) = (e.unit(), creep.function, creep.speed);
    Some(format!(
        "where it should stick it creeps at up to {:.1e} {unit}, as friction with {function} does, eps = {speed:.2e} {unit}; \
         --velocity-tolerance {:.0e} counts that as sticks",
        creep.largest,
        10.0 * speed
    ))
}

/// At its breakaways T_f has passed mu_0 r F_n, never the other way round, and for no longer than a step.
fn events_late(e: &Evidence<'_>) -> Option<String> {
    /// In steps: what a breakaway that is found in samples may be early, what it is late at least on average, and at most.
    const STEPS: (f64, f64, f64) = (0.05, 0.1, 1.5);
    // Where an instability amplifies what a step is late by, that is not all.
    let interval = e.interval.filter(|_| torques_count(e) && !e.physics.coasts())?;
    let system = e.physics.system();
    // Where the friction jumps at the breakaway, the samples after it do not tell its time so well.
    if e.detected && system.breakaway > (1.0 + 1e-9) * system.law.coefficient(0.0) {
        return None;
    }
    let slips = e.found.iter().filter(|f| f.kind == EventKind::Slip);
    let late = slips.filter_map(|f| {
        let ((rotor, stator), rate) = (f.torques?, f.torque_rate?);
        let torque = (rotor + stator) / 2.0;
        (rate != 0.0).then(|| (torque.abs() - e.physics.limit(f.time)) / rate.abs() / interval)
    });
    let late: Vec<f64> = late.collect();
    let typical = median(late.clone())?;
    let within = |&steps: &f64| (-STEPS.0..=STEPS.2).contains(&steps);
    if late.len() < 3 || typical < STEPS.1 || !late.iter().all(within) {
        return None;
    }
    Some(format!(
        "at its breakaways T_f has passed {}, typically since {:.1e} s of the {interval:.1e} s between its samples: \
             events are taken at the end of a step",
        limit_of(e.physics),
        typical * interval
    ))
}

/// What stick can carry.
fn limit_of(physics: &Physics) -> &'static str {
    match physics.vocabulary().motion() {
        Motion::Rotation => "mu_0 r F_n",
        Motion::Translation => "mu_0 F_n",
    }
}

fn wrong_units(fault: &UnitFault) -> Diagnosis {
    let UnitFault { name, found, expected } = fault;
    let evidence = if found.contains(' ') && found.starts_with("the") {
        format!("{name} has {found}")
    } else {
        format!("{name} looks like {found} where {expected} is meant")
    };
    Diagnosis::of(Cause::WrongUnits, evidence)
}

/// How far the candidate's omega_r in the first quarter period after the kick is from that of a kicked run, in parts of
/// the kick: 0 if the candidate was kicked too, -1 if it was not.
///
/// The kick is a step of omega_r that turns into a free oscillation, of which the quarter period shows 2/pi on average,
/// whatever happens to it later. Before the kick the error has to be smaller than it, or nothing can be said.
fn kick_shown(e: &Evidence<'_>) -> Option<f64> {
    /// Samples that make an average.
    const ENOUGH: usize = 4;
    /// Part of the kick that the error before it may have.
    const QUIET: f64 = 0.3;
    let (kick, delta) = (e.kick?, e.jump()?);
    let [before, after, _] = e.probes else {
        return None;
    };
    let quarter = kick.time + 0.25 * e.physics.natural_period();
    let errors = after.points.iter().take_while(|p| p.0 <= quarter);
    let errors: Vec<f64> = errors.map(|p| p.1).collect();
    if errors.len() < ENOUGH {
        return None;
    }
    // Before the kick, or over whole periods after it, the kick contributes nothing to the average.
    let quiet = if before.points.len() >= ENOUGH { before } else { after };
    if before.points.len() >= ENOUGH && deviation(&detrended(&before.points, |p| p.1)) > QUIET * delta.abs() {
        return None;
    }
    let level = quiet.points.iter().map(|p| p.1).sum::<f64>() / quiet.points.len() as f64;
    let step = errors.iter().sum::<f64>() / errors.len() as f64 - level;
    Some(step / (delta * std::f64::consts::FRAC_2_PI))
}

/// |kick_shown| up to this is a kicked run; as close to -1, one without a kick.
const SHOWN_WITHIN: f64 = 0.4;

/// The reference's kick is absent from the candidate's omega_r.
fn unperturbed(e: &Evidence<'_>) -> Option<String> {
    if (kick_shown(e)? + 1.0).abs() > SHOWN_WITHIN {
        return None;
    }
    let (delta, unit, time) = (e.jump()?, e.unit(), e.kick?.time);
    let coasts = e.physics.coasts();
    let onset = if coasts {
        ": its onset is amplified rounding"
    } else {
        ""
    };
    Some(format!(
        "the reference is kicked by {delta:.1e} {unit} at {time:.6} s, the candidate is not{onset}"
    ))
}

/// Samples (or steps) are further apart than an eighth of the natural period, or the oscillation that both runs should
/// have before the first event is less than half as large although the candidate was kicked.
fn unresolved(e: &Evidence<'_>) -> Option<String> {
    const PER_PERIOD: f64 = 8.0;
    let (period, scale) = (e.physics.natural_period(), &e.physics.scale);
    let sparse = e.interval.filter(|interval| interval * PER_PERIOD > period);
    if !e.physics.coasts() {
        let interval = sparse.filter(|_| scale.is_mode)?;
        let of = &scale.of;
        return Some(format!(
            "its samples are {interval:.1e} s apart, where a period of {of} takes {period:.1e} s"
        ));
    }
    if let Some(interval) = sparse {
        return Some(format!(
            "its samples are {:.1} us apart in the stick-slip, where a period of the fast mode takes {:.1} us",
            interval * 1e6,
            period * 1e6
        ));
    }
    let [_, _, onset] = e.probes else {
        return None;
    };
    if onset.points.len() < 16 || kick_shown(e).is_none_or(|shown| shown.abs() > SHOWN_WITHIN) {
        return None;
    }
    let theirs = deviation(&detrended(&onset.points, |p| p.1 + p.2));
    let ours = deviation(&detrended(&onset.points, |p| p.2));
    if theirs > 0.5 * ours {
        return None;
    }
    Some(format!(
        "it was kicked, but before the onset its oscillation has {:.1} % of the reference's: its steps damp the growth",
        100.0 * theirs / ours
    ))
}

/// Sticks of the reference are missing, or are reversals, that are shorter than four of the candidate's intervals.
fn step_too_large(e: &Evidence<'_>) -> Option<String> {
    let interval = e.interval?;
    let is_missing =
        |d: &&Difference| matches!(d.fault, Fault::Missing | Fault::Renamed) && d.kind == EventKind::Stick.name();
    let duration = |d: &Difference| Some(e.reference.get(d.position + 1)?.time - e.reference.get(d.position)?.time);
    const STEPS: f64 = 4.0;
    let missing = e.alignment.differences.iter().filter(is_missing);
    let short: Vec<f64> = missing.filter_map(duration).filter(|d| *d < STEPS * interval).collect();
    let shortest = short.iter().copied().min_by(f64::total_cmp)?;
    let in_words = |time: f64| match interval < 1e-3 {
        true => format!("{:.1} us", time * 1e6),
        false => format!("{time:.1e} s"),
    };
    Some(format!(
        "{} missing stick{} shorter than four of its steps of {}, the shortest {}",
        short.len(),
        if short.len() == 1 { " is" } else { "s are" },
        in_words(interval),
        in_words(shortest)
    ))
}

/// At half of its sticks or more the candidate still slid when it stuck, by more than the parabola through its samples
/// can err; or omega_r stands still at a value outside the tolerance.
fn velocity_tolerance(e: &Evidence<'_>) -> Option<String> {
    // What creeps does not stand still.
    if e.creep.is_some() || !e.physics.sticks() {
        return None;
    }
    let speed = e.physics.speed();
    let unit = e.unit();
    let bodies = e.physics.vocabulary().bodies();
    if e.plateau > 0.0 && e.plateau < speed {
        return Some(format!(
            "its relative velocity stands still at up to {:.1e} {unit}: sticks that were declared before the {bodies} had \
                 stopped; --velocity-tolerance {:.0e} makes them count",
            e.plateau,
            1.5 * e.plateau
        ));
    }
    let sticks = e.found.iter().filter(|f| f.kind == EventKind::Stick);
    let typical = median(sticks.filter_map(|f| f.dropped).collect())?;
    let omega = e.physics.natural_angular_frequency();
    let unseen = if e.detected { (omega * e.interval?).powi(3) } else { 0.0 };
    if typical <= speed * (unseen + 1e-6) {
        return None;
    }
    Some(format!(
        "it sticks while the {bodies} still slide, typically at {typical:.1e} {unit}: sticks begin too early"
    ))
}

/// At the candidate's breakaways another torque than the one that the reference tests stands at mu_0 r F_n, much closer
/// and in most of them; or the tested torque stands at another multiple of it.
fn stick_test(e: &Evidence<'_>) -> Option<String> {
    if e.creep.is_some() || !torques_count(e) {
        return None;
    }
    let tests = [BreakawayTest::Transmitted, BreakawayTest::Stator, BreakawayTest::Rotor];
    let name = |test| match test {
        BreakawayTest::Transmitted => "T_f = (T_r + T_s)/2",
        BreakawayTest::Stator => "the stator torque T_s",
        BreakawayTest::Rotor => "the rotor torque T_r",
    };
    let ratios = |test| breakaway_ratios(e.physics, e.found, test);
    let deviation_of = |test| median(ratios(test).into_iter().map(|ratio| (ratio - 1.0).abs()).collect());
    let ours = e.physics.trains.breakaway_test;
    let expected = deviation_of(ours)?;
    let (best, least) = tests
        .into_iter()
        .filter_map(|test| Some((test, deviation_of(test)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    if best != ours && expected > 1e-4 && least < 0.2 * expected {
        return Some(format!(
            "at its breakaways {} stands at mu_0 r F_n, where the reference tests {}",
            name(best),
            name(ours)
        ));
    }
    let tested = ratios(ours);
    let [low, middle, high] = [1, 2, 3].map(|share| tested[share * tested.len() / 4]);
    let same = high - low < 0.1 * (middle - 1.0).abs();
    if tested.len() < 3 || (middle - 1.0).abs() < 0.01 || !same {
        return None;
    }
    let mut evidence = format!("it breaks away at {middle:.3} {}", limit_of(e.physics));
    let system = e.physics.system();
    let (at_rest, sliding) = (system.breakaway, system.law.coefficient(0.0));
    if (middle * at_rest / sliding - 1.0).abs() < 0.01 {
        evidence += &format!(": that is the limit of slip, mu(0) = {sliding}, and not mu_0 = {at_rest}");
    }
    Some(evidence)
}

/// The rotor twist is a multiple of the last digit of the rotor's angle, in nearly all samples.
fn absolute_angles(e: &Evidence<'_>) -> Option<String> {
    // Rounding is a cause where an instability amplifies it.
    if !e.physics.coasts() || e.grid.of < 16 || (e.grid.on as f64) < 0.999 * e.grid.of as f64 {
        return None;
    }
    let stiffness = e.physics.system().rotor.stiffness.first()?;
    let floor = stiffness * f64::EPSILON * 256.0;
    Some(format!(
        "its rotor twist is a difference of two angles, rounded to their last digit: a floor of about {floor:.0e} N m \
             under its torques, which the instability amplifies; integrate the twist itself"
    ))
}

/// Values less the straight line through them.
fn detrended(points: &[(f64, f64, f64)], value: impl Fn(&(f64, f64, f64)) -> f64) -> Vec<f64> {
    let n = points.len().max(1) as f64;
    let time = points.iter().map(|p| p.0).sum::<f64>() / n;
    let mean = points.iter().map(&value).sum::<f64>() / n;
    let (mut product, mut square) = (0.0, 0.0);
    for p in points {
        product += (p.0 - time) * (value(p) - mean);
        square += (p.0 - time) * (p.0 - time);
    }
    let slope = if square > 0.0 { product / square } else { 0.0 };
    points.iter().map(|p| value(p) - mean - slope * (p.0 - time)).collect()
}

/// Root mean square.
fn deviation(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Adds what the case of one of this program's own results says: it is the best evidence there is.
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
    // Where the reference is regularised, too, or alone, that is not what is wrong with the candidate.
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
        // They follow from it.
        causes.retain(|known| !matches!(known.cause, Cause::VelocityTolerance | Cause::StickTest));
    }
    causes.insert(0, Diagnosis::of(cause, evidence));
}

/// Adds another clock, which is all that differs.
pub(super) fn add_clock(causes: &mut Vec<Diagnosis>, clock: &OtherClock) {
    // What proposes the offset may have been found already; where the times count from is then all that is new.
    let proposed = causes.iter().find(|known| known.cause == Cause::TimeOffset).cloned();
    let evidence = format!("{}; repeat with --time-offset {:.9}", clock.words(), clock.to_add());
    let named = Diagnosis::of(Cause::TimeOffset, evidence);
    *causes = vec![proposed.filter(|_| clock.counts_from.is_none()).unwrap_or(named)];
}

/// Adds another kick; if runs from after it have the candidate's events, nothing else is needed.
pub(super) fn add_kick(causes: &mut Vec<Diagnosis>, kick: &OtherKick) {
    if kick.rerun.is_some() {
        causes.clear();
    }
    let tried = kick.rerun.as_ref().map(|rerun| format!("; {}", tried(rerun)));
    let evidence = kick.words() + &tried.unwrap_or_default();
    causes.insert(0, Diagnosis::of(Cause::AnotherKick, evidence));
}

/// Adds other numbers of the case. What follows from them is taken out where a run with them has the candidate's events.
pub(super) fn add_parameters(causes: &mut Vec<Diagnosis>, other: &OtherParameters) {
    let words: Vec<String> = other.numbers.iter().map(OtherNumber::words).collect();
    let mut evidence = words.join(" and ");
    let share = match 100.0 * other.explained {
        all if all > 99.99 => "over 99.99".to_owned(),
        part => format!("{part:.4}"),
    };
    evidence += &match other.found_by {
        FoundBy::Equations => format!(": explains {share} % of what its samples miss of the equations"),
        FoundBy::Breakaways => {
            format!(": it is the torque at which its sticks end, and explains {share} % of the errors of its events")
        }
        FoundBy::Events => format!(": explains {share} % of the errors of its events"),
    };
    for number in &other.or {
        evidence += &format!("; {} explains as much", number.words());
    }
    let confirmed = other.rerun.is_some_and(|rerun| rerun.explained > CONFIRMED);
    evidence += &match &other.rerun {
        Some(rerun) if confirmed || rerun.after.unmatched == 0 => format!("; {}", tried(rerun)),
        // Without a kick before its onset nobody's run has the events of another's.
        Some(_) => "; run with it, the case has other events".to_owned(),
        None => String::new(),
    };
    if confirmed {
        // A mode that grows otherwise, or sticks of another duration, follow from it.
        use Cause::{StepTooLarge, UnperturbedRun, UnresolvedMode, VelocityTolerance};
        let follows = [UnresolvedMode, StepTooLarge, VelocityTolerance, UnperturbedRun];
        causes.retain(|known| !follows.contains(&known.cause));
    }
    let found = Diagnosis::of(Cause::AnotherParameter, evidence);
    let breakaway = other.numbers.iter().any(|number| number.path == "friction.breakaway");
    let mut tests = causes
        .iter_mut()
        .filter(|known| known.cause == Cause::StickTest && breakaway);
    match tests.next() {
        // The same, seen at the torques.
        Some(test) => test.evidence += &format!("; {}", found.evidence),
        None => {
            // The torques at breakaway are measured by the case's numbers.
            causes.retain(|known| known.cause != Cause::StickTest || !confirmed);
            causes.insert(0, found);
        }
    }
}

/// Runs that explain this part of the errors confirm a number.
const CONFIRMED: f64 = 0.9;

/// What the runs came to.
fn tried(rerun: &Rerun) -> String {
    let outcome = |agreement: &Agreement, events: &str, of: &str| match agreement.unmatched {
        0 if agreement.max == 0.0 => format!("has {events} at the same times"),
        0 => format!("has {events} within {:.1e} s", agreement.max),
        // Of each pair both are without a partner.
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
