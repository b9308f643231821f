//! `stickslip` with cases of two trains, as its user sees it.

use crate::common::cli::{Folder, json, output, says, send};
use stickslip::results::Status;

#[test]
fn cli_run_of_a_built_in_case_of_trains() {
    let folder = Folder::new();
    let (stdout, stderr) = output(&mut folder.stickslip("run belt-leine"), 0);
    assert_eq!(stderr, "");
    assert_eq!(folder.names(), ["belt-leine.h5"]);
    says(
        &stdout,
        &[
            "Block on a belt of Leine and others",
            "16 (8 sticks, 8 slips)",
            "12.0010312948",
            "1.133944676442 m (stator)",
            "m/s",
            "series",
            "belt-leine.h5",
        ],
    );
    assert!(stdout.lines().all(|line| line == line.trim_end()), "{stdout:?}");
    assert_eq!(folder.result("belt-leine.h5").status(), &Status::Complete);
}

#[test]
fn cli_run_of_trains_as_json() {
    let folder = Folder::new();
    let (stdout, stderr) = output(&mut folder.stickslip("run clutch --json"), 0);
    assert_eq!(stderr, "");
    let document = json(&stdout);
    assert_eq!(document["status"], "complete");
    assert_eq!(document["file"], "clutch.h5");
    assert_eq!(document["summary"]["sticks"], 1);
    assert_eq!(document["summary"]["outcome"]["kind"], "stuck");
    // 11/12 s, rounded.
    let since = document["summary"]["outcome"]["since"].as_f64().unwrap();
    assert!((since - 11.0 / 12.0).abs() < 1e-14, "{since}");
}

#[test]
fn cli_quiet_run_of_trains_prints_nothing() {
    let folder = Folder::new();
    let printed = output(&mut folder.stickslip("run block --quiet"), 0);
    assert_eq!(printed, (String::new(), String::new()));
    assert_eq!(folder.names(), ["block.h5"]);
}

/// A setting of a key of trains changes the run; the file keeps the case as it was given, and as it was run.
#[test]
fn cli_run_sets_keys_of_trains() {
    let folder = Folder::new();
    let settings = [
        "run",
        "clutch",
        "-q",
        "--set",
        "rotor.torque=\"90 N m\"",
        "-o",
        "more.h5",
    ];
    folder.ok(&settings);
    let file = folder.result("more.h5");
    assert!(file.resolved().unwrap().contains("90"), "{}", file.resolved().unwrap());
    assert!(file.case_text().unwrap().contains("\"80 N m\""));
    // omega_r = 200 + 450 t - 850 t^2 to 0.5 s, where it is 212.5, and from then on it falls by 400 rad/s in a second.
    let events = file.events().unwrap();
    assert!(
        (events[1].time - (0.5 + 212.5 / 400.0)).abs() < 1e-14,
        "{}",
        events[1].time
    );
}

#[test]
fn cli_run_refuses_bad_keys_of_trains() {
    let folder = Folder::new();
    for (setting, words) in [
        ("rotor.torqe=1", "rotor.torqe: unknown key; did you mean"),
        ("stator.inertia=-1", "stator.inertia"),
        ("rotor.end=\"welded\"", "rotor.end"),
        ("solver.method=\"paper\"", "take another for this case"),
    ] {
        folder.refused(&["run", "clutch", "--set", setting], &[words]);
        assert_eq!(folder.names(), Vec::<String>::new());
    }
}

/// A result file has all that its run needs.
#[test]
fn cli_a_run_of_trains_is_repeated_from_its_file() {
    let folder = Folder::new();
    folder.ok("run groan -q --set rotor.speed=0.12");
    folder.ok("run groan.h5 -q -o again.h5");
    let (first, again) = (folder.result("groan.h5"), folder.result("again.h5"));
    assert!(first.events().unwrap().len() > 20);
    assert_eq!(first.events().unwrap(), again.events().unwrap());
    let samples = |file: &stickslip::results::ResultFile| file.samples(0..file.sample_count().unwrap()).unwrap();
    assert_eq!(samples(&first), samples(&again));
}

/// `check` finds nothing, and `inspect` lists the further columns in the units of the motion.
#[test]
fn cli_files_of_trains_are_sound() {
    let folder = Folder::new();
    for case in ["belt-leine", "drill-string", "groan"] {
        folder.ok(&["run", case, "-q"]);
        let file = format!("{case}.h5");
        let (stdout, stderr) = output(&mut folder.stickslip(&["check", &file]), 0);
        assert!(stdout.contains("all checksums agree"), "{stdout}");
        assert_eq!(stderr, "");
    }
    folder.ok("run lugre-slider -q");
    let unit_of = |file: &str, name: &str| {
        let stdout = folder.ok(&["inspect", file]);
        let row = stdout.lines().find(|line| line.split_whitespace().next() == Some(name));
        let row = row.unwrap_or_else(|| panic!("{name} in {stdout}")).to_owned();
        row.split("  ")
            .map(str::trim)
            .filter(|cell| !cell.is_empty())
            .nth(2)
            .unwrap()
            .to_owned()
    };
    for (file, name, unit) in [
        ("belt-leine.h5", "stator_twist_0", "m"),
        ("belt-leine.h5", "stator_speed_0", "m s-1"),
        ("belt-leine.h5", "friction_torque", "N"),
        ("drill-string.h5", "rotor_twist_0", "rad"),
        ("drill-string.h5", "rotor_twist_rate_0", "rad s-1"),
        ("drill-string.h5", "rotor_speed_1", "rad s-1"),
        ("drill-string.h5", "friction_torque", "N m"),
        ("lugre-slider.h5", "bristle_deflection", "m"),
    ] {
        assert_eq!(unit_of(file, name), unit, "{name} of {file}");
    }
}

#[test]
fn cli_certify_trains() {
    let folder = Folder::new();
    let (stdout, stderr) = output(&mut folder.stickslip("certify belt-leine"), 0);
    assert_eq!(stderr, "");
    assert_eq!(folder.names(), ["belt-leine.certified.h5"]);
    says(
        &stdout,
        &[
            "by the oracle",
            "9.295999525480154883358229545972",
            "cvode-adams",
            "agreeing",
            "what moves the period of the attractor",
            "friction.breakaway, 1",
            "stator_speed_0       m s-1",
        ],
    );
    // Of a file, and as a document.
    folder.ok("run clutch -q");
    let document = folder.json("certify clutch.h5");
    assert_eq!(document["converged"], true);
    assert_eq!(document["uncertainty_by"], "oracle");
    assert_eq!(document["events"].as_array().unwrap().len(), 2);
    assert!(document["digits"].as_u64().unwrap() >= 14, "{}", document["digits"]);
    // It locks at 11/12 s: the engine, of 200 rad/s at first, would do so later by 1/450 s for each rad/s more.
    assert_eq!(document["result"]["of"], "final-stick");
    let numbers = document["sensitivity"].as_array().unwrap();
    let speed = numbers
        .iter()
        .find(|number| number["parameter"] == "initial.speed")
        .unwrap();
    let slope = speed["result"]["slope"].as_f64().unwrap();
    assert!((slope - 1.0 / 450.0).abs() < 1e-11, "{slope}");
    assert_eq!(speed["half_last_digit"], 0.5);
    let shift = speed["result"]["plus"]["shift"].as_f64().unwrap();
    assert!((shift - 0.5 / 450.0).abs() < 1e-12, "{shift}");
    let channels = document["channels"].as_array().unwrap();
    let band = |name: &str| {
        let channel = channels.iter().find(|channel| channel["name"] == name).unwrap();
        channel["band"].as_f64().unwrap()
    };
    assert!(band("rotor_speed_0") > 0.0 && band("rotor_speed_0") < 1e-9);
    assert_eq!(document["stretches"].as_array().unwrap().len(), 3);
}

/// The file of a certified run says the same, and of what; that of a run what another method makes of the case.
#[test]
fn cli_certified_files_of_trains_have_sensitivities_bands_and_a_witness() {
    let folder = Folder::new();
    folder.ok("certify belt-coulomb -q");
    let path = folder.path("belt-coulomb.certified.h5");
    let file = hdf5::File::open(&path).unwrap();
    let text = |group: &str, name: &str| {
        let attribute = file.group(group).unwrap().attr(name).unwrap();
        let value: hdf5::types::VarLenUnicode = attribute.read_scalar().unwrap();
        value.to_string()
    };
    assert_eq!(text("sensitivity", "of"), "attractor-period");
    let parameters = text("sensitivity", "parameters");
    let parameters: Vec<&str> = parameters.split(", ").collect();
    let slopes = file.dataset("sensitivity/time_sensitivity").unwrap();
    let uncertainties = file.dataset("sensitivity/time_sensitivity_uncertainty").unwrap();
    assert_eq!(slopes.shape(), [29, parameters.len()]);
    assert_eq!(uncertainties.shape(), slopes.shape());
    assert!(parameters.contains(&"contact.normal_force"), "{parameters:?}");
    let band = file.dataset("certificate/band_stator_speed_0").unwrap();
    assert_eq!(band.shape(), [30]);
    let rate = file.dataset("certificate/rate_stator_speed_0").unwrap();
    assert_eq!(rate.shape(), [30]);
    drop(file);
    folder.ok("check belt-coulomb.certified.h5");
    folder.ok("run groan -q");
    let file = hdf5::File::open(folder.path("groan.h5")).unwrap();
    let witness = file.group("witness").unwrap();
    let said: hdf5::types::VarLenUnicode = witness.attr("testimony").unwrap().read_scalar().unwrap();
    assert_eq!(said.as_str(), "same-sequence");
    drop(file);
    folder.ok("check groan.h5");
}

/// More digits than the run has are exit status 1, with what helps; the certificate is written all the same.
#[test]
fn cli_certify_says_where_digits_are_missing() {
    let folder = Folder::new();
    let asked = ["certify", "belt-leine", "--digits", "14"];
    let (_, stderr) = output(&mut folder.stickslip(&asked), 1);
    says(&stderr, &["14 digits were asked for", "series"]);
    assert_eq!(folder.names(), ["belt-leine.certified.h5"]);
    // And the advice is true.
    let advised = [
        "certify",
        "belt-leine",
        "-q",
        "--digits",
        "14",
        "--set",
        "solver.method=\"series\"",
    ];
    folder.ok(&advised);
}

#[test]
fn cli_certify_of_trains_has_no_figure() {
    let folder = Folder::new();
    folder.refused("certify belt-leine --figure onset.svg", &["--figure"]);
    assert_eq!(folder.names(), Vec::<String>::new());
}

/// A case of trains of one's own goes through every command.
#[test]
fn cli_every_command_takes_trains() {
    let folder = Folder::new();
    folder.write(
        "belt.toml",
        stickslip::case::CaseSource::built_in("belt-coulomb").unwrap().text,
    );
    folder.write(
        "study.toml",
        "case = \"belt.toml\"\n[[axis]]\nkey = \"rotor.speed\"\nvalues = [0.08, 0.1]\n",
    );
    folder.write(
        "precision.toml",
        "case = \"belt.toml\"\n[[series]]\nmethods = [\"auto\", \"series\"]\ntolerances = [1e-8, 1e-10]\n",
    );
    for arguments in [
        &["run", "belt.toml", "-q"][..],
        &["certify", "belt.h5"],
        &["check", "belt.certified.h5"],
        &["inspect", "belt.certified.h5"],
        &["modes", "belt.toml"],
        &["plot", "belt.h5"],
        &["plot", "belt.h5", "--html", "belt.html"],
        &["compare", "belt.h5", "belt.certified.h5"],
        &["sweep", "study.toml"],
        &["work-precision", "precision.toml"],
        &["run", "belt.certified.h5"],
    ] {
        let (_, stderr) = output(&mut folder.stickslip(arguments), 0);
        assert!(!stderr.contains("error"), "{arguments:?}: {stderr}");
    }
}

#[cfg(unix)]
#[test]
fn cli_an_interrupted_run_of_trains_keeps_what_it_has() {
    let folder = Folder::new();
    // Minutes of small steps.
    let mut child = folder.start("run groan --method erk --set solver.max_step=1e-8 --set output.interval=1e-6");
    // Until it is at work; a file of this size has rows.
    folder.wait_for(&mut child, "groan.partial.h5", 50_000);
    send("INT", child.id());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(
        folder
            .names()
            .iter()
            .filter(|name| name.ends_with(".h5"))
            .collect::<Vec<_>>(),
        ["groan.partial.h5"]
    );
    let file = folder.result("groan.partial.h5");
    assert_eq!(file.status(), &Status::Interrupted);
    assert!(file.sample_count().unwrap() > 0);
}

/// The witness shares no solver with the run, be it linear or not: `cvode`, or `series` of a run by `cvode`.
#[test]
fn cli_a_witness_of_trains_is_another_method() {
    let folder = Folder::new();
    for (case, method, witness) in [
        ("belt-coulomb", "auto", "cvode"),
        ("belt-coulomb", "series", "cvode"),
        ("belt-coulomb", "cvode", "series"),
        ("belt-leine", "erk", "cvode"),
        ("belt-leine", "cvode", "series"),
    ] {
        let said = &folder.json(&["run", case, "--method", method, "--force"])["witness"];
        assert_eq!(said["method"], witness, "{case} by {method}: {said}");
        assert_eq!(said["testimony"], "same-sequence", "{case} by {method}: {said}");
    }
}

#[test]
fn cli_a_witness_of_trains_counts_one_event_as_one() {
    let folder = Folder::new();
    for (end, words) in [
        ("0.1", "witness cvode: no event either"),
        ("0.21", "witness cvode: the same event, within "),
        ("1", "witness cvode: the same 3 events, all within "),
    ] {
        let end = format!("output.end_time={end}");
        let arguments = ["run", "belt-coulomb", "--set", &end, "--json", "--force"];
        let stdout = folder.ok(&arguments);
        let said = json(&stdout)["witness"]["statement"].to_string();
        assert!(said.contains(words), "{said}");
    }
}
