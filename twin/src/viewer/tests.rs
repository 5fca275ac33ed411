//! Viewers that are too many, that come from elsewhere or that do not read, over real sockets.

use super::front::Front;
use super::open;
use super::request::MAX_VIEWERS;
use super::test_client::{LONG, connect, say};
use foxglove::{ChannelBuilder, Context, RawChannel, WebSocketServer, WebSocketServerHandle};
use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Bytes of a message.
const MESSAGE: usize = 256 * 1024;

struct Shown {
    front: Front,
    server: WebSocketServerHandle,
    channel: Arc<RawChannel>,
    /// Server and channel find each other through it, and do not keep it.
    context: Arc<Context>,
}

/// A server with one channel.
fn shown(patience: Duration) -> Shown {
    let context = Context::new();
    let server = WebSocketServer::new().context(&context);
    let (front, server) = open(server, SocketAddr::from(([127, 0, 0, 1], 0)), patience).expect("a free port");
    let channel = ChannelBuilder::new("/pictures").message_encoding("json").context(&context).build_raw();
    Shown { front, server, channel: channel.expect("a channel"), context }
}

impl Shown {
    /// A connection from a page of `origin`, and the first line of the reply to its request.
    fn connect(&self, origin: &str) -> (TcpStream, String) {
        connect(self.front.address(), Some(origin))
    }

    /// A viewer that asks for the pictures.
    fn viewer(&self) -> TcpStream {
        let (mut tcp, status) = self.connect("https://app.foxglove.dev");
        assert!(status.starts_with("HTTP/1.1 101"), "{status}");
        let subscribe = format!(
            r#"{{"op":"subscribe","subscriptions":[{{"id":1,"channelId":{}}}]}}"#,
            u64::from(self.channel.id())
        );
        say(&mut tcp, &subscribe);
        tcp
    }

    /// Waits until so many viewers have their place.
    fn wait_for(&self, viewers: usize) {
        until(|| self.front.viewers() == viewers);
    }
}

/// Waits until `holds` does.
fn until(mut holds: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < LONG, "it never comes to that");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Resident memory of this process [bytes].
fn resident() -> usize {
    let statm = std::fs::read_to_string("/proc/self/statm").expect("Linux");
    4096 * statm.split(' ').nth(1).and_then(|pages| pages.parse::<usize>().ok()).expect("a number of pages")
}

#[test]
fn viewers_that_do_not_read_cost_little_and_disturb_nobody() {
    let shown = shown(LONG);
    let stuck: Vec<TcpStream> = (0..MAX_VIEWERS - 1).map(|_| shown.viewer()).collect();
    let mut reads = shown.viewer();
    until(|| shown.channel.has_sinks());
    let before = resident();
    let reader = std::thread::spawn(move || {
        let (mut total, mut bytes) = (0, vec![0; MESSAGE]);
        while total < 20 * MESSAGE {
            match reads.read(&mut bytes) {
                Ok(0) => break,
                Ok(length) => total += length,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => panic!("{error}"),
            }
        }
        total
    });
    let (message, mut most, mut sent) = (vec![7; MESSAGE], 0, 0);
    // A gigabyte; without bounds the stuck ones would hold most of it three times.
    while sent < 4096 || !reader.is_finished() {
        shown.channel.log(&message);
        sent += 1;
        if sent % 64 == 0 {
            most = most.max(resident().saturating_sub(before));
        }
    }
    assert!(reader.join().expect("it does not panic") >= 20 * MESSAGE, "the one that reads is served");
    assert!(most < 400 << 20, "{} MB for viewers that do not read", most >> 20);
    // The one that read has left.
    assert!(shown.front.viewers() >= MAX_VIEWERS - 1);
    let Shown { front, server, context, .. } = shown;
    drop(front);
    server.stop().wait_blocking();
    drop((stuck, context));
}

#[test]
fn one_viewer_too_many_is_refused_and_finds_a_place_when_another_has_left() {
    let shown = shown(LONG);
    let mut viewers: Vec<TcpStream> = (0..MAX_VIEWERS).map(|_| shown.viewer()).collect();
    shown.wait_for(MAX_VIEWERS);
    let (mut refused, status) = shown.connect("file://");
    assert_eq!(status, "HTTP/1.1 503 Service Unavailable");
    let mut text = String::new();
    refused.read_to_string(&mut text).expect("the reason, and the end");
    assert!(text.contains("close one of them"), "{text}");
    drop(viewers.pop());
    shown.wait_for(MAX_VIEWERS - 1);
    viewers.push(shown.viewer());
    shown.wait_for(MAX_VIEWERS);
    until(|| shown.server.client_count() == MAX_VIEWERS);
}

#[test]
fn a_page_of_somebody_else_sees_nothing_and_takes_no_place() {
    let shown = shown(LONG);
    for _ in 0..2 * MAX_VIEWERS {
        assert_eq!(shown.connect("https://example.org").1, "HTTP/1.1 403 Forbidden");
    }
    // Nor do connections that say nothing, or something else.
    let silent: Vec<TcpStream> =
        (0..MAX_VIEWERS).map(|_| TcpStream::connect(shown.front.address()).expect("it listens")).collect();
    let mut other = TcpStream::connect(shown.front.address()).expect("it listens");
    other.write_all(b"GET /etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n").expect("it reads");
    other.set_read_timeout(Some(LONG)).expect("a timeout above zero");
    let mut reply = String::new();
    other.read_to_string(&mut reply).expect("a reply, and the end");
    assert!(reply.starts_with("HTTP/1.1 400 "), "{reply}");
    assert_eq!((shown.front.viewers(), shown.server.client_count()), (0, 0));
    let _viewer = shown.viewer();
    shown.wait_for(1);
    drop(silent);
}

#[test]
fn a_viewer_that_reads_nothing_any_more_gives_its_place_back() {
    let shown = shown(Duration::from_millis(200));
    let stuck: Vec<TcpStream> = (0..MAX_VIEWERS).map(|_| shown.viewer()).collect();
    until(|| shown.channel.has_sinks());
    let message = vec![7; MESSAGE];
    until(|| {
        shown.channel.log(&message);
        shown.front.viewers() == 0 && shown.server.client_count() == 0
    });
    let _viewer = shown.viewer();
    shown.wait_for(1);
    drop(stuck);
}
