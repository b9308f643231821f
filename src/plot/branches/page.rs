//! The interactive page of a continuation: any quantity along the branches, with the command that computes each point.

use super::quantity::{BranchQuantity, Value};
use super::{Branches, KINDS, STYLES, joined, mark, stretches};
use crate::Error;
use crate::output::{Output, Product};
use crate::plot::figure::{Axis, MarkShape};
use crate::plot::html::{self, Doubles, PageDocument, counted, file_name};
use crate::plot::html::{
    ColumnRole, LETTERS, Overlay, PointColumn, PointCommand, PointLine, PointMark, PointsContent, PointsPage,
    SIZE_LIMIT,
};
use crate::plot::studies::data::drawn_axis;
use crate::plot::studies::refused;
use crate::plot::style;
use std::path::Path;
use stickslip_analysis::continuation::{Branch, BranchPoint, Special};
use stickslip_system::quote::in_shell;

const HINT: &str = "Lines are full where the motion is stable, dashed where it is unstable, dotted where it is neutral. The pointer \
                    reads values. A click chooses a point, and shows its values and the command that computes it. With the figure in \
                    focus, the arrow keys left and right go along a branch, up and down to another one.";

/// Radius of a mark, pixels.
const RADIUS: f64 = 4.5;

/// Writes the page to `path`, with `quantities` (empty: all).
///
/// # Errors
/// Unknown quantity, too many points, or an obstacle at `path`: see [`Output::new`]; a full disk.
pub fn write(file: &Branches, quantities: &[String], path: &Path, force: bool) -> Result<PointsPage, Error> {
    let output = Output::new(path, Product::Page, &[file.path.to_owned()], force)?;
    let stored = &file.stored;
    let chosen: Vec<&BranchQuantity> = match quantities {
        [] => file.known().collect(),
        names => names.iter().map(|name| file.quantity(name)).collect::<Result<_, _>>()?,
    };
    let count = points(file).count();
    let columns = columns(file, &chosen);
    // The page repeats sequences of events.
    let sequences: usize = points(file).map(|(_, point)| point.sequence.len() + 3).sum();
    if count * (LETTERS * (columns.len() + chosen.len()) + 6) + sequences > SIZE_LIMIT {
        return refused(
            file.path,
            format!(
                "{count} points are too many for a page; choose quantities with --quantity NAME, or draw a figure with -o"
            ),
        );
    }
    let interest = file.of_interest();
    let first = chosen
        .iter()
        .find(|quantity| interest.iter().any(|one| one.name == quantity.name));
    let first = first.or(chosen.first()).map(|quantity| quantity.name);
    let place = |name: &str| columns.iter().position(|column| column.name == name);
    let branches = stored.branches.len();
    let page = PageDocument {
        title: stored.title.clone(),
        subtitle: format!(
            "{}: {} of {}{}",
            file_name(file.path),
            counted(count, "point", "points"),
            counted(branches, "branch", "branches"),
            html::changed(&stored.changed)
        ),
        notice: (!stored.complete).then(|| "This continuation is not complete.".to_owned()),
        content: PointsContent {
            count,
            first: [Some(0), first.and_then(place), None],
            lines: drawn_lines(&stored.branches),
            marks: place("special point").map(|column| (column, Special::ALL.into_iter().map(marked).collect())),
            groups: firsts(&stored.branches).collect(),
            overlays: overlay(file).into_iter().collect(),
            commands: commands(file),
            which: Some(points(file).map(|(branch, point)| which(file, branch, point)).collect()),
            hint: HINT,
            columns,
            ..PointsContent::default()
        },
    };
    Ok(PointsPage {
        points: count,
        branches: Some(branches),
        quantities: chosen.len(),
        bytes: page.write(&html::POINTS, &output)?,
    })
}

fn points<'a>(file: &'a Branches) -> impl Iterator<Item = (&'a Branch, &'a BranchPoint)> {
    let branches = file.stored.branches.iter();
    branches.flat_map(|branch| branch.points.iter().map(move |point| (branch, point)))
}

fn firsts(branches: &[Branch]) -> impl Iterator<Item = usize> {
    branches.iter().scan(0, |next, branch| {
        let first = *next;
        *next += branch.points.len();
        Some(first)
    })
}

/// The columns of the points, in the order of the list.
fn columns(file: &Branches, chosen: &[&BranchQuantity]) -> Vec<PointColumn> {
    let stored = &file.stored;
    let column = |of: Value| {
        points(file)
            .map(|(branch, point)| of(branch, point))
            .collect::<Doubles>()
    };
    let parameter = |name: &str, unit: &str, about: &str, values: Doubles| {
        PointColumn::new(ColumnRole::Axis, name, drawn_axis(name, unit, ""), about, values)
    };
    let (name, keys, unit) = &stored.number;
    let mut columns = vec![parameter(name, unit, &keys.join(", "), column(|_, point| point.value))];
    if let Some((name, unit)) = &stored.second {
        columns.push(parameter(name, unit, "", column(|_, _| f64::NAN)));
    }
    columns.push(in_words(file, "what", ColumnRole::Text, |branch, _| {
        match (branch.steady, branch.multiple) {
            (true, _) => "steady sliding".to_owned(),
            (_, Some(multiple)) => format!("cycle of {multiple} periods of the drives"),
            _ => "cycle".to_owned(),
        }
    }));
    columns.push(in_words(file, "stability", ColumnRole::Brief, |_, point| {
        point.stability.name().to_owned()
    }));
    let code = |_: &Branch, point: &BranchPoint| point.special.map_or(f64::NAN, |special| f64::from(special.code()));
    let (special, axis) = ("special point", Axis::new("special point", "1"));
    columns.push(PointColumn {
        words: Special::ALL
            .map(|special| (special.code().into(), special.words().to_owned()))
            .into(),
        ..PointColumn::new(ColumnRole::Brief, special, axis, "", column(code))
    });
    columns.push(in_words(
        file,
        "events of a period",
        ColumnRole::Text,
        |_, point| match point.sequence.as_str() {
            "" => "none".to_owned(),
            sequence => sequence.to_owned(),
        },
    ));
    columns.extend(chosen.iter().map(|quantity| PointColumn {
        label: quantity.words.to_owned(),
        high: quantity.high.map(column),
        ..PointColumn::new(
            ColumnRole::Value,
            quantity.name,
            quantity.axis(stored),
            quantity.name,
            column(quantity.low),
        )
    }));
    columns.extend(spectrum(file));
    columns.push(in_words(file, "this branch", ColumnRole::Text, |branch, _| {
        let born = branch.parent.map(|parent| format!(", born on branch {}", parent.0));
        let (points, end) = (branch.points.len(), branch.end.words());
        format!("{points} points{}; ends: {end}", born.unwrap_or_default())
    }));
    columns
}

/// A column of texts, as codes of the different ones.
fn in_words(
    file: &Branches,
    label: &str,
    role: ColumnRole,
    of: impl Fn(&Branch, &BranchPoint) -> String,
) -> PointColumn {
    let mut words: Vec<(i64, String)> = Vec::new();
    let code = |text: String| {
        let known = words.iter().position(|word| word.1 == text);
        known.unwrap_or_else(|| {
            words.push((words.len() as i64, text));
            words.len() - 1
        }) as f64
    };
    let codes = points(file)
        .map(|(branch, point)| of(branch, point))
        .map(code)
        .collect();
    PointColumn {
        words,
        ..PointColumn::new(role, label, Axis::new(label, "1"), "", codes)
    }
}

/// Eigenvalues of steady sliding, multipliers of cycles.
fn spectrum(file: &Branches) -> Vec<PointColumn> {
    let mut columns = Vec::new();
    for (steady, name, unit) in [(true, "eigenvalue", "s-1"), (false, "multiplier", "1")] {
        let own = || points(file).map(|(branch, point)| (branch.steady == steady).then_some(&point.spectrum));
        let width = own().flatten().map(Vec::len).max().unwrap_or(0);
        for k in 0..width {
            let part = |of: fn(&(f64, f64)) -> f64| {
                let values = own().map(|spectrum| spectrum.and_then(|values| values.get(k)).map_or(f64::NAN, of));
                values.collect::<Doubles>()
            };
            let label = format!("{name} {}", k + 1);
            columns.push(PointColumn {
                imaginary: Some(part(|one| one.1)),
                ..PointColumn::new(ColumnRole::Text, &label, Axis::new(&label, unit), "", part(|one| one.0))
            });
        }
    }
    columns
}

fn drawn_lines(branches: &[Branch]) -> Vec<PointLine> {
    let mut lines = Vec::new();
    for (steady, what, color) in KINDS {
        for (stability, curve_style) in STYLES {
            let mut pieces = Vec::new();
            for (branch, first) in branches.iter().zip(firsts(branches)) {
                if branch.steady == steady {
                    let place = |k: usize| (first + k, (branch.points[k].value, branch.points[k].position));
                    let own = stretches(branch, stability).into_iter();
                    pieces.extend(own.map(|stretch| stretch.map(place).collect::<Vec<_>>()));
                }
            }
            let pieces = joined(pieces, |a, b| a.1 == b.1);
            lines.push(PointLine {
                label: format!("{what}, {}", stability.name()),
                color: style::name(color),
                style: curve_style.name(),
                pieces: pieces
                    .into_iter()
                    .map(|piece| piece.into_iter().map(|point| point.0).collect())
                    .collect(),
                once: steady,
            });
        }
    }
    lines.retain(|line| !line.pieces.is_empty());
    lines
}

fn marked(special: Special) -> PointMark {
    let (name, color, shape) = mark(special);
    PointMark {
        name,
        colour: style::name(color),
        path: outline(shape),
        filled: shape.filled,
    }
}

fn outline(shape: MarkShape) -> String {
    let corners = shape.corners(RADIUS);
    if corners.len() == 0 {
        let r = RADIUS;
        return format!("M-{r} 0A{r} {r} 0 1 0 {r} 0A{r} {r} 0 1 0-{r} 0Z");
    }
    let mut path = String::new();
    for (k, (x, y)) in corners.enumerate() {
        let begins = k == 0 || shape.cross && k % 2 == 0;
        path += &format!("{}{x:.2} {y:.2}", if begins { 'M' } else { 'L' });
    }
    if shape.cross { path } else { path + "Z" }
}

fn overlay(file: &Branches) -> Option<Overlay> {
    let (name, _) = file.stored.second.as_ref()?;
    Some(Overlay {
        x: file.stored.number.0.clone(),
        y: name.clone(),
        curves: file.plane_curves(),
        labels: Vec::new(),
        region: false,
    })
    .filter(|overlay| !overlay.curves.is_empty())
}

/// The command of a point. Cycles have no size where they are born: such a point is one of steady sliding.
fn which(file: &Branches, branch: &Branch, point: &BranchPoint) -> i8 {
    match branch.steady || point.special == Some(Special::Hopf) {
        false => 0,
        true if file.stored.modes_command.is_some() => 1,
        true => -1,
    }
}

fn commands(file: &Branches) -> Vec<PointCommand> {
    let cycle = PointCommand {
        start: format!("stickslip cycle {}", in_shell(&file_name(file.path))),
        options: vec![
            ("--branch {group}".to_owned(), None),
            ("--point {point}".to_owned(), None),
        ],
        hint: "Finds the cycle from this point, and stores one period of it. Run the command in the folder of the file.",
    };
    let keys = file.stored.number.1.iter();
    let steady = file.stored.modes_command.as_ref().map(|start| PointCommand {
        start: start.clone(),
        options: keys.map(|key| (format!("--set {key}={{0}}"), None)).collect(),
        hint: "Describes steady sliding there. A case in a file is named as the study names it: run the command in the study's \
               folder.",
    });
    std::iter::once(cycle).chain(steady).collect()
}
