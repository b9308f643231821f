//! Pieces of a candidate's samples in one mode, in which the equations are smooth.

use super::super::Channel;
use super::super::candidate::Block;
use super::super::reference::Physics;
use crate::model::Mode;
use nalgebra::{DMatrix, DVector};

/// Samples of a stretch: the quadrature through five errs by 8/945 (omega h)^7 at most.
pub(super) const POINTS: usize = 5;

/// Samples in a natural period that a stretch needs: five of them then integrate an oscillation to 1e-6 of itself.
const PER_PERIOD: f64 = 20.0;

/// Stretches kept of the stick-slip, and of all else. Where there are more, every second one is dropped, and so on.
const KEPT: [usize; 2] = [3072, 1024];

/// Five samples in a row of one mode.
#[derive(Debug, Clone)]
pub(super) struct Stretch {
    /// s.
    pub time: [f64; POINTS],
    pub mode: Mode,
    /// omega_r, rad/s.
    pub velocity: [f64; POINTS],
    /// The channels of the state, in their order.
    pub motion: Option<Vec<[f64; POINTS]>>,
    /// F_n, N.
    pub force: Option<[f64; POINTS]>,
    /// z and z'.
    pub axial: Option<[[f64; POINTS]; 2]>,
    /// The torque of friction, N m.
    pub friction: Option<[f64; POINTS]>,
    /// The weights of the integral over the stretch by all samples, and by the first, the middle and the last, s.
    pub fine: [f64; POINTS],
    pub coarse: [f64; POINTS],
}

/// Where the channels are in the blocks.
#[derive(Debug, Clone, Default)]
struct Columns {
    velocity: Option<usize>,
    motion: Option<Vec<usize>>,
    force: Option<usize>,
    axial: Option<[usize; 2]>,
    friction: Option<usize>,
}

/// Stretches of one part of a run, at most so many.
#[derive(Debug, Default)]
struct Kept {
    stretches: Vec<Stretch>,
    /// Every so many are kept, as a power of 2, and how many came.
    thinned: u32,
    came: u64,
}

/// Collects stretches while the samples go by.
#[derive(Debug)]
pub(in super::super) struct StretchPass {
    columns: Columns,
    /// |omega_r| up to which it sticks, rad/s; `None` of a contact without stick.
    tolerance: Option<f64>,
    /// The longest time between two samples, s.
    longest: f64,
    /// The stick-slip of the candidate, s.
    stick_slip: (f64, f64),
    /// Times of events and kicks, s, in order: no stretch holds one.
    breaks: Vec<f64>,
    kept: [Kept; 2],
}

/// The integral from the first to the last of some samples by the polynomial through them, 0 for the others.
fn weights(time: &[f64; POINTS], of: &[usize]) -> Option<[f64; POINTS]> {
    let (from, width) = (time[0], time[POINTS - 1] - time[0]);
    let part = |point: usize| (time[point] - from) / width;
    let powers = DMatrix::from_fn(of.len(), of.len(), |row, column| part(of[column]).powi(row as i32));
    let integrals = DVector::from_fn(of.len(), |row, _| 1.0 / (row + 1) as f64);
    let solved = powers.lu().solve(&integrals)?;
    let mut weights = [0.0; POINTS];
    for (&point, weight) in of.iter().zip(solved.iter()) {
        weights[point] = width * weight;
    }
    Some(weights)
}

impl StretchPass {
    /// Before the first sample. `channels` are those of the blocks, `tolerance` (rad/s) that of a stick;
    /// `stick_slip` (s) is looked at most closely, and no stretch holds one of `breaks` (s).
    pub fn new(
        physics: &Physics,
        channels: &[Channel],
        tolerance: f64,
        stick_slip: (f64, f64),
        mut breaks: Vec<f64>,
    ) -> Self {
        let place = |channel: Channel| channels.iter().position(|known| *known == channel);
        breaks.sort_by(f64::total_cmp);
        StretchPass {
            columns: Columns {
                velocity: place(Channel::RelativeVelocity),
                motion: physics.columns(channels),
                force: place(Channel::NormalForce),
                axial: place(Channel::Z).zip(place(Channel::ZDot)).map(|(z, z_dot)| [z, z_dot]),
                friction: place(Channel::FrictionTorque),
            },
            tolerance: physics.sticks().then_some(tolerance),
            longest: physics.natural_period() / PER_PERIOD,
            stick_slip,
            breaks,
            kept: Default::default(),
        }
    }

    /// Whether the candidate has channels that an equation can be read from.
    pub fn is_of_use(&self) -> bool {
        let c = &self.columns;
        c.velocity.is_some() && (c.motion.is_some() || c.force.is_some() || c.axial.is_some() || c.friction.is_some())
    }

    /// Takes the next samples.
    pub fn add(&mut self, block: &Block) {
        let Some(velocity) = self.columns.velocity else {
            return;
        };
        let velocity = &block.columns[velocity];
        let mut row = 0;
        while row + POINTS <= block.time.len() {
            let time = &block.time[row..row + POINTS];
            let inside = time[0] >= self.stick_slip.0 && time[POINTS - 1] <= self.stick_slip.1;
            let kept = &mut self.kept[usize::from(!inside)];
            kept.came += 1;
            if kept.came & ((1 << kept.thinned) - 1) != 0 {
                row += POINTS - 1;
                continue;
            }
            let speeds = &velocity[row..row + POINTS];
            let tolerance = self.tolerance.unwrap_or(0.0);
            let slides = |w: &f64| w.abs() > tolerance && w.signum() == speeds[0].signum();
            let mode = if speeds.iter().all(slides) {
                Some(self.tolerance.map_or(Mode::Engaged, |_| Mode::sliding(speeds[0])))
            } else {
                let sticks = self.tolerance.is_some() && speeds.iter().all(|w| w.abs() <= tolerance);
                sticks.then_some(Mode::Stick)
            };
            let dense = time.windows(2).all(|pair| pair[1] - pair[0] <= self.longest);
            let margin = time[1] - time[0];
            let next = self.breaks.partition_point(|at| *at < time[0] - margin);
            let whole = self.breaks.get(next).is_none_or(|at| *at > time[POINTS - 1] + margin);
            match mode.filter(|_| dense && whole) {
                Some(mode) => {
                    self.keep(block, row, mode, usize::from(!inside));
                    row += POINTS - 1;
                }
                None => row += 1,
            }
        }
    }

    fn keep(&mut self, block: &Block, row: usize, mode: Mode, part: usize) {
        let of = |column: usize| -> [f64; POINTS] { std::array::from_fn(|k| block.columns[column][row + k]) };
        let time: [f64; POINTS] = std::array::from_fn(|k| block.time[row + k]);
        let c = &self.columns;
        let (Some(fine), Some(coarse)) = (weights(&time, &[0, 1, 2, 3, 4]), weights(&time, &[0, 2, 4])) else {
            return;
        };
        let stretch = Stretch {
            time,
            mode,
            velocity: c.velocity.map_or([0.0; POINTS], of),
            motion: c
                .motion
                .as_ref()
                .map(|columns| columns.iter().map(|&column| of(column)).collect()),
            force: c.force.map(of),
            axial: c.axial.map(|columns| columns.map(of)),
            friction: c.friction.map(of),
            fine,
            coarse,
        };
        let kept = &mut self.kept[part];
        kept.stretches.push(stretch);
        if kept.stretches.len() > KEPT[part] {
            kept.thinned += 1;
            let mut every = 0;
            kept.stretches.retain(|_| {
                every += 1;
                every % 2 == 0
            });
        }
    }

    /// What was collected.
    pub(super) fn finish(self) -> Vec<Stretch> {
        self.kept.into_iter().flat_map(|kept| kept.stretches).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_weights_integrate_polynomials_through_uneven_samples() {
        let time = [1.0, 1.1, 1.25, 1.6, 2.0];
        let fine = weights(&time, &[0, 1, 2, 3, 4]).unwrap();
        let coarse = weights(&time, &[0, 2, 4]).unwrap();
        let integral = |weights: &[f64; POINTS], power: i32| -> f64 {
            time.iter().zip(weights).map(|(t, w)| w * t.powi(power)).sum()
        };
        for power in 0..=4 {
            let exact = (2f64.powi(power + 1) - 1.0) / f64::from(power + 1);
            assert!((integral(&fine, power) - exact).abs() < 1e-12, "{power}");
            assert!(power > 2 || (integral(&coarse, power) - exact).abs() < 1e-12, "{power}");
        }
    }
}
