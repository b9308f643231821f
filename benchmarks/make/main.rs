//! Makes the numbers of the benchmark set: `cargo run --release --example benchmark_set`, in a checkout.
//!
//! Of each case in benchmarks/cases the independent solution with many digits is computed twice, with two lengths of its
//! numbers, and every figure that is written is one on which both agree. The files are the same on every machine, byte for
//! byte: nothing in them comes from a clock, from a name, or from arithmetic that differs between processors. With `--check`
//! nothing is written; it fails if a file differs from what would be. Names of problems make these alone, `--describe` none of them:
//! the descriptions and the page follow from the files that are there.
//!
//! | file | what it is |
//! |---|---|
//! | `answers` | events, states and summaries by the oracle |
//! | `statement` | `problem.json` |
//! | `tables` | `events.csv`, `samples.csv`, `summary.json` |
//! | `describe` | the set as a Data Package and as an RO-Crate; checksums |
//! | `page` | the set as a page |

mod answers;
mod describe;
mod page;
mod statement;
mod tables;

use answers::Answers;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use stickslip::compare::benchmark::{Problem, ProblemSet};

/// What can go wrong, with what was at work.
type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (options, names): (Vec<String>, Vec<String>) =
        arguments.into_iter().partition(|argument| argument.starts_with("--"));
    if let Some(unknown) = options
        .iter()
        .find(|option| !["--check", "--describe"].contains(&option.as_str()))
    {
        return Err(format!("{unknown}: there are --check and --describe, and the names of problems").into());
    }
    let [check, describe_alone] = ["--check", "--describe"].map(|name| options.iter().any(|option| option == name));
    let folder = Path::new("benchmarks");
    let set = ProblemSet::open(folder)?;
    let is_known = |name: &&String| set.problems.iter().any(|problem| problem.name == **name);
    if let Some(unknown) = names.iter().find(|name| !is_known(name)) {
        return Err(format!("{unknown}: no problem of the set; name one as its folder, or none for all").into());
    }
    let is_asked = |problem: &&Problem| !describe_alone && (names.is_empty() || names.contains(&problem.name));
    let (asked, others): (Vec<&Problem>, Vec<&Problem>) = set.problems.iter().partition(is_asked);
    let each: Vec<Vec<(PathBuf, String)>> = asked
        .par_iter()
        .map(|problem| of_problem(&set, problem).map_err(|error| format!("{}: {error}", problem.name).into()))
        .collect::<Outcome<_>>()?;
    let mut made: BTreeMap<PathBuf, String> = each.into_iter().flatten().collect();
    for problem in others {
        for name in FILES {
            let path = Path::new(&problem.name).join(name);
            let text = std::fs::read_to_string(folder.join(&path));
            let text = text.map_err(|error| format!("{}: {error}", path.display()))?;
            made.insert(path, text);
        }
    }
    made.insert(PathBuf::from("index.html"), page::of(&set, &made)?);
    made.extend(describe::of(&set, &made)?);
    let mut stale = Vec::new();
    for (name, text) in &made {
        let path = folder.join(name);
        let known = std::fs::read_to_string(&path).ok();
        if known.as_ref() == Some(text) {
            continue;
        }
        stale.push(name.display().to_string());
        if !check {
            std::fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))?;
        }
    }
    match (check, stale.is_empty()) {
        (_, true) => println!("{} files, all as they were", made.len()),
        (false, false) => println!("{} files, {} of them written", made.len(), stale.len()),
        (true, false) => {
            let what = stale.join(", ");
            return Err(format!("not as they would be made now: {what}; run benchmark_set without --check").into());
        }
    }
    Ok(())
}

/// The files of a problem that are made.
const FILES: [&str; 4] = ["problem.json", "events.csv", "samples.csv", "summary.json"];

/// The files of one problem.
fn of_problem(set: &ProblemSet, problem: &Problem) -> Outcome<Vec<(PathBuf, String)>> {
    let start = std::time::Instant::now();
    let answers = Answers::of(set, problem)?;
    let texts = [
        statement::of(set, problem, &answers)?,
        tables::events(problem, &answers),
        tables::samples(problem, &answers),
        tables::summary(problem, &answers),
    ];
    eprintln!(
        "{}: {} events, {:.1} s",
        problem.name,
        answers.events.len(),
        start.elapsed().as_secs_f64()
    );
    let named = FILES.into_iter().zip(texts);
    Ok(named
        .map(|(name, text)| (Path::new(&problem.name).join(name), text))
        .collect())
}
