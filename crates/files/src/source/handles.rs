//! Reads an open HDF5 file within limits.
//!
//! Nothing in a file is trusted. Names and texts are bytes until they prove to be UTF-8. Before memory is requested,
//! sizes are compared with limits and with the stored bytes.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

use hdf5::dataset::Layout;
use hdf5::file::{CacheDecreaseMode, CacheIncreaseMode, FlashIncreaseMode};
use hdf5::types::{VarLenAscii, VarLenUnicode};
use hdf5::{Attribute, Container, Dataset, Group, Hyperslab, IndexType, IterationOrder, Location, Selection};
use hdf5::{LinkType, SliceOrIndex};

use super::{DatasetInfo, GroupMember, Holds, Object, Opening, joined, probe};
use crate::Reason;
use crate::attributes::AttributeValue;
use crate::error::describe;
use crate::raw::{self, Class, Opened};
use crate::table::StoredNumber;

// Limits on what one object may hold, and on one read.
const MEMBERS: usize = 16_384;
const ATTRIBUTES: usize = 4_096;
const ATTRIBUTE_BYTES: usize = 1 << 20;
const TEXT_BYTES: usize = 16 << 20;
const TEXTS: usize = 1 << 20;
pub(super) const VALUES: usize = 1 << 23;
/// Limit: bytes of a chunk, of which HDF5 holds several copies while it unpacks it.
const CHUNK_BYTES: usize = 128 << 20;
/// Limit: values of a dataset that are not stored, and read as its fill value.
const UNSTORED: usize = 1 << 20;
/// Limit: values of a virtual dataset, whose storage is unknown.
const VIRTUAL: usize = 1 << 28;
const SOURCES: usize = 1 << 20;
const KEPT: usize = 512;
const CHUNK_SLOTS: usize = 521;

const UNNAMED: &str = "not read: the name of this attribute is not UTF-8";

pub(super) struct Handles {
    /// Declared before the file, so that the datasets are closed first.
    datasets: HashMap<String, Dataset>,
    file: hdf5::File,
    path: PathBuf,
    length: u64,
    follow_external: bool,
    growing: bool,
    looked_at: Vec<String>,
}

fn refused<T>(what: String) -> Answered<T> {
    Err(Reason::BeyondLimits(what))
}

pub(super) type Answered<T> = Result<T, Reason>;

impl Handles {
    pub(super) fn open(path: &Path, opening: &Opening) -> Answered<Handles> {
        // Metadata is read once, because the writer may change it later.
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
            .open(path)?;
        let mut handles = Handles {
            datasets: HashMap::new(),
            file,
            path: path.to_owned(),
            length: std::fs::metadata(path).map_or(0, |metadata| metadata.len()),
            follow_external: opening.follow_external,
            growing: opening.growing,
            looked_at: Vec::new(),
        };
        if opening.growing {
            handles.hold(String::new(), 4)?;
        }
        Ok(handles)
    }

    /// Reads all headers and chunk indices below a group.
    fn hold(&mut self, group: String, depth: usize) -> Answered<()> {
        for member in self.members(&group)?.1 {
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

    fn object(&self, path: &str) -> Answered<Opened> {
        let path = if path.is_empty() { "/" } else { path };
        raw::open_object(&self.file, path, self.follow_external).map_err(|error| match self.external_in(path) {
            Some(link) => Reason::Elsewhere(format!("/{}", link.trim_start_matches('/'))),
            None => error.into(),
        })
    }

    fn external_in(&self, path: &str) -> Option<String> {
        if self.follow_external {
            return None;
        }
        let mut at = String::new();
        for part in path.split('/').filter(|part| !part.is_empty()) {
            let Ok(Opened::Group(group)) = raw::open_object(&self.file, &format!("/{at}"), false) else {
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
            Opened::Other => return Err(Reason::Damaged(format!("/{path} is neither a group nor a variable"))),
        })
    }

    fn group(&self, path: &str) -> Answered<Group> {
        match self.object(path)? {
            Opened::Group(group) => Ok(group),
            _ => Err(Reason::Damaged(format!("/{path} is not a group"))),
        }
    }

    fn dataset(&mut self, path: &str) -> Answered<Dataset> {
        if let Some(dataset) = self.datasets.get(path) {
            return Ok(dataset.clone());
        }
        let Opened::Dataset(dataset) = self.object(path)? else {
            return Err(Reason::Damaged(format!("/{path} is not a variable")));
        };
        if self.datasets.len() >= KEPT && !self.growing {
            self.datasets.clear();
        }
        self.datasets.insert(path.to_owned(), dataset.clone());
        Ok(dataset)
    }

    pub(super) fn close_datasets(&mut self) {
        self.datasets.clear();
    }

    /// Identity of the group, and its members, in the order of creation if it is known, otherwise by name. HDF5 is
    /// not asked for the order: version 1.10 frees uninitialised memory in damaged files.
    pub(super) fn members(&mut self, path: &str) -> Answered<(String, Vec<GroupMember>)> {
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
                LinkType::External if !self.follow_external => Object::Not(Reason::Elsewhere(format!("/{inside}"))),
                _ => match self.object(&inside) {
                    Ok(Opened::Group(group)) => identity(&group).map_or_else(Object::Not, Object::Group),
                    Ok(Opened::Dataset(dataset)) => {
                        self.info(&dataset, &inside).map_or_else(Object::Not, Object::Dataset)
                    }
                    Ok(Opened::Other) => Object::Other,
                    // The name contains replacement characters, so that the object cannot be opened by it.
                    Err(_) if name.contains(char::REPLACEMENT_CHARACTER) => {
                        Object::Not(Reason::Unnamed(format!("/{inside}")))
                    }
                    // A dangling link is no damage. An object that cannot be opened is.
                    Err(_) if link != LinkType::Hard => Object::Other,
                    Err(fault) => Object::Not(fault),
                },
            };
            members.push(GroupMember { name, is });
        }
        Ok((identity(&group)?, members))
    }

    /// All attributes in alphabetical order, except HDF5's own.
    pub(super) fn attributes(&self, path: &str) -> Answered<Vec<(String, AttributeValue)>> {
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
            let Some(attribute) = readable(location.attr(&name))? else {
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

    /// `None` without such an object or attribute.
    pub(super) fn attribute(&self, path: &str, name: &str) -> Answered<Option<AttributeValue>> {
        let location = match self.location(path) {
            Err(Reason::Damaged(_)) if !path.is_empty() => return Ok(None),
            location => location?,
        };
        location.attr(name).map_or(Ok(None), |attribute| value_of(&attribute))
    }

    pub(super) fn look(&mut self, path: &str) -> Answered<Option<DatasetInfo>> {
        match self.dataset(path) {
            Ok(dataset) => self.info(&dataset, path).map(Some),
            Err(Reason::Damaged(_) | Reason::InUse) => Ok(None),
            Err(fault) => Err(fault),
        }
    }

    fn info(&self, dataset: &Dataset, path: &str) -> Answered<DatasetInfo> {
        // Requested once, because HDF5 copies the whole list.
        let creation = dataset.dcpl()?;
        let layout = creation.layout();
        // HDF5 may open the files of a virtual dataset to find its shape.
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
            return Err(Reason::Elsewhere(format!("/{path}")));
        }
        let stored = match (&chunk, chunks, layout) {
            (Some(chunk), Some(chunks), _) => {
                let mut lengths = chunk.iter();
                let of_one = lengths.try_fold(bytes.max(1), |size, &length| size.checked_mul(length));
                if of_one.is_none_or(|bytes| bytes > CHUNK_BYTES) {
                    let limit = CHUNK_BYTES >> 20;
                    return refused(format!(
                        "/{path} is stored in chunks {chunk:?} of more than {limit} MiB"
                    ));
                }
                chunks.saturating_mul(chunk.iter().product())
            }
            (_, _, Layout::Virtual) => VIRTUAL,
            // Users who follow links trust the external file.
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
        Ok(DatasetInfo {
            shape,
            holds,
            chunk,
            chunks,
        })
    }

    /// Values of a hyperslab of a dataset, the last dimension fastest. HDF5 converts the number type.
    pub(super) fn read<T: StoredNumber>(&mut self, path: &str, part: &[Range<usize>]) -> Answered<Vec<T>> {
        let dataset = self.dataset(path)?;
        self.look_at_sources(&dataset, path)?;
        let shape = dataset.shape();
        let inside = |(part, &length): (&Range<usize>, &usize)| part.start <= part.end && part.end <= length;
        if part.len() != shape.len() || !part.iter().zip(&shape).all(inside) {
            return Err(Reason::Damaged(format!("/{path} has no such part")));
        }
        let count = part
            .iter()
            .try_fold(1_usize, |count, part| count.checked_mul(part.len()));
        if count.is_none_or(|count| count > VALUES) {
            return refused(format!("more than {VALUES} values at once of /{path}"));
        }
        if count == Some(0) {
            return Ok(Vec::new());
        }
        let selection = match shape.is_empty() {
            true => Selection::All,
            false => {
                let slices = part.iter().map(|range| SliceOrIndex::from(range.clone()));
                Selection::Hyperslab(Hyperslab::from(slices.collect::<Vec<_>>()))
            }
        };
        let values = dataset.read_slice::<T, _, ndarray::IxDyn>(selection)?;
        Ok(values.into_raw_vec_and_offset().0)
    }

    pub(super) fn text(&mut self, path: &str) -> Answered<Option<String>> {
        let dataset = self.dataset(path)?;
        check_text(&dataset, path)?;
        Ok(raw::read_text(&dataset)?)
    }

    pub(super) fn texts(&mut self, path: &str) -> Answered<Vec<String>> {
        let dataset = self.dataset(path)?;
        if dataset.size() > TEXTS {
            return refused(format!("/{path} has more than {TEXTS} texts"));
        }
        check_text(&dataset, path)?;
        let texts: Vec<String> = match raw::class_of(&dataset)?.0 {
            Class::Text { length: Some(_), .. } => raw::read_texts(&dataset)?,
            Class::Text { unicode, .. } => varying_texts(&dataset, unicode)?,
            _ => return Err(Reason::Damaged(format!("/{path} holds no texts"))),
        };
        if texts.iter().map(String::len).sum::<usize>() > TEXT_BYTES {
            return refused(format!("the texts of /{path} are longer than {} MiB", TEXT_BYTES >> 20));
        }
        Ok(texts)
    }

    /// Checks the sources of a virtual dataset, which must be files in its own folder or below, such as shards of a
    /// sweep. HDF5 would read missing sources as fill values.
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
            match named(path, &file, &inside) {
                Err(_) if self.follow_external => continue,
                named => named?,
            }
            let (name, object) = (file.replace("%%", "%"), inside.replace("%%", "%"));
            if !opened.contains_key(&name) {
                opened.insert(name.clone(), self.open_source(&name, path)?);
            }
            match raw::open_object(&opened[&name], &object, self.follow_external) {
                // A source must store its data itself.
                Ok(Opened::Dataset(source)) if !self.follow_external && leads_on(&source)? => {
                    return Err(Reason::Elsewhere(format!("/{path}, by way of {name},")));
                }
                Ok(Opened::Dataset(_)) => {}
                _ => return Err(Reason::Absent(format!("/{path}: {name} has no {object}"))),
            }
            known.push((file, inside));
        }
        self.looked_at.push(path.to_owned());
        Ok(())
    }

    fn check_places(&self, dataset: &Dataset, path: &str) -> Answered<()> {
        let mut known = HashSet::new();
        for (file, inside) in raw::virtual_sources(dataset, SOURCES)?.unwrap_or_default() {
            named(path, &file, &inside)?;
            let name = file.replace("%%", "%");
            if name != "."
                && known.insert(name.clone())
                && let Err(fault @ Reason::Elsewhere(_)) = self.place_of(&name, path)
            {
                return Err(fault);
            }
        }
        Ok(())
    }

    fn place_of(&self, name: &str, path: &str) -> Answered<PathBuf> {
        let elsewhere = || Reason::Elsewhere(format!("/{path}, in {name},"));
        let below = |part: Component| matches!(part, Component::Normal(_) | Component::CurDir);
        if !self.follow_external && !Path::new(name).components().all(below) {
            return Err(elsewhere());
        }
        // HDF5's order of search: the folder of the file as named, the working folder, the folder of the real file.
        let named = crate::disk::folder_of(&self.path);
        let real = self.path.canonicalize().unwrap_or_else(|_| self.path.clone());
        let real = crate::disk::folder_of(&real);
        let folders = [named, Path::new(".").to_owned(), real];
        let Some(found) = folders.iter().position(|folder| folder.join(name).exists()) else {
            return Err(Reason::Absent(format!("/{path}: {name} is not there")));
        };
        let place = folders[found].join(name);
        if !self.follow_external {
            let inside = |folder: &Path| match (place.canonicalize(), folder.canonicalize()) {
                (Ok(place), Ok(folder)) => place.starts_with(folder),
                _ => false,
            };
            // A link inside the folder may lead out of it.
            if !inside(&folders[0]) && !inside(&folders[2]) {
                return Err(elsewhere());
            }
        }
        Ok(place)
    }

    fn open_source(&self, name: &str, path: &str) -> Answered<hdf5::File> {
        if name == "." {
            return Ok(self.file.clone());
        }
        let place = self.place_of(name, path)?;
        // Only plain files are opened, because a pipe would block.
        if !place.is_file() {
            return Err(Reason::Absent(format!("/{path}: {name} is no plain file")));
        }
        probe::admit(&place, self.follow_external, false)
            .map_err(|reason| Reason::Absent(format!("/{path}: {name} cannot be read ({reason})")))?;
        // HDF5 opens the source again later, and must do it in the same way as for the file that refers to it.
        hdf5::File::with_options()
            .with_fapl(|access| access.file_locking(!self.growing))
            .open(&place)
            .map_err(|error| Reason::Absent(format!("/{path}: {name} cannot be read ({})", describe(&error))))
    }
}

/// Refuses a source whose file or variable is a pattern, whose files are not listed: it has a single per cent sign. A
/// doubled one is literal.
fn named(path: &str, file: &str, inside: &str) -> Answered<()> {
    match [file, inside].iter().any(|name| name.replace("%%", "").contains('%')) {
        true => Err(Reason::Elsewhere(format!("/{path}, in {file} with {inside},"))),
        false => Ok(()),
    }
}

fn identity(group: &Group) -> Answered<String> {
    let info = group.loc_info()?;
    Ok(format!("{} {:?}", info.fileno, info.token))
}

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

fn leads_on(dataset: &Dataset) -> hdf5::Result<bool> {
    let creation = dataset.dcpl()?;
    Ok(creation.layout() == Layout::Virtual || raw::external_count(&creation)? > 0)
}

/// `None` if the object cannot be read. Lack of memory says nothing about the file, and stays an error.
fn readable<T>(result: hdf5::Result<T>) -> Answered<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) => match Reason::from(error) {
            fault if probe::lacks_memory(&fault) => Err(fault),
            _ => Ok(None),
        },
    }
}

/// `None` for unknown types and for HDF5's own attributes (references of dimension scales).
fn value_of(attribute: &Attribute) -> Answered<Option<AttributeValue>> {
    let (class, bytes) = raw::class_of(attribute)?;
    if attribute.size().saturating_mul(bytes.max(8)) > ATTRIBUTE_BYTES {
        return refused(format!(
            "the attribute {} has {} values",
            String::from_utf8_lossy(attribute.name().as_bytes()),
            attribute.size()
        ));
    }
    let scalar = attribute.is_scalar();
    // An unreadable attribute counts as missing.
    Ok(match class {
        Class::Text { length: Some(_), .. } if scalar => {
            readable(raw::read_text_lossy(attribute))?.map(AttributeValue::Text)
        }
        Class::Text { unicode, .. } if scalar => {
            let texts = readable(varying_texts(attribute, unicode))?;
            texts.and_then(|mut texts| texts.pop()).map(AttributeValue::Text)
        }
        Class::Integer { .. } => readable(attribute.read_raw::<i64>())?.map(|values| match &values[..] {
            [value] if scalar => AttributeValue::Integer(*value),
            _ => AttributeValue::Integers(values),
        }),
        Class::Float => readable(attribute.read_raw::<f64>())?.map(|values| match &values[..] {
            [value] if scalar => AttributeValue::Number(*value),
            _ => AttributeValue::Numbers(values),
        }),
        _ => None,
    })
}

/// Texts of any length; invalid UTF-8 is replaced.
fn varying_texts(object: &Container, unicode: bool) -> hdf5::Result<Vec<String>> {
    let lossy = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    match unicode {
        true => {
            let texts = object.read_raw::<VarLenUnicode>()?;
            Ok(texts.iter().map(|text| lossy(text.as_bytes())).collect())
        }
        false => {
            let texts = object.read_raw::<VarLenAscii>()?;
            Ok(texts.iter().map(|text| lossy(text.as_bytes())).collect())
        }
    }
}
