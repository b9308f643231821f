//! A signal without harmonics, line by line.

use crate::signal::{Ramp, Signal, Table};
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

impl Piece {
    /// A force that stays.
    pub fn constant(start: BigRational, force: BigRational) -> Piece {
        let slope = BigRational::zero();
        Piece { start, force, slope }
    }
}

/// F(t) from t = 0 on. The last piece never ends.
pub(super) fn pieces(actuation: &Signal<BigRational>) -> Vec<Piece> {
    let zero = BigRational::zero;
    match actuation {
        Signal::Ramp(Ramp { value, rise_time }) if rise_time.is_positive() => vec![
            Piece {
                start: zero(),
                force: zero(),
                slope: value / rise_time,
            },
            Piece::constant(rise_time.clone(), value.clone()),
        ],
        Signal::Ramp(Ramp { value, .. }) => vec![Piece::constant(zero(), value.clone())],
        Signal::Table(Table { time, value }) => table_pieces(time, value),
    }
}

/// The first force holds before the table, the last after it; what lies before t = 0 is cut off.
fn table_pieces(time: &[BigRational], force: &[BigRational]) -> Vec<Piece> {
    let zero = BigRational::zero();
    let mut pieces = Vec::with_capacity(time.len() + 1);
    if time.first().is_some_and(|first| first > &zero) {
        pieces.push(Piece::constant(zero.clone(), force[0].clone()));
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
