//! A periodic motion that was found, and what is said of it.

use super::equations::Guess;
use super::error::CycleError;
use super::family::{Family, Member};
use crate::model::Mode;
use crate::numerics::eigenvalues::eigenvalues;
use crate::simulation::{Border, Margin, Phase, Shot, Wanted, shoot};
use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;

/// A multiplier within this of the unit circle is on it.
pub const NEUTRAL: f64 = 1e-8;

/// A slip whose largest speed is at least this share of that of the period is one of the largest.
const ALIKE: f64 = 1.0 - 1e-6;

/// Why a multiplier has its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MultiplierKind {
    /// Of a disturbance across the motion.
    Free,
    /// Exactly 1: along an autonomous motion.
    Along,
    /// Exactly 0: a stick takes away every difference of the surface speeds.
    Stick,
}

/// By what a disturbance is multiplied in a period.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Multiplier {
    /// Real part.
    pub real: f64,
    /// Imaginary part.
    pub imaginary: f64,
    /// Why.
    pub kind: MultiplierKind,
}

impl MultiplierKind {
    /// All of them, in the order of their codes in files.
    pub const ALL: [MultiplierKind; 3] = [MultiplierKind::Free, MultiplierKind::Along, MultiplierKind::Stick];

    /// As a word in files.
    pub fn name(self) -> &'static str {
        match self {
            MultiplierKind::Free => "free",
            MultiplierKind::Along => "along",
            MultiplierKind::Stick => "stick",
        }
    }
}

impl Multiplier {
    /// Its magnitude.
    pub fn magnitude(&self) -> f64 {
        self.real.hypot(self.imaginary)
    }

    fn new(value: Complex<f64>, kind: MultiplierKind) -> Multiplier {
        Multiplier {
            real: value.re,
            imaginary: value.im,
            kind,
        }
    }
}

/// What becomes of small disturbances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stability {
    /// They die out.
    Stable,
    /// One grows.
    Unstable,
    /// One stays, to rounding.
    Neutral,
}

impl Stability {
    /// As a word.
    pub fn name(self) -> &'static str {
        match self {
            Stability::Stable => "stable",
            Stability::Unstable => "unstable",
            Stability::Neutral => "neutral",
        }
    }
}

/// How near a motion is to another sequence of events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Nearest {
    /// What would change.
    pub border: Border,
    /// Relative; see [`Border`].
    pub distance: f64,
    /// Time since the start of the period, s.
    pub time: f64,
}

/// An event of a period.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OrbitEvent {
    /// Since the start of the period, s.
    pub time: f64,
    /// Its name in files.
    pub kind: &'static str,
    /// The mode that follows.
    pub mode_after: &'static str,
}

/// A periodic motion.
#[derive(Debug, Clone)]
pub struct Orbit {
    /// s.
    pub period: f64,
    /// Periods of the drives in it; `None` of an autonomous motion.
    pub multiple: Option<u32>,
    /// When the period starts, s: the phase of the drives.
    pub time: f64,
    /// Twists, rates, speeds of free chains and bristles there.
    pub state: Vec<f64>,
    /// The last step of Newton's method over the size of each component: how far state and period may be off, relative.
    pub error: f64,
    /// Newton's method took so many.
    pub iterations: usize,
    /// The largest first; that along an autonomous motion, 1, leads.
    pub multipliers: Vec<Multiplier>,
    /// From the multipliers.
    pub stability: Stability,
    /// In order of time.
    pub events: Vec<OrbitEvent>,
    /// Least and largest position, rad (m in translation).
    pub position: (f64, f64),
    /// Least and largest omega_r, rad/s.
    pub relative_velocity: (f64, f64),
    /// Sticks that begin in the period.
    pub sticks: usize,
    /// Durations of the shortest and the longest stick, s.
    pub stick_durations: Option<(f64, f64)>,
    /// The nearest other sequence of events.
    pub nearest: Option<Nearest>,
    pub(crate) margins: Vec<Margin>,
    /// Modes in order of time, with the events: what distinguishes sequences.
    pub(crate) word: Vec<u8>,
    pub(crate) values: Vec<f64>,
    pub(crate) sizes: Vec<f64>,
    /// d(end)/d(start).
    pub(crate) by_state: DMatrix<f64>,
    /// How far the start of the period is from its nearest events, as a share of the longest slip; infinite without events.
    pub(crate) clearance: f64,
}

impl Orbit {
    /// Half of what the position sweeps; NaN of a slip displacement.
    pub fn amplitude(&self) -> f64 {
        (self.position.1 - self.position.0) / 2.0
    }

    /// The motion as a guess of its neighbours.
    pub(crate) fn guess(&self) -> Guess {
        Guess {
            time: self.time,
            state: DVector::from_column_slice(&self.state),
            period: self.period,
            values: self.values.clone(),
        }
    }

    /// The events in words, such as "slip, stick".
    pub fn sequence(&self) -> String {
        self.events
            .iter()
            .map(|event| event.kind)
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// What is to be said of a motion that closes.
    pub(crate) fn describe(
        family: &Family,
        guess: &Guess,
        (error, iterations): (f64, usize),
        stop: &dyn Fn() -> bool,
    ) -> Result<Orbit, CycleError> {
        let member: Member = family.at(&guess.values, false)?;
        let wanted = Wanted {
            derivatives: Some(&[]),
            extrema: true,
            stop,
        };
        let shot = shoot(
            (&member.system, member.threshold),
            (guess.time, &guess.state),
            guess.period,
            wanted,
        )?;
        let multipliers = multipliers(&shot, family.is_autonomous());
        let largest = multipliers.iter().filter(|one| one.kind == MultiplierKind::Free);
        let largest = largest.map(Multiplier::magnitude).fold(0.0, f64::max);
        let stability = match largest {
            most if most > 1.0 + NEUTRAL => Stability::Unstable,
            most if most >= 1.0 - NEUTRAL => Stability::Neutral,
            _ => Stability::Stable,
        };
        let since = |time: f64| time - guess.time;
        let events = shot.events.iter().filter(|event| event.kind.in_event_sequence());
        let events = events.map(|event| OrbitEvent {
            time: since(event.time),
            kind: event.kind.name(),
            mode_after: event.mode_after.name(),
        });
        let phases = whole(&shot.phases);
        let durations = stick_durations(&phases);
        // A touch is measured by the largest speed.
        let (least, largest) = shot.relative_velocity;
        let fastest = least.abs().max(largest.abs());
        let margins = shot.margins.iter().map(|margin| match margin.border {
            Border::Touch => Margin {
                distance: margin.distance / fastest,
                ..*margin
            },
            _ => *margin,
        });
        let margins: Vec<Margin> = margins.chain(vanishing(&phases)).collect();
        let nearest = margins.iter().min_by(|a, b| a.distance.total_cmp(&b.distance));
        Ok(Orbit {
            period: guess.period,
            multiple: None,
            time: guess.time,
            state: guess.state.as_slice().to_vec(),
            error,
            iterations,
            stability,
            multipliers,
            events: events.collect(),
            position: shot.position,
            relative_velocity: shot.relative_velocity,
            sticks: durations.len(),
            stick_durations: durations.iter().copied().fold(None, |known: Option<(f64, f64)>, one| {
                let (low, high) = known.unwrap_or((one, one));
                Some((low.min(one), high.max(one)))
            }),
            nearest: nearest.map(|margin| Nearest {
                border: margin.border,
                distance: margin.distance,
                time: since(margin.time),
            }),
            word: word(&shot),
            values: guess.values.clone(),
            sizes: shot.sizes,
            clearance: clearance(&shot.phases),
            by_state: shot.by_state,
            margins,
        })
    }
}

/// The modes of a motion in order of time, from the first of the longest phase on, so that it does not depend on where the period
/// starts within a phase.
pub(crate) fn word(shot: &Shot) -> Vec<u8> {
    // Crossings of a threshold change nothing.
    let events = shot.events.iter().filter(|event| event.mode_after != Mode::Engaged);
    let events = events.filter(|event| event.kind.in_event_sequence());
    let mut word: Vec<u8> = events.map(|event| event.mode_after.code() as u8).collect();
    // A cyclic word: the rotation that is least.
    let rotations = (0..word.len().max(1)).map(|k| {
        let mut rotated = word.clone();
        rotated.rotate_left(k);
        rotated
    });
    if let Some(least) = rotations.min() {
        word = least;
    }
    word
}

/// See [`Orbit::clearance`].
fn clearance(phases: &[Phase]) -> f64 {
    let (Some(first), Some(last), true) = (phases.first(), phases.last(), phases.len() > 1) else {
        return f64::INFINITY;
    };
    let slips = phases.iter().filter(|phase| phase.mode.slides());
    let longest = slips.map(|phase| phase.to - phase.from).fold(0.0, f64::max);
    (first.to - first.from).min(last.to - last.from) / longest
}

/// The phases of a period, of which the one that the period cuts is whole, and the first.
fn whole(phases: &[Phase]) -> Vec<Phase> {
    let mut phases = phases.to_vec();
    if phases.len() > 1
        && phases[0].mode == phases[phases.len() - 1].mode
        && let Some(last) = phases.pop()
    {
        phases[0].to += last.to - last.from;
        phases[0].depth = phases[0].depth.max(last.depth);
    }
    phases
}

/// How far slips and separations are from having no length. The largest slip of a period does not vanish.
fn vanishing(phases: &[Phase]) -> Vec<Margin> {
    let slips = phases.iter().filter(|phase| phase.mode.slides());
    let largest = slips.map(|phase| phase.depth).fold(0.0, f64::max);
    let margin = |phase: &Phase| {
        let (border, distance) = match phase.mode {
            Mode::Separated => (Border::Separation, phase.depth),
            mode if mode.slides() => (Border::Slip, phase.depth / largest),
            _ => return None,
        };
        let time = phase.from;
        // Of two alike the largest is either.
        (border == Border::Separation || distance < ALIKE).then_some(Margin { border, time, distance })
    };
    phases.iter().filter_map(margin).collect()
}

/// How long sticks last in a period.
fn stick_durations(phases: &[Phase]) -> Vec<f64> {
    let sticks = phases.iter().filter(|phase| phase.mode == Mode::Stick);
    sticks.map(|phase| phase.to - phase.from).collect()
}

/// The multipliers of a motion over a period.
fn multipliers(shot: &Shot, autonomous: bool) -> Vec<Multiplier> {
    let matrix = &shot.by_state;
    let n = matrix.nrows();
    // Balanced by the sizes of the components, which hardly differ then.
    let sizes: Vec<f64> = shot
        .sizes
        .iter()
        .map(|&size| if size > 0.0 { size } else { 1.0 })
        .collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * sizes[j] / sizes[i]);
    let flow = DVector::from_fn(n, |k, _| shot.end_rates[k] / sizes[k]);
    let mut found = Vec::new();
    let mut rest = scaled;
    if autonomous && flow.norm() > 0.0 {
        found.push(Multiplier::new(Complex::new(1.0, 0.0), MultiplierKind::Along));
        rest = across(&rest, &flow.normalize());
    }
    let mut values = eigenvalues(&rest);
    values.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    let sticks = shot.phases.iter().any(|phase| phase.mode == Mode::Stick);
    let free = values.len() - usize::from(sticks && !values.is_empty());
    found.extend(
        values[..free]
            .iter()
            .map(|&value| Multiplier::new(value, MultiplierKind::Free)),
    );
    if free < values.len() {
        found.push(Multiplier::new(Complex::new(0.0, 0.0), MultiplierKind::Stick));
    }
    found
}

/// A matrix without the direction that it keeps: on the space across it.
fn across(matrix: &DMatrix<f64>, direction: &DVector<f64>) -> DMatrix<f64> {
    let n = direction.len();
    // The reflection that takes the direction to the first axis.
    let mut mirror = DMatrix::identity(n, n);
    let mut normal = direction.clone();
    normal[0] += direction[0].signum();
    let length = normal.norm_squared();
    mirror -= &normal * normal.transpose() * (2.0 / length);
    let turned = &mirror * matrix * &mirror;
    turned.view((1, 1), (n - 1, n - 1)).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn property_what_vanishes_is_measured_by_the_largest_slip_and_force() {
        let phase = |mode, from: f64, to: f64, depth: f64| Phase { mode, from, to, depth };
        let found = vanishing(&whole(&[
            phase(Mode::SlipForward, 0.0, 1.0, 2.0),
            phase(Mode::Stick, 1.0, 2.0, 0.0),
            phase(Mode::SlipBackward, 2.0, 3.0, 1.0),
            phase(Mode::Separated, 3.0, 4.0, 0.125),
            phase(Mode::SlipForward, 4.0, 5.0, 4.0),
        ]));
        let found: Vec<_> = found.iter().map(|one| (one.border, one.time, one.distance)).collect();
        // The slip that the period cuts is the largest one, and has no margin.
        assert_eq!(found, [(Border::Slip, 2.0, 0.25), (Border::Separation, 3.0, 0.125)]);
    }
}
