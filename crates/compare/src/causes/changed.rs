//! Another system than the case's: its kicks, its stick test, or its state at the beginning.

use super::clock;
use super::evidence::{Evidence, TrialStart};
use super::fit::fitted;
use super::judge::{ALL, EXPLAINED, Judged};
use super::kick::{self, OtherKick};
use super::motion::Played;
use super::search::{Search, Tried};
use super::{Cause, Causes, Proposal, proposals};
use crate::diagnosis::{CauseKind, limit_of, percent};
use stickslip_case::Motion;
use stickslip_engine::workers::over_processors;
use stickslip_system::model::system::KickSide;
use stickslip_system::model::{BreakawayTest, KickTime};

/// A change of the system.
#[derive(Debug, PartialEq)]
pub(crate) enum ChangedSystem {
    /// The reference is kicked, the candidate is not. Judged up to a time (s), if there is one: behind an onset without
    /// a kick the motion is amplified rounding, which no run repeats.
    NoKick(Option<f64>),
    /// The kicks act on another surface.
    KickOn(KickSide),
    /// The kick of a number comes at a time, and not at the reference's, s.
    KickAt(usize, f64, f64),
    /// Another torque is compared with the limit of stick.
    StickTest(BreakawayTest),
    /// The candidate's own first state.
    State,
}

/// Times of a kick on each side of the reference's that are tried, in natural periods, and how many of them are fitted.
const TRIED: i32 = 12;
const APART: f64 = 0.25;
const FITTED: usize = 3;

impl ChangedSystem {
    /// A run without the kick up to the onset of the reference, if the candidate may not be kicked. A motion
    /// with the same events at other times is kicked.
    pub fn unkicked_up_to_onset(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let Some(kicked) = evidence.kicked.filter(|_| evidence.observation.is_some()) else {
            return Vec::new();
        };
        // A brake that stops before the kick does not show it.
        let first = evidence.word.first().map_or(f64::INFINITY, |event| event.time);
        let seen = search.jumped.is_none() || search.other_kick.as_ref().is_some_and(OtherKick::is_absent);
        let is_clock = search.causes().any(|tried| tried.cause.is_of_file())
            || clock::is_moved(evidence.reference, evidence.word, evidence.period);
        let onset = search.onset.filter(|_| seen && first > kicked && !is_clock);
        proposals(onset.map(|until| ChangedSystem::NoKick(Some(until))))
    }

    /// Times at which the candidate parts from the motion without kicks, and near the reference's kick, fitted.
    pub fn kick_times(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let Some(seen) = evidence.observation else {
            return Vec::new();
        };
        let kicks = evidence.case.case().system.kicks.iter().enumerate();
        let kicks = kicks.filter_map(|(number, kick)| Some((number, *kick.time.at()?)));
        let starts = search.starts();
        let mut found = Vec::new();
        for ((number, own), &start) in kicks.flat_map(|kick| starts.iter().map(move |start| (kick, start))) {
            let run =
                |time: f64, until: f64| ChangedSystem::KickAt(number, time, own).run(&evidence.until(until), start);
            let unkicked = ChangedSystem::NoKick(None).run(evidence, start);
            let parts = unkicked.and_then(|played| seen.time.get(seen.close(&played.values, evidence.least)).copied());
            let near = (-TRIED..=TRIED).map(|k| own + f64::from(k) * APART * evidence.period);
            let begin: Vec<f64> = near.chain(parts).collect();
            let left = over_processors(begin.len(), &|| false, |k| {
                Some((
                    evidence.judged(&run(begin[k], f64::INFINITY)?, f64::INFINITY)?.left,
                    begin[k],
                ))
            });
            let mut left: Vec<(f64, f64)> = left.into_iter().flatten().collect();
            left.sort_by(|a, b| a.0.total_cmp(&b.0));
            left.truncate(FITTED);
            let times = over_processors(left.len(), &|| false, |k| {
                fitted(evidence, left[k].1, APART * evidence.period, &run)
            });
            let times = times.into_iter().flatten().filter(|time| *time != own);
            found.extend(times.map(|time| ChangedSystem::KickAt(number, time, own)));
        }
        proposals(found)
    }
}

impl Cause for ChangedSystem {
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let system = &search.evidence.case.case().system;
        let unkicked = (!system.kicks.is_empty()).then_some(ChangedSystem::NoKick(None));
        let sides = [KickSide::Both, KickSide::Rotor, KickSide::Stator].into_iter();
        let sides = sides.filter(|side| system.kicks.iter().any(|kick| kick.on != *side));
        let tests = [BreakawayTest::Transmitted, BreakawayTest::Stator, BreakawayTest::Rotor].into_iter();
        // A surface without inertia has no torque of its own to test.
        let tests = tests.filter(|test| match test {
            BreakawayTest::Transmitted => true,
            BreakawayTest::Stator => !system.stator.inertia.is_empty(),
            BreakawayTest::Rotor => !system.rotor.inertia.is_empty(),
        });
        let tests = tests.filter(|test| *test != system.breakaway_test);
        let all = unkicked.into_iter().chain(sides.map(ChangedSystem::KickOn));
        proposals(
            all.chain(tests.map(ChangedSystem::StickTest))
                .chain([ChangedSystem::State]),
        )
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        if self.is_state() && matches!(evidence.starts.get(start)?, TrialStart::Case) {
            return None;
        }
        evidence.with(start, |system| match self {
            ChangedSystem::NoKick(_) => system.kicks.clear(),
            ChangedSystem::KickOn(side) => system.kicks.iter_mut().for_each(|kick| kick.on = *side),
            ChangedSystem::KickAt(number, time, _) => system.kicks[*number].time = KickTime::At(*time),
            ChangedSystem::StickTest(test) => system.breakaway_test = *test,
            ChangedSystem::State => {}
        })
    }

    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        let until = match self {
            ChangedSystem::NoKick(until) => *until,
            _ => None,
        };
        evidence.judged(played, until.unwrap_or(f64::INFINITY))
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        match self {
            ChangedSystem::KickAt(..) => 1.0 - ALL,
            _ => EXPLAINED,
        }
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        match self {
            ChangedSystem::NoKick(_) | ChangedSystem::KickOn(_) => 0,
            ChangedSystem::KickAt(..) | ChangedSystem::StickTest(_) => 1,
            ChangedSystem::State => 4,
        }
    }

    fn is_state(&self) -> bool {
        *self == ChangedSystem::State
    }

    fn is_certain(&self, _: &Evidence<'_>, _: &Judged) -> bool {
        matches!(self, ChangedSystem::NoKick(Some(_)))
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
        match self {
            ChangedSystem::NoKick(_) => {
                let words = "the reference is kicked, the candidate is not";
                (CauseKind::UnperturbedRun, words.to_owned())
            }
            ChangedSystem::KickOn(side) => {
                let on = match side {
                    KickSide::Both => "both surfaces",
                    KickSide::Rotor => "the rotor's surface alone",
                    KickSide::Stator => "the stator's surface alone",
                };
                (CauseKind::AnotherKick, format!("its kick acts on {on}"))
            }
            ChangedSystem::KickAt(_, time, own) => {
                let words = format!("its kick comes at {time:.6} s, and not at {own:.6} s");
                (CauseKind::AnotherKick, words)
            }
            ChangedSystem::StickTest(test) => {
                let (held, ours) = (name(*test), name(physics.trains.breakaway_test));
                let words = format!(
                    "it holds {held} against {}, where the reference tests {ours}",
                    limit_of(physics)
                );
                (CauseKind::StickTest, words)
            }
            ChangedSystem::State => (CauseKind::AnotherState, "it begins in another state".to_owned()),
        }
    }

    /// A state behind a kick that differs is another kick.
    fn report(&self, search: &Search<'_>, all: &[Tried], causes: &mut Causes) -> (CauseKind, String) {
        let shown = match self {
            ChangedSystem::KickOn(_) | ChangedSystem::State => kick::shown(search, &all[0], causes),
            _ => None,
        };
        let (kind, words) = shown.unwrap_or_else(|| self.words(search));
        let outcome = match self {
            ChangedSystem::NoKick(Some(_)) => format!(
                "; a run without the kick explains {} % of the squared difference of its samples up to the first event of the \
                 reference, and from its onset on it is amplified rounding",
                percent(all[0].judged.explained)
            ),
            _ => format!(": {}", search.outcome(&all[0])),
        };
        (kind, words + &outcome)
    }
}
