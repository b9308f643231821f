//! The numbers of a case by dotted path, for sweeps and sensitivities.

use super::error::{CaseError, Problem};
use super::schema::{self, Domain, Key, Kind};
use super::{Case, conditions, suggest};
use crate::model::{KickTime, Parameters};

/// A number of a case: its key, the index of its array element, and its index in a series.
struct Target {
    key: &'static Key,
    index: usize,
    element: usize,
}

impl Case {
    /// The number at a dotted path, such as `torsion.damping`, `perturbation.0.time` or `actuation.force.3`, in the
    /// unit of its key.
    ///
    /// # Errors
    /// If the case has no number there: unknown path, no such element, an option left to its default, a kick
    /// at the instability.
    pub fn number(&self, path: &str) -> Result<f64, CaseError> {
        self.find(path).ok_or_else(|| self.no_number(path))
    }

    /// Sets the number at a dotted path, as [`Case::number`] reads it; the case stays as it was on an error.
    /// Options left to their default and kicks at the instability can be set too.
    ///
    /// # Errors
    /// If there is no place for a number at this path, or the case would no longer be valid.
    pub fn set_number(&mut self, path: &str, value: f64) -> Result<(), CaseError> {
        let target = self.target(path).ok_or_else(|| self.no_number(path))?;
        let domain = match &target.key.kind {
            Kind::Number(_, domain, _) => *domain,
            Kind::Moment(_) => Domain::NotNegative,
            _ => Domain::Any,
        };
        if let Some(complaint) = domain.complaint(value) {
            return Err(CaseError::one("", path, format!("{complaint}, but is {value:?}")));
        }
        let mut changed = self.clone();
        changed.put(&target, value);
        let problems: Vec<Problem> = conditions::violated(&changed)
            .into_iter()
            .map(|violation| Problem {
                place: String::new(),
                key: violation.path,
                message: violation.message,
            })
            .collect();
        if !problems.is_empty() {
            return Err(CaseError { problems });
        }
        *self = changed;
        Ok(())
    }

    /// The physical parameters with another number at `path`, whether or not that makes a valid case: for differences.
    pub(crate) fn parameters_with(&self, path: &str, value: f64) -> Parameters {
        let mut changed = self.clone();
        if let Some(target) = self.target(path) {
            changed.put(&target, value);
        }
        changed.parameters
    }

    /// The dotted path of every number that the case holds, with its key.
    pub fn number_paths(&self) -> Vec<(String, &'static Key)> {
        let mut paths = Vec::new();
        for key in schema::keys() {
            let count = schema::array_of(key).map_or(1, |(array, _)| (array.length)(self));
            for index in 0..count {
                let path = schema::concrete(key, index);
                match &key.kind {
                    Kind::Series(_, access) => {
                        let length = (access.get)(self, index).map_or(0, |series| series.len());
                        paths.extend((0..length).map(|element| (format!("{path}.{element}"), key)));
                    }
                    _ if self.find(&path).is_some() => paths.push((path, key)),
                    _ => {}
                }
            }
        }
        paths
    }

    fn find(&self, path: &str) -> Option<f64> {
        self.target(path).and_then(|target| self.get(&target))
    }

    /// What a path means in this case; `None` if no number can be there.
    fn target(&self, path: &str) -> Option<Target> {
        schema::keys().iter().find_map(|key| {
            let found = |index, element| Some(Target { key, index, element });
            match &key.kind {
                Kind::Number(_, _, access) if schema::array_of(key).is_none() => {
                    // A key of the other profile, or of another friction law, takes part in nothing.
                    use schema::Presence::{Law, Profile};
                    let present = !matches!(key.presence, Profile(_) | Law { .. }) || (access.get)(self, 0).is_some();
                    (path == key.path && present).then(|| found(0, 0)).flatten()
                }
                Kind::Number(..) | Kind::Moment(_) => {
                    let (array, name) = schema::array_of(key)?;
                    let index = path.strip_prefix(array.path)?.strip_prefix('.')?.strip_suffix(name)?;
                    let index: usize = index.strip_suffix('.')?.parse().ok()?;
                    (index < (array.length)(self)).then(|| found(index, 0)).flatten()
                }
                Kind::Series(_, access) => {
                    let element: usize = path.strip_prefix(key.path)?.strip_prefix('.')?.parse().ok()?;
                    let length = (access.get)(self, 0)?.len();
                    (element < length).then(|| found(0, element)).flatten()
                }
                _ => None,
            }
        })
    }

    fn get(&self, target: &Target) -> Option<f64> {
        match &target.key.kind {
            Kind::Number(_, _, access) => (access.get)(self, target.index),
            Kind::Moment(access) => match (access.get)(self, target.index)? {
                KickTime::At(time) => Some(time),
                KickTime::Instability => None,
            },
            Kind::Series(_, access) => (access.get)(self, target.index)?.get(target.element).copied(),
            _ => None,
        }
    }

    fn put(&mut self, target: &Target, value: f64) {
        match &target.key.kind {
            Kind::Number(_, _, access) => (access.set)(self, target.index, value),
            Kind::Moment(access) => (access.set)(self, target.index, KickTime::At(value)),
            Kind::Series(_, access) => {
                if let Some(mut series) = (access.get)(self, target.index) {
                    series[target.element] = value;
                    (access.set)(self, target.index, series);
                }
            }
            _ => {}
        }
    }

    fn no_number(&self, path: &str) -> CaseError {
        if self.target(path).is_some() {
            return CaseError::one(
                "",
                path,
                "has no number in this case: it is left to its default, or a word",
            );
        }
        let paths = self.number_paths();
        let hint = match suggest(path, paths.iter().map(|(known, _)| known.as_str())) {
            Some(close) => format!("did you mean {close}?"),
            None => "`schema::keys` lists the parameters".to_owned(),
        };
        CaseError::one("", path, format!("the case has no number of that path; {hint}"))
    }
}
