//! Expansions of several motions at once, each in a lane of its own.
//!
//! What a lane holds is to the last bit what the expansion of its motion alone would be: only motions that take the same steps are
//! expanded together, in the same operations and the same order, and no lane sees another.

use super::{Expansion, Series, TERMS};
use crate::friction::{FrictionLaw, FrictionSeries, Law};
use crate::model::Mode;
use crate::model::equations::SystemEquations;
use crate::numerics::Number;
use crate::numerics::lanes::Lanes;
use crate::simulation::dynamics::{SystemDynamics, SystemLocation};
use std::array;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// A motion whose expansion is asked for, and where it goes.
#[derive(Debug)]
pub(in crate::simulation) struct Motion {
    /// The system.
    pub dynamics: Arc<SystemDynamics>,
    /// In which mode it is.
    pub location: SystemLocation,
    /// When, s.
    pub t: f64,
    /// The unit of its powers of time, s.
    pub unit: f64,
    /// The state then.
    pub y: Vec<f64>,
    /// The expansion.
    pub expansion: Box<Expansion>,
    /// Whether it has been filled.
    pub filled: bool,
}

/// Series of what drives a motion: the normal force, and speed and torque of either side.
const DRIVING: usize = 5;

/// What decides on the steps of an expansion beside the form of its system.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Steps {
    mode: Mode,
    sense: i8,
    degrees: [Option<usize>; DRIVING],
}

impl Motion {
    /// Fills the expansion.
    pub fn expand(&mut self) {
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        self.expansion
            .expand((system, excitation), &self.location, self.t, &self.y, self.unit);
        self.filled = true;
    }

    /// Lets the expansion know what drives the motion.
    fn drive(&mut self) {
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        self.expansion
            .drive((system, excitation), &self.location, self.t, self.unit);
    }

    /// Once it is known what drives the motion.
    fn steps(&self) -> Steps {
        let outside = &self.expansion.outside;
        let [rotor, stator] = &outside.sides;
        Steps {
            mode: self.location.mode,
            sense: self.location.sense,
            degrees: [
                Some(outside.degree),
                rotor.speed_degree,
                stator.speed_degree,
                Some(rotor.torque_degree),
                Some(stator.torque_degree),
            ],
        }
    }

    /// Whether the other motion, which takes the same [steps](Self::steps), is one of equations that differ in nothing but numbers.
    fn is_alike(&self, other: &Motion) -> bool {
        are_alike(
            (&self.dynamics, self.location.piece),
            (&other.dynamics, other.location.piece),
        )
    }
}

/// Whether two systems, on these pieces of their laws, differ in nothing but numbers.
fn are_alike(one: (&SystemDynamics, usize), other: (&SystemDynamics, usize)) -> bool {
    let [own, others] = [one, other].map(|(dynamics, piece)| (&dynamics.system, dynamics.system.law_in(piece)));
    own.0.is_alike(others.0) && own.1.is_alike(others.1)
}

/// Room for the expansions of up to `L` motions.
#[derive(Debug, Default)]
pub(in crate::simulation) struct SideBySide<const L: usize> {
    shared: Option<Shared<L>>,
}

/// An expansion of motions of systems that are alike.
#[derive(Debug)]
struct Shared<const L: usize> {
    /// Whose numbers each lane has, and of which piece of the law.
    sources: [(Arc<SystemDynamics>, usize); L],
    system: SystemEquations<Lanes<L>>,
    expansion: Box<Expansion<Lanes<L>>>,
    y: Vec<Lanes<L>>,
    /// Up to which degree each lane has coefficients of what drives the motion.
    degrees: [[usize; DRIVING]; L],
}

/// Something made of lanes, from as many things made of doubles: `read` lists the numbers of one of them, and `write` makes the whole,
/// for which it asks for the numbers in the same order.
fn in_lanes<A, M, const L: usize>(
    of: [&A; L],
    read: impl Fn(&A, &mut dyn FnMut(f64)),
    write: impl FnOnce(&mut dyn FnMut() -> Lanes<L>) -> M,
) -> M {
    let numbers = of.map(|one| {
        let mut numbers = Vec::new();
        read(one, &mut |number| numbers.push(number));
        numbers
    });
    let mut next = 0;
    write(&mut || {
        next += 1;
        Lanes::from_fn(|lane| numbers[lane][next - 1])
    })
}

/// The law of each lane.
fn laws<const L: usize>(of: &[(Arc<SystemDynamics>, usize); L]) -> FrictionSeries<Lanes<L>, TERMS> {
    let laws = of.each_ref().map(|(dynamics, piece)| dynamics.system.law_in(*piece));
    let read = |law: &FrictionLaw, take: &mut dyn FnMut(f64)| {
        law.series_in::<f64, 1>(&mut |number| {
            take(number);
            number
        });
    };
    in_lanes(laws, read, |next| laws[0].series_in(&mut |_| next()))
}

impl<const L: usize> Shared<L> {
    fn new(sources: [(Arc<SystemDynamics>, usize); L]) -> Self {
        let systems = sources.each_ref().map(|(dynamics, _)| &dynamics.system);
        let read = |system: &SystemEquations, take: &mut dyn FnMut(f64)| {
            let take = RefCell::new(take);
            system.map(|number| take.borrow_mut()(number));
        };
        let system = in_lanes(systems, read, |next| {
            let next = RefCell::new(next);
            systems[0].map(|_| next.borrow_mut()())
        });
        Shared {
            expansion: Box::new(Expansion::with_law(&system, None, laws(&sources))),
            y: vec![Lanes::of(0.0); system.dimension],
            degrees: [[TERMS - 1; DRIVING]; L],
            system,
            sources,
        }
    }

    /// Whether a lane has the numbers of a motion.
    fn holds(&self, lane: usize, motion: &Motion) -> bool {
        let (dynamics, piece) = &self.sources[lane];
        Arc::ptr_eq(dynamics, &motion.dynamics) && *piece == motion.location.piece
    }

    /// Gives motions that are alike, and take the steps of those that have the lanes now, the lanes of their places.
    fn admit(&mut self, motions: &[Option<&mut Motion>; L]) {
        let (mut systems, mut pieces) = (false, false);
        for (source, motion) in self.sources.iter_mut().zip(motions) {
            let Some(motion) = motion else { continue };
            systems |= !Arc::ptr_eq(&source.0, &motion.dynamics);
            pieces |= source.1 != motion.location.piece;
            *source = (motion.dynamics.clone(), motion.location.piece);
        }
        if systems {
            *self = Shared::new(self.sources.clone());
        } else if pieces {
            self.expansion.law = laws(&self.sources);
        }
    }

    /// Fills the expansions of motions that take the same steps, each by the lane of its place.
    fn expand(&mut self, motions: &mut [Option<&mut Motion>; L]) {
        let Some(location) = motions.iter().flatten().map(|motion| motion.location).next() else {
            return;
        };
        for (lane, motion) in motions.iter_mut().enumerate() {
            let Some(motion) = motion else { continue };
            self.expansion
                .take_driving(lane, &motion.expansion, &mut self.degrees[lane]);
            for (all, own) in self.y.iter_mut().zip(&motion.y) {
                all.0[lane] = *own;
            }
        }
        pulp::Arch::new().dispatch(Expanding {
            expansion: &mut self.expansion,
            system: &self.system,
            location: &location,
            y: &self.y,
        });
        for (lane, motion) in motions.iter_mut().enumerate() {
            if let Some(motion) = motion {
                self.expansion.give(lane, &motion.location, &mut motion.expansion);
                motion.filled = true;
            }
        }
    }
}

impl<const L: usize> SideBySide<L> {
    /// Fills expansions of motions that have others to be expanded with; those that are not filled are to be filled alone. A motion is
    /// best always in the same place.
    ///
    /// A panic fills none: whose it was comes out where each is filled alone.
    pub fn expand(&mut self, mut motions: [Option<&mut Motion>; L]) {
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            let mut left = motions.each_mut().map(|motion| motion.as_deref_mut());
            for motion in left.iter_mut().flatten() {
                motion.drive();
            }
            while let Some(first) = left.iter().position(Option::is_some) {
                self.expand_some(&mut left, first);
            }
        }));
        if panicked.is_err() {
            self.shared = None;
            for motion in motions.into_iter().flatten() {
                motion.filled = false;
            }
        }
    }

    /// Those that can be expanded with the first, which are taken out.
    fn expand_some(&mut self, left: &mut [Option<&mut Motion>; L], first: usize) {
        let mut group: [Option<&mut Motion>; L] = array::from_fn(|_| None);
        let Some(reference) = left[first].take() else { return };
        let steps = reference.steps();
        let holds = |lane: usize, motion: &Motion| {
            let shared = self.shared.as_ref();
            shared.is_some_and(|shared| shared.holds(lane, motion))
        };
        let reference_held = holds(first, reference);
        let mut all_held = reference_held;
        for (lane, (place, motion)) in group.iter_mut().zip(left.iter_mut()).enumerate() {
            // What the lanes hold is alike.
            *place = motion.take_if(|motion| {
                motion.steps() == steps && (reference_held && holds(lane, motion) || reference.is_alike(motion))
            });
            all_held &= place.as_ref().is_none_or(|motion| holds(lane, motion));
        }
        group[first] = Some(reference);
        if group.iter().flatten().count() < 2 {
            return;
        }
        if !all_held {
            self.admit(&group, first);
        }
        if let Some(shared) = &mut self.shared {
            shared.expand(&mut group);
        }
    }

    /// Makes room for a group, and keeps the other lanes if they are alike.
    fn admit(&mut self, group: &[Option<&mut Motion>; L], first: usize) {
        let Some(reference) = &group[first] else { return };
        let fits = |shared: &Shared<L>| {
            let (dynamics, piece) = &shared.sources[first];
            are_alike((&reference.dynamics, reference.location.piece), (dynamics, *piece))
        };
        match self.shared.as_mut().filter(|shared| fits(shared)) {
            Some(shared) => shared.admit(group),
            None => {
                let source = |motion: &Motion| (motion.dynamics.clone(), motion.location.piece);
                let sources = group
                    .each_ref()
                    .map(|motion| source(motion.as_ref().unwrap_or(reference)));
                self.shared = Some(Shared::new(sources));
            }
        }
    }
}

/// An expansion to be filled with the vectors that the processor has.
struct Expanding<'a, const L: usize> {
    expansion: &'a mut Expansion<Lanes<L>>,
    system: &'a SystemEquations<Lanes<L>>,
    location: &'a SystemLocation,
    y: &'a [Lanes<L>],
}

impl<const L: usize> pulp::WithSimd for Expanding<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.expansion.expand_driven(self.system, self.location, self.y);
    }
}

impl<const L: usize> Expansion<Lanes<L>> {
    /// Takes from an expansion what drives its motion; `degrees` says up to where the lane has coefficients, before and after.
    fn take_driving(&mut self, lane: usize, from: &Expansion, degrees: &mut [usize; DRIVING]) {
        self.unit.0[lane] = from.unit;
        let (all, own) = (&mut self.outside, &from.outside);
        let put = |all: &mut Series<Lanes<L>>, own: &Series, degree: usize, before: usize| {
            for n in 0..=degree.max(before) {
                all[n].0[lane] = if n <= degree { own[n] } else { 0.0 };
            }
        };
        put(&mut all.normal_force, &own.normal_force, own.degree, degrees[0]);
        (all.degree, degrees[0]) = (own.degree, own.degree);
        for (index, (all, own)) in all.sides.iter_mut().zip(&own.sides).enumerate() {
            all.speed_degree = own.speed_degree;
            let (degree, before) = (own.speed_degree.unwrap_or(0), &mut degrees[1 + index]);
            put(&mut all.speed, &own.speed, degree, *before);
            put(&mut all.acceleration, &own.acceleration, degree, *before);
            *before = degree;
            let (degree, before) = (own.torque_degree, &mut degrees[3 + index]);
            put(&mut all.torque, &own.torque, degree, *before);
            (all.torque_degree, *before) = (degree, degree);
        }
    }

    /// Gives an expansion what its lane has.
    fn give(&self, lane: usize, location: &SystemLocation, to: &mut Expansion) {
        let give = |from: &Series<Lanes<L>>, to: &mut Series| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = from.0[lane];
            }
        };
        for (from, to) in self.state.iter().zip(&mut to.state) {
            give(from, to);
        }
        give(&self.relative_velocity, &mut to.relative_velocity);
        give(&self.interface, &mut to.interface);
        if location.mode == Mode::Stick {
            give(&self.limit, &mut to.limit);
        }
        if location.mode.sense() != 0 {
            give(&self.slope, &mut to.slope);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource, Override};

    /// In a slip of some speed, with the twists and speeds of nothing in particular.
    fn motion(case: &str, setting: &str, (mode, speed): (Mode, f64)) -> Motion {
        let setting = Override::parse(setting).unwrap();
        let case = Case::read(&CaseSource::built_in(case).unwrap(), &[setting]).unwrap();
        let dynamics = Arc::new(SystemDynamics::new(&case.system, 0.0));
        let mut y: Vec<f64> = (0..dynamics.system.dimension)
            .map(|k| 1e-3 * (1.0 + k as f64).sin())
            .collect();
        y[dynamics.system.rotor.speed.unwrap()] = speed;
        let t = dynamics.excitation.corners().last().copied().unwrap_or(0.0) + 0.5;
        let location = SystemLocation::new(mode, dynamics.excitation.stretch(t));
        Motion {
            expansion: Box::new(Expansion::new(&dynamics.system, &dynamics.excitation)),
            unit: dynamics.unit(location.stretch),
            location,
            t,
            y,
            dynamics,
            filled: false,
        }
    }

    /// Every coefficient, in bits.
    fn bits(of: &Expansion) -> Vec<u64> {
        let series = of.state.iter().chain([&of.relative_velocity, &of.interface, &of.slope]);
        series.flatten().map(|c| c.to_bits()).collect()
    }

    /// Slips of different brakes together; one the other way, and one of another system, are left to be filled alone. Then others in the
    /// same places.
    #[test]
    fn property_lanes_hold_what_each_motion_is_alone() {
        let forward = Mode::SlipForward;
        let mut side_by_side = SideBySide::<4>::default();
        for round in 0..3 {
            let of =
                |index: u32, kind| motion("paper-si", &format!("torsion.damping={}", 20 + 4 * round + index), kind);
            let mut motions = [
                of(0, (forward, 8.0)),
                match round {
                    1 => of(1, (Mode::SlipBackward, -3.0)),
                    2 => motion("drill-string", "friction.decay=0.8", (forward, 5.0)),
                    _ => of(1, (forward, 2.0)),
                },
                of(2, (forward, 0.5)),
                of(3, (forward, 11.0)),
            ];
            side_by_side.expand(motions.each_mut().map(Some));
            for (lane, motion) in motions.iter_mut().enumerate() {
                assert_eq!(motion.filled, round == 0 || lane != 1, "round {round}, lane {lane}");
                let together = bits(&motion.expansion);
                motion.expand();
                assert!(
                    !motion.filled || lane == 1 && round > 0 || together == bits(&motion.expansion),
                    "{round}, {lane}"
                );
            }
        }
    }
}
