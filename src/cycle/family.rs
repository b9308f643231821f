//! A case with numbers that vary: the system of each of its members, in the long run, and what moves it.

use super::error::CycleError;
use super::forcing::{NotPeriodic, common_turns, in_the_long_run, period_of};
use crate::case::{Case, WrittenCase};
use crate::model::margin::twice_resistance;
use crate::model::system::System;
use crate::simulation::{MovedCases, MovedSystem};

/// The move of a number, relative to it, for derivatives: central differences err by its square.
const WIDTH: f64 = 1.0 / 131_072.0;

/// A case with numbers that vary.
#[derive(Debug, Clone)]
pub struct Family {
    written: WrittenCase,
    /// Of each number that varies the paths that take its value.
    keys: Vec<Vec<String>>,
    /// How many harmonics drive it, and turns of the first in the common period of all.
    turns: Option<(usize, u64)>,
}

/// A member of a family.
pub(crate) struct Member {
    /// In the long run.
    pub system: System,
    /// rad/s.
    pub threshold: f64,
    /// Common period of the drives, s; `None` of an autonomous system.
    pub period: Option<f64>,
    /// For derivatives, one for each number.
    pub moved: Vec<MovedCases>,
    /// d(period)/d(number).
    pub period_slopes: Vec<f64>,
}

impl Family {
    /// Of a case, and of each number that varies the paths that take its value.
    ///
    /// # Errors
    /// Where the case has no periodic motion in the long run.
    pub fn new(written: WrittenCase, keys: &[Vec<String>]) -> Result<Family, CycleError> {
        let system = in_the_long_run(&written.case().system);
        if twice_resistance(&system).is_some() {
            return Err(NotPeriodic::Stops.into());
        }
        Ok(Family {
            turns: common_turns(&system)?,
            keys: keys.to_vec(),
            written,
        })
    }

    /// Whether nothing depends on time.
    pub fn is_autonomous(&self) -> bool {
        self.turns.is_none()
    }

    /// Turns of the first harmonic in the common period of the drives.
    pub(crate) fn turns(&self) -> Option<u64> {
        self.turns.map(|(_, turns)| turns)
    }

    /// How many numbers vary.
    pub fn numbers(&self) -> usize {
        self.keys.len()
    }

    /// Every path with its value.
    pub fn changes(&self, values: &[f64]) -> Vec<(&str, f64)> {
        let pairs = self.keys.iter().zip(values);
        pairs
            .flat_map(|(paths, value)| paths.iter().map(|path| (path.as_str(), *value)))
            .collect()
    }

    /// The case as it is written.
    pub fn case(&self) -> &Case {
        self.written.case()
    }

    /// The case with other values of its numbers.
    ///
    /// # Errors
    /// If that is no valid case.
    pub fn case_at(&self, values: &[f64]) -> Result<Case, CycleError> {
        let changes = self.changes(values);
        let found = match changes.is_empty() {
            true => Ok(self.case().clone()),
            false => self.written.with_all(&changes),
        };
        found.map_err(|error| CycleError::NoCase(error.to_string()))
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

    /// The drives of a member are as many, with as many turns in their common period, as those of the case itself.
    fn check_turns(&self, system: &System, keys: &[Vec<String>]) -> Result<(), CycleError> {
        if common_turns(system).ok() == Some(self.turns) {
            return Ok(());
        }
        let number = keys.concat().join(", ");
        Err(NotPeriodic::OtherPeriod { number }.into())
    }

    /// The member with these values.
    ///
    /// # Errors
    /// If there is no valid case, or its drives have another common period.
    pub(crate) fn at(&self, values: &[f64], derivatives: bool) -> Result<Member, CycleError> {
        let none = || {
            let changes = self.changes(values);
            let numbers = changes.iter().map(|(key, value)| format!("{key} = {value:?}"));
            let numbers = numbers.collect::<Vec<_>>().join(", ");
            match self.case_at(values) {
                Err(CycleError::NoCase(why)) => CycleError::NoCase(format!("no valid case has {numbers}: {why}")),
                _ => CycleError::NoCase(format!("no valid case has {numbers}")),
            }
        };
        if values.iter().any(|value| !value.is_finite()) {
            return Err(none());
        }
        let (system, threshold) = self.system_at(values).ok_or_else(none)?;
        self.check_turns(&system, &self.keys)?;
        let period = self.period(&system);
        let (mut moved, mut period_slopes) = (Vec::new(), Vec::new());
        for number in (0..values.len()).filter(|_| derivatives) {
            let size = if values[number] == 0.0 {
                1.0
            } else {
                values[number].abs()
            };
            let h = WIDTH * size;
            let copy = |steps: f64, weight: f64| {
                let mut values = values.to_vec();
                values[number] += steps * h;
                let (system, threshold) = self.system_at(&values)?;
                Some(MovedSystem {
                    system,
                    threshold,
                    weight: weight / h,
                    bend: 1.0,
                })
            };
            let all = |copies: &[(f64, f64)]| copies.iter().map(|&(steps, weight)| copy(steps, weight)).collect();
            let central: Option<Vec<_>> = all(&[(1.0, 0.5), (-1.0, -0.5)]);
            let one_sided = |side: f64| all(&[(0.0, -1.5 * side), (side, 2.0 * side), (2.0 * side, -0.5 * side)]);
            let found = central.or_else(|| one_sided(1.0)).or_else(|| one_sided(-1.0));
            let copies: Vec<MovedSystem> = found.ok_or_else(none)?;
            for copy in &copies {
                self.check_turns(&copy.system, &self.keys[number..=number])?;
            }
            let slope = copies
                .iter()
                .filter_map(|copy| Some(copy.weight * self.period(&copy.system)?));
            period_slopes.push(slope.sum());
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
