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
    /// Whether a sweep stores it as int64, with `NO_COUNT` if missing; else it is float64 with NaN.
    pub count: bool,
    /// Codes and meanings of a coded count.
    pub flags: &'static [(i64, &'static str)],
    /// What it tells about.
    subject: QuantitySubject,
    /// Whether it describes the computation, which nobody measures.
    computed: bool,
    /// Result files that have it as an attribute of /stick_slip.
    files: ListedIn,
    get: fn(&Summary) -> Option<f64>,
}

/// What a number tells about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum QuantitySubject {
    Run,
    /// Sliding whose loss of stability is watched.
    Growth,
    /// The same; 0 in a sweep for sliding that keeps its stability and so amplifies nothing.
    Amplification,
    /// The case of such sliding, whatever its motion.
    Case,
}

/// Result files that list a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ListedIn {
    None,
    /// Counts are int64.
    All,
    /// Of sliding that may lose its stability.
    OfGrowth,
    /// Of motions that may be periodic.
    OfAttractors,
}

impl Quantity {
    const fn about(self, subject: QuantitySubject) -> Quantity {
        Quantity { subject, ..self }
    }

    const fn computed(self) -> Quantity {
        Quantity { computed: true, ..self }
    }

    const fn listed(self, files: ListedIn) -> Quantity {
        Quantity { files, ..self }
    }

    /// Unit (UDUNITS), with positions as angles or lengths.
    pub fn unit(&self, motion: Motion) -> &'static str {
        match (motion, self.unit) {
            (Motion::Translation, "rad") => "m",
            (Motion::Translation, "rad s-1") => "m s-1",
            (_, unit) => unit,
        }
    }

    /// Whether an experiment can give it.
    pub fn is_measured(&self) -> bool {
        self.flags.is_empty() && !self.computed
    }

    /// Whether it tells about the motion, not about the computation or the case alone.
    pub fn is_result(&self) -> bool {
        !self.computed && self.subject != QuantitySubject::Case
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

const fn number(
    name: &'static str,
    unit: &'static str,
    description: &'static str,
    get: fn(&Summary) -> Option<f64>,
) -> Quantity {
    Quantity {
        name,
        unit,
        description,
        count: false,
        flags: &[],
        subject: QuantitySubject::Run,
        computed: false,
        files: ListedIn::None,
        get,
    }
}

const fn count(name: &'static str, description: &'static str, get: fn(&Summary) -> Option<f64>) -> Quantity {
    Quantity {
        count: true,
        ..number(name, "1", description, get)
    }
}

/// Quantities of every run, in the order of the variables in a sweep file.
pub const QUANTITIES: [Quantity; 41] = [
    count("stick_count", "number of sticks", |s| Some(s.sticks as f64)).listed(ListedIn::All),
    count("slip_count", "number of breakaways from stick", |s| {
        Some(s.slips as f64)
    })
    .listed(ListedIn::All),
    number("onset_time", "s", "time of the first stick", |s| s.onset_time).listed(ListedIn::All),
    number(
        "final_stick_time",
        "s",
        "begin of the stick in which the run ends",
        |s| s.final_stick_time,
    )
    .listed(ListedIn::All),
    number("first_stick_duration", "s", "duration of the first stick", |s| {
        s.first_stick_duration
    }),
    number(
        "last_stick_duration",
        "s",
        "duration of the last stick that ends",
        |s| s.last_stick_duration,
    ),
    number("shortest_stick_duration", "s", "shortest stick that ends", |s| {
        s.stick_duration_range.map(|r| r.0)
    }),
    number("longest_stick_duration", "s", "longest stick that ends", |s| {
        s.stick_duration_range.map(|r| r.1)
    }),
    number(
        "first_slip_duration",
        "s",
        "duration of the slip after the first stick",
        |s| s.first_slip_duration,
    ),
    number(
        "last_slip_duration",
        "s",
        "duration of the last slip between sticks",
        |s| s.last_slip_duration,
    ),
    number("shortest_slip_duration", "s", "shortest slip between sticks", |s| {
        s.slip_duration_range.map(|r| r.0)
    }),
    number("longest_slip_duration", "s", "longest slip between sticks", |s| {
        s.slip_duration_range.map(|r| r.1)
    }),
    number("first_period", "s", "T_i, from the first stick to the second", |s| {
        s.first_period
    })
    .listed(ListedIn::All),
    number(
        "last_period",
        "s",
        "T_f, from the last stick but one to the last",
        |s| s.last_period,
    )
    .listed(ListedIn::All),
    number("natural_period", "s", "T_n = 2 pi sqrt(J/k_t)", |s| s.natural_period)
        .about(QuantitySubject::Case)
        .listed(ListedIn::All),
    number(
        "instability_time",
        "s",
        "when steady sliding loses its stability",
        |s| s.instability_time,
    )
    .about(QuantitySubject::Growth)
    .listed(ListedIn::OfGrowth),
    number(
        "growth_exponent",
        "1",
        "G, e-folds that a perturbation could gain",
        |s| s.growth_exponent,
    )
    .about(QuantitySubject::Amplification)
    .listed(ListedIn::All),
    number("growth_to_onset", "1", "the part of G up to the first stick", |s| {
        s.growth_to_onset
    })
    .about(QuantitySubject::Amplification)
    .listed(ListedIn::OfGrowth),
    number(
        "e_folds_gained",
        "1",
        "e-folds that the first kick gained until the first stick",
        |s| s.e_folds_gained,
    )
    .about(QuantitySubject::Growth)
    .listed(ListedIn::All),
    count(
        "noise_determined",
        "1 if the stick-slip is amplified rounding, else 0",
        |s| Some(f64::from(u8::from(s.noise_determined))),
    )
    .about(QuantitySubject::Amplification)
    .computed()
    .listed(ListedIn::OfGrowth),
    count("kicks_never_given", "kicks after the end of the run", |s| {
        Some(s.kicks_never_given as f64)
    })
    .computed(),
    number("energy_residual", "J", "largest residual of the energy balance", |s| {
        Some(s.energy_residual)
    })
    .computed()
    .listed(ListedIn::All),
    count("steps", "steps of all solvers", |s| {
        Some(s.work.iter().map(|w| w.steps as f64).sum())
    })
    .computed(),
    count("rhs_evaluations", "right-hand sides of all solvers", |s| {
        Some(s.work.iter().map(|w| w.rhs_evaluations as f64).sum())
    })
    .computed(),
    count("jacobian_evaluations", "Jacobians of all solvers", |s| {
        Some(s.work.iter().map(|w| w.jacobian_evaluations as f64).sum())
    })
    .computed(),
    Quantity {
        flags: &MOTIONS,
        ..count("motion", "attractor: the motion at the end of the run", motion)
    },
    count("event_count", "number of events", |s| Some(s.events as f64)),
    number(
        "attractor_period",
        "s",
        "period of the attractor, NaN where the motion does not repeat itself",
        |s| attractor(s, |a| a.period),
    )
    .listed(ListedIn::OfAttractors),
    count("attractor_sticks", "sticks in a period of that motion", |s| {
        attractor(s, |a| a.sticks as f64)
    })
    .listed(ListedIn::OfAttractors),
    number(
        "attractor_agreement",
        "1",
        "relative difference of its last two cycles",
        |s| attractor(s, |a| a.agreement),
    )
    .computed()
    .listed(ListedIn::OfAttractors),
    number(
        "attractor_distance",
        "1",
        "relative distance of the last cycle from the periodic motion",
        |s| attractor(s, |a| a.distance),
    )
    .computed()
    .listed(ListedIn::OfAttractors),
    number(
        "attractor_since",
        "s",
        "when two successive cycles had come to agree",
        |s| attractor(s, |a| a.since),
    )
    .computed()
    .listed(ListedIn::OfAttractors),
    number(
        "attractor_amplitude",
        "rad",
        "half of the range of the position over a period",
        |s| extremes(s, |e| e.amplitude),
    )
    .listed(ListedIn::OfAttractors),
    number("attractor_position_min", "rad", "least position over a period", |s| {
        extremes(s, |e| Some(e.position.0))
    })
    .listed(ListedIn::OfAttractors),
    number("attractor_position_max", "rad", "largest position over a period", |s| {
        extremes(s, |e| Some(e.position.1))
    })
    .listed(ListedIn::OfAttractors),
    number(
        "attractor_relative_velocity_min",
        "rad s-1",
        "least relative velocity omega_r over a period",
        |s| extremes(s, |e| Some(e.relative_velocity.0)),
    )
    .listed(ListedIn::OfAttractors),
    number(
        "attractor_relative_velocity_max",
        "rad s-1",
        "largest relative velocity omega_r over a period",
        |s| extremes(s, |e| Some(e.relative_velocity.1)),
    )
    .listed(ListedIn::OfAttractors),
    number(
        "stick_threshold",
        "rad s-1",
        "speed below which a contact without stick counts as stuck; NaN if the contact sticks",
        |s| s.stick_threshold,
    )
    .computed()
    .listed(ListedIn::OfAttractors),
    number(
        "last_event_time",
        "s",
        "time of the last stick, slip, reversal, separation or contact",
        |s| s.last_event_time,
    ),
    number("end_time", "s", "time at which the run ends", |s| Some(s.end)).computed(),
    number(
        "dissipated_energy",
        "J",
        "energy that friction has turned into heat by the end of the run",
        |s| s.dissipated_energy,
    )
    .listed(ListedIn::All),
];

/// Quantities of result files that are no columns of a sweep.
const OF_FILES: [Quantity; 6] = [
    number(
        TURNOVER,
        "J",
        "energy turned over: the largest of kinetic + elastic + dissipated energy, and of the work",
        |s| Some(s.energy_turnover),
    )
    .listed(ListedIn::All),
    number(
        "kick_above_noise",
        "1",
        "e-folds by which the kick exceeds rounding at the first stick; negative: it has decayed below rounding",
        |s| s.kick_above_noise,
    )
    .listed(ListedIn::OfGrowth),
    number(
        "attractor_forcing_periods",
        "1",
        "periods of the forcing in a period, where these are its sections",
        |s| {
            s.attractor()
                .and_then(|a| a.forcing_periods)
                .map(|periods| periods as f64)
        },
    )
    .listed(ListedIn::OfAttractors),
    number(
        "steady_sliding",
        "1",
        "1 if the contact slides at the end while all states are constant; else 0",
        |s| {
            let is_steady = matches!(s.outcome, Some(Outcome::Steady { constant: true, .. }));
            Some(f64::from(u8::from(is_steady)))
        },
    )
    .listed(ListedIn::OfAttractors),
    number(
        "lyapunov_exponent",
        "s-1",
        "largest Lyapunov exponent of a motion without a period, NaN where it was not computed",
        |s| s.exponent.map(|e| e.value),
    )
    .listed(ListedIn::OfAttractors),
    number(
        "lyapunov_uncertainty",
        "s-1",
        "standard error of lyapunov_exponent",
        |s| s.exponent.map(|e| e.uncertainty),
    )
    .listed(ListedIn::OfAttractors),
];

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
        name: if one.name == "energy_residual" {
            RESIDUAL
        } else {
            one.name
        }
        .to_owned(),
        unit: one.unit(motion).to_owned(),
        description: one.description.to_owned(),
        value: (one.get)(summary).unwrap_or(f64::NAN),
        // Other counts may be missing, and are doubles with NaN.
        whole: one.count && one.files == ListedIn::All,
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
