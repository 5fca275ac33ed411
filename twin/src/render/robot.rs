//! The robot as the camera sees it: Franka's own visual meshes for the FR3 (crate `franka-description`), capsules along
//! the links of any other arm, and the tool as the capsule it is.

use super::{Mesh, glb};
use crate::arm::{ArmModel, Joints, ModelError};
use crate::scene::ArmOutline;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use shared_mem::cell::Cell;
use std::f64::consts::FRAC_PI_4;

/// Colours of capsules: links in turn, and the tool.
const LINKS: [[u8; 3]; 2] = [[238, 240, 242], [206, 210, 216]];
const TOOL: [u8; 3] = [92, 100, 116];
/// The fingers' frames lie this far from the hand's [m].
const FINGERS: f64 = 0.0584;

/// What is mounted at the flange beside the tool of cell.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hand {
    None,
    /// The Franka Hand, its fingers this far apart [m].
    Franka {
        /// Between the fingertips [m].
        width: f64,
    },
}

/// Every visible part of the robot, and where it is.
#[derive(Debug, Clone)]
pub struct RobotSurface {
    parts: Vec<Mesh>,
    /// For every part the body that it is fixed to, and how.
    mounts: Vec<(Body, Isometry3<f64>)>,
    outline: ArmOutline,
    measured: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Body {
    Base,
    /// Behind joint `0 ..`.
    Link(usize),
    Flange,
    /// A capsule of the outline.
    Capsule(usize),
}

impl RobotSurface {
    /// The robot of a cell.
    ///
    /// # Errors
    /// [`ModelError`] when cell.toml describes no usable arm.
    pub fn new(cell: &Cell, hand: Hand) -> Result<Self, ModelError> {
        let outline = ArmOutline::new(cell)?;
        let measured = cell.robot.as_ref().and_then(|robot| robot.model.as_deref()) == Some("fr3");
        let mut surface = Self { parts: Vec::new(), mounts: Vec::new(), outline, measured };
        if measured {
            surface.add_fr3(hand);
        }
        for (number, part) in surface.outline.parts().to_vec().iter().enumerate() {
            if measured && !part.is_tool {
                continue;
            }
            let color = if part.is_tool { TOOL } else { LINKS[number % 2] };
            let end = Point3::new(0.0, 0.0, part.length);
            surface.parts.push(Mesh::capsule(&Point3::origin(), &end, part.radius, color));
            surface.mounts.push((Body::Capsule(number), Isometry3::identity()));
        }
        Ok(surface)
    }

    fn add_fr3(&mut self, hand: Hand) {
        let set = &franka_description::FR3;
        for (number, bytes) in set.links.iter().enumerate() {
            let body = if number == 0 { Body::Base } else { Body::Link(number - 1) };
            self.add(bytes, body, Isometry3::identity());
        }
        if let Hand::Franka { width } = hand {
            let flange_from_hand = flange_from_hand();
            self.add(set.hand, Body::Flange, flange_from_hand);
            for (side, angle) in [(1.0, 0.0), (-1.0, std::f64::consts::PI)] {
                let place = Translation3::new(0.0, side * width / 2.0, FINGERS);
                let hand_from_finger = Isometry3::from_parts(place, about_z(angle));
                self.add(set.finger, Body::Flange, flange_from_hand * hand_from_finger);
            }
        }
    }

    fn add(&mut self, bytes: &[u8], body: Body, body_from_part: Isometry3<f64>) {
        for mesh in glb::read(bytes).unwrap_or_default() {
            self.parts.push(mesh);
            self.mounts.push((body, body_from_part));
        }
    }

    /// The parts, each in its own frame.
    pub fn parts(&self) -> &[Mesh] {
        &self.parts
    }

    /// True when the parts are the manufacturer's shapes, false for capsules along the links.
    pub fn is_measured(&self) -> bool {
        self.measured
    }

    /// For every part the number of the link it moves with: 0 the base, 1 behind the first joint, `dof + 1` the flange.
    pub fn links(&self) -> Vec<usize> {
        let flange = self.outline.model().dof() + 1;
        let link = |body: Body| match body {
            Body::Base => 0,
            Body::Link(number) => number + 1,
            Body::Flange => flange,
            Body::Capsule(number) if self.outline.parts()[number].is_tool => flange,
            Body::Capsule(number) => number,
        };
        self.mounts.iter().map(|(body, _)| link(*body)).collect()
    }

    /// Calls `place` with every part's number and its frame in the base, for joint positions `q` [rad].
    pub fn for_each(&self, q: &Joints, mut place: impl FnMut(usize, Isometry3<f64>)) {
        let model = self.model();
        let frames = model.link_frames(q);
        let flange = model.flange(q).isometry();
        let mut part = 0;
        for (number, (body, body_from_part)) in self.mounts.iter().enumerate() {
            let base_from_body = match body {
                Body::Base => Isometry3::identity(),
                Body::Link(joint) => frames[*joint],
                Body::Flange => flange,
                Body::Capsule(_) => break,
            };
            place(number, base_from_body * body_from_part);
            part = number + 1;
        }
        let first = self.mounts.get(part).map(|(body, _)| *body);
        if let Some(Body::Capsule(first)) = first {
            self.outline.for_each(q, |capsule, frame| {
                if capsule >= first {
                    place(part + capsule - first, frame);
                }
            });
        }
    }

    /// Frame of a link in the base at joint positions `q` [rad], by its number as in [`Self::links`]; behind the last joint
    /// that of the Franka Hand.
    pub fn base_from_link(&self, q: &Joints, link: usize) -> Isometry3<f64> {
        match link {
            0 => Isometry3::identity(),
            link if link > self.model().dof() => self.model().flange(q).isometry() * flange_from_hand(),
            link => self.model().link_frames(q)[link - 1],
        }
    }

    /// The arm's model.
    pub fn model(&self) -> &ArmModel {
        self.outline.model()
    }
}

/// The Franka Hand is mounted an eighth of a turn from the flange's frame.
fn flange_from_hand() -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::identity(), about_z(-FRAC_PI_4))
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::ArmBalls;
    use crate::shipped::shipped;

    #[test]
    fn every_link_touches_the_next_at_the_joint_between_them() {
        let surface = RobotSurface::new(&shipped(), Hand::None).expect("a robot");
        let q = *surface.model().ready();
        let links = surface.links();
        let mut points = vec![Vec::new(); 9];
        surface.for_each(&q, |part, base_from_part| {
            let corners = surface.parts()[part].points.iter().map(|p| base_from_part * p.cast::<f64>());
            points[links[part]].extend(corners);
        });
        for pair in points.windows(2) {
            let nearest = |p: &Point3<f64>| pair[1].iter().map(|o| (o - p).norm()).fold(f64::INFINITY, f64::min);
            let gap = pair[0].iter().map(nearest).fold(f64::INFINITY, f64::min);
            assert!(gap < 0.02, "{gap} m between neighbours");
        }
    }

    #[test]
    fn the_hull_of_an_fr3_encloses_the_makers_shapes_closely() {
        let mut cell = shipped();
        cell.tool = None;
        let surface = RobotSurface::new(&cell, Hand::None).expect("a robot");
        let (hull, links) = (ArmBalls::of(&cell, surface.model()).expect("an arm with geometry"), surface.links());
        let (mut furthest, mut pose) = (0.0_f64, *surface.model().ready());
        for k in 0..200_u32 {
            // Steps of the golden ratio's share of a turn, a different multiple for each joint: no pose comes twice.
            for (i, q) in pose.iter_mut().enumerate().take(7) {
                *q = (0.618_034 * f64::from(k) * (i as f64 + 1.37)).fract() * std::f64::consts::TAU;
            }
            let mut lowest = f64::INFINITY;
            surface.for_each(&pose, |part, base_from_part| {
                if links[part] >= 2 {
                    let heights = surface.parts()[part].points.iter().map(|p| (base_from_part * p.cast::<f64>()).z);
                    lowest = heights.fold(lowest, f64::min);
                }
            });
            // The shoulder, which the hull leaves out, only turns about its own axes 0.333 m above the base.
            let of_hull = hull.at(&pose).lowest.iter().copied().fold(0.333 - 0.06, f64::min);
            assert!(of_hull <= lowest, "pose {k}: the hull ends {} m above the arm's lowest point", of_hull - lowest);
            furthest = furthest.max(lowest - of_hull);
        }
        assert!(furthest < 0.03, "the hull reaches {furthest} m beyond the arm");
    }

    #[test]
    fn the_last_link_ends_at_the_flange_and_the_hand_begins_there() {
        let mut cell = shipped();
        cell.tool = None;
        let surface = RobotSurface::new(&cell, Hand::Franka { width: 0.04 }).expect("a robot");
        let q = *surface.model().ready();
        let flange_from_base = surface.model().flange(&q).isometry().inverse();
        let (mut link, mut hand) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        surface.for_each(&q, |part, base_from_part| {
            let heights = surface.parts()[part].points.iter().map(|p| (flange_from_base * base_from_part * p.cast()).z);
            let highest = heights.fold(f64::NEG_INFINITY, f64::max);
            match surface.links()[part] {
                7 => link = link.max(highest),
                8 => hand = hand.max(highest),
                _ => {}
            }
        });
        assert!(link.abs() < 0.001, "the last link ends {link} m from the flange");
        // The fingertips of the vendor's drawing: 0.1034 m to the tool centre point, 9 mm more to the very tip.
        assert!((0.108..0.116).contains(&hand), "the fingers end {hand} m from the flange");
    }
}
