//! The page, the numbers of its films, and a picture of each moment that it asks for.

use super::film::{Film, Numbers};
use super::stage::{Stage, Staged};
use crate::arm::ModelError;
use crate::web::{Address, OneAtATime, Site, WebError};
use axum::Router;
use axum::extract::{RawQuery, State};
use axum::http::{StatusCode, header};
use axum::response::{Html, IntoResponse as _, Response};
use axum::routing::get;
use serde::Serialize;
use shared_mem::cell::Cell;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The page. Nothing else is fetched.
const PAGE: &str = include_str!("page.html");
/// Least and largest width of a picture [pixel]; it is three quarters as high.
const WIDTHS: [f64; 2] = [160.0, 1200.0];
/// Largest multiple of the difference that is drawn.
const MOST_TIMES: f64 = 1000.0;

/// Nothing can be shown.
#[derive(Debug, thiserror::Error)]
pub enum ShowError {
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Web(#[from] WebError),
}

/// What every answer is made of.
struct Shown {
    films: Vec<Staged>,
    stage: Stage,
    /// The films' numbers, as JSON.
    numbers: String,
    /// However many are asked for: a large picture takes some ten megabytes and milliseconds.
    drawing: OneAtATime,
}

/// What a page is told first.
#[derive(Serialize)]
struct Told<'a> {
    title: &'a str,
    /// Whether robot or object can be drawn.
    drawn: bool,
    films: Vec<Numbers<'a>>,
}

/// Shows films of a cell at a page until `stop`; `ready` is given its address.
///
/// # Errors
/// [`ShowError`] when it cannot begin. What happens to single pages ends nothing.
pub fn serve(
    cell: &Cell,
    title: &str,
    films: Vec<Film>,
    address: &Address,
    stop: &AtomicBool,
    ready: impl FnOnce(SocketAddr),
) -> Result<(), ShowError> {
    let stage = Stage::of(cell)?;
    let films: Vec<Staged> = films.into_iter().map(|film| stage.film(film)).collect();
    let drawn = films.iter().any(|staged| staged.framing.is_some());
    let told = Told { title, drawn, films: films.iter().map(|staged| staged.film.numbers()).collect() };
    let numbers = serde_json::to_string(&told).expect("numbers have a JSON form");
    let shown = Arc::new(Shown { films, stage, numbers, drawing: OneAtATime::new() });
    let routes = Router::new()
        .route("/", get(|| async { Html(PAGE) }))
        .route("/films.json", get(numbers_of))
        .route("/picture.png", get(picture))
        .with_state(shown);
    Ok(Site::open(address)?.serve(routes, stop, ready)?)
}

async fn numbers_of(State(shown): State<Arc<Shown>>) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], shown.numbers.clone()).into_response()
}

async fn picture(State(shown): State<Arc<Shown>>, RawQuery(query): RawQuery) -> Response {
    let asked = query.unwrap_or_default();
    let number =
        |name: &str| asked.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('=')?.parse::<f64>().ok());
    let place = |name: &str| number(name).filter(|value| (0.0..1e9).contains(value)).map(|value| value as usize);
    let width = number("width").filter(|width| width.is_finite()).unwrap_or(640.0).clamp(WIDTHS[0], WIDTHS[1]);
    let times = number("times").filter(|times| times.is_finite()).unwrap_or(1.0).clamp(0.0, MOST_TIMES);
    let size = [width as usize, (0.75 * width) as usize];
    let moment = place("film").zip(place("at"));
    let drawing = shown.drawing.clone();
    let drawn = drawing.run(move || {
        let (film, at) = moment?;
        shown.stage.picture(shown.films.get(film)?, at, times, size)
    });
    match drawn.await.flatten() {
        Some(png) => ([(header::CONTENT_TYPE, "image/png")], png).into_response(),
        None => (StatusCode::NOT_FOUND, "no such moment: /films.json lists them").into_response(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::film::tests::film;
    use super::*;
    use crate::shipped::shipped;
    use std::io::{Read as _, Write as _};
    use std::net::TcpStream;
    use std::sync::atomic::Ordering;
    use std::sync::mpsc::channel;

    /// Status line and body of a request.
    fn asked(at: SocketAddr, path: &str, host: &str) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(at).expect("it listens");
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").expect("a request");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head");
        let head = String::from_utf8_lossy(&answer[..end]).lines().next().unwrap_or_default().to_owned();
        (head, answer[end + 4..].to_vec())
    }

    #[test]
    fn the_page_its_numbers_and_its_pictures_are_there_and_nothing_else_is() {
        let stop = Arc::new(AtomicBool::new(false));
        let (said, heard) = channel();
        let stopping = Arc::clone(&stop);
        let served = std::thread::spawn(move || {
            let address = Address { ip: [127, 0, 0, 1].into(), port: 0, names: Vec::new() };
            serve(&shipped(), "monday", vec![film()], &address, &stopping, |at| said.send(at).expect("it is heard"))
        });
        let at = heard.recv().expect("an address");
        let own = at.to_string();
        let (head, page) = asked(at, "/", &own);
        assert!(head.contains("200") && String::from_utf8_lossy(&page).contains("films.json"), "{head}");
        let (_, numbers) = asked(at, "/films.json", &own);
        let numbers: serde_json::Value = serde_json::from_slice(&numbers).expect("JSON");
        assert_eq!(
            (&numbers["title"], numbers["films"][0]["times"].as_array().map(Vec::len)),
            (&"monday".into(), Some(100))
        );
        let (head, png) = asked(at, "/picture.png?film=0&at=25&times=50&width=200", &own);
        assert!(head.contains("200") && png.starts_with(b"\x89PNG"), "{head}");
        for path in [
            "/picture.png",
            "/picture.png?film=1&at=0",
            "/picture.png?film=0&at=100",
            "/picture.png?film=-1&at=nan",
            "/picture.png?film=0&at=1e300&width=1e300",
            "/other",
        ] {
            assert!(asked(at, path, &own).0.contains("404"), "{path}");
        }
        assert!(asked(at, "/", "example.org").0.contains("403"));
        stop.store(true, Ordering::Relaxed);
        served.join().expect("no panic").expect("it was served");
    }
}
