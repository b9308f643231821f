//! What is applied from outside, as a function of time: forces, torques, and the speeds of driven ends.
//!
//! A [`Drive`] is any signal, a [`Signal`] one of the profiles, which are piecewise linear. The rest of the program does not ask
//! which profile it is but for its [`Pieces`]: values and slopes, the corners where an integrator restarts, the integral, and
//! the stretches on each of which it is linear. Only the case's keys ([`crate::case`]) and the independent solution
//! ([`crate::oracle`]) know the profiles themselves.
//!
//! | module | what it is |
//! |---|---|
//! | `drive` | any signal: a constant, a profile, a harmonic, or a sum of them |
//! | `pieces` | a profile as the rest of the program sees it |
//! | `ramp` | a linear rise to a value, which then holds |
//! | `table` | linear between points |
//!
//! A further profile is a file beside these that implements [`Profile`] and has a `try_map`, and its name in `profiles!` below.

mod drive;
mod pieces;
mod ramp;
mod table;

pub(crate) use drive::SIGNALS;
pub use drive::{Drive, Frequency, Shape, Timeline, Wave};
pub use pieces::{Piece, Pieces};
pub use ramp::Ramp;
pub use table::Table;

/// What a profile knows of itself.
pub trait Profile {
    /// Its name in a case.
    const NAME: &'static str;

    /// One of which no number is known yet: NaN, and empty lists.
    fn blank() -> Self;

    /// (start, value, slope) of each linear stretch from t = 0 on. The last never ends.
    fn stretches(&self) -> Vec<(f64, f64, f64)>;
}

/// Declares the profiles: each name is a variant of [`Signal`].
macro_rules! profiles {
    ($($(#[$about:meta])* $profile:ident)+) => {
        /// A function of time by one of the profiles. `T` is the type of its numbers: doubles, or exact ones.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Signal<T = f64> {
            $($(#[$about])* $profile($profile<T>),)+
        }

        $(impl<T> From<$profile<T>> for Signal<T> {
            fn from(profile: $profile<T>) -> Signal<T> {
                Signal::$profile(profile)
            }
        })+

        impl<T> Signal<T> {
            /// The same with each number replaced by `number` of its field's name, its place if the field is a list, and
            /// itself.
            ///
            /// # Errors
            /// The first of `number`.
            pub fn try_map<U, E>(
                &self,
                mut number: impl FnMut(&'static str, Option<usize>, &T) -> Result<U, E>,
            ) -> Result<Signal<U>, E> {
                match self {
                    $(Signal::$profile(profile) => profile.try_map(&mut number).map(Signal::$profile),)+
                }
            }
        }

        impl Signal {
            /// The names of all profiles in a case.
            pub const NAMES: &'static [&'static str] = &[$(<$profile>::NAME),+];

            /// The name of its profile in a case.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Signal::$profile(_) => <$profile>::NAME,)+
                }
            }

            /// One of the profile of this name, of which no number is known yet.
            pub fn blank(name: &str) -> Option<Signal> {
                $(if name == <$profile>::NAME {
                    return Some(Signal::$profile(Profile::blank()));
                })+
                None
            }

            /// The same as stretches on each of which it is linear.
            pub fn pieces(&self) -> Pieces {
                Pieces::new(match self {
                    $(Signal::$profile(profile) => profile.stretches(),)+
                })
            }
        }
    };
}

profiles! {
    /// A linear rise from zero, or a step at t = 0, to a value that then holds.
    Ramp
    /// Linear between points.
    Table
}

impl<T: Clone> Signal<T> {
    /// What it holds in the end; `None` of a table without points.
    pub(crate) fn final_value(&self) -> Option<T> {
        match self {
            Signal::Ramp(ramp) => Some(ramp.value.clone()),
            Signal::Table(table) => table.value.last().cloned(),
        }
    }
}

impl<T> Signal<T> {
    /// Its numbers if it is a ramp: for data that know no other profile.
    pub(crate) fn as_ramp(&self) -> Option<&Ramp<T>> {
        match self {
            Signal::Ramp(ramp) => Some(ramp),
            _ => None,
        }
    }
}
