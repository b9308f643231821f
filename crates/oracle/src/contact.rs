//! The torque of the contact, rotor on stator: slip by the friction law, and contacts without stick.

use super::elementary::Elementary;
use super::float::Float;
use super::friction::{self, ExactFriction, Shapes};
use stickslip_system::model::system::{ContactLaw, ExactSystem, Smoothing};

#[derive(Debug)]
pub(super) struct ExactContact<const N: usize> {
    friction: Vec<ExactFriction<N>>,
    engaged: Engaged<N>,
}

#[derive(Debug)]
enum Engaged<const N: usize> {
    Never,
    Smooth {
        function: Smoothing,
        per_speed: Float<N>,
    },
    Bristles {
        /// sigma_0, sigma_1, sigma_2.
        sigma: [Float<N>; 3],
        radius: Float<N>,
    },
}

impl<const N: usize> ExactContact<N> {
    pub fn new(exact: &ExactSystem) -> Self {
        let number = Float::from_rational;
        ExactContact {
            friction: friction::pieces(&exact.radius, &exact.law),
            engaged: match &exact.contact {
                ContactLaw::StickSlip => Engaged::Never,
                ContactLaw::Regularised(regularisation) => Engaged::Smooth {
                    function: regularisation.function,
                    per_speed: number(&regularisation.speed.recip()),
                },
                ContactLaw::Bristles(bristles) => Engaged::Bristles {
                    sigma: [&bristles.stiffness, &bristles.damping, &bristles.viscous].map(number),
                    radius: number(&exact.radius),
                },
            },
        }
    }

    pub fn sticks(&self) -> bool {
        matches!(self.engaged, Engaged::Never)
    }
}

#[derive(Debug, Default)]
pub(super) struct ContactSeries<const N: usize> {
    /// x = s omega_r and the shape of the friction law.
    shapes: Shapes<N>,
    /// Shape times F_n in slip; empty for a zero shape.
    pressed: Vec<Float<N>>,
    /// r mu, in a contact without stick.
    coefficient: Vec<Float<N>>,
    /// y = x/eps, and k y_k.
    ratio: Vec<Float<N>>,
    rate: Vec<Float<N>>,
    /// tanh y or arctan y; its derivative by y; and the auxiliary series: the product of both, or 1 + y^2.
    smooth: Vec<Float<N>>,
    slope: Vec<Float<N>>,
    auxiliary: Vec<Float<N>>,
    /// r mu f, or sigma_0 z + sigma_1 z' + sigma_2 omega_r.
    factor: Vec<Float<N>>,
    /// z/g.
    loading: Vec<Float<N>>,
    /// 1 over the first coefficient of the divisor.
    per_first: Float<N>,
    /// 2/pi, for arctan.
    per_half_pi: Float<N>,
    pub deflection: Vec<Float<N>>,
}

type KnownForce<'a, const N: usize> = (&'a [Float<N>], &'a [Float<N>]);

/// The next coefficient of a quotient q = n/d, where d has one coefficient more than q.
fn quotient<const N: usize>(
    numerator: &Float<N>,
    denominator: &[Float<N>],
    so_far: &[Float<N>],
    per_first: &Float<N>,
) -> Float<N> {
    let known = Float::convolution(&denominator[1..], so_far);
    &(numerator - &known) * per_first
}

impl<const N: usize> ContactSeries<N> {
    pub fn new(deflection: &Float<N>) -> Self {
        ContactSeries {
            deflection: vec![*deflection],
            ..ContactSeries::default()
        }
    }

    /// s omega_r; empty without a friction law.
    pub fn speed(&self) -> &[Float<N>] {
        &self.shapes.speed
    }

    pub fn rest(&mut self) {
        self.deflection.push(Float::zero());
    }

    fn law(&mut self, friction: &ExactFriction<N>, table: &Elementary<N>, speed: Float<N>) -> Float<N> {
        let k = self.shapes.speed.len();
        self.shapes.extend(friction, speed, table);
        let mut value = match self.shapes.shape.get(k) {
            Some(shape) => &friction.falling * shape,
            None => Float::zero(),
        };
        if k == 0 {
            value += &friction.constant;
        }
        self.coefficient.push(value);
        value
    }

    /// The next coefficient of s mu(s omega_r) r F_n.
    pub fn slip(
        &mut self,
        contact: &ExactContact<N>,
        table: &Elementary<N>,
        (sense, piece): (i8, usize),
        (relative, normal): (&Float<N>, &[Float<N>]),
    ) -> Float<N> {
        let speed = if sense < 0 { -relative } else { *relative };
        let friction = &contact.friction[piece];
        self.shapes.extend(friction, speed, table);
        self.deflection.push(Float::zero());
        let mut torque = match normal.last() {
            Some(normal) => &friction.constant * normal,
            None => Float::zero(),
        };
        if !self.shapes.shape.is_empty() {
            let pressed = Float::convolution(&self.shapes.shape, normal);
            torque += &(&friction.falling * &pressed);
            self.pressed.push(pressed);
        }
        if sense < 0 { -&torque } else { torque }
    }

    /// 2 R + 2 r F_n mu'(s omega_r) of a slip, N m s/rad. Without resistance the factor F_n, which is positive, is
    /// left out: the margin then has the sign of the slope of friction.
    pub fn margin(
        &self,
        contact: &ExactContact<N>,
        piece: usize,
        twice_resistance: &Float<N>,
        normal: &[Float<N>],
    ) -> Vec<Float<N>> {
        let friction = &contact.friction[piece];
        let taken = |w: &Float<N>| -&(&friction.negative_damping * w);
        let undamped = twice_resistance.is_zero();
        let mut margin: Vec<Float<N>> = match self.shapes.slope(friction) {
            None if undamped => self.shapes.shape.iter().map(taken).collect(),
            Some(slope) if undamped => slope.iter().map(taken).collect(),
            None => self.pressed.iter().map(taken).collect(),
            Some(slope) => {
                let pressed = |k: usize| Float::convolution(&slope[..=k], &normal[..=k]);
                (0..slope.len()).map(|k| taken(&pressed(k))).collect()
            }
        };
        if let Some(first) = margin.first_mut() {
            *first += twice_resistance;
        }
        margin
    }

    pub fn engaged(
        &mut self,
        contact: &ExactContact<N>,
        table: &Elementary<N>,
        (sense, piece): (i8, usize),
        (relative, normal): KnownForce<'_, N>,
    ) -> Float<N> {
        let k = relative.len() - 1;
        let speed = if sense < 0 { -&relative[k] } else { relative[k] };
        let coefficient = self.law(&contact.friction[piece], table, speed);
        match &contact.engaged {
            Engaged::Never => {
                self.deflection.push(Float::zero());
                Float::zero()
            }
            Engaged::Smooth { function, per_speed } => {
                let ratio = &speed * per_speed;
                self.ratio.push(ratio);
                self.rate.push(&ratio * &table.integers[k]);
                match function {
                    Smoothing::Tanh => self.next_tanh(table, k),
                    Smoothing::Arctan => self.next_arctan(table, k),
                }
                self.deflection.push(Float::zero());
                let mut factor = Float::convolution(&self.coefficient, &self.smooth);
                if *function == Smoothing::Arctan {
                    factor = &factor * &self.per_half_pi;
                }
                self.factor.push(factor);
                let torque = Float::convolution(&self.factor, normal);
                if sense < 0 { -&torque } else { torque }
            }
            Engaged::Bristles { sigma, radius } => {
                if k == 0 {
                    self.per_first = Float::from_f64(1.0).over(&coefficient);
                }
                let deflection = self.deflection[k];
                // g q = z, with the factor r on both sides.
                let loading = quotient(
                    &(radius * &deflection),
                    &self.coefficient,
                    &self.loading,
                    &self.per_first,
                );
                self.loading.push(loading);
                let worn = &sigma[0] * &Float::convolution(&self.shapes.speed, &self.loading);
                let rate = &relative[k] - &worn;
                self.deflection.push(&rate * &table.reciprocals[k + 1]);
                let [elastic, damping, viscous] =
                    [(&sigma[0], &deflection), (&sigma[1], &rate), (&sigma[2], &relative[k])].map(|(a, b)| a * b);
                self.factor.push(&(&elastic + &damping) + &viscous);
                radius * &Float::convolution(&self.factor, normal)
            }
        }
    }

    /// t = tanh y: with p = 1 - t^2, t' = p y' and p' = -2 t p y'.
    fn next_tanh(&mut self, table: &Elementary<N>, k: usize) {
        if k == 0 {
            let [tangent, rest] = table.hyperbolic_tangent(&self.ratio[0]);
            self.smooth.push(tangent);
            self.slope.push(rest);
        } else {
            let next = &Float::convolution(&self.rate[1..], &self.slope) * &table.reciprocals[k];
            let half = &Float::convolution(&self.rate[1..], &self.auxiliary) * &table.reciprocals[k];
            self.smooth.push(next);
            self.slope.push(-&(&half + &half));
        }
        let product = Float::convolution(&self.smooth, &self.slope);
        self.auxiliary.push(product);
    }

    /// a = arctan y: a' = q y' with (1 + y^2) q = 1.
    fn next_arctan(&mut self, table: &Elementary<N>, k: usize) {
        let one = Float::from_f64(1.0);
        let square = Float::convolution(&self.ratio, &self.ratio);
        if k == 0 {
            self.per_half_pi = one.over(&table.pi.half());
            let first = &one + &square;
            self.auxiliary.push(first);
            self.per_first = one.over(&first);
            self.smooth.push(table.arc_tangent(&self.ratio[0]));
            self.slope.push(self.per_first);
        } else {
            let next = &Float::convolution(&self.rate[1..], &self.slope) * &table.reciprocals[k];
            self.smooth.push(next);
            self.auxiliary.push(square);
            let slope = quotient(&Float::zero(), &self.auxiliary, &self.slope, &self.per_first);
            self.slope.push(slope);
        }
    }

    /// Series that limit a step, with their least size (log2). Only the deflection has one.
    pub fn deciding(&self, deflection: f64) -> impl Iterator<Item = (&[Float<N>], f64)> {
        let bristles = if self.loading.is_empty() {
            &[][..]
        } else {
            &self.deflection[..]
        };
        let all = [
            (self.shapes.followed(), f64::NEG_INFINITY),
            (&self.slope, f64::NEG_INFINITY),
            (bristles, deflection),
        ];
        all.into_iter().filter(|(series, _)| !series.is_empty())
    }
}
