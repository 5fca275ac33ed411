//! Which of the user's joints are the cell's: those of the same names, with what stands before all of them in place of what stands before
//! the cell's, or those that the user names.

use anyhow::{bail, ensure};

/// The user's names of the cell's joints, in the cell's order. `own`: all of the model's that turn or slide, in its order; `named`: what
/// the user says.
///
/// # Errors
/// Where no arm or several could be meant.
pub(super) fn chosen(cell: &[String], own: &[String], named: &[String]) -> anyhow::Result<Vec<String>> {
    if !named.is_empty() {
        ensure!(
            named.len() == cell.len(),
            "--base-joints names {} joints, and the cell's arm has {}: give one for each, from base to flange",
            named.len(),
            cell.len()
        );
        if let Some(unknown) = named.iter().find(|name| !own.contains(name)) {
            bail!("the model has no joint `{unknown}` that turns or slides (--base-joints); it has {}", own.join(", "));
        }
        return Ok(named.to_vec());
    }
    ensure!(!own.is_empty(), "the model has no joint with a name that turns or slides; give the model of an arm");
    if cell.iter().all(|name| own.contains(name)) {
        return Ok(cell.to_vec());
    }
    let common = common_start(cell);
    let found = [0, common].into_iter().flat_map(|skip| {
        let tails: Vec<&str> = cell.iter().map(|name| &name[skip..]).collect();
        let starts = own.iter().filter_map(|name| name.strip_suffix(tails[0]).map(str::to_owned)).collect::<Vec<_>>();
        starts.into_iter().map(move |start| tails.iter().map(|tail| format!("{start}{tail}")).collect::<Vec<String>>())
    });
    let mut arms: Vec<Vec<String>> = Vec::new();
    for arm in found.filter(|arm| arm.iter().all(|name| own.contains(name))) {
        if !arms.contains(&arm) {
            arms.push(arm);
        }
    }
    match &arms[..] {
        [one] => Ok(one.clone()),
        [] => bail!(
            "no joints of the model are called as the cell's ({}); say which are the arm's, from base to flange, with --base-joints; it has {}",
            cell.join(", "),
            own.join(", ")
        ),
        several => {
            let ways: Vec<String> = several.iter().map(|arm| format!("--base-joints {}", arm.join(","))).collect();
            bail!(
                "the model has {} arms with joints as the cell's; say which is meant: {}",
                several.len(),
                ways.join(" or ")
            )
        }
    }
}

/// Bytes that all names begin with, and that leave something of each.
fn common_start(names: &[String]) -> usize {
    let Some(first) = names.first() else { return 0 };
    let shortest = names.iter().map(|name| name.len()).min().unwrap_or(0).saturating_sub(1);
    let is_common =
        |end: &usize| first.is_char_boundary(*end) && names.iter().all(|name| name.starts_with(&first[..*end]));
    (0..=shortest).rev().find(is_common).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &str) -> Vec<String> {
        list.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn arms_are_found_by_their_names_and_asked_for_where_there_are_several() {
        let cell = names("fr3_joint1 fr3_joint2");
        let find = |own: &str, named: &str| {
            let named = if named.is_empty() { Vec::new() } else { names(named) };
            chosen(&cell, &names(own), &named).map(|arm| arm.join(" ")).map_err(|error| error.to_string())
        };
        assert_eq!(find("fr3_joint1 fr3_joint2 finger", ""), Ok("fr3_joint1 fr3_joint2".into()));
        assert_eq!(find("joint1 joint2 finger_joint1", ""), Ok("joint1 joint2".into()));
        assert_eq!(find("left_fr3_joint1 left_fr3_joint2", ""), Ok("left_fr3_joint1 left_fr3_joint2".into()));
        let two = "left_joint1 left_joint2 right_joint1 right_joint2";
        let asked = find(two, "").expect_err("two arms");
        assert!(asked.contains("--base-joints right_joint1,right_joint2"), "{asked}");
        assert_eq!(find(two, "right_joint1 right_joint2"), Ok("right_joint1 right_joint2".into()));
        for (own, named, said) in
            [("a b", "", "it has a, b"), (two, "left_joint1", "one for each"), (two, "x y", "no joint `x`")]
        {
            let error = find(own, named).expect_err(said);
            assert!(error.contains(said), "{error}");
        }
    }
}
