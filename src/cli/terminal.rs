//! Tables for the terminal.

use crate::analysis::Summary;
use crate::case::Case;
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

/// The paper's own numbers (its sections 4.2 to 4.5), beside which the built-in case is put.
mod paper {
    pub const ONSET: &str = "6.975 s";
    pub const FINAL_STICK: &str = "6.9896 s";
    pub const FIRST_STICK: &str = "50 us";
    pub const LAST_STICK: &str = "530 us";
    pub const SLIP: &str = "190 us";
    pub const SLIP_RANGE: &str = "nearly constant";
    pub const NATURAL_PERIOD: &str = "240 us";
    pub const FIRST_PERIOD: &str = "1";
    pub const LAST_PERIOD: &str = "3";
    pub const AXIAL: &str = "0.04 mm";
}

/// A table in the program's style.
pub(super) fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Dynamic);
    if !header.is_empty() {
        table.set_header(header);
    }
    table
}

/// A table as lines without a margin and without blanks at their ends.
pub(super) fn show(table: &Table) -> String {
    table
        .lines()
        .map(|line| format!("{}\n", line.strip_prefix(' ').unwrap_or(&line).trim_end()))
        .collect()
}

/// Numbers stand below each other by their last digit.
pub(super) fn align_right(table: &mut Table, columns: impl IntoIterator<Item = usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

/// The report of a run.
pub(super) fn run_report(case: &Case, summary: &Summary, beside_paper: bool, wall_time: f64) -> String {
    let s = summary;
    let residual = format!(
        "{:.1e} J, {:.1e} relative",
        s.energy_residual, s.energy_residual_relative
    );
    let rows = [
        (
            "events",
            format!(
                "{} ({}, {})",
                s.events,
                count(s.sticks, "stick"),
                count(s.slips, "slip")
            ),
            "",
        ),
        ("onset of stick-slip", time(s.onset_time), paper::ONSET),
        ("stick for good", time(s.final_stick_time), paper::FINAL_STICK),
        (
            "slip duration, first / last",
            pair(s.first_slip_duration, s.last_slip_duration),
            paper::SLIP,
        ),
        ("slip duration, range", range(s.slip_duration_range), paper::SLIP_RANGE),
        (
            "stick duration, first",
            microseconds(s.first_stick_duration),
            paper::FIRST_STICK,
        ),
        (
            "stick duration, last",
            microseconds(s.last_stick_duration),
            paper::LAST_STICK,
        ),
        ("stick duration, range", range(s.stick_duration_range), ""),
        (
            "natural period T_n",
            microseconds(Some(s.natural_period)),
            paper::NATURAL_PERIOD,
        ),
        (
            "first period T_i / T_n",
            ratio(s.first_period, s.natural_period),
            paper::FIRST_PERIOD,
        ),
        (
            "last period T_f / T_n",
            ratio(s.last_period, s.natural_period),
            paper::LAST_PERIOD,
        ),
        (
            "axial displacement",
            format!("{:.4} mm", s.axial_displacement * 1e3),
            paper::AXIAL,
        ),
        ("loss of stability", time(s.instability_time), ""),
        ("growth exponent G", number(s.growth_exponent), ""),
        ("e-folds gained from the kick", number(s.e_folds_gained), ""),
        ("energy residual", residual, ""),
    ];
    let mut report = table(if beside_paper { &["", "this run", "paper"] } else { &[] });
    for (name, value, paper) in rows {
        if beside_paper {
            report.add_row([name, &value, paper]);
        } else {
            report.add_row([name, &value]);
        }
    }
    let mut work = table(&[
        "solver",
        "segments",
        "simulated s",
        "steps",
        "right-hand sides",
        "Jacobians",
    ]);
    for w in &s.work {
        work.add_row([
            w.solver.to_owned(),
            w.segments.to_string(),
            format!("{:.4}", w.simulated_time),
            w.steps.to_string(),
            w.rhs_evaluations.to_string(),
            w.jacobian_evaluations.to_string(),
        ]);
    }
    align_right(&mut work, 1..6);
    format!(
        "{}\nmethod {}, rtol {:e}, t = 0 to {} s in {:.3} s of wall time\n\n{}\n{}",
        case.title,
        case.solver.method.name(),
        case.solver.rtol,
        s.end,
        wall_time,
        show(&report),
        show(&work),
    )
}

fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn time(t: Option<f64>) -> String {
    t.map_or_else(none, |t| format!("{t:.9} s"))
}

fn microseconds(t: Option<f64>) -> String {
    t.map_or_else(none, |t| format!("{:.2} us", t * 1e6))
}

fn pair(first: Option<f64>, last: Option<f64>) -> String {
    match (first, last) {
        (Some(first), Some(last)) => format!("{:.2} / {:.2} us", first * 1e6, last * 1e6),
        _ => none(),
    }
}

fn range(bounds: Option<(f64, f64)>) -> String {
    bounds.map_or_else(none, |(low, high)| format!("{:.2} to {:.2} us", low * 1e6, high * 1e6))
}

fn ratio(period: Option<f64>, natural: f64) -> String {
    period.map_or_else(none, |p| format!("{:.4}", p / natural))
}

fn number(x: Option<f64>) -> String {
    x.map_or_else(none, |x| format!("{x:.2}"))
}

fn none() -> String {
    "none".to_owned()
}
