//! Lengths in the camera's picture are off by a factor.
//!
//! - Equation: `position_reported = centre + (1 + scale) (position - centre)`; the place that stays where it is is the
//!   base's origin, or wherever the camera was aligned.
//! - Source: focal length, depth scale or marker size off.
//! - Units: scale 1; centre m, in the base frame. Plausible: scale -0.1 to 0.1 (0.02 after calibration); centre within
//!   a metre of the base.
//! - Signature (V2): in proportion to the distance, at rest too; speeds and decelerations grow alike.
//! - Confused with: restitution and friction together, an extrinsic translation where the object hardly moves.

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Parameter, Search};
use crate::effects::remedy::{Remedy, short};
use crate::effects::separation::{Experiment, Separation};
use nalgebra::{Isometry3, Vector3};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "camera_scale",
    stage: Stage::Camera,
    acts_on: Place::ObjectObservation,
    parameters: &[
        Parameter::size("scale", "1", [-0.1, 0.1], 0.0).within(-0.99, 100.0),
        Parameter::form("centre", "m", [-1.0, 1.0], 0.0).vector(3).searched(Search::Middle),
    ],
    confusable_with: &["camera_extrinsic_translation", "restitution"],
    separated: &[Separation {
        from: "camera_extrinsic_rotation",
        by: "put the object a known distance from the last place before each of these",
        record: &[Experiment::OneStroke, Experiment::OneStroke],
    }],
    install: |values, effects| {
        let centre: [f64; 3] = values.vector("centre");
        effects.camera.camera_scale = Some(CameraScale { scale: values.number("scale"), centre: centre.into() });
    },
    remedy: |found| {
        let scale = found.number("scale");
        let (words, factor) = (short(100.0 * scale.abs()), short(1.0 + scale));
        let longer = if scale < 0.0 { "too short" } else { "too long" };
        Remedy::new(
            format!(
                "Lengths come out {words} % {longer}: measure marker, depth unit and focal length again, or divide what the tracker reports by {factor}."
            ),
            format!("Nothing in the cell's model; a simulated camera reports lengths times {factor}."),
        )
    },
    model: |_| vec![Change::Beyond("a factor on the lengths that the tracker reports")],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct CameraScale {
    scale: f64,
    centre: Vector3<f64>,
}

impl CameraScale {
    pub(super) fn apply(&self, pose: &mut Isometry3<f64>) {
        pose.translation.vector += (pose.translation.vector - self.centre) * self.scale;
    }

    pub(super) fn undo(&self, pose: &mut Isometry3<f64>) {
        pose.translation.vector = self.centre + (pose.translation.vector - self.centre) / (1.0 + self.scale);
    }
}

#[cfg(test)]
mod tests {
    use super::super::CameraMemory;
    use super::super::test_camera::effects;
    use nalgebra::{Isometry3, Vector3};

    #[test]
    fn distances_grow_by_the_scale_and_turns_stay() {
        let effects = effects("[[effect]]\nname = \"camera_scale\"\nscale = 0.25");
        let see = |x: f64| {
            let pose = Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::z() * 0.3);
            effects.report(&mut CameraMemory::default(), 0, &pose)
        };
        assert_eq!((see(0.8).translation.vector - see(0.4).translation.vector).x, 0.5);
        assert_eq!(see(0.8).rotation, see(0.4).rotation);
    }

    #[test]
    fn the_centre_stays_where_it_is() {
        let effects = effects("[[effect]]\nname = \"camera_scale\"\nscale = 0.25\ncentre = [0.5, 0.0, 0.0]");
        let see = |x: f64| {
            let pose = Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::zeros());
            effects.report(&mut CameraMemory::default(), 0, &pose).translation.vector.x
        };
        assert_eq!((see(0.5), see(0.9)), (0.5, 1.0));
    }
}
