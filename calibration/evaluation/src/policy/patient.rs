//! A connection on which one waits so long, whatever comes meanwhile: a peer that sends a byte now and then is as late as one that
//! sends nothing. Ctrl-C ends the wait.

use shared_mem::ending;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// How often the wait looks whether it has to end.
const LOOK: Duration = Duration::from_millis(100);

/// A connection with a limit to the wait.
#[derive(Debug)]
pub(super) struct Patient {
    stream: TcpStream,
    limit: Duration,
    until: Instant,
}

impl Patient {
    /// A connection; from now on one waits so long.
    pub(super) fn of(stream: TcpStream, limit: Duration) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(LOOK))?;
        stream.set_write_timeout(Some(LOOK))?;
        Ok(Self { stream, limit, until: Instant::now() + limit })
    }

    /// From now on one waits so long for all that comes next.
    pub(super) fn wait(&mut self, limit: Duration) {
        (self.limit, self.until) = (limit, Instant::now() + limit);
    }

    /// Does it again until something comes of it, or the wait is over.
    fn patiently(&mut self, mut act: impl FnMut(&mut TcpStream) -> io::Result<usize>) -> io::Result<usize> {
        loop {
            if ending::asked() {
                return Err(io::Error::other("interrupted"));
            }
            if Instant::now() >= self.until {
                let words = format!("it was not done within {} s", self.limit.as_secs());
                return Err(io::Error::new(io::ErrorKind::TimedOut, words));
            }
            match act(&mut self.stream) {
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {}
                done => return done,
            }
        }
    }
}

impl Read for Patient {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.patiently(|stream| stream.read(into))
    }
}

impl Write for Patient {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.patiently(|stream| stream.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;
    use std::sync::mpsc;
    use std::thread;

    #[test]
    fn a_peer_that_sends_a_byte_now_and_then_is_as_late_as_one_that_sends_nothing() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let client = TcpStream::connect(listener.local_addr().expect("an address")).expect("a connection");
        let (mut server, _) = listener.accept().expect("a client");
        let (over, waits) = mpsc::channel::<()>();
        let dripping = thread::spawn(move || {
            while waits.recv_timeout(Duration::from_millis(5)) == Err(mpsc::RecvTimeoutError::Timeout)
                && server.write_all(b"x").is_ok()
            {}
        });
        let mut patient = Patient::of(client, Duration::from_millis(300)).expect("a connection");
        let error = io::copy(&mut patient, &mut io::sink()).expect_err("it never ends");
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        // Waited for anew, what comes is read.
        patient.wait(Duration::from_secs(60));
        assert_eq!(patient.read(&mut [0; 1]).expect("a byte"), 1);
        drop(over);
        dripping.join().expect("a peer");
    }
}
