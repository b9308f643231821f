//! The torsional state: which components it has, stated once. Their places are known to this folder, and independently to
//! the oracle; all else asks for them by name ([`Components`]) or by what they are (`MEASURES`).

/// What a component of the state is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measure {
    /// rad.
    Twist,
    /// rad/s.
    TwistRate,
    /// rad/s.
    Speed,
    /// The angle slipped, rad.
    Slip,
    /// A dissipated energy, J.
    Loss,
}

/// Declares the components in their order: name, place and what each is.
macro_rules! components {
    ($($(#[$about:meta])* $name:ident $place:ident $measure:ident)+) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        enum Place {
            $($place,)+
        }

        /// Positions in the torsional state vector.
        pub mod index {
            use super::Place;
            $($(#[$about])* pub const $place: usize = Place::$place as usize;)+
        }

        /// What each component is, by its [`index`].
        pub(crate) const MEASURES: &[Measure] = &[$(Measure::$measure),+];

        /// A state, its rates, or what else there is one of for each component, by name.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Components {
            $($(#[$about])* pub $name: f64,)+
        }

        impl Components {
            /// Of a state vector.
            #[inline]
            pub fn of(y: &[f64]) -> Components {
                Components { $($name: y[index::$place],)+ }
            }

            /// As a state vector.
            pub fn state(&self) -> TorsionState {
                [$(self.$name),+]
            }
        }
    };
}

components! {
    /// u = theta - phi_2, rotor twist, rad.
    rotor_twist ROTOR_TWIST Twist
    /// u', rad/s.
    rotor_twist_rate ROTOR_TWIST_RATE TwistRate
    /// v = phi_1, stator twist, rad.
    stator_twist STATOR_TWIST Twist
    /// v' = phi_1', rad/s.
    stator_twist_rate STATOR_TWIST_RATE TwistRate
    /// theta', rad/s.
    rotor_speed ROTOR_SPEED Speed
    /// phi_2 - phi_1, rad. A quadrature: nothing depends on it.
    slip SLIP Slip
    /// Energy dissipated by friction, J. A quadrature.
    friction_loss FRICTION_LOSS Loss
    /// Energy dissipated by c_t of both disks, J. A quadrature.
    damping_loss DAMPING_LOSS Loss
}

/// Number of components of the torsional state.
pub const DIMENSION: usize = MEASURES.len();

/// Number of its components that the equations depend on, which are the first: the twists, their rates and the rotor speed.
/// Those after them are quadratures.
pub const DYNAMIC: usize = index::SLIP;

/// The torsional state: [`index`] names its components.
pub type TorsionState = [f64; DIMENSION];

/// The state that a solver's slice holds.
pub(crate) fn state_of(y: &[f64]) -> TorsionState {
    std::array::from_fn(|k| y[k])
}
