//! The interactive page of a continuation: one HTML file that works offline. It plots any quantity; the pointer reads
//! values, and a click shows the command for the point.

use super::Branches;
use super::STYLES;
use super::lines::links;
use super::marks::mark;
use super::quantity::{Quantity, Value};
use crate::plot::PlotError;
use crate::plot::figure::hex;
use crate::plot::html::{self, Codes, Doubles};
use crate::plot::studies::page::{COMMON, STYLE};
use crate::plot::style::line_color;
use crate::plot::target::{self, Product};
use serde::Serialize;
use std::path::Path;
use stickslip_analysis::continuation::{Branch, BranchPoint, Special};
use stickslip_analysis::cycle::CycleStability;

/// Bytes.
const SIZE_LIMIT: usize = 8_000_000;

const TEMPLATE: &str = include_str!("branches.html");
const OWN_STYLE: &str = include_str!("branches.css");
const SCRIPT: &str = include_str!("branches.js");

/// Contents of a written page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct BranchesPage {
    /// Number of points on all branches.
    pub points: usize,
    /// Number of branches.
    pub branches: usize,
    /// Number of quantities per point.
    pub quantities: usize,
    /// Size, bytes.
    pub bytes: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    title: &'a str,
    file: String,
    complete: bool,
    number: Number<'a>,
    /// The second parameter, for curves.
    second: Option<Named<'a>>,
    quantities: Vec<Drawn<'a>>,
    first: usize,
    branches: Vec<OfBranch>,
    stability: Codes,
    links: Codes,
    /// Mark of each point; -1: none.
    special: Codes,
    marks: Vec<Marked>,
    sequences: Vec<&'a str>,
    /// Multipliers or eigenvalues, the same number for each point.
    real: Doubles,
    imaginary: Doubles,
    curves: Vec<OnPlane<'a>>,
    /// The command for steady sliding, without the value of the parameter.
    modes: &'a Option<String>,
}

#[derive(Serialize)]
struct Named<'a> {
    name: &'a str,
    units: &'a str,
}

#[derive(Serialize)]
struct Number<'a> {
    name: &'a str,
    units: &'a str,
    keys: &'a [String],
    values: Doubles,
}

#[derive(Serialize)]
struct Drawn<'a> {
    name: &'static str,
    words: &'static str,
    units: &'a str,
    low: Doubles,
    high: Option<Doubles>,
}

#[derive(Serialize)]
struct OfBranch {
    steady: bool,
    multiple: Option<u32>,
    parent: Option<usize>,
    first: usize,
    points: usize,
    end: &'static str,
}

#[derive(Serialize)]
struct Marked {
    name: &'static str,
    words: &'static str,
    color: String,
    /// Style of its curve in the plane of two parameters.
    line: String,
    corners: Option<&'static [(f64, f64)]>,
    filled: bool,
    cross: bool,
    /// Hopf points are drawn with steady sliding: their cycles have no size.
    steady: bool,
}

#[derive(Serialize)]
struct OnPlane<'a> {
    special: i8,
    points: &'a [[f64; 2]],
}

/// Writes the page to `path`, with `quantities` (empty: all).
///
/// # Errors
/// Unknown quantity, too many points, or an obstacle at `path`: see `target::check`; a full disk.
pub fn write(file: &Branches, quantities: &[String], path: &Path, force: bool) -> Result<BranchesPage, PlotError> {
    target::check(path, Product::Page, &[file.path.to_owned()], force)?;
    let stored = &file.stored;
    let chosen: Vec<&Quantity> = match quantities {
        [] => file.known().collect(),
        names => names.iter().map(|name| file.quantity(name)).collect::<Result<_, _>>()?,
    };
    let all = || points(&stored.branches);
    let count = all().count();
    let width = all().map(|(_, point)| point.spectrum.len()).max().unwrap_or(0);
    let sides: usize = chosen.iter().map(|quantity| quantity.sides().count()).sum();
    // A double takes eleven base64 letters; the page repeats sequences of events.
    let sequences: usize = all().map(|(_, point)| point.sequence.len() + 3).sum();
    if count * (11 * (1 + sides + 2 * width) + 6) + sequences > SIZE_LIMIT {
        return Err(PlotError::Study {
            path: file.path.to_owned(),
            why: format!(
                "{count} points are too many for a page; choose quantities with --quantity NAME, or draw a figure with -o"
            ),
        });
    }
    let column = |of: Value| all().map(|(branch, point)| of(branch, point)).collect::<Doubles>();
    let interest = file.of_interest();
    let first = chosen
        .iter()
        .position(|quantity| interest.iter().any(|one| one.name == quantity.name));
    let (name, keys, units) = &stored.number;
    let spectrum = |part: fn(&(f64, f64)) -> f64| {
        let padded = all().flat_map(|(_, point)| (0..width).map(|k| point.spectrum.get(k).map_or(f64::NAN, part)));
        padded.collect::<Doubles>()
    };
    let document = Document {
        title: &stored.title,
        file: file.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        complete: stored.complete,
        number: Number {
            name,
            units,
            keys,
            values: column(|_, point| point.value),
        },
        second: stored.second.as_ref().map(|(name, units)| Named { name, units }),
        quantities: chosen
            .iter()
            .map(|quantity| Drawn {
                name: quantity.name,
                words: quantity.words,
                units: quantity.unit(stored),
                low: column(quantity.low),
                high: quantity.high.map(column),
            })
            .collect(),
        first: first.unwrap_or(0),
        branches: of_branches(&stored.branches),
        stability: all().map(|(_, point)| code(point.stability)).collect(),
        links: stored.branches.iter().flat_map(links_of).collect(),
        special: all()
            .map(|(_, point)| point.special.map_or(-1, Special::code))
            .collect(),
        marks: Special::ALL.into_iter().enumerate().map(marked).collect(),
        sequences: all().map(|(_, point)| point.sequence.as_str()).collect(),
        real: spectrum(|one| one.0),
        imaginary: spectrum(|one| one.1),
        curves: stored
            .curves
            .iter()
            .map(|(special, points)| OnPlane {
                special: special.code(),
                points,
            })
            .collect(),
        modes: &stored.modes_command,
    };
    let data = html::json(&document)?;
    let page = html::page(
        TEMPLATE,
        document.title,
        &[
            ("style", &format!("{STYLE}{OWN_STYLE}")),
            ("data", &data),
            ("script", &format!("{COMMON}\n{SCRIPT}")),
        ],
    );
    target::write(path, Product::Page, &[page.as_bytes()])?;
    Ok(BranchesPage {
        points: count,
        branches: stored.branches.len(),
        quantities: chosen.len(),
        bytes: page.len() as u64,
    })
}

fn points(branches: &[Branch]) -> impl Iterator<Item = (&Branch, &BranchPoint)> {
    branches
        .iter()
        .flat_map(|branch| branch.points.iter().map(move |point| (branch, point)))
}

fn code(stability: CycleStability) -> i8 {
    STYLES.iter().position(|one| one.0 == stability).unwrap_or(0) as i8
}

/// Codes of a branch's links; -1 for the last point, which has none.
fn links_of(branch: &Branch) -> Vec<i8> {
    let mut codes: Vec<i8> = links(branch).into_iter().map(code).collect();
    codes.resize(branch.points.len(), -1);
    codes
}

fn of_branches(branches: &[Branch]) -> Vec<OfBranch> {
    let mut first = 0;
    let of = |branch: &Branch| {
        let here = first;
        first += branch.points.len();
        OfBranch {
            steady: branch.steady,
            multiple: branch.multiple,
            parent: branch.parent.map(|parent| parent.0),
            first: here,
            points: branch.points.len(),
            end: branch.end.words(),
        }
    };
    branches.iter().map(of).collect()
}

fn marked((number, special): (usize, Special)) -> Marked {
    let (name, color, shape) = mark(special);
    Marked {
        name,
        words: special.words(),
        color: hex(color),
        line: hex(line_color(number)),
        corners: shape.corners(),
        filled: shape.is_filled(),
        cross: shape.is_cross(),
        steady: special == Special::Hopf,
    }
}
