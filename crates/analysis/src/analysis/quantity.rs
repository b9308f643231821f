//! Registry of the numbers of a run: sweeps, criteria, targets of a calibration and result files read it.

use super::attractor::{Attractor, Extremes};
use super::summary::{Outcome, Summary};
use stickslip_case::{Motion, suggest};
use stickslip_files::{Extra, StickSlipTable};
use stickslip_system::model::margin::{resistance, slowing};
use stickslip_system::model::system::System;
use stickslip_system::quote::shown;

/// A number of a run, from its summary.
#[derive(Clone, Copy)]
pub struct Quantity {
    /// Name of its variable in a sweep, and of its attribute of /stick_slip.
    pub name: &'static str,
    /// Unit (UDUNITS), in rotation.
    unit: &'static str,
    /// Description in words, with the paper's symbol.
    pub description: &'static str,
    kind: QuantityKind,
    subject: QuantitySubject,
    files: ListedIn,
    get: fn(&Summary) -> Option<f64>,
}

/// A computed number or count describes the computation, which nobody measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum QuantityKind {
    Number,
    Count,
    ComputedNumber,
    ComputedCount,
}

/// Subject of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum QuantitySubject {
    Run,
    /// Sliding whose loss of stability is watched.
    Growth,
    /// Like `Growth`, but 0 in a sweep if sliding keeps its stability and amplifies nothing.
    Amplification,
    /// The case of such sliding, whatever its motion.
    Case,
}

/// Result files that have a number as an attribute of /stick_slip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ListedIn {
    None,
    /// Counts are int64.
    All,
    /// Files for sliding that may lose its stability.
    OfGrowth,
    /// Files for motions that may be periodic.
    OfAttractors,
}

impl Quantity {
    /// Unit (UDUNITS), with positions as angles or lengths.
    pub fn unit(&self, motion: Motion) -> &'static str {
        match (motion, self.unit) {
            (Motion::Translation, "rad") => "m",
            (Motion::Translation, "rad s-1") => "m s-1",
            (_, unit) => unit,
        }
    }

    /// Whether a sweep stores it as int64, with `NO_COUNT` if missing; else it is float64 with NaN.
    pub fn is_count(&self) -> bool {
        matches!(self.kind, QuantityKind::Count | QuantityKind::ComputedCount)
    }

    /// Codes and meanings of a coded count; otherwise empty.
    pub fn flags(&self) -> &'static [(i64, &'static str)] {
        if self.name == "motion" { &MOTIONS } else { &[] }
    }

    fn is_computed(&self) -> bool {
        matches!(self.kind, QuantityKind::ComputedNumber | QuantityKind::ComputedCount)
    }

    /// Whether an experiment can give it.
    pub fn is_measured(&self) -> bool {
        self.flags().is_empty() && !self.is_computed()
    }

    /// Whether it tells about the motion, not about the computation or the case alone.
    pub fn is_result(&self) -> bool {
        !self.is_computed() && self.subject != QuantitySubject::Case
    }

    /// Value in a sweep; `None` if the run has none.
    pub(crate) fn value(&self, summary: &Summary) -> Option<f64> {
        let value = (self.get)(summary);
        match self.subject {
            QuantitySubject::Amplification => summary.natural_period.map(|_| value.unwrap_or(0.0)),
            _ => value,
        }
    }

    /// Reason why no run of this system has the quantity; `None` if one may.
    fn why_not(&self, system: &System) -> Option<String> {
        if self.subject != QuantitySubject::Run {
            let why = resistance(system).err()?;
            Some(format!("its sliding is not watched for a loss of stability: {why}"))
        } else if self.name.starts_with("attractor_") && slowing(system).is_ok() {
            Some("nothing drives its sliding, which slows down to a stop and does not repeat itself".to_owned())
        } else {
            None
        }
    }
}

impl std::fmt::Debug for Quantity {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name)
    }
}

fn attractor(summary: &Summary, of: fn(&Attractor) -> f64) -> Option<f64> {
    summary.attractor().map(of)
}

fn extremes(summary: &Summary, of: fn(&Extremes) -> Option<f64>) -> Option<f64> {
    summary.attractor()?.extremes.as_ref().and_then(of)
}

fn flag(holds: bool) -> Option<f64> {
    Some(f64::from(u8::from(holds)))
}

/// Code of a motion that ends in a stick.
pub(crate) const STUCK: f64 = 1.0;

/// Code of a motion without a period that does not end in a stick.
pub(crate) const NOT_PERIODIC: f64 = 2.0;

const MOTIONS: [(i64, &str); 7] = [
    (0, "periodic"),
    (1, "stuck"),
    (2, "not-periodic"),
    (3, "steady-slip"),
    (4, "steady-stick"),
    (5, "steady-separated"),
    (6, "steady-engaged"),
];

fn motion(summary: &Summary) -> Option<f64> {
    Some(match summary.outcome.as_ref()? {
        Outcome::Periodic(_) => 0.0,
        Outcome::Stuck { .. } => STUCK,
        Outcome::NotPeriodic => NOT_PERIODIC,
        Outcome::Steady { mode, .. } => match *mode {
            "stick" => 4.0,
            "separated" => 5.0,
            "engaged" => 6.0,
            _ => 3.0,
        },
    })
}

macro_rules! quantities {
    ($s:ident: $($name:expr, $unit:literal, $kind:ident, $subject:ident, $files:ident: $about:literal => $get:expr;)*) => {
        [$(Quantity {
            name: $name,
            unit: $unit,
            description: $about,
            kind: QuantityKind::$kind,
            subject: QuantitySubject::$subject,
            files: ListedIn::$files,
            get: |$s| $get,
        }),*]
    };
}

/// Quantities of every run, in the order of the variables in a sweep file.
pub const QUANTITIES: [Quantity; 41] = quantities! { s:
    "stick_count", "1", Count, Run, All:
        "number of sticks" => Some(s.sticks as f64);
    "slip_count", "1", Count, Run, All:
        "number of breakaways from stick" => Some(s.slips as f64);
    "onset_time", "s", Number, Run, All:
        "time of the first stick" => s.onset_time;
    "final_stick_time", "s", Number, Run, All:
        "begin of the stick in which the run ends" => s.final_stick_time;
    "first_stick_duration", "s", Number, Run, None:
        "duration of the first stick" => s.first_stick_duration;
    "last_stick_duration", "s", Number, Run, None:
        "duration of the last stick that ends" => s.last_stick_duration;
    "shortest_stick_duration", "s", Number, Run, None:
        "shortest stick that ends" => s.stick_duration_range.map(|r| r.0);
    "longest_stick_duration", "s", Number, Run, None:
        "longest stick that ends" => s.stick_duration_range.map(|r| r.1);
    "first_slip_duration", "s", Number, Run, None:
        "duration of the slip after the first stick" => s.first_slip_duration;
    "last_slip_duration", "s", Number, Run, None:
        "duration of the last slip between sticks" => s.last_slip_duration;
    "shortest_slip_duration", "s", Number, Run, None:
        "shortest slip between sticks" => s.slip_duration_range.map(|r| r.0);
    "longest_slip_duration", "s", Number, Run, None:
        "longest slip between sticks" => s.slip_duration_range.map(|r| r.1);
    "first_period", "s", Number, Run, All:
        "T_i, from the first stick to the second" => s.first_period;
    "last_period", "s", Number, Run, All:
        "T_f, from the last stick but one to the last" => s.last_period;
    "natural_period", "s", Number, Case, All:
        "T_n = 2 pi sqrt(J/k_t)" => s.natural_period;
    "instability_time", "s", Number, Growth, OfGrowth:
        "when steady sliding loses its stability" => s.instability_time;
    "growth_exponent", "1", Number, Amplification, All:
        "G, e-folds that a perturbation could gain" => s.growth_exponent;
    "growth_to_onset", "1", Number, Amplification, OfGrowth:
        "the part of G up to the first stick" => s.growth_to_onset;
    "e_folds_gained", "1", Number, Growth, All:
        "e-folds that the first kick gained until the first stick" => s.e_folds_gained;
    "noise_determined", "1", ComputedCount, Amplification, OfGrowth:
        "1 if the stick-slip is amplified rounding, else 0" => flag(s.noise_determined);
    "kicks_never_given", "1", ComputedCount, Run, None:
        "kicks after the end of the run" => Some(s.kicks_never_given as f64);
    "energy_residual", "J", ComputedNumber, Run, All:
        "largest residual of the energy balance" => Some(s.energy_residual);
    "steps", "1", ComputedCount, Run, None:
        "steps of all solvers" => Some(s.work.iter().map(|w| w.steps as f64).sum());
    "rhs_evaluations", "1", ComputedCount, Run, None:
        "right-hand sides of all solvers" => Some(s.work.iter().map(|w| w.rhs_evaluations as f64).sum());
    "jacobian_evaluations", "1", ComputedCount, Run, None:
        "Jacobians of all solvers" => Some(s.work.iter().map(|w| w.jacobian_evaluations as f64).sum());
    "motion", "1", Count, Run, None:
        "attractor: the motion at the end of the run" => motion(s);
    "event_count", "1", Count, Run, None:
        "number of events" => Some(s.events as f64);
    "attractor_period", "s", Number, Run, OfAttractors:
        "period of the attractor, NaN where the motion does not repeat itself" => attractor(s, |a| a.period);
    "attractor_sticks", "1", Count, Run, OfAttractors:
        "sticks in a period of that motion" => attractor(s, |a| a.sticks as f64);
    "attractor_agreement", "1", ComputedNumber, Run, OfAttractors:
        "relative difference of its last two cycles" => attractor(s, |a| a.agreement);
    "attractor_distance", "1", ComputedNumber, Run, OfAttractors:
        "relative distance of the last cycle from the periodic motion" => attractor(s, |a| a.distance);
    "attractor_since", "s", ComputedNumber, Run, OfAttractors:
        "when two successive cycles had come to agree" => attractor(s, |a| a.since);
    "attractor_amplitude", "rad", Number, Run, OfAttractors:
        "half of the range of the position over a period" => extremes(s, |e| e.amplitude);
    "attractor_position_min", "rad", Number, Run, OfAttractors:
        "least position over a period" => extremes(s, |e| Some(e.position.0));
    "attractor_position_max", "rad", Number, Run, OfAttractors:
        "largest position over a period" => extremes(s, |e| Some(e.position.1));
    "attractor_relative_velocity_min", "rad s-1", Number, Run, OfAttractors:
        "least relative velocity omega_r over a period" => extremes(s, |e| Some(e.relative_velocity.0));
    "attractor_relative_velocity_max", "rad s-1", Number, Run, OfAttractors:
        "largest relative velocity omega_r over a period" => extremes(s, |e| Some(e.relative_velocity.1));
    "stick_threshold", "rad s-1", ComputedNumber, Run, OfAttractors:
        "speed below which a contact without stick counts as stuck; NaN if the contact sticks" => s.stick_threshold;
    "last_event_time", "s", Number, Run, None:
        "time of the last stick, slip, reversal, separation or contact" => s.last_event_time;
    "end_time", "s", ComputedNumber, Run, None:
        "time at which the run ends" => Some(s.end);
    "dissipated_energy", "J", Number, Run, All:
        "energy that friction has turned into heat by the end of the run" => s.dissipated_energy;
};

/// Quantities of result files that are no columns of a sweep.
const OF_FILES: [Quantity; 6] = quantities! { s:
    TURNOVER, "J", Number, Run, All:
        "energy turned over: the largest of kinetic + elastic + dissipated energy, and of the work"
        => Some(s.energy_turnover);
    "kick_above_noise", "1", Number, Run, OfGrowth:
        "e-folds by which the kick exceeds rounding at the first stick; negative: it has decayed below rounding"
        => s.kick_above_noise;
    "attractor_forcing_periods", "1", Number, Run, OfAttractors:
        "periods of the forcing in a period, where these are its sections"
        => s.attractor().and_then(|a| a.forcing_periods).map(|n| n as f64);
    "steady_sliding", "1", Number, Run, OfAttractors:
        "1 if the contact slides at the end while all states are constant; else 0"
        => flag(matches!(s.outcome, Some(Outcome::Steady { constant: true, .. })));
    "lyapunov_exponent", "s-1", Number, Run, OfAttractors:
        "largest Lyapunov exponent of a motion without a period, NaN where it was not computed"
        => s.exponent.map(|e| e.value);
    "lyapunov_uncertainty", "s-1", Number, Run, OfAttractors:
        "standard error of lyapunov_exponent" => s.exponent.map(|e| e.uncertainty);
};

/// Attribute of /stick_slip with the energy turned over.
pub(super) const TURNOVER: &str = "energy_turnover";

/// Name of `energy_residual` among the attributes of /stick_slip.
pub(super) const RESIDUAL: &str = "energy_residual_max";

/// Attributes of /stick_slip of a run; `growth`: those of sliding that may lose its stability.
pub(super) fn table(summary: &Summary, motion: Motion, growth: bool) -> StickSlipTable {
    let listed = |one: &&Quantity| match one.files {
        ListedIn::None => false,
        ListedIn::All => true,
        ListedIn::OfGrowth => growth || summary.growth_exponent.is_some(),
        ListedIn::OfAttractors => !growth || summary.attractor().is_some(),
    };
    let attribute = |one: &Quantity| Extra {
        name: match one.name {
            "energy_residual" => RESIDUAL.to_owned(),
            name => name.to_owned(),
        },
        unit: one.unit(motion).to_owned(),
        description: one.description.to_owned(),
        value: (one.get)(summary).unwrap_or(f64::NAN),
        // Other counts may be missing, and are doubles with NaN.
        whole: one.is_count() && one.files == ListedIn::All,
    };
    let all = QUANTITIES.iter().chain(&OF_FILES);
    StickSlipTable {
        cycles: Vec::new(),
        attributes: all.filter(listed).map(attribute).collect(),
    }
}

/// Index of a quantity in [`QUANTITIES`].
pub fn quantity_index(name: &str) -> Option<usize> {
    QUANTITIES.iter().position(|quantity| quantity.name == name)
}

/// Index of a requested quantity that fits the `purpose`, such as " to measure", or a message about its name.
pub(crate) fn asked_for(
    name: &str,
    system: Option<&System>,
    purpose: &str,
    fits: fn(&Quantity) -> bool,
) -> Result<usize, String> {
    match quantity_index(name).filter(|&place| fits(&QUANTITIES[place])) {
        Some(place) => match system.and_then(|system| QUANTITIES[place].why_not(system)) {
            Some(why) => Err(format!("no run of this case has \"{name}\": {why}")),
            None => Ok(place),
        },
        None => {
            let names: Vec<&str> = QUANTITIES.iter().filter(|one| fits(one)).map(|one| one.name).collect();
            let hint = match suggest(name, names.iter().copied()) {
                Some(close) => format!("did you mean {close}?"),
                None => format!("there are {}", names.join(", ")),
            };
            Err(format!("a run has no quantity \"{}\"{purpose}; {hint}", shown(name)))
        }
    }
}
