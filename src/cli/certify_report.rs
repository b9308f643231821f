//! What `stickslip certify` prints and stores.

use super::terminal;
use crate::analysis::Certified;
use crate::analysis::advice::remedy;
use crate::analysis::bands::{ChannelBand, Stretch};
use crate::analysis::certificate::{Certificate, CertifiedEvent, Verdict};
use crate::analysis::ladder::Rung;
use crate::analysis::linearised::Slope;
use crate::analysis::sensitivity::{
    Affected, CaseSensitivities, Outcome, Sensitivities, Sensitivity, columns as columns_of,
};
use crate::analysis::stability::onset::Onset;
use crate::case::{Case, CaseNumber, Words};
use crate::oracle::{OracleEvent, OracleSolution};
use crate::provenance::extension;
use crate::results::schema::extended_tables;
use crate::results::{BandColumns, CertificateTables};
use serde_json::{Value, json};

/// Rows of a table on a terminal: beyond, only the first and last events, and the parameters that matter most.
const MOST_ROWS: usize = 24;

/// Everything that is reported.
pub(super) struct Report<'a> {
    pub source: String,
    pub case: &'a Case,
    pub certified: &'a Certified,
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
        let c = &self.certified.certificate;
        let header = [
            "method",
            "rtol",
            "events",
            "agreeing",
            "largest distance",
            "first stick, s",
            "wall time",
        ];
        let rung = |rung: &Rung| {
            vec![
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
            ]
        };
        let ladder = terminal::lines(&header, c.ladder.iter().map(rung), 1..7);
        let mut parts = vec![
            format!("{}\n{}", &self.case.title, self.heading()),
            format!(
                "{}{}{}",
                ladder.trim_end(),
                self.smooth_stop(),
                c.left_out
                    .as_ref()
                    .map_or_else(String::new, |text| format!("\n{text}."))
            ),
            terminal::show(&self.events()).trim_end().to_owned(),
            self.channels(),
        ];
        parts.extend(self.result().map(sensitivities));
        parts.extend(without_sensitivities(self.certified).map(|why| format!("No sensitivities: {why}.")));
        parts.extend(
            c.growth_exponent
                .or(c.most_digits().map(f64::from))
                .map(|_| self.conditioning()),
        );
        if let Some(exact) = &self.certified.exact {
            parts.push(self.oracle(exact));
        }
        parts.push(self.verdict());
        let figure = self
            .figure
            .as_ref()
            .map_or_else(String::new, |path| format!("{path}\n"));
        format!("{}\n\n{}\n{figure}", parts.join("\n\n"), self.file)
    }

    /// Where the case is from, how it was run, and what its certificate rests on.
    fn heading(&self) -> String {
        let solver = &self.certified.certificate.solver;
        let by = match &self.certified.exact {
            Some(exact) => format!(
                "by the oracle, which computed with {} digits; {} are true of every event",
                exact.digits_computed, exact.digits
            ),
            None => "by the ladder of methods alone".to_owned(),
        };
        format!(
            "{}\nmethod {}, rtol {:e}; uncertainties {by}; {:.2} s",
            self.source,
            solver.method.name(),
            solver.rtol,
            self.seconds
        )
    }

    /// What moves what the run comes to.
    fn result(&self) -> Option<&Sensitivities> {
        known_sensitivities(self.certified)?.result.as_ref()
    }

    /// What "(smooth)" in the ladder means, where it stands.
    fn smooth_stop(&self) -> &'static str {
        if !self.certified.certificate.ladder.iter().any(|rung| rung.smooth_stop) {
            return "";
        }
        "\n(smooth): series alone follows smooth sliding itself, free of rounding, to its exact stop. Where the onset of the \
         other methods is noise, that is the model without any deviation, and no witness for a run that has one."
    }

    fn events(&self) -> comfy_table::Table {
        let events = &self.certified.certificate.events;
        let exact = self.certified.certificate.by_oracle;
        let mut header = vec!["event", "time, s", "verdict", "uncertainty, s", "digits"];
        let followed = events.iter().any(|event| !event.rounding.is_nan());
        if followed {
            header.extend(["rounding, s", "growth"]);
        }
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
            if followed {
                row.push(known(event.rounding));
                row.push(event.growth.map_or_else(|| "none".to_owned(), |g| format!("{g:.1}")));
            }
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
        let row = |channel: &ChannelBand| {
            vec![
                channel.name.clone(),
                channel.unit.clone(),
                format!("{:.3e}", channel.largest),
                known(channel.band),
                known(channel.at_fixed_time),
            ]
        };
        let rows = self.certified.certificate.bands.channels.iter().map(row);
        let header = ["channel", "unit", "largest", "band", "at a fixed time"];
        terminal::lines(&header, rows, 2..5).trim_end().to_owned()
    }

    fn conditioning(&self) -> String {
        let c = &self.certified.certificate;
        let number = |x: Option<f64>| x.map(|x| format!("{x:.2}"));
        let rows = [
            ("growth exponent G", number(c.growth_exponent)),
            ("of it up to the first stick", number(c.growth_to_onset)),
            ("kick above rounding, e-folds", number(c.kick_above_noise)),
            (
                "kick above the methods' own noise, e-folds",
                number(c.kick_above_methods),
            ),
            (
                "digits that double precision can hold",
                c.most_digits().map(|n| n.to_string()),
            ),
        ];
        let rows = rows.map(|(name, value)| vec![name.to_owned(), value.unwrap_or_else(|| "none".to_owned())]);
        terminal::lines(&[], rows, []).trim_end().to_owned()
    }

    fn oracle(&self, exact: &OracleSolution) -> String {
        let report = &exact.report;
        let row = |(index, event): (usize, &OracleEvent)| {
            let digits = exact.digits_of_event(index);
            let time = event.time.to_decimal(digits as usize);
            vec![event.kind.name().to_owned(), time, digits.to_string()]
        };
        let rows = report.events.iter().enumerate().map(row);
        let table = terminal::lines(&["event", "exact time, s", "digits"], rows, [2]);
        format!(
            "oracle: Taylor series with {} bits, {} steps, in {:.1} s with the shorter run that its digits are counted \
             by; of every event {} digits or more are true\n\n{}",
            report.bits,
            report.steps,
            exact.seconds,
            exact.digits,
            table.trim_end()
        )
    }

    fn verdict(&self) -> String {
        let c = &self.certified.certificate;
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
        let c = &self.certified.certificate;
        let result = self.result();
        let final_stick = result.filter(|result| result.of == Affected::FinalStick);
        let oracle = self.certified.exact.as_ref().map(|exact| {
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
        let known = known_sensitivities(self.certified);
        let row = |(column, parameter): (usize, &CaseNumber)| {
            let events = known.map_or(&[][..], |known| &known.events);
            let of = |of: fn(&Slope) -> f64| events.iter().map(|row| of(&row[column])).collect::<Vec<f64>>();
            let row = self.result().map(|result| &result.rows[column]);
            let influence = row.map(influence);
            json!({
                "parameter": parameter.path,
                "unit": parameter.unit,
                "value": parameter.value,
                "half_last_digit": row.and_then(|row| row.parameter.half_last_digit),
                "time_sensitivity": of(|slope| slope.value),
                "time_sensitivity_uncertainty": of(|slope| slope.uncertainty),
                "final_stick": final_stick.and(influence.as_ref()),
                "result": influence,
            })
        };
        let sensitivity: Vec<Value> = known
            .iter()
            .flat_map(|known| known.parameters.iter().enumerate().map(row))
            .collect();
        json!({
            "file": self.file,
            "figure": self.figure,
            "onsets": self.onsets,
            "case": self.source,
            "title": &self.case.title,
            "uncertainty_by": uncertainty_by(c),
            "converged": c.verdict == Verdict::Converged,
            "without_oracle": c.without_oracle,
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
            "channels": c.bands.channels,
            "stretches": c.bands.stretches.iter().map(|of| stretch(of, &c.bands.channels)).collect::<Vec<Value>>(),
            "sensitivity": sensitivity,
            "final_stick": final_stick.map(|found| json!({
                "time": found.time,
                "held": found.held,
                "without_reruns": found.without_reruns,
            })),
            "result": result.map(|result| json!({ "of": result.of, "value": result.time })),
            "without_sensitivities": without_sensitivities(self.certified),
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
            number(row.parameter.half_last_digit),
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

fn stretch(stretch: &Stretch, channels: &[ChannelBand]) -> Value {
    let each = |numbers: &[f64]| -> serde_json::Map<String, Value> {
        let pairs = channels.iter().zip(numbers);
        pairs.map(|(channel, x)| (channel.name.clone(), json!(x))).collect()
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
    ]
}

fn known_sensitivities(certified: &Certified) -> Option<&CaseSensitivities> {
    certified.sensitivities.as_ref()?.as_ref().ok()
}

fn without_sensitivities(certified: &Certified) -> Option<&str> {
    Some(certified.sensitivities.as_ref()?.as_ref().err()?)
}

/// What the uncertainties of the events come from.
fn uncertainty_by(certificate: &Certificate) -> &'static str {
    if certificate.by_oracle { "oracle" } else { "ladder" }
}

/// For the file.
pub(super) fn tables(case: &Case, certified: &Certified) -> CertificateTables {
    let c = &certified.certificate;
    let missing = |x: Option<f64>| x.unwrap_or(f64::NAN);
    let finite = |x: f64| if x.is_finite() { x } else { f64::NAN };
    let known = known_sensitivities(certified);
    let parameters = known.map_or(&[][..], |known| &known.parameters);
    // Nothing is known of an event that is not converged.
    let matrix = |of: fn(&Slope) -> f64| -> Vec<Vec<f64>> {
        let row = |index: usize| match known.and_then(|known| known.events.get(index)) {
            Some(row) => row.iter().map(of).collect(),
            None => vec![f64::NAN; parameters.len()],
        };
        (0..c.events.len()).map(row).collect()
    };
    let uncertainty = matrix(|slope| slope.uncertainty);
    let result = known.and_then(|known| known.result.as_ref());
    let affected = result.map_or(expected(case), |result| result.of);
    let mut sensitivities = columns_of(result, affected, parameters.len());
    sensitivities.texts.push(("of", affected.name().to_owned()));
    let why = without_sensitivities(certified).map(|why| ("without_sensitivities", why.to_owned()));
    sensitivities.texts.extend(why);
    let [trajectory, ..] = extended_tables(&extension(case));
    let mode = trajectory
        .variables
        .into_iter()
        .find(|variable| variable.name == "mode");
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
            ("uncertainty_by", uncertainty_by(c).to_owned()),
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
        modes: mode.map(|mode| mode.flags).unwrap_or_default(),
        bands: c
            .bands
            .channels
            .iter()
            .enumerate()
            .map(|(column, channel)| BandColumns {
                name: channel.name.clone(),
                unit: channel.unit.clone(),
                band: c.bands.stretches.iter().map(|s| s.bands[column]).collect(),
                rate: c.bands.stretches.iter().map(|s| s.rates[column]).collect(),
            })
            .collect(),
        oracle: certified
            .exact
            .as_ref()
            .map(|exact| csv(case.words(), exact))
            .unwrap_or_default(),
        parameters: parameters.iter().map(|p| (p.path.clone(), p.unit.to_owned())).collect(),
        sensitivities,
        sensitivity: matrix(|slope| slope.value),
        sensitivity_uncertainty: uncertainty.iter().flatten().any(|x| !x.is_nan()).then_some(uncertainty),
    }
}

/// What a run of the case comes to, where it did not.
fn expected(case: &Case) -> Affected {
    match case.stops() {
        true => Affected::FinalStick,
        false => Affected::LastEvent,
    }
}

/// The oracle's events, a line each: with the state behind them where the paper has letters for it, else with the mode.
fn csv(words: Words, exact: &OracleSolution) -> String {
    let line = |index: usize, event: &OracleEvent| -> Vec<(&str, String)> {
        let digits = exact.digits_of_event(index).max(1) as usize;
        let mut line = vec![
            ("time", event.time.to_decimal(digits)),
            ("kind", event.kind.name().to_owned()),
        ];
        match words.has_letters() {
            true => {
                let state = event.state.components().into_iter();
                line.extend(state.map(|(name, value)| (name, value.to_decimal(digits))));
            }
            false => line.push(("mode_after", event.mode_after.name().to_owned())),
        }
        line
    };
    let lines: Vec<_> = exact
        .report
        .events
        .iter()
        .enumerate()
        .map(|(index, event)| line(index, event))
        .collect();
    let names = lines
        .first()
        .map(|line| line.iter().map(|(name, _)| (*name).to_owned()).collect());
    let values = lines
        .into_iter()
        .map(|line| line.into_iter().map(|(_, value)| value).collect());
    let rows = names.into_iter().chain(values);
    rows.map(|row: Vec<String>| row.join(",") + "\n").collect()
}
