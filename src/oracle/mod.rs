//! An independent oracle: the model solved by Taylor series with as many digits as one likes.
//!
//! It shares the parameters with the rest of the program, the names of modes and events, and nothing else: neither
//! the equations' code nor the logic of events. Where both agree, both are right, or the model as stated
//! (docs/model.md) was misread twice in the same way.
//!
//! | file | what it is |
//! |---|---|
//! | `float` | floating-point numbers of some machine words, in which everything is computed |
//! | `number` | what comes out, exact to and from rationals and decimals |
//! | `elementary` | sine, cosine, arc tangent and hyperbolic tangent |
//! | `pieces` | a signal without harmonics, line by line |
//! | `courses` | all signals between their corners |
//! | `axial` | the axial motion and the force that drives it |
//! | `friction` | the friction laws as recurrences |
//! | `contact` | the torque of the contact: slip, regularised laws, bristles |
//! | `equations` | the equations of two chains of inertias as recurrences of Taylor coefficients |
//! | `margin` | the resistance that decides when steady sliding becomes unstable |
//! | `scales` | the least scale of each component |
//! | `steps` | order and length of a step from the precision |
//! | `roots` | the first zero of a guard on a step, or the proof that there is none |
//! | `automaton` | modes, events, kicks and corners; its guards in `guards` |
//! | `report` | what a run gives |
//! | `solve` | runs with more and more bits, until as many digits as wanted are known to be true |

mod automaton;
mod axial;
mod contact;
mod courses;
mod elementary;
mod equations;
mod float;
mod friction;
mod margin;
mod number;
mod pieces;
mod report;
mod roots;
mod scales;
mod solve;
mod steps;

pub use automaton::run;
pub use number::{Number, decimal, rational};
pub use report::{OracleEvent, OracleReport, OracleState};
pub use solve::{OracleProgress, OracleRequest, OracleSolution, solve};

use num_rational::BigRational;

/// Bits between the digits that a run is to compute with and its precision, for the rounding of sums.
const GUARD_BITS: f64 = 18.0;

/// Lengths of mantissas that there are, machine words of 64 bits.
const WORDS: [usize; 8] = [1, 2, 3, 4, 6, 10, 16, 32];

/// Fewest and most significant decimal digits of a run: what the shortest and the longest mantissa hold.
pub const DIGITS: std::ops::RangeInclusive<u32> = 13..=611;

/// The shortest mantissa that holds so many digits; `None` beyond [`DIGITS`].
fn words(digits: u32) -> Option<usize> {
    let bits = f64::from(digits) * std::f64::consts::LOG2_10 + GUARD_BITS;
    let enough = |words: &usize| (words * float::WORD_BITS) as f64 >= bits;
    WORDS.into_iter().find(enough).filter(|_| DIGITS.contains(&digits))
}

/// The next longer mantissa, if there is one.
fn words_beyond(words: usize) -> Option<usize> {
    WORDS.into_iter().find(|more| *more > words)
}

/// Decimal digits that a mantissa holds, without those that sums of rounding take.
fn digits_of(words: usize) -> u32 {
    (((words * float::WORD_BITS) as f64 - GUARD_BITS) / std::f64::consts::LOG2_10) as u32
}

/// What an oracle run is to do.
#[derive(Debug, Clone)]
pub struct OracleOptions {
    /// Significant decimal digits that it computes with, in [`DIGITS`]. What is true of its results is less, by the growth
    /// of perturbations in the case.
    pub digits: u32,
    /// s.
    pub end_time: BigRational,
    /// When the state is wanted, besides the events; s, increasing.
    pub sample_times: Vec<BigRational>,
    /// Events after which it gives up.
    pub max_events: usize,
    /// |omega_r| (rad/s) below which an engaged contact counts as stuck: it has an event "stick" where |omega_r| falls through it, and
    /// "slip" where it rises through it. Without one it has none. Contacts that stick and slip make no use of it.
    pub threshold: Option<BigRational>,
    /// Whether the margin of steady sliding is looked at: the loss and the return of stability are events, and kicks can wait for
    /// the loss.
    pub stability: bool,
}

impl Default for OracleOptions {
    /// 33 digits, to t = 0, with stability and without samples and a threshold.
    fn default() -> Self {
        OracleOptions {
            digits: 33,
            end_time: BigRational::default(),
            sample_times: Vec::new(),
            max_events: 10_000,
            threshold: None,
            stability: true,
        }
    }
}

/// Why there is no oracle run; times in s.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OracleError {
    /// The precision is none that it offers.
    #[error(
        "the oracle computes with {least} to {most} digits, but {asked} would be needed. Ask for fewer (--digits), or set a \
         [[perturbation]]: it ends the growth that takes digits at the first stick",
        least = DIGITS.start(),
        most = DIGITS.end()
    )]
    Digits {
        /// How many.
        asked: u32,
    },
    /// A run that is not made.
    #[error(
        "the oracle, with {digits} digits now, would take about {}, and is allowed {}. Allow it more (--max-wall-time), ask \
         for fewer digits (--digits), end the run earlier (output.end_time), or set a larger [[perturbation]], which ends the growth \
         that takes digits earlier",
        lasting(*seconds),
        lasting(*longest)
    )]
    TooLong {
        /// Decimal digits of that run.
        digits: u32,
        /// What it would take in all, s.
        seconds: f64,
        /// What it is allowed to take in all, s.
        longest: f64,
    },
    /// Every precision finds other events.
    #[error(
        "with {digits} digits, the most that the oracle computes with, the events are still decided by rounding. Set a \
         [[perturbation]]: it ends the growth at the first stick"
    )]
    Unsettled {
        /// Decimal digits of the last run.
        digits: u32,
    },
    /// One of the paper's own breakaway tests.
    #[error(
        "the oracle knows the exact constraint torque only, but the case asks for another breakaway test; set \
         contact.breakaway_test = \"transmitted\""
    )]
    BreakawayTest,
    /// The event budget is used up.
    #[error("the oracle's event budget of {budget} is used up at t = {time:.12} s; raise solver.max_events")]
    TooManyEvents {
        /// When, s.
        time: f64,
        /// How many were allowed.
        budget: usize,
    },
    /// A motion that starts against its own mode.
    #[error(
        "at t = {time:.12} s the motion is degenerate: {what}. The case stands on the border between two sequences of \
         events, and a small change of any parameter takes it off"
    )]
    Degenerate {
        /// When, s.
        time: f64,
        /// In words.
        what: &'static str,
    },
    /// No step, however short, is accurate.
    #[error("the oracle's steps vanish at t = {0:.12} s: the state grows without bounds there")]
    StepVanishes(f64),
    /// A sliding speed beyond those that the friction law is given for.
    #[error(
        "at t = {0:.12} s the sliding speed has come to friction.valid_below, beyond which the friction law is not given; \
         raise it if the law holds there, or take one that is given at every speed"
    )]
    BeyondLaw(f64),
    /// The control asked for an end.
    #[error("the oracle was interrupted at t = {0:.6} s")]
    Interrupted(f64),
}

/// A duration (s) in words.
fn lasting(seconds: f64) -> String {
    match seconds {
        0.0..100.0 => format!("{seconds:.1} s"),
        100.0..7200.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} hours", seconds / 3600.0),
    }
}

impl OracleError {
    /// Whether a run with more digits may do without it.
    fn may_be_rounding(&self) -> bool {
        use OracleError::{Degenerate, StepVanishes, TooManyEvents};
        matches!(self, TooManyEvents { .. } | Degenerate { .. } | StepVanishes(_))
    }
}
