//! `stickslip run` from the user's side: results, messages and files.

use crate::common::cli::{Folder, json, output, refusal, says};
use crate::common::json::*;
use crate::common::rows;
use crate::common::unlocked;
use stickslip::record::{Event, EventKind};
use stickslip::results::Status;

/// Without arguments the case is the paper's brake, and the file paper.h5.
#[test]
fn cli_run_without_a_case_is_the_paper_case() {
    let folder = Folder::new();
    let (stdout, stderr) = folder.ends("run", 0);
    assert_eq!(folder.names(), ["paper.h5"]);
    assert_eq!(stderr, "");
    // The paper's values are next to the results, and the name of the file is at the end.
    says(
        &stdout,
        "95 contact events (48 sticks, 47 slips), 1 kick, 1 corner, 3 stability changes & 6.975001 & 6.989377 & paper.h5",
    );
    says(&folder.ok("run -v"), "cvode-bdf & cvode-adams");
    let wide: Vec<&str> = stdout.lines().filter(|line| line.chars().count() > 80).collect();
    assert_eq!(wide, Vec::<&str>::new());
    assert!(stdout.lines().all(|line| line == line.trim_end()), "{stdout:?}");

    let file = folder.result("paper.h5");
    assert_eq!(file.status(), &Status::Complete);
    let samples = file.samples(0..file.sample_count().unwrap()).unwrap();
    assert!(samples.windows(2).all(|pair| pair[0].time < pair[1].time));
    assert_eq!(samples.first().unwrap().time, 0.0);
    assert_eq!(samples.last().unwrap().time, 10.0);
    let of_kind = |kind| file.events().unwrap().iter().filter(|event| event.kind == kind).count();
    assert_eq!(of_kind(EventKind::Stick), 48);
    assert_eq!(of_kind(EventKind::Slip), 47);
}

#[test]
fn cli_run_of_a_built_in_case() {
    let folder = Folder::new();
    let stdout = folder.clean("run belt-leine");
    assert_eq!(folder.names(), ["belt-leine.h5"]);
    let words = "Block on a belt of Leine and others & 16 contact events (8 sticks, 8 slips) & 12.0010312948 & series &
                 belt-leine.h5";
    says(&stdout, words);
    says(&folder.ok("run belt-leine -v"), &["1.133944676442 m (stator)", "m/s"]);
    assert!(stdout.lines().all(|line| line == line.trim_end()), "{stdout:?}");
    assert_eq!(folder.result("belt-leine.h5").status(), &Status::Complete);
}

#[test]
fn cli_run_sets_keys_of_the_case() {
    let folder = Folder::new();
    let settings = r#"--set 'torsion.damping="100 lbf in s/rad"' --set initial.speed=50 -o x.h5"#;
    folder.ok_short(settings);
    let resolved = folder.result("x.h5").resolved().unwrap();
    assert!(resolved.contains("damping = 11.29848290276167"), "{resolved}");
    assert!(resolved.contains("speed = 50"), "{resolved}");
    let case_text = folder.result("x.h5").case_text().unwrap();
    assert!(case_text.contains("damping = \"200 lbf in s/rad\""), "{case_text}");

    folder.ok(r#"run clutch -q --set 'rotor.torque="90 N m"' -o more.h5"#);
    let file = folder.result("more.h5");
    assert!(file.resolved().unwrap().contains("90"), "{}", file.resolved().unwrap());
    assert!(file.case_text().unwrap().contains("\"80 N m\""));
    // omega_r = 200 + 450 t - 850 t^2 until 0.5 s, where it is 212.5. From then on it falls by 400 rad/s^2.
    let locks = file.events().unwrap()[1].time;
    assert!((locks - (0.5 + 212.5 / 400.0)).abs() < 1e-14, "{locks}");
}

#[test]
fn cli_run_refuses_bad_settings() {
    let folder = Folder::new();
    for [case, setting, words] in rows(
        r#"
        paper  | torsion.dampin=1          | --set torsion.dampin: unknown key; did you mean torsion.damping?
        paper  | torsion.damping="5 N"     | "5 N" is a force
        paper  | torsion.damping=nan       | --set torsion.damping: must be finite
        paper  | torsion.surface_inertia=0 | --set torsion.surface_inertia: must be greater than 0
        paper  | friction.breakaway=0.1    | --set friction.breakaway: must be at least friction.low_speed
        paper  | solver.max_events=0       | --set solver.max_events
        paper  | solver.rtol=0.5           | --set solver.rtol
        paper  | output.interval=1e-12     | samples
        paper  | torsion                   | expected KEY=VALUE
        paper  | =1                        | is not a key
        clutch | rotor.torqe=1             | rotor.torqe: unknown key; did you mean
        clutch | stator.inertia=-1         | stator.inertia
        clutch | rotor.end="welded"        | rotor.end
        clutch | solver.method="paper"     | take another for this case
    "#,
    ) {
        folder.refused(&["run", case, "--set", setting], &[words]);
    }
    assert_eq!(folder.names(), Vec::<String>::new());
}

/// The doubles at the end time are too coarse for the oscillation, or the end time is too short for a step.
#[test]
fn cli_run_refuses_what_doubles_cannot_resolve() {
    let folder = Folder::new();
    for setting in "output.end_time=1e300 output.end_time=1e12 output.end_time=1e-300".split(' ') {
        let spacing = ["--set", "output.interval=1e299", "--set", setting];
        let stderr = refusal(folder.stickslip("run").args(spacing));
        assert!(stderr.contains("--set output.end_time: "), "{setting}: {stderr}");
    }
    folder.refused("run --set solver.rtol=1e-16", &["--set solver.rtol: "]);
}

#[test]
fn cli_run_methods_agree() {
    let folder = Folder::new();
    // A short stop: the paper's from 7 rad/s, with the kick in the unstable window.
    let quick = "--set initial.speed=7 --set actuation.rise_time=0.01 --set 'output={end_time=0.6, interval=0.01}' \
                 --set 'perturbation=[{time=\"instability\", relative_velocity=1e-4}]' -q";
    let mut words: Vec<(&str, Vec<Event>)> = Vec::new();
    for method in ["cvode", "arkode", "cvode-bdf", "cvode-adams", "erk", "esdirk", "series"] {
        let name = format!("{method}.h5");
        let (stdout, stderr) = folder.ends(&format!("run --method {method} -o {name} {quick}"), 0);
        assert_eq!(stdout, "", "{method}");
        println!("{method}: {stderr}");
        let file = folder.result(&name);
        let meta = file.meta().unwrap();
        let named = meta.iter().find(|(key, _)| key == "method").unwrap();
        assert_eq!(named.1.to_string(), method);
        let events = file.events().unwrap().into_iter();
        words.push((method, events.filter(|event| event.kind.in_event_sequence()).collect()));
    }
    let (_, reference) = &words[0];
    assert!(reference.len() > 20);
    for (method, events) in &words[1..] {
        let kinds = |events: &[Event]| events.iter().map(|event| event.kind).collect::<Vec<_>>();
        assert_eq!(kinds(events), kinds(reference), "{method}");
        for (a, b) in events.iter().zip(reference) {
            // The accuracy that single methods promise at their default tolerance.
            assert!((a.time - b.time).abs() < 1e-6, "{method}: {} and {}", a.time, b.time);
        }
    }
}

#[test]
fn cli_run_refuses_an_unknown_method() {
    let folder = Folder::new();
    folder.refused("run --method cvode-bfd", &["did you mean \"cvode-bdf\"?"]);
}

/// Scripts rely on these names.
#[test]
fn cli_run_json_is_one_document_with_known_names() {
    let folder = Folder::new();
    let stdout = folder.clean("run --json");
    let document = json(&stdout);
    let has = |value: &serde_json::Value, names: &str| {
        for name in names.split_whitespace() {
            assert!(value.as_object().unwrap().contains_key(name), "{name} in {stdout}");
        }
    };
    has(
        &document,
        "status file case title method rtol wall_time summary warnings",
    );
    assert_eq!(document["status"], "complete");
    assert_eq!(document["file"], "paper.h5");
    assert_eq!(document["method"], "cvode");
    // The former name of the default.
    let former = json(&folder.ok("run --method auto --json --force"));
    let found = (&former["method"], &former["summary"]);
    assert_eq!(found, (&document["method"], &document["summary"]));
    assert_eq!(document["warnings"], serde_json::json!([]));
    assert!(document.get("error").is_none());
    let summary = &document["summary"];
    has(
        summary,
        "end events sticks slips onset_time final_stick_time first_stick_duration last_stick_duration
         stick_duration_range first_slip_duration last_slip_duration slip_duration_range first_period last_period
         natural_period axial_displacement instability_time growth_exponent e_folds_gained energy_residual
         energy_residual_relative dissipated_energy noise_determined kicks_never_given interrupted work",
    );
    assert_eq!(summary["sticks"], 48);
    assert!(summary["energy_residual_relative"].number() < 1e-12);

    let stdout = folder.clean("run clutch --json");
    let document = json(&stdout);
    let found = (&document["status"], &document["file"]);
    assert_eq!(found, (&"complete".into(), &"clutch.h5".into()));
    assert_eq!(document["summary"]["sticks"], 1);
    assert_eq!(document["summary"]["outcome"]["kind"], "stuck");
    // 11/12 s, rounded.
    let since = document["summary"]["outcome"]["since"].number();
    assert!((since - 11.0 / 12.0).abs() < 1e-14, "{since}");
}

#[test]
fn cli_run_json_of_a_failed_run() {
    let folder = Folder::new();
    let (stdout, stderr) = folder.ends("run --json --set solver.max_events=10", 1);
    let document = json(&stdout);
    assert_eq!(document["status"], "failed");
    assert_eq!(document["file"], "paper.partial.h5");
    let error = document["error"].text();
    assert!(error.contains("event budget of 10"), "{error}");
    assert!(stderr.contains(error), "{stderr}");
}

#[test]
fn cli_run_json_of_wrong_input_is_its_error() {
    let folder = Folder::new();
    let (stdout, stderr) = folder.ends("run --json --set nonsense=1", 2);
    assert_eq!(json(&stdout)["error"]["exit_status"], 2);
    assert!(stderr.contains("nonsense"), "{stderr}");
}

#[test]
fn cli_run_quiet_prints_nothing_but_errors() {
    let folder = Folder::new();
    let (stdout, stderr) = output(&mut folder.short_run("-q"), 0);
    assert_eq!((stdout.as_str(), stderr.as_str()), ("", ""));
    // The warning is suppressed, too.
    for arguments in ["run unperturbed --quiet", "run block --quiet"] {
        let found = folder.ends(arguments, 0);
        assert_eq!(found, (String::new(), String::new()));
    }
    assert_eq!(folder.names(), ["block.h5", "paper.h5", "unperturbed.h5"]);
    let (stdout, stderr) = folder.ends("run -q --force --set solver.max_events=10", 1);
    assert_eq!(stdout, "");
    assert!(stderr.contains("event budget"), "{stderr}");
}

/// The bar is on standard error, and appears in pipes only if it is requested.
#[test]
fn cli_run_progress_is_on_standard_error() {
    let folder = Folder::new();
    for (arguments, shown) in [
        ("run --progress always", true),
        ("run --progress never", false),
        ("run --progress auto", false),
        ("run", false),
        ("run -q", false),
        ("run --json", false),
        ("run --json --progress always", true),
    ] {
        let (stdout, stderr) = folder.ends(arguments, 0);
        for words in [" s of 10 s", "events"] {
            assert_eq!(stderr.contains(words), shown, "{arguments:?}: {stderr}");
        }
        assert!(!stdout.contains(" s of 10 s"), "{arguments:?}");
    }
    folder.refused("run --progress sometimes", "");
}

/// `stickslip run FILE.h5` gives the same numbers to the last bit, and names the case from which the file was made.
#[test]
fn cli_run_repeats_a_result_to_the_last_bit() {
    let folder = Folder::new();
    for (case, set, least) in [
        ("paper", "friction.decay=4.9", 10_000),
        ("groan", "rotor.speed=0.12", 0),
    ] {
        folder.ok(&["run", case, "-q", "--set", set]);
        let [name, repeat] = ["h5", "repeat.h5"].map(|ending| format!("{case}.{ending}"));
        let stdout = folder.ok(&["run", &name]);
        assert!(stdout.contains(&repeat), "{stdout}");
        let (first, second) = (folder.result(&name), folder.result(&repeat));
        assert!(first.events().unwrap().len() > 20);
        let count = first.sample_count().unwrap();
        assert!(count > least);
        assert_eq!(second.sample_count().unwrap(), count);
        // Debug prints doubles so that they read back identically.
        let bits = |rows: &dyn std::fmt::Debug| format!("{rows:?}");
        assert!(bits(&first.samples(0..count).unwrap()) == bits(&second.samples(0..count).unwrap()));
        assert!(bits(&first.events().unwrap()) == bits(&second.events().unwrap()));
        assert!(bits(&first.segments().unwrap()) == bits(&second.segments().unwrap()));
        assert_eq!(first.case_text().unwrap(), second.case_text().unwrap());
        assert_eq!(first.resolved().unwrap(), second.resolved().unwrap());
    }
    let found = folder.names();
    assert_eq!(found, ["groan.h5", "groan.repeat.h5", "paper.h5", "paper.repeat.h5"]);
}

#[test]
fn cli_run_repeats_a_result_with_changes() {
    let folder = Folder::new();
    folder.ok_short("-q -o a.h5");
    folder.ok("run a.h5 -q -o b.h5 --set output.end_time=0.02");
    let times = folder.result("b.h5").column("time", 0..21).unwrap();
    assert_eq!(times.last(), Some(&0.02));
}

/// Without a perturbation a warning names G and a remedy, which works.
#[test]
fn cli_run_unperturbed_warns_that_noise_decides() {
    let folder = Folder::new();
    let (_, stderr) = folder.ends("run unperturbed", 0);
    says(
        &stderr,
        &["warning: ", "rounding error", "G = ", "--set 'perturbation="],
    );
    let remedy = stderr.split("--set '").nth(1).unwrap().split('\'').next().unwrap();
    folder.clean(&["run", "unperturbed", "--force", "--set", remedy]);
    let stdout = folder.ok("run unperturbed --json --force");
    assert_eq!(json(&stdout)["summary"]["noise_determined"], true);
    assert_eq!(json(&stdout)["warnings"].list().len(), 1);
}

/// The run ends before a kick at a time, or before one at the instability. The warning gives a remedy, or what is
/// known.
#[test]
fn cli_run_says_if_it_ends_before_a_kick() {
    let folder = Folder::new();
    let document = folder.json("run --set output.end_time=2");
    assert_eq!(document["summary"]["kicks_never_given"], 1);
    let warning = document["warnings"][0].text();
    says(warning, &["the run ended at t = 2 s, before its time"]);
    let kick = "perturbation=[{time=\"instability\",relative_velocity=1e-4}]";
    let (_, stderr) = folder.ends(&["run", "--force", "--set", "output.end_time=2", "--set", kick], 0);
    says(&stderr, "the run ended at t = 2 s, before sliding lost its stability");
}

/// The paper's values are shown for its own parameters, whatever the method and the samples.
#[test]
fn cli_run_puts_the_paper_beside_its_own_parameters() {
    let folder = Folder::new();
    let case = folder.write("mine.toml", include_str!("../../data/cases/paper.toml"));
    let mine = case.to_str().unwrap();
    for (arguments, beside) in [
        (&["--set", "solver.rtol=1e-12"][..], true),
        (&["--method", "erk"], true),
        (&["--set", "output.end_time=7.5"], true),
        (&[mine], true),
        (&["--set", "friction.decay=4.9"], false),
        (&["paper-si"], false),
    ] {
        let mut command = folder.stickslip("run --force");
        let (stdout, _) = output(command.args(arguments), 0);
        assert_eq!(stdout.contains("6.9896 s"), beside, "{arguments:?}: {stdout}");
    }
}

/// A kick that decays in stable sliding has "died out" in the report, and the effect of a kick of zero is "none".
#[test]
fn cli_run_calls_a_dead_kick_dead() {
    let folder = Folder::new();
    let line = |row: &str, kick: &str| {
        let kick = format!("perturbation=[{{{kick}}}]");
        let stdout = folder.ok(&["run", "-v", "--force", "--set", &kick]);
        let found = stdout.lines().find(|line| line.starts_with(row));
        found.unwrap().to_owned()
    };
    assert!(line("kick above", "time=1e-3, relative_velocity=1e-4").ends_with(", it has died out"));
    assert!(line("e-folds", "time=\"instability\", relative_velocity=0").ends_with("none"));
    assert!(!line("kick above", "time=6.966, relative_velocity=1e-4").contains("died"));
}

/// Without falling friction, sliding never loses its stability.
#[test]
fn cli_run_says_if_a_kick_never_came() {
    let folder = Folder::new();
    let (_, stderr) = folder.ends("run release --set friction.decay=0", 0);
    says(&stderr, &["warning: 1 of the kicks set at the instability never came"]);
}

/// If breakaway is located exactly from the stator torque alone, it is undone at once during the stick-slip. This
/// gives an error, not an endless run.
#[test]
fn cli_run_chattering_is_a_clear_error() {
    let folder = Folder::new();
    let (stdout, stderr) = folder.ends("run paper-si --set contact.breakaway_test=stator", 1);
    assert_eq!(stdout, "");
    let words = ["chattering at t = 6.985", " transitions at one instant", "mode "];
    says(&stderr, &words);
    says(&stderr, &["by the guard \"", "breakaway_test", "paper-si.partial.h5"]);
    assert_eq!(folder.names(), ["paper-si.partial.h5"]);
    let file = folder.result("paper-si.partial.h5");
    let Status::Failed(message) = file.status() else {
        panic!("{:?}", file.status())
    };
    assert!(message.contains("chattering"), "{message}");
    assert!(file.sample_count().unwrap() > 1000);
}

/// The rotor torque alone lags behind the transmitted torque by a thousandth. The event sequence is the same, and its
/// last stick is some microseconds later.
#[test]
fn cli_run_the_rotor_test_moves_the_last_stick_by_microseconds() {
    let folder = Folder::new();
    let word = |test: &str, file: &str| -> Vec<(EventKind, f64)> {
        let setting = format!("contact.breakaway_test={test}");
        folder.ok(&["run", "paper-si", "--set", &setting, "-o", file]);
        let events = folder.result(file).events().unwrap();
        let word = events.iter().filter(|event| event.kind.in_event_sequence());
        word.map(|event| (event.kind, event.time)).collect()
    };
    let (transmitted, rotor) = (word("transmitted", "transmitted.h5"), word("rotor", "rotor.h5"));
    let kinds = |word: &[(EventKind, f64)]| word.iter().map(|event| event.0).collect::<Vec<_>>();
    assert_eq!(kinds(&transmitted), kinds(&rotor));
    let moved = rotor.last().unwrap().1 - transmitted.last().unwrap().1;
    assert!((1e-6..1e-5).contains(&moved.abs()), "{moved:e}");
}

/// The file contains the stop up to the point at which the budget was used up, and says so.
#[test]
fn cli_run_event_budget_is_a_clear_error() {
    let folder = Folder::new();
    let (stdout, stderr) = folder.ends("run --set solver.max_events=10", 1);
    assert_eq!(stdout, "");
    says(
        &stderr,
        "the event budget of 10 transitions is used up at t = 6.97 & solver.max_events",
    );
    let file = folder.result("paper.partial.h5");
    assert!(matches!(file.status(), Status::Failed(_)));
    let events = file.events().unwrap();
    assert_eq!(events.iter().filter(|event| event.kind.in_event_sequence()).count(), 11);
    assert!(folder.names().iter().all(|name| name != "paper.h5"));
}

/// A method whose tolerance does not resolve the run gives a result with a warning.
#[test]
fn cli_run_warns_of_an_energy_balance_that_does_not_close() {
    let folder = Folder::new();
    let loose = ["run", "--method", "cvode-bdf", "--set", "solver.rtol=0.1"];
    let (_, stderr) = folder.ends(&loose, 0);
    says(&stderr, &["warning: the energy balance does not close"]);
}

/// The result of the witness is one line under the table. It is also in JSON and in the file, and can be omitted.
#[test]
fn cli_run_has_a_witness() {
    let folder = Folder::new();
    let attribute = |name: &str| {
        let file = unlocked::open(folder.path("paper.h5")).unwrap();
        let attribute = file.group("witness").ok()?.attr(name).unwrap();
        attribute.read_scalar::<hdf5::types::VarLenUnicode>().ok()
    };
    let stdout = folder.clean("run");
    let kept = stdout.lines().filter(|line| line.starts_with("reference check "));
    let lines: Vec<&str> = kept.collect();
    let [line] = lines[..] else { panic!("{stdout}") };
    let same = "reference check by series: the same 95 contact events, all within ";
    assert!(line.starts_with(same), "{line}");
    assert_eq!(attribute("statement").unwrap().as_str(), line);
    assert_eq!(attribute("testimony").unwrap().as_str(), "same-sequence");

    let witness = &folder.json("run")["witness"];
    assert_eq!(witness["method"], "series");
    assert_eq!(witness["testimony"], "same-sequence");
    assert_eq!(witness["events"], 95);
    assert_eq!(witness["agreeing_events"], 95);
    // The accuracy that both promise by default.
    assert!(witness["largest_difference"].number() < 5e-12, "{witness}");
    // Event by event, including the kick and the corner.
    let column = |name: &str| folder.result("paper.h5").event_column(name).unwrap();
    let (own, other) = (column("time"), column("witness_time"));
    assert_eq!((own.len(), other.len()), (100, 100));
    assert!(own.iter().zip(&other).all(|(own, other)| (own - other).abs() < 1e-9));
    assert!(own != other);

    let stdout = folder.ok("run --no-witness");
    assert!(!stdout.contains("reference check"), "{stdout}");
    assert!(attribute("statement").is_none());
    assert!(folder.result("paper.h5").event_column("witness_time").is_err());
    let stdout = folder.ok("run --no-witness --json");
    assert!(json(&stdout).get("witness").is_none(), "{stdout}");
}

/// A mass that is pushed until its contact slips for some microseconds.
const SWUNG: &str = r#"
title = "A slip of microseconds"
motion = "translation"
rotor = { end = "fixed", inertia = [59.16, 22.72], stiffness = [118.4, 15810.0], damping = [7.066, 84.22] }
contact = { normal_force = 22.047241897583 }
friction = { law = "exponential", breakaway = 0.5081, low_speed = 0.5081, high_speed = 0.2287, decay = 70.18 }
output = { end_time = 4.7, interval = 0.0671 }
[stator]
end = "fixed"
inertia = 10.48
stiffness = 83710.0
damping = 6.547
viscous = [13.48]
torque = { profile = "sine", amplitude = 51.4, angular_frequency = 0.4212, phase = 1.511 }
torque_on = 0
"#;

/// With a loose tolerance, digits are lost in a slip that ends before the method has left its first order. The run
/// repeats itself with a smaller tolerance, and says so. If absolute tolerances are set, they stay, so that nothing
/// helps. Then there is a warning.
#[test]
fn cli_run_repeats_itself_where_its_witness_does_not_agree() {
    let folder = Folder::new();
    folder.write("swung.toml", SWUNG);
    let said = folder.json("run swung.toml --set solver.rtol=1e-7");
    let (witness, repeated) = (&said["witness"], said["witness"]["repeated"].text());
    says(
        repeated,
        "repeated with solver.rtol=1e-10 & at first: reference check by series: 5 events for 5; number 5 & s away",
    );
    let found = (&said["rtol"], &said["warnings"]);
    assert_eq!(found, (&1e-10.into(), &serde_json::json!([])));
    assert_eq!(witness["testimony"], "same-sequence");
    let file = unlocked::open(folder.path("swung.h5")).unwrap();
    let number = |group: &str, name: &str| file.group(group).unwrap().attr(name).unwrap().read_scalar::<f64>();
    assert_eq!(number("meta", "rtol").unwrap(), 1e-10);
    drop(file);
    folder.ok("check swung.h5");
    // Without a witness, or with another method, the run uses the requested tolerance.
    let said = folder.json("run swung.toml --set solver.rtol=1e-7 --no-witness --force");
    assert_eq!(said["rtol"], 1e-7);
    let said = folder.json("run swung.toml --method cvode-adams --set solver.rtol=1e-7 --force");
    let found = (&said["rtol"], &said["witness"]["repeated"]);
    assert_eq!(found, (&1e-7.into(), &serde_json::Value::Null));

    let coarse =
        "run belt-leine --strict --set solver.atol_twist=1e-3 --set solver.atol_rate=1e-3 --set solver.atol_speed=1e-3";
    let (_, stderr) = folder.ends(coarse, 1);
    says(&stderr, "another method, series, & stickslip certify");
}

/// The witness shares no solver with the run, linear or nonlinear: it is `cvode`, or `series` for a run with `cvode`.
/// If the onset is noise, no warning is raised.
#[test]
fn cli_run_witnesses_differ_where_they_must() {
    let folder = Folder::new();
    let witness = |arguments: &str| folder.json(&format!("run {arguments} --force"))["witness"].clone();
    for [arguments, method] in rows(
        "
        --method cvode              | series
        belt-coulomb                | series
        belt-coulomb --method series | cvode
        belt-coulomb --method cvode | series
        belt-leine --method erk     | cvode
        belt-leine --method cvode   | series
    ",
    ) {
        let said = witness(arguments);
        let found = (&said["method"], &said["testimony"]);
        assert_eq!(found, (&method.into(), &"same-sequence".into()));
        assert!(said["statement"].text().chars().count() <= 80, "{said}");
    }
    // A single event is named in the singular.
    for [end, words] in rows(
        "
        0.1  | reference check by series: no contact event either
        0.21 | reference check by series: the same contact event, within
        1    | reference check by series: the same 3 contact events, all within
    ",
    ) {
        let said = witness(&format!("belt-coulomb --set output.end_time={end}"));
        says(&said["statement"].to_string(), &[words]);
    }
    let noise = witness("unperturbed");
    assert_eq!(noise["testimony"], "noise-determined", "{noise}");
    assert!(noise["statement"].text().contains("amplified rounding"), "{noise}");
    let paper = witness("--method paper");
    assert_eq!(paper["testimony"], "sequence-differs", "{paper}");
    for said in [noise, paper] {
        assert!(said["statement"].text().chars().count() <= 80, "{said}");
    }
}

/// If nothing damps the torsional oscillation, a witness would take seconds, and is omitted. It is not started if the
/// run's steps show this in advance. Without the segments of a run this has to be found out by running.
#[test]
fn cli_run_leaves_a_long_witness_out() {
    use stickslip::analysis::witness::{Sequence, Testimony, witness};
    let folder = Folder::new();
    let undamped = ["torsion.damping=0", "output.window=[]", "output.around=none"];
    let mut run = folder.stickslip("run paper-si --method series --json");
    undamped.iter().for_each(|setting| {
        run.args(["--set", setting]);
    });
    let (stdout, _) = output(&mut run, 0);
    let said = &json(&stdout)["witness"];
    assert_eq!(said["testimony"], "left-out", "{said}");
    let expected = "reference check by cvode: left out, as it takes more than a second";
    assert_eq!(said["statement"], expected);
    // It was not started, so that it has no events.
    assert_eq!(said["events"], 0, "{said}");
    assert!(said["largest_difference"].is_null(), "{said}");

    use stickslip::case::{Case, CaseSource, Override};
    let overrides = ["solver.method=series", undamped[0], undamped[1]].map(|text| Override::parse(text).unwrap());
    let case = Case::read(&CaseSource::built_in("paper-si").unwrap(), &overrides).unwrap();
    let mut sequence = Sequence::default();
    for event in folder.result("paper-si.h5").events().unwrap() {
        stickslip::record::Recorder::event(&mut sequence, &event).unwrap();
    }
    let given_up = witness(&case, &sequence, false, &|| false).expect("nobody stops it");
    assert_eq!(given_up.testimony, Testimony::LeftOut);
    assert_eq!(given_up.statement, said["statement"].text());
}

#[test]
fn cli_a_chirp_runs_and_wrong_ones_are_refused() {
    const CHIRP: &str =
        "profile=\"chirp\", amplitude=9, start_frequency=\"0.1 Hz\", end_frequency=0.4, duration=\"20 s\"";
    let folder = Folder::new();
    let set = |signal: &str| format!("rotor.torque={{{signal}}}");
    folder.ok(&["run", "block", "--set", &set(CHIRP), "-o", "chirp.h5", "-q"]);
    for [old, new, words] in rows(
        r#"
        start_frequency="0.1 Hz", | - | rotor.torque.start_frequency & missing & Hz
        end_frequency=0.4,   | -             | rotor.torque.end_frequency & missing & Hz
        , duration="20 s"    | -             | rotor.torque.duration & missing & in s
        amplitude=9,         | -             | rotor.torque.amplitude & missing
        "20 s"               | 0             | rotor.torque.duration & must be greater than 0
        "20 s"               | 1e-14         | rotor.torque.duration & must be at least 1e-12 s
        0.4                  | -0.4          | rotor.torque.end_frequency & must be greater than 0
        0.4                  | "3 rad/s"     | rotor.torque.end_frequency & frequency, Hz & angular velocity
        end_frequency        | end_frequenzy | rotor.torque.end_frequenzy & did you mean end_frequency?
        duration | frequency=1, duration     | rotor.torque.frequency & belongs to profile "sine" or "cosine"
        "chirp"              | "chrip"       | rotor.torque.profile & did you mean "chirp"?
    "#,
    ) {
        assert!(CHIRP.contains(old));
        let new = if new == "-" { "" } else { new };
        folder.refused(&["run", "block", "--set", &set(&CHIRP.replace(old, new))], words);
    }
    let words = "a chirp drives it & no motion repeats & end_frequency";
    folder.refused(&["cycle", "block", "--set", &set(CHIRP)], words);
}
