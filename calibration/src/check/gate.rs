//! What `diagnose` and `identify` take from the doctor of a recording: the worst remark, and the end of what makes no sense.

use super::remark::{Remark, Severity};
use super::session::{Found, Read, check_clips};
use shared_mem::console;
use shared_mem::recording::Session;
use shared_mem::typed::{self, Command};

/// The data cannot mean what they say.
#[derive(Debug, thiserror::Error)]
#[error("{remark}: the data cannot mean what they say; `{check}` shows it, `{command}` goes on all the same")]
pub struct Stopped {
    check: Command,
    remark: String,
    command: String,
}

/// Looks at a session before it is explained: its worst remark, which is said on the console as well; none where there is
/// nothing to remark.
///
/// # Errors
/// [`Stopped`] when the data cannot mean what they say, unless they are to be taken `as_recorded`.
pub fn look(session: &Session, as_recorded: bool) -> Result<Option<Remark>, Stopped> {
    // Clips that cannot be read are left out by the verbs, and said to be.
    let Found { remarks, .. } = check_clips(&session.cell, &Read::of(session).clips);
    let Some(worst) = remarks.into_iter().next() else { return Ok(None) };
    let check = session.files.command("calibration check");
    if worst.severity == Severity::Wrong && !as_recorded {
        let remark = format!("{}: {}", worst.clips_in_words(), worst.what);
        return Err(Stopped { check, remark, command: typed::with("--as-recorded", false) });
    }
    console::line(format_args!("warning: {worst} (`{check}` shows all that is odd)"));
    Ok(Some(worst))
}

/// Adds the worst remark to the warnings of an answer, unless they say it already.
pub fn add(warnings: &mut Vec<String>, worst: Option<&Remark>) {
    if let Some(remark) = worst
        && !warnings.iter().any(|warning| warning.contains(&remark.what))
    {
        warnings.insert(0, remark.to_string());
    }
}
