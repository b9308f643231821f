//! `stickslip cycle` from a point of a branch, and its report.

use crate::common::cli::{Folder, says};
use crate::common::json::*;
use crate::plot_branches::with_branches;
use stickslip::continuation::Stored;

#[test]
fn cli_a_point_of_a_branch_is_its_cycle() {
    let folder = with_branches();
    let stored = Stored::read(&folder.path("belt.h5")).unwrap();
    let mut branches = stored.branches.iter().enumerate();
    let (number, branch) = branches
        .find(|(_, branch)| !branch.steady && branch.points.len() > 2)
        .unwrap();
    let point = &branch.points[1];
    let found = folder.json(&format!("cycle belt.h5 --branch {number} --point 1"));
    let close = |name: &str, expected: f64| {
        let value = found[name].number();
        assert!((value / expected - 1.0).abs() < 1e-9, "{name}: {value} {expected}");
    };
    close("period", point.period);
    close("amplitude", (point.position.1 - point.position.0) / 2.0);
    assert_eq!(found["stability"], point.stability.name());
    // The file is named after the branch's file and the point, and its case has the parameter of the point.
    let name = format!("belt-{number}-1.cycle.h5");
    assert_eq!(found["file"], name.as_str());
    let end = folder.result(&name).resolved().unwrap();
    says(&end, &[format!("{:?}", point.value)]);
    // Newton's method starts on the cycle.
    assert!(found["iterations"].whole() <= 2, "{found}");
}

/// The nearest change of the event sequence has a time in the file, like the events: here that of the shallowest
/// separation.
#[test]
fn cli_the_nearest_change_is_at_its_event() {
    let force = "contact.normal_force={profile='cosine',mean=9.5,amplitude=10,angular_frequency=3}";
    let folder = Folder::new();
    let found = folder.json(&["cycle", "belt-coulomb", "--set", force]);
    assert_eq!(found["nearest"]["border"], "separation", "{found}");
    let time = found["nearest"]["time"].number();
    let events = found["events"].list().iter();
    let mut separations = events.filter(|event| event["kind"] == "separation");
    // The same time, except for the rounding of the shift.
    assert!(
        separations.any(|event| (event["time"].number() - time).abs() < 1e-12),
        "{found}"
    );
}

#[test]
fn cli_wrong_points_of_branches() {
    let folder = with_branches();
    let stored = Stored::read(&folder.path("belt.h5")).unwrap();
    let count = stored.branches.len();
    let steady = stored.branches.iter().position(|branch| branch.steady).unwrap();
    let points = stored.branches[steady].points.len();
    folder.refused(
        "cycle belt.h5",
        &[format!("holds {count} branches; choose a point with --branch")],
    );
    folder.refused(
        &format!("cycle belt.h5 --branch {count} --point 0"),
        &[format!("has no branch {count}; there are {count}")],
    );
    folder.refused(
        &format!("cycle belt.h5 --branch {steady} --point {points}"),
        &[format!("branch {steady} has no point {points}; there are {points}")],
    );
    folder.refused(
        &format!("cycle belt.h5 --branch {steady} --point 0"),
        "steady sliding & stickslip modes belt-exponential --set rotor.speed=",
    );
    folder.refused(
        "cycle belt-exponential --branch 0 --point 0",
        "is not the file of a continuation",
    );
    folder.refused("cycle belt.h5 --branch 0", "--point");
    folder.refused("cycle belt.h5 --branch 0 --point 0 --periods 2", "--periods");
    assert_eq!(folder.names(), ["belt.h5", "belt.toml"]);
}

#[test]
fn cli_the_file_of_branches_is_not_replaced() {
    let folder: Folder = with_branches();
    let before = folder.read("belt.h5");
    let stored = Stored::read(&folder.path("belt.h5")).unwrap();
    let cycles = stored.branches.iter().position(|branch| !branch.steady).unwrap();
    folder.refused(
        &format!("cycle belt.h5 --branch {cycles} --point 0 -o belt.h5 --force"),
        "belt.h5",
    );
    assert!(folder.read("belt.h5") == before);
}

/// The search for a cycle and the branches that follow from it obey the wall time that a case allows.
#[test]
fn cli_the_wall_time_of_cycles_and_branches_is_kept() {
    let folder = Folder::new();
    let (_, stderr) = folder.ends("cycle belt-exponential --set solver.max_wall_time=1e-6", 1);
    says(&stderr, "wall time & max_wall_time");
    assert_eq!(folder.names(), [""; 0]);
    let study = "continue sliding-bifurcations -o b.h5 -q";
    let started = std::time::Instant::now();
    let (_, stderr) = folder.ends(&format!("{study} --set solver.max_wall_time=1"), 1);
    says(&stderr, "max_wall_time is over & b.journal & --resume");
    assert!(started.elapsed().as_secs() < 60);
    assert_eq!(folder.names(), ["b.journal", "b.partial.h5"]);
    let again = "--resume --set 'solver.max_wall_time=\"1.5 s\"'";
    let (_, stderr) = folder.ends(&format!("{study} {again}"), 1);
    says(&stderr, "max_wall_time is over");
}
