//! `stickslip cycle`: finds a periodic motion.

use super::arguments::{Common, CycleOptions, SearchFrom};
use super::input::{GivenCase, interrupt_flag, output_of, overrides, overwrite};
use super::{CommandEnd, CommandError, interrupted, tell};
use crate::report::CycleReport;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;
use stickslip_analysis::analysis::{Deadline, SavedRun};
use stickslip_analysis::continuation::{Special, Stored};
use stickslip_analysis::cycle::{CycleSearch, Family, From, find, refine};
use stickslip_case::{CaseSource, WrittenCase};
use stickslip_files::{check_sound, is_hdf5};

enum CycleTask {
    Search(CycleSearch),
    /// Point of a branch: drive periods per cycle, time (s), state and period (s).
    Refine(u32, (f64, Vec<f64>, f64)),
}

struct Wanted {
    given: GivenCase,
    set: Vec<String>,
    task: CycleTask,
    suffix: String,
}

impl Wanted {
    fn of(options: &CycleOptions) -> Result<Wanted, CommandError> {
        let path = Path::new(&options.case);
        match (options.branch.zip(options.point), is_hdf5(path) && Stored::is_one(path)) {
            (place, true) => of_branch(path, place, options),
            (Some(_), false) if path.extension().is_some() && !path.exists() => {
                Err(CommandError::input(format!("{}: there is no such file", options.case)))
            }
            (Some(_), false) => Err(CommandError::input(format!(
                "{}: is not the file of a continuation; --branch and --point choose a point of one, which stickslip continue writes",
                options.case
            ))),
            (None, false) => Ok(Wanted {
                given: GivenCase::read(&options.case)?,
                set: options.set.clone(),
                task: CycleTask::Search(CycleSearch {
                    from: match options.from {
                        SearchFrom::End => From::End,
                        SearchFrom::Initial => From::Initial,
                    },
                    periods: options.periods,
                    period: options.period,
                }),
                suffix: ".cycle.h5".to_owned(),
            }),
        }
    }
}

fn of_branch(path: &Path, place: Option<(usize, usize)>, options: &CycleOptions) -> Result<Wanted, CommandError> {
    check_sound(path)?;
    let file = Stored::read(path)?;
    let refused = |why: String| Err(CommandError::input(format!("{}: {why}", path.display())));
    let count = file.branches.len();
    let Some((number, index)) = place else {
        return refused(format!(
            "holds {count} branches; choose a point with --branch B and --point K, both counted from 0"
        ));
    };
    let Some(branch) = file.branches.get(number) else {
        return refused(format!("has no branch {number}; there are {count}, counted from 0"));
    };
    let Some(point) = branch.points.get(index) else {
        let count = branch.points.len();
        return refused(format!(
            "branch {number} has no point {index}; there are {count}, counted from 0"
        ));
    };
    let (text, settings) = &file.case;
    let numbers = file.number.1.iter().map(|key| format!("{key}={:?}", point.value));
    if point.special == Some(Special::Hopf) && !branch.steady {
        return refused(format!(
            "point {index} of branch {number} is the Hopf point, where the cycles have no size; take its neighbour"
        ));
    }
    if branch.steady {
        let key = numbers.collect::<Vec<_>>().join(" --set ");
        let command = file.modes_command.as_deref().unwrap_or("stickslip modes CASE");
        return refused(format!(
            "branch {number} is of steady sliding, which has no period; {command} --set {key} describes it"
        ));
    }
    let set = settings
        .iter()
        .cloned()
        .chain(numbers)
        .chain(options.set.iter().cloned());
    Ok(Wanted {
        set: set.collect(),
        given: GivenCase {
            source: CaseSource::result(path, text.clone()),
            text: text.clone(),
            files: vec![path.to_owned()],
        },
        task: CycleTask::Refine(
            branch.multiple.unwrap_or(1),
            (point.time, point.state.clone(), point.period),
        ),
        suffix: format!("-{number}-{index}.cycle.h5"),
    })
}

pub(super) fn cycle(options: &CycleOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let Wanted {
        given,
        set,
        task,
        suffix,
    } = Wanted::of(options)?;
    let written = WrittenCase::read(&given.source, &overrides(&set, None)?)?;
    let path = output_of(&given.source, options.output.as_deref(), &suffix)?;
    stickslip_files::check_target(&path, overwrite(options.force), &given.files)?;
    let stop = interrupt_flag()?;
    let allowed = written.case().solver.max_wall_time;
    let deadline = Deadline::after(Instant::now(), allowed);
    let stopped = || stop.load(Ordering::Relaxed) || deadline.is_over();
    let found = Family::new(written, &[]).and_then(|family| {
        let orbit = match &task {
            CycleTask::Search(search) => find(&family, &[], search, &stopped)?,
            CycleTask::Refine(multiple, (time, state, period)) => {
                refine(&family, &[], *multiple, (*time, state, *period), &stopped)?
            }
        };
        let case = orbit.case(&family)?;
        Ok((family, orbit, case))
    });
    let (family, orbit, case) = match found {
        Err(error) if error.is_interrupted() && !stop.load(Ordering::Relaxed) => {
            return Err(CommandError::computation(format!(
                "{}: no cycle was found in the {} s of wall time that solver.max_wall_time allows; raise it, or give a period \
                 with --period",
                given.source.label(),
                allowed.unwrap_or_default()
            )));
        }
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " before a cycle was found; nothing was written");
        }
        other => other?,
    };
    let additions = orbit.additions(&family, &given.text, &set);
    let saved = SavedRun::new(&case, &path)
        .text(&case.resolved())
        .overwrite(overwrite(options.force))
        .inputs(&given.files)
        .additions(&additions)
        .watch(&*stop)
        .start()?;
    if let Some(error) = &saved.unsaved {
        return Err(CommandError::computation(error));
    }
    if let Some(failure) = &saved.run.failure {
        return Err(CommandError::computation(failure));
    }
    let report = CycleReport {
        status: "complete",
        file: saved.file.display().to_string(),
        case: given.source.label(),
        title: &family.case().title,
        motion: family.case().motion(),
        orbit: orbit.in_file(&case),
    };
    tell(common, &report)?;
    Ok(CommandEnd::Done)
}
