//! Samples of many axes: Latin hypercubes, Sobol sequences, and tables of points.

use super::axis::{ParameterAxis, one_for_all};
use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};
use std::path::Path;
use stickslip_case::document::CaseValue;
use stickslip_case::{CaseKeys, Setting};
use stickslip_system::quote::quoted;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SampleMethod {
    /// One random point in each of `count` layers of every axis; the layers of different axes are paired at random.
    LatinHypercube,
    /// Sobol sequence with Owen's scrambling.
    Sobol,
}

/// Largest number of points and of axes of the Sobol generator.
pub(super) const MOST_SOBOL_POINTS: u64 = 1 << 16;
pub(super) const MOST_SOBOL_AXES: usize = 256;

/// Step of the generator's numbers in [0, 1).
const SOBOL_STEP: f64 = 1.0 / (1u64 << 24) as f64;

/// Largest memory for the points of a sample or a table, bytes.
const MEMORY: u64 = 512 << 20;

/// Largest possible number of points with these axes, if it is less than `count`.
pub(super) fn too_many(axes: usize, count: u64) -> Option<u64> {
    // A row of settings and, during sampling, a row of fractions, each with its own allocation.
    let row = 96 + axes as u64 * (size_of::<Setting>() + size_of::<f64>()) as u64;
    let most = MEMORY / row;
    (count > most).then_some(most)
}

/// Sample of the axes: `count` rows with one value for each axis. The seed reproduces it on every machine.
pub(super) fn draw(axes: &[ParameterAxis], method: SampleMethod, count: usize, seed: u32) -> Vec<Vec<Setting>> {
    let shares = match method {
        SampleMethod::LatinHypercube => latin_hypercube(axes.len(), count, seed),
        SampleMethod::Sobol => sobol(axes.len(), count, seed),
    };
    let value = |(axis, share): (&ParameterAxis, f64)| match (&axis.distribution, method) {
        // The sequence is in multiples of a step from 0, where a distribution may have no value: the middle of the step.
        (Some(_), SampleMethod::Sobol) => axis.at(share + 0.5 * SOBOL_STEP),
        _ => axis.at(share),
    };
    let row = |shares: Vec<f64>| axes.iter().zip(shares).map(value).collect();
    shares.into_iter().map(row).collect()
}

pub(crate) fn sobol(axes: usize, count: usize, seed: u32) -> Vec<Vec<f64>> {
    let share = |point: usize, axis: usize| f64::from(sobol_burley::sample(point as u32, axis as u32, seed));
    let points = (0..count).map(|point| (0..axes).map(|axis| share(point, axis)).collect());
    points.collect()
}

fn latin_hypercube(axes: usize, count: usize, seed: u32) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(u64::from(seed));
    let mut rows = vec![vec![0.0; axes]; count];
    for axis in 0..axes {
        let mut layers: Vec<usize> = (0..count).collect();
        for last in (1..count).rev() {
            layers.swap(last, below(&mut random, last as u64 + 1) as usize);
        }
        for (row, layer) in rows.iter_mut().zip(layers) {
            row[axis] = (layer as f64 + unit(&mut random)) / count as f64;
        }
    }
    rows
}

/// Whole number below `bound`, from the high half of a product. Its bias, bound/2^64, is negligible in any sample.
fn below(random: &mut impl Rng, bound: u64) -> u64 {
    ((u128::from(random.next_u64()) * u128::from(bound)) >> 64) as u64
}

fn unit(random: &mut impl Rng) -> f64 {
    (random.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// Axes and rows of a CSV file whose first line has `known` keys. The error gives the problem and its line.
pub(super) fn read_table(path: &Path, known: &CaseKeys) -> Result<(Vec<ParameterAxis>, Vec<Vec<Setting>>), String> {
    let file = path.display();
    let unreadable = |error: &std::io::Error| {
        let what = stickslip_case::words(error).replace("TOML", "CSV");
        format!("{file}: the table of points cannot be read: {what}")
    };
    if path.exists() && !path.is_file() && !path.is_dir() {
        return Err(format!(
            "{file}: no table of points, but a device or a pipe; name a CSV file"
        ));
    }
    let opened = std::fs::File::open(path).map_err(|error| unreadable(&error))?;
    let mut table = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(stickslip_case::input::InputRows::new(opened));
    let bad = |error: csv::Error| match error.kind() {
        csv::ErrorKind::UnequalLengths {
            pos, expected_len, len, ..
        } => format!(
            "{file}:{}: {len} values for {expected_len} keys; give each row one value for each key",
            pos.as_ref().map_or(0, csv::Position::line)
        ),
        csv::ErrorKind::Io(io) => unreadable(io),
        csv::ErrorKind::Utf8 { pos, .. } => format!(
            "{file}:{}: not UTF-8; save the file as UTF-8",
            pos.as_ref().map_or(0, csv::Position::line)
        ),
        _ => format!("{file}: not a table of points (CSV): {error}"),
    };
    let mut axes = Vec::new();
    let mut keys = Vec::new();
    for (column, name) in table.headers().map_err(bad)?.iter().enumerate() {
        let name = name.trim_start_matches('\u{feff}').replace('[', ".").replace(']', "");
        let Some(key) = known.slot(&name) else {
            // Only numbers and words are quoted: the file may contain private data instead of a table.
            let what = match known.suggestion(&name) {
                Some(close) => format!("a case has no key {} (did you mean {close}?)", quoted(&name)),
                None if is_word(&name) => format!("a case has no key {}", quoted(&name)),
                None => format!("column {} is not named after a key of a case", column + 1),
            };
            return Err(format!(
                "{file}:1: {what}; the first line names the keys, such as friction.decay,torsion.damping"
            ));
        };
        if let Some(why) = known.misplaced(&name) {
            return Err(format!("{file}:1: {why}"));
        }
        if axes.iter().any(|axis: &ParameterAxis| axis.keys[0] == name) {
            return Err(format!("{file}:1: {name} has two columns; keep one"));
        }
        axes.push(ParameterAxis::of_keys(vec![name.clone()], &key));
        keys.push((name, key));
    }
    let mut rows = Vec::new();
    let mut record = csv::StringRecord::new();
    while table.read_record(&mut record).map_err(bad)? {
        table.get_mut().taken();
        if let Some(most) = too_many(axes.len(), rows.len() as u64 + 1) {
            return Err(format!(
                "{file}: more than {most} points, which is what memory is given for; split the table in several studies"
            ));
        }
        let line = record.position().map_or(0, csv::Position::line);
        let row: Result<Vec<Setting>, String> = record
            .iter()
            .zip(&keys)
            .map(|(cell, (name, key))| {
                one_for_all(std::slice::from_ref(key), &cell_value(cell))
                    .map_err(|message| format!("{file}:{line}: {name}: {message}"))
            })
            .collect();
        rows.push(row?);
    }
    if rows.is_empty() {
        return Err(format!(
            "{file}: a table of points without a point; give it at least one row below the keys"
        ));
    }
    Ok((axes, rows))
}

/// Whether a text may be a column name, and is unlikely to be secret because it has few letters.
fn is_word(name: &str) -> bool {
    const LONGEST: usize = 24;
    name.len() <= LONGEST && name.chars().all(|c| c.is_ascii_lowercase() || c == '_' || c == '.')
}

pub(super) fn cell_value(cell: &str) -> CaseValue {
    if let Ok(number) = cell.parse::<i64>() {
        return CaseValue::Integer(number);
    }
    match (cell.parse::<f64>(), cell) {
        (Ok(number), _) => CaseValue::Float(number),
        (_, "true") => CaseValue::Flag(true),
        (_, "false") => CaseValue::Flag(false),
        _ => CaseValue::Text(cell.to_owned()),
    }
}
