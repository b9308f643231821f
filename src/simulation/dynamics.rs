//! A system for the automaton: its locations, guards and smooth equations.

use super::excitation::{Excitation, OutsideSeries};
use crate::friction::Law;
use crate::hybrid::{Direction, Dynamics, Guard};
use crate::model::chain_coordinates::{ChainCoordinates, HALF_WIDTH};
use crate::model::closed_form;
use crate::model::equations::{Engagement, Outside, Side, SystemEquations};
use crate::model::slow_motion::{SlowMotion, SlowMotions};
use crate::model::stability::least_fast_frequency;
use crate::model::system::{Smoothing, System};
use crate::model::{BreakawayTest, Mode};
use crate::numerics::band::BandMut;
use crate::numerics::eigenvalues::eigenvalues;
use nalgebra::{DMatrix, DMatrixViewMut};
use std::f64::consts::TAU;
use std::sync::OnceLock;

/// Whether the stability of steady sliding is watched: it is until the first stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Watch {
    /// Sliding is stable; its loss is an event.
    Stable,
    /// Sliding is unstable; its return is an event.
    Unstable,
    /// After the first stick: crossings are part of each slip and no events.
    Off,
}

/// The discrete state of the system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SystemLocation {
    /// What the contact does.
    pub mode: Mode,
    /// Sign of omega_r in slip, or of the side of rest on which an engaged contact is: +1 or -1; 0 in stick and separation.
    pub sense: i8,
    /// Between which knots of the friction law the sliding speed is: above so many of them.
    pub piece: usize,
    /// Between which corners of the signals the time is.
    pub stretch: usize,
    /// Of an engaged contact, whether |omega_r| is below the threshold that counts as a stick.
    pub slow: bool,
    /// Which zeros of the margin of steady sliding are events.
    pub watch: Watch,
    /// Whether steps have to resolve the fast modes, because they are excited or unstable.
    pub resolved: bool,
}

impl SystemLocation {
    /// A mode in a stretch of the signals, on the first piece of the law; every mode is resolved, and the margin is not watched.
    pub fn new(mode: Mode, stretch: usize) -> SystemLocation {
        SystemLocation {
            mode,
            sense: mode.sense(),
            piece: 0,
            stretch,
            slow: false,
            watch: Watch::Off,
            resolved: true,
        }
    }

    /// As a number.
    pub fn sign(&self) -> f64 {
        f64::from(self.sense)
    }
}

/// The equations with all signals, shared by the solvers of a run.
#[derive(Debug)]
pub struct SystemDynamics {
    /// The equations.
    pub system: SystemEquations,
    /// The signals.
    pub excitation: Excitation,
    /// |omega_r| (rad/s) below which an engaged contact counts as stuck.
    pub threshold: f64,
    pub(super) rates: Rates,
    /// Stick and separation in closed form.
    pub(super) closed_form: closed_form::ClosedForm,
    /// Both without their fast modes.
    slow_motions: SlowMotions,
    /// Of long trains.
    chain: OnceLock<Option<ChainCoordinates>>,
}

/// How fast the system moves by itself, from the eigenvalues of its modes under the largest force.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rates {
    /// The largest magnitude in any mode, 1/s; 0 where nothing moves by itself.
    pub fastest: f64,
    /// The fastest damping where friction slides, over the slowest motion that steps have to resolve. Of a contact without stick
    /// that is the slowest motion of the open system: at rest the contact's own damping makes the slowest motion slower by as
    /// much as it is fast, and no event follows that creep. Of sliding that slows down by itself it is the slowest of the fast
    /// modes: where these have died the method is another.
    pub stiffness: f64,
}

/// Eigenvalues below this share of the largest are taken for zero. The mode in which friction slides has no zero that is
/// defective, so that rounding leaves some 1e-16 of the largest; the double zero of a stick would leave 1e-8.
const STANDING: f64 = 1e-9;

impl Rates {
    fn new(system: &SystemEquations, excitation: &Excitation) -> Rates {
        let outside = Outside {
            normal_force: excitation.largest_force(),
            ..Outside::default()
        };
        let rest = vec![0.0; system.dimension];
        let contact: &[Mode] = match system.engagement {
            Engagement::StickSlip => &[Mode::Separated, Mode::Stick, Mode::SlipForward],
            _ => &[Mode::Separated, Mode::Engaged],
        };
        let mut rates = Rates::default();
        let mut open = f64::INFINITY;
        for &mode in contact {
            let mut jacobian = DMatrix::zeros(system.dimension, system.dimension);
            system.jacobian(mode, 1.0, 0, &outside, &rest, &mut jacobian.as_view_mut());
            let n = system.mechanical();
            let eigenvalues = eigenvalues(&jacobian.view((0, 0), (n, n)).into_owned());
            let fastest = eigenvalues.iter().map(|value| value.norm()).fold(0.0, f64::max);
            rates.fastest = rates.fastest.max(fastest);
            let moving = || eigenvalues.iter().filter(|value| value.norm() > STANDING * fastest);
            let slowest = moving().map(|value| value.norm()).fold(f64::INFINITY, f64::min);
            if mode == Mode::Separated {
                open = slowest;
            }
            if matches!(mode, Mode::SlipForward | Mode::Engaged) {
                let damping = moving().map(|value| -value.re).fold(0.0, f64::max);
                let resolved = match mode {
                    Mode::Engaged if open.is_finite() => open,
                    Mode::SlipForward if system.twice_resistance.is_some() => least_fast_frequency(system),
                    _ => slowest,
                };
                rates.stiffness = damping / resolved;
            }
        }
        rates
    }
}

/// A breakaway by a one-sided test may start against its own sense, because the torque that is tested is not the one that
/// accelerates. Where the relative velocity goes back by less than this share of the oscillation's speed before it turns,
/// the slip goes on; else the breakaway is undone at once. The share is of the size of the paper's tolerance on the
/// relative velocity, the epsilon = 1e-5 rad/s of its equation (9).
const LARGEST_DIP: f64 = 7.5e-5;

/// Index of the guard of a slip that ends.
pub(super) const GUARD_STOPPING: usize = 0;
/// Index of the guard of a stick that breaks away forward; backward is the next.
pub(super) const GUARD_FORWARD: usize = 0;

/// Rounding of the relative velocity, as a share of the speeds that it is the difference of.
const NOISE: f64 = 4.0 * f64::EPSILON;

/// What counts as zero of it where a segment or a contact begins, as such a share.
pub(super) const VELOCITY_NOISE: f64 = 64.0 * f64::EPSILON;

/// What counts as zero of a torque in stick, as a share of the largest breakaway torque.
const TORQUE_NOISE: f64 = 8.0 * f64::EPSILON;
/// A step changes the sliding speed by no more than this share of the scale on which friction changes there.
const FOLLOWED: f64 = 1.0;

/// tanh(x) is 1 but for rounding from here on.
const SATURATED: f64 = 19.0;

/// How far ahead the relative acceleration is looked at for its rate, and the shortest step that is asked for, as shares of the
/// unit of time.
const AHEAD: f64 = 1e-6;
const SHORTEST_REACH: f64 = 1e-7;

/// What a guard is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Watched {
    /// s omega_r.
    Stopping,
    /// The margin of steady sliding, which is positive.
    Destabilised,
    /// The margin, which is negative.
    Restabilised,
    /// The distance of |omega_r| from the threshold, on its present side.
    Threshold,
    /// The lower end of the piece of the law.
    Below,
    /// The upper end.
    Above,
    /// mu_0 r F_n less the tested torque.
    Forward,
    /// mu_0 r F_n and the tested torque.
    Backward,
}

impl Watched {
    const fn guard(self) -> Guard {
        Guard {
            name: match self {
                Watched::Stopping => "relative velocity reaches zero",
                Watched::Destabilised => "steady sliding loses stability",
                Watched::Restabilised => "steady sliding regains stability",
                Watched::Threshold => "relative velocity reaches the threshold of stick",
                Watched::Below => "relative velocity falls to a knot of the friction law",
                Watched::Above => "relative velocity rises to a knot of the friction law",
                Watched::Forward => "tested torque reaches +mu_0 r F_n",
                Watched::Backward => "tested torque reaches -mu_0 r F_n",
            },
            direction: match self {
                Watched::Restabilised => Direction::Rising,
                _ => Direction::Falling,
            },
            // How late a zero of the margin is found does not matter.
            ends_mode: !self.is_margin(),
        }
    }

    /// Whether it is the margin of steady sliding.
    pub const fn is_margin(self) -> bool {
        matches!(self, Watched::Destabilised | Watched::Restabilised)
    }

    /// The sign with which its value falls where it fires.
    pub fn sign(self) -> f64 {
        if self == Watched::Restabilised { -1.0 } else { 1.0 }
    }
}

/// What is watched, and the guards of that.
type Watches = (&'static [Watched], &'static [Guard]);

/// Both of these.
macro_rules! watches {
    ($($watched:ident)*) => {
        (const { &[$(Watched::$watched),*] }, const { &[$(Watched::$watched.guard()),*] })
    };
}

impl SystemDynamics {
    /// Of a case; `threshold` is in rad/s.
    pub fn new(system: &System, threshold: f64) -> SystemDynamics {
        let (system, excitation) = (SystemEquations::new(system), Excitation::new(system));
        SystemDynamics {
            rates: Rates::new(&system, &excitation),
            closed_form: closed_form::ClosedForm::default(),
            slow_motions: SlowMotions::default(),
            chain: OnceLock::new(),
            system,
            excitation,
            threshold,
        }
    }

    /// The coordinates in which the Jacobian of long trains is a band.
    fn chain(&self) -> Option<&ChainCoordinates> {
        let chain = self.chain.get_or_init(|| ChainCoordinates::of_long(&self.system));
        chain.as_ref()
    }

    /// Stick or separation without their fast modes; `None` of another mode, and where none is slow against the others.
    pub(super) fn slow_motion(&self, mode: Mode) -> Option<&SlowMotion> {
        self.slow_motions.of(&self.system, mode)
    }

    /// The unit of time of a series in a stretch, s: that of the fastest thing that moves.
    pub(super) fn unit(&self, stretch: usize) -> f64 {
        let fastest = self.rates.fastest.max(self.excitation.fastest(stretch));
        if fastest > 0.0 { 1.0 / fastest } else { 1.0 }
    }

    /// The shorter period of a surface on its shaft, or else of the fastest thing that moves, s; `None` where nothing moves by
    /// itself.
    pub(crate) fn natural_period(&self) -> Option<f64> {
        let sides = [&self.system.rotor, &self.system.stator].into_iter();
        let periods = sides.filter_map(|side| {
            let (inertia, stiffness) = (side.inertia.first()?, side.stiffness.first().filter(|k| **k > 0.0)?);
            Some(TAU * (inertia / stiffness).sqrt())
        });
        let of_fastest = || {
            let fastest = self.rates.fastest.max(self.excitation.fastest(0));
            (fastest > 0.0).then(|| TAU / fastest)
        };
        periods.min_by(f64::total_cmp).or_else(of_fastest)
    }

    /// What acts from outside.
    #[inline]
    pub fn outside(&self, location: &SystemLocation, t: f64) -> Outside {
        self.excitation.at(location.stretch, t)
    }

    fn watches(&self, location: &SystemLocation) -> Watches {
        use Watch::{Off, Stable, Unstable};
        match (location.mode, self.system.has_pieces(), location.watch) {
            (Mode::Separated, ..) => watches!(),
            (Mode::Stick, ..) => watches!(Forward Backward),
            (Mode::Engaged, false, _) => watches!(Stopping Threshold),
            (Mode::Engaged, true, _) => watches!(Stopping Threshold Below Above),
            (_, false, Off) => watches!(Stopping),
            (_, false, Stable) => watches!(Stopping Destabilised),
            (_, false, Unstable) => watches!(Stopping Restabilised),
            (_, true, Off) => watches!(Stopping Below Above),
            (_, true, Stable) => watches!(Stopping Destabilised Below Above),
            (_, true, Unstable) => watches!(Stopping Restabilised Below Above),
        }
    }

    /// What the guards of a location are, in their order.
    pub(super) fn watched(&self, location: &SystemLocation) -> &'static [Watched] {
        self.watches(location).0
    }

    /// The knot at an end of the piece of the law; `None` where there is no such end.
    pub(super) fn knot(&self, location: &SystemLocation, above: bool) -> Option<f64> {
        let knots = self.system.law.knots();
        let index = if above {
            Some(location.piece)
        } else {
            location.piece.checked_sub(1)
        };
        index.and_then(|index| knots.get(index).copied())
    }

    /// The margin of steady sliding at `t`, N m s/rad; infinite where there is none.
    pub fn stability_margin(&self, location: &SystemLocation, t: f64, y: &[f64]) -> f64 {
        let outside = self.outside(location, t);
        self.system
            .stability_margin(location.sign(), location.piece, &outside, y)
    }

    /// What is watched in slip or in an engaged contact, as it is, without noise.
    pub(super) fn watched_value(
        &self,
        watched: Watched,
        location: &SystemLocation,
        outside: &Outside,
        y: &[f64],
    ) -> f64 {
        let x = location.sign() * self.system.relative_velocity(outside, y);
        match watched {
            Watched::Stopping => x,
            Watched::Destabilised | Watched::Restabilised => {
                self.system
                    .stability_margin(location.sign(), location.piece, outside, y)
            }
            Watched::Threshold if location.slow => self.threshold - x,
            Watched::Threshold => x - self.threshold,
            Watched::Below => self.knot(location, false).map_or(1.0, |knot| x - knot),
            Watched::Above => self.knot(location, true).map_or(1.0, |knot| knot - x),
            Watched::Forward | Watched::Backward => 1.0,
        }
    }

    /// The rates of what acts from outside, by the same names.
    pub(super) fn outside_rates(&self, location: &SystemLocation, t: f64) -> Outside {
        let mut series = OutsideSeries::<_, 4>::new();
        let ringing = self.excitation.ringing_in_doubles();
        self.excitation.series(ringing, location.stretch, t, 1.0, &mut series);
        series.coefficient(1)
    }

    /// The least velocity of a surface that swings on its shaft with the static twist under friction for its amplitude, rad/s; 0
    /// where none swings.
    fn oscillation_speed(&self, normal_force: f64) -> f64 {
        let torque = self.system.breakaway_torque(normal_force);
        let of = |side: &Side| {
            let (inertia, stiffness) = (side.inertia.first()?, side.stiffness.first().filter(|k| **k > 0.0)?);
            Some(torque / stiffness * (stiffness / inertia).sqrt())
        };
        let speeds = [&self.system.rotor, &self.system.stator].into_iter().filter_map(of);
        speeds.min_by(f64::total_cmp).unwrap_or(0.0)
    }

    /// [`Law::followed_fall`] of the smooth step of a regularised contact.
    fn followed_smoothing(&self, x: f64) -> f64 {
        match self.system.engagement {
            Engagement::Regularised(Smoothing::Tanh, scale) => (FOLLOWED * scale).max(0.5 * (x - SATURATED * scale)),
            // Its scale shrinks on the way down, by no more than a half over this.
            Engagement::Regularised(Smoothing::Arctan, scale) => 0.5 * FOLLOWED * x.hypot(scale),
            Engagement::StickSlip | Engagement::Bristles(..) => f64::INFINITY,
        }
    }

    /// The sense of an engaged contact at a state, or that in which it leaves rest.
    pub(super) fn side(&self, location: &SystemLocation, t: f64, y: &[f64]) -> i8 {
        let outside = self.outside(location, t);
        let w = self.system.relative_velocity(&outside, y);
        let w = if w != 0.0 {
            w
        } else {
            self.system.relative_acceleration(Mode::Engaged, 1.0, 0, &outside, y)
        };
        if w < 0.0 { -1 } else { 1 }
    }

    /// Up to where a torque of the interface is zero but for rounding, N m: it breaks no stick, however weak the normal force.
    pub(super) fn torque_noise(&self) -> f64 {
        TORQUE_NOISE * self.system.breakaway_torque(self.excitation.largest_force())
    }

    /// Whether the contact has no stick.
    pub fn is_engaged(&self) -> bool {
        self.system.engagement != Engagement::StickSlip
    }
}

impl Dynamics for SystemDynamics {
    type Location = SystemLocation;

    fn dimension(&self) -> usize {
        self.system.dimension
    }

    fn rhs(&self, location: &SystemLocation, t: f64, y: &[f64], dydt: &mut [f64]) {
        let outside = match location.mode {
            // The normal force does not act on them.
            Mode::Stick | Mode::Separated => self.excitation.driving_alone(location.stretch, t),
            _ => self.outside(location, t),
        };
        self.system
            .rates(location.mode, location.sign(), location.piece, &outside, y, dydt);
        if !location.resolved
            && let Some(slow) = self.slow_motion(location.mode)
        {
            slow.project(dydt);
        }
    }

    fn jacobian(&self, location: &SystemLocation, t: f64, y: &[f64], mut jacobian: DMatrixViewMut<'_, f64>) {
        let outside = self.outside(location, t);
        self.system.jacobian(
            location.mode,
            location.sign(),
            location.piece,
            &outside,
            y,
            &mut jacobian,
        );
        if !location.resolved
            && let Some(slow) = self.slow_motion(location.mode)
        {
            slow.project_columns(&mut jacobian);
        }
    }

    fn half_width(&self) -> Option<usize> {
        self.chain().map(|_| HALF_WIDTH)
    }

    fn band_jacobian(&self, location: &SystemLocation, t: f64, y: &[f64], jacobian: &mut BandMut<'_>) {
        if let Some(chain) = self.chain() {
            let place = (location.mode, location.sign(), location.piece);
            chain.jacobian(&self.system, place, &self.outside(location, t), y, jacobian);
        }
    }

    fn enter_band(&self, x: &[f64], z: &mut [f64]) {
        if let Some(chain) = self.chain() {
            chain.enter(&self.system, x, z);
        }
    }

    fn leave_band(&self, location: &SystemLocation, z: &[f64], b: &[f64], x: &mut [f64]) {
        if let Some(chain) = self.chain() {
            chain.leave(&self.system, z, x);
        }
        // P, which takes the fast modes out, commutes with the Jacobian of the motion: (I - gamma P J) x = b has the solution
        // x = b + P (z - b). The slip is corrected by an iteration more.
        if !location.resolved
            && let Some(slow) = self.slow_motion(location.mode)
        {
            x.iter_mut().zip(b).for_each(|(x, b)| *x -= b);
            slow.project(x);
            x.iter_mut().zip(b).for_each(|(x, b)| *x += b);
        }
    }

    fn guards(&self, location: &SystemLocation) -> &'static [Guard] {
        self.watches(location).1
    }

    fn guard_values(&self, location: &SystemLocation, t: f64, y: &[f64], values: &mut [f64]) {
        let outside = self.outside(location, t);
        let watched = self.watched(location);
        if location.mode == Mode::Stick {
            let limit = self.system.breakaway_torque(outside.normal_force);
            let torque = self.system.tested_torque(&outside, y);
            // The limit of a stick that nothing pushes may come down to zero, where the contact opens.
            let least = if torque.abs() <= self.torque_noise() {
                f64::MIN_POSITIVE
            } else {
                f64::NEG_INFINITY
            };
            values[GUARD_FORWARD] = (limit - torque).max(least);
            values[GUARD_FORWARD + 1] = (limit + torque).max(least);
            return;
        }
        for (value, &watched) in values.iter_mut().zip(watched) {
            *value = self.watched_value(watched, location, &outside, y);
            if watched == Watched::Stopping {
                // A departure from rest may be slower than any power of time. Rounding of omega_r is no return then.
                *value += NOISE * self.system.relative_velocity_terms(&outside, y);
            }
        }
    }

    fn starts_beyond(&self, location: &SystemLocation, t: f64, y: &[f64], guard: usize) -> bool {
        let system = &self.system;
        if guard != GUARD_STOPPING || location.mode.sense() == 0 || system.breakaway_test == BreakawayTest::Transmitted
        {
            return false;
        }
        let outside = self.outside(location, t);
        let speed = self.oscillation_speed(outside.normal_force);
        if system.relative_velocity(&outside, y).abs() > 1e-9 * speed {
            return false;
        }
        // From rest omega_r' = (1/J_1 + 1/J_2) (T_f - T_i), so that omega_r is a parabola as far as the torques' rates last.
        let (mode, sense, piece) = (location.mode, location.sign(), location.piece);
        let mut rates = vec![0.0; system.dimension];
        system.rates(mode, sense, piece, &outside, y, &mut rates);
        let changes = self.outside_rates(location, t);
        let torque = system.interface_torque(mode, sense, piece, &outside, y);
        let torque_rate = system.sliding_torque_rate(sense, piece, (&outside, y), (&changes, &rates));
        let lag = sense * (torque - system.transmitted_torque(&outside, y));
        let rise = sense * (system.transmitted_torque(&changes, &rates) - torque_rate);
        let ease = 1.0 / system.rotor.surface_inertia() + 1.0 / system.stator.surface_inertia();
        let deepest = ease * lag * lag / (2.0 * rise);
        lag > 0.0 && rise > 0.0 && deepest <= LARGEST_DIP * speed
    }

    fn reach(&self, location: &SystemLocation, t: f64, y: &[f64], one_step: bool) -> f64 {
        match location.mode {
            Mode::Stick | Mode::Separated => return f64::INFINITY,
            // The short steps of a multistep method through the smoothed zero of friction, which is on the way to every speed,
            // see the rest as well. Limits make it begin anew near knots of a law, with steps of nothing but rounding.
            Mode::Engaged if !one_step => return f64::INFINITY,
            // Sliding that slows down by itself comes to every speed slowly, and its fast modes have a longest step.
            _ if self.system.twice_resistance.is_some() => return f64::INFINITY,
            _ => {}
        }
        let (system, unit) = (&self.system, self.unit(location.stretch));
        let x = system.relative_velocity(&self.outside(location, t), y).abs();
        let of_law = system.law_in(location.piece).followed_fall(x, FOLLOWED);
        let change = of_law.min(self.followed_smoothing(x));
        if !change.is_finite() {
            return f64::INFINITY;
        }
        let acceleration = |t: f64, y: &[f64]| {
            let outside = self.outside(location, t);
            system.relative_acceleration(location.mode, location.sign(), location.piece, &outside, y)
        };
        let ahead = AHEAD * unit;
        let mut moved = vec![0.0; system.dimension];
        self.rhs(location, t, y, &mut moved);
        for (moved, y) in moved.iter_mut().zip(y) {
            *moved = y + ahead * *moved;
        }
        let (rate, later) = (acceleration(t, y).abs(), acceleration(t + ahead, &moved).abs());
        let jerk = (later - rate).abs() / ahead;
        // rate h + jerk h^2/2 = change, by the form that does not cancel.
        let reach = 2.0 * change / (rate + (rate * rate + 2.0 * jerk * change).sqrt());
        reach.max(SHORTEST_REACH * unit)
    }

    fn describe(&self, location: &SystemLocation) -> String {
        format!("mode {}", location.mode.name())
    }
}
