//! What the page of a brake has: its channels, how they are grouped, and what they are called.

use super::form::{Colour, Curve, Form, FormCase, Panel, Portrait};
use crate::case::Case;
use crate::model::torsion::TorsionModel;
use crate::plot::Run;
use crate::results::schema;

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

/// The form of a file of a brake.
pub(super) fn form(case: Option<(Case, Run)>) -> Form {
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
    let arm = case
        .as_ref()
        .map(|(case, _)| TorsionModel::new(&case.parameters).breakaway_torque(1.0));
    Form {
        case: FormCase::Brake(case.map(|(case, run)| (Box::new(case), Box::new(run)))),
        variables: variables.filter(|v| OF_BRAKE.contains(&v.name.as_str())).collect(),
        panels,
        portraits,
        breakaway_arm: arm,
        torque_unit: "N m",
        buttons: "",
        cards: String::new(),
        tables: "",
        script: "",
        whole_from: None,
    }
}
