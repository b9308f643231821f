//! Methods of high order for smooth stretches, without physics: Taylor series where an oscillation is followed, Radau
//! IIA collocation where it is stridden over.
//!
//! | module | what it is |
//! |---|---|
//! | [`number`] | what a number has to be able to do: doubles, several of them side by side, enclosures |
//! | [`lanes`] | several doubles side by side |
//! | [`taylor`] | coefficients of products and exponentials; polynomials; the length of a step |
//! | [`polynomial_roots`] | the roots of a polynomial in an interval, all of them, in order |
//! | [`radau_tableau`] | the coefficients of Radau IIA with any odd number of stages |
//! | [`radau`] | a step of Radau IIA, with its interpolant and its error |
//! | [`chebyshev`] | polynomials through a smooth motion |
//! | `eigenvalues` | those of a matrix |
//! | [`band`] | a band matrix to write |
//!
//! Nothing here allocates after it has been made.

pub mod band;
pub mod chebyshev;
pub(crate) mod eigenvalues;
pub mod lanes;
pub mod number;
pub mod polynomial_roots;
pub mod radau;
pub mod radau_tableau;
pub mod taylor;

pub use number::Number;
