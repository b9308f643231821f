//! `stickslip continue`: branches of cycles and of steady sliding.

use super::arguments::{Common, ContinueOptions};
use super::input::{interrupt_flag, overrides, overwrite};
use super::progress::{Bar, BarKind};
use super::sweep::resumable;
use super::{CommandEnd, CommandError, interrupted, strictly, tell};
use crate::report::BranchesReport;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Instant;
use stickslip_analysis::continuation::{CONTINUATIONS, Continuation, ContinuationStudy};
use stickslip_analysis::study::StudySource;
use stickslip_analysis::sweep::journal_path;

pub(super) fn continuation(options: &ContinueOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let source = StudySource::find(&options.study, CONTINUATIONS)?;
    let study = ContinuationStudy::parse(source, &overrides(&options.set, None)?)?;
    let path = options.output.clone();
    let path = path.unwrap_or_else(|| PathBuf::from(format!("{}.h5", study.head.source.name)));
    let stop = interrupt_flag()?;
    let bar = Bar::new(common, BarKind::Branches, &stop);
    let clock = Instant::now();
    let result = Continuation::new(&study, &path)
        .overwrite(overwrite(options.force))
        .resume(options.resume)
        .watch(&bar)
        .start();
    bar.finish();
    let wall_time = clock.elapsed().as_secs_f64();
    let report = result.map_err(|error| resumable(error, &path))?;
    let explored = &report.explored;
    tell(common, &BranchesReport::new(&study, &report, wall_time))?;
    if explored.interrupted {
        let how = format!(
            "; {} points are saved in {}, and --resume goes on from there",
            explored.points(),
            journal_path(&path).display()
        );
        if !stop.load(Ordering::Relaxed) {
            return Err(CommandError::computation(format!(
                "the time of solver.max_wall_time is over{how}; more time is --set solver.max_wall_time=T"
            )));
        }
        return interrupted(common, &how);
    }
    strictly(
        options.strict,
        &explored.remarks,
        !common.quiet && !common.json,
        &report.file,
    )
}
