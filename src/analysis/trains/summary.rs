//! The headline of a run of two trains.

use super::Attractor;
use crate::analysis::summary::{SolverWorkRow, extra, share_of, turnover};
use crate::case::Motion;
use crate::model::Mode;
use crate::record::CycleStatistics;
use crate::results::StickSlipTable;
use crate::simulation::{Grazing, RunReport};
use serde::Serialize;

/// What a motion comes to.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Outcome {
    /// It repeats itself.
    Periodic(Attractor),
    /// It does not repeat itself, and the run ends in a stick; whether that would end is not said.
    Stuck {
        /// When the stick began, s.
        since: f64,
    },
    /// No period was found by the end of the run.
    NotPeriodic,
    /// There was no event of the contact.
    Steady {
        /// What the contact does all the time: the name of the mode.
        mode: &'static str,
    },
}

/// What a run comes to; times in s, energies in J. What it does not have is `None`.
#[derive(Debug, Clone, Serialize)]
pub struct TrainSummary {
    /// Time of the run's end, s.
    pub end: f64,
    /// Number of events.
    pub events: usize,
    /// Number of sticks that began.
    pub sticks: usize,
    /// Number of slips that began.
    pub slips: usize,
    /// First stick, s.
    pub onset_time: Option<f64>,
    /// Begin of the stick in which the run ends, s.
    pub final_stick_time: Option<f64>,
    /// Least and largest, s.
    pub stick_duration_range: Option<(f64, f64)>,
    /// Least and largest, s.
    pub slip_duration_range: Option<(f64, f64)>,
    /// Speed (rad/s) below which a contact without stick counts as stuck; `None` of one that sticks.
    pub stick_threshold: Option<f64>,
    /// Periodic, stuck, or neither.
    pub outcome: Outcome,
    /// Largest |residual| of the energy balance, J.
    pub energy_residual: f64,
    /// Energy turned over in the run, J; NaN of a file of an earlier version.
    pub energy_turnover: f64,
    /// Grazing that was not decided; of a file `None`.
    #[serde(skip)]
    pub grazing: Option<Grazing>,
    /// Kicks of the case that the run did not come to.
    pub kicks_never_given: usize,
    /// By the user, before the end of the case.
    pub interrupted: bool,
    /// One row for each solver.
    pub work: Vec<SolverWorkRow>,
    /// Time of the last stick, slip, reversal, separation or contact, s.
    #[serde(skip)]
    pub last_event_time: Option<f64>,
    /// Statistics of its cycles.
    #[serde(skip)]
    pub stick_slip: CycleStatistics,
}

impl TrainSummary {
    /// Of a run in memory whose contact had its last event then, and was in that mode at the end.
    pub(super) fn new(
        report: &RunReport,
        attractor: Option<Attractor>,
        threshold: Option<f64>,
        (last_event_time, mode): (Option<f64>, Mode),
    ) -> TrainSummary {
        let stick_slip = report.digest.cycles.clone();
        let since = stick_slip.final_stick_time;
        let outcome = match (attractor, since) {
            (Some(attractor), _) => Outcome::Periodic(attractor),
            (None, Some(since)) if threshold.is_none() => Outcome::Stuck { since },
            (None, _) if report.digest.count == 0 => Outcome::Steady { mode: mode.name() },
            _ => Outcome::NotPeriodic,
        };
        TrainSummary {
            end: report.end,
            events: report.digest.count,
            sticks: stick_slip.stick_count,
            slips: stick_slip.slip_count,
            onset_time: stick_slip.onset_time,
            final_stick_time: since,
            stick_duration_range: stick_slip.stick_range,
            slip_duration_range: stick_slip.slip_range,
            stick_threshold: threshold,
            outcome,
            energy_residual: report.energy_residual,
            energy_turnover: report.energy_turnover,
            grazing: report.grazing,
            kicks_never_given: report.kicks_never_given,
            interrupted: report.interrupted,
            work: report.work.iter().map(SolverWorkRow::from).collect(),
            last_event_time,
            stick_slip,
        }
    }

    /// The residual of the energy balance over the energy turned over; `None` where that is not known.
    pub fn energy_residual_relative(&self) -> Option<f64> {
        (!self.energy_turnover.is_nan()).then(|| share_of(self.energy_residual, self.energy_turnover))
    }

    /// The attractor, if the motion has come to one.
    pub fn attractor(&self) -> Option<&Attractor> {
        match &self.outcome {
            Outcome::Periodic(attractor) => Some(attractor),
            _ => None,
        }
    }

    /// What a result file says of the run beside its rows: attributes of /stick_slip.
    pub fn table(&self, motion: Motion) -> StickSlipTable {
        let (angle, speed) = match motion {
            Motion::Rotation => ("rad", "rad s-1"),
            Motion::Translation => ("m", "m s-1"),
        };
        let missing = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let attractor = self.attractor();
        let extremes = attractor.and_then(|attractor| attractor.extremes.as_ref());
        let of = |value: Option<f64>, name: &str, unit: &str, description: &str| extra(name, unit, description, value);
        StickSlipTable {
            onset_time: missing(self.onset_time),
            final_stick_time: missing(self.final_stick_time),
            stick_count: self.sticks as u64,
            slip_count: self.slips as u64,
            first_period: missing(self.stick_slip.first_period()),
            last_period: missing(self.stick_slip.last_period()),
            natural_period: f64::NAN,
            growth_exponent: f64::NAN,
            e_folds_gained: f64::NAN,
            energy_residual_max: self.energy_residual,
            extras: vec![
                turnover(self.energy_turnover),
                of(
                    attractor.map(|a| a.period),
                    "attractor_period",
                    "s",
                    "period of the motion that the run has come to, NaN where it does not repeat itself",
                ),
                of(
                    attractor.map(|a| a.sticks as f64),
                    "attractor_sticks",
                    "1",
                    "sticks in a period of that motion",
                ),
                of(
                    attractor.map(|a| a.agreement),
                    "attractor_agreement",
                    "1",
                    "relative difference of its last two cycles",
                ),
                of(
                    attractor.map(|a| a.distance),
                    "attractor_distance",
                    "1",
                    "relative distance of the last cycle from the periodic motion, by the pace at which cycles come together",
                ),
                of(
                    attractor.map(|a| a.since),
                    "attractor_since",
                    "s",
                    "when two successive cycles had come to agree",
                ),
                of(
                    extremes.and_then(|e| e.amplitude),
                    "attractor_amplitude",
                    angle,
                    "half of the range of the position over a period",
                ),
                of(
                    extremes.map(|e| e.position.1),
                    "attractor_position_max",
                    angle,
                    "largest position over a period, of the surface beside its train's far end or of the twist of a free train",
                ),
                of(
                    extremes.map(|e| e.position.0),
                    "attractor_position_min",
                    angle,
                    "least position over a period",
                ),
                of(
                    extremes.map(|e| e.relative_velocity.1),
                    "attractor_relative_velocity_max",
                    speed,
                    "largest relative velocity over a period",
                ),
                of(
                    extremes.map(|e| e.relative_velocity.0),
                    "attractor_relative_velocity_min",
                    speed,
                    "least relative velocity over a period",
                ),
                of(
                    self.stick_threshold,
                    "stick_threshold",
                    speed,
                    "speed below which a contact without stick counts as stuck; NaN of one that sticks",
                ),
            ],
            ..StickSlipTable::default()
        }
    }
}
