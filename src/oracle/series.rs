//! The model's equations as recurrences of Taylor coefficients.
//!
//! With c_k for the k-th coefficient of c around the present time, y' = f becomes y_(k+1) = f_k/(k+1), a product becomes a
//! convolution, and E = exp(g) the convolution k E_k = sum of j g_j E_(k-j) over j = 1..k.

use super::axial::AxialMotion;
use super::float::Float;
use super::friction::{self, Friction, Shapes};
use crate::model::ExactParameters;
use num_bigint::BigInt;
use num_rational::BigRational;

/// Components of the state, and their number.
pub(super) mod component {
    /// z, m.
    pub const Z: usize = 0;
    /// z', m/s.
    pub const Z_DOT: usize = 1;
    /// u = theta - phi_2, rad.
    pub const ROTOR_TWIST: usize = 2;
    /// u', rad/s.
    pub const ROTOR_TWIST_RATE: usize = 3;
    /// v = phi_1, rad.
    pub const STATOR_TWIST: usize = 4;
    /// v', rad/s.
    pub const STATOR_TWIST_RATE: usize = 5;
    /// theta', rad/s.
    pub const ROTOR_SPEED: usize = 6;
    /// theta, rad: a quadrature, on which nothing else depends.
    pub(crate) const ROTOR_ANGLE: usize = 7;
    /// How many there are.
    pub const COUNT: usize = 8;
}
use component::*;

/// The unknowns: no force is a difference of large numbers in them.
pub(super) type State<const N: usize> = [Float<N>; COUNT];

/// Which equations hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Law {
    /// Equations (3) with the sense s of omega_r, on a piece of the friction law.
    Slip(i8, usize),
    /// Equation (4).
    Stick,
    /// Free surfaces.
    Separated,
}

/// Highest order of any expansion with that many bits; what costs least is about 0.4 for each.
pub(super) const fn largest_order(bits: usize) -> usize {
    if bits < 128 { 64 } else { bits / 2 }
}

/// The constants of the equations, to the precision of the run.
#[derive(Debug)]
pub(super) struct Model<const N: usize> {
    pub axial: AxialMotion<N>,
    /// c_t, k_t.
    torsion: [Float<N>; 2],
    per_rotor_inertia: Float<N>,
    per_surface_inertia: Float<N>,
    /// The pieces of the friction law.
    friction: Vec<Friction<N>>,
    /// r mu_0.
    breakaway: Float<N>,
    /// 1/k, and k.
    reciprocals: Vec<Float<N>>,
    integers: Vec<Float<N>>,
    ln_2: Float<N>,
}

impl<const N: usize> Model<N> {
    pub fn new(exact: &ExactParameters) -> Self {
        let number = Float::from_rational;
        let orders = 0..=largest_order(Float::<N>::BITS) + 1;
        let integer = |k: usize| BigRational::from_integer(BigInt::from(k));
        Model {
            axial: AxialMotion::new(&exact.mass, &exact.axial_stiffness, &exact.axial_damping),
            torsion: [number(&exact.torsional_damping), number(&exact.torsional_stiffness)],
            per_rotor_inertia: number(&exact.rotor_inertia.recip()),
            per_surface_inertia: number(&exact.surface_inertia.recip()),
            friction: friction::pieces(&exact.radius, &exact.law),
            breakaway: number(&(&exact.radius * &exact.breakaway)),
            reciprocals: orders.clone().map(|k| number(&integer(k.max(1)).recip())).collect(),
            integers: orders.map(|k| number(&integer(k))).collect(),
            ln_2: Float::ln_2(),
        }
    }

    /// T_r or T_s: c_t times the rate plus k_t times the twist, N m.
    pub fn torque(&self, twist: &Float<N>, rate: &Float<N>) -> Float<N> {
        let [damping, stiffness] = &self.torsion;
        &(damping * rate) + &(stiffness * twist)
    }

    /// mu_0 r F_n, N m.
    pub fn breakaway_torque(&self, normal_force: &Float<N>) -> Float<N> {
        &self.breakaway * normal_force
    }
}

/// Taylor coefficients of the motion around the present time.
#[derive(Debug)]
pub(super) struct Expansion<const N: usize> {
    law: Law,
    state: [Vec<Float<N>>; COUNT],
    /// F and F', N and N/s.
    force: [Float<N>; 2],
    /// -c_a z' - k_e z.
    normal: Vec<Float<N>>,
    rotor_torque: Vec<Float<N>>,
    stator_torque: Vec<Float<N>>,
    /// s omega_r and the friction law's shape, in slip.
    shapes: Shapes<N>,
    /// That shape times F_n; empty where it is nothing.
    pressed: Vec<Float<N>>,
}

impl<const N: usize> Expansion<N> {
    /// Of order 0.
    pub fn new(law: Law, state: &State<N>, force: [Float<N>; 2]) -> Self {
        Expansion {
            law,
            state: state.map(|value| vec![value]),
            force,
            normal: Vec::new(),
            rotor_torque: Vec::new(),
            stator_torque: Vec::new(),
            shapes: Shapes::default(),
            pressed: Vec::new(),
        }
    }

    /// Continues the coefficients up to `order`; guards then have that order, and the state one more.
    pub fn extend(&mut self, model: &Model<N>, order: usize) {
        for k in self.normal.len()..=order.min(largest_order(Float::<N>::BITS)) {
            let at = |c: usize| &self.state[c][k];
            let normal = model.axial.normal_force(at(Z), at(Z_DOT));
            let rotor = model.torque(at(ROTOR_TWIST), at(ROTOR_TWIST_RATE));
            let stator = model.torque(at(STATOR_TWIST), at(STATOR_TWIST_RATE));
            let force = self.force.get(k).copied().unwrap_or(Float::zero());
            let axial = model.axial.acceleration(&normal, &force);
            self.normal.push(normal);
            let rotor_acceleration = -&(&rotor * &model.per_rotor_inertia);
            // phi_2'' and phi_1''.
            let (rotor_side, stator_side) = match self.law {
                Law::Slip(sense, piece) => {
                    let interface = self.interface_torque(model, k, (sense, piece));
                    (
                        &(&rotor - &interface) * &model.per_surface_inertia,
                        &(&interface - &stator) * &model.per_surface_inertia,
                    )
                }
                Law::Stick => {
                    let joint = (&(&rotor - &stator) * &model.per_surface_inertia).half();
                    (joint, joint)
                }
                Law::Separated => (
                    &rotor * &model.per_surface_inertia,
                    -&(&stator * &model.per_surface_inertia),
                ),
            };
            self.rotor_torque.push(rotor);
            self.stator_torque.push(stator);
            let per_next = &model.reciprocals[k + 1];
            let rates = [
                &self.state[Z_DOT][k] * per_next,
                &axial * per_next,
                &self.state[ROTOR_TWIST_RATE][k] * per_next,
                &(&rotor_acceleration - &rotor_side) * per_next,
                &self.state[STATOR_TWIST_RATE][k] * per_next,
                &stator_side * per_next,
                &rotor_acceleration * per_next,
                &self.state[ROTOR_SPEED][k] * per_next,
            ];
            for (coefficients, next) in self.state.iter_mut().zip(rates) {
                coefficients.push(next);
            }
        }
    }

    /// Coefficient k of s mu(s omega_r) r F_n, of which all lower ones are there.
    fn interface_torque(&mut self, model: &Model<N>, k: usize, (sense, piece): (i8, usize)) -> Float<N> {
        let rates = [ROTOR_SPEED, ROTOR_TWIST_RATE, STATOR_TWIST_RATE].map(|c| &self.state[c][k]);
        let relative = &(rates[0] - rates[1]) - rates[2];
        let speed = if sense < 0 { -&relative } else { relative };
        let friction = &model.friction[piece];
        let tables = (&model.reciprocals[..], &model.integers[..], &model.ln_2);
        self.shapes.extend(friction, speed, tables);
        let mut torque = &friction.constant * &self.normal[k];
        if !self.shapes.shape.is_empty() {
            let pressed = Float::convolution(&self.shapes.shape, &self.normal);
            torque += &(&friction.falling * &pressed);
            self.pressed.push(pressed);
        }
        if sense < 0 { -&torque } else { torque }
    }

    /// Coefficients of one component.
    pub fn component(&self, component: usize) -> &[Float<N>] {
        &self.state[component]
    }

    /// What of the friction law a step has to follow ([`Shapes::followed`]); empty outside slip.
    pub fn law(&self) -> &[Float<N>] {
        self.shapes.followed()
    }

    /// s omega_r, rad/s; empty outside slip.
    pub fn speed(&self) -> &[Float<N>] {
        &self.shapes.speed
    }

    /// -c_a z' - k_e z, N.
    pub fn normal(&self) -> &[Float<N>] {
        &self.normal
    }

    /// The margin of steady sliding, c_t + 2 r F_n mu'(s omega_r), N m s/rad.
    pub fn margin(&self, model: &Model<N>) -> Vec<Float<N>> {
        let Law::Slip(_, piece) = self.law else {
            return Vec::new();
        };
        let friction = &model.friction[piece];
        let taken = |w: &Float<N>| -&(&friction.negative_damping * w);
        let mut margin: Vec<Float<N>> = match self.shapes.slope(friction) {
            None => self.pressed.iter().map(taken).collect(),
            Some(slope) => {
                let pressed = |k: usize| Float::convolution(&slope[..=k], &self.normal[..=k]);
                (0..slope.len()).map(|k| taken(&pressed(k))).collect()
            }
        };
        if let Some(first) = margin.first_mut() {
            *first += &model.torsion[0];
        }
        margin
    }

    /// mu_0 r F_n - s T_f: what is left before the contact breaks away in the sense s, N m.
    pub(crate) fn reserve(&self, model: &Model<N>, sense: i8) -> Vec<Float<N>> {
        let torques = self.rotor_torque.iter().zip(&self.stator_torque);
        self.normal
            .iter()
            .zip(torques)
            .map(|(normal, (rotor, stator))| {
                let transmitted = (rotor + stator).half();
                let limit = model.breakaway_torque(normal);
                if sense < 0 {
                    &limit + &transmitted
                } else {
                    &limit - &transmitted
                }
            })
            .collect()
    }

    /// The state after `step` (s).
    pub fn at(&self, step: &Float<N>) -> State<N> {
        std::array::from_fn(|c| evaluate(&self.state[c], step))
    }
}

/// A polynomial at `x`, by Horner's rule.
pub(super) fn evaluate<const N: usize>(coefficients: &[Float<N>], x: &Float<N>) -> Float<N> {
    let mut rest = coefficients.iter().rev();
    let Some(last) = rest.next() else {
        return Float::zero();
    };
    rest.fold(*last, |sum, coefficient| &(&sum * x) + coefficient)
}
