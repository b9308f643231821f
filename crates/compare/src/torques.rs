//! Torques at the breakaways that a candidate states, from the samples before them.

use super::detect::Found;
use super::reference::Physics;
use stickslip_system::model::BreakawayTest;
use stickslip_system::record::EventKind;

/// The torque of `test` at each of the candidate's breakaways with torques, in parts of the limit of stick; in
/// increasing order.
pub(super) fn breakaway_ratios(physics: &Physics, found: &[Found], test: BreakawayTest) -> Vec<f64> {
    let slips = found.iter().filter(|f| f.kind == EventKind::Slip);
    let mut ratios: Vec<f64> = slips
        .filter_map(|f| {
            let (rotor, stator) = f.torques?;
            let torque = match test {
                BreakawayTest::Transmitted => (rotor + stator) / 2.0,
                BreakawayTest::Stator => stator,
                BreakawayTest::Rotor => rotor,
            };
            let limit = physics.limit(torque, f.time);
            (limit > 0.0).then(|| torque.abs() / limit)
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios
}

/// Fills in the torques of given events from samples in order of time.
#[derive(Debug)]
pub struct TorqueWatch {
    /// The events, with the torques at those that have passed.
    pub events: Vec<Found>,
    next: usize,
    passed: f64,
    /// Time (s), T_r and T_s (N m) of the last three samples, the latest first.
    recent: [Option<(f64, f64, f64)>; 3],
}

impl TorqueWatch {
    /// Starts before the first sample.
    pub fn new(events: Vec<Found>) -> TorqueWatch {
        TorqueWatch {
            events,
            next: 0,
            passed: f64::NEG_INFINITY,
            recent: [None; 3],
        }
    }

    /// Takes a sample: time (s), T_r and T_s (N m).
    pub fn add(&mut self, time: f64, rotor: f64, stator: f64) {
        while let Some(event) = self.events.get_mut(self.next).filter(|event| event.time <= time) {
            if event.kind == EventKind::Slip && event.torques.is_none() {
                event.torques = extrapolated(&self.recent, self.passed, event.time);
                event.torque_rate = rate(&self.recent, self.passed);
            }
            self.passed = event.time;
            self.next += 1;
        }
        self.recent = [Some((time, rotor, stator)), self.recent[0], self.recent[1]];
    }
}

/// The rate of T_f = (T_r + T_s)/2 between the last two samples of one stick, N m/s.
fn rate(recent: &[Option<(f64, f64, f64)>; 3], from: f64) -> Option<f64> {
    let [Some(b), Some(a), _] = *recent else {
        return None;
    };
    (a.0 >= from).then(|| ((b.1 - a.1) + (b.2 - a.2)) / 2.0 / (b.0 - a.0))
}

/// Extrapolates the parabolas through three samples of one stick to its end.
fn extrapolated(recent: &[Option<(f64, f64, f64)>; 3], from: f64, time: f64) -> Option<(f64, f64)> {
    let [Some(a), Some(b), Some(c)] = *recent else {
        return None;
    };
    if c.0 < from {
        return None;
    }
    let weight = |p: f64, q: f64, r: f64| (time - q) * (time - r) / ((p - q) * (p - r));
    let (wa, wb, wc) = (weight(a.0, b.0, c.0), weight(b.0, a.0, c.0), weight(c.0, a.0, b.0));
    Some((wa * a.1 + wb * b.1 + wc * c.1, wa * a.2 + wb * b.2 + wc * c.2))
}
