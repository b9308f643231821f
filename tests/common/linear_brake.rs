//! The brake with constant friction as an oracle: piecewise linear, so that the matrix exponential is exact.
//!
//! It shares nothing with the program but the parameters. Everything is one linear system, x' = A x, for each mode: the
//! torsional state, the axial one, the applied force and its slope. Switches are found by walking in steps of
//! [`STEP`] and bisection of the one in which a guard has changed its sign; what happens there are the transitions of
//! the model, written down again.

use nalgebra::{SMatrix, SVector};
use stickslip::model::{KickTime, Mode, Parameters};
use stickslip::record::EventKind;
use stickslip::signal::{Ramp, Signal, TimeTable};

type State = SVector<f64, 10>;
type Matrix = SMatrix<f64, 10, 10>;

/// 2^-20 s, a 250th of the fast period: a guard does not cross and come back within one.
const STEP: f64 = 1.0 / 1048576.0;
/// Twists are stored times this, the axial displacement times the other, so that their sizes are those of the rates.
const TORSIONAL: f64 = 32768.0;
const AXIAL: f64 = 4096.0;

/// Positions: twist and rate of the rotor, of the stator, rotor speed, slip, axial displacement and velocity, F and F'.
const U: usize = 0;
const U_DOT: usize = 1;
const V: usize = 2;
const V_DOT: usize = 3;
const THETA_DOT: usize = 4;
const SLIP: usize = 5;
const Z: usize = 6;
const Z_DOT: usize = 7;
const FORCE: usize = 8;
const FORCE_RATE: usize = 9;

/// exp(A STEP 2^k).
struct Flow {
    a: Matrix,
    powers: Vec<Matrix>,
}

impl Flow {
    fn new(a: Matrix) -> Self {
        let mut powers = vec![(a * STEP).exp()];
        for k in 0..24 {
            powers.push(powers[k] * powers[k]);
        }
        Flow { a, powers }
    }

    fn advance(&self, x: &State, tau: f64) -> State {
        let mut steps = (tau / STEP).floor();
        let rest = tau - steps * STEP;
        let mut x = *x;
        for power in self
            .powers
            .iter()
            .rev()
            .enumerate()
            .map(|(k, p)| (self.powers.len() - 1 - k, p))
        {
            let size = 2f64.powi(power.0 as i32);
            while steps >= size {
                x = power.1 * x;
                steps -= size;
            }
        }
        // ||A STEP|| is about 0.1
        let mut term = x;
        for n in 1..=14 {
            term = self.a * term * (rest / f64::from(n));
            x += term;
        }
        x
    }
}

#[derive(Debug, Clone, Copy)]
pub struct Switch {
    pub time: f64,
    pub kind: EventKind,
    pub mode_after: Mode,
}

struct Piece {
    start: f64,
    mode: Mode,
    x: State,
}

/// A computed run.
pub struct LinearBrake {
    parameters: Parameters,
    /// By the number of the mode.
    flows: [Flow; 5],
    pieces: Vec<Piece>,
    pub events: Vec<Switch>,
}

/// What a sample is held against.
pub struct Expected {
    pub mode: Mode,
    pub rotor_twist: f64,
    pub rotor_twist_rate: f64,
    pub stator_twist: f64,
    pub stator_twist_rate: f64,
    pub theta_dot: f64,
    pub slip: f64,
    pub z: f64,
    pub z_dot: f64,
    pub normal_force: f64,
}

impl LinearBrake {
    /// Computes the run from t = 0 to `end`.
    ///
    /// # Panics
    /// If friction is not constant, or a kick has no fixed time.
    pub fn run(parameters: &Parameters, end: f64) -> Self {
        let law = parameters.friction.law.as_exponential().unwrap();
        assert!(
            law.decay == 0.0 || law.low_speed == law.high_speed,
            "friction is not constant"
        );
        let mut run = LinearBrake {
            parameters: parameters.clone(),
            flows: Mode::ALL.map(|mode| Flow::new(system(parameters, mode))),
            pieces: Vec::new(),
            events: Vec::new(),
        };
        run.compute(end);
        run
    }

    fn normal_force(&self, x: &State) -> f64 {
        let a = self.parameters.axial;
        -a.damping * x[Z_DOT] - a.stiffness * x[Z] / AXIAL
    }

    fn transmitted(&self, x: &State) -> f64 {
        let t = self.parameters.torsion;
        (t.damping * (x[U_DOT] + x[V_DOT]) + t.stiffness * (x[U] + x[V]) / TORSIONAL) / 2.0
    }

    fn breakaway(&self, x: &State) -> f64 {
        self.parameters.friction.breakaway * self.parameters.contact.radius * self.normal_force(x)
    }

    /// The first guard of the mode that is negative.
    fn violated(&self, mode: Mode, x: &State) -> bool {
        let n = self.normal_force(x);
        match mode {
            Mode::Separated => n > 0.0,
            Mode::Stick => n < 0.0 || self.transmitted(x).abs() > self.breakaway(x),
            Mode::SlipForward => n < 0.0 || relative_velocity(x) < 0.0,
            Mode::SlipBackward => n < 0.0 || relative_velocity(x) > 0.0,
            Mode::Engaged => unreachable!("a brake sticks"),
        }
    }

    /// Surfaces at one speed: hold, or slide in the sense of the torque.
    fn settle(&self, x: &State) -> Mode {
        let torque = self.transmitted(x);
        if torque.abs() <= self.breakaway(x) {
            Mode::Stick
        } else {
            sliding(torque)
        }
    }

    /// (kind, mode, state) after the guard of `mode` that is violated just after `x`.
    fn transition(&self, mode: Mode, x: &State, after: &State) -> (EventKind, Mode, State) {
        if mode == Mode::Separated {
            return (EventKind::Contact, sliding(relative_velocity(x)), *x);
        }
        if self.normal_force(after) < 0.0 {
            return (EventKind::Separation, Mode::Separated, *x);
        }
        if mode == Mode::Stick {
            return (EventKind::Slip, sliding(self.transmitted(x)), *x);
        }
        let mut x = *x;
        let half = relative_velocity(&x) / 2.0;
        x[U_DOT] += half;
        x[V_DOT] += half;
        match self.settle(&x) {
            Mode::Stick => (EventKind::Stick, Mode::Stick, x),
            mode => (EventKind::Reversal, mode, x),
        }
    }

    fn compute(&mut self, end: f64) {
        let mut corners = force_corners(&self.parameters.actuation);
        let mut kicks: Vec<(f64, f64)> = self
            .parameters
            .perturbations
            .iter()
            .map(|kick| match kick.time {
                KickTime::At(t) => (t, kick.relative_velocity),
                KickTime::Instability => panic!("a kick without a time"),
            })
            .collect();
        kicks.sort_by(|a, b| a.0.total_cmp(&b.0));
        kicks.reverse();
        corners.reverse();
        let mut x = State::zeros();
        x[THETA_DOT] = self.parameters.initial.speed;
        let first = corners.pop().expect("a force");
        (x[FORCE], x[FORCE_RATE]) = (first.1, first.2);
        let (mut t, mut mode) = (0.0, sliding(self.parameters.initial.speed));
        if first.1 < 0.0 || first.1 == 0.0 && first.2 <= 0.0 {
            mode = Mode::Separated;
        }
        while t < end {
            self.pieces.push(Piece { start: t, mode, x });
            let kick = kicks.last().map_or(f64::INFINITY, |k| k.0);
            let corner = corners.last().map_or(f64::INFINITY, |c| c.0);
            let stop = end.min(kick).min(corner);
            match self.first_switch(mode, &x, stop - t) {
                Some((tau, before, after)) => {
                    t += tau;
                    let (kind, mode_after, state) = self.transition(mode, &before, &after);
                    (mode, x) = (mode_after, state);
                    self.happened(t, kind, mode);
                }
                None => {
                    x = self.flows[mode as usize].advance(&x, stop - t);
                    t = stop;
                    if corner <= t {
                        let (_, force, rate) = corners.pop().expect("just seen");
                        (x[FORCE], x[FORCE_RATE]) = (force, rate);
                        self.happened(t, EventKind::Corner, mode);
                    }
                    while kicks.last().is_some_and(|k| k.0 <= t) {
                        let (_, delta) = kicks.pop().expect("just seen");
                        if mode != Mode::Stick {
                            x[U_DOT] -= delta / 2.0;
                            x[V_DOT] -= delta / 2.0;
                        }
                        self.happened(t, EventKind::Kick, mode);
                        let w = relative_velocity(&x);
                        if f64::from(mode.sense()) * w < 0.0 {
                            mode = sliding(w);
                            self.happened(t, EventKind::Reversal, mode);
                        }
                    }
                }
            }
        }
    }

    fn happened(&mut self, time: f64, kind: EventKind, mode_after: Mode) {
        self.events.push(Switch { time, kind, mode_after });
    }

    /// Time of the first change of a guard's sign within `span`, with the states just before and after it.
    fn first_switch(&self, mode: Mode, x: &State, span: f64) -> Option<(f64, State, State)> {
        let flow = &self.flows[mode as usize];
        let (mut here, mut steps) = (*x, 0.0);
        loop {
            let step = STEP.min(span - steps * STEP);
            if step <= 0.0 {
                return None;
            }
            let next = flow.advance(&here, step);
            if self.violated(mode, &next) {
                // a guard that stands at its boundary at the start of the piece is on its allowed side
                let (mut low, mut high) = (0.0, step);
                while high - low > 1e-17 {
                    let middle = 0.5 * (low + high);
                    if middle <= low || middle >= high {
                        break;
                    }
                    if self.violated(mode, &flow.advance(&here, middle)) {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                return Some((steps * STEP + low, flow.advance(&here, low), next));
            }
            (here, steps) = (next, steps + 1.0);
        }
    }

    /// The state at a time.
    pub fn at(&self, t: f64) -> Expected {
        let piece = &self.pieces[self.pieces.partition_point(|p| p.start <= t).saturating_sub(1)];
        let x = self.flows[piece.mode as usize].advance(&piece.x, t - piece.start);
        Expected {
            mode: piece.mode,
            rotor_twist: x[U] / TORSIONAL,
            rotor_twist_rate: x[U_DOT],
            stator_twist: x[V] / TORSIONAL,
            stator_twist_rate: x[V_DOT],
            theta_dot: x[THETA_DOT],
            slip: x[SLIP],
            z: x[Z] / AXIAL,
            z_dot: x[Z_DOT],
            normal_force: self.normal_force(&x),
        }
    }
}

fn relative_velocity(x: &State) -> f64 {
    x[THETA_DOT] - x[U_DOT] - x[V_DOT]
}

fn sliding(sign: f64) -> Mode {
    if sign > 0.0 {
        Mode::SlipForward
    } else {
        Mode::SlipBackward
    }
}

/// (time, F, F') of each stretch of linear force, in order.
fn force_corners(actuation: &Signal) -> Vec<(f64, f64, f64)> {
    match actuation {
        Signal::Ramp(Ramp { value, rise_time }) if *rise_time == 0.0 => vec![(0.0, *value, 0.0)],
        Signal::Ramp(Ramp { value, rise_time }) => vec![(0.0, 0.0, value / rise_time), (*rise_time, *value, 0.0)],
        Signal::TimeTable(TimeTable { time, value: force }) => {
            assert_eq!(time[0], 0.0, "a table from 0 on");
            let last = time.len() - 1;
            (0..=last)
                .map(|k| {
                    let slope = if k == last {
                        0.0
                    } else {
                        (force[k + 1] - force[k]) / (time[k + 1] - time[k])
                    };
                    (time[k], force[k], slope)
                })
                .collect()
        }
    }
}

/// A of the mode, equations (1) to (5).
fn system(p: &Parameters, mode: Mode) -> Matrix {
    let (t, a) = (p.torsion, p.axial);
    let (i, j) = (t.rotor_inertia, t.surface_inertia);
    let mut m = Matrix::zeros();
    let row = |index: usize, value: f64| {
        let mut row = SMatrix::<f64, 1, 10>::zeros();
        row[index] = value;
        row
    };
    let rotor_torque = row(U, t.stiffness / TORSIONAL) + row(U_DOT, t.damping);
    let stator_torque = row(V, t.stiffness / TORSIONAL) + row(V_DOT, t.damping);
    let pressing = -row(Z, a.stiffness / AXIAL) - row(Z_DOT, a.damping);
    let interface = match mode {
        Mode::Separated | Mode::Engaged => row(0, 0.0),
        Mode::Stick => (rotor_torque + stator_torque) / 2.0,
        Mode::SlipForward | Mode::SlipBackward => {
            // constant: mu_s where alpha = 0, or mu_s = mu_d
            pressing * (f64::from(mode.sense()) * p.friction.law.as_exponential().unwrap().low_speed * p.contact.radius)
        }
    };
    let theta_ddot = -rotor_torque / i;
    let phi2_ddot = (rotor_torque - interface) / j;
    let phi1_ddot = (interface - stator_torque) / j;
    m.set_row(U, &row(U_DOT, TORSIONAL));
    m.set_row(U_DOT, &(theta_ddot - phi2_ddot));
    m.set_row(V, &row(V_DOT, TORSIONAL));
    m.set_row(V_DOT, &phi1_ddot);
    m.set_row(THETA_DOT, &theta_ddot);
    if mode != Mode::Stick {
        m.set_row(SLIP, &(row(THETA_DOT, 1.0) - row(U_DOT, 1.0) - row(V_DOT, 1.0)));
    }
    m.set_row(Z, &row(Z_DOT, AXIAL));
    m.set_row(Z_DOT, &((pressing - row(FORCE, 1.0)) / a.mass));
    m.set_row(FORCE, &row(FORCE_RATE, 1.0));
    m
}
