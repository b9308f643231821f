//! Objects of an HDF5 file.

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ObjectFault {
    Hdf5(String),
    Refused(String),
    Elsewhere(String),
    /// Place of an object whose name is not UTF-8 and cannot be used.
    Unnamed(String),
    /// A part of a variable lies in a missing file: part and file.
    Absent(String),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GroupMember {
    pub(crate) name: String,
    pub(crate) is: Object,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Object {
    Group(String),
    Dataset(DatasetInfo),
    Not(ObjectFault),
    /// Named types and dangling links.
    Other,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DatasetInfo {
    /// Empty for a scalar.
    pub(crate) shape: Vec<usize>,
    pub(crate) holds: Holds,
    pub(crate) chunk: Option<Vec<usize>>,
    pub(crate) chunks: Option<usize>,
}

impl DatasetInfo {
    pub(crate) fn size(&self) -> usize {
        self.shape.iter().product()
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Holds {
    Integers(usize),
    Unsigned(usize),
    Floats(usize),
    Texts,
    Other(String),
}

impl Holds {
    pub(crate) fn is_number(&self) -> bool {
        matches!(self, Holds::Integers(_) | Holds::Unsigned(_) | Holds::Floats(_))
    }

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
