//! What the definitions of the arguments give besides `--help`: `stickslip completions` and `stickslip man`.
//!
//! The shell asks the program itself through an environment variable, so that names and keys are those of the installed
//! version. The functions here complete values without a fixed list: cases, methods, keys, channels and files.

use super::arguments::{Arguments, Common, CompletionsOptions, ManOptions, Shell};
use super::case::listed;
use super::help;
use super::{CommandEnd, print, print_json, tell};
use crate::Error;
use crate::plot::{branches, catalogue, certified, portraits, studies as study_figures};
use crate::report::FilesReport;
use clap::CommandFactory;
use clap::builder::StyledStr;
use clap_complete::CompleteEnv;
use clap_complete::engine::{
    ArgValueCandidates, ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter,
};
use clap_complete::env::{Bash, EnvCompleter, Fish, Powershell, Shells, Zsh};
use clap_complete_nushell::Nushell;
use clap_mangen::Man;
use serde::Serialize;
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf, is_separator};
use stickslip_analysis::sweep::QUANTITIES;
use stickslip_case::{schema, train_keys};
use stickslip_compare::{Channel, Requirement};
use stickslip_engine::simulation::Method;
use stickslip_files::disk::write_whole;
use stickslip_files::schema as columns_of;

const ASKED: &str = "STICKSLIP_COMPLETE";
const NAME: &str = "stickslip";
const RESULTS: &[&str] = &["h5", "hdf5", "nc"];

/// zsh calls a script in `fpath` already for the first word.
const FIRST_WORD_IN_ZSH: &str = "
if [ \"$funcstack[1]\" = \"_stickslip\" ]; then
    _clap_dynamic_completer_stickslip \"$@\"
fi
";

/// Answers the completion request of a shell, and ends the process. Without a request it does nothing.
pub fn complete_if_asked() {
    CompleteEnv::with_factory(Arguments::command)
        .var(ASKED)
        .shells(Shells(&[&Bash, &Fish, &Zsh, &Powershell]))
        .complete();
}

#[derive(Serialize)]
struct Completion<'a> {
    script: &'a str,
    shell: &'static str,
}

pub(super) fn completions(options: &CompletionsOptions, common: &Common) -> Result<CommandEnd, Error> {
    let asking = |shell: &dyn EnvCompleter| {
        let mut script = Vec::new();
        shell
            .write_registration(ASKED, NAME, NAME, NAME, &mut script)
            .map_err(|error| Error::computation(format!("writing the script failed: {error}")))?;
        Ok::<_, Error>(script)
    };
    let (shell, script, last) = match options.shell {
        Shell::Bash => ("bash", asking(&Bash)?, ""),
        Shell::Fish => ("fish", asking(&Fish)?, ""),
        Shell::Zsh => ("zsh", asking(&Zsh)?, FIRST_WORD_IN_ZSH),
        Shell::PowerShell => ("powershell", asking(&Powershell)?, ""),
        Shell::Nushell => ("nushell", in_nushell(), ""),
    };
    let script = &(String::from_utf8_lossy(&script).trim_start().to_owned() + last);
    match common.json {
        true => print_json(&Completion { script, shell })?,
        false => print(script)?,
    }
    Ok(CommandEnd::Done)
}

/// Definitions of the commands and options for nushell, which cannot ask the program. Values are completed only if
/// they are a fixed list.
fn in_nushell() -> Vec<u8> {
    let mut script = Vec::new();
    clap_complete::generate(Nushell, &mut Arguments::command(), NAME, &mut script);
    script
}

/// Writes a manual page for the program and one for each command. Earlier pages are replaced, other
/// files are not.
pub(super) fn man(options: &ManOptions, common: &Common) -> Result<CommandEnd, Error> {
    if let Some(foreign) = foreign(&options.folder) {
        let why = "there already, and not a manual page of this program; remove it, or name another folder";
        return Err(Error::of_file(&foreign, why));
    }
    let files = &pages(&options.folder)
        .map_err(|(path, error)| Error::io(&path, "writing the manual pages", error, "the argument DIR"))?;
    tell(common, &FilesReport { folder: None, files })
}

/// A file at the place of a page that is none of this program.
fn foreign(folder: &Path) -> Option<PathBuf> {
    let program = Arguments::command();
    let commands = program
        .get_subcommands()
        .map(|command| format!("{NAME}-{}.1", command.get_name()));
    let mut paths = commands.chain([format!("{NAME}.1")]).map(|name| folder.join(name));
    paths.find(|path| {
        let heading = format!(".TH {NAME}");
        let is_page = |text: &[u8]| text.windows(heading.len()).any(|part| part == heading.as_bytes());
        path.is_file() && std::fs::read(path).is_ok_and(|text| !is_page(&text))
    })
}

fn pages(folder: &Path) -> Result<Vec<PathBuf>, (PathBuf, io::Error)> {
    std::fs::create_dir_all(folder).map_err(|error| (folder.to_owned(), error))?;
    let mut program = Arguments::command()
        .version(env!("CARGO_PKG_VERSION"))
        .disable_help_subcommand(true)
        // clap_mangen leaves out the text of options that the short help hides.
        .mut_args(|arg| arg.hide_short_help(false));
    program.build();
    let commands: Vec<clap::Command> = program.get_subcommands().cloned().collect();
    let source = format!("stickslip {}", env!("CARGO_PKG_VERSION"));
    let with_page = |command: &clap::Command| {
        let page = Man::new(command.clone()).source(&source).manual("stickslip");
        let path = folder.join(page.get_filename());
        let written = help::page(&page, command, &commands).and_then(|text| write_whole(&path, &[&text]));
        written.map(|()| path.clone()).map_err(|error| (path, error))
    };
    std::iter::once(&program).chain(&commands).map(with_page).collect()
}

fn candidate(value: &str, help: &str) -> CompletionCandidate {
    CompletionCandidate::new(value).help((!help.is_empty()).then(|| StyledStr::from(help.to_owned())))
}

fn candidates<'a>(all: impl Iterator<Item = (&'a str, &'a str)>) -> Vec<CompletionCandidate> {
    all.map(|(value, help)| candidate(value, help)).collect()
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
        let all = listed().unwrap_or_default();
        let fitting = all
            .iter()
            .filter(|one| one.command == command && one.name.starts_with(&*start));
        or_files(
            candidates(fitting.map(|one| (one.name, &*one.title))),
            typed,
            extensions,
        )
    })
}

pub(super) fn cases_and_results() -> ArgValueCompleter {
    of_command("run", &["toml", "h5"])
}

pub(super) fn studies(command: &'static str) -> ArgValueCompleter {
    of_command(command, &["toml"])
}

pub(super) fn results() -> ArgValueCompleter {
    ArgValueCompleter::new(|typed: &OsStr| or_files(Vec::new(), typed, RESULTS))
}

pub(super) fn names() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let listed = listed().unwrap_or_default();
        candidates(listed.iter().map(|one| (one.name, &*one.title)))
    })
}

pub(super) fn methods() -> ArgValueCandidates {
    ArgValueCandidates::new(|| candidates(Method::all().map(|method| (method.name(), ""))))
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
        candidates(channels.map(|one| (&*one.name, &*one.long_name)))
    })
}

pub(super) fn columns() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let channels = Channel::all().chain(Channel::products());
        let names = std::iter::once("time".into()).chain(channels.map(Channel::name));
        names
            .map(|name: std::borrow::Cow<str>| candidate(&format!("{name}="), ""))
            .collect()
    })
}

pub(super) fn requirements() -> ArgValueCandidates {
    ArgValueCandidates::new(|| candidates(Requirement::metrics().map(|name| (name, ""))))
}

pub(super) fn figures() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let of_runs = [catalogue::ENTRIES, portraits::ENTRIES, certified::ENTRIES]
            .into_iter()
            .flatten();
        let of_studies = study_figures::ENTRIES.iter().chain(&branches::ENTRIES);
        let of_studies = of_studies.map(|entry| (entry.name, entry.title));
        candidates(of_runs.map(|entry| (entry.name, entry.title)).chain(of_studies))
    })
}

pub(super) fn quantities() -> ArgValueCandidates {
    ArgValueCandidates::new(|| {
        let all = QUANTITIES.iter().map(|one| (one.name, one.description));
        let of_branches = branches::quantity::QUANTITIES.iter().map(|one| (one.name, one.words));
        candidates(all.chain(of_branches))
    })
}
