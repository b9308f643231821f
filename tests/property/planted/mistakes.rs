//! Mistakes of solvers, and what may be said of each.

use super::filing::{Filing, is_speed};
use super::subject::{Subject, one_of, pick, scale, solve};
use super::written::{self, Columns, Digits, Written};
use crate::common::planted_solver::{Method, Smooth, Solver, Tested, Y};
use crate::common::random_brakes::Random;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write;

use stickslip::case::Motion;
use stickslip::friction::{FrictionLaw, Law};
use stickslip::model::KickTime;
use stickslip::model::system::{End, KickSide, Pressing, System, Train};
use stickslip::signal::{Drive, HarmonicShape};

/// Rows of a candidate at most.
pub(super) const MOST_ROWS: f64 = 60_000.0;

/// What is planted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    Nothing,
    /// An adaptive method with a loose tolerance.
    Tolerance,
    /// A number of the case.
    Number,
    /// An initial value, also one that is zero.
    Initial,
    /// A force, a stiffness or a damping that the case does not have.
    Term,
    /// A smooth law.
    Regularised,
    /// Sticks end at another multiple of the limit.
    Breakaway,
    /// Sticks end by the torque on one surface.
    OtherTorque,
    /// Sticks begin within a velocity tolerance.
    Band,
    /// Events are taken at the ends of steps.
    EndOfStep,
    /// One event is late.
    OneLate,
    /// A method of low order, or with few steps.
    LowOrder,
    /// No kick, another one, or on one surface.
    Kick,
    /// Times count from elsewhere.
    Clock,
    /// A column in another unit or of the other sign.
    Unit,
    /// A harmonic with sine and cosine exchanged.
    SineForCosine,
    /// mu as a function of the speed of one surface.
    WrongSpeed,
    /// Nothing, but few digits in the file.
    Decimals,
    /// Two numbers of the case.
    TwoNumbers,
    /// A constant is added to a column.
    Offset,
    /// The times are multiplied.
    ClockRate,
    /// Columns are moving averages.
    Average,
    /// Columns are low-pass filtered.
    LowPass,
    /// Speeds are those of half a step earlier or later.
    HalfStep,
    /// Two columns are exchanged.
    Swapped,
    /// Each row stands several times.
    Repeated,
    /// The kick comes at another time.
    KickTime,
    /// A breakaway is stepped over.
    SteppedOver,
    /// All coefficients of friction are wrong by one factor.
    Coefficients,
}

pub(super) use Kind::*;

/// As often as they are drawn.
#[rustfmt::skip]
pub(super) const KINDS: [Kind; 32] = [
    Nothing, Number, Regularised, Number, Term, EndOfStep, Number, Clock, Tolerance, Number, Breakaway, Band, Initial,
    OneLate, Number, LowOrder, Nothing, Number, Kick, Unit, Number, Initial, SineForCosine, WrongSpeed, Decimals, Number,
    OtherTorque, Term, OneLate, Number, TwoNumbers, Number,
];

/// Mistakes in what is recorded of a motion, and in its events, as often as they are drawn.
#[rustfmt::skip]
pub(super) const RECORDED: [Kind; 10] = [
    Offset, Average, Swapped, KickTime, ClockRate, LowPass, Repeated, SteppedOver, HalfStep, Coefficients,
];

impl Kind {
    /// Whether there is a cause by which `compare` may name one of which this may be said.
    pub fn has_a_name(self, allowed: &Allowed) -> bool {
        let is_allowed = !allowed.causes.is_empty() || !allowed.numbers.is_empty();
        is_allowed && !matches!(self, Nothing | Tolerance | Decimals)
    }

    /// Whether it leaves the motion between events as the equations have it, if that follows from the kind.
    pub fn follows(self) -> Option<bool> {
        match self {
            Nothing | Decimals | Clock | Initial | Kick | Breakaway | OtherTorque | Band | EndOfStep | OneLate
            | KickTime | SteppedOver => Some(true),
            Term | WrongSpeed => Some(false),
            _ => None,
        }
    }
}

/// What may be said of a candidate.
#[derive(Debug, Clone, Default)]
pub(super) struct Allowed {
    /// Causes, by a part of their names.
    pub causes: Vec<&'static str>,
    /// What has to be in the evidence of them.
    pub words: Vec<String>,
    /// A number in the evidence, where it stands there: what it follows, its value, and by how much it may be off.
    pub value: Option<(&'static str, f64, f64)>,
    /// What was added to the times, s.
    pub clock: Option<f64>,
    /// A number of the case: paths that mean the same, its value, and that of the reference.
    pub numbers: Vec<(String, f64, f64)>,
    /// The numbers are all of them mistaken, and none stands for another.
    pub together: bool,
    /// Causes, with a part of their evidence, that say the same of a candidate in other words.
    pub same: Vec<(&'static str, &'static str)>,
    /// What cannot be told from it and may stand beside it, as above: causes, or numbers by a part of their paths.
    pub beside: Vec<&'static str>,
}

impl Allowed {
    pub fn causes(causes: &[&'static str]) -> Allowed {
        Allowed {
            causes: causes.to_vec(),
            ..Allowed::default()
        }
    }

    pub fn number(path: &str, value: f64, reference: f64) -> Allowed {
        Allowed {
            numbers: vec![(path.to_owned(), value, reference)],
            ..Allowed::default()
        }
    }
}

/// A candidate.
pub(super) struct Planted {
    /// In words.
    pub what: String,
    pub allowed: Allowed,
    pub solver: Solver,
    pub start: Option<Y>,
    pub file: Written,
}

fn driven(train: &Train) -> bool {
    matches!(train.end, End::Driven(_))
}

/// A mistake of a kind in a system, or none where it has no place.
pub(super) fn plant(system: &Subject, kind: Kind, random: &mut Random) -> Option<Planted> {
    let sound = Solver::sound(&system.case.system);
    let period = sound.period();
    let end = if system.coasts() {
        0.03
    } else {
        system.case.output.end_time
    };
    let per_period = one_of(random, &[24.0, 50.0, 100.0, 200.0, 400.0, 400.0, 4000.0]);
    let interval = (period / per_period).max(end / MOST_ROWS);
    // Most take round ones.
    let interval = match random.next() < 0.8 {
        true => format!("{interval:.1e}").parse().unwrap(),
        false => interval,
    };
    let rough = kind == Decimals;
    let drawn = random.next();
    let digits = match drawn {
        _ if rough => {
            let [six, seven] = [6, 7].map(Digits::Significant);
            one_of(random, &[Digits::Decimals(6), Digits::Decimals(6), six, seven])
        }
        d if d < 0.6 || system.coasts() => Digits::All,
        d if d < 0.8 => Digits::Significant(12),
        _ => Digits::Significant(9),
    };
    let (state, plain, velocity) = (Columns::State, Columns::Plain, Columns::RelativeVelocity);
    let columns = one_of(random, &[state, state, state, plain, velocity]);
    let of_events = matches!(
        kind,
        Nothing | Number | Initial | Breakaway | EndOfStep | OneLate | Clock | Kick
    );
    let mut file = Written {
        interval,
        digits,
        columns,
        events: random.next() < 0.3,
        alone: random.next() < 0.1 && of_events,
        tolerance: None,
        clock: 0.0,
        changed: None,
        filing: None,
    };
    if file.columns == Columns::Plain && written::columns(system, &sound, Columns::Plain).is_empty() {
        file.columns = Columns::State;
    }
    let mut solver = sound.clone();
    // Some are less accurate, as many are.
    if matches!(kind, Nothing | Number | Initial | Clock | Unit | Kick) && random.next() < 0.4 {
        solver.step = period / one_of(random, &[200.0, 400.0, 700.0]);
    }
    let at_kick = system.coasts() && random.next() < 0.5;
    let mut start = at_kick.then(|| system.after_kick().1);
    let mut allowed = Allowed::default();
    let case = &system.case.system;
    let sizes = system.sizes();
    let what = match kind {
        Nothing => format!("nothing (step {:.1e} s)", solver.step),
        Decimals => "nothing but few digits".to_owned(),
        Tolerance => {
            let tolerance = one_of(random, &[1e-3, 1e-4, 1e-5, 1e-6, 1e-8]);
            solver.method = Method::Adaptive(tolerance);
            solver.step = period / 3.0;
            allowed = Allowed::causes(&["method", "order"]);
            // It steps over a breakaway that is undone within the step, and slips at the next.
            allowed.same = vec![("event-late", "one event alone")];
            format!("an adaptive method of order 5 with a tolerance of {tolerance:e}")
        }
        Number => {
            let all = system.numbers();
            let (path, value) = pick(random, &all).clone();
            let factors = [0.5, 0.8, 0.9, 0.95, 0.98, 0.99, 1.01, 1.02, 1.05, 1.1, 1.25, 2.0];
            let factor = one_of(random, &factors);
            let other = factor * value;
            solver = of_other(&solver, system.with(&[(&path, other)])?);
            if at_kick && (path.starts_with("initial") || path.starts_with("a")) {
                start = None;
            }
            allowed = Allowed::number(&path, other, value);
            if path == "friction.breakaway" {
                allowed.causes = vec!["stick-test"];
            } else if path.starts_with("initial") {
                allowed.causes = vec!["another-state"];
            }
            format!("{path} = {other:?} for {value:?}")
        }
        TwoNumbers => {
            let all = system.numbers();
            let mut changes: Vec<(&str, f64)> = Vec::new();
            for _ in 0..2 {
                let (path, value) = pick(random, &all);
                let other = value * one_of(random, &[0.8, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.25]);
                changes.push((path, other));
                allowed.numbers.push((path.clone(), other, *value));
            }
            if changes[0].0 == changes[1].0 {
                return None;
            }
            allowed.together = true;
            solver = of_other(&solver, system.with(&changes)?);
            start = None;
            format!("{changes:?}")
        }
        Initial => {
            if system.coasts() {
                return None;
            }
            let (rotor, stator) = (&case.rotor, &case.stator);
            let mut places = Vec::new();
            for (name, train, twists, speeds) in [
                ("rotor", rotor, &case.initial.rotor_twist, &case.initial.rotor_speed),
                ("stator", stator, &case.initial.stator_twist, &case.initial.stator_speed),
            ] {
                places.extend((0..train.shafts()).map(|i| (format!("initial.{name}_twist.{i}"), twists[i], sizes[0])));
                let count = train.inertia.len();
                places.extend((0..count).map(|i| (format!("initial.{name}_speed.{i}"), speeds[i], sizes[1])));
            }
            let (path, value, size) = pick(random, &places).clone();
            let other = value + size * one_of(random, &[-0.5, -0.1, 0.03, 0.1, 0.5, 1.0]);
            let mut changed = case.clone();
            set_initial(&mut changed, &path, other);
            solver = of_other(&solver, changed);
            allowed = Allowed::number(&path, other, value);
            allowed.causes = vec!["another-state"];
            // The reference comes to that state, too, at another time.
            allowed.same = vec![("time-offset", "or it begins in another state")];
            format!("{path} = {other:?} for {value:?}")
        }
        Term => {
            let force = case.radius * system.largest_normal_force() * case.law.at_vanishing_speed();
            let surface = if case.stator.inertia.is_empty() {
                "rotor"
            } else {
                "stator"
            };
            let share = scale(random, 0.01, 0.1);
            match (random.next() * 3.0) as usize {
                0 => {
                    solver.torque = share * force;
                    if file.columns == Columns::RelativeVelocity {
                        // A spring that is twisted by as much moves in the same way.
                        file.columns = Columns::State;
                    }
                    for key in [format!("{surface}.torque"), format!("{surface}.torque.mean")] {
                        allowed.numbers.push((key, solver.torque, 0.0));
                    }
                    format!("a constant force of {:e}", solver.torque)
                }
                1 => {
                    let side = usize::from(surface == "stator");
                    if [&case.rotor, &case.stator][side].stiffness.is_empty() {
                        return None;
                    }
                    solver.hardening[side] = one_of(random, &[-1.0, 1.0, 2.0]) * share / (sizes[0] * sizes[0]);
                    format!("a shaft with a stiffness of k (1 + {:e} u^2)", solver.hardening[side])
                }
                _ => {
                    solver.drag = share * force / sizes[1];
                    let train = [&case.rotor, &case.stator][usize::from(surface == "stator")];
                    let mut may_be = |path: &str, now: f64| {
                        let path = format!("{surface}.{path}");
                        allowed.numbers.push((path, now + solver.drag, now));
                    };
                    may_be("viscous.0", train.viscous[0]);
                    if train.inertia.len() == 1 && train.shafts() == 1 && !driven(train) {
                        may_be("damping.0", train.damping[0]);
                    }
                    format!("a damping of {:e} to the ground", solver.drag)
                }
            }
        }
        Regularised => {
            let eps = sizes[1] * scale(random, 2e-4, 2e-2);
            let function = one_of(random, &[Smooth::Tanh, Smooth::Arctan]);
            solver.smooth = Some((function, eps));
            let inertia = [&case.rotor, &case.stator].map(|train| train.inertia.first().copied());
            let least = inertia.into_iter().flatten().fold(f64::INFINITY, f64::min);
            let rate = case.law.at_vanishing_speed() * case.radius * system.largest_normal_force() / (eps * least);
            solver.step = solver.step.min(0.4 / rate);
            if system.coasts() {
                start = Some(system.after_kick().1);
            }
            file.events = false;
            allowed = Allowed::causes(&["regularised"]);
            let name = match function {
                Smooth::Tanh => "tanh",
                _ => "arctan",
            };
            allowed.words.push(name.to_owned());
            allowed.value = Some(("eps = ", eps, 0.1 * eps));
            file.tolerance = one_of(random, &[None, Some(3.0), Some(10.0)]).map(|times| times * eps);
            format!("{name}(omega_r/eps) with eps = {eps:e}")
        }
        Breakaway => {
            let rest = case.law.at_vanishing_speed() / case.breakaway;
            let factor = if rest < 0.985 && random.next() < 0.5 {
                // The limit of slip, or something above it.
                one_of(random, &[rest, 0.5 * (1.0 + rest)])
            } else {
                one_of(random, &[1.01, 1.02, 1.05, 1.1, 1.3])
            };
            solver.breakaway = factor;
            let value = factor * case.breakaway;
            allowed = Allowed::number("friction.breakaway", value, case.breakaway);
            allowed.causes = vec!["stick-test"];
            allowed.value = Some(("breaks away at ", factor, (0.3 * (factor - 1.0).abs()).max(1e-3)));
            format!("sticks end at {factor:?} of mu_0 r F_n")
        }
        OtherTorque => {
            if case.rotor.inertia.is_empty() || case.stator.inertia.is_empty() {
                return None;
            }
            solver.tested = one_of(random, &[Tested::Rotor, Tested::Stator]);
            allowed = Allowed::causes(&["stick-test"]);
            format!("sticks end by the torque of {:?}", solver.tested)
        }
        Band => {
            solver.band = sizes[1] * scale(random, 1e-3, 3e-2);
            solver.frozen = random.next() < 0.3;
            file.events = random.next() < 0.5;
            allowed = Allowed::causes(&["velocity-tolerance"]);
            let mut what = format!("sticks at |omega_r| <= {:e}", solver.band);
            if solver.frozen {
                what += ", which stays";
                file.tolerance = one_of(random, &[None, Some(1.1 * solver.band)]);
            }
            if random.next() < 0.5 {
                solver.located = false;
                solver.step = file.interval / one_of(random, &[1.0, 2.0, 5.0]);
                allowed.causes.extend(["events-late", "step-too-large"]);
                write!(what, ", at the ends of steps of {:e} s", solver.step).unwrap();
            }
            what
        }
        EndOfStep => {
            solver.located = false;
            solver.step = file.interval / one_of(random, &[1.0, 1.0, 2.0, 5.0]);
            allowed = Allowed::causes(&["events-late", "step-too-large"]);
            if system.word.len() <= 2 {
                allowed.same = vec![("event-late", "one event alone")];
            }
            format!("events at the ends of steps of {:e} s", solver.step)
        }
        OneLate => {
            let most = system.word.len();
            let place = (random.next() * most.min(12) as f64) as usize;
            let late = period * one_of(random, &[0.002, 0.005, 0.01, 0.02, 0.05]);
            solver.late = Some((place, late));
            allowed = Allowed::causes(&["event-late", "late-event", "stick-late", "slip-late", "event-moved"]);
            format!("event {place} late by {late:e} s")
        }
        LowOrder => {
            let methods = [
                (Method::SemiImplicitEuler, "the semi-implicit Euler method", 200.0),
                (Method::Euler, "Euler's method", 2000.0),
                (Method::ImplicitEuler, "the implicit Euler method", 1000.0),
                (Method::Rk2, "the midpoint rule", 60.0),
                (Method::Rk4, "the classical Runge-Kutta method", 16.0),
            ];
            let (method, name, steps) = one_of(random, &methods);
            let steps = steps * one_of(random, &[1.0, 2.0]);
            (solver.method, solver.step) = (method, period / steps);
            file.interval = file.interval.max(solver.step);
            let every = (file.interval / solver.step).round().max(1.0);
            file.interval = every * solver.step;
            allowed = Allowed::causes(&["method", "order", "unresolved-mode", "step-too-large"]);
            format!("{name} with steps of {:e} s", solver.step)
        }
        Kick => {
            let kick = case.kicks.first()?;
            kick.time.at()?;
            let mut changed = case.clone();
            start = None;
            if !case.rotor.inertia.is_empty() && !case.stator.inertia.is_empty() && random.next() < 0.3 {
                changed.kicks[0].on = one_of(random, &[KickSide::Rotor, KickSide::Stator]);
                solver = of_other(&solver, changed);
                allowed = Allowed::causes(&["another-kick"]);
                format!("the kick on the {:?} alone", solver.system.kicks[0].on)
            } else {
                let factor = one_of(random, &[0.0, 0.5, 0.9, 1.1, 2.0, -1.0]);
                let (now, other) = (kick.relative_velocity, factor * kick.relative_velocity);
                changed.kicks[0].relative_velocity = other;
                solver = of_other(&solver, changed);
                file.events &= factor != 0.0 || !system.coasts();
                allowed = Allowed::number("perturbation.0.relative_velocity", other, now);
                let none = factor == 0.0;
                allowed.causes = if none {
                    vec!["unperturbed-run", "kick"]
                } else {
                    vec!["another-kick"]
                };
                format!("a kick {factor} times the reference's")
            }
        }
        Clock => {
            file.clock = match system.coasts() {
                true => one_of(random, &[-6.9, -0.5, -1e-3, 3e-3, 5e-3, 7e-3]),
                false => one_of(random, &[-0.3, 0.02, 0.5, 3.0]) * period,
            };
            allowed = Allowed::causes(&["time-offset"]);
            allowed.clock = Some(file.clock);
            // Another time of the same motion is another state to begin with, under another phase of what drives it.
            allowed.beside = vec!["another-state", "initial.", "phase", "perturbation."];
            format!("times with {:e} s added", file.clock)
        }
        Unit => {
            let names = written::columns(system, &sound, file.columns);
            let places: Vec<usize> = (0..names.len()).collect();
            let place = *pick(random, &places);
            let mut factors = vec![-1.0, 1e3, 1e-3];
            if system.case.motion() == Motion::Rotation {
                factors.extend([180.0 / PI, PI / 180.0]);
            }
            let factor = one_of(random, &factors);
            file.changed = Some((place, factor));
            allowed = Allowed::causes(&["wrong-units"]);
            format!("{} times {factor:?}", names[place].1)
        }
        SineForCosine => {
            let mut changed = case.clone();
            let (path, phase, other) = turned(&mut changed)?;
            solver = of_other(&solver, changed);
            allowed = Allowed::number(&path, other, phase);
            for turns in [-TAU, TAU] {
                allowed.numbers.push((path.clone(), other + turns, phase));
            }
            allowed.causes = vec!["sine"];
            format!("sine and cosine exchanged: {path} = {other:?} for {phase:?}")
        }
        WrongSpeed => {
            if matches!(case.law, FrictionLaw::Coulomb(_) | FrictionLaw::Polynomial(_))
                || !(driven(&case.rotor) || system.name == "clutch")
            {
                return None;
            }
            solver.wrong_speed = true;
            "mu as a function of the speed of one surface".to_owned()
        }
        Offset | ClockRate | Average | LowPass | HalfStep | Swapped | Repeated => {
            file.events = false;
            let (filing, may_be_said) = filed(system, &sound, kind, &file, random)?;
            file.filing = Some(filing);
            allowed = may_be_said;
            format!("{filing:?}")
        }
        KickTime => {
            let at = *case.kicks.first()?.time.at()?;
            let other = at + period * one_of(random, &[-1.5, -0.5, 0.1, 0.5, 2.0]);
            let mut changed = case.clone();
            changed.kicks[0].time = KickTime::At(other);
            let mut unkicked = case.clone();
            unkicked.kicks.clear();
            solver = of_other(&solver, changed);
            start = None;
            // In a stick that can take it a kick does nothing, at whatever time.
            let [kicked, unkicked] = [solver.clone(), of_other(&solver, unkicked)]
                .map(|solver| Some(solve(system, &solver, None, &file)?.events));
            let (kicked, unkicked) = (kicked?, unkicked?);
            let mut pairs = kicked.iter().zip(&unkicked);
            if kicked.len() == unkicked.len() && pairs.all(|(one, other)| (one.0 - other.0).abs() < 1e-9) {
                return None;
            }
            allowed = Allowed::number("perturbation.0.time", other, at);
            allowed.causes = vec!["another-kick"];
            allowed.value = Some(("comes at ", other, 0.02 * (other - at).abs()));
            format!("a kick at {other:e} s for {at:e} s")
        }
        SteppedOver => {
            let slips = system.word.iter().take(12).enumerate();
            let slips = slips.filter(|(_, event)| event.1 == "slip").map(|(place, _)| place);
            let slips: Vec<usize> = slips.collect();
            if slips.is_empty() {
                return None;
            }
            let place = *pick(random, &slips);
            solver.skipped = Some(place);
            // Where the limit is not passed a second time the surfaces stick together for ever.
            let solved = solve(system, &solver, start, &file)?;
            if solved.events.get(place..)?.iter().all(|event| event.1 != "slip") {
                return None;
            }
            allowed = Allowed::causes(&["missed-breakaway"]);
            format!("event {place} is stepped over")
        }
        Coefficients => {
            let factor = one_of(random, &[0.8, 0.9, 0.95, 0.98, 1.02, 1.05, 1.1, 1.25]);
            const NAMES: &str = "breakaway kinetic low_speed high_speed viscous linear quadratic cubic";
            let names: Vec<&str> = NAMES.split(' ').collect();
            let is_coefficient = |path: &str| path.strip_prefix("friction.").is_some_and(|name| names.contains(&name));
            let all = system.numbers().into_iter().filter(|(path, _)| is_coefficient(path));
            let all: Vec<(String, f64)> = all.collect();
            if all.len() < 2 {
                return None;
            }
            let changes = all.iter().map(|(path, value)| (path.as_str(), factor * value));
            let changes: Vec<(&str, f64)> = changes.collect();
            solver = of_other(&solver, system.with(&changes)?);
            start = None;
            const SAME: &str = "contact.radius contact.normal_force contact.normal_force.value actuation.force";
            let same = system.numbers().into_iter();
            let same = same.filter(|(path, _)| SAME.split(' ').any(|other| other == path));
            let each = all.iter().cloned().chain(same);
            allowed.numbers = each.map(|(path, value)| (path, factor * value, value)).collect();
            format!("all coefficients of friction times {factor}")
        }
    };
    let of_start = |path: &str| path.contains("initial.") || path.ends_with("phase");
    if allowed.numbers.iter().any(|(path, ..)| of_start(path)) {
        // In a stick, or in the end, that is the same motion at another time.
        allowed.beside.push("time-offset");
    }
    Some(Planted {
        what,
        allowed,
        solver,
        start,
        file,
    })
}

/// What is done to the rows of a file, and what may be said of it.
fn filed(
    system: &Subject,
    solver: &Solver,
    kind: Kind,
    file: &Written,
    random: &mut Random,
) -> Option<(Filing, Allowed)> {
    let names = written::columns(system, solver, file.columns);
    let shown = |place: usize| written::channel_name(system, &names[place].1);
    let places: Vec<usize> = (0..names.len()).collect();
    let near = |before: &'static str, value: f64| Some((before, value, 0.02 * value.abs()));
    let (filing, cause, words, value) = match kind {
        Offset => {
            let place = *pick(random, &places);
            let size = system.sizes()[usize::from(is_speed(&names[place].1))];
            let constant = size * one_of(random, &[-0.1, -1e-3, 1e-4, 1e-3, 1e-2]);
            let filing = Filing::Offset(place, constant);
            (filing, "channel-offset", vec![shown(place)], near("off by ", constant))
        }
        ClockRate => {
            let rate = one_of(random, &[0.98, 0.999, 0.9999, 1.0001, 1.0005, 1.0012, 1.01]);
            let value = Some(("runs at ", rate, 0.02 * (rate - 1.0_f64).abs()));
            (Filing::Rate(rate), "clock-rate", Vec::new(), value)
        }
        Average => {
            let count = one_of(random, &[2, 3, 5, 10, 20]);
            let value = near("moving average of ", count as f64);
            let (average, same) = (Filing::Average(count), Filing::Same(count));
            let filing = one_of(random, &[average, average, same]);
            (filing, "moving-average", Vec::new(), value)
        }
        LowPass => {
            let corner = 1.0 / (TAU * file.interval * scale(random, 1.0, 20.0));
            let value = near("corner at ", corner);
            (Filing::LowPass(corner), "low-pass-filter", Vec::new(), value)
        }
        HalfStep => {
            let speeds = names.iter().filter(|(_, name)| is_speed(name)).count();
            if speeds == 0 || speeds == names.len() {
                return None;
            }
            let filing = Filing::HalfStep(one_of(random, &[-1, 1]));
            (filing, "half-step", Vec::new(), near("those of ", 0.5 * file.interval))
        }
        Swapped => {
            let alike = |one: usize, other: usize| is_speed(&names[one].1) == is_speed(&names[other].1);
            let pairs = places.iter().flat_map(|&one| (0..one).map(move |other| (one, other)));
            let pairs: Vec<(usize, usize)> = pairs.collect();
            let of_one_kind: Vec<(usize, usize)> = pairs.iter().copied().filter(|&(a, b)| alike(a, b)).collect();
            let from = if of_one_kind.is_empty() { &pairs } else { &of_one_kind };
            if from.is_empty() {
                return None;
            }
            let (one, other) = *pick(random, from);
            let (_, columns) = written::table(system, solver, &solve(system, solver, None, file)?, file);
            // Two columns that are each other's negative only change their signs.
            let mut values = columns[one].iter().zip(&columns[other]);
            if values.all(|(one, other)| *one == -other) {
                return None;
            }
            let words = vec![shown(one), shown(other)];
            (Filing::Swapped(one, other), "swapped-columns", words, None)
        }
        Repeated => {
            let count = one_of(random, &[2, 3, 4, 5, 10]);
            let value = near("stand in ", count as f64);
            (Filing::Repeated(count), "repeated-rows", Vec::new(), value)
        }
        _ => return None,
    };
    let allowed = Allowed {
        words,
        value,
        ..Allowed::causes(&[cause])
    };
    Some((filing, allowed))
}

/// The same solver of another system.
pub(super) fn of_other(solver: &Solver, system: System) -> Solver {
    Solver {
        system,
        ..solver.clone()
    }
}

fn set_initial(system: &mut System, path: &str, value: f64) {
    let (name, index) = path.strip_prefix("initial.").unwrap().rsplit_once('.').unwrap();
    let index: usize = index.parse().unwrap();
    let initial = &mut system.initial;
    let list = match name {
        "rotor_twist" => &mut initial.rotor_twist,
        "rotor_speed" => &mut initial.rotor_speed,
        "stator_twist" => &mut initial.stator_twist,
        _ => &mut initial.stator_speed,
    };
    list[index] = value;
}

/// A harmonic of the system with sine and cosine exchanged: its path, and the phase that does the same.
fn turned(system: &mut System) -> Option<(String, f64, f64)> {
    let mut drives: Vec<(&str, &mut Drive)> = Vec::new();
    for (torque, speed, train) in [
        ("rotor.torque", "rotor.speed", &mut system.rotor),
        ("stator.torque", "stator.speed", &mut system.stator),
    ] {
        if let Some(on) = &mut train.torque {
            drives.push((torque, &mut on.signal));
        }
        if let End::Driven(end) = &mut train.end {
            drives.push((speed, end));
        }
    }
    if let Pressing::Force(force) = &mut system.pressing {
        drives.push(("contact.normal_force", force));
    }
    for (path, drive) in drives {
        if let Drive::Wave(wave) = drive {
            // cos(x) is sin(x + pi/2).
            let (shape, shift) = match wave.shape {
                HarmonicShape::Sine => (HarmonicShape::Cosine, FRAC_PI_2),
                HarmonicShape::Cosine => (HarmonicShape::Sine, -FRAC_PI_2),
            };
            let phase = wave.phase;
            wave.shape = shape;
            return Some((format!("{path}.phase"), phase, phase + shift));
        }
    }
    None
}
