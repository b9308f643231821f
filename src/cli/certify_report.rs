//! What `stickslip certify` prints and stores.

use super::terminal;
use crate::analysis::advice::remedy;
use crate::analysis::bands::{ChannelBand, Stretch};
use crate::analysis::certificate::{Certificate, CertifiedEvent, Verdict};
use crate::analysis::onset::Onset;
use crate::analysis::sensitivity::{Affected, Outcome, Sensitivities, Sensitivity, columns as columns_of};
use crate::oracle::OracleSolution;
use crate::record::Event;
use crate::results::schema::mode_flags;
use crate::results::{BandColumns, CertificateTables};
use crate::simulation::nearby::columns;
use serde_json::{Value, json};

/// Rows of a table on a terminal: beyond, only the first and last events, and the parameters that matter most.
const MOST_ROWS: usize = 24;

/// Everything that is reported.
pub(super) struct Report<'a> {
    pub source: String,
    pub title: &'a str,
    pub certificate: &'a Certificate,
    pub exact: Option<&'a OracleSolution>,
    /// What moves the final stick; `None` if that is no result.
    pub final_stick: Option<&'a Sensitivities>,
    pub file: String,
    /// The figure, if one was drawn.
    pub figure: Option<String>,
    /// What it shows.
    pub onsets: &'a [Onset],
    /// s.
    pub seconds: f64,
}

impl Report<'_> {
    /// For a terminal.
    pub fn text(&self) -> String {
        let c = self.certificate;
        let mut ladder = terminal::table(&[
            "method",
            "rtol",
            "events",
            "agreeing",
            "largest distance",
            "first stick, s",
            "wall time",
        ]);
        for rung in &c.ladder {
            ladder.add_row([
                rung.method.to_owned(),
                format!("{:.0e}", rung.rtol),
                rung.events.to_string(),
                rung.agreeing.to_string(),
                match (&rung.failure, rung.distance) {
                    (Some(_), _) => "failed".to_owned(),
                    (None, Some(d)) => format!("{d:.1e} s"),
                    (None, None) => "none".to_owned(),
                },
                rung.onset.map_or_else(
                    || "none".to_owned(),
                    |t| format!("{t:.12}{}", if rung.smooth_stop { " (smooth)" } else { "" }),
                ),
                format!("{:.2} s", rung.seconds),
            ]);
        }
        terminal::align_right(&mut ladder, 1..7);
        let mut parts = vec![
            format!("{}\n{}", self.title, self.source),
            format!(
                "{}{}{}",
                terminal::show(&ladder).trim_end(),
                self.smooth_stop(),
                c.left_out
                    .as_ref()
                    .map_or_else(String::new, |text| format!("\n{text}."))
            ),
            terminal::show(&self.events()).trim_end().to_owned(),
            self.channels(),
        ];
        parts.extend(self.final_stick.map(sensitivities));
        parts.push(self.conditioning());
        if let Some(exact) = self.exact {
            parts.push(self.oracle(exact));
        }
        parts.push(self.verdict());
        let figure = self
            .figure
            .as_ref()
            .map_or_else(String::new, |path| format!("{path}\n"));
        format!("{}\n\n{}\n{figure}", parts.join("\n\n"), self.file)
    }

    /// What "(smooth)" in the ladder means, where it stands.
    fn smooth_stop(&self) -> &'static str {
        if !self.certificate.ladder.iter().any(|rung| rung.smooth_stop) {
            return "";
        }
        "\n(smooth): series alone follows smooth sliding itself, free of rounding, to its exact stop. Where the onset of the \
         other methods is noise, that is the model without any deviation, and no witness for a run that has one."
    }

    fn events(&self) -> comfy_table::Table {
        let events = &self.certificate.events;
        let exact = self.certificate.by_oracle;
        let mut header = vec![
            "event",
            "time, s",
            "verdict",
            "uncertainty, s",
            "digits",
            "rounding, s",
            "growth",
        ];
        if exact {
            header.extend(["by the methods, s", "true error, s"]);
        }
        let mut table = terminal::table(&header);
        for (index, event) in events.iter().enumerate() {
            if events.len() > MOST_ROWS && index >= MOST_ROWS / 2 && index + MOST_ROWS / 2 < events.len() {
                if index == MOST_ROWS / 2 {
                    table.add_row(["...", &format!("{} more", events.len() - MOST_ROWS)]);
                }
                continue;
            }
            let mut row = row(event);
            if exact {
                row.push(known(event.ladder_uncertainty));
                row.push(
                    event
                        .true_error
                        .map_or_else(|| "none".to_owned(), |e| format!("{e:.1e}")),
                );
            }
            table.add_row(row);
        }
        terminal::align_right(&mut table, [1, 3, 4, 5, 6, 7, 8]);
        table
    }

    fn channels(&self) -> String {
        let mut table = terminal::table(&["channel", "unit", "largest", "band", "at a fixed time"]);
        for channel in &self.certificate.bands.channels {
            table.add_row([
                channel.name.to_owned(),
                channel.unit.to_owned(),
                format!("{:.3e}", channel.largest),
                known(channel.band),
                known(channel.at_fixed_time),
            ]);
        }
        terminal::align_right(&mut table, 2..5);
        terminal::show(&table).trim_end().to_owned()
    }

    fn conditioning(&self) -> String {
        let c = self.certificate;
        let number = |x: Option<f64>, digits: usize| x.map_or_else(|| "none".to_owned(), |x| format!("{x:.digits$}"));
        let mut table = terminal::table(&[]);
        table.add_row(["growth exponent G", &number(c.growth_exponent, 2)]);
        table.add_row(["of it up to the first stick", &number(c.growth_to_onset, 2)]);
        table.add_row(["kick above rounding, e-folds", &number(c.kick_above_noise, 2)]);
        table.add_row([
            "kick above the methods' own noise, e-folds",
            &number(c.kick_above_methods, 2),
        ]);
        table.add_row([
            "digits that double precision can hold",
            &c.most_digits().map_or_else(|| "none".to_owned(), |n| n.to_string()),
        ]);
        terminal::show(&table).trim_end().to_owned()
    }

    fn oracle(&self, exact: &OracleSolution) -> String {
        let report = &exact.report;
        let mut table = terminal::table(&["event", "exact time, s", "digits"]);
        for (index, event) in report.events.iter().enumerate() {
            let digits = exact.digits_of_event(index);
            table.add_row([
                event.kind.name().to_owned(),
                event.time.to_decimal(digits as usize),
                digits.to_string(),
            ]);
        }
        terminal::align_right(&mut table, [2]);
        format!(
            "oracle: Taylor series with {} bits, {} steps, in {:.1} s with the shorter run that its digits are counted \
             by; of every event {} digits or more are true\n\n{}",
            report.bits,
            report.steps,
            exact.seconds,
            exact.digits,
            terminal::show(&table).trim_end()
        )
    }

    fn verdict(&self) -> String {
        let c = self.certificate;
        let verdict = match c.verdict {
            Verdict::Converged => {
                let worst = c.events.iter().map(|e| e.uncertainty).fold(0.0, f64::max);
                let digits = c
                    .least_digits()
                    .map_or_else(String::new, |n| format!(", {n} digits of the least known"));
                let by = if c.by_oracle { " of the exact one" } else { "" };
                format!("converged: every event within {worst:.1e} s{by}{digits}")
            }
            verdict => format!("{}: {}", verdict.name(), remedy(c)),
        };
        match &c.contradiction {
            Some(contradiction) => format!("{verdict}\n\ncontradiction: {contradiction}"),
            None => verdict,
        }
    }

    /// For programs.
    pub fn document(&self) -> Value {
        let c = self.certificate;
        let oracle = self.exact.map(|exact| {
            let events = exact.report.events.iter().enumerate().map(|(index, event)| {
                let digits = exact.digits_of_event(index);
                let state: serde_json::Map<String, Value> = event
                    .state
                    .components()
                    .into_iter()
                    .map(|(name, value)| (name.to_owned(), json!(value.to_decimal(digits as usize))))
                    .collect();
                json!({
                    "kind": event.kind.name(),
                    "time": event.time.to_decimal(digits as usize),
                    "digits": digits,
                    "error": exact.errors[index],
                    "state_after": state,
                })
            });
            let events: Vec<Value> = events.collect();
            json!({
                "digits": exact.digits,
                "bits": exact.report.bits,
                "steps": exact.report.steps,
                "seconds": exact.seconds,
                "events": events,
                "true_errors": c.events.iter().map(|event| event.true_error).collect::<Vec<_>>(),
            })
        });
        let sensitivity: Vec<Value> = c
            .linearised
            .parameters
            .iter()
            .enumerate()
            .map(|(column, p)| {
                let by: Vec<f64> = c.linearised.events.iter().map(|e| e.by_parameter[column]).collect();
                let row = self.final_stick.map(|found| &found.rows[column]);
                json!({
                    "parameter": p.path,
                    "unit": p.unit,
                    "value": p.value,
                    "half_last_digit": row.and_then(|row| row.half_last_digit),
                    "time_sensitivity": by,
                    "final_stick": row.map(influence),
                })
            })
            .collect();
        json!({
            "file": self.file,
            "figure": self.figure,
            "onsets": self.onsets,
            "case": self.source,
            "title": self.title,
            "verdict": c.verdict,
            "contradiction": c.contradiction,
            "remedy": remedy(c),
            "digits": c.least_digits(),
            "digits_of_double": c.most_digits(),
            "growth_exponent": c.growth_exponent,
            "growth_to_onset": c.growth_to_onset,
            "kick_above_noise": c.kick_above_noise,
            "kick_above_methods": c.kick_above_methods,
            "others_agree": c.others_agree,
            "ladder": c.ladder,
            "left_out": c.left_out,
            "events": c.events,
            "channels": c.bands.channels.iter().map(channel).collect::<Vec<Value>>(),
            "stretches": c.bands.stretches.iter().map(stretch).collect::<Vec<Value>>(),
            "sensitivity": sensitivity,
            "final_stick": self.final_stick.map(|found| json!({
                "time": found.time,
                "held": found.held,
                "without_reruns": found.without_reruns,
            })),
            "warnings": c.warnings.iter().map(ToString::to_string).collect::<Vec<String>>(),
            "oracle": oracle,
            "seconds": self.seconds,
        })
    }
}

/// What moves a result of the run, most first.
pub(super) fn sensitivities(found: &Sensitivities) -> String {
    let mut rows: Vec<&Sensitivity> = found.rows.iter().collect();
    rows.sort_by(|a, b| b.largest().total_cmp(&a.largest()));
    let left_out = rows.len().saturating_sub(MOST_ROWS);
    rows.truncate(MOST_ROWS);
    let mut table = terminal::table(&[
        &format!("what moves {}", found.of.words()),
        "s per unit",
        "half a last digit",
        "by slope, s",
        "rerun -, s",
        "rerun +, s",
        "",
    ]);
    let number = |x: Option<f64>| x.map_or_else(|| "unknown".to_owned(), |x| format!("{x:.1e}"));
    // Each remark once, with the reruns that it is about.
    let mut remarks: Vec<(&str, Vec<String>)> = Vec::new();
    for row in rows {
        let rerun = |side: usize| {
            let Some(reruns) = &row.reruns else {
                return String::new();
            };
            match (reruns[side].shift, reruns[side].outcome) {
                (Some(shift), Outcome::SameEvents) => format!("{shift:+.1e} "),
                (Some(shift), _) => format!("{shift:+.1e}*"),
                (None, outcome) => format!("{}*", outcome.name()),
            }
        };
        table.add_row([
            format!("{}, {}", row.parameter.path, row.parameter.unit),
            row.slope
                .map_or_else(|| "none".to_owned(), |slope| format!("{slope:.2e}")),
            number(row.half_last_digit),
            number(row.predicted()),
            rerun(0),
            rerun(1),
            row.nonlinear()
                .filter(|not| *not)
                .map_or("", |_| "nonlinear")
                .to_owned(),
        ]);
        for (rerun, sign) in row.reruns.iter().flatten().zip(["-", "+"]) {
            if rerun.remark.is_empty() {
                continue;
            }
            let what = format!("{} {sign}", row.parameter.path);
            match remarks.iter_mut().find(|remark| remark.0 == rerun.remark) {
                Some((_, about)) => about.push(what),
                None => remarks.push((&rerun.remark, vec![what])),
            }
        }
    }
    terminal::align_right(&mut table, 1..6);
    if left_out > 0 {
        table.add_row([format!("... {left_out} more, which move it less")]);
    }
    let mut text = terminal::show(&table).trim_end().to_owned();
    for (remark, about) in remarks {
        text += &format!("\n* {}: {remark}", about.join(", "));
    }
    if let Some(reason) = &found.without_reruns {
        text += &format!("\nSlopes only: {reason}.");
    }
    if !found.held.is_empty() {
        text += &format!("\n{}", found.held);
    }
    text
}

/// One number's row, for programs.
pub(super) fn influence(row: &Sensitivity) -> Value {
    let rerun = |side: usize| row.reruns.as_ref().map(|reruns| &reruns[side]);
    json!({
        "slope": row.slope,
        "by_slope": row.predicted(),
        "minus": rerun(0),
        "plus": rerun(1),
        "nonlinear": row.nonlinear(),
    })
}

fn channel(channel: &ChannelBand) -> Value {
    json!({
        "name": channel.name,
        "unit": channel.unit,
        "band": channel.band,
        "at_fixed_time": channel.at_fixed_time,
        "largest": channel.largest,
    })
}

fn stretch(stretch: &Stretch) -> Value {
    let each = |numbers: &[f64]| -> serde_json::Map<String, Value> {
        let pairs = columns().zip(numbers);
        pairs.map(|((name, _, _), x)| ((*name).to_owned(), json!(x))).collect()
    };
    json!({
        "start": stretch.start,
        "end": stretch.end,
        "mode": stretch.mode.name(),
        "converged": stretch.converged,
        "time_uncertainty": stretch.time_uncertainty,
        "bands": each(&stretch.bands),
        "rates": each(&stretch.rates),
    })
}

fn known(x: f64) -> String {
    if x.is_finite() {
        format!("{x:.1e}")
    } else {
        "unknown".to_owned()
    }
}

fn row(event: &CertifiedEvent) -> Vec<String> {
    vec![
        event.kind.to_owned(),
        format!("{:.15}", event.time),
        event.verdict.name().to_owned(),
        known(event.uncertainty),
        event.digits().to_string(),
        format!("{:.1e}", event.rounding),
        event.growth.map_or_else(|| "none".to_owned(), |g| format!("{g:.1}")),
    ]
}

/// For the file.
pub(super) fn tables(
    certificate: &Certificate,
    result: &[Event],
    final_stick: Option<&Sensitivities>,
    exact: Option<&OracleSolution>,
) -> CertificateTables {
    let c = certificate;
    let missing = |x: Option<f64>| x.unwrap_or(f64::NAN);
    let finite = |x: f64| if x.is_finite() { x } else { f64::NAN };
    let parameters = &c.linearised.parameters;
    CertificateTables {
        time_uncertainty: c.events.iter().map(|e| finite(e.uncertainty)).collect(),
        verdict: c.events.iter().map(|e| e.verdict.code()).collect(),
        ladder_uncertainty: c.events.iter().map(|e| finite(e.ladder_uncertainty)).collect(),
        ladder_verdict: c.events.iter().map(|e| e.ladder_verdict.code()).collect(),
        true_error: c
            .by_oracle
            .then(|| c.events.iter().map(|e| missing(e.true_error)).collect()),
        verdicts: Verdict::ALL.map(|v| (v.code(), v.name())).to_vec(),
        rounding: c.events.iter().map(|e| finite(e.rounding)).collect(),
        growth: c.events.iter().map(|e| missing(e.growth)).collect(),
        ladder: c
            .ladder
            .iter()
            .map(|r| (r.method.to_owned(), r.rtol, r.agreeing as i64, missing(r.distance)))
            .collect(),
        texts: vec![
            ("verdict_of_all", c.verdict.name().to_owned()),
            (
                "uncertainty_by",
                if c.by_oracle { "oracle" } else { "ladder" }.to_owned(),
            ),
            ("contradiction", c.contradiction.clone().unwrap_or_default()),
            ("remedy", remedy(c)),
        ],
        numbers: vec![
            ("digits", c.least_digits().map_or(f64::NAN, f64::from)),
            ("digits_of_double", c.most_digits().map_or(f64::NAN, f64::from)),
            ("growth_exponent", missing(c.growth_exponent)),
            ("growth_to_onset", missing(c.growth_to_onset)),
            ("kick_above_noise", missing(c.kick_above_noise)),
            ("kick_above_methods", missing(c.kick_above_methods)),
        ],
        stretches: c
            .bands
            .stretches
            .iter()
            .map(|s| (s.start, s.end, s.mode.code(), s.time_uncertainty))
            .collect(),
        modes: mode_flags(),
        bands: columns()
            .enumerate()
            .map(|(column, (name, unit, _))| BandColumns {
                name: (*name).to_owned(),
                unit: (*unit).to_owned(),
                band: c.bands.stretches.iter().map(|s| s.bands[column]).collect(),
                rate: Some(c.bands.stretches.iter().map(|s| s.rates[column]).collect()),
            })
            .collect(),
        oracle: exact.map(csv).unwrap_or_default(),
        parameters: parameters.iter().map(|p| (p.path.clone(), p.unit.to_owned())).collect(),
        sensitivities: columns_of(final_stick, Affected::FinalStick, parameters.len()),
        sensitivity_uncertainty: None,
        sensitivity: (0..result.len())
            .map(|index| match c.linearised.events.get(index) {
                // Of the same event of the same sequence only.
                Some(event) if event.kind == result[index].kind => event.by_parameter.clone(),
                _ => vec![f64::NAN; parameters.len()],
            })
            .collect(),
    }
}

/// The oracle's events, a line each.
fn csv(exact: &OracleSolution) -> String {
    let mut lines = Vec::with_capacity(exact.report.events.len() + 1);
    let names = exact.report.events.first().map(|e| {
        e.state
            .components()
            .iter()
            .map(|(name, _)| *name)
            .collect::<Vec<_>>()
            .join(",")
    });
    lines.push(format!("time,kind,{}", names.unwrap_or_default()));
    for (index, event) in exact.report.events.iter().enumerate() {
        let digits = exact.digits_of_event(index) as usize;
        let state = event
            .state
            .components()
            .iter()
            .map(|(_, value)| value.to_decimal(digits))
            .collect::<Vec<_>>()
            .join(",");
        lines.push(format!(
            "{},{},{state}",
            event.time.to_decimal(digits),
            event.kind.name()
        ));
    }
    lines.join("\n") + "\n"
}
