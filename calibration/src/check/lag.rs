//! How much later than its command an arm moves, clip by clip, by cross-correlation; and whether that is a delay.
//!
//! Velocities are correlated joint by joint, or, where order or signs are wrong, the speeds of all joints together. A delay
//! stays the same in time whatever the speed; rows that were laid against each other wrongly give a lag that goes with 1 / speed.

use super::columns::{Columns, Signals};
use super::limits::{
    FARTHEST_LAG, FOLLOWS, GOES_WITH_SPEED, LAG_SHARE, LAG_SIGMA, LAGS_DIFFER, LEAD, LEAD_STEPS, LEAST_CORRELATION,
    LEAST_MOTION, LONGEST_DELAY, SAME_PEAK, SPEEDS_DIFFER,
};
use super::remark::{Fault, Remark, Size};
use super::statistics::{deviation, mean, range};
use crate::estimate::interval::student_95;
use serde::Serialize;

/// Parts of a clip from whose lags the interval comes.
const PARTS: usize = 4;
/// Samples within which a part's own peak is looked for, each side.
const NEAR: isize = 12;
/// Longest series that is correlated: longer clips are sampled more coarsely.
const SAMPLES: f64 = 4000.0;
/// Finest time between samples [s].
const FINEST: f64 = 5e-3;

/// What the motion of a clip says about the time between command and measurement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lag {
    /// How much later the measurement comes; negative where it leads [s].
    pub seconds: f64,
    /// Its 95 % interval [s].
    pub interval: [f64; 2],
    /// Correlation of the speeds at that lag [1].
    pub correlation: f64,
    /// Speed of the commands over how far they go: how fast the clip is played [1/s].
    pub rate: f64,
}

/// The lag of a clip; `None` where no motion tells it.
pub(super) fn of(clip: &Columns) -> Option<Lag> {
    let (measured, desired) = (&clip.measured, &clip.desired);
    if measured.len() < 8 || desired.len() < 8 || measured.dof() != desired.dof() {
        return None;
    }
    let spread = |signals: &Signals| signals.q.iter().map(|q| deviation(q).powi(2)).sum::<f64>().sqrt();
    if spread(desired) < LEAST_MOTION || spread(measured) < LEAST_MOTION {
        return None;
    }
    let (from, to) = (first(measured).min(first(desired)), last(measured).max(last(desired)));
    let step = FINEST.max(0.5 * measured.step()).max(0.5 * desired.step()).max((to - from) / SAMPLES);
    let [told, done] = [desired, measured].map(|signals| velocities(signals, from, to, step));
    let most = (FARTHEST_LAG.min(LAG_SHARE * measured.duration()) / step) as isize;
    let top = |of: Correlation| {
        let curve: Vec<f64> = (-most..=most).map(|lag| of(&told, &done, lag).unwrap_or(-1.0)).collect();
        let at = peak(&curve)?;
        let (offset, height) = vertex(&curve, at);
        (height >= LEAST_CORRELATION).then_some((of, at as isize - most, offset, height))
    };
    // Joints one by one tell more, and nothing where their order or signs are wrong.
    let (of, lag, offset, height) = top(joint_by_joint).or_else(|| top(of_speeds))?;
    let parts = parts(of, &told, &done, lag);
    let sigma = deviation(&parts) / (parts.len().max(1) as f64).sqrt();
    let seconds = (lag as f64 + offset) * step;
    let half = if parts.len() > 1 { student_95(parts.len() - 1) * sigma * step } else { step };
    let rate = rate(desired, spread(desired));
    Some(Lag { seconds, interval: [seconds - half, seconds + half], correlation: height, rate })
}

fn first(signals: &Signals) -> f64 {
    signals.t.first().copied().unwrap_or(0.0)
}

fn last(signals: &Signals) -> f64 {
    signals.t.last().copied().unwrap_or(0.0)
}

/// Velocities of all joints on an even grid; `None` where the topic has no rows.
type Velocities = Vec<Option<Vec<f64>>>;
/// How alike two motions are if the second comes so many samples later.
type Correlation = fn(&[Option<Vec<f64>>], &[Option<Vec<f64>>], isize) -> Option<f64>;

/// Velocities of all joints, from their positions.
fn velocities(signals: &Signals, from: f64, to: f64, step: f64) -> Velocities {
    // Over the time of a few rows, so that noise and the steps of an encoder do not hide the motion.
    let half = (2.0 * step).max(2.0 * signals.step());
    let count = ((to - from) / step) as usize + 1;
    let at = |i: usize| {
        let t = from + i as f64 * step;
        let (a, b) = ((t - half).max(first(signals)), (t + half).min(last(signals)));
        if t < first(signals) || t > last(signals) || b <= a {
            return None;
        }
        let velocity =
            |j: usize| signals.q_at(j, b).zip(signals.q_at(j, a)).map_or(0.0, |(to, from)| (to - from) / (b - a));
        Some((0..signals.dof()).map(velocity).collect())
    };
    (0..count).map(at).collect()
}

/// Samples that both motions have, the second so many later; `None` where these are too few.
fn pairs<'a>(
    told: &'a [Option<Vec<f64>>],
    done: &'a [Option<Vec<f64>>],
    lag: isize,
) -> Option<Vec<(&'a [f64], &'a [f64])>> {
    let both = |(i, told): (usize, &'a Option<Vec<f64>>)| {
        let later = usize::try_from(i as isize + lag).ok()?;
        Some((told.as_deref()?, done.get(later)?.as_deref()?))
    };
    let pairs: Vec<_> = told.iter().enumerate().filter_map(both).collect();
    let least = 0.4 * told.iter().flatten().count().min(done.iter().flatten().count()) as f64;
    (pairs.len() >= 8 && pairs.len() as f64 >= least).then_some(pairs)
}

/// Correlation of the joints' velocities, each with its own.
fn joint_by_joint(told: &[Option<Vec<f64>>], done: &[Option<Vec<f64>>], lag: isize) -> Option<f64> {
    let sums = pairs(told, done, lag)?.into_iter().fold([0.0; 3], |[aa, ab, bb], (a, b)| {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        [aa + product(a, a), ab + product(a, b), bb + product(b, b)]
    });
    let both = (sums[0] * sums[2]).sqrt();
    (both > 0.0).then(|| sums[1] / both)
}

/// Correlation of the speeds of all joints together, about their means: neither order nor signs of the joints change it.
fn of_speeds(told: &[Option<Vec<f64>>], done: &[Option<Vec<f64>>], lag: isize) -> Option<f64> {
    let speed = |velocities: &[f64]| velocities.iter().map(|v| v * v).sum::<f64>().sqrt();
    let speeds: Vec<[f64; 2]> = pairs(told, done, lag)?.into_iter().map(|(a, b)| [speed(a), speed(b)]).collect();
    let means = [0, 1].map(|k| speeds.iter().map(|pair| pair[k]).sum::<f64>() / speeds.len() as f64);
    let sums = speeds.iter().fold([0.0; 3], |[aa, ab, bb], pair| {
        let [a, b] = [pair[0] - means[0], pair[1] - means[1]];
        [aa + a * a, ab + a * b, bb + b * b]
    });
    let both = (sums[0] * sums[2]).sqrt();
    (both > 0.0).then(|| sums[1] / both)
}

/// The peak nearest to the middle among those that are about as high as the highest.
fn peak(curve: &[f64]) -> Option<usize> {
    let highest = curve.iter().copied().fold(0.0, f64::max);
    let is_peak = |i: &usize| {
        let beside = [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|k| curve.get(k));
        curve[*i] >= SAME_PEAK * highest && beside.into_iter().all(|other| *other <= curve[*i])
    };
    let middle = curve.len() / 2;
    (0..curve.len()).filter(is_peak).filter(|_| highest > 0.0).min_by_key(|i| i.abs_diff(middle))
}

/// Where the parabola through a sample and its neighbours has its top, from that sample [samples], and how high.
fn vertex(curve: &[f64], at: usize) -> (f64, f64) {
    let Some(&[a, b, c]) = at.checked_sub(1).and_then(|from| curve.get(from..from + 3)).and_then(|w| w.first_chunk())
    else {
        return (0.0, curve[at]);
    };
    let bend = a - 2.0 * b + c;
    if bend >= 0.0 {
        return (0.0, b);
    }
    let offset = (0.5 * (a - c) / bend).clamp(-0.5, 0.5);
    (offset, b - 0.25 * (a - c) * offset)
}

/// The lags of parts of the clip, in samples from the whole's.
fn parts(of: Correlation, told: &[Option<Vec<f64>>], done: &[Option<Vec<f64>>], lag: isize) -> Vec<f64> {
    let length = told.len().div_ceil(PARTS);
    let own = |part: &[Option<Vec<f64>>], from: usize| {
        let curve: Vec<f64> =
            (lag - NEAR..=lag + NEAR).map(|lag| of(part, done, lag + from as isize).unwrap_or(-1.0)).collect();
        let at = peak(&curve).filter(|at| *at > 0 && at + 1 < curve.len() && curve[*at] > LEAST_CORRELATION)?;
        Some(at as f64 - NEAR as f64 + vertex(&curve, at).0)
    };
    told.chunks(length).enumerate().filter_map(|(number, part)| own(part, number * length)).collect()
}

/// Root mean square speed over root mean square excursion.
fn rate(desired: &Signals, spread: f64) -> f64 {
    let step = desired.step().max(1e-9);
    let stride = ((0.02 / step).round() as usize).max(1);
    let squares = desired.q.iter().map(|q| {
        let slopes =
            (stride..q.len()).step_by(stride).map(|i| (q[i] - q[i - stride]) / (desired.t[i] - desired.t[i - stride]));
        let slopes: Vec<f64> = slopes.filter(|v| v.is_finite()).collect();
        slopes.iter().map(|v| v * v).sum::<f64>() / slopes.len().max(1) as f64
    });
    squares.sum::<f64>().sqrt() / spread
}

/// What the lags of a session's clips say about its logs.
pub(super) fn remarks(clips: &[(&Columns, Lag)]) -> Vec<Remark> {
    let clips: Vec<(&Columns, Lag)> = clips.iter().filter(|(_, lag)| lag.correlation > FOLLOWS).copied().collect();
    let by_speed = goes_with_speed(&clips);
    if let Some(remark) = by_speed.or_else(|| differs(&clips)) {
        return vec![remark];
    }
    clips.iter().filter_map(|(clip, lag)| impossible(clip, lag)).collect()
}

fn sigma(clip: &Columns, lag: &Lag) -> f64 {
    let step = clip.measured.step().max(clip.desired.step());
    (0.5 * (lag.interval[1] - lag.interval[0]) / 1.96).hypot(LAG_SIGMA).hypot(0.5 * step)
}

/// A lag that halves when the speed doubles.
fn goes_with_speed(clips: &[(&Columns, Lag)]) -> Option<Remark> {
    let rates: Vec<f64> = clips.iter().map(|(_, lag)| lag.rate).collect();
    let [slow, fast] = range(&rates)?;
    if clips.len() < 2 || fast < SPEEDS_DIFFER * slow {
        return None;
    }
    // Both laws by weighted least squares: lag = a, and lag = b / rate.
    let sum = |of: &dyn Fn(f64, f64) -> f64| {
        clips.iter().map(|(clip, lag)| of(lag.seconds, lag.rate.recip()) / sigma(clip, lag).powi(2)).sum::<f64>()
    };
    let constant = sum(&|lag, _| lag) / sum(&|_, _| 1.0);
    let shift = sum(&|lag, x| lag * x) / sum(&|_, x| x * x);
    let left = [sum(&|lag, _| (lag - constant).powi(2)), sum(&|lag, x| (lag - shift * x).powi(2))];
    let significant = left[0] > LAGS_DIFFER * LAGS_DIFFER;
    if !significant || left[1] > GOES_WITH_SPEED * left[0] {
        return None;
    }
    let by_rate = |a: &&(&Columns, Lag), b: &&(&Columns, Lag)| a.1.rate.total_cmp(&b.1.rate);
    let (slowest, fastest) = (clips.iter().min_by(by_rate)?, clips.iter().max_by(by_rate)?);
    let half = 1.96 / sum(&|_, x| x * x).sqrt();
    let mut remark = Remark::new(
        Fault::MisalignedLogs,
        &slowest.0.file,
        "lag",
        format!(
            "the arm is {} its commands in {} and {} them in {}, which is {:.2} times as fast: a lag that goes with 1 / speed is no \
             delay, the logs were laid against each other wrongly",
            by(slowest.1.seconds),
            slowest.0.file,
            by(fastest.1.seconds),
            fastest.0.file,
            fastest.1.rate / slowest.1.rate
        ),
    )
    .sized(Size { value: shift, interval: [shift - half, shift + half], unit: "lag x rate" })
    .mended_by("stamp commands and measurements when they happen, by one clock, and compare them by their stamps, not by row");
    remark.clips = clips.iter().map(|(clip, _)| clip.file.clone()).collect();
    Some(remark)
}

fn by(lag: f64) -> String {
    if lag < 0.0 { format!("{:.0} ms ahead of", -lag * 1e3) } else { format!("{:.0} ms behind", lag * 1e3) }
}

/// Lags that differ from clip to clip without a rule.
fn differs(clips: &[(&Columns, Lag)]) -> Option<Remark> {
    let lags: Vec<f64> = clips.iter().map(|(_, lag)| lag.seconds).collect();
    let [least, most] = range(&lags)?;
    let sigma = clips.iter().map(|(clip, lag)| sigma(clip, lag)).fold(0.0, f64::max);
    if clips.len() < 2 || most - least < LAGS_DIFFER * sigma {
        return None;
    }
    let middle = mean(&lags);
    let (worst, lag) =
        clips.iter().max_by(|a, b| (a.1.seconds - middle).abs().total_cmp(&(b.1.seconds - middle).abs()))?;
    let mut remark = Remark::new(
        Fault::MisalignedLogs,
        &worst.file,
        "lag",
        format!(
            "the lag between command and measurement differs from clip to clip, {:.0} to {:.0} ms ({:.0} ms in {}): the logs were \
             not stamped by one clock",
            least * 1e3,
            most * 1e3,
            lag.seconds * 1e3,
            worst.file
        ),
    )
    .sized(Size { value: most - least, interval: [(most - least - 2.0 * sigma).max(0.0), most - least + 2.0 * sigma], unit: "s" })
    .mended_by("let one machine stamp both topics, then record again");
    remark.clips = clips.iter().map(|(clip, _)| clip.file.clone()).collect();
    Some(remark)
}

/// An arm that moves before it is told to, or later than any controller.
fn impossible(clip: &Columns, lag: &Lag) -> Option<Remark> {
    let step = clip.measured.step().max(clip.desired.step());
    let [lo, hi] = lag.interval;
    let leads = -lag.seconds > LEAD.max(LEAD_STEPS * step) && hi < 0.0;
    let late = lag.seconds > LONGEST_DELAY && lo > 0.5 * LONGEST_DELAY;
    let what = match (leads, late) {
        (true, _) => format!("the arm moves {:.0} ms before it is commanded to", -lag.seconds * 1e3),
        (_, true) => {
            format!("the arm moves {:.0} ms after it is commanded to: no controller is so late", lag.seconds * 1e3)
        }
        _ => return None,
    };
    Some(
        Remark::new(Fault::MisalignedLogs, &clip.file, "lag", format!("{what}: the logs are shifted against each other"))
            .sized(Size { value: lag.seconds, interval: lag.interval, unit: "s" })
            .mended_by(
                "stamp commands and measurements by one clock; `calibration capture excitation --cell cell.toml --out again \
                 --repeat 1 --speed 0.5` tells a delay, which stays, from a shift, which doubles",
            ),
    )
}
