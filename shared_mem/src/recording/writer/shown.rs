//! What own clips show viewers of a robot beside what was recorded of it: its description, its frames as it moves, the camera's,
//! and the twin's frames behind `twin/`. Readers here do without: everything in it follows from states and cell.toml.

use super::super::cdr::CdrWriter;
use super::super::definitions::definition;
use super::super::robot::{ROBOT_DESCRIPTION, RobotModel, TF, TF_STATIC, Transform};
use super::super::ros2;
use super::super::wire::{UnixClock, proto::foxglove};
use super::{ClipWriter, WriteError};
use crate::cell::Cell;
use std::io::Write;
use std::sync::Arc;

/// Least time between two messages of an arm's frames [ns]: fifty a second, a twentieth of what its states take.
const FRAMES_NS: u64 = 20_000_000;
/// Frame of pictures and of `/camera/info`.
const CAMERA: &str = "camera";
/// Before the names of the twin's frames.
const TWIN: &str = "twin/";
const SCHEMA: &str = "foxglove.FrameTransforms";

/// Whose joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Whose {
    Real = 0,
    Twin = 1,
}

/// The robot that a clip shows.
#[derive(Debug)]
pub(super) struct Shown {
    robot: Arc<RobotModel>,
    /// Names of the joints in the order of the states.
    names: Vec<String>,
    /// Frames that stay where they are.
    fixed: Vec<Transform>,
    /// When the arm's and the twin's frames were written last [ns].
    written_ns: [Option<u64>; 2],
}

impl<W: Write> ClipWriter<W> {
    /// From here on shows this robot, whose joints stand under these names in the states, and where `cell` has its camera.
    pub fn show(&mut self, robot: &Arc<RobotModel>, names: &[String], cell: &Cell) {
        let fixed = robot.fixed.iter().cloned().chain(Transform::of_camera(cell, CAMERA)).collect();
        self.shown = Some(Shown { robot: Arc::clone(robot), names: names.to_vec(), fixed, written_ns: [None; 2] });
    }

    /// Writes the frames that are due with joints at `q` [rad].
    pub(super) fn show_joints(&mut self, whose: Whose, stamp_ns: u64, q: &[f64]) -> Result<(), WriteError> {
        let Some(mut shown) = self.shown.take() else { return Ok(()) };
        let shows = self.show_with(&mut shown, whose, stamp_ns, q);
        self.shown = Some(shown);
        shows
    }

    fn show_with(&mut self, shown: &mut Shown, whose: Whose, stamp_ns: u64, q: &[f64]) -> Result<(), WriteError> {
        let last = shown.written_ns[whose as usize];
        if last.is_some_and(|last| stamp_ns < last.saturating_add(FRAMES_NS)) {
            return Ok(());
        }
        let Some(mut moving) = (shown.robot.frames_at)(&shown.names, q) else { return Ok(()) };
        let clock = self.clock;
        if whose == Whose::Twin {
            moving.iter_mut().for_each(of_twin);
        }
        if last.is_none() {
            self.begin_showing(shown, whose, stamp_ns)?;
        }
        shown.written_ns[whose as usize] = Some(stamp_ns);
        self.named(TF, SCHEMA, stamp_ns, &message(clock, stamp_ns, &moving))
    }

    /// What a viewer is told once; frames that stay are told together, because the last message alone is found by one that
    /// jumps to the middle.
    fn begin_showing(&mut self, shown: &mut Shown, whose: Whose, stamp_ns: u64) -> Result<(), WriteError> {
        if whose == Whose::Twin {
            let mut twins = shown.robot.fixed.clone();
            twins.iter_mut().for_each(of_twin);
            twins.push(Transform::same(&shown.robot.root, &format!("{TWIN}{}", shown.robot.root)));
            shown.fixed.extend(twins);
        }
        if shown.written_ns == [None; 2] {
            let definition = definition(ros2::TEXT);
            let schema = (ros2::TEXT, "ros2msg", definition.as_bytes());
            self.open(ROBOT_DESCRIPTION, schema, "cdr").map_err(|error| self.failed(&error))?;
            self.scratch = CdrWriter::default().text(&shown.robot.description).message();
            self.put(ROBOT_DESCRIPTION, ros2::TEXT, stamp_ns).map_err(|error| self.failed(&error))?;
        }
        if shown.fixed.is_empty() {
            return Ok(());
        }
        self.named(TF_STATIC, SCHEMA, stamp_ns, &message(self.clock, stamp_ns, &shown.fixed))
    }
}

fn of_twin(frame: &mut Transform) {
    frame.parent.insert_str(0, TWIN);
    frame.child.insert_str(0, TWIN);
}

fn message(clock: UnixClock, stamp_ns: u64, frames: &[Transform]) -> foxglove::FrameTransforms {
    let of = |frame: &Transform| {
        let ([x, y, z], [qw, qx, qy, qz]) = (frame.position, frame.wxyz);
        foxglove::FrameTransform {
            timestamp: clock.timestamp(stamp_ns),
            parent_frame_id: frame.parent.clone(),
            child_frame_id: frame.child.clone(),
            translation: Some(foxglove::Vector3 { x, y, z }),
            rotation: Some(foxglove::Quaternion { x: qx, y: qy, z: qz, w: qw }),
        }
    };
    foxglove::FrameTransforms { transforms: frames.iter().map(of).collect() }
}

#[cfg(test)]
mod tests {
    use super::super::ClipInfo;
    use super::*;
    use crate::cell::ClipKind;
    use crate::msg::arm::ArmState;
    use crate::msg::joints_from;
    use crate::msg::twin::TwinState;
    use crate::recording::{Clip, RawMessages, read_clip};
    use prost::Message as _;
    use std::path::Path;

    const CELL: &str = "[robot]\njoints = [\"a\"]\nbase_frame = \"base\"\n[camera]\n";
    const ROWS: u64 = 1000;

    fn frame(parent: &str, child: &str, x: f64) -> Transform {
        Transform { position: [x, 0.0, 0.0], ..Transform::same(parent, child) }
    }

    /// A second of an arm and of its twin; a clip is written with and without showing it.
    fn record(path: &Path, shows: bool) -> Clip {
        let cell = Cell::parse(CELL, Path::new("cell.toml")).expect("a cell");
        let robot = RobotModel {
            description: "<robot name='r'/>".into(),
            root: "base".into(),
            joints: vec!["a".into()],
            fixed: vec![frame("a", "tip", 0.1)],
            frames_at: Box::new(|names, q| (names == ["a"]).then(|| vec![frame("base", "a", q[0])])),
        };
        let mut writer = ClipWriter::create(path, &ClipInfo::default()).expect("a new file");
        if shows {
            let robot = Arc::new(robot);
            writer.show(&robot, &robot.joints, &cell);
        }
        for k in 0..ROWS {
            let (stamp_ns, q) = (9_000_000_000 + k * 1_000_000, joints_from(&[1e-3 * k as f64]));
            let state = ArmState { stamp_ns, device_ns: stamp_ns, dof: 1, q, q_d: q, ..ArmState::default() };
            writer.arm_state(&state).expect("room");
            if k >= ROWS / 2 {
                writer.twin_state(&TwinState { stamp_ns, dof: 1, q, ..TwinState::default() }).expect("room");
            }
        }
        writer.finish().expect("room");
        read_clip(path, ClipKind::Excitation, &cell).expect("a clip")
    }

    #[test]
    fn viewers_see_a_robot_that_moves_and_readers_see_the_same_clip_as_without() {
        let folder = tempfile::tempdir().expect("a folder");
        let [shown, plain] = ["shown.mcap", "plain.mcap"].map(|name| folder.path().join(name));
        let (with, without) = (record(&shown, true), record(&plain, false));
        assert_eq!(Clip { file: plain, ..with }, without);

        let mut messages = RawMessages::open(&shown).expect("a clip");
        let (mut topics, mut moving, mut fixed) = (Vec::new(), Vec::new(), Vec::new());
        while let Some(message) = messages.read_next().expect("a message") {
            topics.push(message.topic.to_owned());
            let frames = || foxglove::FrameTransforms::decode(message.data).expect("frames").transforms;
            match message.topic {
                TF => moving.extend(frames()),
                TF_STATIC => fixed.push(frames()),
                ROBOT_DESCRIPTION => {
                    assert_eq!(message.type_name, "std_msgs/msg/String");
                    assert!(message.data.ends_with(b"<robot name='r'/>\0"));
                }
                _ => {}
            }
        }
        // What is no message of ours is never the first one.
        assert_eq!(topics[0], "/arm/state");
        assert_eq!(topics.iter().filter(|topic| *topic == ROBOT_DESCRIPTION).count(), 1);
        // Fifty a second, of the twin for half of it.
        let of = |child: &str| moving.iter().filter(|frame| frame.child_frame_id == child).collect::<Vec<_>>();
        assert_eq!((of("a").len(), of("twin/a").len()), (50, 25));
        let x = |frame: &foxglove::FrameTransform| frame.translation.map(|t| t.x);
        assert_eq!((x(of("a")[1]), x(of("twin/a")[0])), (Some(0.02), Some(0.5)));
        assert_eq!(of("twin/a")[0].parent_frame_id, "twin/base");
        // The last one holds all of them.
        let children = |frames: &[foxglove::FrameTransform]| -> Vec<String> {
            frames.iter().map(|frame| frame.child_frame_id.clone()).collect()
        };
        assert_eq!(
            fixed.iter().map(|frames| children(frames)).collect::<Vec<_>>(),
            [vec!["tip", "camera"], vec!["tip", "camera", "twin/tip", "twin/base"]]
        );
    }
}
