//! How often intervals hold the truth, over simulated studies of which it is known.

use evaluation::statistics::{LEVEL, Pairs, Share, difference, powered};
use rand::RngExt as _;
use rand_pcg::Pcg64;

const STUDIES: u64 = 2000;

/// Holds the share of studies in which an interval holds the truth against what it is to be; a study gives both.
fn covers(name: &str, mut study: impl FnMut(&mut Pcg64) -> (f64, [f64; 2])) {
    let holds = |seed: u64| {
        let (truth, [low, high]) = study(&mut Pcg64::new(u128::from(seed), 11));
        (low..=high).contains(&truth)
    };
    let share = Share::of((0..STUDIES).map(holds)).value();
    assert!((0.93..=0.97).contains(&share), "{name}: {share}");
}

fn trials(generator: &mut Pcg64, p: f64, count: u64) -> Share {
    Share::of((0..count).map(|_| generator.random_bool(p)))
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    covers("share", |generator| {
        let (p, count) = (generator.random_range(0.05..0.95), generator.random_range(20..100));
        (p, trials(generator, p, count).interval(LEVEL))
    });
    covers("difference", |generator| {
        let [p, q] = [(); 2].map(|()| generator.random_range(0.05..0.95));
        let [n, m] = [(); 2].map(|()| generator.random_range(20..100));
        let [_, low, high] = difference(trials(generator, p, n), trials(generator, q, m), LEVEL);
        (p - q, [low, high])
    });
    covers("difference of pairs", |generator| {
        // How hard a start is acts on both.
        let [p, q] = [(); 2].map(|()| generator.random_range(0.1..0.9));
        let shared = generator.random_range(0.0..0.9);
        let pairs = Pairs::of((0..60).map(|_| correlated(generator, [p, q], shared)));
        let [_, low, high] = pairs.difference(LEVEL);
        (p - q, [low, high])
    });
    covers("few real and many simulated", |generator| {
        let [p, q] = [(); 2].map(|()| generator.random_range(0.1..0.9));
        let shared = generator.random_range(0.0..0.9);
        let pairs: Vec<[bool; 2]> = (0..60).map(|_| correlated(generator, [p, q], shared)).collect();
        let more: Vec<bool> = (0..300).map(|_| generator.random_bool(q)).collect();
        (p, powered(&pairs, &more, LEVEL).expect("pairs").interval)
    });
}

/// Two outcomes of one start: with the chance `shared` one draw decides both.
fn correlated(generator: &mut Pcg64, [p, q]: [f64; 2], shared: f64) -> [bool; 2] {
    if generator.random_bool(shared) {
        let draw: f64 = generator.random();
        [draw < p, draw < q]
    } else {
        [generator.random_bool(p), generator.random_bool(q)]
    }
}
