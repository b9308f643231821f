//! What the page knows of a run, as the JSON document that its script reads.

use serde::Serialize;

use super::encoding;
use super::form::Form;
use super::orbit::{Orbit, orbit};
use super::sparse::Sparse;
use crate::analysis::certificate::Verdict;
use crate::analysis::headline::HeadlineRow;
use crate::model::Mode;
use crate::plot::PlotError;
use crate::plot::html::doubles;
use crate::record::{CycleStatistics, Event, EventKind};
use crate::results::schema::{self, group, root};
use crate::results::{AttributeValue, ResultError, ResultFile, Status};

/// Events on a page, with their states.
const EVENTS: usize = 5_000;
/// Values of channels on one side of all events on a page.
const EVENT_VALUES: usize = 100_000;
/// Stretches of one mode on a page.
const MODES: usize = 20_000;
/// Characters of each of the two case texts.
const TEXT: usize = 200_000;
/// Values of each column of the certificate.
const CERTIFICATE_ROWS: usize = 1_000;

/// Everything but the trajectory.
#[derive(Debug, Serialize)]
pub(super) struct Document {
    title: String,
    /// Name of the result file, without its folder.
    file: String,
    /// complete, interrupted or failed.
    status: &'static str,
    /// What a reader of an unfinished run has to know.
    notice: Option<String>,
    /// T_n, s.
    natural_period: Option<f64>,
    /// mu_0 r, m: the contact force times this is the torque that stick can carry.
    breakaway_arm: Option<f64>,
    beside_paper: bool,
    headline: Vec<HeadlineRow>,
    /// UDUNITS of what the interface transmits.
    torque_unit: &'static str,
    certificate: Option<Certificate>,
    /// What the certificate says of each event.
    certified: Option<Certified>,
    provenance: Vec<(String, String)>,
    case_text: String,
    resolved: String,
    modes: Modes,
    events: Events,
    cycles: Cycles,
    sparse: Sparse,
    /// How to get what sparse stretches lack.
    remedy: Option<String>,
    /// Of a run that does not stop.
    #[serde(skip_serializing_if = "Option::is_none")]
    orbit: Option<Orbit>,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Certificate {
    /// (name, value)
    attributes: Vec<(String, String)>,
    columns: Vec<CertificateColumn>,
}

#[derive(Debug, Serialize)]
struct Certified {
    /// s; infinite, or no number, where nothing is known.
    uncertainty: String,
    verdict: String,
    /// By code.
    verdicts: Vec<&'static str>,
}

#[derive(Debug, Serialize)]
struct CertificateColumn {
    name: String,
    unit: String,
    description: String,
    rows: usize,
    values: String,
}

/// Stretch k is from `start` k to `start` k + 1, the last to the end of the run.
#[derive(Debug, Serialize)]
pub(super) struct Modes {
    /// By code.
    names: Vec<&'static str>,
    start: String,
    code: String,
}

#[derive(Debug, Serialize)]
pub(super) struct Events {
    /// In the file.
    count: usize,
    /// By code.
    kinds: Vec<&'static str>,
    time: String,
    kind: String,
    mode_after: String,
    /// N.
    internal_force: String,
    states: Vec<EventState>,
}

/// A channel on both sides of each event, exactly.
#[derive(Debug, Serialize)]
struct EventState {
    name: String,
    before: String,
    after: String,
}

/// The cycles of stick-slip: durations in s, and when each begins.
#[derive(Debug, Serialize)]
struct Cycles {
    start: String,
    stick_duration: String,
    slip_duration: String,
}

impl Document {
    pub(super) fn of(file: &ResultFile, form: &Form) -> Result<Document, PlotError> {
        let mut notes = Vec::new();
        let resolved = file.resolved()?;
        let all_events = file.events()?;
        let (headline, natural_period) = (form.headline(file, &all_events)?, form.natural_period());
        let events = shown(&all_events, form)?;
        let sparse = form.sparse()?;
        if events.len() < all_events.len() {
            notes.push(format!(
                "The page lists the first {} of {} events.",
                events.len(),
                all_events.len()
            ));
        }
        let case_text = file.case_text()?;
        let orbit = match form.run.as_ref().filter(|run| !run.stops()) {
            None => None,
            Some(run) => {
                let (orbit, note) = orbit(run)?;
                notes.extend(note);
                Some(orbit)
            }
        };
        Ok(Document {
            title: file.title().to_owned(),
            file: file_name(file),
            status: file.status().name(),
            notice: notice(file)?,
            natural_period,
            breakaway_arm: form.breakaway_arm,
            beside_paper: form.is_beside_paper(),
            headline,
            torque_unit: form.torque_unit,
            certified: certified(file, events.len())?,
            certificate: certificate(file)?,
            provenance: provenance(file)?,
            case_text: shortened(case_text, "case", &mut notes),
            resolved: shortened(resolved, "resolved case", &mut notes),
            modes: modes(file, &mut notes)?,
            cycles: cycles(&all_events, events),
            events: self::events(file, form, events, all_events.len())?,
            remedy: sparse.remedy(&file_name(file)),
            sparse,
            orbit,
            notes,
        })
    }
}

/// The events on a page: the first ones, as far as there is room for the states on both sides of them.
pub(super) fn shown<'a>(all: &'a [Event], form: &Form) -> Result<&'a [Event], PlotError> {
    let room = EVENTS.min(EVENT_VALUES / form.at_events()?.len().max(1));
    Ok(&all[..all.len().min(room)])
}

/// What a reader of a run that is not complete has to know.
fn notice(file: &ResultFile) -> Result<Option<String>, ResultError> {
    let samples = file.sample_count()?;
    let last = file.column("time", samples.saturating_sub(1)..samples)?;
    let until = match last.first() {
        Some(time) => format!("The page shows what the file holds, up to t = {time} s."),
        None => "The file has no samples.".to_owned(),
    };
    Ok(match file.status() {
        Status::Complete => None,
        Status::Interrupted => Some(format!(
            "This run is not complete: it was interrupted, or was still being written. {until}"
        )),
        Status::Failed(why) if why.is_empty() => Some(format!("This run failed. {until}")),
        Status::Failed(why) => Some(format!("This run failed: {}. {until}", why.trim_end_matches('.'))),
    })
}

fn certificate(file: &ResultFile) -> Result<Option<Certificate>, ResultError> {
    let Some(group) = file.added_group(group::CERTIFICATE, CERTIFICATE_ROWS)? else {
        return Ok(None);
    };
    let attributes = group
        .attributes
        .into_iter()
        .map(|(name, value)| (name, as_read(&value)));
    let columns = group.columns.into_iter().map(|(column, values)| CertificateColumn {
        name: column.name,
        unit: column.units,
        description: column.long_name,
        rows: column.rows,
        values: doubles(&values),
    });
    Ok(Some(Certificate {
        attributes: attributes.collect(),
        columns: columns.collect(),
    }))
}

/// What the certificate says of the first `events` events, if it speaks of events.
fn certified(file: &ResultFile, events: usize) -> Result<Option<Certified>, ResultError> {
    let Some(group) = file.added_group(group::CERTIFICATE, events)? else {
        return Ok(None);
    };
    let Some((_, verdict)) = group.columns.into_iter().find(|(column, _)| column.name == "verdict") else {
        return Ok(None);
    };
    let mut uncertainty = file.event_column(schema::TIME_UNCERTAINTY)?;
    uncertainty.truncate(events);
    let codes: Vec<i8> = verdict.iter().map(|&code| code as i8).collect();
    Ok(
        (codes.len() == events && uncertainty.len() == events).then(|| Certified {
            uncertainty: doubles(&uncertainty),
            verdict: encoding::codes(&codes),
            verdicts: Verdict::ALL.iter().map(|verdict| verdict.name()).collect(),
        }),
    )
}

/// An attribute as one writes it: a whole number without a decimal point.
fn as_read(value: &AttributeValue) -> String {
    // Whole numbers up to here are exact.
    const WHOLE: f64 = 1e15;
    match value {
        AttributeValue::Number(number) if number.fract() == 0.0 && number.abs() < WHOLE => format!("{number:.0}"),
        _ => value.to_string(),
    }
}

pub(super) fn file_name(file: &ResultFile) -> String {
    let name = file.path().file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Where the run is from: root attributes in words, then /meta by name.
fn provenance(file: &ResultFile) -> Result<Vec<(String, String)>, ResultError> {
    let mut rows = vec![("file".to_owned(), file_name(file))];
    for name in [root::SOURCE, root::HISTORY, root::REFERENCES] {
        rows.push((name.to_owned(), file.text(name)?));
    }
    rows.extend(file.meta()?.into_iter().map(|(name, value)| (name, as_read(&value))));
    Ok(rows)
}

fn shortened(mut text: String, what: &str, notes: &mut Vec<String>) -> String {
    if let Some((end, _)) = text.char_indices().nth(TEXT) {
        text.truncate(end);
        notes.push(format!(
            "The {what} is cut after {TEXT} characters; the file has all of it."
        ));
    }
    text
}

pub(super) fn events(file: &ResultFile, form: &Form, events: &[Event], count: usize) -> Result<Events, PlotError> {
    let times: Vec<f64> = events.iter().map(|e| e.time).collect();
    let kinds: Vec<i8> = events.iter().map(|e| e.kind.code()).collect();
    let modes: Vec<i8> = events.iter().map(|e| e.mode_after.code()).collect();
    let forces: Vec<f64> = events.iter().map(|e| e.internal_force).collect();
    let mut states = Vec::new();
    for name in form.at_events()? {
        let Some((mut before, mut after)) = form.sides(file, &name)? else {
            continue;
        };
        before.truncate(events.len());
        after.truncate(events.len());
        states.push(EventState {
            before: doubles(&before),
            after: doubles(&after),
            name,
        });
    }
    Ok(Events {
        count,
        kinds: EventKind::ALL.iter().map(|kind| kind.name()).collect(),
        time: doubles(&times),
        kind: encoding::codes(&kinds),
        mode_after: encoding::codes(&modes),
        internal_force: doubles(&forces),
        states,
    })
}

/// The cycles of all events that begin with one of `events`, the first of them.
fn cycles(all: &[Event], events: &[Event]) -> Cycles {
    let (_, cycles) = CycleStatistics::of_events(all.iter().map(|event| (event.time, event.kind)));
    let sticks = events.iter().filter(|e| e.kind == EventKind::Stick).map(|e| e.time);
    let (mut start, mut stick, mut slip) = (Vec::new(), Vec::new(), Vec::new());
    for (time, cycle) in sticks.zip(&cycles) {
        start.push(time);
        stick.push(cycle.stick_duration);
        slip.push(cycle.slip_duration);
    }
    Cycles {
        start: doubles(&start),
        stick_duration: doubles(&stick),
        slip_duration: doubles(&slip),
    }
}

/// From the segments, and after the last of them (in an unfinished file) from the samples.
pub(super) fn modes(file: &ResultFile, notes: &mut Vec<String>) -> Result<Modes, ResultError> {
    let (mut starts, mut codes) = (Vec::new(), Vec::new());
    let mut push = |time: f64, code: i8| {
        if codes.last() != Some(&code) {
            starts.push(time);
            codes.push(code);
        }
    };
    let mut end = f64::NEG_INFINITY;
    for segment in file.segments()? {
        push(segment.start, segment.mode.code());
        end = segment.end;
    }
    for (times, modes) in file.column_blocks("time")?.zip(file.column_blocks("mode")?) {
        for (time, mode) in times?.into_iter().zip(modes?) {
            if time > end {
                push(time, mode as i8);
            }
        }
    }
    if starts.len() > MODES {
        notes.push(format!(
            "The modes are shaded in their first {MODES} stretches only, up to t = {} s.",
            starts[MODES]
        ));
        starts.truncate(MODES + 1);
        codes.truncate(MODES);
        // From there on the ground that has no colour.
        codes.push(Mode::SlipForward.code());
    }
    Ok(Modes {
        names: Mode::ALL.iter().map(|mode| mode.name()).collect(),
        start: doubles(&starts),
        code: encoding::codes(&codes),
    })
}
