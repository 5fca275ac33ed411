//! The figures of a run: what `twin shadow` prints at its end. What was not measured is `null`, never 0.

use hdrhistogram::Histogram;
use serde_json::{Value, json};

/// Ages of the arm states on arrival.
#[derive(Debug, Clone)]
pub struct Ages {
    nanoseconds: Histogram<u64>,
}

impl Default for Ages {
    fn default() -> Self {
        // Three digits from a nanosecond up to a minute; older states count as a minute.
        Self { nanoseconds: Histogram::new_with_bounds(1, 60_000_000_000, 3).expect("bounds in order") }
    }
}

impl Ages {
    pub(super) fn record(&mut self, age_ns: u64) {
        self.nanoseconds.saturating_record(age_ns);
    }

    /// Age that a share of the states did not exceed, 0 to 1 [µs]; `None` without states.
    pub fn quantile_us(&self, share: f64) -> Option<f64> {
        (!self.nanoseconds.is_empty()).then(|| self.nanoseconds.value_at_quantile(share) as f64 * 1e-3)
    }

    fn json(&self) -> Value {
        json!({
            "p50": self.quantile_us(0.5), "p99": self.quantile_us(0.99), "p999": self.quantile_us(0.999),
            "max": (!self.nanoseconds.is_empty()).then(|| self.nanoseconds.max() as f64 * 1e-3),
        })
    }
}

/// Figures of a run.
#[derive(Debug, Clone)]
pub struct Summary {
    pub cycles: u64,
    /// States thrown away: unread because the twin fell behind, or not finite.
    pub dropped: u64,
    /// Times arm or object were set onto the real ones.
    pub alignments: u32,
    /// Ages of the states on arrival.
    pub ages: Ages,
    /// Root mean square of twin minus robot over the run, per joint [rad]; `None` where nothing was mirrored.
    pub joint_rms: Option<Vec<f64>>,
    /// Mean ADD and ADD-S over the object's poses [m]; `None` without poses.
    pub object: Option<(f64, f64)>,
    /// The same of each object that has a name, in the order of cell.toml.
    pub objects: Vec<(String, Option<(f64, f64)>)>,
}

impl Summary {
    /// The answer of `twin shadow --json`. `busy_s` is the time the twin's thread computed: simulated time over it is
    /// how much faster than the robot the twin could have gone.
    pub fn json(&self, busy_s: f64) -> Value {
        let gap = |(name, gap): &(String, Option<(f64, f64)>)| {
            let gap = json!({ "add_m": gap.map(|(add, _)| add), "add_s_m": gap.map(|(_, add_s)| add_s) });
            (name.clone(), gap)
        };
        let objects: serde_json::Map<String, Value> = self.objects.iter().map(gap).collect();
        json!({
            "cycles": self.cycles,
            "real_time_factor": self.real_time_factor(busy_s),
            "dropped": self.dropped,
            "alignments": self.alignments,
            "age_us": self.ages.json(),
            "gap": {
                "joint_rms_rad": self.joint_rms,
                "object_add_m": self.object.map(|(add, _)| add),
                "object_add_s_m": self.object.map(|(_, add_s)| add_s),
                "objects": objects,
            },
        })
    }

    /// The same for people; `None` where nothing was mirrored.
    pub fn text(&self, busy_s: f64) -> Option<String> {
        let worst = self.joint_rms.as_ref()?.iter().copied().fold(0.0, f64::max);
        let seen = |name: &str, gap: &Option<(f64, f64)>| match gap {
            Some((add, add_s)) => format!("{name} ADD {:.2} mm, ADD-S {:.2} mm", add * 1e3, add_s * 1e3),
            None => format!("no {name} was seen"),
        };
        let object = match &self.objects[..] {
            several @ [_, _, ..] => several.iter().map(|(name, gap)| seen(name, gap)).collect::<Vec<_>>().join("; "),
            _ => seen("object", &self.object),
        };
        Some(format!(
            "mirrored {} cycles, dropped {}, aligned {} times; {:.0} times faster than real time\n\
             age of a state: median {:.0} µs, 99 % {:.0} µs\n\
             joint gap: {:.1} µrad RMS in the worst joint; {object}",
            self.cycles,
            self.dropped,
            self.alignments,
            self.real_time_factor(busy_s)?,
            self.ages.quantile_us(0.5)?,
            self.ages.quantile_us(0.99)?,
            worst * 1e6,
        ))
    }

    fn real_time_factor(&self, busy_s: f64) -> Option<f64> {
        (self.cycles > 0).then(|| self.cycles as f64 * shared_mem::time::TICK / busy_s.max(1e-9))
    }
}
