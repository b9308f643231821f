//! `stickslip certify` of two trains.

use super::arguments::{CertifyOptions, Common};
use super::certify_report::{influence, sensitivities};
use super::input::{Given, Scratch, bad_case, bad_file, interrupt_flag, output_of};
use super::progress::OracleBar;
use super::{CommandError, End, complain, print, print_json, strictly, terminal, wants_json, wants_text};
use crate::analysis::SavedRun;
use crate::analysis::headline::decimals;
use crate::analysis::linearised::ParameterName;
use crate::analysis::sensitivity::Sensitivities;
use crate::analysis::trains::{
    self, CertifiedTrainEvent, Slope, TrainBand, TrainCertificate, TrainCertifyRequest, TrainRecord, TrainRung,
    TrainStretch,
};
use crate::case::{CaseSource, Origin, Override, TrainCase};
use crate::oracle::OracleError;
use crate::results::{Overwrite, ResultFile, Status, check_target, write_certified};
use crate::simulation::Method;
use serde::Serialize;
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// The JSON document of a certificate.
#[derive(Serialize)]
struct CertificateDocument<'a> {
    case: String,
    title: &'a str,
    /// The result with its certificate.
    file: String,
    /// "oracle", or "ladder" where that could not solve the case.
    uncertainty_by: &'static str,
    /// Whether every event is converged.
    converged: bool,
    /// Fewest digits of any event.
    digits: Option<u32>,
    events: &'a [CertifiedTrainEvent],
    ladder: &'a [TrainRung],
    #[serde(skip_serializing_if = "Option::is_none")]
    without_oracle: Option<&'a str>,
    /// How far the rows of the trajectory can be off, by channel and by stretch.
    channels: Vec<Value>,
    stretches: Vec<Value>,
    /// What each number of the case does to the events, and to what the run comes to.
    sensitivity: Vec<Value>,
    /// What the run comes to, of which `sensitivity` tells.
    result: Option<Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    without_sensitivities: Option<&'a str>,
    /// s.
    seconds: f64,
}

/// Certifies a run of trains: reports it, and writes a copy of the result with the certificate.
pub(super) fn certify(
    given: &Given,
    changes: &[Override],
    options: &CertifyOptions,
    common: &Common,
) -> Result<End, CommandError> {
    let clock = Instant::now();
    if options.figure.is_some() {
        return Err(CommandError::Input(
            "--figure draws how the first stick depends on the tolerance of a brake's run; a case of trains has no such \
             figure: leave it out"
                .to_owned(),
        ));
    }
    let case = TrainCase::parse(&given.source, changes).map_err(bad_case)?;
    let written = Written::new(given, changes, &case);
    let exact = TrainCase::exact_parameters(&written.source, written.changes).map_err(bad_case)?;
    let threshold = TrainCase::exact_threshold(&written.source, written.changes).map_err(bad_case)?;
    let target = output_of(&given.source, options.output.as_deref(), ".certified.h5")?;
    let overwrite = if options.force {
        Overwrite::Force
    } else {
        Overwrite::OwnResults
    };
    check_target(&target, overwrite, &given.files).map_err(bad_file)?;
    let stop = interrupt_flag()?;
    let (path, scratch) = match &given.source.origin {
        Origin::Result(_) if !options.set.is_empty() => {
            return Err(CommandError::Input(
                "--set changes a case, but a result file is what it is: certify the case instead, or run it with --set \
                 first"
                    .to_owned(),
            ));
        }
        Origin::Result(path) => (path.clone(), None),
        _ => {
            let stem = target.file_stem().unwrap_or_default().to_string_lossy();
            let path = target.with_file_name(format!(".{stem}.{}.uncertified.h5", std::process::id()));
            let scratch = Scratch(path.clone());
            let saved = SavedRun::new(&case, &path)
                .text(&given.text)
                .inputs(&given.files)
                .stop(&stop)
                .start()
                .map_err(bad_file)?;
            if let Some(failure) = saved.failure {
                return Err(CommandError::Computation(failure.to_string()));
            }
            if saved.report.interrupted {
                return Ok(End::Interrupted);
            }
            if let Some(error) = saved.unsaved {
                return Err(CommandError::Computation(error.to_string()));
            }
            (path, Some(scratch))
        }
    };
    let file = ResultFile::open(&path).map_err(bad_file)?;
    if *file.status() != Status::Complete {
        return Err(CommandError::Input(format!(
            "{}: the run is {}, and only a complete one can be certified; repeat it with stickslip run {}",
            path.display(),
            file.status().name(),
            path.display()
        )));
    }
    let record = TrainRecord::read(&file, &case).map_err(bad_file)?;
    let defaults = TrainCertifyRequest::default();
    let request = TrainCertifyRequest {
        digits: options.digits.unwrap_or(0).max(defaults.digits),
        ..defaults
    };
    let bar = OracleBar::new(common);
    let exact = (&exact, threshold.as_ref());
    let certified = trains::certify(&case, exact, &record, &request, &mut |progress| {
        bar.show(progress);
        match stop.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    bar.finish();
    let mut certificate = match certified {
        Ok(certificate) => certificate,
        Err(OracleError::Interrupted(_)) => {
            if !common.quiet {
                complain("interrupted while the oracle computed; no certificate was written");
            }
            return Ok(End::Interrupted);
        }
        Err(error) => return Err(CommandError::Computation(error.to_string())),
    };
    let stopped = || stop.load(Ordering::Relaxed);
    certificate.add_sensitivities(
        (&written.source, written.changes),
        written.given.as_ref(),
        &record,
        &stopped,
    );
    write_certified(&path, &target, overwrite, &certificate.tables()).map_err(bad_file)?;
    drop(scratch);
    if stopped() {
        if !common.quiet {
            let kept = target.display();
            complain(&format!(
                "interrupted during the runs for the sensitivities; {kept} has the certificate, without these"
            ));
        }
        return Ok(End::Interrupted);
    }
    let seconds = clock.elapsed().as_secs_f64();
    if wants_json(common) {
        print_json(&CertificateDocument {
            case: given.source.label(),
            title: &case.title,
            file: target.display().to_string(),
            uncertainty_by: if certificate.exact.is_some() {
                "oracle"
            } else {
                "ladder"
            },
            converged: certificate.converged(),
            digits: certificate.least_digits(),
            events: &certificate.events,
            ladder: &certificate.ladder,
            without_oracle: certificate.without_oracle.as_deref(),
            channels: certificate.bands.channels.iter().map(channel).collect(),
            stretches: stretches(&certificate),
            sensitivity: sensitivity(&certificate),
            result: result_of(&certificate).map(|result| json!({ "of": result.of, "value": result.time })),
            without_sensitivities: without_sensitivities(&certificate),
            seconds,
        })?;
    }
    if wants_text(common) {
        print(&certificate_text(&case, &certificate, seconds))?;
        print(&format!("\n{}\n", target.display()))?;
    }
    if !common.quiet
        && let Some(why) = &certificate.without_oracle
    {
        complain(&format!(
            "warning: the uncertainties are those of the ladder alone: {why}"
        ));
    }
    // With --oracle it is the exact times that are to have the digits.
    let of_exact = certificate.exact.as_ref().filter(|_| options.oracle);
    let has = of_exact
        .map(|exact| exact.digits)
        .or(certificate.least_digits())
        .unwrap_or(16);
    match options.digits {
        _ if !certificate.converged() => Err(CommandError::Computation(format!(
            "the events of the run are not those of the exact solution from the one marked sequence-differs on; {}",
            remedy(&case)
        ))),
        Some(digits) if has < digits => Err(CommandError::Computation(format!(
            "{digits} digits were asked for, and an event has {has}; {}. The file has the exact times in /certificate/oracle",
            remedy(&case)
        ))),
        _ => {
            let without = certificate.without_oracle.as_ref();
            let doubt = without.map(|why| format!("the uncertainties are those of the ladder alone: {why}."));
            let doubts: Vec<String> = doubt.into_iter().collect();
            strictly(End::Done, options.strict, &doubts, !common.quiet, &target)
        }
    }
}

/// Where the numbers of a case are as they were written.
struct Written<'a> {
    source: CaseSource,
    /// What changes them there.
    changes: &'a [Override],
    /// Where the source is a resolved case: the text that it was made of.
    given: Option<CaseSource>,
}

impl<'a> Written<'a> {
    /// The text that a result file keeps, where that still gives its case; else the resolved one.
    fn new(given: &Given, changes: &'a [Override], case: &TrainCase) -> Written<'a> {
        let Origin::Result(_) = given.source.origin else {
            return Written {
                source: given.source.clone(),
                changes,
                given: None,
            };
        };
        let text = CaseSource {
            text: given.text.clone(),
            origin: given.source.origin.clone(),
        };
        match TrainCase::parse(&text, &[]) {
            Ok(read) if (&read.parameters, read.threshold) == (&case.parameters, case.threshold) => Written {
                source: text,
                changes: &[],
                given: None,
            },
            _ => Written {
                source: given.source.clone(),
                changes,
                given: Some(text),
            },
        }
    }
}

/// What helps where events have fewer digits than are wanted.
fn remedy(case: &TrainCase) -> String {
    match case.solver.method {
        Method::Series => {
            "the run is by series already, whose events are exact to the rounding of double precision".to_owned()
        }
        _ => format!(
            "run the case with method \"series\", or with a smaller solver.rtol than {:e}",
            case.solver.rtol
        ),
    }
}

fn channel(channel: &TrainBand) -> Value {
    json!({
        "name": channel.name,
        "unit": channel.unit,
        "band": channel.band,
        "largest": channel.largest,
    })
}

fn stretches(certificate: &TrainCertificate) -> Vec<Value> {
    let bands = &certificate.bands;
    let stretch = |stretch: &TrainStretch| {
        let named = bands.channels.iter().zip(&stretch.bands);
        let bands: serde_json::Map<String, Value> = named
            .map(|(channel, band)| (channel.name.clone(), json!(band)))
            .collect();
        json!({
            "start": stretch.start,
            "end": stretch.end,
            "mode": stretch.mode.name(),
            "time_uncertainty": stretch.time_uncertainty,
            "bands": bands,
        })
    };
    bands.stretches.iter().map(stretch).collect()
}

/// One document for each number of the case.
fn sensitivity(certificate: &TrainCertificate) -> Vec<Value> {
    let Some(known) = certificate.known_sensitivities() else {
        return Vec::new();
    };
    let numbers = known.parameters.iter().enumerate();
    let document = |(column, parameter): (usize, &ParameterName)| {
        let of = |of: fn(&Slope) -> f64| known.events.iter().map(|row| of(&row[column])).collect::<Vec<f64>>();
        let row = known.result.as_ref().map(|result| &result.rows[column]);
        json!({
            "parameter": parameter.path,
            "unit": parameter.unit,
            "value": parameter.value,
            "half_last_digit": row.and_then(|row| row.half_last_digit),
            "time_sensitivity": of(|slope| slope.value),
            "time_sensitivity_uncertainty": of(|slope| slope.uncertainty),
            "result": row.map(influence),
        })
    };
    numbers.map(document).collect()
}

fn result_of(certificate: &TrainCertificate) -> Option<&Sensitivities> {
    certificate.known_sensitivities()?.result.as_ref()
}

fn without_sensitivities(certificate: &TrainCertificate) -> Option<&str> {
    match certificate.sensitivities.as_ref()? {
        Ok(_) => None,
        Err(why) => Some(why),
    }
}

fn certificate_text(case: &TrainCase, certificate: &TrainCertificate, seconds: f64) -> String {
    let mut events = terminal::table(&["event", "kind", "time, s", "uncertainty", "digits", "exact time, s"]);
    for (index, event) in certificate.events.iter().enumerate() {
        let uncertainty = event
            .uncertainty
            .map_or_else(|| "sequence-differs".to_owned(), |u| format!("{u:.1e} s"));
        events.add_row([
            index.to_string(),
            event.kind.to_owned(),
            event.uncertainty.map_or_else(
                || format!("{:.9}", event.time),
                |uncertainty| format!("{:.*}", decimals(uncertainty, 15), event.time),
            ),
            uncertainty,
            event.digits().to_string(),
            event.exact.clone().unwrap_or_default(),
        ]);
    }
    terminal::align_right(&mut events, [0, 2, 3, 4]);
    let mut ladder = terminal::table(&["method", "rtol", "events", "agreeing", "largest distance"]);
    for rung in &certificate.ladder {
        ladder.add_row([
            rung.method.to_owned(),
            format!("{:.0e}", rung.rtol),
            rung.events.to_string(),
            rung.agreeing.to_string(),
            match (&rung.failure, rung.distance) {
                (Some(_), _) => "failed".to_owned(),
                (None, Some(distance)) => format!("{distance:.1e} s"),
                (None, None) => "none".to_owned(),
            },
        ]);
    }
    terminal::align_right(&mut ladder, 1..5);
    let by = match &certificate.exact {
        Some(exact) => format!(
            "by the oracle, which computed with {} digits; {} are true of every event",
            exact.digits_computed, exact.digits
        ),
        None => "by the ladder of methods alone".to_owned(),
    };
    let mut channels = terminal::table(&["channel", "unit", "largest", "band"]);
    for channel in &certificate.bands.channels {
        let band = match channel.band.is_finite() {
            true => format!("{:.1e}", channel.band),
            false => "unknown".to_owned(),
        };
        channels.add_row([
            channel.name.clone(),
            channel.unit.clone(),
            format!("{:.3e}", channel.largest),
            band,
        ]);
    }
    terminal::align_right(&mut channels, 2..4);
    let mut parts = vec![
        terminal::show(&events).trim_end().to_owned(),
        terminal::show(&ladder).trim_end().to_owned(),
        terminal::show(&channels).trim_end().to_owned(),
    ];
    parts.extend(result_of(certificate).map(sensitivities));
    parts.extend(without_sensitivities(certificate).map(|why| format!("No sensitivities: {why}.")));
    format!(
        "{}\nmethod {}, rtol {:e}; uncertainties {by}; {seconds:.2} s\n\n{}\n",
        case.title,
        case.solver.method.name(),
        case.solver.rtol,
        parts.join("\n\n"),
    )
}
