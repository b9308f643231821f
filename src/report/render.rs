//! Pages as text for a terminal, as Markdown and as HTML.

use super::{Page, PagePart, PageTable};
use crate::plot::html::{escaped, styled};
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

/// Width of the narrowest terminal for which tables are wrapped.
const NARROWEST: u16 = 40;

const STYLE: &str = include_str!("../../data/page/report.css");

/// The headline of a page, and how many lines of details there are; the whole page with `details`.
pub(crate) fn terminal(page: &Page, details: bool) -> String {
    if details {
        return lines_of_page(page, true);
    }
    let text = lines_of_page(page, false);
    let lines = |text: &str| text.lines().count();
    match lines(&lines_of_page(page, true)).saturating_sub(lines(&text)) {
        0 => text,
        1 => text + "-v shows one more line\n",
        more => format!("{text}-v shows the other {more} lines\n"),
    }
}

fn lines_of_page(page: &Page, details: bool) -> String {
    let lines = [&page.title, &page.verdict].into_iter().filter(|line| !line.is_empty());
    let mut text: String = lines.map(|line| format!("{line}\n")).collect();
    for part in &page.parts {
        let part = match part {
            PagePart::Detail(_) if !details => continue,
            PagePart::Detail(part) => &**part,
            part => part,
        };
        let (part, is_below) = match part {
            PagePart::Below(part) => (&**part, true),
            part => (part, false),
        };
        if !(is_below || text.is_empty()) {
            text.push('\n');
        }
        text += &match part {
            PagePart::Text(paragraph) => format!("{paragraph}\n"),
            PagePart::List(items) => items.iter().map(|item| format!("- {item}\n")).collect(),
            PagePart::Table(table) => lines_of(table, details),
            PagePart::Figure(_) | PagePart::Below(_) | PagePart::Detail(_) => String::new(),
        };
    }
    text
}

/// The lines of a table, without margins and trailing blanks.
fn lines_of(table: &PageTable, details: bool) -> String {
    let mut drawn = Table::new();
    drawn
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Dynamic);
    // A terminal of unknown width reports 0 columns, or too few for a word.
    let size = console::Term::stdout().size_checked();
    if let Some((_, columns)) = size.filter(|(_, columns)| *columns >= NARROWEST) {
        drawn.set_width(columns);
    }
    if table.has_header() {
        drawn.set_header(table.columns.iter().map(|column| &column.title));
    }
    let shown = table.brief.filter(|_| !details).unwrap_or(usize::MAX);
    drawn.add_rows(table.rows.iter().take(shown));
    for (index, _) in table.columns.iter().enumerate().filter(|one| one.1.number) {
        if let Some(column) = drawn.column_mut(index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let title = Some(&table.title).filter(|title| !title.is_empty());
    let lines = drawn.lines();
    let lines = lines.map(|line| line.strip_prefix(' ').unwrap_or(&line).trim_end().to_owned());
    title
        .cloned()
        .into_iter()
        .chain(lines)
        .map(|line| line + "\n")
        .collect()
}

pub(crate) fn markdown(pages: &[Page], mark: &str) -> String {
    let mut text = format!("<!-- {mark} -->\n");
    for page in pages {
        text += &format!("# {}\n\n", plain(&page.title));
        text.extend(page.verdict.lines().map(|line| format!("**{}**\n\n", plain(line))));
        text.extend(page.parts.iter().map(markdown_part));
    }
    text
}

fn markdown_part(part: &PagePart) -> String {
    match part {
        PagePart::Text(paragraph) => format!("{}\n\n", plain(paragraph)),
        PagePart::List(items) => items.iter().map(|item| format!("- {}\n", plain(item))).collect(),
        PagePart::Table(table) => markdown_table(table),
        PagePart::Figure(figure) => {
            // A space or a bracket would end the address.
            let file = figure.file.replace('%', "%25").replace(' ', "%20");
            let file = plain(&file.replace('(', "%28").replace(')', "%29"));
            format!("![{}]({file})\n\n", plain(&figure.title))
        }
        PagePart::Below(part) | PagePart::Detail(part) => markdown_part(part),
    }
}

fn markdown_table(table: &PageTable) -> String {
    let mut text = String::new();
    if !table.title.is_empty() {
        text += &format!("## {}\n\n", plain(&table.title));
    }
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    text += &line(table.columns.iter().map(|column| plain(&column.title)).collect());
    let rule = |number: bool| if number { "---:" } else { "---" }.to_owned();
    text += &line(table.columns.iter().map(|column| rule(column.number)).collect());
    let rows = table.rows.iter();
    text.extend(rows.map(|row| line(row.iter().map(|cell| plain(cell)).collect())));
    text + "\n"
}

fn plain(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!(c, '\\' | '`' | '*' | '_' | '|' | '<' | '>' | '[' | ']' | '#' | '&') {
            escaped.push('\\');
        }
        escaped.push(if c == '\n' { ' ' } else { c });
    }
    escaped
}

pub(crate) fn html(pages: &[Page], mark: &str) -> String {
    let mut body = String::new();
    for page in pages {
        body += &format!("<h1>{}</h1>\n", escaped(&page.title));
        for line in page.verdict.lines() {
            body += &format!("<p class=\"verdict\">{}</p>\n", escaped(line));
        }
        body.extend(page.parts.iter().map(html_part));
    }
    let title = pages.first().map_or_else(String::new, |page| escaped(&page.title));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"generator\" content=\"{mark}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n<style>\n{}\
         </style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        styled(STYLE)
    )
}

fn html_part(part: &PagePart) -> String {
    match part {
        PagePart::Text(paragraph) => format!("<p>{}</p>\n", escaped(paragraph)),
        PagePart::List(items) => {
            let items = items.iter().map(|item| format!("<li>{}</li>\n", escaped(item)));
            format!("<ul>\n{}</ul>\n", items.collect::<String>())
        }
        PagePart::Table(table) => html_table(table),
        PagePart::Figure(figure) => {
            // Inline SVG needs no namespace.
            let svg = figure.svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
            format!("<figure>{svg}</figure>\n")
        }
        PagePart::Below(part) | PagePart::Detail(part) => html_part(part),
    }
}

fn html_table(table: &PageTable) -> String {
    let mut text = String::new();
    if !table.title.is_empty() {
        text += &format!("<h2>{}</h2>\n", escaped(&table.title));
    }
    let numbers = || table.columns.iter().map(|column| column.number);
    let line = |tag: &str, cells: &mut dyn Iterator<Item = &String>| {
        let cells = cells.zip(numbers()).map(|(cell, number)| {
            let class = if number { " class=\"number\"" } else { "" };
            format!("<{tag}{class}>{}</{tag}>", escaped(cell))
        });
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let header = line("th", &mut table.columns.iter().map(|column| &column.title));
    text += &format!("<div class=\"scroll\">\n<table>\n<thead>\n{header}</thead>\n<tbody>\n");
    text.extend(table.rows.iter().map(|row| line("td", &mut row.iter())));
    text + "</tbody>\n</table>\n</div>\n"
}
