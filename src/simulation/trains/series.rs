//! The trains' own solver: Taylor series in every mode.
//!
//! Stick and separation are linear, whatever drives them, and so is slip under constant friction: there the series is that of
//! the matrix exponential and of the signals, and converges over every step. Guards are polynomials of the step's own
//! accuracy, and their first root is isolated, not searched for.

use super::dynamics::{GUARD_STOPPING, TrainDynamics, TrainLocation, VELOCITY_NOISE, Watched};
use super::expansion::{Expansion, Series, TERMS};
use crate::friction::Law;
use crate::hybrid::{Advance, ChosenSolver, Dynamics, Engine, EngineError, Fired, Segment};
use crate::model::Mode;
use crate::model::trains::system::Outside;
use crate::numerics::polynomial_roots::first_falling;
use crate::numerics::taylor;
use crate::simulation::brake::Watch;
use crate::simulation::semi_analytic::{FORCE_NOISE, MARGIN_NOISE};
use crate::sundials::Counters;
use std::sync::Arc;

/// What counts as zero of its rate: a share of the torques that accelerate the surfaces.
const DEPARTURE_NOISE: f64 = 1e-9;

/// Coefficients by which the size of a quantity is judged that may start at zero.
const LEADING: usize = 6;

/// Of energies, which nothing depends on, what a step may err by over their size.
const ENERGY_TOLERANCE: f64 = 1e-14;

/// See the module.
pub(super) struct TaylorEngine {
    dynamics: Arc<TrainDynamics>,
    expansion: Expansion,
    location: TrainLocation,
    origin: f64,
    span: f64,
    max_step: f64,
    relative: f64,
    absolute: Vec<f64>,
    tau: f64,
    y: Vec<f64>,
    /// Where the last expansion stands, and its time within the segment.
    about: f64,
    /// Nothing has been stepped over in this segment.
    first: bool,
    /// The slip has begun against its sense, see [`Dynamics::starts_beyond`], and has not turned yet.
    beyond: bool,
    /// In a stick of two tied trains, [`TrainSystem::twisted`](crate::model::trains::system::TrainSystem::twisted) at its start.
    held: Option<f64>,
    counters: Counters,
}

impl TaylorEngine {
    pub fn new(dynamics: Arc<TrainDynamics>) -> TaylorEngine {
        let dimension = dynamics.system.dimension;
        TaylorEngine {
            expansion: Expansion::new(&dynamics),
            location: TrainLocation {
                mode: Mode::Separated,
                sense: 0,
                piece: 0,
                stretch: 0,
                slow: false,
                watch: Watch::Off,
                resolved: true,
            },
            origin: 0.0,
            span: 0.0,
            max_step: f64::INFINITY,
            relative: 0.0,
            absolute: vec![0.0; dimension],
            tau: 0.0,
            y: vec![0.0; dimension],
            about: 0.0,
            first: true,
            beyond: false,
            held: None,
            counters: Counters::default(),
            dynamics,
        }
    }

    /// The longest step whose last two terms fall below what is tolerated, s.
    fn longest_step(&self) -> f64 {
        let system = &self.dynamics.system;
        let expansion = &self.expansion;
        let mut shares = [0.0f64; 2];
        let mut take = |series: &Series, weight: f64| {
            for (share, n) in shares.iter_mut().zip([TERMS - 1, TERMS - 2]) {
                let size = series[n].abs() / weight;
                *share = if size <= *share { *share } else { size };
            }
        };
        for k in 0..system.mechanical() {
            take(&expansion.state[k], self.absolute[k] + self.relative * self.y[k].abs());
        }
        // What the guards are made of may move while the state does not.
        let size = |series: &Series| series[..LEADING].iter().fold(0.0f64, |most, c| most.max(c.abs()));
        match self.location.mode {
            Mode::Separated => {}
            Mode::Stick => {
                let tested = expansion.tested(system);
                let torque = size(&tested).max(size(&expansion.limit));
                if torque > 0.0 {
                    take(&tested, self.relative * torque);
                    take(&expansion.limit, self.relative * torque);
                }
            }
            _ => {
                let outside = self.driving();
                let speeds = system.relative_velocity_terms(&outside, &self.y);
                let weight = self.absolute_speed() + self.relative * speeds;
                take(&expansion.relative_velocity, weight);
            }
        }
        for series in &expansion.state[system.slip..] {
            let size = size(series);
            if size > 0.0 {
                take(series, ENERGY_TOLERANCE * size);
            }
        }
        let longest = taylor::step(TERMS - 1, |n| shares[TERMS - 1 - n]) * expansion.unit;
        expansion.within_law(system, &self.location, longest.min(self.span - self.tau))
    }

    /// Takes back what rounding has made of a stick: the surfaces have one speed, and the angle between them stays. Both are
    /// known without integration, from the other states and from the ends.
    fn hold(&mut self) {
        let TrainDynamics { system, excitation, .. } = &*self.dynamics;
        let outside = self.driving();
        if let Some(twisted) = self.held {
            let turned = excitation.turned(self.location.stretch, self.origin, self.tau);
            let angle = twisted - turned - system.twisted(&self.y);
            system.turn(angle, &mut self.y);
        }
        system.rejoin(&outside, &mut self.y);
    }

    /// What the drives do where it stands.
    fn driving(&self) -> Outside {
        let excitation = &self.dynamics.excitation;
        excitation.driving_alone(self.location.stretch, self.origin + self.tau)
    }

    /// The absolute tolerance of speeds.
    fn absolute_speed(&self) -> f64 {
        let mechanical = self.dynamics.system.mechanical();
        self.absolute[..mechanical].iter().copied().fold(0.0, f64::max)
    }

    /// The polynomial of a guard over the unit; `None` where it does not exist.
    fn guard(&self, watched: Watched) -> Option<Series> {
        let expansion = &self.expansion;
        let of_speed = |sign: f64, constant: f64| {
            let mut series = expansion.relative_velocity;
            series.iter_mut().for_each(|c| *c *= sign);
            series[0] += constant;
            series
        };
        let sense = self.location.sign();
        let threshold = self.dynamics.threshold;
        Some(match watched {
            Watched::Stopping => of_speed(sense, 0.0),
            Watched::Margin => {
                let margin = expansion.stability_margin(&self.dynamics.system)?;
                match self.location.watch {
                    Watch::Unstable => margin.map(|c| -c),
                    _ => margin,
                }
            }
            Watched::Threshold if self.location.slow => of_speed(-sense, threshold),
            Watched::Threshold => of_speed(sense, -threshold),
            Watched::Below => of_speed(sense, -self.dynamics.knot(&self.location, false)?),
            Watched::Above => of_speed(-sense, self.dynamics.knot(&self.location, true)?),
            Watched::Forward | Watched::Backward => {
                let tested = expansion.tested(&self.dynamics.system);
                let sign = if watched == Watched::Forward { -1.0 } else { 1.0 };
                std::array::from_fn(|n| expansion.limit[n] + sign * tested[n])
            }
        })
    }

    /// What the rounding of the normal force where the segment begins is in the margin, N m s/rad, and what that of its rate is
    /// in the margin's, N m/rad.
    fn noise_of_margin(&self) -> (f64, f64) {
        let TrainDynamics { system, excitation, .. } = &*self.dynamics;
        let (force, unit, t) = (self.expansion.normal_force(), self.expansion.unit, self.origin);
        // The time is itself no more exact than its last place.
        let of_force = excitation.largest_force() + (force[1] / unit * t).abs();
        let of_rate = (2.0 * force[2] / (unit * unit)).abs() * (t + self.dynamics.natural_period().unwrap_or(0.0));
        let x = self.location.sign() * self.expansion.relative_velocity[0];
        let slope = system.law_in(self.location.piece).coefficient_and_slope(x).1.abs();
        let noise = |of: f64| system.slope_weight(FORCE_NOISE * of) * slope;
        (noise(of_force), noise(of_rate))
    }

    /// The first share of the step of `x` units at which a guard fires.
    fn first_root(&mut self, watched: Watched, x: f64) -> Option<f64> {
        self.counters.root_evaluations += 1;
        let mut guard = self.guard(watched)?;
        let mut power = 1.0;
        for c in &mut guard {
            *c *= power;
            power *= x;
        }
        if matches!(watched, Watched::Forward | Watched::Backward) {
            let noise = self.dynamics.torque_noise();
            let torque = self.expansion.tested(&self.dynamics.system);
            if torque.iter().rev().fold(0.0, |sum, c| sum * x + c.abs()) <= noise {
                // Nothing breaks a stick that nothing pushes: its limit may come down to zero.
                return None;
            }
            if self.first && guard[0].abs() <= noise {
                // It stands at its limit but for rounding: what follows decides.
                guard[0] = 0.0;
            }
        } else if self.first && watched == Watched::Margin {
            let system = &self.dynamics.system;
            let resistance = system.twice_resistance.unwrap_or(0.0);
            let (force_noise, rate_noise) = self.noise_of_margin();
            if guard[0].abs() <= MARGIN_NOISE * resistance + force_noise {
                // It leaves zero here, like a speed. Without resistance its zero is the force's, which a force that sets in at a
                // corner leaves tangentially.
                let tangential = resistance < force_noise && guard[1].abs() < rate_noise * self.expansion.unit * x;
                divide_out(&mut guard, if tangential { 2 } else { 1 });
            }
        } else if self.first {
            let system = &self.dynamics.system;
            let outside = self.driving();
            let threshold = if watched == Watched::Threshold {
                self.dynamics.threshold
            } else {
                0.0
            };
            let noise = VELOCITY_NOISE * (system.relative_velocity_terms(&outside, &self.y) + threshold);
            if guard[0].abs() <= noise {
                // It leaves zero here: the root, simple or double, is divided out.
                let lightest = system.rotor.surface_inertia().min(system.stator.surface_inertia());
                let torque = self.expansion.interface[0].abs();
                let slope_noise = DEPARTURE_NOISE * torque / lightest * self.expansion.unit * x;
                let roots = if guard[1].abs() <= slope_noise { 2 } else { 1 };
                divide_out(&mut guard, roots);
            }
        }
        if guard[0] < 0.0 && !(self.beyond && watched == Watched::Stopping) {
            Some(0.0)
        } else {
            first_falling(&guard)
        }
    }
}

/// Takes `roots` zeros at the start out of a guard.
fn divide_out(guard: &mut Series, roots: usize) {
    guard.rotate_left(roots);
    guard[TERMS - roots..].fill(0.0);
}

impl Engine<TrainLocation> for TaylorEngine {
    fn begin(&mut self, segment: &Segment<'_, TrainLocation>, chosen: &ChosenSolver) -> Result<(), EngineError> {
        self.location = segment.location;
        self.origin = segment.start;
        self.span = segment.span();
        self.max_step = chosen.max_step.unwrap_or(f64::INFINITY);
        self.relative = chosen.tolerances.relative;
        self.absolute.copy_from_slice(&chosen.tolerances.absolute);
        self.tau = 0.0;
        self.y.copy_from_slice(segment.state);
        self.about = 0.0;
        self.first = true;
        self.beyond = self
            .dynamics
            .starts_beyond(&self.location, segment.start, segment.state, GUARD_STOPPING);
        let system = &self.dynamics.system;
        let tied = system.rotor.speed.is_none() && system.stator.speed.is_none();
        self.held = (tied && self.location.mode == Mode::Stick).then(|| system.twisted(&self.y));
        self.counters = Counters::default();
        Ok(())
    }

    fn advance(&mut self) -> Result<Advance, EngineError> {
        let unit = self.dynamics.unit(self.location.stretch);
        let (dynamics, t) = (self.dynamics.clone(), self.origin + self.tau);
        if self.location.mode == Mode::Stick {
            self.hold();
        }
        self.expansion.expand(&dynamics, &self.location, t, &self.y, unit);
        self.counters.rhs_evaluations += 1;
        let longest = self.longest_step();
        if longest.is_nan() {
            return Err(EngineError::NotFinite);
        }
        let left = self.span - self.tau;
        let bound = longest.min(self.max_step);
        let reaches = bound >= left;
        let length = if reaches { left } else { bound };
        let tau = self.tau + length;
        if tau <= self.tau {
            return Err(EngineError::StepTooShort { step: length });
        }
        let mut earliest: Option<(f64, usize)> = None;
        for (index, &watched) in dynamics.watched(&self.location).iter().enumerate() {
            if let Some(share) = self.first_root(watched, length / unit)
                && earliest.is_none_or(|(before, _)| share < before)
            {
                earliest = Some((share, index));
            }
        }
        self.about = self.tau;
        self.first = false;
        self.counters.steps += 1;
        self.counters.last_order = TERMS as u32 - 1;
        let length = earliest.map_or(length, |(share, _)| share * length);
        self.counters.last_step = length;
        self.expansion.at(length / unit, &mut self.y);
        self.tau = if earliest.is_some() { self.tau + length } else { tau };
        if self.beyond {
            let outside = dynamics.outside(&self.location, self.origin + self.tau);
            self.beyond = self.location.sign() * dynamics.system.relative_velocity(&outside, &self.y) < 0.0;
        }
        Ok(match earliest {
            Some((_, index)) => Advance::Guards(Fired::one(index)),
            None if reaches => Advance::Stop,
            None => Advance::Stepped,
        })
    }

    fn time(&self) -> f64 {
        self.tau
    }

    fn state(&self) -> &[f64] {
        &self.y
    }

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), EngineError> {
        self.expansion.at((tau - self.about) / self.expansion.unit, out);
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters, EngineError> {
        Ok(self.counters)
    }
}
