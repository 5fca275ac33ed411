//! The numbers by which a diagnosis decides that were measured on sessions of another engine: how far such sessions lie from
//! the twin with nothing wrong in them, what a cause leaves, and how often each verdict is right.
//!
//! Each is regenerated from labelled sessions by `calibration benchmark --calibrate FOLDER`; `tests/peers/run.py` records such
//! sessions, in worlds that differ in contact stiffness and damping, table compliance, integrator and step. What other constants
//! of a diagnosis mean, and why they have their values, stands beside them.
//!
//! "Excess" is a mean squared residual less what noise leaves, in squared sigmas of the sensors, in a clip like most (the
//! geometric mean over clips).

/// A measured number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criterion {
    /// Name, as `benchmark --calibrate` prints it.
    pub name: &'static str,
    pub unit: &'static str,
    /// What it says.
    pub meaning: &'static str,
    pub value: f64,
}

const SQUARED_SIGMAS: &str = "squared sigmas";
const SHARE: &str = "share";

/// The joints' excess that is a gap.
pub const JOINTS_EXCESS: Criterion = Criterion {
    name: "joints_excess",
    unit: SQUARED_SIGMAS,
    meaning: "98 of 100 sessions with nothing wrong leave less in the joints",
    value: 0.6,
};
/// The joints' excess beside a cause that was found.
pub const JOINTS_EXCESS_BESIDE_A_CAUSE: Criterion = Criterion {
    name: "joints_excess_beside_a_cause",
    unit: SQUARED_SIGMAS,
    meaning: "98 of 100 sessions leave less in the joints once their cause acts in the twin",
    value: 6.0,
};
/// The object's excess that is a gap.
pub const OBJECT_EXCESS: Criterion = Criterion {
    name: "object_excess",
    unit: SQUARED_SIGMAS,
    meaning: "98 of 100 sessions with nothing wrong leave less in the object's poses",
    value: 14.0,
};
/// The object's excess beside a cause that was found.
pub const OBJECT_EXCESS_BESIDE_A_CAUSE: Criterion = Criterion {
    name: "object_excess_beside_a_cause",
    unit: SQUARED_SIGMAS,
    meaning: "98 of 100 sessions leave less in the object's poses once their cause acts in the twin",
    value: 23.0,
};
/// Share of the joints' gap that a cause leaves.
pub const JOINTS_SHARE_LEFT: Criterion = Criterion {
    name: "joints_share_left",
    unit: SHARE,
    meaning: "98 of 100 causes leave less of the joints' excess",
    value: 0.03,
};
/// Share of the object's gap that a cause leaves.
pub const OBJECT_SHARE_LEFT: Criterion = Criterion {
    name: "object_share_left",
    unit: SHARE,
    meaning: "98 of 100 causes leave less of the excess of the object's poses",
    value: 0.1,
};
/// Where half of the sessions in which no cause is seen have one.
pub const DOUBTFUL: Criterion = Criterion {
    name: "doubtful",
    unit: "least gaps",
    meaning: "of sessions in which no cause is seen, half have one where the excess is this share of what is a gap",
    value: 0.75,
};
/// How sharply that turns.
pub const TURNS_WITHIN: Criterion = Criterion {
    name: "turns_within",
    unit: "least gaps",
    meaning: "scale of the logistic function of the excess around `doubtful`",
    value: 0.12,
};
/// How often nothing is there where that is said of a gap far below `doubtful`.
pub const NONE_IS_RIGHT: Criterion = Criterion {
    name: "none_is_right",
    unit: SHARE,
    meaning: "of verdicts `none` with an excess below half of `doubtful` so many are right",
    value: 0.96,
};
/// How often the cause is in a class.
pub const CLASS_IS_RIGHT: Criterion =
    Criterion { name: "class_is_right", unit: SHARE, meaning: "of classes so many hold the cause", value: 0.9 };
/// How often the cause of a plain gap that nothing explains is outside of the library.
pub const UNKNOWN_IS_RIGHT: Criterion = Criterion {
    name: "unknown_is_right",
    unit: SHARE,
    meaning: "of verdicts `unexplained` of a gap that is plain so many are of a cause outside of the library",
    value: 0.7,
};
/// The same of a gap of less.
pub const UNKNOWN_OF_LITTLE_IS_RIGHT: Criterion = Criterion {
    name: "unknown_of_little_is_right",
    unit: SHARE,
    meaning: "the same of a gap of less: mostly an effect that is too weak to be identified",
    value: 0.2,
};
/// How often a name is wrong however well everything fits.
pub const NAMED_IS_WRONG: Criterion = Criterion {
    name: "named_is_wrong",
    unit: SHARE,
    meaning: "of verdicts `named` so many name what is not there: kept for causes outside of the library",
    value: 0.04,
};

/// More than this share of a gap is most of it, and what comes to it of another does about as well (a choice).
pub const MOST_OF_IT: f64 = 0.5;

/// Excess from which on a gap is plain, over what a cause may leave of the joints', and over the least gap of an object (a choice).
const PLAIN_EXCESS: f64 = 3.0;

/// An excess is plain from here on [squared sigmas].
pub fn plain_excess(of_object: bool) -> f64 {
    PLAIN_EXCESS * if of_object { OBJECT_EXCESS.value } else { JOINTS_EXCESS_BESIDE_A_CAUSE.value }
}
