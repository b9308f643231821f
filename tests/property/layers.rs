//! The layers of the program, read from its own text: each module knows only those above it in the table of `src/lib.rs`,
//! and inside a folder no files know each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use syn::visit::{self, Visit};

/// A module by the names that lead to it.
type Module = Vec<String>;

/// The text of every module below `src/`, but for those that only tests have.
fn modules() -> BTreeMap<Module, PathBuf> {
    fn walk(folder: &Path, at: &Module, found: &mut BTreeMap<Module, PathBuf>) {
        let parent = fs::read_to_string(folder.join("mod.rs")).unwrap_or_default();
        let for_tests = |stem: &str| parent.contains(&format!("#[cfg(test)]\nmod {stem};"));
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
            let inner: Module = at.iter().cloned().chain([stem.clone()]).collect();
            if for_tests(&stem) {
                continue;
            }
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
    /// Those of `use`.
    used: Vec<Vec<String>>,
}

impl Paths {
    fn of(file: &Path) -> Paths {
        let mut paths = Paths::default();
        paths.visit_file(&syn::parse_file(&fs::read_to_string(file).unwrap()).unwrap());
        paths
    }

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
        let before = self.found.len();
        self.spell_out(&item.tree, Vec::new());
        self.used.extend_from_slice(&self.found[before..]);
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

/// The modules, and what each of them brings in by `use` under a name that others may take from it.
struct Crate {
    modules: BTreeMap<Module, PathBuf>,
    brought: BTreeMap<(Module, String), Vec<String>>,
}

impl Crate {
    fn read() -> Crate {
        let modules = modules();
        let mut brought = BTreeMap::new();
        for (module, file) in &modules {
            for path in Paths::of(file).used {
                brought.insert((module.clone(), path.last().unwrap().clone()), path);
            }
        }
        Crate { modules, brought }
    }

    /// Where what a path of `me` names is defined, if that is in a module of the crate.
    fn home(&self, me: &Module, path: &[String], depth: usize) -> Option<Module> {
        let at = target(&self.modules, me, path)?;
        let next = path
            .iter()
            .skip_while(|name| ["crate", "self", "super"].contains(&name.as_str()));
        let next = next.cloned().collect::<Vec<_>>();
        // The first name behind those of modules.
        let inside = next.iter().find(|name| !at.contains(*name)).cloned();
        let further = inside.and_then(|name| self.brought.get(&(at.clone(), name)));
        match further {
            Some(path) if depth > 0 => self.home(&at, path, depth - 1).or(Some(at)),
            _ => Some(at),
        }
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

/// Which modules each knows, as the paths name them.
fn knowledge() -> BTreeMap<Module, BTreeSet<Module>> {
    let modules = modules();
    knowledge_by(&modules, |me, path| target(&modules, me, path))
}

/// Which modules each knows: those in which what it names is defined, whichever module hands it on.
fn knowledge_of_homes() -> BTreeMap<Module, BTreeSet<Module>> {
    let all = Crate::read();
    knowledge_by(&all.modules, |me, path| all.home(me, path, 8))
}

fn knowledge_by(
    modules: &BTreeMap<Module, PathBuf>,
    leads_to: impl Fn(&Module, &[String]) -> Option<Module>,
) -> BTreeMap<Module, BTreeSet<Module>> {
    let of = |(me, file): (&Module, &PathBuf)| {
        let paths = Paths::of(file).found;
        let known = paths.iter().filter_map(|path| leads_to(me, path));
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

/// Folders whose files still know each other in a circle.
const CIRCLES: [&str; 4] = ["case", "compare", "hybrid", "plot"];

/// A folder is one with all that is below it, and what its `mod.rs` hands on belongs to the file that defines it.
#[test]
fn property_no_members_of_a_folder_know_each_other_in_a_circle() {
    let knowledge = knowledge_of_homes();
    // Of each folder, which of its members each of them knows.
    let mut folders: BTreeMap<Module, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for (module, known) in &knowledge {
        for other in known {
            let common = module.iter().zip(other).take_while(|(a, b)| a == b).count();
            if let (true, Some(one), Some(two)) = (common > 0, module.get(common), other.get(common)) {
                let members = folders.entry(module[..common].to_vec()).or_default();
                members.entry(one.clone()).or_default().insert(two.clone());
            }
        }
    }
    let mut circles: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (folder, members) in &folders {
        for start in members.keys() {
            // What is known from here on, and by whom.
            let mut from: BTreeMap<&String, &String> = BTreeMap::new();
            let mut open = vec![start];
            while let Some(member) = open.pop() {
                for other in members.get(member).into_iter().flatten() {
                    if other == start {
                        let mut circle = vec![member.as_str()];
                        let mut at = member;
                        while at != start {
                            at = from[at];
                            circle.push(at);
                        }
                        circle.sort_unstable();
                        circles.entry(folder.join("::")).or_default().insert(circle.join(", "));
                    } else if !from.contains_key(other) {
                        from.insert(other, member);
                        open.push(other);
                    }
                }
            }
        }
    }
    let found: Vec<&String> = circles.keys().collect();
    assert_eq!(found, CIRCLES, "{circles:#?}");
}

/// What one room alone knows, and the rooms that may name it: which friction
/// law it is, and which profile a signal is.
#[test]
fn property_what_stays_in_a_room_is_named_nowhere_else() {
    let (laws, profiles): (&[&str], &[&str]) = (&["friction", "case", "oracle"], &["signal", "case", "oracle"]);
    let rooms: [(&str, &[&str]); 15] = [
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
        let paths: Vec<String> = Paths::of(&file).found.iter().map(|path| path.join("::")).collect();
        for (name, _) in rooms.iter().filter(|(_, rooms)| !rooms.contains(&module[0].as_str())) {
            if paths.iter().any(|path| path.contains(name)) {
                wrong.push(format!("{} names {name}", module.join("::")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A name is followed to where it is defined.
#[test]
fn property_what_a_folder_hands_on_is_found_where_it_is_defined() {
    let all = Crate::read();
    let names = |names: &str| names.split("::").map(str::to_owned).collect::<Vec<_>>();
    for (me, path, home) in [
        ("results::check", "super::ResultFile", "results::reader"),
        ("results::check", "super::source::Holds", "results::source::protocol"),
        ("plot::run", "crate::results::Status", "results::header"),
    ] {
        assert_eq!(all.home(&names(me), &names(path), 8), Some(names(home)), "{path}");
    }
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

/// Names of modules, types and variants, as they are defined.
#[derive(Default)]
struct Names(Vec<String>);

impl<'ast> Visit<'ast> for Names {
    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        self.0.push(item.ident.to_string());
    }

    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        self.0.push(item.ident.to_string());
        self.0
            .extend(item.variants.iter().map(|variant| variant.ident.to_string()));
    }

    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        self.0.push(item.ident.to_string());
    }

    fn visit_item_type(&mut self, item: &'ast syn::ItemType) {
        self.0.push(item.ident.to_string());
    }
}

/// Below the reader of cases nothing is named for one of the two forms of a case: there is one kind of system. One of its two chains
/// may be called a train.
#[test]
fn property_no_form_of_a_case_has_a_name_below_its_reader() {
    let mut names = Names::default();
    for (module, path) in modules() {
        if module.first().is_some_and(|first| first == "case") {
            continue;
        }
        names.0.extend(module);
        names.visit_file(&syn::parse_file(&fs::read_to_string(path).unwrap()).unwrap());
    }
    assert!(names.0.len() > 1000, "{} names", names.0.len());
    let of_a_form = |name: &&String| {
        let name = name.to_lowercase();
        name.contains("brake") || name.contains("train") && !name.contains("constraint") && name != "train"
    };
    let found: Vec<&String> = names.0.iter().filter(of_a_form).collect();
    assert!(found.is_empty(), "{found:?}");
}
