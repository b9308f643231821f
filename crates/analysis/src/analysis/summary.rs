//! Summary of a run: main numbers and outcome.

use super::Growth;
use super::attractor::{Attractor, Recurrence};
use super::exponent::Exponent;
use super::quantity::table;
use serde::Serialize;
use stickslip_case::Case;
use stickslip_engine::simulation::{Grazing, RunReport, SolverWork, natural_period};
use stickslip_files::StickSlipTable;
use stickslip_system::model::margin::twice_resistance;
use stickslip_system::model::system::{ContactLaw, Pressing, System};
use stickslip_system::record::CycleStatistics;

/// State of a motion at the end of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Outcome {
    /// Periodic motion.
    Periodic(Attractor),
    /// The run ends in a stick without a period; the stick may be temporary.
    Stuck {
        /// Begin of the stick, s.
        since: f64,
    },
    /// No period was found.
    NotPeriodic,
    /// No event of the contact occurred, or the contact slides steadily at the end.
    Steady {
        /// Name of the contact's mode.
        mode: &'static str,
        /// Whether all states are constant at the end.
        constant: bool,
    },
}

/// Main numbers of a run; times in s, lengths in m, energies in J. `None` if a number does not exist.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Summary {
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
    /// Begin of the final stick, s.
    pub final_stick_time: Option<f64>,
    /// Duration of the first stick, s.
    pub first_stick_duration: Option<f64>,
    /// Duration of the last stick that ends, s.
    pub last_stick_duration: Option<f64>,
    /// Least and largest stick duration, s.
    pub stick_duration_range: Option<(f64, f64)>,
    /// Duration of the first slip, s.
    pub first_slip_duration: Option<f64>,
    /// Duration of the last slip, s.
    pub last_slip_duration: Option<f64>,
    /// Least and largest slip duration, s.
    pub slip_duration_range: Option<(f64, f64)>,
    /// Time from the begin of the first stick to the second, s.
    pub first_period: Option<f64>,
    /// Time between the last two begins of a stick, s.
    pub last_period: Option<f64>,
    /// Natural period 2 pi sqrt(J/k_t), s.
    pub natural_period: Option<f64>,
    /// Static axial displacement F/k_e under the largest force, m.
    pub axial_displacement: Option<f64>,
    /// Loss of stability of steady sliding, s.
    pub instability_time: Option<f64>,
    /// Growth exponent G, up to the stick of smooth sliding.
    pub growth_exponent: Option<f64>,
    /// Part of G up to the run's first stick.
    pub growth_to_onset: Option<f64>,
    /// e-folds from the kick to the first stick.
    pub e_folds_gained: Option<f64>,
    /// Largest |residual| of the energy balance, J.
    pub energy_residual: f64,
    /// Energy turned over in the run, J; NaN for a file of an earlier version.
    pub energy_turnover: f64,
    /// Ratio of residual and turnover; `None` if unknown.
    pub energy_residual_relative: Option<f64>,
    /// Energy that friction has turned into heat by the end of the run, J; `None` if unknown.
    pub dissipated_energy: Option<f64>,
    /// Undecided grazing; `None` for a file.
    #[serde(skip)]
    pub grazing: Option<Grazing>,
    /// Whether the onset is amplified rounding: no kick is far enough above it.
    pub noise_determined: bool,
    /// ln(effect of the kick / effect of rounding) at the first stick. Negative: the kick has decayed below rounding.
    pub kick_above_noise: Option<f64>,
    /// Kicks of the case after the end of the run.
    pub kicks_never_given: usize,
    /// Kicks that waited for an instability in vain, included in `kicks_never_given`.
    pub kicks_without_instability: usize,
    /// Whether the user ended the run early.
    pub interrupted: bool,
    /// Periodic, stuck, or neither; sliding that slows down by itself is never periodic.
    pub outcome: Option<Outcome>,
    /// Largest Lyapunov exponent of a motion without a period, if computed.
    pub exponent: Option<Exponent>,
    /// Speed (rad/s) below which a contact without stick counts as stuck; `None` for a contact that sticks.
    pub stick_threshold: Option<f64>,
    /// Work of each solver.
    pub work: Vec<SolverWork>,
    /// Time of the last stick, slip, reversal, separation or contact, s, if known.
    #[serde(skip)]
    pub last_event_time: Option<f64>,
    /// Statistics of the cycles.
    #[serde(skip)]
    pub stick_slip: CycleStatistics,
}

impl Summary {
    /// Summary of a system's run.
    pub fn of_run(trains: &System, report: &RunReport) -> Summary {
        let growth = Growth::of_digest(trains, &report.digest, report.end);
        Summary {
            end: report.end,
            events: report.digest.count,
            instability_time: report.digest.instability.map(|event| event.time),
            growth_exponent: growth.map(|g| g.exponent),
            growth_to_onset: growth.map(|g| g.to_first_stick),
            e_folds_gained: growth.and_then(|g| g.from_kick),
            energy_residual: report.energy_residual,
            energy_turnover: report.energy_turnover,
            energy_residual_relative: share_of(report.energy_residual, report.energy_turnover),
            dissipated_energy: Some(report.dissipated_energy),
            grazing: report.grazing,
            noise_determined: !report.stopped_smoothly && growth.is_some_and(|g| g.amplifies_rounding()),
            kick_above_noise: growth.and_then(|g| g.above_noise),
            kicks_never_given: report.kicks_never_given,
            kicks_without_instability: report.kicks_without_instability,
            interrupted: report.interrupted,
            work: report.work.clone(),
            ..Summary::of_cycles(report.digest.cycles.clone())
        }
    }

    pub(super) fn of_motion(case: &Case, report: &RunReport, recurrence: &Recurrence<'_>) -> Summary {
        let attractor = recurrence.attractor(&case.system, case.threshold);
        let steady = attractor.is_none() && recurrence.is_steady(&case.system, case.threshold);
        let (last_event_time, mode) = recurrence.end();
        Summary {
            last_event_time,
            ..Summary::of_run(&case.system, report)
        }
        .with_statics(case)
        .coming_to(attractor, mode.name(), steady)
    }

    pub(super) fn with_statics(self, case: &Case) -> Summary {
        let system = &case.system;
        let axial_displacement = match &system.pressing {
            Pressing::Axial { axial, actuation } => Some(actuation.pieces().largest() / axial.stiffness),
            Pressing::Force(_) => None,
        };
        Summary {
            natural_period: twice_resistance(system).and_then(|_| natural_period(system)),
            axial_displacement,
            stick_threshold: Some(case.threshold).filter(|_| system.contact != ContactLaw::StickSlip),
            ..self
        }
    }

    /// Sets the outcome: the attractor, or else a state that depends on the final mode and on constant states.
    pub(super) fn coming_to(mut self, attractor: Option<Attractor>, mode: &'static str, constant: bool) -> Summary {
        self.outcome = Some(match (attractor, self.final_stick_time) {
            (Some(attractor), _) => Outcome::Periodic(attractor),
            (None, Some(since)) if self.stick_threshold.is_none() => Outcome::Stuck { since },
            (None, _) if self.events == 0 || constant => Outcome::Steady { mode, constant },
            _ => Outcome::NotPeriodic,
        });
        self
    }

    pub(super) fn of_cycles(stick_slip: CycleStatistics) -> Summary {
        let (first, last) = (stick_slip.first, stick_slip.last);
        Summary {
            sticks: stick_slip.stick_count,
            slips: stick_slip.slip_count,
            onset_time: stick_slip.onset_time,
            final_stick_time: stick_slip.final_stick_time,
            first_stick_duration: first.map(|c| c.stick_duration),
            last_stick_duration: last.map(|c| c.stick_duration),
            stick_duration_range: stick_slip.stick_range,
            first_slip_duration: first.map(|c| c.slip_duration),
            last_slip_duration: last.map(|c| c.slip_duration),
            slip_duration_range: stick_slip.slip_range,
            first_period: stick_slip.first_period(),
            last_period: stick_slip.last_period(),
            stick_slip,
            ..Summary::default()
        }
    }

    /// Whether the motion has no period and does not stop: a stick at the end is no longer than earlier ones.
    pub(super) fn goes_on(&self) -> bool {
        match self.outcome {
            Some(Outcome::NotPeriodic) => true,
            Some(Outcome::Stuck { since }) => self
                .stick_duration_range
                .is_some_and(|(_, longest)| self.end - since <= longest),
            _ => false,
        }
    }

    /// Attractor of a periodic motion.
    pub fn attractor(&self) -> Option<&Attractor> {
        match &self.outcome {
            Some(Outcome::Periodic(attractor)) => Some(attractor),
            _ => None,
        }
    }

    pub(super) fn table(&self, case: &Case) -> StickSlipTable {
        table(self, case.motion(), case.words.lists_growth())
    }
}

/// Residual over energy turnover; 0 if nothing moved, `None` if the energy is unknown.
pub(super) fn share_of(residual: f64, turnover: f64) -> Option<f64> {
    (!turnover.is_nan()).then(|| if turnover > 0.0 { residual / turnover } else { 0.0 })
}

pub(super) fn residual_row(residual: f64, relative: Option<f64>) -> String {
    let relative = relative.map_or_else(String::new, |relative| format!(", {relative:.1e} relative"));
    format!("{residual:.1e} J{relative}")
}
