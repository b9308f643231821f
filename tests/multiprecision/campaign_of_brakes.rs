//! The campaign: certificates of random brakes against the oracle, over wide ranges of parameters and at their limits.
//!
//!     STICKSLIP_CAMPAIGN=0..2000 cargo test --release --test multiprecision campaign_of_brakes -- --ignored --nocapture
//!
//! prints the tables of docs/theory.md. The criterion: a converged event is no farther from the oracle than its
//! uncertainty, up to the rounding of a double, and a converged sequence is the oracle's.

use crate::common::campaign::{
    Fate, Outcome, run,
    table::{broken_promises, tables},
};
use std::ops::Range;

/// Default without STICKSLIP_CAMPAIGN: some minutes on one processor.
const DEFAULT: Range<u64> = 0..22;

fn check(outcomes: &[Outcome]) {
    println!("{}", tables(outcomes));
    let faults: Vec<String> = outcomes
        .iter()
        .flat_map(|outcome| {
            outcome
                .faults
                .iter()
                .map(move |fault| format!("brake {}: {fault}", outcome.index))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let broken = broken_promises(outcomes);
    assert!(broken.is_empty(), "{}", broken.join("\n"));
    // A case that cannot be compared must not count as a success.
    let held = outcomes
        .iter()
        .filter(|outcome| matches!(outcome.fate, Fate::Certified(_)))
        .count();
    assert!(10 * held >= 8 * outcomes.len(), "{held} of {}", outcomes.len());
}

/// Brakes of different families.
#[test]
fn multiprecision_certificates_hold_on_a_few_random_brakes() {
    check(&run(9..15));
}

#[test]
#[ignore = "takes minutes"]
fn multiprecision_certificates_hold_on_random_brakes() {
    let range = match std::env::var("STICKSLIP_CAMPAIGN") {
        Err(_) => DEFAULT,
        Ok(text) => {
            let ends = text
                .split_once("..")
                .and_then(|(from, to)| Some(from.parse().ok()?..to.parse().ok()?));
            ends.unwrap_or_else(|| panic!("STICKSLIP_CAMPAIGN = {text:?} is no range such as 0..2000"))
        }
    };
    check(&run(range));
}
