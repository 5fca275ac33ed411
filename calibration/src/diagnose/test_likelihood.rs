//! Rows of recorded strokes: what each group of sensors tells, and that what is said without a simulation is what a simulation says.

use super::test_bench::{on_strokes, shipped};
use crate::diagnose::fit::bench::Bench;
use crate::diagnose::fit::sweep::Precision;
use inference::likelihood::{Group, Reach};
use worlds::world::{Fault, Kind, World};

/// The largest slope in a group of a number of the baseline, by its name [sigma for 1 % of it].
fn slope(bench: &Bench<'_>, name: &str, group: Group) -> f64 {
    let k = bench.library.settings.settings().iter().position(|setting| setting.name() == name);
    let k = k.expect("a number of that name");
    let (numbers, clips) = (bench.library.start(), [(0, vec![0.0; bench.scatter.count()])]);
    let swept = bench.linearise(&numbers, &[k], &clips, Precision::Exact).expect("a stroke");
    let slopes = swept.clips[0].matrix.column(1);
    let rows = bench.evidence.rows(0).iter().zip(slopes.iter());
    let of_group = rows.filter(|(row, _)| bench.evidence.channels()[row.channel].group == group);
    of_group.fold(0.0, |largest: f64, (_, slope)| largest.max((0.01 * numbers[k] * slope).abs()))
}

#[test]
fn the_joints_in_contact_tell_how_heavy_the_object_is_and_nothing_about_gains() {
    let cell = shipped();
    let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
    on_strokes((&cell, &world), |bench, _| {
        let in_contact = slope(bench, "mass", Group::Contact);
        assert!(in_contact > 3.0 && in_contact > slope(bench, "mass", Group::Object), "{in_contact}");
        assert_eq!(slope(bench, "mass", Group::Arm), 0.0);
        assert_eq!(slope(bench, "stiffness[1]", Group::Contact), 0.0);
        assert!(slope(bench, "stiffness[1]", Group::Arm) > 1.0);
    });
}

#[test]
fn slopes_that_are_known_are_those_of_differences_and_rows_ascend_in_time() {
    let cell = shipped();
    let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
    on_strokes((&cell, &world), |bench, _| {
        let (evidence, effects, numbers) = (bench.evidence, &bench.scatter, bench.library.start());
        let at = |own: &[f64]| {
            let mut out = Vec::new();
            evidence.residuals(0, &numbers, own, &mut out).expect("a stroke");
            out
        };
        let rest = vec![0.0; effects.count()];
        let base = at(&rest);
        assert!(base.iter().all(|residual| residual.is_finite()));
        assert!((0..effects.heavy.start).all(|own| evidence.own_slope(0, own).is_none()), "a simulation tells");
        for own in effects.heavy.clone() {
            let (mut moved, step) = (rest.clone(), effects.random[own].step);
            moved[own] = step;
            let known = evidence.own_slope(0, own).expect("known");
            let off = at(&moved)
                .iter()
                .zip(&base)
                .zip(known)
                .fold(0.0, |off: f64, ((after, before), slope)| off.max((after - before - step * slope).abs()));
            assert!(off < 1e-9, "{}: {off}", effects.random[own].name);
        }
        let rows = evidence.rows(0);
        assert_eq!(rows.len(), base.len());
        for channel in 0..evidence.channels().len() {
            let times: Vec<f64> = rows.iter().filter(|row| row.channel == channel).map(|row| row.time).collect();
            assert!(times.is_sorted(), "channel {channel}");
        }
    });
}

#[test]
fn where_only_some_rows_can_have_changed_these_are_as_they_are_and_the_others_as_they_were() {
    let cell = shipped();
    let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
    on_strokes((&cell, &world), |bench, _| {
        let (evidence, rest) = (bench.evidence, vec![0.0; bench.scatter.count()]);
        let mut moved = bench.library.start();
        bench.library.baseline.clone().for_each(|k| moved[k] += bench.library.unknowns[k].step);
        let mut whole = Vec::new();
        evidence.residuals(0, &moved, &rest, &mut whole).expect("a stroke");
        let base = vec![7.0; whole.len()];
        for reach in [Reach::All, Reach::Arm, Reach::Object] {
            let mut out = Vec::new();
            evidence.changed(0, (&moved, &rest), (reach, &base, None), &mut out).expect("a stroke");
            for ((row, out), whole) in evidence.rows(0).iter().zip(&out).zip(&whole) {
                let of_arm = evidence.channels()[row.channel].group == Group::Arm;
                let stays = (reach == Reach::Arm && !of_arm) || (reach == Reach::Object && of_arm);
                assert_eq!(*out, if stays { 7.0 } else { *whole }, "{reach:?} at {row:?}");
            }
        }
    });
}
