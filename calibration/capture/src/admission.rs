//! Which arm may add clips to a session: one of the source that its clips have, unless they are to be mixed. Where a session has
//! clips, nobody guesses the arm.

use shared_mem::console;
use shared_mem::origin::Origin;
use shared_mem::recording::{Provenance, Session};
use shared_mem::typed;
use std::path::{Path, PathBuf};

/// Arm of a new session where none is named.
const DEFAULT_ARM: &str = "sim";

/// What a session has, and whether others may go beside it.
#[derive(Debug, Clone, Default)]
pub struct Admission {
    folder: PathBuf,
    /// Whether there are clips, also such as cannot be read.
    has_clips: bool,
    known: Provenance,
    mix: bool,
}

/// The clips of this arm do not go into this session.
#[derive(Debug, thiserror::Error)]
pub enum AdmissionError {
    /// Nobody said which arm.
    #[error("{} has clips of {origin}: say which arm records more, {remedy}", folder.display())]
    WhichArm {
        folder: PathBuf,
        /// Where its clips come from, in words.
        origin: String,
        /// The commands that say it.
        remedy: String,
    },
    /// They would be of another source.
    #[error(
        "clips of {new} do not go into {}, whose clips come from {known}: record into another --out, or mix them with `{command}`",
        folder.display()
    )]
    Mixed {
        /// Where the new clips would come from.
        new: Origin,
        folder: PathBuf,
        /// Where its clips come from, in words.
        known: String,
        /// The command that adds them all the same.
        command: String,
    },
}

impl Admission {
    /// To the session in `folder`, which need not be there; `mix`: of every arm.
    pub fn to(folder: &Path, mix: bool) -> Self {
        let session = Session::open(folder).ok();
        let known = session.as_ref().map_or_else(Provenance::default, Provenance::of);
        let unknown = known.unknown();
        if unknown > 0 {
            let said = if unknown == 1 { "1 clip does".to_owned() } else { format!("{unknown} clips do") };
            console::line(format_args!("{}: {said} not say where they come from", folder.display()));
        }
        Self { folder: folder.to_owned(), has_clips: session.is_some(), known, mix }
    }

    /// The arm that a bridge is started with: the one that is asked for; in a new session the simulation.
    ///
    /// # Errors
    /// [`AdmissionError::WhichArm`] where there are clips and no arm is named.
    pub fn arm<'a>(&self, asked: Option<&'a str>) -> Result<&'a str, AdmissionError> {
        match asked {
            Some(arm) => Ok(arm),
            None if !self.has_clips => Ok(DEFAULT_ARM),
            None => {
                let (folder, origin) = (self.folder.clone(), self.origin_in_words());
                Err(AdmissionError::WhichArm { folder, origin, remedy: self.commands() })
            }
        }
    }

    /// Whether clips of this origin may be added; of one that nobody knows, they may.
    ///
    /// # Errors
    /// [`AdmissionError::Mixed`] where they would be of another source than those that are there.
    pub fn admits(&self, new: Option<&Origin>) -> Result<(), AdmissionError> {
        match new {
            Some(new) if !self.mix && self.known.differs_from(new) => Err(AdmissionError::Mixed {
                new: new.clone(),
                folder: self.folder.clone(),
                known: self.known.to_string(),
                command: typed::with("--mix", false),
            }),
            _ => Ok(()),
        }
    }

    fn origin_in_words(&self) -> String {
        if self.known.is_unknown() { "unknown origin".to_owned() } else { self.known.to_string() }
    }

    /// What to type: the same with the arm of the clips, where a bridge drives it.
    fn commands(&self) -> String {
        if let Some(arm) = self.known.source().and_then(Origin::arm) {
            return format!("`{}`", typed::with(&format!("--arm {arm}"), false));
        }
        let mix = if self.known.is_unknown() { "" } else { " --mix" };
        let of = |arm: &str| typed::with(&format!("--arm {arm}{mix}"), false);
        format!(
            "`{}` for a robot, `{}` for the simulation; a new --out keeps its clips apart",
            of("fci://HOST"),
            of("sim")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::msg::arm::ArmState;
    use shared_mem::msg::origin::ArmOrigin;
    use shared_mem::recording::{ClipInfo, ClipWriter};

    /// A session with a clip of each of these arms.
    fn session(arms: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        let mut cell = "[robot]\nmodel = \"fr3\"\n".to_owned();
        for (number, arm) in arms.iter().enumerate() {
            let file = format!("clip_{number:02}.mcap");
            let mut writer = ClipWriter::create(&folder.path().join(&file), &ClipInfo::default()).expect("a new file");
            writer.arm_state(&ArmState { dof: 7, origin: ArmOrigin::new(arm), ..ArmState::default() }).expect("room");
            writer.finish().expect("room");
            cell += &format!("[[clip]]\nfile = \"{file}\"\nkind = \"excitation\"\n");
        }
        std::fs::write(folder.path().join("cell.toml"), cell).expect("room");
        folder
    }

    fn refused(admission: &Admission, arm: &str) -> String {
        admission.admits(arm.parse().ok().as_ref()).expect_err("another source").to_string()
    }

    #[test]
    fn a_new_session_begins_with_the_simulation_and_one_with_clips_has_no_default() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(Admission::to(&folder.path().join("new"), false).arm(None).ok(), Some("sim"));
        let empty = session(&[]);
        assert_eq!(Admission::to(empty.path(), false).arm(None).ok(), Some("sim"));
        for (arm, words, command) in [
            ("fci://172.16.0.2", "the robot at fci://172.16.0.2", "--arm fci://172.16.0.2`"),
            ("sim", "the simulation", "--arm sim`"),
            ("", "unknown origin", "--arm fci://HOST` for a robot"),
            ("replay://x.mcap", "a replay of x.mcap", "--arm sim --mix`"),
        ] {
            let of = session(&[arm]);
            let admission = Admission::to(of.path(), false);
            let why = admission.arm(None).expect_err("no default").to_string();
            assert!(why.contains(words) && why.contains(command) && why.lines().count() == 1, "{why}");
            assert_eq!(admission.arm(Some("sim")).ok(), Some("sim"));
        }
    }

    #[test]
    fn clips_of_another_arm_are_refused_unless_they_are_to_be_mixed() {
        let of = session(&["fci://172.16.0.2", ""]);
        let admission = Admission::to(of.path(), false);
        let why = refused(&admission, "sim");
        assert!(why.contains("clips of the simulation") && why.contains("fci://172.16.0.2"), "{why}");
        assert!(why.contains("--mix`") && why.lines().count() == 1, "{why}");
        assert!(refused(&admission, "fci://172.16.0.3").contains("fci://172.16.0.3"));
        admission.admits("fci://172.16.0.2".parse().ok().as_ref()).expect("the same robot");
        admission.admits(None).expect("nobody knows");
        Admission::to(of.path(), true).admits(Some(&Origin::Simulation)).expect("as asked for");
        let old = session(&[""]);
        Admission::to(old.path(), false).admits(Some(&Origin::Simulation)).expect("unknown does not block");
    }
}
