//! Which kind of clip a file or folder is, and reading it.

use super::clip::Clip;
use super::container::Messages;
use super::error::ReadError;
use super::messages::is_own;
use super::tracked::ObjectTopics;
use super::wire::Wire;
use super::{bag, controller_log, own, twinaligner};
use crate::cell::{Cell, ClipKind};
use crate::msg::object::ObjectPose;
use std::path::Path;

/// Reads a clip; finds out itself whether it is an own recording, a ROS 2 bag or a TwinAligner folder.
///
/// # Errors
/// [`ReadError`] when the file is missing, is of no known kind, lacks a topic that `cell` and `kind` ask for, lacks a
/// joint, or more than 1 % of its rows cannot be used. A cut or partly changed file is no error: see [`Clip::damage`].
pub fn read_clip(path: &Path, kind: ClipKind, cell: &Cell) -> Result<Clip, ReadError> {
    Ok(controller_log::in_positions_and_torques(as_logged(path, kind, cell)?, cell))
}

/// The same where only the arm's measured joints are wanted: neither commands nor objects have to be there.
///
/// # Errors
/// As [`read_clip`], for the measured joints alone.
pub(super) fn read_measured(path: &Path, kind: ClipKind, cell: &Cell) -> Result<Clip, ReadError> {
    if path.is_file() {
        let mut messages = Messages::open(path)?;
        let own = own::is_own(&messages) || messages.peek()?.is_some_and(|message| is_own(message.channel));
        if !own {
            return bag::measured(path, messages, cell);
        }
    }
    read_clip(path, kind, cell)
}

/// A clip in the quantities that were logged.
fn as_logged(path: &Path, kind: ClipKind, cell: &Cell) -> Result<Clip, ReadError> {
    if path.is_dir() {
        if twinaligner::is_clip_folder(path) {
            return twinaligner::read(path, kind, cell);
        }
        let what = "is a folder without control.json and frame.json; give a clip file or a TwinAligner folder";
        return Err(ReadError::kind(path, what));
    }
    let mut messages = Messages::open(path)?;
    let own = messages.peek()?.is_some_and(|message| is_own(message.channel));
    // What stands before the first message says whose it is, too: also where no message follows, or one of ROS is the first.
    if own || own::is_own(&messages) {
        own::read(path, messages, kind, cell)
    } else {
        bag::read(path, messages, kind, cell)
    }
}

/// Whether poses of an object were recorded in a clip; read up to the first of them.
///
/// # Errors
/// [`ReadError`] when the file is missing or of no known kind.
pub(super) fn shows_object(path: &Path, cell: &Cell) -> Result<bool, ReadError> {
    if path.is_dir() {
        return Ok(twinaligner::is_clip_folder(path));
    }
    let (mut messages, topics) = (Messages::open(path)?, ObjectTopics::ros2(cell));
    while let Some(message) = messages.next()? {
        if message.channel.type_name() == ObjectPose::SCHEMA || topics.wants(&message.channel.topic) {
            return Ok(true);
        }
    }
    Ok(false)
}
