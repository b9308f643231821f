//! Smooth (kick-free) sliding that slows down by itself: the motion on the slow manifold, whose one variable is the momentum of the
//! free train. No solver of the full equations stays on it where it is unstable.

use super::growth_rate::fast_growth_rate;
use crate::friction::{FrictionLaw, Law};
use crate::model::equations::{Driving, Outside, Side, SystemEquations};
use crate::model::margin::twice_resistance;
use crate::model::slow_manifold::{Momenta, Slip, SlowSeries, has_slow_manifold, slow_momenta};
use crate::model::stability::Braking;
use crate::model::system::System;
use crate::numerics::taylor;
use crate::record::State;
use crate::simulation::Excitation;

/// (time, s; momentum of the free train, N m s, which friction of forward slip takes away).
pub(crate) type Point = (f64, f64);

/// Taylor coefficients and rounds of the slow manifold for a point of the path, of which there are thousands: good to 1e-8 of the
/// twists where the friction changes over 12 ms.
const PATH_ORDER: usize = 6;
const PATH_ROUNDS: usize = 3;

/// The friction law as a whole, in the place of one of its pieces.
const WHOLE: usize = usize::MAX;

/// Steps from the start to the stop, if friction goes on as it begins.
const STEPS: f64 = 300.0;

/// The path is followed for this many times what its first friction torque would take to stop it.
const FARTHEST: f64 = 10.0;

/// Share of the relative velocity, and of what changes the friction by a factor of e, that one step back takes.
const BACK_SHARE: (f64, f64) = (0.01, 0.02);

/// Share of the largest force by which the contact force changes in one step.
const FORCE_SHARE: f64 = 0.05;

/// After so many steps, as where the contact rings undamped for seconds, they are made long enough to come to the end.
const MOST_STEPS: usize = 20_000;

/// Coefficients of the path's series, under a force that does not ring, and most rounds of the slow manifold for them.
const TERMS: usize = 14;
const STEP_ROUNDS: usize = 12;

/// Error of a step of that series, as a share of the speed at the start.
const STEP_ERROR: f64 = 1e-10;

/// Points on each of its steps, of which there are some twenty.
const POINTS: usize = 16;

/// More of its steps than these are left to the classical method.
const MOST_SERIES: usize = 200;

/// How fast steady sliding may change against how fast the twists follow it for a path along the slow manifold, which
/// then gives a stop to 1e-9 s. Beyond, the manifold's series diverges, and two of its orders may differ by a factor of
/// five in G.
const LARGEST_TIME_SCALE_RATIO: f64 = 0.04;

/// Steps on each piece of a friction law with knots.
const PIECE_STEPS: f64 = 64.0;

/// A speed this close to a knot, as a share of it, is the knot's: an event there is located no better.
const AT_KNOT: f64 = 1e-9;

/// Where a path on one piece of the friction law ends.
enum PieceEnd {
    /// At the end of the piece.
    Left(Point),
    /// At this time (s) and speed (rad/s), where steady sliding changes too fast for its slow manifold.
    TooFast(f64, f64),
    /// As far as it was asked for.
    Over,
}

/// A system whose sliding slows down by itself, with the force that presses.
#[derive(Debug)]
pub(crate) struct Slowing {
    /// The equations.
    pub system: SystemEquations,
    /// The force.
    pub excitation: Excitation,
    braking: Braking,
    /// The least angular frequency of an inertia on its shaft, rad/s.
    slowest_swing: f64,
}

impl Slowing {
    /// `None` of a system whose sliding does not slow down by itself, or that a spring does not hold everywhere.
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

    /// Smooth sliding with this sign of omega_r.
    pub fn path(&self, sense: f64) -> SmoothSliding<'_> {
        SmoothSliding {
            of: self,
            sense,
            piece: WHOLE,
        }
    }

    /// F_n, N; 0 of an open contact.
    pub fn force(&self, t: f64) -> f64 {
        self.excitation.normal_force(self.excitation.stretch(t), t).max(0.0)
    }

    /// The inertia of the free train as one, kg m^2.
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

    /// The momenta of the two trains, of which one is free with this one.
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

/// Smooth sliding with one sense.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SmoothSliding<'a> {
    of: &'a Slowing,
    /// Sign of omega_r.
    sense: f64,
    /// The piece of a friction law with knots, gone on with smoothly beyond them; or [`WHOLE`].
    piece: usize,
}

impl SmoothSliding<'_> {
    /// The point of a state at `time` (s): by its momentum where the columns of a state have the speed of each inertia of the free
    /// train, else by its relative velocity.
    pub fn point(&self, time: f64, state: &State) -> Point {
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

    /// The point at `time` (s) with this |omega_r| (rad/s).
    pub fn point_of_speed(&self, time: f64, speed: f64) -> Point {
        let inertia = self.of.inertia();
        let mut momentum = self.sense * inertia * speed;
        // The twists' rates take a share of J/I or less: each round gains as much. Without a slow manifold they mean nothing.
        let rounds = if self.time_scale_ratio(time, speed) > LARGEST_TIME_SCALE_RATIO {
            0
        } else {
            6
        };
        for _ in 0..rounds {
            momentum += self.sense * inertia * (speed - self.speed((time, momentum)));
        }
        (time, momentum)
    }

    fn law(&self) -> &FrictionLaw {
        self.of.system.law_in(self.piece)
    }

    /// F_n (N) and its rate (N/s).
    fn pressing(&self, t: f64) -> [f64; 2] {
        let line = self.of.excitation.line(self.of.excitation.stretch(t), t);
        if line[0] > 0.0 { line } else { [0.0; 2] }
    }

    fn slow<const N: usize>(&self, (t, momentum): Point, rounds: usize) -> SlowSeries<N> {
        let pressing = self.pressing(t);
        let slip = Slip::undriven(self.sense, self.piece, &pressing);
        SlowSeries::of_rounds(&self.of.system, &slip, self.of.momenta(momentum), rounds)
    }

    fn state(&self, point: Point) -> Vec<f64> {
        self.slow::<PATH_ORDER>(point, PATH_ROUNDS).start(&self.of.system)
    }

    fn speed_of(&self, y: &[f64]) -> f64 {
        self.sense * self.of.system.relative_velocity(&Outside::default(), y)
    }

    /// Of friction and of the bearings, on the free train, N m: minus the rate of its momentum.
    pub fn torque(&self, point: Point) -> f64 {
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

    /// |omega_r|, rad/s; negative beyond the stop.
    pub fn speed(&self, point: Point) -> f64 {
        self.speed_of(&self.state(point))
    }

    /// Largest real part of the fast eigenvalues, 1/s.
    pub fn growth(&self, point: Point) -> f64 {
        self.rate(point.0, self.speed(point).max(0.0))
    }

    /// One step, forward or back, of the classical method of order 4: at a fiftieth of the time scale its error is 1e-9
    /// of the change.
    pub(crate) fn advanced(&self, (t, momentum): Point, step: f64) -> Point {
        let fall = |t: f64, momentum: f64| -self.torque((t, momentum));
        let k1 = fall(t, momentum);
        let k2 = fall(t + step / 2.0, momentum + step / 2.0 * k1);
        let k3 = fall(t + step / 2.0, momentum + step / 2.0 * k2);
        let k4 = fall(t + step, momentum + step * k3);
        (t + step, momentum + step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0)
    }

    /// (t, Re lambda) on the way back from `start`, where |omega_r| is `start_speed` (rad/s), excluded, to the time
    /// `until`; the latest first.
    pub(crate) fn rates_before(&self, start: Point, start_speed: f64, until: f64) -> Vec<(f64, f64)> {
        let inertia = self.of.inertia();
        let mut corners = self.corners_between(start.0, until).into_iter().peekable();
        let (mut point, mut rates) = (start, Vec::new());
        if self.time_scale_ratio(start.0, start_speed) > LARGEST_TIME_SCALE_RATIO {
            let (time, speed) = self.rigid(&mut rates, start.0, start_speed, until);
            if time <= until {
                return rates;
            }
            point = self.point_of_speed(time, speed);
        }
        if !self.law().knots().is_empty() {
            let speed = if rates.is_empty() {
                start_speed
            } else {
                self.speed(point)
            };
            self.by_pieces(&mut rates, point, speed, until);
            return rates;
        }
        while point.0 > until {
            while corners.next_if(|&c| c >= point.0).is_some() {}
            let target = corners.peek().copied().unwrap_or(until).max(until);
            let speed = self.speed(point);
            let fall = self.fall_back(speed);
            let least = least_step(rates.len(), point.0 - until);
            point = self.toward(
                point,
                target,
                self.longest_step(point.0, speed, inertia * fall).max(least),
            );
            rates.push((point.0, self.growth(point)));
        }
        rates
    }

    /// By how much the speed may change from `x` in one step back, rad/s.
    fn fall_back(&self, x: f64) -> f64 {
        let (of_speed, of_friction) = BACK_SHARE;
        (of_speed * x).max(of_friction / self.law().steepness_rate(x))
    }

    /// Adds (t, Re lambda) from `time`, excluded, with the free train as one inertia, slowed by steady friction: on to the stop or
    /// `until`, or back to `until` or to where steady sliding is slow against its twists. Returns the time and the speed there. On, it
    /// is what sliding without the fast mode comes to where nothing is slow against that mode.
    fn rigid(&self, rates: &mut Vec<(f64, f64)>, time: f64, speed: f64, until: f64) -> (f64, f64) {
        let (inertia, back) = (self.of.inertia(), until < time);
        let way = if back { -1.0 } else { 1.0 };
        let goes_on = |t: f64, x: f64| match back {
            true => t > until && self.time_scale_ratio(t, x) > LARGEST_TIME_SCALE_RATIO,
            false => t < until && x > 0.0,
        };
        let (mut t, mut x) = (time, speed);
        while goes_on(t, x) {
            let left = (until - t).abs();
            let fall = if back {
                inertia * self.fall_back(x)
            } else {
                inertia * speed / STEPS
            };
            let step = self
                .longest_step(t, x, fall)
                .max(least_step(rates.len(), left))
                .min(left);
            if t + way * step == t {
                break;
            }
            let middle = x - 0.5 * way * step * self.rigid_slowing(t, x);
            let drop = way * step * self.rigid_slowing(t + 0.5 * way * step, middle);
            // The last step ends at the stop.
            let part = if drop > x { x / drop } else { 1.0 };
            (t, x) = (t + part * way * step, (x - drop).max(0.0));
            rates.push((t, self.rate(t, x)));
        }
        (t, x)
    }

    /// (t, Re lambda) from `start`, where |omega_r| is `speed` (rad/s), to the stop, whose time is then that of the last; to
    /// `end` at least, if there is none.
    pub(crate) fn rates_to_stop(&self, start: Point, speed: f64, end: f64) -> Vec<(f64, f64)> {
        let first = self.rigid_slowing(start.0, speed) * self.of.inertia();
        let end = if first > 0.0 {
            end.max(start.0 + FARTHEST * start.1.abs() / first)
        } else {
            end
        };
        let mut rates = vec![(start.0, self.rate(start.0, speed))];
        // A kick may turn the slip, for a moment, against the rotor that drives it: that is no sliding that goes on.
        if self.sense * start.1 <= 0.0 {
            return rates;
        }
        if !self.law().knots().is_empty() {
            self.by_pieces(&mut rates, start, speed, end);
            return rates;
        }
        let mut at = Some((start, speed));
        if self.of.excitation.is_silent(start.0) && self.of.excitation.next_corner(start.0).is_none() {
            at = self.series_to_stop(&mut rates, start, speed, end);
        }
        if let Some((point, speed)) = at
            && let Some((time, speed)) = self.steps_to_stop(&mut rates, point, speed, end)
        {
            self.rigid(&mut rates, time, speed, end);
        }
        rates
    }

    /// How fast steady sliding changes against how fast the twists follow it
    /// ([`crate::model::stability::QuietStretch::time_scale_ratio`]). Where it changes within less than a swing, each round of
    /// the slow manifold's series is larger than the one before by the square of their ratio; a point of the path has two more rounds.
    fn time_scale_ratio(&self, t: f64, x: f64) -> f64 {
        let system = &self.of.system;
        let slope = -system.radius * self.pressing(t)[0] * self.law().coefficient_and_slope(x).1;
        let change = self.law().steepness_rate(x) * self.rigid_slowing(t, x);
        slope * system.compliance() * change * (change / self.of.slowest_swing).powi(4).max(1.0)
    }

    /// -d|omega_r|/dt of the free train as one inertia, rad/s^2.
    fn rigid_slowing(&self, t: f64, x: f64) -> f64 {
        let x = x.max(0.0);
        self.of
            .braking
            .slowing(self.law().coefficient(x), self.pressing(t)[0], x)
    }

    /// Adds (t, Re lambda) from `start`, excluded, on, by steps under any force: to the stop or `end`, or else to the time
    /// and the speed that are returned, where steady sliding changes too fast for its slow manifold.
    fn steps_to_stop(&self, rates: &mut Vec<(f64, f64)>, start: Point, speed: f64, end: f64) -> Option<(f64, f64)> {
        let fall = start.1.abs() / STEPS;
        let mut corners = self.corners_between(start.0, end).into_iter().peekable();
        let (mut point, mut x) = (start, speed);
        while point.0 < end && x > 0.0 {
            if self.time_scale_ratio(point.0, x) > LARGEST_TIME_SCALE_RATIO {
                return Some((point.0, x));
            }
            while corners.next_if(|&c| c <= point.0).is_some() {}
            let target = corners.peek().copied().unwrap_or(end);
            let least = least_step(rates.len(), end - point.0);
            let step = self
                .longest_step(point.0, x, fall)
                .min((end - start.0) / STEPS)
                .max(least);
            let next = self.toward(point, target, step);
            if next.0 <= point.0 {
                break;
            }
            let speed = self.speed(next);
            // The last step ends at the stop.
            let part = if speed < 0.0 { x / (x - speed) } else { 1.0 };
            point = (point.0 + part * (next.0 - point.0), next.1);
            x = speed.max(0.0);
            rates.push((point.0, self.rate(point.0, x)));
        }
        None
    }

    fn rate(&self, t: f64, x: f64) -> f64 {
        self.of.rate_by(self.law(), t, x)
    }

    /// Adds (t, Re lambda) from `start`, excluded, on, under a force that does not ring, by the series of the motion: to
    /// the stop or `end`, or else to the point and the speed that are returned, where these reach no further.
    fn series_to_stop(&self, rates: &mut Vec<(f64, f64)>, start: Point, speed: f64, end: f64) -> Option<(Point, f64)> {
        let error = STEP_ERROR * speed;
        let (mut point, mut speed) = (start, speed);
        for _ in 0..MOST_SERIES {
            let series = self.slow::<TERMS>(point, STEP_ROUNDS);
            let falling = series.relative_velocity().map(|w| self.sense * w);
            let by_term = |n: usize| (error / falling[n].abs()).powf(1.0 / n as f64);
            // The last two coefficients are not to be trusted.
            let reach = by_term(TERMS - 4).min(by_term(TERMS - 3));
            let length = reach.min(end - point.0);
            // Written so that what is not a number ends it, too; `min` would hide such a reach.
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
                    // Newton's method from beyond, on a speed that falls nearly straight.
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

    /// Adds (t, Re lambda) from `start`, where |omega_r| is `speed` (rad/s), piece by piece: to the stop or to the time `until`, or back
    /// to an earlier one, the latest first. On the law itself the speed of a momentum near a knot would be that of the one piece or of
    /// the other.
    fn by_pieces(&self, rates: &mut Vec<(f64, f64)>, start: Point, speed: f64, until: f64) {
        let (knots, back) = (self.law().knots(), until < start.0);
        // At a knot the piece below it, as sliding slows down; on the way back the one above, from which it came.
        let beside = if back { 1.0 + AT_KNOT } else { 1.0 - AT_KNOT };
        let mut piece = knots.partition_point(|knot| *knot < speed * beside);
        let mut point = start;
        loop {
            let path = SmoothSliding { piece, ..*self };
            // The last piece has no end.
            let (next, edge) = match back {
                true => (Some(piece + 1).filter(|next| *next <= knots.len()), knots.get(piece)),
                false => (piece.checked_sub(1), piece.checked_sub(1).map(|below| &knots[below])),
            };
            let edge = edge.copied().unwrap_or(if back { f64::INFINITY } else { 0.0 });
            match (path.steps_on_piece(rates, point, edge, until), next) {
                (PieceEnd::Left(left), Some(next)) => (point, piece) = (left, next),
                (PieceEnd::TooFast(time, speed), _) => {
                    self.rigid(rates, time, speed, until);
                    return;
                }
                _ => return,
            }
        }
    }

    /// Adds (t, Re lambda) from `start` to where the speed comes to `edge` (rad/s) or to the time `until`: on, the speed falling,
    /// or back, the speed rising.
    fn steps_on_piece(&self, rates: &mut Vec<(f64, f64)>, start: Point, edge: f64, until: f64) -> PieceEnd {
        let back = until < start.0;
        let inside = |x: f64| if back { x < edge } else { x > edge };
        let (mut point, mut x) = (start, self.speed(start));
        let part_of_piece = (x - edge) / PIECE_STEPS;
        let mut corners = self.corners_between(start.0, until).into_iter().peekable();
        rates.push((point.0, self.rate(point.0, x)));
        while point.0 != until && inside(x) {
            if !back && self.time_scale_ratio(point.0, x) > LARGEST_TIME_SCALE_RATIO {
                return PieceEnd::TooFast(point.0, x);
            }
            while corners.next_if_eq(&point.0).is_some() {}
            let target = corners.peek().copied().unwrap_or(until);
            let fall = match back {
                true => (BACK_SHARE.0 * x).min((edge - x).max(x) / PIECE_STEPS),
                false => part_of_piece,
            };
            let next = self.piece_step(rates.len(), point, target, fall, x);
            if next.0 == point.0 {
                return PieceEnd::Over;
            }
            let speed = self.speed(next);
            if !inside(speed) {
                let last = self.advanced(point, (x - edge) / (x - speed) * (next.0 - point.0));
                rates.push((last.0, self.rate(last.0, edge)));
                return PieceEnd::Left(last);
            }
            (point, x) = (next, speed);
            rates.push((point.0, self.rate(point.0, x)));
        }
        match inside(x) {
            true => PieceEnd::Over,
            false => PieceEnd::Left(point),
        }
    }

    /// The corners of the force from the time `from` to `until` (s), in the order in which a path that way comes to them.
    fn corners_between(&self, from: f64, until: f64) -> Vec<f64> {
        let within = from.min(until)..from.max(until);
        let corners = self.of.excitation.corners().iter().copied();
        let mut corners: Vec<f64> = corners.filter(|c| within.contains(c)).collect();
        if until < from {
            corners.reverse();
        }
        corners
    }

    /// A step from a point at the speed `x` (rad/s) toward the time `target`, over which the speed changes by about `fall` (rad/s),
    /// and the force by its share.
    fn piece_step(&self, taken: usize, point: Point, target: f64, fall: f64, x: f64) -> Point {
        let by_force = self.longest_step(point.0, x, f64::INFINITY);
        let least = least_step(taken, (target - point.0).abs());
        let slowing = self.rigid_slowing(point.0, x);
        // Not a number without friction, and no bound then.
        self.toward(point, target, (fall / slowing).min(by_force).max(least))
    }

    /// A step of at most `size` that ends at `target` at the latest, and at `target` itself if it comes so far.
    fn toward(&self, point: Point, target: f64, size: f64) -> Point {
        let way = target - point.0;
        if way.abs() <= size * (1.0 + 1e-9) {
            (target, self.advanced(point, way).1)
        } else {
            self.advanced(point, size.copysign(way))
        }
    }

    /// The step over which the momentum changes by `fall` (N m s) at most, from the speed `x` (rad/s) on, and the contact force by its
    /// share.
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
        let coefficient = self.law().coefficient_bounds(0.0, f64::INFINITY);
        let most = coefficient.most * self.of.system.radius;
        let pressing = if still { force } else { force + change };
        (fall / (most * pressing + self.of.braking.viscous * x.abs())).min(by_force)
    }
}

/// What a step has to be at least after `taken` others, with `left` (s) to go.
fn least_step(taken: usize, left: f64) -> f64 {
    if taken > MOST_STEPS { left / STEPS } else { 0.0 }
}
