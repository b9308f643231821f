//! Case in the long run: final values of signals, and drives with a common period.

use crate::analysis::forcing::{self, harmonics};
use std::f64::consts::TAU;
use stickslip_system::model::system::{End, Pressing, System, Torque, Train};
use stickslip_system::signal::{Drive, Frequency, Wave};

/// Reason why a case has no periodic motion.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotPeriodic {
    /// Nothing drives the system.
    #[error(
        "nothing drives this system: its only free chain slows down to a stop, and no motion repeats. A cycle needs a driven end, a \
         torque, or a harmonic signal"
    )]
    Stops,
    /// Two harmonics have no common period.
    #[error(
        "the harmonics that drive it have no common period, so that no motion repeats; take frequencies whose ratio is that of whole \
         numbers of at most 1000"
    )]
    NoCommonPeriod,
    /// A parameter changes the ratio of the drives' periods.
    #[error(
        "the harmonics that drive it have another common period, or none, as soon as {number} moves: it is the frequency of one of \
         several, or an amplitude that is zero. Vary another parameter, or start where no amplitude is zero"
    )]
    OtherPeriod {
        /// Key paths of the parameter.
        number: String,
    },
}

fn settled<T: Clone>(drive: &Drive<T>) -> Drive<T> {
    match drive {
        Drive::Value(value) => Drive::Value(value.clone()),
        Drive::Linear(signal) => signal.final_value().map_or_else(|| drive.clone(), Drive::Value),
        // A harmonic that ends leaves its mean value.
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

/// System in the long run: final signals, no kicks, no axial motion.
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

/// Number of harmonics in the long run, and turns of the first one in their common period; `None` without harmonics.
pub(crate) fn common_turns(system: &System) -> Result<Option<(usize, u64)>, NotPeriodic> {
    let all = harmonics(system);
    if all.is_empty() {
        return Ok(None);
    }
    let turns = forcing::common_turns(&all).ok_or(NotPeriodic::NoCommonPeriod)?;
    Ok(Some((all.len(), turns)))
}

/// Duration of `turns` turns of the first harmonic, s.
pub(crate) fn period_of(system: &System, turns: u64) -> Option<f64> {
    let turn = match first_wave(system)?.frequency {
        // Avoids the rounding of 2 pi.
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
