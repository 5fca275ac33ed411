//! How much later a motion comes than its command, with the interval that the motion and its noise leave open.
//!
//! Velocities of both are laid on an even grid. At each lag the measured ones are explained by the commanded ones times one
//! common gain; what that leaves, a square of a velocity, over all lags is the curve. A lag belongs to the 95 % interval where
//! the curve is no higher than its lowest point by what its noise allows: the variance of the lag by the scores of stretches of
//! time, as residuals of a controller last (Liang & Zeger 1986), over the curvature there. So a curve without a narrow valley
//! gives a wide interval, and one that reaches the end of the search tells no lag. A motion that repeats itself has valleys a
//! period apart: each that is no higher than the lowest by what its independent samples allow may be the true one, and it tells no
//! lag either. Single rows that jump away and back are no motion.

mod grid;

pub use grid::usual_step;

use grid::{Grid, Velocities};
use serde::Serialize;

/// Positions over time.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Rising [s].
    pub t: &'a [f64],
    /// By joint [rad].
    pub q: &'a [Vec<f64>],
}

/// How much later a motion comes than its command.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lag {
    /// Of the lags that fit best the one nearest to none; negative where the motion leads [s].
    pub seconds: f64,
    /// Its 95 % interval, as far as lags are searched [s].
    pub interval: [f64; 2],
    /// Correlation of the velocities at that lag [1].
    pub correlation: f64,
    /// The motion tells no lag: the interval reaches the end of the search, or the motion repeats itself.
    pub open: bool,
    /// Lags far apart fit alike, as a motion that repeats itself leaves it.
    pub repeats: bool,
    /// Half the interval around that lag alone [s].
    #[serde(skip)]
    pub half_width: f64,
}

/// Joints that lag alike.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// From 0.
    pub joints: Vec<usize>,
    /// The middle of their lags [s].
    pub seconds: f64,
    /// From the lowest to the highest end of their intervals [s].
    pub interval: [f64; 2],
}

/// What overlaps at a lag holds at least this share of the squared speeds of both [1]: rest beside rest tells nothing.
const MOTION: f64 = 0.5;
/// Velocities are taken over so many steps before and behind: the fewest at which the arm is seen to follow.
const WINDOWS: [f64; 4] = [2.0, 8.0, 32.0, 128.0];
/// Stretches of time that are taken for independent of each other, and the two-sided 95 % of Student's t for their number.
const STRETCHES: usize = 12;
const STUDENT_95: f64 = 2.201;
/// No arm does as it is told better than to this share of its squared speeds [1]: 0.1 % of its speed; a choice.
const PERFECT: f64 = 1e-6;
/// Valleys far apart count as equal where they differ by less than this share of the squared speeds [1]: an arm is 3 % of its speed
/// off its commands, which no repetition of them tells apart; a choice.
const ALIKE: f64 = 1e-3;
/// Likelihood of a far valley, in sigmas of the square of so many independent samples as there are.
const FAR_SIGMAS: f64 = 3.0;
/// Between two valleys the curve rises by so many times what they may differ by [1].
const RIDGE: f64 = 2.0;
/// Groups differ by this much at least [s]; a choice, below the period of common controllers.
const APART: f64 = 2e-3;

/// The lag of a motion, joint by joint; `None` of too few rows, or where one of the two stands still.
///
/// An arm that comes 20 ms after its commands:
///
/// ```
/// use import::lag::{Motion, between};
///
/// let t: Vec<f64> = (0..2000).map(|row| 0.005 * f64::from(row)).collect(); // s
/// let motion = |lag: f64| -> Vec<Vec<f64>> {
///     let q = |t: f64| (2.0 * t).sin() + 0.3 * (7.3 * t).sin(); // rad
///     vec![t.iter().map(|t| q(t - lag)).collect()] // one joint
/// };
/// let (desired, measured) = (motion(0.0), motion(0.02));
/// let of = |q| Motion { t: &t, q };
/// let lag = between(of(&desired), of(&measured)).expect("both move");
/// assert!((lag.seconds - 0.02).abs() < 1e-3);
/// assert!(lag.interval[0] <= 0.02 && 0.02 <= lag.interval[1]);
/// ```
pub fn between(told: Motion<'_>, done: Motion<'_>) -> Option<Lag> {
    Some(clearest(told, done)?.1)
}

/// The grid over which the motion shows best, and its lag: longer times show slow motion under noise.
fn clearest(told: Motion<'_>, done: Motion<'_>) -> Option<(Grid, Lag)> {
    let all = WINDOWS.iter().filter_map(|steps| {
        let grid = Grid::of(told, done, *steps)?;
        let lag = grid.lag(&grid.told, &grid.done)?;
        Some((grid, lag))
    });
    let mut finest = None;
    for (grid, lag) in all {
        if lag.correlation > FOLLOWS {
            return Some((grid, lag));
        }
        finest = finest.or(Some((grid, lag)));
    }
    finest
}

/// The lag of the speeds of all joints together, about their means: neither order nor signs of the joints change it.
pub fn of_speeds(told: Motion<'_>, done: Motion<'_>) -> Option<Lag> {
    let grid = Grid::of(told, done, WINDOWS[0])?;
    grid.lag(&grid.told.speeds(), &grid.done.speeds())
}

/// Joints in groups of one lag each, the earliest first; a single group, or none, where no two joints differ surely.
pub fn groups(told: Motion<'_>, done: Motion<'_>) -> Vec<Group> {
    let Some((grid, _)) = clearest(told, done) else { return Vec::new() };
    let own = |joint: usize| {
        let lag = grid.lag(&grid.told.joint(joint), &grid.done.joint(joint))?;
        (!lag.open && lag.correlation > FOLLOWS).then_some((joint, lag))
    };
    let mut lags: Vec<(usize, Lag)> = (0..grid.told.dof).filter_map(own).collect();
    lags.sort_by(|a, b| a.1.seconds.total_cmp(&b.1.seconds));
    let mut groups: Vec<Vec<(usize, Lag)>> = Vec::new();
    for lag in lags {
        let apart = |group: &Vec<(usize, Lag)>| {
            let highest = group.iter().map(|(_, lag)| lag.interval[1]).fold(f64::NEG_INFINITY, f64::max);
            let latest = group.iter().map(|(_, lag)| lag.seconds).fold(f64::NEG_INFINITY, f64::max);
            lag.1.interval[0] > highest && lag.1.seconds - latest > APART
        };
        match groups.last_mut().filter(|group| !apart(group)) {
            Some(group) => group.push(lag),
            None => groups.push(vec![lag]),
        }
    }
    groups.iter().map(|group| Group::of(group)).collect()
}

/// Groups in a line.
pub fn in_words(groups: &[Group]) -> String {
    let one = |group: &Group| {
        let joints: Vec<String> = group.joints.iter().map(|joint| (joint + 1).to_string()).collect();
        let [lag, lo, hi] = milliseconds([group.seconds, group.interval[0], group.interval[1]]);
        format!("{lag} ms ({lo} to {hi}) at joint {}", joints.join(", "))
    };
    groups.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// A lag and both ends of its interval [s] in milliseconds, with the digits that tell the ends apart.
pub fn milliseconds(numbers: [f64; 3]) -> [String; 3] {
    let with = |digits: usize| {
        // Without the sign of a 0.
        let scale = 10f64.powi(digits as i32);
        numbers.map(|number| format!("{:.digits$}", (number * 1e3 * scale).round() / scale + 0.0))
    };
    let [lag, lo, hi] = (0..=MOST_DIGITS).map(with).find(|[_, lo, hi]| lo != hi).unwrap_or_else(|| with(MOST_DIGITS));
    let short = if lag.contains('.') { lag.trim_end_matches('0').trim_end_matches('.') } else { &lag };
    [short.to_owned(), lo, hi]
}

/// Digits of a millisecond behind the point, at most.
const MOST_DIGITS: usize = 2;

/// A joint follows its command closely enough for its own lag to count [1].
const FOLLOWS: f64 = 0.97;

impl Group {
    fn of(lags: &[(usize, Lag)]) -> Self {
        let mut joints: Vec<usize> = lags.iter().map(|(joint, _)| *joint).collect();
        joints.sort_unstable();
        let ends = lags.iter().map(|(_, lag)| lag.interval);
        let wide = |[lo, hi]: [f64; 2], [a, b]: [f64; 2]| [lo.min(a), hi.max(b)];
        Self {
            joints,
            seconds: lags.get(lags.len() / 2).map_or(0.0, |(_, lag)| lag.seconds),
            interval: ends.reduce(wide).unwrap_or_default(),
        }
    }
}

impl Grid {
    fn lag(&self, told: &Velocities, done: &Velocities) -> Option<Lag> {
        Curve::of(told, done, self.most)?.lag(self.step)
    }
}

/// How many of some residuals, row by row, are independent of each other: by how long they last (Geyer 1992).
fn independent(left: &[f64], dof: usize) -> f64 {
    let square = left.iter().map(|v| v * v).sum::<f64>();
    let alike = |apart: usize| left.iter().zip(&left[apart..]).map(|(a, b)| a * b).sum::<f64>() / square;
    let lasts: f64 = (1..left.len() / dof / 4).map(|rows| alike(rows * dof)).take_while(|alike| *alike > LASTS).sum();
    let count = left.len() as f64 / (1.0 + 2.0 * lasts);
    if count.is_finite() { count.max(STRETCHES as f64) } else { STRETCHES as f64 }
}

/// Residuals so far apart that they correlate less are independent [1].
const LASTS: f64 = 0.05;

/// What the samples of both say at one lag.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    told: f64,
    both: f64,
    done: f64,
    count: f64,
}

impl Sums {
    fn add(&mut self, told: f64, done: f64) {
        self.told += told * told;
        self.both += told * done;
        self.done += done * done;
        self.count += 1.0;
    }

    fn gain(&self) -> f64 {
        if self.told > 0.0 { (self.both / self.told).max(0.0) } else { 0.0 }
    }

    /// Mean square that the command leaves of the measurement.
    fn left(&self) -> f64 {
        let gain = self.gain();
        (self.done - 2.0 * gain * self.both + gain * gain * self.told).max(0.0) / self.count
    }

    fn correlation(&self) -> f64 {
        let both = (self.told * self.done).sqrt();
        if both > 0.0 { self.both / both } else { 0.0 }
    }
}

/// A bottom of the curve.
#[derive(Debug, Clone, Copy)]
struct Valley {
    /// [samples]
    lag: f64,
    left: f64,
}

struct Curve<'a> {
    told: &'a Velocities,
    done: &'a Velocities,
    most: isize,
    /// What is left at each lag from `-most` on; `None` where too little overlaps.
    left: Vec<Option<f64>>,
}

impl<'a> Curve<'a> {
    fn of(told: &'a Velocities, done: &'a Velocities, most: isize) -> Option<Self> {
        let energy = [told.energy(), done.energy()];
        if energy.iter().any(|energy| !(*energy > 0.0 && energy.is_finite())) {
            return None;
        }
        let mut curve = Self { told, done, most, left: Vec::new() };
        curve.left = (-most..=most)
            .map(|lag| {
                let sums = curve.sums(lag as f64);
                let enough = sums.told >= MOTION * energy[0] && sums.done >= MOTION * energy[1];
                (enough && sums.count >= 8.0).then(|| sums.left())
            })
            .collect();
        curve.left.iter().any(Option::is_some).then_some(curve)
    }

    /// Calls `each` with the sample's number, commanded and measured velocities, and those of the samples around the commanded.
    fn pairs(&self, lag: f64, mut each: impl FnMut(usize, usize, [f64; 2], &[f64], &[f64])) {
        let whole = lag.floor();
        let share = lag - whole;
        for i in 0..self.done.len() {
            // The command of this sample lies between two of its own: `share` of the earlier one.
            let Some(late) = i.checked_add_signed(-(whole as isize)) else { continue };
            let Some(early) = late.checked_sub(usize::from(share > 0.0)) else { continue };
            if let (Some(done), Some(a), Some(b)) = (self.done.row(i), self.told.row(late), self.told.row(early)) {
                each(i, late, [1.0 - share, share], done, if share > 0.0 { b } else { a });
            }
        }
    }

    fn sums(&self, lag: f64) -> Sums {
        let mut sums = Sums::default();
        self.pairs(lag, |_, late, [near, far], done, early| {
            let late = self.told.row(late).unwrap_or(early);
            for ((late, early), done) in late.iter().zip(early).zip(done) {
                sums.add(near * late + far * early, *done);
            }
        });
        sums
    }

    /// Bottoms of the curve between its ends, by the parabolas through three samples.
    fn valleys(&self) -> Vec<Valley> {
        let bottom = |(at, window): (usize, &[Option<f64>])| {
            let &[Some(a), Some(b), Some(c)] = window else { return None };
            let bend = a - 2.0 * b + c;
            let below = if bend > 0.0 { (a - c).powi(2) / (8.0 * bend) } else { 0.0 };
            (b <= a && b <= c).then(|| Valley { lag: (at as isize + 1 - self.most) as f64, left: b - below })
        };
        self.left.windows(3).enumerate().filter_map(bottom).collect()
    }

    /// The lowest point within a sample, by golden section.
    fn bottom(&self, at: f64) -> Valley {
        let ratio = 0.5 * (5f64.sqrt() - 1.0);
        let left = |lag: f64| self.sums(lag).left();
        let (mut lo, mut hi) = (at - 1.0, at + 1.0);
        let (mut a, mut b) = (hi - ratio * (hi - lo), lo + ratio * (hi - lo));
        let (mut of_a, mut of_b) = (left(a), left(b));
        while hi - lo > 1e-3 {
            if of_a < of_b {
                (hi, b, of_b) = (b, a, of_a);
                a = hi - ratio * (hi - lo);
                of_a = left(a);
            } else {
                (lo, a, of_a) = (a, b, of_b);
                b = lo + ratio * (hi - lo);
                of_b = left(b);
            }
        }
        let exact = Valley { lag: at, left: left(at) };
        let found = Valley { lag: 0.5 * (lo + hi), left: of_a.min(of_b) };
        if exact.left <= found.left { exact } else { found }
    }

    /// Information on the lag there, 1 over the square of a sample in units of the squares that are left; its variance
    /// [samples^2] by the scores of stretches; and how many of the residuals are independent of each other.
    fn certainty(&self, lag: f64) -> (f64, f64, f64) {
        let sums = self.sums(lag);
        let gain = sums.gain();
        let slope = |late: usize, joint: usize| {
            let [before, after] = [late.checked_sub(1), Some(late + 1)].map(|at| at.and_then(|at| self.told.row(at)));
            before.zip(after).map_or(0.0, |(a, b)| 0.5 * gain * (b[joint] - a[joint]))
        };
        // What a lag changes and a gain does not.
        let (mut product, mut rows) = (0.0, Vec::new());
        self.pairs(lag, |i, late, [near, far], done, early| {
            let of_late = self.told.row(late).unwrap_or(early);
            for joint in 0..done.len() {
                let told = near * of_late[joint] + far * early[joint];
                let slope = near * slope(late, joint) + far * slope(late.saturating_sub(1), joint);
                product += slope * told;
                rows.push((i, told, slope, done[joint] - gain * told));
            }
        });
        let [first, last] = [rows.first(), rows.last()].map(|row| row.map_or(0, |row| row.0));
        let length = (last - first) / STRETCHES + 1;
        let independent = independent(&rows.iter().map(|row| row.3).collect::<Vec<f64>>(), self.told.dof);
        let mut scores = [0.0; STRETCHES];
        let mut information = 0.0;
        for (i, told, slope, left) in rows {
            let slope = slope - told * product / sums.told;
            information += slope * slope;
            scores[((i - first) / length).min(STRETCHES - 1)] += slope * left;
        }
        let correction = STRETCHES as f64 / (STRETCHES - 1) as f64;
        let outer = correction * scores.iter().map(|score| score * score).sum::<f64>();
        (information, outer / (information * information), independent)
    }

    fn lag(&self, step: f64) -> Option<Lag> {
        let index = |at: usize| at as isize - self.most;
        let known: Vec<(isize, f64)> =
            self.left.iter().enumerate().filter_map(|(at, left)| Some((index(at), (*left)?))).collect();
        let (first, last) = (known.first()?.0, known.last()?.0);
        let valleys = self.valleys();
        let by_left = |a: &&Valley, b: &&Valley| a.left.total_cmp(&b.left);
        let lowest = valleys.iter().min_by(by_left).map(|valley| self.bottom(valley.lag));
        // Without a bottom between the ends the lowest of all lies at one of them.
        let grid = known.iter().map(|(lag, left)| Valley { lag: *lag as f64, left: *left });
        let best = lowest.or_else(|| grid.min_by(|a, b| a.left.total_cmp(&b.left)))?;
        let sums = self.sums(best.lag);
        let (information, variance, independent) = self.certainty(best.lag);
        // Residuals that last make the variance larger than the noise alone would.
        let variance = variance.max(best.left / information);
        let by_noise = STUDENT_95 * STUDENT_95 * variance * information / sums.count;
        let allowed = by_noise.max(PERFECT * sums.done / sums.count);
        // A motion of one speed says nothing: all is allowed.
        let allowed = if allowed.is_finite() { allowed } else { f64::INFINITY };
        let limit = best.left + allowed;
        let half = (sums.count * allowed / information).sqrt();
        let half = if half.is_finite() { half } else { f64::INFINITY };
        let alike = best.left * FAR_SIGMAS * (2.0 / independent).sqrt() + ALIKE * sums.done / sums.count;
        // A valley of its own, behind a ridge that no noise makes.
        let far = |valley: &Valley| {
            let [from, to] = [valley.lag.min(best.lag), valley.lag.max(best.lag)];
            let between = known.iter().filter(|(lag, _)| (from..to).contains(&(*lag as f64)));
            between.map(|(_, left)| *left).fold(0.0, f64::max) > best.left + RIDGE * alike
        };
        let again = |valley: &Valley| valley.left <= best.left + alike && far(valley);
        let likely = |valley: &&Valley| valley.left <= limit || again(valley);
        let repeats = valleys.iter().any(again);
        let nearest = valleys.iter().filter(likely).min_by(|a, b| a.lag.abs().total_cmp(&b.lag.abs()));
        let chosen = match nearest {
            Some(nearest) if (nearest.lag - best.lag).abs() > 1.0 => self.bottom(nearest.lag),
            _ => best,
        };
        let likely = valleys.iter().filter(likely).map(|valley| valley.lag);
        let around = likely.chain([best.lag, chosen.lag]).flat_map(|lag| [lag - half, lag + half]);
        let on_grid = known.iter().filter(|(_, left)| *left <= limit).map(|(lag, _)| *lag as f64);
        let wide = |[lo, hi]: [f64; 2], lag: f64| [lo.min(lag), hi.max(lag)];
        let [lo, hi] = around.chain(on_grid).fold([f64::INFINITY, f64::NEG_INFINITY], wide);
        let open = repeats || lowest.is_none() || lo <= first as f64 || hi >= last as f64;
        Some(Lag {
            seconds: chosen.lag * step,
            interval: [lo.max(first as f64) * step, hi.min(last as f64) * step],
            correlation: self.sums(chosen.lag).correlation(),
            open,
            repeats,
            half_width: half * step,
        })
    }
}
