//! A JSON document whose form a test knows: each part as what it is, or a panic that shows the part.

use serde_json::Value;

pub trait Json {
    fn list(&self) -> &[Value];
    fn number(&self) -> f64;
    fn whole(&self) -> u64;
    fn text(&self) -> &str;

    /// The first object of a list whose `key` has this value.
    fn with(&self, key: &str, value: &str) -> &Value;
}

impl Json for Value {
    #[track_caller]
    fn list(&self) -> &[Value] {
        self.as_array().unwrap_or_else(|| panic!("no list: {self}"))
    }

    #[track_caller]
    fn number(&self) -> f64 {
        self.as_f64().unwrap_or_else(|| panic!("no number: {self}"))
    }

    #[track_caller]
    fn whole(&self) -> u64 {
        self.as_u64().unwrap_or_else(|| panic!("no whole number: {self}"))
    }

    #[track_caller]
    fn text(&self) -> &str {
        self.as_str().unwrap_or_else(|| panic!("no text: {self}"))
    }

    #[track_caller]
    fn with(&self, key: &str, value: &str) -> &Value {
        self.list().with(key, value)
    }
}

pub trait Entries {
    /// The first object whose `key` has this value.
    fn with(&self, key: &str, value: &str) -> &Value;
}

impl Entries for [Value] {
    #[track_caller]
    fn with(&self, key: &str, value: &str) -> &Value {
        let found = self.iter().find(|one| one[key] == value);
        found.unwrap_or_else(|| panic!("nothing with {key} {value}: {self:?}"))
    }
}
