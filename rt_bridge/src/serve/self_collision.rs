//! Whether the arm is running into itself: capsules around its links, and how near those come that are no neighbours. Links
//! that meet but move apart are let go, so that a client can get an arm out of it. The robot's own volumes are not published.

use nalgebra::{Isometry3, Point3, Vector3};
use shared_mem::cell::Cell;
use twin::arm::{JointState, Joints, ModelError};
use twin::scene::ArmOutline;

/// Links that approach each other no faster than this do not [m/s]: a measured velocity is never quite nought.
const APPROACH_SPEED: f64 = 5e-3;
/// How far ahead is looked to tell approaching from parting [s].
const AHEAD: f64 = 0.01;

/// The links, and which of them can meet.
#[derive(Debug, Clone)]
pub(super) struct SelfCollision {
    outline: ArmOutline,
    pairs: Vec<[usize; 2]>,
    axes: Vec<[Point3<f64>; 2]>,
}

impl SelfCollision {
    /// Of the cell's arm with its tool.
    pub(super) fn new(cell: &Cell) -> Result<Self, ModelError> {
        let outline = ArmOutline::new(cell)?;
        let count = outline.parts().len();
        let mut new = Self { outline, pairs: Vec::new(), axes: vec![[Point3::origin(); 2]; count] };
        // What touches while the arm stands ready is built that way: neighbours, and links around a bent wrist.
        let ready = *new.outline.model().ready();
        new.place(&ready);
        new.pairs = (0..count)
            .flat_map(|b| (0..b).map(move |a| [a, b]))
            .filter(|[a, b]| b - a > 1 && new.gap([*a, *b]) > 0.0)
            .collect();
        Ok(new)
    }

    /// Whether links that meet are pressed further into each other.
    pub(super) fn threatens(&mut self, joints: &JointState) -> bool {
        let gap = self.least_gap(&joints.q);
        let soon: Joints = std::array::from_fn(|i| joints.q[i] + AHEAD * joints.dq[i]);
        gap <= 0.0 && self.least_gap(&soon) < gap - AHEAD * APPROACH_SPEED
    }

    /// Between the two links that are nearest to each other with the joints at `q` [rad], in metres.
    fn least_gap(&mut self, q: &Joints) -> f64 {
        self.place(q);
        self.pairs.iter().map(|pair| self.gap(*pair)).fold(f64::INFINITY, f64::min)
    }

    fn place(&mut self, q: &Joints) {
        let Self { outline, axes, .. } = self;
        outline.for_each(q, |number, base_from_part: Isometry3<f64>| {
            let end = Point3::new(0.0, 0.0, outline.parts()[number].length);
            axes[number] = [base_from_part * Point3::origin(), base_from_part * end];
        });
    }

    /// Between two capsules [m].
    fn gap(&self, [a, b]: [usize; 2]) -> f64 {
        let radius = |part: usize| self.outline.parts()[part].radius;
        distance(&self.axes[a], &self.axes[b]) - radius(a) - radius(b)
    }
}

/// Between two line segments [m]. Source: Ericson, Real-Time Collision Detection (2005), 5.1.9.
fn distance([a, a_end]: &[Point3<f64>; 2], [b, b_end]: &[Point3<f64>; 2]) -> f64 {
    let (u, v, w): (Vector3<f64>, Vector3<f64>, Vector3<f64>) = (a_end - a, b_end - b, a - b);
    let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
    let apart = uu * vv - uv * uv;
    // Parallel axes are nearest to each other anywhere along what they share.
    let free = if apart > 1e-12 { (uv * vw - vv * uw) / apart } else { 0.0 };
    let along_b = if vv > 0.0 { (uv * free.clamp(0.0, 1.0) + vw) / vv } else { 0.0 };
    let t = along_b.clamp(0.0, 1.0);
    let s = if uu > 0.0 { ((uv * t - uw) / uu).clamp(0.0, 1.0) } else { 0.0 };
    (w + u * s - v * t).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use shared_mem::msg::joints_from;

    fn arm() -> SelfCollision {
        let text = include_str!("../../../config/fr3_cell.toml");
        SelfCollision::new(&Cell::parse(text, "cell.toml".as_ref()).expect("the shipped cell")).expect("an FR3")
    }

    #[test]
    fn a_ready_arm_and_a_stretched_one_are_free_and_one_folded_onto_its_base_is_not() {
        let mut arm = arm();
        let ready = *arm.outline.model().ready();
        assert!(arm.least_gap(&ready) > 0.0);
        assert!(arm.least_gap(&joints_from(&[0.0, 0.0, 0.0, -0.2, 0.0, 1.6, 0.0])) > 0.0);
        // Upper arm back, elbow folded: the hand comes down on the shoulder.
        let folded = joints_from(&[0.0, -0.3, 0.0, -3.0, 0.0, 0.5, 0.0]);
        let way = |share: f64| -> Joints { std::array::from_fn(|i| ready[i] + share * (folded[i] - ready[i])) };
        let meets = (0..=100).map(|k| way(f64::from(k) * 0.01)).find(|q| arm.least_gap(q) <= 0.0).expect("they meet");
        let mut at_speed = |share: f64| {
            let dq = std::array::from_fn(|i| share * (folded[i] - ready[i]));
            arm.threatens(&JointState { q: meets, dq })
        };
        assert_eq!([0.0, 0.5, -0.5].map(&mut at_speed), [false, true, false], "at rest, further in, out again");
    }

    proptest! {
        #[test]
        fn the_distance_between_segments_is_that_of_their_nearest_points(
            ends in prop::array::uniform4(prop::array::uniform3(-1.0..1.0_f64)),
        ) {
            let [a, b, c, d] = ends.map(Point3::from);
            let found = distance(&[a, b], &[c, d]);
            let at = |from: Point3<f64>, to: Point3<f64>, k: u32| from + (to - from) * (f64::from(k) / 100.0);
            let tried = (0..=100).flat_map(|i| (0..=100).map(move |j| (i, j)));
            let nearest = tried.map(|(i, j)| (at(a, b, i) - at(c, d, j)).norm()).fold(f64::INFINITY, f64::min);
            prop_assert!(found <= nearest + 1e-12 && nearest - found < 0.03, "{found} and {nearest}");
        }
    }
}
