//! Jobs on several threads.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Results of jobs in their order, whatever the number of threads.
pub fn parallel<R: Send>(threads: usize, jobs: usize, one: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let results: Vec<Mutex<Option<R>>> = (0..jobs).map(|_| Mutex::new(None)).collect();
    run(threads, jobs, &|job| {
        let result = one(job);
        *results[job].lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
    });
    // Every job was taken by a worker that was waited for.
    let each = results.into_iter();
    each.filter_map(|r| r.into_inner().unwrap_or_else(PoisonError::into_inner))
        .collect()
}

/// Not generic, so that what makes threads is compiled once.
fn run(threads: usize, jobs: usize, one: &(dyn Fn(usize) + Sync)) {
    if threads <= 1 || jobs <= 1 {
        return (0..jobs).for_each(one);
    }
    let next = AtomicUsize::new(0);
    let work = || {
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            if job >= jobs {
                return;
            }
            one(job);
        }
    };
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads.min(jobs)).map(|_| scope.spawn(work)).collect();
        work();
        for worker in others {
            worker
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_the_order_of_their_jobs_whatever_the_number_of_threads() {
        for threads in [1, 2, 7, 40] {
            let squares = parallel(threads, 20, |i| i * i);
            assert!(squares.into_iter().eq((0..20).map(|i| i * i)), "{threads}");
        }
        assert!(parallel(3, 0, |i| i).is_empty());
    }
}
