//! The page, and a WebSocket for each that is open (the only code that asks `axum` and `tokio`).

use super::hosts::Hosts;
use super::message::Input;
use super::orders::Orders;
use super::seats::{Seat, Seats};
use super::steering::{Recording, Steering, Summary, TeleopError};
use crate::task::Task;
use axum::Router;
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use axum::serve::ListenerExt as _;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::MissedTickBehavior;

/// The page. Nothing else is fetched.
const PAGE: &str = include_str!("page.html");
/// Most pages at once.
const MAX_PAGES: usize = 8;
/// Longest message of a page [bytes].
const LONGEST: usize = 16 * 1024;
/// Most messages of a page that are heard from one picture to the next; what is more waits at the page. A page that sends as fast as
/// it can would keep the others from being attended to.
const HEARD: usize = 128;
/// How often a page is asked whether it is there.
const ASK: Duration = Duration::from_secs(2);
/// A page that answers none of so many in a row is gone, though its connection never ended: the next one steers.
const UNANSWERED: u32 = 5;
/// The same of one that takes nothing for so long.
const TAKES_NOTHING: Duration = Duration::from_secs(10);
/// How often it is looked whether to end.
const POLL_PERIOD: Duration = Duration::from_millis(50);

/// Where the page is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Of which of this machine's addresses; the loopback's is seen by this machine alone.
    pub ip: IpAddr,
    /// 0: any that is free.
    pub port: u16,
    /// Names by which the page is opened, beside `localhost`, this machine's own and its address.
    pub names: Vec<String>,
}

/// The page cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The task, or where clips go.
    #[error(transparent)]
    Teleop(#[from] TeleopError),
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
    orders: Arc<Orders>,
    hello: Arc<str>,
    frames: watch::Receiver<Bytes>,
    hosts: Arc<Hosts>,
}

/// Shows the page until `stop`; `ready` is given its address. One episode after the other is simulated and recorded.
///
/// # Errors
/// [`ServeError`] when it cannot begin. What happens to single pages ends nothing.
pub fn serve(
    task: &Arc<Task>,
    camera: Option<&str>,
    recording: Recording,
    address: &Address,
    stop: &Arc<AtomicBool>,
    ready: impl FnOnce(SocketAddr),
) -> Result<Summary, ServeError> {
    let at = SocketAddr::new(address.ip, address.port);
    let steering = Steering::new(task, camera, recording)?;
    let listen = |source| ServeError::Listen { at, source };
    let listener = TcpListener::bind(at).map_err(listen)?;
    listener.set_nonblocking(true).map_err(listen)?;
    let (orders, (shown, frames)) = (Arc::new(Orders::default()), watch::channel(Bytes::new()));
    let ordered = Arc::clone(&orders);
    let shared = Shared {
        seats: Seats::new(Arc::clone(&orders)),
        orders,
        hello: steering.hello().into(),
        frames,
        hosts: Arc::new(Hosts::of(address.ip, &address.names)),
    };
    let stopping = Arc::clone(stop);
    let steered = std::thread::Builder::new()
        .name("steering".into())
        .spawn(move || {
            steering.run(&ordered, &stopping, |frame| {
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
        let routes = Router::new().route("/", get(|| async { Html(PAGE) })).route("/ws", get(upgrade));
        let routes = routes.layer(from_fn_with_state(shared.clone(), gate)).with_state(shared);
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
        tokio::time::sleep(POLL_PERIOD).await;
    }
}

/// Answers a request where it is admitted; each answer says that no other site's page may show it within itself.
async fn gate(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    let mut answer = match admitted(request.headers(), &shared.hosts) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    // Who clicks on this page within one of another site does not see what he does.
    let headers = answer.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static("frame-ancestors 'none'"));
    headers.insert(header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
    answer
}

async fn upgrade(State(shared): State<Shared>, socket: WebSocketUpgrade) -> Response {
    let Some(seat) = shared.seats.take(MAX_PAGES) else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many pages are open; close one of them").into_response();
    };
    // The seat goes along: where the connection fails before it is a page's, it is dropped with what was to come.
    socket.max_message_size(LONGEST).on_upgrade(move |socket| async move {
        let page = Page { socket, seat, shared, unanswered: 0, heard: 0, is_warned: false };
        // A page that goes away in the middle is no fault of anybody's.
        let _gone = page.attend().await;
    })
}

/// Whether a request comes from this page: another site that a browser shows must not steer, nor one whose name leads here.
fn admitted(headers: &HeaderMap, hosts: &Hosts) -> Result<(), (StatusCode, &'static str)> {
    let only = |name| {
        let mut values = headers.get_all(name).iter();
        (values.next().map(HeaderValue::to_str), values.next().is_none())
    };
    let (Some(Ok(host)), true) = only(header::HOST) else {
        return Err((StatusCode::FORBIDDEN, "give one Host: the address at which the page is"));
    };
    if !hosts.allow(host) {
        let words = "the page is at the address that twin teleop prints; by another name it is opened once that is given to --name";
        return Err((StatusCode::FORBIDDEN, words));
    }
    match only(header::ORIGIN) {
        (None, _) => Ok(()),
        (Some(Ok(origin)), true) if origin.strip_prefix("http://") == Some(host) => Ok(()),
        _ => Err((StatusCode::FORBIDDEN, "only the page that this program shows may connect")),
    }
}

/// One open page, in its seat.
struct Page {
    socket: WebSocket,
    seat: Seat,
    shared: Shared,
    /// How often in a row it was asked whether it is there, and nothing came.
    unanswered: u32,
    /// Messages heard since the last picture.
    heard: usize,
    /// Whether it heard, since the last picture, that it sends too much.
    is_warned: bool,
}

/// The page is gone, or as good as gone.
struct PageClosed;

impl Page {
    /// Its messages in, pictures out, as fast as it takes them.
    async fn attend(mut self) -> Result<(), PageClosed> {
        let mut frames = self.shared.frames.clone();
        let hello = self.shared.hello.as_ref().into();
        self.say(Message::Text(hello)).await?;
        let mut ask = tokio::time::interval(ASK);
        ask.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut steered = None;
        loop {
            let steers = self.seat.steers();
            if steered.replace(steers) != Some(steers) {
                let role = if steers { "steers" } else { "watches" };
                self.say(Message::Text(format!("{{\"role\": \"{role}\"}}").into())).await?;
            }
            tokio::select! {
                message = self.socket.recv(), if self.heard < HEARD => match message {
                    Some(Ok(message)) => self.hear(message).await?,
                    Some(Err(_)) | None => return Err(PageClosed),
                },
                changed = frames.changed() => {
                    changed.map_err(|_| PageClosed)?;
                    let frame = frames.borrow_and_update().clone();
                    (self.heard, self.is_warned) = (0, false);
                    self.say(Message::Binary(frame)).await?;
                }
                _ = ask.tick() => {
                    if self.unanswered >= UNANSWERED {
                        return Err(PageClosed);
                    }
                    self.unanswered += 1;
                    self.say(Message::Ping(Bytes::new())).await?;
                }
            }
        }
    }

    async fn say(&mut self, message: Message) -> Result<(), PageClosed> {
        match tokio::time::timeout(TAKES_NOTHING, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(PageClosed),
        }
    }

    async fn hear(&mut self, message: Message) -> Result<(), PageClosed> {
        (self.unanswered, self.heard) = (0, self.heard + 1);
        let line = match message {
            Message::Text(text) => match self.take(&text) {
                Ok(()) => return Ok(()),
                Err(line) => line,
            },
            Message::Binary(_) => "not a message: it is binary; send JSON as text".to_owned(),
            Message::Ping(_) | Message::Pong(_) => return Ok(()),
            Message::Close(_) => return Err(PageClosed),
        };
        self.say(Message::Text(serde_json::json!({ "error": line }).to_string().into())).await
    }

    fn take(&mut self, text: &str) -> Result<(), String> {
        let input = Input::read(text)?;
        let steers = self.seat.steers();
        if input.stop {
            // Who watches may see first that it has to end.
            self.shared.orders.stop(if steers { input.id } else { 0 });
            return Ok(());
        }
        if !steers {
            return Err("this page watches: another one steers; it takes over when that one is closed".into());
        }
        if !self.shared.orders.ask(input) && !std::mem::replace(&mut self.is_warned, true) {
            return Err("too many messages at once, some are left out; send no more than fifty a second".into());
        }
        Ok(())
    }
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
        let hosts = Hosts::of([192, 168, 1, 5].into(), &["bench".to_owned()]);
        for (host, origin, admits) in [
            ("192.168.1.5:8380", None, true),
            ("localhost:8380", Some("http://localhost:8380"), true),
            ("localhost:8380", Some("http://example.org"), false),
            ("localhost:8380", Some("http://localhost:8381"), false),
            ("localhost:8380", Some("https://localhost:8380"), false),
            ("localhost:8380", Some("null"), false),
            ("example.org:8380", Some("http://example.org:8380"), false),
            ("example.org:8380", None, false),
            ("bench:8380", Some("http://bench:8380"), true),
            ("bench:8380", Some("https://example.org"), false),
        ] {
            assert_eq!(admitted(&headers(host, origin), &hosts).is_ok(), admits, "{host} {origin:?}");
        }
        assert!(admitted(&HeaderMap::new(), &hosts).is_err(), "no host");
        for name in [header::HOST, header::ORIGIN] {
            let mut twice = headers("bench:8380", Some("http://bench:8380"));
            twice.append(name, "http://bench:8380".parse().expect("a value"));
            assert!(admitted(&twice, &hosts).is_err(), "two of one header");
        }
    }
}
