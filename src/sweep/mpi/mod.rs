//! A sweep over the ranks of an MPI job.
//!
//! Rank 0 knows the study's points and hands them out one by one, so that long and short ones balance; it runs points
//! itself, too. Every other rank stores what it ran in a journal of its own before it reports it, so that a crash loses
//! the points under way alone, and rank 0 puts the journals together at the end. Only the main thread of a process calls
//! MPI; its other threads run points. Waiting is by looking now and then: a blocking receive would keep a processor busy.

mod leader;
mod member;
mod message;

pub use leader::Ranks;
pub use member::serve;

use mpi::environment::Universe;
use mpi::traits::{Communicator, CommunicatorCollectives};
use std::time::Duration;

/// How long a process that waits sleeps before it looks again.
const PAUSE: Duration = Duration::from_micros(200);

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
