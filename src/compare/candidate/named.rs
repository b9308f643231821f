//! Columns with paths for names: `rbody/3/VRZ`, of which the end is enough where it is the only one.

use crate::quote::shown;
use std::collections::HashMap;

/// Names of columns.
#[derive(Debug, Default)]
pub(super) struct Names {
    all: Vec<String>,
    places: HashMap<String, usize>,
    /// Other names, in lower case; `None` of one that several columns have.
    others: HashMap<String, Option<usize>>,
}

impl Names {
    /// Adds a column and another name of it; `false` if its name is known already.
    pub fn add(&mut self, name: String, other: Option<String>) -> bool {
        let (lower, place) = (name.to_lowercase(), self.all.len());
        if self.places.contains_key(&lower) {
            return false;
        }
        let mut parts = lower.split_once('/');
        while let Some((_, end)) = parts {
            self.also(end.to_owned(), place);
            parts = end.split_once('/');
        }
        if let Some(other) = other {
            self.also(other.to_lowercase(), place);
        }
        self.places.insert(lower, place);
        self.all.push(name);
        true
    }

    fn also(&mut self, name: String, place: usize) {
        let known = self.others.entry(name).or_insert(Some(place));
        if *known != Some(place) {
            *known = None;
        }
    }

    /// In the order in which they were added.
    pub fn all(&self) -> &[String] {
        &self.all
    }

    /// The column of a name, or of the end of one.
    ///
    /// # Errors
    /// The text says that there is none, or several.
    pub fn find(&self, name: &str) -> Result<usize, String> {
        let lower = name.trim_start_matches('/').to_lowercase();
        match (self.places.get(&lower), self.others.get(&lower)) {
            (Some(&place), _) | (None, Some(&Some(place))) => Ok(place),
            (None, Some(None)) => Err(format!("several columns are called \"{}\"", shown(name))),
            (None, None) => Err(format!("has no column \"{}\"", shown(name))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn property_the_end_of_a_name_is_enough_where_it_is_the_only_one() {
        let mut names = Names::default();
        assert!(names.add("node/1/VX".to_owned(), Some("rotor/VX".to_owned())));
        assert!(names.add("node/2/VX".to_owned(), None));
        assert!(names.add("inter/7/MZ".to_owned(), None));
        assert!(!names.add("NODE/2/vx".to_owned(), None));
        assert_eq!(names.find("mz"), Ok(2));
        assert_eq!(names.find("2/VX"), Ok(1));
        assert_eq!(names.find("Rotor/VX"), Ok(0));
        assert!(names.find("VX").unwrap_err().contains("several"));
        assert!(names.find("VY").unwrap_err().contains("no column"));
    }
}
