//! Independent jobs over all processors.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// `job(0)`, `job(1)`, ... up to `count`, over as many threads as there are processors, each begun in its turn; the results
/// in that order. Once `stop` says so no further job begins, and those not begun are missing.
pub(super) fn over_processors<T: Send>(
    count: usize,
    stop: &(dyn Fn() -> bool + Sync),
    job: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let finished: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(count));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads.min(count) {
            scope.spawn(|| {
                while !stop() {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= count {
                        break;
                    }
                    let result = job(index);
                    let mut list = finished.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    list.push((index, result));
                }
            });
        }
    });
    let mut finished = finished.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    finished.sort_by_key(|(index, _)| *index);
    finished.into_iter().map(|(_, result)| result).collect()
}
