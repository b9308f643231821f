//! `stickslip certify`.

use super::arguments::{CertifyOptions, Common, DPI, Format};
use super::input::{Given, Scratch, bad_case, bad_file, interrupt_flag, output_of, overrides, overwrite};
use super::modes::{FIGURE, figure_target};
use super::plot::{bad, save};
use super::progress::Bar;
use super::{CommandError, End, certify_report, complain, print, print_json, strictly, wants_json, wants_text};
use crate::analysis::advice::{DIGITS_OF_DOUBLE, remedy, shortfall};
use crate::analysis::bands::{Compared, columns, compared_output};
use crate::analysis::certificate::{Certificate, CertifyError, Verdict};
use crate::analysis::stability::onset::{Onset, onsets};
use crate::analysis::{Certified, Certify, Deadline, SavedRun, Stage, Warning, Written};
use crate::case::{Case, CaseSource, Origin};
use crate::model::margin::resistance;
use crate::oracle::{self, OracleError};
use crate::plot::{onset, style, svg};
use crate::record::{Channels, MemoryRecorder, State};
use crate::results::{ResultError, ResultFile, Status, check_target, write_certified};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Rows of a file that are read together.
const ROWS_AT_A_TIME: usize = 65_536;

/// Where the oracle is asked without being asked for: the digits that it is to have, and the time after which the ladder decides.
const UNASKED: (u32, Duration) = (18, Duration::from_secs(600));

/// Whether the oracle decides even without `--oracle`, if it can. Sliding that slows down by itself has a verdict of its own by the
/// ladder, down to what rounding does.
fn oracle_decides(case: &Case) -> bool {
    !case.stops()
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
    let given = Given::read(&options.case).map_err(without_case)?;
    let set = options.budget.over(&options.set);
    let changes = overrides(&set, None).map_err(bad_case)?;
    let case = &Case::read(&given.source, &changes)
        .map_err(bad_case)
        .map_err(without_case)?;
    if matches!(given.source.origin, Origin::Result(_)) && !options.set.is_empty() {
        return Err(CommandError::Input(
            "--set changes a case, but a result file is what it is: certify the case instead, or run it with --set first"
                .to_owned(),
        ));
    }
    let target = output_of(&given.source, options.output.as_deref(), ".certified.h5")?;
    check_target(&target, overwrite(options.force), &given.files).map_err(bad_file)?;
    if let (Some(_), Err(reason)) = (&options.figure, resistance(&case.system)) {
        return Err(CommandError::Input(format!(
            "--figure draws how the first stick of sliding that slows down by itself depends on the tolerance, and this case has no \
             such sliding: {reason}; leave it out"
        )));
    }
    let drawing = options
        .figure
        .as_deref()
        .map(|path| figure_target(path, options.force, &given.files))
        .transpose()?;
    let stop = interrupt_flag()?;
    let interrupted = |when: &str, kept: &str| {
        if !common.quiet {
            complain(&format!("interrupted {when}; {kept}"));
        }
        Ok(End::Interrupted)
    };
    let (nothing, kept) = ("no certificate was written", target.display());
    let Some(result) = obtain(&given, case, &target, &stop)? else {
        return interrupted("during the run that was to be certified", nothing);
    };
    let deadline = Deadline::after(clock, case.solver.max_wall_time);
    let text = CaseSource {
        text: given.text.clone(),
        origin: given.source.origin.clone(),
    };
    let of_result = matches!(given.source.origin, Origin::Result(_));
    let written = Written::new(case, of_result.then_some(text), &given.source, &changes);
    let outcome = examine((case, &written), &result.record, options, common, deadline, &stop);
    let written = outcome.and_then(|examined| {
        let tables = certify_report::tables(case, &examined);
        write_certified(&result.path, &target, overwrite(options.force), &tables).map_err(bad_file)?;
        Ok(examined)
    });
    drop(result.scratch);
    let certified = match written {
        Ok(written) => written,
        Err(_) if stop.load(Ordering::Relaxed) => {
            return interrupted("during the ladder of independent runs", nothing);
        }
        Err(error) => return Err(error),
    };
    let (certificate, exact) = (&certified.certificate, certified.exact.as_ref());
    if let Some(stage) = certified.interrupted {
        let (when, without) = match stage {
            Stage::Sensitivities => ("during the reruns for the sensitivities", "without these"),
            Stage::Oracle => ("while the oracle computed", "without exact events"),
        };
        return interrupted(when, &format!("{kept} has the certificate, {without}"));
    }
    let stopped = || stop.load(Ordering::Relaxed);
    let given_up = || stopped() || deadline.is_over();
    let drawn = match drawing.map(|drawing| draw(case, drawing, &given_up)).transpose()? {
        Some(None) if stopped() => {
            let kept = format!("{kept} has the certificate, and there is no figure");
            return interrupted("during the runs of the figure", &kept);
        }
        drawn => drawn,
    };
    let late = matches!(drawn, Some(None));
    let onsets = drawn.flatten().unwrap_or_default();
    let report = certify_report::Report {
        source: given.source.label(),
        case,
        certified: &certified,
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
    let by_ladder = certificate.without_oracle.as_ref();
    let by_ladder = by_ladder.map(|why| format!("the uncertainties are those of the ladder alone: {why}"));
    if !common.quiet {
        // That an onset is noise is said by the verdict.
        let others = certificate.warnings.iter();
        let others = others.filter(|warning| !matches!(warning, Warning::NoiseDetermined { .. }));
        for warning in others.map(Warning::to_string).chain(by_ladder.clone()) {
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
        .and_then(|digits| shortfall(case, certificate, exact, digits, &given_up));
    match missing {
        _ if stopped() => interrupted(
            "while other settings were tried for the digits that are missing",
            &format!("{kept} has the certificate"),
        ),
        Some(text) => Err(CommandError::Computation(text)),
        None if oracle_decides(case) && certificate.verdict != Verdict::Converged => {
            Err(CommandError::Computation(not_certified(certificate)))
        }
        None => {
            let mut doubts: Vec<String> = certificate.warnings.iter().map(Warning::to_string).collect();
            doubts.extend(by_ladder.map(|why| why + "."));
            // That an onset is noise was said by the verdict, and not as a warning.
            let said = certificate.verdict == Verdict::Converged;
            if !said && doubts.is_empty() {
                doubts.push(format!("the verdict on the events is {}.", certificate.verdict.name()));
            }
            strictly(End::Done, options.strict, &doubts, !common.quiet && said, &target)
        }
    }
}

/// What to say of events that are not certified.
fn not_certified(certificate: &Certificate) -> String {
    let from = "from the one marked sequence-differs on";
    let unfinished = certificate.ladder.iter().find_map(|rung| rung.failure.as_ref());
    match unfinished.filter(|_| !certificate.by_oracle) {
        Some(failure) => {
            format!("the events {from} are not certified, as not every run of the ladder came to its end: {failure}")
        }
        None => format!(
            "the events of the run are not those of the exact solution {from}; {}",
            remedy(certificate)
        ),
    }
}

/// Draws the first stick against the tolerance; `None` if it was interrupted.
fn draw(
    case: &Case,
    (path, format): (&Path, Format),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Vec<Onset>>, CommandError> {
    let Some(onsets) = onsets(&case.system, &case.solver, case.output.end_time, stop) else {
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
fn obtain(given: &Given, case: &Case, target: &Path, stop: &AtomicBool) -> Result<Option<Obtained>, CommandError> {
    if let Origin::Result(path) = &given.source.origin {
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
            record: read_back(&file, case).map_err(bad_file)?,
            scratch: None,
        }));
    }
    let stem = target.file_stem().unwrap_or_default().to_string_lossy();
    let path = target.with_file_name(format!(".{stem}.{}.uncertified.h5", std::process::id()));
    let scratch = Scratch(path.clone());
    let failed = CommandError::Computation;
    let saved = SavedRun::new(case, &path)
        .text(&given.text)
        .inputs(&given.files)
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
    let further: Vec<String> = columns(case)
        .skip(State::COUNT + Channels::COUNT)
        .map(|(name, _)| name)
        .collect();
    let mut record = MemoryRecorder::default();
    let at_events: Vec<Vec<f64>> = ["before", "after"]
        .iter()
        .flat_map(|side| further.iter().map(move |name| format!("{name}_{side}")))
        .map(|name| file.event_column(&name))
        .collect::<Result<_, _>>()?;
    for (index, event) in file.events()?.iter().enumerate() {
        let of_event: Vec<f64> = at_events.iter().map(|column| column[index]).collect();
        record.push_event(event, &of_event);
    }
    let count = file.sample_count()?;
    for from in (0..count).step_by(ROWS_AT_A_TIME) {
        let range = from..count.min(from + ROWS_AT_A_TIME);
        let samples = file.finite_samples(range.clone())?;
        let beyond = further.iter().map(|name| file.column(name, range.clone()));
        let beyond = beyond.collect::<Result<Vec<_>, _>>()?;
        for (index, sample) in samples
            .into_iter()
            .enumerate()
            .filter(|(_, row)| compared.takes(row.time))
        {
            let of_row: Vec<f64> = beyond.iter().map(|column| column[index]).collect();
            record.push(&sample, &of_row);
        }
    }
    Ok(record)
}

/// The ladder, the oracle where it is to speak, and what the numbers of the case do. What is interrupted after the ladder leaves
/// that.
fn examine(
    (case, written): (&Case, &Written),
    record: &MemoryRecorder,
    options: &CertifyOptions,
    common: &Common,
    deadline: Deadline,
    stop: &AtomicBool,
) -> Result<Certified, CommandError> {
    let bar = Bar::new(common);
    let wanted = options.oracle || oracle_decides(case);
    let exact = wanted.then(|| written.exact()).transpose().map_err(bad_case)?;
    let certify = Certify::new(case).sensitivities(written).until(deadline).stop(stop);
    let certify = certify.progress(|now| bar.oracle(now));
    let digits = options.digits.unwrap_or(0);
    let certify = match &exact {
        Some(exact) if oracle_decides(case) => certify.oracle_within(exact, digits.max(UNASKED.0), UNASKED.1),
        Some(exact) => certify.oracle(exact, digits),
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
