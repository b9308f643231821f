//! A sweep file as figures need it: axes, points and quantities.

use crate::plot::PlotError;
use crate::plot::error::hint;
use crate::plot::figure::{Axis, Cell, extent};
use crate::plot::html::as_doubles;
use crate::results::schema::{META_POINT_COMMAND, META_SHOW, group};
use crate::results::{Reason, SweepFile};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Symbols of the keys that the paper's figure has.
const SYMBOLS: [(&str, &str, &str); 3] = [
    ("friction_decay", "friction decay", "α"),
    ("torsion_damping", "torsional damping", "c_t"),
    ("perturbation_0_relative_velocity", "kick", "δ"),
];

/// A symbol is no longer than this: what stands before the comma of a description.
const LONGEST_SYMBOL: usize = 8;

/// Quantities that say how a run was computed, or what follows from its case alone.
const NO_RESULTS: [&str; 12] = [
    "energy_residual",
    "steps",
    "rhs_evaluations",
    "jacobian_evaluations",
    "attractor_agreement",
    "attractor_distance",
    "attractor_since",
    "noise_determined",
    "kicks_never_given",
    "natural_period",
    "stick_threshold",
    "end_time",
];

/// Values that differ by less than this share of the largest are the same.
const SAME: f64 = 1e-6;

/// Codes of the status of a point.
const COMPLETE: f64 = 0.0;
const FAILED: f64 = 1.0;

/// The axis of a drawing for a variable of the file, named by its words and the symbol with which its description begins.
pub(in crate::plot) fn drawn_axis(name: &str, units: &str, long_name: &str) -> Axis {
    if let Some((_, words, symbol)) = SYMBOLS.iter().find(|known| known.0 == name) {
        return Axis::new(words, units).with_symbol(symbol);
    }
    let axis = Axis::new(&name.replace('_', " "), units);
    match long_name.split_once(", ") {
        Some((symbol, _)) if symbol.len() <= LONGEST_SYMBOL && !symbol.contains(' ') => {
            axis.with_symbol(&greek(symbol))
        }
        _ => axis,
    }
}

/// The letter for its name; other symbols as they are.
fn greek(symbol: &str) -> String {
    let letters = [
        ("alpha", "α"),
        ("delta", "δ"),
        ("mu", "μ"),
        ("omega", "ω"),
        ("theta", "θ"),
        ("phi", "φ"),
    ];
    for (name, letter) in letters {
        if symbol == name || symbol.strip_prefix(name).is_some_and(|rest| rest.starts_with('_')) {
            return symbol.replacen(name, letter, 1);
        }
    }
    symbol.to_owned()
}

/// The short name of an axis in words: its symbol, or its name.
pub(in crate::plot) fn short(name: &str) -> &str {
    SYMBOLS
        .iter()
        .find(|known| known.0 == name)
        .map_or(name, |known| known.2)
}

/// What a study varies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudyAxis {
    /// Of its variable.
    pub name: String,
    /// The paths of the keys that it sets.
    pub keys: Vec<String>,
    /// UDUNITS.
    pub units: String,
    /// What it is.
    pub long_name: String,
    /// Where its values are codes of words: these, by code.
    pub words: Vec<String>,
    /// Whether its values are numbers that are even in the logarithm.
    pub logarithmic: bool,
    /// Of a grid: its levels in the order of the file.
    #[serde(skip)]
    pub levels: Vec<f64>,
    /// Of every point.
    #[serde(serialize_with = "as_doubles")]
    pub values: Vec<f64>,
}

impl StudyAxis {
    /// Whether the points differ in it.
    pub fn varies(&self) -> bool {
        self.values.iter().any(|value| *value != self.values[0])
    }

    /// As it is drawn.
    pub(super) fn axis(&self) -> Axis {
        let axis = drawn_axis(&self.name, &self.units, &self.long_name);
        if self.words.is_empty() {
            return axis.logarithmic(self.logarithmic);
        }
        let words = self.words.iter().enumerate();
        let words: Vec<String> = words.map(|(code, word)| format!("{code} {word}")).collect();
        Axis::new(&format!("{}: {}", axis.name, words.join(", ")), "1")
    }

    /// A value of it in words: "c_t = 22.6 N m s/rad", "solver method = erk".
    pub(super) fn said(&self, value: f64) -> String {
        let axis = drawn_axis(&self.name, &self.units, &self.long_name);
        match self.words.get(value as usize) {
            Some(word) => format!("{} = {word}", axis.short()),
            None if self.units == "1" => format!("{} = {}", axis.short(), plainly(value)),
            None => format!("{} = {} {}", axis.short(), plainly(value), self.units),
        }
    }

    /// Whether its values are numbers that are even in the logarithm, over one and a half decades or more: an axis of powers shows two.
    /// Of an axis of a traced boundary whether it was looked for by the logarithm is known.
    fn is_logarithmic(&self, traced: Option<bool>) -> bool {
        let (low, high) = extent(self.values.iter().copied()).unwrap_or((0.0, 1.0));
        if !self.words.is_empty() || low <= 0.0 {
            return false;
        }
        if let Some(traced) = traced {
            return traced;
        }
        if high < 30.0 * low {
            return false;
        }
        if self.levels.len() < 3 {
            // A sample: half of it below the geometric mean, and not the arithmetic.
            let below = |limit: f64| self.values.iter().filter(|value| **value < limit).count() as f64;
            let half = 0.5 * self.values.len() as f64;
            return (below((low * high).sqrt()) - half).abs() < (below(0.5 * (low + high)) - half).abs();
        }
        let ratio = self.levels[1] / self.levels[0];
        let mut pairs = self.levels.windows(2);
        pairs.all(|pair| (pair[1] / pair[0] / ratio - 1.0).abs() < 1e-6)
    }
}

/// What is known of every run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StudyQuantity {
    /// Of its variable.
    pub name: String,
    /// UDUNITS.
    pub units: String,
    /// What it is.
    pub long_name: String,
    /// Of a code: its values and what they mean.
    pub flags: Vec<(i64, String)>,
    /// Whether it is a whole number.
    pub whole: bool,
    /// Of every point; NaN where it has none.
    #[serde(serialize_with = "as_doubles")]
    pub values: Vec<f64>,
}

impl StudyQuantity {
    /// As it is drawn.
    pub(super) fn axis(&self) -> Axis {
        drawn_axis(&self.name, &self.units, &self.long_name)
    }

    /// Whether a point has it.
    pub(super) fn is_known(&self) -> bool {
        self.values.iter().any(|value| !value.is_nan())
    }

    /// Whether it differs from point to point.
    pub(super) fn varies(&self) -> bool {
        let mut numbers = self.values.iter().filter(|value| !value.is_nan());
        let first = numbers.next();
        numbers.any(|value| Some(value) != first)
    }

    /// How many different values it has.
    fn different_values(&self) -> usize {
        let mut values: Vec<f64> = self.values.iter().copied().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let largest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        values.dedup_by(|next, before| *next - *before <= SAME * largest);
        values.len()
    }
}

/// A sweep file, in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyData {
    /// Where it is.
    pub path: PathBuf,
    /// Of the study.
    pub title: String,
    /// Whether all its points are there.
    pub complete: bool,
    /// In the order of the study; of a grid the last varies fastest.
    pub axes: Vec<StudyAxis>,
    /// Whether the points are those of a grid.
    pub is_grid: bool,
    /// In the order of the file.
    pub quantities: Vec<StudyQuantity>,
    /// Code of every point: 0 complete, 1 failed, 2 missing.
    pub status: Vec<f64>,
    /// The quantities that the study asks for: those it is to show, or the one of its criterion.
    pub asked: Vec<String>,
    /// Number and message of those that failed.
    pub failures: Vec<(u64, String)>,
    /// Runs a point by itself, once the values on the axes are set; of files of earlier versions not known.
    pub command: Option<String>,
    /// The tolerance of its runs by `cvode`, `arkode` and `series`, where the study sets it and not the case.
    pub default_tolerance: Option<f64>,
}

impl StudyData {
    /// Reads a sweep file.
    ///
    /// # Errors
    /// If it cannot be read, or has no point.
    pub fn read(file: &SweepFile) -> Result<StudyData, PlotError> {
        let names = file.variables("/");
        let status = file.numbers("status")?;
        let count = status.len();
        let is_grid = file.is_grid();
        let attribute = |name: &str, attribute: &str| file.attribute(name, attribute).unwrap_or_default();
        let mut axes = Vec::new();
        for name in names.iter().filter(|name| file.attribute(name, "keys").is_some()) {
            let flags = file.flags(name);
            let values = file.numbers(name)?;
            axes.push(StudyAxis {
                logarithmic: false,
                name: name.clone(),
                keys: attribute(name, "keys").split(' ').map(str::to_owned).collect(),
                units: attribute(name, "units"),
                long_name: attribute(name, "long_name"),
                words: flags.into_iter().map(|(_, word)| word).collect(),
                levels: if is_grid { values.clone() } else { Vec::new() },
                values: if is_grid { Vec::new() } else { values },
            });
        }
        let damaged = |detail: &str| PlotError::from(Reason::Damaged(detail.to_owned()).of(file.path()));
        if is_grid {
            let sizes: Vec<usize> = axes.iter().map(|axis| axis.levels.len()).collect();
            if sizes.iter().product::<usize>() != count || file.shape("status")? != sizes {
                return Err(damaged("its points are not those of its axes"));
            }
            let mut inner = count;
            for axis in &mut axes {
                inner /= axis.levels.len().max(1);
                let levels = &axis.levels;
                axis.values = (0..count).map(|point| levels[point / inner % levels.len()]).collect();
            }
        }
        for axis in &mut axes {
            let is_side = |side: &&str| file.text(&format!("boundary/{side}")).as_ref() == Some(&axis.name);
            let side = ["x", "y"].into_iter().find(is_side);
            let spacing = side.and_then(|side| file.text(&format!("boundary/{side}_spacing")));
            axis.logarithmic = axis.is_logarithmic(spacing.map(|spacing| spacing == "log"));
        }
        let own = |name: &&String| {
            let axis = axes.iter().any(|axis| axis.name == **name);
            !axis && !matches!(name.as_str(), "status" | "point" | "checksums")
        };
        let mut quantities = Vec::new();
        for name in names.iter().filter(own) {
            let values = file.values(name)?;
            quantities.push(StudyQuantity {
                name: name.clone(),
                units: attribute(name, "units"),
                long_name: attribute(name, "long_name"),
                flags: file.flags(name),
                whole: file.is_whole(name),
                values,
            });
        }
        let uneven = axes.iter().any(|axis| axis.values.len() != count)
            || quantities.iter().any(|quantity| quantity.values.len() != count);
        if uneven {
            return Err(damaged("its columns are not equally long"));
        }
        if count == 0 || axes.is_empty() {
            return Err(damaged("it has no point"));
        }
        let meta = |name: &str| file.text(&format!("{}/{name}", group::META));
        let words = |text: String| text.split(' ').map(str::to_owned).collect();
        // The quantity of a criterion is its first word.
        let criterion = || {
            Some(vec![
                file.text("boundary/criterion")?.split_whitespace().next()?.to_owned(),
            ])
        };
        Ok(StudyData {
            path: file.path().to_owned(),
            title: file.text("title").unwrap_or_default(),
            complete: file.text("status").as_deref() == Some("complete"),
            axes,
            is_grid,
            quantities,
            status,
            asked: meta(META_SHOW).map(words).or_else(criterion).unwrap_or_default(),
            failures: file.failures()?,
            command: meta(META_POINT_COMMAND),
            default_tolerance: file.number(&format!("{}/default_rtol", group::META)),
        })
    }

    /// The quantity of this name.
    ///
    /// # Errors
    /// If there is none, with those there are.
    pub fn quantity(&self, name: &str) -> Result<&StudyQuantity, PlotError> {
        let found = self.quantities.iter().find(|quantity| quantity.name == name);
        found.ok_or_else(|| {
            let known: Vec<&str> = self.quantities.iter().map(|quantity| quantity.name.as_str()).collect();
            unknown(&self.path, "quantity", name, &known)
        })
    }

    fn asked(&self) -> impl Iterator<Item = &StudyQuantity> {
        self.asked.iter().filter_map(|name| self.quantity(name).ok())
    }

    /// Whether the study asks for a quantity that it has.
    pub(super) fn asks(&self) -> bool {
        self.asked().next().is_some()
    }

    /// The quantities that the study asks for. Where it asks for none, the first of `wishes` that differs from point to point; else
    /// the result that tells most points apart, or the first of all.
    pub(super) fn of_interest(&self, wishes: &[&str]) -> Vec<&StudyQuantity> {
        if self.asks() {
            return self.asked().collect();
        }
        let mut named = wishes.iter().filter_map(|wish| self.quantity(wish).ok());
        let wished = named.find(|quantity| quantity.varies());
        let found = wished.or_else(|| self.most_telling()).or(self.quantities.first());
        found.into_iter().collect()
    }

    /// The result with the most different values, of equals the first; `None` if none varies.
    fn most_telling(&self) -> Option<&StudyQuantity> {
        let results = self.quantities.iter().filter(|quantity| {
            let name = quantity.name.as_str();
            quantity.varies() && !NO_RESULTS.contains(&name)
        });
        // Of equals the last is the largest: from behind, that is the first.
        results.rev().max_by_key(|quantity| quantity.different_values())
    }

    /// The place of the axis of a name, or of a key.
    ///
    /// # Errors
    /// If there is none, with those there are.
    pub fn axis(&self, name: &str) -> Result<usize, PlotError> {
        let is_it = |axis: &StudyAxis| axis.name == name || axis.keys.iter().any(|key| key == name);
        self.axes.iter().position(is_it).ok_or_else(|| {
            let known: Vec<&str> = self.axes.iter().map(|axis| axis.keys[0].as_str()).collect();
            unknown(&self.path, "axis", name, &known)
        })
    }

    /// What a map shows of a point.
    pub(super) fn cell(&self, point: usize, quantity: &StudyQuantity) -> Cell {
        let status = self.status[point];
        match quantity.values[point] {
            _ if status == FAILED => Cell::Failed,
            _ if status != COMPLETE => Cell::Missing,
            value if value.is_finite() => Cell::Value(value),
            _ => Cell::Nothing,
        }
    }
}

/// Different values, in order.
pub(in crate::plot) fn levels(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut levels: Vec<f64> = values.into_iter().collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

fn unknown(path: &Path, what: &'static str, name: &str, known: &[&str]) -> PlotError {
    PlotError::NotInStudy {
        path: path.to_owned(),
        what,
        name: name.to_owned(),
        hint: hint(name, known.iter().copied()),
        known: known.join(", "),
    }
}

/// With an exponent where that is shorter.
fn plainly(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}
