//! Facts about a run as a JSON document for the page's script.

use super::form::{PageForm, PagePanel, PagePortrait, has_stick};
use super::pair::{PagePair, paired};
use super::trajectory::PageTrajectory;
use crate::plot::html::{Codes, Doubles, file_name};
use crate::plot::portraits::{ShownPortrait, few_samples, shown};
use crate::plot::run::{Sides, widest_gap};
use crate::plot::{DrawnRun, Error};
use serde::Serialize;
use serde_json::{Value, json};
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
    modes: Value,
    events: Value,
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
    certificate: Option<Value>,
    certified: Option<Value>,
    provenance: Vec<(String, String)>,
    case_text: String,
    resolved: String,
    cycles: Value,
    panels: &'a [PagePanel],
    portraits: &'a [PagePortrait],
    #[serde(skip_serializing_if = "Option::is_none")]
    orbit: Option<Value>,
    notes: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) second: Option<Second>,
    pub(super) trajectory: Option<PageTrajectory>,
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
            events: facts_of_events(listed(events, form), form, events.len()),
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
            let (found, note) = orbit_of(run)?;
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

fn certificate(file: &ResultFile) -> Result<Option<Value>, ResultError> {
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
    let attributes: Vec<_> = attributes.filter(|(_, value)| !value.is_empty()).collect();
    let columns = group.columns.into_iter().map(|(column, rows, values)| {
        json!({
            "name": column.name,
            "unit": column.units,
            "description": column.long_name,
            "rows": rows,
            "values": Doubles::from_iter(values),
        })
    });
    Ok(Some(
        json!({ "attributes": attributes, "columns": columns.collect::<Vec<_>>() }),
    ))
}

/// Uncertainties of the events (s; infinite or NaN: unknown), and their verdicts.
fn certified(file: &ResultFile, events: usize) -> Result<Option<Value>, ResultError> {
    let Some(group) = file.added_group(group::CERTIFICATE, events)? else {
        return Ok(None);
    };
    let Some((.., verdict)) = group.columns.into_iter().find(|(column, ..)| column.name == "verdict") else {
        return Ok(None);
    };
    let uncertainty = file.event_column(schema::TIME_UNCERTAINTY)?;
    let whole = verdict.len() == events && uncertainty.len() >= events;
    Ok(whole.then(|| {
        json!({
            "uncertainty": Doubles::from_iter(uncertainty.into_iter().take(events)),
            "verdict": Codes::from_iter(verdict.iter().map(|&code| code as i8)),
            "verdicts": Verdict::ALL.iter().map(|verdict| verdict.name()).collect::<Vec<_>>(),
        })
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

/// Events with the exact values of channels on both sides of each. `count`: number in the file.
fn facts_of_events(events: &[Event], form: &PageForm, count: usize) -> Value {
    let first = |values: &[f64]| values.iter().take(events.len()).copied().collect::<Doubles>();
    let state = |(name, sides): &(String, Rc<Sides>)| {
        let (before, after) = (first(&sides.before), first(&sides.after));
        json!({ "name": name, "before": before, "after": after })
    };
    json!({
        "count": count,
        "kinds": EventKind::ALL.map(EventKind::name),
        "time": events.iter().map(|event| event.time).collect::<Doubles>(),
        "kind": events.iter().map(|event| event.kind.code()).collect::<Codes>(),
        "mode_after": events.iter().map(|event| event.mode_after.code()).collect::<Codes>(),
        // N
        "internal_force": events.iter().map(|event| event.internal_force).collect::<Doubles>(),
        "states": form.sides.iter().map(state).collect::<Vec<_>>(),
    })
}

/// Starts and durations (s) of the cycles that begin with one of `events`, which are the first of `all`.
fn cycles(all: &[Event], events: &[Event]) -> Value {
    let (_, cycles) = CycleStatistics::of_events(all.iter().map(|event| (event.time, event.kind)));
    let sticks = events.iter().filter(|event| event.kind == EventKind::Stick);
    let both = || sticks.clone().zip(&cycles);
    json!({
        "start": both().map(|(stick, _)| stick.time).collect::<Doubles>(),
        "stick_duration": both().map(|(_, cycle)| cycle.stick_duration).collect::<Doubles>(),
        "slip_duration": both().map(|(_, cycle)| cycle.slip_duration).collect::<Doubles>(),
    })
}

/// Modes from the segments and, after the last one of an unfinished file, from the samples. Stretch k is from `start[k]`
/// to `start[k + 1]`, or to the end of the run.
fn modes(file: &ResultFile, notes: &mut Vec<String>) -> Result<Value, ResultError> {
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
    Ok(json!({
        "names": Mode::ALL.map(Mode::name),
        "start": Doubles::from_iter(starts),
        "code": Codes::from_iter(codes),
    }))
}

const POINTS: usize = 30_000;

/// One period of the attractor, or the end of a run that is not periodic, as in the figure `phase-portrait`; and a note
/// on omitted points.
fn orbit_of(run: &DrawnRun) -> Result<(Value, Option<String>), Error> {
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
    let axis = |channel: &str| -> Result<Value, Error> {
        let axis = run.axis(channel)?;
        Ok(json!({ "label": axis.short(), "unit": axis.unit }))
    };
    let (mut lines, mut room, mut cut) = (Vec::new(), POINTS, false);
    for (mode, pieces) in run.portrait(axes.0, axes.1, window)? {
        for mut piece in pieces {
            cut |= piece.len() > room;
            piece.truncate(room);
            room -= piece.len();
            let (x, y): (Vec<f64>, Vec<f64>) = piece.into_iter().unzip();
            lines.push(json!({ "mode": mode.name(), "x": Doubles::from_iter(x), "y": Doubles::from_iter(y) }));
        }
    }
    let note =
        cut.then(|| format!("The phase portrait is cut after {POINTS} points; `stickslip plot` draws all of it."));
    let orbit = json!({
        "id": "portrait-orbit",
        "heading": heading,
        "hint": format!("Relative velocity over {over}, of {span}{colours}{few}"),
        // s
        "from": window.0,
        "to": window.1,
        "period": period,
        "x": axis(axes.0)?,
        "y": axis(axes.1)?,
        "lines": lines,
    });
    Ok((orbit, note))
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
