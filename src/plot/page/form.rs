//! What of a page depends on the form of its file, the brake's or that of trains, as data: which channels it has, how they
//! are grouped, and what they are called. Everything else on a page is the same for all.

use std::fmt::{self, Display};

use super::trains;
use crate::analysis::Headline;
use crate::analysis::headline::{HeadlineRow, is_paper_case};
use crate::case::{Case, CaseSource, TrainCase};
use crate::model::torsion::TorsionModel;
use crate::plot::{PlotError, Run};
use crate::record::{Event, State};
use crate::results::{ResultError, ResultFile, schema};

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
        f.write_str(match self {
            Colour::Blue => "BLUE",
            Colour::Vermillion => "VERMILLION",
            Colour::Green => "GREEN",
            Colour::Orange => "ORANGE",
            Colour::Purple => "PURPLE",
            Colour::Black => "BLACK",
        })
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
            "  new Portrait(byId(\"{}\"), trajectory, run.modes, {{ {} }}, {{ {}{jumps} }}),",
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
        super::escape(heading),
        super::escape(hint)
    )
}

/// The case of a file.
#[derive(Debug)]
pub(super) enum FormCase {
    /// Of a brake; a case that this version cannot read costs the page two numbers, not more.
    Brake(Option<Box<Case>>),
    Trains {
        case: Box<TrainCase>,
        /// The file once more, as figures need it.
        run: Box<Run>,
    },
}

/// The parts of a page that depend on the form of its file.
#[derive(Debug)]
pub(super) struct Form {
    pub(super) case: FormCase,
    /// The columns of the trajectory that the page has, in the order of the file.
    pub(super) variables: Vec<schema::Variable>,
    pub(super) panels: Vec<Panel>,
    pub(super) portraits: Vec<Portrait>,
    /// Of what the interface transmits, UDUNITS.
    pub(super) torque_unit: &'static str,
    /// Grounds of modes beyond the brake's, as they stand in the script.
    pub(super) shades: &'static str,
    /// Buttons beyond the brake's, as they stand in the page.
    pub(super) buttons: &'static str,
    /// Small figures before the portraits, and tables, as they stand in the page.
    pub(super) cards: String,
    pub(super) tables: &'static str,
    /// A script beyond the brake's.
    pub(super) script: &'static str,
    /// The time from which on every sample is on the page, whatever its length, s: the last period of a motion that repeats
    /// itself.
    pub(super) whole_from: Option<f64>,
}

impl Form {
    /// Of a file.
    ///
    /// # Errors
    /// If it cannot be read, or is of trains with a case that this version cannot read.
    pub(super) fn of(file: &ResultFile) -> Result<Form, PlotError> {
        let source = CaseSource::result(file.path(), file.resolved()?);
        if TrainCase::is_one(&source, &[]) {
            let case = TrainCase::parse(&source, &[])?;
            return trains::form(case, Run::open(file.path())?);
        }
        Ok(brake(Case::parse(&source, &[]).ok()))
    }

    pub(super) fn has(&self, channel: &str) -> bool {
        self.variables.iter().any(|variable| variable.name == channel)
    }

    /// What the case and the events come to in words; and T_n, s, where there is one.
    pub(super) fn headline(
        &self,
        file: &ResultFile,
        events: &[Event],
    ) -> Result<(Vec<HeadlineRow>, Option<f64>), ResultError> {
        match &self.case {
            FormCase::Brake(case) => {
                let headline = Headline::of_file(file, case.as_deref(), events)?;
                Ok((headline.rows(), headline.natural_period))
            }
            FormCase::Trains { case, .. } => {
                let rows = crate::analysis::trains::headline::of_file(file, case, events)?;
                Ok((rows, None))
            }
        }
    }

    /// mu_0 r, m: the contact force times this is the torque that stick can carry.
    pub(super) fn breakaway_arm(&self) -> Option<f64> {
        match &self.case {
            FormCase::Brake(case) => {
                let case = case.as_ref()?;
                Some(TorsionModel::new(&case.parameters).breakaway_torque(1.0))
            }
            FormCase::Trains { case, .. } => trains::breakaway_arm(&case.parameters),
        }
    }

    /// Whether the paper's numbers stand beside those of the run.
    pub(super) fn is_beside_paper(&self) -> bool {
        match &self.case {
            FormCase::Brake(case) => case.as_ref().is_some_and(|case| is_paper_case(&case.parameters)),
            FormCase::Trains { .. } => false,
        }
    }

    /// What stands for a name in double braces in the page and its scripts.
    pub(super) fn part(&self, name: &str) -> Option<String> {
        Some(match name {
            "panels" => self.panels.iter().map(Panel::to_string).collect(),
            "portraits" => self.portraits.iter().map(Portrait::to_string).collect(),
            "torque" => self.torque_unit.to_owned(),
            "shades" => self.shades.to_owned(),
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

    /// The channels that events have on both sides, those of every run first: its name, and whether [`State`] has it.
    pub(super) fn at_events(&self) -> Vec<(String, bool)> {
        let is_state = |name: &str| State::DESCRIPTIONS.iter().any(|state| state.0 == name);
        let further = match &self.case {
            FormCase::Brake(_) => Vec::new(),
            FormCase::Trains { case, .. } => crate::simulation::trains::further(&case.parameters),
        };
        let names = State::DESCRIPTIONS.iter().map(|state| state.0.to_owned());
        names
            .chain(further.into_iter().map(|one| one.name))
            .filter(|name| self.has(name))
            .map(|name| (is_state(&name), name))
            .map(|(is_state, name)| (name, is_state))
            .collect()
    }
}

/// The columns of a brake's trajectory that its page has.
const OF_BRAKE: [&str; 19] = [
    "theta_dot",
    "phi1_dot",
    "phi2_dot",
    "relative_velocity",
    "rotor_twist",
    "rotor_twist_rate",
    "phi1",
    "slip_displacement",
    "z",
    "applied_force",
    "normal_force",
    "friction_torque",
    "transmitted_torque",
    "energy_kinetic",
    "energy_elastic",
    "work_applied",
    "dissipated_friction",
    "dissipated_damping",
    "energy_residual",
];

fn brake(case: Option<Case>) -> Form {
    use Colour::{Blue, Green, Orange, Purple, Vermillion};
    let curve = |channel: &str, name: &str, colour: Colour| Curve::new(channel, name, colour);
    let energies = vec![
        curve("energy_kinetic", "kinetic", Blue),
        curve("energy_elastic", "elastic", Orange),
        curve("dissipated_friction", "lost to friction", Vermillion),
        curve("dissipated_damping", "lost to damping", Green),
        curve("work_applied", "work of F", Purple),
    ];
    let torques = vec![
        curve("friction_torque", "through the interface", Blue),
        curve("transmitted_torque", "T_f = (T_r + T_s)/2", Vermillion),
        curve("breakaway_torque", "limit μ₀ r F_n", Purple),
        Curve {
            limit: true,
            ..curve("breakaway_torque_backward", "−μ₀ r F_n", Purple)
        },
    ];
    let panels = vec![
        Panel::new(
            "Speed",
            true,
            vec![
                curve("theta_dot", "rotor", Blue),
                curve("phi2_dot", "rotor surface", Vermillion),
                curve("phi1_dot", "stator surface", Green),
            ],
        ),
        Panel::new(
            "Relative velocity",
            true,
            vec![curve("relative_velocity", "φ₂′ − φ₁′", Blue)],
        ),
        Panel::new(
            "Twist",
            true,
            vec![
                curve("rotor_twist", "rotor, θ − φ₂", Blue),
                curve("phi1", "stator, φ₁", Vermillion),
            ],
        ),
        Panel::new("Torque", true, torques),
        Panel {
            change: true,
            ..Panel::new("Energy", true, energies)
        },
        Panel::new(
            "Energy residual",
            false,
            vec![curve("energy_residual", "made or lost by the solver", Blue)],
        ),
        Panel::new(
            "Twist rate",
            false,
            vec![
                curve("rotor_twist_rate", "rotor", Blue),
                curve("phi1_dot", "stator", Vermillion),
            ],
        ),
        Panel::new(
            "Axial force",
            false,
            vec![
                curve("applied_force", "applied, F", Blue),
                curve("normal_force", "contact, F_n", Vermillion),
            ],
        ),
        Panel::new("Axial displacement", false, vec![curve("z", "z", Blue)]),
        Panel::new(
            "Slip displacement",
            false,
            vec![curve("slip_displacement", "φ₂ − φ₁", Blue)],
        ),
    ];
    let axis = |channel: &str, label: &str| (channel.to_owned(), label.to_owned());
    let portraits = vec![
        Portrait {
            id: "portrait-stator",
            heading: "Stator surface".to_owned(),
            hint: "Phase portrait of the samples in view: vermilion in stick, blue in slip.".to_owned(),
            x: axis("phi1", "φ₁"),
            y: axis("phi1_dot", "φ₁′"),
            jumps: false,
        },
        Portrait {
            id: "portrait-rotor",
            heading: "Rotor twist".to_owned(),
            hint: "Phase portrait of the samples in view.".to_owned(),
            x: axis("rotor_twist", "θ − φ₂"),
            y: axis("rotor_twist_rate", "θ′ − φ₂′"),
            jumps: false,
        },
        Portrait {
            id: "portrait-friction",
            heading: "Friction".to_owned(),
            hint: "Torque through the interface by relative velocity, of the samples in view.".to_owned(),
            x: axis("relative_velocity", "ω_r"),
            y: axis("friction_torque", "torque"),
            jumps: true,
        },
    ];
    let variables = schema::trajectory().variables.into_iter();
    Form {
        case: FormCase::Brake(case.map(Box::new)),
        variables: variables.filter(|v| OF_BRAKE.contains(&v.name.as_str())).collect(),
        panels,
        portraits,
        torque_unit: "N m",
        shades: "",
        buttons: "",
        cards: String::new(),
        tables: "",
        script: "",
        whole_from: None,
    }
}
