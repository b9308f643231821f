//! Facts about a run as a JSON document for the page's script.

use super::form::{PageForm, PagePanel, PagePortrait, has_stick};
use super::pair::{PagePair, paired};
use super::trajectory::PageTrajectory;
use crate::plot::html::{Codes, Doubles, file_name};
use crate::plot::portraits::{ShownPortrait, few_samples, shown};
use crate::plot::run::{Sides, widest_gap};
use crate::plot::{DrawnRun, Error};
use serde::Serialize;
use std::rc::Rc;
use stickslip_analysis::analysis::certificate::Verdict;
use stickslip_analysis::analysis::headline::{self, HeadlineRow, is_paper_case};
use stickslip_files::schema::{self, group, root};
use stickslip_files::{AttributeValue, ResultError, ResultFile};
use stickslip_system::model::Mode;
use stickslip_system::record::{CycleStatistics, Event, EventKind};

/// Limits of a page: events with their states.
const EVENTS: usize = 5_000;
/// Values of channels on one side of all events.
const EVENT_VALUES: usize = 100_000;
const MODES: usize = 20_000;
const TEXT: usize = 200_000;
const CERTIFICATE_ROWS: usize = 1_000;

/// Attributes of /certificate in words; others are read as they are named.
const CERTIFICATE_WORDS: [(&str, &str); 7] = [
    ("verdict_of_all", "verdict"),
    ("digits", "digits of the least known event"),
    ("digits_of_double", "digits that double precision can hold"),
    ("growth_exponent", "growth exponent G"),
    ("growth_to_onset", "of it up to the first stick"),
    ("kick_above_noise", "kick above rounding, e-folds"),
    ("kick_above_methods", "kick above the methods' own noise, e-folds"),
];

#[derive(Debug, Serialize)]
struct OneRun {
    file: String,
    status: &'static str,
    /// mu_0 r, m, of forward and of backward sliding: multiplied by the contact force, the largest stick torque.
    breakaway_arms: Option<[f64; 2]>,
    torque_unit: &'static str,
    modes: PageModes,
    events: Events,
    sparse: Sparse,
    remedy: Option<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct RunContent<'a> {
    #[serde(flatten)]
    run: OneRun,
    /// T_n, s.
    natural_period: Option<f64>,
    beside_paper: bool,
    headline: Vec<HeadlineRow>,
    certificate: Option<PageCertificate>,
    certified: Option<PageCertified>,
    provenance: Vec<(String, String)>,
    case_text: String,
    resolved: String,
    cycles: Cycles,
    panels: &'a [PagePanel],
    portraits: &'a [PagePortrait],
    #[serde(skip_serializing_if = "Option::is_none")]
    orbit: Option<PageOrbit>,
    notes: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) second: Option<Second>,
    pub(super) trajectory: Option<PageTrajectory>,
}

#[derive(Debug, Serialize)]
struct PageCertificate {
    attributes: Vec<(String, String)>,
    columns: Vec<CertificateColumn>,
}

#[derive(Debug, Serialize)]
struct PageCertified {
    /// s; infinite or NaN: unknown.
    uncertainty: Doubles,
    verdict: Codes,
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

/// Stretch k is from `start[k]` to `start[k + 1]`, or to the end of the run.
#[derive(Debug, Serialize)]
struct PageModes {
    names: Vec<&'static str>,
    start: Doubles,
    code: Codes,
}

#[derive(Debug, Serialize)]
struct Events {
    /// Number in the file.
    count: usize,
    kinds: Vec<&'static str>,
    time: Doubles,
    kind: Codes,
    mode_after: Codes,
    /// N.
    internal_force: Doubles,
    states: Vec<EventState>,
}

/// Exact values of a channel on both sides of each event.
#[derive(Debug, Serialize)]
struct EventState {
    name: String,
    before: Doubles,
    after: Doubles,
}

/// Stick-slip cycles: starts and durations, s.
#[derive(Debug, Serialize)]
struct Cycles {
    start: Doubles,
    stick_duration: Doubles,
    slip_duration: Doubles,
}

#[derive(Debug, Serialize)]
pub(super) struct Second {
    #[serde(flatten)]
    run: OneRun,
    /// Indices of matching events in the first and the second run.
    pairs: Vec<(usize, usize)>,
    pub(super) trajectory: Option<PageTrajectory>,
}

impl Second {
    /// `events` and `form` belong to the first run.
    pub(super) fn of(pair: &PagePair, events: &[Event], form: &PageForm) -> Result<Second, Error> {
        let own = listed(&pair.events, &pair.form);
        Ok(Second {
            run: OneRun::of(pair.file, &pair.form, &pair.events, &mut Vec::new())?,
            pairs: paired(listed(events, form), own, pair.form.natural_period()),
            trajectory: None,
        })
    }
}

impl OneRun {
    /// `events` are those of the file; cuts are added to `notes`.
    fn of(file: &ResultFile, form: &PageForm, events: &[Event], notes: &mut Vec<String>) -> Result<OneRun, Error> {
        let (name, run) = (file_name(file.path()), form.run());
        let sparse = run.map_or_else(|| Ok(Sparse::default()), Sparse::of)?;
        Ok(OneRun {
            remedy: sparse.remedy(&name),
            file: name,
            status: file.status().name(),
            breakaway_arms: form.breakaway_arms(),
            torque_unit: form.torque_unit(),
            modes: modes(file, notes)?,
            events: Events::of(listed(events, form), form, events.len()),
            sparse,
        })
    }
}

impl RunContent<'_> {
    pub(super) fn of<'a>(file: &ResultFile, form: &'a PageForm, all_events: &[Event]) -> Result<RunContent<'a>, Error> {
        let mut notes = Vec::new();
        let case = form.run().map(|run| &run.case);
        let events = listed(all_events, form);
        if events.len() < all_events.len() {
            notes.push(format!(
                "The page lists the first {} of {} events.",
                events.len(),
                all_events.len()
            ));
        }
        let mut orbit = None;
        if let Some(run) = form.run().filter(|run| !run.stops()) {
            let (found, note) = PageOrbit::of(run)?;
            notes.extend(note);
            orbit = Some(found);
        }
        let case_text = shortened(file.case_text()?, "case", &mut notes);
        let resolved = shortened(file.resolved()?, "resolved case", &mut notes);
        let run = OneRun::of(file, form, all_events, &mut notes)?;
        Ok(RunContent {
            natural_period: form.natural_period(),
            beside_paper: case.is_some_and(is_paper_case),
            headline: headline::of_file(file, case, all_events)?,
            certified: certified(file, events.len())?,
            certificate: certificate(file)?,
            provenance: provenance(file)?,
            case_text,
            resolved,
            cycles: cycles(all_events, events),
            panels: &form.panels,
            portraits: &form.portraits,
            run,
            orbit,
            notes,
            second: None,
            trajectory: None,
        })
    }
}

/// The first events, as far as their states fit on the page.
fn listed<'a>(all: &'a [Event], form: &PageForm) -> &'a [Event] {
    let room = EVENTS.min(EVENT_VALUES / form.sides.len().max(1));
    &all[..all.len().min(room)]
}

fn certificate(file: &ResultFile) -> Result<Option<PageCertificate>, ResultError> {
    let Some(group) = file.added_group(group::CERTIFICATE, CERTIFICATE_ROWS)? else {
        return Ok(None);
    };
    // In the order of the words, then the others. Empty ones and those that this case does not have are left out.
    let place = |name: &str| CERTIFICATE_WORDS.iter().position(|words| words.0 == name);
    let mut attributes = group.attributes;
    attributes.retain(|(_, value)| !matches!(value, AttributeValue::Number(number) if number.is_nan()));
    attributes.sort_by_key(|(name, _)| place(name).unwrap_or(CERTIFICATE_WORDS.len()));
    let attributes = attributes.into_iter().map(|(name, value)| {
        let words = place(&name).map_or_else(|| name.replace('_', " "), |k| CERTIFICATE_WORDS[k].1.to_owned());
        (words, as_read(&rounded(value)))
    });
    let columns = group
        .columns
        .into_iter()
        .map(|(column, rows, values)| CertificateColumn {
            name: column.name,
            unit: column.units,
            description: column.long_name,
            rows,
            values: values.into_iter().collect(),
        });
    Ok(Some(PageCertificate {
        attributes: attributes.filter(|(_, value)| !value.is_empty()).collect(),
        columns: columns.collect(),
    }))
}

fn certified(file: &ResultFile, events: usize) -> Result<Option<PageCertified>, ResultError> {
    let Some(group) = file.added_group(group::CERTIFICATE, events)? else {
        return Ok(None);
    };
    let Some((.., verdict)) = group.columns.into_iter().find(|(column, ..)| column.name == "verdict") else {
        return Ok(None);
    };
    let uncertainty = file.event_column(schema::TIME_UNCERTAINTY)?;
    let whole = verdict.len() == events && uncertainty.len() >= events;
    Ok(whole.then(|| PageCertified {
        uncertainty: uncertainty.into_iter().take(events).collect(),
        verdict: verdict.iter().map(|&code| code as i8).collect(),
        verdicts: Verdict::WORDS.map(|(_, word)| word).into(),
    }))
}

/// Six digits of a number that is not whole.
fn rounded(value: AttributeValue) -> AttributeValue {
    match value {
        AttributeValue::Number(number) if number.fract() != 0.0 => {
            AttributeValue::Number(format!("{number:.5e}").parse().unwrap_or(number))
        }
        other => other,
    }
}

/// An attribute as text: whole numbers without a decimal point.
fn as_read(value: &AttributeValue) -> String {
    // Larger whole numbers are not exact.
    const WHOLE: f64 = 1e15;
    match value {
        AttributeValue::Number(number) if number.fract() == 0.0 && number.abs() < WHOLE => format!("{number:.0}"),
        _ => value.to_string(),
    }
}

fn provenance(file: &ResultFile) -> Result<Vec<(String, String)>, ResultError> {
    let mut rows = vec![("file".to_owned(), file_name(file.path()))];
    for name in [root::SOURCE, root::HISTORY, root::REFERENCES] {
        rows.push((name.to_owned(), file.text(name)?));
    }
    rows.extend(
        file.meta()?
            .into_iter()
            .map(|(name, value)| (name, as_read(&rounded(value)))),
    );
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
    /// `count`: number in the file.
    fn of(events: &[Event], form: &PageForm, count: usize) -> Events {
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

/// The cycles that begin with one of `events`, which are the first of `all`.
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

/// Modes from the segments and, after the last one of an unfinished file, from the samples.
fn modes(file: &ResultFile, notes: &mut Vec<String>) -> Result<PageModes, ResultError> {
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
        // The rest has no colour.
        codes.push(-1);
    }
    Ok(PageModes {
        names: Mode::ALL.iter().map(|mode| mode.name()).collect(),
        start: starts.into_iter().collect(),
        code: codes.into_iter().collect(),
    })
}

const POINTS: usize = 30_000;

/// One period of the attractor, or the end of a run that is not periodic.
#[derive(Debug, Serialize)]
pub(super) struct PageOrbit {
    id: &'static str,
    heading: &'static str,
    hint: String,
    /// Start and end, s.
    from: f64,
    to: f64,
    period: Option<f64>,
    x: OrbitAxis,
    y: OrbitAxis,
    lines: Vec<OrbitLine>,
}

#[derive(Debug, Serialize)]
struct OrbitAxis {
    label: String,
    unit: String,
}

#[derive(Debug, Serialize)]
struct OrbitLine {
    mode: &'static str,
    x: Doubles,
    y: Doubles,
}

impl PageOrbit {
    /// The orbit of the figure `phase-portrait`, and a note on omitted points.
    pub(super) fn of(run: &DrawnRun) -> Result<(PageOrbit, Option<String>), Error> {
        let ShownPortrait { axes, window, periodic } = shown(run);
        let period = run.attractor_period.filter(|_| periodic);
        let (heading, span) = match period {
            Some(period) => ("Last period", format!("the last {period:.6} s")),
            None => ("Phase portrait", "the run".to_owned()),
        };
        let colours = match has_stick(&run.system) {
            true => ": vermilion in stick, blue and purple in slip.",
            false => ".",
        };
        let few = few_samples(run, window)?.map(|few| few.replacen("it", " It", 1) + ".");
        let few = few.unwrap_or_default();
        let over = run.axis(axes.0)?.name;
        let window = run.shortened(window, POINTS)?;
        let axis = |channel: &str| -> Result<OrbitAxis, Error> {
            let axis = run.axis(channel)?;
            Ok(OrbitAxis {
                label: axis.short().to_owned(),
                unit: axis.unit,
            })
        };
        let (mut lines, mut room, mut cut) = (Vec::new(), POINTS, false);
        for (mode, pieces) in run.portrait(axes.0, axes.1, window)? {
            for mut piece in pieces {
                cut |= piece.len() > room;
                piece.truncate(room);
                room -= piece.len();
                lines.push(OrbitLine {
                    mode: mode.name(),
                    x: piece.iter().map(|point| point.0).collect(),
                    y: piece.iter().map(|point| point.1).collect(),
                });
            }
        }
        let note =
            cut.then(|| format!("The phase portrait is cut after {POINTS} points; `stickslip plot` draws all of it."));
        let orbit = PageOrbit {
            id: "portrait-orbit",
            heading,
            hint: format!("Relative velocity over {over}, of {span}{colours}{few}"),
            from: window.0,
            to: window.1,
            period,
            x: axis(axes.0)?,
            y: axis(axes.1)?,
            lines,
        };
        Ok((orbit, note))
    }
}

const MOST: usize = 5_000;

/// Samples in the shortest stretch after the remedy.
const SAMPLES_EACH: f64 = 20.0;

/// Largest number of samples in the remedy.
const MOST_SAMPLES: f64 = 1e6;

#[derive(Debug, Default, Serialize)]
pub(super) struct Sparse {
    /// Start and end, s.
    from: Doubles,
    to: Doubles,
    #[serde(skip)]
    stretches: Vec<(f64, f64)>,
}

impl Sparse {
    pub(super) fn of(run: &DrawnRun) -> Result<Sparse, Error> {
        let mut stretches = run.undersampled(run.times)?.stretches;
        let growth = growth(run)?;
        // Unless figures mark it already.
        let known = |end: f64| stretches.first().is_some_and(|first| first.0 < end);
        if let Some(growth) = growth.filter(|growth| !known(growth.1)) {
            stretches.insert(0, growth);
        }
        let shown = stretches.iter().take(MOST);
        Ok(Sparse {
            from: shown.clone().map(|stretch| stretch.0).collect(),
            to: shown.map(|stretch| stretch.1).collect(),
            stretches,
        })
    }

    /// The command that repeats the run `name` with enough samples.
    pub(super) fn remedy(&self, name: &str) -> Option<String> {
        let (from, to) = (self.stretches.first()?.0, self.stretches.last()?.1);
        // The stretch of growth is the first, and longer than a natural period.
        let lengths = self.stretches.iter().map(|(from, to)| to - from);
        let finest = lengths.fold(f64::INFINITY, f64::min) / SAMPLES_EACH;
        let wanted = finest.max((to - from) / MOST_SAMPLES);
        let power = 10f64.powf(wanted.log10().floor());
        let interval = [5.0, 2.0, 1.0]
            .into_iter()
            .map(|m| m * power)
            .find(|&one| one <= wanted)?;
        let margin = (to - from) * 0.02;
        let (from, to) = ((from - margin).max(0.0), to + margin);
        Some(format!(
            "stickslip run {name} -o NEW.h5 --set 'output.window=[{{from={from:.6}, to={to:.6}, interval={interval:.0e}}}]'"
        ))
    }
}

/// The part of the growth before the first contact event that has wider gaps than figures allow.
fn growth(run: &DrawnRun) -> Result<Option<(f64, f64)>, Error> {
    let Some(((begin, end), period)) = run.growth().zip(run.natural_period) else {
        return Ok(None);
    };
    let gap = widest_gap(period);
    let dense = run.dense_until((begin, end), gap)?.unwrap_or(begin);
    Ok((end - dense > gap).then_some((dense, end)))
}
