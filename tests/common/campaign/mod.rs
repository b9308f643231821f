//! Random brakes, each certified without the oracle and then held against the oracle's events: the campaign.

pub mod brakes;
pub mod corners;
pub mod table;

use crate::common::cases::difference;
use brakes::{Drawn, Family, draw};
use rayon::prelude::*;
use stickslip::Run;
use stickslip::analysis::certificate::{Verdict, certify};
use stickslip::analysis::exact::{LONGEST, settle};
use stickslip::case::{Case, CaseSource};
use stickslip::oracle::OracleEvent;
use stickslip::record::{Event, EventKind, MemoryRecorder};
use stickslip::simulation::{Method, SolverOptions};

/// True digits of the oracle's event times, as in `certify --oracle`.
const DIGITS: u32 = 25;

/// A double near 1 may be this far from the decimal that it stands for, s, and one near t that many times t.
const HALF_UNIT: f64 = 1.2e-16;

/// A converged event against the oracle.
pub struct Held {
    pub kind: EventKind,
    /// Distance of the default run from the oracle, s.
    pub error: f64,
    /// As certified, s.
    pub uncertainty: f64,
    /// What the certificate says that rounding can do, s.
    pub rounding: f64,
    /// Distance of the run with `rtol = 1e-13` from the oracle, s; `None` if it has no such event.
    pub fine_error: Option<f64>,
    /// Distances of `arkode` from the oracle, by default and with `rtol = 1e-13`, s; infinite where it has no such event.
    pub by_arkode: [f64; 2],
}

impl Held {
    /// Whether the true error is larger than the uncertainty.
    pub fn is_short(&self, time: f64) -> bool {
        self.error > self.uncertainty + HALF_UNIT * time.abs().max(1.0)
    }
}

/// What became of a brake.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fate {
    Certified(&'static str),
    /// The run or the certificate failed.
    Failed,
    /// The oracle gave no solution.
    NoOracle,
}

pub struct Outcome {
    pub index: u64,
    pub family: Family,
    pub fate: Fate,
    pub held: Vec<Held>,
    pub short: Vec<bool>,
    /// What contradicts the certificate, in words.
    pub faults: Vec<String>,
    /// Why there is nothing to hold, in words.
    pub reason: Option<String>,
    /// The brake as options of the program.
    pub command: String,
}

/// Certifies brake `index` and holds the certificate against the oracle.
pub fn hold(index: u64) -> Outcome {
    hold_drawn(index, &draw(index))
}

/// The same for a brake that is drawn.
pub fn hold_drawn(index: u64, drawn: &Drawn) -> Outcome {
    let mut outcome = Outcome {
        index,
        family: drawn.family,
        fate: Fate::Failed,
        held: Vec::new(),
        short: Vec::new(),
        faults: Vec::new(),
        reason: None,
        command: drawn.command(),
    };
    if let Err((fate, reason)) = fill(drawn, &mut outcome) {
        outcome.fate = fate;
        outcome.reason = Some(reason);
    }
    outcome
}

fn events_of(case: &Case, solver: &SolverOptions) -> Result<MemoryRecorder, String> {
    let mut recorder = MemoryRecorder::default();
    Run::new(case)
        .solver(solver)
        .record(&mut recorder)
        .start()
        .map_err(|failure| failure.to_string())?;
    Ok(recorder)
}

fn fill(drawn: &Drawn, outcome: &mut Outcome) -> Result<(), (Fate, String)> {
    let failed = |text: String| (Fate::Failed, text);
    let source = CaseSource::built_in("paper-si").expect("a built-in case");
    let overrides = drawn.overrides();
    let case = Case::read(&source, &overrides).map_err(|error| failed(error.to_string()))?;
    let result = events_of(&case, &case.solver).map_err(failed)?;
    let certificate = certify(&case, &result, &|| false).map_err(|error| failed(error.to_string()))?;
    outcome.fate = Fate::Certified(certificate.verdict.name());
    let exact = Case::exact(&source, &overrides).map_err(|error| failed(error.to_string()))?;
    let digits = (DIGITS, LONGEST);
    let solution = settle(&mut certificate.clone(), &case, &exact, &result.events, digits, &());
    let exact = solution
        .map_err(|error| (Fate::NoOracle, error.to_string()))?
        .report
        .events;
    let fine = events_of(
        &case,
        &SolverOptions {
            rtol: 1e-13,
            ..case.solver.clone()
        },
    )
    .map_err(failed)?;
    let fine = errors(&fine.events, &exact);
    let own = errors(&result.events, &exact);
    let by_arkode = [case.solver.rtol, 1e-13].map(|rtol| {
        let solver = SolverOptions {
            method: Method::Arkode,
            rtol,
            ..case.solver.clone()
        };
        events_of(&case, &solver).map(|run| distances(&result.events, &run.events, &exact))
    });
    let [by_arkode, fine_by_arkode] = by_arkode;
    let by_arkode = [by_arkode.map_err(failed)?, fine_by_arkode.map_err(failed)?];
    for (position, (event, certified)) in result.events.iter().zip(&certificate.events).enumerate() {
        if certified.verdict != Verdict::Converged {
            continue;
        }
        let what = format!("{} at {:?}", event.kind.name(), event.time);
        if !certified.uncertainty.is_finite() {
            outcome.faults.push(format!("{what}: converged, to nobody knows what"));
        }
        let Some(error) = own[position] else {
            outcome.faults.push(format!("{what}: the oracle has none"));
            continue;
        };
        let held = Held {
            kind: event.kind,
            error,
            uncertainty: certified.uncertainty,
            rounding: certified.rounding,
            fine_error: fine.get(position).copied().flatten(),
            by_arkode: by_arkode.each_ref().map(|errors| errors[position]),
        };
        let short = held.is_short(event.time);
        if short {
            let Held { uncertainty, .. } = held;
            outcome
                .faults
                .push(format!("{what}: off by {error:.1e} s, certified to {uncertainty:.1e}"));
        }
        outcome.short.push(short);
        outcome.held.push(held);
    }
    if certificate.verdict == Verdict::Converged {
        let word = |kinds: &mut dyn Iterator<Item = EventKind>| -> Vec<EventKind> {
            kinds.filter(|kind| kind.in_event_sequence()).collect()
        };
        let all = |kinds: &mut dyn Iterator<Item = EventKind>| {
            let mut names: Vec<&str> = kinds.map(EventKind::name).collect();
            names.sort_unstable();
            names
        };
        let own = || result.events.iter().map(|event| event.kind);
        let true_ones = || exact.iter().map(|event| event.kind);
        if word(&mut own()) != word(&mut true_ones()) || all(&mut own()) != all(&mut true_ones()) {
            outcome
                .faults
                .push("converged, but the sequence is not the oracle's".to_owned());
        }
    }
    Ok(())
}

/// Of each event of a result, how far another run has it from the oracle's, s: the events of each kind in order.
fn distances(result: &[Event], other: &[Event], exact: &[OracleEvent]) -> Vec<f64> {
    let errors = errors(other, exact);
    let of_kind = |position: usize| {
        let kind = result[position].kind;
        let number = result[..position].iter().filter(|event| event.kind == kind).count();
        let mut same = (0..other.len()).filter(|index| other[*index].kind == kind);
        same.nth(number).and_then(|index| errors[index])
    };
    (0..result.len())
        .map(|position| of_kind(position).unwrap_or(f64::INFINITY))
        .collect()
}

/// Of each event, in the order of its kind, the distance to the oracle's, s.
fn errors(events: &[Event], exact: &[OracleEvent]) -> Vec<Option<f64>> {
    let mut taken = vec![0usize; EventKind::ALL.len()];
    let place = |kind: EventKind| EventKind::ALL.iter().position(|other| *other == kind).expect("a kind");
    events
        .iter()
        .map(|event| {
            let number = &mut taken[place(event.kind)];
            let same = exact.iter().filter(|other| other.kind == event.kind).nth(*number);
            *number += 1;
            same.map(|same| difference(event.time, &same.time).abs())
        })
        .collect()
}

/// All brakes of the range, several at once; prints what contradicts a certificate as it comes.
pub fn run(range: std::ops::Range<u64>) -> Vec<Outcome> {
    let outcomes = range.into_par_iter().map(hold);
    outcomes.inspect(report).collect()
}

fn report(outcome: &Outcome) {
    let Outcome { index, family, .. } = outcome;
    if let Some(reason) = &outcome.reason {
        println!("brake {index} ({}): {:?}: {reason}", family.name(), outcome.fate);
        println!("    {}", outcome.command);
    }
    if let Some(first) = outcome.faults.first() {
        println!(
            "brake {index} ({}): {} short, the first: {first}",
            family.name(),
            outcome.faults.len()
        );
        println!("    {}", outcome.command);
    }
}
