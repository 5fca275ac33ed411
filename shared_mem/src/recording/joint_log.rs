//! Joint rows as they come off one topic: sorted by who published them, put into one joint order.
//!
//! On a topic that several nodes share (an arm and a gripper on `/joint_states`), each list of names is a publisher
//! of its own. Units: rad, rad/s, N m, ns.

use super::ros2::JointState;
use super::series::JointSeries;

/// Which joints are wanted, in which order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Wanted {
    /// Whatever the topic's main publisher lists.
    Any,
    /// These names.
    Names(Vec<String>),
    /// The names of a built-in model; a recording may carry another prefix (`left_fr3_joint1`, `panda_joint1`).
    Model(Vec<String>),
}

/// Parts of joint names that say that an arm is built like the FR3.
const FAMILY: [&str; 4] = ["fr3", "fer", "panda", "franka"];

/// Rows of one topic.
#[derive(Debug, Clone, Default)]
pub(super) struct JointLog {
    publishers: Vec<Publisher>,
    rows: usize,
    /// Rows whose lists disagree in length, and the number of the first one.
    malformed: usize,
    first_malformed: usize,
}

/// Rows that carry the same names.
#[derive(Debug, Clone)]
struct Publisher {
    names: Vec<String>,
    log_times_ns: Vec<u64>,
    has_dq: bool,
    has_tau: bool,
    series: JointSeries,
}

/// What a topic held, in the order that was asked for.
#[derive(Debug)]
pub(super) struct Ordered {
    pub(super) names: Vec<String>,
    pub(super) series: JointSeries,
    pub(super) warnings: Vec<String>,
}

impl JointLog {
    /// Bytes that a row of `state` takes, and publishers that it is compared with.
    pub(super) fn cost(&self, state: &JointState<'_>) -> (usize, usize) {
        let numbers = 3 * state.position.len() + 2;
        (size_of::<f64>() * numbers, self.publishers.len())
    }

    pub(super) fn push(&mut self, state: &JointState<'_>, log_time_ns: u64) {
        let dof = state.position.len();
        if dof == 0 || !(state.names.is_empty() || state.names.len() == dof) {
            if self.malformed == 0 {
                self.first_malformed = self.rows;
            }
            self.malformed += 1;
            self.rows += 1;
            return;
        }
        self.rows += 1;
        let known = self.publishers.iter_mut().find(|p| p.series.dof == dof && p.names == state.names);
        let publisher = match known {
            Some(publisher) => publisher,
            None => {
                self.publishers.push(Publisher::new(&state.names, dof));
                let Some(publisher) = self.publishers.last_mut() else { return };
                publisher
            }
        };
        publisher.push(state, log_time_ns);
    }

    /// True when no row can be used.
    pub(super) fn is_empty(&self) -> bool {
        self.publishers.is_empty()
    }

    /// The rows in the order that `wanted` says, or a sentence about what is missing.
    pub(super) fn finish(self, topic: &str, wanted: &Wanted) -> Result<Ordered, String> {
        let mut warnings = Vec::new();
        if self.malformed > 0 {
            warnings.push(format!(
                "`{topic}`: {} of {} rows left out, whose names and positions differ in number (first: row {}); \
                 look at the publisher",
                self.malformed, self.rows, self.first_malformed
            ));
        }
        let publishers = self.publishers;
        let listed = publishers.iter().map(|p| format!("[{}]", p.names.join(", "))).collect::<Vec<_>>().join(" and ");
        let chosen = publishers
            .into_iter()
            .filter_map(|p| p.columns(wanted).map(|columns| (columns, p)))
            .max_by_key(|(_, p)| p.series.len());
        let Some((columns, publisher)) = chosen else {
            let names = wanted.names().join(", ");
            return Err(format!(
                "cell.toml's joints are [{names}], the recording has {listed}; list the recording's as `joints` in \
                 `[robot]` of cell.toml, beside `urdf` from base to flange, or alone"
            ));
        };
        let others = self.rows - self.malformed - publisher.series.len();
        if others > 0 {
            warnings.push(format!(
                "`{topic}`: {others} rows of other joints left out; only [{}] are read",
                publisher.names.join(", ")
            ));
        }
        if publisher.names.is_empty() {
            warnings.push(format!("`{topic}`: rows carry no joint names; they are taken in the model's order"));
        }
        if let (Wanted::Model(names), Some(stranger)) = (wanted, stranger(&publisher.names, &columns)) {
            let meant = names.join(", ");
            warnings.push(format!(
                "`{stranger}` and its neighbours are taken for the model's [{meant}]: if they are another robot's, remove \
                 the clip, or give its `urdf` in cell.toml"
            ));
        }
        let names = match wanted {
            Wanted::Any => publisher.names.clone(),
            Wanted::Names(names) | Wanted::Model(names) => names.clone(),
        };
        Ok(Ordered { names, series: publisher.into_series().select_columns(&columns), warnings })
    }
}

impl Wanted {
    fn names(&self) -> &[String] {
        match self {
            Self::Any => &[],
            Self::Names(names) | Self::Model(names) => names,
        }
    }
}

impl Publisher {
    fn new(names: &[&str], dof: usize) -> Self {
        Self {
            names: names.iter().map(|&name| name.to_owned()).collect(),
            log_times_ns: Vec::new(),
            has_dq: true,
            has_tau: true,
            series: JointSeries { dof, ..JointSeries::default() },
        }
    }

    fn push(&mut self, state: &JointState<'_>, log_time_ns: u64) {
        self.series.stamps_ns.push(state.stamp_ns);
        self.log_times_ns.push(log_time_ns);
        self.series.q.extend(&state.position);
        self.has_dq &= state.velocity.len() == self.series.dof;
        if self.has_dq {
            self.series.dq.extend(&state.velocity);
        }
        self.has_tau &= state.effort.len() == self.series.dof;
        if self.has_tau {
            self.series.tau.extend(&state.effort);
        }
    }

    /// Stamps are the headers', or, where nobody filled these in, the times of recording.
    fn into_series(self) -> JointSeries {
        let mut series = self.series;
        if series.stamps_ns.iter().all(|&stamp| stamp == 0) {
            series.stamps_ns = self.log_times_ns;
        }
        if !self.has_dq {
            series.dq.clear();
        }
        if !self.has_tau {
            series.tau.clear();
        }
        series
    }

    fn columns(&self, wanted: &Wanted) -> Option<Vec<usize>> {
        let names = wanted.names();
        if matches!(wanted, Wanted::Any) || (self.names.is_empty() && self.series.dof == names.len()) {
            return Some((0..self.series.dof).collect());
        }
        let by_suffix = matches!(wanted, Wanted::Model(_));
        columns(names, &self.names).or_else(|| by_suffix.then(|| columns_by_suffix(names, &self.names))?)
    }
}

/// Where each wanted name stands in `have`; `None` when one is missing.
pub(super) fn columns(wanted: &[String], have: &[String]) -> Option<Vec<usize>> {
    wanted.iter().map(|name| have.iter().position(|h| h == name)).collect()
}

/// The same by `jointN` at the end of the name, where that is unique.
fn columns_by_suffix(wanted: &[String], have: &[String]) -> Option<Vec<usize>> {
    wanted
        .iter()
        .map(|name| {
            let suffix = name.rfind("joint").and_then(|at| name.get(at..))?;
            let mut found = have.iter().enumerate().filter(|(_, h)| h.ends_with(suffix));
            let (column, _) = found.next()?;
            found.next().is_none().then_some(column)
        })
        .collect()
}

/// The first of the columns' joints whose name carries a prefix of an arm that may be built otherwise.
fn stranger<'a>(have: &'a [String], columns: &[usize]) -> Option<&'a String> {
    let own = |name: &str| {
        let prefix = name.rfind("joint").map_or(name, |at| &name[..at]).to_ascii_lowercase();
        prefix.is_empty() || FAMILY.iter().any(|arm| prefix.contains(arm))
    };
    columns.iter().filter_map(|column| have.get(*column)).find(|name| !own(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state<'a>(stamp_ns: u64, names: &[&'a str], position: &[f64]) -> JointState<'a> {
        JointState { stamp_ns, names: names.to_vec(), position: position.to_vec(), velocity: vec![], effort: vec![] }
    }

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|&n| n.to_owned()).collect()
    }

    #[test]
    fn rows_come_out_in_the_wanted_order_whatever_the_recording_lists() {
        let mut log = JointLog::default();
        log.push(&state(1, &["b", "gripper", "a"], &[2.0, 9.0, 1.0]), 0);
        let ordered = log.finish("/q", &Wanted::Names(names(&["a", "b"]))).expect("both joints are there");
        assert_eq!((ordered.series.dof, ordered.series.q), (2, vec![1.0, 2.0]));
    }

    #[test]
    fn a_missing_joint_is_an_error_that_lists_both_sides() {
        let mut log = JointLog::default();
        log.push(&state(1, &["a", "c"], &[1.0, 2.0]), 0);
        let error = log.finish("/q", &Wanted::Names(names(&["a", "b"]))).unwrap_err();
        assert!(error.contains("[a, b]") && error.contains("[a, c]"), "{error}");
    }

    #[test]
    fn a_second_publisher_with_other_joints_is_left_out_and_told() {
        let mut log = JointLog::default();
        log.push(&state(1, &["a"], &[1.0]), 0);
        log.push(&state(1, &["finger"], &[0.02]), 0);
        log.push(&state(2, &["a"], &[1.5]), 0);
        let ordered = log.finish("/q", &Wanted::Any).expect("the arm is there");
        assert_eq!(ordered.series.q, [1.0, 1.5]);
        assert!(ordered.warnings.iter().any(|w| w.contains("1 rows of other joints")), "{:?}", ordered.warnings);
    }

    #[test]
    fn a_built_in_model_accepts_another_prefix_but_not_two_arms() {
        let model = names(&["fr3_joint1", "fr3_joint2"]);
        let one = names(&["panda_joint2", "panda_joint1"]);
        assert_eq!(columns_by_suffix(&model, &one), Some(vec![1, 0]));
        let two = names(&["left_joint1", "left_joint2", "right_joint1", "right_joint2"]);
        assert_eq!(columns_by_suffix(&model, &two), None);
    }

    #[test]
    fn another_robots_joints_that_end_alike_are_taken_with_a_warning() {
        let told = |name: &str| {
            let mut log = JointLog::default();
            log.push(&state(1, &[name], &[1.0]), 0);
            let ordered = log.finish("/q", &Wanted::Model(names(&["fr3_joint1"]))).expect("a joint");
            ordered.warnings.into_iter().any(|warning| warning.contains(name) && warning.contains("another robot"))
        };
        assert!(told("ur3_joint1") && told("left_joint1"));
        assert!(!["fr3_joint1", "left_fr3v2_joint1", "panda_joint1", "Franka_joint1", "joint1"].into_iter().any(told));
    }

    #[test]
    fn unset_header_stamps_are_replaced_by_the_time_of_recording() {
        let mut log = JointLog::default();
        log.push(&state(0, &["a"], &[1.0]), 70);
        log.push(&state(0, &["a"], &[1.0]), 80);
        assert_eq!(log.finish("/q", &Wanted::Any).expect("rows").series.stamps_ns, [70, 80]);
    }
}
