//! Axial motion (1), (11) and contact force (5) in closed form.
//!
//! The axial equation is linear and independent of the rotation, and F(t) is piecewise linear. Between the corners of
//! F the exact solution is therefore a straight line plus a free oscillation. It takes a few operations and has no
//! step-size error. The contact force, its zeros (separation, contact) and the axial energies are functions of time
//! alone. An integrator would have to follow a 0.5 kHz mode through seconds of standstill to get the same values.

use super::Axial;
use super::breakaway::{Bounded, positive_for};
use super::oscillator::DampedOscillator;
use crate::numerics::Number;
use crate::signal::{self, Pieces, Signal};

/// Events closer than this (s) are simultaneous. The value is far below the spacing of doubles at the times of
/// events, and far above the error of multiprecision runs. It only orders a contact change and a kick at a corner of
/// F.
pub(crate) const SAME_INSTANT: f64 = 1e-18;

/// The axial state, with pressing force and energies.
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
    /// Derivative of the pressing force, N/s.
    pub pressing_rate: f64,
    /// Work of F since t = 0, J.
    pub work: f64,
    /// Energy dissipated by c_a since t = 0, J.
    pub dissipated: f64,
}

/// Opening or closing of the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactChange {
    /// Time, s.
    pub time: f64,
    /// Cause of the change.
    pub cause: ChangeCause,
}

/// Cause of a change of the contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChangeCause {
    /// The pressing force crosses zero.
    Zero,
    /// A corner of F. The pressing force is zero there up to rounding, and then changes sides.
    Corner,
    /// A corner of F at which the pressing force is already beyond zero: its zero is the corner's time in doubles, or
    /// the contact was ringing below its floor.
    Beyond,
    /// No change up to this time: the search has used all its steps, and continues from here.
    Searched,
}

impl ContactChange {
    /// A change at `time` (s).
    pub fn new(time: f64, cause: ChangeCause) -> Self {
        ContactChange { time, cause }
    }

    /// Whether the pressing force is zero at this moment, up to rounding, and then leaves zero.
    pub fn departs(self) -> bool {
        matches!(self.cause, ChangeCause::Zero | ChangeCause::Corner)
    }

    /// Whether the change belongs to the corner at its time, and therefore precedes a kick at that time.
    pub fn at_corner(self) -> bool {
        matches!(self.cause, ChangeCause::Corner | ChangeCause::Beyond)
    }
}

/// The axial motion from rest at t = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct AxialMotion {
    axial: Axial,
    ringing: Ringing,
    /// F(t), N.
    pub force: Pieces,
    pieces: Vec<AxialPiece>,
}

/// The ringing, which is the difference between the pressing force and F, in any type of [`Number`].
#[derive(Debug, Clone, PartialEq)]
pub struct Ringing<T = f64> {
    oscillator: DampedOscillator<T>,
    /// m h'' (N) and m h''' (N/s) at the start of each stretch of F. They are carried from stretch to stretch instead
    /// of derived from z. After a rest their small remainder decides when the contact closes, and next to z it would
    /// be rounding.
    starts: Vec<(T, T)>,
}

impl<T: Number> Ringing<T> {
    fn new(axial: &Axial, force: &Pieces) -> Self {
        let [mass, damping, stiffness] = [axial.mass, axial.damping, axial.stiffness].map(T::of);
        let oscillator = DampedOscillator::new(mass, damping, stiffness);
        let mut starts: Vec<(T, T)> = Vec::with_capacity(force.all().len());
        let mut before: Option<&signal::Piece> = None;
        // Pressing force and its rate at the start of a stretch: from rest at t = 0, zero with the rate c_a F / m.
        let mut pressing = (T::of(0.0), T::of(0.0));
        for piece in force.all() {
            let (value, slope) = (T::of(piece.value), T::of(piece.slope));
            starts.push(match (before, starts.last()) {
                (Some(before), Some(&(q, rate))) => {
                    let length = before.end - before.start;
                    let tau = T::of(before.end) - T::of(before.start);
                    // The ringing absorbs a step of F, and its rate absorbs a change of slope.
                    let step = value - T::of(before.end_value);
                    let jump = damping * step / mass;
                    if axial.fastest_rate() * length < SHORT {
                        // A steep slope would cancel between the rates of F and of the ringing.
                        let (start, steep) = (T::of(before.value), T::of(before.slope));
                        let (held, held_rate) = oscillator.advance(pressing.0 - start, pressing.1, tau);
                        let (lag, lag_rate) = oscillator.lag(tau);
                        pressing = (start + held + steep * lag, held_rate + steep * lag_rate + jump);
                        (pressing.0 - value, pressing.1 - slope)
                    } else {
                        let (q, rate) = oscillator.advance(q, rate, tau);
                        let before_slope = T::of(before.slope);
                        pressing = (T::of(before.end_value) + q, before_slope + rate + jump);
                        (q - step, rate - (slope - before_slope) + jump)
                    }
                }
                _ => {
                    pressing.1 = damping * value / mass;
                    (-value, pressing.1 - slope)
                }
            });
            before = Some(piece);
        }
        Ringing { oscillator, starts }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct AxialPiece {
    force: signal::Piece,
    /// Particular solution z = offset + drift tau.
    offset: f64,
    drift: f64,
    /// Free part h at `start`: displacement and velocity.
    free: (f64, f64),
    ringing: (f64, f64),
    /// Time (s) from the start, after which the free part is below the rounding of the particular solution.
    silent_after: f64,
    work: f64,
    dissipated: f64,
    /// Bounds of the pressing force over all later pieces, N.
    lowest_later: f64,
    highest_later: f64,
}

/// Amplitude (N) below which the ringing has ended: smaller doubles lose their digits.
const GONE: f64 = 1e-250;

#[derive(Debug, Clone, Copy, PartialEq)]
enum AxialSearch {
    Zero(f64),
    None,
    /// The remaining ringing does not count as a touch.
    Rest,
    /// The force keeps its sign up to this time (s), at which the steps of the search are used up.
    Searched(f64),
}

/// Most steps of one search, which take tenths of a second. A step covers a part of an oscillation, and a run has
/// some thousands of them.
const SEARCH: u32 = 1_000_000;

/// In a stretch of F shorter than this (times of the fastest motion) a series gives the ringing at the end.
const SHORT: f64 = 0.1;

/// Error of a rate that is a difference, relative to the terms: some roundings of their sums.
const RATE_ROUNDING: f64 = 64.0 * f64::EPSILON;

impl AxialMotion {
    /// The axial motion under F(t), from rest at t = 0.
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

    fn first_piece(&self, force: signal::Piece, ringing: (f64, f64)) -> AxialPiece {
        let (drift, offset) = self.particular(&force);
        self.piece(force, (-offset, -drift), ringing, (0.0, 0.0))
    }

    /// The piece after a corner, at which z, z' and the pressing force are continuous. No large numbers cancel.
    fn next_piece(&self, last: &AxialPiece, force: signal::Piece, ringing: (f64, f64)) -> AxialPiece {
        let Axial { stiffness, damping, .. } = self.axial;
        let tau = last.force.end - last.force.start;
        let state = self.evaluate(last, last.force.end);
        let (h, h_rate) = self.ringing.oscillator.advance(last.free.0, last.free.1, tau);
        // Jump of the particular solution, because z does not jump.
        let turn = (force.slope - last.force.slope) / stiffness;
        let step = (force.value - last.force.end_value) / stiffness;
        let free = (h - damping * turn / stiffness + step, h_rate + turn);
        self.piece(force, free, ringing, (state.work, state.dissipated))
    }

    fn particular(&self, force: &signal::Piece) -> (f64, f64) {
        let Axial { stiffness, damping, .. } = self.axial;
        let drift = -force.slope / stiffness;
        (drift, -(force.value + damping * drift) / stiffness)
    }

    fn piece(&self, force: signal::Piece, free: (f64, f64), ringing: (f64, f64), sums: (f64, f64)) -> AxialPiece {
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
        AxialPiece {
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
    pub fn mass(&self) -> f64 {
        self.axial.mass
    }

    /// The state at time `t >= 0` (s).
    pub fn at(&self, t: f64) -> AxialState {
        self.evaluate(self.piece_at(t), t)
    }

    /// Kinetic and elastic energy of a state, J.
    pub fn energies(&self, state: &AxialState) -> (f64, f64) {
        let axial = &self.axial;
        (
            0.5 * axial.mass * state.velocity * state.velocity,
            0.5 * axial.stiffness * state.displacement * state.displacement,
        )
    }

    /// The pressing force -c_a z' - k_e z at `t` (s), N. It is the only axial quantity in the torsional equations.
    #[inline]
    pub fn pressing_force(&self, t: f64) -> f64 {
        self.pressing_on(self.force.index(t), t)
    }

    /// The pressing force (N) at `t` (s) from the motion on one piece of F, continued beyond the ends of the piece.
    #[inline]
    pub fn pressing_on(&self, piece: usize, t: f64) -> f64 {
        let piece = &self.pieces[piece];
        self.pressing(piece, t - piece.force.start).0
    }

    /// The ringing in any type of number.
    pub fn ringing<T: Number>(&self) -> Ringing<T> {
        Ringing::new(&self.axial, &self.force)
    }

    /// The ringing in doubles.
    pub fn ringing_in_doubles(&self) -> &Ringing {
        &self.ringing
    }

    /// Fills `out` (at least two elements) with Taylor coefficients of the pressing force (N) about `t` (s), by
    /// powers of time over `unit` (s). They are valid until the next corner of F. Returns the degree beyond which
    /// they are zero. `ringing` must belong to this motion.
    ///
    /// Ringing below e^-45 of F (3e-20) is omitted in all number types.
    pub fn pressing_series<T: Number>(&self, ringing: &Ringing<T>, t: f64, unit: f64, out: &mut [T]) -> usize {
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

    /// Bound of |d^2/dt^2| of the pressing force from `t` to the next corner, N/s^2.
    pub fn curvature_bound(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        let (q, rate) = self.ringing_at(piece, t - piece.force.start);
        self.second_derivative_bound(q, rate)
    }

    fn second_derivative_bound(&self, q: f64, rate: f64) -> f64 {
        let Axial {
            mass,
            stiffness,
            damping,
            ..
        } = self.axial;
        // The energy m q'^2 + k q^2 never grows. It bounds |q| and |q'|, and by the equation |q''|.
        let twice_energy = mass * rate * rate + stiffness * q * q;
        (damping * (twice_energy / mass).sqrt() + stiffness * (twice_energy / stiffness).sqrt()) / mass
    }

    /// Lower bound of the pressing force at all times from `t` (s) on, N.
    pub fn lowest_pressing_force_after(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.lowest_later.min(self.bounds_in_piece(piece, t).0)
    }

    /// Upper bound of the pressing force at all times from `t` (s) on, N.
    pub fn highest_pressing_force_after(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.highest_later.max(self.bounds_in_piece(piece, t).1)
    }

    /// Bounds of the pressing force from `t` (s) to the end of the piece, N.
    fn bounds_in_piece(&self, piece: &AxialPiece, t: f64) -> (f64, f64) {
        let tau = (t - piece.force.start).max(0.0);
        let from = piece.force.at(tau);
        let to = piece.force.end_value;
        let ringing = ringing_amplitude(&self.axial, self.ringing_at(piece, tau));
        (from.min(to) - ringing, from.max(to) + ringing)
    }

    /// Whether the ringing has ended at `t` (s), so that the pressing force equals F up to rounding.
    pub fn is_silent(&self, t: f64) -> bool {
        let piece = self.piece_at(t);
        t - piece.force.start >= piece.silent_after
    }

    /// Time at which the ringing ends in the stretch of F around `t` (s), s; infinite if it lasts to the end.
    pub fn silent_from(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.force.start + piece.silent_after
    }

    /// Time at which the ringing from the last corner before `t` (s) has decayed by `e_folds`, s; may be infinite.
    pub fn dies_by(&self, t: f64, e_folds: f64) -> f64 {
        self.piece_at(t).force.start + e_folds / self.ringing.oscillator.slowest_decay()
    }

    /// The pressing force (N) at `t` (s), with a bound of its curvature up to the next corner.
    pub fn bounded(&self, t: f64) -> Bounded {
        let piece = self.piece_at(t);
        let (value, rate) = self.pressing(piece, t - piece.force.start);
        Bounded {
            value,
            rate,
            curvature: self.curvature_bound(t),
        }
    }

    /// The next change of the contact after `t` and up to `until` (s): it opens if `closed`, otherwise it closes.
    ///
    /// It opens when the pressing force falls through 0, and closes when it rises through 0, with one exception.
    /// While F does not press, an open contact stays open once it rings less than [`Axial::ringing_floor`]. At the
    /// corner that ends this rest, it closes at once if the force is zero or positive.
    ///
    /// `departing` means that the force leaves zero at `t`, to the side that `closed` names, after a change or at the
    /// start of contact.
    ///
    /// Zeros are bracketed by bounds of the curvature, so that no zero is missed. A search that needs too many steps
    /// ends with [`ChangeCause::Searched`].
    pub fn next_contact_change(&self, t: f64, closed: bool, departing: bool, until: f64) -> Option<ContactChange> {
        let sign = if closed { 1.0 } else { -1.0 };
        let (mut departing, mut rests) = (departing, false);
        let mut steps = SEARCH;
        let first = self.force.index(t);
        for (k, piece) in self.pieces[first..].iter().enumerate() {
            let from = t.max(piece.force.start);
            if from > until {
                return None;
            }
            if k > 0 {
                departing = false;
                if !rests {
                    match self.zero_at_corner(&self.pieces[first + k - 1], piece) {
                        Some(side) if side == sign => departing = true,
                        Some(_) => return Some(ContactChange::new(from, ChangeCause::Corner)),
                        None if sign * self.pressing(piece, 0.0).0 < 0.0 => {
                            return Some(ContactChange::new(from, ChangeCause::Beyond));
                        }
                        None => {}
                    }
                } else if !self.rests(piece, 0.0, sign) {
                    match self.leaving(piece) {
                        (ChangeCause::Corner, side) if side == sign => departing = true,
                        (cause, side) if side == -sign => return Some(ContactChange { time: from, cause }),
                        _ => {}
                    }
                }
            }
            match self.change_in_piece(piece, from, piece.force.end.min(until), sign, departing, &mut steps) {
                AxialSearch::Zero(time) => return Some(ContactChange::new(time, ChangeCause::Zero)),
                AxialSearch::None => rests = false,
                AxialSearch::Rest => rests = true,
                AxialSearch::Searched(time) => return Some(ContactChange::new(time, ChangeCause::Searched)),
            }
        }
        None
    }

    /// Whether a contact on the side `sign` stays there despite ringing. F does not press, and either an open contact
    /// rings too little to touch, or a closed contact has stopped ringing.
    fn rests(&self, piece: &AxialPiece, tau: f64, sign: f64) -> bool {
        if piece.force.value > 0.0 || piece.force.end_value > 0.0 {
            return false;
        }
        if sign < 0.0 {
            self.free_amplitude(piece, tau) < self.axial.ringing_floor
        } else {
            // An overdamped contact that F has released would never open. Doubles end at about 1e-308.
            piece.force.value == 0.0
                && piece.force.slope == 0.0
                && ringing_amplitude(&self.axial, self.ringing_at(piece, tau)) < GONE
        }
    }

    /// Cause of a change at the corner that ends a rest, and the side of zero on which the pressing force is or will
    /// be.
    fn leaving(&self, piece: &AxialPiece) -> (ChangeCause, f64) {
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

    /// The side to which the pressing force leaves zero at a corner of F. `None` if it is not zero there, up to
    /// rounding or one instant, or if it stays zero.
    fn zero_at_corner(&self, before: &AxialPiece, piece: &AxialPiece) -> Option<f64> {
        let (force, rate) = self.pressing(piece, 0.0);
        let frequency = (self.axial.stiffness / self.axial.mass).sqrt();
        let ringing = self.ringing_at_end(before);
        // The time is rounded as well.
        let rounding = RATE_ROUNDING + f64::EPSILON * frequency * piece.force.start;
        let step = (piece.force.value - before.force.end_value).abs();
        let size = piece.force.value.abs() + step + ringing;
        if force.abs() > (rounding * size).max(rate.abs() * SAME_INSTANT) {
            return None;
        }
        let slopes = piece.force.slope.abs() + frequency * (ringing + step);
        let bend = self.ringing.oscillator.curvature(piece.ringing);
        if rate.abs() > rounding * slopes {
            Some(rate.signum())
        } else {
            (bend != 0.0).then(|| bend.signum())
        }
    }

    /// Amplitude of the ringing at the end of a piece, N.
    fn ringing_at_end(&self, piece: &AxialPiece) -> f64 {
        let end = piece.force.end - piece.force.start;
        ringing_amplitude(&self.axial, self.ringing_at(piece, end))
    }

    /// Error of the time (s) of a zero of the pressing force at a corner of F, from rounding: F is exact, the ringing
    /// is not.
    pub fn rounding_at_corner(&self, t: f64) -> f64 {
        let index = self.force.index(t);
        let (_, rate) = self.pressing(&self.pieces[index], 0.0);
        let before = index
            .checked_sub(1)
            .map_or(0.0, |before| self.ringing_at_end(&self.pieces[before]));
        // One of the two pieces contains the steep slope of a short stretch.
        let ringing = before.min(ringing_amplitude(&self.axial, self.pieces[index].ringing));
        if rate == 0.0 {
            0.0
        } else {
            RATE_ROUNDING * ringing / rate.abs()
        }
    }

    /// Error of the pressing force at `t` (s) from rounded times of earlier steps and short stretches of F, N.
    pub fn rounding_of_times(&self, t: f64) -> f64 {
        let rate = self.axial.fastest_rate();
        let pieces = &self.pieces[..=self.force.index(t)];
        let pairs = pieces.windows(2).map(|pair| {
            let (before, after) = (&pair[0].force, &pair[1].force);
            let short = rate * (before.end - before.start) < 1.0;
            let change = if short {
                (before.end_value - before.value).abs()
            } else {
                0.0
            };
            (change + (after.value - before.end_value).abs()) * f64::EPSILON * after.start
        });
        rate * pairs.sum::<f64>()
    }

    /// First zero of sign * pressing force within one piece. The search takes steps over which the product provably
    /// stays positive; `steps` counts those that remain.
    fn change_in_piece(
        &self,
        piece: &AxialPiece,
        from: f64,
        to: f64,
        sign: f64,
        departing: bool,
        steps: &mut u32,
    ) -> AxialSearch {
        let mut t = from;
        let mut departing = departing;
        while t < to {
            let tau = t - piece.force.start;
            if self.rests(piece, tau, sign) {
                return AxialSearch::Rest;
            }
            let ringing = self.ringing_at(piece, tau);
            let force = piece.force.beside_ends(t) + ringing.0;
            let (g, rate) = (sign * force, sign * (piece.force.slope + ringing.1));
            let curvature = self.second_derivative_bound(ringing.0, ringing.1);
            let grows_for = || self.departure(piece, ringing, sign, rate, curvature);
            let mut delta = if departing && curvature == 0.0 {
                return AxialSearch::None;
            } else if departing {
                departing = false;
                let none = 1e-3 * (self.axial.mass / self.axial.stiffness).sqrt();
                // For such large times the step can be below the spacing of doubles.
                grows_for().unwrap_or(none).max(4.0 * f64::EPSILON * t)
            } else if g <= 0.0 {
                return AxialSearch::Zero(t);
            } else {
                positive_for(g, rate, curvature)
            };
            if t + delta <= t && t == piece.force.start {
                // Close to zero at a corner, the later course of the force decides.
                delta = grows_for().unwrap_or(delta);
            }
            if t + delta <= t {
                return AxialSearch::Zero(t);
            }
            t += delta;
            *steps -= 1;
            if *steps == 0 && t < to {
                return AxialSearch::Searched(t);
            }
            *steps = (*steps).max(1);
        }
        AxialSearch::None
    }

    /// Time (s) over which sign * pressing force, zero up to rounding, provably grows; `None` without a proof.
    ///
    /// Its rate is the sum of the slopes of F and of the ringing, which cancel where contact starts with a ramp. The
    /// rounding of this sum is no rate. The force then leaves zero with its second derivative or, undamped, with its
    /// third.
    fn departure(&self, piece: &AxialPiece, ringing: (f64, f64), sign: f64, rate: f64, curvature: f64) -> Option<f64> {
        let rounding = RATE_ROUNDING * piece.force.slope.abs();
        let by_rate = if rate > rounding { rate / curvature } else { 0.0 };
        let turn = self.ringing.oscillator.curvature(ringing);
        let bend = sign * turn;
        let by_bend = if bend > 0.0 && rate >= -rounding {
            // Same as the bound of the second derivative, one derivative higher.
            bend / self.second_derivative_bound(ringing.1, turn)
        } else {
            0.0
        };
        let delta = f64::max(by_rate, by_bend);
        (delta > 0.0).then_some(delta)
    }

    /// The ringing (N) and its rate (N/s) at `tau` (s) into a piece; zero once it has ended.
    #[inline]
    fn ringing_at(&self, piece: &AxialPiece, tau: f64) -> (f64, f64) {
        if tau >= piece.silent_after {
            return (0.0, 0.0);
        }
        self.ringing.oscillator.advance(piece.ringing.0, piece.ringing.1, tau)
    }

    /// The pressing force (N) and its rate (N/s) at `tau` (s) into a piece.
    fn pressing(&self, piece: &AxialPiece, tau: f64) -> (f64, f64) {
        let (q, rate) = self.ringing_at(piece, tau);
        (piece.force.at(tau) + q, piece.force.slope + rate)
    }

    /// Bound of the amplitude of the free part of z at `tau` (s) into a piece, m.
    fn free_amplitude(&self, piece: &AxialPiece, tau: f64) -> f64 {
        let (h, rate) = self.ringing.oscillator.advance(piece.free.0, piece.free.1, tau);
        (h * h + rate * rate * self.axial.mass / self.axial.stiffness).sqrt()
    }

    #[inline]
    fn piece_at(&self, t: f64) -> &AxialPiece {
        &self.pieces[self.force.index(t)]
    }

    fn evaluate(&self, piece: &AxialPiece, t: f64) -> AxialState {
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
        // Integral of z, from m h'' + c h' + k h = 0, for the work of a force with slope: W = -[F z] + slope *
        // integral of z.
        let free_integral = -(mass * (free.1 - v0) + damping * (free.0 - h0)) / stiffness;
        let integral = piece.offset * tau + piece.drift * tau * tau / 2.0 + free_integral;
        let start_displacement = piece.offset + h0;
        let work = -(force * displacement - piece.force.value * start_displacement) + piece.force.slope * integral;
        // c_a times the integral of (drift + h')^2. The free part contributes its loss of energy.
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

fn ringing_amplitude(axial: &Axial, (q, rate): (f64, f64)) -> f64 {
    (q * q + rate * rate * axial.mass / axial.stiffness).sqrt()
}
