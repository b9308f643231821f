//! A case as it is in the long run: its signals at their final values, its drives with a common period.

use crate::analysis::forcing::{self, harmonics};
use crate::model::system::{End, Pressing, System, Torque, Train};
use crate::signal::{Drive, Frequency, Wave};
use std::f64::consts::TAU;

/// Why a case has no periodic motion in the long run, or none that is looked for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotPeriodic {
    /// Nothing keeps it moving.
    #[error(
        "nothing drives this system: its only free chain slows down to a stop, and no motion repeats. A cycle needs a driven end, a \
         torque, or a harmonic signal"
    )]
    Stops,
    /// Two harmonics without a common period.
    #[error(
        "the harmonics that drive it have no common period, so that no motion repeats; take frequencies whose ratio is that of whole \
         numbers of at most 1000"
    )]
    NoCommonPeriod,
    /// A number changes the ratio of the drives' periods.
    #[error(
        "the harmonics that drive it have another common period, or none, as soon as {number} moves: it is the frequency of one of \
         several, or an amplitude that is zero. Vary another number, or start where no amplitude is zero"
    )]
    OtherPeriod {
        /// The paths of the number.
        number: String,
    },
}

fn settled<T: Clone>(drive: &Drive<T>) -> Drive<T> {
    match drive {
        Drive::Value(value) => Drive::Value(value.clone()),
        Drive::Linear(signal) => signal.final_value().map_or_else(|| drive.clone(), Drive::Value),
        // A harmonic that ends leaves its mean.
        Drive::Wave(wave) if wave.to.is_some() => Drive::Value(wave.mean.clone()),
        Drive::Wave(wave) => Drive::Wave(Wave {
            from: None,
            ..wave.clone()
        }),
        Drive::Sum(terms) => Drive::Sum(terms.iter().map(settled).collect()),
    }
}

fn settled_train<T: Clone>(train: &Train<T>) -> Train<T> {
    Train {
        end: match &train.end {
            End::Driven(speed) => End::Driven(settled(speed)),
            other => other.clone(),
        },
        torque: train.torque.as_ref().map(|torque| Torque {
            signal: settled(&torque.signal),
            on: torque.on,
        }),
        ..train.clone()
    }
}

/// The system in the long run: signals have come to what they hold in the end, kicks are over, the axial motion has died out.
pub(crate) fn in_the_long_run<T: Clone, L: Clone>(system: &System<T, L>) -> System<T, L> {
    let pressing = match &system.pressing {
        Pressing::Force(force) => Pressing::Force(settled(force)),
        Pressing::Axial { actuation, .. } => match actuation.final_value() {
            Some(force) => Pressing::Force(Drive::Value(force)),
            None => system.pressing.clone(),
        },
    };
    System {
        rotor: settled_train(&system.rotor),
        stator: settled_train(&system.stator),
        pressing,
        kicks: Vec::new(),
        ..system.clone()
    }
}

/// How many harmonics drive a system in the long run, and how often the first of them turns in the common period of all; `None` of one
/// that nothing harmonic drives.
///
/// # Errors
/// Where there is no common period.
pub(crate) fn common_turns(system: &System) -> Result<Option<(usize, u64)>, NotPeriodic> {
    let all = harmonics(system);
    if all.is_empty() {
        return Ok(None);
    }
    let turns = forcing::common_turns(&all).ok_or(NotPeriodic::NoCommonPeriod)?;
    Ok(Some((all.len(), turns)))
}

/// The time of so many turns of the first harmonic that drives a system, s.
pub(crate) fn period_of(system: &System, turns: u64) -> Option<f64> {
    let turn = match first_wave(system)?.frequency {
        // Without the rounding of 2 pi.
        Frequency::Cycles(frequency) => 1.0 / frequency.abs(),
        Frequency::Angular(omega) => TAU / omega.abs(),
    };
    Some(turns as f64 * turn)
}

fn first_wave(system: &System) -> Option<&Wave> {
    fn of(drive: &Drive) -> Option<&Wave> {
        match drive {
            Drive::Wave(wave) if wave.amplitude != 0.0 => Some(wave),
            Drive::Sum(terms) => terms.iter().find_map(of),
            _ => None,
        }
    }
    system.drives().into_iter().find_map(of)
}
