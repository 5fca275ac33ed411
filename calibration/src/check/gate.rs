//! What `diagnose` and `identify` take from the doctor of a recording: where it comes from, the worst remark, and the end of what
//! makes no sense.

use super::origins;
use super::remark::{Fault, Remark, Severity};
use super::session::{Found, Read, check_clips};
use shared_mem::console;
use shared_mem::recording::{Provenance, Session};
use shared_mem::typed::{self, Command};

/// What is taken all the same, because a person said so.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Allowed {
    /// Data that cannot mean what they say.
    pub as_recorded: bool,
    /// Clips of several sources.
    pub mix: bool,
    /// Commands that nobody gave: torques are explained without commands.
    pub copied_commands: bool,
}

/// What was seen in a session before it is explained.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Looked {
    /// The worst remark; none where there is nothing to remark.
    pub worst: Option<Remark>,
    /// Where its clips come from.
    pub provenance: Provenance,
}

/// The data are not to be explained as they are.
#[derive(Debug, thiserror::Error)]
pub enum Stopped {
    /// They cannot mean what they say.
    #[error("{remark}: the data cannot mean what they say; `{check}` shows it, `{command}` goes on all the same")]
    Wrong {
        /// What shows it.
        check: Command,
        /// What is wrong.
        remark: String,
        /// What goes on all the same.
        command: String,
    },
    /// They are of several cells.
    #[error("{what}: they are not explained together unasked; `{command}` takes them together")]
    Mixed {
        /// Which come from where.
        what: String,
        /// What takes them together.
        command: String,
    },
}

/// Looks at a session before it is explained. Its worst remark is said on the console as well, and that clips do not say where they
/// come from.
///
/// # Errors
/// [`Stopped`] when the data cannot mean what they say, or come from several sources, unless that is `allowed`.
pub fn look(session: &Session, allowed: Allowed) -> Result<Looked, Stopped> {
    // Clips that cannot be read are left out by the verbs, and said to be.
    let clips = Read::of(session).clips;
    let provenance = origins::provenance(&clips);
    unmixed(&provenance, allowed.mix)?;
    let Found { remarks, .. } = check_clips(&session.cell, &clips);
    // The one is what was asked for, and said at once; the other is of no use for what was asked.
    let unused = |fault: Fault| allowed.copied_commands && fault == Fault::CopiedCommands;
    let worst = remarks.into_iter().find(|remark| remark.fault != Fault::MixedOrigins && !unused(remark.fault));
    if let Some(worst) = &worst {
        let check = session.files.command("calibration check");
        if worst.severity == Severity::Wrong && !allowed.as_recorded {
            let remark = format!("{}: {}", worst.clips_in_words(), worst.what);
            return Err(Stopped::Wrong { check, remark, command: typed::with("--as-recorded", false) });
        }
        console::line(format_args!("warning: {worst} (`{check}` shows all that is odd)"));
    }
    if provenance.unknown() > 0 {
        let (count, session) = (provenance.unknown(), session.folder.display());
        console::line(format_args!("{session}: {count} of {} clips do not say where they come from", clips.len()));
    }
    Ok(Looked { worst, provenance })
}

/// Whether clips are to be explained together.
///
/// # Errors
/// [`Stopped::Mixed`] where they come from several sources, unless that is to be so (`mix`).
pub fn unmixed(provenance: &Provenance, mix: bool) -> Result<(), Stopped> {
    let Some(mixture) = provenance.mixture() else { return Ok(()) };
    let what = format!("the clips come from several cells ({mixture})");
    if !mix {
        return Err(Stopped::Mixed { what, command: typed::with("--mix", false) });
    }
    console::line(format_args!("warning: {what}, and are taken together"));
    Ok(())
}

/// Adds the worst remark to the warnings of an answer, unless they say it already.
pub fn add(warnings: &mut Vec<String>, looked: &Looked) {
    let mixture = looked.provenance.mixture();
    warnings.splice(0..0, mixture.map(|mixture| format!("the clips come from several cells ({mixture})")));
    if let Some(remark) = &looked.worst
        && !warnings.iter().any(|warning| warning.contains(&remark.what))
    {
        warnings.insert(0, remark.to_string());
    }
}
