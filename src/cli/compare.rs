//! `stickslip compare`: compares the result of another solver with a reference.

use super::arguments::{Common, CompareOptions};
use super::progress::{BarKind, watched};
use super::{CommandEnd, tell};
use crate::Error;
use crate::comparing::{MappingOptions, open_reference, refuse_swapped};
use crate::output::{Output, Product};
use crate::plot::comparison::DrawnCandidate;
use crate::plot::signature::REPORT;
use crate::plot::{self, Drawing, DrawnRun, Figure};
use crate::report::{CompareReport, DrawnPage, Page, PagePart, comparison_page, html, markdown};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use stickslip_compare::{Comparison, Mapping, Reference, Requirement};

pub(super) fn compare(options: &CompareOptions, common: &Common) -> Result<CommandEnd, Error> {
    let requirements = options.require.iter().map(|text| Requirement::parse(text));
    let requirements = requirements.collect::<Result<Vec<_>, _>>().map_err(Error::input)?;
    let report = options.report.as_deref();
    let report = report.map(|path| ReportTarget::new(path, options)).transpose()?;
    refuse_swapped(&options.reference, &options.candidates)?;
    let reference = open_reference(&options.reference)?;
    let mapping = MappingOptions {
        map: options.map.as_deref(),
        columns: &options.columns,
        events: options.events.as_deref(),
        time_offset: options.time_offset.as_deref(),
        velocity_tolerance: options.velocity_tolerance.as_deref(),
        hysteresis: options.hysteresis,
        quick: options.quick,
        max_wall_time: options.max_wall_time.as_deref(),
    };
    let mapping = mapping.of(&reference)?;
    let comparisons = options.candidates.iter().map(|path| {
        let comparison = watched(common, BarKind::Share, &Arc::default(), |bar| {
            reference.compare_watched(path, &mapping, bar)
        });
        Ok(comparison?)
    });
    let comparisons = comparisons.collect::<Result<Vec<_>, Error>>()?;
    let mut told = CompareReport::new(&comparisons, &requirements);
    if let Some(target) = &report {
        let page = |(number, c): (usize, &Comparison)| {
            let mut page = comparison_page(c, true);
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
        if !told.shortfalls.is_empty() {
            pages.push(Page::new("Fell short", "").with(PagePart::List(told.shortfalls.clone())));
        }
        target.write(&pages)?;
    }
    told.file = report.map(|target| target.output.path().display().to_string());
    tell(common, &told)?;
    match told.shortfalls.is_empty() {
        true => Ok(CommandEnd::Done),
        false => Err(Error::computation(told.shortfalls.join("; "))),
    }
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
