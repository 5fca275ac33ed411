//! What of a name tells a column from its neighbours, and the unit that it names.

use super::words;
use super::words::{BEFORE_ENDINGS, DESIRED, ENDINGS, MEASURED, TORQUE, VELOCITY};

/// A unit that a name may name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    Radian,
    Degree,
    Turn,
    Millimetre,
    Metre,
    /// Of a velocity.
    Rate,
    /// Of a torque.
    NewtonMetre,
    /// Of something else: of time, of a current, of a force.
    Other,
}

/// What units are called in brackets.
const BRACKETED: [(&[&str], Unit); 8] = [
    (&["rad", "radian", "radians"], Unit::Radian),
    (&["deg", "degree", "degrees", "°", "grad"], Unit::Degree),
    (&["turn", "turns", "rev", "revs"], Unit::Turn),
    (&["mm"], Unit::Millimetre),
    (&["m"], Unit::Metre),
    (
        &["rad/s", "deg/s", "°/s", "rpm", "1/min", "turns/s", "rev/s", "mm/s", "m/s", "rad s^-1", "grad/s", "dps"],
        Unit::Rate,
    ),
    (&["nm", "n m", "n*m", "n·m", "mnm", "n.m"], Unit::NewtonMetre),
    (
        &[
            "a", "ma", "v", "n", "s", "sec", "ms", "us", "µs", "ns", "w", "°c", "c", "k", "%", "hz", "kg", "rad/s^2",
            "rad/s2", "rad/s²", "deg/s^2", "deg/s²",
        ],
        Unit::Other,
    ),
];
/// Words of angles that stand in a name without brackets: `q_deg_1`.
const WORDS: [(&[&str], Unit); 3] = [
    (&["rad", "radian", "radians"], Unit::Radian),
    (&["deg", "degree", "degrees"], Unit::Degree),
    (&["turn", "turns", "rev", "revs"], Unit::Turn),
];

/// The unit that stands in brackets. One letter alone may be a joint (`position[A]`), unless a blank stands before it.
fn in_brackets(inside: &str, before: &str) -> Option<Unit> {
    let text = inside.trim().to_lowercase();
    let of = |(names, unit): &(&[&str], Unit)| names.contains(&text.as_str()).then_some(*unit);
    let may_be_joint = text.chars().count() == 1 && text != "°" && !before.ends_with([' ', '_']);
    BRACKETED.iter().find_map(of).filter(|_| !may_be_joint)
}

/// The name without units in brackets, and without the `(t)` of mathematics; and the first of those units.
fn without_unit(name: &str) -> (String, Option<Unit>) {
    let (mut rest, mut plain, mut unit) = (name, String::new(), None);
    while let Some(open) = rest.find(['[', '(']) {
        let close = if rest[open..].starts_with('[') { ']' } else { ')' };
        let Some(end) = rest[open..].find(close).map(|at| open + at) else { break };
        let inside = &rest[open + 1..end];
        let found = in_brackets(inside, &rest[..open]);
        plain += &rest[..open];
        if found.is_none() && !(close == ')' && inside == "t") {
            plain += &rest[open..=end];
        }
        unit = unit.or(found);
        rest = &rest[end + 1..];
    }
    plain += rest;
    let plain = plain.trim();
    if plain.is_empty() { (name.to_owned(), None) } else { (plain.to_owned(), unit) }
}

/// The unit that a name names, in brackets or as one of its words.
pub(crate) fn unit(name: &str) -> Option<Unit> {
    let of_word = |word: &String| WORDS.iter().find(|(names, _)| names.contains(&word.as_str())).map(|(_, unit)| *unit);
    let (plain, unit) = without_unit(name);
    let words = words(&plain);
    // `deg_per_s` is no angle.
    let is_rate = words.iter().any(|word| ["s", "sec", "dt", "per"].contains(&word.as_str()));
    unit.or_else(|| words.iter().find_map(of_word).map(|unit| if is_rate { Unit::Rate } else { unit }))
}

/// Whether a part of a name says what was done, and not which joint did it: `cmd`, `arm_cmd`, `joint_states`.
fn is_signal(part: &str) -> bool {
    let says = |word: &String| {
        DESIRED.contains(&word.as_str())
            || MEASURED.contains(&word.as_str())
            || ["state", "states"].contains(&word.as_str())
    };
    let words = words(part);
    words.iter().any(says) && !words.iter().any(|word| word.ends_with(|c: char| c.is_ascii_digit()))
}

/// Whether the name of a file says that it holds commands, and not what was measured; and the rest of that name. `None` where it says
/// neither.
pub(crate) fn of_file(stem: &str) -> Option<(bool, String)> {
    let says = |word: &String, list: &[&str]| word.len() > 1 && word != "set" && list.contains(&word.as_str());
    let is_desired = |word: &String| says(word, &DESIRED);
    let is_measured = |word: &String| says(word, &MEASURED) || ["state", "states"].contains(&word.as_str());
    let words = words(stem);
    let desired = words.iter().any(is_desired);
    let rest =
        words.iter().filter(|word| !is_desired(word) && !is_measured(word)).cloned().collect::<Vec<_>>().join(" ");
    (desired || words.iter().any(is_measured)).then_some((desired, rest))
}

/// The parts of what stands before an ending that say which joint it is, and those that do not.
fn joint_and_rest(text: &str) -> (String, String) {
    let (mut joint, mut rest) = (String::new(), String::new());
    for part in text.split_inclusive(['.', '/']) {
        let own = part.trim_end_matches(['.', '/']);
        if own.is_empty() || is_signal(own) {
            rest += part;
            continue;
        }
        for word in part.split_inclusive(['_', ' ', '-']) {
            let own = word.trim_end_matches(['_', ' ', '-', '.', '/']).to_lowercase();
            let says =
                [&DESIRED[..], &MEASURED[..], &BEFORE_ENDINGS[..]].iter().any(|list| list.contains(&own.as_str()));
            if says { &mut rest } else { &mut joint }.push_str(word);
        }
    }
    let trim = |text: String| text.trim_matches(['_', '.', '/', ' ', '-']).to_owned();
    (trim(joint), rest.trim_end_matches(['_', ' ', '-']).to_owned())
}

/// Name without what tells it from its neighbours, and that.
pub(crate) fn split(name: &str) -> (String, String) {
    let (name, _) = without_unit(name);
    let name = name.as_str();
    if let Some((base, label)) = name.strip_suffix(']').and_then(|name| name.rsplit_once('[')) {
        return (base.to_owned(), label.to_owned());
    }
    if let Some((at, (text, ending))) = name.rfind(['.', '_', '/', ' ']).zip(name.rsplit_once(['.', '_', '/', ' ']))
        && ENDINGS.contains(&ending.to_ascii_lowercase().as_str())
        && !text.is_empty()
        && !VELOCITY.contains(&text)
        && !TORQUE.contains(&text)
    {
        let ending = ending.to_ascii_lowercase();
        let (joint, rest) = joint_and_rest(text);
        return if joint.is_empty() {
            (name.to_owned(), String::new())
        } else if rest.is_empty() {
            (ending, joint)
        } else if rest.ends_with(['.', '/']) {
            (rest + &ending, joint)
        } else {
            (format!("{rest}{}{ending}", &name[at..=at]), joint)
        };
    }
    let last = name.rfind(|c: char| c.is_ascii_digit());
    if let Some(end) = last {
        let start = name[..end]
            .rfind(|c: char| !c.is_ascii_digit())
            .map_or(0, |at| at + name[at..].chars().next().map_or(1, char::len_utf8));
        let (head, tail) = (name[..start].trim_end_matches(['_', '.', '-', ' ']), &name[end + 1..]);
        return (format!("{head}{tail}"), name[start..=end].to_owned());
    }
    (name.to_owned(), String::new())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_parted_into_what_was_done_and_which_joint_did_it() {
        for (name, base, label) in [
            ("j1_cmd_pos", "cmd_pos", "j1"),
            ("j1_pos", "pos", "j1"),
            ("motor1_goal_position", "goal_position", "motor1"),
            ("arm_cmd.joint1.position", "arm_cmd.position", "joint1"),
            ("state.joint1.pos", "state.pos", "joint1"),
            ("cmd.shoulder_pan.pos", "cmd.pos", "shoulder_pan"),
            ("/joint_commands/elbow_joint/position", "/joint_commands/position", "elbow_joint"),
            ("joint_1_pos_cmd", "pos_cmd", "joint_1"),
            ("q1 [deg]", "q", "1"),
            ("q_d_1 [rad]", "q_d", "1"),
            ("Achse 1 Ist [°]", "Achse Ist", "1"),
            ("qd1(t)", "qd", "1"),
            ("position[A]", "position", "A"),
            ("position[fr3_joint1]", "position", "fr3_joint1"),
            ("actual_position", "actual_position", ""),
            ("elbow_velocity", "velocity", "elbow"),
        ] {
            assert_eq!(split(name), (base.to_owned(), label.to_owned()), "{name}");
        }
    }

    #[test]
    fn a_name_may_name_a_unit() {
        for (name, expected) in [
            ("q1 [deg]", Some(Unit::Degree)),
            ("q_deg_1", Some(Unit::Degree)),
            ("J1_act [°]", Some(Unit::Degree)),
            ("q [rad]", Some(Unit::Radian)),
            ("dq1 [rad/s]", Some(Unit::Rate)),
            ("vel_deg_per_s_1", Some(Unit::Rate)),
            ("Moment 1 [Nm]", Some(Unit::NewtonMetre)),
            ("position[S]", None),
            ("q1", None),
        ] {
            assert_eq!(unit(name), expected, "{name}");
        }
    }
}
