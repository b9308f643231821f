//! The interactive page of a run.
//!
//! Rust selects the data and writes one JSON document; the scripts in `data/page` draw it. `form` holds everything
//! that differs between runs. Texts of the file reach the page only through the document, and as text, never as markup.

mod document;
mod form;
mod pair;
mod trajectory;

use std::path::Path;

use serde::Serialize;

use super::DrawnRun;
use super::html::{self, PageDocument, counted, file_name};
use super::run::samples;
use crate::Error;
use crate::output::{Output, Product};
use document::{RunContent, Second};
use form::PageForm;
use pair::PagePair;
use stickslip_case::{Case, CaseSource};
use stickslip_files::schema::META_MOTION;
use stickslip_files::{ResultError, ResultFile, Status};
use trajectory::PageTrajectory;

/// Upper limit of a page's size, bytes, whatever the length of the run.
pub const SIZE_LIMIT: usize = 5_000_000;

/// Upper limit of the size of a page with two runs, bytes.
pub const SIZE_LIMIT_OF_TWO: usize = 2 * SIZE_LIMIT;

/// Share of the first of two runs, which also has the differences.
const FIRST_OF_TWO: f64 = 0.6;

/// Bytes reserved for names and brackets of the trajectory's arrays: in total at least, and per channel.
const MARGIN: (usize, usize) = (100_000, 500);

/// Contents of the written page of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RunPage {
    /// Samples in the file.
    pub samples: usize,
    /// Samples kept unchanged; the others are in bands of least and largest values.
    pub samples_kept: usize,
    /// Size, bytes.
    pub bytes: u64,
}

/// Writes the interactive page of `file` to `path`. With a second run of the same kind, the page overlays both, and has
/// the difference (first minus second) of every shown channel and the events side by side. The trajectory is read in
/// blocks, so memory does not grow with its length.
///
/// # Errors
/// No samples, an unreadable file, an obstacle at `path` (see [`Output::new`]), or a full disk.
pub fn write(file: &ResultFile, second: Option<&ResultFile>, path: &Path, force: bool) -> Result<RunPage, Error> {
    let files = || std::iter::once(file).chain(second);
    let inputs: Vec<_> = files().map(|file| file.path().to_owned()).collect();
    let output = Output::new(path, Product::Page, &inputs, force)?;
    let mut lines = Vec::new();
    for file in files() {
        samples(file)?;
        lines.push(line(file)?);
    }
    let (form, events) = (form_of(file)?, file.events()?);
    let mut document = PageDocument {
        title: title(file, second),
        subtitle: lines.join("; "),
        notice: notice(file)?,
        content: RunContent::of(file, &form, &events)?,
    };
    let (limit, share) = match second {
        None => (SIZE_LIMIT, 1.0),
        Some(_) => (SIZE_LIMIT_OF_TWO, FIRST_OF_TWO),
    };
    let margin = MARGIN.0.max(MARGIN.1 * form.variables.len());
    let pair = second
        .map(|second| PagePair::of(&form, second, form_of(second)?))
        .transpose()?;
    let beside = pair.as_ref().map(|pair| Second::of(pair, &events, &form)).transpose()?;
    document.content.second = beside;
    let fixed = document.html(&html::RUN, output.source())?.len() + margin * inputs.len();
    let room = |share: f64| (share * limit.saturating_sub(fixed) as f64) as usize;
    if let (Some(pair), Some(beside)) = (&pair, &mut document.content.second) {
        beside.trajectory = Some(PageTrajectory::of(pair.file, &pair.form, None, room(1.0 - share))?);
    }
    let trajectory = PageTrajectory::of(file, &form, pair.as_ref(), room(share))?;
    let samples_kept = trajectory.kept;
    document.content.trajectory = Some(trajectory);
    Ok(RunPage {
        samples: file.sample_count()?,
        samples_kept,
        bytes: document.write(&html::RUN, &output)?,
    })
}

/// The title of the run. Two runs are told apart by their files.
fn title(file: &ResultFile, second: Option<&ResultFile>) -> String {
    let Some(second) = second else {
        return file.title().to_owned();
    };
    let (first, other) = (file_name(file.path()), file_name(second.path()));
    if file.title() == second.title() {
        format!("{}: {first} and {other}", file.title())
    } else {
        format!("{} ({first}) and {} ({other})", file.title(), second.title())
    }
}

fn line(file: &ResultFile) -> Result<String, ResultError> {
    Ok(format!(
        "{}: {} run, {}, {}{}",
        file_name(file.path()),
        file.status().name(),
        counted(file.sample_count()?, "sample", "samples"),
        counted(file.events()?.len(), "event", "events"),
        html::changed(&file.changed()),
    ))
}

fn notice(file: &ResultFile) -> Result<Option<String>, ResultError> {
    let until = match file.span()? {
        Some((_, time)) => format!("The page shows what the file holds, up to t = {time} s."),
        None => "The file has no samples.".to_owned(),
    };
    Ok(match file.status() {
        Status::Complete => None,
        Status::Interrupted => Some(format!(
            "This run is not complete: it was interrupted, or was still being written. {until}"
        )),
        Status::Failed(why) if why.is_empty() => Some(format!("This run failed. {until}")),
        Status::Failed(why) => Some(format!("This run failed: {}. {until}", why.trim_end_matches('.'))),
    })
}

/// The form of a file. An unreadable case is an error if the file states its motion; older files get a basic form in
/// the words of a brake.
fn form_of(file: &ResultFile) -> Result<PageForm, Error> {
    let source = CaseSource::result(file.path(), file.resolved()?);
    let run = match Case::read(&source, &[]) {
        Ok(_) => Some(DrawnRun::open(file.path())?),
        Err(error) if file.meta()?.iter().any(|(name, _)| name == META_MOTION) => return Err(error.into()),
        Err(_) => None,
    };
    PageForm::of(file, run)
}
