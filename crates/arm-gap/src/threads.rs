//! Jobs on several threads.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Results of jobs in their order, whatever the number of threads.
pub fn parallel<R: Send>(threads: usize, jobs: usize, one: impl Fn(usize) -> R + Sync) -> Vec<R> {
    if threads <= 1 || jobs <= 1 {
        return (0..jobs).map(one).collect();
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            if job >= jobs {
                return done;
            }
            done.push((job, one(job)));
        }
    };
    let mut all: Vec<(usize, R)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.min(jobs)).map(|_| scope.spawn(work)).collect();
        let joined = workers.into_iter().map(|worker| worker.join());
        joined
            .flat_map(|done| done.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    });
    all.sort_by_key(|(job, _)| *job);
    all.into_iter().map(|(_, result)| result).collect()
}
