//! Where the tool meets the object: a capsule against a convex body, as the two ends of the line they share.
//!
//! A tool that lies against a face or along an edge touches along a line, and a rigid line of contact is carried by its
//! ends: both press, or one lifts and the other presses alone. One point in the middle could not hold the object upright
//! against the tool. Where the two meet in a point, both ends are that point.

use super::TableObject;
use super::shape::CollisionShape;
use crate::sliding::SlidingFriction;
use nalgebra::{Isometry3, Point3, Vector3};

/// The tool: a segment along the flange's z axis with a radius around it [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// Flange to the far end of the segment: tool length minus radius.
    pub segment: f64,
    pub radius: f64,
}

/// One place where the tool presses into the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// On the object's surface, base frame.
    pub point: Point3<f64>,
    /// Unit vector from the tool into the object.
    pub normal: Vector3<f64>,
    /// How deep [m]; negative is the gap between the two.
    pub depth: f64,
}

/// Most narrowings of the search for the nearest place; it ends where that is known to this share of the tool's length (0.3 µm on
/// a tool of 0.15 m), or where the tool leans less than this away from the surface [rad].
const NARROWINGS: usize = 48;
const NARROW: f64 = 2e-6;
const LEVEL: f64 = 1e-6;
/// Halvings in the search for an end of the line: 5 µm.
const HALVINGS: usize = 15;
/// Directions towards the surface count as one below this angle's cosine: 8 degrees.
const PARALLEL: f64 = 0.99;

/// The tool's axis and the object, in the object's frame.
struct Approach<'a> {
    shape: &'a CollisionShape,
    base_from_object: Isometry3<f64>,
    /// The axis at the flange, and from there to its other end.
    start: Point3<f64>,
    along: Vector3<f64>,
    tool: Capsule,
}

impl<F: SlidingFriction> TableObject<F> {
    /// Where the tool touches the object deepest or comes nearest, for a flange at `base_from_flange`.
    pub fn touch(&self, tool: &Capsule, base_from_flange: &Isometry3<f64>) -> Touch {
        let approach = Approach::new(self, tool, base_from_flange);
        approach.at(approach.nearest())
    }

    /// The two ends of the line along which tool and object touch, the flange's side first.
    pub fn touches(&self, tool: &Capsule, base_from_flange: &Isometry3<f64>) -> [Touch; 2] {
        let approach = Approach::new(self, tool, base_from_flange);
        let nearest = approach.nearest();
        let deepest = approach.at(nearest);
        if deepest.depth <= 0.0 {
            return [deepest; 2];
        }
        approach.shared_stretch().map(|end| approach.at(approach.end_of_line(nearest, end)))
    }
}

impl<'a> Approach<'a> {
    fn new<F: SlidingFriction>(object: &'a TableObject<F>, tool: &Capsule, base_from_flange: &Isometry3<f64>) -> Self {
        let base_from_object = object.isometry();
        let object_from_base = base_from_object.inverse();
        let start = object_from_base * Point3::from(base_from_flange.translation.vector);
        let along = object_from_base.rotation * (base_from_flange.rotation * (Vector3::z() * tool.segment));
        Self { shape: object.shape(), base_from_object, start, along, tool: *tool }
    }

    fn on_axis(&self, share: f64) -> Point3<f64> {
        self.start + self.along * share
    }

    fn at(&self, share: f64) -> Touch {
        let (distance, surface, outwards) = self.shape.signed_distance(&self.on_axis(share));
        Touch {
            point: self.base_from_object * surface,
            normal: self.base_from_object.rotation * -outwards,
            depth: self.tool.radius - distance,
        }
    }

    /// Share of the axis where it is nearest.
    fn nearest(&self) -> f64 {
        match &self.shape.half_extents {
            Some(half) => self.nearest_to_box(half),
            None => self.nearest_by_search(),
        }
    }

    /// Squared distance from a box is, along a line, a parabola between the shares at which the line crosses one of the
    /// six planes of its faces; the derivative only rises, so the minimum lies where it changes its sign.
    fn nearest_to_box(&self, half: &Vector3<f64>) -> f64 {
        let (start, along) = (self.start.coords, self.along);
        let slope = |share: f64| -> f64 {
            (0..3)
                .map(|i| {
                    let p = start[i] + share * along[i];
                    along[i] * (p - p.clamp(-half[i], half[i]))
                })
                .sum()
        };
        let (mut low, mut high) = (0.0, 1.0);
        if slope(low) >= 0.0 && slope(high) > 0.0 {
            return low;
        }
        if slope(high) <= 0.0 && slope(low) < 0.0 {
            return high;
        }
        for i in 0..3 {
            for side in [-half[i], half[i]] {
                let crossing = (side - start[i]) / along[i];
                if crossing > low && crossing < high {
                    if slope(crossing) > 0.0 { high = crossing } else { low = crossing }
                }
            }
        }
        let (falls, rises) = (slope(low), slope(high));
        if falls < 0.0 && rises > falls {
            return low + (high - low) * (falls / (falls - rises)).min(1.0);
        }
        // Level all along: beside a face any place is as near as the other, inside the box the search tells.
        if falls == 0.0 && rises == 0.0 && self.shape.signed_distance(&self.on_axis(low)).0 < 0.0 {
            return self.nearest_by_search();
        }
        low
    }

    /// The same for any convex body: the distance is convex along a line, so it is least where its slope changes its sign, found
    /// by secants and halvings in turn.
    fn nearest_by_search(&self) -> f64 {
        let slope = |share: f64| self.along.dot(&self.shape.signed_distance(&self.on_axis(share)).2);
        let level = LEVEL * self.tool.segment;
        // A tool most often touches with its tip, or lies along a face with it.
        let mut high = (1.0, slope(1.0));
        if high.1 <= level {
            return high.0;
        }
        let mut low = (0.0, slope(0.0));
        if low.1 >= -level {
            return low.0;
        }
        for narrowing in 0..NARROWINGS {
            let share = if narrowing % 2 == 0 { low.1 / (low.1 - high.1) } else { 0.5 };
            let middle = low.0 + (high.0 - low.0) * share;
            let there = (middle, slope(middle));
            if there.1.abs() <= level || high.0 - low.0 < NARROW {
                return middle;
            }
            if there.1 < 0.0 { low = there } else { high = there }
        }
        0.5 * (low.0 + high.0)
    }

    /// Shares between which the object lies beside the axis.
    fn shared_stretch(&self) -> [f64; 2] {
        let along = self.along / self.tool.segment.powi(2);
        if let Some(half) = &self.shape.half_extents {
            // The box's own shadow on the line: no need to ask all of its corners.
            let (middle, reach) = (-along.dot(&self.start.coords), along.abs().dot(half));
            return [middle - reach, middle + reach].map(|share| share.clamp(0.0, 1.0));
        }
        let shares = self.shape.corners.iter().map(|corner| along.dot(&(corner - self.start)));
        let (low, high) =
            shares.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), share| (low.min(share), high.max(share)));
        [low, high].map(|share| share.clamp(0.0, 1.0))
    }

    /// How far the line of contact reaches from `nearest` towards `limit`: as long as the surface lies the same way.
    fn end_of_line(&self, nearest: f64, limit: f64) -> f64 {
        let way = |share: f64| self.shape.signed_distance(&self.on_axis(share)).2;
        let there = way(nearest);
        if way(limit).dot(&there) > PARALLEL {
            return limit;
        }
        let (mut on, mut off) = (nearest, limit);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (on + off);
            if way(middle).dot(&there) > PARALLEL { on = middle } else { off = middle }
        }
        on
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::test_box::{box_model, nominal};
    use crate::scene::{ObjectModel, ObjectShape};
    use shared_mem::frames::Pose;

    const TOOL: Capsule = Capsule { segment: 0.148, radius: 0.012 };

    /// An upright tool, `tip` being the end of its segment.
    fn upright(tip: Point3<f64>) -> Isometry3<f64> {
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Isometry3::from_parts((tip.coords + Vector3::z() * TOOL.segment).into(), turn)
    }

    #[test]
    fn a_tool_flat_against_a_face_presses_at_both_ends_of_what_it_covers() {
        let object = nominal(&box_model(), None);
        // Segment from 0.02 below the centre upwards beyond the top at 0.05.
        let [top, tip] = object.touches(&TOOL, &upright(Point3::new(-0.0515, 0.0, -0.02)));
        for touch in [top, tip] {
            assert!((touch.depth - 0.0005).abs() < 1e-9, "{}", touch.depth);
            assert!((touch.normal - Vector3::x()).norm() < 1e-6);
        }
        assert!((top.point - Point3::new(-0.04, 0.0, 0.05)).norm() < 1e-6, "{}", top.point);
        assert!((tip.point - Point3::new(-0.04, 0.0, -0.02)).norm() < 1e-6, "{}", tip.point);
    }

    #[test]
    fn a_leaning_tool_presses_with_one_end_only() {
        let object = nominal(&box_model(), None);
        let lean = Isometry3::rotation(Vector3::y() * -0.05);
        let tip = Point3::new(-0.0515, 0.0, -0.02);
        let held = Isometry3::translation(tip.x, tip.y, tip.z) * lean * upright(Point3::origin());
        let [top, tip] = object.touches(&TOOL, &held);
        assert!(top.depth < 0.0 && tip.depth > 0.0, "{} {}", top.depth, tip.depth);
        assert!((tip.point.z + 0.02).abs() < 1e-3, "{}", tip.point);
    }

    #[test]
    fn a_tool_along_an_edge_presses_at_both_ends_even_when_it_leans_a_little() {
        let object = nominal(&box_model(), None);
        let lean = Isometry3::rotation(Vector3::new(0.003, 0.0, 0.0));
        let tip = Point3::new(-0.048, -0.0385, -0.01);
        let held = Isometry3::translation(tip.x, tip.y, tip.z) * lean * upright(Point3::origin());
        let [top, tip] = object.touches(&TOOL, &held);
        assert!((top.point.z - 0.05).abs() < 1e-4 && (tip.point.z + 0.01).abs() < 1e-4, "{} {}", top.point, tip.point);
    }

    #[test]
    fn beside_a_hull_the_nearest_place_is_where_it_is_beside_the_same_box() {
        let half = Vector3::new(0.04, 0.03, 0.05);
        let boxed = nominal(&box_model(), None);
        let sides = [-1.0, 1.0];
        let corner =
            |k: usize| Point3::new(sides[k & 1] * half.x, sides[(k >> 1) & 1] * half.y, sides[k >> 2] * half.z);
        let model = ObjectModel {
            shape: ObjectShape::Mesh { points: (0..8).map(corner).collect(), triangles: Vec::new() },
            ..box_model()
        };
        let hull = nominal(&model, None);
        let mut outside = 0;
        for step in 0..500 {
            let wave = |k: f64| (f64::from(step) * k).sin();
            let turn = Isometry3::rotation(Vector3::new(1.3 * wave(0.7), 1.3 * wave(1.1), wave(0.3)));
            let tip = Point3::new(0.06 * wave(1.9), 0.06 * wave(2.3), 0.08 * wave(3.1));
            let held = Isometry3::translation(tip.x, tip.y, tip.z) * turn * upright(Point3::origin());
            let [gap, same] = [&boxed, &hull].map(|object| object.touch(&TOOL, &held).depth);
            // With its axis inside a tool has gone through the surface, and a box looks no further than that.
            if same < TOOL.radius {
                assert!((gap - same).abs() < 1e-6, "{step}: {gap} {same}");
                outside += 1;
            }
        }
        assert!(outside > 200, "{outside}");
    }

    #[test]
    fn a_tool_away_from_the_object_reports_the_gap() {
        let mut object = nominal(&box_model(), None);
        object.set(&Pose::from_isometry(Isometry3::translation(0.5, 0.0, 0.0)), Vector3::zeros(), Vector3::zeros());
        let touch = object.touch(&TOOL, &upright(Point3::new(0.348, 0.0, 0.0)));
        assert!((touch.depth + 0.1).abs() < 1e-9, "{}", touch.depth);
    }
}
