//! What a page sends and is sent. docs/teleop.md has the formats.

use crate::arm::{Joints, MAX_JOINTS};
use crate::task::Jog;
use serde::{Deserialize, Serialize};

/// What a page asks for. All of it may be left out.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Input {
    /// A number that comes back with the first picture that this has had an effect on.
    #[serde(default)]
    pub(super) id: u64,
    /// Has the arm hold until an episode is started; whatever else the message asks for is left out then.
    #[serde(default)]
    pub(super) stop: bool,
    /// Counts for 0.2 s.
    pub(super) jog: Option<JogEntry>,
    /// Opens or closes the gripper.
    pub(super) fingers: Option<FingersEntry>,
    /// Begins or ends an episode.
    pub(super) episode: Option<EpisodeEntry>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JogEntry {
    #[serde(default)]
    along: [f64; 3],
    #[serde(default)]
    about: [f64; 3],
    joints: Option<Vec<f64>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum FingersEntry {
    Open,
    Close,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum EpisodeEntry {
    Start,
    /// Ends it and keeps it, success or not.
    Keep,
    /// Ends it and forgets it.
    Discard,
}

impl Input {
    /// Reads a message; else what is wrong with it, in a line.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let input: Self = serde_json::from_str(text)
            .map_err(|error| format!("not a message: {error}; docs/teleop.md has them").replace('\n', " "))?;
        let too_many = input.jog.as_ref().and_then(|jog| jog.joints.as_ref()).map_or(0, Vec::len);
        if too_many > MAX_JOINTS {
            return Err(format!("not a message: {too_many} joints in `jog`; give up to {MAX_JOINTS}"));
        }
        Ok(input)
    }
}

impl JogEntry {
    pub(super) fn jog(&self) -> Jog {
        match &self.joints {
            Some(shares) => {
                let mut joints: Joints = [0.0; MAX_JOINTS];
                joints.iter_mut().zip(shares).for_each(|(joint, share)| *joint = *share);
                Jog::Joints(joints)
            }
            None => Jog::Flange { along: self.along, about: self.about },
        }
    }
}

/// What a page is sent when it opens.
#[derive(Debug, Serialize)]
pub(super) struct Hello<'a> {
    pub(super) task: &'a str,
    pub(super) instruction: &'a str,
    /// What counts as success.
    pub(super) conditions: Vec<String>,
    pub(super) joints: &'a [String],
    /// Names, in the order of the poses of [`State::bodies`].
    pub(super) bodies: Vec<&'a str>,
    pub(super) gripper: bool,
    /// Where clips go; none where nothing is recorded.
    pub(super) record: Option<String>,
    /// Of the picture [pixel].
    pub(super) size: [u32; 2],
}

/// What goes with a picture.
#[derive(Debug, Clone, Serialize)]
pub(super) struct State {
    /// Newest input that had an effect.
    pub(super) id: u64,
    /// Simulated time of the episode [s].
    pub(super) time_s: f64,
    pub(super) seed: u64,
    /// Whether an episode is under way.
    pub(super) open: bool,
    /// Of each condition.
    pub(super) holds: Vec<bool>,
    pub(super) success: bool,
    /// Joints of the arm [rad].
    pub(super) q: Vec<f64>,
    /// Origin of the flange in the arm's base [m].
    pub(super) flange: [f64; 3],
    /// Position [m] and quaternion w, x, y, z of each body in the task's world.
    pub(super) bodies: Vec<[f64; 7]>,
    /// Between the fingers [m].
    pub(super) width: Option<f64>,
    pub(super) grasped: bool,
    /// Whether a stop was asked for, and nothing started since.
    pub(super) stopped: bool,
    /// Why the arm does not go where it is jogged.
    pub(super) held_by: Option<&'static str>,
    pub(super) kept: u64,
    pub(super) successes: u64,
    pub(super) discarded: u64,
    /// What was said last.
    pub(super) said: String,
}

/// A picture and its state as one binary message: length of the state (four bytes, little end first), the state as JSON, PNG.
pub(super) fn frame(state: &State, png: &[u8]) -> Vec<u8> {
    let json = serde_json::to_vec(state).unwrap_or_else(|_| b"{}".to_vec());
    let length = u32::try_from(json.len()).unwrap_or(0).to_le_bytes();
    [&length[..], &json, png].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_and_what_is_none_is_said_in_a_line() {
        let input = Input::read(r#"{"id": 4, "jog": {"along": [0.5, 0, 0]}}"#).expect("a message");
        assert_eq!(input.jog.map(|jog| jog.jog()), Some(Jog::Flange { along: [0.5, 0.0, 0.0], about: [0.0; 3] }));
        let input = Input::read(r#"{"jog": {"joints": [0, 1]}, "fingers": "close", "episode": "start"}"#).expect("one");
        let mut joints = [0.0; MAX_JOINTS];
        joints[1] = 1.0;
        assert_eq!(input.jog.map(|jog| jog.jog()), Some(Jog::Joints(joints)));
        assert_eq!((input.fingers, input.episode), (Some(FingersEntry::Close), Some(EpisodeEntry::Start)));
        assert!(!input.stop && Input::read(r#"{"stop": true}"#).expect("one").stop);
        for wrong in
            ["", "jog", "{\"fly\": 1}", "{\"episode\": \"end\"}", "{\"jog\": {\"joints\": [0,0,0,0,0,0,0,0,0]}}", "[]"]
        {
            let line = Input::read(wrong).expect_err(wrong);
            assert!(line.starts_with("not a message") && line.lines().count() == 1, "{line}");
        }
    }
}
