//! Linear modes of a system, steady sliding, and changes of its stability.

use super::linear::{SlidingVerdict, axial_modes, jacobian, modes_of, state, stuck};
use super::modes::{Driven, MissingModes, Modes, OperatingPoint, SystemMode, SystemState};
use super::sliding::{Balance, Base, Sliding, balance};
use nalgebra::DMatrix;
use stickslip_system::friction::Law;
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{Outside, SystemEquations};
use stickslip_system::model::margin::{slowing, twice_resistance};
use stickslip_system::model::system::{End, Pressing, System, Train};
use stickslip_system::signal::Drive;

/// Final value of a signal; the mean of a harmonic.
fn settled(drive: &Drive) -> (f64, &'static str) {
    match drive {
        Drive::Value(value) => (*value, "constant"),
        Drive::Linear(signal) => (
            signal.pieces().all().last().map_or(0.0, |piece| piece.value),
            "held in the end",
        ),
        Drive::Wave(wave) => (wave.mean, "mean"),
        Drive::Sum(terms) => (
            terms.iter().map(|term| settled(term).0).sum(),
            "sum of means and final values",
        ),
    }
}

impl Modes {
    /// Linear modes, steady sliding, and changes of its stability: everything that takes no run.
    pub fn linear(trains: &System) -> Modes {
        let settled = Settled::new(trains);
        let Settled {
            ref sliding,
            force,
            start,
            ..
        } = settled;
        let system = &sliding.system;
        let mut absent = Vec::new();
        let mut lacks = |what: &'static str, why: &str| {
            let why = why.to_owned();
            absent.push(MissingModes { what, why });
        };

        let mut states = Vec::new();
        let mut add = |state: &'static str, relative_velocity: Option<f64>, modes: Vec<SystemMode>| {
            states.push(SystemState {
                state,
                relative_velocity,
                modes,
            });
        };
        match &trains.pressing {
            Pressing::Axial { axial, .. } => add("axial", None, axial_modes(axial)),
            Pressing::Force(_) => lacks("axial mode", "the normal force is given directly"),
        }
        let rest = vec![0.0; system.dimension];
        let pressed = Outside {
            normal_force: force,
            ..Outside::default()
        };
        let of = |mode: Mode, sense: f64, outside: &Outside, y: &[f64], basis: Option<&DMatrix<f64>>| {
            modes_of(system, jacobian(system, mode, sense, outside, y), basis)
        };
        add("separated", None, of(Mode::Separated, 1.0, &pressed, &rest, None));
        if sliding.is_engaged() {
            lacks(
                "stick mode",
                "the contact has none, it creeps; engaged at omega_r = 0 is its rest",
            );
            add("engaged", Some(0.0), of(Mode::Engaged, 1.0, &pressed, &rest, None));
        } else {
            let modes = of(Mode::Stick, 1.0, &pressed, &rest, Some(&stuck(system)));
            match modes.is_empty() {
                true => lacks(
                    "stick mode",
                    "in stick everything moves as it is driven, and no mode is left",
                ),
                false => add("stick", None, modes),
            }
        }

        let mut operating_points: Vec<OperatingPoint> = settled.steady().collect();
        if operating_points.is_empty() {
            let why = if force <= 0.0 {
                "the contact is open: its normal force is not positive"
            } else if start == 0.0 {
                "no relative velocity balances what drives the trains, and at t = 0 there is none"
            } else {
                "not steady: no relative velocity balances what drives the trains; that of t = 0 is taken"
            };
            lacks("steady sliding", why);
            if force > 0.0 && start != 0.0 {
                operating_points.push(sliding.operating(start.signum(), start.abs(), force, None));
            }
        }
        let speeds = match twice_resistance(trains) {
            Some(_) => stopping_speeds(system, force, start),
            None => operating_points.iter().map(|point| point.relative_velocity).collect(),
        };
        for w in speeds {
            let (outside, y) = state(system, w, force);
            let name = if sliding.is_engaged() { "engaged" } else { "slip" };
            add(name, Some(w), of(sliding.mode(w), w.signum(), &outside, &y, None));
        }

        let first = operating_points.first();
        let x = first.map(|point| point.relative_velocity.abs());
        let critical_relative_velocities = sliding.critical_velocities(force, x.unwrap_or(0.0));
        let critical_normal_forces = first.filter(|_| force > 0.0).map(|point| {
            let balance = match point.steady {
                true => settled.balance(point.relative_velocity.signum()),
                false => Balance::Never,
            };
            sliding.critical_forces(force, point.relative_velocity, balance)
        });
        let mut damping = |what: &'static str, train: &Train, scale: fn(f64) -> (f64, f64)| {
            if !train.damping.iter().any(|&c| c > 0.0) {
                lacks(what, "its shafts have no damping");
                return None;
            }
            x.map(|x| sliding.critical_damping(force, x, scale))
        };
        let critical_rotor_damping = damping("critical damping of the rotor", &trains.rotor, |k| (k, 1.0));
        let critical_stator_damping = damping("critical damping of the stator", &trains.stator, |k| (1.0, k));
        Modes {
            slowing: None,
            driving: settled.driving,
            operating_points,
            states,
            critical_relative_velocities,
            critical_normal_forces,
            critical_rotor_damping,
            critical_stator_damping,
            absent,
        }
    }
}

/// Stability of the fastest steady sliding of a case; `None` without steady sliding.
pub fn steady_stability(trains: &System) -> Option<SlidingVerdict> {
    Settled::new(trains).steady().next().map(|point| point.stability)
}

struct Settled {
    sliding: Sliding,
    rotor: Base,
    stator: Base,
    /// Normal force F_n, N: the largest force if sliding slows down by itself, otherwise the final one.
    force: f64,
    start: f64,
    driving: Vec<Driven>,
}

impl Settled {
    fn new(trains: &System) -> Settled {
        let mut driving = Vec::new();
        Settled {
            sliding: Sliding::new(trains.clone()),
            rotor: base(&trains.rotor, ["rotor.speed", "rotor.torque"], &mut driving),
            stator: base(&trains.stator, ["stator.speed", "stator.torque"], &mut driving),
            force: pressing(trains, &mut driving),
            start: at_start(trains),
            driving,
        }
    }

    fn balance(&self, sense: f64) -> Balance {
        balance(&self.rotor, &self.stator, sense)
    }

    fn steady(&self) -> impl Iterator<Item = OperatingPoint> {
        let of_sense = |sense: f64| {
            let speeds = self
                .sliding
                .steady(sense, self.balance(sense), self.force, self.start.abs());
            speeds.into_iter().map(move |x| (sense, x))
        };
        let mut found: Vec<(f64, f64)> = [1.0, -1.0].into_iter().flat_map(of_sense).collect();
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let bases = Some((&self.rotor, &self.stator));
        found
            .into_iter()
            .map(move |(sense, x)| self.sliding.operating(sense, x, self.force, bases))
    }
}

fn base(train: &Train, keys: [&'static str; 2], driving: &mut Vec<Driven>) -> Base {
    let mut take = |key, drive: &Drive| {
        let (value, taken) = settled(drive);
        driving.push(Driven { key, value, taken });
        value
    };
    let speed = match &train.end {
        End::Driven(speed) => take(keys[0], speed),
        End::Free | End::Fixed => 0.0,
    };
    let torque = train
        .torque
        .as_ref()
        .map_or(0.0, |torque| take(keys[1], &torque.signal));
    Base::new(train, speed, torque)
}

fn pressing(trains: &System, driving: &mut Vec<Driven>) -> f64 {
    let (key, (value, taken), largest) = match &trains.pressing {
        Pressing::Force(force) => ("contact.normal_force", settled(force), force.largest()),
        Pressing::Axial { actuation, .. } => {
            let pieces = actuation.pieces();
            let last = pieces.all().last().map_or(0.0, |piece| piece.value);
            ("actuation", (last, "held in the end"), pieces.largest())
        }
    };
    // A contact that is open at the end was closed before.
    let (value, taken) = if value > 0.0 && (value == largest || slowing(trains).is_err()) {
        (value, taken)
    } else {
        (largest, "largest")
    };
    driving.push(Driven { key, value, taken });
    value
}

/// Rising |omega_r| (rad/s) for the modes of a stop: zero, the zeros of the stability margin, and the initial speed.
fn stopping_speeds(system: &SystemEquations, force: f64, start: f64) -> Vec<f64> {
    let mut speeds = critical_speeds(system, force);
    speeds.extend([0.0, start.abs()]);
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    speeds
}

/// |omega_r| (rad/s) of zero stability margin, the highest first; empty unless sliding slows down by itself.
pub(in crate::analysis) fn critical_speeds(system: &SystemEquations, force: f64) -> Vec<f64> {
    let of = |resistance| system.law.damping_zeros(resistance, system.slope_weight(force));
    system.twice_resistance.map(of).unwrap_or_default()
}

pub(in crate::analysis) fn at_start(trains: &System) -> f64 {
    let of = |train: &Train, speeds: &[f64]| match (&train.end, speeds.first()) {
        (_, Some(&speed)) => speed,
        (End::Driven(speed), None) => speed.at_start(),
        (_, None) => 0.0,
    };
    of(&trains.rotor, &trains.initial.rotor_speed) - of(&trains.stator, &trains.initial.stator_speed)
}
