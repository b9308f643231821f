//! External inputs as functions of time: forces, torques, and speeds of driven ends.

mod drive;
mod pieces;
mod ramp;
mod table;

pub use drive::SIGNALS;
pub use drive::{Drive, Frequency, HarmonicShape, Timeline, Wave};
pub use pieces::{Piece, Pieces};
pub use ramp::Ramp;
pub use table::TimeTable;

/// Interface of all profiles.
pub trait Profile {
    /// Name of the profile in a case.
    const NAME: &'static str;

    /// Returns a profile whose numbers are NaN and whose lists are empty.
    fn blank() -> Self;

    /// Returns each linear stretch from t = 0 on. The last one never ends.
    fn stretches(&self) -> Vec<Piece>;
}

/// Declares the profiles. Each name is a variant of [`Signal`].
macro_rules! profiles {
    ($($(#[$about:meta])* $profile:ident)+) => {
        /// A function of time with one of the profiles. `T` is the number type: doubles or exact numbers.
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
            /// Converts each number with `number`, which gets its field's name, its index in a list, and its value.
            ///
            /// # Errors
            /// The first error of `number`.
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

            /// Name of the profile in a case.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Signal::$profile(_) => <$profile>::NAME,)+
                }
            }

            /// The profile with this name, with unset numbers.
            pub fn blank(name: &str) -> Option<Signal> {
                $(if name == <$profile>::NAME {
                    return Some(Signal::$profile(Profile::blank()));
                })+
                None
            }

            /// The signal's linear stretches.
            pub fn pieces(&self) -> Pieces {
                Pieces(match self {
                    $(Signal::$profile(profile) => profile.stretches(),)+
                })
            }
        }
    };
}

profiles! {
    /// A linear rise from zero, or a step at t = 0, to a value that is then held.
    Ramp
    /// Linear interpolation between points. Two points at the same time are a step.
    TimeTable
}

impl<T: Clone> Signal<T> {
    /// Final value; `None` for a table without points.
    pub fn final_value(&self) -> Option<T> {
        match self {
            Signal::Ramp(ramp) => Some(ramp.value.clone()),
            Signal::TimeTable(table) => table.value.last().cloned(),
        }
    }
}

impl<T> Signal<T> {
    /// The ramp; `None` for other profiles. It serves data that have no other profile.
    pub fn as_ramp(&self) -> Option<&Ramp<T>> {
        match self {
            Signal::Ramp(ramp) => Some(ramp),
            _ => None,
        }
    }
}
