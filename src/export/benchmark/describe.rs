//! Machine-readable descriptions of a package: its parameters, Data Package (Frictionless, version 1) and RO-Crate 1.1.

use super::{About, MARK, RO_CRATE};
use serde_json::{Value, json};
use stickslip_case::input::json_of_value;
use stickslip_files::schema::{StorageKind, Variable};
use stickslip_system::quote::bound;
use toml_edit::{DocumentMut, Item, Table};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Resource {
    pub path: &'static str,
    pub bytes: u64,
    pub sha256: String,
    pub schema: Option<Value>,
}

impl Resource {
    pub(super) fn title(&self) -> &'static str {
        match self.path {
            "case.toml" => "The case as it was given",
            "case.resolved.toml" => "The case with every parameter in SI and full precision",
            "parameters.json" => "Every parameter in SI, with its unit and meaning",
            "equations.md" => "The equations of motion, the modes of the contact and its transitions",
            "events.csv" => "Every event, with its uncertainty and the states before and after it",
            "exact-events.csv" => {
                "Exact events as decimal texts, each with its true digits, by a multiprecision solution"
            }
            "sensitivities.csv" => "How the time of each event changes with each parameter",
            "samples.csv" => "The states and forces at the samples of the run",
            "example.py" => "Repeats the stick-slip by SciPy alone, and compares it with events.csv",
            _ => "What this is, how to use and how to cite it",
        }
    }

    fn extension(&self) -> &'static str {
        self.path.rsplit_once('.').map_or("", |(_, extension)| extension)
    }

    fn media(&self) -> &'static str {
        match self.extension() {
            "toml" => "application/toml",
            "json" => "application/json",
            "csv" => "text/csv",
            "py" => "text/x-python",
            _ => "text/markdown",
        }
    }

    /// A name of letters, digits, points and hyphens. A table's name has no extension.
    fn name(&self) -> String {
        self.path.trim_end_matches(".csv").to_lowercase()
    }
}

pub(super) fn schema(columns: &[Variable], key: &[&'static str]) -> Value {
    let fields: Vec<Value> = columns.iter().map(field).collect();
    let mut schema = json!({ "fields": fields, "missingValues": ["", "NaN"], "primaryKey": key });
    if key.len() > 1 {
        schema["foreignKeys"] = json!([{
            "fields": ["event"],
            "reference": { "resource": "events", "fields": ["event"] },
        }]);
    }
    schema
}

fn field(column: &Variable) -> Value {
    let kind = match column.kind {
        StorageKind::Float64 => "number",
        StorageKind::Int32 | StorageKind::Int64 => "integer",
        StorageKind::Int8 => "string",
    };
    let mut field = json!({ "name": column.name, "type": kind, "description": column.long_name });
    if column.kind == StorageKind::Float64 {
        field["unit"] = column.units.as_str().into();
    }
    if column.kind == StorageKind::Int8 {
        let mut words: Vec<&str> = column.flags.iter().map(|(_, word)| word.as_str()).collect();
        words.sort_unstable();
        words.dedup();
        field["constraints"] = json!({ "required": true, "enum": words });
    }
    field
}

fn description(about: &About) -> String {
    format!(
        "A reference run of friction-induced stick-slip vibration: {}. {} events, of which {} have a certified time, with \
         uncertainties up to {} s; equations, parameters, sensitivities and samples.",
        about.title,
        about.events,
        about.certain,
        bound(about.largest_uncertainty, 1)
    )
}

fn printed(document: &Value) -> String {
    serde_json::to_string_pretty(document).unwrap_or_default() + "\n"
}

pub(super) fn data_package(about: &About, resources: &[Resource]) -> String {
    let resource = |resource: &Resource| {
        let mut found = json!({
            "name": resource.name(),
            "path": resource.path,
            "title": resource.title(),
            "mediatype": resource.media(),
            "format": resource.extension(),
            "encoding": "utf-8",
            "bytes": resource.bytes,
            "hash": format!("sha256:{}", resource.sha256),
        });
        if let Some(schema) = &resource.schema {
            found["profile"] = "tabular-data-resource".into();
            found["dialect"] = json!({ "delimiter": ",", "lineTerminator": "\n", "header": true });
            found["schema"] = schema.clone();
        }
        found
    };
    let mut package = json!({
        "profile": "data-package",
        "name": MARK,
        "title": about.title,
        "description": description(about),
        "created": about.made,
        "keywords": ["friction", "stick-slip", "event location", "reference solution"],
        "sources": [{ "title": about.program }],
        "resources": resources.iter().map(resource).collect::<Vec<_>>(),
    });
    if let Some(id) = &about.terms.license {
        package["licenses"] = json!([{ "name": id, "path": license_page(id) }]);
    }
    if let Some(name) = &about.terms.author {
        package["contributors"] = json!([{ "title": name, "role": "author" }]);
    }
    printed(&package)
}

fn license_page(id: &str) -> String {
    format!("https://spdx.org/licenses/{id}")
}

pub(super) fn ro_crate(about: &About, resources: &[Resource]) -> String {
    let reference = |id: &str| json!({ "@id": id });
    let mut parts: Vec<Value> = resources.iter().map(|resource| reference(resource.path)).collect();
    parts.push(reference(super::DATA_PACKAGE));
    let mut root = json!({
        "@id": "./",
        "@type": "Dataset",
        "name": about.title,
        "description": description(about),
        "datePublished": about.made.get(..10).unwrap_or_default(),
        "keywords": "friction, stick-slip, event location, reference solution",
        "hasPart": parts,
        "mentions": reference("#run"),
    });
    let mut further = Vec::new();
    match &about.terms.license {
        Some(id) => {
            let page = license_page(id);
            root["license"] = reference(&page);
            further.push(json!({
                "@id": page,
                "@type": "CreativeWork",
                "name": id,
                "description": format!("The licence with the SPDX identifier {id}"),
            }));
        }
        None => {
            root["license"] = "No licence is stated; ask whoever published this package.".into();
        }
    }
    if let Some(name) = &about.terms.author {
        root["author"] = reference("#author");
        further.push(json!({ "@id": "#author", "@type": "Person", "name": name }));
    }
    let file = |resource: &Resource| {
        json!({
            "@id": resource.path,
            "@type": "File",
            "name": resource.title(),
            "description": resource.title(),
            "encodingFormat": resource.media(),
            "contentSize": resource.bytes.to_string(),
        })
    };
    let mut graph = vec![
        json!({
            "@id": RO_CRATE,
            "@type": "CreativeWork",
            "conformsTo": { "@id": "https://w3id.org/ro/crate/1.1" },
            "about": { "@id": "./" },
        }),
        root,
    ];
    graph.extend(resources.iter().map(file));
    graph.push(json!({
        "@id": super::DATA_PACKAGE,
        "@type": "File",
        "name": "The description of the tables",
        "description": "Data Package: every file with its size and digest, every column with its type and unit",
        "encodingFormat": "application/json",
    }));
    graph.push(json!({
        "@id": "#program",
        "@type": "SoftwareApplication",
        "name": "stickslip",
        "description": "High-accuracy reference runs of friction-induced stick-slip vibration",
        "version": about.version,
        "softwareVersion": about.version,
    }));
    let results: Vec<Value> = ["events.csv", "samples.csv"].into_iter().map(reference).collect();
    graph.push(json!({
        "@id": "#run",
        "@type": "CreateAction",
        "name": "The run and its certificate",
        "description": format!("Integrated by method {}; uncertainties by the {}", about.method, about.certified_by),
        "endTime": about.run,
        "instrument": { "@id": "#program" },
        "object": { "@id": "case.toml" },
        "result": results,
    }));
    graph.extend(further);
    printed(&json!({ "@context": "https://w3id.org/ro/crate/1.1/context", "@graph": graph }))
}

/// Parameters of the resolved case in SI, with units and meanings from its comments.
pub(super) fn parameters(resolved: &str) -> String {
    let mut found = Vec::new();
    if let Ok(document) = resolved.parse::<DocumentMut>() {
        add_parameters("", document.as_table(), &mut found);
    }
    printed(&json!({ "parameters": found }))
}

/// Keys have dots and indices of elements: torsion.damping, perturbation.0.time.
fn add_parameters(at: &str, table: &Table, found: &mut Vec<Value>) {
    for (name, item) in table {
        let key = format!("{at}{name}");
        match item {
            Item::Value(value) => {
                let comment = value
                    .decor()
                    .suffix()
                    .and_then(|suffix| suffix.as_str())
                    .unwrap_or_default();
                let comment = comment.trim().trim_start_matches('#').trim();
                let mut parameter = json!({ "key": key, "value": json_of_value(value) });
                // The unit is at the end of the comment.
                let meaning = match comment.strip_suffix(']').and_then(|text| text.rsplit_once('[')) {
                    Some((meaning, unit)) => {
                        parameter["unit"] = unit.into();
                        meaning.trim()
                    }
                    None => comment,
                };
                if !meaning.is_empty() {
                    parameter["meaning"] = meaning.into();
                }
                found.push(parameter);
            }
            Item::Table(inner) => add_parameters(&format!("{key}."), inner, found),
            Item::ArrayOfTables(list) => {
                for (k, inner) in list.iter().enumerate() {
                    add_parameters(&format!("{key}.{k}."), inner, found);
                }
            }
            Item::None => {}
        }
    }
}
