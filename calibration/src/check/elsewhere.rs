//! Forward kinematics against poses: the tool has to come to the object before it moves.

use super::remark::{Fault, Remark};
use inference::admit::object_poses::looked_at;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::Clip;

/// What the screening of clips for identification says about where the poses are.
pub(super) fn remark(file: &str, clip: &Clip, cell: &Cell) -> Option<Remark> {
    if clip.kind != ClipKind::ControlHitSlide || clip.object.is_empty() || clip.measured.is_empty() {
        return None;
    }
    // What the reader noticed is a remark already.
    let silent = Clip { warnings: Vec::new(), damage: None, ..clip.clone() };
    let what = looked_at(silent, cell).elsewhere?;
    let remedy =
        "put `[tool]`, `[table]` and `[robot] base_frame` of cell.toml right, or publish the poses in the base frame";
    Some(Remark::new(Fault::PosesElsewhere, file, "object poses", what).mended_by(remedy))
}
