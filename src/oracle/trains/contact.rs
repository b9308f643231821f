//! The torque of the contact, rotor on stator: of slip by the friction law, and of contacts without a jump at rest.

use crate::model::trains::{ContactLaw, Smoothing};
use crate::oracle::elementary::Elementary;
use crate::oracle::float::Float;
use crate::oracle::friction::{self, Friction, Shapes};

/// The constants of the contact.
#[derive(Debug)]
pub(super) struct Contact<const N: usize> {
    /// The pieces of the friction law.
    friction: Vec<Friction<N>>,
    engaged: Engaged<N>,
}

/// What an engaged contact has in the place of the jump.
#[derive(Debug)]
enum Engaged<const N: usize> {
    /// The jump itself.
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

impl<const N: usize> Contact<N> {
    pub fn new(exact: &super::ExactTrains) -> Self {
        let number = Float::from_rational;
        Contact {
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

    /// Whether it has stick and slip.
    pub fn sticks(&self) -> bool {
        matches!(self.engaged, Engaged::Never)
    }
}

/// Taylor coefficients of the contact's own quantities.
#[derive(Debug)]
pub(super) struct ContactSeries<const N: usize> {
    /// x = s omega_r and the friction law's shape.
    shapes: Shapes<N>,
    /// r mu.
    coefficient: Vec<Float<N>>,
    /// y = x/eps, and k y_k.
    ratio: Vec<Float<N>>,
    rate: Vec<Float<N>>,
    /// tanh y or arctan y, its derivative with respect to y, and what the recurrence of that takes: their product, or 1 + y^2.
    smooth: Vec<Float<N>>,
    slope: Vec<Float<N>>,
    auxiliary: Vec<Float<N>>,
    /// r mu f, or sigma_0 z + sigma_1 z' + sigma_2 omega_r.
    factor: Vec<Float<N>>,
    /// z/g.
    loading: Vec<Float<N>>,
    /// 1 over the first coefficient of what is divided by.
    per_first: Float<N>,
    /// z.
    pub deflection: Vec<Float<N>>,
}

/// F_n and omega_r as far as they are known.
type Known<'a, const N: usize> = (&'a [Float<N>], &'a [Float<N>]);

/// The next coefficient of a quotient q = n/d, of which d has a coefficient more than q.
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
            shapes: Shapes::default(),
            coefficient: Vec::new(),
            ratio: Vec::new(),
            rate: Vec::new(),
            smooth: Vec::new(),
            slope: Vec::new(),
            auxiliary: Vec::new(),
            factor: Vec::new(),
            loading: Vec::new(),
            per_first: Float::zero(),
            deflection: vec![*deflection],
        }
    }

    /// s omega_r; empty where there is no friction law at work.
    pub fn speed(&self) -> &[Float<N>] {
        &self.shapes.speed
    }

    /// The deflection where nothing moves it.
    pub fn rest(&mut self) {
        self.deflection.push(Float::zero());
    }

    /// Takes coefficient k of x, and makes that of r mu.
    fn law(&mut self, friction: &Friction<N>, table: &Elementary<N>, speed: Float<N>) -> Float<N> {
        let k = self.shapes.speed.len();
        let tables = (&table.reciprocals[..], &table.integers[..], &table.ln_2);
        self.shapes.extend(friction, speed, tables);
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
        contact: &Contact<N>,
        table: &Elementary<N>,
        (sense, piece): (i8, usize),
        (relative, normal): (&Float<N>, &[Float<N>]),
    ) -> Float<N> {
        let speed = if sense < 0 { -relative } else { *relative };
        self.law(&contact.friction[piece], table, speed);
        self.deflection.push(Float::zero());
        let torque = Float::convolution(&self.coefficient, normal);
        if sense < 0 { -&torque } else { torque }
    }

    /// The next coefficient of the torque of an engaged contact.
    pub fn engaged(
        &mut self,
        contact: &Contact<N>,
        table: &Elementary<N>,
        (sense, piece): (i8, usize),
        (relative, normal): Known<'_, N>,
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
                    let two = Float::from_f64(2.0);
                    factor = (&factor * &two).over(&table.pi);
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
                // g q = z, with r on both sides.
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

    /// What a step has to follow: to its own precision, but for the deflection of the bristles.
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
