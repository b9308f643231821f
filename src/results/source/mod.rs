//! An HDF5 file that this process did not write, open for reading.
//!
//! HDF5 trusts what it reads: a damaged file can crash it, keep it busy for ever, or make it ask for all memory. The
//! program therefore never opens such a file itself. A process of its own does ([`guard`]), within limits of memory and
//! time, and answers questions about it ([`protocol`], [`server`]). As a library, the same code runs in the process that
//! calls it, unless [`read_apart`] was called.

mod guard;
mod protocol;
mod server;

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};
use std::time::{Duration, SystemTime};

use super::attributes::AttributeValue;
use super::schema::{Kind, Variable, attribute};
use super::values::Number;
use super::{Reason, ResultError, disk, lock, schema};
pub(super) use guard::serve_if_asked;
use guard::{Guard, Lost};
pub(super) use protocol::{DatasetInfo, Fault, Holds, Member, Object};
use protocol::{Opening, Request};
use serde::de::DeserializeOwned;
use server::{Server, joined};

/// The program that reads files for this one, or why it is not known.
static PROGRAM: OnceLock<std::io::Result<Program>> = OnceLock::new();
static FOLLOW_EXTERNAL: AtomicBool = AtomicBool::new(false);
/// Reading processes without a file, for the next one.
static IDLE: Mutex<Vec<Guard>> = Mutex::new(Vec::new());
/// Open files that have a reading process, the one that was asked last at the end.
static APART: Mutex<Vec<Weak<Mutex<Link>>>> = Mutex::new(Vec::new());
/// So many of them: a merger has a thousand shards open. The others have a process again when they are asked.
const MOST_APART: usize = 8;
/// Files that a reading process did not survive, and how it ended: once is enough, until they are changed.
static FATAL: Mutex<Vec<(Identity, String)>> = Mutex::new(Vec::new());

/// What is the same as long as it is one file that nobody has written to.
#[derive(Debug, Clone, PartialEq)]
struct Identity {
    /// Device and file on it, where the system tells.
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

/// This program, as it was when it began.
struct Program {
    path: PathBuf,
    identity: Option<Identity>,
}

impl Program {
    /// Where it is now. A program that is replaced while it runs is still there under a name of the system's, which
    /// under valgrind is that of another program.
    fn path(&self) -> &Path {
        let own = Path::new("/proc/self/exe");
        let is_there = self.identity.is_some() && Identity::of(&self.path) == self.identity;
        if is_there || !own.exists() { &self.path } else { own }
    }
}

/// From now on HDF5 files are read by processes of their own, which are this same program: its `main` has to call
/// [`serve_if_asked`](super::serve_if_asked) first. If the system does not say which program this is, opening a file is an error.
pub fn read_apart() {
    let program = std::env::current_exe().map(|path| Program {
        identity: Identity::of(&path),
        path,
    });
    let _ = PROGRAM.set(program);
}

/// Ends the processes that wait for another file to read: to be called before the program ends, which else leaves them to
/// the system.
pub fn end_reading() {
    let idle = std::mem::take(&mut *locked(&IDLE));
    drop(idle);
}

/// Whether links into other files, data stored in other files, and virtual datasets over files elsewhere are followed;
/// at first they are not.
pub fn follow_external(follow: bool) {
    FOLLOW_EXTERNAL.store(follow, Ordering::Relaxed);
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An open file.
pub(super) struct Source {
    path: PathBuf,
    growing: bool,
    link: Arc<Mutex<Link>>,
    /// How it was opened, and what it was then: to do so again.
    opening: Option<(Opening, Option<Identity>)>,
    known: Mutex<HashMap<String, Option<DatasetInfo>>>,
}

impl std::fmt::Debug for Source {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Source")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

/// What a variable says of itself.
#[derive(Debug, Default)]
pub(super) struct Described {
    pub(super) units: Option<String>,
    pub(super) long_name: Option<String>,
    /// What its codes mean; empty where it has none.
    pub(super) flags: Vec<(i64, String)>,
    /// What stands for nothing.
    pub(super) fill: Option<AttributeValue>,
}

impl Described {
    /// The same with a name and a type.
    pub(super) fn variable(self, name: String, kind: Kind) -> Variable {
        Variable {
            name,
            kind,
            fill: self.count_fill(),
            units: self.units.unwrap_or_default(),
            long_name: self.long_name.unwrap_or_default(),
            flags: self.flags,
        }
    }

    /// What stands for nothing in a variable of counts.
    pub(super) fn count_fill(&self) -> Option<i64> {
        self.fill.as_ref().and_then(AttributeValue::integer)
    }
}

enum Link {
    Here(Box<Server>),
    Apart(Guard),
    /// Another file has the process for the time being.
    Parked,
    /// The process is no more: how it ended over the file.
    Gone(String),
}

impl Link {
    fn new() -> Result<Link, Lost> {
        let Some(program) = PROGRAM.get() else {
            return Ok(Link::Here(Box::default()));
        };
        if cfg!(not(unix)) {
            return Ok(Link::Here(Box::default()));
        }
        while let Some(mut guard) = locked(&IDLE).pop() {
            if guard.is_there() {
                return Ok(Link::Apart(guard));
            }
        }
        let started = match program {
            Ok(program) => Guard::start(program.path()).map_err(|error| error.to_string()),
            Err(error) => Err(format!("the program cannot find itself: {error}")),
        };
        started
            .map(Link::Apart)
            .map_err(|why| Lost::Stopped(format!("did not start: {why}")))
    }

    fn ask(&mut self, request: &Request) -> Result<Vec<u8>, Lost> {
        let lost = match self {
            Link::Here(server) => return server.answer(request).map_err(Lost::Fault),
            Link::Gone(how) => return Err(Lost::Ended(how.clone())),
            Link::Parked => return Err(Lost::Stopped("was taken for another file".to_owned())),
            Link::Apart(guard) => match guard.ask(request) {
                Err(lost @ Lost::Ended(_)) => lost,
                Err(lost @ Lost::Stopped(_)) => {
                    *self = Link::Parked;
                    return Err(lost);
                }
                Err(Lost::Fault(fault)) => {
                    guard.trusted &= !matches!(fault, Fault::Hdf5(_));
                    return Err(Lost::Fault(fault));
                }
                other => return other,
            },
        };
        if let Lost::Ended(how) = &lost {
            *self = Link::Gone(how.clone());
        }
        Err(lost)
    }
}

/// Keeps the process of a link for the next file, if nothing has gone wrong in it.
fn release(link: Link) {
    if let Link::Apart(mut guard) = link
        && guard.trusted
        && guard.ask(&Request::Close).is_ok()
    {
        let mut idle = locked(&IDLE);
        if idle.len() < 2 {
            idle.push(guard);
        }
    }
}

/// Takes the processes of those files that were asked longest ago, so that one more file can have one.
fn make_room() {
    let mut apart = locked(&APART);
    apart.retain(|link| link.strong_count() > 0);
    let mut at = 0;
    while apart.len() >= MOST_APART && at < apart.len() {
        let link = apart[at].upgrade();
        // One that is just being asked keeps its own.
        let taken = link.as_ref().and_then(|link| {
            let mut link = link.try_lock().ok()?;
            Some(std::mem::replace(&mut *link, Link::Parked))
        });
        match taken {
            Some(link) => {
                release(link);
                apart.remove(at);
            }
            None => at += 1,
        }
    }
}

impl Drop for Source {
    fn drop(&mut self) {
        release(std::mem::replace(&mut *locked(&self.link), Link::Parked));
    }
}

/// How often a growing file is opened until nobody wrote to it meanwhile, and the time between.
const ATTEMPTS: usize = 50;
const PAUSE: Duration = Duration::from_millis(20);

impl Source {
    /// Opens a file, whatever HDF5 file it is.
    ///
    /// A file that a run is just writing is read as its last flush left it, and stays so.
    pub(super) fn open(path: &Path) -> Result<Source, ResultError> {
        Self::open_with(path, None)
    }

    /// The same of a file that is not of a newer version of the program, if it is the program's.
    pub(super) fn open_known(path: &Path) -> Result<Source, ResultError> {
        let source = Self::open(path)?;
        let known = i64::from(schema::FORMAT_VERSION);
        match source.attribute("", schema::root::FORMAT_VERSION)? {
            Some(AttributeValue::Integer(found)) if found > known => Err(Reason::Newer { found, known }.of(path)),
            _ => Ok(source),
        }
    }

    /// The same of one of the program's files, which is of this format.
    pub(super) fn open_format(path: &Path, format: &str) -> Result<Source, ResultError> {
        let source = Self::open_known(path)?;
        let found = source.text_attribute("", schema::root::FORMAT)?;
        match found.as_deref() == Some(format) {
            true => Ok(source),
            false => Err(Reason::NotAResult(found).of(path)),
        }
    }

    /// As [`Self::open`] with so many bytes kept of each variable: of a compressed chunk beyond HDF5's own choice every block of
    /// rows is unpacked again.
    pub(super) fn open_with(path: &Path, chunk_cache: Option<usize>) -> Result<Source, ResultError> {
        check_plain(path)?;
        if let Some(identity) = Identity::of(path)
            && let Some((_, how)) = locked(&FATAL).iter().find(|(fatal, _)| *fatal == identity)
        {
            return Err(fatal(path, how));
        }
        let opening = Opening {
            path: path.as_os_str().to_owned(),
            follow_external: FOLLOW_EXTERNAL.load(Ordering::Relaxed),
            chunk_cache,
            growing: false,
        };
        for _ in 0..ATTEMPTS {
            let Some(before) = lock::flushes(path) else {
                return Self::opened(path, opening);
            };
            if before.is_multiple_of(2) {
                let growing = Opening {
                    growing: true,
                    ..opening.clone()
                };
                let opened = Self::opened(path, growing);
                if lock::flushes(path) == Some(before) {
                    return opened;
                }
                if !path.exists() {
                    return Err(Reason::Ended.of(path));
                }
            }
            std::thread::sleep(PAUSE);
        }
        Err(Reason::Growing.of(path))
    }

    /// A file that this process has written and still has open.
    pub(super) fn of_open(file: &hdf5::File) -> Source {
        Source {
            path: PathBuf::from(file.filename()),
            growing: false,
            link: Arc::new(Mutex::new(Link::Here(Box::new(Server::of_open(file))))),
            opening: None,
            known: Mutex::default(),
        }
    }

    fn opened(path: &Path, opening: Opening) -> Result<Source, ResultError> {
        let source = Source {
            path: path.to_owned(),
            growing: opening.growing,
            link: Arc::new(Mutex::new(Link::Parked)),
            opening: Some((opening, Identity::of(path))),
            known: Mutex::default(),
        };
        source.open_again(&mut locked(&source.link))?;
        Ok(source)
    }

    /// Gives a file that has none a reading process.
    fn open_again(&self, link: &mut Link) -> Result<(), ResultError> {
        let Some((opening, identity)) = &self.opening else {
            return Ok(());
        };
        // What a growing file was when it was opened cannot be had again: it keeps its process, and is not counted.
        if !self.growing {
            make_room();
        }
        if Identity::of(&self.path) != *identity && !self.growing {
            return Err(Reason::Changed.of(&self.path));
        }
        *link = Link::new().map_err(|lost| error_of(&self.path, lost))?;
        if let Err(lost) = link.ask(&Request::Open(opening.clone())) {
            return Err(error_of(&self.path, lost));
        }
        if !self.growing && matches!(link, Link::Apart(_)) {
            let mut apart = locked(&APART);
            apart.retain(|link| link.as_ptr() != Arc::as_ptr(&self.link));
            apart.push(Arc::downgrade(&self.link));
        }
        Ok(())
    }

    /// Says that this file was asked last.
    fn touch(&self) {
        let mut apart = locked(&APART);
        let own = Arc::as_ptr(&self.link);
        if let Some(at) = apart.iter().position(|link| link.as_ptr() == own) {
            let link = apart.remove(at);
            apart.push(link);
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether a run was writing the file when it was opened.
    pub(super) fn is_growing(&self) -> bool {
        self.growing
    }

    fn ask(&self, request: &Request) -> Result<Vec<u8>, ResultError> {
        let mut link = locked(&self.link);
        if matches!(*link, Link::Parked) {
            self.open_again(&mut link)?;
        } else if matches!(*link, Link::Apart(_)) {
            self.touch();
        }
        link.ask(request).map_err(|lost| error_of(&self.path, lost))
    }

    fn unexpected(&self) -> ResultError {
        fatal(&self.path, "the process that read it answered another question")
    }

    /// Asks for something that is no list of numbers.
    fn get<T: DeserializeOwned>(&self, request: &Request) -> Result<T, ResultError> {
        postcard::from_bytes(&self.ask(request)?).map_err(|_| self.unexpected())
    }

    /// What a group has, in the order of creation where the file knows it.
    pub(super) fn members(&self, group: &str) -> Result<Vec<Member>, ResultError> {
        self.identity_and_members(group).map(|found| found.1)
    }

    /// What is the same for two links to the group, and its members.
    fn identity_and_members(&self, group: &str) -> Result<(String, Vec<Member>), ResultError> {
        self.get(&Request::Members(group.to_owned()))
    }

    /// All attributes of a group or a dataset, in alphabetical order.
    pub(super) fn attributes(&self, object: &str) -> Result<Vec<(String, AttributeValue)>, ResultError> {
        self.get(&Request::Attributes(object.to_owned()))
    }

    /// One attribute; `None` if there is none of this name that can be read.
    pub(super) fn attribute(&self, object: &str, name: &str) -> Result<Option<AttributeValue>, ResultError> {
        self.get(&Request::Attribute(object.to_owned(), name.to_owned()))
    }

    /// The same if it is a text.
    pub(super) fn text_attribute(&self, object: &str, name: &str) -> Result<Option<String>, ResultError> {
        Ok(match self.attribute(object, name)? {
            Some(AttributeValue::Text(text)) => Some(text),
            _ => None,
        })
    }

    /// What the attributes of a variable say of it.
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

    /// What a dataset is; `None` if there is none of this path.
    pub(super) fn dataset(&self, path: &str) -> Result<Option<DatasetInfo>, ResultError> {
        if let Some(known) = locked(&self.known).get(path) {
            return Ok(known.clone());
        }
        let info: Option<DatasetInfo> = self.get(&Request::Dataset(path.to_owned()))?;
        locked(&self.known).insert(path.to_owned(), info.clone());
        Ok(info)
    }

    /// A part of a dataset, the last dimension fastest, in pieces that are not too large for one answer.
    pub(super) fn read<T: Number>(&self, path: &str, part: &[Range<usize>]) -> Result<Vec<T>, ResultError> {
        let size = |part: &[Range<usize>]| part.iter().map(ExactSizeIterator::len).product::<usize>();
        let whole = size(part);
        if whole > MOST_VALUES {
            return Err(self.refused(format!("{whole} values of /{path} are wanted at once")));
        }
        if whole > server::VALUES
            && let Some(at) = part.iter().position(|range| range.len() > 1)
        {
            // Halves of the slowest dimension that can be halved.
            let middle = part[at].start + part[at].len() / 2;
            let [mut first, mut second] = [part.to_vec(), part.to_vec()];
            first[at].end = middle;
            second[at].start = middle;
            let mut values = self.read(path, &first)?;
            values.extend(self.read::<T>(path, &second)?);
            return Ok(values);
        }
        let slab = part
            .iter()
            .map(|range| (range.start as u64, range.len() as u64))
            .collect();
        let values = T::from_bytes(&self.ask(&Request::Read(path.to_owned(), slab, T::KIND))?);
        if values.len() == whole {
            Ok(values)
        } else {
            Err(self.unexpected())
        }
    }

    /// Rows of a dataset of one dimension.
    pub(super) fn read_rows<T: Number>(&self, path: &str, rows: Range<usize>) -> Result<Vec<T>, ResultError> {
        self.read(path, std::slice::from_ref(&rows))
    }

    /// Hands a whole dataset to `take`, about `block` values at a time.
    pub(super) fn blocks<T: Number>(
        &self,
        path: &str,
        shape: &[usize],
        block: usize,
        take: &mut dyn FnMut(Vec<T>),
    ) -> Result<(), ResultError> {
        let part: Vec<Range<usize>> = shape.iter().map(|&length| 0..length).collect();
        self.blocks_of(path, &part, 0, block, take)
    }

    /// The same of a part that is divided along its dimension `along`, and, where one index of that is too much, along the next.
    fn blocks_of<T: Number>(
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
        // Of an empty dataset nothing is read.
        for start in whole.clone().step_by(step).take_while(|_| across > 0) {
            part[along] = start..whole.end.min(start + step);
            if across > server::VALUES {
                self.blocks_of(path, &part, along + 1, block, take)?;
            } else {
                take(self.read(path, &part)?);
            }
        }
        Ok(())
    }

    /// A scalar text of fixed length in UTF-8; `None` if it is something else.
    pub(super) fn text(&self, path: &str) -> Result<Option<String>, ResultError> {
        self.get(&Request::Text(path.to_owned()))
    }

    /// A column of texts.
    pub(super) fn texts(&self, path: &str) -> Result<Vec<String>, ResultError> {
        self.get(&Request::Texts(path.to_owned()))
    }

    /// Calls `visit` for every dataset and group below the root, in the order of the file, each group once.
    ///
    /// # Errors
    /// A file with more of them, or deeper ones, than anyone writes; one that cannot be read.
    pub(super) fn walk(
        &self,
        visit: &mut dyn FnMut(&str, &Member) -> Result<(), ResultError>,
    ) -> Result<(), ResultError> {
        let mut walk = Walk {
            seen: HashSet::new(),
            count: 0,
            visit,
        };
        self.walk_in("", DEPTH, &mut walk)
    }

    fn walk_in(&self, group: &str, depth: usize, walk: &mut Walk) -> Result<(), ResultError> {
        let (identity, members) = self.identity_and_members(group)?;
        walk.seen.insert(identity);
        for member in members {
            walk.count += 1;
            if walk.count > OBJECTS {
                return Err(self.refused(format!("has more than {OBJECTS} objects")));
            }
            let inside = joined(group, &member.name);
            if let Object::Group(identity) = &member.is {
                if walk.seen.contains(identity) {
                    continue;
                }
                if depth == 0 {
                    return Err(self.refused(format!("has more than {DEPTH} groups within each other")));
                }
                (walk.visit)(&inside, &member)?;
                self.walk_in(&inside, depth - 1, walk)?;
            } else {
                (walk.visit)(&inside, &member)?;
            }
        }
        Ok(())
    }

    /// The error of what a listing has found unreadable.
    pub(super) fn fault(&self, fault: &Fault) -> ResultError {
        error_of(&self.path, Lost::Fault(fault.clone()))
    }

    /// The error of a file that lacks what one of this program has.
    pub(super) fn missing(&self, what: impl Into<String>) -> ResultError {
        Reason::Missing(what.into()).of(&self.path)
    }

    pub(super) fn refused(&self, what: String) -> ResultError {
        Reason::BeyondLimits(what).of(&self.path)
    }
}

struct Walk<'a> {
    seen: HashSet<String>,
    count: usize,
    visit: &'a mut dyn FnMut(&str, &Member) -> Result<(), ResultError>,
}

/// Groups within groups, and objects in a file, that are looked at.
const DEPTH: usize = 32;
const OBJECTS: usize = 65_536;
/// Values that are held at once: 0.5 GB of them.
const MOST_VALUES: usize = 1 << 26;

/// Something that is done to a file: at a path, with what is needed for it.
pub(super) type Change = fn(&Path, &[u8]) -> hdf5::Result<()>;

/// Changes the file at `path`, a copy of one that this process did not write. A reading process does it, with the `Change`
/// that [`serve_if_asked`] was given.
pub(super) fn change_apart(path: &Path, with: Vec<u8>, change: Change) -> Result<(), ResultError> {
    let changed = Link::new().and_then(|mut link| match link {
        Link::Here(_) => change(path, &with).map_err(|error| Lost::Fault(error.into())),
        _ => link.ask(&Request::Change(path.as_os_str().to_owned(), with)).map(drop),
    });
    changed.map_err(|lost| match lost {
        Lost::Fault(Fault::Hdf5(detail)) => ResultError::write_detail(path, false, detail),
        lost => error_of(path, lost),
    })
}

/// Whether `path` can be an HDF5 file.
fn check_plain(path: &Path) -> Result<(), ResultError> {
    if !path.exists() {
        return Err(Reason::NotFound.of(path));
    }
    if path.is_dir() {
        return Err(Reason::FolderIsNoResult.of(path));
    }
    // Not opened unless it is a plain file: a pipe, for one, would block.
    let has_signature =
        || disk::has_hdf5_signature(path).map_err(|error| ResultError::io(path, "reading the file", error));
    if !path.is_file() || !has_signature()? {
        return Err(Reason::NotHdf5.of(path));
    }
    Ok(())
}

fn error_of(path: &Path, lost: Lost) -> ResultError {
    match lost {
        Lost::Fault(Fault::Hdf5(detail)) => ResultError::read_detail(path, detail),
        Lost::Fault(Fault::Refused(what)) => Reason::BeyondLimits(what).of(path),
        Lost::Fault(Fault::Unnamed(place)) => Reason::Unnamed(place).of(path),
        Lost::Fault(Fault::Absent(what)) => Reason::Absent(what).of(path),
        Lost::Fault(Fault::Elsewhere(what)) => Reason::Elsewhere(what).of(path),
        Lost::Stopped(detail) => Reason::NoReader(detail).of(path),
        Lost::Ended(how) => {
            let error = fatal(path, &how);
            let mut fatal = locked(&FATAL);
            if let Some(identity) = Identity::of(path)
                && !fatal.iter().any(|(known, _)| *known == identity)
            {
                fatal.push((identity, how));
            }
            error
        }
    }
}

fn fatal(path: &Path, how: &str) -> ResultError {
    Reason::Damaged(how.to_owned()).of(path)
}
