//! Columns of LS-DYNA's binary histories (binout0000, binout0001, ...).
//!
//! A file of LSTC's LSDA library: eight bytes that say how wide its integers are and in which order their bytes stand, then
//! records of a length, a command and contents. Tables of symbols, each of which says where the next one is, list the variables
//! of each folder: `/nodout/metadata/ids`, `/nodout/d000001/time`, `/nodout/d000001/rz_velocity`, a folder for each state. Several files
//! of one run, as parallel runs and long ones write, are one tree.

use super::super::CompareError;
use super::absent;
use super::source::{Binary, Source};
use super::table::{BLOCK, Pass, Table};
use crate::quote::shown;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};

const CD: u64 = 2;
const DATA: u64 = 3;
const VARIABLE: u64 = 4;
const BEGIN_TABLE: u64 = 5;
const END_TABLE: u64 = 6;
const TABLE_OFFSET: u64 = 7;

/// A path is no longer, bytes.
const LONGEST_PATH: u64 = 4096;
/// Variables of all states.
const MOST_VARIABLES: usize = 10_000_000;
/// Files of one run.
const MOST_FILES: usize = 1000;
/// Members of a database.
const MOST_MEMBERS: u64 = 1_000_000;
/// Columns that a list of them has.
const LISTED: usize = 1000;

/// How a file stores its records.
#[derive(Debug, Clone, Copy)]
struct Layout {
    header: u64,
    length: usize,
    offset: usize,
    command: usize,
    kind: usize,
    little: bool,
}

impl Layout {
    /// By the first bytes of a file; `None` if they are not those of an LSDA file.
    fn of(head: &[u8]) -> Option<Layout> {
        let &[header, length, offset, command, kind, little, format, _, ..] = head else {
            return None;
        };
        let is_width = |width: u8| matches!(width, 1 | 2 | 4 | 8);
        let sound = (8..=64).contains(&header)
            && [length, offset, command, kind].into_iter().all(is_width)
            && length >= 4
            && offset >= 4
            && little <= 1
            && format == 0;
        let layout = Layout {
            header: u64::from(header),
            length: usize::from(length),
            offset: usize::from(offset),
            command: usize::from(command),
            kind: usize::from(kind),
            little: little == 1,
        };
        let first = head.get(usize::from(header)..)?;
        let command = first.get(layout.length..layout.length + layout.command)?;
        (sound && layout.integer(command) == TABLE_OFFSET).then_some(layout)
    }

    fn integer(self, bytes: &[u8]) -> u64 {
        let add = |sum: u64, byte: &u8| (sum << 8) | u64::from(*byte);
        if self.little {
            bytes.iter().rev().fold(0, add)
        } else {
            bytes.iter().fold(0, add)
        }
    }

    fn start(self) -> usize {
        self.length + self.command
    }
}

/// Whether a file begins as one of the LSDA library does.
pub(super) fn is_binout(head: &[u8]) -> bool {
    Layout::of(head).is_some()
}

/// A variable of one state.
#[derive(Debug, Clone, Copy)]
struct Entry {
    file: u32,
    /// Type by its number.
    kind: u8,
    /// Of its record, bytes.
    offset: u64,
    length: u64,
}

/// Bytes of an element.
fn width(kind: u8) -> Option<usize> {
    match kind {
        1 | 5 => Some(1),
        2 | 6 => Some(2),
        3 | 7 | 9 => Some(4),
        4 | 8 | 10 => Some(8),
        _ => None,
    }
}

/// A database of a run, such as nodout.
#[derive(Debug, Default)]
struct Branch {
    /// Of each variable the states by their numbers.
    variables: BTreeMap<String, BTreeMap<u32, Entry>>,
    /// Numbers of its members.
    ids: Option<Entry>,
    members: Vec<i64>,
}

#[derive(Debug)]
struct LsdaFile {
    file: Binary,
    layout: Layout,
}

impl LsdaFile {
    /// Where the values of a variable begin, whose record has to be the one that the table of symbols says.
    fn values(&self, entry: &Entry, name: &str) -> Result<u64, CompareError> {
        let l = self.layout;
        let mut head = vec![0; l.start() + l.kind + 1 + name.len()];
        self.file.read(entry.offset, &mut head)?;
        let command = l.integer(&head[l.length..l.start()]);
        let kind = l.integer(&head[l.start()..l.start() + l.kind]);
        let (named, rest) = (head[l.start() + l.kind], &head[l.start() + l.kind + 1..]);
        let is_named = usize::from(named) == name.len() && rest == name.as_bytes();
        if command == DATA && kind == u64::from(entry.kind) && is_named {
            return Ok(entry.offset + head.len() as u64);
        }
        let name = shown(name);
        let what = format!("there is no record of {name}, which the table of symbols places there");
        Err(self.file.damaged(entry.offset, what))
    }

    fn numbers(&self, entry: &Entry, name: &str, from: u64, count: usize) -> Result<Vec<f64>, CompareError> {
        let Some(width) = width(entry.kind) else {
            let what = format!("{} is of the unknown type {}", shown(name), entry.kind);
            return Err(self.file.damaged(entry.offset, what));
        };
        let start = self.values(entry, name)?;
        let mut bytes = vec![0; count * width];
        let skipped = from.saturating_mul(width as u64);
        self.file.read(start.saturating_add(skipped), &mut bytes)?;
        let value = |raw: &[u8]| {
            let whole = self.layout.integer(raw);
            let bits = 64 - 8 * width as u32;
            match entry.kind {
                10 => f64::from_bits(whole),
                9 => f64::from(f32::from_bits(whole as u32)),
                // The sign is extended from the highest byte that is there.
                1..=4 => ((whole << bits) as i64 >> bits) as f64,
                _ => whole as f64,
            }
        };
        Ok(bytes.chunks_exact(width).map(value).collect())
    }
}

/// The histories of a run of LS-DYNA.
#[derive(Debug)]
pub(super) struct BinoutTable {
    path: PathBuf,
    files: Vec<LsdaFile>,
    branches: BTreeMap<String, Branch>,
}

/// One element of a variable in all states.
struct Series<'a> {
    branch: &'a str,
    variable: &'a str,
    element: u64,
    states: &'a BTreeMap<u32, Entry>,
}

impl Series<'_> {
    fn path(&self) -> String {
        format!("{}/{}", self.branch, self.variable)
    }
}

impl BinoutTable {
    /// Opens a file and the others of its run, and reads their tables of symbols.
    ///
    /// # Errors
    /// A damaged file, or one without a state.
    pub fn open(source: &Source) -> Result<BinoutTable, CompareError> {
        let mut table = BinoutTable {
            path: source.path().to_owned(),
            files: Vec::new(),
            branches: BTreeMap::new(),
        };
        let mut count = 0;
        table.add(source, &mut count)?;
        let others = match source.is_piped() {
            true => Vec::new(),
            false => others(source.path()),
        };
        for path in others {
            let other = Source::open(&path)?;
            if is_binout(&other.head(512)?) {
                table.add(&other, &mut count)?;
            }
        }
        table.branches.retain(|_, branch| branch.variables.contains_key("time"));
        if table.branches.is_empty() {
            let what = "holds no history: no folder of a state has a time";
            let remedy = "write one with *DATABASE_NODOUT, *DATABASE_RCFORC or *DATABASE_RBDOUT";
            return Err(CompareError::whole(&table.path, what, remedy));
        }
        for branch in table.branches.values_mut() {
            if let Some(entry) = branch.ids.filter(|entry| entry.length <= MOST_MEMBERS) {
                let file = &table.files[entry.file as usize];
                let ids = file.numbers(&entry, "ids", 0, entry.length as usize)?;
                branch.members = ids.into_iter().map(|id| id as i64).collect();
            }
        }
        Ok(table)
    }

    fn add(&mut self, source: &Source, count: &mut usize) -> Result<(), CompareError> {
        let file = Binary::open(source)?;
        let layout = Layout::of(&source.head(512)?).ok_or_else(|| file.damaged(0, "is no LSDA file"))?;
        let at = layout.header + layout.start() as u64;
        let mut offset = vec![0; layout.offset];
        file.read(at, &mut offset)?;
        let file = LsdaFile { file, layout };
        let mut table = layout.integer(&offset);
        let mut before = at;
        while table != 0 {
            // Each part was written after the one before it.
            if table <= before {
                let what = format!("the next table of symbols is to be at byte {table}");
                return Err(file.file.damaged(before, what));
            }
            before = table;
            table = self.symbols(&file, table, count)?;
        }
        self.files.push(file);
        Ok(())
    }

    /// Reads a part of the table of symbols and returns where the next one is, 0 after the last.
    fn symbols(
        &mut self,
        LsdaFile { file, layout: l }: &LsdaFile,
        mut at: u64,
        count: &mut usize,
    ) -> Result<u64, CompareError> {
        let mut reader = file.reader(at);
        let mut folder: Vec<String> = Vec::new();
        let mut begun = false;
        loop {
            let mut read = |bytes: usize| {
                let mut contents = vec![0; bytes];
                let done = reader.read_exact(&mut contents);
                done.map(|()| contents).map_err(CompareError::io(&file.path))
            };
            let start = l.start() as u64;
            if at.checked_add(start).is_none_or(|end| end > file.length) {
                return Err(file.damaged(at, "the table of symbols ends with the file"));
            }
            let head = read(l.start())?;
            let (length, command) = (l.integer(&head[..l.length]), l.integer(&head[l.length..]));
            let contents = length.saturating_sub(start);
            if !begun {
                if command != BEGIN_TABLE {
                    return Err(file.damaged(at, "no table of symbols begins there"));
                }
                begun = true;
                at += start;
                continue;
            }
            let longest = LONGEST_PATH + (l.kind + l.offset + l.length) as u64;
            if contents > longest || length < start || length > file.length - at {
                return Err(file.damaged(at, format!("a symbol of {length} bytes")));
            }
            let bytes = read(contents as usize)?;
            match command {
                CD => change(&mut folder, &String::from_utf8_lossy(&bytes)),
                VARIABLE => {
                    let Some(named) = bytes.len().checked_sub(l.kind + l.offset + l.length) else {
                        return Err(file.damaged(at, "a symbol without a place"));
                    };
                    let (name, rest) = bytes.split_at(named);
                    let (kind, rest) = rest.split_at(l.kind);
                    let (offset, elements) = rest.split_at(l.offset);
                    *count += 1;
                    if *count > MOST_VARIABLES {
                        let what = format!("more than {MOST_VARIABLES} variables of states");
                        let remedy = "write fewer states, or fewer databases";
                        return Err(CompareError::whole(&file.path, what, remedy));
                    }
                    let entry = Entry {
                        file: self.files.len() as u32,
                        kind: l.integer(kind).min(255) as u8,
                        offset: l.integer(offset),
                        length: l.integer(elements),
                    };
                    self.symbol(&folder, &String::from_utf8_lossy(name), entry);
                }
                END_TABLE if bytes.len() >= l.offset => return Ok(l.integer(&bytes[..l.offset])),
                _ => return Err(file.damaged(at, format!("a record of command {command} in a table of symbols"))),
            }
            at += length;
        }
    }

    fn symbol(&mut self, folder: &[String], name: &str, entry: Entry) {
        let Some((last, branch)) = folder.split_last() else {
            return;
        };
        if last == "metadata" {
            if name == "ids" {
                self.branches.entry(branch.join("/")).or_default().ids = Some(entry);
            }
        } else if let Some(state) = last.strip_prefix('d').and_then(|digits| digits.parse::<u32>().ok())
            && width(entry.kind).is_some()
        {
            let branch = self.branches.entry(branch.join("/")).or_default();
            branch
                .variables
                .entry(name.to_owned())
                .or_default()
                .insert(state, entry);
        }
    }

    /// What a name means: `nodout/17/rz_velocity`, `17/rz_velocity`, `rz_velocity[0]`, `glstat/kinetic_energy`.
    fn find(&self, name: &str) -> Result<Series<'_>, String> {
        let lower = name.trim_matches('/').to_lowercase();
        let indexed = lower.strip_suffix(']').and_then(|start| start.split_once('['));
        let (path, index) = match indexed.map(|(path, index)| (path, index.trim().parse::<u64>())) {
            Some((path, Ok(index))) => (path, Some(index)),
            _ => (lower.as_str(), None),
        };
        let (start, variable) = path.rsplit_once('/').unwrap_or(("", path));
        let (start, id) = match start.rsplit_once('/').unwrap_or(("", start)) {
            (before, last) if index.is_none() => match last.parse::<i64>() {
                Ok(id) => (before, Some(id)),
                Err(_) => (start, None),
            },
            _ => (start, None),
        };
        let mut found: Option<Series<'_>> = None;
        let mut why = format!("has no column \"{}\"", shown(name));
        for (branch, contents) in &self.branches {
            let is_end = |whole: &str| {
                start.is_empty() || whole == start || whole.strip_suffix(start).is_some_and(|rest| rest.ends_with('/'))
            };
            let Some((variable, states)) = contents.variables.get_key_value(variable) else {
                continue;
            };
            if !is_end(&branch.to_lowercase()) {
                continue;
            }
            let elements = states.values().next().map_or(0, |entry| entry.length);
            let element = match (index, id) {
                (Some(index), _) => (index < elements).then_some(index),
                (None, Some(id)) => {
                    let place = contents.members.iter().position(|&member| member == id);
                    place.map(|place| place as u64).filter(|&place| place < elements)
                }
                (None, None) => (elements == 1).then_some(0),
            };
            let Some(element) = element else {
                let ids: Vec<String> = contents.members.iter().take(5).map(i64::to_string).collect();
                why = format!(
                    "\"{}\" is of {elements} members{}{}: name one, as {branch}/ID/{variable}, or as {branch}/{variable}[0]",
                    shown(name),
                    if ids.is_empty() { "" } else { ", " },
                    ids.join(", ")
                );
                continue;
            };
            if found.is_some() {
                return Err(format!("several columns are called \"{}\"", shown(name)));
            }
            found = Some(Series {
                branch,
                variable,
                element,
                states,
            });
        }
        found.ok_or(why)
    }

    fn series(&self, name: &str) -> Result<Series<'_>, CompareError> {
        self.find(name).map_err(|_| absent(self, name))
    }
}

/// The other files of a run: binout0001 beside binout0000, and what continues them, binout0000%001.
fn others(path: &Path) -> Vec<PathBuf> {
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
        return Vec::new();
    };
    let name = name.split('%').next().unwrap_or(name);
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let numbered = name.len() - stem.len() == 4;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let Ok(entries) = std::fs::read_dir(folder.unwrap_or(Path::new("."))) else {
        return Vec::new();
    };
    let of_run = |other: &str| {
        let (first, continued) = other.split_once('%').unwrap_or((other, "0"));
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let same =
            first == name || numbered && first.len() == name.len() && first.strip_prefix(stem).is_some_and(digits);
        same && digits(continued)
    };
    let found = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let found: BTreeSet<String> = found.filter(|other| of_run(other)).collect();
    let own = path.file_name();
    let paths = found.into_iter().map(|other| path.with_file_name(other));
    paths
        .filter(|other| other.file_name() != own && other.is_file())
        .take(MOST_FILES)
        .collect()
}

/// Changes a folder by a path, absolute or relative.
fn change(folder: &mut Vec<String>, path: &str) {
    if path.starts_with('/') {
        folder.clear();
    }
    for part in path.split('/').filter(|part| !part.is_empty() && *part != ".") {
        if part == ".." {
            folder.pop();
        } else if folder.len() < 64 {
            folder.push(part.to_owned());
        }
    }
}

impl Table for BinoutTable {
    fn path(&self) -> &Path {
        &self.path
    }

    fn names(&self) -> Vec<String> {
        let of_branch = |(branch, contents): (&String, &Branch)| {
            let name = |(variable, states): (&String, &BTreeMap<u32, Entry>)| {
                let elements = states.values().next().map_or(0, |entry| entry.length);
                match (elements, contents.members.first()) {
                    (1, _) => format!("{branch}/{variable}"),
                    (_, Some(id)) => format!("{branch}/{id}/{variable}"),
                    (_, None) => format!("{branch}/{variable}[0]"),
                }
            };
            contents.variables.iter().map(name).collect::<Vec<_>>()
        };
        self.branches.iter().flat_map(of_branch).take(LISTED).collect()
    }

    fn has(&self, name: &str) -> bool {
        self.find(name).is_ok()
    }

    fn recognises(&self, _: &str) -> bool {
        false
    }

    fn time_beside(&self, column: &str) -> Option<String> {
        let series = self.find(column).ok()?;
        Some(format!("{}/time", series.branch))
    }

    fn why_not(&self, name: &str) -> Option<String> {
        self.find(name).err().filter(|why| !why.starts_with("has no"))
    }

    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError> {
        let found: Vec<Series<'_>> = columns.iter().map(|name| self.series(name)).collect::<Result<_, _>>()?;
        let first = &found[0];
        for series in &found {
            if first.states.keys().ne(series.states.keys()) {
                let (own, other) = (series.states.len(), first.states.len());
                let what = format!(
                    "{} is there in {own} states, {} in {other}",
                    series.path(),
                    first.path()
                );
                return Err(CompareError::whole(&self.path, what, ONE_DATABASE));
            }
            if series.branch != first.path().trim_end_matches("/time") {
                self.same_times(first, series.branch)?;
            }
        }
        let states = found.iter().map(|series| series.states.iter().collect::<Vec<_>>());
        let states: Vec<Vec<(&u32, &Entry)>> = states.collect();
        let mut row = 0;
        Ok(Box::new(move |columns| {
            let rows = row..states[0].len().min(row + BLOCK);
            row = rows.end;
            for ((series, states), column) in found.iter().zip(&states).zip(columns) {
                column.clear();
                for (state, entry) in &states[rows.clone()] {
                    let file = &self.files[entry.file as usize];
                    if series.element >= entry.length {
                        let what = format!("{} has {} elements in state {state}", series.path(), entry.length);
                        return Err(file.file.damaged(entry.offset, what));
                    }
                    column.extend(file.numbers(entry, series.variable, series.element, 1)?);
                }
            }
            Ok(())
        }))
    }

    fn place(&self, row: u64, column: &str) -> String {
        let Ok(series) = self.find(column) else {
            return format!("state {}", row + 1);
        };
        let state = series.states.keys().nth(usize::try_from(row).unwrap_or(usize::MAX));
        format!(
            "{}/d{:06}/{}",
            series.branch,
            state.copied().unwrap_or(0),
            series.variable
        )
    }
}

const ONE_DATABASE: &str = "take the channels from one database, or write all at the same interval";

impl BinoutTable {
    /// That a database has the times of another one.
    fn same_times(&self, time: &Series<'_>, branch: &str) -> Result<(), CompareError> {
        let other = self.series(&format!("{branch}/time"))?;
        for ((state, own), entry) in time.states.iter().zip(other.states.values()) {
            let of = |entry: &Entry, name: &str| self.files[entry.file as usize].numbers(entry, name, 0, 1);
            if of(own, time.variable)? != of(entry, "time")? {
                let what = format!("{} and {branch}/time differ in state {state}", time.path());
                return Err(CompareError::whole(&self.path, what, ONE_DATABASE));
            }
        }
        Ok(())
    }
}
