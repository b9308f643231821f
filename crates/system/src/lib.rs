//! What are the equations? The system: two chains of inertias and shafts, the contact between their surfaces, and the
//! external forces, torques and speeds.
//!
//! A [`System`](model::system::System) states the problem: two [`Train`](model::system::Train)s, a friction law, the
//! source of the normal force, and the initial state. Its numbers are doubles or exact rationals
//! ([`ExactSystem`](model::system::ExactSystem)). [`SystemEquations`](model::equations::SystemEquations) are its
//! equations. [`record`] defines the rows of a run: samples, events and segments.
//!
//! | module | contents |
//! |---|---|
//! | [`model`] | the system and its equations: pure functions of parameters and state |
//! | [`friction`] | the friction laws, behind one interface |
//! | [`signal`] | forces, torques and speeds as functions of time |
//! | [`record`] | the rows of a run, and recorders |
//! | [`numerics`] | Taylor series, polynomial roots, eigenvalues, Radau IIA; no physics |
//! | [`quote`] | quotations of an input in messages |
//! | [`watch`] | observers of long computations |
//!
//! The crate integrates nothing, reads no text and writes no file. It accepts numbers unchecked; the reader of cases
//! (`stickslip-case`) checks them.
//!
//! Example: a mass of 2 kg hangs on a spring of 8 N/m and rubs on a belt that moves at 1 m/s, with a normal force of
//! 10 N. In translation the radius is 1, and metres, newtons and kilograms replace radians, newton metres and
//! kilogram square metres.
//!
//! ```
//! use stickslip_system::friction::{Exponential, Law};
//! use stickslip_system::model::equations::{Outside, SystemEquations};
//! use stickslip_system::model::system::{ContactLaw, End, Initial, Pressing, System, Train};
//! use stickslip_system::model::{BreakawayTest, Mode};
//! use stickslip_system::signal::Drive;
//!
//! let law = Exponential { low_speed: 0.5, high_speed: 0.25, decay: 2.0 };
//! assert_eq!(law.coefficient(1.0), 0.25 + 0.25 * (-2.0_f64).exp());
//!
//! let belt = Train {
//!     inertia: vec![], // the surface is itself the driven end
//!     stiffness: vec![],
//!     damping: vec![],
//!     viscous: vec![],
//!     end: End::Driven(Drive::Value(1.0)),
//!     torque: None,
//! };
//! let mass = Train {
//!     inertia: vec![2.0],
//!     stiffness: vec![8.0],
//!     damping: vec![0.0],
//!     viscous: vec![0.0],
//!     end: End::Fixed,
//!     torque: None,
//! };
//! let system = System {
//!     rotor: belt,
//!     stator: mass,
//!     radius: 1.0,
//!     pressing: Pressing::Force(Drive::Value(10.0)),
//!     breakaway: 0.5,
//!     breakaway_test: BreakawayTest::Transmitted,
//!     law: law.into(),
//!     contact: ContactLaw::StickSlip,
//!     initial: Initial { rotor_twist: vec![], rotor_speed: vec![], stator_twist: vec![0.1], stator_speed: vec![0.0] },
//!     kicks: vec![],
//! };
//!
//! let equations = SystemEquations::new(&system);
//! let mut outside = Outside::default();
//! outside.rotor.speed = 1.0; // m/s, of the belt
//! outside.normal_force = 10.0; // N
//! let mut state = vec![0.0; equations.dimension];
//! state[equations.stator.twists] = 0.1; // m, of the spring
//! assert_eq!(equations.relative_velocity(&outside, &state), 1.0);
//!
//! // In slip 2 x'' = mu(1) 10 - 8 0.1.
//! let mut rates = vec![0.0; equations.dimension];
//! equations.rates(Mode::SlipForward, 1.0, 0, &outside, &state, &mut rates);
//! let acceleration = (10.0 * (0.25 + 0.25 * (-2.0_f64).exp()) - 0.8) / 2.0;
//! assert!((rates[equations.stator.twists + 1] - acceleration).abs() < 1e-15);
//! ```

pub mod friction;
pub mod model;
mod named;
pub mod numerics;
pub mod quote;
pub mod record;
pub mod signal;
pub mod watch;
