//! What of a page depends on its run, as data: which channels it has, how they are grouped, and what they are called. Everything
//! else on a page is the same for all.

use std::fmt::{self, Display};

use super::sparse::Sparse;
use crate::analysis::headline::{self, HeadlineRow, is_paper_case};
use crate::plot::html::escaped;
use crate::plot::{PlotError, Run};
use crate::record::{Event, State};
use crate::results::{ResultError, ResultFile, schema};

/// A channel before and after every event.
pub(super) type BothSides = (Vec<f64>, Vec<f64>);

/// A colour of the page's script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Colour {
    Blue,
    Vermillion,
    Green,
    Orange,
    Purple,
    Black,
}

impl Colour {
    pub(super) const ALL: [Colour; 6] = [
        Colour::Blue,
        Colour::Vermillion,
        Colour::Green,
        Colour::Orange,
        Colour::Purple,
        Colour::Black,
    ];
}

/// Its name in the script.
impl Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&format!("{self:?}").to_uppercase())
    }
}

/// A text of the script.
fn quoted(text: &str) -> String {
    crate::quote::in_json(&serde_json::Value::from(text).to_string(), |c| c == '<')
}

/// A channel in a panel.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curve {
    pub(super) channel: String,
    /// In the legend.
    pub(super) name: String,
    pub(super) colour: Colour,
    /// Drawn, but the panel's range does not follow it.
    pub(super) limit: bool,
}

impl Curve {
    pub(super) fn new(channel: &str, name: &str, colour: Colour) -> Curve {
        Curve {
            channel: channel.to_owned(),
            name: name.to_owned(),
            colour,
            limit: false,
        }
    }
}

impl Display for Curve {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "[{}, {}, {}", quoted(&self.channel), quoted(&self.name), self.colour)?;
        f.write_str(if self.limit { ", \"limit\"]" } else { "]" })
    }
}

/// Channels in common axes over time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Panel {
    pub(super) title: String,
    pub(super) curves: Vec<Curve>,
    /// From the beginning, and not only where it is chosen.
    pub(super) shown: bool,
    /// In a short view it counts from the left edge.
    pub(super) change: bool,
}

impl Panel {
    pub(super) fn new(title: &str, shown: bool, curves: Vec<Curve>) -> Panel {
        Panel {
            title: title.to_owned(),
            curves,
            shown,
            change: false,
        }
    }
}

/// A line of the script's list of panels.
impl Display for Panel {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let curves: Vec<String> = self.curves.iter().map(Curve::to_string).collect();
        let change = if self.change { ", change: true" } else { "" };
        let (title, curves, shown) = (quoted(&self.title), curves.join(", "), self.shown);
        writeln!(f, "  {{ title: {title}, curves: [{curves}], shown: {shown}{change} }},")
    }
}

/// A phase portrait of what is in view: a channel and its name for either axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Portrait {
    /// Of its place on the page.
    pub(super) id: &'static str,
    pub(super) heading: String,
    pub(super) hint: String,
    pub(super) x: (String, String),
    pub(super) y: (String, String),
    /// Whether y jumps where the mode changes.
    pub(super) jumps: bool,
}

impl Portrait {
    /// The place that it is drawn in.
    pub(super) fn card(&self) -> String {
        card(&self.heading, self.id, &self.hint)
    }
}

/// A line of the script's list of portraits.
impl Display for Portrait {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let axis = |(channel, label): &(String, String)| format!("name: {}, label: {}", quoted(channel), quoted(label));
        let jumps = if self.jumps { ", jumps: true" } else { "" };
        writeln!(
            f,
            "  new Portrait(byId(\"{}\"), trajectory, source.modes, {{ {} }}, {{ {}{jumps} }}),",
            self.id,
            axis(&self.x),
            axis(&self.y)
        )
    }
}

/// A small figure with a heading, and what it shows.
pub(super) fn card(heading: &str, id: &str, hint: &str) -> String {
    format!(
        "<section class=\"card\"><h2>{}</h2><div class=\"figure\" id=\"{id}\"></div><p class=\"hint\">{}</p></section>\n",
        escaped(heading),
        escaped(hint)
    )
}

/// The parts of a page that depend on its run.
#[derive(Debug)]
pub(super) struct Form {
    /// The file once more, as figures need it; a case that this version cannot read costs the page two numbers and what is derived
    /// from it, not more.
    pub(super) run: Option<Box<Run>>,
    /// The columns of the trajectory that the page has, in the order of the file.
    pub(super) variables: Vec<schema::Variable>,
    pub(super) panels: Vec<Panel>,
    pub(super) portraits: Vec<Portrait>,
    /// mu_0 r, m: the contact force times this is the torque that stick can carry; `None` of a contact without stick.
    pub(super) breakaway_arm: Option<f64>,
    /// Of what the interface transmits, UDUNITS.
    pub(super) torque_unit: &'static str,
    /// Further buttons, as they stand in the page.
    pub(super) buttons: &'static str,
    /// Small figures before the portraits, and tables, as they stand in the page.
    pub(super) cards: String,
    pub(super) tables: &'static str,
    /// A further script.
    pub(super) script: &'static str,
    /// The time from which on every sample is on the page, whatever its length, s: the last period of a motion that repeats
    /// itself.
    pub(super) whole_from: Option<f64>,
}

impl Form {
    pub(super) fn has(&self, channel: &str) -> bool {
        self.variables.iter().any(|variable| variable.name == channel)
    }

    /// What the case and the events come to in words.
    pub(super) fn headline(&self, file: &ResultFile, events: &[Event]) -> Result<Vec<HeadlineRow>, ResultError> {
        let case = self.run.as_ref().map(|run| &run.case);
        headline::of_file(file, case, events)
    }

    /// Whether the paper's numbers stand beside those of the run.
    pub(super) fn is_beside_paper(&self) -> bool {
        self.run.as_ref().is_some_and(|run| is_paper_case(&run.case))
    }

    /// What stands for a name in double braces in the page and its scripts.
    pub(super) fn part(&self, name: &str) -> Option<String> {
        Some(match name {
            "panels" => self.panels.iter().map(Panel::to_string).collect(),
            "portraits" => self.portraits.iter().map(Portrait::to_string).collect(),
            "buttons" => self.buttons.to_owned(),
            "cards" => {
                let portraits: String = self.portraits.iter().map(Portrait::card).collect();
                format!("{}{portraits}", self.cards)
            }
            "tables" => self.tables.to_owned(),
            "further" => self.script.to_owned(),
            _ => return None,
        })
    }

    /// T_n, s; `None` of what does not stop.
    pub(super) fn natural_period(&self) -> Option<f64> {
        self.run.as_ref().filter(|run| run.stops())?.natural_period
    }

    /// Stretches with too few samples.
    pub(super) fn sparse(&self) -> Result<Sparse, PlotError> {
        self.run
            .as_ref()
            .map_or_else(|| Ok(Sparse::default()), |run| Sparse::of(run))
    }

    /// The channels that are known on both sides of every event, those of every run first.
    pub(super) fn at_events(&self) -> Result<Vec<String>, PlotError> {
        let is_state = |name: &str| State::DESCRIPTIONS.iter().any(|state| state.0 == name);
        let states = State::DESCRIPTIONS.iter().map(|state| state.0.to_owned());
        let mut names: Vec<String> = states.filter(|name| self.has(name)).collect();
        if let Some(run) = &self.run {
            for variable in self.variables.iter().filter(|variable| !is_state(&variable.name)) {
                if run.at_events(&variable.name)?.is_some() {
                    names.push(variable.name.clone());
                }
            }
        }
        Ok(names)
    }

    /// A channel before and after every event, if it is known there: as the file has it, or by the equations.
    pub(super) fn sides(&self, file: &ResultFile, name: &str) -> Result<Option<BothSides>, PlotError> {
        match &self.run {
            Some(run) => Ok(run
                .at_events(name)?
                .map(|sides| (sides.before.clone(), sides.after.clone()))),
            None if State::DESCRIPTIONS.iter().any(|state| state.0 == name) => Ok(Some((
                file.event_column(&format!("{name}_before"))?,
                file.event_column(&format!("{name}_after"))?,
            ))),
            None => Ok(None),
        }
    }
}
