//! A sweep over the ranks of an MPI job.
//!
//! Rank 0 knows the study's points and hands them out one by one, so that long and short ones balance; it runs points
//! itself, too. Every other rank stores what it ran in a journal of its own before it reports it, so that a crash loses
//! the points under way alone, and rank 0 puts the journals together at the end. Only the main thread of a process calls
//! MPI; its other threads run points. Waiting is by looking now and then: a blocking receive would keep a processor busy.

use super::crew::{Crew, Delivery, Work};
use super::journal::{Cursor, Existing, Journal, JournalError, from_message, rank_journal_path, to_message};
use super::quantities::Outcome;
use super::runner::{Stopped, run_points};
use super::study::Point;
use crate::case::Setting;
use mpi::environment::Universe;
use mpi::point_to_point::{Message, Status};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, MatchedReceiveVec, Source};
use mpi::{Rank, Tag};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant};

/// How long a process that waits sleeps before it looks again.
const PAUSE: Duration = Duration::from_micros(200);

/// Ranks that have not ended their work after this long are taken for lost. A run looks at the flag at every step.
const PATIENCE: Duration = Duration::from_secs(20);

/// Points that wait at a rank, so that it need not wait for the next, where points are short.
const AHEAD: usize = 2;

/// Points are short below this.
const SHORT: Duration = Duration::from_millis(20);

/// Messages to a rank: begin, a point, stop what is under way, leave.
const BEGIN: Tag = 1;
const POINT: Tag = 2;
const STOP: Tag = 3;
const LEAVE: Tag = 4;
/// Messages from a rank: outcomes, its points were abandoned, an error, it has left.
const OUTCOMES: Tag = 11;
const STOPPED: Tag = 12;
const FAILED: Tag = 13;
const LEFT: Tag = 14;

/// MPI in this process, from its initialisation to its end.
pub struct Session {
    universe: Universe,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Session").finish_non_exhaustive()
    }
}

impl Session {
    /// Initialises MPI; `None` if it has been before, or cannot be used by a process of several threads.
    pub fn start() -> Option<Self> {
        let (universe, threading) = mpi::initialize_with_threading(mpi::Threading::Funneled)?;
        (threading >= mpi::Threading::Funneled).then_some(Session { universe })
    }

    /// Which process of the job this is, from 0.
    pub fn rank(&self) -> usize {
        self.universe.world().rank() as usize
    }

    /// How many processes the job has.
    pub fn size(&self) -> usize {
        self.universe.world().size() as usize
    }

    /// Tells every rank the digest of every rank's study, 64 digits; `None` from a rank that could not read it. To be called
    /// by all of them.
    pub fn digests(&self, own: Option<&str>) -> Vec<Option<String>> {
        const LENGTH: usize = 64;
        let mut sent = [0u8; LENGTH];
        if let Some(own) = own {
            let length = own.len().min(LENGTH);
            sent[..length].copy_from_slice(&own.as_bytes()[..length]);
        }
        let mut received = vec![0u8; LENGTH * self.size()];
        self.universe.world().all_gather_into(&sent[..], &mut received[..]);
        received
            .chunks(LENGTH)
            .map(|digest| {
                let known = digest.iter().any(|&byte| byte != 0);
                known.then(|| String::from_utf8_lossy(digest).into_owned())
            })
            .collect()
    }

    /// Ends all processes of the job at once, with this exit status.
    pub fn abort(&self, status: i32) -> ! {
        self.universe.world().abort(status)
    }
}

/// The ranks beside rank 0, as rank 0 sees them.
pub struct Ranks {
    world: SimpleCommunicator,
    members: Vec<Member>,
}

struct Member {
    rank: Rank,
    /// Points it has.
    out: usize,
    left: bool,
}

impl std::fmt::Debug for Ranks {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Ranks")
            .field("members", &self.members.len())
            .finish_non_exhaustive()
    }
}

/// The next message, if there is one.
fn next_message(world: &SimpleCommunicator) -> Option<(Vec<u8>, Status)> {
    let found: Option<(Message, Status)> = world.any_process().immediate_matched_probe();
    found.map(MatchedReceiveVec::matched_receive_vec::<u8>)
}

impl Ranks {
    /// On rank 0: the others, each of which is to call [`serve`].
    pub fn new(session: &Session) -> Self {
        let world = session.universe.world();
        let members = (1..world.size()).map(|rank| Member {
            rank,
            out: 0,
            left: false,
        });
        Ranks {
            members: members.collect(),
            world,
        }
    }

    fn tell(&self, member: &Member, tag: Tag, bytes: &[u8]) {
        self.world.process_at_rank(member.rank).send_with_tag(bytes, tag);
    }

    fn member(&mut self, status: &Status) -> Option<&mut Member> {
        let rank = status.source_rank();
        self.members.iter_mut().find(|member| member.rank == rank)
    }
}

/// Leaving without a word would leave the other ranks waiting.
impl Drop for Ranks {
    fn drop(&mut self) {
        let _ = self.dismiss();
    }
}

/// What has to be known on rank 0 while points are under way.
struct Round {
    started: Instant,
    done: usize,
    exhausted: bool,
    interrupted: bool,
    error: Option<Stopped<JournalError>>,
    /// Until when the ranks have to answer, once they were told to stop.
    deadline: Option<Instant>,
}

impl Round {
    /// How many points a rank may have.
    fn slots(&self, threads: usize, processes: usize) -> usize {
        let all = threads * processes;
        // Not before every thread has had one: the first may be slow.
        let known = self.done >= 2 * all;
        let average = self.started.elapsed() * all as u32 / self.done.max(1) as u32;
        if known && average < SHORT {
            threads + AHEAD
        } else {
            threads
        }
    }

    fn fail(&mut self, error: Stopped<JournalError>) {
        self.error = self.error.take().or(Some(error));
    }
}

impl Crew for Ranks {
    fn begin(&mut self) {
        for member in &self.members {
            self.tell(member, BEGIN, &[]);
        }
    }

    fn run(
        &mut self,
        work: &Work,
        points: &mut (dyn Iterator<Item = Point> + Send),
        deliver: &mut dyn FnMut(Delivery) -> Result<(), JournalError>,
    ) -> Result<(), Stopped<JournalError>> {
        let threads = work.workers.max(1);
        let points = Mutex::new(points);
        let next = || points.lock().unwrap_or_else(PoisonError::into_inner).next();
        // Set for the threads of this process, whoever wants them to stop.
        let halt = AtomicBool::new(false);
        let (sender, own_outcomes) = mpsc::channel::<Vec<Outcome>>();
        let mut round = Round {
            started: Instant::now(),
            done: 0,
            exhausted: false,
            interrupted: false,
            error: None,
            deadline: None,
        };
        let own_end = std::thread::scope(|scope| {
            let own = scope.spawn(|| {
                // Moved in here, so that the channel ends with the threads.
                let sender = sender;
                run_points(
                    work.study,
                    std::iter::from_fn(next),
                    threads,
                    &halt,
                    work.integrate,
                    |group| sender.send(group),
                )
            });
            loop {
                round.interrupted |= work.stop.load(Ordering::Relaxed);
                let giving_up = round.interrupted || round.error.is_some();
                if giving_up && round.deadline.is_none() {
                    halt.store(true, Ordering::Relaxed);
                    round.deadline = Some(Instant::now() + PATIENCE);
                    for member in self.members.iter().filter(|member| member.out > 0) {
                        self.tell(member, STOP, &[]);
                    }
                }
                if !giving_up {
                    self.hand_out(&next, &mut round, threads);
                }
                // Asked before the channel is emptied for the last time.
                let own_done = own.is_finished();
                let mut idle = true;
                while let Some((bytes, status)) = next_message(&self.world) {
                    idle = false;
                    self.hear(&bytes, &status, &mut round, deliver);
                }
                while let Ok(group) = own_outcomes.try_recv() {
                    idle = false;
                    round.done += group.len();
                    if let Err(error) = deliver(Delivery::Unstored(group)) {
                        round.fail(Stopped::Delivery(error));
                    }
                }
                let out: usize = self.members.iter().map(|member| member.out).sum();
                let late = round.deadline.is_some_and(|deadline| Instant::now() > deadline);
                if own_done && (late || out == 0 && (giving_up || round.exhausted)) {
                    break own.join();
                }
                if idle {
                    std::thread::sleep(PAUSE);
                }
            }
        });
        match (round.error, own_end) {
            (Some(error), _) => Err(error),
            (None, Ok(Err(Stopped::Storage(message)))) => Err(Stopped::Storage(message)),
            (None, Err(_)) => Err(Stopped::Storage(
                "internal error: the threads of rank 0 panicked".to_owned(),
            )),
            _ if round.interrupted => Err(Stopped::Interrupted),
            _ => Ok(()),
        }
    }

    fn dismiss(&mut self) -> Vec<usize> {
        for member in self.members.iter().filter(|member| !member.left) {
            self.tell(member, LEAVE, &[]);
        }
        let deadline = Instant::now() + PATIENCE;
        while self.members.iter().any(|member| !member.left) && Instant::now() < deadline {
            match next_message(&self.world) {
                Some((_, status)) if status.tag() == LEFT => {
                    if let Some(member) = self.member(&status) {
                        member.left = true;
                    }
                }
                Some(_) => {}
                None => std::thread::sleep(PAUSE),
            }
        }
        let silent = self.members.iter().filter(|member| !member.left);
        let silent: Vec<usize> = silent.map(|member| member.rank as usize).collect();
        // Once is enough: whoever is silent stays so.
        self.members.clear();
        silent
    }
}

impl Ranks {
    /// Gives every rank as many points as it may have, one to each in turn.
    fn hand_out(&mut self, next: &dyn Fn() -> Option<Point>, round: &mut Round, threads: usize) {
        let slots = round.slots(threads, self.members.len() + 1);
        let mut given = true;
        while given && !round.exhausted {
            given = false;
            for k in 0..self.members.len() {
                if self.members[k].out >= slots {
                    continue;
                }
                let Some(point) = next() else {
                    round.exhausted = true;
                    return;
                };
                self.tell(&self.members[k], POINT, &write_point(&point));
                self.members[k].out += 1;
                given = true;
            }
        }
        if self.members.is_empty() {
            // Rank 0 is alone, and its own threads see the end.
            round.exhausted = true;
        }
    }

    fn hear(
        &mut self,
        bytes: &[u8],
        status: &Status,
        round: &mut Round,
        deliver: &mut dyn FnMut(Delivery) -> Result<(), JournalError>,
    ) {
        let rank = status.source_rank();
        let Some(member) = self.member(status) else { return };
        match status.tag() {
            OUTCOMES => match from_message(bytes) {
                Some(outcomes) => {
                    member.out = member.out.saturating_sub(outcomes.len());
                    round.done += outcomes.len();
                    if let Err(error) = deliver(Delivery::Stored(outcomes)) {
                        round.fail(Stopped::Delivery(error));
                    }
                }
                None => round.fail(Stopped::Storage(format!(
                    "rank {rank} sent something that is not understood"
                ))),
            },
            STOPPED => {
                member.out = 0;
                // By a signal of its own, or because it was told to.
                round.interrupted = true;
            }
            FAILED => {
                member.out = 0;
                let message = String::from_utf8_lossy(bytes);
                round.fail(Stopped::Storage(format!("rank {rank}: {message}")));
            }
            LEFT => {
                member.out = 0;
                member.left = true;
                round.interrupted = true;
            }
            _ => {}
        }
    }
}

/// On every rank but 0: runs the points that rank 0 hands out, until it is told to leave. `path` is the sweep file, whose
/// neighbour the journal of this rank is.
///
/// Errors are rank 0's to tell.
pub fn serve(session: &Session, work: &Work, path: &Path) {
    let world = session.universe.world();
    let leader = world.process_at_rank(0);
    let tell = |tag: Tag, bytes: &[u8]| leader.send_with_tag(bytes, tag);
    loop {
        match next_message(&world) {
            Some((_, status)) if status.tag() == BEGIN => break,
            Some((_, status)) if status.tag() == LEAVE => return tell(LEFT, &[]),
            Some(_) => {}
            None => std::thread::sleep(PAUSE),
        }
    }
    let file = rank_journal_path(path, session.rank());
    match Journal::open(&file, &work.study.digest(), Existing::Discard) {
        Ok(journal) => attend(&world, work, journal, &tell),
        Err(error) => {
            tell(FAILED, error.to_string().as_bytes());
            loop {
                match next_message(&world) {
                    Some((_, status)) if status.tag() == LEAVE => break,
                    Some(_) => {}
                    None => std::thread::sleep(PAUSE),
                }
            }
        }
    }
    tell(LEFT, &[]);
}

/// Runs points into `journal`, which is closed at the end.
fn attend(world: &SimpleCommunicator, work: &Work, journal: Journal, tell: &dyn Fn(Tag, &[u8])) {
    let halt = AtomicBool::new(false);
    let (point_sender, points) = mpsc::channel::<Point>();
    let (outcome_sender, outcomes) = mpsc::channel::<Vec<Outcome>>();
    std::thread::scope(|scope| {
        let halt = &halt;
        let pool = scope.spawn(move || {
            let mut journal = journal;
            // Waits for the next point, with an eye on the flag.
            let next = move || {
                while !halt.load(Ordering::Relaxed) {
                    match points.recv_timeout(Duration::from_millis(20)) {
                        Err(mpsc::RecvTimeoutError::Timeout) => {}
                        Ok(point) => return Some(point),
                        Err(mpsc::RecvTimeoutError::Disconnected) => return None,
                    }
                }
                None
            };
            run_points(
                work.study,
                std::iter::from_fn(next),
                work.workers,
                halt,
                work.integrate,
                |mut group| {
                    journal.append(&group)?;
                    // Rank 0 looks at the quantities; the events are in the journal.
                    group.iter_mut().for_each(|outcome| outcome.events.clear());
                    // Nobody listens any more only after the end.
                    let _ = outcome_sender.send(group);
                    Ok(())
                },
            )
        });
        let mut pool = Some(pool);
        let mut point_sender = Some(point_sender);
        loop {
            let mut idle = true;
            while let Some((bytes, status)) = next_message(world) {
                idle = false;
                match (status.tag(), &point_sender) {
                    (POINT, Some(sender)) => match read_point(&bytes) {
                        // A pool that has ended has said so.
                        Some(point) => drop(sender.send(point)),
                        None => tell(FAILED, b"a point that is not understood"),
                    },
                    (STOP, _) => halt.store(true, Ordering::Relaxed),
                    (LEAVE, _) => point_sender = None,
                    _ => {}
                }
            }
            if work.stop.load(Ordering::Relaxed) {
                halt.store(true, Ordering::Relaxed);
            }
            let ended = pool.as_ref().is_none_or(|pool| pool.is_finished());
            while let Ok(group) = outcomes.try_recv() {
                idle = false;
                tell(OUTCOMES, &to_message(&group));
            }
            if ended && let Some(pool) = pool.take() {
                match pool.join() {
                    Ok(Ok(())) => {}
                    Ok(Err(Stopped::Interrupted)) => tell(STOPPED, &[]),
                    Ok(Err(Stopped::Delivery(error))) => tell(FAILED, JournalError::to_string(&error).as_bytes()),
                    Ok(Err(Stopped::Storage(message))) => tell(FAILED, message.as_bytes()),
                    Err(_) => tell(FAILED, b"internal error: the threads panicked"),
                }
            }
            if ended && point_sender.is_none() {
                return;
            }
            if idle {
                std::thread::sleep(PAUSE);
            }
        }
    });
}

/// A point as a message: its number, then each value with its kind.
fn write_point(point: &Point) -> Vec<u8> {
    let mut bytes = point.number.to_le_bytes().to_vec();
    for setting in &point.coordinates {
        let (kind, value) = match setting {
            Setting::Number(number) => (0, number.to_bits()),
            Setting::Count(count) => (1, *count as u64),
            Setting::Flag(flag) => (2, u64::from(*flag)),
            Setting::Text(text) => (3, text.len() as u64),
        };
        bytes.push(kind);
        bytes.extend_from_slice(&value.to_le_bytes());
        if let Setting::Text(text) = setting {
            bytes.extend_from_slice(text.as_bytes());
        }
    }
    bytes
}

fn read_point(bytes: &[u8]) -> Option<Point> {
    let mut cursor = Cursor(bytes);
    let number = cursor.whole()?;
    let mut coordinates = Vec::new();
    while !cursor.0.is_empty() {
        let (kind, value) = (cursor.byte()?, cursor.whole()?);
        coordinates.push(match kind {
            0 => Setting::Number(f64::from_bits(value)),
            1 => Setting::Count(usize::try_from(value).ok()?),
            2 => Setting::Flag(value != 0),
            3 => {
                let text = cursor.take(usize::try_from(value).ok()?)?;
                Setting::Text(String::from_utf8(text.to_vec()).ok()?)
            }
            _ => return None,
        });
    }
    Some(Point { number, coordinates })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn setting() -> impl Strategy<Value = Setting> {
        prop_oneof![
            any::<f64>().prop_map(Setting::Number),
            any::<usize>().prop_map(Setting::Count),
            any::<bool>().prop_map(Setting::Flag),
            ".*".prop_map(Setting::Text),
        ]
    }

    proptest! {
        /// To the last bit: a rank must run the very point that rank 0 would have run.
        #[test]
        fn property_a_point_survives_its_message(number: u64, coordinates in proptest::collection::vec(setting(), 0..5)) {
            let point = Point { number, coordinates };
            let bytes = write_point(&point);
            prop_assert_eq!(write_point(&read_point(&bytes).unwrap()), bytes.clone());
            prop_assert_eq!(format!("{:?}", read_point(&bytes).unwrap()), format!("{point:?}"));
            prop_assert!(read_point(&bytes[..bytes.len() - 1]).is_none_or(|cut| cut.coordinates.len() < 5));
        }
    }
}
