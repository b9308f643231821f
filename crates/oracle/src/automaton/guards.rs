//! The guards of each mode, and the choice of the guard that ends a step.

use super::{ExactMarginWatch, ExactRun};
use crate::OracleError;
use crate::axial::INSTANT;
use crate::equations::ExactExpansion;
use crate::float::Float;
use crate::roots::{Crossing, first_zero};
use stickslip_system::model::Mode;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ExactGuard {
    Stop,
    Stability,
    Sense,
    Separation,
    Contact,
    Breakaway(i8),
    /// End of the piece of the friction law, +1 for the upper end.
    Knot(i8),
    /// |omega_r| passes the stick speed of a contact without stick.
    Threshold,
}

pub(super) struct FiredGuard<const N: usize> {
    pub after: Float<N>,
    pub guard: ExactGuard,
    /// Whether the guard stood beyond its boundary at the start.
    pub beyond: bool,
    /// Number of leading coefficients that vanish because of the preceding event.
    pub known: usize,
}

impl<const N: usize> ExactRun<N> {
    /// The guard that fires first within the step, which ends at `until` at the latest.
    pub(super) fn first_guard(
        &mut self,
        expansion: &ExactExpansion<N>,
        step: &Float<N>,
        until: &Float<N>,
    ) -> Result<Option<FiredGuard<N>>, OracleError> {
        let mut first: Option<FiredGuard<N>> = None;
        for (guard, polynomial) in self.guards(expansion) {
            let known = self.zeros.iter().find(|(zero, _)| *zero == guard);
            let known = known.map_or(0, |(_, count)| *count);
            let (after, at_once) = match first_zero(&polynomial, known, step) {
                Crossing::None => continue,
                Crossing::At(time) => (time, false),
                // A guard that only touches zero turns back.
                Crossing::Beyond if known == 0 || guard == ExactGuard::Sense => (Float::zero(), true),
                Crossing::Beyond => return Err(self.degenerate(guard)),
            };
            if at_once && guard == ExactGuard::Stop {
                return Err(self.degenerate(guard));
            }
            if matches!(guard, ExactGuard::Separation | ExactGuard::Contact) && self.belongs_to_corner(&after, until) {
                continue;
            }
            if guard == ExactGuard::Contact
                && let (Some(actuation), Some(motion)) = (&self.actuation, &self.model.axial)
                && let Some([z, z_dot]) = expansion.at(&after).axial
                && actuation.rests(motion, [&z, &z_dot], &(&self.time + &after))
            {
                self.stays_open = true;
                continue;
            }
            let earlier = |first: &FiredGuard<N>| {
                if let (ExactGuard::Separation, ExactGuard::Breakaway(_)) = (first.guard, guard) {
                    // A torque that is zero up to rounding breaks no stick before the force has vanished.
                    !self.within_instant(&first.after, &after)
                } else {
                    after < first.after
                }
            };
            if first.as_ref().is_none_or(earlier) {
                first = Some(FiredGuard {
                    after,
                    guard,
                    beyond: at_once && !polynomial.first().is_some_and(Float::is_zero),
                    known,
                });
            }
        }
        Ok(first)
    }

    /// The guards of the mode, positive before they fire.
    fn guards(&self, expansion: &ExactExpansion<N>) -> Vec<(ExactGuard, Vec<Float<N>>)> {
        let negated = |p: &[Float<N>]| p.iter().map(|c| -c).collect::<Vec<_>>();
        let less = |p: &[Float<N>], value: &Float<N>| {
            let mut p = p.to_vec();
            p[0] -= value;
            p
        };
        let mut guards: Vec<(ExactGuard, Vec<Float<N>>)> = Vec::with_capacity(4);
        if self.mode == Mode::Separated {
            if !self.stays_open {
                guards.push((ExactGuard::Contact, negated(&expansion.normal)));
            }
            return guards;
        }
        guards.push((ExactGuard::Separation, expansion.normal.clone()));
        if self.mode == Mode::Stick {
            let [_, limit] = expansion.stick_test(&self.model);
            for sense in [1, -1] {
                let mut reserve = expansion.reserve(&self.model, sense);
                // At the limit up to rounding, the higher coefficients decide.
                if reserve[0].log2() < limit.log2().max(self.scales.torque) - self.resolved() {
                    reserve[0] = Float::zero();
                }
                guards.push((ExactGuard::Breakaway(sense), reserve));
            }
            return guards;
        }
        let speed = expansion.contact.speed();
        if let Some(knot) = self.knots.get(self.piece) {
            guards.push((ExactGuard::Knot(1), negated(&less(speed, knot))));
        }
        if let Some(knot) = self.piece.checked_sub(1).and_then(|last| self.knots.get(last)) {
            guards.push((ExactGuard::Knot(-1), less(speed, knot)));
        }
        if self.mode != Mode::Engaged {
            guards.push((ExactGuard::Stop, speed.to_vec()));
            match self.watch {
                ExactMarginWatch::Stable => guards.push((ExactGuard::Stability, expansion.margin(&self.model))),
                ExactMarginWatch::Unstable => {
                    guards.push((ExactGuard::Stability, negated(&expansion.margin(&self.model))))
                }
                ExactMarginWatch::Off => {}
            }
            return guards;
        }
        guards.push((ExactGuard::Sense, speed.to_vec()));
        if let Some((threshold, above)) = &self.threshold {
            let excess = less(speed, threshold);
            guards.push((ExactGuard::Threshold, if *above { excess } else { negated(&excess) }));
        }
        guards
    }

    /// Whether the force reaches zero at a corner, up to an instant or rounding. The corner decides then.
    fn belongs_to_corner(&self, after: &Float<N>, until: &Float<N>) -> bool {
        let Some(corner) = self.corners.front().map(Float::<N>::from_rational) else {
            return false;
        };
        corner == *until && self.within_instant(&(until - &self.time), after)
    }

    /// Whether `second` is at most an instant, or rounding, before `first`.
    fn within_instant(&self, first: &Float<N>, second: &Float<N>) -> bool {
        let rounding = (&self.time + first).log2() - self.resolved();
        let rest = first - second;
        rest.signum() <= 0 || rest.log2() < rounding.max(INSTANT.log2())
    }

    /// A guard that leaves its boundary in the wrong direction contradicts its mode.
    fn degenerate(&self, guard: ExactGuard) -> OracleError {
        let what = match guard {
            ExactGuard::Contact | ExactGuard::Separation => "the contact force turns at zero",
            ExactGuard::Knot(_) => "the sliding speed turns at a knot of the friction law",
            ExactGuard::Stability => "the stability of sliding turns at its limit",
            ExactGuard::Stop | ExactGuard::Sense => "a slip starts against its own sense",
            ExactGuard::Breakaway(_) => "a stick starts beyond its breakaway torque",
            ExactGuard::Threshold => "the sliding speed turns at the one that counts as stick",
        };
        OracleError::Degenerate {
            time: self.time.to_f64(),
            what,
        }
    }
}
