//! A smooth function that replaces the sign of the sliding speed, so that the candidate creeps in stick.

use super::evidence::Evidence;
use super::fit::fitted;
use super::judge::{ALL, EXACT, Judged};
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal, proposals, stepper};
use crate::Channel;
use crate::diagnosis::CauseKind;
use crate::reference::Physics;
use std::f64::consts::FRAC_PI_2;
use stickslip_engine::workers::over_processors;
use stickslip_system::friction::Law;
use stickslip_system::model::system::{ContactLaw, Regularisation, Smoothing};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Creep {
    /// Index in [`SHAPES`].
    pub shape: usize,
    /// eps, rad/s.
    pub speed: f64,
    /// Largest |omega_r| that was examined, rad/s.
    pub largest: f64,
}

#[derive(Debug)]
pub(crate) struct CreepPass<'a> {
    physics: &'a Physics,
    /// Speed of an oscillation that friction causes, rad/s.
    speed: f64,
    /// 1/J_1 + 1/J_2: acceleration of omega_r per torque of the contact, 1/(kg m^2).
    per_torque: f64,
    last: Option<(f64, f64)>,
    /// Sum of w^2, and for each function the sums of w a and a^2; a is its inverse at T_f/(mu r F_n).
    squares: f64,
    sums: [[f64; 2]; SHAPES.len()],
    largest: f64,
    count: u64,
}

#[derive(Debug)]
pub(crate) struct Shape {
    pub name: &'static str,
    pub value: fn(f64) -> f64,
    /// omega_r/eps at a share of the torque.
    inverse: fn(f64) -> f64,
    /// The regularisation of a case with this function, if there is one.
    pub smoothing: Option<Smoothing>,
}

pub(crate) const SHAPES: [Shape; 6] = [
    Shape {
        name: "tanh(omega_r/eps)",
        value: f64::tanh,
        inverse: f64::atanh,
        smoothing: Some(Smoothing::Tanh),
    },
    Shape {
        name: "(2/pi) arctan(omega_r/eps)",
        value: |x| x.atan() / FRAC_PI_2,
        inverse: |z| (FRAC_PI_2 * z).tan(),
        smoothing: Some(Smoothing::Arctan),
    },
    Shape {
        name: "omega_r/eps up to 1",
        value: |x| x.clamp(-1.0, 1.0),
        inverse: |z| z,
        smoothing: None,
    },
    Shape {
        name: "omega_r/sqrt(omega_r^2 + eps^2)",
        value: |x| x / x.hypot(1.0),
        inverse: |z| z / (1.0 - z * z).sqrt(),
        smoothing: None,
    },
    Shape {
        name: "omega_r/(|omega_r| + eps)",
        value: |x| x / (1.0 + x.abs()),
        inverse: |z| z / (1.0 - z.abs()),
        smoothing: None,
    },
    Shape {
        name: "1 - exp(-|omega_r|/eps)",
        value: |x| -(-x.abs()).exp_m1() * x.signum(),
        inverse: |z| -(-z.abs()).ln_1p() * z.signum(),
        smoothing: None,
    },
];

/// Range of usable torques: near zero and near its limit a torque says little about the speed.
const SHARES: (f64, f64) = (1e-3, 0.9);
/// Creep is slower than this part of slip speeds, and changes slower than this part of the acceleration by friction.
const SLOW: f64 = 0.05;
const STEADY: f64 = 0.02;
const FEWEST: u64 = 20;
/// Largest part of the squared speeds that the function may leave.
const LEFT: f64 = 1e-2;
const AT_REST: f64 = 1e-9;
/// Functions that leave parts this close to each other explain as much.
const SAME: f64 = 1e-9;

impl<'a> CreepPass<'a> {
    pub fn new(physics: &'a Physics) -> CreepPass<'a> {
        let system = physics.system();
        let (rotor, stator) = (system.rotor.surface_inertia(), system.stator.surface_inertia());
        CreepPass {
            physics,
            speed: physics.speed(),
            per_torque: 1.0 / rotor + 1.0 / stator,
            last: None,
            squares: 0.0,
            sums: [[0.0; 2]; SHAPES.len()],
            largest: 0.0,
            count: 0,
        }
    }

    pub fn add(&mut self, time: f64, y: &[f64]) {
        let (physics, system) = (self.physics, self.physics.system());
        let driving = physics.course.driving(time);
        let w = system.relative_velocity(&driving, y);
        let before = self.last.replace((time, w));
        let (Some((earlier, was)), true) = (before, w.abs() < SLOW * self.speed) else {
            return;
        };
        let limit = system.law_of(w).coefficient(w.abs()) * system.radius * physics.course.outside(time).normal_force;
        if limit <= 0.0 {
            return;
        }
        // Friction is what the interface transmits less what accelerates the surfaces.
        let accelerates = (w - was) / (self.per_torque * (time - earlier));
        let share = (system.transmitted_torque(&driving, y) - accelerates) / limit;
        let steady = accelerates.abs() <= STEADY * limit;
        if !steady || !(SHARES.0..SHARES.1).contains(&share.abs()) {
            return;
        }
        self.count += 1;
        self.squares += w * w;
        self.largest = self.largest.max(w.abs());
        for (sums, shape) in self.sums.iter_mut().zip(&SHAPES) {
            let a = (shape.inverse)(share);
            sums[0] += w * a;
            sums[1] += a * a;
        }
    }

    pub fn finish(self) -> Option<Creep> {
        if self.count < FEWEST || self.largest <= AT_REST * self.speed {
            return None;
        }
        let left = |sums: &[f64; 2]| 1.0 - sums[0] * sums[0] / (sums[1] * self.squares);
        let fits = self
            .sums
            .iter()
            .enumerate()
            .map(|(shape, sums)| (left(sums), shape, sums));
        let least = fits.clone().map(|fit| fit.0).min_by(f64::total_cmp)?;
        // One share of the torque shows no shape: then the first one, the commonest.
        let (least, shape, sums) = fits.into_iter().find(|fit| fit.0 <= least + SAME)?;
        (least <= LEFT).then(|| Creep {
            shape,
            speed: sums[0] / sums[1],
            largest: self.largest,
        })
    }
}

/// Initial speeds, in parts of slip speeds.
const SPEEDS: [f64; 3] = [1e-5, 1e-3, 3e-2];
/// Most steps of a run: a smooth law takes many in a stick.
const MOST_STEPS: usize = 300_000;

/// A function of [`SHAPES`] with its speed, rad/s.
#[derive(Debug)]
pub(crate) struct Smooth {
    shape: usize,
    speed: f64,
    /// The candidate shows it by its creep.
    told: bool,
}

impl Smooth {
    /// The function that the candidate's creep follows.
    pub fn shown(search: &Search<'_>) -> Vec<Proposal> {
        let told = true;
        let creep = search.shown.creep;
        proposals(creep.map(|Creep { shape, speed, .. }| Smooth { shape, speed, told }))
    }

    fn motion(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        let (shape, speed) = (self.shape, self.speed);
        let Some(function) = SHAPES[shape].smoothing else {
            let (time, state) = evidence.origin.as_ref()?;
            evidence.count_run()?;
            return stepper::creeping(evidence.physics, (shape, speed), (*time, state), evidence.observation?);
        };
        let mut system = evidence.case.case().system.clone();
        system.contact = ContactLaw::Regularised(Regularisation { function, speed });
        evidence.motion(&system, 10.0 * speed, evidence.starts.get(start)?)
    }
}

impl Cause for Smooth {
    /// Functions that a case can have, each with the speed that brings the motion closest to the candidate.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        if !evidence.physics.sticks() || evidence.observation.is_none() {
            return Vec::new();
        }
        let speed = evidence.physics.speed();
        let mut begin = Vec::new();
        for shape in (0..SHAPES.len()).filter(|&shape| SHAPES[shape].smoothing.is_some()) {
            let starts = 0..evidence.starts.len();
            begin.extend(starts.flat_map(|start| SPEEDS.map(|part| (shape, start, part * speed))));
        }
        let found = over_processors(begin.len(), &|| false, |k| {
            let (shape, start, begin) = begin[k];
            let of = |speed: f64| Smooth {
                shape,
                speed: speed.abs(),
                told: false,
            };
            let play = |speed: f64, until: f64| of(speed).motion(&evidence.until(until), start);
            let near = evidence.projected(begin, 1, &play)?;
            Some(of(fitted(evidence, near, near, &play)?))
        });
        proposals(found.into_iter().flatten())
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        let evidence = Evidence {
            most_steps: Some(MOST_STEPS),
            ..evidence.observed_as(evidence.observation)
        };
        self.motion(&evidence, start)
    }

    /// By samples, if there are any: creep that is never at rest has no events.
    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        let judged = evidence.judged(played, f64::INFINITY)?;
        Some(judged.by_samples_if(evidence.observation.is_some()))
    }

    /// One smooth function is much like another.
    fn least(&self, _: &Evidence<'_>) -> f64 {
        if self.told { 1.0 - ALL } else { EXACT }
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        2
    }

    fn is_told(&self) -> bool {
        self.told
    }

    fn has_events(&self, judged: &Judged) -> bool {
        judged.after.unmatched == 0
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let unit = search.evidence.physics.vocabulary().unit(Channel::RELATIVE_VELOCITY);
        let words = format!(
            "its friction has {} in the place of the sign, eps = {:.2e} {unit}",
            SHAPES[self.shape].name, self.speed
        );
        (CauseKind::RegularisedLaw, words)
    }
}
