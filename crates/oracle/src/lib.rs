//! What is the truth? The equations are solved a second time, by Taylor series with up to 611 digits.
//!
//! [`run`] solves a system with exact numbers ([`ExactSystem`](stickslip_system::model::system::ExactSystem)) to a
//! precision. [`solve`](fn@solve) repeats this with more digits, until the requested digits of every event are known to
//! be correct.
//!
//! The oracle shares the parameters and the names of modes and events with the rest of the program. It shares neither
//! the code of the equations nor the logic of events. If both agree, both are right, or both misread the model
//! (docs/theory.md) in the same way.
//!
//! A mass of 1 kg on a spring of 1 N/m slides on the ground, whose friction is 1 N. It starts at x = 3.5 m, turns after
//! half a period, and stops after a whole period:
//!
//! ```
//! use num_rational::BigRational;
//! use stickslip_oracle::{OracleRequest, rational, solve};
//! use stickslip_system::model::system::{ContactLaw, End, ExactSystem, Initial, Pressing, Train};
//! use stickslip_system::model::{BreakawayTest, ExactLaw};
//! use stickslip_system::signal::Drive;
//!
//! let number = |text: &str| rational(text).unwrap_or_default();
//! let ground = Train {
//!     inertia: vec![],
//!     stiffness: vec![],
//!     damping: vec![],
//!     viscous: vec![],
//!     end: End::Fixed,
//!     torque: None,
//! };
//! let mass = Train {
//!     inertia: vec![number("1")],
//!     stiffness: vec![number("1")],
//!     damping: vec![number("0")],
//!     viscous: vec![number("0")],
//!     ..ground.clone()
//! };
//! let system = ExactSystem {
//!     rotor: ground,
//!     stator: mass,
//!     radius: number("1"),
//!     pressing: Pressing::Force(Drive::Value(number("10"))),
//!     breakaway: number("0.1"),
//!     breakaway_test: BreakawayTest::Transmitted,
//!     law: ExactLaw { name: "coulomb", numbers: vec![("kinetic", number("0.1"))], lists: vec![], words: vec![] },
//!     contact: ContactLaw::StickSlip,
//!     initial: Initial {
//!         rotor_twist: vec![],
//!         rotor_speed: vec![],
//!         stator_twist: vec![number("3.5")],
//!         stator_speed: vec![number("0")],
//!     },
//!     kicks: vec![],
//! };
//!
//! let request = OracleRequest { digits: 40, end_time: number("10"), ..OracleRequest::default() };
//! let solution = solve(&system, &request, &())?;
//! let [turn, stop] = &solution.report.events[..] else { panic!("{:?}", solution.report.events) };
//! assert_eq!(turn.time.to_decimal(40), "3.141592653589793238462643383279502884197");
//! assert_eq!(stop.time.to_decimal(40), "6.283185307179586476925286766559005768394");
//! # Ok::<(), stickslip_oracle::OracleError>(())
//! ```
//!
//! | module | what it is |
//! |---|---|
//! | `float` | floating-point numbers of several machine words, in which everything is computed |
//! | `number` | numbers of the results, converted exactly to and from rationals and decimals |
//! | `elementary` | sine, cosine, arc tangent and hyperbolic tangent |
//! | `pieces` | a signal without harmonics, as linear pieces |
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
//! | `report` | the result of a run |
//! | `solve` | runs with increasing precision, until the requested digits are known to be correct |
//!
//! The crate does not say how many digits of another run are correct; `stickslip-analysis` does. It always locates
//! events, and knows only the exact breakaway test.

mod automaton;
mod axial;
mod contact;
mod courses;
#[doc(hidden)]
pub mod elementary;
mod equations;
#[doc(hidden)]
pub mod float;
mod friction;
#[doc(hidden)]
pub mod margin;
pub mod number;
mod pieces;
mod report;
#[doc(hidden)]
pub mod roots;
mod scales;
mod solve;
mod steps;

pub use automaton::run;
pub use number::{ExactDouble, decimal, rational};
pub use report::{OracleEvent, OracleReport, OracleState};
pub use solve::{OracleRequest, OracleSolution, solve};

use num_rational::BigRational;

/// Bits beyond the requested digits, for the rounding of sums.
const GUARD_BITS: f64 = 18.0;

const MOST_WORDS: usize = 32;

/// Fewest and most significant decimal digits of a run: the capacities of one word and of 32 words of 64 bits.
pub const DIGITS: std::ops::RangeInclusive<u32> = 13..=611;

/// The least precision, in words, for a number of digits; `None` outside [`DIGITS`].
fn words(digits: u32) -> Option<usize> {
    let bits = f64::from(digits) * std::f64::consts::LOG2_10 + GUARD_BITS;
    let words = (bits / float::WORD_BITS as f64).ceil() as usize;
    DIGITS.contains(&digits).then_some(words)
}

fn words_beyond(words: usize) -> Option<usize> {
    (words < MOST_WORDS).then_some(words + 1)
}

fn digits_of(words: usize) -> u32 {
    (((words * float::WORD_BITS) as f64 - GUARD_BITS) / std::f64::consts::LOG2_10) as u32
}

/// Options of an oracle run.
#[derive(Debug, Clone)]
pub struct OracleOptions {
    /// Significant decimal digits of the arithmetic, in [`DIGITS`]. The results have fewer correct digits, because
    /// perturbations grow in the case.
    pub digits: u32,
    /// End time, s.
    pub end_time: BigRational,
    /// Further times at which the state is recorded, s, increasing.
    pub sample_times: Vec<BigRational>,
    /// Largest number of events.
    pub max_events: usize,
    /// |omega_r| (rad/s) below which a contact without stick counts as stuck. The event "stick" occurs where |omega_r|
    /// falls through this speed, and "slip" where it rises through it; without a threshold there are no such events.
    /// Contacts that stick and slip ignore it.
    pub threshold: Option<BigRational>,
    /// Whether the margin of steady sliding is watched. Loss and return of stability are then events, and kicks can
    /// wait for the loss.
    pub stability: bool,
}

impl Default for OracleOptions {
    /// 33 digits, end time 0, with stability, without samples and threshold.
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

/// Failure of an oracle run; times in s.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OracleError {
    /// The requested precision is outside [`DIGITS`].
    #[error(
        "the exact solver computes with {least} to {most} digits, but {asked} would be needed. Ask for fewer (--digits), or set a \
         [[perturbation]]: it ends the growth that takes digits at the first stick",
        least = DIGITS.start(),
        most = DIGITS.end()
    )]
    Digits {
        /// Requested digits.
        asked: u32,
    },
    /// The estimated time exceeds the limit.
    #[error(
        "the exact solver, with {digits} digits now, would take about {}, and is allowed {}. Allow it more (--max-wall-time), ask \
         for fewer digits (--digits), end the run earlier (output.end_time), or set a larger [[perturbation]], which ends the growth \
         that takes digits earlier",
        lasting(*seconds),
        lasting(*longest)
    )]
    TooLong {
        /// Decimal digits of the run that would take too long.
        digits: u32,
        /// Estimated total time, s.
        seconds: f64,
        /// Time limit, s.
        longest: f64,
    },
    /// The events differ between all precisions.
    #[error(
        "with {digits} digits, the most that the exact solver computes with, the events are still decided by rounding. Set a \
         [[perturbation]]: it ends the growth at the first stick"
    )]
    Unsettled {
        /// Decimal digits of the last run.
        digits: u32,
    },
    /// The case asks for one of the paper's own breakaway tests.
    #[error(
        "the exact solver knows the exact constraint torque only, but the case asks for another breakaway test; set \
         contact.breakaway_test = \"transmitted\""
    )]
    BreakawayTest,
    /// The event budget is used up.
    #[error("the exact solver's event budget of {budget} is used up at t = {time:.12} s; raise solver.max_events")]
    TooManyEvents {
        /// Time, s.
        time: f64,
        /// Event budget.
        budget: usize,
    },
    /// The motion contradicts its mode at the start of the mode.
    #[error(
        "at t = {time:.12} s the motion is degenerate: {what}. The case stands on the border between two sequences of \
         events, and a small change of any parameter takes it off"
    )]
    Degenerate {
        /// Time, s.
        time: f64,
        /// Reason in words.
        what: &'static str,
    },
    /// Even the shortest steps are inaccurate.
    #[error("the exact solver's steps vanish at t = {0:.12} s: the state grows without bounds there")]
    StepVanishes(f64),
    /// The sliding speed has reached the end of the friction law.
    #[error(
        "at t = {0:.12} s the sliding speed has come to friction.valid_below, beyond which the friction law is not given; \
         raise it if the law holds there, or take one that is given at every speed"
    )]
    BeyondLaw(f64),
    /// `control` returned `Break`.
    #[error("the exact solver was interrupted at t = {0:.6} s")]
    Interrupted(f64),
}

fn lasting(seconds: f64) -> String {
    match seconds {
        0.0..100.0 => format!("{seconds:.1} s"),
        100.0..7200.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} hours", seconds / 3600.0),
    }
}

impl OracleError {
    fn may_be_rounding(&self) -> bool {
        use OracleError::{Degenerate, StepVanishes, TooManyEvents};
        matches!(self, TooManyEvents { .. } | Degenerate { .. } | StepVanishes(_))
    }
}
