//! The parameters of a law, by their names in a case.

/// Interface of a law to a case: its word, and its parameters as keys of `[friction]`.
pub trait LawParameters: Sized {
    /// The word of `friction.law`.
    const NAME: &'static str;

    /// The keys, in the order of a written case. `breakaway` belongs to every law and is not listed.
    const KEYS: &'static [&'static str];

    /// Key of the coefficient at vanishing speed ([`Law::at_vanishing_speed`](super::Law::at_vanishing_speed)).
    const AT_VANISHING_SPEED: &'static str;

    /// The law with NaN for parameters without default.
    fn unset() -> Self;

    /// The value of a number, SI.
    fn number(&self, key: &str) -> Option<f64>;

    /// Sets a number; does nothing for an unknown key.
    fn set_number(&mut self, key: &str, value: f64);

    /// The values of a list, SI.
    fn list(&self, _key: &str) -> Option<&[f64]> {
        None
    }

    /// Sets a list; does nothing for an unknown key.
    fn set_list(&mut self, _key: &str, _values: Vec<f64>) {}

    /// The word of a choice.
    fn word(&self, _key: &str) -> Option<&'static str> {
        None
    }

    /// Sets a choice; does nothing for an unknown key or word.
    fn set_word(&mut self, _key: &str, _word: &str) {}

    /// Errors of parameters that are each within their limits: key and condition.
    fn complaints(&self) -> Vec<(String, String)> {
        Vec::new()
    }
}

/// Implements [`LawParameters`] for a law of numbers: word, key of the coefficient at vanishing speed, and fields with
/// their unset values.
macro_rules! numbers {
    ($law:ident, $name:literal, at rest $at_rest:ident: $($field:ident = $unset:expr),+) => {
        numbers!($law, $name, at rest $at_rest: $($field = $unset),+; complaints |_law| Vec::new());
    };
    ($law:ident, $name:literal, at rest $at_rest:ident: $($field:ident = $unset:expr),+;
     complaints |$of:ident| $complaints:expr) => {
        impl crate::friction::LawParameters for $law {
            const NAME: &'static str = $name;
            const KEYS: &'static [&'static str] = &[$(stringify!($field)),+];
            const AT_VANISHING_SPEED: &'static str = stringify!($at_rest);

            fn unset() -> Self {
                $law { $($field: $unset),+ }
            }

            fn number(&self, key: &str) -> Option<f64> {
                match key {
                    $(stringify!($field) => Some(self.$field),)+
                    _ => None,
                }
            }

            fn set_number(&mut self, key: &str, value: f64) {
                match key {
                    $(stringify!($field) => self.$field = value,)+
                    _ => {}
                }
            }

            fn complaints(&self) -> Vec<(String, String)> {
                let $of = self;
                $complaints
            }
        }
    };
}
pub(super) use numbers;
