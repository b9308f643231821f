//! What the page knows of a run, as the JSON document that its script reads.

use serde::Serialize;
use std::rc::Rc;

use super::form::{Form, Panel, Portrait};
use super::orbit::Orbit;
use super::pair::{Pair, paired};
use super::sparse::Sparse;
use super::trajectory::Trajectory;
use crate::analysis::certificate::Verdict;
use crate::analysis::headline::{self, HeadlineRow, is_paper_case};
use crate::model::Mode;
use crate::plot::PlotError;
use crate::plot::html::{Codes, Doubles};
use crate::plot::sides::Sides;
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

/// What a page has of each of its runs, but for the trajectory.
#[derive(Debug, Serialize)]
struct OneRun {
    title: String,
    /// Name of the result file, without its folder.
    file: String,
    /// complete, interrupted or failed.
    status: &'static str,
    /// mu_0 r, m: the contact force times this is the torque that stick can carry.
    breakaway_arm: Option<f64>,
    /// UDUNITS of what the interface transmits.
    torque_unit: &'static str,
    modes: Modes,
    events: Events,
    sparse: Sparse,
}

/// Everything but the trajectory.
#[derive(Debug, Serialize)]
pub(super) struct Document<'a> {
    #[serde(flatten)]
    run: OneRun,
    /// What a reader of an unfinished run has to know.
    notice: Option<String>,
    /// T_n, s.
    natural_period: Option<f64>,
    beside_paper: bool,
    headline: Vec<HeadlineRow>,
    certificate: Option<Certificate>,
    /// What the certificate says of each event.
    certified: Option<Certified>,
    provenance: Vec<(String, String)>,
    case_text: String,
    resolved: String,
    cycles: Cycles,
    /// How to get what sparse stretches lack.
    remedy: Option<String>,
    panels: &'a [Panel],
    portraits: &'a [Portrait],
    /// Of a run that does not stop.
    #[serde(skip_serializing_if = "Option::is_none")]
    orbit: Option<Orbit>,
    notes: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) second: Option<Second>,
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
    uncertainty: Doubles,
    verdict: Codes,
    /// By code.
    verdicts: Vec<&'static str>,
}

#[derive(Debug, Serialize)]
struct CertificateColumn {
    name: String,
    unit: String,
    description: String,
    rows: usize,
    values: Doubles,
}

/// Stretch k is from `start` k to `start` k + 1, the last to the end of the run.
#[derive(Debug, Serialize)]
struct Modes {
    /// By code.
    names: Vec<&'static str>,
    start: Doubles,
    code: Codes,
}

#[derive(Debug, Serialize)]
struct Events {
    /// In the file.
    count: usize,
    /// By code.
    kinds: Vec<&'static str>,
    time: Doubles,
    kind: Codes,
    mode_after: Codes,
    /// N.
    internal_force: Doubles,
    states: Vec<EventState>,
}

/// A channel on both sides of each event, exactly.
#[derive(Debug, Serialize)]
struct EventState {
    name: String,
    before: Doubles,
    after: Doubles,
}

/// The cycles of stick-slip: durations in s, and when each begins.
#[derive(Debug, Serialize)]
struct Cycles {
    start: Doubles,
    stick_duration: Doubles,
    slip_duration: Doubles,
}

/// What a page has of the second run.
#[derive(Debug, Serialize)]
pub(super) struct Second {
    #[serde(flatten)]
    run: OneRun,
    /// Indices of events that stand for each other, in the first and in the second run.
    pairs: Vec<(usize, usize)>,
    pub(super) trajectory: Option<Trajectory>,
}

impl Second {
    /// Without its trajectory, beside a first run with these events and this form.
    pub(super) fn of(pair: &Pair, events: &[Event], form: &Form) -> Result<Second, PlotError> {
        let own = shown(&pair.events, &pair.form);
        Ok(Second {
            run: OneRun::of(pair.file, &pair.form, &pair.events, &mut Vec::new())?,
            pairs: paired(shown(events, form), own, pair.form.natural_period()),
            trajectory: None,
        })
    }
}

impl OneRun {
    /// Of a file with these events; what is cut is said in `notes`.
    fn of(file: &ResultFile, form: &Form, events: &[Event], notes: &mut Vec<String>) -> Result<OneRun, PlotError> {
        Ok(OneRun {
            title: file.title().to_owned(),
            file: file_name(file),
            status: file.status().name(),
            breakaway_arm: form.breakaway_arm,
            torque_unit: form.torque_unit,
            modes: modes(file, notes)?,
            events: Events::of(shown(events, form), form, events.len()),
            sparse: form.run.as_deref().map_or_else(|| Ok(Sparse::default()), Sparse::of)?,
        })
    }
}

impl Document<'_> {
    /// Of a file with these events.
    pub(super) fn of<'a>(file: &ResultFile, form: &'a Form, all_events: &[Event]) -> Result<Document<'a>, PlotError> {
        let mut notes = Vec::new();
        let case = form.run.as_ref().map(|run| &run.case);
        let events = shown(all_events, form);
        if events.len() < all_events.len() {
            notes.push(format!(
                "The page lists the first {} of {} events.",
                events.len(),
                all_events.len()
            ));
        }
        let mut orbit = None;
        if let Some(run) = form.run.as_ref().filter(|run| !run.stops()) {
            let (found, note) = Orbit::of(run)?;
            notes.extend(note);
            orbit = Some(found);
        }
        let case_text = shortened(file.case_text()?, "case", &mut notes);
        let resolved = shortened(file.resolved()?, "resolved case", &mut notes);
        let run = OneRun::of(file, form, all_events, &mut notes)?;
        Ok(Document {
            notice: notice(file)?,
            natural_period: form.natural_period(),
            beside_paper: case.is_some_and(is_paper_case),
            headline: headline::of_file(file, case, all_events)?,
            certified: certified(file, events.len())?,
            certificate: certificate(file)?,
            provenance: provenance(file)?,
            case_text,
            resolved,
            cycles: cycles(all_events, events),
            remedy: run.sparse.remedy(&run.file),
            panels: &form.panels,
            portraits: &form.portraits,
            run,
            orbit,
            notes,
            second: None,
        })
    }
}

/// The events on a page: the first ones, as far as there is room for the states on both sides of them.
fn shown<'a>(all: &'a [Event], form: &Form) -> &'a [Event] {
    let room = EVENTS.min(EVENT_VALUES / form.sides.len().max(1));
    &all[..all.len().min(room)]
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
        values: values.into_iter().collect(),
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
    let uncertainty = file.event_column(schema::TIME_UNCERTAINTY)?;
    let whole = verdict.len() == events && uncertainty.len() >= events;
    Ok(whole.then(|| Certified {
        uncertainty: uncertainty.into_iter().take(events).collect(),
        verdict: verdict.iter().map(|&code| code as i8).collect(),
        verdicts: Verdict::ALL.iter().map(|verdict| verdict.name()).collect(),
    }))
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

fn file_name(file: &ResultFile) -> String {
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

impl Events {
    /// Of the first `events` of `count`.
    fn of(events: &[Event], form: &Form, count: usize) -> Events {
        let state = |(name, sides): &(String, Rc<Sides>)| EventState {
            name: name.clone(),
            before: sides.before.iter().take(events.len()).copied().collect(),
            after: sides.after.iter().take(events.len()).copied().collect(),
        };
        Events {
            count,
            kinds: EventKind::ALL.iter().map(|kind| kind.name()).collect(),
            time: events.iter().map(|event| event.time).collect(),
            kind: events.iter().map(|event| event.kind.code()).collect(),
            mode_after: events.iter().map(|event| event.mode_after.code()).collect(),
            internal_force: events.iter().map(|event| event.internal_force).collect(),
            states: form.sides.iter().map(state).collect(),
        }
    }
}

/// The cycles of all events that begin with one of `events`, the first of them.
fn cycles(all: &[Event], events: &[Event]) -> Cycles {
    let (_, cycles) = CycleStatistics::of_events(all.iter().map(|event| (event.time, event.kind)));
    let sticks = events.iter().filter(|event| event.kind == EventKind::Stick);
    let both = || sticks.clone().zip(&cycles);
    Cycles {
        start: both().map(|(stick, _)| stick.time).collect(),
        stick_duration: both().map(|(_, cycle)| cycle.stick_duration).collect(),
        slip_duration: both().map(|(_, cycle)| cycle.slip_duration).collect(),
    }
}

/// From the segments, and after the last of them (in an unfinished file) from the samples.
fn modes(file: &ResultFile, notes: &mut Vec<String>) -> Result<Modes, ResultError> {
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
        start: starts.into_iter().collect(),
        code: codes.into_iter().collect(),
    })
}
