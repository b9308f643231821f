//! Page of a comparison, common to all formats.

use super::{NumberFormat, Page, PageTable, Report, exponent, fixed};
use serde::Serialize;
use stickslip_compare::{ChannelErrors, Comparison, Requirement, Score, Statistic};
use stickslip_system::record::sequence::{Difference, Fault};

/// Report on comparisons with one reference.
#[derive(Debug, Serialize)]
pub struct CompareReport<'a> {
    comparisons: &'a [Comparison],
    /// The failed requirements in words.
    pub shortfalls: Vec<String>,
    /// The written report.
    #[serde(skip)]
    pub(crate) file: Option<String>,
}

impl<'a> CompareReport<'a> {
    /// Report on comparisons, with the requirements that they do not meet.
    pub fn new(comparisons: &'a [Comparison], requirements: &[Requirement]) -> CompareReport<'a> {
        let short = |comparison: &'a Comparison| requirements.iter().filter_map(|r| r.shortfall(comparison));
        CompareReport {
            comparisons,
            shortfalls: comparisons.iter().flat_map(short).collect(),
            file: None,
        }
    }
}

impl Report for CompareReport<'_> {
    fn page(&self) -> Page {
        let mut pages = self.comparisons.iter().map(|c| comparison_page(c, false));
        let first = pages.next().unwrap_or_default();
        let all = pages.fold(first, |page, next| {
            page.with(format!("{}\n{}", next.title, next.verdict))
                .with_all(next.parts)
        });
        all.with_all(self.file.clone())
    }
}

/// Rows of the statistics that are no details.
const MOST_STATISTICS: usize = 3;

/// Most differences between the sequences that are listed on a terminal.
const LISTED: usize = 10;

/// Page of a comparison. A `whole` one lists every event and every difference between the sequences.
pub(crate) fn comparison_page(c: &Comparison, whole: bool) -> Page {
    let title = format!("{} against {}", c.candidate, c.reference);
    let e = &c.event_errors;
    let also = c.causes.iter().skip(1);
    let mut page = Page::new(title, c.summary.join("\n"))
        // The resolution comes first, because it limits all results below.
        .with_all(resolution(c))
        .with(statistics(c))
        .details([what_was_read(c)])
        .with_all(
            (!c.reference_changed.is_empty())
                .then(|| format!("reference {}", stickslip_case::changed_line(&c.reference_changed))),
        )
        .details([format!("In full: {}.", c.verdict)])
        .details(also.map(|cause| format!("also: {}", cause.evidence)))
        .details(hysteresis(c))
        .details(c.score.as_ref().map(score));
    if let Some(command) = &c.score_command {
        page = page.details([format!("score by the rules of the set: {command}")]);
    }
    page = page.details(c.parameters.as_ref().map(numbers));
    if let (Some(max), Some(at), Some(rms)) = (e.max, e.max_at, e.rms) {
        let mut text = format!(
            "{} matched events: largest error {max:.2e} s at {at:.9} s, rms {rms:.2e} s",
            e.matched
        );
        if c.detection.is_some() {
            let (within, bound) = (e.within(), e.largest_bound());
            text += &format!("; {within} are within what the samples resolve, {bound:.1e} s at most");
        }
        page = page.details([text]);
    }
    let wrong = c
        .first_wrong
        .as_ref()
        .map(|wrong| format!("first wrong event: {}", wrong.words()));
    page = page.details(wrong).details(c.cycles.as_ref().map(growth));
    if !c.sequence.is_empty() {
        let shown = if whole { usize::MAX } else { LISTED };
        let more = c.sequence.len().saturating_sub(shown);
        page = page
            .details([sequence(&c.sequence, shown)])
            .details((more > 0).then(|| format!("and {more} more")));
    }
    page = page.details(channels(c));
    if !c.impulses.is_empty() {
        page = page.details([impulses(c)]).details(impulse_notes(c));
    }
    page = page.details(samples(c)).details(c.energy_drift.as_ref().map(energy));
    if !c.absent.is_empty() {
        let why = c.absent.iter().map(|absent| format!("{}: {}", absent.what, absent.why));
        let why = why.collect::<Vec<_>>().join("; ");
        page = page.details([format!("not compared: {why}")]);
    }
    if whole && e.matched > 0 {
        page = page.details([events(c)]);
        // The growth summarises runs with many cycles; --json contains every event.
        let more = e.events.len().saturating_sub(most_events(c));
        page = page.details((more > 0).then(|| format!("and {more} more, which --json has")));
    }
    if !c.case_differences.is_empty() {
        let table = PageTable::of(&c.case_differences)
            .text("key", |d| &d.key)
            .text("reference", |d| &d.reference)
            .text("candidate", |d| &d.candidate)
            .done();
        page = page.details([table.titled("keys of the case that differ")]);
    }
    page
}

fn score(score: &Score) -> PageTable {
    let none = String::new;
    let mut rows: Vec<(String, [String; 3], f64)> = Vec::new();
    if let Some(p) = &score.position {
        let error = format!("{:.2e} {}", p.rms, p.unit);
        rows.push((format!("{}, rms", p.channel), [none(), none(), error], p.relative));
    }
    if let Some(p) = &score.period {
        let [reference, candidate] = [p.reference, p.candidate].map(|period| format!("{period:.9} s"));
        let error = format!("{:.2e} s", p.error);
        rows.push((
            format!("period of {}", p.channel),
            [reference, candidate, error],
            p.relative,
        ));
    }
    if let Some(r) = &score.rest {
        let error = format!("{:.2e} {}", r.rms, r.unit);
        let name = format!("{} amid {} sticks, rms", r.channel, r.sticks);
        rows.push((name, [none(), none(), error], r.relative));
    }
    if let Some(c) = &score.creep {
        let values = [c.reference, c.candidate, c.rms].map(|v| format!("{v:.2e} {}", c.unit));
        rows.push(("relative velocity in stick, rms".to_owned(), values, c.relative));
    }
    let (from, to, samples) = (short(score.from), short(score.to), score.samples);
    PageTable::of(&rows)
        .text("", |row| &row.0)
        .count("reference", |row| &row.1[0])
        .count("candidate", |row| &row.1[1])
        .count("error", |row| &row.1[2])
        .number("relative", "", exponent(1), |row| row.2)
        .done()
        .titled(format!("without a threshold, from {from} to {to} s: {samples} samples"))
}

/// Parameters of the case that differ in the candidate, and parameters that explain the difference equally well.
fn numbers(found: &stickslip_compare::OtherParameters) -> PageTable {
    PageTable::of(found.numbers.iter().chain(&found.or))
        .text("number", |number| format!("{} ({})", number.key, number.symbol))
        .count("reference", |number| number.reference)
        .count("candidate", |number| number.value_and_error().0)
        .count("error", |number| number.value_and_error().1)
        .count("unit", |number| if number.unit == "1" { "" } else { number.unit })
        .done()
        .titled("parameters with another value")
}

fn resolution(c: &Comparison) -> Option<String> {
    let r = c.resolution.as_ref()?;
    let mut text = format!("its times are {}, {:.1e} s apart at {} s", r.of, r.seconds, short(r.at));
    if r.event_error > 0.0 {
        text += &format!(": errors of events up to {:.1e} s come from the file", r.event_error);
    }
    if r.repeated > 0 {
        text += &format!(
            "; {} row{} the time of the one before and {} left out: write more digits, fewer rows, or a clock that starts later",
            r.repeated,
            if r.repeated == 1 { " has" } else { "s have" },
            if r.repeated == 1 { "is" } else { "are" }
        );
    }
    Some(text)
}

fn impulses(c: &Comparison) -> PageTable {
    let first = &c.impulses[0];
    let (from, to, samples) = (short(first.from), short(first.to), first.samples);
    PageTable::of(&c.impulses)
        .text("impulse", |i| &i.channel)
        .count("reference", |i| format!("{:.6e} {}", i.reference, i.unit))
        .number("candidate", "", exponent(6), |i| i.candidate)
        .number("max error", "", exponent(2), |i| i.max)
        .number("at", "s", fixed(6), |i| i.max_at)
        .number("rms", "", exponent(1), |i| i.rms)
        .done()
        .titled(format!("impulses from {from} to {to} s: {samples} samples"))
}

fn impulse_notes(c: &Comparison) -> Vec<String> {
    let mut notes = Vec::new();
    for i in &c.impulses {
        if let Some(resolution) = i.resolution {
            notes.push(format!(
                "{} is of 32-bit floating-point numbers, up to {resolution:.1e} {} apart",
                i.channel, i.unit
            ));
        }
        if i.opposite {
            notes.push(format!("{} has the opposite sign, which was turned", i.channel));
        }
    }
    notes
}

fn growth(cycles: &stickslip_compare::CycleErrors) -> String {
    let of = format!("{} matched {}s", cycles.cycles, cycles.of);
    if !cycles.drifts {
        let same = 0.01 * cycles.largest;
        if cycles.scatter < same && (cycles.last - cycles.first).abs() < same {
            let side = if cycles.first < 0.0 { "early" } else { "late" };
            return format!("{of}, constant error: each is {:.2e} s {side}", cycles.first.abs());
        }
        return format!(
            "{of}, no drift: the largest error is {:.2e} s, of event {} at {:.6} s; all others are at most {:.2e} s",
            cycles.largest, cycles.largest_position, cycles.largest_at, cycles.others
        );
    }
    format!(
        "{of}: the error drifts by {:.2e} +- {:.0e} s per cycle ({:.1e} of its duration), from {:.2e} to {:.2e} s, with a scatter \
         of {:.1e} s",
        cycles.per_cycle, cycles.uncertainty, cycles.relative, cycles.first, cycles.last, cycles.scatter
    )
}

/// Number of matched events in a report: all events of a motion that ends, the first ones of a motion in cycles.
fn most_events(c: &Comparison) -> usize {
    const OF_CYCLES: usize = 100;
    if c.time_scale.is_some() { OF_CYCLES } else { usize::MAX }
}

fn energy(drift: &stickslip_compare::EnergyDrift) -> String {
    let over = format!(
        "over {:.3} s of eight samples or more in a natural period",
        drift.covered
    );
    if !drift.is_resolved() {
        return format!(
            "energy drift of its own channels: below what the samples resolve ({:.1e} J), {over}",
            drift.resolved
        );
    }
    format!(
        "energy drift of its own channels: {:.1e} J at most, at {:.6} s, and {:.1e} J at the end, {over}; the samples resolve {:.1e} J",
        drift.max, drift.max_at, drift.last, drift.resolved
    )
}

fn what_was_read(c: &Comparison) -> String {
    let mut text = c.format.to_owned();
    if let Some(span) = c.span {
        text += &format!(", {} to {} s", short(span.from), short(span.to));
    }
    if let Some(interval) = c.interval {
        text += &format!(", a sample every {interval:.3e} s in the stick-slip");
    }
    if let Some(d) = &c.detection {
        text += &format!(
            "; events found where |omega_r| <= {:.0e} {unit}, a stick ends above {:.0e} {unit}",
            d.velocity_tolerance,
            d.velocity_tolerance * d.hysteresis,
            unit = c.velocity_unit
        );
    }
    if let Some(offset) = c.time_offset {
        text += &format!("; {offset:.9} s added to its times");
        if let Some(found) = &c.found_time_offset {
            text += &format!(", by which {} of its {} events agree", found.agree, found.of);
        }
    }
    if let Some(scale) = &c.time_scale {
        text += &format!(
            "; times are measured by {:.4e} s, {}{}",
            scale.period,
            if scale.has_period { "the period of " } else { "" },
            scale.of
        );
    }
    text
}

fn hysteresis(c: &Comparison) -> Option<String> {
    let (effect, detection) = (c.hysteresis.as_ref()?, c.detection.as_ref()?);
    let more = if effect.chatters { " or more" } else { "" };
    let mut text = format!(
        "check of the hysteresis ({} against a single threshold of {:.0e} {}): ",
        detection.hysteresis, effect.stick_begins, c.velocity_unit
    );
    text += &match effect.events_without == effect.events {
        true => "the same number of events".to_owned(),
        false => format!("{} events instead of {}{more}", effect.events, effect.events_without),
    };
    if let (Some(later), Some(largest)) = (effect.slips_later, effect.largest) {
        text += &match largest {
            0.0 => ", slips at the same times".to_owned(),
            _ => {
                let side = if later < 0.0 { "earlier" } else { "later" };
                let later = later.abs();
                format!(", slips begin {later:.1e} s {side} (median; at most {largest:.1e} s)")
            }
        };
    }
    Some(text)
}

fn short(time: f64) -> String {
    let text = format!("{time:.9}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn statistics(c: &Comparison) -> PageTable {
    let number = |unit: &str, value: Option<f64>| match value {
        None => "none".to_owned(),
        Some(value) if unit == "1" => format!("{value}"),
        Some(value) => format!("{value:.9} {unit}"),
    };
    let error = |s: &Statistic| match (s.reference.is_some(), s.unit, s.error()) {
        (false, _, _) | (_, _, None) => String::new(),
        (_, "1", Some(error)) => format!("{error}"),
        (_, unit, Some(error)) => format!("{error:.2e} {unit}"),
    };
    let events = [
        "contact events".to_owned(),
        c.reference_events.to_string(),
        c.candidate_events.to_string(),
        format!("{} missing, {} spurious", c.missing, c.spurious),
    ];
    let of_statistic = |s: &Statistic| {
        let name = s.name.replace('_', " ");
        [name, number(s.unit, s.reference), number(s.unit, s.candidate), error(s)]
    };
    let rows: Vec<[String; 4]> = std::iter::once(events)
        .chain(c.statistics.iter().map(of_statistic))
        .collect();
    PageTable::of(&rows)
        .text("", |row| &row[0])
        .count("reference", |row| &row[1])
        .count("candidate", |row| &row[2])
        .count("error", |row| &row[3])
        .done()
        .brief(MOST_STATISTICS)
}

fn sequence(differences: &[Difference], shown: usize) -> PageTable {
    let fault = |d: &Difference| match d.fault {
        Fault::Missing if d.shorter_than_interval => "missing: shorter than the interval".to_owned(),
        Fault::Missing => "missing".to_owned(),
        Fault::Spurious => "spurious".to_owned(),
        Fault::Doubled => "doubled".to_owned(),
        Fault::Swapped => "swapped".to_owned(),
        Fault::Renamed => format!("now a {}", d.candidate_kind.unwrap_or("different event")),
    };
    PageTable::of(differences.iter().take(shown))
        .text("sequence", fault)
        .text("kind", |d| d.kind)
        .count("event", |d| d.position)
        .number("time", "s", fixed(9), |d| d.time)
        .done()
}

fn channels(c: &Comparison) -> Vec<PageTable> {
    const DIGITS: NumberFormat = fixed(1).or("");
    // Without an error there is no time of the largest error.
    let largest_at = |row: &ChannelErrors| Some(row.max_at).filter(|_| row.max > 0.0);
    let table = |rows: &[ChannelErrors]| {
        PageTable::of(rows)
            .text("channel", |row| &row.channel)
            .count("max error", |row| format!("{:.2e} {}", row.max, row.unit))
            .number("at", "s", fixed(6).or(""), largest_at)
            .number("rms", "", exponent(1), |row| row.rms)
            .number("scd", "", DIGITS, |row| row.scd)
            .number("mescd", "", DIGITS, |row| row.mescd)
            .done()
            .titled(format!("{}: {} samples", rows[0].phase.name(), rows[0].samples))
    };
    c.channels.chunk_by(|a, b| a.phase == b.phase).map(table).collect()
}

fn samples(c: &Comparison) -> Option<String> {
    c.span?;
    let mut text = format!("{} samples compared", c.samples);
    if c.samples_outside > 0 {
        text += &format!("; {} at an event or in a segment of one run alone", c.samples_outside);
    }
    if c.samples_too_sparse > 0 {
        text += &format!("; {} where the reference is too sparse", c.samples_too_sparse);
    }
    if c.reference_repeated && !c.was_rerun {
        text += "; the reference's equations were integrated again between its samples";
    } else if c.reference_repeated {
        text += "; the reference's run was repeated for its states between samples";
    }
    Some(text)
}

fn events(c: &Comparison) -> PageTable {
    PageTable::of(c.event_errors.events.iter().take(most_events(c)))
        .text("kind", |e| e.kind)
        .count("event", |e| e.position)
        .number("time in the reference", "s", fixed(12), |e| e.time)
        .number("error", "s", exponent(2), |e| e.error)
        .number("known to", "s", exponent(1), |e| e.bound)
        .done()
        .titled("matched events")
}
