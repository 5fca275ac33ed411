//! Scale estimates of logged signals, and velocities beside the slopes of positions, on signals of a known noise and delay.

use super::noise::{correlation_length, floor, of_clips, sigma};
use super::velocity::{Compared, Motion, late};
use proptest::prelude::*;
use rand::SeedableRng as _;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

fn white(seed: u64, count: usize) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..count).map(|_| random.sample(StandardNormal)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// A motion that turns round, as those of joints do: the steps of one that never does pass for those of a coarse encoder.
    #[test]
    fn a_scale_is_found_within_a_seventh_whatever_the_motion_below_it(
        seed in 0_u64..1000, size in 2e-5..1e-2_f64, middle in -1.0..1.0_f64, swing in -1.0..1.0_f64, phase in 0.0..6.0_f64,
    ) {
        let motion = |row: usize| middle + swing * (3.0 * (row as f64 * 1e-3) + phase).sin();
        let signal: Vec<f64> = white(seed, 3000).iter().enumerate().map(|(row, noise)| motion(row) + size * noise).collect();
        prop_assert!((sigma(&signal) / size - 1.0).abs() < 0.15, "{} of {size}", sigma(&signal));
    }

    #[test]
    fn a_scale_goes_with_the_unit_and_neither_offset_nor_order_of_time_changes_it(
        seed in 0_u64..1000, unit in 1e-3..1e3_f64, offset in -10.0..10.0_f64,
    ) {
        let signal = white(seed, 500);
        let mut other: Vec<f64> = signal.iter().map(|value| unit * value).collect();
        prop_assert!((sigma(&other) / (unit * sigma(&signal)) - 1.0).abs() < 1e-9);
        other.reverse();
        prop_assert!((sigma(&other) / (unit * sigma(&signal)) - 1.0).abs() < 1e-9);
        let moved: Vec<f64> = signal.iter().map(|value| value + offset).collect();
        prop_assert!((sigma(&moved) / sigma(&signal) - 1.0).abs() < 1e-6);
    }

    /// A fortieth of the rows are wrong by any amount.
    #[test]
    fn outliers_and_rows_that_are_no_numbers_do_not_decide_the_scale(
        seed in 0_u64..1000, far in 10.0..1e6_f64, lost in any::<bool>(),
    ) {
        let mut signal = white(seed, 4000);
        let whole = sigma(&signal);
        let value = if lost { f64::NAN } else { far };
        signal.iter_mut().step_by(40).for_each(|row| *row = value);
        prop_assert!((sigma(&signal) / whole - 1.0).abs() < 0.3, "{} {whole}", sigma(&signal));
    }

    /// Neighbours that share a part of each other, each step by the same factor.
    #[test]
    fn as_many_rows_say_the_same_as_their_correlation_makes_of_it(seed in 0_u64..200, keeps in 0.0..0.9_f64) {
        let mut last = 0.0;
        let rows: Vec<f64> = white(seed, 8000).into_iter().map(|drawn| { last = keeps * last + drawn; last }).collect();
        let expected = (1.0 + keeps) / (1.0 - keeps);
        let found = correlation_length(&rows);
        prop_assert!((0.4..2.5).contains(&(found / expected)), "{found} and {expected}");
        let scaled: Vec<f64> = rows.iter().map(|row| -3.0 * row).collect();
        prop_assert!((correlation_length(&scaled) - found).abs() < 1e-9);
    }

    #[test]
    fn a_velocity_of_another_unit_and_delay_is_found_by_both(
        factor in prop_oneof![0.6..2.0_f64, -2.0..-0.6_f64], delay in -0.008..0.008_f64, rate in 200.0..1000.0_f64,
    ) {
        let found = compared(rate, |t| factor * speed(t - delay)).expect("it moves");
        prop_assert!((found.factor.value - factor).abs() < 0.03 * factor.abs(), "{found:?}");
        prop_assert!((found.delay.value - delay).abs() < 2e-3, "{found:?} {delay}");
        let off = (factor - 1.0).abs();
        prop_assert!((0.4..0.6).contains(&off) || found.is_not_its_slope() == (off > 0.5), "{found:?}");
    }
}

fn place(t: f64) -> f64 {
    0.3 * (5.0 * t).sin() + 0.1 * (11.0 * t).sin()
}

fn speed(t: f64) -> f64 {
    1.5 * (5.0 * t).cos() + 1.1 * (11.0 * t).cos()
}

fn compared(rate: f64, dq: impl Fn(f64) -> f64) -> Option<Compared> {
    let t: Vec<f64> = (0..(5.0 * rate) as usize).map(|row| row as f64 / rate).collect();
    let [q, dq]: [Vec<f64>; 2] = [t.iter().map(|t| place(*t)).collect(), t.iter().map(|t| dq(*t)).collect()];
    Motion { t: &t, q: &q, dq: &dq, noise: 1e-6 }.compared(0)
}

#[test]
fn most_joints_have_to_be_late_before_velocities_count_as_filtered() {
    let of = |delay: f64| compared(500.0, move |t| speed(t - delay)).expect("it moves");
    let joints = |delays: &[f64]| delays.iter().map(|delay| of(*delay)).collect::<Vec<_>>();
    let found = late(&joints(&[0.012, 0.013, 0.011]), 2e-3).expect("late");
    assert!((found.delay - 0.012).abs() < 1e-3 && found.interval[0] < found.delay && found.delay < found.interval[1]);
    assert_eq!(late(&joints(&[0.012, 0.0, 0.0]), 2e-3), None, "one of three");
    assert_eq!(late(&joints(&[0.001, 0.001, 0.001]), 2e-3), None, "half a step is no filter");
    assert_eq!(late(&joints(&[0.012, 0.012, 0.012]), 0.02), None, "less than a step of a slow log");
    assert_eq!(late(&[], 1e-3), None);
}

#[test]
fn a_joint_that_hardly_moves_is_not_compared() {
    let t: Vec<f64> = (0..1000).map(|row| f64::from(row) * 1e-3).collect();
    let still = vec![0.7; 1000];
    assert_eq!(Motion { t: &t, q: &still, dq: &still, noise: 1e-6 }.compared(2), None);
    let q: Vec<f64> = t.iter().map(|t| place(*t)).collect();
    assert_eq!(Motion { t: &t, q: &q, dq: &q, noise: 0.1 }.compared(2), None, "beside so much noise");
    assert_eq!(Motion { t: &t[..3], q: &q[..3], dq: &q[..3], noise: 1e-6 }.compared(2), None);
    assert_eq!(Motion { t: &[], q: &[], dq: &[], noise: 1e-6 }.compared(2), None);
}

#[test]
fn scales_of_short_constant_and_coarse_signals_are_what_can_be_known() {
    assert_eq!([sigma(&[]), sigma(&[1.0, 2.0, 4.0]), sigma(&[0.5; 100])], [0.0; 3]);
    for step in [1e-5, 2e-3] {
        let stairs: Vec<f64> = (0..2000).map(|row| (f64::from(row) * 0.07).floor() * step).collect();
        assert!((sigma(&stairs) - step / 12.0_f64.sqrt()).abs() < 1e-9 * step, "{step}");
    }
    // Of an even number of clips the larger of the middle ones.
    assert_eq!(of_clips([2.0, 0.0, 1.0].into_iter()), 2.0);
    assert_eq!(of_clips(std::iter::empty()), 0.0);
    assert!(floor("q") < floor("tau_J") && floor("tau") == floor("tau_J_d") && floor("dq") > 0.0);
    assert_eq!((correlation_length(&[]), correlation_length(&[0.0; 50])), (1.0, 1.0));
}
