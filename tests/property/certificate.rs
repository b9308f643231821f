//! Certificates of results that differ from the runs of their cases.
use crate::common::cases::{built_in, recorded};
use stickslip::analysis::bands::{Compared, compared_output};
use stickslip::analysis::certificate::{Verdict, certify};
use stickslip::case::{Case, CaseSource, Override};
use stickslip::record::{EventKind, MemoryRecorder};

/// A short slide from a low speed with a kick: it sticks and slips within 0.2 s.
fn quick(more: &[&str]) -> (Case, MemoryRecorder) {
    let settings = [
        "initial.speed=3",
        "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
        "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
        "output={end_time=0.25, interval=1e-4, around=\"none\"}",
    ];
    let values = settings.iter().chain(more).map(|s| Override::parse(s).unwrap());
    let overrides: Vec<Override> = values.collect();
    let case = Case::read(&CaseSource::built_in("paper-si").unwrap(), &overrides).unwrap();
    let recorder = recorded(&case);
    (case, recorder)
}

/// Only the other methods have a final slip. Each existing event has converged, but the sequence has not.
#[test]
fn property_a_result_without_the_last_events_is_not_converged() {
    let (case, mut result) = quick(&[]);
    let whole = certify(&case, &result, &|| false).unwrap();
    assert_eq!(whole.verdict, Verdict::Converged);
    assert!(whole.others_agree && whole.bands.stretches.last().unwrap().converged);
    let last = result.events.iter().rposition(|e| e.kind == EventKind::Slip).unwrap();
    result.events.truncate(last);
    let certificate = certify(&case, &result, &|| false).unwrap();
    assert_eq!(certificate.verdict, Verdict::SequenceDiffers);
    assert!(certificate.events.iter().all(|e| e.verdict == Verdict::Converged));
    let (end, others) = certificate.bands.stretches.split_last().unwrap();
    assert!(!end.converged && end.bands.iter().all(|band| band.is_nan()));
    assert!(others.iter().all(|s| s.converged || s.start == s.end));
}

/// A coarse result is not noise: the other methods agree with each other and measure its error.
#[test]
fn property_a_coarse_result_is_no_noise() {
    let (case, result) = quick(&["solver.method=\"cvode-bdf\"", "solver.rtol=1e-6"]);
    let certificate = certify(&case, &result, &|| false).unwrap();
    assert!(certificate.others_agree);
    assert_ne!(certificate.verdict, Verdict::NoiseDetermined);
    let (_, fine) = quick(&["solver.rtol=1e-12"]);
    let pairs = certificate.events.iter().zip(result.events.iter().zip(&fine.events));
    let mut largest = 0.0_f64;
    for (event, (own, fine)) in pairs.filter(|(event, _)| event.verdict == Verdict::Converged) {
        assert_eq!(own.kind, fine.kind);
        let error = (own.time - fine.time).abs();
        // The finer run's own error is below 1e-12 s.
        assert!(error <= event.uncertainty + 1e-12, "{}: {error:e}", own.time);
        largest = largest.max(error);
    }
    assert!(largest > 1e-9, "not coarse: {largest:e}");
}

/// Rows at the integrator's own steps are left out; all other rows are compared.
#[test]
fn property_rows_at_steps_leave_the_bands_as_they_are() {
    let (case, result) = quick(&[]);
    let plain = certify(&case, &result, &|| false).unwrap();
    let (with_steps, dense) = quick(&["output.steps=true"]);
    assert!(dense.samples.len() > result.samples.len());
    let mut compared = Compared::new(&compared_output(&with_steps.output));
    let samples = dense.samples.iter();
    let taken: Vec<f64> = samples.map(|row| row.time).filter(|t| compared.takes(*t)).collect();
    assert_eq!(taken, result.samples.iter().map(|row| row.time).collect::<Vec<_>>());
    let stepped = certify(&with_steps, &dense, &|| false).unwrap();
    for (a, b) in plain.bands.channels.iter().zip(&stepped.bands.channels) {
        // Rates, and therefore the rounding in a band, are taken over more rows.
        assert!(b.band >= a.band * 0.999, "{}: {:e} {:e}", a.name, a.band, b.band);
        assert!(b.band <= a.band * 2.0, "{}: {:e} {:e}", a.name, a.band, b.band);
    }
}

/// There are more rows than are kept of several runs. Every second or third row is taken, at times in the file.
#[test]
fn property_long_trajectories_are_thinned() {
    let (case, _) = quick(&["output={end_time=0.25, interval=1e-6, around=\"none\"}"]);
    let compared = compared_output(&case.output);
    assert_eq!(compared.interval, 2e-6);
    let mut rows = Compared::new(&compared);
    let taken = (0..=250_000).filter(|k| rows.takes(f64::from(*k) * 1e-6)).count();
    // The end is a row, whether or not the thinning selects it.
    assert!((125_001..=125_001).contains(&taken), "{taken}");
}

/// A weak early kick has nearly decayed at the instability. The crossing of the margin on the way to the onset is as
/// much noise as the onset. The multiprecision solution has no such crossing.
#[test]
fn property_an_event_without_an_uncertainty_is_not_converged() {
    let settings = [
        "initial.speed=3.9767",
        "friction={breakaway=0.5684, low_speed=0.5684, high_speed=0.3669, decay=3.275}",
        "torsion={rotor_inertia=2.2616, surface_inertia=0.002788, stiffness=8184552.5, damping=64.955}",
        "actuation={profile=\"ramp\", force=2889.3, rise_time=0.1867}",
        "perturbation=[{time=0.188993, relative_velocity=-7.028369e-5}]",
        "output={end_time=0.7697, interval=0.05}",
    ];
    let case = built_in("paper-si", &settings);
    let recorder = recorded(&case);
    let certificate = certify(&case, &recorder, &|| false).unwrap();
    assert_eq!(certificate.verdict, Verdict::NoiseDetermined);
    let converged = |e: &&stickslip::analysis::certificate::CertifiedEvent| e.verdict == Verdict::Converged;
    assert!(
        certificate
            .events
            .iter()
            .filter(converged)
            .all(|e| e.uncertainty.is_finite())
    );
    let kinds: Vec<&str> = certificate.events.iter().filter(converged).map(|e| e.kind).collect();
    assert_eq!(kinds, ["corner", "kick", "destabilised"]);
}
