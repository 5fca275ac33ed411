//! Clips with an object as evidence: the arm before the touch ([`ArmClips`]) and the object's poses ([`ObjectClips`]).

use super::arm_clips::ArmClips;
use super::evidence::{Channel, Evidence, Reach, Row, StageName};
use crate::estimate::{ClipModel, Impossible, Random};
use crate::forward::object::{self, ObjectClips, Part};
use shared_mem::theta::Theta;

/// Coordinates of a pose.
const COORDINATES: [(&str, &str); 6] = [
    ("position", "x"),
    ("position", "y"),
    ("position", "z"),
    ("rotation", "roll"),
    ("rotation", "pitch"),
    ("rotation", "yaw"),
];
/// Parts of a clip with weights of their own: a twin is right about rest long before it is right about a hit.
const PARTS: usize = 3;

/// The arm where there is one, and the object.
pub struct CellClips<F> {
    arm: Option<ArmClips<F>>,
    object: ObjectClips,
    channels: Vec<Channel>,
    rows: Vec<Vec<Row>>,
}

impl<F: Fn(&[f64]) -> Theta + Sync> CellClips<F> {
    /// Both on the same clips in the same order.
    pub fn new(arm: Option<ArmClips<F>>, object: ObjectClips) -> Self {
        let mut channels = arm.as_ref().map_or_else(Vec::new, |arm| arm.channels().to_vec());
        let first = channels.len();
        for _ in 0..PARTS {
            let of = |(quantity, place): (&'static str, &str)| Channel { quantity, place: place.into(), joint: None };
            channels.extend(COORDINATES.map(of));
        }
        let rows = (0..object.clips())
            .map(|clip| {
                let start = object.clip(clip).object.stamps_ns.first().copied().unwrap_or(0);
                let mut rows = arm.as_ref().map_or_else(Vec::new, |arm| arm.rows(clip).to_vec());
                rows.extend(object.rows(clip).iter().filter_map(|row| pose_row(row, first, start)));
                rows
            })
            .collect();
        Self { arm, object, channels, rows }
    }
}

fn pose_row(row: &object::Row, first: usize, start_ns: u64) -> Option<Row> {
    let coordinate = match row.channel {
        object::Channel::Position(axis) => axis,
        object::Channel::Rotation(axis) => 3 + axis,
        object::Channel::Joint(_) => return None,
    };
    let (part, stage, regime) = match row.part {
        Part::Before => (0, StageName::Rest, "before the hit"),
        Part::After => (0, StageName::Rest, "after the slide"),
        Part::Hit => (1, StageName::Hit, "in contact"),
        Part::Slide => (2, StageName::Slide, "sliding"),
    };
    let time = row.stamp_ns.saturating_sub(start_ns) as f64 * 1e-9;
    Some(Row { channel: first + part * COORDINATES.len() + coordinate, stage, regime, time })
}

impl<F: Fn(&[f64]) -> Theta + Sync> ClipModel for CellClips<F> {
    fn clips(&self) -> usize {
        self.object.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let mut poses = Vec::new();
        self.object.residuals(clip, shared, own, &mut poses)?;
        match &self.arm {
            Some(arm) => arm.residuals(clip, shared, &[], out)?,
            None => out.clear(),
        }
        out.extend(poses);
        Ok(())
    }
}

impl<F: Fn(&[f64]) -> Theta + Sync> Evidence for CellClips<F> {
    fn changed(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        (reach, base): (Reach, &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let of_arm = self.arm.as_ref().map_or(0, |arm| arm.rows(clip).len());
        match (reach, &self.arm) {
            (Reach::Arm, Some(arm)) => {
                arm.residuals(clip, shared, &[], out)?;
                out.extend(&base[of_arm..]);
            }
            (Reach::Object, _) => {
                let mut poses = Vec::new();
                self.object.residuals(clip, shared, own, &mut poses)?;
                out.clear();
                out.extend(&base[..of_arm]);
                out.extend(poses);
            }
            _ => self.residuals(clip, shared, own, out)?,
        }
        Ok(())
    }

    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn rows(&self, clip: usize) -> &[Row] {
        &self.rows[clip]
    }

    fn random(&self) -> Vec<Random> {
        self.object.random()
    }
}
