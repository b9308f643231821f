//! The loss of stability of steady sliding, foreseen.

use super::axial::AxialMotion;
use super::torsion::TorsionModel;
use crate::friction::Law;

/// No step is shorter than this part of the speed at the start, however steep the friction law.
const FINEST: f64 = 20_000.0;

/// Share of the friction law's speed scale that one step may take.
const SHARE_OF_SCALE: f64 = 0.05;

/// More steps are not taken: 1000 are usual.
const MOST_STEPS: usize = 100_000;

/// Rigid sliding ahead of a given instant: the rotor and its surface as one inertia, slowed by quasi-steady friction.
/// It leaves out the twists (relative error about J/I and omega_r / omega_n), which is enough to decide ahead of time
/// where an integrator has to resolve the fast mode; it never enters a result.
#[derive(Debug, Clone)]
pub(crate) struct Forecast {
    /// (t (s), damping in e-folds of the relative mode since the start).
    path: Vec<(f64, f64)>,
    /// (t (s), |omega_r| (rad/s)) at the same times.
    speeds: Vec<(f64, f64)>,
    /// When sliding turns unstable, or the relative velocity reaches zero, whichever comes first, s.
    pub instability: Option<f64>,
}

impl Forecast {
    /// Of the slip at `t` (s) with this relative velocity (rad/s), as far as `until` (s).
    pub fn new(model: &TorsionModel, axial: &AxialMotion, t: f64, relative_velocity: f64, until: f64) -> Self {
        let sense = if relative_velocity < 0.0 { -1.0 } else { 1.0 };
        let inertia = model.torsion.rigid_inertia();
        let surface = model.torsion.surface_inertia;
        let radius = model.contact.radius;
        let slowing =
            |t: f64, x: f64| model.friction.law.coefficient(x) * radius * axial.force.value(t).max(0.0) / inertia;
        let margin = |t: f64, x: f64| model.stability_margin(1.0, x, axial.force.value(t).max(0.0));
        let (mut t, mut x, mut damping) = (t, sense * relative_velocity, 0.0);
        let mut path = vec![(t, damping)];
        let mut speeds = vec![(t, x)];
        let mut instability = None;
        let coarsest = ((until - t) / 200.0).max(f64::MIN_POSITIVE);
        let finest = x / FINEST;
        while t < until {
            let here = margin(t, x);
            // A force so steep that the path does not get on counts as instability, too: steps are then resolved.
            if here < 0.0 || x <= 0.0 || path.len() > MOST_STEPS {
                instability = Some(t);
                break;
            }
            let rate = slowing(t, x);
            let corner = axial.force.next_corner(t).unwrap_or(f64::INFINITY);
            let mut step = coarsest.min(until - t);
            if t + step > corner {
                step = corner - t;
            }
            // Resolve the fall of the speed and, where it matters, the change of friction.
            let followed = model.friction.law.followed_fall(x, SHARE_OF_SCALE);
            let fall = (0.02 * x + 1e-6).min(followed).max(finest);
            let ahead = slowing(t + step, (x - fall).max(0.0)).max(rate);
            if ahead * step > fall {
                step = fall / ahead;
            }
            if t + step <= t {
                instability = Some(t);
                break;
            }
            let middle = slowing(t + step / 2.0, x - rate * step / 2.0);
            x -= middle * step;
            t += step;
            damping += here / (2.0 * surface) * step;
            path.push((t, damping));
            speeds.push((t, x));
        }
        Forecast {
            path,
            speeds,
            instability,
        }
    }

    /// The latest time before which `e_folds` of damping still lie ahead of the instability; `None` without one.
    pub(crate) fn last_quiet_time(&self, e_folds: f64) -> Option<f64> {
        self.instability?;
        let last = self.path.last()?.1 - e_folds;
        let quiet = self.path.windows(2).rev().find(|pair| pair[0].1 <= last);
        Some(quiet.map_or(self.path[0].0, |pair| between(pair, last)))
    }

    /// The first time at which the relative velocity is no more than `speed` (rad/s), if it comes to that.
    pub(crate) fn time_of_speed(&self, speed: f64) -> Option<f64> {
        self.speeds.iter().find(|(_, x)| *x <= speed).map(|(t, _)| *t)
    }

    /// The time by which `e_folds` of damping have passed since the start, if that comes before any instability.
    pub(crate) fn time_of_damping(&self, e_folds: f64) -> Option<f64> {
        let passed = self.path.windows(2).find(|pair| pair[1].1 >= e_folds);
        passed.map(|pair| between(pair, e_folds))
    }
}

/// When the damping takes a value between those of two points.
fn between(pair: &[(f64, f64)], damping: f64) -> f64 {
    let ((t, before), (end, after)) = (pair[0], pair[1]);
    if after > before {
        t + (end - t) * ((damping - before) / (after - before)).clamp(0.0, 1.0)
    } else {
        t
    }
}

/// How long a slip is far from unstable, and what instability can come to after that: bounds, from the start alone.
///
/// They rest on rigid sliding like [`Forecast`], with the friction torque between its bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct QuietStretch {
    /// Until then the margin of stability is at least c_t/2, s.
    pub until: f64,
    /// The relative mode's damping until then, 1/s, at least.
    pub damping: f64,
    /// E-folds that a perturbation can gain between the loss of stability and the stop, at most.
    pub growth: f64,
    /// How fast steady sliding changes against how fast the twists follow it, at most: the rate at which the slope of the
    /// friction changes over the rate k_t/c of a disk with the slope of the friction torque as its damping. The slow
    /// manifold is there to all digits while this is small.
    pub time_scale_ratio: f64,
}

impl QuietStretch {
    /// Of the slip at `t` with this relative velocity (rad/s).
    pub fn new(model: &TorsionModel, axial: &AxialMotion, t: f64, relative_velocity: f64) -> Self {
        let (torsion, law) = (&model.torsion, &model.friction.law);
        let inertia = torsion.rigid_inertia();
        let (least, most) = (
            axial.lowest_pressing_force_after(t).max(0.0),
            axial.highest_pressing_force_after(t).max(0.0),
        );
        let weight = model.slope_weight(most);
        let coefficient = law.bounds_below(relative_velocity.abs());
        // -2 r F_n mu', the most that falling friction takes from the margin
        let negative_damping = -weight * law.slope_bounds(0.0, f64::INFINITY).least;
        // Below this speed the margin may be less than c_t (1 - part).
        let critical = |part: f64| law.damped_from(part * torsion.damping, weight);
        let slowing = |mu: f64, force: f64| mu * model.contact.radius * force / inertia;
        let fastest = slowing(coefficient.most, most);
        let half = critical(0.5);
        let until = if half > 0.0 {
            t + 0.9 * (relative_velocity.abs() - half) / fastest
        } else {
            f64::INFINITY
        };
        let unstable = critical(1.0);
        let growth = if unstable > 0.0 {
            let slowest = slowing(coefficient.least, least);
            // A real pair grows at most twice as fast as its mean.
            1.2 * (negative_damping - torsion.damping) / torsion.surface_inertia * unstable / slowest
        } else {
            0.0
        };
        QuietStretch {
            until,
            damping: torsion.damping / (4.0 * torsion.surface_inertia),
            growth,
            time_scale_ratio: negative_damping / torsion.stiffness * law.steepness_rate(0.0) * fastest,
        }
    }
}
