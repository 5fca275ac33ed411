//! Where two convex pieces touch: the direction that parts them best (separating axes: faces of either, pairs of edges),
//! then the overlap of the two faces across it, or the nearest places of the two edges.
//!
//! parry's manifolds are not used here, because they ask the allocator in every step, cut faces to four corners, and search
//! overlapping hulls by an expanding polytope, whose normal jumps where a face lies on a face. World frame, SI.

use crate::physics::Hull;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// Most places of one patch: what lies between them adds nothing.
pub(super) const MOST_PLACES: usize = 8;
/// Corners of a face that is clipped.
const MOST_CORNERS: usize = 64;
/// A pair of edges, or a face of the second piece, parts the two only if it does so by this much more [m].
const CLEARLY: f64 = 1e-6;
/// While no corner has moved by more than this since, the direction found then is taken again [m].
const UNMOVED: f64 = 1e-6;
/// Edges at a smaller angle have no common normal [rad].
const PARALLEL: f64 = 1e-4;

/// A direction in which two pieces may be apart.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Axis {
    FaceOfFirst(usize),
    FaceOfSecond(usize),
    Edges(usize, usize),
}

/// The direction found before, and where the second piece was then in the axes of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Search {
    axis: Axis,
    between: Isometry3<f64>,
    is_close: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// In the middle between the two surfaces.
    pub(super) at: Point3<f64>,
    /// Between the surfaces; negative where they overlap [m].
    pub(super) gap: f64,
}

/// All places where the two touch or nearly do.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touching {
    /// From the first piece to the second, world axes.
    pub(super) normal: Vector3<f64>,
    places: [Place; MOST_PLACES],
    count: usize,
}

/// A piece with where it is.
#[derive(Clone, Copy)]
pub(super) struct Located<'a> {
    pub(super) hull: &'a Hull,
    pub(super) at: &'a Isometry3<f64>,
}

/// Both pieces, seen from the first.
struct Pair<'a> {
    first: &'a Hull,
    second: &'a Hull,
    turn: Matrix3<f64>,
    shift: Vector3<f64>,
}

/// How far apart the pieces are along a direction, and that direction in the axes of the first.
#[derive(Clone, Copy)]
struct Separation {
    axis: Axis,
    distance: f64,
    normal: Vector3<f64>,
}

impl Touching {
    pub(super) fn places(&self) -> &[Place] {
        &self.places[..self.count]
    }
}

impl Search {
    pub(super) const NONE: Self = Self {
        axis: Axis::FaceOfFirst(0),
        between: Isometry3 {
            rotation: nalgebra::Unit::new_unchecked(nalgebra::Quaternion::new(1.0, 0.0, 0.0, 0.0)),
            translation: nalgebra::Translation { vector: Vector3::new(0.0, 0.0, 0.0) },
        },
        is_close: false,
    };

    /// Whether the direction found before is still the one: no corner has moved enough for another.
    fn still_holds(&self, between: &Isometry3<f64>, radius: f64) -> bool {
        // Twice the sine of half the angle.
        let turned = 2.0 * (between.rotation.coords - self.between.rotation.coords).norm();
        let moved = (between.translation.vector - self.between.translation.vector).norm();
        self.is_close && moved + turned * radius < UNMOVED
    }
}

/// The places nearer than `within` [m]. The direction found before is tried first.
pub(super) fn find(first: Located<'_>, second: Located<'_>, within: f64, last: &mut Search) -> Option<Touching> {
    let between = first.at.inv_mul(second.at);
    let turn = between.rotation.to_rotation_matrix().into_inner();
    let pair = Pair { first: first.hull, second: second.hull, turn, shift: between.translation.vector };
    let before = pair.separation(last.axis);
    if before.is_some_and(|s| s.distance > within) {
        last.is_close = false;
        return None;
    }
    let best = match before {
        Some(before) if last.still_holds(&between, second.hull.radius) => before,
        _ => {
            let best = pair.best(within);
            *last = Search { axis: best.axis, between, is_close: best.distance <= within };
            best
        }
    };
    if best.distance > within {
        return None;
    }
    let mut polygon = Polygon::EMPTY;
    match best.axis {
        Axis::FaceOfFirst(face) => pair.faces(face, &best, within, &mut polygon),
        Axis::FaceOfSecond(face) => pair.turned().faces_turned(&pair, face, &best, within, &mut polygon),
        Axis::Edges(..) => pair.edges(&best, &mut polygon),
    }
    let normal = first.at.rotation * best.normal;
    polygon.thin_out(&best.normal);
    let mut touching = Touching {
        normal,
        places: [Place { at: Point3::origin(), gap: 0.0 }; MOST_PLACES],
        count: polygon.count.min(MOST_PLACES),
    };
    for (place, (corner, gap)) in touching.places.iter_mut().zip(&polygon.corners[..touching.count]) {
        *place = Place { at: first.at * Point3::from(*corner), gap: *gap };
    }
    (touching.count > 0).then_some(touching)
}

impl Pair<'_> {
    /// The direction in which they are farthest apart, or one in which they are farther than `within`.
    fn best(&self, within: f64) -> Separation {
        let mut best = Separation { axis: Axis::FaceOfFirst(0), distance: f64::NEG_INFINITY, normal: Vector3::z() };
        let first = (0..self.first.faces.len()).map(Axis::FaceOfFirst);
        let second = (0..self.second.faces.len()).map(Axis::FaceOfSecond);
        let [rows, columns] = [self.first.edges.len(), self.second.edges.len()];
        let edges = (0..rows).flat_map(|i| (0..columns).map(move |j| Axis::Edges(i, j)));
        for axis in first.chain(second).chain(edges) {
            let Some(other) = self.separation(axis) else { continue };
            let ahead = match (best.axis, axis) {
                (Axis::FaceOfFirst(_), Axis::FaceOfFirst(_)) | (Axis::FaceOfSecond(_), Axis::FaceOfSecond(_)) => 0.0,
                (Axis::Edges(..), Axis::Edges(..)) => 0.0,
                _ => CLEARLY,
            };
            if other.distance > best.distance + ahead {
                best = other;
                if best.distance > within {
                    break;
                }
            }
        }
        best
    }

    fn separation(&self, axis: Axis) -> Option<Separation> {
        let (distance, normal) = match axis {
            Axis::FaceOfFirst(i) => {
                let face = self.first.faces.get(i)?;
                let along = self.turn.tr_mul(&face.normal);
                (least(self.second, &along) + face.normal.dot(&self.shift) - face.offset, face.normal)
            }
            Axis::FaceOfSecond(i) => {
                let face = self.second.faces.get(i)?;
                let along = self.turn * face.normal;
                (least(self.first, &along) - along.dot(&self.shift) - face.offset, -along)
            }
            Axis::Edges(i, j) => {
                let across = self.first.edges.get(i)?.cross(&(self.turn * self.second.edges.get(j)?));
                let length = across.norm();
                if length < PARALLEL {
                    return None;
                }
                let along = across / length;
                let (low, high) = range(self.first, &along);
                let (from, to) = range(self.second, &self.turn.tr_mul(&along));
                let shift = along.dot(&self.shift);
                let (ahead, behind) = (from + shift - high, low - to - shift);
                if ahead > behind { (ahead, along) } else { (behind, -along) }
            }
        };
        Some(Separation { axis, distance, normal })
    }

    /// The same pair seen from the second piece.
    fn turned(&self) -> Pair<'_> {
        let turn = self.turn.transpose();
        Pair { first: self.second, second: self.first, turn, shift: -(turn * self.shift) }
    }

    /// The part of the second piece that lies across a face of the first, near it.
    fn faces(&self, face: usize, best: &Separation, within: f64, polygon: &mut Polygon) {
        let reference = &self.first.faces[face];
        let along = self.turn.tr_mul(&best.normal);
        let opposite = |f: &&crate::physics::Face| f.normal.dot(&along);
        let Some(incident) = self.second.faces.iter().min_by(|a, b| opposite(a).total_cmp(&opposite(b))) else {
            return;
        };
        // A rim with more corners than there is room for is taken corner by corner with some left out.
        let stride = incident.rim.len().div_ceil(MOST_CORNERS / 2);
        for corner in incident.rim.iter().step_by(stride) {
            polygon.push(self.turn * self.second.corners[*corner as usize].coords + self.shift);
        }
        let place = |i: usize| self.first.corners[reference.rim[i % reference.rim.len()] as usize].coords;
        for i in 0..reference.rim.len() {
            let (from, to) = (place(i), place(i + 1));
            polygon.clip(&(to - from).cross(&best.normal), &from);
        }
        polygon.keep_near(&best.normal, reference.offset, within);
    }

    /// The same for a face of the second piece: `self` is the pair seen from there.
    fn faces_turned(&self, seen: &Pair<'_>, face: usize, best: &Separation, within: f64, polygon: &mut Polygon) {
        let from_second = Separation { normal: -(self.turn * best.normal), ..*best };
        self.faces(face, &from_second, within, polygon);
        for (corner, _) in &mut polygon.corners[..polygon.count] {
            *corner = seen.turn * *corner + seen.shift;
        }
    }

    /// The nearest places of the two edges that face each other.
    fn edges(&self, best: &Separation, polygon: &mut Polygon) {
        let [a, b] = outermost(self.first, &best.normal);
        let turned = -self.turn.tr_mul(&best.normal);
        let [c, d] = outermost(self.second, &turned).map(|p| self.turn * p + self.shift);
        let (u, v, w) = (b - a, d - c, a - c);
        let (uu, uv, vv) = (u.norm_squared(), u.dot(&v), v.norm_squared());
        let across = uu * vv - uv * uv;
        if across <= 0.0 {
            return;
        }
        let s = ((uv * v.dot(&w) - vv * u.dot(&w)) / across).clamp(0.0, 1.0);
        let t = ((uu * v.dot(&w) - uv * u.dot(&w)) / across).clamp(0.0, 1.0);
        polygon.corners[0] = (0.5 * (a + u * s + c + v * t), best.distance);
        polygon.count = 1;
    }
}

/// Two directions across a normal, with which it makes right-handed axes.
pub(super) fn tangents(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let least = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let first = least.cross(normal).normalize();
    [first, normal.cross(&first)]
}

/// How far a hull reaches against a direction.
fn least(hull: &Hull, along: &Vector3<f64>) -> f64 {
    hull.corners.iter().map(|p| p.coords.dot(along)).fold(f64::INFINITY, f64::min)
}

fn range(hull: &Hull, along: &Vector3<f64>) -> (f64, f64) {
    hull.corners
        .iter()
        .map(|p| p.coords.dot(along))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// Both ends of the edge that lies farthest along a direction across it.
fn outermost(hull: &Hull, along: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let (_, most) = range(hull, along);
    let mut on_edge = hull.corners.iter().filter(|p| p.coords.dot(along) > most - CLEARLY).map(|p| p.coords);
    let first = on_edge.next().unwrap_or_default();
    let last = on_edge.max_by(|a, b| (a - first).norm_squared().total_cmp(&(b - first).norm_squared()));
    [first, last.unwrap_or(first)]
}

/// Corners of the overlap, each with its gap, in the axes of the first piece.
#[derive(Clone, Copy)]
struct Polygon {
    corners: [(Vector3<f64>, f64); MOST_CORNERS],
    count: usize,
}

impl Polygon {
    const EMPTY: Self = Self { corners: [(Vector3::new(0.0, 0.0, 0.0), 0.0); MOST_CORNERS], count: 0 };

    fn push(&mut self, corner: Vector3<f64>) {
        if self.count < MOST_CORNERS {
            self.corners[self.count] = (corner, 0.0);
            self.count += 1;
        }
    }

    /// Cuts off what lies beyond a plane through `from` (Sutherland, Hodgman 1974).
    fn clip(&mut self, outwards: &Vector3<f64>, from: &Vector3<f64>) {
        let whole = *self;
        self.count = 0;
        for i in 0..whole.count {
            let (here, next) = (whole.corners[i].0, whole.corners[(i + 1) % whole.count].0);
            let (beyond, then) = (outwards.dot(&(here - from)), outwards.dot(&(next - from)));
            if beyond <= 0.0 {
                self.push(here);
            }
            if (beyond < 0.0 && then > 0.0) || (beyond > 0.0 && then < 0.0) {
                self.push(here + (next - here) * (beyond / (beyond - then)));
            }
        }
    }

    /// Leaves corners nearer to a plane than `within`, in the middle between there and the plane.
    fn keep_near(&mut self, normal: &Vector3<f64>, offset: f64, within: f64) {
        let whole = *self;
        self.count = 0;
        for (corner, _) in &whole.corners[..whole.count] {
            let gap = normal.dot(corner) - offset;
            if gap <= within {
                self.corners[self.count] = (corner - normal * (0.5 * gap), gap);
                self.count += 1;
            }
        }
    }

    /// Leaves the outermost corners all around where there are more than a patch holds.
    fn thin_out(&mut self, normal: &Vector3<f64>) {
        if self.count <= MOST_PLACES {
            return;
        }
        let whole = *self;
        let [across, aside] = tangents(normal);
        self.count = 0;
        let mut taken = [false; MOST_CORNERS];
        for i in 0..MOST_PLACES {
            let (sin, cos) = (i as f64 * std::f64::consts::TAU / MOST_PLACES as f64).sin_cos();
            let along = across * cos + aside * sin;
            let reach = |k: &usize| whole.corners[*k].0.dot(&along);
            let farthest = (0..whole.count).max_by(|a, b| reach(a).total_cmp(&reach(b)));
            if let Some(k) = farthest.filter(|k| !taken[*k]) {
                taken[k] = true;
                self.corners[self.count] = whole.corners[k];
                self.count += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::plan::{box_hull, cylinder_hull};
    use nalgebra::UnitQuaternion;

    fn touch(a: &Hull, at_a: Isometry3<f64>, b: &Hull, at_b: Isometry3<f64>) -> Option<Touching> {
        find(Located { hull: a, at: &at_a }, Located { hull: b, at: &at_b }, 1e-3, &mut { Search::NONE })
    }

    #[test]
    fn a_box_on_a_box_touches_at_the_corners_of_the_overlap() {
        let (below, above) = (box_hull([0.1, 0.1, 0.1]).expect("a box"), box_hull([0.06, 0.2, 0.1]).expect("a box"));
        for swapped in [false, true] {
            let lower = Isometry3::identity();
            let upper = Isometry3::translation(0.03, 0.0, 0.1 + 1e-4);
            let found = if swapped { touch(&above, upper, &below, lower) } else { touch(&below, lower, &above, upper) };
            let found = found.expect("they touch");
            let down = if swapped { -1.0 } else { 1.0 };
            assert!((found.normal - Vector3::z() * down).norm() < 1e-12, "{}", found.normal);
            assert_eq!(found.places().len(), 4);
            for place in found.places() {
                assert!((place.gap - 1e-4).abs() < 1e-12 && (place.at.z - 0.05005).abs() < 1e-12);
                assert!(((place.at.x - 0.025).abs() - 0.025).abs() < 1e-12 && (place.at.y.abs() - 0.05).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn crossed_edges_touch_at_one_place() {
        let a = box_hull([0.1, 0.02, 0.02]).expect("a box");
        let [below, above] = [Vector3::x(), Vector3::y()].map(|axis| {
            UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(axis), 0.25 * std::f64::consts::PI)
        });
        let b = box_hull([0.02, 0.1, 0.02]).expect("a box");
        let height = 0.02 * 2.0_f64.sqrt() - 1e-4;
        let found = touch(
            &a,
            Isometry3::from_parts(Vector3::zeros().into(), below),
            &b,
            Isometry3::from_parts(Vector3::new(0.01, 0.0, height).into(), above),
        );
        let found = found.expect("they touch");
        assert_eq!(found.places().len(), 1);
        let place = found.places()[0];
        assert!((place.at - Point3::new(0.01, 0.0, 0.5 * height)).norm() < 1e-9, "{}", place.at);
        assert!((place.gap + 1e-4).abs() < 1e-9 && (found.normal - Vector3::z()).norm() < 1e-9);
    }

    #[test]
    fn a_round_base_touches_at_eight_places_and_what_is_far_touches_nowhere() {
        let (table, plate) = (box_hull([1.0, 1.0, 0.1]).expect("a box"), cylinder_hull(0.1, 0.02).expect("a plate"));
        let found = touch(&table, Isometry3::identity(), &plate, Isometry3::translation(0.0, 0.0, 0.06));
        assert_eq!(found.expect("they touch").places().len(), MOST_PLACES);
        assert!(touch(&table, Isometry3::identity(), &plate, Isometry3::translation(0.0, 0.0, 0.0611)).is_none());
        assert!(touch(&table, Isometry3::identity(), &plate, Isometry3::translation(0.61, 0.0, 0.06)).is_none());
    }
}
