//! Another stick test: the candidate holds another torque against the limit of stick.

use super::evidence::Evidence;
use super::judge::EXPLAINED;
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal};
use crate::diagnosis::{CauseKind, limit_of};
use std::sync::Arc;
use stickslip_case::Motion;
use stickslip_system::model::BreakawayTest;

/// The torque that is compared with the limit of stick.
#[derive(Debug)]
pub(crate) struct StickTest(BreakawayTest);

impl Cause for StickTest {
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let system = &search.evidence.case.case().system;
        let tests = [BreakawayTest::Transmitted, BreakawayTest::Stator, BreakawayTest::Rotor].into_iter();
        // A surface without inertia has no torque of its own to test.
        let tests = tests.filter(|test| match test {
            BreakawayTest::Transmitted => true,
            BreakawayTest::Stator => !system.stator.inertia.is_empty(),
            BreakawayTest::Rotor => !system.rotor.inertia.is_empty(),
        });
        let others = tests.filter(|test| *test != system.breakaway_test);
        others.map(|test| -> Proposal { Arc::new(StickTest(test)) }).collect()
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        evidence.with(start, |system| system.breakaway_test = self.0)
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        EXPLAINED
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        1
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let physics = search.evidence.physics;
        let name = |test: BreakawayTest| match (test, physics.vocabulary().motion()) {
            (BreakawayTest::Transmitted, Motion::Rotation) => "T_f = (T_r + T_s)/2",
            (BreakawayTest::Stator, Motion::Rotation) => "the stator torque T_s",
            (BreakawayTest::Rotor, Motion::Rotation) => "the rotor torque T_r",
            (BreakawayTest::Transmitted, Motion::Translation) => "the transmitted force",
            (BreakawayTest::Stator, Motion::Translation) => "the stator's internal force",
            (BreakawayTest::Rotor, Motion::Translation) => "the rotor's internal force",
        };
        let (held, ours) = (name(self.0), name(physics.trains.breakaway_test));
        let words = format!(
            "it holds {held} against {}, where the reference tests {ours}",
            limit_of(physics)
        );
        (CauseKind::StickTest, words)
    }
}
