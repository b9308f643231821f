//! Jumps of the states at a kick, which show another kick.

use super::Causes;
use super::parameters::EventAgreement;
use super::search::{Search, Tried};
use crate::Channel;
use crate::candidate::Block;
use crate::diagnosis::CauseKind;
use crate::reference::Physics;
use serde::Serialize;
use stickslip_system::model::equations::Outside;

/// Largest distance of a sample from the kick, in natural periods: one step of the Taylor series.
const FARTHEST: f64 = 0.25;
/// Tolerance of quantities that a kick does not change, in parts of the kick; and of the kick, in parts of itself.
const SAME: f64 = 0.03;
const OTHER: f64 = 0.01;

/// A kick that differs from the reference's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherKick {
    /// Time, s.
    pub time: f64,
    /// Jumps of phi_2' and phi_1', rad/s (m/s in translation).
    pub jumps: [f64; 2],
    /// Jumps of the reference.
    pub reference: [f64; 2],
    /// Unit of the jumps.
    #[serde(skip)]
    pub unit: &'static str,
    /// Agreement of the case with such a kick; `None` if it could not be run.
    pub rerun: Option<EventAgreement>,
}

impl OtherKick {
    pub(crate) fn is_absent(&self) -> bool {
        let size = (self.reference[0] - self.reference[1]).abs();
        self.jumps.iter().all(|jump| jump.abs() <= OTHER * size)
    }

    /// For example "its kick is 2.000 times the reference's: ...".
    pub fn words(&self) -> String {
        let ([two, one], [two_r, one_r], unit) = (self.jumps, self.reference, self.unit);
        let size = (two - one) / (two_r - one_r);
        let absent = |jump: f64| jump.abs() <= OTHER * (two_r - one_r).abs();
        let half = |jump: f64, reference: f64| (jump - size * reference).abs() <= OTHER * (size * reference).abs();
        let kind = match (absent(two), absent(one)) {
            (false, true) => format!("is on the rotor's surface alone, of {two:.4e} {unit}"),
            (true, false) => format!("is on the stator's surface alone, of {one:.4e} {unit}"),
            _ if half(two, two_r) && half(one, one_r) => {
                let (own, other) = (two - one, two_r - one_r);
                format!("is {size:.4} times the reference's, {own:.4e} {unit} instead of {other:.4e} {unit}")
            }
            _ => "is split otherwise".to_owned(),
        };
        let jump = |x: f64| if absent(x) { "0".to_owned() } else { format!("{x:.4e}") };
        let (time, two, one) = (self.time, jump(two), jump(one));
        format!(
            "the kick at {time:.6} s {kind}: the speed of the rotor's surface jumps by {two} and that of the stator's by {one}, the \
             reference's by {two_r:.4e} and {one_r:.4e} {unit}"
        )
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Jumped {
    /// `None` if the candidate begins after the kick.
    pub before: Option<Vec<f64>>,
    pub after: Vec<f64>,
}

type Moment = (f64, Vec<f64>);

#[derive(Debug)]
pub(crate) struct JumpPass<'a> {
    physics: &'a Physics,
    columns: Option<Vec<usize>>,
    kick: f64,
    before: Option<Moment>,
    after: Option<Moment>,
    first: Option<Moment>,
}

impl<'a> JumpPass<'a> {
    /// `channels` are those of the blocks; `kick` (s) is infinite without one.
    pub fn new(physics: &'a Physics, channels: &[Channel], kick: f64) -> JumpPass<'a> {
        JumpPass {
            physics,
            columns: physics.columns(channels),
            kick,
            before: None,
            after: None,
            first: None,
        }
    }

    pub fn add(&mut self, block: &Block) {
        let Some(columns) = self.columns.as_ref().filter(|_| !block.time.is_empty()) else {
            return;
        };
        let state = |row: usize| {
            let y = self.physics.y(|k| block.columns[columns[k]][row]);
            Some((block.time[row], y))
        };
        if self.first.is_none() {
            self.first = state(0);
        }
        if self.after.is_some() {
            return;
        }
        let before = block.time.partition_point(|t| *t < self.kick);
        if before > 0 {
            self.before = state(before - 1);
        }
        // A sample at the time of the kick may show either side, except for the first sample.
        let at = before + block.time[before..].partition_point(|t| *t <= self.kick);
        let starts_there = self.before.is_none() && at > before;
        let after = if starts_there { before } else { at };
        if after < block.time.len() {
            self.after = state(after);
        }
    }

    /// Time (s) and state of the first sample, if the candidate has the whole state.
    pub fn first(&self) -> Option<Moment> {
        self.first.clone()
    }

    /// The states at the kick, by the reference's equations.
    pub fn finish(&self) -> Option<Jumped> {
        let near = |moment: &&Moment| (moment.0 - self.kick).abs() <= FARTHEST * self.physics.natural_period();
        let at_kick = |(t, y): &Moment| moved(self.physics, *t, y, self.kick);
        let after = self.after.as_ref().filter(near)?;
        let before = self.before.as_ref().filter(near);
        if self.before.is_some() && before.is_none() {
            return None;
        }
        Some(Jumped {
            before: before.map(at_kick),
            after: at_kick(after),
        })
    }
}

const MOST_STEPS: usize = 1000;

/// Moves a state in slip between two near times, s.
fn moved(physics: &Physics, from: f64, y: &[f64], to: f64) -> Vec<f64> {
    let (mut course, mut y) = (physics.course(), y.to_vec());
    let w = physics.system().relative_velocity(&course.driving(from), &y);
    course.go(physics.mode(w, 0.0), (from, to), &mut y, MOST_STEPS, &mut |_, _| {});
    y
}

/// Changes between two states at one time: phi_2' and phi_1', and the quantities that a kick does not change, twists as
/// speeds.
fn changes(physics: &Physics, before: &[f64], after: &[f64]) -> ([f64; 2], Vec<f64>) {
    let y: Vec<f64> = after.iter().zip(before).map(|(after, before)| after - before).collect();
    let (system, still) = (physics.system(), Outside::default());
    let omega = physics.natural_angular_frequency();
    let sides = [(&system.rotor, &still.rotor), (&system.stator, &still.stator)];
    let held = sides.iter().flat_map(|(side, driving)| {
        let twists = (0..side.shafts()).map(|shaft| omega * side.twist(shaft, &y));
        twists.chain(side.speeds(driving, &y).into_iter().skip(1))
    });
    let held = held.collect();
    (sides.map(|(side, driving)| side.surface_speed(driving, &y)), held)
}

/// The candidate's kick at `time` (s) if it differs from the reference's, which is given by the states before and after
/// it.
pub(crate) fn other_kick(
    physics: &Physics,
    (time, reference): (f64, &(Vec<f64>, Vec<f64>)),
    jumped: &Jumped,
) -> Option<OtherKick> {
    let before = jumped.before.as_ref().unwrap_or(&reference.0);
    let (jumps, held) = changes(physics, before, &jumped.after);
    let (reference, _) = changes(physics, &reference.0, &reference.1);
    let size = (reference[0] - reference[1]).abs();
    let largest = jumps.iter().map(|jump| jump.abs()).fold(size, f64::max);
    let continuous = held.iter().all(|change| change.abs() <= SAME * largest);
    let differs = jumps.iter().zip(&reference).any(|(a, b)| (a - b).abs() > OTHER * size);
    (size > 0.0 && continuous && differs).then_some(OtherKick {
        time,
        jumps,
        reference,
        unit: physics.vocabulary().unit(Channel::RelativeVelocity),
        rerun: None,
    })
}

/// The kick that the candidate's states show, if it is another; it is added to the report.
pub(crate) fn shown(search: &Search<'_>, tried: &Tried, causes: &mut Causes) -> Option<(CauseKind, String)> {
    let kick = search.other_kick.as_ref()?;
    let events = search.evidence.compared_events();
    let rerun = (events > 0).then(|| EventAgreement::of(events, &tried.judged));
    causes.kick = Some(OtherKick { rerun, ..kick.clone() });
    Some((CauseKind::AnotherKick, kick.words()))
}
