//! The short form of a case, `[torsion]`: two disks.

use super::document::Node;
use super::draft::Draft;
use super::reader::{Read, Reader};
use super::{Case, CaseError, CaseSource, Motion, Problem, Words, conditions, schema};
use crate::friction::Friction;
use crate::model::system::Pressing;
use crate::model::{Contact, Parameters};

/// Reads the short form; the overrides are in the tree, and what is wrong with them is in `problems`.
pub(super) fn read(source: &CaseSource, root: Node, problems: Vec<(usize, Problem)>) -> Result<Read, CaseError> {
    let known = schema::keys().iter().map(|key| key.path).collect();
    let mut reader = Reader::new(root, source.label(), problems, known, Motion::Rotation);
    reader.check_names();
    let mut draft = Draft::blank(source.name());
    reader.fill_keys(&mut draft, |_| true);
    reader.contact(&mut draft);
    reader.fill_output(&mut draft, &source.origin);
    // Conditions between values mean nothing while some are missing.
    if reader.problems.is_empty() {
        for violation in conditions::of_short_form(&draft) {
            reader.report_violation(violation);
        }
    }
    reader.finish(Some(Case {
        title: draft.title,
        system: (&draft.parameters).into(),
        words: Words::SHORT,
        threshold: 0.0,
        solver: draft.solver,
        output: draft.output,
    }))
}

impl Draft {
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
}
