//! Words that a shell proposes for values without a fixed list: names of cases, methods, keys, channels and files.

use super::builtins;
use crate::case::{schema, train_keys};
use crate::compare::{Channel, Requirement};
use crate::plot::{branches, catalogue, certified, portraits, studies as study_figures};
use crate::results::schema as columns_of;
use crate::simulation::Method;
use crate::sweep::QUANTITIES;
use clap::builder::StyledStr;
use clap_complete::engine::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use std::ffi::OsStr;
use std::path::{Path, is_separator};

/// Extensions of results, and of what else is HDF5.
const RESULTS: &[&str] = &["h5", "hdf5", "nc"];

fn candidate(value: &str, help: &str) -> CompletionCandidate {
    CompletionCandidate::new(value).help((!help.is_empty()).then(|| StyledStr::from(help.to_owned())))
}

/// Built-in ones, and files of these extensions; where there is none of either, all files. Folders lead on.
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

/// Built-in ones that a command takes, and files.
fn of_command(command: &'static str, extensions: &'static [&'static str]) -> ArgValueCompleter {
    ArgValueCompleter::new(move |typed: &OsStr| {
        let start = typed.to_string_lossy();
        let all = builtins::listed().unwrap_or_default().into_iter();
        let fitting = all.filter(|one| one.command == command && one.name.starts_with(&*start));
        let built_in = fitting.map(|one| candidate(one.name, &one.title)).collect();
        or_files(built_in, typed, extensions)
    })
}

/// A case: a built-in one, a TOML file, or a result that is repeated.
pub(super) fn cases_and_results() -> ArgValueCompleter {
    of_command("run", &["toml", "h5"])
}

/// A study that a command takes.
pub(super) fn studies(command: &'static str) -> ArgValueCompleter {
    of_command(command, &["toml"])
}

/// Whatever is built in, by name.
pub(super) fn names() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let listed = builtins::listed().unwrap_or_default();
        listed.iter().map(|one| candidate(one.name, &one.title)).collect()
    })
}

/// Result files.
pub(super) fn results() -> ArgValueCompleter {
    ArgValueCompleter::new(|typed: &OsStr| or_files(Vec::new(), typed, RESULTS))
}

/// Integration methods.
pub(super) fn methods() -> ArgValueCandidates {
    ArgValueCandidates::new(|| Method::all().map(|method| candidate(method.name(), "")).collect())
}

/// Keys of a case, each with the sign that its value follows; of an array its first element.
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

/// Channels that every trajectory has.
pub(super) fn channels() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let tables = columns_of::tables();
        let channels = tables.iter().take(1).flat_map(columns_of::channels);
        channels.map(|one| candidate(&one.name, &one.long_name)).collect()
    })
}

/// Channels of a comparison, each with the sign that its column follows.
pub(super) fn columns() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let channels = Channel::ALL.iter().map(|channel| channel.name());
        let names = std::iter::once("time".into()).chain(channels);
        names
            .map(|name: std::borrow::Cow<str>| candidate(&format!("{name}="), ""))
            .collect()
    })
}

/// What can be required of a comparison.
pub(super) fn requirements() -> ArgValueCandidates {
    ArgValueCandidates::new(|| Requirement::metrics().map(|name| candidate(name, "")).collect())
}

/// Figures, by name.
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

/// What a sweep keeps of its runs, and a continuation of its points.
pub(super) fn quantities() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let all = QUANTITIES.iter().map(|one| (one.name, one.description));
        let of_branches = branches::quantity::QUANTITIES.iter().map(|one| (one.name, one.words));
        all.chain(of_branches)
            .map(|(name, about)| candidate(name, about))
            .collect()
    })
}
