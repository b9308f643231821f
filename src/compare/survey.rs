//! The first pass over a candidate's samples: its events, its span, what its times resolve.

use super::*;

/// The error of an event found in samples: those of the samples around it, in distances of times.
pub(super) const FOUND: f64 = 2.0;

/// Events of a candidate beyond this are chattering.
const MOST_EVENTS: usize = 1_000_000;

/// What one pass over a candidate's samples gives beside its events.
#[derive(Debug, Default)]
pub(super) struct Survey {
    pub span: Option<(f64, f64)>,
    /// Mean interval of samples in the stick-slip of the reference, s.
    pub interval: Option<f64>,
    pub plateau: f64,
    /// To what the times are rounded, if they are, and rows left out for it.
    pub rounding: Option<Rounding>,
    pub repeated: u64,
}

/// Where the events of a candidate come from.
enum Finder {
    /// It states them, and its samples have the torques before them.
    Given(TorqueWatch),
    /// Its relative velocity, of a contact that sticks, and of one that does not.
    Detector(Box<Detector>),
    Crossings(Crossings),
}

/// What the times of a candidate resolve, if they are rounded.
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
    /// The events, after the last sample.
    fn finish(self) -> Vec<Found> {
        match self {
            Finder::Given(watch) => watch.events,
            Finder::Detector(detector) => detector.finish(),
            Finder::Crossings(crossings) => crossings.events,
        }
    }
}

impl Reference {
    /// Goes through the times, through the relative velocity if events have to be found by it, and through the twists for
    /// the torques at breakaways. The events are those of the candidate, or those found.
    pub(super) fn survey(
        &self,
        candidate: &Candidate,
        detection: Detection,
        watch_progress: &mut dyn FnMut(f64),
    ) -> Result<(Survey, Vec<Found>), CompareError> {
        let physics = &self.physics;
        let given = candidate.events.clone();
        if !candidate.has_rows() {
            return Ok((Survey::default(), given.unwrap_or_default()));
        }
        let twists = physics.torque_channels();
        let with_twists = !candidate.is_own() && twists.iter().all(|&channel| candidate.has(channel));
        let mut channels = Vec::new();
        if given.is_none() {
            channels.push(Channel::RelativeVelocity);
            channels.extend(Some(Channel::NormalForce).filter(|&force| candidate.has(force)));
        }
        let twist = channels.len();
        if with_twists {
            channels.extend_from_slice(&twists);
        }
        let torques = |block: &Block, row: usize| {
            with_twists.then(|| physics.torques_by(block.time[row], |k| block.columns[twist + k][row]))
        };
        let mut finder = match (given, physics.threshold()) {
            (Some(events), _) => Finder::Given(TorqueWatch::new(events)),
            (None, Some(_)) => Finder::Crossings(Crossings::new(detection.velocity_tolerance)),
            (None, None) => Finder::Detector(Box::new(Detector::new(detection))),
        };
        let mut rows = candidate.rows(&channels, physics)?;
        let mut block = Block::default();
        let mut span: Option<(f64, f64)> = None;
        // Samples in the stick-slip: how many, the first and the last, s.
        let (stretch, mut inside) = (self.stretch(), None);
        while rows.next(&mut block)? {
            let (time, c) = (&block.time, &block.columns);
            let to = time[time.len() - 1];
            span = Some((span.map_or(time[0], |span| span.0), to));
            watch_progress(to);
            let first = time.partition_point(|t| *t < stretch.0);
            let last = time.partition_point(|t| *t <= stretch.1);
            if first < last {
                let (count, from, _) = inside.unwrap_or((0, time[first], 0.0));
                inside = Some((count + (last - first) as u64, from, time[last - 1]));
            }
            let count = match &mut finder {
                Finder::Crossings(crossings) => {
                    time.iter()
                        .zip(&c[0])
                        .for_each(|(&time, &velocity)| crossings.add(time, velocity));
                    crossings.events.len()
                }
                Finder::Given(watch) => {
                    for (row, &time) in time.iter().enumerate() {
                        torques(&block, row)
                            .into_iter()
                            .for_each(|(rotor, stator)| watch.add(time, rotor, stator));
                    }
                    0
                }
                Finder::Detector(detector) => {
                    let forces = if twist == 2 { &c[1][..] } else { &[] };
                    let mut row = 0;
                    while row < time.len() {
                        row += detector.skip(&c[0][row..], forces.get(row..).unwrap_or_default());
                        detector.add(Point {
                            time: time[row],
                            velocity: c[0][row],
                            normal_force: forces.get(row).copied().unwrap_or(f64::INFINITY),
                            torques: torques(&block, row),
                        });
                        row += 1;
                    }
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
            return Err(CompareError::whole(
                &candidate.path,
                "holds no samples",
                "check how it was written",
            ));
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
        Ok((survey, finder.finish()))
    }
}
