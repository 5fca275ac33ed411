//! What there is when the work is interrupted: a file beside the outputs, out of which the same command goes on as if nothing had been.
//! It belongs to one scan and one build: of another, it is not taken.

use super::adam::Adam;
use super::band::Band;
use super::extent::Bounds;
use super::learn::State;
use super::pictures::Pictures;
use super::pool::Pixel;
use crate::field::{Field, Grid};
use nalgebra::Point3;
use shared_mem::checksum::{with_checksum, without_checksum};
use shared_mem::console;
use shared_mem::input::{self, InputError, Kind};
use shared_mem::output::{self, OutputError};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often it is written.
const PAUSE: Duration = Duration::from_secs(45);
/// First bytes of the file.
const MAGIC: &[u8; 8] = b"TWINOBJ3";

/// What was kept cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// It cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// It cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// It cannot be removed.
    #[error("cannot remove {}: {source}; remove it by hand", path.display())]
    Remove {
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// Where the training of the splats is kept: beside the file of the rest.
fn of_splats(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".splats");
    name.into()
}

/// Keeps the state of one scan's work.
pub(super) struct Keeper<'a> {
    path: &'a Path,
    question: u64,
    last: Instant,
}

impl<'a> Keeper<'a> {
    pub(super) fn new(path: &'a Path, edge: u32, bounds: &Bounds, (pictures, pixels): (&Pictures, &[Pixel])) -> Self {
        let mut hasher = DefaultHasher::new();
        env!("CARGO_PKG_VERSION").hash(&mut hasher);
        edge.hash(&mut hasher);
        format!("{bounds:?}").hash(&mut hasher);
        for frame in &pictures.train {
            frame.name.hash(&mut hasher);
            format!("{:?}", frame.camera).hash(&mut hasher);
            frame.rgb.hash(&mut hasher);
            frame.mask.hash(&mut hasher);
            frame.depth.iter().for_each(|z| z.to_bits().hash(&mut hasher));
            let (place, turn) = (frame.scan_from_camera.translation.vector, frame.scan_from_camera.rotation.coords);
            place.iter().chain(turn.iter()).for_each(|v| v.to_bits().hash(&mut hasher));
        }
        pixels.len().hash(&mut hasher);
        Self { path, question: hasher.finish(), last: Instant::now() }
    }

    /// What an earlier run has kept of the same question.
    pub(super) fn take(&self) -> Result<Option<State>, StateError> {
        if !self.path.is_file() {
            return Ok(None);
        }
        let bytes = input::bytes(self.path, Kind::Array)?;
        let content = without_checksum(&bytes);
        if content.is_none() && bytes.starts_with(MAGIC) {
            let file = self.path.display();
            console::line(format_args!("{file} is damaged: its checksum is another one; the work starts anew"));
        }
        Ok(content.and_then(|content| parse(content, self.question)))
    }

    pub(super) fn keep(&mut self, state: &State) -> Result<(), StateError> {
        self.last = Instant::now();
        Ok(output::write(self.path, with_checksum(bytes(state, self.question)))?)
    }

    /// Where the training of the splats is kept.
    pub(super) fn splats(&self) -> PathBuf {
        of_splats(self.path)
    }

    /// Splats of another question are forgotten: they begin once the field is done.
    pub(super) fn forget_splats(&self) -> Result<(), StateError> {
        removed(&of_splats(self.path))
    }

    pub(super) fn keep_now_and_then(&mut self, state: &State) -> Result<(), StateError> {
        if self.last.elapsed() < PAUSE { Ok(()) } else { self.keep(state) }
    }
}

pub(super) fn forget(path: &Path) -> Result<(), StateError> {
    removed(&of_splats(path))?;
    removed(path)
}

fn removed(path: &Path) -> Result<(), StateError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(StateError::Remove { path: path.to_owned(), source })
        }
        _ => Ok(()),
    }
}

fn bytes(state: &State, question: u64) -> Vec<u8> {
    let grid = &state.field.grid;
    let mut out = MAGIC.to_vec();
    let counts = [question, state.level as u64, u64::from(state.step), state.corrections.len() as u64];
    counts.iter().chain(&grid.dims.map(|n| n as u64)).for_each(|n| out.extend(n.to_le_bytes()));
    let frame = [grid.origin.x, grid.origin.y, grid.origin.z, grid.voxel];
    let moments = state.moments.iter().flat_map(|(first, second)| first.iter().chain(second));
    let poses = state.corrections.iter().flatten().chain(moments);
    frame.iter().chain(poses).for_each(|v| out.extend(v.to_le_bytes()));
    let field = state.field.distance.iter().chain(state.field.colour.iter().flatten());
    let moments = state.adam.first.iter().flatten().chain(state.adam.second.iter().flatten());
    field.chain(moments).for_each(|v| out.extend(v.to_le_bytes()));
    out.extend(state.band.iter().flat_map(|band| band.active()).map(|active| u8::from(*active)));
    out
}

/// `None` where it is of another question or cut short.
fn parse(bytes: &[u8], question: u64) -> Option<State> {
    let mut rest = bytes.strip_prefix(MAGIC)?;
    let mut word = || -> Option<[u8; 8]> {
        let (first, after) = rest.split_first_chunk::<8>()?;
        rest = after;
        Some(*first)
    };
    let mut count = || word().map(u64::from_le_bytes);
    if count()? != question {
        return None;
    }
    let (level, step, cameras) = (count()? as usize, count()? as u32, count()? as usize);
    let dims = [count()? as usize, count()? as usize, count()? as usize];
    let mut number = || word().map(f64::from_le_bytes);
    let origin = Point3::new(number()?, number()?, number()?);
    let grid = Grid { dims, origin, voxel: number()? };
    let mut six = || -> Option<[f64; 6]> {
        let mut out = [0.0; 6];
        for value in &mut out {
            *value = number()?;
        }
        Some(out)
    };
    let corrections = (0..cameras).map(|_| six()).collect::<Option<Vec<_>>>()?;
    let moments = (0..cameras).map(|_| Some((six()?, six()?))).collect::<Option<Vec<_>>>()?;
    let nodes = grid.len();
    let (rest, band) = rest.split_at_checked(nodes.checked_mul(48)?)?;
    let active = band.iter().map(|active| *active != 0).collect();
    let band = if band.is_empty() { None } else { Some(Band::of(&grid, active)?) };
    let floats: Vec<f32> = rest.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let (distance, floats) = floats.split_at(nodes);
    let (colour, floats) = floats.split_at(3 * nodes);
    let (first, second) = floats.split_at(4 * nodes);
    let colour = colour.as_chunks::<3>().0.to_vec();
    let adam = Adam { first: first.as_chunks::<4>().0.to_vec(), second: second.as_chunks::<4>().0.to_vec() };
    let field = Field { grid, distance: distance.to_vec(), colour };
    Some(State { level, step, field, band, adam, corrections, moments })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_comes_back_for_its_own_question_alone() {
        let grid = Grid { dims: [3, 4, 5], origin: Point3::new(0.1, 0.2, 0.3), voxel: 0.01 };
        let mut state = State::new(grid, (0..60).map(|i| i as f32).collect(), 2);
        (state.level, state.step, state.corrections[1][4]) = (1, 77, 0.5);
        state.adam.second[59] = [1.0, 2.0, 3.0, 4.0];
        state.band = Some(Band::new(&grid, &state.field.distance, 20.0));
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.state");
        let mut keeper = Keeper { path: &path, question: 9, last: Instant::now() };
        keeper.keep(&state).expect("room");
        assert_eq!(keeper.take().expect("a file").as_ref(), Some(&state));
        let mut damaged = std::fs::read(&path).expect("a file");
        damaged[200] ^= 1;
        std::fs::write(&path, damaged).expect("a file");
        assert!(keeper.take().expect("a file").is_none());
        let whole = bytes(&state, 9);
        assert_eq!(parse(&whole, 9).as_ref(), Some(&state));
        assert!(parse(&whole, 8).is_none());
        assert!((0..whole.len() - 4).step_by(97).all(|length| parse(&whole[..length], 9).is_none()));
    }
}
