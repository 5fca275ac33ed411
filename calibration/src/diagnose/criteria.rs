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

const UNIT_OF_EXCESS: &str = "squared sigmas";
const UNIT_OF_SHARES: &str = "share";

const fn criterion(name: &'static str, unit: &'static str, value: f64, meaning: &'static str) -> Criterion {
    Criterion { name, unit, meaning, value }
}

pub const JOINTS_EXCESS: Criterion =
    criterion("joints_excess", UNIT_OF_EXCESS, 0.6, "98 of 100 sessions with nothing wrong leave less in the joints");
pub const JOINTS_EXCESS_BESIDE_A_CAUSE: Criterion = criterion(
    "joints_excess_beside_a_cause",
    UNIT_OF_EXCESS,
    6.0,
    "98 of 100 sessions leave less in the joints once their cause acts in the twin",
);
pub const OBJECT_EXCESS: Criterion = criterion(
    "object_excess",
    UNIT_OF_EXCESS,
    14.0,
    "98 of 100 sessions with nothing wrong leave less in the object's poses",
);
pub const OBJECT_EXCESS_BESIDE_A_CAUSE: Criterion = criterion(
    "object_excess_beside_a_cause",
    UNIT_OF_EXCESS,
    23.0,
    "98 of 100 sessions leave less in the object's poses once their cause acts in the twin",
);
pub const JOINTS_SHARE_LEFT: Criterion =
    criterion("joints_share_left", UNIT_OF_SHARES, 0.03, "98 of 100 causes leave less of the joints' excess");
pub const OBJECT_SHARE_LEFT: Criterion = criterion(
    "object_share_left",
    UNIT_OF_SHARES,
    0.1,
    "98 of 100 causes leave less of the excess of the object's poses",
);
pub const DOUBTFUL_EXCESS: Criterion = criterion(
    "doubtful",
    "least gaps",
    0.75,
    "of sessions in which no cause is seen, half have one where the excess is this share of what is a gap",
);
pub const TURNS_WITHIN: Criterion =
    criterion("turns_within", "least gaps", 0.12, "scale of the logistic function of the excess around `doubtful`");
pub const NONE_IS_RIGHT: Criterion = criterion(
    "none_is_right",
    UNIT_OF_SHARES,
    0.96,
    "of verdicts `none` with an excess below half of `doubtful` so many are right",
);
pub const CLASS_IS_RIGHT: Criterion =
    criterion("class_is_right", UNIT_OF_SHARES, 0.9, "of classes so many hold the cause");
pub const PART_IS_RIGHT: Criterion = criterion(
    "part_is_right",
    UNIT_OF_SHARES,
    0.6,
    "of verdicts that name an effect although a part of the gap stays so many are right; of all answers on real arms 13 of 21 were",
);
pub const UNKNOWN_IS_RIGHT: Criterion = criterion(
    "unknown_is_right",
    UNIT_OF_SHARES,
    0.7,
    "of verdicts `unexplained` of a gap that is plain so many are of a cause outside of the library",
);
pub const UNKNOWN_OF_LITTLE_IS_RIGHT: Criterion = criterion(
    "unknown_of_little_is_right",
    UNIT_OF_SHARES,
    0.2,
    "the same of a gap of less: mostly an effect that is too weak to be identified",
);
pub const NAMED_IS_WRONG: Criterion = criterion(
    "named_is_wrong",
    UNIT_OF_SHARES,
    0.04,
    "of verdicts `named` so many name what is not there: kept for causes outside of the library",
);

/// More than this share of a gap is most of it, and what comes to it of another does about as well (a choice).
pub const MOST_OF_IT: f64 = 0.5;

/// Excess from which on a gap is plain, over what a cause may leave of the joints', and over the least gap of an object (a choice).
pub const PLAIN_EXCESS: f64 = 3.0;
