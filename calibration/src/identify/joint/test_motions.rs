//! Motions of a part whose friction and damping are known: what a law predicts of them, which of their rows count, and what is found.

use super::alone::{self, Alone};
use super::fit::{Found, held_out, scored};
use super::model::{Motion, Motions};
use super::noise::Noise;
use super::positions::Positions;
use super::tests::{joint, motions, pushed, three};
use super::together::{cut_to_agree, odd};
use inference::estimate::{ClipFit, ClipModel as _};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use twin::world::LoneJoint;

/// A slide whose weight does no work, that is let go with a velocity and seen so often until it has rested for a while.
fn let_go(law: &LoneJoint, velocity: f64, sigma: f64, seed: u64) -> Motion {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let times: Vec<f64> = (0..90).map(|row| f64::from(row) / 60.0).collect();
    let place = |time: &f64| law.after((0.2, velocity), *time).0;
    let positions = times.iter().map(|time| place(time) + sigma * random.sample::<f64, _>(StandardNormal)).collect();
    Motion { times, positions, sigma, joint: *law }
}

/// Several of them, of different strength.
fn several(law: &LoneJoint, sigma: f64, seed: u64) -> Vec<Motion> {
    [0.6, 1.0, 1.5].iter().enumerate().map(|(k, v)| let_go(law, *v, sigma, 10 * seed + k as u64)).collect()
}

fn noise_of(sigma: f64) -> Noise {
    let mut random = rand_pcg::Pcg64::seed_from_u64(77);
    let rows: Vec<f64> = (0..600).map(|_| sigma * random.sample::<f64, _>(StandardNormal)).collect();
    Noise::of(std::iter::once(rows.as_slice()))
}

fn found(motions: &[Motion], sigma: f64) -> Found {
    Found::of(motions, &noise_of(sigma)).expect("a fit")
}

/// Square of what numbers leave of motions, in sigmas, per row.
fn left(motions: &[Motion], numbers: [f64; 2]) -> f64 {
    let fits = scored(motions, numbers).expect("an answer");
    fits.iter().map(|fit| fit.chi2).sum::<f64>() / fits.iter().map(|fit| fit.rows).sum::<usize>() as f64
}

#[test]
fn numbers_that_are_right_leave_the_noise_and_others_ever_more() {
    for (seed, friction, damping) in [(1, 0.3, 0.5), (2, 0.5, 0.3), (3, 0.7, 0.4)] {
        let motions = several(&joint(true, friction, damping), 1e-3, seed);
        let noise = left(&motions, [friction, damping]);
        // Where a part stops its path has a kink, by which the search for its start may end early.
        assert!((0.7..1.6).contains(&noise), "{noise}");
        for side in [-1.0, 1.0] {
            let ever_more = [0.0, 0.1, 0.2, 0.4].map(|off| left(&motions, [friction * (1.0 + side * off), damping]));
            assert!(ever_more.is_sorted(), "{ever_more:?}");
        }
    }
}

/// Motions with other positions, in another unit.
fn seen_as(motions: &[Motion], unit: f64) -> Vec<Motion> {
    let of = |motion: &Motion| Motion {
        positions: motion.positions.iter().map(|q| unit * q).collect(),
        sigma: unit.abs() * motion.sigma,
        ..motion.clone()
    };
    motions.iter().map(of).collect()
}

/// Length has no unit of its own: what is seen in millimetres, with masses alike, is a friction so many times as large.
#[test]
fn friction_goes_with_the_unit_of_length_and_damping_does_not() {
    for (seed, unit) in [(1, 0.01), (2, 3.0), (3, 100.0)] {
        let motions = several(&joint(true, 0.5, 0.4), 1e-3, seed);
        let [here, there] = [found(&motions, 1e-3), found(&seen_as(&motions, unit), 1e-3)];
        let off = |k: usize, unit: f64| (here.numbers()[k] * unit - there.numbers()[k]).abs() / (unit * here.half[k]);
        assert!(off(0, unit) < 0.05 && off(1, 1.0) < 0.05, "{:?} {:?}", here.numbers(), there.numbers());
    }
}

#[test]
fn a_push_the_other_way_tells_the_same() {
    for seed in 0..3 {
        let motions = several(&joint(true, 0.5, 0.4), 1e-3, seed);
        let [here, there] = [found(&motions, 1e-3), found(&seen_as(&motions, -1.0), 1e-3)];
        for k in 0..2 {
            assert!((here.numbers()[k] - there.numbers()[k]).abs() < 0.02 * here.half[k]);
            assert!((here.half[k] / there.half[k] - 1.0).abs() < 0.02);
        }
    }
}

#[test]
fn a_motion_without_noise_is_predicted_to_the_bit_that_its_start_is_found_to() {
    for (slides, friction, damping) in [(true, 0.5, 0.4), (true, 0.5, 0.0), (true, 0.0, 0.8), (false, 0.05, 0.01)] {
        let law = joint(slides, friction, damping);
        let seen = Motion { sigma: 1e-3, ..let_go(&law, 1.2, 0.0, 1) };
        assert!(left(&[seen], [friction, damping]) < 1e-3, "{slides} {friction} {damping}");
    }
}

#[test]
fn slopes_of_friction_damping_and_a_start_are_those_of_central_differences() {
    let motions = several(&joint(false, 0.05, 0.02), 1e-3, 3);
    let (model, own) = (Motions(&motions), Motions::own());
    let unknowns = model.unknowns();
    let residuals = |shared: [f64; 2], own: [f64; 2]| {
        let mut out = Vec::new();
        model.residuals(0, &shared, &own, &mut out).expect("an answer");
        out
    };
    let at = [0.06, 0.025];
    let zero = [0.0; 2];
    for k in 0..2 {
        let step = unknowns[k].step;
        let turned = |by: f64| {
            let mut to = at;
            to[k] += by;
            residuals(to, zero)
        };
        let central =
            turned(step).iter().zip(turned(-step)).map(|(up, down)| ((up - down) / (2.0 * step)).powi(2)).sum::<f64>();
        let held = own.clone().map(|own| inference::estimate::Random { sigma: 0.0, ..own });
        let there = ClipFit::at(&model, 0, (&unknowns, &at), (&held, &zero)).expect("an answer");
        assert!(
            (there.information[(k, k)] / central - 1.0).abs() < 0.05,
            "{k}: {} {central}",
            there.information[(k, k)]
        );
    }
    // A start that lies a sigma further is a sigma further at once.
    let (rest, ahead) = (residuals(at, zero), residuals(at, [1.0, 0.0]));
    assert!((ahead[0] - rest[0] + 1.0).abs() < 1e-9, "{}", ahead[0] - rest[0]);
}

#[test]
fn the_order_of_motions_is_of_no_account_and_more_of_them_tell_more() {
    let law = joint(true, 0.5, 0.4);
    let motions = several(&law, 1e-3, 4);
    let mut turned = motions.clone();
    turned.rotate_left(1);
    let more = [motions.clone(), several(&law, 1e-3, 5)].concat();
    let [here, there, more] = [&motions, &turned, &more].map(|motions| found(motions, 1e-3));
    for k in 0..2 {
        assert!((here.numbers()[k] - there.numbers()[k]).abs() < 0.01 * here.half[k], "{:?}", there.numbers());
        assert!((here.half[k] / there.half[k] - 1.0).abs() < 0.01);
        assert!(more.half[k] < 0.9 * here.half[k], "{:?} {:?}", more.half, here.half);
        let truth = [0.5, 0.4][k];
        assert!((more.numbers()[k] - truth).abs() < more.half[k] && (more.numbers()[k] / truth - 1.0).abs() < 0.1);
        let [low, high] = more.interval(k);
        assert!(low >= 0.0 && (high + low - 2.0 * more.numbers()[k]).abs() < 1e-9);
        assert_eq!(more.open(k), None);
    }
}

#[test]
fn neither_number_is_negative_and_one_that_is_nothing_has_an_interval_from_there_on() {
    for (friction, damping) in [(0.5, 0.0), (0.0, 0.5)] {
        let found = found(&several(&joint(true, friction, damping), 1e-3, 6), 1e-3);
        for (k, truth) in [friction, damping].into_iter().enumerate() {
            let [low, high] = found.interval(k);
            assert!(low >= 0.0 && found.numbers()[k] >= 0.0 && low <= truth && truth <= high, "{k}: {low} {high}");
        }
    }
}

#[test]
fn each_motion_is_predicted_by_the_others_and_one_alone_by_none() {
    let motions = several(&joint(true, 0.5, 0.4), 1e-3, 7);
    let others = held_out(&motions).expect("three motions");
    assert!(others.len() == 3 && others.iter().all(|fit| fit.chi2 < 2.0 * fit.rows as f64));
    let together = scored(&motions, found(&motions, 1e-3).numbers()).expect("an answer");
    let whole = |fits: &[ClipFit]| fits.iter().map(|fit| fit.chi2).sum::<f64>();
    assert!(whole(&others) > whole(&together), "what was not fitted is off by more");
    assert!(held_out(&motions[..1]).is_none() && held_out(&[]).is_none());
}

#[test]
fn a_motion_of_another_friction_is_the_odd_one_and_those_of_one_joint_are_none() {
    let (law, easier) = (joint(true, 6.0, 0.4), joint(true, 0.1, 0.4));
    let mut motions = several(&law, 1e-3, 8);
    assert_eq!(odd(&motions), None);
    motions.insert(1, let_go(&easier, 1.2, 1e-3, 99));
    assert_eq!(odd(&motions), Some(1));
    assert_eq!(odd(&motions[..2]), None, "of two nobody knows which");
}

#[test]
fn rows_of_a_push_are_cut_off_and_rows_of_its_own_motion_stay() {
    let law = joint(false, 0.05, 0.02);
    for seed in 0..1 {
        let clips = three(&law, 0.002, seed);
        let noise = Noise::of(clips.iter().map(|clip| clip.positions.as_slice()));
        for clip in &clips {
            let own = alone::motions(clip, &law, &noise);
            let Some(Alone { rows, motion }) = own.last() else { panic!("no motion") };
            // The hand lets go at three quarters of a second.
            assert!(clip.times[rows.start] > 0.7 && clip.times[rows.start] < 1.1, "{}", clip.times[rows.start]);
            assert_eq!(motion.times.len(), rows.len());
            assert!(motion.times[0] == 0.0 && motion.positions[..] == clip.positions[rows.clone()]);
            assert!(motion.sigma >= noise.sigma);
            assert_eq!(own.last().and_then(|alone| alone.without_first(rows.len())), None);
            let shorter = own.last().and_then(|alone| alone.without_first(3)).expect("a shorter one");
            assert!(shorter.rows == (rows.start + 3..rows.end) && shorter.motion.times[0] == 0.0);
        }
    }
}

#[test]
fn motions_that_agree_stay_as_they_are() {
    let law = joint(true, 0.6, 0.4);
    let (own, noise) = motions(&three(&law, 0.002, 1), &law);
    let alone = |motion: &Motion| Alone { rows: 0..motion.times.len(), motion: motion.clone() };
    let mut all: Vec<Alone> = own.iter().map(alone).collect();
    let before = all.clone();
    cut_to_agree(&mut all, &noise);
    assert!(all == before && odd(&own).is_none());
    cut_to_agree(&mut [], &noise);
}

#[test]
fn noise_has_the_unit_of_its_rows_and_knows_no_offset() {
    let law = joint(false, 0.05, 0.02);
    let clips = three(&law, 0.003, 2);
    let of = |change: &dyn Fn(f64) -> f64| {
        let rows: Vec<Vec<f64>> =
            clips.iter().map(|clip| clip.positions.iter().map(|q| change(*q)).collect()).collect();
        Noise::of(rows.iter().map(Vec::as_slice))
    };
    let [plain, scaled, moved] = [of(&|q| q), of(&|q| 50.0 * q), of(&|q| q - 3.0)];
    assert!((0.8..1.2).contains(&(plain.sigma / 0.003)), "{plain:?}");
    assert!((scaled.sigma / (50.0 * plain.sigma) - 1.0).abs() < 1e-9 && (scaled.lasts() - plain.lasts()).abs() < 1e-9);
    assert!((moved.sigma / plain.sigma - 1.0).abs() < 1e-6);
    assert!(plain.independent(100) <= 100.0 && plain.independent(0) == 1.0 && plain.lasts() >= 1.0);
    let none = Noise::of(std::iter::empty());
    assert_eq!((none.sigma, none.lasts()), (0.0, 1.0));
}

#[test]
fn a_part_that_rests_twice_rests_where_it_rests() {
    let law = joint(false, 0.4, 0.01);
    let clip = pushed(&law, 2.5, 0.001, 9.0, 5);
    let noise = Noise::of(std::iter::once(clip.positions.as_slice()));
    let rests = alone::rests(&clip, &noise);
    let last = clip.positions[clip.positions.len() - 30..].iter().sum::<f64>() / 30.0;
    assert_eq!(rests.len(), 2, "{rests:?}");
    assert!(rests[0].abs() < 1e-3 && (rests[1] - last).abs() < 2e-3 && last > 0.1, "{rests:?} {last}");
    let still = Positions { positions: vec![0.3; clip.times.len()], ..clip };
    let rests = alone::rests(&still, &noise);
    assert!(rests.len() == 1 && (rests[0] - 0.3).abs() < 1e-12, "{rests:?}");
    assert!(alone::motions(&still, &law, &noise).is_empty());
}
