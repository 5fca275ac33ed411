//! Estimated numbers with their intervals, as every answer writes them: `{"value", "ci95", "unit"}`.

use serde::ser::{Serialize, SerializeStruct, Serializer};

/// A parameter of one or several numbers, in SI.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Numbers {
    /// The numbers.
    pub values: Vec<f64>,
    /// An interval each.
    pub intervals: Vec<[f64; 2]>,
    /// How often the intervals are to hold the truth.
    pub level: Level,
    /// SI unit; `1` without.
    pub unit: String,
    /// What there is one number for.
    pub per: Per,
}

/// How often an interval is to hold the truth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Level {
    /// In 90 % of cases.
    Ci90,
    /// In 95 % of cases.
    #[default]
    Ci95,
}

/// What there is one number for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Per {
    /// The whole cell: a single number.
    #[default]
    Cell,
    /// Each joint.
    Joint,
    /// Each axis of a frame.
    Axis,
}

impl Numbers {
    /// What the `k`-th number belongs to, `joint 3` or `y`; empty for a single number.
    #[must_use]
    pub fn part(&self, k: usize) -> String {
        match self.per {
            Per::Cell => String::new(),
            Per::Joint => format!("joint {}", k + 1),
            Per::Axis => ["x", "y", "z"].get(k).map_or_else(|| (k + 1).to_string(), |axis| (*axis).to_owned()),
        }
    }

    /// Every number with its interval; an interval that is missing is not finite.
    pub fn pairs(&self) -> impl Iterator<Item = (f64, [f64; 2])> {
        let intervals = self.intervals.iter().copied().chain(std::iter::repeat([f64::NAN; 2]));
        self.values.iter().copied().zip(intervals)
    }
}

impl Serialize for Numbers {
    /// A single number stands by itself, those of joints and axes as lists.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let interval = match self.level {
            Level::Ci90 => "ci90",
            Level::Ci95 => "ci95",
        };
        let mut out = serializer.serialize_struct("Numbers", 3)?;
        if self.per == Per::Cell {
            out.serialize_field("value", &self.values.first())?;
            out.serialize_field(interval, &self.intervals.first())?;
        } else {
            out.serialize_field("value", &self.values)?;
            out.serialize_field(interval, &self.intervals)?;
        }
        out.serialize_field("unit", &self.unit)?;
        out.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_number_stands_by_itself_and_one_of_a_joint_in_a_list() {
        let text = |numbers: &Numbers| serde_json::to_string(numbers).expect("JSON");
        let delay =
            Numbers { values: vec![0.012], intervals: vec![[0.011, 0.013]], unit: "s".into(), ..Numbers::default() };
        assert_eq!(text(&delay), r#"{"value":0.012,"ci95":[0.011,0.013],"unit":"s"}"#);
        let joint = Numbers { per: Per::Joint, level: Level::Ci90, ..delay };
        assert_eq!(text(&joint), r#"{"value":[0.012],"ci90":[[0.011,0.013]],"unit":"s"}"#);
    }

    #[test]
    fn numbers_say_what_they_belong_to() {
        let of = |per| Numbers { per, ..Numbers::default() };
        assert_eq!([Per::Cell, Per::Joint, Per::Axis].map(|per| of(per).part(2)), ["", "joint 3", "z"]);
    }
}
