//! Friction of the contact: the breakaway coefficient at rest, and the law in sliding.
//!
//! A law is a function mu(x) of the sliding speed x = |omega_r|, in rad/s. [`Law`] is all that the rest of the program
//! asks of it: values, slopes and their bounds, where the damping of steady sliding changes its sign, over which speeds
//! the law changes, and its Taylor coefficients along a motion. Nothing outside this folder knows which law it is, but for
//! the case's keys ([`crate::case`]) and the independent solution ([`crate::oracle`]).
//!
//! | module | law |
//! |---|---|
//! | `exponential` | mu_d + (mu_s - mu_d) exp(-alpha x), equation (8) |
//! | `coulomb` | mu_d |
//! | `hyperbolic` | mu_d + (mu_s - mu_d)/(1 + x/x_s) |
//! | `stribeck` | mu_d + (mu_s - mu_d) exp(-(x/x_s)^delta) + mu_v x |
//! | `polynomial` | mu_s + c_1 x + c_2 x^2 + c_3 x^3 up to a stated speed |
//! | `table` | through points, by straight lines or monotone cubics |
//!
//! `law` has the interface, `parameters` that to a case, `cubic` what the last two laws share.
//!
//! A further law is a file beside these that implements [`Law`] and [`Parameters`], and its name in `laws!` below. What it
//! takes besides: the keys of those of its parameters that no other law has (`case/schema.rs`), its formula in the oracle
//! (`oracle/friction.rs`), which shares no code with this folder, a case of `tests/analytic/friction.rs`, and its line in
//! the docs.

mod coulomb;
mod cubic;
mod exponential;
mod hyperbolic;
mod law;
mod parameters;
mod polynomial;
mod stribeck;
mod table;

pub use coulomb::Coulomb;
pub use exponential::Exponential;
pub use hyperbolic::Hyperbolic;
pub use law::{Bounds, Factors, Law, LawSeries};
pub use parameters::Parameters;
pub use polynomial::Polynomial;
pub use stribeck::Stribeck;
pub use table::{Interpolation, Table};

use crate::numerics::Number;
use crate::numerics::taylor::Unfolding;

/// Friction of the contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Friction {
    /// mu_0, the coefficient of friction at rest, which a stick breaks away at.
    pub breakaway: f64,
    /// mu(x), the coefficient of friction in slip.
    pub law: FrictionLaw,
}

/// Declares the laws: each name is a variant of [`FrictionLaw`] and of [`FrictionSeries`]. `$d` stands for the dollar sign of
/// the macros that are declared here.
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

        /// The Taylor coefficients of one of the friction laws along a motion.
        #[derive(Debug, Clone)]
        pub enum FrictionSeries<T: Number, const N: usize> {
            $($(#[$about])* $law(<$law as Law>::Series<T, N>),)+
        }

        /// What an expression says of the law, whichever it is.
        macro_rules! of_law {
            ($d self:expr, $d law:ident => $d said:expr) => {
                match $d self {
                    $(FrictionLaw::$law($d law) => $d said,)+
                }
            };
        }

        /// What an expression says of the series, whichever law's it is.
        macro_rules! of_series {
            ($d self:expr, $d series:ident => $d said:expr) => {
                match $d self {
                    $(FrictionSeries::$law($d series) => $d said,)+
                }
            };
        }

        impl FrictionLaw {
            /// Room for its Taylor coefficients, of which none is known yet.
            fn any_series<T: Number, const N: usize>(&self, number: &mut impl FnMut(f64) -> T) -> FrictionSeries<T, N> {
                match self {
                    $(FrictionLaw::$law(law) => FrictionSeries::$law(law.series_in::<T, N>(number)),)+
                }
            }

            /// Whether both are the same law, and [alike](Law::is_alike).
            fn are_alike(&self, other: &FrictionLaw) -> bool {
                match (self, other) {
                    $((FrictionLaw::$law(law), FrictionLaw::$law(other)) => law.is_alike(other),)+
                    _ => false,
                }
            }

            /// The words of `friction.law`; the first is the default.
            pub const NAMES: &'static [&'static str] = &[$(<$law as Parameters>::NAME),+];

            /// The keys of `[friction]` that the law of this name takes its parameters from; none if there is no such law.
            pub(crate) fn keys_of(name: &str) -> &'static [&'static str] {
                match name {
                    $(<$law as Parameters>::NAME => <$law as Parameters>::KEYS,)+
                    _ => &[],
                }
            }

            /// The law of this name, with NaN for each parameter that has no default.
            pub(crate) fn unset(name: &str) -> Option<FrictionLaw> {
                match name {
                    $(<$law as Parameters>::NAME => Some(<$law as Parameters>::unset().into()),)+
                    _ => None,
                }
            }

            /// The word of `friction.law`.
            pub fn name(&self) -> &'static str {
                match self {
                    $(FrictionLaw::$law(_) => <$law as Parameters>::NAME,)+
                }
            }

            /// The key of the coefficient at vanishing speed.
            pub(crate) fn key_at_vanishing_speed(&self) -> &'static str {
                match self {
                    $(FrictionLaw::$law(_) => <$law as Parameters>::AT_VANISHING_SPEED,)+
                }
            }
        }
    };
}

laws! { $
    /// Equation (8), the paper's.
    Exponential
    /// The same at every speed.
    Coulomb
    /// Falling as the inverse of the speed.
    Hyperbolic
    /// Falling, and rising again.
    Stribeck
    /// A cubic.
    Polynomial
    /// Through points.
    Table
}

/// Methods by which the law answers, whichever it is.
macro_rules! answers {
    ($($(#[$about:meta])* $vis:vis fn $name:ident(&self $(, $argument:ident: $type:ty)*) -> $answer:ty;)+) => {
        $($(#[$about])* $vis fn $name(&self $(, $argument: $type)*) -> $answer {
            of_law!(self, law => law.$name($($argument),*))
        })+
    };
}

impl FrictionLaw {
    answers! {
        /// The value of a parameter that is a number, by its key of `[friction]`; `None` if the law has none of that name.
        pub fn number(&self, key: &str) -> Option<f64>;

        /// The values of a parameter that is a list of numbers, by its key; `None` if the law has none of that name.
        pub fn list(&self, key: &str) -> Option<&[f64]>;

        /// The word of a parameter that is one of several, by its key; `None` if the law has none of that name.
        pub fn word(&self, key: &str) -> Option<&'static str>;

        /// What is wrong with the parameters together: the key in `[friction]`, and what it must be.
        pub fn complaints(&self) -> Vec<(String, String)>;
    }

    /// Sets a parameter that is a number; does nothing if the law has none of that name.
    pub fn set_number(&mut self, key: &str, value: f64) {
        of_law!(self, law => law.set_number(key, value));
    }

    /// Sets a parameter that is a list; does nothing if the law has none of that name.
    pub(crate) fn set_list(&mut self, key: &str, values: Vec<f64>) {
        of_law!(self, law => law.set_list(key, values));
    }

    /// Sets a parameter that is one of several words; does nothing if the law has none of that name, or that not such a word.
    pub(crate) fn set_word(&mut self, key: &str, word: &str) {
        of_law!(self, law => law.set_word(key, word));
    }

    /// The parameters of the exponential law, if it is that.
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

    fn is_alike(&self, other: &FrictionLaw) -> bool {
        self.are_alike(other)
    }

    fn series_in<T: Number, const N: usize>(&self, number: &mut impl FnMut(f64) -> T) -> FrictionSeries<T, N> {
        self.any_series(number)
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
