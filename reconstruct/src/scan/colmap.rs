//! A COLMAP model: cameras, images and points, as text or binary files. Models of COLMAP 3.12 and later have rigs and frames in
//! files of their own besides; the images' poses stand in `images` as before, so those files are not needed.
//! The format: <https://colmap.github.io/format.html>.

use super::camera::Camera;
use super::error::ScanError;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use shared_mem::input::{self, Kind};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// One picture of a model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Image {
    pub(crate) name: String,
    pub(crate) camera: Camera,
    pub(crate) model_from_camera: Isometry3<f64>,
    /// Places in the picture [pixel] and the number of the point that is seen there.
    pub(crate) seen: Vec<([f64; 2], u64)>,
}

/// A model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Model {
    pub(crate) images: Vec<Image>,
    pub(crate) points: HashMap<u64, Point3<f64>>,
}

/// Names of the camera models by their numbers in binary files; the count of parameters of each.
const MODELS: [(&str, usize); 11] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
];

/// The folder that holds a model: the scan's own, or `sparse/0` or `sparse` in it.
pub(crate) fn folder_of(scan: &Path) -> Option<PathBuf> {
    let places = ["", "sparse/0", "sparse", "colmap/sparse/0"].map(|place| scan.join(place));
    places.into_iter().find(|place| ["images.bin", "images.txt"].iter().any(|name| place.join(name).is_file()))
}

pub(crate) fn read(folder: &Path) -> Result<Model, ScanError> {
    if folder.join("images.bin").is_file() { read_binary(folder) } else { read_text(folder) }
}

fn pose(path: &Path, q: [f64; 4], t: [f64; 3]) -> Result<Isometry3<f64>, ScanError> {
    let turn = Quaternion::new(q[0], q[1], q[2], q[3]);
    if !(0.5..2.0).contains(&turn.norm()) || t.iter().any(|v| !v.is_finite()) {
        return Err(ScanError::content(path, "an image has no pose; write the model anew with COLMAP"));
    }
    let camera_from_model =
        Isometry3::from_parts(Translation3::from(Vector3::from(t)), UnitQuaternion::from_quaternion(turn));
    Ok(camera_from_model.inverse())
}

fn camera_of(path: &Path, cameras: &HashMap<u32, Camera>, number: u32) -> Result<Camera, ScanError> {
    let found = cameras.get(&number).copied();
    found.ok_or_else(|| ScanError::content(path, format!("names camera {number}, which the model does not have")))
}

/// Lines of a text file that are no comments; empty ones stay, because an image without points has one.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('#'))
}

fn numbers<T: std::str::FromStr>(words: &[&str]) -> Option<Vec<T>> {
    words.iter().map(|word| word.parse().ok()).collect()
}

fn read_text(folder: &Path) -> Result<Model, ScanError> {
    let path = folder.join("cameras.txt");
    let text = input::text(&path, Kind::List)?;
    let mut cameras = HashMap::new();
    for line in lines(&text).filter(|line| !line.trim().is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let bad = || ScanError::content(&path, format!("the line `{}` is no camera", line.trim()));
        let [number, model, width, height, rest @ ..] = &words[..] else { return Err(bad()) };
        let size: Vec<u32> = numbers(&[width, height]).ok_or_else(bad)?;
        let parameters: Vec<f64> = numbers(rest).ok_or_else(bad)?;
        let camera = Camera::from_colmap(model, [size[0], size[1]], &parameters);
        let camera = camera.map_err(|what| ScanError::content(&path, what))?;
        cameras.insert(number.parse::<u32>().map_err(|_| bad())?, camera);
    }
    let path = folder.join("images.txt");
    let text = input::text(&path, Kind::List)?;
    let mut images = Vec::new();
    let mut rest = lines(&text);
    while let Some(line) = rest.next() {
        if line.trim().is_empty() {
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let bad = || ScanError::content(&path, format!("the line `{}` is no image", line.trim()));
        let [_, q0, q1, q2, q3, x, y, z, camera, name @ ..] = &words[..] else { return Err(bad()) };
        let v: Vec<f64> = numbers(&[q0, q1, q2, q3, x, y, z]).ok_or_else(bad)?;
        let seen: Vec<f64> =
            numbers(&rest.next().unwrap_or("").split_whitespace().collect::<Vec<_>>()).ok_or_else(bad)?;
        let seen = seen.chunks_exact(3).filter(|three| three[2] >= 0.0);
        images.push(Image {
            name: name.join(" "),
            camera: camera_of(&path, &cameras, camera.parse().map_err(|_| bad())?)?,
            model_from_camera: pose(&path, [v[0], v[1], v[2], v[3]], [v[4], v[5], v[6]])?,
            seen: seen.map(|three| ([three[0], three[1]], three[2] as u64)).collect(),
        });
    }
    let path = folder.join("points3D.txt");
    let mut points = HashMap::new();
    if path.is_file() {
        for line in lines(&input::text(&path, Kind::List)?).filter(|line| !line.trim().is_empty()) {
            let words: Vec<&str> = line.split_whitespace().take(4).collect();
            let place: Option<Vec<f64>> = numbers(&words);
            let Some([number, x, y, z]) = place.as_deref() else {
                return Err(ScanError::content(&path, format!("the line `{}` is no point", line.trim())));
            };
            points.insert(*number as u64, Point3::new(*x, *y, *z));
        }
    }
    Ok(Model { images, points })
}

/// Bytes from the front on; `None` past the end.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut out = [0.0; N];
        for value in &mut out {
            *value = self.f64()?;
        }
        Some(out)
    }

    /// Up to a zero byte.
    fn name(&mut self) -> Option<String> {
        let end = self.0.iter().position(|byte| *byte == 0)?;
        let name = String::from_utf8_lossy(&self.0[..end]).into_owned();
        self.0 = &self.0[end + 1..];
        Some(name)
    }

    fn skip(&mut self, count: u64) -> Option<()> {
        self.0 = self.0.get(usize::try_from(count).ok()?..)?;
        Some(())
    }
}

fn read_binary(folder: &Path) -> Result<Model, ScanError> {
    let whole = |name: &str| -> Result<(PathBuf, Vec<u8>), ScanError> {
        let path = folder.join(name);
        let bytes = input::bytes(&path, Kind::List)?;
        Ok((path, bytes))
    };
    let cut = |path: &Path| ScanError::content(path, "is cut short; write the model anew with COLMAP");
    let (path, bytes) = whole("cameras.bin")?;
    let cameras = binary_cameras(&mut Bytes(&bytes)).ok_or_else(|| cut(&path))?;
    let cameras = cameras.map_err(|what| ScanError::content(&path, what))?;
    let (path, bytes) = whole("images.bin")?;
    let mut bytes = Bytes(&bytes);
    let count = bytes.u64().ok_or_else(|| cut(&path))?;
    let mut images = Vec::new();
    for _ in 0..count {
        let (q, t, camera, name, seen) = binary_image(&mut bytes).ok_or_else(|| cut(&path))?;
        let camera = camera_of(&path, &cameras, camera)?;
        images.push(Image { name, camera, model_from_camera: pose(&path, q, t)?, seen });
    }
    let mut points = HashMap::new();
    if folder.join("points3D.bin").is_file() {
        let (path, bytes) = whole("points3D.bin")?;
        points = binary_points(&mut Bytes(&bytes)).ok_or_else(|| cut(&path))?;
    }
    Ok(Model { images, points })
}

fn binary_cameras(bytes: &mut Bytes<'_>) -> Option<Result<HashMap<u32, Camera>, String>> {
    let mut cameras = HashMap::new();
    for _ in 0..bytes.u64()? {
        let (number, model, width, height) = (bytes.u32()?, bytes.u32()?, bytes.u64()?, bytes.u64()?);
        let Some((name, count)) = MODELS.get(model as usize) else {
            return Some(Err(format!("a camera of the model number {model}, which is not known here")));
        };
        let parameters: Vec<f64> = (0..*count).map(|_| bytes.f64()).collect::<Option<_>>()?;
        let size = [width, height].map(|side| u32::try_from(side).unwrap_or(0));
        match Camera::from_colmap(name, size, &parameters) {
            Ok(camera) => cameras.insert(number, camera),
            Err(what) => return Some(Err(what)),
        };
    }
    Some(Ok(cameras))
}

type BinaryImage = ([f64; 4], [f64; 3], u32, String, Vec<([f64; 2], u64)>);

fn binary_image(bytes: &mut Bytes<'_>) -> Option<BinaryImage> {
    let _number = bytes.u32()?;
    let (q, t, camera, name) = (bytes.f64s()?, bytes.f64s()?, bytes.u32()?, bytes.name()?);
    let mut seen = Vec::new();
    for _ in 0..bytes.u64()? {
        let (place, point) = (bytes.f64s()?, bytes.u64()?);
        if point != u64::MAX {
            seen.push((place, point));
        }
    }
    Some((q, t, camera, name, seen))
}

fn binary_points(bytes: &mut Bytes<'_>) -> Option<HashMap<u64, Point3<f64>>> {
    let mut points = HashMap::new();
    for _ in 0..bytes.u64()? {
        let (number, place): (u64, [f64; 3]) = (bytes.u64()?, bytes.f64s()?);
        let (_colour, _error) = (bytes.take::<3>()?, bytes.f64()?);
        let track = bytes.u64()?;
        bytes.skip(track.checked_mul(8)?)?;
        points.insert(number, Point3::from(place));
    }
    Some(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> (&'static str, &'static str, &'static str) {
        (
            "# cameras\n1 PINHOLE 640 480 600 600 320 240\n",
            "# images\n1 1 0 0 0 0 0 0.5 1 a b.png\n100 110 7 5 5 -1\n2 0 1 0 0 0.1 0 0.4 1 c.png\n\n",
            "7 0.01 0.02 0.03 255 0 0 0.5 1 0\n",
        )
    }

    #[test]
    fn a_text_model_has_names_with_blanks_images_without_points_and_poses_of_the_camera() {
        let folder = tempfile::tempdir().expect("a folder");
        let (cameras, images, points) = model();
        for (name, text) in [("cameras.txt", cameras), ("images.txt", images), ("points3D.txt", points)] {
            std::fs::write(folder.path().join(name), text).expect("a file");
        }
        let model = read(folder.path()).expect("a model");
        assert_eq!(model.images.len(), 2);
        assert_eq!((model.images[0].name.as_str(), &model.images[0].seen[..]), ("a b.png", &[([100.0, 110.0], 7)][..]));
        // The camera stands half a unit behind the origin that it looks at.
        assert!((model.images[0].model_from_camera.translation.vector - Vector3::new(0.0, 0.0, -0.5)).norm() < 1e-12);
        assert_eq!(model.points[&7], Point3::new(0.01, 0.02, 0.03));
        std::fs::write(folder.path().join("images.txt"), "1 1 0 0 0 0 0 0.5 9 a.png\n\n").expect("a file");
        let line = read(folder.path()).expect_err("no such camera").to_string();
        assert!(line.contains("names camera 9"), "{line}");
    }

    #[test]
    fn a_binary_model_is_the_same_and_one_cut_short_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut cameras = 1u64.to_le_bytes().to_vec();
        cameras.extend([1u32, 1].iter().flat_map(|v| v.to_le_bytes()));
        cameras.extend([640u64, 480].iter().flat_map(|v| v.to_le_bytes()));
        cameras.extend([600.0f64, 600.0, 320.0, 240.0].iter().flat_map(|v| v.to_le_bytes()));
        let mut images = 1u64.to_le_bytes().to_vec();
        images.extend(1u32.to_le_bytes());
        images.extend([1.0f64, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5].iter().flat_map(|v| v.to_le_bytes()));
        images.extend(1u32.to_le_bytes());
        images.extend(b"a b.png\0");
        images.extend(1u64.to_le_bytes());
        images.extend([100.0f64, 110.0].iter().flat_map(|v| v.to_le_bytes()));
        images.extend(7u64.to_le_bytes());
        std::fs::write(folder.path().join("cameras.bin"), &cameras).expect("a file");
        std::fs::write(folder.path().join("images.bin"), &images).expect("a file");
        let model = read(folder.path()).expect("a model");
        assert_eq!((model.images[0].name.as_str(), model.images[0].seen[0].1), ("a b.png", 7));
        for length in [0, 7, 30, images.len() - 1] {
            std::fs::write(folder.path().join("images.bin"), &images[..length]).expect("a file");
            assert!(read(folder.path()).expect_err("cut").to_string().contains("cut short"), "{length}");
        }
    }
}
