//! The robot's URDF: a file, a xacro file that the program `xacro` expands, or the text that a bag holds.

use anyhow::{Context as _, bail, ensure};
use shared_mem::{child_output, input, printable};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use twin::arm::{ArmModel, with_files_found_from};

/// A URDF that was read and is an arm.
pub(super) struct Description {
    /// The file that cell.toml names.
    pub(super) path: PathBuf,
    /// What is to be written there; `None` where the file is there.
    pub(super) text: Option<String>,
    pub(super) arm: ArmModel,
}

impl Description {
    /// Of a file; what xacro makes of it goes beside the cell.toml `out`. `joints` say which of its joints are the arm's, where they are
    /// given.
    pub(super) fn of_file(file: &Path, out: &Path, joints: &[String]) -> anyhow::Result<Self> {
        if file.extension().is_some_and(|end| end == "xacro") {
            let text = expanded(file)?;
            let arm = ArmModel::from_urdf(&text, file, joints)?;
            let text = with_files_found_from(&text, file, out)?;
            return Ok(Self { path: out.with_extension("urdf"), text: Some(text), arm });
        }
        let text = input::text(file, input::Kind::Robot)?;
        let arm = ArmModel::from_urdf(&text, file, joints)?;
        Ok(Self { path: file.to_owned(), text: None, arm })
    }

    /// Of a text, which goes beside the cell.toml `out`.
    pub(super) fn of_text(text: String, out: &Path) -> anyhow::Result<Self> {
        let path = out.with_extension("urdf");
        let arm = ArmModel::from_urdf(&text, &path, &[])?;
        Ok(Self { path, text: Some(text), arm })
    }
}

/// A description that is longer than a file of one may be is none [bytes].
const LONGEST: u64 = 16 << 20;

/// What `xacro` makes of a file.
fn expanded(file: &Path) -> anyhow::Result<String> {
    ensure!(file.is_file(), "there is no {}; give an existing .xacro or .urdf file", file.display());
    let shown = file.display();
    let output = match child_output::of(Command::new("xacro").arg(file), LONGEST) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => bail!(
            "{shown} is a xacro file, and no program `xacro` is installed; where ROS is: `xacro {shown} > arm.urdf`, and give that"
        ),
        output => output.with_context(|| format!("`xacro {shown}` cannot be started"))?,
    };
    if !output.status.success() {
        let last = if output.last_words.is_empty() { "it says nothing" } else { &output.last_words };
        bail!("`xacro {shown}` failed: {}; expand it by hand and give the .urdf", printable::one_line(last));
    }
    let text = output.answer.with_context(|| {
        format!("`xacro {shown}` gave more than {} MiB, which is no robot; look what it includes", LONGEST >> 20)
    })?;
    String::from_utf8(text).with_context(|| format!("`xacro {shown}` gave no text"))
}
