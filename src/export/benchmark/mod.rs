//! Benchmark packages: a certified run as a folder that can be used and cited without this program. It contains
//! equations, parameters, events, uncertainties, sensitivities and samples, described as a Data Package
//! (Frictionless) and as an RO-Crate.
//!
//! | module | contents |
//! |---|---|
//! | `pages` | the pages for readers, and the script that repeats the run |
//! | `describe` | `parameters.json`, `datapackage.json` and `ro-crate-metadata.json` |

mod describe;
mod pages;

use super::request::{Which, columns};
use super::{ExportTable, formats};
use crate::Error;
use crate::output::Product;
use describe::Resource;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fs;
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use stickslip_analysis::provenance;
use stickslip_case::{Case, CaseSource, Words};
use stickslip_files::schema::{TIME_UNCERTAINTY, Variable, group};
use stickslip_files::{ResultFile, folder_of, open_sound};
use stickslip_system::record::EventKind;

const MARK: &str = "stickslip-benchmark";

/// Names of the two descriptions. The first contains the mark of a package; the second is prescribed for an RO-Crate.
const DATA_PACKAGE: &str = "datapackage.json";
const RO_CRATE: &str = "ro-crate-metadata.json";

/// Author and licence of a package.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Terms {
    /// Author.
    pub author: Option<String>,
    /// SPDX identifier.
    pub license: Option<String>,
}

#[derive(Debug)]
struct About {
    title: String,
    terms: Terms,
    program: String,
    version: String,
    references: String,
    /// Dates of the run and of the package, UTC.
    run: String,
    made: String,
    method: String,
    certified_by: String,
    events: usize,
    certain: usize,
    largest_uncertainty: f64,
    numbers_parts: bool,
    example: bool,
}

/// Writes the package of the certified result at `path` into `folder`. Returns the names of its files, or `None` if
/// `stop` was set before the folder was touched.
///
/// # Errors
/// The result is not certified, the folder exists and is no such package (without `force`), the licence identifier is
/// invalid, or a file cannot be read or written.
pub fn write(
    path: &Path,
    folder: &Path,
    terms: &Terms,
    force: bool,
    stop: &AtomicBool,
) -> Result<Option<Vec<String>>, Error> {
    let file = open_sound(path)?;
    check_terms(terms)?;
    check_folder(folder, force)?;
    let (about, events) = examine(&file, terms)?;
    let failed = |error| Product::Table.failed(folder, "writing the package", error);
    let parent = folder_of(folder);
    let made = tempfile::Builder::new()
        .prefix(".stickslip-")
        .tempdir_in(&parent)
        .map_err(failed)?;
    let resources = fill([made.path(), folder], &file, about, events)?;
    let mut names: Vec<String> = resources.iter().map(|resource| resource.path.to_owned()).collect();
    names.extend([DATA_PACKAGE.to_owned(), RO_CRATE.to_owned()]);
    if stop.load(Ordering::Relaxed) {
        return Ok(None);
    }
    fs::create_dir_all(folder).map_err(failed)?;
    // Files of an earlier package that this one does not contain.
    for stale in OPTIONAL.iter().filter(|name| !names.iter().any(|known| known == *name)) {
        let _ = fs::remove_file(folder.join(stale));
    }
    for name in &names {
        fs::rename(made.path().join(name), folder.join(name)).map_err(failed)?;
    }
    Ok(Some(names))
}

const OPTIONAL: [&str; 3] = ["exact-events.csv", "sensitivities.csv", "example.py"];

fn check_terms(terms: &Terms) -> Result<(), Error> {
    let is_identifier = |text: &str| {
        let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '+');
        !text.is_empty() && text.len() <= 64 && text.chars().all(is_part)
    };
    match &terms.license {
        Some(text) if !is_identifier(text) => Err(Error::input(format!(
            "--license {}: not an SPDX identifier; give one such as CC-BY-4.0 or CC0-1.0",
            stickslip_system::quote::shown(text)
        ))),
        _ => Ok(()),
    }
}

fn check_folder(folder: &Path, force: bool) -> Result<(), Error> {
    let refuse = |what: &str| Err(Error::input(format!("{}: {what}", folder.display())));
    if !folder_of(folder).is_dir() {
        return refuse("the folder that is to hold it does not exist; create it, or choose another with -o");
    }
    let mut entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(_) if folder.exists() => {
            return refuse("a benchmark package is a folder, and this is a file; choose another name with -o");
        }
        Err(_) => return Ok(()),
    };
    let is_own = || {
        let text = fs::read_to_string(folder.join(DATA_PACKAGE));
        text.is_ok_and(|text| text.contains(MARK))
    };
    if force || entries.next().is_none() || is_own() {
        return Ok(());
    }
    refuse("there already, and not a benchmark package; choose another folder with -o, or write into it with --force")
}

fn examine<'a>(file: &'a ResultFile, terms: &Terms) -> Result<(About, ExportTable<'a>), Error> {
    let rows = file.table_rows(group::EVENTS)?;
    let of_events = columns(file, Which::Events)?;
    let path = file.path().display();
    if !of_events.iter().any(|(column, _)| column.name == TIME_UNCERTAINTY) {
        return Err(Error::input(format!(
            "{path}: it has no certificate, and a benchmark needs one; make it with stickslip \
             certify {path} -o NAME.h5, and export that"
        )));
    }
    let uncertainties = file.event_column(TIME_UNCERTAINTY)?;
    let certain = uncertainties.iter().filter(|value| value.is_finite());
    let largest = certain.clone().fold(0.0, |most: f64, value| most.max(*value));
    let certain = certain.count();
    if certain == 0 && rows > 0 {
        let remedy = file.group_text(group::CERTIFICATE, "remedy")?.unwrap_or_default();
        let remedy = if remedy.is_empty() {
            "see what stickslip certify says of it".to_owned()
        } else {
            remedy
        };
        return Err(Error::input(format!(
            "{path}: none of its events is certain by its certificate, so nothing can be compared with it; {remedy}"
        )));
    }
    let of_meta = |name: &str| -> Result<String, Error> { Ok(file.group_text(group::META, name)?.unwrap_or_default()) };
    let source = CaseSource::result(file.path(), file.resolved()?);
    let certified_by = file.group_text(group::CERTIFICATE, "uncertainty_by")?;
    Ok((
        About {
            title: file.title().to_owned(),
            terms: terms.clone(),
            program: provenance::source(),
            version: of_meta("program_version")?,
            references: file.text("references").unwrap_or_default(),
            run: of_meta("started")?,
            made: provenance::now(),
            method: of_meta("method")?,
            certified_by: certified_by.unwrap_or_else(|| "oracle".to_owned()),
            events: rows,
            certain,
            largest_uncertainty: largest,
            numbers_parts: Words::of(&source, &[]).numbers_parts(),
            example: Case::read(&source, &[]).is_ok_and(|case| pages::has_example(&case.system)),
        },
        ExportTable::of_file(group::EVENTS, file, of_events, 0..rows),
    ))
}

fn fill(
    [folder, called]: [&Path; 2],
    file: &ResultFile,
    mut about: About,
    events: ExportTable<'_>,
) -> Result<Vec<Resource>, Error> {
    let mut package = Package {
        folder,
        called,
        resources: Vec::new(),
    };
    // The script applies kicks before the first stick only.
    let found = file.events()?;
    let onset = found.iter().find(|event| event.kind == EventKind::Stick);
    let onset = onset.map_or(f64::INFINITY, |event| event.time);
    about.example &= !found
        .iter()
        .any(|event| event.kind == EventKind::Kick && event.time > onset);
    let rows = file.table_rows(group::TRAJECTORY)?;
    let samples = ExportTable::of_file("samples", file, columns(file, Which::Trajectory)?, 0..rows);

    package.text("case.toml", &file.case_text()?)?;
    package.text("case.resolved.toml", &file.resolved()?)?;
    package.text("parameters.json", &describe::parameters(&file.resolved()?))?;
    package.text("equations.md", &pages::equations(&about))?;
    package.table("events.csv", &events, &["event"])?;
    if let Some(exact) = file.text_variable(group::CERTIFICATE, "oracle")? {
        package.text("exact-events.csv", &exact)?;
    }
    if let Some(table) = sensitivities(file)? {
        package.table("sensitivities.csv", &table, &["event", "parameter"])?;
    }
    package.table("samples.csv", &samples, &["time"])?;
    if about.example {
        package.text("example.py", pages::EXAMPLE)?;
    }
    let readme = pages::readme(&about, &package.resources);
    package.text("README.md", &readme)?;
    let resources = package.resources;
    let described = [
        (DATA_PACKAGE, describe::data_package(&about, &resources)),
        (RO_CRATE, describe::ro_crate(&about, &resources)),
    ];
    for (name, text) in described {
        fs::write(folder.join(name), text)
            .map_err(|error| Product::Table.failed(&called.join(name), "writing", error))?;
    }
    Ok(resources)
}

struct Package<'a> {
    folder: &'a Path,
    called: &'a Path,
    resources: Vec<Resource>,
}

impl Package<'_> {
    fn text(&mut self, name: &'static str, text: &str) -> Result<(), Error> {
        let failed = |error| Product::Table.failed(&self.called.join(name), "writing", error);
        fs::write(self.folder.join(name), text).map_err(failed)?;
        self.add(name, None)
    }

    fn table(&mut self, name: &'static str, table: &ExportTable, key: &[&'static str]) -> Result<(), Error> {
        let called = self.called.join(name);
        let file = fs::File::create(self.folder.join(name));
        let file = file.map_err(|error| Product::Table.failed(&called, "writing", error))?;
        let names = table.columns.iter().map(|column| column.name.clone());
        formats::csv(&formats::csv_line(names), table, file, &called)?;
        self.add(name, Some(describe::schema(&table.columns, key)))
    }

    fn add(&mut self, path: &'static str, schema: Option<Value>) -> Result<(), Error> {
        let failed = |error| Product::Table.failed(&self.called.join(path), "reading", error);
        let (bytes, sha256) = summed(&self.folder.join(path)).map_err(failed)?;
        self.resources.push(Resource {
            path,
            bytes,
            sha256,
            schema,
        });
        Ok(())
    }
}

/// Size and SHA-256 digest of a file.
fn summed(path: &Path) -> io::Result<(u64, String)> {
    let mut reader = BufReader::new(fs::File::open(path)?);
    let (mut bytes, mut digest) = (0, Sha256::new());
    loop {
        let block = reader.fill_buf()?;
        let size = block.len();
        if size == 0 {
            return Ok((
                bytes,
                digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect(),
            ));
        }
        digest.update(block);
        bytes += size as u64;
        reader.consume(size);
    }
}

/// The table /sensitivity/time_sensitivity, with a row for each event and parameter; `None` if the file has none.
fn sensitivities(file: &ResultFile) -> Result<Option<ExportTable<'static>>, Error> {
    const GROUP: &str = group::SENSITIVITY;
    let Some((values, [rows, width])) = file.matrix(GROUP, "time_sensitivity")? else {
        return Ok(None);
    };
    let list = |text: Option<String>| -> Vec<String> {
        let text = text.unwrap_or_default();
        text.split(", ").map(str::to_owned).collect()
    };
    let names = list(file.group_text(GROUP, "parameters")?);
    let units = list(file.group_text(GROUP, "parameter_units")?);
    if names.len() != width || units.len() != width {
        return Ok(None);
    }
    let uncertainty = file.matrix(GROUP, "time_sensitivity_uncertainty")?;
    let slope = "d(event time)/d(parameter), s for each unit of the parameter; NaN: not known";
    let words =
        |name: &str, long_name: &str, words: Vec<String>| Variable::words(name, long_name, (0..).zip(words).collect());
    let mut columns = vec![
        Variable::count("event", "index of the event"),
        words("parameter", "path of the parameter in case.toml", names),
        words("parameter_unit", "SI unit of the parameter", units),
        Variable::quantity("time_sensitivity", "1", slope),
    ];
    if uncertainty.is_some() {
        let long_name = "how far time_sensitivity can be off, in its unit; NaN: not known";
        columns.push(Variable::quantity("time_sensitivity_uncertainty", "1", long_name));
    }
    let indices = |of: fn(usize, usize) -> usize| (0..rows * width).map(|place| of(place, width) as f64).collect();
    let parameter: Vec<f64> = indices(|place, width| place % width);
    let mut cells = vec![
        indices(|place, width| place / width),
        parameter.clone(),
        parameter,
        values,
    ];
    cells.extend(uncertainty.map(|(mut uncertainty, _)| {
        uncertainty.resize(rows * width, f64::NAN);
        uncertainty
    }));
    Ok(Some(ExportTable::of_columns("sensitivities", columns, cells)))
}
