//! A candidate is not blamed for what it cannot show. What it shows counts.

use crate::common::cases::{built_in, written};
use crate::common::cli::says;
use crate::common::compare::{Kept, agrees, causes, kept, series};
use std::fmt::Write;
use std::time::Instant;

use stickslip::compare::{CauseKind, Mapping};
use stickslip::simulation::{OutputOptions, Simulation, SolverOptions, simulate};

/// The reference's own samples at `interval` (s), printed by `print`.
fn table(made: &Kept, columns: &[&str], interval: f64, print: impl Fn(&str, f64) -> String) -> String {
    let all = made.columns(columns);
    let mut text = format!("time,{}\n", columns.join(","));
    let is_even = |time: f64| (time / interval - (time / interval).round()).abs() < 1e-6;
    for row in (0..all[0].len()).filter(|&row| is_even(all[0][row])) {
        let names = ["time"].iter().chain(columns);
        let values: Vec<String> = names.zip(&all).map(|(name, column)| print(name, column[row])).collect();
        writeln!(text, "{}", values.join(",")).unwrap();
    }
    text
}

fn quick(mapping: &mut Mapping) {
    mapping.quick = true;
}

const BOX: &str = r#"
title = "A box slides to a stop"
motion = "translation"
rotor = { end = "free", inertia = "1 kg" }
stator = { end = "fixed" }
contact = { normal_force = "9.8 N" }
friction = { law = "coulomb", breakaway = 0.3, kinetic = 0.3 }
initial = { speed = "10 m/s" }
output = { end_time = "10 s" }
"#;

const CLOSING: &str = r#"
title = "A brake that closes at 0.1 s"
motion = "translation"
rotor = { end = "free", inertia = "1 kg" }
stator = { end = "fixed" }
contact = { normal_force = { profile = "table", time = [0, 0.1, 0.1001], value = [0, 0, 2] } }
friction = { law = "coulomb", breakaway = 0.5, kinetic = 0.5 }
initial = { speed = "1 m/s" }
output = { end_time = "2 s" }
"#;

const OPENING: &str = r#"
title = "Driven brake joint that opens and grips again"
[rotor]
inertia = [0.05, 0.4]
stiffness = [900, 600]
damping = [0.4, 0.5]
end = "driven"
speed = "2 rad/s"
[stator]
inertia = 0.08
stiffness = 2500
damping = 0.9
end = "fixed"
[contact]
radius = "80 mm"
normal_force = { profile = "table", time = [0, 0.4, 1.4, 1.45, 1.8, 3.0], value = [0, 800, 800, -40, 700, 700] }
[friction]
breakaway = 0.52
low_speed = 0.5
high_speed = 0.3
decay = "0.4 s/rad"
[initial]
rotor_speed = [2, 2]
[output]
end_time = "3 s"
interval = "1 ms"
around = "none"
"#;

const GRIP: &str = r#"
title = "A weight held by friction"
motion = "translation"
rotor = { end = "free", inertia = "0.045 kg", torque = "0.44 N" }
stator = { end = "fixed" }
contact = { normal_force = "20 N" }
friction = { law = "coulomb", breakaway = 0.7, kinetic = 0.7 }
output = { end_time = "1 s" }
"#;

const REVERSING: &str = r#"
title = "A force that reverses slowly, against viscous and Coulomb friction"
motion = "translation"
rotor = { end = "free", inertia = "2 kg", viscous = "5 N s/m", torque = { profile = "table", time = [0, 2, 6, 8], value = [0, 30, -30, 0] } }
stator = { end = "fixed" }
contact = { normal_force = "1 N" }
friction = { law = "coulomb", breakaway = 10, kinetic = 10 }
output = { end_time = "10 s", interval = "5 ms" }
"#;

const WIPER: &str = concat!(include_str!("planted/corpus/wiper.toml"), "around = \"none\"\n");

const OF_WIPER: [&str; 4] = ["stator_twist_0", "stator_twist_1", "stator_speed_0", "stator_speed_1"];

#[test]
fn property_no_run_ends_before_it_begins() {
    let case = written(BOX, &[]);
    let output = OutputOptions::at_the_ends(-16.0);
    let problem = Simulation {
        system: &case.system,
        threshold: case.threshold,
        further: false,
    };
    let solver = SolverOptions::default();
    let mut recorder = stickslip::record::NoRecorder;
    let failure = simulate(problem, &solver, &output, &mut recorder, &()).unwrap_err();
    assert!(failure.to_string().contains("before t = 0"), "{failure}");
}

/// A mass without a shaft stops at once, without an onset that grows from rounding.
#[test]
fn property_another_friction_of_a_sliding_mass_is_named() {
    let begin = Instant::now();
    // A table of four rows, and one of any number of rows.
    let at = |mu: f64, t: f64| {
        let stop = 10.0 / (mu * 9.8);
        let t_slid = t.min(stop);
        [
            t,
            10.0 * t_slid - 0.5 * mu * 9.8 * t_slid * t_slid,
            10.0 - mu * 9.8 * t_slid,
        ]
    };
    let coarse = "t,v\n0,10\n4,2\n6,0\n10,0\n";
    let c = kept(&written(BOX, &[])).compared(coarse, |_| {});
    assert!(c.out_of_time.is_none(), "{}", c.verdict);
    let c = kept(&written(BOX, &[])).compared(
        &series("t,x,v", (0..=100).map(|k| at(0.25, 0.1 * f64::from(k)))),
        |_| {},
    );
    assert_eq!(causes(&c)[..1], [CauseKind::AnotherParameter], "{}", c.verdict);
    assert!(c.verdict.contains("friction.kinetic (mu_d) = 0.25"), "{}", c.verdict);
    assert!(begin.elapsed().as_secs() < 60);
}

#[test]
fn property_an_open_contact_is_not_held_against_a_candidate_without_its_force() {
    // x and v of the brake, whose contact closes at 0.1 s, sampled every 50 ms. Here the contact closes at once.
    let at = |t: f64| match t {
        t if t < 0.1 => [t, t, 1.0],
        t if t < 1.1 => [t, t - 0.5 * (t - 0.1) * (t - 0.1), 1.1 - t],
        t => [t, 0.6, 0.0],
    };
    let closing = kept(&written(CLOSING, &[]));
    let rows = series("t,x,v", (0..=40).map(|k| at(0.05 * f64::from(k))));
    let c = closing.compared(&rows, quick);
    assert_eq!((c.missing, c.spurious), (0, 0), "{}", c.verdict);
    let opening = kept(&written(OPENING, &[]));
    let columns = [
        "rotor_twist_0",
        "rotor_twist_1",
        "rotor_speed_0",
        "rotor_speed_1",
        "stator_twist_0",
        "stator_speed_0",
    ];
    let text = table(&opening, &columns, 1e-3, |_, value| format!("{value:?}"));
    let whole = opening.compared(&text, |_| {});
    agrees(&whole);
    for c in [&c, &whole] {
        let said: Vec<_> = c
            .absent
            .iter()
            .filter(|absent| absent.what.contains("contact"))
            .collect();
        assert_eq!(said.len(), 1, "{:?}", c.absent);
        says(&said[0].why, "normal_force");
        assert!(!c.verdict.contains("missing"), "{}", c.verdict);
    }
    // A column of the normal force decides.
    let text = table(
        &opening,
        &[&columns[..], &["normal_force"]].concat(),
        1e-3,
        |name, value| match name {
            "normal_force" => format!("{:?}", value.max(1.0)),
            _ => format!("{value:?}"),
        },
    );
    let c = opening.compared(&text, quick);
    assert_eq!((c.missing, c.spurious), (2, 0), "{}", c.verdict);
}

#[test]
fn property_creep_through_a_whole_run_is_the_headline() {
    // The law is tanh(v/eps). This is the speed at 0.44 N of 14 N, reached within 16 us.
    let speed = 5.038e-3 * (0.44f64 / 14.0).atanh();
    let row = |k: u32| {
        [
            1e-3 * f64::from(k),
            speed * 1e-3 * f64::from(k),
            if k == 0 { 0.0 } else { speed },
        ]
    };
    let grip = kept(&written(GRIP, &[]));
    let c = grip.compared(&series("t,x,v", (0..=1000).map(row)), |_| {});
    says(&c.verdict, &["creeps at 1.584e-4 m/s", "1.58e-4 m in 1.000 s"]);
    assert!(!c.verdict.contains("17.0 digits"), "{}", c.verdict);
    let found = (c.samples, causes(&c));
    assert_eq!(found, (1001, vec![CauseKind::RegularisedLaw]), "{}", c.verdict);
    let creep = c.score.unwrap().creep.unwrap();
    assert!((creep.candidate / speed - 1.0).abs() < 1e-9 && creep.relative.is_finite());
}

/// A solver with sign(v) and tiny steps dithers in stick. It is true to 4e-6 m, and its slips begin at the right times
/// for any speed that counts as zero.
#[test]
fn property_states_at_one_time_are_compared_at_one_time() {
    let reversing = kept(&written(REVERSING, &[]));
    let force = |t: f64| match t {
        t if t < 2.0 => 15.0 * t,
        t if t < 6.0 => 30.0 - 15.0 * (t - 2.0),
        t if t < 8.0 => -30.0 + 15.0 * (t - 6.0),
        _ => 0.0,
    };
    let (mut x, mut v, h) = (0.0, 0.0, 1e-6);
    let mut rows = vec![[0.0; 3]];
    for k in 0..10_000_000u32 {
        let t = f64::from(k) * h;
        v += 0.5 * h * (force(t) - 5.0 * v - 10.0 * f64::signum(v));
        x += h * v;
        if (k + 1) % 5000 == 0 {
            rows.push([f64::from(k + 1) * h, x, v]);
        }
    }
    let text = series("t,x,v", rows);
    for tolerance in [1e-4, 1e-3, 1e-2] {
        let c = reversing.compared(&text, |mapping| {
            (mapping.velocity_tolerance, mapping.quick) = (Some(tolerance), true);
        });
        assert_eq!((c.missing, c.spurious), (0, 0), "{}", c.verdict);
        let channels = c.channels.iter();
        let worst = channels.filter(|row| row.channel == "theta").map(|row| row.max);
        assert!(
            worst.reduce(f64::max).is_some_and(|worst| worst < 2e-5),
            "{tolerance}: {:?}",
            c.channels
        );
        // Samples are 5 ms apart.
        let found = c.event_errors.largest_bound();
        assert!(found < 0.011, "{tolerance}: {:?}", c.event_errors);
        assert!(
            c.event_errors.max.is_some_and(|max| max < 5e-3),
            "{tolerance}: {:?}",
            c.event_errors
        );
    }
}

/// The relative velocity includes the rounding of columns and of the times at which a belt moves.
#[test]
fn property_rounded_tables_agree_to_their_resolution() {
    let wiper = kept(&written(WIPER, &[]));
    let six = |value: f64| format!("{value:.5e}");
    let nine = |value: f64| format!("{:.8e}", value as f32);
    let shortest = |value: f64| format!("{}", value as f32);
    let single = |value: f64| format!("{:?}", f64::from(value as f32));
    let prints: [(&str, &dyn Fn(f64) -> String); 4] = [
        ("six digits", &six),
        ("nine", &nine),
        ("shortest", &shortest),
        ("single", &single),
    ];
    for (name, print) in prints {
        let c = wiper.compared(&table(&wiper, &OF_WIPER, 1e-3, |_, value| print(value)), |_| {});
        let found = (c.reference_events, c.candidate_events);
        assert_eq!(found, (29, 29), "{name}: {}", c.verdict);
        agrees(&c);
        assert!(c.unexplained.is_none(), "{name}: {}", c.verdict);
    }
}

/// Positions that were rounded to a millimetre but printed with all digits.
#[test]
fn property_rounded_positions_follow_the_equations() {
    let hairer = kept(&built_in("hairer", &["output.interval=5e-3", "output.around=none"]));
    let print = |name: &str, value: f64| match name {
        "stator_twist_0" => format!("{:?}", (1e3 * value).round() / 1e3),
        _ => format!("{value:?}"),
    };
    let c = hairer.compared(
        &table(&hairer, &["stator_twist_0", "stator_speed_0"], 5e-3, print),
        |_| {},
    );
    agrees(&c);
    assert!(c.unexplained.is_none(), "{}", c.verdict);
}

#[test]
fn property_a_search_for_causes_ends_in_time() {
    let wiper = kept(&written(WIPER, &[]));
    let other = kept(&written(
        WIPER,
        &["rotor.speed.amplitude=0.1515", "friction.scale=0.07"],
    ));
    let text = table(&other, &OF_WIPER, 1e-3, |_, value| format!("{value:?}"));
    let begin = Instant::now();
    let c = wiper.compared(&text, |mapping| mapping.max_wall_time = Some(0.3));
    assert!(begin.elapsed().as_secs_f64() < 10.0);
    let out = c.out_of_time.unwrap();
    assert_eq!(out.allowed, 0.3);
    says(&c.verdict, &["after 0.3 s of wall time", "--max-wall-time"]);
}
