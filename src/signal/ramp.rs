//! A linear rise that then holds.

use super::Profile;

/// value t / rise_time up to `rise_time`, then `value`. `rise_time = 0` is a step at t = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp<T = f64> {
    /// At the end of the rise, in the unit of what it drives.
    pub value: T,
    /// s.
    pub rise_time: T,
}

impl<T> Ramp<T> {
    /// As [`super::Signal::try_map`].
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

    fn stretches(&self) -> Vec<(f64, f64, f64)> {
        let &Ramp { value, rise_time } = self;
        if rise_time > 0.0 {
            vec![(0.0, 0.0, value / rise_time), (rise_time, value, 0.0)]
        } else {
            vec![(0.0, value, 0.0)]
        }
    }
}
