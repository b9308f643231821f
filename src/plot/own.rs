//! Figures with channels that the user chooses, over time or against each other.

use super::figure::{Axis, Curve, CurveStyle, Figure, Panel};
use super::labels;
use super::run::{DrawnRun, Undersampled};
use super::style::{BLACK, line_color, of_mode, of_run};
use crate::Error;
use stickslip_system::model::Mode;

/// A time window, s, limited to the first run.
///
/// # Errors
/// The window contains no sample of the first run.
pub fn window(runs: &[DrawnRun], from: Option<f64>, to: Option<f64>) -> Result<(f64, f64), Error> {
    let Some(run) = runs.first() else {
        return Ok((0.0, 0.0));
    };
    let window = (from.unwrap_or(run.times.0), to.unwrap_or(run.times.1));
    if !run.is_dense(window) {
        run.rows_in(window)?;
    }
    Ok((window.0.max(run.times.0), window.1.min(run.times.1)))
}

pub(crate) fn time_axis(window: (f64, f64)) -> Axis {
    Axis::new("time", "s").ranging(window.0, window.1)
}

/// Draws channels of all runs over time, grouped into panels. Of several runs, each channel has its own panel, and a
/// colour and line style is a run. Modes and events are those of the first run; the legend says so.
pub(crate) fn over_time(
    runs: &[DrawnRun],
    name: &str,
    title: &str,
    panels: &[&[&str]],
    window: (f64, f64),
) -> Result<Figure, Error> {
    let several = runs.len() > 1;
    let single: Vec<&[&str]> = panels.iter().flat_map(|channels| channels.chunks(1)).collect();
    let panels = if several { &single[..] } else { panels };
    let mut drawn = Vec::with_capacity(panels.len());
    let mut first_color = 0;
    let undersampled = undersampled(runs, window)?;
    let mut named = false;
    for channels in panels {
        let mut curves = Vec::new();
        let mut axes = Vec::with_capacity(channels.len());
        for (number, run) in runs.iter().enumerate() {
            for (k, (channel, points)) in channels.iter().zip(run.curves(channels, window)?).enumerate() {
                let axis = run.axis(channel)?;
                let label = match channels.len() {
                    _ if several => run.label(),
                    1 => String::new(),
                    _ => axis.label(),
                };
                // Two channels may coincide, such as surfaces that stick together.
                let (color, style) = match (several, channels.len()) {
                    (true, _) => of_run(number),
                    (false, 2) => (line_color(first_color + k), of_run(k).1),
                    (false, _) => (line_color(first_color + k), CurveStyle::Solid),
                };
                let (pieces, broken) = split(points, &undersampled[number].seen(window));
                curves.push(Curve::pieces(&label, color, pieces).styled(style));
                if !broken.is_empty() {
                    let label = if named { "" } else { UNDERSAMPLED };
                    curves.push(Curve::pieces(label, color, broken).styled(CurveStyle::Dotted));
                    named = true;
                }
                if number == 0 {
                    axes.push(axis);
                }
            }
        }
        if !several && panels.len() > 1 {
            first_color += channels.len();
        }
        let mut panel = Panel::new(time_axis(window), labels::common(&axes), curves);
        if let Some(run) = runs.first() {
            panel.modes = run.ground(window);
            panel.events = run.marks(window);
            if several {
                // The edges of the background show them.
                panel.events.retain(|(_, kind)| !kind.in_event_sequence());
                panel.shown_of = run.label();
            }
            if run.has_drive() {
                panel.driven_by = "a signal";
            }
        }
        drawn.push(panel);
    }
    Ok(Figure::new(name, with_gaps(title, &undersampled), drawn))
}

fn undersampled(runs: &[DrawnRun], window: (f64, f64)) -> Result<Vec<Undersampled>, Error> {
    runs.iter().map(|run| run.undersampled(window)).collect()
}

const UNDERSAMPLED: &str = "too few samples";

#[expect(clippy::type_complexity, reason = "two lists of lines")]
fn split(points: Vec<(f64, f64)>, stretches: &[(f64, f64)]) -> (Vec<Vec<(f64, f64)>>, Vec<Vec<(f64, f64)>>) {
    if stretches.is_empty() {
        return (vec![points], Vec::new());
    }
    let (mut outside, mut inside, mut next) = (Vec::new(), Vec::new(), 0);
    for &(from, to) in stretches {
        // From the last point before the stretch, which is the state after the event, to the first point after it.
        let start = points.partition_point(|point| point.0 <= from).max(1);
        let end = points.partition_point(|point| point.0 < to).max(start);
        outside.push(points[next.min(start)..start].to_vec());
        inside.push(points[start - 1..(end + 1).min(points.len())].to_vec());
        next = end;
    }
    outside.push(points[next.min(points.len())..].to_vec());
    outside.retain(|piece| !piece.is_empty());
    inside.retain(|piece| piece.len() > 1);
    (outside, inside)
}

fn with_gaps(title: &str, undersampled: &[Undersampled]) -> String {
    let missed: usize = undersampled.iter().map(|of_run| of_run.stretches.len()).sum();
    let all: usize = undersampled.iter().map(|of_run| of_run.of).sum();
    match missed {
        0 => title.to_owned(),
        missed => {
            format!("{title}; straight lines for {missed} of {all} stretches between two events with too few samples")
        }
    }
}

/// Draws channels over time. Channels with the same unit share axes.
///
/// # Errors
/// A channel is unknown, the window contains no sample, or a file is unreadable.
pub fn channels(runs: &[DrawnRun], title: &str, channels: &[&str], window: (f64, f64)) -> Result<Figure, Error> {
    let mut panels: Vec<(String, Vec<&str>)> = Vec::new();
    for &channel in channels {
        let Some(run) = runs.first() else { break };
        let unit = run.axis(channel)?.unit;
        match panels.iter_mut().find(|panel| panel.0 == unit) {
            Some(panel) => panel.1.push(channel),
            None => panels.push((unit, vec![channel])),
        }
    }
    let panels: Vec<&[&str]> = panels.iter().map(|panel| &panel.1[..]).collect();
    over_time(runs, &format!("channel-{}", channels.join("-")), title, &panels, window)
}

/// Draws one channel against another in a time window, with the start of a single run. The colour is the mode's or,
/// for several runs, the run's.
pub fn phase(
    runs: &[DrawnRun],
    name: &str,
    title: &str,
    axes: (&str, &str),
    window: (f64, f64),
) -> Result<Figure, Error> {
    phase_of_each(runs, name, title, axes, &vec![Some(window); runs.len()])
}

/// The same with a time window for each run. The title names runs without one.
pub(crate) fn phase_of_each(
    runs: &[DrawnRun],
    name: &str,
    title: &str,
    (x, y): (&str, &str),
    windows: &[Option<(f64, f64)>],
) -> Result<Figure, Error> {
    let mut curves = Vec::new();
    let mut gaps = Vec::new();
    for (number, (run, window)) in runs.iter().zip(windows).enumerate() {
        let Some(window) = *window else { continue };
        for (mode, pieces) in run.portrait(x, y, window)? {
            let (label, (color, style)) = match runs.len() {
                1 => (mode.name().to_owned(), (of_mode(mode), CurveStyle::Solid)),
                _ => (run.label(), of_run(number)),
            };
            curves.push(Curve::pieces(&label, color, pieces).styled(style));
        }
        gaps.push(run.undersampled(window)?);
    }
    if let ([run], [Some(window)]) = (runs, windows) {
        // A single mode need not be named.
        if let [curve] = &mut curves[..]
            && curve.label == Mode::SlipForward.name()
        {
            curve.label.clear();
        }
        let start = Curve::line("start", BLACK, vec![run.start(x, y, *window)?]);
        curves.push(start.styled(CurveStyle::Points));
    }
    let axis = |channel: &str| {
        runs.first()
            .map_or_else(|| Ok(Axis::new("", "1")), |run| run.axis(channel))
    };
    let panel = Panel {
        square: true,
        ..Panel::new(axis(x)?, axis(y)?, curves)
    };
    let without = runs.iter().zip(windows).filter(|(_, window)| window.is_none());
    let without: Vec<String> = without.map(|(run, _)| run.label()).collect();
    let title = match &without[..] {
        [] => title.to_owned(),
        labels => format!("{title}; not in {}", labels.join(", ")),
    };
    Ok(Figure::new(name, with_gaps(&title, &gaps), vec![panel]))
}
