//! Every other rank: runs what it is given, and stores it before it reports it.

use super::message::{BEGIN, FAILED, LEAVE, LEFT, OUTCOMES, POINT, STOP, STOPPED, next_message, read_point};
use super::{PAUSE, Session};
use crate::sweep::journal::{Existing, Journal, JournalError, rank_journal_path};
use crate::sweep::quantities::Outcome;
use crate::sweep::record::to_message;
use crate::sweep::run::Sweep;
use crate::sweep::runner::{Stopped, run_points};
use crate::sweep::study::Point;
use crate::sweep::worker_pool::Work;
use mpi::Tag;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Duration;

/// On every rank but 0: runs the points that rank 0 hands out, until it is told to leave. The journal of this rank is beside
/// the sweep file.
///
/// Errors are rank 0's to tell.
pub fn serve(session: &Session, sweep: &Sweep) {
    let world = session.universe.world();
    let leader = world.process_at_rank(0);
    let tell = |tag: Tag, bytes: &[u8]| leader.send_with_tag(bytes, tag);
    if next_of(&world, &[BEGIN, LEAVE]) == LEAVE {
        return tell(LEFT, &[]);
    }
    let file = rank_journal_path(sweep.path, session.rank());
    match Journal::open(&file, &sweep.study.digest(), Existing::Discard) {
        Ok(journal) => sweep.with_work(|work| attend(&world, work, journal, &tell)),
        Err(error) => {
            tell(FAILED, error.to_string().as_bytes());
            next_of(&world, &[LEAVE]);
        }
    }
    tell(LEFT, &[]);
}

/// Waits for a message with one of these tags, and passes over others.
fn next_of(world: &SimpleCommunicator, tags: &[Tag]) -> Tag {
    loop {
        match next_message(world) {
            Some((_, status)) if tags.contains(&status.tag()) => return status.tag(),
            Some(_) => {}
            None => std::thread::sleep(PAUSE),
        }
    }
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
