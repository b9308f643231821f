//! `stickslip certify`.

use crate::common::cli::{Folder, json, says};
use crate::common::unlocked;
use stickslip::results::{Overwrite, Reservation};

/// A short slide from a low speed with a kick, which sticks and slips within a quarter of a second.
const QUICK: &[&str] = &[
    "--set",
    "initial.speed=3",
    "--set",
    "actuation={profile=\"ramp\", force=\"2225.0 N\", rise_time=0.02}",
    "--set",
    "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
    "--set",
    "output={end_time=0.4, interval=0.01}",
];

/// A key that is set by `more` replaces that of the quick case: none is set twice.
fn certify<'a>(case: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let key = |setting: &str| setting.split('=').next().unwrap_or_default().to_owned();
    let quick = QUICK
        .chunks(2)
        .filter(|pair| more.iter().all(|other| key(other) != key(pair[1])));
    let quick = quick.flatten().copied();
    ["certify", case]
        .into_iter()
        .chain(quick)
        .chain(more.iter().copied())
        .collect()
}

/// The JSON reader of the test does not round to the nearest double.
fn same(stored: f64, document: &serde_json::Value) -> bool {
    let number = document.as_f64().expect("a number");
    (stored - number).abs() <= 4.0 * f64::EPSILON * number.abs()
}

#[test]
fn cli_certify_says_the_same_in_table_json_and_file() {
    let folder = Folder::new();
    let (table, stderr) = folder.ends(&certify("paper-si", &["--digits", "9", "-v"]), 0);
    assert_eq!(stderr, "");
    assert_eq!(folder.names(), ["paper-si.certified.h5"]);
    says(
        &table,
        "converged: every event within & growth exponent G & cvode-bdf & cvode-adams & erk & at a fixed time &
         what moves the final stick & kick above the methods' own noise",
    );
    let document = folder.ok(&certify("paper-si", &["--json"]));
    let document = json(&document);
    assert_eq!(document["verdict"], "converged");
    let events = document["events"].as_array().unwrap();
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    let dataset = file.dataset("events/time_uncertainty").unwrap();
    let stored = dataset.read_raw::<f64>().unwrap();
    assert_eq!(stored.len(), events.len());
    for (stored, event) in stored.iter().zip(events) {
        assert!(same(*stored, &event["uncertainty"]), "{event}: {stored:e}");
    }
    let stretches = document["stretches"].as_array().unwrap();
    assert_eq!(stretches.len(), events.len() + 1);
    let read = |name: &str| {
        file.dataset(&format!("certificate/{name}"))
            .unwrap()
            .read_raw::<f64>()
            .unwrap()
    };
    let (band, rate, times) = (
        read("band_phi2_dot"),
        read("rate_phi2_dot"),
        read("stretch_time_uncertainty"),
    );
    let mut largest = [0.0_f64; 2];
    for (index, stretch) in stretches.iter().enumerate() {
        if stretch["converged"] == false {
            assert!(band[index].is_nan(), "{stretch}");
            assert!(stretch["bands"]["phi2_dot"].is_null(), "{stretch}");
            continue;
        }
        assert!(same(band[index], &stretch["bands"]["phi2_dot"]), "{stretch}");
        assert!(same(rate[index], &stretch["rates"]["phi2_dot"]), "{stretch}");
        let fixed = band[index] + rate[index] * times[index];
        largest = [largest[0].max(band[index]), largest[1].max(fixed)];
    }
    let channels = document["channels"].as_array().unwrap();
    let speed = channels.iter().find(|c| c["name"] == "phi2_dot").unwrap();
    assert!(same(largest[0], &speed["band"]), "{speed}");
    assert!(same(largest[1], &speed["at_fixed_time"]), "{speed}");
    let force = document["sensitivity"].as_array().unwrap().iter();
    let force = force.clone().find(|p| p["parameter"] == "actuation.force").unwrap();
    // The value comes from --set.
    assert_eq!(force["half_last_digit"], 0.05, "{force}");
    let table = file.dataset("sensitivity/time_sensitivity").unwrap();
    let parameters = document["sensitivity"].as_array().unwrap();
    assert_eq!(table.shape(), [events.len(), parameters.len()]);
    let values = table.read_raw::<f64>().unwrap();
    for (column, parameter) in parameters.iter().enumerate() {
        let last = values[(events.len() - 1) * parameters.len() + column];
        assert!(
            same(last, &parameter["time_sensitivity"][events.len() - 1]),
            "{parameter}"
        );
    }
}

#[test]
fn cli_certify_a_file_is_certified_as_it_is() {
    let folder = Folder::new();
    let run: Vec<&str> = [&["run", "paper-si", "-q", "-o", "mine.h5"], QUICK].concat();
    folder.ok(&run);
    let before = folder.read("mine.h5");
    folder.ok("certify mine.h5 -q");
    assert_eq!(folder.names(), ["mine.certified.h5", "mine.h5"]);
    assert_eq!(folder.read("mine.h5"), before);
    // A certified file is a result file, and can be certified again under another name.
    folder.ok("inspect mine.certified.h5");
    folder.ok("certify mine.certified.h5 -q -o again.h5");
    folder.refused("certify mine.h5 -q -o mine.h5", &["mine.h5"]);
    folder.refused("certify mine.h5 --set friction.decay=4", &["--set"]);
}

#[test]
fn cli_certify_with_the_oracle_prints_exact_events() {
    let folder = Folder::new();
    let document = folder.ok(&certify("paper-si", &["--oracle", "--json", "--digits", "28"]));
    let document = json(&document);
    let exact = document["oracle"]["events"].as_array().unwrap();
    let events = document["events"].as_array().unwrap();
    let errors = document["oracle"]["true_errors"].as_array().unwrap();
    assert_eq!(exact.len(), events.len());
    for (index, event) in events.iter().enumerate() {
        assert_eq!(exact[index]["kind"], event["kind"]);
        let error = errors[index].as_f64().unwrap();
        assert!(
            error.abs() <= event["uncertainty"].as_f64().unwrap(),
            "{event}: {error:e}"
        );
    }
    let stick = exact.iter().find(|e| e["kind"] == "stick").unwrap()["time"]
        .as_str()
        .unwrap();
    assert!(stick.len() >= 28, "{stick}");
    // The uncertainty is the distance plus the error of the exact solution. The methods' own uncertainty is given,
    // too; it is larger.
    assert_eq!(document["contradiction"], serde_json::Value::Null);
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    let read = |name: &str| file.dataset(name).unwrap().read_raw::<f64>().unwrap();
    let (stored, by_ladder) = (read("events/time_uncertainty"), read("certificate/ladder_uncertainty"));
    let true_errors = read("certificate/true_error");
    for (index, event) in events.iter().enumerate() {
        assert_eq!(event["verdict"], "converged");
        let error = event["true_error"].as_f64().unwrap();
        let own = exact[index]["error"].as_f64().unwrap();
        // The 28 digits of the exact solution are more than a double shows.
        assert!(own < 1e-27 && exact[index]["digits"].as_u64().unwrap() >= 28);
        assert!(same(error.abs() + own, &event["uncertainty"]), "{event}");
        assert!(same(stored[index], &event["uncertainty"]) && same(by_ladder[index], &event["ladder_uncertainty"]));
        assert!(same(true_errors[index], &event["true_error"]), "{event}");
        assert!(by_ladder[index] >= stored[index], "{event}");
    }
}

/// The default run of a short brake has about 12 digits. `series` has two more, which the ladder cannot show.
#[test]
fn cli_certify_the_oracle_has_the_last_word() {
    let folder = Folder::new();
    let series = certify("paper-si", &["--set", "solver.method=\"series\"", "--digits", "14"]);
    let (_, stderr) = folder.ends(&series, 1);
    assert!(stderr.contains("14 digits were asked for"), "{stderr}");
    let table = folder.ok(&[series.as_slice(), &["--oracle", "-v"]].concat());
    says(
        &table,
        "converged: every event within & of the exact one & by the methods, s",
    );
}

/// Without a kick the onset is noise to every method except `series`, which the exact solution confirms. The
/// recommended method is therefore `series`, and it fulfils what the advice promises.
#[test]
fn cli_certify_tries_its_advice_before_it_gives_it() {
    let folder = Folder::new();
    let without = [
        "certify",
        "unperturbed",
        "--set",
        "output.window=[]",
        "--set",
        "output.around=none",
        "--oracle",
        "--digits",
        "12",
    ];
    let (_, stderr) = folder.ends(&without, 1);
    let advice = "--set 'solver.method=\"series\"' has ";
    says(&stderr, &["noise-determined", advice]);
    let with = [
        without.as_slice(),
        &["--set", "solver.method=\"series\"", "-q", "--force"],
    ]
    .concat();
    folder.ok(&with);
}

#[test]
fn cli_certify_refuses_what_it_cannot_do() {
    let folder = Folder::new();
    let fails = |arguments: &[&str], status: i32, words: &[&str]| {
        let (_, stderr) = folder.ends(arguments, status);
        says(&stderr, words);
    };
    fails(&["certify", "paper", "--digits", "17"], 2, &["--digits 17", "--oracle"]);
    fails(&["certify", "paper", "--digits", "0"], 2, &["--digits 0"]);
    // More digits than the conditioning of a converged run allows.
    fails(
        &certify("paper-si", &["--digits", "16"]),
        1,
        &["16 digits", "rounding to double precision"],
    );
    // With noise, the exit status is 1 only if digits were requested.
    let noise = &[
        "--set",
        "perturbation=[]",
        "--set",
        "initial.speed=6",
        "--set",
        "output.end_time=0.8",
        "--force",
    ];
    let without = certify("paper-si", noise);
    let table = folder.ok(&without);
    assert!(table.contains("noise-determined"), "{table}");
    fails(
        &[without.as_slice(), &["--digits", "3"]].concat(),
        1,
        &["noise-determined", "Set a perturbation"],
    );
    fails(
        &certify("paper-si", &["--set", "solver.max_events=3", "--force"]),
        1,
        &["event budget", "solver.max_events"],
    );
    // A file that has lost its case.
    folder.ok(&[&["run", "paper-si", "-q", "-o", "lost.h5"], QUICK].concat());
    let lost = unlocked::open_rw(folder.path("lost.h5")).unwrap();
    lost.unlink("input/resolved").unwrap();
    lost.close().unwrap();
    fails(
        &["certify", "lost.h5"],
        2,
        &["lost.h5", "/input/resolved", "certify the case itself"],
    );
    folder.write("not.h5", b"\x89HDF\r\n\x1a\n nothing else");
    fails(&["certify", "not.h5"], 2, &["not.h5"]);
    fails(&["certify", "belt-leine", "--figure", "onset.svg"], 2, &["--figure"]);
    // An empty file is no HDF5 file, whatever its name.
    folder.write("empty.h5", b"");
    fails(&["certify", "empty.h5"], 2, &["empty.h5", "not an HDF5 file"]);
    assert!(
        folder.names().iter().all(|name| !name.contains("uncertified")),
        "{:?}",
        folder.names()
    );
}

/// While another process writes a file, a certificate into it is refused as a run is.
#[test]
fn cli_certify_into_a_file_that_is_being_written() {
    let folder = Folder::new();
    folder.ok("run block -q -o run.h5");
    folder.ok("cycle belt-exponential -q -o cycle.h5");
    let place = Reservation::take(&folder.path("x.h5"), Overwrite::OwnResults, &[]).unwrap();
    for command in [
        "certify run.h5 -o x.h5",
        "certify block -o x.h5",
        "certify cycle.h5 -o x.h5",
    ] {
        folder.refused(command, "x.partial.h5: another run is writing this file & -o");
    }
    drop(place);
    assert_eq!(folder.names(), ["cycle.h5", "run.h5"]);
    folder.ok("certify run.h5 -q -o x.h5");
    assert_eq!(folder.names(), ["cycle.h5", "run.h5", "x.h5"]);
}

#[test]
fn cli_certify_draws_the_onset_against_the_tolerance() {
    let folder = Folder::new();
    let figure = ["--json", "--figure", "onset.svg"];
    let document = folder.ok(&certify("paper-si", &figure));
    let document = json(&document);
    assert_eq!(folder.names(), ["onset.svg", "paper-si.certified.h5"]);
    assert!(folder.path("onset.svg").metadata().unwrap().len() > 0);
    let events = document["events"].as_array().unwrap();
    let certified = events.iter().find(|e| e["kind"] == "stick").unwrap()["time"]
        .as_f64()
        .unwrap();
    let onsets = document["onsets"].as_array().unwrap();
    let kicked: Vec<_> = onsets.iter().filter(|o| o["kicked"] == true).collect();
    // The same number of runs without the kick, over the same methods and tolerances.
    assert_eq!(onsets.len(), 2 * kicked.len());
    for onset in kicked {
        // The accuracy that every method promises at the default tolerance.
        if onset["rtol"].as_f64().unwrap() <= 1e-10 {
            let distance = (onset["first_stick"].as_f64().unwrap() - certified).abs();
            assert!(distance < 1e-6, "{onset}: {distance:e}");
        }
    }
    // Without the kick sliding continues for longer.
    for onset in onsets.iter().filter(|o| o["kicked"] == false) {
        assert!(onset["first_stick"].as_f64().unwrap() > certified, "{onset}");
    }
    folder.refused(&certify("paper-si", &["--figure", "onset.tiff"]), "onset.tiff & .svg");
}

/// The effect of half a last digit on the final stick is the same in table, JSON and file, and in a changed run.
#[test]
fn cli_certify_reruns_half_a_last_digit() {
    let folder = Folder::new();
    let (table, stderr) = folder.ends(&certify("paper-si", &["-v"]), 0);
    assert_eq!(stderr, "");
    says(
        &table,
        &[
            "rerun +, s",
            "nonlinear",
            "* friction.low_speed +, friction.breakaway -: friction.breakaway: must be at least friction.low_speed",
            " instead of ",
            "goes along with the loss of stability",
        ],
    );
    let document = folder.ok(&certify("paper-si", &["--json"]));
    let document = json(&document);
    assert_eq!(document["final_stick"]["without_reruns"], serde_json::Value::Null);
    assert_eq!(document["warnings"], serde_json::json!([]));
    let parameters = document["sensitivity"].as_array().unwrap();
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    let numbers = |name: &str| {
        file.dataset(&format!("sensitivity/{name}"))
            .unwrap()
            .read_raw::<f64>()
            .unwrap()
    };
    let codes = |name: &str| {
        file.dataset(&format!("sensitivity/{name}"))
            .unwrap()
            .read_raw::<i8>()
            .unwrap()
    };
    let sticks = |name: &str| {
        file.dataset(&format!("sensitivity/{name}"))
            .unwrap()
            .read_raw::<i64>()
            .unwrap()
    };
    // An integer is exact, and is not run again.
    let is_exact = |parameter: &serde_json::Value| parameter["half_last_digit"] == 0.0;
    assert!(parameters.iter().any(is_exact), "{document}");
    for side in ["minus", "plus"] {
        let (shift, outcome) = (numbers(&format!("shift_{side}")), codes(&format!("outcome_{side}")));
        let sticks = sticks(&format!("sticks_{side}"));
        let found = (shift.len(), outcome.len(), sticks.len());
        assert_eq!(found, (parameters.len(), parameters.len(), parameters.len()));
        for (index, parameter) in parameters.iter().enumerate() {
            let rerun = &parameter["final_stick"][side];
            match rerun["shift"].as_f64() {
                Some(_) => assert!(same(shift[index], &rerun["shift"]), "{parameter}"),
                None => assert!(shift[index].is_nan(), "{parameter}"),
            }
            let name = [
                "same-events",
                "other-events",
                "noise-determined",
                "no-final-stick",
                "invalid",
                "failed",
                "too-long",
            ];
            if is_exact(parameter) {
                assert_eq!(
                    (rerun, outcome[index], sticks[index]),
                    (&serde_json::Value::Null, -1, -1)
                );
                continue;
            }
            assert_eq!(rerun["outcome"], name[outcome[index] as usize], "{parameter}");
            assert_eq!(rerun["sticks"].as_i64().unwrap_or(-1), sticks[index], "{parameter}");
        }
    }
    let (half, nonlinear) = (numbers("half_last_digit"), codes("nonlinear"));
    for (index, parameter) in parameters.iter().enumerate() {
        assert!(same(half[index], &parameter["half_last_digit"]), "{parameter}");
        let expected = parameter["final_stick"]["nonlinear"].as_bool().map_or(-1, i8::from);
        assert_eq!(nonlinear[index], expected, "{parameter}");
    }
    // One of the reruns, repeated by hand.
    let force = parameters.iter().find(|p| p["parameter"] == "actuation.force").unwrap();
    let stop = |force: &str| {
        let set = [
            "--method",
            "series",
            "--json",
            "--set",
            force,
            "--force",
            "-o",
            "by-hand.h5",
        ];
        let run: Vec<&str> = [&["run", "paper-si"], QUICK, &set].concat();
        let document = folder.ok(&run);
        json(&document)["summary"]["final_stick_time"].as_f64().unwrap()
    };
    let shift = stop("actuation.force=2225.05") - stop("actuation.force=2225");
    let told = force["final_stick"]["plus"]["shift"].as_f64().unwrap();
    // Both runs are within 1e-12 s.
    assert!((shift - told).abs() < 2e-12, "{shift:e} {told:e}");
}

#[test]
fn cli_certify_without_a_final_stick_has_no_reruns() {
    let folder = Folder::new();
    let (table, stderr) = folder.ends(
        &certify("paper-si", &["-v", "--set", "output={end_time=0.1, interval=0.01}"]),
        0,
    );
    assert!(!table.contains("what moves the final stick"), "{table}");
    // Warnings of `run` are repeated here.
    assert!(
        stderr.contains("warning: 1 of the kicks set at the instability never came"),
        "{stderr}"
    );
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    let dataset = file.dataset("sensitivity/shift_plus").unwrap();
    let shift = dataset.read_raw::<f64>().unwrap();
    assert!(!shift.is_empty() && shift.iter().all(|x| x.is_nan()));
    let dataset = file.dataset("sensitivity/outcome_plus").unwrap();
    let outcome = dataset.read_raw::<i8>().unwrap();
    assert!(outcome.iter().all(|code| *code == -1));
}

#[test]
fn cli_certify_by_the_oracle_where_it_can() {
    let folder = Folder::new();
    let (stdout, stderr) = folder.ends("certify belt-leine", 0);
    assert_eq!(stderr, "");
    assert_eq!(folder.names(), ["belt-leine.certified.h5"]);
    says(
        &stdout,
        "by the exact solver & converged: every event within & strongest parameter & stator.stiffness moves the period",
    );
    says(
        &folder.ok("certify belt-leine -v"),
        "by the exact solver & 9.295999525480154883358229545972 & cvode-adams & agreeing &
         what moves the period of the attractor & friction.breakaway, 1 & stator_speed_0       m s-1",
    );
    // The same from a file, as a JSON document.
    let text = folder.ok("case clutch").replace("\"200 rad/s\"", "\"200.0 rad/s\"");
    folder.write("clutch.toml", text);
    folder.ok("run clutch.toml -q");
    let document = folder.json("certify clutch.h5");
    assert_eq!(document["converged"], true);
    assert_eq!(document["uncertainty_by"], "oracle");
    assert_eq!(document["events"].as_array().unwrap().len(), 2);
    assert!(document["digits"].as_u64().unwrap() >= 14, "{}", document["digits"]);
    // The clutch locks at 11/12 s. With each rad/s more of the engine, which starts at 200 rad/s, this is 1/450 s
    // later.
    assert_eq!(document["result"]["of"], "final-stick");
    let numbers = document["sensitivity"].as_array().unwrap();
    let speed = numbers
        .iter()
        .find(|number| number["parameter"] == "initial.speed")
        .unwrap();
    let slope = speed["result"]["slope"].as_f64().unwrap();
    assert!((slope - 1.0 / 450.0).abs() < 1e-11, "{slope}");
    assert_eq!(speed["half_last_digit"], 0.05);
    let shift = speed["result"]["plus"]["shift"].as_f64().unwrap();
    assert!((shift - 0.05 / 450.0).abs() < 1e-12, "{shift}");
    let channels = document["channels"].as_array().unwrap();
    let band = |name: &str| {
        let channel = channels.iter().find(|channel| channel["name"] == name).unwrap();
        channel["band"].as_f64().unwrap()
    };
    assert!(band("rotor_speed_0") > 0.0 && band("rotor_speed_0") < 1e-9);
    assert_eq!(document["stretches"].as_array().unwrap().len(), 3);
}

/// The file of a certified run has sensitivities, and names their result. That of a run has the result of another
/// method.
#[test]
fn cli_certified_files_have_sensitivities_bands_and_a_witness() {
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
    // A certified result can also be repeated.
    folder.ok("run belt-coulomb.certified.h5 -q");
    folder.ok("run groan -q");
    let file = hdf5::File::open(folder.path("groan.h5")).unwrap();
    let witness = file.group("witness").unwrap();
    let said: hdf5::types::VarLenUnicode = witness.attr("testimony").unwrap().read_scalar().unwrap();
    assert_eq!(said.as_str(), "same-sequence");
    drop(file);
    folder.ok("check groan.h5");
}

/// Requesting more digits than the run has gives exit status 1 and names a remedy. The certificate is still written.
#[test]
fn cli_certify_says_where_digits_are_missing() {
    let folder = Folder::new();
    let asked = ["certify", "belt-leine", "--digits", "14"];
    let (_, stderr) = folder.ends(&asked, 1);
    says(&stderr, &["14 digits were asked for", "series"]);
    assert_eq!(folder.names(), ["belt-leine.certified.h5"]);
    // The advice is correct.
    let advised = r#"certify belt-leine -q --digits 14 --force --set solver.method="series""#;
    folder.ok(advised);
}

/// A certificate with exact events is replaced by one without them by force only. With `--oracle` the report has the
/// exact sticks.
#[test]
fn cli_certify_keeps_exact_events() {
    let folder = Folder::new();
    let exact = folder.ok(&certify("paper-si", &["--oracle"]));
    let document = folder.ok(&certify("paper-si", &["--oracle", "--json"]));
    let document = json(&document);
    let events = document["oracle"]["events"].as_array().unwrap();
    let mut sticks = events.iter().filter(|event| event["kind"] == "stick");
    let (first, last) = (sticks.next().unwrap(), sticks.next_back().unwrap());
    for (stick, name) in [(first, "exact first stick"), (last, "exact last stick")] {
        let (time, digits) = (stick["time"].as_str().unwrap(), stick["digits"].as_u64().unwrap());
        assert!(digits >= 20, "{stick}");
        says(&exact, &[name, &format!("{time} s, {digits} digits")]);
    }
    let lines = exact.trim_end().lines().filter(|line| !line.starts_with("changed: "));
    assert!(lines.count() <= 15, "{exact}");
    let before = folder.read("paper-si.certified.h5");
    let (_, stderr) = folder.ends(&certify("paper-si", &["--digits", "5"]), 2);
    says(
        &stderr,
        &["paper-si.certified.h5", "exact events", "--oracle", "--force"],
    );
    assert!(folder.read("paper-si.certified.h5") == before);
    let table = folder.ok(&certify("paper-si", &["--digits", "5", "--force"]));
    assert!(!table.contains("exact first stick"), "{table}");
    // With exact events it is a better one.
    folder.ok(&certify("paper-si", &["--oracle", "-q"]));
}

/// Settings cannot be added to a result file: the advice names the case.
#[test]
fn cli_certify_names_the_case_of_a_result_in_its_advice() {
    let folder = Folder::new();
    folder.ok("run belt-leine -q --set output.end_time=40");
    let (_, stderr) = folder.ends("certify belt-leine.h5 --digits 14", 1);
    says(
        &stderr,
        &[
            "14 digits were asked for",
            "stickslip certify belt-leine --set 'output.end_time=40",
            "solver.method=\"series\"",
        ],
    );
}
