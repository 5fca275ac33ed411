//! Where the base carries its load: places on the table under a standing body, each with the share it takes of an even
//! pressure.
//!
//! Corners: one place per corner of the convex hull of the base. Ring: places evenly along the hull's rim. Uniform: the
//! hull cut into sectors from its centroid and each sector into shells; a place stands at its cell's radius of gyration,
//! so that the yaw of a spinning slide is within 0.5 % of a patch of 2000 places.

use super::polygon::{MAX_POINTS, Polygon};
use nalgebra::Vector2;
use shared_mem::cell::Support;

/// Places along a ring: more moves the yaw of a spinning slide by less than 0.2 %.
const RING_POINTS: usize = 48;
/// Sectors of a uniform patch, or as many as it has edges; shells fill up to [`MAX_POINTS`].
const SECTORS: usize = 16;

/// The places, in the patch frame: from the centre of mass, along the table [m]. Behind the last stands the first again,
/// with no share of the pressure, so that whoever takes a few more sees nothing new.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    points: [Vector2<f64>; MAX_POINTS],
    weights: [f64; MAX_POINTS],
    count: usize,
}

/// All places of a patch in arrays of a length known at compile time: a box on its four corners, which is what most rollouts
/// slide, then costs neither loops nor room for more.
#[derive(Clone, Copy)]
pub(super) struct Places<'a, const N: usize> {
    pub(super) points: &'a [Vector2<f64>; N],
    /// Shares of an even pressure.
    pub(super) shares: &'a [f64; N],
}

/// Evaluates an expression with the places of a patch as `$places`.
macro_rules! with_places {
    ($patch:expr, $places:ident => $body:expr) => {
        match $patch.len() {
            0..=4 => {
                let $places = $patch.first::<4>();
                $body
            }
            5..=8 => {
                let $places = $patch.first::<8>();
                $body
            }
            9..=48 => {
                let $places = $patch.first::<48>();
                $body
            }
            _ => {
                let $places = $patch.first::<{ $crate::sliding::polygon::MAX_POINTS }>();
                $body
            }
        }
    };
}
pub(super) use with_places;

/// The base spans no polygon that could carry a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the base spans no area or has more than {MAX_POINTS} corners; give a mesh with a plane, simpler base")]
pub struct PatchError;

impl Patch {
    /// The patch under the convex hull of `base`, the places where the object touches the table.
    ///
    /// # Errors
    /// [`PatchError`] when the hull has no area or too many corners.
    pub fn under(base: impl Iterator<Item = Vector2<f64>> + Clone, support: Support) -> Result<Self, PatchError> {
        let hull = Polygon::of(base).ok_or(PatchError)?;
        Ok(Self::of_hull(&hull, support))
    }

    /// The patch under a rectangle of full edge lengths `size` whose middle lies at `centre` from the centre of mass.
    ///
    /// # Errors
    /// [`PatchError`] when an edge has no length.
    pub fn rectangle(size: [f64; 2], centre: Vector2<f64>, support: Support) -> Result<Self, PatchError> {
        let corner = |x: f64, y: f64| centre + Vector2::new(0.5 * x * size[0], 0.5 * y * size[1]);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Self::under(corners.into_iter(), support)
    }

    pub(super) fn of_hull(hull: &Polygon, support: Support) -> Self {
        let mut patch = Self { points: [Vector2::zeros(); MAX_POINTS], weights: [0.0; MAX_POINTS], count: 0 };
        match support {
            Support::Corners => hull.corners().iter().for_each(|corner| patch.push(*corner, 1.0)),
            Support::Ring => along_rim(hull, RING_POINTS, |a, b| patch.push((a + b) * 0.5, (b - a).norm())),
            Support::Uniform => {
                let (centre, shells) = (hull.centroid(), MAX_POINTS / SECTORS.max(hull.corners().len()));
                along_rim(hull, SECTORS, |a, b| patch.push_shells(shells, centre, a, b));
            }
        }
        let total: f64 = patch.weights.iter().sum();
        patch.weights.iter_mut().for_each(|w| *w /= total);
        if support == Support::Uniform {
            // Radii of gyration pull an uneven polygon's cells a little off its centroid.
            let shift = hull.centroid() - patch.places().map(|(point, share)| point * share).sum::<Vector2<f64>>();
            patch.points[..patch.count].iter_mut().for_each(|point| *point += shift);
        }
        patch.filled_up()
    }

    fn filled_up(mut self) -> Self {
        let first = self.points[0];
        self.points[self.count..].fill(first);
        self
    }

    /// The places, and behind them as many as it takes to have `N`.
    pub(super) fn first<const N: usize>(&self) -> Places<'_, N> {
        let (points, shares) = (self.points.first_chunk(), self.weights.first_chunk());
        Places { points: points.expect("N places"), shares: shares.expect("N places") }
    }

    /// The same places at `reach` times their distance from the middle of an even pressure.
    pub fn reaching(mut self, reach: f64) -> Self {
        let middle = self.places().map(|(point, share)| point * share).sum::<Vector2<f64>>();
        self.points[..self.count].iter_mut().for_each(|point| *point = middle + (*point - middle) * reach);
        self.filled_up()
    }

    /// Mean squared distance of an even pressure from its middle [m²].
    pub fn gyration_squared(&self) -> f64 {
        let middle = self.places().map(|(point, share)| point * share).sum::<Vector2<f64>>();
        self.places().map(|(point, share)| share * (point - middle).norm_squared()).sum()
    }

    /// Number of places.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no place at all. Never: a patch spans an area.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Each place and its share of an even pressure; the shares add up to 1.
    pub fn places(&self) -> impl Iterator<Item = (Vector2<f64>, f64)> + '_ {
        self.points[..self.count].iter().copied().zip(self.weights[..self.count].iter().copied())
    }

    fn push(&mut self, point: Vector2<f64>, weight: f64) {
        if self.count < MAX_POINTS {
            self.points[self.count] = point;
            self.weights[self.count] = weight;
            self.count += 1;
        }
    }

    /// One sector from `centre` to the rim piece `a`-`b`, in shells of equal thickness.
    fn push_shells(&mut self, shells: usize, centre: Vector2<f64>, a: Vector2<f64>, b: Vector2<f64>) {
        let (middle, area) = ((a + b) * 0.5, 0.5 * (a - centre).perp(&(b - centre)));
        let spread = 1.0 + (b - a).norm_squared() / (12.0 * (middle - centre).norm_squared());
        for shell in 0..shells {
            let inner = shell as f64 / shells as f64;
            let outer = (shell + 1) as f64 / shells as f64;
            let reach = (0.5 * (inner * inner + outer * outer) * spread).sqrt();
            self.push(centre + (middle - centre) * reach, area * (outer * outer - inner * inner));
        }
    }
}

/// Cuts the rim into `pieces` (or fewer) parts that never bend around a corner, and hands out the ends of each.
fn along_rim(hull: &Polygon, pieces: usize, mut each: impl FnMut(Vector2<f64>, Vector2<f64>)) {
    let (edges, perimeter) = (hull.corners().len(), hull.perimeter());
    let spare = pieces.saturating_sub(edges) as f64;
    for (a, b) in hull.edges() {
        let parts = 1 + (spare * (b - a).norm() / perimeter).floor() as usize;
        let at = |i: usize| a + (b - a) * (i as f64 / parts as f64);
        (0..parts).for_each(|i| each(at(i), at(i + 1)));
    }
}
