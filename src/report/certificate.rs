//! Page of a certificate: ladder, events, channels, sensitivities, exact events, verdict.

use super::{NumberFormat, Page, PageTable, Report, below_changes, exponent, fixed, significant, upper_bound};
use stickslip_analysis::analysis::CertifyReport;
use stickslip_analysis::analysis::advice::remedy;
use stickslip_analysis::analysis::bands::ChannelBand;
use stickslip_analysis::analysis::certificate::{Certificate, CertifiedEvent, Verdict};
use stickslip_analysis::analysis::ladder::Rung;
use stickslip_analysis::analysis::sensitivity::{RerunOutcome, Sensitivities, Sensitivity, SensitivityRerun};
use stickslip_oracle::OracleSolution;
use stickslip_system::quote::bound;

/// Most rows of a table on a terminal. A longer one shows the first and last events, and the most influential
/// parameters.
const MOST_ROWS: usize = 24;

const SMOOTH_STOP: &str = "(smooth): series alone follows smooth sliding itself, free of rounding, to its exact stop. Where the \
                           onset of the other methods is noise, that is the model without any deviation, and no check of a run that has \
                           one.";

/// Half a last digit of a parameter with one or two digits, in parts of its value.
const ROUGH: f64 = 0.05;

const ROUNDED: &str = "A number with one or two digits is taken as known to half of its last one: 0.1 N/m is 0.05 to 0.15 N/m. Write the \
                       digits that are known, such as 0.1000 N/m.";

impl Report for CertifyReport<'_> {
    const SORTED: bool = true;

    fn page(&self) -> Page {
        let (certified, c) = (self.certified, &self.certified.certificate);
        let smooth = c.ladder.iter().any(|rung| rung.smooth_stop).then_some(SMOOTH_STOP);
        let missing = certified.without_sensitivities();
        let is_conditioned = c.growth_exponent.is_some() || c.most_digits().is_some();
        let found = certified.result_sensitivities();
        let contradiction = c.contradiction.as_ref().map(|text| format!("contradiction: {text}"));
        let mut page = Page::new(&*self.case.title, below_changes(&self.changed, heading(self)))
            .with(main_numbers(c, found))
            .below(exact_times(self))
            .with_all(contradiction)
            .details([ladder(&c.ladder)])
            .below(smooth)
            .below(c.left_out.iter().map(|text| format!("{text}.")))
            .details([events(c), channels(&c.bands.channels)]);
        if let Some(found) = found {
            page = page.details([sensitivities(found)]).below(remarks(found));
        }
        page = page
            .details(missing.map(|why| format!("No sensitivities: {why}.")))
            .details(is_conditioned.then(|| conditioning(c)));
        if let Some(exact) = &certified.exact {
            page = page.details([work_of(exact)]).details([exact_events(exact)]);
        }
        page.with_lines(std::iter::once(&self.file).chain(&self.figure))
    }
}

/// The exact first and last stick, or events if nothing sticks, with all digits that are true.
fn exact_times(report: &CertifyReport) -> Option<PageTable> {
    let exact = report.certified.exact.as_ref().filter(|_| report.shows_exact)?;
    let events = || exact.report.events.iter().enumerate();
    let mut sticks = events().filter(|(_, event)| event.kind.name() == "stick");
    let row = |what: &str, index: usize| {
        let digits = exact.digits_of_event(index);
        let time = exact.report.events[index].time.to_decimal(digits.max(1) as usize);
        (format!("exact {what}"), format!("{time} s, {digits} digits"))
    };
    let rows: Vec<_> = match (sticks.next(), sticks.next_back()) {
        (Some((first, _)), Some((last, _))) => vec![row("first stick", first), row("last stick", last)],
        (Some((only, _)), None) => vec![row("stick", only)],
        (None, _) => {
            let (mut all, named) = (events(), |place: &str, kind: &str| format!("{place} event, {kind}"));
            let first = all.next().map(|(k, event)| row(&named("first", event.kind.name()), k));
            let last = all
                .next_back()
                .map(|(k, event)| row(&named("last", event.kind.name()), k));
            first.into_iter().chain(last).collect()
        }
    };
    let rows = rows.iter().map(|(what, time)| (what.as_str(), time.clone()));
    (rows.len() > 0).then(|| PageTable::pairs(rows))
}

/// Agreement of the methods, the first and the last stick, and what moves the result most.
fn main_numbers(c: &Certificate, found: Option<&Sensitivities>) -> PageTable {
    let agree = |rung: &&Rung| rung.failure.is_none() && rung.agreeing == rung.events;
    let (runs, same) = (c.ladder.len(), c.ladder.iter().filter(agree).count());
    let events = c.ladder.iter().map(|rung| rung.events).max().unwrap_or(0);
    let ladder = match same == runs {
        true => match events {
            0 => format!("all {runs} find no contact event"),
            1 => format!("all {runs} find the same contact event"),
            _ => format!("all {runs} find the same {events} contact events"),
        },
        false => format!("{same} of {runs} find the events of the result"),
    };
    let mut sticks = c.events.iter().filter(|event| event.kind == "stick");
    let stick = |event: &CertifiedEvent| {
        let error = event.uncertainty;
        if !error.is_finite() {
            return format!("{:.9} s, {}", event.time, event.verdict.name());
        }
        let places = (1.0 - error.max(1e-16).log10().floor()).clamp(1.0, 15.0) as usize;
        format!("{:.places$} s within {} s", event.time, bound(error, 1))
    };
    let (first, last) = (sticks.next(), sticks.next_back());
    let growth = c.growth_exponent.map(|growth| {
        let kick = c.kick_above_noise;
        let kick = kick.map_or_else(String::new, |e_folds| {
            format!("; the kick is {e_folds:.2} e-folds above rounding")
        });
        format!("{growth:.2}{kick}")
    });
    let most = found.and_then(|found| {
        // Of the whole value: exact parameters have no last digit.
        let effect = |row: &Sensitivity| row.slope.map_or(0.0, |slope| (slope * row.parameter.value).abs());
        let order = |a: &&Sensitivity, b: &&Sensitivity| effect(a).total_cmp(&effect(b));
        let row = found.rows.iter().filter(|row| effect(row) > 0.0).max_by(order)?;
        let slope = significant(3).print(row.slope?);
        let (path, unit) = (&row.parameter.path, row.parameter.unit);
        let per = if unit == "1" { "unit" } else { unit };
        Some(format!("{path} moves {} by {slope} s per {per}", found.of.words()))
    });
    let rows = [
        ("runs by other methods", (runs > 0).then_some(ladder)),
        ("first stick", first.map(stick)),
        ("last stick", last.map(stick)),
        ("growth exponent G", growth),
        ("strongest parameter", most),
    ];
    PageTable::pairs(rows.into_iter().filter_map(|(name, value)| Some((name, value?))))
}

fn heading(report: &CertifyReport) -> String {
    let solver = &report.certified.certificate.solver;
    let by = match &report.certified.exact {
        Some(exact) => format!(
            "by the exact solver (oracle), which computed with {} digits; {} are true of every event",
            exact.digits_computed, exact.digits
        ),
        None => "by the ladder of methods alone".to_owned(),
    };
    let (method, rtol) = (solver.method.name(), solver.rtol);
    let (source, seconds) = (&report.source, report.seconds);
    let verdict = verdict(&report.certified.certificate);
    format!("{source}\n{verdict}\nmethod {method}, rtol {rtol:e}; uncertainties {by}; {seconds:.2} s")
}

fn ladder(rungs: &[Rung]) -> PageTable {
    let distance = |rung: &Rung| match (&rung.failure, rung.distance) {
        (Some(_), _) => "failed".to_owned(),
        (None, Some(d)) => format!("{d:.1e} s"),
        (None, None) => "none".to_owned(),
    };
    let smooth = |rung: &Rung| match rung.smooth_stop {
        true => " (smooth)",
        false => "",
    };
    PageTable::of(rungs)
        .text("method", |rung| rung.method)
        .number("rtol", "", exponent(0), |rung| rung.rtol)
        .count("events", |rung| rung.events)
        .count("agreeing", |rung| rung.agreeing)
        .count("largest distance", distance)
        .count("first stick, s", |rung| fixed(12).print(rung.onset) + smooth(rung))
        .count("wall time", |rung| format!("{:.2} s", rung.seconds))
        .done()
}

fn events(c: &Certificate) -> PageTable {
    let (all, exact) = (&c.events, c.by_oracle);
    let followed = all.iter().any(|event| !event.rounding.is_nan());
    let shown = |rows: usize| if all.len() > MOST_ROWS { rows } else { 0 };
    let left_out = shown(all.len() - MOST_ROWS.min(all.len()));
    PageTable::of(all)
        .text("event", |event| event.kind)
        .number("time", "s", fixed(15), |event| event.time)
        .text("verdict", |event| event.verdict.name())
        .number("uncertainty", "s", upper_bound(), |event| event.uncertainty)
        .count("digits", CertifiedEvent::digits)
        .number("rounding", "s", upper_bound(), |event| event.rounding)
        .only_if(followed)
        .number("growth", "", fixed(1), |event| event.growth)
        .only_if(followed)
        .number("by the methods", "s", upper_bound(), |event| event.ladder_uncertainty)
        .only_if(exact)
        .number("true error", "s", exponent(1), |event| event.true_error)
        .only_if(exact)
        .done()
        .without(
            shown(MOST_ROWS / 2)..shown(MOST_ROWS / 2) + left_out,
            &["...".to_owned(), format!("{left_out} more")],
        )
}

fn channels(bands: &[ChannelBand]) -> PageTable {
    PageTable::of(bands)
        .text("channel", |channel| &channel.name)
        .text("unit", |channel| &channel.unit)
        .number("largest", "", exponent(3), |channel| channel.largest)
        .number("band", "", upper_bound(), |channel| channel.band)
        .number("at a fixed time", "", upper_bound(), |channel| channel.at_fixed_time)
        .done()
}

/// Parameters of the case, the most influential first.
fn ranked(found: &Sensitivities) -> Vec<&Sensitivity> {
    let mut rows: Vec<&Sensitivity> = found.rows.iter().collect();
    rows.sort_by(|a, b| b.largest().total_cmp(&a.largest()));
    rows
}

fn sensitivities(found: &Sensitivities) -> PageTable {
    const NUMBER: NumberFormat = exponent(1).or("unknown");
    let rerun = |rerun: &SensitivityRerun| match (rerun.shift, rerun.outcome) {
        (Some(shift), RerunOutcome::SameEvents) => format!("{shift:+.1e} "),
        (Some(shift), _) => format!("{shift:+.1e}*"),
        (None, outcome) => format!("{}*", outcome.name()),
    };
    let side = |row: &Sensitivity, side: usize| row.reruns.as_ref().map_or_else(String::new, |both| rerun(&both[side]));
    let nonlinear = |row: &Sensitivity| if row.nonlinear() == Some(true) { "nonlinear" } else { "" };
    let rows = ranked(found);
    let left_out = rows.len().saturating_sub(MOST_ROWS);
    PageTable::of(rows.iter().copied())
        .text(&format!("what moves {}", found.of.words()), |row| {
            format!("{}, {}", row.parameter.path, row.parameter.unit)
        })
        .number("s per unit", "", exponent(2), |row| row.slope)
        .count("half a last digit", |row| match is_exact(row) {
            true => "exact".to_owned(),
            false => NUMBER.print(row.parameter.half_last_digit),
        })
        .number("by slope", "s", NUMBER, Sensitivity::predicted)
        .count("rerun -, s", |row| side(row, 0))
        .count("rerun +, s", |row| side(row, 1))
        .text("", nonlinear)
        .done()
        .without(
            rows.len() - left_out..rows.len(),
            &[format!("... {left_out} more, which move it less")],
        )
}

/// Remarks on reruns, each once with all its reruns.
fn remarks(found: &Sensitivities) -> Vec<String> {
    let mut remarks: Vec<(&str, Vec<String>)> = Vec::new();
    for row in ranked(found).into_iter().take(MOST_ROWS) {
        for (rerun, sign) in row.reruns.iter().flatten().zip(["-", "+"]) {
            let about = format!("{} {sign}", row.parameter.path);
            match remarks.iter_mut().find(|remark| remark.0 == rerun.remark) {
                _ if rerun.remark.is_empty() => {}
                Some((_, others)) => others.push(about),
                None => remarks.push((&rerun.remark, vec![about])),
            }
        }
    }
    let remarks = remarks
        .iter()
        .map(|(remark, about)| format!("* {}: {remark}", about.join(", ")));
    let without = found
        .without_reruns
        .iter()
        .map(|reason| format!("Slopes only: {reason}."));
    let held = Some(found.held.clone()).filter(|held| !held.is_empty());
    let is_rough = |row: &Sensitivity| {
        let half = row.parameter.half_last_digit;
        half.is_some_and(|half| half > 0.0 && half >= ROUGH * row.parameter.value.abs())
    };
    let rough = found.rows.iter().any(is_rough).then(|| ROUNDED.to_owned());
    let exact = found.rows.iter().any(is_exact).then(|| EXACT.to_owned());
    remarks.chain(without).chain(held).chain(rough).chain(exact).collect()
}

const EXACT: &str = "Integers are taken as exact; write \"1.0 N\" for a number that is rounded.";

fn is_exact(row: &Sensitivity) -> bool {
    row.parameter.half_last_digit == Some(0.0)
}

fn conditioning(c: &Certificate) -> PageTable {
    PageTable::pairs([
        ("growth exponent G", fixed(2).print(c.growth_exponent)),
        ("of it up to the first stick", fixed(2).print(c.growth_to_onset)),
        ("kick above rounding, e-folds", fixed(2).print(c.kick_above_noise)),
        (
            "kick above the methods' own noise, e-folds",
            fixed(2).print(c.kick_above_methods),
        ),
        (
            "digits that double precision can hold",
            fixed(0).print(c.most_digits().map(f64::from)),
        ),
    ])
}

fn work_of(exact: &OracleSolution) -> String {
    format!(
        "exact solver: Taylor series with {} bits, {} steps, in {:.1} s with the shorter run by which its digits are counted; at \
         least {} digits of every event are true",
        exact.report.bits, exact.report.steps, exact.seconds, exact.digits
    )
}

fn exact_events(exact: &OracleSolution) -> PageTable {
    PageTable::of(exact.report.events.iter().enumerate())
        .text("event", |(_, event)| event.kind.name())
        .text("exact time, s", |(index, event)| {
            event.time.to_decimal(exact.digits_of_event(index) as usize)
        })
        .count("digits", |(index, _)| exact.digits_of_event(index))
        .done()
}

fn verdict(c: &Certificate) -> String {
    match c.verdict {
        Verdict::Converged => {
            let worst = c.events.iter().map(|e| e.uncertainty).fold(0.0, f64::max);
            let digits = c.least_digits().map(|n| format!(", {n} digits of the least known"));
            let by = if c.by_oracle { " of the exact one" } else { "" };
            let digits = digits.unwrap_or_default();
            format!("converged: every event within {} s{by}{digits}", bound(worst, 1))
        }
        verdict => format!("{}: {}", verdict.name(), remedy(c)),
    }
}
