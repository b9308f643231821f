//! The file of a work-precision study: small, so written whole at the end.

use std::path::{Path, PathBuf};

use super::attributes::{quantity, write_attribute, write_attributes, write_input, write_root};
use super::source::Source;
use super::table::{LibraryVersion, TableWriter, create_file, create_group};
use super::target::Reservation;
use super::{AttributeValue, ResultError, Status, schema};

/// A row of /runs without its index, in the order of its variables; NaN where there is no value. The method is an index into
/// [`WorkPrecisionFile::methods`].
pub type WorkPrecisionRow = [f64; 13];

/// What the file of a study holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WorkPrecisionFile {
    /// Root attribute `title`.
    pub title: String,
    /// Root attribute `source`: the program with its version.
    pub source: String,
    /// Root attribute `history`: when, and by which command.
    pub history: String,
    /// /input/study: the TOML text.
    pub study: String,
    /// /input/resolved: the case of the first run in SI.
    pub resolved: String,
    /// Attributes of /meta.
    pub meta: Vec<(String, AttributeValue)>,
    /// Names behind the codes of `method`.
    pub methods: Vec<String>,
    /// In the order of the study.
    pub runs: Vec<WorkPrecisionRow>,
    /// Attribute `description` of /reference.
    pub reference: String,
    /// In order of time: the code of the kind of event, its time (s), and the uncertainty (s).
    pub events: Vec<[f64; 3]>,
    /// Of onset, final stick and all events, s; in the order of `schema::WORK_PRECISION_UNCERTAINTIES`.
    pub uncertainties: [f64; 3],
}

impl WorkPrecisionFile {
    /// Writes the file where a place is reserved: under its name if the study is complete, else as its partial file. Returns
    /// where it is.
    ///
    /// # Errors
    /// Any failure to write.
    pub fn write(&self, place: &Reservation, status: &Status) -> Result<PathBuf, ResultError> {
        place.put(status, |made| self.store(made, status))
    }

    /// Whether the file at `path` is one of a work-precision study.
    pub fn is_one(path: &Path) -> bool {
        Source::open_format(path, schema::WORK_PRECISION_FORMAT).is_ok()
    }

    /// Reads what a figure of it needs: title, methods, runs, description of the reference and uncertainties.
    ///
    /// # Errors
    /// A file that is not there, of another kind, of a newer version of the program, or damaged.
    pub fn read(path: &Path) -> Result<WorkPrecisionFile, ResultError> {
        let source = Source::open_format(path, schema::WORK_PRECISION_FORMAT)?;
        let methods = source.described("runs/method")?.flags.into_iter().map(|flag| flag.1);
        let column = |name: &str| -> Result<Vec<f64>, ResultError> {
            let variable = format!("runs/{name}");
            let found = source.dataset(&variable)?;
            let info = found.ok_or_else(|| source.missing(format!("variable {variable}")))?;
            source.read_rows(&variable, 0..info.size())
        };
        let columns = schema::work_precision_runs(&[]).variables;
        let columns = columns.iter().skip(1).map(|variable| column(&variable.name));
        let columns: Vec<Vec<f64>> = columns.collect::<Result<_, _>>()?;
        let mut uncertainties = [f64::NAN; 3];
        for ((name, ..), value) in schema::WORK_PRECISION_UNCERTAINTIES.iter().zip(&mut uncertainties) {
            let number = source
                .attribute(schema::group::REFERENCE, name)?
                .and_then(|known| known.number());
            *value = number.unwrap_or(f64::NAN);
        }
        let row = |row: usize| std::array::from_fn(|k| columns[k][row]);
        let rows = (0..columns[0].len()).map(row);
        Ok(WorkPrecisionFile {
            title: source.text_attribute("", schema::root::TITLE)?.unwrap_or_default(),
            runs: rows.collect(),
            methods: methods.collect(),
            reference: source
                .text_attribute(schema::group::REFERENCE, "description")?
                .unwrap_or_default(),
            uncertainties,
            ..WorkPrecisionFile::default()
        })
    }

    fn store(&self, path: &Path, status: &Status) -> hdf5::Result<()> {
        let file = create_file(path, LibraryVersion::Earliest)?;
        let texts = [
            (schema::root::CONVENTIONS, schema::CONVENTIONS),
            (schema::root::TITLE, &self.title),
            (schema::root::SOURCE, &self.source),
            (schema::root::HISTORY, &self.history),
            (schema::root::FORMAT, schema::WORK_PRECISION_FORMAT),
            (schema::root::STATUS, status.name()),
        ];
        write_root(&file, &texts)?;
        let mut runs = TableWriter::create(&file, &schema::work_precision_runs(&self.methods))?;
        for (index, row) in (0..).map(f64::from).zip(&self.runs) {
            runs.push(&[&[index], row]);
        }
        runs.append()?;
        let mut events = TableWriter::create(&file, &schema::work_precision_reference())?;
        for (index, row) in (0..).map(f64::from).zip(&self.events) {
            events.push(&[&[index], row]);
        }
        events.append()?;
        let reference = file.group(schema::group::REFERENCE)?;
        write_attribute(&reference, "description", &self.reference)?;
        for ((name, units, long_name), value) in schema::WORK_PRECISION_UNCERTAINTIES.iter().zip(self.uncertainties) {
            write_attributes(&reference, &quantity(name, value, units, long_name))?;
        }
        let input = create_group(&file, schema::group::INPUT)?;
        write_input(&input, "study", &self.study, "the study as it was given (TOML)")?;
        let resolved = "every parameter of the first run in SI units (TOML)";
        write_input(&input, schema::INPUT_RESOLVED, &self.resolved, resolved)?;
        write_attributes(&create_group(&file, schema::group::META)?, &self.meta)?;
        super::checksums::write(&file, &super::checksums::Known::default())?;
        file.flush()
    }
}
