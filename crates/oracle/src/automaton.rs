//! Modes, events, kicks and corners.

mod guards;

use super::axial::{Actuation, INSTANT};
use super::courses::SignalCourse;
use super::equations::{ChainState, ExactExpansion, ExactRegime, Far, Model, ROTOR, STATOR, State, speeds};
use super::float::{Float, WORD_BITS};
use super::friction::{self, at_vanishing_speed};
use super::number::ExactDouble;
use super::report::{OracleEvent, OracleReport, OracleState};
use super::scales::{Scales, scales};
use super::{GUARD_BITS, MOST_WORDS, OracleError, OracleOptions, steps};
use guards::{ExactGuard, FiredGuard};
use num_rational::BigRational;
use std::collections::VecDeque;
use std::ops::ControlFlow;
use stickslip_system::model::system::{ContactLaw, ExactSystem, KickSide, Pressing};
use stickslip_system::model::{BreakawayTest, KickTime, Mode};
use stickslip_system::record::EventKind;

/// Largest order up to which the first nonzero coefficient is searched.
const LEADING: usize = 8;

/// Bits of the state lost to the rounding of one step. If the numbers are longer than the precision, the state is cut
/// off, this many bits beyond the precision. The run then has the error of that precision, and
/// [`solve`](super::solve()) can distinguish it from a run of higher precision.
const ROUNDED_BITS: usize = 5;

/// Solves the model from t = 0 to the end time of `options`. `control` gets the time (s) every few steps; if it
/// returns `Break`, the run ends with an error.
///
/// # Errors
/// An unknown precision or breakaway test, an exhausted event budget, a degenerate motion, two surfaces without
/// inertia.
pub fn run(
    parameters: &ExactSystem,
    options: &OracleOptions,
    control: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<OracleReport, OracleError> {
    if parameters.breakaway_test != BreakawayTest::Transmitted {
        return Err(OracleError::BreakawayTest);
    }
    let words = super::words(options.digits).ok_or(OracleError::Digits { asked: options.digits })?;
    // With a length known to the compiler, arithmetic is several times faster, but each length is compiled separately.
    // Precisions in between use the next longer numbers.
    let run = match words {
        ..=2 => run_with::<2>,
        3..=4 => run_with::<4>,
        5..=10 => run_with::<10>,
        _ => run_with::<MOST_WORDS>,
    };
    run(parameters, options, words * WORD_BITS, control)
}

fn run_with<const N: usize>(
    exact: &ExactSystem,
    options: &OracleOptions,
    bits: usize,
    control: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<OracleReport, OracleError> {
    let mut run = ExactRun::<N>::new(exact, options, bits)?;
    while run.time < run.end {
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
        bits,
    })
}

/// State of the stability margin. It is watched until the first stick, and only if sliding slows down by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ExactMarginWatch {
    Stable,
    Unstable,
    Off,
}

#[derive(Clone, Copy)]
struct ExactKick<const N: usize> {
    delta: Float<N>,
    on: KickSide,
}

struct ExactRun<const N: usize> {
    bits: usize,
    model: Model<N>,
    scales: Scales,
    courses: Vec<SignalCourse<N>>,
    actuation: Option<Actuation<N>>,
    time: Float<N>,
    end: Float<N>,
    state: State<N>,
    mode: Mode,
    watch: ExactMarginWatch,
    /// Sign of omega_r in a contact without stick.
    sense: i8,
    /// The stick speed of a contact without stick, and whether |omega_r| is above it.
    threshold: Option<(Float<N>, bool)>,
    /// Knots of the friction law; the number of knots below the slip speed; whether the last knot ends the law.
    knots: Vec<Float<N>>,
    piece: usize,
    ends: bool,
    /// Guards that the last event left at zero, with the number of their leading coefficients that vanish.
    zeros: Vec<(ExactGuard, usize)>,
    /// For a breakaway: 2 if breakaway and low-speed friction are equal, because omega_r' then also starts at 0;
    /// otherwise 1.
    take_off_zeros: usize,
    /// Whether the ringing of an open contact is below its floor, so that the contact stays open up to the next
    /// corner.
    stays_open: bool,
    corners: VecDeque<BigRational>,
    /// Timed kicks that are still to come, in order, and kicks that wait for the instability.
    kicks: VecDeque<(Float<N>, ExactKick<N>)>,
    waiting: Vec<ExactKick<N>>,
    samples_due: VecDeque<Float<N>>,
    events: Vec<OracleEvent>,
    samples: Vec<(ExactDouble, OracleState)>,
    max_events: usize,
    counted: usize,
    steps: u64,
}

impl<const N: usize> ExactRun<N> {
    fn new(exact: &ExactSystem, options: &OracleOptions, bits: usize) -> Result<Self, OracleError> {
        let number = Float::from_rational;
        if exact.rotor.is_rigid() && exact.stator.is_rigid() {
            return Err(OracleError::Degenerate {
                time: 0.0,
                what: "neither surface has an inertia",
            });
        }
        let model = Model::new(exact);
        let courses: Vec<SignalCourse<N>> = exact
            .drives()
            .iter()
            .map(|drive| SignalCourse::new(drive, &model.table))
            .collect();
        let mut corners: Vec<BigRational> = courses.iter().flat_map(SignalCourse::corners).cloned().collect();
        let (mut actuation, mut presses) = (None, false);
        if let Pressing::Axial {
            axial,
            actuation: signal,
        } = &exact.pressing
        {
            let (force, pressed) = Actuation::new(signal, &axial.ringing_floor, [&axial.mass, &axial.stiffness]);
            corners.extend(force.corners().cloned());
            (actuation, presses) = (Some(force), pressed);
        }
        corners.sort();
        corners.dedup();
        let (mut kicks, mut waiting) = (Vec::new(), Vec::new());
        for kick in &exact.kicks {
            let given = ExactKick {
                delta: number(&kick.relative_velocity),
                on: kick.on,
            };
            match &kick.time {
                KickTime::At(time) => kicks.push((time, given)),
                KickTime::Instability => waiting.push(given),
            }
        }
        kicks.sort_by(|a, b| a.0.cmp(b.0));
        let (knots, ends) = friction::knots(&exact.law);
        let scales = scales(exact, &courses);
        let mut run = ExactRun {
            bits,
            state: State {
                // Follows from the speeds of the ends, which are known once the run exists.
                chains: Default::default(),
                axial: actuation.is_some().then(|| [Float::zero(); 2]),
                deflection: match &exact.contact {
                    ContactLaw::Bristles(bristles) => number(&bristles.deflection),
                    _ => Float::zero(),
                },
            },
            scales,
            courses,
            actuation,
            time: Float::zero(),
            end: number(&options.end_time),
            mode: Mode::Separated,
            watch: if options.stability && model.twice_resistance.is_some() {
                ExactMarginWatch::Stable
            } else {
                ExactMarginWatch::Off
            },
            sense: 1,
            threshold: None,
            knots: knots.iter().map(number).collect(),
            piece: 0,
            ends,
            zeros: Vec::new(),
            take_off_zeros: 1 + usize::from(exact.breakaway == at_vanishing_speed(&exact.law)),
            stays_open: false,
            corners: corners.into(),
            kicks: kicks.into_iter().map(|(time, kick)| (number(time), kick)).collect(),
            waiting,
            samples_due: options.sample_times.iter().map(number).collect(),
            events: Vec::new(),
            samples: Vec::new(),
            max_events: options.max_events,
            counted: 0,
            steps: 0,
            model,
        };
        run.state.chains = [
            run.initial(ROTOR, &exact.initial.rotor_twist, &exact.initial.rotor_speed),
            run.initial(STATOR, &exact.initial.stator_twist, &exact.initial.stator_speed),
        ];
        let pressed = match exact.pressing {
            Pressing::Axial { .. } => presses,
            Pressing::Force(_) => run.leaving().0 > 0,
        };
        if pressed {
            run.enter_contact();
        }
        run.find_piece();
        if !run.model.contact.sticks()
            && let Some(threshold) = &options.threshold
        {
            let threshold = number(threshold);
            run.threshold = Some((threshold, run.speed() > threshold));
        }
        Ok(run)
    }

    fn initial(&self, c: usize, twist: &[BigRational], speed: &[BigRational]) -> ChainState<N> {
        let chain = &self.model.chains[c];
        let number = |values: &[BigRational]| values.iter().map(Float::from_rational).collect::<Vec<_>>();
        let (twist, speed) = (number(twist), number(speed));
        let end = self.ends()[c];
        let rate = |i: usize| {
            let outer = speed.get(i + 1).unwrap_or(&end);
            chain.signed(&(outer - &speed[i]))
        };
        ChainState {
            rate: (0..twist.len()).map(rate).collect(),
            twist,
            free: if chain.far == Far::Free {
                speed.last().copied()
            } else {
                None
            },
            angle: Float::zero(),
        }
    }

    fn ends(&self) -> [Float<N>; 2] {
        [ROTOR, STATOR].map(|c| match self.model.chains[c].far {
            Far::Driven(course) => {
                let mut series = self.courses[course].series(&self.time, &self.model.table);
                series.extend(0, &self.model.table.reciprocals);
                series.coefficients[0]
            }
            Far::Free | Far::Fixed => Float::zero(),
        })
    }

    fn regime(&self) -> ExactRegime {
        match self.mode {
            Mode::Separated => ExactRegime::Open,
            Mode::Stick => ExactRegime::Stick,
            Mode::SlipForward | Mode::SlipBackward => ExactRegime::Slip(self.mode.sense(), self.piece),
            Mode::Engaged => ExactRegime::Engaged(self.sense, self.piece),
        }
    }

    fn expansion(&self, regime: ExactRegime, order: usize) -> ExactExpansion<N> {
        let force = self.actuation.as_ref().map(|actuation| actuation.at(&self.time));
        let now = (&self.state, &self.time);
        let mut expansion = ExactExpansion::new(
            &self.model,
            regime,
            now,
            &self.courses,
            force.unwrap_or([Float::zero(); 2]),
        );
        expansion.extend(&self.model, order);
        expansion
    }

    fn reading(&self, state: &State<N>, expansion: Option<(&ExactExpansion<N>, &Float<N>)>) -> OracleState {
        let ends = match expansion {
            Some((expansion, after)) => expansion.ends(&self.model, after),
            None => self.ends(),
        };
        OracleState::new(state, &speeds(&self.model, state, &ends), !self.model.contact.sticks())
    }

    /// Finds the piece of the friction law for the present speed; at a knot the lower one.
    fn find_piece(&mut self) {
        let speed = self.speed();
        self.piece = self.knots.iter().filter(|knot| **knot < speed).count();
    }

    fn resolved(&self) -> f64 {
        self.bits as f64 - GUARD_BITS
    }

    fn relative_velocity(&self) -> Float<N> {
        let [rotor, stator] = speeds(&self.model, &self.state, &self.ends());
        &rotor.1 - &stator.1
    }

    /// Sign of omega_r; zero within the rounding of the speeds.
    fn sign(&self) -> i8 {
        let ends = self.ends();
        let [rotor, stator] = speeds(&self.model, &self.state, &ends);
        let relative = &rotor.1 - &stator.1;
        let all = rotor.0.iter().chain(&stator.0).chain(&ends);
        let size = all.map(Float::log2).fold(self.scales.least_speed(), f64::max);
        if relative.log2() < size - self.resolved() {
            0
        } else {
            relative.signum()
        }
    }

    fn speed(&self) -> Float<N> {
        magnitude(&self.relative_velocity())
    }

    fn push(&mut self, c: usize, change: &Float<N>) {
        let chain = &self.model.chains[c];
        if chain.is_rigid() {
            return;
        }
        let state = &mut self.state.chains[c];
        match state.rate.first_mut() {
            Some(rate) => *rate -= &chain.signed(change),
            None => {
                if let Some(speed) = &mut state.free {
                    *speed += change;
                }
            }
        }
    }

    /// Adds `delta` to omega_r and keeps the momentum.
    fn jump(&mut self, delta: &Float<N>) {
        let [rotor, stator] = self.model.shares;
        self.push(ROTOR, &(delta * &rotor));
        self.push(STATOR, &-&(delta * &stator));
    }

    fn join(&mut self) {
        let relative = self.relative_velocity();
        self.jump(&-&relative);
    }

    /// Mode of surfaces with equal speed: stick, or slip in the sense of the transmitted torque if the torque exceeds
    /// the limit.
    fn settled(&self) -> Mode {
        let [transmitted, limit] = self.expansion(ExactRegime::Stick, 0).stick_test(&self.model);
        let limit = if limit.signum() > 0 { limit } else { Float::zero() };
        let excess = &magnitude(&transmitted) - &limit;
        if excess.signum() <= 0 || excess.log2() < limit.log2().max(self.scales.torque) - self.resolved() {
            Mode::Stick
        } else {
            slip(transmitted.signum())
        }
    }

    fn mode_in_contact(&mut self) -> Mode {
        if !self.model.contact.sticks() {
            self.find_sense();
            return Mode::Engaged;
        }
        match self.sign() {
            0 => {
                self.join();
                self.settled()
            }
            sign => slip(sign),
        }
    }

    fn enter_contact(&mut self) {
        let mode = self.mode_in_contact();
        self.enter(mode);
    }

    fn enter(&mut self, mode: Mode) {
        self.mode = mode;
        if mode == Mode::Stick {
            self.watch = ExactMarginWatch::Off;
        }
    }

    /// Finds the sign of omega_r in a contact without stick; at zero, the sign with which omega_r leaves zero.
    fn find_sense(&mut self) {
        self.sense = match self.relative_velocity().signum() {
            0 => {
                let expansion = self.expansion(ExactRegime::Engaged(1, 0), LEADING);
                let leading = expansion.relative.iter().map(Float::signum).find(|sign| *sign != 0);
                leading.unwrap_or(1)
            }
            sign => sign,
        };
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
            state: self.reading(&self.state, None),
        });
        Ok(())
    }

    fn time_events(&mut self) -> Result<(), OracleError> {
        while let Some(corner) = self.corners.front() {
            if Float::from_rational(corner) > self.time {
                break;
            }
            if let Some(corner) = self.corners.pop_front() {
                self.corner(&corner)?;
            }
        }
        while self.kicks.front().is_some_and(|(time, _)| *time <= self.time) {
            if let Some((_, kick)) = self.kicks.pop_front() {
                self.kick(&kick)?;
            }
        }
        Ok(())
    }

    fn corner(&mut self, corner: &BigRational) -> Result<(), OracleError> {
        let jumps: Vec<Float<N>> = self
            .courses
            .iter_mut()
            .map(|course| course.advance(corner, &self.model.table))
            .collect();
        if jumps.iter().any(|jump| !jump.is_zero()) {
            // After the jump, a breakaway at this instant is no longer tangential.
            for (_, count) in self.zeros.iter_mut().filter(|(guard, _)| *guard == ExactGuard::Stop) {
                *count = 1;
            }
        }
        let mut jumped = false;
        for (c, chain) in self.model.chains.iter().enumerate() {
            let Far::Driven(course) = chain.far else { continue };
            let jump = &jumps[course];
            if jump.is_zero() {
                continue;
            }
            jumped = true;
            if let Some(rate) = self.state.chains[c].rate.last_mut() {
                *rate += &chain.signed(jump);
            }
        }
        let of_force = match &mut self.actuation {
            Some(actuation) => actuation.advance(&self.time),
            None => true,
        };
        self.record(EventKind::Corner)?;
        if jumped && self.model.chains.iter().any(|chain| chain.is_rigid()) {
            self.after_jump()?;
        }
        if of_force { self.pressing_at_corner() } else { Ok(()) }
    }

    /// Decides about the contact at a corner, where an open contact may no longer stay open. It closes if the force
    /// stands at zero and leaves it upwards with F, or if it stands beyond zero. A closed contact opens likewise;
    /// under a given force, also if that stands beyond zero.
    fn pressing_at_corner(&mut self) -> Result<(), OracleError> {
        self.stays_open = false;
        let open = self.mode == Mode::Separated;
        match (&self.actuation, &self.model.axial, &self.state.axial) {
            (Some(actuation), Some(motion), Some([z, z_dot])) => {
                if open && actuation.rests(motion, [z, z_dot], &self.time) {
                    return Ok(());
                }
                let (side, beyond) = actuation.leaving(motion, [z, z_dot]);
                match (open, side > 0) {
                    (true, true) => {
                        self.close()?;
                        if !beyond {
                            // Zero up to rounding, and rising until the next corner.
                            self.zeros.push((ExactGuard::Separation, usize::MAX));
                        }
                    }
                    (true, false) if !beyond => self.zeros.push((ExactGuard::Contact, 1)),
                    (false, true) if !beyond => self.zeros.push((ExactGuard::Separation, 1)),
                    (false, false) if !beyond && side < 0 => {
                        self.open()?;
                        self.zeros.push((ExactGuard::Contact, 1));
                    }
                    _ => {}
                }
                Ok(())
            }
            _ => match self.leaving() {
                (1, beyond) if open => {
                    self.close()?;
                    if !beyond {
                        self.zeros.push((ExactGuard::Separation, 1));
                    }
                    Ok(())
                }
                (1, _) => Ok(()),
                (_, beyond) if !open => {
                    self.open()?;
                    if !beyond {
                        self.zeros.push((ExactGuard::Contact, 1));
                    }
                    Ok(())
                }
                _ => Ok(()),
            },
        }
    }

    /// Sign with which a given force leaves zero, and whether it stands beyond zero already.
    fn leaving(&self) -> (i8, bool) {
        let Some(course) = self.model.force else {
            return (0, false);
        };
        let course = &self.courses[course];
        let mut series = course.series(&self.time, &self.model.table);
        series.extend(LEADING, &self.model.table.reciprocals);
        let c = &series.coefficients;
        let size = course.size().log2() - Float::<N>::BITS as f64 + 16.0;
        let instant = INSTANT.log2();
        let moved = (c[1].log2() + instant).max(c[2].log2() + 2.0 * instant).max(size);
        if c[0].log2() > moved {
            return (c[0].signum(), true);
        }
        let slopes = &c[1..];
        let largest = slopes.iter().map(Float::log2).fold(f64::NEG_INFINITY, f64::max);
        let least = largest - Float::<N>::BITS as f64 / 2.0;
        let leading = slopes.iter().find(|c| !c.is_zero() && c.log2() > least);
        (leading.map_or(0, Float::signum), false)
    }

    fn after_jump(&mut self) -> Result<(), OracleError> {
        self.forget_speed();
        self.find_piece();
        match self.mode {
            Mode::Separated => Ok(()),
            Mode::Stick => match self.sign() {
                0 => Ok(()),
                sign => {
                    self.mode = slip(sign);
                    self.record(EventKind::Slip)
                }
            },
            Mode::SlipForward | Mode::SlipBackward | Mode::Engaged => self.turned(),
        }
    }

    fn forget_speed(&mut self) {
        self.zeros.retain(|(guard, _)| {
            matches!(
                guard,
                ExactGuard::Separation | ExactGuard::Contact | ExactGuard::Breakaway(_)
            )
        });
    }

    fn turned(&mut self) -> Result<(), OracleError> {
        if self.mode == Mode::Engaged {
            self.find_sense();
            let speed = self.speed();
            if let Some((threshold, above)) = self.threshold
                && (speed > threshold) != above
            {
                return self.cross_threshold();
            }
            return Ok(());
        }
        let sign = self.sign();
        if sign == 0 {
            self.stop()
        } else if sign != self.mode.sense() {
            self.mode = slip(sign);
            self.record(EventKind::Reversal)
        } else {
            Ok(())
        }
    }

    fn cross_threshold(&mut self) -> Result<(), OracleError> {
        let Some((_, above)) = &mut self.threshold else {
            return Ok(());
        };
        *above = !*above;
        let kind = if *above { EventKind::Slip } else { EventKind::Stick };
        self.record(kind)
    }

    fn close(&mut self) -> Result<(), OracleError> {
        self.enter_contact();
        self.find_piece();
        let speed = self.speed();
        if let Some((threshold, above)) = &mut self.threshold {
            *above = speed > *threshold;
        }
        self.record(EventKind::Contact)
    }

    fn open(&mut self) -> Result<(), OracleError> {
        self.mode = Mode::Separated;
        self.state.deflection = Float::zero();
        self.record(EventKind::Separation)
    }

    fn kick(&mut self, kick: &ExactKick<N>) -> Result<(), OracleError> {
        let [rotor, stator] = self.model.shares;
        let delta = &kick.delta;
        if self.mode == Mode::Stick {
            // Both surfaces share the momentum of one side, or a rigid surface takes it all.
            let change = match kick.on {
                KickSide::Both => Float::zero(),
                KickSide::Rotor if self.model.chains[ROTOR].is_rigid() => Float::zero(),
                KickSide::Stator if self.model.chains[STATOR].is_rigid() => Float::zero(),
                KickSide::Rotor => delta * &stator,
                KickSide::Stator => -&(delta * &rotor),
            };
            if !self.model.chains.iter().any(|chain| chain.is_rigid()) {
                self.push(ROTOR, &change);
                self.push(STATOR, &change);
            }
            return self.record(EventKind::Kick);
        }
        match kick.on {
            KickSide::Both => self.jump(delta),
            KickSide::Rotor => self.push(ROTOR, delta),
            KickSide::Stator => self.push(STATOR, &-delta),
        }
        self.forget_speed();
        self.find_piece();
        self.record(EventKind::Kick)?;
        if self.mode == Mode::Separated {
            return Ok(());
        }
        self.turned()
    }

    fn change_stability(&mut self) -> Result<(), OracleError> {
        if self.watch == ExactMarginWatch::Unstable {
            self.watch = ExactMarginWatch::Stable;
            return self.record(EventKind::Restabilised);
        }
        self.watch = ExactMarginWatch::Unstable;
        self.record(EventKind::Destabilised)?;
        for kick in std::mem::take(&mut self.waiting) {
            self.kick(&kick)?;
        }
        Ok(())
    }

    fn stop(&mut self) -> Result<(), OracleError> {
        self.join();
        self.piece = 0;
        let mode = self.settled();
        self.zeros.retain(|(guard, _)| *guard != ExactGuard::Stop);
        if mode != Mode::Stick {
            self.zeros.push((ExactGuard::Stop, 1));
        }
        if mode == self.mode {
            return Ok(());
        }
        self.enter(mode);
        self.record(if mode == Mode::Stick {
            EventKind::Stick
        } else {
            EventKind::Reversal
        })
    }

    fn step(&mut self) -> Result<(), OracleError> {
        let sliding = matches!(self.mode, Mode::SlipForward | Mode::SlipBackward | Mode::Engaged);
        if sliding && self.ends && self.piece == self.knots.len() {
            return Err(OracleError::BeyondLaw(self.time.to_f64()));
        }
        let mut until = self.end;
        if let Some(corner) = self.corners.front() {
            until = least(until, Float::from_rational(corner));
        }
        if let Some((time, _)) = self.kicks.front() {
            until = least(until, *time);
        }
        let limit = &until - &self.time;
        if limit.signum() <= 0 {
            return Ok(());
        }
        let mut expansion = self.expansion(self.regime(), 0);
        let step = steps::longest(&limit, self.bits, |order| {
            expansion.extend(&self.model, order);
            steps::log_step(expansion.deciding(&self.scales), self.bits)
        });
        let resolved = step.log2() > self.time.log2() - self.bits as f64 + 8.0;
        if !resolved && step < limit {
            return Err(OracleError::StepVanishes(self.time.to_f64()));
        }
        self.steps += 1;
        let fired = self.first_guard(&expansion, &step, &until)?;
        let reached = fired.as_ref().map_or(&step, |fired| &fired.after);
        while let Some(due) = self.samples_due.front().map(|due| due - &self.time) {
            if due > *reached {
                break;
            }
            let time = &self.time + &due;
            let reading = self.reading(&expansion.at(&due), Some((&expansion, &due)));
            self.samples.push(((&time).into(), reading));
            self.samples_due.pop_front();
        }
        self.state = expansion.at(reached);
        if self.bits < Float::<N>::BITS {
            self.state.cut(self.bits - ROUNDED_BITS);
        }
        if self.state.is_lost() {
            return Err(OracleError::StepVanishes(self.time.to_f64()));
        }
        self.time = match &fired {
            None if step >= limit => until,
            _ => &self.time + reached,
        };
        // A guard that fires at once is still at the knot, which stays among the zeros.
        let at_knot = reached.is_zero();
        self.zeros
            .retain(|(guard, _)| at_knot && matches!(guard, ExactGuard::Knot(_)));
        match fired {
            Some(fired) => self.transition(&fired),
            None => Ok(()),
        }
    }

    fn transition(&mut self, fired: &FiredGuard<N>) -> Result<(), OracleError> {
        let at_once = fired.after.is_zero();
        let mut crossed = |guard: ExactGuard| {
            if !at_once {
                self.zeros.push((guard, 1));
            }
        };
        match fired.guard {
            ExactGuard::Stop => self.stop(),
            ExactGuard::Sense => {
                self.sense = -self.sense;
                self.piece = 0;
                if !at_once || fired.known > 0 {
                    self.zeros.push((ExactGuard::Sense, 1));
                }
                Ok(())
            }
            ExactGuard::Knot(side) => {
                self.piece = if side > 0 { self.piece + 1 } else { self.piece - 1 };
                crossed(ExactGuard::Knot(-side));
                Ok(())
            }
            ExactGuard::Stability => {
                crossed(ExactGuard::Stability);
                self.change_stability()
            }
            ExactGuard::Threshold => {
                crossed(ExactGuard::Threshold);
                self.cross_threshold()
            }
            ExactGuard::Breakaway(sense) => {
                // Removes the rounding of the stick, so that omega_r is exactly zero.
                self.join();
                self.mode = slip(sense);
                self.piece = 0;
                // A torque beyond its limit accelerates the surfaces at once.
                let zeros = if fired.beyond { 1 } else { self.take_off_zeros };
                self.zeros.push((ExactGuard::Stop, zeros));
                self.record(EventKind::Slip)
            }
            ExactGuard::Separation => {
                self.open()?;
                if !fired.beyond {
                    self.zeros.push((ExactGuard::Contact, 1));
                }
                Ok(())
            }
            ExactGuard::Contact => {
                self.close()?;
                // Not if the force stood beyond zero already.
                if !at_once {
                    self.zeros.push((ExactGuard::Separation, 1));
                }
                Ok(())
            }
        }
    }
}

fn magnitude<const N: usize>(value: &Float<N>) -> Float<N> {
    if value.signum() < 0 { -value } else { *value }
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
