//! Periodic motion and its description.

use super::equations::Guess;
use super::family::{Family, Member};
use crate::error::Error;
use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;
use stickslip_engine::simulation::{Border, Margin, Shot, ShotPhase, WantedResults, shoot};
use stickslip_system::model::Mode;
use stickslip_system::named;
use stickslip_system::numerics::eigenvalues::eigenvalues;
use stickslip_system::watch::Watch;

/// Distance from the unit circle within which a multiplier is neutral.
pub const NEUTRAL: f64 = 1e-8;

/// Fraction of the period's largest slip speed above which a slip counts as one of the largest.
const ALIKE: f64 = 1.0 - 1e-6;

named! {
    /// Kind of a multiplier.
    pub enum MultiplierKind {
        /// Disturbance across the motion.
        Free: "free",
        /// Exactly 1: along an autonomous motion.
        Along: "along",
        /// Exactly 0: a stick removes every difference of the surface speeds.
        Stick: "stick",
    }
}

/// Floquet multiplier: factor of a disturbance in a period.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Multiplier {
    /// Real part.
    pub real: f64,
    /// Imaginary part.
    pub imaginary: f64,
    /// Kind.
    pub kind: MultiplierKind,
}

impl Multiplier {
    /// Magnitude.
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

named! {
    /// Stability against small disturbances.
    #[derive(Default)]
    pub enum CycleStability {
        /// All disturbances decay.
        Stable: "stable",
        /// A disturbance grows.
        Unstable: "unstable",
        /// A disturbance stays, to rounding.
        #[default]
        Neutral: "neutral",
    }
}

/// Distance to another sequence of events.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Nearest {
    /// Change of the sequence.
    pub border: Border,
    /// Relative distance; see [`Border`].
    pub distance: f64,
    /// Time since the start of the period, s.
    pub time: f64,
}

/// Event of a period.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OrbitEvent {
    /// Time since the start of the period, s.
    pub time: f64,
    /// Name in files.
    pub kind: &'static str,
    /// Mode after the event.
    pub mode_after: &'static str,
}

/// Periodic motion.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Orbit {
    /// Period, s.
    pub period: f64,
    /// Relative error bound of state and period: last Newton step over the size of each component.
    pub error: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Half of the position's range; NaN for a slip displacement.
    pub amplitude: f64,
    /// Least and largest position, rad (m in translation).
    pub position: (f64, f64),
    /// Least and largest omega_r, rad/s.
    pub relative_velocity: (f64, f64),
    /// Number of sticks that begin in the period.
    pub sticks: usize,
    /// Stability by the multipliers.
    pub stability: CycleStability,
    /// Multipliers, the largest first; the one along an autonomous motion, 1, leads.
    pub multipliers: Vec<Multiplier>,
    /// Events in order of time.
    pub events: Vec<OrbitEvent>,
    /// Periods of the drives in a period; `None` for an autonomous motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub multiple: Option<u32>,
    /// Duration of the shortest stick, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shortest_stick: Option<f64>,
    /// Duration of the longest stick, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_stick: Option<f64>,
    /// Nearest other sequence of events.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest: Option<Nearest>,
    /// Phase of the drives at the start, s.
    #[serde(skip)]
    pub time: f64,
    /// State at the start: twists, rates, speeds of free chains, bristles.
    #[serde(skip)]
    pub state: Vec<f64>,
    #[serde(skip)]
    pub(crate) margins: Vec<Margin>,
    /// Codes of the modes in order of time: equal words are equal sequences.
    #[serde(skip)]
    pub(crate) word: Vec<u8>,
    #[serde(skip)]
    pub(crate) values: Vec<f64>,
    #[serde(skip)]
    pub(crate) sizes: Vec<f64>,
    /// d(end)/d(start).
    #[serde(skip)]
    pub(crate) by_state: DMatrix<f64>,
    /// Distance of the start from the nearest event, as a fraction of the longest slip; infinite without events.
    #[serde(skip)]
    pub(crate) clearance: f64,
}

impl Orbit {
    pub(crate) fn guess(&self) -> Guess {
        Guess {
            time: self.time,
            state: DVector::from_column_slice(&self.state),
            period: self.period,
            values: self.values.clone(),
        }
    }

    /// Events in words, such as "slip, stick".
    pub fn sequence(&self) -> String {
        let kinds: Vec<&str> = self.events.iter().map(|event| event.kind).collect();
        kinds.join(", ")
    }

    pub(crate) fn describe(
        family: &Family,
        guess: &Guess,
        (error, iterations): (f64, usize),
        stop: &dyn Watch,
    ) -> Result<Orbit, Error> {
        let member: Member = family.at(&guess.values, false)?;
        let wanted = WantedResults {
            derivatives: Some(&[]),
            extrema: true,
            stop,
        };
        let start = (guess.time, &guess.state);
        let shot = shoot((&member.system, member.threshold), start, guess.period, wanted)?;
        let multipliers = multipliers(&shot, family.is_autonomous());
        let largest = multipliers.iter().filter(|one| one.kind == MultiplierKind::Free);
        let largest = largest.map(Multiplier::magnitude).fold(0.0, f64::max);
        let stability = match largest {
            most if most > 1.0 + NEUTRAL => CycleStability::Unstable,
            most if most >= 1.0 - NEUTRAL => CycleStability::Neutral,
            _ => CycleStability::Stable,
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
        // The distance of a touch is relative to the largest speed.
        let (least, largest) = shot.relative_velocity;
        let fastest = least.abs().max(largest.abs());
        let margins = shot.margins.iter().map(|margin| match margin.border {
            Border::Touch | Border::Graze => Margin {
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
            amplitude: (shot.position.1 - shot.position.0) / 2.0,
            position: shot.position,
            relative_velocity: shot.relative_velocity,
            sticks: durations.len(),
            shortest_stick: durations.iter().copied().reduce(f64::min),
            longest_stick: durations.iter().copied().reduce(f64::max),
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

/// Modes of a motion in order of time, as a cyclic word that does not depend on the start.
pub(crate) fn word(shot: &Shot) -> Vec<u8> {
    // Crossings of a threshold do not change the sequence.
    let events = shot.events.iter().filter(|event| event.mode_after != Mode::Engaged);
    let events = events.filter(|event| event.kind.in_event_sequence());
    let mut word: Vec<u8> = events.map(|event| event.mode_after.code() as u8).collect();
    // The least rotation represents the cyclic word.
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
fn clearance(phases: &[ShotPhase]) -> f64 {
    let (Some(first), Some(last), true) = (phases.first(), phases.last(), phases.len() > 1) else {
        return f64::INFINITY;
    };
    let slips = phases.iter().filter(|phase| phase.mode.slides());
    let longest = slips.map(|phase| phase.to - phase.from).fold(0.0, f64::max);
    (first.to - first.from).min(last.to - last.from) / longest
}

/// Phases of a period. The phase across the ends of the period is joined and comes first.
pub fn whole(phases: &[ShotPhase]) -> Vec<ShotPhase> {
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

/// Distances at which slips and separations vanish. The largest slip of a period cannot vanish.
pub fn vanishing(phases: &[ShotPhase]) -> Vec<Margin> {
    let slips = phases.iter().filter(|phase| phase.mode.slides());
    let largest = slips.map(|phase| phase.depth).fold(0.0, f64::max);
    let margin = |phase: &ShotPhase| {
        let (border, distance) = match phase.mode {
            Mode::Separated => (Border::Separation, phase.depth),
            mode if mode.slides() => (Border::Slip, phase.depth / largest),
            _ => return None,
        };
        let time = phase.from;
        // Each of several equal slips counts as the largest.
        (border == Border::Separation || distance < ALIKE).then_some(Margin { border, time, distance })
    };
    phases.iter().filter_map(margin).collect()
}

fn stick_durations(phases: &[ShotPhase]) -> Vec<f64> {
    let sticks = phases.iter().filter(|phase| phase.mode == Mode::Stick);
    sticks.map(|phase| phase.to - phase.from).collect()
}

fn multipliers(shot: &Shot, autonomous: bool) -> Vec<Multiplier> {
    let matrix = &shot.by_state;
    let n = matrix.nrows();
    let size = |size: &f64| if *size > 0.0 { *size } else { 1.0 };
    let sizes: Vec<f64> = shot.sizes.iter().map(size).collect();
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
    let free_ones = values[..free].iter();
    found.extend(free_ones.map(|&value| Multiplier::new(value, MultiplierKind::Free)));
    if free < values.len() {
        found.push(Multiplier::new(Complex::new(0.0, 0.0), MultiplierKind::Stick));
    }
    found
}

/// Restriction of a matrix to the space across a direction that it preserves.
fn across(matrix: &DMatrix<f64>, direction: &DVector<f64>) -> DMatrix<f64> {
    let n = direction.len();
    // Reflection of the direction to the first axis.
    let mut mirror = DMatrix::identity(n, n);
    let mut normal = direction.clone();
    normal[0] += direction[0].signum();
    let length = normal.norm_squared();
    mirror -= &normal * normal.transpose() * (2.0 / length);
    let turned = &mirror * matrix * &mirror;
    turned.view((1, 1), (n - 1, n - 1)).into_owned()
}
