//! Columns of the time histories of OpenRadioss (T01, T02, ...).
//!
//! A sequence of Fortran records, each between two copies of its length, of 32-bit numbers, all big-endian: two titles, since
//! version 5 the lengths of titles and the units, counts, the variables of parts, materials, properties, subsets and
//! groups (`/TH/NODE`, `/TH/INTER`, ...), then for each state the time, the global variables, those of parts, of
//! subsets and of each group. Variables have numbers, whose names are those of the manual of `/TH`.
//!
//! The forces and moments of interfaces, rigid walls, rigid bodies and sections are stored as impulses, integrals since the start of the run.

use super::super::CompareError;
use super::named::Names;
use super::source::{Place, Source};
use super::table::{BLOCK, Pass, Table};
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// A record in front of the states is no longer, bytes.
const LONGEST_RECORD: u64 = 16 << 20;
/// Columns of a file.
const MOST_COLUMNS: usize = 500_000;
/// Bytes of states that are read at once, at least one state.
const MOST_READ: usize = 4 << 20;
/// Records between the titles and the counts.
const MOST_ADDITIONAL: i32 = 16;

const REMEDY: &str = "it was cut off, or damaged on its way: copy it again as a binary file";

const GLOBAL: [&str; 22] = [
    "IE", "KE", "XMOM", "YMOM", "ZMOM", "MASS", "DT", "RKE", "EFW", "SIE", "CE", "HE", "CE_ELAST", "CE_FRIC",
    "CE_DAMP", "WPLA", "DMASS", "DMASS%", "M_IN", "M_OUT", "E_IN", "E_OUT",
];
const PART: [&str; 32] = [
    "IE", "KE", "XMOM", "YMOM", "ZMOM", "MASS", "HE", "TURBKE", "XCG", "YCG", "ZCG", "XXMOM", "YYMOM", "ZZMOM", "IXX",
    "IYY", "IZZ", "IXY", "IYZ", "IZX", "RIE", "KERB", "RKERB", "RKE", "ERODED", "VAR26", "VAR27", "HEAT", "VX", "VY",
    "VZ", "PW",
];
const NODE: [&str; 19] = [
    "DX", "DY", "DZ", "VX", "VY", "VZ", "AX", "AY", "AZ", "VRX", "VRY", "VRZ", "ARX", "ARY", "ARZ", "X", "Y", "Z",
    "TEMP",
];
/// Those of nodes that come after 600 of plies.
const NODE_MORE: [&str; 10] = [
    "REACX", "REACY", "REACZ", "REACXX", "REACYY", "REACZZ", "DRX", "DRY", "DRZ", "PEXT",
];
const BEFORE_MORE: i32 = 619;
const SPRING: [&str; 16] = [
    "OFF", "FX", "FY", "FZ", "MX", "MY", "MZ", "LX", "LY", "LZ", "RX", "RY", "RZ", "IE", "F1", "F2",
];
const INTERFACE: [&str; 29] = [
    "FNX", "FNY", "FNZ", "FTX", "FTY", "FTZ", "SFW", "|FNX|", "|FNY|", "|FNZ|", "||FN||", "|FX|", "|FY|", "|FZ|",
    "||F||", "PVOL", "PSURF", "PMED", "DELTAP", "VOL", "SURF", "MX", "MY", "MZ", "QFRIC", "CE_ELAST", "CE_FRIC",
    "CE_DAMP", "CAREA",
];
const WALL: [&str; 6] = ["FNX", "FNY", "FNZ", "FTX", "FTY", "FTZ"];
const BODY: [&str; 41] = [
    "FX", "FY", "FZ", "MX", "MY", "MZ", "RX", "RY", "RZ", "FXI", "FYI", "FZI", "MXI", "MYI", "MZI", "X", "Y", "Z",
    "DX", "DY", "DZ", "VX", "VY", "VZ", "AX", "AY", "AZ", "VRX", "VRY", "VRZ", "ARX", "ARY", "ARZ", "MASS", "IXX",
    "IYY", "IZZ", "IXY", "IYZ", "IZX", "STATUS",
];
const SECTION: [&str; 39] = [
    "FNX", "FNY", "FNZ", "FTX", "FTY", "FTZ", "M1", "M2", "M3", "WORK", "DFX", "DFY", "DFZ", "DF2", "WORKR", "DMX",
    "DMY", "DMZ", "DM2", "KIN", "KINR", "DMVX", "DMVY", "DMVZ", "DKIN", "DMVRX", "DMVRY", "DMVRZ", "DKINR", "TFEXT",
    "MX", "MY", "MZ", "F1", "F2", "F3", "CX", "CY", "CZ",
];
const JOINT: [&str; 6] = ["FX", "FY", "FZ", "MX", "MY", "MZ"];
const ACCELEROMETER: [&str; 6] = ["AX", "AY", "AZ", "WX", "WY", "WZ"];

/// What a group is of: its name, and the names of its variables.
fn kind(of: i32) -> (&'static str, &'static [&'static str]) {
    match of {
        0 => ("node", &NODE),
        1 => ("brick", &[]),
        2 => ("quad", &[]),
        3 => ("shell", &[]),
        4 => ("truss", &[]),
        5 => ("beam", &[]),
        6 => ("spring", &SPRING),
        7 => ("sh3n", &[]),
        51 => ("sphcel", &[]),
        101 => ("inter", &INTERFACE),
        102 => ("rwall", &WALL),
        103 => ("rbody", &BODY),
        104 => ("sectio", &SECTION),
        105 => ("cyl_jo", &JOINT),
        108 => ("accel", &ACCELEROMETER),
        _ => ("group", &[]),
    }
}

/// The name of a variable among those of its kind.
fn named(names: &[&str], code: i32) -> String {
    let name = usize::try_from(code.wrapping_sub(1))
        .ok()
        .and_then(|index| names.get(index));
    name.map_or_else(|| format!("VAR{code}"), |name| (*name).to_owned())
}

/// The name of a variable of a group.
fn variable(of: i32, code: i32) -> String {
    match code.wrapping_sub(1 + BEFORE_MORE) {
        more @ 0..10 if of == 0 => NODE_MORE[more as usize].to_owned(),
        _ => named(kind(of).1, code),
    }
}

/// Sums over surfaces, which may stand between bars, and other forces and moments that are stored as impulses.
const SUMS: [&str; 8] = ["FX", "FY", "FZ", "FNX", "FNY", "FNZ", "FN", "F"];
const COMPONENTS: [&str; 18] = [
    "FTX", "FTY", "FTZ", "MX", "MY", "MZ", "FXI", "FYI", "FZI", "MXI", "MYI", "MZI", "M1", "M2", "M3", "F1", "F2", "F3",
];

/// Whether a variable of a group is an impulse.
fn is_impulse(of: i32, name: &str) -> bool {
    let reaction = of == 0 && name.starts_with("REAC");
    let is_one = SUMS.contains(&name.trim_matches('|')) || COMPONENTS.contains(&name);
    reaction || (101..=104).contains(&of) && is_one
}

/// A time history of OpenRadioss.
#[derive(Debug)]
pub(crate) struct T01Table {
    source: Source,
    layout: Layout,
    /// Where the first state begins, bytes.
    start: u64,
    states: u64,
}

/// The unsigned integer of four bytes.
fn word(b: &[u8]) -> u32 {
    u32::from_be_bytes([b[0], b[1], b[2], b[3]])
}

/// Whether a file begins as a time history does: a record of 84 bytes with its version and the title, then one of 80.
pub(super) fn is_t01(head: &[u8]) -> bool {
    let word = |at: usize| head.get(at..at + 4).map(word);
    word(0) == Some(84) && word(4).is_some_and(|version| (1000..100_000).contains(&version))
}

/// The records in front of the states.
struct Records<'a> {
    path: &'a Path,
    file: BufReader<Place>,
    at: u64,
    length: u64,
}

impl Records<'_> {
    /// What is wrong at a byte.
    fn damaged(&self, at: u64, what: String) -> CompareError {
        CompareError::content(self.path, format!("byte {at}"), what, REMEDY)
    }

    fn bytes(&mut self, count: u64) -> Result<Vec<u8>, CompareError> {
        if count > self.length - self.at {
            let left = self.length - self.at;
            let what = format!("{count} bytes are needed, and the file ends after {left}");
            return Err(self.damaged(self.at, what));
        }
        let mut bytes = vec![0; count as usize];
        let read = self.file.read_exact(&mut bytes);
        read.map_err(|error| CompareError::io(self.path, &error))?;
        self.at += count;
        Ok(bytes)
    }

    fn marker(&mut self) -> Result<u32, CompareError> {
        Ok(word(&self.bytes(4)?))
    }

    fn next(&mut self) -> Result<Record, CompareError> {
        let at = self.at;
        let length = self.marker()?;
        if u64::from(length) > LONGEST_RECORD {
            return Err(self.damaged(at, format!("a record of {length} bytes, which no header has")));
        }
        let bytes = self.bytes(u64::from(length))?;
        let end = self.marker()?;
        if end != length {
            return Err(self.damaged(self.at - 4, format!("a record of {length} bytes ends as one of {end}")));
        }
        Ok(Record { at, bytes })
    }

    /// A record of so many bytes.
    fn of(&mut self, length: usize, what: &str) -> Result<Record, CompareError> {
        let record = self.next()?;
        if record.bytes.len() != length {
            let what = format!("a record of {} bytes, where {what} has {length}", record.bytes.len());
            return Err(self.damaged(record.at, what));
        }
        Ok(record)
    }

    fn count(&self, record: &Record, place: usize, what: &str) -> Result<usize, CompareError> {
        let count = record.integer(place);
        usize::try_from(count).map_err(|_| self.damaged(record.at, format!("the number of {what} is {count}")))
    }
}

struct Record {
    /// Of its first marker, bytes.
    at: u64,
    bytes: Vec<u8>,
}

impl Record {
    /// The integer at a byte, 0 beyond the end.
    fn integer(&self, place: usize) -> i32 {
        let bytes = self.bytes.get(place..place + 4);
        bytes.map_or(0, |bytes| word(bytes).cast_signed())
    }

    fn integers(&self) -> Vec<i32> {
        (0..self.bytes.len() / 4).map(|k| self.integer(4 * k)).collect()
    }

    fn text(&self, from: usize, length: usize) -> String {
        let bytes = self.bytes.get(from..from + length).unwrap_or_default();
        String::from_utf8_lossy(bytes).trim_matches(['\0', ' ']).to_owned()
    }
}

/// The columns of a state, collected record by record.
#[derive(Debug, Default)]
struct Layout {
    names: Names,
    /// Of each column: where it stands in a state, bytes, and whether it is an impulse.
    columns: Vec<(u64, bool)>,
    /// Where the records of a state begin in it, and their lengths without the markers, bytes.
    records: Vec<(u64, u32)>,
    /// Of a state, bytes.
    stride: u64,
}

impl Layout {
    /// Adds a record of so many values, if there are any, and returns where its first value stands in a state.
    fn record(&mut self, values: usize) -> Option<u64> {
        let length = u32::try_from(values.checked_mul(4)?).ok()?;
        let at = self.stride;
        if length > 0 {
            self.records.push((at, length));
            self.stride += 8 + u64::from(length);
        }
        Some(at + 4)
    }

    fn column(&mut self, name: String, titled: Option<String>, at: u64, is_impulse: bool) {
        if self.names.add(name, titled) {
            self.columns.push((at, is_impulse));
        }
    }
}

struct Group {
    of: i32,
    title: String,
    /// Number and title of each.
    members: Vec<(i32, String)>,
    codes: Vec<i32>,
}

impl T01Table {
    /// Opens a file and reads what stands in front of its states.
    ///
    /// # Errors
    /// A damaged file, one without a whole state, or one with a part of a state at its end.
    pub(super) fn open(source: Source) -> Result<T01Table, CompareError> {
        let path = source.path();
        let place = source.file()?;
        let length = place.length().map_err(|error| CompareError::io(path, &error))?;
        let mut records = Records {
            path,
            file: BufReader::new(place),
            at: 0,
            length,
        };
        records.of(84, "the title")?;
        records.of(80, "the date")?;
        let mut counts = records.next()?;
        if counts.bytes.len() == 4 {
            let additional = counts.integer(0);
            if !(0..=MOST_ADDITIONAL).contains(&additional) {
                return Err(records.damaged(counts.at, format!("{additional} additional records")));
            }
            for _ in 0..additional {
                records.next()?;
            }
            counts = records.next()?;
        }
        if counts.bytes.len() != 24 {
            let what = format!(
                "a record of {} bytes, where that of the counts has 24",
                counts.bytes.len()
            );
            return Err(records.damaged(counts.at, what));
        }
        let number = |place: usize, what: &str| records.count(&counts, 4 * place, what);
        let (parts, materials, properties) = (number(0, "parts")?, number(1, "materials")?, number(2, "properties")?);
        let (subsets, groups, globals) = (
            number(3, "subsets")?,
            number(4, "groups")?,
            number(5, "global variables")?,
        );
        let many = |path: &Path| {
            let what = format!("more than {MOST_COLUMNS} variables");
            CompareError::whole(path, what, "write fewer of them with /TH")
        };
        if globals > MOST_COLUMNS {
            return Err(many(path));
        }
        let global = match globals {
            0 => Vec::new(),
            _ => records.of(4 * globals, "the list of global variables")?.integers(),
        };
        // Of parts and subsets: number, title and variables.
        let mut of_parts: Vec<(i32, String, Vec<i32>)> = Vec::new();
        for _ in 0..parts {
            let record = records.next()?;
            let Some(title) = record.bytes.len().checked_sub(20) else {
                return Err(records.damaged(record.at, "a record too short for a part".to_owned()));
            };
            let variables = records.count(&record, 16 + title, "variables of a part")?;
            let codes = variables_of(&mut records, variables)?;
            of_parts.push((record.integer(0), record.text(4, title), codes));
        }
        for _ in 0..materials.saturating_add(properties) {
            records.next()?;
        }
        let mut of_subsets: Vec<(i32, String, Vec<i32>)> = Vec::new();
        for _ in 0..subsets {
            let record = records.next()?;
            let title = record.bytes.len().saturating_sub(20);
            for place in [8, 12] {
                if records.count(&record, place, "members of a subset")? > 0 {
                    records.next()?;
                }
            }
            let variables = records.count(&record, 16, "variables of a subset")?;
            let codes = variables_of(&mut records, variables)?;
            of_subsets.push((record.integer(0), record.text(20, title), codes));
        }
        let mut of_groups: Vec<Group> = Vec::new();
        let mut columns = globals;
        for _ in 0..groups {
            let record = records.next()?;
            let title = record.bytes.len().saturating_sub(20);
            let count = records.count(&record, 12, "members of a group")?;
            let variables = records.count(&record, 16, "variables of a group")?;
            columns = columns.saturating_add(count.saturating_mul(variables));
            if columns > MOST_COLUMNS {
                return Err(many(path));
            }
            let mut members = Vec::new();
            for _ in 0..count {
                let member = records.next()?;
                let text = member.text(4, member.bytes.len().saturating_sub(4));
                members.push((member.integer(0), text));
            }
            of_groups.push(Group {
                of: record.integer(4),
                title: record.text(20, title),
                members,
                codes: variables_of(&mut records, variables)?,
            });
        }
        let start = records.at;
        let layout = layout(&global, &of_parts, &of_subsets, &of_groups).ok_or_else(|| many(path))?;
        let states = (length - start) / layout.stride;
        let rest = (length - start) % layout.stride;
        if states == 0 || rest > 0 {
            let end = length - rest;
            let what = format!(
                "state {} is cut off: {rest} of its {} bytes are there",
                states + 1,
                layout.stride
            );
            let remedy = if states == 0 {
                "the run wrote no whole state: let it run on".to_owned()
            } else {
                format!("the run was still writing, or stopped: head -c {end} FILE keeps the whole states")
            };
            return Err(CompareError::content(path, format!("byte {end}"), what, remedy));
        }
        Ok(T01Table {
            layout,
            start,
            states,
            source,
        })
    }
}

fn variables_of(records: &mut Records<'_>, count: usize) -> Result<Vec<i32>, CompareError> {
    if count == 0 {
        return Ok(Vec::new());
    }
    let length = count.saturating_mul(4);
    Ok(records.of(length, "a list of variables")?.integers())
}

/// The columns of a state; `None` if there are too many.
fn layout(
    global: &[i32],
    parts: &[(i32, String, Vec<i32>)],
    subsets: &[(i32, String, Vec<i32>)],
    groups: &[Group],
) -> Option<Layout> {
    let mut layout = Layout::default();
    let time = layout.record(1)?;
    layout.column("time".to_owned(), None, time, false);
    // What a history is written for stands first in a list of its columns, and last in a state.
    let mut general = Vec::new();
    let at = layout.record(global.len())?;
    for (k, &code) in global.iter().enumerate() {
        general.push((format!("global/{}", named(&GLOBAL, code)), None, at + 4 * k as u64));
    }
    for (of, list) in [("part", parts), ("subset", subsets)] {
        let values: usize = list.iter().map(|(_, _, codes)| codes.len()).sum();
        if values > MOST_COLUMNS {
            return None;
        }
        let mut at = layout.record(values)?;
        for (number, title, codes) in list {
            for &code in codes {
                let name = named(&PART, code);
                let titled = (!title.is_empty()).then(|| format!("{title}/{name}"));
                general.push((format!("{of}/{number}/{name}"), titled, at));
                at += 4;
            }
        }
    }
    for group in groups {
        let mut at = layout.record(group.members.len().checked_mul(group.codes.len())?)?;
        let (of, _) = kind(group.of);
        for (number, title) in &group.members {
            let title = if title.is_empty() { &group.title } else { title };
            for &code in &group.codes {
                let name = variable(group.of, code);
                let impulse = is_impulse(group.of, &name);
                let titled = (!title.is_empty()).then(|| format!("{title}/{name}"));
                layout.column(format!("{of}/{number}/{name}"), titled, at, impulse);
                at += 4;
            }
        }
    }
    for (name, titled, at) in general {
        layout.column(name, titled, at, false);
    }
    Some(layout)
}

impl Table for T01Table {
    fn path(&self) -> &Path {
        self.source.path()
    }

    fn names(&self) -> Vec<String> {
        self.layout.names.all().to_vec()
    }

    fn has(&self, name: &str) -> bool {
        self.layout.names.find(name).is_ok()
    }

    fn has_texts(&self, _: &str) -> bool {
        false
    }

    fn recognises(&self, name: &str) -> bool {
        name == "time"
    }

    fn why_not(&self, name: &str) -> Option<String> {
        self.layout.names.find(name).err().filter(|why| why.contains("several"))
    }

    fn is_impulse(&self, name: &str) -> bool {
        let column = self.layout.names.find(name);
        column.is_ok_and(|column| self.layout.columns[column].1)
    }

    fn pass(&self, columns: &[String]) -> Result<Box<dyn Pass>, CompareError> {
        let place = |name: &String| {
            let column = self.layout.names.find(name);
            let column = column
                .map_err(|what| CompareError::whole(self.path(), what, "name it with --column or in a mapping"))?;
            Ok(self.layout.columns[column].0)
        };
        Ok(Box::new(T01Pass {
            path: self.path().to_owned(),
            file: self.source.file()?,
            places: columns.iter().map(place).collect::<Result<_, CompareError>>()?,
            records: self.layout.records.clone(),
            at: self.start,
            stride: self.layout.stride,
            states: self.states,
            bytes: Vec::new(),
        }))
    }

    fn place(&self, row: u64, column: &str) -> String {
        let layout = &self.layout;
        let at = layout.names.find(column).map_or(0, |column| layout.columns[column].0);
        format!("state {}, byte {}", row + 1, self.start + row * layout.stride + at)
    }
}

struct T01Pass {
    path: PathBuf,
    file: Place,
    /// Of the columns in a state, bytes.
    places: Vec<u64>,
    records: Vec<(u64, u32)>,
    at: u64,
    stride: u64,
    /// Those that are left.
    states: u64,
    bytes: Vec<u8>,
}

impl Pass for T01Pass {
    fn next(&mut self, columns: &mut [Vec<f64>]) -> Result<(), CompareError> {
        columns.iter_mut().for_each(Vec::clear);
        while columns[0].len() < BLOCK && self.states > 0 {
            let stride = self.stride as usize;
            let count = (MOST_READ / stride).clamp(1, BLOCK - columns[0].len());
            let count = count.min(usize::try_from(self.states).unwrap_or(usize::MAX));
            self.bytes.resize(count * stride, 0);
            let read = self
                .file
                .seek(SeekFrom::Start(self.at))
                .and_then(|_| self.file.read_exact(&mut self.bytes));
            read.map_err(|error| CompareError::io(&self.path, &error))?;
            for state in self.bytes.chunks_exact(stride) {
                let word = |at: u64| word(&state[at as usize..at as usize + 4]);
                for &(at, length) in &self.records {
                    let ends = [word(at), word(at + 4 + u64::from(length))];
                    if let Some(found) = ends.into_iter().find(|found| *found != length) {
                        let what = format!("a record of {found} bytes, where one of {length} is due");
                        let place = format!("byte {}", self.at + at);
                        return Err(CompareError::content(&self.path, place, what, REMEDY));
                    }
                }
                for (column, &place) in columns.iter_mut().zip(&self.places) {
                    column.push(f64::from(f32::from_bits(word(place))));
                }
                self.at += self.stride;
                self.states -= 1;
            }
        }
        Ok(())
    }
}
