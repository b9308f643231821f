//! The layers of the program, read from its own text: each module knows only those above it in the table of `src/lib.rs`,
//! and inside a folder no files know each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use syn::visit::{self, Visit};

/// A module by the names that lead to it.
type Module = Vec<String>;

/// The text of every module below `src/`.
fn modules() -> BTreeMap<Module, PathBuf> {
    fn walk(folder: &Path, at: &Module, found: &mut BTreeMap<Module, PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let inner: Module = at.iter().cloned().chain([stem.clone()]).collect();
            if path.is_dir() {
                walk(&path, &inner, found);
            } else if stem == "mod" {
                found.insert(at.clone(), path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.insert(inner, path);
            }
        }
    }
    let mut found = BTreeMap::new();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    walk(&source, &Module::new(), &mut found);
    // The crate's own two.
    found.remove(&vec!["lib".to_owned()]);
    found.remove(&vec!["main".to_owned()]);
    found
}

/// Every path that a file names, as it stands there; `use` trees spelt out. Tests are left out.
#[derive(Default)]
struct Paths {
    found: Vec<Vec<String>>,
}

impl Paths {
    fn spell_out(&mut self, tree: &syn::UseTree, mut at: Vec<String>) {
        match tree {
            syn::UseTree::Path(path) => {
                at.push(path.ident.to_string());
                self.spell_out(&path.tree, at);
            }
            syn::UseTree::Name(name) => {
                at.push(name.ident.to_string());
                self.found.push(at);
            }
            syn::UseTree::Rename(name) => {
                at.push(name.ident.to_string());
                self.found.push(at);
            }
            syn::UseTree::Glob(_) => self.found.push(at),
            syn::UseTree::Group(group) => {
                for tree in &group.items {
                    self.spell_out(tree, at.clone());
                }
            }
        }
    }
}

fn of_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && matches!(&attribute.meta, syn::Meta::List(list) if list.tokens.to_string() == "test")
    })
}

impl<'a> Visit<'a> for Paths {
    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        self.spell_out(&item.tree, Vec::new());
    }

    fn visit_item_mod(&mut self, item: &'a syn::ItemMod) {
        if !of_tests(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        self.found
            .push(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }
}

/// The deepest module that a path of `me` leads to, if it is one of the crate's.
fn target(modules: &BTreeMap<Module, PathBuf>, me: &Module, path: &[String]) -> Option<Module> {
    let (mut at, mut rest) = match path.first()?.as_str() {
        "crate" => (Module::new(), &path[1..]),
        "self" => (me.clone(), &path[1..]),
        "super" => (me.clone(), path),
        first => {
            let child: Module = me.iter().cloned().chain([first.to_owned()]).collect();
            if !modules.contains_key(&child) {
                return None;
            }
            (me.clone(), path)
        }
    };
    while rest.first().is_some_and(|name| name == "super") {
        at.pop();
        rest = &rest[1..];
    }
    for name in rest {
        at.push(name.clone());
        if !modules.contains_key(&at) {
            at.pop();
            break;
        }
    }
    (!at.is_empty()).then_some(at)
}

/// Every path that the file names.
fn paths_in(file: &Path) -> Vec<Vec<String>> {
    let mut paths = Paths::default();
    paths.visit_file(&syn::parse_file(&fs::read_to_string(file).unwrap()).unwrap());
    paths.found
}

/// Which modules each knows.
fn knowledge() -> BTreeMap<Module, BTreeSet<Module>> {
    let modules = modules();
    let of = |(me, file): (&Module, &PathBuf)| {
        let paths = paths_in(file);
        let known = paths.iter().filter_map(|path| target(&modules, me, path));
        (me.clone(), known.filter(|other| other != me).collect())
    };
    modules.iter().map(of).collect()
}

/// The table of layers in `src/lib.rs`, in its order.
fn layers() -> Vec<String> {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap();
    text.lines()
        .filter_map(|line| line.strip_prefix("//! | "))
        .filter_map(|row| {
            let name = row.trim_start_matches('[').strip_prefix('`')?;
            Some(name.split('`').next()?.to_owned())
        })
        .collect()
}

#[test]
fn property_each_layer_knows_only_those_above_it() {
    let layers = layers();
    let knowledge = knowledge();
    let top: BTreeSet<&String> = knowledge.keys().map(|module| &module[0]).collect();
    assert_eq!(top, layers.iter().collect(), "the table of layers in src/lib.rs");
    let place = |name: &String| layers.iter().position(|layer| layer == name).unwrap();
    let mut wrong = Vec::new();
    for (module, known) in &knowledge {
        for other in known.iter().filter(|other| place(&other[0]) > place(&module[0])) {
            wrong.push(format!("{} knows {}", module.join("::"), other.join("::")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A folder's `mod.rs` and the files below it are one: the front says what is inside.
#[test]
fn property_no_files_know_each_other_in_a_circle() {
    let knowledge = knowledge();
    let within = |a: &Module, b: &Module| a.starts_with(b) || b.starts_with(a);
    let known = |module: &Module| -> Vec<Module> {
        let others = knowledge[module].iter();
        others.filter(|other| !within(module, other)).cloned().collect()
    };
    let mut circles = BTreeSet::new();
    for start in knowledge.keys() {
        // What is known from here on, and by whom.
        let mut from: BTreeMap<Module, Module> = BTreeMap::new();
        let mut open = vec![start.clone()];
        while let Some(module) = open.pop() {
            for other in known(&module) {
                if other == *start {
                    let mut circle = vec![module.join("::")];
                    let mut at = &module;
                    while at != start {
                        at = &from[at];
                        circle.push(at.join("::"));
                    }
                    circle.sort();
                    circles.insert(circle.join(", "));
                } else if !from.contains_key(&other) {
                    from.insert(other.clone(), module.clone());
                    open.push(other);
                }
            }
        }
    }
    assert!(
        circles.is_empty(),
        "{}",
        circles.into_iter().collect::<Vec<_>>().join("\n")
    );
}

/// What one room alone knows, and the rooms that may name it: the places of the state's components, which friction
/// law it is, and which profile a signal is.
#[test]
fn property_what_stays_in_a_room_is_named_nowhere_else() {
    let (laws, profiles): (&[&str], &[&str]) = (&["friction", "case", "oracle"], &["signal", "case", "oracle"]);
    let rooms: [(&str, &[&str]); 16] = [
        ("state::index", &["model"]),
        ("FrictionLaw::Coulomb", laws),
        ("FrictionLaw::Exponential", laws),
        ("FrictionLaw::Hyperbolic", laws),
        ("FrictionLaw::Polynomial", laws),
        ("FrictionLaw::Stribeck", laws),
        ("FrictionLaw::Table", laws),
        ("friction::Coulomb", laws),
        ("friction::Hyperbolic", laws),
        ("friction::Polynomial", laws),
        ("friction::Stribeck", laws),
        ("friction::Table", laws),
        ("Signal::Ramp", profiles),
        ("Signal::Table", profiles),
        ("signal::Ramp", profiles),
        ("signal::Table", profiles),
    ];
    let mut wrong = Vec::new();
    for (module, file) in modules() {
        let paths: Vec<String> = paths_in(&file).iter().map(|path| path.join("::")).collect();
        for (name, _) in rooms.iter().filter(|(_, rooms)| !rooms.contains(&module[0].as_str())) {
            if paths.iter().any(|path| path.contains(name)) {
                wrong.push(format!("{} names {name}", module.join("::")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The reader above finds what there is to find.
#[test]
fn analytic_paths_are_found_where_they_stand() {
    let text = "use crate::a::{b::C, d}; mod inner { fn f() { super::super::e::g(); } } #[cfg(test)] mod tests { use crate::h; }";
    let mut paths = Paths::default();
    paths.visit_file(&syn::parse_file(text).unwrap());
    let found: Vec<String> = paths.found.iter().map(|path| path.join("::")).collect();
    for path in ["crate::a::b::C", "crate::a::d", "super::super::e::g"] {
        assert!(found.iter().any(|other| other == path), "{path} of {found:?}");
    }
    assert!(!found.iter().any(|path| path == "crate::h"));
}
