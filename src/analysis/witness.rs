//! The witness of a run: the same case by another method, and how far apart the events are.
//!
//! It is no certificate: one method at one tolerance, without the rounding that all methods share. It does tell a result
//! that two solvers agree on from one that is a solver's own.

use super::finer::{finer_settings, promised};
pub use super::sequence::Sequence;
use super::warning::Warning;
use crate::case::Case;
use crate::hybrid::RunError;
use crate::model::margin;
use crate::results::schema::{WITNESS_TIME, group};
use crate::results::{Addition, AttributeValue, Column, quantity};
use crate::run::Run;
use crate::simulation::{Method, OutputOptions, SolverOptions, natural_period};
use serde::Serialize;

/// Steps after which the witness is given up: a second or two of a brake. Unlike a time, this is the same on every machine, so that
/// identical runs say the same. The witness of a run that resolved so many periods that it would take more is not begun.
pub(super) const MOST_STEPS: usize = 1_500_000;

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
    /// The first event whose times are farther apart than the settings of the run promise, of the default or `series`: its time, and
    /// how far, s.
    #[serde(skip)]
    pub farther: Option<(f64, f64)>,
    /// Why the run is a repetition with finer settings, and which: its first try and the witness did not agree.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeated: Option<String>,
    /// When it has each event of the result, those outside the sequence included, s; NaN where it has none.
    #[serde(skip)]
    pub times: Vec<f64>,
}

impl Witness {
    /// What a result file has of it: /witness, and its times in /events.
    pub fn additions(&self) -> [Addition; 2] {
        let (mut own, mut events) = (Addition::new(group::WITNESS), Addition::new(group::EVENTS));
        own.attributes = self.attributes();
        events.over(&["event"], self.column());
        [own, events]
    }

    /// Whether a run with these settings is as near to it as they promise, or nothing can be said.
    pub(super) fn agrees(&self, solver: &SolverOptions) -> bool {
        match self.testimony {
            Testimony::SameSequence => self.largest_difference.is_none_or(|most| most <= promised(solver)),
            Testimony::SequenceDiffers => false,
            Testimony::NoiseDetermined | Testimony::LeftOut | Testimony::Failed => true,
        }
    }

    /// Its times, as /events has them.
    pub fn column(&self) -> Column {
        let long_name = "time of the event by the witness; NaN: it has none";
        Column::numbers(WITNESS_TIME, "s", long_name, self.times.iter().copied())
    }

    /// The attributes of /witness in a result file.
    fn attributes(&self) -> Vec<(String, AttributeValue)> {
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
            self.repeated
                .as_ref()
                .map_or_else(Vec::new, |why| text("repeated", why)),
        ]
        .concat()
    }

    /// What a reader of the result has to know of it: that its events are others, or at other times, where nothing else says so.
    pub(crate) fn warning(&self) -> Option<Warning> {
        let method = self.method;
        match self.testimony {
            Testimony::SequenceDiffers => self.differs_from.map(|from| Warning::OtherSequence {
                method,
                agreeing: self.agreeing_events,
                from,
                apart: self.differs_by.zip(self.differs_by_share),
            }),
            Testimony::SameSequence => self
                .farther
                .map(|(time, apart)| Warning::OtherTimes { method, time, apart }),
            _ => None,
        }
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
/// result. A witness of `series` that does not agree is asked again with finer settings. `stop` is asked now and then; `None` if it
/// says so.
pub fn witness(case: &Case, result: &Sequence, noise_determined: bool, stop: &dyn Fn() -> bool) -> Option<Witness> {
    let own = &case.solver;
    let solver = SolverOptions {
        method: witness_of(own.method),
        rtol: own.rtol.min(SolverOptions::default().rtol),
        max_events: own.max_events,
        max_steps: Some(MOST_STEPS),
        ..SolverOptions::default()
    };
    let found = witness_by(&solver, case, result, noise_determined, stop)?;
    if own.method != Method::Series || found.agrees(own) {
        return Some(found);
    }
    let mut finer = finer_settings(&solver, &case.system).into_iter();
    let again = finer.find_map(|solver| {
        let again = witness_by(&solver, case, result, noise_determined, stop)?;
        (again.testimony == Testimony::SameSequence && again.agrees(own)).then_some(again)
    });
    again.or(Some(found)).filter(|_| !stop())
}

fn witness_by(
    solver: &SolverOptions,
    case: &Case,
    result: &Sequence,
    noise_determined: bool,
    stop: &dyn Fn() -> bool,
) -> Option<Witness> {
    let method = solver.method;
    let output = OutputOptions::at_the_ends(case.output.end_time);
    let mut own = Sequence::default();
    let testimony = if takes_too_long(case, method, result) {
        Testimony::LeftOut
    } else {
        let ended = Run::new(case)
            .solver(solver)
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
    let time = |sequence: &Sequence| sequence.events().nth(agreeing).map(|event| event.1);
    let differs_from = match (time(&own), time(result)) {
        (Some(own), Some(result)) => Some(own.min(result)),
        // A run that did not come to its end may have come to the event.
        (None, _) if testimony != Testimony::SameSequence => None,
        (own, result) => own.or(result),
    };
    let apart = differs_from.and_then(|_| own.apart(result, agreeing));
    let differences = || {
        let pairs = own.events().zip(result.events()).take(agreeing);
        pairs.map(|(own, result)| (result.1, (own.1 - result.1).abs()))
    };
    let largest_difference = differences().map(|(_, apart)| apart).reduce(f64::max);
    let promises = matches!(case.solver.method, Method::Cvode | Method::Series).then(|| promised(&case.solver));
    let farther = promises.and_then(|most| differences().find(|(_, apart)| *apart > most));
    let testimony = match (testimony, differs_from) {
        (Testimony::SameSequence, _) if noise_determined => Testimony::NoiseDetermined,
        // What it found until it ended counts.
        (_, Some(_)) if !noise_determined => Testimony::SequenceDiffers,
        _ => testimony,
    };
    let found = own.events().count();
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
            let (events, next) = (result.events().count(), agreeing + 1);
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
        farther,
        repeated: None,
        times: own.times_of(result, agreeing),
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
