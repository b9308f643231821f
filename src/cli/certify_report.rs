//! Report and tables of `stickslip certify`.

use super::terminal::{self, or_none};
use serde_json::{Value, json};
use stickslip_analysis::analysis::Certified;
use stickslip_analysis::analysis::advice::remedy;
use stickslip_analysis::analysis::bands::{BandStretch, ChannelBand};
use stickslip_analysis::analysis::certificate::{Certificate, CertifiedEvent, Verdict};
use stickslip_analysis::analysis::ladder::Rung;
use stickslip_analysis::analysis::linearised::Slope;
use stickslip_analysis::analysis::sensitivity::{
    Affected, CaseSensitivities, RerunOutcome, Sensitivities, Sensitivity, SensitivityRerun, add_sensitivities,
};
use stickslip_analysis::analysis::stability::onset::Onset;
use stickslip_analysis::provenance::extension;
use stickslip_case::{Case, CaseNumber, Words};
use stickslip_files::schema::{TIME_UNCERTAINTY, extended_tables, group};
use stickslip_files::{Addition, FileColumn};
use stickslip_oracle::{OracleEvent, OracleSolution};
use stickslip_system::quote::bound;

/// Most rows of a table on a terminal. A longer one shows the first and last events, and the most influential
/// parameters.
const MOST_ROWS: usize = 24;

pub(super) struct Report<'a> {
    pub source: String,
    pub case: &'a Case,
    pub certified: &'a Certified,
    pub file: String,
    pub figure: Option<String>,
    pub onsets: &'a [Onset],
    /// Wall time, s.
    pub seconds: f64,
}

impl Report<'_> {
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
                or_none(rung.onset, |t| {
                    format!("{t:.12}{}", if rung.smooth_stop { " (smooth)" } else { "" })
                }),
                format!("{:.2} s", rung.seconds),
            ]
        };
        let ladder = terminal::lines(&header, c.ladder.iter().map(rung), 1..7);
        let left_out = c.left_out.iter().map(|text| format!("\n{text}."));
        let mut parts = vec![
            format!("{}\n{}", &self.case.title, self.heading()),
            format!(
                "{}{}{}",
                ladder.trim_end(),
                self.smooth_stop(),
                left_out.collect::<String>()
            ),
            self.events(),
            self.channels(),
        ];
        parts.extend(self.result().map(sensitivities));
        parts.extend(without_sensitivities(self.certified).map(|why| format!("No sensitivities: {why}.")));
        if c.growth_exponent.is_some() || c.most_digits().is_some() {
            parts.push(self.conditioning());
        }
        parts.extend(self.certified.exact.as_ref().map(|exact| self.oracle(exact)));
        parts.push(self.verdict());
        let figure: String = self.figure.iter().map(|path| format!("{path}\n")).collect();
        format!("{}\n\n{}\n{figure}", parts.join("\n\n"), self.file)
    }

    fn heading(&self) -> String {
        let solver = &self.certified.certificate.solver;
        let by = match &self.certified.exact {
            Some(exact) => format!(
                "by the exact solver (oracle), which computed with {} digits; {} are true of every event",
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

    fn result(&self) -> Option<&Sensitivities> {
        known_sensitivities(self.certified)?.result.as_ref()
    }

    fn smooth_stop(&self) -> &'static str {
        if !self.certified.certificate.ladder.iter().any(|rung| rung.smooth_stop) {
            return "";
        }
        "\n(smooth): series alone follows smooth sliding itself, free of rounding, to its exact stop. Where the onset of the \
         other methods is noise, that is the model without any deviation, and no check of a run that has one."
    }

    fn events(&self) -> String {
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
        let row = |event: &CertifiedEvent| {
            let mut row = vec![
                event.kind.to_owned(),
                format!("{:.15}", event.time),
                event.verdict.name().to_owned(),
                known(event.uncertainty),
                event.digits().to_string(),
            ];
            if followed {
                row.extend([known(event.rounding), or_none(event.growth, |g| format!("{g:.1}"))]);
            }
            if exact {
                let error = or_none(event.true_error, |e| format!("{e:.1e}"));
                row.extend([known(event.ladder_uncertainty), error]);
            }
            row
        };
        let left_out = events.len().saturating_sub(MOST_ROWS);
        let (first, last) = match left_out {
            0 => (events.len(), events.len()),
            _ => (MOST_ROWS / 2, events.len() - MOST_ROWS / 2),
        };
        let more = (left_out > 0).then(|| vec!["...".to_owned(), format!("{left_out} more")]);
        let rows = events[..first].iter().map(row).chain(more);
        let rows = rows.chain(events[last..].iter().map(row));
        terminal::lines(&header, rows, [1, 3, 4, 5, 6, 7, 8])
            .trim_end()
            .to_owned()
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
        let number = |x: Option<f64>| or_none(x, |x| format!("{x:.2}"));
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
                or_none(c.most_digits(), |n| n.to_string()),
            ),
        ];
        terminal::pairs(rows).trim_end().to_owned()
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
            "exact solver: Taylor series with {} bits, {} steps, in {:.1} s with the shorter run by which its digits are \
             counted; at least {} digits of every event are true\n\n{}",
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
                let digits = c.least_digits().map(|n| format!(", {n} digits of the least known"));
                let digits = digits.unwrap_or_default();
                let by = if c.by_oracle { " of the exact one" } else { "" };
                format!("converged: every event within {} s{by}{digits}", bound(worst, 1))
            }
            verdict => format!("{}: {}", verdict.name(), remedy(c)),
        };
        match &c.contradiction {
            Some(contradiction) => format!("{verdict}\n\ncontradiction: {contradiction}"),
            None => verdict,
        }
    }

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
            let row = result.map(|result| &result.rows[column]);
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
        let parameters = known.iter().flat_map(|known| known.parameters.iter().enumerate());
        let sensitivity: Vec<Value> = parameters.map(row).collect();
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

pub(super) fn sensitivities(found: &Sensitivities) -> String {
    let mut rows: Vec<&Sensitivity> = found.rows.iter().collect();
    rows.sort_by(|a, b| b.largest().total_cmp(&a.largest()));
    let left_out = rows.len().saturating_sub(MOST_ROWS);
    rows.truncate(MOST_ROWS);
    let what = format!("what moves {}", found.of.words());
    let header = [
        &*what,
        "s per unit",
        "half a last digit",
        "by slope, s",
        "rerun -, s",
        "rerun +, s",
        "",
    ];
    let number = |x: Option<f64>| x.map_or_else(|| "unknown".to_owned(), |x| format!("{x:.1e}"));
    let rerun = |rerun: &SensitivityRerun| match (rerun.shift, rerun.outcome) {
        (Some(shift), RerunOutcome::SameEvents) => format!("{shift:+.1e} "),
        (Some(shift), _) => format!("{shift:+.1e}*"),
        (None, outcome) => format!("{}*", outcome.name()),
    };
    let cells = |row: &&Sensitivity| {
        let [below, above] = row
            .reruns
            .as_ref()
            .map(|[below, above]| [rerun(below), rerun(above)])
            .unwrap_or_default();
        vec![
            format!("{}, {}", row.parameter.path, row.parameter.unit),
            or_none(row.slope, |slope| format!("{slope:.2e}")),
            number(row.parameter.half_last_digit),
            number(row.predicted()),
            below,
            above,
            if row.nonlinear() == Some(true) { "nonlinear" } else { "" }.to_owned(),
        ]
    };
    let more = (left_out > 0).then(|| vec![format!("... {left_out} more, which move it less")]);
    let mut text = terminal::lines(&header, rows.iter().map(cells).chain(more), 1..6)
        .trim_end()
        .to_owned();
    // Each remark is written once, with all its reruns.
    let mut remarks: Vec<(&str, Vec<String>)> = Vec::new();
    for row in rows {
        for (rerun, sign) in row.reruns.iter().flatten().zip(["-", "+"]) {
            let about = format!("{} {sign}", row.parameter.path);
            match remarks.iter_mut().find(|remark| remark.0 == rerun.remark) {
                _ if rerun.remark.is_empty() => {}
                Some((_, others)) => others.push(about),
                None => remarks.push((&rerun.remark, vec![about])),
            }
        }
    }
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

fn stretch(stretch: &BandStretch, channels: &[ChannelBand]) -> Value {
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
        bound(x, 1)
    } else {
        "unknown".to_owned()
    }
}

fn known_sensitivities(certified: &Certified) -> Option<&CaseSensitivities> {
    certified.sensitivities.as_ref()?.as_ref().ok()
}

fn without_sensitivities(certified: &Certified) -> Option<&str> {
    Some(certified.sensitivities.as_ref()?.as_ref().err()?)
}

fn uncertainty_by(certificate: &Certificate) -> &'static str {
    if certificate.by_oracle { "oracle" } else { "ladder" }
}

pub(super) fn tables(case: &Case, certified: &Certified) -> Vec<Addition> {
    let mut events = Addition::new(group::EVENTS);
    events.over(
        &["event"],
        FileColumn::numbers(
            TIME_UNCERTAINTY,
            "s",
            "how far from the exact solution of the stated model the event can be; NaN: not converged",
            certified.certificate.events.iter().map(|e| finite(e.uncertainty)),
        ),
    );
    vec![events, certificate(case, certified), sensitivity(case, certified)]
}

fn missing(x: Option<f64>) -> f64 {
    x.unwrap_or(f64::NAN)
}

fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::NAN }
}

fn certificate(case: &Case, certified: &Certified) -> Addition {
    let c = &certified.certificate;
    let mut group = Addition::new(group::CERTIFICATE);
    group.attribute("verdict_of_all", c.verdict.name());
    group.attribute("uncertainty_by", uncertainty_by(c));
    group.attribute("contradiction", c.contradiction.clone().unwrap_or_default());
    group.attribute("remedy", remedy(c));
    for (name, number) in [
        ("digits", c.least_digits().map(f64::from)),
        ("digits_of_double", c.most_digits().map(f64::from)),
        ("growth_exponent", c.growth_exponent),
        ("growth_to_onset", c.growth_to_onset),
        ("kick_above_noise", c.kick_above_noise),
        ("kick_above_methods", c.kick_above_methods),
    ] {
        group.attribute(name, missing(number));
    }

    group.dimension("event", c.events.len(), "index of the event");
    let codes = |name: &str, long_name: &str, of: fn(&CertifiedEvent) -> Verdict| {
        let words = Verdict::ALL.map(|v| (v.code().into(), v.name().to_owned())).to_vec();
        FileColumn::codes(name, long_name, c.events.iter().map(|e| of(e).code()), words)
    };
    let numbers = |name: &str, unit: &str, long_name: &str, of: fn(&CertifiedEvent) -> f64| {
        FileColumn::numbers(name, unit, long_name, c.events.iter().map(of))
    };
    let columns = [
        Some(codes("verdict", "verdict on the event", |e| e.verdict)),
        Some(codes(
            "ladder_verdict",
            "verdict on the event by the ladder of methods alone",
            |e| e.ladder_verdict,
        )),
        Some(numbers(
            "ladder_uncertainty",
            "s",
            "uncertainty of the event by the ladder of methods alone; NaN: not converged",
            |e| finite(e.ladder_uncertainty),
        )),
        c.by_oracle.then(|| {
            let long_name =
                "distance of the event from the exact one, own less exact; NaN: the exact solution has none near it";
            numbers("true_error", "s", long_name, |e| missing(e.true_error))
        }),
        Some(numbers(
            "rounding",
            "s",
            "how far rounding to double precision, of the input and of the state and the clock at every event before, moves the event",
            |e| finite(e.rounding),
        )),
        Some(numbers(
            "growth",
            "1",
            "e-folds by which a deviation has grown from the loss of stability, or from a later kick on smooth sliding, to the event",
            |e| missing(e.growth),
        )),
    ];
    columns
        .into_iter()
        .flatten()
        .for_each(|column| group.over(&["event"], column));

    group.dimension("rung", c.ladder.len(), "index of the run of the ladder");
    let mut methods: Vec<&str> = Vec::new();
    for rung in &c.ladder {
        if !methods.contains(&rung.method) {
            methods.push(rung.method);
        }
    }
    let code = |rung: &Rung| methods.iter().position(|name| *name == rung.method).unwrap_or_default() as i8;
    let words = (0..).zip(methods.iter().map(|&name| name.to_owned())).collect();
    let distance = "largest distance to the result over the agreeing events";
    let agreeing = FileColumn::counts(
        "rung_agreeing",
        "events of the sequence that agree with the result's, from the first on",
        c.ladder.iter().map(|rung| rung.agreeing as i64),
    );
    for column in [
        FileColumn::codes("rung_method", "integration method", c.ladder.iter().map(code), words),
        FileColumn::numbers(
            "rung_rtol",
            "1",
            "relative tolerance",
            c.ladder.iter().map(|rung| rung.rtol),
        ),
        agreeing,
        FileColumn::numbers(
            "rung_distance",
            "s",
            distance,
            c.ladder.iter().map(|rung| missing(rung.distance)),
        ),
    ] {
        group.over(&["rung"], column);
    }

    bands(case, c, &mut group);
    if let Some(exact) = &certified.exact {
        let long_name = "exact events in multiple precision: time (s), kind, states (CSV)";
        group.text("oracle", long_name, csv(case.words, exact));
    }
    group
}

fn bands(case: &Case, c: &Certificate, group: &mut Addition) {
    let stretches = &c.bands.stretches;
    let dimension = "index of the stretch: before the event of the same index, the last before the end of the run";
    group.dimension("stretch", stretches.len(), dimension);
    let numbers = |name: &str, unit: &str, long_name: &str, of: &dyn Fn(&BandStretch) -> f64| {
        FileColumn::numbers(name, unit, long_name, stretches.iter().map(of))
    };
    let [trajectory, ..] = extended_tables(&extension(case));
    let mode = trajectory
        .variables
        .into_iter()
        .find(|variable| variable.name == "mode");
    let modes = mode.map(|mode| mode.flags).unwrap_or_default();
    let of_modes = stretches.iter().map(|stretch| stretch.mode.code());
    let uncertainty = "larger uncertainty of the events at its ends; NaN: not converged";
    for column in [
        numbers("stretch_start", "s", "where it starts", &|stretch| stretch.start),
        numbers("stretch_end", "s", "where it ends", &|stretch| stretch.end),
        FileColumn::codes("stretch_mode", "what the contact does in it", of_modes, modes),
        numbers("stretch_time_uncertainty", "s", uncertainty, &|stretch| {
            stretch.time_uncertainty
        }),
    ] {
        group.over(&["stretch"], column);
    }
    for (k, ChannelBand { name, unit, .. }) in c.bands.channels.iter().enumerate() {
        let band = format!(
            "how far {name} can be from the exact solution at the same share of its own way between the events"
        );
        group.over(
            &["stretch"],
            numbers(&format!("band_{name}"), unit, &band, &|stretch| stretch.bands[k]),
        );
        let rate =
            format!("largest |d({name})/dt|; times stretch_time_uncertainty, what to add to the band at a fixed time");
        let rate_unit = match unit.strip_suffix("s-1") {
            Some(rest) => format!("{rest}s-2"),
            None => format!("{unit} s-1"),
        };
        group.over(
            &["stretch"],
            numbers(&format!("rate_{name}"), &rate_unit, &rate, &|stretch| stretch.rates[k]),
        );
    }
}

fn sensitivity(case: &Case, certified: &Certified) -> Addition {
    let known = known_sensitivities(certified);
    let parameters = known.map_or(&[][..], |known| &known.parameters);
    let events = certified.certificate.events.len();
    let mut group = Addition::new(group::SENSITIVITY);
    let list = |of: fn(&CaseNumber) -> &str| parameters.iter().map(of).collect::<Vec<_>>().join(", ");
    group.attribute("parameters", list(|parameter| &parameter.path));
    group.attribute("parameter_units", list(|parameter| parameter.unit));
    group.dimension("event", events, "index of the event");
    group.dimension("parameter", parameters.len(), "index of the parameter");
    // An event that has not converged has no known derivative.
    let matrix = |of: fn(&Slope) -> f64| -> Vec<f64> {
        let row = |index: usize| match known.and_then(|known| known.events.get(index)) {
            Some(row) => row.iter().map(of).collect(),
            None => vec![f64::NAN; parameters.len()],
        };
        (0..events).flat_map(row).collect()
    };
    let long_name =
        "d(event time)/d(parameter), s for each unit of the parameter (attribute parameter_units of the group)";
    let slopes = FileColumn::numbers("time_sensitivity", "s", long_name, matrix(|slope| slope.value));
    group.over(&["event", "parameter"], slopes);
    let uncertainty = matrix(|slope| slope.uncertainty);
    if uncertainty.iter().any(|x| !x.is_nan()) {
        let long_name = "how far time_sensitivity can be off, in its unit";
        let column = FileColumn::numbers("time_sensitivity_uncertainty", "s", long_name, uncertainty);
        group.over(&["event", "parameter"], column);
    }
    let result = known.and_then(|known| known.result.as_ref());
    let affected = result.map_or(expected(case), |result| result.of);
    add_sensitivities(&mut group, result, affected, parameters.len());
    group.attribute("of", affected.name());
    if let Some(why) = without_sensitivities(certified) {
        group.attribute("without_sensitivities", why);
    }
    group
}

fn expected(case: &Case) -> Affected {
    match case.stops() {
        true => Affected::FinalStick,
        false => Affected::LastEvent,
    }
}

/// The events of the exact solution as CSV. They have the state after each event if the case has the paper's letters,
/// else the mode.
fn csv(words: Words, exact: &OracleSolution) -> String {
    let mut text = String::new();
    for (index, event) in exact.report.events.iter().enumerate() {
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
        let (names, values): (Vec<&str>, Vec<String>) = line.into_iter().unzip();
        if index == 0 {
            text += &(names.join(",") + "\n");
        }
        text += &(values.join(",") + "\n");
    }
    text
}
