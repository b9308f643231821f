//! The Taylor expansion of a motion in numbers other than `f64`: enclosures, and doubles with a first-order error.
//! They are compared with the expansion in `f64`.

use crate::common::systems::{self, AXIAL, exponential, pair, ramp, train};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};
use stickslip::friction::{
    Asymmetric, Coulomb, Exponential, FrictionLaw, Hyperbolic, Interpolation, Law, Polynomial, Stribeck, Table,
};
use stickslip::model::equations::SystemEquations;
use stickslip::model::system::{Bristles, ContactLaw, End, Pressing, Regularisation, Smoothing, System, Torque, Train};
use stickslip::model::{BreakawayTest, Mode};
use stickslip::numerics::Number;
use stickslip::signal::{Drive, Frequency, HarmonicShape, Wave};
use stickslip::simulation::expansion::{Expansion, Series};
use stickslip::simulation::{SystemDynamics, SystemLocation};

// Numbers.

/// All reals from `low` to `high`. Every bound is rounded outwards by one unit in the last place, bounds of functions
/// by two. Then the correctly rounded result of any points inside is inside, and so is that of a function with an
/// error of one unit. A comparison is true if it is certain.
#[derive(Debug, Clone, Copy)]
struct Interval {
    low: f64,
    high: f64,
}

impl Interval {
    fn outwards(low: f64, high: f64) -> Interval {
        let (low, high) = (low.next_down(), high.next_up());
        Interval { low, high }
    }

    fn hull(values: [f64; 4]) -> Interval {
        let [low, high] = [f64::min, f64::max].map(|of: fn(f64, f64) -> f64| values.into_iter().reduce(of).unwrap());
        Interval::outwards(low, high)
    }

    fn is(self, value: f64) -> bool {
        self.low == value && self.high == value
    }

    fn holds(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    fn width(self) -> f64 {
        self.high - self.low
    }

    fn rising(self, function: impl Fn(f64) -> f64) -> Interval {
        Interval::outwards(function(self.low).next_down(), function(self.high).next_up())
    }
}

impl PartialEq for Interval {
    fn eq(&self, other: &Interval) -> bool {
        self.partial_cmp(other) == Some(Ordering::Equal)
    }
}

impl PartialOrd for Interval {
    fn partial_cmp(&self, other: &Interval) -> Option<Ordering> {
        if self.high < other.low {
            Some(Ordering::Less)
        } else if self.low > other.high {
            Some(Ordering::Greater)
        } else {
            (self.is(other.low) && other.is(self.low)).then_some(Ordering::Equal)
        }
    }
}

/// An operator on one type, from an expression of its two sides.
macro_rules! operator {
    ($number:ty: $operator:ident, $method:ident, |$one:ident, $other:ident| $result:expr) => {
        impl $operator for $number {
            type Output = $number;

            fn $method(self, $other: $number) -> $number {
                let $one = self;
                $result
            }
        }
    };
}

/// Functions of a [`Number`] that rise everywhere.
macro_rules! rising {
    ($($function:ident),*) => { $(fn $function(self) -> Interval { self.rising(f64::$function) })* };
}

operator!(Interval: Add, add, |one, other| {
    if one.is(0.0) {
        other
    } else if other.is(0.0) {
        one
    } else {
        Interval::outwards(one.low + other.low, one.high + other.high)
    }
});
operator!(Interval: Sub, sub, |one, other| one + -other);
operator!(Interval: Mul, mul, |one, other| {
    for (one, another) in [(one, other), (other, one)] {
        if one.is(0.0) || another.is(1.0) {
            return one;
        } else if another.is(-1.0) {
            return -one;
        }
    }
    let [a, b, c, d] = [one.low, one.high, other.low, other.high];
    Interval::hull([a * c, a * d, b * c, b * d])
});
operator!(Interval: Div, div, |one, other| {
    assert!(!other.holds(0.0), "a division by what may be zero");
    if one.is(0.0) || other.is(1.0) {
        return one;
    }
    let [a, b, c, d] = [one.low, one.high, other.low, other.high];
    Interval::hull([a / c, a / d, b / c, b / d])
});

impl Neg for Interval {
    type Output = Interval;

    fn neg(self) -> Interval {
        let (low, high) = (-self.high, -self.low);
        Interval { low, high }
    }
}

impl Number for Interval {
    fn of(x: f64) -> Interval {
        Interval { low: x, high: x }
    }

    fn pi() -> Interval {
        Interval::outwards(std::f64::consts::PI, std::f64::consts::PI)
    }

    rising!(exp, exp_m1, sqrt, tanh, atan);

    fn sin_cos(self) -> (Interval, Interval) {
        // No slope exceeds 1.
        let middle = f64::midpoint(self.low, self.high);
        let reach = (self.width() + middle.abs() * f64::EPSILON) + 4.0 * f64::EPSILON;
        let about = |value: f64| Interval::outwards(value - reach, value + reach);
        (about(middle.sin()), about(middle.cos()))
    }

    fn cosh(self) -> Interval {
        let (near, far) = (self.low.abs().min(self.high.abs()), self.low.abs().max(self.high.abs()));
        let low = if self.holds(0.0) { 0.0 } else { near };
        Interval { low, high: far }.rising(f64::cosh)
    }
}

/// A double with a first-order bound of its error: the errors of the earlier operations, and half a unit in the last
/// place for its own.
#[derive(Debug, Clone, Copy)]
struct Uncertain {
    value: f64,
    error: f64,
}

impl Uncertain {
    fn rounded(value: f64, error: f64) -> Uncertain {
        let error = error + value.abs() * f64::EPSILON / 2.0;
        Uncertain { value, error }
    }

    fn function(self, value: f64, slope: f64) -> Uncertain {
        Uncertain::rounded(value, slope.abs() * self.error + value.abs() * f64::EPSILON)
    }
}

impl PartialEq for Uncertain {
    fn eq(&self, other: &Uncertain) -> bool {
        self.value == other.value
    }
}

impl PartialOrd for Uncertain {
    fn partial_cmp(&self, other: &Uncertain) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

operator!(Uncertain: Add, add, |one, other| {
    Uncertain::rounded(one.value + other.value, one.error + other.error)
});
operator!(Uncertain: Sub, sub, |one, other| one + -other);
operator!(Uncertain: Mul, mul, |one, other| {
    let error = one.value.abs() * other.error + other.value.abs() * one.error;
    Uncertain::rounded(one.value * other.value, error)
});
operator!(Uncertain: Div, div, |one, other| {
    let value = one.value / other.value;
    Uncertain::rounded(value, (one.error + value.abs() * other.error) / other.value.abs())
});

impl Neg for Uncertain {
    type Output = Uncertain;

    fn neg(self) -> Uncertain {
        let value = -self.value;
        Uncertain { value, ..self }
    }
}

impl Number for Uncertain {
    fn of(value: f64) -> Uncertain {
        Uncertain { value, error: 0.0 }
    }

    fn pi() -> Uncertain {
        Uncertain::rounded(std::f64::consts::PI, 0.0)
    }

    fn exp(self) -> Uncertain {
        self.function(self.value.exp(), self.value.exp())
    }

    fn exp_m1(self) -> Uncertain {
        self.function(self.value.exp_m1(), self.value.exp())
    }

    fn sqrt(self) -> Uncertain {
        self.function(self.value.sqrt(), 0.5 / self.value.sqrt())
    }

    fn sin_cos(self) -> (Uncertain, Uncertain) {
        let (sine, cosine) = self.value.sin_cos();
        // The enclosure's slopes are 1, and its errors those of a value of 1.
        let about = |value: f64| Uncertain {
            value,
            error: self.error + (4.0 + self.value.abs()) * f64::EPSILON,
        };
        (about(sine), about(cosine))
    }

    fn tanh(self) -> Uncertain {
        self.function(self.value.tanh(), 1.0)
    }

    fn cosh(self) -> Uncertain {
        self.function(self.value.cosh(), self.value.sinh())
    }

    fn atan(self) -> Uncertain {
        self.function(self.value.atan(), 1.0)
    }
}

// Systems.

fn wave(mean: f64, amplitude: f64, frequency: Frequency) -> Drive {
    let wave = systems::wave(HarmonicShape::Sine, amplitude, frequency, 0.4);
    Drive::Wave(Wave { mean, ..wave })
}

fn system(rotor: Train, stator: Train, pressing: Pressing, law: impl Into<FrictionLaw>) -> System {
    System {
        radius: 0.7,
        breakaway: 0.65,
        ..pair(rotor, stator, pressing, law)
    }
}

fn falling() -> Exponential {
    exponential(0.6, 0.3, 3.5)
}

/// The paper's brake: an axial mode that rings under a ramp.
fn brake() -> System {
    let (axial, actuation) = (AXIAL, ramp(2225.0, 1.0));
    let shaft = |inertia: &[f64], end| train(inertia, &[7.71e6], &[22.606], end);
    let (rotor, stator) = (shaft(&[0.0113, 2.262], End::Free), shaft(&[0.0113], End::Fixed));
    let mut brake = system(rotor, stator, Pressing::Axial { axial, actuation }, falling());
    brake.radius = 0.052388;
    brake.breakaway_test = BreakawayTest::Rotor;
    brake
}

/// A block on a belt whose speed and force are harmonics.
fn belt(law: impl Into<FrictionLaw>) -> System {
    let speed = Drive::Sum(vec![
        Drive::Value(0.1),
        wave(0.1, 0.05, Frequency::Cycles(0.3)),
        wave(0.0, 0.02, Frequency::Angular(1.7)),
    ]);
    let force = Pressing::Force(wave(1.0, 0.3, Frequency::Angular(0.9)));
    let block = train(&[1.3], &[1.1], &[0.05], End::Fixed);
    system(train(&[], &[], &[], End::Driven(speed)), block, force, law)
}

/// Three inertias on each side, with bearings and an external torque; one end is driven.
fn chain() -> System {
    let (stiffness, damping) = ([4.0, 3.0, 5.0], [0.02, 0.01, 0.03]);
    let driven = End::Driven(wave(2.0, 0.3, Frequency::Cycles(0.2)));
    let mut rotor = train(&[0.5, 1.2, 0.8], &stiffness, &damping, driven);
    let mut stator = train(&[0.4, 0.9, 1.1], &stiffness[..2], &damping[..2], End::Free);
    rotor.viscous = vec![0.01, 0.0, 0.02];
    stator.viscous = vec![0.0, 0.03, 0.0];
    let signal = wave(0.4, 0.2, Frequency::Angular(1.3));
    stator.torque = Some(Torque { signal, on: 2 });
    system(rotor, stator, Pressing::Force(Drive::Value(1.5)), falling())
}

/// Every law on the belt, and every contact without stick.
fn belts() -> Vec<System> {
    let table = |interpolation| Table::new(vec![0.0, 0.3, 0.8, 2.0], vec![0.6, 0.45, 0.4, 0.42], interpolation);
    let mut belts = vec![
        belt(Coulomb { kinetic: 0.4 }),
        belt(Asymmetric {
            kinetic: 0.4,
            kinetic_backward: 0.3,
            breakaway_backward: 0.5,
        }),
        belt(falling()),
        belt(Hyperbolic {
            low_speed: 0.6,
            high_speed: 0.2,
            scale: 0.4,
        }),
        belt(Stribeck {
            low_speed: 0.6,
            high_speed: 0.3,
            scale: 0.5,
            exponent: 2.0,
            viscous: 0.05,
        }),
        belt(Polynomial {
            low_speed: 0.6,
            linear: -0.3,
            quadratic: 0.1,
            cubic: 0.02,
            valid_below: 4.0,
        }),
        belt(table(Interpolation::MonotoneCubic)),
        belt(table(Interpolation::Linear)),
    ];
    let regularised = |function| ContactLaw::Regularised(Regularisation { function, speed: 0.5 });
    let bristles = Bristles {
        stiffness: 10.0,
        damping: 0.3,
        viscous: 0.1,
        deflection: 0.0,
    };
    for contact in [
        regularised(Smoothing::Tanh),
        regularised(Smoothing::Arctan),
        ContactLaw::Bristles(bristles),
    ] {
        let mut belt = belt(falling());
        belt.contact = contact;
        belts.push(belt);
    }
    belts
}

/// A motion: its start, and the unit of time of its expansion (s).
struct Motion {
    dynamics: SystemDynamics,
    location: SystemLocation,
    t: f64,
    y: Vec<f64>,
    unit: f64,
}

impl Motion {
    /// Every coefficient of an expansion, with its order and a name.
    fn coefficients<T: Number>(&self, system: &SystemEquations<T>, y: &[T]) -> Vec<(String, T)> {
        let mut expansion = Expansion::new(system, &self.dynamics.excitation);
        let context = (system, &self.dynamics.excitation);
        expansion.expand(context, &self.location, self.t, y, self.unit);
        let mut all = Vec::new();
        let mut take = |name: &str, series: &Series<T>| {
            all.extend(series.iter().enumerate().map(|(n, c)| (format!("{name}, {n}"), *c)));
        };
        for (k, series) in expansion.state.iter().enumerate() {
            take(&format!("component {k}"), series);
        }
        take("omega_r", &expansion.relative_velocity);
        take("T", &expansion.interface);
        take("F_n", expansion.normal_force());
        take("T_f", &expansion.transmitted(system));
        match self.location.mode {
            Mode::Stick => {
                take("forward limit", &expansion.limit(system, 1.0));
                take("backward limit", &expansion.limit(system, -1.0));
                take("tested", &expansion.tested(system));
            }
            Mode::SlipForward | Mode::SlipBackward => {
                if let Some(margin) = expansion.stability_guard(system) {
                    take("margin", &margin);
                }
            }
            _ => {}
        }
        let mut after = vec![T::of(0.0); y.len()];
        expansion.at(0.7, &mut after);
        let named = |(k, c)| (format!("component {k} later"), c);
        all.extend(after.into_iter().enumerate().map(named));
        all
    }

    fn plain(&self) -> Vec<(String, f64)> {
        self.coefficients(&self.dynamics.system, &self.y)
    }
}

/// The motions of a system in each of its modes and senses, at some times.
fn motions(trains: &System, times: [f64; 2], speed: f64, twist: f64, unit: f64) -> Vec<Motion> {
    use Mode::{Engaged, Separated, SlipBackward, SlipForward, Stick};
    let modes: &[(Mode, i8)] = match trains.contact {
        ContactLaw::StickSlip => &[(SlipForward, 1), (SlipBackward, -1), (Stick, 0), (Separated, 0)],
        _ => &[(Engaged, 1), (Engaged, -1)],
    };
    let mut found = Vec::new();
    for &(mode, sense) in modes {
        for t in times {
            let dynamics = SystemDynamics::new(trains, 0.0);
            let system = &dynamics.system;
            let mut y: Vec<f64> = (0..system.dimension).map(|k| (k as f64 + 0.7).sin()).collect();
            for side in [&system.rotor, &system.stator] {
                for i in 0..side.shafts() {
                    y[side.twists + 2 * i] *= twist;
                    y[side.twists + 2 * i + 1] *= 0.3 * speed;
                }
            }
            let mut location = SystemLocation {
                sense,
                ..SystemLocation::new(mode, dynamics.excitation.stretch(t))
            };
            // Sets omega_r to the requested value.
            let lacks = f64::from(sense) * speed - system.relative_velocity(&dynamics.outside(&location, t), &y);
            match system.rotor.speed {
                Some(index) => y[index] += lacks,
                None => y[system.stator.twists + 1] -= lacks,
            }
            location.piece = system.piece_of(speed);
            assert!(location.piece > 0 || system.law.knots().is_empty() || system.law.ends_at() > speed);
            found.push(Motion {
                dynamics,
                location,
                t,
                y,
                unit,
            });
        }
    }
    found
}

fn all_motions() -> Vec<Motion> {
    // 0.3 s is on the ramp; 1.0005 s is in the ringing that follows its end.
    let mut all = motions(&brake(), [0.3, 1.0005], 0.5, 1e-4, 3e-5);
    for trains in belts() {
        // Bristles are stiffer than the block's spring.
        let is_stiff = matches!(trains.contact, ContactLaw::Bristles(_));
        let unit = if is_stiff { 0.05 } else { 0.5 };
        all.extend(motions(&trains, [0.5, 7.0], 0.45, 0.3, unit));
    }
    all.extend(motions(&chain(), [0.5, 7.0], 0.45, 0.3, 0.2));
    all
}

// Tests.

/// Compares enclosures with the coefficients in doubles, and their widths with the first-order errors. An operation
/// widens an enclosure by four of the half units in the last place of which it adds one to the error. The following
/// operations change widths and errors equally to first order. Another factor of 2 is room for the second order.
#[track_caller]
fn holds(enclosures: &[(String, Interval)], doubles: &[(String, f64)], errors: &[(String, Uncertain)], said: &str) {
    assert_eq!(enclosures.len(), doubles.len());
    for ((name, enclosure), ((_, double), (_, error))) in enclosures.iter().zip(doubles.iter().zip(errors)) {
        assert!(enclosure.holds(*double), "{said}, {name}: {double:e} in {enclosure:?}");
        // If all values are zero, the outward roundings of zero remain.
        let bound = 8.0 * error.error + 1e-300;
        let found = enclosure.width();
        assert!(found <= bound, "{said}, {name}: {enclosure:?} is wider than {bound:e}");
    }
}

fn of<T: Number>(values: &[f64]) -> Vec<T> {
    values.iter().map(|value| T::of(*value)).collect()
}

#[test]
fn analytic_enclosures_hold_the_coefficients_in_doubles() {
    let mut worst: f64 = 0.0;
    for (number, motion) in all_motions().iter().enumerate() {
        let system = &motion.dynamics.system;
        let doubles = motion.plain();
        let enclosures = motion.coefficients(&system.map(Interval::of), &of(&motion.y));
        let errors = motion.coefficients(&system.map(Uncertain::of), &of(&motion.y));
        let said = format!("motion {number}, {:?} of {}", motion.location.mode, system.law.name());
        holds(&enclosures, &doubles, &errors, &said);
        // The later state is a sum of 28 terms, each with up to some tens of roundings.
        for (name, enclosure) in enclosures.iter().filter(|(name, _)| name.ends_with("later")) {
            let share = enclosure.width() / enclosure.low.abs().max(enclosure.high.abs());
            worst = worst.max(share);
            assert!(share < 1e-10, "{said}, {name}: {enclosure:?}");
        }
    }
    assert!(worst > f64::EPSILON, "{worst:e}");
}

/// Inertia, stiffness, damping and radius are known to 1e-6: the motions of all points inside are inside.
#[test]
fn analytic_enclosures_of_parameters_hold_what_is_inside() {
    const WIDTH: f64 = 1e-6;
    for (number, motion) in all_motions().iter().enumerate() {
        let system = &motion.dynamics.system;
        let mut enclosing = system.map(Interval::of);
        let mut uncertain = system.map(Uncertain::of);
        let wide = |value: &mut Interval| {
            // With room for the roundings of a point.
            let reach = (0.5 * WIDTH + 4.0 * f64::EPSILON) * value.low.abs();
            *value = Interval::outwards(value.low - reach, value.high + reach);
        };
        let vague = |value: &mut Uncertain| value.error = (0.5 * WIDTH + 8.0 * f64::EPSILON) * value.value.abs();
        for side in [&mut enclosing.rotor, &mut enclosing.stator] {
            let inertia = side.inertia.iter_mut().chain(&mut side.stiffness);
            inertia.chain(&mut side.damping).for_each(wide);
        }
        for side in [&mut uncertain.rotor, &mut uncertain.stator] {
            let inertia = side.inertia.iter_mut().chain(&mut side.stiffness);
            inertia.chain(&mut side.damping).for_each(vague);
        }
        wide(&mut enclosing.radius);
        vague(&mut uncertain.radius);
        let enclosures = motion.coefficients(&enclosing, &of(&motion.y));
        let errors = motion.coefficients(&uncertain, &of(&motion.y));
        for corner in 0..8 {
            let mut moved = system.clone();
            // Ends and interior points, different for each parameter.
            let mut place = corner;
            let mut move_ = |value: &mut f64| {
                place = (place * 5 + 3) % 8;
                *value *= 1.0 + WIDTH * (f64::from(place) / 7.0 - 0.5);
            };
            for side in [&mut moved.rotor, &mut moved.stator] {
                let inertia = side.inertia.iter_mut().chain(&mut side.stiffness);
                inertia.chain(&mut side.damping).for_each(&mut move_);
            }
            move_(&mut moved.radius);
            let doubles = motion.coefficients(&moved, &motion.y);
            holds(
                &enclosures,
                &doubles,
                &errors,
                &format!("motion {number}, corner {corner}"),
            );
        }
    }
}
