//! Events found in a time series by its relative velocity.
//!
//! A stick begins where |omega_r| comes within the tolerance, and lasts until |omega_r| exceeds `hysteresis` times the
//! tolerance. A change of sign between two samples, or over one sample within the tolerance, is a reversal.
//!
//! Times are better than the sampling. A stop is the zero of the cubic through the last four samples before it. A
//! breakaway is the zero of omega_r = a x^2 + b x^3 through the first three samples after it, not before |omega_r| begins
//! to rise, or halfway between its samples if there is no such zero. Times stay within their samples, which are their
//! bound. If the state is known, [`super::locate`] does better.

use super::Channel;
use super::candidate::Block;
use serde::Serialize;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::SequenceEvent;

/// An event of a candidate, with evidence of its cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Time, s.
    pub time: f64,
    /// What happened.
    pub kind: EventKind,
    /// T_r and T_s just before, N m, if the candidate has the twists.
    pub torques: Option<(f64, f64)>,
    /// Rate of T_f just before, N m/s, if the candidate has the twists.
    pub torque_rate: Option<f64>,
    /// Relative velocity at the beginning of a stick, rad/s, as far as the samples show it.
    pub dropped: Option<f64>,
    /// Largest error of the time that the samples leave open, s; 0 if the candidate states the time.
    pub bound: f64,
    /// Times of the last sample before and the first after the event, s; the event's own time if it is stated.
    pub between: (f64, f64),
}

impl Found {
    /// An event of which only time (s) and kind are known.
    pub fn new(time: f64, kind: EventKind) -> Found {
        Found {
            time,
            kind,
            torques: None,
            torque_rate: None,
            dropped: None,
            bound: 0.0,
            between: (time, time),
        }
    }

    /// An event between two samples (s); `blind` (s) is added to its bound.
    pub(super) fn sampled(time: f64, kind: EventKind, between: (f64, f64), blind: f64) -> Found {
        Found {
            bound: (time - between.0).max(between.1 - time) + blind,
            between,
            ..Found::new(time, kind)
        }
    }
}

impl From<&Found> for SequenceEvent {
    fn from(found: &Found) -> SequenceEvent {
        SequenceEvent {
            time: found.time,
            kind: found.kind,
        }
    }
}

/// Parameters of the event detection.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Detection {
    /// A relative velocity up to this counts as zero, rad/s.
    pub velocity_tolerance: f64,
    /// A stick ends above this many tolerances; at least 1.
    pub hysteresis: f64,
}

/// Well above the rounding of the speeds of a sticking pair; a slip passes it in a millionth of its period.
pub(crate) const DEFAULT_TOLERANCE: f64 = 1e-8;
/// Noise of the size of the tolerance does not end a stick.
pub(crate) const DEFAULT_HYSTERESIS: f64 = 2.0;

/// A sample for the detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Time, s.
    pub time: f64,
    /// omega_r, rad/s.
    pub velocity: f64,
    /// F_n, N; infinite if the candidate does not have it.
    pub normal_force: f64,
    /// T_r and T_s, N m.
    pub torques: Option<(f64, f64)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum DetectedPhase {
    Start,
    Slip { sense: f64 },
    Stick(Stick),
    Separated,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Stick {
    entry: Option<Found>,
    sense: f64,
    samples: usize,
    last: Point,
    before: Option<Point>,
}

/// A stick that has ended; up to three samples after it give the time of its end.
#[derive(Debug, Clone, PartialEq)]
struct Leaving {
    stick: Stick,
    sense: f64,
    after: Vec<Point>,
    rise: (f64, usize),
}

fn rises(last: &Point, next: &Point) -> bool {
    let (was, is) = (last.velocity, next.velocity);
    is.abs() > was.abs() && is * was >= 0.0
}

/// Finds events in samples given in order of time.
#[derive(Debug, Clone)]
pub struct Detector {
    detection: Detection,
    phase: DetectedPhase,
    leaving: Option<Leaving>,
    recent: [Option<Point>; 4],
    last: f64,
    /// Time from which |omega_r| has risen from sample to sample without a change of sign in the present stick, s, and
    /// number of these samples.
    rise: (f64, usize),
    events: Vec<Found>,
    /// Consecutive samples at which omega_r has stood still outside the tolerance.
    still: usize,
    plateau: f64,
}

/// omega_r stands still if it changes by less than this part of itself, for more samples than an extremum takes.
const STILL: f64 = 1e-9;
const STILL_SAMPLES: usize = 4;
/// Samples of a rise that are still at hand where its event is located.
const MOST_RISING: usize = 6;

impl Detector {
    /// A detector before its first sample.
    pub fn new(detection: Detection) -> Detector {
        Detector {
            detection,
            phase: DetectedPhase::Start,
            leaving: None,
            recent: [None; 4],
            last: f64::NEG_INFINITY,
            rise: (f64::NEG_INFINITY, 0),
            events: Vec::new(),
            still: 0,
            plateau: 0.0,
        }
    }

    fn breakaway(&self, leaving: &Leaving) -> Found {
        let rest = self.detection.velocity_tolerance * self.detection.hysteresis;
        breakaway(leaving, rest)
    }

    /// Largest |omega_r| outside the tolerance at which it stood still, rad/s; 0 if it never did. A solver that does
    /// not bring a stick to rest causes such a plateau.
    pub fn plateau(&self) -> f64 {
        self.plateau
    }

    /// Number of events found so far.
    pub fn count(&self) -> usize {
        self.events.len()
    }

    pub(super) fn events(&mut self) -> &mut [Found] {
        &mut self.events
    }

    /// Skips following samples, given by relative velocity (rad/s) and normal force (N, empty if unknown), that do not
    /// change the result: samples in slip that differ from their predecessors and are followed by four more of the same
    /// kind. Returns their number.
    pub fn skip(&mut self, velocities: &[f64], forces: &[f64]) -> usize {
        let (DetectedPhase::Slip { sense }, Some(last), None) = (self.phase, self.recent[0], &self.leaving) else {
            return 0;
        };
        let mut before = last.velocity;
        let quiet = velocities.iter().position(|&v| {
            let still = (v - before).abs() <= STILL * v.abs();
            before = v;
            still || v * sense <= self.detection.velocity_tolerance
        });
        let quiet = quiet.unwrap_or(velocities.len());
        let touching = forces.iter().take(quiet).position(|&f| f <= 0.0);
        let skipped = touching.unwrap_or(quiet).saturating_sub(4);
        if skipped > 0 {
            self.still = 0;
        }
        skipped
    }

    /// Takes the next sample.
    pub fn add(&mut self, p: Point) {
        let at_rest = p.velocity.abs() <= self.detection.velocity_tolerance;
        if let Some(leaving) = &mut self.leaving {
            let goes_on = !at_rest && p.velocity * leaving.sense > 0.0 && p.normal_force > 0.0;
            if goes_on {
                leaving.after.push(p);
            }
            if !goes_on || leaving.after.len() == 3 {
                let left = self.leaving.take();
                self.events.extend(left.map(|leaving| self.breakaway(&leaving)));
            }
        }
        if p.normal_force <= 0.0 && !matches!(self.phase, DetectedPhase::Start | DetectedPhase::Separated) {
            self.settle();
            self.report(p.time, EventKind::Separation);
            self.phase = DetectedPhase::Separated;
        }
        match self.phase {
            DetectedPhase::Start => self.phase = self.begin(p, None),
            DetectedPhase::Separated => {
                if p.normal_force > 0.0 {
                    self.report(p.time, EventKind::Contact);
                    self.phase = self.begin(p, None);
                }
            }
            DetectedPhase::Slip { sense } => {
                if at_rest {
                    let entry = self.stop(&p);
                    self.phase = self.begin(p, Some((entry, sense)));
                } else if p.velocity * sense < 0.0 {
                    let found = self.crossing(&p);
                    self.events.push(found);
                    self.phase = DetectedPhase::Slip { sense: -sense };
                    self.recent = [None; 4];
                }
            }
            DetectedPhase::Stick(mut stick) => {
                if p.velocity.abs() <= self.detection.velocity_tolerance * self.detection.hysteresis {
                    self.events.extend(stick.entry.take());
                    stick.samples += 1;
                    self.rise = match rises(&stick.last, &p) {
                        true => (self.rise.0, self.rise.1 + 1),
                        false => (p.time, 0),
                    };
                    stick.before = Some(stick.last);
                    stick.last = p;
                    self.phase = DetectedPhase::Stick(stick);
                } else {
                    self.leave(stick, p);
                }
            }
        }
        if let (DetectedPhase::Slip { .. }, Some(last)) = (self.phase, self.recent[0]) {
            let still = (p.velocity - last.velocity).abs() <= STILL * p.velocity.abs();
            self.still = if still { self.still + 1 } else { 0 };
            if self.still >= STILL_SAMPLES {
                self.plateau = self.plateau.max(p.velocity.abs());
            }
        }
        if let DetectedPhase::Slip { .. } = self.phase {
            self.recent = [Some(p), self.recent[0], self.recent[1], self.recent[2]];
        }
        self.last = p.time;
    }

    /// The events, after the last sample.
    pub fn finish(mut self) -> Vec<Found> {
        let left = self.leaving.take();
        self.events.extend(left.map(|leaving| self.breakaway(&leaving)));
        self.settle();
        self.events
    }

    fn report(&mut self, time: f64, kind: EventKind) {
        self.events
            .push(Found::sampled(time, kind, (self.last.min(time), time), 0.0));
    }

    fn settle(&mut self) {
        if let DetectedPhase::Stick(stick) = &mut self.phase {
            self.events.extend(stick.entry.take());
        }
    }

    fn begin(&mut self, p: Point, entry: Option<(Found, f64)>) -> DetectedPhase {
        self.recent = [None; 4];
        self.rise = (p.time, 0);
        if p.velocity.abs() <= self.detection.velocity_tolerance {
            DetectedPhase::Stick(Stick {
                entry: entry.map(|e| e.0),
                sense: entry.map_or(0.0, |e| e.1),
                samples: 1,
                last: p,
                before: None,
            })
        } else {
            DetectedPhase::Slip {
                sense: p.velocity.signum(),
            }
        }
    }

    fn leave(&mut self, mut stick: Stick, p: Point) {
        let sense = p.velocity.signum();
        self.recent = [None; 4];
        self.phase = DetectedPhase::Slip { sense };
        match stick.entry.take() {
            // A single sample at zero between two signs is a crossing.
            Some(entry) if stick.samples == 1 && sense == -stick.sense => {
                let between = (entry.between.0, p.time);
                self.events
                    .push(Found::sampled(entry.time, EventKind::Reversal, between, 0.0));
            }
            entry => {
                self.events.extend(entry);
                self.leaving = Some(Leaving {
                    stick,
                    sense,
                    after: vec![p],
                    rise: self.rise,
                });
            }
        }
    }

    fn crossing(&self, p: &Point) -> Found {
        let Some(q) = self.recent[0] else {
            return Found::sampled(p.time, EventKind::Reversal, (self.last, p.time), 0.0);
        };
        let straight = q.time + (p.time - q.time) * q.velocity / (q.velocity - p.velocity);
        let time = first_zero(&self.recent, p.time).unwrap_or(straight);
        Found::sampled(time, EventKind::Reversal, (q.time, p.time), 0.0)
    }

    fn stop(&self, p: &Point) -> Found {
        let [Some(a), Some(b), ..] = self.recent else {
            let before = self.recent[0].map_or(self.last, |a| a.time).min(p.time);
            return Found::sampled(p.time, EventKind::Stick, (before, p.time), 0.0);
        };
        let slope = (a.velocity - b.velocity) / (a.time - b.time);
        // A motion within the tolerance counts as rest.
        let blind = (self.detection.velocity_tolerance / slope.abs()).min(p.time - a.time);
        let time = first_zero(&self.recent, p.time).unwrap_or(p.time);
        Found {
            dropped: Some((extrapolated(&self.recent, p.time) * a.velocity.signum()).max(0.0)),
            ..Found::sampled(time, EventKind::Stick, (a.time, p.time), blind)
        }
    }
}

/// First zero of the polynomial through up to four samples between the first sample and `end` (s).
fn first_zero(samples: &[Option<Point>; 4], end: f64) -> Option<f64> {
    let a = samples[0]?;
    let passed = |time: f64| extrapolated(samples, time) * a.velocity <= 0.0;
    // Two zeros in one interval belong to a grazing stop, and the first counts.
    const PARTS: u32 = 8;
    let at = |k: u32| a.time + (end - a.time) * f64::from(k) / f64::from(PARTS);
    let k = (1..=PARTS).find(|&k| passed(at(k)))?;
    let (mut low, mut high) = (at(k - 1), at(k));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if passed(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(0.5 * (low + high))
}

/// The polynomial through up to four samples in slip, the nearest first, extrapolated to a time (s); rad/s.
fn extrapolated(samples: &[Option<Point>; 4], time: f64) -> f64 {
    let mut points = [(0.0, 0.0); 4];
    let mut count = 0;
    for (point, p) in points.iter_mut().zip(samples.iter().flatten()) {
        *point = (p.time, p.velocity);
        count += 1;
    }
    // Neville's scheme.
    for width in 1..count {
        for k in 0..count - width {
            let (near, far) = (points[k].0, samples[k + width].map_or(0.0, |p| p.time));
            let part = (time - near) / (far - near);
            points[k].1 += part * (points[k + 1].1 - points[k].1);
        }
    }
    points[0].1
}

fn breakaway(leaving: &Leaving, rest: f64) -> Found {
    let (last, p) = (&leaving.stick.last, &leaving.after[0]);
    let zero = take_off(&leaving.after);
    // A slip begins within the tolerance, where omega_r begins to rise.
    let (rise, rising) = match rises(last, p) {
        true => leaving.rise,
        false => (last.time, 0),
    };
    let time = zero.map_or(0.5 * (last.time + p.time), |zero| zero.clamp(rise, p.time));
    // A slip slower than `rest` counts as rest.
    let slow = (rest / p.velocity.abs()).sqrt();
    let blind = (p.time - zero.unwrap_or(last.time)) * slow;
    // Torques are smooth until the end of the stick.
    let straight = last.torques.and_then(|(r1, s1)| {
        let before = leaving.stick.before?;
        let (r0, s0) = before.torques?;
        let part = (time - last.time) / (last.time - before.time);
        let torques = (r1 + (r1 - r0) * part, s1 + (s1 - s0) * part);
        Some((torques, ((r1 - r0) + (s1 - s0)) / 2.0 / (last.time - before.time)))
    });
    let mut found = Found::sampled(time, EventKind::Slip, (last.time, p.time), blind.max(0.0));
    if rising > 0 {
        found.bound = found.bound.min((time - rise).max(p.time - last.time));
        found.between.0 = if rising < MOST_RISING { rise } else { last.time };
    }
    Found {
        torques: straight.map(|(torques, _)| torques),
        torque_rate: straight.map(|(_, rate)| rate),
        ..found
    }
}

/// Zero of a velocity a x^2 + b x^3, or a x^2 if there are only two samples.
fn take_off(samples: &[Point]) -> Option<f64> {
    let [p, q, rest @ ..] = samples else {
        return None;
    };
    if q.velocity / p.velocity <= 1.0 {
        return None;
    }
    let ratio = (p.velocity / q.velocity).sqrt();
    let parabola = (p.time - ratio * q.time) / (1.0 - ratio);
    let Some(r) = rest.first() else {
        return Some(parabola);
    };
    // For the right zero, v/(t - zero)^2 is a straight line through the samples; the secant method finds it.
    let bend = |zero: f64| {
        let a = [p, q, r].map(|s| (s.time, s.velocity / ((s.time - zero) * (s.time - zero))));
        (a[2].1 - a[1].1) / (a[2].0 - a[1].0) - (a[1].1 - a[0].1) / (a[1].0 - a[0].0)
    };
    let (mut x, mut y) = (parabola, parabola - 0.01 * (q.time - p.time));
    let (mut f, mut g) = (bend(x), bend(y));
    for _ in 0..20 {
        let z = y - g * (y - x) / (g - f);
        if !z.is_finite() || z >= p.time || (z - parabola).abs() > q.time - p.time {
            return Some(parabola);
        }
        (x, f) = (y, g);
        (y, g) = (z, bend(z));
        if (y - x).abs() <= 1e-9 * (q.time - p.time) || g == 0.0 {
            return Some(y);
        }
    }
    Some(parabola)
}

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
