//! Rows of an object against what made them: a simulated slide over a table.

use super::*;
use crate::likelihood::Setting;
use crate::likelihood::test_bench::{FRICTION, NOISE, slide, slides};

/// The slide under a friction that is searched.
fn clips(noise: PoseNoise) -> ObjectClips {
    slides(noise, vec![slide()], &[Setting::Friction])
}

fn residuals(clips: &ObjectClips, friction: f64, own: &[f64]) -> Vec<f64> {
    crate::likelihood::test_bench::residuals(clips, 0, &[friction], own)
}

/// A nuisance parameter alone, by its place in the list.
fn alone(clips: &ObjectClips, name: &str, value: f64) -> Vec<f64> {
    let effects = clips.random();
    let place = effects.random.iter().position(|effect| effect.name == name).expect("a parameter of that name");
    (0..effects.count()).map(|k| if k == place { value } else { 0.0 }).collect()
}

#[test]
fn rows_are_zero_for_the_twins_own_path_and_stand_pose_by_pose() {
    let clips = clips(NOISE);
    let (rows, out) = (clips.rows(0), residuals(&clips, FRICTION, &[]));
    assert_eq!((rows.len(), out.len()), (6 * 60, 6 * 60));
    assert!(rows.chunks(6).all(|pose| pose.iter().all(|row| row.stamp_ns == pose[0].stamp_ns)));
    assert!(rows.is_sorted_by_key(|row| row.stamp_ns));
    // What is left is the first motion, which is read off the poses.
    let largest = |out: &[f64]| out.iter().fold(0.0, |largest: f64, residual| largest.max(residual.abs()));
    let off = residuals(&clips, 1.3 * FRICTION, &[]);
    assert!(largest(&out) < 0.5 * largest(&off), "{} and under another friction {}", largest(&out), largest(&off));
}

#[test]
fn residuals_scale_with_the_trackers_noise() {
    let twice = PoseNoise { position: 2.0 * NOISE.position, rotation: 2.0 * NOISE.rotation };
    let [once, twice] = [NOISE, twice].map(|noise| residuals(&clips(noise), 1.3 * FRICTION, &[]));
    assert!(once.iter().zip(&twice).all(|(once, twice)| (once - 2.0 * twice).abs() <= 1e-9 * once.abs()));
}

#[test]
fn nuisance_parameters_move_what_they_say() {
    let clips = clips(NOISE);
    let rest = residuals(&clips, FRICTION, &[]);
    // A place that begins elsewhere is elsewhere at the first pose.
    let shifted = residuals(&clips, FRICTION, &alone(&clips, "start x", 1e-3));
    assert!((shifted[0] - rest[0] + 1e-3 / NOISE.position).abs() < 1e-6 && (shifted[1] - rest[1]).abs() < 1e-6);
    let turned = residuals(&clips, FRICTION, &alone(&clips, "start yaw", 0.01));
    assert!((turned[5] - rest[5] + 0.01 / NOISE.rotation).abs() < 1e-3, "{} {}", turned[5], rest[5]);
    // 10 ms later a velocity along y has led there.
    let faster = residuals(&clips, FRICTION, &alone(&clips, "first velocity y", 0.1));
    assert!((faster[7] - rest[7] + 1e-3 / NOISE.position).abs() < 0.2, "{} {}", faster[7], rest[7]);
    assert!(clips.random().random.iter().all(|effect| effect.name != "clock"), "an object alone keeps its own time");
}

#[test]
fn what_is_remembered_has_the_same_bits_as_simulating_it_anew() {
    let (asked, fresh) = (clips(NOISE), clips(NOISE));
    let first = residuals(&asked, FRICTION, &[]);
    for friction in [0.1, 0.2, 0.4, 0.5] {
        residuals(&asked, friction, &[]);
    }
    assert_eq!(residuals(&asked, FRICTION, &[]), first);
    assert_eq!(residuals(&fresh, 0.5, &[]), residuals(&asked, 0.5, &[]));
}
