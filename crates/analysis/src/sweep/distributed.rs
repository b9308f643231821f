//! Distributions of the axes of a sample, as inverses of their distribution functions.

use super::axis::one_for_all;
use super::sampling::cell_value;
use crate::study::{StudyKey, StudyReader, keys};
use std::path::{Path, PathBuf};
use stickslip_case::document::{CaseValue, PlacedValue};
use stickslip_case::{Setting, Slot};

/// Distribution of the values of a sampled axis. Numbers are in the SI unit of the axis.
#[derive(Debug, Clone, PartialEq)]
pub enum AxisDistribution {
    /// Normal distribution.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
    /// The logarithm is normal.
    Lognormal {
        /// Median, which is above 0.
        median: f64,
        /// Standard deviation of the logarithm, as a factor above 1: 68 % of the values are between median / factor and
        /// median * factor.
        factor: f64,
    },
    /// The density rises linearly to its mode, and falls linearly from there.
    Triangular {
        /// Least value.
        from: f64,
        /// Largest value.
        to: f64,
        /// Most probable value.
        mode: f64,
    },
    /// The distribution of measured values, with linear interpolation between neighbours.
    Table {
        /// The file.
        path: PathBuf,
        /// Its values in increasing order, at least two.
        values: Vec<f64>,
    },
}

/// Names of the distributions; the first is the default.
const NAMES: [&str; 5] = ["uniform", "normal", "lognormal", "triangular", "table"];

/// Keys of an axis with a distribution, except those of a range.
pub(crate) const KEYS: &[StudyKey] = keys! {
    "distribution": "text", "uniform" => "of a sampled axis: uniform, normal, lognormal, triangular or table";
    "mean": "number or text", "" => "normal: mean";
    "deviation": "number or text", "" => "normal: standard deviation";
    "median": "number or text", "" => "lognormal: median";
    "factor": "number", "" => "lognormal: 68 % of the values are between median / factor and median * factor";
    "mode": "number or text", "" => "triangular: the most probable value; from and to are the least and the largest";
    "table": "text", "" =>
        "table: CSV file with measured values in its first column, with linear interpolation between neighbours";
};

impl AxisDistribution {
    /// The value below which a fraction `share` of the values lies. The ends, which may be infinite, are replaced by
    /// the median.
    pub fn at(&self, share: f64) -> f64 {
        let share = if share > 0.0 && share < 1.0 { share } else { 0.5 };
        match self {
            AxisDistribution::Normal { mean, deviation } => mean + deviation * normal_quantile(share),
            AxisDistribution::Lognormal { median, factor } => median * (factor.ln() * normal_quantile(share)).exp(),
            AxisDistribution::Triangular { from, to, mode } => {
                let (width, below) = (to - from, mode - from);
                match share * width < below {
                    true => from + (share * width * below).sqrt(),
                    false => to - ((1.0 - share) * width * (to - mode)).sqrt(),
                }
            }
            AxisDistribution::Table { values, .. } => {
                let place = share * (values.len() - 1) as f64;
                let low = (place as usize).min(values.len() - 2);
                values[low] + (place - low as f64) * (values[low + 1] - values[low])
            }
        }
    }

    /// Reads the distribution of the axis at `path` of a sample; `None` in the result for the uniform one, which has a
    /// range. Tables are in `folder`.
    pub(super) fn read(
        reader: &mut StudyReader,
        node: &PlacedValue,
        keys: &[Slot],
        path: &str,
        folder: &Path,
    ) -> Option<Option<AxisDistribution>> {
        let at = |name: &str| format!("{path}.{name}");
        let one_of = format!("one of \"{}\"", NAMES.join("\", \""));
        let name = NAMES[reader.choice(node, (path, "distribution"), &NAMES, &one_of)?];
        let own: &[&str] = match name {
            "normal" => &["mean", "deviation"],
            "lognormal" => &["median", "factor"],
            "triangular" => &["from", "to", "mode"],
            "table" => &["table"],
            _ => &["values", "from", "to", "count", "spacing"],
        };
        let others = ["values", "from", "to", "count", "spacing"];
        let others = others.into_iter().chain(KEYS[1..].iter().map(|key| key.name));
        for other in others.filter(|other| !own.contains(other)) {
            if let Some(given) = node.at(other) {
                let message = format!("not of the distribution \"{name}\", which has {}", own.join(", "));
                return reader.refuse(given, &at(other), message);
            }
        }
        if name == NAMES[0] {
            return Some(None);
        }
        if name == "table" {
            let missing = "missing: the CSV file with the values, as in table = \"measured.csv\"";
            let given = reader.needed(node, path, "table", missing)?;
            let file = folder.join(reader.text(given, &at("table"))?);
            let values = reader.found(given, &at("table"), read_values(&file, keys))?;
            return Some(Some(AxisDistribution::Table { path: file, values }));
        }
        let mut number = |key: &str| {
            let missing = format!("missing: the distribution \"{name}\" has {}", own.join(", "));
            let given = reader.needed(node, path, key, &missing)?;
            let value = match (key, &given.value) {
                ("factor", CaseValue::Integer(number)) => Ok(Setting::Number(*number as f64)),
                ("factor", CaseValue::Float(number)) => Ok(Setting::Number(*number)),
                ("factor", _) => Err("expected a number above 1".to_owned()),
                (_, value) => one_for_all(keys, value),
            };
            match reader.found(given, &at(key), value)? {
                Setting::Number(number) => Some(number),
                _ => {
                    let message = "this key takes words or whole numbers, which have no distribution: list them as values = [...]";
                    reader.refuse(given, &at(key), message)
                }
            }
        };
        let found: Vec<Option<f64>> = own.iter().map(|key| number(key)).collect();
        let found = found.into_iter().collect::<Option<Vec<f64>>>()?;
        let refused = |reader: &mut StudyReader, key: &str, message: &str| {
            reader.refuse(node.at(key).unwrap_or(node), &at(key), message)
        };
        let distribution = match (name, &found[..]) {
            ("normal", &[mean, deviation]) => match deviation > 0.0 {
                true => AxisDistribution::Normal { mean, deviation },
                false => return refused(reader, "deviation", "must be greater than 0"),
            },
            ("lognormal", &[median, factor]) => match (median > 0.0, factor > 1.0) {
                (true, true) => AxisDistribution::Lognormal { median, factor },
                (false, _) => return refused(reader, "median", "must be greater than 0"),
                _ => return refused(reader, "factor", "must be greater than 1"),
            },
            (_, &[from, to, mode]) => match from < to && (from..=to).contains(&mode) {
                true => AxisDistribution::Triangular { from, to, mode },
                false => return refused(reader, "mode", "expected from < to, and the mode between them"),
            },
            _ => return None,
        };
        Some(Some(distribution))
    }
}

/// The values in the first column of a CSV file with or without a header, sorted. `keys` give their unit.
fn read_values(path: &Path, keys: &[Slot]) -> Result<Vec<f64>, String> {
    let file = path.display();
    let opened = std::fs::File::open(path).map_err(|error| {
        let what = stickslip_case::words(&error).replace("TOML", "CSV");
        format!("{file}: the table of values cannot be read: {what}")
    })?;
    let mut table = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(stickslip_case::input::InputRows::new(opened));
    let (mut values, mut record) = (Vec::new(), csv::StringRecord::new());
    let mut is_first = true;
    while table
        .read_record(&mut record)
        .map_err(|error| format!("{file}: not a table of values (CSV): {error}"))?
    {
        table.get_mut().taken();
        let line = record.position().map_or(0, csv::Position::line);
        let value = one_for_all(keys, &cell_value(record.get(0).unwrap_or_default()));
        match value {
            Ok(Setting::Number(number)) => values.push(number),
            Err(_) if is_first => {}
            Ok(_) => {
                return Err(format!(
                    "{file}:{line}: this key takes words, which have no distribution"
                ));
            }
            Err(message) => return Err(format!("{file}:{line}: {message}")),
        }
        is_first = false;
    }
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 | 1 => Err(format!("{file}: fewer than two values in its first column; give more")),
        _ => Ok(values),
    }
}

/// Quantile of the standard normal distribution for a share in (0, 1), to about 1e-16 relative: algorithm AS 241 of
/// M. J. Wichura, Applied Statistics 37 (1988) 477-484.
fn normal_quantile(share: f64) -> f64 {
    let ratio = |r: f64, above: [f64; 8], below: [f64; 7]| {
        let polynomial = |coefficients: &[f64], end: f64| {
            let mut all = coefficients.iter().copied().chain([end]);
            let first = all.next().unwrap_or_default();
            all.fold(first, |sum, coefficient| sum * r + coefficient)
        };
        polynomial(&above[..7], above[7]) / polynomial(&below, 1.0)
    };
    let q = share - 0.5;
    if q.abs() <= 0.425 {
        return q * ratio(0.180_625 - q * q, CENTRE.0, CENTRE.1);
    }
    let r = (-share.min(1.0 - share).ln()).sqrt();
    let size = match r <= 5.0 {
        true => ratio(r - 1.6, SIDES.0, SIDES.1),
        false => ratio(r - 5.0, TAILS.0, TAILS.1),
    };
    size.copysign(q)
}

/// Coefficients of a numerator and of a denominator, which ends in 1.
type RationalCoefficients = ([f64; 8], [f64; 7]);

const CENTRE: RationalCoefficients = (
    [
        2_509.080_928_730_122_7,
        33_430.575_583_588_13,
        67_265.770_927_008_7,
        45_921.953_931_549_87,
        13_731.693_765_509_46,
        1_971.590_950_306_551_3,
        133.141_667_891_784_38,
        3.387_132_872_796_366_5,
    ],
    [
        5_226.495_278_852_854,
        28_729.085_735_721_943,
        39_307.895_800_092_71,
        21_213.794_301_586_597,
        5_394.196_021_424_751,
        687.187_007_492_057_9,
        42.313_330_701_600_91,
    ],
);

const SIDES: RationalCoefficients = (
    [
        0.000_774_545_014_278_341_4,
        0.022_723_844_989_269_184,
        0.241_780_725_177_450_6,
        1.270_458_252_452_368_4,
        3.647_848_324_763_204_5,
        5.769_497_221_460_691,
        4.630_337_846_156_546,
        1.423_437_110_749_683_5,
    ],
    [
        1.050_750_071_644_416_9e-09,
        0.000_547_593_808_499_534_5,
        0.015_198_666_563_616_457,
        0.148_103_976_427_480_08,
        0.689_767_334_985_1,
        1.676_384_830_183_803_8,
        2.053_191_626_637_759,
    ],
);

const TAILS: RationalCoefficients = (
    [
        2.010_334_399_292_288_1e-07,
        2.711_555_568_743_487_6e-05,
        0.001_242_660_947_388_078_4,
        0.026_532_189_526_576_124,
        0.296_560_571_828_504_87,
        1.784_826_539_917_291_3,
        5.463_784_911_164_114,
        6.657_904_643_501_103,
    ],
    [
        2.044_263_103_389_939_7e-15,
        1.421_511_758_316_446e-07,
        1.846_318_317_510_054_8e-05,
        0.000_786_869_131_145_613_3,
        0.014_875_361_290_850_615,
        0.136_929_880_922_735_8,
        0.599_832_206_555_888,
    ],
);
