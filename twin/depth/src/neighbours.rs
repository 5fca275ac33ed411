//! Which other views a view is compared with: those that have what it shows in their pictures too, from directions neither so near that
//! depth is uncertain nor so far that pictures differ (the triangulation prior of Schoenberger et al. 2016, section 4.2, and the score of
//! Yao et al., "MVSNet", ECCV 2018, section 4.1).

use crate::camera::View;
use nalgebra::Point3;

/// The best angle between two views [degrees], and how fast smaller and larger ones are worse.
const BEST_ANGLE: f64 = 14.0;
const SMALLER: f64 = 5.0;
const LARGER: f64 = 12.0;
/// Places of a view that are looked for in the others: so many along each edge of the picture, at so many depths.
const ALONG: usize = 4;
const DEPTHS: usize = 3;

/// The numbers of the views to compare one with, the best first, at most so many.
pub(crate) fn best(views: &[View], of: usize, most: usize) -> Vec<usize> {
    let places = places(&views[of]);
    let mut scores: Vec<(usize, f64)> = (0..views.len())
        .filter(|other| *other != of)
        .map(|other| (other, score(&places, &views[of], &views[other])))
        .filter(|(_, score)| *score > 0.0)
        .collect();
    scores.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    scores.into_iter().take(most).map(|(other, _)| other).collect()
}

/// Places that a view may see, in the world.
fn places(view: &View) -> Vec<Point3<f64>> {
    let (camera, [near, far]) = (&view.camera, view.range);
    let world = view.camera_from_world.inverse();
    let along = |number: usize, size: usize| (number as f64 + 0.5) / ALONG as f64 * size as f64;
    let mut places = Vec::new();
    for number in 0..ALONG * ALONG * DEPTHS {
        let (pixel, depth) = (number % (ALONG * ALONG), (number / (ALONG * ALONG)) as f64 + 0.5);
        let at = [along(pixel % ALONG, camera.size[0]), along(pixel / ALONG, camera.size[1])];
        let [x, y] = camera.direction(at);
        let share = depth / DEPTHS as f64;
        let z = 1.0 / ((1.0 - share) / near + share / far);
        places.push(world * Point3::new(x * z, y * z, z));
    }
    places
}

/// How well two views go together: the sum over the places that both may see.
fn score(places: &[Point3<f64>], from: &View, to: &View) -> f64 {
    let [a, b] = [from, to].map(|view| view.camera_from_world.inverse() * Point3::origin());
    let of = |place: &Point3<f64>| {
        let (own, local) = (from.camera_from_world * place, to.camera_from_world * place);
        let [u, v] = [0, 1].map(|i| local[i] / local.z * to.camera.focal[i] + to.camera.centre[i]);
        let [width, height] = to.camera.size.map(|n| n as f64);
        if local.z <= 0.0 || !(u >= 0.0 && v >= 0.0 && u < width && v < height) {
            return 0.0;
        }
        let angle = (a - place).angle(&(b - place)).to_degrees();
        let off = (angle - BEST_ANGLE) / if angle < BEST_ANGLE { SMALLER } else { LARGER };
        // Another size in the picture is another resolution.
        let ratio = (own.z / from.camera.focal[0]) / (local.z / to.camera.focal[0]);
        (-0.5 * off * off).exp() * ratio.min(1.0 / ratio)
    };
    places.iter().map(of).sum()
}
