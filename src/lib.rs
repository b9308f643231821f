//! stickslip: high-accuracy reference runs of friction-induced vibration.
//!
//! Two chains of inertias and shafts touch at one contact with dry friction: a rotor that a stator brakes, a mass on a belt, a
//! drill string on rock, a clutch. Near its stop the paper's brake sticks and slips dozens of times within milliseconds.
//! The program integrates such a system with SUNDIALS or by Taylor series, locates every switch, and stores the run in HDF5.
//!
//! ```
//! use stickslip::Run;
//! use stickslip::case::{Case, CaseSource};
//! use stickslip::record::MemoryRecorder;
//!
//! let case = Case::read(&CaseSource::built_in("paper-si")?, &[])?;
//! let mut recorder = MemoryRecorder::default();
//! let report = Run::new(&case).record(&mut recorder).start()?;
//! assert_eq!(report.end, case.output.end_time);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Five types begin a piece of work: [`Run`], [`SavedRun`], [`Certify`], [`Reference`] and [`Sweep`].
//!
//! # The crates
//!
//! This crate is the program and a facade: it hands on the modules of the crates below it. Each crate can be used by itself, and
//! depends on those behind its arrow alone.
//!
//! | crate | question | depends on | modules here |
//! |---|---|---|---|
//! | `stickslip-system` | What are the equations? | | [`model`], [`friction`], [`signal`], [`record`], [`numerics`] |
//! | `stickslip-engine` | How does it move? | -> `system` | [`simulation`], [`hybrid`], [`sundials`] |
//! | `stickslip-oracle` | What is the truth? | -> `system` | [`oracle`] |
//! | `stickslip-files` | How does it lie on disk? | -> `system` | [`results`] |
//! | `stickslip-case` | What does the text say? | -> `engine` (options of a run) | [`case`] |
//! | `stickslip-analysis` | What did it come to, which digits are true, what moves what, what repeats? | -> `engine`, `oracle`, `files`, `case` | [`analysis`], [`cycle`], [`continuation`], [`sweep`], [`calibrate`], [`provenance`] |
//! | `stickslip-compare` | What is wrong with that other solver? | -> `engine`, `files`, `case` | [`compare`] |
//! | `stickslip` | What does one see and type? | -> all | `plot` (feature `plot`), `comparing`, `report`, `export` and `cli` (feature `cli`) |
//!
//! It computes nothing itself, and reads no file but through the crates below it.

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
pub mod comparing;
#[cfg(feature = "cli")]
pub mod export;
#[cfg(feature = "plot")]
pub mod plot;
#[cfg(feature = "cli")]
pub mod report;

#[cfg(feature = "plot")]
mod error;
#[cfg(feature = "plot")]
pub mod output;
#[cfg(feature = "plot")]
pub use error::Error;

pub use stickslip_analysis::{analysis, calibrate, continuation, cycle, provenance, sweep};
pub use stickslip_case as case;
pub use stickslip_compare as compare;
pub use stickslip_engine::{self as engine, hybrid, simulation, sundials};
pub use stickslip_files as results;
pub use stickslip_oracle as oracle;
pub use stickslip_system::{friction, model, numerics, record, signal};

pub use stickslip_analysis::{Certify, GivenCase, SavedCertificate, SavedRun, Sweep, overrides};
pub use stickslip_compare::Reference;
pub use stickslip_engine::Run;
pub use stickslip_system::watch::{Watch, go_on_unless};

/// States the commit of this build (`git rev-parse --short HEAD`, with `+dirty` after local changes) in the files that are written from
/// now on: `program_commit` of /meta. The program and the Python module call it first. Without it, files say `unknown`.
pub fn name_build() {
    provenance::set_commit(env!("STICKSLIP_COMMIT"));
}
