//! Reports on a terminal: what matters first, in one screen, and the rest with `-v`.

use crate::common::cli::{Folder, says};
use stickslip::case::builtin;

/// Most lines of a report without `-v`.
const SCREEN: usize = 15;

#[track_caller]
fn fits(folder: &Folder, command: &str) -> String {
    let text = folder.ok(command);
    let lines = text.lines().count();
    assert!(lines <= SCREEN, "{lines} lines of {command}:\n{text}");
    text
}

/// The report of a command, which fits a screen and is not the whole one. With `-v` it has the lines that the last one promises.
#[track_caller]
fn short(folder: &Folder, command: &str) -> String {
    let text = fits(folder, command);
    let lines: Vec<&str> = text.lines().collect();
    let promised = lines.last().unwrap().strip_prefix("-v shows the other ");
    let promised = promised.and_then(|rest| rest.strip_suffix(" lines")?.parse::<usize>().ok());
    let promised = promised.unwrap_or_else(|| panic!("{command}:\n{text}"));
    let whole = folder.ok(&*format!("{command} -v"));
    // The last line of the short report is the promise.
    assert_eq!(
        whole.lines().count(),
        lines.len() - 1 + promised,
        "{command}:\n{text}\n{whole}"
    );
    text
}

#[test]
fn cli_a_run_of_each_built_in_case_fits_a_screen() {
    let folder = Folder::new();
    for case in builtin::all() {
        let text = short(&folder, &format!("run {} --no-witness", case.name));
        assert!(text.lines().nth(2).unwrap().contains(" contact event"), "{text}");
        says(&text, &[format!("{}.h5", case.name)]);
    }
}

/// Numbers that a run does not have are details.
#[test]
fn cli_a_run_without_slips_prints_no_rows_of_none() {
    let folder = Folder::new();
    let text = short(&folder, "run paper --set output.end_time=0.02");
    assert_eq!(text.matches("none").count(), 1, "{text}");
    says(
        &text,
        "0 contact events (0 sticks, 0 slips) & onset of stick-slip  none",
    );
}

#[test]
fn cli_modes_of_each_built_in_case_fit_a_screen() {
    let folder = Folder::new();
    for case in builtin::all() {
        fits(&folder, &format!("modes {}", case.name));
    }
}

#[test]
fn cli_a_certificate_fits_a_screen() {
    let folder = Folder::new();
    let text = short(&folder, "certify belt-leine --force");
    says(
        &text,
        "converged: every event within & all 3 find the same 16 contact events & 9.2959995254801 & belt-leine.certified.h5",
    );
    // A parameter written with one digit is no parameter known to half of itself.
    says(
        &folder.ok("certify belt-leine --force -v"),
        "digits that are known, such as",
    );
}

#[test]
fn cli_cycles_fit_a_screen() {
    let folder = Folder::new();
    for case in ["belt-leine", "groan"] {
        let text = short(&folder, &format!("cycle {case} --force"));
        says(&text, "period & stability & nearest change");
    }
    fits(&folder, "certify belt-leine.cycle.h5 --digits 12 --force");
}

/// A comparison begins with whether the runs agree, the cause with both values, and what to do.
#[test]
fn cli_comparisons_fit_a_screen() {
    let folder = Folder::new();
    folder.ok("run belt-leine -q");
    folder.ok("export belt-leine.h5 -q -o same.csv");
    let text = short(&folder, "compare belt-leine.h5 same.csv");
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[1].starts_with("All 16 events agree within "), "{text}");
    assert!(lines[2].starts_with("Next: give its events (--events FILE)"), "{text}");

    let moved = "run belt-leine -q -o moved.h5 --set initial.stator_twist=0.1 --set initial.stator_speed=0.1";
    folder.ok(moved);
    folder.ok("export moved.h5 -q -o moved.csv");
    let text = short(&folder, "compare belt-leine.h5 moved.csv");
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[1].starts_with("The events part: "), "{text}");
    assert!(lines[2].starts_with("Likely cause: another initial state: "), "{text}");
    says(
        lines[2],
        "= 0.1 m & instead of 0, & = 0.1 m/s instead of 0.2 & With it the reference has all ",
    );
    assert_eq!(lines[3], "Next: begin in the state of the reference.");

    // The key that differs is known if the candidate has its case.
    let text = short(&folder, "compare belt-leine.h5 moved.h5");
    says(
        &text,
        "Likely cause: another case: initial.stator_ & instead of & -v lists the keys that differ",
    );
}

/// The contents of a file are details.
#[test]
fn cli_inspect_fits_a_screen() {
    const LINES: usize = 25;
    let folder = Folder::new();
    folder.write("quick.toml", crate::sweep::QUICK);
    folder.ok("run -q --set friction.decay=4");
    folder.ok("certify belt-leine -q");
    folder.ok("cycle belt-leine -q");
    folder.ok("sweep quick.toml -q");
    let texts = ["paper.h5", "belt-leine.certified.h5", "belt-leine.cycle.h5", "quick.h5"].map(|file| {
        let text = folder.ok(&["inspect", file]);
        assert!(text.lines().count() <= LINES, "{file}:\n{text}");
        says(
            &text,
            "made by & history & group & rows & /input & /meta & -v shows the other",
        );
        text
    });
    let first = &texts[0];
    assert!(
        first.starts_with("Two-disk brake, the paper's parameters in US units\nchanged: friction.decay = 4 s/rad\n")
    );
    says(
        first,
        "stickslip-result, complete & cvode, rtol 1e-10 & 10 s & events, & sticks, & /trajectory",
    );
    says(&texts[3], "stickslip-sweep, complete & 6 x 3 x 2");
}

/// Studies say in one screen what they found.
#[test]
fn cli_studies_fit_a_screen() {
    let folder = Folder::new();
    folder.write("inertia.toml", crate::calibrate::QUICK);
    folder.write("small.toml", crate::work_precision::STUDY);
    folder.write("branches.toml", crate::plot_branches::STUDY);
    for study in ["calibrate inertia", "work-precision small", "continue branches"] {
        short(&folder, &format!("{study}.toml"));
    }
}

/// One line for each quantity; histograms are details, also of `plot`.
#[test]
fn cli_a_sample_is_one_line_for_each_quantity() {
    let folder = Folder::new();
    folder.write(
        "spread.toml",
        "case = \"belt-leine\"\nset = { solver.method = \"series\" }\nshow = [\"attractor_period\", \"stick_count\"]\n\
         axis = [{ key = \"contact.normal_force\", from = 0.9, to = 1.1 }]\nsample = { method = \"sobol\", count = 16 }\n",
    );
    let text = short(&folder, "sweep spread.toml");
    says(&text, "median & attractor_period (s) & stick_count & spread.h5");
    assert!(!text.contains("##"), "{text}");
    says(&folder.ok("sweep spread.toml -v"), "##");
    assert!(!folder.ok("plot spread.h5 --force").contains("##"));
}
