//! `stickslip compare`: compares the result of another solver with a reference.

use super::arguments::{Common, CompareOptions};
use super::input::{columns, open_reference};
use super::progress::{BarKind, watched};
use super::{CommandEnd, tell};
use crate::Error;
use crate::output::{Output, Product};
use crate::plot::comparison::DrawnCandidate;
use crate::plot::signature::REPORT;
use crate::plot::{self, Drawing, DrawnRun, Figure};
use crate::report::{DrawnPage, Page, PagePart, Report, html, markdown};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use stickslip_compare::{CompareError, Comparison, Mapping, Reference, Requirement};
use stickslip_files::{ResultFile, is_hdf5};

mod pages;

#[derive(Serialize)]
struct CompareReport<'a> {
    comparisons: &'a [Comparison],
    /// The failed requirements in words.
    shortfalls: &'a [String],
    /// The written report.
    #[serde(skip)]
    file: Option<String>,
}

impl Report for CompareReport<'_> {
    fn page(&self) -> Page {
        let mut pages = self.comparisons.iter().map(|c| pages::page(c, pages::Length::Screen));
        let first = pages.next().unwrap_or_default();
        let all = pages.fold(first, |page, next| {
            page.with(format!("{}\n{}", next.title, next.verdict))
                .with_all(next.parts)
        });
        all.with_all(self.file.clone())
    }
}

pub(super) fn compare(options: &CompareOptions, common: &Common) -> Result<CommandEnd, Error> {
    let requirements = options.require.iter().map(|text| Requirement::parse(text));
    let requirements = requirements.collect::<Result<Vec<_>, _>>().map_err(Error::input)?;
    let report = options.report.as_deref();
    let report = report.map(|path| ReportTarget::new(path, options)).transpose()?;
    refuse_swapped(options)?;
    let reference = open_reference(&options.reference)?;
    let mapping = mapping(options, &reference)?;
    let comparisons = options.candidates.iter().map(|path| {
        let comparison = watched(common, BarKind::Share, &Arc::default(), |bar| {
            reference.compare_watched(path, &mapping, bar)
        });
        Ok(comparison?)
    });
    let comparisons = comparisons.collect::<Result<Vec<_>, Error>>()?;
    let shortfalls: Vec<String> = comparisons
        .iter()
        .flat_map(|comparison| requirements.iter().filter_map(|r| r.shortfall(comparison)))
        .collect();
    if let Some(target) = &report {
        let page = |(number, c): (usize, &Comparison)| {
            let mut page = pages::page(c, pages::Length::Whole);
            let figures = figures((&reference, &mapping), c, (&target.output, number));
            // The figures follow the statistics, and the resolution before them.
            let place = page
                .parts
                .iter()
                .take_while(|part| !matches!(part, PagePart::Detail(_)))
                .count();
            page.parts.splice(place..place, figures);
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
        file: report.map(|target| target.output.path().display().to_string()),
    };
    tell(common, &report)?;
    match shortfalls.is_empty() {
        true => Ok(CommandEnd::Done),
        false => Err(Error::computation(shortfalls.join("; "))),
    }
}

/// Refuses a table in place of the reference if the only candidate is a result.
fn refuse_swapped(options: &CompareOptions) -> Result<(), Error> {
    let reference = &options.reference;
    match &options.candidates[..] {
        [candidate] if reference.is_file() && !is_hdf5(reference) && ResultFile::open(candidate).is_ok() => {
            let (table, result) = (reference.display(), candidate.display());
            let why = format!(
                "no result of this program, but {result} is; the reference comes first: stickslip compare {result} {table}"
            );
            Err(Error::of_file(reference, why))
        }
        _ => Ok(()),
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
fn figures(
    (reference, mapping): (&Reference, &Mapping),
    comparison: &Comparison,
    (report, number): (&Output, usize),
) -> Vec<PagePart> {
    let stem = report.path().file_stem().unwrap_or_default().to_string_lossy();
    let drawn = || -> Result<Vec<PagePart>, Error> {
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
                svg: Drawing {
                    source: report.source().to_owned(),
                    ..plot::draw(figure, WIDTH)
                }
                .svg(),
            }))
        };
        beside.figures(comparison)?.iter().map(part).collect()
    };
    drawn().unwrap_or_else(|error| vec![PagePart::Text(format!("no figure: {error}"))])
}

/// The place of a report.
struct ReportTarget {
    output: Output,
    html: bool,
    force: bool,
}

impl ReportTarget {
    /// Refuses unknown formats, inputs, and existing files that are not reports, before anything is computed.
    fn new(path: &Path, options: &CompareOptions) -> Result<ReportTarget, Error> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let html = match extension.as_deref() {
            Some("html" | "htm") => true,
            Some("md") => false,
            _ => {
                let why = "a report is written as HTML or Markdown; give it the extension .html or .md";
                return Err(Error::of_file(path, why));
            }
        };
        let files = options.candidates.iter().chain([&options.reference]);
        let inputs: Vec<PathBuf> = files.chain(&options.map).chain(&options.events).cloned().collect();
        let force = options.force;
        let output = Output::new(path, Product::Report, &inputs, force)?;
        Ok(ReportTarget { output, html, force })
    }

    /// Writes the report. Figures of a Markdown report are files next to it, which replace only figures of this
    /// program.
    fn write(&self, pages: &[Page]) -> Result<(), Error> {
        let mark = format!("{REPORT}{}", self.output.source());
        if self.html {
            return self.output.write(&[html(pages, &mark).as_bytes()]);
        }
        for part in pages.iter().flat_map(|page| &page.parts) {
            let PagePart::Figure(figure) = part else { continue };
            let path = self.output.path().with_file_name(&figure.file);
            let product = Product::Figure(Product::Report.option());
            Output::made_from(&path, product, (&[], self.output.source().to_owned()), self.force)?
                .write(&[figure.svg.as_bytes()])?;
        }
        self.output.write(&[markdown(pages, &mark).as_bytes()])
    }
}
