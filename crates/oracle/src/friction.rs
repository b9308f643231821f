//! The friction laws, implemented independently: r mu and 2 r mu' along a motion, as recurrences of Taylor
//! coefficients.
//!
//! The torque of friction is r mu F_n = constant F_n + falling (S F_n) with the shape S of the law. Friction reduces
//! the damping of steady sliding by -2 r mu' F_n = negative_damping (R F_n) with the shape R of the slope.

use super::elementary::Elementary;
use super::float::Float;
use num_bigint::BigInt;
use num_rational::BigRational;
use stickslip_system::model::{ExactLaw, nearest_double};

#[derive(Debug)]
pub(super) struct ExactFriction<const N: usize> {
    /// r times the part of mu outside the shape.
    pub constant: Float<N>,
    /// r times the factor of S.
    pub falling: Float<N>,
    /// -2 r times the factor of R.
    pub negative_damping: Float<N>,
    kind: LawKind<N>,
}

#[derive(Debug)]
enum LawKind<const N: usize> {
    /// S = R = exp(-alpha x); -alpha.
    Exponential(Float<N>),
    Constant,
    /// S = q = 1/(1 + x/x_s), R = q^2; 1/x_s.
    Hyperbolic(Float<N>),
    /// S = (mu_s - mu_d) E + mu_v x with E = exp(-u^delta), u = x/x_s; R = -S'.
    Stribeck {
        drop: Float<N>,
        viscous: Float<N>,
        per_scale: Float<N>,
        /// (mu_s - mu_d) delta/x_s.
        fall: Float<N>,
        power: usize,
    },
    /// S = c_0 + c_1 d + c_2 d^2 + c_3 d^3, d = x - origin; R = -S'.
    Cubic {
        coefficients: [Float<N>; 4],
        origin: Float<N>,
    },
}

/// The pieces of a law of forward sliding between its knots, by increasing speed; one without knots.
pub(super) fn pieces<const N: usize>(radius: &BigRational, law: &ExactLaw) -> Vec<ExactFriction<N>> {
    if law.name == "table" {
        table(radius, law)
    } else {
        vec![ExactFriction::whole(radius, law, 1)]
    }
}

/// The law of backward sliding, if it differs.
pub(super) fn backward<const N: usize>(radius: &BigRational, law: &ExactLaw) -> Option<ExactFriction<N>> {
    (law.name == ASYMMETRIC).then(|| ExactFriction::whole(radius, law, -1))
}

/// The law with other coefficients for backward sliding, omega_r < 0.
const ASYMMETRIC: &str = "asymmetric";

/// mu_d of a constant law in a sense.
fn kinetic(law: &ExactLaw, sense: i8) -> BigRational {
    match (law.name, sense) {
        (ASYMMETRIC, -1) => law.number("kinetic_backward"),
        _ => law.number("kinetic"),
    }
}

/// mu_0 into slip of a sense; `forward` is that of omega_r > 0.
pub(super) fn breakaway(law: &ExactLaw, forward: &BigRational, sense: i8) -> BigRational {
    match (law.name, sense) {
        (ASYMMETRIC, -1) => law.number("breakaway_backward"),
        _ => forward.clone(),
    }
}

/// One piece for each interval of a table, and one above.
fn table<const N: usize>(radius: &BigRational, law: &ExactLaw) -> Vec<ExactFriction<N>> {
    let integer = |n: i64| BigRational::from_integer(BigInt::from(n));
    let (x, y) = (law.list("speed"), law.list("coefficient"));
    let last = x.len() - 1;
    let h: Vec<BigRational> = (0..last).map(|k| &x[k + 1] - &x[k]).collect();
    let d: Vec<BigRational> = (0..last).map(|k| (&y[k + 1] - &y[k]) / &h[k]).collect();
    let linear = law.word("interpolation") == "linear";
    let mut all = Vec::new();
    for k in 0..last {
        let cubic = if linear {
            [d[k].clone(), BigRational::default(), BigRational::default()]
        } else {
            // Hermite's cubic with y' = m and n at the ends.
            let [m, n] = [k, k + 1].map(|point| slope_at(point, &h, &d));
            let quadratic = (integer(3) * &d[k] - integer(2) * &m - &n) / &h[k];
            let third = (&m + &n - integer(2) * &d[k]) / (&h[k] * &h[k]);
            [m, quadratic, third]
        };
        all.push(ExactFriction::cubic(
            radius,
            &x[k],
            [&y[k], &cubic[0], &cubic[1], &cubic[2]],
        ));
    }
    let zero = BigRational::default();
    all.push(ExactFriction::cubic(radius, &x[last], [&y[last], &zero, &zero, &zero]));
    all
}

/// y' at a point of a monotone cubic, from widths and secants of the intervals: Fritsch and Butland's weighted harmonic
/// mean inside, a parabola at the ends. Both are zero where the points turn.
fn slope_at(point: usize, h: &[BigRational], d: &[BigRational]) -> BigRational {
    let zero = BigRational::default();
    let integer = |n: i64| BigRational::from_integer(BigInt::from(n));
    if d.len() == 1 {
        return d[0].clone();
    }
    if point > 0 && point < d.len() {
        let (left, right) = (&d[point - 1], &d[point]);
        if left * right <= zero {
            return zero;
        }
        let of_left = &h[point - 1] + integer(2) * &h[point];
        let of_right = integer(2) * &h[point - 1] + &h[point];
        return (&of_left + &of_right) / (of_left / left + of_right / right);
    }
    let (near, next) = if point == 0 { (0, 1) } else { (d.len() - 1, d.len() - 2) };
    let slope = (&d[near] * (integer(2) * &h[near] + &h[next]) - &d[next] * &h[near]) / (&h[near] + &h[next]);
    let threefold = integer(3) * &d[near];
    let size = |value: &BigRational| if *value < zero { -value.clone() } else { value.clone() };
    if &slope * &d[near] <= zero {
        zero
    } else if &d[near] * &d[next] <= zero && size(&slope) > size(&threefold) {
        threefold
    } else {
        slope
    }
}

/// Speeds between the pieces of a law, rad/s, and whether the last one ends it.
pub(super) fn knots(law: &ExactLaw) -> (Vec<BigRational>, bool) {
    match law.name {
        "polynomial" => (vec![law.number("valid_below")], true),
        "table" => (law.list("speed")[1..].to_vec(), false),
        _ => (Vec::new(), false),
    }
}

impl<const N: usize> ExactFriction<N> {
    fn cubic(radius: &BigRational, origin: &BigRational, coefficients: [&BigRational; 4]) -> Self {
        ExactFriction {
            constant: Float::zero(),
            falling: Float::from_rational(radius),
            negative_damping: Float::from_rational(&(radius + radius)),
            kind: LawKind::Cubic {
                coefficients: coefficients.map(Float::from_rational),
                origin: Float::from_rational(origin),
            },
        }
    }

    /// A law of one piece, in a sense of sliding.
    ///
    /// # Panics
    /// If the oracle does not know the law.
    fn whole(radius: &BigRational, law: &ExactLaw, sense: i8) -> Self {
        let number = Float::from_rational;
        let two = BigRational::from_integer(BigInt::from(2));
        let of = |key: &str| law.number(key);
        let zero = BigRational::default();
        let (constant, falling, negative_damping, kind) = match law.name {
            "exponential" => {
                let falling = radius * (of("low_speed") - of("high_speed"));
                let negative = two * of("decay") * &falling;
                let kind = LawKind::Exponential(number(&-of("decay")));
                (radius * of("high_speed"), falling, negative, kind)
            }
            "coulomb" | ASYMMETRIC => (radius * kinetic(law, sense), zero.clone(), zero, LawKind::Constant),
            "hyperbolic" => {
                let falling = radius * (of("low_speed") - of("high_speed"));
                let negative = two * &falling / of("scale");
                let kind = LawKind::Hyperbolic(number(&of("scale").recip()));
                (radius * of("high_speed"), falling, negative, kind)
            }
            "stribeck" => {
                let drop = of("low_speed") - of("high_speed");
                let kind = LawKind::Stribeck {
                    drop: number(&drop),
                    viscous: number(&of("viscous")),
                    per_scale: number(&of("scale").recip()),
                    fall: number(&(drop * of("exponent") / of("scale"))),
                    power: nearest_double(&of("exponent")) as usize,
                };
                (radius * of("high_speed"), radius.clone(), two * radius, kind)
            }
            "polynomial" => {
                let [a, b, c, d] = ["low_speed", "linear", "quadratic", "cubic"].map(of);
                return ExactFriction::cubic(radius, &zero, [&a, &b, &c, &d]);
            }
            other => panic!("the exact solver has no friction law \"{other}\""),
        };
        ExactFriction {
            constant: number(&constant),
            falling: number(&falling),
            negative_damping: number(&negative_damping),
            kind,
        }
    }
}

pub(super) fn at_vanishing_speed(law: &ExactLaw, sense: i8) -> BigRational {
    match law.name {
        "table" => law.list("coefficient")[0].clone(),
        "coulomb" | ASYMMETRIC => kinetic(law, sense),
        _ => law.number("low_speed"),
    }
}

pub(super) fn size(law: &ExactLaw) -> f64 {
    let of = |key: &str| nearest_double(&law.number(key));
    let at_rest = [1, -1].map(|sense| nearest_double(&at_vanishing_speed(law, sense)));
    of("high_speed").max(at_rest[0]).max(at_rest[1])
}

/// Coefficients of q^2, as many as of q.
fn square<const N: usize>(q: &[Float<N>]) -> Vec<Float<N>> {
    (0..q.len()).map(|k| Float::convolution(&q[..=k], &q[..=k])).collect()
}

#[derive(Debug, Default)]
pub(super) struct Shapes<const N: usize> {
    pub speed: Vec<Float<N>>,
    /// S; empty for a zero shape.
    pub shape: Vec<Float<N>>,
    /// j times coefficient j of an exponent, or the coefficients of a denominator.
    rate: Vec<Float<N>>,
    /// u, and its powers from the first on.
    ratio: Vec<Float<N>>,
    power: Vec<Vec<Float<N>>>,
    /// E, if it differs from S.
    exponential: Vec<Float<N>>,
}

impl<const N: usize> Shapes<N> {
    /// Takes coefficient k of x, and computes that of S.
    pub fn extend(&mut self, friction: &ExactFriction<N>, speed: Float<N>, table: &Elementary<N>) {
        let Elementary {
            reciprocals,
            integers,
            ln_2,
            ..
        } = table;
        let k = self.speed.len();
        self.speed.push(speed);
        match &friction.kind {
            LawKind::Exponential(minus_decay) => {
                let exponent = &speed * minus_decay;
                self.rate.push(&exponent * &integers[k]);
                let next = if k == 0 {
                    exponent.exp(ln_2, reciprocals)
                } else {
                    &Float::convolution(&self.rate[1..], &self.shape[..k]) * &reciprocals[k]
                };
                self.shape.push(next);
            }
            LawKind::Constant => {}
            LawKind::Stribeck {
                drop,
                viscous,
                per_scale,
                power,
                ..
            } => {
                self.ratio.push(&speed * per_scale);
                // The usual recurrence for a power needs u != 0, so the powers are multiplied.
                self.power.resize(*power, Vec::new());
                for step in 0..*power {
                    let next = if step == 0 {
                        self.ratio[k]
                    } else {
                        Float::convolution(&self.power[step - 1], &self.ratio)
                    };
                    self.power[step].push(next);
                }
                let exponent = -&self.power[*power - 1][k];
                self.rate.push(&exponent * &integers[k]);
                let next = if k == 0 {
                    exponent.exp(ln_2, reciprocals)
                } else {
                    &Float::convolution(&self.rate[1..], &self.exponential[..k]) * &reciprocals[k]
                };
                self.exponential.push(next);
                self.shape.push(&(drop * &next) + &(viscous * &speed));
            }
            LawKind::Cubic { coefficients, origin } => {
                self.ratio.push(if k == 0 { &speed - origin } else { speed });
                self.power.resize(2, Vec::new());
                let square = Float::convolution(&self.ratio, &self.ratio);
                self.power[0].push(square);
                let cube = Float::convolution(&self.ratio, &self.power[0]);
                let [a, b, c, e] = coefficients;
                let mut value = &(&(b * &self.ratio[k]) + &(c * &square)) + &(e * &cube);
                if k == 0 {
                    value += a;
                }
                self.shape.push(value);
            }
            LawKind::Hyperbolic(per_scale) => {
                // (1 + x/x_s) q = 1; `rate` has the coefficients of the bracket.
                let ratio = &speed * per_scale;
                self.rate
                    .push(if k == 0 { &Float::from_f64(1.0) + &ratio } else { ratio });
                let next = if k == 0 {
                    Float::from_f64(1.0).over(&self.rate[0])
                } else {
                    -&Float::convolution(&self.rate[1..], &self.shape[..k]).over(&self.rate[0])
                };
                self.shape.push(next);
            }
        }
    }

    /// R, to the order of S; `None` if it equals S.
    pub fn slope(&self, friction: &ExactFriction<N>) -> Option<Vec<Float<N>>> {
        match &friction.kind {
            LawKind::Exponential(_) => None,
            LawKind::Constant => Some(vec![Float::zero(); self.speed.len()]),
            LawKind::Hyperbolic(_) => Some(square(&self.shape)),
            LawKind::Cubic { coefficients, .. } => {
                let [_, b, c, e] = coefficients;
                let (two, three) = (Float::from_f64(2.0), Float::from_f64(3.0));
                let term = |k: usize| -&(&(&(&two * c) * &self.ratio[k]) + &(&(&three * e) * &self.power[0][k]));
                let mut slope: Vec<_> = (0..self.shape.len()).map(term).collect();
                if let Some(first) = slope.first_mut() {
                    *first -= b;
                }
                Some(slope)
            }
            LawKind::Stribeck {
                viscous, fall, power, ..
            } => {
                let falling = |k: usize| match power {
                    1 => self.exponential[k],
                    _ => Float::convolution(&self.power[power - 2][..=k], &self.exponential[..=k]),
                };
                let mut slope: Vec<_> = (0..self.shape.len()).map(|k| fall * &falling(k)).collect();
                if let Some(first) = slope.first_mut() {
                    *first -= viscous;
                }
                Some(slope)
            }
        }
    }

    /// The series that limits a step even where it is small; empty for a law without one.
    pub fn followed(&self) -> &[Float<N>] {
        // A cubic is as accurate as the speed.
        if self.exponential.is_empty() && !self.power.is_empty() {
            &[]
        } else if self.exponential.is_empty() {
            &self.shape
        } else {
            &self.exponential
        }
    }
}
