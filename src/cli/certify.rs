//! `stickslip certify`: how many digits of a result are true.

use super::arguments::{CertifyOptions, Common};
use super::input::{GivenCase, Scratch, interrupt_flag, output_of, overrides};
use super::plot::{self, FigureOutput, figure_output};
use super::progress::{BarKind, watched};
use super::{CommandEnd, complain, interrupted, strictly, tell};
use crate::Error;
use crate::plot::accuracy;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use stickslip_analysis::analysis::advice::{DIGITS_OF_DOUBLE, remedy, shortfall};
use stickslip_analysis::analysis::bands::{Compared, columns, compared_output};
use stickslip_analysis::analysis::certificate::{Certificate, Verdict};
use stickslip_analysis::analysis::stability::growth::{Onset, onsets};
use stickslip_analysis::analysis::{
    Certified, Certify, CertifyReport, Deadline, SavedRun, Stage, Warning, Written, least_digits,
};
use stickslip_analysis::earlier::{spare_certificate, spare_run};
use stickslip_case::{Case, CaseSource, Origin, builtin};
use stickslip_files::{FileKind, Overwrite, ResultError, ResultFile, Status, check_target, write_certified};
use stickslip_oracle as oracle;
use stickslip_system::model::margin::resistance;
use stickslip_system::quote::in_shell;
use stickslip_system::record::{Channels, MemoryRecorder, State};
use stickslip_system::watch::Watch;

const ROWS_AT_A_TIME: usize = 65_536;

/// Limits of the exact solution if it was not requested: digits, and the time after which the ladder decides.
const UNASKED: (u32, Duration) = (18, Duration::from_secs(600));

/// Whether the exact solution decides without `--oracle`. For a run that slows down by itself the ladder has its own
/// verdict, down to the effect of rounding.
fn oracle_decides(case: &Case) -> bool {
    !case.stops()
}

pub(super) fn certify(options: &CertifyOptions, common: &Common) -> Result<CommandEnd, Error> {
    let clock = Instant::now();
    let path = Path::new(&options.case);
    if path.is_file() && super::cycle::is_cycle(path) {
        return super::cycle::certify(path, options, common);
    }
    let of_oracle = *oracle::DIGITS.end();
    let (most, remedy) = match options.oracle {
        true => (
            of_oracle,
            "the exact solver computes with no more, and the growth of perturbations takes some of them".to_owned(),
        ),
        false => (
            DIGITS_OF_DOUBLE,
            format!("a double holds no more; for a table with up to {of_oracle} digits add --oracle, the exact solver"),
        ),
    };
    if let Some(digits) = options.digits.filter(|digits| !(1..=most).contains(digits)) {
        return Err(Error::input(format!(
            "--digits {digits}: from 1 to {most} digits can be asked for; {remedy}"
        )));
    }
    let given = GivenCase::read(&options.case).map_err(without_case)?;
    let set = options.keys.over(&options.set);
    let changes = overrides(&options.budget.over(&set), None)?;
    let case = &Case::read(&given.source, &changes).map_err(|error| without_case(error.into()))?;
    if matches!(given.source.origin, Origin::Result(_)) && !set.is_empty() {
        return Err(Error::input(
            "--set changes a case, not a result file: certify the case instead, or run it with --set first",
        ));
    }
    let target = output_of(&given.source, options.output.as_deref(), ".certified.h5")?;
    let overwrite = Overwrite::by_force(options.force);
    check_target(&target, overwrite, &given.files)?;
    spare_run(&target, overwrite, FileKind::CertifiedRun, &case.resolved())?;
    let by_oracle = options.oracle || oracle_decides(case);
    spare_certificate(&target, overwrite, by_oracle, None)?;
    let changed = given.changed(&changes);
    if let (Some(_), Err(reason)) = (&options.figure, resistance(&case.system)) {
        return Err(Error::input(format!(
            "--figure draws how the first stick of sliding that slows down by itself depends on the tolerance, and this case has no \
             such sliding: {reason}; leave it out"
        )));
    }
    let drawing = figure_output(options.figure.as_deref(), options.force, &given, &changed)?;
    let stop = interrupt_flag()?;
    let interrupted = |when: &str, kept: &str| interrupted(common, &format!(" {when}; {kept}"));
    let (nothing, kept) = ("no certificate was written", target.display());
    let Some(result) = obtain((&given, &changed), case, &target, &stop)? else {
        return interrupted("during the run that was to be certified", nothing);
    };
    let deadline = Deadline::after(clock, case.solver.max_wall_time);
    let text = CaseSource {
        text: given.text.clone(),
        origin: given.source.origin.clone(),
    };
    let of_result = matches!(given.source.origin, Origin::Result(_));
    let written = Written::new(case, of_result.then_some(text), &given.source, &changes);
    let stopped = || stop.load(Ordering::Relaxed);
    let certified = match examine((case, &written), &result.record, options, common, deadline, &stop) {
        Ok(certified) => certified,
        Err(_) if stopped() => return interrupted("during the ladder of independent runs", nothing),
        Err(error) => return Err(error),
    };
    let exact_digits = certified.exact.as_ref().map(least_digits);
    let digits = exact_digits.or(certified.certificate.least_digits()).unwrap_or(0);
    spare_certificate(&target, overwrite, certified.certificate.by_oracle, Some(digits))?;
    let additions = certified.additions(case);
    write_certified(&result.path, &target, overwrite, &additions)?;
    drop(result.scratch);
    let certificate = &certified.certificate;
    if let Some(stage) = certified.interrupted {
        let (when, without) = match stage {
            Stage::Sensitivities => ("during the reruns for the sensitivities", "without these"),
            Stage::Oracle => ("while the exact solver computed", "without exact events"),
        };
        return interrupted(when, &format!("{kept} has the certificate, {without}"));
    }
    let given_up = || stopped() || deadline.is_over();
    let drawn = match drawing
        .as_ref()
        .map(|drawing| draw(case, drawing, &given_up))
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
    let mut report = CertifyReport::new(case, &certified, given.source.label(), target.display().to_string());
    report.changed.clone_from(&changed);
    report.figure = drawing
        .filter(|_| !late)
        .map(|(output, _)| output.path().display().to_string());
    report.onsets = &onsets;
    report.shows_exact = options.oracle;
    report.seconds = clock.elapsed().as_secs_f64();
    tell(common, &report)?;
    let by_ladder = certificate.without_oracle.as_ref();
    let by_ladder = by_ladder.map(|why| format!("the uncertainties are those of the ladder alone: {why}"));
    if !common.quiet {
        // The verdict reports an onset that noise determines.
        let is_said = |warning: &&Warning| matches!(warning, Warning::NoiseDetermined { .. });
        let others = certificate.warnings.iter().filter(|warning| !is_said(warning));
        for warning in others.map(Warning::to_string).chain(by_ladder.clone()) {
            complain(&format!("warning: {warning}"));
        }
    }
    if late {
        return Err(Error::computation(
            "there is no figure: the wall time was over before its runs were done; allow more (--max-wall-time)",
        ));
    }
    let exact = certified.exact.as_ref();
    let command = match of_result {
        true => of_case(&given),
        false => String::new(),
    };
    let missing = |digits| shortfall((case, &command), certificate, exact, digits, &given_up);
    match options.digits.and_then(missing) {
        _ if stopped() => interrupted(
            "while other settings were tried for the digits that are missing",
            &format!("{kept} has the certificate"),
        ),
        Some(text) => Err(Error::computation(text)),
        None if oracle_decides(case) && certificate.verdict != Verdict::Converged => {
            Err(Error::computation(not_certified(certificate)))
        }
        None => {
            let warnings = certificate.warnings.iter().map(Warning::to_string);
            let mut doubts: Vec<String> = warnings.chain(by_ladder.map(|why| why + ".")).collect();
            // The verdict has reported an onset that noise determines. It is not repeated as a warning.
            let said = certificate.verdict == Verdict::Converged;
            if !said && doubts.is_empty() {
                doubts.push(format!("the verdict on the events is {}.", certificate.verdict.name()));
            }
            strictly(options.strict, &doubts, !common.quiet && said, &target)
        }
    }
}

/// The command that certifies the case of a result file, to which settings are added.
fn of_case(given: &GivenCase) -> String {
    let all = builtin::all();
    let built_in = all.iter().find(|built_in| built_in.text == given.text);
    let mut command = format!("stickslip certify {}", built_in.map_or("CASE", |case| case.name));
    for change in given.changed(&[]) {
        command += &format!(" --set {}", in_shell(&change.replacen(" = ", "=", 1)));
    }
    command
}

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

fn draw(case: &Case, target: &FigureOutput, stop: &dyn Watch) -> Result<Option<Vec<Onset>>, Error> {
    let Some(onsets) = onsets(&case.system, &case.solver, case.output.end_time, stop) else {
        return Ok(None);
    };
    plot::draw(&accuracy::onset_figure(&case.title, &onsets), target)?;
    Ok(Some(onsets))
}

struct Obtained {
    path: PathBuf,
    record: MemoryRecorder,
    /// Set if the file was created here and is temporary.
    scratch: Option<Scratch>,
}

/// The given result file, or a run of the case next to the target; `None` if interrupted.
fn obtain(
    (given, changed): (&GivenCase, &[String]),
    case: &Case,
    target: &Path,
    stop: &Arc<AtomicBool>,
) -> Result<Option<Obtained>, Error> {
    if let Origin::Result(path) = &given.source.origin {
        let file = ResultFile::open(path)?;
        if *file.status() != Status::Complete {
            return Err(Error::input(format!(
                "{}: the run is {}, and only a complete one can be certified; repeat it with stickslip run {}",
                path.display(),
                file.status().name(),
                path.display()
            )));
        }
        return Ok(Some(Obtained {
            path: path.clone(),
            record: read_back(&file, case)?,
            scratch: None,
        }));
    }
    let stem = target.file_stem().unwrap_or_default().to_string_lossy();
    let path = target.with_file_name(format!(".{stem}.{}.uncertified.h5", std::process::id()));
    let scratch = Scratch(path.clone());
    let saved = SavedRun::new(case, &path).text(&given.text).inputs(&given.files);
    let saved = saved.changed(changed.to_vec()).watch(&**stop).start()?;
    if let Some(failure) = saved.run.failure {
        return Err(Error::computation(failure.to_string()));
    }
    if saved.run.report.interrupted {
        return Ok(None);
    }
    // The user did not name this file.
    let failed = |error: ResultError| Error::computation(error);
    saved.unsaved.map_or(Ok(()), Err).map_err(failed)?;
    let record = ResultFile::open(&path).and_then(|file| read_back(&file, case));
    Ok(Some(Obtained {
        record: record.map_err(failed)?,
        path,
        scratch: Some(scratch),
    }))
}

fn read_back(file: &ResultFile, case: &Case) -> Result<MemoryRecorder, ResultError> {
    let mut compared = Compared::new(&compared_output(&case.output));
    let further: Vec<String> = columns(case)
        .skip(State::COUNT + Channels::COUNT)
        .map(|(name, _)| name)
        .collect();
    let mut record = MemoryRecorder::default();
    let names = ["before", "after"].map(|side| further.iter().map(move |name| format!("{name}_{side}")));
    let at_events = names.into_iter().flatten().map(|name| file.event_column(&name));
    let at_events = at_events.collect::<Result<Vec<Vec<f64>>, _>>()?;
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
        let picked = samples.iter().enumerate().filter(|(_, row)| compared.takes(row.time));
        for (index, sample) in picked {
            let of_row: Vec<f64> = beyond.iter().map(|column| column[index]).collect();
            record.push(sample, &of_row);
        }
    }
    Ok(record)
}

/// Computes the ladder, the exact solution if required, and the sensitivities. A later interruption keeps the ladder.
fn examine(
    (case, written): (&Case, &Written),
    record: &MemoryRecorder,
    options: &CertifyOptions,
    common: &Common,
    deadline: Deadline,
    stop: &Arc<AtomicBool>,
) -> Result<Certified, Error> {
    let wanted = options.oracle || oracle_decides(case);
    let exact = wanted.then(|| written.exact()).transpose()?;
    let digits = options.digits.unwrap_or(0);
    let certified = watched(common, BarKind::Share, stop, |bar| {
        let certify = Certify::new(case).sensitivities(written).until(deadline).watch(bar);
        match &exact {
            Some(exact) if oracle_decides(case) => certify.oracle_within(exact, digits.max(UNASKED.0), UNASKED.1),
            Some(exact) => certify.oracle(exact, digits),
            None => certify,
        }
        .start(record)
    });
    Ok(certified?)
}

fn without_case(mut error: Error) -> Error {
    if error.text.contains("/input") {
        error.text +=
            ". A result is certified by runs of its case, which this file no longer holds: certify the case itself";
    }
    error
}
