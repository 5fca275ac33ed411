//! Stamps: another unit than nanoseconds, and uneven distances. Lost samples are the reader's to tell.

use super::columns::{Columns, Signals};
use super::limits::{FASTEST_LOG, NEAR_CONVERSION, SLOWEST_LOG, UNEVEN_SHARE, UNEVEN_STEP};
use super::remark::{Fault, Remark, Size};
use super::statistics::{median, quantile};
use super::velocity;

/// A clock in another unit: what seconds have to be multiplied by, and the remark.
pub(super) struct Clock {
    pub(super) factor: f64,
    pub(super) remark: Remark,
}

/// Looks whether the stamps count in another unit.
pub(super) fn clock(clip: &Columns) -> Option<Clock> {
    let step = clip.measured.step();
    if clip.measured.len() < 8 || step <= 0.0 {
        return None;
    }
    let rate = step.recip();
    let factor = match rate {
        rate if rate > FASTEST_LOG => slower(clip, rate),
        rate if rate < SLOWEST_LOG => faster(clip)?,
        _ => return None,
    };
    let (unit, were) = match factor {
        f if f > 5e8 => ("s", "seconds"),
        f if f > 5e5 => ("ms", "milliseconds"),
        f if f > 5e2 => ("\u{b5}s", "microseconds"),
        _ => ("ns", "nanoseconds, taken for another unit"),
    };
    let what = format!(
        "rows come every {} by their stamps, which would be {rate:.3e} Hz: the stamps are {were}, not nanoseconds, and count {unit}",
        in_words(step)
    );
    let remark = Remark::new(Fault::StampUnit, &clip.file, "stamps", what)
        .sized(Size::count(factor, "s for a second"))
        .mended_by("write header.stamp in seconds and nanoseconds of one clock (`sec`, `nanosec`)");
    Some(Clock { factor, remark })
}

/// By how much stamps of too fast a log are too small: the velocities say it, or the power of a thousand that makes a log of
/// 1 kHz or less.
fn slower(clip: &Columns, rate: f64) -> f64 {
    let thousand = |times: f64| 1000_f64.powf((times.ln() / 1000_f64.ln()).round().max(1.0));
    match by_velocity(clip) {
        Some(slope) if slope < 1e-2 => thousand(slope.recip()),
        _ => 1000_f64.powf(((rate / 2000.0).ln() / 1000_f64.ln()).ceil().max(1.0)),
    }
}

/// The same of too slow a log, where the velocities say that its clock is another.
fn faster(clip: &Columns) -> Option<f64> {
    let slope = by_velocity(clip)?;
    [1e3, 1e6].into_iter().find(|factor| (slope / factor - 1.0).abs() < NEAR_CONVERSION).map(f64::recip)
}

/// How many times the slope of the positions the velocities are.
fn by_velocity(clip: &Columns) -> Option<f64> {
    let factors: Vec<f64> = velocity::compared(&clip.measured).iter().map(|c| c.factor.value.abs()).collect();
    (!factors.is_empty()).then(|| median(factors))
}

fn in_words(seconds: f64) -> String {
    match seconds {
        s if s < 1e-6 => format!("{:.3} ns", s * 1e9),
        s if s < 1e-3 => format!("{:.3} \u{b5}s", s * 1e6),
        s if s < 1.0 => format!("{:.3} ms", s * 1e3),
        s => format!("{s:.3} s"),
    }
}

/// Topics whose rows are stamped at uneven distances.
pub(super) fn uneven(clip: &Columns) -> Vec<Remark> {
    let mut found: Vec<Remark> =
        clip.topics().into_iter().filter_map(|(topic, s)| uneven_topic(clip, topic, &s.t)).collect();
    found.extend(uneven_topic(clip, "object poses", &clip.pose_t));
    // Rows that hold both are said to be uneven once.
    if let [first, second, ..] = &found[..]
        && first.size == second.size
    {
        let both = Remark {
            channel: "measured and desired".into(),
            what: first.what.replace("measured", "joint"),
            ..first.clone()
        };
        found.splice(0..2, [both]);
    }
    found
}

fn uneven_topic(clip: &Columns, topic: &str, t: &[f64]) -> Option<Remark> {
    let steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    let usual = median(steps.clone());
    if steps.len() < 20 || usual <= 0.0 {
        return None;
    }
    let off = |step: &f64| (step - usual * (step / usual).round().max(1.0)).abs();
    let uneven = steps.iter().filter(|step| off(step) > UNEVEN_STEP * usual).count();
    let share = uneven as f64 / steps.len() as f64;
    if share < UNEVEN_SHARE {
        return None;
    }
    let mut sizes: Vec<f64> = steps.iter().map(|step| (step - usual).abs()).collect();
    let [middle, most] = [quantile(&mut sizes, 0.5), quantile(&mut sizes, 0.99)];
    let (row, longest) = steps.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    Some(
        Remark::new(
            Fault::UnevenStamps,
            &clip.file,
            topic,
            format!(
                "{:.0} % of the {topic} rows come at uneven distances: usually {:.2} ms, off by up to {:.2} ms (99 %), once {:.2} ms",
                100.0 * share,
                usual * 1e3,
                most * 1e3,
                longest * 1e3
            ),
        )
        .at(t[row])
        .sized(Size { value: most, interval: [middle, longest - usual].map(to_ns), unit: "s" })
        .mended_by("stamp rows when they are measured, not when they arrive or are written"),
    )
}

/// Without what is below a nanosecond [s].
fn to_ns(seconds: f64) -> f64 {
    (seconds * 1e9).round() * 1e-9
}

/// Whether a topic's rows and another's come at rates that beat against each other.
pub(super) fn beat(a: &Signals, b: &Signals) -> Option<f64> {
    let (a, b) = (a.step(), b.step());
    let ratio = (a / b).max(b / a);
    (ratio.is_finite() && (ratio - ratio.round()).abs() > super::limits::BEAT).then_some(ratio)
}
