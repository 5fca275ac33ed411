//! What a log holds of a robot: its joints, its URDF, and the topics that carry measurements, commands and an object's pose. For
//! those who describe the cell that it was recorded in, without importing it.

use crate::error::ImportError;
use crate::propose::{Known, propose};
use crate::session::longest;
use crate::sources::Found;
use std::path::Path;

/// What a log holds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Contents {
    /// Name of the format.
    pub format: &'static str,
    /// The robot's URDF, where the log holds it: in a ROS 2 bag, what was published on `robot_description`.
    pub description: Option<String>,
    /// Names of the joints, in the order that they were measured in; empty where no arm was recorded.
    pub joints: Vec<String>,
    /// Topic, or table, of what the arm did.
    pub measured: Option<String>,
    /// Topic, or table, of what the arm was told.
    pub desired: Option<String>,
    /// Topic, or table, of the object's pose.
    pub object_pose: Option<String>,
}

/// Looks into the log at `path`; of several, into the longest.
///
/// # Errors
/// [`ImportError`] when there is no log that can be read, or none of a robot.
///
/// # Example
/// ```
/// use std::fmt::Write as _;
///
/// // A text table with a row each 10 ms: time, positions and commanded positions of three joints.
/// let mut text = String::from("time,q1,q2,q3,q_des1,q_des2,q_des3\n");
/// for row in 0..200 {
///     let t = 0.01 * f64::from(row); // s
///     let [now, next] = [t, t + 0.01].map(|t| format!("{},{},{}", t.sin(), 0.5 - t, 0.2 * t * t)); // rad
///     writeln!(text, "{t},{now},{next}")?;
/// }
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("log.csv");
/// std::fs::write(&file, text)?;
/// let contents = import::look(&file)?;
/// assert_eq!(contents.format, "text table");
/// assert!(contents.measured.is_some() && contents.desired.is_some() && contents.object_pose.is_none());
///
/// assert!(import::look(&folder.path().join("nothing.csv")).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn look(path: &Path) -> Result<Contents, ImportError> {
    let (mut found, mut logs) = (Found::at(&[path.to_owned()])?, Vec::new());
    for number in 0..found.len() {
        logs.extend(found.read(number)?.unwrap_or_default());
    }
    if logs.is_empty() {
        return Err(found.refusal());
    }
    let log = longest(&logs, path)?;
    let proposal = propose(log, Known::default(), &|_| None).map_err(|what| ImportError::log(path, what))?;
    let mapping = proposal.mapping;
    // A second publisher on a topic is a table of its own, behind a colon.
    let topic = |table: &str| table.split(':').next().unwrap_or(table).to_owned();
    let joints = |columns: Option<crate::JointColumns>| {
        columns.filter(|columns| !columns.q.is_empty()).map(|columns| topic(&columns.table))
    };
    Ok(Contents {
        format: log.format,
        description: log.facts.description.clone(),
        joints: mapping.joints.clone(),
        measured: joints(mapping.measured),
        desired: joints(mapping.desired),
        object_pose: mapping.object.map(|columns| topic(&columns.table)),
    })
}
