//! The arguments.

use super::provenance;
use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::process::ExitCode;

/// High-accuracy reference runs of friction-induced vibration, stored in HDF5.
#[derive(Debug, Parser)]
#[command(name = "stickslip", disable_help_subcommand = true)]
pub struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Options of all commands.
#[derive(Debug, Args)]
pub(super) struct Common {
    /// Print nothing but errors.
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Say more of what is going on; twice for even more.
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
    /// Progress bar: always, never, or auto (on a terminal).
    #[arg(long, global = true, value_enum, default_value_t = ProgressChoice::Auto, value_name = "WHEN", hide_possible_values = true, hide_default_value = true)]
    pub progress: ProgressChoice,
    /// Print one JSON document on standard output.
    #[arg(long, global = true)]
    pub json: bool,
}

/// When a progress bar is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ProgressChoice {
    Auto,
    Always,
    Never,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Integrate one case and store the run in HDF5.
    Run(RunOptions),
    /// Show a run on an interactive page.
    Plot(PlotOptions),
    /// Show what a result file holds.
    Inspect(InspectOptions),
    /// Print a built-in case to start from.
    #[command(override_usage = "stickslip case [OPTIONS] <NAME>\n       stickslip case [OPTIONS] --list")]
    Case(CaseOptions),
}

#[derive(Debug, Args)]
pub(super) struct RunOptions {
    /// A TOML file, a built-in case, or a result to repeat.
    #[arg(value_name = "CASE", default_value = crate::case::builtin::DEFAULT)]
    pub case: String,
    /// Result file [default: CASE.h5, or CASE.repeat.h5].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Integration method, the same as --set solver.method=M.
    #[arg(long, value_name = "M")]
    pub method: Option<String>,
    /// Override a key, such as initial.speed="900 rpm".
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Replace any file, not only a result of this program.
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Args)]
pub(super) struct PlotOptions {
    /// A result file.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Interactive page to write, one HTML file.
    #[arg(long, value_name = "PAGE")]
    pub html: PathBuf,
    /// Replace any file, not only a page of this program.
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Args)]
pub(super) struct InspectOptions {
    /// A result file.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct CaseOptions {
    /// Name of a built-in case.
    #[arg(value_name = "NAME", required_unless_present = "list", conflicts_with = "list")]
    pub name: Option<String>,
    /// List the built-in cases.
    #[arg(long)]
    pub list: bool,
}

/// Arguments that are no command: help, the version, or wrong usage.
#[derive(Debug)]
pub struct Refusal(clap::Error);

impl Refusal {
    /// Prints the text, to standard output for help and version; exit status 0 for them, 2 for wrong usage.
    pub fn report(&self) -> ExitCode {
        let _ = self.0.print();
        if self.0.use_stderr() {
            ExitCode::from(2)
        } else {
            ExitCode::SUCCESS
        }
    }
}

impl Arguments {
    /// From the command line of this process.
    ///
    /// # Errors
    /// If it asks for help or the version, or is wrong.
    pub fn read() -> Result<Arguments, Refusal> {
        use clap::{CommandFactory, FromArgMatches};
        // The versions of the libraries are known at run time only.
        let matches = Arguments::command()
            .version(provenance::versions())
            .try_get_matches()
            .map_err(Refusal)?;
        Arguments::from_arg_matches(&matches).map_err(Refusal)
    }
}
