//! First read of a file in a separate process, so that a damaged file harms that process alone.
//!
//! The process gets a path, little memory, and little processor time for each step. It reads everything that this
//! program could read. Its exit status and a line of text are the verdict. Errors that HDF5 reports do not end it:
//! the program meets them later, with their place.

use std::ffi::{OsStr, OsString};
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, ExitCode, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use super::handles::VALUES;
use super::{BLOCK, DatasetInfo, FileSource, Holds, Identity, Object, follow_external, locked};
use crate::seal::{self, Seal};
use crate::{Reason, ResultError};

const ARGUMENT: &str = "--probe-hdf5";
const FOLLOW: &str = "follow";
const STAY: &str = "stay";

/// Bytes of address space allowed beyond those at the start of the process.
const MEMORY: u64 = 768 << 20;
/// Processor time for a step, such as a block of values, s: ten times the longest successful step.
const PROCESSOR: u64 = 3;
/// A file may take this long, mostly waiting for a disk or a network, plus a second for every `BYTES_PER_SECOND`.
const PATIENCE: Duration = Duration::from_secs(120);
const BYTES_PER_SECOND: u64 = 4 << 20;
/// Longest time without computing or reading, even with a slow disk.
const STANDSTILL: Duration = Duration::from_secs(6);
const LOOK: Duration = Duration::from_millis(250);

/// Exit statuses of the probe. All but the first come with a line.
const SOUND: u8 = 0;
const DAMAGED: u8 = 10;
const BEYOND_LIMITS: u8 = 11;
const IN_USE: u8 = 12;
const CHANGED: u8 = 13;
const PANICKED: i32 = 101;

static COMMAND: OnceLock<Vec<OsString>> = OnceLock::new();
static OWNS_PROCESS: AtomicBool = AtomicBool::new(false);
/// Verdicts on the latest files, each valid until the file is written to.
static KNOWN: Mutex<Vec<ProbeVerdict>> = Mutex::new(Vec::new());
const MOST_KNOWN: usize = 256;

struct ProbeVerdict {
    identity: Identity,
    follow_external: bool,
    damage: Option<String>,
}

/// Sets the command (program with arguments) that first reads an HDF5 file without an intact seal. The program must
/// pass the two additional arguments to [`probe`], and exit with its result. Without a command files are opened
/// directly, and a damaged one may crash the process. Only the first call counts.
pub fn set_probe(command: Vec<OsString>) {
    let _ = COMMAND.set(command);
}

/// Like [`set_probe`] with this program. Its `main` must call [`probe_if_asked`] first, and must not use HDF5
/// elsewhere in that process.
pub fn probe_by_this_program() {
    OWNS_PROCESS.store(true, Ordering::Relaxed);
    // If the system does not know the program, starting it will report an error.
    let program = std::env::current_exe().unwrap_or_default();
    set_probe(vec![program.into(), ARGUMENT.into()]);
}

/// Probes a file if the program's arguments request it. Returns the exit status, or `None` without a request.
pub fn probe_if_asked() -> Option<ExitCode> {
    let mut arguments = std::env::args_os().skip(1);
    (arguments.next()? == ARGUMENT).then(|| ExitCode::from(probe(arguments)))
}

/// Reads a whole file, within limits of memory and time that then remain on the process. Returns the exit status for
/// a program of [`set_probe`].
pub fn probe(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let mut arguments = arguments.into_iter();
    let (Some(follow), Some(path)) = (arguments.next(), arguments.next()) else {
        return 2;
    };
    OWNS_PROCESS.store(true, Ordering::Relaxed);
    follow_external(follow == FOLLOW);
    limit_memory();
    renew_time();
    let read = FileSource::open(Path::new(&path)).and_then(|source| read_whole(&source));
    let (status, line) = match read.map_err(|error| error.reason) {
        Ok(()) => return SOUND,
        Err(Reason::Damaged(detail)) => (DAMAGED, detail),
        Err(Reason::BeyondLimits(what)) => (BEYOND_LIMITS, what),
        Err(Reason::InUse) => (IN_USE, String::new()),
        // The run that wrote the file has ended, or the file was replaced.
        Err(other) => (CHANGED, other.to_string()),
    };
    let line: String = line.replace(char::is_control, " ").chars().take(1000).collect();
    let _ = writeln!(std::io::stdout(), "{line}");
    status
}

pub(super) fn owns_process() -> bool {
    OWNS_PROCESS.load(Ordering::Relaxed)
}

/// Whether HDF5 ran out of memory that this process may have.
pub(super) fn lacks_memory(reason: &Reason) -> bool {
    matches!(reason, Reason::Damaged(detail) if detail.contains("alloc"))
}

/// Reads everything that the program could read. Values that HDF5 refuses are skipped: the program gets the same
/// error.
fn read_whole(source: &FileSource) -> Result<(), ResultError> {
    source.attributes("")?;
    source.walk(&mut |path, member| {
        renew_time();
        let reason = match member.is {
            Object::Group(_) => return source.attributes(path).map(drop),
            Object::Dataset(info) => {
                source.attributes(path)?;
                let read = read_values(source, path, &info);
                source.close_datasets();
                match read {
                    Err(error) if lacks_memory(&error.reason) => error.reason,
                    _ => return Ok(()),
                }
            }
            Object::Not(reason) => reason,
            Object::Other => return Ok(()),
        };
        match reason {
            Reason::Damaged(detail) => Err(Reason::Damaged(format!("/{path}: {detail}")).of(source.path())),
            Reason::InUse => Err(reason.of(source.path())),
            _ => Ok(()),
        }
    })
}

/// Reads all values, several chunks at a time, so that no chunk is unpacked twice.
fn read_values(source: &FileSource, path: &str, info: &DatasetInfo) -> Result<(), ResultError> {
    let shape = &info.shape;
    if info.holds == Holds::Texts {
        if shape.is_empty() {
            source.text(path)?;
        }
        return source.texts(path).map(drop);
    }
    if !info.holds.is_number() || info.size() == 0 {
        return Ok(());
    }
    let mut block = info.chunk.clone().unwrap_or_else(|| vec![1; shape.len()]);
    for index in (0..shape.len()).rev() {
        let size = block.iter().product::<usize>().max(1);
        block[index] = match size > VALUES {
            true => (block[index] / size.div_ceil(VALUES)).max(1),
            false => block[index]
                .saturating_mul((BLOCK / size).max(1))
                .clamp(1, shape[index]),
        };
    }
    let mut start = vec![0; shape.len()];
    let mut is_first = true;
    loop {
        renew_time();
        let ranges = start.iter().zip(&block).zip(shape);
        let part: Vec<_> = ranges
            .map(|((&start, &length), &end)| start..end.min(start + length))
            .collect();
        source.read::<f64>(path, &part)?;
        if std::mem::take(&mut is_first) {
            // HDF5's conversion to integers is tested, too.
            source.read::<i64>(path, &part)?;
        }
        let mut index = shape.len();
        loop {
            if index == 0 {
                return Ok(());
            }
            index -= 1;
            start[index] += block[index];
            if start[index] < shape[index] {
                break;
            }
            start[index] = 0;
        }
    }
}

fn limit_memory() {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, setrlimit};
        // A parent that is an interpreter has mapped memory already.
        let statm = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
        let pages = statm.split(' ').next().and_then(|pages| pages.parse::<u64>().ok());
        let mapped = pages.unwrap_or(0) * rustix::param::page_size() as u64;
        for (resource, most) in [(Resource::As, mapped + MEMORY), (Resource::Core, 0)] {
            let limit = Rlimit {
                current: Some(most),
                maximum: Some(most),
            };
            // If this limit fails, the limits on time and sizes remain.
            let _ = setrlimit(resource, limit);
        }
    }
}

fn renew_time() {
    #[cfg(unix)]
    {
        use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
        use rustix::time::{ClockId, clock_gettime};
        let used = clock_gettime(ClockId::ProcessCPUTime).tv_sec.unsigned_abs();
        let limit = Rlimit {
            current: Some(used + PROCESSOR + 1),
            maximum: getrlimit(Resource::Cpu).maximum,
        };
        let _ = setrlimit(Resource::Cpu, limit);
    }
}

/// Whether HDF5 may open a file in this process: its seal is intact, or a probe has survived it. Growing files are
/// probed each time.
pub(super) fn admit(path: &Path, follow_external: bool, is_growing: bool) -> Result<(), Reason> {
    let Some(command) = COMMAND.get() else {
        return Ok(());
    };
    if is_growing {
        return run_probe(command, path, follow_external);
    }
    let identity = Identity::of(path);
    if let Some(identity) = &identity
        && let Some(known) = locked(&KNOWN)
            .iter()
            .find(|known| known.identity == *identity && known.follow_external == follow_external)
    {
        return known
            .damage
            .clone()
            .map_or(Ok(()), |damage| Err(Reason::Damaged(damage)));
    }
    let verdict = match seal::read(path) {
        Ok(Seal::Intact) => Ok(()),
        _ => run_probe(command, path, follow_external),
    };
    if Identity::of(path) != identity {
        return Err(Reason::Changed);
    }
    let damage = match &verdict {
        Ok(()) => None,
        Err(Reason::Damaged(damage)) => Some(damage.clone()),
        Err(_) => return verdict,
    };
    if let Some(identity) = identity {
        let mut known = locked(&KNOWN);
        if known.len() >= MOST_KNOWN {
            known.remove(0);
        }
        known.push(ProbeVerdict {
            identity,
            follow_external,
            damage,
        });
    }
    verdict
}

/// Lets `command` (program with arguments, see [`set_probe`]) read the file at `path`, with links to other files if
/// `follow_external`.
///
/// # Errors
/// [`Reason::Damaged`] and other faults of the file; [`Reason::NoReader`] if the process does not start, is ended
/// from outside, or makes no progress.
pub fn run_probe(command: &[OsString], path: &Path, follow_external: bool) -> Result<(), Reason> {
    let not_started = |why: String| Reason::NoReader(format!("did not start: {why}"));
    let Some((program, arguments)) = command.split_first().filter(|(program, _)| !program.is_empty()) else {
        return Err(not_started("the program cannot find itself".to_owned()));
    };
    let mut process = Command::new(program);
    process
        .args(arguments)
        .arg(OsStr::new(if follow_external { FOLLOW } else { STAY }))
        .arg(path)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        // The verdict replaces messages of the C library.
        .stderr(Stdio::null());
    // Ctrl-C is meant for the program, which may still need to read.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut process, 0);
    let mut child = process.spawn().map_err(|error| not_started(error.to_string()))?;
    let bytes = std::fs::metadata(path).map_or(0, |found| found.len());
    let patience = PATIENCE + Duration::from_secs(bytes / BYTES_PER_SECOND);
    let begun = Instant::now();
    let mut activity = Activity::of(&child);
    let status = loop {
        match child.try_wait() {
            Ok(None) => {}
            Ok(Some(status)) => break status,
            Err(error) => return Err(Reason::NoReader(format!("is lost: {error}"))),
        }
        let refusal = if begun.elapsed() >= patience {
            Reason::Damaged(format!("reading it came to no end within {} s", patience.as_secs()))
        } else if activity.has_ended(&child) {
            Reason::NoReader(format!(
                "has neither computed nor read anything for {} s, as where a disk does not answer",
                STANDSTILL.as_secs()
            ))
        } else {
            // Most files take some milliseconds.
            std::thread::sleep((begun.elapsed() / 8).clamp(Duration::from_millis(1), Duration::from_millis(50)));
            continue;
        };
        kill(&mut child);
        return Err(refusal);
    };
    let mut line = String::new();
    if let Some(output) = child.stdout.take() {
        let _ = output.take(1 << 16).read_to_string(&mut line);
    }
    verdict(status, line.trim_end())
}

/// Kills a process, and leaves it alone if it waits for a disk that does not answer.
fn kill(child: &mut Child) {
    let _ = child.kill();
    for _ in 0..40 {
        if !matches!(child.try_wait(), Ok(None)) {
            return;
        }
        std::thread::sleep(Duration::from_millis(25));
    }
}

fn verdict(status: ExitStatus, line: &str) -> Result<(), Reason> {
    let damaged = |how: String| Err(Reason::Damaged(how));
    let Some(code) = status.code() else {
        return ended_by_signal(status);
    };
    match u8::try_from(code) {
        Ok(SOUND) => Ok(()),
        Ok(DAMAGED) => damaged(line.to_owned()),
        Ok(BEYOND_LIMITS) => Err(Reason::BeyondLimits(line.to_owned())),
        Ok(IN_USE) => Err(Reason::InUse),
        Ok(CHANGED) => Err(Reason::Changed),
        _ if code == PANICKED => damaged("the process that read it gave up".to_owned()),
        _ => Err(Reason::NoReader(format!("ended by itself, with {status}"))),
    }
}

#[cfg(unix)]
fn ended_by_signal(status: ExitStatus) -> Result<(), Reason> {
    use rustix::process::Signal;
    use std::os::unix::process::ExitStatusExt;
    // Damage to a file causes none of these.
    const FROM_OUTSIDE: [Signal; 4] = [Signal::HUP, Signal::INT, Signal::KILL, Signal::TERM];
    let signal = status.signal().unwrap_or_default();
    if FROM_OUTSIDE.iter().any(|other| other.as_raw() == signal) {
        return Err(Reason::NoReader(format!(
            "was ended from outside, with signal {signal}"
        )));
    }
    Err(Reason::Damaged(if signal == Signal::XCPU.as_raw() {
        format!("reading it came to no end within {PROCESSOR} s of processor time")
    } else {
        format!(
            "the process that read it crashed with signal {signal}, or needed more than {} MiB of memory",
            MEMORY >> 20
        )
    }))
}

#[cfg(not(unix))]
fn ended_by_signal(status: ExitStatus) -> Result<(), Reason> {
    Err(Reason::NoReader(format!("ended by itself, with {status}")))
}

struct Activity {
    last: Instant,
    looked: Instant,
    /// Ticks of processor time plus bytes; `None` if the system does not tell.
    done: Option<u64>,
}

impl Activity {
    fn of(child: &Child) -> Self {
        Activity {
            last: Instant::now(),
            looked: Instant::now(),
            done: done_by(child),
        }
    }

    /// Whether the process has been idle for longer than a disk needs.
    fn has_ended(&mut self, child: &Child) -> bool {
        if self.looked.elapsed() < LOOK {
            return false;
        }
        self.looked = Instant::now();
        let done = done_by(child);
        if done.is_none() || done != self.done {
            (self.last, self.done) = (Instant::now(), done);
        }
        self.last.elapsed() >= STANDSTILL
    }
}

fn done_by(child: &Child) -> Option<u64> {
    let of_process = |name: &str| std::fs::read_to_string(format!("/proc/{}/{name}", child.id())).ok();
    let stat = of_process("stat")?;
    let ticks = stat.rsplit_once(')')?.1.split_whitespace().skip(11).take(2);
    let io = of_process("io").unwrap_or_default();
    let bytes = io.lines().filter_map(|line| {
        let (name, bytes) = line.split_once(':')?;
        ["rchar", "wchar", "read_bytes"].contains(&name).then(|| bytes.trim())
    });
    Some(ticks.chain(bytes).filter_map(|number| number.parse::<u64>().ok()).sum())
}
