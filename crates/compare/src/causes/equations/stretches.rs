//! Stretches of a candidate's samples in one mode, in which the equations are smooth.

use crate::Channel;
use crate::candidate::Block;
use crate::reference::Physics;
use nalgebra::{DMatrix, DVector};
use stickslip_system::model::Mode;

/// Samples of a stretch: the quadrature through five errs by at most 8/945 (omega h)^7.
pub const POINTS: usize = 5;

/// Fewest samples in a natural period: five then integrate an oscillation to 1e-6 of itself.
const PER_PERIOD: f64 = 20.0;

/// Stretches kept in stick-slip, and elsewhere. Beyond that, every second one is dropped repeatedly.
const KEPT: [usize; 2] = [3072, 1024];

#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    pub time: [f64; POINTS],
    pub mode: Mode,
    pub velocity: [f64; POINTS],
    pub motion: Option<Vec<[f64; POINTS]>>,
    pub force: Option<[f64; POINTS]>,
    pub axial: Option<[[f64; POINTS]; 2]>,
    pub friction: Option<[f64; POINTS]>,
    /// Weights of the integral over the stretch by all samples, and by the first, the middle and the last, s.
    pub fine: [f64; POINTS],
    pub coarse: [f64; POINTS],
}

#[derive(Debug, Clone, Default)]
struct Columns {
    velocity: Option<usize>,
    motion: Option<Vec<usize>>,
    force: Option<usize>,
    axial: Option<[usize; 2]>,
    friction: Option<usize>,
}

#[derive(Debug, Default)]
struct KeptStretch {
    stretches: Vec<Stretch>,
    /// Base-2 logarithm of the thinning, and the number of stretches before it.
    thinned: u32,
    came: u64,
}

#[derive(Debug)]
pub(crate) struct StretchPass {
    columns: Columns,
    /// |omega_r| up to which the contact sticks, rad/s; `None` without stick.
    tolerance: Option<f64>,
    longest: f64,
    stick_slip: (f64, f64),
    breaks: Vec<f64>,
    kept: [KeptStretch; 2],
}

/// Weights of the integral from the first to the last sample by the polynomial through the samples `of`; 0 for the
/// others.
pub fn weights(time: &[f64; POINTS], of: &[usize]) -> Option<[f64; POINTS]> {
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
    /// `channels` are those of the blocks; `tolerance` (rad/s) defines a stick. Stretches within `stick_slip` (s) are
    /// kept with priority; no stretch contains one of `breaks` (s).
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

    pub fn is_of_use(&self) -> bool {
        let c = &self.columns;
        c.velocity.is_some() && (c.motion.is_some() || c.force.is_some() || c.axial.is_some() || c.friction.is_some())
    }

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

    pub(crate) fn finish(self) -> Vec<Stretch> {
        self.kept.into_iter().flat_map(|kept| kept.stretches).collect()
    }
}
