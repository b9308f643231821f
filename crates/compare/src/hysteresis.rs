//! Effect of the hysteresis of the detection: the same samples with one threshold for the beginning and the end of
//! sticks.

use super::Channel;
use super::candidate::Block;
use super::detect::{Detection, Detector, Found, Point};
use serde::Serialize;
use stickslip_system::record::EventKind;

/// How the events of a candidate's samples depend on the hysteresis of the detection.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HysteresisEffect {
    /// |omega_r| up to which a stick begins, rad/s (m/s in translation): the velocity tolerance.
    pub stick_begins: f64,
    /// |omega_r| above which it ends: the tolerance times the hysteresis.
    pub stick_ends: f64,
    /// Events found with the hysteresis.
    pub events: usize,
    /// Events found if a stick ends above the tolerance itself.
    pub events_without: usize,
    /// The count was stopped because omega_r chatters about the tolerance.
    pub chatters: bool,
    /// Median delay of the slips by the hysteresis, s, relative to the nearest slip found without it; `None` without a
    /// slip.
    pub slips_later: Option<f64>,
    /// Largest absolute value of these delays, s.
    pub largest: Option<f64>,
}

/// Finds the events of a candidate's samples without hysteresis.
#[derive(Debug)]
pub struct HysteresisPass {
    detector: Detector,
    detection: Detection,
    velocity: usize,
    force: Option<usize>,
    /// Events with the hysteresis, and the largest number of events without it.
    found: Vec<Found>,
    most: usize,
    /// Slips up to this time, s, do not count: a run that begins in slip may have omega_r = 0 in its first sample.
    begins: f64,
}

impl HysteresisPass {
    /// For blocks with these channels, in which `detection` found the events `found`; slips up to `begins` (s) do not
    /// count. `None` without hysteresis.
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

    /// The effect, after the last sample.
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
