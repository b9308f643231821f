//! Tables for the terminal.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use stickslip_analysis::analysis::distribution::{Distribution, PERCENTILES};
pub(super) use stickslip_analysis::analysis::headline::or_none;
use stickslip_analysis::analysis::{HeadlineRow, Summary, headline};
use stickslip_case::Case;
use stickslip_engine::simulation::SolverOptions;

/// Width of the narrowest terminal for which tables are wrapped.
const NARROWEST: u16 = 40;

/// The lines of a table, without margins and trailing blanks. The columns `right` are right-aligned numbers.
pub(super) fn lines(
    header: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
    right: impl IntoIterator<Item = usize>,
) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Dynamic);
    // A terminal of unknown width reports 0 columns, or too few for a word.
    let size = console::Term::stdout().size_checked();
    if let Some((_, columns)) = size.filter(|(_, columns)| *columns >= NARROWEST) {
        table.set_width(columns);
    }
    if !header.is_empty() {
        table.set_header(header);
    }
    table.add_rows(rows);
    for column in right {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let of_line = |line: String| format!("{}\n", line.strip_prefix(' ').unwrap_or(&line).trim_end());
    table.lines().map(of_line).collect()
}

pub(super) fn pairs<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> String {
    lines(
        &[],
        rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]),
        [],
    )
}

/// Width of a value, which stands next to the paper's.
const VALUE: usize = 27;

const BAR: usize = 40;

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
    // These digits resolve 1/100 of the interquartile range.
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
    let values = std::iter::once(found.least).chain(found.percentiles);
    let values = values.chain([found.largest, found.mean]).map(number).collect();
    let most = found.bars.iter().map(|bar| bar.2).max().unwrap_or(1).max(1);
    let bars = found.bars.iter().map(|&(from, to, count)| {
        // Every bar that is not empty is visible.
        let length = (count * BAR).div_ceil(most);
        vec![number(from), number(to), count.to_string(), "#".repeat(length)]
    });
    let histogram = lines(&["from", "to", "runs", ""], bars, 0..3);
    format!("{text}\n{}{histogram}", lines(&header, [values], 0..header.len()))
}

/// A list wrapped to the width of values, so that the paper's values stay near.
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

pub(super) fn run_report(case: &Case, solver: &SolverOptions, summary: &Summary, wall_time: f64) -> String {
    let rows = headline(case, summary);
    let beside_paper = rows.iter().any(|row| !row.paper.is_empty());
    let header: &[&str] = if beside_paper { &["", "this run", "paper"] } else { &[] };
    let report = rows
        .into_iter()
        .map(|HeadlineRow { name, value, paper }| match beside_paper {
            true => vec![name.to_owned(), below(&value), paper.to_owned()],
            false => vec![name.to_owned(), value],
        });
    let report = lines(header, report, []);
    let work = summary.work.iter().map(|w| {
        vec![
            w.solver.to_owned(),
            w.segments.to_string(),
            format!("{:.4}", w.simulated_time),
            w.steps.to_string(),
            w.rhs_evaluations.to_string(),
            w.jacobian_evaluations.to_string(),
        ]
    });
    let header = [
        "solver",
        "segments",
        "simulated s",
        "steps",
        "right-hand sides",
        "Jacobians",
    ];
    // The end time as in the case, unless the run was interrupted.
    let end = match summary.end == case.output.end_time {
        true => summary.end.to_string(),
        false => format!("{:.9}", summary.end),
    };
    format!(
        "{}\nmethod {}, rtol {:e}, t = 0 to {end} s in {wall_time:.3} s of wall time\n\n{}\n{}",
        case.title,
        solver.method.name(),
        solver.rtol,
        report,
        lines(&header, work, 1..6),
    )
}
