//! Results of a run or a case: summary, accuracy, sensitivities, stability.
//!
//! | module | what it is |
//! |---|---|
//! | `run` | run into a recorder, a file, or memory, with its summary |
//! | `summary`, `headline` | main numbers and outcome, and their text |
//! | `attractor`, `section`, `forcing` | periodic motion: by events, by the forcing, or without both |
//! | `exponent` | largest Lyapunov exponent of an aperiodic motion |
//! | `warning`, `witness`, `sequence` | warnings about a result; the case by another method, and its repetition with finer settings |
//! | `certification`, `certify_report` | certificate of a result and its sensitivities; as a document, and as groups of a file |
//! | `saved_certificate` | certificate of a case or a result, in a copy of the result |
//! | `ladder`, `certificate`, `bands` | runs by independent methods until a deadline; verdicts and uncertainties; error bands |
//! | `exact` | events of the oracle, or of another code with more digits |
//! | `advice` | remedies for a result with too few true digits |
//! | `linearised`, `sensitivity` | derivatives of a run; effects of changed parameters |
//! | [`stability`] | modes, steady sliding and its stability, growth |
//! | [`work_precision`] | errors and costs of methods by tolerances |
//! | `distribution` | a quantity over many runs |

pub mod advice;
mod attractor;
pub mod bands;
pub mod certificate;
pub mod certification;
mod certify_report;
pub mod distribution;
pub mod exact;
pub mod exponent;
pub mod forcing;
pub mod headline;
pub mod ladder;
pub mod linearised;
pub(crate) mod quantity;
mod run;
mod saved_certificate;
mod section;
pub mod sensitivity;
mod sequence;
pub mod stability;
pub mod summary;
pub mod warning;
pub mod witness;
pub mod work_precision;

pub use attractor::{Attractor, Extremes};
pub use certificate::{Certificate, certify};
pub use certification::{Certified, Certify, Stage, Written};
pub use certify_report::{CertifyReport, least_digits};
pub use exponent::{Exponent, Neighbours};
pub use headline::{HeadlineRow, headline};
pub use ladder::Deadline;
pub(crate) use run::recorded;
pub use run::{KeptReport, Recorded, SavedReport, SavedRun};
pub use saved_certificate::{CertificateRequest, CertifiedFile, SavedCertificate, without_case};
pub use section::{LONGEST_PERIOD, RECURRENCE_TOLERANCE};
pub use stability::Growth;
pub use stability::Modes;
pub use stickslip_system::record::{Cycle, CycleStatistics};
pub use summary::{Outcome, Summary};
pub use warning::Warning;
pub use witness::{Witness, witness};
