//! The trajectory on a page, with as many true samples as fit.

use serde::Serialize;

use super::form::PageForm;
use super::pair::{DIFFERENCE, PagePair};
use crate::Error;
use crate::plot::html::{Doubles, encoded};
use crate::plot::run::RunRows;
use crate::plot::thinning::{Blocks, Plan, ThinnedColumn, ThinnedStretch};
use stickslip_files::{ResultError, ResultFile};

const BLOCK: usize = 128;

#[derive(Debug, Serialize)]
pub(super) struct PageTrajectory {
    /// Number in the file.
    samples: usize,
    pub(super) kept: usize,
    block: usize,
    stretches: Vec<StretchInfo>,
    /// Time of each entry, or of the first sample in its bucket, s.
    time: Doubles,
    /// Time of the last sample in each bucket, s.
    bucket_end: Doubles,
    channels: Vec<PageChannel>,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct StretchInfo {
    entries: usize,
    /// Samples per bucket; 1 if every sample is kept.
    samples_each: usize,
    bucket: bool,
}

#[derive(Debug, Serialize)]
struct PageChannel {
    name: String,
    unit: String,
    description: String,
    /// Value of each entry; the least one for a bucket.
    value: Packed,
    /// Largest value of each bucket.
    bucket_high: Packed,
}

/// A column in half the space of doubles: a base (double) for each [`BLOCK`] of values, and single-precision offsets.
///
/// The base is the first value, so that an energy of 11 kJ keeps changes of microjoules. If a block has values below
/// half of its largest, the base is 0, so that zeros (relative velocity in stick) stay zero and small values keep their
/// digits. The error is at most 2^-23 of the block's range: an offset is at most the range, or with base 0 a value at
/// most twice the range, and rounding is 2^-24 of either. Offsets above 3.4e38 become infinite, below 1e-45 zero.
#[derive(Debug, Serialize)]
struct Packed {
    base: Doubles,
    offset: String,
}

impl Packed {
    fn new(values: &[f64]) -> Self {
        let bases: Vec<f64> = values.chunks(BLOCK).map(base_of).collect();
        let offsets = values.iter().enumerate().map(|(i, v)| (v - bases[i / BLOCK]) as f32);
        Packed {
            base: bases.iter().copied().collect(),
            offset: encoded(offsets.flat_map(f32::to_le_bytes)),
        }
    }
}

fn base_of(block: &[f64]) -> f64 {
    let finite = || block.iter().copied().filter(|v| v.is_finite());
    let (least, most) = finite().fold((f64::INFINITY, 0.0), |(least, most): (f64, f64), v| {
        (least.min(v.abs()), most.max(v.abs()))
    });
    if least < most / 2.0 {
        0.0
    } else {
        finite().next().unwrap_or(0.0)
    }
}

impl PageTrajectory {
    /// A trajectory, thinned to fit into `room` bytes. `pair`: adds the differences from a second run.
    pub(super) fn of(
        file: &ResultFile,
        form: &PageForm,
        pair: Option<&PagePair>,
        room: usize,
    ) -> Result<PageTrajectory, Error> {
        let rows = rows_of(file, pair.is_none())?;
        let samples = rows.len();
        // A sample takes a time, an offset per channel and its share of a base; base64 adds a third.
        let columns = form.variables.len() + pair.map_or(0, |pair| pair.compared.len());
        let bytes = 8 + columns * 4 + (columns * 8).div_ceil(BLOCK);
        let room = room / (4 * bytes).div_ceil(3);
        let events = if samples > room {
            event_rows(file, &rows)?
        } else {
            Vec::new()
        };
        let whole = match form.whole_from().filter(|_| samples > room) {
            Some(from) => rows.first_row(from)?..samples,
            None => samples..samples,
        };
        let plan = Plan::new(samples, &events, whole.clone(), room);
        let fold = |name: &str| -> Result<ThinnedColumn, ResultError> { plan.fold(column_blocks(&rows, name)) };
        let time = fold("time")?;
        let mut channels = Vec::with_capacity(columns);
        let mut add = |name: &str, unit: &str, description: String, column: ThinnedColumn| {
            channels.push(PageChannel {
                name: name.to_owned(),
                unit: unit.to_owned(),
                description,
                value: Packed::new(&column.values),
                bucket_high: Packed::new(&column.highs),
            });
        };
        for variable in &form.variables {
            let name = &variable.name;
            add(name, &variable.units, variable.long_name.clone(), fold(name)?);
        }
        let mut notes = notes(&plan, &rows, samples, events.len(), !whole.is_empty());
        if let Some(pair) = pair {
            for variable in form.variables.iter().filter(|one| pair.compared.contains(&one.name)) {
                let name = &variable.name;
                let difference = plan.fold(pair.difference(file, name)?)?;
                let description = format!("{}, first run less second", variable.long_name);
                add(&format!("{DIFFERENCE}{name}"), &variable.units, description, difference);
            }
            notes.push(pair.note(file)?);
        }
        notes.push(format!(
            "Times, and the states at events, are exact. A sample's value is off by at most 1.2e-7 of the range that its \
             channel has among {BLOCK} consecutive ones."
        ));
        let stretch = |s: &ThinnedStretch| StretchInfo {
            entries: s.entries(),
            samples_each: s.bucket.unwrap_or(1),
            bucket: s.bucket.is_some(),
        };
        Ok(PageTrajectory {
            samples,
            kept: plan.kept(),
            block: BLOCK,
            stretches: plan.stretches.iter().map(stretch).collect(),
            time: time.firsts.into_iter().collect(),
            bucket_end: time.lasts.into_iter().collect(),
            channels,
            notes,
        })
    }
}

fn notes(plan: &Plan, rows: &RunRows, samples: usize, events: usize, last_period: bool) -> Vec<String> {
    let of = match rows.is_dense() {
        true => "points of the dense output of the file",
        false => "samples of the file",
    };
    let kept = plan.kept();
    if kept == samples {
        return vec![format!("All {samples} {of} are on this page.")];
    }
    let each = plan.stretches.iter().find_map(|stretch| stretch.bucket).unwrap_or(1);
    let period = if last_period {
        ", and those of the last period"
    } else {
        ""
    };
    let mut notes = vec![format!(
        "Of the {samples} {of}, {kept} are on this page as they are: those around the events{period}. For \
         every {each} consecutive ones of the others it has the least and the largest value of each channel, drawn \
         as a band; so every extreme is there, and single samples between are not."
    )];
    if plan.events_covered < events {
        notes.push(format!(
            "There is room for the samples around the first {} of {events} events.",
            plan.events_covered
        ));
    }
    notes
}

/// The samples, or the dense output if it is allowed and covers them. The browser zooms into any window, so that all
/// pieces have the same number of points.
fn rows_of(file: &ResultFile, may_be_dense: bool) -> Result<RunRows<'_>, ResultError> {
    if let Some((first, last)) = file.span()?.filter(|_| may_be_dense)
        && let Some(dense) = file.dense()?.filter(|dense| dense.covers(first, last))
    {
        let span = dense.span().unwrap_or((first, last));
        return Ok(RunRows::of_dense(file, dense, span, 0.0));
    }
    Ok(RunRows::of_samples(file, 0..file.sample_count()?))
}

fn column_blocks<'s>(rows: &'s RunRows, name: &'s str) -> Blocks<'s> {
    Box::new(rows.blocks(16_384).map(move |block| rows.column(name, block)))
}

/// First row at or after each event, in order.
fn event_rows(file: &ResultFile, rows: &RunRows) -> Result<Vec<usize>, ResultError> {
    let mut times: Vec<f64> = file.events()?.iter().map(|event| event.time).collect();
    times.sort_by(f64::total_cmp);
    let mut found = Vec::with_capacity(times.len());
    let mut before = 0;
    for block in column_blocks(rows, "time") {
        let block = block?;
        while found.len() < times.len() && block.last().is_some_and(|&last| times[found.len()] <= last) {
            found.push(before + block.partition_point(|&time| time < times[found.len()]));
        }
        before += block.len();
    }
    // Events past the last sample of an unfinished file.
    found.resize(times.len(), before);
    Ok(found)
}
