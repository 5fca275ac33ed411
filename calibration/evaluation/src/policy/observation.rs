//! What a policy sees and how its answer is read.
//!
//! | key | what |
//! |---|---|
//! | `observation/state` | `[n]` float32: as `observation.state` of exported demonstrations |
//! | `observation/environment_state` | `[n]` float32: free bodies and joints without a drive; on a robot nobody knows it |
//! | `observation/joint_position` | `[7]` float32, rad |
//! | `observation/end_effector_pose` | `[7]` float32: x, y, z [m], w, x, y, z of the flange in the arm's base |
//! | `observation/gripper_width` | `[1]` float32, m |
//! | `observation/gripper_position` | `[1]` float32: 0 open, 1 closed |
//! | `observation/image/CAMERA` | `[rows, columns, 3]` uint8 |
//! | `observation/depth/CAMERA` | `[rows, columns]` uint16, mm along the camera's axis, 0 where nothing is |
//! | `prompt` | text: what is to be done |

use super::packed::{array, floats};
use rmpv::Value;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::recording::EpisodeMoment;
use std::collections::BTreeMap;
use twin::task::{Action, Numbers, Signs, Task, TaskPicture};

/// Other names for some keys, as a policy was trained with.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Keys(BTreeMap<String, String>);

impl Keys {
    /// Of pairs `OURS=THEIRS`; ours without or with `observation/`.
    ///
    /// # Errors
    /// The pair that is none, or whose first half is no key, with the keys there are.
    pub fn read(pairs: &[String], task: &Task) -> Result<Self, String> {
        let mut known: Vec<String> =
            ["state", "environment_state", "joint_position", "end_effector_pose", "gripper_width", "gripper_position"]
                .map(str::to_owned)
                .to_vec();
        for camera in task.cameras() {
            known.extend(["image", "depth"].map(|kind| format!("{kind}/{}", camera.name)));
        }
        known.push("prompt".to_owned());
        let mut keys = BTreeMap::new();
        for pair in pairs {
            let (ours, theirs) = pair.split_once('=').unwrap_or((pair, ""));
            let ours = ours.strip_prefix("observation/").unwrap_or(ours);
            if theirs.is_empty() || !known.iter().any(|key| key == ours) {
                return Err(format!("`{pair}` is no OURS=THEIRS; ours are {}", known.join(", ")));
            }
            keys.insert(ours.to_owned(), theirs.to_owned());
        }
        Ok(Self(keys))
    }

    fn of(&self, ours: &str) -> Value {
        let own = || if ours == "prompt" { ours.to_owned() } else { format!("observation/{ours}") };
        self.0.get(ours).cloned().unwrap_or_else(own).into()
    }
}

/// What the numbers of an action mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ActionKind {
    /// The `action` of exported demonstrations.
    #[default]
    Recorded,
    /// Joints of the arm [rad], then the gripper where there is one: 0 open, 1 closed.
    Joints,
}

impl ActionKind {
    /// An action out of its numbers.
    ///
    /// # Errors
    /// How many there have to be, or which is none.
    pub fn read(self, task: &Task, numbers: &Numbers, values: &[f32]) -> Result<Action, String> {
        if self == Self::Recorded {
            return numbers.read(values);
        }
        let (dof, range) = (task.arm_joints().len(), task.gripper_range());
        let wanted = dof + usize::from(range.is_some());
        if dof == 0 {
            return Err("the task has no arm, whose joints an action could name; give --actions recorded".into());
        }
        if values.len() != wanted || values.iter().any(|value| !value.is_finite()) {
            return Err(format!("an action is {wanted} numbers, {dof} joints first, not {values:?}"));
        }
        let mut joints = [0.0; MAX_JOINTS];
        joints.iter_mut().zip(&values[..dof]).for_each(|(joint, value)| *joint = f64::from(*value));
        let width = range.map(|[closed, open]| open + f64::from(values[dof]).clamp(0.0, 1.0) * (closed - open));
        Ok(Action { joints: Some(joints), width, ..Action::default() })
    }
}

/// What is seen at one moment.
#[derive(Debug)]
pub struct Seen<'a> {
    /// The task.
    pub task: &'a Task,
    /// Its numbers.
    pub numbers: &'a Numbers,
    /// What is.
    pub now: &'a EpisodeMoment,
    /// Whether free bodies are known where they are, as in a simulation.
    pub surroundings: bool,
    /// One of each camera, in the task's order; a camera without one is left out.
    pub pictures: Vec<Option<TaskPicture>>,
}

impl Seen<'_> {
    /// As a message; `signs` go on from the message before.
    pub fn message(&self, keys: &Keys, signs: &mut Signs) -> Value {
        let mut message = Vec::new();
        let mut put = |key: &str, values: &[f32]| {
            if !values.is_empty() {
                message.push((keys.of(key), floats(&[values.len()], values)));
            }
        };
        put("state", &self.numbers.state(self.now, signs));
        if self.surroundings {
            put("environment_state", &self.numbers.surroundings(self.now, signs));
        }
        if let Some(arm) = &self.now.arm {
            put("joint_position", &arm.q[..self.task.arm_joints().len()].iter().map(|q| *q as f32).collect::<Vec<_>>());
            put("end_effector_pose", &flange(&arm.O_T_EE));
        }
        if let (Some(gripper), Some([closed, open])) = (&self.now.gripper, self.task.gripper_range()) {
            put("gripper_width", &[gripper.width as f32]);
            put("gripper_position", &[((open - gripper.width) / (open - closed)).clamp(0.0, 1.0) as f32]);
        }
        for (camera, picture) in self.task.cameras().iter().zip(&self.pictures) {
            let Some(picture) = picture else { continue };
            let [columns, rows] = camera.size.map(|pixels| pixels as usize);
            let depth = picture.depth.iter().flat_map(|depth| depth.to_le_bytes()).collect();
            message.push((
                keys.of(&format!("image/{}", camera.name)),
                array("|u1", &[rows, columns, 3], picture.colour.clone()),
            ));
            message.push((keys.of(&format!("depth/{}", camera.name)), array("<u2", &[rows, columns], depth)));
        }
        message.push((keys.of("prompt"), self.task.instruction().into()));
        Value::Map(message)
    }
}

/// Position and quaternion w, x, y, z of a column-major transformation.
fn flange(transformation: &[f64; 16]) -> [f32; 7] {
    let turn = nalgebra::Matrix3::from_fn(|row, column| transformation[4 * column + row]);
    let turn = nalgebra::UnitQuaternion::from_matrix(&turn);
    let [x, y, z] = [12, 13, 14].map(|i| transformation[i] as f32);
    [x, y, z, turn.w as f32, turn.i as f32, turn.j as f32, turn.k as f32]
}
