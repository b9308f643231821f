//! Events found in a time series by its relative velocity.
//!
//! A stick begins where |omega_r| comes within the tolerance and lasts until it exceeds `hysteresis` times the
//! tolerance; a change of sign between two samples, or over one sample within the tolerance, is a reversal. Times are
//! better than the sampling: a stop is the zero of the cubic through the last four samples before it, a breakaway is
//! where omega_r, of which the first three samples give the square and the cube of the time since, was zero, or where it
//! grows linearly the zero of the cubic through the first four. Neither leaves its pair of samples, which is its bound. Where the state is known, [`super::locate`] does better.

use crate::record::EventKind;
use crate::record::sequence::SequenceEvent;

/// An event of a candidate, with what it tells about its cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// s.
    pub time: f64,
    /// What happened.
    pub kind: EventKind,
    /// T_r and T_s just before, N m, if the candidate has the twists.
    pub torques: Option<(f64, f64)>,
    /// How fast T_f changes just before, N m/s, if the candidate has the twists.
    pub torque_rate: Option<f64>,
    /// Of a stick: the relative velocity that was left when it began, rad/s, as far as the samples show.
    pub dropped: Option<f64>,
    /// Largest error of the time that the samples leave open, s; 0 where the candidate states it.
    pub bound: f64,
    /// Times of the last sample before it and of the first one behind it, s; the event's own where it is stated.
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

    /// An event at a time between two samples (s), which cannot show `blind` (s) of the motion beside it.
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

/// How events are found.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Detection {
    /// A relative velocity up to this counts as zero, rad/s.
    pub velocity_tolerance: f64,
    /// A stick ends above this many tolerances; at least 1.
    pub hysteresis: f64,
}

/// Rounding of the speeds of a sticking pair, with room to spare; a slip passes it in a millionth of its period.
pub(crate) const DEFAULT_TOLERANCE: f64 = 1e-8;
/// Enough that noise of the size of the tolerance does not end a stick.
pub(crate) const DEFAULT_HYSTERESIS: f64 = 2.0;

/// One sample, as far as detection needs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// s.
    pub time: f64,
    /// omega_r, rad/s.
    pub velocity: f64,
    /// F_n, N; infinite if the candidate does not have it.
    pub normal_force: f64,
    /// T_r and T_s, N m.
    pub torques: Option<(f64, f64)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Start,
    Slip { sense: f64 },
    Stick(Stick),
    Separated,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Stick {
    /// The event that began it, until it has been reported.
    entry: Option<Found>,
    sense: f64,
    samples: usize,
    /// The last two samples within it.
    last: Point,
    before: Option<Point>,
}

/// A stick that has ended: the time of its end follows from up to three samples after it.
#[derive(Debug, Clone, PartialEq)]
struct Leaving {
    stick: Stick,
    sense: f64,
    after: Vec<Point>,
}

/// How omega_r grows after a breakaway.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TakeOff {
    /// By the square of the time: the friction of slip begins where that of stick ends.
    #[default]
    Quadratic,
    /// By the time: it jumps.
    Linear,
}

/// Finds events in samples given in order of time.
#[derive(Debug, Clone)]
pub struct Detector {
    detection: Detection,
    take_off: TakeOff,
    phase: Phase,
    leaving: Option<Leaving>,
    /// The last four samples in slip, the latest first.
    recent: [Option<Point>; 4],
    /// Time of the last sample, s.
    last: f64,
    events: Vec<Found>,
    /// Samples in a row at which omega_r has stood still outside the tolerance.
    still: usize,
    plateau: f64,
}

/// omega_r stands still where it changes by no more than this part of itself, for more samples than an extremum takes.
const STILL: f64 = 1e-9;
const STILL_SAMPLES: usize = 4;

impl Detector {
    /// A detector before its first sample.
    pub fn new(detection: Detection) -> Detector {
        Detector {
            detection,
            take_off: TakeOff::default(),
            phase: Phase::Start,
            leaving: None,
            recent: [None; 4],
            last: f64::NEG_INFINITY,
            events: Vec::new(),
            still: 0,
            plateau: 0.0,
        }
    }

    /// Sets how the relative velocity grows after a breakaway.
    pub fn with_take_off(self, take_off: TakeOff) -> Detector {
        Detector { take_off, ..self }
    }

    /// The end of a stick, by the first samples after it.
    fn breakaway(&self, leaving: &Leaving) -> Found {
        let rest = self.detection.velocity_tolerance * self.detection.hysteresis;
        breakaway(leaving, rest, self.take_off)
    }

    /// The largest |omega_r| outside the tolerance at which it stood still, rad/s; 0 if it never did. A stick that a
    /// solver does not bring to rest looks like that.
    pub fn plateau(&self) -> f64 {
        self.plateau
    }

    /// How many events were found so far.
    pub fn count(&self) -> usize {
        self.events.len()
    }

    /// The events found so far.
    pub(super) fn events(&mut self) -> &mut [Found] {
        &mut self.events
    }

    /// Passes over those of the next samples, given by relative velocity (rad/s) and normal force (N, empty if there is
    /// none), without which the same is found: in slip, each other than the one before, with four more of the kind after
    /// them. Returns their number.
    pub fn skip(&mut self, velocities: &[f64], forces: &[f64]) -> usize {
        let (Phase::Slip { sense }, Some(last), None) = (self.phase, self.recent[0], &self.leaving) else {
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
            let enough = match self.take_off {
                TakeOff::Quadratic => 3,
                TakeOff::Linear => 4,
            };
            if !goes_on || leaving.after.len() == enough {
                let left = self.leaving.take();
                self.events.extend(left.map(|leaving| self.breakaway(&leaving)));
            }
        }
        if p.normal_force <= 0.0 && !matches!(self.phase, Phase::Start | Phase::Separated) {
            self.settle();
            self.report(p.time, EventKind::Separation);
            self.phase = Phase::Separated;
        }
        match self.phase {
            Phase::Start => self.phase = self.begin(p, None),
            Phase::Separated => {
                if p.normal_force > 0.0 {
                    self.report(p.time, EventKind::Contact);
                    self.phase = self.begin(p, None);
                }
            }
            Phase::Slip { sense } => {
                if at_rest {
                    let entry = self.stop(&p);
                    self.phase = self.begin(p, Some((entry, sense)));
                } else if p.velocity * sense < 0.0 {
                    let found = self.crossing(&p);
                    self.events.push(found);
                    self.phase = Phase::Slip { sense: -sense };
                    self.recent = [None; 4];
                }
            }
            Phase::Stick(mut stick) => {
                if p.velocity.abs() <= self.detection.velocity_tolerance * self.detection.hysteresis {
                    self.events.extend(stick.entry.take());
                    stick.samples += 1;
                    stick.before = Some(stick.last);
                    stick.last = p;
                    self.phase = Phase::Stick(stick);
                } else {
                    self.leave(stick, p);
                }
            }
        }
        if let (Phase::Slip { .. }, Some(last)) = (self.phase, self.recent[0]) {
            let still = (p.velocity - last.velocity).abs() <= STILL * p.velocity.abs();
            self.still = if still { self.still + 1 } else { 0 };
            if self.still >= STILL_SAMPLES {
                self.plateau = self.plateau.max(p.velocity.abs());
            }
        }
        if let Phase::Slip { .. } = self.phase {
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

    /// An event that the normal force shows at `time` (s).
    fn report(&mut self, time: f64, kind: EventKind) {
        self.events
            .push(Found::sampled(time, kind, (self.last.min(time), time), 0.0));
    }

    /// A stick that is under way has begun.
    fn settle(&mut self) {
        if let Phase::Stick(stick) = &mut self.phase {
            self.events.extend(stick.entry.take());
        }
    }

    fn begin(&mut self, p: Point, entry: Option<(Found, f64)>) -> Phase {
        self.recent = [None; 4];
        if p.velocity.abs() <= self.detection.velocity_tolerance {
            Phase::Stick(Stick {
                entry: entry.map(|e| e.0),
                sense: entry.map_or(0.0, |e| e.1),
                samples: 1,
                last: p,
                before: None,
            })
        } else {
            Phase::Slip {
                sense: p.velocity.signum(),
            }
        }
    }

    fn leave(&mut self, mut stick: Stick, p: Point) {
        let sense = p.velocity.signum();
        self.recent = [None; 4];
        self.phase = Phase::Slip { sense };
        match stick.entry.take() {
            // One sample at zero between two signs is a crossing that happened to be hit.
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
                });
            }
        }
    }

    /// The change of sign between the last sample and `p`.
    fn crossing(&self, p: &Point) -> Found {
        let Some(q) = self.recent[0] else {
            return Found::sampled(p.time, EventKind::Reversal, (self.last, p.time), 0.0);
        };
        let straight = q.time + (p.time - q.time) * q.velocity / (q.velocity - p.velocity);
        let time = first_zero(&self.recent, p.time).unwrap_or(straight);
        Found::sampled(time, EventKind::Reversal, (q.time, p.time), 0.0)
    }

    /// The stick that begins between the last sample and `p`.
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

/// The zero of the polynomial through up to four samples that is met first on the way from the first of them to `end` (s).
fn first_zero(samples: &[Option<Point>; 4], end: f64) -> Option<f64> {
    let a = samples[0]?;
    let passed = |time: f64| extrapolated(samples, time) * a.velocity <= 0.0;
    // Two zeros in one interval are those of a grazing stop, of which the first counts.
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

/// The polynomial through up to four samples in slip, the nearest first, at a time (s) beyond them, rad/s.
fn extrapolated(samples: &[Option<Point>; 4], time: f64) -> f64 {
    let mut points = [(0.0, 0.0); 4];
    let mut count = 0;
    for (point, p) in points.iter_mut().zip(samples.iter().flatten()) {
        *point = (p.time, p.velocity);
        count += 1;
    }
    // By Neville's scheme.
    for width in 1..count {
        for k in 0..count - width {
            let (near, far) = (points[k].0, samples[k + width].map_or(0.0, |p| p.time));
            let part = (time - near) / (far - near);
            points[k].1 += part * (points[k + 1].1 - points[k].1);
        }
    }
    points[0].1
}

/// The end of a stick, by the first samples after it.
fn breakaway(leaving: &Leaving, rest: f64, by: TakeOff) -> Found {
    let (last, p) = (&leaving.stick.last, &leaving.after[0]);
    let zero = match by {
        TakeOff::Quadratic => take_off(&leaving.after),
        TakeOff::Linear => {
            let first: [Option<Point>; 4] = std::array::from_fn(|k| leaving.after.get(k).copied());
            // It may fall towards a zero before the last sample at rest.
            let falls = || extrapolated(&first, last.time).abs() < p.velocity.abs();
            first_zero(&first, last.time).or_else(|| falls().then_some(last.time))
        }
    };
    let time = zero.unwrap_or(0.5 * (last.time + p.time)).clamp(last.time, p.time);
    // A slip that is slower than `rest` counts as rest.
    let slow = match by {
        TakeOff::Quadratic => (rest / p.velocity.abs()).sqrt(),
        TakeOff::Linear => rest / p.velocity.abs(),
    };
    let blind = (p.time - zero.unwrap_or(last.time)) * slow;
    // Torques run on smoothly until the end of the stick.
    let straight = last.torques.and_then(|(r1, s1)| {
        let before = leaving.stick.before?;
        let (r0, s0) = before.torques?;
        let part = (time - last.time) / (last.time - before.time);
        let torques = (r1 + (r1 - r0) * part, s1 + (s1 - s0) * part);
        Some((torques, ((r1 - r0) + (s1 - s0)) / 2.0 / (last.time - before.time)))
    });
    Found {
        torques: straight.map(|(torques, _)| torques),
        torque_rate: straight.map(|(_, rate)| rate),
        ..Found::sampled(time, EventKind::Slip, (last.time, p.time), blind.max(0.0))
    }
}

/// The time at which a velocity that grows as a x^2 + b x^3, or as a x^2 if there are but two samples, was zero.
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
    // v/(t - zero)^2 is a straight line through the samples for the right zero; the secant method finds it.
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

#[cfg(test)]
mod tests {
    use super::*;

    const SIMPLE: Detection = Detection {
        velocity_tolerance: 1e-6,
        hysteresis: 2.0,
    };

    fn found(detection: Detection, velocity: impl Fn(f64) -> f64, times: impl Iterator<Item = f64>) -> Vec<Found> {
        let mut detector = Detector::new(detection);
        for time in times {
            detector.add(Point {
                time,
                velocity: velocity(time),
                normal_force: f64::INFINITY,
                torques: None,
            });
        }
        detector.finish()
    }

    /// Stops with a parabola at 1.2345, breaks away with a parabola and a cubic at 2.3456.
    fn stick_and_slip(t: f64) -> f64 {
        if t < 1.2345 {
            let x = 1.2345 - t;
            x + 0.3 * x * x
        } else if t < 2.3456 {
            0.0
        } else {
            0.7 * (t - 2.3456).powi(2) - 0.4 * (t - 2.3456).powi(3)
        }
    }

    #[test]
    fn analytic_times_between_samples_are_those_of_parabolas() {
        let events = found(SIMPLE, stick_and_slip, (0..300).map(|k| 0.01 * f64::from(k)));
        assert_eq!(
            events.iter().map(|e| e.kind).collect::<Vec<_>>(),
            [EventKind::Stick, EventKind::Slip]
        );
        // Exact but for rounding, which the differences of samples amplify by 1/h^2 (1e4), and where the secant stops.
        assert!((events[0].time - 1.2345).abs() < 1e-11, "{events:?}");
        assert!((events[1].time - 2.3456).abs() < 1e-10, "{events:?}");
    }

    #[test]
    fn analytic_a_linear_take_off_is_found_by_its_cubic() {
        let velocity = |t: f64| {
            let x = (t - 2.3456).max(0.0);
            0.7 * x - 0.4 * x * x + 0.1 * x * x * x
        };
        let times = || (0..300).map(|k| 0.01 * f64::from(k));
        let time = |take_off| {
            let mut detector = Detector::new(SIMPLE).with_take_off(take_off);
            for time in times() {
                detector.add(Point {
                    time,
                    velocity: velocity(time),
                    normal_force: f64::INFINITY,
                    torques: None,
                });
            }
            let events = detector.finish();
            assert_eq!(events.len(), 1, "{events:?}");
            events[0].time
        };
        assert!((time(TakeOff::Linear) - 2.3456).abs() < 1e-12);
        // The parabola takes it for a slower one.
        assert!((time(TakeOff::Quadratic) - 2.3456).abs() > 1e-3);
    }

    #[test]
    fn analytic_crossings_are_reversals_also_through_a_sample_at_zero() {
        let times = (0..21).map(|k| 0.1 * f64::from(k) - 1.0);
        let events = found(SIMPLE, |t| -t, times.clone());
        assert_eq!(events.len(), 1);
        assert_eq!(
            (events[0].kind, events[0].time.abs() < 1e-12),
            (EventKind::Reversal, true)
        );
        let events = found(SIMPLE, |t| 0.05 - t, times);
        assert_eq!(events.len(), 1);
        assert!((events[0].time - 0.05).abs() < 1e-12);
    }

    #[test]
    fn analytic_noise_below_the_hysteresis_ends_no_stick() {
        let noisy = |t: f64| if t < 1.0 { 1.0 - t } else { 1.9e-6 * (1e4 * t).sin() };
        let times = || (0..300).map(|k| 0.01 * f64::from(k));
        assert_eq!(found(SIMPLE, noisy, times()).len(), 1);
        let tight = Detection {
            velocity_tolerance: 1e-9,
            hysteresis: 2.0,
        };
        assert!(found(tight, noisy, times()).len() > 20);
    }

    #[test]
    fn analytic_the_speed_that_a_wide_tolerance_drops_is_seen() {
        let dropped = |t: f64| if t < 0.7 { 1.0 - t } else { 0.0 };
        let events = found(SIMPLE, dropped, (0..100).map(|k| 0.01 * f64::from(k)));
        let left = events[0].dropped.unwrap();
        assert!((left - 0.3).abs() < 0.011, "{left}");
    }
}
