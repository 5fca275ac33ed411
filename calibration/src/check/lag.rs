//! How much later than its command an arm moves, clip by clip, and whether that is a delay ([`import::lag`] owns the estimate).
//!
//! Velocities are compared joint by joint, or, where order or signs are wrong, the speeds of all joints together. A delay
//! stays the same in time whatever the speed; rows that were laid against each other wrongly give a lag that goes with 1 / speed.

use super::columns::{Columns, Signals};
use super::limits::{
    FOLLOWS, GOES_WITH_SPEED, LAG_SIGMA, LAGS_DIFFER, LEAD, LEAD_STEPS, LEAST_CORRELATION, LEAST_MOTION, LONGEST_DELAY,
    SPEEDS_DIFFER,
};
use super::remark::{Fault, Remark, Size};
use super::statistics::{deviation, mean, range};
use import::lag::{self, Group, Motion};
use serde::Serialize;

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

impl Lag {
    /// Whether the interval holds leads and lags that would both matter.
    pub fn tells_neither(&self) -> bool {
        self.interval[0] < -LEAD && self.interval[1] > LEAD
    }
}

/// Both topics where both move.
fn motions(clip: &Columns) -> Option<[Motion<'_>; 2]> {
    let (measured, desired) = (&clip.measured, &clip.desired);
    if measured.dof() != desired.dof() || spread(desired) < LEAST_MOTION || spread(measured) < LEAST_MOTION {
        return None;
    }
    Some([desired, measured].map(|signals| Motion { t: &signals.t, q: &signals.q }))
}

fn spread(signals: &Signals) -> f64 {
    signals.q.iter().map(|q| deviation(q).powi(2)).sum::<f64>().sqrt()
}

/// The lag of a clip; `None` where no motion tells it.
pub(super) fn of(clip: &Columns) -> Option<Lag> {
    let [commanded, done] = motions(clip)?;
    let sure = |lag: &lag::Lag| lag.correlation >= LEAST_CORRELATION;
    // Joints one by one tell more, and nothing where their order or signs are wrong.
    let by_joint = lag::between(commanded, done).filter(sure);
    let lag::Lag { seconds, interval, correlation, .. } =
        by_joint.or_else(|| lag::of_speeds(commanded, done).filter(sure)).filter(|lag| !lag.open)?;
    Some(Lag { seconds, interval, correlation, rate: rate(&clip.desired, spread(&clip.desired)) })
}

/// Groups of joints that lag alike; empty where all do.
pub(super) fn groups(clip: &Columns) -> Vec<Group> {
    motions(clip)
        .map(|[commanded, done]| lag::groups(commanded, done))
        .filter(|groups| groups.len() > 1)
        .unwrap_or_default()
}

/// Root mean square speed over root mean square excursion.
fn rate(desired: &Signals, spread: f64) -> f64 {
    let step = desired.step().max(1e-9);
    // Over 20 ms: from row to row at 1 kHz the resolution of an encoder would be a speed.
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
    // Stamps are as fine as the rows: half a step beside what the fit leaves open.
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

/// An arm that moves before its command, or later than any controller.
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
