//! Between two neighbouring samples or events of one mode every channel is the polynomial of degree 5 through value,
//! first and second derivative at both ends.

use super::super::Channel;
use super::Physics;
use crate::friction::{FrictionLaw, Law};
use crate::model::Mode;
use crate::model::state::{Components, DIMENSION};
use crate::record::State;
use crate::simulation::trains::TERMS;

/// A gap in which the polynomial misses the equations of motion by more than this part of their own size is not used.
const LARGEST_DEFECT: f64 = 1e-9;

/// In a gap shorter than this part of the natural period the polynomial errs by (2 pi/200)^6/46080 = 2e-14 at most.
const SHORTEST: f64 = 1.0 / 200.0;

/// What the state is made of between events; each is a polynomial of its own.
const BASES: usize = 9;
const Z: usize = 0;
const Z_DOT: usize = 1;
const U: usize = 2;
const U_DOT: usize = 3;
const V: usize = 4;
const V_DOT: usize = 5;
const THETA: usize = 6;
const THETA_DOT: usize = 7;
const SLIDE: usize = 8;

/// A point of the reference: the end of one gap and mostly the start of the next.
#[derive(Debug, Clone, Copy)]
pub struct Node {
    /// s.
    pub(super) time: f64,
    pub(super) mode: Mode,
    /// The state before an event: its gap ends here, and the next one starts from the state after it.
    pub(super) closes: bool,
    value: [f64; BASES],
}

impl Node {
    pub(super) fn new(time: f64, mode: Mode, closes: bool, s: &State) -> Node {
        Node {
            time,
            mode,
            closes,
            value: [
                s.z,
                s.z_dot,
                s.rotor_twist,
                s.rotor_twist_rate,
                s.phi1,
                s.phi1_dot,
                s.theta,
                s.theta_dot,
                s.slip_displacement,
            ],
        }
    }
}

/// First and second derivatives of a state in a mode, by the equations of motion.
fn derivatives(physics: &Physics, time: f64, mode: Mode, x: &[f64; BASES]) -> ([f64; BASES], [f64; BASES]) {
    let model = &physics.torsion;
    let axial = physics.axial.at(time);
    let y = Components {
        rotor_twist: x[U],
        rotor_twist_rate: x[U_DOT],
        stator_twist: x[V],
        stator_twist_rate: x[V_DOT],
        rotor_speed: x[THETA_DOT],
        ..Components::default()
    }
    .state();
    let pressing = (axial.pressing_force.max(0.0), axial.pressing_rate);
    let dy = model.rates_at(mode, || pressing.0, &y);
    let first = Components::of(&dy);
    let torque_rate = match mode {
        Mode::SlipForward | Mode::SlipBackward => model.sliding_torque_rate(f64::from(mode.sense()), &y, &dy, pressing),
        Mode::Stick => {
            let bend = model.torsion.damping * (first.rotor_twist_rate + first.stator_twist_rate);
            (bend + model.torsion.stiffness * (x[U_DOT] + x[V_DOT])) / 2.0
        }
        Mode::Separated | Mode::Engaged => 0.0,
    };
    // The equations are linear but for the torque.
    let mut ddy = [0.0; DIMENSION];
    model.torsion.free_rates(torque_rate, &dy, &mut ddy);
    let second = Components::of(&ddy);
    let (u2, v2, theta2) = (first.rotor_twist_rate, first.stator_twist_rate, first.rotor_speed);
    let (u3, v3, theta3) = (second.rotor_twist_rate, second.stator_twist_rate, second.rotor_speed);
    // m z'' = -F - c_a z' - k_e z, the pressing force less F
    let z2 = (axial.pressing_force - axial.force) / physics.mass;
    let z3 = (axial.pressing_rate - physics.axial.force.slope(time)) / physics.mass;
    (
        [
            x[Z_DOT],
            z2,
            x[U_DOT],
            u2,
            x[V_DOT],
            v2,
            x[THETA_DOT],
            theta2,
            first.slip,
        ],
        [z2, z3, u2, u3, v2, v3, theta2, theta3, second.slip],
    )
}

/// A channel in one gap: a polynomial of degree 5 in the part of the gap that has passed, or a function of others.
#[derive(Debug, Clone, Copy)]
pub enum Curve<'a> {
    /// A polynomial.
    Polynomial([f64; 6]),
    /// max(0, p): the contact force.
    Clipped([f64; 6]),
    /// A polynomial of which so many coefficients count.
    Series([f64; TERMS], usize),
    /// s mu(s omega_r) r F_n: relative velocity, contact force.
    Sliding {
        /// s.
        sense: f64,
        /// omega_r, rad/s.
        velocity: [f64; 6],
        /// The pressing force, N.
        force: [f64; 6],
        /// mu.
        law: &'a FrictionLaw,
        /// r, m.
        radius: f64,
    },
}

#[inline]
pub(in super::super) fn horner(c: &[f64; 6], s: f64) -> f64 {
    c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))))
}

impl Curve<'_> {
    /// Its integral from `a` to `b`, parts of the gap in [0, 1], over the part.
    pub(crate) fn integral(&self, a: f64, b: f64) -> f64 {
        /// Gauss-Legendre with five nodes, exact to degree 9.
        const NODES: [(f64, f64); 5] = [
            (0.0, 0.568_888_888_888_888_9),
            (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
            (0.906_179_845_938_664, 0.236_926_885_056_189_08),
            (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        ];
        let (middle, half) = ((a + b) / 2.0, (b - a) / 2.0);
        half * NODES.iter().map(|(x, w)| w * self.at(middle + half * x)).sum::<f64>()
    }

    /// The channel's value at `s` in [0, 1].
    #[inline]
    pub fn at(&self, s: f64) -> f64 {
        match self {
            Curve::Polynomial(c) => horner(c, s),
            Curve::Clipped(c) => horner(c, s).max(0.0),
            Curve::Series(c, terms) => c[..*terms].iter().rev().fold(0.0, |sum, c| sum * s + c),
            Curve::Sliding {
                sense,
                velocity,
                force,
                law,
                radius,
            } => sense * law.coefficient(sense * horner(velocity, s)) * radius * horner(force, s).max(0.0),
        }
    }
}

/// The gap between two neighbouring nodes.
#[derive(Debug, Clone)]
pub(crate) struct Gap {
    pub(super) left: Node,
    pub(super) right: Node,
    coefficients: Option<[[f64; 6]; BASES]>,
    sparse: bool,
}

impl Gap {
    pub(super) fn new(left: Node, right: Node) -> Gap {
        Gap {
            left,
            right,
            coefficients: None,
            sparse: false,
        }
    }

    /// s, the start and the end.
    pub fn span(&self) -> (f64, f64) {
        (self.left.time, self.right.time)
    }

    /// What the contact does in it.
    pub fn mode(&self) -> Mode {
        self.left.mode
    }

    /// Whether an event ends it.
    pub fn closes(&self) -> bool {
        self.right.closes
    }

    /// theta at its start, rad.
    pub(crate) fn rotor_angle(&self) -> f64 {
        self.left.value[THETA]
    }

    /// Fits the polynomials, once; `false` if the samples are too far apart for them.
    pub(super) fn prepare(&mut self, physics: &Physics) -> bool {
        if self.coefficients.is_some() {
            return !self.sparse;
        }
        let (a, b) = (&self.left, &self.right);
        let h = b.time - a.time;
        let (a1, a2) = derivatives(physics, a.time, a.mode, &a.value);
        // From the left, where a corner of F is at the right end.
        let (b1, b2) = derivatives(physics, b.time.next_down(), a.mode, &b.value);
        let c: [[f64; 6]; BASES] = std::array::from_fn(|k| {
            let (p, v, w) = (a.value[k], h * a1[k], h * h * a2[k] / 2.0);
            let value = b.value[k] - p - v - w;
            let slope = h * b1[k] - v - 2.0 * w;
            let bend = (h * h * b2[k] - 2.0 * w) / 2.0;
            [
                p,
                v,
                w,
                10.0 * value - 4.0 * slope + bend,
                -15.0 * value + 7.0 * slope - 2.0 * bend,
                6.0 * value - 3.0 * slope + bend,
            ]
        });
        // In the middle the polynomials ought to satisfy the equations of motion.
        let middle = c.map(|c| horner(&c, 0.5));
        let (expected, _) = derivatives(physics, a.time + 0.5 * h, a.mode, &middle);
        let omega = physics.torsion.natural_angular_frequency();
        let acceleration = physics.twist * omega * omega;
        let slope = |c: &[f64; 6]| (c[1] + c[2] + 0.75 * c[3] + 0.5 * c[4] + 5.0 / 16.0 * c[5]) / h;
        let defect = |k: usize| (slope(&c[k]) - expected[k]).abs() / acceleration;
        // In a gap as short as this, rounding of its ends is all that the difference shows.
        let short = h < SHORTEST * physics.natural_period;
        self.sparse = !short && [U_DOT, V_DOT].into_iter().any(|k| defect(k) > LARGEST_DEFECT);
        self.coefficients = Some(c);
        !self.sparse
    }

    /// The channel in this gap.
    pub(super) fn curve<'a>(&self, physics: &'a Physics, channel: Channel) -> Curve<'a> {
        let c = self.coefficients.as_ref().expect("prepared before");
        let sum = |terms: &[(f64, usize)]| -> [f64; 6] {
            std::array::from_fn(|n| terms.iter().map(|(factor, k)| factor * c[*k][n]).sum())
        };
        let p = &physics.torsion.torsion;
        let transmitted = || {
            let (k, d) = (p.stiffness / 2.0, p.damping / 2.0);
            sum(&[(k, U), (k, V), (d, U_DOT), (d, V_DOT)])
        };
        let velocity = || sum(&[(1.0, THETA_DOT), (-1.0, U_DOT), (-1.0, V_DOT)]);
        let force = || sum(&[(-physics.damping, Z_DOT), (-physics.stiffness, Z)]);
        Curve::Polynomial(match channel {
            Channel::Z => c[Z],
            Channel::ZDot => c[Z_DOT],
            Channel::Theta => c[THETA],
            Channel::ThetaDot => c[THETA_DOT],
            Channel::Phi1 => c[V],
            Channel::Phi1Dot => c[V_DOT],
            Channel::Phi2 => sum(&[(1.0, THETA), (-1.0, U)]),
            Channel::Phi2Dot => sum(&[(1.0, THETA_DOT), (-1.0, U_DOT)]),
            Channel::RotorTwist => c[U],
            Channel::RotorTwistRate => c[U_DOT],
            Channel::RelativeVelocity if self.mode() == Mode::Stick => [0.0; 6],
            Channel::RelativeVelocity => velocity(),
            Channel::SlipDisplacement => c[SLIDE],
            Channel::NormalForce => return Curve::Clipped(force()),
            Channel::TransmittedTorque => transmitted(),
            // Of trains alone, or integrals over more than a gap.
            Channel::Twist(_)
            | Channel::TwistRate(_)
            | Channel::Speed(_)
            | Channel::Angle(_)
            | Channel::Deflection
            | Channel::NormalImpulse
            | Channel::FrictionImpulse => [f64::NAN; 6],
            Channel::FrictionTorque => match self.mode() {
                Mode::Stick => transmitted(),
                Mode::Separated => [0.0; 6],
                mode => {
                    return Curve::Sliding {
                        sense: f64::from(mode.sense()),
                        velocity: velocity(),
                        force: force(),
                        law: &physics.torsion.friction.law,
                        radius: physics.torsion.contact.radius,
                    };
                }
            },
        })
    }
}
