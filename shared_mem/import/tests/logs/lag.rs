//! The lag between command and motion: its interval holds the truth at its level, and where the motion does not tell the lag
//! that is what is said.

use import::lag::{self, Lag, Motion};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Joints over time, each a sum of sines about a stroke.
struct Drawn {
    strokes: Vec<[f64; 3]>,
    sines: Vec<Vec<[f64; 3]>>,
}

impl Drawn {
    fn new(rng: &mut Pcg64) -> Self {
        let joints = rng.random_range(1..6);
        let goes_back = rng.random_range(0.0..1.0) < 0.7;
        let stroke = |rng: &mut Pcg64| [-1.0, 0.0, 0.0].map(|_: f64| rng.random_range(-0.4..0.4));
        let sine =
            |rng: &mut Pcg64| [rng.random_range(0.05..0.3), rng.random_range(0.2..12.0), rng.random_range(0.0..6.3)];
        let sines = |rng: &mut Pcg64| (0..if goes_back { 3 } else { 0 }).map(|_| sine(rng)).collect();
        Self { strokes: (0..joints).map(|_| stroke(rng)).collect(), sines: (0..joints).map(|_| sines(rng)).collect() }
    }

    fn at(&self, joint: usize, t: f64) -> f64 {
        let [a, b, c] = self.strokes[joint];
        let sines = self.sines[joint].iter().map(|[size, w, phase]| size * (w * t + phase).sin());
        a + b * t + c * t * t + sines.sum::<f64>()
    }
}

fn normal(rng: &mut Pcg64) -> f64 {
    // The sum of twelve even draws: normal as far as three sigmas, which is all that matters here.
    (0..12).map(|_| rng.random_range(0.0..1.0_f64)).sum::<f64>() - 6.0
}

/// Times, commands, and the motion that comes so much later, with noise.
type Made = (Vec<f64>, Vec<Vec<f64>>, Vec<Vec<f64>>);

fn made(
    (seconds, rate): (f64, f64),
    joints: usize,
    at: &dyn Fn(usize, f64) -> f64,
    lag: &dyn Fn(usize) -> f64,
    noise: &mut dyn FnMut() -> f64,
) -> Made {
    let t: Vec<f64> = (0..(seconds * rate) as usize).map(|i| i as f64 / rate).collect();
    let told = (0..joints).map(|joint| t.iter().map(|t| at(joint, *t)).collect()).collect();
    let done = (0..joints).map(|joint| t.iter().map(|t| at(joint, t - lag(joint)) + noise()).collect()).collect();
    (t, told, done)
}

fn between((t, told, done): &Made) -> Option<Lag> {
    lag::between(Motion { t, q: told }, Motion { t, q: done })
}

#[test]
fn the_interval_holds_the_truth_at_its_level_over_random_motions_lags_and_noise() {
    let (mut held, mut all, mut open, mut shifted, mut still) = (0, 0, 0, 0, 0);
    for seed in 0..400 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let drawn = Drawn::new(&mut rng);
        let truth = rng.random_range(-0.15..0.15_f64);
        let sigma = 10f64.powf(rng.random_range(-5.0..-2.7));
        let size = (rng.random_range(2.0..12.0), [1000.0, 250.0, 50.0][rng.random_range(0..3)]);
        let mut noise = || sigma * normal(&mut rng);
        let made = made(size, drawn.strokes.len(), &|joint, t| drawn.at(joint, t), &|_| truth, &mut noise);
        let Some(lag) = between(&made) else { continue };
        assert!(lag.interval[0] <= lag.seconds && lag.seconds <= lag.interval[1], "{seed}: {lag:?}");
        all += 1;
        if lag.open {
            open += 1;
            continue;
        }
        held += usize::from((lag.interval[0]..=lag.interval[1]).contains(&truth));
        // A shift is made where the whole interval lies before no lag.
        shifted += usize::from(lag.interval[1] < 0.0);
        still += usize::from(lag.interval[1] < 0.0 && truth > 0.0);
    }
    let told = all - open;
    let share = f64::from(held as u32) / f64::from(told as u32);
    // Of 95 % within three sigmas of a count of 300.
    assert!(share > 0.92, "{held} of {told} intervals hold the truth ({open} tell none)");
    assert!(told > 250 && shifted > 100, "{told} {shifted}");
    assert!(still <= 1 + told / 100, "{still} arms that are late would be shifted");
}

#[test]
fn an_even_motion_one_way_and_one_that_repeats_itself_tell_no_lag() {
    let mut rng = Pcg64::seed_from_u64(7);
    let mut noise = || 2e-4 * normal(&mut rng);
    let even = made((3.0, 500.0), 3, &|joint, t| 0.1 * joint as f64 + 0.3 * t, &|_| -0.08, &mut noise);
    let lag = between(&even).expect("a motion");
    assert!(lag.open, "{lag:?}");
    let sine = made((12.0, 250.0), 2, &|_, t| 0.4 * (std::f64::consts::TAU * t).sin(), &|_| 0.03, &mut noise);
    let lag = between(&sine).expect("a motion");
    assert!((lag.seconds - 0.03).abs() < 3e-3, "{lag:?}");
    assert!(lag.open || (lag.interval[0] < -0.9 && lag.interval[1] > 0.9), "{lag:?}");
}

#[test]
fn one_accelerating_stroke_that_leads_its_commands_is_told_within_an_interval_that_holds_it() {
    for seed in 0..20 {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut noise = || 1.5e-4 * normal(&mut rng);
        let stroke = |joint: usize, t: f64| {
            let slow = 0.3 - 0.02 * joint as f64;
            -1.3 + 0.02 * joint as f64 + slow * t + 0.12 * t * t + 0.01 * t * t * t
        };
        let lag = between(&made((2.3, 1000.0), 4, &stroke, &|_| -0.05, &mut noise)).expect("a motion");
        let holds = (lag.interval[0]..=lag.interval[1]).contains(&-0.05);
        assert!(lag.open || (holds && lag.interval[1] < -0.02), "{seed}: {lag:?}");
    }
}

#[test]
fn joints_with_lags_of_their_own_are_groups() {
    let mut rng = Pcg64::seed_from_u64(3);
    let drawn = Drawn {
        strokes: vec![[0.0; 3]; 6],
        sines: (0..6)
            .map(|j| vec![[0.3, 2.0 + 0.4 * f64::from(j), 0.5 * f64::from(j)], [0.1, 7.0 - 0.3 * f64::from(j), 1.0]])
            .collect(),
    };
    let own = |joint: usize| if joint < 3 { 0.011 } else { 0.019 };
    let mut noise = || 1e-4 * normal(&mut rng);
    let (t, told, done) = made((10.0, 500.0), 6, &|joint, t| drawn.at(joint, t), &own, &mut noise);
    let [told, done] = [&told, &done].map(|q| Motion { t: &t, q });
    let groups = lag::groups(told, done);
    assert_eq!(groups.iter().map(|group| group.joints.clone()).collect::<Vec<_>>(), [vec![0, 1, 2], vec![3, 4, 5]]);
    assert!((groups[0].seconds - 0.011).abs() < 1e-3 && (groups[1].seconds - 0.019).abs() < 1e-3, "{groups:?}");
    assert!(lag::in_words(&groups).contains("11 ms"), "{}", lag::in_words(&groups));
    let alike = made((10.0, 500.0), 6, &|joint, t| drawn.at(joint, t), &|_| 0.011, &mut noise);
    let groups = lag::groups(Motion { t: &alike.0, q: &alike.1 }, Motion { t: &alike.0, q: &alike.2 });
    assert_eq!(groups.len(), 1, "{groups:?}");
}

#[test]
fn numbers_that_are_none_are_no_motion() {
    let t: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.01).collect();
    for odd in [f64::NAN, f64::INFINITY, 1e308, 1e-310] {
        let mut q: Vec<f64> = t.iter().map(|t| t.sin()).collect();
        q[20] = odd;
        q[99] = -odd;
        let mut stamps = t.clone();
        stamps[150] = odd;
        for (t, q) in [(&t, &q), (&stamps, &q)] {
            let q = vec![q.clone()];
            let motion = Motion { t, q: &q };
            // Whatever comes of it, it comes.
            let _lag = (lag::between(motion, motion), lag::of_speeds(motion, motion), lag::groups(motion, motion));
        }
    }
}
