//! A process of its own that reads a file, so that whatever a damaged one does to HDF5 happens there.
//!
//! The program starts itself again with [`ARGUMENT`] and its own number as a process. The two speak through a pair of sockets ([`super::protocol`]). The
//! reading process has little memory and, for each request, little processor time: if it crashes, or does not come to an
//! end, that is an error like any other.

use std::path::Path;
use std::process::ExitCode;

use super::Change;
use super::protocol::{Fault, Request};

/// The argument that makes the program a reading process.
pub(crate) const ARGUMENT: &str = "--read-hdf5-for-parent";

/// Why there is no answer.
pub(super) enum Lost {
    /// The file's fault, or its refusal.
    Fault(Fault),
    /// The process ended over the file: how.
    Ended(String),
    /// The process ended, or never began, and nothing says that it was the file's fault: how.
    Stopped(String),
}

#[cfg(unix)]
mod imp {
    use std::io::{self, ErrorKind, Read};
    use std::os::fd::OwnedFd;
    use std::os::unix::net::UnixStream;
    use std::os::unix::process::{CommandExt, ExitStatusExt};
    use std::process::{Child, Command, ExitStatus, Stdio};
    use std::time::{Duration, Instant};

    use super::super::protocol::{receive, send};
    use super::super::server::Server;
    use super::*;
    use crate::results::raw;

    /// Memory of the process, in bytes of address space.
    const MEMORY: u64 = 768 << 20;
    /// Processor time for one request: none takes a tenth of it that makes its way.
    const PROCESSOR: Duration = Duration::from_secs(3);
    /// Time for one request, most of it spent waiting for a disk or a network.
    const PATIENCE: Duration = Duration::from_secs(120);
    /// Time in which a process that does not answer computes or reads something, however slow the disk.
    const STANDSTILL: Duration = Duration::from_secs(6);
    /// Less processor time in it is that of its thread which looks for the program.
    const IDLING: Duration = Duration::from_millis(20);
    /// A change comes with sums over what is in the file: so many of its bytes take a second at most, compressed as they are.
    const SUMMED: u64 = 4 << 20;
    /// What a reading process says first: it is the one that speaks this language.
    const HELLO: &str = concat!(env!("CARGO_PKG_VERSION"), " ", env!("STICKSLIP_COMMIT"));
    /// How often the two are looked at.
    const LOOK: Duration = Duration::from_millis(250);

    /// A reading process.
    pub(in super::super) struct Guard {
        /// Whether HDF5 has reported no error in it, from which it may not have recovered.
        pub(in super::super) trusted: bool,
        child: Child,
        stream: UnixStream,
    }

    impl Guard {
        /// Starts one, and waits until it has said what it is.
        ///
        /// # Errors
        /// If the program cannot be started, ends before it says a word, or is of another build.
        pub(in super::super) fn start(program: &Path) -> io::Result<Guard> {
            let (stream, theirs) = UnixStream::pair()?;
            let child = Command::new(program)
                .arg(ARGUMENT)
                .arg(std::process::id().to_string())
                .stdin(Stdio::from(OwnedFd::from(theirs.try_clone()?)))
                .stdout(Stdio::from(OwnedFd::from(theirs)))
                // What the C library has to say of damaged memory is said by the error.
                .stderr(Stdio::null())
                // Ctrl-C is for the program, which may still want to read.
                .process_group(0)
                .spawn()?;
            let mut guard = Guard {
                trusted: true,
                child,
                stream,
            };
            guard.stream.set_read_timeout(Some(PATIENCE))?;
            guard.stream.set_write_timeout(Some(PATIENCE))?;
            match receive::<String>(&mut guard.stream) {
                Ok((hello, _)) if hello == HELLO => {}
                Ok(_) => {
                    return Err(io::Error::other(
                        "the program was replaced while it ran: start it again",
                    ));
                }
                Err(_) => {
                    let how = match guard.status() {
                        Some(status) => format!("it ended at once, with {status}"),
                        None => "it said nothing".to_owned(),
                    };
                    return Err(io::Error::other(how));
                }
            }
            guard.stream.set_read_timeout(Some(LOOK))?;
            Ok(guard)
        }

        /// Whether it still waits for requests.
        pub(in super::super) fn is_there(&mut self) -> bool {
            matches!(self.child.try_wait(), Ok(None))
        }

        /// Sends a request and waits for its answer.
        pub(in super::super) fn ask(&mut self, request: &Request) -> Result<Vec<u8>, Lost> {
            let before = self.processor_time();
            if send(&mut self.stream, request, &[]).is_err() {
                return Err(self.end());
            }
            let more = match request {
                Request::Change(path, _) => {
                    let bytes = std::fs::metadata(path).map_or(0, |found| found.len());
                    Duration::from_secs(bytes / SUMMED)
                }
                _ => Duration::ZERO,
            };
            let mut patient = Patient {
                processor: PROCESSOR + more,
                patience: PATIENCE + more,
                guard: self,
                since: Instant::now(),
                before,
                moved: (Instant::now(), before, None),
                out_of: None,
            };
            let received = receive::<Result<(), Fault>>(&mut patient);
            let out_of = patient.out_of;
            match (received, out_of) {
                (Ok((answered, answer)), _) => answered.map(|()| answer).map_err(Lost::Fault),
                (Err(_), Some(lost)) => {
                    self.kill();
                    Err(lost)
                }
                (Err(_), None) => Err(self.end()),
            }
        }

        /// How the process ended, if it has.
        fn status(&mut self) -> Option<ExitStatus> {
            // It closes its end of the stream before it is gone.
            for _ in 0..40 {
                if let Ok(Some(status)) = self.child.try_wait() {
                    return Some(status);
                }
                std::thread::sleep(Duration::from_millis(25));
            }
            None
        }

        /// How the process ended, which it has, or else does now.
        fn end(&mut self) -> Lost {
            use rustix::process::Signal;
            const FROM_OUTSIDE: [Signal; 4] = [Signal::HUP, Signal::INT, Signal::KILL, Signal::TERM];
            let Some(status) = self.status() else {
                self.kill();
                return Lost::Ended("the process that read it answered with nonsense".to_owned());
            };
            match status.signal() {
                // Nothing that a file does to HDF5 has these.
                Some(signal) if FROM_OUTSIDE.iter().any(|other| other.as_raw() == signal) => {
                    Lost::Stopped(format!("was ended from outside, with signal {signal}"))
                }
                Some(signal) => Lost::Ended(format!(
                    "the process that read it crashed with signal {signal}, or needed more than {} MiB of memory",
                    MEMORY >> 20
                )),
                // That of a panic.
                None if status.code() == Some(101) => Lost::Ended("the process that read it gave up".to_owned()),
                None => Lost::Stopped(format!("ended by itself, with {status}")),
            }
        }

        /// Ends it. One that waits for a disk which does not answer cannot be ended before it does, and is left.
        fn kill(&mut self) {
            let _ = self.child.kill();
            let _ = self.status();
        }

        /// Bytes that the process has asked for, written, or been given by a disk; `None` where the system does not say.
        fn moved(&self) -> Option<u64> {
            let io = std::fs::read_to_string(format!("/proc/{}/io", self.child.id())).ok()?;
            let bytes = io.lines().filter_map(|line| {
                let (name, bytes) = line.split_once(':')?;
                ["rchar", "wchar", "read_bytes"]
                    .contains(&name)
                    .then(|| bytes.trim().parse::<u64>().ok())?
            });
            Some(bytes.sum())
        }

        /// What the process has used; `None` where the system does not say.
        fn processor_time(&self) -> Option<Duration> {
            let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id())).ok()?;
            let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
            let ticks = fields.get(11)?.parse::<u64>().ok()? + fields.get(12)?.parse::<u64>().ok()?;
            Some(Duration::from_secs_f64(
                ticks as f64 / rustix::param::clock_ticks_per_second() as f64,
            ))
        }
    }

    impl Drop for Guard {
        fn drop(&mut self) {
            self.kill();
        }
    }

    /// The stream, as long as the process is within its limits.
    struct Patient<'a> {
        guard: &'a mut Guard,
        /// Its limits for this request.
        processor: Duration,
        patience: Duration,
        since: Instant,
        before: Option<Duration>,
        /// When the process was last seen to have done something, and what it had used and moved until then.
        moved: (Instant, Option<Duration>, Option<u64>),
        /// The limit that was reached.
        out_of: Option<Lost>,
    }

    impl Read for Patient<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            loop {
                match self.guard.stream.read(buffer) {
                    Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                    other => return other,
                }
                let (processor, moved) = (self.guard.processor_time(), self.guard.moved());
                let used = match (processor, self.before) {
                    (Some(now), Some(before)) => now.saturating_sub(before),
                    _ => Duration::ZERO,
                };
                let computes = match (processor, self.moved.1) {
                    (Some(now), Some(before)) => now.saturating_sub(before) >= IDLING,
                    _ => true,
                };
                if computes || moved != self.moved.2 {
                    self.moved = (Instant::now(), processor, moved);
                } else if self.moved.0.elapsed() >= STANDSTILL {
                    self.out_of = Some(Lost::Stopped(format!(
                        "has neither computed nor read anything for {} s, as where a disk does not answer",
                        STANDSTILL.as_secs()
                    )));
                    return Err(io::Error::other("at a standstill"));
                }
                let waited = self.since.elapsed();
                let (limit, words) = if used >= self.processor {
                    (self.processor, " of processor time")
                } else if waited >= self.patience {
                    (self.patience, "")
                } else {
                    continue;
                };
                let seconds = limit.as_secs();
                self.out_of = Some(Lost::Ended(format!(
                    "reading it came to no end within {seconds} s{words}"
                )));
                return Err(io::Error::other("out of time"));
            }
        }
    }

    /// What a reading process does until nobody asks any more, for the process of this number.
    pub(super) fn serve(parent: u32, change: Change) -> io::Result<()> {
        use rustix::process::{Resource, Rlimit, setrlimit};
        let limit = |most| Rlimit {
            current: Some(most),
            maximum: Some(most),
        };
        // Where a system has no such limit, the one on time remains.
        let _ = setrlimit(Resource::As, limit(MEMORY));
        let _ = setrlimit(Resource::Core, limit(0));
        // A limit on the size of files is an error of the write; without the feature, the end of this process says so.
        #[cfg(feature = "cli")]
        signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default())?;
        // One that computes does not see that the program has been killed, which it may have been already.
        std::thread::Builder::new().stack_size(64 << 10).spawn(move || {
            while std::os::unix::process::parent_id() == parent {
                std::thread::sleep(Duration::from_secs(1));
            }
            std::process::abort()
        })?;
        let duplicate = |fd: std::os::fd::BorrowedFd| fd.try_clone_to_owned().map(UnixStream::from);
        let mut input = duplicate(std::os::fd::AsFd::as_fd(&io::stdin()))?;
        let mut output = duplicate(std::os::fd::AsFd::as_fd(&io::stdout()))?;
        send(&mut output, &HELLO, &[])?;
        let mut server = Server::new(Some(change));
        let mut forgotten = false;
        loop {
            let request: Request = match receive(&mut input) {
                Ok((request, _)) => request,
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(()),
                Err(error) => return Err(error),
            };
            if let Request::Open(opening) = &request
                && !opening.follow_external
                && !std::mem::replace(&mut forgotten, true)
            {
                raw::forget_external_links().map_err(io::Error::other)?;
            }
            let (answered, answer) = match server.answer(&request) {
                Ok(answer) => (Ok(()), answer),
                Err(fault) => (Err(fault), Vec::new()),
            };
            send(&mut output, &answered, &answer)?;
        }
    }
}

#[cfg(unix)]
pub(super) use imp::Guard;

/// Where there are no sockets of this kind files are read in the program itself.
#[cfg(not(unix))]
pub(super) struct Guard {
    pub(super) trusted: bool,
}

#[cfg(not(unix))]
impl Guard {
    pub(super) fn start(_: &Path) -> std::io::Result<Guard> {
        Err(std::io::ErrorKind::Unsupported.into())
    }

    pub(super) fn is_there(&mut self) -> bool {
        false
    }

    pub(super) fn ask(&mut self, _: &Request) -> Result<Vec<u8>, Lost> {
        Err(Lost::Stopped("is not there".to_owned()))
    }
}

/// Reads HDF5 files for the program that started this one, and changes them in this way, if that is what the arguments
/// ask for.
pub(in crate::results) fn serve_if_asked(change: Change) -> Option<ExitCode> {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next()? != ARGUMENT {
        return None;
    }
    let parent = arguments.next()?.to_str()?.parse::<u32>().ok()?;
    if arguments.next().is_some() {
        return None;
    }
    #[cfg(unix)]
    let served = imp::serve(parent, change);
    #[cfg(not(unix))]
    let served: std::io::Result<()> = {
        let _ = (parent, change);
        Ok(())
    };
    Some(match served {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::FAILURE,
    })
}
