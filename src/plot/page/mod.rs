//! The interactive page of a run: one HTML file that works offline.
//!
//! Rust selects the data and writes one JSON document; the scripts beside this file draw it. `form` holds everything
//! that differs between runs. Texts of the file reach the page only through the document, and as text, never as markup.

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
use super::{DrawnRun, PlotError};
use document::{Document, Second};
use form::Form;
use pair::Pair;
use stickslip_case::{Case, CaseSource};
use stickslip_files::ResultFile;
use stickslip_files::schema::META_MOTION;
use trajectory::Trajectory;

/// Upper limit of a page's size, bytes, whatever the length of the run.
pub const SIZE_LIMIT: usize = 5_000_000;

/// Upper limit of the size of a page with two runs, bytes.
pub const SIZE_LIMIT_OF_TWO: usize = 2 * SIZE_LIMIT;

/// Share of the first of two runs, which also has the differences.
const FIRST_OF_TWO: f64 = 0.6;

/// Bytes reserved for names and brackets of the trajectory's arrays: in total at least, and per channel.
const MARGIN: (usize, usize) = (100_000, 500);

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// Dark colours, which the style uses twice: for a dark system, and on the reader's request.
const DARK: &str = include_str!("dark.css");
/// In the order of their dependences.
const SCRIPTS: [&str; 6] = [
    include_str!("data.js"),
    include_str!("axis.js"),
    include_str!("chart.js"),
    include_str!("figures.js"),
    include_str!("lists.js"),
    include_str!("main.js"),
];

/// Contents of a written page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Page {
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
/// No samples, an unreadable file, an obstacle at `path` (see `target::check`), or a full disk.
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

/// The form of a file. An unreadable case is an error if the file states its motion; older files get a basic form in
/// the words of a brake.
fn form_of(file: &ResultFile) -> Result<Form, PlotError> {
    let source = CaseSource::result(file.path(), file.resolved()?);
    let run = match Case::read(&source, &[]) {
        Ok(_) => Some(DrawnRun::open(file.path())?),
        Err(error) if file.meta()?.iter().any(|(name, _)| name == META_MOTION) => return Err(error.into()),
        Err(_) => None,
    };
    Form::of(file, run)
}
