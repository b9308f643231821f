//! The motion from a known state, within one mode: the reference for comparisons with other solvers.

use super::expansion::{Expansion, Series};
use super::plan::SystemPlan;
use super::portrait::{shown, state_of};
use super::state_readings::{Further, StateReadings, further_names};
use super::{SystemDynamics, SystemLocation};
use crate::simulation::options::SolverOptions;
use crate::simulation::readings::Readings as _;
use std::f64::consts::TAU;
use std::sync::Arc;
use stickslip_system::model::Mode;
use stickslip_system::model::axial::AxialMotion;
use stickslip_system::model::equations::{
    ANGLE, DAMPING_LOSS, Engagement, FRICTION_LOSS, Outside, Side, SystemEquations, WORK,
};
use stickslip_system::model::system::{End, System};
use stickslip_system::numerics::bisection::bisect;
use stickslip_system::numerics::taylor;
use stickslip_system::record::{Channels, Sample, State, channel};

pub use super::expansion::TERMS;

/// Error of a series step, relative to the size of a quantity.
const TOLERANCE: f64 = 1e-16;

/// A train: a chain of inertias and shafts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TrainSide {
    /// The rotor: index 2 in the equations.
    Rotor,
    /// The stator: index 1 in the equations.
    Stator,
}

impl TrainSide {
    /// Both trains.
    pub const BOTH: [TrainSide; 2] = [TrainSide::Rotor, TrainSide::Stator];

    /// Name: "rotor" or "stator".
    pub fn name(self) -> &'static str {
        match self {
            TrainSide::Rotor => "rotor",
            TrainSide::Stator => "stator",
        }
    }
}

/// An inertia or a shaft of a train, counted from the contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TrainPart {
    /// Train to which the part belongs.
    pub of: TrainSide,
    /// Index, counted from 0.
    pub index: usize,
}

/// A quantity that is known as a function of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CourseQuantity {
    /// Twist of a shaft, rad.
    Twist(TrainPart),
    /// Twist rate of a shaft, rad/s.
    TwistRate(TrainPart),
    /// Speed of an inertia, or of the body beyond the outermost inertia, rad/s.
    Speed(TrainPart),
    /// Angle of an inertia, or of the body beyond the outermost inertia, rad.
    Angle(TrainPart),
    /// phi_2 - phi_1, rad.
    Slip,
    /// omega_r, rad/s.
    RelativeVelocity,
    /// Deflection of the bristles.
    Deflection,
    /// z, m; 0 if the normal force is given directly.
    AxialDisplacement,
    /// z', m/s.
    AxialVelocity,
    /// F_n, N.
    NormalForce,
    /// Torque of the interface, N m.
    Interface,
    /// T_f, N m.
    Transmitted,
    /// Product of two recorded channels.
    Product(&'static [&'static str; 2]),
}

impl CourseQuantity {
    /// The function of time that a recorded channel is; `outermost` is the index of the rotor's outermost inertia.
    /// `None` for channels that are known at the samples only.
    pub fn of_channel(name: &str, outermost: usize) -> Option<CourseQuantity> {
        let part = |of, index| TrainPart { of, index };
        let (rotor, stator) = (part(TrainSide::Rotor, 0), part(TrainSide::Stator, 0));
        let last = part(TrainSide::Rotor, outermost);
        Some(match name {
            "z" => CourseQuantity::AxialDisplacement,
            "z_dot" => CourseQuantity::AxialVelocity,
            "theta" => CourseQuantity::Angle(last),
            "theta_dot" => CourseQuantity::Speed(last),
            "phi1" => CourseQuantity::Angle(stator),
            "phi1_dot" => CourseQuantity::Speed(stator),
            "phi2" => CourseQuantity::Angle(rotor),
            "phi2_dot" => CourseQuantity::Speed(rotor),
            "rotor_twist" => CourseQuantity::Twist(rotor),
            "rotor_twist_rate" => CourseQuantity::TwistRate(rotor),
            "relative_velocity" => CourseQuantity::RelativeVelocity,
            "slip_displacement" => CourseQuantity::Slip,
            "normal_force" => CourseQuantity::NormalForce,
            "friction_torque" => CourseQuantity::Interface,
            "transmitted_torque" => CourseQuantity::Transmitted,
            name => CourseQuantity::Product(channel::factors(name)?),
        })
    }
}

/// The motion of one system.
#[derive(Debug)]
pub struct Course {
    dynamics: Arc<SystemDynamics>,
    expansion: Expansion,
    location: SystemLocation,
    time: f64,
    y: Vec<f64>,
    sizes: Vec<f64>,
    /// Whether the columns of every file hold the whole state.
    in_columns: bool,
}

/// Whether a system has the short form: a free rotor (surface, shaft, inertia), and a stator surface on a fixed shaft.
pub fn is_short(system: &System) -> bool {
    let (rotor, stator) = (&system.rotor, &system.stator);
    let ends = matches!((&rotor.end, &stator.end), (End::Free, End::Fixed));
    ends && rotor.inertia.len() == 2 && stator.inertia.len() == 1
}

impl Course {
    /// The motion of a system; `threshold` (rad/s) as for a run.
    pub fn new(system: &System, threshold: f64, solver: &SolverOptions) -> Course {
        let dynamics = Arc::new(SystemDynamics::new(system, threshold));
        let start = super::simulate::start(system, &dynamics);
        let plan = SystemPlan::new(system, &dynamics, &start, solver);
        Course {
            expansion: Expansion::new(&dynamics.system, &dynamics.excitation),
            location: SystemLocation::new(Mode::Separated, 0),
            time: 0.0,
            y: vec![0.0; dynamics.system.dimension],
            sizes: plan.sizes,
            in_columns: is_short(system) && !matches!(dynamics.system.engagement, Engagement::Bristles(..)),
            dynamics,
        }
    }

    /// The equations of the system.
    pub fn system(&self) -> &SystemEquations {
        &self.dynamics.system
    }

    fn side(&self, of: TrainSide) -> &Side {
        match of {
            TrainSide::Rotor => &self.dynamics.system.rotor,
            TrainSide::Stator => &self.dynamics.system.stator,
        }
    }

    /// Size of each component of the state.
    pub fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// Largest normal force, N.
    pub fn largest_force(&self) -> f64 {
        self.dynamics.excitation.largest_force()
    }

    /// Shortest period of a harmonic among the signals, s; `None` without a harmonic.
    pub fn period_of_signals(&self) -> Option<f64> {
        let fastest = self.fastest_signal();
        (fastest > 0.0).then(|| TAU / fastest)
    }

    /// The axial motion, if the normal force comes from one.
    pub fn axial(&self) -> Option<&AxialMotion> {
        self.dynamics.excitation.axial()
    }

    /// Next corner of the signals after `t`, s.
    pub fn next_corner(&self, t: f64) -> Option<f64> {
        let corners = self.dynamics.excitation.corners();
        corners.get(corners.partition_point(|corner| *corner <= t)).copied()
    }

    /// External inputs at `t` (s), with a normal force of 0.
    pub fn driving(&self, t: f64) -> Outside {
        let excitation = &self.dynamics.excitation;
        excitation.driving_alone(excitation.stretch(t), t)
    }

    /// External inputs at `t` (s).
    pub fn outside(&self, t: f64) -> Outside {
        let excitation = &self.dynamics.excitation;
        excitation.at(excitation.stretch(t), t)
    }

    /// Angle (rad) and speed (rad/s) of the driven ends at `t` (s), rotor first; 0 for other ends.
    pub fn ends(&self, t: f64) -> [(f64, f64); 2] {
        let (outside, angles) = (self.outside(t), self.dynamics.excitation.angles(t));
        [(angles.0, outside.rotor.speed), (angles.1, outside.stator.speed)]
    }

    /// Position of the system's [`Portrait`](super::portrait::Portrait); `None` if it is the slip displacement.
    pub fn position(&self) -> Option<CourseQuantity> {
        let (side, name, ..) = shown(&self.dynamics)?;
        let part = TrainPart {
            of: if side.sign > 0.0 {
                TrainSide::Rotor
            } else {
                TrainSide::Stator
            },
            index: 0,
        };
        Some(match name {
            "stator" | "rotor" => CourseQuantity::Angle(part),
            _ => CourseQuantity::Twist(part),
        })
    }

    /// Columns that [`Self::state`] needs besides the columns of every file.
    pub fn further(&self) -> Vec<Further> {
        if self.in_columns {
            Vec::new()
        } else {
            further_names(self.system())
        }
    }

    /// The state from a file's columns and the columns of [`Self::further`]; losses and work are zero.
    pub fn state(&self, state: &State, further: &[f64]) -> Vec<f64> {
        let system = self.system();
        let mut y = if self.in_columns {
            let (rotor, stator) = (&system.rotor, &system.stator);
            let columns = [
                (rotor.twists, state.rotor_twist),
                (rotor.twists + 1, state.rotor_twist_rate),
                (stator.twists, state.phi1),
                (stator.twists + 1, state.phi1_dot),
            ];
            let mut y = vec![0.0; system.dimension];
            for (place, value) in columns.into_iter().chain(rotor.speed.zip(Some(state.theta_dot))) {
                y[place] = value;
            }
            y
        } else {
            state_of(&self.dynamics, further)
        };
        y[system.slip] = state.slip_displacement;
        if system.dimension > system.slip + ANGLE {
            let twists: f64 = (0..system.stator.shafts()).map(|i| system.stator.twist(i, &y)).sum();
            y[system.slip + ANGLE] = state.phi1 - twists;
        }
        y
    }

    /// The state from all values that `further_names` lists; slip, losses and work are zero.
    pub fn state_of(&self, further: &[f64]) -> Vec<f64> {
        state_of(&self.dynamics, further)
    }

    /// Values that `further_names` lists, for a state at `t` (s).
    pub fn further_of(&self, mode: Mode, t: f64, y: &[f64]) -> Vec<f64> {
        let mut values = Vec::new();
        self.readings(true)
            .further(t, &self.place(mode, t, y, true), y, &mut values);
        values
    }

    /// Distance of a state from steady motion, rad/s: the largest of all rates of twists and bristles, and of all
    /// changes of a speed over the unit of time of the fastest motion.
    pub fn unrest(&mut self, mode: Mode, t: f64, y: &[f64]) -> f64 {
        self.fill(mode, t, y, 2, true);
        let (system, unit) = (self.system(), self.expansion.unit);
        let mut units = vec![1.0; system.dimension];
        for rate in system.twist_rates() {
            units[rate - 1] = unit;
        }
        if let Engagement::Bristles(.., at) = system.engagement {
            units[at] = unit;
        }
        let moving = self.expansion.state[..system.mechanical()].iter().zip(&units);
        moving
            .map(|(series, unit)| (series[1] / unit).abs())
            .fold(0.0, f64::max)
    }

    fn place(&self, mode: Mode, t: f64, y: &[f64], forward: bool) -> SystemLocation {
        let excitation = &self.dynamics.excitation;
        // At a corner, the stretch that begins or ends.
        let stretch = excitation.stretch(if forward { t } else { t.next_down() });
        let mut location = SystemLocation::new(mode, stretch);
        if mode.slides() {
            if mode == Mode::Engaged {
                location.sense = self.dynamics.side(&location, t, y);
            }
            let outside = self.dynamics.outside(&location, t);
            location.piece = self.system().piece_of(self.system().relative_velocity(&outside, y));
        }
        location
    }

    fn readings(&self, further: bool) -> StateReadings<'_> {
        StateReadings {
            dynamics: &self.dynamics,
            further,
        }
    }

    /// Forces, torques, and kinetic and elastic energy of a state at `t` (s). Channels that depend on earlier events
    /// are 0.
    pub fn channels(&self, mode: Mode, t: f64, y: &[f64]) -> Channels {
        self.readings(false).read(t, &self.place(mode, t, y, true), y).1
    }

    /// Period (s) that separates dense from sparse sampling; `None` if nothing moves by itself.
    pub fn natural_period(&self) -> Option<f64> {
        self.dynamics.natural_period()
    }

    /// Rate (1/s) of the fastest motion of the system or its signals; 0 if nothing moves.
    pub fn fastest_rate(&self) -> f64 {
        self.dynamics.rates.fastest.max(self.fastest_signal())
    }

    fn fastest_signal(&self) -> f64 {
        let stretches = 0..=self.dynamics.excitation.corners().len();
        let rates = stretches.map(|stretch| self.dynamics.excitation.fastest(stretch));
        rates.fold(0.0, f64::max)
    }

    /// Change of every value of a row (state, channels, further values) from a sample to `dt` (s) later, in the
    /// sample's mode. It is one step of the classical Runge-Kutta method, with the axial motion in closed form. For
    /// |dt| up to a hundredth of the shortest period the error is some 1e-8 of the oscillation. The changes of kick
    /// work and energy residual are 0.
    pub fn change(&self, sample: &Sample, further: &[f64], dt: f64) -> Vec<f64> {
        let (t, mode, channels) = (sample.time, sample.mode, &sample.channels);
        let mut y = self.state(&sample.state, further);
        let axial = self.axial().map(|motion| motion.at(t));
        let slip = self.system().slip;
        y[slip + FRICTION_LOSS] = channels.dissipated_friction;
        y[slip + DAMPING_LOSS] = channels.dissipated_damping - axial.map_or(0.0, |axial| axial.dissipated);
        y[slip + WORK] = channels.work_applied - axial.map_or(0.0, |axial| axial.work);
        let place = self.place(mode, t, &y, dt >= 0.0);
        let (mut at, mut later, mut slope) = (y.clone(), y.clone(), vec![0.0; y.len()]);
        for (share, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            for ((at, y), slope) in at.iter_mut().zip(&y).zip(&slope) {
                *at = y + share * dt * slope;
            }
            self.dynamics.rhs(&place, t + share * dt, &at, &mut slope);
            for (later, slope) in later.iter_mut().zip(&slope) {
                *later += dt / 6.0 * weight * slope;
            }
        }
        let readings = self.readings(!further.is_empty());
        let read = |t: f64, y: &[f64]| {
            let (state, channels) = readings.read(t, &place, y);
            let mut values: Vec<f64> = state.values().into_iter().chain(channels.values()).collect();
            readings.further(t, &place, y, &mut values);
            values
        };
        let mut change = read(t + dt, &later);
        for (change, before) in change.iter_mut().zip(read(t, &y)) {
            *change -= before;
        }
        change
    }

    /// Power of friction, and power of the dampers minus that of the drives (W), each with its rate (W/s).
    pub fn powers(&mut self, mode: Mode, t: f64, y: &[f64]) -> [(f64, f64); 2] {
        self.fill(mode, t, y, 3, true);
        let unit = self.expansion.unit;
        let of = |quadrature: usize| {
            let series = &self.expansion.state[self.system().slip + quadrature];
            (series[1] / unit, 2.0 * series[2] / (unit * unit))
        };
        let (lost, work) = (of(DAMPING_LOSS), of(WORK));
        [of(FRICTION_LOSS), (lost.0 - work.0, lost.1 - work.1)]
    }

    /// Expands at a state, just before its time (s). [`Self::series`] then has values at this time only.
    pub fn stand_before(&mut self, mode: Mode, t: f64, y: &[f64]) {
        self.fill(mode, t, y, 1, false);
    }

    fn fill(&mut self, mode: Mode, t: f64, y: &[f64], terms: usize, forward: bool) {
        self.location = self.place(mode, t, y, forward);
        let unit = self.dynamics.unit(self.location.stretch);
        self.time = t;
        self.y.copy_from_slice(y);
        self.expansion.terms = terms;
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        self.expansion.expand((system, excitation), &self.location, t, y, unit);
    }

    /// Expands the motion from a state, and returns how long (s, at most `longest`) the series is valid.
    pub fn expand(&mut self, mode: Mode, t: f64, y: &[f64], longest: f64) -> f64 {
        let unit = self.dynamics.unit(self.dynamics.excitation.stretch(t));
        let terms = terms_for(longest / unit);
        let step = self.expand_to(mode, t, y, longest, terms);
        // A friction law that changes within less than the unit needs more terms.
        if step < longest && terms < TERMS {
            self.expand_to(mode, t, y, longest, TERMS)
        } else {
            step
        }
    }

    /// Advances a state from one time to another (s), forwards or backwards, by the series. `each` receives the start
    /// of every step. False if `most_steps` are not enough.
    pub fn go(
        &mut self,
        mode: Mode,
        (from, to): (f64, f64),
        y: &mut [f64],
        most_steps: usize,
        each: &mut dyn FnMut(f64, &[f64]),
    ) -> bool {
        let mut time = from;
        for _ in 0..most_steps {
            let rest = to - time;
            if rest == 0.0 {
                break;
            }
            let length = self.expand(mode, time, y, rest.abs());
            each(time, y);
            let next = if length >= rest.abs() {
                to
            } else {
                time + length.copysign(rest)
            };
            if next.is_nan() || next == time {
                break;
            }
            self.after(next - time, y);
            time = next;
        }
        time == to
    }

    fn expand_to(&mut self, mode: Mode, t: f64, y: &[f64], longest: f64, terms: usize) -> f64 {
        self.fill(mode, t, y, terms, true);
        let (system, unit) = (&self.dynamics.system, self.expansion.unit);
        let mut shares = [0.0f64; 2];
        let sizes = self.sizes.iter().zip(y).map(|(size, y)| size + y.abs());
        let states = self.expansion.state[..system.mechanical()].iter().zip(sizes);
        let force = self.expansion.normal_force();
        for (series, size) in states.chain([(force, self.largest_force())]) {
            for (share, n) in shares.iter_mut().zip([terms - 1, terms - 2]) {
                if series[n] != 0.0 {
                    *share = share.max(series[n].abs() / (TOLERANCE * size));
                }
            }
        }
        let mut step = taylor::step(terms - 1, |n| shares[terms - 1 - n]) * unit;
        step = step.min(longest);
        if mode.slides() {
            step = self.expansion.within_law(system, &self.location, step);
            step = self.within_piece(step);
        }
        step
    }

    fn within_piece(&self, step: f64) -> f64 {
        let system = self.system();
        if !system.has_pieces() && self.location.mode != Mode::Engaged {
            return step;
        }
        let known = &self.expansion.relative_velocity[..self.expansion.terms];
        let w = |x: f64| taylor::value(known, x / self.expansion.unit);
        let inside = |x: f64| {
            let w = w(x);
            let side = self.location.mode != Mode::Engaged || w * self.location.sign() >= 0.0;
            side && (!system.has_pieces() || system.piece_of(w) == self.location.piece)
        };
        if inside(step) {
            return step;
        }
        bisect(0.0, step, 60, inside).1
    }

    /// State of the expansion after `step` (s).
    pub fn after(&self, step: f64, y: &mut [f64]) {
        self.expansion.at(step / self.expansion.unit, y);
    }

    /// omega_r of the expansion after `step` (s), rad/s.
    pub fn relative_velocity(&self, step: f64) -> f64 {
        let known = &self.expansion.relative_velocity[..self.expansion.terms];
        taylor::value(known, step / self.expansion.unit)
    }

    /// A quantity by powers of the elapsed share of `step` (s), and the number of significant coefficients.
    pub fn series(&self, quantity: CourseQuantity, step: f64) -> ([f64; TERMS], usize) {
        let mut series = self.quantity(quantity);
        let (known, beyond) = series.split_at_mut(self.expansion.terms);
        beyond.fill(0.0);
        let x = step / self.expansion.unit;
        let mut power = 1.0;
        let mut largest = 0.0f64;
        for c in &mut *known {
            *c *= power;
            power *= x;
            largest = largest.max(c.abs());
        }
        let terms = known
            .iter()
            .rposition(|c| c.abs() > 1e-18 * largest)
            .map_or(1, |last| last + 1);
        (series, terms)
    }

    /// Writes a quantity at these times since the start of the expansion (s).
    pub fn values(&self, quantity: CourseQuantity, since: impl Iterator<Item = f64>, out: &mut [f64]) {
        let series = self.quantity(quantity);
        let (known, unit) = (&series[..self.expansion.terms], self.expansion.unit);
        for (value, since) in out.iter_mut().zip(since) {
            *value = taylor::value(known, since / unit);
        }
    }

    fn quantity(&self, quantity: CourseQuantity) -> Series {
        let (expansion, system) = (&self.expansion, self.system());
        let at = |of: TrainSide| of as usize;
        match quantity {
            CourseQuantity::Twist(TrainPart { of, index }) => expansion.state[self.side(of).twists + 2 * index],
            CourseQuantity::TwistRate(TrainPart { of, index }) => expansion.state[self.side(of).twists + 2 * index + 1],
            CourseQuantity::Speed(TrainPart { of, index }) if index < self.side(of).inertia.len() => {
                expansion.speed(self.side(of), at(of), index)
            }
            CourseQuantity::Speed(TrainPart { of, .. }) => *expansion.end_speed(at(of)),
            CourseQuantity::Angle(part) => self.angle(part),
            CourseQuantity::Slip => expansion.state[system.slip],
            CourseQuantity::RelativeVelocity => expansion.relative_velocity,
            CourseQuantity::Deflection => match system.engagement {
                Engagement::Bristles(.., index) => expansion.state[index],
                _ => [0.0; TERMS],
            },
            CourseQuantity::AxialDisplacement => self.axial_motion().0,
            CourseQuantity::AxialVelocity => self.axial_motion().1,
            CourseQuantity::NormalForce if self.location.mode == Mode::Separated => [0.0; TERMS],
            CourseQuantity::NormalForce => *expansion.normal_force(),
            CourseQuantity::Interface => expansion.interface,
            CourseQuantity::Transmitted => expansion.transmitted(system),
            CourseQuantity::Product(factors) => {
                let outermost = system.rotor.inertia.len().saturating_sub(1);
                let [a, b] = factors.map(|name| {
                    let factor = CourseQuantity::of_channel(name, outermost);
                    factor.map_or([0.0; TERMS], |factor| self.quantity(factor))
                });
                taylor::product(&a, &b)
            }
        }
    }

    /// z and z' by m z'' = F_n - F, with F_n without its clamp at zero.
    fn axial_motion(&self) -> (Series, Series) {
        let (mut z, mut rate) = ([0.0; TERMS], [0.0; TERMS]);
        if let Some(motion) = self.axial() {
            let (start, unit) = (motion.at(self.time), self.expansion.unit);
            let mut force = *self.expansion.normal_force();
            force[0] -= start.force;
            force[1] -= motion.force.slope(self.time) * unit;
            (z[0], rate[0]) = (start.displacement, start.velocity);
            for n in 0..self.expansion.terms - 1 {
                let step = unit / (n + 1) as f64;
                rate[n + 1] = step * force[n] / motion.mass();
                z[n + 1] = step * rate[n];
            }
        }
        (z, rate)
    }

    /// Sums twists outwards from a surface whose angle is known, or inwards from a tied end.
    fn angle(&self, TrainPart { of, index }: TrainPart) -> Series {
        let (side, system) = (self.side(of), self.system());
        let twist = |i: usize| &self.expansion.state[side.twists + 2 * i];
        let mut angle = match side.speed {
            None => {
                let mut end = [0.0; TERMS];
                let angles = self.dynamics.excitation.angles(self.time);
                end[0] = if of == TrainSide::Rotor { angles.0 } else { angles.1 };
                let speed = self.expansion.end_speed(of as usize);
                for n in 0..self.expansion.terms - 1 {
                    end[n + 1] = self.expansion.unit * speed[n] / (n + 1) as f64;
                }
                end
            }
            // With two free chains the angle of the stator's outermost inertia is integrated.
            Some(_) if of == TrainSide::Stator && system.rotor.speed.is_some() => {
                self.expansion.state[system.slip + ANGLE]
            }
            Some(_) => {
                let other = TrainSide::BOTH[1 - of as usize];
                let mut angle = self.angle(TrainPart { of: other, index: 0 });
                add(&mut angle, side.sign, &self.expansion.state[system.slip]);
                for i in 0..index.min(side.shafts()) {
                    add(&mut angle, side.sign, twist(i));
                }
                return angle;
            }
        };
        for i in index..side.shafts() {
            add(&mut angle, -side.sign, twist(i));
        }
        angle
    }
}

/// Number of terms for a step of `x` units: as many as the exponential needs, and two that show its error.
fn terms_for(x: f64) -> usize {
    let (mut terms, mut last) = (3, 1.0);
    while terms < TERMS && last > TOLERANCE {
        last *= x / (terms - 2) as f64;
        terms += 1;
    }
    terms
}

fn add(sum: &mut Series, factor: f64, other: &Series) {
    for (sum, c) in sum.iter_mut().zip(other) {
        *sum += factor * c;
    }
}
