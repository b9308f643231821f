//! A case as it is in the long run: its signals at their final values, its drives with a common period.

use crate::model::system::{End, Pressing, System, Torque, Train};
use crate::signal::{Drive, Frequency, Signal, Wave};
use std::f64::consts::TAU;

/// Turns of a harmonic in a common period, at most.
const MOST_TURNS: u32 = 64;

/// Frequencies have a ratio of whole numbers if they have it to this share: the rounding of a few digits.
const SAME_RATIO: f64 = 1e-12;

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
        "the harmonics that drive it have no common period of at most {MOST_TURNS} turns, so that no motion repeats; take \
         frequencies whose ratio is that of small whole numbers"
    )]
    NoCommonPeriod,
}

fn last<T: Clone>(signal: &Signal<T>) -> Option<T> {
    match signal {
        Signal::Ramp(ramp) => Some(ramp.value.clone()),
        Signal::Table(table) => table.value.last().cloned(),
    }
}

fn settled<T: Clone>(drive: &Drive<T>) -> Drive<T> {
    match drive {
        Drive::Value(value) => Drive::Value(value.clone()),
        Drive::Linear(signal) => last(signal).map_or_else(|| drive.clone(), Drive::Value),
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
        Pressing::Axial { actuation, .. } => match last(actuation) {
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

fn harmonics<'d>(drive: &'d Drive, found: &mut Vec<&'d Wave>) {
    match drive {
        Drive::Wave(wave) if wave.amplitude != 0.0 => found.push(wave),
        Drive::Sum(terms) => terms.iter().for_each(|term| harmonics(term, found)),
        Drive::Wave(_) | Drive::Value(_) | Drive::Linear(_) => {}
    }
}

/// How often the first harmonic turns in the common period of all; `None` of a system in the long run that nothing harmonic drives.
///
/// # Errors
/// Where there is no common period.
pub(crate) fn common_turns(system: &System) -> Result<Option<u32>, NotPeriodic> {
    let mut waves = Vec::new();
    system
        .drives()
        .into_iter()
        .for_each(|drive| harmonics(drive, &mut waves));
    let Some(first) = waves.first().map(|wave| wave.angular_frequency().abs()) else {
        return Ok(None);
    };
    let whole = |turns: u32| {
        waves.iter().all(|wave| {
            let others = f64::from(turns) * wave.angular_frequency().abs() / first;
            others.round() >= 1.0 && (others - others.round()).abs() <= SAME_RATIO * others
        })
    };
    match (1..=MOST_TURNS).find(|turns| whole(*turns)) {
        Some(turns) => Ok(Some(turns)),
        None => Err(NotPeriodic::NoCommonPeriod),
    }
}

/// The frequency of the first harmonic that drives a system in the long run.
pub(crate) fn first_frequency(system: &System) -> Option<Frequency> {
    let mut waves = Vec::new();
    system
        .drives()
        .into_iter()
        .for_each(|drive| harmonics(drive, &mut waves));
    waves.first().map(|wave| wave.frequency)
}

/// The time of so many turns of the first harmonic that drives a system, s.
pub(crate) fn period_of(system: &System, turns: u32) -> Option<f64> {
    let turn = match first_frequency(system)? {
        Frequency::Cycles(frequency) => 1.0 / frequency.abs(),
        Frequency::Angular(omega) => TAU / omega.abs(),
    };
    Some(f64::from(turns) * turn)
}
