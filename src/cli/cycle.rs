//! `stickslip cycle`: finds a periodic motion; `stickslip certify` for its file.

use super::arguments::{CertifyOptions, Common, CycleOptions, SearchFrom};
use super::input::{GivenCase, interrupt_flag, output_of, overrides};
use super::{CommandEnd, interrupted, tell};
use crate::Error;
use crate::report::{CycleCertificateReport, CycleReport};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;
use stickslip_analysis::analysis::{Deadline, SavedRun};
use stickslip_analysis::continuation::{Special, Stored};
use stickslip_analysis::cycle::{CycleSearch, Family, From, certify as by_oracle, find, from_file, refine};
use stickslip_analysis::earlier::spare_run;
use stickslip_case::{Case, CaseSource, Override, WrittenCase};
use stickslip_files::{
    FileKind, Overwrite, ResultFile, check_sound, check_target, is_hdf5, schema::group, write_certified,
};
use stickslip_oracle as oracle;

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
    fn of(options: &CycleOptions) -> Result<Wanted, Error> {
        let path = Path::new(&options.case);
        match (options.branch.zip(options.point), is_hdf5(path) && Stored::is_one(path)) {
            (place, true) => of_branch(path, place, options),
            (Some(_), false) if path.extension().is_some() && !path.exists() => {
                Err(Error::input(format!("{}: there is no such file", options.case)))
            }
            (Some(_), false) => Err(Error::input(format!(
                "{}: is not the file of a continuation; --branch and --point choose a point of one, which stickslip continue writes",
                options.case
            ))),
            (None, false) => Ok(Wanted {
                given: GivenCase::read(&options.case)?,
                set: options.keys.over(&options.set),
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

fn of_branch(path: &Path, place: Option<(usize, usize)>, options: &CycleOptions) -> Result<Wanted, Error> {
    check_sound(path)?;
    let file = Stored::read(path)?;
    let refused = |why: String| Err(Error::input(format!("{}: {why}", path.display())));
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
    let given = options.keys.over(&options.set);
    // A key that is given twice as an option is an error.
    overrides(&given, None)?;
    // The point's value replaces that of the continuation's settings, and an option replaces both.
    let mut set: Vec<(String, String)> = Vec::new();
    for setting in settings.iter().cloned().chain(numbers).chain(given) {
        let key = Override::parse(&setting)?.key().to_owned();
        set.retain(|(known, _)| *known != key);
        set.push((key, setting));
    }
    Ok(Wanted {
        set: set.into_iter().map(|(_, setting)| setting).collect(),
        given: GivenCase::of_result(path, text.clone(), Vec::new()),
        task: CycleTask::Refine(
            branch.multiple.unwrap_or(1),
            (point.time, point.state.clone(), point.period),
        ),
        suffix: format!("-{number}-{index}.cycle.h5"),
    })
}

pub(super) fn cycle(options: &CycleOptions, common: &Common) -> Result<CommandEnd, Error> {
    let Wanted {
        given,
        set,
        task,
        suffix,
    } = Wanted::of(options)?;
    let changes = overrides(&set, None)?;
    let changed = given.changed(&changes);
    let written = WrittenCase::read(&given.source, &changes)?;
    let path = output_of(&given.source, options.output.as_deref(), &suffix)?;
    check_target(&path, Overwrite::by_force(options.force), &given.files)?;
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
            return Err(Error::computation(format!(
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
        .changed(changed.clone())
        .overwrite(Overwrite::by_force(options.force))
        .inputs(&given.files)
        .additions(&additions)
        .watch(&*stop)
        .start()?;
    if let Some(error) = &saved.unsaved {
        return Err(Error::computation(error));
    }
    if let Some(failure) = &saved.run.failure {
        return Err(Error::computation(failure));
    }
    let report = CycleReport {
        changed: &changed,
        status: "complete",
        file: saved.file.display().to_string(),
        case: given.source.label(),
        title: &family.case().title,
        motion: family.case().motion(),
        orbit: orbit.in_file(&case),
    };
    tell(common, &report)
}

/// Digits of a certificate, unless others are asked for.
const DIGITS: u32 = 25;

/// Whether the file is that of a cycle.
pub(super) fn is_cycle(path: &Path) -> bool {
    let file = ResultFile::open(path);
    file.is_ok_and(|file| matches!(file.added_group(group::CYCLE, 0), Ok(Some(_))))
}

pub(super) fn certify(path: &Path, options: &CertifyOptions, common: &Common) -> Result<CommandEnd, Error> {
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
    let digits = options.digits.unwrap_or(DIGITS);
    let most = oracle::DIGITS.end() - 20;
    if !(1..=most).contains(&digits) {
        return Err(Error::input(format!(
            "--digits {digits}: from 1 to {most} digits can be asked for"
        )));
    }
    let files = [path.to_owned()];
    let source = CaseSource::result(path, String::new());
    let target = output_of(&source, options.output.as_deref(), ".certified.h5")?;
    let overwrite = Overwrite::by_force(options.force);
    check_target(&target, overwrite, &files)?;
    let stop = interrupt_flag()?;
    let stopped = || stop.load(Ordering::Relaxed);
    let file = ResultFile::open(path)?;
    spare_run(&target, overwrite, FileKind::CertifiedCycle, &file.resolved()?)?;
    let found = from_file(&file, &stopped);
    drop(file);
    let (family, orbit, origin) = match found {
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " before the cycle was found; no certificate was written");
        }
        found => found?,
    };
    let exact = Case::exact(&origin.source, &origin.changes)?;
    let certificate = match by_oracle(&family, &orbit, &exact, digits, origin.periods_before, &*stop) {
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " while the exact solver computed; no certificate was written");
        }
        other => other.map_err(Error::computation)?,
    };
    write_certified(path, &target, overwrite, &certificate.additions())?;
    let report = CycleCertificateReport {
        status: "complete",
        file: target.display().to_string(),
        title: &family.case().title,
        certificate: &certificate,
    };
    tell(common, &report)
}
