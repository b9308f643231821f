//! Modes, events, kicks and corners.

mod guards;

use super::axial::Actuation;
use super::float::Float;
use super::friction::{self, at_vanishing_speed};
use super::number::Number;
use super::report::{OracleEvent, OracleReport, OracleState};
use super::series::{Expansion, Law, Model, State, component::*};
use super::steps::{self, Scales};
use super::{OracleError, OracleOptions};
use crate::model::{BreakawayTest, ExactParameters, Mode};
use crate::record::EventKind;
use guards::Guard;
use std::collections::VecDeque;
use std::ops::ControlFlow;

/// Bits between the digits that a run is to compute with and its precision, for the rounding of sums.
pub(super) const GUARD_BITS: f64 = 18.0;

/// Solves the model from t = 0 to the end time of `options`. `control` is asked at every step, with the time (s); `Break`
/// ends the run with an error.
///
/// # Errors
/// A precision or a breakaway test that it does not have, an exhausted event budget, a degenerate motion.
pub fn run(
    parameters: &ExactParameters,
    options: &OracleOptions,
    control: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<OracleReport, OracleError> {
    let Some(words) = super::words(options.digits) else {
        return Err(OracleError::Digits { asked: options.digits });
    };
    if parameters.breakaway_test != BreakawayTest::Transmitted {
        return Err(OracleError::BreakawayTest);
    }
    // A number of words that the compiler knows makes the arithmetic several times faster.
    match words {
        1 => run_with::<1>(parameters, options, control),
        2 => run_with::<2>(parameters, options, control),
        3 => run_with::<3>(parameters, options, control),
        4 => run_with::<4>(parameters, options, control),
        6 => run_with::<6>(parameters, options, control),
        10 => run_with::<10>(parameters, options, control),
        16 => run_with::<16>(parameters, options, control),
        32 => run_with::<32>(parameters, options, control),
        _ => Err(OracleError::Digits { asked: options.digits }),
    }
}

fn run_with<const N: usize>(
    parameters: &ExactParameters,
    options: &OracleOptions,
    control: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<OracleReport, OracleError> {
    let mut run = Run::<N>::new(parameters, options);
    while run.time < run.end {
        // Steps with many words take long each.
        if run.steps.is_multiple_of(if N > 4 { 1 } else { 64 }) && control(run.time.to_f64()).is_break() {
            return Err(OracleError::Interrupted(run.time.to_f64()));
        }
        run.time_events()?;
        run.step()?;
    }
    run.time_events()?;
    Ok(OracleReport {
        events: run.events,
        samples: run.samples,
        steps: run.steps,
        bits: Float::<N>::BITS,
    })
}

/// Whether the loss of stability is looked for: until the first stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Watch {
    Stable,
    Unstable,
    Off,
}

struct Run<const N: usize> {
    model: Model<N>,
    scales: Scales,
    time: Float<N>,
    end: Float<N>,
    state: State<N>,
    mode: Mode,
    watch: Watch,
    /// The knots of the friction law, between which of them the slip is (above so many), and whether the last ends the law.
    knots: Vec<Float<N>>,
    piece: usize,
    ends: bool,
    /// Guards that are zero at the present time by what has just happened, with the number of their coefficients that are.
    zeros: Vec<(Guard, usize)>,
    /// Of a take-off from stick: 2 where breakaway and low-speed friction are equal, since omega_r' starts at 0 too.
    take_off_zeros: usize,
    actuation: Actuation<N>,
    /// The ringing of an open contact has fallen below its floor: open it stays, up to the next corner.
    stays_open: bool,
    /// Timed kicks to come, in order, and those that wait for the instability.
    kicks: VecDeque<(Float<N>, Float<N>)>,
    waiting: Vec<Float<N>>,
    samples_due: VecDeque<Float<N>>,
    events: Vec<OracleEvent>,
    samples: Vec<(Number, OracleState)>,
    max_events: usize,
    counted: usize,
    steps: u64,
}

impl<const N: usize> Run<N> {
    fn new(exact: &ExactParameters, options: &OracleOptions) -> Self {
        let number = Float::from_rational;
        let axial = [&exact.mass, &exact.axial_stiffness];
        let (actuation, pressed) = Actuation::new(&exact.actuation, &exact.ringing_floor, axial);
        let mut kicks: Vec<_> = exact
            .kicks
            .iter()
            .filter_map(|kick| Some((kick.time.clone()?, number(&kick.relative_velocity))))
            .collect();
        kicks.sort_by(|a, b| a.0.cmp(&b.0));
        let mut state: State<N> = [Float::zero(); COUNT];
        state[ROTOR_SPEED] = number(&exact.speed);
        let (knots, ends) = friction::knots(&exact.law);
        let mut run = Run {
            knots: knots.iter().map(number).collect(),
            piece: 0,
            ends,
            model: Model::new(exact),
            scales: Scales::new(exact),
            time: Float::zero(),
            end: number(&options.end_time),
            state,
            mode: Mode::Separated,
            watch: Watch::Stable,
            zeros: Vec::new(),
            take_off_zeros: if exact.breakaway == at_vanishing_speed(&exact.law) {
                2
            } else {
                1
            },
            actuation,
            stays_open: false,
            kicks: kicks.into_iter().map(|(time, delta)| (number(&time), delta)).collect(),
            waiting: exact
                .kicks
                .iter()
                .filter(|kick| kick.time.is_none())
                .map(|kick| number(&kick.relative_velocity))
                .collect(),
            samples_due: options.sample_times.iter().map(number).collect(),
            events: Vec::new(),
            samples: Vec::new(),
            max_events: options.max_events,
            counted: 0,
            steps: 0,
        };
        if pressed {
            run.mode = run.mode_in_contact();
        }
        if run.mode == Mode::Stick {
            run.watch = Watch::Off;
        }
        run.find_piece();
        run
    }

    /// The piece of the friction law for the present speed; at a knot the one below.
    fn find_piece(&mut self) {
        let relative = self.relative_velocity();
        let speed = if relative.signum() < 0 { -&relative } else { relative };
        self.piece = self.knots.iter().filter(|knot| **knot < speed).count();
    }

    /// phi_2' - phi_1'.
    fn relative_velocity(&self) -> Float<N> {
        &(&self.state[ROTOR_SPEED] - &self.state[ROTOR_TWIST_RATE]) - &self.state[STATOR_TWIST_RATE]
    }

    /// Both surfaces at their mean speed.
    fn join(&mut self) {
        let half = self.relative_velocity().half();
        self.state[STATOR_TWIST_RATE] += &half;
        self.state[ROTOR_TWIST_RATE] = &self.state[ROTOR_SPEED] - &self.state[STATOR_TWIST_RATE];
    }

    /// For surfaces of one speed: stick, or slip in the sense of the torque that the interface cannot carry.
    fn settled(&self) -> Mode {
        let y = &self.state;
        let normal = self.model.axial.normal_force(&y[Z], &y[Z_DOT]);
        let limit = if normal.signum() > 0 {
            self.model.breakaway_torque(&normal)
        } else {
            Float::zero()
        };
        let rotor = self.model.torque(&y[ROTOR_TWIST], &y[ROTOR_TWIST_RATE]);
        let stator = self.model.torque(&y[STATOR_TWIST], &y[STATOR_TWIST_RATE]);
        let transmitted = (&rotor + &stator).half();
        let magnitude = if transmitted.signum() < 0 {
            -&transmitted
        } else {
            transmitted
        };
        if magnitude <= limit {
            Mode::Stick
        } else {
            slip(transmitted.signum())
        }
    }

    fn mode_in_contact(&self) -> Mode {
        match self.relative_velocity().signum() {
            0 => self.settled(),
            sign => slip(sign),
        }
    }

    fn record(&mut self, kind: EventKind) -> Result<(), OracleError> {
        self.counted += usize::from(kind.in_event_sequence());
        if self.counted > self.max_events {
            return Err(OracleError::TooManyEvents {
                time: self.time.to_f64(),
                budget: self.max_events,
            });
        }
        self.events.push(OracleEvent {
            time: (&self.time).into(),
            kind,
            mode_after: self.mode,
            state: OracleState::new(&self.state),
        });
        Ok(())
    }

    /// What is due at the present time: a corner of the force, then kicks.
    fn time_events(&mut self) -> Result<(), OracleError> {
        while self.actuation.advance(&self.time) {
            self.record(EventKind::Corner)?;
            self.close_at_corner()?;
        }
        while self.kicks.front().is_some_and(|(time, _)| *time <= self.time) {
            if let Some((_, delta)) = self.kicks.pop_front() {
                self.kick(&delta)?;
            }
        }
        Ok(())
    }

    /// At a corner where an open contact stops to stay open whatever rings: it closes at once if the force stands at zero and
    /// leaves it with F, or stands beyond it.
    fn close_at_corner(&mut self) -> Result<(), OracleError> {
        self.stays_open = false;
        let axial = [&self.state[Z], &self.state[Z_DOT]];
        let (actuation, motion) = (&self.actuation, &self.model.axial);
        if self.mode != Mode::Separated || actuation.rests(motion, axial, &self.time) {
            return Ok(());
        }
        match actuation.leaving(motion, axial) {
            (1, beyond) => {
                self.close()?;
                if !beyond {
                    // Zero up to rounding, and rising up to the next corner.
                    self.zeros.push((Guard::Separation, usize::MAX));
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn close(&mut self) -> Result<(), OracleError> {
        self.mode = self.mode_in_contact();
        self.find_piece();
        if self.mode == Mode::Stick {
            self.watch = Watch::Off;
        }
        self.record(EventKind::Contact)
    }

    /// Half of the jump on each surface; in stick it is absorbed.
    fn kick(&mut self, delta: &Float<N>) -> Result<(), OracleError> {
        if self.mode == Mode::Stick {
            return self.record(EventKind::Kick);
        }
        let half = delta.half();
        self.state[ROTOR_TWIST_RATE] -= &half;
        self.state[STATOR_TWIST_RATE] -= &half;
        self.zeros
            .retain(|(guard, _)| !matches!(guard, Guard::Stop | Guard::Stability | Guard::Knot(_)));
        self.find_piece();
        self.record(EventKind::Kick)?;
        if self.mode == Mode::Separated {
            return Ok(());
        }
        let sign = self.relative_velocity().signum();
        if sign == 0 {
            self.stop()
        } else if sign != self.mode.sense() {
            self.mode = slip(sign);
            self.record(EventKind::Reversal)
        } else {
            Ok(())
        }
    }

    /// The relative velocity has reached zero in slip.
    fn stop(&mut self) -> Result<(), OracleError> {
        self.join();
        self.piece = 0;
        let mode = self.settled();
        self.zeros.retain(|(guard, _)| *guard != Guard::Stop);
        if mode != Mode::Stick {
            self.zeros.push((Guard::Stop, 1));
        }
        if mode == self.mode {
            return Ok(());
        }
        self.mode = mode;
        if mode == Mode::Stick {
            self.watch = Watch::Off;
            self.record(EventKind::Stick)
        } else {
            self.record(EventKind::Reversal)
        }
    }

    /// One step: to the next guard, time event or the end of the series' reach.
    fn step(&mut self) -> Result<(), OracleError> {
        let law = match self.mode {
            Mode::Separated | Mode::Engaged => Law::Separated,
            Mode::Stick => Law::Stick,
            Mode::SlipForward | Mode::SlipBackward => {
                if self.ends && self.piece == self.knots.len() {
                    return Err(OracleError::BeyondLaw(self.time.to_f64()));
                }
                Law::Slip(self.mode.sense(), self.piece)
            }
        };
        let mut until = self.end;
        if let Some(corner) = self.actuation.next_corner() {
            until = least(until, Float::from_rational(corner));
        }
        if let Some((time, _)) = self.kicks.front() {
            until = least(until, *time);
        }
        let limit = &until - &self.time;
        if limit.signum() <= 0 {
            return Ok(());
        }
        let mut expansion = Expansion::new(law, &self.state, self.actuation.at(&self.time));
        let step = steps::choose(&mut expansion, &self.model, &self.scales, &limit);
        let resolved = step.log2() > self.time.log2() - Float::<N>::BITS as f64 + 8.0;
        if !resolved && step < limit {
            return Err(OracleError::StepVanishes(self.time.to_f64()));
        }
        self.steps += 1;
        let fired = self.first_guard(&expansion, &step)?;
        let reached = fired.as_ref().map_or(&step, |(time, _)| time);
        while let Some(due) = self.samples_due.front().map(|due| due - &self.time) {
            if due > *reached {
                break;
            }
            let time = &self.time + &due;
            self.samples
                .push(((&time).into(), OracleState::new(&expansion.at(&due))));
            self.samples_due.pop_front();
        }
        self.state = expansion.at(reached);
        if steps::is_lost(&self.state) {
            return Err(OracleError::StepVanishes(self.time.to_f64()));
        }
        self.time = match &fired {
            None if step >= limit => until,
            _ => &self.time + reached,
        };
        // What fires at once does so at a knot still, whose slope has made it fire.
        let at_knot = reached.is_zero();
        self.zeros
            .retain(|(guard, _)| at_knot && matches!(guard, Guard::Knot(_)));
        match fired {
            Some((after, guard)) => self.transition(guard, after.is_zero()),
            None => Ok(()),
        }
    }

    /// What a guard does that has fired, `at_once` if it stood beyond its boundary.
    fn transition(&mut self, guard: Guard, at_once: bool) -> Result<(), OracleError> {
        match guard {
            Guard::Stop => self.stop(),
            Guard::Knot(side) => {
                self.piece = if side > 0 { self.piece + 1 } else { self.piece - 1 };
                if !at_once {
                    self.zeros.push((Guard::Knot(-side), 1));
                }
                Ok(())
            }
            Guard::Breakaway(sense) => {
                // omega_r is zero exactly, not to the rounding of the stick.
                self.join();
                self.mode = slip(sense);
                self.piece = 0;
                self.zeros.push((Guard::Stop, self.take_off_zeros));
                self.record(EventKind::Slip)
            }
            Guard::Separation => {
                self.mode = Mode::Separated;
                self.zeros.push((Guard::Contact, 1));
                self.record(EventKind::Separation)
            }
            Guard::Contact => {
                self.close()?;
                // Unless the force stood beyond zero already.
                if !at_once {
                    self.zeros.push((Guard::Separation, 1));
                }
                Ok(())
            }
            Guard::Stability => {
                let lost = self.watch == Watch::Stable;
                self.watch = if lost { Watch::Unstable } else { Watch::Stable };
                if !at_once {
                    self.zeros.push((Guard::Stability, 1));
                }
                if !lost {
                    return self.record(EventKind::Restabilised);
                }
                self.record(EventKind::Destabilised)?;
                for delta in std::mem::take(&mut self.waiting) {
                    self.kick(&delta)?;
                }
                Ok(())
            }
        }
    }
}

fn slip(sign: i8) -> Mode {
    if sign > 0 {
        Mode::SlipForward
    } else {
        Mode::SlipBackward
    }
}

fn least<const N: usize>(a: Float<N>, b: Float<N>) -> Float<N> {
    if b < a { b } else { a }
}
