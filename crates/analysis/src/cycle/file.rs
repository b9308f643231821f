//! Files of cycles: the run over one period, and its copy with a certificate.

use super::certify::{CycleCertificate, certify};
use super::family::Family;
use super::find::{CycleSearch, find, refine};
use super::orbit::Orbit;
use super::saved::from_file;
use crate::analysis::{Deadline, SavedRun};
use crate::continuation::{Special, Stored};
use crate::earlier::spare_run;
use crate::error::{Error, ErrorKind};
use crate::given::{GivenCase, overrides};
use std::path::{Path, PathBuf};
use std::time::Instant;
use stickslip_case::{Case, CaseSource, Motion, Override, WrittenCase};
use stickslip_files::{
    FileKind, Overwrite, Reservation, ResultFile, check_sound, check_target, is_hdf5, schema::group, write_certified,
};
use stickslip_oracle as oracle;
use stickslip_system::watch::Watch;

#[derive(Debug)]
enum CycleTask {
    Search(CycleSearch),
    /// Point of a branch: drive periods per cycle, time (s), state and period (s).
    Refine(u32, (f64, Vec<f64>, f64)),
}

/// Search for a periodic motion, whose run over one period goes into a file. [`SavedCycle::start`] computes it.
#[must_use = "nothing is computed before `start`"]
#[derive(Debug)]
pub struct SavedCycle {
    given: GivenCase,
    settings: Vec<String>,
    task: CycleTask,
    suffix: String,
}

/// A periodic motion in its file.
#[derive(Debug)]
pub struct CycleFile {
    /// Result file of one period.
    pub file: PathBuf,
    /// Origin of the case.
    pub source: String,
    /// Title of the case.
    pub title: String,
    /// Overrides of the case, in words.
    pub changed: Vec<String>,
    /// Whether the case rotates or translates.
    pub motion: Motion,
    /// The motion with the times of its file.
    pub orbit: Orbit,
}

impl SavedCycle {
    /// Search in a case with `settings` (KEY=VALUE).
    pub fn search(given: GivenCase, settings: Vec<String>, search: CycleSearch) -> SavedCycle {
        SavedCycle {
            given,
            settings,
            task: CycleTask::Search(search),
            suffix: ".cycle.h5".to_owned(),
        }
    }

    /// The cycle at a point of a branch, if `name` is the file of a continuation and `place` has the numbers of branch and
    /// point. Otherwise a search in the case `name`.
    ///
    /// # Errors
    /// The case cannot be read; there is no such point; a point without its file.
    pub fn of(
        name: &str,
        place: Option<(usize, usize)>,
        settings: Vec<String>,
        search: CycleSearch,
    ) -> Result<SavedCycle, Error> {
        let path = Path::new(name);
        match place {
            _ if is_hdf5(path) && Stored::is_one(path) => of_branch(path, place, settings),
            None => Ok(SavedCycle::search(GivenCase::read(name)?, settings, search)),
            Some(_) if path.extension().is_some() && !path.exists() => {
                Err(Error::input(format!("{name}: there is no such file")))
            }
            Some(_) => Err(Error::input(format!(
                "{name}: is not the file of a continuation; --branch and --point choose a point of one, which stickslip continue writes"
            ))),
        }
    }

    /// Finds the motion, and writes the run over one period into the file `output`, by default named after the case.
    ///
    /// # Errors
    /// The case is wrong, or the file cannot be written; no cycle is found. After an interruption the message says when
    /// it came.
    pub fn start(self, output: Option<&Path>, overwrite: Overwrite, watch: &dyn Watch) -> Result<CycleFile, Error> {
        let SavedCycle {
            given,
            settings,
            task,
            suffix,
        } = self;
        let changes = overrides(&settings)?;
        let changed = given.changed(&changes);
        let written = WrittenCase::read(&given.source, &changes)?;
        let path = given.output(output, &suffix)?;
        check_target(&path, overwrite, &given.files)?;
        let allowed = written.case().solver.max_wall_time;
        let deadline = Deadline::after(Instant::now(), allowed);
        let stopped = || watch.stopped() || deadline.is_over();
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
            Err(error) if error.is_interrupted() && !watch.stopped() => {
                return Err(Error::computation(format!(
                    "{}: no cycle was found in the {} s of wall time that solver.max_wall_time allows; raise it, or give a period \
                     with --period",
                    given.source.label(),
                    allowed.unwrap_or_default()
                )));
            }
            Err(error) if error.is_interrupted() => {
                return Err(interrupted("before a cycle was found; nothing was written"));
            }
            other => other?,
        };
        let additions = orbit.additions(&family, &given.text, &settings);
        let saved = SavedRun::new(&case, &path)
            .text(&case.resolved())
            .changed(changed.clone())
            .overwrite(overwrite)
            .inputs(&given.files)
            .additions(&additions)
            .watch(watch)
            .start()?;
        if let Some(error) = &saved.unsaved {
            return Err(Error::computation(error));
        }
        if let Some(failure) = &saved.run.failure {
            return Err(Error::computation(failure));
        }
        if saved.run.report.interrupted {
            return Err(interrupted("during the run over one period of the cycle"));
        }
        Ok(CycleFile {
            file: saved.file,
            source: given.source.label(),
            title: family.case().title.clone(),
            changed,
            motion: family.case().motion(),
            orbit: orbit.in_file(&case),
        })
    }
}

fn interrupted(when: &str) -> Error {
    Error::new(ErrorKind::Interrupted, when)
}

fn of_branch(path: &Path, place: Option<(usize, usize)>, given: Vec<String>) -> Result<SavedCycle, Error> {
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
    // A key that is given twice as an option is an error.
    overrides(&given)?;
    // The point's value replaces that of the continuation's settings, and an option replaces both.
    let mut set: Vec<(String, String)> = Vec::new();
    for setting in settings.iter().cloned().chain(numbers).chain(given) {
        let key = Override::parse(&setting)?.key().to_owned();
        set.retain(|(known, _)| *known != key);
        set.push((key, setting));
    }
    Ok(SavedCycle {
        settings: set.into_iter().map(|(_, setting)| setting).collect(),
        given: CaseSource::result(path, text.clone()).into(),
        task: CycleTask::Refine(
            branch.multiple.unwrap_or(1),
            (point.time, point.state.clone(), point.period),
        ),
        suffix: format!("-{number}-{index}.cycle.h5"),
    })
}

/// Digits of a certificate, unless others are asked for.
const DIGITS: u32 = 25;

/// The certificate of a cycle in its file.
#[derive(Debug)]
pub struct CertifiedCycle {
    /// The certified file.
    pub file: PathBuf,
    /// Title of the case.
    pub title: String,
    /// The certificate.
    pub certificate: CycleCertificate,
}

impl CertifiedCycle {
    /// Whether the file is that of a cycle, which has a certificate of its own.
    pub fn is_for(path: &Path) -> bool {
        let file = ResultFile::open(path);
        file.is_ok_and(|file| matches!(file.added_group(group::CYCLE, 0), Ok(Some(_))))
    }

    /// Certifies the cycle of the file `path` by the exact solver, with at least this number of digits (25 by default),
    /// and writes a copy of the file with the certificate.
    ///
    /// # Errors
    /// The digits are more than there can be; a file cannot be read or written; the exact solver fails. After an
    /// interruption the message says when it came.
    pub fn make(
        path: &Path,
        output: Option<&Path>,
        overwrite: Overwrite,
        digits: Option<u32>,
        watch: &dyn Watch,
    ) -> Result<CertifiedCycle, Error> {
        let digits = digits.unwrap_or(DIGITS);
        let most = oracle::DIGITS.end() - 20;
        if !(1..=most).contains(&digits) {
            return Err(Error::input(format!(
                "--digits {digits}: from 1 to {most} digits can be asked for"
            )));
        }
        let given = GivenCase::from(CaseSource::result(path, String::new()));
        let target = given.output(output, ".certified.h5")?;
        let place = Reservation::take(&target, overwrite, &given.files)?;
        let file = ResultFile::open(path)?;
        spare_run(&target, overwrite, FileKind::CertifiedCycle, &file.resolved()?)?;
        let stopped = || watch.stopped();
        let found = from_file(&file, &stopped);
        drop(file);
        let when = |error: Error, when: &str| match error.is_interrupted() {
            true => interrupted(&format!("{when}; no certificate was written")),
            false => error,
        };
        let (family, orbit, origin) = found.map_err(|error| when(error, "before the cycle was found"))?;
        let exact = Case::exact(&origin.source, &origin.changes)?;
        let certificate = certify(&family, &orbit, &exact, digits, origin.periods_before, watch);
        let certificate = certificate.map_err(|error| match error.is_interrupted() {
            true => when(error, "while the exact solver computed"),
            false => Error::computation(error),
        })?;
        write_certified(path, &place, &certificate.additions())?;
        Ok(CertifiedCycle {
            file: target,
            title: family.case().title.clone(),
            certificate,
        })
    }
}
