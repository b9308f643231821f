//! The run linearised: what a small change of the state or of a parameter does to all that follows.
//!
//! Along a segment a deviation obeys Y' = J Y + df/dp; at a switch it jumps by the saltation of the switch. With a guard
//! g(t, y, p) the time of the switch moves by t* = -(g_y Y + g_p)/(dg/dt along the flow), and the state behind it by
//! Y+ = R (Y- + f- t*) - f+ t*, where R is the derivative of the reset. The columns of Y are five unit deviations at the
//! loss of stability, and one for each parameter from t = 0 on.

use super::equations::{Dynamic, Equations, extended};
pub use super::influence::ParameterName;
use super::influence::{Influence, STEP, influences};
use super::path::{Node, nodes_before, resolving_output};
use super::rounding::{Rounded, Rounding};
use crate::case::Case;
use crate::model::slow_manifold::on_slow_manifold;
use crate::model::state::{DYNAMIC, MEASURES, Measure};
use crate::model::torsion::{TorsionModel, spinning};
use crate::model::{KickTime, Mode};
use crate::record::{Event, EventKind, MemoryRecorder};
use crate::run::Run;
use crate::simulation::{Following, RunFailure, SolverOptions};
use nalgebra::{DMatrix, DVector, SMatrix};
use std::ops::ControlFlow;

/// Columns before those of the parameters: unit deviations from the loss of stability on, and from the last event on.
const HEAD: usize = 2 * DYNAMIC;

/// Halvings of a step in the search for a knot of the friction law: to the rounding of its share.
const HALVINGS: usize = 60;

/// `stop` is asked after so many steps: some ten times a millisecond.
const STEPS_BETWEEN_QUESTIONS: usize = 16;

/// An event, as far as small changes move it.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearisedEvent {
    /// s.
    pub time: f64,
    /// What happened.
    pub kind: EventKind,
    /// d(time)/d(parameter), s per unit, one for each parameter. NaN for one that the event cannot be differentiated by:
    /// the rise time of a step.
    pub by_parameter: Vec<f64>,
    /// By how many e-folds the deviation that grows most has grown from the loss of stability to just behind the event;
    /// `None` before it, or if stability is never lost. Twists count times the natural angular frequency.
    pub growth: Option<f64>,
    /// How far a deviation of 1 rad/s at the loss of stability, in the worst direction, would move the event, s.
    pub per_deviation: Option<f64>,
    /// How far rounding to double precision moves the event, s. No method in double precision can be held to less.
    pub rounding: f64,
}

/// A run with its linearisation.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// The physical parameters of the case.
    pub parameters: Vec<ParameterName>,
    /// All events of the run, in order.
    pub events: Vec<LinearisedEvent>,
}

/// Runs the case with the samples that the linearisation needs, and linearises it. `instability` is the loss of stability
/// from which growth counts (s); `None` if there is none. `stop` is asked now and then: what comes back after it said so
/// ends where the run did.
///
/// # Errors
/// Those of the run.
pub fn linearise(
    case: &Case,
    solver: &SolverOptions,
    instability: Option<f64>,
    stop: &dyn Fn() -> bool,
) -> Result<Linearised, Box<RunFailure>> {
    let run = |output| {
        let mut recorder = MemoryRecorder::default();
        Run::new(case)
            .solver(solver)
            .output(&output)
            .record(&mut recorder)
            .control(|_| match stop() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            })
            .start()?;
        Ok::<_, Box<RunFailure>>(recorder)
    };
    let mut plain = case.output.clone();
    plain.windows.clear();
    plain.follow = Following::default();
    plain.interval = plain.end_time;
    let first = run(plain)?;
    let recorder = run(resolving_output(case, &first))?;
    Ok(of_run(case, &recorder, instability, stop))
}

/// The linearisation of a recorded run, up to where `stop` says so.
fn of_run(case: &Case, recorder: &MemoryRecorder, instability: Option<f64>, stop: &dyn Fn() -> bool) -> Linearised {
    let influences = influences(case);
    let numbers = influences.len();
    let mut propagation = Propagation {
        equations: Equations::new(&case.parameters),
        influences: &influences,
        deviations: DMatrix::zeros(DYNAMIC, HEAD + 2 * numbers),
        frequency: TorsionModel::new(&case.parameters).natural_angular_frequency(),
    };
    for (column, (_, influence)) in influences.iter().enumerate() {
        if matches!(influence, Influence::Speed) {
            let mut start = propagation.deviations.fixed_view_mut::<DYNAMIC, 1>(0, HEAD + column);
            start.copy_from_slice(&spinning(1.0)[..DYNAMIC]);
        }
    }
    let mut rounding = Rounding::default();
    propagation.restart();
    let mut events: Vec<LinearisedEvent> = Vec::with_capacity(recorder.events.len());
    let mut speed_at_instability = None;
    let mut given_up = Dynamic::zeros();
    let mut moved: Option<DVector<f64>> = None;
    let mut start: Option<Node> = None;
    let mut samples = recorder.samples.iter().peekable();
    let mut mode = recorder.samples.first().map_or(Mode::SlipForward, |first| first.mode);
    // By time, which the run that told of it may have found a rounding away.
    let unstable = instability.and_then(|time| {
        let distance = |index: &usize| (recorder.events[*index].time - time).abs();
        (0..recorder.events.len())
            .filter(|index| recorder.events[*index].kind == EventKind::Destabilised)
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    });
    'run: for (index, event) in recorder.events.iter().enumerate() {
        let nodes = nodes_before(event, mode, start.take(), &mut samples);
        for (count, pair) in nodes.windows(2).enumerate() {
            if count % STEPS_BETWEEN_QUESTIONS == 0 && stop() {
                break 'run;
            }
            propagation.step(mode, &pair[0], &pair[1]);
        }
        // Of events at one instant the first says how far all of them move.
        let inherited = moved.take();
        let row = match &inherited {
            Some(row) => row.clone(),
            None => {
                let before = Node::before(event);
                rounding.state(&propagation.since_last(), &before.state);
                propagation.restart();
                if propagation.is_set(event, mode) {
                    rounding.set_clock(&propagation.equations.rates(mode, event.time, &before.state));
                } else {
                    rounding.read_clock(event.time);
                }
                propagation.shift(event, mode)
            }
        };
        if let Some(error) = propagation.manifold_error(event, mode) {
            propagation.keep_slow_part(event, mode);
            given_up += error;
        }
        propagation.pass(event, mode, &row, inherited.is_some());
        if Some(index) == unstable {
            speed_at_instability = Some(event.before.relative_velocity.abs());
            propagation.start_growth();
        }
        let by = |first: usize| row.iter().skip(first).take(numbers).copied();
        let constants = influences.iter().zip(by(HEAD).zip(by(HEAD + numbers))).map(
            |((name, influence), (everywhere, in_stick))| Rounded {
                value: name.value,
                everywhere,
                in_stick,
                in_equations: matches!(influence, Influence::Equations(..)),
            },
        );
        // A contact at a corner, where the force stood at zero, is no zero that is looked for.
        let of_zero = match event.kind {
            EventKind::Separation | EventKind::Contact if inherited.is_none() => {
                propagation.equations.axial.rounding_of_zero(event.time)
            }
            _ => 0.0,
        };
        events.push(LinearisedEvent {
            time: event.time,
            kind: event.kind,
            by_parameter: by(HEAD).collect(),
            growth: speed_at_instability.map(|_| propagation.growth()),
            per_deviation: speed_at_instability.map(|_| propagation.worst_direction(&row)),
            rounding: rounding.of_event(&row.fixed_rows::<DYNAMIC>(DYNAMIC).into_owned(), constants) + of_zero,
        });
        mode = event.mode_after;
        let after = Node::after(event);
        if recorder
            .events
            .get(index + 1)
            .is_some_and(|next| next.time == event.time)
        {
            moved = Some(row);
        } else {
            rounding.state(&propagation.since_last(), &after.state);
            rounding.add(&std::mem::replace(&mut given_up, Dynamic::zeros()));
            propagation.restart();
        }
        start = Some(after);
    }
    Linearised {
        parameters: influences.into_iter().map(|(name, _)| name).collect(),
        events,
    }
}

struct Propagation<'a> {
    equations: Equations,
    influences: &'a [(ParameterName, Influence)],
    /// A column for each unit deviation, then one for each parameter, and one for what it does in sticks.
    deviations: DMatrix<f64>,
    /// sqrt(k_t/J), rad/s: what a twist is multiplied by to compare with a rate.
    frequency: f64,
}

/// Radau IIA with three stages, of order 5: accurate where the fast mode is resolved, and damping where it is not (Hairer,
/// Wanner: Solving Ordinary Differential Equations II, IV.5).
fn radau() -> ([f64; 3], [[f64; 3]; 3]) {
    let r = 6f64.sqrt();
    (
        [(4.0 - r) / 10.0, (4.0 + r) / 10.0, 1.0],
        [
            [
                (88.0 - 7.0 * r) / 360.0,
                (296.0 - 169.0 * r) / 1800.0,
                (-2.0 + 3.0 * r) / 225.0,
            ],
            [
                (296.0 + 169.0 * r) / 1800.0,
                (88.0 + 7.0 * r) / 360.0,
                (-2.0 - 3.0 * r) / 225.0,
            ],
            [(16.0 - r) / 36.0, (16.0 + r) / 36.0, 1.0 / 9.0],
        ],
    )
}

impl Propagation<'_> {
    /// df/dp of each parameter that the equations have.
    fn forcing(&self, (mode, piece): (Mode, usize), t: f64, y: &Dynamic) -> impl Iterator<Item = (usize, Dynamic)> {
        let columns = self.influences.iter().enumerate();
        columns.filter_map(move |(column, (_, influence))| match influence {
            Influence::Equations(above, below, width) => {
                let rates = |of: &Equations| of.rates_on(piece, mode, t, y);
                Some((column, (rates(above) - rates(below)) / *width))
            }
            _ => None,
        })
    }

    /// From one node of the run to the next, and from knot to knot of the friction law between them, where its slope jumps.
    fn step(&mut self, mode: Mode, from: &Node, to: &Node) {
        let piece = |y: &Dynamic| self.equations.piece(y);
        let (mut here, end) = (piece(&from.state), piece(&to.state));
        if mode.sense() == 0 || here == end {
            return self.smooth_step(mode, here, from, to);
        }
        let rates = [from, to].map(|node| self.equations.rates(mode, node.time, &node.state));
        let at = |share: f64| Node {
            time: from.time + share * (to.time - from.time),
            state: from.towards(to, &rates, share),
        };
        let mut parts = Vec::new();
        let mut start = 0.0;
        while here != end {
            // The last share on this side, and the first beyond.
            let (mut low, mut high) = (start, 1.0);
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(low, high);
                if piece(&at(middle).state) == here {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            parts.push((here, at(start), at(low)));
            (start, here) = (high, if high < 1.0 { piece(&at(high).state) } else { end });
        }
        parts.push((here, at(start), at(1.0)));
        for (piece, from, to) in parts {
            self.smooth_step(mode, piece, &from, &to);
        }
    }

    /// From one node to another, between which the equations are smooth. The stages are solved for what the step does to any
    /// deviation, and for what it adds by each parameter, which are fewer columns than there are deviations.
    fn smooth_step(&mut self, mode: Mode, piece: usize, from: &Node, to: &Node) {
        const STAGES: usize = 3 * DYNAMIC;
        let h = to.time - from.time;
        if h <= 0.0 {
            return;
        }
        let (nodes, a) = radau();
        let rates = [from, to].map(|node| self.equations.rates_on(piece, mode, node.time, &node.state));
        let mut matrix = SMatrix::<f64, STAGES, STAGES>::identity();
        let numbers = self.influences.len();
        let mut slopes = DMatrix::zeros(STAGES, DYNAMIC + numbers);
        for i in 0..3 {
            let t = from.time + nodes[i] * h;
            let y = from.towards(to, &rates, nodes[i]);
            let jacobian = self.equations.jacobian(piece, mode, t, &y);
            for (j, weight) in a[i].iter().enumerate() {
                let mut block = matrix.fixed_view_mut::<DYNAMIC, DYNAMIC>(i * DYNAMIC, j * DYNAMIC);
                block -= jacobian * (h * weight);
            }
            slopes
                .fixed_view_mut::<DYNAMIC, DYNAMIC>(i * DYNAMIC, 0)
                .copy_from(&jacobian);
            for (column, slope) in self.forcing((mode, piece), t, &y) {
                slopes
                    .fixed_view_mut::<DYNAMIC, 1>(i * DYNAMIC, DYNAMIC + column)
                    .copy_from(&slope);
            }
        }
        // The matrix is singular at isolated steps only; then the solve reports it, and the deviation is not finite.
        if !matrix.lu().solve_mut(&mut slopes) {
            self.deviations.fill(f64::NAN);
            return;
        }
        let mut change = DMatrix::zeros(DYNAMIC, DYNAMIC + numbers);
        for (j, weight) in a[2].iter().enumerate() {
            change += slopes.rows(j * DYNAMIC, DYNAMIC) * (h * weight);
        }
        self.deviations += change.fixed_columns::<DYNAMIC>(0) * &self.deviations;
        let forced = change.columns(DYNAMIC, numbers);
        let mut everywhere = self.deviations.columns_mut(HEAD, numbers);
        everywhere += &forced;
        if mode == Mode::Stick {
            let mut in_stick = self.deviations.columns_mut(HEAD + numbers, numbers);
            in_stick += &forced;
        }
    }

    /// By how much each column moves the time of an event, s.
    fn shift(&self, event: &Event, before: Mode) -> DVector<f64> {
        let (t, y) = (event.time, Node::before(event).state);
        if matches!(event.kind, EventKind::Separation | EventKind::Contact) {
            return self.shift_of_contact(t);
        }
        let knot = self.equations.stability_knot(event.kind, before, t, &y);
        let guard = |equations: &Equations, t: f64, y: &Dynamic| match knot {
            Some(knot) => equations.above_knot(knot, before, y),
            None => equations.guard(event.kind, before, event.mode_after, t, y),
        };
        if guard(&self.equations, t, &y).is_none() {
            return self.set_by_time(event);
        }
        let value = |equations: &Equations, t: f64, y: &Dynamic| guard(equations, t, y).unwrap_or(f64::NAN);
        let flow = self.equations.rates(before, t, &y);
        // Differences over a millionth of the fast mode's period, and over states of that size.
        let tick = STEP / self.frequency;
        let along = (value(&self.equations, t + tick, &(y + flow * tick))
            - value(&self.equations, t - tick, &(y - flow * tick)))
            / (2.0 * tick);
        let size = y.abs().max().max(f64::MIN_POSITIVE);
        let gradient = Dynamic::from_fn(|row, _| {
            let delta = STEP * (size / self.weight(row));
            let mut unit = Dynamic::zeros();
            unit[row] = delta;
            (value(&self.equations, t, &(y + unit)) - value(&self.equations, t, &(y - unit))) / (2.0 * delta)
        });
        let mut row = (gradient.transpose() * &self.deviations).transpose();
        for (column, (_, influence)) in self.influences.iter().enumerate() {
            match influence {
                Influence::Equations(above, below, width) => {
                    row[HEAD + column] += (value(above, t, &y) - value(below, t, &y)) / *width;
                }
                Influence::Undefined => row[HEAD + column] = f64::NAN,
                _ => {}
            }
        }
        row / -along
    }

    /// The same of a zero of the pressing force, on which the state has no influence. The force is followed on one stretch of
    /// F: close behind a corner, differences across it would be those of two motions.
    fn shift_of_contact(&self, t: f64) -> DVector<f64> {
        let stretch = self.equations.axial.stretch(t);
        let mut row = DVector::zeros(self.deviations.ncols());
        for (column, (_, influence)) in self.influences.iter().enumerate() {
            row[HEAD + column] = match influence {
                Influence::Equations(above, below, width) => {
                    let [above, below] = [above, below].map(|side| side.axial.pressing_on(stretch, t).0);
                    (above - below) / *width
                }
                Influence::Undefined => f64::NAN,
                _ => 0.0,
            };
        }
        row / -self.equations.axial.pressing_on(stretch, t).1
    }

    /// The same of an event whose time is a parameter, or follows from none.
    fn set_by_time(&self, event: &Event) -> DVector<f64> {
        let mut row = DVector::zeros(self.deviations.ncols());
        for (column, (name, influence)) in self.influences.iter().enumerate() {
            let moves = match (event.kind, influence) {
                (EventKind::Kick, Influence::KickTime(time)) => *time == event.time,
                (EventKind::Corner, _) => name.is_corner(event.time),
                _ => false,
            };
            row[HEAD + column] = f64::from(u8::from(moves));
        }
        row
    }

    /// Takes the deviations past an event that they move by `row`. `follows` is an event at the same instant as another.
    fn pass(&mut self, event: &Event, before: Mode, row: &DVector<f64>, follows: bool) {
        let joined = matches!(event.kind, EventKind::Stick | EventKind::Reversal) && !follows;
        let state = |node: Node| node.state;
        let flow_before = self.equations.rates(before, event.time, &state(Node::before(event)));
        let flow_after = self
            .equations
            .rates(event.mode_after, event.time, &state(Node::after(event)));
        self.deviations += flow_before * row.transpose();
        if joined {
            for mut column in self.deviations.column_iter_mut() {
                self.equations.torsion.join(column.as_mut_slice());
            }
        }
        self.deviations -= flow_after * row.transpose();
        if event.kind == EventKind::Kick && event.mode_after != Mode::Stick {
            for (column, (name, influence)) in self.influences.iter().enumerate() {
                if let Influence::KickSize(time) = influence {
                    let given = event.after.relative_velocity - event.before.relative_velocity;
                    // Simultaneous kicks are told apart by their size.
                    let same = (given - name.value).abs() <= 1e-3 * name.value.abs();
                    let due = match time {
                        KickTime::At(time) => *time == event.time,
                        KickTime::Instability => true,
                    };
                    if same && due {
                        let mut column = self.deviations.column_mut(HEAD + column);
                        self.equations.torsion.kick(column.as_mut_slice(), 1.0);
                    }
                }
            }
        }
    }

    /// Unit deviations from here on, of which the growth is told.
    fn start_growth(&mut self) {
        self.deviations.columns_mut(0, DYNAMIC).fill_with_identity();
    }

    /// Unit deviations from here on, up to the next event.
    fn restart(&mut self) {
        self.deviations.columns_mut(DYNAMIC, DYNAMIC).fill_with_identity();
    }

    /// What unit deviations at the last event have become.
    fn since_last(&self) -> SMatrix<f64, DYNAMIC, DYNAMIC> {
        self.deviations.fixed_view::<DYNAMIC, DYNAMIC>(0, DYNAMIC).into_owned()
    }

    /// How far each component can be off in the state that a kick has been added to, if that is the slow manifold; `None` if
    /// it is the state before the event.
    fn manifold_error(&self, event: &Event, before: Mode) -> Option<Dynamic> {
        let (old, new) = (Node::before(event).state, Node::after(event).state);
        // A kick changes rates only, and not the rotor's.
        let kept = (0..DYNAMIC).all(|k| MEASURES[k] == Measure::TwistRate || old[k] == new[k]);
        if event.kind != EventKind::Kick || before.sense() == 0 || kept {
            return None;
        }
        let axial = self.equations.axial.at(event.time);
        let pressing = (axial.pressing_force, axial.pressing_rate);
        let slow = on_slow_manifold(
            &self.equations.torsion,
            f64::from(before.sense()),
            pressing,
            &extended(&old),
        );
        // Rounding is counted elsewhere.
        Some(match slow.settled {
            true => Dynamic::zeros(),
            false => Dynamic::from_column_slice(&slow.error[..DYNAMIC]),
        })
    }

    /// Before a kick that is added to the slow manifold: of a deviation since the last event only the momentum is left, which
    /// says where on the manifold the state is; the manifold goes along the flow.
    fn keep_slow_part(&mut self, event: &Event, before: Mode) {
        let flow = self.equations.rates(before, event.time, &Node::before(event).state);
        let momentum = self.equations.momentum();
        let rate = momentum.dot(&flow);
        if rate != 0.0 {
            let left = flow * (momentum.transpose() * self.since_last()) / rate;
            self.deviations
                .fixed_view_mut::<DYNAMIC, DYNAMIC>(0, DYNAMIC)
                .copy_from(&left);
        }
    }

    /// Whether the time of an event is one of the case.
    fn is_set(&self, event: &Event, before: Mode) -> bool {
        let y = Node::before(event).state;
        let guard = self
            .equations
            .guard(event.kind, before, event.mode_after, event.time, &y);
        guard.is_none()
    }

    /// What a component is multiplied by to compare with a rate.
    fn weight(&self, component: usize) -> f64 {
        self.equations.torsion.rate_weight(component)
    }

    /// ln of the largest factor between a deviation at the start of growth and now.
    fn growth(&self) -> f64 {
        let scaled = DMatrix::from_fn(DYNAMIC, DYNAMIC, |i, j| {
            self.deviations[(i, j)] * self.weight(i) / self.weight(j)
        });
        if scaled.iter().any(|x| !x.is_finite()) {
            return f64::NAN;
        }
        scaled.singular_values().max().ln()
    }

    /// The largest shift of an event by a deviation of 1 rad/s at the loss of stability, s.
    fn worst_direction(&self, row: &DVector<f64>) -> f64 {
        (0..DYNAMIC)
            .map(|j| (row[j] / self.weight(j)).powi(2))
            .sum::<f64>()
            .sqrt()
    }
}
