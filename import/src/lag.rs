//! How much later a motion comes than its command, with the interval that the motion and its noise leave open.
//!
//! Velocities of both are laid on an even grid. At each lag the measured ones are explained by the commanded ones times one
//! common gain; what that leaves, a square of a velocity, over all lags is the curve. A lag belongs to the 95 % interval where
//! the curve is no higher than its lowest point by what its noise allows: the variance of the lag by the scores of stretches of
//! time, as residuals of a controller last (Liang & Zeger 1986), over the curvature there. So a curve without a narrow valley
//! gives a wide interval, a motion that repeats itself one that spans its periods, and one that reaches the end of the search
//! tells no lag.

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
    /// Whether the interval reaches the end of the search: the motion tells no lag.
    pub open: bool,
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

/// Lags are searched this far both ways [s], but no further than this share of the shorter motion [1].
const FARTHEST: f64 = 3.0;
const SHARE: f64 = 0.4;
/// What overlaps at a lag holds at least this share of the squared speeds of both [1]: rest beside rest tells nothing.
const MOTION: f64 = 0.5;
/// Most samples of a motion: longer ones are sampled more coarsely. Finest time between samples [s].
const SAMPLES: f64 = 4000.0;
const FINEST: f64 = 5e-3;
/// Stretches of time that are taken for independent of each other, and the two-sided 95 % of Student's t for their number.
const STRETCHES: usize = 12;
const STUDENT_95: f64 = 2.201;
/// No arm does as it is told better than to this share of its squared speeds [1]: 0.1 % of its speed; a choice.
const PERFECT: f64 = 1e-6;
/// Groups differ by this much at least [s]; a choice, below the period of common controllers.
const APART: f64 = 2e-3;

/// The lag of a motion, joint by joint; `None` of too few rows, or where one of the two stands still.
#[must_use]
pub fn between(told: Motion<'_>, done: Motion<'_>) -> Option<Lag> {
    let grid = Grid::of(told, done)?;
    grid.lag(&grid.told, &grid.done)
}

/// The lag of the speeds of all joints together, about their means: neither order nor signs of the joints change it.
#[must_use]
pub fn of_speeds(told: Motion<'_>, done: Motion<'_>) -> Option<Lag> {
    let grid = Grid::of(told, done)?;
    grid.lag(&grid.told.speeds(), &grid.done.speeds())
}

/// Joints in groups of one lag each, the earliest first; a single group, or none, where no two joints differ surely.
#[must_use]
pub fn groups(told: Motion<'_>, done: Motion<'_>) -> Vec<Group> {
    let Some(grid) = Grid::of(told, done) else { return Vec::new() };
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
#[must_use]
pub fn in_words(groups: &[Group]) -> String {
    let one = |group: &Group| {
        let joints: Vec<String> = group.joints.iter().map(|joint| (joint + 1).to_string()).collect();
        let [lo, hi] = group.interval.map(|end| end * 1e3);
        format!("{:.0} ms ({lo:.0} to {hi:.0}) at joint {}", group.seconds * 1e3, joints.join(", "))
    };
    groups.iter().map(one).collect::<Vec<_>>().join("; ")
}

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

/// Velocities of joints on an even grid; NaN where there are none.
struct Velocities {
    dof: usize,
    values: Vec<f64>,
}

impl Velocities {
    fn row(&self, at: usize) -> Option<&[f64]> {
        self.values.get(at * self.dof..(at + 1) * self.dof).filter(|row| row[0].is_finite())
    }

    fn len(&self) -> usize {
        self.values.len() / self.dof
    }

    fn joint(&self, joint: usize) -> Self {
        Self { dof: 1, values: self.values.iter().skip(joint).step_by(self.dof).copied().collect() }
    }

    fn speeds(&self) -> Self {
        let speed = |row: &[f64]| row.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut values: Vec<f64> = self.values.chunks_exact(self.dof).map(speed).collect();
        let known = || values.iter().copied().filter(|v| v.is_finite());
        let mean = known().sum::<f64>() / known().count().max(1) as f64;
        values.iter_mut().for_each(|v| *v -= mean);
        Self { dof: 1, values }
    }

    /// Squared speeds of all samples.
    fn energy(&self) -> f64 {
        self.values.iter().filter(|v| v.is_finite()).map(|v| v * v).sum()
    }
}

/// Both motions on one grid.
struct Grid {
    step: f64,
    /// Lags that are searched, each way [samples].
    most: isize,
    told: Velocities,
    done: Velocities,
}

impl Grid {
    fn of(told: Motion<'_>, done: Motion<'_>) -> Option<Self> {
        if told.t.len() < 8 || done.t.len() < 8 || told.q.len() != done.q.len() || told.q.is_empty() {
            return None;
        }
        let ends = [told, done].map(|motion| [motion.t[0], motion.t[motion.t.len() - 1]]);
        let (from, to) = (ends[0][0].min(ends[1][0]), ends[0][1].max(ends[1][1]));
        let shorter = ends.iter().map(|[from, to]| to - from).fold(f64::INFINITY, f64::min);
        let steps = [told, done].map(|motion| usual_step(motion.t));
        let step = FINEST.max(0.5 * steps[0]).max(0.5 * steps[1]).max((to - from) / SAMPLES);
        let most = (FARTHEST.min(SHARE * shorter) / step) as isize;
        if !(step.is_finite() && shorter > 0.0 && most > 1) {
            return None;
        }
        let [told, done] = [(told, steps[0]), (done, steps[1])].map(|(motion, own)| {
            // Over the time of a few rows, so that noise and the steps of an encoder do not hide the motion.
            velocities(motion, (from, to, step), (2.0 * step).max(2.0 * own))
        });
        Some(Self { step, most, told, done })
    }

    fn lag(&self, told: &Velocities, done: &Velocities) -> Option<Lag> {
        Curve::of(told, done, self.most)?.lag(self.step)
    }
}

/// The usual time between rows [s]; 0 of fewer than two.
#[must_use]
pub fn usual_step(t: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

fn velocities(motion: Motion<'_>, (from, to, step): (f64, f64, f64), half: f64) -> Velocities {
    let (first, last) = (motion.t[0], motion.t[motion.t.len() - 1]);
    let count = ((to - from) / step) as usize + 1;
    let at = |i: usize| {
        let t = from + i as f64 * step;
        let (a, b) = ((t - half).max(first), (t + half).min(last));
        let inside = t >= first && t <= last && b > a;
        let velocity = move |q: &Vec<f64>| {
            if inside { (between_rows(motion.t, q, b) - between_rows(motion.t, q, a)) / (b - a) } else { f64::NAN }
        };
        motion.q.iter().map(velocity)
    };
    let mut values: Vec<f64> = (0..count).flat_map(at).collect();
    // A row in which one joint is unknown tells nothing.
    for row in values.chunks_exact_mut(motion.q.len()) {
        if !row.iter().all(|v| v.is_finite()) {
            row.fill(f64::NAN);
        }
    }
    Velocities { dof: motion.q.len(), values }
}

/// A joint's position at a time within the rows, on the straight line between two of them.
fn between_rows(t: &[f64], values: &[f64], at: f64) -> f64 {
    let next = t.partition_point(|t| *t < at).min(t.len() - 1);
    let Some(before) = next.checked_sub(1).filter(|before| t[next] > t[*before]) else { return values[next] };
    values[before] + (at - t[before]) / (t[next] - t[before]) * (values[next] - values[before])
}

/// What the samples of both say at one lag.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    told: f64,
    both: f64,
    done: f64,
    /// Numbers compared.
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

    /// Information on the lag there, 1 over the square of a sample in units of the squares that are left; and its variance
    /// [samples^2] by the scores of stretches.
    fn certainty(&self, lag: f64) -> (f64, f64) {
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
        let mut scores = [0.0; STRETCHES];
        let mut information = 0.0;
        for (i, told, slope, left) in rows {
            let slope = slope - told * product / sums.told;
            information += slope * slope;
            scores[((i - first) / length).min(STRETCHES - 1)] += slope * left;
        }
        let correction = STRETCHES as f64 / (STRETCHES - 1) as f64;
        let outer = correction * scores.iter().map(|score| score * score).sum::<f64>();
        (information, outer / (information * information))
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
        let (information, variance) = self.certainty(best.lag);
        // Residuals that last make the variance larger than the noise alone would.
        let variance = variance.max(best.left / information);
        let by_noise = STUDENT_95 * STUDENT_95 * variance * information / sums.count;
        let allowed = by_noise.max(PERFECT * sums.done / sums.count);
        // A motion of one speed says nothing: all is allowed.
        let allowed = if allowed.is_finite() { allowed } else { f64::INFINITY };
        let limit = best.left + allowed;
        let half = (sums.count * allowed / information).sqrt();
        let half = if half.is_finite() { half } else { f64::INFINITY };
        let likely = |valley: &&Valley| valley.left <= limit;
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
        let open = lowest.is_none() || lo <= first as f64 || hi >= last as f64;
        Some(Lag {
            seconds: chosen.lag * step,
            interval: [lo.max(first as f64) * step, hi.min(last as f64) * step],
            correlation: self.sums(chosen.lag).correlation(),
            open,
        })
    }
}
