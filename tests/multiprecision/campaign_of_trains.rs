//! Random trains, friction laws and drives: certificates and methods against the oracle.
//!
//! `STICKSLIP_TRAINS_FIRST=0 STICKSLIP_TRAINS_COUNT=100 cargo test --release --test multiprecision campaign_of_trains -- --ignored
//! --nocapture` takes other systems than the default's.

use crate::common::cases::{kinds, run, source};
use crate::common::random_brakes::Random;
use std::fmt::Write as _;
use std::time::Duration;
use stickslip::analysis::Certify;
use stickslip::analysis::certificate::Verdict;
use stickslip::case::{Case, CaseSource};
use stickslip::record::{Channels, MemoryRecorder, Sample, State};
use stickslip::simulation::{Method, RunReport, SolverOptions};

fn below(random: &mut Random, count: usize) -> usize {
    (random.next() * count as f64) as usize
}

/// A number with few digits, log-uniform between two limits.
fn spread(random: &mut Random, from: f64, to: f64) -> String {
    let value = from * (to / from).powf(random.next());
    format!("{value:.2e}")
}

fn list(random: &mut Random, count: usize, from: f64, to: f64) -> String {
    let values: Vec<String> = (0..count).map(|_| spread(random, from, to)).collect();
    format!("[{}]", values.join(", "))
}

/// A signal about `mean`: constant, a ramp, a table, a sine or a sum.
fn signal(random: &mut Random, mean: f64, end: f64) -> String {
    let amplitude = 0.5 * mean * random.next();
    let wave = |random: &mut Random, mean: f64| {
        format!(
            "{{ profile = \"{}\", mean = {mean:.3}, amplitude = {amplitude:.3}, angular_frequency = {}, phase = {:.2} }}",
            if below(random, 2) == 0 { "sine" } else { "cosine" },
            spread(random, 0.3, 3.0),
            random.next() * 6.0
        )
    };
    match below(random, 6) {
        0 => format!(
            "{{ profile = \"ramp\", value = {mean:.3}, rise_time = {:.2} }}",
            0.2 * end
        ),
        1 => {
            let values: Vec<String> = (0..4).map(|_| format!("{:.3}", mean * (0.5 + random.next()))).collect();
            let times = [0.1, 0.3, 0.6, 0.8]
                .map(|share| format!("{:.2}", share * end))
                .join(", ");
            format!(
                "{{ profile = \"table\", time = [{times}], value = [{}] }}",
                values.join(", ")
            )
        }
        2 => wave(random, mean),
        3 => {
            let other = wave(random, 0.0);
            format!("{{ profile = \"sum\", signals = [{}, {other}] }}", wave(random, mean))
        }
        _ => format!("{mean:.3}"),
    }
}

/// A friction law with its parameters, and the largest coefficient at rest.
fn friction(random: &mut Random) -> String {
    let high = 0.2 + 0.3 * random.next();
    let low = high + 0.3 * random.next();
    let breakaway = low + if below(random, 2) == 0 { 0.0 } else { 0.2 };
    let scale = spread(random, 0.1, 1.0);
    let law = match below(random, 6) {
        0 => format!("law = \"coulomb\"\nkinetic = {low:.3}\n"),
        1 => format!("law = \"hyperbolic\"\nlow_speed = {low:.3}\nhigh_speed = {high:.3}\nscale = {scale}\n"),
        2 => format!(
            "law = \"stribeck\"\nlow_speed = {low:.3}\nhigh_speed = {high:.3}\nscale = {scale}\nexponent = {}\nviscous = 0.01\n",
            1 + below(random, 2)
        ),
        3 => format!(
            "law = \"table\"\nspeed = [0, 0.3, 1.1, 4]\ncoefficient = [{low:.3}, {:.3}, {high:.3}, {:.3}]\n",
            (low + high) / 2.0,
            high + 0.05
        ),
        _ => format!(
            "low_speed = {low:.3}\nhigh_speed = {high:.3}\ndecay = {}\n",
            spread(random, 0.5, 5.0)
        ),
    };
    format!("breakaway = {breakaway:.3}\n{law}")
}

fn system(index: u64) -> String {
    let random = &mut Random(0x7a11_0000 + 1009 * index);
    let end = 40.0;
    let mut text = format!("title = \"random trains {index}\"\n");
    let rigid = below(random, 4);
    for (side, name) in ["rotor", "stator"].into_iter().enumerate() {
        let _ = writeln!(text, "[{name}]");
        let inertias = if rigid == side { 0 } else { 1 + below(random, 3) };
        // The rotor is driven or turned, the stator is held.
        let ends: &[&str] = match (side, inertias) {
            (0, 0) => &["driven"],
            (1, 0) => &["fixed", "driven"],
            (0, _) => &["driven", "free"],
            _ => &["fixed", "free"],
        };
        let end_kind = ends[below(random, ends.len())];
        let shafts = inertias - usize::from(end_kind == "free" && inertias > 0);
        let _ = writeln!(text, "end = \"{end_kind}\"");
        if inertias > 0 {
            let _ = writeln!(text, "inertia = {}", list(random, inertias, 0.3, 3.0));
            let _ = writeln!(text, "viscous = {}", list(random, inertias, 0.005, 0.2));
        }
        if shafts > 0 {
            let _ = writeln!(text, "stiffness = {}", list(random, shafts, 0.5, 20.0));
            let _ = writeln!(text, "damping = {}", list(random, shafts, 0.005, 0.2));
        }
        if end_kind == "driven" {
            let mean = if side == 0 { 0.1 + random.next() } else { 0.05 };
            let _ = writeln!(text, "speed = {}", signal(random, mean, end));
        }
        if inertias > 0 && (end_kind == "free" || below(random, 4) == 0) {
            let torque = if side == 0 { 0.6 } else { 0.2 };
            let _ = writeln!(text, "torque = {}", signal(random, torque, end));
        }
    }
    let force = 1.0 + random.next();
    let _ = write!(
        text,
        "[contact]\nradius = 1.0\nnormal_force = {}\n[friction]\n{}",
        signal(random, force, end),
        friction(random)
    );
    if below(random, 4) == 0 {
        // A surface without inertia takes no kick of its own.
        let on = match rigid {
            0 => ["both", "stator"][below(random, 2)],
            1 => ["both", "rotor"][below(random, 2)],
            _ => ["both", "rotor", "stator"][below(random, 3)],
        };
        let _ = write!(
            text,
            "[[perturbation]]\ntime = {:.2}\nrelative_velocity = 0.2\non = \"{on}\"\n",
            0.4 * end
        );
    }
    let _ = write!(
        text,
        "[output]\nend_time = {end}\ninterval = 1.0\n[solver]\nmax_events = 5000\n"
    );
    text
}

fn systems() -> impl Iterator<Item = (u64, CaseSource)> {
    let number = |name: &str, default: u64| {
        let text = std::env::var(name).ok();
        text.and_then(|text| text.parse().ok()).unwrap_or(default)
    };
    let first = number("STICKSLIP_TRAINS_FIRST", 0);
    let indices = first..first + number("STICKSLIP_TRAINS_COUNT", 40);
    indices.map(|index| (index, source(&system(index))))
}

/// Bounds of each method, s, where the uncertainty of the double-precision data itself is below them.
const METHODS: [(Method, f64, f64); 3] = [
    (Method::Cvode, 1e-10, 1e-9),
    (Method::Arkode, 1e-13, 1e-11),
    (Method::Series, 1e-10, 1e-12),
];

/// Methods whose samples are compared with those of the series. Bounds of their events (s) and of every channel: as a
/// share of its largest value, for energies as a share of the energy turnover.
const SAMPLED: [(Method, f64, f64); 5] = [
    (Method::Arkode, 1e-9, 1e-7),
    (Method::Erk, 1e-9, 1e-7),
    (Method::Esdirk, 1e-8, 1e-6),
    (Method::Cvode, 1e-9, 1e-7),
    (Method::CvodeAdams, 1e-7, 1e-5),
];

fn by(case: &Case, method: Method, rtol: f64) -> Result<(MemoryRecorder, RunReport), String> {
    let mut recorder = MemoryRecorder::default();
    let solver = SolverOptions {
        method,
        rtol,
        ..case.solver.clone()
    };
    let report = run(case, &solver, &mut recorder).map_err(|failure| failure.to_string())?;
    Ok((recorder, report))
}

/// The largest difference of any channel at the same samples, and the channel.
fn farthest(exact: &[Sample], found: &[Sample], turnover: f64) -> (&'static str, f64) {
    let names = State::DESCRIPTIONS
        .iter()
        .chain(Channels::DESCRIPTIONS)
        .map(|(name, ..)| *name);
    let row = |sample: &Sample| -> Vec<f64> {
        let values = sample.state.values().into_iter().chain(sample.channels.values());
        values.collect()
    };
    let mut worst = ("", 0.0);
    for (k, name) in names.enumerate() {
        if name == "energy_residual" {
            continue;
        }
        let energy = ["energy", "work", "dissipated"]
            .iter()
            .any(|start| name.starts_with(start));
        let largest = exact.iter().map(|sample| row(sample)[k].abs()).fold(0.0, f64::max);
        let size = if energy { turnover } else { largest };
        let apart = exact.iter().zip(found).map(|(a, b)| (row(a)[k] - row(b)[k]).abs());
        let apart = apart.fold(0.0, f64::max);
        if size > 0.0 && apart / size > worst.1 {
            worst = (name, apart / size);
        }
    }
    worst
}

/// Every channel of the samples, including works and energies, by every kind of method.
#[test]
#[ignore = "minutes; CI runs it"]
fn property_channels_of_random_trains_agree() {
    let mut failures = Vec::new();
    let mut worst = [(0.0f64, 0.0f64); SAMPLED.len()];
    for (index, source) in systems() {
        let Ok(mut case) = Case::read(&source, &[]) else {
            failures.push(format!("{index}: no case"));
            continue;
        };
        case.output.follow.around = None;
        // A case that fails by the series fails by every method: it chatters, or reaches the end of a law.
        let Ok((exact, turned)) = by(&case, Method::Series, case.solver.rtol) else {
            continue;
        };
        for (k, (method, of_events, of_channels)) in SAMPLED.into_iter().enumerate() {
            let name = method.name();
            let (found, report) = match by(&case, method, case.solver.rtol) {
                Ok(run) if kinds(&run.0.events) == kinds(&exact.events) => run,
                other => {
                    let why = other.err().unwrap_or_else(|| "another sequence".to_owned());
                    failures.push(format!("{index} by {name}: {why}"));
                    continue;
                }
            };
            let times = found.events.iter().zip(&exact.events);
            let events = times.map(|(a, b)| (a.time - b.time).abs()).fold(0.0, f64::max);
            let (channel, apart) = farthest(&exact.samples, &found.samples, turned.energy_turnover);
            let apart = apart.max(report.energy_residual / turned.energy_turnover.max(f64::MIN_POSITIVE));
            worst[k] = (worst[k].0.max(events), worst[k].1.max(apart));
            if events > of_events || apart > of_channels {
                failures.push(format!(
                    "{index} by {name}: events {events:e} s, {channel} or energies {apart:e}"
                ));
            }
        }
    }
    for ((method, ..), (events, channels)) in SAMPLED.into_iter().zip(worst) {
        println!(
            "{}: events {events:.1e} s, channels {channels:.1e} at worst",
            method.name()
        );
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
#[ignore = "minutes; CI runs it"]
fn multiprecision_random_trains() {
    let mut failures = Vec::new();
    let mut total = 0usize;
    let mut worst = [0.0f64; 3];
    let (mut by_ladder, mut short) = (0usize, 0usize);
    for (index, source) in systems() {
        let case = match Case::read(&source, &[]) {
            Ok(case) => case,
            Err(error) => {
                failures.push(format!("{index}: {error}\n{}", source.text));
                continue;
            }
        };
        let exact = Case::exact(&source, &[]).unwrap();
        for (k, (method, rtol, bound)) in METHODS.into_iter().enumerate() {
            let label = format!("{index} by {} at {rtol:e}", method.name());
            let recorder = match by(&case, method, rtol) {
                Ok((recorder, _)) => recorder,
                Err(error) => {
                    failures.push(format!("{label}: {error}"));
                    continue;
                }
            };
            let mut case = case.clone();
            (case.solver.method, case.solver.rtol) = (method, rtol);
            let certify = Certify::new(&case).oracle_within(&exact, 18, Duration::from_secs(60));
            let certified = certify.start(&MemoryRecorder {
                events: recorder.events.clone(),
                ..MemoryRecorder::default()
            });
            let certified = certified.unwrap();
            let certificate = &certified.certificate;
            if let Some(why) = &certificate.without_oracle {
                println!("{index}: no oracle: {why}");
                break;
            }
            if k == 0 {
                total += certificate.events.len();
            }
            if certificate.verdict != Verdict::Converged {
                let at = certificate
                    .events
                    .iter()
                    .position(|event| event.verdict != Verdict::Converged);
                if k == 0 {
                    println!("{}", source.text);
                    let first = at.unwrap_or(0).saturating_sub(1);
                    for event in recorder.events.iter().skip(first).take(4) {
                        println!("own   {:.15} {:?} {:?}", event.time, event.kind, event.mode_after);
                    }
                    let exact = certified.exact.iter().flat_map(|exact| &exact.report.events);
                    for event in exact.skip(first).take(4) {
                        let time = event.time.to_f64();
                        println!("exact {time:.15} {:?} {:?}", event.kind, event.mode_after);
                    }
                }
                let count = certificate.events.len();
                failures.push(format!("{label}: another sequence from event {at:?} of {count} on"));
                continue;
            }
            let errors = certificate.events.iter().filter_map(|event| event.true_error);
            let largest = errors.map(f64::abs).fold(0.0, f64::max);
            worst[k] = worst[k].max(largest);
            if largest > bound {
                failures.push(format!("{label}: {largest:e} s"));
            }
            // The ladder's own uncertainty, without the oracle.
            for event in &certificate.events {
                if let (Verdict::Converged, Some(error)) = (event.ladder_verdict, event.true_error) {
                    by_ladder += 1;
                    short += usize::from(error.abs() > event.ladder_uncertainty);
                }
            }
        }
    }
    println!(
        "{total} events; cvode {:e}, arkode at 1e-13 {:e}, series {:e} s at worst; by the ladder alone {short} of {by_ladder} short",
        worst[0], worst[1], worst[2]
    );
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
