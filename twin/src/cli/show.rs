//! `twin show`: recorded clips beside the twin on one time line, at a page in a browser.

use super::host_name;
use crate::replay::{ReplayError, Replayer};
use crate::show::{Film, serve};
use crate::web::Address;
use anyhow::{Context as _, bail};
use rayon::prelude::*;
use shared_mem::progress::Progress;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;
use shared_mem::{answer, console, ending, parent};
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Shows recorded clips beside the twin at a page in a browser: robot, twin and gap on one time line.
#[derive(clap::Args)]
#[command(after_help = "\
The recorded commands are simulated, as by `twin replay`. The page plays the robot as it was measured and over it, in blue, the twin;
their difference is drawn as it is, or 10 or 100 times as large. Below runs the gap of every joint, or of an object alone.
Ctrl-C ends it.

Examples:
  twin show session
  twin show session/clip_00.mcap --parameters theta.toml
  twin show session --bind 0.0.0.0 --port 8400 --name bench.lab.example

JSON, at the end: shown [file], left_out [{file, error}].")]
pub struct Show {
    /// Session folder (with cell.toml), or one clip
    #[arg(value_name = "SESSION|CLIP")]
    path: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips]
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// Identified parameters; what they do not name keeps the value of cell.toml
    #[arg(long, value_name = "THETA.TOML")]
    parameters: Option<PathBuf>,
    /// Of several objects in cell.toml the one that is simulated [default: the one that moves]
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Address of this machine on which the page is; others than the loopback's let every machine that reaches it look
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// A name by which other machines open the page, beside this machine's own and its addresses; again for others
    #[arg(long = "name", value_name = "NAME", value_parser = host_name)]
    names: Vec<String>,
    /// Port of the page; 0: any that is free
    #[arg(long, value_name = "PORT", default_value_t = 8390)]
    port: u16,
    /// End when this process is no longer our parent
    #[arg(long, hide = true)]
    parent: Option<u32>,
    /// Prints one JSON object on stdout at the end
    #[arg(long)]
    json: bool,
}

impl Show {
    pub(crate) fn run(self) -> anyhow::Result<()> {
        let stop = Arc::new(AtomicBool::new(false));
        let end = {
            let stop = Arc::clone(&stop);
            move || {
                ending::ask();
                stop.store(true, Ordering::Relaxed);
            }
        };
        if let Some(parent) = self.parent {
            parent::when_gone(parent, end.clone())?;
        }
        ctrlc::set_handler(end).context("cannot listen for Ctrl-C")?;
        let mut session = Session::open_with(&self.path, self.cell.as_deref())?;
        if let Some(subject) = session.about(self.object.as_deref())? {
            console::line(subject);
        }
        let theta = self.parameters.as_deref().map(Theta::read).transpose()?.map(|theta| theta.about(&session.cell));
        let (films, left_out) = films(&session, &Replayer::new(&session.cell, theta.as_ref())?);
        if ending::asked() {
            bail!("interrupted; start again");
        }
        for (file, error) in &left_out {
            console::line(format_args!("{file}: {error}"));
        }
        if films.is_empty() {
            bail!("none of the {} clips can be shown; the reasons stand above", left_out.len());
        }
        let (shown, films): (Vec<String>, Vec<Film>) = films.into_iter().unzip();
        let address = Address { ip: self.bind, port: self.port, names: self.names };
        let title = self.path.display().to_string();
        serve(&session.cell, &title, films, &address, &stop, |at| {
            console::line(format_args!("open http://{at}/ in a browser; Ctrl-C ends"));
        })?;
        if self.json {
            let left_out: Vec<_> =
                left_out.iter().map(|(file, error)| serde_json::json!({ "file": file, "error": error })).collect();
            answer::json(&serde_json::json!({ "shown": shown, "left_out": left_out }))?;
        } else {
            answer::words(format!("{} clips were shown", shown.len()))?;
        }
        Ok(())
    }
}

/// A file, and what became of it.
type Of<T> = (String, T);

/// The films of a session's clips, and the clips of which there is none, each with the reason.
fn films(session: &Session, replayer: &Replayer) -> (Vec<Of<Film>>, Vec<Of<String>>) {
    let (bar, done) = (Progress::new("show", session.clips.len() as u64), AtomicU64::new(0));
    let one = |file: &str, clip: Result<_, ReplayError>| {
        let (clip, prediction, _) = replayer.replay(clip?)?;
        Ok::<_, ReplayError>(Film::of(file, &clip, &prediction))
    };
    let all: Vec<Of<Result<Option<Film>, String>>> = session
        .clips
        .par_iter()
        .filter(|_| !ending::asked())
        .map(|entry| {
            let file = entry.file.to_string_lossy().into_owned();
            let film = one(&file, session.read(entry).map_err(ReplayError::from)).map_err(|error| error.to_string());
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            bar.show(done, &format!("{done} of {} clips", session.clips.len()));
            (file, film)
        })
        .collect();
    let (mut films, mut left_out) = (Vec::new(), Vec::new());
    for (file, film) in all {
        match film {
            Ok(Some(film)) => films.push((file, film)),
            Ok(None) => left_out.push((file, "nothing of it is simulated".to_owned())),
            Err(error) => left_out.push((file, error)),
        }
    }
    (films, left_out)
}
