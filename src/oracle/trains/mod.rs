//! The independent solution of two trains at one contact ([`crate::model::trains`]).
//!
//! | file | what it is |
//! |---|---|
//! | `automaton` | modes, events, kicks and corners |
//! | `contact` | the torque of the contact: friction laws, regularised ones, bristles |
//! | `courses` | signals between their corners |
//! | `report` | the state as a run gives it |
//! | `series` | the equations of two chains as recurrences of Taylor coefficients |

mod automaton;
mod contact;
mod courses;
mod report;
mod series;

pub use report::TrainOracleState;

use super::report::OracleReport;
use super::solve::{OracleProgress, OracleRequest, OracleSolution, settle};
use super::{OracleError, OracleOptions};
use crate::model::trains::{ContactLaw, Trains};
use crate::model::{ExactLaw, nearest_double};
use automaton::run_with;
use num_rational::BigRational;
use std::ops::ControlFlow;

/// Two trains without rounding.
pub type ExactTrains = Trains<BigRational, ExactLaw>;

/// What a run of two trains found.
pub type TrainOracleReport = OracleReport<TrainOracleState>;

/// The events of two trains, and how well they are known.
pub type TrainOracleSolution = OracleSolution<TrainOracleState>;

/// The speed below which a regularised contact counts as stuck, 10 eps; `None` for other contacts.
pub fn threshold(parameters: &ExactTrains) -> Option<BigRational> {
    match &parameters.contact {
        ContactLaw::Regularised(regularisation) => Some(&regularisation.speed * BigRational::from_integer(10.into())),
        ContactLaw::StickSlip | ContactLaw::Bristles(_) => None,
    }
}

/// Solves two trains from t = 0 to the end time of `options`. `control` is asked at every few steps, with the time (s); `Break`
/// ends the run with an error.
///
/// An engaged contact has an event "stick" where |omega_r| falls through `threshold` (rad/s), and "slip" where it rises
/// through it; without a threshold it has none. Contacts that stick and slip make no use of it.
///
/// # Errors
/// A precision that it does not have, an exhausted event budget, a degenerate motion, two surfaces without inertia.
pub fn run(
    parameters: &ExactTrains,
    options: &OracleOptions,
    threshold: Option<&BigRational>,
    control: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<TrainOracleReport, OracleError> {
    let asked = || OracleError::Digits { asked: options.digits };
    match super::words(options.digits).ok_or_else(asked)? {
        1 => run_with::<1>(parameters, options, threshold, control),
        2 => run_with::<2>(parameters, options, threshold, control),
        3 => run_with::<3>(parameters, options, threshold, control),
        4 => run_with::<4>(parameters, options, threshold, control),
        6 => run_with::<6>(parameters, options, threshold, control),
        10 => run_with::<10>(parameters, options, threshold, control),
        16 => run_with::<16>(parameters, options, threshold, control),
        32 => run_with::<32>(parameters, options, threshold, control),
        _ => Err(asked()),
    }
}

/// Solves two trains with so many digits that those asked for are true of every event time, as [`super::solve`] does the brake.
///
/// # Errors
/// Those of [`run`]; that a run takes too long, or that no precision settles the events.
pub fn solve(
    parameters: &ExactTrains,
    request: &OracleRequest,
    threshold: Option<&BigRational>,
    control: &mut dyn FnMut(OracleProgress) -> ControlFlow<()>,
) -> Result<TrainOracleSolution, OracleError> {
    let period = shortest_period(parameters).min(nearest_double(&request.end_time));
    settle(request, period, control, &mut |options, control| {
        run(parameters, options, threshold, control)
    })
}

/// The shortest period of an inertia on its shaft, or of a signal, s; infinite without either.
fn shortest_period(parameters: &ExactTrains) -> f64 {
    let of_shafts = [&parameters.rotor, &parameters.stator].into_iter().flat_map(|train| {
        let pairs = train.stiffness.iter().zip(&train.inertia);
        pairs.map(|(stiffness, inertia)| {
            let squared = nearest_double(inertia) / nearest_double(stiffness);
            std::f64::consts::TAU * squared.sqrt()
        })
    });
    let drives = parameters.drives();
    let of_signals = drives.iter().map(|drive| courses::shortest_period(drive));
    of_shafts
        .chain(of_signals)
        .filter(|period| *period > 0.0)
        .fold(f64::INFINITY, f64::min)
}
