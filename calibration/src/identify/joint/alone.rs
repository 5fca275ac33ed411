//! Where in a clip the part moves by itself. What pushes it is not recorded, so the last stretch of each motion counts, from the
//! earliest row on from which friction and weight alone explain it until it rests or runs into something.

use super::model::{Line, Motion, best_fit, travel};
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
/// Ends and beginnings that are tried, of one motion and then of all together (choices).
const TRIED_ENDS: usize = 12;
pub(super) const TRIED_BEGINNINGS: usize = 24;
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
    moving.iter().zip(starts).filter_map(|(rows, next)| last_free(clip, joint, noise, rows, next)).collect()
}

/// Mean position of each stretch in which the part rests for a while [rad or m].
pub(super) fn rests(clip: &Positions, noise: &Noise) -> Vec<f64> {
    let moving = moving(clip, noise);
    let ends = std::iter::once(0).chain(moving.iter().map(|rows| rows.end));
    let starts = moving.iter().map(|rows| rows.start).chain([clip.times.len()]);
    let rest = ends.zip(starts).map(|(from, to)| (from + SLOPE_ROWS[0])..to.saturating_sub(SLOPE_ROWS[0]));
    let lasts = |rows: &Range<usize>| {
        rows.len() > SLOPE_ROWS[0] && clip.times[rows.end - 1] - clip.times[rows.start] >= REST_SECONDS
    };
    rest.filter(lasts).map(|rows| clip.positions[rows.clone()].iter().sum::<f64>() / rows.len() as f64).collect()
}

/// Lines through the neighbouring rows of each, so many to each side: their slopes are velocities [rad/s or m/s].
fn lines(clip: &Positions, around: usize) -> Vec<Line> {
    let count = clip.times.len();
    let neighbours = |row: usize| row.saturating_sub(around)..(row + around + 1).min(count);
    (0..count).map(neighbours).map(|rows| Line::through(&clip.times[rows.clone()], &clip.positions[rows])).collect()
}

/// Noise of a clip's positions, with what the joint's law leaves.
fn sigma(clip: &Positions, noise: &Noise) -> f64 {
    noise.sigma.hypot(MODEL_ERROR_SHARE * travel(&clip.positions))
}

/// Stretches in which the part moves.
fn moving(clip: &Positions, noise: &Noise) -> Vec<Range<usize>> {
    // Slopes are as noisy as noise that lasts makes them.
    let least = MOVING_SIGMAS * sigma(clip, noise) * noise.lasts().sqrt();
    let by_scale = SLOPE_ROWS.map(|around| lines(clip, around));
    let moves = |row: usize| by_scale.iter().any(|lines| lines[row].is_steeper(least));
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
fn last_free(clip: &Positions, joint: &LoneJoint, noise: &Noise, rows: &Range<usize>, next: usize) -> Option<Alone> {
    let least = MOVING_SIGMAS * sigma(clip, noise) * noise.lasts().sqrt();
    // Few rows show best when it stops; where they are too noisy for that, more.
    let (around, lines) = SLOPE_ROWS.into_iter().map(|around| (around, lines(clip, around))).find(|(_, lines)| {
        fastest_in(lines, rows.clone()).is_some_and(|row| lines[row].is_steeper(least / END_SPEED_SHARE))
    })?;
    let fastest = lines[fastest_in(&lines, rows.clone())?].slope.abs();
    let over = rows.clone().rev().find(|row| lines[*row].slope.abs() >= END_SPEED_SHARE * fastest)?;
    let first_end = (over + 1).saturating_sub(around).max(rows.start + MIN_ROWS);
    let rested = (rows.end..next).take_while(|row| clip.times[*row] - clip.times[rows.end - 1] <= REST_SECONDS).count();
    let last_end = (rows.end + rested).min(next.saturating_sub(around)).max(rows.end);
    let mut best: Option<Alone> = None;
    for end in steps(last_end, first_end, TRIED_ENDS) {
        for start in steps(rows.start, end.saturating_sub(MIN_ROWS), TRIED_BEGINNINGS) {
            let motion = cut(clip, joint, noise, start..end);
            let least = best.as_ref().map_or(MIN_TRAVEL_SIGMAS * motion.sigma, |best| best.motion.travel());
            // Later beginnings leave less.
            if rows.end.min(end) < start + MIN_ROWS || motion.travel() <= least {
                break;
            }
            if explains(&motion, noise) {
                best = Some(Alone { rows: start..end, motion });
                break;
            }
        }
    }
    let best = best?.before_impact(fastest);
    let peak = fastest_in(&lines, rows.start..over + 1)?;
    let pushed = clip.times[peak] - clip.times[rows.start.saturating_sub(1)];
    let unseen = (PUSH_FACTOR * noise.sigma / fastest * pushed).sqrt();
    let cut = best.motion.times.iter().take_while(|time| **time < unseen).count();
    // No more than half of the way is given up.
    let kept = (0..=cut).rev().filter_map(|rows| best.without_first(rows));
    kept.into_iter().find(|shorter| shorter.motion.travel() >= MIN_KEPT_TRAVEL * best.motion.travel())
}

fn fastest_in(lines: &[Line], rows: Range<usize>) -> Option<usize> {
    rows.max_by(|a, b| lines[*a].slope.abs().total_cmp(&lines[*b].slope.abs()))
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

fn cut(clip: &Positions, joint: &LoneJoint, noise: &Noise, rows: Range<usize>) -> Motion {
    let times = clip.times[rows.clone()].iter().map(|time| time - clip.times[rows.start]).collect();
    let mut motion = Motion { times, positions: clip.positions[rows].to_vec(), sigma: noise.sigma, joint: *joint };
    motion.sigma = noise.sigma.hypot(MODEL_ERROR_SHARE * motion.travel());
    motion
}

/// Whether some friction and damping leave of a motion what noise leaves.
fn explains(motion: &Motion, noise: &Noise) -> bool {
    best_fit(std::slice::from_ref(motion))
        .is_some_and(|fit| motion.disagreement([fit.shared[0], fit.shared[1]], &fit.clips[0].own, noise) <= 1.0)
}

impl Alone {
    /// Without its last rows where the part ran into something while it was moving: they may show what it did there.
    fn before_impact(mut self, fastest: f64) -> Self {
        let Motion { times, positions, .. } = &mut self.motion;
        let last = times.len() - 1;
        let [before, behind] = [last.saturating_sub(2 * SLOPE_ROWS[0]), last.saturating_sub(SLOPE_ROWS[0])];
        let speed = (positions[behind] - positions[before]).abs() / (times[behind] - times[before]).max(1e-9);
        if speed >= IMPACT_SPEED_SHARE * fastest && last > MIN_ROWS {
            self.rows.end -= SLOPE_ROWS[0];
            times.truncate(last + 1 - SLOPE_ROWS[0]);
            positions.truncate(last + 1 - SLOPE_ROWS[0]);
        }
        self
    }

    /// The same without some rows at its beginning; `None` where too few would be left.
    pub(super) fn without_first(&self, rows: usize) -> Option<Self> {
        let Motion { times, positions, .. } = &self.motion;
        let first = times.get(rows).filter(|_| times.len() >= rows + MIN_ROWS)?;
        let times = times[rows..].iter().map(|time| time - first).collect();
        let motion = Motion { times, positions: positions[rows..].to_vec(), ..self.motion };
        Some(Self { rows: self.rows.start + rows..self.rows.end, motion })
    }
}
