//! Pages for a browser: where they are, by which names they are opened, and who is answered.
//!
//! | file | owns |
//! |---|---|
//! | `hosts` | by which names a page may be opened |
//! | `turns` | long work beside the thread that answers, one piece at a time |
//!
//! With the servers of [`crate::teleop`] and [`crate::show`] the only code that asks `axum` and `tokio`.

mod hosts;
mod turns;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse as _, Response};
use axum::serve::ListenerExt as _;
use hosts::Hosts;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

pub(crate) use turns::OneAtATime;

/// How often it is looked whether to end.
const POLL_PERIOD: Duration = Duration::from_millis(50);

/// Where pages are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Of which of this machine's addresses; the loopback's is seen by this machine alone.
    pub ip: IpAddr,
    /// 0: any that is free.
    pub port: u16,
    /// Names by which a page is opened, beside `localhost`, this machine's own and its address.
    pub names: Vec<String>,
}

/// Pages cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum WebError {
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
}

/// An address that is listened at; nobody is answered yet.
pub(crate) struct Site {
    listener: TcpListener,
    hosts: Arc<Hosts>,
}

impl Site {
    /// Listens.
    ///
    /// # Errors
    /// [`WebError::Listen`].
    pub(crate) fn open(address: &Address) -> Result<Self, WebError> {
        let at = SocketAddr::new(address.ip, address.port);
        let listen = |source| WebError::Listen { at, source };
        let listener = TcpListener::bind(at).map_err(listen)?;
        listener.set_nonblocking(true).map_err(listen)?;
        Ok(Self { listener, hosts: Arc::new(Hosts::of(address.ip, &address.names)) })
    }

    /// Answers by these routes until `stop`; `ready` is given the address. Requests of other sites' pages are refused.
    ///
    /// # Errors
    /// [`WebError::System`]. What happens to single pages ends nothing.
    pub(crate) fn serve(
        self,
        routes: Router,
        stop: &AtomicBool,
        ready: impl FnOnce(SocketAddr),
    ) -> Result<(), WebError> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build();
        let runtime = runtime.map_err(WebError::System)?;
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            ready(listener.local_addr()?);
            // A picture does not wait for the next.
            let listener = listener.tap_io(|stream| drop(stream.set_nodelay(true)));
            let routes = routes.layer(from_fn_with_state(self.hosts, gate));
            tokio::select! {
                ended = axum::serve(listener, routes) => ended,
                () = asked(stop) => Ok(()),
            }
        });
        runtime.shutdown_background();
        served.map_err(WebError::System)
    }
}

async fn asked(stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        tokio::time::sleep(POLL_PERIOD).await;
    }
}

/// Answers a request where it is admitted; each answer says that no other site's page may show it within itself.
async fn gate(State(hosts): State<Arc<Hosts>>, request: Request, next: Next) -> Response {
    let mut answer = match admitted(request.headers(), &hosts) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    // Who clicks on this page within one of another site does not see what he does.
    let headers = answer.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static("frame-ancestors 'none'"));
    headers.insert(header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
    answer
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
        let words = "the page is at the address that the program prints; by another name it is opened once that is given to --name";
        return Err((StatusCode::FORBIDDEN, words));
    }
    match only(header::ORIGIN) {
        (None, _) => Ok(()),
        (Some(Ok(origin)), true) if origin.strip_prefix("http://") == Some(host) => Ok(()),
        _ => Err((StatusCode::FORBIDDEN, "only the page that this program shows may connect")),
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
