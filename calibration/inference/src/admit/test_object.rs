//! A clip of a box that slides, for tests of what is noticed in poses.

use nalgebra::Isometry3;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use shared_mem::toml_file;
use std::path::Path;

/// A table and a box of 8 x 6 x 10 cm.
pub(super) fn cell() -> Cell {
    let text = "[table]\nheight = 0.0\n[object]\nshape = \"box\"\nsize = [0.08, 0.06, 0.1]\n";
    toml_file::parse(text, Path::new("cell.toml")).expect("a cell.toml")
}

/// A box that stands for half a second, slides 0.1 m and rests, seen at 60 Hz.
pub(super) fn clip(change: impl Fn(usize, &mut Isometry3<f64>)) -> Clip {
    let poses = (0..90).map(|row| {
        let along = ((row as f64 - 30.0) / 20.0).clamp(0.0, 1.0);
        let mut pose = Isometry3::translation(0.5 + 0.1 * along, 0.0, 0.05);
        change(row, &mut pose);
        Pose::<Base, Object>::from_isometry(pose)
    });
    let object = ObjectSeries { poses: poses.collect(), stamps_ns: (0..90).map(|row| row * 16_666_667).collect() };
    Clip {
        file: "clip.mcap".into(),
        kind: ClipKind::ControlHitSlide,
        torques_end_at_rows: false,
        origins: shared_mem::origin::Origins::default(),
        joint_names: Vec::new(),
        desired: JointSeries::default(),
        measured: JointSeries::default(),
        object,
        others: Vec::new(),
        warnings: Vec::new(),
        damage: None,
    }
}
