//! The command line: arguments become validated options, and options a call.
//!
//! | module | contents |
//! |---|---|
//! | `arguments` | options |
//! | `run`, `certify`, `compare`, `cycle`, `modes` | commands that compute or assess a result |
//! | `studies` | `sweep`, `calibrate`, `continue`, `work-precision` |
//! | `plot`, `export`, `files`, `case` | commands that read files: figures, tables, `inspect`, `check`, `merge`, built-in cases |
//! | `completions`, `help` | completions and manual pages; examples |
//! | `usage` | wrong usage: what was probably meant |
//! | `interrupt`, `progress` | common parts of commands; what they say is in `report` |

mod arguments;
mod case;
mod certify;
mod compare;
mod completions;
mod cycle;
mod export;
mod files;
mod help;
mod interrupt;
mod modes;
mod plot;
mod progress;
mod run;
mod studies;
mod usage;

pub use arguments::{Arguments, Refusal};
pub use completions::complete_if_asked;

use crate::error::{Error, FailurePlace};
use crate::report::{Report, terminal, unwritten};
use arguments::{Command, Common};
use serde::Serialize;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use stickslip_system::quote;

/// How a successful command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandEnd {
    /// Complete: exit status 0.
    Done,
    /// The command was stopped by Ctrl-C or a termination signal. All results so far are saved.
    Interrupted,
}

const INTERRUPTED: u8 = 130;

impl CommandEnd {
    /// The exit status. With `json`, a command that was interrupted before its document reports this in a document.
    pub fn report(self, json: bool) -> ExitCode {
        match self {
            CommandEnd::Done => ExitCode::SUCCESS,
            CommandEnd::Interrupted => {
                if json {
                    failure_document("interrupted", "interrupted before there was a result", INTERRUPTED, &[]);
                }
                ExitCode::from(INTERRUPTED)
            }
        }
    }
}

impl Error {
    /// Writes the message to stderr. With `json` it also writes a document to stdout, unless there is one already.
    /// Returns the exit status.
    pub fn report(&self, json: bool) -> ExitCode {
        let (kind, status) = match self.is_input() {
            true => ("input", 2),
            false => ("computation", 1),
        };
        let text = quote::lines(&self.text);
        if json {
            failure_document(kind, &text, status, &self.places);
        }
        say(&line(&text, true));
        ExitCode::from(status)
    }
}

#[derive(Serialize)]
struct FailureDocument<'a> {
    error: FailedCommand<'a>,
}

#[derive(Serialize)]
struct FailedCommand<'a> {
    /// usage, input, computation or interrupted.
    kind: &'a str,
    message: &'a str,
    exit_status: u8,
    /// May be empty.
    places: &'a [FailurePlace],
}

fn failure_document(kind: &str, message: &str, exit_status: u8, places: &[FailurePlace]) {
    if DOCUMENT_IS_PRINTED.load(Ordering::Relaxed) {
        return;
    }
    let error = FailedCommand {
        kind,
        message,
        exit_status,
        places,
    };
    // If standard output fails, the message is still on standard error.
    let _ = print_json(&FailureDocument { error });
}

/// Runs a command.
///
/// # Errors
/// The input is wrong, or the computation failed.
pub fn execute(arguments: Arguments) -> Result<CommandEnd, Error> {
    let Arguments { command, common } = arguments;
    let level = match (common.quiet, common.verbose) {
        (true, _) => log::LevelFilter::Error,
        (false, 0) => log::LevelFilter::Warn,
        (false, 1) => log::LevelFilter::Info,
        (false, _) => log::LevelFilter::Debug,
    };
    env_logger::Builder::new()
        .filter_level(level)
        .format(|target, record| {
            let text = match record.level() {
                log::Level::Warn => format!("{WARNING} {}", record.args()),
                _ => record.args().to_string(),
            };
            std::io::Write::write_all(target, line(&text, record.level() == log::Level::Error).as_bytes())
        })
        .init();
    // Turns a limit on file sizes into a write error; by default it ends the program silently.
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default())
        .map_err(|error| Error::computation(format!("the signal handler could not be set: {error}")))?;
    stickslip_files::follow_external(common.follow_external);
    dispatch(command, &common)
}

fn dispatch(command: Command, common: &Common) -> Result<CommandEnd, Error> {
    refuse_standard_output(&command)?;
    usage::refuse_uncomputed(&command)?;
    let given = command.given().map(|(name, command)| (name.to_owned(), command));
    let end = match command {
        Command::Run(options) => run::run(&options, common),
        Command::Certify(options) => certify::certify(&options, common),
        Command::Compare(options) => compare::compare(&options, common),
        Command::Sweep(options) => studies::sweep(&options, common),
        Command::Merge(options) => files::merge(&options, common),
        Command::Calibrate(options) => studies::calibrate(&options, common),
        Command::Check(options) => files::check(&options, common),
        Command::Inspect(options) => files::inspect(&options, common),
        Command::Plot(options) => plot::plot(&options, common),
        Command::Export(options) => export::export(&options, common),
        Command::Modes(options) => modes::modes(&options, common),
        Command::Cycle(options) => cycle::cycle(&options, common),
        Command::Continue(options) => studies::continuation(&options, common),
        Command::WorkPrecision(options) => studies::work_precision(&options, common),
        Command::Case(options) => case::case(&options, common),
        Command::Completions(options) => completions::completions(&options, common),
        Command::Man(options) => completions::man(&options, common),
    };
    end.map_err(|error| match &given {
        Some((name, command)) if error.is_input() => usage::with_keys(usage::explained(error, (name, *command))),
        _ => error,
    })
}

/// Writes to standard output, without control characters. A closed pipe (`stickslip case paper | head`) is no error.
fn print(text: &str) -> Result<(), Error> {
    use std::io::Write;
    match std::io::stdout().write_all(quote::for_terminal(text).as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::computation(format!(
            "writing to standard output failed: {error}"
        ))),
        _ => Ok(()),
    }
}

/// Writes a note, or a warning if the text begins with this word, to standard error.
fn complain(text: &str) {
    say(&line(text, false));
}

/// Line for standard error, without control characters of the text. On a terminal the name before an error and the word
/// "warning" have a colour, unless NO_COLOR is set.
fn line(text: &str, is_error: bool) -> String {
    let style = console::Style::new().for_stderr().bold();
    let text = quote::for_terminal(text);
    match (is_error, text.strip_prefix(WARNING)) {
        (true, _) => format!("{} {text}\n", style.red().apply_to("stickslip:")),
        (false, Some(rest)) => format!("stickslip: {}{rest}\n", style.yellow().apply_to(WARNING)),
        (false, None) => format!("stickslip: {text}\n"),
    }
}

const WARNING: &str = "warning:";

fn say(line: &str) {
    let _ = std::io::Write::write_all(&mut std::io::stderr(), line.as_bytes());
}

/// Refuses a file named `-`, which users might take for standard output.
fn refuse_standard_output(command: &Command) -> Result<(), Error> {
    match command.files().into_iter().find(|(_, path)| path.as_os_str() == "-") {
        Some((option, _)) => Err(Error::input(format!(
            "{option} -: the file is not written to standard output; name it, such as {option} ./- if it is to have that \
             name. The command that streams is stickslip export FILE -o -, as CSV"
        ))),
        None => Ok(()),
    }
}

/// Ends a successful command. With --strict a warning is an error. Prints the doubts unless they were `said`.
fn strictly(strict: bool, doubts: &[String], said: bool, file: &std::path::Path) -> Result<CommandEnd, Error> {
    if !strict || doubts.is_empty() {
        return Ok(CommandEnd::Done);
    }
    let what = match doubts {
        _ if !said => doubts.join("\n"),
        [_] => "there is a warning".to_owned(),
        all => format!("there are {} warnings", all.len()),
    };
    Err(Error::computation(format!(
        "--strict lets no warning pass: {what}\n{} was written nevertheless",
        file.display()
    )))
}

fn interrupted(common: &Common, how: &str) -> Result<CommandEnd, Error> {
    if !common.quiet {
        complain(&format!("interrupted{how}"));
    }
    Ok(CommandEnd::Interrupted)
}

/// Prints the JSON document or the text of a report. With --quiet and without --json it prints neither.
fn tell(common: &Common, report: &impl Report) -> Result<CommandEnd, Error> {
    match common.quiet && !common.json {
        true => Ok(CommandEnd::Done),
        false => show(common, report),
    }
}

/// Prints the JSON document or the text of a report, even with --quiet, because it was asked for.
fn show(common: &Common, report: &impl Report) -> Result<CommandEnd, Error> {
    match common.json {
        true => print_document(&report.document()?)?,
        false => print(&terminal(&report.page(), common.verbose > 0))?,
    }
    Ok(CommandEnd::Done)
}

static DOCUMENT_IS_PRINTED: AtomicBool = AtomicBool::new(false);

fn print_json(document: &impl serde::Serialize) -> Result<(), Error> {
    print_document(&serde_json::to_string_pretty(document).map_err(unwritten)?)
}

fn print_document(text: &str) -> Result<(), Error> {
    DOCUMENT_IS_PRINTED.store(true, Ordering::Relaxed);
    print(&(quote::in_json(text, |_| false) + "\n"))
}
