//! The pictures of the documents, by the programs as they were built before:
//!
//! `cargo build --release --workspace && cargo run --release --workspace --example pictures -- docs/pictures`
//!
//! A session with a payload in it that its cell.toml does not know is made and diagnosed; the figures of its page, and robot and twin at
//! the moment at which they are furthest apart, are written as pictures of their own. Beside them, of the simulated cell: a clip as
//! `check` shows it, the stroke that is recorded next, the robot's outline in a picture of the camera, a task, and policies compared.

use anyhow::{Context as _, ensure};
use calibration::demo::example::Order;
use calibration::diagnose::{Options, diagnose};
use calibration::report::diagnosis::page;
use inference::interrupt::Interrupt;
use shared_mem::recording::Session;
use shared_mem::{input, output};
use std::path::{Path, PathBuf};
use std::process::Command;
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
    for (shows, name) in FIGURES {
        write(&folder.join(name).with_extension("svg"), figure(&html, shows)?)?;
    }
    let (clip, prediction, _) = Replayer::new(&session.cell, None)?.replay(session.read(&session.clips[0])?)?;
    let film = Film::of("clip_00.mcap", &clip, &prediction).context("a clip of the arm")?;
    let (stage, widest) = (Stage::of(&session.cell)?, film.widest());
    let twin = stage.picture(&stage.film(film), widest, TIMES, SIZE).context("the arm's shape")?;
    write(&folder.join("twin.png"), twin)?;
    for Drawn { by, file, shows, name } in &DRAWN {
        for line in *by {
            run(line, made.path())?;
        }
        let drawn = made.path().join(file);
        let file = input::bytes(&drawn, input::Kind::Picture)?;
        let content = match shows {
            Some(shows) => figure(&String::from_utf8(file)?, shows)?.into_bytes(),
            None => file,
        };
        write(&folder.join(name), content)?;
    }
    Ok(())
}

/// A picture that programs draw.
struct Drawn {
    /// Command lines, one after the other, in a folder that holds `session`.
    by: &'static [&'static str],
    /// The file with the picture.
    file: &'static str,
    /// What its figure shows, where the file is a page.
    shows: Option<&'static str>,
    name: &'static str,
}

const DRAWN: [Drawn; 5] = [
    Drawn {
        by: &["calibration check session --report check.html"],
        file: "check.html",
        shows: Some("clip_00.mcap, joint 4 `fr3_joint4`"),
        name: "check.svg",
    },
    Drawn {
        by: &[
            "calibration capture control-hit-slide --cell fr3 --arm sim --clips 8 --out strokes --preview stroke.svg",
        ],
        file: "stroke.svg",
        shows: None,
        name: "stroke.svg",
    },
    Drawn {
        by: &[
            "calibration capture excitation --cell fr3 --arm sim --clips 1 --out seen",
            "calibration viewpoint seen --color --picture outline.png",
        ],
        file: "outline.png",
        shows: None,
        name: "outline.png",
    },
    Drawn {
        by: &[
            "twin task pick_carrot --record carrot",
            "calibration export-episodes pick_carrot carrot --to png --every 20 --out carrot_pictures",
        ],
        file: "carrot_pictures/episode_000000/front_color_00014.png",
        shows: None,
        name: "task.png",
    },
    Drawn {
        by: &[
            "calibration evaluate --policies expert shaky=expert:noise=0.02 --tasks push_milk --worlds twin --episodes 20 --out evaluation",
        ],
        file: "evaluation/report.html",
        shows: Some("parameters with intervals"),
        name: "policies.svg",
    },
];

/// Runs a command line of a program that stands where this one was built.
fn run(line: &str, folder: &Path) -> anyhow::Result<()> {
    let own = std::env::current_exe()?;
    let built = own.parent().and_then(Path::parent).context("a program without a folder")?;
    let mut words = line.split(' ');
    let program = built.join(words.next().unwrap_or_default());
    let ended = Command::new(&program).args(words).current_dir(folder).output();
    let ended = ended.with_context(|| format!("cannot start {}; build it first", program.display()))?;
    ensure!(ended.status.success(), "`{line}`: {}", String::from_utf8_lossy(&ended.stderr));
    Ok(())
}

fn write(file: &Path, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    output::write(file, content)?;
    eprintln!("{}", file.display());
    Ok(())
}

/// The figure of a page that says that it shows this, as a file of its own.
fn figure(html: &str, shows: &str) -> anyhow::Result<String> {
    let style = style(html).context("a page without a style")?;
    let label = format!("aria-label=\"{shows}\"");
    let figure = figures(html).find(|figure| figure.contains(&label)).with_context(|| format!("no {shows}"))?;
    Ok(alone(figure, &style))
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
