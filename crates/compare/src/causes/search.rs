//! The search: causes are tried in their order, and those that reproduce the candidate equally well are kept.

use super::evidence::{Evidence, TrialStart};
use super::judge::{ALL, CLOSE, EXACT, Judged};
use super::kick::{Jumped, OtherKick};
use super::number::ChangedNumber;
use super::{ORDER, Proposal, Shown};
use crate::Reference;
use crate::diagnosis::percent;
use std::sync::atomic::{AtomicUsize, Ordering};
use stickslip_engine::workers::over_processors;

/// A mistake that was tried, from the start with which it explains most.
#[derive(Debug, Clone)]
pub(crate) struct Tried {
    pub cause: Proposal,
    pub start: usize,
    /// The run begins in the candidate's own state.
    pub own_state: bool,
    /// Number of samples up to which the motion is close to the candidate.
    pub close: usize,
    pub judged: Judged,
}

impl Tried {
    pub fn is_cause(&self, evidence: &Evidence<'_>) -> bool {
        self.judged.is_cause() && self.judged.explained >= self.cause.least(evidence)
    }
}

/// A search for the causes of a difference.
pub(crate) struct Search<'a> {
    pub evidence: &'a Evidence<'a>,
    pub reference: &'a Reference,
    pub shown: &'a Shown<'a>,
    /// mu_0 by the torque at which the candidate's sticks end.
    pub breakaway: Option<f64>,
    /// Time of the reference's first event, s.
    pub onset: Option<f64>,
    /// States of the candidate at the reference's kick, if it shows them, and its kick if it is another.
    pub jumped: Option<&'a Jumped>,
    pub other_kick: Option<OtherKick>,
    /// Solvers with steps may have made the candidate.
    pub with_steps: bool,
    /// The candidate's first state may be another than the reference's.
    pub with_state: bool,
    pub watch: &'a (dyn Fn(usize, usize) + Sync),
    /// Numbers of mistakes that were tried, and that are to be tried so far.
    pub counts: [AtomicUsize; 2],
    pub tried: Vec<Tried>,
    /// Mistakes were not tried, because the samples are too few for their values.
    pub too_few_samples: bool,
}

/// Result of a search.
#[derive(Debug)]
pub(crate) enum FoundCauses {
    /// Mistakes that reproduce the candidate equally well, the simplest first.
    Causes(Vec<Tried>),
    /// No mistake, or two pairs of parameters equally well. The mistakes that were tried, the closest first.
    Unexplained(Vec<Tried>),
}

/// The candidate departs from the reference at the first difference above this part of the largest; natural periods
/// beyond that in which another motion shows what it explains.
const DEPARTS: f64 = 0.1;
const BEYOND: f64 = 2.0;

/// Share that another initial state explains if runs from the candidate's own state include this cause.
const MUCH: f64 = 0.5;

fn closest_first(tried: &mut [Tried]) {
    tried.sort_by(|a, b| a.judged.left.total_cmp(&b.judged.left));
}

impl Search<'_> {
    pub fn causes(&self) -> impl Iterator<Item = &Tried> {
        self.tried.iter().filter(|tried| tried.is_cause(self.evidence))
    }

    pub fn has_cause(&self) -> bool {
        self.causes()
            .any(|tried| self.evidence.is_visible(tried.cause.numbers()))
    }

    /// Whether the equations that the samples satisfy show a parameter that is a cause.
    pub fn has_told(&self) -> bool {
        let is_number = |tried: &Tried| !tried.cause.numbers().is_empty() && tried.judged.is_cause();
        self.tried.iter().any(|tried| is_number(tried) && tried.cause.is_told())
    }

    /// Whether another initial state explains much.
    pub fn has_state(&self) -> bool {
        let mut tried = self.tried.iter();
        tried.any(|tried| tried.cause.is_state() && tried.judged.explained >= MUCH)
    }

    /// Whether a mistake other than another initial state leaves nothing that events in samples would show.
    pub fn explains_all(&self) -> bool {
        let is_all = |tried: &Tried| tried.judged.is_cause() && tried.judged.explained >= 1.0 - ALL;
        self.tried.iter().any(|tried| is_all(tried) && !tried.cause.is_state())
    }

    /// Whether a mistake leaves nothing, so that no solver with steps is needed. If each event is late, the first may
    /// cause nearly all of the difference.
    pub fn has_exact(&self) -> bool {
        let mut exact = self.causes().filter(|tried| tried.judged.explained >= EXACT);
        exact.any(|tried| !tried.cause.is_like_steps())
    }

    pub fn lacks_cause(&self) -> bool {
        !self.has_told() && !self.explains_all()
    }

    /// Whether parameters are to be fitted: not if the equations show one, or if the candidate begins later in a state
    /// of its own, which does not show initial values.
    pub fn lacks_number(&self) -> bool {
        let from_start = self.evidence.first.as_ref();
        let from_start = from_start.is_none_or(|(time, _)| *time <= self.evidence.begins);
        !(self.has_told() || self.has_state() && !from_start)
    }

    /// The starts at which runs of a mistake of the case may begin.
    pub fn starts(&self) -> Vec<usize> {
        let evidence = self.evidence;
        let is_own = |start: usize| matches!(evidence.starts[start], TrialStart::At(..));
        let is_left_out = |start: usize| self.has_state() && is_own(start) || evidence.is_other_state(start);
        (0..evidence.starts.len())
            .filter(|&start| !is_left_out(start))
            .collect()
    }

    fn try_one(evidence: &Evidence<'_>, cause: &Proposal) -> Option<Tried> {
        let has_own_state = cause.stepper().is_some();
        let starts = if has_own_state { 1 } else { evidence.starts.len() };
        // The rows of a file are processed without regard to where the candidate begins.
        let begins_at = |start: usize| match cause.is_of_file() {
            true => evidence.start_of_case() == Some(start),
            false => cause.is_state() || !evidence.is_other_state(start),
        };
        let starts = (0..starts).filter(|start| has_own_state || begins_at(*start));
        // A motion that is farther from the candidate than the reference at first is not run to its end.
        let departs = evidence.observation.and_then(|seen| seen.parts(DEPARTS));
        let (begins, end) = evidence.span();
        let until = departs.map(|time| time + BEYOND * evidence.period);
        let until =
            until.filter(|until| !has_own_state && !cause.is_of_file() && 2.0 * (until - begins) < end - begins);
        let is_farther = |start: usize| {
            let (until, seen) = until.zip(evidence.observation)?;
            let played = cause.run(&evidence.until(until), start)?;
            Some(seen.left(&played.values, until) > seen.left(&seen.reference, until))
        };
        let tried = starts.filter_map(|start| {
            let (close, judged) = if is_farther(start) == Some(true) {
                (0, Judged::far())
            } else if let Some(played) = cause.run(evidence, start) {
                let close = evidence.observation.map_or(0, |seen| seen.close(&played.values, CLOSE));
                (close, cause.judge(evidence, &played)?)
            } else if has_own_state {
                // Where this solver comes to no end, a variant of it may.
                (0, Judged::far())
            } else {
                return None;
            };
            let own_state = matches!(evidence.starts.get(start), Some(TrialStart::At(..)));
            Some(Tried {
                cause: cause.clone(),
                start,
                own_state: (own_state || has_own_state) && !cause.is_of_file(),
                close,
                judged,
            })
        });
        let best = tried.min_by(|a, b| a.judged.left.total_cmp(&b.judged.left))?;
        Some(super::number::refined(evidence, &best).unwrap_or(best))
    }

    /// Tries mistakes, the closest first.
    pub fn try_all(&self, proposals: Vec<Proposal>) -> Vec<Tried> {
        let ([done, of], evidence, watch) = (&self.counts, self.evidence, self.watch);
        of.fetch_add(proposals.len(), Ordering::Relaxed);
        let tried = over_processors(proposals.len(), &|| false, |k| {
            let tried = Self::try_one(evidence, &proposals[k]);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            watch(done, of.load(Ordering::Relaxed));
            tried
        });
        let mut tried: Vec<Tried> = tried.into_iter().flatten().collect();
        closest_first(&mut tried);
        tried
    }

    /// Tries all causes in their order.
    pub fn find(&mut self) -> FoundCauses {
        let evidence = self.evidence;
        for (is_needed, propose) in ORDER {
            if !is_needed(self) {
                continue;
            }
            let mut proposals: Vec<Proposal> = propose.iter().flat_map(|propose| propose(self)).collect();
            let all = proposals.len();
            proposals.retain(|cause| evidence.determines(cause.fitted(evidence)));
            self.too_few_samples |= proposals.len() < all;
            let mut tried = self.try_all(proposals);
            let is_certain = |tried: &Tried| tried.cause.is_certain(evidence, &tried.judged);
            let certain = |tried: &&Tried| tried.is_cause(evidence) && is_certain(tried);
            if let Some(certain) = tried.iter().find(certain) {
                return FoundCauses::Causes(vec![certain.clone()]);
            }
            tried.retain(|tried| !is_certain(tried));
            self.tried.append(&mut tried);
            if self.has_state() {
                if !self.with_state {
                    // The errors before its first sample explain the difference.
                    return FoundCauses::Unexplained(Vec::new());
                }
                // Runs from the candidate's own state include this cause.
                self.tried.retain(|tried| tried.cause.is_state() || !tried.own_state);
            }
        }
        self.chosen()
    }

    fn chosen(&mut self) -> FoundCauses {
        let evidence = self.evidence;
        let mut tried = std::mem::take(&mut self.tried);
        closest_first(&mut tried);
        tried.retain(|tried| evidence.is_visible(tried.cause.numbers()));
        tried.dedup_by(|a, b| {
            let same = a.cause.numbers() == b.cause.numbers() && a.cause.stepper() == b.cause.stepper();
            same && !a.cause.numbers().is_empty()
        });
        let mut causes = tried.iter().filter(|tried| tried.is_cause(evidence));
        let Some(best) = causes.clone().next() else {
            return FoundCauses::Unexplained(tried);
        };
        // A state of the reference's own motion at another time is that of another clock.
        let of_file = causes
            .find(|tried| tried.cause.is_of_file())
            .filter(|_| best.cause.is_state());
        let best = of_file.unwrap_or(best).clone();
        let complexity = |tried: &Tried| tried.cause.complexity(evidence);
        let is_number = |tried: &Tried| !tried.cause.numbers().is_empty() && tried.cause.stepper().is_none();
        let as_much = |tried: &&Tried| tried.is_cause(evidence) && tried.judged.as_much_as(&best.judged);
        let mut chosen: Vec<Tried> = tried.iter().filter(as_much).cloned().collect();
        let unlikely = |tried: &Tried| tried.cause.parameters().map_or(0, ChangedNumber::unlikely);
        chosen.sort_by_key(|tried| (!tried.cause.is_of_file(), complexity(tried), unlikely(tried)));
        // A more complex change that explains no more is not needed.
        let of_motion = chosen.iter().filter(|tried| !tried.cause.is_of_file());
        let simplest = of_motion.map(complexity).min();
        chosen.retain(|tried| Some(complexity(tried)) == simplest || !(is_number(tried) || tried.cause.is_state()));
        // If two pairs explain as much, neither is the cause.
        if chosen.len() > 1 && is_number(&chosen[0]) && complexity(&chosen[0]) > 1 {
            return FoundCauses::Unexplained(tried);
        }
        for tried in &mut chosen {
            if let Some(cause) = super::number::beyond(evidence, tried) {
                tried.cause = cause;
            }
        }
        FoundCauses::Causes(chosen)
    }

    /// The share that a run with a mistake explains, and its events, in words.
    pub fn outcome(&self, tried: &Tried) -> String {
        let evidence = self.evidence;
        let judged = &tried.judged;
        let of_samples = evidence.observation.is_some();
        let events = if tried.cause.has_events(judged) {
            evidence.compared_events()
        } else {
            0
        };
        let up_to = tried.cause.up_to().filter(|_| !evidence.is_smooth);
        let what = if of_samples {
            "the squared difference of its samples"
        } else {
            "the squared errors of its events"
        };
        let mut text = format!("explains {} % of {what}", percent(judged.explained));
        if evidence.is_smooth {
            text += " up to the onset, which is amplified rounding";
        } else if let Some(until) = up_to {
            text += &format!(
                " up to {until:.6} s, where rounding begins to decide at the end of which step an event comes"
            );
        } else if events > 0 && judged.has_events() {
            text += &format!("; {}", super::parameters::EventAgreement::of(events, judged).words());
        }
        text
    }
}
