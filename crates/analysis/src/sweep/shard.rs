//! Shard: one of several parts of a study. The machines that run the parts share only the study.

use super::error::SweepError;
use super::study::{Design, Study};
use std::fmt;
use stickslip_files::{Partition, ShardPlan};
use stickslip_system::quote::shown;

/// Shard `index` (from 1) of `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Shard {
    index: usize,
    count: usize,
}

/// Largest number of shards; more are a mistake. Slurm's arrays end at 4,000,001.
const MOST_SHARDS: usize = 10_000_000;

impl Shard {
    /// Shard `index` of `count`; `None` unless 1 <= `index` <= `count` <= 10,000,000.
    pub fn new(index: usize, count: usize) -> Option<Self> {
        ((1..=count).contains(&index) && count <= MOST_SHARDS).then_some(Shard { index, count })
    }

    /// Reads `K/N`, or `slurm` for a task of a job array: K is the position in the array, N its size.
    ///
    /// # Errors
    /// The text has another form; the error gives the expected one.
    pub fn parse(text: &str, variable: &dyn Fn(&str) -> Option<String>) -> Result<Self, String> {
        if text == "slurm" {
            return Self::of_slurm(variable);
        }
        let pair = text
            .split_once('/')
            .and_then(|(index, count)| Some((index.trim().parse().ok()?, count.trim().parse().ok()?)));
        match pair {
            Some((index, count)) => Shard::new(index, count).ok_or_else(|| {
                format!(
                    "\"{text}\" is no shard: K/N with K from 1 to N, N at most {MOST_SHARDS}",
                    text = shown(text)
                )
            }),
            None => Err(format!(
                "\"{text}\" is no shard: write K/N, such as 3/8 for the third of eight, or slurm in the task of a job array",
                text = shown(text)
            )),
        }
    }

    fn of_slurm(variable: &dyn Fn(&str) -> Option<String>) -> Result<Self, String> {
        let number = |name: &str| -> Result<Option<usize>, String> {
            match variable(name) {
                None => Ok(None),
                Some(text) => match text.trim().parse() {
                    Ok(number) => Ok(Some(number)),
                    Err(_) => Err(format!(
                        "slurm: {name} is \"{text}\", not a whole number; give the shard as K/N",
                        text = shown(&text)
                    )),
                },
            }
        };
        let needed = |name: &str| {
            number(name)?.ok_or_else(|| {
                format!("slurm: {name} is not set, so this is no task of a Slurm job array; submit with sbatch --array, or give the shard as K/N")
            })
        };
        let task = needed("SLURM_ARRAY_TASK_ID")?;
        let (first, last) = (needed("SLURM_ARRAY_TASK_MIN")?, needed("SLURM_ARRAY_TASK_MAX")?);
        let count = needed("SLURM_ARRAY_TASK_COUNT")?;
        let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
        // An array of selected numbers, such as the failed tasks of another array, does not determine the shards.
        let even = last.checked_sub(first).is_some_and(|range| range / step + 1 == count);
        let place = task.checked_sub(first).filter(|place| even && place % step == 0);
        place
            .and_then(|place| Shard::new(place / step + 1, count))
            .ok_or_else(|| {
                format!("slurm: the {count} tasks of this array are not {first} to {last} in even steps, so the shard of task {task} is not clear; submit an array such as 1-{count}, or give the shard as K/N")
            })
    }

    /// Index, from 1.
    pub fn index(self) -> usize {
        self.index
    }

    /// Number of shards.
    pub fn count(self) -> usize {
        self.count
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} of {}", self.index, self.count)
    }
}

const BOUNDARY: &str = "the study traces a boundary: which points it needs depends on the results of the others, so it cannot \
     be split into shards; sweep it as one job on many threads (-j), on many machines by an executor of Python, or as \
                        one study for each value of its other axes";

/// Fails if the study has no numbered points, or fewer points than shards.
pub(super) fn plan(study: &Study, shard: Shard) -> Result<ShardPlan, SweepError> {
    let points = study.point_count();
    let points = points.ok_or_else(|| SweepError::Refused(BOUNDARY.to_owned()))?;
    if points < shard.count() as u64 {
        let count = shard.count();
        let why = format!("the study has {points} points, too few for {count} shards; use at most {points}");
        return Err(SweepError::Refused(why));
    }
    let shape: Vec<usize> = match study.design {
        Design::Grid => study.axes.iter().map(|axis| axis.levels.len()).collect(),
        _ => vec![points as usize],
    };
    Ok(ShardPlan {
        shard: shard.index() - 1,
        partition: Partition::new(&shape, shard.count()),
        layout: study.layout(),
    })
}
