//! `stickslip certify`.

use crate::common::cli::{Arguments, Folder, says};
use crate::common::json::*;
use crate::common::unlocked;
use stickslip::results::{Overwrite, Reservation};

/// A short slide from a low speed with a kick, which sticks and slips within a quarter of a second.
const QUICK: [&str; 4] = [
    "initial.speed=3",
    "actuation={profile=\"ramp\", force=\"2225.0 N\", rise_time=0.02}",
    "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
    "output={end_time=0.4, interval=0.01}",
];

/// A command on the quick case. A key that is set by `more` replaces that of the quick case: none is set twice.
fn quick(command: &str, more: &str) -> Vec<String> {
    let more = more.list();
    let key = |setting: &str| setting.split('=').next().unwrap_or_default().to_owned();
    let own = QUICK
        .iter()
        .filter(|pair| more.iter().all(|other| key(other) != key(pair)));
    let mut all = command.list();
    own.for_each(|setting| all.extend(["--set".to_owned(), setting.to_string()]));
    all.extend(more);
    all
}

fn certify(more: &str) -> Vec<String> {
    quick("certify paper-si", more)
}

fn stored<T: hdf5::H5Type>(file: &hdf5::File, name: &str) -> Vec<T> {
    file.dataset(name).unwrap().read_raw().unwrap()
}

/// The JSON reader of the test does not round to the nearest double.
fn same(stored: f64, document: &serde_json::Value) -> bool {
    let number = document.as_f64().expect("a number");
    (stored - number).abs() <= 4.0 * f64::EPSILON * number.abs()
}

#[test]
fn cli_certify_says_the_same_in_table_json_and_file() {
    let folder = Folder::new();
    let table = folder.clean(&certify("--digits 9 -v"));
    assert_eq!(folder.names(), ["paper-si.certified.h5"]);
    says(
        &table,
        "converged: every event within & growth exponent G & cvode-bdf & cvode-adams & erk & at a fixed time &
         what moves the final stick & kick above the methods' own noise",
    );
    let document = folder.json(&certify(""));
    assert_eq!(document["verdict"], "converged");
    let events = document["events"].list();
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    let uncertainty: Vec<f64> = stored(&file, "events/time_uncertainty");
    assert_eq!(uncertainty.len(), events.len());
    for (stored, event) in uncertainty.iter().zip(events) {
        assert!(same(*stored, &event["uncertainty"]), "{event}: {stored:e}");
    }
    let stretches = document["stretches"].list();
    assert_eq!(stretches.len(), events.len() + 1);
    let read = |name: &str| stored::<f64>(&file, &format!("certificate/{name}"));
    let (band, rate) = (read("band_phi2_dot"), read("rate_phi2_dot"));
    let times = read("stretch_time_uncertainty");
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
    let speed = document["channels"].with("name", "phi2_dot");
    assert!(same(largest[0], &speed["band"]), "{speed}");
    assert!(same(largest[1], &speed["at_fixed_time"]), "{speed}");
    let parameters = document["sensitivity"].list();
    // The value comes from --set.
    let force = parameters.with("parameter", "actuation.force");
    assert_eq!(force["half_last_digit"], 0.05, "{force}");
    let table = file.dataset("sensitivity/time_sensitivity").unwrap();
    assert_eq!(table.shape(), [events.len(), parameters.len()]);
    let values = table.read_raw::<f64>().unwrap();
    let last = events.len() - 1;
    for (column, parameter) in parameters.iter().enumerate() {
        let value = values[last * parameters.len() + column];
        assert!(same(value, &parameter["time_sensitivity"][last]), "{parameter}");
    }
}

#[test]
fn cli_certify_a_file_is_certified_as_it_is() {
    let folder = Folder::new();
    folder.ok(&quick("run paper-si", "-q -o mine.h5"));
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
    let document = folder.json(&certify("--oracle --digits 28"));
    let exact = document["oracle"]["events"].list();
    let events = document["events"].list();
    let errors = document["oracle"]["true_errors"].list();
    assert_eq!(exact.len(), events.len());
    for (index, event) in events.iter().enumerate() {
        assert_eq!(exact[index]["kind"], event["kind"]);
        let error = errors[index].number();
        assert!(error.abs() <= event["uncertainty"].number(), "{event}: {error:e}");
    }
    let stick = exact.with("kind", "stick")["time"].text();
    assert!(stick.len() >= 28, "{stick}");
    // The uncertainty is the distance plus the error of the exact solution. The methods' own uncertainty is given,
    // too; it is larger.
    assert_eq!(document["contradiction"], serde_json::Value::Null);
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    let read = |name: &str| stored::<f64>(&file, name);
    let (stored, by_ladder) = (read("events/time_uncertainty"), read("certificate/ladder_uncertainty"));
    let true_errors = read("certificate/true_error");
    for (index, event) in events.iter().enumerate() {
        assert_eq!(event["verdict"], "converged");
        let error = event["true_error"].number();
        let own = exact[index]["error"].number();
        // The 28 digits of the exact solution are more than a double shows.
        assert!(own < 1e-27 && exact[index]["digits"].whole() >= 28);
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
    let series = "--set solver.method=\"series\" --digits 14";
    let (_, stderr) = folder.ends(&certify(series), 1);
    assert!(stderr.contains("14 digits were asked for"), "{stderr}");
    let table = folder.ok(&certify(&format!("{series} --oracle -v")));
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
    let without = "certify unperturbed --set output.window=[] --set output.around=none --oracle --digits 12";
    let (_, stderr) = folder.ends(without, 1);
    says(&stderr, "noise-determined & --set 'solver.method=\"series\"' has");
    folder.ok(&format!("{without} --set solver.method=\"series\" -q --force"));
}

#[test]
fn cli_certify_refuses_what_it_cannot_do() {
    let folder = Folder::new();
    let fails = |arguments: &[String], status: i32, words: &str| says(&folder.ends(arguments, status).1, words);
    let wrong = |arguments: &str, words: &str| fails(&arguments.list(), 2, words);
    wrong("certify paper --digits 17", "--digits 17 & --oracle");
    wrong("certify paper --digits 0", "--digits 0");
    // More digits than the conditioning of a converged run allows.
    fails(&certify("--digits 16"), 1, "16 digits & rounding to double precision");
    // With noise, the exit status is 1 only if digits were requested.
    let noise = "--set perturbation=[] --set initial.speed=6 --set output.end_time=0.8 --force";
    let table = folder.ok(&certify(noise));
    assert!(table.contains("noise-determined"), "{table}");
    let digits = certify(&format!("{noise} --digits 3"));
    fails(&digits, 1, "noise-determined & Set a perturbation");
    let events = certify("--set solver.max_events=3 --force");
    fails(&events, 1, "event budget & solver.max_events");
    // A file that has lost its case.
    folder.ok(&quick("run paper-si", "-q -o lost.h5"));
    let lost = unlocked::open_rw(folder.path("lost.h5")).unwrap();
    lost.unlink("input/resolved").unwrap();
    lost.close().unwrap();
    wrong("certify lost.h5", "lost.h5 & /input/resolved & certify the case itself");
    folder.write("not.h5", b"\x89HDF\r\n\x1a\n nothing else");
    wrong("certify not.h5", "not.h5");
    wrong("certify belt-leine --figure onset.svg", "--figure");
    // An empty file is no HDF5 file, whatever its name.
    folder.write("empty.h5", b"");
    wrong("certify empty.h5", "empty.h5 & not an HDF5 file");
    let names = folder.names();
    assert!(names.iter().all(|name| !name.contains("uncertified")), "{names:?}");
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
    let document = folder.json(&certify("--figure onset.svg"));
    assert_eq!(folder.names(), ["onset.svg", "paper-si.certified.h5"]);
    assert!(folder.path("onset.svg").metadata().unwrap().len() > 0);
    let events = document["events"].list();
    let certified = events.with("kind", "stick")["time"].number();
    let onsets = document["onsets"].list();
    let kicked: Vec<_> = onsets.iter().filter(|o| o["kicked"] == true).collect();
    // The same number of runs without the kick, over the same methods and tolerances.
    assert_eq!(onsets.len(), 2 * kicked.len());
    for onset in kicked {
        // The accuracy that every method promises at the default tolerance.
        if onset["rtol"].number() <= 1e-10 {
            let distance = (onset["first_stick"].number() - certified).abs();
            assert!(distance < 1e-6, "{onset}: {distance:e}");
        }
    }
    // Without the kick sliding continues for longer.
    for onset in onsets.iter().filter(|o| o["kicked"] == false) {
        assert!(onset["first_stick"].number() > certified, "{onset}");
    }
    folder.refused(&certify("--figure onset.tiff"), "onset.tiff & .svg");
}

/// The effect of half a last digit on the final stick is the same in table, JSON and file, and in a changed run.
#[test]
fn cli_certify_reruns_half_a_last_digit() {
    let folder = Folder::new();
    let table = folder.clean(&certify("-v"));
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
    let document = folder.json(&certify(""));
    assert_eq!(document["final_stick"]["without_reruns"], serde_json::Value::Null);
    assert_eq!(document["warnings"], serde_json::json!([]));
    let parameters = document["sensitivity"].list();
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    let numbers = |name: &str| stored::<f64>(&file, &format!("sensitivity/{name}"));
    let codes = |name: &str| stored::<i8>(&file, &format!("sensitivity/{name}"));
    let sticks = |name: &str| stored::<i64>(&file, &format!("sensitivity/{name}"));
    // An integer is exact, and is not run again.
    let is_exact = |parameter: &serde_json::Value| parameter["half_last_digit"] == 0.0;
    assert!(parameters.iter().any(is_exact), "{document}");
    let names = "same-events other-events noise-determined no-final-stick invalid failed too-long";
    let names: Vec<&str> = names.split(' ').collect();
    for side in ["minus", "plus"] {
        let (shift, outcome) = (numbers(&format!("shift_{side}")), codes(&format!("outcome_{side}")));
        let sticks = sticks(&format!("sticks_{side}"));
        assert_eq!([shift.len(), outcome.len(), sticks.len()], [parameters.len(); 3]);
        for (index, parameter) in parameters.iter().enumerate() {
            let rerun = &parameter["final_stick"][side];
            match rerun["shift"].as_f64() {
                Some(_) => assert!(same(shift[index], &rerun["shift"]), "{parameter}"),
                None => assert!(shift[index].is_nan(), "{parameter}"),
            }
            let found = (outcome[index], sticks[index]);
            if is_exact(parameter) {
                assert_eq!((rerun, found), (&serde_json::Value::Null, (-1, -1)));
                continue;
            }
            assert_eq!(rerun["outcome"], names[found.0 as usize], "{parameter}");
            assert_eq!(rerun["sticks"].as_i64().unwrap_or(-1), found.1, "{parameter}");
        }
    }
    let (half, nonlinear) = (numbers("half_last_digit"), codes("nonlinear"));
    for (index, parameter) in parameters.iter().enumerate() {
        assert!(same(half[index], &parameter["half_last_digit"]), "{parameter}");
        let expected = parameter["final_stick"]["nonlinear"].as_bool().map_or(-1, i8::from);
        assert_eq!(nonlinear[index], expected, "{parameter}");
    }
    // One of the reruns, repeated by hand.
    let force = parameters.with("parameter", "actuation.force");
    let stop = |force: &str| {
        let set = format!("--method series --set actuation.force={force} --force -o by-hand.h5");
        folder.json(&quick("run paper-si", &set))["summary"]["final_stick_time"].number()
    };
    let shift = stop("2225.05") - stop("2225");
    let told = force["final_stick"]["plus"]["shift"].number();
    // Both runs are within 1e-12 s.
    assert!((shift - told).abs() < 2e-12, "{shift:e} {told:e}");
}

#[test]
fn cli_certify_without_a_final_stick_has_no_reruns() {
    let folder = Folder::new();
    let arguments = certify("-v --set 'output={end_time=0.1, interval=0.01}'");
    let (table, stderr) = folder.ends(&arguments, 0);
    assert!(!table.contains("what moves the final stick"), "{table}");
    // Warnings of `run` are repeated here.
    says(&stderr, "warning: 1 of the kicks set at the instability never came");
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    let shift: Vec<f64> = stored(&file, "sensitivity/shift_plus");
    assert!(!shift.is_empty() && shift.iter().all(|x| x.is_nan()));
    let outcome: Vec<i8> = stored(&file, "sensitivity/outcome_plus");
    assert!(outcome.iter().all(|code| *code == -1));
}

#[test]
fn cli_certify_by_the_oracle_where_it_can() {
    let folder = Folder::new();
    let stdout = folder.clean("certify belt-leine");
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
    assert_eq!(document["events"].list().len(), 2);
    assert!(document["digits"].whole() >= 14, "{}", document["digits"]);
    // The clutch locks at 11/12 s. With each rad/s more of the engine, which starts at 200 rad/s, this is 1/450 s
    // later.
    assert_eq!(document["result"]["of"], "final-stick");
    let speed = document["sensitivity"].with("parameter", "initial.speed");
    let slope = speed["result"]["slope"].number();
    assert!((slope - 1.0 / 450.0).abs() < 1e-11, "{slope}");
    assert_eq!(speed["half_last_digit"], 0.05);
    let shift = speed["result"]["plus"]["shift"].number();
    assert!((shift - 0.05 / 450.0).abs() < 1e-12, "{shift}");
    let band = |name: &str| document["channels"].with("name", name)["band"].number();
    assert!(band("rotor_speed_0") > 0.0 && band("rotor_speed_0") < 1e-9);
    assert_eq!(document["stretches"].list().len(), 3);
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
    let shape = |name: &str| file.dataset(name).unwrap().shape();
    assert_eq!(shape("sensitivity/time_sensitivity"), [29, parameters.len()]);
    assert_eq!(
        shape("sensitivity/time_sensitivity_uncertainty"),
        [29, parameters.len()]
    );
    assert!(parameters.contains(&"contact.normal_force"), "{parameters:?}");
    assert_eq!(shape("certificate/band_stator_speed_0"), [30]);
    assert_eq!(shape("certificate/rate_stator_speed_0"), [30]);
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
    let (_, stderr) = folder.ends("certify belt-leine --digits 14", 1);
    says(&stderr, "14 digits were asked for & series");
    assert_eq!(folder.names(), ["belt-leine.certified.h5"]);
    // The advice is correct.
    folder.ok(r#"certify belt-leine -q --digits 14 --force --set solver.method="series""#);
}

/// A certificate with exact events is replaced by one without them by force only. With `--oracle` the report has the
/// exact sticks.
#[test]
fn cli_certify_keeps_exact_events() {
    let folder = Folder::new();
    let exact = folder.ok(&certify("--oracle"));
    let document = folder.json(&certify("--oracle"));
    let events = document["oracle"]["events"].list();
    let mut sticks = events.iter().filter(|event| event["kind"] == "stick");
    let (first, last) = (sticks.next().unwrap(), sticks.next_back().unwrap());
    for (stick, name) in [(first, "exact first stick"), (last, "exact last stick")] {
        let (time, digits) = (stick["time"].text(), stick["digits"].whole());
        assert!(digits >= 20, "{stick}");
        says(&exact, &[name, &format!("{time} s, {digits} digits")]);
    }
    let lines = exact.trim_end().lines().filter(|line| !line.starts_with("changed: "));
    assert!(lines.count() <= 15, "{exact}");
    let before = folder.read("paper-si.certified.h5");
    let (_, stderr) = folder.ends(&certify("--digits 5"), 2);
    says(&stderr, "paper-si.certified.h5 & exact events & --oracle & --force");
    assert!(folder.read("paper-si.certified.h5") == before);
    let table = folder.ok(&certify("--digits 5 --force"));
    assert!(!table.contains("exact first stick"), "{table}");
    // With exact events it is a better one.
    folder.ok(&certify("--oracle -q"));
}

/// Settings cannot be added to a result file: the advice names the case.
#[test]
fn cli_certify_names_the_case_of_a_result_in_its_advice() {
    let folder = Folder::new();
    folder.ok("run belt-leine -q --set output.end_time=40");
    let (_, stderr) = folder.ends("certify belt-leine.h5 --digits 14", 1);
    says(
        &stderr,
        "14 digits were asked for & stickslip certify belt-leine --set 'output.end_time=40 &
         solver.method=\"series\"",
    );
}
