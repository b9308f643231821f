//! Columns of the time histories of OpenRadioss (T01, T02, ...).
//!
//! A sequence of Fortran records, each between two copies of its length, of 32-bit numbers, all big-endian: two titles, since
//! version 5 the lengths of titles and the units, counts, the variables of parts, materials, properties, subsets and
//! groups (`/TH/NODE`, `/TH/INTER`, ...), then for each state the time, the global variables, those of parts, of
//! subsets and of each group. Variables have numbers, whose names are those of the manual of `/TH`.
//!
//! The forces and moments of interfaces, rigid walls, rigid bodies and sections are stored as impulses, integrals since the start of the run.

use super::super::CompareError;
use super::absent;
use super::named::Names;
use super::source::{Binary, Place, Source};
use super::table::{BLOCK, Pass, Table};
use std::io::{BufReader, Read};
use std::path::Path;

/// A record in front of the states is no longer, bytes.
const LONGEST_RECORD: u64 = 16 << 20;
/// Columns of a file.
const MOST_COLUMNS: usize = 500_000;
/// Bytes of states that are read at once, at least one state.
const MOST_READ: usize = 4 << 20;
/// Records between the titles and the counts.
const MOST_ADDITIONAL: i32 = 16;

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
    let index = usize::try_from(code.wrapping_sub(1));
    let name = index.ok().and_then(|index| names.get(index));
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
pub(super) struct T01Table {
    file: Binary,
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
    file: &'a Binary,
    reader: BufReader<Place>,
    at: u64,
}

impl Records<'_> {
    fn bytes(&mut self, count: u64) -> Result<Vec<u8>, CompareError> {
        self.file.holds(self.at, count)?;
        let mut bytes = vec![0; count as usize];
        let read = self.reader.read_exact(&mut bytes);
        read.map_err(CompareError::io(&self.file.path))?;
        self.at += count;
        Ok(bytes)
    }

    fn next(&mut self) -> Result<Record, CompareError> {
        let at = self.at;
        let length = word(&self.bytes(4)?);
        if u64::from(length) > LONGEST_RECORD {
            let what = format!("a record of {length} bytes, which no header has");
            return Err(self.file.damaged(at, what));
        }
        let bytes = self.bytes(u64::from(length))?;
        let end = word(&self.bytes(4)?);
        if end != length {
            let what = format!("a record of {length} bytes ends as one of {end}");
            return Err(self.file.damaged(self.at - 4, what));
        }
        Ok(Record { at, bytes })
    }

    /// A record of so many bytes.
    fn of(&mut self, length: usize, what: &str) -> Result<Record, CompareError> {
        let record = self.next()?;
        record.is_of(self.file, length, what)?;
        Ok(record)
    }

    fn count(&self, record: &Record, place: usize, what: &str) -> Result<usize, CompareError> {
        let count = record.integer(place);
        let fault = |_| self.file.damaged(record.at, format!("the number of {what} is {count}"));
        usize::try_from(count).map_err(fault)
    }

    /// The numbers of so many variables.
    fn variables(&mut self, count: usize, what: &str) -> Result<Vec<i32>, CompareError> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let record = self.of(count.saturating_mul(4), what)?;
        Ok((0..count).map(|k| record.integer(4 * k)).collect())
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

    /// From a byte on, so many bytes less than there are in all.
    fn text(&self, from: usize, less: usize) -> String {
        let length = self.bytes.len().saturating_sub(less);
        let bytes = self.bytes.get(from..from + length).unwrap_or_default();
        String::from_utf8_lossy(bytes).trim_matches(['\0', ' ']).to_owned()
    }

    fn is_of(&self, file: &Binary, length: usize, what: &str) -> Result<(), CompareError> {
        let found = self.bytes.len();
        if found == length {
            return Ok(());
        }
        Err(file.damaged(self.at, format!("a record of {found} bytes, where {what} has {length}")))
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

/// A part or a subset: number, title and variables.
type Member = (i32, String, Vec<i32>);

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
    pub fn open(source: &Source) -> Result<T01Table, CompareError> {
        let file = Binary::open(source)?;
        let mut records = Records {
            file: &file,
            reader: file.reader(0),
            at: 0,
        };
        records.of(84, "the title")?;
        records.of(80, "the date")?;
        let mut counts = records.next()?;
        if counts.bytes.len() == 4 {
            let additional = counts.integer(0);
            if !(0..=MOST_ADDITIONAL).contains(&additional) {
                return Err(file.damaged(counts.at, format!("{additional} additional records")));
            }
            for _ in 0..additional {
                records.next()?;
            }
            counts = records.next()?;
        }
        counts.is_of(&file, 24, "that of the counts")?;
        let names = [
            "parts",
            "materials",
            "properties",
            "subsets",
            "groups",
            "global variables",
        ];
        let mut numbers = [0; 6];
        for (k, name) in names.iter().enumerate() {
            numbers[k] = records.count(&counts, 4 * k, name)?;
        }
        let [parts, materials, properties, subsets, groups, globals] = numbers;
        let many = || {
            let what = format!("more than {MOST_COLUMNS} variables");
            CompareError::whole(&file.path, what, "write fewer of them with /TH")
        };
        if globals > MOST_COLUMNS {
            return Err(many());
        }
        let global = records.variables(globals, "the list of global variables")?;
        let mut of_parts: Vec<Member> = Vec::new();
        for _ in 0..parts {
            let record = records.next()?;
            let Some(title) = record.bytes.len().checked_sub(20) else {
                return Err(file.damaged(record.at, "a record too short for a part"));
            };
            let variables = records.count(&record, 16 + title, "variables of a part")?;
            let codes = records.variables(variables, VARIABLES)?;
            of_parts.push((record.integer(0), record.text(4, 20), codes));
        }
        for _ in 0..materials.saturating_add(properties) {
            records.next()?;
        }
        let mut of_subsets: Vec<Member> = Vec::new();
        for _ in 0..subsets {
            let record = records.next()?;
            for place in [8, 12] {
                if records.count(&record, place, "members of a subset")? > 0 {
                    records.next()?;
                }
            }
            let variables = records.count(&record, 16, "variables of a subset")?;
            let codes = records.variables(variables, VARIABLES)?;
            of_subsets.push((record.integer(0), record.text(20, 20), codes));
        }
        let mut of_groups: Vec<Group> = Vec::new();
        let mut columns = globals;
        for _ in 0..groups {
            let record = records.next()?;
            let count = records.count(&record, 12, "members of a group")?;
            let variables = records.count(&record, 16, "variables of a group")?;
            columns = columns.saturating_add(count.saturating_mul(variables));
            if columns > MOST_COLUMNS {
                return Err(many());
            }
            let member = |_| records.next().map(|member| (member.integer(0), member.text(4, 4)));
            of_groups.push(Group {
                of: record.integer(4),
                title: record.text(20, 20),
                members: (0..count).map(member).collect::<Result<_, _>>()?,
                codes: records.variables(variables, VARIABLES)?,
            });
        }
        let start = records.at;
        let layout = layout(&global, &of_parts, &of_subsets, &of_groups).ok_or_else(many)?;
        let stride = layout.stride;
        let (states, rest) = ((file.length - start) / stride, (file.length - start) % stride);
        if states == 0 || rest > 0 {
            let (end, cut_off) = (file.length - rest, states + 1);
            let what = format!("state {cut_off} is cut off: {rest} of its {stride} bytes are there");
            let remedy = if states == 0 {
                "the run wrote no whole state: let it run on".to_owned()
            } else {
                format!("the run was still writing, or stopped: head -c {end} FILE keeps the whole states")
            };
            return Err(CompareError::content(&file.path, format!("byte {end}"), what, remedy));
        }
        Ok(T01Table {
            layout,
            start,
            states,
            file,
        })
    }

    /// The column of a name: where it stands in a state, bytes, and whether it is an impulse.
    fn find(&self, name: &str) -> Result<(u64, bool), String> {
        let place = self.layout.names.find(name)?;
        Ok(self.layout.columns[place])
    }
}

const VARIABLES: &str = "a list of variables";

/// The columns of a state; `None` if there are too many.
fn layout(global: &[i32], parts: &[Member], subsets: &[Member], groups: &[Group]) -> Option<Layout> {
    let under = |title: &str, name: &str| (!title.is_empty()).then(|| format!("{title}/{name}"));
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
                general.push((format!("{of}/{number}/{name}"), under(title, &name), at));
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
                layout.column(format!("{of}/{number}/{name}"), under(title, &name), at, impulse);
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
        &self.file.path
    }

    fn names(&self) -> Vec<String> {
        self.layout.names.all().to_vec()
    }

    fn has(&self, name: &str) -> bool {
        self.find(name).is_ok()
    }

    fn recognises(&self, name: &str) -> bool {
        name == "time"
    }

    fn why_not(&self, name: &str) -> Option<String> {
        self.find(name).err().filter(|why| why.contains("several"))
    }

    fn is_impulse(&self, name: &str) -> bool {
        self.find(name).is_ok_and(|(_, is_impulse)| is_impulse)
    }

    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError> {
        let place = |name: &String| Ok(self.find(name).map_err(|_| absent(self, name))?.0);
        let places = columns.iter().map(place).collect::<Result<Vec<u64>, CompareError>>()?;
        let (mut at, mut left) = (self.start, self.states);
        let (stride, mut bytes) = (self.layout.stride as usize, Vec::new());
        Ok(Box::new(move |columns| {
            columns.iter_mut().for_each(Vec::clear);
            while columns[0].len() < BLOCK && left > 0 {
                let count = (MOST_READ / stride).clamp(1, BLOCK - columns[0].len());
                let count = count.min(usize::try_from(left).unwrap_or(usize::MAX));
                bytes.resize(count * stride, 0);
                self.file.read(at, &mut bytes)?;
                for state in bytes.chunks_exact(stride) {
                    let word = |at: u64| word(&state[at as usize..at as usize + 4]);
                    for &(begins, length) in &self.layout.records {
                        let ends = [word(begins), word(begins + 4 + u64::from(length))];
                        if let Some(found) = ends.into_iter().find(|found| *found != length) {
                            let what = format!("a record of {found} bytes, where one of {length} is due");
                            return Err(self.file.damaged(at + begins, what));
                        }
                    }
                    for (column, &place) in columns.iter_mut().zip(&places) {
                        column.push(f64::from(f32::from_bits(word(place))));
                    }
                    at += stride as u64;
                    left -= 1;
                }
            }
            Ok(())
        }))
    }

    fn place(&self, row: u64, column: &str) -> String {
        let at = self.find(column).map_or(0, |(at, _)| at);
        format!("state {}, byte {}", row + 1, self.start + row * self.layout.stride + at)
    }
}
