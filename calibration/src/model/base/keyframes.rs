//! States that the user keeps in a model, in the new order of positions and controls.

use super::Merging;
use super::classes::numbers;
use super::controls::{Control, Controls};
use twin::xml::Element;

/// What changes in the positions.
pub(super) struct Shifts<'a> {
    /// Of the arm's joints: where each one's position lies, and how much more it reads.
    pub(super) joints: &'a [(Option<usize>, f64)],
    /// Positions of what is new at the end, and how many speeds it has.
    pub(super) added: (&'a [f64], usize),
}

/// Rewrites every `<key>`; what cannot be kept of one is taken out, and named.
pub(super) fn rewrite(merging: &mut Merging, controls: &Controls, shifts: &Shifts<'_>) {
    let mut lacking = Vec::new();
    merging.root.each_mut(&mut |key| {
        if key.name == "key" {
            let name = key.get("name").unwrap_or("without a name").to_owned();
            lacking.extend(
                key_of(key, controls, shifts).into_iter().map(|what| (format!("{what} of keyframe {name}"), what)),
            );
        }
    });
    for (what, key) in lacking {
        let why = match key {
            "ctrl" => "its controls cannot be given in the new order: give one for each actuator",
            "act" => "actuators have other states than before: MuJoCo begins with 0",
            _ => {
                "its positions cannot be given in the new order: MuJoCo begins with those in which the model is written"
            }
        };
        merging.lacks(what, why);
    }
}

/// Rewrites one; the attributes that are taken out.
fn key_of(key: &mut Element, controls: &Controls, shifts: &Shifts<'_>) -> Vec<&'static str> {
    let mut lacking = Vec::new();
    let mut positions = key.get("qpos").map(numbers);
    if let Some(q) = &mut positions {
        let shifted = shifts.joints.iter().try_for_each(|(address, more)| {
            if *more == 0.0 {
                return Some(());
            }
            *q.get_mut((*address)?)? += more;
            Some(())
        });
        q.extend(shifts.added.0);
        match shifted {
            Some(()) => key.set("qpos", joined(q)),
            None => {
                key.remove("qpos");
                lacking.push("qpos");
            }
        }
    }
    if let Some(mut speeds) = key.get("qvel").map(numbers) {
        speeds.extend(std::iter::repeat_n(0.0, shifts.added.1));
        key.set("qvel", joined(&speeds));
    }
    if key.get("act").is_some() && controls.states_changed {
        key.remove("act");
        lacking.push("act");
    }
    if let Some(old) = key.get("ctrl").map(numbers)
        && controls.replaced
    {
        let of = |control: &Control| match control {
            Control::Kept(place) => old.get(*place).copied(),
            Control::PositionKept(place, joint, law) => Some(law.at(*old.get(*place)?) + shifts.joints.get(*joint)?.1),
            Control::Position(joint) => positions.as_ref()?.get(shifts.joints.get(*joint)?.0?).copied(),
            Control::Nothing => Some(0.0),
        };
        let new: Option<Vec<f64>> = controls.controls.iter().map(of).collect();
        match new.filter(|_| old.len() == controls.before) {
            Some(new) => key.set("ctrl", joined(&new)),
            None => {
                key.remove("ctrl");
                lacking.push("ctrl");
            }
        }
    }
    lacking
}

fn joined(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}
