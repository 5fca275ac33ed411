//! An object that slides by itself over a table, no robot, as a session in memory. SI units.

use inference::admit::Admitted;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::Pose;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries, Session, SessionFiles};
use shared_mem::theta::Theta;
use std::ops::Range;
use std::path::Path;
use twin::rollout::{CellRollout, CellTrace, Course, ObjectState};

/// Slides in a session.
const SLIDES: u64 = 12;
const CELL: &str = "[table]\nheight = 0.0\n[object]\nshape = \"box\"\nsize = [0.08, 0.06, 0.05]\nmass = 0.3\n\
                    friction_range = [0.1, 0.6]\nfriction_scatter = 0.02\npose_noise = { position = 0.0005, rotation = 0.003 }\n";

/// A slide away from the base's origin in one of many directions, seen at 100 Hz with noise; every thirtieth pose is missing.
fn slide(cell: &Cell, hidden: &Theta, number: u64) -> Clip {
    let angle = 2.4 * number as f64;
    let state = ObjectState {
        pose: Pose::from_isometry(Isometry3::from_parts(
            Vector3::new(0.4, 0.0, 0.025).into(),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7 * angle),
        )),
        velocity: Vector3::new(angle.cos(), angle.sin(), 0.0) * (0.6 + 0.05 * (number % 5) as f64),
        angular_velocity: Vector3::z() * (0.4 * (number % 3) as f64),
    };
    let stamps_ns: Vec<u64> =
        (0..80).filter(|row| row % 30 != 17).map(|row| 1_000_000_000 + row * 10_000_000).collect();
    let mut rollout = CellRollout::new(cell, Some(hidden)).expect("a cell");
    rollout.start(stamps_ns[0], None, Some(&state), None);
    let mut trace = CellTrace::default();
    rollout.run(&Course { commands: None, joints_ns: &[], poses_ns: &stamps_ns }, &mut trace);
    let noisy = |(row, pose): (usize, &Pose<_, _>)| {
        // Uniform noise of half a millimetre and 3 mrad, one sigma, that no two rows share.
        let noise = |k: u64| {
            let bits = (number * 1009 + row as u64 * 7 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            (bits as f64 / 8_388_608.0 - 1.0) * 3.0_f64.sqrt()
        };
        let mut pose: Isometry3<f64> = pose.isometry();
        pose.translation.vector += Vector3::new(noise(0), noise(1), noise(2)) * 5e-4;
        pose.rotation =
            UnitQuaternion::from_scaled_axis(Vector3::new(noise(3), noise(4), noise(5)) * 3e-3) * pose.rotation;
        Pose::from_isometry(pose)
    };
    let poses = trace.poses.iter().enumerate().map(noisy).collect();
    Clip {
        file: format!("slide_{number:02}.mcap").into(),
        kind: ClipKind::FreeMotion,
        joint_names: Vec::new(),
        desired: JointSeries::default(),
        measured: JointSeries::default(),
        torques_end_at_rows: false,
        object: ObjectSeries { stamps_ns, poses },
        others: Vec::new(),
        origins: shared_mem::origin::Origins::default(),
        warnings: Vec::new(),
        damage: None,
    }
}

/// Slides of these numbers in which `hidden` acts: each has a heading, a speed, a spin and a noise of its own.
pub(crate) fn numbered(cell: &Cell, hidden: &str, numbers: Range<u64>) -> Vec<Clip> {
    let hidden: Theta = shared_mem::toml_file::parse(hidden, Path::new("theta.toml")).expect("parameters");
    numbers.map(|number| slide(cell, &hidden, number)).collect()
}

/// Slides in which `hidden` acts, read and admitted.
pub(crate) fn session(hidden: &str) -> (Session, Admitted) {
    let cell = Cell::parse(CELL, Path::new("cell.toml")).expect("a cell");
    let clips = numbered(&cell, hidden, 0..SLIDES);
    let files = clips.iter().map(|clip| clip.file.display().to_string()).collect();
    let session = Session { folder: "slides".into(), cell, clips: Vec::new(), files: SessionFiles::default() };
    (session, Admitted::of(clips, files, true))
}
