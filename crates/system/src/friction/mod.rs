//! Friction of the contact: the breakaway coefficient at rest, and the law in sliding.
//!
//! A law is a function mu(x) of the sliding speed x = |omega_r|, in rad/s. [`Law`] is its interface: values, slopes and
//! their bounds, zeros of the damping, speed scales, and Taylor coefficients along a motion. Outside this folder only
//! the case's keys (`stickslip-case`) and the oracle (`stickslip-oracle`) distinguish the laws.
//!
//! | module | law |
//! |---|---|
//! | `exponential` | mu_d + (mu_s - mu_d) exp(-alpha x), equation (8) |
//! | `coulomb` | mu_d |
//! | `asymmetric` | mu_d, another in each sense of sliding |
//! | `hyperbolic` | mu_d + (mu_s - mu_d)/(1 + x/x_s) |
//! | `stribeck` | mu_d + (mu_s - mu_d) exp(-(x/x_s)^delta) + mu_v x |
//! | `polynomial` | mu_s + c_1 x + c_2 x^2 + c_3 x^3 up to a stated speed |
//! | `table` | through points, by straight lines or monotone cubics |
//!
//! `law` has the interface, `parameters` the link to a case.
//!
//! A new law is a file in this folder that implements [`Law`] and [`LawParameters`], and its name in `laws!` below;
//! CONTRIBUTING.md has the steps.

mod asymmetric;
mod coulomb;
mod exponential;
mod hyperbolic;
mod law;
mod parameters;
mod polynomial;
mod stribeck;
mod table;

pub use asymmetric::Asymmetric;
pub use coulomb::Coulomb;
pub use exponential::Exponential;
pub use hyperbolic::Hyperbolic;
pub use law::{Backward, Bounds, Factors, Law, LawSeries};
pub use parameters::{LawParameter, LawParameters, LawValue};
pub use polynomial::Polynomial;
pub use stribeck::Stribeck;
pub use table::{Interpolation, Table};

use crate::numerics::Number;
use crate::numerics::taylor::Unfolding;

/// Friction of the contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Friction {
    /// mu_0, the friction coefficient at which a stick breaks away; see [`Backward`].
    pub breakaway: f64,
    /// mu(x), the coefficient of friction in slip.
    pub law: FrictionLaw,
}

/// Declares the laws: each name is a variant of [`FrictionLaw`] and [`FrictionSeries`]. `$d` is the dollar sign of the
/// macros declared inside.
macro_rules! laws {
    ($d:tt $($(#[$about:meta])* $law:ident)+) => {
        /// One of the friction laws.
        #[derive(Debug, Clone, PartialEq)]
        pub enum FrictionLaw {
            $($(#[$about])* $law($law),)+
        }

        $(impl From<$law> for FrictionLaw {
            fn from(law: $law) -> FrictionLaw {
                FrictionLaw::$law(law)
            }
        })+

        /// Taylor coefficients of one of the friction laws along a motion.
        #[derive(Debug, Clone)]
        pub enum FrictionSeries<T: Number, const N: usize> {
            $($(#[$about])* $law(<$law as Law>::Series<T, N>),)+
        }

        macro_rules! of_law {
            ($d self:expr, $d law:ident => $d said:expr) => {
                match $d self {
                    $(FrictionLaw::$law($d law) => $d said,)+
                }
            };
        }

        macro_rules! of_series {
            ($d self:expr, $d series:ident => $d said:expr) => {
                match $d self {
                    $(FrictionSeries::$law($d series) => $d said,)+
                }
            };
        }

        impl FrictionLaw {
            fn any_series<T: Number, const N: usize>(&self) -> FrictionSeries<T, N> {
                match self {
                    $(FrictionLaw::$law(law) => FrictionSeries::$law(law.series::<T, N>()),)+
                }
            }

            /// The words of `friction.law`; the first is the default.
            pub const NAMES: &'static [&'static str] = &[$(<$law as LawParameters>::NAME),+];

            /// The parameters of the law of this name; empty for an unknown name.
            pub fn parameters_of(name: &str) -> &'static [LawParameter] {
                match name {
                    $(<$law as LawParameters>::NAME => <$law as LawParameters>::PARAMETERS,)+
                    _ => &[],
                }
            }

            /// The law of this name, with NaN for parameters without default.
            pub fn unset(name: &str) -> Option<FrictionLaw> {
                match name {
                    $(<$law as LawParameters>::NAME => Some(<$law as LawParameters>::unset().into()),)+
                    _ => None,
                }
            }

            /// The word of `friction.law`.
            pub fn name(&self) -> &'static str {
                match self {
                    $(FrictionLaw::$law(_) => <$law as LawParameters>::NAME,)+
                }
            }

            /// Key of the coefficient at vanishing speed.
            pub fn key_at_vanishing_speed(&self) -> &'static str {
                match self {
                    $(FrictionLaw::$law(_) => <$law as LawParameters>::AT_VANISHING_SPEED,)+
                }
            }
        }
    };
}

laws! { $
    /// The paper's law, equation (8).
    Exponential
    /// Constant.
    Coulomb
    /// Constant, with another coefficient in each sense of sliding.
    Asymmetric
    /// Falls as the inverse of the speed.
    Hyperbolic
    /// Falls, and rises again.
    Stribeck
    /// A cubic.
    Polynomial
    /// Given by points.
    Table
}

macro_rules! answers {
    ($($(#[$about:meta])* $vis:vis fn $name:ident(&self $(, $argument:ident: $type:ty)*) -> $answer:ty;)+) => {
        $($(#[$about])* $vis fn $name(&self $(, $argument: $type)*) -> $answer {
            of_law!(self, law => law.$name($($argument),*))
        })+
    };
}

impl FrictionLaw {
    answers! {
        /// The value of a number by its key in `[friction]`; `None` if the law has no such parameter.
        pub fn number(&self, key: &str) -> Option<f64>;

        /// The values of a list by its key; `None` if the law has no such parameter.
        pub fn list(&self, key: &str) -> Option<&[f64]>;

        /// The word of a choice by its key; `None` if the law has no such parameter.
        pub fn word(&self, key: &str) -> Option<&'static str>;

        /// Errors of the parameters in combination: key in `[friction]`, and condition.
        pub fn complaints(&self) -> Vec<(String, String)>;
    }

    /// Sets a number; does nothing if the law has no such parameter.
    pub fn set_number(&mut self, key: &str, value: f64) {
        of_law!(self, law => law.set_number(key, value));
    }

    /// Sets a list; does nothing if the law has no such parameter.
    pub fn set_list(&mut self, key: &str, values: Vec<f64>) {
        of_law!(self, law => law.set_list(key, values));
    }

    /// Sets a choice; does nothing if the law has no such parameter or word.
    pub fn set_word(&mut self, key: &str, word: &str) {
        of_law!(self, law => law.set_word(key, word));
    }

    /// The exponential law, if it is one.
    pub fn as_exponential(&self) -> Option<&Exponential> {
        match self {
            FrictionLaw::Exponential(law) => Some(law),
            _ => None,
        }
    }
}

impl Law for FrictionLaw {
    type Series<T: Number, const N: usize> = FrictionSeries<T, N>;

    answers! {
        #[inline]
        fn coefficient(&self, x: f64) -> f64;
        #[inline]
        fn coefficient_and_slope(&self, x: f64) -> (f64, f64);
        fn at_vanishing_speed(&self) -> f64;
        fn backward(&self) -> Option<Backward>;
        fn coefficient_bounds(&self, from: f64, to: f64) -> Bounds;
        fn slope_bounds(&self, from: f64, to: f64) -> Bounds;
        fn knots(&self) -> &[f64];
        fn extent(&self) -> f64;
        fn ends_at(&self) -> f64;
        fn damping_zeros(&self, damping: f64, weight: f64) -> Vec<f64>;
        fn damped_from(&self, damping: f64, weight: f64) -> f64;
        fn steepness_rate(&self, x: f64) -> f64;
        fn followed_fall(&self, x: f64, share: f64) -> f64;
        fn expandable_share(&self, x: f64, change: f64) -> f64;
        fn speed_of_derivative(&self, order: i32, size: f64) -> f64;
    }

    fn continued(&self, piece: usize) -> FrictionLaw {
        of_law!(self, law => law.continued(piece).into())
    }

    fn series<T: Number, const N: usize>(&self) -> FrictionSeries<T, N> {
        self.any_series()
    }
}

impl<T: Number, const N: usize> LawSeries<T, N> for FrictionSeries<T, N> {
    #[inline(always)]
    fn factors(&self, of_coefficient: T, of_slope: T) -> Factors<T> {
        of_series!(self, series => LawSeries::<T, N>::factors(series, of_coefficient, of_slope))
    }

    #[inline(always)]
    fn start(&mut self, x: T, unit: T) {
        of_series!(self, series => LawSeries::<T, N>::start(series, x, unit));
    }

    #[inline(always)]
    fn extend(&mut self, n: usize, rate: T, reciprocal: T) {
        of_series!(self, series => LawSeries::<T, N>::extend(series, n, rate, reciprocal));
    }

    #[inline]
    fn extend_from(&mut self, n: usize, x: &[T; N]) {
        of_series!(self, series => LawSeries::<T, N>::extend_from(series, n, x));
    }

    #[inline(always)]
    fn shapes(&self) -> Option<[&Unfolding<T, N>; 2]> {
        of_series!(self, series => LawSeries::<T, N>::shapes(series))
    }
}
