//! Figures of a comparison: both runs and the error over time, the error of each event, the first wrong event
//! enlarged.

use super::figure::{Axis, Curve, CurveStyle, Figure, Panel, drawn};
use super::own::{over_time, time_axis};
use super::run::{BUCKETS, DrawnRun};
use super::style::{BLACK, BLUE, VERMILLION};
use super::thinning::MinMax;
use crate::Error;
use std::path::Path;
use stickslip_compare::{Comparison, Mapping, Reference};
use stickslip_system::record::sequence::Fault;

/// Most samples of a candidate in a window for which points are drawn.
const FEW: usize = 150;

/// Smallest drawn error of event times, s, below the spacing of doubles. Zero has no logarithm.
const LEAST: f64 = 1e-17;

/// A candidate that is drawn together with a reference.
#[derive(Debug, Clone, Copy)]
pub struct DrawnCandidate<'a> {
    /// The reference.
    pub reference: &'a Reference,
    /// The reference's file, open for drawing.
    pub run: &'a DrawnRun,
    /// The candidate's file.
    pub path: &'a Path,
    /// The mapping of its columns to channels.
    pub mapping: &'a Mapping,
}

struct ComparisonView {
    name: String,
    title: String,
    channel: String,
    window: (f64, f64),
}

struct TracedChannel {
    candidate: MinMax,
    error: Vec<MinMax>,
    open: bool,
    samples: usize,
    compared: usize,
}

/// Most pieces of an error curve. Further points extend the last piece.
const MOST_PIECES: usize = 1000;

impl TracedChannel {
    fn of((from, to): (f64, f64)) -> TracedChannel {
        TracedChannel {
            candidate: MinMax::new(from, to, BUCKETS),
            error: Vec::new(),
            open: false,
            samples: 0,
            compared: 0,
        }
    }

    fn push(&mut self, (from, to): (f64, f64), time: f64, candidate: f64, reference: Option<f64>) {
        self.samples += 1;
        self.candidate.push(time, candidate);
        self.compared += usize::from(reference.is_some());
        let error = reference.map_or(0.0, |reference| (candidate - reference).abs());
        // Zero has no logarithm.
        if error > 0.0 {
            if self.error.is_empty() || (!self.open && self.error.len() < MOST_PIECES) {
                self.error.push(MinMax::new(from, to, BUCKETS));
            }
            if let Some(piece) = self.error.last_mut() {
                piece.push(time, error);
            }
        }
        self.open = error > 0.0;
    }
}

impl DrawnCandidate<'_> {
    fn label(&self) -> String {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if stem == self.run.name() {
            format!("candidate {stem}")
        } else {
            stem
        }
    }

    /// The figures of a comparison. A table of events only has the errors of events.
    pub fn figures(&self, comparison: &Comparison) -> Result<Vec<Figure>, Error> {
        let mut views = Vec::new();
        if let Some(channel) = self.channels()?.into_iter().next() {
            let name = self.run.axis(&channel)?.name;
            let name = name[..1].to_uppercase() + &name[1..];
            let view = |of: &str, title: String, (from, to): (f64, f64)| ComparisonView {
                name: format!("comparison{of}"),
                title,
                channel: channel.clone(),
                window: (from.max(self.run.times.0), to.min(self.run.times.1)),
            };
            let (from, to) = comparison.span.map_or(self.run.times, |span| (span.from, span.to));
            views.push(view("", format!("{name}: reference, candidate and error"), (from, to)));
            let period = self.reference.natural_period();
            let stick_slip = &self.run.stick_slip;
            let ends = stick_slip.onset_time.zip(stick_slip.final_stick_time);
            if let Some((onset, end)) = ends.filter(|_| self.run.stops()) {
                let window = (onset - 12.0 * period, end + 6.0 * period);
                views.push(view(
                    "-stick-slip",
                    format!("{name} in stick-slip: reference, candidate and error"),
                    window,
                ));
            }
            let scale = comparison.time_scale.as_ref().map(|scale| scale.period);
            let half = scale.map_or(2.5 * period, |scale| 0.5 * scale);
            let enlarged = |of: &str, (title, time, error): (String, f64, f64)| {
                let half = half.max(4.0 * error);
                view(of, title, (time - half, time + half))
            };
            match &comparison.first_wrong {
                Some(wrong) => {
                    let title = format!("First wrong event: {}", wrong.words());
                    let error = wrong.error.map_or(0.0, f64::abs);
                    views.push(enlarged("-first-wrong-event", (title, wrong.time, error)));
                }
                None => views.extend(largest_error(comparison).map(|worst| enlarged("-largest-error", worst))),
            }
            views.retain(|view| view.window.0 < view.window.1 && self.run.rows_in(view.window).is_ok());
        }
        let mut figures = self.over_time(&views)?;
        figures.extend(by_event(comparison));
        Ok(figures)
    }

    /// Draws the requested channels over time, each with its error.
    ///
    /// # Errors
    /// The reference or the candidate lacks a channel, or a file is unreadable.
    pub fn channels_over_time(&self, channels: &[String], window: (f64, f64)) -> Result<Vec<Figure>, Error> {
        let known = self.channels()?;
        let mut views = Vec::new();
        for channel in channels {
            let axis = self.run.axis(channel)?;
            if !known.contains(channel) {
                let known = known.join(", ");
                return Err(Error::of_file(
                    self.path,
                    format!(
                        "has no \"{channel}\" to be drawn with the result; it has {known} (--column and --map name its columns)"
                    ),
                ));
            }
            views.push(ComparisonView {
                name: format!("comparison-{channel}"),
                title: format!("{}: reference, candidate and error", axis.name),
                channel: channel.clone(),
                window,
            });
        }
        self.over_time(&views)
    }

    fn channels(&self) -> Result<Vec<String>, Error> {
        let traced = self.reference.traced(self.path, self.mapping)?;
        let names = traced.iter().map(|channel| channel.name().into_owned());
        let mut names: Vec<String> = names.filter(|name| self.run.axis(name).is_ok()).collect();
        names.sort_by_key(|name| name != "relative_velocity");
        Ok(names)
    }

    fn over_time(&self, views: &[ComparisonView]) -> Result<Vec<Figure>, Error> {
        let traced = self.reference.traced(self.path, self.mapping)?;
        let place = |view: &ComparisonView| traced.iter().position(|channel| channel.name() == view.channel);
        let places: Vec<usize> = views.iter().filter_map(place).collect();
        let mut found: Vec<TracedChannel> = views.iter().map(|view| TracedChannel::of(view.window)).collect();
        if !views.is_empty() {
            self.reference.trace(self.path, self.mapping, &mut |pair| {
                for ((view, &place), traced) in views.iter().zip(&places).zip(&mut found) {
                    if pair.time >= view.window.0 && pair.time <= view.window.1 {
                        let reference = pair.reference.map(|values| values[place]);
                        traced.push(view.window, pair.time, pair.candidate[place], reference);
                    }
                }
            })?;
        }
        views
            .iter()
            .zip(found)
            .map(|(view, traced)| self.figure(view, traced))
            .collect()
    }

    fn figure(&self, view: &ComparisonView, traced: TracedChannel) -> Result<Figure, Error> {
        let mut figure = over_time(
            std::slice::from_ref(self.run),
            &view.name,
            &view.title,
            &[&[&view.channel]],
            view.window,
        )?;
        let axis = self.run.axis(&view.channel)?;
        let error: Vec<Vec<(f64, f64)>> = traced.error.into_iter().map(MinMax::finish).collect();
        let few = traced.samples <= FEW;
        let Some(panel) = figure.panels.first_mut() else {
            return Ok(figure);
        };
        if let Some(curve) = panel.curves.first_mut() {
            curve.label = self.run.label();
            curve.color = BLUE;
        }
        let (points, label, ground) = (traced.candidate.finish(), self.label(), panel.modes.clone());
        let line = |label: &str| Curve::line(label, VERMILLION, points.clone());
        let thin = if few { "" } else { &label };
        // Dashes over a solid line: where both agree, both colours are visible.
        panel.curves.push(line(thin).styled(CurveStyle::Dashed));
        if few {
            panel.curves.push(line(&label).styled(CurveStyle::Points));
        }
        if error.is_empty() {
            let why = match traced.compared {
                0 => "it has no sample here",
                _ => "no difference at its samples",
            };
            figure.title = format!("{}; {why}", figure.title);
            return Ok(figure);
        }
        let style = if few { CurveStyle::Points } else { CurveStyle::Solid };
        let curve = Curve::pieces("|error| at the same time", BLACK, error).styled(style);
        let size = Axis::new(&format!("error of {}", axis.short()), &axis.unit)
            .with_symbol("")
            .by_powers();
        figure.panels.push(Panel {
            modes: ground,
            ..Panel::new(time_axis(view.window), size, vec![curve])
        });
        Ok(figure)
    }
}

/// The event with the largest error: in words, its time (s) and its error (s). It is drawn if no event is wrong.
fn largest_error(comparison: &Comparison) -> Option<(String, f64, f64)> {
    let events = comparison.event_errors.events.iter();
    let worst = events.max_by(|a, b| a.error.abs().total_cmp(&b.error.abs()))?;
    let (position, kind, time, error) = (worst.position, worst.kind, worst.time, worst.error);
    let title =
        format!("The event with the largest error: event {position}, a {kind} at {time:.6} s, is off by {error:.1e} s");
    Some((title, time, error.abs()))
}

fn by_event(comparison: &Comparison) -> Option<Figure> {
    let events = &comparison.event_errors.events;
    if events.is_empty() {
        return None;
    }
    let of = |late: bool| -> Vec<(f64, f64)> {
        let side = events.iter().filter(|event| (event.error >= 0.0) == late);
        side.map(|event| (event.position as f64, event.error.abs().max(LEAST)))
            .collect()
    };
    let (late, early) = (of(true), of(false));
    let largest = events.iter().map(|event| event.error.abs()).fold(LEAST, f64::max);
    let of_fault = |faults: &[Fault]| -> Vec<(f64, f64)> {
        let there = comparison
            .sequence
            .iter()
            .filter(|difference| faults.contains(&difference.fault));
        there.map(|difference| (difference.position as f64, largest)).collect()
    };
    let curves = drawn([
        Curve::filled("the candidate is late", VERMILLION, late),
        Curve::filled("the candidate is early", BLUE, early),
        Curve::open(
            "without a match (no error)",
            BLACK,
            of_fault(&[Fault::Missing, Fault::Spurious]),
        ),
    ]);
    let last = events.iter().map(|event| event.position).max().unwrap_or(0) as f64;
    let x = Axis::new("event of the reference", "1").ranging(-0.03 * last - 0.5, 1.03 * last + 0.5);
    let y = Axis::new("error of the time", "s").by_powers();
    let panels = vec![Panel::new(x, y, curves)];
    Some(Figure::new(
        "comparison-events",
        "Error of the time of each event",
        panels,
    ))
}
