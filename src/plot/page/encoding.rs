//! Arrays as texts in less space than doubles take.

use crate::plot::html::{doubles, encoded};
use serde::Serialize;

/// Values that share a base in [`Packed`].
pub(super) const BLOCK: usize = 128;

/// Codes.
pub(super) fn codes(values: &[i8]) -> String {
    encoded(values.iter().map(|code| code.cast_unsigned()))
}

/// A column in half the space of doubles: for each [`BLOCK`] of values a base as a double, and every value as
/// a single-precision offset from its base.
///
/// The base is the block's first value: an energy of 11 kJ keeps the microjoules by which it changes within a
/// cycle. Where a block has values below half of its largest, the base is 0 instead, so that what is zero (the
/// relative velocity in stick) stays zero, and what is small keeps its digits. Either way the error is at most 2^-23
/// of the range of the block: with the first value as base an offset is no larger than the range, and with 0 a
/// value is no larger than twice the range; a rounding is 2^-24 of the number. Beyond the range of single precision,
/// offsets above 3.4e38 become infinite, and those below 1e-45 become 0.
#[derive(Debug, Serialize)]
pub(super) struct Packed {
    base: String,
    offset: String,
}

impl Packed {
    pub(super) fn new(values: &[f64]) -> Self {
        let bases: Vec<f64> = values.chunks(BLOCK).map(base_of).collect();
        let offsets = values.iter().enumerate().map(|(i, v)| (v - bases[i / BLOCK]) as f32);
        Packed {
            base: doubles(&bases),
            offset: encoded(offsets.flat_map(f32::to_le_bytes)),
        }
    }
}

fn base_of(block: &[f64]) -> f64 {
    let finite = || block.iter().copied().filter(|v| v.is_finite());
    let (least, most) = finite().fold((f64::INFINITY, 0.0), |(least, most): (f64, f64), v| {
        (least.min(v.abs()), most.max(v.abs()))
    });
    if least < most / 2.0 {
        0.0
    } else {
        finite().next().unwrap_or(0.0)
    }
}
