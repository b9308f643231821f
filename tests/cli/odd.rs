//! Odd cases, judged by properties of every brake: the energy balance, the order of events, the friction law.

use crate::common::cli::{Folder, json, output};
use stickslip::case::{Case, CaseSource};
use stickslip::model::Mode;
use stickslip::model::Parameters;
use stickslip::record::EventKind;

/// Cases that someone may try, each with the events that it must or cannot have.
const ODD: &[(&str, &[&str])] = &[
    ("at rest", &["initial.speed=0", "output.end_time=2"]),
    ("backwards", &["initial.speed=-100"]),
    ("slow", &["initial.speed=1e-6", "output.end_time=1"]),
    ("very fast", &["initial.speed=1e6", "output.end_time=1"]),
    ("no force", &["actuation.force=0", "output.end_time=1"]),
    ("pulling force", &["actuation.force=-2000", "output.end_time=1"]),
    ("all at once", &["actuation.rise_time=0"]),
    ("nearly all at once", &["actuation.rise_time=1e-6"]),
    (
        "one point",
        &[
            "actuation={profile=\"table\", time=[0], force=[2000]}",
            "initial.speed=10",
            "output.end_time=2",
        ],
    ),
    (
        "released from the start",
        &[
            "actuation={profile=\"table\", time=[0, 1, 2], force=[100, -100, 2000]}",
            "initial.speed=10",
            "output.end_time=3",
        ],
    ),
    (
        "a table that begins before the run",
        &[
            "actuation={profile=\"table\", time=[-3, -1], force=[0, 2000]}",
            "initial.speed=10",
            "output.end_time=2",
        ],
    ),
    (
        "gripping six times in 6 ms",
        &[
            "actuation={profile=\"table\", time=[0, 0.001, 0.002, 0.003, 0.004, 0.005], force=[0, 2225, 0, 2225, 0, 2225]}",
            "output.end_time=1",
        ],
    ),
    (
        "released while it sticks",
        &[
            "actuation={profile=\"table\", time=[0, 1, 8, 8.1, 8.2], force=[0, 2225, 2225, 0, 2225]}",
            "output.end_time=9",
        ],
    ),
    ("a friction that does not fall", &["friction.decay=0"]),
    ("a friction that rises", &["friction.low_speed=0.2"]),
    (
        "no friction",
        &[
            "friction={breakaway=0, low_speed=0, high_speed=0, decay=1}",
            "output.end_time=2",
        ],
    ),
    ("a breakaway far above sliding", &["friction.breakaway=5"]),
    ("no torsional damping", &["torsion.damping=0", "output.end_time=7.1"]),
    ("no axial damping", &["axial.damping=0", "output.end_time=7.1"]),
    ("light surfaces", &["torsion.surface_inertia=1e-5"]),
    ("heavy surfaces", &["torsion.surface_inertia=10"]),
    ("a light rotor", &["torsion.rotor_inertia=1e-3"]),
    (
        "a kick at the start",
        &["perturbation=[{time=0, relative_velocity=1}]", "output.end_time=1"],
    ),
    (
        "two kicks at once",
        &[
            "perturbation=[{time=0.5, relative_velocity=1}, {time=0.5, relative_velocity=-1}]",
            "output.end_time=1",
        ],
    ),
    (
        "two kicks at the instability",
        &[
            "perturbation=[{time=\"instability\", relative_velocity=1e-4}, {time=\"instability\", relative_velocity=1e-4}]",
        ],
    ),
    (
        "a kick in stick",
        &["perturbation=[{time=6.966, relative_velocity=1.3e-6}, {time=8, relative_velocity=5}]"],
    ),
    (
        "a kick at a corner of the force",
        &["perturbation=[{time=1, relative_velocity=1e-3}]", "output.end_time=2"],
    ),
    (
        "a kick that reverses the sense",
        &["perturbation=[{time=0.5, relative_velocity=-500}]"],
    ),
    ("an end before the kick", &["output.end_time=6.9"]),
    ("an end at the kick", &["output.end_time=6.966"]),
    ("an end at once", &["output.end_time=1e-9"]),
    (
        "an interval beyond the end",
        &["output.end_time=1", "output.interval=5"],
    ),
    (
        "an interval that does not fit",
        &["output.end_time=1", "output.interval=0.3"],
    ),
    (
        "windows outside, across the end, and in each other",
        &[
            "output.window=[{from=20, to=30}, {from=0.9, to=3, interval=0.01}, {from=0.2, to=0.5, interval=0.01}, \
             {from=0.3, to=0.4, interval=1e-3}]",
            "output.end_time=1",
        ],
    ),
];

#[test]
fn cli_odd_cases_are_computed_as_physics_wants() {
    let folder = Folder::new();
    for (name, settings) in ODD {
        let mut command = folder.stickslip("run --json --force -o x.h5");
        for setting in *settings {
            command.args(["--set", setting]);
        }
        let (stdout, _) = output(&mut command, 0);
        assert_eq!(json(&stdout)["status"], "complete", "{name}");
        judge(name, &folder);
    }
}

fn judge(name: &str, folder: &Folder) {
    let file = folder.result("x.h5");
    let source = CaseSource::result(file.path(), file.resolved().unwrap());
    let case = Case::read(&source, &[]).unwrap();
    let samples = file.samples(0..file.sample_count().unwrap()).unwrap();
    let (events, segments) = (file.events().unwrap(), file.segments().unwrap());

    assert_eq!(samples.first().unwrap().time, 0.0, "{name}");
    assert_eq!(samples.last().unwrap().time, case.output.end_time, "{name}");
    assert!(samples.windows(2).all(|pair| pair[0].time < pair[1].time), "{name}");
    assert!(events.windows(2).all(|pair| pair[0].time <= pair[1].time), "{name}");
    assert!(segments.windows(2).all(|pair| pair[0].end == pair[1].start), "{name}");
    for sample in &samples {
        let segment = &segments[sample.segment as usize];
        assert!(segment.start <= sample.time && sample.time <= segment.end, "{name}");
        assert_eq!(segment.mode, sample.mode, "{name} at {}", sample.time);
    }

    // The energy balance must close to 1e-8 of the largest energy. This is ten times the error of the default method,
    // which is largest where its steps cross a change of the force.
    let largest =
        |f: fn(&stickslip::record::Channels) -> f64| samples.iter().map(|s| f(&s.channels).abs()).fold(0.0, f64::max);
    let stake = largest(|c| c.energy_kinetic).max(largest(|c| c.work_applied));
    let found = largest(|c| c.energy_residual);
    assert!(found <= 1e-8 * stake, "{name}: {found} of {stake}");
    for pair in samples.windows(2) {
        let lost = |f: fn(&stickslip::record::Channels) -> f64| f(&pair[1].channels) - f(&pair[0].channels);
        let found = lost(|c| c.dissipated_friction);
        assert!(found >= -1e-11 * stake, "{name} at {}", pair[0].time);
        let found = lost(|c| c.dissipated_damping);
        assert!(found >= -1e-11 * stake, "{name} at {}", pair[0].time);
    }

    // The friction law, and the sense of slip.
    let friction = &Parameters::of(&case.system).unwrap().friction;
    let values = samples.iter().map(|s| s.state.relative_velocity.abs());
    let fastest = values.fold(0.0, f64::max);
    for sample in &samples {
        let (w, channels) = (sample.state.relative_velocity, &sample.channels);
        assert!(sample.state.values().iter().all(|value| value.is_finite()), "{name}");
        assert!(channels.normal_force >= 0.0, "{name} at {}", sample.time);
        let pressing = case.system.radius * channels.normal_force;
        let most = friction
            .breakaway
            .max(friction.law.as_exponential().unwrap().high_speed)
            * pressing;
        let off = channels.friction_torque.abs();
        assert!(off <= most * (1.0 + 1e-9) + 1e-9, "{name} at {}", sample.time);
        match sample.mode {
            Mode::Separated => assert_eq!(channels.normal_force, 0.0, "{name}"),
            Mode::Stick => assert_eq!(w, 0.0, "{name}"),
            Mode::SlipForward => assert!(w >= -1e-12 * fastest, "{name} at {}: {w}", sample.time),
            Mode::SlipBackward => assert!(w <= 1e-12 * fastest, "{name} at {}: {w}", sample.time),
            Mode::Engaged => panic!("{name}: a brake sticks"),
        }
    }

    // Each event is possible in the mode in which it occurs.
    let mut mode = None;
    for event in &events {
        let after = event.mode_after;
        let slips = |mode: Mode| matches!(mode, Mode::SlipForward | Mode::SlipBackward);
        if let Some(before) = mode {
            let legal = match event.kind {
                EventKind::Stick => slips(before) && after == Mode::Stick,
                EventKind::Slip => before == Mode::Stick && slips(after),
                EventKind::Reversal => slips(before) && slips(after) && before != after,
                EventKind::Separation => before != Mode::Separated && after == Mode::Separated,
                EventKind::Contact => before == Mode::Separated && after != Mode::Separated,
                EventKind::Kick | EventKind::Corner => before == after,
                EventKind::Destabilised | EventKind::Restabilised => slips(before) && before == after,
            };
            assert!(
                legal,
                "{name}: {:?} from {before:?} to {after:?} at {}",
                event.kind, event.time
            );
        }
        mode = Some(after);
    }
}

#[test]
fn cli_odd_mirrored_case_gives_the_mirrored_run() {
    let folder = Folder::new();
    let kick = |sign: &str| format!("perturbation=[{{time=6.966, relative_velocity={sign}1.3e-6}}]");
    for (name, speed, sign) in [
        ("forward.h5", "initial.speed=100", ""),
        ("backward.h5", "initial.speed=-100", "-"),
    ] {
        folder.ok(&["run", "-q", "-o", name, "--set", speed, "--set", &kick(sign)]);
    }
    let times = |name: &str| -> Vec<f64> { folder.result(name).events().unwrap().iter().map(|e| e.time).collect() };
    assert_eq!(times("forward.h5"), times("backward.h5"));
    let speeds = |name: &str| folder.result(name).column("theta_dot", 0..13_000).unwrap();
    let mirrored: Vec<f64> = speeds("backward.h5").iter().map(|speed| -speed).collect();
    assert!(speeds("forward.h5") == mirrored);
}

/// A kick that decays before sliding becomes unstable, or that is below rounding, starts nothing.
#[test]
fn cli_odd_kick_that_cannot_matter_does_not_silence_the_warning() {
    let folder = Folder::new();
    for setting in
        "perturbation.0.time=3 perturbation.0.relative_velocity=0 perturbation.0.relative_velocity=1e-300".split(' ')
    {
        let (_, stderr) = folder.ends(&["run", "--force", "--set", setting], 0);
        assert!(stderr.contains("rounding error"), "{setting}: {stderr}");
    }
}
