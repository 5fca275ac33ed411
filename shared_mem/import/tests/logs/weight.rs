//! The weight in an arm's torques: whichever way it pulls is found, and nothing is explained that was not measured.

use import::weight::{Finding, Moment, Weight};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

const DOWN: [f64; 3] = [0.0, 0.0, -9.81];

/// A column that turns about the base's z, with two arms that lean about its y: first moments of mass [kg m], and the torques that
/// hold them for 1 m/s² along an axis.
const MOMENTS: [f64; 2] = [1.9, 0.7];

fn holds([turn, shoulder, elbow]: [f64; 3], axis: usize) -> [f64; 3] {
    let pull = std::array::from_fn::<f64, 3, _>(|k| if k == axis { 1.0 } else { 0.0 });
    // Potential energy -m p(q) . a: its slope is the torque that holds.
    let energy = |q: [f64; 3]| {
        let out = MOMENTS[0] * q[1].sin() + MOMENTS[1] * (q[1] + q[2]).sin();
        let up = MOMENTS[0] * q[1].cos() + MOMENTS[1] * (q[1] + q[2]).cos();
        -(out * q[0].cos() * pull[0] + out * q[0].sin() * pull[1] + up * pull[2])
    };
    std::array::from_fn(|joint| {
        let mut at = [[turn, shoulder, elbow]; 2];
        at[0][joint] -= 1e-6;
        at[1][joint] += 1e-6;
        (energy(at[1]) - energy(at[0])) / 2e-6
    })
}

/// An arm that moves, with friction and noise, under a pull; `of` changes its torques.
fn moments(seed: u64, pull: [f64; 3], of: impl Fn(usize, f64) -> f64) -> Vec<Moment> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let sines: Vec<[f64; 2]> = (0..3).map(|_| [rng.random_range(0.5..2.0), rng.random_range(0.0..6.0)]).collect();
    let friction: Vec<f64> = (0..3).map(|_| rng.random_range(0.05..0.5)).collect();
    (0..300)
        .map(|i| {
            let t = f64::from(i) * 0.05;
            let at = |f: &dyn Fn(f64, f64) -> f64| -> [f64; 3] { std::array::from_fn(|j| f(sines[j][0], sines[j][1])) };
            let q = at(&|w, phase| 0.9 * (w * t + phase).sin());
            let dq = at(&|w, phase| 0.9 * w * (w * t + phase).cos());
            let ddq = at(&|w, phase| -0.9 * w * w * (w * t + phase).sin());
            let axes = [0, 1, 2].map(|axis| holds(q, axis));
            let tau = (0..3).map(|j| {
                let weight: f64 = (0..3).map(|k| axes[k][j] * pull[k]).sum();
                let motion = 0.2 * ddq[j] * q[(j + 1) % 3].cos();
                of(j, weight + motion + friction[j] * dq[j].signum() + 0.05 * ddq[j])
                    + 0.05 * (rng.random_range(-1.0..1.0))
            });
            Moment {
                tau: tau.collect(),
                holds: axes.map(|axis| axis.to_vec()),
                // Another inertia than the joints' own, so that the motion is told.
                motion: (0..3).map(|j| 0.2 * ddq[j] * q[(j + 1) % 3].cos()).collect(),
                dq: dq.to_vec(),
                ddq: ddq.to_vec(),
            }
        })
        .collect()
}

fn found(seed: u64, pull: [f64; 3], of: impl Fn(usize, f64) -> f64) -> (Weight, Finding) {
    let weight = Weight::of(&moments(seed, pull, of)).expect("a fit");
    let finding = weight.finding(DOWN);
    (weight, finding)
}

#[test]
fn whichever_way_the_weight_pulls_is_found_within_its_interval() {
    let mut held = 0;
    for seed in 0..60 {
        let mut rng = Pcg64::seed_from_u64(1000 + seed);
        let pull = std::array::from_fn(|_| rng.random_range(-10.0..10.0));
        let (weight, _) = found(seed, pull, |_, tau| tau);
        held += (0..3).filter(|k| (weight.pull[*k] - pull[*k]).abs() < weight.half[*k]).count();
        assert!((0..3).all(|k| (weight.pull[k] - pull[k]).abs() < 1.5), "{pull:?} {weight:?}");
    }
    assert!(held > 160, "{held} of 180 intervals hold the truth");
}

#[test]
fn all_of_it_none_of_it_and_another_way_are_three_findings() {
    for seed in 0..20 {
        assert!(matches!(found(seed, DOWN, |_, tau| tau).1, Finding::Whole(share) if (share - 1.0).abs() < 0.1));
        assert!(matches!(found(seed, [0.0; 3], |_, tau| tau).1, Finding::Absent(share) if share.abs() < 0.1), "{seed}");
        let (weight, finding) = found(seed, [9.81, 0.0, 0.0], |_, tau| tau);
        assert_eq!(finding, Finding::Elsewhere, "{weight:?}");
        assert!(weight.in_words().starts_with("along +x of the base by 9."), "{}", weight.in_words());
        let (weight, finding) = found(seed, [0.0, 0.0, 9.81], |_, tau| tau);
        assert!(finding == Finding::Elsewhere && weight.in_words().contains("+z of the base"), "{weight:?}");
    }
}

#[test]
fn a_direction_that_the_moments_leave_open_is_not_another_way() {
    let leaning = |angle: f64| [9.81 * angle.sin(), 0.0, -9.81 * angle.cos()];
    let mut another = 0;
    for seed in 0..40 {
        assert_eq!(found(seed, leaning(0.62), |_, tau| tau).1, Finding::Elsewhere, "seen within a degree");
        // Few and noisy moments: the direction is known within some 5 degrees.
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut few: Vec<Moment> = moments(seed, leaning(0.54), |_, tau| tau).into_iter().step_by(10).collect();
        few.iter_mut().flat_map(|moment| &mut moment.tau).for_each(|tau| *tau += rng.random_range(-4.0..4.0));
        let weight = Weight::of(&few).expect("a fit");
        another += usize::from(weight.finding(DOWN) == Finding::Elsewhere);
    }
    assert!(another <= 8, "{another} of 40 noisy sessions of a base that leans by 31 degrees");
}

#[test]
fn a_joint_that_is_turned_and_a_missing_torque_constant_are_named() {
    for seed in 0..20 {
        let turned = found(seed, DOWN, |joint, tau| if joint == 2 { -tau } else { tau });
        assert!(matches!(turned.1, Finding::Turned(2, factor) if (factor + 1.0).abs() < 0.2), "{turned:?}");
        let one = found(seed, DOWN, |joint, tau| if joint == 2 { 0.12 * tau } else { tau });
        assert!(matches!(one.1, Finding::Scaled(Some(2), factor) if (factor - 0.12).abs() < 0.05), "{one:?}");
        let all = found(seed, DOWN, |_, tau| 12.0 * tau);
        assert!(matches!(all.1, Finding::Scaled(None, factor) if (factor - 12.0).abs() < 1.0), "{all:?}");
    }
}

#[test]
fn one_joint_that_is_turned_is_never_gravity_that_was_taken_off() {
    for seed in 0..40 {
        for odd in 1..3 {
            let (weight, finding) = found(seed, DOWN, |joint, tau| if joint == odd { -tau } else { tau });
            assert!(matches!(finding, Finding::Turned(joint, _) if joint == odd), "{seed} {odd}: {finding:?}");
            assert_eq!(weight.turned(DOWN).len(), 1);
        }
    }
}

#[test]
fn torques_that_are_turned_are_told_from_a_base_that_hangs_by_their_motion() {
    for seed in 0..20 {
        let (weight, finding) = found(seed, DOWN, |_, tau| -tau);
        assert!(matches!(finding, Finding::Scaled(None, factor) if (factor + 1.0).abs() < 0.1), "{seed}: {finding:?}");
        assert_eq!(found(seed, [0.0, 0.0, 9.81], |_, tau| tau).1, Finding::Elsewhere, "{weight:?}");
        for (factor, unit) in [(100.0, "N cm"), (1e3, "mN m"), (10.197, "kgf cm")] {
            let (weight, finding) = found(seed, DOWN, |_, tau| factor * tau);
            let Finding::Scaled(None, seen) = finding else { panic!("{seed}: {finding:?} {weight:?}") };
            assert!(import::weight::meaning(seen).contains(unit), "{seen}");
        }
    }
}

#[test]
fn noise_is_no_torque_without_gravity() {
    for seed in 0..40 {
        let mut rng = Pcg64::seed_from_u64(500 + seed);
        let mut noise = moments(seed, DOWN, |_, tau| tau);
        for moment in &mut noise {
            moment.tau = (0..3).map(|_| rng.random_range(-0.1..0.1)).collect();
        }
        assert_eq!(Weight::of(&noise).expect("a fit").finding(DOWN), Finding::Noise, "{seed}");
    }
}

#[test]
fn an_arm_that_stands_still_does_not_tell() {
    let still: Vec<Moment> = moments(1, DOWN, |_, tau| tau)
        .into_iter()
        .map(|moment| Moment {
            dq: vec![0.0; 3],
            ddq: vec![0.0; 3],
            holds: [0, 1, 2].map(|axis| holds([0.0, 1e-3, 0.0], axis).to_vec()),
            ..moment
        })
        .collect();
    let finding = Weight::of(&still).expect("a fit").finding(DOWN);
    assert!(matches!(finding, Finding::NotTold | Finding::Partly(_)), "{finding:?}");
}

#[test]
fn numbers_that_are_none_have_no_weight() {
    for odd in [f64::NAN, f64::INFINITY, 1e308, 1e-310] {
        let mut all = moments(1, DOWN, |_, tau| tau);
        all[7].tau[1] = odd;
        all[9].holds[2][0] = odd;
        if let Some(weight) = Weight::of(&all) {
            let _finding = (weight.finding(DOWN), weight.in_words());
        }
    }
    assert_eq!(Weight::of(&[]), None);
}
