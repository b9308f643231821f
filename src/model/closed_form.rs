//! Stick and separation in closed form, where the ends rest and the torques are constant.
//!
//! The matrix exponential is exact at any time, and its energy proves when a stick can never break away again. Coordinates
//! are those of `Chains`.

use super::OfLinearModes;
use super::chains::{Chains, Drifting, Sum, Turning};
use super::equations::{ANGLE, DAMPING_LOSS, SystemEquations, WORK};
use crate::model::Mode;
use crate::model::breakaway::{Bounded, Breakaway, Search, first_breakaway};
use crate::model::linear_flow::{self, Flow};
use nalgebra::{DMatrix, DVector};

/// Coordinates up to which a closed form is used. The work of its products grows with the square of their number, that of a
/// Taylor series in proportion to it, which then costs less.
const MOST: usize = 16;

/// Both linear motions of a system; each is made when it is first asked for.
pub type ClosedForm = OfLinearModes<Motion>;

impl ClosedForm {
    /// The motion of a mode; `None` where it has no closed form: in slip, where a shaft has no stiffness, where nothing moves by
    /// itself, and where the chains are too long.
    pub fn of(&self, system: &SystemEquations, mode: Mode) -> Option<&Motion> {
        self.get(mode, || Motion::new(system, mode == Mode::Stick))
    }
}

/// The linear motion of one mode.
#[derive(Debug)]
pub struct Motion {
    /// With the torque that breakaway tests, N m.
    flow: Box<dyn Flow>,
    /// P.
    energy: DMatrix<f64>,
    dimension: usize,
    /// Entries of the state by the coordinates, and the speeds among the coordinates by entries of the state.
    entries: Vec<Sum>,
    speeds: Vec<Sum>,
    /// Coordinate, entry and factor of each twist: x = factor y.
    twists: Vec<(usize, usize, f64)>,
    /// The side on which each torque acts, its coordinate, and its factor: x = torque / factor.
    torques: Vec<(usize, usize, f64)>,
    drifting: Vec<Drifting>,
    /// What the inertia on which a side's torque acts turns by.
    driven: [Option<Turning>; 2],
    /// What rotor and stator surface turn by.
    surfaces: [Option<Turning>; 2],
    /// What the stator's outermost inertia turns by, where both chains are free.
    outermost: Option<Turning>,
    /// The coordinates in which a motion comes to rest are this by those in which it starts; `None` where they are zero.
    rest: Option<DMatrix<f64>>,
    stuck: bool,
    slip: usize,
}

impl Motion {
    fn new(system: &SystemEquations, stuck: bool) -> Option<Motion> {
        let chains = Chains::new(system, stuck).filter(|chains| chains.dimension() <= MOST)?;
        let (a, energy) = (chains.flow(), chains.energy());
        let flow = linear_flow::flow(&a, &energy, &chains.tested(system));
        flow.has_bounds().then_some(())?;
        Some(Motion {
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

    /// The coordinates of a state under these torques (N m).
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

    /// Writes the state a time `tau` >= 0 (s) after the state `y`, under the external torques of rotor and stator (N m). In a
    /// stick both surfaces have one speed.
    pub fn state(&self, y: &[f64], torques: [f64; 2], tau: f64, out: &mut [f64]) {
        let start = self.coordinates(y, torques);
        let mut x = start.clone();
        self.flow.advance(start.as_slice(), tau, x.as_mut_slice());
        out.copy_from_slice(y);
        for entry in &self.entries {
            out[entry.of] = entry.over(x.as_slice());
        }
        let change = &x - &start;
        // What the common motion of drifting bodies adds to an angle.
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

    /// The torque (N m) that breakaway tests in a stick at the state `y`, under the external torques of rotor and stator (N m).
    pub(crate) fn tested_torque(&self, y: &[f64], torques: [f64; 2]) -> f64 {
        self.flow.value(self.coordinates(y, torques).as_slice())
    }

    /// When a stick that begins with the state `y` breaks away, under the external torques of rotor and stator (N m); `limit` and
    /// `lowest` are as those of [`first_breakaway`].
    pub(crate) fn breakaway(
        &self,
        y: &[f64],
        torques: [f64; 2],
        search: Search,
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
