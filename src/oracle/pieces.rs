//! The actuating force piece by piece.

use crate::model::ExactActuation;
use num_rational::BigRational;
use num_traits::{Signed, Zero};

/// A stretch of linear F(t), up to where the next begins.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Piece {
    /// s.
    pub start: BigRational,
    /// F at the start, N.
    pub force: BigRational,
    /// F', N/s.
    pub slope: BigRational,
}

/// F(t) from t = 0 on. The last piece never ends.
pub(super) fn pieces(actuation: &ExactActuation) -> Vec<Piece> {
    let zero = BigRational::zero;
    match actuation {
        ExactActuation::Ramp { force, rise_time } if rise_time.is_positive() => vec![
            Piece {
                start: zero(),
                force: zero(),
                slope: force / rise_time,
            },
            Piece {
                start: rise_time.clone(),
                force: force.clone(),
                slope: zero(),
            },
        ],
        ExactActuation::Ramp { force, .. } => vec![Piece {
            start: zero(),
            force: force.clone(),
            slope: zero(),
        }],
        ExactActuation::Table { time, force } => table_pieces(time, force),
    }
}

/// The first force holds before the table, the last after it; what lies before t = 0 is cut off.
fn table_pieces(time: &[BigRational], force: &[BigRational]) -> Vec<Piece> {
    let zero = BigRational::zero();
    let mut pieces = Vec::with_capacity(time.len() + 1);
    if time.first().is_some_and(|first| first > &zero) {
        pieces.push(Piece {
            start: zero.clone(),
            force: force[0].clone(),
            slope: zero.clone(),
        });
    }
    for (index, (start, at_start)) in time.iter().zip(force).enumerate() {
        let next = time.get(index + 1);
        let slope = match next {
            Some(end) => (&force[index + 1] - at_start) / (end - start),
            None => zero.clone(),
        };
        if next.is_some_and(|end| end <= &zero) {
            continue;
        }
        let begin = start.max(&zero).clone();
        pieces.push(Piece {
            force: at_start + &slope * (&begin - start),
            start: begin,
            slope,
        });
    }
    pieces
}
