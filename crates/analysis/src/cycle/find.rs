//! Search for a periodic motion: a guess from a run or from a stated state, then Newton's method.

use super::equations::{Guess, Manifold, What, collapsed, degenerate, motion, solve};
use super::family::{Family, Member};
use super::orbit::Orbit;
use crate::error::{Error, ErrorKind};
use nalgebra::DVector;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{
    Method, OutputOptions, Peak, Shot, SolverOptions, moving_state, stated_start, weights,
};
use stickslip_system::model::Mode;
use stickslip_system::record::{Event, Recorder, RecorderError, Sample};
use stickslip_system::watch::Watch;

/// Largest number of turns, or of periods of the drives, in a period.
pub const LONGEST: usize = 64;

/// Relative distance below which the first return gives the guess. It may also be this multiple of the nearest return.
const NEAR: f64 = 1e-4;
const AS_NEAR: f64 = 4.0;

/// Relative distance at which a motion repeats within its period.
const SAME: f64 = 1e-7;

/// Fraction of the largest speed of the guess below which a varying relative velocity counts as rest.
const AT_REST: f64 = 1e-8;

/// Fraction of the largest relative velocity above which a maximum counts as a turn.
const TURN: f64 = 1e-3;

/// Relative variation of the relative velocity below which sliding is steady.
const STEADY: f64 = 1e-9;

/// Relative variation below which a motion may decay to steady sliding.
const NEARLY_STEADY: f64 = 1e-3;

/// Relative residual at which a motion closes.
const ROUNDING: f64 = 1e-12;

/// Number of extensions of the run by its own length if no cycle is found from its end.
const FURTHER: u32 = 3;

/// Fractions of the run's time in which returns are sought, the shortest first.
const PARTS: [f64; 3] = [1.0 / 16.0, 1.0 / 4.0, 1.0];

/// Start of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum From {
    /// End of the case's run.
    #[default]
    End,
    /// Initial state of the case.
    Initial,
}

/// Options of a search.
#[derive(Debug, Clone, Copy, Default)]
pub struct CycleSearch {
    /// Start.
    pub from: From,
    /// Periods of the drives, or turns of an autonomous motion, in a period; `None` selects the best fit.
    pub periods: Option<u32>,
    /// Period, s; `None` selects the best fit.
    pub period: Option<f64>,
}

/// The last sample of a run. Its events, of which there may be millions, are not kept.
#[derive(Default)]
struct LastState {
    time: f64,
    further: Vec<f64>,
}

impl Recorder for LastState {
    fn stores_motion(&self) -> bool {
        false
    }

    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        self.further.clear();
        self.further.extend_from_slice(values);
        Ok(())
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.time = sample.time;
        Ok(())
    }

    fn event(&mut self, _: &Event) -> Result<(), RecorderError> {
        Ok(())
    }
}

/// Finds a periodic motion of a family at these values of its parameters. An error describes the failed attempts.
pub fn find(family: &Family, values: &[f64], search: &CycleSearch, stop: &dyn Watch) -> Result<Orbit, Error> {
    let member = family.at(values, false)?;
    let (mut time, mut state) = starting_point(family, values, search, stop)?;
    let horizon = family.case().output.end_time;
    let mut further = match search.from {
        From::End => FURTHER,
        From::Initial => 0,
    };
    loop {
        let attempt = (|| {
            let (mut guess, multiple) = match member.period {
                Some(period) => stroboscopic(&member, (time, state.clone()), period, search, stop)?,
                None => autonomous(&member, (time, state.clone()), horizon, search, stop)?,
            };
            guess.values = values.to_vec();
            let guess = in_slip(&member, &guess, stop)?;
            let orbit = closed(family, multiple, &guess, stop)?;
            shortest(family, orbit, multiple, stop)
        })();
        match attempt {
            // A transient may decay after the end of the run.
            Err(error) if further > 0 && matches!(error.kind, ErrorKind::Diverged(_) | ErrorKind::NoCycle) => {
                further -= 1;
                state = motion(&member, (time, &state), horizon, false, stop)?.end;
                time += horizon;
            }
            Err(error)
                if matches!(error.kind, ErrorKind::Diverged(_))
                    && search.from == From::End
                    && decays(&member, (time, &state), horizon, stop)? =>
            {
                return Err(Error::computation(format!(
                    "the motion decays to steady sliding: after t = {time:.6} s the relative velocity varies by less and less. No cycle \
                     attracts it; for an unstable one start from a state beside that (--from initial, with [initial] there)"
                )));
            }
            other => return other,
        }
    }
}

/// Whether a motion decays to steady sliding: omega_r hardly varies, and less in the second half of the time.
fn decays(member: &Member, (time, state): (f64, &DVector<f64>), horizon: f64, stop: &dyn Watch) -> Result<bool, Error> {
    let half = horizon / 2.0;
    let swing = |shot: &Shot| shot.relative_velocity.1 - shot.relative_velocity.0;
    let first = motion(member, (time, state), half, true, stop)?;
    let second = motion(member, (time + half, &first.end), half, true, stop)?;
    let (least, largest) = first.relative_velocity;
    let nearly_steady = member.period.is_none() && swing(&first) < NEARLY_STEADY * least.abs().min(largest.abs());
    Ok(nearly_steady && swing(&second) < 0.9 * swing(&first))
}

fn starting_point(
    family: &Family,
    values: &[f64],
    search: &CycleSearch,
    stop: &dyn Watch,
) -> Result<(f64, DVector<f64>), Error> {
    let case = family.case_at(values)?;
    if search.from == From::Initial {
        return Ok((0.0, stated_start(&family.at(values, false)?.system)));
    }
    let solver = SolverOptions {
        method: Method::Series,
        max_step: None,
        fixed_step: None,
        max_steps: None,
        ..case.solver.clone()
    };
    let output = OutputOptions::at_the_ends(case.output.end_time);
    let mut last = LastState::default();
    let run = Run::of_system(&case.system, case.threshold, &solver, &output);
    let report = run.record(&mut last).watch(stop).start();
    let report =
        report.map_err(|failure| Error::computation(format!("the motion could not be followed: {failure}")))?;
    if report.interrupted {
        return Err(Error::interrupted());
    }
    Ok((last.time, moving_state(&case.system, &last.further)))
}

pub(crate) fn apart(a: &DVector<f64>, b: &DVector<f64>, sizes: &[f64]) -> f64 {
    let pairs = a.iter().zip(b.iter()).zip(sizes);
    pairs
        .map(|((a, b), size)| if *size > 0.0 { (a - b).abs() / size } else { 0.0 })
        .fold(0.0, f64::max)
}

fn first_near(distances: &[f64]) -> usize {
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    let bound = NEAR.max(AS_NEAR * least);
    distances.iter().position(|distance| *distance <= bound).unwrap_or(0) + 1
}

fn stroboscopic(
    member: &Member,
    (time, state): (f64, DVector<f64>),
    period: f64,
    search: &CycleSearch,
    stop: &dyn Watch,
) -> Result<(Guess, u32), Error> {
    let guess = |multiple: u32| Guess {
        time,
        state: state.clone(),
        period: f64::from(multiple) * period,
        values: Vec::new(),
    };
    let asked = search
        .periods
        .or(search.period.map(|asked| (asked / period).round().max(1.0) as u32));
    if let Some(multiple) = asked {
        return Ok((guess(multiple), multiple));
    }
    let (mut distances, mut now) = (Vec::new(), state.clone());
    let mut sizes = vec![0.0f64; state.len()];
    for k in 0..LONGEST {
        let shot = motion(member, (time + k as f64 * period, &now), period, false, stop)?;
        for (size, other) in sizes.iter_mut().zip(&shot.sizes) {
            *size = size.max(*other);
        }
        now = shot.end;
        distances.push(apart(&now, &state, &sizes));
        if distances[k] <= NEAR {
            break;
        }
    }
    let multiple = first_near(&distances) as u32;
    Ok((guess(multiple), multiple))
}

/// Maxima of |omega_r| that count as turns, without ringing after a slip and without rounding in steady sliding.
fn turns(shot: &Shot) -> impl Iterator<Item = &Peak> {
    let (least, largest) = shot.relative_velocity;
    let size = least.abs().max(largest.abs());
    let swings = largest - least > STEADY * size;
    let is_turn = move |peak: &&Peak| swings && peak.relative_velocity.abs() >= TURN * size;
    shot.peaks.iter().filter(is_turn)
}

fn autonomous(
    member: &Member,
    (time, state): (f64, DVector<f64>),
    horizon: f64,
    search: &CycleSearch,
    stop: &dyn Watch,
) -> Result<(Guess, u32), Error> {
    let look = |span: f64| motion(member, (time, &state), span, true, stop);
    let is_enough =
        |span: f64, shot: &Shot| turns(shot).count() > 2 && search.period.is_none_or(|period| span > 2.0 * period);
    let (mut span, mut shot) = (horizon * PARTS[0], look(horizon * PARTS[0])?);
    for part in &PARTS[1..] {
        if !is_enough(span, &shot) {
            (span, shot) = (horizon * part, look(horizon * part)?);
        }
    }
    let peaks: Vec<&Peak> = turns(&shot).collect();
    if peaks.len() < 2 {
        let sticks = shot.phases.iter().all(|phase| phase.mode == Mode::Stick);
        if sticks {
            return Err(sticking(time, span));
        }
        let message = format!(
            "the section was never crossed: the relative velocity has {found} maxima within {span:.6} s after t = {time:.6} s, and \
             two are needed. The motion has come to rest or to steady sliding; start from a state beside it (--from initial, with \
             [initial] at the cycle), or let it run longer (output.end_time)",
            found = peaks.len()
        );
        return Err(Error::new(ErrorKind::NoCycle, message));
    }
    // The motion is nearest to an unstable cycle at first, and nearest to a stable cycle at last.
    let ordered: Vec<&Peak> = match search.from {
        From::Initial => peaks.clone(),
        From::End => peaks.iter().rev().copied().collect(),
    };
    let first = ordered[0];
    let returns: Vec<&&Peak> = ordered[1..].iter().take(LONGEST).collect();
    let distance = |peak: &&&Peak| apart(&peak.state, &first.state, &shot.sizes);
    let turns = match (search.periods, search.period) {
        (Some(asked), _) => (asked as usize).min(returns.len()),
        (None, Some(period)) => {
            let off = |peak: &&Peak| ((peak.time - first.time).abs() - period).abs();
            let best = returns.iter().enumerate().min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
            best.map_or(1, |best| best.0 + 1)
        }
        (None, None) => first_near(&returns.iter().map(distance).collect::<Vec<f64>>()),
    };
    let other = returns[turns - 1];
    let begins = if first.time < other.time { first } else { *other };
    let guess = Guess {
        time: 0.0,
        state: begins.state.clone(),
        period: (first.time - other.time).abs(),
        values: Vec::new(),
    };
    Ok((guess, 1))
}

/// Moves the guess to the middle of its longest slip, away from all events.
pub(crate) fn in_slip(member: &Member, guess: &Guess, stop: &dyn Watch) -> Result<Guess, Error> {
    let shift = to_slip(member, guess, stop)?;
    let state = motion(member, (guess.time, &guess.state), shift, false, stop)?.end;
    Ok(Guess {
        time: later(member, guess, shift),
        state,
        ..guess.clone()
    })
}

/// Time from the start of a motion to the middle of its longest slip, s. A slip across the period's ends is joined.
pub(crate) fn to_slip(member: &Member, guess: &Guess, stop: &dyn Watch) -> Result<f64, Error> {
    let shot = motion(member, (guess.time, &guess.state), guess.period, false, stop)?;
    let slips = shot.phases.iter().filter(|phase| phase.mode.slides());
    let mut slips: Vec<(f64, f64)> = slips.map(|phase| (phase.from, phase.to)).collect();
    if let (Some(first), Some(last), true) = (shot.phases.first(), shot.phases.last(), shot.phases.len() > 1)
        && first.mode == last.mode
        && first.mode.slides()
    {
        let whole = (last.from - guess.period, first.to);
        slips.pop();
        slips[0] = whole;
    }
    let longest = slips.into_iter().max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)));
    match longest {
        Some((from, to)) => Ok((0.5 * (from + to) - guess.time).rem_euclid(guess.period)),
        None => Err(sticking(guess.time, guess.period)),
    }
}

fn sticking(from: f64, time: f64) -> Error {
    let message = format!(
        "the contact sticks from {from:.6} s on, over {time:.6} s: the motion has no slip, and no cycle to look for. Start from a \
         state that slips ([initial] and --from initial), or drive it harder"
    );
    Error::new(ErrorKind::NoCycle, message)
}

/// Phase of the drives after a time shift, s.
pub(crate) fn later(member: &Member, guess: &Guess, shift: f64) -> f64 {
    match member.period {
        Some(period) => (guess.time + shift).rem_euclid(period),
        None => 0.0,
    }
}

/// Finds a periodic motion by Newton's method, if it converges. The start is a point: time (s, phase of the drives),
/// state, and period (s). `multiple`: periods of the drives in the motion, 1 for an autonomous system.
pub fn refine(
    family: &Family,
    values: &[f64],
    multiple: u32,
    (time, state, period): (f64, &[f64], f64),
    stop: &dyn Watch,
) -> Result<Orbit, Error> {
    let guess = Guess {
        time,
        state: DVector::from_column_slice(state),
        period,
        values: values.to_vec(),
    };
    closed(family, multiple, &guess, stop)
}

pub(crate) fn closed(family: &Family, multiple: u32, guess: &Guess, stop: &dyn Watch) -> Result<Orbit, Error> {
    let scale = |value: &f64| if *value == 0.0 { 1.0 } else { value.abs() };
    let manifold = Manifold {
        family,
        what: What::Cycles(multiple),
        widths: &guess.values.iter().map(scale).collect::<Vec<f64>>(),
        stop,
    };
    let mut local = manifold.local(guess)?;
    let (start, held) = (local.unknowns(guess), local.held());
    let solution = solve(&mut local, &start, &held, guess.period).map_err(|error| match error.kind {
        ErrorKind::Diverged(residual) if residual <= ROUNDING => degenerate(guess.period),
        _ => error,
    })?;
    let found = local.guess(&solution.x)?;
    let mut orbit = Orbit::describe(family, &found, (solution.error, solution.iterations), stop)?;
    orbit.multiple = (!family.is_autonomous()).then_some(multiple);
    let (least, largest) = orbit.relative_velocity;
    let weights = weights(&family.at(&guess.values, false)?.system);
    let size = local.sizes.iter().zip(&weights).map(|(size, weight)| size * weight);
    let size = size.fold(0.0, f64::max);
    let steady = family.is_autonomous() && largest - least <= STEADY * least.abs().max(largest.abs());
    if steady || largest - least <= AT_REST * size {
        return Err(collapsed(guess.period));
    }
    Ok(orbit)
}

fn shortest(family: &Family, orbit: Orbit, multiple: u32, stop: &dyn Watch) -> Result<Orbit, Error> {
    let member = family.at(&orbit.values, false)?;
    let most = match orbit.multiple {
        Some(multiple) => multiple as usize,
        None => LONGEST,
    };
    for parts in (2..=most).rev() {
        let divides = |multiple: u32| (multiple as usize).is_multiple_of(parts);
        if !orbit.multiple.is_none_or(divides) {
            continue;
        }
        let guess = orbit.guess();
        let part = guess.period / parts as f64;
        let shot = motion(&member, (guess.time, &guess.state), part, false, stop)?;
        if apart(&shot.end, &guess.state, &orbit.sizes) > SAME {
            continue;
        }
        let shorter = Guess { period: part, ..guess };
        let multiple = multiple / orbit.multiple.map_or(1, |_| parts as u32);
        return closed(family, multiple, &shorter, stop);
    }
    Ok(orbit)
}
