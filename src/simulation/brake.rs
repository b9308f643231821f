//! The brake as a hybrid system: its locations, guards and smooth equations.

use crate::hybrid::{ClosedEnd, ClosedForm, Direction, Dynamics, Guard};
use crate::model::axial::AxialMotion;
use crate::model::closed_form::{self, Breakaway};
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
    pub mode: Mode,
    /// Whether steps have to resolve the fast torsional mode, because it is excited or unstable.
    pub resolved: bool,
    pub watch: Watch,
}

/// The brake's equations, shared by all solvers of a run.
#[derive(Debug)]
pub struct Brake {
    pub torsion: TorsionModel,
    pub axial: AxialMotion,
    pub closed_form: closed_form::ClosedForm,
    /// Where there is one, sticks that are not [`Location::resolved`] move by their slower mode alone.
    pub slow_stick: Option<SlowStick>,
}

const STOPPING: Guard = Guard {
    name: "relative velocity reaches zero",
    direction: Direction::Falling,
};
const DESTABILISED: Guard = Guard {
    name: "steady sliding loses stability",
    direction: Direction::Falling,
};
const RESTABILISED: Guard = Guard {
    name: "steady sliding regains stability",
    direction: Direction::Rising,
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
const LARGEST_DIP: f64 = 7.5e-5;

/// Index of the guards of slip.
pub const GUARD_STOPPING: usize = 0;
/// Index of the guard of the stability margin in slip.
pub const GUARD_STABILITY: usize = 1;
/// Index of the guard of a stick that breaks away forward; backward is the other.
pub const GUARD_FORWARD: usize = 0;

impl Brake {
    pub fn new(parameters: &Parameters) -> Self {
        let torsion = TorsionModel::new(parameters);
        Brake {
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

    /// The margin of steady sliding at `t`, N m s/rad.
    pub fn stability_margin(&self, sense: f64, t: f64, y: &[f64]) -> f64 {
        self.torsion
            .stability_margin(sense, self.torsion.relative_velocity(y), self.contact_force(t))
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
            _ => self.torsion.rates(location.mode, || self.contact_force(t), y, dydt),
        }
    }

    fn jacobian(&self, location: &Location, t: f64, y: &[f64], mut jacobian: DMatrixViewMut<'_, f64>) {
        let force = || self.contact_force(t);
        self.torsion.jacobian(location.mode, force, y, &mut jacobian);
    }

    fn guards(&self, location: &Location) -> &'static [Guard] {
        match (location.mode, location.watch) {
            (Mode::Separated, _) => &[],
            (Mode::Stick, _) => const { &[BREAKAWAY_FORWARD, BREAKAWAY_BACKWARD] },
            (_, Watch::Stable) => const { &[STOPPING, DESTABILISED] },
            (_, Watch::Unstable) => const { &[STOPPING, RESTABILISED] },
            (_, Watch::Off) => const { &[STOPPING] },
        }
    }

    fn guard_values(&self, location: &Location, t: f64, y: &[f64], values: &mut [f64]) {
        match location.mode {
            Mode::Separated => {}
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
                    values[GUARD_STABILITY] = self.stability_margin(sense, t, y);
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
        let torsion = &self.torsion;
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
            Mode::SlipForward | Mode::SlipBackward => unreachable!("slip is left to a solver"),
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
