//! The critical curve: boundaries of a sweep in their plane, with the stability limit and contours of G (Fig. 25).

use super::figure::{Curve, CurveStyle, Figure, Panel, drawn, extent};
use super::scale::superscript;
use super::studies::data::{drawn_axis, levels, plainly, short};
use super::style::{BLACK, GREY, PALETTE};
use crate::Error;
use stickslip_case::{Case, CaseSource};
use stickslip_files::schema::{INPUT_CASE, Variable};
use stickslip_files::{Reason, ResultError, StudyFile};
use stickslip_system::model::system::System;

/// The figure of a sweep file that contains boundaries.
///
/// # Errors
/// The file contains no boundary, or is unreadable.
pub fn figure(file: &StudyFile) -> Result<Figure, Error> {
    let none = || Reason::NoBoundary(file.path().to_owned()).of(file.path());
    let (x, y, panel) = panel(file)?.ok_or_else(none)?;
    let is_the_papers = x == "friction_decay" && y == "torsion_damping";
    let title = match file.text("boundary/criterion")? {
        Some(criterion) if !is_the_papers => format!("Where {criterion} ends"),
        _ => "Critical curve: where stick-slip ends".to_owned(),
    };
    Ok(Figure {
        paper_figure: (is_the_papers && of_the_papers_case(file)).then_some(25),
        ..Figure::new("critical-curve", title, vec![panel])
    })
}

/// The variables of both axes, and the panel; `None` for a file without boundaries.
pub(super) fn panel(file: &StudyFile) -> Result<Option<(String, String, Panel)>, Error> {
    let Some(Boundary { x, y, curves: traced }) = boundary(file)? else {
        return Ok(None);
    };
    let contours = lines(file, "growth_contours", "line", &x, &y)?;
    // A file contains one of these: the first if sliding slows down by itself.
    let stable = lines(file, "linear_limit", "line", &x, &y)?;
    let steady = lines(file, "stability_limit", "line", &x, &y)?;
    let pieces = |lines: &[CriticalLine]| lines.iter().map(|line| line.points.clone()).collect();
    let mut curves = drawn([
        Curve::pieces("growth exponent G", GREY, pieces(&contours)).styled(CurveStyle::Thin),
        Curve::pieces("stable at every speed", BLACK, pieces(&stable)).styled(CurveStyle::Dashed),
        Curve::pieces("steady sliding loses its stability", BLACK, pieces(&steady)).styled(CurveStyle::Dashed),
    ]);
    curves.extend(traced);
    let text = |name: String| file.text(&format!("boundary/{name}"));
    let by_powers = |side: &str| Ok::<_, ResultError>(text(format!("{side}_spacing"))?.as_deref() == Some("log"));
    let by_powers = (by_powers("x")?, by_powers("y")?);
    let labels = contour_labels(&contours, &curves, by_powers);
    let axis = |name: &str, by_powers: bool| {
        let units = text(format!("{name}/units"))?;
        Ok::<_, ResultError>(drawn_axis(name, units.as_deref().unwrap_or("1"), "").logarithmic(by_powers))
    };
    let panel = Panel {
        labels,
        ..Panel::new(axis(&x, by_powers.0)?, axis(&y, by_powers.1)?, curves)
    };
    Ok(Some((x, y, panel)))
}

pub(super) struct Boundary {
    /// Variable of the horizontal axis.
    pub x: String,
    /// Variable of the vertical axis.
    pub y: String,
    /// A curve for each plane, named by the axes outside the plane.
    pub curves: Vec<Curve>,
}

pub(super) fn boundary(file: &StudyFile) -> Result<Option<Boundary>, Error> {
    let (Some(x), Some(y)) = (file.text("boundary/x")?, file.text("boundary/y")?) else {
        return Ok(None);
    };
    let known = ["boundary_point", "curve", "plane", "branch"];
    let mut outside = Vec::new();
    for (Variable { name, units, .. }, _, values) in file.columns("boundary")? {
        if !known.contains(&name.as_str()) && !name.starts_with(&x) && !name.starts_with(&y) {
            outside.push((short(&name).to_owned(), units, values));
        }
    }
    let criterion = file.text("boundary/criterion")?.unwrap_or_default();
    let mut curves: Vec<Curve> = Vec::new();
    for line in lines(file, "boundary", "curve", &x, &y)? {
        let said = |(name, units, values): &(String, String, Vec<f64>)| {
            format!("{name} = {} {units}", written(values[line.first]))
        };
        let label = match &outside[..] {
            [] => criterion.clone(),
            _ => outside.iter().map(said).collect::<Vec<_>>().join(", "),
        };
        // One legend entry for each plane.
        match curves.iter_mut().find(|curve| curve.label == label) {
            Some(curve) => curve.pieces.push(line.points),
            None => curves.push(Curve::line(&label, PALETTE[line.plane % PALETTE.len()], line.points)),
        }
    }
    Ok(Some(Boundary { x, y, curves }))
}

/// Whether the base case is the paper's. The kick may differ, because the study sets it.
fn of_the_papers_case(file: &StudyFile) -> bool {
    let system = |source| Case::read(&source, &[]).ok().map(|case| case.system);
    let base = file.input(INPUT_CASE).ok().flatten();
    let base = base.map(|text| CaseSource::result(file.path(), text));
    let papers = CaseSource::built_in("paper").ok().and_then(system);
    base.and_then(system).zip(papers).is_some_and(|(base, papers)| {
        let kicks = base.kicks.clone();
        base == System { kicks, ..papers }
    })
}

/// Width and height of a contour's label, where a panel is 2 wide and 1 high.
const LABEL: (f64, f64) = (0.13, 0.09);
/// Number of places along a contour that are tried, less one.
const PLACES: usize = 40;
/// One of this many points of a contour is compared with a label.
const STEP: usize = 4;

/// A label for each contour, on its longest line, one after the other along the lines, so that they are in order, with
/// the most room to other lines, labels and the edges.
fn contour_labels(contours: &[CriticalLine], curves: &[Curve], by_powers: (bool, bool)) -> Vec<((f64, f64), String)> {
    let place = |(x, y): (f64, f64)| {
        let of = |value: f64, by_powers: bool| if by_powers { value.log10() } else { value };
        (of(x, by_powers.0), of(y, by_powers.1))
    };
    let all: Vec<(f64, f64)> = curves.iter().flat_map(Curve::points).map(place).collect();
    let range = |of: fn(&(f64, f64)) -> f64| {
        let (low, high) = extent(all.iter().map(of)).unwrap_or((0.0, 0.0));
        (low, (high - low).max(f64::MIN_POSITIVE))
    };
    let (x, y) = (range(|point| point.0), range(|point| point.1));
    // In units of the panel, which is twice as wide as high.
    let scaled = |point: (f64, f64)| {
        let (a, b) = place(point);
        (2.0 * (a - x.0) / x.1, (b - y.0) / y.1)
    };
    let mut longest: Vec<(f64, Vec<(f64, f64)>)> = Vec::new();
    for level in levels(contours.iter().map(|contour| contour.level)) {
        let of_level = contours.iter().filter(|contour| contour.level == level);
        let Some(line) = of_level.max_by_key(|contour| contour.points.len()) else {
            continue;
        };
        // All lines begin at the same side.
        let mut points = line.points.clone();
        if let [first, .., last] = points[..]
            && last < first
        {
            points.reverse();
        }
        longest.push((level, points));
    }
    // In sizes of a label from its middle.
    let apart = |a: (f64, f64), b: (f64, f64)| ((a.0 - b.0).abs() / LABEL.0).max((a.1 - b.1).abs() / LABEL.1);
    let of_contour = |point: &(f64, f64)| contours.iter().any(|contour| contour.points.contains(point));
    let points = curves.iter().flat_map(Curve::points).filter(|point| !of_contour(point));
    let others: Vec<(f64, f64)> = points.map(scaled).collect();
    // How much a distance is below enough.
    let lack = |distance: f64| (1.0 - distance.min(1.0)).powi(2);
    let at = |k: usize, place: usize| {
        let points = &longest[k].1;
        points[place * (points.len() - 1) / PLACES]
    };
    // Labels keep clear of other lines and the edges and, less strictly, of the other contours.
    let alone = |k: usize, place: usize| -> f64 {
        let own = scaled(at(k, place));
        let to_edges = (own.0.min(2.0 - own.0) / LABEL.0).min(own.1.min(1.0 - own.1) / LABEL.1);
        let to_lines = others.iter().map(|other| apart(*other, own)).fold(1.0, f64::min);
        let siblings = longest.iter().enumerate().filter(|(other, _)| *other != k);
        let siblings = siblings.flat_map(|(_, (_, points))| points.iter().step_by(STEP));
        let to_siblings = siblings.map(|point| apart(scaled(*point), own)).fold(1.0, f64::min);
        4.0 * lack(2.0 * to_edges) + 4.0 * lack(1.4 * to_lines) + 0.3 * lack(to_siblings)
    };
    // The best places of labels 0 to k, one after the other along the lines, for each place of the last one.
    let ordered = |rising: bool| -> (f64, Vec<usize>) {
        let mut best: Vec<(f64, Vec<usize>)> = vec![(0.0, Vec::new()); PLACES + 1];
        for k in 0..longest.len() {
            let next = |place: usize| {
                let before = best.iter().filter_map(|(cost, places)| {
                    let Some(&last) = places.last() else {
                        return Some((*cost, places));
                    };
                    let in_order = if rising { last <= place } else { last >= place };
                    let to_last = apart(scaled(at(k - 1, last)), scaled(at(k, place)));
                    in_order.then(|| (cost + 4.0 * lack(to_last), places))
                });
                let (cost, places) = before.min_by(|a, b| a.0.total_cmp(&b.0))?;
                let places = places.iter().copied().chain([place]).collect();
                Some((cost + alone(k, place), places))
            };
            best = (0..=PLACES).filter_map(next).collect();
        }
        let least = best.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        least.unwrap_or_default()
    };
    let (falling, rising) = (ordered(false), ordered(true));
    let (_, places) = if rising.0 < falling.0 { rising } else { falling };
    let labels = places.into_iter().enumerate();
    labels
        .map(|(k, place)| (at(k, place), longest[k].0.to_string()))
        .collect()
}

/// A number, with a power of ten in typographic form below 10⁻³.
fn written(value: f64) -> String {
    let text = plainly(value);
    let Some((digits, power)) = text.split_once('e') else {
        return text;
    };
    let power = format!("10{}", superscript(power.parse().unwrap_or(0)));
    match digits {
        "1" => power,
        digits => format!("{digits}·{power}"),
    }
}

struct CriticalLine {
    first: usize,
    plane: usize,
    level: f64,
    points: Vec<(f64, f64)>,
}

fn lines(file: &StudyFile, group: &str, by: &str, x: &str, y: &str) -> Result<Vec<CriticalLine>, ResultError> {
    let names = file.names(group)?;
    if names.is_empty() {
        return Ok(Vec::new());
    }
    let column = |name: &str| file.numbers(&format!("{group}/{name}"));
    let (which, plane, x, y) = (column(by)?, column("plane")?, column(x)?, column(y)?);
    let level = match names.iter().any(|name| name == "level") {
        true => column("level")?,
        false => vec![0.0; x.len()],
    };
    let mut lines: Vec<CriticalLine> = Vec::new();
    for row in 0..x.len() {
        if row == 0 || which[row] != which[row - 1] {
            lines.push(CriticalLine {
                first: row,
                plane: plane[row] as usize,
                level: level[row],
                points: Vec::new(),
            });
        }
        if let Some(line) = lines.last_mut() {
            line.points.push((x[row], y[row]));
        }
    }
    Ok(lines)
}
