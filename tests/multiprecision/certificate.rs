//! Certified uncertainties against true errors, by the oracle.

use crate::common::cases::{certified as with_oracle, difference, exact_events, median, recorded};
use crate::common::random_brakes::{how_many, random_brake};
use num_rational::BigRational;
use num_traits::Signed as _;
use stickslip::analysis::Certify;
use stickslip::analysis::advice::shortfall;
use stickslip::analysis::certificate::{Certificate, Verdict, certify};
use stickslip::analysis::exact::last_word;
use stickslip::case::{Case, CaseSource, Override};
use stickslip::record::{Event, EventKind};
use stickslip_system::quote::bound;

fn certified(source: &CaseSource, overrides: &[Override]) -> (Case, Vec<Event>, Certificate) {
    let case = Case::read(source, overrides).unwrap();
    let recorder = recorded(&case);
    let certificate = certify(&case, &recorder, &|| false).unwrap();
    (case, recorder.events, certificate)
}

/// Compares every certified event with the oracle, and returns the uncertainty over the true error of each event of
/// the sequence.
fn check(name: &str, source: &CaseSource, overrides: &[Override], digits: u32) -> Vec<f64> {
    let (case, events, certificate) = certified(source, overrides);
    let truth = exact_events(source, overrides, case.output.end_time, digits);
    let mut ratios = Vec::new();
    let expected: Vec<_> = truth.iter().filter(|e| e.kind.in_event_sequence()).collect();
    let word = || {
        events
            .iter()
            .zip(&certificate.events)
            .filter(|(e, _)| e.kind.in_event_sequence())
    };
    for (index, (event, certified)) in word().enumerate() {
        if certified.verdict != Verdict::Converged {
            break;
        }
        let exact = expected
            .get(index)
            .unwrap_or_else(|| panic!("{name}: no event {index}"));
        assert_eq!(exact.kind, event.kind, "{name}: event {index}");
        let error = difference(event.time, &exact.time).abs();
        assert!(
            error <= certified.uncertainty,
            "{name}: {} at {} is off by {error:e}, certified to {:e}",
            event.kind.name(),
            event.time,
            certified.uncertainty
        );
        ratios.push(certified.uncertainty / error.max(1e-17));
    }
    if certificate.verdict == Verdict::Converged {
        assert_eq!(word().count(), expected.len(), "{name}: number of events");
    }
    ratios
}

#[test]
#[ignore = "takes half a minute"]
fn multiprecision_certified_uncertainties_cover_the_errors_of_the_papers_brake() {
    for name in ["paper", "paper-si"] {
        let ratios = check(name, &CaseSource::built_in(name).unwrap(), &[], 33);
        let middle = median(&ratios);
        println!("{name}: {} events, median {middle:.1}", ratios.len());
        assert!(ratios.len() > 90);
        // The promise of the documentation: uncertainties are useful, not only safe.
        assert!(middle < 100.0, "{name}: {middle}");
    }
}

/// With a small rtol `arkode` and `erk` have the same error: the same pair, through the same growth. At 1e-12 their
/// difference is 4e-15 s in `release`, and their error is 3e-13 s.
#[test]
fn multiprecision_certified_uncertainties_cover_what_arkode_and_erk_share() {
    let source = CaseSource::built_in("release").unwrap();
    let rtol = Override::parse("solver.rtol=1e-12").unwrap();
    let ratios = check("release", &source, &[rtol], 33);
    let middle = median(&ratios);
    println!("{} events, median {middle:.1}", ratios.len());
    assert!(ratios.len() > 130 && middle < 100.0);
}

/// Where nothing damps the fast mode over thousands of periods the ladder is short, and the linearised run is one of
/// `series`. The uncertainties cover the errors nevertheless, for a result of SUNDIALS and for one of `series`.
#[test]
#[ignore = "takes half a minute"]
fn multiprecision_certified_uncertainties_cover_the_errors_without_damping() {
    let source = CaseSource::built_in("paper-si").unwrap();
    for method in ["arkode", "series"] {
        let overrides: Vec<Override> = [
            "torsion.damping=0",
            "initial.speed=14",
            "actuation.rise_time=0.05",
            "friction.decay=1.2",
            "perturbation=[{kind=\"kick\", time=0.4, relative_velocity=1e-3}]",
            "output.end_time=1.6",
            "output.window=[]",
            "output.around=none",
            &format!("solver.method={method}"),
        ]
        .iter()
        .map(|text| Override::parse(text).unwrap())
        .collect();
        let (_, _, certificate) = certified(&source, &overrides);
        assert!(certificate.left_out.is_some(), "{method}");
        let ratios = check(method, &source, &overrides, 33);
        println!("{method}: {} events, median {:.1}", ratios.len(), median(&ratios));
        assert!(ratios.len() > 100, "{method}");
    }
}

fn random_sets(indices: impl Iterator<Item = u64>) {
    let source = CaseSource::built_in("paper-si").unwrap();
    let mut ratios = Vec::new();
    for index in indices {
        let overrides = random_brake(index);
        let name = format!("set {index}");
        let (case, events, certificate) = certified(&source, &overrides);
        let word = events.iter().filter(|e| e.kind.in_event_sequence()).count();
        println!(
            "{name}: {} events, {}, growth {:?}",
            word,
            certificate.verdict.name(),
            certificate.growth_to_onset
        );
        let unstable = certificate.growth_exponent.is_some_and(|g| g > 40.0);
        if case.system.kicks.is_empty() && unstable {
            assert_eq!(certificate.verdict, Verdict::NoiseDetermined, "{name}");
            continue;
        }
        // 38 digits minus a growth of e^25 at most.
        ratios.extend(check(&name, &source, &overrides, 33));
    }
    let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
    let middle = median(&ratios);
    println!(
        "{} events: uncertainty over error {least:.1} at least, {middle:.1} at the median",
        ratios.len()
    );
    assert!(middle < 100.0);
}

#[test]
fn multiprecision_certified_uncertainties_cover_the_errors_of_other_brakes() {
    random_sets([1, 4].into_iter());
}

#[test]
#[ignore = "takes a minute or two"]
fn multiprecision_certified_uncertainties_cover_the_errors_of_twenty_brakes() {
    random_sets(0..how_many());
}

/// The ladder's statement about a short brake is true. Falsified statements are contradicted: a bound that is too
/// small, and events that do not exist.
#[test]
fn multiprecision_the_oracle_contradicts_what_is_wrong() {
    let overrides = [
        "initial.speed=3",
        "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
        "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
        "output={end_time=0.4, interval=0.01}",
    ]
    .map(|text| Override::parse(text).unwrap());
    let source = CaseSource::built_in("paper-si").unwrap();
    let case = Case::read(&source, &overrides).unwrap();
    let exact = Case::exact(&source, &overrides).unwrap();
    let result = recorded(&case);
    let certified = Certify::new(&case).oracle(&exact, 25).start(&result).unwrap();
    let (true_one, solution) = (certified.certificate, certified.exact.expect("asked for"));
    assert!(true_one.by_oracle && true_one.contradiction.is_none());
    assert_eq!(true_one.verdict, Verdict::Converged);
    let stop = || false;
    let short = |certificate: &Certificate, digits| shortfall((&case, ""), certificate, Some(&solution), digits, &stop);
    assert_eq!(short(&true_one, 9), None);
    // A table with more digits than a double holds is the oracle's.
    assert_eq!(short(&true_one, 24), None);

    let mut narrow = true_one.clone();
    let index = result
        .events
        .iter()
        .rposition(|event| event.kind.in_event_sequence())
        .unwrap();
    narrow.events[index].ladder_uncertainty = 1e-17;
    last_word(&mut narrow, &case, &result.events, &solution);
    let said = narrow.contradiction.clone().expect("a contradiction");
    assert!(said.contains("1 of"), "{said}");
    assert!(said.contains("1.000e-17 s was the bound"), "{said}");
    // For this event the oracle's distance counts, and is converged.
    assert_eq!(narrow.verdict, Verdict::Converged);
    assert_eq!(narrow.events[index].uncertainty, true_one.events[index].uncertainty);
    assert!(short(&narrow, 5).is_some_and(|text| text.contains(&said)));

    // The result lacks a stick and a slip: the other events keep their partners.
    let mut lacking = result.events.clone();
    let stick = lacking.iter().position(|event| event.kind == EventKind::Stick).unwrap();
    let mut other = true_one.clone();
    for _ in 0..2 {
        lacking.remove(stick);
        other.events.remove(stick);
    }
    last_word(&mut other, &case, &lacking, &solution);
    assert_eq!(other.verdict, Verdict::SequenceDiffers);
    assert!(other.events.iter().all(|event| event.verdict == Verdict::Converged));
    let said = other.contradiction.expect("a contradiction");
    assert!(said.contains("2 more"), "{said}");
}

/// Without a kick no event is converged from the first stick on; with a kick all events are.
#[test]
fn multiprecision_unperturbed_is_called_noise() {
    let source = CaseSource::built_in("unperturbed").unwrap();
    let (_, _, certificate) = certified(&source, &[]);
    assert_eq!(certificate.verdict, Verdict::NoiseDetermined);
    assert_eq!(certificate.least_digits(), Some(0));
    // `series` alone is free of rounding, and finds the exact stop of the 120-digit run. This changes no verdict.
    for rung in &certificate.ladder {
        assert_eq!(rung.smooth_stop, rung.method == "series", "{rung:?}");
        if rung.smooth_stop {
            assert_eq!(rung.events, 1);
            assert!((rung.onset.unwrap() - 6.987986682084469).abs() < 1e-12);
        }
    }
    // Nor does it if the result is its own, because it is no witness of itself.
    let series = Override::parse("solver.method=series").unwrap();
    let (_, events, own) = certified(&source, &[series]);
    assert_eq!(events.iter().filter(|e| e.kind.in_event_sequence()).count(), 1);
    assert_eq!(own.verdict, Verdict::NoiseDetermined);
    // The loss of stability itself is not noise.
    let lost = certificate
        .events
        .iter()
        .find(|e| e.kind == "destabilised")
        .expect("unstable");
    assert!(lost.verdict == Verdict::Converged && lost.uncertainty < 1e-9);
    let kick = Override::parse("perturbation=[{time=\"instability\", relative_velocity=1e-4}]").unwrap();
    let (_, _, certificate) = certified(&source, &[kick]);
    assert_eq!(certificate.verdict, Verdict::Converged);
    assert!(certificate.least_digits() >= Some(9));
}

/// An uncertainty by the oracle is the distance to its event plus its own error, rounded up. As exact numbers it
/// covers both, where the nearest double would be below half of the time. So does a printed bound.
#[test]
fn multiprecision_uncertainties_by_the_oracle_are_rounded_up() {
    let (_, record, certified) = with_oracle(&CaseSource::built_in("hairer").unwrap(), &[], 30);
    let exact = certified.exact.expect("the oracle");
    let rational = |value: f64| BigRational::from_float(value).expect("a finite number");
    assert_eq!(record.events.len(), exact.report.events.len());
    let mut above = 0;
    for (k, (own, truth)) in record.events.iter().zip(&exact.report.events).enumerate() {
        let distance = (rational(own.time) - truth.time.to_rational().unwrap()).abs();
        let nearest = difference(own.time, &truth.time).abs();
        above += usize::from(rational(nearest) < distance);
        let uncertainty = certified.certificate.events[k].uncertainty;
        let found = rational(uncertainty);
        assert!(found >= distance + rational(exact.errors[k]), "event {k}");
        assert!(uncertainty <= (nearest + exact.errors[k]) * (1.0 + 1e-15));
        let printed: f64 = bound(uncertainty, 1).parse().unwrap();
        assert!(printed >= uncertainty, "{printed} for {uncertainty}");
        assert!(printed < 1.1 * uncertainty, "{printed} for {uncertainty}");
    }
    assert!(above > 0, "nothing would have been rounded down");
    for (value, text) in [
        (9.96e-12, "1.0e-11"),
        (1.5e-3, "1.5e-3"),
        (1.51e-3, "1.6e-3"),
        (0.0, "0.0e0"),
        (9.91, "1.0e1"),
    ] {
        assert_eq!(bound(value, 1), text);
    }
    let found = (bound(9.1e-17, 0), bound(f64::INFINITY, 1));
    assert_eq!(found, ("1e-16".to_owned(), "inf".to_owned()));
}
