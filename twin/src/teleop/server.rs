//! The page, and a WebSocket for each that is open (the only code that asks `axum` and `tokio`).

use super::message::Input;
use super::seats::Seats;
use super::steering::{Order, Recording, Steering, Summary, TeleopError};
use crate::task::Task;
use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use axum::serve::ListenerExt as _;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;
use tokio::sync::watch;

/// The page. Nothing else is fetched.
const PAGE: &str = include_str!("page.html");
/// Most pages at once.
const MOST: usize = 8;
/// Longest message of a page [bytes].
const LONGEST: usize = 16 * 1024;
/// How often it is looked whether to end.
const LOOK: Duration = Duration::from_millis(50);

/// Where the page is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Address {
    /// Of which of this machine's addresses; the loopback's is seen by this machine alone.
    pub ip: IpAddr,
    /// 0: any that is free.
    pub port: u16,
}

/// The page cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The task, or where clips go.
    #[error(transparent)]
    Teleop(#[from] TeleopError),
    /// The port.
    #[error("cannot listen on {at}: {source}; give another --port, or an address of this machine to --bind")]
    Listen {
        /// What was asked for.
        at: SocketAddr,
        /// What the system said.
        source: std::io::Error,
    },
    /// A thread or its timer.
    #[error("the page cannot be served: {0}; look at the machine's memory and limits, then start again")]
    System(std::io::Error),
    /// A thread of this program.
    #[error("the simulation failed; episodes that were kept are there; please report this")]
    Failed,
}

/// What every connection needs.
#[derive(Clone)]
struct Shared {
    seats: Arc<Seats>,
    hello: Arc<str>,
    orders: Sender<Order>,
    frames: watch::Receiver<Bytes>,
    /// Whether other machines may ask.
    is_open: bool,
}

/// Shows the page until `stop`; `ready` is given its address. One episode after the other is simulated and recorded.
///
/// # Errors
/// [`ServeError`] when it cannot begin. What happens to single pages ends nothing.
pub fn serve(
    task: &Arc<Task>,
    camera: Option<&str>,
    recording: Recording,
    address: Address,
    stop: &Arc<AtomicBool>,
    ready: impl FnOnce(SocketAddr),
) -> Result<Summary, ServeError> {
    let at = SocketAddr::new(address.ip, address.port);
    let steering = Steering::new(task, camera, recording)?;
    let listen = |source| ServeError::Listen { at, source };
    let listener = TcpListener::bind(at).map_err(listen)?;
    listener.set_nonblocking(true).map_err(listen)?;
    let (orders, ordered) = channel();
    let (shown, frames) = watch::channel(Bytes::new());
    let is_open = !address.ip.is_loopback();
    let shared = Shared { seats: Arc::default(), hello: steering.hello().into(), orders, frames, is_open };
    let told = Arc::clone(stop);
    let steered = std::thread::Builder::new()
        .name("steering".into())
        .spawn(move || {
            steering.run(&ordered, &told, |frame| {
                // Nobody may be looking.
                shown.send_replace(frame.into());
            })
        })
        .map_err(ServeError::System)?;
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build().map_err(ServeError::System)?;
    let served = runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        ready(listener.local_addr()?);
        // A picture does not wait for the next.
        let listener = listener.tap_io(|stream| drop(stream.set_nodelay(true)));
        let routes = Router::new().route("/", get(page)).route("/ws", get(upgrade)).with_state(shared);
        tokio::select! {
            ended = axum::serve(listener, routes) => ended,
            () = asked(stop) => Ok(()),
        }
    });
    stop.store(true, Ordering::Relaxed);
    runtime.shutdown_background();
    let summary = steered.join().map_err(|_| ServeError::Failed)?;
    served.map_err(ServeError::System)?;
    Ok(summary)
}

async fn asked(stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        tokio::time::sleep(LOOK).await;
    }
}

async fn page(State(shared): State<Shared>, headers: HeaderMap) -> Response {
    if let Err(refusal) = admitted(&headers, shared.is_open) {
        return refusal.into_response();
    }
    Html(PAGE).into_response()
}

async fn upgrade(State(shared): State<Shared>, headers: HeaderMap, socket: WebSocketUpgrade) -> Response {
    if let Err(refusal) = admitted(&headers, shared.is_open) {
        return refusal.into_response();
    }
    let Some(seat) = shared.seats.take(MOST) else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many pages are open; close one of them").into_response();
    };
    socket.max_message_size(LONGEST).on_upgrade(move |socket| async move {
        // A page that goes away in the middle is no fault of anybody's.
        let _gone = attend(socket, seat, &shared).await;
        if shared.seats.leave(seat) {
            let _ended = shared.orders.send(Order::Gone);
        }
    })
}

/// Whether a request comes from this page: another site that a browser shows must not steer, nor one whose name leads here.
fn admitted(headers: &HeaderMap, is_open: bool) -> Result<(), (StatusCode, &'static str)> {
    let text = |name| headers.get(name).and_then(|value: &axum::http::HeaderValue| value.to_str().ok());
    let host = text(header::HOST).unwrap_or_default();
    if !is_open && !is_local(host) {
        return Err((StatusCode::FORBIDDEN, "open http://127.0.0.1 or http://localhost with the port"));
    }
    let foreign = text(header::ORIGIN).is_some_and(|origin| origin.strip_prefix("http://") != Some(host));
    if foreign || headers.get(header::ORIGIN).is_some_and(|origin| origin.to_str().is_err()) {
        return Err((StatusCode::FORBIDDEN, "only the page that this program shows may connect"));
    }
    Ok(())
}

fn is_local(host: &str) -> bool {
    ["localhost", "127.0.0.1", "[::1]"].iter().any(|local| {
        host.strip_prefix(local).is_some_and(|rest| {
            rest.is_empty() || rest.strip_prefix(':').is_some_and(|port| port.parse::<u16>().is_ok())
        })
    })
}

/// One page: its messages in, pictures out, as fast as it takes them.
async fn attend(mut socket: WebSocket, seat: u64, shared: &Shared) -> Result<(), axum::Error> {
    let mut frames = shared.frames.clone();
    socket.send(Message::Text(shared.hello.as_ref().into())).await?;
    let mut steered = None;
    loop {
        let steers = shared.seats.steers(seat);
        if steered.replace(steers) != Some(steers) {
            let role = if steers { "steers" } else { "watches" };
            socket.send(Message::Text(format!("{{\"role\": \"{role}\"}}").into())).await?;
        }
        tokio::select! {
            message = socket.recv() => match message {
                Some(Ok(Message::Text(text))) => {
                    if let Err(line) = take(&text, steers, shared) {
                        let line = serde_json::json!({ "error": line }).to_string();
                        socket.send(Message::Text(line.into())).await?;
                    }
                }
                Some(Ok(Message::Binary(_))) => {
                    let line = serde_json::json!({ "error": "not a message: it is binary; send JSON as text" }).to_string();
                    socket.send(Message::Text(line.into())).await?;
                }
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Close(_)) | Err(_)) | None => return Ok(()),
            },
            changed = frames.changed() => {
                if changed.is_err() {
                    return Ok(());
                }
                let frame = frames.borrow_and_update().clone();
                socket.send(Message::Binary(frame)).await?;
            }
        }
    }
}

fn take(text: &str, steers: bool, shared: &Shared) -> Result<(), String> {
    let input = Input::read(text)?;
    if !steers {
        return Err("this page watches: another one steers; it takes over when that one is closed".into());
    }
    // The simulation ends before its pages do.
    let _ended = shared.orders.send(Order::Input(input));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_sites_are_not_admitted() {
        let headers = |host: &'static str, origin: Option<&'static str>| {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, host.parse().expect("a value"));
            if let Some(origin) = origin {
                headers.insert(header::ORIGIN, origin.parse().expect("a value"));
            }
            headers
        };
        for (host, origin, is_open, admits) in [
            ("127.0.0.1:8380", None, false, true),
            ("localhost:8380", Some("http://localhost:8380"), false, true),
            ("[::1]:8380", Some("http://[::1]:8380"), false, true),
            ("localhost:8380", Some("http://example.org"), false, false),
            ("example.org:8380", Some("http://example.org:8380"), false, false),
            ("localhost.example.org", None, false, false),
            ("bench:8380", Some("http://bench:8380"), true, true),
            ("bench:8380", Some("https://example.org"), true, false),
        ] {
            assert_eq!(admitted(&headers(host, origin), is_open).is_ok(), admits, "{host} {origin:?}");
        }
    }
}
