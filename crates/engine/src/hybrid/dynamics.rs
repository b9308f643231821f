//! A system for the automaton: its locations, guards and smooth equations. Solvers share it.

use super::excitation::{Excitation, OutsideSeries};
use super::{Direction, Guard};
use nalgebra::{DMatrix, DMatrixViewMut};
use std::f64::consts::TAU;
use std::sync::OnceLock;
use stickslip_system::friction::Law;
use stickslip_system::model::chain_coordinates::{ChainCoordinates, HALF_WIDTH};
use stickslip_system::model::equations::{Engagement, Outside, Side, SystemEquations};
use stickslip_system::model::slow_motion::{SlowMotion, SlowMotions};
use stickslip_system::model::stability::least_fast_frequency;
use stickslip_system::model::system::{Smoothing, System};
use stickslip_system::model::{BreakawayTest, Mode, closed_form};
use stickslip_system::numerics::band::BandMut;
use stickslip_system::numerics::eigenvalues::eigenvalues;

/// How the stability of steady sliding is watched (until the first stick).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarginWatch {
    /// Sliding is stable; its loss of stability is an event.
    Stable,
    /// Sliding is unstable; its return to stability is an event.
    Unstable,
    /// After the first stick, crossings of the margin are part of each slip, and no events.
    Off,
}

/// The discrete state of the system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SystemLocation {
    /// Mode of the contact.
    pub mode: Mode,
    /// Sign of omega_r in slip, or side of rest of a contact without stick: +1 or -1; 0 in stick and separation.
    pub sense: i8,
    /// Number of the friction law's knots below the sliding speed.
    pub piece: usize,
    /// Number of the signals' corners before the time.
    pub stretch: usize,
    /// In a contact without stick: whether |omega_r| is below the threshold that counts as a stick.
    pub slow: bool,
    /// Which zeros of the margin of steady sliding are events.
    pub watch: MarginWatch,
    /// Whether steps must resolve the fast modes, because they are excited or unstable.
    pub resolved: bool,
}

impl SystemLocation {
    /// A location in a mode and a stretch, on the first piece of the law, fully resolved, without a watch on the
    /// margin.
    pub fn new(mode: Mode, stretch: usize) -> SystemLocation {
        SystemLocation {
            mode,
            sense: mode.sense(),
            piece: 0,
            stretch,
            slow: false,
            watch: MarginWatch::Off,
            resolved: true,
        }
    }

    /// [`Self::sense`] as a float.
    pub fn sign(&self) -> f64 {
        f64::from(self.sense)
    }
}

/// The equations with all signals, shared by the solvers of a run.
#[derive(Debug)]
pub struct SystemDynamics {
    /// Equations of motion.
    pub system: SystemEquations,
    /// Signals as functions of time.
    pub excitation: Excitation,
    /// |omega_r| (rad/s) below which a contact without stick counts as stuck.
    pub threshold: f64,
    pub(crate) rates: ModeRates,
    pub(crate) closed_form: closed_form::ClosedForm,
    slow_motions: SlowMotions,
    /// Only for long trains.
    chain: OnceLock<Option<ChainCoordinates>>,
}

#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ModeRates {
    /// Largest magnitude of an eigenvalue in any mode, 1/s; 0 if nothing moves by itself.
    pub fastest: f64,
    /// Fastest damping in sliding over the slowest motion that steps must resolve. Without stick the latter is the
    /// slowest motion of the open system: at rest the contact's damping slows it to a creep that no event follows. In
    /// sliding that slows down by itself it is the slowest of the fast modes, because another method takes over then.
    pub stiffness: f64,
}

/// Eigenvalues below this share of the largest count as zero. The sliding mode has no defective zero, so that rounding
/// leaves some 1e-16; the double zero of a stick would leave 1e-8.
const STANDING: f64 = 1e-9;

impl ModeRates {
    fn new(system: &SystemEquations, excitation: &Excitation) -> ModeRates {
        let outside = Outside {
            normal_force: excitation.largest_force(),
            ..Outside::default()
        };
        let rest = vec![0.0; system.dimension];
        let contact: &[Mode] = match system.engagement {
            Engagement::StickSlip => &[Mode::Separated, Mode::Stick, Mode::SlipForward],
            _ => &[Mode::Separated, Mode::Engaged],
        };
        let mut rates = ModeRates::default();
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

/// A breakaway by a one-sided test may start against its own sense, because the tested torque is not the accelerating
/// torque. The slip continues if the relative velocity dips by less than this share of the oscillation's speed;
/// otherwise the breakaway is undone at once. The share matches the paper's tolerance epsilon = 1e-5 rad/s in equation
/// (9).
const LARGEST_DIP: f64 = 7.5e-5;

pub(crate) const GUARD_STOPPING: usize = 0;
/// The backward guard follows.
pub(crate) const GUARD_FORWARD: usize = 0;

/// Rounding of the relative velocity, relative to the speeds whose difference it is.
const NOISE: f64 = 4.0 * f64::EPSILON;

/// Relative velocities below this share of those speeds count as zero at the start of a segment or a contact.
pub(crate) const VELOCITY_NOISE: f64 = 64.0 * f64::EPSILON;

/// Torques in stick below this share of the largest breakaway torque count as zero.
const TORQUE_NOISE: f64 = 8.0 * f64::EPSILON;
/// Largest change of the sliding speed in a step, relative to the speed scale of friction there.
const FOLLOWED: f64 = 1.0;

/// For larger x, tanh(x) rounds to 1.
const SATURATED: f64 = 19.0;

/// Step of the difference for the rate of the relative acceleration, and shortest reach, in units of time.
const AHEAD: f64 = 1e-6;
const SHORTEST_REACH: f64 = 1e-7;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Watched {
    /// s omega_r.
    Stopping,
    /// Margin of steady sliding, now positive.
    Destabilised,
    /// Margin of steady sliding, now negative.
    Restabilised,
    /// Distance of |omega_r| from the threshold, positive on the present side.
    Threshold,
    Below,
    Above,
    /// mu_0 r F_n into forward sliding minus the tested torque.
    Forward,
    /// mu_0 r F_n into backward sliding plus the tested torque.
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
            ends_mode: !self.is_margin(),
        }
    }

    pub const fn is_margin(self) -> bool {
        matches!(self, Watched::Destabilised | Watched::Restabilised)
    }

    /// Sign with which the value falls when the guard fires.
    pub fn sign(self) -> f64 {
        if self == Watched::Restabilised { -1.0 } else { 1.0 }
    }
}

type Watches = (&'static [Watched], &'static [Guard]);

macro_rules! watches {
    ($($watched:ident)*) => {
        (const { &[$(Watched::$watched),*] }, const { &[$(Watched::$watched.guard()),*] })
    };
}

impl SystemDynamics {
    /// The dynamics of a system; `threshold` is in rad/s.
    pub fn new(system: &System, threshold: f64) -> SystemDynamics {
        let (system, excitation) = (SystemEquations::new(system), Excitation::new(system));
        SystemDynamics {
            rates: ModeRates::new(&system, &excitation),
            closed_form: closed_form::ClosedForm::default(),
            slow_motions: SlowMotions::default(),
            chain: OnceLock::new(),
            system,
            excitation,
            threshold,
        }
    }

    fn chain(&self) -> Option<&ChainCoordinates> {
        let chain = self.chain.get_or_init(|| ChainCoordinates::of_long(&self.system));
        chain.as_ref()
    }

    /// Stick or separation without fast modes; `None` in other modes, and if no mode is slow compared with the others.
    pub(crate) fn slow_motion(&self, mode: Mode) -> Option<&SlowMotion> {
        self.slow_motions.of(&self.system, mode)
    }

    /// Time unit of a series in a stretch, s: that of the fastest motion or signal.
    pub fn unit(&self, stretch: usize) -> f64 {
        let fastest = self.rates.fastest.max(self.excitation.fastest(stretch));
        if fastest > 0.0 { 1.0 / fastest } else { 1.0 }
    }

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

    /// External inputs at `t` (s).
    #[inline]
    pub fn outside(&self, location: &SystemLocation, t: f64) -> Outside {
        self.excitation.at(location.stretch, t)
    }

    fn watches(&self, location: &SystemLocation) -> Watches {
        use MarginWatch::{Off, Stable, Unstable};
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

    pub(crate) fn watched(&self, location: &SystemLocation) -> &'static [Watched] {
        self.watches(location).0
    }

    pub(crate) fn knot(&self, location: &SystemLocation, above: bool) -> Option<f64> {
        let knots = self.system.law.knots();
        let index = if above {
            Some(location.piece)
        } else {
            location.piece.checked_sub(1)
        };
        index.and_then(|index| knots.get(index).copied())
    }

    /// Margin of steady sliding at `t`, N m s/rad; infinite if there is none.
    pub fn stability_margin(&self, location: &SystemLocation, t: f64, y: &[f64]) -> f64 {
        let outside = self.outside(location, t);
        self.system
            .stability_margin(location.sign(), location.piece, &outside, y)
    }

    pub(crate) fn watched_value(
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
                self.system.stability_guard(location.sign(), location.piece, outside, y)
            }
            Watched::Threshold if location.slow => self.threshold - x,
            Watched::Threshold => x - self.threshold,
            Watched::Below => self.knot(location, false).map_or(1.0, |knot| x - knot),
            Watched::Above => self.knot(location, true).map_or(1.0, |knot| knot - x),
            Watched::Forward | Watched::Backward => 1.0,
        }
    }

    pub(crate) fn outside_rates(&self, location: &SystemLocation, t: f64) -> Outside {
        let mut series = OutsideSeries::<_, 4>::new();
        let ringing = self.excitation.ringing_in_doubles();
        self.excitation.series(ringing, location.stretch, t, 1.0, &mut series);
        series.coefficient(1)
    }

    fn largest_breakaway_torque(&self, normal_force: f64) -> f64 {
        self.system
            .breakaway_torque(self.system.larger_breakaway().0, normal_force)
    }

    /// Smallest speed of a surface that swings on its shaft with the static twist under friction as amplitude, rad/s; 0
    /// if none swings.
    fn oscillation_speed(&self, normal_force: f64) -> f64 {
        let torque = self.largest_breakaway_torque(normal_force);
        let of = |side: &Side| {
            let (inertia, stiffness) = (side.inertia.first()?, side.stiffness.first().filter(|k| **k > 0.0)?);
            Some(torque / stiffness * (stiffness / inertia).sqrt())
        };
        let speeds = [&self.system.rotor, &self.system.stator].into_iter().filter_map(of);
        speeds.min_by(f64::total_cmp).unwrap_or(0.0)
    }

    /// [`Law::followed_fall`] for the smooth step of a regularised contact.
    fn followed_smoothing(&self, x: f64) -> f64 {
        match self.system.engagement {
            Engagement::Regularised(Smoothing::Tanh, scale) => (FOLLOWED * scale).max(0.5 * (x - SATURATED * scale)),
            // The scale shrinks as the speed falls, by no more than a half over this fall.
            Engagement::Regularised(Smoothing::Arctan, scale) => 0.5 * FOLLOWED * x.hypot(scale),
            Engagement::StickSlip | Engagement::Bristles(..) => f64::INFINITY,
        }
    }

    /// Sense of a contact without stick, or the sense in which it leaves rest.
    pub(crate) fn side(&self, location: &SystemLocation, t: f64, y: &[f64]) -> i8 {
        let outside = self.outside(location, t);
        let w = self.system.relative_velocity(&outside, y);
        let w = if w != 0.0 {
            w
        } else {
            self.system.relative_acceleration(Mode::Engaged, 1.0, 0, &outside, y)
        };
        if w < 0.0 { -1 } else { 1 }
    }

    /// Rounding of the interface torque, N m. A smaller torque breaks no stick, however weak the normal force.
    pub(crate) fn torque_noise(&self) -> f64 {
        TORQUE_NOISE * self.largest_breakaway_torque(self.excitation.largest_force())
    }

    /// Whether the contact has no stick.
    pub fn is_engaged(&self) -> bool {
        self.system.engagement != Engagement::StickSlip
    }

    /// Number of components of the state.
    pub fn dimension(&self) -> usize {
        self.system.dimension
    }

    /// dy/dt, smooth within a location and a little beyond its guards.
    pub fn rhs(&self, location: &SystemLocation, t: f64, y: &[f64], dydt: &mut [f64]) {
        let outside = match location.mode {
            // The normal force has no effect on these modes.
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

    /// Writes the dense Jacobian into a zeroed matrix.
    pub fn jacobian(&self, location: &SystemLocation, t: f64, y: &[f64], mut jacobian: DMatrixViewMut<'_, f64>) {
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

    /// Half-bandwidth of the Jacobian in band coordinates; `None` if it is dense.
    pub fn half_width(&self) -> Option<usize> {
        self.chain().map(|_| HALF_WIDTH)
    }

    /// Writes the Jacobian in band coordinates into zeros.
    pub fn band_jacobian(&self, location: &SystemLocation, t: f64, y: &[f64], jacobian: &mut BandMut<'_>) {
        if let Some(chain) = self.chain() {
            let place = (location.mode, location.sign(), location.piece);
            chain.jacobian(&self.system, place, &self.outside(location, t), y, jacobian);
        }
    }

    /// Transforms a change of the state into band coordinates.
    pub fn enter_band(&self, x: &[f64], z: &mut [f64]) {
        if let Some(chain) = self.chain() {
            chain.enter(&self.system, x, z);
        }
    }

    /// Transforms `z`, the solution of (I - gamma J) z = b in band coordinates, back to the coordinates of the state and
    /// of `b`.
    pub fn leave_band(&self, location: &SystemLocation, z: &[f64], b: &[f64], x: &mut [f64]) {
        if let Some(chain) = self.chain() {
            chain.leave(&self.system, z, x);
        }
        // P, which removes the fast modes, commutes with the Jacobian: (I - gamma P J) x = b has the solution x = b +
        // P (z - b). One more iteration corrects the slip.
        if !location.resolved
            && let Some(slow) = self.slow_motion(location.mode)
        {
            x.iter_mut().zip(b).for_each(|(x, b)| *x -= b);
            slow.project(x);
            x.iter_mut().zip(b).for_each(|(x, b)| *x += b);
        }
    }

    /// Guards in the order of [`Self::guard_values`].
    pub fn guards(&self, location: &SystemLocation) -> &'static [Guard] {
        self.watches(location).1
    }

    /// Writes the value of each guard.
    pub fn guard_values(&self, location: &SystemLocation, t: f64, y: &[f64], values: &mut [f64]) {
        let outside = self.outside(location, t);
        let watched = self.watched(location);
        if location.mode == Mode::Stick {
            let limit = |sense: f64| self.system.breakaway_torque(sense, outside.normal_force);
            let torque = self.system.tested_torque(&outside, y);
            // The limit of a stick without load may fall to zero when the contact opens.
            let least = if torque.abs() <= self.torque_noise() {
                f64::MIN_POSITIVE
            } else {
                f64::NEG_INFINITY
            };
            values[GUARD_FORWARD] = (limit(1.0) - torque).max(least);
            values[GUARD_FORWARD + 1] = (limit(-1.0) + torque).max(least);
            return;
        }
        for (value, &watched) in values.iter_mut().zip(watched) {
            *value = self.watched_value(watched, location, &outside, y);
            if watched == Watched::Stopping {
                // A departure from rest may be slower than any power of time: rounding of omega_r is no return.
                *value += NOISE * self.system.relative_velocity_terms(&outside, y);
            }
        }
    }

    /// Writes the derivative of each guard in the direction of a change of time and state. A change of 1 and the rates of
    /// the state gives the guards' rates along the motion.
    pub fn guard_slopes(
        &self,
        location: &SystemLocation,
        t: f64,
        y: &[f64],
        (dt, dy): (f64, &[f64]),
        slopes: &mut [f64],
    ) {
        let system = &self.system;
        let changes = self.outside_rates(location, t).scaled(dt);
        if location.mode == Mode::Stick {
            let limit = |sense: f64| system.breakaway_torque(sense, changes.normal_force);
            let torque = system.tested_torque(&changes, dy);
            slopes[GUARD_FORWARD] = limit(1.0) - torque;
            slopes[GUARD_FORWARD + 1] = limit(-1.0) + torque;
            return;
        }
        let x = location.sign() * system.relative_velocity(&changes, dy);
        for (slope, &watched) in slopes.iter_mut().zip(self.watched(location)) {
            *slope = match watched {
                Watched::Destabilised | Watched::Restabilised => {
                    let now = (&self.outside(location, t), y);
                    system.stability_guard_slope(location.sign(), location.piece, now, (&changes, dy))
                }
                Watched::Threshold if location.slow => -x,
                Watched::Above => -x,
                _ => x,
            };
        }
    }

    /// Whether a guard that is zero at the start of a segment moves to its forbidden side. It is then watched only after
    /// it has come back: a location may be entered against its own guard.
    pub fn starts_beyond(&self, location: &SystemLocation, t: f64, y: &[f64], guard: usize) -> bool {
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
        // From rest omega_r' = (1/J_1 + 1/J_2) (T_f - T_i): omega_r is a parabola while the rates of the torques are
        // constant.
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

    /// Longest step (s) from a state with which a solver sees all changes of the equations; infinite if these change no
    /// faster than the solution. Step control alone misses changes between the stages of a step. `one_step`: the solver
    /// has stages, so it is no multistep method.
    pub fn reach(&self, location: &SystemLocation, t: f64, y: &[f64], one_step: bool) -> f64 {
        match location.mode {
            Mode::Stick | Mode::Separated => return f64::INFINITY,
            // A multistep method takes short steps through the smoothed zero of friction, which every change of speed
            // passes, and so resolves the rest. Limits would restart it near knots of a law, with steps of the size of
            // rounding.
            Mode::Engaged if !one_step => return f64::INFINITY,
            // Sliding that slows down by itself approaches every speed slowly, and its fast modes bound the step.
            _ if self.system.twice_resistance.is_some() => return f64::INFINITY,
            _ => {}
        }
        let (system, unit) = (&self.system, self.unit(location.stretch));
        let x = system.relative_velocity(&self.outside(location, t), y).abs();
        let of_law = system
            .law_in(location.sign(), location.piece)
            .followed_fall(x, FOLLOWED);
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
        // Root of rate h + jerk h^2/2 = change, in the form without cancellation.
        let reach = 2.0 * change / (rate + (rate * rate + 2.0 * jerk * change).sqrt());
        reach.max(SHORTEST_REACH * unit)
    }
}
