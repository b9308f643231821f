//! The interactive page of a run: one HTML file that a browser opens from disk, without a network.
//!
//! Rust decides what of the file is on the page and writes it as one JSON document; the scripts beside this file
//! draw it. What differs between a brake and two trains is a `form`, which `brake` and `trains` make: channels, panels,
//! portraits and words; the rest is the same for both. Every text of the file reaches the page through that document and is put there as text, never as markup.

mod brake;
mod document;
mod encoding;
mod form;
mod thinning;
mod trains;
mod trajectory;

use std::path::Path;

use serde::Serialize;

use super::target::{self, Product};
use super::{PlotError, Run};
use crate::case::{Case, CaseSource, TrainCase};
use crate::results::{ResultFile, Status};
use document::Document;
use form::Form;
use trajectory::Trajectory;

/// A page is smaller than this, bytes, whatever the length of the run.
pub const SIZE_LIMIT: usize = 5_000_000;

/// Of the limit, what is left for the names and brackets around the arrays of the trajectory: at least, and for each channel.
const MARGIN: (usize, usize) = (100_000, 500);

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
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

/// Writes the interactive page of `file` to `path`, by way of a temporary file beside it.
///
/// The trajectory is read in blocks, so that memory does not grow with its length.
///
/// # Errors
/// The file has no samples or cannot be read; `path` is in no folder, or a file that is no page of this program and is
/// not to be replaced by `force`; the disk is full.
pub fn write(file: &ResultFile, path: &Path, force: bool) -> Result<Page, PlotError> {
    target::check(path, Product::Page, &[file.path().to_owned()], force)?;
    let samples = file.sample_count()?;
    if samples == 0 {
        return Err(PlotError::NoSamples {
            path: file.path().to_owned(),
            interrupted: *file.status() == Status::Interrupted,
        });
    }
    file.check_times()?;
    let form = form_of(file)?;
    let run = json(&Document::of(file, &form)?)?;
    let script = filled(&SCRIPTS.concat(), |name| form.part(name));
    let template = filled(TEMPLATE, |name| form.part(name));
    let margin = MARGIN.0.max(MARGIN.1 * form.variables.len());
    let fixed = template.len() + STYLE.len() + script.len() + run.len() + file.title().len() * 6 + margin;
    let trajectory = Trajectory::of(file, &form, SIZE_LIMIT.saturating_sub(fixed))?;
    let samples_kept = trajectory.kept;
    let trajectory = json(&trajectory)?;
    let generator = format!("{} {}\">", super::signature::PAGE, env!("CARGO_PKG_VERSION"));
    let title = escape(file.title());
    let page = filled(&template, |name| {
        Some(match name {
            "generator" => generator.clone(),
            "title" => title.clone(),
            "style" => STYLE.to_owned(),
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

/// The form of a file.
///
/// # Errors
/// It cannot be read, or is of trains with a case that this version cannot read.
fn form_of(file: &ResultFile) -> Result<Form, PlotError> {
    let source = CaseSource::result(file.path(), file.resolved()?);
    if TrainCase::is_one(&source, &[]) {
        let case = TrainCase::parse(&source, &[])?;
        return trains::form(case, Run::open(file.path())?);
    }
    Ok(brake::form(Case::parse(&source, &[]).ok()))
}

/// A text with what stands for the names in double braces; other braces stay.
fn filled(template: &str, part: impl Fn(&str) -> Option<String>) -> String {
    let mut text = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        text.push_str(before);
        let known = after
            .split_once("}}")
            .and_then(|(name, after)| Some((part(name)?, after)));
        match known {
            Some((part, after)) => {
                text.push_str(&part);
                rest = after;
            }
            None => {
                text.push_str("{{");
                rest = after;
            }
        }
    }
    text.push_str(rest);
    text
}

/// JSON that can stand in a script element: no text in it ends the element or opens a comment, or would steer a terminal on
/// which the page is listed.
fn json(value: &impl Serialize) -> Result<String, PlotError> {
    let text = serde_json::to_string(value).map_err(|error| PlotError::Drawing(error.to_string()))?;
    Ok(crate::quote::in_json(&text, |c| c == '<'))
}

/// A text as the content of an element, without characters that would steer a terminal on which the page is listed.
fn escape(text: &str) -> String {
    crate::quote::for_terminal(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
