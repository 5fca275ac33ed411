//! Where in a clip the part moves by itself. What pushes it is not recorded, so the last stretch of each motion counts, from the
//! earliest row on from which friction and weight alone explain it until it rests or runs into something.

use super::agreement::disagreement;
use super::model::{Motion, best_fit};
use super::noise::Noise;
use super::positions::Positions;
use std::ops::Range;
use twin::world::LoneJoint;

/// Rows to each side whose slope is the velocity: few for fast motions, more for slow ones (choices).
const SLOPE_ROWS: [usize; 3] = [2, 4, 8];
/// A part moves that is faster than noise makes it look by so many standard deviations (a choice).
const MOVING_SIGMAS: f64 = 5.0;
/// Rows of rest within a motion (a choice): it turns round, or a push goes on.
const MAX_PAUSE_ROWS: usize = 3;
/// A rest lasts at least so long, and a motion is taken with so much of the rest at its end [s] (a choice).
const REST_SECONDS: f64 = 0.3;
/// Fewest rows in which it moves, and least travel in standard deviations, of a motion of use (choices).
const MIN_ROWS: usize = 6;
const MIN_TRAVEL_SIGMAS: f64 = 20.0;
/// A motion is over once the part is slower than this share of its highest speed (a choice).
const END_SPEED_SHARE: f64 = 0.5;
/// At the beginning of a stretch a push may still go on without a trace: over so short a time that it moves the part by `a t² / 8` beside
/// a straight line, less than two standard deviations of a position.
const PUSH_FACTOR: f64 = 16.0;
/// Share of the way that is kept where its beginning is cut off (a choice).
pub(super) const MIN_KEPT_TRAVEL: f64 = 0.5;
/// A part runs into something if it is faster than this share of its highest speed before its last rows (a choice).
const IMPACT_SPEED_SHARE: f64 = 0.25;
/// Ends and beginnings that are tried.
const TRIED_ENDS: usize = 12;
const TRIED_BEGINNINGS: usize = 24;
/// A part's frame and the joint's law are not exact: residuals of this share of the travel count as noise (a choice).
const MODEL_ERROR_SHARE: f64 = 1e-3;

/// A motion and the rows of the clip that it is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Alone {
    pub(super) rows: Range<usize>,
    pub(super) motion: Motion,
}

/// Motions by itself in a clip, in their order.
pub(super) fn motions(clip: &Positions, joint: &LoneJoint, noise: &Noise) -> Vec<Alone> {
    let moving = moving(clip, noise);
    let starts = moving.iter().skip(1).map(|next| next.start).chain([clip.times.len()]);
    let of = |(rows, next): (&Range<usize>, usize)| last_free(clip, (joint, noise), rows, next);
    moving.iter().zip(starts).filter_map(of).collect()
}

/// Mean position of each stretch in which the part rests for a while [rad or m].
pub(super) fn rests(clip: &Positions, noise: &Noise) -> Vec<f64> {
    let moving = moving(clip, noise);
    let ends = std::iter::once(0).chain(moving.iter().map(|rows| rows.end));
    let starts = moving.iter().map(|rows| rows.start).chain([clip.times.len()]);
    let rest = |(from, to): (usize, usize)| {
        let rows = (from + SLOPE_ROWS[0])..to.saturating_sub(SLOPE_ROWS[0]);
        let lasts = rows.len() > SLOPE_ROWS[0] && clip.times[rows.end - 1] - clip.times[rows.start] >= REST_SECONDS;
        lasts.then(|| clip.positions[rows.clone()].iter().sum::<f64>() / rows.len() as f64)
    };
    ends.zip(starts).filter_map(rest).collect()
}

/// Slopes of lines through neighbouring rows [rad/s or m/s], and their standard deviations for positions of one.
fn velocities(clip: &Positions, around: usize) -> Vec<[f64; 2]> {
    let last = clip.times.len() - 1;
    let slope = |row: usize| {
        let rows = row.saturating_sub(around)..=(row + around).min(last);
        let count = rows.clone().count() as f64;
        let mean = |of: &[f64]| rows.clone().map(|k| of[k]).sum::<f64>() / count;
        let (t, q) = (mean(&clip.times), mean(&clip.positions));
        let along: f64 = rows.clone().map(|k| (clip.times[k] - t).powi(2)).sum();
        let with: f64 = rows.clone().map(|k| (clip.times[k] - t) * (clip.positions[k] - q)).sum();
        if along > 0.0 { [with / along, along.sqrt().recip()] } else { [0.0, f64::INFINITY] }
    };
    (0..=last).map(slope).collect()
}

/// Noise of a clip's positions, with what the joint's law leaves.
fn sigma(clip: &Positions, noise: &Noise) -> f64 {
    let [low, high] =
        clip.positions.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| [low.min(*q), high.max(*q)]);
    noise.sigma.hypot(MODEL_ERROR_SHARE * (high - low))
}

/// Stretches in which the part moves.
fn moving(clip: &Positions, noise: &Noise) -> Vec<Range<usize>> {
    // Slopes are as noisy as noise that lasts makes them.
    let least = MOVING_SIGMAS * sigma(clip, noise) * noise.lasts().sqrt();
    let by_scale = SLOPE_ROWS.map(|around| velocities(clip, around));
    let moves = |row: usize| by_scale.iter().any(|all| all[row][0].abs() > least * all[row][1]);
    let mut found: Vec<Range<usize>> = Vec::new();
    for row in (0..clip.times.len()).filter(|row| moves(*row)) {
        match found.last_mut() {
            Some(last) if row <= last.end + MAX_PAUSE_ROWS => last.end = row + 1,
            _ => found.push(row..row + 1),
        }
    }
    found
}

/// The stretch at the end of a motion that friction and weight explain and in which the part goes farthest.
fn last_free(clip: &Positions, law: (&LoneJoint, &Noise), rows: &Range<usize>, next: usize) -> Option<Alone> {
    let sigma = sigma(clip, law.1) * law.1.lasts().sqrt();
    // Few rows show best when it stops; where they are too noisy for that, more.
    let seen = SLOPE_ROWS.iter().find_map(|around| {
        let velocities = velocities(clip, *around);
        let fastest = rows.clone().max_by(|a, b| velocities[*a][0].abs().total_cmp(&velocities[*b][0].abs()))?;
        let [velocity, deviation] = velocities[fastest];
        (END_SPEED_SHARE * velocity.abs() > MOVING_SIGMAS * sigma * deviation).then_some((
            *around,
            velocities,
            velocity.abs(),
        ))
    });
    let (around, velocities, fastest) = seen?;
    let over = rows.clone().rev().find(|row| velocities[*row][0].abs() >= END_SPEED_SHARE * fastest)?;
    let first_end = (over + 1).saturating_sub(around).max(rows.start + MIN_ROWS);
    let rested = (rows.end..next).take_while(|row| clip.times[*row] - clip.times[rows.end - 1] <= REST_SECONDS).count();
    let last_end = (rows.end + rested).min(next.saturating_sub(around)).max(rows.end);
    let mut best: Option<Alone> = None;
    for end in steps(last_end, first_end, TRIED_ENDS) {
        for start in steps(rows.start, end.saturating_sub(MIN_ROWS), TRIED_BEGINNINGS) {
            let motion = cut(clip, law, start..end);
            let least = best.as_ref().map_or(MIN_TRAVEL_SIGMAS * motion.sigma, |best| best.motion.travel());
            // Later beginnings leave less.
            if rows.end.min(end) < start + MIN_ROWS || motion.travel() <= least {
                break;
            }
            if explains(&motion, law.1) {
                best = Some(Alone { rows: start..end, motion });
                break;
            }
        }
    }
    let best = best?.before_impact(fastest);
    let peak = (rows.start..=over).max_by(|a, b| velocities[*a][0].abs().total_cmp(&velocities[*b][0].abs()))?;
    let pushed = clip.times[peak] - clip.times[rows.start.saturating_sub(1)];
    let unseen = (PUSH_FACTOR * law.1.sigma / fastest * pushed).sqrt();
    let cut = best.motion.times.iter().take_while(|time| **time < unseen).count();
    // No more than half of the way is given up.
    let kept = (0..=cut).rev().filter_map(|rows| best.without_first(rows));
    kept.into_iter().find(|shorter| shorter.motion.travel() >= MIN_KEPT_TRAVEL * best.motion.travel())
}

/// Rows from one to another, both included, in at most so many steps.
fn steps(from: usize, to: usize, most: usize) -> Vec<usize> {
    let way = from.abs_diff(to);
    let count = way.min(most).max(1);
    let at = |k: usize| if to >= from { from + way * k / count } else { from - way * k / count };
    let mut all: Vec<usize> = (0..=count).map(at).collect();
    all.dedup();
    all
}

fn cut(clip: &Positions, (joint, noise): (&LoneJoint, &Noise), rows: Range<usize>) -> Motion {
    let times = clip.times[rows.clone()].iter().map(|time| time - clip.times[rows.start]).collect();
    let mut motion = Motion { times, positions: clip.positions[rows].to_vec(), sigma: noise.sigma, joint: *joint };
    motion.sigma = noise.sigma.hypot(MODEL_ERROR_SHARE * motion.travel());
    motion
}

/// Whether some friction and damping leave of a motion what noise leaves.
fn explains(motion: &Motion, noise: &Noise) -> bool {
    best_fit(std::slice::from_ref(motion))
        .is_some_and(|fit| disagreement(motion, [fit.shared[0], fit.shared[1]], &fit.clips[0].own, noise) <= 1.0)
}

impl Alone {
    /// Without its last rows where the part ran into something while it was moving: they may show what it did there.
    fn before_impact(self, fastest: f64) -> Self {
        let Motion { times, positions, .. } = &self.motion;
        let last = times.len() - 1;
        let [before, behind] = [last.saturating_sub(2 * SLOPE_ROWS[0]), last.saturating_sub(SLOPE_ROWS[0])];
        let speed = (positions[behind] - positions[before]).abs() / (times[behind] - times[before]).max(1e-9);
        if speed < IMPACT_SPEED_SHARE * fastest || last <= MIN_ROWS {
            return self;
        }
        let mut shorter = self;
        shorter.rows.end -= SLOPE_ROWS[0];
        shorter.motion.times.truncate(last + 1 - SLOPE_ROWS[0]);
        shorter.motion.positions.truncate(last + 1 - SLOPE_ROWS[0]);
        shorter
    }

    /// The same without some rows at its beginning; `None` where too few would be left.
    pub(super) fn without_first(&self, rows: usize) -> Option<Self> {
        let Motion { times, positions, sigma, joint } = &self.motion;
        if times.len() < rows + MIN_ROWS {
            return None;
        }
        let times = times[rows..].iter().map(|time| time - times[rows]).collect();
        let motion = Motion { times, positions: positions[rows..].to_vec(), sigma: *sigma, joint: *joint };
        Some(Self { rows: self.rows.start + rows..self.rows.end, motion })
    }
}
