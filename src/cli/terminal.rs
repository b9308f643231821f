//! Tables for the terminal.

use crate::analysis::summary::SolverWorkRow;
use crate::analysis::{Headline, HeadlineRow, Summary};
use crate::case::Case;
use crate::simulation::{OutputOptions, SolverOptions};
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

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
    let mut report = table(if beside_paper { &["", "this run", "paper"] } else { &[] });
    for HeadlineRow { name, value, paper } in Headline::from(summary).rows() {
        if beside_paper {
            report.add_row([name, &value, paper]);
        } else {
            report.add_row([name, &value]);
        }
    }
    with_work(
        &case.title,
        &case.solver,
        &case.output,
        summary.end,
        wall_time,
        &report,
        &summary.work,
    )
}

/// A report of a run, which came to `end` (s): its headline, and what its solvers did.
pub(super) fn with_work(
    title: &str,
    solver: &SolverOptions,
    output: &OutputOptions,
    end: f64,
    wall_time: f64,
    headline: &Table,
    rows: &[SolverWorkRow],
) -> String {
    let mut work = table(&[
        "solver",
        "segments",
        "simulated s",
        "steps",
        "right-hand sides",
        "Jacobians",
    ]);
    for w in rows {
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
    // As the case has it, unless the run was interrupted.
    let end = if end == output.end_time {
        end.to_string()
    } else {
        format!("{end:.9}")
    };
    format!(
        "{title}\nmethod {}, rtol {:e}, t = 0 to {end} s in {:.3} s of wall time\n\n{}\n{}",
        solver.method.name(),
        solver.rtol,
        wall_time,
        show(headline),
        show(&work),
    )
}
