//! Wrong usage: which command, option or file was probably meant.

use super::arguments::{Arguments, Command};
use super::case::OF_COMMANDS;
use crate::Error;
use crate::report::listed_keys;
use clap::CommandFactory;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::path::{Path, PathBuf};
use stickslip_analysis::study::{TextKind, kind_of};
use stickslip_case::builtin;
use stickslip_case::{schema, suggest, train_keys};

/// Message for arguments that could not be parsed, without a prefix; the usage of the command is below it.
pub(super) fn message(error: &clap::Error) -> String {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let program = Arguments::command();
    let usage = error
        .get(ContextKind::Usage)
        .map(ToString::to_string)
        .unwrap_or_default();
    let mut words = usage.split_whitespace().skip_while(|word| *word != "stickslip").skip(1);
    // The error of a value has no usage.
    let mut arguments = std::env::args().skip(1);
    let command = words
        .next()
        .and_then(|name| program.find_subcommand(name))
        .or_else(|| arguments.find_map(|argument| program.find_subcommand(argument)));
    let what = match (
        error.kind(),
        text(ContextKind::InvalidArg),
        text(ContextKind::InvalidSubcommand),
    ) {
        (ErrorKind::UnknownArgument, Some(option), _) => {
            unknown_option(option, text(ContextKind::SuggestedArg), command)
        }
        (ErrorKind::InvalidSubcommand, _, Some(name)) => unknown_command(name, &program),
        _ => {
            let text = error.to_string();
            let text = text.strip_prefix("error: ").unwrap_or(&text);
            let end = text.find("\n\nUsage:").or(text.find("\n\nFor more information"));
            text[..end.unwrap_or(text.len())].to_owned()
        }
    };
    let help = command.map_or_else(String::new, |command| format!(" {}", command.get_name()));
    let usage = match usage.is_empty() {
        true => String::new(),
        false => format!("\n\n{}", usage.trim_end()),
    };
    format!("{}{usage}\n\n`stickslip{help} --help` says more", what.trim_end())
}

/// Longest list of keys in a message.
const MOST_KEYS: usize = 3;

fn unknown_option(given: &str, similar: Option<&str>, command: Option<&clap::Command>) -> String {
    let of = command.map_or_else(
        || "stickslip".to_owned(),
        |command| format!("stickslip {}", command.get_name()),
    );
    let Some(name) = given.strip_prefix('-').map(|rest| rest.trim_start_matches('-')) else {
        return format!("\"{given}\": {of} takes no further argument; a value with blanks stands in quotes");
    };
    let has_set = command.is_some_and(|command| command.get_arguments().any(|one| one.get_long() == Some("set")));
    let name = name.replace('-', "_");
    let mut keys: Vec<&str> = Vec::new();
    if has_set {
        let all = schema::keys().chain(train_keys()).map(|key| key.path);
        for path in all.filter(|path| *path == name || path.rsplit('.').next() == Some(&name)) {
            if !keys.contains(&path) {
                keys.push(path);
            }
        }
    }
    let keys = keys
        .iter()
        .take(MOST_KEYS)
        .map(|key| format!("--set {}=...", key.replace("[]", ".0")));
    let keys: Vec<String> = keys.collect();
    // An option that differs in strokes alone.
    let is_meant = |similar: &&str| similar.trim_start_matches('-').replace('-', "_") == name;
    if let Some(similar) = similar.filter(is_meant) {
        return format!("{given}: no such option; did you mean {similar}?");
    }
    match (&keys[..], similar) {
        ([], Some(similar)) => format!("{given}: no such option; did you mean {similar}?"),
        ([], None) => format!("{given}: {of} has no such option"),
        ([key], _) => format!("{given}: no such option; {key} changes that key"),
        _ => format!("{given}: no such option; {} changes such a key", keys.join(" or ")),
    }
}

fn unknown_command(name: &str, program: &clap::Command) -> String {
    let commands: Vec<&str> = program.get_subcommands().map(clap::Command::get_name).collect();
    if let Some(close) = suggest(name, commands.iter().copied()) {
        return format!("there is no command \"{name}\"; did you mean {close}?");
    }
    if let Some(text) = KnownText::find(name) {
        return format!("\"{name}\" is {}, not a command: {}", text.what(), text.command(name));
    }
    let mut built_in = KnownText::built_in();
    match suggest(name, built_in.clone().map(|(name, _)| name)) {
        Some(close) => {
            let found = built_in.find(|(name, _)| *name == close);
            let command = found.map_or_else(String::new, |(name, text)| text.command(name));
            format!("there is no command \"{name}\"; did you mean {command}?")
        }
        None => format!(
            "there is no command \"{name}\"; the commands are {}",
            commands.join(", ")
        ),
    }
}

/// A case or a study that was given where something else was expected.
#[derive(Debug, Clone)]
enum KnownText {
    BuiltIn(TextKind),
    File(TextKind),
}

impl KnownText {
    /// Every built-in case and study.
    fn built_in() -> impl Iterator<Item = (&'static str, KnownText)> + Clone {
        let cases = builtin::all().into_iter().map(|case| (case.name, TextKind::Case));
        let studies = OF_COMMANDS.into_iter().flat_map(|(command, studies, _)| {
            studies
                .iter()
                .map(move |study| (study.name, TextKind::Study(vec![command])))
        });
        cases
            .chain(studies)
            .map(|(name, kind)| (name, KnownText::BuiltIn(kind)))
    }

    /// The built-in text of this name, or the TOML file of this path.
    fn find(name: &str) -> Option<KnownText> {
        let path = Path::new(name);
        if path.is_file() {
            let is_toml = path.extension().is_some_and(|extension| extension == "toml");
            let text = is_toml.then(|| stickslip_case::input::text(path).ok()?.ok())??;
            return kind_of(&text).map(KnownText::File);
        }
        KnownText::built_in().find(|one| one.0 == name).map(|one| one.1)
    }

    fn kind(&self) -> &TextKind {
        match self {
            KnownText::BuiltIn(kind) | KnownText::File(kind) => kind,
        }
    }

    /// "a case", "a built-in study".
    fn what(&self) -> String {
        let built_in = match self {
            KnownText::BuiltIn(_) => "built-in ",
            KnownText::File(_) => "",
        };
        let noun = match self.kind() {
            TextKind::Case => "case",
            TextKind::Study(_) => "study",
        };
        format!("a {built_in}{noun}")
    }

    /// The command that computes it.
    fn command(&self, name: &str) -> String {
        let command = match self.kind() {
            TextKind::Case => "run",
            TextKind::Study(commands) => commands.first().copied().unwrap_or("sweep"),
        };
        format!("stickslip {command} {name}")
    }
}

/// The input error of a command that was `given` a case or a study ([`Command::given`]). If that is a study in place of a
/// case, a case in place of a study, or a study for another command, the error names the right command instead.
pub(super) fn explained(error: Error, (name, command): (&str, Option<&str>)) -> Error {
    let Some(known) = KnownText::find(name) else {
        return error;
    };
    let noun = match (known.kind(), command) {
        (TextKind::Case, None) => return error,
        (TextKind::Study(commands), Some(command)) if commands.contains(&command) => return error,
        (TextKind::Study(_), Some(_)) => " for another command",
        _ => "",
    };
    Error::input(format!("{name} is {}{noun}: {}", known.what(), known.command(name)))
}

/// The error of wrong values, with the command that lists their keys.
pub(super) fn with_keys(mut error: Error) -> Error {
    let mut keys: Vec<String> = Vec::new();
    for key in error.keys().filter_map(listed_key) {
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    match &keys[..] {
        [] => {}
        // The message may point there itself.
        [key] if error.text.contains("--keys KEY") => {
            error.text = error.text.replace("--keys KEY", &format!("--keys {key}"));
        }
        [key] => error.text += &format!("\n`stickslip case --keys {key}` says more"),
        _ => error.text += "\n`stickslip case --keys KEY` says more of a key",
    }
    error
}

/// The key in the list of keys, such as `output.window[].from` for `output.window.0.from`; that of a signal for one of its values.
fn listed_key(path: &str) -> Option<String> {
    let listed = listed_keys();
    let mut segments: Vec<&str> = path.split('.').collect();
    while !segments.is_empty() {
        let pattern = segments
            .iter()
            .fold(String::new(), |path, segment| match segment.parse::<usize>() {
                Ok(_) => path + "[]",
                Err(_) if path.is_empty() => (*segment).to_owned(),
                Err(_) => format!("{path}.{segment}"),
            });
        let found = listed.iter().find(|known| known.key == pattern);
        if let Some(known) = found {
            return Some(known.key.clone());
        }
        segments.pop();
    }
    None
}

/// Refuses a case or a study in place of its result, and a result that was not computed yet, with the command that
/// writes it. All other faults of files are found by their readers.
pub(super) fn refuse_uncomputed(command: &Command) -> Result<(), Error> {
    let results = command.results().into_iter().filter(|path| !path.is_dir());
    results.into_iter().try_for_each(|path| {
        let name = path.to_string_lossy();
        let known = KnownText::find(&name).filter(|_| path.extension().is_none_or(|extension| extension == "toml"));
        if let Some(known) = known {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let why = format!(
                "{}, not a result; `{}` writes {stem}.h5",
                known.what(),
                known.command(&name)
            );
            return Err(Error::of_file(path, why).placed(path));
        }
        match written_by(path).filter(|_| !path.exists()) {
            Some(command) => Err(Error::of_file(path, format!("no such file; `{command}` writes it")).placed(path)),
            None => Ok(()),
        }
    })
}

/// The command that writes a result of this name.
fn written_by(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?.strip_suffix(".h5")?;
    let (name, of_case) = [("certified", "certify"), ("cycle", "cycle")]
        .into_iter()
        .find_map(|(ending, command)| Some((name.strip_suffix(ending)?.strip_suffix('.')?, Some(command))))
        .unwrap_or((name, None));
    let file: PathBuf = path.with_file_name(format!("{name}.toml"));
    let given = match file.is_file() {
        true => file.to_str()?.to_owned(),
        false => name.to_owned(),
    };
    let known = KnownText::find(&given)?;
    let command = match (of_case, known.kind()) {
        (Some(command), TextKind::Case) => format!("stickslip {command} {given}"),
        (None, _) => known.command(&given),
        (Some(_), TextKind::Study(_)) => return None,
    };
    Some(match path.parent().is_some_and(|folder| folder != Path::new("")) {
        true => format!("{command} -o {}", path.display()),
        false => command,
    })
}
