//! A policy behind openpi's websocket protocol: the server sends its metadata when a client connects, and an answer with `actions`
//! for each observation, all as msgpack; a text instead is its error.

use super::packed::{Array, MOST_NUMBERS, PackedError, Rows, entry, pack, unpack};
use super::patient::Patient;
use rmpv::Value;
use shared_mem::ending;
use std::net::{TcpStream, ToSocketAddrs as _};
use std::time::Duration;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{HandshakeError, Message, WebSocket};

/// How long a server may take to take a connection up, to say who it is, and to answer in full.
const CONNECTS: Duration = Duration::from_secs(5);
const SAYS_WHO: Duration = Duration::from_secs(30);
/// The first answer of a network that is compiled for it takes more than a minute.
const ANSWERS: Duration = Duration::from_secs(120);
/// Largest message that is taken [bytes].
const LARGEST: usize = 64 << 20;

/// A policy could not be asked.
#[derive(Debug, thiserror::Error)]
pub enum ServedError {
    /// Nobody is there.
    #[error(
        "no policy answers at {address} ({cause}); start its server (openpi: scripts/serve_policy.py), or give its address"
    )]
    Absent {
        /// Where.
        address: String,
        /// What happened.
        cause: String,
    },
    /// The connection broke.
    #[error("the policy at {address} fell silent ({cause}); look at its server's messages, then start again")]
    Silent {
        /// Where.
        address: String,
        /// What happened.
        cause: String,
    },
    /// The server reports an error of its own.
    #[error("the policy at {address} failed: {words}; see its server's messages")]
    Failed {
        /// Where.
        address: String,
        /// The last line of what it said.
        words: String,
    },
    /// The end was asked for.
    #[error("interrupted")]
    Interrupted,
    /// An answer is of no use.
    #[error("the policy at {address} answered with {what}")]
    Answer {
        /// Where.
        address: String,
        /// What is wrong with it.
        what: String,
    },
}

/// A connection to a policy.
#[derive(Debug)]
pub struct Served {
    address: String,
    /// Large, beside what else a policy may be.
    socket: Box<WebSocket<Patient>>,
    metadata: Value,
}

impl Served {
    /// Connects to `ws://HOST:PORT`.
    ///
    /// # Errors
    /// [`ServedError`] when nobody is there, or it does not speak the protocol.
    pub fn connect(address: &str) -> Result<Self, ServedError> {
        let absent = |cause: &dyn std::fmt::Display| ServedError::Absent {
            address: address.to_owned(),
            cause: cause.to_string(),
        };
        let rest = address.strip_prefix("ws://").ok_or_else(|| absent(&"it is no ws:// address"))?;
        let host = rest.split('/').next().unwrap_or(rest);
        let with_port = if host.rsplit(']').next().is_some_and(|end| end.contains(':')) {
            host.to_owned()
        } else {
            format!("{host}:80")
        };
        let places = with_port.to_socket_addrs().map_err(|error| absent(&error))?;
        let mut last = None;
        let stream = places
            .into_iter()
            .find_map(|place| TcpStream::connect_timeout(&place, CONNECTS).map_err(|error| last = Some(error)).ok());
        let stream = stream.ok_or_else(|| last.map_or_else(|| absent(&"no such host"), |error| absent(&error)))?;
        let stream = Patient::of(stream, SAYS_WHO).map_err(|error| absent(&error))?;
        let config = WebSocketConfig::default().max_message_size(Some(LARGEST)).max_frame_size(Some(LARGEST));
        let (socket, _) =
            tungstenite::client::client_with_config(address, stream, Some(config)).map_err(|error| match error {
                HandshakeError::Failure(_) if ending::asked() => ServedError::Interrupted,
                HandshakeError::Failure(error) => absent(&error),
                HandshakeError::Interrupted(_) => absent(&"it does not answer as a websocket"),
            })?;
        let mut served = Self { address: address.to_owned(), socket: Box::new(socket), metadata: Value::Nil };
        served.metadata = served.receive()?;
        Ok(served)
    }

    /// What the server says about itself.
    pub fn metadata(&self) -> &Value {
        &self.metadata
    }

    /// Asks for the next actions, a row each.
    ///
    /// # Errors
    /// [`ServedError`].
    pub fn actions(&mut self, observation: &Value) -> Result<Rows, ServedError> {
        self.socket.get_mut().wait(ANSWERS);
        let sent = self.socket.send(Message::Binary(pack(observation).into()));
        sent.map_err(|error| self.silent(&error))?;
        let answer = self.receive()?;
        let actions = entry(&answer, "actions").ok_or_else(|| PackedError("no `actions`".into()));
        let rows = actions.and_then(|actions| Array::within(actions, MOST_NUMBERS)).and_then(Array::into_rows);
        rows.map_err(|error| self.answer(&error))
    }

    /// An answer that does not fit the task.
    pub fn answer(&self, what: &dyn std::fmt::Display) -> ServedError {
        ServedError::Answer { address: self.address.clone(), what: what.to_string() }
    }

    fn silent(&self, cause: &dyn std::fmt::Display) -> ServedError {
        if ending::asked() {
            return ServedError::Interrupted;
        }
        ServedError::Silent { address: self.address.clone(), cause: cause.to_string() }
    }

    fn receive(&mut self) -> Result<Value, ServedError> {
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => return unpack(&bytes).map_err(|error| self.answer(&error)),
                Ok(Message::Text(words)) => {
                    let last = words.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it gave no reason");
                    return Err(ServedError::Failed { address: self.address.clone(), words: last.trim().to_owned() });
                }
                Ok(Message::Close(_)) => return Err(self.silent(&"it closed the connection")),
                Ok(_) => {}
                Err(error) => return Err(self.silent(&error)),
            }
        }
    }
}
