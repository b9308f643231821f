//! The witness of a run, as the result file has it.

use crate::analysis::Witness;
use crate::results::{MetaValue, WitnessAttributes};

/// The attributes of /witness.
pub(super) fn attributes(witness: &Witness) -> WitnessAttributes {
    let text = |text: &str| MetaValue::Text(text.to_owned());
    let number = MetaValue::Number;
    WitnessAttributes(vec![
        ("method", text(witness.method), None),
        (
            "rtol",
            number(witness.rtol),
            Some(("1", "relative tolerance of the witness")),
        ),
        ("testimony", text(witness.testimony.name()), None),
        (
            "events",
            number(witness.events as f64),
            Some(("1", "events in the sequence of the witness")),
        ),
        (
            "agreeing_events",
            number(witness.agreeing_events as f64),
            Some((
                "1",
                "events that agree in kind with those of the result, from the first on",
            )),
        ),
        (
            "largest_difference",
            number(witness.largest_difference.unwrap_or(f64::NAN)),
            Some(("s", "largest difference of the times of the agreeing events")),
        ),
        ("statement", text(&witness.statement), None),
    ])
}
