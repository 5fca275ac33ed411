//! A model file that is being written: its XML, what stands in it, and what its format has no key for.

use super::cell_model::{Arm, Joint};
use super::known::{Known, LeftOut, Line, number};
use twin::xml::Document;

/// Something in the joints: what, its unit, where it stands in a joint, and why it is left out.
pub(super) type Lacking = (&'static str, &'static str, fn(&Joint) -> &Known, &'static str);

pub(super) struct Sheet {
    pub(super) xml: Document,
    pub(super) lines: Vec<Line>,
    pub(super) left_out: Vec<LeftOut>,
}

impl Sheet {
    pub(super) fn new() -> Self {
        Self { xml: Document::new(), lines: Vec::new(), left_out: Vec::new() }
    }

    /// Notes a line that `key` holds, and gives its comment.
    pub(super) fn note(&mut self, key: &str, line: Line) -> String {
        let comment = line.comment(key);
        self.lines.push(line);
        comment
    }

    pub(super) fn lacks(&mut self, what: impl Into<String>, why: &str) {
        self.left_out.push(LeftOut { what: what.into(), why: why.into() });
    }

    /// Leaves out what is known of these in any joint, with the numbers of all.
    pub(super) fn lacks_in_joints(&mut self, arm: &Arm, lists: &[Lacking]) {
        for (what, unit, field, why) in lists {
            if arm.joints.iter().any(|joint| field(joint).is_known()) {
                let values = arm.joints.iter().map(|joint| number(field(joint).value)).collect::<Vec<_>>().join(", ");
                let unit = if *unit == "1" { String::new() } else { format!(" {unit}") };
                self.lacks(format!("{what} [{values}]{unit}"), why);
            }
        }
    }

    /// Leaves out what holds commands back, and the speed over which dry friction builds up.
    pub(super) fn lacks_in_time(&mut self, arm: &Arm, [commands, friction]: [&str; 2]) {
        for (what, known) in
            [("delay of commands", &arm.command_delay), ("time constant of the command's low-pass", &arm.command_lag)]
        {
            if known.is_known() {
                self.lacks(format!("{what} {} s", number(known.value)), commands);
            }
        }
        if arm.joints.iter().any(|joint| joint.dry.value > 0.0 && joint.creep > 0.0) {
            self.lacks("the speed over which dry friction builds up", friction);
        }
    }
}
