//! The page, and a WebSocket for each that is open.

use super::message::Input;
use super::orders::Orders;
use super::seats::{Seat, Seats};
use super::steering::{Recording, Steering, Summary, TeleopError};
use crate::task::Task;
use crate::web::{Address, Site, WebError};
use axum::Router;
use axum::body::Bytes;
use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use std::net::SocketAddr;
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
/// The page cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The task, or where clips go.
    #[error(transparent)]
    Teleop(#[from] TeleopError),
    /// The page.
    #[error(transparent)]
    Web(#[from] WebError),
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
    let steering = Steering::new(task, camera, recording)?;
    let site = Site::open(address)?;
    let (orders, (shown, frames)) = (Arc::new(Orders::default()), watch::channel(Bytes::new()));
    let ordered = Arc::clone(&orders);
    let shared = Shared { seats: Seats::new(Arc::clone(&orders)), orders, hello: steering.hello().into(), frames };
    let stopping = Arc::clone(stop);
    let steered = std::thread::Builder::new()
        .name("steering".into())
        .spawn(move || {
            steering.run(&ordered, &stopping, |frame| {
                // Nobody may be looking.
                shown.send_replace(frame.into());
            })
        })
        .map_err(WebError::System)?;
    let routes = Router::new().route("/", get(|| async { Html(PAGE) })).route("/ws", get(upgrade)).with_state(shared);
    let served = site.serve(routes, stop, ready);
    stop.store(true, Ordering::Relaxed);
    let summary = steered.join().map_err(|_| ServeError::Failed)?;
    served?;
    Ok(summary)
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
