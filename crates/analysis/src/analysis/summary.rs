//! Summary of a run: main numbers and outcome.

use super::Growth;
use super::attractor::{Attractor, Recurrence};
use super::exponent::Exponent;
use serde::Serialize;
use stickslip_case::{Case, Motion};
use stickslip_engine::simulation::natural_period;
use stickslip_engine::simulation::{Grazing, RunReport, SolverWork};
use stickslip_files::{Extra, StickSlipTable};
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
        let mut table = StickSlipTable::default();
        for (name, value) in [
            ("onset_time", self.onset_time),
            ("final_stick_time", self.final_stick_time),
            ("first_period", self.first_period),
            ("last_period", self.last_period),
            ("natural_period", self.natural_period),
            ("growth_exponent", self.growth_exponent),
            ("e_folds_gained", self.e_folds_gained),
            ("energy_residual_max", Some(self.energy_residual)),
            ("stick_count", Some(self.sticks as f64)),
            ("slip_count", Some(self.slips as f64)),
        ] {
            table.set(name, value);
        }
        let turnover = "energy turned over: the largest of kinetic + elastic + dissipated energy, and of the work";
        let turnover = Extra::new(TURNOVER, "J", turnover, Some(self.energy_turnover));
        table.attributes.push(turnover);
        let growth = case.words.lists_growth();
        if growth || self.growth_exponent.is_some() {
            table.attributes.extend(self.of_growth());
        }
        if !growth || self.attractor().is_some() {
            table.attributes.extend(self.of_attractor(case.motion()));
        }
        table
    }

    fn of_growth(&self) -> Vec<Extra> {
        let instability = "when steady sliding loses its stability";
        let to_onset = "the part of growth_exponent up to the first stick";
        let above = "by how many e-folds the kick stands above rounding at the first stick; negative: it has died out";
        let noise = "1 if the stick-slip is amplified rounding, which converges with no tolerance; else 0";
        let is_noise = Some(f64::from(u8::from(self.noise_determined)));
        vec![
            Extra::new("instability_time", "s", instability, self.instability_time),
            Extra::new("growth_to_onset", "1", to_onset, self.growth_to_onset),
            Extra::new("kick_above_noise", "1", above, self.kick_above_noise),
            Extra::new("noise_determined", "1", noise, is_noise),
        ]
    }

    fn of_attractor(&self, motion: Motion) -> Vec<Extra> {
        let (angle, speed) = match motion {
            Motion::Rotation => ("rad", "rad s-1"),
            Motion::Translation => ("m", "m s-1"),
        };
        let attractor = self.attractor();
        let extremes = attractor.and_then(|attractor| attractor.extremes.as_ref());
        let of = |of: fn(&Attractor) -> f64| attractor.map(of);
        let position = extremes.map(|extremes| extremes.position);
        let velocity = extremes.map(|extremes| extremes.relative_velocity);
        let (least, largest) = (|bounds: (f64, f64)| bounds.0, |bounds: (f64, f64)| bounds.1);
        let threshold = "speed below which a contact without stick counts as stuck; NaN of one that sticks";
        let steady = "1 if the contact slides at the end while all states are constant; else 0";
        let is_steady = matches!(self.outcome, Some(Outcome::Steady { constant: true, .. }));
        let exponent = "largest Lyapunov exponent of a motion without a period, NaN where it was not computed";
        let uncertainty = "standard error of lyapunov_exponent";
        let period = "period of the motion that the run has come to, NaN where it does not repeat itself";
        let distance =
            "relative distance of the last cycle from the periodic motion, by the pace at which cycles come together";
        let position_max =
            "largest position over a period, of the surface beside its train's far end or of the twist of a free train";
        [
            ("period", "s", of(|a| a.period), period),
            (
                "sticks",
                "1",
                of(|a| a.sticks as f64),
                "sticks in a period of that motion",
            ),
            (
                "forcing_periods",
                "1",
                attractor.and_then(|a| a.forcing_periods).map(|periods| periods as f64),
                "periods of the forcing in a period, where these are its sections",
            ),
            (
                "agreement",
                "1",
                of(|a| a.agreement),
                "relative difference of its last two cycles",
            ),
            ("distance", "1", of(|a| a.distance), distance),
            (
                "since",
                "s",
                of(|a| a.since),
                "when two successive cycles had come to agree",
            ),
            (
                "amplitude",
                angle,
                extremes.and_then(|e| e.amplitude),
                "half of the range of the position over a period",
            ),
            ("position_max", angle, position.map(largest), position_max),
            (
                "position_min",
                angle,
                position.map(least),
                "least position over a period",
            ),
            (
                "relative_velocity_max",
                speed,
                velocity.map(largest),
                "largest relative velocity over a period",
            ),
            (
                "relative_velocity_min",
                speed,
                velocity.map(least),
                "least relative velocity over a period",
            ),
        ]
        .into_iter()
        .map(|(name, unit, value, description)| Extra::new(&format!("attractor_{name}"), unit, description, value))
        .chain([
            Extra::new("steady_sliding", "1", steady, Some(f64::from(u8::from(is_steady)))),
            Extra::new("lyapunov_exponent", "s-1", exponent, self.exponent.map(|e| e.value)),
            Extra::new(
                "lyapunov_uncertainty",
                "s-1",
                uncertainty,
                self.exponent.map(|e| e.uncertainty),
            ),
            Extra::new("stick_threshold", speed, threshold, self.stick_threshold),
        ])
        .collect()
    }
}

pub(super) const TURNOVER: &str = "energy_turnover";

/// Residual over energy turnover; 0 if nothing moved, `None` if the energy is unknown.
pub(super) fn share_of(residual: f64, turnover: f64) -> Option<f64> {
    (!turnover.is_nan()).then(|| if turnover > 0.0 { residual / turnover } else { 0.0 })
}

pub(super) fn residual_row(residual: f64, relative: Option<f64>) -> String {
    let relative = relative.map_or_else(String::new, |relative| format!(", {relative:.1e} relative"));
    format!("{residual:.1e} J{relative}")
}
