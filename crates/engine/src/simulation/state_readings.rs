//! Recorded channels, from a state in twist coordinates.

use super::readings::Readings;
use crate::hybrid::{SystemDynamics, SystemLocation};
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{ANGLE, DAMPING_LOSS, Engagement, FRICTION_LOSS, Side, SystemEquations, WORK};
use stickslip_system::record::{Channels, State};

pub(in crate::simulation) struct StateReadings<'a> {
    pub dynamics: &'a SystemDynamics,
    /// Whether there are quantities beyond [`State`].
    pub further: bool,
}

/// A quantity beyond [`State`].
#[derive(Debug, Clone, PartialEq)]
pub struct Further {
    /// Name, such as `rotor_speed_1`.
    pub name: String,
    /// Whether the quantity is a speed, not an angle.
    pub is_rate: bool,
    /// Description.
    pub long_name: String,
}

pub(super) fn further_names(system: &SystemEquations) -> Vec<Further> {
    let mut found = Vec::new();
    for (side, name) in [(&system.rotor, "rotor"), (&system.stator, "stator")] {
        let mut add = |what: &str, i: usize, is_rate: bool, long_name: String| {
            found.push(Further {
                name: format!("{name}_{what}_{i}"),
                is_rate,
                long_name,
            });
        };
        for i in 0..side.shafts() {
            add("twist", i, false, format!("twist of shaft {i} of the {name}"));
            add("twist_rate", i, true, format!("twist rate of shaft {i} of the {name}"));
        }
        for i in 0..side.inertia.len() {
            add("speed", i, true, format!("speed of inertia {i} of the {name}"));
        }
    }
    if let Engagement::Bristles(..) = system.engagement {
        found.push(Further {
            name: "bristle_deflection".to_owned(),
            is_rate: false,
            long_name: "deflection z of the bristles".to_owned(),
        });
    }
    found
}

impl StateReadings<'_> {
    /// Angles of the surfaces and of the rotor's outermost inertia: (phi_2, phi_1, theta), rad.
    fn angles(&self, t: f64, y: &[f64]) -> (f64, f64, f64) {
        let system = &self.dynamics.system;
        let ends = self.dynamics.excitation.angles(t);
        let twists = |side: &Side| -> f64 { (0..side.shafts()).map(|i| side.sign * side.twist(i, y)).sum() };
        let slip = y[system.slip];
        // From the far end inwards: the outer minus the inner angle is sign times twist.
        let tied = |side: &Side, end: f64| side.speed.is_none().then(|| end - twists(side));
        let (phi2, phi1) = match (tied(&system.rotor, ends.0), tied(&system.stator, ends.1)) {
            (Some(phi2), Some(phi1)) => (phi2, phi1),
            (None, Some(phi1)) => (phi1 + slip, phi1),
            (Some(phi2), None) => (phi2, phi2 - slip),
            (None, None) => {
                let phi1 = y[system.slip + ANGLE] - twists(&system.stator);
                (phi1 + slip, phi1)
            }
        };
        let outermost = system.rotor.inertia.len().saturating_sub(1).min(system.rotor.shafts());
        let theta = phi2 + (0..outermost).map(|i| system.rotor.twist(i, y)).sum::<f64>();
        (phi2, phi1, theta)
    }
}

impl Readings for StateReadings<'_> {
    fn read(&self, t: f64, place: &SystemLocation, y: &[f64]) -> (State, Channels) {
        let system = &self.dynamics.system;
        let outside = self.dynamics.outside(place, t);
        let (phi2, phi1, theta) = self.angles(t, y);
        let rotor = system.rotor.surface_speed(&outside.rotor, y);
        let stator = system.stator.surface_speed(&outside.stator, y);
        // In stick omega_r is zero by the mode, not by a difference of rounded speeds.
        let w = if place.mode == Mode::Stick { 0.0 } else { rotor - stator };
        let outermost = system.rotor.outermost_speed(&outside.rotor, y).unwrap_or(rotor);
        let axial = self.dynamics.excitation.axial();
        let at = axial.map(|motion| motion.at(t));
        let first = |i: usize| match system.rotor.shafts() {
            0 => 0.0,
            _ => y[system.rotor.twists + i],
        };
        let state = State {
            z: at.map_or(0.0, |axial| axial.displacement),
            z_dot: at.map_or(0.0, |axial| axial.velocity),
            theta,
            theta_dot: outermost,
            phi1,
            phi1_dot: stator,
            phi2,
            phi2_dot: stator + w,
            rotor_twist: first(0),
            rotor_twist_rate: first(1),
            relative_velocity: w,
            slip_displacement: y[system.slip],
        };
        let normal_force = if place.mode == Mode::Separated {
            0.0
        } else {
            outside.normal_force.max(0.0)
        };
        let interface = system.interface_torque(place.mode, place.sign(), place.piece, &outside, y);
        let (axial_kinetic, axial_elastic) = axial.zip(at).map_or((0.0, 0.0), |(motion, at)| motion.energies(&at));
        let channels = Channels {
            applied_force: at.map_or(normal_force, |axial| axial.force),
            normal_force,
            friction_torque: interface,
            transmitted_torque: system.transmitted_torque(&outside, y),
            energy_kinetic: system.kinetic_energy(&outside, y) + axial_kinetic,
            energy_elastic: system.elastic_energy(y) + axial_elastic,
            work_applied: y[system.slip + WORK] + at.map_or(0.0, |axial| axial.work),
            dissipated_friction: y[system.slip + FRICTION_LOSS],
            dissipated_damping: y[system.slip + DAMPING_LOSS] + at.map_or(0.0, |axial| axial.dissipated),
            ..Channels::default()
        };
        (state, channels.with_products(&state))
    }

    fn kinetic_energy(&self, t: f64, place: &SystemLocation, y: &[f64]) -> f64 {
        self.dynamics.system.kinetic_energy(&self.dynamics.outside(place, t), y)
    }

    fn internal_force(&self, t: f64, place: &SystemLocation, y: &[f64]) -> f64 {
        let system = &self.dynamics.system;
        system.transmitted_torque(&self.dynamics.outside(place, t), y) / system.radius
    }

    fn further(&self, t: f64, place: &SystemLocation, y: &[f64], out: &mut Vec<f64>) {
        if !self.further {
            return;
        }
        let system = &self.dynamics.system;
        let outside = self.dynamics.outside(place, t);
        for (side, driving) in [(&system.rotor, &outside.rotor), (&system.stator, &outside.stator)] {
            for i in 0..side.shafts() {
                out.extend([side.twist(i, y), side.twist_rate(i, y)]);
            }
            out.extend(side.speeds(driving, y));
        }
        if let Engagement::Bristles(.., at) = system.engagement {
            out.push(y[at]);
        }
    }
}
