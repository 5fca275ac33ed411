//! Smoothed logs against motions whose slopes are known.

use super::smoothing::{HALF_NS, derivatives, half_width, motion};
use proptest::prelude::*;
use shared_mem::recording::JointSeries;

/// Stamps every so many ns, some of them early or late by up to a share of that, and some missing.
fn stamps() -> impl Strategy<Value = Vec<u64>> {
    let row = (0.0..0.4_f64, prop::bool::weighted(0.9));
    (500_000_u64..4_000_000, prop::collection::vec(row, 300..400)).prop_map(|(step, rows)| {
        let at = |(row, (late, _)): (usize, &(f64, bool))| row as u64 * step + (late * step as f64) as u64;
        let kept = rows.iter().enumerate().filter(|(row, (_, kept))| *kept || *row == 0);
        kept.map(at).collect()
    })
}

fn seconds(stamp: u64) -> f64 {
    stamp as f64 * 1e-9
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_cubic_is_followed_exactly_whatever_rows_are_uneven_or_missing(
        stamps in stamps(), c in prop::array::uniform4(-2.0..2.0_f64), at in 0.3..0.7_f64,
    ) {
        let middle = seconds(stamps[stamps.len() / 2]);
        let of = |stamp: u64| { let t = seconds(stamp) - middle; c[0] + t * (c[1] + t * (c[2] + t * c[3])) };
        let values: Vec<f64> = stamps.iter().map(|stamp| of(*stamp)).collect();
        let asked = (stamps[stamps.len() - 1] as f64 * at) as u64;
        let t = seconds(asked) - middle;
        let expected = [of(asked), c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]), 2.0 * c[2] + 6.0 * c[3] * t];
        let found = derivatives((&stamps, &values, 1), &[asked], half_width(&stamps).expect("rows"));
        for (k, close) in [1e-9, 1e-6, 1e-4].into_iter().enumerate() {
            prop_assert!((found[k][0] - expected[k]).abs() < close, "{k}: {} {}", found[k][0], expected[k]);
        }
    }

    /// What is linear in the rows knows no offset, no unit and no first stamp.
    #[test]
    fn smoothing_is_linear_and_the_same_at_any_time(
        noise in prop::collection::vec(-1.0..1.0_f64, 200), offset in -5.0..5.0_f64, factor in 0.1..9.0_f64,
        later in 0_u64..1_000_000_000_000_000,
    ) {
        let stamps: Vec<u64> = (0..200).map(|row| row * 1_000_000).collect();
        let moved: Vec<u64> = stamps.iter().map(|stamp| stamp + later).collect();
        let other: Vec<f64> = noise.iter().map(|value| offset + factor * value).collect();
        let here = derivatives((&stamps, &noise, 1), &[100_000_000], HALF_NS);
        let there = derivatives((&moved, &other, 1), &[100_000_000 + later], HALF_NS);
        let expected = [offset + factor * here[0][0], factor * here[1][0], factor * here[2][0]];
        for k in 0..3 {
            prop_assert!((there[k][0] - expected[k]).abs() < 1e-9 * (1.0 + expected[k].abs()), "{k}");
        }
    }
}

#[test]
fn joints_of_a_row_are_smoothed_each_by_itself_and_in_order() {
    let stamps_ns: Vec<u64> = (0..400).map(|row| row * 1_000_000).collect();
    let q = stamps_ns.iter().flat_map(|stamp| [seconds(*stamp), -3.0 * seconds(*stamp)]).collect();
    let series = JointSeries { dof: 2, stamps_ns, q, ..JointSeries::default() };
    let smoothed = motion(&series, &[150_000_000, 200_000_000], HALF_NS);
    assert_eq!((smoothed.len(), smoothed.dof, smoothed.tau.len()), (2, 2, 0));
    for (row, t) in [0.15, 0.2].into_iter().enumerate() {
        let (q, dq) = (smoothed.q_row(row), smoothed.dq_row(row).expect("velocities"));
        assert!((q[0] - t).abs() < 1e-12 && (q[1] + 3.0 * t).abs() < 1e-12, "{q:?}");
        assert!((dq[0] - 1.0).abs() < 1e-9 && (dq[1] + 3.0).abs() < 1e-9, "{dq:?}");
    }
}

#[test]
fn the_window_is_wider_where_stamps_are_uneven_or_rows_are_few_and_none_where_there_is_no_time() {
    let every = |ns: u64| (0..100).map(|row| row * ns).collect::<Vec<u64>>();
    assert_eq!(half_width(&every(1_000_000)), Some(HALF_NS));
    assert_eq!(half_width(&every(33_000_000)), Some(4 * 33_000_000));
    let mut late = every(1_000_000);
    late.iter_mut().step_by(10).skip(1).for_each(|stamp| *stamp += 400_000);
    assert_eq!(half_width(&late), Some(2 * HALF_NS));
    assert_eq!([half_width(&[]), half_width(&[5]), half_width(&[5, 5])], [None; 3]);
}
