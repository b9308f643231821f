//! The arguments.

use super::completions::{
    cases_and_results, channels, columns, figures, keys, methods, names, quantities, requirements, results, studies,
};
use super::help::examples;
use crate::export;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{ArgAction, Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use stickslip_analysis::sweep::Shard;
use stickslip_analysis::{overrides, provenance};
use stickslip_case::quantity::{self, Dimension};
use stickslip_case::{CaseError, Override};

/// High-accuracy reference runs of friction-induced vibration, stored in HDF5.
#[derive(Debug, Parser)]
#[command(name = "stickslip", after_help = examples(""))]
pub struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Options of all commands, below the command's own in the help.
#[derive(Debug, Args)]
pub(super) struct Common {
    /// Print nothing but errors.
    #[arg(short, long, global = true, display_order = 101)]
    pub quiet: bool,
    /// Print more details; twice for even more.
    #[arg(short, long, global = true, display_order = 102, action = ArgAction::Count)]
    pub verbose: u8,
    /// Progress bar: always, never, or auto (on a terminal).
    #[arg(long, global = true, display_order = 103, hide_short_help = true, value_enum, default_value_t = ProgressChoice::Auto, value_name = "WHEN", hide_possible_values = true, hide_default_value = true)]
    pub progress: ProgressChoice,
    /// Print one JSON document on standard output.
    #[arg(long, global = true, display_order = 104)]
    pub json: bool,
    /// Follow links from HDF5 files to other files.
    #[arg(long, global = true, display_order = 105, hide_short_help = true)]
    pub follow_external: bool,
}

/// Options for the keys of the case that are changed most. They are accepted wherever `--set` is.
#[derive(Debug, Args)]
pub(super) struct KeyOptions {
    /// Relative tolerance (the key solver.rtol).
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    rtol: Option<String>,
    /// End of the run, s or with a unit (output.end_time).
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    end_time: Option<String>,
    /// Interval of samples, s or with a unit (output.interval).
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    interval: Option<String>,
}

impl KeyOptions {
    /// The overrides of the case, with those of these options last.
    pub fn over(&self, set: &[String]) -> Vec<String> {
        let keys = [
            ("solver.rtol", &self.rtol),
            ("output.end_time", &self.end_time),
            ("output.interval", &self.interval),
        ];
        let given = keys
            .into_iter()
            .filter_map(|(key, value)| Some(format!("{key}={}", value.as_ref()?)));
        set.iter().cloned().chain(given).collect()
    }
}

/// Limit of every run of a command.
#[derive(Debug, Args)]
pub(super) struct BudgetOptions {
    /// End a run after this wall time, s or with a unit [default: none].
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    max_wall_time: Option<String>,
}

impl BudgetOptions {
    /// Whether there is one.
    pub fn is_given(&self) -> bool {
        self.max_wall_time.is_some()
    }

    /// The overrides of the case, with the budget as one of them.
    pub fn over(&self, set: &[String]) -> Vec<String> {
        let budget = self.max_wall_time.iter().map(|t| format!("solver.max_wall_time={t}"));
        set.iter().cloned().chain(budget).collect()
    }
}

/// How a study makes its runs.
#[derive(Debug, Args)]
pub(super) struct StudyRuns {
    /// Threads [default: one for each processor].
    #[arg(short = 'j', long = "jobs", value_name = "N", value_parser = jobs, allow_hyphen_values = true)]
    pub jobs: Option<usize>,
    /// Integration method (solver.method); series is the fastest [default of a calibration: series].
    #[arg(long, value_name = "M", add = methods())]
    method: Option<String>,
    /// Override a key of the base case, such as torsion.damping=20 or stator.damping.0=2.
    #[arg(long = "set", value_name = "KEY=VALUE", add = keys())]
    set: Vec<String>,
    #[command(flatten)]
    keys: KeyOptions,
    #[command(flatten)]
    budget: BudgetOptions,
}

impl StudyRuns {
    /// The overrides of the base case.
    pub fn overrides(&self) -> Result<Vec<Override>, CaseError> {
        let mut set = self.budget.over(&self.keys.over(&self.set));
        set.extend(self.method.as_ref().map(|method| format!("solver.method={method}")));
        overrides(&set)
    }
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
    #[command(after_help = examples("run"))]
    Run(RunOptions),
    /// State how many digits of a result are true.
    #[command(after_help = examples("certify"))]
    Certify(CertifyOptions),
    /// Compare results of any solver with a reference.
    #[command(after_help = examples("compare"))]
    Compare(CompareOptions),
    /// List the contents of a result file.
    #[command(after_help = examples("inspect"))]
    Inspect(InspectOptions),
    /// Verify a result file: checksums and structure.
    #[command(after_help = examples("check"))]
    Check(CheckOptions),
    /// Run a study: many cases, a map, a critical curve.
    #[command(after_help = examples("sweep"))]
    Sweep(SweepOptions),
    /// Merge the shards of a sweep.
    #[command(after_help = examples("merge"))]
    Merge(MergeArguments),
    /// Find the parameters that reproduce measured numbers.
    #[command(after_help = examples("calibrate"))]
    Calibrate(CalibrateOptions),
    /// Draw figures of result files, or write an interactive page.
    #[command(
        after_help = examples("plot"),
        override_usage = "stickslip plot [OPTIONS] <FILE>...\n       stickslip plot <FILE> [FILE] --html <PAGE>\n       stickslip plot --list"
    )]
    Plot(PlotOptions),
    /// Write a table of a result as CSV, NPZ or MAT.
    #[command(after_help = examples("export"))]
    Export(ExportOptions),
    /// Natural frequencies, damping and loss of stability of a case.
    #[command(after_help = examples("modes"))]
    Modes(ModesOptions),
    /// Find the periodic motion of a case, with its multipliers.
    #[command(after_help = examples("cycle"))]
    Cycle(CycleOptions),
    /// Follow cycles and steady sliding as a parameter varies.
    #[command(after_help = examples("continue"))]
    Continue(ContinueOptions),
    /// Compare methods and tolerances: error, work, time.
    #[command(after_help = examples("work-precision"))]
    WorkPrecision(WorkPrecisionOptions),
    /// Print a built-in case or study to start from.
    #[command(after_help = examples("case"), override_usage = "stickslip case [OPTIONS] <NAME>\n       stickslip case [OPTIONS] --list\n       stickslip case [OPTIONS] --keys [WORD]")]
    Case(CaseOptions),
    /// Print the completion script of a shell.
    #[command(after_help = examples("completions"))]
    Completions(CompletionsOptions),
    /// Write the manual pages, one for each command.
    #[command(after_help = examples("man"))]
    Man(ManOptions),
}

impl Command {
    /// The files that the command writes, each with its option; of `export` the folder alone.
    pub fn files(&self) -> Vec<(&'static str, &Path)> {
        let all: &[(&'static str, Option<&PathBuf>)] = match self {
            Command::Run(o) => &[("-o", o.output.as_ref())],
            Command::Certify(o) => &[("-o", o.output.as_ref()), ("--figure", o.figure.as_ref())],
            Command::Compare(o) => &[("--report", o.report.as_ref())],
            Command::Sweep(o) => &[("-o", o.output.as_ref())],
            Command::Merge(o) => &[("-o", Some(&o.output))],
            Command::Calibrate(o) => &[("-o", o.output.as_ref()), ("--case", o.case.as_ref())],
            Command::Plot(o) => &[("-o", Some(&o.output)), ("--html", o.html.as_ref())],
            Command::Modes(o) => &[("--figure", o.figure.as_ref())],
            Command::Cycle(o) => &[("-o", o.output.as_ref())],
            Command::Continue(o) => &[("-o", o.output.as_ref())],
            Command::WorkPrecision(o) => &[("-o", o.output.as_ref()), ("--figure", o.figure.as_ref())],
            Command::Export(o) if o.benchmark => &[("-o", o.output.as_ref())],
            Command::Case(o) => &[("-o", o.output.as_ref())],
            Command::Man(o) => &[("DIR", Some(&o.folder))],
            Command::Export(_) | Command::Inspect(_) | Command::Check(_) | Command::Completions(_) => &[],
        };
        let named = all.iter().filter_map(|&(option, path)| Some((option, path?.as_path())));
        named.collect()
    }
}

impl Command {
    /// The case or the study that the command computes, and the name of the command if it takes a study.
    pub fn given(&self) -> Option<(&str, Option<&'static str>)> {
        match self {
            Command::Run(RunOptions { case, .. })
            | Command::Certify(CertifyOptions { case, .. })
            | Command::Modes(ModesOptions { case, .. })
            | Command::Cycle(CycleOptions { case, .. }) => Some((case, None)),
            Command::Sweep(o) => Some((&o.study, Some("sweep"))),
            Command::Continue(o) => Some((&o.study, Some("continue"))),
            Command::Calibrate(o) => Some((&o.study, Some("calibrate"))),
            Command::WorkPrecision(o) => Some((&o.study, Some("work-precision"))),
            _ => None,
        }
    }

    /// The results that the command reads; of candidates of other solvers none.
    pub fn results(&self) -> Vec<&Path> {
        match self {
            Command::Compare(o) => vec![&o.reference],
            Command::Inspect(o) => vec![&o.file],
            Command::Check(o) => vec![&o.file],
            Command::Export(o) => vec![&o.file],
            Command::Merge(o) => o.shards.iter().map(PathBuf::as_path).collect(),
            Command::Plot(o) => o.files.iter().map(PathBuf::as_path).collect(),
            _ => match self.given() {
                Some((case, None)) if case.ends_with(".h5") => vec![Path::new(case)],
                _ => Vec::new(),
            },
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct RunOptions {
    /// A TOML file, a built-in case, or a result to repeat.
    #[arg(value_name = "CASE", default_value = stickslip_case::builtin::DEFAULT, add = cases_and_results())]
    pub case: String,
    /// Result file [default: CASE.h5, or CASE.repeat.h5].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Integration method, such as cvode or series (solver.method).
    #[arg(long, value_name = "M", add = methods())]
    pub method: Option<String>,
    /// Override a key, such as initial.speed="900 rpm".
    #[arg(long = "set", value_name = "KEY=VALUE", add = keys())]
    pub set: Vec<String>,
    #[command(flatten)]
    pub keys: KeyOptions,
    /// Leave out the reference check (witness), a run by another method.
    #[arg(long)]
    pub no_witness: bool,
    /// Exit with 1 if there is a warning, or the reference check differs.
    #[arg(long)]
    pub strict: bool,
    #[command(flatten)]
    pub budget: BudgetOptions,
    /// Replace any file, not only a result of this program.
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Args)]
pub(super) struct CompareOptions {
    /// The reference: a result file, or the folder of a problem of the benchmark set.
    #[arg(value_name = "REFERENCE", add = results())]
    pub reference: PathBuf,
    /// Results to compare with it: result files, other HDF5, CSV or NPZ files, tables of events.
    #[arg(value_name = "CANDIDATE", required = true)]
    pub candidates: Vec<PathBuf>,
    /// A TOML file that assigns columns to channels, with units.
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
    /// The same for one column, such as relative_velocity=w:rpm or theta=-angle (opposite sign); may be repeated.
    #[arg(long = "column", value_name = "CHANNEL=[-]COLUMN[:UNIT]", add = columns())]
    pub columns: Vec<String>,
    /// A table of the candidate's events, instead of finding them by the relative velocity.
    #[arg(long, value_name = "FILE")]
    pub events: Option<PathBuf>,
    /// Add this to the candidate's times, s or with a unit; auto: find the shift that makes its events agree.
    #[arg(long, value_name = "T|auto", allow_hyphen_values = true)]
    pub time_offset: Option<String>,
    /// A relative velocity up to this counts as zero, rad/s (m/s in translation) or with a unit [default: 1e-8; for a contact
    /// without stick friction.threshold].
    #[arg(long, value_name = "V", allow_hyphen_values = true)]
    pub velocity_tolerance: Option<String>,
    /// A stick ends where the relative velocity exceeds this many tolerances [default: 2].
    #[arg(long, value_name = "N", value_parser = number, allow_hyphen_values = true)]
    pub hysteresis: Option<f64>,
    /// Compare only; do not look for causes.
    #[arg(long)]
    pub quick: bool,
    /// End the search for the causes of a candidate after this wall time, s or with a unit [default: 10 min].
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    pub max_wall_time: Option<String>,
    /// A requirement, such as 'onset<1e-6'; may be repeated. Exit status 1 if one is not met.
    #[arg(long, value_name = "METRIC<BOUND", add = requirements())]
    pub require: Vec<String>,
    /// Write a report, .html or .md.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// With --report: replace any file, not only a report of this program.
    #[arg(long, requires = "report")]
    pub force: bool,
}

#[derive(Debug, Args)]
pub(super) struct CertifyOptions {
    /// A TOML file, a built-in case, or a result file.
    #[arg(value_name = "CASE|FILE", default_value = stickslip_case::builtin::DEFAULT, add = cases_and_results())]
    pub case: String,
    /// The result with its certificate [default: NAME.certified.h5].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Digits required in the time of every event; exit status 1 if one has fewer.
    #[arg(long, value_name = "N", value_parser = count::<u32>, allow_hyphen_values = true)]
    pub digits: Option<u32>,
    /// Exit with 1 if there is a warning.
    #[arg(long)]
    pub strict: bool,
    /// Also solve the case by the exact solver (oracle), in multiple precision, and compare the result with its solution.
    #[arg(long)]
    pub oracle: bool,
    /// Draw the first stick against the tolerance, with and without a kick (SVG, PNG, PDF).
    #[arg(long, value_name = "FILE")]
    pub figure: Option<PathBuf>,
    /// Override a key, such as solver.rtol=1e-12; for a case only.
    #[arg(long = "set", value_name = "KEY=VALUE", add = keys())]
    pub set: Vec<String>,
    #[command(flatten)]
    pub keys: KeyOptions,
    #[command(flatten)]
    pub budget: BudgetOptions,
    /// Replace any file, not only a result of this program.
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Args)]
pub(super) struct SweepOptions {
    /// A TOML file, or a built-in study.
    #[arg(value_name = "STUDY", add = studies("sweep"))]
    pub study: String,
    /// Sweep file [default: STUDY.h5, or STUDY.shard-K-of-N.h5].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Sweep part K of N of the study; slurm: the part of this task of a job array.
    #[arg(long, value_name = "K/N|slurm", value_parser = shard)]
    pub shard: Option<Shard>,
    /// Continue an interrupted sweep.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Exit with 1 if a point failed or ended too early.
    #[arg(long)]
    pub strict: bool,
    #[command(flatten)]
    pub runs: StudyRuns,
    /// Replace any file, and start anew.
    #[arg(long)]
    pub force: bool,
    /// Removed; the error says so.
    #[arg(long, hide = true)]
    pub mpi: bool,
}

#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// The files of all shards, in any order.
    #[arg(value_name = "SHARD", required = true, add = results())]
    pub shards: Vec<PathBuf>,
    /// Sweep file.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Removed; the error says so.
    #[arg(long = "virtual", hide = true)]
    pub by_reference: bool,
    /// Replace a file that exists.
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Args)]
pub(super) struct CalibrateOptions {
    /// A TOML file, or a built-in study.
    #[arg(value_name = "STUDY", default_value = stickslip_analysis::calibrate::CALIBRATIONS[0].name, add = studies("calibrate"))]
    pub study: String,
    /// Result file, with every run [default: STUDY.h5].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Write the case with the calibrated parameters, ready to run (TOML).
    #[arg(long, value_name = "FILE")]
    pub case: Option<PathBuf>,
    #[command(flatten)]
    pub runs: StudyRuns,
    /// Replace any file, not only a result of this program.
    #[arg(long)]
    pub force: bool,
}

fn shard(text: &str) -> Result<Shard, String> {
    Shard::parse(text, &|name| std::env::var(name).ok())
}

/// More threads than this are taken for a mistake.
const MOST_JOBS: usize = 4096;

fn jobs(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(count) if (1..=MOST_JOBS).contains(&count) => Ok(count),
        _ => Err(format!("give a number of threads from 1 to {MOST_JOBS}")),
    }
}

/// The name of a variable, which may be written with hyphens.
fn variable(name: &str) -> Result<String, std::convert::Infallible> {
    Ok(name.replace('-', "_"))
}

fn count<N: std::str::FromStr>(text: &str) -> Result<N, String> {
    let wrong = |_| "give a whole number, 0 or more".to_owned();
    text.parse().map_err(wrong)
}

fn number(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(quantity::too_large(text).unwrap_or_else(|| "give a number".to_owned())),
    }
}

#[derive(Debug, Args)]
pub(super) struct CheckOptions {
    /// A file of this program.
    #[arg(value_name = "FILE", add = results())]
    pub file: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct InspectOptions {
    /// A result file.
    #[arg(value_name = "FILE", add = results())]
    pub file: PathBuf,
}

#[derive(Debug, Args)]
pub(super) struct ExportOptions {
    /// A result file, or the file of a study.
    #[arg(value_name = "FILE", add = results())]
    pub file: PathBuf,
    /// The file to write [default: FILE.csv]; - for CSV on standard output.
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// csv, npz or mat [default: the extension].
    #[arg(
        long,
        value_parser = choice_but::<export::Format>("parquet", "pandas makes Parquet of CSV: pandas.read_csv(...).to_parquet(...)"),
        value_name = "F",
        hide_possible_values = true,
        conflicts_with = "benchmark"
    )]
    pub format: Option<export::Format>,
    /// trajectory, events, segments or stick_slip.
    #[arg(long, value_enum, value_name = "TABLE", default_value_t = export::Which::Trajectory, hide_possible_values = true, hide_default_value = true, conflicts_with = "benchmark")]
    pub table: export::Which,
    /// Only these columns, such as phi1,normal_force.
    #[arg(long, value_name = "A,B", value_delimiter = ',', value_parser = variable, conflicts_with = "benchmark", add = channels())]
    pub channels: Vec<String>,
    /// Only times FROM:TO, FROM: or :TO, s or with units.
    #[arg(long, value_name = "FROM:TO", value_parser = window, allow_hyphen_values = true, conflicts_with = "benchmark")]
    pub window: Option<(f64, f64)>,
    /// Evaluate at this rate, Hz or with a unit.
    #[arg(long, value_name = "F", value_parser = frequency, allow_hyphen_values = true, conflicts_with_all = ["interval", "at", "benchmark"])]
    pub rate: Option<f64>,
    /// Evaluate at this interval, s or with a unit.
    #[arg(long, value_name = "T", value_parser = duration, allow_hyphen_values = true, conflicts_with_all = ["at", "benchmark"])]
    pub interval: Option<f64>,
    /// Evaluate the trajectory at the times of a table, s.
    #[arg(long, value_name = "CSV", conflicts_with = "benchmark")]
    pub at: Option<PathBuf>,
    /// Write a citable benchmark package, into a folder.
    #[arg(long)]
    pub benchmark: bool,
    /// With --benchmark: its author.
    #[arg(long, value_name = "NAME", requires = "benchmark")]
    pub author: Option<String>,
    /// With --benchmark: SPDX identifier of its licence.
    #[arg(long, value_name = "ID", requires = "benchmark")]
    pub license: Option<String>,
    /// Replace any file, not only an identical export.
    #[arg(long)]
    pub force: bool,
}

/// A number in SI units, or a quantity with its unit.
fn in_si(text: &str, dimension: Dimension) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => quantity::parse(text, dimension).map_err(|_| {
            if let Some(what) = quantity::decimal_comma(text).or_else(|| quantity::too_large(text)) {
                return what;
            }
            let (name, unit, example) = (dimension.name(), dimension.unit(), dimension.example());
            format!("give {name} in {unit}, or with its unit, such as \"{example}\"")
        }),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    in_si(text, Dimension::Time)
}

fn positive(value: f64) -> Result<f64, String> {
    (value > 0.0)
        .then_some(value)
        .ok_or_else(|| "give a number greater than 0".to_owned())
}

fn duration(text: &str) -> Result<f64, String> {
    positive(seconds(text)?)
}

fn frequency(text: &str) -> Result<f64, String> {
    positive(in_si(text, Dimension::Frequency)?)
}

/// Two times with a colon between them.
fn window(text: &str) -> Result<(f64, f64), String> {
    let wrong = || "give two times with a colon between them, such as 6.97:6.99 or \"6970 ms:6990 ms\"".to_owned();
    let (from, to) = text.split_once(':').ok_or_else(wrong)?;
    let bound = |text: &str, without: f64| match text.trim() {
        "" => Ok(without),
        text => seconds(text),
    };
    let (from, to) = (bound(from, f64::NEG_INFINITY)?, bound(to, f64::INFINITY)?);
    if from > to {
        return Err(format!(
            "the window begins at {from:?} s, after its end; exchange the two"
        ));
    }
    Ok((from, to))
}

#[derive(Debug, Args)]
pub(super) struct ModesOptions {
    /// A TOML file, a built-in case, or a result.
    #[arg(value_name = "CASE", default_value = stickslip_case::builtin::DEFAULT, add = cases_and_results())]
    pub case: String,
    /// Override a key, such as friction.decay=4.
    #[arg(long = "set", value_name = "KEY=VALUE", add = keys())]
    pub set: Vec<String>,
    #[command(flatten)]
    pub keys: KeyOptions,
    /// Draw growth rate and damping over the speed.
    #[arg(long, value_name = "FILE")]
    pub figure: Option<PathBuf>,
    /// Replace any file, not only this program's figure.
    #[arg(long, requires = "figure")]
    pub force: bool,
}

/// Where the search for a cycle starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum SearchFrom {
    End,
    Initial,
}

#[derive(Debug, Args)]
pub(super) struct CycleOptions {
    /// A TOML file, a built-in case, a result, or a file of branches.
    #[arg(value_name = "CASE", add = cases_and_results())]
    pub case: String,
    /// Result file with one period [default: CASE.cycle.h5].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// With a file of branches: the branch of the point.
    #[arg(long, value_name = "B", value_parser = count::<usize>, allow_hyphen_values = true, requires = "point", conflicts_with_all = ["from", "period", "periods"])]
    pub branch: Option<usize>,
    /// With a file of branches: the point whose cycle is computed.
    #[arg(long, value_name = "K", value_parser = count::<usize>, allow_hyphen_values = true, requires = "branch")]
    pub point: Option<usize>,
    /// Start from the end of the run (end) or from [initial] of the case (initial), for an unstable cycle.
    #[arg(long, value_enum, value_name = "WHERE", default_value_t = SearchFrom::End, hide_possible_values = true)]
    pub from: SearchFrom,
    /// Look for a period near this length, s or with a unit [default: the best fit].
    #[arg(long, value_name = "T", value_parser = duration, allow_hyphen_values = true, conflicts_with = "periods")]
    pub period: Option<f64>,
    /// Length of the cycle in drive periods, or in turns if nothing drives the system [default: the best fit].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=stickslip_analysis::cycle::LONGEST as i64), allow_hyphen_values = true)]
    pub periods: Option<u32>,
    /// Override a key, such as rotor.speed=0.3.
    #[arg(long = "set", value_name = "KEY=VALUE", add = keys())]
    pub set: Vec<String>,
    #[command(flatten)]
    pub keys: KeyOptions,
    /// Replace any file, not only a result of this program.
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Args)]
pub(super) struct ContinueOptions {
    /// A TOML file, or a built-in study.
    #[arg(value_name = "STUDY", default_value = stickslip_analysis::continuation::CONTINUATIONS[0].name, add = studies("continue"))]
    pub study: String,
    /// Result file [default: STUDY.h5].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Continue an interrupted continuation.
    #[arg(long, conflicts_with = "force")]
    pub resume: bool,
    /// Override a key of the base case, such as stator.damping.0=2.
    #[arg(long = "set", value_name = "KEY=VALUE", add = keys())]
    pub set: Vec<String>,
    #[command(flatten)]
    pub keys: KeyOptions,
    /// Exit with 1 if a branch could not be followed.
    #[arg(long)]
    pub strict: bool,
    /// Replace any file, and start anew.
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Args)]
pub(super) struct WorkPrecisionOptions {
    /// A TOML file, or a built-in study.
    #[arg(value_name = "STUDY", default_value = stickslip_analysis::analysis::work_precision::STUDIES[0].name, add = studies("work-precision"))]
    pub study: String,
    /// Result file [default: STUDY.h5].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Draw the figure, as SVG and PNG, into this folder.
    #[arg(long, value_name = "DIR")]
    pub figure: Option<PathBuf>,
    /// Replace any file, not only one of this program.
    #[arg(long)]
    pub force: bool,
}

/// One of the values of `T`; `gone`, which was one in earlier versions, is refused with what to use instead.
fn choice_but<T: ValueEnum + Send + Sync + 'static>(
    gone: &'static str,
    instead: &'static str,
) -> impl TypedValueParser<Value = T> {
    let known = T::value_variants().iter().filter_map(ValueEnum::to_possible_value);
    PossibleValuesParser::new(known.chain([PossibleValue::new(gone).hide(true)]))
        .try_map(move |name| T::from_str(&name, true).map_err(|_| instead))
}

/// File format of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum FigureFormat {
    Svg,
    Png,
    Pdf,
}

impl FigureFormat {
    pub fn extension(self) -> &'static str {
        match self {
            FigureFormat::Svg => "svg",
            FigureFormat::Png => "png",
            FigureFormat::Pdf => "pdf",
        }
    }

    /// By the extension of a file name.
    pub(crate) fn of_path(path: &Path) -> Option<FigureFormat> {
        <FigureFormat as ValueEnum>::from_str(path.extension()?.to_str()?, true).ok()
    }
}

#[derive(Debug, Args)]
pub(super) struct PlotOptions {
    /// Result files, drawn over each other; or one file of many runs.
    #[arg(value_name = "FILE", required_unless_present = "list", add = results())]
    pub files: Vec<PathBuf>,
    /// Folder, or file of one figure.
    #[arg(short, long, value_name = "DIR|FILE", default_value = "figures")]
    pub output: PathBuf,
    /// Only this figure, by name or number in the paper.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["channels", "phase"], add = figures())]
    pub only: Vec<String>,
    /// List the figures.
    #[arg(long)]
    pub list: bool,
    /// Draw this channel over time; may be repeated.
    #[arg(long = "channel", value_name = "NAME", value_parser = variable, add = channels())]
    pub channels: Vec<String>,
    /// Draw the channels against this one, not time.
    #[arg(long, value_name = "NAME", value_parser = variable, requires = "channels", add = channels())]
    pub x: Option<String>,
    /// Draw variable B against variable A.
    #[arg(long, num_args = 2, value_names = ["A", "B"], value_parser = variable, add = channels())]
    pub phase: Vec<String>,
    /// With a sweep or branches: draw this; may be repeated.
    #[arg(long = "quantity", value_name = "NAME", value_parser = variable, add = quantities())]
    pub quantities: Vec<String>,
    /// With a sweep: the axes of a map, by key.
    #[arg(long, num_args = 2, value_names = ["X", "Y"])]
    pub axes: Vec<String>,
    /// With a sweep: only points with this value.
    #[arg(long, value_name = "AXIS=VALUE")]
    pub at: Vec<String>,
    /// Start time, s or with a unit (--channel, --phase).
    #[arg(long, value_name = "T", value_parser = seconds, allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// End time, s or with a unit (--channel, --phase).
    #[arg(long, value_name = "T", value_parser = seconds, allow_hyphen_values = true)]
    pub to: Option<f64>,
    /// svg, png or pdf [default: SVG and PNG].
    #[arg(long, value_parser = choice_but::<FigureFormat>("eps", "write a PDF; `pdftops -eps figure.pdf` makes EPS of it"), value_name = "FORMAT", hide_possible_values = true)]
    pub format: Option<FigureFormat>,
    /// Width, mm; or 8.4cm, 3.3in, 240pt.
    ///
    /// 85 is a column of a journal, 300 a screen.
    #[arg(long, value_name = "WIDTH", default_value_t = crate::plot::style::COLUMN_WIDTH, value_parser = width, allow_hyphen_values = true)]
    pub width: f64,
    /// Font size, points.
    ///
    /// Lines grow with them.
    #[arg(long, value_name = "SIZE", default_value_t = crate::plot::style::FONT_SIZE, value_parser = font_size, allow_hyphen_values = true)]
    pub font_size: f64,
    /// Leave out the title above the figure.
    #[arg(long)]
    pub no_title: bool,
    /// Pixels per inch in PNG.
    #[arg(long, value_name = "N", default_value_t = DPI, value_parser = dpi, allow_hyphen_values = true)]
    pub dpi: f64,
    /// Another solver's result, drawn with its error.
    ///
    /// A result, other HDF5, CSV, NPZ, or a table of events.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["only", "list", "x", "phase"])]
    pub candidate: Option<PathBuf>,
    /// A TOML file that assigns its columns, as for compare.
    #[arg(long, value_name = "FILE", requires = "candidate")]
    pub map: Option<PathBuf>,
    /// The same for one; may be repeated.
    ///
    /// Such as relative_velocity=w:rpm.
    #[arg(long = "column", value_name = "NAME=COL", requires = "candidate", add = columns())]
    pub columns: Vec<String>,
    /// Write the interactive page of one run or two.
    #[arg(
        long,
        value_name = "PAGE",
        conflicts_with_all = [
            "output", "only", "list", "channels", "x", "phase", "axes", "at", "from", "to", "format", "width", "font_size", "no_title", "dpi"
        ]
    )]
    pub html: Option<PathBuf>,
    /// With --html: open the page in the browser.
    #[arg(long, requires = "html")]
    pub open: bool,
    /// Replace any file, not only this program's.
    #[arg(long)]
    pub force: bool,
}

/// Pixels of an inch in print.
pub(super) const DPI: f64 = 300.0;

fn between(text: &str, low: f64, high: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (low..=high).contains(&value) => Ok(value),
        _ => Err(format!("give a number from {low} to {high}")),
    }
}

/// Units of a length, with how many millimetres each has.
const LENGTHS: [(&str, f64); 4] = [("mm", 1.0), ("cm", 10.0), ("in", 25.4), ("pt", 25.4 / 72.0)];

/// Below 60 mm there is no room for axes at the usual font size.
fn width(text: &str) -> Result<f64, String> {
    let of_unit = |(unit, millimetres): (&str, f64)| Some((text.strip_suffix(unit)?.trim_end(), millimetres));
    let (digits, millimetres) = LENGTHS.into_iter().find_map(of_unit).unwrap_or((text, 1.0));
    // A larger font needs more: that is seen where both are known. A smaller one needs less.
    let least = crate::plot::style::LEAST_WIDTH * LEAST_FONT / crate::plot::style::FONT_SIZE;
    match digits.parse::<f64>() {
        Ok(value) if (least..=1000.0).contains(&(value * millimetres)) => Ok(value * millimetres),
        _ => Err(
            "give a width from 60 to 1000 mm, such as 84mm, 3.3in, 8.4cm or 240pt; smaller ones take a smaller --font-size"
                .to_owned(),
        ),
    }
}

/// Least size of letters, points: below, print loses them.
const LEAST_FONT: f64 = 4.0;

fn font_size(text: &str) -> Result<f64, String> {
    between(text.strip_suffix("pt").unwrap_or(text).trim_end(), LEAST_FONT, 24.0)
}

fn dpi(text: &str) -> Result<f64, String> {
    between(text, 30.0, 2400.0)
}

#[derive(Debug, Args)]
pub(super) struct CaseOptions {
    /// Name of a built-in case or study.
    #[arg(value_name = "NAME", required_unless_present_any = ["list", "keys"], conflicts_with_all = ["list", "keys"], add = names())]
    pub name: Option<String>,
    /// List the built-in cases and studies.
    #[arg(long)]
    pub list: bool,
    /// List the keys of files, or those that contain WORD.
    #[arg(long, value_name = "WORD", num_args = 0..=1, default_missing_value = "", conflicts_with = "list")]
    pub keys: Option<String>,
    /// Write the text into this file instead of printing it.
    #[arg(short, long, value_name = "FILE", conflicts_with = "list")]
    pub output: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long, requires = "output")]
    pub force: bool,
}

/// A shell that completes words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[expect(clippy::enum_variant_names, reason = "PowerShell is a name")]
pub(super) enum Shell {
    Bash,
    Zsh,
    Fish,
    #[value(name = "powershell")]
    PowerShell,
    Nushell,
}

#[derive(Debug, Args)]
pub(super) struct CompletionsOptions {
    /// bash, zsh, fish, powershell or nushell.
    #[arg(value_enum, value_name = "SHELL", hide_possible_values = true)]
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub(super) struct ManOptions {
    /// Their folder, made if it does not exist.
    #[arg(value_name = "DIR", value_hint = clap::ValueHint::DirPath)]
    pub folder: PathBuf,
}

/// Arguments that are no command: help, the version, or wrong usage.
#[derive(Debug)]
pub struct Refusal(clap::Error);

impl Refusal {
    /// Prints the text, to standard output for help and version; exit status 0 for them, 2 for wrong usage. With --json
    /// wrong usage is a document, too.
    pub fn report(&self) -> ExitCode {
        use clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand as NothingGiven;
        if !self.0.use_stderr() {
            let _ = self.0.print();
            return ExitCode::SUCCESS;
        }
        let text = super::usage::message(&self.0);
        match self.0.kind() {
            // The help itself.
            NothingGiven => drop(self.0.print()),
            _ => super::say(&super::line(&text, true)),
        }
        if std::env::args_os()
            .skip(1)
            .take_while(|a| a != "--")
            .any(|a| a == "--json")
        {
            super::failure_document("usage", &text, 2, &[]);
        }
        ExitCode::from(2)
    }
}

impl Arguments {
    /// From the command line of this process.
    ///
    /// # Errors
    /// If it asks for help or the version, or is wrong.
    pub fn read() -> Result<Arguments, Refusal> {
        // The versions of the libraries are known at run time only.
        let matches = Arguments::command()
            .version(provenance::versions())
            .try_get_matches()
            .map_err(Refusal)?;
        Arguments::from_arg_matches(&matches).map_err(Refusal)
    }

    /// Whether standard output is for one JSON document.
    pub fn wants_json(&self) -> bool {
        self.common.json
    }
}
