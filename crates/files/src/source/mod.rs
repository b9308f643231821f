//! Access to an HDF5 file that this process did not write.
//!
//! HDF5 trusts its input: a damaged file can crash it, keep it busy for ever, or make it request all memory. A file
//! is therefore opened only if its seal is intact, or if a short-lived process has read it first ([`probe`]). Without
//! such a program, every file is opened directly.

mod handles;
mod probe;

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, SystemTime};

use super::attributes::AttributeValue;
use super::schema::{StorageKind, Variable, attribute};
use super::table::StoredNumber;
use super::{Reason, ResultError, disk, raw, schema, target};
use handles::{Answered, Handles, VALUES};
pub use probe::{probe, probe_by_this_program, probe_if_asked, run_probe, set_probe};

static FOLLOW_EXTERNAL: AtomicBool = AtomicBool::new(false);

/// Identity of a file's content. It changes when the file is written or replaced.
#[derive(Debug, Clone, PartialEq)]
struct Identity {
    at: Option<(u64, u64)>,
    length: u64,
    changed: Option<SystemTime>,
}

impl Identity {
    fn of(path: &Path) -> Option<Identity> {
        let found = std::fs::metadata(path).ok()?;
        Some(Identity {
            at: disk::number_of(&found),
            length: found.len(),
            changed: found.modified().ok(),
        })
    }
}

/// Sets whether links into other files, external storage, and virtual datasets over files elsewhere are followed
/// (default: no).
pub fn follow_external(follow: bool) {
    FOLLOW_EXTERNAL.store(follow, Ordering::Relaxed);
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Debug, Clone)]
struct Opening {
    follow_external: bool,
    chunk_cache: Option<usize>,
    /// Whether the file is growing. All metadata is then read at once, and kept.
    growing: bool,
}

pub(super) struct FileSource {
    path: PathBuf,
    opening: Opening,
    identity: Option<Identity>,
    handles: Mutex<Option<Handles>>,
    known: Mutex<HashMap<String, Option<DatasetInfo>>>,
}

impl std::fmt::Debug for FileSource {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Source")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

#[derive(Debug, Default)]
pub(super) struct Described {
    pub(super) units: Option<String>,
    pub(super) long_name: Option<String>,
    pub(super) flags: Vec<(i64, String)>,
    pub(super) fill: Option<AttributeValue>,
}

impl Described {
    pub(super) fn variable(self, name: String, kind: StorageKind) -> Variable {
        Variable {
            name,
            kind,
            fill: self.count_fill(),
            units: self.units.unwrap_or_default(),
            long_name: self.long_name.unwrap_or_default(),
            flags: self.flags,
        }
    }

    pub(super) fn count_fill(&self) -> Option<i64> {
        self.fill.as_ref().and_then(AttributeValue::integer)
    }
}

const ATTEMPTS: usize = 50;
const PAUSE: Duration = Duration::from_millis(20);

impl FileSource {
    /// Opens any HDF5 file. A file that a run is writing is read in the state of its last flush, and stays so.
    pub(super) fn open(path: &Path) -> Result<FileSource, ResultError> {
        Self::open_with(path, None)
    }

    pub(super) fn open_known(path: &Path) -> Result<FileSource, ResultError> {
        let source = Self::open(path)?;
        let known = i64::from(schema::FORMAT_VERSION);
        match source.attribute("", schema::root::FORMAT_VERSION)? {
            Some(AttributeValue::Integer(found)) if found > known => Err(Reason::Newer { found, known }.of(path)),
            _ => Ok(source),
        }
    }

    /// Opens a file of one of this program's formats. The columns of each of its tables must have one length.
    pub(super) fn open_format(path: &Path, format: &str) -> Result<FileSource, ResultError> {
        let source = Self::open_known(path)?;
        let found = source.text_attribute("", schema::root::FORMAT)?;
        let reason = match (format, found.as_deref()) {
            (_, Some(found)) if found == format => return source.check_tables().map(|()| source),
            (schema::SWEEP_FORMAT, Some(schema::SWEEP_SHARD_FORMAT)) => Reason::OnlyAShard,
            (schema::SWEEP_FORMAT, _) => Reason::NotASweep,
            (schema::SWEEP_SHARD_FORMAT, _) => Reason::NotAShard,
            _ => Reason::NotAResult(found),
        };
        Err(reason.of(path))
    }

    /// Like [`Self::open`], with a chunk cache for each variable. A compressed chunk beyond HDF5's default cache
    /// would be unpacked again for every block of rows.
    pub(super) fn open_with(path: &Path, chunk_cache: Option<usize>) -> Result<FileSource, ResultError> {
        check_plain(path)?;
        let opening = Opening {
            follow_external: FOLLOW_EXTERNAL.load(Ordering::Relaxed),
            chunk_cache,
            growing: false,
        };
        let (mut has_grown, mut probed) = (false, false);
        for _ in 0..ATTEMPTS {
            let flushes = target::flushes(path);
            has_grown |= flushes.is_some();
            if has_grown && !path.exists() {
                return Err(Reason::Ended.of(path));
            }
            match flushes {
                None => {
                    let identity = Identity::of(path);
                    match probe::admit(path, opening.follow_external, false) {
                        Err(Reason::Changed) => {}
                        Err(reason) => return Err(reason.of(path)),
                        Ok(()) => {
                            let opened = Self::opened(path, opening.clone());
                            if Identity::of(path) == identity {
                                return opened;
                            }
                        }
                    }
                }
                // The probe takes longer than the time between two flushes, so that the file opened afterwards is
                // that of a later flush.
                Some(_) if !probed => match probe::admit(path, opening.follow_external, true) {
                    Err(Reason::Changed) => {}
                    Err(reason) => return Err(reason.of(path)),
                    Ok(()) => {
                        probed = true;
                        continue;
                    }
                },
                Some(before) if before.is_multiple_of(2) => {
                    let growing = Opening {
                        growing: true,
                        ..opening.clone()
                    };
                    let opened = Self::opened(path, growing);
                    if target::flushes(path) == Some(before) {
                        return opened;
                    }
                }
                Some(_) => {}
            }
            std::thread::sleep(PAUSE);
        }
        Err(if has_grown { Reason::Growing } else { Reason::Changed }.of(path))
    }

    fn opened(path: &Path, opening: Opening) -> Result<FileSource, ResultError> {
        // HDF5 would follow such links behind virtual datasets. The program that uses this library may need them.
        static FORGOTTEN: Once = Once::new();
        if !opening.follow_external && probe::owns_process() {
            FORGOTTEN.call_once(|| {
                if let Err(error) = raw::forget_external_links() {
                    log::debug!("links into other files: {error}");
                }
            });
        }
        let source = FileSource {
            path: path.to_owned(),
            identity: Identity::of(path),
            opening,
            handles: Mutex::new(None),
            known: Mutex::default(),
        };
        source.ask(|_| Ok(()))?;
        Ok(source)
    }

    /// Closes the file until its next use: a merger reads a thousand shards, more than a process may open.
    pub(super) fn close(&self) {
        // Closing a growing file would lose the state at its opening.
        if !self.opening.growing {
            *locked(&self.handles) = None;
        }
    }

    fn close_datasets(&self) {
        if let Some(handles) = &mut *locked(&self.handles)
            && !self.opening.growing
        {
            handles.close_datasets();
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn is_growing(&self) -> bool {
        self.opening.growing
    }

    fn ask<T>(&self, question: impl FnOnce(&mut Handles) -> Answered<T>) -> Result<T, ResultError> {
        let mut handles = locked(&self.handles);
        let handles = match &mut *handles {
            Some(handles) => handles,
            closed => {
                if Identity::of(&self.path) != self.identity && !self.opening.growing {
                    return Err(Reason::Changed.of(&self.path));
                }
                let opened = Handles::open(&self.path, &self.opening);
                closed.insert(opened.map_err(|reason| reason.of(&self.path))?)
            }
        };
        question(handles).map_err(|reason| reason.of(&self.path))
    }

    /// Members of a group, in the order of creation if it is known.
    pub(super) fn members(&self, group: &str) -> Result<Vec<GroupMember>, ResultError> {
        Ok(self.ask(|handles| handles.members(group))?.1)
    }

    /// Whether the root has a member of this name.
    pub(super) fn has(&self, name: &str) -> Result<bool, ResultError> {
        Ok(self.members("")?.iter().any(|member| member.name == name))
    }

    pub(super) fn attributes(&self, object: &str) -> Result<Vec<(String, AttributeValue)>, ResultError> {
        self.ask(|handles| handles.attributes(object))
    }

    pub(super) fn attribute(&self, object: &str, name: &str) -> Result<Option<AttributeValue>, ResultError> {
        self.ask(|handles| handles.attribute(object, name))
    }

    pub(super) fn text_attribute(&self, object: &str, name: &str) -> Result<Option<String>, ResultError> {
        Ok(match self.attribute(object, name)? {
            Some(AttributeValue::Text(text)) => Some(text),
            _ => None,
        })
    }

    /// Overrides of the case in words; none in files of earlier versions.
    pub(super) fn changed(&self) -> Vec<String> {
        let found = self.text_attribute(schema::group::INPUT, schema::INPUT_CHANGED);
        let text = found.ok().flatten().unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }

    pub(super) fn described(&self, path: &str) -> Result<Described, ResultError> {
        let mut described = Described::default();
        let (mut codes, mut meanings) = (Vec::new(), String::new());
        for (name, value) in self.attributes(path)? {
            match (name.as_str(), value) {
                (attribute::UNITS, AttributeValue::Text(text)) => described.units = Some(text),
                (attribute::LONG_NAME, AttributeValue::Text(text)) => described.long_name = Some(text),
                (attribute::FLAG_MEANINGS, AttributeValue::Text(text)) => meanings = text,
                (attribute::FLAG_VALUES, AttributeValue::Integers(list)) => codes = list,
                (attribute::FLAG_VALUES, AttributeValue::Integer(code)) => codes = vec![code],
                (attribute::FILL_VALUE, fill) => described.fill = Some(fill),
                _ => {}
            }
        }
        let words = meanings.split_whitespace().map(str::to_owned);
        described.flags = codes.into_iter().zip(words).collect();
        Ok(described)
    }

    pub(super) fn dataset(&self, path: &str) -> Result<Option<DatasetInfo>, ResultError> {
        if let Some(known) = locked(&self.known).get(path) {
            return Ok(known.clone());
        }
        let info = self.ask(|handles| handles.look(path))?;
        locked(&self.known).insert(path.to_owned(), info.clone());
        Ok(info)
    }

    /// Values of a part of a dataset, the last dimension fastest. They are read in pieces of limited size.
    pub(super) fn read<T: StoredNumber>(&self, path: &str, part: &[Range<usize>]) -> Result<Vec<T>, ResultError> {
        let size = |part: &[Range<usize>]| part.iter().map(ExactSizeIterator::len).product::<usize>();
        let whole = size(part);
        if whole > MOST_VALUES {
            return Err(self.refused(format!("{whole} values of /{path} are wanted at once")));
        }
        if whole > VALUES
            && let Some(at) = part.iter().position(|range| range.len() > 1)
        {
            // Halves the slowest dimension that can be halved.
            let middle = part[at].start + part[at].len() / 2;
            let [mut first, mut second] = [part.to_vec(), part.to_vec()];
            first[at].end = middle;
            second[at].start = middle;
            let mut values = self.read(path, &first)?;
            values.extend(self.read::<T>(path, &second)?);
            return Ok(values);
        }
        self.ask(|handles| handles.read(path, part))
    }

    pub(super) fn read_rows<T: StoredNumber>(&self, path: &str, rows: Range<usize>) -> Result<Vec<T>, ResultError> {
        self.read(path, std::slice::from_ref(&rows))
    }

    pub(super) fn blocks<T: StoredNumber>(
        &self,
        path: &str,
        shape: &[usize],
        block: usize,
        take: &mut dyn FnMut(Vec<T>),
    ) -> Result<(), ResultError> {
        self.blocks_of(path, &whole(shape), 0, block, take)
    }

    /// Divides a part along dimension `along`. If a single index is too large, the next dimension is divided, too.
    fn blocks_of<T: StoredNumber>(
        &self,
        path: &str,
        part: &[Range<usize>],
        along: usize,
        block: usize,
        take: &mut dyn FnMut(Vec<T>),
    ) -> Result<(), ResultError> {
        let Some(whole) = part.get(along).cloned() else {
            take(self.read(path, part)?);
            return Ok(());
        };
        let across: usize = part[along + 1..].iter().map(ExactSizeIterator::len).product();
        let step = (block / across.max(1)).max(1);
        let mut part = part.to_vec();
        for start in whole.clone().step_by(step).take_while(|_| across > 0) {
            part[along] = start..whole.end.min(start + step);
            if across > VALUES {
                self.blocks_of(path, &part, along + 1, block, take)?;
            } else {
                take(self.read(path, &part)?);
            }
        }
        Ok(())
    }

    /// A scalar text; `None` if there is no such variable, or if it is no text of fixed length in UTF-8.
    pub(super) fn text(&self, path: &str) -> Result<Option<String>, ResultError> {
        match self.dataset(path)? {
            Some(_) => self.ask(|handles| handles.text(path)),
            None => Ok(None),
        }
    }

    pub(super) fn texts(&self, path: &str) -> Result<Vec<String>, ResultError> {
        self.ask(|handles| handles.texts(path))
    }

    /// Calls `visit` for every dataset and group below the root, in the order of the file, once for each group. Fails
    /// if there are too many or too deep groups, or if the file cannot be read.
    pub(super) fn walk(
        &self,
        visit: &mut dyn FnMut(&str, GroupMember) -> Result<(), ResultError>,
    ) -> Result<(), ResultError> {
        self.walk_in("", DEPTH, &mut (HashSet::new(), 0), visit)
    }

    /// `walked` has the identities of the groups and the number of the objects so far.
    fn walk_in(
        &self,
        group: &str,
        depth: usize,
        walked: &mut (HashSet<String>, usize),
        visit: &mut dyn FnMut(&str, GroupMember) -> Result<(), ResultError>,
    ) -> Result<(), ResultError> {
        let (identity, members) = self.ask(|handles| handles.members(group))?;
        walked.0.insert(identity);
        for member in members {
            walked.1 += 1;
            if walked.1 > OBJECTS {
                return Err(self.refused(format!("has more than {OBJECTS} objects")));
            }
            let inside = joined(group, &member.name);
            let is_group = match &member.is {
                Object::Group(identity) if walked.0.contains(identity) => continue,
                Object::Group(_) if depth == 0 => {
                    return Err(self.refused(format!("has more than {DEPTH} groups within each other")));
                }
                Object::Group(_) => true,
                _ => false,
            };
            visit(&inside, member)?;
            if is_group {
                self.walk_in(&inside, depth - 1, walked, visit)?;
            }
        }
        Ok(())
    }

    pub(super) fn table(&self, group: &str) -> Result<TableReader<'_>, ResultError> {
        let members = self.members(group)?;
        let mut columns = members.iter().filter_map(|member| match &member.is {
            Object::Dataset(info) => info.shape.first(),
            _ => None,
        });
        Ok(TableReader {
            source: self,
            group: group.to_owned(),
            rows: columns.next().copied().unwrap_or(0),
        })
    }

    /// Fails at the first variable that is not over the dimensions of its group.
    pub(super) fn check_tables(&self) -> Result<(), ResultError> {
        self.uneven(1)?.into_iter().next().map_or(Ok(()), Err)
    }

    /// Returns the first `most` variables that are not over the dimensions of their groups. A group without a
    /// coordinate variable is a table in studies alone: other programs may add groups to the result of a run.
    pub(super) fn uneven(&self, most: usize) -> Result<Vec<ResultError>, ResultError> {
        let mut groups: Vec<(String, Vec<(String, DatasetInfo)>)> = vec![(String::new(), Vec::new())];
        self.walk(&mut |path, member| {
            match member.is {
                Object::Group(_) => groups.push((path.to_owned(), Vec::new())),
                Object::Dataset(info) if !info.shape.is_empty() && member.name != schema::SUMS => {
                    let of = path.rsplit_once('/').map_or("", |(group, _)| group);
                    if let Some(group) = groups.iter_mut().rev().find(|group| group.0 == of) {
                        group.1.push((path.to_owned(), info));
                    }
                }
                _ => {}
            }
            Ok(())
        })?;
        let is_run = self.text_attribute("", schema::root::FORMAT)?.as_deref() == Some(schema::FORMAT);
        let mut found = Vec::new();
        for (_, variables) in groups {
            let mut lengths = Vec::new();
            for (path, info) in &variables {
                let is_scale = || self.text_attribute(path, schema::attribute::CLASS);
                if info.shape.len() == 1 && is_scale()?.as_deref() == Some(schema::SCALE) {
                    lengths.push(info.shape[0]);
                }
            }
            if lengths.is_empty() && !is_run {
                lengths.extend(variables.first().map(|(_, info)| info.shape[0]));
            }
            let is_over = |info: &DatasetInfo| info.shape.iter().all(|length| lengths.contains(length));
            let odd = variables
                .iter()
                .filter(|(_, info)| !lengths.is_empty() && !is_over(info));
            found.extend(odd.map(|(path, info)| uneven(path, &info.shape, &lengths).of(self.path())));
            if found.len() >= most {
                break;
            }
        }
        Ok(found)
    }

    pub(super) fn missing(&self, what: impl Into<String>) -> ResultError {
        Reason::Missing(what.into()).of(&self.path)
    }

    pub(super) fn refused(&self, what: String) -> ResultError {
        Reason::BeyondLimits(what).of(&self.path)
    }
}

pub(crate) struct GroupMember {
    pub(crate) name: String,
    pub(crate) is: Object,
}

pub(crate) enum Object {
    Group(String),
    Dataset(DatasetInfo),
    Not(Reason),
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

/// The columns of a group, all as long as its first variable. Readers fail for a missing column, or one of another
/// length.
#[derive(Debug)]
pub struct TableReader<'a> {
    source: &'a FileSource,
    group: String,
    rows: usize,
}

impl TableReader<'_> {
    /// The values of a column.
    pub fn column(&self, name: &str) -> Result<Vec<f64>, ResultError> {
        Ok(self.read(name, 1)?.0)
    }

    /// The values of a column that has a second dimension, row by row, and the length of that dimension.
    pub fn matrix(&self, name: &str) -> Result<(Vec<f64>, usize), ResultError> {
        let (values, shape) = self.read(name, 2)?;
        Ok((values, shape[1]))
    }

    fn read(&self, name: &str, dimensions: usize) -> Result<(Vec<f64>, Vec<usize>), ResultError> {
        let path = joined(&self.group, name);
        let info = self.source.dataset(&path)?;
        let info = info.ok_or_else(|| self.source.missing(format!("variable {path}")))?;
        if info.shape.len() != dimensions || info.shape[0] != self.rows {
            return Err(uneven(&path, &info.shape, &[self.rows]).of(self.source.path()));
        }
        Ok((self.source.read(&path, &whole(&info.shape))?, info.shape))
    }
}

pub(super) fn joined(group: &str, name: &str) -> String {
    match group.trim_matches('/') {
        "" => name.to_owned(),
        group => format!("{group}/{name}"),
    }
}

/// The part of a dataset of this shape that is all of it.
pub(super) fn whole(shape: &[usize]) -> Vec<Range<usize>> {
    shape.iter().map(|&length| 0..length).collect()
}

/// The error of a variable whose shape does not fit the columns of its table.
pub(crate) fn uneven(path: &str, shape: &[usize], lengths: &[usize]) -> Reason {
    let (group, name) = path.rsplit_once('/').unwrap_or(("", path));
    let listed = |lengths: &[usize], by: &str| lengths.iter().map(ToString::to_string).collect::<Vec<_>>().join(by);
    let what = if shape.len() == 1 { "rows" } else { "values" };
    let (found, expected) = (listed(shape, " x "), listed(lengths, " or "));
    Reason::Uneven {
        variable: format!("/{path}"),
        what: format!("/{group} differ in length: {name} has {found} {what}, and the table {expected}"),
    }
}

/// Values that are read at a time.
pub(super) const BLOCK: usize = 65_536;

// Limits: depth of nested groups, objects in a file, and values held at once (0.5 GB).
const DEPTH: usize = 32;
const OBJECTS: usize = 65_536;
const MOST_VALUES: usize = 1 << 26;

fn check_plain(path: &Path) -> Result<(), ResultError> {
    if !path.exists() {
        return Err(Reason::NotFound.of(path));
    }
    if path.is_dir() {
        return Err(Reason::FolderIsNoResult.of(path));
    }
    // Only plain files are opened, because a pipe would block.
    let has_signature =
        || disk::has_hdf5_signature(path).map_err(|error| ResultError::io(path, "reading the file", error));
    if !path.is_file() || !has_signature()? {
        return Err(Reason::NotHdf5.of(path));
    }
    Ok(())
}
