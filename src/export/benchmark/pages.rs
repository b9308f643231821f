//! Pages of a package, and its script.

use super::About;
use super::describe::Resource;
use stickslip_system::friction::FrictionLaw;
use stickslip_system::model::system::System;
use stickslip_system::model::{BreakawayTest, Parameters};
use stickslip_system::quote::bound;
use stickslip_system::signal::Signal;

pub(super) const EXAMPLE: &str = include_str!("example.py");

/// The manual's page on the model. A package quotes the sections that it needs.
const MODEL: &str = include_str!("../../../docs/theory.md");

/// Whether the script can solve this system: two equal disks, exponential law, ramp, default test.
pub(super) fn has_example(system: &System) -> bool {
    Parameters::of(system).is_some_and(|disks| {
        matches!(disks.friction.law, FrictionLaw::Exponential(_))
            && matches!(disks.actuation, Signal::Ramp(_))
            && disks.contact.breakaway_test == BreakawayTest::Transmitted
            && disks.initial.speed > 0.0
    })
}

fn section(page: &str, heading: &str) -> String {
    let level = heading.split(' ').next().unwrap_or_default();
    let mut lines = page.lines().skip_while(|line| *line != heading);
    let mut text: Vec<&str> = lines.by_ref().take(1).collect();
    let ends = |line: &&str| {
        let marks = line.len() - line.trim_start_matches('#').len();
        marks > 0 && marks <= level.len()
    };
    text.extend(lines.take_while(|line| !ends(line)));
    without_links(text.join("\n").trim_end())
}

/// Replaces `[text](target)` by `text`, because the package does not contain the targets.
fn without_links(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(open) = rest.find('[') {
        let (before, link) = rest.split_at(open);
        plain.push_str(before);
        let parts = link[1..].split_once("](").and_then(|(text, after)| {
            let (_, after) = after.split_once(')')?;
            (!text.contains(['[', ']', '\n'])).then_some((text, after))
        });
        match parts {
            Some((text, after)) => {
                plain.push_str(text);
                rest = after;
            }
            None => {
                plain.push('[');
                rest = &link[1..];
            }
        }
    }
    plain + rest
}

const TRANSITIONS: &str = "## Events

A mode lasts until one of these happens, and the equations are integrated anew from there. The kinds are those of events.csv.

| kind | what happens |
|---|---|
| stick | slip ends, and the interface can carry T_f. Both surfaces take the mean of their speeds, by momentum, so that omega_r is exactly 0 |
| reversal | slip ends, and it cannot: slip goes on in the direction of T_f |
| slip | stick ends as |T_f| reaches mu_0 r F_n; slip begins in the direction of T_f, with omega_r = 0 |
| separation, contact | F_n falls to 0, and rises again: slip goes on in the direction of omega_r, or sticks where that is 0 |
| kick | a perturbation: omega_r jumps by a stated amount, which the surfaces share by momentum (half each where they are equal) |
| corner | a derivative of what is applied jumps |
| destabilised, restabilised | steady sliding loses its stability, or has it again; information only, nothing changes |

`mode_after` is the mode from the event on: `slip-forward` with omega_r > 0, `slip-backward` with omega_r < 0, `stick`,
`separated`, or `engaged` for contacts without stick. `sense` is the direction of slip. States have the suffixes `_before` and
`_after`. What jumps at an event jumps there alone: no polynomial and no difference should be taken across one.

Integrate the twists, not the angles: u = theta - phi_2 (`rotor_twist`) and v = phi_1, with omega_r = theta' - u' - v'. theta grows to
hundreds of radians while u stays near 1e-5 rad, so that differences of absolute angles lose eight digits of every torque.";

pub(super) fn equations(about: &About) -> String {
    let mut parts = vec!["# Equations\n\nSI units and radians throughout.".to_owned()];
    if about.numbers_parts {
        parts.push(section(MODEL, "## Trains").replace(" (keys)", ""));
        parts.push(
            "This benchmark is of two trains; parameters.json has their inertias, shafts and ends, and the law of friction. Where it has \
             `axial` numbers, F_n = max(0, -c_a z' - k_e z) with m z'' + c_a z' + k_e z = -F(t).".to_owned(),
        );
    } else {
        parts.push(section(MODEL, "## The brake"));
    }
    parts.push(section(MODEL, "## Friction laws"));
    parts.push(TRANSITIONS.replace("|T_f|", "\\|T_f\\|"));
    if !about.references.is_empty() {
        parts.push(format!("## Reference\n\n{}", about.references));
    }
    parts.join("\n\n") + "\n"
}

pub(super) fn readme(about: &About, resources: &[Resource]) -> String {
    let rows: String = resources
        .iter()
        .map(|resource| format!("| [{0}]({0}) | {1} |\n", resource.path, resource.title()))
        .collect();
    let uncertain = match about.events - about.certain {
        0 => String::new(),
        count => format!(
            " {count} events are not certain (time_uncertainty is NaN, and verdict says why): compare nothing with them."
        ),
    };
    let example = if about.example {
        "\n`python example.py` does so for SciPy's `solve_ivp`, and is a start for your own.\n"
    } else {
        ""
    };
    let author = about.terms.author.as_deref().unwrap_or("(author)");
    let year = about.made.get(..4).unwrap_or_default();
    let license = match &about.terms.license {
        Some(id) => format!("Licence: {id} (https://spdx.org/licenses/{id})."),
        None => "No licence is stated; ask whoever published this package before you pass it on.".to_owned(),
    };
    let references = if about.references.is_empty() {
        String::new()
    } else {
        format!(
            " The equations are those of {}.",
            about.references.trim_end_matches('.')
        )
    };
    let by = match about.certified_by.as_str() {
        "oracle" => "a solution of the same equations in multiprecision arithmetic",
        _ => "independent methods at several tolerances, and what rounding can do",
    };
    format!(
        "# {title}

A benchmark for solvers of motions with dry friction: a reference run whose {events} events are certified. The times of \
{certain} of them have uncertainties, up to {largest} s, found by {by}.{uncertain}

| file | content |
|---|---|
{rows}
[datapackage.json](datapackage.json) describes the tables for programs: every column with its type and unit (Data Package, Table Schema). \
[ro-crate-metadata.json](ro-crate-metadata.json) describes the folder as an RO-Crate 1.1.

## How to use it

1. Implement [equations.md](equations.md) with the values in [parameters.json](parameters.json), which are SI. \
[case.toml](case.toml) has them as they were given, with their units.
2. Compare the kinds of your events, in their order, with the column `kind` of [events.csv](events.csv). Leave out kick, corner, \
destabilised and restabilised: they are information, not part of the sequence.
3. Compare their times with `time`. A difference below `time_uncertainty` is no error.
4. Between events compare the states with [samples.csv](samples.csv). A sample near an event may lie on its other side in your run.
5. A parameter that is off by d moves an event by d times its `time_sensitivity` in sensitivities.csv, if there is one: what a \
difference of times may come from.

NaN stands for what is not known.
{example}
## How to cite it

> {author} ({year}). {title}: a certified reference run of friction-induced vibration. Computed with {program}, method {method}, \
{run}.

Also name the SHA-256 digest of events.csv, which identifies the numbers: `{digest}`.{references}

{license}
",
        title = about.title,
        events = about.events,
        certain = about.certain,
        largest = bound(about.largest_uncertainty, 1),
        program = about.program,
        method = about.method,
        run = about.run,
        digest = resources
            .iter()
            .find(|resource| resource.path == "events.csv")
            .map_or("", |resource| &resource.sha256),
    )
}
