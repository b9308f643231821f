//! Thread pool for independent jobs: runs of a ladder, points of a study, reruns.

use std::sync::{Mutex, PoisonError, mpsc};
use stickslip_system::watch::Watch;

const WAITING: usize = 256;

/// Number of processors that are available, at least 1.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Runs `job` for each of `items`, started in order, on `threads` threads. `receive` gets the results on the calling
/// thread in the order of completion; at most `waiting` results wait for it. A job that returns `None` ends its
/// thread's work.
///
/// # Panics
/// Resumes the panic of a job; panics if no thread can be made.
pub fn on_threads<I, T: Send, O>(
    threads: usize,
    waiting: usize,
    items: impl Iterator<Item = I> + Send,
    job: impl Fn(I) -> Option<T> + Sync,
    receive: impl FnOnce(mpsc::Receiver<T>) -> O,
) -> O {
    let threads = threads.max(1);
    let items = Mutex::new(items);
    let (sender, receiver) = mpsc::sync_channel(waiting);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.unwrap_or_else(|error| panic!("no threads to work on: {error}"));
    pool.in_place_scope(|scope| {
        for _ in 0..threads {
            let (sender, items, job) = (sender.clone(), &items, &job);
            scope.spawn(move |_| {
                loop {
                    let next = items.lock().unwrap_or_else(PoisonError::into_inner).next();
                    let Some(result) = next.and_then(job) else { break };
                    if sender.send(result).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        receive(receiver)
    })
}

/// Runs `job(0)`, `job(1)`, ... below `count`, started in order on at most `threads` threads. Returns the results in
/// order. `done` gets the number of finished jobs. A job that returns `None` ends its thread's work.
pub fn in_order<T: Send>(
    threads: usize,
    count: usize,
    job: impl Fn(usize) -> Option<T> + Sync,
    done: &mut dyn FnMut(usize),
) -> Vec<Option<T>> {
    let mut results: Vec<Option<T>> = (0..count).map(|_| None).collect();
    let numbered = |index| job(index).map(|result| (index, result));
    on_threads(threads.min(count), WAITING, 0..count, numbered, |receiver| {
        for (finished, (index, result)) in receiver.iter().enumerate() {
            results[index] = Some(result);
            done(finished + 1);
        }
    });
    results
}

/// Runs `job(0)`, `job(1)`, ... below `count` over all processors; returns the results in order. Once `stop` is
/// set, no further job starts, and the results of the jobs not started are missing.
pub fn over_processors<T: Send>(count: usize, stop: &dyn Watch, job: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let unless_stopped = |index| (!stop.stopped()).then(|| job(index));
    in_order(processors(), count, unless_stopped, &mut |_| {})
        .into_iter()
        .flatten()
        .collect()
}
