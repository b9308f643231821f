//! Errors of figures.

use super::target::TargetError;
use std::path::PathBuf;
use stickslip_case::{self as case, CaseError};
use stickslip_compare::CompareError;
use stickslip_files::ResultError;

/// Reason why a figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum PlotError {
    /// The result file cannot be read.
    #[error(transparent)]
    Result(#[from] ResultError),
    /// The case in the result file cannot be read.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// The candidate cannot be read.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The product cannot be written to its destination.
    #[error(transparent)]
    Target(#[from] TargetError),
    #[error(
        "{path}: has no trajectory: there is not one sample in it{}; repeat the run (`stickslip run {path}`)",
        if *.interrupted { ", as the run was ended before the first block was saved" } else { "" }
    )]
    NoSamples { path: PathBuf, interrupted: bool },
    #[error(
        "{path}: /trajectory has no variable \"{name}\"{hint}; there are {known} (`stickslip inspect` says what each is)"
    )]
    UnknownChannel {
        path: PathBuf,
        name: String,
        hint: String,
        known: String,
    },
    #[error(
        "{path}: has no \"{name}\" to be drawn with the result; it has {known} (--column and --map name its columns)"
    )]
    NotInCandidate { path: PathBuf, name: String, known: String },
    #[error("there is no figure \"{name}\"{hint}; there are {known}")]
    UnknownFigure { name: String, hint: String, known: String },
    #[error(
        "figure {number} of the paper is a critical curve: stick-slip or not over decay rate and damping. It is drawn from \
         the file of a sweep: `stickslip sweep critical-curve`, then `stickslip plot critical-curve.h5`"
    )]
    CriticalCurve { number: u32 },
    #[error(
        "figure {number} of the paper: it is not known which picture that is; --list says what can be drawn, with \
         the paper's number where it is known"
    )]
    UnknownNumber { number: u32 },
    #[error("{path}: the study has no {what} \"{name}\"{hint}; there are {known}")]
    NotInStudy {
        path: PathBuf,
        what: &'static str,
        name: String,
        hint: String,
        known: String,
    },
    #[error("{path}: {why}")]
    Study { path: PathBuf, why: String },
    #[error("{path}: no samples from {from} to {to} s; they reach from {first} to {last} s")]
    NothingInRange {
        path: PathBuf,
        from: f64,
        to: f64,
        first: f64,
        last: f64,
    },
    #[error(
        "{path}: several figures want a folder; one alone (--only, --channel, --phase) may have a file, whose name ends \
         in .svg, .png or .pdf"
    )]
    NoFolder { path: PathBuf },
    #[error(
        "{path}: figures are SVG, PNG or PDF; give a name that ends in .svg, .png or .pdf{}",
        if path.extension().is_some_and(|extension| extension == "eps") { " (`pdftops -eps figure.pdf` makes EPS)" } else { "" }
    )]
    Format { path: PathBuf },
    #[error(
        "{path}: the figure of {there}, which that of {here} would replace; choose another folder with {option}, or replace it \
         with --force"
    )]
    OfAnotherFile {
        path: PathBuf,
        there: String,
        here: String,
        option: &'static str,
    },
    #[error("a picture of {width} x {height} pixels is too large; use a smaller --width or --dpi")]
    TooLarge { width: f64, height: f64 },
    #[error("drawing failed: {0}")]
    Drawing(String),
}

pub(super) fn hint<'a>(unknown: &str, known: impl Iterator<Item = &'a str>) -> String {
    case::suggest(unknown, known)
        .map(|close| format!(" (did you mean {close}?)"))
        .unwrap_or_default()
}
