//! A policy's server in this process, by openpi's protocol.

use evaluation::policy::{pack, unpack};
use rmpv::Value;
use std::net::TcpListener;
use std::thread;
use tungstenite::Message;

/// Serves one client at an address of its own: metadata, then an answer to each observation; `None` closes the connection.
pub(super) fn serve(mut answer: impl FnMut(&Value) -> Option<Message> + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("an address"));
    thread::spawn(move || {
        let (stream, _) = listener.accept().expect("a client");
        let mut socket = tungstenite::accept(stream).expect("a handshake");
        let metadata = Value::Map(vec![("name".into(), "test".into())]);
        socket.send(Message::Binary(pack(&metadata).into())).expect("a client");
        while let Ok(Message::Binary(bytes)) = socket.read() {
            let Some(message) = answer(&unpack(&bytes).expect("an observation")) else { break };
            if socket.send(message).is_err() {
                break;
            }
        }
    });
    address
}

/// An answer with actions, a row each.
pub(super) fn actions(rows: &[Vec<f32>]) -> Message {
    let rows = rows.iter().map(|row| Value::Array(row.iter().map(|value| Value::from(*value)).collect())).collect();
    Message::Binary(pack(&Value::Map(vec![("actions".into(), Value::Array(rows))])).into())
}

/// What stands under a key of an observation.
pub(super) fn entry<'a>(observation: &'a Value, key: &str) -> &'a Value {
    let pairs = observation.as_map().expect("a map");
    &pairs.iter().find(|(found, _)| found.as_str() == Some(key)).unwrap_or_else(|| panic!("no {key}")).1
}
