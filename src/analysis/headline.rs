//! The headline of a run as a reader sees it: each quantity in words, beside the paper's number.

use super::summary::{TURNOVER, residual_row, share_of};
use super::{Cycle, CycleStatistics, Summary};
use crate::case::{Case, CaseSource, builtin};
use crate::model::Parameters;
use crate::model::torsion::TorsionModel;
use crate::record::{Event, EventKind};
use crate::results::{ResultError, ResultFile};
use serde::Serialize;

/// The paper's own numbers (its sections 4.2 to 4.5), beside which the built-in case is put.
pub mod paper {
    /// Onset of stick-slip.
    pub(crate) const ONSET: &str = "6.975 s";
    /// Stick for good.
    pub(crate) const FINAL_STICK: &str = "6.9896 s";
    /// Duration of the first stick.
    pub(crate) const FIRST_STICK: &str = "50 us";
    /// Duration of the last stick that ends.
    pub const LAST_STICK: &str = "530 us";
    /// Duration of a slip.
    pub const SLIP: &str = "190 us";
    /// How the duration of the slips changes.
    pub(crate) const SLIP_RANGE: &str = "nearly constant";
    /// T_n.
    pub(crate) const NATURAL_PERIOD: &str = "240 us";
    /// T_i / T_n.
    pub(crate) const FIRST_PERIOD: &str = "1";
    /// T_f / T_n.
    pub(crate) const LAST_PERIOD: &str = "3";
    /// Axial displacement under the full force.
    pub const AXIAL: &str = "0.04 mm";
}

/// One line of the headline.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HeadlineRow {
    /// What it is.
    pub name: &'static str,
    /// This run's value with its unit; "none" where the run has no such thing.
    pub value: String,
    /// The paper's value, empty where it gives none.
    pub paper: &'static str,
}

/// What the headline is made of; times in s, lengths in m, energies in J. `None` is what a run, or
/// its file, does not have.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Headline {
    /// Events of every kind, onset, and the first and last cycle.
    pub stick_slip: CycleStatistics,
    /// All cycles, of a file; none of a run, which does not keep them.
    pub cycles: Vec<Cycle>,
    /// T_n.
    pub natural_period: Option<f64>,
    /// Static axial displacement under the largest force.
    pub axial_displacement: Option<f64>,
    /// When steady sliding loses its stability.
    pub instability_time: Option<f64>,
    /// G.
    pub growth_exponent: Option<f64>,
    /// From the kick to the first stick.
    pub e_folds_gained: Option<f64>,
    /// By how many e-folds the kick stands above rounding at the first stick; negative if it has died out.
    pub kick_above_noise: Option<f64>,
    /// Largest |energy_residual|.
    pub energy_residual: Option<f64>,
    /// The same, relative to the energy turned over; in files of earlier versions to that at the start.
    pub energy_residual_relative: Option<f64>,
}

impl From<&Summary> for Headline {
    fn from(summary: &Summary) -> Self {
        Headline {
            stick_slip: summary.stick_slip.clone(),
            cycles: Vec::new(),
            natural_period: summary.natural_period,
            axial_displacement: summary.axial_displacement,
            instability_time: summary.instability_time,
            growth_exponent: summary.growth_exponent,
            e_folds_gained: summary.e_folds_gained,
            kick_above_noise: summary.kick_above_noise,
            energy_residual: Some(summary.energy_residual),
            energy_residual_relative: summary.energy_residual_relative,
        }
    }
}

impl Headline {
    /// The headline of a result file whose events are `events` and whose resolved case is `case`,
    /// if this program can read it. What a killed run could not write any more is `None`.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn of_file(file: &ResultFile, case: Option<&Case>, events: &[Event]) -> Result<Headline, ResultError> {
        let parameters = case.map(|case| &case.parameters);
        let displacement = |p: &Parameters| p.largest_force() / p.axial.stiffness;
        let mut stick_slip = CycleStatistics::default();
        let cycles = events
            .iter()
            .filter_map(|event| stick_slip.push(event.time, event.kind))
            .collect();
        let mut headline = Headline {
            stick_slip,
            cycles,
            natural_period: parameters.map(|p| TorsionModel::new(p).natural_period()),
            axial_displacement: parameters.map(displacement),
            ..Headline::default()
        };
        let Some(table) = file.stick_slip()? else {
            return Ok(headline);
        };
        let known = |value: f64| (!value.is_nan()).then_some(value);
        let extra = |name: &str| table.extras.iter().find(|extra| extra.name == name);
        headline.instability_time = extra("instability_time").and_then(|extra| known(extra.value));
        headline.growth_exponent = known(table.growth_exponent);
        headline.e_folds_gained = known(table.e_folds_gained);
        headline.kick_above_noise = extra("kick_above_noise").and_then(|extra| known(extra.value));
        headline.energy_residual = known(table.energy_residual_max);
        let start = file.samples(0..file.sample_count()?.min(1))?;
        let at_start = start
            .first()
            .map(|first| first.channels.energy_kinetic + first.channels.energy_elastic);
        let turnover = extra(TURNOVER).and_then(|extra| known(extra.value)).or(at_start);
        headline.energy_residual_relative = headline
            .energy_residual
            .zip(turnover)
            .and_then(|(residual, turnover)| share_of(residual, turnover));
        Ok(headline)
    }

    /// The lines, in the order in which they are read.
    pub fn rows(&self) -> Vec<HeadlineRow> {
        let s = &self.stick_slip;
        let (first, last) = (s.first, s.last);
        let residual = match (self.energy_residual, self.energy_residual_relative) {
            (Some(residual), relative) => residual_row(residual, relative),
            _ => none(),
        };
        let slips = pair(first.map(|c| c.slip_duration), last.map(|c| c.slip_duration));
        let period = |period: Option<f64>| ratio(period, self.natural_period);
        let axial = self.axial_displacement;
        let died = self.kick_above_noise.is_some_and(|above| above < 0.0);
        let above = format!(
            "{}{}",
            number(self.kick_above_noise),
            if died { ", it has died out" } else { "" }
        );
        [
            ("events", events(s), ""),
            ("onset of stick-slip", time(s.onset_time), paper::ONSET),
            ("final stick", time(s.final_stick_time), paper::FINAL_STICK),
            ("slip duration, first / last", slips, paper::SLIP),
            ("slip duration, range", range(s.slip_range), paper::SLIP_RANGE),
            (
                "stick duration, first",
                microseconds(first.map(|c| c.stick_duration)),
                paper::FIRST_STICK,
            ),
            (
                "stick duration, last",
                microseconds(last.map(|c| c.stick_duration)),
                paper::LAST_STICK,
            ),
            ("stick duration, range", range(s.stick_range), ""),
            (
                "natural period T_n",
                microseconds(self.natural_period),
                paper::NATURAL_PERIOD,
            ),
            ("first period T_i / T_n", period(s.first_period()), paper::FIRST_PERIOD),
            ("last period T_f / T_n", period(s.last_period()), paper::LAST_PERIOD),
            (
                "axial displacement, static",
                axial.map_or_else(none, |z| format!("{:.4} mm", z * 1e3)),
                paper::AXIAL,
            ),
            ("loss of stability", time(self.instability_time), ""),
            ("growth exponent G", number(self.growth_exponent), ""),
            ("e-folds gained from the kick", number(self.e_folds_gained), ""),
            ("kick above rounding, e-folds", above, ""),
            ("energy residual", residual, ""),
        ]
        .map(|(name, value, paper)| HeadlineRow { name, value, paper })
        .into()
    }
}

/// Whether these are the parameters of the built-in case of the paper, beside which its numbers are put; solver and
/// output are free.
pub fn is_paper_case(parameters: &Parameters) -> bool {
    CaseSource::built_in(builtin::DEFAULT)
        .and_then(|source| Case::parse(&source, &[]))
        .is_ok_and(|case| case.parameters == *parameters)
}

/// Kinds of events as a reader counts them: one of them, and several.
const KINDS: [(&[EventKind], &str, &str); 8] = [
    (&[EventKind::Stick], "stick", "sticks"),
    (&[EventKind::Slip], "slip", "slips"),
    (&[EventKind::Reversal], "reversal", "reversals"),
    (&[EventKind::Separation], "separation", "separations"),
    (&[EventKind::Contact], "contact", "contacts"),
    (&[EventKind::Kick], "kick", "kicks"),
    (&[EventKind::Corner], "corner", "corners"),
    (
        &[EventKind::Destabilised, EventKind::Restabilised],
        "change of stability",
        "changes of stability",
    ),
];

/// The number of events, and how many there are of each kind: these add up to it. Sticks and slips are named in any case.
pub(crate) fn events(statistics: &CycleStatistics) -> String {
    let count = |&(kinds, one, several): &(&[EventKind], &str, &str)| match statistics.count(kinds) {
        0 if !matches!(kinds, [EventKind::Stick | EventKind::Slip]) => None,
        1 => Some(format!("1 {one}")),
        n => Some(format!("{n} {several}")),
    };
    let kinds: Vec<String> = KINDS.iter().filter_map(count).collect();
    format!("{} ({})", statistics.count(&EventKind::ALL), kinds.join(", "))
}

fn time(t: Option<f64>) -> String {
    t.map_or_else(none, |t| format!("{t:.9} s"))
}

fn microseconds(t: Option<f64>) -> String {
    t.map_or_else(none, |t| format!("{:.2} us", t * 1e6))
}

fn pair(first: Option<f64>, last: Option<f64>) -> String {
    match (first, last) {
        (Some(first), Some(last)) => format!("{:.2} / {:.2} us", first * 1e6, last * 1e6),
        _ => none(),
    }
}

fn range(bounds: Option<(f64, f64)>) -> String {
    bounds.map_or_else(none, |(low, high)| format!("{:.2} to {:.2} us", low * 1e6, high * 1e6))
}

fn ratio(period: Option<f64>, natural: Option<f64>) -> String {
    match (period, natural) {
        (Some(period), Some(natural)) => format!("{:.4}", period / natural),
        _ => none(),
    }
}

fn number(x: Option<f64>) -> String {
    x.map_or_else(none, |x| format!("{x:.2}"))
}

fn none() -> String {
    "none".to_owned()
}
