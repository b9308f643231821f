//! A figure of a run: its name, what it is drawn from, and why a run may not have it.

use super::error::PlotError;
use super::figure::Figure;
use super::labels::in_translation;
use super::run::{Run, SAMPLES_PER_PERIOD};
use crate::analysis::headline::is_paper_case;
use crate::case::{CaseRef, Motion};
use crate::model::trains::Pressing;
use crate::record::EventKind;
use crate::simulation::OutputWindow;
use std::f64::consts::TAU;

/// What comes of a figure: drawn, or why this run does not have it.
pub type Outcome = Result<Figure, Absent>;

/// Why a run does not have a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Absent {
    /// In words.
    pub why: String,
    /// The sampling that a repeated run would need to have it.
    pub window: Option<OutputWindow>,
}

impl From<&str> for Absent {
    fn from(why: &str) -> Self {
        Absent {
            why: why.to_owned(),
            window: None,
        }
    }
}

/// One figure of the catalogue.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// File name without extension.
    pub name: &'static str,
    /// Above the figure.
    pub title: &'static str,
    /// Number in the paper, where it is known.
    pub paper_figure: Option<u32>,
    pub(super) draw: fn(&Entry, &Subject) -> Result<Outcome, PlotError>,
}

/// A title in the words of the motion of a run: in translation there are forces, not torques.
pub(crate) fn in_words_of(run: &Run, title: &str) -> String {
    match CaseRef::from(&run.case).motion() {
        Motion::Translation => in_translation(title),
        Motion::Rotation => title.to_owned(),
    }
}

impl Entry {
    /// Makes the figure.
    ///
    /// # Errors
    /// If a file cannot be read. That a run does not have the figure is no error.
    pub fn build(&self, subject: &Subject) -> Result<Outcome, PlotError> {
        if let Some(absent) = without(self, subject.run) {
            return Ok(Err(absent));
        }
        let outcome = (self.draw)(self, subject)?;
        Ok(outcome.map(|figure| Figure {
            title: in_words_of(subject.run, &figure.title),
            paper_figure: self.paper_figure.filter(|_| is_paper_case(&subject.run.case)),
            ..figure
        }))
    }
}

/// The figure of runs that do not stop.
pub(super) const PORTRAIT: &str = "phase-portrait";

/// The figures of a certificate, which any run can have.
pub(super) const CERTIFIED: [&str; 2] = ["event-uncertainties", "error-bands"];

/// The figures that all runs have.
const SHARED: [&str; 6] = [
    "friction-law",
    "rotor-speed",
    "surface-speeds",
    "surface-speeds-close-up",
    "relative-velocity",
    "stick-slip-close-up",
];

/// Those of them that show cycles.
const OF_CYCLES: [&str; 2] = ["surface-speeds-close-up", "stick-slip-close-up"];

/// Why a run does not have a figure, whatever its events and samples are; `None` if it has.
pub(super) fn without(entry: &Entry, run: &Run) -> Option<Absent> {
    let (name, rotor, stator) = (entry.name, &run.system.rotor, &run.system.stator);
    let of_axial_mode = name.contains("axial") || name == "phase-plateau";
    if name == "rotor-speed" && rotor.is_rigid() {
        return Some(unlike(run, "its rotor has no inertia and moves as it is driven"));
    }
    if run.stops() {
        let why = match name {
            PORTRAIT => {
                "it shows the motion that a run of two trains comes to, and this one is of a brake, which stops; see \
                 phase-stick-slip-stator"
            }
            _ if of_axial_mode && !run.has_axial_mode() => {
                "it shows how an axial mode answers F(t), and here the normal force is given directly"
            }
            _ if name.ends_with("-rotor") && rotor.shafts() == 0 => "its rotor has no shaft",
            _ if name.ends_with("-stator") && stator.shafts() == 0 => "its stator has no shaft",
            _ => return None,
        };
        return Some(why.into());
    }
    let why = match name {
        _ if OF_CYCLES.contains(&name) && run.cycles.is_empty() => return Some(NO_CYCLE.into()),
        _ if SHARED.contains(&name) || CERTIFIED.contains(&name) => return None,
        PORTRAIT => return None,
        _ if of_axial_mode => "it shows how the brake's axial mode answers F(t)",
        _ if name.contains("growth") => {
            "it shows the growth from the brake's loss of stability on; of trains `stickslip modes` says where sliding is unstable"
        }
        _ => "its window is found by the stop of the brake",
    };
    Some(unlike(run, why))
}

/// Why a run has not a figure that others have.
fn unlike(run: &Run, why: &str) -> Absent {
    match run.stops() {
        true => why.into(),
        false => {
            let has = SHARED.join(", ");
            let why =
                format!("{why}, and this run is of two trains; such a run has {has}, {PORTRAIT}, and any channel");
            Absent::from(why.as_str())
        }
    }
}

/// The runs to draw and the moments of the first of them that divide its subject.
#[derive(Debug)]
pub struct Subject<'a> {
    /// All that were named, the first of them the subject.
    pub runs: &'a [Run],
    /// The first.
    pub run: &'a Run,
    /// The natural period, s; where nothing moves by itself, that of the first cycle; NaN without either.
    pub period: f64,
    /// Period of the axial motion without damping, s; NaN without an axial mode.
    pub axial_period: f64,
    /// First and last stick, s.
    pub onset: Option<f64>,
    /// The stick in which the run ends, s.
    pub final_stick: Option<f64>,
    /// Loss of stability, s.
    pub instability: Option<f64>,
    /// The last corner of F(t), s.
    pub corner: Option<f64>,
}

impl<'a> Subject<'a> {
    /// Of runs of which the first is the reference; `None` without a run.
    pub fn new(runs: &'a [Run]) -> Option<Subject<'a>> {
        let run = runs.first()?;
        let first = |kind: EventKind| run.events.iter().find(|e| e.kind == kind).map(|e| e.time);
        let axial_period = match &run.system.pressing {
            Pressing::Axial { axial, .. } => TAU / (axial.stiffness / axial.mass).sqrt(),
            Pressing::Force(_) => f64::NAN,
        };
        let cycle = run.cycles.first().map(|cycle| cycle.period);
        let corner = run.events.iter().rfind(|e| e.kind == EventKind::Corner);
        Some(Subject {
            runs,
            run,
            period: run.natural_period.or(cycle).unwrap_or(f64::NAN),
            axial_period,
            onset: run.stick_slip.onset_time,
            final_stick: run.stick_slip.final_stick_time,
            instability: first(EventKind::Destabilised),
            corner: corner.map(|e| e.time).filter(|&t| t > 0.0),
        })
    }

    /// The part of a window that the first run covers, if its samples there resolve motions of `period`; or why not.
    pub(super) fn resolved(
        &self,
        (from, to): (f64, f64),
        period: f64,
    ) -> Result<Result<(f64, f64), Absent>, PlotError> {
        let window = (from.max(self.run.times.0), to.min(self.run.times.1));
        if self.run.is_dense(window) {
            return Ok(Ok(window));
        }
        let count = match self.run.rows_in(window) {
            Ok(rows) => rows.len() as f64,
            Err(PlotError::NothingInRange { .. }) => 0.0,
            Err(error) => return Err(error),
        };
        if window.1 > window.0 && count * period >= SAMPLES_PER_PERIOD * (window.1 - window.0) {
            return Ok(Ok(window));
        }
        Ok(Err(too_sparse((from, to), period)))
    }
}

/// Why a close-up is not drawn, and which samples it needs: a hundred in a period.
pub(super) fn too_sparse((from, to): (f64, f64), period: f64) -> Absent {
    // Two digits, and whole milliseconds.
    let interval = period / 100.0;
    let outward = |t: f64, round: fn(f64) -> f64| round(t * 1e3) / 1e3;
    let window = OutputWindow {
        from: outward(from, f64::floor).max(0.0),
        to: outward(to, f64::ceil),
        interval: format!("{interval:.1e}").parse().unwrap_or(interval),
    };
    Absent {
        why: format!(
            "the samples from {from:.6} to {to:.6} s are too far apart to show the motion: it takes one every {:.1e} s",
            window.interval
        ),
        window: Some(window),
    }
}

pub(super) const NO_STICK: &str = "the run has no stick";
pub(super) const NO_CORNER: &str = "F(t) has no corner after the start";
pub(super) const NO_CYCLE: &str = "the run has no stick that ends";
