//! The command line: arguments to validated options to a call.

mod arguments;
mod calibrate;
mod case_command;
mod certify;
mod certify_report;
mod check;
mod compare;
mod input;
mod inspect;
mod merge;
mod modes;
mod plot;
mod plot_studies;
mod progress;
mod ranks;
mod run;
mod sweep;
mod terminal;
mod train_modes;
mod trains;
mod work_precision;

pub use arguments::{Arguments, Refusal};

use crate::quote;
use arguments::Command;
use std::process::ExitCode;

/// How a command ended that did what it was asked, as far as it was let.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// All done: exit status 0.
    Done,
    /// By Ctrl-C or a termination signal, with what was computed saved.
    Interrupted,
}

impl End {
    /// The exit status of the process.
    pub fn exit_code(self) -> ExitCode {
        match self {
            End::Done => ExitCode::SUCCESS,
            End::Interrupted => ExitCode::from(130),
        }
    }
}

/// Why a command failed; what is printed is one short paragraph.
#[derive(Debug)]
pub enum CommandError {
    /// Wrong usage or input: exit status 2.
    Input(String),
    /// The computation failed: exit status 1.
    Computation(String),
}

impl CommandError {
    /// Writes the message to stderr; returns the exit status of the process.
    pub fn report(&self) -> ExitCode {
        let (text, status) = match self {
            CommandError::Input(text) => (text, 2),
            CommandError::Computation(text) => (text, 1),
        };
        complain(&quote::lines(text));
        ExitCode::from(status)
    }
}

/// Runs a command.
///
/// # Errors
/// Wrong input, or a computation that failed.
pub fn execute(arguments: Arguments) -> Result<End, CommandError> {
    let Arguments { command, common } = arguments;
    let level = match (common.quiet, common.verbose) {
        (true, _) => log::LevelFilter::Error,
        (false, 0) => log::LevelFilter::Warn,
        (false, 1) => log::LevelFilter::Info,
        (false, _) => log::LevelFilter::Debug,
    };
    env_logger::Builder::new()
        .filter_level(level)
        .format_target(false)
        .format_timestamp(None)
        .init();
    // Else a limit on the size of files would end the program without a word; so it is an error of the write.
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default())
        .map_err(|error| CommandError::Computation(format!("the signal handler could not be set: {error}")))?;
    crate::results::follow_external(common.follow_external);
    match command {
        Command::Run(options) => run::run(&options, &common),
        Command::Certify(options) => certify::certify(&options, &common),
        Command::Compare(options) => compare::compare(&options, &common),
        Command::Sweep(options) => sweep::sweep(&options, &common),
        Command::Merge(options) => merge::merge(&options, &common),
        Command::Calibrate(options) => calibrate::calibrate(&options, &common),
        Command::Check(options) => check::check(&options, &common),
        Command::Inspect(options) => inspect::inspect(&options, &common),
        Command::Plot(options) => plot::plot(&options, &common),
        Command::Modes(options) => modes::modes(&options, &common),
        Command::WorkPrecision(options) => work_precision::work_precision(&options, &common),
        Command::Case(options) => case_command::case(&options, &common),
    }
}

/// Writes to standard output, without what would steer a terminal; a reader that has gone away (`stickslip case paper | head`) is no error.
fn print(text: &str) -> Result<(), CommandError> {
    use std::io::Write;
    match std::io::stdout().write_all(quote::for_terminal(text).as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(CommandError::Computation(format!(
            "writing to standard output failed: {error}"
        ))),
        _ => Ok(()),
    }
}

/// Says something on standard error; if that is closed there is nobody left to tell.
fn complain(text: &str) {
    let text = quote::for_terminal(&format!("stickslip: {text}\n"));
    let _ = std::io::Write::write_all(&mut std::io::stderr(), text.as_bytes());
}

/// One JSON document on standard output.
fn print_json(document: &impl serde::Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string_pretty(document)
        .map_err(|error| CommandError::Computation(format!("writing JSON failed: {error}")))?;
    print(&(quote::in_json(&text, |_| false) + "\n"))
}
