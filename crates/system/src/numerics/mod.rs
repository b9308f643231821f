//! Methods of high order for smooth stretches, without physics: Taylor series that follow an oscillation, and Radau IIA
//! collocation with steps longer than it.

pub mod band;
pub mod chebyshev;
pub mod eigenvalues;
pub mod number;
pub mod polynomial_roots;
pub mod radau;
pub mod radau_tableau;
pub mod taylor;

pub use number::Number;
