//! The robot, each link in a colour that says how large the gap of its joint is.

use crate::answer::diagnosis::{Diagnosis, JointGap};
use crate::page::picture::picture;
use maud::{Markup, html};
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::pack_picture;
use twin::render::{Hand, RobotSurface, portrait};

/// Width and height [pixel].
const SIZE: [usize; 2] = [300, 360];
/// Of a page by day; of what noise alone leaves; and of the largest gap (the page's colour of the twin as it was).
const PAPER: [u8; 3] = [255; 3];
const QUIET: [u8; 3] = [214, 214, 208];
const LARGEST: [u8; 3] = [213, 94, 0];
/// Of base and tool, of which nothing is said.
const SILENT: [u8; 3] = [168, 168, 164];

/// The robot before, and with what was found where `both`; nothing of an arm of unknown shape.
pub(super) fn robot(diagnosis: &Diagnosis, both: bool) -> Option<Markup> {
    let joints = &diagnosis.gap.joints;
    let surface = RobotSurface::new(&diagnosis.cell, Hand::None).ok()?;
    let excess = |mean_square: f64, floor: f64| (mean_square / floor).max(1.0).ln();
    let before = |gap: &JointGap| excess(gap.before, gap.floor);
    let after = |gap: &JointGap| excess(gap.after, gap.floor);
    let most = joints.iter().flat_map(|gap| [before(gap), if both { after(gap) } else { 0.0 }]).fold(0.0, f64::max);
    let drawn = |size: &dyn Fn(&JointGap) -> f64, what: &str| {
        let colour = |link: usize| {
            let gap = joints.iter().find(|gap| gap.joint == link);
            Some(gap.map_or(SILENT, |gap| mixed(if most > 0.0 { size(gap) / most } else { 0.0 })))
        };
        let pixels = portrait(&surface, surface.model().ready(), SIZE, PAPER, colour);
        let png = pack_picture(PixelEncoding::Rgb8, SIZE[0] as u32, SIZE[1] as u32, &pixels).ok()?;
        Some(html! { div { (picture(&png, &format!("the robot, {what}"))) p.note { (what) } } })
    };
    let without = drawn(&before, "without effects")?;
    let with = if both { drawn(&after, "with what was found") } else { None };
    let times = (0.5 * most).exp();
    Some(html! {
        p.note { "Each link in the colour of the joint that moves it: grey leaves what noise alone does, full orange " (format!("{times:.1}")) " times as much (logarithmic)." }
        div.pair { (without) @if let Some(with) = with { (with) } }
    })
}

/// Between the colours of noise alone and of the largest gap.
fn mixed(share: f64) -> [u8; 3] {
    std::array::from_fn(|k| {
        let [from, to] = [QUIET[k], LARGEST[k]].map(f64::from);
        (from + share.clamp(0.0, 1.0) * (to - from)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::diagnosis::Gap;
    use shared_mem::cell::Cell;
    use std::path::Path;

    #[test]
    fn the_robot_is_drawn_where_its_shape_is_known() {
        let joint = JointGap { joint: 4, before: 81.0, after: 1.44, floor: 1.0 };
        let bare = Diagnosis { gap: Gap { joints: vec![joint], ..Gap::default() }, ..Diagnosis::default() };
        assert!(robot(&bare, true).is_none(), "a cell without a robot");
        let diagnosis = Diagnosis { cell: Cell::read(Path::new("fr3")).expect("the built-in cell"), ..bare };
        let both = robot(&diagnosis, true).expect("a picture").into_string();
        assert_eq!(both.matches("data:image/png;base64,").count(), 2);
        assert!(both.contains("full orange 9.0 times"), "{}", &both[..300]);
        let one = robot(&diagnosis, false).expect("a picture").into_string();
        assert_eq!(one.matches("data:image/png;base64,").count(), 1);
        assert_eq!((mixed(0.0), mixed(1.0)), (QUIET, LARGEST));
    }
}
