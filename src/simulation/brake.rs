//! The brake as a hybrid system: its locations, guards and smooth equations.

use crate::friction::Law;
use crate::hybrid::{ClosedEnd, ClosedForm, Direction, Dynamics, Guard};
use crate::model::axial::AxialMotion;
use crate::model::breakaway::Breakaway;
use crate::model::closed_form;
use crate::model::slow_stick::SlowStick;
use crate::model::state::{DIMENSION, state_of};
use crate::model::torsion::TorsionModel;
use crate::model::{BreakawayTest, Mode, Parameters};
use nalgebra::DMatrixViewMut;

/// Whether the stability of steady sliding is watched: it is until the first stick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Watch {
    /// Sliding is stable; its loss is an event.
    Stable,
    /// Sliding is unstable; its return is an event.
    Unstable,
    /// After the first stick: crossings are part of each slip and no events.
    Off,
}

/// The discrete state of the brake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// What the contact does.
    pub mode: Mode,
    /// Whether steps have to resolve the fast torsional mode, because it is excited or unstable.
    pub resolved: bool,
    /// Which zeros of the stability margin are events.
    pub watch: Watch,
    /// In slip, between which knots of the friction law the speed is: above so many of them.
    pub piece: usize,
}

/// The brake's equations, shared by all solvers of a run.
#[derive(Debug)]
pub struct Brake {
    /// Torsion and friction.
    pub torsion: TorsionModel,
    /// The same with the friction law of each piece between its knots, smooth beyond them; empty for a law without any.
    pieces: Vec<TorsionModel>,
    /// The axial motion, which is known beforehand.
    pub axial: AxialMotion,
    /// Stick and separation.
    pub closed_form: closed_form::ClosedForm,
    /// Where there is one, sticks that are not [`Location::resolved`] move by their slower mode alone.
    pub slow_stick: Option<SlowStick>,
}

const STOPPING: Guard = Guard {
    name: "relative velocity reaches zero",
    direction: Direction::Falling,
};
pub(super) const DESTABILISED: Guard = Guard {
    name: "steady sliding loses stability",
    direction: Direction::Falling,
};
pub(super) const RESTABILISED: Guard = Guard {
    name: "steady sliding regains stability",
    direction: Direction::Rising,
};
const BELOW_PIECE: Guard = Guard {
    name: "relative velocity falls to a knot of the friction law",
    direction: Direction::Falling,
};
const ABOVE_PIECE: Guard = Guard {
    name: "relative velocity rises to a knot of the friction law",
    direction: Direction::Falling,
};
const BREAKAWAY_FORWARD: Guard = Guard {
    name: "tested torque reaches +mu_0 r F_n",
    direction: Direction::Falling,
};
const BREAKAWAY_BACKWARD: Guard = Guard {
    name: "tested torque reaches -mu_0 r F_n",
    direction: Direction::Falling,
};

/// A breakaway by a one-sided test may start against its own sense, because the torque that is tested is not the one that
/// accelerates. Where the relative velocity goes back by less than this share of the oscillation's speed before it turns,
/// the slip goes on; else the breakaway is undone at once. The share is of the size of the paper's tolerance on the
/// relative velocity, the epsilon = 1e-5 rad/s of its equation (9).
pub(super) const LARGEST_DIP: f64 = 7.5e-5;

/// Index of the guards of slip.
pub(crate) const GUARD_STOPPING: usize = 0;
/// Index of the guard of the stability margin in slip.
pub(crate) const GUARD_STABILITY: usize = 1;
/// Index of the guard of a stick that breaks away forward; backward is the other.
pub(crate) const GUARD_FORWARD: usize = 0;

impl Brake {
    /// Of a case.
    pub fn new(parameters: &Parameters) -> Self {
        let torsion = TorsionModel::new(parameters);
        let count = match torsion.friction.law.knots().len() {
            0 => 0,
            knots => knots + 1,
        };
        Brake {
            pieces: (0..count).map(|piece| torsion.on_piece(piece)).collect(),
            closed_form: closed_form::ClosedForm::new(&torsion),
            torsion,
            axial: parameters.axial_motion(),
            slow_stick: None,
        }
    }

    /// F_n at `t` in a closed contact, without the clamp of (5): smooth through its zero, where a guard ends the mode.
    #[inline]
    fn contact_force(&self, t: f64) -> f64 {
        self.axial.pressing_force(t)
    }

    /// Velocity of an oscillation with the static twist under friction for its amplitude, rad/s.
    fn oscillation_speed(&self, t: f64) -> f64 {
        let torque = self.torsion.breakaway_torque(self.contact_force(t));
        torque / self.torsion.torsion.stiffness * self.torsion.natural_angular_frequency()
    }

    /// The torsional equations of a location, smooth beyond its piece of the friction law.
    #[inline]
    pub(crate) fn torsion_in(&self, location: &Location) -> &TorsionModel {
        self.pieces.get(location.piece).unwrap_or(&self.torsion)
    }

    /// The margin of steady sliding at `t`, N m s/rad.
    pub fn stability_margin(&self, location: &Location, t: f64, y: &[f64]) -> f64 {
        let (torsion, sense) = (self.torsion_in(location), f64::from(location.mode.sense()));
        torsion.stability_margin(sense, torsion.relative_velocity(y), self.contact_force(t))
    }

    /// The piece of the friction law that a state slides on. At a knot it is the one below, to which sliding slows down.
    pub(crate) fn piece_of(&self, y: &[f64]) -> usize {
        if self.pieces.is_empty() {
            return 0;
        }
        let speed = self.torsion.relative_velocity(y).abs();
        self.torsion.friction.law.knots().partition_point(|knot| *knot < speed)
    }

    /// Whether the friction law is smooth wherever it is given.
    pub(crate) fn is_smooth(&self) -> bool {
        let law = &self.torsion.friction.law;
        law.knots().iter().all(|knot| *knot >= law.ends_at())
    }

    /// The index of the guard at the lower end of a location's piece, in slip, which that at the upper end follows; `None` for
    /// a law without knots.
    pub(crate) fn guard_below(&self, location: &Location) -> Option<usize> {
        let others = if location.watch == Watch::Off { 1 } else { 2 };
        (!self.pieces.is_empty()).then_some(others)
    }

    /// (sign, knot): the guard at an end of a location's piece is sign times (|omega_r| - knot), zero at the knot and positive
    /// inside; `None` where the piece has no such end.
    pub(crate) fn end_of_piece(&self, location: &Location, above: bool) -> Option<(f64, f64)> {
        let knots = self.torsion.friction.law.knots();
        if above {
            knots.get(location.piece).map(|knot| (-1.0, *knot))
        } else {
            let knot = knots.get(location.piece.checked_sub(1)?)?;
            Some((1.0, *knot))
        }
    }

    /// What [`Self::end_of_piece`] describes, at a state; 1 where there is no such end.
    pub(crate) fn inside_piece(&self, location: &Location, above: bool, y: &[f64]) -> f64 {
        let speed = f64::from(location.mode.sense()) * self.torsion.relative_velocity(y);
        self.end_of_piece(location, above)
            .map_or(1.0, |(sign, knot)| sign * (speed - knot))
    }
}

impl Dynamics for Brake {
    type Location = Location;

    fn dimension(&self) -> usize {
        DIMENSION
    }

    #[inline]
    fn rhs(&self, location: &Location, t: f64, y: &[f64], dydt: &mut [f64]) {
        match &self.slow_stick {
            Some(slow) if location.mode == Mode::Stick && !location.resolved => slow.rhs(y, dydt),
            _ => self
                .torsion_in(location)
                .rates(location.mode, || self.contact_force(t), y, dydt),
        }
    }

    fn jacobian(&self, location: &Location, t: f64, y: &[f64], mut jacobian: DMatrixViewMut<'_, f64>) {
        let force = || self.contact_force(t);
        self.torsion_in(location)
            .jacobian(location.mode, force, y, &mut jacobian);
    }

    fn guards(&self, location: &Location) -> &'static [Guard] {
        let in_piece = !self.pieces.is_empty() && location.mode.sense() != 0;
        match (location.mode, location.watch) {
            (_, Watch::Stable) if in_piece => const { &[STOPPING, DESTABILISED, BELOW_PIECE, ABOVE_PIECE] },
            (_, Watch::Unstable) if in_piece => const { &[STOPPING, RESTABILISED, BELOW_PIECE, ABOVE_PIECE] },
            (_, Watch::Off) if in_piece => const { &[STOPPING, BELOW_PIECE, ABOVE_PIECE] },
            (Mode::Separated, _) => &[],
            (Mode::Stick, _) => const { &[BREAKAWAY_FORWARD, BREAKAWAY_BACKWARD] },
            (_, Watch::Stable) => const { &[STOPPING, DESTABILISED] },
            (_, Watch::Unstable) => const { &[STOPPING, RESTABILISED] },
            (_, Watch::Off) => const { &[STOPPING] },
        }
    }

    fn guard_values(&self, location: &Location, t: f64, y: &[f64], values: &mut [f64]) {
        match location.mode {
            Mode::Separated | Mode::Engaged => {}
            Mode::Stick => {
                let limit = self.torsion.breakaway_torque(self.contact_force(t));
                let torque = self.torsion.tested_torque(y);
                values[0] = limit - torque;
                values[1] = limit + torque;
            }
            Mode::SlipForward | Mode::SlipBackward => {
                let sense = f64::from(location.mode.sense());
                values[GUARD_STOPPING] = sense * self.torsion.relative_velocity(y);
                if location.watch != Watch::Off {
                    values[GUARD_STABILITY] = self.stability_margin(location, t, y);
                }
                if let Some(below) = self.guard_below(location) {
                    values[below] = self.inside_piece(location, false, y);
                    values[below + 1] = self.inside_piece(location, true, y);
                }
            }
        }
    }

    fn starts_beyond(&self, location: &Location, t: f64, y: &[f64], guard: usize) -> bool {
        if guard != GUARD_STOPPING
            || location.mode.sense() == 0
            || self.torsion.contact.breakaway_test == BreakawayTest::Transmitted
        {
            return false;
        }
        let sense = f64::from(location.mode.sense());
        let torsion = self.torsion_in(location);
        let speed = self.oscillation_speed(t);
        if torsion.relative_velocity(y).abs() > 1e-9 * speed {
            return false;
        }
        // From rest J omega_r' = 2 (T_f - T_i), so that omega_r is a parabola as far as the torques' rates last.
        let axial = self.axial.at(t);
        let pressing = (axial.pressing_force, axial.pressing_rate);
        let rates = torsion.rates_at(location.mode, || pressing.0, y);
        let lag = sense * (torsion.sliding_torque(sense, y, pressing.0) - torsion.transmitted_torque(y));
        let rise =
            sense * (torsion.transmitted_torque(&rates) - torsion.sliding_torque_rate(sense, y, &rates, pressing));
        let deepest = lag * lag / (torsion.torsion.surface_inertia * rise);
        lag > 0.0 && rise > 0.0 && deepest <= LARGEST_DIP * speed
    }

    fn describe(&self, location: &Location) -> String {
        format!("mode {}", location.mode.name())
    }
}

impl ClosedForm for Brake {
    fn closed_state(&self, location: &Location, _t: f64, y: &[f64], tau: f64, out: &mut [f64]) {
        let y = state_of(y);
        out.copy_from_slice(&match location.mode {
            Mode::Stick => self.closed_form.stick(&y, tau),
            Mode::Separated => self.closed_form.separated(&y, tau),
            Mode::SlipForward | Mode::SlipBackward | Mode::Engaged => unreachable!("slip is left to a solver"),
        });
    }

    fn closed_end(&self, location: &Location, t: f64, y: &[f64], within: f64) -> ClosedEnd {
        if location.mode != Mode::Stick {
            return ClosedEnd::None;
        }
        match self.closed_form.next_breakaway(&self.axial, t, &state_of(y), within) {
            Breakaway::After { after, sense } => ClosedEnd::Guard {
                after,
                index: if sense > 0.0 { GUARD_FORWARD } else { GUARD_FORWARD + 1 },
            },
            Breakaway::NotBefore { until } => ClosedEnd::Unknown { after: until },
            Breakaway::NotYet | Breakaway::Never => ClosedEnd::None,
        }
    }
}
