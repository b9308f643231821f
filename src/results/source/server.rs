//! Reads HDF5 files by request, within limits.
//!
//! Nothing that a file says is believed before it is checked: names and texts are bytes until they are found to be
//! UTF-8, and a size is held against a limit, and against what the file can store, before memory is asked for.

use std::collections::{HashMap, HashSet};
use std::path::{Component, Path, PathBuf};

use hdf5::dataset::Layout;
use hdf5::file::{CacheDecreaseMode, CacheIncreaseMode, FlashIncreaseMode};
use hdf5::filters::Filter;
use hdf5::types::{VarLenAscii, VarLenUnicode};
use hdf5::{Attribute, Container, Dataset, Group, Hyperslab, IndexType, IterationOrder, Location, Selection};
use hdf5::{LinkType, SliceOrIndex};
use serde::Serialize;

use super::Change;
use super::protocol::{DatasetInfo, Fault, Holds, Member, Object, Opening, Request};
use crate::results::attributes::AttributeValue;
use crate::results::error::describe;
use crate::results::raw::{self, Class, Opened};
use crate::results::schema::Kind;
use crate::results::values::{Number, with_type};

/// Most members of a group, and most attributes of an object.
const MEMBERS: usize = 16_384;
const ATTRIBUTES: usize = 4_096;
/// Bytes of the values of an attribute.
const ATTRIBUTE_BYTES: usize = 1 << 20;
/// Bytes of a text, and of a column of texts.
const TEXT_BYTES: usize = 16 << 20;
/// Texts in a column.
const TEXTS: usize = 1 << 20;
/// Values read at once.
pub(super) const VALUES: usize = 1 << 23;
/// Bytes of a chunk: HDF5 holds some copies of one while it unpacks it.
const CHUNK_BYTES: usize = 128 << 20;
/// Values that a dataset may have without being stored: they are read as its fill value.
const UNSTORED: usize = 1 << 20;
/// The same where they are in other files, and what is stored there is not known.
const VIRTUAL: usize = 1 << 28;
/// Files and datasets that a virtual dataset may be made of.
const SOURCES: usize = 1 << 20;
/// Datasets that are kept open.
const KEPT: usize = 512;
/// HDF5's own choice.
const CHUNK_SLOTS: usize = 521;

/// In place of the value of an attribute that cannot be asked for.
const UNNAMED: &str = "not read: the name of this attribute is not UTF-8";

/// Answers requests about one file.
#[derive(Default)]
pub(super) struct Server {
    /// Before the file, so that they are closed first.
    datasets: HashMap<String, Dataset>,
    file: Option<hdf5::File>,
    path: PathBuf,
    length: u64,
    follow_external: bool,
    growing: bool,
    /// Virtual datasets whose sources were looked at.
    looked_at: Vec<String>,
    /// What it does to files, in a process of its own.
    change: Option<Change>,
}

impl From<hdf5::Error> for Fault {
    fn from(error: hdf5::Error) -> Self {
        Fault::Hdf5(describe(&error))
    }
}

fn refused<T>(what: String) -> Result<T, Fault> {
    Err(Fault::Refused(what))
}

type Answered<T> = Result<T, Fault>;

fn packed(answer: &impl Serialize) -> Answered<Vec<u8>> {
    postcard::to_allocvec(answer).map_err(|error| Fault::Hdf5(error.to_string()))
}

impl Server {
    /// Without a file.
    pub(super) fn new(change: Option<Change>) -> Self {
        Server {
            change,
            ..Server::default()
        }
    }

    /// Of a file that this process has written and still has open.
    pub(super) fn of_open(file: &hdf5::File) -> Self {
        Server {
            file: Some(file.clone()),
            length: u64::MAX,
            follow_external: true,
            ..Server::default()
        }
    }

    /// Answers a request: numbers as they lie in memory, and all else as postcard has it.
    pub(super) fn answer(&mut self, request: &Request) -> Answered<Vec<u8>> {
        match request {
            Request::Open(opening) => self.open(opening).map(|()| Vec::new()),
            Request::Members(path) => packed(&(identity(&self.group(path)?)?, self.members(path)?)),
            Request::Attributes(path) => packed(&self.attributes(path)?),
            Request::Attribute(path, name) => {
                let attribute = self.location(path)?.attr(name).ok();
                packed(&attribute.map_or(Ok(None), |attribute| value_of(&attribute))?)
            }
            Request::Dataset(path) => packed(&match self.dataset(path) {
                Ok(dataset) => Some(self.info(&dataset, path)?),
                Err(Fault::Hdf5(_)) => None,
                Err(fault) => return Err(fault),
            }),
            Request::Read(path, part, kind) => self.read(path, part, *kind),
            Request::Text(path) => {
                let dataset = self.dataset(path)?;
                check_text(&dataset, path)?;
                packed(&raw::read_text(&dataset)?)
            }
            Request::Texts(path) => packed(&self.texts(path)?),
            Request::Change(path, with) => {
                let only_reads = || Fault::Hdf5("this process only reads".to_owned());
                self.change.ok_or_else(only_reads)?(Path::new(path), with)?;
                Ok(Vec::new())
            }
            Request::Close => {
                self.forget();
                Ok(Vec::new())
            }
        }
    }

    /// Closes the file.
    fn forget(&mut self) {
        *self = Server::new(self.change);
    }

    fn open(&mut self, opening: &Opening) -> Answered<()> {
        self.forget();
        self.path = PathBuf::from(&opening.path);
        self.length = std::fs::metadata(&self.path).map_or(0, |metadata| metadata.len());
        self.follow_external = opening.follow_external;
        self.growing = opening.growing;
        // What has been read of where the data are is not read again: the writer may have changed it since.
        let cache = hdf5::file::MetadataCacheConfig {
            evictions_enabled: false,
            incr_mode: CacheIncreaseMode::Off,
            decr_mode: CacheDecreaseMode::Off,
            flash_incr_mode: FlashIncreaseMode::Off,
            ..Default::default()
        };
        let file = hdf5::File::with_options()
            .with_fapl(|access| {
                access.file_locking(!opening.growing);
                if let Some(bytes) = opening.chunk_cache {
                    access.chunk_cache(CHUNK_SLOTS, bytes, 1.0);
                }
                if opening.growing {
                    access.mdc_config(&cache);
                }
                access
            })
            .open(&self.path)?;
        self.file = Some(file);
        if self.growing {
            self.hold(String::new(), 4)?;
        }
        Ok(())
    }

    /// Reads all headers and indices of chunks below a group.
    fn hold(&mut self, group: String, depth: usize) -> Answered<()> {
        for member in self.members(&group)? {
            let path = joined(&group, &member.name);
            match member.is {
                Object::Dataset(_) => {
                    self.dataset(&path)?;
                }
                Object::Group(_) if depth > 0 => self.hold(path, depth - 1)?,
                _ => {}
            }
        }
        self.attributes(&group).map(drop)
    }

    fn file(&self) -> Answered<&hdf5::File> {
        self.file
            .as_ref()
            .ok_or_else(|| Fault::Hdf5("no file is open".to_owned()))
    }

    /// A group, a dataset, or the root.
    fn object(&self, path: &str) -> Answered<Opened> {
        let file = self.file()?;
        let path = if path.is_empty() { "/" } else { path };
        raw::open_object(file, path, self.follow_external).map_err(|error| match self.external_in(path) {
            Some(link) => Fault::Elsewhere(format!("/{}", link.trim_start_matches('/'))),
            None => error.into(),
        })
    }

    /// The link into another file that a path leads through, if there is one.
    fn external_in(&self, path: &str) -> Option<String> {
        let file = self.file.as_ref().filter(|_| !self.follow_external)?;
        let mut at = String::new();
        for part in path.split('/').filter(|part| !part.is_empty()) {
            let Ok(Opened::Group(group)) = raw::open_object(file, &format!("/{at}"), false) else {
                return None;
            };
            let found = group.find_link(IndexType::Name, IterationOrder::Native, |name, info| {
                Ok((name == part).then_some(info.link_type))
            });
            at = joined(&at, part);
            if found.ok()? == Some(LinkType::External) {
                return Some(at);
            }
        }
        None
    }

    fn location(&self, path: &str) -> Answered<Location> {
        Ok(match self.object(path)? {
            Opened::Group(group) => (*group).clone(),
            Opened::Dataset(dataset) => (**dataset).clone(),
            Opened::Other => return Err(Fault::Hdf5(format!("/{path} is neither a group nor a variable"))),
        })
    }

    fn group(&self, path: &str) -> Answered<Group> {
        match self.object(path)? {
            Opened::Group(group) => Ok(group),
            _ => Err(Fault::Hdf5(format!("/{path} is not a group"))),
        }
    }

    fn dataset(&mut self, path: &str) -> Answered<Dataset> {
        if let Some(dataset) = self.datasets.get(path) {
            return Ok(dataset.clone());
        }
        let Opened::Dataset(dataset) = self.object(path)? else {
            return Err(Fault::Hdf5(format!("/{path} is not a variable")));
        };
        if self.datasets.len() >= KEPT && !self.growing {
            self.datasets.clear();
        }
        self.datasets.insert(path.to_owned(), dataset.clone());
        Ok(dataset)
    }

    /// In the order of creation where the file knows it, else by name. HDF5 is not asked for that order: in damaged files
    /// its version 1.10 frees memory that it has not set.
    fn members(&mut self, path: &str) -> Answered<Vec<Member>> {
        let group = self.group(path)?;
        let mut names: Vec<(Option<i64>, String, LinkType)> = Vec::new();
        let visited = group.iter_visit(IndexType::Name, IterationOrder::Native, |name, info| {
            if names.len() >= MEMBERS {
                return Err("too many".into());
            }
            names.push((info.creation_order, name.to_owned(), info.link_type));
            Ok(())
        });
        if names.len() >= MEMBERS {
            return refused(format!("the group /{path} has more than {MEMBERS} members"));
        }
        visited?;
        names.sort_by(|a, b| (a.0, &a.1).cmp(&(b.0, &b.1)));
        let mut members = Vec::with_capacity(names.len());
        for (_, name, link) in names {
            let inside = joined(path, &name);
            let is = match link {
                LinkType::External if !self.follow_external => Object::Not(Fault::Elsewhere(format!("/{inside}"))),
                _ => match self.object(&inside) {
                    Ok(Opened::Group(group)) => identity(&group).map_or_else(Object::Not, Object::Group),
                    Ok(Opened::Dataset(dataset)) => {
                        self.info(&dataset, &inside).map_or_else(Object::Not, Object::Dataset)
                    }
                    Ok(Opened::Other) => Object::Other,
                    // The name came with replacements, which are no part of it.
                    Err(_) if name.contains(char::REPLACEMENT_CHARACTER) => {
                        Object::Not(Fault::Unnamed(format!("/{inside}")))
                    }
                    // A link that leads nowhere is no damage; an object that cannot be opened is.
                    Err(_) if link != LinkType::Hard => Object::Other,
                    Err(fault) => Object::Not(fault),
                },
            };
            members.push(Member { name, is });
        }
        Ok(members)
    }

    /// In alphabetical order, without those that are HDF5's own.
    fn attributes(&self, path: &str) -> Answered<Vec<(String, AttributeValue)>> {
        let location = self.location(path)?;
        let mut names = Vec::new();
        let visited = location.iter_attrs(IndexType::Name, IterationOrder::Native, |name, _| {
            if names.len() >= ATTRIBUTES {
                return Err("too many".into());
            }
            names.push(name.to_owned());
            Ok(())
        });
        if names.len() >= ATTRIBUTES {
            return refused(format!("/{path} has more than {ATTRIBUTES} attributes"));
        }
        visited?;
        names.sort();
        let mut attributes = Vec::with_capacity(names.len());
        for name in names {
            let Ok(attribute) = location.attr(&name) else {
                if name.contains(char::REPLACEMENT_CHARACTER) {
                    attributes.push((name, AttributeValue::Text(UNNAMED.to_owned())));
                }
                continue;
            };
            if let Some(value) = value_of(&attribute)? {
                attributes.push((name, value));
            }
        }
        Ok(attributes)
    }

    fn info(&self, dataset: &Dataset, path: &str) -> Answered<DatasetInfo> {
        // Asked for once: HDF5 makes a copy of the whole list.
        let creation = dataset.dcpl()?;
        let layout = creation.layout();
        // For the shape of one HDF5 may open the files that it is made of.
        if layout == Layout::Virtual && !self.follow_external {
            self.check_places(dataset, path)?;
        }
        let shape = dataset.shape();
        let (class, bytes) = raw::class_of(dataset)?;
        let holds = match class {
            Class::Integer { signed: true } => Holds::Integers(bytes),
            Class::Integer { signed: false } => Holds::Unsigned(bytes),
            Class::Float => Holds::Floats(bytes),
            Class::Text { .. } => Holds::Texts,
            Class::Other(name) => Holds::Other(name.to_owned()),
        };
        let size = shape.iter().try_fold(1_usize, |size, &length| size.checked_mul(length));
        let Some(size) = size.filter(|size| size.checked_mul(bytes.max(8)).is_some_and(|bytes| bytes < 1 << 60)) else {
            return refused(format!(
                "/{path} claims the shape {shape:?}, more than any file can hold"
            ));
        };
        let chunk = creation.chunk();
        let chunks = chunk.as_ref().and_then(|_| dataset.num_chunks());
        if !self.follow_external && raw::external_count(&creation)? > 0 {
            return Err(Fault::Elsewhere(format!("/{path}")));
        }
        let stored = match (&chunk, chunks, layout) {
            (Some(chunk), Some(chunks), _) => {
                let of_one = chunk
                    .iter()
                    .try_fold(bytes.max(1), |size, &length| size.checked_mul(length));
                if of_one.is_none_or(|bytes| bytes > CHUNK_BYTES) {
                    let limit = CHUNK_BYTES >> 20;
                    return refused(format!(
                        "/{path} is stored in chunks {chunk:?} of more than {limit} MiB"
                    ));
                }
                chunks.saturating_mul(chunk.iter().product())
            }
            (_, _, Layout::Virtual) => VIRTUAL,
            // An external file is taken at its word.
            _ if self.follow_external => usize::MAX,
            _ => dataset.storage_size() as usize / bytes.max(1),
        };
        if layout != Layout::Virtual && !self.growing && dataset.storage_size() > self.length && !self.follow_external {
            return refused(format!(
                "/{path} claims {} bytes of a file of {}",
                dataset.storage_size(),
                self.length
            ));
        }
        if size > UNSTORED.max(stored) {
            return refused(format!("/{path} claims {size} values and stores {stored}"));
        }
        let covered = match chunk {
            Some(_) => creation.filters().contains(&Filter::Fletcher32),
            None => layout == Layout::Virtual,
        };
        Ok(DatasetInfo {
            shape,
            holds,
            chunk,
            chunks,
            covered,
        })
    }

    fn read(&mut self, path: &str, part: &[(u64, u64)], kind: Kind) -> Answered<Vec<u8>> {
        let dataset = self.dataset(path)?;
        self.look_at_sources(&dataset, path)?;
        let shape = dataset.shape();
        let count = part.iter().try_fold(1_u64, |count, part| count.checked_mul(part.1));
        let inside = |(&(start, count), &length): (&(u64, u64), &usize)| {
            start.checked_add(count).is_some_and(|end| end <= length as u64)
        };
        if part.len() != shape.len() || !part.iter().zip(&shape).all(inside) {
            return Err(Fault::Hdf5(format!("/{path} has no such part")));
        }
        if count.is_none_or(|count| count > VALUES as u64) {
            return refused(format!("more than {VALUES} values at once of /{path}"));
        }
        let selection = if shape.is_empty() {
            Selection::All
        } else {
            let slices = part
                .iter()
                .map(|&(start, count)| SliceOrIndex::from(start as usize..(start + count) as usize));
            Selection::Hyperslab(Hyperslab::from(slices.collect::<Vec<_>>()))
        };
        if count == Some(0) {
            return Ok(Vec::new());
        }
        Ok(with_type!(kind, numbers(&dataset, selection))?)
    }

    fn texts(&mut self, path: &str) -> Answered<Vec<String>> {
        let dataset = self.dataset(path)?;
        if dataset.size() > TEXTS {
            return refused(format!("/{path} has more than {TEXTS} texts"));
        }
        check_text(&dataset, path)?;
        let texts: Vec<String> = match raw::class_of(&dataset)?.0 {
            Class::Text { length: Some(_), .. } => raw::read_texts(&dataset)?,
            Class::Text { unicode, .. } => varying_texts(&dataset, unicode)?,
            _ => return Err(Fault::Hdf5(format!("/{path} holds no texts"))),
        };
        if texts.iter().map(String::len).sum::<usize>() > TEXT_BYTES {
            return refused(format!("the texts of /{path} are longer than {} MiB", TEXT_BYTES >> 20));
        }
        Ok(texts)
    }

    /// A virtual dataset may be made of files beside the one that has it, or in folders below: the shards of a sweep. What is
    /// not there HDF5 would read as a fill value.
    fn look_at_sources(&mut self, dataset: &Dataset, path: &str) -> Answered<()> {
        if dataset.layout() != Layout::Virtual || self.looked_at.iter().any(|known| known == path) {
            return Ok(());
        }
        let sources = raw::virtual_sources(dataset, SOURCES)?;
        let Some(sources) = sources else {
            return refused(format!("/{path} is made of more than {SOURCES} parts"));
        };
        let mut opened: HashMap<String, hdf5::File> = HashMap::new();
        let mut known: Vec<(String, String)> = Vec::new();
        for (file, inside) in sources {
            if known.last().is_some_and(|last| *last == (file.clone(), inside.clone())) {
                continue;
            }
            if is_pattern(&file) || is_pattern(&inside) {
                if self.follow_external {
                    continue;
                }
                return Err(Fault::Elsewhere(format!("/{path}, in {file} with {inside},")));
            }
            let (name, object) = (file.replace("%%", "%"), inside.replace("%%", "%"));
            if !opened.contains_key(&name) {
                opened.insert(name.clone(), self.open_source(&name, path)?);
            }
            let source = opened
                .get(&name)
                .map(|other| raw::open_object(other, &object, self.follow_external));
            match source {
                // What is there is stored there: else the way would lead on.
                Some(Ok(Opened::Dataset(source))) if !self.follow_external && leads_on(&source)? => {
                    return Err(Fault::Elsewhere(format!("/{path}, by way of {name},")));
                }
                Some(Ok(Opened::Dataset(_))) => {}
                _ => return Err(Fault::Absent(format!("/{path}: {name} has no {object}"))),
            }
            known.push((file, inside));
        }
        self.looked_at.push(path.to_owned());
        Ok(())
    }

    /// Refuses a virtual dataset that is made of files elsewhere, without opening one of them.
    fn check_places(&self, dataset: &Dataset, path: &str) -> Answered<()> {
        let mut known = HashSet::new();
        for (file, inside) in raw::virtual_sources(dataset, SOURCES)?.unwrap_or_default() {
            if is_pattern(&file) || is_pattern(&inside) {
                return Err(Fault::Elsewhere(format!("/{path}, in {file} with {inside},")));
            }
            let name = file.replace("%%", "%");
            if name != "."
                && known.insert(name.clone())
                && let Err(fault @ Fault::Elsewhere(_)) = self.place_of(&name, path)
            {
                return Err(fault);
            }
        }
        Ok(())
    }

    /// Where a file is that a virtual dataset is made of.
    fn place_of(&self, name: &str, path: &str) -> Answered<PathBuf> {
        let elsewhere = || Fault::Elsewhere(format!("/{path}, in {name},"));
        let below = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
        if !self.follow_external && !Path::new(name).components().all(below) {
            return Err(elsewhere());
        }
        // Where HDF5 looks, in this order: beside the file as it was named, in the folder of work, beside the file itself.
        let named = crate::results::disk::folder_of(&self.path);
        let real = self.path.canonicalize().unwrap_or_else(|_| self.path.clone());
        let real = crate::results::disk::folder_of(&real);
        let folders = [named, Path::new(".").to_owned(), real];
        let Some(found) = folders.iter().position(|folder| folder.join(name).exists()) else {
            return Err(Fault::Absent(format!("/{path}: {name} is not there")));
        };
        let place = folders[found].join(name);
        if !self.follow_external {
            let inside = |folder: &Path| match (place.canonicalize(), folder.canonicalize()) {
                (Ok(place), Ok(folder)) => place.starts_with(folder),
                _ => false,
            };
            // A link in the folder may lead out of it.
            if !inside(&folders[0]) && !inside(&folders[2]) {
                return Err(elsewhere());
            }
        }
        Ok(place)
    }

    /// Opens a file that a virtual dataset is made of.
    fn open_source(&self, name: &str, path: &str) -> Answered<hdf5::File> {
        if name == "." {
            return self.file().cloned();
        }
        let place = self.place_of(name, path)?;
        // Not opened unless it is a plain file: a pipe, for one, would block.
        if !place.is_file() {
            return Err(Fault::Absent(format!("/{path}: {name} is no plain file")));
        }
        // HDF5 opens it once more, as it has opened the file that refers to it; the two ways have to be one.
        hdf5::File::with_options()
            .with_fapl(|access| access.file_locking(!self.growing))
            .open(&place)
            .map_err(|error| Fault::Absent(format!("/{path}: {name} cannot be read ({})", describe(&error))))
    }
}

/// A per cent sign is written twice; a single one begins a pattern of names, whose files nobody lists.
fn is_pattern(name: &str) -> bool {
    name.replace("%%", "").contains('%')
}

fn numbers<T: Number>(dataset: &Dataset, selection: Selection) -> hdf5::Result<Vec<u8>> {
    let values = dataset.read_slice::<T, _, ndarray::IxDyn>(selection)?;
    Ok(T::to_bytes(values.iter().copied()))
}

fn identity(group: &Group) -> Answered<String> {
    let info = group.loc_info()?;
    Ok(format!("{} {:?}", info.fileno, info.token))
}

/// Refuses a text whose memory is too much to ask for.
fn check_text(object: &Container, path: &str) -> Answered<()> {
    let (class, _) = raw::class_of(object)?;
    if let Class::Text {
        length: Some(length), ..
    } = class
        && length.saturating_mul(object.size()) > TEXT_BYTES
    {
        return refused(format!("/{path} claims a text of {length} bytes"));
    }
    Ok(())
}

/// Whether a dataset has its values in others, or in other files.
fn leads_on(dataset: &Dataset) -> hdf5::Result<bool> {
    let creation = dataset.dcpl()?;
    Ok(creation.layout() == Layout::Virtual || raw::external_count(&creation)? > 0)
}

/// `None` for what is HDF5's own (references of dimension scales), and for types that are not known.
fn value_of(attribute: &Attribute) -> Answered<Option<AttributeValue>> {
    let (class, bytes) = raw::class_of(attribute)?;
    if attribute.size().saturating_mul(bytes.max(8)) > ATTRIBUTE_BYTES {
        return refused(format!(
            "the attribute {} has {} values",
            // The binding takes it for UTF-8.
            String::from_utf8_lossy(attribute.name().as_bytes()),
            attribute.size()
        ));
    }
    let scalar = attribute.is_scalar();
    // An attribute that cannot be read counts as one that is not there.
    Ok(match class {
        Class::Text { length: Some(_), .. } if scalar => raw::read_text_lossy(attribute).ok().map(AttributeValue::Text),
        Class::Text { unicode, .. } if scalar => {
            let text = varying_texts(attribute, unicode).ok().and_then(|mut texts| texts.pop());
            text.map(AttributeValue::Text)
        }
        Class::Integer { .. } => attribute.read_raw::<i64>().ok().map(|values| match &values[..] {
            [value] if scalar => AttributeValue::Integer(*value),
            _ => AttributeValue::Integers(values),
        }),
        Class::Float => attribute.read_raw::<f64>().ok().map(|values| match &values[..] {
            [value] if scalar => AttributeValue::Number(*value),
            _ => AttributeValue::Numbers(values),
        }),
        _ => None,
    })
}

/// Texts of any length; what is not UTF-8 is replaced.
fn varying_texts(object: &Container, unicode: bool) -> hdf5::Result<Vec<String>> {
    let lossy = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ok(match unicode {
        true => object
            .read_raw::<VarLenUnicode>()?
            .iter()
            .map(|text| lossy(text.as_bytes()))
            .collect(),
        false => object
            .read_raw::<VarLenAscii>()?
            .iter()
            .map(|text| lossy(text.as_bytes()))
            .collect(),
    })
}

/// The path of a member of a group.
pub(super) fn joined(group: &str, name: &str) -> String {
    match group.trim_matches('/') {
        "" => name.to_owned(),
        group => format!("{group}/{name}"),
    }
}
