//! `stickslip certify`.

use super::arguments::{CertifyOptions, Common, DPI, Format};
use super::modes::figure_target;
use super::plot::{bad, save};
use super::run::{Input, bad_case, bad_file, header, interrupt_flag, read_input, stick_slip_table};
use super::{CommandError, End, certify_report, print, print_json};
use crate::analysis::Summary;
use crate::analysis::bands::{Compared, compared_output};
use crate::analysis::certificate::{Certificate, CertifyError, Verdict, certify as certificate_of};
use crate::analysis::onset::{Onset, onsets};
use crate::case::{Case, CaseSource, Origin, Override};
use crate::model::Parameters;
use crate::oracle::{self, ExactParameters, OracleError, OracleOptions, OracleReport};
use crate::plot::{onset, style, svg};
use crate::results::{Overwrite, ResultError, ResultFile, ResultWriter, Status, check_target, write_certified};
use crate::simulation::{MemoryRecorder, simulate};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Digits that the oracle's events have, unless more are asked for.
const ORACLE_DIGITS: u32 = 25;

/// More digits are not in a double.
const DIGITS_OF_DOUBLE: u32 = 16;

/// Rows of a file that are read together.
const ROWS_AT_A_TIME: usize = 65_536;

/// The exact solution, with the number of digits that are true of its event times.
pub(super) struct Exact {
    pub report: OracleReport,
    /// True digits of each event time.
    pub digits: u32,
    /// s.
    pub seconds: f64,
}

/// Certifies a result: reports it, and writes a copy with the certificate.
pub(super) fn certify(options: &CertifyOptions, common: &Common) -> Result<End, CommandError> {
    let clock = Instant::now();
    let most = if options.oracle {
        *oracle::DIGITS.end()
    } else {
        DIGITS_OF_DOUBLE
    };
    if let Some(digits) = options.digits.filter(|digits| *digits == 0 || *digits > most) {
        let remedy = if options.oracle {
            "; the oracle computes with no more, of which the growth of perturbations takes some".to_owned()
        } else {
            let all = oracle::DIGITS.end();
            format!("; a double holds no more, and the oracle computes a table with up to {all}: add --oracle")
        };
        return Err(CommandError::Input(format!(
            "--digits {digits}: from 1 to {most} digits can be asked for{remedy}"
        )));
    }
    let input = read_input(&options.case, &options.budget.over(&options.set), None).map_err(without_case)?;
    if matches!(input.source.origin, Origin::Result(_)) && !options.set.is_empty() {
        return Err(CommandError::Input(
            "--set changes a case, but a result file is what it is: certify the case instead, or run it with --set first"
                .to_owned(),
        ));
    }
    let target = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}.certified.h5", input.source.name())));
    let overwrite = if options.force {
        Overwrite::Force
    } else {
        Overwrite::OwnResults
    };
    check_target(&target, overwrite, &input.files).map_err(bad_file)?;
    let drawing = options
        .figure
        .as_deref()
        .map(|path| figure_target(path, options.force, &input.files))
        .transpose()?;
    let stop = interrupt_flag()?;
    let Some(result) = obtain(&input, &target, &stop)? else {
        return Ok(End::Interrupted);
    };
    let outcome = examine(&input, &result.record, options, &stop);
    let written = outcome.and_then(|(certificate, exact)| {
        let tables = certify_report::tables(&certificate, &result.record.events, exact.as_ref());
        write_certified(&result.path, &target, overwrite, &tables).map_err(bad_file)?;
        Ok((certificate, exact))
    });
    drop(result.scratch);
    let (certificate, exact) = match written {
        Ok(written) => written,
        Err(_) if stop.load(Ordering::Relaxed) => return Ok(End::Interrupted),
        Err(error) => return Err(error),
    };
    let drawn = match drawing {
        Some(drawing) => match draw(&input.case, drawing, &stop)? {
            Some(onsets) => onsets,
            None => return Ok(End::Interrupted),
        },
        None => Vec::new(),
    };
    let report = certify_report::Report {
        source: input.source.label(),
        title: &input.case.title,
        certificate: &certificate,
        exact: exact.as_ref(),
        result: &result.record.events,
        half_last_digits: &half_last_digits(&input, &options.set)?,
        file: target.display().to_string(),
        figure: drawing.map(|(path, _)| path.display().to_string()),
        onsets: &drawn,
        seconds: clock.elapsed().as_secs_f64(),
    };
    if common.json {
        print_json(&report.document())?;
    } else if !common.quiet {
        print(&report.text())?;
    }
    match options
        .digits
        .and_then(|digits| shortfall(digits, &certificate, exact.as_ref()))
    {
        Some(text) => Err(CommandError::Computation(text)),
        None => Ok(End::Done),
    }
}

/// Draws the first stick against the tolerance; `None` if it was interrupted.
fn draw(case: &Case, (path, format): (&Path, Format), stop: &AtomicBool) -> Result<Option<Vec<Onset>>, CommandError> {
    let Some(onsets) = onsets(case, &|| stop.load(Ordering::Relaxed)) else {
        return Ok(None);
    };
    let text = svg::svg(&onset::figure(&case.title, &onsets), style::COLUMN_WIDTH).map_err(bad)?;
    save(path, &text, format, DPI).map_err(bad)?;
    Ok(Some(onsets))
}

/// The result that is certified.
struct Obtained {
    path: PathBuf,
    /// Its events, and its rows as far as they are compared.
    record: MemoryRecorder,
    /// Where the file was made here, and goes again.
    scratch: Option<Scratch>,
}

/// A result file that is made on the way, and removed with its partial file however the command ends.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        for path in [&self.0, &crate::results::partial_path(&self.0)] {
            let _ = std::fs::remove_file(path);
        }
    }
}

/// The given result file, or a run of the case beside the target; `None` if it was interrupted.
fn obtain(input: &Input, target: &Path, stop: &AtomicBool) -> Result<Option<Obtained>, CommandError> {
    if let Origin::Result(path) = &input.source.origin {
        let file = ResultFile::open(path).map_err(bad_file)?;
        if *file.status() != Status::Complete {
            return Err(CommandError::Input(format!(
                "{}: the run is {}, and only a complete one can be certified; repeat it with stickslip run {}",
                path.display(),
                file.status().name(),
                path.display()
            )));
        }
        return Ok(Some(Obtained {
            path: path.clone(),
            record: read_back(&file, &input.case).map_err(bad_file)?,
            scratch: None,
        }));
    }
    let stem = target.file_stem().unwrap_or_default().to_string_lossy();
    let path = target.with_file_name(format!(".{stem}.{}.uncertified.h5", std::process::id()));
    let case = &input.case;
    let scratch = Scratch(path.clone());
    let failed = CommandError::Computation;
    let mut writer = ResultWriter::create(
        &path,
        Overwrite::OwnResults,
        &input.files,
        &header(case, input.text.clone()),
    )
    .map_err(bad_file)?;
    let clock = Instant::now();
    let report = simulate(
        &case.parameters,
        &case.solver,
        &case.output,
        &mut writer,
        &mut |_| match stop.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        },
    )
    .map_err(|failure| failed(failure.to_string()))?;
    if report.interrupted {
        return Ok(None);
    }
    let summary = Summary::of_run(&case.parameters, &report);
    writer
        .finish(
            Status::Complete,
            &stick_slip_table(&summary),
            clock.elapsed().as_secs_f64(),
        )
        .map_err(|error| failed(error.to_string()))?;
    let record = ResultFile::open(&path).and_then(|file| read_back(&file, case));
    Ok(Some(Obtained {
        record: record.map_err(|error| failed(error.to_string()))?,
        path,
        scratch: Some(scratch),
    }))
}

/// What is certified of a file.
fn read_back(file: &ResultFile, case: &Case) -> Result<MemoryRecorder, ResultError> {
    let mut compared = Compared::new(&compared_output(&case.output));
    let (mut samples, count) = (Vec::new(), file.sample_count()?);
    for from in (0..count).step_by(ROWS_AT_A_TIME) {
        let rows = file.samples(from..count.min(from + ROWS_AT_A_TIME))?;
        samples.extend(rows.into_iter().filter(|row| compared.takes(row.time)));
    }
    Ok(MemoryRecorder {
        samples,
        events: file.events()?,
        segments: Vec::new(),
    })
}

/// The ladder, and the oracle if it is asked for.
fn examine(
    input: &Input,
    record: &MemoryRecorder,
    options: &CertifyOptions,
    stop: &Arc<AtomicBool>,
) -> Result<(Certificate, Option<Exact>), CommandError> {
    let stopped = || stop.load(Ordering::Relaxed);
    let certificate = certificate_of(&input.case, record, &stopped).map_err(|error| match error {
        CertifyError::Run(text) => CommandError::Computation(text),
        CertifyError::Interrupted => CommandError::Computation("interrupted".to_owned()),
    })?;
    if !options.oracle {
        return Ok((certificate, None));
    }
    let exact = exact_parameters(input, &options.set)?;
    let wanted = options.digits.unwrap_or(0).max(ORACLE_DIGITS);
    let exact = solve(&input.case, &exact, &certificate, wanted, &stopped)?;
    Ok((certificate, Some(exact)))
}

/// What is missing for a certificate in a file that has lost its case.
fn without_case(error: CommandError) -> CommandError {
    match error {
        CommandError::Input(text) if text.contains("/input") => CommandError::Input(format!(
            "{text}. A result is certified by runs of its case, which this file no longer holds: certify the case itself"
        )),
        other => other,
    }
}

/// The overrides, and where the numbers of the case are as they were written: the text as given, if it is the case of the run;
/// else the resolved case.
fn as_written(input: &Input, set: &[String]) -> Result<(CaseSource, Vec<Override>), CommandError> {
    let mut overrides = Vec::with_capacity(set.len());
    for setting in set {
        overrides.push(Override::parse(setting).map_err(bad_case)?);
    }
    let given = CaseSource {
        text: input.text.clone(),
        origin: input.source.origin.clone(),
    };
    let same = |exact: &ExactParameters| -> bool {
        let rounded: Parameters = exact.rounded();
        rounded == input.case.parameters
    };
    let source = match Case::exact_parameters(&given, &overrides) {
        Ok(exact) if same(&exact) => given,
        _ => input.source.clone(),
    };
    Ok((source, overrides))
}

fn exact_parameters(input: &Input, set: &[String]) -> Result<ExactParameters, CommandError> {
    let (source, overrides) = as_written(input, set)?;
    Case::exact_parameters(&source, &overrides).map_err(bad_case)
}

fn half_last_digits(input: &Input, set: &[String]) -> Result<Vec<(String, f64)>, CommandError> {
    let (source, overrides) = as_written(input, set)?;
    Case::half_last_digits(&source, &overrides).map_err(bad_case)
}

/// Runs the oracle with so many digits that `wanted` of them are true of the event times.
fn solve(
    case: &Case,
    exact: &ExactParameters,
    certificate: &Certificate,
    wanted: u32,
    stopped: &dyn Fn() -> bool,
) -> Result<Exact, CommandError> {
    // Without a kick above noise, exact sliding goes on through all of G.
    let growth = match certificate.verdict {
        Verdict::Converged => certificate.growth_to_onset.unwrap_or(0.0),
        _ => certificate.growth_exponent.unwrap_or(0.0),
    };
    // A deviation that grows by the whole of it; the oracle has guard digits for the sums of rounding on the way.
    let lost = (growth / std::f64::consts::LN_10).ceil() as u32;
    let digits = (wanted + lost).max(*oracle::DIGITS.start());
    if digits > *oracle::DIGITS.end() {
        return Err(CommandError::Input(format!(
            "{wanted} digits of this case take {digits} to compute with, as a deviation can grow by e^{growth:.0}; the \
             oracle has {}. Ask for {} digits, or set a perturbation, which ends the growth earlier",
            oracle::DIGITS.end(),
            oracle::DIGITS.end().saturating_sub(lost)
        )));
    }
    let end_time = oracle::rational(&format!("{:e}", case.output.end_time))
        .ok_or_else(|| CommandError::Input("output.end_time is no decimal number".to_owned()))?;
    let options = OracleOptions {
        digits,
        end_time,
        sample_times: Vec::new(),
        max_events: case.solver.max_events,
    };
    let clock = Instant::now();
    let report = oracle::run(exact, &options, &mut |_| match stopped() {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    })
    .map_err(|error| match error {
        OracleError::BreakawayTest | OracleError::Digits { .. } => CommandError::Input(error.to_string()),
        _ => CommandError::Computation(error.to_string()),
    })?;
    Ok(Exact {
        report,
        digits: digits - lost,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// What is missing of the digits that were asked for.
fn shortfall(digits: u32, certificate: &Certificate, exact: Option<&Exact>) -> Option<String> {
    if let Some(exact) = exact.filter(|exact| exact.digits >= digits && digits > DIGITS_OF_DOUBLE) {
        log::info!("the oracle's events have {} digits", exact.digits);
        return None;
    }
    let least = certificate.least_digits()?;
    if certificate.verdict == Verdict::Converged && least >= digits {
        return None;
    }
    let most = certificate.most_digits().unwrap_or(0);
    Some(match certificate.verdict {
        Verdict::Converged if digits > most => format!(
            "{digits} digits were asked for, but rounding to double precision leaves {most} of the event that it moves \
             most; this result has {least}. Ask for fewer, or use --oracle for a table with more"
        ),
        Verdict::Converged => format!(
            "{digits} digits were asked for, and the result has {least}: use a smaller solver.rtol, or solver.method = \
             \"auto\" or \"series\""
        ),
        verdict => format!(
            "{digits} digits were asked for, but the result is {}: {}",
            verdict.name(),
            certify_report::remedy(certificate)
        ),
    })
}
