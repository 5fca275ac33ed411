//! Sessions of pushes of a laptop's lid on disk, the hinge of which is known. SI units.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use shared_mem::output::Destination;
use shared_mem::recording::{ClipInfo, Episode, EpisodeInfo, EpisodeMoment, RigidPose, write_episode};
use std::fs;
use std::path::Path;
use twin::arm::UrdfBody;
use twin::world::LoneJoint;

pub(crate) const FRICTION: f64 = 0.05;
pub(crate) const DAMPING: f64 = 0.012;
pub(crate) const LAPTOP: &str = "<robot name='laptop'>
  <!-- out of a scan -->
  <link name='base'/>
  <link name='lid'>
    <inertial><origin xyz='0 0 0.105'/><mass value='0.5'/><inertia ixx='0.00584' iyy='0.00184' izz='0.004' ixy='0' ixz='0' iyz='0'/></inertial>
  </link>
  <joint name='hinge' type='revolute'>
    <parent link='base'/><child link='lid'/><origin xyz='0.11 0 0.012'/><axis xyz='0 -1 0'/>
    <limit lower='-1.5' upper='1.5' effort='9' velocity='9'/><dynamics friction='0' damping='0'/>
  </joint>
</robot>
";

/// The lid hangs down (the base lies on its back), is pushed to a speed within 0.2 s, is let go, and swings until it rests.
fn push(folder: &Path, number: u64, speed: f64, [friction, damping]: [f64; 2]) {
    let bodies = UrdfBody::of(LAPTOP, Path::new("laptop.urdf")).expect("a URDF");
    let hinge = bodies[1].joint.clone().expect("a hinge");
    let base = Isometry3::new(Vector3::new(0.5, 0.1, 0.3), Vector3::x() * std::f64::consts::PI);
    let mut law = LoneJoint::new(&hinge, &bodies[1].mass, &base.rotation);
    (law.friction, law.damping) = (friction, damping);
    let mut random = rand_pcg::Pcg64::seed_from_u64(number);
    let (mut angle, mut rate) = (0.0, 0.0);
    let moments = (0..350).map(|row: u64| {
        if (50..70).contains(&row) {
            rate = speed * (row - 50) as f64 / 20.0;
            angle += 0.01 * rate;
        } else if row >= 70 {
            (angle, rate) = law.after((angle, rate), 0.01);
        }
        let mut noisy = |pose: Isometry3<f64>| {
            let mut drawn = || Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
            let place = pose.translation.vector + 1e-3 * drawn();
            let q = (pose.rotation * UnitQuaternion::from_scaled_axis(2e-3 * drawn())).into_inner();
            RigidPose { position: place.into(), wxyz: [q.w, q.i, q.j, q.k] }
        };
        let poses = vec![noisy(base), noisy(base * hinge.pose_at(angle))];
        let (targets, joints, drives) = (Vec::new(), Vec::new(), Vec::new());
        EpisodeMoment { time_ns: row * 10_000_000, poses, targets, joints, drives, gripper: None, arm: None }
    });
    let info = EpisodeInfo { task: "push".into(), seed: number, noise_m: 0.0, success: true, duration_s: 3.5 };
    let none = Vec::new;
    let bodies = vec!["laptop".to_owned(), "laptop_lid".to_owned()];
    let moments = moments.collect();
    let episode = Episode { info, bodies, moved: none(), joints: none(), driven: none(), object: None, moments };
    let place = Destination::new(&folder.join(format!("push_{number}.mcap")), false).expect("room");
    write_episode(place.begin().expect("room"), &ClipInfo::default(), &episode).expect("room");
}

/// A session of pushes with these speeds [rad/s].
pub(crate) fn session(speeds: &[f64]) -> tempfile::TempDir {
    let alike = |speed: &f64| (*speed, [FRICTION, DAMPING]);
    session_of(&speeds.iter().map(alike).collect::<Vec<_>>())
}

/// The same of pushes that each meet a friction and a damping of their own.
pub(crate) fn session_of(pushes: &[(f64, [f64; 2])]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let mut cell = "[[object]]\nname = \"laptop\"\nurdf = \"laptop.urdf\"\n".to_owned();
    for (number, (speed, numbers)) in pushes.iter().enumerate() {
        push(folder.path(), number as u64, *speed, *numbers);
        cell.push_str(&format!("[[clip]]\nfile = \"push_{number}.mcap\"\nkind = \"free_motion\"\n"));
    }
    fs::write(folder.path().join("laptop.urdf"), LAPTOP).expect("room");
    fs::write(folder.path().join("cell.toml"), cell).expect("room");
    folder
}
