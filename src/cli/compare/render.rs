//! Reports as text for a terminal, as Markdown and as HTML.

use super::super::terminal as tables;
use super::pages::{Page, ReportPart, ReportTable};
use crate::plot::html::styled;
use crate::plot::signature::REPORT as MARK;

pub(super) fn terminal(pages: &[Page]) -> String {
    let page = |page: &Page| {
        let mut text = format!("{}\n{}\n", page.title, page.verdict);
        for part in &page.parts {
            text.push('\n');
            match part {
                ReportPart::Text(paragraph) => text += &format!("{paragraph}\n"),
                // Only a report in a file has figures.
                ReportPart::Figure(_) => {}
                ReportPart::Table(table) => {
                    if !table.title.is_empty() {
                        text += &format!("{}\n", table.title);
                    }
                    let right = table.texts..table.header.len();
                    text += &tables::lines(&table.header, table.rows.iter().cloned(), right);
                }
            }
        }
        text
    };
    pages.iter().map(page).collect::<Vec<_>>().join("\n")
}

pub(super) fn markdown(pages: &[Page], shortfalls: &[String]) -> String {
    let mut text = format!("<!-- {MARK} -->\n");
    for page in pages {
        text += &format!("# {}\n\n**{}**\n\n", plain(&page.title), plain(&page.verdict));
        for part in &page.parts {
            match part {
                ReportPart::Text(paragraph) => text += &format!("{}\n\n", plain(paragraph)),
                ReportPart::Table(table) => text += &markdown_table(table),
                ReportPart::Figure(figure) => {
                    // A space or a bracket would end the address.
                    let file = figure.file.replace('%', "%25").replace(' ', "%20");
                    let file = plain(&file.replace('(', "%28").replace(')', "%29"));
                    text += &format!("![{}]({file})\n\n", plain(&figure.title));
                }
            }
        }
    }
    if !shortfalls.is_empty() {
        text += "# Fell short\n\n";
        text.extend(shortfalls.iter().map(|s| format!("- {}\n", plain(s))));
    }
    text
}

fn markdown_table(table: &ReportTable) -> String {
    let mut text = String::new();
    if !table.title.is_empty() {
        text += &format!("## {}\n\n", plain(&table.title));
    }
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    text += &line(table.header.iter().map(|cell| plain(cell)).collect());
    let rule = |k: usize| if k < table.texts { "---" } else { "---:" }.to_owned();
    text += &line((0..table.header.len()).map(rule).collect());
    text.extend(
        table
            .rows
            .iter()
            .map(|row| line(row.iter().map(|cell| plain(cell)).collect())),
    );
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

pub(super) fn html(pages: &[Page], shortfalls: &[String]) -> String {
    let mut body = String::new();
    for page in pages {
        body += &format!(
            "<h1>{}</h1>\n<p class=\"verdict\">{}</p>\n",
            safe(&page.title),
            safe(&page.verdict)
        );
        for part in &page.parts {
            match part {
                ReportPart::Text(paragraph) => body += &format!("<p>{}</p>\n", safe(paragraph)),
                ReportPart::Table(table) => body += &html_table(table),
                ReportPart::Figure(figure) => {
                    // Inline SVG needs no namespace.
                    let svg = figure.svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
                    body += &format!("<figure>{svg}</figure>\n");
                }
            }
        }
    }
    if !shortfalls.is_empty() {
        body += "<h1>Fell short</h1>\n<ul>\n";
        body.extend(shortfalls.iter().map(|s| format!("<li>{}</li>\n", safe(s))));
        body += "</ul>\n";
    }
    let title = pages.first().map_or_else(String::new, |page| safe(&page.title));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"generator\" content=\"{MARK}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n<style>\n{}\
         </style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        styled(STYLE)
    )
}

const STYLE: &str = include_str!("../../../data/page/report.css");

fn html_table(table: &ReportTable) -> String {
    let mut text = String::new();
    if !table.title.is_empty() {
        text += &format!("<h2>{}</h2>\n", safe(&table.title));
    }
    let cell = |tag: &str, k: usize, cell: &str| {
        let class = if k < table.texts { "" } else { " class=\"number\"" };
        format!("<{tag}{class}>{}</{tag}>", safe(cell))
    };
    let line = |tag: &str, cells: Vec<&str>| {
        let cells: String = cells.iter().enumerate().map(|(k, text)| cell(tag, k, text)).collect();
        format!("<tr>{cells}</tr>\n")
    };
    text += &format!(
        "<div class=\"scroll\">\n<table>\n<thead>\n{}</thead>\n<tbody>\n",
        line("th", table.header.clone())
    );
    text.extend(
        table
            .rows
            .iter()
            .map(|row| line("td", row.iter().map(String::as_str).collect())),
    );
    text + "</tbody>\n</table>\n</div>\n"
}

fn safe(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}
