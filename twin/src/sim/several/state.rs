//! The whole state of a simulated cell with all its objects, to go on from later.

use super::SimScene;
use super::many::ManyBodies;
use crate::sim::contact::ContactRecord;
use crate::sim::{SimObjectMotion, SimState};
use shared_mem::msg::object::ObjectName;

/// The state of a cell and of all its objects at one moment, without the noise of its sensors.
#[derive(Clone)]
pub struct SceneState {
    cell: SimState,
    others: Vec<(SimObjectMotion, ContactRecord)>,
    many: Option<ManyBodies>,
    is_together: bool,
    known_apart: bool,
    periods: u32,
}

impl SimScene {
    /// What the cell does now, to go on from later.
    pub fn state(&self) -> SceneState {
        SceneState {
            cell: self.cell.state(),
            others: self.others.iter().map(|other| (*other.object.motion(), other.contact.record)).collect(),
            many: self.many.clone(),
            is_together: self.is_together,
            known_apart: self.known_apart,
            periods: self.periods,
        }
    }

    /// Goes on from a state of this cell, bit by bit.
    pub fn resume(&mut self, state: &SceneState) {
        self.cell.resume(&state.cell);
        for (other, (motion, record)) in self.others.iter_mut().zip(&state.others) {
            other.object.resume(motion);
            other.contact.record = *record;
        }
        self.many.clone_from(&state.many);
        (self.is_together, self.known_apart, self.periods) = (state.is_together, state.known_apart, state.periods);
    }

    /// Two bodies that overlap now, by their names; `None` as well for a cell with one object, which nothing can overlap.
    pub fn overlap(&mut self) -> Option<[ObjectName; 2]> {
        let mut many = self.many.take()?;
        if !self.is_together {
            many.take_up(self.objects());
        }
        let found = many.overlap();
        self.many = Some(many);
        let [a, b] = found?;
        Some([*self.names.get(a)?, *self.names.get(b)?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Drive;
    use nalgebra::{Isometry3, Vector3};
    use shared_mem::cell::Cell;
    use shared_mem::frames::Pose;

    fn scene() -> SimScene {
        let objects = "[table]\nheight = 0.0\n\
            [[object]]\nname = \"milk\"\nshape = \"box\"\nsize = [0.1, 0.1, 0.2]\nstart = [0.5, 0.0]\n\
            [[object]]\nname = \"cup\"\nshape = \"box\"\nsize = [0.06, 0.08, 0.1]\nstart = [0.5, 0.3]\n";
        let cell = Cell::parse(objects, std::path::Path::new("cell.toml")).expect("a cell");
        SimScene::new(&cell, None).expect("a scene")
    }

    fn run(scene: &mut SimScene) -> Vec<[f64; 3]> {
        let idle = Drive::JointImpedance { q_d: [0.0; 8], dq_d: [0.0; 8] };
        (0..600).for_each(|_| scene.step(&idle));
        (0..2).map(|number| scene.object(number).expect("a body").position()).collect()
    }

    #[test]
    fn a_cell_goes_on_bit_by_bit_from_where_its_objects_meet() {
        let mut scene = scene();
        let begun = scene.state();
        let pose = scene.object(1).expect("the cup");
        scene.set_object(1, &pose, Vector3::new(0.0, -1.6, 0.0), Vector3::z());
        let sliding = scene.state();
        let first = run(&mut scene);
        assert!(first[0][1] < -5e-3, "the cup did not reach the milk: {first:?}");
        let met = scene.state();
        let second = run(&mut scene);
        scene.resume(&met);
        assert_eq!(run(&mut scene), second);
        scene.resume(&sliding);
        assert_eq!(run(&mut scene), first);
        scene.resume(&begun);
        assert_eq!(run(&mut scene), [[0.5, 0.0, 0.1], [0.5, 0.3, 0.05]]);
    }

    #[test]
    fn bodies_that_are_put_into_each_other_are_named() {
        let mut scene = scene();
        assert_eq!(scene.overlap(), None);
        let inside = Pose::from_isometry(Isometry3::translation(0.5, 0.06, 0.05));
        scene.set_object(1, &inside, Vector3::zeros(), Vector3::zeros());
        assert_eq!(
            scene.overlap().map(|names| names.map(|name| name.text().to_owned())),
            Some(["milk".into(), "cup".into()])
        );
    }
}
