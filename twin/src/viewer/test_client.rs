//! A viewer for tests: connects over a real socket, asks for channels by their topics and hands out what they carry.

use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Long enough for a busy machine; only a fault uses it up.
pub(super) const LONG: Duration = Duration::from_secs(60);
/// WebSocket's codes of what a frame holds (RFC 6455, section 5.2).
const TEXT: u8 = 1;
const BINARY: u8 = 2;
/// Foxglove's code of a message on a channel; subscription and log time stand before its data.
const MESSAGE: u8 = 1;

/// A connection that asks to become a WebSocket, from a page of `origin` where it is a browser's; and the first line of the
/// reply.
pub(super) fn connect(address: SocketAddr, origin: Option<&str>) -> (TcpStream, String) {
    let mut tcp = TcpStream::connect(address).expect("it listens");
    tcp.set_read_timeout(Some(LONG)).expect("a timeout above zero");
    let origin = origin.map_or(String::new(), |origin| format!("Origin: {origin}\r\n"));
    let request = format!(
        "GET / HTTP/1.1\r\nHost: {address}\r\n{origin}Upgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
         Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
    );
    tcp.write_all(request.as_bytes()).expect("it reads");
    let mut reply = Vec::new();
    while !reply.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        tcp.read_exact(&mut byte).expect("a reply");
        reply.push(byte[0]);
    }
    let reply = String::from_utf8(reply).expect("text");
    (tcp, reply.lines().next().expect("a status").to_owned())
}

/// Sends a text whose mask is zero.
pub(super) fn say(tcp: &mut TcpStream, text: &str) {
    let length = u16::try_from(text.len()).expect("a text of up to 64 kB");
    let header = [&[0x80 | TEXT, 0x80 | 126][..], &length.to_be_bytes(), &[0; 4]].concat();
    tcp.write_all(&[&header, text.as_bytes()].concat()).expect("it reads");
}

/// A connected viewer.
pub(super) struct TestClient {
    tcp: TcpStream,
    /// By subscription: the topic.
    topics: BTreeMap<u32, String>,
}

impl TestClient {
    /// Connects and subscribes to `topics`, each of which has to be offered with the schema named beside it.
    pub(super) fn of(address: SocketAddr, topics: &[(&str, &str)]) -> Self {
        let (tcp, status) = connect(address, None);
        assert!(status.starts_with("HTTP/1.1 101"), "{status}");
        let mut client = Self { tcp, topics: BTreeMap::new() };
        let mut offered = BTreeMap::new();
        while !topics.iter().all(|(topic, _)| offered.contains_key(*topic)) {
            let (TEXT, text) = client.frame() else { continue };
            let message: Value = serde_json::from_slice(&text).expect("JSON");
            for channel in message["channels"].as_array().into_iter().flatten() {
                let [topic, schema] =
                    ["topic", "schemaName"].map(|key| channel[key].as_str().expect("text").to_owned());
                offered.insert(topic, (schema, channel["id"].clone()));
            }
        }
        let mut subscriptions = Vec::new();
        for (id, (topic, schema)) in (1..).zip(topics) {
            let (offered, channel) = &offered[*topic];
            assert_eq!(offered, schema, "{topic}");
            subscriptions.push(serde_json::json!({ "id": id, "channelId": channel }));
            client.topics.insert(id, (*topic).to_owned());
        }
        let subscribe = serde_json::json!({ "op": "subscribe", "subscriptions": subscriptions });
        say(&mut client.tcp, &subscribe.to_string());
        client
    }

    /// The next message: its topic and its data.
    pub(super) fn next(&mut self) -> (String, Vec<u8>) {
        loop {
            if let (BINARY, bytes) = self.frame()
                && let [MESSAGE, a, b, c, d, rest @ ..] = &bytes[..]
            {
                let topic = self.topics[&u32::from_le_bytes([*a, *b, *c, *d])].clone();
                return (topic, rest[8..].to_vec());
            }
        }
    }

    /// What a frame holds, and its payload.
    fn frame(&mut self) -> (u8, Vec<u8>) {
        let mut start = [0; 2];
        self.tcp.read_exact(&mut start).expect("a frame");
        let length = match start[1] & 0x7f {
            126 => self.number::<2>(),
            127 => self.number::<8>(),
            short => u64::from(short),
        };
        let mut payload = vec![0; usize::try_from(length).expect("a frame of this machine")];
        self.tcp.read_exact(&mut payload).expect("its payload");
        (start[0] & 0x0f, payload)
    }

    fn number<const N: usize>(&mut self) -> u64 {
        let mut bytes = [0; N];
        self.tcp.read_exact(&mut bytes).expect("a length");
        bytes.iter().fold(0, |value, byte| value << 8 | u64::from(*byte))
    }
}
