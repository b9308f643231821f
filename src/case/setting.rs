//! One value for one key, checked by itself: what an axis of a study is made of.

use super::Motion;
use super::document::{Override, Value};
use super::quantity::Dimension;
use super::schema::{self, Domain, Key, Kind};
use super::trains::keys::laws;
use super::value::{choice, number};

/// One value of a key; a number is in the key's SI unit.
#[derive(Debug, Clone, PartialEq)]
pub enum Setting {
    /// A real number in SI.
    Number(f64),
    /// A whole number, 0 or more.
    Count(usize),
    /// True or false.
    Flag(bool),
    /// A name or a text.
    Text(String),
}

impl Setting {
    /// The value where it is a number or a count.
    pub fn as_number(&self) -> Option<f64> {
        match self {
            Setting::Number(number) => Some(*number),
            Setting::Count(count) => Some(*count as f64),
            Setting::Flag(_) | Setting::Text(_) => None,
        }
    }

    /// The value as a word, for messages and codes.
    pub fn word(&self) -> String {
        match self {
            Setting::Number(number) => format!("{number:?}"),
            Setting::Count(count) => count.to_string(),
            Setting::Flag(flag) => flag.to_string(),
            Setting::Text(text) => text.clone(),
        }
    }
}

impl Override {
    /// Sets one value of an axis.
    pub fn setting(path: &str, value: &Setting) -> Override {
        let value = match value {
            Setting::Number(number) => Value::Float(*number),
            Setting::Count(count) => Value::Integer(i64::try_from(*count).unwrap_or(i64::MAX)),
            Setting::Flag(flag) => Value::Flag(*flag),
            Setting::Text(text) => Value::Text(text.clone()),
        };
        Override::value(path, value)
    }
}

/// The key at a concrete path: `perturbation.0.time` is `perturbation[].time`, and `actuation.force.3` is an element of
/// `actuation.force` of a table.
pub(crate) fn key_of(path: &str) -> Option<&'static Key> {
    let element_of = |key: &Key| {
        matches!(key.kind, Kind::Series(..))
            && path
                .strip_prefix(key.path)
                .and_then(|rest| rest.strip_prefix('.'))
                .is_some_and(|index| index.parse::<usize>().is_ok())
    };
    let in_array = |key: &Key| {
        key.path.split_once("[].").is_some_and(|(array, name)| {
            path.strip_prefix(array)
                .and_then(|rest| rest.strip_prefix('.'))
                .and_then(|rest| rest.split_once('.'))
                .is_some_and(|(index, rest)| rest == name && index.parse::<usize>().is_ok())
        })
    };
    schema::keys()
        .iter()
        .find(|key| key.path == path || in_array(key) || element_of(key))
}

/// What one concrete path of a case takes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slot {
    /// One line about the key.
    pub(crate) description: &'static str,
    pub(super) takes: Takes,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Takes {
    /// What a key takes, in this motion.
    Key(&'static Key, Motion),
    Number(Dimension, Domain),
    /// One of these words.
    Words(&'static [&'static str]),
    /// One of the friction laws of the general form.
    Laws,
}

impl Slot {
    pub(super) fn of_key(key: &'static Key) -> Slot {
        Slot {
            description: key.description,
            takes: Takes::Key(key, Motion::Rotation),
        }
    }

    /// What its number measures; `None` if it takes none.
    pub(crate) fn dimension(&self) -> Option<Dimension> {
        match self.takes {
            Takes::Key(key, motion) => key.dimension().map(|dimension| motion.dimension(dimension)),
            Takes::Number(dimension, _) => Some(dimension),
            Takes::Words(_) | Takes::Laws => None,
        }
    }

    /// The SI unit of a number, `1` if it is a plain one; `None` for words and switches.
    pub(crate) fn unit(&self) -> Option<&'static str> {
        self.dimension().map(Dimension::unit)
    }

    /// Reads one value, as far as it can be judged without the rest of the case.
    pub(crate) fn read(&self, value: &Value) -> Result<Setting, String> {
        let word = |words: &[&'static str]| choice(value, words).map(|name| Setting::Text(name.to_owned()));
        match self.takes {
            Takes::Key(key, motion) => read_setting(key, value, motion),
            Takes::Number(dimension, domain) => number(value, dimension, domain).map(Setting::Number),
            Takes::Words(words) => word(words),
            Takes::Laws => word(&laws()),
        }
    }
}

/// Reads one value for `key`, as far as it can be judged without the rest of the case.
pub(super) fn read_setting(key: &Key, value: &Value, motion: Motion) -> Result<Setting, String> {
    match &key.kind {
        Kind::Text(_) => match value {
            Value::Text(text) => Ok(Setting::Text(text.clone())),
            other => Err(format!("expected text in quotes, but got {}", other.describe())),
        },
        Kind::Flag(_) => match value {
            Value::Flag(flag) => Ok(Setting::Flag(*flag)),
            other => Err(format!("expected true or false, but got {}", other.describe())),
        },
        Kind::Count(_) => match value {
            Value::Integer(count) if *count >= 1 => Ok(Setting::Count(usize::try_from(*count).unwrap_or(usize::MAX))),
            other => Err(format!(
                "expected a whole number of at least 1, but got {}",
                other.describe()
            )),
        },
        Kind::Choice(names, _) => choice(value, &names()).map(|name| Setting::Text(name.to_owned())),
        Kind::SourceChoice(names) | Kind::Word(names) => {
            choice(value, names).map(|name| Setting::Text(name.to_owned()))
        }
        Kind::Number(dimension, domain, _)
        | Kind::Source(dimension, domain)
        | Kind::Plain(dimension, domain)
        | Kind::List(dimension, domain) => number(value, motion.dimension(*dimension), *domain).map(Setting::Number),
        Kind::Moment(_) => match value {
            Value::Text(word) if word == schema::INSTABILITY => Ok(Setting::Text(word.clone())),
            other => number(other, Dimension::Time, Domain::NotNegative).map(Setting::Number),
        },
        Kind::Series(dimension, _) | Kind::Signal(dimension) => {
            number(value, motion.dimension(*dimension), Domain::Any).map(Setting::Number)
        }
        Kind::Index => match value {
            Value::Integer(index) if *index >= 0 => Ok(Setting::Count(usize::try_from(*index).unwrap_or(usize::MAX))),
            other => Err(format!(
                "expected a whole number, 0 or more, but got {}",
                other.describe()
            )),
        },
    }
}
