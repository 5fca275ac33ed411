//! Starting a thread that opens something first, and waiting until it says whether it could.

use std::sync::mpsc::{self, Sender};
use std::thread::{self, JoinHandle};

/// A thread did not come up.
#[derive(Debug, thiserror::Error)]
pub enum ThreadError {
    /// The operating system makes none.
    #[error("cannot start the thread `{name}`: {source}; end other programs to free memory and processes")]
    Refused {
        name: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    #[error("the thread `{name}` failed; please report this with what it said on standard error")]
    Failed { name: &'static str },
}

/// Starts `body` as the thread `name` and returns when it has sent its first word: what it opens belongs to the thread,
/// as the ports of shared memory do, and whether that went well is for whoever starts it.
///
/// # Errors
/// What the thread sent, or a [`ThreadError`] when there is no thread or it ended without a word.
pub fn start<T, E>(
    name: &'static str,
    body: impl FnOnce(Sender<Result<(), E>>) -> T + Send + 'static,
) -> Result<JoinHandle<T>, E>
where
    T: Send + 'static,
    E: From<ThreadError> + Send + 'static,
{
    let (opened, wait) = mpsc::channel();
    let handle = thread::Builder::new()
        .name(name.into())
        .spawn(move || body(opened))
        .map_err(|source| ThreadError::Refused { name, source })?;
    match wait.recv() {
        Ok(Ok(())) => Ok(handle),
        Ok(Err(error)) => {
            let _ended = handle.join();
            Err(error)
        }
        Err(_) => Err(ThreadError::Failed { name }.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_panics_before_its_first_word_is_an_error_and_no_panic_here() {
        let error = start("silent", |_opened: Sender<Result<(), ThreadError>>| panic!("on purpose")).map(|_| ());
        assert!(matches!(error, Err(ThreadError::Failed { name: "silent" })), "{error:?}");
    }

    #[test]
    fn what_a_thread_says_first_is_the_answer() {
        let well = start("well", |opened: Sender<Result<(), ThreadError>>| opened.send(Ok(())).is_ok());
        assert!(well.expect("it started").join().expect("it ended"));
        let ill = start("ill", |opened| drop(opened.send(Err(ThreadError::Failed { name: "other" })))).map(|_| ());
        assert!(matches!(ill, Err(ThreadError::Failed { name: "other" })), "{ill:?}");
    }
}
