//! A smooth function that replaces the sign of the sliding speed, so that the candidate creeps in stick.

use super::creep::{Creep, SHAPES};
use super::evidence::Evidence;
use super::fit::fitted;
use super::judge::{ALL, EXACT, Judged};
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal, stepper};
use crate::Channel;
use crate::diagnosis::CauseKind;
use std::sync::Arc;
use stickslip_engine::workers::over_processors;
use stickslip_system::model::system::{ContactLaw, Regularisation};

/// Initial speeds, in parts of slip speeds.
const SPEEDS: [f64; 3] = [1e-5, 1e-3, 3e-2];
/// Most steps of a run: a smooth law takes many in a stick.
const MOST_STEPS: usize = 300_000;

/// A function of [`SHAPES`] with its speed, rad/s.
#[derive(Debug)]
pub(crate) struct Smooth {
    shape: usize,
    speed: f64,
    /// The candidate shows it by its creep.
    told: bool,
}

impl Smooth {
    /// The function that the candidate's creep follows.
    pub fn shown(search: &Search<'_>) -> Vec<Proposal> {
        let shown = |Creep { shape, speed, .. }| -> Proposal {
            Arc::new(Smooth {
                shape,
                speed,
                told: true,
            })
        };
        search.symptoms.creep.map(shown).into_iter().collect()
    }

    fn motion(&self, evidence: &Evidence<'_>, start: usize, most_steps: Option<usize>) -> Option<Played> {
        let (shape, speed) = (self.shape, self.speed);
        let Some(function) = SHAPES[shape].smoothing else {
            let (time, state) = evidence.origin.as_ref()?;
            evidence.count_run()?;
            return stepper::creeping(evidence.physics, (shape, speed), (*time, state), evidence.observation?);
        };
        let mut system = evidence.case.case().system.clone();
        system.contact = ContactLaw::Regularised(Regularisation { function, speed });
        evidence.motion_within(most_steps, &system, 10.0 * speed, evidence.starts.get(start)?)
    }
}

impl Cause for Smooth {
    /// Functions that a case can have, each with the speed that brings the motion closest to the candidate.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        if !evidence.physics.sticks() || evidence.observation.is_none() {
            return Vec::new();
        }
        let speed = evidence.physics.speed();
        let shapes = (0..SHAPES.len()).filter(|&shape| SHAPES[shape].smoothing.is_some());
        let starts = 0..evidence.starts.len();
        let begin: Vec<(usize, usize, f64)> = shapes
            .flat_map(|shape| starts.clone().map(move |start| (shape, start)))
            .flat_map(|(shape, start)| SPEEDS.map(|part| (shape, start, part * speed)))
            .collect();
        let found = over_processors(begin.len(), &|| false, |k| {
            let (shape, start, begin) = begin[k];
            let of = |speed: f64| Smooth {
                shape,
                speed: speed.abs(),
                told: false,
            };
            let play = |speed: f64| of(speed).motion(evidence, start, evidence.most_steps);
            let near = evidence.projected(begin, 1, &play)?;
            let cause: Proposal = Arc::new(of(fitted(evidence, near, near, &play)?));
            Some(cause)
        });
        found.into_iter().flatten().collect()
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        self.motion(evidence, start, Some(MOST_STEPS))
    }

    /// By samples, if there are any: creep that is never at rest has no events.
    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        let judged = evidence.judged(played, f64::INFINITY)?;
        Some(if evidence.observation.is_some() {
            judged.by_samples()
        } else {
            judged
        })
    }

    /// One smooth function is much like another.
    fn least(&self, _: &Evidence<'_>) -> f64 {
        if self.told { 1.0 - ALL } else { EXACT }
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        2
    }

    fn is_told(&self) -> bool {
        self.told
    }

    fn has_events(&self, judged: &Judged) -> bool {
        judged.after.unmatched == 0
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let unit = search.evidence.physics.vocabulary().unit(Channel::RELATIVE_VELOCITY);
        let words = format!(
            "its friction has {} in the place of the sign, eps = {:.2e} {unit}",
            SHAPES[self.shape].name, self.speed
        );
        (CauseKind::RegularisedLaw, words)
    }
}
