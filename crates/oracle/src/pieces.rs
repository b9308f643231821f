//! A signal without harmonics, as linear pieces.

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use stickslip_system::signal::{Ramp, Signal, TimeTable};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExactPiece {
    pub start: BigRational,
    pub force: BigRational,
    /// Force just before the next piece; equal to `force` in the last piece.
    pub end_force: BigRational,
    pub slope: BigRational,
}

impl ExactPiece {
    pub fn constant(start: BigRational, force: BigRational) -> ExactPiece {
        ExactPiece {
            start,
            end_force: force.clone(),
            force,
            slope: BigRational::zero(),
        }
    }
}

/// F(t) from t = 0 on. The last piece never ends.
pub(super) fn pieces(actuation: &Signal<BigRational>) -> Vec<ExactPiece> {
    let zero = BigRational::zero;
    match actuation {
        Signal::Ramp(Ramp { value, rise_time }) if rise_time.is_positive() => vec![
            ExactPiece {
                start: zero(),
                force: zero(),
                end_force: value.clone(),
                slope: value / rise_time,
            },
            ExactPiece::constant(rise_time.clone(), value.clone()),
        ],
        Signal::Ramp(Ramp { value, .. }) => vec![ExactPiece::constant(zero(), value.clone())],
        Signal::TimeTable(TimeTable { time, value }) => table_pieces(time, value),
    }
}

/// The first force is valid before the table, the last one after it. Points before t = 0 are cut off. Two points at
/// one time are a step.
fn table_pieces(time: &[BigRational], force: &[BigRational]) -> Vec<ExactPiece> {
    let zero = BigRational::zero();
    let mut pieces = Vec::with_capacity(time.len() + 1);
    if time.first().is_some_and(|first| first > &zero) {
        pieces.push(ExactPiece::constant(zero.clone(), force[0].clone()));
    }
    for (index, (start, at_start)) in time.iter().zip(force).enumerate() {
        let begin = start.max(&zero).clone();
        let Some(end) = time.get(index + 1) else {
            pieces.push(ExactPiece::constant(begin, at_start.clone()));
            break;
        };
        if end <= &zero || end <= start {
            continue;
        }
        let slope = (&force[index + 1] - at_start) / (end - start);
        pieces.push(ExactPiece {
            force: at_start + &slope * (&begin - start),
            end_force: force[index + 1].clone(),
            start: begin,
            slope,
        });
    }
    pieces
}
