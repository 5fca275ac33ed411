//! A picture of robot and twin at one moment: the robot as it is, and the twin as a blue shade over it, their difference as large as is
//! asked for, since a milliradian is not to be seen.

use super::film::{Film, Moment};
use crate::arm::{Joints, ModelError};
use crate::render::{Framing, Hand, Look, Mesh, Raster, RobotSurface, looks, points_of};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use shared_mem::cell::Cell;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::pack_picture;

/// Behind everything, and the twin.
const PAPER: [u8; 3] = [246, 246, 244];
const TWIN: [u8; 3] = [40, 120, 200];
/// How much of the twin is seen over the robot.
const OVER: f64 = 0.4;
/// Of so many moments of a film the extent is looked at.
const LOOKED_AT: usize = 12;

/// A film, and from where each of its pictures is taken.
pub struct Staged {
    /// What is shown.
    pub film: Film,
    /// `None` where nothing of it can be drawn.
    pub(super) framing: Option<Framing>,
}

/// What is drawn of a cell.
pub struct Stage {
    robot: Option<RobotSurface>,
    object: Option<Mesh>,
}

impl Stage {
    /// Robot and object of a cell; an arm of unknown shape, or an object whose mesh cannot be used, is left out.
    ///
    /// # Errors
    /// [`ModelError`] when cell.toml describes no usable arm.
    pub fn of(cell: &Cell) -> Result<Self, ModelError> {
        let has_shape = crate::arm::ArmModel::from_cell(cell).is_ok_and(|arm| arm.has_geometry());
        let robot = if has_shape { Some(RobotSurface::new(cell, Hand::None)?) } else { None };
        let object = looks::objects(cell).ok().and_then(|all| all.into_iter().next()).map(|first| first.mesh);
        Ok(Self { robot, object })
    }

    /// A film, and from where all of it is seen.
    pub fn film(&self, film: Film) -> Staged {
        let every = film.moments().len().div_ceil(LOOKED_AT).max(1);
        let points: Vec<_> = film.moments().iter().step_by(every).flat_map(|moment| self.points(moment, 1.0)).collect();
        Staged { film, framing: (points.len() > 2).then(|| Framing::of(&points)) }
    }

    /// The picture of a moment as PNG, `times` as large a difference as there is; `None` where there is none.
    pub fn picture(&self, staged: &Staged, moment: usize, times: f64, size: [usize; 2]) -> Option<Vec<u8>> {
        let shown = staged.film.moments().get(moment)?;
        let look = staged.framing?.look(size);
        let [mut real, mut twin] = [(); 2].map(|()| look.raster(PAPER));
        if let (Some(robot), Some([q, _])) = (&self.robot, shown.joints) {
            look.draw_robot(&mut real, robot, &q, |_| None);
            look.draw_robot(&mut twin, robot, &q_of_twin(shown, times)?, |_| Some(TWIN));
        }
        if let (Some(mesh), Some([there, _])) = (&self.object, shown.object) {
            look.draw(&mut real, mesh, &there);
            look.draw(&mut twin, &Mesh { color: TWIN, ..mesh.clone() }, &object_of_twin(shown, times)?);
        }
        let pixels = over(&look, &real, &twin);
        pack_picture(PixelEncoding::Rgb8, size[0] as u32, size[1] as u32, &pixels).ok()
    }

    /// Corners of everything at a moment, base frame.
    fn points(&self, moment: &Moment, times: f64) -> Vec<Point3<f64>> {
        let mut points = Vec::new();
        if let (Some(robot), Some([q, _])) = (&self.robot, moment.joints) {
            points.extend(points_of(robot, &q));
        }
        if let (Some(mesh), Some([there, _])) = (&self.object, moment.object) {
            let poses = [Some(there), object_of_twin(moment, times)];
            let corners = |pose: Isometry3<f64>| mesh.points.iter().map(move |point| pose * point.cast::<f64>());
            points.extend(poses.into_iter().flatten().flat_map(corners));
        }
        points
    }
}

fn q_of_twin(moment: &Moment, times: f64) -> Option<Joints> {
    let [real, twin] = moment.joints?;
    Some(std::array::from_fn(|joint| real[joint] + times * (twin[joint] - real[joint])))
}

fn object_of_twin(moment: &Moment, times: f64) -> Option<Isometry3<f64>> {
    let [real, twin] = moment.object?;
    let way = times * (twin.translation.vector - real.translation.vector);
    let turn = UnitQuaternion::from_scaled_axis(times * (twin.rotation * real.rotation.inverse()).scaled_axis());
    Some(Isometry3::from_parts(Translation3::from(real.translation.vector + way), turn * real.rotation))
}

/// One picture over the other where it shows something.
fn over(look: &Look, below: &Raster, above: &Raster) -> Vec<u8> {
    let (mut pixels, shade) = (look.pixels(below), look.pixels(above));
    for (pixel, shade) in pixels.chunks_exact_mut(3).zip(shade.chunks_exact(3)) {
        if shade != PAPER {
            for (value, over) in pixel.iter_mut().zip(shade) {
                *value = ((1.0 - OVER) * f64::from(*value) + OVER * f64::from(*over)).round() as u8;
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::super::film::tests::film;
    use super::*;
    use crate::shipped::shipped;

    #[test]
    fn the_difference_is_drawn_as_large_as_is_asked_for() {
        let stage = Stage::of(&shipped()).expect("a stage");
        let film = stage.film(film());
        let pixels = |times: f64| stage.picture(&film, 25, times, [160, 160]).expect("a picture");
        assert_ne!(pixels(1.0), pixels(50.0), "3 mrad are less than a pixel, and 150 are not");
        assert_eq!(pixels(0.0), pixels(0.0));
        assert!(stage.picture(&film, 100, 1.0, [160, 160]).is_none(), "there are a hundred moments");
        let bare = Stage::of(&Cell::default()).expect("nothing to draw");
        assert!(bare.picture(&bare.film(film.film), 25, 1.0, [160, 160]).is_none());
    }
}
