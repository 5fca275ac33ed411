//! Which requests for a WebSocket are those of a viewer on this machine, and how many are served. Pure.

use std::fmt;
use std::io;

/// Names of this machine as a viewer on it may write them. Any other leads here through a name server, and a web page can
/// have its own name lead here.
const LOCAL: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];
/// Viewers that run in a browser, by where they are loaded from.
const HOSTED: [&str; 3] = ["app.foxglove.dev", "studio.foxglove.dev", "lichtblick-suite.github.io"];
/// Viewers that are installed load themselves so, which no web page does.
const INSTALLED: [&str; 4] = ["file", "app", "foxglove", "lichtblick"];

/// Viewers at a time.
pub(super) const MAX_VIEWERS: usize = 4;
/// Longest part of a name that is repeated to a person.
const SHOWN: usize = 80;

/// Why a connection is no viewer's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Refusal {
    /// All places are taken.
    Full,
    /// It is a web page, and not a viewer's.
    Page(String),
    /// It calls this machine by a name that is none of the loopback's.
    Name(String),
    /// It asks for something else than a WebSocket.
    NotAViewer,
    /// It said nothing, or the connection broke.
    Broken,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Full => write!(f, "{} are connected already; close one of them", MAX_VIEWERS),
            Self::Page(origin) => write!(
                f,
                "it is a page of {origin}; open the viewer at app.foxglove.dev, as an installed program, or from a server on this machine"
            ),
            Self::Name(host) => write!(f, "it asks for {host}; connect to ws://127.0.0.1 or ws://localhost"),
            Self::NotAViewer => write!(f, "it does not ask for a WebSocket of Foxglove's protocol"),
            Self::Broken => write!(f, "its request did not arrive"),
        }
    }
}

impl From<io::Error> for Refusal {
    fn from(_: io::Error) -> Self {
        Self::Broken
    }
}

impl Refusal {
    /// The reply of a web server that says so.
    pub(super) fn reply(&self) -> String {
        let status = match self {
            Self::Full => "503 Service Unavailable",
            Self::Page(_) | Self::Name(_) => "403 Forbidden",
            Self::NotAViewer | Self::Broken => "400 Bad Request",
        };
        let text = format!("this viewer was refused: {self}\n");
        format!(
            "HTTP/1.1 {status}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{text}",
            text.len()
        )
    }
}

/// Whether `request` is a viewer's.
pub(super) fn check(request: &[u8]) -> Result<(), Refusal> {
    let text = std::str::from_utf8(request).map_err(|_| Refusal::NotAViewer)?;
    let mut lines = text.split("\r\n");
    if !lines.next().is_some_and(|line| line.starts_with("GET ") && line.ends_with(" HTTP/1.1")) {
        return Err(Refusal::NotAViewer);
    }
    let (mut host, mut origin, mut protocol) = (None, None, false);
    for line in lines.take_while(|line| !line.is_empty()) {
        let (name, value) = line.split_once(':').ok_or(Refusal::NotAViewer)?;
        let value = value.trim();
        // Two of a kind: whoever reads the other one would see another request.
        match name.to_ascii_lowercase().as_str() {
            "host" if host.replace(value).is_some() => return Err(Refusal::NotAViewer),
            "origin" if origin.replace(value).is_some() => return Err(Refusal::NotAViewer),
            "sec-websocket-protocol" => protocol |= value.contains("foxglove.sdk."),
            _ => {}
        }
    }
    let host = host.ok_or(Refusal::NotAViewer)?;
    if !is_local(host) {
        return Err(Refusal::Name(shown(host)));
    }
    if let Some(origin) = origin.filter(|origin| !is_a_viewers(origin)) {
        return Err(Refusal::Page(shown(origin)));
    }
    if protocol { Ok(()) } else { Err(Refusal::NotAViewer) }
}

/// Whether `host`, with or without a port, is a name of this machine.
fn is_local(host: &str) -> bool {
    LOCAL.iter().any(|local| host.strip_prefix(local).is_some_and(is_port))
}

fn is_port(rest: &str) -> bool {
    rest.is_empty() || rest.strip_prefix(':').is_some_and(|port| port.parse::<u16>().is_ok())
}

/// Whether a page from `origin` is a viewer. Programs that are no browser send none.
fn is_a_viewers(origin: &str) -> bool {
    let Some((scheme, host)) = origin.split_once("://") else { return false };
    match scheme {
        "http" => is_local(host),
        "https" => is_local(host) || HOSTED.contains(&host),
        _ => INSTALLED.contains(&scheme),
    }
}

/// What may be shown of a name that a stranger chose.
fn shown(name: &str) -> String {
    name.chars().filter(|c| c.is_ascii_graphic()).take(SHOWN).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(host: &str, more: &str) -> Vec<u8> {
        format!("GET / HTTP/1.1\r\nHost: {host}\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n{more}\r\n").into_bytes()
    }

    #[test]
    fn viewers_come_in_and_pages_of_anybody_else_stay_out() {
        for host in ["127.0.0.1:8765", "localhost:8765", "[::1]:8765", "localhost"] {
            assert_eq!(check(&request(host, "")), Ok(()), "{host}");
        }
        let from = |origin: &str| check(&request("127.0.0.1:8765", &format!("oRIGIN:{origin}\r\n")));
        for origin in [
            "https://app.foxglove.dev",
            "http://localhost:8080",
            "http://127.0.0.1",
            "https://[::1]:3000",
            "file://",
            "foxglove://app",
        ] {
            assert_eq!(from(origin), Ok(()), "{origin}");
        }
        for origin in [
            "https://example.org",
            "http://app.foxglove.dev",
            "https://app.foxglove.dev.example.org",
            "https://example.org/app.foxglove.dev",
            "http://localhost.example.org",
            "http://localhost:80@example.org",
            "http://127.0.0.1.example.org",
            "chrome-extension://abc",
            "null",
            "",
        ] {
            assert_eq!(from(origin), Err(Refusal::Page(origin.into())), "{origin}");
        }
    }

    #[test]
    fn a_name_that_only_leads_to_this_machine_is_none_of_its_own() {
        for host in ["example.org", "example.org:8765", "localhost.example.org:8765", "127.0.0.1:8765:1", "127.0.0.11"]
        {
            assert_eq!(check(&request(host, "")), Err(Refusal::Name(host.into())), "{host}");
        }
        let terminal = check(&request("\u{1b}[31mred", ""));
        assert_eq!(terminal, Err(Refusal::Name("[31mred".into())), "nothing that acts on a terminal is repeated");
    }

    #[test]
    fn what_is_no_request_of_a_viewer_is_refused_with_a_reply_that_says_so() {
        for bytes in [
            &b"\xff\xfe\r\n\r\n"[..],
            b"POST / HTTP/1.1\r\nHost: localhost\r\n\r\n",
            b"GET / HTTP/1.1\r\n\r\n",
            b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
            b"GET / HTTP/1.1\r\nnonsense\r\n\r\n",
        ] {
            assert_eq!(check(bytes), Err(Refusal::NotAViewer), "{}", String::from_utf8_lossy(bytes));
        }
        let twice = request("localhost", "Origin: file://\r\nOrigin: https://example.org\r\n");
        assert_eq!(check(&twice), Err(Refusal::NotAViewer));
        assert!(Refusal::Full.reply().starts_with("HTTP/1.1 503 ") && Refusal::Full.reply().contains("close one"));
        assert!(Refusal::Page("https://example.org".into()).reply().starts_with("HTTP/1.1 403 "));
    }
}
