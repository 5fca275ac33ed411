//! One picture with the joints of its moment, ready to be fitted: from coarse to fine.

use super::grid::Grid;
use super::lens::Lens;
use super::outline::{Outliner, Place};
use super::photo::Photo;
use super::pull::Pull;
use super::shape::Shape;
use super::silhouette::Silhouette;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use shared_mem::ending;
use twin::arm::Joints;

/// What a picture shows of the robot.
#[derive(Debug, Clone)]
pub enum Evidence {
    /// Share of every pixel that the robot covers, 0 to 1.
    Mask(Grid),
    /// Red, green and blue, 0 to 255.
    Photo([Grid; 3]),
}

impl Evidence {
    /// The same with every grid changed.
    pub fn map(self, change: impl Fn(Grid) -> Grid) -> Self {
        match self {
            Self::Mask(grid) => Self::Mask(change(grid)),
            Self::Photo(channels) => Self::Photo(channels.map(change)),
        }
    }
}

/// A picture and its joints.
#[derive(Debug)]
pub struct Frame {
    /// Name in reports.
    pub name: String,
    /// Joint positions [rad].
    pub q: Joints,
    /// The parts in the base frame.
    placed: Vec<Isometry3<f64>>,
    levels: Vec<Level>,
    /// Length of the whole outline, about [m].
    whole: f64,
}

#[derive(Debug)]
struct Level {
    factor: usize,
    lens: Lens,
    size: [usize; 2],
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    Silhouette(Silhouette),
    Photo(Photo),
}

/// Widths of the levels [pixel]: pictures are shrunk until they are no wider.
const WIDTHS: [usize; 3] = [240, 480, 960];

impl Frame {
    /// Levels: from [`Frame::COARSEST`] to [`Frame::FINEST`].
    pub const COARSEST: usize = 0;
    /// The last level.
    pub const FINEST: usize = WIDTHS.len() - 1;

    /// From a picture freed of its lens's distortion.
    pub fn new(name: String, q: Joints, lens: Lens, evidence: &Evidence, shape: &Shape) -> Self {
        let level = |(number, widest): (usize, &usize)| {
            let shrunk = |grid: &Grid| grid.shrunk(grid.width.div_ceil(*widest));
            let (kind, width, height, whole) = match evidence {
                Evidence::Mask(grid) => {
                    let grid_here = shrunk(grid);
                    let size = (grid_here.width, grid_here.height);
                    (Kind::Silhouette(Silhouette::new(grid_here)), size.0, size.1, grid.width)
                }
                Evidence::Photo(channels) => {
                    let here = [shrunk(&channels[0]), shrunk(&channels[1]), shrunk(&channels[2])];
                    let size = (here[0].width, here[0].height);
                    let photo = Photo::new(here, number == Self::COARSEST);
                    (Kind::Photo(photo), size.0, size.1, channels[0].width)
                }
            };
            let factor = whole.div_ceil(*widest);
            Level { factor, lens: lens.shrunk(factor), size: [width, height], kind }
        };
        let levels = WIDTHS.iter().enumerate().map(level).collect();
        let placed = shape.place(&q);
        let whole = outline_length(shape, &placed);
        Self { name, q, placed, levels, whole }
    }

    /// Draws the robot at this level.
    pub fn outliner(&self, level: usize) -> Outliner {
        let level = &self.levels[level];
        Outliner::new(level.size[0], level.size[1], level.lens)
    }

    /// The parts in the camera's frame.
    pub fn placed(&self, camera_from_base: &Isometry3<f64>) -> Vec<Isometry3<f64>> {
        self.placed.iter().map(|base_from_part| camera_from_base * base_from_part).collect()
    }

    /// How this level projects.
    pub fn lens(&self, level: usize) -> &Lens {
        &self.levels[level].lens
    }

    /// Columns and rows of this level.
    pub fn size(&self, level: usize) -> [usize; 2] {
        self.levels[level].size
    }

    /// Pixels of the original picture in one of this level, along a row.
    pub fn factor(&self, level: usize) -> usize {
        self.levels[level].factor
    }

    /// Whether the robot is segmented by a mask, not by edges of a photo.
    pub fn has_mask(&self) -> bool {
        matches!(self.levels[0].kind, Kind::Silhouette(_))
    }

    /// What a search from afar brings down: about 1 where robot and picture have nothing in common.
    pub fn apart(&self, shape: &Shape, camera_from_base: &Isometry3<f64>) -> f64 {
        let mut outliner = self.outliner(Self::COARSEST);
        let placed = self.placed(camera_from_base);
        match &self.levels[Self::COARSEST].kind {
            Kind::Silhouette(silhouette) => {
                outliner.draw(&shape.coarse, &placed);
                silhouette.apart(&outliner.covered().collect::<Vec<_>>())
            }
            Kind::Photo(photo) => {
                let mut outline = Vec::new();
                outliner.outline(&shape.coarse, &placed, &mut outline);
                photo.apart(outline.into_iter(), self.lens(Self::COARSEST).focal[0], self.whole)
            }
        }
    }

    /// The same from an outline alone, which may leave the picture.
    pub fn outline_apart(&self, outline: impl Iterator<Item = Place>) -> f64 {
        match &self.levels[Self::COARSEST].kind {
            Kind::Silhouette(silhouette) => silhouette.outline_apart(outline),
            Kind::Photo(photo) => photo.apart(outline, self.lens(Self::COARSEST).focal[0], self.whole),
        }
    }

    /// The paper's loss: share of wrong pixels of two masks, at this level; for a photo the outline's distance to edges.
    pub fn wrong(&self, level: usize, shape: &Shape, camera_from_base: &Isometry3<f64>) -> f64 {
        if ending::asked() {
            return 1.0;
        }
        match &self.levels[level].kind {
            Kind::Silhouette(silhouette) => {
                let mut outliner = self.outliner(level);
                outliner.draw(&shape.fine, &self.placed(camera_from_base));
                silhouette.wrong(outliner.covered())
            }
            Kind::Photo(_) => self.apart(shape, camera_from_base),
        }
    }

    /// What the picture says about a place of the outline at this level, looking no further than `range` pixels.
    pub fn pull(&self, level: usize, place: &Place, range: f64) -> Option<Pull> {
        match &self.levels[level].kind {
            Kind::Silhouette(silhouette) => silhouette.pull(place),
            Kind::Photo(photo) => photo.pull(place, range),
        }
    }

    /// The drawn robot smoothed, for [`Self::pull_exact`]; `None` for a photo.
    pub fn smoothed(&self, level: usize, outliner: &Outliner) -> Option<Grid> {
        match &self.levels[level].kind {
            Kind::Silhouette(silhouette) => Some(silhouette.smoothed(outliner.covered())),
            Kind::Photo(_) => None,
        }
    }

    /// What the picture says about a place that lies nearly on the border, finer than pixels: a silhouette compared with the
    /// drawn robot, a photo by all that is seen across the edge.
    pub fn pull_exact(&self, level: usize, place: &Place, drawn: Option<&Grid>) -> Option<Pull> {
        match &self.levels[level].kind {
            Kind::Silhouette(silhouette) => silhouette.pull_smooth(place, drawn?),
            Kind::Photo(photo) => photo.pull_exact(place),
        }
    }
}

/// Length of the robot's outline [m], the mean of a view along x and one along y from 3 m away.
fn outline_length(shape: &Shape, placed: &[Isometry3<f64>]) -> f64 {
    let lens = Lens { focal: [200.0; 2], centre: [120.0; 2] };
    let mut outliner = Outliner::new(240, 240, lens);
    let mut outline = Vec::new();
    let views = [Vector3::x(), Vector3::y()].map(|from| {
        let middle = Point3::new(0.0, 0.0, 0.5);
        let camera_from_base = Isometry3::look_at_rh(&(middle + from * 3.0), &middle, &Vector3::z());
        // From "y up, looking against z" to "y down, looking along z".
        let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let placed: Vec<_> = placed.iter().map(|p| turned * camera_from_base * p).collect();
        outliner.outline(&shape.coarse, &placed, &mut outline);
        outline.iter().map(|place| place.length * place.point.z / lens.focal[0]).sum::<f64>()
    });
    views.iter().sum::<f64>() / 2.0
}
