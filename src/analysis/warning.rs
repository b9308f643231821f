//! Warnings of a run: what its user should know before the result is used.

use super::Summary;
use crate::case::Case;
use crate::model::system::Pressing;
use crate::simulation::{Grazing, Method, SolverOptions};
use std::fmt;

/// An energy balance open by more than this part of the energy turned over means that the run cannot be trusted: the
/// defaults close it to 1e-9.
const OPEN_BALANCE: f64 = 1e-6;

/// The same as a multiple of `rtol`, where that is more, and the most that any tolerance allows. By `cvode` at rtol 1e-5 runs
/// whose events are as good as asked leave up to 3e-5.
const OPEN_OF_TOLERANCE: f64 = 10.0;
const MOST_OPEN: f64 = 1e-3;

/// A change of force within this part of the axial period costs six digits of the axial motion and more.
const SUDDEN: f64 = 1e-6;

/// A perturbation that lets a run converge, as an option of the program.
pub(crate) const KICK_OPTION: &str =
    "--set 'perturbation=[{kind=\"kick\", time=\"instability\", relative_velocity=1e-4}]'";

/// Something that makes a result less than it seems. Displayed as one paragraph with what to do about it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The energy balance is open by more than runs as accurate as asked leave it.
    OpenBalance {
        /// Largest |residual|, J.
        residual: f64,
        /// Energy that the run turned over, J.
        turnover: f64,
        /// What closes it.
        remedy: BalanceRemedy,
    },
    /// A guard was as near to its boundary as the solver can tell: it turned there, or had just left it.
    Grazing {
        /// How often, when first, and which guard.
        grazing: Grazing,
        /// The settings of the run.
        solver: SolverOptions,
    },
    /// The method locates no events: they are known to a step.
    EventsNotLocated,
    /// Another method finds other events.
    OtherSequence {
        /// Its name.
        method: &'static str,
        /// Events that agree, from the first on.
        agreeing: usize,
        /// When the first event comes that is another, s.
        from: f64,
        /// How far apart the two methods have it, in s and as a share of the time since the event before, if it is of the same
        /// kind.
        apart: Option<(f64, f64)>,
    },
    /// Another method finds the same events, but farther away than the settings of the run promise.
    OtherTimes {
        /// Its name.
        method: &'static str,
        /// The first such event, s.
        time: f64,
        /// How far away, s.
        apart: f64,
    },
    /// The stick-slip is amplified rounding.
    NoiseDetermined {
        /// When sliding loses its stability, s; NaN if that is not known.
        instability: f64,
        /// e-folds from there to the first stick.
        growth_to_onset: f64,
        /// G, e-folds.
        growth_exponent: f64,
        /// Whether the case has perturbations, which then come too late or are too small.
        perturbed: bool,
    },
    /// The run ended before the times of kicks.
    KicksAfterTheEnd {
        /// How many.
        count: usize,
        /// The end of the run, s.
        end: f64,
    },
    /// Kicks wait for a loss of stability that did not come.
    KicksWithoutInstability {
        /// How many.
        count: usize,
        /// The end of the run, s.
        end: f64,
        /// Whether the run has a stick, before which it should have come.
        stuck: bool,
    },
}

/// What closes an open energy balance.
#[derive(Debug, Clone, PartialEq)]
pub enum BalanceRemedy {
    /// The force changes in `change` (s), over so small a part of the axial `period` (s) that the parts of the closed form
    /// are large and cancel, which no tolerance makes more accurate.
    SlowerForce {
        /// s.
        change: f64,
        /// s.
        period: f64,
    },
    /// The solver's settings were too loose: these.
    Tolerances(SolverOptions),
}

/// The part of the energy turned over by which a run with these settings may leave the balance open. Fixed steps and the paper's
/// procedure control no error, so that their `rtol` excuses nothing.
fn allowed_open(solver: &SolverOptions) -> f64 {
    if solver.fixed_step.is_some() || !solver.method.locates_events() {
        return OPEN_BALANCE;
    }
    (OPEN_OF_TOLERANCE * solver.rtol).clamp(OPEN_BALANCE, MOST_OPEN)
}

/// The warning of an open energy balance, both in J, of a run of any kind with these settings.
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

/// The warning of a grazing that was not decided.
pub(crate) fn grazing(grazing: Option<Grazing>, solver: &SolverOptions) -> Option<Warning> {
    grazing.map(|grazing| Warning::Grazing {
        grazing,
        solver: solver.clone(),
    })
}

/// All warnings of a run of the case that came to `summary`, but for what a witness says.
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
    // Where a run was cut short, that is why.
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

/// The relative tolerance below which a method gains nothing more: its further steps round as much as they resolve. By the
/// errors of the ladder's runs (docs/accuracy.md); single multistep methods and the pairs of low order gain down to 1e-13.
fn floor(method: Method) -> f64 {
    match method {
        Method::Series | Method::Cvode => SolverOptions::default().rtol,
        _ if method.resolving_table() == Some(Method::BEST_PAIR) => SolverOptions::default().rtol,
        _ => 1e-13,
    }
}

/// What makes a result of these settings more accurate, as a sentence.
pub fn finer(solver: &SolverOptions) -> String {
    let (method, rtol) = (solver.method.name(), solver.rtol);
    let better = solver.rtol > floor(solver.method);
    match solver.method {
        _ if solver.fixed_step.is_some() => "Use a smaller solver.fixed_step, or solver.rtol in its place".to_owned(),
        Method::Paper => "Use solver.method = \"cvode\" or \"series\", which locate events".to_owned(),
        Method::Series if better => "Use a smaller solver.rtol".to_owned(),
        Method::Series => format!(
            "With series at rtol {rtol:e} only rounding to double precision is left; what is exact is told by certify \
             --oracle"
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
                let mut ways = Vec::with_capacity(3);
                if given.iter().any(Option::is_some) {
                    ways.push("leave the solver's atol_ keys to their defaults");
                }
                if solver.fixed_step.is_some() {
                    ways.push("use a smaller solver.fixed_step");
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

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::OpenBalance {
                residual,
                turnover,
                remedy,
            } => write!(
                f,
                "the energy balance does not close: it is off by {residual:.1e} J of the {turnover:.1e} J that the run turned \
                 over, {:.1e} relative, so the energies and angles of this result, at least, are not accurate. {remedy}",
                residual / turnover
            ),
            Warning::Grazing {
                grazing: Grazing { count, time, guard },
                solver,
            } => write!(
                f,
                "at t = {time:.9} s the run comes within its own error of an event ({guard}){}: whether the contact changes \
                 there, and for how short a time, is not decided. {}",
                if *count > 1 {
                    format!(", and so {} times more", count - 1)
                } else {
                    String::new()
                },
                finer(solver)
            ),
            Warning::OtherSequence {
                method,
                agreeing,
                from,
                apart,
            } => {
                let agreeing = match agreeing {
                    0 => "no event".to_owned(),
                    1 => "one event".to_owned(),
                    events => format!("{events} events"),
                };
                let differs = match apart {
                    Some((apart, share)) => format!(
                        "the next, at t = {from:.6} s, it finds {apart:.1e} s away, {share:.1e} of the time since the event before"
                    ),
                    None => format!("from t = {from:.6} s on it finds others"),
                };
                write!(
                    f,
                    "another method, {method}, agrees with {agreeing} only: {differs}. What follows may be amplified error of the \
                     methods, and no result: stickslip certify says which events hold; a smaller solver.rtol helps where the \
                     error is the method's, and a [[perturbation]] where an instability starts from rounding"
                )
            }
            Warning::OtherTimes { method, time, apart } => write!(
                f,
                "another method, {method}, finds the same events, but the one at t = {time:.6} s {apart:.1e} s from where this run \
                 has it, which is more than the settings of the run promise. stickslip certify says how many digits hold"
            ),
            Warning::EventsNotLocated => f.write_str(
                "the events of this run are those that its steps happened to show: nothing was located, and its own noise \
                 may have started the stick-slip. It is there to be studied beside a run by another method",
            ),
            Warning::NoiseDetermined {
                instability,
                growth_to_onset: g,
                growth_exponent: all,
                perturbed,
            } => {
                let why = if *perturbed {
                    "no perturbation stands far enough above rounding when its growth begins"
                } else {
                    "no perturbation is set"
                };
                write!(
                    f,
                    "this stick-slip is amplified rounding error, not a property of the model. Sliding loses stability at \
                     t = {instability:.6} s, and until the first stick whatever deviates from smooth sliding grows by \
                     e^{g:.0} (of the growth exponent G = {all:.1} up to where smooth sliding itself would stick); {why}, \
                     so the onset, the counts and every event after it belong to this solver and this tolerance, and \
                     change with both. For a result that converges set a perturbation well above rounding, such as \
                     {KICK_OPTION}"
                )
            }
            Warning::KicksAfterTheEnd { count, end } => write!(
                f,
                "{count} of the kicks never came: the run ended at t = {end} s, before {} time; set a later \
                 output.end_time, or an earlier time of the kick",
                if *count == 1 { "its" } else { "their" },
            ),
            Warning::KicksWithoutInstability { count, end, stuck } => {
                write!(f, "{count} of the kicks set at the instability never came: ")?;
                if *stuck {
                    f.write_str("steady sliding did not lose its stability before the first stick")
                } else {
                    write!(
                        f,
                        "the run ended at t = {end} s, before sliding lost its stability or came to a stick"
                    )
                }
            }
        }
    }
}
