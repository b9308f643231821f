//! The paper's statistics and the periodic motions (attractors) of both runs.

use super::candidate::Block;
use serde::Serialize;
use stickslip_files::{ResultError, ResultFile};
use stickslip_system::record::sequence::SequenceEvent;
use stickslip_system::record::{CycleStatistics, EventKind};

/// A statistic of the stick-slip of both runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Statistic {
    /// Name as in requirements: "onset", "sticks", ...
    pub name: &'static str,
    /// "s", "1" for a count, or the unit of a position.
    pub unit: &'static str,
    /// Value of the reference; `None` if it has none.
    pub reference: Option<f64>,
    /// Value of the candidate; `None` if it has none.
    pub candidate: Option<f64>,
    /// Whether the candidate's samples cover the statistic.
    pub covered: bool,
}

impl Statistic {
    /// Candidate minus reference; 0 if neither run has a value; `None` if only one has it, or if the candidate does not
    /// cover it.
    pub fn error(&self) -> Option<f64> {
        match (self.reference, self.candidate) {
            (Some(r), Some(c)) => Some(c - r),
            (None, None) if self.covered => Some(0.0),
            _ => None,
        }
    }
}

type CandidateStatistic = fn(&CycleStatistics) -> Option<f64>;

pub(super) const STATISTICS: [(&str, &str, CandidateStatistic); 10] = [
    ("onset", "s", |s| s.onset_time),
    ("final_stick", "s", |s| s.final_stick_time),
    ("sticks", "1", |s| Some(s.stick_count as f64)),
    ("slips", "1", |s| Some(s.slip_count as f64)),
    ("first_period", "s", CycleStatistics::first_period),
    ("last_period", "s", CycleStatistics::last_period),
    ("first_stick_duration", "s", |s| s.first.map(|c| c.stick_duration)),
    ("last_stick_duration", "s", |s| s.last.map(|c| c.stick_duration)),
    ("first_slip_duration", "s", |s| s.first.map(|c| c.slip_duration)),
    ("last_slip_duration", "s", |s| s.last.map(|c| c.slip_duration)),
];

pub(super) const OF_ATTRACTORS: [&str; 3] = ["period", "sticks_in_a_period", "amplitude"];

pub(super) fn of_attractors(attractors: &[Option<ComparedAttractor>; 2], unit: &'static str) -> [Statistic; 3] {
    let numbers: [fn(&ComparedAttractor) -> Option<f64>; 3] = [
        |attractor| Some(attractor.period),
        |attractor| Some(attractor.sticks as f64),
        |attractor| attractor.amplitude,
    ];
    let units = ["s", "1", unit];
    std::array::from_fn(|k| {
        let [reference, candidate] = attractors.map(|attractor| attractor.as_ref().and_then(numbers[k]));
        Statistic {
            name: OF_ATTRACTORS[k],
            unit: units[k],
            reference,
            candidate,
            covered: true,
        }
    })
}

/// The statistics of two words. A candidate that begins after the first event has no onset and no first durations. If
/// it ends before the reference's last event, neither run has a final stick. A candidate that covers no event of a
/// reference with events has no statistics.
pub(super) fn statistics(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    (from_start, to_end): (bool, bool),
    uncovered: usize,
) -> Vec<Statistic> {
    let of = |word: &[SequenceEvent]| CycleStatistics::of_events(word.iter().map(|e| (e.time, e.kind))).0;
    let (r, c) = (of(reference), of(candidate));
    let covered = |name: &str| {
        let of_start = name == "onset" || name.starts_with("first");
        let of_end = name == "final_stick" || name.starts_with("last");
        let any = uncovered == 0 || !reference.is_empty();
        any && (from_start || !of_start) && (to_end || !of_end)
    };
    let statistic = |&(name, unit, quantity): &(&'static str, &'static str, CandidateStatistic)| Statistic {
        name,
        unit,
        reference: quantity(&r).filter(|_| covered(name)),
        candidate: quantity(&c).filter(|_| covered(name)),
        covered: covered(name),
    };
    STATISTICS.iter().map(statistic).collect()
}

/// A periodic motion in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ComparedAttractor {
    /// s.
    pub period: f64,
    /// Sticks that begin in a period.
    pub sticks: u64,
    /// Half the range of the position over a period, rad (m in translation); `None` if unknown.
    pub amplitude: Option<f64>,
}

const LONGEST: usize = 64;

/// Largest relative difference between two successive periods.
const SAME: f64 = 1e-4;

impl ComparedAttractor {
    pub(super) fn of_file(file: &ResultFile) -> Result<Option<ComparedAttractor>, ResultError> {
        let Some(table) = file.stick_slip()? else {
            return Ok(None);
        };
        let number = |name: &str| table.value(name).filter(|value| value.is_finite());
        Ok(number("attractor_period").map(|period| ComparedAttractor {
            period,
            sticks: number("attractor_sticks").unwrap_or(0.0) as u64,
            amplitude: number("attractor_amplitude"),
        }))
    }

    /// The shortest repetition of kinds and intervals that occurs twice in a row at the end of `events`, and the start
    /// of its last period (s). `slack`: uncertainty of the times, s.
    ///
    /// Events do not tell which way a contact slips, so a motion that is symmetric in both directions repeats twice in
    /// a period. `reference`, a word with its period (s), resolves this: if its repetition has as many sections as the
    /// candidate's, a period of the candidate has as many repetitions as one of the reference.
    pub fn of_events(
        events: &[SequenceEvent],
        slack: f64,
        reference: Option<(&[SequenceEvent], f64)>,
    ) -> Option<(ComparedAttractor, f64)> {
        let sections = sections(events);
        let mut count = repetition(events, &sections, slack, None)?;
        if let Some((word, period)) = reference {
            let places = self::sections(word);
            let alone = repetition(word, &places, 0.0, None);
            let end = places.last().map_or(0.0, |&k| word[k].time);
            let whole = places
                .iter()
                .filter(|&&k| word[k].time > end - (1.0 - 1e-3) * period)
                .count();
            if alone == Some(count) && whole > count && repetition(events, &sections, slack, Some(whole)).is_some() {
                count = whole;
            }
        }
        let last = sections.len() - 1;
        let (b, c) = (sections[last - count], sections[last]);
        let sticks = events[b..c].iter().filter(|event| event.kind == EventKind::Stick);
        let attractor = ComparedAttractor {
            period: events[c].time - events[b].time,
            sticks: sticks.count() as u64,
            amplitude: None,
        };
        Some((attractor, events[b].time))
    }
}

fn sections(events: &[SequenceEvent]) -> Vec<usize> {
    let is_section = |&k: &usize| matches!(events[k].kind, EventKind::Slip | EventKind::Reversal);
    (0..events.len()).filter(is_section).collect()
}

/// Smallest number of sections after which kinds and intervals repeat; restricted to `only` if given.
fn repetition(events: &[SequenceEvent], sections: &[usize], slack: f64, only: Option<usize>) -> Option<usize> {
    let last = sections.len().checked_sub(1)?;
    let mut counts = 1..=LONGEST.min(last / 2);
    counts.find(|&count| {
        let at = |back: usize| sections[last - back];
        let (a, b, c) = (at(2 * count), at(count), at(0));
        let kinds = |from: usize, to: usize| events[from..to].iter().map(|event| event.kind);
        if only.is_some_and(|only| only != count) || !kinds(a, b).eq(kinds(b, c)) {
            return false;
        }
        let period = events[c].time - events[b].time;
        let same = |k: usize| {
            let (now, before) = (events[b + k].time - events[b].time, events[a + k].time - events[a].time);
            (now - before).abs() <= (SAME * period).max(slack)
        };
        period > 0.0 && (1..=c - b).all(same)
    })
}

/// The range of one column over a stretch of time, with parabolas between samples.
#[derive(Debug)]
pub struct PositionRange {
    from: f64,
    to: f64,
    recent: [Option<(f64, f64)>; 2],
    /// Least and largest value so far.
    pub extremes: Option<(f64, f64)>,
}

impl PositionRange {
    /// Starts with a stretch (s).
    pub fn new(from: f64, to: f64) -> PositionRange {
        PositionRange {
            from,
            to,
            recent: [None; 2],
            extremes: None,
        }
    }

    /// Takes the next samples.
    pub fn add(&mut self, block: &Block, column: usize) {
        let first = block.time.partition_point(|t| *t < self.from);
        for (&t, &x) in block.time[first..].iter().zip(&block.columns[column][first..]) {
            if t > self.to {
                break;
            }
            self.take(x);
            if let [Some(b), Some(a)] = self.recent
                && (b.1 - a.1) * (x - b.1) < 0.0
            {
                self.take(vertex(a, b, (t, x)));
            }
            self.recent = [Some((t, x)), self.recent[0]];
        }
    }

    fn take(&mut self, x: f64) {
        let (low, high) = self.extremes.unwrap_or((x, x));
        self.extremes = Some((low.min(x), high.max(x)));
    }

    /// Half of the range.
    pub fn amplitude(&self) -> Option<f64> {
        self.extremes.map(|(low, high)| (high - low) / 2.0)
    }
}

fn vertex(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> f64 {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let slope = left + bend * (b.0 - a.0);
    b.1 - slope * slope / (4.0 * bend)
}
