//! The verb `example`: a session to try things on. Clips of a simulated FR3, or strokes at a box, in which an effect acts that its
//! cell.toml does not know, made within seconds and without any process beside this one.

use super::hidden;
use serde::Serialize;
use shared_mem::cell::{Cell, CellError, ClipEntry};
use shared_mem::output::OutputError;
use shared_mem::recording::{ExportError, WriteError, session_folder, write_clip};
use shared_mem::theta::{EffectTheta, Theta};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use twin::arm::ModelError;
use twin::description::shown_robot;
use worlds::session::{SessionError, record};
use worlds::world::{Fault, Kind, World};

/// Clips of the arm alone, and strokes: as many as a diagnosis splits well.
const EXCITATIONS: usize = 8;
const STROKES: usize = 16;
const CELL_TOML: &str = "cell.toml";
const PROGRAM: &str = concat!("twinalign ", env!("CARGO_PKG_VERSION"), ", example");

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Order {
    /// The new session.
    pub out: PathBuf,
    /// Whether a session that is there already is replaced.
    pub force: bool,
    /// Strokes at an object instead of the arm alone.
    pub strokes: bool,
    /// Draws what is hidden, and the motions.
    pub seed: u64,
}

/// The session that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Written {
    pub session: PathBuf,
    /// Files of its clips.
    pub clips: Vec<PathBuf>,
}

/// No session was written.
#[derive(Debug, thiserror::Error)]
pub enum ExampleError {
    #[error(transparent)]
    Cell(#[from] CellError),
    #[error(transparent)]
    Robot(#[from] ModelError),
    #[error(transparent)]
    Session(#[from] SessionError),
    #[error(transparent)]
    Clip(#[from] WriteError),
    #[error(transparent)]
    Folder(#[from] ExportError),
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl Order {
    fn world(&self) -> Result<World, CellError> {
        let cell = Cell::read(Path::new("fr3"))?;
        let kind = if self.strokes { Kind::Strokes } else { Kind::Excitation };
        let world = World::draw(self.seed, kind, Fault::Nothing, &cell);
        let effects = vec![if self.strokes { hidden::effect_of_strokes(self.seed) } else { hidden::effect(self.seed) }];
        Ok(World { hidden: Theta { effects, ..world.hidden.clone() }, ..world })
    }

    /// The effect that acts in the session and is not in its cell.toml.
    ///
    /// # Errors
    /// [`CellError`], where a file of the built-in cell's name is no cell.
    pub fn hidden(&self) -> Result<Vec<EffectTheta>, CellError> {
        Ok(self.world()?.hidden.effects)
    }

    /// Writes the session; it is there when all of it is.
    ///
    /// # Errors
    /// [`ExampleError`]; nothing is there then, and what was there before is unchanged.
    pub fn write(&self) -> Result<Written, ExampleError> {
        let world = self.world()?;
        let folder = session_folder(&self.out, self.force, &[])?;
        let count = if self.strokes { STROKES } else { EXCITATIONS };
        let robot = shown_robot(&world.cell)?.map(Arc::new);
        let mut cell = world.cell.at_home_anywhere();
        cell.clips.clear();
        for (number, clip) in record(&world, count)?.into_iter().enumerate() {
            let file = PathBuf::from(format!("clip_{number:02}.mcap"));
            write_clip(&clip, (&cell, robot.as_ref()), PROGRAM, folder.file(&file)?)?;
            cell.clips.push(ClipEntry { file, kind: clip.kind });
        }
        folder.write(Path::new(CELL_TOML), cell.to_toml().as_bytes())?;
        folder.finish(CELL_TOML)?;
        Ok(Written { session: self.out.clone(), clips: cell.clips.into_iter().map(|clip| clip.file).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::recording::{Session, read_clip};

    #[test]
    fn an_example_is_a_session_with_something_in_it_that_its_cell_does_not_know() {
        let folder = tempfile::tempdir().expect("a folder");
        for (strokes, count) in [(false, EXCITATIONS), (true, STROKES)] {
            let out = folder.path().join(if strokes { "strokes" } else { "arm" });
            let order = Order { out: out.clone(), force: false, strokes, seed: 1 };
            assert_eq!(order.write().expect("a session").clips.len(), count);
            let session = Session::open(&out).expect("a session");
            assert_eq!(session.clips.len(), count);
            let entry = &session.clips[0];
            let clip = read_clip(&out.join(&entry.file), entry.kind, &session.cell).expect("a clip");
            assert!(clip.warnings.is_empty() && clip.desired.len() > 1000, "{:?}", clip.warnings);
            assert_eq!(clip.object.is_empty(), !strokes);
            assert_eq!(order.hidden().expect("the built-in cell").len(), 1);
            assert!(order.write().is_err(), "what is there is kept");
            assert!(Order { force: true, ..order }.write().is_ok());
        }
    }
}
