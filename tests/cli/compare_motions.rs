//! `stickslip compare` and `stickslip work-precision` for systems in the general form, from the user's side.

use crate::common::cases::built_in;
use crate::common::cli::{Folder, json, says};
use crate::common::json::*;

#[test]
fn cli_a_result_of_trains_is_compared_with_another_method() {
    let folder = Folder::new();
    folder.ok("run drill-string -q");
    let other = ["run", "drill-string", "-q", "--method", "cvode-bdf", "-o", "bdf.h5"];
    folder.ok(&other);
    let stdout = folder.clean("compare drill-string.h5 bdf.h5 -v --report report.html --require events<1e-7 --require period<1e-7 --require drift<1e-8 --require missing<=0");
    says(
        &stdout,
        "the event sequences agree & the surface of the rotor on its shaft & sticks in a period & rad/s &
         per cycle & not compared: final_stick",
    );
    let page = folder.text("report.html");
    says(&page, &["matched events", "rotor_twist"]);
    let short = ["compare", "drill-string.h5", "bdf.h5", "--require", "final_stick<1"];
    let (_, stderr) = folder.ends(&short, 1);
    assert!(stderr.contains("final_stick does not exist"), "{stderr}");
}

#[test]
fn cli_columns_of_trains_are_named_and_have_units() {
    let folder = Folder::new();
    folder.ok("run belt-leine -q");
    // In stick until 5 s: 200 mm/s.
    let rows: String = (0..50).map(|k| format!("{},{},200\n", 100 * k, 20 * k)).collect();
    folder.write("mine.csv", format!("clock,place,pace\n{rows}"));
    folder.write(
        "map.toml",
        "time = { name = \"clock\", unit = \"ms\" }\n[channels]\nstator_position_0 = { name = \"place\", unit = \"mm\" }\n\
         velocity = { name = \"pace\", unit = \"mm/s\" }\n[detection]\nvelocity_tolerance = \"1 um/s\"\n",
    );
    let arguments = ["compare", "belt-leine.h5", "mine.csv", "--map", "map.toml", "--json"];
    let stdout = folder.ok(&arguments);
    let c = &json(&stdout)["comparisons"][0];
    assert_eq!(c["detection"]["velocity_tolerance"], 1e-6);
    let channels = c["channels"].list();
    let names: Vec<&str> = channels.iter().map(|row| row["channel"].text()).collect();
    let expected = ["relative_velocity", "phi1", "phi1_dot", "slip_displacement"];
    assert_eq!(names, expected, "{c}");
    let found = (&channels[1]["unit"], &channels[2]["unit"]);
    assert_eq!(found, (&"m".into(), &"m/s".into()));
    assert!(channels.iter().all(|row| row["max"].number() < 1e-14), "{c}");
    // A unit of rotation, and an unknown name.
    let wrong = ["compare", "belt-leine.h5", "mine.csv", "--column", "velocity=pace:rpm"];
    assert!(folder.refused(&wrong, "").contains("rpm"));
    let wrong = ["compare", "belt-leine.h5", "mine.csv", "--column", "rotor_twist_3=pace"];
    assert!(
        folder
            .refused(&wrong, "")
            .contains("there are relative_velocity, phi1, phi1_dot")
    );
}

#[test]
fn cli_brakes_and_trains_are_compared_where_they_are_the_same() {
    let folder = Folder::new();
    let short = "torsion.rotor_inertia=0.0002 actuation.rise_time=0.01 perturbation=[] output.window=[] output.around=none \
                 output.end_time=0.005 output.interval=1e-5";
    let brake = built_in("paper-si", &short.split(' ').collect::<Vec<_>>());
    folder.write("brake.toml", brake.resolved());
    folder.write("trains.toml", brake.in_general_form().resolved());
    for case in ["brake.toml", "trains.toml"] {
        folder.ok(&["run", case, "-q", "--no-witness"]);
    }
    for pair in [["brake.h5", "trains.h5"], ["trains.h5", "brake.h5"]] {
        let required = "--require mescd>6 --require missing<=0";
        let c = &folder.json(&format!("compare {} {} {required}", pair[0], pair[1]))["comparisons"][0];
        assert_eq!(c["causes"].list().len(), 0, "{c}");
        assert!(c["samples"].whole() > 100, "{c}");
        // The axial motion has a closed form in both runs, and is the Taylor series of its equation between samples.
        let channels = c["channels"].list();
        for axial in ["z", "z_dot"] {
            let rows: Vec<_> = channels.iter().filter(|row| row["channel"] == axial).collect();
            assert!(!rows.is_empty(), "{axial} in {c}");
            assert!(rows.iter().all(|row| row["mescd"].number() > 12.0), "{rows:?}");
        }
    }
    // One key of the short form is a parameter of both trains.
    let other = ["run", "brake.toml", "--set", "torsion.damping=20", "-o", "other.h5"];
    folder.ok(&[&other[..], &["-q", "--no-witness"]].concat());
    for pair in [["other.h5", "trains.h5"], ["trains.h5", "other.h5"]] {
        let c = &folder.json(&["compare", pair[0], pair[1]])["comparisons"][0];
        assert_eq!(c["causes"][0]["cause"], "another-case", "{c}");
        let as_array = c["case_differences"].list();
        let keys: Vec<_> = as_array.iter().map(|d| &d["key"]).collect();
        assert_eq!(keys, ["rotor.damping", "stator.damping"], "{c}");
    }
    folder.ok("run belt-leine -q --no-witness");
    for pair in [["belt-leine.h5", "brake.h5"], ["brake.h5", "belt-leine.h5"]] {
        folder.refused(&["compare", pair[0], pair[1]], &["another motion"]);
    }
    folder.ok("run drill-string -q --no-witness");
    folder.refused("compare belt-leine.h5 drill-string.h5", &["another motion"]);
}

#[test]
fn cli_a_certified_result_of_trains_is_a_reference() {
    let folder = Folder::new();
    folder.ok("run clutch -q");
    folder.ok("certify clutch.h5 -q");
    folder.ok("compare clutch.certified.h5 clutch.h5 --require events<1e-12 -q");
}

#[test]
fn cli_work_precision_of_trains_is_against_the_oracle() {
    let folder = Folder::new();
    folder.write(
        "belt.toml",
        "title = \"A belt\"\ncase = \"belt-leine\"\nset = [\"output.end_time=30\"]\n\n[[series]]\nmethods = [\"auto\", \
         \"cvode-adams\"]\ntolerances = [1e-5, 1e-9]\n",
    );
    let arguments = ["work-precision", "belt.toml", "--figure", "pictures", "--json"];
    let stdout = folder.clean(&arguments);
    let document = json(&stdout);
    let reference = &document["reference"];
    assert!(
        reference["description"].text().starts_with("the exact solver with"),
        "{reference}"
    );
    assert_eq!(reference["events"], 5);
    // Neighbouring doubles at times up to 29 s.
    assert!(reference["uncertainty"]["largest_event"].number() < 1e-14);
    let runs = document["runs"].list();
    let error = |k: usize| runs[k]["error"]["largest_event"].number();
    assert!(
        error(0) > error(1) && error(1) < 1e-8 && error(2) > error(3),
        "{stdout}"
    );
    assert_eq!(folder.names(), ["belt.h5", "belt.toml", "pictures"]);

    folder.write(
        "runs.toml",
        "case = \"belt-leine\"\n[[series]]\nmethods = [\"erk\"]\ntolerances = [1e-6]\n[reference]\nmethod = \"series\"\n",
    );
    let stdout = folder.ok("work-precision runs.toml -v");
    assert!(stdout.contains("Reference: series at rtol 1e-13"), "{stdout}");
    folder.write(
        "truth.toml",
        "case = \"belt-leine\"\n[[series]]\nmethods = [\"erk\"]\ntolerances = [1e-6]\n[reference]\ntruth = \"x.json\"\n",
    );
    folder.refused(
        "work-precision truth.toml",
        "x.json: the true events cannot be read: no such file",
    );
}
