//! What the page of two trains has in the place of the brake's: further inertias, shafts and bristles, the words of its
//! motion, one period of what the run comes to, and a table of its cycles.

use serde::Serialize;

use super::encoding;
use super::form::{Colour, Curve, Form, FormCase, Panel, Portrait, card};
use crate::case::{Motion, TrainCase};
use crate::model::trains::{ContactLaw, Pressing, Trains};
use crate::plot::trains::{Shown, few_samples, shown};
use crate::plot::{PlotError, Run};
use crate::signal::Drive;

/// Curves in a panel, as many as there are colours.
const CURVES: usize = Colour::ALL.len();

/// Points of the orbit on a page.
const POINTS: usize = 30_000;

/// One period of the motion that the run comes to, or the end of a run that does not repeat itself.
#[derive(Debug, Serialize)]
pub(super) struct Orbit {
    /// When it begins and ends, s.
    from: f64,
    to: f64,
    /// The period, s; `None` of a motion that does not repeat itself.
    period: Option<f64>,
    x: OrbitAxis,
    y: OrbitAxis,
    lines: Vec<OrbitLine>,
}

#[derive(Debug, Serialize)]
struct OrbitAxis {
    label: String,
    /// UDUNITS.
    unit: String,
}

#[derive(Debug, Serialize)]
struct OrbitLine {
    mode: &'static str,
    x: String,
    y: String,
}

/// mu_0 r, m; `None` of a contact without stick.
fn breakaway_arm(trains: &Trains) -> Option<f64> {
    (trains.contact == ContactLaw::StickSlip).then_some(trains.breakaway * trains.radius)
}

/// The orbit of a run, as its figure `phase-portrait` has it; and what of it is left out.
pub(super) fn orbit(case: &TrainCase, run: &Run) -> Result<(Orbit, Option<String>), PlotError> {
    let Shown { axes, window, periodic } = shown(run, case);
    let window = run.shortened(window, POINTS)?;
    let axis = |channel: &str| -> Result<OrbitAxis, PlotError> {
        let axis = run.axis(channel)?;
        Ok(OrbitAxis {
            label: axis.short().to_owned(),
            unit: axis.unit,
        })
    };
    let (mut lines, mut room, mut cut) = (Vec::new(), POINTS, false);
    for (mode, pieces) in run.portrait(axes.0, axes.1, window)? {
        for mut piece in pieces {
            cut |= piece.len() > room;
            piece.truncate(room);
            room -= piece.len();
            let coordinate =
                |of: fn(&(f64, f64)) -> f64| encoding::doubles(&piece.iter().map(of).collect::<Vec<f64>>());
            lines.push(OrbitLine {
                mode: mode.name(),
                x: coordinate(|point| point.0),
                y: coordinate(|point| point.1),
            });
        }
    }
    let note =
        cut.then(|| format!("The phase portrait is cut after {POINTS} points; `stickslip plot` draws all of it."));
    let orbit = Orbit {
        from: window.0,
        to: window.1,
        period: periodic.then_some(run.attractor_period).flatten(),
        x: axis(axes.0)?,
        y: axis(axes.1)?,
        lines,
    };
    Ok((orbit, note))
}

/// Whether the force that presses the surfaces together changes.
fn is_pressed_by_a_signal(pressing: &Pressing) -> bool {
    !matches!(pressing, Pressing::Force(Drive::Value(_)))
}

/// Panels of many channels: so many in each as there are colours, and the first of them shown.
fn groups(panels: &mut Vec<Panel>, title: &str, shown: bool, channels: &[(String, String)]) {
    let parts = channels.chunks(CURVES).enumerate();
    for (number, part) in parts {
        let curves = part.iter().zip(Colour::ALL);
        let curves = curves.map(|((channel, name), colour)| Curve::new(channel, name, colour));
        let title = match number {
            0 => title.to_owned(),
            _ => format!("{title}, {} on", part.first().map_or("", |first| &first.1)),
        };
        panels.push(Panel::new(&title, shown && number == 0, curves.collect()));
    }
}

/// The form of a file of trains.
pub(super) fn form(case: TrainCase, run: Run) -> Result<Form, PlotError> {
    let trains = &case.parameters;
    let axial = matches!(trains.pressing, Pressing::Axial { .. });
    // Shaft 0 of the rotor has its number as well; the others are zero throughout.
    let left_out = |name: &str| match name {
        "time" | "mode" | "segment" | "rotor_twist" | "rotor_twist_rate" => true,
        "z" | "z_dot" | "applied_force" => !axial,
        "work_perturbation" => trains.kicks.is_empty(),
        _ => false,
    };
    let variables: Vec<_> = run.variables().iter().filter(|v| !left_out(&v.name)).cloned().collect();
    let symbol = |channel: &str| -> Result<String, PlotError> { Ok(run.axis(channel)?.short().to_owned()) };
    let (torque, position) = match case.motion {
        Motion::Rotation => ("Torque", "Angle"),
        Motion::Translation => ("Force", "Position"),
    };
    let arm = match case.motion {
        Motion::Rotation => "μ₀ r F_n",
        Motion::Translation => "μ₀ F_n",
    };
    let numbered = |what: &str| -> Vec<(String, String)> {
        let mut found = Vec::new();
        for side in ["rotor", "stator"] {
            let begin = format!("{side}_{what}_");
            let of_side = variables.iter().filter_map(|v| Some((v, v.name.strip_prefix(&begin)?)));
            for (variable, number) in of_side {
                if number.bytes().all(|b| b.is_ascii_digit()) {
                    found.push((variable.name.clone(), format!("{side} {number}")));
                }
            }
        }
        found
    };
    use Colour::{Black, Blue, Green, Orange, Purple, Vermillion};
    let mut panels = Vec::new();
    let curve = |channel: &str, name: &str, colour: Colour| Curve::new(channel, name, colour);
    let named = |channel: &str, name: &str, colour: Colour| -> Result<Curve, PlotError> {
        Ok(Curve::new(channel, &format!("{name}, {}", symbol(channel)?), colour))
    };
    panels.push(Panel::new(
        "Surface speed",
        true,
        vec![
            named("phi2_dot", "rotor", Blue)?,
            named("phi1_dot", "stator", Vermillion)?,
        ],
    ));
    panels.push(Panel::new(
        "Relative velocity",
        true,
        vec![curve("relative_velocity", &symbol("relative_velocity")?, Blue)],
    ));
    // The inertias beside the contact have the speeds of its surfaces.
    let several = trains.rotor.inertia.len() > 1 || trains.stator.inertia.len() > 1;
    groups(&mut panels, "Speed of inertia", several, &numbered("speed"));
    groups(&mut panels, "Twist of shaft", true, &numbered("twist"));
    if variables.iter().any(|v| v.name == "bristle_deflection") {
        panels.push(Panel::new(
            "Bristle deflection",
            true,
            vec![curve("bristle_deflection", "z", Blue)],
        ));
    }
    let mut torques = vec![
        curve("friction_torque", "through the interface", Blue),
        curve("transmitted_torque", "to hold the surfaces together, T_f", Vermillion),
    ];
    if breakaway_arm(trains).is_some() {
        torques.push(curve("breakaway_torque", &format!("limit {arm}"), Purple));
        torques.push(Curve {
            limit: true,
            ..curve("breakaway_torque_backward", &format!("−{arm}"), Purple)
        });
    }
    panels.push(Panel::new(torque, true, torques));
    let mut forces = vec![curve("normal_force", "contact, F_n", Vermillion)];
    if axial {
        forces.push(curve("applied_force", "applied, F", Blue));
    }
    panels.push(Panel::new(
        "Normal force",
        is_pressed_by_a_signal(&trains.pressing),
        forces,
    ));
    let mut energies = vec![
        curve("energy_kinetic", "kinetic", Blue),
        curve("energy_elastic", "elastic", Orange),
        curve("dissipated_friction", "lost to friction", Vermillion),
        curve("dissipated_damping", "lost to damping", Green),
        curve("work_applied", "work from outside", Purple),
    ];
    if !trains.kicks.is_empty() {
        energies.push(curve("work_perturbation", "work of kicks", Black));
    }
    panels.push(Panel {
        change: true,
        ..Panel::new("Energy", true, energies)
    });
    panels.push(Panel::new(
        "Energy residual",
        false,
        vec![curve("energy_residual", "made or lost by the solver", Blue)],
    ));
    groups(&mut panels, "Twist rate of shaft", false, &numbered("twist_rate"));
    if axial {
        panels.push(Panel::new("Axial displacement", false, vec![curve("z", "z", Blue)]));
        panels.push(Panel::new("Axial velocity", false, vec![curve("z_dot", "z′", Blue)]));
    }
    panels.push(Panel::new(
        position,
        false,
        vec![
            named("phi2", "rotor surface", Blue)?,
            named("phi1", "stator surface", Vermillion)?,
            named("theta", "outermost inertia of the rotor", Green)?,
        ],
    ));
    panels.push(Panel::new(
        "Speed of the rotor",
        false,
        vec![named("theta_dot", "outermost inertia", Blue)?],
    ));
    panels.push(Panel::new(
        "Slip displacement",
        false,
        vec![curve("slip_displacement", &symbol("slip_displacement")?, Blue)],
    ));
    let Shown { axes, window, periodic } = shown(&run, &case);
    let axis = |channel: &str| -> Result<(String, String), PlotError> { Ok((channel.to_owned(), symbol(channel)?)) };
    let portraits = vec![
        Portrait {
            id: "portrait-view",
            heading: "In view".to_owned(),
            hint: "The same of the samples in view, joined by straight lines, also across an event.".to_owned(),
            x: axis(axes.0)?,
            y: axis(axes.1)?,
            jumps: false,
        },
        Portrait {
            id: "portrait-friction",
            heading: "Friction".to_owned(),
            hint: format!("{torque} through the interface by relative velocity, of the samples in view."),
            x: axis("relative_velocity")?,
            y: ("friction_torque".to_owned(), torque.to_lowercase()),
            jumps: true,
        },
    ];
    let over = run.axis(axes.0)?.name;
    let (heading, span) = match run.attractor_period.filter(|_| periodic) {
        Some(period) => ("Last period", format!("the last {period:.6} s")),
        None => ("Phase portrait", "the run".to_owned()),
    };
    let colours = match trains.contact {
        ContactLaw::StickSlip => ": vermilion in stick, blue and purple in slip.",
        _ => ".",
    };
    let few = few_samples(&run, window)?.map(|few| format!(" {few}."));
    let few = few.map(|few| few.replacen(" it", " It", 1)).unwrap_or_default();
    let hint = format!("Relative velocity over {over}, of {span}{colours}{few}");
    Ok(Form {
        variables,
        panels,
        portraits,
        breakaway_arm: breakaway_arm(trains),
        torque_unit: match case.motion {
            Motion::Rotation => "N m",
            Motion::Translation => "N",
        },
        buttons: if periodic {
            "<button type=\"button\" id=\"last-period\" title=\"Of the motion that the run comes to\">Last period</button>\n"
        } else {
            ""
        },
        cards: card(heading, "portrait-orbit", &hint),
        tables: "<section class=\"card full\"><h2>Cycles</h2><div id=\"cycles\" class=\"scroll\"></div></section>\n",
        script: include_str!("orbit.js"),
        whole_from: periodic.then_some(window.0),
        case: FormCase::Trains {
            case: Box::new(case),
            run: Box::new(run),
        },
    })
}
