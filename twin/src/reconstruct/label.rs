//! Which splat of a scan belongs to which link: the vote of the nearest points of the robot's surface (k nearest
//! neighbours).

use super::nearest::Nearest;
use super::surface::SurfacePoints;
use nalgebra::Similarity3;
use rayon::prelude::*;
use splat::SplatCloud;

/// How many neighbours vote.
const VOTES: usize = 9;

/// A scan in parts, all in the base frame [m].
#[derive(Debug, Clone, PartialEq)]
pub struct Labelled {
    /// The splats of each link, 0 the base.
    pub links: Vec<SplatCloud>,
    /// What is no robot.
    pub rest: SplatCloud,
}

/// Parts a scan. A splat belongs to the robot when its surface is nearer than `reach` [m] and it does not lie on or below
/// `table` [m above the base].
pub fn label(
    scan: &SplatCloud,
    base_from_scan: &Similarity3<f64>,
    robot: &SurfacePoints,
    reach: f64,
    table: Option<f64>,
) -> Labelled {
    let scan = scan.moved(base_from_scan);
    let surface = Nearest::new(robot.points.iter().copied());
    let count = robot.links.iter().max().map_or(0, |most| most + 1);
    let labels: Vec<Option<usize>> = (scan.splats.par_iter())
        .map_init(Vec::new, |found, splat| {
            let at = splat.centre.cast::<f64>();
            if table.is_some_and(|height| at.z <= height) {
                return None;
            }
            surface.some(&at, reach, VOTES, found);
            let nearest = robot.links[found.first()?.1];
            let votes = |link: usize| found.iter().filter(|(_, number)| robot.links[*number] == link).count();
            // The nearest one's link, unless another has more votes.
            (0..count).max_by_key(|link| (votes(*link), *link == nearest))
        })
        .collect();
    let part = |wanted: Option<usize>| scan.only(|number| labels[number] == wanted);
    Labelled { links: (0..count).map(|link| part(Some(link))).collect(), rest: part(None) }
}
