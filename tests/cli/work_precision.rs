//! `stickslip work-precision`, and its messages about wrong studies.

use crate::common::cli::{Folder, json, says};
use crate::common::json::*;
use crate::common::rows;
use crate::common::unlocked;
use std::path::Path;
use stickslip::Run;
use stickslip::analysis::work_precision::{PrecisionStudy, STUDIES, StudySource};
use stickslip::case::{Case, CaseSource, Override, WrittenCase};

pub const STUDY: &str = "title = \"A small one\"\ncase = \"paper-si\"\nset = [\"output.end_time=7\"]\n\n\
                     [[series]]\nmethods = [\"auto\", \"erk-verner-76\", \"paper\"]\ntolerances = [1e-6]\n\n\
                     [[series]]\nmethods = [\"erk\"]\nsteps = [\"20 us\"]\n";

#[test]
fn cli_a_study_is_a_file_a_table_a_document_and_a_figure() {
    let folder = Folder::new();
    folder.write("small.toml", STUDY);
    let arguments = ["work-precision", "small.toml", "--figure", "pictures", "--json"];
    let stdout = folder.clean(&arguments);
    let document = json(&stdout);
    let found = (&document["status"], &document["file"]);
    assert_eq!(found, (&"complete".into(), &"small.h5".into()));
    let runs = document["runs"].list();
    let names: Vec<&str> = runs.iter().map(|run| run["method"].text()).collect();
    assert_eq!(names, ["cvode", "erk-verner-76", "paper", "erk"]);
    let found = (&runs[3]["rtol"], &runs[3]["fixed_step"]);
    assert_eq!(found, (&serde_json::Value::Null, &2e-5.into()));
    // The methods with located events are far better than the paper's procedure, which has another event sequence.
    let onset = |k: usize| runs[k]["error"]["onset"].number();
    assert!([0, 1, 3].iter().all(|&k| onset(k) < 1e-6), "{stdout}");
    assert!(onset(2) > 1e-6, "{stdout}");
    assert!(runs[2]["error"]["largest_event"].is_null() && runs[2]["same_sequence"] == false);
    assert_eq!(folder.names(), ["pictures", "small.h5", "small.toml"]);

    let file = unlocked::open(folder.path("small.h5")).unwrap();
    let column = |name: &str| file.dataset(name).unwrap().read_1d::<f64>().unwrap().to_vec();
    let errors = column("runs/onset_error");
    // The parser of the test rounds decimals to within a few units of the last digit.
    assert!((0..4).all(|k| (errors[k] - onset(k)).abs() <= 1e-15 * errors[k]));
    assert!(column("runs/rtol")[3].is_nan() && column("runs/fixed_step")[3] == 2e-5);
    let (times, uncertainties) = (column("reference/time"), column("reference/time_uncertainty"));
    assert_eq!((times.len(), uncertainties.len()), (107, 107));
    assert!(times.is_sorted() && uncertainties.iter().all(|u| (0.0..1e-10).contains(u)));
    drop(file);

    let picture = folder.text("pictures/small-work-precision.svg");
    says(
        &picture,
        "erk-verner-76 & uncertainty of reference & calls of the right-hand side & fixed steps",
    );
    assert!(folder.read("pictures/small-work-precision.png").starts_with(b"\x89PNG"));

    // The study's own earlier file and figure are replaced. The table has a row for each run.
    let table = folder.ok("work-precision small.toml --figure pictures -v");
    says(&table, &["erk-verner-76", "the exact solver with"]);
    // `inspect` recognises the file, and a file of another origin is not replaced. A folder in the place of the lock
    // is not replaced, either.
    std::fs::create_dir(folder.path(".locked.partial.h5.lock")).unwrap();
    folder.refused("work-precision small.toml -o locked.h5", &[".locked.partial.h5.lock"]);
    let foreign = folder.write("foreign.h5", "mine");
    folder.refused("work-precision small.toml -o foreign.h5", &["--force"]);
    assert_eq!(std::fs::read(foreign).unwrap(), b"mine");
}

/// The message for a study with one change, which must end with this exit status.
fn said(text: &str, status: i32) -> String {
    let folder = Folder::new();
    folder.write("study.toml", text);
    let (stdout, stderr) = folder.ends("work-precision study.toml", status);
    assert_eq!(stdout, "");
    assert_eq!(folder.names(), ["study.toml"], "{stderr}");
    stderr
}

#[test]
fn cli_a_wrong_study_is_answered_with_place_and_remedy() {
    let change = |from: &str, to: &str| {
        assert!(STUDY.contains(from), "{from}");
        said(&STUDY.replacen(from, to, 1), 2)
    };
    for [from, to, parts] in rows(
        r#"
        "erk-verner-76" | "erk-verner76" |
            study.toml:6: series.0.methods & did you mean "erk-verner-76" & erk-heun-euler-21
        ["erk"] | [] | study.toml:9: series.1 & no list may be empty
        steps = ["20 us"] | steps = [] | series.1 & tolerances or steps
        set = | sets = | study.toml:3: sets: unknown key; did you mean set?
        steps = | step = | study.toml:11: series.1.step: unknown key; did you mean steps?
        "paper-si" | "paper-is" | study.toml:2: case & did you mean paper-si
        [1e-6] | 1e-6 | study.toml:7: series.0.tolerances: expected a list
        [1e-6] | [2] | study.toml:7 & from 2e-15 to 0.1
        "20 us" | "20 N" | study.toml:11: series.1.steps
        "20 us" | "1 ms" | series.1 & unstable & 4.157 kHz
        ["erk"] | ["arkode"] | series.1 & only the explicit Runge-Kutta methods take fixed steps
        output.end_time=7 | solver.rtol=1e-3 | study.toml:3: set.solver.rtol: is what the study varies
        output.end_time=7 | output.endtime=7 | study.toml:3: set.output.endtime: & unknown key
    "#,
    ) {
        says(&change(from, to), parts);
    }
    says(&change("case = \"paper-si\"\n", ""), r#"case: missing & "paper""#);
    let list = "[\n\"output.end_time=7\",\n\"solver.rtol=1e-3\",\n\"contact.radius=-1\",\n]";
    says(
        &change("[\"output.end_time=7\"]", list),
        "study.toml:5: set.solver.rtol: is what the study varies & \
         study.toml:6: set.contact.radius: gives a case that cannot be: must be greater than 0",
    );
    let nothing = said("case = \"paper\"\n", 2);
    assert!(nothing.contains("series: missing or empty"), "{nothing}");
    let text = said("case = \n", 2);
    assert!(text.contains("study.toml:1: not valid TOML"), "{text}");
}

#[test]
fn cli_a_reference_that_cannot_be_reached_is_an_error() {
    let with = |reference: &str| format!("{STUDY}[reference]\n{reference}\n");
    let missing = said(&with("truth = \"nowhere.json\""), 2);
    says(&missing, &["nowhere.json", "no such file"]);
    let both = said(&with("truth = \"nowhere.json\"\nrtol = 1e-9"), 2);
    assert!(both.contains("reference.rtol has no meaning"), "{both}");
    let one = said(&with("method = \"auto\"\ncheck = \"cvode\""), 2);
    assert!(one.contains("both \"cvode\""), "{one}");

    // The exact solution of another case.
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/truth");
    let other = said(&with(&format!("truth = '{}'", data.join("paper.json").display())), 2);
    assert!(other.contains("another case") && other.contains("k_e"), "{other}");
    let folder = Folder::new();
    for [name, text, why] in rows(
        r#"
        a.json | {                                               | not JSON
        b.json | {}                                              | no list "events"
        c.json | {"events": []}                                  | is empty
        d.json | {"events": [{"kind": "stick", "time": "soon"}]} | event 0
    "#,
    ) {
        folder.write(name, text);
        folder.write("study.toml", with(&format!("truth = \"{name}\"")));
        folder.refused("work-precision study.toml", &[name, why]);
    }

    // Without a perturbation no two methods agree. The exit status is 1, and the message gives the reason.
    let unperturbed = with("method = \"auto\"").replace("\"paper-si\"", "\"unperturbed\"");
    let said = said(&unperturbed, 1);
    says(&said, &["there is no reference", "perturbation"]);
}

/// Closed-form events of a mass on a belt, which sticks for 0.2 s and slips, with the case's parameters by their
/// keys.
#[test]
fn analytic_a_truth_may_be_of_any_case() {
    let folder = Folder::new();
    let end = Override::parse("output.end_time=1.2").unwrap();
    let case = Case::read(&CaseSource::built_in("belt-coulomb").unwrap(), &[end]).unwrap();
    let events = Run::new(&case).start().unwrap().events;
    let events: Vec<String> = events
        .iter()
        .filter(|event| event.kind.in_event_sequence())
        .map(|event| {
            format!(
                "{{\"kind\": \"{}\", \"time\": \"{:?}\"}}",
                event.kind.name(),
                event.time
            )
        })
        .collect();
    let write = |name: &str, factor: f64| {
        let numbers = WrittenCase::of(&case);
        let numbers = numbers.numbers().iter();
        let numbers = numbers.map(|number| format!("\"{}\": \"{:?}\"", number.path, factor * number.value));
        let numbers: Vec<String> = numbers.collect();
        folder.write(
            name,
            format!(
                "{{\"events\": [{}], \"parameters\": {{{}}}}}",
                events.join(", "),
                numbers.join(", ")
            ),
        );
    };
    write("truth.json", 1.0);
    write("other.json", 1.1);
    let study = "case = \"belt-coulomb\"\n[set]\noutput.end_time = 1.2\n[[series]]\nmethods = [\"series\"]\n\
                 tolerances = [1e-9]\n[reference]\ntruth = \"truth.json\"\n";
    folder.write("study.toml", study);
    let (stdout, _) = folder.ends("work-precision study.toml --json", 0);
    let document = json(&stdout);
    assert_eq!(document["runs"][0]["same_sequence"], true);
    let found = document["runs"][0]["error"]["largest_event"].number();
    assert!(found < 1e-9, "{stdout}");
    for (name, case) in [("other.json", "belt-coulomb"), ("truth.json", "belt-leine")] {
        folder.write(
            "study.toml",
            study.replace("truth.json", name).replace("belt-coulomb", case),
        );
        folder.refused("work-precision study.toml --force", &["of another case"]);
    }
}

#[test]
fn cli_the_built_in_study_is_found_by_name() {
    let folder = Folder::new();
    folder.refused("work-precision work", &["there is work-precision"]);
    let text = STUDIES[0].text;
    let study = PrecisionStudy::parse(StudySource::find("work-precision", STUDIES).unwrap()).unwrap();
    let found = (study.head.source.text.as_str(), study.head.source.name.as_str());
    assert_eq!(found, (text, "work-precision"));
}
