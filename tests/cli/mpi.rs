//! A sweep under MPI: the file of one machine, whatever the number of ranks, also of a boundary, and also after a rank was
//! killed. Needs the feature `mpi`, and `mpirun`.
#![cfg(unix)]

use crate::common::cli::{Folder, json, output, send, text};
use crate::shards::SAMPLE;
use crate::sweep::BOUNDARY;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Runs of a few milliseconds, some of which fail.
fn sample() -> String {
    SAMPLE.replace("count = 23", "count = 400") + "[keep]\nevents = true\n"
}

/// A light rotor that stops within milliseconds; three planes.
fn boundary() -> String {
    let (planes, axes) = (
        "{ key = \"initial.speed\", values = [8, 10, 12] },",
        "x = \"friction.decay\", y = \"torsion.damping\", ",
    );
    BOUNDARY
        .replace("initial.speed = 10, ", "")
        .replace("axis = [", &format!("axis = [\n    {planes}"))
        .replace("boundary = { ", &format!("boundary = {{ {axes}"))
}

/// `mpirun` of some ranks on this machine, root or not, with fewer processors than ranks or not.
fn mpirun(folder: &Folder, ranks: usize, arguments: &[&str]) -> Command {
    let mut command = Command::new("mpirun");
    command
        .current_dir(folder.path(""))
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .args(["-n", &ranks.to_string(), env!("CARGO_BIN_EXE_stickslip")])
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Waits for the end, for two minutes at most.
fn ended(mut child: Child) -> Output {
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(120) {
            child.kill().unwrap();
            let output = child.wait_with_output().unwrap();
            panic!("it hangs: {}{}", text(&output.stdout), text(&output.stderr));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().unwrap()
}

fn run(folder: &Folder, ranks: usize, arguments: &[&str]) -> Output {
    ended(mpirun(folder, ranks, arguments).spawn().expect("mpirun is installed"))
}

fn report(output: &Output) -> serde_json::Value {
    let stderr = text(&output.stderr);
    assert!(output.status.success(), "{}{stderr}", text(&output.stdout));
    json(&text(&output.stdout))
}

fn same(folder: &Folder, first: &str, second: &str) {
    let read = |name: &str| folder.read(name);
    assert!(read(first) == read(second), "{first} and {second}");
}

#[test]
fn property_any_number_of_ranks_gives_the_file_of_one_machine() {
    let folder = Folder::new();
    for (study, text) in [("sample", sample()), ("boundary", boundary())] {
        let name = format!("{study}.toml");
        folder.write(&name, text);
        folder.ok(&["sweep", &name]);
        for (ranks, jobs) in [(2, "1"), (3, "2")] {
            let report = report(&run(
                &folder,
                ranks,
                &["sweep", &name, "-o", "ranks.h5", "-j", jobs, "--json"],
            ));
            assert_eq!(report["ranks"], ranks);
            same(&folder, &format!("{study}.h5"), "ranks.h5");
        }
    }
    // The journals of the ranks are gone with that of the sweep.
    assert_eq!(
        folder.names(),
        ["boundary.h5", "boundary.toml", "ranks.h5", "sample.h5", "sample.toml"]
    );
    // One rank is a job, too, and a shard may be run by several.
    report(&run(
        &folder,
        1,
        &["sweep", "sample.toml", "--mpi", "-o", "ranks.h5", "--json"],
    ));
    same(&folder, "sample.h5", "ranks.h5");
    for shard in ["1/2", "2/2"] {
        report(&run(
            &folder,
            2,
            &["sweep", "sample.toml", "--mpi", "--shard", shard, "--json"],
        ));
    }
    let parts = ["sample.shard-1-of-2.h5", "sample.shard-2-of-2.h5"];
    folder.ok(&["merge", parts[0], parts[1], "-o", "ranks.h5", "--force"]);
    same(&folder, "sample.h5", "ranks.h5");
}

/// Processes whose parent is this one.
fn children(parent: u32) -> Vec<u32> {
    let listing = Command::new("ps")
        .args(["-o", "pid=", "--ppid", &parent.to_string()])
        .output()
        .unwrap();
    let numbers = text(&listing.stdout);
    numbers
        .split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect()
}

fn waits_for(what: &str, mut there: impl FnMut() -> bool) {
    let start = Instant::now();
    while !there() {
        assert!(start.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn property_killed_ranks_lose_what_is_under_way_and_a_resumed_job_ends_the_same() {
    let folder = Folder::new();
    folder.write("map.toml", sample().replace("count = 400", "count = 4000"));
    folder.ok("sweep map.toml");
    let length = |name: &str| std::fs::metadata(folder.path(name)).map_or(0, |file| file.len());
    // The last rank of a job, and rank 0 of another.
    for (victim, name) in [(2, "last"), (0, "first")] {
        let file = format!("{name}.h5");
        let sweep = ["sweep", "map.toml", "-o", &file, "--resume"];
        let job = mpirun(&folder, 3, &sweep).spawn().unwrap();
        let journals = [1, 2].map(|rank| format!("{name}.rank-{rank}.journal"));
        waits_for("every rank stores points", || {
            journals.iter().all(|journal| length(journal) > 3000)
        });
        let ranks = children(job.id());
        assert_eq!(ranks.len(), 3, "{ranks:?}");
        send("KILL", ranks[victim]);
        assert!(!ended(job).status.success());
        assert!(!folder.path(&file).exists());
        let report = report(&run(&folder, 2, &[&sweep[..], &["--json"]].concat()));
        assert_eq!(report["points"], 4000);
        // What two journals of 3,000 bytes hold is not run again; a point takes less than 600.
        assert!(report["run_now"].as_u64().unwrap() <= 4000 - 10);
        same(&folder, "map.h5", &file);
    }
    assert_eq!(folder.names(), ["first.h5", "last.h5", "map.h5", "map.toml"]);
}

#[test]
fn cli_a_terminated_job_saves_its_points_for_one_machine_to_go_on_with() {
    let folder = Folder::new();
    // Open MPI takes a second or two to hand the signal on: the study has to last longer.
    let points = 20_000;
    folder.write(
        "map.toml",
        sample().replace("count = 400", &format!("count = {points}")),
    );
    folder.ok("sweep map.toml");
    let job = mpirun(&folder, 2, &["sweep", "map.toml", "-o", "ended.h5"])
        .spawn()
        .unwrap();
    let journal = folder.path("ended.rank-1.journal");
    waits_for("the rank stores points", || {
        std::fs::metadata(&journal).is_ok_and(|file| file.len() > 3000)
    });
    send("TERM", job.id());
    assert!(!ended(job).status.success());
    // Without --resume nothing of it is touched.
    let (_, stderr) = output(&mut folder.stickslip("sweep map.toml -o ended.h5"), 2);
    assert!(stderr.contains("--resume goes on with it"), "{stderr}");
    assert!(
        folder.json("sweep map.toml -o ended.h5 --resume")["run_now"]
            .as_u64()
            .unwrap()
            < points
    );
    same(&folder, "map.h5", "ended.h5");
    assert_eq!(folder.names(), ["ended.h5", "map.h5", "map.toml"]);
}

#[test]
fn cli_what_is_wrong_is_said_once() {
    let folder = Folder::new();
    folder.write("map.toml", sample().replace("count = 400", "count = 0"));
    let failed = run(&folder, 3, &["sweep", "map.toml"]);
    let stderr = text(&failed.stderr);
    assert_eq!(failed.status.code(), Some(2), "{stderr}");
    assert_eq!(stderr.matches("map.toml:9: sample.count").count(), 1, "{stderr}");
    folder.write("map.toml", sample());
    folder.write("taken.h5", "not a result");
    let failed = run(&folder, 3, &["sweep", "map.toml", "-o", "taken.h5"]);
    let stderr = text(&failed.stderr);
    assert_eq!(failed.status.code(), Some(2), "{stderr}");
    assert_eq!(stderr.matches("is not a result of this program").count(), 1, "{stderr}");
    assert_eq!(folder.names(), ["map.toml", "taken.h5"]);
}
