//! Certified uncertainties against true errors, by the oracle.

use std::ops::ControlFlow;
use stickslip::analysis::certificate::{Certificate, Verdict, certify};
use stickslip::case::{Case, CaseSource, Override};
use stickslip::oracle::{self, Number, OracleOptions, nearest_double, rational};
use stickslip::simulation::{Event, MemoryRecorder, simulate};

/// Numbers in [0, 1) that are the same in every run (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A brake around that of the paper, from a lower speed so that the run is short. Every fifth has no kick.
fn overrides(index: u64) -> Vec<Override> {
    let mut random = Random(index);
    let speed = random.within(6.0, 15.0);
    let force = random.within(1500.0, 3000.0);
    let high = random.within(0.2, 0.4);
    let rise = random.within(0.01, 0.1);
    // Twice what the least friction takes to stop the rotor.
    let end = rise + 2.0 * 2.262 * speed / (high * 0.052388 * force);
    let kick = 10f64.powf(random.within(-6.0, -2.0));
    let kicks = match index % 5 {
        4 => "[]".to_owned(),
        _ => format!("[{{time=\"instability\", relative_velocity={kick:.6e}}}]"),
    };
    [
        format!("initial.speed={speed:.6}"),
        format!("actuation.force={force:.4}"),
        format!("actuation.rise_time={rise:.6}"),
        format!("friction.high_speed={high:.6}"),
        format!("friction.low_speed={:.6}", random.within(0.5, 0.6)),
        format!("friction.decay={:.6}", random.within(2.5, 6.0)),
        format!("torsion.damping={:.6}", random.within(18.0, 28.0)),
        format!("torsion.stiffness={:.3}", random.within(5e6, 1e7)),
        format!("torsion.surface_inertia={:.8}", random.within(0.008, 0.015)),
        format!("perturbation={kicks}"),
        format!("output.end_time={end:.4}"),
        "output.interval=0.01".to_owned(),
        "output.window=[]".to_owned(),
    ]
    .iter()
    .map(|text| Override::parse(text).unwrap())
    .collect()
}

fn certified(source: &CaseSource, overrides: &[Override]) -> (Case, Vec<Event>, Certificate) {
    let case = Case::parse(source, overrides).unwrap();
    let mut recorder = MemoryRecorder::default();
    simulate(&case.parameters, &case.solver, &case.output, &mut recorder, &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    let certificate = certify(&case, &recorder.events, &|| false).unwrap();
    (case, recorder.events, certificate)
}

/// Holds every certified event against the oracle and returns uncertainty over true error of each event of the mode word.
fn check(name: &str, source: &CaseSource, overrides: &[Override], digits: u32) -> Vec<f64> {
    let (case, events, certificate) = certified(source, overrides);
    let exact = Case::exact_parameters(source, overrides).unwrap();
    let options = OracleOptions {
        digits,
        end_time: rational(&format!("{}", case.output.end_time)).unwrap(),
        sample_times: Vec::new(),
        max_events: 10_000,
    };
    let truth = oracle::run(&exact, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    let mut ratios = Vec::new();
    let expected: Vec<_> = truth.events.iter().filter(|e| e.kind.in_mode_word()).collect();
    let word = || {
        events
            .iter()
            .zip(&certificate.events)
            .filter(|(e, _)| e.kind.in_mode_word())
    };
    for (index, (event, certified)) in word().enumerate() {
        if certified.verdict != Verdict::Converged {
            break;
        }
        let exact = expected
            .get(index)
            .unwrap_or_else(|| panic!("{name}: no event {index}"));
        assert_eq!(exact.kind, event.kind, "{name}: event {index}");
        let own = Number::from_f64(event.time, 64).to_rational().unwrap();
        let error = nearest_double(&(own - exact.time.to_rational().unwrap())).abs();
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

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
#[ignore = "takes half a minute"]
fn multiprecision_certified_uncertainties_cover_the_errors_of_the_papers_brake() {
    for name in ["paper", "paper-si"] {
        let ratios = check(name, &CaseSource::built_in(name).unwrap(), &[], 33);
        let middle = median(ratios.clone());
        println!("{name}: {} events, median {middle:.1}", ratios.len());
        assert!(ratios.len() > 90);
        // The promise of the documentation: useful, not only safe.
        assert!(middle < 100.0, "{name}: {middle}");
    }
}

fn random_sets(indices: impl Iterator<Item = u64>) {
    let source = CaseSource::built_in("paper-si").unwrap();
    let mut ratios = Vec::new();
    for index in indices {
        let overrides = overrides(index);
        let name = format!("set {index}");
        let (case, events, certificate) = certified(&source, &overrides);
        let word = events.iter().filter(|e| e.kind.in_mode_word()).count();
        println!(
            "{name}: {} events, {}, growth {:?}",
            word,
            certificate.verdict.name(),
            certificate.growth_to_onset
        );
        let unstable = certificate.growth_exponent.is_some_and(|g| g > 40.0);
        if case.parameters.perturbations.is_empty() && unstable {
            assert_eq!(certificate.verdict, Verdict::NoiseDetermined, "{name}");
            continue;
        }
        // 38 digits less a growth of e^25 at most.
        ratios.extend(check(&name, &source, &overrides, 33));
    }
    println!("median {:.1} of {} events", median(ratios.clone()), ratios.len());
    assert!(median(ratios) < 100.0);
}

#[test]
fn multiprecision_certified_uncertainties_cover_the_errors_of_other_brakes() {
    random_sets([1, 4].into_iter());
}

#[test]
#[ignore = "takes a minute or two"]
fn multiprecision_certified_uncertainties_cover_the_errors_of_twenty_brakes() {
    random_sets(0..20);
}

/// Nothing of it is called converged from the first stick on; with a kick all of it is.
#[test]
fn multiprecision_unperturbed_is_called_noise() {
    let source = CaseSource::built_in("unperturbed").unwrap();
    let (_, _, certificate) = certified(&source, &[]);
    assert_eq!(certificate.verdict, Verdict::NoiseDetermined);
    assert_eq!(certificate.least_digits(), Some(0));
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
