//! Equations of a periodic motion: the state repeats after a period.

use super::error::CycleError;
use super::family::{Family, Member};
use super::newton::NewtonEquations;
use nalgebra::{DMatrix, DVector};
use stickslip_engine::simulation::{Shot, WantedResults, shoot};

/// Least scale of a component, as a speed, relative to the largest speed of the motion.
const LEAST_SHARE: f64 = 0.05;

/// Scale of each state component: its own size, at least a fraction of the largest one. Sizes are compared as speeds.
pub(crate) fn scales(sizes: &[f64], weights: &[f64]) -> Vec<f64> {
    let pairs = || sizes.iter().zip(weights);
    let largest = pairs().map(|(size, weight)| size * weight).fold(0.0, f64::max);
    let scale = |(size, weight): (&f64, &f64)| match size.max(LEAST_SHARE * largest / weight) {
        scale if scale > 0.0 => scale,
        _ => 1.0,
    };
    pairs().map(scale).collect()
}

#[derive(Debug, Clone)]
pub(crate) struct Guess {
    /// Phase of the drives at the start, s.
    pub time: f64,
    pub state: DVector<f64>,
    pub period: f64,
    pub values: Vec<f64>,
}

/// Shooting over a period in scaled unknowns: state, period of an autonomous system, varied parameters. The plane
/// through the guess across the flow fixes the phase of an autonomous motion.
pub(crate) struct Shooting<'a> {
    pub family: &'a Family,
    time: f64,
    pub multiple: u32,
    anchor: DVector<f64>,
    /// Direction of the flow in scaled components.
    flow: DVector<f64>,
    pub scale: DVector<f64>,
    pub stop: &'a dyn Fn() -> bool,
    pub last: Option<Shot>,
}

impl<'a> Shooting<'a> {
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

    /// Cosine between the flow at the last start and the flow of the guess, whose plane fixes the phase of an
    /// autonomous motion; 1 for a driven motion.
    pub fn phase_cosine(&self) -> f64 {
        match &self.last {
            Some(shot) if self.family.is_autonomous() => {
                let flow = DVector::from_fn(self.moving(), |k, _| shot.start_rates[k] / self.scale[k]);
                flow.dot(&self.flow) / flow.norm()
            }
            _ => 1.0,
        }
    }

    fn moving(&self) -> usize {
        self.anchor.len()
    }

    pub fn unknowns(&self, guess: &Guess) -> DVector<f64> {
        let period = self.family.is_autonomous().then_some(&guess.period);
        let all: Vec<f64> = guess.state.iter().chain(period).chain(&guess.values).copied().collect();
        DVector::from_vec(all).component_div(&self.scale)
    }

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

    /// Plane of constant parameters.
    pub fn held(&self) -> DMatrix<f64> {
        let (varying, all) = (self.family.numbers(), self.scale.len());
        DMatrix::from_fn(varying, all, |i, j| f64::from(j == all - varying + i))
    }
}

impl NewtonEquations for Shooting<'_> {
    fn evaluate(&mut self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>), CycleError> {
        let guess = self.guess(x)?;
        let n = self.moving();
        let autonomous = self.family.is_autonomous();
        let member: Member = self.family.at(&guess.values, true)?;
        if guess.period.is_nan() || guess.period <= 0.0 {
            return Err(CycleError::Collapsed { period: guess.period });
        }
        let wanted = WantedResults {
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
                // A change of the drives' period moves the end.
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
