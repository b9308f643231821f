//! Options of a run: method, tolerances, budgets, and what is recorded.

use crate::record::EventKind;
use crate::sundials::ErkTable;

/// The integration method of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// CVODE for everything, by the method, order and tolerance that are best in each phase: docs/methods.md says why. The
    /// default.
    #[default]
    Cvode,
    /// ARKODE for everything: its explicit method of order 8 where oscillations are followed, its implicit one where nothing
    /// rings, or what rings is stiff.
    Arkode,
    /// CVODE BDF for everything.
    CvodeBdf,
    /// CVODE Adams for everything.
    CvodeAdams,
    /// ARKODE's explicit Runge-Kutta method for everything, with the pair that is best here: `Method::BEST_PAIR`.
    Erk,
    /// ARKODE's singly diagonally implicit Runge-Kutta method for everything.
    Esdirk,
    /// Radau collocation while sliding, Taylor series where the fast mode is followed, closed forms in stick and
    /// separation: no solver of SUNDIALS.
    Series,
    /// ARKODE's explicit Runge-Kutta method for everything, with this embedded pair.
    ErkPair(ErkTable),
    /// The procedure of the paper, in absolute angles and without location of events: see
    /// [`crate::simulation::procedure`].
    Paper,
}

/// The embedded explicit pairs by the names that users know: the digits are the order of the method and that of the
/// embedded one. Where two pairs share them, stages are added.
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
    /// One method of each kind that locates events. Every method is in [`Method::all`].
    pub const KINDS: [Method; 7] = [
        Method::Cvode,
        Method::Arkode,
        Method::CvodeBdf,
        Method::CvodeAdams,
        Method::Erk,
        Method::Esdirk,
        Method::Series,
    ];

    /// The pair of `arkode` and `erk`: of order 8, chosen by measurement (docs/methods.md).
    pub(crate) const BEST_PAIR: ErkTable = ErkTable::Fehlberg13s78;

    /// Every method: [`Method::KINDS`], the paper's procedure, and every embedded explicit pair.
    pub fn all() -> impl Iterator<Item = Method> {
        let pairs = PAIRS.iter().map(|&(_, table)| Method::ErkPair(table));
        Method::KINDS.into_iter().chain([Method::Paper]).chain(pairs)
    }

    /// The name in case files, on the command line and in /meta of a result.
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
            Method::ErkPair(table) => PAIRS
                .iter()
                .find(|pair| pair.1 == table)
                .map_or("erk-unnamed", |pair| pair.0),
        }
    }

    /// What cases and files of earlier versions call the default.
    pub const FORMER_DEFAULT: &'static str = "auto";

    /// The method of a name, if there is one; of [`Method::FORMER_DEFAULT`] the default.
    pub fn from_name(name: &str) -> Option<Method> {
        match name {
            Method::FORMER_DEFAULT => Some(Method::default()),
            _ => Method::all().find(|m| m.name() == name),
        }
    }

    /// The Butcher table, if one explicit Runge-Kutta method integrates everything: only these can take fixed steps.
    pub fn explicit_table(self) -> Option<ErkTable> {
        match self {
            Method::Erk => Some(Method::BEST_PAIR),
            Method::ErkPair(table) => Some(table),
            _ => None,
        }
    }

    /// The explicit pair by which the torsional oscillation is followed, if it is: `arkode` has the one of `erk` there.
    pub(crate) fn resolving_table(self) -> Option<ErkTable> {
        match self {
            Method::Arkode => Some(Method::BEST_PAIR),
            other => other.explicit_table(),
        }
    }

    /// Whether events are located between the steps. The paper's procedure sees them at the end of a step only.
    pub fn locates_events(self) -> bool {
        self != Method::Paper
    }
}

/// Solver settings; `None` means the default that the simulation derives from the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct SolverOptions {
    /// Which solvers.
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
    /// Steps of this length without control of the error, s; for the methods with an [`Method::explicit_table`].
    pub fixed_step: Option<f64>,
    /// Most transitions of a run before it is ended with an error.
    pub max_events: usize,
    /// Most steps of a run before it is ended with an error. Without it, and without a length of the steps, a run is ended
    /// that foresees more than `FORESEEN_STEPS` in a segment.
    pub max_steps: Option<usize>,
    /// Wall time after which a run is ended with an error, s.
    pub max_wall_time: Option<f64>,
}

/// A segment that would take more steps than this at its pace makes no progress: at two to ten microseconds each it would take minutes, where
/// the steps of an ordinary run are counted in thousands.
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

/// What is sampled, and until when the run goes.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputOptions {
    /// s.
    pub end_time: f64,
    /// Sampling interval outside every window, s.
    pub interval: f64,
    /// Stretches with an interval of their own.
    pub windows: Vec<OutputWindow>,
    /// Also record a sample at every step of the integrator.
    pub steps: bool,
    /// What of the motion is recorded where it happens, whenever that is.
    pub follow: Following,
}

/// What is recorded of the motion where it happens.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Following {
    /// Which events have dense samples around them; `None`: none.
    pub around: Option<Around>,
    /// How far before and after each of them, s; `None`: [`Following::PERIODS`] natural periods.
    pub margin: Option<f64>,
    /// Samples in a natural period there; `None`: [`Following::PER_PERIOD`].
    pub samples_per_period: Option<f64>,
    /// Record polynomials, which give every channel at every time.
    pub dense: bool,
}

impl Following {
    /// Natural periods before and after an event that have dense samples, unless a case says otherwise.
    pub const PERIODS: f64 = 20.0;
    /// Samples in a natural period, unless a case says otherwise.
    pub const PER_PERIOD: f64 = 100.0;

    /// Margin and interval (s) around the events, for a natural period (s).
    pub(crate) fn sampling(&self, period: f64) -> (f64, f64) {
        let margin = self.margin.unwrap_or(Self::PERIODS * period);
        (margin, period / self.samples_per_period.unwrap_or(Self::PER_PERIOD))
    }
}

/// Which events have dense samples around them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Around {
    /// All of every kind.
    Events,
    /// Those of the event sequence: stick, slip, reversal, separation, contact.
    StickSlip,
    /// The first stick.
    Onset,
}

impl Around {
    /// All.
    pub const ALL: [Around; 3] = [Around::Events, Around::StickSlip, Around::Onset];

    /// The name in case files.
    pub fn name(self) -> &'static str {
        match self {
            Around::Events => "events",
            Around::StickSlip => "stick-slip",
            Around::Onset => "onset",
        }
    }

    /// Whether an event of this kind is meant, before which there were so many sticks.
    pub(crate) fn takes(self, kind: EventKind, sticks: usize) -> bool {
        match self {
            Around::Events => true,
            Around::StickSlip => kind.in_event_sequence(),
            Around::Onset => kind == EventKind::Stick && sticks == 0,
        }
    }
}

impl OutputOptions {
    /// Of a run to `end_time` (s) that is made for its events: samples at its start and its end only.
    pub(crate) fn at_the_ends(end_time: f64) -> Self {
        OutputOptions {
            end_time,
            interval: end_time,
            windows: Vec::new(),
            steps: false,
            follow: Following::default(),
        }
    }
}

/// A stretch of time sampled more densely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputWindow {
    /// s.
    pub from: f64,
    /// s.
    pub to: f64,
    /// s.
    pub interval: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The C library says the orders; every table that it has with an embedding has one name.
    #[test]
    fn sundials_every_pair_has_a_name_that_tells_its_orders() {
        assert_eq!(PAIRS.len(), ErkTable::ALL.len());
        for &table in ErkTable::ALL {
            let names: Vec<&str> = PAIRS.iter().filter(|pair| pair.1 == table).map(|pair| pair.0).collect();
            let [name] = names[..] else {
                panic!("{table}: {names:?}")
            };
            let orders = format!("-{}{}", table.order(), table.embedded_order());
            let stages = format!("{orders}-{}s", table.stages());
            assert!(name.ends_with(&orders) || name.ends_with(&stages), "{name}: {table}");
            assert_eq!(Method::from_name(name), Some(Method::ErkPair(table)));
        }
    }
}
