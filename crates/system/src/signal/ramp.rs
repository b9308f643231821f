//! A linear rise to a constant value.

use super::{Piece, Profile};

/// The signal value t / rise_time up to `rise_time`, then `value`. With `rise_time = 0` it is a step at t = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp<T = f64> {
    /// Value at the end of the rise, in the unit of the driven quantity.
    pub value: T,
    /// Duration of the rise, s.
    pub rise_time: T,
}

impl<T> Ramp<T> {
    pub(super) fn try_map<U, E>(
        &self,
        number: &mut impl FnMut(&'static str, Option<usize>, &T) -> Result<U, E>,
    ) -> Result<Ramp<U>, E> {
        Ok(Ramp {
            value: number("value", None, &self.value)?,
            rise_time: number("rise_time", None, &self.rise_time)?,
        })
    }
}

impl Profile for Ramp {
    const NAME: &'static str = "ramp";

    fn blank() -> Ramp {
        Ramp {
            value: f64::NAN,
            rise_time: f64::NAN,
        }
    }

    fn stretches(&self) -> Vec<Piece> {
        let &Ramp { value, rise_time } = self;
        if rise_time > 0.0 {
            let rise = Piece {
                start: 0.0,
                end: rise_time,
                value: 0.0,
                end_value: value,
                slope: value / rise_time,
            };
            vec![rise, Piece::constant(rise_time, value)]
        } else {
            vec![Piece::constant(0.0, value)]
        }
    }
}
