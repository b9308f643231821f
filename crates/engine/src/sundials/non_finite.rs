//! Values of callbacks that are not finite.

/// A function of an [`OdeSystem`](super::OdeSystem).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Callback {
    /// [`OdeSystem::rhs`](super::OdeSystem::rhs)
    RightHandSide,
    /// [`OdeSystem::jacobian`](super::OdeSystem::jacobian); or, with row and column in band coordinates,
    /// [`OdeSystem::band_jacobian`](super::OdeSystem::band_jacobian)
    Jacobian,
    /// [`OdeSystem::roots`](super::OdeSystem::roots)
    Crossing,
}

/// A callback returned an infinite value or NaN.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the {} gave {value} in {} at t = {time}", match callback {
    Callback::RightHandSide => "right-hand side",
    Callback::Jacobian => "Jacobian",
    Callback::Crossing => "crossing function",
}, match callback {
    Callback::Jacobian => format!("row {component}, column {column}"),
    _ => format!("component {component}"),
})]
pub struct NonFinite {
    /// The callback.
    pub callback: Callback,
    /// Index of the value, from 0; in a Jacobian the row.
    pub component: usize,
    /// Column in a Jacobian, from 0; otherwise 0.
    pub column: usize,
    /// Time of the call.
    pub time: f64,
    /// The value.
    pub value: f64,
}
