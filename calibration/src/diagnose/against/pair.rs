//! Whether two sessions can be held against each other, and their clips as those of one cell.

use inference::admit::torques::is_tracking;
use inference::admit::{Admitted, Refused, admit, by_command};
use shared_mem::cell::{Cell, ControllerKind, Object};
use shared_mem::recording::Session;
use twin::arm::ArmModel;

/// Clips of two sessions of one robot.
#[derive(Debug)]
pub struct Pair {
    /// Those of A, then those of B; groups hold clips of one command, of whichever session.
    pub admitted: Admitted,
    /// Index of B's first clip.
    pub first_of_b: usize,
}

/// Why two sessions cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum Unlike {
    /// One of them cannot be diagnosed at all.
    #[error("{0}: {1}")]
    One(String, Box<Refused>),
    /// Both are the same.
    #[error("{0} is given twice; give the session from before the change and the one from after it")]
    Same(String),
    /// What must be the same is not.
    #[error("{what}: {a} and {b} are not of one {kind}; what changed can be found only where all else is the same")]
    Other {
        /// What is compared: `robot`, `object`.
        kind: &'static str,
        /// What differs, in words.
        what: String,
        /// The first session.
        a: String,
        /// The second.
        b: String,
    },
}

/// Reads the clips of both.
///
/// # Errors
/// [`Unlike`] when they cannot be compared.
pub fn pair([a, b]: [&Session; 2]) -> Result<Pair, Unlike> {
    let [name_a, name_b] = [a, b].map(|session| session.folder.display().to_string());
    if a.folder == b.folder && a.clips == b.clips {
        return Err(Unlike::Same(name_a));
    }
    if let Some((kind, what)) = difference(&a.cell, &b.cell) {
        return Err(Unlike::Other { kind, what, a: name_a, b: name_b });
    }
    let of_a = admit(a).map_err(|why| Unlike::One(name_a.clone(), Box::new(why)))?;
    let of_b = admit(b).map_err(|why| Unlike::One(name_b.clone(), Box::new(why)))?;
    Ok(Pair::of([of_a, of_b], is_tracking(&a.cell), remarks([&a.cell, &b.cell])))
}

impl Pair {
    /// Of clips that were admitted already, with remarks on the cells. `tracking`: torques along the measured motion are compared.
    pub fn of([a, b]: [Admitted; 2], tracking: bool, remarks: Vec<String>) -> Self {
        let first_of_b = a.clips.len();
        let tagged =
            |tag: &str, texts: Vec<String>| texts.into_iter().map(|text| format!("{tag}{text}")).collect::<Vec<_>>();
        let strokes_in_one = a.with_object != b.with_object;
        let mut warnings = [remarks, tagged("A: ", a.warnings), tagged("B: ", b.warnings)].concat();
        if strokes_in_one {
            warnings.insert(
                0,
                "only one of the sessions has strokes of an object in all clips: what the arm does alone is compared"
                    .into(),
            );
        }
        let clips = [a.clips, b.clips].concat();
        let shifted = b.groups.iter().map(|group| group.iter().map(|clip| clip + first_of_b).collect());
        // A measured motion is no command: two of one command differ by noise.
        let groups = if tracking { a.groups.into_iter().chain(shifted).collect() } else { by_command(&clips) };
        let in_both = groups.iter().any(|group: &Vec<usize>| {
            group.iter().any(|clip| *clip < first_of_b) && group.iter().any(|clip| *clip >= first_of_b)
        });
        if !in_both && !tracking {
            warnings.push(
                "no command was played in both sessions: what the twin gets wrong in some motions alone may look like a change; play \
                 the same commands in both"
                    .into(),
            );
        }
        let files = [tagged("A/", a.files), tagged("B/", b.files)].concat();
        let with_object = a.with_object && b.with_object;
        let commands = groups.len();
        Self { admitted: Admitted { clips, files, groups, commands, with_object, warnings }, first_of_b }
    }
}

/// What must not differ and does, in words: whose it is, and what.
fn difference(a: &Cell, b: &Cell) -> Option<(&'static str, String)> {
    let arms = [a, b].map(|cell| ArmModel::from_cell(&Cell { tool: None, ..cell.clone() }));
    if let [Ok(one), Ok(other)] = &arms {
        if one.joint_names() != other.joint_names() {
            let names = |arm: &ArmModel| arm.joint_names().join(", ");
            return Some(("robot", format!("the joints are {} and {}", names(one), names(other))));
        }
        let ready = *one.ready();
        let differs = |x: f64, y: f64| (x - y).abs() > MAX_GRAVITY_DIFFERENCE * x.abs().max(y.abs()).max(1.0);
        if one.gravity(&ready).iter().zip(other.gravity(&ready)).any(|(x, y)| differs(*x, y)) {
            return Some(("robot", "the models weigh the joints differently".into()));
        }
    }
    let law = |cell: &Cell| cell.controller.as_ref().map(|controller| controller.kind);
    if law(a) != law(b) {
        let named = |cell| law(cell).and_then(ControllerKind::name).unwrap_or("none");
        return Some(("robot", format!("the control laws are {} and {}", named(a), named(b))));
    }
    let alike = |a: &Object, b: &Object| a.shape == b.shape && a.size == b.size && a.mass == b.mass;
    if a.object().zip(b.object()).is_some_and(|(one, other)| !alike(one, other)) {
        return Some(("object", "the objects' shapes, sizes or masses differ".into()));
    }
    None
}

/// Torques of gravity that differ by less than this share are those of one robot.
const MAX_GRAVITY_DIFFERENCE: f64 = 1e-3;

/// What is stated otherwise in the second cell.toml, and does not count.
fn remarks([a, b]: [&Cell; 2]) -> Vec<String> {
    let gains = |cell: &Cell| cell.controller.as_ref().map(|law| (law.stiffness.clone(), law.damping.clone()));
    let mut remarks = Vec::new();
    if gains(a) != gains(b) && !is_tracking(a) {
        remarks.push("the gains that cell.toml states differ: those of A count for both, so that what was stated shows as a change".into());
    }
    if a.tool != b.tool {
        remarks.push("the tools that cell.toml states differ: that of A counts for both".into());
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::super::super::test_bench::shipped;
    use super::*;
    use shared_mem::cell::Tool;
    use shared_mem::recording::SessionFiles;

    fn why(change: impl FnOnce(&mut Cell)) -> Option<String> {
        let (a, mut b) = (shipped(), shipped());
        change(&mut b);
        difference(&a, &b).map(|(kind, what)| format!("{kind}: {what}"))
    }

    #[test]
    fn another_law_and_another_object_are_refused_and_another_tool_or_gain_is_what_may_have_changed() {
        let law = why(|cell| cell.controller.as_mut().expect("a law").kind = ControllerKind::JointPd).expect("refused");
        assert!(law.contains("joint_impedance and joint_pd"), "{law}");
        let object = why(|cell| cell.object_mut().expect("an object").size = Some([0.1; 3])).expect("refused");
        assert!(object.starts_with("object: "), "{object}");
        let heavier = |cell: &mut Cell| cell.tool = Some(Tool { mass: 0.7, length: 0.16, radius: 0.012 });
        assert_eq!(why(heavier), None);
        let stiffer = |cell: &mut Cell| cell.controller.as_mut().expect("a law").stiffness[0] = 900.0;
        assert_eq!(why(stiffer), None);
        let (a, mut b) = (shipped(), shipped());
        heavier(&mut b);
        stiffer(&mut b);
        assert_eq!(remarks([&a, &b]).len(), 2);
    }

    #[test]
    fn a_session_is_not_held_against_itself() {
        let files = SessionFiles { session: "monday".into(), cell: None };
        let session = Session { folder: "monday".into(), cell: shipped(), clips: Vec::new(), files };
        let refused = pair([&session, &session]).expect_err("the same").to_string();
        assert!(refused.contains("monday is given twice") && !refused.contains('\n'), "{refused}");
    }
}
