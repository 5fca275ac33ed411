//! Clips of one joint that goes where it is commanded to be.

use shared_mem::cell::ClipKind;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use shared_mem::time::seconds_between;

/// `q` gives the joint [rad] at a stamp [s].
pub(in crate::diagnose) fn of_one_joint(stamps_ns: Vec<u64>, q: impl Fn(f64) -> f64) -> Clip {
    let q = stamps_ns.iter().map(|ns| q(seconds_between(0, *ns))).collect();
    let series = JointSeries { stamps_ns, dof: 1, q, dq: Vec::new(), tau: Vec::new() };
    Clip {
        file: "clip.mcap".into(),
        kind: ClipKind::Excitation,
        joint_names: vec!["joint1".into()],
        desired: series.clone(),
        measured: series,
        torques_end_at_rows: false,
        origins: shared_mem::origin::Origins::default(),
        object: ObjectSeries::default(),
        others: Vec::new(),
        warnings: Vec::new(),
        damage: None,
    }
}
