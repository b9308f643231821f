//! Figures of a certificate: uncertainties of events, and error bands of channels.

use super::entry::{CatalogueEntry, Drawn, FigureForm, Subject, entry};
use super::figure::{Area, Axis, BELOW_LEAST_ERROR, Curve, CurveStyle, Figure, LEAST_ERROR, Panel, TIP_DOWN, drawn};
use super::own::time_axis;
use super::style::{BLACK, BLUE, ORANGE, SKY, VERMILLION, line_color};
use stickslip_files::AddedGroup;

/// Figures of a certified file.
pub const ENTRIES: &[CatalogueEntry] = &[
    entry(
        "event-uncertainties",
        "Uncertainty of the events, certified",
        FigureForm::Own(events),
    ),
    entry(
        "error-bands",
        "Error bands of the channels, certified",
        FigureForm::Own(bands),
    ),
];

const CHANNELS: [&str; 2] = ["relative_velocity", "friction_torque"];

const WITHOUT: &str = "the file has no certificate: `stickslip certify FILE` writes a copy with one";

fn column<'a>(group: &'a AddedGroup, name: &str) -> Option<&'a [f64]> {
    let found = group.columns.iter().find(|(column, ..)| column.name == name);
    found.map(|(.., values)| values.as_slice())
}

/// For each event the range from rounding to its uncertainty, and the true error if the exact solution is known.
fn events(entry: &CatalogueEntry, subject: &Subject) -> Drawn {
    let run = subject.run;
    let (Some(group), Some(uncertainty)) = (run.certificate()?, run.time_uncertainty()) else {
        return Err(WITHOUT.into());
    };
    let numbered = |values: &[f64]| -> Vec<(f64, f64)> {
        let numbers = values.iter().enumerate().filter(|(_, value)| value.is_finite());
        numbers.map(|(k, value)| (k as f64, value.abs())).collect()
    };
    let (points, below): (Vec<_>, Vec<_>) = numbered(&uncertainty)
        .into_iter()
        .partition(|point| point.1 >= LEAST_ERROR);
    let below: Vec<(f64, f64)> = below.into_iter().map(|(k, _)| (k, LEAST_ERROR)).collect();
    if points.is_empty() && below.is_empty() {
        return Err("no event of its certificate is converged, so none has an uncertainty".into());
    }
    let mut curves = Vec::new();
    if let Some(rounding) = column(&group, "rounding") {
        let bars = points.iter().filter_map(|&(k, high)| {
            let low = rounding
                .get(k as usize)
                .filter(|low| low.is_finite())?
                .abs()
                .max(LEAST_ERROR);
            (low < high).then(|| vec![(k, low), (k, high)])
        });
        curves.push(Curve::pieces("from what rounding alone does", SKY, bars.collect()));
    }
    let style = CurveStyle::of_many(points.len(), 200, CurveStyle::Points);
    // With an exact solution the uncertainty is the true error. Another value has a mark of its own.
    let errors = column(&group, "true_error").unwrap_or_default();
    let differs = |&(k, error): &(f64, f64)| {
        let (own, error) = (uncertainty[k as usize].abs().max(LEAST_ERROR), error.max(LEAST_ERROR));
        (error - own).abs() > 1e-9 * error
    };
    let differing: Vec<(f64, f64)> = numbered(errors).into_iter().filter(differs).collect();
    let label = match errors.iter().any(|error| error.is_finite()) && differing.is_empty() {
        true => "uncertainty = true error",
        false => "uncertainty of the time",
    };
    curves.push(Curve::line(label, BLUE, points).styled(style));
    let differing = differing
        .into_iter()
        .map(|(k, error)| (k, error.max(LEAST_ERROR)))
        .collect();
    curves.push(Curve::open("true error, by the exact solver", VERMILLION, differing));
    curves.push(Curve::line(BELOW_LEAST_ERROR, BLUE, below).styled(CurveStyle::Marks(TIP_DOWN)));
    let unconverged = (0..uncertainty.len()).filter(|&k| !uncertainty[k].is_finite());
    let unconverged = unconverged.map(|k| (k as f64, 2.0 * LEAST_ERROR)).collect();
    curves.push(Curve::open("not converged", ORANGE, unconverged));
    let last = run.events.len().max(2) as f64;
    let x = || Axis::new("event, from 0", "1").ranging(-1.0, last);
    let mut panels = vec![Panel::new(
        x(),
        Axis::new("uncertainty", "s").by_powers(),
        drawn(curves),
    )];
    // Growth of deviations from the loss of stability on. It explains the uncertainties.
    let growth = column(&group, "growth").unwrap_or_default().iter().enumerate();
    let growth: Vec<(f64, f64)> = growth
        .filter(|(_, folds)| folds.is_finite())
        .map(|(k, folds)| (k as f64, *folds))
        .collect();
    if growth.iter().any(|point| point.1 != 0.0) {
        let folds = Axis::new("growth, e-folds", "1");
        let growth = Curve::line("", BLACK, growth).styled(CurveStyle::Dots);
        panels.push(Panel::new(x(), folds, vec![growth]));
    }
    let title = format!("{}: {}", entry.title, verdict(&group));
    Ok(Figure::new(entry.name, title, panels))
}

fn verdict(group: &AddedGroup) -> String {
    let attribute = |name: &str| {
        let found = group.attributes.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.to_string())
    };
    match (attribute("verdict_of_all"), attribute("digits")) {
        (Some(verdict), Some(digits)) => format!("{verdict}, {} digits", digits.trim_end_matches(".0")),
        (Some(verdict), None) => verdict,
        _ => "no verdict".to_owned(),
    }
}

type CertifiedPieces = Vec<Vec<(f64, f64)>>;

/// Each channel with its error band during stick-slip and, below it, the width of the band at fixed times.
fn bands(entry: &CatalogueEntry, subject: &Subject) -> Drawn {
    let run = subject.run;
    let Some(group) = run.certificate()? else {
        return Err(WITHOUT.into());
    };
    let (Some(start), Some(end), Some(uncertainty)) = (
        column(&group, "stretch_start"),
        column(&group, "stretch_end"),
        column(&group, "stretch_time_uncertainty"),
    ) else {
        return Err("its certificate has no bands".into());
    };
    let window = match (subject.onset, subject.final_stick) {
        (Some(from), Some(to)) if to > from => {
            let margin = 0.05 * (to - from);
            ((from - margin).max(run.times.0), (to + margin).min(run.times.1))
        }
        _ => run.times,
    };
    let mut panels = Vec::new();
    let mut widths: Vec<(Axis, CertifiedPieces)> = Vec::new();
    for (number, channel) in CHANNELS.iter().enumerate() {
        let Some(band) = column(&group, &format!("band_{channel}")) else {
            continue;
        };
        let rate = column(&group, &format!("rate_{channel}"));
        // Width at a fixed time; NaN if it is unknown.
        let width = |k: usize| {
            let by_phase = band.get(k).copied().unwrap_or(f64::NAN);
            let rate = rate.map_or(0.0, |rate| rate.get(k).copied().unwrap_or(f64::NAN));
            by_phase + rate * uncertainty.get(k).copied().unwrap_or(f64::NAN)
        };
        let stretch_of = |time: f64| start.partition_point(|&from| from <= time).saturating_sub(1);
        let axis = run.axis(channel)?;
        let Some(points) = run.curves(&[*channel], window)?.into_iter().next() else {
            continue;
        };
        let mut pieces: Vec<Vec<(f64, f64, f64)>> = vec![Vec::new()];
        for &(time, value) in &points {
            let half = width(stretch_of(time));
            match pieces.last_mut() {
                Some(piece) if half.is_finite() => piece.push((time, value - half, value + half)),
                _ => pieces.push(Vec::new()),
            }
        }
        pieces.retain(|piece| piece.len() > 1);
        // A stretch without a band leaves a gap.
        let mut steps: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
        for k in (0..start.len().min(end.len())).filter(|&k| end[k] > window.0 && start[k] < window.1) {
            match steps.last_mut() {
                Some(piece) if width(k) > 0.0 => {
                    piece.extend([(start[k].max(window.0), width(k)), (end[k].min(window.1), width(k))]);
                }
                _ => steps.push(Vec::new()),
            }
        }
        steps.retain(|piece| !piece.is_empty());
        let color = line_color(number);
        let mut panel = Panel::new(time_axis(window), axis.clone(), vec![Curve::line("", color, points)]);
        panel.areas = vec![Area::unnamed(SKY, pieces)];
        panels.push(panel);
        widths.push((axis, steps));
    }
    if panels.is_empty() {
        return Err("its certificate has no band of a channel that is drawn here".into());
    }
    for (number, (axis, steps)) in widths.into_iter().enumerate() {
        let width = Axis::new("half-width of the band", &axis.unit).with_symbol(&format!("± {}", axis.short()));
        let steps = Curve::pieces("", line_color(number), steps);
        panels.push(Panel::new(time_axis(window), width.by_powers(), vec![steps]));
    }
    let (title, verdict) = (entry.title, verdict(&group));
    let title = format!("{title}: {verdict}; each curve is drawn with its band");
    Ok(Figure::new(entry.name, title, panels))
}
