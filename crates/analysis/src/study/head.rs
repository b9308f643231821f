//! Common part of all studies: text and origin, title, base case, settings.

use super::keys::{StudyKey, keys};
use super::reading::{StudyReader, dotted, join};
use crate::provenance;
use sha2::{Digest, Sha256};
use std::path::{MAIN_SEPARATOR, Path, PathBuf};
use stickslip_case::builtin::{self, BuiltIn};
use stickslip_case::document::{CaseValue, PlacedValue, TextPlace};
use stickslip_case::{Case, CaseError, CaseKeys, CaseProblem, CaseSource, Origin, Override, Words, toml_text};
use stickslip_files::{StudyHeader, is_hdf5, open_sound};

/// Text and origin of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StudySource {
    /// TOML text.
    pub text: String,
    /// File; `None` for a built-in study.
    pub path: Option<PathBuf>,
    /// Name of the study in results.
    pub name: String,
}

impl StudySource {
    /// Finds a study by name: a readable file, or a built-in study of this kind. The error lists the built-in studies.
    pub fn find(name: &str, built_in: &[BuiltIn]) -> Result<StudySource, CaseError> {
        let path = Path::new(name);
        if !path.exists() && !name.contains(MAIN_SEPARATOR) && path.extension().is_none() {
            return builtin::find("study", built_in, name).map(|study| StudySource::text(name, study.text));
        }
        let name = path
            .file_stem()
            .map_or_else(|| "study".into(), |stem| stem.to_string_lossy());
        Ok(StudySource {
            text: toml_text(path, "study")?,
            name: name.into_owned(),
            path: Some(path.to_owned()),
        })
    }

    /// Study from a text.
    pub fn text(name: &str, text: &str) -> StudySource {
        StudySource {
            text: text.to_owned(),
            path: None,
            name: name.to_owned(),
        }
    }

    /// Name of the study in messages.
    pub fn label(&self) -> String {
        match &self.path {
            Some(path) => path.display().to_string(),
            None => format!("built-in study {}", self.name),
        }
    }

    pub(crate) fn folder(&self) -> PathBuf {
        let folder = self.path.as_ref().and_then(|path| path.parent());
        folder.map_or_else(PathBuf::new, Path::to_owned)
    }

    /// Base case as an argument of a command: a built-in name, or a file relative to the study's folder.
    pub(crate) fn named(&self, base: &CaseSource) -> String {
        let folder = self.folder();
        match &base.origin {
            Origin::BuiltIn(name) => name.clone(),
            // These do not occur in a study.
            Origin::StandardInput | Origin::Text => "-".to_owned(),
            Origin::File(path) | Origin::Result(path) => {
                path.strip_prefix(&folder).unwrap_or(path).display().to_string()
            }
        }
    }
}

/// Common part of all studies: title, base case, settings.
#[derive(Debug, Clone)]
pub struct StudyHead {
    /// Title, by default the name of the study.
    pub title: String,
    /// Source text.
    pub source: StudySource,
    /// Text of the base case.
    pub base: CaseSource,
    /// Whether the base case was read.
    pub(crate) is_readable: bool,
    /// Names of the parts of its system.
    pub words: Words,
    /// Settings of the study in the base case.
    pub settings: Vec<Override>,
    /// Overrides that are not in the study, in words.
    pub changed: Vec<String>,
    /// Input files, which must not be overwritten.
    pub files: Vec<PathBuf>,
}

/// Keys of every study.
pub(super) const HEAD_KEYS: &[StudyKey] = keys! {
    "title": "text", "the name of the study" => "title of the study";
    "case": "text", "" => "base case: a built-in name, a TOML file or a result file beside the study";
    "set": "table", "empty" => "keys of the base case with other values";
};

/// Key of the time limit, which does not affect results.
const WALL_TIME: &str = "solver.max_wall_time";

impl StudyHead {
    /// Reads `title`, `case` and `set`, and returns the keys of the base case. Settings apply in this order: `before`,
    /// the study's own, `overrides`. An unreadable base case is reported, and no valid text stands for it.
    pub(crate) fn read(
        reader: &mut StudyReader,
        root: &PlacedValue,
        source: StudySource,
        before: Vec<Override>,
        overrides: &[Override],
    ) -> (StudyHead, CaseKeys) {
        let title = root.at("title").and_then(|node| reader.text(node, "title"));
        let mut files: Vec<PathBuf> = source.path.iter().cloned().collect();
        let base = read_base(reader, root, &source, &mut files);
        // Without a base case, the keys of the short form are known.
        let keys_with = |settings: &[Override]| {
            base.as_ref()
                .map_or(CaseKeys::SHORT, |base| CaseKeys::of(base, settings))
        };
        let mut settings = before;
        if let Some(set) = root.at("set") {
            read_settings(reader, &keys_with(&[]), set, "", &mut settings);
        }
        let changed = base
            .as_ref()
            .map(|base| stickslip_case::changed(base, &settings, overrides));
        settings.extend(overrides.iter().cloned());
        let keys = keys_with(&settings);
        let head = StudyHead {
            title: title.unwrap_or_else(|| source.name.clone()),
            words: keys.words,
            is_readable: base.is_some(),
            base: base.unwrap_or_else(|| CaseSource::text("\0")),
            settings,
            changed: changed.unwrap_or_default(),
            files,
            source,
        };
        (head, keys)
    }

    /// Base case with the study's settings and those of a point.
    pub(crate) fn case_with(&self, point: impl IntoIterator<Item = Override>) -> Result<Case, CaseError> {
        let overrides: Vec<Override> = self.settings.iter().cloned().chain(point).collect();
        Case::read(&self.base, &overrides)
    }

    /// Settings without the time limit: a study can resume with another limit.
    pub(crate) fn decisive_settings(&self) -> impl Iterator<Item = &Override> {
        self.settings.iter().filter(|setting| setting.key() != WALL_TIME)
    }

    /// Head of the study's file.
    pub(crate) fn of_file(&self, history: String) -> StudyHeader {
        StudyHeader {
            title: self.title.clone(),
            source: provenance::source(),
            history,
            study: self.source.text.clone(),
            changed: self.changed.clone(),
            ..StudyHeader::default()
        }
    }
}

/// SHA-256 in hexadecimal digits.
pub(crate) fn hash_of(parts: impl AsRef<[u8]>) -> String {
    let hash = Sha256::digest(parts);
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn read_base(
    reader: &mut StudyReader,
    root: &PlacedValue,
    source: &StudySource,
    files: &mut Vec<PathBuf>,
) -> Option<CaseSource> {
    let missing = "missing: the base case, as in case = \"paper\" or case = \"mine.toml\"";
    let node = reader.needed(root, "", "case", missing)?;
    let name = reader.text(node, "case")?;
    let path = source.folder().join(&name);
    let found = if path.is_file() || Path::new(&name).extension().is_some() {
        files.push(path.clone());
        if path.is_file() && (is_hdf5(&path) || path.extension().is_some_and(|extension| extension == "h5")) {
            let resolved = open_sound(&path).and_then(|file| file.resolved());
            let resolved = reader.found(node, "case", resolved.map_err(|error| error.to_string()))?;
            return Some(CaseSource::result(&path, resolved));
        }
        CaseSource::file(&path)
    } else {
        CaseSource::built_in(&name)
    };
    let problems = |error: CaseError| {
        error
            .problems
            .iter()
            .for_each(|p| reader.report(node, "case", p.to_string()))
    };
    found.map_err(problems).ok()
}

/// Reads the leaves of `set`: tables, dotted keys, quoted paths, or a list of texts `KEY=VALUE`.
fn read_settings(
    reader: &mut StudyReader,
    known: &CaseKeys,
    node: &PlacedValue,
    path: &str,
    settings: &mut Vec<Override>,
) {
    let whole = || Override::of_node(path, node);
    match &node.value {
        CaseValue::Array(_) if path.is_empty() => {
            let read = reader.list(node, "set", |reader, element, path| {
                let text = reader.text(element, path)?;
                let parsed = Override::parse(&text).map_err(|error| error.problems[0].message.clone());
                reader.found(element, path, parsed.map(|setting| setting.at(element.place.clone())))
            });
            settings.extend(read.unwrap_or_default());
        }
        // A signal is set as a whole. The case finds errors inside it.
        _ if known.is_whole(path) && (node.at("profile").is_some() || matches!(node.value, CaseValue::Array(_))) => {
            settings.push(whole());
        }
        // Another law has other keys, so the table replaces the case's table, as with --set.
        CaseValue::Table(entries) if path == "friction" && entries.iter().any(|(name, _)| name == "law") => {
            settings.push(whole());
        }
        CaseValue::Table(entries) if entries.is_empty() && !path.is_empty() => {
            let within = |key: &&str| key.strip_prefix(path).is_some_and(|rest| rest.starts_with('.'));
            let is_known = known.slot(path).is_some() || known.known().iter().any(within);
            let message = match is_known {
                true => "an empty table sets nothing; write a value, or leave the key out".to_owned(),
                false => known.unknown(path),
            };
            reader.report(node, &format!("set.{path}"), message);
        }
        CaseValue::Table(entries) => {
            for (name, child) in entries {
                read_settings(reader, known, child, &join(path, &dotted(name)), settings);
            }
        }
        _ if path.is_empty() => {
            reader.expected::<()>(node, "set", "a table of keys and values");
        }
        _ => {
            let whole_array = matches!(node.value, CaseValue::Array(_));
            if known.slot(path).is_none() && !(whole_array && matches!(path, "perturbation" | "output.window")) {
                reader.report(node, &format!("set.{path}"), known.unknown(path));
            } else {
                settings.push(whole());
            }
        }
    }
}

/// Number of evenly spread points that are built before the first run. If none is valid, the study itself is wrong.
pub(crate) const PROBES: usize = 16;

/// Reports errors that all points share before anything is computed: the first problems of `cases`, if none is valid.
pub(crate) fn check_points(
    cases: impl Iterator<Item = Result<Case, CaseError>>,
    settings: &[Override],
    label: &str,
) -> Result<(), CaseError> {
    let mut first = None;
    for case in cases {
        match case {
            Ok(_) => return Ok(()),
            Err(error) => first = first.or(Some(error)),
        }
    }
    first.map_or(Ok(()), |error| Err(relabelled(error, settings, label)))
}

/// Moves problems of a point to the study's `[set]` line that sets the value, if there is one.
fn relabelled(error: CaseError, settings: &[Override], label: &str) -> CaseError {
    let problems = error.problems.into_iter().map(|problem| {
        let message = format!("no point of the study is a valid case: {}", problem.message);
        match (written(settings, &problem), problem.place.starts_with("--set ")) {
            (Some((place, key)), _) => CaseProblem {
                place: place.show(label),
                key,
                message,
            },
            (None, true) => CaseProblem {
                place: label.to_owned(),
                message,
                ..problem
            },
            (None, false) => CaseProblem { message, ..problem },
        }
    });
    CaseError {
        problems: problems.collect(),
    }
}

/// Place and key of the study's setting that caused a problem of its case, if one did.
pub(crate) fn written<'a>(settings: &'a [Override], problem: &CaseProblem) -> Option<(&'a TextPlace, String)> {
    let set = problem.place.strip_prefix("--set ")?;
    let setting = settings.iter().rev().find(|setting| setting.key() == set)?;
    Some((setting.origin()?, format!("set.{}", problem.key)))
}
