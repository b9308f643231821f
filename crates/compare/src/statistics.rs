//! The paper's statistics of both runs.

use super::attractor::ComparedAttractor;
use serde::Serialize;
use stickslip_system::record::CycleStatistics;
use stickslip_system::record::sequence::SequenceEvent;

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
