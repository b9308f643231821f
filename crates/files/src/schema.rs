//! Definition of result files: names, units, descriptions, codes, dimensions.
//!
//! Every table is a group with one extendable dimension, named by its coordinate variable; its columns are datasets
//! over that dimension. Units are UDUNITS; codes are int8 with CF's `flag_values` and `flag_meanings`.

use stickslip_system::model::Mode;
use stickslip_system::numerics::chebyshev::COEFFICIENTS;
use stickslip_system::record::{EventKind, RecordedChannel, State, channel};

/// Root attribute `format` of every result file.
pub const FORMAT: &str = "stickslip-result";
/// Root attribute `format` of the file of a work-precision study.
pub const WORK_PRECISION_FORMAT: &str = "stickslip-work-precision";
/// Formats of this program, each with the hint for a command that wants the result of a run.
pub(crate) const FORMATS: [(&str, &str); 5] = [
    (FORMAT, ""),
    (
        WORK_PRECISION_FORMAT,
        "holds a work-precision study, not the result of a run; `stickslip inspect` lists it, `stickslip plot` draws it, and \
         `stickslip run` writes results",
    ),
    (
        SWEEP_FORMAT,
        "holds the many runs of a sweep, not the result of one; `stickslip inspect` lists it, `stickslip plot` draws it, \
         and with trajectory = true in [keep] a study leaves a result file of each run",
    ),
    (
        SWEEP_SHARD_FORMAT,
        "holds a part of a sweep; put the parts together with `stickslip merge`",
    ),
    (
        CONTINUATION_FORMAT,
        "holds the branches of a continuation, not the result of a run; `stickslip inspect` lists it, `stickslip plot` draws it, and \
         `stickslip cycle FILE --branch B --point K` runs a cycle of it",
    ),
];

/// The hint of [`FORMATS`] for a format of this program.
pub(crate) fn own_format(format: Option<&str>) -> Option<&'static str> {
    FORMATS.iter().find(|own| format == Some(own.0)).map(|own| own.1)
}

/// Root attribute `format` of the file of a continuation.
pub const CONTINUATION_FORMAT: &str = "stickslip-continuation";
/// Root attribute `format` of the file of a sweep.
pub const SWEEP_FORMAT: &str = "stickslip-sweep";
/// Root attribute `format` of the file of a part of a sweep.
pub const SWEEP_SHARD_FORMAT: &str = "stickslip-sweep-shard";
/// Root attribute `format_version`, raised by changes that old readers would misread.
pub const FORMAT_VERSION: i32 = 1;
pub(crate) const CONVENTIONS: &str = "CF-1.11";

/// Names of root attributes.
pub mod root {
    pub(crate) const CONVENTIONS: &str = "Conventions";
    /// Title of the case or the study.
    pub const TITLE: &str = "title";
    /// The program that made the file, with its version.
    pub const SOURCE: &str = "source";
    /// Commands that made the file, each with the time of day.
    pub const HISTORY: &str = "history";
    /// Publications of the equations.
    pub const REFERENCES: &str = "references";
    /// Name of the format.
    pub const FORMAT: &str = "format";
    /// Version of the format.
    pub const FORMAT_VERSION: &str = "format_version";
    /// complete, interrupted or failed.
    pub const STATUS: &str = "status";
    pub(crate) const FAILURE: &str = "failure";
}

/// Names of groups.
pub mod group {
    /// Samples of every channel.
    pub const TRAJECTORY: &str = "trajectory";
    /// One row for each event.
    pub const EVENTS: &str = "events";
    /// One row for each smooth stretch between two events.
    pub const SEGMENTS: &str = "segments";
    /// Summary of the run: counts, periods, losses.
    pub const STICK_SLIP: &str = "stick_slip";
    /// Only in certified files, like [`SENSITIVITY`].
    pub const CERTIFICATE: &str = "certificate";
    /// Derivatives of the events by the case's parameters.
    pub const SENSITIVITY: &str = "sensitivity";
    /// Only if a witness was run.
    pub const WITNESS: &str = "witness";
    /// Only in the file of one period of a cycle.
    pub const CYCLE: &str = "cycle";
    /// Only in the certified file of a cycle.
    pub const CYCLE_CERTIFICATE: &str = "cycle_certificate";
    pub(crate) const INPUT: &str = "input";
    /// Program, machine and command that made the file.
    pub const META: &str = "meta";
    /// The runs of a work-precision study.
    pub const RUNS: &str = "runs";
    pub(crate) const DENSE: &str = "dense";
    pub(crate) const DENSE_COEFFICIENTS: &str = "dense/coefficients";
    /// The reference of a work-precision study.
    pub const REFERENCE: &str = "reference";
}

/// Column of /events in certified files.
pub const TIME_UNCERTAINTY: &str = "time_uncertainty";

/// Column of /events if a witness was run.
pub const WITNESS_TIME: &str = "witness_time";

/// Text of /input: the case as it was given, as TOML.
pub const INPUT_CASE: &str = "case";
/// Text of /input: every parameter in SI, as TOML.
pub const INPUT_RESOLVED: &str = "resolved";
/// Text of /input, only in a run that was repeated with finer settings: every parameter as asked for, as TOML.
pub(crate) const INPUT_ASKED: &str = "asked";
/// Attribute of /input, only if the case was changed: a line for each override, such as `friction.decay = 4 s/rad`.
pub const INPUT_CHANGED: &str = "changed";
/// Checksums in files of earlier versions, now ignored.
pub(crate) const CHECKSUMS: &str = "meta/checksums";
/// Name of such a variable, also next to the columns of studies.
pub(crate) const SUMS: &str = "checksums";
/// Attribute of /meta added by the writer: seconds from creation to the end, NaN until then.
pub(crate) const META_WALL_TIME: &str = "wall_time_s";

/// Attribute of /meta in a run of two trains: kind of coordinates.
pub const META_MOTION: &str = "motion";
/// Value of `motion` if metres replace radians.
pub(crate) const TRANSLATION: &str = "translation";

/// Attribute of /meta in a sweep: command for a single point, without its axis values.
pub const META_POINT_COMMAND: &str = "point_command";
/// Attribute of /meta in a sweep: quantities to show, separated by blanks.
pub const META_SHOW: &str = "show";

/// Names of the attributes of a variable.
pub mod attribute {
    /// Unit in UDUNITS.
    pub const UNITS: &str = "units";
    pub(crate) const CLASS: &str = "CLASS";
    pub(crate) const FILL_VALUE: &str = "_FillValue";
    pub(crate) const LONG_NAME: &str = "long_name";
    pub(crate) const FLAG_VALUES: &str = "flag_values";
    pub(crate) const FLAG_MEANINGS: &str = "flag_meanings";
    /// Suffix of the attribute with the unit of a quantity.
    pub const UNITS_SUFFIX: &str = "_units";
    /// Suffix of the attribute with the description of a quantity.
    pub const LONG_NAME_SUFFIX: &str = "_long_name";
}

/// Value of `CLASS` for a coordinate variable.
pub(crate) const SCALE: &str = "DIMENSION_SCALE";

const LONG_CHUNK: usize = 4096;
/// Rows in a chunk of a table that is no trajectory: few, since an unfinished chunk is stored anew at each flush.
pub(crate) const SHORT_CHUNK: usize = 64;

/// Storage type of a column, always little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StorageKind {
    /// Codes.
    Int8,
    /// Indices.
    Int32,
    /// Counts.
    Int64,
    /// Quantities.
    Float64,
}

impl StorageKind {
    /// Name in NumPy.
    pub fn name(self) -> &'static str {
        match self {
            StorageKind::Int8 => "int8",
            StorageKind::Int32 => "int32",
            StorageKind::Int64 => "int64",
            StorageKind::Float64 => "float64",
        }
    }
}

/// The meaning of a code.
pub type CodeMeaning = (i8, &'static str);

/// One variable of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name in the group.
    pub name: String,
    /// Type of the values.
    pub kind: StorageKind,
    /// UDUNITS unit; "1" for a pure number.
    pub units: String,
    /// Description.
    pub long_name: String,
    /// Meanings of codes; empty if there are none.
    pub flags: Vec<(i64, String)>,
    /// Fill value of some counts.
    pub fill: Option<i64>,
}

impl Variable {
    pub(super) fn new(name: &str, kind: StorageKind, units: &str, long_name: &str) -> Self {
        Variable {
            name: name.to_owned(),
            kind,
            units: units.to_owned(),
            long_name: long_name.to_owned(),
            flags: Vec::new(),
            fill: None,
        }
    }

    /// A column of doubles.
    pub fn quantity(name: &str, units: &str, long_name: &str) -> Self {
        Variable::new(name, StorageKind::Float64, units, long_name)
    }

    fn of_channel(channel: &RecordedChannel) -> Self {
        Variable::quantity(channel.name, channel.unit, channel.long_name)
    }

    fn seconds(name: &str, long_name: &str) -> Self {
        Variable::quantity(name, "s", long_name)
    }

    /// A column of codes with constant words.
    pub fn code(name: &str, long_name: &str, flags: &[CodeMeaning]) -> Self {
        let flags = flags.iter().map(|&(code, word)| (i64::from(code), word.to_owned()));
        Variable::words(name, long_name, flags.collect())
    }

    /// A column of codes with their words.
    pub fn words(name: &str, long_name: &str, flags: Vec<(i64, String)>) -> Self {
        Variable {
            flags,
            ..Variable::new(name, StorageKind::Int8, "1", long_name)
        }
    }

    /// A column of integers.
    pub fn count(name: &str, long_name: &str) -> Self {
        Variable::new(name, StorageKind::Int64, "1", long_name)
    }

    /// Name and unit, as in the header of a table.
    pub fn header(&self) -> String {
        match self.units.as_str() {
            "" | "1" => self.name.clone(),
            units => format!("{} [{units}]", self.name),
        }
    }

    /// The word of a code, or the code itself if it has no word.
    pub fn word(&self, code: i64) -> String {
        let known = self.flags.iter().find(|(known, _)| *known == code);
        known.map_or_else(|| code.to_string(), |(_, word)| word.clone())
    }

    /// A column of indices.
    pub fn index(name: &str, long_name: &str) -> Self {
        Variable::new(name, StorageKind::Int32, "1", long_name)
    }
}

/// A group of columns over one dimension, whose coordinate is the first variable and has its name.
#[derive(Debug, Clone, PartialEq)]
pub struct TableSchema {
    /// Group of the variables.
    pub group: &'static str,
    /// Rows in a chunk, and in the buffer.
    pub chunk: usize,
    /// Variables of equal length.
    pub variables: Vec<Variable>,
}

impl TableSchema {
    pub(super) fn new(group: &'static str, chunk: usize, variables: Vec<Variable>) -> Self {
        TableSchema {
            group,
            chunk,
            variables,
        }
    }
}

/// Codes of `mode` and `mode_after`. Only the contact of trains may be engaged.
pub(crate) fn mode_flags(trains: bool) -> Vec<CodeMeaning> {
    let modes = Mode::ALL.iter().filter(|&&mode| mode != Mode::Engaged);
    let modes = modes.chain(trains.then_some(&Mode::Engaged));
    modes.map(|mode| (mode.code(), mode.name())).collect()
}

/// Codes of the kinds of events.
pub fn kind_flags() -> Vec<CodeMeaning> {
    EventKind::ALL.iter().map(|kind| (kind.code(), kind.name())).collect()
}

/// Codes of `sense`: the sign of the relative velocity in slip.
const SENSES: [CodeMeaning; 3] = [(-1, "backward"), (0, "none"), (1, "forward")];

/// Codes of `solver`; -1 for a solver without a name here.
pub(crate) const SOLVERS: [CodeMeaning; 9] = [
    (-1, "other"),
    (0, "cvode-bdf"),
    (1, "cvode-adams"),
    (2, "erk"),
    (3, "esdirk"),
    (4, "closed-form"),
    (5, "series"),
    (6, "paper"),
    (7, "rk4"),
];

/// /trajectory: a row for each sample.
pub fn trajectory() -> TableSchema {
    let mut variables = vec![
        Variable::seconds("time", "time"),
        Variable::code("mode", "what the contact does", &mode_flags(false)),
        Variable::index("segment", "index of the segment that holds the sample"),
    ];
    variables.extend(channel::all().map(Variable::of_channel));
    TableSchema::new(group::TRAJECTORY, LONG_CHUNK, variables)
}

/// /events: a row for each event, with the states before and after.
pub fn events() -> TableSchema {
    let mut variables = vec![
        Variable::index("event", "index of the event"),
        Variable::seconds("time", "time"),
        Variable::code("kind", "what happened", &kind_flags()),
        Variable::code(
            "mode_after",
            "what the contact does after the event",
            &mode_flags(false),
        ),
        Variable::code(
            "sense",
            "sign of the relative velocity in slip after the event",
            &SENSES,
        ),
        Variable::index("segment", "index of the segment that the event ends or stands in"),
    ];
    for side in ["before", "after"] {
        variables.extend(State::CHANNELS.iter().map(|state| {
            let long_name = format!("{}, {side} the event", state.long_name);
            Variable::quantity(&format!("{}_{side}", state.name), state.unit, &long_name)
        }));
    }
    let long_name = "internal force T_f/r just before the event";
    variables.push(Variable::quantity("internal_force", "N", long_name));
    TableSchema::new(group::EVENTS, SHORT_CHUNK, variables)
}

/// /segments: a row for each stretch integrated without a restart, with its cost.
pub fn segments() -> TableSchema {
    let variables = vec![
        Variable::index("segment", "index of the segment"),
        Variable::seconds("start", "time of the segment's start"),
        Variable::seconds("end", "time of the segment's end"),
        Variable::code("mode", "what the contact does", &mode_flags(false)),
        Variable::code("solver", "what integrated the segment", &SOLVERS),
        Variable::count("steps", "steps of the integrator"),
        Variable::count("rhs_evaluations", "evaluations of the right-hand side"),
        Variable::count("jacobian_evaluations", "evaluations of the Jacobian"),
        Variable::count("linear_solver_setups", "setups of the linear solver"),
        Variable::count("error_test_failures", "steps that failed the error test"),
        Variable::count("nonlinear_iterations", "iterations of the nonlinear solver"),
        Variable::count(
            "nonlinear_convergence_failures",
            "failures of the nonlinear solver to converge",
        ),
        Variable::count("root_evaluations", "evaluations of the guards"),
        Variable::index("last_order", "order of the last step, 0 where it has no meaning"),
        Variable::seconds("last_step", "last step"),
    ];
    TableSchema::new(group::SEGMENTS, SHORT_CHUNK, variables)
}

/// /stick_slip: a row for each cycle, a stick and the slip after it.
pub fn stick_slip() -> TableSchema {
    let variables = vec![
        Variable::index("cycle", "index of the cycle"),
        Variable::seconds("stick_duration", "duration of the cycle's stick"),
        Variable::seconds("slip_duration", "duration of the cycle's slip"),
        Variable::seconds("period", "time from the cycle's stick to the next"),
    ];
    TableSchema::new(group::STICK_SLIP, SHORT_CHUNK, variables)
}

/// Every table, in the order of the file.
pub fn tables() -> [TableSchema; 4] {
    [trajectory(), events(), segments(), stick_slip()]
}

/// Additions of some cases to the tables.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Extension {
    /// Further columns of /trajectory, and twice (before, after) of /events: name, whether it is a speed, description.
    pub further: Vec<(String, bool, String)>,
    /// Whether the case numbers its parts: some columns are then described in the words of chains.
    pub numbers_parts: bool,
    /// Whether the case is a translation: metres and forces replace radians and torques.
    pub translation: bool,
    /// Whether the motion is also stored as polynomials.
    pub dense: bool,
}

/// Tables of the dense output. The second has [`COEFFICIENTS`] rows for each piece, and a column for each channel that
/// is no product of others.
pub(crate) fn dense_tables(trajectory: &TableSchema) -> [TableSchema; 2] {
    let of_trajectory = |name: &str| trajectory.variables.iter().find(|variable| variable.name == name);
    let mut pieces = vec![
        Variable::index("piece", "index of the piece"),
        Variable::seconds("start", "time of the piece's start, a"),
        Variable::seconds("end", "time of the piece's end, b"),
    ];
    pieces.extend(of_trajectory("mode").cloned());
    pieces.push(Variable::index("segment", "index of the segment that holds the piece"));
    let coefficient = "index of the coefficient: piece times 16 plus the degree j of T_j(x), x = (2 t - a - b)/(b - a)";
    let mut coefficients = vec![Variable::index("coefficient", coefficient)];
    for variable in channels(trajectory).filter(|variable| channel::factors(&variable.name).is_none()) {
        let long_name = format!("Chebyshev coefficients of {}", variable.name);
        coefficients.push(Variable::quantity(&variable.name, &variable.units, &long_name));
    }
    [
        TableSchema::new(group::DENSE, LONG_CHUNK / COEFFICIENTS, pieces),
        TableSchema::new(group::DENSE_COEFFICIENTS, LONG_CHUNK, coefficients),
    ]
}

pub(super) fn all_tables(extension: &Extension) -> Vec<TableSchema> {
    let tables = extended_tables(extension);
    let dense = extension.dense.then(|| dense_tables(&tables[0]));
    tables.into_iter().chain(dense.into_iter().flatten()).collect()
}

/// Channels of a trajectory: all columns except time, mode and segment.
pub fn channels(trajectory: &TableSchema) -> impl Iterator<Item = &Variable> {
    trajectory
        .variables
        .iter()
        .filter(|variable| variable.kind == StorageKind::Float64 && variable.name != "time")
}

/// Every table with an extension, in the order of the file.
pub fn extended_tables(extension: &Extension) -> [TableSchema; 4] {
    let mut tables = tables();
    let [trajectory, events, ..] = &mut tables;
    let further = |suffix: &str, remark: &str| -> Vec<Variable> {
        let column = |(name, is_rate, long_name): &(String, bool, String)| {
            let units = if *is_rate { "rad s-1" } else { "rad" };
            Variable::quantity(&format!("{name}{suffix}"), units, &format!("{long_name}{remark}"))
        };
        extension.further.iter().map(column).collect()
    };
    trajectory.variables.extend(further("", ""));
    events.variables.extend(further("_before", ", before the event"));
    events.variables.extend(further("_after", ", after the event"));
    if extension.numbers_parts {
        for variable in &mut trajectory.variables {
            let of_trains = channel::find(&variable.name).map_or("", |channel| channel.of_trains);
            if !of_trains.is_empty() {
                of_trains.clone_into(&mut variable.long_name);
            }
        }
        let modes = Variable::code("mode", "", &mode_flags(true)).flags;
        for variable in tables.iter_mut().flat_map(|table| &mut table.variables) {
            if ["mode", "mode_after"].contains(&variable.name.as_str()) {
                variable.flags.clone_from(&modes);
            }
        }
    }
    if extension.translation {
        for variable in tables.iter_mut().flat_map(|table| &mut table.variables) {
            let units = match variable.units.as_str() {
                "rad" => "m",
                "rad s-1" => "m s-1",
                "N m" => "N",
                units => units,
            };
            variable.units = units.to_owned();
            for (angular, linear) in [
                ("rotor angle", "rotor position"),
                ("surface angle", "surface position"),
                ("torque", "force"),
            ] {
                variable.long_name = variable.long_name.replace(angular, linear);
            }
        }
    }
    tables
}
