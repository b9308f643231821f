//! The parameters of a law, by their names in a case.

/// Interface of a law to a case: its word, and its parameters as keys of `[friction]`.
pub trait LawParameters: Sized {
    /// The word of `friction.law`.
    const NAME: &'static str;

    /// The parameters, in the order of a written case. `breakaway` belongs to every law and is not listed.
    const PARAMETERS: &'static [LawParameter];

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

/// A parameter of a law: its key in a case, and what a reader has to know of it.
#[derive(Debug, Clone, Copy)]
pub struct LawParameter {
    /// Path of the key, `friction.NAME`.
    pub path: &'static str,
    /// Type and limits of the value.
    pub value: LawValue,
    /// Power of the sliding speed in its unit: 0 for a coefficient, -1 for the slope of one.
    pub speed: i8,
    /// Default in words; `None` for a required parameter.
    pub default: Option<&'static str>,
    /// One line, beginning with the symbol.
    pub about: &'static str,
}

/// Type and limits of a parameter's value.
#[derive(Debug, Clone, Copy)]
pub enum LawValue {
    /// Any finite number.
    Any,
    /// A number that is not negative.
    NotNegative,
    /// A number above zero.
    Positive,
    /// A list of numbers.
    List,
    /// One of these words.
    Word(fn() -> Vec<&'static str>),
}

impl LawParameter {
    /// A required parameter; the path is given by its field.
    pub(super) const fn new(value: LawValue, speed: i8, about: &'static str) -> LawParameter {
        LawParameter {
            path: "",
            value,
            speed,
            default: None,
            about,
        }
    }

    /// A coefficient of friction.
    pub(super) const fn coefficient(about: &'static str) -> LawParameter {
        LawParameter::new(LawValue::NotNegative, 0, about)
    }

    /// This parameter with a default.
    pub(super) const fn or(self, default: &'static str) -> LawParameter {
        LawParameter {
            default: Some(default),
            ..self
        }
    }

    /// The key in `[friction]`.
    pub fn key(&self) -> &'static str {
        self.path.trim_start_matches("friction.")
    }

    /// The default number; NaN without one.
    pub(super) fn unset(&self) -> f64 {
        let number = self.default.and_then(|default| default.parse().ok());
        number.unwrap_or(f64::NAN)
    }
}

/// mu_s of several laws.
pub(super) const LOW_SPEED: LawParameter =
    LawParameter::coefficient("mu_s, friction coefficient at vanishing sliding speed");
/// mu_d of several laws.
pub(super) const HIGH_SPEED: LawParameter =
    LawParameter::coefficient("mu_d, friction coefficient at high sliding speed");
/// mu_d of constant laws.
pub(super) const KINETIC: LawParameter = LawParameter::coefficient("mu_d, friction coefficient at every sliding speed");
/// x_s of several laws.
pub(super) const SCALE: LawParameter = LawParameter::new(
    LawValue::Positive,
    1,
    "x_s, sliding speed over which the friction coefficient falls",
);

/// The parameter of a field of a law or, for lists and words, of this name.
macro_rules! parameter {
    ($field:ident, $parameter:expr) => {
        crate::friction::LawParameter {
            path: concat!("friction.", stringify!($field)),
            ..$parameter
        }
    };
}
pub(super) use parameter;

/// Implements [`LawParameters`] for a law of numbers: word, key of the coefficient at vanishing speed, and fields with
/// their [`LawParameter`].
macro_rules! numbers {
    ($law:ident, $name:literal, at rest $at_rest:ident: $($field:ident = $parameter:expr),+) => {
        numbers!($law, $name, at rest $at_rest: $($field = $parameter),+; complaints |_law| Vec::new());
    };
    ($law:ident, $name:literal, at rest $at_rest:ident: $($field:ident = $parameter:expr),+;
     complaints |$of:ident| $complaints:expr) => {
        impl crate::friction::LawParameters for $law {
            const NAME: &'static str = $name;
            const PARAMETERS: &'static [crate::friction::LawParameter] =
                &[$(crate::friction::parameters::parameter!($field, $parameter)),+];
            const AT_VANISHING_SPEED: &'static str = stringify!($at_rest);

            fn unset() -> Self {
                $law { $($field: $parameter.unset()),+ }
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
