//! Certificates, comparisons, modes and cycles, with their reports.

use crate::errors::Raised;
use crate::run::given;
use crate::waiting::interruptible;
use pyo3::prelude::*;
use std::path::PathBuf;
use stickslip::analysis::{CertificateRequest, Modes, SavedCertificate, without_case};
use stickslip::case::Case;
use stickslip::compare::Requirement;
use stickslip::comparing::{MappingOptions, open_reference, refuse_swapped};
use stickslip::cycle::{CertifiedCycle, CycleSearch, From, LONGEST, SavedCycle};
use stickslip::report::{CompareReport, CycleCertificateReport, CycleReport, ModesReport, Report};
use stickslip::results::Overwrite;
use stickslip::{Error, GivenCase, overrides};

/// The report of a computation, and its JSON document.
type Told = (String, String);

fn told(report: &impl Report) -> Result<Told, Error> {
    Ok((report.text(), report.document()?))
}

/// Certifies a result file, also that of a cycle, into `target`. Also returns warnings, and why the certificate fell short.
#[pyfunction]
pub fn certify(
    py: Python<'_>,
    path: String,
    target: PathBuf,
    digits: Option<u32>,
    oracle: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Told, Vec<String>, Option<String>)> {
    let certified = interruptible(py, progress, |watch| {
        if CertifiedCycle::is_for(path.as_ref()) {
            let overwrite = Overwrite::OwnResults;
            let certified = CertifiedCycle::make(path.as_ref(), Some(&target), overwrite, digits, &*watch)?;
            return Ok((told(&CycleCertificateReport::new(&certified))?, Vec::new(), None));
        }
        let given = GivenCase::read(&path).map_err(without_case)?;
        let request = CertificateRequest {
            digits,
            oracle,
            ..CertificateRequest::default()
        };
        let saving = SavedCertificate::prepare(&given, &[], &target, request)?;
        let certified = saving.start(&*watch)?;
        let warnings = certified
            .warnings()
            .iter()
            .map(|text| format!("warning: {text}"))
            .collect();
        let shortfall = certified.shortfall(&*watch);
        Ok::<_, Error>((told(&certified.report())?, warnings, shortfall))
    })?;
    Ok(certified.map_err(Raised::from)?)
}

/// Compares a candidate with a reference. Texts are as the options of the command take them.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the keywords of a function of Python")]
pub fn compare(
    py: Python<'_>,
    reference: PathBuf,
    candidate: PathBuf,
    map: Option<PathBuf>,
    columns: Vec<String>,
    events: Option<PathBuf>,
    time_offset: Option<String>,
    velocity_tolerance: Option<String>,
    hysteresis: Option<f64>,
    max_wall_time: Option<String>,
    require: Vec<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Told> {
    let input = |text| Raised("InputError", text);
    let requirements = require.iter().map(|text| Requirement::parse(text));
    let requirements = requirements.collect::<Result<Vec<_>, _>>().map_err(input)?;
    let compared = interruptible(py, progress, |watch| {
        refuse_swapped(&reference, std::slice::from_ref(&candidate))?;
        let reference = open_reference(&reference)?;
        let mapping = MappingOptions {
            map: map.as_deref(),
            columns: &columns,
            events: events.as_deref(),
            time_offset: time_offset.as_deref(),
            velocity_tolerance: velocity_tolerance.as_deref(),
            hysteresis,
            quick: false,
            max_wall_time: max_wall_time.as_deref(),
        };
        let comparison = reference.compare_watched(&candidate, &mapping.of(&reference)?, &*watch)?;
        told(&CompareReport::new(&[comparison], &requirements))
    })?;
    Ok(compared.map_err(Raised::from)?)
}

/// Natural frequencies, damping and loss of stability of a case.
#[pyfunction]
pub fn modes(py: Python<'_>, kind: &str, text: &str, settings: Vec<String>) -> PyResult<Told> {
    let found = interruptible(py, None, |_| {
        let given = given::<Error>(kind, text)?;
        let changes = overrides(&settings)?;
        let case = Case::read(&given.source, &changes)?;
        let modes = Modes::of_case(&case.system, &case.solver, case.output.end_time);
        told(&ModesReport::new(&given, &changes, &case, &modes))
    })?;
    Ok(found.map_err(Raised::from)?)
}

/// Finds a cycle of a case, or that at a `place` (branch, point) of the file of a continuation, into the file `path`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the keywords of a function of Python")]
pub fn cycle(
    py: Python<'_>,
    kind: &str,
    text: &str,
    settings: Vec<String>,
    from_initial: bool,
    period: Option<f64>,
    periods: Option<u32>,
    place: Option<(usize, usize)>,
    path: PathBuf,
    replace: bool,
) -> PyResult<Told> {
    if periods.is_some_and(|periods| !(1..=LONGEST).contains(&(periods as usize))) {
        let text = format!("periods: give a number from 1 to {LONGEST}");
        return Err(Raised("InputError", text).into());
    }
    let search = CycleSearch {
        from: if from_initial { From::Initial } else { From::End },
        periods,
        period,
    };
    let found = interruptible(py, None, |watch| {
        let saving = match (kind, place) {
            ("text" | "built-in", None) => SavedCycle::search(given::<Error>(kind, text)?, settings, search),
            _ => SavedCycle::of(text, place, settings, search)?,
        };
        let found = saving.start(Some(&path), Overwrite::by_force(replace), &*watch)?;
        told(&CycleReport::new(&found))
    })?;
    Ok(found.map_err(Raised::from)?)
}

/// Name and text of each built-in case.
#[pyfunction]
pub fn cases() -> Vec<(&'static str, &'static str)> {
    let all = stickslip::case::builtin::all();
    all.into_iter().map(|case| (case.name, case.text)).collect()
}
