//! Mistakes planted at random in a bare solver, and what `compare` says of each: nothing may be accused that is not there.
//!
//! Candidate n of a seed is the same in every run. `STICKSLIP_PLANTED=300` takes so many, `STICKSLIP_PLANTED_SEED=7` others,
//! `STICKSLIP_PLANTED_KIND=clock` those of one kind, and `STICKSLIP_PLANTED_ONLY=17` one alone, whose files it keeps in target/planted:
//!
//! ```sh
//! STICKSLIP_PLANTED=300 cargo test --release --test property no_correct_part -- --nocapture
//! ```
//!
//! Few are taken by default; CI takes 60.

mod corpus;
mod filing;
mod mistakes;
mod subject;
mod written;

use crate::common::planted_solver::{Solved, Solver};
use crate::common::random_brakes::Random;
use filing::Filing;
use mistakes::{Allowed, KINDS, Kind, Planted, RECORDED, of_other, plant};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};
use subject::{BUILT_IN, Subject, solve};
use written::{Written, csv, differs, differs_by_filing, event_table, resolved};

/// Candidates, unless the environment says how many.
const CANDIDATES: u64 = 8;

/// A difference has to be so many times what the solver without the mistake errs by, and what the digits resolve.
const ABOVE: f64 = 30.0;

/// And so much of a channel, or of a period.
const LEAST: f64 = 1e-5;

/// Of the mistakes above resolution that have a name, so many in a hundred have to be named.
const NAMED: usize = 85;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Said {
    Right,
    Silent,
    False,
}

/// A path without the index of a list of one.
fn plain(path: &str) -> &str {
    path.strip_suffix(".0").unwrap_or(path)
}

/// The number that follows these words.
fn number_after(text: &str, words: &str) -> Option<f64> {
    let (_, rest) = text.split_once(words)?;
    rest.split([' ', ',', ';']).next()?.parse().ok()
}

/// Whether what was said is what is planted.
fn judge(kind: Kind, allowed: &Allowed, said: &serde_json::Value) -> (Said, String) {
    let causes = said["causes"].as_array().cloned().unwrap_or_default();
    let words = causes.iter().map(|cause| {
        let text = |key: &str| cause[key].as_str().unwrap_or_default().to_owned();
        (text("cause"), text("evidence"))
    });
    let words: Vec<(String, String)> = words.collect();
    let sentence = words
        .iter()
        .map(|(cause, evidence)| format!("{cause}: {evidence}"))
        .collect::<Vec<_>>()
        .join(" | ");
    if words.is_empty() {
        let verdict = said["verdict"].as_str().unwrap_or_default();
        let unexplained = verdict.split_once("no single cause").map_or("", |(_, text)| text);
        let sentence = format!("nothing{unexplained}");
        let holds = said["unexplained"]["follows"]["holds"].as_bool();
        let is_false = holds
            .zip(kind.follows())
            .is_some_and(|(holds, follows)| holds != follows);
        return (if is_false { Said::False } else { Said::Silent }, sentence);
    }
    let number_of = |list: &serde_json::Value| -> Vec<(String, f64, f64)> {
        let list = list.as_array().cloned().unwrap_or_default();
        let of = |number: &serde_json::Value| {
            let value = |key: &str| number[key].as_f64();
            Some((
                number["path"].as_str()?.to_owned(),
                value("value")?,
                value("error").unwrap_or(0.0),
            ))
        };
        list.iter().filter_map(of).collect()
    };
    let hits = |(path, value, error): &(String, f64, f64)| {
        allowed.numbers.iter().any(|(wanted, planted, reference)| {
            let size = if *planted == 0.0 { reference } else { planted };
            let change = (planted - reference).abs();
            let near = error.min(0.1 * change).max((0.02 * size.abs()).min(0.2 * change));
            plain(path) == plain(wanted) && (value - planted).abs() <= near
        })
    };
    let named = number_of(&said["parameters"]["numbers"]);
    let or = number_of(&said["parameters"]["or"]);
    let number_is_right = match allowed.together {
        true => !named.is_empty() && named.iter().all(hits),
        // With the speed of a drive, the speeds at t = 0 that are the same.
        false => {
            let follows = |(path, value, _): &(String, f64, f64)| {
                let of_start = path.starts_with("initial.") && *value == named[0].1;
                // All coefficients by one factor are the same as a radius or a normal force, which then stands beside them.
                of_start || path.starts_with("friction.")
            };
            named.iter().skip(1).all(follows) && named.iter().take(1).chain(&or).any(hits)
        }
    };
    let clock_is_right = allowed.clock.is_none_or(|clock| {
        let to_add = said["found_time_offset"]["seconds"].as_f64();
        let found = said["clock"]["offset"].as_f64().or(to_add.map(|seconds| -seconds));
        found.is_some_and(|found| (found - clock).abs() <= 0.02 * clock.abs())
    });
    let right = |(cause, evidence): &(String, String)| {
        let by_name = allowed.causes.iter().any(|allowed| cause.contains(allowed));
        let by_words = allowed.words.iter().all(|word| evidence.contains(word));
        let by_value = allowed.value.is_none_or(|(before, value, off)| {
            number_after(evidence, before).is_some_and(|found| (found - value).abs() <= off)
        });
        let is_same = allowed
            .same
            .iter()
            .any(|(name, words)| cause == name && evidence.contains(words));
        // Of two that cannot be told apart both are named.
        let is_other = evidence
            .split_once("as much is explained by ")
            .is_some_and(|(_, other)| {
                let mut named = allowed.causes.iter();
                named.any(|cause| other.contains(&cause.replace('-', " ")))
            });
        by_name && by_words && by_value && clock_is_right
            || is_same
            || is_other
            || cause == "another-parameter" && number_is_right
    };
    let paths_are = |beside: &str| !named.is_empty() && named.iter().all(|(path, ..)| path.contains(beside));
    let beside = |(cause, _): &(String, String)| {
        let of = |beside: &&str| cause == beside || cause == "another-parameter" && paths_are(beside);
        allowed.beside.iter().any(of)
    };
    match words.iter().any(right) && words.iter().all(|said| right(said) || beside(said)) {
        true => (Said::Right, sentence),
        false => (Said::False, sentence),
    }
}

/// What was said of the candidates of a kind.
#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    right: usize,
    silent: usize,
    wrong: usize,
    /// Below resolution, of which nothing need be said.
    below: usize,
}

impl Tally {
    fn row(&self, name: &str) -> String {
        let Tally {
            right,
            silent,
            wrong,
            below,
        } = self;
        format!("{name:14} {right:6} {silent:7} {wrong:6} {below:17}")
    }

    fn plus(self, other: &Tally) -> Tally {
        Tally {
            right: self.right + other.right,
            silent: self.silent + other.silent,
            wrong: self.wrong + other.wrong,
            below: self.below + other.below,
        }
    }
}

fn environment(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

/// A candidate in its files, and what is said of it.
struct Judged {
    said: Said,
    above: bool,
    has_a_name: bool,
    /// In words.
    line: String,
    /// To see it again.
    command: String,
    took: Duration,
}

/// Candidate `index` of a kind, in the first of some systems that have a place for it. A system that is drawn serves several
/// candidates, since its run takes longer than they do.
fn judged(
    systems: &mut BTreeMap<u64, Subject>,
    folder: &Path,
    (seed, index, kind): (u64, u64, Kind),
) -> Option<Judged> {
    let mut random = Random(seed.wrapping_mul(1_000_003) ^ index.wrapping_mul(0x9e37_79b9));
    let (place, planted, solved, above) = (0..40).find_map(|turn| {
        let place = match random.next() < 0.5 {
            true => (random.next() * BUILT_IN.len() as f64) as u64,
            false => 100 + index / 8 + turn / 10,
        };
        let system = systems.entry(place).or_insert_with(|| match place {
            0..100 => Subject::built_in(BUILT_IN[place as usize], folder),
            _ => Subject::drawn(place - 100, seed, folder),
        });
        let (planted, solved, above) = candidate(system, kind, &mut random)?;
        Some((place, planted, solved, above))
    })?;
    let (system, file) = (&systems[&place], &planted.file);
    let series = folder.join(format!("planted-{index}.csv"));
    let events = folder.join(format!("planted-{index}.events.csv"));
    std::fs::write(&series, csv(system, &planted.solver, &solved, file)).unwrap();
    std::fs::write(&events, event_table(&solved, file)).unwrap();
    let mut mapping = system.reference.mapping();
    let mut command = format!("stickslip compare {} ", system.file.display());
    command += &match (file.alone, file.events) {
        (true, _) => format!("{}", events.display()),
        (false, true) => format!("{} --events {}", series.display(), events.display()),
        (false, false) => format!("{}", series.display()),
    };
    let path = if file.alone { &events } else { &series };
    mapping.event_file = Some(events.clone()).filter(|_| file.events && !file.alone);
    mapping.velocity_tolerance = file.tolerance;
    if let Some(tolerance) = file.tolerance {
        command += &format!(" --velocity-tolerance {tolerance:e}");
    }
    let begun = Instant::now();
    let (said, sentence) = match system.reference.compare(path, &mapping) {
        Ok(comparison) => judge(kind, &planted.allowed, &serde_json::to_value(comparison).unwrap()),
        Err(error) => (Said::Silent, format!("refused: {error}")),
    };
    let took = begun.elapsed();
    let mut shown = match (file.alone, file.events) {
        (true, _) => ", events alone",
        (false, true) => ", events",
        (false, false) => "",
    }
    .to_owned();
    if let Some(tolerance) = file.tolerance {
        shown += &format!(", |omega_r| <= {tolerance:.1e} counts as a stick");
    }
    let line = format!(
        "{index:4} {said:?}{} {kind:?} in {}: {} [{} rows, {:?}, {:?}{shown}] {:.1} s\n       said: {sentence}",
        if above { "" } else { " (below resolution)" },
        system.name,
        planted.what,
        solved.rows.len(),
        file.digits,
        file.columns,
        took.as_secs_f64()
    );
    Some(Judged {
        said,
        above,
        has_a_name: kind.has_a_name(&planted.allowed),
        line,
        command,
        took,
    })
}

#[test]
fn property_no_correct_part_of_a_solver_is_accused() {
    of_kinds(&KINDS, 1);
}

/// The same of what is recorded of a motion, and of its events.
#[test]
fn property_no_correct_part_of_a_recording_is_accused() {
    of_kinds(&RECORDED, 3);
}

/// `fewer`: by how many times fewer candidates than asked for are drawn, since there are fewer kinds.
fn of_kinds(kinds: &[Kind], fewer: u64) {
    let seed = environment("STICKSLIP_PLANTED_SEED").unwrap_or(28);
    let count = environment("STICKSLIP_PLANTED").map_or(CANDIDATES, |count| count.div_ceil(fewer));
    let only = environment("STICKSLIP_PLANTED_ONLY");
    let wanted = std::env::var("STICKSLIP_PLANTED_KIND").ok();
    let is_wanted = |kind: Kind| {
        let name = format!("{kind:?}");
        wanted.as_ref().is_none_or(|wanted| name.eq_ignore_ascii_case(wanted))
    };
    let temporary = tempfile::tempdir().unwrap();
    let folder = match only {
        Some(_) => Path::new(env!("CARGO_MANIFEST_DIR")).join("target/planted"),
        None => temporary.path().to_owned(),
    };
    std::fs::create_dir_all(&folder).unwrap();
    let mut systems = BTreeMap::new();
    let mut tallies: BTreeMap<Kind, Tally> = BTreeMap::new();
    let mut wrong = Vec::new();
    let mut took = Vec::new();
    // Of those above resolution that have a name: how many are named, of how many.
    let (mut named, mut of) = (0, 0);
    for index in only.map_or(0..count, |only| only..only + 1) {
        let kind = kinds[(index % kinds.len() as u64) as usize];
        if !is_wanted(kind) {
            continue;
        }
        let Some(judged) = judged(&mut systems, &folder, (seed, index, kind)) else {
            println!("{index:4} {kind:?}: no place");
            continue;
        };
        println!("{}", judged.line);
        if only.is_some() {
            println!("       {}", judged.command);
        }
        took.push((judged.took, index));
        let tally = tallies.entry(kind).or_default();
        if judged.has_a_name && (judged.above || judged.said != Said::Silent) {
            of += 1;
            named += usize::from(judged.said == Said::Right);
        }
        match judged.said {
            Said::Right => tally.right += 1,
            Said::Silent if judged.above || !judged.has_a_name => tally.silent += 1,
            Said::Silent => tally.below += 1,
            Said::False => {
                tally.wrong += 1;
                wrong.push(judged.line);
            }
        }
    }
    println!("\nkind            right  silent  FALSE  below resolution");
    for (kind, tally) in &tallies {
        println!("{}", tally.row(&format!("{kind:?}")));
    }
    let sum = |tallies: &mut dyn Iterator<Item = &Tally>| tallies.fold(Tally::default(), Tally::plus);
    println!("{}", sum(&mut tallies.values()).row("all"));
    println!("named, of those above resolution that have a name: {named} of {of}");
    let all: Duration = took.iter().map(|(took, _)| *took).sum();
    if let Some((longest, index)) = took.iter().max() {
        let [all, longest] = [all, *longest].map(|took| took.as_secs_f64());
        println!("compare took {all:.1} s, at most {longest:.1} s, for {index}");
    }
    assert_eq!(wrong.len(), 0, "of {} candidates:\n{}", took.len(), wrong.join("\n"));
    // Of one alone there is no share.
    let enough = 100 * named >= NAMED * of || only.is_some();
    assert!(enough, "{named} of {of} are named");
}

/// A mistake that shows in its file, if one of some does; else the last, which is below resolution.
fn candidate(system: &Subject, kind: Kind, random: &mut Random) -> Option<(Planted, Solved, bool)> {
    let mut last = None;
    for _ in 0..6 {
        let Some(planted) = plant(system, kind, random) else {
            continue;
        };
        let at_rest = |solved: &Solved| solved.events.len() < 2.min(system.word.len());
        let of = |solver: &Solver| solve(system, solver, planted.start, &planted.file);
        let Some(solved) = of(&planted.solver) else { continue };
        if at_rest(&solved) && planted.solver.smooth.is_none() {
            // What does not move, or not stop, has nothing to tell one number from another by.
            continue;
        }
        // Without the mistake, but as accurate; and as accurate as can be.
        let sound = Solver::sound(&system.case.system);
        let Some(exact) = of(&sound) else { continue };
        let noise = match kind {
            Kind::Number | Kind::Initial | Kind::Kick if planted.solver.step != sound.step => {
                let Some(own) = of(&of_other(&planted.solver, system.case.system.clone())) else {
                    continue;
                };
                differs(system, &sound, &planted.file, &own, &exact)
            }
            _ => 0.0,
        };
        let digits = resolved(system, &sound, &planted.file, &exact);
        let difference = differs(system, &planted.solver, &planted.file, &solved, &exact);
        let of_events = || {
            let off = exact.events.iter().zip(&solved.events).map(|(a, b)| (a.0 - b.0).abs());
            exact.events.len() != solved.events.len() || off.fold(0.0, f64::max) > LEAST * sound.period()
        };
        let by_filing = differs_by_filing(system, &sound, &planted.file, &solved);
        let difference = difference.max(by_filing);
        let shows = difference > (ABOVE * noise.max(digits)).max(LEAST) && (!planted.file.alone || of_events());
        let above = matches!(kind, Kind::Clock | Kind::Unit) || shows;
        last = Some((planted, solved, above));
        if above || matches!(kind, Kind::Nothing | Kind::Decimals) {
            break;
        }
    }
    last
}

/// A kicked brake by another clock is not said to be without a kick.
#[test]
fn property_another_clock_of_a_kicked_brake_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let system = Subject::built_in("paper", folder.path());
    let solver = Solver::sound(&system.case.system);
    for (clock, rate, name) in [
        (3e-3, 1.0, "times offset"),
        (7e-3, 1.0, "times offset"),
        (0.0, 1.0005, "clock rate"),
        (0.0, 1.0012, "clock rate"),
    ] {
        let file = Written {
            clock,
            filing: Some(Filing::Rate(rate)),
            ..Written::sound(solver.period() / 100.0)
        };
        let solved = solve(&system, &solver, Some(system.after_kick().1), &file).unwrap();
        let path = folder.path().join("clocked.csv");
        std::fs::write(&path, csv(&system, &solver, &solved, &file)).unwrap();
        let comparison = system.reference.compare(&path, &system.reference.mapping()).unwrap();
        let causes: Vec<&str> = comparison.causes.iter().map(|one| one.cause.name()).collect();
        assert_eq!(causes.first(), Some(&name), "{clock} s, {rate}: {}", comparison.verdict);
        assert!(
            !causes.contains(&"unperturbed run"),
            "{clock} s, {rate}: {}",
            comparison.verdict
        );
    }
}

/// The bare solver and the program know nothing of each other but the numbers of a case.
#[test]
fn property_a_bare_solver_has_the_events_of_every_case() {
    let folder = tempfile::tempdir().unwrap();
    let built_in = BUILT_IN.iter().map(|name| Subject::built_in(name, folder.path()));
    let drawn = (0..12).map(|number| Subject::drawn(number, 1, folder.path()));
    for subject in built_in.chain(drawn) {
        let solver = Solver::sound(&subject.case.system);
        let file = Written::sound(solver.period());
        let start = subject.coasts().then(|| subject.after_kick().1);
        let solved = solve(&subject, &solver, start, &file).unwrap();
        let last = solved.rows.last().unwrap().0;
        let word: Vec<_> = subject.word.iter().filter(|(time, _)| *time < last).collect();
        assert_eq!(solved.events.len(), word.len(), "{}", subject.name);
        let mut worst: f64 = 0.0;
        for ((time, kind), (exact, name)) in solved.events.iter().zip(word) {
            assert_eq!(kind, name, "{}", subject.name);
            worst = worst.max((time - exact).abs() / solver.period());
        }
        println!(
            "{}: {} events within {worst:.1e} of a period",
            subject.name,
            solved.events.len()
        );
        // Of a step the method errs by 1e-13 of a period, of which an instability makes more.
        assert!(worst < 1e-7, "{}: {worst:e}", subject.name);
    }
}
