//! The mechanical impedance of two trains at their contact, and how much negative damping of the contact they bear.
//!
//! With T = kappa omega_r about steady sliding (kappa = r F_n dmu/dx for a law of friction) the motion exp(s t) exists where
//! Z(s) + kappa = 0, 1/Z = 1/Z_rotor + 1/Z_stator, and the impedance of a train follows from its far end inwards:
//!
//! ```text
//! Z_i = s J_i + d_i + (outer side of inertia i),   outer side = shaft and Z_(i+1) in series,   shaft = c + k/s.
//! ```
//!
//! Stability changes where s = i omega: at the zeros of Im Z(i omega), for kappa = -Re Z there. No matrix is involved, so that
//! for one grounded inertia the result is its damping to the last digit. As kappa falls through -Re Z, a pair of eigenvalues
//! goes right where Im Z rises with omega, and left where it falls. Without the contact's help the trains are passive: for
//! kappa >= 0 nothing grows.

use crate::model::equations::Side;
use nalgebra::Complex;
use serde::Serialize;

/// The share of the smallest and largest natural frequency over which zeros are sought.
const BEYOND: f64 = 1e4;
/// Points of that search, in equal ratios.
const POINTS: usize = 1200;
/// Around each natural frequency w points stand at w (1 +- 10^(-k/4)), for k up to this.
const NEAR: i32 = 40;
/// The rounding of a resistance, as a share of it.
const ROUNDING: f64 = 1e-14;

/// What becomes of a small disturbance of steady sliding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It dies out.
    Stable,
    /// It neither grows nor dies out, to first order.
    Neutral,
    /// It grows.
    Unstable,
}

impl Verdict {
    /// Whether it grows.
    pub fn is_unstable(self) -> bool {
        self == Verdict::Unstable
    }
}

/// Where the number of growing motions changes as the damping of the contact falls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// -kappa, N m s/rad, at least 0.
    pub resistance: f64,
    /// Of the motion that neither grows nor dies out there, rad/s; 0 where it does not oscillate.
    pub angular_frequency: f64,
    /// By how many the growing motions increase.
    change: i32,
}

/// All of them, by resistance.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Crossings(pub Vec<Crossing>);

fn in_series(a: Complex<f64>, b: Complex<f64>) -> Complex<f64> {
    a * b / (a + b)
}

/// Of one train at its surface; `None` for a surface that moves as it is told.
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

/// The damping that meets a steady difference of the surface speeds; `None` where a train cannot turn steadily otherwise.
fn steady(rotor: &Side, stator: &Side) -> Option<f64> {
    let ground = |side: &Side| side.speed.map(|_| side.viscous.iter().sum::<f64>());
    match (ground(rotor), ground(stator)) {
        (Some(a), Some(b)) if a > 0.0 && b > 0.0 => Some(a * b / (a + b)),
        (Some(_), Some(_)) => Some(0.0),
        (Some(one), None) | (None, Some(one)) => Some(one),
        (None, None) => None,
    }
}

impl Crossings {
    /// Of two trains with these natural frequencies (rad/s), about which zeros are sought most closely. Whether a steady difference of
    /// the surface speeds may grow, at omega = 0, `creeps` says: of a train that nothing drives it is sliding itself, and no
    /// disturbance of it.
    pub(super) fn new(rotor: &Side, stator: &Side, natural: &[f64], creeps: bool) -> Crossings {
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
            found.push(Crossing {
                resistance,
                angular_frequency: 0.0,
                change: if first.1 >= 0.0 { 1 } else { -1 },
            });
        }
        for pair in reactance.windows(2) {
            let (mut below, mut above) = (pair[0], pair[1]);
            let rises = above.1 > below.1;
            if !(below.1.is_finite() && above.1.is_finite()) || (below.1 < 0.0) == (above.1 < 0.0) {
                continue;
            }
            let size = below.1.abs().max(above.1.abs());
            loop {
                let middle = 0.5 * (below.0 + above.0);
                if middle <= below.0 || middle >= above.0 {
                    break;
                }
                let at = (middle, impedance(middle).im);
                if (at.1 < 0.0) == (pair[0].1 < 0.0) {
                    below = at;
                } else {
                    above = at;
                }
            }
            // At a resonance without damping the reactance jumps instead, and no resistance is left to cross.
            let nearest = if below.1.abs() <= above.1.abs() { below } else { above };
            if nearest.1.abs() <= size {
                found.push(Crossing {
                    resistance: impedance(nearest.0).re.max(0.0),
                    angular_frequency: nearest.0,
                    change: if rises { 2 } else { -2 },
                });
            }
        }
        found.retain(|crossing| crossing.resistance.is_finite());
        found.sort_by(|a, b| a.resistance.total_cmp(&b.resistance));
        Crossings(found)
    }

    /// Of a contact with the damping kappa (N m s/rad).
    pub(super) fn verdict(&self, kappa: f64) -> Verdict {
        let lost = -kappa;
        let near = |crossing: &Crossing| (crossing.resistance - lost).abs() <= ROUNDING * crossing.resistance.max(lost);
        let growing: i32 = self
            .0
            .iter()
            .filter(|crossing| crossing.resistance < lost && !near(crossing))
            .map(|crossing| crossing.change)
            .sum();
        match growing {
            1.. => Verdict::Unstable,
            _ if self.0.iter().any(near) => Verdict::Neutral,
            _ => Verdict::Stable,
        }
    }

    /// Of the motion that neither grows nor dies out nearest to a damping of the contact, rad/s.
    pub(super) fn frequency(&self, kappa: f64) -> Option<f64> {
        let away = |crossing: &&Crossing| (crossing.resistance + kappa).abs();
        let nearest = self.0.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
        nearest.map(|crossing| crossing.angular_frequency)
    }
}
