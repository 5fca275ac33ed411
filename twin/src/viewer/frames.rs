//! The frames of the cell as Foxglove's tree: base, links, flange, object and camera, and the twin's own beside the real ones.
//!
//! | frame | hangs on |
//! |---|---|
//! | `robot.base_frame` of cell.toml | nothing: the one base, of robot and twin |
//! | the links by their names in the model or the URDF, `flange` | the link before, the first on the base |
//! | `object`, `object/NAME` of each beside the first, `camera` (optical: z forward, x right, y down) | the base |
//! | the same behind `twin/` | the same behind `twin/`, the first on the base |

use crate::arm::{ArmModel, Joints};
use foxglove::messages::{FrameTransform, FrameTransforms, Quaternion, Timestamp, Vector3};
use nalgebra::Isometry3;
use shared_mem::cell::Cell;
use shared_mem::msg::object::ObjectName;

/// Whose picture it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Look {
    /// The real cell: solid.
    Real,
    /// The twin: a blue ghost, a hair larger, so that it shows where the two agree.
    Twin,
}

/// The optical frame, of pictures and intrinsics.
pub(super) const CAMERA: &str = "camera";
const FLANGE: &str = "flange";
const OBJECT: &str = "object";

pub(super) struct Frames {
    base: String,
    /// Behind each joint; empty where the arm has no geometry.
    links: Vec<String>,
}

impl Frames {
    pub(super) fn of(cell: &Cell, model: &ArmModel) -> Self {
        let named = model.named_links(model.ready()).map(|(name, _)| name.to_owned());
        let links = if model.has_geometry() { named.collect() } else { Vec::new() };
        Self { base: cell.base_frame().to_owned(), links }
    }

    pub(super) fn base(&self) -> &str {
        &self.base
    }

    /// Frame of a link by its number: 0 the base, 1 behind the first joint, one more than there are joints the flange.
    pub(super) fn link(&self, look: Look, link: usize) -> String {
        match link.checked_sub(1) {
            None => self.base.clone(),
            Some(joint) => own(look, self.links.get(joint).map_or(FLANGE, String::as_str)),
        }
    }

    /// Links and flange at joint positions `q` [rad], each in the one before.
    pub(super) fn arm(&self, time: Timestamp, look: Look, model: &ArmModel, q: &Joints) -> FrameTransforms {
        let mut transforms = Vec::new();
        if self.links.is_empty() {
            return FrameTransforms { transforms };
        }
        let flange = (self.links.len() + 1, model.flange(q).isometry());
        let links = model.named_links(q).enumerate().map(|(joint, (_, base_from_link))| (joint + 1, base_from_link));
        let mut before = Isometry3::identity();
        for (link, base_from_link) in links.chain([flange]) {
            let parent = self.link(look, link - 1);
            transforms.push(transform(time, parent, self.link(look, link), &(before.inverse() * base_from_link)));
            before = base_from_link;
        }
        FrameTransforms { transforms }
    }

    /// An object, by the name of its frame ([`object_frame`]).
    pub(super) fn object(&self, time: Timestamp, look: Look, frame: &str, place: &Isometry3<f64>) -> FrameTransforms {
        self.on_base(time, own(look, frame), place)
    }

    pub(super) fn camera(&self, time: Timestamp, base_from_camera: &Isometry3<f64>) -> FrameTransforms {
        self.on_base(time, CAMERA.to_owned(), base_from_camera)
    }

    fn on_base(&self, time: Timestamp, child: String, base_from_child: &Isometry3<f64>) -> FrameTransforms {
        FrameTransforms { transforms: vec![transform(time, self.base.clone(), child, base_from_child)] }
    }
}

/// Name of an object's frame, by its number and name.
pub(super) fn object_frame(number: usize, name: &ObjectName) -> String {
    match number {
        0 => OBJECT.to_owned(),
        _ => format!("{OBJECT}/{}", name.text()),
    }
}

/// The twin has frames of its own.
fn own(look: Look, name: &str) -> String {
    match look {
        Look::Real => name.to_owned(),
        Look::Twin => format!("twin/{name}"),
    }
}

fn transform(time: Timestamp, parent: String, child: String, parent_from_child: &Isometry3<f64>) -> FrameTransform {
    let (translation, rotation) = parts(parent_from_child);
    FrameTransform {
        timestamp: Some(time),
        parent_frame_id: parent,
        child_frame_id: child,
        translation: Some(translation),
        rotation: Some(rotation),
    }
}

/// Position and orientation in Foxglove's types.
pub(super) fn parts(isometry: &Isometry3<f64>) -> (Vector3, Quaternion) {
    let (p, q) = (isometry.translation.vector, isometry.rotation.quaternion());
    (Vector3 { x: p.x, y: p.y, z: p.z }, Quaternion { x: q.i, y: q.j, z: q.k, w: q.w })
}
