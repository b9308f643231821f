//! The set for programs: a Data Package (Frictionless), an RO-Crate 1.1, and checksums.

use crate::Outcome;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use stickslip::compare::benchmark::{Problem, ProblemSet};

const DESCRIPTION: &str = "Problems with dry friction for solvers with stick and slip: statements in plain mathematics, parameters, and \
     event times, states and summaries that a solution with many digits certifies.";
const KEYWORDS: [&str; 5] = [
    "friction",
    "stick-slip",
    "event location",
    "benchmark",
    "reference solution",
];

/// Files of the set beside those of the problems that are made.
const WRITTEN: [&str; 5] = ["README.md", "scoring.md", "check.py", "test_check.py", "set.toml"];

/// The licence of programs.
const OF_PROGRAMS: &str = "MIT OR Apache-2.0";

/// Who makes the set.
const AUTHORS: &str = "The stickslip authors";

/// A file of the set.
struct File {
    path: String,
    text: String,
    title: String,
}

/// The files that describe the others: `datapackage.json`, `ro-crate-metadata.json`, `SHA256SUMS`.
pub fn of(set: &ProblemSet, made: &BTreeMap<PathBuf, String>) -> Outcome<Vec<(PathBuf, String)>> {
    let mut files = Vec::new();
    let read = |path: &str| {
        let place = set.folder().join(path);
        std::fs::read_to_string(&place).map_err(|error| format!("{}: {error}", place.display()))
    };
    for path in WRITTEN {
        files.push(File {
            path: path.to_owned(),
            text: read(path)?,
            title: title(path),
        });
    }
    for problem in &set.problems {
        let case = format!("cases/{}.toml", problem.name);
        files.push(File {
            title: format!("{}: the case of its answers", problem.name),
            text: read(&case)?,
            path: case,
        });
        for name in [
            "README.md",
            "sketch.svg",
            "problem.json",
            "events.csv",
            "samples.csv",
            "summary.json",
        ] {
            let path = format!("{}/{name}", problem.name);
            let text = match made.get(Path::new(&path)) {
                Some(text) => text.clone(),
                None => read(&path)?,
            };
            files.push(File {
                title: format!("{}: {}", problem.name, title(name)),
                path,
                text,
            });
        }
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    let sums = files
        .iter()
        .map(|file| format!("{}  {}\n", digest(&file.text), file.path));
    Ok(vec![
        (PathBuf::from("datapackage.json"), data_package(set, &files)?),
        (PathBuf::from("ro-crate-metadata.json"), ro_crate(set, &files)?),
        (PathBuf::from("SHA256SUMS"), sums.collect()),
    ])
}

fn title(name: &str) -> String {
    let title = match name {
        "README.md" => "what it is",
        "scoring.md" => "how a submission is scored",
        "check.py" => "the checker",
        "test_check.py" => "tests of the checker",
        "set.toml" => "what the answers are made from",
        "sketch.svg" => "a drawing",
        "problem.json" => "parameters in SI",
        "events.csv" => "times, kinds and states of the events",
        "samples.csv" => "states at given times",
        _ => "period, amplitude and durations",
    };
    title.to_owned()
}

fn media(path: &str) -> &'static str {
    match path.rsplit('.').next() {
        Some("csv") => "text/csv",
        Some("json") => "application/json",
        Some("svg") => "image/svg+xml",
        Some("md") => "text/markdown",
        Some("py") => "text/x-python",
        _ => "application/toml",
    }
}

fn digest(text: &str) -> String {
    Sha256::digest(text.as_bytes())
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

fn license_page(set: &ProblemSet) -> String {
    format!("https://spdx.org/licenses/{}", set.license)
}

/// The Table Schema of `events.csv` or `samples.csv`.
fn schema(problem: &Problem, events: bool) -> Value {
    let number = |name: &str, unit: &str, meaning: &str| json!({ "name": name, "type": "number", "unit": unit, "description": meaning });
    let mut fields = vec![number("time", "s", "time")];
    if events {
        fields.insert(
            0,
            json!({ "name": "event", "type": "integer", "description": "index of the event" }),
        );
        fields.push(json!({
            "name": "kind", "type": "string", "description": "what the relative velocity does",
            "constraints": { "required": true, "enum": ["stick", "slip", "reversal"] },
        }));
        fields.push(number("time_uncertainty", "s", "how far the time can be off"));
    }
    fields.extend(
        problem
            .columns
            .iter()
            .map(|column| number(&column.name, &column.unit, &column.meaning)),
    );
    json!({ "fields": fields, "primaryKey": [if events { "event" } else { "time" }] })
}

fn data_package(set: &ProblemSet, files: &[File]) -> Outcome<String> {
    let resource = |file: &File| {
        let name: String = file
            .path
            .chars()
            .map(|c| if c == '/' { '.' } else { c.to_ascii_lowercase() })
            .collect();
        let mut resource = json!({
            "name": name.trim_end_matches(".csv"),
            "path": file.path,
            "title": file.title,
            "mediatype": media(&file.path),
            "encoding": "utf-8",
            "bytes": file.text.len(),
            "hash": format!("sha256:{}", digest(&file.text)),
        });
        if file.path.ends_with(".py") {
            resource["licenses"] = json!([{ "name": OF_PROGRAMS, "title": "that of the repository" }]);
        }
        let table = file.path.strip_suffix(".csv").and_then(|path| path.split_once('/'));
        if let Some((folder, table)) = table
            && let Some(problem) = set.problems.iter().find(|problem| problem.name == folder)
        {
            resource["profile"] = "tabular-data-resource".into();
            resource["format"] = "csv".into();
            resource["dialect"] = json!({ "delimiter": ",", "lineTerminator": "\n", "header": true });
            resource["schema"] = schema(problem, table == "events");
        }
        resource
    };
    let package = json!({
        "profile": "data-package",
        "name": "dry-friction-benchmarks",
        "version": set.version,
        "title": set.title,
        "description": DESCRIPTION,
        "created": format!("{}T00:00:00Z", set.date),
        "keywords": KEYWORDS,
        "licenses": [{ "name": set.license, "path": license_page(set) }],
        "contributors": [{ "title": AUTHORS, "role": "author" }],
        "resources": files.iter().map(resource).collect::<Vec<_>>(),
    });
    Ok(serde_json::to_string_pretty(&package)? + "\n")
}

fn ro_crate(set: &ProblemSet, files: &[File]) -> Outcome<String> {
    let reference = |id: &str| json!({ "@id": id });
    let folder = |problem: &Problem| format!("{}/", problem.name);
    let in_problem = |file: &&File| {
        set.problems
            .iter()
            .any(|problem| file.path.starts_with(&folder(problem)))
    };
    let (of_problems, others): (Vec<&File>, Vec<&File>) = files.iter().partition(in_problem);
    let described = ["datapackage.json", "SHA256SUMS", "index.html"];
    let mut parts: Vec<Value> = set.problems.iter().map(|problem| reference(&folder(problem))).collect();
    parts.extend(others.iter().map(|file| reference(&file.path)));
    parts.extend(described.map(reference));
    let page = license_page(set);
    let mut graph = vec![
        json!({
            "@id": "ro-crate-metadata.json",
            "@type": "CreativeWork",
            "conformsTo": { "@id": "https://w3id.org/ro/crate/1.1" },
            "about": { "@id": "./" },
        }),
        json!({
            "@id": "./",
            "@type": "Dataset",
            "name": set.title,
            "description": DESCRIPTION,
            "version": set.version,
            "datePublished": set.date,
            "keywords": KEYWORDS.join(", "),
            "license": reference(&page),
            "author": reference("#authors"),
            "hasPart": parts,
        }),
        json!({
            "@id": page,
            "@type": "CreativeWork",
            "name": set.license,
            "description": format!("The licence with the SPDX identifier {}", set.license),
        }),
    ];
    graph.push(json!({ "@id": "#authors", "@type": "Organization", "name": AUTHORS }));
    for problem in &set.problems {
        let id = folder(problem);
        let parts = of_problems.iter().filter(|file| file.path.starts_with(&id));
        graph.push(json!({
            "@id": id,
            "@type": "Dataset",
            "name": problem.name,
            "description": format!("The problem {}: statement, parameters and answers", problem.name),
            "hasPart": parts.map(|file| reference(&file.path)).collect::<Vec<_>>(),
        }));
    }
    graph.extend(files.iter().map(|file| {
        let mut entity = json!({
            "@id": file.path,
            "@type": "File",
            "name": file.title,
            "description": file.title,
            "encodingFormat": media(&file.path),
            "contentSize": file.text.len().to_string(),
        });
        if file.path.ends_with(".py") {
            entity["@type"] = json!(["File", "SoftwareSourceCode"]);
            entity["license"] = OF_PROGRAMS.into();
        }
        entity
    }));
    let described = described.into_iter().zip([
        ("application/json", "the set as a Data Package"),
        ("text/plain", "SHA-256 digests of the files"),
        ("text/html", "the set as a page"),
    ]);
    graph.extend(described.map(|(path, (media, title))| {
        json!({ "@id": path, "@type": "File", "name": title, "description": title, "encodingFormat": media })
    }));
    let document = json!({ "@context": "https://w3id.org/ro/crate/1.1/context", "@graph": graph });
    Ok(serde_json::to_string_pretty(&document)? + "\n")
}
