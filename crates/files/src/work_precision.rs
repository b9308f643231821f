//! File of a work-precision study. It is small, and written as a whole at the end.

use std::path::{Path, PathBuf};

use super::attributes::{quantity, write_attribute, write_attributes};
use super::source::FileSource;
use super::study::StudyHeader;
use super::table::TableWriter;
use super::target::Reservation;
use super::{ResultError, Status, schema};

/// A row of /runs without its index, in the order of the variables; NaN for missing values. The method is an index
/// into [`WorkPrecisionFile::methods`].
pub type WorkPrecisionRow = [f64; 13];

/// Contents of a study's file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WorkPrecisionFile {
    /// Head of the file.
    pub header: StudyHeader,
    /// Names of the codes of `method`.
    pub methods: Vec<String>,
    /// Runs in the order of the study.
    pub runs: Vec<WorkPrecisionRow>,
    /// Attribute `description` of /reference.
    pub reference: String,
    /// Events in order of time: code of the kind, time (s), uncertainty (s).
    pub events: Vec<[f64; 3]>,
    /// Uncertainties of onset, final stick and all events, s; as in `schema::WORK_PRECISION_UNCERTAINTIES`.
    pub uncertainties: [f64; 3],
}

impl WorkPrecisionFile {
    /// Writes the file at a reserved place: under its own name if the study is complete, otherwise as its partial
    /// file. Returns the path. Fails if the file cannot be written.
    pub fn write(&self, place: &Reservation, status: &Status) -> Result<PathBuf, ResultError> {
        place.put(status, |made| self.store(made, status))
    }

    /// Whether the file at `path` is a work-precision study.
    pub fn is_one(path: &Path) -> bool {
        FileSource::is_of_format(path, schema::WORK_PRECISION_FORMAT)
    }

    /// Reads the data of a figure: title, methods, runs, description of the reference, uncertainties. Fails if the
    /// file is missing, of another kind, of a newer version, or damaged.
    pub fn read(path: &Path) -> Result<WorkPrecisionFile, ResultError> {
        let source = FileSource::open_format(path, schema::WORK_PRECISION_FORMAT)?;
        let methods = source.described("runs/method")?.flags.into_iter().map(|flag| flag.1);
        let runs = source.table(schema::group::RUNS)?;
        let columns = schema::work_precision_runs(&[]).variables;
        let columns = columns.iter().skip(1).map(|variable| runs.column(&variable.name));
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
        let title = source.text_attribute("", schema::root::TITLE)?.unwrap_or_default();
        Ok(WorkPrecisionFile {
            header: StudyHeader {
                title,
                ..StudyHeader::default()
            },
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
        let file = self.header.create(path, schema::WORK_PRECISION_FORMAT, Some(status))?;
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
        self.header.write_input(&file)?;
        file.flush()
    }
}
