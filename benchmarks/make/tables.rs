//! The tables of a problem.

use crate::answers::{Answers, TIME_DIGITS, exponent};
use num_rational::BigRational;
use num_traits::Zero;
use stickslip::compare::benchmark::{Problem, SummaryOf};
use stickslip::oracle::decimal;

fn header(first: &str, problem: &Problem) -> String {
    let names = problem.columns.iter().map(|column| format!(",{}", column.name));
    format!("{first}{}\n", names.collect::<String>())
}

/// The columns, each to the last digit of its largest value.
fn row(state: &[BigRational], last_digit: &[i32]) -> String {
    let cells = state.iter().zip(last_digit).map(|(value, last)| {
        let digits = if value.is_zero() { 0 } else { exponent(value) + 1 - last };
        match usize::try_from(digits) {
            Ok(digits @ 1..) => format!(",{}", decimal(value, digits)),
            _ => ",0".to_owned(),
        }
    });
    cells.collect::<String>() + "\n"
}

/// `events.csv`.
pub fn events(problem: &Problem, answers: &Answers) -> String {
    let rows = answers.events.iter().enumerate().map(|(index, event)| {
        let (time, row) = (
            decimal(&event.time, TIME_DIGITS),
            row(&event.state, &answers.last_digit),
        );
        format!("{index},{time},{},{:.0e}{row}", event.kind.name(), event.uncertainty)
    });
    header("event,time,kind,time_uncertainty", problem) + &rows.collect::<String>()
}

/// `samples.csv`.
pub fn samples(problem: &Problem, answers: &Answers) -> String {
    let rows = answers.samples.iter().map(|(time, state)| {
        let row = row(state, &answers.last_digit);
        format!("{}{row}", decimal(time, TIME_DIGITS))
    });
    header("time", problem) + &rows.collect::<String>()
}

/// `summary.json`. Its numbers have more digits than a double.
pub fn summary(problem: &Problem, answers: &Answers) -> String {
    let values = problem.summary.iter().zip(&answers.summary).map(|(summary, (value, digits))| {
        let unit = |name: &str| problem.column(name).map_or("", |column| &problem.columns[column].unit);
        let (unit, of) = match &summary.of {
            SummaryOf::Events { first, last, count } => {
                ("s", format!("\"from\": \"events\", \"first\": {first}, \"last\": {last}, \"count\": {count}"))
            }
            SummaryOf::Extremum { column, what, between: [from, to], .. } => {
                let what = what.name();
                let of = format!(
                    "\"from\": \"extremum\", \"column\": \"{column}\", \"what\": \"{what}\", \"between\": [{from:?}, {to:?}]"
                );
                (unit(column), of)
            }
            SummaryOf::Samples { column, time } => {
                (unit(column), format!("\"from\": \"samples\", \"column\": \"{column}\", \"time\": {time:?}"))
            }
        };
        let value = decimal(value, *digits);
        let (name, meaning) = (&summary.name, &summary.meaning);
        format!("    {{\"name\": \"{name}\", \"unit\": \"{unit}\", \"value\": {value}, \"digits\": {digits}, {of}, \"meaning\": \"{meaning}\"}}")
    });
    let values: Vec<String> = values.collect();
    match values.is_empty() {
        true => "{\"values\": []}\n".to_owned(),
        false => format!("{{\"values\": [\n{}\n]}}\n", values.join(",\n")),
    }
}
