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
const BEFORE_MORE: usize = 619;
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

fn variable(of: i32, code: i32) -> String {
    let index = usize::try_from(code).unwrap_or(0).wrapping_sub(1);
    let more = (of == 0)
        .then(|| NODE_MORE.get(index.wrapping_sub(BEFORE_MORE)))
        .flatten();
    match kind(of).1.get(index).or(more) {
        Some(name) => (*name).to_owned(),
        None => format!("VAR{code}"),
    }
}

/// Whether a variable of a group is an impulse.
fn is_impulse(of: i32, name: &str) -> bool {
    let reaction = of == 0 && name.starts_with("REAC");
    let of_sum = matches!(
        name.trim_matches('|'),
        "FX" | "FY" | "FZ" | "FNX" | "FNY" | "FNZ" | "FN" | "F"
    );
    let component = matches!(
        name,
        "FTX"
            | "FTY"
            | "FTZ"
            | "MX"
            | "MY"
            | "MZ"
            | "FXI"
            | "FYI"
            | "FZI"
            | "MXI"
            | "MYI"
            | "MZI"
            | "M1"
            | "M2"
            | "M3"
            | "F1"
            | "F2"
            | "F3"
    );
    reaction || (101..=104).contains(&of) && (of_sum || component)
}

/// A time history of OpenRadioss.
#[derive(Debug)]
pub(crate) struct T01Table {
    source: Source,
    names: Names,
    /// Of each column: where it stands in a state, bytes, and whether it is an impulse.
    columns: Vec<(u64, bool)>,
    /// Where the records of a state begin in it, and their lengths without the markers, bytes.
    records: Vec<(u64, u32)>,
    /// Of the first state, and of one state, bytes.
    start: u64,
    stride: u64,
    states: u64,
}

/// Whether a file begins as a time history does: a record of 84 bytes with its version and the title, then one of 80.
pub(super) fn is_t01(head: &[u8]) -> bool {
    let word = |at: usize| {
        head.get(at..at + 4)
            .map(|b| i32::from_be_bytes([b[0], b[1], b[2], b[3]]))
    };
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
    fn damaged(&self, what: String) -> CompareError {
        CompareError::content(self.path, format!("byte {}", self.at), what, REMEDY)
    }

    fn bytes(&mut self, count: u64) -> Result<Vec<u8>, CompareError> {
        if count > self.length - self.at {
            return Err(self.damaged(format!(
                "{count} bytes are needed, and the file ends after {}",
                self.length - self.at
            )));
        }
        let mut bytes = vec![0; count as usize];
        let read = self.file.read_exact(&mut bytes);
        read.map_err(|error| CompareError::io(self.path, &error))?;
        self.at += count;
        Ok(bytes)
    }

    fn marker(&mut self) -> Result<u32, CompareError> {
        let b = self.bytes(4)?;
        Ok(u32::from_be_bytes([b[0], b[1], b[2], b[3]]))
    }

    fn next(&mut self) -> Result<Record, CompareError> {
        let at = self.at;
        let length = self.marker()?;
        if u64::from(length) > LONGEST_RECORD {
            self.at = at;
            return Err(self.damaged(format!("a record of {length} bytes, which no header has")));
        }
        let bytes = self.bytes(u64::from(length))?;
        let end = self.marker()?;
        if end != length {
            self.at -= 4;
            return Err(self.damaged(format!("a record of {length} bytes ends as one of {end}")));
        }
        Ok(Record { at, bytes })
    }

    /// A record of so many bytes.
    fn of(&mut self, length: usize, what: &str) -> Result<Record, CompareError> {
        let record = self.next()?;
        if record.bytes.len() != length {
            self.at = record.at;
            return Err(self.damaged(format!(
                "a record of {} bytes, where {what} has {length}",
                record.bytes.len()
            )));
        }
        Ok(record)
    }

    fn count(&self, record: &Record, place: usize, what: &str) -> Result<usize, CompareError> {
        let count = record.integer(place);
        usize::try_from(count).map_err(|_| {
            let place = format!("byte {}", record.at);
            CompareError::content(self.path, place, format!("the number of {what} is {count}"), REMEDY)
        })
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
        bytes.map_or(0, |b| i32::from_be_bytes([b[0], b[1], b[2], b[3]]))
    }

    fn integers(&self) -> Vec<i32> {
        (0..self.bytes.len() / 4).map(|k| self.integer(4 * k)).collect()
    }

    fn text(&self, from: usize, length: usize) -> String {
        let bytes = self.bytes.get(from..from + length).unwrap_or_default();
        String::from_utf8_lossy(bytes).trim_matches(['\0', ' ']).to_owned()
    }
}

/// Collects the columns of a state, record by record.
#[derive(Default)]
struct Layout {
    names: Names,
    columns: Vec<(u64, bool)>,
    records: Vec<(u64, u32)>,
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
                records.at = counts.at;
                return Err(records.damaged(format!("{additional} additional records")));
            }
            for _ in 0..additional {
                records.next()?;
            }
            counts = records.next()?;
        }
        if counts.bytes.len() != 24 {
            records.at = counts.at;
            return Err(records.damaged(format!(
                "a record of {} bytes, where that of the counts has 24",
                counts.bytes.len()
            )));
        }
        let what = [
            "parts",
            "materials",
            "properties",
            "subsets",
            "groups",
            "global variables",
        ];
        let mut numbers = [0; 6];
        for (k, number) in numbers.iter_mut().enumerate() {
            *number = records.count(&counts, 4 * k, what[k])?;
        }
        let [parts, materials, properties, subsets, groups, globals] = numbers;
        let many = |path: &Path| {
            let what = format!("more than {MOST_COLUMNS} variables");
            CompareError::content(path, "", what, "write fewer of them with /TH")
        };
        if globals > MOST_COLUMNS {
            return Err(many(path));
        }
        let global = if globals > 0 {
            records.of(4 * globals, "the list of global variables")?.integers()
        } else {
            Vec::new()
        };
        // Of parts and subsets: number, title and variables.
        let mut of_parts: Vec<(i32, String, Vec<i32>)> = Vec::new();
        for _ in 0..parts {
            let record = records.next()?;
            let Some(title) = record.bytes.len().checked_sub(20) else {
                records.at = record.at;
                return Err(records.damaged("a record too short for a part".to_owned()));
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
            names: layout.names,
            columns: layout.columns,
            records: layout.records,
            start,
            stride: layout.stride,
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
    let named = |names: &[&str], code: i32| {
        let index = usize::try_from(code).unwrap_or(0).wrapping_sub(1);
        names
            .get(index)
            .map_or_else(|| format!("VAR{code}"), |name| (*name).to_owned())
    };
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
        self.names.all().to_vec()
    }

    fn has(&self, name: &str) -> bool {
        self.names.find(name).is_ok()
    }

    fn has_texts(&self, _: &str) -> bool {
        false
    }

    fn recognises(&self, name: &str) -> bool {
        name == "time"
    }

    fn why_not(&self, name: &str) -> Option<String> {
        self.names.find(name).err().filter(|why| why.contains("several"))
    }

    fn is_impulse(&self, name: &str) -> bool {
        self.names.find(name).is_ok_and(|column| self.columns[column].1)
    }

    fn unit(&self, _: &str) -> Option<String> {
        None
    }

    fn pass(&self, columns: &[String]) -> Result<Box<dyn Pass>, CompareError> {
        let place = |name: &String| {
            let column = self.names.find(name);
            let column = column.map_err(|what| {
                CompareError::content(self.path(), "", what, "name it with --column or in a mapping")
            })?;
            Ok(self.columns[column].0)
        };
        Ok(Box::new(T01Pass {
            path: self.path().to_owned(),
            file: self.source.file()?,
            places: columns.iter().map(place).collect::<Result<_, CompareError>>()?,
            records: self.records.clone(),
            at: self.start,
            stride: self.stride,
            states: self.states,
            bytes: Vec::new(),
        }))
    }

    fn texts(&self, _: &str) -> Result<Vec<String>, CompareError> {
        Ok(Vec::new())
    }

    fn place(&self, row: u64, column: &str) -> String {
        let at = self.names.find(column).map_or(0, |column| self.columns[column].0);
        format!("state {}, byte {}", row + 1, self.start + row * self.stride + at)
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
                let word = |at: u64| {
                    let b = &state[at as usize..at as usize + 4];
                    u32::from_be_bytes([b[0], b[1], b[2], b[3]])
                };
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
