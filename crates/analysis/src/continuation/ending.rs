//! Ends of branches, and the special points where branches of cycles end.

use super::special::{Special, Station, critical_pair, row, unit};
use crate::cycle::{Guess, Manifold, What, motion, solve, tangent};
use crate::error::{Error, attempt};
use std::f64::consts::TAU;
use stickslip_system::named;

const MOST_SECANTS: usize = 40;

/// Accuracy of such a point, and its largest distance from the end of the branch, as fractions of the range.
const LOCATED: f64 = 1e-12;
const BESIDE: f64 = 0.05;

/// Largest relative difference between the period of cycles and the period at the Hopf point to which they shrink.
const OTHER_PERIOD: f64 = 0.2;

named! {
    /// Reason for the end of a branch.
    #[derive(Default)]
    pub enum EndReason {
        Range: "range", "at the end of the range";
        Points: "points", "after as many points as were asked for";
        Closed: "closed", "back at its start";
        Shrunk: "shrunk", "the cycles shrink to steady sliding";
        Infinite: "infinite", "the period grows without bounds";
        Jump: "jump", "the motion jumps where the sequence of events changes";
        Lost: "lost", "no solution was found beyond";
        #[default]
        Interrupted: "interrupted", "interrupted";
        Halved: "halved", "the cycles fall back on ones of half their period";
        Rest: "rest", "the relative velocity comes to rest";
    }
}

impl EndReason {
    /// The last reason stands for codes beyond.
    pub(super) fn of_code(code: f64) -> EndReason {
        EndReason::ALL[(code as usize).min(EndReason::ALL.len() - 1)]
    }
}

pub(super) fn hopf_near(manifold: Manifold<'_>, near: &Station) -> Result<Option<Station>, Error> {
    let sense = if near.measured.orbit.relative_velocity.1 > 0.0 {
        1
    } else {
        -1
    };
    let what = What::Steady(sense);
    let period = near.measured.guess.period;
    let guess = Guess {
        period: f64::NAN,
        time: 0.0,
        ..near.measured.guess.clone()
    };
    let found = special_near(Manifold { what, ..manifold }, guess, Special::Hopf)?;
    Ok(found.filter(|station| {
        let pair = critical_pair(Special::Hopf, &station.measured.spectrum);
        pair.is_some_and(|pair| (TAU / pair.im / period - 1.0).abs() < OTHER_PERIOD)
    }))
}

/// Flip at which the doubled cycles were born, if they are near it. It is a point of the cycles of half the period.
pub(super) fn flip_near(manifold: Manifold<'_>, near: &Station) -> Result<Option<Station>, Error> {
    let What::Cycles(multiple) = manifold.what else {
        return Ok(None);
    };
    let guess = &near.measured.guess;
    let member = manifold.family.at(&guess.values, false)?;
    let period = guess.period / 2.0;
    let half = motion(&member, (guess.time, &guess.state), period, false, manifold.stop)?;
    let guess = Guess {
        // Doubled cycles oscillate about the cycles of half their period.
        state: (&guess.state + half.end) / 2.0,
        period,
        ..guess.clone()
    };
    let what = What::Cycles(multiple / 2);
    special_near(Manifold { what, ..manifold }, guess, Special::Flip)
}

/// Secant method in the varied parameter.
fn special_near(manifold: Manifold<'_>, mut guess: Guess, special: Special) -> Result<Option<Station>, Error> {
    let last = guess.values.len() - 1;
    let width = manifold.widths[last];
    let first = guess.values[last];
    let mut at = |value: f64| -> Result<Option<(f64, Station)>, Error> {
        guess.values[last] = value;
        let mut local = manifold.local(&guess)?;
        let x = local.unknowns(&guess);
        let held = unit(x.len(), x.len() - 1);
        let Some(solution) = attempt(solve(&mut local, &x, &row(&held), guess.period))? else {
            return Ok(None);
        };
        guess = local.guess(&solution.x)?;
        let measured = manifold.measure(&guess)?;
        let Some(direction) = tangent(&solution.jacobian, &held) else {
            return Ok(None);
        };
        let station = Station::new(manifold.what, &local, measured, &direction, &solution.jacobian);
        let value = station.tests.value(special, &station.measured);
        Ok((!value.is_nan()).then_some((value, station)))
    };
    let (mut a, mut b) = (first, first + 1e-4 * width);
    let Some((mut value_a, _)) = at(a)? else {
        return Ok(None);
    };
    for _ in 0..MOST_SECANTS {
        let Some((value_b, station)) = at(b)? else {
            return Ok(None);
        };
        let next = b - value_b * (b - a) / (value_b - value_a);
        if value_b == 0.0 || !next.is_finite() || (next - b).abs() <= LOCATED * width {
            return Ok(((b - first).abs() < BESIDE * width).then_some(station));
        }
        (a, value_a, b) = (b, value_b, next);
    }
    Ok(None)
}
