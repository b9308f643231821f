//! The pool of threads on which independent jobs are done: runs of a ladder, points of a study, reruns.

use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError, mpsc};

/// Results that may wait for the one who takes them, unless the caller says how many.
const WAITING: usize = 256;

/// As many threads as there are processors.
pub(crate) fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What a computation that is asked now and then is told.
pub(crate) fn go_on_unless(stop: bool) -> ControlFlow<()> {
    match stop {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}

/// Does `job` with each of `items`, begun in their order, on `threads` threads. What comes of them is sent, in the order of
/// completion, to `receive`, on the thread that called; `waiting` of them may wait. A job that comes to nothing ends the work
/// of its thread.
///
/// # Panics
/// Goes on with the panic of a job; if the system has no thread left.
pub(crate) fn on_threads<I, T: Send, O>(
    threads: usize,
    waiting: usize,
    items: impl Iterator<Item = I> + Send,
    job: impl Fn(I) -> Option<T> + Sync,
    receive: impl FnOnce(mpsc::Receiver<T>) -> O,
) -> O {
    let work = |next: &dyn Fn() -> Option<I>, send: &dyn Fn(T) -> bool| {
        while let Some(result) = next().and_then(&job)
            && send(result)
        {}
    };
    on_threads_by(threads, waiting, items, work, receive)
}

/// The same, where each thread does `work` of its own: it is given what has the next item, and what sends a result and says whether
/// anyone takes it.
///
/// # Panics
/// Those of [`on_threads`].
pub(crate) fn on_threads_by<I, T: Send, O>(
    threads: usize,
    waiting: usize,
    items: impl Iterator<Item = I> + Send,
    work: impl Fn(&dyn Fn() -> Option<I>, &dyn Fn(T) -> bool) + Sync,
    receive: impl FnOnce(mpsc::Receiver<T>) -> O,
) -> O {
    let threads = threads.max(1);
    let items = Mutex::new(items);
    let (sender, receiver) = mpsc::sync_channel(waiting);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.unwrap_or_else(|error| panic!("no threads to work on: {error}"));
    pool.in_place_scope(|scope| {
        for _ in 0..threads {
            let (sender, items, work) = (sender.clone(), &items, &work);
            scope.spawn(move |_| {
                let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
                work(&next, &|result| sender.send(result).is_ok());
            });
        }
        drop(sender);
        receive(receiver)
    })
}

/// `job(0)`, `job(1)`, ... up to `count`, begun in that order on at most `threads` threads, and what came of each in its
/// place; `done` is told how many there are. A job that comes to nothing ends the work of its thread.
pub(crate) fn in_order<T: Send>(
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

/// `job(0)`, `job(1)`, ... up to `count`, begun in that order over all processors; the results in that order. Once `stop` says
/// so no further job begins, and those not begun are missing.
pub(crate) fn over_processors<T: Send>(
    count: usize,
    stop: &(dyn Fn() -> bool + Sync),
    job: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let unless_stopped = |index| (!stop()).then(|| job(index));
    in_order(processors(), count, unless_stopped, &mut |_| {})
        .into_iter()
        .flatten()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn property_results_stand_in_the_places_of_their_jobs() {
        for threads in [0, 1, 3, 100] {
            let mut finished = 0;
            let squares = in_order(threads, 50, |k| Some(k * k), &mut |count| finished = count);
            assert_eq!(squares, (0..50).map(|k| Some(k * k)).collect::<Vec<_>>());
            assert_eq!(finished, 50);
        }
        assert!(in_order(4, 0, Some, &mut |_| {}).is_empty());
    }

    /// More results than may wait, which a slow receiver takes one by one.
    #[test]
    fn property_no_result_is_lost_where_they_have_to_wait() {
        let begun = AtomicUsize::new(0);
        let job = |k: usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            Some(k)
        };
        let mut seen: Vec<usize> = on_threads(2, 1, 0..1000, job, |receiver| receiver.iter().collect());
        seen.sort_unstable();
        assert_eq!(seen, (0..1000).collect::<Vec<_>>());
        assert_eq!(begun.into_inner(), 1000);
    }

    /// On one thread nothing is begun after the job that came to nothing; what was done before is there.
    #[test]
    fn property_a_job_that_comes_to_nothing_ends_the_work() {
        let results = in_order(1, 10, |k| (k < 4).then_some(k), &mut |_| {});
        assert_eq!(results.iter().flatten().count(), 4);
    }
}
