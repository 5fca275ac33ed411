//! Which columns of a group are the arm's joints, and in which order, by the names of joints.

use super::candidates::Candidate;
use shared_mem::msg::MAX_JOINTS;

/// Fewer joints with numbers make no arm.
const FEWEST_NUMBERED: usize = 4;
/// Commands for fewer joints are those of a camera's mount or a lift, and name no arm.
const FEWEST_COMMANDED: usize = 3;

/// The arm's joints within a group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Members {
    /// Places in the group, in the arm's order.
    pub(super) places: Vec<usize>,
    /// Why these, and why in this order.
    pub(super) why: String,
}

/// What names a column, or a joint: without case, and with its number, which may stand before the last word (`arm_1_joint`).
struct Name {
    text: String,
    number: Option<u64>,
    /// The name without its number.
    stem: String,
}

impl Name {
    fn of(text: &str) -> Self {
        let text = text.to_ascii_lowercase();
        let end = text.rfind(|c: char| c.is_ascii_digit()).map_or(0, |at| at + 1);
        let begin = text[..end].trim_end_matches(|c: char| c.is_ascii_digit()).len();
        let number = text[begin..end].parse().ok();
        let stem = if number.is_some() { format!("{}{}", &text[..begin], &text[end..]) } else { text.clone() };
        Self { text, number, stem }
    }

    /// The same but for a prefix, as robots have in the names of a cell and not in those of a log.
    fn ends_like(&self, other: &Self) -> bool {
        let (long, short) = if self.text.len() > other.text.len() { (self, other) } else { (other, self) };
        let rest = long.text.strip_suffix(&short.text);
        rest.is_some_and(|rest| rest.is_empty() || rest.ends_with(['_', '/', '.', '-', ' ']))
    }
}

/// Where the joints `wanted` stand among labels; `None` where the labels are of another arm.
pub(super) fn places(labels: &[String], wanted: &[String]) -> Option<Vec<usize>> {
    let (labels, wanted): (Vec<Name>, Vec<Name>) =
        (labels.iter().map(|l| Name::of(l)).collect(), wanted.iter().map(|w| Name::of(w)).collect());
    let by = |alike: &dyn Fn(&Name, &Name) -> bool| -> Option<Vec<usize>> {
        let one = |wanted: &Name| {
            let mut found = labels.iter().enumerate().filter(|(_, label)| alike(label, wanted)).map(|(at, _)| at);
            found.next().filter(|_| found.next().is_none())
        };
        wanted.iter().map(one).collect()
    };
    if wanted.is_empty() {
        return None;
    }
    let numbered = labels.len() == wanted.len();
    by(&|a, b| a.text == b.text)
        .or_else(|| by(&|a, b| a.ends_like(b)))
        .or_else(|| by(&|a, b| numbered && a.number.is_some() && a.number == b.number))
}

/// The arm's joints in a group of measured positions. `wanted`: the arm's joints from base to flange, where they are known;
/// `commanded`: those that commands name.
///
/// # Errors
/// A question where the group holds joints of more than one arm.
pub(super) fn of(measured: &Candidate<'_>, wanted: &[String], commanded: &[&[String]]) -> Result<Members, String> {
    let all = || (0..measured.size()).collect::<Vec<_>>();
    let Some(names) = measured.joints() else {
        return match measured.size() {
            1..=MAX_JOINTS => Ok(Members { places: all(), why: String::new() }),
            count => Err(format!(
                "{} has {count} columns, an arm at most {MAX_JOINTS} joints: which are the arm's?",
                measured.named()
            )),
        };
    };
    if let Some(places) = places(names, wanted) {
        let why = "the arm's joints by their names, from its base on".to_owned();
        return Ok(Members { places, why });
    }
    let fewer = commanded.iter().filter(|list| (FEWEST_COMMANDED..names.len()).contains(&list.len()));
    let fewer = fewer.filter_map(|list| places(names, list));
    if let Some(mut places) = fewer.max_by_key(Vec::len) {
        sort(&mut places, names);
        return Ok(Members { places, why: "the joints that the commands name".into() });
    }
    let families = families(names);
    let (whole, several) = (names.len() <= MAX_JOINTS, families.len() > 1);
    let mut places = match families.into_iter().next() {
        Some(family) if !whole && !several => family,
        _ if whole => all(),
        _ => {
            let count = names.len();
            return Err(format!(
                "the log has {count} joints, a clip at most {MAX_JOINTS}: which columns are those of one arm?"
            ));
        }
    };
    sort(&mut places, names);
    let order = if places.is_sorted() { "" } else { ", in the order of their numbers" };
    let why = if whole {
        format!("the log's own names{order}")
    } else {
        format!("the only joints that are numbered like an arm's{order}")
    };
    Ok(Members { places, why })
}

/// Numbers name the order of joints where all have the same name before them.
fn sort(places: &mut [usize], names: &[String]) {
    let name = |place: &usize| names.get(*place).map(|name| Name::of(name));
    let first = places.first().and_then(name).map(|name| name.stem);
    let alike = |place: &usize| name(place).is_some_and(|n| n.number.is_some() && Some(&n.stem) == first.as_ref());
    if places.iter().all(alike) {
        places.sort_by_key(|place| name(place).and_then(|name| name.number));
    }
}

/// Places of joints that are numbered under one name, as many as an arm has.
fn families(names: &[String]) -> Vec<Vec<usize>> {
    let mut families: Vec<(String, Vec<usize>)> = Vec::new();
    for (place, name) in names.iter().enumerate() {
        let name = Name::of(name);
        if name.number.is_none() {
            continue;
        }
        match families.iter_mut().find(|(stem, _)| *stem == name.stem) {
            Some((_, family)) => family.push(place),
            None => families.push((name.stem, vec![place])),
        }
    }
    let arms = families.into_iter().map(|(_, family)| family);
    arms.filter(|family| (FEWEST_NUMBERED..=MAX_JOINTS).contains(&family.len())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Table;
    use crate::naming::{Group, Quantity, Role};

    fn names(list: &str) -> Vec<String> {
        list.split(' ').map(str::to_owned).collect()
    }

    fn found(list: &str, wanted: &[String], commanded: &[&[String]]) -> Result<Vec<String>, String> {
        let labels = names(list);
        let group = Group { base: "position".into(), names: labels.clone(), at: vec![], labels: labels.clone() };
        let role = Role { quantity: Quantity::Position, desired: false, score: 1 };
        let table = Table::default();
        let candidate = Candidate { table: &table, group, role };
        of(&candidate, wanted, commanded).map(|found| found.places.iter().map(|i| labels[*i].clone()).collect())
    }

    #[test]
    fn the_arm_of_a_robot_is_found_by_the_cell_by_commands_and_by_numbers() {
        let rover = "lift pan fr3_joint2 fr3_joint7 fr3_joint1 fr3_joint4 fr3_joint3 fr3_joint6 fr3_joint5 tilt";
        let fr3 = names("fr3_joint1 fr3_joint2 fr3_joint3 fr3_joint4 fr3_joint5 fr3_joint6 fr3_joint7");
        let turned: Vec<String> = fr3.iter().rev().cloned().collect();
        for (wanted, commanded) in [(&fr3[..], &[][..]), (&[], &[&turned[..]]), (&[], &[])] {
            assert_eq!(found(rover, wanted, commanded).as_deref(), Ok(&fr3[..]), "{wanted:?} {commanded:?}");
        }
        let tiago = "wheel head_1_joint head_2_joint arm_1_joint arm_2_joint arm_3_joint arm_4_joint arm_5_joint torso";
        assert_eq!(found(tiago, &[], &[]), Ok(names("arm_1_joint arm_2_joint arm_3_joint arm_4_joint arm_5_joint")));
        let two = "left_1 left_2 left_3 left_4 left_5 right_1 right_2 right_3 right_4 right_5";
        assert!(found(two, &[], &[]).is_err_and(|what| what.contains("10 joints")));
        assert_eq!(found(two, &names("right_2 right_1"), &[]), Ok(names("right_2 right_1")));
    }

    #[test]
    fn joints_of_a_cell_are_found_under_a_prefix_and_by_their_numbers_but_not_those_of_another_arm() {
        let wanted = names("arm/shoulder_pan arm/elbow");
        assert_eq!(places(&names("elbow shoulder_pan"), &wanted), Some(vec![1, 0]));
        assert_eq!(places(&names("panda_joint2 panda_joint1"), &names("fr3_joint1 fr3_joint2")), Some(vec![1, 0]));
        assert_eq!(places(&names("hip knee"), &wanted), None);
        assert_eq!(places(&names("a b"), &[]), None);
        assert_eq!(places(&names("gelenk_ä1 gelenk_ä"), &names("x1 x2")), None);
    }
}
