//! Scans whose splats lie elsewhere than the link that they are drawn as: most likely they are in another frame.

use super::{RobotSurface, ScannedLink};
use nalgebra::{Isometry3, Point3, Vector3};
use shared_mem::statistics::median;

/// Splats fainter than this are haze and say nothing of a surface.
const FAINT: f32 = 0.3;
/// So far around a link's box a splat is still the link's [m]: a scan's haze and cables; an outline without the maker's
/// shapes is only about where the arm is.
const BESIDE_LINK: f64 = 0.05;
const BESIDE_OUTLINE: f64 = 0.15;
/// Share of splats elsewhere from which on it is said.
const MISPLACED_SHARE: f64 = 0.25;

/// One sentence for every scan most of whose splats are not where its link is.
pub(crate) fn misplaced(robot: &RobotSurface, scans: &[ScannedLink], in_base: bool) -> Vec<String> {
    scans.iter().filter_map(|scan| remark(robot, scan, in_base)).collect()
}

fn remark(robot: &RobotSurface, scan: &ScannedLink, in_base: bool) -> Option<String> {
    let (low, high) = bounds(robot, scan.link)?;
    let around = if robot.is_measured() { BESIDE_LINK } else { BESIDE_OUTLINE };
    let clear = scan.splats.splats.iter().filter(|splat| splat.opacity >= FAINT);
    let away = clear.map(|splat| {
        let at = scan.link_from_scan * splat.centre.cast::<f64>();
        let nearest = at.coords.sup(&low.coords).inf(&high.coords);
        (at.coords - nearest).norm()
    });
    let away: Vec<f64> = away.collect();
    let elsewhere = away.iter().filter(|distance| **distance > around).count();
    let middle = median(away.iter().copied())?;
    if (elsewhere as f64) < MISPLACED_SHARE * away.len() as f64 {
        return None;
    }
    let remedy = if in_base {
        "give the joint positions of the scan with --scanned-at"
    } else {
        "splats in the base frame of a robot that was scanned as a whole need --scanned-at Q; `twin label-splats` writes them in the \
         links' frames"
    };
    Some(format!(
        "link{}: {:.0} % of its splats lie more than {:.0} mm beside the link, the middle one {:.0} mm; {remedy}",
        scan.link,
        100.0 * elsewhere as f64 / away.len() as f64,
        around * 1e3,
        middle * 1e3
    ))
}

/// The box around a link's shape in the link's frame; `None` where nothing is known of it, as of the hand.
fn bounds(robot: &RobotSurface, link: usize) -> Option<(Point3<f64>, Point3<f64>)> {
    if link > robot.model().dof() {
        return None;
    }
    let q = robot.model().ready();
    let (links, link_from_base) = (robot.links(), robot.base_from_link(q, link).inverse());
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = -low;
    robot.for_each(q, |part, base_from_part: Isometry3<f64>| {
        if links[part] == link {
            for point in &robot.parts()[part].points {
                let at = (link_from_base * base_from_part * point.cast::<f64>()).coords;
                (low, high) = (low.inf(&at), high.sup(&at));
            }
        }
    });
    (low.x <= high.x).then(|| (low.into(), high.into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::MAX_JOINTS;
    use crate::render::Hand;
    use crate::shipped::shipped;
    use nalgebra::UnitQuaternion;
    use splat::{Splat, SplatCloud};

    #[test]
    fn a_scan_in_the_base_frame_that_is_taken_for_one_in_the_links_is_told() {
        let robot = RobotSurface::new(&shipped(), Hand::None).expect("a robot");
        let mut q = [0.0; MAX_JOINTS];
        q.copy_from_slice(robot.model().ready());
        let (links, mut in_base) = (robot.links(), vec![Vec::new(); 8]);
        robot.for_each(&q, |part, at| {
            if links[part] < 8 {
                in_base[links[part]].extend(robot.parts()[part].points.iter().map(|p| at * p.cast::<f64>()));
            }
        });
        let scan = |link: usize, scan_from_base: Isometry3<f64>, link_from_scan: Isometry3<f64>| {
            let splat = |at: &Point3<f64>| Splat {
                centre: (scan_from_base * at).cast(),
                rotation: UnitQuaternion::identity(),
                sigma: Vector3::repeat(0.003),
                opacity: 0.9,
            };
            let splats: Vec<Splat> = in_base[link].iter().map(splat).collect();
            let splats = SplatCloud { harmonics: vec![[1.0; 3]; splats.len()], splats, degree: 0 };
            ScannedLink { link, link_from_scan, splats }
        };
        let link_from_base = |link: usize| robot.base_from_link(&q, link).inverse();
        let good: Vec<_> = (0..8).map(|link| scan(link, link_from_base(link), Isometry3::identity())).collect();
        assert_eq!(misplaced(&robot, &good, false), [""; 0]);
        let scanned_at: Vec<_> = (0..8).map(|link| scan(link, Isometry3::identity(), link_from_base(link))).collect();
        assert_eq!(misplaced(&robot, &scanned_at, true), [""; 0]);
        // All in the base frame, and nobody said so: every link but the base lies elsewhere.
        let taken: Vec<_> = (0..8).map(|link| scan(link, Isometry3::identity(), Isometry3::identity())).collect();
        let remarks = misplaced(&robot, &taken, false);
        assert!(remarks.len() >= 6 && remarks.iter().all(|line| line.contains("--scanned-at Q")), "{remarks:?}");
        assert!(!remarks.iter().any(|line| line.starts_with("link0")), "{remarks:?}");
    }
}
