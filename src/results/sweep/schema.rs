//! The names in a sweep file, and what one is made of.

use super::partition::Partition;
use crate::results::AttributeValue;
use crate::results::schema::{self, Table, Variable};

/// Points that are buffered before they are written, at least; also the size of a chunk.
pub(super) const BLOCK: usize = 16_384;
/// Name of the variable that says what came of a point.
pub(super) const POINT_STATUS: &str = "status";
/// Codes of [`POINT_STATUS`].
pub(super) const POINT_STATUSES: [(i8, &str); 3] = [(0, "complete"), (1, "failed"), (2, "missing")];
/// The dimension of a table of points.
pub(super) const POINT: &str = "point";
/// Groups of a sweep file, and what they count.
pub(super) const FAILURES: (&str, &str) = ("failures", "failure");
pub(super) const EVENTS: (&str, &str) = ("events", "event");
/// The study as given, in /input.
pub(super) const INPUT_STUDY: &str = "study";
/// The base case with what the study sets, in /input.
pub(super) const INPUT_CASE: &str = "case";
/// Root attribute with the digest of the study.
pub(super) const DIGEST: &str = "study_digest";

/// What a sweep file says about its study.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct SweepHeader {
    /// Root attribute `title`.
    pub title: String,
    /// The program that computed it, with its version; root attribute `source`.
    pub source: String,
    /// Where the model is published; root attribute `references`.
    pub references: String,
    /// Root attribute `history`. Without a time, so that the same study gives the same file.
    pub history: String,
    /// Identifies the study.
    pub digest: String,
    /// The study's TOML text as given.
    pub study_text: String,
    /// The text of the base case, as TOML.
    pub case_text: String,
    /// Attributes of /meta.
    pub meta: Vec<(String, AttributeValue)>,
}

/// One axis: a dimension of a grid, or a column of a table of points. Where its values are words, they are codes in the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SweepAxis {
    pub variable: Variable,
    /// The keys it sets, separated by blanks.
    pub keys: String,
    /// The coordinates of a grid (codes where there are words); empty for a column.
    pub values: Vec<f64>,
}

impl SweepAxis {
    /// An axis whose values are numbers, or, if there are any, these words.
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

/// In what words the events of a study are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct EventForm {
    /// The cases number their parts; their contact may be engaged.
    pub numbers_parts: bool,
    /// Metres for radians.
    pub translation: bool,
}

impl EventForm {
    /// The table of the events of all points, one point after the other.
    pub(super) fn table(self) -> Table {
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
        Table::new(group, BLOCK, variables)
    }
}

/// How the points lie in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SweepLayout {
    /// Every variable has the axes as dimensions; the last runs fastest.
    Grid,
    /// The axes are columns over the dimension `point`.
    Table,
}

/// How large a sweep file is and what stands in it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SweepPlan {
    pub layout: SweepLayout,
    pub axes: Vec<SweepAxis>,
    /// Counts with [`Variable::fill`] for nothing, and quantities with NaN.
    pub variables: Vec<Variable>,
    /// How many points there are.
    pub points: usize,
    /// Where the events of the points are kept: in what words.
    pub events: Option<EventForm>,
    /// Where the file holds a shard of the study and not the whole: which. Its points lie in a table.
    pub shard: Option<ShardPlan>,
}

/// One event of a point: time (s), codes of kind and of the mode after it, relative velocity (rad/s), internal force (N).
pub(crate) type SweepCell = [f64; 5];

/// What a sweep file holds of one point.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct SweepRow {
    pub number: u64,
    /// Values on the axes of a table; empty in a grid.
    pub coordinates: Vec<f64>,
    /// One for each variable (NaN for nothing); `None` where the point failed or is missing.
    pub values: Option<Vec<f64>>,
    /// Why it failed.
    pub failure: Option<String>,
    pub events: Vec<SweepCell>,
}

impl ShardPlan {
    /// Whether a point of the study is in it.
    pub fn holds(&self, number: u64) -> bool {
        self.partition.owner(number as usize) == self.shard
    }

    /// How many points it has.
    pub fn points(&self) -> usize {
        self.partition.size(self.shard)
    }
}

/// Which part of a study the file of a shard holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ShardPlan {
    /// Counted from 0.
    pub shard: usize,
    pub partition: Partition,
    /// Of the file of the whole study.
    pub layout: SweepLayout,
}
