//! How does it move? A system with dry friction is integrated, and every event is located.
//!
//! [`Run`] runs a system by a [`Method`](simulation::Method). A [`Recorder`](stickslip_system::record::Recorder) gets its
//! rows as they are computed, and the [`RunReport`](simulation::RunReport) its events.
//!
//! | module | what it is |
//! |---|---|
//! | [`sundials`] | safe CVODE and ARKODE; no physics |
//! | [`hybrid`] | the event automaton: modes, guards, transitions, engines |
//! | [`simulation`] | runs of a system by the automaton: choice of the engines, samples, events |
//! | [`run`] | one run of a system, and its recording |
//! | [`workers`] | the pool of threads for independent jobs |
//!
//! The crate reads no case and writes no file. How many digits of a run are correct is a question for
//! `stickslip-analysis`.
//!
//! # A run
//!
//! A mass of 1 kg on a spring of 1 N/m starts 3.5 m from its rest and slides on the ground, whose friction is 1 N. It
//! turns at x = -1.5 m after half a period, pi s, and stops after another half at x = -0.5 m, where friction holds it.
//!
//! ```
//! use std::f64::consts::PI;
//! use stickslip_engine::Run;
//! use stickslip_engine::simulation::{Method, OutputOptions, SolverOptions};
//! use stickslip_system::friction::Coulomb;
//! use stickslip_system::model::BreakawayTest;
//! use stickslip_system::model::system::{ContactLaw, End, Initial, Pressing, System, Train};
//! use stickslip_system::record::EventKind;
//! use stickslip_system::signal::Drive;
//!
//! let ground = Train {
//!     inertia: vec![],
//!     stiffness: vec![],
//!     damping: vec![],
//!     viscous: vec![],
//!     end: End::Fixed,
//!     torque: None,
//! };
//! let mass = Train {
//!     inertia: vec![1.0],
//!     stiffness: vec![1.0],
//!     damping: vec![0.0],
//!     viscous: vec![0.0],
//!     end: End::Fixed,
//!     torque: None,
//! };
//! let system = System {
//!     rotor: ground,
//!     stator: mass,
//!     radius: 1.0,
//!     pressing: Pressing::Force(Drive::Value(10.0)),
//!     breakaway: 0.1,
//!     breakaway_test: BreakawayTest::Transmitted,
//!     law: Coulomb { kinetic: 0.1 }.into(),
//!     contact: ContactLaw::StickSlip,
//!     initial: Initial { rotor_twist: vec![], rotor_speed: vec![], stator_twist: vec![3.5], stator_speed: vec![0.0] },
//!     kicks: vec![],
//! };
//!
//! let output = OutputOptions::at_the_ends(10.0);
//! for method in [Method::Series, Method::Cvode] {
//!     let solver = SolverOptions { method, ..SolverOptions::default() };
//!     let report = Run::of_system(&system, 0.0, &solver, &output).start()?;
//!     let [turn, stop] = &report.events[..] else { panic!("{:?}", report.events) };
//!     assert_eq!((turn.kind, stop.kind), (EventKind::Reversal, EventKind::Stick));
//!     assert!((turn.time - PI).abs() < 1e-9 && (stop.time - 2.0 * PI).abs() < 1e-9);
//!     assert!((stop.after.phi1 + 0.5).abs() < 1e-9);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Other equations
//!
//! [`sundials`] knows no friction. It solves any smooth problem, up to the zero of a function:
//!
//! ```
//! use stickslip_engine::sundials::{AdvanceTarget, Advanced, Direction, ErkTable, OdeSystem, Solver, Tolerances};
//!
//! /// x'' = -x, watched for x = 0.
//! struct Oscillator;
//!
//! impl OdeSystem for Oscillator {
//!     fn dimension(&self) -> usize {
//!         2
//!     }
//!     fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
//!         ydot[0] = y[1];
//!         ydot[1] = -y[0];
//!     }
//!     fn roots(&mut self, _t: f64, y: &[f64], g: &mut [f64]) {
//!         g[0] = y[0];
//!     }
//! }
//!
//! let tolerances = Tolerances::uniform(1e-12, 1e-12, 2);
//! let mut solver = Solver::new(Oscillator, ErkTable::DormandPrince7s45, 0.0, &[1.0, 0.0], &tolerances)?;
//! solver.set_crossings(&[Direction::Falling])?;
//! assert_eq!(solver.advance(10.0, AdvanceTarget::Normal)?, Advanced::Roots);
//! assert!((solver.time() - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
//! # Ok::<(), stickslip_engine::Error>(())
//! ```

mod error;
pub mod hybrid;
pub mod run;
pub mod simulation;
pub mod sundials;
pub mod workers;

pub use error::{Error, ErrorKind};
pub use run::{Run, Runnable};
