//! A cause in short: the values that differ, and what the reference's run with them has.

use super::parameters::{OtherNumber, plain};
use super::report::Causes;
use super::search::{Search, Tried};
use crate::diagnosis::CauseKind;
use crate::summary::seconds;

/// Smallest difference of an initial value that is named, in parts of the channel's size.
const NAMED: f64 = 1e-6;
/// Two kicks whose sizes differ by less than this part act on other surfaces.
const SAME: f64 = 0.01;
/// A number below this fraction of the other one is printed as 0.
const ROUNDING: f64 = 1e-9;
/// Most initial values that are named.
const MOST: usize = 2;

impl Search<'_> {
    /// For example "x = 0.2 m/s instead of 0. With it the reference has all 16 events within 1.0 ms.".
    pub(super) fn brief(&self, kind: CauseKind, tried: &Tried, causes: &Causes) -> String {
        let parameters = causes.parameters.as_ref().map(|found| &found.numbers[..]);
        let values = match (parameters, &causes.kick, kind) {
            (Some(numbers), ..) => {
                let each: Vec<String> = numbers.iter().map(of_number).collect();
                each.join(", ")
            }
            (None, Some(kick), CauseKind::AnotherKick) => {
                let [own, other] = [kick.jumps, kick.reference].map(|[two, one]| two - one);
                match (own - other).abs() <= SAME * other.abs() {
                    true => kick.words(),
                    false => format!("{} {} instead of {}", digits(own, other), kick.unit, digits(other, own)),
                }
            }
            (None, _, CauseKind::AnotherState) => self.initial_values().unwrap_or_default(),
            _ => tried.cause.words(self).1,
        };
        let outcome = self.brief_outcome(tried);
        match values.is_empty() {
            true => format!("with {outcome}"),
            false => format!("{values}. With {outcome}"),
        }
    }

    /// Events that the reference's run with the cause reproduces, after the word "with".
    fn brief_outcome(&self, tried: &Tried) -> String {
        let (evidence, judged) = (self.evidence, &tried.judged);
        let events = evidence.compared_events();
        let are_counted = tried.cause.has_events(judged) && tried.cause.up_to().is_none() && judged.has_events();
        if events == 0 || !are_counted {
            let part = crate::diagnosis::percent(judged.explained);
            return format!("it {part} % of the squared difference vanish.");
        }
        match (judged.after.unmatched.div_ceil(2), judged.after.max) {
            (0, 0.0) => format!("it the reference has all {events} events at the same times."),
            (0, largest) => format!("it the reference has all {events} events within {}.", seconds(largest)),
            (missed, _) => format!("it the reference has all but {missed} of the {events} events."),
        }
    }

    /// The values of the state that differ most in the first sample.
    fn initial_values(&self) -> Option<String> {
        let (seen, physics) = (self.evidence.observation?, self.evidence.physics);
        let row = (0..seen.time.len()).find(|&row| seen.reference.iter().all(|column| column[row].is_finite()))?;
        let mut off: Vec<(f64, String)> = Vec::new();
        for (k, &channel) in seen.channels.iter().enumerate() {
            let (own, reference) = (seen.values[k][row], seen.reference[k][row]);
            let part = (own - reference).abs() / seen.sizes[k];
            if physics.state.contains(&channel) && part > NAMED {
                let (name, unit) = (
                    self.shown.candidate.name_of(channel),
                    physics.vocabulary().unit(channel),
                );
                let (own, reference) = (digits(own, reference), digits(reference, own));
                off.push((part, format!("{name} = {own} {unit} instead of {reference}")));
            }
        }
        off.sort_by(|a, b| b.0.total_cmp(&a.0));
        let more = if off.len() > MOST { ", and more" } else { "" };
        let words: Vec<String> = off.into_iter().take(MOST).map(|(_, words)| words).collect();
        let when = match seen.time[row] {
            0.0 => String::new(),
            time => format!(" at {time:.6} s"),
        };
        (!words.is_empty()).then(|| words.join(", ") + more + &when)
    }
}

fn of_number(number: &OtherNumber) -> String {
    let unit = number.unit_after_blank();
    let (value, reference) = (
        digits(number.value, number.reference),
        digits(number.reference, number.value),
    );
    format!("{} = {value}{unit} instead of {reference}", number.key)
}

/// A number with as many digits as show its difference from another one, at least four.
fn digits(number: f64, other: f64) -> String {
    let size = number.abs().max(other.abs());
    let shared = (size / (number - other).abs()).log10();
    let decimals = (shared.clamp(0.0, 12.0) + 3.0) as usize;
    if number.abs() <= ROUNDING * size {
        return "0".to_owned();
    }
    let rounded: f64 = format!("{number:.decimals$e}").parse().unwrap_or(number);
    plain(rounded, 1e7)
}
