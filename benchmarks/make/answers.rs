//! The answers of a problem: what the oracle says with two lengths of its numbers.

use crate::Outcome;
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use std::ops::ControlFlow;
use stickslip::case::{Case, CaseSource, ExactCase};
use stickslip::compare::benchmark::{Combination, Extreme, Problem, ProblemSet, SummaryOf};
use stickslip::model::{Mode, nearest_double};
use stickslip::oracle::{self, OracleOptions, OracleReport, OracleState};
use stickslip::record::EventKind;

/// Significant digits of an event's time, of a state, and of a number of the summary.
pub const TIME_DIGITS: usize = 25;
pub const STATE_DIGITS: usize = 17;
pub const SUMMARY_DIGITS: usize = 20;

/// Digits that the solutions compute with, one after the other.
const DIGITS: [u32; 6] = [33, 52, 71, 110, 187, 302];

/// Times that are nearer to each other are the same, s.
const AT_ONCE: f64 = 1e-24;

/// Times by which the place of an extremum is improved.
const IMPROVEMENTS: usize = 8;

/// The answers of a problem, not yet rounded.
pub struct Answers {
    pub case: Case,
    pub events: Vec<AnswerEvent>,
    /// At each time of the grid.
    pub samples: Vec<(BigRational, Vec<BigRational>)>,
    /// As the problem lists them, each with the digits that are certain.
    pub summary: Vec<(BigRational, usize)>,
    /// Digits that the two solutions were computed with.
    pub digits: [u32; 2],
    /// Of each column the power of ten of its last digit.
    pub last_digit: Vec<i32>,
    /// The relative velocity is not zero right after t = 0.
    pub starts_in_slip: bool,
}

pub struct AnswerEvent {
    /// s.
    pub time: BigRational,
    pub kind: EventKind,
    /// How far the time as it is written can be off, s.
    pub uncertainty: f64,
    /// The columns right after it.
    pub state: Vec<BigRational>,
}

/// One solution: events and the states at some times.
struct Solution {
    events: Vec<(BigRational, EventKind, Vec<BigRational>)>,
    samples: Vec<(BigRational, Vec<BigRational>)>,
}

impl Answers {
    pub fn of(set: &ProblemSet, problem: &Problem) -> Outcome<Answers> {
        let source = CaseSource::file(&set.case_of(problem))?;
        let (case, exact) = (Case::read(&source, &[])?, Case::exact(&source, &[])?);
        let end = decimal(case.output.end_time)?;
        let solve =
            |digits: u32, end: &BigRational, times: &[BigRational]| Solution::of(problem, &exact, (digits, end), times);
        let (solution, [shorter, digits], last_digit) =
            settled(problem, &|digits| solve(digits, &end, &grid(problem)?))?;
        let event = |(time, kind, state): &(BigRational, EventKind, Vec<BigRational>)| AnswerEvent {
            uncertainty: 0.5 * 10f64.powi(exponent(time) + 1 - TIME_DIGITS as i32),
            time: time.clone(),
            kind: *kind,
            state: state.clone(),
        };
        let events: Vec<AnswerEvent> = solution.events.iter().map(event).collect();
        let summary = problem.summary.iter().map(|summary| match &summary.of {
            SummaryOf::Events { first, last, count } => {
                let time = |index: i64| match usize::try_from(index) {
                    Err(_) => Ok(BigRational::zero()),
                    Ok(index) => {
                        let event: &AnswerEvent = events.get(index).ok_or("an event that there is not")?;
                        Outcome::Ok(event.time.clone())
                    }
                };
                let value = (time(*last)? - time(*first)?) / BigRational::from_integer((*count).into());
                Ok((value, SUMMARY_DIGITS))
            }
            SummaryOf::Samples { column, time } => {
                let (column, time) = (problem.column(column).ok_or("no such column")?, decimal(*time)?);
                let sample = solution.samples.iter().find(|(at, _)| *at == time);
                let value = sample.ok_or("a time that is none of the grid")?.1[column].clone();
                Ok(with_digits(value, last_digit[column]))
            }
            SummaryOf::Extremum {
                column,
                rate,
                what,
                between,
            } => {
                let column = problem.column(column).ok_or("no such column")?;
                let rate = |state: &[BigRational]| combined(problem, rate, state);
                let [from, to] = [decimal(between[0])?, decimal(between[1])?];
                let solve = |time: BigRational| solve(digits, &to, &[time]);
                extremum(column, &rate, *what, [&from, &to], &solution, &solve)
                    .map(|value| with_digits(value, last_digit[column]))
                    .map_err(|error| format!("{}: {error}", summary.name).into())
            }
        });
        let summary = summary.collect::<Outcome<Vec<(BigRational, usize)>>>()?;
        // Between t = 0 and what comes first, an event or the second time of the grid.
        let first = solution.events.first().map(|event| &event.0);
        let early = first
            .into_iter()
            .chain(solution.samples.get(1).map(|sample| &sample.0))
            .min();
        let early = early.ok_or("a grid of one time")? / BigRational::from_integer(2.into());
        let state = solve(digits, &early, std::slice::from_ref(&early))?;
        Ok(Answers {
            starts_in_slip: combined(problem, &problem.relative_velocity, &state.samples[0].1).abs() > case.threshold,
            digits: [shorter, digits],
            case,
            events,
            samples: solution.samples,
            summary,
            last_digit,
        })
    }
}

/// A state's value with its digits down to the last one that is written of its column; a zero is exact.
fn with_digits(value: BigRational, last_digit: i32) -> (BigRational, usize) {
    let digits = match value.is_zero() {
        true => STATE_DIGITS,
        false => usize::try_from(exponent(&value) + 1 - last_digit).unwrap_or(0),
    };
    (value, digits)
}

/// The first solution that agrees with the next shorter one in all digits that are written; the digits that the two were computed
/// with, and the last digit of each column.
fn settled(problem: &Problem, solve: &dyn Fn(u32) -> Outcome<Solution>) -> Outcome<(Solution, [u32; 2], Vec<i32>)> {
    let [first, rest @ ..] = DIGITS;
    let (mut coarse, mut shorter) = (solve(first), first);
    for digits in rest {
        let fine = solve(digits);
        let fine = match (coarse, fine) {
            (Ok(coarse), Ok(fine)) => {
                let last_digit = last_digits(problem, &fine);
                if agree(&coarse, &fine, &last_digit) {
                    return Ok((fine, [shorter, digits], last_digit));
                }
                Ok(fine)
            }
            (_, fine) => fine,
        };
        (coarse, shorter) = (fine, digits);
    }
    Err(match coarse {
        Err(error) => error,
        Ok(_) => "no two solutions agree".into(),
    })
}

/// A sum of columns.
fn combined(problem: &Problem, sum: &Combination, state: &[BigRational]) -> f64 {
    let parts = sum.iter().map(|(name, factor)| match problem.column(name) {
        Some(column) => factor * nearest_double(&state[column]),
        None => *factor,
    });
    parts.sum()
}

impl Solution {
    fn of(
        problem: &Problem,
        exact: &ExactCase,
        (digits, end): (u32, &BigRational),
        times: &[BigRational],
    ) -> Outcome<Solution> {
        let options = OracleOptions {
            digits,
            end_time: end.clone(),
            sample_times: times.to_vec(),
            threshold: exact.threshold.clone(),
            stability: false,
            ..OracleOptions::default()
        };
        let report = oracle::run(&exact.system, &options, &mut |_| ControlFlow::Continue(()))?;
        let events = events(problem, &report)?;
        // At the time of an event, a kick above all, it is the state right after it.
        let of_events = report.events.iter().map(|event| event.time.to_rational());
        let of_events = of_events
            .collect::<Option<Vec<_>>>()
            .ok_or("a time that is no number")?;
        let state = |(time, (_, state)): (&BigRational, &(_, OracleState))| {
            let is_now = |event: &BigRational| nearest_double(&(event - time).abs()) < AT_ONCE;
            let event = of_events.iter().rposition(is_now);
            let state = event.map_or(state, |index| &report.events[index].state);
            Ok((time.clone(), columns(problem, state)?))
        };
        let samples = times
            .iter()
            .zip(&report.samples)
            .map(state)
            .collect::<Outcome<Vec<_>>>()?;
        if samples.len() != times.len() {
            return Err("a time of the grid is later than the end".into());
        }
        Ok(Solution { events, samples })
    }
}

/// The events as the set counts them: where the relative velocity becomes, leaves or passes zero after t = 0.
fn events(problem: &Problem, report: &OracleReport) -> Outcome<Vec<(BigRational, EventKind, Vec<BigRational>)>> {
    let mut found = Vec::new();
    let mut sticks = false;
    for event in &report.events {
        let kind = match event.kind {
            kind @ (EventKind::Stick | EventKind::Slip | EventKind::Reversal) => Some(kind),
            // The contact opens under a stick.
            EventKind::Separation if sticks => Some(EventKind::Slip),
            EventKind::Contact if event.mode_after == Mode::Stick => Some(EventKind::Stick),
            _ => None,
        };
        sticks = event.mode_after == Mode::Stick;
        let time = event.time.to_rational().ok_or("a time that is no number")?;
        if let Some(kind) = kind.filter(|_| time.is_positive()) {
            found.push((time, kind, columns(problem, &event.state)?));
        }
    }
    Ok(found)
}

/// The columns of a problem by the oracle's state.
fn columns(problem: &Problem, state: &OracleState) -> Outcome<Vec<BigRational>> {
    let value = |channel: &str| {
        let lists = [
            ("rotor_twist_rate_", &state.rotor_twist_rate),
            ("rotor_twist_", &state.rotor_twist),
            ("rotor_speed_", &state.rotor_speed),
            ("stator_twist_rate_", &state.stator_twist_rate),
            ("stator_twist_", &state.stator_twist),
            ("stator_speed_", &state.stator_speed),
        ];
        let of_list = lists
            .into_iter()
            .find_map(|(prefix, list)| list.get(channel.strip_prefix(prefix)?.parse::<usize>().ok()?));
        let axial = |index: usize| state.axial.as_ref().map(|axial| &axial[index]);
        let number = match channel {
            "relative_velocity" => Some(&state.relative_velocity),
            "rotor_angle" => state.angles[0].as_ref(),
            "stator_angle" => state.angles[1].as_ref(),
            "z" => axial(0),
            "z_dot" => axial(1),
            "deflection" => state.deflection.as_ref(),
            _ => of_list,
        };
        number
            .and_then(oracle::ExactDouble::to_rational)
            .ok_or_else(|| format!("the motion has no {channel}").into())
    };
    problem.columns.iter().map(|column| value(&column.channel)).collect()
}

/// Of each column the power of ten of the last digit that is written of its largest value.
fn last_digits(problem: &Problem, solution: &Solution) -> Vec<i32> {
    let states = || {
        solution
            .samples
            .iter()
            .map(|(_, state)| state)
            .chain(solution.events.iter().map(|event| &event.2))
    };
    let largest = |column: usize| states().map(|state| state[column].abs()).max().unwrap_or_default();
    (0..problem.columns.len())
        .map(|column| match largest(column) {
            zero if zero.is_zero() => -(STATE_DIGITS as i32),
            largest => exponent(&largest) + 1 - STATE_DIGITS as i32,
        })
        .collect()
}

/// Whether two solutions have the same events, and the same digits as far as they are written.
fn agree(coarse: &Solution, fine: &Solution, last_digit: &[i32]) -> bool {
    let near = |a: &BigRational, b: &BigRational, last: i32| nearest_double(&(a - b).abs()) < 0.01 * 10f64.powi(last);
    let same = |a: &[BigRational], b: &[BigRational]| {
        let mut pairs = a.iter().zip(b).zip(last_digit);
        pairs.all(|((a, b), last)| near(a, b, *last))
    };
    let mut events = coarse.events.iter().zip(&fine.events);
    let mut samples = coarse.samples.iter().zip(&fine.samples);
    coarse.events.len() == fine.events.len()
        && events.all(|((a, kind_a, state_a), (b, kind_b, state_b))| {
            kind_a == kind_b && near(a, b, exponent(b) + 1 - TIME_DIGITS as i32) && same(state_a, state_b)
        })
        && samples.all(|(a, b)| same(&a.1, &b.1))
}

/// The extreme value of a column between two times. At an event it is the state there; elsewhere its error is that of the rate's
/// zero, squared.
fn extremum(
    column: usize,
    rate: &dyn Fn(&[BigRational]) -> f64,
    what: Extreme,
    [from, to]: [&BigRational; 2],
    solution: &Solution,
    solve: &dyn Fn(BigRational) -> Outcome<Solution>,
) -> Outcome<BigRational> {
    let samples = &solution.samples;
    let sign = BigRational::from_integer(if what == Extreme::Maximum { 1 } else { -1 }.into());
    let value = |state: &[BigRational]| &sign * &state[column];
    let within = |time: &BigRational| (from..=to).contains(&time);
    let inner = (1..samples.len() - 1).filter(|index| within(&samples[*index].0));
    let top = inner
        .max_by_key(|index| value(&samples[*index].1))
        .ok_or("no sample there")?;
    let scale = samples.iter().map(|sample| rate(&sample.1).abs()).fold(0.0, f64::max);
    let small = 1e-12 * scale;
    let events = solution.events.iter().filter(|event| within(&event.0));
    if let Some((_, _, state)) = events.max_by_key(|event| value(&event.2))
        && value(state) >= value(&samples[top].1)
        && rate(state).abs() <= small
    {
        return Ok(state[column].clone());
    }
    let rate_of = |(time, state): &(BigRational, Vec<BigRational>)| (nearest_double(time), rate(state));
    let (mut a, mut b) = (rate_of(&samples[top - 1]), rate_of(&samples[top + 1]));
    let mut best = samples[top].1[column].clone();
    for _ in 0..IMPROVEMENTS {
        let next = b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1);
        if !next.is_finite() || next == b.0 {
            break;
        }
        let found = solve(BigRational::from_float(next).ok_or("no number")?)?;
        (a, b) = (b, rate_of(&found.samples[0]));
        best = found.samples[0].1[column].clone();
        if b.1.abs() <= small {
            break;
        }
    }
    let is_near = (nearest_double(&samples[top - 1].0)..=nearest_double(&samples[top + 1].0)).contains(&b.0);
    let is_best = &sign * &best >= value(&samples[top].1);
    match b.1.abs() <= small && is_near && is_best {
        true => Ok(best),
        false => Err(format!("the extremum near {} s is not found", b.0).into()),
    }
}

/// The times of the grid, s.
fn grid(problem: &Problem) -> Outcome<Vec<BigRational>> {
    let mut times = Vec::new();
    for [from, to, step] in &problem.grid {
        let [mut time, to, step] = [decimal(*from)?, decimal(*to)?, decimal(*step)?];
        while time <= to {
            times.push(time.clone());
            time += &step;
        }
    }
    Ok(times)
}

/// The decimal that a double is written as.
pub fn decimal(value: f64) -> Outcome<BigRational> {
    oracle::rational(&value.to_string()).ok_or_else(|| format!("{value} is no decimal").into())
}

/// The power of ten of the first digit of a number that is not zero.
pub fn exponent(value: &BigRational) -> i32 {
    let text = oracle::decimal(&value.abs(), 40);
    let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    match mantissa.split_once('.') {
        Some(("0", fraction)) => power - 1 - (fraction.len() - fraction.trim_start_matches('0').len()) as i32,
        Some((whole, _)) => power + whole.len() as i32 - 1,
        None => power + mantissa.len() as i32 - 1,
    }
}
