//! The resolved text of a case reads back as the identical case.

use crate::common::cases::built_in;
use crate::common::rows;
use crate::common::systems::exponential;
use std::path::PathBuf;

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use stickslip::case::{Case, CaseSource, Override, builtin};
use stickslip::friction::Friction;
use stickslip::model::system::System;
use stickslip::model::{
    Axial, BreakawayTest, Contact, DiskInitial, DiskKick, KickTime, Parameters, Torsion, nearest_double,
};
use stickslip::signal::{Ramp, Signal, TimeTable};
use stickslip::simulation::{Around, Following, Method, OutputOptions, OutputWindow, SolverOptions};

fn read(text: String) -> Case {
    let source = CaseSource::result(&PathBuf::from("run.h5"), text);
    Case::read(&source, &[]).unwrap_or_else(|error| panic!("{error}\n{}", source.text))
}

#[test]
fn the_built_in_cases_survive_resolution() {
    for known in builtin::CASES {
        let case = built_in(known.name, &[]);
        let resolved = case.resolved();
        let again = read(resolved.clone());
        assert_eq!(again, case, "{}", known.name);
        assert_eq!(again.resolved(), resolved, "{}", known.name);
    }
}

#[test]
fn regression_resolved_text_of_the_paper_case() {
    let case = built_in("paper", &[]);
    insta::assert_snapshot!(case.resolved(), @r#"
title = "Two-disk brake, the paper's parameters in US units" # title of the case

[axial]
mass = 4.5359237 # m, the rotor mass [kg]
stiffness = 55357592.62141118 # k_e, equivalent axial stiffness [N/m]
damping = 8756.341762323818 # c_a, axial damping [N s/m]
ringing_floor = 1e-9 # amplitude below which a ringing open contact stays open while F does not press [m]

[actuation]
profile = "ramp" # whether the force is a ramp that then holds, or a table
force = 2224.11080763025 # F_0, actuating force at the end of the ramp; positive presses the disks together [N]
rise_time = 1.0 # t_0, application time; 0 is a step at t = 0 [s]

[torsion]
rotor_inertia = 2.259696580552334 # I, the rotor inertia [kg m^2]
surface_inertia = 0.01129848290276167 # J, inertia of each contact surface [kg m^2]
stiffness = 7707825.036264012 # k_t, torsional contact stiffness of each disk [N m/rad]
damping = 22.59696580552334 # c_t, torsional contact damping of each disk [N m s/rad]

[contact]
radius = 0.0523875 # r, effective friction radius [m]
breakaway_test = "transmitted" # the torque that is compared with mu_0 r F_n: T_f, or the paper's T_s or T_r alone

[friction]
breakaway = 0.6 # mu_0, friction coefficient at rest; at least low_speed
low_speed = 0.6 # mu_s, friction coefficient at vanishing sliding speed
high_speed = 0.3 # mu_d, friction coefficient at high sliding speed
decay = 5.0 # alpha, decay of the friction coefficient with sliding speed [s/rad]

[initial]
speed = 100.0 # omega_0, initial speed of the rotor and of its surface [rad/s]

[solver]
method = "cvode" # integration method
rtol = 1e-10 # relative tolerance; smaller is more accurate in every phase
max_events = 100000 # transitions after which a run is ended with an error

[output]
end_time = 10.0 # when the run ends [s]
interval = 0.01 # sampling interval outside the windows [s]
steps = false # whether every step of the integrator is recorded too

[[perturbation]]
kind = "kick" # kind of perturbation: a jump of the relative velocity
time = 6.966 # when the kick comes: a time, or "instability" [s]
relative_velocity = 1.3e-6 # delta, jump of omega_r, half on each surface [rad/s]

[[output.window]]
from = 0.998 # start of a stretch that is sampled more densely [s]
to = 1.011 # end of that stretch [s]
interval = 2.4e-6 # sampling interval there [s]

[[output.window]]
from = 6.96 # start of a stretch that is sampled more densely [s]
to = 6.992 # end of that stretch [s]
interval = 2.5e-6 # sampling interval there [s]

[[output.window]]
from = 6.989 # start of a stretch that is sampled more densely [s]
to = 7.09 # end of that stretch [s]
interval = 4e-5 # sampling interval there [s]
"#);
}

/// Positive doubles over a range of exponents beyond that of any physical value.
fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![
        (1.0f64..10.0, -300i32..300).prop_map(|(mantissa, exponent)| mantissa * 10f64.powi(exponent)),
        1e-3f64..1e3,
        Just(5e-324),
        Just(f64::MAX),
    ]
}

fn not_negative() -> impl Strategy<Value = f64> {
    prop_oneof![positive(), Just(0.0)]
}

fn any_finite() -> impl Strategy<Value = f64> {
    prop_oneof![positive(), positive().prop_map(|x| -x), Just(0.0), Just(-0.0)]
}

fn actuation() -> impl Strategy<Value = Signal> {
    let ramp = (any_finite(), prop_oneof![1e-12f64..1e300, Just(0.0)]).prop_map(|(force, rise_time)| {
        Signal::Ramp(Ramp {
            value: force,
            rise_time,
        })
    });
    let table = vec((1e-6f64..10.0, any_finite()), 1..8).prop_map(|points| {
        let mut now = -1.0;
        let time = points.iter().map(|&(step, _)| {
            now += step;
            now
        });
        Signal::TimeTable(TimeTable {
            time: time.collect(),
            value: points.iter().map(|&(_, force)| force).collect(),
        })
    });
    prop_oneof![ramp, table]
}

fn parameters() -> impl Strategy<Value = Parameters> {
    let kick = (
        prop_oneof![not_negative().prop_map(KickTime::At), Just(KickTime::Instability)],
        any_finite(),
    )
        .prop_map(|(time, relative_velocity)| DiskKick {
            time,
            relative_velocity,
        });
    let tests = prop_oneof![
        Just(BreakawayTest::Transmitted),
        Just(BreakawayTest::Stator),
        Just(BreakawayTest::Rotor)
    ];
    (
        (1e-30f64..1e30, 1e-3f64..1e16, not_negative(), positive()),
        actuation(),
        (positive(), 1e-30f64..1e30, 1e-3f64..1e16, not_negative()),
        (positive(), tests),
        (not_negative(), not_negative(), not_negative(), not_negative()),
        any_finite(),
        vec(kick, 0..4),
    )
        .prop_map(
            |(axial, actuation, torsion, contact, friction, speed, perturbations)| Parameters {
                axial: Axial {
                    mass: axial.0,
                    // Given by the square of the natural frequency, as below, because both must fit the end time.
                    stiffness: axial.0 * axial.1,
                    damping: axial.2,
                    ringing_floor: axial.3,
                },
                actuation,
                torsion: Torsion {
                    rotor_inertia: torsion.0,
                    surface_inertia: torsion.1,
                    stiffness: torsion.1 * torsion.2,
                    damping: torsion.3,
                },
                contact: Contact {
                    radius: contact.0,
                    breakaway_test: contact.1,
                },
                friction: Friction {
                    breakaway: friction.0.max(friction.1),
                    law: exponential(friction.0.min(friction.1), friction.2, friction.3).into(),
                },
                initial: DiskInitial { speed },
                perturbations,
            },
        )
}

fn solver() -> impl Strategy<Value = SolverOptions> {
    let methods = proptest::sample::select(Method::KINDS.to_vec());
    let optional = || option::of(positive());
    (
        methods,
        2e-15f64..=0.1,
        optional(),
        optional(),
        optional(),
        optional(),
        1usize..1_000_000_000,
        (proptest::option::of(1usize..1_000_000_000), optional()),
    )
        .prop_map(
            |(method, rtol, atol_twist, atol_rate, atol_speed, max_step, max_events, (max_steps, max_wall_time))| {
                SolverOptions {
                    fixed_step: None,
                    method,
                    rtol,
                    atol_twist,
                    atol_rate,
                    atol_speed,
                    max_step,
                    max_events,
                    max_steps,
                    max_wall_time,
                }
            },
        )
}

fn output() -> impl Strategy<Value = OutputOptions> {
    let window = (0.0f64..100.0, 1e-3f64..10.0, 1e-6f64..10.0).prop_map(|(from, length, interval)| OutputWindow {
        from,
        to: from + length,
        interval,
    });
    // So few samples that the case is accepted.
    let around = prop_oneof![Just(None), proptest::sample::select(&Around::ALL[..]).prop_map(Some)];
    let number = || proptest::option::of(1e-6f64..1e3);
    let follow = (around, number(), number(), any::<bool>()).prop_map(|(around, margin, samples, dense)| Following {
        around,
        margin,
        samples_per_period: samples,
        dense,
    });
    (1e-3f64..1e3, 1e-5f64..10.0, vec(window, 0..4), any::<bool>(), follow).prop_map(
        |(end_time, interval, windows, steps, follow)| OutputOptions {
            end_time,
            interval,
            windows,
            steps,
            follow,
        },
    )
}

/// Every law, with its defaults and without, and what distinguishes the case from an exponential one.
#[test]
fn every_friction_law_survives_resolution() {
    let source = CaseSource::built_in("paper").unwrap();
    for [friction, written] in rows(
        r#"
        {law="exponential", breakaway=0.6, low_speed=0.5, high_speed=0.3, decay=5} | decay = 5.0
        {law="coulomb", breakaway=0.6, kinetic=0.3} | law = "coulomb"
        {law="hyperbolic", breakaway=0.6, low_speed=0.6, high_speed=0.3, scale="3 rpm"} | scale = 0.3141592653589793
        {law="stribeck", breakaway=0.6, low_speed=0.6, high_speed=0.3, scale=0.5} | exponent = 2.0
        {law="polynomial", breakaway=0.6, low_speed=0.6, linear=-0.001, valid_below=200} | cubic = 0.0
        {law="table", breakaway=0.6, speed=[0, 1], coefficient=[0.6, 0.3]} | interpolation = "monotone-cubic"
        {law="table", breakaway=0.6, speed=[0, 1], coefficient=[0.6, 0.3], interpolation="linear"} | speed = [0.0, 1.0]
    "#,
    ) {
        let set = [Override::parse(&format!("friction={friction}")).unwrap()];
        let case = Case::read(&source, &set).unwrap();
        let text = case.resolved();
        assert!(text.contains(written), "{written} in {text}");
        let again = read(text.clone());
        assert_eq!((&again, again.resolved()), (&case, text));
        // The numbers without rounding are the same, too.
        let exact = Case::exact(&source, &set).unwrap().system;
        for (key, value) in &exact.law.numbers {
            assert_eq!(case.system.law.number(key), Some(nearest_double(value)), "{key}");
        }
        for (key, values) in &exact.law.lists {
            let values: Vec<f64> = values.iter().map(nearest_double).collect();
            assert_eq!(case.system.law.list(key), Some(&values[..]), "{key}");
        }
    }
}

proptest! {
    #[test]
    fn property_every_valid_case_survives_resolution(
        title in any::<String>(),
        parameters in parameters(),
        solver in solver(),
        output in output(),
    ) {
        let mut case = built_in("paper", &[]);
        case.title = title;
        case.system = System::from(&parameters);
        case.solver = solver;
        case.output = output;
        let again = read(case.resolved());
        prop_assert_eq!(&again, &case);
        // Equality does not distinguish -0.0 from 0.0, but the text does.
        prop_assert_eq!(again.resolved(), case.resolved());
    }

    #[test]
    fn property_no_text_panics(text in "\\PC*") {
        let source = CaseSource::result(&PathBuf::from("run.h5"), text);
        let _ = Case::read(&source, &[]);
    }

    /// The paper case with a few characters overwritten.
    #[test]
    fn property_no_damaged_case_panics(damage in vec((any::<prop::sample::Index>(), "[ -~\n]"), 1..6)) {
        let mut text: Vec<char> = builtin::CASES[0].text.chars().collect();
        for (at, with) in damage {
            let at = at.index(text.len());
            text[at] = with.chars().next().unwrap_or(' ');
        }
        let source = CaseSource::result(&PathBuf::from("run.h5"), text.into_iter().collect());
        let _ = Case::read(&source, &[]);
    }
}
