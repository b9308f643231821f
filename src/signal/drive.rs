//! What drives a train: a constant, one of the profiles, a harmonic, or a sum of such signals.
//!
//! Between its corners ([`Drive::corners`]) a drive is a polynomial of degree 1 and a sum of harmonics: it has Taylor series
//! and an antiderivative in closed form.

use super::Signal;

/// A signal of a train. `T` is the type of its numbers: doubles, or exact ones.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive<T = f64> {
    /// The same at all times.
    Value(T),
    /// A ramp or a table.
    Linear(Signal<T>),
    /// A harmonic.
    Wave(Wave<T>),
    /// The sum of others.
    Sum(Vec<Drive<T>>),
}

/// mean + amplitude sin(omega t + phase), or the cosine. Where `from` or `to` is given, the harmonic part acts from then
/// (inclusive) or until then only; outside, the signal is the mean. t is the time of the run: from t = 0, not from `from`.
#[derive(Debug, Clone, PartialEq)]
pub struct Wave<T = f64> {
    /// Sine or cosine.
    pub shape: Shape,
    /// In the unit of what it drives.
    pub mean: T,
    /// In the unit of what it drives.
    pub amplitude: T,
    /// How fast.
    pub frequency: Frequency<T>,
    /// rad.
    pub phase: T,
    /// s.
    pub from: Option<T>,
    /// s.
    pub to: Option<T>,
}

/// Sine or cosine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// sin.
    Sine,
    /// cos.
    Cosine,
}

/// How fast a harmonic is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Frequency<T = f64> {
    /// f, Hz: omega = 2 pi f.
    Cycles(T),
    /// omega, rad/s.
    Angular(T),
}
