//! The interactive page of a run: one HTML file that a browser opens from disk, without a network.
//!
//! Rust decides what of the file is on the page and writes it as one JSON document; the scripts beside this file
//! draw it. What differs between runs is a `form`, which `panels` makes: channels, panels, portraits and words; the rest is the
//! same for all. Every text of the file reaches the page through that document and is put there as text, never as markup.

mod document;
mod encoding;
mod form;
mod orbit;
mod pair;
mod panels;
mod second;
mod sparse;
mod thinning;
mod trajectory;

use std::path::Path;

use serde::Serialize;

use super::html::{self, filled, json};
use super::target::{self, Product};
use super::{PlotError, Run};
use crate::case::{Case, CaseSource};
use crate::results::schema::META_MOTION;
use crate::results::{ResultFile, Status};
use document::Document;
use form::Form;
use second::Second;
use trajectory::Trajectory;

/// A page is smaller than this, bytes, whatever the length of the run.
pub const SIZE_LIMIT: usize = 5_000_000;

/// A page of two runs is smaller than this, bytes.
pub const SIZE_LIMIT_OF_TWO: usize = 2 * SIZE_LIMIT;

/// The part of the room for the first of two runs, which has the differences as well.
const FIRST_OF_TWO: f64 = 0.6;

/// Of the limit, what is left for the names and brackets around the arrays of the trajectory: at least, and for each channel.
const MARGIN: (usize, usize) = (100_000, 500);

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// The colours of a dark page, which the style has twice: for a dark system, and where the reader chooses it.
const DARK: &str = include_str!("dark.css");
/// In the order in which they build on each other.
const SCRIPTS: [&str; 6] = [
    include_str!("data.js"),
    include_str!("axis.js"),
    include_str!("chart.js"),
    include_str!("figures.js"),
    include_str!("lists.js"),
    include_str!("main.js"),
];

/// What a page holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Page {
    /// Samples in the result file.
    pub samples: usize,
    /// Samples on the page as they are in the file; the others are in its bands of least and largest values.
    pub samples_kept: usize,
    /// Size of the page.
    pub bytes: u64,
}

/// The document of one run, with what there is of a second.
#[derive(Serialize)]
struct Shown<'a> {
    #[serde(flatten)]
    document: &'a Document,
    #[serde(skip_serializing_if = "Option::is_none")]
    second: Option<Second>,
}

/// Writes the interactive page of `file` to `path`, by way of a temporary file beside it.
///
/// The trajectory is read in blocks, so that memory does not grow with its length.
///
/// # Errors
/// The file has no samples or cannot be read; `path` is in no folder, or a file that is no page of this program and is
/// not to be replaced by `force`; the disk is full.
pub fn write(file: &ResultFile, path: &Path, force: bool) -> Result<Page, PlotError> {
    write_runs(file, None, path, force)
}

/// Writes a page of two runs of one kind: both over each other, the difference of every shown channel, the first less the
/// second, and their events side by side.
///
/// # Errors
/// As [`write()`], of either file.
pub fn write_two(file: &ResultFile, second: &ResultFile, path: &Path, force: bool) -> Result<Page, PlotError> {
    write_runs(file, Some(second), path, force)
}

fn write_runs(file: &ResultFile, second: Option<&ResultFile>, path: &Path, force: bool) -> Result<Page, PlotError> {
    let files = std::iter::once(file).chain(second);
    let inputs: Vec<_> = files.clone().map(|file| file.path().to_owned()).collect();
    target::check(path, Product::Page, &inputs, force)?;
    for file in files {
        if file.sample_count()? == 0 {
            return Err(PlotError::NoSamples {
                path: file.path().to_owned(),
                interrupted: *file.status() == Status::Interrupted,
            });
        }
        file.check_times()?;
    }
    let form = form_of(file)?;
    let document = Document::of(file, &form)?;
    let (limit, share) = match second {
        None => (SIZE_LIMIT, 1.0),
        Some(_) => (SIZE_LIMIT_OF_TWO, FIRST_OF_TWO),
    };
    let script = filled(&SCRIPTS.concat(), |name| form.part(name));
    let style = filled(STYLE, |name| (name == "dark").then(|| DARK.to_owned()));
    let template = filled(TEMPLATE, |name| form.part(name));
    let margin = MARGIN.0.max(MARGIN.1 * form.variables.len());
    let mut fixed = template.len() + style.len() + script.len() + file.title().len() * 6 + margin;
    let mut pair = None;
    if let Some(second) = second {
        let one = pair::Pair::of(&form, second, form_of(second)?)?;
        let mut beside = Second::of(file, &form, &one)?;
        fixed += json(&document)?.len() + json(&beside)?.len() + margin;
        let room = ((1.0 - share) * limit.saturating_sub(fixed) as f64) as usize;
        beside.trajectory = Some(Trajectory::of(second, &one.form, None, room)?);
        pair = Some((one, beside));
    } else {
        fixed += json(&document)?.len();
    }
    let room = (share * limit.saturating_sub(fixed) as f64) as usize;
    let trajectory = Trajectory::of(file, &form, pair.as_ref().map(|(pair, _)| pair), room)?;
    let (samples, samples_kept) = (file.sample_count()?, trajectory.kept);
    let run = json(&Shown {
        document: &document,
        second: pair.map(|(_, second)| second),
    })?;
    let trajectory = json(&trajectory)?;
    let (generator, title) = (html::generator(), html::escaped(file.title()));
    let page = filled(&template, |name| {
        Some(match name {
            "generator" => generator.clone(),
            "title" => title.clone(),
            "style" => style.clone(),
            "script" => script.clone(),
            "run" => run.clone(),
            "trajectory" => trajectory.clone(),
            _ => return None,
        })
    });
    target::write(path, Product::Page, &[page.as_bytes()])?;
    Ok(Page {
        samples,
        samples_kept,
        bytes: page.len() as u64,
    })
}

/// The form of a file. Without its case there is only what all files have, in the words of a brake.
///
/// # Errors
/// It cannot be read, or says what its coordinates are but has a case that this version cannot read.
fn form_of(file: &ResultFile) -> Result<Form, PlotError> {
    let source = CaseSource::result(file.path(), file.resolved()?);
    panels::form(match Case::read(&source, &[]) {
        Ok(_) => Some(Run::open(file.path())?),
        Err(error) if file.meta()?.iter().any(|(name, _)| name == META_MOTION) => return Err(error.into()),
        Err(_) => None,
    })
}
