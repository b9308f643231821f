//! JSON document of a certification.

use super::advice::remedy;
use super::bands::{BandStretch, Bands, ChannelBand};
use super::certificate::{Certificate, Verdict};
use super::certification::Certified;
use super::linearised::Slope;
use super::sensitivity::{Affected, CaseSensitivities, Sensitivities, Sensitivity, SensitivityRerun};
use super::stability::onset::Onset;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use stickslip_case::Case;
use stickslip_oracle::OracleSolution;

/// A certification as it is reported: certificate, sensitivities and exact events of a case.
#[derive(Debug, Serialize)]
pub struct CertifyReport<'a> {
    /// The case.
    #[serde(skip)]
    pub case: &'a Case,
    /// Certificate, sensitivities and exact solution.
    #[serde(skip)]
    pub certified: &'a Certified,
    /// Origin of the case.
    #[serde(rename = "case")]
    pub source: String,
    /// Certified file.
    pub file: String,
    /// Figure of the onsets, if it was requested.
    pub figure: Option<String>,
    /// First sticks over the tolerance, for the figure.
    pub onsets: &'a [Onset],
    /// Wall time, s.
    pub seconds: f64,
    title: &'a str,
    #[serde(flatten)]
    certificate: &'a Certificate,
    channels: &'a [ChannelBand],
    stretches: Vec<StretchDocument<'a>>,
    uncertainty_by: &'static str,
    converged: bool,
    remedy: String,
    digits: Option<u32>,
    digits_of_double: Option<u32>,
    warnings: Vec<String>,
    sensitivity: Vec<ParameterDocument<'a>>,
    final_stick: Option<&'a Sensitivities>,
    result: Option<ResultDocument>,
    without_sensitivities: Option<&'a str>,
    oracle: Option<OracleDocument>,
}

#[derive(Debug, Serialize)]
struct StretchDocument<'a> {
    start: f64,
    end: f64,
    mode: &'static str,
    converged: bool,
    time_uncertainty: f64,
    bands: BTreeMap<&'a str, f64>,
    rates: BTreeMap<&'a str, f64>,
}

#[derive(Debug, Serialize)]
struct ParameterDocument<'a> {
    parameter: &'a str,
    unit: &'static str,
    value: f64,
    half_last_digit: Option<f64>,
    time_sensitivity: Vec<f64>,
    time_sensitivity_uncertainty: Vec<f64>,
    final_stick: Option<&'a Sensitivity>,
    result: Option<&'a Sensitivity>,
}

#[derive(Debug, Serialize)]
struct ResultDocument {
    of: Affected,
    value: f64,
}

#[derive(Debug, Serialize)]
struct OracleDocument {
    digits: u32,
    bits: usize,
    steps: u64,
    seconds: f64,
    events: Vec<ExactEventDocument>,
    true_errors: Vec<Option<f64>>,
}

#[derive(Debug, Serialize)]
struct ExactEventDocument {
    kind: &'static str,
    time: String,
    digits: u32,
    error: f64,
    state_after: BTreeMap<&'static str, String>,
}

impl<'a> CertifyReport<'a> {
    /// Report on a certified result of `case`, which comes from `source`; `file` has its certificate.
    pub fn new(case: &'a Case, certified: &'a Certified, source: String, file: String) -> Self {
        let c = &certified.certificate;
        let result = certified.result_sensitivities();
        CertifyReport {
            case,
            certified,
            source,
            file,
            figure: None,
            onsets: &[],
            seconds: f64::NAN,
            title: &case.title,
            certificate: c,
            channels: &c.bands.channels,
            stretches: c.bands.stretches.iter().map(|one| stretch(one, &c.bands)).collect(),
            uncertainty_by: c.uncertainty_by(),
            converged: c.verdict == Verdict::Converged,
            remedy: remedy(c),
            digits: c.least_digits(),
            digits_of_double: c.most_digits(),
            warnings: c.warnings.iter().map(ToString::to_string).collect(),
            sensitivity: certified.known_sensitivities().map(parameters).unwrap_or_default(),
            final_stick: result.filter(|result| result.of == Affected::FinalStick),
            result: result.map(|result| ResultDocument {
                of: result.of,
                value: result.time,
            }),
            without_sensitivities: certified.without_sensitivities(),
            oracle: certified.exact.as_ref().map(|exact| oracle(exact, c)),
        }
    }
}

impl Certified {
    /// Sensitivities, if they are known.
    pub fn known_sensitivities(&self) -> Option<&CaseSensitivities> {
        self.sensitivities.as_ref()?.as_ref().ok()
    }

    /// Sensitivities of the run's result, if they are known.
    pub fn result_sensitivities(&self) -> Option<&Sensitivities> {
        self.known_sensitivities()?.result.as_ref()
    }

    /// Reason for missing sensitivities.
    pub fn without_sensitivities(&self) -> Option<&str> {
        Some(self.sensitivities.as_ref()?.as_ref().err()?)
    }
}

impl Serialize for Sensitivity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Influence<'a> {
            slope: Option<f64>,
            by_slope: Option<f64>,
            minus: Option<&'a SensitivityRerun>,
            plus: Option<&'a SensitivityRerun>,
            nonlinear: Option<bool>,
        }
        let [minus, plus] = [0, 1].map(|side| self.reruns.as_ref().map(|reruns| &reruns[side]));
        let influence = Influence {
            slope: self.slope,
            by_slope: self.predicted(),
            minus,
            plus,
            nonlinear: self.nonlinear(),
        };
        influence.serialize(serializer)
    }
}

fn stretch<'a>(stretch: &BandStretch, bands: &'a Bands) -> StretchDocument<'a> {
    let names = || bands.channels.iter().map(|channel| channel.name.as_str());
    let of = |numbers: &[f64]| names().zip(numbers.iter().copied()).collect();
    StretchDocument {
        start: stretch.start,
        end: stretch.end,
        mode: stretch.mode.name(),
        converged: stretch.converged,
        time_uncertainty: stretch.time_uncertainty,
        bands: of(&stretch.bands),
        rates: of(&stretch.rates),
    }
}

fn parameters(known: &CaseSensitivities) -> Vec<ParameterDocument<'_>> {
    let of_stick = known
        .result
        .as_ref()
        .is_some_and(|result| result.of == Affected::FinalStick);
    let document = |column: usize| {
        let parameter = &known.parameters[column];
        let slopes = |of: fn(&Slope) -> f64| known.events.iter().map(|row| of(&row[column])).collect();
        let row = known.result.as_ref().map(|result| &result.rows[column]);
        ParameterDocument {
            parameter: &parameter.path,
            unit: parameter.unit,
            value: parameter.value,
            half_last_digit: row.and_then(|row| row.parameter.half_last_digit),
            time_sensitivity: slopes(|slope| slope.value),
            time_sensitivity_uncertainty: slopes(|slope| slope.uncertainty),
            final_stick: row.filter(|_| of_stick),
            result: row,
        }
    };
    (0..known.parameters.len()).map(document).collect()
}

fn oracle(exact: &OracleSolution, c: &Certificate) -> OracleDocument {
    let events = exact.report.events.iter().enumerate().map(|(index, event)| {
        let digits = exact.digits_of_event(index);
        let state = event.state.components().into_iter();
        ExactEventDocument {
            kind: event.kind.name(),
            time: event.time.to_decimal(digits as usize),
            digits,
            error: exact.errors[index],
            state_after: state
                .map(|(name, value)| (name, value.to_decimal(digits as usize)))
                .collect(),
        }
    });
    OracleDocument {
        digits: exact.digits,
        bits: exact.report.bits,
        steps: exact.report.steps,
        seconds: exact.seconds,
        events: events.collect(),
        true_errors: c.events.iter().map(|event| event.true_error).collect(),
    }
}
