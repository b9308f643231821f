//! Why branches end, and the Hopf point at which cycles have shrunk to steady sliding.

use super::manifold::{Manifold, What};
use super::special::{Special, critical_pair, tests};
use super::station::{Station, row};
use crate::cycle::{CycleError, Guess, solve, tangent};
use nalgebra::DVector;

/// Iterations of the secant method for the Hopf point where cycles have shrunk.
const MOST_SECANTS: usize = 40;

/// A Hopf point is known to this share of the range.
const LOCATED: f64 = 1e-12;

/// Why a branch ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndReason {
    /// At an end of the range.
    Range,
    /// It has as many points as were asked for.
    Points,
    /// It has come back to its start.
    Closed,
    /// The cycles have shrunk to steady sliding.
    Shrunk,
    /// The period grows without bounds.
    Infinite,
    /// The motion jumps where the sequence of events changes: no branch goes on there.
    Jump,
    /// No solution is found beyond.
    Lost,
    /// It was being followed as the study was interrupted.
    Interrupted,
    /// The cycles fall back on ones of half their period.
    Halved,
}

impl EndReason {
    /// All of them, in the order of their codes in files.
    pub const ALL: [EndReason; 9] = [
        EndReason::Range,
        EndReason::Points,
        EndReason::Closed,
        EndReason::Shrunk,
        EndReason::Infinite,
        EndReason::Jump,
        EndReason::Lost,
        EndReason::Interrupted,
        EndReason::Halved,
    ];

    /// As a word in files.
    pub fn name(self) -> &'static str {
        match self {
            EndReason::Range => "range",
            EndReason::Points => "points",
            EndReason::Closed => "closed",
            EndReason::Shrunk => "shrunk",
            EndReason::Infinite => "infinite",
            EndReason::Jump => "jump",
            EndReason::Lost => "lost",
            EndReason::Interrupted => "interrupted",
            EndReason::Halved => "halved",
        }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            EndReason::Range => "at the end of the range",
            EndReason::Points => "after as many points as were asked for",
            EndReason::Closed => "back at its start",
            EndReason::Shrunk => "the cycles shrink to steady sliding",
            EndReason::Infinite => "the period grows without bounds",
            EndReason::Jump => "the motion jumps where the sequence of events changes",
            EndReason::Lost => "no solution was found beyond",
            EndReason::Interrupted => "interrupted",
            EndReason::Halved => "the cycles fall back on ones of half their period",
        }
    }
}

/// The Hopf point of steady sliding near cycles that have shrunk to it; none where there is none.
pub(super) fn hopf_near(manifold: Manifold<'_>, near: &Station) -> Result<Option<Station>, CycleError> {
    let sense = if near.measured.relative_velocity.1 > 0.0 { 1 } else { -1 };
    let manifold = Manifold {
        what: What::Steady(sense),
        ..manifold
    };
    let mut guess = Guess {
        period: f64::NAN,
        time: 0.0,
        ..near.measured.guess.clone()
    };
    let last = guess.values.len() - 1;
    let mut at = |value: f64| -> Result<Option<(f64, Station)>, CycleError> {
        guess.values[last] = value;
        let mut local = manifold.local(&guess)?;
        let x = local.unknowns(&guess);
        let mut held = DVector::zeros(x.len());
        held[x.len() - 1] = 1.0;
        let Ok(solution) = solve(&mut local, &x, &row(&held)) else {
            return Ok(None);
        };
        guess = local.guess(&solution.x)?;
        let measured = manifold.measure(&guess)?;
        let Some(direction) = tangent(&solution.jacobian, &held) else {
            return Ok(None);
        };
        let station = Station {
            tests: tests(manifold.what, &measured, &direction, &solution.jacobian),
            direction: direction.component_mul(local.scale()),
            measured,
        };
        let growth = critical_pair(Special::Hopf, &station.measured.spectrum).map(|pair| pair.re);
        Ok(growth.map(|growth| (growth, station)))
    };
    let width = manifold.widths[last];
    let first = near.measured.guess.values[last];
    let (mut a, mut b) = (first, first + 1e-4 * width);
    let Some((mut growth_a, _)) = at(a)? else {
        return Ok(None);
    };
    for _ in 0..MOST_SECANTS {
        let Some((growth_b, station)) = at(b)? else {
            return Ok(None);
        };
        let next = b - growth_b * (b - a) / (growth_b - growth_a);
        if growth_b == 0.0 || !next.is_finite() || (next - b).abs() <= LOCATED * width {
            return Ok(((b - first).abs() < 0.05 * width).then_some(station));
        }
        (a, growth_a, b) = (b, growth_b, next);
    }
    Ok(None)
}
