//! Derivatives of a hybrid run by numbers of its case: of the state and of the times of its events.
//!
//! With F the right-hand side of a segment, the derivative d of the state by a number p obeys d' = F_y d + F_p. It is integrated beside
//! the run by Radau IIA, which is linear here. An event with the guard h, or at a time T(p), and the map M moves by dt, and
//!
//! ```text
//! dt = -(h_y d + h_p) / (h_t + h_y F-)   or   T',
//! d+ = M_y (d + F- dt) + M_t dt + M_p - F+ dt
//! ```
//!
//! (saltation). F_p, h_p, M_p and T' are differences between copies of the whole system with the number moved, on the path of the
//! run: of equations, signals and transitions nothing is differentiated by hand. h and M are linear in the state.
//!
//! Deviations of the state itself are columns of the same kind: unit deviations since the last event, by which rounding is carried
//! ([`super::rounding`]), and since growth counts: from a loss of stability on, unless what has grown since an earlier one is still
//! there, and anew where another state takes the place of that before an event.

use super::rounding::{Rounded, Rounding};
use super::{
    Advance, ChosenSolver, Dynamics, Engine, EngineError, Fired, Rules, Segment, SolverKind, StateAt, Transition,
};
use crate::numerics::eigenvalues::eigenvalues;
use crate::numerics::radau_tableau::RadauTableau;
use crate::sundials::Counters;
use nalgebra::{DMatrix, DVector, Dyn, LU};
use std::ops::{AddAssign, Range};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Stages of Radau IIA: order 13.
const STAGES: usize = 7;

/// A step is no longer than this times the inverse of the fastest eigenvalue: its local error is then below 1e-12.
const REACH: f64 = 1.4;

/// A step of a series over which the fastest mode would turn by more than this strides over it: the mode is quiet, and is damped in
/// the derivatives as well.
const STRIDE: f64 = 100.0;
const STEPS_OF_STRIDE: f64 = 4.0;

/// Over a step of the slow motion alone each stride turns the fastest mode by so much at least, so that it damps what lies beside
/// the slow manifold in the derivatives even where that manifold is unstable; there are no more of them than slow motion needs. A
/// shorter step is one stride: finer ones would follow the growth.
const TURN_OF_STRIDE: f64 = 30.0;
const MOST_STRIDES: f64 = 8.0;

/// A matrix that is larger by this factor has other eigenvalues.
const LARGER: f64 = 1.1;

/// No step of the engine is taken in fewer than this.
const LEAST_STEPS: f64 = 1.0;

/// Of the inverse of the fastest eigenvalue, how far an event is moved for the difference of its map.
const AHEAD: f64 = 1e-5;

/// Of the inverse of the fastest eigenvalue, the step of the difference of a guard in time. The difference is of fourth order: its
/// truncation is below 1e-9 for signals up to 30 times as fast, and its rounding is that of a guard over this step.
const GUARD_STEP: f64 = 3e-4;

/// How far a state is moved for the difference of a map, as a share of its size.
const NEAR: f64 = 1e-4;

/// By how much the slopes of a time may differ on two sides of a number, as a share, and by how many roundings of the time.
const BENT: f64 = 0.2;
const TIME_ROUNDING: f64 = 32.0;

/// A copy of the system in which a number is moved. With weights that add up to zero, the sum of weight times value over the
/// copies is the derivative of a value.
pub(crate) struct MovedCopy<D, R> {
    /// Its equations.
    pub dynamics: Arc<D>,
    /// Its rules, which come to the same events in the same order, and to no instants that change nothing.
    pub rules: R,
    /// Per unit of the number.
    pub weight: f64,
    /// The sum of these weights times value over the copies is zero of whatever has one slope.
    pub bend: f64,
}

struct Moved<D, R> {
    of: MovedCopy<D, R>,
    /// Its next time event.
    next: Option<f64>,
    /// Its last one, s, which may be later than that of the run.
    last: f64,
}

impl<D, R> Moved<D, R> {
    fn new(of: MovedCopy<D, R>) -> Self {
        Moved {
            of,
            next: None,
            last: f64::NEG_INFINITY,
        }
    }
}

/// A number that is moved: one of the case, or with no copies one that the initial state alone depends on.
pub(crate) struct MovedNumber<D, R> {
    pub copies: Vec<MovedCopy<D, R>>,
    /// d(initial state)/d(number), of the components that the motion depends on.
    pub start: DVector<f64>,
    /// Whether the equations of the copies are others than those of the run.
    pub in_equations: bool,
    /// Its value, where its rounding counts.
    pub rounded: Option<f64>,
}

/// What the derivatives of a model are measured by.
pub(crate) trait Measures<L, K>: Send {
    /// What each component is multiplied by to compare with the others.
    fn weights(&self) -> &[f64];

    /// Whether the equations of a location have constants that are derived apart from those of other locations.
    fn derives_apart(&self, location: &L) -> bool;

    /// Whether the growth of deviations counts from such an event on, if none is left of an earlier one.
    fn starts_growth(&self, kind: &K) -> bool;

    /// Where the rules have put another state in the place of that before an event: how far that can be off, and of a deviation
    /// what it keeps.
    fn replaced(&self, location: &L, t: f64, y: &[f64], transitions: &[Transition<K, L>]) -> Option<Replaced>;
}

/// See [`Measures::replaced`].
pub(crate) struct Replaced {
    /// Of each component.
    pub error: Vec<f64>,
    /// The gradient of the one quantity that is kept.
    pub kept: DVector<f64>,
}

/// What small changes do to an event.
pub(crate) struct Passage {
    /// d(time)/d(number), s per unit.
    pub times: Vec<f64>,
    /// ln of the largest factor between a deviation at the start of growth and just behind the event; `None` before that.
    pub growth: Option<f64>,
    /// How far a deviation of 1 at the start of growth, in the worst direction, would move the event, s.
    pub per_deviation: Option<f64>,
    /// How far rounding to double precision moves the event, s.
    pub rounding: f64,
}

/// A number or a component of the state, with the derivative of the state by it.
struct Column<D, R> {
    copies: Vec<Moved<D, R>>,
    /// Of a number.
    in_equations: bool,
    rounded: Option<f64>,
    slope: DVector<f64>,
}

impl<D, R> Column<D, R> {
    /// The sum of weight times value over the copies; NaN where one has none.
    fn sum(&mut self, mut value: impl FnMut(&mut Moved<D, R>) -> Option<f64>) -> f64 {
        let of = |moved: &mut Moved<D, R>| moved.of.weight * value(moved).unwrap_or(f64::NAN);
        self.copies.iter_mut().map(of).sum()
    }

    /// d(time) of the time event at `t` (s); NaN where the slope is another on the two sides, as where the event of another number
    /// comes first on one of them.
    fn shift_of_time(&mut self, t: f64) -> f64 {
        let (mut bent, mut most) = (0.0, 0.0f64);
        for moved in &self.copies {
            let change = moved.next.map_or(f64::NAN, |next| next - t);
            bent += moved.of.bend * change;
            most = most.max(change.abs());
        }
        if bent.abs() <= BENT * most + TIME_ROUNDING * f64::EPSILON * t {
            self.sum(|moved| moved.next)
        } else {
            f64::NAN
        }
    }
}

/// What is known of the fast modes in a step of the run.
#[derive(Clone, Copy)]
enum Steps {
    /// Nothing: they may be live.
    Resolving,
    /// Those are quiet over which the step is long.
    Series,
    /// All are quiet.
    Slow,
}

/// The derivatives, and what carries them.
pub(crate) struct Carried<D: Dynamics, R: Rules<D>> {
    dynamics: Arc<D>,
    measures: Box<dyn Measures<D::Location, R::Kind>>,
    /// Components of the state that the motion depends on: the first.
    moving: usize,
    /// Of each number; of each number what it does where constants are derived apart; unit deviations since the last event; and
    /// since growth counts.
    columns: Vec<Column<D, R>>,
    numbers: usize,
    /// The copies come to the events of the run, or there is no derivative.
    same_events: bool,
    growing: bool,
    /// The last event, s, and how far it moves by each column.
    last: Option<(f64, Vec<f64>)>,
    rounding: Rounding,
    /// Of the last event that can follow, s: derivatives of events need not be carried beyond.
    end: f64,
    /// Of every event so far.
    passages: Vec<Passage>,
    factors: Option<Factors>,
    /// Magnitude of the fastest eigenvalue where the run stands, 1/s, and the largest magnitude in the matrix that it is of.
    fastest: f64,
    of_size: f64,
    nodes: RadauTableau<STAGES>,
}

/// The factored matrix of a linear step.
struct Factors {
    /// s.
    step: f64,
    jacobian: DMatrix<f64>,
    lu: LU<f64, Dyn, Dyn>,
}

/// The largest magnitude of an eigenvalue.
fn fastest(jacobian: &DMatrix<f64>) -> f64 {
    eigenvalues(jacobian)
        .iter()
        .map(|value| value.norm())
        .fold(0.0, f64::max)
}

impl<D: Dynamics, R: Rules<D>> Carried<D, R> {
    /// Of a run of `dynamics` by the numbers that are moved in each of `numbers`; the motion depends on the first `moving`
    /// components of its state. Where the last step ends at `end` (s) or later, it is left out: no event follows. With an infinite
    /// `end`, derivatives of the last state are known, too.
    pub(crate) fn new(
        dynamics: Arc<D>,
        measures: Box<dyn Measures<D::Location, R::Kind>>,
        moving: usize,
        end: f64,
        numbers: Vec<MovedNumber<D, R>>,
    ) -> Self {
        let count = numbers.len();
        let column = |number: MovedNumber<D, R>| Column {
            copies: number.copies.into_iter().map(Moved::new).collect(),
            in_equations: number.in_equations,
            rounded: number.rounded,
            slope: number.start,
        };
        let mut columns: Vec<_> = numbers.into_iter().map(column).collect();
        columns.extend((0..count + 2 * moving).map(|_| Column {
            copies: Vec::new(),
            in_equations: false,
            rounded: None,
            slope: DVector::zeros(moving),
        }));
        let mut carried = Carried {
            columns,
            numbers: count,
            same_events: true,
            growing: false,
            last: None,
            rounding: Rounding::new(moving),
            dynamics,
            measures,
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

    /// The same where copies may decide otherwise about what the contact does at rest.
    pub(crate) fn beside_borders(self) -> Self {
        Carried {
            same_events: false,
            ..self
        }
    }

    /// What small changes do to every event, in the order of the run.
    pub(crate) fn into_passages(self) -> Vec<Passage> {
        self.passages
    }

    /// d(state)/d(number) where the run stands: a column for each number.
    pub(crate) fn slopes(&self) -> DMatrix<f64> {
        self.deviations(0..self.numbers)
    }

    /// The columns of unit deviations since the last event.
    fn since(&self) -> Range<usize> {
        2 * self.numbers..2 * self.numbers + self.moving
    }

    /// The columns of unit deviations since growth counts.
    fn grown(&self) -> Range<usize> {
        let first = 2 * self.numbers + self.moving;
        first..first + self.moving
    }

    /// Unit deviations from here on.
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

    /// ln of the largest factor between a deviation at the start of growth and now.
    fn growth(&self) -> f64 {
        let (grown, weights) = (self.deviations(self.grown()), self.measures.weights());
        let scaled = DMatrix::from_fn(self.moving, self.moving, |i, j| grown[(i, j)] * weights[i] / weights[j]);
        match scaled.iter().all(|x| x.is_finite()) {
            true => scaled.singular_values().max().ln(),
            false => f64::NAN,
        }
    }

    fn rates(&self, dynamics: &D, location: &D::Location, t: f64, y: &[f64]) -> Vec<f64> {
        let mut rates = vec![0.0; y.len()];
        dynamics.rhs(location, t, y, &mut rates);
        rates
    }

    fn jacobian(&self, location: &D::Location, t: f64, y: &[f64]) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(y.len(), y.len());
        self.dynamics.jacobian(location, t, y, jacobian.as_view_mut());
        jacobian.view((0, 0), (self.moving, self.moving)).into_owned()
    }

    /// Takes note of how fast the equations are at a state, anew where their matrix is larger than it was.
    fn measure(&mut self, location: &D::Location, t: f64, y: &[f64], anew: bool) {
        let jacobian = self.jacobian(location, t, y);
        let size = jacobian.amax();
        if anew || size > LARGER * self.of_size {
            let fastest = fastest(&jacobian);
            self.fastest = if anew { fastest } else { self.fastest.max(fastest) };
            self.of_size = size;
        }
    }

    /// Carries the derivatives over a step of the run from `from` to `to` (s on the segment's clock, which starts at `origin`).
    fn carry(
        &mut self,
        location: &D::Location,
        origin: f64,
        (from, to, kind): (f64, f64, Steps),
        at: &mut StateAt<'_>,
    ) -> Result<(), EngineError> {
        let (n, dimension) = (self.moving, self.dynamics.dimension());
        let mut y = vec![0.0; dimension];
        at(to, &mut y)?;
        self.measure(location, origin + to, &y, false);
        let turned = (to - from) * self.fastest;
        let steps = match kind {
            Steps::Slow => (turned / TURN_OF_STRIDE).floor().clamp(1.0, MOST_STRIDES),
            Steps::Series if turned > STRIDE => STEPS_OF_STRIDE,
            _ => (turned / REACH).ceil().max(LEAST_STEPS),
        };
        let h = (to - from) / steps;
        let forcing: Vec<usize> = (0..self.numbers).filter(|&k| self.columns[k].in_equations).collect();
        let apart = self.measures.derives_apart(location);
        let slopes: Vec<DVector<f64>> = self.columns.iter().map(|column| column.slope.clone()).collect();
        let mut slopes = DMatrix::from_columns(&slopes);
        let mut rates = vec![0.0; dimension];
        for step in 0..steps as usize {
            let start = from + step as f64 * h;
            let mut jacobians = Vec::with_capacity(STAGES);
            // What the step does to unit deviations, and what it adds by each number.
            let mut stages = DMatrix::zeros(STAGES * n, n + forcing.len());
            for i in 0..STAGES {
                let tau = start + self.nodes.c[i] * h;
                at(tau, &mut y)?;
                let jacobian = self.jacobian(location, origin + tau, &y);
                stages.view_mut((i * n, 0), (n, n)).copy_from(&jacobian);
                jacobians.push(jacobian);
                for (column, &number) in forcing.iter().enumerate() {
                    for moved in &self.columns[number].copies {
                        moved.of.dynamics.rhs(location, origin + tau, &y, &mut rates);
                        for k in 0..n {
                            stages[(i * n + k, n + column)] += moved.of.weight * rates[k];
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

    /// The factors of the matrix of a step, kept from the last where the equations are linear.
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
            Factors {
                step: h,
                jacobian: first.clone(),
                lu: matrix.lu(),
            }
        });
        &self.factors.insert(factors).lu
    }

    /// The inverse of the fastest eigenvalue, or 1 s of a motion without one, such as that of a free body, s.
    fn fastest_time(&self) -> f64 {
        if self.fastest > 0.0 { 1.0 / self.fastest } else { 1.0 }
    }

    /// The size of each component where the run stands: what it is, and what it comes to within the fastest time.
    fn sizes(&self, y: &[f64], rates: &[f64]) -> Vec<f64> {
        let unit = self.fastest_time();
        let pairs = y.iter().zip(rates).take(self.moving);
        pairs.map(|(y, rate)| y.abs().max(rate.abs() * unit)).collect()
    }

    /// d(guard)/d(time) along the motion: by the state, which moves by `rates`, and by the time itself.
    fn guard_rate(&self, location: &D::Location, t: f64, y: &[f64], rates: &[f64], guard: usize) -> f64 {
        let at = |t: f64, y: &[f64]| self.guard(&self.dynamics, location, t, y, guard);
        let direction = DVector::from_column_slice(&rates[..self.moving]);
        let e = NEAR * extent(&direction, &self.sizes(y, rates));
        let by_state = (at(t, &along(y, &direction, e)) - at(t, &along(y, &direction, -e))) / (2.0 * e);
        let h = GUARD_STEP * self.fastest_time();
        let over = |h: f64| at(t + h, y) - at(t - h, y);
        by_state + (8.0 * over(h) - over(2.0 * h)) / (12.0 * h)
    }

    fn guard(&self, dynamics: &D, location: &D::Location, t: f64, y: &[f64], guard: usize) -> f64 {
        let mut values = vec![0.0; dynamics.guards(location).len()];
        dynamics.guard_values(location, t, y, &mut values);
        values[guard]
    }
}

fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// y + e d, where d is given for the first components.
fn along(y: &[f64], d: &DVector<f64>, e: f64) -> Vec<f64> {
    let mut moved = y.to_vec();
    for (y, d) in moved.iter_mut().zip(d.iter()) {
        *y += e * d;
    }
    moved
}

/// By how much a direction may be followed for the state to change by its own size.
fn extent(d: &DVector<f64>, sizes: &[f64]) -> f64 {
    let share = |(d, size): (&f64, &f64)| if *size > 0.0 { d.abs() / size } else { 0.0 };
    let most = d.iter().zip(sizes).map(share).fold(0.0, f64::max);
    if most > 0.0 { 1.0 / most } else { 1.0 }
}

/// The state that transitions lead to, if they are as many as these, and of the same kinds where the copies are to come to the events of
/// the run. Where that is not asked, a copy may decide otherwise about what the contact does at rest, as it does beside a border of two
/// sequences of events: it makes the same state of its surfaces.
fn state_after<K: PartialEq, L>(
    transitions: &[Transition<K, L>],
    kinds: &[Option<K>],
    same_events: bool,
) -> Option<Vec<f64>> {
    let alike = |(one, kind): (&Transition<K, L>, &Option<K>)| one.kind == *kind;
    let same = transitions.len() == kinds.len() && (!same_events || transitions.iter().zip(kinds).all(alike));
    transitions.last().filter(|_| same).map(|last| last.state.clone())
}

/// The rules of a run, which carry the derivatives over each event.
pub(crate) struct CarryingRules<D: Dynamics, R: Rules<D>> {
    own: R,
    /// The maps of the events, without what is there for rounding alone.
    maps: R,
    carried: Arc<Mutex<Carried<D, R>>>,
}

impl<D: Dynamics, R: Rules<D>> CarryingRules<D, R> {
    /// `own` decides; `maps` are the same rules as those of the copies are; `carried` is for whoever wants the derivatives
    /// afterwards.
    pub(crate) fn new(own: R, maps: R, carried: Arc<Mutex<Carried<D, R>>>) -> Self {
        CarryingRules { own, maps, carried }
    }
}

/// What an event is made of.
struct Instant<'a, L, K> {
    location: &'a L,
    t: f64,
    y: &'a [f64],
    transitions: &'a [Transition<K, L>],
}

impl<D, R> Carried<D, R>
where
    D: Dynamics,
    R: Rules<D>,
    R::Kind: PartialEq,
{
    /// Takes the derivatives over an event, whose time is one of the case where it `is_set`. `shift` gives d(time) of a column with
    /// the slope before; `image` gives the state that the run's own map makes of a state at a time, and `of_copy` that of a copy's.
    fn pass(
        &mut self,
        event: &Instant<'_, D::Location, R::Kind>,
        is_set: bool,
        mut shift: impl FnMut(&Self, &mut Column<D, R>, &[f64]) -> f64,
        image: impl Fn(f64, &[f64]) -> Option<Vec<f64>>,
        mut of_copy: impl FnMut(&mut Moved<D, R>) -> Vec<Transition<R::Kind, D::Location>>,
    ) {
        let Some(last) = event.transitions.last() else { return };
        let kinds: Vec<Option<R::Kind>> = event.transitions.iter().map(|one| one.kind).collect();
        let recorded = kinds.iter().flatten().count();
        let (t, y) = (event.t, event.y);
        let before = self.rates(&self.dynamics, event.location, t, y);
        let after = self.rates(&self.dynamics, &last.location, t, &last.state);
        let sizes = self.sizes(y, &before);
        let flow = DVector::from_column_slice(&before[..self.moving]);
        if recorded > 0 {
            let since = self.deviations(self.since());
            self.rounding.state(&since, y);
            self.restart(self.since());
            if is_set {
                self.rounding.set_clock(&flow);
            } else {
                self.rounding.read_clock(t);
            }
        }
        let mut columns = std::mem::take(&mut self.columns);
        // Of events at one instant the first says how far all of them move.
        let inherited = self.last.take().filter(|last| last.0 == t);
        let shifts: Vec<f64> = match inherited {
            Some((_, shifts)) => shifts,
            None => columns.iter_mut().map(|column| shift(self, column, &before)).collect(),
        };
        let replaced = self.measures.replaced(event.location, t, y, event.transitions);
        if let Some(replaced) = &replaced {
            // The state that took the place of this one goes along the flow.
            let rate = replaced.kept.dot(&flow);
            for column in columns[self.since()].iter_mut().filter(|_| rate != 0.0) {
                column.slope = &flow * (replaced.kept.dot(&column.slope) / rate);
            }
        }
        for (column, &dt) in columns.iter_mut().zip(&shifts) {
            let mut moved = column.slope.clone();
            for (moved, rate) in moved.iter_mut().zip(&before) {
                *moved += rate * dt;
            }
            // So near that what is decided there is decided alike.
            let mut e = NEAR * extent(&moved, &sizes);
            if dt != 0.0 {
                e = e.min(AHEAD * self.fastest_time() / dt.abs());
            }
            // Of the map the identity is left out, so that what it keeps is kept without rounding.
            let change = |e: f64| {
                let from = along(y, &moved, e);
                let to = image(t + e * dt, &from)?;
                Some(to.iter().zip(from).map(|(to, from)| to - from).collect::<Vec<_>>())
            };
            let own = match (change(e), change(-e)) {
                (Some(forth), Some(back)) => DVector::from_fn(self.moving, |k, _| {
                    moved[k] + (forth[k] - back[k]) / (2.0 * e) - after[k] * dt
                }),
                _ => DVector::from_element(self.moving, f64::NAN),
            };
            column.slope = own;
            for copy in &mut column.copies {
                let state = state_after(&of_copy(copy), &kinds, self.same_events);
                for (k, slope) in column.slope.iter_mut().enumerate() {
                    *slope += copy.of.weight * state.as_ref().map_or(f64::NAN, |state| state[k]);
                }
            }
        }
        self.columns = columns;
        if recorded == 0 {
            return;
        }
        let can_start = kinds.iter().flatten().any(|kind| self.measures.starts_growth(kind));
        let has_grown = self.growing && self.growth() > 0.0;
        // Of a deviation from before, a state in the place of another has nothing left that grows.
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
        let shares = shifts[self.grown()].iter().zip(self.measures.weights());
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

impl<D, R> Rules<D> for CarryingRules<D, R>
where
    D: Dynamics,
    R: Rules<D> + Clone + Send + 'static,
    R::Kind: PartialEq,
{
    type Kind = R::Kind;

    fn next_time_event(&mut self, location: &D::Location, t: f64) -> Option<f64> {
        let mut carried = locked(&self.carried);
        for column in &mut carried.columns {
            for moved in &mut column.copies {
                moved.next = moved.of.rules.next_time_event(location, t.max(moved.last));
            }
        }
        self.maps.next_time_event(location, t);
        self.own.next_time_event(location, t)
    }

    fn at_time_event(&mut self, location: &D::Location, t: f64, y: &[f64]) -> Vec<Transition<R::Kind, D::Location>> {
        let transitions = self.own.at_time_event(location, t, y);
        if transitions.is_empty() {
            // A search for the next instant goes on, and so do those of the copies.
            self.maps.at_time_event(location, t, y);
            let mut carried = locked(&self.carried);
            let copies = carried.columns.iter_mut().flat_map(|column| &mut column.copies);
            for moved in copies.filter(|moved| moved.next.is_some_and(|next| next <= t)) {
                moved.of.rules.at_time_event(location, t, y);
            }
            return transitions;
        }
        if transitions.iter().all(|one| one.kind.is_none() && one.state == y) {
            // Another solver, or other steps, which the copies do not ask for.
            return transitions;
        }
        let kinds: Vec<_> = transitions.iter().map(|one| one.kind).collect();
        let same_events = locked(&self.carried).same_events;
        let maps = self.maps.clone();
        self.maps.at_time_event(location, t, y);
        let event = Instant {
            location,
            t,
            y,
            transitions: &transitions,
        };
        let mut carried = locked(&self.carried);
        carried.pass(
            &event,
            true,
            |_, column, _| column.shift_of_time(t),
            // The time is a number's, and moves with the copies.
            |_, y| state_after(&maps.clone().at_time_event(location, t, y), &kinds, same_events),
            |moved| match moved.next {
                Some(next) => {
                    moved.last = next;
                    moved.of.rules.at_time_event(location, next, y)
                }
                None => Vec::new(),
            },
        );
        transitions
    }

    fn at_guards(
        &mut self,
        location: &D::Location,
        t: f64,
        y: &[f64],
        fired: Fired,
    ) -> Vec<Transition<R::Kind, D::Location>> {
        let transitions = self.own.at_guards(location, t, y, fired);
        let kinds: Vec<_> = transitions.iter().map(|one| one.kind).collect();
        let same_events = locked(&self.carried).same_events;
        let maps = self.maps.clone();
        self.maps.at_guards(location, t, y, fired);
        let event = Instant {
            location,
            t,
            y,
            transitions: &transitions,
        };
        let guard = fired.first();
        let mut carried = locked(&self.carried);
        carried.pass(
            &event,
            false,
            |carried, column, before| {
                let e = NEAR * extent(&column.slope, &carried.sizes(y, before));
                let at = |e: f64| carried.guard(&carried.dynamics, location, t, &along(y, &column.slope, e), guard);
                let by_state = (at(e) - at(-e)) / (2.0 * e);
                let by_number = column.sum(|moved| Some(carried.guard(&moved.of.dynamics, location, t, y, guard)));
                -(by_state + by_number) / carried.guard_rate(location, t, y, before, guard)
            },
            |t, y| state_after(&maps.clone().at_guards(location, t, y, fired), &kinds, same_events),
            |moved| moved.of.rules.at_guards(location, t, y, fired),
        );
        transitions
    }

    fn outside(&self, location: &D::Location, t: f64, y: &[f64]) -> Option<String> {
        self.own.outside(location, t, y)
    }

    fn solver(&self, location: &D::Location, t: f64, y: &[f64]) -> ChosenSolver {
        self.own.solver(location, t, y)
    }

    fn engine(&self, kind: &SolverKind) -> Option<Box<dyn Engine<D::Location>>> {
        let own = self.own.engine(kind)?;
        Some(Box::new(CarryingEngine {
            own,
            carried: self.carried.clone(),
            is_series: *kind == SolverKind::Series,
            place: None,
        }))
    }

    fn counts(&self, kind: &R::Kind) -> bool {
        self.own.counts(kind)
    }

    fn chatter_window(&self) -> f64 {
        self.own.chatter_window()
    }
}

/// An engine of the model, which carries the derivatives over each step.
struct CarryingEngine<D: Dynamics, R: Rules<D>> {
    own: Box<dyn Engine<D::Location>>,
    carried: Arc<Mutex<Carried<D, R>>>,
    /// Whether a step may be longer than the fastest mode, because that is quiet.
    is_series: bool,
    /// Where the segment is, when it began and when it stops, s.
    place: Option<(D::Location, f64, f64)>,
}

impl<D, R> Engine<D::Location> for CarryingEngine<D, R>
where
    D: Dynamics,
    R: Rules<D> + Send,
{
    fn begin(&mut self, segment: &Segment<'_, D::Location>, chosen: &ChosenSolver) -> Result<(), EngineError> {
        self.place = Some((segment.location, segment.start, segment.stop));
        let mut carried = locked(&self.carried);
        carried.measure(&segment.location, segment.start, segment.state, true);
        self.own.begin(segment, chosen)
    }

    fn advance(&mut self) -> Result<Advance, EngineError> {
        let from = self.own.time();
        let advance = self.own.advance()?;
        let to = self.own.time();
        if let Some((location, origin, stop)) = self.place
            && to > from
        {
            let mut carried = locked(&self.carried);
            if advance == Advance::Stop && stop >= carried.end {
                // No event follows.
                return Ok(advance);
            }
            let kind = match self.own.is_slow() {
                true => Steps::Slow,
                false if self.is_series => Steps::Series,
                false => Steps::Resolving,
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

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), EngineError> {
        self.own.state_at(tau, out)
    }

    fn is_slow(&self) -> bool {
        self.own.is_slow()
    }

    fn grazed(&mut self) -> Option<(f64, usize)> {
        self.own.grazed()
    }

    fn counters(&mut self) -> Result<Counters, EngineError> {
        self.own.counters()
    }
}
