//! Events of a contact without stick: |omega_r| crosses a threshold.

use super::detect::Found;
use stickslip_system::record::EventKind;

/// Finds crossings in samples in order of time; between samples by a parabola.
#[derive(Debug)]
pub struct Crossings {
    threshold: f64,
    rounding: f64,
    /// Time (s) and |omega_r| minus the threshold (rad/s) of the last two samples, the latest first.
    recent: [Option<(f64, f64)>; 2],
    /// Events found so far.
    pub events: Vec<Found>,
}

impl Crossings {
    /// Starts before the first sample, with a threshold and the largest rounding error of omega_r (rad/s).
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

/// The zero between `b` and `c` of the parabola through three points, or of the line through two.
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
