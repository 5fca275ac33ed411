//! Which clips are fitted and which are held out. A clip is never torn apart, and repeats of one motion stay together:
//! a clip whose twin was fitted is no test.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use shared_mem::recording::Clip;

/// Share of the motions that is held out.
const HELD_OUT: f64 = 0.25;
/// Commands are compared at so many places.
const PLACES: usize = 24;
/// Commands that differ by less are one motion [rad].
const SAME: f64 = 2e-3;
/// Lengths that differ by less are one motion's, as a share.
const SAME_LENGTH: f64 = 0.02;

/// Numbers of the clips, ascending.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Split {
    /// To be fitted.
    pub train: Vec<usize>,
    /// To be held out; empty where there is only one motion.
    pub holdout: Vec<usize>,
}

/// Holds a quarter of the motions out, at least one of two. The same seed draws the same.
pub fn split(clips: &[&Clip], seed: u64) -> Split {
    let groups = groups(clips);
    let mut order: Vec<usize> = (0..groups.len()).collect();
    let mut random = Pcg64::seed_from_u64(seed);
    for i in (1..order.len()).rev() {
        order.swap(i, random.random_range(0..=i));
    }
    let out = if groups.len() < 2 { 0 } else { ((HELD_OUT * groups.len() as f64).round() as usize).max(1) };
    let pick = |numbers: &[usize]| {
        let mut clips: Vec<usize> = numbers.iter().flat_map(|group| groups[*group].clone()).collect();
        clips.sort_unstable();
        clips
    };
    Split { train: pick(&order[out..]), holdout: pick(&order[..out]) }
}

/// Clips by motion, in the order of the first clip of each.
fn groups(clips: &[&Clip]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for i in 0..clips.len() {
        match groups.iter_mut().find(|group| same_motion(clips[group[0]], clips[i])) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

fn same_motion(a: &Clip, b: &Clip) -> bool {
    let (a, b) = (&a.desired, &b.desired);
    let (long, short) = (a.duration().max(b.duration()), a.duration().min(b.duration()));
    if a.dof != b.dof || a.len() < PLACES || b.len() < PLACES || short < (1.0 - SAME_LENGTH) * long {
        return false;
    }
    let near = |place: usize| {
        let row = |n: usize| (n - 1) * place / (PLACES - 1);
        a.q_row(row(a.len())).iter().zip(b.q_row(row(b.len()))).all(|(a, b)| (a - b).abs() < SAME)
    };
    (0..PLACES).all(near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::ClipKind;
    use shared_mem::recording::{JointSeries, ObjectSeries};

    fn clip(speed: f64) -> Clip {
        let stamps_ns: Vec<u64> = (0..100).map(|i| i * 10_000_000).collect();
        let q = (0..100).map(|i| (speed * f64::from(i) * 0.01).sin()).collect();
        let desired = JointSeries { stamps_ns, dof: 1, q, ..JointSeries::default() };
        Clip {
            file: "clip.mcap".into(),
            kind: ClipKind::Excitation,
            torques_end_at_rows: false,
            origins: shared_mem::origin::Origins::default(),
            joint_names: vec!["a".into()],
            measured: desired.clone(),
            desired,
            object: ObjectSeries::default(),
            others: Vec::new(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    #[test]
    fn a_quarter_of_the_motions_is_held_out_and_repeats_stay_together() {
        let clips: Vec<Clip> = [1.0, 2.0, 1.0, 3.0, 4.0].map(clip).into();
        let all: Vec<&Clip> = clips.iter().collect();
        for seed in 0..20 {
            let Split { train, holdout } = split(&all, seed);
            assert_eq!(train.len() + holdout.len(), 5);
            assert_eq!(train.contains(&0), train.contains(&2), "seed {seed}");
            assert!((1..=2).contains(&holdout.len()));
        }
        assert_ne!(split(&all, 1), split(&all, 2));
    }

    #[test]
    fn a_single_motion_leaves_nothing_to_hold_out() {
        let clip = clip(1.0);
        assert_eq!(split(&[&clip, &clip], 0), Split { train: vec![0, 1], holdout: vec![] });
    }
}
