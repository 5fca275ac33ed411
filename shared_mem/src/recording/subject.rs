//! Of several objects the one that a command is about: the one that was asked for, or the one that moves.

use super::error::ReadError;
use super::series::ObjectSeries;
use super::session::Session;
use super::{Clip, read_clip};
use crate::cell::{Cell, ClipKind};
use std::fmt;
use std::path::Path;

/// An object that is farther than this from where it was first [m], or turns by more [rad], was moved.
const MOVED: f64 = 0.01;
const TURNED: f64 = 0.1;

/// Which of several objects a command is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subject {
    /// Its name.
    pub name: String,
    /// Why that one.
    pub why: Why,
    /// Others that move as well, in the same recordings.
    pub also_moving: Vec<String>,
}

/// Why a command is about an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// It was asked for.
    Asked,
    /// It alone moves, in so many of so many clips.
    Moves(usize, usize),
    /// No clip shows a motion of any, and it is the first.
    First,
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "about the object `{}`", self.name)?;
        match self.why {
            Why::Asked => {}
            Why::Moves(some, all) => write!(f, ", which alone moves (in {some} of {all} clips)")?,
            Why::First => write!(f, ", the first of cell.toml: none moves")?,
        }
        if self.why != Why::Asked {
            write!(f, "; --object NAME asks for another")?;
        }
        if !self.also_moving.is_empty() {
            let names = self.also_moving.join(" and ");
            write!(f, "; {names} moves, too, and where the two touch the twin does not know of it")?;
        }
        Ok(())
    }
}

impl Session {
    /// Makes the object of this name the one that is read and judged, without a name the one that moves. `None` where there is
    /// but one, or none.
    ///
    /// # Errors
    /// [`ReadError`] where there is none of that name, or several move and none was asked for.
    pub fn about(&mut self, asked: Option<&str>) -> Result<Option<Subject>, ReadError> {
        let fail = |what: String| ReadError::kind(&self.files.session, what);
        if let Some(name) = asked {
            self.cell.about(name).map_err(fail)?;
        }
        let mut rigid = self.cell.objects.iter().filter(|object| object.urdf.is_none());
        let first_rigid = rigid.next().and_then(|object| object.name.clone());
        if self.cell.objects.len() < 2 || first_rigid.is_none() {
            return Ok(None);
        }
        let moving = self.moving()?;
        let name = match (asked, &moving.objects[..]) {
            (Some(name), _) => name.to_owned(),
            (None, [(name, _)]) => name.clone(),
            (None, []) => first_rigid.unwrap_or_default(),
            (None, several) => {
                let names: Vec<&str> = several.iter().map(|(name, _)| name.as_str()).collect();
                let what =
                    format!("{} move; say with --object {} which one is meant", names.join(" and "), names.join("|"));
                return Err(fail(what));
            }
        };
        let why = match (asked, moving.objects.first()) {
            (Some(_), _) => Why::Asked,
            (None, Some((_, some))) => Why::Moves(*some, moving.clips),
            (None, None) => Why::First,
        };
        self.cell.about(&name).map_err(|what| ReadError::kind(&self.files.session, what))?;
        let also_moving = moving.objects.into_iter().map(|(other, _)| other).filter(|other| *other != name).collect();
        Ok(Some(Subject { name, why, also_moving }))
    }

    /// Objects that move in clips in which one may, and in how many.
    fn moving(&self) -> Result<Moving, ReadError> {
        let mut cell = self.cell.clone();
        cell.in_question = 0;
        let names: Vec<String> = cell.objects.iter().filter_map(|object| object.name.clone()).collect();
        let alone = Cell { robot: None, ..cell.clone() };
        let (mut counts, mut clips) = (vec![0_usize; names.len()], 0);
        for entry in self.clips.iter().filter(|clip| clip.kind != ClipKind::Excitation) {
            clips += 1;
            let cell = if entry.kind == ClipKind::FreeMotion { &alone } else { &cell };
            for (count, moves) in counts.iter_mut().zip(moved(&self.folder.join(&entry.file), cell)?) {
                *count += usize::from(moves);
            }
        }
        let is_rigid = |name: &str| cell.objects.iter().any(|o| o.urdf.is_none() && o.name.as_deref() == Some(name));
        let objects = names.into_iter().zip(counts).filter(|(name, count)| *count > 0 && is_rigid(name)).collect();
        Ok(Moving { objects, clips })
    }
}

struct Moving {
    /// Name and number of clips of rigid objects, in the order of cell.toml.
    objects: Vec<(String, usize)>,
    clips: usize,
}

/// Whether each object of a clip moves in it, in the order of cell.toml. Which of them is not there does not matter here.
fn moved(file: &Path, cell: &Cell) -> Result<Vec<bool>, ReadError> {
    let Clip { object, others, .. } = read_clip(file, ClipKind::Excitation, cell)?;
    let all = [object].into_iter().chain(others.into_iter().map(|other| other.series));
    Ok(all.map(|series| is_moved(&series)).collect())
}

fn is_moved(series: &ObjectSeries) -> bool {
    let Some(first) = series.poses.first().map(|pose| pose.isometry()) else { return false };
    series.poses.iter().any(|pose| {
        let way = first.inverse() * pose.isometry();
        way.translation.vector.norm() > MOVED || way.rotation.angle() > TURNED
    })
}
