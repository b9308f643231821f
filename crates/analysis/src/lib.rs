//! What did it come to, which digits are true, what moves what, and what repeats?
//!
//! A builder is made for a case, a study or a result. Its methods change the defaults, and `start` computes it:
//! [`SavedRun`] runs a case into a result file, [`Certify`] tells how many digits of a result are true, [`Sweep`] runs
//! a study, and [`Continuation`](continuation::Continuation) follows branches. Two functions complete them:
//! [`cycle::find`] looks for a periodic motion, and [`calibrate`](calibrate::calibrate) finds parameters.
//!
//! | module | what it is |
//! |---|---|
//! | [`analysis`](mod@analysis) | from a run: summary, attractor, warnings, witness, certificate, sensitivities, stability, work and precision |
//! | [`cycle`] | periodic motions, found by Newton's method, with their multipliers |
//! | [`continuation`] | branches of steady sliding and of cycles, and their special points |
//! | [`sweep`] | many runs: studies over axes, critical curves, shards |
//! | [`calibrate`](mod@calibrate) | parameters that reproduce measured numbers |
//! | [`study`] | the reader of study files |
//! | [`provenance`] | statements of a file about the program, the machine and the command |
//!
//! The crate draws and prints nothing. It does not read results of other solvers; `stickslip-compare` does.
//!
//! A certified run of a block under a harmonic force. The oracle decides, because it has more digits than a double.
//!
//! ```
//! use stickslip_analysis::Certify;
//! use stickslip_analysis::analysis::certificate::Verdict;
//! use stickslip_case::{Case, CaseSource, Override};
//! use stickslip_engine::Run;
//! use stickslip_system::record::MemoryRecorder;
//!
//! let (source, overrides) = (CaseSource::built_in("block")?, [Override::parse("output.end_time=5")?]);
//! let case = Case::read(&source, &overrides)?;
//! let mut result = MemoryRecorder::default();
//! Run::new(&case).record(&mut result).start()?;
//!
//! let exact = Case::exact(&source, &overrides)?;
//! let certified = Certify::new(&case).oracle(&exact, 25).start(&result)?;
//! let certificate = certified.certificate;
//! assert_eq!(certificate.verdict, Verdict::Converged);
//! assert!(certificate.by_oracle && certificate.least_digits() >= Some(13));
//!
//! // The block stops at 0.338608184671980617 s.
//! let oracle = certified.exact.ok_or("no oracle")?;
//! assert_eq!(oracle.report.events[0].time.to_decimal(18), "0.338608184671980617");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod analysis;
pub mod calibrate;
pub mod continuation;
pub mod cycle;
pub mod earlier;
mod error;
mod given;
pub mod provenance;
pub mod study;
pub mod sweep;

pub use analysis::{Certify, SavedCertificate, SavedRun};
pub use error::{Error, ErrorKind};
pub use given::{GivenCase, overrides};
pub use sweep::Sweep;
