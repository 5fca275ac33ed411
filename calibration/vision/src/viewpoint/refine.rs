//! From a pose that is nearly right to the best one: robust least squares on the distances between the robot's outline
//! and what the pictures show of it, from coarse pictures to fine ones.
//!
//! An outline's points slide over the body as the camera moves, but along the line of sight, which no picture sees: so
//! each of them may be held as a point of the body within a step (Drummond & Cipolla 2002).

use super::frame::Frame;
use super::outline::{Outliner, Place};
use super::shape::Shape;
use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};
use shared_mem::ending;
use shared_mem::statistics::median;
use std::ops::Range;
use twin::pose_fit::{Equations, moved, pixel_direction, slope};

/// A pose and what the pictures say there.
#[derive(Debug, Clone)]
pub struct Refined {
    pub camera_from_base: Isometry3<f64>,
    /// Mean robust cost of a pixel of outline, 0 to 1.
    pub cost: f64,
    /// The equations there, one set a group of places: frame and link.
    pub groups: Vec<Group>,
    /// Point that the six numbers turn about, camera frame [m].
    pub pivot: Point3<f64>,
    /// How many times the robot was drawn.
    pub drawings: usize,
    /// Whether all links may look thicker or thinner than their meshes by one number, which is found with the pose.
    pub swells: bool,
}

/// Normal equations of the places of one link in one frame.
#[derive(Debug, Clone)]
pub struct Group {
    /// Number of the frame.
    pub frame: usize,
    /// Number of the link.
    pub link: usize,
    /// Sum of weighted outer products of the slopes [pixel², per rad or m].
    pub information: Matrix6<f64>,
    /// Sum of weighted offsets times slopes.
    pub gradient: Vector6<f64>,
    /// Sum of weights [pixel of outline].
    pub weight: f64,
    /// What the gradient would be if this link were a pixel thicker than it is.
    pub swell: Vector6<f64>,
    /// Sum of weighted offsets [pixel², of outline].
    pub outward: f64,
    /// By how much the gradient, and [`Self::outward`], would be larger if what is seen were explained otherwise.
    pub doubt: (Vector6<f64>, f64),
}

/// One stage: a level, how far a place looks [pixel of the level], and where an offset counts half [pixel].
struct Stage {
    level: usize,
    range: f64,
    half: f64,
    steps: usize,
    /// Places are found finer than pixels: silhouettes compared with the drawn robot, edges by all that is seen across them.
    exact: bool,
}

/// From far to near.
const STAGES: [Stage; 6] = [
    Stage { level: 0, range: 8.0, half: 4.0, steps: 12, exact: false },
    Stage { level: 0, range: 4.0, half: 2.0, steps: 10, exact: false },
    Stage { level: 1, range: 5.0, half: 2.0, steps: 10, exact: false },
    Stage { level: 2, range: 6.0, half: 2.0, steps: 10, exact: false },
    Stage { level: 2, range: 3.0, half: 1.0, steps: 20, exact: false },
    Stage { level: 2, range: 3.0, half: 1.0, steps: 10, exact: true },
];
/// The stages that begin far away, and those that end at the finest pictures.
pub const COARSE: Range<usize> = 0..3;
/// See [`COARSE`].
pub const FINE: Range<usize> = 2..5;
/// The last stage, which is finer than pixels.
pub const LAST: Range<usize> = 5..6;
/// Steps with growing damping before a stage ends.
const TRIALS: usize = 5;
/// A stage ends when a step moves the picture by less than this [pixel].
const SMALLEST_MOTION: f64 = 2e-3;
/// Outline between links counts less than that before the background: little tells two white links apart.
const INNER: f64 = 0.3;

/// The best pose near `start`, by the stages in `which`: [`COARSE`], [`FINE`] or [`LAST`].
pub fn refine(frames: &[Frame], shape: &Shape, start: &Isometry3<f64>, which: Range<usize>) -> Option<Refined> {
    let mut best: Option<Refined> = None;
    let mut drawings = 0;
    for stage in &STAGES[which] {
        let from = best.as_ref().map_or(*start, |best| best.camera_from_base);
        let mut work = Work::new(frames, shape, stage);
        let mut here = work.at(&from)?;
        if stage.exact {
            // Whatever cuts or adds to a silhouette then weighs little against what it shows exactly.
            let typical = median(work.offsets.iter().copied()).unwrap_or(0.0);
            work.half = (OUTLIERS * typical).clamp(FINEST_HALF, stage.half);
            here = work.at(&from)?;
        }
        let mut damping = 1e-3;
        for _ in 0..stage.steps {
            if ending::asked() {
                return None;
            }
            let equations = here.sums();
            let mut trials = 0;
            let better = loop {
                let step = equations.step(damping, FLOOR * equations.information.diagonal().max().max(1e-9))?;
                let there = work.at(&moved(&here.camera_from_base, &here.pivot, &step));
                // Near the end the cost flickers with the places that come and go, while the step stays true.
                match there.filter(|there| stage.exact || there.cost < here.cost) {
                    Some(there) => break Some((there, step)),
                    None if trials == TRIALS => break None,
                    None => (damping, trials) = (damping * 10.0, trials + 1),
                }
            };
            let Some((there, step)) = better else { break };
            damping = (damping * 0.1).max(1e-6);
            let weight: f64 = here.groups.iter().map(|group| group.weight).sum();
            let motion = ((equations.information * step).dot(&step) / weight.max(1e-9)).sqrt();
            here = there;
            if motion < SMALLEST_MOTION {
                break;
            }
        }
        drawings += work.drawings;
        best = Some(here);
    }
    best.map(|best| Refined { drawings, ..best })
}

/// The equations at a pose, as the last stage sees them.
pub fn at(frames: &[Frame], shape: &Shape, camera_from_base: &Isometry3<f64>) -> Option<Refined> {
    Work::new(frames, shape, &STAGES[STAGES.len() - 1]).at(camera_from_base)
}

impl Refined {
    /// The equations of all groups.
    pub fn sums(&self) -> Equations<6> {
        let of = |Group { information, gradient, .. }: Group| Equations { information, gradient };
        self.freed().map(of).fold(Equations::zeros(), |sum, group| sum + group)
    }

    /// The groups' equations for the pose alone, what all links look thicker by eliminated: a lens, a mask's border and a
    /// threshold draw all of them too thick or too thin alike, and taken for the pose that would be a camera nearer by.
    pub fn freed(&self) -> impl Iterator<Item = Group> + '_ {
        let all = self.groups.iter().fold((0.0, 0.0, Vector6::zeros()), |(weight, outward, swell), group| {
            (weight + group.weight, outward + group.outward, swell + group.swell)
        });
        let (weight, outward, swell) = if self.swells && all.0 > 0.0 { all } else { (1.0, 0.0, Vector6::zeros()) };
        let (thicker, along) = (outward / weight, swell / weight);
        self.groups.iter().map(move |group| {
            let cross = group.swell * along.transpose();
            let information = group.information - cross - cross.transpose() + along * along.transpose() * group.weight;
            let left = group.outward - thicker * group.weight;
            let gradient = group.gradient - group.swell * thicker - along * left;
            let doubt = (group.doubt.0 - along * group.doubt.1, group.doubt.1);
            let swell = group.swell - along * group.weight;
            Group { information, gradient, doubt, swell, ..group.clone() }
        })
    }
}

/// What each number's information is larger by, as a share of the largest [1]: a choice, far below what a picture shows.
const FLOOR: f64 = 1e-9;

/// At the last stage an offset counts half at this multiple of the usual one, but not below that [pixel].
const OUTLIERS: f64 = 3.0;
const FINEST_HALF: f64 = 0.2;

/// Draws and compares at one stage.
struct Work<'a> {
    frames: &'a [Frame],
    shape: &'a Shape,
    stage: &'a Stage,
    half: f64,
    /// Offsets met at the last pose, without their signs [pixel].
    offsets: Vec<f64>,
    outliners: Vec<Outliner>,
    outlines: Vec<Vec<Place>>,
    drawings: usize,
}

/// Fewer pixels of outline in all pictures together say nothing.
const MIN_OUTLINE: f64 = 30.0;

impl<'a> Work<'a> {
    fn new(frames: &'a [Frame], shape: &'a Shape, stage: &'a Stage) -> Self {
        let outliners = frames.iter().map(|frame| frame.outliner(stage.level)).collect();
        let outlines = vec![Vec::new(); frames.len()];
        Self { frames, shape, stage, half: stage.half, offsets: Vec::new(), outliners, outlines, drawings: 0 }
    }

    /// The equations at a pose; `None` where too little of the robot is in view.
    fn at(&mut self, camera_from_base: &Isometry3<f64>) -> Option<Refined> {
        let parts = if self.stage.level == Frame::COARSEST { &self.shape.coarse } else { &self.shape.fine };
        self.drawings += self.frames.len();
        let (mut sum, mut length) = (Vector3::zeros(), 0.0);
        for ((frame, outliner), outline) in self.frames.iter().zip(&mut self.outliners).zip(&mut self.outlines) {
            outliner.outline(parts, &frame.placed(camera_from_base), outline);
            for place in outline.iter() {
                sum += place.point.coords * place.length;
                length += place.length;
            }
        }
        if length < MIN_OUTLINE {
            return None;
        }
        let pivot = Point3::from(sum / length);
        let smoothed: Vec<_> = (self.frames.iter().zip(&self.outliners))
            .map(|(frame, outliner)| if self.stage.exact { frame.smoothed(self.stage.level, outliner) } else { None })
            .collect();
        self.offsets.clear();
        let (mut groups, mut cost, mut total) = (Vec::<Group>::new(), 0.0, 0.0);
        for (number, (frame, outline)) in self.frames.iter().zip(&self.outlines).enumerate() {
            for place in outline {
                let length = place.length * if place.is_outer || frame.has_mask() { 1.0 } else { INNER };
                if frame.has_mask() && !place.is_outer {
                    continue;
                }
                total += length;
                let pull = if self.stage.exact {
                    frame.pull_exact(self.stage.level, place, smoothed[number].as_ref())
                } else {
                    frame.pull(self.stage.level, place, self.stage.range)
                };
                let Some(pull) = pull else {
                    cost += length;
                    continue;
                };
                self.offsets.push(pull.offset.abs());
                let ratio = (pull.offset / self.half).powi(2);
                // Geman & McClure: half weight at the half, hardly any far beyond.
                let clear = length * pull.weight;
                cost += length - clear + clear * ratio / (1.0 + ratio);
                let weight = clear / (1.0 + ratio).powi(2);
                let along = pixel_direction(&place.point, frame.lens(self.stage.level).focal, pull.direction);
                let slope = slope(&along, &(place.point - pivot));
                let at = groups.iter().position(|g| (g.frame, g.link) == (number, place.link));
                let group = match at {
                    Some(at) => &mut groups[at],
                    None => {
                        let (information, gradient) = (Matrix6::zeros(), Vector6::zeros());
                        let (frame, link, swell) = (number, place.link, gradient);
                        groups.push(Group {
                            frame,
                            link,
                            information,
                            gradient,
                            weight: 0.0,
                            swell,
                            outward: 0.0,
                            doubt: (gradient, 0.0),
                        });
                        groups.last_mut()?
                    }
                };
                group.information += weight * slope * slope.transpose();
                group.gradient += weight * pull.offset * slope;
                group.weight += weight;
                group.swell += weight * slope;
                group.outward += weight * pull.offset;
                group.doubt.0 += weight * pull.doubt * slope;
                group.doubt.1 += weight * pull.doubt;
            }
        }
        let camera_from_base = *camera_from_base;
        let (cost, swells) = (cost / total.max(1e-9), self.stage.exact);
        Some(Refined { camera_from_base, cost, groups, pivot, drawings: 0, swells })
    }
}
