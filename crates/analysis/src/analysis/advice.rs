//! Remedies for a result with too few true digits. Each remedy has been tried by a run.

use super::bands::compared_output;
use super::certificate::{Certificate, Verdict, certify};
use super::exact::partners;
use super::ladder::{LEAST_WITNESSES, run, significant};
use super::warning::{KICK_OPTION, finer};
use stickslip_case::Case;
use stickslip_engine::simulation::{Method, SolverOptions};
use stickslip_oracle::OracleSolution;
use stickslip_system::watch::Watch;

/// Decimal digits of a double.
pub const DIGITS_OF_DOUBLE: u32 = 16;

/// Remedy for a result that has not converged.
pub fn remedy(certificate: &Certificate) -> String {
    match certificate.verdict {
        Verdict::Converged => String::new(),
        Verdict::NoiseDetermined => format!(
            "from the loss of stability to the first stick a deviation grows by e^{:.0} (G = {:.1} in all), so that the \
             onset and all after it are amplified rounding, which no tolerance makes converge{but}. Set a perturbation well \
             above rounding, such as {KICK_OPTION}",
            certificate.growth_to_onset.unwrap_or(0.0),
            certificate.growth_exponent.unwrap_or(0.0),
            but = match certificate.by_oracle {
                true => "; series alone can follow the exact solution, which has no deviation",
                false => "",
            },
        ),
        Verdict::SequenceDiffers if certificate.by_oracle => {
            "the exact solution has another sequence of events than this result, or has one of them elsewhere. Use a finer \
             method or tolerance, or move a parameter off the border"
                .to_owned()
        }
        Verdict::SequenceDiffers if too_few_runs(certificate) => {
            "too many runs of the ladder failed to tell: where they were out of time, allow more (--max-wall-time)".to_owned()
        }
        Verdict::SequenceDiffers if certificate.others_agree => format!(
            "independent methods agree with each other but not with this result: its method or tolerance is too coarse. \
             {}",
            finer(&certificate.solver)
        ),
        // The ladder's runs already have each method's finest tolerance.
        Verdict::SequenceDiffers => {
            "independent methods, each as fine as it gets, find different sequences of events: an event is marginal, a \
             take-off that grazes or a kick near the noise of a method. Use a larger kick, or move a parameter off the \
             border; no tolerance decides it"
                .to_owned()
        }
    }
}

fn too_few_runs(certificate: &Certificate) -> bool {
    let own = [Method::Arkode.name(), certificate.solver.method.name()];
    let finished = certificate.ladder.iter().filter(|rung| rung.failure.is_none());
    let others = finished.map(|rung| rung.method).filter(|method| !own.contains(method));
    let mut methods: Vec<&str> = others.collect();
    methods.dedup();
    methods.len() < LEAST_WITNESSES
}

/// Reports missing digits and a setting that provides them; `None` if none is missing. Candidate settings are tried by
/// runs and compared with `solution` or certified. Beyond the digits of a double, only the oracle helps. `command` is
/// the command that takes the settings, if that is another one than the present; it may be empty.
pub fn shortfall(
    (case, command): (&Case, &str),
    certificate: &Certificate,
    solution: Option<&OracleSolution>,
    digits: u32,
    stop: &dyn Watch,
) -> Option<String> {
    if let Some(contradiction) = &certificate.contradiction {
        return Some(format!("{digits} digits were asked for, but {contradiction}"));
    }
    if let Some(solution) = solution.filter(|solution| solution.digits >= digits && digits > DIGITS_OF_DOUBLE) {
        log::info!("the exact solution has {} digits", solution.digits);
        return None;
    }
    let least = certificate.least_digits()?;
    if certificate.verdict == Verdict::Converged && least >= digits {
        return None;
    }
    let most = certificate.most_digits().unwrap_or(DIGITS_OF_DOUBLE);
    let asked = match certificate.verdict {
        Verdict::Converged if digits > most && solution.is_none() => {
            return Some(format!(
                "{digits} digits were asked for, but rounding to double precision leaves {most} of the event that it moves \
                 most; this result has {least}. Ask for fewer, or use --oracle for a table with more"
            ));
        }
        Verdict::Converged => format!("{digits} digits were asked for, and the result has {least}"),
        verdict => format!("{digits} digits were asked for, but the result is {}", verdict.name()),
    };
    if certificate.verdict == Verdict::NoiseDetermined && solution.is_none() {
        return Some(format!("{asked}: {}", remedy(certificate)));
    }
    if case.solver.method == Method::Series && certificate.verdict == Verdict::Converged && solution.is_none() {
        // The witnesses are less accurate than `series`: they bound its errors loosely and give no better result.
        return Some(format!(
            "{asked}, by methods that are less accurate than series itself: --oracle tells how many digits are true"
        ));
    }
    let mut tried: Vec<(String, u32)> = Vec::new();
    for solver in candidates(&case.solver) {
        let setting = setting(command, &solver, &case.solver);
        let mut candidate = case.clone();
        candidate.solver = solver;
        let reached = digits_of(&candidate, solution, stop);
        if stop.stopped() {
            return Some(format!("{asked}; other settings were not tried to the end"));
        }
        log::debug!("{setting}: {reached} digits");
        if reached >= digits {
            return Some(format!("{asked}: {setting} has {reached}"));
        }
        tried.push((setting, reached));
    }
    let others = match tried.iter().max_by_key(|(_, reached)| *reached) {
        Some((setting, reached)) if *reached > least => {
            format!("no setting that was tried has as many; the most is {reached}, with {setting}")
        }
        _ => {
            let names: Vec<&str> = tried.iter().map(|(setting, _)| setting.as_str()).collect();
            format!("{} have no more", names.join(", "))
        }
    };
    let remedy = match remedy(certificate) {
        none if none.is_empty() => none,
        remedy => format!(". {}", capitalised(&remedy)),
    };
    Some(format!("{asked}, and {others}{remedy}"))
}

/// Text with a capital first letter.
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(char::to_uppercase).into_iter().flatten();
    first.chain(letters).collect()
}

/// Settings that may have more digits, the cheapest first.
fn candidates(own: &SolverOptions) -> Vec<SolverOptions> {
    let with = |method: Method, rtol: f64| SolverOptions {
        method,
        rtol,
        fixed_step: None,
        ..own.clone()
    };
    // A tolerance does not make a method accurate that locates no events.
    let method = match own.method.locates_events() {
        true => own.method,
        false => Method::default(),
    };
    let mut candidates = vec![
        with(Method::Series, own.rtol.min(1e-9)),
        with(method, 1e-12),
        with(method, 1e-13),
        with(Method::Arkode, 1e-12),
        with(Method::Arkode, 1e-13),
    ];
    let mut seen = vec![own.clone()];
    candidates.retain(|candidate| {
        let new = !seen.contains(candidate);
        seen.push(candidate.clone());
        new
    });
    candidates
}

fn setting(command: &str, candidate: &SolverOptions, own: &SolverOptions) -> String {
    let mut keys = Vec::from_iter(Some(command.to_owned()).filter(|command| !command.is_empty()));
    if candidate.method != own.method {
        keys.push(format!("--set 'solver.method=\"{}\"'", candidate.method.name()));
    }
    if candidate.rtol != own.rtol {
        keys.push(format!("--set solver.rtol={:e}", candidate.rtol));
    }
    if own.fixed_step.is_some() {
        keys.push(format!("and without {}", own.method.step_key()));
    }
    keys.join(" ")
}

fn digits_of(case: &Case, solution: Option<&OracleSolution>, stop: &dyn Watch) -> u32 {
    let finished = run(case, &case.solver, &compared_output(&case.output), stop);
    if finished.rung.failure.is_some() || stop.stopped() {
        return 0;
    }
    let events = &finished.recorder.events;
    let Some(solution) = solution else {
        return match certify(case, &finished.recorder, stop) {
            Ok(own) if own.verdict == Verdict::Converged => own.least_digits().unwrap_or(0),
            _ => 0,
        };
    };
    let (partners, missing) = partners(case, events, solution);
    if missing > 0 {
        return 0;
    }
    let pairs = events.iter().zip(partners);
    let pairs = pairs.filter(|(event, _)| event.kind.in_event_sequence());
    let digits = pairs.map(|(event, partner)| Some(significant(event.time, partner?.uncertainty)));
    digits.map(Option::unwrap_or_default).min().unwrap_or(0)
}
