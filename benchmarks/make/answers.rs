//! The answers of a problem: what the oracle says with two lengths of its numbers.

use crate::Outcome;
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use std::ops::ControlFlow;
use stickslip::case::{Case, CaseSource, ExactCase};
use stickslip::compare::benchmark::{Extreme, Problem, ProblemSet, SummaryOf};
use stickslip::model::{Mode, nearest_double};
use stickslip::oracle::{self, OracleOptions, OracleReport, OracleRequest, OracleState};
use stickslip::record::EventKind;

/// Significant digits of an event's time, of a state, and of a number of the summary.
pub const TIME_DIGITS: usize = 25;
pub const STATE_DIGITS: usize = 17;
pub const SUMMARY_DIGITS: usize = 20;

/// Times by which the place of an extremum is improved.
const IMPROVEMENTS: usize = 8;

/// The answers of a problem, each rounded to its last digit by who writes it.
pub struct Answers {
    pub case: Case,
    pub events: Vec<AnswerEvent>,
    /// At each time of the grid.
    pub samples: Vec<(BigRational, Vec<BigRational>)>,
    /// As the problem lists them.
    pub summary: Vec<BigRational>,
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
        let request = OracleRequest {
            digits: TIME_DIGITS as u32 + 1,
            threshold: exact.threshold.clone(),
            end_time: decimal(case.output.end_time)?,
            stability: false,
            ..OracleRequest::default()
        };
        let solved = oracle::solve(&exact.system, &request, &mut |_| ControlFlow::Continue(()))?;
        let grid = grid(problem)?;
        // With more digits than the events need, and with more again.
        let digits = [solved.digits_computed, solved.digits_computed + 1];
        let [coarse, fine] = digits.map(|digits| Solution::of(problem, &exact, &request, digits, &grid));
        let (coarse, fine) = (coarse?, fine?);
        let last_digit = last_digits(problem, &fine);
        agree(&coarse, &fine, &last_digit)?;
        let largest = solved.errors.iter().fold(0.0, |largest: f64, error| largest.max(*error));
        let event = |(time, kind, state): (BigRational, EventKind, Vec<BigRational>)| AnswerEvent {
            // Half a unit of the last digit that is written.
            uncertainty: largest.max(0.5 * 10f64.powi(exponent(&time) + 1 - TIME_DIGITS as i32)),
            time,
            kind,
            state,
        };
        let events: Vec<AnswerEvent> = fine.events.into_iter().map(event).collect();
        let summary = problem.summary.iter().map(|summary| match &summary.of {
            SummaryOf::Events { first, last, count } => {
                let time = |index: i64| match usize::try_from(index) {
                    Err(_) => Ok(BigRational::zero()),
                    Ok(index) => {
                        let event: &AnswerEvent = events.get(index).ok_or("an event that there is not")?;
                        Outcome::Ok(event.time.clone())
                    }
                };
                Ok((time(*last)? - time(*first)?) / BigRational::from_integer((*count).into()))
            }
            SummaryOf::Samples { column, time } => {
                let (column, time) = (problem.column(column).ok_or("no such column")?, decimal(*time)?);
                let sample = fine.samples.iter().find(|(at, _)| *at == time);
                Ok(sample.ok_or("a time that is none of the grid")?.1[column].clone())
            }
            SummaryOf::Extremum { column, rate, what, between } => {
                let columns = [column, rate].map(|name| problem.column(name).ok_or("no such column"));
                let [column, rate] = columns;
                let solve = |times: &[BigRational]| Solution::of(problem, &exact, &request, digits[0], times);
                extremum([column?, rate?], *what, *between, &fine.samples, &solve)
            }
        });
        let summary = summary.collect::<Outcome<Vec<BigRational>>>()?;
        let first_slip = events.first().is_some_and(|event| event.kind == EventKind::Slip);
        let relative = |state: &[BigRational]| -> f64 {
            let parts = problem.relative_velocity.iter().map(|(name, factor)| match problem.column(name) {
                Some(column) => factor * nearest_double(&state[column]),
                None => *factor,
            });
            parts.sum()
        };
        let starts_in_slip = !first_slip && fine.samples.get(1).is_some_and(|(_, state)| relative(state) != 0.0);
        Ok(Answers {
            case,
            events,
            samples: fine.samples,
            summary,
            last_digit,
            starts_in_slip,
        })
    }
}

impl Solution {
    fn of(
        problem: &Problem,
        exact: &ExactCase,
        request: &OracleRequest,
        digits: u32,
        times: &[BigRational],
    ) -> Outcome<Solution> {
        let options = OracleOptions {
            digits,
            end_time: request.end_time.clone(),
            sample_times: times.to_vec(),
            max_events: request.max_events,
            threshold: request.threshold.clone(),
            stability: request.stability,
        };
        let report = oracle::run(&exact.system, &options, &mut |_| ControlFlow::Continue(()))?;
        let events = events(problem, &report)?;
        let state = |(time, (_, state)): (&BigRational, &(_, OracleState))| Ok((time.clone(), columns(problem, state)?));
        let samples = times.iter().zip(&report.samples).map(state).collect::<Outcome<Vec<_>>>()?;
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
        let of_list = lists.into_iter().find_map(|(prefix, list)| list.get(channel.strip_prefix(prefix)?.parse::<usize>().ok()?));
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
            .and_then(oracle::Number::to_rational)
            .ok_or_else(|| format!("the motion has no {channel}").into())
    };
    problem.columns.iter().map(|column| value(&column.channel)).collect()
}

/// Of each column the power of ten of the last digit that is written of its largest value.
fn last_digits(problem: &Problem, solution: &Solution) -> Vec<i32> {
    let states = || solution.samples.iter().map(|(_, state)| state).chain(solution.events.iter().map(|event| &event.2));
    let largest = |column: usize| states().map(|state| state[column].abs()).max().unwrap_or_default();
    (0..problem.columns.len())
        .map(|column| match largest(column) {
            zero if zero.is_zero() => -(STATE_DIGITS as i32),
            largest => exponent(&largest) + 1 - STATE_DIGITS as i32,
        })
        .collect()
}

/// Whether two solutions have the same events, and all that is written of them.
fn agree(coarse: &Solution, fine: &Solution, last_digit: &[i32]) -> Outcome<()> {
    let same_state = |a: &[BigRational], b: &[BigRational]| {
        let pairs = a.iter().zip(b).zip(last_digit);
        pairs.fold(true, |same, ((a, b), last)| {
            same && nearest_double(&(a - b).abs()) < 0.01 * 10f64.powi(*last)
        })
    };
    if coarse.events.len() != fine.events.len() {
        return Err("the two precisions have different events".into());
    }
    for ((a, kind_a, state_a), (b, kind_b, state_b)) in coarse.events.iter().zip(&fine.events) {
        let distance = nearest_double(&(a - b).abs());
        if kind_a != kind_b || distance > 0.01 * 10f64.powi(exponent(b) + 1 - TIME_DIGITS as i32) {
            return Err(format!("the {} at {} s is not settled", kind_b.name(), nearest_double(b)).into());
        }
        if !same_state(state_a, state_b) {
            return Err(format!("the state at the event at {} s is not settled", nearest_double(b)).into());
        }
    }
    for ((time, a), (_, b)) in coarse.samples.iter().zip(&fine.samples) {
        if !same_state(a, b) {
            return Err(format!("the state at {} s is not settled", nearest_double(time)).into());
        }
    }
    Ok(())
}

/// The extreme value of a column between two times. Its error is that of the rate's zero, squared.
fn extremum(
    [column, rate]: [usize; 2],
    what: Extreme,
    [from, to]: [f64; 2],
    samples: &[(BigRational, Vec<BigRational>)],
    solve: &dyn Fn(&[BigRational]) -> Outcome<Solution>,
) -> Outcome<BigRational> {
    let sign = if what == Extreme::Maximum { 1.0 } else { -1.0 };
    let [from, to] = [decimal(from)?, decimal(to)?];
    let value = |index: &usize| sign * nearest_double(&samples[*index].1[column]);
    let within = (1..samples.len() - 1).filter(|index| (&from..=&to).contains(&&samples[*index].0));
    let top = within.max_by(|a, b| value(a).total_cmp(&value(b))).ok_or("no sample there")?;
    let rate_of = |(time, state): &(BigRational, Vec<BigRational>)| (nearest_double(time), nearest_double(&state[rate]));
    let (mut a, mut b) = (rate_of(&samples[top - 1]), rate_of(&samples[top + 1]));
    let mut best = samples[top].1[column].clone();
    for _ in 0..IMPROVEMENTS {
        let next = b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1);
        if !next.is_finite() || next == b.0 {
            break;
        }
        let time = BigRational::from_float(next).ok_or("no number")?;
        let solution = solve(&[time])?;
        (a, b) = (b, rate_of(&solution.samples[0]));
        best = solution.samples[0].1[column].clone();
        if b.1 == 0.0 {
            break;
        }
    }
    let scale = samples.iter().map(|sample| rate_of(sample).1.abs()).fold(0.0, f64::max);
    if b.1.abs() > 1e-12 * scale {
        return Err(format!("the extremum near {} s is not found", b.0).into());
    }
    Ok(best)
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
