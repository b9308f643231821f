//! The parts of a page that depend on its run: which channels it has, how they are grouped, and their names.
//!
//! The paper's brake has its own words and one panel for both of its shafts. Other chains have panels of all inertias and shafts. A run
//! that does not stop has a portrait of the motion that it comes to.

use serde::{Deserialize, Serialize};
use std::rc::Rc;

use crate::case::Motion;
use crate::model::system::{ContactLaw, Pressing, System};
use crate::plot::html::escaped;
use crate::plot::labels::in_translation;
use crate::plot::portraits::{Shown, few_samples, shown};
use crate::plot::sides::Sides;
use crate::plot::{PlotError, Run};
use crate::record::State;
use crate::results::ResultFile;
use crate::results::schema::{self, Variable};
use crate::signal::Drive;

/// The panels of every page, in order.
const PANELS: &str = include_str!("panels.json");

/// Colours of the page's style, in the order of use; a panel has at most as many curves.
const COLOURS: [&str; 6] = ["blue", "vermillion", "green", "orange", "purple", "black"];

/// A panel of that table.
#[derive(Deserialize)]
struct Row {
    /// "brake" or "others", if it is not of both.
    of: Option<&'static str>,
    title: &'static str,
    /// From the beginning, and not only where it is chosen.
    shown: bool,
    /// Channel, legend and colour.
    #[serde(default)]
    curves: Vec<(&'static str, &'static str, &'static str)>,
    /// Instead of curves: what there is of every inertia or shaft.
    each: Option<&'static str>,
}

/// What stick can carry backwards. It is drawn, but the panel's range does not follow it.
const LIMIT: &str = "breakaway_torque_backward";

/// A channel in a panel.
#[derive(Debug, Serialize)]
pub(super) struct Curve {
    /// Of the channel.
    pub(super) name: String,
    /// In the legend.
    label: String,
    colour: &'static str,
    limit: bool,
}

/// Channels in common axes over time.
#[derive(Debug, Serialize)]
pub(super) struct Panel {
    title: String,
    pub(super) curves: Vec<Curve>,
    /// From the beginning, and not only where it is chosen.
    pub(super) shown: bool,
    /// In a short view it counts from the left edge.
    pub(super) change: bool,
}

/// A phase portrait of what is in view.
#[derive(Debug, Serialize)]
pub(super) struct Portrait {
    /// Of its place on the page.
    id: &'static str,
    x: PortraitAxis,
    y: PortraitAxis,
}

#[derive(Debug, Serialize)]
struct PortraitAxis {
    /// Of the channel.
    name: String,
    label: String,
    /// Whether it jumps where the mode changes.
    jumps: bool,
}

/// A small figure with a heading, and what it shows.
fn card(heading: &str, id: &str, hint: &str) -> String {
    format!(
        "<section class=\"card\"><h2>{}</h2><div class=\"figure\" id=\"{id}\"></div><p class=\"hint\">{}</p></section>\n",
        escaped(heading),
        escaped(hint)
    )
}

/// What the page of a run that does not stop has beside the others.
const CYCLES: &str =
    "<section class=\"card full\"><h2>Cycles</h2><div id=\"cycles\" class=\"scroll\"></div></section>\n";
const LAST_PERIOD: &str =
    "<button type=\"button\" id=\"last-period\" title=\"Of the motion that the run comes to\">Last period</button>\n";
const ORBIT: &str = include_str!("orbit.js");

/// The parts of a page that depend on its run.
#[derive(Debug)]
pub(super) struct Form {
    /// The file as figures need it. Without it, as its case cannot be read by this version, the page lacks two numbers and what follows
    /// from the case.
    pub(super) run: Option<Box<Run>>,
    /// The columns of the trajectory that the page has, in the order of the file.
    pub(super) variables: Vec<Variable>,
    pub(super) panels: Vec<Panel>,
    pub(super) portraits: Vec<Portrait>,
    /// Channels that are known on both sides of every event, those of every run first.
    pub(super) sides: Vec<(String, Rc<Sides>)>,
    /// mu_0 r, m: the contact force times this is the torque that stick can carry; `None` of a contact without stick.
    pub(super) breakaway_arm: Option<f64>,
    /// Of what the interface transmits, UDUNITS.
    pub(super) torque_unit: &'static str,
    /// Small figures, as they stand in the page.
    cards: String,
    /// The time from which on every sample is on the page, whatever its length, s: the last period of a motion that repeats itself.
    pub(super) whole_from: Option<f64>,
}

impl Form {
    /// The form of a file, with its run where its case can be read; without, in the words of a brake.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn of(file: &ResultFile, run: Option<Run>) -> Result<Form, PlotError> {
        let of_every_file = schema::trajectory().variables;
        let words = Words {
            run: run.as_ref(),
            variables: run.as_ref().map_or(&of_every_file, |run| &run.variables),
            motion: run.as_ref().map_or(Motion::Rotation, |run| run.case.motion()),
        };
        let panels = words.panels()?;
        let curves = || panels.iter().flat_map(|panel| &panel.curves);
        let is_drawn = |variable: &&Variable| curves().any(|curve| curve.name == variable.name);
        let variables: Vec<Variable> = words.variables.iter().filter(is_drawn).cloned().collect();
        let (mut cards, mut whole_from) = (String::new(), None);
        if let Some(run) = run.as_ref().filter(|run| !run.stops()) {
            (cards, whole_from) = orbit(run)?;
        }
        let (portraits, of_portraits) = words.portraits();
        let stick = run.as_ref().map(|run| &run.system).filter(|system| has_stick(system));
        Ok(Form {
            sides: sides(file, run.as_ref(), &variables)?,
            variables,
            panels,
            portraits,
            breakaway_arm: stick.map(|system| system.breakaway * system.radius),
            torque_unit: match words.motion {
                Motion::Rotation => "N m",
                Motion::Translation => "N",
            },
            cards: cards + &of_portraits,
            whole_from,
            run: run.map(Box::new),
        })
    }

    pub(super) fn has(&self, channel: &str) -> bool {
        self.variables.iter().any(|variable| variable.name == channel)
    }

    /// What stands for names in double braces in the page and its scripts.
    pub(super) fn parts(&self) -> [(&'static str, &str); 4] {
        let goes_on = self.run.as_ref().is_some_and(|run| !run.stops());
        [
            ("buttons", if self.whole_from.is_some() { LAST_PERIOD } else { "" }),
            ("cards", &self.cards),
            ("tables", if goes_on { CYCLES } else { "" }),
            ("further", if goes_on { ORBIT } else { "" }),
        ]
    }

    /// T_n, s; `None` of what does not stop.
    pub(super) fn natural_period(&self) -> Option<f64> {
        self.run.as_ref().filter(|run| run.stops())?.natural_period
    }
}

/// Whether the contact can stick, so that there is a torque at which it breaks away.
fn has_stick(system: &System) -> bool {
    system.contact == ContactLaw::StickSlip
}

/// The channels among these that are known on both sides of every event, as the file has them or by the equations.
fn sides(file: &ResultFile, run: Option<&Run>, variables: &[Variable]) -> Result<Vec<(String, Rc<Sides>)>, PlotError> {
    let state = |name: &str| State::DESCRIPTIONS.iter().position(|state| state.0 == name);
    let mut names: Vec<&str> = variables.iter().map(|variable| variable.name.as_str()).collect();
    names.sort_by_key(|name| state(name).unwrap_or(State::COUNT));
    let mut found = Vec::new();
    for name in names {
        let sides = match run {
            Some(run) => run.at_events(name)?,
            None if state(name).is_some() => Some(Rc::new(Sides::of_file(file, name)?)),
            None => None,
        };
        found.extend(sides.map(|sides| (name.to_owned(), sides)));
    }
    Ok(found)
}

/// The card of the motion that a run comes to, and where that begins if it is one period, s.
fn orbit(run: &Run) -> Result<(String, Option<f64>), PlotError> {
    let Shown { axes, window, periodic } = shown(run);
    let over = run.axis(axes.0)?.name;
    let (heading, span) = match run.attractor_period.filter(|_| periodic) {
        Some(period) => ("Last period", format!("the last {period:.6} s")),
        None => ("Phase portrait", "the run".to_owned()),
    };
    let colours = match has_stick(&run.system) {
        true => ": vermilion in stick, blue and purple in slip.",
        false => ".",
    };
    let few = few_samples(run, window)?.map(|few| few.replacen("it", " It", 1) + ".");
    let few = few.unwrap_or_default();
    let hint = format!("Relative velocity over {over}, of {span}{colours}{few}");
    Ok((card(heading, "portrait-orbit", &hint), periodic.then_some(window.0)))
}

/// What panels and portraits are made of.
struct Words<'a> {
    run: Option<&'a Run>,
    variables: &'a [Variable],
    motion: Motion,
}

impl Words<'_> {
    /// Whether the system is the paper's brake, or its case cannot be read.
    fn short(&self) -> bool {
        let is_brake = |run: &Run| run.stops() && run.is_short() && self.motion == Motion::Rotation;
        self.run.is_none_or(is_brake)
    }

    /// Whether a channel says something in this run.
    fn has(&self, channel: &str) -> bool {
        match channel {
            "z" | "z_dot" | "applied_force" => self.run.is_none_or(Run::has_axial_mode),
            "breakaway_torque" | LIMIT => self.run.is_none_or(|run| has_stick(&run.system)),
            "work_perturbation" => self.run.is_some_and(|run| !run.system.kicks.is_empty()),
            _ => self.variables.iter().any(|variable| variable.name == channel),
        }
    }

    /// Words of rotation in those of the run; braces stand for the symbol of a channel.
    fn said(&self, words: &str, channel: &str) -> String {
        let words = match self.motion {
            Motion::Rotation => words.to_owned(),
            Motion::Translation => in_translation(words).replace("μ₀ r", "μ₀"),
        };
        let axis = self.run.and_then(|run| run.axis(channel).ok());
        words.replace("{}", axis.as_ref().map_or(channel, |axis| axis.short()))
    }

    /// A panel of those of its channels that say something: (channel, legend, colour).
    fn panel(&self, title: &str, shown: bool, curves: &[(&str, &str, &'static str)]) -> Panel {
        let curves = curves.iter().filter(|curve| self.has(curve.0));
        let curves = curves.map(|&(name, label, colour)| Curve {
            name: name.to_owned(),
            label: self.said(label, name),
            colour,
            limit: name == LIMIT,
        });
        Panel {
            title: self.said(title, ""),
            curves: curves.collect(),
            shown,
            change: title == "Energy",
        }
    }

    /// Panels of every inertia or shaft, of which the first is shown: as many in each as there are colours.
    fn each(&self, title: &str, shown: bool, what: &str) -> Vec<Panel> {
        let of_side = |side: &'static str| {
            self.variables.iter().filter_map(move |variable| {
                let number = variable.name.strip_prefix(&format!("{side}_{what}_"))?;
                let is_number = number.bytes().all(|byte| byte.is_ascii_digit());
                is_number.then(|| (variable.name.as_str(), format!("{side} {number}")))
            })
        };
        let channels: Vec<(&str, String)> = ["rotor", "stator"].into_iter().flat_map(of_side).collect();
        let part = |(number, part): (usize, &[(&str, String)])| {
            let curves = part.iter().zip(COLOURS);
            let curves: Vec<_> = curves
                .map(|((name, label), colour)| (*name, label.as_str(), colour))
                .collect();
            let title = match number {
                0 => title.to_owned(),
                _ => format!("{title}, {} on", part[0].1),
            };
            self.panel(&title, shown && number == 0, &curves)
        };
        channels.chunks(COLOURS.len()).enumerate().map(part).collect()
    }

    /// The panels of the page.
    fn panels(&self) -> Result<Vec<Panel>, PlotError> {
        let rows: Vec<Row> = serde_json::from_str(PANELS).map_err(|error| PlotError::Drawing(error.to_string()))?;
        let form = if self.short() { "brake" } else { "others" };
        let is = |what: fn(&System) -> bool| self.run.is_some_and(|run| what(&run.system));
        let mut panels = Vec::new();
        for row in rows.iter().filter(|row| row.of.is_none_or(|of| of == form)) {
            // What would show the same as another panel, or nothing that changes, is there where it is chosen.
            let tells = match row.title {
                "Speed of inertia" => is(|system| system.rotor.inertia.len() > 1 || system.stator.inertia.len() > 1),
                "Normal force" => !is(|system| matches!(system.pressing, Pressing::Force(Drive::Value(_)))),
                _ => true,
            };
            match row.each {
                Some(what) => panels.extend(self.each(row.title, row.shown && tells, what)),
                None => panels.push(self.panel(row.title, row.shown && tells, &row.curves)),
            }
        }
        panels.retain(|panel| !panel.curves.is_empty());
        Ok(panels)
    }

    /// The portraits of the page, and the cards in which they stand.
    fn portraits(&self) -> (Vec<Portrait>, String) {
        let hint = "Torque through the interface by relative velocity, of the samples in view.";
        let hint = self.said(hint, "");
        let general = self.run.filter(|_| !self.short());
        // Heading, place, hint, and channel and label of either axis.
        let mut rows = match general.map(|run| shown(run).axes) {
            Some((x, y)) => {
                let hint = "The same of the samples in view, joined by straight lines, also across an event.";
                vec![("In view", "portrait-view", hint, (x, "{}"), (y, "{}"))]
            }
            None => {
                let hint = "Phase portrait of the samples in view: vermilion in stick, blue in slip.";
                let (x, y) = (("phi1", "φ₁"), ("phi1_dot", "φ₁′"));
                let stator = ("Stator surface", "portrait-stator", hint, x, y);
                let hint = "Phase portrait of the samples in view.";
                let (x, y) = (("rotor_twist", "θ − φ₂"), ("rotor_twist_rate", "θ′ − φ₂′"));
                vec![stator, ("Rotor twist", "portrait-rotor", hint, x, y)]
            }
        };
        let velocity = if general.is_some() { "{}" } else { "ω_r" };
        let (x, y) = (("relative_velocity", velocity), ("friction_torque", "torque"));
        rows.push(("Friction", "portrait-friction", &hint, x, y));
        let axis = |(name, label): (&str, &str)| PortraitAxis {
            name: name.to_owned(),
            label: self.said(label, name),
            jumps: name == "friction_torque",
        };
        let cards = rows.iter().map(|row| card(row.0, row.1, row.2)).collect();
        let portraits = rows.iter().map(|&(_, id, _, x, y)| Portrait {
            id,
            x: axis(x),
            y: axis(y),
        });
        (portraits.collect(), cards)
    }
}
