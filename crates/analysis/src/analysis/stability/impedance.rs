//! Mechanical impedance of two trains at their contact, and the negative contact damping that they tolerate.
//!
//! With T = kappa omega_r about steady sliding (kappa = r F_n dmu/dx for a friction law) the motion exp(s t) exists
//! where Z(s) + kappa = 0, 1/Z = 1/Z_rotor + 1/Z_stator. The impedance of a train follows from its far end inwards:
//!
//! ```text
//! Z_i = s J_i + d_i + (outer side of inertia i),   outer side = shaft and Z_(i+1) in series,   shaft = c + k/s.
//! ```
//!
//! Stability changes at s = i omega: at the zeros of Im Z(i omega), where kappa = -Re Z. No matrix is involved, so for
//! one grounded inertia the result is its damping to the last digit. As kappa falls through -Re Z, a pair of
//! eigenvalues moves right if Im Z rises with omega, and left if it falls. Without contact the trains are passive: for
//! kappa >= 0 nothing grows.

use nalgebra::Complex;
use serde::Serialize;
use stickslip_system::model::equations::Side;
use stickslip_system::numerics::bisection::bisect;

/// Zeros are sought from the smallest natural frequency divided by this factor to the largest one multiplied by it.
const BEYOND: f64 = 1e4;
const POINTS: usize = 1200;
/// Around each natural frequency w, points lie at w (1 +- 10^(-k/4)), with k up to this number.
const NEAR: i32 = 40;
const ROUNDING: f64 = 1e-14;

/// Stability of steady sliding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SlidingVerdict {
    /// A small disturbance decays.
    Stable,
    /// A small disturbance neither grows nor decays, to first order.
    Neutral,
    /// A small disturbance grows.
    Unstable,
}

impl SlidingVerdict {
    /// Whether a small disturbance grows.
    pub fn is_unstable(self) -> bool {
        self == SlidingVerdict::Unstable
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ImpedanceCrossing {
    /// -kappa, N m s/rad, at least 0.
    pub resistance: f64,
    /// Angular frequency of the neutral motion, rad/s; 0 without oscillation.
    pub angular_frequency: f64,
    /// Increase of the number of growing motions as the damping falls.
    change: i32,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct ImpedanceCrossings(pub Vec<ImpedanceCrossing>);

fn in_series(a: Complex<f64>, b: Complex<f64>) -> Complex<f64> {
    a * b / (a + b)
}

/// `None` for a prescribed surface.
fn of_train(side: &Side, omega: f64) -> Option<Complex<f64>> {
    let shaft = |i: usize| Complex::new(side.damping[i], -side.stiffness[i] / omega);
    let inertia = |i: usize| Complex::new(side.viscous[i], omega * side.inertia[i]);
    let last = side.inertia.len().checked_sub(1)?;
    let mut z = inertia(last);
    if side.shafts() > last {
        z += shaft(last);
    }
    for i in (0..last).rev() {
        z = inertia(i) + in_series(shaft(i), z);
    }
    Some(z)
}

fn of_both(rotor: &Side, stator: &Side, omega: f64) -> Complex<f64> {
    match (of_train(rotor, omega), of_train(stator, omega)) {
        (Some(rotor), Some(stator)) => in_series(rotor, stator),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => Complex::new(f64::NAN, f64::NAN),
    }
}

/// Damping against a steady difference of the surface speeds; `None` if a train cannot turn steadily.
fn steady(rotor: &Side, stator: &Side) -> Option<f64> {
    let ground = |side: &Side| side.speed.map(|_| side.viscous.iter().sum::<f64>());
    match (ground(rotor), ground(stator)) {
        (Some(a), Some(b)) if a > 0.0 && b > 0.0 => Some(a * b / (a + b)),
        (Some(_), Some(_)) => Some(0.0),
        (Some(one), None) | (None, Some(one)) => Some(one),
        (None, None) => None,
    }
}

impl ImpedanceCrossings {
    /// Crossings near and beyond the natural frequencies (rad/s). `creeps`: whether a steady difference of the surface
    /// speeds counts as growing, at omega = 0. In a train without drive, that motion is the sliding itself.
    pub(super) fn new(rotor: &Side, stator: &Side, natural: &[f64], creeps: bool) -> ImpedanceCrossings {
        let moving = || natural.iter().copied().filter(|&w| w > 0.0 && w.is_finite());
        let (least, most) = (moving().fold(f64::INFINITY, f64::min), moving().fold(0.0, f64::max));
        let (least, most) = if most > 0.0 { (least, most) } else { (1.0, 1.0) };
        let (from, to) = (least / BEYOND, most * BEYOND);
        let mut grid: Vec<f64> = (0..=POINTS)
            .map(|k| from * (to / from).powf(k as f64 / POINTS as f64))
            .collect();
        for omega in moving() {
            let near = (0..=NEAR).map(|k| 10f64.powf(-f64::from(k) / 4.0));
            grid.extend(near.flat_map(|share| [omega * (1.0 - share), omega * (1.0 + share)]));
        }
        grid.retain(|&omega| omega >= from);
        grid.sort_by(f64::total_cmp);
        grid.dedup();
        let impedance = |omega: f64| of_both(rotor, stator, omega);
        let mut found = Vec::new();
        let reactance: Vec<(f64, f64)> = grid.iter().map(|&omega| (omega, impedance(omega).im)).collect();
        let of_creep = steady(rotor, stator).filter(|_| creeps);
        if let (Some(resistance), Some(first)) = (of_creep, reactance.first()) {
            found.push(ImpedanceCrossing {
                resistance,
                angular_frequency: 0.0,
                change: if first.1 >= 0.0 { 1 } else { -1 },
            });
        }
        for pair in reactance.windows(2) {
            let (below, above) = (pair[0], pair[1]);
            let rises = above.1 > below.1;
            if !(below.1.is_finite() && above.1.is_finite()) || (below.1 < 0.0) == (above.1 < 0.0) {
                continue;
            }
            let size = below.1.abs().max(above.1.abs());
            let like_below = |omega: f64| (impedance(omega).im < 0.0) == (below.1 < 0.0);
            let ends = bisect(below.0, above.0, usize::MAX, like_below);
            let [first, second] = [ends.0, ends.1].map(|omega| (omega, impedance(omega)));
            // At an undamped resonance the reactance jumps; no resistance is left to cross.
            let nearest = if first.1.im.abs() <= second.1.im.abs() {
                first
            } else {
                second
            };
            if nearest.1.im.abs() <= size {
                found.push(ImpedanceCrossing {
                    resistance: nearest.1.re.max(0.0),
                    angular_frequency: nearest.0,
                    change: if rises { 2 } else { -2 },
                });
            }
        }
        found.retain(|crossing| crossing.resistance.is_finite());
        found.sort_by(|a, b| a.resistance.total_cmp(&b.resistance));
        ImpedanceCrossings(found)
    }

    pub(super) fn verdict(&self, kappa: f64) -> SlidingVerdict {
        let lost = -kappa;
        let near = |crossing: &ImpedanceCrossing| {
            (crossing.resistance - lost).abs() <= ROUNDING * crossing.resistance.max(lost)
        };
        let growing: i32 = self
            .0
            .iter()
            .filter(|crossing| crossing.resistance < lost && !near(crossing))
            .map(|crossing| crossing.change)
            .sum();
        match growing {
            1.. => SlidingVerdict::Unstable,
            _ if self.0.iter().any(near) => SlidingVerdict::Neutral,
            _ => SlidingVerdict::Stable,
        }
    }

    /// Angular frequency of the neutral motion with the contact damping nearest to `kappa`, rad/s.
    pub(super) fn frequency(&self, kappa: f64) -> Option<f64> {
        let away = |crossing: &&ImpedanceCrossing| (crossing.resistance + kappa).abs();
        let nearest = self.0.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map(|crossing| crossing.angular_frequency)
    }
}
