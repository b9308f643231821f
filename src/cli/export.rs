//! `stickslip export`: writes tables of a result in other formats.

use super::arguments::{Common, ExportOptions};
use super::interrupt::interrupt_flag;
use super::{CommandEnd, complain, interrupted, tell};
use crate::comparing::open_reference;
use crate::error::{Error, ErrorKind};
use crate::export::{self, Export, Format, Request, Times, benchmark};
use crate::report::{FilesReport, Page, Report};
use serde::Serialize;
use std::io;
use std::path::{Path, PathBuf};
use stickslip_files::schema::{StorageKind, Variable};
use stickslip_files::{ResultFile, Status, open_sound};

pub(super) fn export(options: &ExportOptions, common: &Common) -> Result<CommandEnd, Error> {
    if options.benchmark {
        return package(options, common);
    }
    let output = &output(options);
    let streams = output.as_os_str() == "-";
    let format = format(options, output, streams)?;
    if streams && common.json {
        return Err(Error::input(
            "-o - writes CSV to standard output, where --json has its document; leave one of them out",
        ));
    }
    if let Some(found) = export::of_study(&options.file, &options.channels)? {
        let (times, table) = (
            options.at.is_some() || options.rate.is_some() || options.interval.is_some() || options.window.is_some(),
            options.table != export::Which::Trajectory,
        );
        if times || table {
            return Err(Error::of_file(
                &options.file,
                "the points of a study have no times and no other tables; leave out --table, --window, --rate, --interval and --at",
            ));
        }
        return write(&found, options, (output, format), common);
    }
    // `None` means the times of the samples.
    let times = match (&options.at, options.rate, options.interval) {
        (Some(path), ..) => Some(Times::At(export::read_times(path)?)),
        (None, Some(rate), _) => Some(Times::Rate(rate)),
        (None, None, Some(interval)) => Some(Times::Every(interval)),
        (None, None, None) => None,
    };
    let request = Request {
        table: options.table,
        columns: options.channels.clone(),
        window: options.window.unwrap_or((f64::NEG_INFINITY, f64::INFINITY)),
    };
    let (file, reference);
    let found = if let Some(times) = &times {
        reference = open_reference(&options.file)?;
        tell_status(reference.file(), common);
        let found = export::evaluated(&reference, &request, times)?;
        tell_window(reference.file(), options, common)?;
        found
    } else {
        file = open_sound(&options.file)?;
        tell_status(&file, common);
        let found = export::stored(&file, &request)?;
        tell_window(&file, options, common)?;
        found
    };
    write(&found, options, (output, format), common)
}

/// The file as named, or named after the result: `paper.csv`, and `paper-events.csv` for another table.
fn output(options: &ExportOptions) -> PathBuf {
    let stem = options.file.file_stem().unwrap_or_default().to_string_lossy();
    let table = match options.table {
        export::Which::Trajectory => String::new(),
        other => format!("-{}", other.name()),
    };
    let extension = options.format.unwrap_or(Format::Csv).name();
    let own = || PathBuf::from(format!("{stem}{table}.{extension}"));
    options.output.clone().unwrap_or_else(own)
}

fn write(
    found: &Export,
    options: &ExportOptions,
    (output, format): (&Path, Format),
    common: &Common,
) -> Result<CommandEnd, Error> {
    if output.as_os_str() == "-" {
        if !common.quiet && !found.left_out.is_empty() {
            complain(&format!("warning: {}", without(&found.left_out)));
        }
        return match found.stream(io::stdout().lock()) {
            // A closed pipe, as with `head`, is no error.
            Err(error) if error.kind == ErrorKind::BrokenPipe => Ok(CommandEnd::Done),
            other => other.map(|()| CommandEnd::Done),
        };
    }
    let mut inputs = vec![options.file.clone()];
    inputs.extend(options.at.clone());
    found.save(output, format, &inputs, options.force)?;
    tell(common, &ExportReport::new(found, output, format))
}

fn format(options: &ExportOptions, output: &Path, streams: bool) -> Result<Format, Error> {
    let named = options.format;
    if streams {
        return match named {
            None | Some(Format::Csv) => Ok(Format::Csv),
            Some(other) => Err(Error::input(format!(
                "-o - writes CSV, and {} is written to a file only; name one with -o",
                other.name()
            ))),
        };
    }
    named.or_else(|| Format::of_path(output)).ok_or_else(|| {
        let parquet = output.extension().is_some_and(|extension| extension == "parquet");
        Error::input(format!(
            "{}: its extension names no format; give it .csv, .npz or .mat, or say which with --format{}",
            output.display(),
            if parquet {
                " (pandas makes Parquet of CSV: pandas.read_csv(...).to_parquet(...))"
            } else {
                ""
            }
        ))
    })
}

#[derive(Serialize)]
struct ExportColumn<'a> {
    name: &'a str,
    units: &'a str,
    long_name: &'a str,
    /// "number", "whole" or "code".
    kind: &'static str,
    /// Meanings of codes.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    meanings: &'a [(i64, String)],
}

impl<'a> From<&'a Variable> for ExportColumn<'a> {
    fn from(variable: &'a Variable) -> Self {
        ExportColumn {
            name: &variable.name,
            units: &variable.units,
            long_name: &variable.long_name,
            kind: match variable.kind {
                StorageKind::Float64 => "number",
                StorageKind::Int32 | StorageKind::Int64 => "whole",
                StorageKind::Int8 => "code",
            },
            meanings: &variable.flags,
        }
    }
}

#[derive(Serialize)]
struct ExportReport<'a> {
    file: String,
    format: &'static str,
    table: &'a str,
    rows: usize,
    columns: Vec<ExportColumn<'a>>,
    /// Method that computed values between the samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    evaluated: Option<&'a str>,
    /// Columns that exist only at the samples.
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    left_out: &'a [String],
}

impl<'a> ExportReport<'a> {
    fn new(found: &'a Export<'_>, path: &Path, format: Format) -> Self {
        ExportReport {
            file: path.display().to_string(),
            format: format.name(),
            table: &found.table.name,
            rows: found.table.rows,
            columns: found.table.columns.iter().map(ExportColumn::from).collect(),
            evaluated: found.origin.evaluated.as_deref(),
            left_out: &found.left_out,
        }
    }
}

impl Report for ExportReport<'_> {
    fn page(&self) -> Page {
        let how = self.evaluated.map(|how| format!(", {how}")).unwrap_or_default();
        let (rows, columns, table) = (self.rows, self.columns.len(), self.table);
        let left_out = Some(self.left_out).filter(|left_out| !left_out.is_empty());
        let left_out = left_out.map(without).unwrap_or_default();
        Page::new(format!("{rows} rows, {columns} columns of /{table}{how}"), left_out).with(&*self.file)
    }
}

fn without(left_out: &[String]) -> String {
    format!("without {}, which are known at the samples alone", left_out.join(", "))
}

fn tell_window(file: &ResultFile, options: &ExportOptions, common: &Common) -> Result<(), Error> {
    let (Some((from, to)), Some((start, end))) = (options.window, file.span()?) else {
        return Ok(());
    };
    let beyond = |asked: f64, past: bool| asked.is_finite() && past;
    if !common.quiet && (beyond(from, from < start) || beyond(to, to > end)) {
        complain(&format!(
            "warning: {}: the run goes from {start:?} to {end:?} s, and the window from {from:?} to {to:?} s beyond it; exported is \
             what is there",
            file.path().display()
        ));
    }
    Ok(())
}

fn tell_status(file: &ResultFile, common: &Common) {
    if common.quiet || *file.status() == Status::Complete {
        return;
    }
    complain(&format!(
        "warning: {}: this run is {}; exported is what is there",
        file.path().display(),
        file.status().name()
    ));
}

fn package(options: &ExportOptions, common: &Common) -> Result<CommandEnd, Error> {
    let Some(output) = &options.output else {
        return Err(Error::input(
            "--benchmark writes a folder; name it with -o, for example -o my-benchmark",
        ));
    };
    let terms = benchmark::Terms {
        author: options.author.clone(),
        license: options.license.clone(),
    };
    // A signal would leave behind the folder in which the package is made.
    let stop = interrupt_flag()?;
    let Some(written) = benchmark::write(&options.file, output, &terms, options.force, &stop)? else {
        return interrupted(common, "; no package was written");
    };
    let report = FilesReport {
        folder: Some(output),
        files: &written,
    };
    tell(common, &report)
}
