//! Stick and separation in closed form, for ends at rest and constant torques.
//!
//! The matrix exponential is exact at any time, and its energy can prove that a stick never breaks away again. The
//! coordinates are those of `Chains`.

use super::OfLinearModes;
use super::chains::{Chains, Drifting, TermSum, Turning};
use super::equations::{ANGLE, DAMPING_LOSS, SystemEquations, WORK};
use crate::model::Mode;
use crate::model::breakaway::{Bounded, Breakaway, BreakawaySearch, first_breakaway};
use crate::model::linear_flow::{self, DecayingFlow};
use nalgebra::{DMatrix, DVector};

/// Largest number of coordinates with a closed form. Its work grows with the square of their number, a Taylor series'
/// in proportion.
const MOST: usize = 16;

/// The linear motions of a system, in stick and in separation. Each is made on first use.
pub type ClosedForm = OfLinearModes<LinearMotion>;

impl ClosedForm {
    /// The motion of a mode. `None` without a closed form: in slip, if a shaft has no stiffness, if nothing moves by
    /// itself, and for long chains.
    pub fn of(&self, system: &SystemEquations, mode: Mode) -> Option<&LinearMotion> {
        self.get(mode, || LinearMotion::new(system, mode == Mode::Stick))
    }
}

/// The linear motion of one mode.
#[derive(Debug)]
pub struct LinearMotion {
    /// Its linear function is the torque that the breakaway test uses, N m.
    flow: Box<dyn DecayingFlow>,
    energy: DMatrix<f64>,
    dimension: usize,
    entries: Vec<TermSum>,
    speeds: Vec<TermSum>,
    /// Coordinate, state entry and factor of each twist: x = factor y.
    twists: Vec<(usize, usize, f64)>,
    /// Side, coordinate and factor of each torque: x = torque / factor.
    torques: Vec<(usize, usize, f64)>,
    drifting: Vec<Drifting>,
    driven: [Option<Turning>; 2],
    surfaces: [Option<Turning>; 2],
    /// Angle of the stator's outermost inertia; `None` unless both chains are free.
    outermost: Option<Turning>,
    /// Matrix from the initial coordinates to those at rest; `None` if these are zero.
    rest: Option<DMatrix<f64>>,
    stuck: bool,
    slip: usize,
}

impl LinearMotion {
    fn new(system: &SystemEquations, stuck: bool) -> Option<LinearMotion> {
        let chains = Chains::new(system, stuck).filter(|chains| chains.dimension() <= MOST)?;
        let (a, energy) = (chains.flow(), chains.energy());
        let flow = linear_flow::flow(&a, &energy, &chains.tested(system));
        flow.has_bounds().then_some(())?;
        Some(LinearMotion {
            flow,
            energy,
            dimension: chains.dimension(),
            entries: chains.entries(),
            speeds: chains.speeds(),
            twists: chains.twists(),
            torques: chains.torques().to_vec(),
            drifting: chains.drifting(),
            driven: [0, 1].map(|side| chains.driven(side)),
            surfaces: [0, 1].map(|side| chains.surface(side)),
            outermost: chains.outermost(),
            rest: chains.rest(&a)?,
            stuck,
            slip: system.slip,
        })
    }

    fn coordinates(&self, y: &[f64], torques: [f64; 2]) -> DVector<f64> {
        let mut x = DVector::zeros(self.dimension);
        for &(coordinate, entry, factor) in &self.twists {
            x[coordinate] = factor * y[entry];
        }
        for speed in &self.speeds {
            x[speed.of] = speed.over(y);
        }
        for &(side, coordinate, factor) in &self.torques {
            x[coordinate] = torques[side] / factor;
        }
        x
    }

    /// Writes to `out` the state a time `tau` >= 0 (s) after `y`, under the external torques of rotor and stator (N
    /// m). In stick both surfaces have the same speed.
    pub fn state(&self, y: &[f64], torques: [f64; 2], tau: f64, out: &mut [f64]) {
        let start = self.coordinates(y, torques);
        let mut x = start.clone();
        self.flow.advance(start.as_slice(), tau, x.as_mut_slice());
        out.copy_from_slice(y);
        for entry in &self.entries {
            out[entry.of] = entry.over(x.as_slice());
        }
        let change = &x - &start;
        let mut common = [0.0; 2];
        for (drifting, common) in self.drifting.iter().zip(&mut common) {
            let acceleration = drifting.acceleration(torques);
            for (index, row) in &drifting.speeds {
                out[*index] = y[*index] + row.dot(&change) + acceleration * tau;
            }
            if let Some((index, row)) = drifting.speeds.first() {
                *common = (y[*index] - row.dot(&start) + 0.5 * acceleration * tau) * tau;
            }
        }
        let beside = |turning: &Option<Turning>| turning.as_ref().map_or(0.0, |turning| turning.row.dot(&change));
        let turned = |turning: &Option<Turning>| {
            let drifting = turning.as_ref().and_then(|turning| turning.drifting);
            beside(turning) + drifting.map_or(0.0, |index| common[index])
        };
        let quadratures = &mut out[self.slip..];
        if !self.stuck {
            quadratures[0] += turned(&self.surfaces[0]) - turned(&self.surfaces[1]);
        }
        let mut work = 0.0;
        for &(side, ..) in &self.torques {
            quadratures[WORK] += torques[side] * turned(&self.driven[side]);
            work += torques[side] * beside(&self.driven[side]);
        }
        let energy = 0.5 * (change.transpose() * &self.energy * (x + start))[0];
        quadratures[DAMPING_LOSS] += work - energy;
        if let (Some(angle), Some(_)) = (quadratures.get_mut(ANGLE), &self.outermost) {
            *angle += turned(&self.outermost);
        }
    }

    /// The torque (N m) of the breakaway test in stick at `y`, under the external torques of rotor and stator (N m).
    pub fn tested_torque(&self, y: &[f64], torques: [f64; 2]) -> f64 {
        self.flow.value(self.coordinates(y, torques).as_slice())
    }

    /// Searches for the breakaway of a stick that begins with `y`, under the external torques of rotor and stator (N
    /// m). `limit` returns the breakaway torque at a time after the start, and `lowest` its least later value, N m.
    pub fn breakaway(
        &self,
        y: &[f64],
        torques: [f64; 2],
        search: BreakawaySearch,
        limit: impl Fn(f64) -> Bounded,
        lowest: impl Fn(f64) -> f64,
    ) -> Breakaway {
        let start = self.coordinates(y, torques);
        let rest = self.rest.as_ref().map(|rest| rest * &start);
        let at_rest = rest.as_ref().map_or(0.0, |rest| self.flow.value(rest.as_slice()).abs());
        let tested = |tau: f64| {
            let mut x = start.clone();
            self.flow.advance(start.as_slice(), tau, x.as_mut_slice());
            let (torque, swing) = match &rest {
                Some(rest) => self.flow.bounded(x.as_slice(), (&x - rest).as_slice()),
                None => self.flow.bounded(x.as_slice(), x.as_slice()),
            };
            (torque, at_rest + swing)
        };
        first_breakaway(search, tested, limit, lowest)
    }
}
