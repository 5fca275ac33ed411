//! Where the cell's base frame lies in the user's world, and where the arms are not built alike, why: a joint turns the other way, has its
//! zero elsewhere, or other lengths.

use super::places::{PlacedJoint, fits};
use anyhow::anyhow;
use nalgebra::{Isometry3, Vector3};

/// Axes are alike where their distances and angles are, within [m, rad].
const ALIKE: [f64; 2] = [0.01, 0.05];
/// Sine of the angle below which two axes are parallel: where they come nearest is everywhere, or far away.
const PARALLEL: f64 = 0.1;

/// Where the cell's base frame lies in the user's world; `names` are the user's of the joints.
///
/// # Errors
/// Where the arms are not built alike.
pub(super) fn base(cell: &[&PlacedJoint], own: &[&PlacedJoint], names: &[String]) -> anyhow::Result<Isometry3<f64>> {
    fits(cell, own).map_err(|(joint, [apart, turned])| {
        let name = names.get(joint).map_or("", String::as_str);
        let off = format!("that of `{name}` is {:.0} mm and {:.0} degrees off", apart * 1e3, turned.to_degrees());
        why(cell, own, names, &off)
    })
}

/// What differs, with its remedy; `off` says by how much the axes do not meet.
fn why(cell: &[&PlacedJoint], own: &[&PlacedJoint], names: &[String], off: &str) -> anyhow::Error {
    if let Some(turned) = turned_round(cell, own) {
        let turned: Vec<&str> = turned.into_iter().filter_map(|joint| names.get(joint)).map(String::as_str).collect();
        return anyhow!(
            "{} of the model turns the other way than in the cell: turn its axis round there, with the signs of its range, keyframes and controls",
            turned.join(", ")
        );
    }
    if let Some(name) = zero_elsewhere(cell, own).and_then(|joint| names.get(joint)) {
        return anyhow!(
            "the arm of the model has the cell's lengths, and the zero of `{name}` is another than the cell's: write the model so that the pose in \
             which it stands in the file is the cell's with all joints at 0"
        );
    }
    anyhow!(
        "the arm of the model is not built as the cell's: where their axes are brought together, {off}; say with --base-joints which joints of the \
         model are the arm's, from base to flange, or give the model of this arm"
    )
}

/// The fewest joints whose axes, turned round, make the arms alike.
fn turned_round(cell: &[&PlacedJoint], own: &[&PlacedJoint]) -> Option<Vec<usize>> {
    let which = |set: u32| (0..cell.len()).filter(move |joint| set & (1 << joint) != 0).collect::<Vec<_>>();
    let mut sets: Vec<Vec<usize>> = (1..1_u32 << cell.len().min(8)).map(which).collect();
    sets.sort_by_key(Vec::len);
    sets.into_iter().find(|set| {
        let mut turned: Vec<PlacedJoint> = own.iter().map(|joint| (*joint).clone()).collect();
        set.iter().for_each(|joint| turned[*joint].axis = -turned[*joint].axis);
        fits(cell, &turned.iter().collect::<Vec<_>>()).is_ok()
    })
}

/// The first joint of an arm of the cell's lengths, behind which the axis lies otherwise to the one before.
fn zero_elsewhere(cell: &[&PlacedJoint], own: &[&PlacedJoint]) -> Option<usize> {
    let is_alike = |a: usize, b: usize| {
        let [cell, own] = [between(cell[a], cell[b]), between(own[a], own[b])];
        (cell[0] - own[0]).abs() < ALIKE[0] && (cell[1] - own[1]).abs() < ALIKE[1]
    };
    let inner = || 1..cell.len().saturating_sub(1);
    let is_as_long = |joint: usize| {
        let of = |arm: &[&PlacedJoint]| along(arm[joint - 1], arm[joint], arm[joint + 1]);
        of(cell).zip(of(own)).is_none_or(|(cell, own)| (cell - own).abs() < ALIKE[0])
    };
    let has_lengths = (1..cell.len()).all(|joint| is_alike(joint - 1, joint)) && inner().all(is_as_long);
    inner().find(|joint| has_lengths && !is_alike(joint - 1, joint + 1))
}

/// How far apart on a joint's axis those before and behind it come nearest [m]; `None` where one of them is parallel to it.
fn along(before: &PlacedJoint, joint: &PlacedJoint, behind: &PlacedJoint) -> Option<f64> {
    let foot = |other: &PlacedJoint| {
        let across = joint.axis.cross(&other.axis);
        let apart = other.point - joint.point;
        (across.norm() > PARALLEL).then(|| apart.cross(&other.axis).dot(&across) / across.norm_squared())
    };
    Some((foot(behind)? - foot(before)?).abs())
}

/// Distance of two axes [m] and the angle between them, without their signs [rad].
fn between(one: &PlacedJoint, other: &PlacedJoint) -> [f64; 2] {
    let across: Vector3<f64> = one.axis.cross(&other.axis);
    let apart = other.point - one.point;
    let distance = match across.try_normalize(PARALLEL) {
        Some(normal) => apart.dot(&normal).abs(),
        None => apart.cross(&one.axis).norm(),
    };
    [distance, across.norm().atan2(one.axis.dot(&other.axis).abs())]
}
