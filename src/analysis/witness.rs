//! The witness of a run: the same case by another method, and how far apart the events are.
//!
//! It is no certificate: one method at one tolerance, without the rounding that all methods share. It does tell a result
//! that two solvers agree on from one that is a solver's own.

pub use super::sequence::Sequence;
use super::warning::Warning;
use crate::case::Case;
use crate::hybrid::RunError;
use crate::model::margin;
use crate::results::{AttributeValue, quantity};
use crate::run::Run;
use crate::simulation::{Method, OutputOptions, SolverOptions, natural_period};
use serde::Serialize;

/// Steps after which the witness is given up: a second or two of a brake. Unlike a time, this is the same on every machine, so that
/// identical runs say the same. The witness of a run that resolved so many periods that it would take more is not begun.
const MOST_STEPS: usize = 1_500_000;

/// Steps of `cvode` in a natural period of sliding where nothing damps the fast mode: 57 in `paper-si` with c_t = 0.
const STEPS_PER_PERIOD: f64 = 56.0;

/// What is said where it is given up, or not begun.
const TOO_LONG: &str = "left out, as it takes more than a second";

/// What a witness says of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Testimony {
    /// The same sequence of events.
    SameSequence,
    /// Another sequence.
    SequenceDiffers,
    /// Another sequence, or the same at other times, of a run whose onset is amplified rounding: no two methods agree.
    NoiseDetermined,
    /// It was given up or not begun, as it takes too long.
    LeftOut,
    /// It failed.
    Failed,
}

impl Testimony {
    /// The name in result files and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Testimony::SameSequence => "same-sequence",
            Testimony::SequenceDiffers => "sequence-differs",
            Testimony::NoiseDetermined => "noise-determined",
            Testimony::LeftOut => "left-out",
            Testimony::Failed => "failed",
        }
    }
}

/// A run of another method beside a result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Witness {
    /// Name of its method.
    pub method: &'static str,
    /// Its relative tolerance.
    pub rtol: f64,
    /// What it found.
    pub testimony: Testimony,
    /// Number of events in its sequence, as far as it came.
    pub events: usize,
    /// Of these, how many agree with the result's, from the first on.
    pub agreeing_events: usize,
    /// Largest difference of the times of those, s; `None` without any.
    pub largest_difference: Option<f64>,
    /// When the first event comes that is another, s; `None` if there is none as far as the witness came.
    pub differs_from: Option<f64>,
    /// How far apart the two methods have that event, s; `None` if it is of another kind, or only one of them has it.
    pub differs_by: Option<f64>,
    /// `differs_by` as a share of the time since the event before.
    pub differs_by_share: Option<f64>,
    /// One line of at most 80 characters.
    pub statement: String,
}

impl Witness {
    /// The attributes of /witness in a result file.
    pub fn attributes(&self) -> Vec<(String, AttributeValue)> {
        let text = |name: &str, text: &str| vec![(name.to_owned(), text.into())];
        let number = |name: &str, value: Option<f64>, units: &str, long_name: &str| {
            quantity(name, value.unwrap_or(f64::NAN), units, long_name).to_vec()
        };
        let agreeing = "events that agree with those of the result, from the first on";
        let difference = "largest difference of the times of the agreeing events";
        let other = "time of the first event that is another; NaN: there is none";
        let apart = "difference of its times; NaN: its kind differs, or there is none";
        let share = "the same as a share of the time since the event before";
        [
            text("method", self.method),
            number("rtol", Some(self.rtol), "1", "relative tolerance of the witness"),
            text("testimony", self.testimony.name()),
            number(
                "events",
                Some(self.events as f64),
                "1",
                "events in the sequence of the witness",
            ),
            number("agreeing_events", Some(self.agreeing_events as f64), "1", agreeing),
            number("largest_difference", self.largest_difference, "s", difference),
            number("differs_from", self.differs_from, "s", other),
            number("differs_by", self.differs_by, "s", apart),
            number("differs_by_share", self.differs_by_share, "1", share),
            text("statement", &self.statement),
        ]
        .concat()
    }

    /// What a reader of the result has to know of it: that its events are others, where nothing else says so.
    pub(crate) fn warning(&self) -> Option<Warning> {
        let differs = self
            .differs_from
            .filter(|_| self.testimony == Testimony::SequenceDiffers);
        differs.map(|from| Warning::OtherSequence {
            method: self.method,
            agreeing: self.agreeing_events,
            from,
            apart: self.differs_by.zip(self.differs_by_share),
        })
    }
}

/// The method that bears witness of a result: `cvode`, and of its own results `series`, which shares nothing with it.
pub(crate) fn witness_of(method: Method) -> Method {
    match method {
        Method::Cvode => Method::Series,
        _ => Method::Cvode,
    }
}

/// Runs the witness of a result: of this case, with this sequence of events, its onset amplified rounding or not.
///
/// The tolerance is that of the case, at most the default; absolute tolerances and fixed steps of the case are left to the
/// result. `stop` is asked now and then; `None` if it says so.
pub fn witness(case: &Case, result: &Sequence, noise_determined: bool, stop: &dyn Fn() -> bool) -> Option<Witness> {
    let method = witness_of(case.solver.method);
    let solver = SolverOptions {
        method,
        rtol: case.solver.rtol.min(SolverOptions::default().rtol),
        max_events: case.solver.max_events,
        max_steps: Some(MOST_STEPS),
        ..SolverOptions::default()
    };
    let output = OutputOptions::at_the_ends(case.output.end_time);
    let mut own = Sequence::default();
    let testimony = if takes_too_long(case, method, result) {
        Testimony::LeftOut
    } else {
        let ended = Run::new(case)
            .solver(&solver)
            .output(&output)
            .record(&mut own)
            .stop(stop)
            .start();
        match ended {
            Ok(report) if report.interrupted => return None,
            Ok(_) => Testimony::SameSequence,
            Err(failure) if matches!(failure.error, RunError::TooManySteps { .. }) => Testimony::LeftOut,
            Err(_) => Testimony::Failed,
        }
    };
    let agreeing = own.agreeing(result);
    let time = |sequence: &Sequence| sequence.events.get(agreeing).map(|event| event.1);
    let differs_from = match (time(&own), time(result)) {
        (Some(own), Some(result)) => Some(own.min(result)),
        // A run that did not come to its end may have come to the event.
        (None, _) if testimony != Testimony::SameSequence => None,
        (own, result) => own.or(result),
    };
    let apart = differs_from.and_then(|_| own.apart(result, agreeing));
    let differences = own.events[..agreeing].iter().zip(&result.events);
    let largest_difference = differences.map(|(a, b)| (a.1 - b.1).abs()).reduce(f64::max);
    let testimony = match (testimony, differs_from) {
        (Testimony::SameSequence, _) if noise_determined => Testimony::NoiseDetermined,
        // What it found until it ended counts.
        (_, Some(_)) if !noise_determined => Testimony::SequenceDiffers,
        _ => testimony,
    };
    let found = own.events.len();
    let largest = largest_difference.unwrap_or(0.0);
    let detail = match testimony {
        Testimony::LeftOut => TOO_LONG.to_owned(),
        Testimony::Failed => {
            let last = own.last().map_or(0.0, |event| event.1);
            format!("it failed after {found} events, the last at {last:.6} s")
        }
        Testimony::NoiseDetermined => {
            let noun = if found == 1 { "event" } else { "events" };
            format!("{found} {noun} at times of its own, as the onset is amplified rounding")
        }
        Testimony::SequenceDiffers => {
            let (events, next) = (result.events.len(), agreeing + 1);
            match apart {
                Some((apart, _)) => {
                    format!("{found} events for {events}; number {next} is {apart:.1e} s away")
                }
                None => format!(
                    "{found} events for {events}, other ones from number {next} on, at {:.6} s",
                    differs_from.unwrap_or(0.0)
                ),
            }
        }
        Testimony::SameSequence => match agreeing {
            0 => "no event either".to_owned(),
            1 => format!("the same event, within {largest:.1e} s"),
            _ => format!("the same {agreeing} events, all within {largest:.1e} s"),
        },
    };
    Some(Witness {
        method: method.name(),
        rtol: solver.rtol,
        testimony,
        events: found,
        agreeing_events: agreeing,
        largest_difference,
        differs_from,
        differs_by: apart.map(|(apart, _)| apart),
        differs_by_share: apart.map(|(_, share)| share),
        statement: format!("witness {}: {detail}", method.name()),
    })
}

/// Whether the witness need not be begun: the result's own resolved steps foretell that it takes too many, or all of its sliding
/// where only `series` has long steps. The paper's procedure does not know what it resolves.
fn takes_too_long(case: &Case, method: Method, result: &Sequence) -> bool {
    let knows = method == Method::Cvode && case.solver.method.locates_events();
    let period = natural_period(&case.system).filter(|_| knows);
    let slows_down = margin::resistance(&case.system).is_ok();
    let resolved = if slows_down { result.resolved } else { result.slid };
    period.is_some_and(|period| resolved / period * STEPS_PER_PERIOD > MOST_STEPS as f64)
}
