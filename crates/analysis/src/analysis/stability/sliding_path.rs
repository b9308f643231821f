//! Smooth (kick-free) sliding that slows down by itself: motion on the slow manifold. The only variable is the
//! momentum of the free train. If the motion is unstable, no solver of the full equations stays on the manifold.
//!
//! Where sliding changes too fast for a slow manifold, the free train moves as one rigid inertia.

use stickslip_engine::simulation::Excitation;
use stickslip_system::friction::{FrictionLaw, Law};
use stickslip_system::model::equations::{Driving, Outside, Side, SystemEquations};
use stickslip_system::model::margin::twice_resistance;
use stickslip_system::model::slow_manifold::{Momenta, Slip, SlowSeries, has_slow_manifold, slow_momenta};
use stickslip_system::model::stability::{Braking, fast_growth_rate};
use stickslip_system::model::system::System;
use stickslip_system::numerics::taylor;
use stickslip_system::record::State;

/// Time (s) and momentum of the free train (N m s). Friction of forward slip reduces the momentum.
pub(crate) type SlidingPoint = (f64, f64);

/// Taylor coefficients and rounds for a point of a path: exact to 1e-8 of the twists if friction changes within 12 ms.
const PATH_ORDER: usize = 6;
const PATH_ROUNDS: usize = 3;

/// Piece index for a friction law without knots.
const WHOLE: usize = usize::MAX;

/// Steps from the start to the stop for constant friction, and from one knot of the friction law to the next.
const STEPS: f64 = 300.0;
const PIECE_STEPS: f64 = 64.0;

/// Length of a path, in stopping times under the first friction torque.
const FARTHEST: f64 = 10.0;

/// Step back, as a fraction of the relative velocity, and of the change that alters friction by a factor of e.
const BACK_SHARE: (f64, f64) = (0.01, 0.02);

/// Change of the contact force in one step, as a fraction of the largest force.
const FORCE_SHARE: f64 = 0.05;

/// After this many steps, longer steps reach the end: an undamped contact rings for seconds.
const MOST_STEPS: usize = 20_000;

/// Terms of the path's series under a force that does not ring, and largest number of rounds of the slow manifold.
const TERMS: usize = 14;
const STEP_ROUNDS: usize = 12;

/// Error of a series step, as a fraction of the initial speed.
const STEP_ERROR: f64 = 1e-10;

/// Points on each of about twenty series steps.
const POINTS: usize = 16;

/// Most series steps before the classical method takes over.
const MOST_SERIES: usize = 200;

/// Largest ratio of the rates of steady sliding and of the twists for a path on the slow manifold. The stop is then
/// exact to 1e-9 s. Beyond it the manifold's series diverges, and two orders can differ by a factor of five in G.
const LARGEST_TIME_SCALE_RATIO: f64 = 0.04;

/// Relative distance within which a speed counts as a knot. Events at knots are located no better.
const AT_KNOT: f64 = 1e-9;

#[derive(Debug)]
pub(crate) struct Slowing {
    pub system: SystemEquations,
    pub excitation: Excitation,
    braking: Braking,
    /// Least angular frequency of an inertia on its shaft, rad/s.
    slowest_swing: f64,
}

impl Slowing {
    /// `None` if sliding does not slow down by itself, or an inertia lacks a spring.
    pub fn new(trains: &System) -> Option<Slowing> {
        let system = SystemEquations::new(trains);
        twice_resistance(trains).filter(|_| has_slow_manifold(&system))?;
        let own = |side: &Side| {
            (0..side.shafts())
                .map(|i| side.own_frequency(i))
                .fold(f64::INFINITY, f64::min)
        };
        Some(Slowing {
            slowest_swing: own(&system.rotor).min(own(&system.stator)),
            braking: Braking::new(&system)?,
            excitation: Excitation::new(trains),
            system,
        })
    }

    pub fn path(&self, sense: f64) -> SlidingPath<'_> {
        SlidingPath {
            of: self,
            sense,
            piece: WHOLE,
            rigid: false,
        }
    }

    pub fn force(&self, t: f64) -> f64 {
        self.excitation.normal_force(self.excitation.stretch(t), t).max(0.0)
    }

    pub fn inertia(&self) -> f64 {
        self.braking.inertia
    }

    /// Largest real part of the fast eigenvalues at `t` (s) and |omega_r| = `x` (rad/s), 1/s.
    pub fn rate(&self, t: f64, x: f64) -> f64 {
        self.rate_by(&self.system.law, t, x)
    }

    fn rate_by(&self, law: &FrictionLaw, t: f64, x: f64) -> f64 {
        let slope = law.coefficient_and_slope(x).1;
        fast_growth_rate(&self.system, self.system.radius * self.force(t) * slope)
    }

    fn free(&self) -> &Side {
        match self.system.rotor.speed {
            Some(_) => &self.system.rotor,
            None => &self.system.stator,
        }
    }

    fn momenta(&self, momentum: f64) -> Momenta {
        match self.system.rotor.speed {
            Some(_) => [momentum, 0.0],
            None => [0.0, -momentum],
        }
    }

    fn momentum(&self, y: &[f64]) -> f64 {
        let [rotor, stator] = slow_momenta(&self.system, &Outside::default(), y);
        rotor - stator
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct SlidingPath<'a> {
    of: &'a Slowing,
    sense: f64,
    /// Piece of a friction law with knots, extended smoothly beyond them; or [`WHOLE`].
    piece: usize,
    /// Whether the free train moves as one inertia.
    rigid: bool,
}

impl<'a> SlidingPath<'a> {
    /// Uses the momentum if the state has all speeds, otherwise the relative velocity.
    pub fn point(&self, time: f64, state: &State) -> SlidingPoint {
        let rotor = [state.theta_dot - state.rotor_twist_rate, state.theta_dot];
        let stator = [-state.phi1_dot];
        let free = self.of.free();
        let speeds = if free.sign > 0.0 { &rotor[..] } else { &stator[..] };
        if speeds.len() < free.inertia.len() {
            return self.point_of_speed(time, state.relative_velocity.abs());
        }
        (
            time,
            free.inertia
                .iter()
                .zip(speeds)
                .map(|(inertia, speed)| inertia * speed)
                .sum(),
        )
    }

    pub fn point_of_speed(&self, time: f64, speed: f64) -> SlidingPoint {
        let inertia = self.of.inertia();
        let mut momentum = self.sense * inertia * speed;
        // The twist rates contribute at most a fraction J/I, which each round improves; nothing without a slow
        // manifold.
        let rounds = if self.is_too_fast(time, speed) { 0 } else { 6 };
        for _ in 0..rounds {
            momentum += self.sense * inertia * (speed - self.speed((time, momentum)));
        }
        (time, momentum)
    }

    fn law(&self) -> &'a FrictionLaw {
        self.of.system.law_in(self.sense, self.piece)
    }

    fn pressing(&self, t: f64) -> [f64; 2] {
        let line = self.of.excitation.line(self.of.excitation.stretch(t), t);
        if line[0] > 0.0 { line } else { [0.0; 2] }
    }

    fn slow<const N: usize>(&self, (t, momentum): SlidingPoint, rounds: usize) -> SlowSeries<N> {
        let pressing = self.pressing(t);
        let slip = Slip::undriven(self.sense, self.piece, &pressing);
        SlowSeries::of_rounds(&self.of.system, &slip, self.of.momenta(momentum), rounds)
    }

    fn state(&self, point: SlidingPoint) -> Vec<f64> {
        self.slow::<PATH_ORDER>(point, PATH_ROUNDS).start(&self.of.system)
    }

    fn speed_of(&self, y: &[f64]) -> f64 {
        self.sense * self.of.system.relative_velocity(&Outside::default(), y)
    }

    /// Torque of friction and bearings on the free train, N m: the negative rate of its momentum.
    pub fn torque(&self, point: SlidingPoint) -> f64 {
        if self.rigid {
            return self.sense * self.of.inertia() * self.rigid_slowing(point.0, self.speed(point));
        }
        let y = self.state(point);
        let (system, free) = (&self.of.system, self.of.free());
        let force = self.pressing(point.0)[0];
        let friction = self.sense * self.law().coefficient(self.speed_of(&y)) * system.radius * force;
        if self.of.braking.viscous == 0.0 {
            return friction;
        }
        let speeds = free.speeds(&Driving::default(), &y);
        friction + free.sign * free.viscous.iter().zip(speeds).map(|(d, w)| d * w).sum::<f64>()
    }

    /// |omega_r|, rad/s; negative after the stop.
    pub fn speed(&self, point: SlidingPoint) -> f64 {
        if self.rigid {
            return self.sense * point.1 / self.of.inertia();
        }
        self.speed_of(&self.state(point))
    }

    pub fn growth(&self, point: SlidingPoint) -> f64 {
        self.rate(point.0, self.speed(point).max(0.0))
    }

    /// Runge-Kutta step of order 4 in either direction. At a fiftieth of the time scale it errs by 1e-9 of the change.
    pub(crate) fn advanced(&self, (t, momentum): SlidingPoint, step: f64) -> SlidingPoint {
        let fall = |t: f64, momentum: f64| -self.torque((t, momentum));
        let k1 = fall(t, momentum);
        let k2 = fall(t + step / 2.0, momentum + step / 2.0 * k1);
        let k3 = fall(t + step / 2.0, momentum + step / 2.0 * k2);
        let k4 = fall(t + step, momentum + step * k3);
        (t + step, momentum + step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0)
    }

    /// Adds (t, Re lambda) from `start`, where |omega_r| is `speed` (rad/s), by steps under any force: to the stop or
    /// time `until`, or back to an earlier `until`, latest first. A law with knots is followed piece by piece, because
    /// with the whole law a momentum near a knot could belong to two pieces.
    pub(crate) fn steps(mut self, rates: &mut Vec<(f64, f64)>, start: SlidingPoint, speed: f64, until: f64) {
        let (knots, back) = (self.law().knots(), until < start.0);
        let mut x = speed;
        if !knots.is_empty() {
            // At a knot, sliding continues on the lower piece, or backward on the upper piece.
            let beside = if back { 1.0 + AT_KNOT } else { 1.0 - AT_KNOT };
            self.piece = knots.partition_point(|knot| *knot < speed * beside);
            x = self.speed(start);
        }
        let mut corners = self.corners_between(start.0, until).into_iter().peekable();
        let mut point = start;
        loop {
            let knot = match back {
                true => knots.get(self.piece),
                false => self.piece.checked_sub(1).and_then(|below| knots.get(below)),
            };
            let edge = knot.copied().unwrap_or(if back { f64::INFINITY } else { 0.0 });
            let inside = |x: f64| if back { x < edge } else { x > edge };
            rates.push((point.0, self.rate(point.0, x)));
            let mut fall = self.fall_ahead(point, x, edge);
            while inside(x) {
                if self.rigid != self.is_too_fast(point.0, x) {
                    self.rigid = !self.rigid;
                    point = self.point_of_speed(point.0, x);
                    fall = self.fall_ahead(point, x, edge);
                }
                while corners
                    .next_if(|&c| if back { c >= point.0 } else { c <= point.0 })
                    .is_some()
                {}
                let target = corners.peek().copied().unwrap_or(until);
                let left = (until - point.0).abs();
                let fall = match back {
                    true => self.of.inertia() * self.fall_back(x, edge),
                    false => fall,
                };
                let mut step = self.longest_step(point.0, x, fall);
                if !back && self.piece == WHOLE {
                    step = step.min((until - start.0) / STEPS);
                }
                let least = if rates.len() > MOST_STEPS { left / STEPS } else { 0.0 };
                let mut next = self.toward(point, target, step.max(least));
                if next.0 == point.0 {
                    return;
                }
                let mut next_speed = self.speed(next);
                if !inside(next_speed) {
                    next = self.advanced(point, (x - edge) / (x - next_speed) * (next.0 - point.0));
                    next_speed = edge;
                }
                (point, x) = (next, next_speed);
                rates.push((point.0, self.rate(point.0, x)));
            }
            match (knot, back) {
                (None, _) => return,
                (Some(_), true) => self.piece += 1,
                (Some(_), false) => self.piece -= 1,
            }
            x = self.speed(point);
        }
    }

    /// Change of the momentum (N m s) in one step towards the stop, or towards the speed `edge` (rad/s) of a knot.
    fn fall_ahead(&self, point: SlidingPoint, x: f64, edge: f64) -> f64 {
        match self.piece {
            WHOLE => point.1.abs() / STEPS,
            _ => self.of.inertia() * (x - edge) / PIECE_STEPS,
        }
    }

    /// Largest change of speed from `x` in one step back on a piece that ends at `edge`, rad/s.
    fn fall_back(&self, x: f64, edge: f64) -> f64 {
        let (of_speed, of_friction) = BACK_SHARE;
        match self.piece {
            WHOLE => (of_speed * x).max(of_friction / self.law().steepness_rate(x)),
            _ => (of_speed * x).min((edge - x).max(x) / PIECE_STEPS),
        }
    }

    /// (t, Re lambda) from `start`, where |omega_r| is `speed` (rad/s), to the stop; without a stop at least to `end`.
    pub(crate) fn rates_to_stop(&self, start: SlidingPoint, speed: f64, end: f64) -> Vec<(f64, f64)> {
        let first = self.rigid_slowing(start.0, speed) * self.of.inertia();
        let end = if first > 0.0 {
            end.max(start.0 + FARTHEST * start.1.abs() / first)
        } else {
            end
        };
        let mut rates = vec![(start.0, self.rate(start.0, speed))];
        // A kick can briefly reverse the slip against the driving rotor. The reversal does not last.
        if self.sense * start.1 <= 0.0 {
            return rates;
        }
        let mut at = Some((start, speed));
        let smooth = self.law().knots().is_empty();
        if smooth && self.of.excitation.is_silent(start.0) && self.of.excitation.next_corner(start.0).is_none() {
            at = self.series_to_stop(&mut rates, start, speed, end);
        }
        if let Some((point, speed)) = at {
            self.steps(&mut rates, point, speed, end);
        }
        rates
    }

    /// Whether steady sliding is too fast for its slow manifold.
    fn is_too_fast(&self, t: f64, x: f64) -> bool {
        self.time_scale_ratio(t, x) > LARGEST_TIME_SCALE_RATIO
    }

    /// Ratio of the rates of steady sliding and of the twists
    /// ([`stickslip_system::model::stability::QuietStretch::time_scale_ratio`]). If sliding changes within less than
    /// one swing, each round of the manifold's series grows by the squared ratio of the two times, over two more
    /// rounds.
    fn time_scale_ratio(&self, t: f64, x: f64) -> f64 {
        let system = &self.of.system;
        let slope = -system.radius * self.pressing(t)[0] * self.law().coefficient_and_slope(x).1;
        let change = self.law().steepness_rate(x) * self.rigid_slowing(t, x);
        slope * system.compliance() * change * (change / self.of.slowest_swing).powi(4).max(1.0)
    }

    /// -d|omega_r|/dt of the rigid free train, rad/s^2.
    fn rigid_slowing(&self, t: f64, x: f64) -> f64 {
        let x = x.max(0.0);
        self.of
            .braking
            .slowing(self.law().coefficient(x), self.pressing(t)[0], x)
    }

    fn rate(&self, t: f64, x: f64) -> f64 {
        self.of.rate_by(self.law(), t, x)
    }

    /// Adds (t, Re lambda) after `start` by the series of the motion under a force that does not ring, to the stop or
    /// `end`. Otherwise returns the point and speed that the series reaches.
    fn series_to_stop(
        &self,
        rates: &mut Vec<(f64, f64)>,
        start: SlidingPoint,
        speed: f64,
        end: f64,
    ) -> Option<(SlidingPoint, f64)> {
        let error = STEP_ERROR * speed;
        let (mut point, mut speed) = (start, speed);
        for _ in 0..MOST_SERIES {
            let series = self.slow::<TERMS>(point, STEP_ROUNDS);
            let falling = series.relative_velocity().map(|w| self.sense * w);
            let by_term = |n: usize| (error / falling[n].abs()).powf(1.0 / n as f64);
            // The last two coefficients are unreliable.
            let reach = by_term(TERMS - 4).min(by_term(TERMS - 3));
            let length = reach.min(end - point.0);
            // The negated condition also ends at NaN; `min` would hide a NaN in `reach`.
            if !(self.time_scale_ratio(point.0, speed) < LARGEST_TIME_SCALE_RATIO && length > f64::EPSILON * point.0)
                || reach.is_nan()
            {
                break;
            }
            let part = length / POINTS as f64;
            for k in 1..=POINTS {
                let tau = part * k as f64;
                let (x, slope) = taylor::value_and_rate(&falling, tau);
                if x <= 0.0 {
                    // Newton's method from beyond the stop, on a nearly linear speed.
                    let stop = (0..4).fold(tau - x / slope, |stop, _| {
                        let (x, slope) = taylor::value_and_rate(&falling, stop);
                        stop - x / slope
                    });
                    let stop = point.0 + stop.clamp(tau - part, tau);
                    rates.push((stop, self.rate(stop, 0.0)));
                    return None;
                }
                rates.push((point.0 + tau, self.rate(point.0 + tau, x)));
            }
            let mut y = vec![0.0; self.of.system.dimension];
            series.states(&self.of.system, |index, series| {
                y[index] = taylor::value(series, length)
            });
            point = (point.0 + length, self.of.momentum(&y));
            speed = taylor::value(&falling, length);
            if point.0 >= end {
                return None;
            }
        }
        Some((point, speed))
    }

    fn corners_between(&self, from: f64, until: f64) -> Vec<f64> {
        let within = from.min(until)..from.max(until);
        let corners = self.of.excitation.corners().iter().copied();
        let mut corners: Vec<f64> = corners.filter(|c| within.contains(c)).collect();
        if until < from {
            corners.reverse();
        }
        corners
    }

    fn toward(&self, point: SlidingPoint, target: f64, size: f64) -> SlidingPoint {
        let way = target - point.0;
        if way.abs() <= size * (1.0 + 1e-9) {
            (target, self.advanced(point, way).1)
        } else {
            self.advanced(point, size.copysign(way))
        }
    }

    /// Longest step (s) at speed `x` (rad/s) within a change `fall` (N m s) of the momentum and [`FORCE_SHARE`].
    fn longest_step(&self, t: f64, x: f64, fall: f64) -> f64 {
        let excitation = &self.of.excitation;
        let change = FORCE_SHARE * excitation.largest_force();
        let [force, rate] = self.pressing(t);
        let slope = excitation.line(excitation.stretch(t), t)[1].abs();
        let curvature = excitation.curvature_bound(t);
        let still = rate == 0.0 && slope == 0.0 && curvature == 0.0;
        let by_force = if still {
            f64::INFINITY
        } else {
            // Root of slope tau + curvature tau^2 / 2 = change, without cancellation.
            2.0 * change / (slope + (slope * slope + 2.0 * curvature * change).sqrt())
        };
        let torque = match self.piece {
            WHOLE => {
                let most = self.law().coefficient_bounds(0.0, f64::INFINITY).most * self.of.system.radius;
                let pressing = if still { force } else { force + change };
                most * pressing + self.of.braking.viscous * x.abs()
            }
            // A piece has no bounds beyond its ends.
            _ => self.of.inertia() * self.rigid_slowing(t, x),
        };
        // NaN without friction: no bound.
        (fall / torque).min(by_force)
    }
}
