//! `stickslip certify`.

use super::arguments::{CertifyOptions, Common, DPI, Format};
use super::input::{Given, Input, Scratch, bad_case, bad_file, interrupt_flag, output_of, overrides};
use super::modes::{FIGURE, figure_target};
use super::plot::{bad, save};
use super::progress::OracleBar;
use super::{CommandError, End, certify_report, complain, print, print_json, strictly, trains, wants_json, wants_text};
use crate::analysis::advice::{DIGITS_OF_DOUBLE, shortfall};
use crate::analysis::bands::{Compared, compared_output};
use crate::analysis::certificate::{CertifyError, Verdict};
use crate::analysis::exact::as_written as written_numbers;
use crate::analysis::onset::{Onset, onsets};
use crate::analysis::{Certified, Certify, Deadline, SavedRun, Stage, Warning};
use crate::case::{Case, CaseSource, Origin, Override, TrainCase};
use crate::oracle::{self, OracleError};
use crate::plot::{onset, style, svg};
use crate::record::MemoryRecorder;
use crate::results::{Overwrite, ResultError, ResultFile, Status, check_target, write_certified};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Rows of a file that are read together.
const ROWS_AT_A_TIME: usize = 65_536;

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
    let given = Given::read(&options.case).map_err(without_case)?;
    let set = options.budget.over(&options.set);
    let changes = overrides(&set, None).map_err(bad_case)?;
    if TrainCase::is_one(&given.source, &changes) {
        return trains::certify(&given, &changes, options, common);
    }
    let input = given.case(&changes).map_err(without_case)?;
    if matches!(input.source.origin, Origin::Result(_)) && !options.set.is_empty() {
        return Err(CommandError::Input(
            "--set changes a case, but a result file is what it is: certify the case instead, or run it with --set first"
                .to_owned(),
        ));
    }
    let target = output_of(&input.source, options.output.as_deref(), ".certified.h5")?;
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
    let interrupted = |when: &str, kept: &str| {
        if !common.quiet {
            complain(&format!("interrupted {when}; {kept}"));
        }
        Ok(End::Interrupted)
    };
    let (nothing, kept) = ("no certificate was written", target.display());
    let Some(result) = obtain(&input, &target, &stop)? else {
        return interrupted("during the run that was to be certified", nothing);
    };
    let deadline = Deadline::after(clock, input.case.solver.max_wall_time);
    let outcome = examine(&input, &result.record, options, common, deadline, &stop);
    let written = outcome.and_then(|examined| {
        let Certified {
            certificate,
            final_stick,
            exact,
            ..
        } = &examined;
        let tables = certify_report::tables(certificate, &result.record.events, final_stick.as_ref(), exact.as_ref());
        write_certified(&result.path, &target, overwrite, &tables).map_err(bad_file)?;
        Ok(examined)
    });
    drop(result.scratch);
    let Certified {
        certificate,
        final_stick,
        exact,
        interrupted: missing_stage,
    } = match written {
        Ok(written) => written,
        Err(_) if stop.load(Ordering::Relaxed) => {
            return interrupted("during the ladder of independent runs", nothing);
        }
        Err(error) => return Err(error),
    };
    if let Some(stage) = missing_stage {
        let (when, without) = match stage {
            Stage::Sensitivities => ("during the reruns for the sensitivities", "without these"),
            Stage::Oracle => ("while the oracle computed", "without exact events"),
        };
        return interrupted(when, &format!("{kept} has the certificate, {without}"));
    }
    let stopped = || stop.load(Ordering::Relaxed);
    let given_up = || stopped() || deadline.is_over();
    let drawn = match drawing
        .map(|drawing| draw(&input.case, drawing, &given_up))
        .transpose()?
    {
        Some(None) if stopped() => {
            let kept = format!("{kept} has the certificate, and there is no figure");
            return interrupted("during the runs of the figure", &kept);
        }
        drawn => drawn,
    };
    let late = matches!(drawn, Some(None));
    let onsets = drawn.flatten().unwrap_or_default();
    let report = certify_report::Report {
        source: input.source.label(),
        title: &input.case.title,
        certificate: &certificate,
        exact: exact.as_ref(),
        final_stick: final_stick.as_ref(),
        file: target.display().to_string(),
        figure: drawing.filter(|_| !late).map(|(path, _)| path.display().to_string()),
        onsets: &onsets,
        seconds: clock.elapsed().as_secs_f64(),
    };
    if wants_json(common) {
        print_json(&report.document())?;
    }
    if wants_text(common) {
        print(&report.text())?;
    }
    if !common.quiet {
        // That an onset is noise is said by the verdict.
        let others = certificate.warnings.iter();
        for warning in others.filter(|warning| !matches!(warning, Warning::NoiseDetermined { .. })) {
            complain(&format!("warning: {warning}"));
        }
    }
    if late {
        return Err(CommandError::Computation(
            "there is no figure: the wall time was over before its runs were done; allow more (--max-wall-time)"
                .to_owned(),
        ));
    }
    let missing = options
        .digits
        .and_then(|digits| shortfall(&input.case, &certificate, exact.as_ref(), digits, &given_up));
    match missing {
        _ if stopped() => interrupted(
            "while other settings were tried for the digits that are missing",
            &format!("{kept} has the certificate"),
        ),
        Some(text) => Err(CommandError::Computation(text)),
        None => {
            let mut doubts: Vec<String> = certificate.warnings.iter().map(Warning::to_string).collect();
            // That an onset is noise was said by the verdict, and not as a warning.
            let said = certificate.verdict == Verdict::Converged;
            if !said && doubts.is_empty() {
                doubts.push(format!("the verdict on the events is {}.", certificate.verdict.name()));
            }
            strictly(End::Done, options.strict, &doubts, !common.quiet && said, &target)
        }
    }
}

/// Draws the first stick against the tolerance; `None` if it was interrupted.
fn draw(
    case: &Case,
    (path, format): (&Path, Format),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Vec<Onset>>, CommandError> {
    let Some(onsets) = onsets(case, stop) else {
        return Ok(None);
    };
    let figure = onset::figure(&case.title, &onsets);
    let text = svg::svg(&figure, style::COLUMN_WIDTH).map_err(bad)?;
    save(path, FIGURE, &text, &figure.full_title(), format, DPI).map_err(bad)?;
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
    let saved = SavedRun::new(case, &path)
        .text(&input.text)
        .inputs(&input.files)
        .stop(stop)
        .start()
        .map_err(bad_file)?;
    if let Some(failure) = saved.failure {
        return Err(failed(failure.to_string()));
    }
    if saved.report.interrupted {
        return Ok(None);
    }
    if let Some(error) = saved.unsaved {
        return Err(failed(error.to_string()));
    }
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
        let rows = file.finite_samples(from..count.min(from + ROWS_AT_A_TIME))?;
        samples.extend(rows.into_iter().filter(|row| compared.takes(row.time)));
    }
    Ok(MemoryRecorder {
        samples,
        events: file.events()?,
        segments: Vec::new(),
    })
}

/// The ladder, what moves the final stick, and the oracle if it is asked for. What is interrupted after the ladder leaves
/// that.
fn examine(
    input: &Input,
    record: &MemoryRecorder,
    options: &CertifyOptions,
    common: &Common,
    deadline: Deadline,
    stop: &AtomicBool,
) -> Result<Certified, CommandError> {
    let (source, overrides) = as_written(input, &options.set)?;
    let half_last_digits = Case::half_last_digits(&source, &overrides).map_err(bad_case)?;
    let certify = Certify::new(&input.case)
        .sensitivities(&half_last_digits)
        .until(deadline)
        .stop(stop);
    let bar = OracleBar::new(common);
    let exact = options
        .oracle
        .then(|| Case::exact_parameters(&source, &overrides).map_err(bad_case))
        .transpose()?;
    let certify = match &exact {
        Some(exact) => certify
            .oracle(exact, options.digits.unwrap_or(0))
            .progress(|now| bar.show(now)),
        None => certify,
    };
    let certified = certify.start(record);
    bar.finish();
    certified.map_err(|error| match error {
        CertifyError::Run(text) => CommandError::Computation(text),
        CertifyError::Oracle(error @ (OracleError::BreakawayTest | OracleError::Digits { .. })) => {
            CommandError::Input(error.to_string())
        }
        error => CommandError::Computation(error.to_string()),
    })
}

/// What is missing for a certificate in a file that has lost its case.
fn without_case(error: CommandError) -> CommandError {
    if !error.text().contains("/input") {
        return error;
    }
    let text = format!(
        "{}. A result is certified by runs of its case, which this file no longer holds: certify the case itself",
        error.text()
    );
    error.saying(text)
}

/// The overrides, and where the numbers of the case are as they were written.
fn as_written(input: &Input, set: &[String]) -> Result<(CaseSource, Vec<Override>), CommandError> {
    let overrides = overrides(set, None).map_err(bad_case)?;
    let given = CaseSource {
        text: input.text.clone(),
        origin: input.source.origin.clone(),
    };
    let source = written_numbers(&input.case, &given, &input.source, &overrides).clone();
    Ok((source, overrides))
}
