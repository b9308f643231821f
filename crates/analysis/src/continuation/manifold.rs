//! Equations of steady sliding or cycles about a point, and measurements there.

use crate::cycle::{
    Border, CycleError, CycleStability, Family, Guess, NewtonEquations, Orbit, Shooting, apart, later, motion, scales,
    to_slip,
};
use nalgebra::{Complex, DMatrix, DVector};
use stickslip_engine::simulation::{Shot, WantedResults, shoot, sliding, weights};
use stickslip_system::numerics::eigenvalues::eigenvalues;

/// Fraction of the fastest eigenvalue beyond which a real part changes the stability of steady sliding.
const ROUNDING: f64 = 1e-11;

/// If a start is nearer to an event than this fraction of the longest slip, it moves to the middle of that slip.
const CLEARANCE: f64 = 0.2;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum What {
    /// Steady sliding with this sense.
    Steady(i8),
    /// Cycles over this many periods of the drives.
    Cycles(u32),
}

#[derive(Clone, Copy)]
pub(crate) struct Manifold<'a> {
    pub family: &'a Family,
    pub what: What,
    pub widths: &'a [f64],
    pub stop: &'a dyn Fn() -> bool,
}

#[derive(Debug, Clone)]
pub(crate) struct Measured {
    pub guess: Guess,
    /// Period and parameters of the measurement; at a border, those of the neighbouring point.
    pub at: (f64, Vec<f64>),
    /// Multipliers of a cycle except the one along it, or eigenvalues (1/s); the most unstable first.
    pub spectrum: Vec<Complex<f64>>,
    pub unstable: usize,
    pub stability: CycleStability,
    pub position: (f64, f64),
    pub relative_velocity: (f64, f64),
    pub sticks: usize,
    pub shortest_stick: f64,
    /// Nearest other sequence of events, and its relative distance.
    pub nearest: Option<(Border, f64)>,
    pub margins: Vec<(Border, f64)>,
    /// Codes of the events: equal words are equal sequences.
    pub word: Vec<u8>,
    pub sequence: String,
    /// See `Orbit::clearance`.
    pub clearance: f64,
    /// d(end)/d(start) of a cycle; Jacobian of steady sliding.
    pub matrix: DMatrix<f64>,
}

pub(crate) enum Local<'a> {
    Steady(SteadySliding<'a>),
    Cycles(Box<Shooting<'a>>),
}

impl Local<'_> {
    pub fn scale(&self) -> &DVector<f64> {
        match self {
            Local::Steady(steady) => &steady.scale,
            Local::Cycles(shooting) => &shooting.scale,
        }
    }

    pub fn unknowns(&self, guess: &Guess) -> DVector<f64> {
        match self {
            Local::Steady(steady) => {
                let all: Vec<f64> = guess.state.iter().chain(&guess.values).copied().collect();
                DVector::from_vec(all).component_div(&steady.scale)
            }
            Local::Cycles(shooting) => shooting.unknowns(guess),
        }
    }

    pub fn guess(&self, x: &DVector<f64>) -> Result<Guess, CycleError> {
        match self {
            Local::Steady(steady) => Ok(steady.guess(x)),
            Local::Cycles(shooting) => shooting.guess(x),
        }
    }

    pub fn last(&self) -> Option<&Shot> {
        match self {
            Local::Steady(_) => None,
            Local::Cycles(shooting) => shooting.last.as_ref(),
        }
    }
}

impl NewtonEquations for Local<'_> {
    fn evaluate(&mut self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>), CycleError> {
        match self {
            Local::Steady(steady) => steady.evaluate(x),
            Local::Cycles(shooting) => shooting.evaluate(x),
        }
    }
}

/// d(state)/dt = 0 in sliding with one sense.
pub(crate) struct SteadySliding<'a> {
    family: &'a Family,
    sense: i8,
    moving: usize,
    scale: DVector<f64>,
    /// Fastest rate, 1/s.
    fastest: f64,
}

impl SteadySliding<'_> {
    fn guess(&self, x: &DVector<f64>) -> Guess {
        let u = x.component_mul(&self.scale);
        Guess {
            time: 0.0,
            state: u.rows(0, self.moving).into_owned(),
            period: f64::NAN,
            values: u.as_slice()[self.moving..].to_vec(),
        }
    }
}

impl NewtonEquations for SteadySliding<'_> {
    fn evaluate(&mut self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>), CycleError> {
        let guess = self.guess(x);
        let member = self.family.at(&guess.values, true)?;
        let n = self.moving;
        let here = sliding((&member.system, member.threshold), self.sense, &guess.state);
        if here.relative_velocity * f64::from(self.sense) <= 0.0 {
            return Err(CycleError::NoSteadySliding);
        }
        let row = |i: usize| 1.0 / (self.scale[i] * self.fastest);
        let residual = DVector::from_fn(n, |i, _| here.rates[i] * row(i));
        let mut jacobian = DMatrix::zeros(n, x.len());
        for i in 0..n {
            for j in 0..n {
                jacobian[(i, j)] = here.jacobian[(i, j)] * self.scale[j] * row(i);
            }
        }
        for (number, moved) in member.moved.iter().enumerate() {
            let column = n + number;
            for copy in &moved.copies {
                let other = sliding((&copy.system, copy.threshold), self.sense, &guess.state);
                for i in 0..n {
                    jacobian[(i, column)] += copy.weight * other.rates[i] * self.scale[column] * row(i);
                }
            }
        }
        Ok((residual, jacobian))
    }
}

impl<'a> Manifold<'a> {
    pub fn local(&self, guess: &Guess) -> Result<Local<'a>, CycleError> {
        let member = self.family.at(&guess.values, false)?;
        let weights = weights(&member.system);
        match self.what {
            What::Steady(sense) => {
                let here = sliding((&member.system, member.threshold), sense, &guess.state);
                let sizes: Vec<f64> = guess.state.iter().map(|y| y.abs()).collect();
                let speed = here.relative_velocity.abs();
                let mut scale: Vec<f64> = scales(&sizes, &weights);
                for (scale, weight) in scale.iter_mut().zip(&weights) {
                    *scale = scale.max(0.05 * speed / weight);
                }
                let n = scale.len();
                let scaled = DMatrix::from_fn(n, n, |i, j| here.jacobian[(i, j)] * scale[j] / scale[i]);
                scale.extend(self.widths);
                Ok(Local::Steady(SteadySliding {
                    family: self.family,
                    sense,
                    moving: n,
                    scale: DVector::from_vec(scale),
                    fastest: scaled.amax(),
                }))
            }
            What::Cycles(multiple) => {
                let shot = motion(&member, (guess.time, &guess.state), guess.period, false, self.stop)?;
                let sizes = scales(&shot.sizes, &weights);
                let about = (&sizes[..], &shot.start_rates);
                Ok(Local::Cycles(Box::new(Shooting::new(
                    self.family,
                    multiple,
                    guess,
                    about,
                    self.widths,
                    self.stop,
                ))))
            }
        }
    }

    pub fn measure(&self, guess: &Guess) -> Result<Measured, CycleError> {
        match self.what {
            What::Cycles(_) => {
                let orbit = Orbit::describe(self.family, guess, (0.0, 0), self.stop)?;
                let spectrum: Vec<Complex<f64>> = orbit
                    .multipliers
                    .iter()
                    .filter(|one| one.kind != crate::cycle::MultiplierKind::Along)
                    .map(|one| Complex::new(one.real, one.imaginary))
                    .collect();
                Ok(Measured {
                    guess: guess.clone(),
                    at: (guess.period, guess.values.clone()),
                    unstable: spectrum
                        .iter()
                        .filter(|one| one.norm() > 1.0 + crate::cycle::NEUTRAL)
                        .count(),
                    spectrum,
                    stability: orbit.stability,
                    position: orbit.position,
                    relative_velocity: orbit.relative_velocity,
                    sticks: orbit.sticks,
                    shortest_stick: orbit.shortest_stick.unwrap_or(f64::NAN),
                    nearest: orbit.nearest.map(|nearest| (nearest.border, nearest.distance)),
                    sequence: orbit.sequence(),
                    margins: orbit
                        .margins
                        .iter()
                        .map(|margin| (margin.border, margin.distance))
                        .collect(),
                    word: orbit.word,
                    clearance: orbit.clearance,
                    matrix: orbit.by_state,
                })
            }
            What::Steady(sense) => {
                let member = self.family.at(&guess.values, false)?;
                let here = sliding((&member.system, member.threshold), sense, &guess.state);
                let mut spectrum = eigenvalues(&here.jacobian);
                spectrum.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
                let fastest = spectrum.iter().map(|one| one.norm()).fold(0.0, f64::max);
                let unstable = spectrum.iter().filter(|one| one.re > ROUNDING * fastest).count();
                let neutral = spectrum.first().is_some_and(|one| one.re >= -ROUNDING * fastest);
                Ok(Measured {
                    guess: guess.clone(),
                    at: (guess.period, guess.values.clone()),
                    unstable,
                    stability: match (unstable, neutral) {
                        (1.., _) => CycleStability::Unstable,
                        (0, true) => CycleStability::Neutral,
                        (0, false) => CycleStability::Stable,
                    },
                    spectrum,
                    position: (here.position, here.position),
                    relative_velocity: (here.relative_velocity, here.relative_velocity),
                    sticks: 0,
                    shortest_stick: f64::NAN,
                    nearest: None,
                    margins: Vec::new(),
                    word: Vec::new(),
                    sequence: String::new(),
                    clearance: f64::INFINITY,
                    matrix: here.jacobian,
                })
            }
        }
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
    ) -> Result<Option<(Measured, DVector<f64>)>, CycleError> {
        if !matches!(self.what, What::Cycles(_)) || measured.clearance >= CLEARANCE {
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
