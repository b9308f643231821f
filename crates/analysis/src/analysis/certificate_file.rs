//! Groups of a certificate in a result file: /certificate, /sensitivity and /events/time_uncertainty.

use super::advice::remedy;
use super::bands::{BandStretch, ChannelBand};
use super::certificate::{Certificate, CertifiedEvent, Verdict};
use super::certification::Certified;
use super::ladder::Rung;
use super::linearised::Slope;
use super::sensitivity::{Affected, add_sensitivities};
use crate::provenance::extension;
use stickslip_case::{Case, CaseNumber, Words};
use stickslip_files::schema::{TIME_UNCERTAINTY, extended_tables, group};
use stickslip_files::{Addition, FileColumn};
use stickslip_oracle::OracleSolution;

const UNCERTAINTY: &str = "how far from the exact solution of the stated model the event can be; NaN: not converged";
const TIME_SENSITIVITY: &str =
    "d(event time)/d(parameter), s for each unit of the parameter (attribute parameter_units of the group)";

fn missing(x: Option<f64>) -> f64 {
    x.unwrap_or(f64::NAN)
}

fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::NAN }
}

impl Certified {
    /// Additions to the file of the certified result, for [`stickslip_files::write_certified`].
    pub fn additions(&self, case: &Case) -> Vec<Addition> {
        let uncertainties = self.certificate.events.iter().map(|e| finite(e.uncertainty));
        let mut events = Addition::new(group::EVENTS);
        let column = FileColumn::numbers(TIME_UNCERTAINTY, "s", UNCERTAINTY, uncertainties);
        events.over(&["event"], column);
        vec![events, self.certificate_group(case), self.sensitivity_group(case)]
    }

    fn certificate_group(&self, case: &Case) -> Addition {
        let c = &self.certificate;
        let mut group = Addition::new(group::CERTIFICATE);
        group.attribute("verdict_of_all", c.verdict.name());
        group.attribute("uncertainty_by", c.uncertainty_by());
        group.attribute("contradiction", c.contradiction.clone().unwrap_or_default());
        group.attribute("remedy", remedy(c));
        for (name, number) in [
            ("digits", c.least_digits().map(f64::from)),
            ("digits_of_double", c.most_digits().map(f64::from)),
            ("growth_exponent", c.growth_exponent),
            ("growth_to_onset", c.growth_to_onset),
            ("kick_above_noise", c.kick_above_noise),
            ("kick_above_methods", c.kick_above_methods),
        ] {
            group.attribute(name, missing(number));
        }
        add_events(&mut group, c);
        add_ladder(&mut group, c);
        add_bands(&mut group, case, c);
        if let Some(exact) = &self.exact {
            let long_name = "exact events in multiple precision: time (s), kind, states (CSV)";
            group.text("oracle", long_name, csv(case.words, exact));
        }
        group
    }

    fn sensitivity_group(&self, case: &Case) -> Addition {
        let known = self.known_sensitivities();
        let parameters = known.map_or(&[][..], |known| &known.parameters);
        let events = self.certificate.events.len();
        let mut group = Addition::new(group::SENSITIVITY);
        let list = |of: fn(&CaseNumber) -> &str| parameters.iter().map(of).collect::<Vec<_>>().join(", ");
        group.attribute("parameters", list(|parameter| &parameter.path));
        group.attribute("parameter_units", list(|parameter| parameter.unit));
        group.dimension("event", events, "index of the event");
        group.dimension("parameter", parameters.len(), "index of the parameter");
        // An event that has not converged has no known derivative.
        let matrix = |of: fn(&Slope) -> f64| -> Vec<f64> {
            let row = |index: usize| match known.and_then(|known| known.events.get(index)) {
                Some(row) => row.iter().map(of).collect(),
                None => vec![f64::NAN; parameters.len()],
            };
            (0..events).flat_map(row).collect()
        };
        let mut add = |name: &str, long_name: &str, values: Vec<f64>| {
            group.over(
                &["event", "parameter"],
                FileColumn::numbers(name, "s", long_name, values),
            );
        };
        add("time_sensitivity", TIME_SENSITIVITY, matrix(|slope| slope.value));
        let uncertainty = matrix(|slope| slope.uncertainty);
        if uncertainty.iter().any(|x| !x.is_nan()) {
            let long_name = "how far time_sensitivity can be off, in its unit";
            add("time_sensitivity_uncertainty", long_name, uncertainty);
        }
        let result = known.and_then(|known| known.result.as_ref());
        let expected = if case.stops() {
            Affected::FinalStick
        } else {
            Affected::LastEvent
        };
        let affected = result.map_or(expected, |result| result.of);
        add_sensitivities(&mut group, result, affected, parameters.len());
        group.attribute("of", affected.name());
        if let Some(why) = self.without_sensitivities() {
            group.attribute("without_sensitivities", why);
        }
        group
    }
}

fn add_events(group: &mut Addition, c: &Certificate) {
    group.dimension("event", c.events.len(), "index of the event");
    let codes = |name: &str, long_name: &str, of: fn(&CertifiedEvent) -> Verdict| {
        let words = Verdict::ALL.map(|v| (v.code().into(), v.name().to_owned())).to_vec();
        FileColumn::codes(name, long_name, c.events.iter().map(|e| of(e).code()), words)
    };
    let numbers = |name: &str, unit: &str, long_name: &str, of: fn(&CertifiedEvent) -> f64| {
        FileColumn::numbers(name, unit, long_name, c.events.iter().map(of))
    };
    let columns = [
        Some(codes("verdict", "verdict on the event", |e| e.verdict)),
        Some(codes(
            "ladder_verdict",
            "verdict on the event by the ladder of methods alone",
            |e| e.ladder_verdict,
        )),
        Some(numbers(
            "ladder_uncertainty",
            "s",
            "uncertainty of the event by the ladder of methods alone; NaN: not converged",
            |e| finite(e.ladder_uncertainty),
        )),
        c.by_oracle.then(|| {
            let long_name =
                "distance of the event from the exact one, own less exact; NaN: the exact solution has none near it";
            numbers("true_error", "s", long_name, |e| missing(e.true_error))
        }),
        Some(numbers(
            "rounding",
            "s",
            "how far rounding to double precision, of the input and of the state and the clock at every event before, moves the event",
            |e| finite(e.rounding),
        )),
        Some(numbers(
            "growth",
            "1",
            "e-folds by which a deviation has grown from the loss of stability, or from a later kick on smooth sliding, to the event",
            |e| missing(e.growth),
        )),
    ];
    columns
        .into_iter()
        .flatten()
        .for_each(|column| group.over(&["event"], column));
}

fn add_ladder(group: &mut Addition, c: &Certificate) {
    group.dimension("rung", c.ladder.len(), "index of the run of the ladder");
    let mut methods: Vec<&str> = Vec::new();
    for rung in &c.ladder {
        if !methods.contains(&rung.method) {
            methods.push(rung.method);
        }
    }
    let code = |rung: &Rung| methods.iter().position(|name| *name == rung.method).unwrap_or_default() as i8;
    let words = (0..).zip(methods.iter().map(|&name| name.to_owned())).collect();
    let distance = "largest distance to the result over the agreeing events";
    let agreeing = FileColumn::counts(
        "rung_agreeing",
        "events of the sequence that agree with the result's, from the first on",
        c.ladder.iter().map(|rung| rung.agreeing as i64),
    );
    for column in [
        FileColumn::codes("rung_method", "integration method", c.ladder.iter().map(code), words),
        FileColumn::numbers(
            "rung_rtol",
            "1",
            "relative tolerance",
            c.ladder.iter().map(|rung| rung.rtol),
        ),
        agreeing,
        FileColumn::numbers(
            "rung_distance",
            "s",
            distance,
            c.ladder.iter().map(|rung| missing(rung.distance)),
        ),
    ] {
        group.over(&["rung"], column);
    }
}

fn add_bands(group: &mut Addition, case: &Case, c: &Certificate) {
    let stretches = &c.bands.stretches;
    let dimension = "index of the stretch: before the event of the same index, the last before the end of the run";
    group.dimension("stretch", stretches.len(), dimension);
    let numbers = |name: &str, unit: &str, long_name: &str, of: &dyn Fn(&BandStretch) -> f64| {
        FileColumn::numbers(name, unit, long_name, stretches.iter().map(of))
    };
    let [trajectory, ..] = extended_tables(&extension(case));
    let mode = trajectory
        .variables
        .into_iter()
        .find(|variable| variable.name == "mode");
    let modes = mode.map(|mode| mode.flags).unwrap_or_default();
    let of_modes = stretches.iter().map(|stretch| stretch.mode.code());
    let uncertainty = "larger uncertainty of the events at its ends; NaN: not converged";
    for column in [
        numbers("stretch_start", "s", "where it starts", &|stretch| stretch.start),
        numbers("stretch_end", "s", "where it ends", &|stretch| stretch.end),
        FileColumn::codes("stretch_mode", "what the contact does in it", of_modes, modes),
        numbers("stretch_time_uncertainty", "s", uncertainty, &|stretch| {
            stretch.time_uncertainty
        }),
    ] {
        group.over(&["stretch"], column);
    }
    for (k, ChannelBand { name, unit, .. }) in c.bands.channels.iter().enumerate() {
        let band = format!(
            "how far {name} can be from the exact solution at the same share of its own way between the events"
        );
        group.over(
            &["stretch"],
            numbers(&format!("band_{name}"), unit, &band, &|stretch| stretch.bands[k]),
        );
        let rate =
            format!("largest |d({name})/dt|; times stretch_time_uncertainty, what to add to the band at a fixed time");
        let rate_unit = match unit.strip_suffix("s-1") {
            Some(rest) => format!("{rest}s-2"),
            None => format!("{unit} s-1"),
        };
        group.over(
            &["stretch"],
            numbers(&format!("rate_{name}"), &rate_unit, &rate, &|stretch| stretch.rates[k]),
        );
    }
}

/// The events of the exact solution as CSV. They have the state after each event if the case has the paper's letters,
/// else the mode.
fn csv(words: Words, exact: &OracleSolution) -> String {
    let mut text = String::new();
    for (index, event) in exact.report.events.iter().enumerate() {
        let digits = exact.digits_of_event(index).max(1) as usize;
        let mut line = vec![
            ("time", event.time.to_decimal(digits)),
            ("kind", event.kind.name().to_owned()),
        ];
        match words.has_letters() {
            true => {
                let state = event.state.components().into_iter();
                line.extend(state.map(|(name, value)| (name, value.to_decimal(digits))));
            }
            false => line.push(("mode_after", event.mode_after.name().to_owned())),
        }
        let (names, values): (Vec<&str>, Vec<String>) = line.into_iter().unzip();
        if index == 0 {
            text += &(names.join(",") + "\n");
        }
        text += &(values.join(",") + "\n");
    }
    text
}
