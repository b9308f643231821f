//! Options of a run: method, tolerances, budgets, and what is recorded.

use super::stepping::classical;
use crate::sundials::{Coefficients, ErkTable};
use stickslip_system::record::EventKind;

/// Integration method of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// The default: CVODE, with the best method, order and tolerance in each phase, see docs/theory.md.
    #[default]
    Cvode,
    /// ARKODE: the explicit method of order 8 for oscillations, the implicit one if nothing rings or the ringing is
    /// stiff.
    Arkode,
    /// CVODE BDF for everything.
    CvodeBdf,
    /// CVODE Adams for everything.
    CvodeAdams,
    /// ARKODE's explicit Runge-Kutta method for everything, with [`Method::BEST_PAIR`].
    Erk,
    /// ARKODE's singly diagonally implicit Runge-Kutta method for everything.
    Esdirk,
    /// Without SUNDIALS: Radau collocation in sliding, Taylor series for the fast mode, closed forms in stick and
    /// separation.
    Series,
    /// ARKODE's explicit Runge-Kutta method for everything, with this embedded pair.
    ErkPair(ErkTable),
    /// The paper's procedure, without location of events: see [`crate::simulation::procedure`].
    Paper,
    /// The classical Runge-Kutta method with [`SolverOptions::fixed_step`], without location of events: the naive solver
    /// that people compare with.
    Rk4,
}

/// Embedded explicit pairs by their user names: digits are the orders of the method and of the embedded method; stages
/// are added if two pairs share them.
const PAIRS: [(&str, ErkTable); 23] = [
    ("erk-heun-euler-21", ErkTable::HeunEuler2s12),
    ("erk-ralston-euler-21", ErkTable::RalstonEuler2s12),
    ("erk-midpoint-euler-21", ErkTable::ExplicitMidpointEuler2s12),
    ("erk-ark2-21", ErkTable::Ark2Erk3s12),
    ("erk-shu-osher-32", ErkTable::ShuOsher3s23),
    ("erk-bogacki-shampine-32", ErkTable::BogackiShampine4s23),
    ("erk-ark324l2sa-32", ErkTable::Ark324L2sa4s23),
    ("erk-zonneveld-43", ErkTable::Zonneveld5s34),
    ("erk-sofroniou-spaletta-43", ErkTable::SofroniouSpaletta5s34),
    ("erk-sayfy-aburub-43", ErkTable::SayfyAburub6s34),
    ("erk-ark436l2sa-43", ErkTable::Ark436L2sa6s34),
    ("erk-ark437l2sa-43", ErkTable::Ark437L2sa7s34),
    ("erk-cash-karp-54", ErkTable::CashKarp6s45),
    ("erk-fehlberg-54", ErkTable::Fehlberg6s45),
    ("erk-dormand-prince-54", ErkTable::DormandPrince7s45),
    ("erk-ark548l2sa-54", ErkTable::Ark548L2sa8s45),
    ("erk-ark548l2sab-54", ErkTable::Ark548L2sab8s45),
    ("erk-verner-65", ErkTable::Verner8s56),
    ("erk-verner-65-9s", ErkTable::Verner9s56),
    ("erk-verner-76", ErkTable::Verner10s67),
    ("erk-fehlberg-87", ErkTable::Fehlberg13s78),
    ("erk-verner-87", ErkTable::Verner13s78),
    ("erk-verner-98", ErkTable::Verner16s89),
];

impl Method {
    /// One method of each kind that locates events.
    pub const KINDS: [Method; 7] = [
        Method::Cvode,
        Method::Arkode,
        Method::CvodeBdf,
        Method::CvodeAdams,
        Method::Erk,
        Method::Esdirk,
        Method::Series,
    ];

    /// Pair of `arkode` and `erk`, of order 8, chosen by measurement (docs/theory.md).
    pub const BEST_PAIR: ErkTable = ErkTable::Fehlberg13s78;

    /// Every method.
    pub fn all() -> impl Iterator<Item = Method> {
        let pairs = PAIRS.iter().map(|&(_, table)| Method::ErkPair(table));
        Method::KINDS
            .into_iter()
            .chain([Method::Paper, Method::Rk4])
            .chain(pairs)
    }

    /// Name in case files, on the command line and in /meta of a result.
    pub fn name(self) -> &'static str {
        match self {
            Method::Cvode => "cvode",
            Method::Arkode => "arkode",
            Method::CvodeBdf => "cvode-bdf",
            Method::CvodeAdams => "cvode-adams",
            Method::Erk => "erk",
            Method::Esdirk => "esdirk",
            Method::Series => "series",
            Method::Paper => "paper",
            Method::Rk4 => "rk4",
            Method::ErkPair(table) => PAIRS
                .iter()
                .find(|pair| pair.1 == table)
                .map_or("erk-unnamed", |pair| pair.0),
        }
    }

    /// Name of the default in cases and files of earlier versions.
    pub const FORMER_DEFAULT: &'static str = "auto";

    /// The method of this name; [`Method::FORMER_DEFAULT`] means the default.
    pub fn from_name(name: &str) -> Option<Method> {
        match name {
            Method::FORMER_DEFAULT => Some(Method::default()),
            _ => Method::all().find(|m| m.name() == name),
        }
    }

    /// Butcher table if one of ARKODE's explicit Runge-Kutta methods integrates everything.
    pub fn explicit_table(self) -> Option<ErkTable> {
        match self {
            Method::Erk => Some(Method::BEST_PAIR),
            Method::ErkPair(table) => Some(table),
            _ => None,
        }
    }

    /// Explicit pair that follows the torsional oscillation; `arkode` has the pair of `erk` there.
    pub fn resolving_table(self) -> Option<ErkTable> {
        match self {
            Method::Arkode => Some(Method::BEST_PAIR),
            other => other.explicit_table(),
        }
    }

    /// Coefficients and order of a method that takes fixed steps; `None` for the others.
    pub fn fixed_steps(self) -> Option<(Coefficients, u32)> {
        match self {
            Method::Rk4 => Some((classical(), 4)),
            _ => self.explicit_table().map(|table| (table.coefficients(), table.order())),
        }
    }

    /// Key of the length of fixed steps in a case.
    pub fn step_key(self) -> &'static str {
        match self {
            Method::Rk4 => "solver.step",
            _ => "solver.fixed_step",
        }
    }

    /// Whether events are located between the steps, not only looked for at the ends of steps.
    pub fn locates_events(self) -> bool {
        !matches!(self, Method::Paper | Method::Rk4)
    }
}

/// Solver settings; `None` selects the default derived from the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct SolverOptions {
    /// Method.
    pub method: Method,
    /// Relative tolerance; smaller is more accurate in every phase.
    pub rtol: f64,
    /// Absolute tolerance of the twists, rad.
    pub atol_twist: Option<f64>,
    /// Absolute tolerance of the twist rates, rad/s.
    pub atol_rate: Option<f64>,
    /// Absolute tolerance of the relative velocity, rad/s.
    pub atol_speed: Option<f64>,
    /// Upper bound of every step, s.
    pub max_step: Option<f64>,
    /// Step without error control, s; for methods with [`Method::fixed_steps`].
    pub fixed_step: Option<f64>,
    /// Largest number of transitions before the run fails.
    pub max_events: usize,
    /// Largest number of steps before the run fails. Without it and without a step length, a run fails that foresees
    /// more than `FORESEEN_STEPS` in a segment.
    pub max_steps: Option<usize>,
    /// Wall time after which a run fails, s.
    pub max_wall_time: Option<f64>,
}

/// A segment makes no progress if its pace predicts more steps: at two to ten microseconds each it would take minutes;
/// ordinary runs have thousands.
pub(crate) const FORESEEN_STEPS: f64 = 3e7;

impl Default for SolverOptions {
    fn default() -> Self {
        SolverOptions {
            method: Method::default(),
            rtol: 1e-10,
            atol_twist: None,
            atol_rate: None,
            atol_speed: None,
            max_step: None,
            fixed_step: None,
            max_events: 100_000,
            max_steps: None,
            max_wall_time: None,
        }
    }
}

/// Sampling and end time of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputOptions {
    /// End time, s.
    pub end_time: f64,
    /// Sampling interval outside every window, s.
    pub interval: f64,
    /// Stretches with another interval.
    pub windows: Vec<OutputWindow>,
    /// Whether to record a sample at every step of the integrator too.
    pub steps: bool,
    /// Recording of the motion around events.
    pub follow: Following,
}

/// Recording of the motion around events.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Following {
    /// Events with dense samples around them.
    pub around: Option<Around>,
    /// Time before and after each event, s; by default [`Following::PERIODS`] natural periods.
    pub margin: Option<f64>,
    /// Samples in a natural period; by default [`Following::PER_PERIOD`].
    pub samples_per_period: Option<f64>,
    /// Whether to record polynomials, which give every channel at every time.
    pub dense: bool,
}

impl Following {
    /// Default number of natural periods with dense samples before and after an event.
    pub const PERIODS: f64 = 20.0;
    /// Default number of samples in a natural period.
    pub const PER_PERIOD: f64 = 100.0;

    pub(crate) fn sampling(&self, period: f64) -> (f64, f64) {
        let margin = self.margin.unwrap_or(Self::PERIODS * period);
        (margin, period / self.samples_per_period.unwrap_or(Self::PER_PERIOD))
    }
}

/// Events with dense samples around them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Around {
    /// All events.
    Events,
    /// Events of the event sequence: stick, slip, reversal, separation, contact.
    StickSlip,
    /// The first stick.
    Onset,
}

impl Around {
    /// All choices.
    pub const ALL: [Around; 3] = [Around::Events, Around::StickSlip, Around::Onset];

    /// Name in case files.
    pub fn name(self) -> &'static str {
        match self {
            Around::Events => "events",
            Around::StickSlip => "stick-slip",
            Around::Onset => "onset",
        }
    }

    /// Whether this choice includes an event of this kind after `sticks` sticks.
    pub(crate) fn takes(self, kind: EventKind, sticks: usize) -> bool {
        match self {
            Around::Events => true,
            Around::StickSlip => kind.in_event_sequence(),
            Around::Onset => kind == EventKind::Stick && sticks == 0,
        }
    }
}

impl OutputOptions {
    /// Samples at the start and at `end_time` (s) only, for a run that is made for its events.
    pub fn at_the_ends(end_time: f64) -> Self {
        OutputOptions {
            end_time,
            interval: end_time,
            windows: Vec::new(),
            steps: false,
            follow: Following::default(),
        }
    }
}

/// A stretch of time with its own sampling interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputWindow {
    /// Start, s.
    pub from: f64,
    /// End, s.
    pub to: f64,
    /// Interval, s.
    pub interval: f64,
}
