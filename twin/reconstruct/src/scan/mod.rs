//! Scans: pictures of something from known places, with masks and, where the camera measures it, depth.
//!
//! | file | owns |
//! |---|---|
//! | `beside` | files that lie beside the pictures: masks, depth |
//! | `camera` | pixels to rays and back |
//! | `colmap` | poses and cameras out of a COLMAP model |
//! | `transforms` | the same out of `transforms.json` and `poses.json` |
//! | `picture` | where the picture of a frame lies |
//! | `held` | poses of a camera that a robot holds, from those of its end effector |
//! | `frame` | the pixels of one view |
//! | `scale` | metres for one unit of the poses |
//! | `table` | the plane on which the object stands |
//! | `error` | why a scan cannot be used |

mod beside;
mod camera;
mod colmap;
mod error;
mod frame;
mod held;
mod picture;
mod scale;
mod table;
mod transforms;

pub use camera::Camera;
pub use error::ScanError;
pub use frame::Frame;
pub use scale::{Scale, ScaleSource};
pub use table::Table;

use crate::remark::Remark;
use beside::Beside;
use nalgebra::{Isometry3, Point3};
use shared_mem::ending;
use std::path::{Path, PathBuf};

/// Fewer pictures make no surface.
pub const FEWEST_VIEWS: usize = 8;

/// Where the mask of a picture is.
#[derive(Debug, Clone, PartialEq)]
enum Mask {
    /// In the picture's own alpha channel.
    Alpha,
    /// In a picture of its own: white is the object.
    File(PathBuf),
}

/// One picture of a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// The picture's path as the scan lists it.
    pub name: String,
    /// The camera that took it.
    pub camera: Camera,
    /// The camera's pose in the scan's frame [m, once the scan is in metres].
    pub scan_from_camera: Isometry3<f64>,
    picture: PathBuf,
    mask: Mask,
    depth: Option<PathBuf>,
}

/// Pictures with poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    pub folder: PathBuf,
    /// Its views, in the order of their names.
    pub views: Vec<View>,
    /// Metres for one count of a depth picture.
    depth_unit: f64,
    /// Places in pictures where the poses' file knows how far a point is: view, pixel, distance along the axis [unit of the poses].
    known_depths: Vec<(usize, [f64; 2], f64)>,
    /// What was not read of the poses' file.
    pub(crate) remarks: Vec<Remark>,
    /// Whether the poses are in metres.
    pub(crate) says_metres: bool,
    of_robot: bool,
    /// On what the object stands, where the scan says it.
    pub(crate) table: Option<Table>,
}

/// Where the poses of a scan stand.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Poses {
    File(PathBuf),
    Colmap(PathBuf),
}

/// The file of the pictures to learn from where a set comes in parts (Blender's, of NeRF), and the other parts.
const PARTS: [&str; 3] = ["transforms_train.json", "transforms_val.json", "transforms_test.json"];

/// A remark on the parts of a set that are not read.
fn other_parts(scan: &Path, file: &Path) -> Option<Remark> {
    let is_part = |name: &&str| scan.is_dir() && file == scan.join(PARTS[0]) && scan.join(name).is_file();
    let names: Vec<&str> = PARTS[1..].iter().copied().filter(is_part).collect();
    (!names.is_empty()).then(|| {
        let names = names.join("` and `");
        Remark(format!("read were the pictures of `{}`; those of `{names}` were left out", PARTS[0]))
    })
}

fn poses_of(scan: &Path) -> Result<Poses, ScanError> {
    if scan.is_file() {
        return Ok(Poses::File(scan.to_owned()));
    }
    let files = ["transforms.json", "poses.json", PARTS[0]].map(|name| scan.join(name));
    if let Some(file) = files.into_iter().find(|file| file.is_file()) {
        return Ok(Poses::File(file));
    }
    if let Some(folder) = colmap::folder_of(scan) {
        return Ok(Poses::Colmap(folder));
    }
    Err(ScanError::Missing(format!(
        "{}: no poses; a scan holds transforms.json (nerfstudio) or transforms_train.json, poses.json (a robot's) or a COLMAP model in sparse/0, as adapters/photographs/poses.py makes it of pictures alone",
        scan.display()
    )))
}

impl Scan {
    /// Reads a scan's poses and finds its pictures; the pictures themselves are read by [`Scan::frame`].
    ///
    /// # Errors
    /// [`ScanError`] in one line: no poses, no masks, files that are missing.
    pub fn open(scan: &Path) -> Result<Self, ScanError> {
        let poses = poses_of(scan)?;
        let folder = if scan.is_file() { scan.parent().unwrap_or(Path::new("")).to_owned() } else { scan.to_owned() };
        let mut known_depths = Vec::new();
        let (mut table, mut remarks) = (None, Vec::new());
        let (listed, depth_unit, says_metres) = match &poses {
            Poses::File(file) => {
                let list = transforms::read(file)?;
                (table, remarks) = (list.table, list.remarks);
                remarks.extend(other_parts(scan, file));
                (list.listed, list.depth_unit, list.of_robot)
            }
            Poses::Colmap(model) => {
                let model = colmap::read(model)?;
                let mut images = model.images;
                images.sort_by(|a, b| a.name.cmp(&b.name));
                for (view, image) in images.iter().enumerate() {
                    let of = |(pixel, number): &([f64; 2], u64)| {
                        let point = image.model_from_camera.inverse_transform_point(model.points.get(number)?);
                        (point.z > 0.0).then_some((view, *pixel, point.z))
                    };
                    known_depths.extend(image.seen.iter().filter_map(of));
                }
                (images.into_iter().map(|image| from_colmap(&folder, image)).collect(), None, false)
            }
        };
        let pictures: Vec<&Path> = listed.iter().map(|listed| listed.picture.as_path()).collect();
        let mut beside = Beside::of(&folder);
        let masks = beside.pairs(&pictures, &["masks", "mask"]);
        let depths = beside.pairs(&pictures, &["depth", "depths"]);
        let views = listed.into_iter().zip(masks.into_iter().zip(depths));
        let mut views = views.map(|(listed, found)| view(&folder, listed, found)).collect::<Result<Vec<_>, _>>()?;
        if views.len() < FEWEST_VIEWS {
            return Err(ScanError::Missing(format!(
                "{}: {} pictures with poses; a scan needs {FEWEST_VIEWS} at least, from all sides",
                folder.display(),
                views.len()
            )));
        }
        if known_depths.is_empty() && matches!(poses, Poses::File(_)) {
            views.sort_by(|a, b| a.name.cmp(&b.name));
        }
        Ok(Self {
            folder,
            views,
            depth_unit: depth_unit.unwrap_or(1e-3),
            known_depths,
            remarks,
            says_metres,
            of_robot: says_metres,
            table,
        })
    }

    /// Whether any view has depth.
    pub fn has_depth(&self) -> bool {
        self.views.iter().any(|view| view.depth.is_some())
    }

    /// Reads the pixels of one view; `by` pixels in each direction become one.
    ///
    /// # Errors
    /// [`ScanError`] when a picture is missing, damaged, or of another size than its camera.
    pub fn frame(&self, view: usize, by: u32) -> Result<Frame, ScanError> {
        Frame::read(&self.views[view], self.depth_unit, by, false)
    }

    /// The same with all of the picture in the mask, for scans of a scene.
    ///
    /// # Errors
    /// As [`Scan::frame`].
    pub fn whole_frame(&self, view: usize, by: u32) -> Result<Frame, ScanError> {
        Frame::read(&self.views[view], self.depth_unit, by, true)
    }

    /// Points of the COLMAP model, once for each view that shows one: the view, and the pixel and the place where it does [m, once the scan
    /// is in metres].
    pub(crate) fn model_points(&self) -> impl Iterator<Item = (&View, [f64; 2], Point3<f64>)> {
        self.known_depths.iter().map(|(view, pixel, z)| {
            let view = &self.views[*view];
            let [x, y] = view.camera.direction(*pixel);
            (view, *pixel, view.scan_from_camera * Point3::new(x * z, y * z, *z))
        })
    }

    /// Whether a robot held the camera: its poses are then metres in its base frame, whose z points up.
    pub fn is_of_robot(&self) -> bool {
        self.of_robot
    }

    /// The same scan with poses in metres.
    pub fn scaled(mut self, metres: f64) -> Self {
        for view in &mut self.views {
            view.scan_from_camera.translation.vector *= metres;
        }
        self.known_depths.iter_mut().for_each(|(_, _, z)| *z *= metres);
        self.table = self.table.map(|table| table.scaled(metres));
        self.says_metres = true;
        self
    }
}

/// COLMAP names pictures relative to a folder that it does not name: `images`, as a rule.
fn from_colmap(folder: &Path, image: colmap::Image) -> transforms::Listed {
    let places = ["images", "", "input"].map(|place| Path::new(place).join(&image.name));
    let [first, ..] = &places;
    let picture = places.iter().find(|place| folder.join(place).is_file()).unwrap_or(first).clone();
    let (camera, scan_from_camera) = (image.camera, image.model_from_camera);
    transforms::Listed { pixels: folder.join(&picture), picture, mask: None, depth: None, camera, scan_from_camera }
}

type Found = Result<Option<PathBuf>, ScanError>;

/// A view with the mask and the depth that the list names, or else those that were found beside the pictures.
fn view(folder: &Path, listed: transforms::Listed, (mask, depth): (Found, Found)) -> Result<View, ScanError> {
    if ending::asked() {
        return Err(ScanError::Interrupted);
    }
    let or = |said: Option<PathBuf>, found: Found| said.map_or(found, |file| Ok(Some(folder.join(file))));
    Ok(View {
        name: listed.picture.display().to_string(),
        camera: listed.camera,
        scan_from_camera: listed.scan_from_camera,
        picture: listed.pixels,
        mask: or(listed.mask, mask)?.map_or(Mask::Alpha, Mask::File),
        depth: or(listed.depth, depth)?,
    })
}
