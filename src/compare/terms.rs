//! Which term of the equations a candidate has otherwise, from its own samples.
//!
//! In slip the momentum of every inertia changes over two samples by the impulses of the torques on it, which Simpson's rule gives
//! from three. Where they miss the change by a multiple of one of them, that term has another factor.

use super::candidate::Block;
use super::reference::Physics;
use crate::case::Motion;
use crate::model::Mode;
use crate::model::trains::system::Side;

/// A term with the factor that a candidate's samples have it with.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OtherTerm {
    /// "inertia 0 of the stator", in translation "mass 0 of the stator".
    pub of: String,
    /// "the damping of shaft 0".
    pub term: String,
    /// In parts of the case's; of a term that the case does not have, `None`.
    pub factor: Option<f64>,
}

/// The torque of one term on one inertia.
#[derive(Debug, Clone)]
struct Term {
    name: String,
    /// Whether the case has it.
    present: bool,
    /// Sums of the miss times the impulse, and of the impulse squared.
    sums: [f64; 2],
}

#[derive(Debug, Clone)]
struct Inertia {
    of: String,
    terms: Vec<Term>,
    /// Sum of the misses squared, and of all impulses of the case squared.
    misses: f64,
    impulses: f64,
}

/// Adds up what the samples miss.
#[derive(Debug)]
pub(super) struct TermPass<'a> {
    physics: &'a Physics,
    /// A relative velocity below this shows no slip, rad/s.
    slowest: f64,
    /// Samples that are further apart say nothing, s.
    longest: f64,
    inertias: Vec<Inertia>,
    /// The last two samples.
    recent: [Option<Torques>; 2],
    triples: u64,
}

/// What acts at a sample.
#[derive(Debug, Clone)]
struct Torques {
    time: f64,
    mode: Mode,
    /// Speed of every inertia, rad/s, rotor first, and the torque of each of its terms, N m.
    inertias: Vec<(f64, Vec<f64>)>,
}

/// Samples in a natural period that Simpson's rule needs: it errs by (2 pi/50)^4/90 of an impulse, 3e-6.
const PER_PERIOD: f64 = 50.0;
/// Fewer triples are no evidence.
const FEWEST: u64 = 20;
/// The least part of all impulses that the miss is, and the largest part of its square that one term may leave.
const MISSED: f64 = 1e-4;
const LEFT: f64 = 1e-3;

impl<'a> TermPass<'a> {
    /// Before the first sample; a relative velocity up to `tolerance` (rad/s) is a stick.
    pub fn new(physics: &'a Physics, tolerance: f64) -> TermPass<'a> {
        TermPass {
            physics,
            slowest: (10.0 * tolerance).max(1e-3 * physics.speed()),
            longest: physics.scale.period / PER_PERIOD,
            inertias: Vec::new(),
            recent: [None, None],
            triples: 0,
        }
    }

    /// Takes the next samples; `columns` are the positions of the channels of the state in the block.
    pub fn add(&mut self, block: &Block, columns: &[usize]) {
        for (row, &time) in block.time.iter().enumerate() {
            let y = self.physics.y(|k| block.columns[columns[k]][row]);
            let now = self.torques(time, &y);
            if let (Some(now), [Some(b), Some(a)]) = (&now, &self.recent) {
                let (h, before) = (now.time - b.time, b.time - a.time);
                let even = (h - before).abs() <= 1e-6 * h && h <= self.longest;
                if even && a.mode == b.mode && b.mode == now.mode {
                    Self::triple(&mut self.inertias, self.physics, [a, b, now], h);
                    self.triples += 1;
                }
            }
            self.recent = match now {
                Some(now) => {
                    let [last, _] = std::mem::take(&mut self.recent);
                    [Some(now), last]
                }
                None => [None, None],
            };
        }
    }

    /// `None` out of slip.
    fn torques(&mut self, time: f64, y: &[f64]) -> Option<Torques> {
        let physics = self.physics;
        let (system, outside) = (physics.system(), physics.course.outside(time));
        let w = system.relative_velocity(&outside, y);
        if w.abs() <= self.slowest {
            return None;
        }
        let mode = Mode::sliding(w);
        let interface = system.interface_torque(mode, w.signum(), system.piece_of(w), &outside, y);
        let naming = self.inertias.is_empty();
        let (body, torque) = match physics.vocabulary().motion() {
            Motion::Rotation => ("inertia", "torque"),
            Motion::Translation => ("mass", "force"),
        };
        let mut inertias = Vec::new();
        for (name, side, driving) in [
            ("rotor", &system.rotor, &outside.rotor),
            ("stator", &system.stator, &outside.stator),
        ] {
            for (i, speed) in side.speeds(driving, y).into_iter().enumerate() {
                let (mut terms, mut named) = (Vec::new(), Vec::new());
                let mut add = |what: &dyn Fn() -> String, present: bool, value: f64| {
                    terms.push(value);
                    if naming {
                        named.push(Term {
                            name: what(),
                            present,
                            sums: [0.0; 2],
                        });
                    }
                };
                let mut shaft = |k: usize, sign: f64| {
                    add(
                        &|| format!("the stiffness of shaft {k}"),
                        true,
                        sign * side.stiffness[k] * side.twist(k, y),
                    );
                    let (damping, present) = or_one(side.damping[k]);
                    add(
                        &|| format!("the damping of shaft {k}"),
                        present,
                        sign * damping * side.twist_rate(k, y),
                    );
                };
                if i < side.shafts() {
                    shaft(i, side.sign);
                }
                if i > 0 {
                    shaft(i - 1, -side.sign);
                }
                let (viscous, present) = or_one(side.viscous[i]);
                add(&|| "its damping to the ground".to_owned(), present, -viscous * speed);
                if side.torque_on == Some(i) {
                    add(&|| format!("its external {torque}"), true, driving.torque);
                }
                if i == 0 {
                    add(&|| format!("the {torque} of friction"), true, -side.sign * interface);
                }
                if naming {
                    self.inertias.push(Inertia {
                        of: format!("{body} {i} of the {name}"),
                        terms: named,
                        misses: 0.0,
                        impulses: 0.0,
                    });
                }
                inertias.push((speed, terms));
            }
        }
        Some(Torques { time, mode, inertias })
    }

    fn triple(inertias: &mut [Inertia], physics: &Physics, [a, b, c]: [&Torques; 3], h: f64) {
        let system = physics.system();
        let all = |side: &Side| side.inertia.clone();
        let masses = all(&system.rotor).into_iter().chain(all(&system.stator));
        for (k, (inertia, mass)) in inertias.iter_mut().zip(masses).enumerate() {
            let impulse = |n: usize| {
                let at = |torques: &Torques| torques.inertias[k].1[n];
                h / 3.0 * (at(a) + 4.0 * at(b) + at(c))
            };
            let impulses: Vec<f64> = (0..inertia.terms.len()).map(impulse).collect();
            let present = impulses.iter().zip(&inertia.terms).filter(|(_, term)| term.present);
            let (sum, square) = present.fold((0.0, 0.0), |(sum, square), (x, _)| (sum + x, square + x * x));
            let miss = mass * (c.inertias[k].0 - a.inertias[k].0) - sum;
            inertia.misses += miss * miss;
            inertia.impulses += square;
            for (term, impulse) in inertia.terms.iter_mut().zip(impulses) {
                term.sums[0] += miss * impulse;
                term.sums[1] += impulse * impulse;
            }
        }
    }

    /// The terms, after the last sample.
    pub fn finish(self) -> Vec<OtherTerm> {
        if self.triples < FEWEST {
            return Vec::new();
        }
        let other = |inertia: Inertia| {
            if inertia.misses <= MISSED * MISSED * inertia.impulses {
                return None;
            }
            let left = |term: &Term| match term.sums {
                [product, square] if square > 0.0 => inertia.misses - product * product / square,
                _ => f64::INFINITY,
            };
            let best = inertia.terms.iter().min_by(|a, b| left(a).total_cmp(&left(b)))?;
            (left(best) <= LEFT * inertia.misses).then(|| OtherTerm {
                factor: best.present.then(|| 1.0 + best.sums[0] / best.sums[1]),
                term: best.name.clone(),
                of: inertia.of.clone(),
            })
        };
        self.inertias.into_iter().filter_map(other).collect()
    }
}

/// A coefficient, or 1 of one that the case does not have.
fn or_one(coefficient: f64) -> (f64, bool) {
    if coefficient == 0.0 {
        (1.0, false)
    } else {
        (coefficient, true)
    }
}
