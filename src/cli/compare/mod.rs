//! `stickslip compare`: compares the result of another solver with a reference.
//!
//! The figures of a report.
//!
//! Destination of a report.

use super::arguments::{Common, CompareOptions};
use super::input::columns;
use super::progress::{Bar, BarKind};
use super::reference::open_reference;
use super::{CommandEnd, CommandError, tell};
use crate::plot::comparison::DrawnCandidate;
use crate::plot::signature::REPORT as MARK;
use crate::plot::target::{self, Product};
use crate::plot::{self, DrawnRun, Figure, PlotError};
use crate::report::{DrawnPage, Page, PagePart, Report, html, markdown};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use stickslip_compare::{CompareError, Comparison, Mapping, Reference, Requirement};

mod pages;

#[derive(Serialize)]
struct CompareReport<'a> {
    comparisons: &'a [Comparison],
    /// The failed requirements in words.
    shortfalls: &'a [String],
}

impl Report for CompareReport<'_> {
    fn page(&self) -> Page {
        let mut pages = self.comparisons.iter().map(|c| pages::page(c, pages::Length::Screen));
        let first = pages.next().unwrap_or_default();
        pages.fold(first, |page, next| {
            page.with(format!("{}\n{}", next.title, next.verdict))
                .with_all(next.parts)
        })
    }
}

pub(super) fn compare(options: &CompareOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let requirements = options.require.iter().map(|text| Requirement::parse(text));
    let requirements = requirements
        .collect::<Result<Vec<_>, _>>()
        .map_err(CommandError::input)?;
    let report = options.report.as_deref();
    let report = report.map(|path| ReportTarget::check(path, options)).transpose()?;
    let reference = open_reference(&options.reference)?;
    let mapping = mapping(options, &reference)?;
    let comparisons = options.candidates.iter().map(|path| {
        let bar = Bar::new(common, BarKind::Share, &Arc::default());
        let comparison = reference.compare_watched(path, &mapping, &mut |progress| bar.comparison(progress, path));
        bar.finish();
        Ok(comparison?)
    });
    let comparisons = comparisons.collect::<Result<Vec<_>, CommandError>>()?;
    let shortfalls: Vec<String> = comparisons
        .iter()
        .flat_map(|comparison| requirements.iter().filter_map(|r| r.shortfall(comparison)))
        .collect();
    if let Some(target) = report {
        let page = |(number, c): (usize, &Comparison)| {
            let mut page = pages::page(c, pages::Length::Whole);
            let figures = figures((&reference, &mapping), c, (target.path(), number));
            // The figures follow the paragraph about the files.
            page.parts.splice(1..1, figures);
            page
        };
        let mut pages: Vec<_> = comparisons.iter().enumerate().map(page).collect();
        if !shortfalls.is_empty() {
            pages.push(Page::new("Fell short", "").with(PagePart::List(shortfalls.clone())));
        }
        target.write(&pages)?;
    }
    let report = CompareReport {
        comparisons: &comparisons,
        shortfalls: &shortfalls,
    };
    tell(common, &report)?;
    match shortfalls.is_empty() {
        true => Ok(CommandEnd::Done),
        false => Err(CommandError::computation(shortfalls.join("; "))),
    }
}

fn mapping(options: &CompareOptions, reference: &Reference) -> Result<Mapping, CompareError> {
    let mut mapping = columns(reference, options.map.as_deref(), &options.columns)?;
    if let Some(path) = &options.events {
        mapping.event_file = Some(path.clone());
    }
    if let Some(text) = &options.velocity_tolerance {
        mapping.set_tolerance(text)?;
    }
    if let Some(text) = &options.time_offset {
        mapping.set_time_offset(text)?;
    }
    mapping.quick = options.quick;
    if let Some(text) = &options.max_wall_time {
        mapping.set_max_wall_time(text)?;
    }
    if let Some(factor) = options.hysteresis {
        mapping
            .set_hysteresis(factor)
            .map_err(|what| CompareError::Option(format!("--hysteresis: {what}")))?;
    }
    Ok(mapping)
}

/// Width of a figure, mm.
const WIDTH: f64 = 170.0;

/// The figures of comparison `number` in the report, or the reason why there are none.
pub(super) fn figures(
    (reference, mapping): (&Reference, &Mapping),
    comparison: &Comparison,
    (report, number): (&Path, usize),
) -> Vec<PagePart> {
    let stem = report.file_stem().unwrap_or_default().to_string_lossy();
    let drawn = || -> Result<Vec<PagePart>, PlotError> {
        let run = DrawnRun::open(Path::new(&comparison.reference))?;
        let path = Path::new(&comparison.candidate);
        let beside = DrawnCandidate {
            reference,
            run: &run,
            path,
            mapping,
        };
        let place = match number {
            0 => String::new(),
            _ => format!("-{}", number + 1),
        };
        let part = |figure: &Figure| {
            Ok(PagePart::Figure(DrawnPage {
                file: format!("{stem}{place}-{}.svg", figure.name),
                title: figure.full_title(),
                svg: plot::draw(figure, WIDTH)?.svg(),
            }))
        };
        beside.figures(comparison)?.iter().map(part).collect()
    };
    drawn().unwrap_or_else(|error| vec![PagePart::Text(format!("no figure: {error}"))])
}

pub(super) struct ReportTarget {
    path: PathBuf,
    html: bool,
    force: bool,
}

impl ReportTarget {
    /// Refuses unknown formats, inputs, and existing files that are not reports, before anything is computed.
    pub fn check(path: &Path, options: &CompareOptions) -> Result<ReportTarget, CommandError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let html = match extension.as_deref() {
            Some("html" | "htm") => true,
            Some("md") => false,
            _ => {
                return Err(CommandError::input(format!(
                    "{}: a report is written as HTML or Markdown; give it the extension .html or .md",
                    path.display()
                )));
            }
        };
        let inputs = options
            .candidates
            .iter()
            .chain([&options.reference])
            .chain(&options.map)
            .chain(&options.events);
        let inputs: Vec<PathBuf> = inputs.cloned().collect();
        target::check(path, Product::Report, &inputs, options.force)?;
        Ok(ReportTarget {
            path: path.to_owned(),
            html,
            force: options.force,
        })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the report. Figures of a Markdown report are files next to it, which replace only figures of this
    /// program.
    pub fn write(&self, pages: &[Page]) -> Result<(), CommandError> {
        let text = if self.html {
            html(pages, MARK)
        } else {
            self.write_figures(pages)?;
            markdown(pages, MARK)
        };
        Ok(target::write(&self.path, Product::Report, &[text.as_bytes()])?)
    }

    fn write_figures(&self, pages: &[Page]) -> Result<(), CommandError> {
        let figures = pages.iter().flat_map(|page| &page.parts);
        for part in figures {
            let PagePart::Figure(figure) = part else { continue };
            let path = self.path.with_file_name(&figure.file);
            let figures = Product::Figure(Product::Report.option());
            target::check(&path, figures, &[], self.force)?;
            target::write(&path, figures, &[figure.svg.as_bytes()])?;
        }
        Ok(())
    }
}
