//! The questions of `calibration init` on a terminal, one a line. An empty answer leaves the key open, where it may stay so; one
//! that cannot be used is asked again.

use super::facts::{Facts, Named, controller, edges, gains, height, tool};
use std::io;

/// Asks everything that a person may know. `answer` shows a text and gives the line that is typed; `None` at the end of input.
///
/// # Errors
/// When input ends or cannot be read.
pub fn ask(answer: &mut dyn FnMut(&str) -> io::Result<Option<String>>) -> io::Result<Facts> {
    let mut asking = Asking { answer };
    let robot = asking
        .needed("Robot: fr3, the path of a .urdf or .xacro file, or its joints' names with commas", Named::parse)?;
    let kind = asking.open("Controller: joint_impedance, or joint_pd for a servo", controller)?;
    Ok(Facts {
        robot: Some(robot),
        joints: Vec::new(),
        controller: kind,
        stiffness: asking.open("Stiffness [N m/rad], one a joint with commas", gains)?.unwrap_or_default(),
        damping: asking.open("Damping [N m s/rad], one a joint with commas", gains)?.unwrap_or_default(),
        tool: asking.open("Tool: mass [kg], length [m], radius [m]", tool)?,
        table: asking.open("Height of the table in the base frame [m]", height)?,
        object: asking.open("Object: edge lengths x,y,z of a box [m]", edges)?,
    })
}

struct Asking<'a> {
    answer: &'a mut dyn FnMut(&str) -> io::Result<Option<String>>,
}

impl Asking<'_> {
    fn needed<T>(&mut self, question: &str, parse: fn(&str) -> Result<T, String>) -> io::Result<T> {
        let mut text = format!("{question}:");
        loop {
            match parse(&self.line(&text)?) {
                Ok(value) => return Ok(value),
                Err(why) => text = format!("  {why}:"),
            }
        }
    }

    fn open<T>(&mut self, question: &str, parse: fn(&str) -> Result<T, String>) -> io::Result<Option<T>> {
        let mut text = format!("{question} (Enter: not known):");
        loop {
            let line = self.line(&text)?;
            if line.trim().is_empty() {
                return Ok(None);
            }
            match parse(&line) {
                Ok(value) => return Ok(Some(value)),
                Err(why) => text = format!("  {why} (Enter: not known):"),
            }
        }
    }

    fn line(&mut self, text: &str) -> io::Result<String> {
        let line = (self.answer)(text)?;
        line.ok_or_else(|| io::Error::new(io::ErrorKind::UnexpectedEof, "input ended before the last answer"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::ControllerKind;

    fn answered(lines: &[&str]) -> (io::Result<Facts>, usize) {
        let (mut lines, mut asked) = (lines.iter(), 0);
        let facts = ask(&mut |_| {
            asked += 1;
            Ok(lines.next().map(|&line| line.to_owned()))
        });
        (facts, asked)
    }

    #[test]
    fn an_empty_answer_leaves_a_key_open_and_a_wrong_one_is_asked_again() {
        let (facts, asked) = answered(&[
            "",
            "ur5",
            "a, b",
            "pd",
            "joint_pd",
            "10,x",
            "10,20",
            "",
            "0.2,0.1,0.2",
            "0.2,0.1,0.01",
            "",
            "",
        ]);
        let facts = facts.expect("all is answered");
        assert_eq!(asked, 12);
        assert_eq!(facts.robot, Some(Named::Joints(vec!["a".into(), "b".into()])));
        assert_eq!((facts.controller, facts.stiffness), (Some(ControllerKind::JointPd), vec![10.0, 20.0]));
        assert_eq!((facts.damping, facts.tool), (vec![], Some([0.2, 0.1, 0.01])));
        assert_eq!((facts.table, facts.object), (None, None));
    }

    #[test]
    fn the_end_of_input_is_an_error() {
        assert!(answered(&["fr3", "joint_pd"]).0.is_err());
    }
}
