//! Tables for the terminal.

use crate::analysis::distribution::{Distribution, PERCENTILES};
use crate::analysis::{HeadlineRow, Summary, headline};
use crate::case::Case;
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

/// A table of these rows as lines; the columns `right` are numbers.
pub(super) fn lines(
    header: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
    right: impl IntoIterator<Item = usize>,
) -> String {
    let mut table = table(header);
    table.add_rows(rows);
    align_right(&mut table, right);
    show(&table)
}

/// Numbers stand below each other by their last digit.
pub(super) fn align_right(table: &mut Table, columns: impl IntoIterator<Item = usize>) {
    for column in columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}

/// Columns of a value beside the paper's.
const VALUE: usize = 27;

/// Columns of the longest bar of a histogram.
const BAR: usize = 40;

/// Percentiles of a quantity as a table, and a histogram of it.
pub(super) fn distribution(name: &str, units: &str, found: &Distribution) -> String {
    let unit = if units == "1" {
        String::new()
    } else {
        format!(" ({units})")
    };
    let mut text = format!("{name}{unit}: {} runs", found.count);
    if found.without > 0 {
        text += &format!(", {} without a value", found.without);
    }
    // As many digits as tell the percentiles of the middle half apart to a hundredth.
    let spread = found.percentiles[4] - found.percentiles[2];
    let size = found.least.abs().max(found.largest.abs());
    let number = |value: f64| {
        if (1e-3..1e6).contains(&size) && (spread > 0.0 || size >= 1.0) {
            let step = if spread > 0.0 { spread } else { size };
            let places = (2.0 - step.log10().floor()).clamp(0.0, 12.0) as usize;
            format!("{value:.places$}")
        } else {
            format!("{value:.4e}")
        }
    };
    let heads: Vec<String> = PERCENTILES.iter().map(|percent| format!("{percent} %")).collect();
    let mut header = vec!["least"];
    header.extend(heads.iter().map(String::as_str));
    header.extend(["largest", "mean"]);
    let mut percentiles = table(&header);
    let values = std::iter::once(found.least).chain(found.percentiles);
    percentiles.add_row(values.chain([found.largest, found.mean]).map(number));
    align_right(&mut percentiles, 0..header.len());
    let most = found.bars.iter().map(|bar| bar.2).max().unwrap_or(1).max(1);
    let mut histogram = table(&["from", "to", "runs", ""]);
    for &(from, to, count) in &found.bars {
        // What is there is seen.
        let length = (count * BAR).div_ceil(most);
        histogram.add_row([number(from), number(to), count.to_string(), "#".repeat(length)]);
    }
    align_right(&mut histogram, 0..3);
    format!("{text}\n{}{}", show(&percentiles), show(&histogram))
}

/// A list that goes on below, so that the paper's numbers stay near.
fn below(list: &str) -> String {
    let mut text = String::new();
    let mut length = 0;
    for part in list.split_inclusive(", ") {
        if length > 0 && length + part.trim_end().len() > VALUE {
            text.truncate(text.trim_end().len());
            text.push('\n');
            length = 0;
        }
        text.push_str(part);
        length += part.len();
    }
    text
}

/// The report of a run: its headline, and what its solvers did.
pub(super) fn run_report(case: &Case, summary: &Summary, wall_time: f64) -> String {
    let rows = headline(case, summary);
    let beside_paper = rows.iter().any(|row| !row.paper.is_empty());
    let mut report = table(if beside_paper { &["", "this run", "paper"] } else { &[] });
    for HeadlineRow { name, value, paper } in rows {
        if beside_paper {
            report.add_row([name, &below(&value), paper]);
        } else {
            report.add_row([name, &value]);
        }
    }
    let (title, solver, output) = (&case.title, &case.solver, &case.output);
    let (headline, end) = (&report, summary.end);
    let header = [
        "solver",
        "segments",
        "simulated s",
        "steps",
        "right-hand sides",
        "Jacobians",
    ];
    let rows = summary.work.iter().map(|w| {
        vec![
            w.solver.to_owned(),
            w.segments.to_string(),
            format!("{:.4}", w.simulated_time),
            w.steps.to_string(),
            w.rhs_evaluations.to_string(),
            w.jacobian_evaluations.to_string(),
        ]
    });
    let work = lines(&header, rows, 1..6);
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
        work,
    )
}
