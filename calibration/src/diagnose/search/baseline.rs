//! Where the search begins: the paper's parameters identified on the clips for fitting.
//!
//! In order: where gains that are known by range alone may begin; the arm by itself, since a gain that is off moves the hit,
//! and a hit elsewhere tells nothing about the gain;
//! then the object's parameters under that arm, by the identification's own way over rough hits; then all together.

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::Effort;
use crate::diagnose::fit::sweep::Precision;
use crate::diagnose::fit::{floor, stages};
use crate::diagnose::propose::arm_alone::ArmAlone;
use crate::identify::object;
use inference::admit::{Admitted, Split};
use inference::controller;
use inference::likelihood::{Evidence, Likelihood};
use shared_mem::cell::Cell;
use shared_mem::progress::Progress;
use shared_mem::recording::Clip;
use shared_mem::theta::ObjectTheta;

/// So many linearisations, with slopes joint by joint: of the arm on the way; and of arm and object together, where only the arm says
/// what its gains are. An object that deviates for a reason that is not in the twin yet would bend them until the hit lands where it helps.
const JOINT_BY_JOINT: Effort = Effort::of(8, Precision::Joints);
/// The last steps of the arm.
const TO_THE_END: Effort = Effort::of(8, Precision::Exact);

/// Steps in which [`identify`] shows how far it is.
pub fn steps(admitted: &Admitted) -> u64 {
    if admitted.with_object { 4 } else { 2 }
}

/// Identifies; `None` when the twin has no answer at the nominal parameters.
pub fn identify<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    cell: &Cell,
    admitted: &Admitted,
    bar: &Progress,
) -> Option<Hypothesis> {
    let even = floor::sensors_alone(bench.evidence);
    bar.show(0, stages::BASELINE);
    let begun = match (&cell.robot, admitted.with_object) {
        (None, _) => bench.library.start(),
        (Some(_), false) => return of_the_arm(bench, split, start(bench, split, cell, admitted), bar),
        (Some(_), true) => {
            let without_object = ArmAlone(bench.evidence);
            of_the_arm(&without_object.bench(bench), split, start(bench, split, cell, admitted), bar)?.full
        }
    };
    bar.show(2, stages::BASELINE);
    let full = refined(bench, split, cell, admitted, &begun).unwrap_or(begun);
    bar.show(3, stages::BASELINE);
    bench.fit((&[], full), &split.train, &even, None, JOINT_BY_JOINT)
}

/// The arm by itself, from where its numbers begin.
fn of_the_arm<E: Likelihood>(
    bench: &Bench<'_, E>,
    split: &Split,
    start: Vec<f64>,
    bar: &Progress,
) -> Option<Hypothesis<E::Own>> {
    let even = floor::sensors_alone(bench.evidence);
    let on_the_way = bench.fit((&[], start), &split.train, &even, None, JOINT_BY_JOINT)?;
    bar.show(1, stages::BASELINE);
    bench.fit((&[], on_the_way.full.clone()), &split.train, &even, Some(&on_the_way), TO_THE_END)
}

/// Where the fit begins.
fn start<E: Evidence>(bench: &Bench<'_, E>, split: &Split, cell: &Cell, admitted: &Admitted) -> Vec<f64> {
    let mut start = bench.library.start();
    let clips: Vec<&Clip> = split.train.iter().map(|clip| &admitted.clips[*clip]).collect();
    let Ok(theta) = controller::begun(cell, &clips, &bench.library.theta(&start), bench.interrupt) else {
        return start;
    };
    let numbers = bench.library.settings.numbers(&theta);
    for k in bench.library.baseline.clone() {
        let unknown = &bench.library.unknowns[k];
        start[k] = numbers[k].unwrap_or(start[k]).clamp(unknown.lower, unknown.upper);
    }
    start
}

/// Numbers with the object's parameters that fit the strokes best under the arm and the effects that are given, by
/// identification's own way over rough hits; `None` where strokes tell nothing about the object.
pub fn refined<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    cell: &Cell,
    admitted: &Admitted,
    given: &[f64],
) -> Option<Vec<f64>> {
    if !admitted.with_object {
        return None;
    }
    let clips: Vec<Clip> = split.train.iter().map(|clip| admitted.clips[*clip].clone()).collect();
    let mut base = bench.library.theta(given);
    // What stood in for an effect is wrong once that effect acts: only the friction is where it was.
    let nominal = bench.library.theta(&bench.library.start()).object;
    if let (Some(object), Some(nominal)) = (&mut base.object, nominal) {
        *object = ObjectTheta { friction: object.friction, ..nominal };
    }
    let theta = object::refine((cell, bench.evidence.engine()), clips, &base, bench.interrupt).ok()?;
    let numbers = bench.library.settings.numbers(&theta);
    let mut full = given.to_vec();
    for k in bench.library.baseline.clone() {
        full[k] = numbers[k].unwrap_or(full[k]);
    }
    Some(full)
}
