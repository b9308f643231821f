//! stickslip: high-accuracy reference runs of friction-induced vibration.
//!
//! Two chains of inertias and shafts touch at one contact with dry friction: a rotor that a stator brakes, a mass on a belt, a
//! drill string on rock, a clutch. Near its stop the paper's brake sticks and slips dozens of times within milliseconds.
//! The crate integrates such a system with SUNDIALS or by Taylor series, locates every switch, and stores the run in HDF5.
//!
//! The layers, each of which knows only those before it:
//!
//! | module | what it is |
//! |---|---|
//! | `input` | reading texts within limits |
//! | `quote` | what a message quotes of an input |
//! | `workers` | the pool of threads for independent jobs |
//! | [`numerics`] | Taylor series, polynomial roots, Radau IIA; no physics |
//! | [`sundials`] | safe CVODE and ARKODE; no physics |
//! | [`friction`] | the friction laws, behind one interface |
//! | [`signal`] | what is applied from outside, as a function of time |
//! | [`model`] | the equations: pure functions of parameters and state; no solver |
//! | [`record`] | what a run is made of: samples, events, segments, and the recorder that takes them |
//! | [`hybrid`] | the event automaton: modes, guards, transitions, engines; generic over the model |
//! | [`simulation`] | a system run by the automaton: which engine where, samples, events |
//! | [`results`] | the HDF5 files: schema, writer, reader |
//! | [`case`] | the TOML case file: units, validation, overrides; the system that it describes, and the words for its places |
//! | `provenance` | what a file says of the program, the machine and the command that made it |
//! | [`run`](Run) | one run of a case: the front door |
//! | `study` | study files: what sweeps, calibrations and work-precision studies have in common |
//! | [`oracle`] | the model solved independently, by Taylor series with up to 611 digits |
//! | [`analysis`] | what is computed from a run: statistics, growth, certificates, sensitivities |
//! | [`cycle`] | periodic motions: found by Newton's method, with their multipliers |
//! | [`compare`] | the result of any solver compared with a reference |
//! | [`export`] | tables of results as CSV, NPZ, MAT and Parquet; benchmark packages (feature `cli`) |
//! | [`sweep`] | many runs: studies over axes, critical curves |
//! | [`continuation`] | branches of steady sliding and of cycles, and their special points |
//! | [`calibrate`] | parameters that reproduce measured numbers |
//! | [`plot`] | figures: the paper's, and any channel, as SVG and PNG; the interactive page of a run (feature `plot`) |
//! | [`cli`] | arguments to validated options to a call (feature `cli`) |

pub mod analysis;
pub mod calibrate;
pub mod case;
#[cfg(feature = "cli")]
pub mod cli;
pub mod compare;
pub mod continuation;
pub mod cycle;
#[cfg(feature = "cli")]
pub mod export;
pub mod friction;
pub mod hybrid;
mod input;
pub mod model;
pub mod numerics;
pub mod oracle;
#[cfg(feature = "plot")]
pub mod plot;
mod provenance;
mod quote;
pub mod record;
pub mod results;
mod run;
pub mod signal;
pub mod simulation;
mod study;
pub mod sundials;
pub mod sweep;
mod workers;

pub use analysis::{Certify, SavedRun};
pub use compare::Reference;
pub use run::Run;
pub use sweep::Sweep;
