//! Parameters of two equal disks, in SI units and radians. Axial oscillator, kick times and modes serve every system.

use super::system::{ContactLaw, End, Initial, Kick, KickSide, Pressing, System, Train};
use crate::friction::Friction;
use crate::signal::Signal;

/// The physical problem of two disks, in SI units and radians.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Axial oscillator.
    pub axial: Axial,
    /// The actuating force F(t), N, positive when it presses the disks together.
    pub actuation: Signal,
    /// Inertias, stiffness and damping.
    pub torsion: Torsion,
    /// Radius and breakaway test.
    pub contact: Contact,
    /// Breakaway and friction law.
    pub friction: Friction,
    /// State at t = 0.
    pub initial: DiskInitial,
    /// Kicks, in any order.
    pub perturbations: Vec<DiskKick>,
}

impl From<&Parameters> for System {
    /// A free rotor, whose surface and inertia are on one shaft, and a surface on a shaft to the ground. The
    /// equations are those of the short form.
    fn from(disks: &Parameters) -> System {
        let torsion = &disks.torsion;
        let train = |inertia: Vec<f64>, end: End| Train {
            viscous: vec![0.0; inertia.len()],
            inertia,
            stiffness: vec![torsion.stiffness],
            damping: vec![torsion.damping],
            end,
            torque: None,
        };
        let kick = |kick: &DiskKick| Kick {
            time: kick.time,
            relative_velocity: kick.relative_velocity,
            on: KickSide::Both,
        };
        System {
            rotor: train(vec![torsion.surface_inertia, torsion.rotor_inertia], End::Free),
            stator: train(vec![torsion.surface_inertia], End::Fixed),
            radius: disks.contact.radius,
            pressing: Pressing::Axial {
                axial: disks.axial,
                actuation: disks.actuation.clone(),
            },
            breakaway: disks.friction.breakaway,
            breakaway_test: disks.contact.breakaway_test,
            law: disks.friction.law.clone(),
            contact: ContactLaw::StickSlip,
            initial: Initial {
                rotor_twist: vec![0.0],
                rotor_speed: vec![disks.initial.speed; 2],
                stator_twist: vec![0.0],
                stator_speed: vec![0.0],
            },
            kicks: disks.perturbations.iter().map(kick).collect(),
        }
    }
}

impl Parameters {
    /// The two disks of a system; `None` if the short form cannot express the system.
    pub fn of(system: &System) -> Option<Parameters> {
        let ([surface_inertia, rotor_inertia], [stiffness], [damping], Pressing::Axial { axial, actuation }) = (
            system.rotor.inertia.as_slice(),
            system.stator.stiffness.as_slice(),
            system.stator.damping.as_slice(),
            &system.pressing,
        ) else {
            return None;
        };
        let disks = Parameters {
            axial: *axial,
            actuation: actuation.clone(),
            torsion: Torsion {
                rotor_inertia: *rotor_inertia,
                surface_inertia: *surface_inertia,
                stiffness: *stiffness,
                damping: *damping,
            },
            contact: Contact {
                radius: system.radius,
                breakaway_test: system.breakaway_test,
            },
            friction: Friction {
                breakaway: system.breakaway,
                law: system.law.clone(),
            },
            initial: DiskInitial {
                speed: *system.initial.rotor_speed.first()?,
            },
            perturbations: system
                .kicks
                .iter()
                .map(|kick| DiskKick {
                    time: kick.time,
                    relative_velocity: kick.relative_velocity,
                })
                .collect(),
        };
        (System::from(&disks) == *system).then_some(disks)
    }
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
    /// Amplitude of z (m) below which a ringing open contact stays open while F does not press. Without this floor
    /// the oscillation after a release would separate and touch for ever. The floor is a convention, not a
    /// measurement. A nanometre, the default, is equivalent to some 0.06 N of the paper's 2225 N.
    pub ringing_floor: T,
}

impl Axial {
    /// Bound of the rate of the axial motion, c_a/m + sqrt(k_e/m), 1/s.
    pub(crate) fn fastest_rate(&self) -> f64 {
        self.damping / self.mass + (self.stiffness / self.mass).sqrt()
    }

    /// Default of [`Axial::ringing_floor`], m.
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
    /// Torque that decides between stick and slip.
    pub breakaway_test: BreakawayTest,
}

/// The torque that is compared with mu_0 r F_n to decide between stick and slip.
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
pub struct DiskInitial {
    /// omega_0, rad/s, of the rotor and of its surface.
    pub speed: f64,
}

/// A jump of the relative velocity, half on each surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiskKick {
    /// Time of the kick.
    pub time: KickTime,
    /// delta, rad/s: phi2_dot += delta/2, phi1_dot -= delta/2.
    pub relative_velocity: f64,
}

/// Time of a kick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KickTime<T = f64> {
    /// At a time, s.
    At(T),
    /// At the first zero of the stability margin of steady sliding.
    Instability,
}

impl<T> KickTime<T> {
    /// The time, s; `None` for a kick at the instability.
    pub fn at(&self) -> Option<&T> {
        match self {
            KickTime::At(time) => Some(time),
            KickTime::Instability => None,
        }
    }
}

/// State of the contact. The discriminants are the codes in result files.
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
    /// Friction without a jump at rest, regularised or with bristles. It is the only mode, without stick.
    Engaged = 4,
}

impl Mode {
    /// All modes, in the order of their codes.
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

    /// Slip in the direction of this relative velocity, of which only the sign counts.
    pub fn sliding(relative_velocity: f64) -> Mode {
        if relative_velocity > 0.0 {
            Mode::SlipForward
        } else {
            Mode::SlipBackward
        }
    }

    /// Whether the surfaces may slide on each other. In an engaged contact they always may.
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
