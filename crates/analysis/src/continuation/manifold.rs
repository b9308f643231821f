//! Measurements at a point of a branch.

use crate::cycle::{
    CycleStability, Guess, Manifold, MultiplierKind, NEUTRAL, Orbit, What, apart, later, motion, scales, to_slip,
};
use crate::error::Error;
use nalgebra::{Complex, DVector};
use stickslip_engine::simulation::{WantedResults, shoot, sliding, weights};
use stickslip_system::numerics::eigenvalues::eigenvalues;

/// Fraction of the fastest eigenvalue beyond which a real part changes the stability of steady sliding.
const ROUNDING: f64 = 1e-11;

/// If a start is nearer to an event than this fraction of the longest slip, it moves to the middle of that slip.
const CLEARANCE: f64 = 0.2;

#[derive(Debug, Clone)]
pub(crate) struct Measured {
    pub guess: Guess,
    /// Period and parameters of the measurement; at a border, those of the neighbouring point.
    pub at: (f64, Vec<f64>),
    /// Multipliers of a cycle except the one along it, or eigenvalues (1/s); the most unstable first.
    pub spectrum: Vec<Complex<f64>>,
    pub unstable: usize,
    /// Steady sliding has no events, and its Jacobian for d(end)/d(start).
    pub orbit: Orbit,
}

impl Measured {
    /// Largest minus least relative velocity.
    pub fn swing(&self) -> f64 {
        self.orbit.relative_velocity.1 - self.orbit.relative_velocity.0
    }
}

impl Manifold<'_> {
    pub fn measure(&self, guess: &Guess) -> Result<Measured, Error> {
        let (spectrum, unstable, orbit): (Vec<Complex<f64>>, usize, Orbit);
        match self.what {
            What::Cycles(_) => {
                orbit = Orbit::describe(self.family, guess, (0.0, 0), self.stop)?;
                let others = orbit.multipliers.iter().filter(|one| one.kind != MultiplierKind::Along);
                spectrum = others.map(|one| Complex::new(one.real, one.imaginary)).collect();
                unstable = spectrum.iter().filter(|one| one.norm() > 1.0 + NEUTRAL).count();
            }
            What::Steady(sense) => {
                let member = self.family.at(&guess.values, false)?;
                let here = sliding((&member.system, member.threshold), sense, &guess.state);
                let mut sorted = eigenvalues(&here.jacobian);
                sorted.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
                let fastest = sorted.iter().map(|one| one.norm()).fold(0.0, f64::max);
                let neutral = sorted.first().is_some_and(|one| one.re >= -ROUNDING * fastest);
                unstable = sorted.iter().filter(|one| one.re > ROUNDING * fastest).count();
                spectrum = sorted;
                orbit = Orbit {
                    stability: match (unstable, neutral) {
                        (1.., _) => CycleStability::Unstable,
                        (0, true) => CycleStability::Neutral,
                        (0, false) => CycleStability::Stable,
                    },
                    position: (here.position, here.position),
                    relative_velocity: (here.relative_velocity, here.relative_velocity),
                    clearance: f64::INFINITY,
                    by_state: here.jacobian,
                    ..Orbit::default()
                };
            }
        }
        Ok(Measured {
            guess: guess.clone(),
            at: (guess.period, guess.values.clone()),
            spectrum,
            unstable,
            orbit,
        })
    }

    /// Distance of a cycle from itself after half of an even number of periods, relative to its size; otherwise 0.
    pub fn half_way(&self, measured: &Measured) -> f64 {
        let What::Cycles(multiple) = self.what else { return 0.0 };
        if !multiple.is_multiple_of(2) {
            return 0.0;
        }
        let guess = &measured.guess;
        let Ok(member) = self.family.at(&guess.values, false) else {
            return 0.0;
        };
        let from = (guess.time, &guess.state);
        motion(&member, from, guess.period / 2.0, false, self.stop).map_or(0.0, |half| {
            apart(&half.end, &guess.state, &scales(&half.sizes, &weights(&member.system)))
        })
    }

    /// If the start of a cycle is near an event, returns the cycle from the middle of its longest slip, with the
    /// direction of its branch there; otherwise `None`.
    pub fn away_from_events(
        &self,
        measured: &Measured,
        direction: &DVector<f64>,
    ) -> Result<Option<(Measured, DVector<f64>)>, Error> {
        if !matches!(self.what, What::Cycles(_)) || measured.orbit.clearance >= CLEARANCE {
            return Ok(None);
        }
        let guess = &measured.guess;
        let member = self.family.at(&guess.values, true)?;
        let shift = to_slip(&member, guess, self.stop)?;
        let wanted = WantedResults {
            derivatives: Some(&member.moved),
            extrema: false,
            stop: self.stop,
        };
        let system = (&member.system, member.threshold);
        let shot = shoot(system, (guess.time, &guess.state), shift, wanted)?;
        let n = guess.state.len();
        let numbers = direction.len() - guess.values.len();
        let by_number = direction.rows(numbers, guess.values.len());
        let mut state = &shot.by_state * direction.rows(0, n) + &shot.by_number * by_number;
        let measured = self.measure(&Guess {
            time: later(&member, guess, shift),
            state: shot.end,
            ..guess.clone()
        })?;
        match member.period {
            // The new start counts from a later period of the drives, whose start moves with their period.
            Some(period) => {
                let turns = ((guess.time + shift) / period).floor();
                for (slope, change) in member.period_slopes.iter().zip(by_number.iter()) {
                    state.axpy(turns * slope * change, &shot.end_rates, 1.0);
                }
            }
            // The phase of an autonomous motion is fixed.
            None => {
                let local = self.local(&measured.guess)?;
                let scale = local.scale().rows(0, n);
                let flow = shot.end_rates.component_div(&scale);
                let along = flow.dot(&state.component_div(&scale)) / flow.norm_squared();
                state.axpy(-along, &shot.end_rates, 1.0);
            }
        }
        let mut carried = direction.clone();
        carried.rows_mut(0, n).copy_from(&state);
        Ok(Some((measured, carried)))
    }
}
