//! Parts of a page that depend on its run: channels, their groups and names.
//!
//! The paper's brake has its own words, and one panel for both shafts. Other chains have panels of all inertias and
//! shafts. A run without a stop has a portrait of its attractor.

use serde::{Deserialize, Serialize};
use std::rc::Rc;

use crate::plot::labels::in_translation;
use crate::plot::portraits::shown;
use crate::plot::run::Sides;
use crate::plot::{DrawnRun, Error};
use stickslip_case::Motion;
use stickslip_files::ResultFile;
use stickslip_files::schema::{self, Variable};
use stickslip_system::friction::Law;
use stickslip_system::model::system::{ContactLaw, Pressing, System};
use stickslip_system::record::channel::{self, PanelCurve};
use stickslip_system::record::{RecordedChannel, State};
use stickslip_system::signal::Drive;

/// Panels of all pages, in order. The curves of recorded channels are in their registry.
const PANELS: &str = include_str!("../../../data/page/panels.json");

/// Colours of the page's style, in the order of use; the largest number of curves in a panel.
const COLOURS: [&str; 6] = ["blue", "vermillion", "green", "orange", "purple", "black"];

#[derive(Deserialize, Default)]
struct PageRow {
    /// "brake" or "others"; `None`: both.
    of: Option<&'static str>,
    title: &'static str,
    #[serde(default)]
    shown: bool,
    /// Channel, legend and colour of further curves.
    #[serde(default)]
    curves: Vec<(&'static str, &'static str, &'static str)>,
    each: Option<&'static str>,
}

/// Largest backward stick torque. It is drawn, but does not extend the panel's range.
const LIMIT: &str = "breakaway_torque_backward";

#[derive(Debug, Serialize)]
pub(super) struct PageCurve {
    pub(super) name: String,
    label: String,
    colour: &'static str,
    limit: bool,
}

#[derive(Debug, Serialize)]
pub(super) struct PagePanel {
    title: String,
    pub(super) curves: Vec<PageCurve>,
    /// Shown from the beginning, not only on request.
    pub(super) shown: bool,
    /// In a short view the panel shows the change since the left edge.
    pub(super) change: bool,
}

#[derive(Debug, Serialize)]
pub(super) struct PagePortrait {
    id: &'static str,
    heading: &'static str,
    hint: String,
    x: PortraitAxis,
    y: PortraitAxis,
}

#[derive(Debug, Serialize)]
struct PortraitAxis {
    name: String,
    label: String,
    /// Whether the channel jumps with the mode.
    jumps: bool,
}

#[derive(Debug)]
pub(super) struct PageForm {
    /// `None`: this version cannot read the case; the page then lacks two values and all that follows from the case.
    run: Option<Box<DrawnRun>>,
    motion: Motion,
    /// Columns of the trajectory on the page, in the order of the file.
    pub(super) variables: Vec<Variable>,
    pub(super) panels: Vec<PagePanel>,
    pub(super) portraits: Vec<PagePortrait>,
    /// Channels on both sides of each event; those of all runs first.
    pub(super) sides: Vec<(String, Rc<Sides>)>,
}

impl PageForm {
    /// The form of a file; without a run, in the words of a brake.
    pub(super) fn of(file: &ResultFile, run: Option<DrawnRun>) -> Result<PageForm, Error> {
        let of_every_file = || schema::trajectory().variables;
        let mut form = PageForm {
            motion: run.as_ref().map_or(Motion::Rotation, |run| run.case.motion()),
            variables: run.as_ref().map_or_else(of_every_file, |run| run.variables.clone()),
            run: run.map(Box::new),
            panels: Vec::new(),
            portraits: Vec::new(),
            sides: Vec::new(),
        };
        (form.panels, form.portraits) = (form.all_panels()?, form.all_portraits());
        let curves = || form.panels.iter().flat_map(|panel| &panel.curves);
        form.variables
            .retain(|variable| curves().any(|curve| curve.name == variable.name));
        form.sides = sides(file, form.run(), &form.variables)?;
        Ok(form)
    }

    pub(super) fn run(&self) -> Option<&DrawnRun> {
        self.run.as_deref()
    }

    pub(super) fn has(&self, channel: &str) -> bool {
        self.variables.iter().any(|variable| variable.name == channel)
    }

    /// T_n, s; `None` for a motion without a stop.
    pub(super) fn natural_period(&self) -> Option<f64> {
        self.run().filter(|run| run.stops())?.natural_period
    }

    /// mu_0 r of forward and of backward sliding, m: multiplied by the contact force, the largest stick torque; `None` for a
    /// contact without stick.
    pub(super) fn breakaway_arms(&self) -> Option<[f64; 2]> {
        let system = self.run().map(|run| &run.system).filter(|system| has_stick(system))?;
        let backward = system.law.backward();
        let backward = backward.map_or(system.breakaway, |backward| backward.breakaway);
        Some([system.breakaway, backward].map(|breakaway| breakaway * system.radius))
    }

    pub(super) fn torque_unit(&self) -> &'static str {
        match self.motion {
            Motion::Rotation => "N m",
            Motion::Translation => "N",
        }
    }

    /// Time from which all samples are kept, s: the last period of a periodic motion.
    pub(super) fn whole_from(&self) -> Option<f64> {
        let attractor = self.run().filter(|run| !run.stops()).map(shown)?;
        attractor.periodic.then_some(attractor.window.0)
    }
}

pub(super) fn has_stick(system: &System) -> bool {
    system.contact == ContactLaw::StickSlip
}

/// Channels among `variables` that the file or the equations give on both sides of each event.
fn sides(file: &ResultFile, run: Option<&DrawnRun>, variables: &[Variable]) -> Result<Vec<(String, Rc<Sides>)>, Error> {
    let state = |name: &str| State::CHANNELS.iter().position(|state| state.name == name);
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

impl PageForm {
    /// Whether the page uses the words of the paper's brake; also if the case cannot be read.
    fn short(&self) -> bool {
        let is_brake = |run: &DrawnRun| run.stops() && run.is_short() && self.motion == Motion::Rotation;
        self.run().is_none_or(is_brake)
    }

    fn offers(&self, channel: &str) -> bool {
        match channel {
            "z" | "z_dot" | "applied_force" => self.run().is_none_or(DrawnRun::has_axial_mode),
            "breakaway_torque" | LIMIT => self.run().is_none_or(|run| has_stick(&run.system)),
            "work_perturbation" => self.run().is_some_and(|run| !run.system.kicks.is_empty()),
            _ => self.has(channel),
        }
    }

    /// Words adapted to rotation or translation; braces stand for the symbol of a channel.
    fn said(&self, words: &str, channel: &str) -> String {
        let words = match self.motion {
            Motion::Rotation => words.to_owned(),
            Motion::Translation => in_translation(words).replace("μ₀ r", "μ₀"),
        };
        let axis = self.run().and_then(|run| run.axis(channel).ok());
        words.replace("{}", axis.as_ref().map_or(channel, |axis| axis.short()))
    }

    fn panel(&self, title: &str, shown: bool, curves: &[(&str, &str, &'static str)]) -> PagePanel {
        let curves = curves.iter().filter(|curve| self.offers(curve.0));
        let curves = curves.map(|&(name, label, colour)| PageCurve {
            name: name.to_owned(),
            label: self.said(label, name),
            colour,
            limit: name == LIMIT,
        });
        PagePanel {
            title: self.said(title, ""),
            curves: curves.collect(),
            shown,
            change: title == "Energy",
        }
    }

    /// Panels for all inertias or shafts, one colour per curve; the first panel is shown.
    fn each(&self, title: &str, shown: bool, what: &str) -> Vec<PagePanel> {
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

    fn all_panels(&self) -> Result<Vec<PagePanel>, Error> {
        let mut rows: Vec<PageRow> = serde_json::from_str(PANELS).map_err(Error::drawing)?;
        let form = if self.short() { "brake" } else { "others" };
        let of_channel = |channel: &'static RecordedChannel| channel.curves.iter().map(|curve| (channel.name, curve));
        let mut recorded: Vec<(&str, &PanelCurve)> = channel::all().flat_map(of_channel).collect();
        recorded.retain(|(_, curve)| curve.of.is_none_or(|of| of == form));
        recorded.sort_by_key(|(_, curve)| curve.place);
        for (_, curve) in &recorded {
            if rows.iter().all(|row| row.title != curve.panel) {
                rows.push(PageRow {
                    title: curve.panel,
                    ..PageRow::default()
                });
            }
        }
        let is = |what: fn(&System) -> bool| self.run().is_some_and(|run| what(&run.system));
        let mut panels = Vec::new();
        for row in rows.iter().filter(|row| row.of.is_none_or(|of| of == form)) {
            // Panels that repeat another one, or never change, are shown only on request.
            let tells = match row.title {
                "Speed of inertia" => is(|system| system.rotor.inertia.len() > 1 || system.stator.inertia.len() > 1),
                "Normal force" => !is(|system| matches!(system.pressing, Pressing::Force(Drive::Value(_)))),
                _ => true,
            };
            let own = recorded.iter().filter(|(_, curve)| curve.panel == row.title);
            let own = own.map(|(name, curve)| (*name, curve.legend, curve.colour));
            let curves: Vec<_> = own.chain(row.curves.iter().copied()).collect();
            match row.each {
                Some(what) => panels.extend(self.each(row.title, row.shown && tells, what)),
                None => panels.push(self.panel(row.title, row.shown && tells, &curves)),
            }
        }
        panels.retain(|panel| !panel.curves.is_empty());
        Ok(panels)
    }

    fn all_portraits(&self) -> Vec<PagePortrait> {
        let general = self.run().filter(|_| !self.short());
        // Heading, place, hint, and channel and label of both axes.
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
        let velocity = if general.is_some() { "{}" } else { "ωᵣ" };
        let (x, y) = (("relative_velocity", velocity), ("friction_torque", "torque"));
        let hint = "Torque through the interface by relative velocity, of the samples in view.";
        rows.push(("Friction", "portrait-friction", hint, x, y));
        let axis = |(name, label): (&str, &str)| PortraitAxis {
            name: name.to_owned(),
            label: self.said(label, name),
            jumps: name == "friction_torque",
        };
        let portraits = rows.iter().map(|&(heading, id, hint, x, y)| PagePortrait {
            id,
            heading,
            hint: self.said(hint, ""),
            x: axis(x),
            y: axis(y),
        });
        portraits.collect()
    }
}
