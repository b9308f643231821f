//! Coordinates in which the Jacobian of a long chain is a band.
//!
//! In twist coordinates every speed is a sum of twist rates, and bearings that damp a speed couple an inertia with all outside of
//! it. In speeds and twists, one after the other along the chain from the far end of the stator to that of the rotor, an inertia
//! is coupled with its neighbours alone:
//!
//! ```text
//! stator  v_(n-1) q_(n-2) ... q_0 v_0 | slip, bristles | v_0 q_0 v_1 ... rotor | the other quadratures
//! ```
//!
//! A change of coordinates takes one pass along the chain, and a linear system n steps of constant cost.

use super::Mode;
use super::equations::{Outside, Side, SystemEquations};
use crate::numerics::band::BandMut;

/// How far from the diagonal an element may be: in stick the speed of one surface depends on that of the inertia beyond the
/// other.
pub(crate) const HALF_WIDTH: usize = 4;

/// Components of the motion from which on a band takes less time than a dense matrix.
const LONG: usize = 20;

/// Where the components are, and the linear part of the equations.
#[derive(Debug)]
pub(crate) struct ChainCoordinates {
    /// Of a component of the state; a twist rate becomes the speed of the inertia inside its shaft.
    places: Vec<usize>,
    /// The columns of the rates for T = 0, within the band.
    free: Vec<[f64; 2 * HALF_WIDTH + 1]>,
    /// The rates per unit of T, and what omega_r and T_f are made of.
    interface: Vec<(usize, f64)>,
    relative_velocity: Vec<(usize, f64)>,
    transmitted: Vec<(usize, f64)>,
}

impl ChainCoordinates {
    /// Of trains so long that a linear system takes less time so.
    pub(crate) fn of_long(system: &SystemEquations) -> Option<Self> {
        (system.mechanical() >= LONG).then(|| ChainCoordinates::new(system))
    }

    fn new(system: &SystemEquations) -> Self {
        let mut order = Vec::with_capacity(system.dimension);
        let stator = &system.stator;
        order.extend(stator.speed);
        for i in (0..stator.shafts()).rev() {
            order.extend([stator.twists + 2 * i, stator.twists + 2 * i + 1]);
        }
        let first = stator.twists + 2 * stator.shafts() + usize::from(stator.speed.is_some());
        // The slip is behind the bristles.
        order.extend((first..=system.slip).rev());
        let rotor = &system.rotor;
        for i in 0..rotor.shafts() {
            order.extend([rotor.twists + 2 * i + 1, rotor.twists + 2 * i]);
        }
        order.extend(rotor.speed);
        order.extend(system.slip + 1..system.dimension);
        let mut places = vec![0; system.dimension];
        for (place, &component) in order.iter().enumerate() {
            places[component] = place;
        }
        let mut coordinates = ChainCoordinates {
            places,
            free: vec![[0.0; 2 * HALF_WIDTH + 1]; system.dimension],
            interface: Vec::new(),
            relative_velocity: Vec::new(),
            transmitted: Vec::new(),
        };
        coordinates.fill(system);
        coordinates
    }

    /// By unit changes, each of which reaches its neighbours alone. What rounding leaves beyond them is left out.
    fn fill(&mut self, system: &SystemEquations) {
        let nothing = Outside::default();
        let n = system.dimension;
        let (mut unit, mut y, mut rates, mut column) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for component in 0..system.mechanical() {
            let place = self.places[component];
            unit[place] = 1.0;
            self.leave(system, &unit, &mut y);
            unit[place] = 0.0;
            rates.fill(0.0);
            system.rotor.rates(&nothing.rotor, 0.0, None, &y, &mut rates);
            system.stator.rates(&nothing.stator, 0.0, None, &y, &mut rates);
            self.enter(system, &rates, &mut column);
            for (offset, entry) in self.free[place].iter_mut().enumerate() {
                let row = (place + offset).checked_sub(HALF_WIDTH);
                *entry = row.and_then(|row| column.get(row)).copied().unwrap_or(0.0);
            }
            let note = |of: &mut Vec<(usize, f64)>, value: f64| {
                if value != 0.0 {
                    of.push((place, value));
                }
            };
            note(&mut self.relative_velocity, system.relative_velocity(&nothing, &y));
            note(&mut self.transmitted, system.transmitted_torque(&nothing, &y));
        }
        rates.fill(0.0);
        system.rotor.rates(&nothing.rotor, 1.0, None, &unit, &mut rates);
        system.stator.rates(&nothing.stator, 1.0, None, &unit, &mut rates);
        self.enter(system, &rates, &mut column);
        let slip = self.places[system.slip];
        let near = (0..n).filter(|place| place.abs_diff(slip) <= HALF_WIDTH);
        self.interface = near
            .map(|place| (place, column[place]))
            .filter(|(_, rate)| *rate != 0.0)
            .collect();
    }

    /// From the components of a change of the state to these coordinates.
    pub(crate) fn enter(&self, system: &SystemEquations, x: &[f64], z: &mut [f64]) {
        for (&place, x) in self.places.iter().zip(x) {
            z[place] = *x;
        }
        for side in [&system.rotor, &system.stator] {
            let mut speed = side.speed.map_or(0.0, |index| x[index]);
            for i in (0..side.shafts()).rev() {
                speed -= side.sign * side.twist_rate(i, x);
                z[self.places[rate(side, i)]] = speed;
            }
        }
    }

    /// The inverse of [`Self::enter`].
    pub(crate) fn leave(&self, system: &SystemEquations, z: &[f64], x: &mut [f64]) {
        for (&place, x) in self.places.iter().zip(x.iter_mut()) {
            *x = z[place];
        }
        for side in [&system.rotor, &system.stator] {
            let mut outer = side.speed.map_or(0.0, |index| z[self.places[index]]);
            for i in (0..side.shafts()).rev() {
                let speed = z[self.places[rate(side, i)]];
                x[rate(side, i)] = side.sign * (outer - speed);
                outer = speed;
            }
        }
    }

    /// [`SystemEquations::jacobian`] in these coordinates, into zeros.
    pub(crate) fn jacobian(
        &self,
        system: &SystemEquations,
        (mode, sense, piece): (Mode, f64, usize),
        outside: &Outside,
        y: &[f64],
        j: &mut BandMut<'_>,
    ) {
        for (column, free) in self.free.iter().enumerate() {
            for (offset, &entry) in free.iter().enumerate() {
                if entry != 0.0 {
                    j.add(column + offset - HALF_WIDTH, column, entry);
                }
            }
        }
        let mut add = |rows: &[(usize, f64)], columns: &[(usize, f64)], factor: f64| {
            for &(row, a) in rows {
                for &(column, b) in columns {
                    j.add(row, column, factor * a * b);
                }
            }
        };
        if mode == Mode::Stick {
            add(&self.interface, &self.transmitted, 1.0);
            return;
        }
        let slopes = system.contact_slopes(mode, sense, piece, outside, y);
        add(&self.interface, &self.relative_velocity, slopes.by_speed);
        add(&[(self.places[system.slip], 1.0)], &self.relative_velocity, 1.0);
        if let Some(bristles) = &slopes.bristles {
            let deflection = [(self.places[bristles.at], 1.0)];
            add(&self.interface, &deflection, bristles.torque_by_deflection);
            add(&deflection, &self.relative_velocity, bristles.rate_by_speed);
            add(&deflection, &deflection, bristles.rate_by_deflection);
        }
    }
}

/// Where the state has the twist rate of a shaft.
fn rate(side: &Side, shaft: usize) -> usize {
    side.twists + 2 * shaft + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource, Origin};
    use crate::model::equations::{Engagement, SystemEquations};
    use nalgebra::DMatrix;

    /// Trains of both ends, with bearings on every inertia; a rigid surface; bristles.
    fn systems() -> Vec<SystemEquations> {
        let friction = "[friction]\nbreakaway = 0.8\nlow_speed = 0.8\nhigh_speed = 0.5\ndecay = 0.9\n";
        let lugre = "[friction]\nlaw = \"lugre\"\nlow_speed = 0.8\nhigh_speed = 0.5\nscale = 0.4\nbristle_stiffness = 1e3\n\
                     bristle_damping = 3.0\nviscous = 0.02\n";
        let train = |inertias: usize, shafts: usize, end: &str| {
            let list = |base: f64, length: usize| -> Vec<f64> {
                (0..length).map(|i| base * (1.3 + (i as f64).sin())).collect()
            };
            format!(
                "inertia = {:?}\nstiffness = {:?}\ndamping = {:?}\nviscous = {:?}\n{end}\n",
                list(2.0, inertias),
                list(50.0, shafts),
                list(0.3, shafts),
                list(0.1, inertias)
            )
        };
        let free = "end = \"free\"";
        let fixed = "end = \"fixed\"";
        let driven = "end = \"driven\"\nspeed = 2.0\n".to_owned();
        let trains = [
            (train(5, 4, free), train(3, 3, fixed), friction),
            (train(1, 0, free), train(7, 6, free), friction),
            (driven.clone(), train(6, 6, fixed), friction),
            (driven, train(6, 6, fixed), lugre),
            (train(4, 4, "end = \"driven\"\nspeed = 1.0"), train(3, 2, free), lugre),
        ];
        let system = |(rotor, stator, friction): &(String, String, &str)| {
            let text = format!(
                "[rotor]\n{rotor}[stator]\n{stator}[contact]\nradius = 0.2\nnormal_force = 30.0\n{friction}[output]\nend_time = 1.0\n"
            );
            let source = CaseSource {
                text,
                origin: Origin::File("chain.toml".into()),
            };
            SystemEquations::new(&Case::read(&source, &[]).unwrap().system)
        };
        trains.iter().map(system).collect()
    }

    #[test]
    fn property_the_band_is_the_jacobian_in_other_coordinates() {
        for (number, system) in systems().iter().enumerate() {
            let n = system.dimension;
            let outside = Outside {
                normal_force: 30.0,
                ..Outside::default()
            };
            let chain = ChainCoordinates::new(system);
            let y: Vec<f64> = (0..n).map(|k| 0.3 * (1.0 + k as f64).sin()).collect();
            let modes: &[Mode] = match system.engagement {
                Engagement::StickSlip => &[Mode::Separated, Mode::Stick, Mode::SlipForward],
                _ => &[Mode::Separated, Mode::Engaged],
            };
            for &mode in modes {
                let mut dense = DMatrix::zeros(n, n);
                system.jacobian(mode, 1.0, 0, &outside, &y, &mut dense.as_view_mut());
                let stride = 2 * HALF_WIDTH + 1;
                let mut entries = vec![0.0; stride * n];
                let mut band = BandMut::new(&mut entries, stride, HALF_WIDTH, HALF_WIDTH);
                chain.jacobian(system, (mode, 1.0, 0), &outside, &y, &mut band);
                let entry = |i: usize, j: usize| match i.abs_diff(j) {
                    0..=HALF_WIDTH => entries[j * stride + HALF_WIDTH + i - j],
                    _ => 0.0,
                };
                let band = DMatrix::from_fn(n, n, entry);
                // By T J x = J_z T x for every unit x.
                let (mut x, mut z, mut image) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
                let largest = dense.amax();
                for k in 0..n {
                    x[k] = 1.0;
                    chain.enter(system, &x, &mut z);
                    x[k] = 0.0;
                    chain.enter(system, dense.column(k).as_slice(), &mut image);
                    let through = &band * DMatrix::from_column_slice(n, 1, &z);
                    for (i, (a, b)) in through.iter().zip(&image).enumerate() {
                        assert!(
                            (a - b).abs() < 1e-13 * largest,
                            "{number}, {mode:?}, ({i}, {k}): {a} and {b}"
                        );
                    }
                    let mut back = vec![0.0; n];
                    chain.leave(system, &z, &mut back);
                    assert!(back.iter().enumerate().all(|(i, x)| *x == f64::from(u8::from(i == k))));
                }
            }
        }
    }
}
