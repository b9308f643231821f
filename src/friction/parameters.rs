//! The parameters of a law, by the names that a case gives them.

/// What a case has to know of a law: its word, and its parameters as keys of `[friction]`.
pub trait Parameters: Sized {
    /// The word of `friction.law`.
    const NAME: &'static str;

    /// The keys, in the order in which a case is written. `breakaway` belongs to every law and is none of them.
    const KEYS: &'static [&'static str];

    /// The key of the coefficient at vanishing speed ([`Law::at_vanishing_speed`](super::Law::at_vanishing_speed)).
    const AT_VANISHING_SPEED: &'static str;

    /// The law with NaN for each parameter that has no default.
    fn unset() -> Self;

    /// The value of a parameter that is a number, SI.
    fn number(&self, key: &str) -> Option<f64>;

    /// Sets such a parameter; does nothing if the law has no such one.
    fn set_number(&mut self, key: &str, value: f64);

    /// The values of a parameter that is a list of numbers, SI.
    fn list(&self, _key: &str) -> Option<&[f64]> {
        None
    }

    /// Sets such a parameter; does nothing if the law has no such one.
    fn set_list(&mut self, _key: &str, _values: Vec<f64>) {}

    /// The word of a parameter that is one of several.
    fn word(&self, _key: &str) -> Option<&'static str> {
        None
    }

    /// Sets such a parameter; does nothing if the law has no such one, or that not such a word.
    fn set_word(&mut self, _key: &str, _word: &str) {}

    /// What is wrong with the parameters, each of which is within its own limits: the key, and what it must be.
    fn complaints(&self) -> Vec<(String, String)> {
        Vec::new()
    }
}

/// Implements [`Parameters`] for a law whose parameters are numbers: its word, the key of its coefficient at vanishing speed,
/// and its fields with their values as long as none is given.
macro_rules! numbers {
    ($law:ident, $name:literal, at rest $at_rest:ident: $($field:ident = $unset:expr),+) => {
        numbers!($law, $name, at rest $at_rest: $($field = $unset),+; complaints |_law| Vec::new());
    };
    ($law:ident, $name:literal, at rest $at_rest:ident: $($field:ident = $unset:expr),+;
     complaints |$of:ident| $complaints:expr) => {
        impl crate::friction::Parameters for $law {
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
