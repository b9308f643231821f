//! Warnings about a run.

use super::Summary;
use super::sequence::OtherStability;
use std::fmt;
use stickslip_case::Case;
use stickslip_engine::simulation::{Grazing, Method, SolverOptions};
use stickslip_system::model::system::Pressing;

/// Fraction of the energy turnover above which an open balance discredits the run. The defaults close it to 1e-9.
const OPEN_BALANCE: f64 = 1e-6;

/// Allowed fraction divided by `rtol`, and its limit. `cvode` at rtol 1e-5 leaves up to 3e-5 with accurate events.
const OPEN_OF_TOLERANCE: f64 = 10.0;
const MOST_OPEN: f64 = 1e-3;

/// A change of force within this fraction of the axial period costs at least six digits of the axial motion.
const SUDDEN: f64 = 1e-6;

pub(crate) const KICK_OPTION: &str =
    "--set 'perturbation=[{kind=\"kick\", time=\"instability\", relative_velocity=1e-4}]'";

/// Weakness of a result. It displays as one paragraph with a remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// The energy balance is open by more than the requested accuracy allows.
    #[error(
        "the energy balance does not close: it is off by {residual:.1e} J of the {turnover:.1e} J that the run turned \
         over, {:.1e} relative, so the energies and angles of this result, at least, are not accurate. {remedy}",
        .residual / .turnover
    )]
    OpenBalance {
        /// Largest |residual|, J.
        residual: f64,
        /// Energy turnover of the run, J.
        turnover: f64,
        /// Remedy.
        remedy: BalanceRemedy,
    },
    /// A guard turned back at its boundary, or had just left it, within the solver's resolution.
    #[error(
        "at t = {:.9} s the run comes within its own error of an event ({}){}: whether the contact changes \
         there, and for how short a time, is not decided. {}",
        .grazing.time, .grazing.guard, more_times(.grazing.count), finer(.solver)
    )]
    Grazing {
        /// Count, first time, and guard.
        grazing: Grazing,
        /// Settings of the run.
        solver: SolverOptions,
    },
    /// The method locates events only to within a step.
    #[error(
        "nothing was located: the events have the times of ends of steps, and the method's own noise may have started \
         the stick-slip. Compare this run with one by another method"
    )]
    EventsNotLocated,
    /// Another method finds other events.
    #[error(
        "another method, {method}, agrees with {} only: {}. What follows may be amplified error of the \
         methods, and no result: stickslip certify says which events hold; a smaller solver.rtol helps where the \
         error is the method's, and a [[perturbation]] where an instability starts from rounding",
        counted(*.agreeing), differs(*.from, *.apart)
    )]
    OtherSequence {
        /// Name of the other method.
        method: &'static str,
        /// Leading events that agree.
        agreeing: usize,
        /// Time of the first event that differs, s.
        from: f64,
        /// Distance of that event between the methods, in s and as a fraction of the time since the previous event.
        apart: Option<(f64, f64)>,
    },
    /// Another method finds the same events, but other changes of stability.
    #[error(
        "another method, {method}, finds the same sequence of events, but {} changes of stability of steady sliding \
         instead of {}; they differ from t = {:.6} s on. stickslip certify says which hold",
        .stability.found, .stability.expected, .stability.from
    )]
    OtherStability {
        /// Name of the other method.
        method: &'static str,
        /// The difference.
        stability: OtherStability,
    },
    /// Another method finds the same events, but at a larger distance than the settings promise.
    #[error(
        "another method, {method}, finds the same events, but puts the one at t = {time:.6} s {apart:.1e} s away, which is \
         more than the settings of the run promise. stickslip certify says how many digits hold"
    )]
    OtherTimes {
        /// Name of the other method.
        method: &'static str,
        /// Time of the first such event, s.
        time: f64,
        /// Distance, s.
        apart: f64,
    },
    /// The stick-slip is amplified rounding.
    #[error(
        "this stick-slip is amplified rounding error, not a property of the model. Sliding loses stability at \
         t = {instability:.6} s, and until the first stick whatever deviates from smooth sliding grows by \
         e^{growth_to_onset:.0} (of the growth exponent G = {growth_exponent:.1} up to where smooth sliding itself would \
         stick); {}, so the onset, the counts and every event after it belong to this solver and this tolerance, and \
         change with both. For a result that converges set a perturbation well above rounding, such as {kick}",
        match .perturbed {
            true => "no perturbation stands far enough above rounding when its growth begins",
            false => "no perturbation is set",
        },
        kick = KICK_OPTION
    )]
    NoiseDetermined {
        /// Loss of stability, s; NaN if unknown.
        instability: f64,
        /// e-folds from the loss of stability to the first stick.
        growth_to_onset: f64,
        /// Growth exponent G, e-folds.
        growth_exponent: f64,
        /// Whether the case has perturbations, which are then too late or too small.
        perturbed: bool,
    },
    /// The run ended before the times of kicks.
    #[error(
        "{count} of the kicks never came: the run ended at t = {end} s, before {} time; set a later \
         output.end_time, or an earlier time of the kick",
        if *.count == 1 { "its" } else { "their" }
    )]
    KicksAfterTheEnd {
        /// Number of kicks.
        count: usize,
        /// End of the run, s.
        end: f64,
    },
    /// Kicks waited for a loss of stability in vain.
    #[error("{count} of the kicks set at the instability never came: {}", never(*.stuck, *.end))]
    KicksWithoutInstability {
        /// Number of kicks.
        count: usize,
        /// End of the run, s.
        end: f64,
        /// Whether the run has a stick, before which a loss of stability was due.
        stuck: bool,
    },
}

/// Remedy for an open energy balance.
#[derive(Debug, Clone, PartialEq)]
pub enum BalanceRemedy {
    /// The force changes so fast that the parts of the closed form are large and cancel.
    SlowerForce {
        /// Duration of the change, s.
        change: f64,
        /// Axial period, s.
        period: f64,
    },
    /// Tighter settings of the solver.
    Tolerances(SolverOptions),
}

/// Allowed open share of the turnover. Fixed steps and methods without location control no error by `rtol`.
fn allowed_open(solver: &SolverOptions) -> f64 {
    if solver.fixed_step.is_some() || !solver.method.locates_events() {
        return OPEN_BALANCE;
    }
    (OPEN_OF_TOLERANCE * solver.rtol).clamp(OPEN_BALANCE, MOST_OPEN)
}

pub(crate) fn open_balance(
    (residual, turnover): (f64, f64),
    solver: &SolverOptions,
    remedy: impl FnOnce() -> BalanceRemedy,
) -> Option<Warning> {
    (residual > allowed_open(solver) * turnover).then(|| Warning::OpenBalance {
        residual,
        turnover,
        remedy: remedy(),
    })
}

pub(crate) fn grazing(grazing: Option<Grazing>, solver: &SolverOptions) -> Option<Warning> {
    grazing.map(|grazing| Warning::Grazing {
        grazing,
        solver: solver.clone(),
    })
}

/// All warnings of a run except those of the witness.
pub fn warnings(case: &Case, summary: &Summary) -> Vec<Warning> {
    let (solver, output) = (&case.solver, &case.output);
    let mut warnings = Vec::new();
    let balance = (summary.energy_residual, summary.energy_turnover);
    warnings.extend(open_balance(balance, solver, || balance_remedy(case)));
    warnings.extend(grazing(summary.grazing, solver));
    if !solver.method.locates_events() {
        warnings.push(Warning::EventsNotLocated);
    }
    if summary.noise_determined {
        warnings.push(Warning::NoiseDetermined {
            instability: summary.instability_time.unwrap_or(f64::NAN),
            growth_to_onset: summary.growth_to_onset.unwrap_or(0.0),
            growth_exponent: summary.growth_exponent.unwrap_or(0.0),
            perturbed: !case.system.kicks.is_empty(),
        });
    }
    // A run that was cut short has its own explanation.
    if summary.end >= output.end_time {
        let (end, waiting) = (summary.end, summary.kicks_without_instability);
        let late = summary.kicks_never_given.saturating_sub(waiting);
        if late > 0 {
            warnings.push(Warning::KicksAfterTheEnd { count: late, end });
        }
        if waiting > 0 {
            let stuck = summary.sticks > 0;
            warnings.push(Warning::KicksWithoutInstability {
                count: waiting,
                end,
                stuck,
            });
        }
    }
    warnings
}

fn balance_remedy(case: &Case) -> BalanceRemedy {
    if let Pressing::Axial { axial, actuation } = &case.system.pressing {
        let change = actuation.pieces().shortest_change();
        let period = std::f64::consts::TAU * (axial.mass / axial.stiffness).sqrt();
        if change < SUDDEN * period {
            return BalanceRemedy::SlowerForce { change, period };
        }
    }
    BalanceRemedy::Tolerances(case.solver.clone())
}

/// Relative tolerance below which rounding outweighs the gain, from the ladder's errors (docs/theory.md). Single
/// multistep methods and pairs of low order gain down to 1e-13.
fn floor(method: Method) -> f64 {
    match method {
        Method::Series | Method::Cvode => SolverOptions::default().rtol,
        _ if method.resolving_table() == Some(Method::BEST_PAIR) => SolverOptions::default().rtol,
        _ => 1e-13,
    }
}

/// Advice for a more accurate result, as a sentence.
pub fn finer(solver: &SolverOptions) -> String {
    let (method, rtol) = (solver.method.name(), solver.rtol);
    let better = solver.rtol > floor(solver.method);
    match solver.method {
        Method::Paper | Method::Rk4 => "Use solver.method = \"cvode\" or \"series\", which locate events".to_owned(),
        _ if solver.fixed_step.is_some() => "Use a smaller solver.fixed_step, or solver.rtol in its place".to_owned(),
        Method::Series if better => "Use a smaller solver.rtol".to_owned(),
        Method::Series => format!(
            "With series at rtol {rtol:e} only rounding to double precision is left; certify --oracle computes the exact \
             solution"
        ),
        _ if better => "Use a smaller solver.rtol, or solver.method = \"series\"".to_owned(),
        _ => format!(
            "Use solver.method = \"series\": at rtol {rtol:e} {method} is as accurate as it gets, and below takes more \
             steps, which round more often"
        ),
    }
}

impl fmt::Display for BalanceRemedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BalanceRemedy::SlowerForce { change, period } => write!(
                f,
                "The force changes within {change:.1e} s, so much faster than the axial oscillation of {period:.1e} s that \
                 its work is lost in rounding: make it change more slowly, or use actuation.rise_time = 0, which is a step"
            ),
            BalanceRemedy::Tolerances(solver) => {
                let defaults = SolverOptions::default();
                let given = [solver.atol_twist, solver.atol_rate, solver.atol_speed];
                let smaller = format!("use a smaller {}", solver.method.step_key());
                let mut ways = Vec::with_capacity(3);
                if given.iter().any(Option::is_some) {
                    ways.push("leave the solver's atol_ keys to their defaults");
                }
                if solver.fixed_step.is_some() {
                    ways.push(&smaller);
                } else if solver.rtol > defaults.rtol {
                    ways.push("use a smaller solver.rtol");
                }
                ways.push(match solver.method {
                    Method::Series => "use --method arkode",
                    _ => "use --method series",
                });
                let ways = match ways.split_last() {
                    Some((last, [])) => (*last).to_owned(),
                    Some((last, others)) => format!("{}, or {last}", others.join(", ")),
                    None => String::new(),
                };
                let (first, rest) = ways.split_at(1.min(ways.len()));
                write!(f, "{}{rest}", first.to_uppercase())
            }
        }
    }
}

fn more_times(count: usize) -> String {
    match count {
        0 | 1 => String::new(),
        _ => format!(", and so {} times more", count - 1),
    }
}

fn counted(events: usize) -> String {
    match events {
        0 => "no event".to_owned(),
        1 => "one event".to_owned(),
        _ => format!("{events} events"),
    }
}

fn differs(from: f64, apart: Option<(f64, f64)>) -> String {
    match apart {
        Some((apart, share)) => format!(
            "the next, at t = {from:.6} s, it finds {apart:.1e} s away, {share:.1e} of the time since the event before"
        ),
        None => format!("from t = {from:.6} s on it finds others"),
    }
}

fn never(stuck: bool, end: f64) -> String {
    match stuck {
        true => "steady sliding did not lose its stability before the first stick".to_owned(),
        false => format!("the run ended at t = {end} s, before sliding lost its stability or came to a stick"),
    }
}
