//! What is asked of the process that reads HDF5 files, and what it answers.

use std::ffi::OsString;
use std::io::{self, Read, Write};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::results::schema::Kind;

/// A file is opened first; every path is one in it, without a leading slash, "" for the root.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Request {
    Open(Opening),
    /// Of a group.
    Members(String),
    /// Of a group or a dataset.
    Attributes(String),
    /// Object and name.
    Attribute(String, String),
    Dataset(String),
    /// A hyperslab of a dataset: first index and count of each dimension, and the type in which numbers are read; HDF5 converts.
    /// They come as they lie in memory, every other answer as postcard has it.
    Read(String, Vec<(u64, u64)>, Kind),
    /// A scalar text.
    Text(String),
    /// A column of texts.
    Texts(String),
    /// Changes the file at this path, which is not the open one.
    Change(OsString, Vec<u8>),
    /// Forgets the open file.
    Close,
}

/// How a file is opened.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Opening {
    /// As the operating system has it.
    pub(super) path: OsString,
    /// Whether links and storage in other files are followed.
    pub(super) follow_external: bool,
    /// Bytes kept of each variable.
    pub(super) chunk_cache: Option<usize>,
    /// Whether the file is growing: then all that says where its data are is read at once, and kept.
    pub(super) growing: bool,
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Fault {
    /// HDF5 could not: its own words.
    Hdf5(String),
    /// The file asks for more than is granted.
    Refused(String),
    /// What is asked for is kept in another file.
    Elsewhere(String),
    /// An object has a name that is not UTF-8, by which nobody can ask for it: its place, as it can be shown.
    Unnamed(String),
    /// A part of a variable should be in another file, and is not: which, and where.
    Absent(String),
}

/// What a group has.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Member {
    pub(crate) name: String,
    pub(crate) is: Object,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Object {
    /// With what is the same for two links to one group.
    Group(String),
    Dataset(DatasetInfo),
    /// What cannot be read, or is not.
    Not(Fault),
    /// Types, and links that lead nowhere.
    Other,
}

/// What a dataset is, without its values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct DatasetInfo {
    /// Empty for a scalar.
    pub(crate) shape: Vec<usize>,
    pub(crate) holds: Holds,
    /// Of one chunk, where it is stored in chunks.
    pub(crate) chunk: Option<Vec<usize>>,
    /// Chunks in the file.
    pub(crate) chunks: Option<usize>,
    /// Whether damage to its values is somebody else's to notice: every chunk has a Fletcher-32 checksum, or they are in
    /// another file.
    pub(crate) covered: bool,
}

impl DatasetInfo {
    /// Number of values.
    pub(crate) fn size(&self) -> usize {
        self.shape.iter().product()
    }
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Holds {
    /// Bytes of each.
    Integers(usize),
    Unsigned(usize),
    Floats(usize),
    Texts,
    /// Its name for a listing.
    Other(String),
}

impl Holds {
    pub(crate) fn is_number(&self) -> bool {
        matches!(self, Holds::Integers(_) | Holds::Unsigned(_) | Holds::Floats(_))
    }

    /// The name that NumPy has for it.
    pub(crate) fn name(&self) -> String {
        match self {
            Holds::Integers(bytes) => format!("int{}", 8 * bytes),
            Holds::Unsigned(bytes) => format!("uint{}", 8 * bytes),
            Holds::Floats(bytes) => format!("float{}", 8 * bytes),
            Holds::Texts => "string".to_owned(),
            Holds::Other(name) => name.clone(),
        }
    }
}

/// Longest message, and longest block of numbers, in bytes.
const LONGEST: u64 = 256 << 20;

/// Sends a message with the bytes that follow it.
pub(super) fn send(to: &mut impl Write, message: &impl Serialize, tail: &[u8]) -> io::Result<()> {
    let head = postcard::to_allocvec(message).map_err(io::Error::other)?;
    let mut start = Vec::with_capacity(16 + head.len());
    start.extend((head.len() as u64).to_le_bytes());
    start.extend((tail.len() as u64).to_le_bytes());
    start.extend(head);
    to.write_all(&start)?;
    to.write_all(tail)?;
    to.flush()
}

/// The lengths of a message and of what follows it.
fn lengths(start: [u8; 16]) -> io::Result<(usize, usize)> {
    let [head, tail] = [0, 8].map(|at| u64::from_le_bytes(std::array::from_fn(|k| start[at + k])));
    if head > LONGEST || tail > LONGEST {
        return Err(io::Error::other("a message that is too long"));
    }
    Ok((head as usize, tail as usize))
}

/// Receives a message with the bytes that follow it.
pub(super) fn receive<T: DeserializeOwned>(from: &mut impl Read) -> io::Result<(T, Vec<u8>)> {
    let mut start = [0; 16];
    from.read_exact(&mut start)?;
    let (head, tail) = lengths(start)?;
    let (mut head, mut tail) = (vec![0; head], vec![0; tail]);
    from.read_exact(&mut head)?;
    from.read_exact(&mut tail)?;
    Ok((postcard::from_bytes(&head).map_err(io::Error::other)?, tail))
}
