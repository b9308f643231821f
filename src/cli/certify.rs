//! `stickslip certify`: how many digits of a result are true.

use super::arguments::{CertifyOptions, Common};
use super::interrupt::interrupt_flag;
use super::plot::{self, FigureOutput, figure_output};
use super::progress::{BarKind, watched};
use super::{CommandEnd, complain, interrupted, strictly, tell};
use crate::Error;
use crate::plot::accuracy;
use crate::report::CycleCertificateReport;
use std::path::Path;
use std::sync::atomic::Ordering;
use stickslip_analysis::analysis::certificate::Verdict;
use stickslip_analysis::analysis::stability::growth::{Onset, onsets};
use stickslip_analysis::analysis::{CertificateRequest, SavedCertificate, without_case};
use stickslip_analysis::cycle::CertifiedCycle;
use stickslip_analysis::{GivenCase, overrides};
use stickslip_case::{Case, Origin};
use stickslip_files::Overwrite;
use stickslip_system::model::margin::resistance;
use stickslip_system::watch::Watch;

pub(super) fn certify(options: &CertifyOptions, common: &Common) -> Result<CommandEnd, Error> {
    let path = Path::new(&options.case);
    if path.is_file() && CertifiedCycle::is_for(path) {
        return of_cycle(path, options, common);
    }
    let given = GivenCase::read(&options.case).map_err(without_case)?;
    let set = options.keys.over(&options.set);
    if matches!(given.source.origin, Origin::Result(_)) && !set.is_empty() {
        return Err(Error::input(
            "--set changes a case, not a result file: certify the case instead, or run it with --set first",
        ));
    }
    let changes = overrides(&options.budget.over(&set))?;
    let target = given.output(options.output.as_deref(), ".certified.h5")?;
    let request = CertificateRequest {
        digits: options.digits,
        oracle: options.oracle,
        overwrite: Overwrite::by_force(options.force),
    };
    // Before the file is reserved, so that an interruption leaves no partial file.
    let stop = interrupt_flag()?;
    let saving = SavedCertificate::prepare(&given, &changes, &target, request)?;
    let case = saving.case();
    if let (Some(_), Err(reason)) = (&options.figure, resistance(&case.system)) {
        return Err(Error::input(format!(
            "--figure draws how the first stick of sliding that slows down by itself depends on the tolerance, and this case has no \
             such sliding: {reason}; leave it out"
        )));
    }
    let drawing = figure_output(
        options.figure.as_deref(),
        options.force,
        &given,
        &given.changed(&changes),
    )?;
    let stopped = || stop.load(Ordering::Relaxed);
    let certified = match watched(common, BarKind::Share, &stop, |bar| saving.start(bar)) {
        Err(error) if error.is_interrupted() => return interrupted(common, &format!(" {error}")),
        certified => certified?,
    };
    if let Some(when) = certified.interrupted() {
        return interrupted(common, &format!(" {when}"));
    }
    let kept = format!("{} has the certificate", target.display());
    let given_up = || stopped() || certified.is_late();
    let drawn = match drawing
        .as_ref()
        .map(|drawing| draw(case, drawing, &given_up))
        .transpose()?
    {
        Some(None) if stopped() => {
            let when = "during the runs of the figure";
            return interrupted(common, &format!(" {when}; {kept}, and there is no figure"));
        }
        drawn => drawn,
    };
    let late = matches!(drawn, Some(None));
    let onsets = drawn.flatten().unwrap_or_default();
    let mut report = certified.report();
    report.figure = drawing
        .filter(|_| !late)
        .map(|(output, _)| output.path().display().to_string());
    report.onsets = &onsets;
    tell(common, &report)?;
    if !common.quiet {
        for warning in certified.warnings() {
            complain(&format!("warning: {warning}"));
        }
    }
    if late {
        return Err(Error::computation(
            "there is no figure: the wall time was over before its runs were done; allow more (--max-wall-time)",
        ));
    }
    match certified.shortfall(&stopped) {
        _ if stopped() => {
            let when = "while other settings were tried for the digits that are missing";
            interrupted(common, &format!(" {when}; {kept}"))
        }
        Some(text) => Err(Error::computation(text)),
        None => {
            // The verdict has reported an onset that noise determines. It is not repeated as a warning.
            let said = certified.certified.certificate.verdict == Verdict::Converged;
            strictly(options.strict, &certified.doubts(), !common.quiet && said, &target)
        }
    }
}

fn draw(case: &Case, target: &FigureOutput, stop: &dyn Watch) -> Result<Option<Vec<Onset>>, Error> {
    let Some(onsets) = onsets(&case.system, &case.solver, case.output.end_time, stop) else {
        return Ok(None);
    };
    plot::draw(&accuracy::onset_figure(&case.title, &onsets), target)?;
    Ok(Some(onsets))
}

fn of_cycle(path: &Path, options: &CertifyOptions, common: &Common) -> Result<CommandEnd, Error> {
    if !options.keys.over(&options.set).is_empty() {
        return Err(Error::input(
            "--set changes a case, not the file of a cycle: find the cycle of the changed case with stickslip cycle \
             --set, and certify that",
        ));
    }
    if options.figure.is_some() {
        return Err(Error::input(
            "--figure draws the first stick of sliding that slows down by itself, and a cycle has none; leave it out",
        ));
    }
    if options.budget.is_given() {
        return Err(Error::input(
            "--max-wall-time bounds runs, and the exact solver makes the certificate of a cycle; leave it out, or end the command by Ctrl-C",
        ));
    }
    let overwrite = Overwrite::by_force(options.force);
    let stop = interrupt_flag()?;
    match CertifiedCycle::make(path, options.output.as_deref(), overwrite, options.digits, &*stop) {
        Err(error) if error.is_interrupted() => interrupted(common, &format!(" {error}")),
        certified => tell(common, &CycleCertificateReport::new(&certified?)),
    }
}
