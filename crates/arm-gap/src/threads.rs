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
    let mut results: Vec<Option<R>> = (0..jobs).map(|_| None).collect();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads.min(jobs)).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            let done = worker
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            for (job, result) in done {
                results[job] = Some(result);
            }
        }
    });
    // Every job was taken by a worker that was waited for.
    results.into_iter().flatten().collect()
}
