//! The headline of a run.

use super::Growth;
use crate::model::Parameters;
use crate::model::torsion::TorsionModel;
use crate::record::CycleStatistics;
use crate::results::{Extra, StickSlipTable};
use crate::simulation::{Grazing, RunReport, SolverWork};
use serde::Serialize;

/// Growth to the first stick, in e-folds, from which a run belongs to its rounding. ln(2^53) = 36.7 lift the rounding of
/// a double to the size of the sliding speed; a perturbation that takes 25 begins 1e5 times above that rounding, which
/// leaves what it starts some five digits.
const NOISE_E_FOLDS: f64 = 25.0;

/// What a run comes to; times in s, lengths in m, energies in J.
#[derive(Debug, Clone, Serialize)]
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
    /// s.
    pub first_stick_duration: Option<f64>,
    /// Of the last stick that ends, s.
    pub last_stick_duration: Option<f64>,
    /// Least and largest, s.
    pub stick_duration_range: Option<(f64, f64)>,
    /// s.
    pub first_slip_duration: Option<f64>,
    /// s.
    pub last_slip_duration: Option<f64>,
    /// Least and largest, s.
    pub slip_duration_range: Option<(f64, f64)>,
    /// From the begin of the first stick to that of the second, s.
    pub first_period: Option<f64>,
    /// s.
    pub last_period: Option<f64>,
    /// 2 pi sqrt(J/k_t), s.
    pub natural_period: f64,
    /// Static axial displacement F/k_e under the largest force, m.
    pub axial_displacement: f64,
    /// When steady sliding becomes unstable, s.
    pub instability_time: Option<f64>,
    /// G, to where the smooth sliding itself would stick.
    pub growth_exponent: Option<f64>,
    /// The part of G up to the run's first stick.
    pub growth_to_onset: Option<f64>,
    /// From the kick to the first stick.
    pub e_folds_gained: Option<f64>,
    /// Largest |residual| of the energy balance, J.
    pub energy_residual: f64,
    /// Energy turned over in the run, J.
    pub energy_turnover: f64,
    /// Of that, the share that the residual is.
    pub energy_residual_relative: f64,
    /// Grazing that was not decided.
    #[serde(skip)]
    pub grazing: Option<Grazing>,
    /// The onset is amplified rounding: no kick stands far enough above it.
    pub noise_determined: bool,
    /// By how many e-folds the kick stands above rounding at the first stick; negative if it has died out.
    pub kick_above_noise: Option<f64>,
    /// Kicks of the case that the run did not come to.
    pub kicks_never_given: usize,
    /// Of these, kicks set at an instability that did not come.
    pub kicks_without_instability: usize,
    /// By the user, before the end of the case.
    pub interrupted: bool,
    /// One row for each solver.
    pub work: Vec<SolverWorkRow>,
    /// Statistics of its cycles.
    #[serde(skip)]
    pub stick_slip: CycleStatistics,
}

/// What one solver did.
#[derive(Debug, Clone, Serialize)]
pub struct SolverWorkRow {
    /// Name of the solver.
    pub solver: &'static str,
    /// Number of segments.
    pub segments: u64,
    /// s.
    pub simulated_time: f64,
    /// Number of accepted steps.
    pub steps: u64,
    /// Number of evaluations of the rates.
    pub rhs_evaluations: u64,
    /// Number of evaluations of the Jacobian.
    pub jacobian_evaluations: u64,
}

impl From<&SolverWork> for SolverWorkRow {
    fn from(w: &SolverWork) -> Self {
        SolverWorkRow {
            solver: w.solver,
            segments: w.segments,
            simulated_time: w.time,
            steps: w.steps,
            rhs_evaluations: w.rhs_evaluations,
            jacobian_evaluations: w.jacobian_evaluations,
        }
    }
}

impl Summary {
    /// Of a run in memory.
    pub fn of_run(parameters: &Parameters, report: &RunReport) -> Summary {
        let stick_slip = report.digest.cycles.clone();
        let growth = Growth::of_digest(parameters, &report.digest, report.end);
        let (first, last) = (stick_slip.first, stick_slip.last);
        Summary {
            end: report.end,
            events: report.digest.count,
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
            natural_period: TorsionModel::new(parameters).natural_period(),
            axial_displacement: parameters.largest_force() / parameters.axial.stiffness,
            instability_time: growth.map(|g| g.instability),
            growth_exponent: growth.map(|g| g.exponent),
            growth_to_onset: growth.map(|g| g.to_first_stick),
            e_folds_gained: growth.and_then(|g| g.from_kick),
            energy_residual: report.energy_residual,
            energy_turnover: report.energy_turnover,
            energy_residual_relative: share_of(report.energy_residual, report.energy_turnover),
            grazing: report.grazing,
            noise_determined: !report.stopped_smoothly && growth.is_some_and(|g| g.to_first_stick > NOISE_E_FOLDS),
            kick_above_noise: growth.and_then(|g| g.above_noise),
            kicks_never_given: report.kicks_never_given,
            kicks_without_instability: report.kicks_without_instability,
            interrupted: report.interrupted,
            work: report.work.iter().map(SolverWorkRow::from).collect(),
            stick_slip,
        }
    }

    /// What a result file says of the run beside its rows: attributes of /stick_slip.
    pub fn table(&self) -> StickSlipTable {
        let missing = |value: Option<f64>| value.unwrap_or(f64::NAN);
        StickSlipTable {
            onset_time: missing(self.onset_time),
            final_stick_time: missing(self.final_stick_time),
            stick_count: self.sticks as u64,
            slip_count: self.slips as u64,
            first_period: missing(self.first_period),
            last_period: missing(self.last_period),
            natural_period: self.natural_period,
            growth_exponent: missing(self.growth_exponent),
            e_folds_gained: missing(self.e_folds_gained),
            energy_residual_max: self.energy_residual,
            extras: vec![
                turnover(self.energy_turnover),
                extra(
                    "instability_time",
                    "s",
                    "when steady sliding loses its stability",
                    self.instability_time,
                ),
                extra(
                    "growth_to_onset",
                    "1",
                    "the part of growth_exponent up to the first stick",
                    self.growth_to_onset,
                ),
                extra(
                    "kick_above_noise",
                    "1",
                    "by how many e-folds the kick stands above rounding at the first stick; negative: it has died out",
                    self.kick_above_noise,
                ),
                extra(
                    "noise_determined",
                    "1",
                    "1 if the stick-slip is amplified rounding, which converges with no tolerance; else 0",
                    Some(f64::from(u8::from(self.noise_determined))),
                ),
            ],
            // The cycles themselves were recorded as they came.
            ..StickSlipTable::default()
        }
    }
}

/// The name of the energy turned over among the attributes of /stick_slip.
pub(super) const TURNOVER: &str = "energy_turnover";

/// The energy turned over, J, as an attribute of /stick_slip.
pub(super) fn turnover(energy: f64) -> Extra {
    extra(
        TURNOVER,
        "J",
        "energy turned over: the largest of kinetic + elastic + dissipated energy, and of the work",
        Some(energy),
    )
}

/// A residual as a share of the energy turned over; 0 where nothing moved.
pub(super) fn share_of(residual: f64, turnover: f64) -> f64 {
    if turnover > 0.0 { residual / turnover } else { 0.0 }
}

/// The residual of the energy balance for a headline: in J, and relative where the energy turned over is known.
pub(super) fn residual_row(residual: f64, relative: Option<f64>) -> String {
    let relative = relative.map_or_else(String::new, |relative| format!(", {relative:.1e} relative"));
    format!("{residual:.1e} J{relative}")
}

/// A further attribute of /stick_slip; NaN where there is no value.
pub(super) fn extra(name: &str, unit: &str, description: &str, value: Option<f64>) -> Extra {
    Extra {
        name: name.to_owned(),
        unit: unit.to_owned(),
        description: description.to_owned(),
        value: value.unwrap_or(f64::NAN),
    }
}
