//! First pass over a candidate's samples: its events, its span, the resolution of its times, torques at breakaways.

use super::candidate::{Block, Candidate};
use super::detect::{Crossings, Detection, Detector, Found};
use super::event_errors::{self, EventErrors};
use super::locate::Locator;
use super::reference::Physics;
use super::resolution::{ClockWatch, Resolution, Rounding};
use super::{Channel, CompareError, Reference};
use stickslip_system::model::{BreakawayTest, Mode};
use stickslip_system::record::sequence::SequenceEvent;
use stickslip_system::record::{Event, EventKind};

/// Error of an event found in samples, in distances of times: one for each neighbouring sample.
pub(super) const FOUND: f64 = 2.0;

const MOST_EVENTS: usize = 1_000_000;

#[derive(Debug, Default)]
pub(super) struct Survey {
    pub span: Option<(f64, f64)>,
    /// Mean interval of samples in the reference's stick-slip, s.
    pub interval: Option<f64>,
    pub plateau: f64,
    /// Rounding of the times, and number of rows left out because of it.
    pub rounding: Option<Rounding>,
    pub repeated: u64,
}

enum Finder {
    Given(TorqueWatch),
    /// Its relative velocity, for a contact with stick, and without.
    Detector(Box<Detector>),
    Crossings(Crossings),
}

pub(super) fn resolution_of(candidate: &Candidate, survey: &Survey, errors: &EventErrors) -> Option<Resolution> {
    let clock = &candidate.clock;
    let stated = candidate.events.is_some();
    let rounding = survey.rounding.or(candidate.events_rounding.filter(|_| stated))?;
    let of_event = if stated {
        candidate.events_rounding
    } else {
        survey.rounding
    };
    let last = errors.events.last().map(|event| event.time + event.error);
    let at = last.or(survey.span.map(|(_, to)| to)).unwrap_or(0.0);
    let limit = |time: f64| {
        let several = if stated { 1.0 } else { FOUND };
        of_event.map_or(0.0, |rounding| several * clock.quantum(rounding, time))
    };
    let below = |event: &&event_errors::EventError| event.error.abs() <= limit(event.time + event.error);
    Some(Resolution {
        of: rounding.name(),
        seconds: clock.quantum(rounding, at),
        at,
        repeated: survey.repeated,
        event_error: limit(at),
        events_below: errors.events.iter().filter(below).count(),
    })
}

impl Finder {
    fn finish(self) -> Vec<Found> {
        match self {
            Finder::Given(watch) => watch.events,
            Finder::Detector(detector) => detector.finish(),
            Finder::Crossings(crossings) => crossings.events,
        }
    }
}

fn clock_error(candidate: &Candidate, watch: &ClockWatch, time: f64) -> f64 {
    let rounding = candidate.clock.rounding.filter(|_| watch.is_rounded());
    rounding.map_or(f64::EPSILON * time.abs(), |rounding| {
        candidate.clock.quantum(rounding, time)
    }) / 2.0
}

impl Reference {
    pub(super) fn breaks(&self) -> Vec<f64> {
        let others = self.events.iter().filter(|event| {
            use EventKind::{Contact, Corner, Kick, Separation};
            matches!(event.kind, Contact | Corner | Kick | Separation)
        });
        others.map(|event| event.time).collect()
    }

    /// Reads the times, the relative velocity if events must be found, and the twists for the torques at breakaways.
    /// Returns the events of the candidate, or those found.
    pub(super) fn survey(
        &self,
        candidate: &Candidate,
        detection: Detection,
        progress: &dyn Fn(f64),
    ) -> Result<(Survey, Vec<Found>), CompareError> {
        let physics = &self.physics;
        let given = candidate.events.clone();
        if !candidate.has_rows() {
            return Ok((Survey::default(), given.unwrap_or_default()));
        }
        let twists = physics.torque_channels();
        let with_twists = !candidate.is_own() && twists.iter().all(|&channel| candidate.has(channel));
        let mut locator = match &given {
            Some(_) => None,
            None => Locator::new(physics, candidate, detection.velocity_tolerance, self.breaks()),
        };
        let mut channels = Vec::new();
        if given.is_none() {
            channels.push(Channel::RELATIVE_VELOCITY);
            channels.extend(Some(Channel::NORMAL_FORCE).filter(|&force| candidate.has(force)));
        }
        let base = channels.len();
        if locator.is_some() {
            channels.extend_from_slice(&physics.state);
        } else if with_twists {
            channels.extend_from_slice(&twists);
        }
        let place = |channel: &Channel| channels[base..].iter().position(|known| known == channel);
        let twists: Vec<usize> = twists.iter().filter_map(place).map(|place| base + place).collect();
        let torques = |block: &Block, row: usize| {
            with_twists.then(|| physics.torques_by(block.time[row], |k| block.columns[twists[k]][row]))
        };
        let mut finder = match (given, physics.threshold()) {
            (Some(events), _) => Finder::Given(TorqueWatch::new(events)),
            (None, Some(_)) => {
                let rounding = candidate.rounding_of(Channel::RELATIVE_VELOCITY, detection.velocity_tolerance);
                Finder::Crossings(Crossings::new(detection.velocity_tolerance, rounding))
            }
            (None, None) => Finder::Detector(Box::new(Detector::new(detection))),
        };
        let mut rows = candidate.rows(&channels, physics)?;
        let mut block = Block::default();
        let mut span: Option<(f64, f64)> = None;
        // Samples in the stick-slip: their number, first and last time, s.
        let (stretch, mut inside) = (self.stretch(), None);
        let mut located = 0;
        while rows.next(&mut block)? {
            let (time, c) = (&block.time, &block.columns);
            let clock = clock_error(candidate, rows.watch(), time[time.len() - 1]);
            let to = time[time.len() - 1];
            span = Some((span.map_or(time[0], |span| span.0), to));
            progress(to);
            let first = time.partition_point(|t| *t < stretch.0);
            let last = time.partition_point(|t| *t <= stretch.1);
            if first < last {
                let (count, from, _) = inside.unwrap_or((0, time[first], 0.0));
                inside = Some((count + (last - first) as u64, from, time[last - 1]));
            }
            let count = match &mut finder {
                Finder::Crossings(crossings) => {
                    for (row, (&time, &velocity)) in time.iter().zip(&c[0]).enumerate() {
                        crossings.add(time, velocity);
                        if let Some(locator) = &mut locator {
                            locator.add(time, |k| c[base + k][row]);
                            locator.locate_all(&mut crossings.events, &mut located, clock);
                        }
                    }
                    crossings.events.len()
                }
                Finder::Given(watch) => {
                    for (row, &time) in time.iter().enumerate() {
                        if let Some((rotor, stator)) = torques(&block, row) {
                            watch.add(time, rotor, stator);
                        }
                    }
                    0
                }
                Finder::Detector(detector) => {
                    let forces = if base == 2 { &c[1][..] } else { &[] };
                    let locate = |row: usize, detector: &mut Detector| {
                        if let Some(locator) = &mut locator {
                            locator.add(time[row], |k| c[base + k][row]);
                            locator.locate_all(detector.events(), &mut located, clock);
                        }
                        true
                    };
                    detector.add_all((time, &c[0], forces), |row| torques(&block, row), locate);
                    detector.count()
                }
            };
            if count > MOST_EVENTS {
                let what = format!("more than {MOST_EVENTS} events up to {to:.6} s: omega_r chatters about zero");
                let remedy = "raise --velocity-tolerance above the size of the chatter";
                return Err(CompareError::content(
                    &candidate.path,
                    "relative_velocity",
                    what,
                    remedy,
                ));
            }
        }
        if span.is_none() {
            let remedy = "check how it was written";
            return Err(CompareError::whole(&candidate.path, "holds no samples", remedy));
        }
        let inside = inside.filter(|inside| inside.0 > 1);
        let survey = Survey {
            span,
            interval: inside.map(|(count, from, to)| (to - from) / (count - 1) as f64),
            plateau: match &finder {
                Finder::Detector(detector) => detector.plateau(),
                _ => 0.0,
            },
            repeated: rows.watch().repeated,
            rounding: candidate.clock.rounding.filter(|_| rows.watch().is_rounded()),
        };
        let clock = clock_error(candidate, rows.watch(), survey.span.map_or(0.0, |(_, to)| to));
        let mut events = finder.finish();
        if let Some(locator) = &mut locator {
            locator.locate_all(&mut events, &mut located, clock);
        }
        if survey.rounding.is_some() && candidate.events.is_none() {
            // Both times of an interpolated interval are rounded.
            events.iter_mut().for_each(|event| event.bound += clock);
        }
        Ok((survey, events))
    }
}

/// The torque of `test` at each of the candidate's breakaways with torques, in parts of the limit of stick; in
/// increasing order.
pub(super) fn breakaway_ratios(physics: &Physics, found: &[Found], test: BreakawayTest) -> Vec<f64> {
    let slips = found.iter().filter(|f| f.kind == EventKind::Slip);
    let ratio = |slip: &Found| {
        let (rotor, stator) = slip.torques?;
        let torque = match test {
            BreakawayTest::Transmitted => (rotor + stator) / 2.0,
            BreakawayTest::Stator => stator,
            BreakawayTest::Rotor => rotor,
        };
        let limit = physics.limit(torque, slip.time);
        (limit > 0.0).then(|| torque.abs() / limit)
    };
    let mut ratios: Vec<f64> = slips.filter_map(ratio).collect();
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
                event.torques = torques_at_end(&self.recent, self.passed, event.time);
                event.torque_rate = torque_rate(&self.recent, self.passed);
            }
            self.passed = event.time;
            self.next += 1;
        }
        self.recent = [Some((time, rotor, stator)), self.recent[0], self.recent[1]];
    }
}

/// The rate of T_f = (T_r + T_s)/2 between the last two samples of one stick, N m/s.
fn torque_rate(recent: &[Option<(f64, f64, f64)>; 3], from: f64) -> Option<f64> {
    let [Some(b), Some(a), _] = *recent else {
        return None;
    };
    (a.0 >= from).then(|| ((b.1 - a.1) + (b.2 - a.2)) / 2.0 / (b.0 - a.0))
}

/// Extrapolates the parabolas through three samples of one stick to its end.
fn torques_at_end(recent: &[Option<(f64, f64, f64)>; 3], from: f64, time: f64) -> Option<(f64, f64)> {
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

fn separates_from_stick(event: &Event) -> bool {
    event.kind == EventKind::Separation && event.before.relative_velocity == 0.0
}

fn closes_into_stick(event: &Event) -> bool {
    event.kind == EventKind::Contact && event.mode_after == Mode::Stick
}

/// The event sequence of a run. Without the normal force a separation from stick is the beginning of a slip, and a
/// contact that begins with a stick is that stick; every other separation and contact is invisible.
pub(super) fn sequence(events: &[Event], shows_contact: bool) -> Vec<SequenceEvent> {
    let all = events.iter().filter(|event| event.kind.in_event_sequence());
    let seen = all.filter_map(|event| {
        let kind = match event.kind {
            EventKind::Separation | EventKind::Contact if shows_contact => event.kind,
            _ if separates_from_stick(event) => EventKind::Slip,
            _ if closes_into_stick(event) => EventKind::Stick,
            EventKind::Separation | EventKind::Contact => return None,
            kind => kind,
        };
        Some(SequenceEvent { time: event.time, kind })
    });
    seen.collect()
}

/// A candidate's events without those of a relative velocity that passes zero while the reference's contact is open. A
/// slip that begins with the separation and a stick that begins with the contact stay.
pub(super) fn without_open_contact(found: &[Found], events: &[Event]) -> Vec<Found> {
    let is_change = |event: &&Event| matches!(event.kind, EventKind::Separation | EventKind::Contact);
    let changes: Vec<&Event> = events.iter().filter(is_change).collect();
    let stays = |(row, event): &(usize, &Found)| {
        let next = changes.partition_point(|change| change.time <= event.time);
        let (opens, closes) = (next.checked_sub(1).map(|k| changes[k]), changes.get(next));
        let is_open = match opens {
            Some(change) => change.kind == EventKind::Separation,
            None => closes.is_some_and(|change| change.kind == EventKind::Contact),
        };
        let is_first = |opens: &Event| row.checked_sub(1).is_none_or(|k| found[k].time <= opens.time);
        let is_last = |closes: &&Event| found.get(row + 1).is_none_or(|next| next.time >= closes.time);
        match event.kind {
            _ if !is_open => true,
            EventKind::Slip => opens.is_some_and(|opens| separates_from_stick(opens) && is_first(opens)),
            EventKind::Stick => closes.is_some_and(|closes| closes_into_stick(closes) && is_last(closes)),
            _ => false,
        }
    };
    let seen = found.iter().enumerate().filter(stays);
    seen.map(|(_, event)| *event).collect()
}
