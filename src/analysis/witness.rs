//! The witness of a run: what another method makes of the same case, told in one line beside the result.
//!
//! It is no certificate: one method at one tolerance, without the rounding that all methods share. It does tell a result
//! that two solvers agree on from one that is a solver's own.

use crate::case::Case;
use crate::model::torsion::TorsionModel;
use crate::record::{Cycle, Event, EventKind, MemoryRecorder, Piece, Recorder, RecorderError, Sample, Segment};
use crate::results::{MetaValue, WitnessAttributes};
use crate::run::Run;
use crate::simulation::{Method, OutputOptions, SolverOptions};
use serde::Serialize;
use std::ops::ControlFlow;

/// So often the witness is asked whether it goes on, once in 256 steps and once in each segment, before it is given up.
/// That is about a second, and unlike a time it is the same on every machine: so identical runs say the same. Where the result
/// itself had to resolve so many periods that it would be, the witness is not begun.
const MOST_QUESTIONS: u32 = 6_000;

/// Steps between two questions, as the automaton asks them.
const STEPS_BETWEEN_QUESTIONS: f64 = 256.0;

/// Steps of `cvode` in a natural period of sliding where nothing damps the fast mode: 57 in `paper-si` with c_t = 0.
const STEPS_PER_PERIOD: f64 = 56.0;

/// What is said where it is given up, or not begun.
const TOO_LONG: &str = "left out, as it takes more than a second";

/// Sequences of more events than this are not kept for the comparison.
const MOST_EVENTS: usize = 20_000;

/// The sequence of events of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sequence {
    events: Vec<(EventKind, f64)>,
    incomplete: bool,
    /// For how long sliding had to resolve the fast mode, s, as far as segments told of it.
    resolved: f64,
}

impl Sequence {
    /// Of events that are all at hand, in order.
    pub fn of_events<'a>(events: impl IntoIterator<Item = &'a Event>) -> Self {
        let mut sequence = Sequence::default();
        events.into_iter().for_each(|event| sequence.push(event));
        sequence
    }

    fn push(&mut self, event: &Event) {
        if !event.kind.in_event_sequence() {
            return;
        }
        if self.events.len() < MOST_EVENTS {
            self.events.push((event.kind, event.time));
        } else {
            self.incomplete = true;
        }
    }
}

/// Passes a run on to its recorder, and keeps its sequence of events.
pub(crate) struct Remembering<'a> {
    recorder: &'a mut dyn Recorder,
    keeps_events: bool,
    sequence: Sequence,
}

impl<'a> Remembering<'a> {
    /// For a run into `recorder`, whose report keeps the events whether or not the recorder stores them.
    pub(crate) fn new(recorder: &'a mut dyn Recorder, keeps_events: bool) -> Self {
        Remembering {
            recorder,
            keeps_events,
            sequence: Sequence::default(),
        }
    }

    /// What has been kept.
    pub(crate) fn into_sequence(self) -> Sequence {
        self.sequence
    }
}

impl Recorder for Remembering<'_> {
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.recorder.sample(sample)
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.sequence.push(event);
        self.recorder.event(event)
    }

    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        if segment.mode.sense() != 0 && segment.resolved == Some(true) {
            self.sequence.resolved += segment.end - segment.start;
        }
        self.recorder.segment(segment)
    }

    fn piece(&mut self, piece: &Piece<'_>) -> Result<(), RecorderError> {
        self.recorder.piece(piece)
    }

    fn cycle(&mut self, cycle: &Cycle) -> Result<(), RecorderError> {
        self.recorder.cycle(cycle)
    }

    fn stores_motion(&self) -> bool {
        self.recorder.stores_motion()
    }

    fn stores_events(&self) -> bool {
        !self.keeps_events && self.recorder.stores_events()
    }
}

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
    /// Of these, how many agree in kind with the result's, from the first on.
    pub agreeing_events: usize,
    /// Largest difference of the times of those, s; `None` without any.
    pub largest_difference: Option<f64>,
    /// One line of at most 80 characters.
    pub statement: String,
}

impl Witness {
    /// The attributes of /witness in a result file.
    pub fn attributes(&self) -> WitnessAttributes {
        let text = |text: &str| MetaValue::Text(text.to_owned());
        let number = MetaValue::Number;
        WitnessAttributes(vec![
            ("method", text(self.method), None),
            (
                "rtol",
                number(self.rtol),
                Some(("1", "relative tolerance of the witness")),
            ),
            ("testimony", text(self.testimony.name()), None),
            (
                "events",
                number(self.events as f64),
                Some(("1", "events in the sequence of the witness")),
            ),
            (
                "agreeing_events",
                number(self.agreeing_events as f64),
                Some((
                    "1",
                    "events that agree in kind with those of the result, from the first on",
                )),
            ),
            (
                "largest_difference",
                number(self.largest_difference.unwrap_or(f64::NAN)),
                Some(("s", "largest difference of the times of the agreeing events")),
            ),
            ("statement", text(&self.statement), None),
        ])
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
        ..SolverOptions::default()
    };
    let output = OutputOptions::at_the_ends(case.output.end_time);
    let period = TorsionModel::new(&case.parameters).natural_period();
    let foreseen = result.resolved / period * STEPS_PER_PERIOD / STEPS_BETWEEN_QUESTIONS;
    // The paper's procedure does not know what it resolves.
    let predicts = method == Method::Cvode && case.solver.method.locates_events();
    if predicts && foreseen > f64::from(MOST_QUESTIONS) {
        return Some(Witness {
            method: method.name(),
            rtol: solver.rtol,
            testimony: Testimony::LeftOut,
            events: 0,
            agreeing_events: 0,
            largest_difference: None,
            statement: format!("witness {}: {TOO_LONG}", method.name()),
        });
    }
    let mut recorder = MemoryRecorder::default();
    let mut questions = 0;
    let ended = Run::new(case)
        .solver(&solver)
        .output(&output)
        .record(&mut recorder)
        .control(|_| {
            questions += 1;
            if questions > MOST_QUESTIONS || stop() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .start();
    let own = Sequence::of_events(&recorder.events);
    let (testimony, detail) = match ended {
        Err(failure) => (
            Testimony::Failed,
            format!("it failed at {:.6} s", end_of(&failure.report)),
        ),
        Ok(report) if report.interrupted && questions <= MOST_QUESTIONS => return None,
        Ok(report) if report.interrupted => (Testimony::LeftOut, TOO_LONG.to_owned()),
        Ok(_) if result.incomplete || own.incomplete => (
            Testimony::LeftOut,
            format!("left out, with more than {MOST_EVENTS} events"),
        ),
        Ok(_) => compare(&own, result, noise_determined),
    };
    let pairs = || own.events.iter().zip(&result.events).take_while(|(a, b)| a.0 == b.0);
    Some(Witness {
        method: method.name(),
        rtol: solver.rtol,
        testimony,
        events: own.events.len(),
        agreeing_events: pairs().count(),
        largest_difference: pairs().map(|(a, b)| (a.1 - b.1).abs()).reduce(f64::max),
        statement: format!("witness {}: {detail}", method.name()),
    })
}

fn end_of(report: &crate::simulation::RunReport) -> f64 {
    report.events.last().map_or(report.end, |event| event.time)
}

fn compare(own: &Sequence, result: &Sequence, noise_determined: bool) -> (Testimony, String) {
    let (own, result) = (&own.events, &result.events);
    let agreeing = own.iter().zip(result).take_while(|(a, b)| a.0 == b.0).count();
    let difference = own.iter().zip(result).take(agreeing).map(|(a, b)| (a.1 - b.1).abs());
    let largest = difference.fold(0.0, f64::max);
    let same = agreeing == own.len() && agreeing == result.len();
    if noise_determined {
        let number = own.len();
        let noun = if number == 1 { "event" } else { "events" };
        let detail = format!("{number} {noun} at times of its own, as the onset is amplified rounding");
        return (Testimony::NoiseDetermined, detail);
    }
    if same {
        let detail = match agreeing {
            0 => "no event either".to_owned(),
            1 => format!("the same event, within {largest:.1e} s"),
            _ => format!("the same {agreeing} events, all within {largest:.1e} s"),
        };
        return (Testimony::SameSequence, detail);
    }
    let at = own
        .get(agreeing)
        .or_else(|| result.get(agreeing))
        .map_or(0.0, |event| event.1);
    let detail = format!(
        "{} events for {}, other ones from number {} on, at {at:.6} s",
        own.len(),
        result.len(),
        agreeing + 1
    );
    (Testimony::SequenceDiffers, detail)
}
