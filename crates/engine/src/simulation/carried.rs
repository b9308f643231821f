//! Derivatives of a run by parameters: of the state and of the event times.
//!
//! With F the right-hand side of a segment, the derivative d of the state by a parameter p obeys d' = F_y d + F_p.
//! Radau IIA, which is linear here, integrates d along with the run. An event has a guard h or a time T(p), and a map M
//! of the state. It moves by dt:
//!
//! ```text
//! dt = -(h_y d + h_p) / (h_t + h_y F-)   or   T',
//! d+ = M_y (d + F- dt) + M_t dt + M_p - F+ dt
//! ```
//!
//! (saltation). F_p, h_p, M_p and T' are differences between copies of the whole system with the parameter moved, on
//! the path of the run. The derivatives of h and M by time and state are the equations' own.
//!
//! Deviations of the state are further columns: unit deviations since the last event carry rounding
//! ([`super::rounding`]); unit deviations since a loss of stability measure growth. Growth restarts if an earlier one
//! has died out, or if an event replaces the state.

use super::rounding::{Rounded, RoundingVariance};
use super::rules::SystemRules;
use crate::Error;
use crate::hybrid::dynamics::{GUARD_STOPPING, SystemDynamics, SystemLocation};
use crate::hybrid::{Advance, ChosenSolver, Engine, EngineSegment, Fired, Rules, SolverKind, StateAt, Transition};
use crate::sundials::Counters;
use nalgebra::{DMatrix, DVector, Dyn, LU};
use std::ops::{AddAssign, Range};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{Engagement, Outside, SystemEquations};
use stickslip_system::model::slow_manifold::{Slip, has_slow_manifold, on_slow_manifold, slow_momenta};
use stickslip_system::numerics::eigenvalues::eigenvalues;
use stickslip_system::numerics::radau::RadauTableau;
use stickslip_system::record::EventKind;

/// Radau IIA with these stages has order 13.
const STAGES: usize = 7;

/// Largest product of step and fastest eigenvalue: the local error is then below 1e-12.
const REACH: f64 = 1.4;

/// If the fastest mode would turn by more than this (rad) in one step of a series, the series has stepped over the
/// mode. The mode is quiet, and is damped in the derivatives as well.
const STRIDE: f64 = 100.0;
const STEPS_OF_STRIDE: f64 = 4.0;

/// In a step of the slow motion each stride turns the fastest mode by at least this (rad), which damps deviations from
/// the slow manifold even where the manifold is unstable. `MOST_STRIDES` are enough for slow motion. A shorter step is
/// one stride: finer strides would follow the growth.
const TURN_OF_STRIDE: f64 = 30.0;
const MOST_STRIDES: f64 = 8.0;

/// Growth of the Jacobian after which its eigenvalues are computed again.
const LARGER: f64 = 1.1;

/// Least number of steps in a step of a series, which spans some 3.5 rad of the fastest motion or signal.
const STEPS_OF_SERIES: f64 = 3.0;

/// Largest difference between the two one-sided slopes of an event time: relative, and in roundings of the time.
const BENT: f64 = 0.2;
const TIME_ROUNDING: f64 = 32.0;

/// A copy of the system with one parameter moved. The weights of all copies of a parameter add up to zero; the sum of
/// weight times value is the derivative of the value.
pub(crate) struct MovedCopy {
    pub dynamics: Arc<SystemDynamics>,
    /// Rules that lead to the same events in the same order, without instants that change nothing.
    pub rules: SystemRules,
    /// Weight per unit of the parameter.
    pub weight: f64,
    /// Weight of the test for a bend: the sum over the copies of this times value vanishes if the value has equal
    /// slopes on both sides.
    pub bend: f64,
    next: Option<f64>,
    last: f64,
}

impl MovedCopy {
    pub fn new((dynamics, rules): (Arc<SystemDynamics>, SystemRules), weight: f64, bend: f64) -> Self {
        MovedCopy {
            dynamics,
            rules: rules.resolving_all(),
            weight,
            bend,
            next: None,
            last: f64::NEG_INFINITY,
        }
    }
}

/// Effect of a parameter, or of a deviation of the state, on the state. Without copies, a parameter affects the initial
/// state alone.
pub(crate) struct VariationColumn {
    pub copies: Vec<MovedCopy>,
    /// Derivative of the components that the motion depends on; at first that of the initial state.
    pub slope: DVector<f64>,
    /// Whether the copies' equations differ from the run's.
    pub in_equations: bool,
    /// Value of the parameter, if its rounding counts.
    pub rounded: Option<f64>,
}

/// Error of a state that replaces the present one at an event, and the quantity that is kept.
struct Replaced {
    error: Vec<f64>,
    kept: DVector<f64>,
}

/// Effect of small changes on an event.
pub struct Passage {
    /// d(time)/d(parameter), s per unit.
    pub times: Vec<f64>,
    /// ln of the largest amplification of a deviation, from the start of growth to just after the event.
    pub growth: Option<f64>,
    /// Shift of the event by a unit deviation at the start of growth, in the worst direction, s.
    pub per_deviation: Option<f64>,
    /// Error bound of the event time from rounding to double precision, s.
    pub rounding: f64,
}

impl VariationColumn {
    pub fn of_state(slope: DVector<f64>) -> Self {
        VariationColumn {
            copies: Vec::new(),
            slope,
            in_equations: false,
            rounded: None,
        }
    }

    fn sum(&mut self, mut value: impl FnMut(&mut MovedCopy) -> Option<f64>) -> f64 {
        let of = |moved: &mut MovedCopy| moved.weight * value(moved).unwrap_or(f64::NAN);
        self.copies.iter_mut().map(of).sum()
    }

    /// d(time)/d(parameter) of the time event at `t` (s). NaN if the slopes on the two sides differ, for example if
    /// another parameter's event comes first on one side.
    fn shift_of_time(&mut self, t: f64) -> f64 {
        let (mut bent, mut most) = (0.0, 0.0f64);
        for moved in &self.copies {
            let change = moved.next.map_or(f64::NAN, |next| next - t);
            bent += moved.bend * change;
            most = most.max(change.abs());
        }
        if bent.abs() <= BENT * most + TIME_ROUNDING * f64::EPSILON * t {
            self.sum(|moved| moved.next)
        } else {
            f64::NAN
        }
    }
}

#[derive(Clone, Copy)]
enum VariationSteps {
    /// The fast modes may be active.
    Resolving,
    Series,
    /// All fast modes are quiet.
    Slow,
}

pub(crate) struct Carried {
    dynamics: Arc<SystemDynamics>,
    /// Factors that make the components comparable.
    weights: Vec<f64>,
    moving: usize,
    /// Columns: the effect of each parameter; the effect of each through separately derived constants; unit deviations
    /// since the last event; unit deviations since the start of growth.
    columns: Vec<VariationColumn>,
    numbers: usize,
    /// If set, a copy with other events than the run gives no derivative.
    same_events: bool,
    growing: bool,
    /// Time of the last event, s, and its shift by each column.
    last: Option<(f64, Vec<f64>)>,
    rounding: RoundingVariance,
    /// Time of the last possible event, s. Derivatives are not carried beyond it.
    end: f64,
    passages: Vec<Passage>,
    factors: Option<VariationFactors>,
    /// Magnitude of the fastest eigenvalue, 1/s, and the largest magnitude in its matrix.
    fastest: f64,
    of_size: f64,
    nodes: RadauTableau<STAGES>,
}

struct VariationFactors {
    step: f64,
    jacobian: DMatrix<f64>,
    lu: LU<f64, Dyn, Dyn>,
}

fn fastest(jacobian: &DMatrix<f64>) -> f64 {
    eigenvalues(jacobian)
        .iter()
        .map(|value| value.norm())
        .fold(0.0, f64::max)
}

impl Carried {
    /// Derivatives of a run of `dynamics` by the parameters `columns`. A last step that ends at `end` (s) or later is left
    /// out, because no event follows; with an infinite `end` the last state is included.
    pub(crate) fn new(dynamics: Arc<SystemDynamics>, end: f64, mut columns: Vec<VariationColumn>) -> Self {
        let (count, moving) = (columns.len(), dynamics.system.mechanical());
        columns.extend((0..count + 2 * moving).map(|_| VariationColumn::of_state(DVector::zeros(moving))));
        let mut carried = Carried {
            columns,
            numbers: count,
            same_events: true,
            growing: false,
            last: None,
            rounding: RoundingVariance::new(moving),
            weights: deviation_weights(&dynamics.system),
            dynamics,
            moving,
            end,
            passages: Vec::new(),
            factors: None,
            fastest: 0.0,
            of_size: 0.0,
            nodes: RadauTableau::new(),
        };
        carried.restart(carried.since());
        carried
    }

    /// Allows copies to have other events than the run at the border of a stick.
    pub(crate) fn beside_borders(self) -> Self {
        Carried {
            same_events: false,
            ..self
        }
    }

    pub(crate) fn into_passages(self) -> Vec<Passage> {
        self.passages
    }

    pub(crate) fn slopes(&self) -> DMatrix<f64> {
        self.deviations(0..self.numbers)
    }

    fn since(&self) -> Range<usize> {
        2 * self.numbers..2 * self.numbers + self.moving
    }

    fn grown(&self) -> Range<usize> {
        let first = 2 * self.numbers + self.moving;
        first..first + self.moving
    }

    fn restart(&mut self, columns: Range<usize>) {
        for (k, column) in self.columns[columns].iter_mut().enumerate() {
            column.slope.fill(0.0);
            column.slope[k] = 1.0;
        }
    }

    fn deviations(&self, columns: Range<usize>) -> DMatrix<f64> {
        let first = columns.start;
        DMatrix::from_fn(self.moving, columns.len(), |i, j| self.columns[first + j].slope[i])
    }

    fn growth(&self) -> f64 {
        let (grown, weights) = (self.deviations(self.grown()), &self.weights);
        let scaled = DMatrix::from_fn(self.moving, self.moving, |i, j| grown[(i, j)] * weights[i] / weights[j]);
        match scaled.iter().all(|x| x.is_finite()) {
            true => scaled.singular_values().max().ln(),
            false => f64::NAN,
        }
    }

    fn rates(&self, dynamics: &SystemDynamics, location: &SystemLocation, t: f64, y: &[f64]) -> Vec<f64> {
        let mut rates = vec![0.0; y.len()];
        dynamics.rhs(location, t, y, &mut rates);
        rates
    }

    fn jacobian(&self, location: &SystemLocation, t: f64, y: &[f64]) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(y.len(), y.len());
        self.dynamics.jacobian(location, t, y, jacobian.as_view_mut());
        jacobian.view((0, 0), (self.moving, self.moving)).into_owned()
    }

    fn measure(&mut self, location: &SystemLocation, t: f64, y: &[f64], anew: bool) {
        let jacobian = self.jacobian(location, t, y);
        let size = jacobian.amax();
        if anew || size > LARGER * self.of_size {
            let fastest = fastest(&jacobian);
            self.fastest = if anew { fastest } else { self.fastest.max(fastest) };
            self.of_size = size;
        }
    }

    /// Carries the derivatives over a step from `from` to `to` (s on the segment's clock, which starts at `origin`).
    fn carry(
        &mut self,
        location: &SystemLocation,
        origin: f64,
        (from, to, kind): (f64, f64, VariationSteps),
        at: &mut StateAt<'_>,
    ) -> Result<(), Error> {
        let (n, dimension) = (self.moving, self.dynamics.dimension());
        let mut y = vec![0.0; dimension];
        at(to, &mut y)?;
        self.measure(location, origin + to, &y, false);
        let turned = (to - from) * self.fastest;
        let steps = match kind {
            VariationSteps::Slow => (turned / TURN_OF_STRIDE).floor().clamp(1.0, MOST_STRIDES),
            VariationSteps::Series if turned > STRIDE => STEPS_OF_STRIDE,
            VariationSteps::Series => (turned / REACH).ceil().max(STEPS_OF_SERIES),
            VariationSteps::Resolving => (turned / REACH).ceil().max(1.0),
        };
        let h = (to - from) / steps;
        let forcing: Vec<usize> = (0..self.numbers).filter(|&k| self.columns[k].in_equations).collect();
        // Equations of stick have constants that are derived separately.
        let apart = location.mode == Mode::Stick;
        let slopes: Vec<DVector<f64>> = self.columns.iter().map(|column| column.slope.clone()).collect();
        let mut slopes = DMatrix::from_columns(&slopes);
        let mut rates = vec![0.0; dimension];
        for step in 0..steps as usize {
            let start = from + step as f64 * h;
            let mut jacobians = Vec::with_capacity(STAGES);
            // Columns: unit deviations, then the parameters in `forcing`. Rows: right-hand sides of the stages,
            // replaced by the rates of the stages.
            let mut stages = DMatrix::zeros(STAGES * n, n + forcing.len());
            for i in 0..STAGES {
                let tau = start + self.nodes.c[i] * h;
                at(tau, &mut y)?;
                let jacobian = self.jacobian(location, origin + tau, &y);
                stages.view_mut((i * n, 0), (n, n)).copy_from(&jacobian);
                jacobians.push(jacobian);
                for (column, &number) in forcing.iter().enumerate() {
                    for moved in &self.columns[number].copies {
                        moved.dynamics.rhs(location, origin + tau, &y, &mut rates);
                        for k in 0..n {
                            stages[(i * n + k, n + column)] += moved.weight * rates[k];
                        }
                    }
                }
            }
            if !self.factors(h, &jacobians).solve_mut(&mut stages) {
                slopes.fill(f64::NAN);
                break;
            }
            let mut change = DMatrix::zeros(n, n + forcing.len());
            for i in 0..STAGES {
                change += stages.rows(i * n, n) * (h * self.nodes.b[i]);
            }
            slopes += change.columns(0, n) * &slopes;
            for (column, &number) in forcing.iter().enumerate() {
                let added = change.column(n + column);
                slopes.column_mut(number).add_assign(&added);
                if apart {
                    slopes.column_mut(self.numbers + number).add_assign(&added);
                }
            }
        }
        for (column, slope) in self.columns.iter_mut().zip(slopes.column_iter()) {
            column.slope.copy_from(&slope);
        }
        Ok(())
    }

    fn factors(&mut self, h: f64, jacobians: &[DMatrix<f64>]) -> &LU<f64, Dyn, Dyn> {
        let first = &jacobians[0];
        let linear = jacobians.iter().all(|jacobian| jacobian == first);
        let kept = self
            .factors
            .take()
            .filter(|kept| linear && kept.step == h && kept.jacobian == *first);
        let factors = kept.unwrap_or_else(|| {
            let n = self.moving;
            let mut matrix = DMatrix::identity(STAGES * n, STAGES * n);
            for (i, jacobian) in jacobians.iter().enumerate() {
                for j in 0..STAGES {
                    let mut block = matrix.view_mut((i * n, j * n), (n, n));
                    block -= jacobian * (h * self.nodes.a[(i, j)]);
                }
            }
            VariationFactors {
                step: h,
                jacobian: first.clone(),
                lu: matrix.lu(),
            }
        });
        &self.factors.insert(factors).lu
    }

    /// Maps a change of the state before an event, at the event's moved time, to the change after it. `fired`: the
    /// guards that set the event off, with the shift of its time (s); `None` if the time is prescribed.
    fn carry_over(
        &self,
        location: &SystemLocation,
        t: f64,
        fired: Option<(Fired, f64)>,
        transitions: &[Transition],
        change: &mut [f64],
    ) {
        let reaches = |mode: Mode| location.mode != mode && transitions.iter().any(|one| one.location.mode == mode);
        let joins = match (fired, location.mode) {
            (Some(_), Mode::Stick) => true,
            (Some(_), Mode::Engaged) => false,
            (Some((fired, _)), _) => fired.contains(GUARD_STOPPING),
            (None, _) => reaches(Mode::Stick),
        };
        let system = &self.dynamics.system;
        if joins {
            // The map is linear in the state and the speeds of the ends.
            let dt = fired.map_or(0.0, |fired| fired.1);
            system.join(&self.dynamics.outside_rates(location, t).scaled(dt), change);
        }
        if let (Engagement::Bristles(.., at), true) = (&system.engagement, reaches(Mode::Separated)) {
            change[*at] = 0.0;
        }
    }

    /// A kick is added to the slow manifold, at the point with the state's momentum.
    fn replaced(&self, location: &SystemLocation, t: f64, y: &[f64], transitions: &[Transition]) -> Option<Replaced> {
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let kick = transitions.iter().find(|one| one.kind == Some(EventKind::Kick))?;
        let kept = system.twist_rates().all(|rate| kick.state[rate - 1] == y[rate - 1]);
        if kept || location.mode.sense() == 0 || !has_slow_manifold(system) {
            return None;
        }
        let pressing = excitation.line(location.stretch, t);
        let slip = Slip::undriven(location.sign(), location.piece, &pressing);
        let slow = on_slow_manifold(system, &slip, y);
        let momentum = |k: usize| {
            let mut unit = vec![0.0; system.dimension];
            unit[k] = 1.0;
            slow_momenta(system, &Outside::default(), &unit).iter().sum()
        };
        // Rounding is counted elsewhere.
        let error = if slow.settled { Vec::new() } else { slow.error };
        Some(Replaced {
            error: error.into_iter().take(system.mechanical()).collect(),
            kept: DVector::from_fn(system.mechanical(), |k, _| momentum(k)),
        })
    }

    fn guard_slope(
        &self,
        location: &SystemLocation,
        (t, y): (f64, &[f64]),
        change: (f64, &DVector<f64>),
        guard: usize,
    ) -> f64 {
        let mut slopes = vec![0.0; self.dynamics.guards(location).len()];
        let change = (change.0, change.1.as_slice());
        self.dynamics.guard_slopes(location, t, y, change, &mut slopes);
        slopes[guard]
    }
}

/// Factors that make the components of a deviation comparable: for a twist the frequency of its inertia on its shaft,
/// rad/s; otherwise 1.
pub fn deviation_weights(system: &SystemEquations) -> Vec<f64> {
    let mut weights = vec![1.0; system.mechanical()];
    for side in [&system.rotor, &system.stator] {
        for i in 0..side.shafts() {
            weights[side.twists + 2 * i] = side.own_frequency(i);
        }
    }
    weights
}

fn guard_of(dynamics: &SystemDynamics, location: &SystemLocation, (t, y): (f64, &[f64]), guard: usize) -> f64 {
    let mut values = vec![0.0; dynamics.guards(location).len()];
    dynamics.guard_values(location, t, y, &mut values);
    values[guard]
}

fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// State after the transitions, if there are as many as in the run and, with `same_events`, of the same kinds. Without
/// `same_events` a copy may decide otherwise about the contact at rest, as near a border between two event sequences;
/// the surfaces have the same state then.
fn state_after(transitions: &[Transition], kinds: &[Option<EventKind>], same_events: bool) -> Option<Vec<f64>> {
    let alike = |(one, kind): (&Transition, &Option<EventKind>)| one.kind == *kind;
    let same = transitions.len() == kinds.len() && (!same_events || transitions.iter().zip(kinds).all(alike));
    transitions.last().filter(|_| same).map(|last| last.state.clone())
}

pub(crate) struct CarryingRules {
    own: SystemRules,
    carried: Arc<Mutex<Carried>>,
}

impl CarryingRules {
    pub(crate) fn new(own: SystemRules, carried: Arc<Mutex<Carried>>) -> Self {
        CarryingRules { own, carried }
    }
}

struct EventInstant<'a> {
    location: &'a SystemLocation,
    t: f64,
    y: &'a [f64],
    transitions: &'a [Transition],
}

impl Carried {
    /// Takes the derivatives over an event. `fired`: the guards that set it off; `None` if its time is a parameter.
    /// `shift` gives d(time) of a column from the flow before the event; `of_copy` is the map of a copy.
    fn pass(
        &mut self,
        event: &EventInstant<'_>,
        fired: Option<Fired>,
        mut shift: impl FnMut(&Self, &mut VariationColumn, &DVector<f64>) -> f64,
        mut of_copy: impl FnMut(&mut MovedCopy) -> Vec<Transition>,
    ) {
        let Some(last) = event.transitions.last() else { return };
        let kinds: Vec<Option<EventKind>> = event.transitions.iter().map(|one| one.kind).collect();
        let recorded = kinds.iter().flatten().count();
        let (t, y) = (event.t, event.y);
        let before = self.rates(&self.dynamics, event.location, t, y);
        let after = self.rates(&self.dynamics, &last.location, t, &last.state);
        let flow = DVector::from_column_slice(&before[..self.moving]);
        if recorded > 0 {
            let since = self.deviations(self.since());
            self.rounding.state(&since, y);
            self.restart(self.since());
            match fired {
                None => self.rounding.set_clock(&flow),
                Some(_) => self.rounding.read_clock(t),
            }
        }
        let mut columns = std::mem::take(&mut self.columns);
        // The first of several events at one instant defines the shift of all.
        let inherited = self.last.take().filter(|last| last.0 == t);
        let shifts: Vec<f64> = match inherited {
            Some((_, shifts)) => shifts,
            None => columns.iter_mut().map(|column| shift(self, column, &flow)).collect(),
        };
        let replaced = self.replaced(event.location, t, y, event.transitions);
        if let Some(replaced) = &replaced {
            // The replacing state lies along the flow.
            let rate = replaced.kept.dot(&flow);
            for column in columns[self.since()].iter_mut().filter(|_| rate != 0.0) {
                column.slope = &flow * (replaced.kept.dot(&column.slope) / rate);
            }
        }
        for (column, &dt) in columns.iter_mut().zip(&shifts) {
            column.slope.axpy(dt, &flow, 1.0);
            let fired = fired.map(|fired| (fired, dt));
            let change = column.slope.as_mut_slice();
            self.carry_over(event.location, t, fired, event.transitions, change);
            for (slope, rate) in column.slope.iter_mut().zip(&after) {
                *slope -= rate * dt;
            }
            for copy in &mut column.copies {
                let state = state_after(&of_copy(copy), &kinds, self.same_events);
                for (k, slope) in column.slope.iter_mut().enumerate() {
                    *slope += copy.weight * state.as_ref().map_or(f64::NAN, |state| state[k]);
                }
            }
        }
        self.columns = columns;
        if recorded == 0 {
            return;
        }
        let can_start = kinds.iter().flatten().any(|kind| *kind == EventKind::Destabilised);
        let has_grown = self.growing && self.growth() > 0.0;
        let removed = self.growing && replaced.is_some();
        if can_start && !has_grown || removed {
            self.growing = true;
            self.restart(self.grown());
        }
        let of_numbers = self.columns[..self.numbers].iter().enumerate();
        let rounded = of_numbers.filter_map(|(k, column)| {
            Some(Rounded {
                value: column.rounded?,
                everywhere: shifts[k],
                apart: shifts[self.numbers + k],
                in_equations: column.in_equations,
            })
        });
        let since = DVector::from_column_slice(&shifts[self.since()]);
        let rounding = self.rounding.of_event(&since, rounded);
        let shares = shifts[self.grown()].iter().zip(&self.weights);
        let worst = shares
            .map(|(shift, weight)| (shift / weight).powi(2))
            .sum::<f64>()
            .sqrt();
        let growth = self.growing.then(|| self.growth());
        for _ in 0..recorded {
            self.passages.push(Passage {
                times: shifts[..self.numbers].to_vec(),
                growth,
                per_deviation: self.growing.then_some(worst),
                rounding,
            });
        }
        self.last = Some((t, shifts));
        let since = self.deviations(self.since());
        self.rounding.state(&since, &last.state);
        if let Some(replaced) = replaced {
            self.rounding.add(&replaced.error);
        }
        self.restart(self.since());
    }
}

impl Rules for CarryingRules {
    fn next_time_event(&mut self, location: &SystemLocation, t: f64) -> Option<f64> {
        let mut carried = locked(&self.carried);
        for column in &mut carried.columns {
            for moved in &mut column.copies {
                moved.next = moved.rules.next_time_event(location, t.max(moved.last));
            }
        }
        self.own.next_time_event(location, t)
    }

    fn at_time_event(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> Vec<Transition> {
        let transitions = self.own.at_time_event(location, t, y);
        if transitions.is_empty() {
            // The search for the next instant continues, also in the copies.
            let mut carried = locked(&self.carried);
            let copies = carried.columns.iter_mut().flat_map(|column| &mut column.copies);
            for moved in copies.filter(|moved| moved.next.is_some_and(|next| next <= t)) {
                moved.rules.at_time_event(location, t, y);
            }
            return transitions;
        }
        if transitions.iter().all(|one| one.kind.is_none() && one.state == y) {
            return transitions;
        }
        let event = EventInstant {
            location,
            t,
            y,
            transitions: &transitions,
        };
        let mut carried = locked(&self.carried);
        carried.pass(
            &event,
            None,
            |_, column, _| column.shift_of_time(t),
            |moved| match moved.next {
                Some(next) => {
                    moved.last = next;
                    moved.rules.at_time_event(location, next, y)
                }
                None => Vec::new(),
            },
        );
        transitions
    }

    fn at_guards(&mut self, location: &SystemLocation, t: f64, y: &[f64], fired: Fired) -> Vec<Transition> {
        let transitions = self.own.at_guards(location, t, y, fired);
        let event = EventInstant {
            location,
            t,
            y,
            transitions: &transitions,
        };
        let guard = fired.first();
        let mut carried = locked(&self.carried);
        carried.pass(
            &event,
            Some(fired),
            |carried, column, flow| {
                let slope = |change| carried.guard_slope(location, (t, y), change, guard);
                let by_number = column.sum(|moved| Some(guard_of(&moved.dynamics, location, (t, y), guard)));
                let change = slope((0.0, &column.slope)) + by_number;
                // A constant guard fires at the start of its segment. The time of a graze has no derivative.
                if change == 0.0 {
                    0.0
                } else {
                    -change / slope((1.0, flow))
                }
            },
            |moved| moved.rules.at_guards(location, t, y, fired),
        );
        transitions
    }

    fn outside(&self, location: &SystemLocation, t: f64, y: &[f64]) -> Option<String> {
        self.own.outside(location, t, y)
    }

    fn solver(&self, location: &SystemLocation, t: f64, y: &[f64]) -> ChosenSolver {
        self.own.solver(location, t, y)
    }

    fn engine(&self, kind: &SolverKind) -> Option<Box<dyn Engine>> {
        let own = self.own.engine(kind)?;
        Some(Box::new(CarryingEngine {
            own,
            carried: self.carried.clone(),
            is_series: *kind == SolverKind::Series,
            place: None,
        }))
    }
}

struct CarryingEngine {
    own: Box<dyn Engine>,
    carried: Arc<Mutex<Carried>>,
    is_series: bool,
    place: Option<(SystemLocation, f64, f64)>,
}

impl Engine for CarryingEngine {
    fn begin(&mut self, segment: &EngineSegment<'_>, chosen: &ChosenSolver) -> Result<(), Error> {
        self.place = Some((segment.location, segment.start, segment.stop));
        let mut carried = locked(&self.carried);
        carried.measure(&segment.location, segment.start, segment.state, true);
        self.own.begin(segment, chosen)
    }

    fn advance(&mut self) -> Result<Advance, Error> {
        let from = self.own.time();
        let advance = self.own.advance()?;
        let to = self.own.time();
        if let Some((location, origin, stop)) = self.place
            && to > from
        {
            let mut carried = locked(&self.carried);
            if advance == Advance::Stop && stop >= carried.end {
                return Ok(advance);
            }
            let kind = match self.own.is_slow() {
                true => VariationSteps::Slow,
                false if self.is_series => VariationSteps::Series,
                false => VariationSteps::Resolving,
            };
            let mut at = |tau: f64, out: &mut [f64]| self.own.state_at(tau, out);
            carried.carry(&location, origin, (from, to, kind), &mut at)?;
        }
        Ok(advance)
    }

    fn time(&self) -> f64 {
        self.own.time()
    }

    fn state(&self) -> &[f64] {
        self.own.state()
    }

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), Error> {
        self.own.state_at(tau, out)
    }

    fn is_slow(&self) -> bool {
        self.own.is_slow()
    }

    fn grazed(&mut self) -> Option<(f64, usize)> {
        self.own.grazed()
    }

    fn counters(&mut self) -> Result<Counters, Error> {
        self.own.counters()
    }
}
