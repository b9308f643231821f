//! Rank 0: hands out points and hears what they came to.

use super::message::{BEGIN, FAILED, LEAVE, LEFT, OUTCOMES, POINT, STOP, STOPPED, next_message, write_point};
use super::{PAUSE, Session};
use crate::sweep::journal::JournalError;
use crate::sweep::quantities::Outcome;
use crate::sweep::record::from_message;
use crate::sweep::runner::{Stopped, run_points};
use crate::sweep::study::Point;
use crate::sweep::worker_pool::{Delivery, Work, WorkerPool};
use mpi::point_to_point::Status;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination};
use mpi::{Rank, Tag};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError, mpsc};
use std::time::{Duration, Instant};

/// Ranks that have not ended their work after this long are taken for lost. A run looks at the flag at every step.
const PATIENCE: Duration = Duration::from_secs(20);

/// What a rank reports comes so much later, at most: it gathers outcomes before it stores and sends them.
const LAG: Duration = Duration::from_millis(30);

/// Points that take longer are handed out one for each thread; shorter ones wait at the rank for as many as there are
/// runs in [`LAG`], so that no thread waits for its next.
const LONG: Duration = Duration::from_secs(1);

/// No more than this wait for each thread.
const MOST_AHEAD: usize = 64;

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

impl Ranks {
    /// On rank 0: the others, each of which is to call [`super::serve`].
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
        if self.done < 2 * all {
            return threads;
        }
        let average = self.started.elapsed() * all as u32 / self.done as u32;
        threads * (1 + ahead(average))
    }

    fn fail(&mut self, error: Stopped<JournalError>) {
        self.error = self.error.take().or(Some(error));
    }
}

/// How many points wait for a thread, if one takes so long.
fn ahead(average: Duration) -> usize {
    if average > LONG {
        return 0;
    }
    let runs = LAG.as_secs_f64() / average.as_secs_f64().max(1e-6);
    (runs.ceil() as usize).clamp(1, MOST_AHEAD)
}

impl WorkerPool for Ranks {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_points_wait_for_as_long_as_a_report_takes() {
        let ahead = |milliseconds| ahead(Duration::from_millis(milliseconds));
        assert_eq!(
            [ahead(0), ahead(1), ahead(10), ahead(500), ahead(2000)],
            [64, 30, 3, 1, 0]
        );
    }
}
