//! What a page has of a run: its channels, how they are grouped, and what they are called. The paper's brake has its own words and a
//! panel for both of its shafts; other chains have panels of all inertias and shafts, and what does not stop has a portrait of the
//! motion that it comes to.

use super::form::{Colour, Curve, Form, Panel, Portrait, card};
use crate::case::Motion;
use crate::model::system::{ContactLaw, Pressing, System};
use crate::plot::portraits::{Shown, few_samples, shown};
use crate::plot::{PlotError, Run};
use crate::results::schema::{self, Variable};
use crate::signal::Drive;
use Colour::{Black, Blue, Green, Orange, Purple, Vermillion};

/// Curves in a panel, as many as there are colours.
const CURVES: usize = Colour::ALL.len();

/// mu_0 r, m; `None` of a contact without stick.
fn breakaway_arm(trains: &System) -> Option<f64> {
    (trains.contact == ContactLaw::StickSlip).then_some(trains.breakaway * trains.radius)
}

fn curve(channel: &str, name: &str, colour: Colour) -> Curve {
    Curve::new(channel, name, colour)
}

/// Panels of many channels: so many in each as there are colours, and the first of them shown.
fn groups(panels: &mut Vec<Panel>, title: &str, shown: bool, channels: &[(String, String)]) {
    let parts = channels.chunks(CURVES).enumerate();
    for (number, part) in parts {
        let curves = part.iter().zip(Colour::ALL);
        let curves = curves.map(|((channel, name), colour)| curve(channel, name, colour));
        let title = match number {
            0 => title.to_owned(),
            _ => format!("{title}, {} on", part.first().map_or("", |first| &first.1)),
        };
        panels.push(Panel::new(&title, shown && number == 0, curves.collect()));
    }
}

/// What the panels are made of.
struct Panels<'a> {
    run: Option<&'a Run>,
    variables: &'a [Variable],
    /// The system is the paper's brake, or its case cannot be read.
    short: bool,
    motion: Motion,
}

impl Panels<'_> {
    fn system(&self) -> Option<&System> {
        self.run.map(|run| &run.system)
    }

    fn has_kicks(&self) -> bool {
        self.system().is_some_and(|trains| !trains.kicks.is_empty())
    }

    fn has_axial_mode(&self) -> bool {
        self.run.is_none_or(Run::has_axial_mode)
    }

    /// "Torque" or "Force".
    fn torque(&self) -> &'static str {
        match self.motion {
            Motion::Rotation => "Torque",
            Motion::Translation => "Force",
        }
    }

    /// The symbol of a channel, or its name without one.
    fn symbol(&self, channel: &str) -> Result<String, PlotError> {
        match self.run {
            Some(run) => Ok(run.axis(channel)?.short().to_owned()),
            None => Ok(channel.to_owned()),
        }
    }

    fn named(&self, channel: &str, name: &str, colour: Colour) -> Result<Curve, PlotError> {
        Ok(curve(channel, &format!("{name}, {}", self.symbol(channel)?), colour))
    }

    /// The columns of every inertia or shaft, with its name.
    fn numbered(&self, what: &str) -> Vec<(String, String)> {
        let mut found = Vec::new();
        for side in ["rotor", "stator"] {
            let begin = format!("{side}_{what}_");
            let of_side = self
                .variables
                .iter()
                .filter_map(|v| Some((v, v.name.strip_prefix(&begin)?)));
            for (variable, number) in of_side {
                if number.bytes().all(|b| b.is_ascii_digit()) {
                    found.push((variable.name.clone(), format!("{side} {number}")));
                }
            }
        }
        found
    }

    /// Speeds, twists and what the contact transmits.
    fn motion(&self, panels: &mut Vec<Panel>) -> Result<(), PlotError> {
        let relative = |name: &str| Panel::new("Relative velocity", true, vec![curve("relative_velocity", name, Blue)]);
        if self.short {
            let speeds = vec![
                curve("theta_dot", "rotor", Blue),
                curve("phi2_dot", "rotor surface", Vermillion),
                curve("phi1_dot", "stator surface", Green),
            ];
            let twists = vec![
                curve("rotor_twist", "rotor, θ − φ₂", Blue),
                curve("phi1", "stator, φ₁", Vermillion),
            ];
            panels.push(Panel::new("Speed", true, speeds));
            panels.push(relative("φ₂′ − φ₁′"));
            panels.push(Panel::new("Twist", true, twists));
            return Ok(());
        }
        let speeds = vec![
            self.named("phi2_dot", "rotor", Blue)?,
            self.named("phi1_dot", "stator", Vermillion)?,
        ];
        panels.push(Panel::new("Surface speed", true, speeds));
        panels.push(relative(&self.symbol("relative_velocity")?));
        // The inertias beside the contact have the speeds of its surfaces.
        let several = |trains: &System| trains.rotor.inertia.len() > 1 || trains.stator.inertia.len() > 1;
        let several = self.system().is_some_and(several);
        groups(panels, "Speed of inertia", several, &self.numbered("speed"));
        groups(panels, "Twist of shaft", true, &self.numbered("twist"));
        if self.variables.iter().any(|v| v.name == "bristle_deflection") {
            let deflection = vec![curve("bristle_deflection", "z", Blue)];
            panels.push(Panel::new("Bristle deflection", true, deflection));
        }
        Ok(())
    }

    fn contact(&self, panels: &mut Vec<Panel>) {
        let transmitted = match self.short {
            true => "T_f = (T_r + T_s)/2",
            false => "to hold the surfaces together, T_f",
        };
        let mut torques = vec![
            curve("friction_torque", "through the interface", Blue),
            curve("transmitted_torque", transmitted, Vermillion),
        ];
        if self.system().is_none_or(|trains| breakaway_arm(trains).is_some()) {
            let arm = match self.motion {
                Motion::Rotation => "μ₀ r F_n",
                Motion::Translation => "μ₀ F_n",
            };
            torques.push(curve("breakaway_torque", &format!("limit {arm}"), Purple));
            torques.push(Curve {
                limit: true,
                ..curve("breakaway_torque_backward", &format!("−{arm}"), Purple)
            });
        }
        panels.push(Panel::new(self.torque(), true, torques));
        let mut forces = vec![curve("normal_force", "contact, F_n", Vermillion)];
        if self.has_axial_mode() {
            forces.push(curve("applied_force", "applied, F", Blue));
        }
        let is_constant = |trains: &System| matches!(trains.pressing, Pressing::Force(Drive::Value(_)));
        let changes = !self.short && !self.system().is_some_and(is_constant);
        let title = if self.short { "Axial force" } else { "Normal force" };
        panels.push(Panel::new(title, changes, forces));
    }

    fn energy(&self, panels: &mut Vec<Panel>) {
        let mut energies = vec![
            curve("energy_kinetic", "kinetic", Blue),
            curve("energy_elastic", "elastic", Orange),
            curve("dissipated_friction", "lost to friction", Vermillion),
            curve("dissipated_damping", "lost to damping", Green),
        ];
        let outside = if self.short { "work of F" } else { "work from outside" };
        energies.push(curve("work_applied", outside, Purple));
        if !self.short && self.has_kicks() {
            energies.push(curve("work_perturbation", "work of kicks", Black));
        }
        panels.push(Panel {
            change: true,
            ..Panel::new("Energy", true, energies)
        });
        let residual = vec![curve("energy_residual", "made or lost by the solver", Blue)];
        panels.push(Panel::new("Energy residual", false, residual));
    }

    /// What is shown only where it is chosen.
    fn others(&self, panels: &mut Vec<Panel>) -> Result<(), PlotError> {
        if self.short {
            let rates = vec![
                curve("rotor_twist_rate", "rotor", Blue),
                curve("phi1_dot", "stator", Vermillion),
            ];
            panels.push(Panel::new("Twist rate", false, rates));
        } else {
            groups(panels, "Twist rate of shaft", false, &self.numbered("twist_rate"));
        }
        if self.has_axial_mode() {
            panels.push(Panel::new("Axial displacement", false, vec![curve("z", "z", Blue)]));
        }
        if self.short {
            let slip = vec![curve("slip_displacement", "φ₂ − φ₁", Blue)];
            panels.push(Panel::new("Slip displacement", false, slip));
            return Ok(());
        }
        if self.has_axial_mode() {
            panels.push(Panel::new("Axial velocity", false, vec![curve("z_dot", "z′", Blue)]));
        }
        let positions = vec![
            self.named("phi2", "rotor surface", Blue)?,
            self.named("phi1", "stator surface", Vermillion)?,
            self.named("theta", "outermost inertia of the rotor", Green)?,
        ];
        let position = match self.motion {
            Motion::Rotation => "Angle",
            Motion::Translation => "Position",
        };
        panels.push(Panel::new(position, false, positions));
        let speed = vec![self.named("theta_dot", "outermost inertia", Blue)?];
        panels.push(Panel::new("Speed of the rotor", false, speed));
        let slip = vec![curve("slip_displacement", &self.symbol("slip_displacement")?, Blue)];
        panels.push(Panel::new("Slip displacement", false, slip));
        Ok(())
    }

    fn portraits(&self) -> Result<Vec<Portrait>, PlotError> {
        let axis = |channel: &str, label: &str| (channel.to_owned(), label.to_owned());
        let portrait = |id, heading: &str, hint: &str, x, y| Portrait {
            id,
            heading: heading.to_owned(),
            hint: hint.to_owned(),
            x,
            y,
            jumps: false,
        };
        let torque = self.torque();
        let hint = format!("{torque} through the interface by relative velocity, of the samples in view.");
        let friction = |symbol: &str| Portrait {
            jumps: true,
            ..portrait(
                "portrait-friction",
                "Friction",
                &hint,
                axis("relative_velocity", symbol),
                axis("friction_torque", &torque.to_lowercase()),
            )
        };
        let run = match self.run {
            Some(run) if !self.short => run,
            _ => {
                return Ok(vec![
                    portrait(
                        "portrait-stator",
                        "Stator surface",
                        "Phase portrait of the samples in view: vermilion in stick, blue in slip.",
                        axis("phi1", "φ₁"),
                        axis("phi1_dot", "φ₁′"),
                    ),
                    portrait(
                        "portrait-rotor",
                        "Rotor twist",
                        "Phase portrait of the samples in view.",
                        axis("rotor_twist", "θ − φ₂"),
                        axis("rotor_twist_rate", "θ′ − φ₂′"),
                    ),
                    friction("ω_r"),
                ]);
            }
        };
        let (x, y) = shown(run).axes;
        Ok(vec![
            portrait(
                "portrait-view",
                "In view",
                "The same of the samples in view, joined by straight lines, also across an event.",
                axis(x, &self.symbol(x)?),
                axis(y, &self.symbol(y)?),
            ),
            friction(&self.symbol("relative_velocity")?),
        ])
    }
}

/// The form of a file, whose run is given where its case can be read.
///
/// # Errors
/// The file cannot be read.
pub(super) fn form(run: Option<Run>) -> Result<Form, PlotError> {
    let of_every_file = schema::trajectory().variables;
    let motion = run.as_ref().map_or(Motion::Rotation, |run| run.case.motion());
    let of = Panels {
        run: run.as_ref(),
        variables: run.as_ref().map_or(&of_every_file, |run| run.variables()),
        short: run
            .as_ref()
            .is_none_or(|run| run.stops() && run.is_short() && motion == Motion::Rotation),
        motion,
    };
    let mut panels = Vec::new();
    of.motion(&mut panels)?;
    of.contact(&mut panels);
    of.energy(&mut panels);
    of.others(&mut panels)?;
    let portraits = of.portraits()?;
    let is_drawn = |variable: &&Variable| {
        let mut curves = panels.iter().flat_map(|panel| &panel.curves);
        curves.any(|curve| curve.channel == variable.name)
    };
    let mut form = Form {
        variables: of.variables.iter().filter(is_drawn).cloned().collect(),
        breakaway_arm: of.system().and_then(breakaway_arm),
        torque_unit: match motion {
            Motion::Rotation => "N m",
            Motion::Translation => "N",
        },
        panels,
        portraits,
        buttons: "",
        cards: String::new(),
        tables: "",
        script: "",
        whole_from: None,
        run: None,
    };
    if let Some(run) = run.as_ref().filter(|run| !run.stops()) {
        of_attractor(&mut form, run)?;
    }
    form.run = run.map(Box::new);
    Ok(form)
}

/// What the page has of the motion that a run comes to.
fn of_attractor(form: &mut Form, run: &Run) -> Result<(), PlotError> {
    let Shown { axes, window, periodic } = shown(run);
    let over = run.axis(axes.0)?.name;
    let (heading, span) = match run.attractor_period.filter(|_| periodic) {
        Some(period) => ("Last period", format!("the last {period:.6} s")),
        None => ("Phase portrait", "the run".to_owned()),
    };
    let colours = match run.system.contact {
        ContactLaw::StickSlip => ": vermilion in stick, blue and purple in slip.",
        _ => ".",
    };
    let few = few_samples(run, window)?.map(|few| format!(" {few}."));
    let few = few.map(|few| few.replacen(" it", " It", 1)).unwrap_or_default();
    let hint = format!("Relative velocity over {over}, of {span}{colours}{few}");
    form.cards = card(heading, "portrait-orbit", &hint);
    form.tables = "<section class=\"card full\"><h2>Cycles</h2><div id=\"cycles\" class=\"scroll\"></div></section>\n";
    form.script = include_str!("orbit.js");
    if periodic {
        form.buttons = "<button type=\"button\" id=\"last-period\" title=\"Of the motion that the run comes to\">Last period</button>\n";
        form.whole_from = Some(window.0);
    }
    Ok(())
}
