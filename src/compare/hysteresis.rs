//! What the hysteresis of the detection moves: the same samples with one threshold, at which sticks begin and end.

use super::Channel;
use super::candidate::Block;
use super::detect::{Detection, Detector, Found, Point};
use crate::record::EventKind;
use serde::Serialize;

/// How the events of a candidate's samples depend on the hysteresis of the detection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HysteresisEffect {
    /// |omega_r| up to which a stick begins, rad/s (m/s in translation): the velocity tolerance.
    pub stick_begins: f64,
    /// |omega_r| above which it ends: the tolerance times the hysteresis.
    pub stick_ends: f64,
    /// Events that are found with the hysteresis.
    pub events: usize,
    /// Events that are found if a stick ends above the tolerance itself.
    pub events_without: usize,
    /// The count ended there: omega_r chatters about the tolerance.
    pub chatters: bool,
    /// Median of the times by which the hysteresis moves the slips, s, positive if it makes them later; `None` without a slip. Each
    /// slip is compared with the nearest one that is found without it.
    pub slips_later: Option<f64>,
    /// Largest absolute value of these times, s.
    pub largest: Option<f64>,
}

/// Finds the events of a candidate's samples without hysteresis.
#[derive(Debug)]
pub(super) struct HysteresisPass {
    detector: Detector,
    detection: Detection,
    /// Columns of the relative velocity and the normal force.
    velocity: usize,
    force: Option<usize>,
    /// The events with the hysteresis, and the number of events at which the count without it ends.
    found: Vec<Found>,
    most: usize,
    /// Slips up to here, s, do not count: a run that begins in slip may have omega_r = 0 in its first sample.
    begins: f64,
}

impl HysteresisPass {
    /// Of blocks with these channels, in which `found` are the events by `detection`; slips up to `begins` (s) do not count. `None`
    /// where the detection has no hysteresis.
    pub fn new(channels: &[Channel], detection: Detection, found: &[Found], begins: f64) -> Option<HysteresisPass> {
        let column = |channel: Channel| channels.iter().position(|known| *known == channel);
        let plain = Detection {
            hysteresis: 1.0,
            ..detection
        };
        Some(HysteresisPass {
            detector: Detector::new(plain),
            detection: Some(detection).filter(|detection| detection.hysteresis > 1.0)?,
            velocity: column(Channel::RelativeVelocity)?,
            force: column(Channel::NormalForce),
            found: found.to_vec(),
            most: 10 * found.len() + 1000,
            begins,
        })
    }

    /// Takes the next samples.
    pub fn add(&mut self, block: &Block) {
        let (velocity, none) = (&block.columns[self.velocity], Vec::new());
        let forces = self.force.map_or(&none, |column| &block.columns[column]);
        let mut row = 0;
        while row < block.time.len() && self.detector.count() < self.most {
            row += self
                .detector
                .skip(&velocity[row..], forces.get(row..).unwrap_or_default());
            self.detector.add(Point {
                time: block.time[row],
                velocity: velocity[row],
                normal_force: forces.get(row).copied().unwrap_or(f64::INFINITY),
                torques: None,
            });
            row += 1;
        }
    }

    /// The outcome, after the last sample.
    pub fn finish(self) -> HysteresisEffect {
        let chatters = self.detector.count() >= self.most;
        let mut without = self.detector.finish();
        without.retain(|event| event.kind != EventKind::Slip || event.time > self.begins);
        let slips = |events: &[Found]| -> Vec<f64> {
            let slips = events.iter().filter(|event| event.kind == EventKind::Slip);
            slips.map(|event| event.time).collect()
        };
        let (with, plain) = (slips(&self.found), slips(&without));
        let later = |&time: &f64| {
            let after = plain.partition_point(|other| *other < time);
            let near = [after.checked_sub(1), Some(after)].into_iter().flatten();
            let near = near.filter_map(|k| plain.get(k)).map(|other| time - other);
            near.min_by(|a, b| a.abs().total_cmp(&b.abs()))
        };
        let mut shifts: Vec<f64> = with.iter().filter_map(later).collect();
        shifts.sort_by(f64::total_cmp);
        HysteresisEffect {
            stick_begins: self.detection.velocity_tolerance,
            stick_ends: self.detection.velocity_tolerance * self.detection.hysteresis,
            events: self.found.len(),
            events_without: without.len(),
            chatters,
            slips_later: shifts.get(shifts.len() / 2).copied(),
            largest: shifts.iter().map(|shift| shift.abs()).reduce(f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stick that ends by a relative velocity of 0.1 t rad/s, in samples of 1 ms.
    #[test]
    fn analytic_hysteresis_delays_the_end_of_a_creeping_stick() {
        let detection = Detection {
            velocity_tolerance: 1e-2,
            hysteresis: 2.0,
        };
        let time: Vec<f64> = (-2000..2000).map(|k| 1e-3 * f64::from(k)).collect();
        let velocity = |&t: &f64| if t < -1.0 { -1.0 - t } else { 0.1 * t.max(0.0) };
        let block = Block {
            columns: vec![time.iter().map(velocity).collect()],
            time,
        };
        let mut detector = Detector::new(detection);
        for (&time, &velocity) in block.time.iter().zip(&block.columns[0]) {
            detector.add(Point {
                time,
                velocity,
                normal_force: f64::INFINITY,
                torques: None,
            });
        }
        let found = detector.finish();
        let mut pass = HysteresisPass::new(&[Channel::RelativeVelocity], detection, &found, f64::NEG_INFINITY).unwrap();
        pass.add(&block);
        let effect = pass.finish();
        assert_eq!((effect.events, effect.events_without, effect.chatters), (2, 2, false));
        // The line reaches 0.01 rad/s at 0.1 s and 0.02 rad/s at 0.2 s, each to a sample.
        let later = effect.slips_later.unwrap();
        assert!(
            (later - 0.1).abs() < 2e-3 && effect.largest == Some(later),
            "{effect:?}"
        );
        assert_eq!((effect.stick_begins, effect.stick_ends), (1e-2, 2e-2));
    }

    /// Noise between the two thresholds: without hysteresis each excursion is a slip.
    #[test]
    fn analytic_chatter_between_the_thresholds_is_counted_up_to_a_limit() {
        let detection = Detection {
            velocity_tolerance: 1e-2,
            hysteresis: 2.0,
        };
        let time: Vec<f64> = (0..9000).map(|k| 1e-3 * f64::from(k)).collect();
        let velocity = |&t: &f64| {
            if t < 1.0 {
                1.0
            } else {
                1.5e-2 * f64::from((1e3 * t) as u32 % 2)
            }
        };
        let block = Block {
            columns: vec![time.iter().map(velocity).collect()],
            time,
        };
        let stick = [Found::new(1.0, EventKind::Stick)];
        let mut pass = HysteresisPass::new(&[Channel::RelativeVelocity], detection, &stick, 0.0).unwrap();
        pass.add(&block);
        let effect = pass.finish();
        assert!(effect.chatters && effect.events_without >= 1010, "{effect:?}");
        assert_eq!((effect.slips_later, effect.largest), (None, None));
    }

    #[test]
    fn analytic_one_threshold_has_nothing_to_compare() {
        let plain = Detection {
            velocity_tolerance: 1e-2,
            hysteresis: 1.0,
        };
        assert!(HysteresisPass::new(&[Channel::RelativeVelocity], plain, &[], 0.0).is_none());
    }
}
