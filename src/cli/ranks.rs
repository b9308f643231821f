//! Whether a sweep is one process or the ranks of an MPI job.

use super::CommandError;
use super::arguments::SweepOptions;
use crate::case::CaseError;
#[cfg(feature = "mpi")]
use crate::sweep::mpi;
use crate::sweep::{Study, Sweep, Threads, WorkerPool};

/// What launchers tell their processes: how many there are (Open MPI, MPICH and its kin).
const SIZES: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

/// Whether several processes were started together, as far as the launcher says.
fn several_were_launched() -> bool {
    let size = |name: &&str| std::env::var(name).ok().and_then(|text| text.parse::<usize>().ok());
    SIZES.iter().filter_map(size).any(|size| size > 1)
}

/// The processes of a sweep, as this one sees them.
pub(super) enum Ranks {
    Alone,
    #[cfg(feature = "mpi")]
    Job(mpi::Session),
}

impl Ranks {
    /// Joins the job if there is one. One task of a job array is none, whatever started it.
    pub(super) fn start(options: &SweepOptions) -> Result<Self, CommandError> {
        if options.mpi || (options.shard.is_none() && several_were_launched()) {
            Self::join()
        } else {
            Ok(Ranks::Alone)
        }
    }

    #[cfg(feature = "mpi")]
    fn join() -> Result<Self, CommandError> {
        mpi::Session::start().map(Ranks::Job).ok_or_else(|| {
            CommandError::computation(
                "MPI cannot be used: the library does not let one thread of several call it; use another MPI library, or --shard"
            )
        })
    }

    #[cfg(not(feature = "mpi"))]
    fn join() -> Result<Self, CommandError> {
        Err(CommandError::input(
            "this build of the program has no MPI, and ranks of an MPI job would all compute the same; build it with `cargo build --release --features mpi`, or give every process a part of the study with --shard",
        ))
    }

    /// Threads of each process where none are asked for: a rank is one of many on its machine.
    pub(super) fn default_jobs(&self) -> usize {
        match self {
            Ranks::Alone => crate::workers::processors(),
            #[cfg(feature = "mpi")]
            Ranks::Job(_) => 1,
        }
    }

    /// The study, if every rank has read the same. `Ok(None)` on a rank that has nothing to say of the error.
    pub(super) fn agree(&self, study: Result<Study, CaseError>) -> Result<Option<Study>, CommandError> {
        match self {
            Ranks::Alone => Ok(Some(study?)),
            #[cfg(feature = "mpi")]
            Ranks::Job(session) => {
                let digests = session.digests(study.as_ref().ok().map(Study::digest).as_deref());
                let different: Vec<usize> = (1..digests.len()).filter(|&rank| digests[rank] != digests[0]).collect();
                match study {
                    Ok(study) if different.is_empty() => Ok(Some(study)),
                    // The same everywhere, or the one that nobody else has: said once.
                    Err(error) if session.rank() == 0 || digests[0].is_some() => Err(error.into()),
                    Ok(_) if session.rank() == 0 => Err(CommandError::input(format!(
                        "rank {} has not read the study that rank 0 has; see to it that all machines have the same files and the same version of the program",
                        different[0]
                    ))),
                    _ => Ok(None),
                }
            }
        }
    }

    /// On another rank than 0: runs points until rank 0 has enough of them. Otherwise false at once.
    #[cfg_attr(
        not(feature = "mpi"),
        expect(unused_variables, reason = "without MPI there are no others")
    )]
    pub(super) fn served(&self, sweep: &Sweep) -> bool {
        match self {
            #[cfg(feature = "mpi")]
            Ranks::Job(session) if session.rank() != 0 => {
                mpi::serve(session, sweep);
                true
            }
            _ => false,
        }
    }

    /// Who runs the points. On rank 0, and for all of the sweep: the others go when it is dropped.
    pub(super) fn worker_pool(&self) -> Box<dyn WorkerPool> {
        match self {
            Ranks::Alone => Box::new(Threads),
            #[cfg(feature = "mpi")]
            Ranks::Job(session) => Box::new(mpi::Ranks::new(session)),
        }
    }

    /// How many processes there are, where they are the ranks of a job.
    pub(super) fn count(&self) -> Option<usize> {
        match self {
            Ranks::Alone => None,
            #[cfg(feature = "mpi")]
            Ranks::Job(session) => Some(session.size()),
        }
    }

    /// Ends a job in which ranks were lost: MPI itself would wait for them for ever.
    pub(super) fn give_up(&self, error: CommandError, json: bool) -> CommandError {
        #[cfg(not(feature = "mpi"))]
        let _ = json;
        match self {
            Ranks::Alone => error,
            #[cfg(feature = "mpi")]
            Ranks::Job(session) => {
                error.report(json);
                session.abort(1)
            }
        }
    }
}
