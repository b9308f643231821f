//! The axial motion, which is independent of the other motions and presses the surfaces together.

use super::float::Float;
use super::pieces::{ExactPiece, pieces};
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use std::cmp::Ordering;
use std::collections::VecDeque;
use stickslip_system::model::nearest_double;
use stickslip_system::signal::Signal;

/// Events closer than this (s) are simultaneous (docs/theory.md).
pub(super) const INSTANT: f64 = 1e-18;

#[derive(Debug)]
pub(super) struct ExactAxialMotion<const N: usize> {
    damping: Float<N>,
    stiffness: Float<N>,
    per_mass: Float<N>,
}

impl<const N: usize> ExactAxialMotion<N> {
    pub fn new(mass: &BigRational, stiffness: &BigRational, damping: &BigRational) -> Self {
        ExactAxialMotion {
            damping: Float::from_rational(damping),
            stiffness: Float::from_rational(stiffness),
            per_mass: Float::from_rational(&mass.recip()),
        }
    }

    /// F_n without its clamp at zero, -c_a z' - k_e z, N.
    pub fn normal_force(&self, z: &Float<N>, z_dot: &Float<N>) -> Float<N> {
        -&(&(&self.damping * z_dot) + &(&self.stiffness * z))
    }

    pub fn acceleration(&self, normal: &Float<N>, force: &Float<N>) -> Float<N> {
        &(normal - force) * &self.per_mass
    }

    /// The free part of z and z': the deviation from the straight line under linear F.
    fn free_part(&self, [z, z_dot]: [&Float<N>; 2], [force, slope]: [&Float<N>; 2]) -> [Float<N>; 2] {
        let drift = slope.over(&self.stiffness);
        let straight = (force - &(&self.damping * &drift)).over(&self.stiffness);
        [z + &straight, z_dot + &drift]
    }
}

#[derive(Debug)]
pub(super) struct Actuation<const N: usize> {
    /// Start of the present piece, with F and F' there, N and N/s.
    now: (Float<N>, [Float<N>; 2]),
    /// Whether F presses just before the next corner.
    presses_at_end: bool,
    later: VecDeque<ExactPiece>,
    /// Amplitude below which an open contact that rings stays open, m.
    ringing_floor: f64,
    /// m / k_e, s^2.
    time_squared: f64,
}

impl<const N: usize> Actuation<N> {
    /// Also returns whether the force presses from t = 0 on.
    pub fn new(
        signal: &Signal<BigRational>,
        ringing_floor: &BigRational,
        [mass, stiffness]: [&BigRational; 2],
    ) -> (Self, bool) {
        let mut later: VecDeque<ExactPiece> = pieces(signal).into();
        let zero = BigRational::zero;
        let first = later.pop_front().unwrap_or(ExactPiece::constant(zero(), zero()));
        let presses = first.force.is_positive() || (first.force.is_zero() && first.slope.is_positive());
        let actuation = Actuation {
            now: Self::numbers(&first),
            presses_at_end: first.end_force.is_positive(),
            later,
            ringing_floor: nearest_double(ringing_floor),
            time_squared: nearest_double(&(mass / stiffness)),
        };
        (actuation, presses)
    }

    fn numbers(piece: &ExactPiece) -> (Float<N>, [Float<N>; 2]) {
        let number = Float::from_rational;
        (number(&piece.start), [number(&piece.force), number(&piece.slope)])
    }

    pub fn at(&self, time: &Float<N>) -> [Float<N>; 2] {
        let (start, [force, slope]) = &self.now;
        [force + &(slope * &(time - start)), *slope]
    }

    pub fn corners(&self) -> impl Iterator<Item = &BigRational> {
        self.later.iter().map(|piece| &piece.start)
    }

    pub fn advance(&mut self, time: &Float<N>) -> bool {
        let Some(piece) = self.later.front() else { return false };
        let next = Self::numbers(piece);
        if next.0 > *time {
            return false;
        }
        self.presses_at_end = piece.end_force.is_positive();
        self.now = next;
        self.later.pop_front();
        true
    }

    /// Whether an open contact stays open at `time`: F does not press, and the remaining oscillation is below its
    /// floor.
    pub fn rests(&self, motion: &ExactAxialMotion<N>, axial: [&Float<N>; 2], time: &Float<N>) -> bool {
        let (_, [force, _]) = &self.now;
        if force.signum() > 0 || self.presses_at_end {
            return false;
        }
        let [force, slope] = self.at(time);
        let [z, z_dot] = motion.free_part(axial, [&force, &slope]).map(|part| part.to_f64());
        (z * z + z_dot * z_dot * self.time_squared).sqrt() < self.ringing_floor
    }

    /// Sign with which the pressing force leaves zero at a corner of F, and whether the force stood beyond zero
    /// already. Changes within an instant count as immediate.
    pub fn leaving(&self, motion: &ExactAxialMotion<N>, [z, z_dot]: [&Float<N>; 2]) -> (i8, bool) {
        let [force, slope] = &self.now.1;
        let normal = motion.normal_force(z, z_dot);
        let acceleration = motion.acceleration(&normal, force);
        let rate = motion.normal_force(z_dot, &acceleration);
        let curvature = motion.normal_force(&acceleration, &motion.acceleration(&rate, slope));
        let [normal, rate, curvature] = [normal, rate, curvature].map(|value| value.to_f64());
        if normal.abs() > (rate.abs() + curvature.abs() * INSTANT / 2.0) * INSTANT {
            return (if normal > 0.0 { 1 } else { -1 }, true);
        }
        let ahead = normal + (rate + curvature * INSTANT / 2.0) * INSTANT;
        match ahead.total_cmp(&0.0) {
            // An undamped force leaves rest with its third derivative.
            _ if ahead == 0.0 => (slope.signum(), false),
            Ordering::Greater => (1, false),
            _ => (-1, false),
        }
    }
}
