//! Recorded episodes of a task as data to learn from: what was seen and what was commanded, at a lower rate, with pictures that are
//! drawn now. Episodes that were no success are left out.

use import::{DataSetError, DataSetPlan, DataSetWriter, Feature, FeatureKind, Frames};
use serde::Serialize;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::output::{OutputError, OutputFolder};
use shared_mem::recording::{EpisodeMoment, ReadError, pack_picture, read_episode};
use std::path::{Path, PathBuf};
use twin::task::{Numbers, ROWS_A_SECOND, Signs, Task, TaskView};

/// Features by LeRobot's names.
const STATE: &str = "observation.state";
const SURROUNDINGS: &str = "observation.environment_state";
const ACTION: &str = "action";
const PICTURES: &str = "observation.images.";

/// What episodes become.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A LeRobot data set.
    LeRobot,
    /// The pictures alone, a folder for each episode.
    Png,
}

/// What is to be done.
pub struct Order<'a> {
    /// The task that the episodes are of.
    pub task: &'a Task,
    pub clips: &'a [PathBuf],
    /// What they become.
    pub to: Target,
    /// Every so many rows of a clip become a frame.
    pub every: u32,
    /// Where they go.
    pub folder: OutputFolder,
}

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Exported {
    pub episodes: usize,
    /// Frames of all of them.
    pub frames: usize,
    /// Frames a second.
    pub rate: u32,
    /// What each frame holds.
    pub features: Vec<String>,
    /// Clips of episodes that were no success.
    pub left_out: Vec<PathBuf>,
}

/// Episodes cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A clip cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The disk refuses.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The data set cannot be written.
    #[error(transparent)]
    DataSet(#[from] DataSetError),
    /// A clip does not go with the task.
    #[error("{}: {what}", file.display())]
    Clip {
        file: PathBuf,
        /// What is wrong and what to do.
        what: String,
    },
    /// There is nothing to be written.
    #[error("{0}")]
    Nothing(&'static str),
}

/// Writes episodes; `after_each` is called after each clip.
///
/// # Errors
/// [`ExportError`]; nothing is there then.
pub fn export(order: Order<'_>, mut after_each: impl FnMut()) -> Result<Exported, ExportError> {
    let Order { task, clips, to, every, folder } = order;
    let numbers = Numbers::of(task);
    let rate = ROWS_A_SECOND / every;
    let mut views: Vec<TaskView> = task.cameras().iter().map(|camera| task.view(camera)).collect();
    if to == Target::Png && views.is_empty() {
        return Err(ExportError::Nothing("the task has no camera; add a [[camera]] block (docs/tasks.md)"));
    }
    let features = features(task, &numbers);
    let names: Vec<String> = features.iter().map(|feature| feature.name.clone()).collect();
    let names = names.into_iter().filter(|name| to == Target::LeRobot || name.starts_with(PICTURES)).collect();
    let mut done = Exported { episodes: 0, frames: 0, rate, features: names, left_out: Vec::new() };
    let (robot, words) = ("twinalign".to_owned(), task.instruction().to_owned());
    let mut sink = match to {
        Target::LeRobot => {
            let plan = DataSetPlan { rate, robot, task: words, features };
            Sink::DataSet(Box::new(DataSetWriter::new(folder, plan)))
        }
        Target::Png => Sink::Pictures(folder),
    };
    for file in clips {
        let episode = read_episode(file)?;
        numbers.fits(&episode).map_err(|what| ExportError::Clip { file: file.clone(), what })?;
        let rows: Vec<&EpisodeMoment> = episode.moments.iter().step_by(every as usize).collect();
        if !episode.info.success {
            done.left_out.push(file.clone());
        } else if let Some((_, rows_with_next)) = rows.split_last().filter(|(_, before)| !before.is_empty()) {
            let pictures = drawn(&mut views, rows_with_next);
            match &mut sink {
                Sink::DataSet(writer) => {
                    let mut frames = frames(&numbers, &rows);
                    frames.extend(pictures.into_iter().map(Frames::Pictures));
                    writer.episode(&frames)?;
                }
                Sink::Pictures(folder) => write_pictures(folder, file, task, &pictures)?,
            }
            done.episodes += 1;
            done.frames += rows_with_next.len();
        }
        after_each();
    }
    if done.episodes == 0 {
        return Err(ExportError::Nothing(
            "no episode was a success; record others with another --seed or less --noise",
        ));
    }
    match sink {
        Sink::DataSet(writer) => writer.finish()?,
        Sink::Pictures(folder) => folder.finish("")?,
    }
    Ok(done)
}

enum Sink {
    DataSet(Box<DataSetWriter>),
    Pictures(OutputFolder),
}

/// Colour and depth of each camera, for each row.
fn drawn(views: &mut [TaskView], rows: &[&EpisodeMoment]) -> Vec<Vec<Vec<u8>>> {
    let of = |view: &mut TaskView| {
        let pictures = rows.iter().map(|row| view.draw(&row.poses, row.arm.as_ref().map(|arm| &arm.q)));
        let both = pictures.map(|picture| {
            (picture.colour, picture.depth.iter().flat_map(|depth| depth.to_le_bytes()).collect::<Vec<u8>>())
        });
        let (colour, depth): (Vec<_>, Vec<_>) = both.unzip();
        [colour, depth]
    };
    views.iter_mut().flat_map(of).collect()
}

fn write_pictures(
    folder: &OutputFolder,
    clip: &Path,
    task: &Task,
    pictures: &[Vec<Vec<u8>>],
) -> Result<(), ExportError> {
    let stem = PathBuf::from(clip.file_stem().unwrap_or_default());
    let kinds = [("color", PixelEncoding::Rgb8), ("depth", PixelEncoding::Depth16)];
    let series = task.cameras().iter().flat_map(|camera| kinds.map(|kind| (camera, kind)));
    for ((camera, (kind, encoding)), pictures) in series.zip(pictures) {
        let [width, height] = camera.size;
        for (number, pixels) in pictures.iter().enumerate() {
            let packed = pack_picture(encoding, width, height, pixels)
                .map_err(|what| ExportError::Clip { file: clip.to_owned(), what })?;
            folder.write(&stem.join(format!("{}_{kind}_{number:05}.png", camera.name)), &packed)?;
        }
    }
    Ok(())
}

/// What a frame holds, by LeRobot's names.
fn features(task: &Task, numbers: &Numbers) -> Vec<Feature> {
    let commanded = numbers.state_names();
    let all = [(STATE, commanded.clone()), (SURROUNDINGS, numbers.surroundings_names()), (ACTION, commanded)];
    let all = all.into_iter().filter(|(_, names)| !names.is_empty());
    let all = all.map(|(name, names)| Feature { name: name.into(), kind: FeatureKind::Numbers(names) });
    let pictures = task.cameras().iter().flat_map(|camera| {
        [("", PixelEncoding::Rgb8), ("_depth", PixelEncoding::Depth16)].map(|(ending, encoding)| Feature {
            name: format!("{PICTURES}{}{ending}", camera.name),
            kind: FeatureKind::Pictures(encoding, camera.size),
        })
    });
    all.chain(pictures).collect()
}

/// State, surroundings, and what is commanded for the moment of the next frame; the last row has none.
fn frames(numbers: &Numbers, rows: &[&EpisodeMoment]) -> Vec<Frames> {
    let mut signs = Signs::default();
    let (mut state, mut around, mut action) = (Vec::new(), Vec::new(), Vec::new());
    for pair in rows.windows(2) {
        state.extend(numbers.state(pair[0], &mut signs));
        around.extend(numbers.surroundings(pair[0], &mut signs));
        action.extend(numbers.action(pair[1], &signs));
    }
    let all = [state, around, action].into_iter().filter(|values| !values.is_empty());
    all.map(Frames::Numbers).collect()
}
