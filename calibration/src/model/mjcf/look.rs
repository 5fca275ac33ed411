//! What is seen in MJCF: the arm's parts, light, a floor, and a keyframe to show the cell in.

use super::super::cell_model::CellModel;
use super::super::known::numbers;
use super::{File, place};

/// The group of shapes that are only seen, as MuJoCo's viewer shows it by default.
const SEEN: &str = "2";

impl File {
    /// Meshes of the arm's parts.
    pub(super) fn files_of_shapes(&mut self, model: &CellModel) {
        for part in model.arm.iter().flat_map(|_| model.look.iter().flat_map(|look| look.all())) {
            // Thin parts have no volume to speak of, and what a shape weighs is the body's to say.
            self.sheet
                .xml
                .leaf("mesh", &[("name", part.name.clone()), ("file", part.file.clone()), ("inertia", "shell".into())]);
        }
    }

    /// The parts on a link: 0 the base, 1 behind the first joint.
    pub(super) fn shapes(&mut self, model: &CellModel, link: usize) {
        for part in model.look.iter().flat_map(|look| look.on(link)) {
            let mut geom = vec![("type", "mesh".into()), ("mesh", part.name.clone()), ("group", SEEN.into())];
            geom.extend(place(&part.in_link));
            geom.extend([("mass", "0".into()), ("rgba", numbers(part.rgba()))]);
            self.sheet.xml.leaf("geom", &geom);
        }
    }

    /// Light, and a floor where there is no table.
    pub(super) fn light(&mut self, model: &CellModel) {
        if model.look.is_none() {
            return;
        }
        self.sheet.xml.leaf("light", &[("pos", "1 -1 3".into()), ("dir", "-0.3 0.3 -1".into())]);
        if model.table.is_none() {
            self.sheet
                .xml
                .leaf("geom", &[("name", "floor".into()), ("type", "plane".into()), ("size", "3 3 0.1".into())]);
        }
    }

    /// The keyframe `home`: the arm ready, held there, and the object where it stands in this file.
    pub(super) fn home(&mut self, model: &CellModel) {
        let (Some(look), Some(arm)) = (&model.look, &model.arm) else { return };
        let object = model.object.as_ref().map(|object| {
            let height = model.table.unwrap_or(0.0) + object.outline.depth;
            [super::scene::OBJECT_AT[0], super::scene::OBJECT_AT[1], height, 1.0, 0.0, 0.0, 0.0]
        });
        let positions = look.ready.iter().copied().chain(object.into_iter().flatten());
        let mut key = vec![("name", "home".into()), ("qpos", numbers(positions))];
        let controls = Self::controls(arm, &look.ready);
        key.extend((!controls.is_empty()).then(|| ("ctrl", numbers(controls))));
        self.sheet.xml.open("keyframe", &[]);
        self.sheet.xml.leaf("key", &key);
        self.sheet.xml.close();
    }
}
