//! Doubles side by side, one for each of several motions.

use super::Number;
use std::array;
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// So many doubles, each with operations of its own: what one of them is does not depend on the others, and it is to the last bit what
/// the same operations give in `f64`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lanes<const L: usize>(pub [f64; L]);

impl<const L: usize> Lanes<L> {
    /// What `lane` gives for each.
    #[inline(always)]
    pub fn from_fn(lane: impl FnMut(usize) -> f64) -> Self {
        Lanes(array::from_fn(lane))
    }

    #[inline(always)]
    fn each(self, function: impl Fn(f64) -> f64) -> Self {
        Lanes(self.0.map(function))
    }
}

macro_rules! operations {
    ($($operation:ident $name:ident $sign:tt),+) => {
        $(impl<const L: usize> $operation for Lanes<L> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Lanes(array::from_fn(|lane| self.0[lane] $sign other.0[lane]))
            }
        })+
    };
}

operations!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<const L: usize> Neg for Lanes<L> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|x| -x)
    }
}

/// As all of them compare; `None` where they differ in that.
impl<const L: usize> PartialOrd for Lanes<L> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        let mut orders = self.0.iter().zip(&other.0).map(|(a, b)| a.partial_cmp(b));
        let first = orders.next()??;
        orders.all(|order| order == Some(first)).then_some(first)
    }
}

macro_rules! functions {
    ($($function:ident),+) => {
        $(#[inline]
        fn $function(self) -> Self {
            self.each(f64::$function)
        })+
    };
}

impl<const L: usize> Number for Lanes<L> {
    #[inline(always)]
    fn of(x: f64) -> Self {
        Lanes([x; L])
    }

    #[inline]
    fn pi() -> Self {
        Lanes::of(f64::pi())
    }

    functions!(exp, exp_m1, sqrt, tanh, cosh, atan);

    fn sin_cos(self) -> (Self, Self) {
        let both = self.0.map(f64::sin_cos);
        (Lanes(both.map(|(sin, _)| sin)), Lanes(both.map(|(_, cos)| cos)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn property_each_lane_is_what_a_double_is() {
        fn of<T: Number>(x: T, y: T) -> [T; 4] {
            let (sin, cos) = x.sin_cos();
            let sum = (x * y + x) / y - x.exp_m1() * -y.tanh();
            [
                sum,
                sin * y.exp() + cos.atan(),
                y.sqrt() - x.cosh(),
                T::dot(&[x, y, x], &[y, y, sin]),
            ]
        }
        let (a, b) = (Lanes([1.5, -0.25, 0.0, 1e-9]), Lanes([0.1, 7.0, 2e-3, 30.0]));
        let together = of(a, b);
        for lane in 0..4 {
            let alone = of(a.0[lane], b.0[lane]);
            for (together, alone) in together.iter().zip(alone) {
                assert_eq!(together.0[lane].to_bits(), alone.to_bits());
            }
        }
    }

    #[test]
    fn property_lanes_compare_where_all_do() {
        assert_eq!(Lanes([1.0, 2.0]).partial_cmp(&Lanes([2.0, 3.0])), Some(Ordering::Less));
        assert_eq!(Lanes([1.0, 2.0]).partial_cmp(&Lanes([2.0, 1.0])), None);
        assert!(Lanes([1.0, -2.0]).is_within(3.0) && !Lanes([1.0, -2.0]).is_within(1.5));
    }
}
