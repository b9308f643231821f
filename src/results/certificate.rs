//! /certificate, /sensitivity and /events/time_uncertainty: what `certify` adds to a result file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use hdf5::{Group, H5Type};
use serde::{Deserialize, Serialize};

use super::attributes::{describe, write_codes, write_number_attribute, write_text_attribute};
use super::schema;
use super::table::create_group;
use super::target::{self, Overwrite};
use super::{ResultError, checksums, raw, source};

/// What is added, in the form in which it is stored: tables of equal columns.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CertificateTables {
    /// One for each event, s; NaN where the event is not converged.
    pub time_uncertainty: Vec<f64>,
    /// One for each event: code of its verdict.
    pub verdict: Vec<i8>,
    /// One for each event, by the ladder of methods alone: the uncertainty, s, NaN where it is not converged.
    pub ladder_uncertainty: Vec<f64>,
    /// One for each event: code of the verdict by the ladder alone.
    pub ladder_verdict: Vec<i8>,
    /// One for each event, with the oracle: its distance from the exact one, own less exact, s; NaN where that has none.
    pub true_error: Option<Vec<f64>>,
    /// (code, name) of the verdicts.
    pub verdicts: Vec<schema::Flag>,
    /// One for each event: what rounding can do to its time, s.
    pub rounding: Vec<f64>,
    /// One for each event: e-folds since the loss of stability, NaN before it.
    pub growth: Vec<f64>,
    /// One for each run: method, relative tolerance, events that agree, largest distance (s).
    pub ladder: Vec<(String, f64, i64, f64)>,
    /// Texts that are attributes of /certificate: verdict, and what to do.
    #[serde(borrow)]
    pub texts: Vec<(&'static str, String)>,
    /// Numbers that are attributes of /certificate.
    #[serde(borrow)]
    pub numbers: Vec<(&'static str, f64)>,
    /// One for each stretch between events: start and end (s), code of the mode, uncertainty of the times at its ends (s;
    /// NaN where it is not converged).
    pub stretches: Vec<(f64, f64, i8, f64)>,
    /// (code, name) of the modes.
    pub modes: Vec<schema::Flag>,
    /// Of each channel of the trajectory.
    pub bands: Vec<BandColumns>,
    /// Exact event times, as decimal texts, by the oracle; empty without one.
    pub oracle: String,
    /// (path, unit) of each parameter.
    pub parameters: Vec<(String, String)>,
    /// What half a last digit of each does.
    pub sensitivities: SensitivityTables,
    /// d(event time)/d(parameter), s per unit: a row of all parameters for each event.
    pub sensitivity: Vec<Vec<f64>>,
    /// How far each of these can be off, where that is known.
    pub sensitivity_uncertainty: Option<Vec<Vec<f64>>>,
}

/// What half a unit in the last written digit of each parameter does to a result, such as the final stick: one value for each parameter; of
/// pairs the first is half a unit lower, the second half a unit higher.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SensitivityTables {
    /// In the unit of the parameter; NaN if it is not written as a number.
    pub half_last_digit: Vec<f64>,
    /// How much later, or longer, the result of the rerun is, s; NaN without one.
    pub shift: [Vec<f64>; 2],
    /// What a positive shift says: "how much later the final stick is".
    pub shifts: &'static str,
    /// Code of what the rerun came to, or [`SensitivityTables::NONE`].
    pub outcome: [Vec<i8>; 2],
    /// (code, name) of what a rerun can come to.
    #[serde(borrow)]
    pub outcomes: Vec<(i8, &'static str)>,
    /// Number of sticks of the rerun; -1 without one.
    pub sticks: [Vec<i64>; 2],
    /// 0 linear, 1 nonlinear, or [`SensitivityTables::NONE`].
    pub nonlinear: Vec<i8>,
    /// Texts that are attributes of /sensitivity.
    #[serde(borrow)]
    pub texts: Vec<(&'static str, String)>,
}

impl SensitivityTables {
    /// The code where no rerun was made.
    pub const NONE: i8 = -1;
}

/// The error bands of a channel of the trajectory: one for each stretch, NaN where nothing can be said.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BandColumns {
    /// Of the channel.
    pub name: String,
    /// UDUNITS.
    pub unit: String,
    /// In that unit, at equal phase.
    pub band: Vec<f64>,
    /// Largest rate of change, in that unit per second, by which a band at equal phase becomes one at a fixed time.
    pub rate: Vec<f64>,
}

impl BandColumns {
    fn rate_unit(&self) -> String {
        match self.unit.strip_suffix("s-1") {
            Some(rest) => format!("{rest}s-2"),
            None => format!("{} s-1", self.unit),
        }
    }
}

/// Copies a complete result file to `to`, with the certificate in it. `to` appears when it is whole.
///
/// # Errors
/// Those of [`super::check_target`], and any failure to copy or write.
pub fn write_certified(
    from: &Path,
    to: &Path,
    overwrite: Overwrite,
    tables: &CertificateTables,
) -> Result<(), ResultError> {
    target::check_target(to, overwrite, &[from.to_owned()])?;
    let partial: PathBuf = target::partial_path(to);
    let whole = copy_with(from, &partial, tables).and_then(|()| target::rename(&partial, to, overwrite));
    if whole.is_err() {
        // Half a copy would stand in the way of the next.
        let _ = fs::remove_file(&partial);
    }
    whole
}

fn copy_with(from: &Path, partial: &Path, tables: &CertificateTables) -> Result<(), ResultError> {
    fs::copy(from, partial).map_err(|error| ResultError::io(partial, "copying the result", error))?;
    let tables = postcard::to_allocvec(tables).map_err(|error| {
        ResultError::write_detail(partial, false, format!("the certificate cannot be sent: {error}"))
    })?;
    source::change_apart(partial, tables, add_to)?;
    target::save(partial)
}

/// Reads HDF5 files for the program that started this one, and certifies them, if that is what the arguments ask for: to
/// be called before anything else.
pub fn serve_if_asked() -> Option<ExitCode> {
    source::serve_if_asked(add_to)
}

/// Adds an encoded certificate to the file at `path`, where a damaged one does no harm.
fn add_to(path: &Path, tables: &[u8]) -> hdf5::Result<()> {
    // Some of its names are borrowed for ever. It comes once.
    let tables = postcard::from_bytes(Vec::leak(tables.to_vec()))
        .map_err(|error| hdf5::Error::from(format!("the certificate came garbled: {error}")))?;
    let file = hdf5::File::open_rw(path)?;
    // The sums of the values stay those of their writer: damage to the original is found in its copy, too.
    let stored = file.dataset(schema::CHECKSUMS).and_then(|lines| raw::read_text(&lines));
    let known = checksums::known(&stored.ok().flatten().unwrap_or_default());
    add(&file, &tables)?;
    checksums::write(&file, &known)?;
    file.flush()
}

fn add(file: &hdf5::File, tables: &CertificateTables) -> hdf5::Result<()> {
    for name in [schema::group::CERTIFICATE, schema::group::SENSITIVITY] {
        if file.link_exists(name) {
            file.unlink(name)?;
        }
    }
    let events = file.group(schema::group::EVENTS)?;
    if events.link_exists(schema::TIME_UNCERTAINTY) {
        events.unlink(schema::TIME_UNCERTAINTY)?;
    }
    let event = Dimension {
        scale: events.dataset("event")?,
        group: events,
    };
    event.column(
        schema::TIME_UNCERTAINTY,
        &tables.time_uncertainty,
        "s",
        "how far from the exact solution of the stated model the event can be; NaN: not converged",
    )?;
    certificate(&create_group(file, schema::group::CERTIFICATE)?, tables)?;
    sensitivity(&create_group(file, schema::group::SENSITIVITY)?, tables)
}

fn certificate(group: &Group, tables: &CertificateTables) -> hdf5::Result<()> {
    for (name, text) in &tables.texts {
        write_text_attribute(group, name, text)?;
    }
    for (name, number) in &tables.numbers {
        write_number_attribute(group, name, *number)?;
    }
    let event = Dimension::new(group, "event", tables.verdict.len(), "index of the event")?;
    for (name, codes, long_name) in [
        ("verdict", &tables.verdict, "what can be said of the event"),
        (
            "ladder_verdict",
            &tables.ladder_verdict,
            "what the ladder of methods alone says of the event",
        ),
    ] {
        event.codes(name, codes, long_name, &tables.verdicts)?;
    }
    event.column(
        "ladder_uncertainty",
        &tables.ladder_uncertainty,
        "s",
        "uncertainty of the event by the ladder of methods alone; NaN: not converged",
    )?;
    if let Some(errors) = &tables.true_error {
        let long_name =
            "distance of the event from that of the oracle, own less exact; NaN: the oracle has none near it";
        event.column("true_error", errors, "s", long_name)?;
    }
    event.column(
        "rounding",
        &tables.rounding,
        "s",
        "how far rounding to double precision, of the input and of the state and the clock at every event before, moves the event",
    )?;
    event.column(
        "growth",
        &tables.growth,
        "1",
        "e-folds by which a deviation has grown from the loss of stability to the event",
    )?;
    let rung = Dimension::new(group, "rung", tables.ladder.len(), "index of the run of the ladder")?;
    let mut names: Vec<&str> = Vec::new();
    let mut codes = Vec::new();
    for (method, ..) in &tables.ladder {
        let known = names.iter().position(|name| name == method);
        codes.push(known.unwrap_or(names.len()) as i8);
        if known.is_none() {
            names.push(method);
        }
    }
    let numbered: Vec<(i8, &str)> = (0..).zip(names).collect();
    rung.codes("rung_method", &codes, "integration method", &numbered)?;
    let list = |f: fn(&(String, f64, i64, f64)) -> f64| tables.ladder.iter().map(f).collect::<Vec<f64>>();
    rung.column("rung_rtol", &list(|row| row.1), "1", "relative tolerance")?;
    let agreeing: Vec<i64> = tables.ladder.iter().map(|row| row.2).collect();
    let long_name = "events of the sequence that agree with the result's, from the first on";
    rung.column("rung_agreeing", &agreeing, "1", long_name)?;
    let long_name = "largest distance to the result over the agreeing events";
    rung.column("rung_distance", &list(|row| row.3), "s", long_name)?;
    bands(group, tables)?;
    if !tables.oracle.is_empty() {
        let oracle = raw::write_text(group, "oracle", &tables.oracle)?;
        let long_name = "exact events by the multiprecision oracle: time (s), kind, states (CSV)";
        describe(&oracle, "1", long_name)?;
    }
    Ok(())
}

fn bands(group: &Group, tables: &CertificateTables) -> hdf5::Result<()> {
    let stretch = Dimension::new(
        group,
        "stretch",
        tables.stretches.len(),
        "index of the stretch: before the event of the same index, the last before the end of the run",
    )?;
    let list = |f: fn(&(f64, f64, i8, f64)) -> f64| tables.stretches.iter().map(f).collect::<Vec<f64>>();
    stretch.column("stretch_start", &list(|row| row.0), "s", "where it starts")?;
    stretch.column("stretch_end", &list(|row| row.1), "s", "where it ends")?;
    let modes: Vec<i8> = tables.stretches.iter().map(|row| row.2).collect();
    stretch.codes("stretch_mode", &modes, "what the contact does in it", &tables.modes)?;
    let long_name = "larger uncertainty of the events at its ends; NaN: not converged";
    stretch.column("stretch_time_uncertainty", &list(|row| row.3), "s", long_name)?;
    for channel in &tables.bands {
        let name = &channel.name;
        let long_name = format!(
            "how far {name} can be from the exact solution at the same share of its own way between the events"
        );
        stretch.column(&format!("band_{name}"), &channel.band, &channel.unit, &long_name)?;
        let long_name =
            format!("largest |d({name})/dt|; times stretch_time_uncertainty, what to add to the band at a fixed time");
        stretch.column(&format!("rate_{name}"), &channel.rate, &channel.rate_unit(), &long_name)?;
    }
    Ok(())
}

fn sensitivity(group: &Group, tables: &CertificateTables) -> hdf5::Result<()> {
    let (rows, columns) = (tables.sensitivity.len(), tables.parameters.len());
    let event = Dimension::new(group, "event", rows, "index of the event")?;
    let parameter = Dimension::new(group, "parameter", columns, "index of the parameter")?;
    let paths: Vec<&str> = tables.parameters.iter().map(|p| p.0.as_str()).collect();
    let units: Vec<&str> = tables.parameters.iter().map(|p| p.1.as_str()).collect();
    write_text_attribute(group, "parameters", &paths.join(", "))?;
    write_text_attribute(group, "parameter_units", &units.join(", "))?;
    let matrix = |name: &str, values: &[Vec<f64>], long_name: &str| {
        let flat: Vec<f64> = values.iter().flatten().copied().collect();
        let table = group.new_dataset::<f64>().shape([rows, columns]).create(name)?;
        table.write_raw(&flat)?;
        describe(&table, "s", long_name)?;
        raw::attach_scale(&table, &event.scale, 0)?;
        raw::attach_scale(&table, &parameter.scale, 1)
    };
    matrix(
        "time_sensitivity",
        &tables.sensitivity,
        "d(event time)/d(parameter), s for each unit of the parameter (attribute parameter_units of the group)",
    )?;
    if let Some(uncertainty) = &tables.sensitivity_uncertainty {
        let long_name = "how far time_sensitivity can be off, in its unit";
        matrix("time_sensitivity_uncertainty", uncertainty, long_name)?;
    }
    result(group, &tables.sensitivities, &parameter)
}

fn result(group: &Group, tables: &SensitivityTables, parameter: &Dimension) -> hdf5::Result<()> {
    for (name, text) in &tables.texts {
        write_text_attribute(group, name, text)?;
    }
    parameter.column(
        "half_last_digit",
        &tables.half_last_digit,
        "1",
        "half a unit in the last written digit, in the unit of the parameter (attribute parameter_units of the group)",
    )?;
    let none = (SensitivityTables::NONE, "not-made");
    let outcomes = [&[none], tables.outcomes.as_slice()].concat();
    for (side, (name, where_to)) in [("minus", "lower"), ("plus", "higher")].into_iter().enumerate() {
        let shifts = format!(
            "{} with the parameter half_last_digit {where_to}, by a run",
            tables.shifts
        );
        parameter.column(&format!("shift_{name}"), &tables.shift[side], "s", &shifts)?;
        let outcome = &tables.outcome[side];
        parameter.codes(&format!("outcome_{name}"), outcome, "what that run came to", &outcomes)?;
        let long_name = "number of sticks of that run; -1 without one";
        parameter.column(&format!("sticks_{name}"), &tables.sticks[side], "1", long_name)?;
    }
    parameter.codes(
        "nonlinear",
        &tables.nonlinear,
        "whether these runs differ from what time_sensitivity says by more than a tenth, or in their events",
        &[(SensitivityTables::NONE, "unknown"), (0, "linear"), (1, "nonlinear")],
    )
}

/// A dimension of a group, whose columns it describes.
struct Dimension {
    group: Group,
    scale: hdf5::Dataset,
}

impl Dimension {
    /// With its coordinate, 0, 1, ...
    fn new(group: &Group, name: &str, length: usize, long_name: &str) -> hdf5::Result<Dimension> {
        let indices: Vec<i32> = (0..length).map(|k| i32::try_from(k).unwrap_or(i32::MAX)).collect();
        let scale = group.new_dataset_builder().with_data(&indices).create(name)?;
        describe(&scale, "1", long_name)?;
        raw::set_scale(&scale, name)?;
        let group = group.clone();
        Ok(Dimension { group, scale })
    }

    fn write<T: H5Type>(&self, name: &str, values: &[T], units: &str, long_name: &str) -> hdf5::Result<hdf5::Dataset> {
        let dataset = self.group.new_dataset_builder().with_data(values).create(name)?;
        describe(&dataset, units, long_name)?;
        raw::attach_scale(&dataset, &self.scale, 0)?;
        Ok(dataset)
    }

    fn column<T: H5Type>(&self, name: &str, values: &[T], units: &str, long_name: &str) -> hdf5::Result<()> {
        self.write(name, values, units, long_name).map(drop)
    }

    fn codes(&self, name: &str, codes: &[i8], long_name: &str, meanings: &[(i8, &str)]) -> hdf5::Result<()> {
        let dataset = self.write(name, codes, "1", long_name)?;
        write_codes(&dataset, meanings.iter().copied())
    }
}
