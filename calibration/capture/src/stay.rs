//! The objects beside the one that is hit, where a simulated cell is started anew: they stay where they are seen. Pure. Base frame;
//! m, rad.

use super::object_watch::between;
use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::{Cell, Object};
use shared_mem::msg::object::ObjectName;
use std::f64::consts::TAU;
use twin::scene::{CellBody, joint_position, start_of, starts};

/// Nearer than this to where it was started, an object has not moved, and what differs is the tracker's noise [m or rad].
const MAX_TRACKER_NOISE: [f64; 2] = [2e-3, 0.01];
/// What leans further is not upright [rad].
const MAX_LEAN: f64 = 0.1;

/// Has the objects of `cell` beside the one in question start where `seen` has their bodies; `bodies`: all of the cell. An object that
/// did not move keeps its start. Returns the names of those that lie on a side, which start upright.
pub(super) fn stay(cell: &mut Cell, bodies: &[CellBody], seen: &[(ObjectName, Isometry3<f64>)]) -> Vec<String> {
    let begun = starts(cell, bodies, cell.table.as_ref().map_or(0.0, |table| table.height));
    let pose = |body: &CellBody| seen.iter().find(|(name, _)| *name == body.name).map(|(_, pose)| *pose);
    let in_question = cell.in_question;
    let mut on_a_side = Vec::new();
    for (number, (object, begun)) in cell.objects.iter_mut().zip(&begun).enumerate() {
        let own: Vec<&CellBody> = bodies.iter().filter(|body| body.object == number).collect();
        let Some(stands) = own.first().and_then(|root| pose(root)).filter(|_| number != in_question) else { continue };
        if (stands * Vector3::z()).angle(&Vector3::z()) > MAX_LEAN {
            on_a_side.extend(object.name.clone());
        }
        let [yaw, before] = [&stands, begun].map(|pose| pose.rotation.euler_angles().2);
        let [there, was] = [stands, *begun].map(|pose| pose.translation.vector.xy());
        let has_moved =
            (there - was).norm() > MAX_TRACKER_NOISE[0] || between(yaw, before).abs() > MAX_TRACKER_NOISE[1];
        // A start that is not said depends on that of the object before it.
        let (place, yaw) = if has_moved { (there, yaw) } else { (was, before) };
        (object.start, object.start_yaw) = (Some(place.into()), Some(yaw));
        let poses: Vec<_> = own.iter().map(|body| pose(body)).collect();
        let moved: Vec<_> =
            own.iter().zip(&poses).filter_map(|(body, pose)| moved(object, body, *pose, &poses)).collect();
        object.joints.extend(moved);
    }
    on_a_side
}

/// The joint of a link and where it is, where that is another place than its start.
fn moved(
    object: &Object,
    body: &CellBody,
    pose: Option<Isometry3<f64>>,
    poses: &[Option<Isometry3<f64>>],
) -> Option<(String, f64)> {
    let link = body.link.as_ref()?;
    let joint = link.joint.as_ref()?;
    let position = joint_position(joint, &(*poses.get(joint.parent)?)?, &pose?);
    let [low, high] = joint.limits;
    let turns = if joint.slides { [0.0; 3] } else { [0.0, TAU, -TAU] };
    let inside = turns.iter().map(|turn| position + turn).find(|position| (low..=high).contains(position));
    let position = inside.unwrap_or_else(|| position.clamp(low, high));
    let same = MAX_TRACKER_NOISE[usize::from(!joint.slides)];
    ((position - start_of(object, link)).abs() > same).then(|| (joint.name.clone(), position))
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::frames::Pose;
    use twin::scene::cell_bodies;
    use twin::sim::SimScene;

    const LAPTOP: &str = "<robot name='lap'>\
        <link name='base'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial>\
        <collision><origin xyz='0 0 0.01'/><geometry><box size='0.2 0.2 0.02'/></geometry></collision></link>\
        <link name='lid'><inertial><mass value='0.2'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial>\
        <collision><origin xyz='-0.1 0 0.005'/><geometry><box size='0.2 0.2 0.01'/></geometry></collision></link>\
        <joint name='hinge' type='revolute'><parent link='base'/><child link='lid'/><origin xyz='0.1 0 0.02'/>\
        <axis xyz='0 1 0'/><limit lower='0' upper='2.0' effort='1' velocity='1'/></joint></robot>";

    fn laboratory(folder: &std::path::Path) -> Cell {
        std::fs::write(folder.join("lap.urdf"), LAPTOP).expect("room");
        let text = "[table]\nheight = 0.02\n\
            [[object]]\nname = \"milk\"\nshape = \"box\"\nsize = [0.1, 0.1, 0.2]\n\
            [[object]]\nname = \"cup\"\nshape = \"box\"\nsize = [0.06, 0.08, 0.1]\n\
            [[object]]\nname = \"can\"\nshape = \"box\"\nsize = [0.06, 0.06, 0.1]\nstart = [0.3, 0.5]\n\
            [[object]]\nname = \"lap\"\nurdf = \"lap.urdf\"\nhold = \"fixed\"\njoints = { hinge = 0.4 }\nstart = [0.5, -0.5]\n";
        Cell::parse(text, &folder.join("cell.toml")).expect("a cell")
    }

    /// What a tracker sees: each body of the simulated cell, off by a tenth of a millimetre.
    fn seen(scene: &SimScene) -> Vec<(ObjectName, Isometry3<f64>)> {
        let off = nalgebra::Translation3::new(1e-4, 0.0, 0.0);
        let body = |(number, name): (usize, &ObjectName)| Some((*name, off * scene.object(number)?.isometry()));
        scene.names().iter().enumerate().filter_map(body).collect()
    }

    #[test]
    fn what_was_pushed_starts_where_it_is_and_what_was_not_where_it_did() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut cell = laboratory(folder.path());
        let bodies = cell_bodies(&cell).expect("bodies");
        let mut scene = SimScene::new(&cell, None).expect("a scene");
        assert!(stay(&mut cell, &bodies, &seen(&scene)).is_empty());
        // The cup has no start of its own: it stands beside the milk where that starts.
        cell.start_object_at([0.45, -0.05], 0.3);
        let still = SimScene::new(&cell, None).expect("the cell started anew");
        for number in 1..5 {
            let [was, is] = [&scene, &still].map(|scene| scene.object(number).expect("a body").isometry());
            assert!((was.translation.vector - is.translation.vector).norm() < 1e-9, "{was} {is}");
            assert!(was.rotation.angle_to(&is.rotation) < 1e-9);
        }
        let pushed = Isometry3::new(Vector3::new(0.62, 0.31, 0.07), Vector3::z() * 2.4);
        scene.set_object(1, &Pose::from_isometry(pushed), Vector3::zeros(), Vector3::zeros());
        let mut poses = seen(&scene);
        let hinge = Isometry3::new(Vector3::new(0.1, 0.0, 0.02), Vector3::y() * 1.3);
        poses[4].1 = poses[3].1 * hinge;
        cell.start_object_at([0.45, 0.05], 0.3);
        assert!(stay(&mut cell, &bodies, &poses).is_empty());
        let anew = SimScene::new(&cell, None).expect("the cell started anew");
        for (number, (name, pose)) in poses.iter().enumerate().skip(1) {
            let stands = anew.object(number).expect("a body").isometry();
            let apart = (stands.translation.vector - pose.translation.vector).norm();
            assert!(apart < 5e-4 && stands.rotation.angle_to(&pose.rotation) < 1e-6, "{name:?}: {apart} m");
        }
        let milk = anew.object(0).expect("a body").isometry();
        assert!((milk.translation.vector - Vector3::new(0.45, 0.05, 0.12)).norm() < 1e-9, "{milk}");
        assert_eq!(cell.objects[2].start, Some([0.3, 0.5]), "the can did not move");
    }

    #[test]
    fn what_lies_on_a_side_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut cell = laboratory(folder.path());
        let bodies = cell_bodies(&cell).expect("bodies");
        let mut poses = seen(&SimScene::new(&cell, None).expect("a scene"));
        poses[1].1 = Isometry3::new(Vector3::new(0.6, 0.4, 0.05), Vector3::x() * 1.57);
        assert_eq!(stay(&mut cell, &bodies, &poses), ["cup"]);
        assert_eq!(cell.objects[1].start, Some([0.6, 0.4]));
    }
}
