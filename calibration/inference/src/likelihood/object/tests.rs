//! Rows of an object against what made them: a simulated slide over a table.

use super::*;
use crate::likelihood::Setting;
use crate::likelihood::setting::complete;
use nalgebra::{UnitQuaternion, Vector3};
use shared_mem::origin::Origins;
use shared_mem::recording::{JointSeries, ObjectSeries};
use std::path::Path;
use twin::rollout::{CellTrace, Course, ObjectState};

const NOISE: PoseNoise = PoseNoise { position: 5e-4, rotation: 3e-3 };
/// What the cell is simulated with where it states no range.
const FRICTION: f64 = 0.3;

fn cell(noise: PoseNoise) -> Cell {
    let text = format!(
        "[table]\nheight = 0.0\n[object]\nshape = \"box\"\nsize = [0.08, 0.06, 0.05]\nmass = 0.3\n\
         pose_noise = {{ position = {}, rotation = {} }}\n",
        noise.position, noise.rotation
    );
    Cell::parse(&text, Path::new("cell.toml")).expect("a cell")
}

/// A box that slides and turns until it rests, seen at 100 Hz without noise.
fn slide() -> Clip {
    let pose = Isometry3::from_parts(
        Vector3::new(0.4, 0.0, 0.025).into(),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.7),
    );
    let state = ObjectState {
        pose: Pose::from_isometry(pose),
        velocity: Vector3::new(0.5, 0.2, 0.0),
        angular_velocity: Vector3::z() * 0.8,
    };
    let stamps_ns: Vec<u64> = (0..60).map(|row| 1_000_000_000 + row * 10_000_000).collect();
    let mut rollout = CellRollout::new(&cell(NOISE), None).expect("a cell");
    rollout.start(stamps_ns[0], None, Some(&state), None);
    let mut trace = CellTrace::default();
    rollout.run(&Course { commands: None, joints_ns: &[], poses_ns: &stamps_ns }, &mut trace);
    Clip {
        file: "slide.mcap".into(),
        kind: ClipKind::FreeMotion,
        joint_names: Vec::new(),
        desired: JointSeries::default(),
        measured: JointSeries::default(),
        torques_end_at_rows: false,
        object: ObjectSeries { stamps_ns, poses: trace.poses },
        others: Vec::new(),
        origins: Origins::default(),
        warnings: Vec::new(),
        damage: None,
    }
}

/// The slide under a friction that is searched.
fn clips(noise: PoseNoise) -> ObjectClips {
    let cell = cell(noise);
    let settings = Settings::new(complete(&cell, None).expect("a cell"), vec![Setting::Friction]);
    ObjectClips::new(&cell, vec![slide()], settings).expect("a cell that can be simulated")
}

fn residuals(clips: &ObjectClips, friction: f64, own: &[f64]) -> Vec<f64> {
    let mut out = Vec::new();
    clips.residuals(0, &[friction], own, &mut out).expect("it can be simulated");
    out
}

/// A nuisance parameter alone, by its place in the list.
fn alone(clips: &ObjectClips, name: &str, value: f64) -> Vec<f64> {
    let effects = clips.random();
    let place = effects.random.iter().position(|effect| effect.name == name).expect("a parameter of that name");
    (0..effects.count()).map(|k| if k == place { value } else { 0.0 }).collect()
}

#[test]
fn rows_are_zero_for_the_twins_own_path_and_stand_pose_by_pose() {
    let clips = clips(NOISE);
    let (rows, out) = (clips.rows(0), residuals(&clips, FRICTION, &[]));
    assert_eq!((rows.len(), out.len()), (6 * 60, 6 * 60));
    assert!(rows.chunks(6).all(|pose| pose.iter().all(|row| row.stamp_ns == pose[0].stamp_ns)));
    assert!(rows.is_sorted_by_key(|row| row.stamp_ns));
    // What is left is the first motion, which is read off the poses.
    let largest = |out: &[f64]| out.iter().fold(0.0, |largest: f64, residual| largest.max(residual.abs()));
    let off = residuals(&clips, 1.3 * FRICTION, &[]);
    assert!(largest(&out) < 0.5 * largest(&off), "{} and under another friction {}", largest(&out), largest(&off));
}

#[test]
fn residuals_scale_with_the_trackers_noise() {
    let twice = PoseNoise { position: 2.0 * NOISE.position, rotation: 2.0 * NOISE.rotation };
    let [once, twice] = [NOISE, twice].map(|noise| residuals(&clips(noise), 1.3 * FRICTION, &[]));
    assert!(once.iter().zip(&twice).all(|(once, twice)| (once - 2.0 * twice).abs() <= 1e-9 * once.abs()));
}

#[test]
fn nuisance_parameters_move_what_they_say() {
    let clips = clips(NOISE);
    let rest = residuals(&clips, FRICTION, &[]);
    // A place that begins elsewhere is elsewhere at the first pose.
    let shifted = residuals(&clips, FRICTION, &alone(&clips, "start x", 1e-3));
    assert!((shifted[0] - rest[0] + 1e-3 / NOISE.position).abs() < 1e-6 && (shifted[1] - rest[1]).abs() < 1e-6);
    let turned = residuals(&clips, FRICTION, &alone(&clips, "start yaw", 0.01));
    assert!((turned[5] - rest[5] + 0.01 / NOISE.rotation).abs() < 1e-3, "{} {}", turned[5], rest[5]);
    // 10 ms later a velocity along y has led there.
    let faster = residuals(&clips, FRICTION, &alone(&clips, "first velocity y", 0.1));
    assert!((faster[7] - rest[7] + 1e-3 / NOISE.position).abs() < 0.2, "{} {}", faster[7], rest[7]);
    assert!(clips.random().random.iter().all(|effect| effect.name != "clock"), "an object alone keeps its own time");
}

#[test]
fn what_is_remembered_has_the_same_bits_as_simulating_it_anew() {
    let (asked, fresh) = (clips(NOISE), clips(NOISE));
    let first = residuals(&asked, FRICTION, &[]);
    for friction in [0.1, 0.2, 0.4, 0.5] {
        residuals(&asked, friction, &[]);
    }
    assert_eq!(residuals(&asked, FRICTION, &[]), first);
    assert_eq!(residuals(&fresh, 0.5, &[]), residuals(&asked, 0.5, &[]));
}
