//! A sweep file as data for figures: axes, points and quantities.

use super::title;
use crate::Error;
use crate::plot::figure::{Axis, Cell, Figure, Panel, extent};
use std::path::{Path, PathBuf};
use stickslip_analysis::sweep::QUANTITIES;
use stickslip_files::schema::{META_POINT_COMMAND, META_SHOW, Variable, group};
use stickslip_files::{Reason, StudyFile};

/// Variable, name and symbol of the parameters in the paper's figure.
const SYMBOLS: [(&str, &str, &str); 3] = [
    ("friction_decay", "friction decay", "α"),
    ("torsion_damping", "torsional damping", "c_t"),
    ("perturbation_0_relative_velocity", "kick", "δ"),
];

/// Longest symbol, which is the text before the comma in a description.
const LONGEST_SYMBOL: usize = 8;

/// Relative difference of equal values.
const SAME: f64 = 1e-6;

const COMPLETE: f64 = 0.0;
const FAILED: f64 = 1.0;

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

pub(in crate::plot) fn short(name: &str) -> &str {
    SYMBOLS
        .iter()
        .find(|known| known.0 == name)
        .map_or(name, |known| known.2)
}

/// A column of a study: a parameter that varies, or a quantity known for each run.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyColumn {
    /// Name of its variable.
    pub name: String,
    /// UDUNITS.
    pub units: String,
    /// Description.
    pub long_name: String,
    /// Codes and their meanings, if the values are codes.
    pub flags: Vec<(i64, String)>,
    /// Whether the values are whole numbers.
    pub whole: bool,
    /// Value of each point; NaN: none.
    pub values: Vec<f64>,
    /// Paths of the keys that a parameter sets; none for a quantity.
    pub keys: Vec<String>,
    /// Whether the values of a parameter are evenly spaced in the logarithm.
    pub logarithmic: bool,
    /// Levels of a parameter of a grid in the order of the file.
    pub levels: Vec<f64>,
}

impl StudyColumn {
    /// Whether the values that are known differ between points.
    pub fn varies(&self) -> bool {
        let mut numbers = self.values.iter().filter(|value| !value.is_nan());
        let first = numbers.next();
        numbers.any(|value| Some(value) != first)
    }

    pub(super) fn axis(&self) -> Axis {
        let axis = drawn_axis(&self.name, &self.units, &self.long_name);
        if self.keys.is_empty() || self.flags.is_empty() {
            return axis.logarithmic(self.logarithmic);
        }
        let words = self.flags.iter().enumerate();
        let words: Vec<String> = words.map(|(code, (_, word))| format!("{code} {word}")).collect();
        Axis::new(&format!("{}: {}", axis.name, words.join(", ")), "1")
    }

    /// A value in words: "c_t = 22.6 N m s/rad", "solver method = erk".
    pub(super) fn said(&self, value: f64) -> String {
        let axis = drawn_axis(&self.name, &self.units, &self.long_name);
        match self.flags.get(value as usize) {
            Some((_, word)) => format!("{} = {word}", axis.short()),
            None if self.units == "1" => format!("{} = {}", axis.short(), plainly(value)),
            None => format!("{} = {} {}", axis.short(), plainly(value), self.units),
        }
    }

    /// Whether the values are evenly spaced in the logarithm over 1.5 decades or more, so that a logarithmic axis
    /// shows two powers. `traced` says whether a boundary was searched in the logarithm, if this is known.
    fn is_logarithmic(&self, traced: Option<bool>) -> bool {
        let (low, high) = extent(self.values.iter().copied()).unwrap_or((0.0, 1.0));
        if !self.flags.is_empty() || low <= 0.0 {
            return false;
        }
        if let Some(traced) = traced {
            return traced;
        }
        if high < 30.0 * low {
            return false;
        }
        if self.levels.len() < 3 {
            // A sample is logarithmic if the geometric mean of its limits is nearer to the median than their mean.
            let below = |limit: f64| self.values.iter().filter(|value| **value < limit).count() as f64;
            let half = 0.5 * self.values.len() as f64;
            return (below((low * high).sqrt()) - half).abs() < (below(0.5 * (low + high)) - half).abs();
        }
        let ratio = self.levels[1] / self.levels[0];
        let mut pairs = self.levels.windows(2);
        pairs.all(|pair| (pair[1] / pair[0] / ratio - 1.0).abs() < 1e-6)
    }

    pub(super) fn is_known(&self) -> bool {
        self.values.iter().any(|value| !value.is_nan())
    }

    fn different_values(&self) -> usize {
        let mut values: Vec<f64> = self.values.iter().copied().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let largest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        values.dedup_by(|next, before| *next - *before <= SAME * largest);
        values.len()
    }
}

/// A sweep file in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyData {
    /// The file.
    pub path: PathBuf,
    /// Title of the study.
    pub title: String,
    /// Whether all points are present.
    pub complete: bool,
    /// Axes in the order of the study. The last axis of a grid varies fastest.
    pub axes: Vec<StudyColumn>,
    /// Whether the points form a grid.
    pub is_grid: bool,
    /// Quantities in the order of the file.
    pub quantities: Vec<StudyColumn>,
    /// Code of each point: 0 complete, 1 failed, 2 missing.
    pub status: Vec<f64>,
    /// Quantities that the study requests for figures, or the quantity of its criterion.
    pub asked: Vec<String>,
    /// Number and message of each failed point.
    pub failures: Vec<(u64, String)>,
    /// Command that runs one point, after the values of the axes are set; `None` for files of earlier versions.
    pub command: Option<String>,
    /// Tolerance of `cvode`, `arkode` and `series`, if the study sets it instead of the case.
    pub default_tolerance: Option<f64>,
}

impl StudyData {
    /// Reads a sweep file.
    ///
    /// # Errors
    /// The file is unreadable, or contains no point.
    pub fn read(file: &StudyFile) -> Result<StudyData, Error> {
        let is_grid = file.is_grid()?;
        let shape = file.shape("status")?;
        let (mut status, mut axes, mut quantities) = (Vec::new(), Vec::new(), Vec::new());
        for (variable, _, values) in file.columns("")? {
            let Variable { name, units, .. } = variable;
            let keys = file.text(&format!("{name}/keys"))?;
            let is_axis = keys.is_some();
            match name.as_str() {
                "status" => status = values,
                "point" => {}
                _ => (if is_axis { &mut axes } else { &mut quantities }).push(StudyColumn {
                    levels: if is_grid && is_axis { values.clone() } else { Vec::new() },
                    keys: keys.map_or_else(Vec::new, |keys| keys.split(' ').map(str::to_owned).collect()),
                    long_name: variable.long_name,
                    flags: variable.flags,
                    whole: variable.fill.is_some(),
                    logarithmic: false,
                    name,
                    units,
                    values,
                }),
            }
        }
        let count = status.len();
        let damaged = |detail: &str| Error::from(Reason::Damaged(detail.to_owned()).of(file.path()));
        if is_grid {
            let sizes: Vec<usize> = axes.iter().map(|axis| axis.levels.len()).collect();
            if sizes.iter().product::<usize>() != count || shape != sizes {
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
            let mut traced = None;
            for side in ["x", "y"] {
                if file.text(&format!("boundary/{side}"))?.as_ref() == Some(&axis.name) {
                    traced = file.text(&format!("boundary/{side}_spacing"))?;
                }
            }
            axis.logarithmic = axis.is_logarithmic(traced.map(|spacing| spacing == "log"));
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
        // The first word of a criterion is its quantity.
        let criterion = file.text("boundary/criterion")?;
        let criterion = criterion.and_then(|text| Some(vec![text.split_whitespace().next()?.to_owned()]));
        Ok(StudyData {
            path: file.path().to_owned(),
            title: file.text("title")?.unwrap_or_default(),
            complete: file.text("status")?.as_deref() == Some("complete"),
            axes,
            is_grid,
            quantities,
            status,
            asked: meta(META_SHOW)?.map(words).or(criterion).unwrap_or_default(),
            failures: file.failures()?,
            command: meta(META_POINT_COMMAND)?,
            default_tolerance: file.number(&format!("{}/default_rtol", group::META))?,
        })
    }

    /// The quantity with this name. The error for an unknown name lists the known ones.
    pub fn quantity(&self, name: &str) -> Result<&StudyColumn, Error> {
        let found = self.quantities.iter().find(|quantity| quantity.name == name);
        found.ok_or_else(|| {
            let known: Vec<&str> = self.quantities.iter().map(|quantity| quantity.name.as_str()).collect();
            unknown(&self.path, "quantity", name, &known)
        })
    }

    /// A figure of the study, complete or not, with what it `shows` in its title.
    pub(super) fn figure(&self, name: String, shows: &str, panels: Vec<Panel>) -> Figure {
        Figure::new(name, title((&self.title, self.complete), shows), panels)
    }

    fn asked(&self) -> impl Iterator<Item = &StudyColumn> {
        self.asked.iter().filter_map(|name| self.quantity(name).ok())
    }

    pub(super) fn asks(&self) -> bool {
        self.asked().next().is_some()
    }

    /// The quantities that the study names. Without any: the first of `wishes` that varies, then the result with the
    /// most different values, then the first quantity.
    pub(super) fn of_interest(&self, wishes: &[&str]) -> Vec<&StudyColumn> {
        if self.asks() {
            return self.asked().collect();
        }
        let mut named = wishes.iter().filter_map(|wish| self.quantity(wish).ok());
        let wished = named.find(|quantity| quantity.varies());
        let found = wished.or_else(|| self.most_telling()).or(self.quantities.first());
        found.into_iter().collect()
    }

    fn most_telling(&self) -> Option<&StudyColumn> {
        let is_result = |name: &str| QUANTITIES.iter().all(|known| known.name != name || known.is_result());
        let results = self.quantities.iter();
        let results = results.filter(|quantity| quantity.varies() && is_result(&quantity.name));
        // `max_by_key` returns the last of equal ones: in reverse, the first.
        results.rev().max_by_key(|quantity| quantity.different_values())
    }

    /// Index of an axis with this name or key. The error for an unknown one lists the known ones.
    pub fn axis(&self, name: &str) -> Result<usize, Error> {
        let is_it = |axis: &StudyColumn| axis.name == name || axis.keys.iter().any(|key| key == name);
        self.axes.iter().position(is_it).ok_or_else(|| {
            let known: Vec<&str> = self.axes.iter().map(|axis| axis.keys[0].as_str()).collect();
            unknown(&self.path, "axis", name, &known)
        })
    }

    pub(super) fn cell(&self, point: usize, quantity: &StudyColumn) -> Cell {
        let status = self.status[point];
        match quantity.values[point] {
            _ if status == FAILED => Cell::Failed,
            _ if status != COMPLETE => Cell::Missing,
            value if value.is_finite() => Cell::Value(value),
            _ => Cell::Nothing,
        }
    }
}

pub(in crate::plot) fn levels(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut levels: Vec<f64> = values.into_iter().collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

pub(in crate::plot) fn unknown(path: &Path, what: &'static str, name: &str, known: &[&str]) -> Error {
    Error::unknown(format!("{}: the study has no {what}", path.display()), name, known, "")
}

/// Relative error of a printed value. Sums of steps, such as 0.1 + 0.2, differ from their decimal by less.
const PRINTED: f64 = 1e-12;

/// The shortest decimal within [`PRINTED`] of the value.
pub(in crate::plot) fn plainly(value: f64) -> String {
    let mut rounded = (0..17).filter_map(|digits| format!("{value:.digits$e}").parse::<f64>().ok());
    let value = rounded
        .find(|rounded| (rounded - value).abs() <= PRINTED * value.abs())
        .unwrap_or(value);
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}
