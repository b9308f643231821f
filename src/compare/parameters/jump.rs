//! The kick of a candidate, by the jump of its states.

use super::super::Channel;
use super::super::candidate::Block;
use super::super::reference::Physics;
use super::mistake::Rerun;
use super::stretches::MOTION;
use crate::model::Mode;
use crate::model::state::Components;
use crate::record::{Event, State};
use serde::Serialize;

/// How far a sample may be from the kick in natural periods: one step of the Taylor series.
const FARTHEST: f64 = 0.25;
/// What a kick leaves as it is may differ by this part of the kick, and the kick by this part of itself.
const SAME: f64 = 0.03;
const OTHER: f64 = 0.01;

/// The kick of a candidate that differs from the reference's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherKick {
    /// s.
    pub time: f64,
    /// Jump of phi_2' and of phi_1', rad/s.
    pub jumps: [f64; 2],
    /// The same of the reference, rad/s.
    pub reference: [f64; 2],
    /// The case run again with such a kick; `None` if that could not be.
    pub rerun: Option<Rerun>,
}

impl OtherKick {
    /// "its kick is 2.000 times the reference's: ..."
    pub fn words(&self) -> String {
        let ([two, one], [two_r, one_r]) = (self.jumps, self.reference);
        let size = (two - one) / (two_r - one_r);
        let absent = |jump: f64| jump.abs() <= OTHER * (two_r - one_r).abs();
        let half = |jump: f64, reference: f64| (jump - size * reference).abs() <= OTHER * (size * reference).abs();
        let kind = if absent(one) && !absent(two) {
            format!("is on the rotor's surface alone, of {two:.4e} rad/s")
        } else if absent(two) && !absent(one) {
            format!("is on the stator's surface alone, of {one:.4e} rad/s")
        } else if half(two, two_r) && half(one, one_r) {
            format!(
                "is {size:.4} times the reference's, {:.4e} rad/s instead of {:.4e} rad/s",
                two - one,
                two_r - one_r
            )
        } else {
            "is split otherwise".to_owned()
        };
        // What is none shows as rounding.
        let jump = |x: f64| if absent(x) { "0".to_owned() } else { format!("{x:.4e}") };
        format!(
            "the kick at {:.6} s {kind}: phi_2' jumps by {} and phi_1' by {}, the reference's by {two_r:.4e} and {one_r:.4e} rad/s",
            self.time,
            jump(two),
            jump(one)
        )
    }
}

/// The states of a candidate at the time of a kick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Jumped {
    /// `None` if the candidate begins after it.
    pub before: Option<Components>,
    pub after: Components,
}

/// Keeps the samples on both sides of a kick, and the first of all.
#[derive(Debug)]
pub(in super::super) struct JumpPass {
    columns: Option<[usize; 5]>,
    kick: f64,
    before: Option<(f64, Components)>,
    after: Option<(f64, Components)>,
    first: Option<(f64, Components)>,
}

impl JumpPass {
    /// Before the first sample; `channels` are those of the blocks, `kick` (s) is infinite without one.
    pub fn new(channels: &[Channel], kick: f64) -> JumpPass {
        let place = |channel: &Channel| channels.iter().position(|known| known == channel);
        let columns: Option<Vec<usize>> = MOTION.iter().map(place).collect();
        JumpPass {
            columns: columns.and_then(|found| found.try_into().ok()),
            kick,
            before: None,
            after: None,
            first: None,
        }
    }

    /// Takes the next samples.
    pub fn add(&mut self, block: &Block) {
        let Some(columns) = self.columns.filter(|_| !block.time.is_empty()) else {
            return;
        };
        let motion = |row: usize| {
            let [
                rotor_twist,
                rotor_twist_rate,
                stator_twist,
                stator_twist_rate,
                rotor_speed,
            ] = columns.map(|column| block.columns[column][row]);
            let motion = Components {
                rotor_twist,
                rotor_twist_rate,
                stator_twist,
                stator_twist_rate,
                rotor_speed,
                ..Components::default()
            };
            Some((block.time[row], motion))
        };
        if self.first.is_none() {
            self.first = motion(0);
        }
        if self.after.is_some() {
            return;
        }
        let before = block.time.partition_point(|t| *t < self.kick);
        if before > 0 {
            self.before = motion(before - 1);
        }
        // Which side of the kick a sample at its very time shows is open, but for the first of all.
        let at = before + block.time[before..].partition_point(|t| *t <= self.kick);
        let starts_there = self.before.is_none() && at > before;
        let after = if starts_there { before } else { at };
        if after < block.time.len() {
            self.after = motion(after);
        }
    }

    /// The first sample, if the candidate has the whole motion: time (s) and motion.
    pub fn first(&self) -> Option<(f64, Components)> {
        self.first
    }

    /// The states at the kick, by the reference's equations.
    pub fn finish(&self, physics: &Physics) -> Option<Jumped> {
        let near = |(t, _): &(f64, Components)| (t - self.kick).abs() <= FARTHEST * physics.natural_period();
        let at_kick = |(t, motion): (f64, Components)| moved(physics, t, &motion, self.kick);
        let after = self.after.filter(near)?;
        let before = self.before.filter(near);
        // A gap at the kick shows no jump.
        if self.before.is_some() && before.is_none() {
            return None;
        }
        Some(Jumped {
            before: before.map(at_kick),
            after: at_kick(after),
        })
    }
}

/// Steps of the series between two times at most.
const MOST_STEPS: usize = 1000;

/// A motion in slip from one time to another, s, both near.
fn moved(physics: &Physics, from: f64, motion: &Components, to: f64) -> Components {
    let mut course = physics.course();
    let start = State {
        rotor_twist: motion.rotor_twist,
        rotor_twist_rate: motion.rotor_twist_rate,
        phi1: motion.stator_twist,
        phi1_dot: motion.stator_twist_rate,
        theta_dot: motion.rotor_speed,
        ..State::default()
    };
    let mut y = course.state(&start, &[]);
    let (system, driving) = (physics.system(), course.driving(from));
    let mode = Mode::sliding(system.relative_velocity(&driving, &y));
    course.go(mode, (from, to), &mut y, MOST_STEPS, &mut |_, _| {});
    Components {
        rotor_twist: system.rotor.twist(0, &y),
        rotor_twist_rate: system.rotor.twist_rate(0, &y),
        stator_twist: system.stator.twist(0, &y),
        stator_twist_rate: system.stator.twist_rate(0, &y),
        rotor_speed: system.rotor.speed.map_or(0.0, |place| y[place]),
        ..*motion
    }
}

/// phi_2' and phi_1'.
fn surfaces(motion: &Components) -> [f64; 2] {
    [motion.rotor_speed - motion.rotor_twist_rate, motion.stator_twist_rate]
}

/// What the candidate's kick is, if it is another than that of the reference, `event`.
pub(in super::super) fn other_kick(physics: &Physics, event: &Event, jumped: &Jumped) -> Option<OtherKick> {
    let before = jumped.before.unwrap_or_else(|| event.before.torsional());
    let after = jumped.after;
    let difference = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let reference = difference(surfaces(&event.after.torsional()), surfaces(&event.before.torsional()));
    let jumps = difference(surfaces(&after), surfaces(&before));
    let size = (reference[0] - reference[1]).abs();
    let omega = physics.natural_angular_frequency();
    let held = [
        omega * (after.rotor_twist - before.rotor_twist),
        omega * (after.stator_twist - before.stator_twist),
        after.rotor_speed - before.rotor_speed,
    ];
    let largest = jumps.iter().map(|jump| jump.abs()).fold(size, f64::max);
    let continuous = held.iter().all(|change| change.abs() <= SAME * largest);
    let differs = jumps.iter().zip(&reference).any(|(a, b)| (a - b).abs() > OTHER * size);
    // Without any, it is an unperturbed run.
    let is_there = jumps.iter().any(|jump| jump.abs() > OTHER * size);
    (size > 0.0 && continuous && differs && is_there).then_some(OtherKick {
        time: event.time,
        jumps,
        reference,
        rerun: None,
    })
}
