//! `stickslip sweep --shard` and `stickslip merge` from the user's side. Shards give the file of a single machine,
//! and shards that do not make a whole study are refused.

use crate::common::cli::{Folder, json, output, refusal, says, send};
use crate::common::json::*;
use crate::common::unlocked;
use crate::sweep::QUICK;

/// Runs of a few milliseconds, a third of which fail, over three axes. The last axis is short, and consists of words.
fn grid() -> String {
    QUICK
        .replace("count = 6", "count = 5")
        .replace("\"arkode\", \"erk\"", "\"series\", \"cvode\"")
}

/// The same as a sample, which is a table of points.
pub const SAMPLE: &str = r#"
case = "paper"
[set]
output.end_time = 0.02
actuation.rise_time = 0.01
solver.method = "series"
[sample]
method = "latin-hypercube"
count = 23
[[axis]]
key = "torsion.damping"
from = 10
to = 30
[[axis]]
key = "contact.breakaway_test"
values = ["transmitted", "stator"]
[[axis]]
key = "friction.low_speed"
from = 0.3
to = 0.9
"#;

/// A contact without stick, whose threshold depends on its smoothness, at every point.
pub const SMOOTH: &str = r#"
title = "a smooth belt"
case = "belt-leine-tanh"
set = { solver.method = "series", output.end_time = 12 }
keep = { events = true }
axis = [
    { key = "rotor.speed", from = "0.1 m/s", to = 0.4, count = 4 },
    { key = "friction.regularisation.speed", values = [2e-3, "5 mm/s"] },
]
"#;

fn studies() -> [(&'static str, String, usize, bool); 3] {
    [
        ("grid", grid(), 30, true),
        ("belt", SMOOTH.to_owned(), 8, false),
        ("sample", SAMPLE.to_owned(), 23, true),
    ]
}

/// Sweeps every shard of a study, and returns the names of the files.
fn shards(folder: &Folder, study: &str, count: usize) -> Vec<String> {
    let names = (1..=count).map(|shard| {
        let part = format!("{shard}/{count}");
        let report = folder.json(&["sweep", &format!("{study}.toml"), "--shard", &part]);
        assert_eq!(report["shard"]["index"], shard);
        let name = format!("{study}.shard-{shard}-of-{count}.h5");
        assert_eq!(report["file"], name.as_str());
        name
    });
    names.collect()
}

fn merge(folder: &Folder, shards: &[String], more: &[&str]) -> assert_cmd::Command {
    let mut arguments = vec!["merge"];
    arguments.extend(shards.iter().map(String::as_str));
    arguments.extend(more);
    folder.stickslip(&arguments)
}

#[test]
fn property_shards_of_any_number_make_the_bytes_of_one_machine() {
    let folder = Folder::new();
    for (study, text, points, fail) in studies() {
        folder.write(&format!("{study}.toml"), text);
        let one = format!("{study}.h5");
        folder.ok(&["sweep", &format!("{study}.toml")]);
        for count in 1..=5 {
            let mut names = shards(&folder, study, count);
            names.reverse();
            let merged = format!("{study}-{count}.h5");
            let (stdout, _) = output(&mut merge(&folder, &names, &["-o", &merged, "--json"]), 0);
            let report = json(&stdout);
            assert_eq!((&report["points"], &report["shards"]), (&points.into(), &count.into()));
            let found = report["failed"].whole() > 0;
            assert_eq!(found, fail, "{study} has points that fail");
            assert!(folder.read(&one) == folder.read(&merged), "{study} in {count} shards");
        }
    }
}

#[test]
fn cli_shards_that_make_no_whole_are_refused() {
    let folder = Folder::new();
    folder.write("map.toml", SAMPLE);
    folder.write("other.toml", SAMPLE.replace("to = 30", "to = 31"));
    let three = shards(&folder, "map", 3);
    let two = shards(&folder, "map", 2);
    let other = shards(&folder, "other", 3);
    let refused = |names: &[&str], words: &str| {
        let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
        let stderr = refusal(&mut merge(&folder, &names, &["-o", "no.h5"]));
        says(&stderr, words);
        assert!(!folder.path("no.h5").exists());
    };
    let [first, second, third] = [0, 1, 2].map(|place| three[place].as_str());
    refused(&[first, third], "shard 2 of 3 is missing & --shard");
    refused(&[second], "shards 1 and 3 of 3 are missing");
    let words = format!("different studies & {first} & {}", other[2]);
    refused(&[first, second, &other[2]], &words);
    refused(&[first, second, third, second], "are both shard 2 of 3");
    refused(&[first, &two[1]], "one of 3 shards & one of 2");
    // As another build of the program would have written it.
    std::fs::copy(folder.path(&three[2]), folder.path("built.h5")).unwrap();
    {
        let file = unlocked::open_rw(folder.path("built.h5")).unwrap();
        let meta = file.group("meta").unwrap();
        meta.delete_attr("program_commit").unwrap();
        let commit = meta.new_attr::<hdf5::types::VarLenUnicode>().create("program_commit");
        let another: hdf5::types::VarLenUnicode = "another".parse().unwrap();
        commit.unwrap().write_scalar(&another).unwrap();
    }
    let words = "different builds of the program & program_commit & another";
    refused(&[first, second, "built.h5"], words);
    let stderr = refusal(&mut merge(&folder, &three, &["-o", "no.h5", "--virtual"]));
    says(&stderr, &["--virtual is gone", "merge copies"]);
    refused(&["absent.h5"], "absent.h5: no such file");
    refused(
        &["map.toml"],
        "map.toml: a study, not a result & stickslip sweep map.toml",
    );
    folder.ok("sweep map.toml");
    refused(&["map.h5"], "map.h5: not the file of a shard");
    // A shard is not a complete study, either.
    folder.refused(&["plot", &three[0]], &["not"]);
    // Existing files are kept: the output and, above all, an input.
    let before = folder.read("map.h5");
    let stderr = refusal(&mut merge(&folder, &three, &["-o", "map.h5"]));
    says(&stderr, &["map.h5: exists", "--force"]);
    let stderr = refusal(&mut merge(&folder, &three, &["-o", &three[1], "--force"]));
    assert!(stderr.contains("this is an input"), "{stderr}");
    assert!(before == folder.read("map.h5"));
    output(&mut merge(&folder, &three, &["-o", "map.h5", "--force"]), 0);
    assert!(before == folder.read("map.h5"));
    // An interruption leaves a partial file, which is no shard.
    let partial = "map.shard-2-of-3.partial.h5";
    std::fs::rename(folder.path(&three[1]), folder.path(partial)).unwrap();
    refused(
        &[first, second, third],
        &format!("{second} & was interrupted & --resume"),
    );
}

#[test]
fn cli_an_interrupted_shard_is_incomplete_and_resumes() {
    let folder = Folder::new();
    // Slow enough to be interrupted: a few hundred points.
    let study = SAMPLE.replace("count = 23", "count = 3000");
    folder.write("map.toml", study);
    let mut child = folder.start("sweep map.toml --shard 2/2 -j 1");
    folder.wait_for(&mut child, "map.shard-2-of-2.journal", 2000);
    send("TERM", child.id());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    folder.ok("sweep map.toml --shard 1/2");
    let names = [
        "map.shard-1-of-2.h5".to_owned(),
        "map.shard-2-of-2.partial.h5".to_owned(),
    ];
    let stderr = refusal(&mut merge(&folder, &names, &["-o", "all.h5"]));
    says(&stderr, &["shard 2 of 2 is incomplete", "of its 1500 points are done"]);
    let report = folder.json("sweep map.toml --shard 2/2 --resume");
    assert_eq!(report["points"], 1500);
    assert!(report["run_now"].whole() < 1500);
    // The second time there is nothing left to do. Another shard under this name is refused.
    let again = ["sweep", "map.toml", "--shard", "2/2", "--resume", "--json"];
    assert_eq!(json(&folder.ok(&again))["run_now"], 0);
    folder.refused(
        "sweep map.toml --shard 1/2 --resume -o map.shard-2-of-2.h5",
        "holds another shard (2 of 2, not 1 of 2)",
    );
    let names = ["map.shard-1-of-2.h5".to_owned(), "map.shard-2-of-2.h5".to_owned()];
    output(&mut merge(&folder, &names, &["-o", "all.h5"]), 0);
    folder.ok("sweep map.toml");
    assert!(folder.read("all.h5") == folder.read("map.h5"));
}

#[test]
fn cli_a_task_of_a_job_array_knows_its_shard() {
    let folder = Folder::new();
    folder.write("map.toml", SAMPLE);
    for task in ["0", "1"] {
        let mut command = folder.stickslip("sweep map.toml --shard slurm");
        for (name, value) in [("ID", task), ("MIN", "0"), ("MAX", "1"), ("STEP", "1"), ("COUNT", "2")] {
            command.env(format!("SLURM_ARRAY_TASK_{name}"), value);
        }
        output(&mut command, 0);
    }
    let found = folder.names();
    assert_eq!(found, ["map.shard-1-of-2.h5", "map.shard-2-of-2.h5", "map.toml"]);
    let mut outside = folder.stickslip("sweep map.toml --shard slurm");
    outside.env_remove("SLURM_ARRAY_TASK_ID");
    let stderr = refusal(&mut outside);
    assert!(stderr.contains("SLURM_ARRAY_TASK_ID is not set"), "{stderr}");
    folder.refused("sweep map.toml --shard 3/2", &["K/N with K from 1 to N"]);
    folder.refused(
        "sweep map.toml --shard 1/24",
        "the study has 23 points, too few for 24 shards",
    );
    // Several processes that do not know of each other would all compute the same points.
    says(
        &folder.refused("sweep map.toml --mpi -o ranks.h5", ""),
        "--shard K/N & executor=...",
    );
    for variable in ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"] {
        let stderr = refusal(folder.stickslip("sweep map.toml -o ranks.h5").env(variable, "2"));
        says(&stderr, &["ranks of an MPI job", "--shard K/N", "executor=..."]);
        output(
            folder
                .stickslip("sweep map.toml -o ranks.h5 --force")
                .env(variable, "1"),
            0,
        );
        output(
            folder
                .stickslip("sweep map.toml --shard 1/2 -o ranks.h5 --force")
                .env(variable, "2"),
            0,
        );
    }
    folder.refused("sweep critical-curve --shard 1/4", &["traces a boundary", "executor"]);
}

/// A merge of many shards has few of them open at a time, and starts no process for sealed ones. Here the program no
/// longer exists when it merges.
#[cfg(target_os = "linux")]
#[test]
fn cli_merge_of_many_shards_takes_few_files_and_no_process() {
    let folder = Folder::new();
    let study = SAMPLE.replace("count = 23", "count = 40");
    folder.write("many.toml", study);
    folder.ok("sweep many.toml -o whole.h5 -q");
    let names = shards(&folder, "many", 40);
    std::fs::copy(env!("CARGO_BIN_EXE_stickslip"), folder.path("program")).unwrap();
    let command = "ulimit -n 32 && exec 3<program && rm program && exec /proc/self/fd/3 merge -q -o merged.h5 \"$@\"";
    let merged = std::process::Command::new("sh")
        .args(["-c", command, "sh"])
        .args(&names)
        .current_dir(folder.path(""))
        .output()
        .unwrap();
    assert!(merged.status.success(), "{}", crate::common::cli::text(&merged.stderr));
    assert!(folder.read("merged.h5") == folder.read("whole.h5"));
}
