//! The numbers of two alike disks, in SI units and radians; axial oscillator, kick times and modes of every system.

use crate::friction::Friction;
use crate::signal::Signal;

/// Everything that defines the physical problem, in SI units and radians.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// How the disks are pressed together.
    pub axial: Axial,
    /// The actuating force F(t), N, positive when it presses the disks together.
    pub actuation: Signal,
    /// Inertias, stiffness and damping.
    pub torsion: Torsion,
    /// Radius and breakaway test.
    pub contact: Contact,
    /// At rest and in slip.
    pub friction: Friction,
    /// At t = 0.
    pub initial: Initial,
    /// In the order given; times need not be sorted.
    pub perturbations: Vec<Kick>,
}

/// The axial oscillator, equations (1) and (11).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axial<T = f64> {
    /// m, kg.
    pub mass: T,
    /// k_e, N/m.
    pub stiffness: T,
    /// c_a, N s/m.
    pub damping: T,
    /// Amplitude of z (m) below which a ringing open contact stays open while F does not press: the oscillation that a
    /// release leaves would otherwise separate and touch for ever. A convention, not a measured number. A nanometre, the
    /// default, carries some 0.06 N of the paper's 2225 N.
    pub ringing_floor: T,
}

impl Axial {
    /// [`Axial::ringing_floor`] unless a case says otherwise, m.
    pub const RINGING_FLOOR: f64 = 1e-9;
}

/// The torsional contact, per disk, equations (2) to (4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torsion {
    /// I, kg m^2.
    pub rotor_inertia: f64,
    /// J, kg m^2, of each contact surface.
    pub surface_inertia: f64,
    /// k_t, N m/rad, of each disk.
    pub stiffness: f64,
    /// c_t, N m s/rad, of each disk.
    pub damping: f64,
}

/// The friction contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// r, effective friction radius, m.
    pub radius: f64,
    /// What decides between stick and slip.
    pub breakaway_test: BreakawayTest,
}

/// Which torque is held against mu_0 r F_n to decide between stick and slip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BreakawayTest {
    /// T_f = (T_r + T_s)/2, the exact constraint torque of the interface.
    #[default]
    Transmitted,
    /// T_s alone, the paper's stator force in (10).
    Stator,
    /// T_r alone, the paper's rotor force in (10).
    Rotor,
}

/// The state at t = 0, without twist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Initial {
    /// omega_0, rad/s, of the rotor and of its surface.
    pub speed: f64,
}

/// A jump of the relative velocity, half on each surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kick {
    /// When.
    pub time: KickTime,
    /// delta, rad/s: phi2_dot += delta/2, phi1_dot -= delta/2.
    pub relative_velocity: f64,
}

/// When a kick is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KickTime<T = f64> {
    /// At a time, s.
    At(T),
    /// At the first zero of the stability margin of steady sliding.
    Instability,
}

impl<T> KickTime<T> {
    /// The time, s; `None` of a kick that waits for the instability.
    pub fn at(&self) -> Option<&T> {
        match self {
            KickTime::At(time) => Some(time),
            KickTime::Instability => None,
        }
    }
}

/// What the contact does. The numbers are those of the result file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mode {
    /// No contact.
    Separated = 0,
    /// omega_r stays 0.
    Stick = 1,
    /// omega_r > 0.
    SlipForward = 2,
    /// omega_r < 0.
    SlipBackward = 3,
    /// Friction without a jump at rest, regularised or by bristles: one mode at every omega_r, and no stick.
    Engaged = 4,
}

impl Mode {
    /// All of them, in the order of their codes.
    pub const ALL: [Mode; 5] = [
        Mode::Separated,
        Mode::Stick,
        Mode::SlipForward,
        Mode::SlipBackward,
        Mode::Engaged,
    ];

    /// The code in result files.
    pub fn code(self) -> i8 {
        self as i8
    }

    /// The name in result files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Separated => "separated",
            Mode::Stick => "stick",
            Mode::SlipForward => "slip-forward",
            Mode::SlipBackward => "slip-backward",
            Mode::Engaged => "engaged",
        }
    }

    /// Slip with this relative velocity, or its sign.
    pub fn sliding(relative_velocity: f64) -> Mode {
        if relative_velocity > 0.0 {
            Mode::SlipForward
        } else {
            Mode::SlipBackward
        }
    }

    /// Whether the parts slide on each other: an engaged contact always may.
    pub fn slides(self) -> bool {
        !matches!(self, Mode::Stick | Mode::Separated)
    }

    /// Sign of the relative velocity in slip, 0 otherwise.
    pub fn sense(self) -> i8 {
        match self {
            Mode::SlipForward => 1,
            Mode::SlipBackward => -1,
            Mode::Separated | Mode::Stick | Mode::Engaged => 0,
        }
    }
}
