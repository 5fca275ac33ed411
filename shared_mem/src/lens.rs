//! What a lens does to the picture of a pinhole: a point x/z, y/z of the camera's frame lands elsewhere, by a factor that grows
//! or shrinks with its distance from the axis and, for a lens whose glasses are not centred, by a little more.
//!
//! Two families, with OpenCV's signs and order. The polynomial one is Brown and Conrady's (Brown 1971) and its quotient, OpenCV's
//! rational model: `(1 + k1 s + k2 s² + k3 s³) / (1 + k4 s + k5 s² + k6 s³)` with `s = x² + y²`, and the decentring p1, p2
//! (OpenCV, `projectPoints`). The other is the fisheye of Kannala and Brandt (2006): a ray at the angle θ to the axis lands at
//! `θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)` from the middle (OpenCV, `fisheye::projectPoints`).
//!
//! | file | owns |
//! |---|---|
//! | [`calibration`] | a camera beside a picture, by the names of ROS and OpenCV |
//! | [`coefficients`] | lenses as other programs write them: by the names of models, lists of numbers and keys |
//! | [`listed`] | cameras as lists of pictures hold them |
//! | [`spelling`] | which keys of a file are a lens's |

pub mod calibration;
pub mod coefficients;
pub mod listed;
pub mod spelling;

use nalgebra::{Matrix2, RealField, Vector2, convert};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// How rays bend.
///
/// ```
/// use shared_mem::lens::Distortion;
///
/// let lens = Distortion::brown([-0.1, 0.01, 0.0, 0.0, 0.0]); // k1, k2, p1, p2, k3
/// let (seen, _slope) = lens.bend(0.3, 0.2);
/// assert!(seen.x < 0.3, "a barrel draws towards the middle");
/// let [x, y] = lens.straight(seen.into()).expect("a ray lands there");
/// assert!((x - 0.3).abs() < 1e-9 && (y - 0.2).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distortion<T = f64> {
    /// k1, k2, p1, p2, k3, k4, k5, k6.
    Polynomial([T; 8]),
    /// k1, k2, k3, k4.
    Fisheye([T; 4]),
}

/// Steps backward through a lens; each brings some digits where the lens does not fold the picture.
const STEPS: usize = 40;
/// What is left of a place once it is found [in the plane z = 1]: far below a thousandth of a pixel.
const LEFT: f64 = 1e-10;
/// Rays of a fisheye further from the axis than this have no place in the plane z = 1 that is worth having [rad].
const STEEPEST: f64 = 1.55;
/// And how far out a ray lies that stands for those.
const FAR: f64 = 50.0;

impl Distortion {
    /// A pinhole.
    pub const NONE: Self = Self::Polynomial([0.0; 8]);

    /// Brown and Conrady's five numbers: k1, k2, p1, p2, k3.
    pub const fn brown([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        Self::Polynomial([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0])
    }

    /// The five numbers, where they are all.
    pub fn as_brown(&self) -> Option<[f64; 5]> {
        match *self {
            Self::Polynomial([k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]) => Some([k1, k2, p1, p2, k3]),
            _ => None,
        }
    }

    /// Whether it does anything.
    pub fn is_bent(&self) -> bool {
        *self != Self::NONE
    }

    /// In another precision.
    pub fn of<T: RealField + Copy>(&self) -> Distortion<T> {
        match self {
            Self::Polynomial(k) => Distortion::Polynomial(k.map(convert)),
            Self::Fisheye(k) => Distortion::Fisheye(k.map(convert)),
        }
    }

    /// Where a pinhole would have seen what is seen at a place of the plane z = 1; `None` where no ray of the half-space before
    /// the camera lands there.
    pub fn straight(&self, seen: [f64; 2]) -> Option<[f64; 2]> {
        match self {
            Self::Polynomial(_) if !self.is_bent() => Some(seen),
            Self::Polynomial(_) => self.polynomial_back(Vector2::from(seen)),
            Self::Fisheye(k) => {
                let far = seen[0].hypot(seen[1]);
                let angle = fisheye_back(k, far)?;
                let scale = if far > 0.0 { angle.tan() / far } else { 1.0 };
                Some(seen.map(|v| v * scale))
            }
        }
    }

    /// The same as a direction for every place: one that no ray reaches gets one almost across the axis.
    pub fn direction(&self, seen: [f64; 2]) -> [f64; 2] {
        self.straight(seen).unwrap_or_else(|| seen.map(|v| v * FAR / seen[0].hypot(seen[1])))
    }

    fn polynomial_back(&self, wanted: Vector2<f64>) -> Option<[f64; 2]> {
        let mut at = wanted;
        for _ in 0..STEPS {
            let (bent, slope) = self.bend(at.x, at.y);
            let left = wanted - bent;
            // Where the slope turns over, the lens would show one place twice.
            if slope.determinant() <= 0.0 || !left.norm().is_finite() {
                return None;
            }
            if left.norm() < LEFT {
                return Some(at.into());
            }
            at += slope.try_inverse()? * left;
        }
        None
    }
}

/// The angle whose ray lands so far from the middle.
fn fisheye_back(k: &[f64; 4], far: f64) -> Option<f64> {
    let mut angle = far.min(STEEPEST);
    for _ in 0..STEPS {
        let t = angle * angle;
        let left = far - angle * (1.0 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))));
        if left.abs() < LEFT {
            return (0.0..=STEEPEST).contains(&angle).then_some(angle);
        }
        let slope = 1.0 + t * (3.0 * k[0] + t * (5.0 * k[1] + t * (7.0 * k[2] + t * 9.0 * k[3])));
        if slope <= 0.0 {
            return None;
        }
        angle = (angle + left / slope).clamp(0.0, 2.0 * STEEPEST);
    }
    None
}

impl<T: RealField + Copy> Distortion<T> {
    /// Where a point of the plane z = 1 lands, and the slope of that.
    pub fn bend(&self, x: T, y: T) -> (Vector2<T>, Matrix2<T>) {
        let [two, six] = [2.0, 6.0].map(convert::<f64, T>);
        let (r2, [p1, p2]) = (x * x + y * y, self.decentring());
        let [factor, rise, _] = self.factor(r2);
        let bent = Vector2::new(
            x * factor + two * p1 * x * y + p2 * (r2 + two * x * x),
            y * factor + p1 * (r2 + two * y * y) + two * p2 * x * y,
        );
        let mixed = two * x * y * rise + two * p1 * x + two * p2 * y;
        let slope = Matrix2::new(
            factor + two * x * x * rise + two * p1 * y + six * p2 * x,
            mixed,
            mixed,
            factor + two * y * y * rise + six * p1 * y + two * p2 * x,
        );
        (bent, slope)
    }

    /// How the slope changes with x and with y. It is symmetric, as are the two answers.
    pub fn curvature(&self, x: T, y: T) -> [Matrix2<T>; 2] {
        let [two, four, six] = [2.0, 4.0, 6.0].map(convert::<f64, T>);
        let [p1, p2] = self.decentring();
        let [_, rise, bow] = self.factor(x * x + y * y);
        let xxx = six * x * rise + four * x * x * x * bow + six * p2;
        let xxy = two * y * rise + four * x * x * y * bow + two * p1;
        let xyy = two * x * rise + four * x * y * y * bow + two * p2;
        let yyy = six * y * rise + four * y * y * y * bow + six * p1;
        [Matrix2::new(xxx, xxy, xxy, xyy), Matrix2::new(xxy, xyy, xyy, yyy)]
    }

    fn decentring(&self) -> [T; 2] {
        match *self {
            Self::Polynomial([_, _, p1, p2, ..]) => [p1, p2],
            Self::Fisheye(_) => [T::zero(); 2],
        }
    }

    /// The factor over the square of the distance from the axis, its slope, and the slope of that.
    fn factor(&self, s: T) -> [T; 3] {
        let [one, two] = [T::one(), convert::<f64, T>(2.0)];
        match *self {
            Self::Polynomial([k1, k2, _, _, k3, k4, k5, k6]) => {
                let [above, above_rise, above_bow] = series(s, [one, k1, k2, k3]);
                let [below, below_rise, below_bow] = series(s, [one, k4, k5, k6]);
                let factor = above / below;
                let rise = (above_rise - factor * below_rise) / below;
                [factor, rise, (above_bow - two * rise * below_rise - factor * below_bow) / below]
            }
            Self::Fisheye([k1, k2, k3, k4]) => {
                let [near, near_rise, near_bow] = angle_over_distance(s);
                // The angle's square, over s.
                let (t, t_rise) = (s * near * near, near * near + two * s * near * near_rise);
                let t_bow = two * (two * near * near_rise + s * (near_rise * near_rise + near * near_bow));
                let [sum, sum_rise, sum_bow] = series(t, [one, k1, k2, k3, k4]);
                let (over, over_bow) = (sum_rise * t_rise, sum_bow * t_rise * t_rise + sum_rise * t_bow);
                let rise = near_rise * sum + near * over;
                [near * sum, rise, near_bow * sum + two * near_rise * over + near * over_bow]
            }
        }
    }
}

/// A power series with its two slopes.
fn series<T: RealField + Copy, const N: usize>(s: T, coefficients: [T; N]) -> [T; 3] {
    let [mut value, mut rise, mut bow] = [T::zero(); 3];
    for coefficient in coefficients.into_iter().rev() {
        bow = bow * s + rise + rise;
        rise = rise * s + value;
        value = value * s + coefficient;
    }
    [value, rise, bow]
}

/// `atan(r) / r` over s = r², with its two slopes.
fn angle_over_distance<T: RealField + Copy>(s: T) -> [T; 3] {
    let number = convert::<f64, T>;
    // The quotients below lose digits beside the axis, where the series of twelve terms has them all.
    if s < number(0.05) {
        return series::<T, 12>(s, std::array::from_fn(|n| number([1.0, -1.0][n % 2] / (2 * n + 1) as f64)));
    }
    let (distance, over) = (s.sqrt(), T::one() / (T::one() + s));
    let value = distance.atan() / distance;
    let rise = (over - value) / (number(2.0) * s);
    [value, rise, -(over * over + number(3.0) * rise) / (number(2.0) * s)]
}

/// As files of this project hold it: five numbers, eight, or the four of a fisheye by name.
#[derive(Serialize, Deserialize)]
#[serde(
    untagged,
    expecting = "five numbers k1, k2, p1, p2, k3, eight with k4, k5, k6, or { fisheye = [k1, k2, k3, k4] }"
)]
enum Form {
    List(Vec<f64>),
    Fisheye { fisheye: [f64; 4] },
}

impl Serialize for Distortion {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let form = match (self, self.as_brown()) {
            (_, Some(five)) => Form::List(five.to_vec()),
            (Self::Polynomial(eight), None) => Form::List(eight.to_vec()),
            (Self::Fisheye(fisheye), None) => Form::Fisheye { fisheye: *fisheye },
        };
        form.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Distortion {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let read = match Form::deserialize(deserializer)? {
            Form::Fisheye { fisheye } => coefficients::of_list(Some("fisheye"), &fisheye),
            Form::List(list) => coefficients::of_list(Some("rational_polynomial"), &list),
        };
        read.map_err(de::Error::custom)
    }
}

impl Default for Distortion {
    fn default() -> Self {
        Self::NONE
    }
}

#[cfg(test)]
mod tests;
