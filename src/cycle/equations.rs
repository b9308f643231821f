//! The equations of a periodic motion: after a period the motion is where it was.

use super::error::CycleError;
use super::family::{Family, Member};
use super::newton::Equations;
use crate::simulation::{Shot, Wanted, shoot};
use nalgebra::{DMatrix, DVector};

/// Of the largest speed of a motion, the least that a component counts with, as a speed.
const LEAST_SHARE: f64 = 0.05;

/// What a component of the state is measured with: its own size, but not less than a share of the largest when all are speeds.
pub(crate) fn scales(sizes: &[f64], weights: &[f64]) -> Vec<f64> {
    let pairs = || sizes.iter().zip(weights);
    let largest = pairs().map(|(size, weight)| size * weight).fold(0.0, f64::max);
    let scale = |(size, weight): (&f64, &f64)| match size.max(LEAST_SHARE * largest / weight) {
        scale if scale > 0.0 => scale,
        _ => 1.0,
    };
    pairs().map(scale).collect()
}

/// A periodic motion, from a point of it.
#[derive(Debug, Clone)]
pub(crate) struct Guess {
    /// When it starts, s: the phase of the drives.
    pub time: f64,
    /// What the motion depends on.
    pub state: DVector<f64>,
    /// s.
    pub period: f64,
    /// Of the numbers that vary.
    pub values: Vec<f64>,
}

/// Shooting over a period. Unknowns are the state, the period of an autonomous system, and the numbers that vary, each over its scale.
/// The phase of an autonomous motion is that of the plane through the guess across its flow.
pub(crate) struct Shooting<'a> {
    pub family: &'a Family,
    /// s.
    time: f64,
    /// Periods of the drives in one of the motion.
    pub multiple: u32,
    anchor: DVector<f64>,
    /// Across the flow, in scaled components.
    flow: DVector<f64>,
    /// Of the unknowns.
    pub scale: DVector<f64>,
    pub stop: &'a dyn Fn() -> bool,
    /// The motion of the last evaluation.
    pub last: Option<Shot>,
}

impl<'a> Shooting<'a> {
    /// About a guess, with the sizes of the components of its state.
    pub fn new(
        family: &'a Family,
        multiple: u32,
        guess: &Guess,
        (sizes, rates): (&[f64], &DVector<f64>),
        scales: &[f64],
        stop: &'a dyn Fn() -> bool,
    ) -> Shooting<'a> {
        let mut scale = sizes.to_vec();
        let flow = DVector::from_fn(scale.len(), |k, _| rates[k] / scale[k]);
        if family.is_autonomous() {
            scale.push(guess.period);
        }
        scale.extend(scales);
        Shooting {
            family,
            time: guess.time,
            multiple,
            anchor: guess.state.clone(),
            flow: flow.normalize(),
            scale: DVector::from_vec(scale),
            stop,
            last: None,
        }
    }

    fn moving(&self) -> usize {
        self.anchor.len()
    }

    /// The scaled unknowns of a guess.
    pub fn unknowns(&self, guess: &Guess) -> DVector<f64> {
        let period = self.family.is_autonomous().then_some(&guess.period);
        let all: Vec<f64> = guess.state.iter().chain(period).chain(&guess.values).copied().collect();
        DVector::from_vec(all).component_div(&self.scale)
    }

    /// The motion of scaled unknowns.
    pub fn guess(&self, x: &DVector<f64>) -> Result<Guess, CycleError> {
        let u = x.component_mul(&self.scale);
        let n = self.moving();
        let autonomous = self.family.is_autonomous();
        let values = u.as_slice()[n + usize::from(autonomous)..].to_vec();
        let period = match autonomous {
            true => u[n],
            false => f64::from(self.multiple) * self.family.at(&values, false)?.period.unwrap_or(f64::NAN),
        };
        Ok(Guess {
            time: self.time,
            state: u.rows(0, n).into_owned(),
            period,
            values,
        })
    }

    /// The plane on which the numbers that vary are held.
    pub fn held(&self) -> DMatrix<f64> {
        let (varying, all) = (self.family.numbers(), self.scale.len());
        DMatrix::from_fn(varying, all, |i, j| f64::from(j == all - varying + i))
    }
}

impl Equations for Shooting<'_> {
    fn evaluate(&mut self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>), CycleError> {
        let guess = self.guess(x)?;
        let n = self.moving();
        let autonomous = self.family.is_autonomous();
        let member: Member = self.family.at(&guess.values, true)?;
        if guess.period.is_nan() || guess.period <= 0.0 {
            return Err(CycleError::Collapsed { period: guess.period });
        }
        let wanted = Wanted {
            derivatives: Some(&member.moved),
            extrema: false,
            stop: self.stop,
        };
        let shot = shoot(
            (&member.system, member.threshold),
            (guess.time, &guess.state),
            guess.period,
            wanted,
        )?;
        let rows = n + usize::from(autonomous);
        let mut residual = DVector::zeros(rows);
        let mut jacobian = DMatrix::zeros(rows, x.len());
        for i in 0..n {
            let size = self.scale[i];
            residual[i] = (shot.end[i] - guess.state[i]) / size;
            for j in 0..n {
                jacobian[(i, j)] = (shot.by_state[(i, j)] - f64::from(i == j)) * self.scale[j] / size;
            }
            if autonomous {
                jacobian[(i, n)] = shot.end_rates[i] * self.scale[n] / size;
            }
            for (number, slope) in member.period_slopes.iter().enumerate() {
                // What the drives have as their period moves the end.
                let by_end = match autonomous {
                    true => 0.0,
                    false => shot.end_rates[i] * f64::from(self.multiple) * slope,
                };
                let column = rows + number;
                jacobian[(i, column)] = (shot.by_number[(i, number)] + by_end) * self.scale[column] / size;
            }
        }
        if autonomous {
            for j in 0..n {
                residual[n] += self.flow[j] * (guess.state[j] - self.anchor[j]) / self.scale[j];
                jacobian[(n, j)] = self.flow[j];
            }
        }
        self.last = Some(shot);
        Ok((residual, jacobian))
    }
}
