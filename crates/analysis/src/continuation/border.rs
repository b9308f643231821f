//! Border of a branch, where the sequence of events changes: its location, and the branch beyond.

use super::curve::{DISTANCE, border_point};
use super::ending::EndReason;
use super::follow::{BranchFollower, FoundPoint, LOCATED, MOST_HALVINGS, Ray, SHORT};
use super::manifold::Measured;
use super::special::{Special, Station, Trial, scaled};
use crate::cycle::{Border, Nearest, NewtonEquations as _, What, tangent};
use crate::error::{Error, attempt};
use nalgebra::DVector;

/// Relative distance at which a border is reached. The second holds for a quantity that vanishes like a root.
const AT_BORDER: f64 = 1e-4;
const AT_VANISHING: f64 = 2e-3;

/// If the relative distance at the last point is below this, the border needs no extrapolation.
const EXACT: f64 = 1e-12;

/// Number of points before a graze from which the graze is sought.
const GRAZING: usize = 6;

/// Fractions of the longest step for the search beyond a border.
const BEYOND: [f64; 6] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];

/// Multiple of the step. If the error of closure exceeds it, the motion has jumped at the border.
const JUMPED: f64 = 50.0;

impl<'a> BranchFollower<'a> {
    /// Locates the border and continues beyond it, if a step changes the sequence of events or finds no solution.
    /// `None`: there is no border, and a shorter step may stay on the branch.
    pub(super) fn border(&mut self, ray: &mut Ray<'_, 'a>, step: f64) -> Result<Option<Vec<FoundPoint>>, Error> {
        let word = self.current.measured.orbit.word.clone();
        let (mut low, mut high) = (0.0, step);
        let (mut last, mut first): (Option<Trial>, Option<Trial>) = (None, None);
        for _ in 0..MOST_HALVINGS {
            let middle = 0.5 * (low + high);
            if high - low <= LOCATED * step || middle <= low || middle >= high {
                break;
            }
            match attempt(self.trial_near(ray, middle, step))?.flatten() {
                Some(trial) if trial.station.measured.orbit.word == word => {
                    low = middle;
                    last = Some(trial);
                }
                trial => {
                    high = middle;
                    first = trial;
                }
            }
        }
        let station = last
            .as_ref()
            .map_or_else(|| self.current.clone(), |trial| trial.station.clone());
        let before = self.border_of(&station, first.as_ref());
        let mut found = Vec::new();
        let Some(border) = before else {
            if step > SHORT * self.steps.longest {
                return Ok(None);
            }
            let speed = |station: &Station| {
                let (least, largest) = station.measured.orbit.relative_velocity;
                least.abs().max(largest.abs())
            };
            let fastest = self.before.iter().map(speed).fold(speed(&self.current), f64::max);
            let rests = matches!(self.manifold.what, What::Steady(_)) && speed(&station) < AT_BORDER * fastest;
            self.accept(station.clone());
            if !rests {
                self.failure = Some(self.reason(ray.local, &(ray.x + ray.along * high)));
            }
            if low > 0.0 {
                found.push(FoundPoint::Point(Box::new(station)));
            }
            found.push(FoundPoint::End(if rests { EndReason::Rest } else { EndReason::Lost }));
            return Ok(Some(found));
        };
        // Derivatives at the border itself do not indicate a special point.
        let (low_end, high_end) = self.steps.range;
        let value = station.measured.guess.values[0];
        let apart = |one: &FoundPoint| match one {
            FoundPoint::Special(_, special) => {
                (special.measured.guess.values[0] - value).abs() > AT_BORDER * 1e-2 * (high_end - low_end)
            }
            _ => true,
        };
        found.extend(self.between(ray, low, &station)?.into_iter().filter(apart));
        let edge = ray.local.unknowns(&station.measured.guess);
        let mut beyond = None;
        // The branch continues unless it jumps. Derivatives are inaccurate near a border, so it continues from a
        // distant point if possible.
        let mut at_border = None;
        if let Some(first) = first.filter(|first| (&first.solution.x - &edge).norm() <= 1e-5 + 1e3 * (high - low)) {
            let (station, farther) = self.away(first.station)?;
            (at_border, beyond) = (Some(station), farther);
        }
        if beyond.is_none() {
            beyond = self.folded(ray, &edge, &word)?.or(at_border);
        }
        let (border, edge) = self.sharpened(border, station, beyond.as_ref())?;
        // Both sides see the same border.
        let border = border.seen_within();
        found.push(FoundPoint::Special(Special::Border(border), Box::new(edge)));
        match beyond {
            Some(station) => {
                self.step = 0.02 * self.steps.longest;
                found.push(self.take(station)?);
            }
            None => found.push(FoundPoint::End(EndReason::Jump)),
        }
        Ok(Some(found))
    }

    /// Point just beyond a border with the direction away from it, and a more distant point.
    fn away(&self, mut station: Station) -> Result<(Station, Option<Station>), Error> {
        let guess = &station.measured.guess;
        let mut local = self.manifold.local(guess)?;
        let x = local.unknowns(guess);
        let along = scaled(&local, &station.direction);
        for step in [1e-2, 1e-3, 1e-4, 1e-5] {
            for sign in [1.0, -1.0] {
                let ray = &mut Ray {
                    local: &mut local,
                    x: &x,
                    along: &(&along * sign),
                };
                let trial = self.trial(ray, step * self.steps.longest);
                // A step back across the border has the previous events.
                let same = |trial: &Trial| trial.station.measured.orbit.word == station.measured.orbit.word;
                if let Some(trial) = attempt(trial)?.flatten().filter(same) {
                    if sign < 0.0 {
                        station.direction.neg_mut();
                        station.tests = station.tests.turned();
                    }
                    return Ok((station, Some(trial.station)));
                }
            }
        }
        Ok((station, None))
    }

    /// Border from its regular side, sought from a distant point: the current point, or `farther` beyond.
    fn sharpened(&self, border: Border, edge: Station, farther: Option<&Station>) -> Result<(Border, Station), Error> {
        if border.is_regular()
            && edge
                .measured
                .orbit
                .nearest
                .is_some_and(|nearest| nearest.distance.abs() < EXACT)
        {
            return Ok((border, edge));
        }
        // A distant point with the same events.
        let apart = |station: &&Station| {
            let measured = &station.measured;
            let nearest = measured.orbit.nearest;
            let far = nearest.is_some_and(|nearest| nearest.border == border && nearest.distance > 4.0 * DISTANCE);
            far && measured.orbit.word == self.current.measured.orbit.word
        };
        let near = std::iter::once(&self.current).chain(&self.before).find(apart);
        let near = near.unwrap_or(&self.current);
        let own = (border, &near.measured.guess);
        let others =
            farther.and_then(|farther| Some((farther.measured.orbit.nearest?.border, &farther.measured.guess)));
        let sides = std::iter::once(own).chain(others).filter(|side| side.0.is_regular());
        // A graze has only one side.
        let places = [&edge, &self.current].into_iter().chain(&self.before).take(GRAZING);
        let grazes = places
            .filter(|_| border.grazes())
            .map(|place| (border, &place.measured.guess));
        let mut found = None;
        for (border, near) in sides.chain(grazes) {
            if let Some((guess, measured)) = border_point(self.manifold, border, near, None)? {
                found = Some((border, Measured { guess, ..measured }));
                break;
            }
        }
        Ok(match found {
            Some((border, measured)) => (border, Station { measured, ..edge }),
            None => (border, edge),
        })
    }

    /// Border at the last point before it, or at the first point beyond; of its two names, the regular one.
    fn border_of(&self, station: &Station, beyond: Option<&Trial>) -> Option<Border> {
        let at = |nearest: &Nearest| match nearest.border {
            Border::Landing | Border::Slip | Border::Separation => nearest.distance.abs() < AT_VANISHING,
            _ => nearest.distance.abs() < AT_BORDER,
        };
        let near = |station: &Station| station.measured.orbit.nearest.filter(at).map(|nearest| nearest.border);
        let both = [near(station), beyond.and_then(|trial| near(&trial.station))];
        let mut known = both.into_iter().flatten();
        known.clone().find(|border| border.is_regular()).or(known.next())
    }

    /// First point beyond a border at which the branch turns back.
    fn folded(&self, ray: &mut Ray<'_, 'a>, edge: &DVector<f64>, word: &[u8]) -> Result<Option<Station>, Error> {
        for share in BEYOND {
            let outside = edge + ray.along * (share * self.steps.longest);
            let Ok((residual, jacobian)) = ray.local.evaluate(&outside) else {
                continue;
            };
            let there = ray.local.last.as_ref().map(crate::cycle::word);
            if there.is_none_or(|there| there == word) || residual.amax() > JUMPED * share * self.steps.longest {
                continue;
            }
            let Some(direction) = tangent(&jacobian, ray.along) else {
                continue;
            };
            for sign in [1.0, -1.0] {
                let ray = &mut Ray {
                    local: &mut *ray.local,
                    x: edge,
                    along: &(&direction * sign),
                };
                for step in [1e-2, 1e-3, 1e-1] {
                    let step = step * self.steps.longest;
                    let trial = attempt(self.trial(ray, step))?.flatten();
                    if let Some(trial) = trial.filter(|trial| trial.station.measured.orbit.word != word) {
                        return Ok(Some(trial.station));
                    }
                }
            }
        }
        Ok(None)
    }
}
