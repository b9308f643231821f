//! Witness of a run: the case by another method, and the distances between the events.
//!
//! A witness is no certificate: it is one method at one tolerance, and rounding that all methods share remains. But it
//! tells a result that two solvers share from an artefact of one solver.

pub use super::sequence::{OtherStability, Sequence};
use super::warning::Warning;
use serde::Serialize;
use stickslip_case::Case;
use stickslip_engine::ErrorKind;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{Method, OutputOptions, SolverOptions, natural_period};
use stickslip_files::schema::{Variable, WITNESS_TIME, group};
use stickslip_files::{Addition, DeclaredColumn, FileColumn, columns};
use stickslip_system::model::margin;
use stickslip_system::model::system::System;
use stickslip_system::named;
use stickslip_system::quote::bound;
use stickslip_system::watch::Watch;

/// Limit of a witness: a second or two for a brake. A limit in steps gives the same report on every machine.
pub(super) const MOST_STEPS: usize = 1_500_000;

/// Steps of `cvode` per natural period of sliding with an undamped fast mode: 57 in `paper-si` with c_t = 0.
const STEPS_PER_PERIOD: f64 = 56.0;

const TOO_LONG: &str = "left out, as it takes more than a second";

named! {
    /// Finding of a witness.
    pub enum Testimony {
        /// Same sequence of events.
        SameSequence: "same-sequence",
        /// Another sequence.
        SequenceDiffers: "sequence-differs",
        /// The onset is amplified rounding: sequence or times differ between any two methods.
        NoiseDetermined: "noise-determined",
        /// The witness would take too long.
        LeftOut: "left-out",
        /// The witness failed.
        Failed: "failed",
    }
}

/// Run of another method for comparison with a result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Witness {
    /// Name of its method.
    pub method: &'static str,
    /// Relative tolerance.
    pub rtol: f64,
    /// Finding.
    pub testimony: Testimony,
    /// Number of events in the witness's sequence.
    pub events: usize,
    /// Number of leading events that agree with the result's.
    pub agreeing_events: usize,
    /// Largest difference of the times of agreeing events, s; `None` without any.
    pub largest_difference: Option<f64>,
    /// Time of the first event that differs, s; `None` if all agree.
    pub differs_from: Option<f64>,
    /// Distance of that event between the methods, s; `None` if the kinds differ, or one method lacks it.
    pub differs_by: Option<f64>,
    /// `differs_by` as a share of the time since the previous event.
    pub differs_by_share: Option<f64>,
    /// Statement in one line of at most 80 characters.
    pub statement: String,
    /// Difference in the changes of stability of steady sliding, if the sequences of events agree.
    #[serde(skip)]
    pub other_stability: Option<OtherStability>,
    /// Time and distance (s) of the first event that is farther away than the settings promise, for the default or
    /// `series`.
    #[serde(skip)]
    pub farther: Option<(f64, f64)>,
    /// Reason and settings of a repetition: the first run and its witness disagreed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeated: Option<String>,
    /// Time of each event of the result in the witness, also outside the sequence, s; NaN if missing.
    #[serde(skip)]
    pub times: Vec<f64>,
}

impl Witness {
    /// Groups of the result file: /witness, and the times in /events.
    pub fn additions(&self) -> [Addition; 2] {
        let (mut own, mut events) = (Addition::new(group::WITNESS), Addition::new(group::EVENTS));
        let mut numbers = NUMBERS.iter().map(|one| one.quantity(self));
        own.attribute("method", self.method);
        own.quantities(numbers.by_ref().take(1));
        own.attribute("testimony", self.testimony.name());
        own.quantities(numbers);
        own.attribute("statement", self.statement.as_str());
        if let Some(why) = &self.repeated {
            own.attribute("repeated", why.as_str());
        }
        events.over(&["event"], self.column());
        [own, events]
    }

    /// Whether a run with these settings is as near to the witness as they promise, or nothing is known.
    pub(super) fn agrees(&self, solver: &SolverOptions) -> bool {
        match self.testimony {
            Testimony::SameSequence => self.largest_difference.is_none_or(|most| most <= promised(solver)),
            Testimony::SequenceDiffers => false,
            Testimony::NoiseDetermined | Testimony::LeftOut | Testimony::Failed => true,
        }
    }

    /// Column of the witness's times in /events.
    pub fn column(&self) -> FileColumn {
        let long_name = "time of the event in the reference check; NaN: it has none";
        FileColumn::numbers(WITNESS_TIME, "s", long_name, self.times.iter().copied())
    }

    /// Warning about different events or times, unless another warning covers them.
    pub(crate) fn warning(&self) -> Option<Warning> {
        let method = self.method;
        match self.testimony {
            Testimony::SequenceDiffers => match self.other_stability {
                Some(stability) => Some(Warning::OtherStability { method, stability }),
                None => self.differs_from.map(|from| Warning::OtherSequence {
                    method,
                    agreeing: self.agreeing_events,
                    from,
                    apart: self.differs_by.zip(self.differs_by_share),
                }),
            },
            Testimony::SameSequence => self
                .farther
                .map(|(time, apart)| Warning::OtherTimes { method, time, apart }),
            _ => None,
        }
    }
}

/// Attributes of /witness.
const NUMBERS: &[DeclaredColumn<Witness>] = &columns! { witness:
    Variable::quantity("rtol", "1", "relative tolerance of the reference check"), witness.rtol;
    Variable::quantity("events", "1", "events in the sequence of the reference check"), witness.events as f64;
    Variable::quantity("agreeing_events", "1", "events that agree with those of the result, from the first on"),
        witness.agreeing_events as f64;
    Variable::quantity("largest_difference", "s", "largest difference of the times of the agreeing events"),
        witness.largest_difference.unwrap_or(f64::NAN);
    Variable::quantity("differs_from", "s", "time of the first event that is another; NaN: there is none"),
        witness.differs_from.unwrap_or(f64::NAN);
    Variable::quantity("differs_by", "s", "difference of its times; NaN: its kind differs, or there is none"),
        witness.differs_by.unwrap_or(f64::NAN);
    Variable::quantity("differs_by_share", "1", "the same as a share of the time since the event before"),
        witness.differs_by_share.unwrap_or(f64::NAN);
};

/// `cvode`; for results of `cvode`, the independent `series`.
pub(crate) fn witness_of(method: Method) -> Method {
    match method {
        Method::Cvode => Method::Series,
        _ => Method::Cvode,
    }
}

/// Runs the witness for a case and its sequence of events. `noise_determined`: the onset is amplified rounding.
///
/// The tolerance is the case's, but at most the default. Absolute tolerances and fixed steps are not used. A witness
/// by `series` that disagrees is repeated with finer settings. `stop` is polled; the result is `None` if it returns
/// `true`.
pub fn witness(case: &Case, result: &Sequence, noise_determined: bool, stop: &dyn Watch) -> Option<Witness> {
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
    again.or(Some(found)).filter(|_| !stop.stopped())
}

fn witness_by(
    solver: &SolverOptions,
    case: &Case,
    result: &Sequence,
    noise_determined: bool,
    stop: &dyn Watch,
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
            .watch(stop)
            .start();
        match ended {
            Ok(report) if report.interrupted => return None,
            Ok(_) => Testimony::SameSequence,
            Err(failure) if failure.error.kind == ErrorKind::TooManySteps => Testimony::LeftOut,
            Err(_) => Testimony::Failed,
        }
    };
    let agreeing = own.agreeing(result);
    let time = |sequence: &Sequence| sequence.events().nth(agreeing).map(|event| event.1);
    let differs_from = match (time(&own), time(result)) {
        (Some(own), Some(result)) => Some(own.min(result)),
        // A run that ended early might still have reached the event.
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
        // Events before the failure count.
        (_, Some(_)) if !noise_determined => Testimony::SequenceDiffers,
        _ => testimony,
    };
    let same = testimony == Testimony::SameSequence;
    let other_stability = own.other_stability(result).filter(|_| same);
    let testimony = other_stability.map_or(testimony, |_| Testimony::SequenceDiffers);
    let differs_from = differs_from.or(other_stability.map(|stability| stability.from));
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
            format!("{found} {noun} elsewhere: the onset is amplified rounding")
        }
        Testimony::SequenceDiffers => {
            let (events, next) = (result.events().count(), agreeing + 1);
            match (other_stability, apart) {
                (Some(OtherStability { found, expected, from }), _) => {
                    format!("{found} changes of stability for {expected}, others from {from:.6} s")
                }
                (None, Some((apart, _))) => {
                    format!("{found} events for {events}; number {next} is {apart:.1e} s away")
                }
                (None, None) => format!(
                    "{found} events for {events}; number {next}, at {:.6} s, differs",
                    differs_from.unwrap_or(0.0)
                ),
            }
        }
        Testimony::SameSequence => match agreeing {
            0 => "no contact event either".to_owned(),
            1 => format!("the same contact event, within {} s", bound(largest, 1)),
            _ => format!("the same {agreeing} contact events, all within {} s", bound(largest, 1)),
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
        statement: format!("reference check by {}: {detail}", method.name()),
        other_stability,
        farther,
        repeated: None,
        times: own.times_of(result, agreeing),
    })
}

/// Whether the witness would take too many steps. Its steps follow from the result's resolved sliding, or from all its
/// sliding if only `series` has long steps. The paper's procedure cannot tell what it resolves.
fn takes_too_long(case: &Case, method: Method, result: &Sequence) -> bool {
    let knows = method == Method::Cvode && case.solver.method.locates_events();
    let period = natural_period(&case.system).filter(|_| knows);
    let slows_down = margin::resistance(&case.system).is_ok();
    let resolved = if slows_down { result.resolved } else { result.slid };
    period.is_some_and(|period| resolved / period * STEPS_PER_PERIOD > MOST_STEPS as f64)
}

/// Expected distance between events of the default method and of an independent method, s.
const PROMISED: f64 = 1e-9;

/// Steps per natural period of a rerun. Longer steps miss short sticks.
const FINER_STEPS_PER_PERIOD: f64 = 50.0;

fn promised(solver: &SolverOptions) -> f64 {
    PROMISED * (solver.rtol / SolverOptions::default().rtol).max(1.0)
}

/// Settings to try if `cvode` and its witness differ: first the default tolerance, then shorter steps as well. Results
/// of other methods are studied as they are; `series` gains nothing.
fn finer_settings(solver: &SolverOptions, system: &System) -> Vec<SolverOptions> {
    if solver.method != Method::Cvode {
        return Vec::new();
    }
    let finer = SolverOptions {
        rtol: solver.rtol.min(SolverOptions::default().rtol),
        ..solver.clone()
    };
    let step = natural_period(system).map(|period| period / FINER_STEPS_PER_PERIOD);
    let finest = SolverOptions {
        max_step: step.into_iter().chain(solver.max_step).reduce(f64::min),
        ..finer.clone()
    };
    let mut settings = vec![finer, finest];
    settings.retain(|settings| settings != solver);
    settings
}

fn in_words(settings: &SolverOptions, own: &SolverOptions) -> String {
    let rtol = (settings.rtol != own.rtol).then(|| format!("solver.rtol={:e}", settings.rtol));
    let step = settings.max_step.filter(|_| settings.max_step != own.max_step);
    let step = step.map(|step| format!("solver.max_step={step:.3e}"));
    rtol.into_iter().chain(step).collect::<Vec<_>>().join(", ")
}

/// First of the [`finer_settings`] with which run and witness agree, and the reason. `None` if none helps, if the
/// first run agrees or has a budget, or if `stop` returns `true`.
pub(super) fn repetition(case: &Case, first: &Witness, stop: &dyn Watch) -> Option<(Case, String)> {
    // A budget leaves no time for another run.
    let budget = case.solver.max_steps.is_some() || case.solver.max_wall_time.is_some();
    if budget || first.agrees(&case.solver) {
        return None;
    }
    let output = OutputOptions::at_the_ends(case.output.end_time);
    finer_settings(&case.solver, &case.system)
        .into_iter()
        .find_map(|settings| {
            let mut sequence = Sequence::default();
            let bounded = SolverOptions {
                max_steps: Some(MOST_STEPS),
                ..settings.clone()
            };
            let run = Run::new(case)
                .solver(&bounded)
                .output(&output)
                .record(&mut sequence)
                .watch(stop);
            if !run.start().is_ok_and(|report| !report.interrupted) {
                return None;
            }
            let mut finer = case.clone();
            finer.solver.clone_from(&settings);
            let found = witness(&finer, &sequence, false, stop)?;
            let helps = found.testimony == Testimony::SameSequence && found.agrees(&finer.solver);
            helps.then(|| {
                let (words, statement) = (in_words(&settings, &case.solver), &first.statement);
                let reason = format!("repeated with {words}; at first: {statement}");
                (finer, reason)
            })
        })
}
