//! Mounts that are known, found again from simulated pictures.

use super::chain::Chain;
use super::fit::{Fit, NoFit, fit};
use super::simulated::{World, off};
use super::view::View;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::SeedableRng as _;
use rand_pcg::Pcg64;
use shared_mem::hand_eye::Mount;

const USUAL: World =
    World { mount: Mount::EyeInHand, views: 12, pixel: 0.1, arm: [1e-3, 0.5e-3], turns: [0.5, 0.5, 1.0] };

fn drawn(world: &World, seed: u64) -> (Chain, Vec<View>) {
    world.draw(&mut Pcg64::seed_from_u64(seed))
}

fn inside(found: &Fit, truth: &Chain) -> [bool; 6] {
    let off = off(&found.chain.camera, &truth.camera);
    std::array::from_fn(|k| off[k].abs() <= found.half_width[k])
}

#[test]
fn exact_pictures_give_the_mount_exactly() {
    for mount in [Mount::EyeInHand, Mount::FixedCamera] {
        for views in [3, 5, 12] {
            let (truth, views) = drawn(&World { mount, views, pixel: 0.0, arm: [0.0; 2], ..USUAL }, 3);
            let found = fit(mount, &views).expect("a mount");
            let off = off(&found.chain.camera, &truth.camera);
            assert!(off.iter().all(|off| off.abs() < 1e-6), "{mount:?} {off:?}");
        }
    }
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    for (mount, views) in [(Mount::EyeInHand, 8), (Mount::FixedCamera, 15)] {
        let mut hits = [0; 6];
        for seed in 0..240 {
            let (truth, views) = drawn(&World { mount, views, ..USUAL }, seed);
            let found = fit(mount, &views).expect("a mount");
            inside(&found, &truth).iter().zip(&mut hits).for_each(|(inside, hits)| *hits += u32::from(*inside));
        }
        // 216 of 240, and 21 are more than four sigmas of a binomial.
        assert!(hits.iter().all(|hits| (195..=231).contains(hits)), "{mount:?} {hits:?}");
        assert!((1240..=1350).contains(&hits.iter().sum::<u32>()), "{mount:?} {hits:?}");
    }
}

#[test]
fn turns_about_one_axis_or_none_leave_the_mount_open() {
    for seed in 0..20 {
        let (_, views) = drawn(&World { turns: [0.0, 0.0, 1.0], ..USUAL }, seed);
        match fit(USUAL.mount, &views) {
            Ok(found) => {
                let open = found.open.first().expect("an open direction");
                assert!(open.half_width[1] > 0.02, "{open:?}");
                // The shift along the axis of the turns, which is the camera's own.
                let axis = found.chain.camera.rotation * Vector3::z();
                let shift = Vector3::new(open.direction[3], open.direction[4], open.direction[5]).normalize();
                assert!(shift.dot(&axis).abs() > 0.9, "{seed} {shift:?} {axis:?}");
                assert!(found.spread[0] > 0.3 && found.spread[1] < 0.02, "{:?}", found.spread);
            }
            Err(why) => assert_eq!(why, NoFit::OneAxis),
        }
        let (_, views) = drawn(&World { turns: [0.02; 3], arm: [2e-3, 1e-3], ..USUAL }, seed);
        match fit(USUAL.mount, &views) {
            Ok(found) => assert!(!found.open.is_empty(), "{:?}", found.half_width),
            Err(why) => assert!(matches!(why, NoFit::Alike | NoFit::Inconsistent), "{why}"),
        }
        let (_, views) = drawn(&USUAL, seed);
        assert!(fit(USUAL.mount, &views).expect("an answer").open.is_empty());
    }
}

#[test]
fn wrong_pictures_are_found_and_do_no_harm() {
    let (mut missed, mut accused, mut outside) = (0, 0, 0);
    for seed in 0..60 {
        let (truth, mut views) = drawn(&USUAL, seed);
        // One picture of an arm that still moved, by 10 mm and 1 degree; or two pictures whose poses were swapped.
        let wrong: &[usize] = if seed % 2 == 0 { &[4] } else { &[2, 7] };
        if let [first, second] = *wrong {
            let (a, b) = (views[first].base_from_end_effector, views[second].base_from_end_effector);
            (views[first].base_from_end_effector, views[second].base_from_end_effector) = (b, a);
        } else {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.012, -0.012, 0.0));
            views[wrong[0]].base_from_end_effector *= Translation3::new(0.006, -0.006, 0.005) * turn;
        }
        let found = fit(USUAL.mount, &views).expect("a mount");
        missed += wrong.iter().filter(|k| found.views[**k].used).count();
        accused += (0..views.len()).filter(|k| !wrong.contains(k) && !found.views[*k].used).count();
        outside += inside(&found, &truth).iter().filter(|inside| !**inside).count();
    }
    assert!(missed == 0 && accused <= 3, "{missed} missed, {accused} good ones left out");
    assert!(outside <= 60, "{outside} of 360 numbers outside of their intervals");
}

#[test]
fn wrong_corners_and_what_cannot_be_are_seen() {
    let (truth, mut views) = drawn(&USUAL, 1);
    for (number, view) in views.iter_mut().enumerate() {
        view.seen[number].pixel[0] += 9.0;
    }
    let found = fit(USUAL.mount, &views).expect("a mount");
    assert!(inside(&found, &truth).iter().filter(|inside| **inside).count() >= 4 && found.pixel < 0.15);
    assert_eq!(fit(USUAL.mount, &views[..2]).expect_err("two pictures"), NoFit::Few(2));
    // The board is held by the arm and not the camera.
    let error = fit(Mount::FixedCamera, &views).map(|found| found.arm.position);
    assert!(error.is_err() || error.is_ok_and(|sigma| sigma > 0.03));
}
