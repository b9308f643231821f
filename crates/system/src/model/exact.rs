//! Friction laws with exact rational parameters.

use num_rational::BigRational;
use num_traits::ToPrimitive;

/// A friction law whose parameters are exact numbers, by their keys in a case.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactLaw {
    /// The word of `friction.law`.
    pub name: &'static str,
    /// Key and value of each number, SI.
    pub numbers: Vec<(&'static str, BigRational)>,
    /// Key and values of each list.
    pub lists: Vec<(&'static str, Vec<BigRational>)>,
    /// Key and word of each choice.
    pub words: Vec<(&'static str, &'static str)>,
}

impl ExactLaw {
    /// The value of a number; zero if the law has no such key.
    pub fn number(&self, key: &str) -> BigRational {
        let found = self.numbers.iter().find(|number| number.0 == key);
        found.map_or_else(BigRational::default, |number| number.1.clone())
    }

    /// The values of a list; empty if the law has no such key.
    pub fn list(&self, key: &str) -> &[BigRational] {
        let found = self.lists.iter().find(|list| list.0 == key);
        found.map_or(&[], |list| &list.1)
    }

    /// The word of a choice; empty if the law has no such key.
    pub fn word(&self, key: &str) -> &'static str {
        let found = self.words.iter().find(|word| word.0 == key);
        found.map_or("", |word| word.1)
    }
}

/// The double nearest to `value`.
pub fn nearest_double(value: &BigRational) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
}
