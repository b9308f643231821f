//! The values of the keys of the schema: what the short form has, and what the general form shares with it.

use crate::friction::{Exponential, Friction, Parameters as _};
use crate::model::{Axial, BreakawayTest, Contact, Initial, Parameters, Torsion};
use crate::signal::{Profile, Ramp, Signal};
use crate::simulation::{Following, OutputOptions, SolverOptions};

/// A case as the keys of the schema say it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Draft {
    pub(super) title: String,
    /// Two disks, SI. Of the general form only what it shares with the short one.
    pub(super) parameters: Parameters,
    pub(super) solver: SolverOptions,
    pub(super) output: OutputOptions,
}

impl Draft {
    /// The defaults of the schema, and NaN for what has none.
    pub(super) fn blank(title: String) -> Draft {
        Draft {
            title,
            parameters: Parameters {
                axial: Axial {
                    mass: f64::NAN,
                    stiffness: f64::NAN,
                    damping: f64::NAN,
                    ringing_floor: Axial::RINGING_FLOOR,
                },
                actuation: Signal::Ramp(Ramp::blank()),
                torsion: Torsion {
                    rotor_inertia: f64::NAN,
                    surface_inertia: f64::NAN,
                    stiffness: f64::NAN,
                    damping: f64::NAN,
                },
                contact: Contact {
                    radius: f64::NAN,
                    breakaway_test: BreakawayTest::default(),
                },
                friction: Friction {
                    breakaway: f64::NAN,
                    law: Exponential::unset().into(),
                },
                initial: Initial { speed: f64::NAN },
                perturbations: Vec::new(),
            },
            solver: SolverOptions::default(),
            output: OutputOptions {
                end_time: 10.0,
                interval: f64::NAN,
                windows: Vec::new(),
                steps: false,
                follow: Following::default(),
            },
        }
    }
}
