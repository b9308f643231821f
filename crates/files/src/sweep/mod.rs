//! Files of sweeps and their shards.
//!
//! | module | contents |
//! |---|---|
//! | this file | names and plan of a sweep file, distribution of points among shards |
//! | `writer` | writer of both |
//! | `shard` | reader of shard files |
//! | `merge` | shards merged into one file |

mod merge;
mod shard;
mod writer;

use crate::schema::{self, TableSchema, Variable};

pub use merge::{MergeReport, merge};
pub use shard::ShardFile;
pub use writer::SweepWriter;

/// Smallest number of buffered points, and the number of points in a chunk.
const BLOCK: usize = 16_384;
const POINT_STATUS: &str = "status";
const POINT_STATUSES: [(i8, &str); 3] = [(0, "complete"), (1, "failed"), (2, "missing")];
pub(crate) const POINT: &str = "point";
pub(crate) const FAILURES: (&str, &str) = ("failures", "failure");
const EVENTS: (&str, &str) = ("events", "event");
pub(crate) const AXES_GROUP: &str = "axes";

/// An axis: a dimension of a grid, or a column of a table. Words are stored as codes.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepAxis {
    /// Name, unit and description of its coordinates.
    pub variable: Variable,
    /// Keys of the axis, separated by blanks.
    pub keys: String,
    /// Coordinates in a grid (codes for words); empty for a column.
    pub values: Vec<f64>,
}

impl SweepAxis {
    /// An axis of numbers or, unless `words` is empty, of these words.
    pub fn new(name: &str, keys: String, units: &str, long_name: &str, words: &[String], values: Vec<f64>) -> Self {
        let mut variable = match words {
            [] => Variable::quantity(name, units, long_name),
            _ => Variable::index(name, long_name),
        };
        let words = words.iter().map(|word| word.replace(char::is_whitespace, "_"));
        variable.flags = (0..).zip(words).collect();
        SweepAxis { variable, keys, values }
    }
}

/// Wording for a study's events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EventForm {
    /// Whether cases number their bodies. The contact may then be engaged.
    pub numbers_parts: bool,
    /// Whether metres replace radians.
    pub translation: bool,
}

impl EventForm {
    fn table(self) -> TableSchema {
        let speed = if self.translation { "m s-1" } else { "rad s-1" };
        let (group, dimension) = EVENTS;
        let number = Variable::quantity;
        let variables = vec![
            Variable::count(dimension, "index of the event"),
            Variable::count(POINT, "number of the point that the event belongs to"),
            number("time", "s", "time of the event"),
            Variable::code("kind", "what happened", &schema::kind_flags()),
            Variable::code(
                "mode_after",
                "mode after the event",
                &schema::mode_flags(self.numbers_parts),
            ),
            number("relative_velocity", speed, "relative velocity omega_r before the event"),
            number("internal_force", "N", "T_f / r just before the event"),
        ];
        TableSchema::new(group, BLOCK, variables)
    }
}

/// Arrangement of the points in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SweepLayout {
    /// Every variable has the axes as dimensions, the last one fastest.
    Grid,
    /// The axes are columns over the dimension `point`.
    Table,
}

/// Size and contents of a sweep file.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    /// A grid or a table of points.
    pub layout: SweepLayout,
    /// The axes; in a grid, the last runs fastest.
    pub axes: Vec<SweepAxis>,
    /// One variable per quantity. Missing values are [`Variable::fill`] in counts and NaN in quantities.
    pub variables: Vec<Variable>,
    /// Number of points.
    pub points: usize,
    /// Wording of the events, if they are kept.
    pub events: Option<EventForm>,
    /// The shard, if the file holds one instead of the whole study. Its points form a table.
    pub shard: Option<ShardPlan>,
}

/// An event of a point: time (s), codes of its kind and of the mode after it, relative velocity (rad/s), internal
/// force (N).
pub type SweepEvent = [f64; 5];

/// A point of a sweep file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepRow {
    /// Number of the point in the study, from 0.
    pub number: u64,
    /// Values on the axes of a table; empty in a grid.
    pub coordinates: Vec<f64>,
    /// A value for each variable, NaN if missing; `None` if the point failed or is missing.
    pub values: Option<Vec<f64>>,
    /// Message of a failed point.
    pub failure: Option<String>,
    /// Events of the point; empty if they are not kept.
    pub events: Vec<SweepEvent>,
}

impl ShardPlan {
    /// Whether the shard contains a point of the study.
    pub fn holds(&self, number: u64) -> bool {
        self.partition.owner(number as usize) == self.shard
    }

    /// Number of points in the shard.
    pub fn points(&self) -> usize {
        self.partition.size(self.shard)
    }
}

/// Part of a study in a shard's file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShardPlan {
    /// Index of the shard, from 0.
    pub shard: usize,
    /// Division of the study's points into shards.
    pub partition: Partition,
    /// Layout of the whole study.
    pub layout: SweepLayout,
}

/// Distribution of a study's points among shards.
///
/// Point n goes to shard n mod N, as cards are dealt. In a grid this pattern can repeat after some rows (lines along
/// the last axis), so that one value of an axis, such as a slow method, would always go to the same shard. The
/// dealing then shifts by one shard.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition {
    shape: Vec<usize>,
    shards: usize,
    row: usize,
    /// Number of points after which the dealing would repeat: whole rows, and equally many points for every shard.
    cycle: usize,
}

impl Partition {
    /// Divides the points of a grid with these axis lengths, or of a table with this many rows, into `shards` parts.
    /// All numbers must be at least 1.
    pub fn new(shape: &[usize], shards: usize) -> Self {
        let row = shape.last().copied().unwrap_or(1).max(1);
        let shards = shards.max(1);
        let common = greatest_common_divisor(row, shards);
        Partition {
            shape: shape.to_vec(),
            shards,
            row,
            cycle: (row / common).saturating_mul(shards),
        }
    }

    /// Axis lengths of a grid, or the number of points of a table.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.shape.iter().product()
    }

    /// Number of shards.
    pub fn shards(&self) -> usize {
        self.shards
    }

    /// Shard of a point, from 0.
    pub fn owner(&self, number: usize) -> usize {
        (number % self.shards + number / self.cycle % self.shards) % self.shards
    }

    /// Number of points in a shard.
    pub fn size(&self, shard: usize) -> usize {
        let (rows, rows_of_cycle) = (self.points() / self.row, self.cycle / self.row);
        let cycles = rows / rows_of_cycle;
        let in_row = |row: usize| {
            let first = (shard + self.shards - self.owner(row * self.row)) % self.shards;
            self.row.saturating_sub(first).div_ceil(self.shards)
        };
        let rest: usize = (cycles * rows_of_cycle..rows).map(in_row).sum();
        cycles * (self.cycle / self.shards) + rest
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}
