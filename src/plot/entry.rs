//! A figure of a run: its name, what it is drawn from, and why a run may not have it.

use super::error::PlotError;
use super::figure::{Figure, Panel};
use super::run::{Run, SAMPLES_PER_PERIOD};
use crate::model::system::Pressing;
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

/// A figure; or why the run does not have it, or what failed.
pub(super) type Drawn = Result<Figure, Undrawn>;

/// Why there is no figure.
pub(super) enum Undrawn {
    Absent(Absent),
    Failed(PlotError),
}

impl<T: Into<Absent>> From<T> for Undrawn {
    fn from(absent: T) -> Self {
        Undrawn::Absent(absent.into())
    }
}

impl From<PlotError> for Undrawn {
    fn from(error: PlotError) -> Self {
        Undrawn::Failed(error)
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
    pub(super) draw: fn(&Entry, &Subject) -> Drawn,
}

impl Entry {
    /// The same with its number in the paper.
    pub(super) const fn in_paper(self, number: u32) -> Entry {
        Entry {
            paper_figure: Some(number),
            ..self
        }
    }

    /// The figure with these panels.
    pub(super) fn figure(&self, panels: Vec<Panel>) -> Figure {
        Figure::new(self.name, self.title, panels)
    }
}

pub(super) const fn entry(name: &'static str, title: &'static str, draw: fn(&Entry, &Subject) -> Drawn) -> Entry {
    Entry {
        name,
        title,
        paper_figure: None,
        draw,
    }
}

/// The figure of the motion that a run comes to.
pub(super) const PORTRAIT: &str = "phase-portrait";

/// A window of time (s), and the period (s) of the motion that is to be seen in it; or why there is none.
pub(super) type View = Result<((f64, f64), f64), Absent>;

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

    /// The first stick, s.
    pub(super) fn first_stick(&self) -> Result<f64, Absent> {
        self.onset.ok_or_else(|| "the run has no stick".into())
    }

    /// The last corner of F(t), s.
    pub(super) fn last_corner(&self) -> Result<f64, Absent> {
        self.corner.ok_or_else(|| "F(t) has no corner after the start".into())
    }

    /// The stick in which the run ends, or its last event, s.
    pub(super) fn end(&self) -> f64 {
        let last = self.run.events.last().map(|event| event.time);
        self.final_stick.or(last).unwrap_or(f64::NAN)
    }

    /// The part of a view that the first run covers, if its samples there resolve the motion; or why not.
    pub(super) fn resolved(&self, view: View) -> Result<(f64, f64), Undrawn> {
        let ((from, to), period) = view?;
        let window = (from.max(self.run.times.0), to.min(self.run.times.1));
        if self.run.is_dense(window) {
            return Ok(window);
        }
        let count = match self.run.rows_in(window) {
            Ok(rows) => rows.len() as f64,
            Err(PlotError::NothingInRange { .. }) => 0.0,
            Err(error) => return Err(error.into()),
        };
        if window.1 > window.0 && count * period >= SAMPLES_PER_PERIOD * (window.1 - window.0) {
            return Ok(window);
        }
        Err(too_sparse((from, to), period).into())
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

pub(super) const NO_CYCLE: &str = "the run has no stick that ends";
