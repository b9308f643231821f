//! The rows of a run: samples, events and segments, in SI units.

use crate::model::Mode;

/// Declares a struct of channels: field, unit (UDUNITS), description with the paper's symbol.
macro_rules! channels {
    ($(#[$doc:meta])* $name:ident { $($field:ident, $unit:literal, $long_name:literal;)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $name { $(#[doc = concat!($long_name, ", ", $unit)] pub $field: f64,)+ }
        impl $name {
            /// (name, UDUNITS unit, description) of each channel, in the order of [`Self::values`].
            pub const DESCRIPTIONS: &'static [(&'static str, &'static str, &'static str)] =
                &[$((stringify!($field), $unit, $long_name),)+];
            /// Number of channels.
            pub const COUNT: usize = Self::DESCRIPTIONS.len();
            /// The values in the order of `DESCRIPTIONS`.
            pub fn values(&self) -> [f64; Self::COUNT] {
                [$(self.$field,)+]
            }
            /// The inverse of [`Self::values`].
            pub fn from_values([$($field,)+]: [f64; Self::COUNT]) -> Self {
                Self { $($field,)+ }
            }
        }
    };
}

channels! {
    /// The mechanical state, stored before and after every event.
    State {
        z, "m", "axial displacement z";
        z_dot, "m s-1", "axial velocity z'";
        theta, "rad", "rotor angle theta";
        theta_dot, "rad s-1", "rotor speed theta'";
        phi1, "rad", "stator surface angle phi_1 (the stator twist)";
        phi1_dot, "rad s-1", "stator surface speed phi_1'";
        phi2, "rad", "rotor surface angle phi_2";
        phi2_dot, "rad s-1", "rotor surface speed phi_2'";
        rotor_twist, "rad", "rotor twist theta - phi_2";
        rotor_twist_rate, "rad s-1", "rotor twist rate theta' - phi_2'";
        relative_velocity, "rad s-1", "relative velocity omega_r = phi_2' - phi_1'";
        slip_displacement, "rad", "slip displacement phi_2 - phi_1";
    }
}

channels! {
    /// Forces, torques and energies at a sample.
    Channels {
        applied_force, "N", "actuating force F";
        normal_force, "N", "contact force F_n";
        friction_torque, "N m", "torque on the stator surface through the interface";
        transmitted_torque, "N m", "T_f = (T_r + T_s)/2";
        energy_kinetic, "J", "kinetic energy";
        energy_elastic, "J", "elastic energy";
        work_applied, "J", "work of the actuating force since the start";
        work_perturbation, "J", "work of the kicks since the start";
        dissipated_friction, "J", "energy dissipated by friction since the start";
        dissipated_damping, "J", "energy dissipated by c_a and c_t since the start";
        energy_residual, "J", "kinetic + elastic + dissipated - works - initial energy";
    }
}

/// One row of the trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time, s; strictly increasing.
    pub time: f64,
    /// Mode at this time.
    pub mode: Mode,
    /// Index of its segment.
    pub segment: u32,
    /// Positions and speeds, SI.
    pub state: State,
    /// Forces, torques and energies, SI.
    pub channels: Channels,
}

/// A stretch of a motion between two events, with a polynomial for every quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DensePiece<'a> {
    /// Start, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
    /// Mode of the piece.
    pub mode: Mode,
    /// Index of its segment.
    pub segment: u32,
    /// Chebyshev coefficients of each quantity, [`COEFFICIENTS`](crate::numerics::chebyshev::COEFFICIENTS) in a row:
    /// [`State`], [`Channels`], then further values of the run.
    pub coefficients: &'a [f64],
}

/// Kind of an event; the discriminants are the codes of the result file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EventKind {
    /// The surfaces come to relative rest and stay.
    Stick = 0,
    /// The interface breaks away.
    Slip = 1,
    /// The relative velocity changes its sign without a stick.
    Reversal = 2,
    /// The normal force falls to zero and the contact opens.
    Separation = 3,
    /// The contact closes again.
    Contact = 4,
    /// A perturbation of the case acts.
    Kick = 5,
    /// The slope or the value of the actuating force changes.
    Corner = 6,
    /// Steady sliding loses its stability.
    Destabilised = 7,
    /// Steady sliding regains its stability.
    Restabilised = 8,
}

impl EventKind {
    /// Every kind, in the order of the codes.
    pub const ALL: [EventKind; 9] = [
        EventKind::Stick,
        EventKind::Slip,
        EventKind::Reversal,
        EventKind::Separation,
        EventKind::Contact,
        EventKind::Kick,
        EventKind::Corner,
        EventKind::Destabilised,
        EventKind::Restabilised,
    ];

    /// The code in result files.
    pub fn code(self) -> i8 {
        self as i8
    }

    /// The name in result files and reports.
    pub fn name(self) -> &'static str {
        [
            "stick",
            "slip",
            "reversal",
            "separation",
            "contact",
            "kick",
            "corner",
            "destabilised",
            "restabilised",
        ][self as usize]
    }

    /// Whether it belongs to the event sequence; other kinds are information.
    pub fn in_event_sequence(self) -> bool {
        matches!(
            self,
            EventKind::Stick | EventKind::Slip | EventKind::Reversal | EventKind::Separation | EventKind::Contact
        )
    }
}

/// An event, with the state on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Time, s; events may be simultaneous.
    pub time: f64,
    /// Kind of event.
    pub kind: EventKind,
    /// Mode after the event; its sense is the sign of the relative velocity in slip, 0 otherwise.
    pub mode_after: Mode,
    /// Index of the segment that the event ends, or in which it lies.
    pub segment: u32,
    /// State just before the event.
    pub before: State,
    /// State just after the event; different if the event is a jump.
    pub after: State,
    /// T_f / r just before the event, N.
    pub internal_force: f64,
}

/// A stretch integrated without a restart, with its costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Start, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
    /// Mode, constant in the segment.
    pub mode: Mode,
    /// Solver: "cvode-bdf", "cvode-adams", "erk", "esdirk", "closed-form", "series" or "paper".
    pub solver: &'static str,
    /// Whether steps had to resolve the fast torsional mode; `None` from a file that does not say.
    pub resolved: Option<bool>,
    /// Accepted steps.
    pub steps: u64,
    /// Evaluations of the right-hand side.
    pub rhs_evaluations: u64,
    /// Evaluations of the Jacobian.
    pub jacobian_evaluations: u64,
    /// Factorisations of the linear solver.
    pub linear_solver_setups: u64,
    /// Steps rejected by the test of the local error.
    pub error_test_failures: u64,
    /// Iterations of the nonlinear solver.
    pub nonlinear_iterations: u64,
    /// Failures of the nonlinear solver to converge.
    pub nonlinear_convergence_failures: u64,
    /// Evaluations of the guards.
    pub root_evaluations: u64,
    /// Order of the last step, 0 if the solver has none.
    pub last_order: u32,
    /// Last step, s.
    pub last_step: f64,
}
