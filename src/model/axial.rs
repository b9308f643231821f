//! The axial motion (1), (11) and the contact force (5), in closed form.
//!
//! The axial equation stands alone, is linear, and F(t) is piecewise linear, so between the corners of F the exact
//! solution is a straight line plus a free oscillation. It costs a few operations, has no step-size error, and makes
//! the contact force, its zeros (separation, contact) and the axial energies functions of time alone; an integrator
//! would carry a 0.5 kHz mode through seconds of standstill for the same numbers.

use super::Axial;
use super::bounds::positive_for;
use super::breakaway::Bounded;
use super::oscillator::DampedOscillator;
use crate::numerics::Number;
use crate::signal::{self, Pieces, Signal};

/// Two happenings closer than this (s) count as one instant: far below the spacing of the doubles that hold their times,
/// far above what the multiprecision runs err by. It decides an order only, that of a contact and of a kick at the corner
/// where F begins to press again after a rest.
pub(crate) const SAME_INSTANT: f64 = 1e-18;

/// The axial state and what the rest of the model needs of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxialState {
    /// z, m; negative in compression.
    pub displacement: f64,
    /// z', m/s.
    pub velocity: f64,
    /// F, N.
    pub force: f64,
    /// -c_a z' - k_e z, N: the contact force where positive.
    pub pressing_force: f64,
    /// Its derivative, N/s.
    pub pressing_rate: f64,
    /// Work of F since t = 0, J.
    pub work: f64,
    /// Energy dissipated by c_a since t = 0, J.
    pub dissipated: f64,
}

/// When the contact opens or closes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactChange {
    /// s.
    pub time: f64,
    /// What brings it about.
    pub cause: ChangeCause,
}

/// What makes a contact change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChangeCause {
    /// The pressing force passes through zero.
    Zero,
    /// A corner of F, from rest: the pressing force is zero there and leaves it with F.
    Corner,
    /// A corner of F, where the pressing force stood beyond zero already: the ringing pressed, and was below its floor.
    Beyond,
    /// Nothing: there is no change up to here, and the search, which has taken its share of steps, goes on from here.
    Searched,
}

impl ContactChange {
    /// At `time` (s).
    pub fn new(time: f64, cause: ChangeCause) -> Self {
        ContactChange { time, cause }
    }

    /// Whether the pressing force is zero at this moment, up to rounding, and just leaving it.
    pub fn departs(self) -> bool {
        matches!(self.cause, ChangeCause::Zero | ChangeCause::Corner)
    }

    /// Whether it belongs to the corner at its time, and so comes before a kick of that time.
    pub fn at_corner(self) -> bool {
        matches!(self.cause, ChangeCause::Corner | ChangeCause::Beyond)
    }
}

/// The whole axial motion, from rest at t = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct AxialMotion {
    axial: Axial,
    ringing: Ringing,
    /// F(t), N.
    pub force: Pieces,
    /// The motion on each of its stretches.
    pieces: Vec<Piece>,
}

/// What the free part of the motion adds to F in the pressing force, in any type of [`Number`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ringing<T = f64> {
    oscillator: DampedOscillator<T>,
    /// m h'' (N) and m h''' (N/s) at the start of each stretch of F. From one stretch to the next they are carried on as they are,
    /// not found anew from z: what is left of them after a rest decides when the contact closes, and beside z it would be rounding.
    starts: Vec<(T, T)>,
}

impl<T: Number> Ringing<T> {
    fn new(axial: &Axial, force: &Pieces) -> Self {
        let [mass, damping, stiffness] = [axial.mass, axial.damping, axial.stiffness].map(T::of);
        let oscillator = DampedOscillator::new(mass, damping, stiffness);
        let mut starts: Vec<(T, T)> = Vec::with_capacity(force.all().len());
        let mut before: Option<&signal::Piece> = None;
        for piece in force.all() {
            let slope = T::of(piece.slope);
            starts.push(match (before, starts.last()) {
                (Some(before), Some(&(q, rate))) => {
                    let (q, rate) = oscillator.advance(q, rate, T::of(before.end) - T::of(before.start));
                    // The rate takes up the change of slope.
                    (q, rate - (slope - T::of(before.slope)))
                }
                // From rest at t = 0, where the pressing force is zero and its rate c_a F / m.
                _ => {
                    let value = T::of(piece.value);
                    (-value, damping * value / mass - slope)
                }
            });
            before = Some(piece);
        }
        Ringing { oscillator, starts }
    }
}

/// One stretch of linear F(t).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// F, N.
    force: signal::Piece,
    /// Particular solution z = offset + drift tau.
    offset: f64,
    drift: f64,
    /// Free part h at `start`: displacement and velocity.
    free: (f64, f64),
    /// That of [`Ringing`] at `start`.
    ringing: (f64, f64),
    /// After this the free part is below the rounding of the rest.
    silent_after: f64,
    work: f64,
    dissipated: f64,
    /// Bounds of the pressing force over all later pieces.
    lowest_later: f64,
    highest_later: f64,
}

/// A ringing below this (N) has ended: doubles below it lose their digits.
const GONE: f64 = 1e-250;

/// What the search for a zero on one stretch of F finds.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Search {
    /// s.
    Zero(f64),
    /// The force keeps its sign.
    None,
    /// From somewhere on, what still rings is no touch.
    Rest,
    /// Up to this time (s) the force keeps its sign; the steps of the search are used up.
    Searched(f64),
}

/// Steps of one search: tenths of a second. Each covers a part of an oscillation, and a run has some thousands of these.
const SEARCH: u32 = 1_000_000;

/// Of a rate that is a difference, relative to its parts: some roundings of the sums that they come of.
const RATE_ROUNDING: f64 = 64.0 * f64::EPSILON;

impl AxialMotion {
    /// The motion under F(t), from rest at t = 0.
    pub fn new(axial: &Axial, force: &Signal) -> Self {
        let force = force.pieces();
        let mut motion = AxialMotion {
            axial: *axial,
            ringing: Ringing::new(axial, &force),
            pieces: Vec::new(),
            force,
        };
        for (&force, &ringing) in motion.force.all().iter().zip(&motion.ringing.starts) {
            let piece = match motion.pieces.last() {
                None => motion.first_piece(force, ringing),
                Some(last) => motion.next_piece(last, force, ringing),
            };
            motion.pieces.push(piece);
        }
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in (0..motion.pieces.len()).rev() {
            motion.pieces[k].lowest_later = lowest;
            motion.pieces[k].highest_later = highest;
            let (low, high) = motion.bounds_in_piece(&motion.pieces[k], motion.pieces[k].force.start);
            lowest = lowest.min(low);
            highest = highest.max(high);
        }
        motion
    }

    /// From rest at t = 0.
    fn first_piece(&self, force: signal::Piece, ringing: (f64, f64)) -> Piece {
        let (drift, offset) = self.particular(&force);
        self.piece(force, (-offset, -drift), ringing, (0.0, 0.0))
    }

    /// Where F turns, z, z', the pressing force and its rate go on. No difference of large numbers is taken.
    fn next_piece(&self, last: &Piece, force: signal::Piece, ringing: (f64, f64)) -> Piece {
        let Axial { stiffness, damping, .. } = self.axial;
        let tau = last.force.end - last.force.start;
        let state = self.evaluate(last, last.force.end);
        let (h, h_rate) = self.ringing.oscillator.advance(last.free.0, last.free.1, tau);
        // What the particular solution jumps by, since z does not.
        let turn = (force.slope - last.force.slope) / stiffness;
        let free = (h - damping * turn / stiffness, h_rate + turn);
        self.piece(force, free, ringing, (state.work, state.dissipated))
    }

    /// Drift and offset of the particular solution z = offset + drift tau.
    fn particular(&self, force: &signal::Piece) -> (f64, f64) {
        let Axial { stiffness, damping, .. } = self.axial;
        let drift = -force.slope / stiffness;
        (drift, -(force.value + damping * drift) / stiffness)
    }

    fn piece(&self, force: signal::Piece, free: (f64, f64), ringing: (f64, f64), sums: (f64, f64)) -> Piece {
        let (drift, offset) = self.particular(&force);
        let amplitude = ringing_amplitude(&self.axial, ringing);
        let scale = force.value.abs();
        let decay = self.ringing.oscillator.slowest_decay();
        let silent_after = if amplitude == 0.0 {
            0.0
        } else if scale > 0.0 && force.slope == 0.0 && decay > 0.0 {
            (45.0 + (1.0 + amplitude / scale).ln()) / decay
        } else {
            f64::INFINITY
        };
        Piece {
            force,
            offset,
            drift,
            free,
            ringing,
            silent_after,
            work: sums.0,
            dissipated: sums.1,
            lowest_later: f64::INFINITY,
            highest_later: f64::NEG_INFINITY,
        }
    }

    /// m, kg.
    pub(crate) fn mass(&self) -> f64 {
        self.axial.mass
    }

    /// The state at time `t >= 0` (s).
    pub fn at(&self, t: f64) -> AxialState {
        self.evaluate(self.piece_at(t), t)
    }

    /// (kinetic, elastic) energy of a state, J.
    pub(crate) fn energies(&self, state: &AxialState) -> (f64, f64) {
        let axial = &self.axial;
        (
            0.5 * axial.mass * state.velocity * state.velocity,
            0.5 * axial.stiffness * state.displacement * state.displacement,
        )
    }

    /// The pressing force -c_a z' - k_e z at `t`, N: all that the torsional equations need.
    #[inline]
    pub fn pressing_force(&self, t: f64) -> f64 {
        self.pressing_on(self.force.index(t), t)
    }

    /// The pressing force (N) at `t` by the motion on a piece of F, continued beyond its ends.
    #[inline]
    pub(crate) fn pressing_on(&self, piece: usize, t: f64) -> f64 {
        let piece = &self.pieces[piece];
        self.pressing(piece, t - piece.force.start).0
    }

    /// The ringing in any numbers.
    pub(crate) fn ringing<T: Number>(&self) -> Ringing<T> {
        Ringing::new(&self.axial, &self.force)
    }

    /// The ringing in doubles.
    pub(crate) fn ringing_in_doubles(&self) -> &Ringing {
        &self.ringing
    }

    /// The Taylor coefficients of the pressing force (N) about `t`, by powers of time over `unit` (s), as many as `out`
    /// holds (at least two), and the degree beyond which they are zero. They hold until the next corner of F. `ringing` is that
    /// of this motion.
    ///
    /// Ringing of less than e^-45 of F, 3e-20, is left out in all numbers.
    pub(crate) fn pressing_series<T: Number>(&self, ringing: &Ringing<T>, t: f64, unit: f64, out: &mut [T]) -> usize {
        let index = self.force.index(t);
        let (piece, force) = (&self.pieces[index], &self.pieces[index].force);
        let [start, value, slope, unit] = [force.start, force.value, force.slope, unit].map(T::of);
        let tau = T::of(t) - start;
        let degree = if t - force.start >= piece.silent_after {
            out.fill(T::of(0.0));
            usize::from(force.slope != 0.0)
        } else {
            let (q, rate) = ringing.starts[index];
            let (q, rate) = ringing.oscillator.advance(q, rate, tau);
            ringing.oscillator.series(q, rate, unit, out);
            out.len() - 1
        };
        out[0] = out[0] + (value + slope * tau);
        out[1] = out[1] + slope * unit;
        degree
    }

    /// A bound on |d^2/dt^2| of the pressing force from `t` to the next corner, N/s^2.
    pub(crate) fn curvature_bound(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        let (q, rate) = self.ringing_at(piece, t - piece.force.start);
        self.second_derivative_bound(q, rate)
    }

    /// A bound on |q''| from (q, q') on, for a free oscillation.
    fn second_derivative_bound(&self, q: f64, rate: f64) -> f64 {
        let Axial {
            mass,
            stiffness,
            damping,
            ..
        } = self.axial;
        // The energy m q'^2 + k q^2 of the free part never grows: it bounds |q| and |q'|, and the equation then |q''|.
        let twice_energy = mass * rate * rate + stiffness * q * q;
        (damping * (twice_energy / mass).sqrt() + stiffness * (twice_energy / stiffness).sqrt()) / mass
    }

    /// A lower bound of the pressing force from `t` on, for ever, N.
    pub(crate) fn lowest_pressing_force_after(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.lowest_later.min(self.bounds_in_piece(piece, t).0)
    }

    /// An upper bound of the pressing force from `t` on, for ever, N.
    pub(crate) fn highest_pressing_force_after(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.highest_later.max(self.bounds_in_piece(piece, t).1)
    }

    /// Lower and upper bound of the pressing force from `t` to the end of the piece.
    fn bounds_in_piece(&self, piece: &Piece, t: f64) -> (f64, f64) {
        let tau = (t - piece.force.start).max(0.0);
        let from = piece.force.at(tau);
        let to = piece.force.last();
        let ringing = ringing_amplitude(&self.axial, self.ringing_at(piece, tau));
        (from.min(to) - ringing, from.max(to) + ringing)
    }

    /// Whether nothing rings any more at `t`: the pressing force is F, up to rounding.
    pub fn is_silent(&self, t: f64) -> bool {
        let piece = self.piece_at(t);
        t - piece.force.start >= piece.silent_after
    }

    /// From when on nothing rings any more in the linear stretch of F that holds `t`, s; infinite if it rings to the end.
    pub(crate) fn silent_from(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.force.start + piece.silent_after
    }

    /// When the ringing that the last corner before `t` has set going has died by so many e-folds, s; infinite if it never
    /// does.
    pub(crate) fn dies_by(&self, t: f64, e_folds: f64) -> f64 {
        self.piece_at(t).force.start + e_folds / self.ringing.oscillator.slowest_decay()
    }

    /// The pressing force (N) at `t`, with a bound from there to the next corner.
    pub(crate) fn bounded(&self, t: f64) -> Bounded {
        let piece = self.piece_at(t);
        let (value, rate) = self.pressing(piece, t - piece.force.start);
        Bounded {
            value,
            rate,
            curvature: self.curvature_bound(t),
        }
    }

    /// The next time after `t`, no later than `until`, at which the contact opens (`closed`) or closes, if there is one.
    ///
    /// It opens where the pressing force falls through 0, and closes where the force rises through it, with one exception:
    /// while F does not press, an open contact stays open once it rings less than [`Axial::ringing_floor`]. At the corner
    /// where that ends, it closes at once if the force stands at zero, or beyond it.
    ///
    /// `departing` says that the force is just leaving zero at `t`, to the side that `closed` names: after a change, or
    /// where contact starts.
    ///
    /// Zeros are bracketed by bounds on the curvature, so none is passed over. A search that takes too many steps ends
    /// where it is, with [`ChangeCause::Searched`].
    pub fn next_contact_change(&self, t: f64, closed: bool, departing: bool, until: f64) -> Option<ContactChange> {
        let sign = if closed { 1.0 } else { -1.0 };
        let (mut departing, mut rests) = (departing, false);
        let mut steps = SEARCH;
        for (k, piece) in self.pieces[self.force.index(t)..].iter().enumerate() {
            let from = t.max(piece.force.start);
            if from > until {
                return None;
            }
            if k > 0 {
                departing = false;
                if rests && !self.rests(piece, 0.0, sign) {
                    match self.leaving(piece) {
                        (ChangeCause::Corner, side) if side == sign => departing = true,
                        (cause, side) if side == -sign => return Some(ContactChange { time: from, cause }),
                        _ => {}
                    }
                }
            }
            match self.change_in_piece(piece, from, piece.force.end.min(until), sign, departing, &mut steps) {
                Search::Zero(time) => return Some(ContactChange::new(time, ChangeCause::Zero)),
                Search::None => rests = false,
                Search::Rest => rests = true,
                Search::Searched(time) => return Some(ContactChange::new(time, ChangeCause::Searched)),
            }
        }
        None
    }

    /// Whether a contact at the side `sign` stays there whatever rings: F does not press, and an open contact rings too
    /// little to count as touching, or a closed one no more at all.
    fn rests(&self, piece: &Piece, tau: f64, sign: f64) -> bool {
        if piece.force.value > 0.0 || piece.force.end_value > 0.0 {
            return false;
        }
        if sign < 0.0 {
            self.free_amplitude(piece, tau) < self.axial.ringing_floor
        } else {
            // An overdamped contact that F has left closes up for ever; a double ends at some 1e-308.
            piece.force.value == 0.0
                && piece.force.slope == 0.0
                && ringing_amplitude(&self.axial, self.ringing_at(piece, tau)) < GONE
        }
    }

    /// At the corner where a stretch begins after a rest: to which side the pressing force leaves zero, or stands.
    fn leaving(&self, piece: &Piece) -> (ChangeCause, f64) {
        let (force, rate) = self.pressing(piece, 0.0);
        let curvature = self.ringing.oscillator.curvature(piece.ringing);
        let reach = (rate.abs() + curvature.abs() * SAME_INSTANT / 2.0) * SAME_INSTANT;
        if force.abs() > reach {
            return (ChangeCause::Beyond, force.signum());
        }
        let ahead = force + (rate + curvature * SAME_INSTANT / 2.0) * SAME_INSTANT;
        // Without damping the force leaves rest with its third derivative, which has the sign of the slope.
        let side = if ahead != 0.0 { ahead } else { piece.force.slope };
        let side = if side == 0.0 { 0.0 } else { side.signum() };
        (ChangeCause::Corner, side)
    }

    /// First zero of sign * pressing force within one piece, found by steps over which it provably stays positive, of which
    /// so many are left.
    fn change_in_piece(
        &self,
        piece: &Piece,
        from: f64,
        to: f64,
        sign: f64,
        departing: bool,
        steps: &mut u32,
    ) -> Search {
        let mut t = from;
        let mut departing = departing;
        while t < to {
            let tau = t - piece.force.start;
            if self.rests(piece, tau, sign) {
                return Search::Rest;
            }
            let (force, rate) = self.pressing(piece, tau);
            let (g, rate) = (sign * force, sign * rate);
            let ringing = self.ringing_at(piece, tau);
            let curvature = self.second_derivative_bound(ringing.0, ringing.1);
            let grows_for = || self.departure(piece, ringing, sign, rate, curvature);
            let mut delta = if departing && curvature == 0.0 {
                return Search::None;
            } else if departing {
                departing = false;
                let none = 1e-3 * (self.axial.mass / self.axial.stiffness).sqrt();
                // In doubles of this size the step can be none at all.
                grows_for().unwrap_or(none).max(4.0 * f64::EPSILON * t)
            } else if g <= 0.0 {
                return Search::Zero(t);
            } else {
                positive_for(g, rate, curvature)
            };
            if t + delta <= t && t == piece.force.start {
                // Next to zero at a corner: what the force does from there on decides.
                delta = grows_for().unwrap_or(delta);
            }
            if t + delta <= t {
                return Search::Zero(t);
            }
            t += delta;
            *steps -= 1;
            if *steps == 0 && t < to {
                return Search::Searched(t);
            }
            *steps = (*steps).max(1);
        }
        Search::None
    }

    /// How far sign * pressing force, which is zero up to rounding, provably grows (s); `None` where nothing proves it.
    ///
    /// Its rate is the slope of F and that of the ringing, which cancel where contact starts with a ramp: their rounding is
    /// no rate. The force then leaves zero with its second derivative, and without damping with its third.
    fn departure(&self, piece: &Piece, ringing: (f64, f64), sign: f64, rate: f64, curvature: f64) -> Option<f64> {
        let rounding = RATE_ROUNDING * piece.force.slope.abs();
        let by_rate = if rate > rounding { rate / curvature } else { 0.0 };
        let turn = self.ringing.oscillator.curvature(ringing);
        let bend = sign * turn;
        let by_bend = if bend > 0.0 && rate >= -rounding {
            // The third derivative is bounded as the second is, one derivative on.
            bend / self.second_derivative_bound(ringing.1, turn)
        } else {
            0.0
        };
        let delta = f64::max(by_rate, by_bend);
        (delta > 0.0).then_some(delta)
    }

    /// The ringing and its rate at `tau` (s) into a piece, N and N/s; zero once it is silent.
    #[inline]
    fn ringing_at(&self, piece: &Piece, tau: f64) -> (f64, f64) {
        if tau >= piece.silent_after {
            return (0.0, 0.0);
        }
        self.ringing.oscillator.advance(piece.ringing.0, piece.ringing.1, tau)
    }

    /// The pressing force and its rate at `tau` (s) into a piece, N and N/s.
    fn pressing(&self, piece: &Piece, tau: f64) -> (f64, f64) {
        let (q, rate) = self.ringing_at(piece, tau);
        (piece.force.at(tau) + q, piece.force.slope + rate)
    }

    /// Amplitude bound of the free part of z at `tau` (s) into a piece, m.
    fn free_amplitude(&self, piece: &Piece, tau: f64) -> f64 {
        let (h, rate) = self.ringing.oscillator.advance(piece.free.0, piece.free.1, tau);
        (h * h + rate * rate * self.axial.mass / self.axial.stiffness).sqrt()
    }

    #[inline]
    fn piece_at(&self, t: f64) -> &Piece {
        &self.pieces[self.force.index(t)]
    }

    fn evaluate(&self, piece: &Piece, t: f64) -> AxialState {
        let Axial {
            mass,
            stiffness,
            damping,
            ..
        } = self.axial;
        let tau = t - piece.force.start;
        let force = piece.force.at(tau);
        let ringing = self.ringing_at(piece, tau);
        let free = if tau < piece.silent_after {
            self.ringing.oscillator.advance(piece.free.0, piece.free.1, tau)
        } else {
            (0.0, 0.0)
        };
        let displacement = piece.offset + piece.drift * tau + free.0;
        let (h0, v0) = piece.free;
        // Integral of z from m h'' + c h' + k h = 0, for the work of a force with slope:
        // W = -[F z] + slope * integral of z.
        let free_integral = -(mass * (free.1 - v0) + damping * (free.0 - h0)) / stiffness;
        let integral = piece.offset * tau + piece.drift * tau * tau / 2.0 + free_integral;
        let start_displacement = piece.offset + h0;
        let work = -(force * displacement - piece.force.value * start_displacement) + piece.force.slope * integral;
        // c_a times the integral of (drift + h')^2; the free part's own loss is the loss of its energy.
        let free_loss = (mass * (v0 * v0 - free.1 * free.1) + stiffness * (h0 * h0 - free.0 * free.0)) / 2.0;
        let dissipated = damping * (piece.drift * piece.drift * tau + 2.0 * piece.drift * (free.0 - h0)) + free_loss;
        AxialState {
            displacement,
            velocity: piece.drift + free.1,
            force,
            pressing_force: force + ringing.0,
            pressing_rate: piece.force.slope + ringing.1,
            work: piece.work + work,
            dissipated: piece.dissipated + dissipated,
        }
    }
}

/// Largest |q| that the energy of (q, q') allows from here on.
fn ringing_amplitude(axial: &Axial, (q, rate): (f64, f64)) -> f64 {
    (q * q + rate * rate * axial.mass / axial.stiffness).sqrt()
}
