//! stickslip: high-accuracy reference runs of friction-induced vibration.
//!
//! A rotor is braked by a stator. Their contact has a torsional mode of about 4 kHz and a friction
//! that falls with speed; near the stop it sticks and slips dozens of times within milliseconds.
//! The crate integrates that brake with SUNDIALS, locates every switch, and stores the run in HDF5.
//!
//! The layers, each of which knows only those before it:
//!
//! | module | what it is |
//! |---|---|
//! | [`sundials`] | safe CVODE and ARKODE; no physics |
//! | [`series`] | Taylor series and Radau collocation for numbers of any precision; no physics |
//! | [`friction`] | the friction laws, behind one interface |
//! | [`model`] | the physics: pure functions of parameters and state; no solver |
//! | [`hybrid`] | the event automaton: modes, guards, transitions, generic over the model |
//! | [`simulation`] | the brake run by the automaton: which solver where, samples, events |
//! | [`results`] | the HDF5 result file: schema, writer, reader |
//! | [`case`] | the TOML case file: units, validation, overrides |
//! | [`oracle`] | the model solved independently, by Taylor series with up to 611 digits |
//! | [`analysis`] | what is computed from a run: stick-slip statistics, growth exponent |
//! | [`sweep`] | many runs: studies over axes, critical curves |
//! | [`calibrate`] | parameters that reproduce measured numbers |
//! | [`plot`] | figures: the paper's, and any channel, as SVG and PNG; the interactive page of a run |
//! | [`cli`] | arguments to validated options to a call |

pub mod analysis;
pub mod calibrate;
pub mod case;
pub mod cli;
pub mod friction;
pub mod hybrid;
mod input;
pub mod model;
pub mod oracle;
pub mod plot;
mod quote;
pub mod results;
pub mod series;
pub mod simulation;
pub mod sundials;
pub mod sweep;
