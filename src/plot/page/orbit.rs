//! One period of the motion that a run comes to, as a phase portrait.

use serde::Serialize;

use crate::plot::html::Doubles;
use crate::plot::portraits::{Shown, shown};
use crate::plot::{PlotError, Run};

/// Points of the orbit on a page.
const POINTS: usize = 30_000;

/// One period of the motion that the run comes to, or the end of a run that does not repeat itself.
#[derive(Debug, Serialize)]
pub(super) struct Orbit {
    /// When it begins and ends, s.
    from: f64,
    to: f64,
    /// The period, s; `None` of a motion that does not repeat itself.
    period: Option<f64>,
    x: OrbitAxis,
    y: OrbitAxis,
    lines: Vec<OrbitLine>,
}

#[derive(Debug, Serialize)]
struct OrbitAxis {
    label: String,
    /// UDUNITS.
    unit: String,
}

#[derive(Debug, Serialize)]
struct OrbitLine {
    mode: &'static str,
    x: Doubles,
    y: Doubles,
}

impl Orbit {
    /// The orbit of a run, as its figure `phase-portrait` has it; and what of it is left out.
    pub(super) fn of(run: &Run) -> Result<(Orbit, Option<String>), PlotError> {
        let Shown { axes, window, periodic } = shown(run);
        let window = run.shortened(window, POINTS)?;
        let axis = |channel: &str| -> Result<OrbitAxis, PlotError> {
            let axis = run.axis(channel)?;
            Ok(OrbitAxis {
                label: axis.short().to_owned(),
                unit: axis.unit,
            })
        };
        let (mut lines, mut room, mut cut) = (Vec::new(), POINTS, false);
        for (mode, pieces) in run.portrait(axes.0, axes.1, window)? {
            for mut piece in pieces {
                cut |= piece.len() > room;
                piece.truncate(room);
                room -= piece.len();
                lines.push(OrbitLine {
                    mode: mode.name(),
                    x: piece.iter().map(|point| point.0).collect(),
                    y: piece.iter().map(|point| point.1).collect(),
                });
            }
        }
        let note =
            cut.then(|| format!("The phase portrait is cut after {POINTS} points; `stickslip plot` draws all of it."));
        let orbit = Orbit {
            from: window.0,
            to: window.1,
            period: periodic.then_some(run.attractor_period).flatten(),
            x: axis(axes.0)?,
            y: axis(axes.1)?,
            lines,
        };
        Ok((orbit, note))
    }
}
