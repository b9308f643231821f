//! Why a candidate differs: mistakes that would make the reference's run the candidate.
//!
//! A `Cause` is one mistake with its values. It proposes itself from the `Evidence`, runs the
//! reference with the mistake, and is a cause if the motion leaves so little of the candidate's difference that its
//! least share (`Cause::least`) is explained. Symptoms, equations read off the samples, and fits only propose; the runs
//! decide. `ORDER` is the order in which causes are tried.
//!
//! | module | what it is |
//! |---|---|
//! | `search` | tries the causes in their order, and chooses among those that explain as much |
//! | `evidence`, `observation`, `judge` | what is known of the candidate, runs of the case, the share that a motion explains |
//! | `motion` | a run of a case, sampled like the candidate |
//! | `fit` | parameters that may differ, and the fit of values by runs |
//! | `equations` | parameters read off the samples: start values, and evidence that needs no run |
//! | `report`, `brief`, `parameters` | the causes in words and data |
//! | `filing`, `clock` | mistakes in a file of a right motion |
//! | `changed`, `kick`, `number`, `smooth`, `late` | mistakes of the case, and of single events |
//! | `stepper`, `steps` | solvers with steps |

mod brief;
mod changed;
pub mod clock;
pub mod equations;
mod evidence;
mod filing;
mod fit;
mod judge;
mod kick;
mod late;
mod motion;
mod number;
mod observation;
mod parameters;
mod report;
mod search;
pub(crate) mod smooth;
mod stepper;
mod steps;

pub use kick::OtherKick;
pub use parameters::{Agreement, EventAgreement, FoundBy, OtherNumber, OtherParameters};

pub(crate) use evidence::Evidence;
pub(crate) use judge::{CLOSE, EXPLAINED, Judged};
pub(crate) use kick::JumpPass;
pub(crate) use motion::Played;
pub(crate) use observation::{Observation, ObservationPass};
pub(crate) use report::{Causes, Passes, Shown};
pub(crate) use search::{Search, Tried};
pub(crate) use stepper::Stepper;

use crate::diagnosis::CauseKind;
use changed::ChangedSystem;
use clock::{ClockRate, Clocked};
use filing::FiledRows;
use late::OneLate;
use number::ChangedNumber;
use smooth::Smooth;
use std::fmt::Debug;
use std::sync::Arc;
use steps::SteppingSolver;

/// A mistake with its values, which would make the reference's run the candidate.
pub(crate) trait Cause: Debug + Send + Sync {
    /// Mistakes of this kind that the evidence suggests.
    fn propose(search: &Search<'_>) -> Vec<Proposal>
    where
        Self: Sized;

    /// The motion with the mistake from one of [`Evidence::starts`], sampled like the candidate; `None` if it cannot be
    /// run from there, or the limits of runs or of wall time are reached.
    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played>;

    /// The smallest explained share, 0 to 1, with which it is a cause. Values that are fitted to samples need more than
    /// a change without values, because some value brings any two motions closer.
    fn least(&self, evidence: &Evidence<'_>) -> f64;

    /// Kind of the diagnosis, and the mistake in words: "its kick acts on the rotor's surface alone".
    fn words(&self, search: &Search<'_>) -> (CauseKind, String);

    /// Number of values that differ, or the complexity of the mistake on that scale. Among mistakes that explain as
    /// much, the one with the least is named.
    fn complexity(&self, evidence: &Evidence<'_>) -> usize;

    /// Number of values that are fitted to the samples. A state is read off one sample.
    fn fitted(&self, evidence: &Evidence<'_>) -> usize {
        match self.is_state() {
            true => 0,
            false => self.complexity(evidence),
        }
    }

    /// How well the motion explains the candidate.
    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        evidence.judged(played, f64::INFINITY)
    }

    /// The candidate shows the mistake directly, by its equations or its creep.
    fn is_told(&self) -> bool {
        false
    }

    /// The mistake is in the file, such as another clock, and not in the motion. A mistake of the motion that explains
    /// as much is named beside it.
    fn is_of_file(&self) -> bool {
        false
    }

    /// The search ends if this is a cause.
    fn is_certain(&self, _evidence: &Evidence<'_>, _judged: &Judged) -> bool {
        false
    }

    /// It is another initial state. Runs from the candidate's own state then include it.
    fn is_state(&self) -> bool {
        false
    }

    /// A solver with steps may look like this.
    fn is_like_steps(&self) -> bool {
        self.stepper().is_some()
    }

    /// Whether the events of the motion are to be counted in the report.
    fn has_events(&self, _judged: &Judged) -> bool {
        true
    }

    /// End of the judged part, s, if rounding decides what the solver does from there on.
    fn up_to(&self) -> Option<f64> {
        None
    }

    /// The parameters of the case that differ, if the mistake is one.
    fn parameters(&self) -> Option<&ChangedNumber> {
        None
    }

    /// Parameters of the case that differ, with their values in SI.
    fn numbers(&self) -> &[(String, f64)] {
        self.parameters().map_or(&[], |parameters| &parameters.numbers)
    }

    /// The solver with steps, if the mistake is one. It begins at [`Evidence::origin`].
    fn stepper(&self) -> Option<&Stepper> {
        None
    }

    /// The diagnosis of the best of `all` that explain as much, and the data that the report has besides: parameters, a
    /// kick, a clock.
    fn report(&self, search: &Search<'_>, all: &[Tried], causes: &mut Causes) -> (CauseKind, String) {
        let (kind, words) = self.words(search);
        let beside = match self.is_of_file() {
            true => filing::beside(search, kind.name(), all, causes),
            false => String::new(),
        };
        (kind, format!("{words}: {}{beside}", search.outcome(&all[0])))
    }
}

/// A mistake that is to be tried.
pub(crate) type Proposal = Arc<dyn Cause>;

fn proposals<C: Cause + 'static>(all: impl IntoIterator<Item = C>) -> Vec<Proposal> {
    all.into_iter().map(|cause| Arc::new(cause) as Proposal).collect()
}

/// Whether mistakes are still needed, and what proposes those that are tried at once.
pub(crate) type Round = (fn(&Search<'_>) -> bool, &'static [fn(&Search<'_>) -> Vec<Proposal>]);

fn always(_: &Search<'_>) -> bool {
    true
}

fn needs_steps(search: &Search<'_>) -> bool {
    search.with_steps && !search.has_exact()
}

/// The order in which causes are tried: what the file or the samples show directly first, then one mistake with few
/// values, then solvers with steps and smooth laws, and two mistakes at once last.
pub(crate) const ORDER: &[Round] = &[
    (always, &[Clocked::propose]),
    (always, &[FiledRows::propose, ClockRate::propose]),
    (always, &[ChangedSystem::unkicked_up_to_onset]),
    (
        always,
        &[
            Smooth::shown,
            ChangedNumber::of_equations,
            ChangedNumber::of_breakaways,
            ChangedSystem::propose,
            ChangedSystem::kick_times,
            OneLate::propose,
        ],
    ),
    (|search| search.lacks_number(), &[ChangedNumber::mistaken]),
    (|search| search.lacks_number(), &[ChangedNumber::propose]),
    (needs_steps, &[SteppingSolver::of_tolerances, SteppingSolver::propose]),
    (needs_steps, &[SteppingSolver::variants_of_closest]),
    (
        |search| search.with_steps && search.lacks_cause(),
        &[SteppingSolver::of_low_order],
    ),
    (needs_steps, &[SteppingSolver::variants_of_closest]),
    (|search| search.lacks_cause(), &[Smooth::propose]),
    (
        |search| search.with_steps && search.lacks_cause(),
        &[SteppingSolver::of_usual_tolerances],
    ),
    (needs_steps, &[SteppingSolver::variants_of_closest]),
    (|search| search.lacks_cause(), &[ChangedNumber::pairs]),
    (
        |search| search.with_steps && !search.explains_all(),
        &[SteppingSolver::with_numbers],
    ),
    (always, &[ChangedNumber::as_friction]),
    (
        |search| search.with_steps && !search.has_cause(),
        &[SteppingSolver::up_to_where_known],
    ),
];
