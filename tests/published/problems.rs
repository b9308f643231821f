//! Dry friction problems of the literature through the same automaton, the same solvers and the same friction laws as the
//! brake.
//!
//! | problem | source | held against |
//! |---|---|---|
//! | block on a moving belt | Leine, van Campen, de Kraker, van den Steen 1998, doi 10.1023/A:1008289604683 | period, largest deflection, first stick |
//! | y'' + 0.2 y' + 4 sgn y' + y = 2 cos(pi t) | Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.6 | ten switching times |
//! | x'' + x + q sgn x' = cos(beta t) | Den Hartog 1931 | amplitude in closed form |
//!
//! Each is a unit mass on a surface that moves at constant speed; the mass slides forward or backward on it or rests on
//! it. Digits beyond those of the publications come from integration with 30 digits, independent of this program.

use nalgebra::DMatrixViewMut;
use std::f64::consts::PI;
use std::sync::Arc;
use stickslip::friction::{Coulomb, Hyperbolic, Law};
use stickslip::hybrid::{
    ChosenSolver, ClosedEnd, ClosedForm, ClosedFormEngine, Direction, Dynamics, Engine, Finish, Fired, Guard, Limits,
    Observer, ObserverError, Rules, SegmentReport, SolverKind, Start, Transition, run,
};
use stickslip::sundials::{ErkTable, EsdirkTable, Tolerances};

/// A unit mass with dry friction on a moving surface: x'' = force(t, x, x') - s friction(s (x' - surface_speed)).
trait Problem: Send + Sync + 'static {
    /// Everything but friction.
    fn force(&self, t: f64, x: f64, v: f64) -> f64;
    /// Its derivatives with respect to x and v.
    fn force_slopes(&self) -> (f64, f64);
    /// Friction at sliding speed `speed > 0`, and its derivative; smooth a little below 0.
    fn friction(&self, speed: f64) -> (f64, f64);
    /// Speed of the surface.
    fn surface_speed(&self) -> f64;
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Contact {
    Rest,
    /// Sliding forward (+1) or backward (-1) on the surface.
    Sliding(f64),
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Location {
    contact: Contact,
    /// Whether the next extreme of x is looked for: +1 for a maximum, -1 for a minimum, 0 for none.
    extreme: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// Comes to rest on the surface.
    Stick,
    Slip,
    /// Goes on to slide in the other sense.
    Reversal,
    /// x' = 0.
    Extreme,
}

struct Block<P>(P);

const STOPPING: Guard = Guard {
    name: "sliding speed reaches zero",
    direction: Direction::Falling,
};
const EXTREME: Guard = Guard {
    name: "speed reaches zero",
    direction: Direction::Falling,
};
const BREAKAWAY: Guard = Guard {
    name: "holding force reaches its limit",
    direction: Direction::Falling,
};

impl<P: Problem> Block<P> {
    fn limit(&self) -> f64 {
        self.0.friction(0.0).0
    }

    /// What friction has to carry to hold the block on the surface.
    fn holding(&self, t: f64, x: f64) -> f64 {
        self.0.force(t, x, self.0.surface_speed())
    }
}

impl<P: Problem> Dynamics for Block<P> {
    type Location = Location;

    fn dimension(&self) -> usize {
        2
    }

    fn rhs(&self, location: &Location, t: f64, y: &[f64], dydt: &mut [f64]) {
        dydt[0] = y[1];
        dydt[1] = match location.contact {
            Contact::Rest => 0.0,
            Contact::Sliding(s) => {
                self.0.force(t, y[0], y[1]) - s * self.0.friction(s * (y[1] - self.0.surface_speed())).0
            }
        };
    }

    fn jacobian(&self, location: &Location, _t: f64, y: &[f64], mut jacobian: DMatrixViewMut<'_, f64>) {
        jacobian[(0, 1)] = 1.0;
        if let Contact::Sliding(s) = location.contact {
            let (by_x, by_v) = self.0.force_slopes();
            jacobian[(1, 0)] = by_x;
            jacobian[(1, 1)] = by_v - self.0.friction(s * (y[1] - self.0.surface_speed())).1;
        }
    }

    fn guards(&self, location: &Location) -> &'static [Guard] {
        match location.contact {
            Contact::Rest => const { &[BREAKAWAY, BREAKAWAY] },
            Contact::Sliding(_) if location.extreme == 0.0 => const { &[STOPPING] },
            Contact::Sliding(_) => const { &[STOPPING, EXTREME] },
        }
    }

    fn guard_values(&self, location: &Location, t: f64, y: &[f64], values: &mut [f64]) {
        match location.contact {
            Contact::Rest => {
                values[0] = self.limit() - self.holding(t, y[0]);
                values[1] = self.limit() + self.holding(t, y[0]);
            }
            Contact::Sliding(s) => {
                values[0] = s * (y[1] - self.0.surface_speed());
                if location.extreme != 0.0 {
                    values[1] = location.extreme * y[1];
                }
            }
        }
    }
}

impl<P: Problem> ClosedForm for Block<P> {
    fn closed_state(&self, _location: &Location, _t: f64, y: &[f64], tau: f64, out: &mut [f64]) {
        out[0] = y[0] + self.0.surface_speed() * tau;
        out[1] = self.0.surface_speed();
    }

    /// For a force that is -x on a moving surface, as on the belt: |x| reaches the limit on the way forward.
    fn closed_end(&self, _location: &Location, _t: f64, y: &[f64], within: f64) -> ClosedEnd {
        let after = (self.limit() - y[0]) / self.0.surface_speed();
        if after < within {
            ClosedEnd::Guard { after, index: 1 }
        } else {
            ClosedEnd::None
        }
    }
}

struct BlockRules<P> {
    block: Arc<Block<P>>,
    sliding: ChosenSolver,
    rest: ChosenSolver,
    /// Whether extremes of x are events; only where they are not switches anyway.
    extremes: bool,
}

impl<P: Problem> BlockRules<P> {
    fn slide(&self, s: f64, y: &[f64]) -> Location {
        let extreme = if self.extremes { y[1].signum() } else { 0.0 };
        Location {
            contact: Contact::Sliding(s),
            extreme,
        }
    }
}

impl<P: Problem> Rules<Block<P>> for BlockRules<P> {
    type Kind = Kind;

    fn next_time_event(&mut self, _: &Location, _: f64) -> Option<f64> {
        None
    }

    fn at_time_event(&mut self, _: &Location, _: f64, _: &[f64]) -> Vec<Transition<Kind, Location>> {
        unreachable!("there are none")
    }

    fn at_guards(&mut self, location: &Location, t: f64, y: &[f64], fired: Fired) -> Vec<Transition<Kind, Location>> {
        let surface = self.block.0.surface_speed();
        let (kind, location, state) = match location.contact {
            Contact::Rest => {
                let s = if fired.contains(0) { 1.0 } else { -1.0 };
                (Kind::Slip, self.slide(s, y), y.to_vec())
            }
            Contact::Sliding(_) if !fired.contains(0) => {
                let extreme = -location.extreme;
                (Kind::Extreme, Location { extreme, ..*location }, y.to_vec())
            }
            Contact::Sliding(_) => {
                let (holding, stopped) = (self.block.holding(t, y[0]), vec![y[0], surface]);
                if holding.abs() <= self.block.limit() {
                    let contact = Contact::Rest;
                    (Kind::Stick, Location { contact, extreme: 0.0 }, stopped)
                } else {
                    (Kind::Reversal, self.slide(holding.signum(), &stopped), stopped)
                }
            }
        };
        vec![Transition {
            kind: Some(kind),
            location,
            state,
        }]
    }

    fn engine(&self, kind: &SolverKind) -> Option<Box<dyn Engine<Location>>> {
        match kind {
            SolverKind::ClosedForm => Some(Box::new(ClosedFormEngine::new(self.block.clone()))),
            _ => None,
        }
    }

    fn solver(&self, location: &Location, _: f64, _: &[f64]) -> ChosenSolver {
        match location.contact {
            Contact::Rest => self.rest.clone(),
            Contact::Sliding(_) => self.sliding.clone(),
        }
    }

    fn counts(&self, kind: &Kind) -> bool {
        *kind != Kind::Extreme
    }

    fn chatter_window(&self) -> f64 {
        1e-6
    }
}

/// (time, kind, x after it)
type Happened = (f64, Kind, f64);

#[derive(Default)]
struct Log(Vec<Happened>);

impl Observer<Location, Kind> for Log {
    fn next_sample_time(&self) -> f64 {
        f64::INFINITY
    }
    fn sample(&mut self, _: f64, _: &Location, _: &[f64]) -> Result<(), ObserverError> {
        Ok(())
    }
    fn event(
        &mut self,
        t: f64,
        kind: Kind,
        _: (&Location, &[f64]),
        after: (&Location, &[f64]),
    ) -> Result<(), ObserverError> {
        self.0.push((t, kind, after.1[0]));
        Ok(())
    }
    fn segment(&mut self, _: &SegmentReport<Location>) -> Result<(), ObserverError> {
        Ok(())
    }
}

/// A solver, and how close it has to come.
///
/// The solutions are of size 1 and smooth on the scale of 1; a run has some hundred steps (order 8) to some ten
/// thousand (order 5 and the multistep methods), and the tolerance bounds the error of one.
#[derive(Debug, Clone, Copy)]
struct Tool {
    kind: SolverKind,
    relative: f64,
    /// Of times and states.
    error: f64,
}

const TOOLS: [Tool; 4] = [
    // Rounding: some thousand steps of a few 1e-16 each, as in 400 half periods.
    Tool {
        kind: SolverKind::Erk(ErkTable::Fehlberg13s78),
        relative: 1e-14,
        error: 1e-13,
    },
    // A thousand times the tolerance: what the local errors of 1e-12 can add up to, one sign assumed.
    Tool {
        kind: SolverKind::Esdirk(EsdirkTable::Esdirk547L2sa7s45),
        relative: 1e-12,
        error: 1e-9,
    },
    Tool {
        kind: SolverKind::CvodeBdf { max_order: 5 },
        relative: 1e-12,
        error: 1e-8,
    },
    Tool {
        kind: SolverKind::CvodeAdams,
        relative: 1e-12,
        error: 1e-9,
    },
];

impl Tool {
    fn chosen(&self) -> ChosenSolver {
        ChosenSolver {
            kind: self.kind,
            tolerances: Tolerances::uniform(self.relative, self.relative, 2),
            // Half a swing takes 1 or more: no step sees both roots of one.
            max_step: Some(0.1),
            fixed_step: None,
        }
    }

    /// The events of a run.
    fn run<P: Problem>(&self, problem: P, start: (Contact, [f64; 2]), end: f64, rest: Option<SolverKind>) -> Log {
        let block = Arc::new(Block(problem));
        let sliding = self.chosen();
        let mut rules = BlockRules {
            block: block.clone(),
            rest: ChosenSolver {
                kind: rest.unwrap_or(self.kind),
                ..sliding.clone()
            },
            sliding,
            extremes: block.0.surface_speed() != 0.0,
        };
        let (contact, state) = start;
        let location = match contact {
            Contact::Rest => Location { contact, extreme: 0.0 },
            Contact::Sliding(s) => rules.slide(s, &state),
        };
        let start = Start {
            time: 0.0,
            location,
            state: state.to_vec(),
        };
        let limits = Limits {
            max_events: 10_000,
            max_steps: None,
            foreseen_steps: None,
            chatter_count: 10,
        };
        let mut log = Log::default();
        let Finish { time, .. } = run(&block, &mut rules, start, end, limits, &mut log).expect("a run");
        assert_eq!(time, end);
        log
    }

    /// Asserts a printed number: within half a unit of its last digit and this solver's error.
    fn hold(&self, what: &str, value: f64, printed: &str) {
        let digits = printed.split_once('.').map_or(0, |(_, decimals)| decimals.len()) as i32;
        let allowed = self.error + 0.5 * 10f64.powi(-digits);
        let error = (value - printed.parse::<f64>().unwrap()).abs();
        println!("{:11} {what}: {error:.1e} of {allowed:.1e}", self.kind.name());
        assert!(
            error <= allowed,
            "{}: {what} {value} is not {printed}",
            self.kind.name()
        );
    }
}

/// m = k = 1, v_dr = 0.2, F = F_s / (1 + 3 |v_rel|), F_s = 1.
struct Belt;

impl Problem for Belt {
    fn force(&self, _t: f64, x: f64, _v: f64) -> f64 {
        -x
    }
    fn force_slopes(&self) -> (f64, f64) {
        (-1.0, 0.0)
    }
    fn friction(&self, speed: f64) -> (f64, f64) {
        let law = Hyperbolic {
            low_speed: 1.0,
            high_speed: 0.0,
            scale: 1.0 / 3.0,
        };
        law.coefficient_and_slope(speed)
    }
    fn surface_speed(&self) -> f64 {
        0.2
    }
}

/// From the very point of breakaway, where sliding speed and its derivative are both zero.
fn belt_cycles(tool: &Tool, start: Contact, rest: Option<SolverKind>) {
    let log = tool.run(Belt, (start, [1.0, 0.2]), 41.0, rest).0;
    let of = |kind: Kind| -> Vec<Happened> { log.iter().copied().filter(|e| e.1 == kind).collect() };
    let (sticks, slips, extremes) = (of(Kind::Stick), of(Kind::Slip), of(Kind::Extreme));
    assert_eq!(of(Kind::Reversal), []);
    // A start at rest breaks away at once; one that slides already does not say so.
    let breakaways: Vec<f64> = match start {
        Contact::Rest => slips.iter().map(|e| e.0).collect(),
        Contact::Sliding(_) => std::iter::once(0.0).chain(slips.iter().map(|e| e.0)).collect(),
    };
    assert_eq!((sticks.len(), breakaways.len(), extremes.len()), (4, 4, 8), "{log:?}");
    // A stick lasts (1 - x) / 0.2: five times the error of its position.
    let five = Tool {
        error: 5.0 * tool.error,
        ..*tool
    };
    tool.hold("first restick", sticks[0].0, "4.295999525480");
    for (n, stick) in sticks.iter().enumerate() {
        tool.hold("position of the stick", stick.2, "-0.541006353870");
        tool.hold("largest deflection", extremes[2 * n].2, "1.133944676442");
        if let Some(slip) = breakaways.get(n + 1) {
            five.hold("duration of the stick", slip - stick.0, "7.705031769350");
            five.hold("period", slip - breakaways[n], "12.001031294831");
        }
        if let Some(next) = sticks.get(n + 1) {
            five.hold("period", next.0 - stick.0, "12.001031294831");
        }
    }
}

#[test]
fn published_belt_of_leine_et_al() {
    for tool in &TOOLS {
        belt_cycles(tool, Contact::Sliding(-1.0), None);
    }
}

/// At rest on the belt at x = 1 the holding force stands exactly at its limit: the automaton has to let go there.
#[test]
fn published_belt_of_leine_et_al_from_rest() {
    for tool in &TOOLS {
        belt_cycles(tool, Contact::Rest, None);
    }
}

#[test]
fn published_belt_of_leine_et_al_with_rest_in_closed_form() {
    belt_cycles(&TOOLS[0], Contact::Sliding(-1.0), Some(SolverKind::ClosedForm));
    belt_cycles(&TOOLS[0], Contact::Rest, Some(SolverKind::ClosedForm));
}

/// y'' + 0.2 y' + 4 sgn(y') + y = 2 cos(pi t), y(0) = 3, y'(0) = 4.
struct HairerNorsettWanner;

impl Problem for HairerNorsettWanner {
    fn force(&self, t: f64, x: f64, v: f64) -> f64 {
        2.0 * (PI * t).cos() - 0.2 * v - x
    }
    fn force_slopes(&self) -> (f64, f64) {
        (-1.0, -0.2)
    }
    fn friction(&self, speed: f64) -> (f64, f64) {
        Coulomb { kinetic: 4.0 }.coefficient_and_slope(speed)
    }
    fn surface_speed(&self) -> f64 {
        0.0
    }
}

#[test]
fn published_dry_friction_of_hairer_norsett_wanner() {
    const PUBLISHED: [(Kind, &str); 10] = [
        (Kind::Reversal, "0.5628053252453"),
        (Kind::Stick, "2.0352004340435"),
        (Kind::Slip, "2.6281267558097"),
        (Kind::Stick, "3.7271965227420"),
        (Kind::Slip, "4.6848821753725"),
        (Kind::Stick, "5.6179464655653"),
        (Kind::Slip, "6.7193536862180"),
        (Kind::Stick, "7.5513518942033"),
        (Kind::Slip, "8.7436750797238"),
        (Kind::Stick, "9.5042427407817"),
    ];
    for tool in &TOOLS {
        let log = tool
            .run(HairerNorsettWanner, (Contact::Sliding(1.0), [3.0, 4.0]), 10.0, None)
            .0;
        assert_eq!(log.len(), PUBLISHED.len(), "{log:?}");
        for ((time, kind, _), (published_kind, published)) in log.iter().zip(PUBLISHED) {
            assert_eq!(*kind, published_kind);
            tool.hold(&format!("{kind:?}"), *time, published);
        }
    }
}

/// x'' + x + q sgn(x') = cos(beta t).
#[derive(Clone, Copy)]
struct DenHartog {
    beta: f64,
    q: f64,
}

impl Problem for DenHartog {
    fn force(&self, t: f64, x: f64, _v: f64) -> f64 {
        (self.beta * t).cos() - x
    }
    fn force_slopes(&self) -> (f64, f64) {
        (-1.0, 0.0)
    }
    fn friction(&self, speed: f64) -> (f64, f64) {
        Coulomb { kinetic: self.q }.coefficient_and_slope(speed)
    }
    fn surface_speed(&self) -> f64 {
        0.0
    }
}

/// X = sqrt(V^2 - q^2 U^2), V = 1/(1 - beta^2), U = sin(pi/beta) / (beta (1 + cos(pi/beta))).
fn den_hartog_amplitude(DenHartog { beta, q }: DenHartog) -> f64 {
    let v = 1.0 / (1.0 - beta * beta);
    let u = (PI / beta).sin() / (beta * (1.0 + (PI / beta).cos()));
    (v * v - q * q * u * u).sqrt()
}

/// The steady motion attracts: each reversal multiplies the deviation of the speed by the ratio of the accelerations
/// after and before it, which lies below 1. From rest, 400 half periods leave nothing of the start in these four cases.
#[test]
fn published_steady_motion_of_den_hartog() {
    for (beta, q, printed) in [
        (2.0, 0.3, "0.297676184992"),
        (0.8, 0.4, "2.501787881002"),
        (1.5, 0.5, "0.553774924195"),
        (0.6, 0.3, "1.535601809281"),
    ] {
        let problem = DenHartog { beta, q };
        let half_period = PI / beta;
        for tool in &TOOLS {
            tool.hold("amplitude in closed form", den_hartog_amplitude(problem), printed);
            let log = tool
                .run(problem, (Contact::Rest, [0.0, 0.0]), 400.5 * half_period, None)
                .0;
            let steady = &log[log.len() - 6..];
            for pair in steady.windows(2) {
                assert_eq!(pair[0].1, Kind::Reversal, "beta {beta}: {steady:?}");
                assert!(pair[0].2 * pair[1].2 < 0.0, "beta {beta}: {steady:?}");
                tool.hold(
                    &format!("amplitude for beta = {beta}, q = {q}"),
                    pair[1].2.abs(),
                    printed,
                );
                let error = (pair[1].0 - pair[0].0 - half_period).abs();
                // Of the two times a rounding of 400 half periods each.
                assert!(
                    error <= 2.0 * tool.error + 1e-12,
                    "beta {beta}: half period off by {error:e}"
                );
            }
        }
    }
}
