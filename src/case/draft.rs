//! The values of the keys of the schema: what the short form has, and what the general form shares with it.

use super::Case;
use super::words::Words;
use crate::friction::{Exponential, Friction, Parameters as _};
use crate::model::trains::Pressing;
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

    /// The keys of a case that are keys of the schema.
    pub(super) fn of(case: &Case) -> Draft {
        let mut draft = Draft::blank(case.title.clone());
        let system = &case.system;
        match Parameters::of(system) {
            Some(disks) if case.words.short => draft.parameters = disks,
            _ => {
                let shared = &mut draft.parameters;
                if let Pressing::Axial { axial, actuation } = &system.pressing {
                    shared.axial = *axial;
                    shared.actuation = actuation.clone();
                }
                shared.contact = Contact {
                    radius: system.radius,
                    breakaway_test: system.breakaway_test,
                };
                shared.friction = Friction {
                    breakaway: system.breakaway,
                    law: system.law.clone(),
                };
            }
        }
        draft.solver = case.solver.clone();
        draft.output = case.output.clone();
        draft
    }

    /// Of a case in the short form; `None` of another.
    pub(super) fn short(case: &Case) -> Option<Draft> {
        (case.words.short && Parameters::of(&case.system).is_some()).then(|| Draft::of(case))
    }

    /// The case of the short form.
    pub(super) fn into_case(self) -> Case {
        Case {
            title: self.title,
            system: (&self.parameters).into(),
            words: Words::SHORT,
            threshold: 0.0,
            solver: self.solver,
            output: self.output,
        }
    }
}
