//! Candidates with two rows at the time of an event: the states before and after it, as FMI and Modelica write them.

use crate::common::cli::Folder;
use crate::common::json::*;
use std::fmt::Write as _;

const NAMES: [&str; 4] = ["phi1", "phi1_dot", "phi2", "phi2_dot"];

/// The samples of a run with a kick at 0.02 s, and two rows for each event; `twice`: all rows twice.
fn candidate(folder: &Folder, twice: bool) -> String {
    let file = folder.result("kicked.h5");
    let rows = 0..file.sample_count().unwrap();
    let times = file.column("time", rows.clone()).unwrap();
    let columns = NAMES.map(|name| file.column(name, rows.clone()).unwrap());
    let events = file.event_column("time").unwrap();
    let side = |side: &str| NAMES.map(|name| file.event_column(&format!("{name}_{side}")).unwrap());
    let (before, after) = (side("before"), side("after"));
    let mut table: Vec<(f64, Vec<f64>)> = Vec::new();
    for (row, &time) in times.iter().enumerate() {
        if !events.contains(&time) {
            table.push((time, columns.iter().map(|column| column[row]).collect()));
        }
    }
    for (row, &time) in events.iter().enumerate() {
        for states in [&before, &after] {
            table.push((time, states.iter().map(|column| column[row]).collect()));
        }
    }
    table.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut text = format!("time,{}\n", NAMES.join(","));
    for (time, values) in table {
        let mut line = format!("{time:?}");
        values.iter().for_each(|value| write!(line, ",{value:?}").unwrap());
        for _ in 0..if twice { 2 } else { 1 } {
            writeln!(text, "{line}").unwrap();
        }
    }
    text
}

/// The rows before and after the kick are compared with the states before and after it: none is wrong.
#[test]
fn cli_compare_reads_two_rows_of_one_time() {
    let folder = Folder::new();
    let kick = "perturbation=[{time=0.0203, relative_velocity=0.5}]";
    folder.ok_short(&["-q", "-o", "kicked.h5", "--set", kick]);
    let kicks = folder.result("kicked.h5").event_column("time").unwrap();
    assert!(kicks.contains(&0.0203), "{kicks:?}");
    for twice in [false, true] {
        folder.write("c.csv", candidate(&folder, twice));
        let found = folder.json("compare kicked.h5 c.csv --quick");
        let compared = &found["comparisons"][0];
        for channel in compared["channels"].list() {
            assert!(channel["max"].number() < 1e-9, "{channel}");
        }
        assert_eq!(compared["causes"], serde_json::json!([]), "{}", compared["verdict"]);
    }
    // The same table with the state before the kick after it.
    let text = candidate(&folder, false);
    let mut lines: Vec<&str> = text.lines().collect();
    let at = lines.iter().position(|line| line.starts_with("0.0203,")).unwrap();
    lines.swap(at, at + 1);
    folder.write("wrong.csv", lines.join("\n"));
    let found = folder.json("compare kicked.h5 wrong.csv --quick");
    let channels = found["comparisons"][0]["channels"].list();
    let largest = channels.iter().map(|channel| channel["max"].number());
    assert!(largest.fold(0.0, f64::max) > 0.4, "{channels:?}");
    // Times still may not go back.
    lines.swap(at - 3, at - 6);
    folder.write("back.csv", lines.join("\n"));
    folder.refused("compare kicked.h5 back.csv", "back.csv & comes after & sort the rows");
}
