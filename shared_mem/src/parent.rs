//! The end of a program that another one started: it ends in its own orderly way when that one is gone, however that one
//! ended. `kill -9` leaves nobody who could ask it to.
//!
//! A child is given the process id of whoever started it, as [`FLAG`]. The kernel hands the children of a process that has
//! ended to another parent, so the id tells, even where the parent ended before the child could look for the first time.
//! (`PR_SET_PDEATHSIG` would act when the *thread* ends that started the child.)

use std::io;
use std::os::unix::process::parent_id;
use std::time::Duration;

/// Option of the command lines that takes the process id.
pub const FLAG: &str = "--parent";
/// How often a child looks.
const LOOK: Duration = Duration::from_millis(20);
/// The thread that looks needs little [bytes].
const STACK: usize = 64 << 10;

/// Whether process `parent` is not, or no longer, the parent of this one.
pub fn is_gone(parent: u32) -> bool {
    parent_id() != parent
}

/// Calls `then` as soon as `parent` is gone, on a thread of its own.
///
/// # Errors
/// The system's, when it cannot make a thread.
pub fn when_gone(parent: u32, then: impl FnOnce() + Send + 'static) -> io::Result<()> {
    let look = move || {
        while !is_gone(parent) {
            std::thread::sleep(LOOK);
        }
        then();
    };
    std::thread::Builder::new().name("parent".into()).stack_size(STACK).spawn(look).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{RecvTimeoutError, channel};

    #[test]
    fn the_parent_is_there_and_another_process_is_not_the_parent() {
        let (sender, receiver) = channel();
        let first = sender.clone();
        when_gone(parent_id(), move || first.send("parent").expect("a receiver")).expect("a thread");
        when_gone(std::process::id(), move || sender.send("no parent").expect("a receiver")).expect("a thread");
        assert_eq!(receiver.recv(), Ok("no parent"));
        assert_eq!(receiver.recv_timeout(3 * LOOK), Err(RecvTimeoutError::Timeout));
    }
}
