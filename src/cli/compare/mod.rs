//! `stickslip compare`: compares the result of another solver with a reference.

mod drawn;
mod pages;
mod render;
mod target;

use super::arguments::{Common, CompareOptions};
use super::input::columns;
use super::progress::{Bar, BarKind};
use super::reference::open_reference;
use super::{CommandEnd, CommandError, print, print_json, wants_json, wants_text};
use std::sync::Arc;
use stickslip_compare::{CompareError, Comparison, Mapping, Reference, Requirement};

pub(super) fn compare(options: &CompareOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let requirements = options.require.iter().map(|text| Requirement::parse(text));
    let requirements = requirements
        .collect::<Result<Vec<_>, _>>()
        .map_err(CommandError::input)?;
    let report = options.report.as_deref();
    let report = report
        .map(|path| target::ReportTarget::check(path, options))
        .transpose()?;
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
            let figures = drawn::figures((&reference, &mapping), c, (target.path(), number));
            // The figures follow the paragraph about the files.
            page.parts.splice(1..1, figures);
            page
        };
        let pages: Vec<_> = comparisons.iter().enumerate().map(page).collect();
        target.write(&pages, &shortfalls)?;
    }
    if wants_json(common) {
        // Shortfalls are the failed requirements in words.
        print_json(&document! { comparisons: &comparisons, shortfalls: &shortfalls })?;
    }
    if wants_text(common) {
        let pages = comparisons.iter().map(|c| pages::page(c, pages::Length::Screen));
        print(&render::terminal(&pages.collect::<Vec<_>>()))?;
    }
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
