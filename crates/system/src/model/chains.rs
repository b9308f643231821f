//! A system as chains of bodies, in the coordinates of its linear motions (stick and separation).
//!
//! The bodies are the inertias. In stick both surfaces are one body, which is at rest if one surface is. The
//! coordinates are the twists, scaled to the size of their rates, and one of two sets of speeds. A chain with a tie
//! to the ground or with bearings uses the speeds of its bodies. The rounding of a slow body among fast ones is then
//! that of its own change. A drifting chain uses its twist rates, and its common speed follows from its momentum. Two
//! further kinds of coordinates have no energy: constant torques, and the angle of a chain that turns in bearings.
//! The energy of the others never grows.

use super::equations::{Outside, Side, SystemEquations};
use nalgebra::{DMatrix, DVector};

/// An entry of the state or a coordinate, as a sum of terms (index, factor).
#[derive(Debug, Clone)]
pub(super) struct TermSum {
    pub of: usize,
    terms: Vec<(usize, f64)>,
}

impl TermSum {
    pub fn over(&self, values: &[f64]) -> f64 {
        let mut terms = self.terms.iter().map(|&(of, factor)| factor * values[of]);
        let first = terms.next().unwrap_or(0.0);
        terms.fold(first, |sum, term| sum + term)
    }
}

/// A chain without a tie to the ground and without bearings, whose momentum is constant.
#[derive(Debug)]
pub(super) struct Drifting {
    inertia: f64,
    /// For each of its speeds in the state: the entry, and the row of its excess over the common speed.
    pub speeds: Vec<(usize, DVector<f64>)>,
    torques: [bool; 2],
}

impl Drifting {
    /// Acceleration of the common speed under these torques (N m), rad/s^2.
    pub fn acceleration(&self, torques: [f64; 2]) -> f64 {
        let acting = torques.iter().zip(self.torques).filter(|(_, acts)| *acts);
        acting.map(|(torque, _)| torque).sum::<f64>() / self.inertia
    }
}

/// Angle of a body: a row over changes of the coordinates, plus the common angle if the chain drifts.
#[derive(Debug, Clone)]
pub(super) struct Turning {
    pub row: DVector<f64>,
    pub drifting: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum EntryKind {
    /// A chain with a tie to the ground. Its speeds are those of its bodies, from the ground on.
    Tied,
    /// A chain in bearings. Its speeds are those of its bodies, and the angle of one body is this coordinate.
    Turning(usize),
    Drifting,
}

#[derive(Debug)]
struct Shaft {
    side: usize,
    /// +1 for the rotor, -1 for the stator: twist = sign (outer angle - inner angle).
    sign: f64,
    /// Outer and inner body; `None` is the ground.
    outer: Option<usize>,
    inner: Option<usize>,
    stiffness: f64,
    damping: f64,
    /// Index of the twist in the state. The twist rate follows it.
    entry: usize,
    /// Coordinate of the twist rate in a drifting chain. The twist has the index of the shaft as its coordinate.
    rate: Option<usize>,
}

#[derive(Debug)]
struct Body {
    chain: usize,
    inertia: f64,
    viscous: f64,
    speed: Option<usize>,
}

#[derive(Debug)]
pub(super) struct Chains<'a> {
    sides: [&'a Side; 2],
    stuck: bool,
    /// Whether a surface at rest holds the other in stick.
    held: bool,
    bodies: Vec<Body>,
    /// Body of each inertia of rotor and stator; `None` is the ground.
    of_inertia: [Vec<Option<usize>>; 2],
    shafts: Vec<Shaft>,
    chains: Vec<EntryKind>,
    omega: f64,
    /// Side, coordinate and factor of each torque: x = torque / factor.
    torques: Vec<(usize, usize, f64)>,
    /// Number of coordinates with energy, which come first, and number of all coordinates.
    core: usize,
    dimension: usize,
    /// Angle of each body: from the ground, from its chain's angle, or relative to the chain's first body.
    turned: Vec<DVector<f64>>,
}

impl<'a> Chains<'a> {
    /// Chains in stick or separation; `None` if a shaft has no stiffness, or if nothing moves by itself.
    pub fn new(system: &'a SystemEquations, stuck: bool) -> Option<Chains<'a>> {
        let sides = [&system.rotor, &system.stator];
        if sides.iter().any(|side| side.stiffness.iter().any(|&k| k <= 0.0)) {
            return None;
        }
        let held = stuck && sides.iter().any(|side| side.inertia.is_empty());
        let mut bodies: Vec<Body> = Vec::new();
        let mut of_inertia: [Vec<Option<usize>>; 2] = [Vec::new(), Vec::new()];
        for (index, side) in sides.iter().enumerate() {
            for (i, (&inertia, &viscous)) in side.inertia.iter().zip(&side.viscous).enumerate() {
                let body = match (stuck && i == 0, held) {
                    (true, true) => None,
                    (true, false) if index == 1 => of_inertia[0][0],
                    _ => Some(bodies.len()),
                };
                of_inertia[index].push(body);
                match body.and_then(|body| bodies.get_mut(body)) {
                    Some(joined) => {
                        joined.inertia += inertia;
                        joined.viscous += viscous;
                    }
                    None if body.is_some() => bodies.push(Body {
                        chain: if stuck { 0 } else { index },
                        inertia,
                        viscous,
                        speed: None,
                    }),
                    None => {}
                }
            }
        }
        let mut shafts = Vec::new();
        for (side, index) in sides.into_iter().zip(0..) {
            for i in 0..side.shafts() {
                let of = &of_inertia[index];
                shafts.push(Shaft {
                    side: index,
                    sign: side.sign,
                    outer: of.get(i + 1).copied().flatten(),
                    inner: of[i],
                    stiffness: side.stiffness[i],
                    damping: side.damping[i],
                    entry: side.twists + 2 * i,
                    rate: None,
                });
            }
        }
        let mut chains = Chains {
            sides,
            stuck,
            held,
            dimension: shafts.len(),
            core: 0,
            chains: Vec::new(),
            omega: 1.0,
            torques: Vec::new(),
            turned: Vec::new(),
            bodies,
            of_inertia,
            shafts,
        };
        chains.number_coordinates();
        (chains.core > 0).then_some(())?;
        chains.turned = chains.angles()?;
        Some(chains)
    }

    fn number_coordinates(&mut self) {
        let tied = |chain: usize| match self.stuck {
            true => self.sides.iter().any(|side| side.speed.is_none()),
            false => self.sides[chain].speed.is_none(),
        };
        let braked = |chain: usize| {
            let mut members = self.bodies.iter().filter(|body| body.chain == chain);
            members.any(|body| body.viscous != 0.0)
        };
        let kinds = (0..if self.stuck { 1 } else { 2 }).map(|chain| match (tied(chain), braked(chain)) {
            (true, _) => EntryKind::Tied,
            (false, true) => EntryKind::Turning(0),
            (false, false) => EntryKind::Drifting,
        });
        let mut kinds: Vec<EntryKind> = kinds.collect();
        let mut next = self.dimension;
        let mut coordinate = || {
            next += 1;
            next - 1
        };
        for body in self
            .bodies
            .iter_mut()
            .filter(|body| kinds[body.chain] != EntryKind::Drifting)
        {
            body.speed = Some(coordinate());
        }
        for shaft in &mut self.shafts {
            let chain = shaft.inner.or(shaft.outer).map(|body| self.bodies[body].chain);
            if chain.is_some_and(|chain| kinds[chain] == EntryKind::Drifting) {
                shaft.rate = Some(coordinate());
            }
        }
        self.core = next;
        let frequencies = self.sides.iter().flat_map(|side| {
            let lightest = |i: usize| side.inertia[i].min(side.inertia.get(i + 1).copied().unwrap_or(f64::INFINITY));
            (0..side.shafts()).map(move |i| (side.stiffness[i] / lightest(i)).sqrt())
        });
        let fastest = frequencies.fold(0.0, f64::max);
        if fastest > 0.0 {
            self.omega = 2f64.powi(fastest.log2().round() as i32);
        }
        for (index, side) in self.sides.into_iter().enumerate() {
            if let Some(on) = side.torque_on {
                self.torques.push((index, next, side.inertia[on] * self.omega));
                next += 1;
            }
        }
        for kind in &mut kinds {
            if let EntryKind::Turning(angle) = kind {
                *angle = next;
                next += 1;
            }
        }
        self.dimension = next;
        self.chains = kinds;
    }

    fn angles(&self) -> Option<Vec<DVector<f64>>> {
        let mut turned: Vec<Option<DVector<f64>>> = vec![None; self.bodies.len()];
        for (chain, kind) in self.chains.iter().enumerate() {
            if let (Some(first), true) = (self.first_of(chain), *kind != EntryKind::Tied) {
                turned[first] = Some(match kind {
                    EntryKind::Turning(angle) => self.unit(*angle) / self.omega,
                    _ => self.zero(),
                });
            }
        }
        for _ in 0..self.bodies.len() {
            for (twist, shaft) in self.shafts.iter().enumerate() {
                let twist = self.unit(twist) * (shaft.sign / self.omega);
                let of = |body: Option<usize>| body.map_or(Some(self.zero()), |body| turned[body].clone());
                match (of(shaft.outer), of(shaft.inner)) {
                    (Some(outer), None) => turned[shaft.inner?] = Some(outer - twist),
                    (None, Some(inner)) => turned[shaft.outer?] = Some(inner + twist),
                    _ => {}
                }
            }
        }
        turned.into_iter().collect()
    }

    fn first_of(&self, chain: usize) -> Option<usize> {
        self.bodies.iter().position(|body| body.chain == chain)
    }

    fn zero(&self) -> DVector<f64> {
        DVector::zeros(self.dimension)
    }

    fn unit(&self, coordinate: usize) -> DVector<f64> {
        let mut row = self.zero();
        row[coordinate] = 1.0;
        row
    }

    pub fn dimension(&self) -> usize {
        self.dimension
    }

    pub fn torques(&self) -> &[(usize, usize, f64)] {
        &self.torques
    }

    fn driven_body(&self, side: usize) -> Option<usize> {
        self.sides[side].torque_on.and_then(|on| self.of_inertia[side][on])
    }

    fn rate(&self, shaft: &Shaft) -> DVector<f64> {
        let speed = |body: Option<usize>| body.and_then(|body| self.bodies[body].speed);
        match shaft.rate {
            Some(rate) => self.unit(rate),
            None => {
                let of = |body| speed(body).map_or(self.zero(), |speed| self.unit(speed));
                (of(shaft.outer) - of(shaft.inner)) * shaft.sign
            }
        }
    }

    /// A in x' = A x.
    pub fn flow(&self) -> DMatrix<f64> {
        let mut accelerations = vec![self.zero(); self.bodies.len()];
        for (twist, shaft) in self.shafts.iter().enumerate() {
            let torque = self.unit(twist) * (shaft.stiffness / self.omega) + self.rate(shaft) * shaft.damping;
            for (body, sign) in [(shaft.outer, -shaft.sign), (shaft.inner, shaft.sign)] {
                if let Some(body) = body {
                    accelerations[body] += &torque * (sign / self.bodies[body].inertia);
                }
            }
        }
        for &(side, coordinate, factor) in &self.torques {
            if let Some(body) = self.driven_body(side) {
                accelerations[body][coordinate] += factor / self.bodies[body].inertia;
            }
        }
        let mut a = DMatrix::zeros(self.dimension, self.dimension);
        for (body, acceleration) in self.bodies.iter().zip(&mut accelerations) {
            if let Some(speed) = body.speed {
                acceleration[speed] -= body.viscous / body.inertia;
                a.set_row(speed, &acceleration.transpose());
            }
        }
        for (twist, shaft) in self.shafts.iter().enumerate() {
            a.set_row(twist, &(self.rate(shaft) * self.omega).transpose());
            if let Some(rate) = shaft.rate {
                let of = |body: Option<usize>| body.map_or(self.zero(), |body| accelerations[body].clone());
                a.set_row(rate, &((of(shaft.outer) - of(shaft.inner)) * shaft.sign).transpose());
            }
        }
        for (chain, kind) in self.chains.iter().enumerate() {
            let first = self.first_of(chain).and_then(|first| self.bodies[first].speed);
            if let (EntryKind::Turning(angle), Some(speed)) = (*kind, first) {
                a[(angle, speed)] = self.omega;
            }
        }
        a
    }

    fn ahead(&self, body: usize) -> DVector<f64> {
        let chain = self.bodies[body].chain;
        let mut sum = self.zero();
        for (other, turned) in self.bodies.iter().zip(&self.turned) {
            if other.chain == chain {
                sum += (&self.turned[body] - turned) * other.inertia;
            }
        }
        sum / self.inertia(chain)
    }

    fn inertia(&self, chain: usize) -> f64 {
        let members = self.bodies.iter().filter(|body| body.chain == chain);
        members.map(|body| body.inertia).sum()
    }

    /// Speed of a body relative to the common motion: the row of [`Self::ahead`] with twist rates instead of twists.
    fn faster(&self, body: usize) -> DVector<f64> {
        let angle = self.ahead(body);
        let mut speed = self.zero();
        for (twist, shaft) in self.shafts.iter().enumerate() {
            if let Some(rate) = shaft.rate {
                speed[rate] = angle[twist] * self.omega;
            }
        }
        speed
    }

    /// P in x^T P x, which is twice the energy relative to the common motion.
    pub fn energy(&self) -> DMatrix<f64> {
        let mut energy = DMatrix::zeros(self.dimension, self.dimension);
        for (twist, shaft) in self.shafts.iter().enumerate() {
            energy[(twist, twist)] = shaft.stiffness / (self.omega * self.omega);
        }
        for (index, body) in self.bodies.iter().enumerate() {
            match body.speed {
                Some(speed) => energy[(speed, speed)] = body.inertia,
                None => {
                    let row = self.faster(index);
                    energy += &row * row.transpose() * body.inertia;
                }
            }
        }
        energy
    }

    /// Coordinate, state entry and factor of each twist: x = factor y.
    pub fn twists(&self) -> Vec<(usize, usize, f64)> {
        let shafts = self.shafts.iter().enumerate();
        shafts.map(|(twist, shaft)| (twist, shaft.entry, self.omega)).collect()
    }

    /// State entries that the coordinates determine.
    pub fn entries(&self) -> Vec<TermSum> {
        let mut entries = Vec::new();
        for (twist, shaft) in self.shafts.iter().enumerate() {
            entries.push(TermSum {
                of: shaft.entry,
                terms: vec![(twist, 1.0 / self.omega)],
            });
            let rate = self.rate(shaft);
            let terms = rate.iter().copied().enumerate().filter(|term| term.1 != 0.0);
            entries.push(TermSum {
                of: shaft.entry + 1,
                terms: terms.collect(),
            });
        }
        for (side, of_inertia) in self.sides.iter().zip(&self.of_inertia) {
            let outermost = of_inertia.last().copied().flatten();
            let coordinate = outermost.and_then(|body| self.bodies[body].speed);
            if let (Some(of), Some(coordinate)) = (side.speed, coordinate) {
                let terms = vec![(coordinate, 1.0)];
                entries.push(TermSum { of, terms });
            }
        }
        entries
    }

    /// Speeds and twist rates among the coordinates, as sums over the state. The surfaces' common speed is read from
    /// a tied train.
    pub fn speeds(&self) -> Vec<TermSum> {
        let rates = self.shafts.iter().filter_map(|shaft| {
            Some(TermSum {
                of: shaft.rate?,
                terms: vec![(shaft.entry + 1, 1.0)],
            })
        });
        let mut speeds: Vec<TermSum> = rates.collect();
        let rotor_alone = self.sides[0].speed.is_none() && self.sides[1].speed.is_some();
        for index in if rotor_alone { [1, 0] } else { [0, 1] } {
            let side = self.sides[index];
            let mut terms: Vec<(usize, f64)> = side.speed.map(|speed| (speed, 1.0)).into_iter().collect();
            for i in (0..side.inertia.len()).rev() {
                if i < side.shafts() {
                    terms.push((side.twists + 2 * i + 1, -side.sign));
                }
                let Some(of) = self.of_inertia[index][i].and_then(|body| self.bodies[body].speed) else {
                    continue;
                };
                speeds.retain(|speed| speed.of != of);
                let terms = terms.clone();
                speeds.push(TermSum { of, terms });
            }
        }
        speeds
    }

    fn drifting_index(&self, chain: usize) -> Option<usize> {
        let before = &self.chains[..chain];
        let index = before.iter().filter(|kind| **kind == EntryKind::Drifting).count();
        (self.chains[chain] == EntryKind::Drifting).then_some(index)
    }

    pub fn drifting(&self) -> Vec<Drifting> {
        let drifting = |chain: usize| {
            let of_chain = |body: Option<usize>| body.filter(|&body| self.bodies[body].chain == chain);
            let speeds = self
                .sides
                .iter()
                .zip(&self.of_inertia)
                .filter_map(|(side, of_inertia)| {
                    let outermost = of_chain(of_inertia.last().copied().flatten())?;
                    Some((side.speed?, self.faster(outermost)))
                });
            Drifting {
                inertia: self.inertia(chain),
                speeds: speeds.collect(),
                torques: [0, 1].map(|side| of_chain(self.driven_body(side)).is_some()),
            }
        };
        let chains = (0..self.chains.len()).filter(|&chain| self.chains[chain] == EntryKind::Drifting);
        chains.map(drifting).collect()
    }

    fn turning(&self, body: usize) -> Turning {
        let drifting = self.drifting_index(self.bodies[body].chain);
        let row = match drifting {
            Some(_) => self.ahead(body),
            None => self.turned[body].clone(),
        };
        Turning { row, drifting }
    }

    pub fn driven(&self, side: usize) -> Option<Turning> {
        self.driven_body(side).map(|body| self.turning(body))
    }

    pub fn surface(&self, side: usize) -> Option<Turning> {
        let body = self.of_inertia[side].first().copied().flatten();
        body.map(|body| self.turning(body))
    }

    /// Angle of the stator's outermost inertia; `None` unless both chains are free.
    pub fn outermost(&self) -> Option<Turning> {
        let free = self.sides.iter().all(|side| side.speed.is_some());
        let body = self.of_inertia[1].last().copied().flatten();
        body.filter(|_| free).map(|body| self.turning(body))
    }

    /// The torque that the breakaway test uses, N m, as a row over the coordinates.
    pub fn tested(&self, system: &SystemEquations) -> DVector<f64> {
        let entries = self.entries();
        let of = |coordinate: usize, _| {
            let x = self.unit(coordinate);
            let mut y = vec![0.0; system.dimension];
            for entry in &entries {
                y[entry.of] = entry.over(x.as_slice());
            }
            let mut outside = Outside::default();
            for &(side, _, factor) in self.torques.iter().filter(|torque| torque.1 == coordinate) {
                let driving = match side {
                    0 => &mut outside.rotor,
                    _ => &mut outside.stator,
                };
                driving.torque = factor;
            }
            system.tested_torque(&outside, &y)
        };
        DVector::from_fn(self.dimension, of)
    }

    /// Matrix from any coordinates to those at rest. Inner `None`: they are zero. Outer `None`: they are unknown.
    ///
    /// Rest is A x = 0 under the present torques. A chain between two walls also keeps the sum l x of its twists: all
    /// its shafts come to rest with one additional torque, r. A + r l has an inverse.
    #[allow(clippy::option_option)] // not known, and zero
    pub fn rest(&self, a: &DMatrix<f64>) -> Option<Option<DMatrix<f64>>> {
        let tied = |side: usize| self.sides[side].speed.is_none() && !self.sides[side].inertia.is_empty();
        let of_side = |side: usize| (0..self.shafts.len()).filter(move |&twist| self.shafts[twist].side == side);
        let walled: Vec<Vec<usize>> = match (self.stuck, self.held) {
            (true, true) => (0..2)
                .filter(|&side| tied(side))
                .map(|side| of_side(side).collect())
                .collect(),
            (true, false) if tied(0) && tied(1) => vec![(0..self.shafts.len()).collect()],
            _ => Vec::new(),
        };
        if walled.is_empty() && self.torques.is_empty() {
            return Some(None);
        }
        let core = self.core;
        let mut kept = DMatrix::zeros(core, core);
        for chain in walled {
            let compliance: f64 = chain.iter().map(|&twist| 1.0 / self.shafts[twist].stiffness).sum();
            for &row in &chain {
                let share = self.omega / self.shafts[row].stiffness / compliance;
                chain.iter().for_each(|&column| kept[(row, column)] = share);
            }
        }
        let inverse = (a.view((0, 0), (core, core)) + &kept).try_inverse()?;
        let mut rest = DMatrix::zeros(self.dimension, self.dimension);
        rest.view_mut((0, 0), (core, core)).copy_from(&(&inverse * kept));
        for &(_, coordinate, _) in &self.torques {
            let column = -(&inverse * a.view((0, coordinate), (core, 1)));
            rest.view_mut((0, coordinate), (core, 1)).copy_from(&column);
            rest[(coordinate, coordinate)] = 1.0;
        }
        rest.iter().all(|entry| entry.is_finite()).then_some(Some(rest))
    }
}
