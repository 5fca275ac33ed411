//! Where an edge lies on a profile across it, between whole pixels.
//!
//! Where contrast is largest is not where the edge is: a limb's surface turns away towards its outline, and what light makes
//! of that turn shifts the place of largest contrast by a third of a pixel and more, to the same side all along the limb. So
//! the profile is explained whole: what lies beyond the edge has one brightness, what lies on this side another, that changes
//! with the square root of the distance from the edge, as the normal of a smooth body does towards its outline (Koenderink
//! 1984). Brightnesses follow by least squares for every place that the edge may have; the place that leaves least is the
//! answer. How far it depends on the explanation is reported too: where an edge would lie whose near side changes evenly.

use nalgebra::{SMatrix, SVector};
use std::sync::LazyLock;

/// Samples to either side of the middle, a pixel apart.
pub(super) const SIDE: i32 = 4;
const SAMPLES: usize = 2 * SIDE as usize + 1;
/// How far from the middle an edge is looked for, and the steps in which it is [pixel].
const REACH: f64 = 3.0;
const STEP: f64 = 0.1;
/// One sigma of what the picture was blurred with [pixel²]: one for the bell, a sixth for sampling between pixels.
const BLUR: f64 = 1.0 + 1.0 / 6.0;
/// Explanations of one edge lie no further apart than this [pixel].
const ALIKE: f64 = 1.0;
/// How finely a blurred profile is added up [pixel], and how far beyond the samples.
const FINE: f64 = 0.05;
const BEYOND: f64 = 5.0;

/// Brightness along a profile, from inside to outside, [`SIDE`] samples before and behind the middle.
pub(super) type Samples = SVector<f64, SAMPLES>;

/// An edge on a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    /// How far outwards from the middle it lies [pixel].
    pub(super) away: f64,
    /// By how much the brightness changes there, all channels together.
    pub(super) contrast: f64,
    /// Share of the profile's variance that it explains, 0 to 1.
    pub(super) explained: f64,
    /// How much further outwards it would lie if the near side changed evenly [pixel].
    pub(super) otherwise: f64,
}

/// How the near side changes with the distance from the edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Near {
    /// With its square root: a smooth body that turns away.
    Turning,
    /// In proportion to it.
    Even,
}

/// What profiles look like with an edge at every place.
#[derive(Debug)]
pub(super) struct Profiles {
    turning: Vec<Shape>,
    even: Vec<Shape>,
}

/// A profile with an edge at one place.
#[derive(Debug)]
struct Shape {
    away: f64,
    /// What is left of a profile that is explained by the edge.
    left: SMatrix<f64, SAMPLES, SAMPLES>,
    /// Brightness beyond the edge less that before it.
    contrast: Samples,
}

impl Profiles {
    pub(super) fn all() -> &'static Self {
        static ALL: LazyLock<Profiles> = LazyLock::new(Profiles::new);
        &ALL
    }

    fn new() -> Self {
        let steps = (REACH / STEP).round() as i32;
        let of = |near| (-steps..=steps).filter_map(|step| Shape::new(near, f64::from(step) * STEP)).collect();
        Self { turning: of(Near::Turning), even: of(Near::Even) }
    }

    /// The edge that explains the profile of all channels best; `None` where it lies beyond the reach.
    pub(super) fn edge(&self, channels: &[Samples]) -> Option<Edge> {
        let (shape, away, left) = best(&self.turning, channels)?;
        let contrast = channels.iter().map(|y| shape.contrast.dot(y).powi(2)).sum::<f64>().sqrt();
        let varies = channels.iter().map(|y| y.add_scalar(-y.mean()).norm_squared()).sum::<f64>();
        let explained = if varies > 0.0 { (1.0 - left / varies).max(0.0) } else { 0.0 };
        // Further away it is another edge.
        let near = |shape: &Shape| (shape.away - away).abs() < ALIKE;
        let from = self.even.iter().position(near).unwrap_or(0);
        let near = self.even[from..].iter().take_while(|shape| near(shape)).count();
        let otherwise = best(&self.even[from..from + near], channels).map_or(0.0, |(_, even, _)| even - away);
        Some(Edge { away, contrast, explained, otherwise })
    }
}

/// The shape that leaves least of the profile, the place between shapes, and what is left.
fn best<'a>(shapes: &'a [Shape], channels: &[Samples]) -> Option<(&'a Shape, f64, f64)> {
    let left = |shape: &Shape| channels.iter().map(|y| y.dot(&(shape.left * y))).sum::<f64>();
    let left: Vec<f64> = shapes.iter().map(left).collect();
    let best = (0..left.len()).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
    let (before, here, beyond) = (*left.get(best.checked_sub(1)?)?, left[best], *left.get(best + 1)?);
    let bend = before - 2.0 * here + beyond;
    let shift = if bend > 1e-12 { (0.5 * (before - beyond) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some((&shapes[best], shapes[best].away + shift * STEP, here))
}

impl Shape {
    /// `None` where the parts of the profile cannot be separated.
    fn new(near: Near, away: f64) -> Option<Self> {
        let parts = |x: f64| {
            let depth = away - x;
            let changes = if near == Near::Turning { depth.max(0.0).sqrt() } else { depth };
            if depth > 0.0 { [1.0, changes, 0.0] } else { [0.0, 0.0, 1.0] }
        };
        let fine = (2.0 * (f64::from(SIDE) + BEYOND) / FINE).round() as i32;
        let mut design = SMatrix::<f64, SAMPLES, 3>::zeros();
        for row in 0..SAMPLES {
            let (at, mut sum) = (row as f64 - f64::from(SIDE), 0.0);
            for i in 0..=fine {
                let x = f64::from(i) * FINE - f64::from(SIDE) - BEYOND;
                let bell = (-0.5 * (x - at).powi(2) / BLUR).exp();
                sum += bell;
                parts(x).iter().enumerate().for_each(|(k, part)| design[(row, k)] += bell * part);
            }
            design.row_mut(row).scale_mut(1.0 / sum);
        }
        let inverse = (design.transpose() * design).try_inverse()? * design.transpose();
        let left = SMatrix::identity() - design * inverse;
        Some(Self { away, left, contrast: (inverse.row(2) - inverse.row(0)).transpose() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::Grid;
    use super::*;

    /// A limb as pixels show it: light from one side, the outline at `edge`, blurred as photos are.
    fn limb(edge: f64, radius: f64, light: f64, behind: f64) -> Grid {
        let pixels = Grid::from_fn(80, 3, |x, _| {
            let across = (x as f64 - (edge - radius)) / radius;
            if x as f64 >= edge || across < -1.0 {
                return behind as f32;
            }
            let facing = (across.asin() - light).cos().max(0.0);
            (235.0 * (0.45 + 0.5 * facing)) as f32
        });
        pixels.blurred(2)
    }

    #[test]
    fn light_from_the_side_makes_the_place_depend_on_the_explanation_and_a_plain_step_does_not() {
        let otherwise = |grid: &Grid, edge: f64| {
            let row = |i: usize, _| grid.sample(edge + i as f64 - f64::from(SIDE), 1.0).expect("inside");
            Profiles::all().edge(&[Samples::from_fn(row)]).expect("an edge").otherwise
        };
        let edges = (0..10).map(|k| 40.05 + 0.1 * f64::from(k));
        let limbs: f64 = edges.map(|edge| otherwise(&limb(edge, 12.0, 0.3, 150.0), edge)).sum::<f64>() / 10.0;
        let step = Grid::from_fn(80, 3, |x, _| if x < 40 { 200.0 } else { 90.0 }).blurred(2);
        assert!(limbs < -0.1 && otherwise(&step, 39.5).abs() < 0.05, "{limbs}, {}", otherwise(&step, 39.5));
    }

    /// Mean place, over all places of the outline within a pixel.
    fn found(radius: f64, light: f64, behind: f64) -> f64 {
        let profiles = Profiles::all();
        let away = |k: usize| {
            let edge = 40.05 + 0.1 * k as f64;
            let grid = limb(edge, radius, light, behind);
            let row = |i: usize, _| grid.sample(edge + i as f64 - f64::from(SIDE), 1.0).expect("inside");
            profiles.edge(&[Samples::from_fn(row)]).expect("an edge").away
        };
        (0..10).map(away).sum::<f64>() / 10.0
    }

    #[test]
    fn light_from_the_side_does_not_shift_the_edge_of_a_limb() {
        for (radius, light, behind) in
            [(8.0, 0.6, 150.0), (12.0, 0.6, 130.0), (12.0, 0.9, 150.0), (12.0, -1.2, 180.0), (20.0, 0.6, 150.0)]
        {
            let off = found(radius, light, behind);
            assert!(off.abs() < 0.25, "radius {radius}, light {light}, behind {behind}: {off}");
        }
    }

    #[test]
    fn a_plain_step_lies_where_it_is_and_is_explained() {
        let grid = Grid::from_fn(80, 3, |x, _| if x < 40 { 200.0 } else { 90.0 }).blurred(2);
        let profiles = Profiles::all();
        for middle in [38.2, 39.0, 39.5, 40.4] {
            let row = |i: usize, _| grid.sample(middle + i as f64 - f64::from(SIDE), 1.0).expect("inside");
            let edge = profiles.edge(&[Samples::from_fn(row)]).expect("an edge");
            assert!((middle + edge.away - 39.5).abs() < 0.1, "{edge:?} from {middle}");
            assert!((edge.contrast - 110.0).abs() < 12.0 && edge.explained > 0.99, "{edge:?}");
        }
        let even = Samples::repeat(7.0);
        assert!(profiles.edge(&[even]).is_none_or(|edge| edge.contrast < 1e-6));
    }
}
