//! Where on the table objects slid. A patch of another friction shows only where its edge crosses their ways, so that is
//! where it is looked for.

use inference::admit::Admitted;
use shared_mem::recording::Clip;
use std::f64::consts::FRAC_PI_4;

/// Places on a way are so far apart [m]: noise of a tracker is no way.
const PLACES_APART: f64 = 5e-3;
/// Where nothing slid, as if so far [m].
const LEAST_SPREAD: f64 = 0.02;
/// A line beside the middle is this share of the spread away from it.
const LINE_ASIDE: f64 = 0.7;
/// Angle of the first of eight directions [rad]: not along an axis of the table, nor where angles wrap round.
const FIRST_DIRECTION: f64 = -3.0;

/// The part of the table that objects crossed, in the base frame [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Middle of all their ways.
    pub middle: [f64; 2],
    /// Root mean square of the distance from it.
    pub spread: f64,
}

/// Where a patch may lie: beyond an edge that is `distance` from the base's origin in `direction`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// From the base's x axis [rad].
    pub direction: f64,
    /// \[m\]
    pub distance: f64,
    /// One over a disc's radius [1/m]; zero for everything beyond a line.
    pub curvature: f64,
}

impl Ground {
    /// What the objects of a session crossed; `None` where it is the arm that its clips are for.
    pub fn crossed(admitted: &Admitted) -> Option<Self> {
        Self::of(&admitted.clips).filter(|_| admitted.with_object)
    }

    /// What the clips' objects crossed; `None` where none was tracked.
    pub fn of(clips: &[Clip]) -> Option<Self> {
        let mut places: Vec<[f64; 2]> = Vec::new();
        for clip in clips {
            let mut last: Option<[f64; 2]> = None;
            for pose in &clip.object.poses {
                let [x, y, _] = pose.position();
                if last.is_none_or(|[a, b]: [f64; 2]| (x - a).hypot(y - b) > PLACES_APART) {
                    last = Some([x, y]);
                    places.push([x, y]);
                }
            }
        }
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| places.iter().map(of).sum::<f64>() / places.len() as f64;
        let middle = [mean(&|place| place[0]), mean(&|place| place[1])];
        let square = mean(&|place| (place[0] - middle[0]).powi(2) + (place[1] - middle[1]).powi(2));
        (!places.is_empty()).then(|| Self { middle, spread: square.sqrt().max(LEAST_SPREAD) })
    }

    /// Where to look for a patch: beyond lines through the middle and beside it, and in discs whose edges pass through it.
    pub fn patches(&self) -> Vec<Patch> {
        let angles = || (0..8).map(|eighth| FIRST_DIRECTION + f64::from(eighth) * FRAC_PI_4);
        let [x, y] = self.middle;
        let line = |aside: f64| {
            let beyond = aside * self.spread;
            angles().map(move |direction| {
                let distance = x * direction.cos() + y * direction.sin() + beyond;
                Patch { direction, distance, curvature: 0.0 }
            })
        };
        let disc = |angle: f64| {
            let centre = [x + self.spread * angle.cos(), y + self.spread * angle.sin()];
            let distance = centre[0].hypot(centre[1]) - self.spread;
            Patch { direction: centre[1].atan2(centre[0]), distance, curvature: self.spread.recip() }
        };
        line(0.0).chain(line(LINE_ASIDE)).chain(angles().map(disc)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_bench::shipped;
    use worlds::session::record;
    use worlds::world::{Fault, Kind, World};

    #[test]
    fn the_ground_is_where_the_objects_went() {
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &shipped());
        let clips = record(&world, 4).expect("a session");
        let ground = Ground::of(&clips).expect("tracked");
        let away = |place: [f64; 2]| (place[0] - ground.middle[0]).hypot(place[1] - ground.middle[1]);
        for clip in &clips {
            let [first, last] = [clip.object.poses.first(), clip.object.poses.last()].map(|pose| {
                let [x, y, _] = pose.expect("poses").position();
                away([x, y])
            });
            assert!(first.min(last) < 2.0 * ground.spread, "{first} {last} {ground:?}");
        }
        assert!((0.02..0.2).contains(&ground.spread), "{ground:?}");
        assert_eq!(Ground::of(&[]), None);
    }

    #[test]
    fn every_edge_but_those_aside_passes_through_the_middle() {
        let ground = Ground { middle: [0.4, -0.1], spread: 0.08 };
        let [x, y] = ground.middle;
        for (k, patch) in ground.patches().into_iter().enumerate() {
            let along = [patch.direction.cos(), patch.direction.sin()];
            let inside = if patch.curvature > 0.0 {
                let radius = patch.curvature.recip();
                let far = patch.distance + radius;
                radius - (x - far * along[0]).hypot(y - far * along[1])
            } else {
                x * along[0] + y * along[1] - patch.distance
            };
            let expected = if (8..16).contains(&k) { -LINE_ASIDE * ground.spread } else { 0.0 };
            assert!((inside - expected).abs() < 1e-12, "{k}: {inside}");
        }
    }
}
