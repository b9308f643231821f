//! The linear modes of a system, whether it slides steadily, and where that changes.

use super::impedance::Verdict;
use super::linear::{axial_modes, jacobian, modes_of, state, stuck};
use super::sliding::{Balance, Base, Sliding, balance};
use crate::friction::Law;
use crate::model::Mode;
use crate::model::equations::{Outside, SystemEquations};
use crate::model::margin::{slowing, twice_resistance};
use crate::model::system::{End, Pressing, System, Train};
use crate::signal::Drive;
use nalgebra::DMatrix;

pub use super::modes_report::{
    Absent, Change, Driven, OperatingPoint, Search, ShapeComponent, SystemMode, SystemModes, SystemState,
};

/// A signal as one number: what it holds in the end, and of a harmonic its mean.
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

impl SystemModes {
    /// Of a case.
    pub fn of_case(trains: &System) -> SystemModes {
        let sliding = Sliding::new(trains);
        let system = &sliding.system;
        let mut absent = Vec::new();
        let mut driving = Vec::new();
        let rotor = base(&trains.rotor, ["rotor.speed", "rotor.torque"], &mut driving);
        let stator = base(&trains.stator, ["stator.speed", "stator.torque"], &mut driving);
        let force = pressing(trains, &mut driving);

        let mut states = Vec::new();
        match &trains.pressing {
            Pressing::Axial { axial, .. } => states.push(SystemState {
                state: "axial",
                relative_velocity: None,
                modes: axial_modes(axial),
            }),
            Pressing::Force(_) => absent.push(Absent {
                what: "axial mode",
                why: "the normal force is given directly".to_owned(),
            }),
        }
        let rest = vec![0.0; system.dimension];
        let pressed = Outside {
            normal_force: force,
            ..Outside::default()
        };
        let of = |mode: Mode, sense: f64, outside: &Outside, y: &[f64], basis: Option<&DMatrix<f64>>| {
            modes_of(system, &jacobian(system, mode, sense, outside, y), basis)
        };
        states.push(SystemState {
            state: "separated",
            relative_velocity: None,
            modes: of(Mode::Separated, 1.0, &pressed, &rest, None),
        });
        if sliding.is_engaged() {
            absent.push(Absent {
                what: "stick mode",
                why: "the contact has none, it creeps; engaged at omega_r = 0 is its rest".to_owned(),
            });
            states.push(SystemState {
                state: "engaged",
                relative_velocity: Some(0.0),
                modes: of(Mode::Engaged, 1.0, &pressed, &rest, None),
            });
        } else {
            let modes = of(Mode::Stick, 1.0, &pressed, &rest, Some(&stuck(system)));
            if modes.is_empty() {
                absent.push(Absent {
                    what: "stick mode",
                    why: "in stick everything moves as it is driven, and no mode is left".to_owned(),
                });
            } else {
                states.push(SystemState {
                    state: "stick",
                    relative_velocity: None,
                    modes,
                });
            }
        }

        let start = at_start(trains);
        let balances = [1.0, -1.0].map(|sense| (sense, balance(&rotor, &stator, sense)));
        let mut operating_points = Vec::new();
        for (sense, balance) in balances {
            for x in sliding.steady(balance, force, start.abs()) {
                operating_points.push(sliding.operating(sense, x, force, Some((&rotor, &stator))));
            }
        }
        operating_points.sort_by(|a, b| b.relative_velocity.abs().total_cmp(&a.relative_velocity.abs()));
        if operating_points.is_empty() {
            let why = if force <= 0.0 {
                "the contact is open: its normal force is not positive".to_owned()
            } else if start == 0.0 {
                "no relative velocity balances what drives the trains, and at t = 0 there is none".to_owned()
            } else {
                "not steady: no relative velocity balances what drives the trains; that of t = 0 is taken".to_owned()
            };
            absent.push(Absent {
                what: "steady sliding",
                why,
            });
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
            let mode = sliding.mode(w);
            states.push(SystemState {
                state: if sliding.is_engaged() { "engaged" } else { "slip" },
                relative_velocity: Some(w),
                modes: of(mode, w.signum(), &outside, &y, None),
            });
        }

        let first = operating_points.first();
        let x = first.map(|point| point.relative_velocity.abs());
        let critical_relative_velocities = sliding.critical_velocities(force, x.unwrap_or(0.0));
        let critical_normal_forces = first.filter(|_| force > 0.0).map(|point| {
            let balance = if point.steady {
                balance(&rotor, &stator, point.relative_velocity.signum())
            } else {
                Balance::Never
            };
            sliding.critical_forces(force, point.relative_velocity.abs(), balance)
        });
        let mut damping = |what: &'static str, train: &Train, scale: fn(f64) -> (f64, f64)| {
            if !train.damping.iter().any(|&c| c > 0.0) {
                absent.push(Absent {
                    what,
                    why: "its shafts have no damping".to_owned(),
                });
                return None;
            }
            x.map(|x| sliding.critical_damping(force, x, scale))
        };
        let critical_rotor_damping = damping("critical damping of the rotor", &trains.rotor, |k| (k, 1.0));
        let critical_stator_damping = damping("critical damping of the stator", &trains.stator, |k| (1.0, k));
        SystemModes {
            driving,
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

/// What becomes of a small disturbance of the fastest steady sliding of a case; `None` where there is no steady sliding.
pub fn steady_stability(trains: &System) -> Option<Verdict> {
    let sliding = Sliding::new(trains);
    let mut driving = Vec::new();
    let rotor = base(&trains.rotor, ["rotor.speed", "rotor.torque"], &mut driving);
    let stator = base(&trains.stator, ["stator.speed", "stator.torque"], &mut driving);
    let force = pressing(trains, &mut driving);
    let start = at_start(trains).abs();
    let found = [1.0, -1.0].into_iter().flat_map(|sense| {
        let steady = sliding.steady(balance(&rotor, &stator, sense), force, start);
        steady.into_iter().map(move |x| (sense, x))
    });
    let (sense, x) = found.max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(sliding.operating(sense, x, force, Some((&rotor, &stator))).stability)
}

/// What holds a train, with its signals as numbers.
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

/// F_n, N: of sliding that slows down by itself the largest, of other what it comes to.
fn pressing(trains: &System, driving: &mut Vec<Driven>) -> f64 {
    let (key, (value, taken), largest) = match &trains.pressing {
        Pressing::Force(force) => ("contact.normal_force", settled(force), force.largest()),
        Pressing::Axial { actuation, .. } => {
            let pieces = actuation.pieces();
            let last = pieces.all().last().map_or(0.0, |piece| piece.value);
            ("actuation", (last, "held in the end"), pieces.largest())
        }
    };
    // A contact that opens in the end had been pressed before.
    let (value, taken) = if value > 0.0 && (value == largest || slowing(trains).is_err()) {
        (value, taken)
    } else {
        (largest, "largest")
    };
    driving.push(Driven { key, value, taken });
    value
}

/// |omega_r| (rad/s) at which the modes of sliding that slows down by itself are told: at its start, where its margin of stability is
/// zero, and at its end; rising.
fn stopping_speeds(system: &SystemEquations, force: f64, start: f64) -> Vec<f64> {
    let mut speeds = critical_speeds(system, force);
    speeds.extend([0.0, start.abs()]);
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    speeds
}

/// |omega_r| (rad/s) at which the margin of stability changes its sign under a normal force (N), the highest first; none where sliding
/// does not slow down by itself.
pub(in crate::analysis) fn critical_speeds(system: &SystemEquations, force: f64) -> Vec<f64> {
    let of = |resistance| system.law.damping_zeros(resistance, system.slope_weight(force));
    system.twice_resistance.map(of).unwrap_or_default()
}

/// omega_r at t = 0, rad/s.
pub(in crate::analysis) fn at_start(trains: &System) -> f64 {
    let of = |train: &Train, speeds: &[f64]| match (&train.end, speeds.first()) {
        (_, Some(&speed)) => speed,
        (End::Driven(speed), None) => speed.at_start(),
        (_, None) => 0.0,
    };
    of(&trains.rotor, &trains.initial.rotor_speed) - of(&trains.stator, &trains.initial.stator_speed)
}
