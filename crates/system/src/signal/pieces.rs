//! A signal as a sequence of linear stretches.

/// A sum that is zero up to the rounding of its terms, relative to their size, counts as zero.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

pub(super) fn without_rounding(a: f64, b: f64) -> f64 {
    sum_without_rounding([a, b].into_iter())
}

/// The sum of the terms; zero if it is zero up to their rounding.
pub(super) fn sum_without_rounding(terms: impl Iterator<Item = f64>) -> f64 {
    let (sum, size) = terms.fold((0.0, 0.0), |(sum, size): (f64, f64), term| {
        (sum + term, size + term.abs())
    });
    if sum.abs() <= ROUNDING * size && sum.abs() < size {
        0.0
    } else {
        sum
    }
}

/// A linear stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Start, s.
    pub start: f64,
    /// Start of the next stretch, s; infinite for the last.
    pub end: f64,
    /// Value at `start`.
    pub value: f64,
    /// Value just before `end`; `value` for the last.
    pub end_value: f64,
    /// Slope per second.
    pub slope: f64,
}

impl Piece {
    /// A constant value from `start` (s) on.
    pub fn constant(start: f64, value: f64) -> Piece {
        Piece {
            start,
            end: f64::INFINITY,
            value,
            end_value: value,
            slope: 0.0,
        }
    }

    /// The value at `tau` (s) after the start.
    #[inline]
    pub fn at(&self, tau: f64) -> f64 {
        self.value + self.slope * tau
    }

    /// The value at `t` (s), computed from the nearer end. Next to an end it has the sign that the end's value and
    /// the slope give.
    pub fn beside_ends(&self, t: f64) -> f64 {
        let (since, left) = (t - self.start, self.end - t);
        if since <= left {
            self.at(since)
        } else {
            self.end_value - self.slope * left
        }
    }

    /// The integral from the start to `tau` (s) after it.
    pub fn integral(&self, tau: f64) -> f64 {
        self.value * tau + self.slope * tau * tau / 2.0
    }
}

/// A signal from t = 0 on.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces(pub(super) Vec<Piece>);

impl Pieces {
    /// All stretches in order.
    pub fn all(&self) -> &[Piece] {
        &self.0
    }

    /// Index of the stretch that contains `t` (s); at a corner the later one.
    #[inline]
    pub fn index(&self, t: f64) -> usize {
        self.0.partition_point(|piece| piece.start <= t).saturating_sub(1)
    }

    #[inline]
    fn piece(&self, t: f64) -> &Piece {
        &self.0[self.index(t)]
    }

    /// The value at `t` (s).
    pub fn value(&self, t: f64) -> f64 {
        let piece = self.piece(t);
        piece.at(t - piece.start)
    }

    /// The slope at `t` (s), per second; at a corner the later one.
    pub fn slope(&self, t: f64) -> f64 {
        self.piece(t).slope
    }

    /// The integral from t = 0 to `t` (s).
    pub fn integral(&self, t: f64) -> f64 {
        let begun = self.0.iter().take_while(|piece| piece.start < t);
        begun.map(|piece| piece.integral(piece.end.min(t) - piece.start)).sum()
    }

    /// The first corner after `t`, s.
    pub fn next_corner(&self, t: f64) -> Option<f64> {
        Some(self.piece(t).end).filter(|end| end.is_finite())
    }

    /// All corners after t = 0 in order, s.
    pub fn corners(&self) -> impl Iterator<Item = f64> {
        self.0.iter().map(|piece| piece.end).filter(|end| end.is_finite())
    }

    /// Duration of the shortest stretch with a slope, s; infinite for a constant signal.
    pub fn shortest_change(&self) -> f64 {
        let changing = self.0.iter().filter(|piece| piece.slope != 0.0);
        changing
            .map(|piece| piece.end - piece.start)
            .fold(f64::INFINITY, f64::min)
    }

    /// The largest magnitude.
    pub fn largest(&self) -> f64 {
        let ends = self.0.iter().flat_map(|piece| [piece.value, piece.end_value]);
        ends.fold(0.0, |largest, value| largest.max(value.abs()))
    }

    /// Whether the signal is positive right after t = 0.
    pub fn starts_positive(&self) -> bool {
        let first = &self.0[0];
        first.value > 0.0 || (first.value == 0.0 && first.slope > 0.0)
    }
}
