//! A branch at a border, where the sequence of events changes: the border located, and the branch beyond it.

use super::curve::{DISTANCE, border_point};
use super::ending::EndReason;
use super::follow::{Follower, Found, LOCATED, MOST_HALVINGS};
use super::manifold::{Local, Measured};
use super::special::Special;
use super::station::{Station, Trial, scaled};
use crate::cycle::{Border, CycleError, Equations as _, tangent};
use nalgebra::DVector;

/// A border is where its relative distance is below this at the last point before it; that of what vanishes goes with a root of the
/// way to it.
const AT_BORDER: f64 = 1e-4;
const AT_VANISHING: f64 = 2e-3;

/// A border whose relative distance is below this at the last point before it is known there.
const EXACT: f64 = 1e-12;

/// Shares of the longest step by which a point beyond a border is sought.
const BEYOND: [f64; 6] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1];

/// A motion that has jumped beyond a border misses itself by more than this many times the step.
const JUMPED: f64 = 50.0;

/// A trial in words, for the log.
fn told(trial: &Result<Option<Trial>, CycleError>) -> String {
    match trial {
        Ok(Some(trial)) => {
            let measured = &trial.station.measured;
            format!(
                "{:?}, {}, {:?}",
                measured.guess.values, measured.sequence, measured.nearest
            )
        }
        Ok(None) => "no solution".to_owned(),
        Err(error) => error.to_string(),
    }
}

impl<'a> Follower<'a> {
    /// The sequence of events is another at the end of a step, or there is no solution: to the border, and beyond.
    pub(super) fn border(
        &mut self,
        local: &mut Local<'a>,
        at: (&DVector<f64>, &DVector<f64>),
        step: f64,
    ) -> Result<Vec<Found>, CycleError> {
        let word = self.current.measured.word.clone();
        let (mut low, mut high) = (0.0, step);
        let (mut last, mut first): (Option<Trial>, Option<Trial>) = (None, None);
        for _ in 0..MOST_HALVINGS {
            let middle = 0.5 * (low + high);
            if high - low <= LOCATED * step || middle <= low || middle >= high {
                break;
            }
            let trial = self.trial_near(local, at, middle, step);
            log::debug!("border at {middle:.17e}: {}", told(&trial));
            match trial {
                Err(CycleError::Interrupted) => return Err(CycleError::Interrupted),
                Ok(Some(trial)) if trial.station.measured.word == word => {
                    low = middle;
                    last = Some(trial);
                }
                Ok(Some(trial)) => {
                    high = middle;
                    first = Some(trial);
                }
                Ok(None) | Err(_) => {
                    high = middle;
                    first = None;
                }
            }
        }
        let station = last
            .as_ref()
            .map_or_else(|| self.current.clone(), |trial| trial.station.clone());
        let before = self.border_of(&station, first.as_ref());
        let mut found = Vec::new();
        let Some(border) = before else {
            self.accept(station.clone());
            if low > 0.0 {
                found.push(Found::Point(Box::new(station)));
            }
            found.push(Found::End(EndReason::Lost));
            return Ok(found);
        };
        // What the derivatives say at the border itself is no special point.
        let (low_end, high_end) = self.steps.range;
        let value = station.measured.guess.values[0];
        let apart = |one: &Found| match one {
            Found::Special(_, special) => {
                (special.measured.guess.values[0] - value).abs() > AT_BORDER * 1e-2 * (high_end - low_end)
            }
            _ => true,
        };
        found.extend(self.between(local, at, low, &station)?.into_iter().filter(apart));
        let edge = local.unknowns(&station.measured.guess);
        let mut beyond = None;
        // The branch goes on, if it does not jump. So near to a border derivatives are good for little: it goes on from a point at some
        // distance, if there is one.
        let mut at_border = None;
        if let Some(first) = first.filter(|first| (&first.solution.x - &edge).norm() <= 1e-5 + 1e3 * (high - low)) {
            let (station, farther) = self.away(first.station)?;
            (at_border, beyond) = (Some(station), farther);
        }
        if beyond.is_none() {
            beyond = self.folded(local, &edge, at.1, &word)?.or(at_border);
        }
        let (border, edge) = self.sharpened(border, station, beyond.as_ref())?;
        found.push(Found::Special(Special::Border(border), Box::new(edge)));
        match beyond {
            Some(station) => {
                self.step = 0.02 * self.steps.longest;
                found.push(self.take(station)?);
            }
            None => found.push(Found::End(EndReason::Jump)),
        }
        Ok(found)
    }

    /// A point just beyond a border, with the direction that leads away from it, and a point farther on.
    fn away(&self, station: Station) -> Result<(Station, Option<Station>), CycleError> {
        let guess = &station.measured.guess;
        let mut local = self.manifold.local(guess)?;
        let x = local.unknowns(guess);
        let along = scaled(&local, &station.direction);
        for step in [1e-2, 1e-3, 1e-4, 1e-5] {
            for sign in [1.0, -1.0] {
                let trial = self.trial(&mut local, (&x, &(&along * sign)), step * self.steps.longest);
                log::debug!(
                    "away by {:.1e}: {}, from {:?}",
                    sign * step,
                    told(&trial),
                    station.measured.nearest
                );
                let trial = match trial {
                    Err(CycleError::Interrupted) => return Err(CycleError::Interrupted),
                    Ok(Some(trial)) => trial.station,
                    Ok(None) | Err(_) => continue,
                };
                // A step that leads back over the border has the other events.
                if trial.measured.word == station.measured.word {
                    let station = match sign < 0.0 {
                        true => Station {
                            direction: -&station.direction,
                            tests: station.tests.turned(),
                            ..station
                        },
                        false => station,
                    };
                    return Ok((station, Some(trial)));
                }
            }
        }
        Ok((station, None))
    }

    /// A border from the side on which its distance is regular. It is looked for from a point at some distance, the current one or one
    /// `farther` beyond.
    fn sharpened(
        &self,
        border: Border,
        edge: Station,
        farther: Option<&Station>,
    ) -> Result<(Border, Station), CycleError> {
        if border.is_regular() && edge.measured.nearest.is_some_and(|nearest| nearest.1.abs() < EXACT) {
            return Ok((border, edge));
        }
        // A point at some distance from it, with the same events.
        let apart = |station: &&Station| {
            let measured = &station.measured;
            let far = measured
                .nearest
                .is_some_and(|nearest| nearest.0 == border && nearest.1 > 4.0 * DISTANCE);
            far && measured.word == self.current.measured.word
        };
        let near = std::iter::once(&self.current).chain(&self.before).find(apart);
        let near = near.unwrap_or(&self.current);
        let own = (border, &near.measured.guess);
        let others = farther.and_then(|farther| Some((farther.measured.nearest?.0, &farther.measured.guess)));
        let sides = std::iter::once(own).chain(others);
        for (border, near) in sides.filter(|side| side.0.is_regular()) {
            if let Some((guess, measured)) = border_point(self.manifold, border, near, None)? {
                let measured = Measured { guess, ..measured };
                return Ok((border, Station { measured, ..edge }));
            }
        }
        Ok((border, edge))
    }

    /// Which border it is: of the last point before it, or of the first one beyond; of its two names the regular one.
    fn border_of(&self, station: &Station, beyond: Option<&Trial>) -> Option<Border> {
        let at = |&(border, distance): &(Border, f64)| match border.is_regular() {
            true => distance.abs() < AT_BORDER,
            false => distance.abs() < AT_VANISHING,
        };
        let near = |station: &Station| station.measured.nearest.filter(at).map(|nearest| nearest.0);
        let both = [near(station), beyond.and_then(|trial| near(&trial.station))];
        let mut known = both.into_iter().flatten();
        known.clone().find(|border| border.is_regular()).or(known.next())
    }

    /// The first point beyond a border at which the branch turns back.
    fn folded(
        &self,
        local: &mut Local<'a>,
        edge: &DVector<f64>,
        along: &DVector<f64>,
        word: &[u8],
    ) -> Result<Option<Station>, CycleError> {
        for share in BEYOND {
            let outside = edge + along * (share * self.steps.longest);
            let Ok((residual, jacobian)) = local.evaluate(&outside) else {
                continue;
            };
            let there = local.last().map(crate::cycle::word);
            if there.is_none_or(|there| there == word) || residual.amax() > JUMPED * share * self.steps.longest {
                continue;
            }
            let Some(direction) = tangent(&jacobian, along) else {
                continue;
            };
            for sign in [1.0, -1.0] {
                let direction = &direction * sign;
                for step in [1e-2, 1e-3, 1e-1] {
                    let step = step * self.steps.longest;
                    let trial = match self.trial(local, (edge, &direction), step) {
                        Err(CycleError::Interrupted) => return Err(CycleError::Interrupted),
                        Ok(Some(trial)) => trial,
                        Ok(None) | Err(_) => continue,
                    };
                    if trial.station.measured.word != word {
                        return Ok(Some(trial.station));
                    }
                }
            }
        }
        Ok(None)
    }
}
