//! Many rollouts on all cores: one worker a thread, answers in the order of the jobs, the same bits on any number of
//! threads (a job must not depend on what its worker did before: start or resume it first).

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Threads with a worker each, kept from batch to batch.
pub struct Workers<W> {
    pool: ThreadPool,
    workers: Vec<Mutex<W>>,
}

impl<W: Clone + Send> Workers<W> {
    /// As many clones of `worker` as there are threads: `threads`, or one for each core.
    ///
    /// `W` may be a [`super::CellRollout`] alone or a tuple with whatever a job needs as scratch.
    ///
    /// # Errors
    /// When the system refuses the threads.
    pub fn new(worker: W, threads: Option<usize>) -> Result<Self, ThreadPoolBuildError> {
        let pool = ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build()?;
        let count = pool.current_num_threads();
        let mut workers: Vec<_> = (1..count).map(|_| Mutex::new(worker.clone())).collect();
        workers.push(Mutex::new(worker));
        Ok(Self { pool, workers })
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.workers.len()
    }

    /// Does every job and answers in their order. Jobs are handed out one by one, so their lengths may differ.
    ///
    /// # Panics
    /// When `work` panics.
    pub fn run<J: Sync, R: Send>(&self, jobs: &[J], work: impl Fn(&mut W, &J) -> R + Sync) -> Vec<R> {
        let next = AtomicUsize::new(0);
        let done = self.pool.broadcast(|thread| {
            let mut worker = self.workers[thread.index()].lock().expect("no job has panicked");
            let mut done = Vec::new();
            loop {
                let i = next.fetch_add(1, Ordering::Relaxed);
                let Some(job) = jobs.get(i) else { break done };
                done.push((i, work(&mut worker, job)));
            }
        });
        let mut answers: Vec<(usize, R)> = done.into_iter().flatten().collect();
        answers.sort_unstable_by_key(|(i, _)| *i);
        answers.into_iter().map(|(_, answer)| answer).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_in_the_order_of_the_jobs_whatever_each_takes() {
        let jobs: Vec<u64> = (0..200).collect();
        for threads in [1, 2, 5] {
            let workers = Workers::new(0u64, Some(threads)).expect("threads");
            assert_eq!(workers.threads(), threads);
            let squares = workers.run(&jobs, |count, job| {
                *count += 1;
                (0..(job % 7) * 10_000).fold(job * job, |sum, i| std::hint::black_box(sum + i - i))
            });
            assert!(squares.iter().zip(&jobs).all(|(square, job)| *square == job * job));
        }
    }
}
