//! Nothing is overwritten in silence: a product replaces only one of the same case, settings and files.

use crate::common::cli::Folder;
use crate::common::json::*;

/// The result of other settings is refused with what differs, and the earlier file stays as it is. The same settings
/// give the same result, which is replaced.
#[test]
fn cli_a_run_replaces_a_result_of_the_same_settings_only() {
    let folder = Folder::new();
    folder.ok_short("-q");
    let events = folder.result("paper.h5").events().unwrap();
    let first = folder.read("paper.h5");
    let said = folder.refused_short(
        "--set friction.decay=4",
        "paper.h5: holds another run: friction.decay = 5 s/rad there, 4 s/rad here; name another file with -o & --force",
    );
    assert!(!said.contains("more"), "{said}");
    folder.refused(
        "run --set perturbation=[]",
        "perturbation.0 & output.end_time = 0.05 s there, 10 s here & more",
    );
    assert_eq!(folder.read("paper.h5"), first);
    assert_eq!(folder.names(), ["paper.h5"]);
    // The limit of wall time has no effect on the result.
    folder.ok_short("-q --max-wall-time 1000");
    assert_eq!(folder.result("paper.h5").events().unwrap(), events);
    // Of one case in two files, and by force.
    folder.ok_short("-q -o other.h5 --set friction.decay=4");
    folder.ok_short("-q --set friction.decay=4 --force");
    let decay = |name: &str| folder.result(name).resolved().unwrap();
    assert_eq!(decay("paper.h5"), decay("other.h5"));
}

/// A run does not replace what is more than a run: its certificate took minutes.
#[test]
fn cli_a_run_does_not_replace_a_certified_file() {
    let folder = Folder::new();
    folder.ok("certify belt-coulomb -q");
    let certified = folder.read("belt-coulomb.certified.h5");
    folder.refused(
        "run belt-coulomb -o belt-coulomb.certified.h5",
        "belt-coulomb.certified.h5: holds a certified run & -o & --force",
    );
    folder.refused(
        "certify belt-coulomb --set output.end_time=4",
        "belt-coulomb.certified.h5: holds another certified run: output.end_time & s there, 4 s here",
    );
    assert_eq!(folder.read("belt-coulomb.certified.h5"), certified);
    folder.ok("certify belt-coulomb -q");
}

/// The file of a study is replaced by the same study. A changed text, or another override, is named.
#[test]
fn cli_a_study_replaces_the_file_of_the_same_study_only() {
    let folder = Folder::new();
    folder.write("map.toml", crate::sweep::QUICK);
    folder.ok("sweep map.toml -q");
    let first = folder.read("map.h5");
    folder.ok("sweep map.toml -q");
    folder.ok("sweep map.toml -q --set solver.max_wall_time=1000");
    assert_eq!(folder.read("map.h5"), first);
    folder.refused(
        "sweep map.toml --set friction.decay=4",
        "map.h5: holds another sweep: friction.decay = 4 s/rad here, not set there & -o & --force",
    );
    folder.write("map.toml", crate::sweep::QUICK.replace("to = 30", "to = 40"));
    folder.refused(
        "sweep map.toml",
        "map.h5: holds another sweep: axis.0.to = 30 there, 40 here",
    );
    folder.refused("run paper -o map.h5", "map.h5: holds a sweep & --force");
    assert_eq!(folder.read("map.h5"), first);
    folder.ok("sweep map.toml -q --force");
    assert_ne!(folder.read("map.h5"), first);
}

/// A table does not name its run, so that only an identical one is replaced.
#[test]
fn cli_an_export_replaces_an_identical_table_only() {
    let folder = Folder::new();
    folder.ok_short("-q -o a.h5");
    folder.ok_short("-q -o b.h5 --set friction.decay=4");
    for format in ["csv", "npz", "mat"] {
        let name = format!("t.{format}");
        let export = |file: &str| format!("export {file} -o {name} --table events");
        folder.ok(&export("a.h5"));
        let first = folder.read(&name);
        folder.ok(&export("a.h5"));
        assert_eq!(folder.read(&name), first);
        folder.refused(
            &format!("export b.h5 -o {name}"),
            &[name.as_str(), "not this table", "--force"],
        );
        assert_eq!(folder.read(&name), first);
        folder.ok(&format!("export b.h5 -o {name} --force"));
    }
}

/// What `--set` changed stands in the report, the file, the page and the title, with units. Keys that were not changed
/// do not.
#[test]
fn cli_changes_are_shown() {
    let folder = Folder::new();
    let line = "friction.decay = 4 s/rad";
    let said = folder.ok_short("-o changed.h5 --set friction.decay=4");
    assert!(said.lines().nth(1).unwrap().contains(line), "{said}");
    assert!(said.contains("changed: friction.decay = 4 s/rad, "), "{said}");
    let file = folder.result("changed.h5");
    let changed = [
        "friction.decay = 4 s/rad",
        "output.end_time = 0.05 s",
        "output.interval = 0.001 s",
    ];
    assert_eq!(file.changed(), changed);
    drop(file);
    let second = folder.ok("inspect changed.h5").lines().nth(1).map(str::to_owned);
    assert!(second.unwrap().starts_with(&format!("changed: {line}, ")));
    folder.ok("plot changed.h5 --html page.html -q");
    assert!(
        String::from_utf8(folder.read("page.html"))
            .unwrap()
            .contains(&format!("changed: {line}"))
    );
    let drawn = folder.json("plot changed.h5 --channel z -o z.svg");
    let title = drawn["files"][0]["title"].text();
    // Overrides of the output change no curve.
    assert!(title.contains(&format!("({line})")), "{title}");
    // A repeated run keeps them, an override of the same key replaces its line.
    folder.ok("run changed.h5 -q --set friction.decay=5");
    let again = folder.result("changed.repeat.h5").changed();
    assert_eq!(
        again,
        [
            "output.end_time = 0.05 s",
            "output.interval = 0.001 s",
            "friction.decay = 5 s/rad"
        ]
    );
    // The case's own value is no change, and a unit has a blank before it.
    let own = "--set friction.decay=5 --set 'torsion.rotor_inertia=20 slug in ft' --method cvode --rtol 1e-10";
    folder.ok(&format!("run -q --end-time 10ms {own} -o own.h5"));
    assert_eq!(folder.result("own.h5").changed(), ["output.end_time = 10 ms"]);
    // A study's setting counts as its base case's.
    folder.write("study.toml", crate::sweep::QUICK);
    folder.ok("sweep study.toml -q --set output.end_time=0.01 --set friction.decay=5");
    assert_eq!(folder.sweep_file("study.h5").changed(), ["output.end_time = 0.01 s"]);
    folder.ok("run paper-si -q -o plain.h5");
    assert!(folder.result("plain.h5").changed().is_empty());
    assert!(!folder.ok("inspect plain.h5").contains("changed"));
    let modes = folder.json("modes --set friction.decay=4");
    assert_eq!(modes["changed"], serde_json::json!([line]));
}

/// A line of the file can be given to `--set` again: the same run follows.
#[test]
fn cli_a_change_is_an_argument_of_set() {
    let folder = Folder::new();
    folder.ok_short("-q -o a.h5 --set friction.decay=4");
    let changed = folder.result("a.h5").changed();
    let again = changed.iter().flat_map(|line| ["--set", line.as_str()]);
    let arguments: Vec<&str> = ["run", "-q", "-o", "b.h5"].into_iter().chain(again).collect();
    folder.ok(&arguments);
    let resolved = |name: &str| folder.result(name).resolved().unwrap();
    assert_eq!(resolved("a.h5"), resolved("b.h5"));
}

/// Of two values for one key, one would be lost in silence.
#[test]
fn cli_a_key_that_is_set_twice_is_refused() {
    let folder = Folder::new();
    for command in ["run", "certify", "modes", "cycle belt-leine", "sweep critical-curve"] {
        let arguments = format!("{command} --set friction.decay=4 --set friction.decay=5");
        folder.refused(
            &arguments,
            "--set friction.decay: given twice & friction.decay=4 & friction.decay=5",
        );
    }
    folder.refused(
        "run --method arkode --set solver.method=erk",
        "solver.method & given twice",
    );
    assert!(folder.names().is_empty());
}
