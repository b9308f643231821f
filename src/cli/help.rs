//! Examples and files of each command, for `--help` and the manual pages.

use clap::Arg;
use clap::builder::StyledStr;
use clap_mangen::Man;
use clap_mangen::roff::{Inline, Roff, bold, italic, roman};
use std::io;

/// A line with its meaning.
type Explained = (&'static str, &'static str);

struct CommandHelp {
    command: &'static str,
    /// Commands without the program's name.
    examples: &'static [Explained],
    /// Files that it writes.
    files: &'static [Explained],
}

const fn help(command: &'static str, examples: &'static [Explained], files: &'static [Explained]) -> CommandHelp {
    CommandHelp {
        command,
        examples,
        files,
    }
}

const COMMANDS: &[CommandHelp] = &[
    help(
        "",
        &[
            ("run", "the paper's brake; writes paper.h5"),
            ("plot paper.h5", "its figures, into the folder figures"),
            ("certify paper.h5", "which digits are true"),
            ("case --list", "more cases and studies to start from"),
        ],
        &[],
    ),
    help(
        "run",
        &[
            ("run", "the built-in case paper"),
            ("run mine.toml -o mine.h5", "a case of your own"),
            ("run --rtol 1e-12 --end-time 7.1 -o a.h5", "shorter, more accurate"),
            ("run paper-si --set friction.decay=4", "with another parameter"),
        ],
        &[
            ("CASE.h5", "The result, if -o gives no other name."),
            ("CASE.repeat.h5", "The result of a run that repeats the file CASE.h5."),
            (
                "CASE.partial.h5",
                "The result while the run goes on, and after an interrupted or failed run.",
            ),
        ],
    ),
    help(
        "certify",
        &[
            ("certify paper.h5", "the digits of a result"),
            ("certify block --oracle --digits 20", "run and certify a case"),
        ],
        &[("NAME.certified.h5", "The result with its certificate.")],
    ),
    help(
        "compare",
        &[
            ("compare paper.h5 mine.csv", "find the cause"),
            ("compare paper.h5 mine.csv --column theta=w:deg", "name a column, unit"),
            ("compare paper.h5 mine.csv --report mine.html", "as a web page"),
        ],
        &[],
    ),
    help(
        "inspect",
        &[("inspect paper.h5", "groups, variables and attributes")],
        &[],
    ),
    help("check", &[("check paper.h5", "status 1 if it is damaged")], &[]),
    help(
        "sweep",
        &[
            ("sweep critical-curve", "a built-in study"),
            ("case critical-curve > mine.toml", "a study to start from"),
            ("sweep mine.toml --jobs 4", "your study, on 4 threads"),
            ("sweep mine.toml --resume", "continue after an interruption"),
        ],
        &[
            ("STUDY.h5", "The results of all points."),
            (
                "STUDY.journal",
                "The points done so far, from which --resume continues; removed at the end.",
            ),
        ],
    ),
    help(
        "merge",
        &[("merge map.shard-*.h5 -o map.h5", "join the shards of a sweep")],
        &[],
    ),
    help(
        "calibrate",
        &[
            ("calibrate", "the study paper-decay"),
            ("calibrate mine.toml --case found.toml", "write the case that was found"),
        ],
        &[("STUDY.h5", "Every run, and the region of the parameters.")],
    ),
    help(
        "plot",
        &[
            ("plot paper.h5", "into the folder figures"),
            ("plot paper.h5 --channel phi1 -o phi1.pdf", "one channel over time"),
            ("plot paper.h5 --html paper.html --open", "a page for a browser"),
            ("plot one.h5 two.h5", "two runs in each figure"),
        ],
        &[("figures/", "The figures as SVG and PNG, if -o gives no other folder.")],
    ),
    help(
        "export",
        &[
            ("export paper.h5 -o paper.csv", "the samples"),
            ("export paper.h5 -o events.csv --table events", "all events"),
            ("export paper.h5 -o x.npz --rate 1MHz --window 6.97:6.99", "at 1 MHz"),
        ],
        &[],
    ),
    help(
        "modes",
        &[
            ("modes", "of the built-in case paper"),
            ("modes mine.toml --set friction.decay=4", "with another parameter"),
        ],
        &[],
    ),
    help(
        "cycle",
        &[
            ("cycle belt-leine", "the run's final cycle"),
            ("cycle belt-exponential --set rotor.speed=0.3", "another speed"),
        ],
        &[("CASE.cycle.h5", "One period of the cycle, with its multipliers.")],
    ),
    help(
        "continue",
        &[
            ("continue", "the built-in study belt-branches"),
            ("plot belt-branches.h5", "its bifurcation diagrams"),
            ("continue mine.toml --resume", "after an interruption"),
        ],
        &[
            ("STUDY.h5", "The branches and their special points."),
            (
                "STUDY.journal",
                "The points done so far, from which --resume continues; removed at the end.",
            ),
        ],
    ),
    help(
        "work-precision",
        &[("work-precision --figure figures", "the built-in study, with its figure")],
        &[("STUDY.h5", "Error, work and time of every method and tolerance.")],
    ),
    help(
        "case",
        &[
            ("case --list", "all built-in cases and studies"),
            ("case paper > mine.toml", "a case to change"),
        ],
        &[],
    ),
    help(
        "completions",
        &[("completions bash > completions.bash", "then: source completions.bash")],
        &[],
    ),
    help(
        "man",
        &[("man ~/.local/share/man/man1", "then: man stickslip-run")],
        &[],
    ),
];

const PROGRAM: &str = "stickslip";

const EXIT_STATUS: [(&str, &str); 4] = [
    ("0", "Success."),
    (
        "1",
        "The computation failed, or a check that was asked for was not met (--strict, --digits, --require).",
    ),
    ("2", "Wrong usage or wrong input."),
    (
        "130",
        "Interrupted by Ctrl-C or a termination signal; the message says which results were saved.",
    ),
];

fn of(command: &str) -> Option<&'static CommandHelp> {
    COMMANDS.iter().find(|help| help.command == command)
}

/// Examples of a command, and for the program itself the place of the manual, below the options in its help.
pub(super) fn examples(command: &str) -> StyledStr {
    let examples = of(command).map_or(&[][..], |help| help.examples);
    let length = |example: &Explained| example.0.len();
    let column = examples.iter().map(length).max().unwrap_or(0);
    // As clap writes its own headings.
    let mut text = "\u{1b}[1m\u{1b}[4mExamples:\u{1b}[0m".to_owned();
    for (line, meaning) in examples {
        text += &format!("\n  {PROGRAM} {line:column$}  {meaning}");
    }
    if command.is_empty() {
        text += "\n\nManual: docs/README.md of the source, share/doc/stickslip of an installation,\nman stickslip-run for each command";
    }
    text.into()
}

/// A page in roff: what clap_mangen makes of the options, with examples, exit status and files.
pub(super) fn page(man: &Man, command: &clap::Command, pages: &[clap::Command]) -> io::Result<Vec<u8>> {
    let mut text = Vec::new();
    man.render_title(&mut text)?;
    man.render_name_section(&mut text)?;
    let own = command.get_overridden_usage().is_none() && !command.has_subcommands();
    match own {
        true => synopsis(command).to_writer(&mut text)?,
        false => man.render_synopsis_section(&mut text)?,
    }
    man.render_description_section(&mut text)?;
    man.render_options_section(&mut text)?;
    let name = match command.has_subcommands() {
        true => {
            man.render_subcommands_section(&mut text)?;
            ""
        }
        false => command.get_name(),
    };
    further(name, pages).to_writer(&mut text)?;
    Ok(text)
}

/// The options of a command with their values, then its other arguments.
fn synopsis(command: &clap::Command) -> Roff {
    let name = command.get_bin_name().unwrap_or_else(|| command.get_name());
    let mut line = vec![bold(name)];
    let shown = |arg: &&Arg| !arg.is_hide_set();
    let (positional, options): (Vec<&Arg>, Vec<&Arg>) = command
        .get_arguments()
        .filter(shown)
        .partition(|arg| arg.is_positional());
    for option in options.into_iter().filter(|option| option.get_id() != "help") {
        let short = option.get_short().map(|short| format!("-{short}"));
        let long = option.get_long().map(|long| format!("--{long}"));
        let mut part: Vec<Inline> = Vec::new();
        for name in short.into_iter().chain(long) {
            part.extend((!part.is_empty()).then(|| roman("|")));
            part.push(bold(name));
        }
        let values = option.get_value_names().filter(|_| option.get_action().takes_values());
        part.extend(values.map(|names| italic(format!(" {}", names.join(" ")))));
        line.extend(optional(part, option.is_required_set()));
    }
    for argument in positional {
        let name = argument
            .get_value_names()
            .map_or_else(String::new, |names| names.join(" "));
        let several = argument.get_num_args().is_some_and(|range| range.max_values() > 1);
        let mut part = vec![italic(name)];
        part.extend(several.then(|| roman("...")));
        line.extend(optional(part, argument.is_required_set()));
    }
    let mut roff = Roff::new();
    roff.control("SH", ["SYNOPSIS"]).text(line);
    roff
}

fn optional(part: Vec<Inline>, required: bool) -> Vec<Inline> {
    let (open, close) = if required { (" ", "") } else { (" [", "]") };
    let inside = std::iter::once(roman(open)).chain(part);
    inside.chain([roman(close)]).collect()
}

/// Examples, exit status, files and other pages.
fn further(name: &str, pages: &[clap::Command]) -> Roff {
    let mut roff = Roff::new();
    let help = of(name);
    if let Some(help) = help {
        roff.control("SH", ["EXAMPLES"]);
        for (line, meaning) in help.examples {
            roff.control("TP", []);
            roff.text([bold(format!("{PROGRAM} {line}"))]);
            roff.text([roman(sentence(meaning))]);
        }
    }
    let mut list = |title: &str, entries: &[Explained]| {
        roff.control("SH", [title]);
        for (term, meaning) in entries {
            roff.control("TP", []);
            roff.text([bold(*term)]);
            roff.text([roman(*meaning)]);
        }
    };
    list("EXIT STATUS", &EXIT_STATUS);
    if let Some(help) = help.filter(|help| !help.files.is_empty()) {
        list("FILES", help.files);
    }
    let others = pages.iter().map(clap::Command::get_name).filter(|other| *other != name);
    let mut others: Vec<String> = others.map(|other| format!("{PROGRAM}-{other}(1)")).collect();
    if !name.is_empty() {
        others.insert(0, format!("{PROGRAM}(1)"));
    }
    roff.control("SH", ["SEE ALSO"]).text([roman(others.join(", "))]);
    roff
}

/// With a capital letter and a full stop.
fn sentence(text: &str) -> String {
    stickslip_analysis::analysis::advice::capitalised(text) + "."
}
