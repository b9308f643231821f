//! The axial motion (1), (11) and the contact force (5), in closed form.
//!
//! The axial equation stands alone, is linear, and F(t) is piecewise linear, so between the corners of F the exact
//! solution is a straight line plus a free oscillation. It costs a few operations, has no step-size error, and makes
//! the contact force, its zeros (separation, contact) and the axial energies functions of time alone; an integrator
//! would carry a 0.5 kHz mode through seconds of standstill for the same numbers.

use super::bounds::positive_for;
use super::oscillator::DampedOscillator;
use super::{Actuation, Axial};

/// Below this amplitude of |z| (m) a ringing released contact is taken as open: the oscillation that a release leaves
/// would otherwise separate and touch for ever. A nanometre carries some 0.06 N of the paper's 2225 N.
pub const RINGING_FLOOR: f64 = 1e-9;

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

/// The whole axial motion, from rest at t = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct AxialMotion {
    axial: Axial,
    oscillator: DampedOscillator,
    pieces: Vec<Piece>,
}

/// One stretch of linear F(t).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    start: f64,
    /// Where the next begins; infinite for the last.
    end: f64,
    /// F at `start`, N, and its slope, N/s.
    force: f64,
    slope: f64,
    /// Particular solution z = offset + drift tau.
    offset: f64,
    drift: f64,
    /// Free part h at `start`: displacement and velocity.
    free: (f64, f64),
    /// m h'' and m h''' at `start`: what the free part adds to F in the pressing force.
    ringing: (f64, f64),
    /// After this the free part is below the rounding of the rest.
    silent_after: f64,
    work: f64,
    dissipated: f64,
    /// Bounds of the pressing force over all later pieces.
    lowest_later: f64,
    highest_later: f64,
}

/// Of a rate that is a difference, relative to its parts: some roundings of the sums that they come of.
const RATE_ROUNDING: f64 = 64.0 * f64::EPSILON;

impl AxialMotion {
    pub fn new(axial: &Axial, actuation: &Actuation) -> Self {
        let oscillator = DampedOscillator::new(axial.mass, axial.damping, axial.stiffness);
        let mut motion = AxialMotion {
            axial: *axial,
            oscillator,
            pieces: Vec::new(),
        };
        let (mut z, mut z_dot, mut work, mut dissipated) = (0.0, 0.0, 0.0, 0.0);
        let breaks = force_pieces(actuation);
        for (index, &(start, force, slope)) in breaks.iter().enumerate() {
            let end = breaks.get(index + 1).map_or(f64::INFINITY, |next| next.0);
            let piece = motion.piece(start, end, force, slope, (z, z_dot), (work, dissipated));
            motion.pieces.push(piece);
            if end.is_finite() {
                let state = motion.evaluate(&piece, end);
                (z, z_dot, work, dissipated) = (state.displacement, state.velocity, state.work, state.dissipated);
            }
        }
        let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in (0..motion.pieces.len()).rev() {
            motion.pieces[k].lowest_later = lowest;
            motion.pieces[k].highest_later = highest;
            let (low, high) = motion.bounds_in_piece(&motion.pieces[k], motion.pieces[k].start);
            lowest = lowest.min(low);
            highest = highest.max(high);
        }
        motion
    }

    fn piece(&self, start: f64, end: f64, force: f64, slope: f64, z: (f64, f64), sums: (f64, f64)) -> Piece {
        let Axial {
            mass,
            stiffness,
            damping,
        } = self.axial;
        let drift = -slope / stiffness;
        let offset = -(force + damping * drift) / stiffness;
        let free = (z.0 - offset, z.1 - drift);
        let curvature = -(damping * free.1 + stiffness * free.0);
        let ringing = (curvature, -(damping * curvature / mass + stiffness * free.1));
        let amplitude = ringing_amplitude(&self.axial, ringing);
        let scale = force.abs();
        let decay = self.oscillator.slowest_decay();
        let silent_after = if amplitude == 0.0 {
            0.0
        } else if scale > 0.0 && slope == 0.0 && decay > 0.0 {
            (45.0 + (1.0 + amplitude / scale).ln()) / decay
        } else {
            f64::INFINITY
        };
        Piece {
            start,
            end,
            force,
            slope,
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

    /// The state at time `t >= 0` (s).
    pub fn at(&self, t: f64) -> AxialState {
        self.evaluate(self.piece_at(t), t)
    }

    /// The pressing force -c_a z' - k_e z at `t`, N: all that the torsional equations need.
    #[inline]
    pub fn pressing_force(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        let tau = t - piece.start;
        let force = piece.force + piece.slope * tau;
        if tau >= piece.silent_after {
            force
        } else {
            force + self.oscillator.advance(piece.ringing.0, piece.ringing.1, tau).0
        }
    }

    /// The Taylor coefficients of the pressing force (N) about `t`, by powers of time over `unit` (s), as many as `out`
    /// holds (at least two), and the degree beyond which they are zero. They hold until the next corner of F.
    pub fn pressing_series(&self, t: f64, unit: f64, out: &mut [f64]) -> usize {
        let piece = self.piece_at(t);
        let tau = t - piece.start;
        let degree = if tau >= piece.silent_after {
            out.fill(0.0);
            usize::from(piece.slope != 0.0)
        } else {
            let (q, rate) = self.oscillator.advance(piece.ringing.0, piece.ringing.1, tau);
            self.oscillator.series(q, rate, unit, out);
            out.len() - 1
        };
        out[0] += piece.force + piece.slope * tau;
        out[1] += piece.slope * unit;
        degree
    }

    /// F at its largest magnitude over the run, N.
    pub fn largest_force(&self) -> f64 {
        let last = self.pieces.last().map_or(0.0, |p| p.force.abs());
        self.pieces.iter().filter(|p| p.end.is_finite()).fold(last, |m, p| {
            m.max(p.force.abs()).max((p.force + p.slope * (p.end - p.start)).abs())
        })
    }

    /// A bound on |d^2/dt^2| of the pressing force from `t` to the next corner, N/s^2.
    pub fn curvature_bound(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        let tau = t - piece.start;
        if tau >= piece.silent_after {
            return 0.0;
        }
        let Axial {
            mass,
            stiffness,
            damping,
        } = self.axial;
        let (q, rate) = self.oscillator.advance(piece.ringing.0, piece.ringing.1, tau);
        // The energy m q'^2 + k q^2 of the free part never grows: it bounds |q| and |q'|, and the equation then |q''|.
        let twice_energy = mass * rate * rate + stiffness * q * q;
        (damping * (twice_energy / mass).sqrt() + stiffness * (twice_energy / stiffness).sqrt()) / mass
    }

    /// A lower bound of the pressing force from `t` on, for ever, N.
    pub fn lowest_pressing_force_after(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.lowest_later.min(self.bounds_in_piece(piece, t).0)
    }

    /// An upper bound of the pressing force from `t` on, for ever, N.
    pub fn highest_pressing_force_after(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.highest_later.max(self.bounds_in_piece(piece, t).1)
    }

    /// Lower and upper bound of the pressing force from `t` to the end of the piece.
    fn bounds_in_piece(&self, piece: &Piece, t: f64) -> (f64, f64) {
        let tau = (t - piece.start).max(0.0);
        let from = piece.force + piece.slope * tau;
        let to = if piece.end.is_finite() {
            piece.force + piece.slope * (piece.end - piece.start)
        } else {
            from
        };
        let ringing = if tau >= piece.silent_after {
            0.0
        } else {
            ringing_amplitude(
                &self.axial,
                self.oscillator.advance(piece.ringing.0, piece.ringing.1, tau),
            )
        };
        (from.min(to) - ringing, from.max(to) + ringing)
    }

    /// Whether F presses the disks together right after t = 0.
    pub fn closed_at_start(&self) -> bool {
        let first = &self.pieces[0];
        first.force > 0.0 || (first.force == 0.0 && first.slope > 0.0)
    }

    /// F(t), N.
    pub fn applied_force(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.force + piece.slope * (t - piece.start)
    }

    /// F'(t), N/s; at a corner, that of the stretch after it.
    pub fn applied_force_rate(&self, t: f64) -> f64 {
        self.piece_at(t).slope
    }

    /// Whether nothing rings any more at `t`: the pressing force is F, up to rounding.
    pub fn is_silent(&self, t: f64) -> bool {
        let piece = self.piece_at(t);
        t - piece.start >= piece.silent_after
    }

    /// From when on nothing rings any more in the linear stretch of F that holds `t`, s; infinite if it rings to the end.
    pub fn silent_from(&self, t: f64) -> f64 {
        let piece = self.piece_at(t);
        piece.start + piece.silent_after
    }

    /// When the ringing that the last corner before `t` has set going has died by so many e-folds, s; infinite if it never
    /// does.
    pub fn dies_by(&self, t: f64, e_folds: f64) -> f64 {
        self.piece_at(t).start + e_folds / self.oscillator.slowest_decay()
    }

    /// The first corner after `t`, s.
    pub fn next_corner(&self, t: f64) -> Option<f64> {
        let end = self.piece_at(t).end;
        end.is_finite().then_some(end)
    }

    /// All corners after t = 0 in order, s.
    pub fn corners(&self) -> impl Iterator<Item = f64> {
        self.pieces.iter().map(|p| p.end).filter(|end| end.is_finite())
    }

    /// The shortest stretch over which F changes, s; infinite if it never does.
    pub fn shortest_change(&self) -> f64 {
        let changing = self.pieces.iter().filter(|p| p.slope != 0.0);
        changing.map(|p| p.end - p.start).fold(f64::INFINITY, f64::min)
    }

    /// The next time after `t` at which the pressing force falls through 0 (`closed` contact) or rises through it
    /// (open contact), no later than `until`; `None` if there is none, or if the ringing of a released contact has
    /// fallen below [`RINGING_FLOOR`]. `departing` says that the force is just leaving zero at `t`, to the side that
    /// `closed` names: after a change, or where contact starts.
    ///
    /// Zeros are bracketed by bounds on the curvature, so none is passed over.
    pub fn next_contact_change(&self, t: f64, closed: bool, departing: bool, until: f64) -> Option<f64> {
        let sign = if closed { 1.0 } else { -1.0 };
        let first = self.pieces.partition_point(|p| p.start <= t).saturating_sub(1);
        for (k, piece) in self.pieces[first..].iter().enumerate() {
            let from = t.max(piece.start);
            if from > until {
                return None;
            }
            if let Some(root) = self.change_in_piece(piece, from, piece.end.min(until), sign, departing && k == 0) {
                return Some(root);
            }
        }
        None
    }

    /// First zero of sign * pressing force within one piece, found by steps over which it provably stays positive.
    fn change_in_piece(&self, piece: &Piece, from: f64, to: f64, sign: f64, departing: bool) -> Option<f64> {
        let still = piece.force == 0.0 && piece.slope == 0.0;
        let mut t = from;
        let mut departing = departing;
        while t < to {
            if still && sign < 0.0 && self.free_amplitude(piece, t) < RINGING_FLOOR {
                return None;
            }
            let state = self.evaluate(piece, t);
            let (g, rate) = (sign * state.pressing_force, sign * state.pressing_rate);
            let curvature = if t - piece.start >= piece.silent_after {
                0.0
            } else {
                self.curvature_bound(t)
            };
            let delta = if departing {
                // g is zero up to rounding: step over the neighbourhood in which it provably grows. Its rate is the slope of
                // F and that of the ringing, which cancel where contact starts with a ramp: their rounding is no rate.
                departing = false;
                let rounding = RATE_ROUNDING * piece.slope.abs();
                match (curvature > 0.0, rate > rounding) {
                    (true, true) => rate / curvature,
                    (true, false) => 1e-3 * (self.axial.mass / self.axial.stiffness).sqrt(),
                    (false, _) => return None,
                }
            } else if g <= 0.0 {
                return Some(t);
            } else {
                positive_for(g, rate, curvature)
            };
            if t + delta <= t {
                return Some(t);
            }
            t += delta;
        }
        None
    }

    /// Amplitude bound of the free part of z at `t`, m.
    fn free_amplitude(&self, piece: &Piece, t: f64) -> f64 {
        let (h, rate) = self.oscillator.advance(piece.free.0, piece.free.1, t - piece.start);
        (h * h + rate * rate * self.axial.mass / self.axial.stiffness).sqrt()
    }

    #[inline]
    fn piece_at(&self, t: f64) -> &Piece {
        let index = self.pieces.partition_point(|p| p.start <= t);
        &self.pieces[index.saturating_sub(1)]
    }

    fn evaluate(&self, piece: &Piece, t: f64) -> AxialState {
        let Axial {
            mass,
            stiffness,
            damping,
        } = self.axial;
        let tau = t - piece.start;
        let force = piece.force + piece.slope * tau;
        let (mut free, mut ringing) = ((0.0, 0.0), (0.0, 0.0));
        if tau < piece.silent_after {
            free = self.oscillator.advance(piece.free.0, piece.free.1, tau);
            ringing = self.oscillator.advance(piece.ringing.0, piece.ringing.1, tau);
        }
        let displacement = piece.offset + piece.drift * tau + free.0;
        let (h0, v0) = piece.free;
        // Integral of z from m h'' + c h' + k h = 0, for the work of a force with slope:
        // W = -[F z] + slope * integral of z.
        let free_integral = -(mass * (free.1 - v0) + damping * (free.0 - h0)) / stiffness;
        let integral = piece.offset * tau + piece.drift * tau * tau / 2.0 + free_integral;
        let start_displacement = piece.offset + h0;
        let work = -(force * displacement - piece.force * start_displacement) + piece.slope * integral;
        // c_a times the integral of (drift + h')^2; the free part's own loss is the loss of its energy.
        let free_loss = (mass * (v0 * v0 - free.1 * free.1) + stiffness * (h0 * h0 - free.0 * free.0)) / 2.0;
        let dissipated = damping * (piece.drift * piece.drift * tau + 2.0 * piece.drift * (free.0 - h0)) + free_loss;
        AxialState {
            displacement,
            velocity: piece.drift + free.1,
            force,
            pressing_force: force + ringing.0,
            pressing_rate: piece.slope + ringing.1,
            work: piece.work + work,
            dissipated: piece.dissipated + dissipated,
        }
    }
}

/// Largest |q| that the energy of (q, q') allows from here on.
fn ringing_amplitude(axial: &Axial, (q, rate): (f64, f64)) -> f64 {
    (q * q + rate * rate * axial.mass / axial.stiffness).sqrt()
}

/// (start, F, slope) of each linear stretch from t = 0 on.
fn force_pieces(actuation: &Actuation) -> Vec<(f64, f64, f64)> {
    match actuation {
        Actuation::Ramp { force, rise_time } if *rise_time > 0.0 => {
            vec![(0.0, 0.0, force / rise_time), (*rise_time, *force, 0.0)]
        }
        Actuation::Ramp { force, .. } => vec![(0.0, *force, 0.0)],
        Actuation::Table { time, force } => {
            let mut pieces = Vec::with_capacity(time.len() + 1);
            if time[0] > 0.0 {
                pieces.push((0.0, force[0], 0.0));
            }
            for k in 0..time.len() {
                let slope = match time.get(k + 1) {
                    Some(next) => (force[k + 1] - force[k]) / (next - time[k]),
                    None => 0.0,
                };
                if time.get(k + 1).is_some_and(|&next| next <= 0.0) {
                    continue;
                }
                let start = time[k].max(0.0);
                pieces.push((start, force[k] + slope * (start - time[k]), slope));
            }
            pieces
        }
    }
}
