//! `stickslip continue`: branches of cycles and of steady sliding.

use super::arguments::{Common, ContinueOptions};
use super::cycle::cycle_error;
use super::input::{interrupt_flag, overrides, overwrite};
use super::progress::{Bar, BarKind};
use super::sweep::resumable;
use super::{CommandEnd, CommandError, interrupted, strictly, tell, terminal};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;
use stickslip_analysis::continuation::{
    Branch, BranchPoint, CONTINUATIONS, Continuation, ContinuationError, ContinuationReport, ContinuationStudy,
    ExploreError,
};
use stickslip_analysis::study::StudySource;
use stickslip_analysis::sweep::journal_path;

pub(super) fn continuation(options: &ContinueOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let source = StudySource::find(&options.study, CONTINUATIONS)?;
    let study = ContinuationStudy::parse(source, &overrides(&options.set, None)?)?;
    let path = options.output.clone();
    let path = path.unwrap_or_else(|| PathBuf::from(format!("{}.h5", study.source.name)));
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
    let report = result.map_err(|error| command_error(&error, &path))?;
    let explored = &report.explored;
    let special = |(branch, index, point): (usize, usize, &BranchPoint)| {
        document! {
            branch: branch,
            point: index,
            kind: point.special.map_or("", stickslip_analysis::continuation::Special::name),
            value: point.value;
            optional:
            period: Some(point.period).filter(|period| !period.is_nan()),
        }
    };
    let branch = |branch: &Branch| {
        document! {
            what: if branch.steady { "steady" } else { "cycle" },
            points: branch.points.len(),
            end: branch.end.name();
            optional:
            parent: branch.parent.map(|parent| parent.0),
        }
    };
    let document = || {
        document! {
            status: if explored.interrupted { "interrupted" } else { "complete" },
            file: report.file.display().to_string(),
            study: study.source.label(),
            title: &study.title,
            number: &study.axes[0].name,
            points: explored.points(),
            branches: explored.branches.iter().map(branch).collect::<Vec<_>>(),
            special_points: special_points(&explored.branches).map(special).collect::<Vec<_>>(),
            curves: explored.curves.iter().map(|curve| document! {
                kind: curve.special.name(),
                points: curve.points.len(),
            }).collect::<Vec<_>>(),
            remarks: &explored.remarks,
            // s.
            wall_time: wall_time,
        }
    };
    tell(common, document, || text_report(&study, &report, wall_time))?;
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

fn special_points(branches: &[Branch]) -> impl Iterator<Item = (usize, usize, &BranchPoint)> {
    let all = branches.iter().enumerate();
    let all = all.flat_map(|(index, branch)| {
        branch
            .points
            .iter()
            .enumerate()
            .map(move |(k, point)| (index, k, point))
    });
    all.filter(|one| one.2.special.is_some())
}

fn command_error(error: &ContinuationError, path: &Path) -> CommandError {
    match error {
        ContinuationError::Case(error) => CommandError::input(error),
        ContinuationError::Cycle(error)
        | ContinuationError::Explore(ExploreError::NoStart(error) | ExploreError::Case(error)) => cycle_error(error),
        ContinuationError::Explore(ExploreError::NotSteady) => CommandError::input(error),
        ContinuationError::Explore(ExploreError::Journal(_)) | ContinuationError::Journal(_) => {
            CommandError::input(error)
        }
        ContinuationError::File(inner) if inner.is_of_the_system() => CommandError::computation(resumable(error, path)),
        ContinuationError::File(_) => CommandError::input(error),
    }
}

fn text_report(study: &ContinuationStudy, report: &ContinuationReport, wall_time: f64) -> String {
    let explored = &report.explored;
    let mut text = format!(
        "{}\n{} points of {} in {wall_time:.1} s\n\n",
        study.title,
        explored.points(),
        match explored.branches.len() {
            1 => "1 branch".to_owned(),
            many => format!("{many} branches"),
        }
    );
    let rows = explored.branches.iter().enumerate().map(|(index, branch)| {
        let values = branch.points.iter().map(|point| point.value);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let what = match (branch.steady, branch.multiple) {
            (true, _) => "steady sliding".to_owned(),
            (false, Some(multiple @ 2..)) => format!("cycles of {multiple} periods"),
            (false, _) => "cycles".to_owned(),
        };
        vec![
            index.to_string(),
            what,
            branch.parent.map_or_else(String::new, |parent| parent.0.to_string()),
            branch.points.len().to_string(),
            format!("{low:.9}"),
            format!("{high:.9}"),
            branch.end.words().to_owned(),
        ]
    });
    let header = ["branch", "of", "from branch", "points", "from", "to", "ends"];
    text += &terminal::lines(&header, rows, [0, 2, 3, 4, 5]);
    let rows = special_points(&explored.branches).map(|(branch, index, point)| {
        let period = match point.period.is_nan() {
            true => String::new(),
            false => format!("{:.12}", point.period),
        };
        let words = point
            .special
            .map_or("", stickslip_analysis::continuation::Special::words);
        let place = [branch.to_string(), index.to_string()];
        place
            .into_iter()
            .chain([format!("{:.13}", point.value), period, words.to_owned()])
            .collect()
    });
    let rows: Vec<Vec<String>> = rows.collect();
    if !rows.is_empty() {
        let header = [
            "branch",
            "point",
            study.axes[0].keys[0].as_str(),
            "period, s",
            "special point",
        ];
        text += &format!("\n{}", terminal::lines(&header, rows, 0..4));
    }
    if !explored.curves.is_empty() {
        let rows = explored.curves.iter().map(|curve| {
            let range = |k: usize| {
                let values = curve.points.iter().map(|point| point.values[k]);
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
            };
            let ends = [range(0), range(1)];
            let mut row = vec![curve.special.name().to_owned(), curve.points.len().to_string()];
            row.extend(
                ends.iter()
                    .flat_map(|&(low, high)| [format!("{low:.9}"), format!("{high:.9}")]),
            );
            row
        });
        let names = [&study.axes[0].keys[0], &study.axes[1].keys[0]];
        let header = ["curve of", "points", names[0], "to", names[1], "to"];
        text += &format!("\n{}", terminal::lines(&header, rows, 1..6));
    }
    for remark in &explored.remarks {
        text += &format!("\nwarning: {remark}\n");
    }
    format!("{text}\n{}\n", report.file.display())
}
