//! A signal as stretches on each of which it is linear.

/// One stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// s.
    pub start: f64,
    /// Where the next begins, s; infinite for the last.
    pub end: f64,
    /// At `start`.
    pub value: f64,
    /// Where the next begins, by that one; `value` for the last.
    pub end_value: f64,
    /// Per second.
    pub slope: f64,
}

impl Piece {
    /// The value at `tau` (s) after the start.
    #[inline]
    pub fn at(&self, tau: f64) -> f64 {
        self.value + self.slope * tau
    }

    /// The integral over the first `tau` s.
    pub fn integral(&self, tau: f64) -> f64 {
        self.value * tau + self.slope * tau * tau / 2.0
    }

    /// The value that the stretch runs to; that at `start` if it never ends.
    pub fn last(&self) -> f64 {
        if self.end.is_finite() {
            self.at(self.end - self.start)
        } else {
            self.value
        }
    }
}

/// A signal from t = 0 on.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces(Vec<Piece>);

impl Pieces {
    /// Of (start, value, slope) of each stretch: the first begins at t = 0, the last never ends.
    pub(super) fn new(stretches: Vec<(f64, f64, f64)>) -> Pieces {
        let next = |index: usize| stretches.get(index + 1).copied();
        let piece = |(index, &(start, value, slope)): (usize, &(f64, f64, f64))| {
            let (end, end_value, _) = next(index).unwrap_or((f64::INFINITY, value, slope));
            Piece {
                start,
                end,
                value,
                end_value,
                slope,
            }
        };
        Pieces(stretches.iter().enumerate().map(piece).collect())
    }

    /// All stretches in order.
    pub fn all(&self) -> &[Piece] {
        &self.0
    }

    /// The place in order of the stretch that holds `t` (s); at a corner, of that after it.
    #[inline]
    pub fn index(&self, t: f64) -> usize {
        self.0.partition_point(|piece| piece.start <= t).saturating_sub(1)
    }

    /// The stretch that holds `t` (s).
    #[inline]
    fn piece(&self, t: f64) -> &Piece {
        &self.0[self.index(t)]
    }

    /// The value at `t` (s).
    pub fn value(&self, t: f64) -> f64 {
        let piece = self.piece(t);
        piece.at(t - piece.start)
    }

    /// The slope at `t` (s), per second; at a corner, that after it.
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

    /// The shortest stretch over which the signal changes, s; infinite if it never does.
    pub fn shortest_change(&self) -> f64 {
        let changing = self.0.iter().filter(|piece| piece.slope != 0.0);
        changing
            .map(|piece| piece.end - piece.start)
            .fold(f64::INFINITY, f64::min)
    }

    /// The largest magnitude of all times.
    pub fn largest(&self) -> f64 {
        let ends = self.0.iter().flat_map(|piece| [piece.value, piece.last()]);
        ends.fold(0.0, |largest, value| largest.max(value.abs()))
    }

    /// Whether the signal is positive right after t = 0.
    pub fn starts_positive(&self) -> bool {
        let first = &self.0[0];
        first.value > 0.0 || (first.value == 0.0 && first.slope > 0.0)
    }
}
