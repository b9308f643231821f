//! The set as a page: statements, drawings, motions, and the league table.

use crate::Outcome;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use stickslip::compare::benchmark::{Problem, ProblemSet};

const STYLE: &str = ":root{color-scheme:light dark;--ink:#1b1b1b;--ground:#fff;--line:#ddd;--code:#f5f5f5;--link:#0b57a4;\
--curve:#0072b2;--event:#d55e00}\
@media(prefers-color-scheme:dark){:root{--ink:#e8e6e3;--ground:#121417;--line:#3a3e44;--code:#1b1e22;--link:#8cc4f5;\
--curve:#5cb8f0;--event:#ff8a45}}\
body{font:16px/1.5 system-ui,sans-serif;max-width:72rem;margin:2rem auto;padding:0 1rem;color:var(--ink);\
background:var(--ground)}a{color:var(--link)}\
h1{font-size:1.7rem}h2{font-size:1.25rem;margin-top:2.5rem}table{border-collapse:collapse;font-size:.92rem}\
th,td{padding:.25rem .6rem;border-bottom:1px solid var(--line);text-align:left;vertical-align:top}td.n{text-align:right;\
font-variant-numeric:tabular-nums}section{display:grid;grid-template-columns:minmax(0,20rem) minmax(0,1fr);gap:1rem 2rem;\
border-top:1px solid var(--line);padding:1rem 0}section h3{margin:0 0 .3rem;font-size:1.05rem}section p{margin:.3rem 0}\
img{max-width:100%}@media(prefers-color-scheme:dark){img{background:#fff;filter:invert(.89) hue-rotate(180deg)}}.scroll{overflow-x:auto}pre{background:var(--code);padding:.7rem;overflow-x:auto}\
.motion{max-width:100%;height:auto;fill:none;stroke-width:1}.motion text{fill:var(--ink);font-size:13px}\
.motion .axis{stroke:var(--ink)}.motion .curve{stroke:var(--curve);stroke-width:1.5}\
.motion .events{stroke:var(--event)}\
@media(max-width:44rem){section{grid-template-columns:1fr}}";

/// Size of the picture of a motion, px, and points that it has at most.
const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 190.0;
const MOST_POINTS: usize = 400;
/// Edges of its axes, px: right, top, bottom. The left one leaves room for the numbers.
const RIGHT: f64 = WIDTH - 18.0;
const TOP: f64 = 12.0;
/// Height of the name above the curve, px.
const NAME: f64 = 16.0;
const BOTTOM: f64 = HEIGHT - 34.0;
/// Width of a letter and length of the line of an event, px.
const LETTER: f64 = 8.0;
const EVENT: f64 = 12.0;

/// `index.html`.
pub fn of(set: &ProblemSet, made: &BTreeMap<PathBuf, String>) -> Outcome<String> {
    let file = |problem: &Problem, name: &str| -> Outcome<&String> {
        let path = Path::new(&problem.name).join(name);
        made.get(&path)
            .ok_or_else(|| format!("{} is not made", path.display()).into())
    };
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width,initial-scale=1\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <h1>{title}</h1>\n<p>Set {version}, {date}. {count} problems, from the simplest to the hardest, each with a statement, \
         parameters, and answers with certified digits. <a href=\"README.md\">What the set is</a>, \
         <a href=\"scoring.md\">how a submission is scored</a>, <a href=\"check.py\">the checker</a> (one file of Python), \
         <a href=\"ci/README.md\">continuous integration</a>, <a href=\"solvers/README.md\">solvers</a>, \
         <a href=\"datapackage.json\">Data Package</a>, <a href=\"ro-crate-metadata.json\">RO-Crate</a>.</p>\n\
         <pre>python check.py 04 mine.csv --require digits=6</pre>\n",
        title = escaped(&set.title),
        version = escaped(&set.version),
        date = escaped(&set.date),
        count = set.problems.len(),
    );
    page += "<h2>Problems</h2>\n";
    for problem in &set.problems {
        let statement: serde_json::Value = serde_json::from_str(file(problem, "problem.json")?)?;
        let title = statement["title"].as_str().unwrap_or_default();
        let end = statement["end_time"].as_f64().unwrap_or_default();
        let events = file(problem, "events.csv")?.lines().count() - 1;
        let [events, plural] = [events.to_string(), if events == 1 { "" } else { "s" }.to_owned()];
        let name = &problem.name;
        let _ = write!(
            page,
            "<section id=\"{name}\">\n<div><img src=\"{name}/sketch.svg\" alt=\"Sketch of problem {name}\" \
             loading=\"lazy\"></div>\n<div>\n<h3><a href=\"{name}/README.md\">{number} {title}</a></h3>\n\
             <p>{events} event{plural} up to {end} s. Files: <a href=\"{name}/problem.json\">problem.json</a>, \
             <a href=\"{name}/events.csv\">events.csv</a>, <a href=\"{name}/samples.csv\">samples.csv</a>, \
             <a href=\"{name}/summary.json\">summary.json</a></p>\n{picture}\n</div>\n</section>\n",
            number = escaped(name.split('-').next().unwrap_or_default()),
            title = escaped(title),
            picture = picture(problem, file(problem, "samples.csv")?, file(problem, "events.csv")?)?,
        );
    }
    page += &league(set)?;
    page += "</body>\n</html>\n";
    Ok(page)
}

/// Round values from `low` to `high` with a distance of 1, 2 or 5 times a power of ten, at most `most` of them, and the
/// decimals that they need.
fn ticks((low, high): (f64, f64), most: f64) -> (Vec<f64>, usize) {
    let least = (high - low) / most;
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power);
    let step = step.into_iter().find(|step| *step >= least).unwrap_or(least);
    let numbers = (low / step).ceil() as i64..=(high / step).floor() as i64;
    let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
    (numbers.map(|number| number as f64 * step).collect(), decimals)
}

fn number(value: f64, decimals: usize) -> String {
    format!("{value:.decimals$}").replace('-', "−")
}

/// The scored position over time, with the events; of the last stretch of the grid.
fn picture(problem: &Problem, samples: &str, events: &str) -> Outcome<String> {
    let column = 1 + problem.column(&problem.position).ok_or("no such column")?;
    let cell =
        |line: &str, index: usize| -> Outcome<f64> { Ok(line.split(',').nth(index).unwrap_or_default().parse()?) };
    let from = problem.grid.last().map_or(0.0, |stretch| stretch[0]);
    let rows = samples
        .lines()
        .skip(1)
        .map(|line| Ok((cell(line, 0)?, cell(line, column)?)));
    let rows: Vec<(f64, f64)> = rows.collect::<Outcome<Vec<_>>>()?;
    let rows: Vec<(f64, f64)> = rows.into_iter().filter(|row| row.0 >= from).collect();
    let (first, last) = rows.first().zip(rows.last()).ok_or("no samples")?;
    let (low, high) = rows
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), row| {
            (low.min(row.1), high.max(row.1))
        });
    let span = if high > low { high - low } else { 1.0 };
    // Small numbers in a unit of their own, such as 10⁻⁶ rad.
    let largest = low.abs().max(high.abs());
    let thousands = match largest > 0.0 {
        true => (largest.log10() / 3.0).floor() as i32,
        false => 0,
    };
    let (scale, prefix) = match thousands {
        ..=-2 => (
            10f64.powi(-3 * thousands),
            format!(
                "10<tspan dy=\"-4\" font-size=\"10\">{}</tspan><tspan dy=\"4\"> </tspan>",
                number(f64::from(3 * thousands), 0)
            ),
        ),
        _ => (1.0, String::new()),
    };
    let (values, decimals) = ticks((scale * low, scale * (low + span)), 4.0);
    let labels: Vec<String> = values.iter().map(|value| number(*value, decimals)).collect();
    let letters = labels.iter().map(|label| label.chars().count()).max().unwrap_or(1);
    let left = 14.0 + LETTER * letters as f64;
    let x = |time: f64| left + (RIGHT - left) * (time - first.0) / (last.0 - first.0);
    let y = |value: f64| BOTTOM - EVENT - (BOTTOM - EVENT - TOP - NAME) * (value - low) / span;
    let mut axes = format!("M{left:.1} {TOP}V{BOTTOM}H{RIGHT}");
    let mut texts = String::new();
    for (value, label) in values.iter().zip(labels) {
        let y = y(value / scale);
        let _ = write!(axes, "M{:.1} {y:.1}h-4", left);
        let _ = write!(
            texts,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            left - 7.0,
            y + 4.5
        );
    }
    let (times, decimals) = ticks((first.0, last.0), 6.0);
    for time in times {
        let _ = write!(axes, "M{:.1} {BOTTOM}v4", x(time));
        let _ = write!(
            texts,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            x(time),
            BOTTOM + 17.0,
            number(time, decimals)
        );
    }
    let meaning = &problem.columns[column - 1].meaning;
    let unit = &problem.columns[column - 1].unit;
    let _ = write!(
        texts,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">t (s)</text><text x=\"{:.1}\" y=\"{:.1}\">{} ({prefix}{})</text>",
        0.5 * (left + RIGHT),
        HEIGHT - 3.0,
        left + 6.0,
        TOP,
        escaped(meaning),
        escaped(unit),
    );
    let step = rows.len().div_ceil(MOST_POINTS);
    let points = rows
        .iter()
        .step_by(step)
        .map(|&(time, value)| format!("{:.1},{:.1}", x(time), y(value)));
    let marks = events.lines().skip(1).map(|line| {
        let time = cell(line, 1)?;
        Ok(match time >= first.0 && time <= last.0 {
            true => format!("M{:.1} {BOTTOM}v-{EVENT}", x(time)),
            false => String::new(),
        })
    });
    Ok(format!(
        "<svg class=\"motion\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" role=\"img\" aria-label=\"{meaning} over \
         time\"><path class=\"axis\" d=\"{axes}\"/><polyline class=\"curve\" points=\"{}\"/><path class=\"events\" \
         d=\"{}\"/>{texts}</svg>\n<p><small>{meaning} from {} to {} s; the marks on the axis are events.</small></p>",
        points.collect::<Vec<_>>().join(" "),
        marks.collect::<Outcome<String>>()?,
        first.0,
        last.0,
        meaning = escaped(meaning),
    ))
}

/// The league table of `solvers/league.md`, if it has been measured.
fn league(set: &ProblemSet) -> Outcome<String> {
    let path = set.folder().join("solvers/league.md");
    if !path.is_file() {
        return Ok(String::new());
    }
    let text = std::fs::read_to_string(path)?;
    let mut page = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if let Some(title) = line.strip_prefix("# ") {
            let _ = writeln!(page, "<h2 id=\"league\">{}</h2>", inline(title));
        } else if let Some(title) = line.strip_prefix("## ") {
            let _ = writeln!(page, "<h3>{}</h3>", inline(title));
        } else if line.starts_with('|') {
            page += "<div class=\"scroll\"><table>\n";
            let mut row = Some(line);
            let mut cell = "th";
            while let Some(line) = row.filter(|line| line.starts_with('|')) {
                // The line below the header has no text.
                match line.chars().all(|c| matches!(c, '|' | '-' | ':' | ' ')) {
                    true => cell = "td",
                    false => {
                        let cells = line.trim_matches('|').split('|');
                        let cells = cells.map(|text| format!("<{cell}>{}</{cell}>", inline(text.trim())));
                        let _ = writeln!(page, "<tr>{}</tr>", cells.collect::<String>());
                    }
                }
                row = lines.next_if(|line| line.starts_with('|'));
            }
            page += "</table></div>\n";
        } else if !line.trim().is_empty() {
            let mut paragraph = line.trim().to_owned();
            while let Some(more) = lines.next_if(|line| !line.trim().is_empty() && !line.starts_with(['|', '#', '['])) {
                paragraph = format!("{paragraph} {}", more.trim());
            }
            let _ = writeln!(page, "<p>{}</p>", inline(&paragraph));
        }
    }
    Ok(page)
}

/// Links and code of a line of Markdown; links lead from the folder of the solvers.
fn inline(text: &str) -> String {
    let mut parts = Vec::new();
    for (index, part) in escaped(text).split('`').enumerate() {
        parts.push(if index % 2 == 1 {
            format!("<code>{part}</code>")
        } else {
            part.to_owned()
        });
    }
    let text = parts.concat();
    let mut page = String::new();
    let mut rest = text.as_str();
    while let Some((before, link)) = rest.split_once('[') {
        let found = link.split_once("](").and_then(|(text, after)| {
            let (target, after) = after.split_once(')')?;
            Some((text, target, after))
        });
        page += before;
        match found {
            Some((text, target, after)) => {
                let _ = write!(page, "<a href=\"solvers/{target}\">{text}</a>");
                rest = after;
            }
            None => {
                page.push('[');
                rest = link;
            }
        }
    }
    page + rest
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
