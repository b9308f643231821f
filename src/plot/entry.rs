//! Figures of a run: their names and data, and reasons why a run may lack one.

use super::figure::{Figure, Panel};
use super::run::{DrawnRun, SAMPLES_PER_PERIOD};
use crate::error::{Error, ErrorKind};
use std::f64::consts::TAU;
use stickslip_engine::simulation::OutputWindow;
use stickslip_system::model::system::Pressing;
use stickslip_system::record::EventKind;

/// A figure, or the reason why this run does not have it.
pub type FigureOutcome = Result<Figure, NoFigure>;

/// Reason why a run lacks a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct NoFigure {
    /// The reason in words.
    pub why: String,
    /// Sampling with which a repeated run would have the figure.
    pub window: Option<OutputWindow>,
}

impl From<&str> for NoFigure {
    fn from(why: &str) -> Self {
        NoFigure {
            why: why.to_owned(),
            window: None,
        }
    }
}

pub(super) type Drawn = Result<Figure, Undrawn>;

pub(super) enum Undrawn {
    Absent(NoFigure),
    Failed(Error),
}

impl<T: Into<NoFigure>> From<T> for Undrawn {
    fn from(absent: T) -> Self {
        Undrawn::Absent(absent.into())
    }
}

impl From<Error> for Undrawn {
    fn from(error: Error) -> Self {
        Undrawn::Failed(error)
    }
}

/// A figure in the catalogue.
#[derive(Debug, Clone, Copy)]
pub struct CatalogueEntry {
    /// File name without extension.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Number in the paper; `None` if it is not in the paper.
    pub paper_figure: Option<u32>,
    pub(super) form: FigureForm,
}

type FigurePanels = &'static [&'static [&'static str]];

pub(super) type FigureView = fn(&Subject) -> View;

#[derive(Debug, Clone, Copy)]
pub(super) enum FigureForm {
    /// Channels over the whole run.
    Whole(FigurePanels),
    CloseUp(FigurePanels, FigureView),
    /// Portrait of a growing or decaying oscillation: x, y.
    Spiral((&'static str, &'static str), FigureView),
    /// Portrait of cycles: x, y.
    Orbit((&'static str, &'static str), FigureView),
    Own(fn(&CatalogueEntry, &Subject) -> Drawn),
}

impl CatalogueEntry {
    pub(super) const fn in_paper(self, number: u32) -> CatalogueEntry {
        CatalogueEntry {
            paper_figure: Some(number),
            ..self
        }
    }

    pub(super) fn figure(&self, panels: Vec<Panel>) -> Figure {
        Figure::new(self.name, self.title, panels)
    }
}

pub(super) const fn entry(name: &'static str, title: &'static str, form: FigureForm) -> CatalogueEntry {
    CatalogueEntry {
        name,
        title,
        paper_figure: None,
        form,
    }
}

pub(super) const PORTRAIT: &str = "phase-portrait";

/// A time window (s) and the period (s) of the motion in it, or the reason for its absence.
pub(super) type View = Result<((f64, f64), f64), NoFigure>;

/// The runs to draw, and the times that divide the first run.
#[derive(Debug)]
pub struct Subject<'a> {
    /// All runs.
    pub runs: &'a [DrawnRun],
    /// The first run.
    pub run: &'a DrawnRun,
    /// Natural period, s. Without one it is the period of the first cycle, or NaN.
    pub period: f64,
    /// Undamped axial period, s; NaN without an axial mode.
    pub axial_period: f64,
    /// Time of the first stick, s.
    pub onset: Option<f64>,
    /// Start of the stick with which the run ends, s.
    pub final_stick: Option<f64>,
    /// Time of the loss of stability, s.
    pub instability: Option<f64>,
    /// Time of the last corner of F(t), s.
    pub corner: Option<f64>,
}

impl<'a> Subject<'a> {
    /// The subject for `runs`; `None` if there are no runs.
    pub fn new(runs: &'a [DrawnRun]) -> Option<Subject<'a>> {
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

    pub(super) fn first_stick(&self) -> Result<f64, NoFigure> {
        self.onset.ok_or_else(|| "the run has no stick".into())
    }

    pub(super) fn last_corner(&self) -> Result<f64, NoFigure> {
        self.corner.ok_or_else(|| "F(t) has no corner after the start".into())
    }

    /// Time of the final stick or, without one, of the last event, s.
    pub(super) fn end(&self) -> f64 {
        let last = self.run.events.last().map(|event| event.time);
        self.final_stick.or(last).unwrap_or(f64::NAN)
    }

    /// The part of a view that the first run covers with sufficient samples, or the reason for its absence.
    pub(super) fn resolved(&self, view: View) -> Result<(f64, f64), Undrawn> {
        let ((from, to), period) = view?;
        let window = (from.max(self.run.times.0), to.min(self.run.times.1));
        if self.run.is_dense(window) {
            return Ok(window);
        }
        let count = match self.run.rows_in(window) {
            Ok(rows) => rows.len() as f64,
            Err(error) if error.kind == ErrorKind::NothingInRange => 0.0,
            Err(error) => return Err(error.into()),
        };
        if window.1 > window.0 && count * period >= SAMPLES_PER_PERIOD * (window.1 - window.0) {
            return Ok(window);
        }
        Err(too_sparse((from, to), period).into())
    }
}

impl Subject<'_> {
    /// The window of each run, each from its own events; `None` for a later run without one. Fails if the first has none.
    pub(super) fn windows(
        &self,
        window: impl Fn(&Subject) -> Result<(f64, f64), Undrawn>,
    ) -> Result<Vec<Option<(f64, f64)>>, Undrawn> {
        let mut windows = vec![Some(window(self)?)];
        for run in self.runs.iter().skip(1) {
            let own = Subject::new(std::slice::from_ref(run));
            windows.push(match own.as_ref().map(&window) {
                Some(Err(Undrawn::Failed(error))) => return Err(error.into()),
                Some(Ok(window)) => Some(window),
                _ => None,
            });
        }
        Ok(windows)
    }
}

/// The reason why a close-up is absent, with the sampling that it needs: 100 samples per period.
pub(super) fn too_sparse((from, to): (f64, f64), period: f64) -> NoFigure {
    // Rounded to two digits, and whole milliseconds.
    let interval = period / 100.0;
    let outward = |t: f64, round: fn(f64) -> f64| round(t * 1e3) / 1e3;
    let window = OutputWindow {
        from: outward(from, f64::floor).max(0.0),
        to: outward(to, f64::ceil),
        interval: format!("{interval:.1e}").parse().unwrap_or(interval),
    };
    NoFigure {
        why: format!(
            "the samples from {from:.6} to {to:.6} s are too far apart to show the motion: it takes one every {:.1e} s",
            window.interval
        ),
        window: Some(window),
    }
}

pub(super) const NO_CYCLE: &str = "the run has no stick that ends";
