//! Coordinates in which the Jacobian of a long chain is a band.
//!
//! In twist coordinates every speed is a sum of twist rates, and a bearing couples its inertia with all inertias
//! further from the contact. If the state consists of speeds and twists instead, ordered along the chain from the far
//! end of the stator to that of the rotor, an inertia is coupled with its neighbours only:
//!
//! ```text
//! stator  v_(n-1) q_(n-2) ... q_0 v_0 | slip, bristles | v_0 q_0 v_1 ... rotor | the other quadratures
//! ```
//!
//! A change of coordinates is one pass along the chain, and a linear system takes n steps of constant cost.

use super::Mode;
use super::equations::{Outside, Side, SystemEquations};
use crate::numerics::band::BandMut;

/// Largest distance of elements from the diagonal. In stick the speed of one surface depends on the inertia behind
/// the other.
pub const HALF_WIDTH: usize = 4;

/// Number of components from which on a band is faster than a dense matrix.
const LONG: usize = 20;

/// Order of the components, and the linear part of the equations.
#[derive(Debug)]
pub struct ChainCoordinates {
    /// Place of each component of the state. A twist rate becomes the speed of the inertia on its shaft's inner side.
    places: Vec<usize>,
    /// Columns of the rates for T = 0, within the band.
    free: Vec<[f64; 2 * HALF_WIDTH + 1]>,
    interface: Vec<(usize, f64)>,
    relative_velocity: Vec<(usize, f64)>,
    transmitted: Vec<(usize, f64)>,
}

impl ChainCoordinates {
    /// Coordinates for trains that are long enough for a band; `None` for others.
    pub fn of_long(system: &SystemEquations) -> Option<Self> {
        (system.mechanical() >= LONG).then(|| ChainCoordinates::new(system))
    }

    /// Coordinates of any system.
    pub fn new(system: &SystemEquations) -> Self {
        let mut order = Vec::with_capacity(system.dimension);
        let stator = &system.stator;
        order.extend(stator.speed);
        for i in (0..stator.shafts()).rev() {
            order.extend([stator.twists + 2 * i, stator.twists + 2 * i + 1]);
        }
        let first = stator.twists + 2 * stator.shafts() + usize::from(stator.speed.is_some());
        // The slip displacement follows the bristles.
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

    /// Fills the columns with the effect of unit changes, which reach neighbours only. Rounding elsewhere is dropped.
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

    /// Transforms a change `x` of the state to these coordinates, `z`.
    pub fn enter(&self, system: &SystemEquations, x: &[f64], z: &mut [f64]) {
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
    pub fn leave(&self, system: &SystemEquations, z: &[f64], x: &mut [f64]) {
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

    /// Fills `j` with [`SystemEquations::jacobian`] in these coordinates; `j` must be zero before.
    pub fn jacobian(
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

fn rate(side: &Side, shaft: usize) -> usize {
    side.twists + 2 * shaft + 1
}
