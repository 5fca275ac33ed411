//! Pictures and joints out of a session's clips: moments when the arm stands still, as different from each other as there
//! are; and the camera that took them, by its cell and by its bags.

use super::picture::Pixels;
use anyhow::{bail, ensure};
use shared_mem::cell::Intrinsics;
use shared_mem::hand_eye::CalibratedCamera;
use shared_mem::lens::Distortion;
use shared_mem::lens::calibration::Calibration;
use shared_mem::progress::Progress;
use shared_mem::recording::{Cameras, PictureKind, Session, for_pictures};

/// A picture of a session.
#[derive(Debug)]
pub struct Shot {
    /// Clip and time in it.
    pub name: String,
    /// The pixels.
    pub pixels: Pixels,
    /// Joint positions [rad].
    pub q: Vec<f64>,
}

/// Joints slower than this stand still [rad/s].
const REST_SPEED: f64 = 0.03;

struct Known {
    clip: usize,
    stamp_ns: u64,
    q: Vec<f64>,
    speed: f64,
}

/// At most `wanted` pictures of a kind in the session; none where no clip holds such pictures with joints at their time.
///
/// # Errors
/// When a clip cannot be read.
pub fn shots(session: &Session, kind: PictureKind, wanted: usize) -> anyhow::Result<Vec<Shot>> {
    let latency_ns = session.cell.camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64);
    // Each clip is read twice.
    let clips = session.clips.len();
    let bar = Progress::new("pictures", 2 * clips as u64);
    let mut known = Vec::new();
    for (number, entry) in session.clips.iter().enumerate() {
        bar.show(number as u64, "");
        let path = session.folder.join(&entry.file);
        let clip = session.read_measured(entry)?;
        for_pictures(&path, kind, |stamp_ns, _| {
            if let Some((q, speed)) = clip.measured.at(stamp_ns.saturating_sub(latency_ns)) {
                known.push(Known { clip: number, stamp_ns, q, speed });
            }
            anyhow::Ok(())
        })?;
    }
    let chosen = choose(known, wanted);
    let mut out = Vec::new();
    for (number, entry) in session.clips.iter().enumerate() {
        bar.show((clips + number) as u64, "");
        if !chosen.iter().any(|known| known.clip == number) {
            continue;
        }
        for_pictures(&session.folder.join(&entry.file), kind, |stamp_ns, picture| {
            if let Some(known) = chosen.iter().find(|known| (known.clip, known.stamp_ns) == (number, stamp_ns)) {
                let name = format!("{} at {:.3} s", entry.file.display(), stamp_ns as f64 * 1e-9);
                out.push(Shot { name, pixels: Pixels::new(picture)?, q: known.q.clone() });
            }
            anyhow::Ok(())
        })?;
    }
    Ok(out)
}

/// The camera of a session's pictures.
#[derive(Debug, Default)]
pub struct OwnCamera {
    /// By its bags, with the cell's parameters where it has some; `None` where no bag says anything.
    pub camera: Option<Calibration>,
    /// What is to be said about it.
    pub remarks: Vec<String>,
}

/// Pixels that two cameras may differ by, as a share of the picture's width: more is another camera or resolution.
const OTHER_CAMERA: f64 = 0.01;
/// And what is said [pixel].
const WORTH_SAYING: f64 = 0.5;

/// What a session's bags say of the camera of its pictures. Where its cell says something else, the two are compared.
///
/// # Errors
/// When a bag cannot be read, or cell and bags, or bags among themselves, are of different cameras.
pub fn camera(session: &Session, kind: PictureKind) -> anyhow::Result<OwnCamera> {
    let mut said: Vec<(String, Result<Calibration, String>)> = Vec::new();
    for entry in &session.clips {
        for (topic, camera) in of_pictures(&Cameras::of(&session.folder.join(&entry.file))?, kind) {
            if said.iter().all(|(_, before)| *before != camera) {
                said.push((topic, camera));
            }
        }
    }
    let of_cell = session.cell.camera.as_ref();
    let intrinsics = of_cell.and_then(|camera| camera.intrinsics);
    let (topic, own) = match &said[..] {
        [] => return Ok(OwnCamera::default()),
        [(topic, Ok(own))] => (topic, own),
        [(topic, Err(what))] => {
            ensure!(intrinsics.is_some(), "`{topic}`: {what}; or give the lens in `[camera]` of cell.toml");
            return Ok(OwnCamera { camera: None, remarks: vec![format!("`{topic}` was not read: {what}")] });
        }
        [(one, _), (other, _), ..] => {
            ensure!(
                intrinsics.is_some(),
                "`{one}` and `{other}` say different cameras: give the one of the pictures in `[camera]` of cell.toml"
            );
            let what = format!("`{one}` and `{other}` say different cameras: `[camera]` of cell.toml was taken");
            return Ok(OwnCamera { camera: None, remarks: vec![what] });
        }
    };
    let Some([fx, fy, cx, cy]) = own.pinhole else { return Ok(OwnCamera::default()) };
    let bag = CalibratedCamera { intrinsics: Intrinsics { fx, fy, cx, cy }, distortion: own.distortion };
    let lens = of_cell.map_or(Distortion::NONE, |camera| camera.distortion);
    let taken = CalibratedCamera {
        intrinsics: intrinsics.unwrap_or(bag.intrinsics),
        distortion: if lens.is_bent() { lens } else { bag.distortion },
    };
    let [width, height] = own.size.map_or([2.0 * cx, 2.0 * cy], |size| size.map(|side| side as f64));
    let apart = apart(&taken, &bag, [width, height]);
    if apart > OTHER_CAMERA * width {
        bail!(
            "`[camera]` of cell.toml and `{topic}` are up to {apart:.0} pixels apart: leave its `intrinsics` and `distortion` out to \
             take the bag's, or leave the topic out of the bag"
        );
    }
    let mut remarks = Vec::new();
    if apart > WORTH_SAYING {
        remarks.push(format!("`[camera]` of cell.toml was taken; `{topic}` is up to {apart:.1} pixels apart from it"));
    } else if taken.distortion.is_bent() && !lens.is_bent() && intrinsics.is_some() {
        remarks.push(format!("`[camera]` of cell.toml has no distortion: that of `{topic}` was taken"));
    }
    let Intrinsics { fx, fy, cx, cy } = taken.intrinsics;
    let camera = Calibration { pinhole: Some([fx, fy, cx, cy]), distortion: taken.distortion, ..*own };
    Ok(OwnCamera { camera: Some(camera), remarks })
}

/// Of a bag's cameras those of a kind of pictures; none where lens and turn were taken out of the pictures already.
fn of_pictures(cameras: &Cameras, kind: PictureKind) -> Vec<(String, Result<Calibration, String>)> {
    let holds = |topic: &str, words: &[&str]| words.iter().any(|word| topic.to_lowercase().contains(word));
    let is_depth = |topic: &str| holds(topic, &["depth", "infra"]) == (kind == PictureKind::Depth);
    let pictures: Vec<&String> = cameras.pictures.iter().filter(|topic| is_depth(topic)).collect();
    if pictures.is_empty() || pictures.iter().all(|topic| holds(topic, &["rect"])) {
        return Vec::new();
    }
    let of_kind = || cameras.said.iter().filter(|(topic, _)| is_depth(topic));
    // A driver publishes both in one place: `/camera/color/image_raw` and `/camera/color/camera_info`.
    let beside = |topic: &str| {
        let place = topic.rsplit_once('/').map_or("", |(place, _)| place);
        pictures.iter().any(|picture| picture.strip_prefix(place).is_some_and(|rest| rest.starts_with('/')))
    };
    let near: Vec<_> = of_kind().filter(|(topic, _)| beside(topic)).cloned().collect();
    if near.is_empty() { of_kind().cloned().collect() } else { near }
}

/// How far apart two cameras show what one of them shows anywhere in its picture, at most [pixel].
fn apart(one: &CalibratedCamera, other: &CalibratedCamera, [width, height]: [f64; 2]) -> f64 {
    /// Steps along a side of the picture.
    const STEPS: usize = 8;
    let at = |step: usize, side: f64| (side - 1.0) * step as f64 / STEPS as f64;
    let places = (0..=STEPS).flat_map(|row| (0..=STEPS).map(move |column| [at(column, width), at(row, height)]));
    let moved = places.filter_map(|[u, v]| {
        let from = &other.intrinsics;
        let [x, y] = other.distortion.straight([(u - from.cx) / from.fx, (v - from.cy) / from.fy])?;
        let (seen, to) = (one.distortion.bend(x, y).0, &one.intrinsics);
        Some((to.fx * seen.x + to.cx - u).hypot(to.fy * seen.y + to.cy - v))
    });
    moved.fold(0.0, f64::max)
}

/// Those at rest, where there are any; of these one after the other the one that differs most from all chosen before.
fn choose(mut known: Vec<Known>, wanted: usize) -> Vec<Known> {
    let slowest = known.iter().map(|known| known.speed).fold(f64::INFINITY, f64::min);
    known.retain(|known| known.speed <= REST_SPEED.max(2.0 * slowest));
    let mut out: Vec<Known> = Vec::new();
    while out.len() < wanted.max(1) && !known.is_empty() {
        let apart = |known: &Known| {
            let to = |other: &Known| known.q.iter().zip(&other.q).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            out.iter().map(to).fold(f64::INFINITY, f64::min)
        };
        let furthest = (0..known.len()).max_by(|a, b| apart(&known[*a]).total_cmp(&apart(&known[*b])));
        let Some(furthest) = furthest else { break };
        // The same pose again adds nothing but its noise.
        if !out.is_empty() && apart(&known[furthest]) < 1e-4 {
            break;
        }
        out.push(known.swap_remove(furthest));
    }
    out.sort_by_key(|known| (known.clip, known.stamp_ns));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bag(pictures: &[&str], cameras: &[&str]) -> Cameras {
        let said = |topic: &&str| (topic.to_string(), Err(topic.to_string()));
        Cameras {
            said: cameras.iter().map(said).collect(),
            pictures: pictures.iter().map(ToString::to_string).collect(),
        }
    }

    #[test]
    fn of_several_cameras_those_beside_the_pictures_are_asked() {
        let topics = |cameras: &Cameras, kind| -> Vec<String> {
            of_pictures(cameras, kind).into_iter().map(|(topic, _)| topic).collect()
        };
        let all = ["/cam/color/camera_info", "/cam/depth/camera_info", "/other/camera_info"];
        let cameras = bag(&["/cam/color/image_raw", "/cam/depth/image_rect_raw"], &all);
        assert_eq!(topics(&cameras, PictureKind::Color), ["/cam/color/camera_info"]);
        assert_eq!(topics(&bag(&["/pictures"], &["/camera/info"]), PictureKind::Color), ["/camera/info"]);
        // Pictures without their lens have none, whatever the driver says.
        assert!(topics(&bag(&["/cam/image_rect_color"], &["/cam/camera_info"]), PictureKind::Color).is_empty());
    }

    #[test]
    fn cameras_are_compared_by_where_they_show_a_point() {
        let camera = |fx: f64, k1: f64| CalibratedCamera {
            intrinsics: Intrinsics { fx, fy: fx, cx: 319.5, cy: 239.5 },
            distortion: Distortion::brown([k1, 0.0, 0.0, 0.0, 0.0]),
        };
        let size = [640.0, 480.0];
        assert!(apart(&camera(600.0, -0.05), &camera(600.0, -0.05), size) < 1e-6);
        assert!((apart(&camera(560.0, 0.0), &camera(600.0, 0.0), size) - 400.0 * 40.0 / 600.0).abs() < 1.0);
        assert!(apart(&camera(600.0, 0.0), &camera(600.0, -0.05), size) > 5.0);
    }

    #[test]
    fn pictures_at_rest_and_of_different_poses_are_chosen() {
        let known = |stamp_ns, q: f64, speed| Known { clip: 0, stamp_ns, q: vec![q], speed };
        let all =
            vec![known(1, 0.0, 0.0), known(2, 0.001, 0.0), known(3, 0.5, 1.0), known(4, 1.0, 0.01), known(5, 0.6, 0.0)];
        let chosen: Vec<u64> = choose(all, 4).iter().map(|known| known.stamp_ns).collect();
        assert_eq!(chosen.len(), 3, "{chosen:?}");
        assert!(chosen.contains(&4) && chosen.contains(&5) && !chosen.contains(&3), "{chosen:?}");
    }
}
