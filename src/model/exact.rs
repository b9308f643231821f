//! Friction laws with parameters in exact rationals.

use num_rational::BigRational;
use num_traits::ToPrimitive;

/// A friction law, as [`FrictionLaw`](crate::friction::FrictionLaw): its name, and its parameters by their keys in a case.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactLaw {
    /// The word of `friction.law`.
    pub name: &'static str,
    /// Key and value of each parameter that is a number, SI.
    pub numbers: Vec<(&'static str, BigRational)>,
    /// Of each that is a list of numbers.
    pub lists: Vec<(&'static str, Vec<BigRational>)>,
    /// Of each that is one of several words.
    pub words: Vec<(&'static str, &'static str)>,
}

impl ExactLaw {
    /// The value of a parameter; zero of one that the law does not have.
    pub fn number(&self, key: &str) -> BigRational {
        let found = self.numbers.iter().find(|number| number.0 == key);
        found.map_or_else(BigRational::default, |number| number.1.clone())
    }

    /// The values of a list; empty for one that the law does not have.
    pub fn list(&self, key: &str) -> &[BigRational] {
        let found = self.lists.iter().find(|list| list.0 == key);
        found.map_or(&[], |list| &list.1)
    }

    /// The word of a parameter; empty for one that the law does not have.
    pub fn word(&self, key: &str) -> &'static str {
        let found = self.words.iter().find(|word| word.0 == key);
        found.map_or("", |word| word.1)
    }
}

/// The double nearest to `value`.
pub fn nearest_double(value: &BigRational) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
}
