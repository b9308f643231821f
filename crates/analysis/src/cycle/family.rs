//! A case with varied parameters: the long-run system and the derivatives of each member.

use crate::analysis::forcing::{self, harmonics};
use crate::analysis::linearised::copies;
use crate::error::Error;
use num_traits::Zero;
use std::f64::consts::TAU;
use stickslip_case::{Case, WrittenCase};
use stickslip_engine::simulation::MovedCases;
use stickslip_system::model::margin::twice_resistance;
use stickslip_system::model::system::{End, Pressing, System};
use stickslip_system::signal::{Drive, Frequency, Wave};

/// Relative change of a parameter in central differences over one and two changes. They are of fourth order, because
/// a frequency turns a phase of many radians.
const WIDTH: f64 = 1.0 / 262_144.0;
const CENTRAL: [(f64, f64); 4] = [
    (1.0, 2.0 / 3.0),
    (-1.0, -2.0 / 3.0),
    (2.0, -1.0 / 12.0),
    (-2.0, 1.0 / 12.0),
];

/// Case with varied parameters.
#[derive(Debug, Clone)]
pub struct Family {
    written: WrittenCase,
    /// Key paths that take the value of each varied parameter.
    keys: Vec<Vec<String>>,
    /// Number of harmonics, and turns of the first harmonic in their common period.
    turns: Option<(usize, u64)>,
}

pub(crate) struct Member {
    pub system: System,
    pub threshold: f64,
    /// Common period of the drives, s; `None` for an autonomous system.
    pub period: Option<f64>,
    pub moved: Vec<MovedCases>,
    /// d(period)/d(parameter).
    pub period_slopes: Vec<f64>,
}

impl Family {
    /// Family of a case, with the key paths of each varied parameter.
    ///
    /// # Errors
    /// The system slows down to a stop, a chirp drives it, or its harmonics have no common period.
    pub fn new(written: WrittenCase, keys: &[Vec<String>]) -> Result<Family, Error> {
        let system = in_the_long_run(&written.case().system);
        if twice_resistance(&system).is_some() {
            return Err(Error::input(
                "nothing drives this system: its only free chain slows down to a stop, and no motion repeats. A cycle needs a driven \
                 end, a torque, or a harmonic signal",
            ));
        }
        Ok(Family {
            turns: common_turns(&system)?,
            keys: keys.to_vec(),
            written,
        })
    }

    /// Whether the system is independent of time.
    pub fn is_autonomous(&self) -> bool {
        self.turns.is_none()
    }

    pub(crate) fn turns(&self) -> Option<u64> {
        self.turns.map(|(_, turns)| turns)
    }

    /// Number of varied parameters.
    pub fn numbers(&self) -> usize {
        self.keys.len()
    }

    /// All key paths, each with its value.
    pub fn changes(&self, values: &[f64]) -> Vec<(&str, f64)> {
        let pairs = self.keys.iter().zip(values);
        pairs
            .flat_map(|(paths, value)| paths.iter().map(|path| (path.as_str(), *value)))
            .collect()
    }

    /// The case as written.
    pub fn case(&self) -> &Case {
        self.written.case()
    }

    /// Case with other values of its parameters.
    ///
    /// # Errors
    /// The values are invalid.
    pub fn case_at(&self, values: &[f64]) -> Result<Case, Error> {
        let changes = self.changes(values);
        match changes.is_empty() {
            true => Ok(self.case().clone()),
            false => Ok(self.written.with_all(&changes)?),
        }
    }

    fn system_at(&self, values: &[f64]) -> Option<(System, f64)> {
        let case = self.case();
        let found = match values.is_empty() {
            true => Some((case.system.clone(), case.threshold)),
            false => self.written.moved_all(&self.changes(values)),
        };
        found.map(|(system, threshold)| (in_the_long_run(&system), threshold))
    }

    fn period(&self, system: &System) -> Option<f64> {
        period_of(system, self.turns()?)
    }

    fn check_turns(&self, system: &System, keys: &[Vec<String>]) -> Result<(), Error> {
        if common_turns(system).ok() == Some(self.turns) {
            return Ok(());
        }
        let number = keys.concat().join(", ");
        Err(Error::input(format!(
            "the harmonics that drive it have another common period, or none, as soon as {number} moves: it is the frequency of one \
             of several, or an amplitude that is zero. Vary another parameter, or start where no amplitude is zero"
        )))
    }

    /// Fails if the values are invalid or change the common period of the drives.
    pub(crate) fn at(&self, values: &[f64], derivatives: bool) -> Result<Member, Error> {
        let none = || {
            let changes = self.changes(values);
            let numbers = changes.iter().map(|(key, value)| format!("{key} = {value:?}"));
            let numbers = numbers.collect::<Vec<_>>().join(", ");
            let why = self.case_at(values).err().map(|why| format!(": {why}"));
            Error::input(format!("no valid case has {numbers}{}", why.unwrap_or_default()))
        };
        if values.iter().any(|value| !value.is_finite()) {
            return Err(none());
        }
        let (system, threshold) = self.system_at(values).ok_or_else(none)?;
        self.check_turns(&system, &self.keys)?;
        let period = self.period(&system);
        let (mut moved, mut period_slopes) = (Vec::new(), Vec::new());
        for number in (0..values.len()).filter(|_| derivatives) {
            let size = values[number].abs();
            let h = WIDTH * if size == 0.0 { 1.0 } else { size };
            let at = |steps: f64| {
                let mut values = values.to_vec();
                values[number] += steps * h;
                self.system_at(&values)
            };
            let copies = copies(h, &CENTRAL, 1.0, at).ok_or_else(none)?;
            for copy in &copies {
                self.check_turns(&copy.system, &self.keys[number..=number])?;
            }
            let slopes = copies.iter();
            let slopes = slopes.filter_map(|copy| Some(copy.weight * self.period(&copy.system)?));
            period_slopes.push(slopes.sum());
            moved.push(MovedCases { copies, rounded: None });
        }
        Ok(Member {
            system,
            threshold,
            period,
            moved,
            period_slopes,
        })
    }
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

/// Gives every signal that drives the chains or presses the surfaces directly its new form.
pub(super) fn map_drives<T, L>(system: &mut System<T, L>, map: impl Fn(&Drive<T>) -> Drive<T>) {
    for train in [&mut system.rotor, &mut system.stator] {
        if let End::Driven(speed) = &mut train.end {
            *speed = map(speed);
        }
        if let Some(torque) = &mut train.torque {
            torque.signal = map(&torque.signal);
        }
    }
    if let Pressing::Force(force) = &mut system.pressing {
        *force = map(force);
    }
}

/// System in the long run: final signals, no kicks, no axial motion.
pub(crate) fn in_the_long_run<T: Clone, L: Clone>(system: &System<T, L>) -> System<T, L> {
    let mut system = system.clone();
    map_drives(&mut system, settled);
    system.kicks.clear();
    if let Pressing::Axial { actuation, .. } = &system.pressing
        && let Some(force) = actuation.final_value()
    {
        system.pressing = Pressing::Force(Drive::Value(force));
    }
    system
}

/// Number of harmonics in the long run, and turns of the first one in their common period; `None` without harmonics.
fn common_turns(system: &System) -> Result<Option<(usize, u64)>, Error> {
    let mut waves = system.drives().into_iter().flat_map(Drive::waves);
    if waves.any(|wave| matches!(wave.frequency, Frequency::Sweep { .. }) && wave.amplitude != 0.0) {
        return Err(Error::input(
            "a chirp drives it: its frequency changes, so that no motion repeats; take a sine with the chirp's end_frequency",
        ));
    }
    let all = harmonics(system);
    if all.is_empty() {
        return Ok(None);
    }
    let turns = forcing::common_turns(&all).ok_or_else(|| {
        Error::input(
            "the harmonics that drive it have no common period, so that no motion repeats; take frequencies whose ratio is that of \
             whole numbers of at most 1000",
        )
    })?;
    Ok(Some((all.len(), turns)))
}

/// Duration of `turns` turns of the first harmonic, s.
fn period_of(system: &System, turns: u64) -> Option<f64> {
    let turn = match first_wave(system)?.frequency {
        // Avoids the rounding of 2 pi.
        Frequency::Cycles(frequency) | Frequency::Sweep { end: frequency, .. } => 1.0 / frequency.abs(),
        Frequency::Angular(omega) => TAU / omega.abs(),
    };
    Some(turns as f64 * turn)
}

pub(super) fn first_wave<T: Zero, L>(system: &System<T, L>) -> Option<&Wave<T>> {
    let mut waves = system.drives().into_iter().flat_map(Drive::waves);
    waves.find(|wave| !wave.amplitude.is_zero())
}
