//! `twin render`: real, twin and difference side by side, as PNG files and, where ffmpeg is there, as a film.

use super::look::Look;
use crate::render::session::{ViewError, beside, pixels_of};
use anyhow::{Context as _, bail, ensure};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::object::ObjectName;
use shared_mem::output::Destination;
use shared_mem::progress::Progress;
use shared_mem::recording::{ObjectSeries, PictureKind, Session, for_pictures, write_png};
use shared_mem::{answer, console};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Draws the twin beside every recorded picture: what the camera saw, what the twin shows, where they differ.
#[derive(clap::Args)]
#[command(after_help = "\
The robot is drawn at the joints measured when the picture was taken, from its meshes or from splats of its links; objects
where they were seen. A graphics card draws where the program was built with `--features render` and finds one by Vulkan, else the
processor; both draw the same picture.

Examples:
  twin render session --out frames
  twin render session/clip_00.mcap --every 10 --splats fr3_splats --film --out frames
  twin render session --device gpu --out frames")]
pub struct Render {
    /// Session folder (with cell.toml), or one clip.
    #[arg(value_name = "SESSION|CLIP")]
    path: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// Folder for the frames.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Replaces the frames and the film that are in the folder already.
    #[arg(long)]
    force: bool,
    /// Draws every so many pictures only.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    #[command(flatten)]
    look: Look,
    /// Also joins the frames to `film.mp4`, if ffmpeg is installed.
    #[arg(long)]
    film: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

/// Where an object was seen when a picture was taken.
fn seen_at(series: &ObjectSeries, stamp_ns: u64) -> Option<Pose<Base, Object>> {
    let at = series.stamps_ns.partition_point(|stamp| *stamp < stamp_ns);
    series.poses.get(at.min(series.len().saturating_sub(1))).copied()
}

impl Render {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        super::discard_on_signal()?;
        self.refuse_old_frames()?;
        let session = Session::open_with(&self.path, self.cell.as_deref())?;
        let mut view = self.look.view(&session.cell)?;
        let film_file = self.look_at_the_folder()?;
        let camera = session.cell.camera.as_ref().context("cell.toml has no `[camera]`")?;
        let latency_ns = (camera.latency * 1e9) as u64;
        let (mut frames, mut skipped, mut number) = (0u32, 0u32, 0u32);
        let mut apart = 0.0;
        let bar = Progress::new("render", session.clips.len() as u64);
        for (done, entry) in session.clips.iter().enumerate() {
            bar.show(done as u64, &format!("{frames} frames"));
            let clip = session.read(entry)?;
            for_pictures(&session.folder.join(&entry.file), PictureKind::Color, |stamp_ns, picture| {
                number += 1;
                if (number - 1) % self.every != 0 {
                    return anyhow::Ok(());
                }
                let Some((q, _)) = clip.measured.at(stamp_ns.saturating_sub(latency_ns)) else {
                    skipped += 1;
                    return Ok(());
                };
                let (of_pictures, real) = pixels_of(picture).map_err(anyhow::Error::msg)?;
                ensure!(of_pictures == view.size(), ViewError::Size { of_pictures, of_camera: view.size() });
                let first = session.cell.object_name().unwrap_or("");
                let series = |name: &str| match name == first {
                    true => Some(&clip.object),
                    false => clip.others.iter().find(|other| other.name == name).map(|other| &other.series),
                };
                let seen = |name: &ObjectName| seen_at(series(name.text())?, stamp_ns);
                let objects: Vec<_> = view.names().iter().map(seen).collect();
                let twin = view.draw_all(&q, &objects)?;
                let sum: u64 = real.iter().zip(&twin).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
                apart += sum as f64 / (255.0 * real.len() as f64);
                let (width, height, rgb) = beside(of_pictures, &real, &twin);
                write_png(&frame_file(&self.out, frames), width, height, &rgb)?;
                frames += 1;
                Ok(())
            })?;
        }
        drop(bar);
        if frames == 0 {
            bail!("no clip holds colour pictures with joints at their time; record with `rt_bridge run --camera`");
        }
        let difference = apart / f64::from(frames);
        // Those of a longer film before would be taken for this one's.
        for frame in frames_in(&self.out).iter().filter(|frame| **frame >= frame_file(&self.out, frames)) {
            std::fs::remove_file(frame).with_context(|| format!("cannot replace {}", frame.display()))?;
        }
        let rate = camera.rate / f64::from(self.every);
        let film = film_file.map(|file| film(&self.out, &file, rate)).transpose()?.flatten();
        let words = format!(
            "{frames} frames in {}, drawn by {}{}; mean difference {:.1} %",
            self.out.display(),
            view.painter().name(),
            if skipped > 0 { format!(" ({skipped} pictures without joints left out)") } else { String::new() },
            difference * 100.0
        );
        if self.film && film.is_none() {
            console::line("note: ffmpeg is not installed, so there is no film");
        }
        if self.json {
            let answer = serde_json::json!({
                "frames": frames, "without_joints": skipped, "difference": difference, "film": film,
                "drawn_by": view.painter().name(),
            });
            answer::json(&answer)?;
        } else {
            answer::words(words)?;
        }
        Ok(())
    }
}

impl Render {
    /// Frames of another film would stand behind the new ones.
    fn refuse_old_frames(&self) -> anyhow::Result<()> {
        if let (Some(frame), false) = (frames_in(&self.out).first(), self.force) {
            Destination::new(frame, false)?;
        }
        Ok(())
    }

    /// Whether frames can go to the folder; where the film goes, if one is wanted.
    fn look_at_the_folder(&self) -> anyhow::Result<Option<Destination>> {
        let film = self.film.then(|| Destination::in_new_folder(&self.out.join(FILM), self.force)).transpose()?;
        std::fs::create_dir_all(&self.out)
            .with_context(|| format!("{}; give --out a place that can be written", self.out.display()))?;
        Destination::new(&frame_file(&self.out, 0), self.force)?;
        Ok(film)
    }
}

/// The film's name in the folder.
const FILM: &str = "film.mp4";

fn frame_file(folder: &Path, number: u32) -> PathBuf {
    folder.join(format!("frame_{number:05}.png"))
}

/// Frames that are in a folder, in their order.
fn frames_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_frame = |path: &PathBuf| {
        let number = path.file_name().and_then(|name| name.to_str()?.strip_prefix("frame_")?.strip_suffix(".png"));
        number.is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
    };
    let mut frames: Vec<PathBuf> = entries.filter(is_frame).collect();
    frames.sort();
    frames
}

/// The frames as a film; `None` where there is no ffmpeg.
fn film(folder: &Path, place: &Destination, rate: f64) -> anyhow::Result<Option<PathBuf>> {
    let unfinished = place.begin()?;
    let rate = rate.to_string();
    let mut command = Command::new("ffmpeg");
    command.args(["-y", "-loglevel", "error", "-framerate", &rate, "-i"]).arg(folder.join("frame_%05d.png"));
    // The usual encoding needs an even number of rows and columns.
    command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-f", "mp4"]);
    command.arg(unfinished.unfinished_path());
    // Its complaints are read here: written past the console, they could wait for a reader for ever.
    match command.stdin(Stdio::null()).output() {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).context("ffmpeg cannot be started"),
        Ok(ended) if ended.status.success() => {
            unfinished.finish()?;
            Ok(Some(place.path().to_owned()))
        }
        Ok(ended) => {
            let complaints = String::from_utf8_lossy(&ended.stderr);
            let last = complaints.trim_end().lines().last().unwrap_or("without a reason");
            bail!("ffmpeg failed ({}: {last}); the frames are there", ended.status)
        }
    }
}
