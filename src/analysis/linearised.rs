//! The run linearised: what a small change of the state or of a parameter does to all that follows.
//!
//! Along a segment a deviation obeys Y' = J Y + df/dp; at a switch it jumps by the saltation of the switch. With a guard
//! g(t, y, p) the time of the switch moves by t* = -(g_y Y + g_p)/(dg/dt along the flow), and the state behind it by
//! Y+ = R (Y- + f- t*) - f+ t*, where R is the derivative of the reset. The columns of Y are five unit deviations at the
//! loss of stability, and one for each parameter from t = 0 on.

use super::path::{Node, nodes_before, resolving_output};
use crate::case::Case;
use crate::model::axial::AxialMotion;
use crate::model::torsion::{TorsionModel, index::*};
use crate::model::{Actuation, KickTime, Mode, Parameters};
use crate::simulation::{Event, EventKind, MemoryRecorder, RunFailure, SolverOptions, simulate};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use std::ops::ControlFlow;

/// Components that matter: u, u', v, v', theta'.
pub(super) const DYNAMIC: usize = 5;

/// The dynamic part of a state.
pub(super) type Dynamic = SVector<f64, DYNAMIC>;

/// Columns before those of the parameters: unit deviations from the loss of stability on, and from where rounding counts.
const HEAD: usize = 2 * DYNAMIC;

/// A run with a kick of less than this many times the noise that it meets keeps that noise; else the kick is added to smooth
/// sliding itself, which is free of it (docs/methods.md, Perturbations).
const KICK_ABOVE_NOISE: f64 = 1e3;

/// Relative step of differences by a parameter. The equations are smooth in all of them: the error is its square.
const STEP: f64 = 1e-6;

/// A parameter of the case.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterName {
    /// Dotted path, such as `torsion.damping`.
    pub path: String,
    /// SI, in the notation of the case file.
    pub unit: &'static str,
    /// In that unit.
    pub value: f64,
}

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
    /// How far a deviation of 1 rad/s, in the worst direction, at the loss of stability or at the kick after it that left no
    /// rounding from before, would move the event, s.
    pub per_deviation: Option<f64>,
}

/// A run with its linearisation.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// The physical parameters of the case.
    pub parameters: Vec<ParameterName>,
    /// All events of the run, in order.
    pub events: Vec<LinearisedEvent>,
    /// |omega_r| at the loss of stability, rad/s.
    pub speed_at_instability: Option<f64>,
}

impl Linearised {
    /// How far rounding to double precision moves event `index`, s: that of omega_r at the loss of stability, or at the kick
    /// that is added to smooth sliding, amplified; that of each number of the case, half a unit in its last place; and that
    /// of the time itself. No method in double precision can be held to less: all share the rounded numbers.
    pub fn rounding(&self, index: usize) -> f64 {
        let event = &self.events[index];
        let rounding = f64::EPSILON / 2.0;
        let amplified = match (event.per_deviation, self.speed_at_instability) {
            (Some(factor), Some(speed)) => factor * rounding * speed,
            _ => 0.0,
        };
        let of_input: f64 = self
            .parameters
            .iter()
            .zip(&event.by_parameter)
            .map(|(parameter, derivative)| (derivative * parameter.value).abs() * rounding)
            .filter(|moved| moved.is_finite())
            .sum();
        amplified + of_input + rounding * event.time
    }
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
        simulate(
            &case.parameters,
            solver,
            &output,
            &mut recorder,
            &mut |_| match stop() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            },
        )?;
        Ok::<_, Box<RunFailure>>(recorder)
    };
    let mut plain = case.output.clone();
    plain.windows.clear();
    plain.interval = plain.end_time;
    let first = run(plain)?;
    let recorder = run(resolving_output(case, &first))?;
    Ok(of_run(case, &recorder, instability))
}

/// The equations at a value of the parameters.
pub(super) struct Equations {
    torsion: TorsionModel,
    axial: AxialMotion,
}

impl Equations {
    pub(super) fn new(parameters: &Parameters) -> Equations {
        Equations {
            torsion: TorsionModel::new(parameters),
            axial: AxialMotion::new(&parameters.axial, &parameters.actuation),
        }
    }

    pub(super) fn rates(&self, mode: Mode, t: f64, y: &Dynamic) -> Dynamic {
        let (full, mut rates) = (extended(y), [0.0; crate::model::torsion::DIMENSION]);
        match mode {
            Mode::Separated => self.torsion.separated_rhs(&full, &mut rates),
            Mode::Stick => self.torsion.stick_rhs(&full, &mut rates),
            Mode::SlipForward | Mode::SlipBackward => {
                let force = self.axial.pressing_force(t);
                self.torsion.slip_rhs(f64::from(mode.sense()), force, &full, &mut rates);
            }
        }
        Dynamic::from_column_slice(&rates[..DYNAMIC])
    }

    pub(super) fn jacobian(&self, mode: Mode, t: f64, y: &Dynamic) -> SMatrix<f64, DYNAMIC, DYNAMIC> {
        let full = extended(y);
        let mut jacobian = DMatrix::zeros(full.len(), full.len());
        let mut view = jacobian.as_view_mut();
        match mode {
            Mode::Separated => self.torsion.separated_jacobian(&full, &mut view),
            Mode::Stick => self.torsion.stick_jacobian(&full, &mut view),
            Mode::SlipForward | Mode::SlipBackward => {
                let force = self.axial.pressing_force(t);
                self.torsion
                    .slip_jacobian(f64::from(mode.sense()), force, &full, &mut view);
            }
        }
        jacobian.fixed_view::<DYNAMIC, DYNAMIC>(0, 0).into_owned()
    }

    /// The guard whose zero an event is, in the mode before it; `None` if the event is set by time.
    fn guard(&self, kind: EventKind, before: Mode, after: Mode, t: f64, y: &Dynamic) -> Option<f64> {
        let full = extended(y);
        let speed = self.torsion.relative_velocity(&full);
        let force = self.axial.pressing_force(t);
        match kind {
            EventKind::Stick | EventKind::Reversal => Some(speed),
            EventKind::Slip => {
                let sense = f64::from(after.sense());
                Some(self.torsion.breakaway_torque(force) - sense * self.torsion.tested_torque(&full))
            }
            EventKind::Separation | EventKind::Contact => Some(force),
            EventKind::Destabilised | EventKind::Restabilised => {
                let sense = f64::from(before.sense());
                Some(self.torsion.stability_margin(sense, speed, force))
            }
            EventKind::Kick | EventKind::Corner => None,
        }
    }
}

fn extended(y: &Dynamic) -> [f64; crate::model::torsion::DIMENSION] {
    let mut full = [0.0; crate::model::torsion::DIMENSION];
    full[..DYNAMIC].copy_from_slice(y.as_slice());
    full
}

/// What a parameter does.
enum Influence {
    /// On the equations: at p + d and p - d, and 2 d.
    Equations(Box<Equations>, Box<Equations>, f64),
    /// omega_0.
    Speed,
    /// The time of a kick, s.
    KickTime(f64),
    /// The size of the kick of that time.
    KickSize(KickTime),
    /// None that can be differentiated.
    Undefined,
}

/// The parameters of the case with what each does.
fn influences(case: &Case) -> Vec<(ParameterName, Influence)> {
    let physical = |path: &str| !path.starts_with("solver.") && !path.starts_with("output.");
    case.number_paths()
        .into_iter()
        .filter(|(path, _)| physical(path))
        .filter_map(|(path, key)| {
            let value = case.number(&path).ok()?;
            let unit = key.dimension().map_or("1", |dimension| dimension.unit());
            let influence = influence(case, &path, value);
            Some((ParameterName { path, unit, value }, influence))
        })
        .collect()
}

fn influence(case: &Case, path: &str, value: f64) -> Influence {
    let kick = path
        .strip_prefix("perturbation.")
        .and_then(|rest| rest.split_once('.'))
        .and_then(|(index, name)| Some((index.parse::<usize>().ok()?, name)));
    match kick {
        Some((_, "time")) => return Influence::KickTime(value),
        Some((index, _)) => return Influence::KickSize(case.parameters.perturbations[index].time),
        None => {}
    }
    if path == "initial.speed" {
        return Influence::Speed;
    }
    // A step at t = 0 is another profile than any ramp.
    if path == "actuation.rise_time" && value == 0.0 {
        return Influence::Undefined;
    }
    let step = if value == 0.0 { STEP } else { STEP * value.abs() };
    let at = |value: f64| Box::new(Equations::new(&case.parameters_with(path, value)));
    Influence::Equations(at(value + step), at(value - step), 2.0 * step)
}

/// The linearisation of a recorded run.
fn of_run(case: &Case, recorder: &MemoryRecorder, instability: Option<f64>) -> Linearised {
    let influences = influences(case);
    let columns = HEAD + influences.len();
    let mut propagation = Propagation {
        equations: Equations::new(&case.parameters),
        influences: &influences,
        deviations: DMatrix::zeros(DYNAMIC, columns),
        frequency: TorsionModel::new(&case.parameters).natural_angular_frequency(),
    };
    for (column, (_, influence)) in influences.iter().enumerate() {
        if matches!(influence, Influence::Speed) {
            propagation.deviations[(ROTOR_SPEED, HEAD + column)] = 1.0;
        }
    }
    let mut events = Vec::with_capacity(recorder.events.len());
    let mut speed_at_instability = None;
    let mut kicked = false;
    let mut moved: Option<(f64, DVector<f64>)> = None;
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
    for (index, event) in recorder.events.iter().enumerate() {
        let nodes = nodes_before(event, mode, start.take(), &mut samples);
        for pair in nodes.windows(2) {
            propagation.step(mode, &pair[0], &pair[1]);
        }
        let inherited = moved
            .as_ref()
            .filter(|(time, _)| *time == event.time)
            .map(|(_, row)| row);
        let row = match inherited {
            Some(row) => row.clone(),
            None => propagation.shift(case, event, mode),
        };
        propagation.pass(event, mode, &row, inherited.is_some());
        if Some(index) == unstable {
            speed_at_instability = Some(event.before.relative_velocity.abs());
            propagation.start_growth();
        }
        let noise = f64::EPSILON * speed_at_instability.unwrap_or(f64::INFINITY) * propagation.growth().exp();
        let kick = (event.after.relative_velocity - event.before.relative_velocity).abs();
        if event.kind == EventKind::Kick && !kicked && kick > KICK_ABOVE_NOISE * noise {
            propagation.start_rounding();
        }
        kicked |= event.kind == EventKind::Kick && speed_at_instability.is_some();
        let grown = speed_at_instability.map(|_| propagation.growth());
        events.push(LinearisedEvent {
            time: event.time,
            kind: event.kind,
            by_parameter: row.iter().skip(HEAD).copied().collect(),
            growth: grown,
            per_deviation: speed_at_instability.map(|_| propagation.worst_direction(&row)),
        });
        mode = event.mode_after;
        start = Some(Node::after(event));
        moved = Some((event.time, row));
    }
    Linearised {
        parameters: influences.into_iter().map(|(name, _)| name).collect(),
        events,
        speed_at_instability,
    }
}

struct Propagation<'a> {
    equations: Equations,
    influences: &'a [(ParameterName, Influence)],
    /// A column for each unit deviation, then one for each parameter.
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
    /// df/dp for each parameter.
    fn forcing(&self, mode: Mode, t: f64, y: &Dynamic) -> DMatrix<f64> {
        let mut forcing = DMatrix::zeros(DYNAMIC, self.deviations.ncols());
        for (column, (_, influence)) in self.influences.iter().enumerate() {
            if let Influence::Equations(above, below, width) = influence {
                let slope = (above.rates(mode, t, y) - below.rates(mode, t, y)) / *width;
                forcing.fixed_columns_mut::<1>(HEAD + column).copy_from(&slope);
            }
        }
        forcing
    }

    /// From one node of the run to the next.
    fn step(&mut self, mode: Mode, from: &Node, to: &Node) {
        let h = to.time - from.time;
        if h <= 0.0 {
            return;
        }
        let (nodes, a) = radau();
        let rates = [from, to].map(|node| self.equations.rates(mode, node.time, &node.state));
        let mut matrix = DMatrix::identity(3 * DYNAMIC, 3 * DYNAMIC);
        let mut slopes = DMatrix::zeros(3 * DYNAMIC, self.deviations.ncols());
        for i in 0..3 {
            let t = from.time + nodes[i] * h;
            let y = from.towards(to, &rates, nodes[i]);
            let jacobian = self.equations.jacobian(mode, t, &y);
            for (j, weight) in a[i].iter().enumerate() {
                let mut block = matrix.fixed_view_mut::<DYNAMIC, DYNAMIC>(i * DYNAMIC, j * DYNAMIC);
                block -= jacobian * (h * weight);
            }
            let value = jacobian * &self.deviations + self.forcing(mode, t, &y);
            slopes.rows_mut(i * DYNAMIC, DYNAMIC).copy_from(&value);
        }
        // The matrix is singular at isolated steps only; then the solve reports it, and the deviation is not finite.
        if !matrix.lu().solve_mut(&mut slopes) {
            self.deviations.fill(f64::NAN);
            return;
        }
        for (j, weight) in a[2].iter().enumerate() {
            self.deviations += slopes.rows(j * DYNAMIC, DYNAMIC) * (h * weight);
        }
    }

    /// By how much each column moves the time of an event, s.
    fn shift(&self, case: &Case, event: &Event, before: Mode) -> DVector<f64> {
        let (t, y) = (event.time, Node::before(event).state);
        let guard =
            |equations: &Equations, t: f64, y: &Dynamic| equations.guard(event.kind, before, event.mode_after, t, y);
        if guard(&self.equations, t, &y).is_none() {
            return self.set_by_time(case, event);
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
            let twist = row == ROTOR_TWIST || row == STATOR_TWIST;
            let delta = STEP * if twist { size / self.frequency } else { size };
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

    /// The same of an event whose time is a parameter, or follows from none.
    fn set_by_time(&self, case: &Case, event: &Event) -> DVector<f64> {
        let mut row = DVector::zeros(self.deviations.ncols());
        for (column, (name, influence)) in self.influences.iter().enumerate() {
            let moves = match (event.kind, influence) {
                (EventKind::Kick, Influence::KickTime(time)) => *time == event.time,
                (EventKind::Corner, _) => is_corner(&case.parameters.actuation, &name.path, event.time),
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
                let half = (column[ROTOR_SPEED] - column[ROTOR_TWIST_RATE] - column[STATOR_TWIST_RATE]) / 2.0;
                column[ROTOR_TWIST_RATE] += half;
                column[STATOR_TWIST_RATE] += half;
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
                        self.deviations[(ROTOR_TWIST_RATE, HEAD + column)] -= 0.5;
                        self.deviations[(STATOR_TWIST_RATE, HEAD + column)] -= 0.5;
                    }
                }
            }
        }
    }

    /// Unit deviations from here on.
    fn start_growth(&mut self) {
        self.deviations.columns_mut(0, DYNAMIC).fill_with_identity();
        self.start_rounding();
    }

    /// Rounding from here on.
    fn start_rounding(&mut self) {
        self.deviations.columns_mut(DYNAMIC, DYNAMIC).fill_with_identity();
    }

    /// What a component is multiplied by to compare with a rate.
    fn weight(&self, component: usize) -> f64 {
        if component == ROTOR_TWIST || component == STATOR_TWIST {
            self.frequency
        } else {
            1.0
        }
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

    /// The largest shift of an event by a deviation of 1 rad/s from where rounding counts, s.
    fn worst_direction(&self, row: &DVector<f64>) -> f64 {
        (0..DYNAMIC)
            .map(|j| (row[DYNAMIC + j] / self.weight(j)).powi(2))
            .sum::<f64>()
            .sqrt()
    }
}

/// Whether the corner of F(t) at `time` is the number at `path`.
fn is_corner(actuation: &Actuation, path: &str, time: f64) -> bool {
    match actuation {
        Actuation::Ramp { rise_time, .. } => path == "actuation.rise_time" && *rise_time == time,
        Actuation::Table { time: times, .. } => path
            .strip_prefix("actuation.time.")
            .and_then(|index| index.parse::<usize>().ok())
            .is_some_and(|index| times.get(index) == Some(&time)),
    }
}
