//! Shell completions for values without a fixed list: cases, methods, keys, channels and files.

use super::builtins;
use crate::plot::{branches, catalogue, certified, portraits, studies as study_figures};
use clap::builder::StyledStr;
use clap_complete::engine::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use std::ffi::OsStr;
use std::path::{Path, is_separator};
use stickslip_analysis::sweep::QUANTITIES;
use stickslip_case::{schema, train_keys};
use stickslip_compare::{Channel, Requirement};
use stickslip_engine::simulation::Method;
use stickslip_files::schema as columns_of;

const RESULTS: &[&str] = &["h5", "hdf5", "nc"];

fn candidate(value: &str, help: &str) -> CompletionCandidate {
    CompletionCandidate::new(value).help((!help.is_empty()).then(|| StyledStr::from(help.to_owned())))
}

/// Completes built-in names and files with these extensions, or all files if there are none of these. Folders can be
/// entered.
fn or_files(
    built_in: Vec<CompletionCandidate>,
    typed: &OsStr,
    extensions: &'static [&'static str],
) -> Vec<CompletionCandidate> {
    let of_extension = move |path: &Path| {
        let extension = path.extension().and_then(OsStr::to_str);
        path.is_file() && extension.is_some_and(|one| extensions.contains(&one.to_ascii_lowercase().as_str()))
    };
    let is_folder = |one: &CompletionCandidate| one.get_value().to_string_lossy().ends_with(is_separator);
    let mut found = built_in;
    found.extend(PathCompleter::any().filter(of_extension).complete(typed));
    if found.iter().all(is_folder) {
        return PathCompleter::file().complete(typed);
    }
    found
}

fn of_command(command: &'static str, extensions: &'static [&'static str]) -> ArgValueCompleter {
    ArgValueCompleter::new(move |typed: &OsStr| {
        let start = typed.to_string_lossy();
        let all = builtins::listed().unwrap_or_default().into_iter();
        let fitting = all.filter(|one| one.command == command && one.name.starts_with(&*start));
        let built_in = fitting.map(|one| candidate(one.name, &one.title)).collect();
        or_files(built_in, typed, extensions)
    })
}

pub(super) fn cases_and_results() -> ArgValueCompleter {
    of_command("run", &["toml", "h5"])
}

pub(super) fn studies(command: &'static str) -> ArgValueCompleter {
    of_command(command, &["toml"])
}

pub(super) fn names() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let listed = builtins::listed().unwrap_or_default();
        listed.iter().map(|one| candidate(one.name, &one.title)).collect()
    })
}

pub(super) fn results() -> ArgValueCompleter {
    ArgValueCompleter::new(|typed: &OsStr| or_files(Vec::new(), typed, RESULTS))
}

pub(super) fn methods() -> ArgValueCandidates {
    ArgValueCandidates::new(|| Method::all().map(|method| candidate(method.name(), "")).collect())
}

/// Keys of a case with their equals sign. Only the first element of an array is listed.
pub(super) fn keys() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let of_short_form = schema::keys().map(|key| (key.path, key.description));
        let of_general_form = train_keys().map(|key| (key.path, key.description));
        let mut seen = std::collections::HashSet::new();
        of_short_form
            .chain(of_general_form)
            .filter(|key| seen.insert(key.0))
            .map(|(path, description)| candidate(&(path.replace("[]", ".0") + "="), description))
            .collect()
    })
}

pub(super) fn channels() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let tables = columns_of::tables();
        let channels = tables.iter().take(1).flat_map(columns_of::channels);
        channels.map(|one| candidate(&one.name, &one.long_name)).collect()
    })
}

pub(super) fn columns() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let channels = Channel::all().chain(Channel::products());
        let channels = channels.map(Channel::name);
        let names = std::iter::once("time".into()).chain(channels);
        names
            .map(|name: std::borrow::Cow<str>| candidate(&format!("{name}="), ""))
            .collect()
    })
}

pub(super) fn requirements() -> ArgValueCandidates {
    ArgValueCandidates::new(|| Requirement::metrics().map(|name| candidate(name, "")).collect())
}

pub(super) fn figures() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let of_runs = catalogue::ENTRIES
            .iter()
            .chain(portraits::ENTRIES)
            .chain(certified::ENTRIES);
        let of_runs = of_runs.map(|entry| (entry.name, entry.title));
        let of_studies = study_figures::ENTRIES.iter().chain(&branches::ENTRIES);
        let of_studies = of_studies.map(|entry| (entry.name, entry.title));
        of_runs
            .chain(of_studies)
            .map(|(name, title)| candidate(name, title))
            .collect()
    })
}

pub(super) fn quantities() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let all = QUANTITIES.iter().map(|one| (one.name, one.description));
        let of_branches = branches::quantity::QUANTITIES.iter().map(|one| (one.name, one.words));
        all.chain(of_branches)
            .map(|(name, about)| candidate(name, about))
            .collect()
    })
}
