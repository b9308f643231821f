//! Figures of a continuation: a quantity along its branches, and special points in the plane of two parameters. `quantity`: the
//! quantities of a point. `page`: the interactive page.

use super::figure::{Axis, Curve, CurveStyle, Figure, MarkShape, Panel, TIP_DOWN, drawn};
use super::studies::data::{drawn_axis, unknown};
use super::studies::{StudyColumn, StudyData, StudyEntry, entry, refused, title};
use super::style::{BLACK, BLUE, ORANGE, RGBColor, VERMILLION, line_color};
use crate::Error;
use quantity::{BranchQuantity, QUANTITIES, Value};
use std::ops::RangeInclusive;
use std::path::Path;
use stickslip_analysis::continuation::{Branch, BranchPoint, Special, Stored};
use stickslip_analysis::cycle::{Border, CycleStability};
use stickslip_files::StudyFile;

pub mod page;
pub mod quantity;

const BRANCHES: &str = "branches";
const SPECIAL_POINTS: &str = "special-points";

/// The kinds of figures.
pub const ENTRIES: [StudyEntry; 2] = [
    entry(
        BRANCHES,
        "A quantity along branches, over the number that varies",
        "continuation",
    ),
    entry(
        SPECIAL_POINTS,
        "Special points in the plane of two numbers",
        "continuation in two numbers",
    ),
];

const OF_CYCLES: [&str; 3] = ["amplitude", "relative_velocity", "period"];
const OF_STEADY: [&str; 2] = ["position", "growth_rate"];

/// Kinds of motion: whether it is steady, name, colour.
const KINDS: [(bool, &str, RGBColor); 2] = [(true, "steady sliding", BLACK), (false, "cycles", BLUE)];

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
    /// Runs of a sweep over the same parameter.
    runs: Option<SweptRuns>,
}

/// Runs of a sweep over the parameter of the branches.
#[derive(Debug)]
struct SweptRuns {
    label: String,
    data: StudyData,
    axis: usize,
}

impl SweptRuns {
    /// Values of the runs' motions where they repeat themselves, with those of the parameter; none for a quantity that
    /// sweeps do not have.
    fn points(&self, quantity: &BranchQuantity) -> Vec<(f64, f64)> {
        let numbers = &self.data.axes[self.axis].values;
        let columns = quantity.of_runs.iter().filter_map(|name| self.data.quantity(name).ok());
        let points = columns.flat_map(|column| numbers.iter().copied().zip(column.values.iter().copied()));
        points.filter(|point| point.1.is_finite()).collect()
    }
}

/// Number of a sweep's runs whose motion does not repeat itself. They have no values to draw.
fn aperiodic(data: &StudyData) -> usize {
    let Ok(motion) = data.quantity("motion") else {
        return 0;
    };
    let code = motion.flags.iter().find(|(_, word)| word == "not-periodic");
    let Some(code) = code.map(|(code, _)| *code as f64) else {
        return 0;
    };
    motion.values.iter().filter(|value| **value == code).count()
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
            runs: None,
        })
    }

    /// With the motions of a sweep's runs, drawn as dots below the branches.
    ///
    /// # Errors
    /// The sweep is unreadable, or has no axis with the parameter of the branches.
    pub fn with_runs(self, sweep: &StudyFile) -> Result<Branches<'a>, Error> {
        let data = StudyData::read(sweep)?;
        let (_, keys, _) = &self.stored.number;
        let is_it = |axis: &StudyColumn| axis.keys.iter().any(|key| keys.contains(key));
        let Some(axis) = data.axes.iter().position(is_it) else {
            let known: Vec<&str> = data.axes.iter().map(|axis| axis.keys[0].as_str()).collect();
            let (keys, known, path) = (keys.join(", "), known.join(", "), self.path.display());
            return refused(
                &data.path,
                format!("has no axis {keys}, over which the branches of {path} lie; it has {known}"),
            );
        };
        let stem = data.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let label = match aperiodic(&data) {
            0 => format!("runs of {stem}"),
            count => format!("runs of {stem} (without {count} that do not repeat themselves)"),
        };
        let runs = Some(SweptRuns { label, data, axis });
        Ok(Branches { runs, ..self })
    }

    /// The quantity with this name. The error for an unknown name lists the known ones.
    pub fn quantity(&self, name: &str) -> Result<&'static BranchQuantity, Error> {
        let known: Vec<&str> = self.known().map(|quantity| quantity.name).collect();
        let found = self.known().find(|quantity| quantity.name == name);
        found.ok_or_else(|| unknown(self.path, "quantity", name, &known))
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
            true => refused(self.path, "has no points; there is nothing to draw"),
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
        title((&self.stored.title, self.stored.complete), what)
    }

    /// A quantity along all branches. Stable parts are solid, unstable parts dashed, and others dotted.
    pub fn figure(&self, quantity: &BranchQuantity) -> Figure {
        let stored = &self.stored;
        let mut curves = Vec::new();
        if let Some(runs) = &self.runs {
            curves.push(Curve::filled(&runs.label, ORANGE, runs.points(quantity)));
        }
        for (steady, what, color) in KINDS {
            for (stability, style) in STYLES {
                let branches = stored.branches.iter().filter(|branch| branch.steady == steady);
                let pieces = branches.flat_map(|branch| {
                    // The extremes of steady sliding coincide. Two dashed lines over each other would look solid.
                    let sides = if steady { 1 } else { usize::MAX };
                    let values = quantity
                        .sides()
                        .take(sides)
                        .flat_map(|of| pieces(branch, stability, of));
                    values.collect::<Vec<_>>()
                });
                let label = format!("{what}, {}", stability.name());
                curves.push(Curve::pieces(&label, color, joined(pieces.collect(), PartialEq::eq)).styled(style));
            }
        }
        for special in Special::ALL {
            let (words, color, shape) = mark(special);
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
            Curve::pieces(mark(*special).0, line_color(number), pieces.collect())
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
        let title = self.title("special points in two numbers");
        Some(Figure::new(SPECIAL_POINTS, title, vec![panel]))
    }
}

fn places(branch: &Branch, special: Special, quantity: &BranchQuantity) -> Vec<(f64, f64)> {
    let own = branch.points.iter().filter(|point| point.special == Some(special));
    let places = own.flat_map(|point| quantity.sides().map(move |of| (point.value, of(branch, point))));
    places.filter(|place| place.1.is_finite()).collect()
}

/// Stability between successive points. It changes at special points: a link has that of its ordinary end.
pub fn links(branch: &Branch) -> Vec<CycleStability> {
    let marks_a_change = |point: &BranchPoint| point.special.is_some() || point.stability == CycleStability::Neutral;
    let between = |pair: &[BranchPoint]| match (marks_a_change(&pair[0]), marks_a_change(&pair[1])) {
        (false, _) => pair[0].stability,
        (true, false) => pair[1].stability,
        (true, true) if pair[0].stability == pair[1].stability => pair[0].stability,
        (true, true) => CycleStability::Neutral,
    };
    branch.points.windows(2).map(between).collect()
}

/// Numbers of successive points of a branch with this stability between them.
fn stretches(branch: &Branch, stability: CycleStability) -> Vec<RangeInclusive<usize>> {
    let (mut stretches, mut from) = (Vec::new(), 0);
    for alike in links(branch).chunk_by(PartialEq::eq) {
        if alike[0] == stability {
            stretches.push(from..=from + alike.len());
        }
        from += alike.len();
    }
    stretches
}

/// Pieces of a branch with this stability, as points (parameter, value).
pub fn pieces(branch: &Branch, stability: CycleStability, of: Value) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    for stretch in stretches(branch, stability) {
        let points = branch.points[stretch]
            .iter()
            .map(|point| (point.value, of(branch, point)));
        let points: Vec<(f64, f64)> = points.collect();
        let known = points
            .split(|point| !point.1.is_finite())
            .filter(|piece| piece.len() > 1);
        pieces.extend(known.map(<[_]>::to_vec));
    }
    pieces
}

/// Joins pieces that start in one point (both directions of a branch), so that dashes are regular there. `same`: whether
/// two points have one place.
pub fn joined<T>(pieces: Vec<Vec<T>>, same: impl Fn(&T, &T) -> bool) -> Vec<Vec<T>> {
    let mut found: Vec<Vec<T>> = Vec::new();
    for piece in pieces {
        let begins = |other: &&mut Vec<T>| match (other.first(), piece.first()) {
            (Some(a), Some(b)) => same(a, b),
            _ => false,
        };
        match found.iter_mut().find(begins) {
            Some(other) => {
                other.reverse();
                other.extend(piece.into_iter().skip(1));
            }
            None => found.push(piece),
        }
    }
    found
}

const CIRCLE: MarkShape = MarkShape::open(&[]);
const SQUARE: MarkShape = MarkShape::open(&[(-9, -9), (9, -9), (9, 9), (-9, 9)]);
const TIP_UP: MarkShape = MarkShape::open(&[(0, -12), (11, 8), (-11, 8)]);
const TIP_LEFT: MarkShape = MarkShape::open(&[(-8, -11), (12, 0), (-8, 11)]);
const DIAMOND: MarkShape = MarkShape::open(&[(0, -13), (13, 0), (0, 13), (-13, 0)]);
const HEXAGON: MarkShape = MarkShape::open(&[(-6, -10), (6, -10), (12, 0), (6, 10), (-6, 10), (-12, 0)]);
const DIAGONAL: MarkShape = MarkShape::open(&[(-10, -10), (10, 10), (-10, 10), (10, -10)]).crossed();
const PLUS: MarkShape = MarkShape::open(&[(-13, 0), (13, 0), (0, -13), (0, 13)]).crossed();

/// Legend name, colour and shape for a kind of special point: filled for eigenvalues or multipliers, open for changes of
/// the event sequence.
pub fn mark(special: Special) -> (&'static str, RGBColor, MarkShape) {
    let border = |words, shape| (words, VERMILLION, shape);
    match special {
        Special::Hopf => ("Hopf", BLACK, CIRCLE.filled()),
        Special::Fold => ("fold", BLACK, SQUARE.filled()),
        Special::Flip => ("flip", BLACK, TIP_UP.filled()),
        Special::Torus => ("torus", BLACK, DIAMOND.filled()),
        Special::BranchPoint => ("branch point", BLACK, DIAGONAL),
        Special::Border(Border::Touch | Border::Graze) => border("grazing of a slip", CIRCLE),
        Special::Border(Border::Breakaway | Border::Release) => border("grazing of a stick", SQUARE),
        Special::Border(Border::Landing) => border("stick without length", TIP_UP),
        Special::Border(Border::Reversal) => border("reversal sticks", TIP_DOWN),
        Special::Border(Border::Opening) => border("loss of contact", DIAMOND),
        Special::Border(Border::Closing) => border("contact closes within", PLUS),
        Special::Border(Border::Slip) => border("slip without length", TIP_LEFT),
        Special::Border(Border::Separation) => border("separation without length", HEXAGON),
    }
}
