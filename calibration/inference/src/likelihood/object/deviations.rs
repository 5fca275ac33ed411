//! How the object of a clip deviates from any simulated path, as nuisance parameters that are added to the simulated
//! poses, so that they cost no simulation.
//!
//! While the tool has hold of the object the error grows along the path: nobody simulates an impact or a push exactly. What
//! the object takes from there into its free slide is a velocity and a spin that are off by a little, and what these do to
//! the slide is its physics: under Coulomb friction an object that is faster by `dv` is ahead by `dv t` until it stops, and
//! one that leaves in another direction is beside its path in proportion to the way it has come. So a slide that bends or
//! slows down otherwise than simulated is not taken for a hit that was off: each stage starts, in effect, from its measured
//! state.
//!
//! An object alone begins from its measured motion. Where it tumbles, each impact of a corner multiplies what that start and the
//! simulated impact are off by, so that it may come to rest elsewhere and turned otherwise by a lot.

use super::{Channel, ObjectClips, Part, Row};
use nalgebra::Vector3;
use shared_mem::recording::ObjectSeries;

/// A path shorter than this says nothing about how far along it the object is [m]: ten times a tracker's noise.
const MIN_WAY: f64 = 0.01;

/// One way in which a path deviates.
#[derive(Debug, PartialEq)]
pub struct Deviation {
    pub(super) name: &'static str,
    coordinate: Coordinate,
    shape: Shape,
    /// One sigma from clip to clip [m, rad].
    pub(super) sigma: f64,
}

const fn deviation(name: &'static str, coordinate: Coordinate, shape: Shape, sigma: f64) -> Deviation {
    Deviation { name, coordinate, shape, sigma }
}

/// Deviation of a clip's end, one sigma [m, rad]: strokes of another engine deviate from the twin that is given their true parameters by
/// this at the end of the path in a clip like most. Each stage of a clip is allowed as much; how widely a session's clips scatter is
/// estimated anyway ([`crate::likelihood::random_effects_scale`]).
const PLACE_SIGMA: f64 = 1e-3;
const TURN_SIGMA: f64 = 0.012;

/// After a hit: the deviation when the tool has let go, on the way there more than in proportion, and what the free slide makes of it by
/// its end.
pub(super) const AFTER_HITS: [Deviation; 9] = [
    deviation("x when let go", Coordinate::X, Shape::Held, PLACE_SIGMA),
    deviation("y when let go", Coordinate::Y, Shape::Held, PLACE_SIGMA),
    deviation("yaw when let go", Coordinate::Yaw, Shape::Held, TURN_SIGMA),
    deviation("x on the way", Coordinate::X, Shape::Way, 0.5 * PLACE_SIGMA),
    deviation("y on the way", Coordinate::Y, Shape::Way, 0.5 * PLACE_SIGMA),
    deviation("yaw on the way", Coordinate::Yaw, Shape::Way, 0.5 * TURN_SIGMA),
    deviation("along the slide", Coordinate::Along, Shape::InTime, PLACE_SIGMA),
    deviation("across the slide", Coordinate::Across, Shape::InWay, PLACE_SIGMA),
    deviation("yaw of the slide", Coordinate::Yaw, Shape::InWay, TURN_SIGMA),
];

/// Of an object alone, by the end of its motion: as wide as those of a free slide after a hit, so that a slide still shows
/// what bends it. One that tumbles is beyond that by many times, which the heavy tails bear.
pub(super) const OF_AN_OBJECT_ALONE: [Deviation; 5] = [
    deviation("along the motion", Coordinate::Along, Shape::InTime, PLACE_SIGMA),
    deviation("across the motion", Coordinate::Across, Shape::InTime, PLACE_SIGMA),
    deviation("yaw of the motion", Coordinate::Yaw, Shape::InTime, TURN_SIGMA),
    deviation("roll of the motion", Coordinate::Roll, Shape::InTime, TURN_SIGMA),
    deviation("pitch of the motion", Coordinate::Pitch, Shape::InTime, TURN_SIGMA),
];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Coordinate {
    X,
    Y,
    Yaw,
    /// About the base's x axis.
    Roll,
    /// About its y axis.
    Pitch,
    /// The direction in which the object slid freely.
    Along,
    /// A quarter turn to the left of it.
    Across,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// Zero at the start, one from when the tool has let go.
    Held,
    /// Zero at the start and from when the tool has let go, one half way.
    Way,
    /// Zero until the tool has let go, then in proportion to time, one at rest.
    InTime,
    /// ... in proportion to the way.
    InWay,
}

/// What part of a clip lies behind at a row, each 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fractions {
    /// Of the path on which the tool has hold of the object.
    held: f64,
    /// Of the time of the free slide.
    time: f64,
    /// Of its way.
    way: f64,
}

impl Shape {
    fn at(self, fractions: &Fractions) -> f64 {
        match self {
            Self::Held => fractions.held,
            Self::Way => 4.0 * fractions.held * (1.0 - fractions.held),
            Self::InTime => fractions.time,
            Self::InWay => fractions.way,
        }
    }
}

/// What one unit of every deviation takes off the residuals of a clip's poses [1/m, 1/rad].
pub(super) fn slopes(
    object: &ObjectClips,
    clip: usize,
    deviations: impl Iterator<Item = &'static Deviation>,
) -> Vec<Vec<f64>> {
    let (mut rows, noise) = (object.rows(clip), object.noise());
    rows.retain(|row| !matches!(row.channel, Channel::Joint(_)));
    let series = &object.clip(clip).object;
    let along = direction(series, &rows);
    let fractions = fractions(series, &rows);
    let one = |Deviation { coordinate, shape, .. }: &'static Deviation| {
        let share = |channel: Channel| match (channel, coordinate) {
            (Channel::Position(0), Coordinate::X) | (Channel::Position(1), Coordinate::Y) => 1.0 / noise.position,
            (Channel::Position(axis @ (0 | 1)), Coordinate::Along) => along[axis] / noise.position,
            (Channel::Position(0), Coordinate::Across) => -along[1] / noise.position,
            (Channel::Position(1), Coordinate::Across) => along[0] / noise.position,
            (Channel::Rotation(0), Coordinate::Roll)
            | (Channel::Rotation(1), Coordinate::Pitch)
            | (Channel::Rotation(2), Coordinate::Yaw) => 1.0 / noise.rotation,
            _ => 0.0,
        };
        rows.iter().zip(&fractions).map(|(row, fractions)| -shape.at(fractions) * share(row.channel)).collect()
    };
    deviations.map(one).collect()
}

/// Place of the object at a stamp, or of its last pose.
fn place(series: &ObjectSeries, stamp_ns: u64) -> Vector3<f64> {
    let row = series.stamps_ns.partition_point(|stamp| *stamp < stamp_ns).min(series.len().saturating_sub(1));
    Vector3::from(series.poses[row].position())
}

/// First and last stamp of the rows in a part of the clip.
fn span(rows: &[Row], part: Part) -> Option<[u64; 2]> {
    let stamps = || rows.iter().filter(|row| row.part == part).map(|row| row.stamp_ns);
    Some([stamps().min()?, stamps().max()?])
}

/// Unit vector in the plane along which the object slid freely; zero where it hardly did.
fn direction(series: &ObjectSeries, rows: &[Row]) -> [f64; 2] {
    let Some([first, last]) = span(rows, Part::Slide) else { return [0.0; 2] };
    let way = place(series, last) - place(series, first);
    let length = way.x.hypot(way.y);
    if length > MIN_WAY { [way.x / length, way.y / length] } else { [0.0; 2] }
}

/// How far the object is along the straight way between two stamps at a third, or in time where the way is too short.
fn of_way(series: &ObjectSeries, [first, last]: [u64; 2], stamp_ns: u64) -> f64 {
    let (from, way) = (place(series, first), place(series, last) - place(series, first));
    if way.norm() > MIN_WAY {
        ((place(series, stamp_ns) - from).dot(&way) / way.norm_squared()).clamp(0.0, 1.0)
    } else {
        of_time([first, last], stamp_ns)
    }
}

fn of_time([first, last]: [u64; 2], stamp_ns: u64) -> f64 {
    stamp_ns.saturating_sub(first) as f64 / last.saturating_sub(first).max(1) as f64
}

fn fractions(series: &ObjectSeries, rows: &[Row]) -> Vec<Fractions> {
    let (held, slide) = (span(rows, Part::Hit), span(rows, Part::Slide));
    // The hand-over: the first pose of the free slide, or the last that the tool moves.
    let held = held.map(|[first, last]| [first, slide.map_or(last, |[begins, _]| begins)]);
    let mut furthest = Fractions { held: 0.0, time: 0.0, way: 0.0 };
    let at = |row: &Row| {
        let stamp_ns = row.stamp_ns;
        let now = match row.part {
            Part::Before => furthest,
            Part::Hit => Fractions { held: held.map_or(0.0, |held| of_way(series, held, stamp_ns)), ..furthest },
            Part::Slide => Fractions {
                held: 1.0,
                time: slide.map_or(0.0, |slide| of_time(slide, stamp_ns)),
                way: slide.map_or(0.0, |slide| of_way(series, slide, stamp_ns)),
            },
            Part::After => Fractions { held: 1.0, time: 1.0, way: 1.0 },
        };
        // A tracker's noise moves nothing back.
        furthest = Fractions { held: furthest.held.max(now.held), time: now.time, way: furthest.way.max(now.way) };
        furthest
    };
    rows.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;
    use shared_mem::frames::Pose;

    /// Pushed 20 mm along x in 50 ms, then free along y for 0.2 s under Coulomb friction, 40 mm, a pose every 10 ms.
    fn stroke() -> (ObjectSeries, Vec<Row>) {
        let (mut series, mut rows) = (ObjectSeries::default(), Vec::new());
        for k in 0..40_u32 {
            let t = 0.01 * f64::from(k) - 0.1;
            let (pushed, free) = ((t / 0.05).clamp(0.0, 1.0), ((t - 0.05) / 0.2).clamp(0.0, 1.0));
            let place = [0.02 * pushed, 0.04 * (2.0 * free - free * free)];
            series.stamps_ns.push(u64::from(k) * 10_000_000);
            series.poses.push(Pose::from_isometry(Isometry3::translation(place[0], place[1], 0.05)));
            let part = match t {
                t if t < 0.005 => Part::Before,
                t if t < 0.045 => Part::Hit,
                t if t < 0.255 => Part::Slide,
                _ => Part::After,
            };
            rows.push(Row { stamp_ns: u64::from(k) * 10_000_000, part, channel: Channel::Position(0) });
        }
        (series, rows)
    }

    #[test]
    fn a_faster_object_is_ahead_in_proportion_to_time_and_one_that_left_aside_is_beside_in_proportion_to_its_way() {
        let (series, rows) = stroke();
        let along = direction(&series, &rows);
        assert!(along[0].abs() < 1e-9 && (along[1] - 1.0).abs() < 1e-9, "{along:?}");
        let fractions = fractions(&series, &rows);
        let nothing = Fractions { held: 0.0, time: 0.0, way: 0.0 };
        assert_eq!(fractions[10], nothing, "the touch");
        assert_eq!(fractions[39], Fractions { held: 1.0, time: 1.0, way: 1.0 });
        // Half of the time of the slide: three quarters of its way.
        let half = fractions[25];
        assert!((half.time - 0.5).abs() < 1e-9 && (half.way - 0.75).abs() < 1e-9 && half.held == 1.0, "{half:?}");
        assert!((0.4..0.8).contains(&fractions[13].held) && fractions[13].time == 0.0, "{:?}", fractions[13]);
    }
}
