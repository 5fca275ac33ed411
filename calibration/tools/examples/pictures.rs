//! The pictures of the documents: `cargo run --release -p tools --example pictures -- docs/pictures`. A session with a payload in it that
//! its cell.toml does not know is made and diagnosed; the figures of its page, and robot and twin at the moment at which they are
//! furthest apart, are written as pictures of their own.

use anyhow::Context as _;
use calibration::demo::example::Order;
use calibration::diagnose::{Options, diagnose};
use calibration::report::diagnosis::page;
use inference::interrupt::Interrupt;
use shared_mem::output;
use shared_mem::recording::Session;
use std::path::PathBuf;
use twin::replay::Replayer;
use twin::show::{Film, Stage};

/// Seeds among which one is looked for that hides a payload.
const SEEDS: std::ops::Range<u64> = 1..100;
/// What figures of a page show, as they say themselves, and how their files are called.
const FIGURES: [(&str, &str); 3] = [
    ("bars before and after", "gap"),
    ("shares of the gap by stage, channel and regime", "where"),
    ("parameters with intervals", "parameters"),
];
/// By so much the difference of robot and twin is drawn larger.
const TIMES: f64 = 30.0;
/// Width and height of that picture [pixel].
const SIZE: [usize; 2] = [560, 420];

fn main() -> anyhow::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "docs/pictures".into()));
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let made = tempfile::tempdir()?;
    let mut orders = SEEDS.map(|seed| Order { out: made.path().join("session"), force: false, strokes: false, seed });
    let hides = |order: &Order| order.hidden().is_ok_and(|hidden| hidden.iter().any(|effect| effect.name == "payload"));
    let order = orders.find(hides).context("none of these seeds hides a payload")?;
    order.write()?;
    let session = Session::open(&order.out)?;
    let html = page(&diagnose(&session, &Options::default(), &Interrupt::default())?);
    let style = style(&html).context("a page without a style")?;
    for (shows, name) in FIGURES {
        let label = format!("aria-label=\"{shows}\"");
        let figure = figures(&html).find(|figure| figure.contains(&label)).with_context(|| format!("no {shows}"))?;
        let file = folder.join(format!("{name}.svg"));
        output::write(&file, alone(figure, &style))?;
        eprintln!("{}", file.display());
    }
    let (clip, prediction, _) = Replayer::new(&session.cell, None)?.replay(session.read(&session.clips[0])?)?;
    let film = Film::of("clip_00.mcap", &clip, &prediction).context("a clip of the arm")?;
    let (stage, widest) = (Stage::of(&session.cell)?, film.widest());
    let twin = stage.picture(&stage.film(film), widest, TIMES, SIZE).context("the arm's shape")?;
    let file = folder.join("twin.png");
    output::write(&file, twin)?;
    eprintln!("{}", file.display());
    Ok(())
}

/// The figures of a page.
fn figures(html: &str) -> impl Iterator<Item = &str> {
    html.match_indices("<svg").filter_map(|(at, _)| html[at..].split_inclusive("</svg>").next())
}

/// The rules of a page for figures, by day: a picture in another page does not know whether that is read by night.
fn style(html: &str) -> Option<String> {
    let all = html.split_once("<style>")?.1.split_once("</style>")?.0;
    let colours = all.split_once(":root {")?.1.split_once('}')?.0;
    let figures = all.lines().filter(|line| line.starts_with("svg "));
    let figures = figures.map(|line| line.replace("svg ", "")).collect::<Vec<_>>().join("\n");
    Some(format!(":root {{{colours}; background: #ffffff }}\n{figures}"))
}

/// A figure as a file of its own.
fn alone(figure: &str, style: &str) -> String {
    let named =
        figure.replacen("<svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"", usize::from(!figure.contains("xmlns=")));
    named.replacen('>', &format!("><style>{style}</style>"), 1)
}
