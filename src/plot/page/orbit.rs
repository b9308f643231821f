//! Phase portrait of one period of the attractor.

use serde::Serialize;

use super::form::has_stick;
use crate::plot::html::Doubles;
use crate::plot::portraits::{ShownPortrait, few_samples, shown};
use crate::plot::{DrawnRun, Error};

const POINTS: usize = 30_000;

/// One period of the attractor, or the end of a run that is not periodic.
#[derive(Debug, Serialize)]
pub(super) struct PageOrbit {
    id: &'static str,
    heading: &'static str,
    hint: String,
    /// Start and end, s.
    from: f64,
    to: f64,
    /// Period, s, if periodic.
    period: Option<f64>,
    x: OrbitAxis,
    y: OrbitAxis,
    lines: Vec<OrbitLine>,
}

#[derive(Debug, Serialize)]
struct OrbitAxis {
    label: String,
    unit: String,
}

#[derive(Debug, Serialize)]
struct OrbitLine {
    mode: &'static str,
    x: Doubles,
    y: Doubles,
}

impl PageOrbit {
    /// The orbit of the figure `phase-portrait`, and a note on omitted points.
    pub(super) fn of(run: &DrawnRun) -> Result<(PageOrbit, Option<String>), Error> {
        let ShownPortrait { axes, window, periodic } = shown(run);
        let period = run.attractor_period.filter(|_| periodic);
        let (heading, span) = match period {
            Some(period) => ("Last period", format!("the last {period:.6} s")),
            None => ("Phase portrait", "the run".to_owned()),
        };
        let colours = match has_stick(&run.system) {
            true => ": vermilion in stick, blue and purple in slip.",
            false => ".",
        };
        let few = few_samples(run, window)?.map(|few| few.replacen("it", " It", 1) + ".");
        let few = few.unwrap_or_default();
        let over = run.axis(axes.0)?.name;
        let window = run.shortened(window, POINTS)?;
        let axis = |channel: &str| -> Result<OrbitAxis, Error> {
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
        let orbit = PageOrbit {
            id: "portrait-orbit",
            heading,
            hint: format!("Relative velocity over {over}, of {span}{colours}{few}"),
            from: window.0,
            to: window.1,
            period,
            x: axis(axes.0)?,
            y: axis(axes.1)?,
            lines,
        };
        Ok((orbit, note))
    }
}
