//! A running `twin teleop`, and what a browser at its page would be.

use crate::program_path;
use rustix::process::Signal;
use serde_json::Value;
use std::io::Read as _;
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// Longest wait for something that takes a second; only a fault uses it up.
pub const LONG: Duration = Duration::from_secs(60);

/// A task that ships.
pub fn task(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../twin/tasks").join(name).display().to_string()
}

/// A running `twin teleop` and where it is.
#[derive(Debug)]
pub struct Teleop {
    child: Child,
    /// Of its page.
    pub port: u16,
}

impl Teleop {
    /// Starts it on a port that is free, and waits for its page.
    ///
    /// # Panics
    /// When it does not start.
    pub fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(program_path("twin"))
            .args(["teleop", "--port", "0", "--json", "--parent", &std::process::id().to_string()])
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let mut stderr = child.stderr.take().expect("a pipe");
        let (mut said, mut byte) = (Vec::new(), [0]);
        while !said.ends_with(b"Ctrl-C ends\n") {
            assert_eq!(stderr.read(&mut byte).expect("a pipe"), 1, "{}", String::from_utf8_lossy(&said));
            said.push(byte[0]);
        }
        // What it says later has to go somewhere.
        std::thread::spawn(move || std::io::copy(&mut stderr, &mut std::io::sink()));
        let said = String::from_utf8(said).expect("text");
        let (_, address) = said.rsplit_once("http://").expect("an address");
        let port = address.split_once('/').and_then(|(at, _)| at.rsplit_once(':')).expect("a port").1;
        Self { child, port: port.parse().expect("a port") }
    }

    /// Opens the page.
    ///
    /// # Panics
    /// When it cannot be opened.
    pub fn page(&self) -> Page {
        self.try_page().expect("a page")
    }

    /// The same where it may be refused.
    ///
    /// # Panics
    /// When the system refuses what it always grants.
    pub fn try_page(&self) -> Option<Page> {
        let (socket, _) = tungstenite::connect(format!("ws://127.0.0.1:{}/ws", self.port)).ok()?;
        if let MaybeTlsStream::Plain(tcp) = socket.get_ref() {
            tcp.set_read_timeout(Some(LONG)).expect("a timeout above zero");
            tcp.set_nodelay(true).expect("a socket");
        }
        Some(Page { socket, texts: Vec::new(), sent: 0 })
    }

    /// Sends the signal and waits for the end: whether that was well, and the answer.
    ///
    /// # Panics
    /// When it takes longer than [`LONG`].
    pub fn end(mut self, signal: Signal) -> (bool, Value) {
        let pid = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(pid, signal).expect("it runs");
        let mut stdout = self.child.stdout.take().expect("a pipe");
        let answer = std::thread::spawn(move || {
            let mut answer = String::new();
            stdout.read_to_string(&mut answer).map(|_| answer)
        });
        let begin = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                break status;
            }
            if begin.elapsed() > LONG {
                drop(self.child.kill());
                panic!("it does not end");
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let answer = answer.join().expect("it ends").expect("text");
        (status.success(), serde_json::from_str(&answer).unwrap_or(Value::Null))
    }
}

/// What a browser would be.
#[derive(Debug)]
pub struct Page {
    pub socket: WebSocket<MaybeTlsStream<TcpStream>>,
    /// What came as text.
    pub texts: Vec<Value>,
    sent: u64,
}

impl Page {
    /// Sends a message with the next number; that.
    ///
    /// # Panics
    /// When the connection is gone.
    pub fn send(&mut self, mut message: Value) -> u64 {
        self.sent += 1;
        message["id"] = self.sent.into();
        self.socket.send(Message::text(message.to_string())).expect("it listens");
        self.sent
    }

    /// The next picture's state; texts on the way are kept.
    ///
    /// # Panics
    /// When none comes.
    pub fn state(&mut self) -> Value {
        loop {
            match self.socket.read().expect("a message") {
                Message::Text(text) => self.texts.push(serde_json::from_str(&text).expect("JSON")),
                Message::Binary(bytes) => {
                    let length = u32::from_le_bytes(bytes[..4].try_into().expect("four bytes")) as usize;
                    assert!(bytes[4 + length..].starts_with(b"\x89PNG"), "a picture follows");
                    return serde_json::from_slice(&bytes[4..4 + length]).expect("JSON");
                }
                _ => {}
            }
        }
    }

    /// The first state from now on that is as wanted.
    ///
    /// # Panics
    /// When none comes for [`LONG`].
    pub fn wait(&mut self, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let begin = Instant::now();
        loop {
            let state = self.state();
            if wanted(&state) {
                return state;
            }
            assert!(begin.elapsed() < LONG, "{what}: {state}");
        }
    }

    /// What was said under a key, first.
    ///
    /// # Panics
    /// When nothing is for [`LONG`].
    pub fn said(&mut self, key: &str) -> Value {
        let begin = Instant::now();
        loop {
            if let Some(text) = self.texts.iter().find(|text| !text[key].is_null()) {
                return text[key].clone();
            }
            assert!(begin.elapsed() < LONG, "{key}: {:?}", self.texts);
            self.state();
        }
    }
}

/// The numbers of an array.
///
/// # Panics
/// When it is none.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|x| x.as_f64().expect("a number")).collect()
}
