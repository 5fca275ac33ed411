//! A COLMAP model: cameras, images and points, as text or binary files. Models of COLMAP 3.12 and later have rigs and frames in
//! files of their own besides; the images' poses stand in `images` as before, so those files are not needed.
//! The format: <https://colmap.github.io/format.html>.

use super::camera::Camera;
use super::error::ScanError;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use shared_mem::budget::{Budget, BudgetError};
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

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Model {
    pub(crate) images: Vec<Image>,
    pub(crate) points: HashMap<u64, Point3<f64>>,
}

/// What a point becomes, with the room that a table keeps free [bytes].
const POINT_BYTES: usize = 2 * size_of::<(u64, Point3<f64>)>();
/// What a place in a picture becomes [bytes].
const SEEN_BYTES: usize = size_of::<([f64; 2], u64)>();
/// Characters of a line that are shown.
const SHOWN: usize = 80;

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

fn pose(q: [f64; 4], t: [f64; 3]) -> Result<Isometry3<f64>, String> {
    let turn = Quaternion::new(q[0], q[1], q[2], q[3]);
    if !(0.5..2.0).contains(&turn.norm()) || t.iter().any(|v| !v.is_finite()) {
        return Err("an image has no pose; write the model anew with COLMAP".into());
    }
    let camera_from_model =
        Isometry3::from_parts(Translation3::from(Vector3::from(t)), UnitQuaternion::from_quaternion(turn));
    Ok(camera_from_model.inverse())
}

fn camera_of(cameras: &HashMap<u32, Camera>, number: u32) -> Result<Camera, String> {
    cameras.get(&number).copied().ok_or_else(|| format!("names camera {number}, which the model does not have"))
}

/// Lines of a text file that are no comments; empty ones stay, because an image without points has one.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('#'))
}

fn numbers<T: std::str::FromStr>(words: &[&str]) -> Option<Vec<T>> {
    words.iter().map(|word| word.parse().ok()).collect()
}

/// A text file of a model, and what reading it may cost.
struct Text {
    path: PathBuf,
    text: String,
    budget: Budget,
}

impl Text {
    fn read(path: PathBuf) -> Result<Self, ScanError> {
        let text = input::text(&path, Kind::List)?;
        let budget = Budget::of(text.len() as u64);
        Ok(Self { path, text, budget })
    }

    /// The words of a line, with what they become drawn from the budget.
    fn words<'a>(&self, line: &'a str) -> Result<Vec<&'a str>, ScanError> {
        let count = line.split_whitespace().count();
        spend(&self.path, self.budget.elements(count, size_of::<&str>() + size_of::<f64>()))?;
        Ok(line.split_whitespace().collect())
    }
}

fn spend(path: &Path, drawn: Result<(), BudgetError>) -> Result<(), ScanError> {
    drawn.map_err(|spent| match spent {
        BudgetError::Ended => ScanError::Interrupted,
        BudgetError::Memory(_) | BudgetError::Steps(_) => ScanError::content(path, spent.to_string()),
    })
}

fn read_text(folder: &Path) -> Result<Model, ScanError> {
    let file = Text::read(folder.join("cameras.txt"))?;
    let path = &file.path;
    let mut cameras = HashMap::new();
    for line in lines(&file.text).filter(|line| !line.trim().is_empty()) {
        let words = file.words(line)?;
        let bad = || ScanError::content(path, format!("the line `{}` is no camera", shown(line)));
        let [number, model, width, height, rest @ ..] = &words[..] else { return Err(bad()) };
        let size: Vec<u32> = numbers(&[width, height]).ok_or_else(bad)?;
        let parameters: Vec<f64> = numbers(rest).ok_or_else(bad)?;
        let camera = Camera::from_colmap(model, [size[0], size[1]], &parameters);
        let camera = camera.map_err(|what| ScanError::content(path, what))?;
        cameras.insert(number.parse::<u32>().map_err(|_| bad())?, camera);
    }
    let images = text_images(&Text::read(folder.join("images.txt"))?, &cameras)?;
    let path = folder.join("points3D.txt");
    let points = if path.is_file() { text_points(&Text::read(path)?)? } else { HashMap::new() };
    Ok(Model { images, points })
}

fn text_images(file: &Text, cameras: &HashMap<u32, Camera>) -> Result<Vec<Image>, ScanError> {
    let content = |what: String| ScanError::content(&file.path, what);
    let mut images = Vec::new();
    let mut rest = lines(&file.text).peekable();
    while let Some(line) = rest.next() {
        if line.trim().is_empty() {
            continue;
        }
        let words = file.words(line)?;
        let bad = || content(format!("the line `{}` is no image", shown(line)));
        let [_, q0, q1, q2, q3, x, y, z, camera, name @ ..] = &words[..] else { return Err(bad()) };
        if name.is_empty() {
            return Err(bad());
        }
        let v: Vec<f64> = numbers(&[q0, q1, q2, q3, x, y, z]).ok_or_else(bad)?;
        // Editors take empty lines away: then the line of the next image follows, whose name is no number.
        let seen = file.words(rest.peek().copied().unwrap_or(""))?;
        let seen: Vec<f64> = numbers(&seen).filter(|seen| seen.len() % 3 == 0).map_or_else(Vec::new, |seen| {
            rest.next();
            seen
        });
        let seen = seen.chunks_exact(3).filter(|three| three[2] >= 0.0);
        images.push(Image {
            name: after(line, words.len() - name.len()).to_owned(),
            camera: camera_of(cameras, camera.parse().map_err(|_| bad())?).map_err(content)?,
            model_from_camera: pose([v[0], v[1], v[2], v[3]], [v[4], v[5], v[6]]).map_err(content)?,
            seen: seen.map(|three| ([three[0], three[1]], three[2] as u64)).collect(),
        });
    }
    Ok(images)
}

/// What stands in a line behind so many words, with all blanks inside of it.
fn after(line: &str, words: usize) -> &str {
    let mut rest = line.trim();
    for _ in 0..words {
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        rest = rest[end..].trim_start();
    }
    rest
}

fn text_points(file: &Text) -> Result<HashMap<u64, Point3<f64>>, ScanError> {
    let mut points = HashMap::new();
    for line in lines(&file.text).filter(|line| !line.trim().is_empty()) {
        spend(&file.path, file.budget.take(POINT_BYTES))?;
        let words: Vec<&str> = line.split_whitespace().take(4).collect();
        let place: Option<Vec<f64>> = numbers(&words);
        let Some([number, x, y, z]) = place.as_deref() else {
            return Err(ScanError::content(&file.path, format!("the line `{}` is no point", shown(line))));
        };
        points.insert(*number as u64, Point3::new(*x, *y, *z));
    }
    Ok(points)
}

/// The beginning of a line, which may be as long as its file.
fn shown(line: &str) -> String {
    let mut characters = line.trim().chars();
    let cut: String = characters.by_ref().take(SHOWN).collect();
    if characters.next().is_some() { cut + "..." } else { cut }
}

/// Bytes of a binary file from the front on, and what reading them may cost.
struct Bytes<'a> {
    left: &'a [u8],
    budget: Budget,
}

/// Why a binary file is not read.
enum Unread {
    /// It ends too early.
    Cut,
    /// What is read of it costs too much.
    Spent(BudgetError),
    /// It says something that cannot be.
    Content(String),
}

type Read<T> = Result<T, Unread>;

impl Unread {
    fn of(self, path: &Path) -> ScanError {
        match self {
            Self::Cut => ScanError::content(path, "is cut short; write the model anew with COLMAP"),
            Self::Spent(BudgetError::Ended) => ScanError::Interrupted,
            Self::Spent(spent) => ScanError::content(path, spent.to_string()),
            Self::Content(what) => ScanError::content(path, what),
        }
    }
}

impl<'a> Bytes<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        Self { left: bytes, budget: Budget::of(bytes.len() as u64) }
    }

    fn take<const N: usize>(&mut self) -> Read<[u8; N]> {
        let (first, rest) = self.left.split_first_chunk::<N>().ok_or(Unread::Cut)?;
        self.left = rest;
        Ok(*first)
    }

    fn u32(&mut self) -> Read<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Read<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64s<const N: usize>(&mut self) -> Read<[f64; N]> {
        let mut out = [0.0; N];
        for value in &mut out {
            *value = f64::from_le_bytes(self.take()?);
        }
        Ok(out)
    }

    /// Up to a zero byte.
    fn name(&mut self) -> Read<String> {
        let end = self.left.iter().position(|byte| *byte == 0).ok_or(Unread::Cut)?;
        self.draw(end)?;
        let name = String::from_utf8_lossy(&self.left[..end]).into_owned();
        self.left = &self.left[end + 1..];
        Ok(name)
    }

    fn skip(&mut self, count: u64) -> Read<()> {
        self.left = usize::try_from(count).ok().and_then(|count| self.left.get(count..)).ok_or(Unread::Cut)?;
        Ok(())
    }

    /// Draws so many bytes before they are set aside.
    fn draw(&self, bytes: usize) -> Read<()> {
        self.budget.take(bytes).map_err(Unread::Spent)
    }
}

fn read_binary(folder: &Path) -> Result<Model, ScanError> {
    let cameras = read_file(folder.join("cameras.bin"), binary_cameras)?;
    let images = read_file(folder.join("images.bin"), |bytes| {
        let count = bytes.u64()?;
        let mut images = Vec::new();
        for _ in 0..count {
            bytes.draw(size_of::<Image>())?;
            images.push(binary_image(bytes, &cameras)?);
        }
        Ok(images)
    })?;
    let path = folder.join("points3D.bin");
    let points = if path.is_file() { read_file(path, binary_points)? } else { HashMap::new() };
    Ok(Model { images, points })
}

fn read_file<T>(path: PathBuf, read: impl FnOnce(&mut Bytes<'_>) -> Read<T>) -> Result<T, ScanError> {
    let bytes = input::bytes(&path, Kind::List)?;
    read(&mut Bytes::of(&bytes)).map_err(|unread| unread.of(&path))
}

fn binary_cameras(bytes: &mut Bytes<'_>) -> Read<HashMap<u32, Camera>> {
    let mut cameras = HashMap::new();
    for _ in 0..bytes.u64()? {
        bytes.draw(2 * size_of::<(u32, Camera)>())?;
        let (number, model, width, height) = (bytes.u32()?, bytes.u32()?, bytes.u64()?, bytes.u64()?);
        let Some((name, count)) = MODELS.get(model as usize) else {
            return Err(Unread::Content(format!("a camera of the model number {model}, which is not known here")));
        };
        let parameters: Vec<f64> = (0..*count).map(|_| Ok(bytes.f64s::<1>()?[0])).collect::<Read<_>>()?;
        let size = [width, height].map(|side| u32::try_from(side).unwrap_or(0));
        cameras.insert(number, Camera::from_colmap(name, size, &parameters).map_err(Unread::Content)?);
    }
    Ok(cameras)
}

fn binary_image(bytes: &mut Bytes<'_>, cameras: &HashMap<u32, Camera>) -> Read<Image> {
    let _number = bytes.u32()?;
    let (q, t, camera, name) = (bytes.f64s()?, bytes.f64s()?, bytes.u32()?, bytes.name()?);
    let mut seen = Vec::new();
    for _ in 0..bytes.u64()? {
        bytes.draw(SEEN_BYTES)?;
        let (place, point) = (bytes.f64s()?, bytes.u64()?);
        if point != u64::MAX {
            seen.push((place, point));
        }
    }
    let camera = camera_of(cameras, camera).map_err(Unread::Content)?;
    Ok(Image { name, camera, model_from_camera: pose(q, t).map_err(Unread::Content)?, seen })
}

fn binary_points(bytes: &mut Bytes<'_>) -> Read<HashMap<u64, Point3<f64>>> {
    let mut points = HashMap::new();
    for _ in 0..bytes.u64()? {
        bytes.draw(POINT_BYTES)?;
        let (number, place): (u64, [f64; 3]) = (bytes.u64()?, bytes.f64s()?);
        let (_colour, _error) = (bytes.take::<3>()?, bytes.f64s::<1>()?);
        let track = bytes.u64()?;
        bytes.skip(track.checked_mul(8).ok_or(Unread::Cut)?)?;
        points.insert(number, Point3::from(place));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> (&'static str, &'static str, &'static str) {
        (
            "# cameras\n1 PINHOLE 640 480 600 600 320 240\n",
            "# images\n1 1 0 0 0 0 0 0.5 1 a  b.png\n100 110 7 5 5 -1\n2 0 1 0 0 0.1 0 0.4 1 c.png\n\n",
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
        assert_eq!(
            (model.images[0].name.as_str(), &model.images[0].seen[..]),
            ("a  b.png", &[([100.0, 110.0], 7)][..])
        );
        // The camera stands half a unit behind the origin that it looks at.
        assert!((model.images[0].model_from_camera.translation.vector - Vector3::new(0.0, 0.0, -0.5)).norm() < 1e-12);
        assert_eq!(model.points[&7], Point3::new(0.01, 0.02, 0.03));
        let images = "1 1 0 0 0 0 0 0.5 1 a.png\n2 1 0 0 0 0 0 0.5 1 b.png\n1 2 -1\n3 1 0 0 0 0 0 0.5 1 c.png\n";
        std::fs::write(folder.path().join("images.txt"), images).expect("a file");
        let without = read(folder.path()).expect("a model without empty lines");
        assert_eq!(
            without.images.iter().map(|image| image.name.as_str()).collect::<Vec<_>>(),
            ["a.png", "b.png", "c.png"]
        );
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

    #[test]
    fn what_a_model_becomes_is_drawn_from_its_budget() {
        let (_, images, points) = model();
        let budget = || Budget::with(64, 1 << 20);
        let text = |text: &str| Text { path: "points3D.txt".into(), text: text.into(), budget: budget() };
        let line = text_points(&text(&points.repeat(2))).expect_err("too many points").to_string();
        assert!(line.starts_with("points3D.txt: becomes more than"), "{line}");
        let line = text_images(&text(images), &HashMap::new()).expect_err("too many words").to_string();
        assert!(line.contains("becomes more than"), "{line}");
        let bytes = [&2u64.to_le_bytes()[..], &[0; 200]].concat();
        let mut bytes = Bytes { left: &bytes, budget: budget() };
        assert!(matches!(binary_points(&mut bytes), Err(Unread::Spent(BudgetError::Memory(64)))));
    }
}
