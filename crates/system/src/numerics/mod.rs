//! Methods of high order for smooth stretches, without physics: Taylor series, which follow an oscillation, and Radau
//! IIA collocation, whose steps can be longer than the oscillation.

pub mod band;
pub mod bisection;
pub mod chebyshev;
pub mod eigenvalues;
pub mod number;
pub mod polynomial_roots;
pub mod radau;
pub mod taylor;

pub use number::Number;
