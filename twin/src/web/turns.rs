//! Work that takes long, beside the thread that answers.

use std::sync::Arc;
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

/// Does one piece of work at a time on a thread of its own, however many pages ask for some: the thread that answers stays free for
/// other pages and for the end.
#[derive(Clone)]
pub(crate) struct OneAtATime {
    turn: Arc<Semaphore>,
}

impl OneAtATime {
    pub(crate) fn new() -> Self {
        Self { turn: Arc::new(Semaphore::new(1)) }
    }

    /// What the work gives, after its turn has come; `None` where it panicked or the program ends. Who goes away while it is done
    /// keeps the turn until its end.
    pub(crate) async fn run<T: Send + 'static>(self, work: impl FnOnce() -> T + Send + 'static) -> Option<T> {
        let turn = self.turn.acquire_owned().await.ok()?;
        let done = spawn_blocking(move || {
            let _turn = turn;
            work()
        });
        done.await.ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    #[test]
    fn no_two_pieces_of_work_are_done_at_once_and_a_panic_gives_the_turn_back() {
        let runtime = tokio::runtime::Builder::new_current_thread().build().expect("a runtime");
        let (turns, now, most) = (OneAtATime::new(), Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
        let pieces: Vec<_> = (0..4)
            .map(|_| {
                let (now, most) = (Arc::clone(&now), Arc::clone(&most));
                runtime.spawn(turns.clone().run(move || {
                    most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    std::thread::sleep(Duration::from_millis(5));
                    now.fetch_sub(1, Ordering::SeqCst);
                }))
            })
            .collect();
        runtime.block_on(async {
            for piece in pieces {
                assert!(piece.await.expect("it ends").is_some());
            }
            assert_eq!(most.load(Ordering::SeqCst), 1);
            assert!(turns.clone().run(|| panic!("on purpose")).await.is_none());
            assert_eq!(turns.run(|| 7).await, Some(7));
        });
    }
}
