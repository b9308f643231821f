//! `stickslip compare`: compares the result of another solver with a reference.

mod drawn;
mod pages;
mod target;

use super::arguments::{Common, CompareOptions};
use super::input::{columns, open_reference};
use super::progress::{BarKind, watched};
use super::{CommandEnd, tell};
use crate::Error;
use crate::report::{Page, PagePart, Report};
use serde::Serialize;
use std::sync::Arc;
use stickslip_compare::{CompareError, Comparison, Mapping, Reference, Requirement};

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

pub(super) fn compare(options: &CompareOptions, common: &Common) -> Result<CommandEnd, Error> {
    let requirements = options.require.iter().map(|text| Requirement::parse(text));
    let requirements = requirements.collect::<Result<Vec<_>, _>>().map_err(Error::input)?;
    let report = options.report.as_deref();
    let report = report
        .map(|path| target::ReportTarget::new(path, options))
        .transpose()?;
    let reference = open_reference(&options.reference)?;
    let mapping = mapping(options, &reference)?;
    let comparisons = options.candidates.iter().map(|path| {
        let comparison = watched(common, BarKind::Share, &Arc::default(), |bar| {
            reference.compare_watched(path, &mapping, &mut |progress| bar.comparison(progress, path))
        });
        Ok(comparison?)
    });
    let comparisons = comparisons.collect::<Result<Vec<_>, Error>>()?;
    let shortfalls: Vec<String> = comparisons
        .iter()
        .flat_map(|comparison| requirements.iter().filter_map(|r| r.shortfall(comparison)))
        .collect();
    if let Some(target) = report {
        let page = |(number, c): (usize, &Comparison)| {
            let mut page = pages::page(c, pages::Length::Whole);
            let figures = drawn::figures((&reference, &mapping), c, (target.output.path(), number));
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
        false => Err(Error::computation(shortfalls.join("; "))),
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
