//! One name, one type: whoever searches for a name finds what it means.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Names that each crate has for itself.
const PER_CRATE: [&str; 3] = ["Error", "ErrorKind", "Options"];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The type that a line declares. Indented are associated types, variants, and what is local to a function.
fn declared(line: &str) -> Option<&str> {
    if line.starts_with(char::is_whitespace) {
        return None;
    }
    let mut words = line
        .split_whitespace()
        .skip_while(|word| word.starts_with("pub") || *word == "unsafe");
    matches!(words.next()?, "struct" | "enum" | "trait" | "type" | "union").then_some(())?;
    let name = words.next()?;
    Some(
        name.split(|letter: char| !letter.is_alphanumeric())
            .next()
            .unwrap_or(name),
    )
}

#[test]
fn property_the_name_of_a_type_is_unique() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&root.join("src"), &mut files);
    for folder in std::fs::read_dir(root.join("crates")).unwrap() {
        sources(&folder.unwrap().path().join("src"), &mut files);
    }
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for file in &files {
        let text = std::fs::read_to_string(file).unwrap();
        let place = file.strip_prefix(root).unwrap().display().to_string();
        for name in text.lines().filter_map(declared) {
            places.entry(name.to_owned()).or_default().push(place.clone());
        }
    }
    assert!(places.len() > 500, "{} types: the search finds none", places.len());
    let doubled: Vec<_> = places
        .iter()
        .filter(|(name, places)| places.len() > 1 && !PER_CRATE.contains(&name.as_str()))
        .map(|(name, places)| format!("{name}: {}", places.join(", ")))
        .collect();
    assert!(doubled.is_empty(), "types of one name:\n{}", doubled.join("\n"));
}
