//! The sweep file, made from the journal.

use super::QUANTITIES;
use super::axis::ParameterAxis;
use super::curves::Boundaries;
use super::journal::{NO_COUNT, is_open};
use super::run::{NAMED_FAILURES, SweepReport};
use super::runner::Running;
use super::study::Study;
use crate::error::Error;
use crate::provenance;
use std::path::Path;
use stickslip_case::{Motion, Setting};
use stickslip_files::schema::{META_MOTION, META_SHOW, StorageKind, Variable};
use stickslip_files::{
    AttributeValue, EventForm, Overwrite, Reservation, ShardPlan, Status, StudyHeader, SweepLayout, SweepPlan,
    SweepRow, SweepWriter,
};

/// Largest number of points for which a partial file lists all points. If a larger study is less than a quarter done,
/// the partial file has a table of the finished points only, so its cost follows their number.
const MOST_MISSING: u64 = 65_536;

pub(crate) fn header(study: &Study, command: &str, digest: String, meta: Vec<(String, AttributeValue)>) -> StudyHeader {
    let head = &study.head;
    StudyHeader {
        references: Some(head.words.references().to_owned()),
        digest,
        inputs: vec![StudyHeader::case_of_sweep(head.base.text.clone())],
        meta,
        ..head.of_file(format!("stickslip {command} {}", head.source.name))
    }
}

fn meta(study: &Study) -> Vec<(String, AttributeValue)> {
    let mut meta = provenance::build();
    if let Some(tolerance) = study.default_tolerance() {
        meta.push(("default_rtol".to_owned(), AttributeValue::Number(tolerance)));
    }
    meta.extend(provenance::point_command(study.point_command()));
    let motion = study.head.words.motion_attribute();
    meta.extend(motion.map(|motion| (META_MOTION.to_owned(), AttributeValue::Text(motion.to_owned()))));
    if !study.show.is_empty() {
        meta.push((META_SHOW.to_owned(), AttributeValue::Text(study.show.join(" "))));
    }
    meta
}

pub(super) fn write(
    (path, overwrite): (&Path, Overwrite),
    running: &mut Running,
    part: Option<&ShardPlan>,
    boundaries: Option<Boundaries>,
    interrupted: bool,
) -> Result<SweepReport, Error> {
    let study = running.study;
    let count = running.count();
    let words: Vec<Vec<String>> = (0..study.axes.len()).map(|k| words_of(running, k)).collect();
    let code = |axis: usize, value: &Setting| match value.as_number() {
        Some(number) if words[axis].is_empty() => number,
        _ => words[axis].iter().position(|word| *word == value.word()).unwrap_or(0) as f64,
    };
    let axes = study.axes.iter().enumerate().map(|(k, axis)| {
        let values = axis.levels.iter().map(|level| code(k, level));
        axis.in_a_file(&words[k], values.collect())
    });
    let total = part.map_or(count, |part| part.points() as u64);
    let few = interrupted && total > MOST_MISSING && running.journal.points() < total / 4;
    let done: Option<Vec<u64>> = few.then(|| running.journal.numbers().collect());
    // A shard's points are not a grid.
    let layout = match part.is_some() || done.is_some() {
        true => SweepLayout::Table,
        false => study.layout(),
    };
    let plan = SweepPlan {
        layout,
        axes: axes.collect(),
        variables: sweep_variables(study),
        points: done.as_ref().map_or(total as usize, Vec::len),
        events: study.keep.events.then(|| event_form(study)),
        shard: part.cloned(),
    };
    let header = header(study, "sweep", study.digest(), meta(study));
    let mut writer = SweepWriter::create(Reservation::take(path, overwrite, &study.head.files)?, &header, &plan)?;
    let mut report = SweepReport {
        interrupted,
        ..SweepReport::default()
    };
    let mut unfinished = 0;
    let numbers: Box<dyn Iterator<Item = u64>> = match done {
        Some(done) => Box::new(done.into_iter()),
        None => Box::new((0..count).filter(|&number| part.is_none_or(|part| part.holds(number)))),
    };
    for number in numbers {
        let mut row = SweepRow {
            number,
            ..SweepRow::default()
        };
        if layout == SweepLayout::Table {
            let values = running.coordinates(number);
            row.coordinates = values.iter().enumerate().map(|(k, value)| code(k, value)).collect();
        }
        if let Some(outcome) = running.journal.read(number)? {
            report.points += 1;
            row.events = outcome.events;
            match outcome.result {
                Ok(mut values) => {
                    // The journal of an earlier version lacks the quantities that were added since.
                    values.resize(QUANTITIES.len(), f64::NAN);
                    unfinished += u64::from(is_open(&values));
                    row.values = Some(values);
                }
                Err(message) => {
                    report.failed += 1;
                    if report.failures.len() < NAMED_FAILURES {
                        report.failures.push((number, message.clone()));
                    }
                    row.failure = Some(message);
                }
            }
        }
        writer.push(row)?;
    }
    if let Some(boundaries) = &boundaries {
        boundaries.write(study, &mut writer)?;
    }
    Ok(SweepReport {
        file: writer.finish(&Status::of(interrupted))?,
        unfinished: Some(unfinished),
        boundaries,
        ..report
    })
}

pub(crate) fn event_form(study: &Study) -> EventForm {
    EventForm {
        numbers_parts: study.head.words.numbers_parts(),
        translation: study.head.words.motion() == Motion::Translation,
    }
}

pub(crate) fn sweep_variables(study: &Study) -> Vec<Variable> {
    let variables = QUANTITIES.iter().map(|quantity| Variable {
        name: quantity.name.to_owned(),
        kind: if quantity.is_count() {
            StorageKind::Int64
        } else {
            StorageKind::Float64
        },
        units: quantity.unit(study.head.words.motion()).to_owned(),
        long_name: quantity.description.to_owned(),
        fill: quantity.is_count().then_some(NO_COUNT),
        flags: quantity
            .flags()
            .iter()
            .map(|&(code, word)| (code, word.to_owned()))
            .collect(),
    });
    variables.collect()
}

/// Distinct words on an axis, in the order of their first points; empty if all values are numbers.
fn words_of(running: &Running, axis: usize) -> Vec<String> {
    let ParameterAxis { levels, range, .. } = &running.study.axes[axis];
    if range.is_some() {
        return Vec::new();
    }
    let of_points = || (0..running.count()).map(|number| running.coordinates(number)[axis].clone());
    let values: Vec<Setting> = match levels.is_empty() {
        true => of_points().collect(),
        false => levels.clone(),
    };
    if values.iter().all(|value| value.as_number().is_some()) {
        return Vec::new();
    }
    let mut words: Vec<String> = Vec::new();
    for value in values {
        let word = value.word();
        if !words.contains(&word) {
            words.push(word);
        }
    }
    words
}
