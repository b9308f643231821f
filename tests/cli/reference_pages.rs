//! The generated parts of docs/reference, between markers, are what the program says about itself.
//!
//! `STICKSLIP_WRITE=1 cargo test --release --test cli reference_pages::` writes them again.

use crate::common::json::*;
use std::fmt::Write as _;
use std::path::Path;

use crate::common::cli::Folder;
use clap::{Arg, ArgAction, Command, CommandFactory};
use serde_json::Value;

/// Compares the parts of a page with their markers, or writes them.
fn hold(page: &str, parts: &[(&str, String)]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference").join(page);
    let text = std::fs::read_to_string(&path).unwrap();
    let mut now = text.clone();
    for (marker, part) in parts {
        let (begin, end) = (format!("<!-- {marker} -->\n"), format!("<!-- end of {marker} -->"));
        let from = now.find(&begin).expect(marker) + begin.len();
        let to = now.find(&end).expect(marker);
        now.replace_range(from..to, &format!("\n{}\n\n", part.trim()));
    }
    match std::env::var_os("STICKSLIP_WRITE") {
        Some(_) => std::fs::write(&path, now).unwrap(),
        None => assert!(
            now == text,
            "docs/reference/{page} is not what the program says; write it again with: STICKSLIP_WRITE=1 cargo test --release \
             --test cli reference_pages::"
        ),
    }
}

/// Text in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('\n', " ").replace('|', "\\|")
}

fn table(titles: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut text = format!("|{}|\n|{}\n", titles.join("|"), "---|".repeat(titles.len()));
    for row in rows {
        writeln!(text, "|{}|", row.join("|")).unwrap();
    }
    text + "\n"
}

/// How an argument is written, with its short form.
fn written(argument: &Arg) -> String {
    let mut long = argument.to_string().replace("...", "");
    for name in argument.get_value_names().unwrap_or_default() {
        long = long.replace(&format!("<{name}>"), name);
    }
    let short = argument.get_short().map(|short| format!("-{short}, "));
    let short = short.filter(|_| argument.get_long().is_some());
    format!("`{}{}`", short.unwrap_or_default(), cell(&long))
}

fn meaning(argument: &Arg) -> String {
    let mut text = cell(&argument.get_help().map(ToString::to_string).unwrap_or_default());
    let defaults: Vec<_> = argument
        .get_default_values()
        .iter()
        .map(|value| value.to_string_lossy())
        .collect();
    let takes_value = matches!(argument.get_action(), ArgAction::Set | ArgAction::Append);
    if takes_value && !defaults.is_empty() && !text.contains("[default") {
        write!(text, " [default: {}]", cell(&defaults.join(", "))).unwrap();
    }
    let is_list = matches!(argument.get_action(), ArgAction::Append) && !argument.is_positional();
    let takes_one = argument.get_num_args().is_none_or(|count| count.max_values() == 1);
    if is_list && takes_one && argument.get_value_delimiter().is_none() && !text.contains("may be repeated") {
        text += "; may be repeated";
    }
    text
}

fn arguments(command: &Command, global: bool) -> impl Iterator<Item = &Arg> {
    let own = command.get_arguments();
    own.filter(move |one| {
        !one.is_hide_set() && one.is_global_set() == global && !["help", "version"].contains(&one.get_id().as_str())
    })
}

fn rows<'a>(arguments: impl Iterator<Item = &'a Arg>) -> String {
    table(
        &["argument", "meaning"],
        arguments.map(|one| vec![written(one), meaning(one)]),
    )
}

#[test]
fn regression_the_page_of_commands_is_the_help_of_the_program() {
    let mut program = stickslip::cli::Arguments::command();
    program.build();
    let is_listed = |one: &&Command| !one.is_hide_set() && one.get_name() != "help";
    let commands: Vec<&Command> = program.get_subcommands().filter(is_listed).collect();
    let mut list = table(
        &["command", "purpose"],
        commands.iter().map(|one| {
            let (name, about) = (one.get_name(), one.get_about().unwrap_or_default());
            vec![format!("[`{name}`](#{name})"), cell(&about.to_string())]
        }),
    );
    list += "Options of every command:\n\n";
    list += &rows(arguments(&program, true));
    let mut each = String::new();
    for command in &commands {
        let usage = (*command).clone().render_usage().to_string();
        let usage = usage.trim_start_matches("Usage: ");
        let usage: Vec<&str> = usage.lines().map(str::trim).collect();
        let about = command.get_about().unwrap_or_default();
        write!(
            each,
            "### {}\n\n{about}\n\n```console\n{}\n```\n\n",
            command.get_name(),
            usage.join("\n")
        )
        .unwrap();
        each += &rows(arguments(command, false));
    }
    hold("commands.md", &[("list of commands", list), ("each command", each)]);
}

#[test]
fn regression_the_page_of_keys_is_the_schema_of_cases_and_studies() {
    let listed = Folder::new().json("case --keys");
    let listed = listed.list();
    let text = |key: &Value, name: &str| key[name].as_str().unwrap_or_default().to_owned();
    let takes = |key: &Value| {
        let words: Vec<String> = key["words"]
            .list()
            .iter()
            .map(|word| format!("`{}`", word.text()))
            .collect();
        if !words.is_empty() {
            return words.join(", ");
        }
        let unit = match (key["unit"].as_str(), key["unit_of_translation"].as_str()) {
            (None | Some("1"), _) => return text(key, "takes"),
            (Some(unit), None) => unit.to_owned(),
            (Some(unit), Some(other)) => format!("{unit} or {other}"),
        };
        match text(key, "takes").as_str() {
            "number" => unit,
            takes => format!("{takes}, {unit}"),
        }
    };
    let table_of = |key: &Value| {
        text(key, "key")
            .rsplit_once('.')
            .map(|(table, _)| table.to_owned())
            .unwrap_or_default()
    };
    // One table for each table of a file, of studies also for each command.
    let part = |is_of: &dyn Fn(&str) -> bool| {
        let of = |key: &Value| match text(key, "of") {
            studies if studies.starts_with("studies") => (studies, table_of(key)),
            _ => (String::new(), table_of(key)),
        };
        // Both trains have the same keys, and the law of trains has one word more.
        let is_listed = |key: &&Value| {
            let is_brakes_law = key["key"] == "friction.law" && key["of"] == "cases with [torsion]";
            is_of(key["of"].text()) && table_of(key) != "stator" && !is_brakes_law
        };
        let own: Vec<&Value> = listed.iter().filter(is_listed).collect();
        let mut tables: Vec<(String, String)> = Vec::new();
        for key in &own {
            if !tables.contains(&of(key)) {
                tables.push(of(key));
            }
        }
        let mut part = String::new();
        for one in tables {
            let rows = own.iter().filter(|key| of(key) == one).map(|key| {
                let name = text(key, "key");
                let name = name.rsplit('.').next().unwrap().to_owned();
                // `lugre` alone is a law for trains only.
                let trains = key["of"] == "cases with [rotor] and [stator]" && one.1 != "rotor" && name != "law";
                let meaning = cell(&text(key, "meaning")) + if trains { " (trains only)" } else { "" };
                vec![format!("`{name}`"), takes(key), cell(&text(key, "default")), meaning]
            });
            let title = match one.1.as_str() {
                "" => "Outside tables".to_owned(),
                "SIGNAL" => "Table of a signal".to_owned(),
                "rotor" => "`[rotor]` and `[stator]`: trains".to_owned(),
                "torsion" => "`[torsion]`: a brake".to_owned(),
                table if table.ends_with("[]") => format!("`[[{}]]`", table.trim_end_matches("[]")),
                table => format!("`[{table}]`"),
            };
            let whose = match one.0.strip_prefix("studies of ") {
                Some(commands) => format!(" ({commands})"),
                None => String::new(),
            };
            write!(
                part,
                "#### {title}{whose}\n\n{}",
                table(&["key", "unit or type", "default", "meaning"], rows)
            )
            .unwrap();
        }
        part
    };
    hold(
        "keys.md",
        &[
            (
                "keys of cases",
                part(&|of| !of.starts_with("studies") && of != "signals"),
            ),
            ("keys of signals", part(&|of| of == "signals")),
            ("keys of studies", part(&|of| of.starts_with("studies"))),
        ],
    );
}

/// One way to a key of each kind: its table, its unit, its meaning, a word that it takes.
#[test]
fn cli_case_keys_lists_what_contains_a_word() {
    let folder = Folder::new();
    let keys = |arguments: &str| -> Vec<String> {
        let listed = folder.json(arguments);
        listed.list().iter().map(|key| key["key"].text().to_owned()).collect()
    };
    let all = keys("case --keys");
    for key in [
        "title",
        "torsion.damping",
        "rotor.inertia",
        "perturbation[].time",
        "SIGNAL.amplitude",
        "axis[].key",
        "target[].value",
    ] {
        assert!(all.iter().any(|one| one == key), "{key}");
    }
    assert_eq!(
        keys("case --keys diameter"),
        ["contact.radius", "contact.outer_diameter", "contact.inner_diameter"][1..]
    );
    assert!(keys("case --keys SOBOL").contains(&"sample.method".to_owned()));
    assert!(keys("case --keys lugre").contains(&"friction.law".to_owned()));
    let (stdout, _) = folder.ends("case --keys torsion", 0);
    for words in [
        "unit or type",
        "torsion.damping",
        "N m s/rad",
        "required",
        "c_t, torsional contact damping of each disk",
    ] {
        assert!(stdout.contains(words), "{words}: {stdout}");
    }
    folder.refused(
        "case --keys frictoin",
        "no key of a case or a study contains \"frictoin\"; did you mean friction?",
    );
    folder.refused("case paper --keys", "cannot be used with");
}

/// What `inspect` lists of a file.
struct Listing(Value);

impl Listing {
    fn of(folder: &Folder, file: &str) -> Listing {
        Listing(folder.json(["inspect", file].as_slice()))
    }

    /// Rows of the variables of a group: name, unit, meaning with the type and the codes.
    fn variables(&self, group: &str, is_listed: impl Fn(&str) -> bool) -> Vec<Vec<String>> {
        let text = |variable: &Value, name: &str| variable[name].as_str().unwrap_or_default().to_owned();
        let all = self.0["variables"].list().iter();
        let own = all.filter(|one| one["group"] == group && is_listed(&text(one, "name")));
        own.map(|one| {
            let flags = one["flags"].list().iter();
            let codes: Vec<String> = flags
                .map(|flag| format!("{} {}", flag["value"], flag["meaning"].text()))
                .collect();
            let mut meaning = text(one, "long_name");
            if !codes.is_empty() {
                meaning = format!("{meaning}: {}", codes.join(", "));
            }
            if text(one, "type") != "float64" {
                meaning = format!("`{}`: {meaning}", text(one, "type"));
            }
            vec![format!("`{}`", text(one, "name")), text(one, "units"), cell(&meaning)]
        })
        .collect()
    }

    /// Rows of the attributes of a group that have a description.
    fn attributes(&self, group: &str, is_listed: impl Fn(&str) -> bool) -> Vec<Vec<String>> {
        let all = self.0["attributes"].list();
        let value = |name: String| {
            let found = all
                .iter()
                .find(|one| one["group"] == group && one["name"] == name.as_str());
            found.and_then(|one| one["value"].as_str()).map(str::to_owned)
        };
        let names = all
            .iter()
            .filter(|one| one["group"] == group)
            .map(|one| one["name"].text());
        names
            .filter(|name| is_listed(name))
            .filter_map(|name| {
                let meaning = value(format!("{name}_long_name"))?;
                let unit = value(format!("{name}_units")).unwrap_or_default();
                Some(vec![format!("`{name}`"), unit, cell(&meaning)])
            })
            .collect()
    }
}

const COLUMNS: [&str; 3] = ["variable", "unit", "meaning"];
const ATTRIBUTES: [&str; 3] = ["attribute", "unit", "meaning"];

/// A run of the paper's brake, and a certified one of a belt.
fn runs() -> (Folder, Listing, Listing) {
    let folder = Folder::new();
    folder.ok("run paper --method series -q");
    folder.ok("certify belt-leine -q");
    let (paper, belt) = (
        Listing::of(&folder, "paper.h5"),
        Listing::of(&folder, "belt-leine.certified.h5"),
    );
    (folder, paper, belt)
}

#[test]
fn regression_the_page_of_columns_is_what_files_have() {
    let (folder, paper, belt) = runs();
    folder.ok("run belt-leine --no-witness --set output.dense=true --set output.end_time=20 -o dense.h5 -q");
    folder.ok("cycle belt-exponential --set rotor.speed=0.3 -o cycle.h5 -q");
    folder.ok("certify cycle.h5 -o certified-cycle.h5 -q");
    let series = "solver = { method = \"series\" }";
    folder.write(
        "map.toml",
        format!(
            "case = \"paper\"\nset = {{ {series} }}\nkeep = {{ events = true }}\n\
             axis = [{{ key = \"torsion.damping\", from = 10, to = 30, count = 2 }}]\n"
        ),
    );
    folder.write(
        "boundary.toml",
        format!(
            "case = \"paper\"\nset = {{ {series} }}\nboundary = {{ refinements = 0, width = 0.1, growth_contours = [40] }}\n\
             axis = [{{ key = \"friction.decay\", from = 0.3, to = 3, count = 3 }}, \
             {{ key = \"torsion.damping\", from = 10, to = 30, count = 3 }}]\n"
        ),
    );
    folder.write(
        "branches.toml",
        "case = \"belt-exponential\"\nbranch = { of = [\"steady\", \"cycle\"], points = 3, curves = [\"hopf\"] }\n\
         axis = [{ key = \"rotor.speed\", from = 0.3, to = 0.6 }, { key = \"stator.damping.0\", from = 0.2, to = 3 }]\n",
    );
    folder.write(
        "precision.toml",
        "case = \"belt-coulomb\"\nseries = [{ methods = [\"series\"], tolerances = [1e-8] }]\n",
    );
    for command in [
        "sweep map",
        "sweep boundary",
        "continue branches",
        "work-precision precision",
    ] {
        folder.ok(format!("{command}.toml -q").as_str());
    }
    let open = |file: &str| Listing::of(&folder, file);
    let (dense, cycle, map, boundary) = (
        open("dense.h5"),
        open("certified-cycle.h5"),
        open("map.h5"),
        open("boundary.h5"),
    );
    let (branches, precision) = (open("branches.h5"), open("precision.h5"));
    let all = |_: &str| true;
    let titled = |listing: &Listing, groups: &[&str]| -> String {
        let of = |group: &&str| format!("`{group}`\n\n{}", table(&COLUMNS, listing.variables(group, all)));
        groups.iter().map(of).collect()
    };
    let quantities: Vec<&str> = stickslip::sweep::QUANTITIES.iter().map(|one| one.name).collect();
    let mut summary = paper.attributes("/stick_slip", |name| !quantities.contains(&name));
    for row in belt.attributes("/stick_slip", |name| !quantities.contains(&name)) {
        if !summary.iter().any(|other| other[0] == row[0]) {
            summary.push(row);
        }
    }
    let one_channel = |name: &str| !name.starts_with("band_") && !name.starts_with("rate_");
    let mut certificate = belt.variables("/certificate", one_channel);
    for [name, unit, meaning] in crate::common::rows(
        "
        `band_NAME` | as NAME        | how far channel NAME can be from the exact solution at equal phase
        `rate_NAME` | as NAME, per s | largest rate of change of the channel in the stretch
    ",
    ) {
        certificate.push([name, unit, meaning].map(str::to_owned).to_vec());
    }
    let state = |name: &str| name.ends_with("_before") || name.ends_with("_after") && name != "mode_after";
    let is_own = |name: &str| !state(name);
    hold(
        "columns.md",
        &[
            ("trajectory", table(&COLUMNS, paper.variables("/trajectory", all))),
            ("events", table(&COLUMNS, paper.variables("/events", is_own))),
            ("segments", table(&COLUMNS, paper.variables("/segments", all))),
            ("stick_slip", table(&COLUMNS, paper.variables("/stick_slip", all))),
            ("summary", table(&ATTRIBUTES, summary)),
            ("witness", table(&ATTRIBUTES, paper.attributes("/witness", all))),
            ("dense", table(&COLUMNS, dense.variables("/dense", all))),
            ("certificate", table(&COLUMNS, certificate)),
            ("sensitivity", table(&COLUMNS, belt.variables("/sensitivity", all))),
            (
                "cycle",
                table(
                    &ATTRIBUTES,
                    [
                        cycle.attributes("/cycle", all),
                        cycle.attributes("/cycle_certificate", all),
                    ]
                    .concat(),
                ) + &table(
                    &COLUMNS,
                    [
                        cycle.variables("/cycle", all),
                        cycle.variables("/cycle_certificate", all),
                    ]
                    .concat(),
                ),
            ),
            ("sweep", titled(&map, &["/events"]) + &titled(&boundary, &["/boundary"])),
            ("continuation", titled(&branches, &["/branches", "/points", "/curves"])),
            ("work-precision", titled(&precision, &["/runs", "/reference"])),
        ],
    );
}

#[test]
fn regression_the_page_of_quantities_is_the_registry() {
    use stickslip::case::Motion;
    let (_folder, paper, belt) = runs();
    let in_files = [
        paper.attributes("/stick_slip", |_| true),
        belt.attributes("/stick_slip", |_| true),
    ]
    .concat();
    let is_in_files = |name: &str| {
        let name = if name == "energy_residual" {
            "energy_residual_max"
        } else {
            name
        };
        in_files.iter().any(|row| row[0] == format!("`{name}`"))
    };
    let quantities = stickslip::sweep::QUANTITIES.iter().map(|one| {
        let kind = if one.is_count() {
            "count"
        } else {
            one.unit(Motion::Rotation)
        };
        let file = if is_in_files(one.name) { "file" } else { "" };
        vec![
            format!("`{}`", one.name),
            kind.to_owned(),
            file.to_owned(),
            cell(one.description),
        ]
    });
    let channels = stickslip::record::channel::all().map(|one| {
        let aliases: Vec<String> = one
            .aliases
            .split_whitespace()
            .map(|alias| format!("`{alias}`"))
            .collect();
        vec![
            format!("`{}`", one.name),
            one.unit.to_owned(),
            one.symbol.to_owned(),
            cell(one.long_name),
            aliases.join(", "),
        ]
    });
    hold(
        "quantities.md",
        &[
            ("quantities", table(&["name", "unit", "in", "meaning"], quantities)),
            (
                "channels",
                table(&["name", "unit", "symbol", "meaning", "also"], channels),
            ),
        ],
    );
}
