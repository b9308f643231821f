//! The interactive page of a run: one HTML file that a browser opens from disk, without a network.
//!
//! Rust decides what of the file is on the page and writes it as one JSON document; the scripts beside this file
//! draw it. What differs between runs is a `form`: channels, panels, portraits and words; the rest is the same for all.
//! Every text of the file reaches the page through that document and is put there as text, never as markup.

mod document;
mod form;
mod orbit;
mod pair;
mod sparse;
mod thinning;
mod trajectory;

use std::path::Path;

use serde::Serialize;

use super::html::{self, filled, json};
use super::run::samples;
use super::target::{self, Product};
use super::{PlotError, Run};
use crate::case::{Case, CaseSource};
use crate::results::ResultFile;
use crate::results::schema::META_MOTION;
use document::{Document, Second};
use form::Form;
use pair::Pair;
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

/// Writes the interactive page of `file` to `path`, by way of a temporary file beside it. With a second run of one kind it has both over
/// each other, the difference of every shown channel, the first less the second, and their events side by side.
///
/// The trajectory is read in blocks, so that memory does not grow with its length.
///
/// # Errors
/// A file has no samples or cannot be read; `path` is in no folder, or a file that is no page of this program and is
/// not to be replaced by `force`; the disk is full.
pub fn write(file: &ResultFile, second: Option<&ResultFile>, path: &Path, force: bool) -> Result<Page, PlotError> {
    let files = std::iter::once(file).chain(second);
    let inputs: Vec<_> = files.clone().map(|file| file.path().to_owned()).collect();
    target::check(path, Product::Page, &inputs, force)?;
    for file in files {
        samples(file)?;
    }
    let (form, events) = (form_of(file)?, file.events()?);
    let mut document = Document::of(file, &form, &events)?;
    let (limit, share) = match second {
        None => (SIZE_LIMIT, 1.0),
        Some(_) => (SIZE_LIMIT_OF_TWO, FIRST_OF_TWO),
    };
    let (script, template) = (
        filled(&SCRIPTS.concat(), &form.parts()),
        filled(TEMPLATE, &form.parts()),
    );
    let style = filled(STYLE, &[("dark", DARK)]);
    let margin = MARGIN.0.max(MARGIN.1 * form.variables.len());
    let mut fixed = template.len() + style.len() + script.len() + file.title().len() * 6 + margin;
    let pair = second
        .map(|second| Pair::of(&form, second, form_of(second)?))
        .transpose()?;
    if let Some((pair, second)) = pair.as_ref().zip(second) {
        let mut beside = Second::of(pair, &events, &form)?;
        fixed += json(&document)?.len() + json(&beside)?.len() + margin;
        let room = ((1.0 - share) * limit.saturating_sub(fixed) as f64) as usize;
        beside.trajectory = Some(Trajectory::of(second, &pair.form, None, room)?);
        document.second = Some(beside);
    } else {
        fixed += json(&document)?.len();
    }
    let room = (share * limit.saturating_sub(fixed) as f64) as usize;
    let trajectory = Trajectory::of(file, &form, pair.as_ref(), room)?;
    let (run, of_run) = (json(&document)?, json(&trajectory)?);
    let parts = [
        ("style", &*style),
        ("script", &script),
        ("run", &run),
        ("trajectory", &of_run),
    ];
    let page = html::page(&template, file.title(), &parts);
    target::write(path, Product::Page, &[page.as_bytes()])?;
    Ok(Page {
        samples: file.sample_count()?,
        samples_kept: trajectory.kept,
        bytes: page.len() as u64,
    })
}

/// The form of a file. Without its case there is only what all files have, in the words of a brake.
///
/// # Errors
/// It cannot be read, or says what its coordinates are but has a case that this version cannot read.
fn form_of(file: &ResultFile) -> Result<Form, PlotError> {
    let source = CaseSource::result(file.path(), file.resolved()?);
    let run = match Case::read(&source, &[]) {
        Ok(_) => Some(Run::open(file.path())?),
        Err(error) if file.meta()?.iter().any(|(name, _)| name == META_MOTION) => return Err(error.into()),
        Err(_) => None,
    };
    Form::of(file, run)
}
