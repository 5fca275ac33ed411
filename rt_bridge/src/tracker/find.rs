//! The object in pictures of which nothing is known: what rises from the table, is not the robot and is as large as the
//! object, with the pose in which the object looks most like it. One step a picture, so that none takes longer than a camera
//! leaves: heaps, then for each of them where the object may stand there, and what fits.

use super::align::{COARSE, FINE, Fit, Scene};
use super::arm::ArmBody;
use super::judge::Verdict;
use super::model::Model;
use super::patch::{Patch, widened};
use super::view::{Frame, View};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use shared_mem::msg::Joints;
use twin::render::{Pinhole, Raster};

/// Every so many pixels along rows and columns one is looked at.
const EVERY: usize = 2;
/// What rises less is the table [m].
const LEAST_HEIGHT: f32 = 0.01;
/// Fewer pixels (of those looked at) are no object.
const MIN_PIXELS: usize = 20;
/// Heaps that are looked into, the largest first.
const HEAPS: usize = 6;
/// Turns that are tried [rad].
const TURN: f64 = 0.27;
/// Poses that are fitted, of all that are drawn, and of those how many to the end.
const FITTED: usize = 6;
const FINISHED: usize = 3;
/// Poses that differ by less are one [m, rad].
const ALIKE: [f64; 2] = [0.012, 0.35];
/// Where another pose scores within this of the best, the picture does not decide between them.
const UNDECIDED: f64 = 0.04;
/// Poses look the same where their outlines differ by no more than this share of the pixels, and their surfaces by this [m].
const SAME_OUTLINE: f32 = 0.04;
const SAME_SURFACE: f32 = 0.002;
/// Share of the object that must be seen before it counts as found.
const SHOWN: f64 = 0.35;
/// Of what rises from the table there, the object must explain this share.
const EXPLAINED: f64 = 0.6;

/// The robot at a moment.
pub(super) type Arm<'a> = Option<(&'a ArmBody, &'a Joints)>;

/// Where another object is followed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Occupied {
    /// Its geometric centre, base frame [m].
    pub(super) centre: Vector3<f64>,
    /// Of a ball around it in which there is nothing else [m].
    pub(super) radius: f64,
}

impl Occupied {
    pub(super) fn holds(&self, place: &Vector3<f64>) -> bool {
        (place - self.centre).norm() < self.radius
    }
}

/// One heap on the table.
#[derive(Debug, Clone)]
struct Cluster {
    /// Its pixels.
    pixels: Vec<[u16; 2]>,
    /// Mean of its points, base frame [m].
    middle: Vector3<f64>,
}

/// A search under way.
#[derive(Debug, Clone)]
pub(super) struct PlaceSearch {
    /// Heaps that nobody has looked into, the largest last.
    left: Vec<Cluster>,
    /// The heap that is looked into, and poses in which the object may be there.
    ranked: Option<(Cluster, Vec<Isometry3<f64>>)>,
    /// The poses that explain one heap and do so best, the best first.
    best: Vec<(Fit, Verdict)>,
}

impl PlaceSearch {
    /// Whether everything was looked into.
    pub(super) fn is_over(&self) -> bool {
        self.left.is_empty() && self.ranked.is_none()
    }

    /// The poses found, the best first.
    pub(super) fn found(&self) -> Vec<Fit> {
        self.best.iter().map(|(fit, _)| *fit).collect()
    }
}

impl Scene<'_> {
    /// Begins to look for the object in the whole picture, but for where others are followed.
    pub(super) fn begin_hunt(&self, view: &View, frame: &Frame, arm: Arm, others: &[Occupied]) -> PlaceSearch {
        let mut left = self.heaps(view, frame, arm);
        left.retain(|heap| !others.iter().any(|other| other.holds(&heap.middle)));
        left.reverse();
        let mut hunt = PlaceSearch { left, ranked: None, best: Vec::new() };
        self.go_on(&mut hunt, view, frame, arm);
        hunt
    }

    /// The next step of a search.
    pub(super) fn go_on(&self, hunt: &mut PlaceSearch, view: &View, frame: &Frame, arm: Arm) {
        match hunt.ranked.take() {
            Some((heap, starts)) => {
                let fits = self.fit(view, frame, arm, &heap, &starts);
                if score(&fits) > score(&hunt.best) {
                    hunt.best = fits;
                }
            }
            None => {
                hunt.ranked = hunt.left.pop().map(|heap| {
                    let starts = self.rank(view, frame, arm, &heap);
                    (heap, starts)
                });
            }
        }
    }

    /// Of several poses the one that fits best, now that more is known of the object's colours; `None` where the picture
    /// does not decide between two, or the best is mostly covered.
    pub(super) fn decide(&self, patch: &mut Patch, poses: &[Fit]) -> Option<Fit> {
        let mut fits: Vec<(Fit, Verdict)> = poses
            .iter()
            .filter_map(|pose| {
                let fit = self.align(patch, &pose.camera_from_object, FINE)?;
                let verdict = self.judge(patch, &fit.camera_from_object);
                verdict.holds().then_some((fit, verdict))
            })
            .collect();
        fits.sort_by(|(_, a), (_, b)| b.score().total_cmp(&a.score()));
        let (best, verdict) = fits.first()?;
        let undecided = fits[1..].iter().any(|(other, rival)| {
            let (a, b) = (&best.camera_from_object, &other.camera_from_object);
            rival.score() > verdict.score() - UNDECIDED && !self.alike(a, b) && !self.look_alike(patch, a, b)
        });
        let shown = f64::from(verdict.agree) >= SHOWN * f64::from(verdict.drawn);
        (shown && !undecided).then_some(*best)
    }

    /// Whether nobody could tell two poses apart, as with a cylinder that is turned.
    fn look_alike(&self, patch: &mut Patch, a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
        patch.draw(self.model, a);
        let first = patch.drawn().to_vec();
        patch.draw(self.model, b);
        let (mut either, mut one, mut apart) = (0.0, 0.0, 0.0);
        for (a, b) in first.iter().zip(patch.drawn()).filter(|(a, b)| **a > 0.0 || **b > 0.0) {
            either += 1.0;
            if *a > 0.0 && *b > 0.0 {
                apart += (1.0 / a - 1.0 / b).abs();
            } else {
                one += 1.0;
            }
        }
        one < SAME_OUTLINE * either && apart < SAME_SURFACE * either
    }

    /// What rises from the table, the largest heap first.
    fn heaps(&self, view: &View, frame: &Frame, arm: Arm) -> Vec<Cluster> {
        let (width, height) = (view.width / EVERY, view.height / EVERY);
        let robot = robot(view, arm, width, height);
        let mut rises = vec![0.0_f32; width * height];
        for v in 0..height {
            for u in 0..width {
                let (x, y) = (u * EVERY, v * EVERY);
                let ray = view.ray(x as f32, y as f32);
                let seen = self.table.corrected(&ray, frame.inverse_depth(view, x, y));
                let table = self.table.inverse_depth(&ray);
                // On a plane seen along a ray, 1 - table / seen is the height over it as a share of the camera's.
                let rise = (1.0 - table / seen) / self.table.normal.norm();
                let clear = seen - table > 3.5 * self.table.noise && rise > LEAST_HEIGHT;
                if seen > 0.0 && table > 0.0 && clear && robot[v * width + u] == 0.0 {
                    rises[v * width + u] = seen;
                }
            }
        }
        let mut heaps: Vec<Vec<[u16; 2]>> = Vec::new();
        for start in 0..rises.len() {
            if rises[start] > 0.0 {
                let pixels = flood(&mut rises, width, start, 8.0 * self.table.noise);
                if pixels.len() >= MIN_PIXELS {
                    heaps.push(pixels);
                }
            }
        }
        heaps.sort_by_key(|pixels| std::cmp::Reverse(pixels.len()));
        let heaps = heaps.into_iter().filter_map(|pixels| self.heap(view, frame, pixels));
        heaps.take(HEAPS).collect()
    }

    /// `None` where a heap is too large to be the object.
    fn heap(&self, view: &View, frame: &Frame, pixels: Vec<[u16; 2]>) -> Option<Cluster> {
        let points: Vec<Vector3<f64>> = pixels
            .iter()
            .map(|[u, v]| {
                let (u, v) = (usize::from(*u), usize::from(*v));
                let ray = view.ray(u as f32, v as f32);
                let point = (ray / self.table.corrected(&ray, frame.inverse_depth(view, u, v))).cast::<f64>();
                (view.base_from_camera * nalgebra::Point3::from(point)).coords
            })
            .collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let within = points.iter().filter(|p| (*p - middle).norm() < 1.5 * self.model.radius).count();
        (2 * within > points.len()).then_some(Cluster { pixels, middle })
    }

    /// The poses in which the object, standing on the table, looks most like a heap.
    fn rank(&self, view: &View, frame: &Frame, arm: Arm, heap: &Cluster) -> Vec<Isometry3<f64>> {
        let Some(mut patch) = self.around(view, frame, arm, heap) else { return Vec::new() };
        let mut starts: Vec<(f64, Isometry3<f64>)> = candidates(self.model)
            .filter_map(|rotation| {
                let pose = self.under(&mut patch, view, heap, &rotation)?;
                Some((self.judge(&mut patch, &pose).score(), pose))
            })
            .collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut tried: Vec<Isometry3<f64>> = Vec::new();
        for (_, start) in starts {
            if tried.len() < FITTED && !tried.iter().any(|other| self.alike(other, &start)) {
                tried.push(start);
            }
        }
        tried
    }

    /// The object's poses that explain a heap, the best first: all are fitted roughly, the best of them to the end.
    fn fit(
        &self,
        view: &View,
        frame: &Frame,
        arm: Arm,
        heap: &Cluster,
        starts: &[Isometry3<f64>],
    ) -> Vec<(Fit, Verdict)> {
        let Some(mut patch) = self.around(view, frame, arm, heap) else { return Vec::new() };
        let mut rough: Vec<(f64, Isometry3<f64>)> = starts
            .iter()
            .filter_map(|start| {
                let pose = self.align(&mut patch, start, COARSE)?.camera_from_object;
                Some((self.judge(&mut patch, &pose).score(), pose))
            })
            .collect();
        rough.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut apart: Vec<Isometry3<f64>> = Vec::new();
        for (_, pose) in rough {
            if apart.len() < FINISHED && !apart.iter().any(|other| self.alike(other, &pose)) {
                apart.push(pose);
            }
        }
        let mut fits: Vec<(Fit, Verdict)> = apart
            .iter()
            .filter_map(|pose| {
                let fit = self.align(&mut patch, pose, FINE)?;
                let verdict = self.judge(&mut patch, &fit.camera_from_object);
                let explains = explained(&patch, heap, self.table.noise) >= EXPLAINED;
                (verdict.holds() && explains).then_some((fit, verdict))
            })
            .collect();
        fits.sort_by(|(_, a), (_, b)| b.score().total_cmp(&a.score()));
        fits
    }

    fn around(&self, view: &View, frame: &Frame, arm: Arm, heap: &Cluster) -> Option<Patch> {
        let centre = view.base_from_camera.inverse() * nalgebra::Point3::from(heap.middle);
        Patch::around(view, self.table, frame, arm, &centre.coords, 2.0 * self.model.radius)
    }

    /// Whether two poses look nearly the same.
    fn alike(&self, a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
        let turned = self.model.nearest(a, &b.rotation).rotation.angle_to(&b.rotation);
        (a.translation.vector - b.translation.vector).norm() < ALIKE[0] && turned < ALIKE[1]
    }

    /// The pose with this rotation (base frame) that stands on the table and shows its visible side where the heap is.
    fn under(
        &self,
        patch: &mut Patch,
        view: &View,
        heap: &Cluster,
        rotation: &UnitQuaternion<f64>,
    ) -> Option<Isometry3<f64>> {
        let camera_from_base = view.base_from_camera.inverse();
        let up = view.base_from_camera.inverse_transform_vector(&Vector3::z());
        let mut place = heap.middle;
        let mut pose = Isometry3::identity();
        for _ in 0..2 {
            pose = camera_from_base * Isometry3::from_parts(Translation3::from(place), *rotation);
            let height = self.table.height(&pose.translation.vector);
            pose.translation.vector += up * (self.model.depth_below_centre(rotation) - height);
            patch.draw(self.model, &pose);
            let (mut sum, mut count) = (Vector3::zeros(), 0.0);
            for v in (0..patch.height).step_by(2) {
                for u in (0..patch.width).step_by(2) {
                    let at = v * patch.width + u;
                    let drawn = patch.drawn()[at];
                    if drawn > 0.0 && patch.arm[at] < drawn {
                        sum += patch.ray(u, v).cast::<f64>() / f64::from(drawn);
                        count += 1.0;
                    }
                }
            }
            if count < 5.0 {
                return None;
            }
            let shown = view.base_from_camera * nalgebra::Point3::from(sum / count);
            place += heap.middle - shown.coords;
        }
        Some(pose)
    }
}

fn score(fits: &[(Fit, Verdict)]) -> f64 {
    fits.first().map_or(f64::NEG_INFINITY, |(_, verdict)| verdict.score())
}

/// Rotations to try, base frame: every way to stand, turned about the vertical.
fn candidates(model: &Model) -> impl Iterator<Item = UnitQuaternion<f64>> {
    model.stances.iter().flat_map(|stance| {
        let turns = (stance.period / TURN).round().max(1.0);
        (0..turns as usize).map(move |i| {
            let yaw = i as f64 * stance.period / turns;
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw) * stance.upright
        })
    })
}

/// The share of a heap's pixels that the drawn object explains.
fn explained(patch: &Patch, heap: &Cluster, noise: f32) -> f64 {
    let matches = heap.pixels.iter().filter(|[u, v]| {
        let Some(at) = patch.local(usize::from(*u), usize::from(*v)) else { return false };
        let drawn = patch.drawn()[at];
        drawn > 0.0 && (patch.seen[at] - drawn).abs() < 4.0 * noise + 0.01 * drawn * drawn
    });
    matches.count() as f64 / heap.pixels.len() as f64
}

/// The robot's outline on the grid that is looked at; 0 beside it.
fn robot(view: &View, arm: Arm, width: usize, height: usize) -> Vec<f32> {
    let Some((body, q)) = arm else { return vec![0.0; width * height] };
    let [fx, fy, cx, cy] =
        [view.pinhole.fx, view.pinhole.fy, view.pinhole.cx, view.pinhole.cy].map(|v| v / EVERY as f32);
    let mut raster = Raster::new(width, height, Pinhole { fx, fy, cx, cy }, -Vector3::z());
    raster.clear([0; 3]);
    body.draw(&mut raster, &view.base_from_camera.inverse(), q);
    widened(raster.inverse_depth(), width, 2)
}

/// Takes a connected part out of `rises`, neighbours being less than `step` apart. Answers with pixels of the picture.
fn flood(rises: &mut [f32], width: usize, start: usize, step: f32) -> Vec<[u16; 2]> {
    let height = rises.len() / width;
    let mut pixels = Vec::new();
    let mut open = vec![(start, rises[start])];
    rises[start] = 0.0;
    while let Some((at, depth)) = open.pop() {
        let (u, v) = (at % width, at / width);
        pixels.push([(u * EVERY) as u16, (v * EVERY) as u16]);
        let beside = [
            (u > 0).then(|| at - 1),
            (u + 1 < width).then_some(at + 1),
            (v > 0).then(|| at - width),
            (v + 1 < height).then_some(at + width),
        ];
        for next in beside.into_iter().flatten() {
            if rises[next] > 0.0 && (rises[next] - depth).abs() < step + 0.03 * depth * depth {
                open.push((next, rises[next]));
                rises[next] = 0.0;
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_heaps_side_by_side_at_other_distances_stay_two() {
        let mut rises = vec![0.0; 12];
        rises[1..6].fill(0.7);
        rises[6..9].fill(0.9);
        let first = flood(&mut rises, 12, 1, 0.01);
        assert_eq!((first.len(), first.contains(&[10, 0])), (5, true));
        assert_eq!(flood(&mut rises, 12, 8, 0.01).len(), 3);
    }
}
