//! Events of a contact without stick: where |omega_r| crosses the threshold that counts as one.

use super::detect::Found;
use crate::record::EventKind;

/// Finds them in samples given in order of time; between samples by a parabola.
#[derive(Debug)]
pub(super) struct Crossings {
    /// rad/s.
    threshold: f64,
    /// The largest error of omega_r by its digits, rad/s.
    rounding: f64,
    /// Time (s) and |omega_r| less the threshold (rad/s) of the last two samples, the latest first.
    recent: [Option<(f64, f64)>; 2],
    /// Found so far.
    pub events: Vec<Found>,
}

impl Crossings {
    /// Before the first sample.
    pub fn new(threshold: f64, rounding: f64) -> Crossings {
        Crossings {
            threshold,
            rounding,
            recent: [None; 2],
            events: Vec::new(),
        }
    }

    /// Takes the next sample: time (s) and omega_r (rad/s).
    pub fn add(&mut self, time: f64, velocity: f64) {
        let now = (time, velocity.abs() - self.threshold);
        if let Some(last) = self.recent[0]
            && (last.1 > 0.0) != (now.1 > 0.0)
        {
            let kind = if now.1 > 0.0 { EventKind::Slip } else { EventKind::Stick };
            let time = zero(self.recent[1], last, now);
            let slope = (now.1 - last.1) / (now.0 - last.0);
            let blind = (self.rounding / slope.abs()).min(now.0 - last.0);
            self.events.push(Found::sampled(time, kind, (last.0, now.0), blind));
        }
        self.recent = [Some(now), self.recent[0]];
    }
}

/// The zero between `b` and `c` of the parabola through three points, or of the straight line through two.
fn zero(a: Option<(f64, f64)>, b: (f64, f64), c: (f64, f64)) -> f64 {
    let slope = (c.1 - b.1) / (c.0 - b.0);
    let bend = a.map_or(0.0, |a| (slope - (b.1 - a.1) / (b.0 - a.0)) / (c.0 - a.0));
    let value = |t: f64| b.1 + (t - b.0) * (slope + bend * (t - c.0));
    let (mut low, mut high) = (b.0, c.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (value(middle) > 0.0) == (b.1 > 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_threshold_is_crossed_where_the_parabola_does() {
        let mut crossings = Crossings::new(0.5, 0.0);
        for k in 0..40 {
            let t = 0.1 * f64::from(k);
            crossings.add(t, 1.0 - (t - 1.93).powi(2));
        }
        let events = crossings.events;
        // |1 - x^2| = 1/2 at x = -+ sqrt(3/2) and -+ sqrt(1/2).
        let expected = [-(1.5f64.sqrt()), -(0.5f64.sqrt()), 0.5f64.sqrt(), 1.5f64.sqrt()];
        assert_eq!(events.len(), 4);
        for (event, x) in events.iter().zip(expected) {
            assert!((event.time - 1.93 - x).abs() < 1e-12, "{event:?}");
        }
        assert_eq!(events[0].kind, EventKind::Stick);
        assert_eq!(events[1].kind, EventKind::Slip);
    }
}
