//! The attractor reported for a run: the least period, no period if there is none, and true digits.

use crate::common::cases::{built_in, near, parsed};
use stickslip::SavedRun;
use stickslip::analysis::{Summary, Witness};
use stickslip::case::{Case, CaseSource, Origin};

/// Runs a case with a witness.
fn run(text: &str, changes: &[&str]) -> (Summary, Option<Witness>) {
    let source = CaseSource {
        text: text.to_owned(),
        origin: Origin::File("case.toml".into()),
    };
    let changes = parsed(changes);
    let case = Case::read(&source, &changes).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let saved = SavedRun::new(&case, &folder.path().join("run.h5"))
        .witness(true)
        .start()
        .unwrap();
    assert!(saved.run.failure.is_none(), "{:?}", saved.run.failure);
    (saved.run.summary, saved.run.witness)
}

fn oscillator(drive: &str, friction: &str, normal_force: &str, rest: &str) -> String {
    format!(
        "motion = \"translation\"\n[rotor]\n{drive}\n[stator]\ninertia = 1.0\nstiffness = 1.0\nend = \"fixed\"\n{rest}\n\
         [contact]\nnormal_force = {normal_force}\n[friction]\nlaw = \"coulomb\"\n{friction}\n"
    )
}

const GROUND: &str = "end = \"fixed\"";

/// Two inertias on springs. Their cycles converge alternately: several agree to a millionth before one does.
const TWO_SPRINGS: &str = r#"
motion = "translation"
rotor = { inertia = 0.962, stiffness = 5.917, damping = 0.073, end = "driven", speed = 0.075 }
stator = { inertia = 1.0, stiffness = 29.804, damping = 0.021, end = "fixed" }
contact = { normal_force = 2.451 }
friction = { law = "coulomb", breakaway = 0.461, kinetic = 0.3 }
output = { end_time = 400.0, interval = 10.0 }
"#;

#[test]
fn property_the_period_is_the_least_one() {
    let (summary, witness) = run(TWO_SPRINGS, &[]);
    let attractor = summary.attractor().expect("periodic");
    // The period is from an integrator that shares nothing with this program, to its printed digits.
    near(attractor.period, 2.512147235901, 1e-11);
    assert_eq!(attractor.sticks, 1);
    assert_eq!(witness.expect("a witness").differs_from, None);
}

/// Coulomb friction takes 4 mu F_n/k from each swing, here less than a millionth of the swing.
#[test]
fn property_a_motion_that_shrinks_by_a_little_is_not_periodic() {
    let text = oscillator(GROUND, "breakaway = 0.3\nkinetic = 0.3", "2e-7", "")
        + "[initial]\nstator_twist = 1.0\n[output]\nend_time = 500.0\n";
    let (summary, _) = run(&text, &[]);
    assert_eq!(summary.attractor(), None);
}

/// The speed of the belt rises by a relative 7e-7 in each cycle.
#[test]
fn property_a_motion_that_drifts_is_not_periodic() {
    let drive = "end = \"driven\"\nspeed = { profile = \"table\", time = [0.0, 1e9], value = [0.2, 20.0] }";
    let text = oscillator(drive, "breakaway = 0.6\nkinetic = 0.3", "1.0", "") + "[output]\nend_time = 500.0\n";
    let (summary, _) = run(&text, &[]);
    assert_eq!(summary.attractor(), None);
}

/// Two harmonics that beat with a period of 3e7 s, and a small harmonic with an irrational ratio. A harmonic that does
/// not act yet does not count.
#[test]
fn property_forcing_that_does_not_repeat_gives_no_period() {
    let forced = |second: &str| {
        let torque = format!(
            "damping = 0.1\ntorque = {{ profile = \"sum\", signals = [{{ profile = \"cosine\", amplitude = 2.0, \
             angular_frequency = 0.5 }}, {second}] }}"
        );
        oscillator(GROUND, "breakaway = 0.4\nkinetic = 0.3", "1.0", &torque) + "[output]\nend_time = 600.0\n"
    };
    let wave = |rest: &str| format!("{{ profile = \"cosine\", {rest} }}");
    for other in [
        "amplitude = 1.0, angular_frequency = 0.5000002",
        "amplitude = 1e-8, angular_frequency = 0.7071067811865476, to = 700.0",
    ] {
        let (summary, _) = run(&forced(&wave(other)), &[]);
        assert_eq!(summary.attractor(), None, "{other}");
    }
    for none in [
        "amplitude = 1.0, angular_frequency = 0.7, from = 10000.0",
        "amplitude = 0.0, angular_frequency = 0.7",
    ] {
        let (summary, _) = run(&forced(&wave(none)), &[]);
        let period = summary.attractor().expect("periodic").period;
        assert!((period - 4.0 * std::f64::consts::PI).abs() < 1e-9, "{none}: {period}");
    }
}

#[test]
fn property_a_longer_run_says_the_same_within_the_stated_distance() {
    let source = CaseSource::built_in("drill-string").unwrap();
    let (short, _) = run(&source.text, &[]);
    let (long, _) = run(&source.text, &["output.end_time=1000"]);
    let (short, long) = (short.attractor().unwrap(), long.attractor().unwrap());
    assert!((short.period - long.period).abs() <= 2.0 * short.distance * long.period);
    let (a, b) = (short.extremes.as_ref().unwrap(), long.extremes.as_ref().unwrap());
    // The string turns, so its twist swings.
    assert_eq!(a.of, "rotor twist");
    let amplitudes = (a.amplitude.unwrap(), b.amplitude.unwrap());
    assert!((amplitudes.0 - amplitudes.1).abs() <= 4.0 * short.distance * b.position.1.abs());
}

#[test]
fn property_a_normal_force_that_touches_zero_does_not_open_the_contact() {
    let text = r#"
motion = "translation"
rotor = { inertia = 1.0, stiffness = 30.0, end = "fixed",
    torque = { profile = "cosine", amplitude = 4.0, angular_frequency = 3.1 } }
stator = { end = "fixed" }
contact = { normal_force = { profile = "sine", mean = 5.0, amplitude = 5.0, angular_frequency = 2.0 } }
friction = { law = "coulomb", breakaway = 0.5, kinetic = 0.35 }
output = { end_time = 20.0 }
"#;
    let source = CaseSource {
        text: text.to_owned(),
        origin: Origin::File("case.toml".into()),
    };
    let case = Case::read(&source, &[]).unwrap();
    let mut recorder = stickslip::record::MemoryRecorder::default();
    stickslip::Run::of_system(&case.system, 0.0, &case.solver, &case.output)
        .record(&mut recorder)
        .start()
        .unwrap();
    let events = recorder.events.iter();
    let opened = events.filter(|event| event.kind == stickslip::record::EventKind::Separation);
    assert_eq!(opened.count(), 0);
}

#[test]
fn property_a_run_that_rounding_decides_is_called_so() {
    let text = built_in("unperturbed", &[]).in_general_form().resolved();
    let (_, witness) = run(&text, &["output.window=[]", "output.around=none"]);
    let differs = witness.expect("a witness").differs_from.expect("other events");
    assert!(differs > 6.9, "{differs}");
}
