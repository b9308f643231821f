//! Figures of a continuation: a quantity along its branches, and special points in the plane of two parameters.
//!
//! | module | contents |
//! |---|---|
//! | [`quantity`] | the quantities of a point |
//! | `lines` | the lines of a branch |
//! | `marks` | the marks of special points |
//! | [`page`] | the interactive page |

pub mod lines;
pub mod marks;
pub mod page;
pub mod quantity;

use super::figure::{Axis, Curve, CurveStyle, Figure, Panel, drawn};
use super::studies::StudyEntry;
use super::studies::data::drawn_axis;
use super::style::{BLACK, BLUE, line_color};
use crate::Error;
use plotters::style::RGBColor;
use quantity::{BranchQuantity, QUANTITIES};
use std::path::Path;
use stickslip_analysis::continuation::{Branch, Special, Stored};
use stickslip_analysis::cycle::CycleStability;

const BRANCHES: &str = "branches";
const SPECIAL_POINTS: &str = "special-points";

/// The kinds of figures.
pub const ENTRIES: [StudyEntry; 2] = [
    StudyEntry {
        name: BRANCHES,
        title: "A quantity along branches, over the number that varies",
        of: "continuation",
        paper_figure: None,
    },
    StudyEntry {
        name: SPECIAL_POINTS,
        title: "Special points in the plane of two numbers",
        of: "continuation in two numbers",
        paper_figure: None,
    },
];

const OF_CYCLES: [&str; 3] = ["amplitude", "relative_velocity", "period"];
const OF_STEADY: [&str; 2] = ["position", "growth_rate"];

/// Kinds of motion: whether it is steady, name, colour.
const KINDS: [(bool, &str, RGBColor); 2] = [(true, "steady sliding", BLACK), (false, "cycles", BLUE)];

/// Stabilities with their line styles.
const STYLES: [(CycleStability, CurveStyle); 3] = [
    (CycleStability::Stable, CurveStyle::Solid),
    (CycleStability::Unstable, CurveStyle::Dashed),
    (CycleStability::Neutral, CurveStyle::Dotted),
];

/// File of a continuation.
#[derive(Debug)]
pub struct Branches<'a> {
    /// The file.
    pub path: &'a Path,
    /// Its contents.
    pub stored: Stored,
}

impl<'a> Branches<'a> {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// The file is of another kind, of a newer version, or damaged.
    pub fn read(path: &'a Path) -> Result<Branches<'a>, Error> {
        Ok(Branches {
            path,
            stored: Stored::read(path)?,
        })
    }

    /// The quantity with this name. The error for an unknown name lists the known ones.
    pub fn quantity(&self, name: &str) -> Result<&'static BranchQuantity, Error> {
        let known: Vec<&str> = self.known().map(|quantity| quantity.name).collect();
        let found = self.known().find(|quantity| quantity.name == name);
        let what = || format!("{}: the study has no quantity", self.path.display());
        found.ok_or_else(|| Error::unknown(what(), name, &known, ""))
    }

    fn known(&self) -> impl Iterator<Item = &'static BranchQuantity> {
        let has = |quantity: &&'static BranchQuantity| {
            let mut points = self
                .stored
                .branches
                .iter()
                .flat_map(|branch| branch.points.iter().map(move |point| (branch, point)));
            points.any(|(branch, point)| (quantity.low)(branch, point).is_finite())
        };
        QUANTITIES.iter().filter(has)
    }

    fn of_interest(&self) -> Vec<&'static BranchQuantity> {
        let cycles = self.stored.branches.iter().any(|branch| !branch.steady);
        let names: &[&str] = if cycles { &OF_CYCLES } else { &OF_STEADY };
        self.known().filter(|quantity| names.contains(&quantity.name)).collect()
    }

    /// Figures of `quantities`. If empty: the most important quantities, and curves of special points.
    ///
    /// # Errors
    /// A quantity is unknown, or there is nothing to draw.
    pub fn figures(&self, quantities: &[String]) -> Result<Vec<Figure>, Error> {
        let chosen = match quantities {
            [] => self.of_interest(),
            names => names.iter().map(|name| self.quantity(name)).collect::<Result<_, _>>()?,
        };
        let mut figures: Vec<Figure> = chosen.into_iter().map(|quantity| self.figure(quantity)).collect();
        if quantities.is_empty() {
            figures.extend(self.plane());
        }
        match figures.is_empty() {
            true => Err(Error::of_file(self.path, "has no points; there is nothing to draw")),
            false => Ok(figures),
        }
    }

    /// Figures of all quantities, and of the curves of special points.
    pub fn all(&self) -> Result<Vec<Figure>, Error> {
        let names: Vec<String> = self.known().map(|quantity| quantity.name.to_owned()).collect();
        let mut figures = self.figures(&names)?;
        if !names.is_empty() {
            figures.extend(self.plane());
        }
        Ok(figures)
    }

    fn number(&self) -> Axis {
        let (name, _, unit) = &self.stored.number;
        drawn_axis(name, unit, "")
    }

    fn title(&self, what: &str) -> String {
        let incomplete = if self.stored.complete { "" } else { " (incomplete)" };
        format!("{}{incomplete}: {what}", self.stored.title)
    }

    /// A quantity along all branches. Stable parts are solid, unstable parts dashed, and others dotted.
    pub fn figure(&self, quantity: &BranchQuantity) -> Figure {
        let stored = &self.stored;
        let mut curves = Vec::new();
        for (steady, what, color) in KINDS {
            for (stability, style) in STYLES {
                let branches = stored.branches.iter().filter(|branch| branch.steady == steady);
                let pieces = branches.flat_map(|branch| {
                    // The extremes of steady sliding coincide. Two dashed lines over each other would look solid.
                    let sides = if steady { 1 } else { usize::MAX };
                    let values = quantity
                        .sides()
                        .take(sides)
                        .flat_map(|of| lines::pieces(branch, stability, of));
                    values.collect::<Vec<_>>()
                });
                let label = format!("{what}, {}", stability.name());
                curves.push(Curve::pieces(&label, color, lines::joined(pieces.collect(), PartialEq::eq)).styled(style));
            }
        }
        for special in Special::ALL {
            let (words, color, shape) = marks::mark(special);
            let points = stored
                .branches
                .iter()
                .flat_map(|branch| places(branch, special, quantity));
            curves.push(Curve::line(words, color, points.collect()).styled(CurveStyle::Marks(shape)));
        }
        let panel = Panel::new(self.number(), quantity.axis(stored), drawn(curves));
        let name = format!("{BRANCHES}-{}", quantity.name);
        Figure::new(name, self.title(quantity.words), vec![panel])
    }

    fn plane_curves(&self) -> Vec<Curve> {
        drawn(Special::ALL.iter().enumerate().map(|(number, special)| {
            let of_kind = self.stored.curves.iter().filter(|curve| curve.0 == *special);
            let pieces = of_kind.map(|curve| curve.1.iter().map(|&[x, y]| (x, y)).collect());
            Curve::pieces(marks::mark(*special).0, line_color(number), pieces.collect())
        }))
    }

    /// Curves of special points, if any.
    pub fn plane(&self) -> Option<Figure> {
        let (name, unit) = self.stored.second.as_ref()?;
        let curves = self.plane_curves();
        if curves.is_empty() {
            return None;
        }
        let panel = Panel::new(self.number(), drawn_axis(name, unit, ""), curves);
        Some(Figure::new(
            SPECIAL_POINTS,
            self.title("special points in two numbers"),
            vec![panel],
        ))
    }
}

fn places(branch: &Branch, special: Special, quantity: &BranchQuantity) -> Vec<(f64, f64)> {
    let own = branch.points.iter().filter(|point| point.special == Some(special));
    let places = own.flat_map(|point| quantity.sides().map(move |of| (point.value, of(branch, point))));
    places.filter(|place| place.1.is_finite()).collect()
}
