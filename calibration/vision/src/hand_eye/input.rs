//! Pictures of the board with the arm's pose in each: a folder with `poses.json`, a folder of pictures with a JSON file beside each,
//! or a session whose clips hold pictures and joints.

use super::view::View;
use crate::viewpoint::board::Board;
use crate::viewpoint::lens::Lens;
use crate::viewpoint::picture::Pixels;
use crate::viewpoint::planar::Seen;
use crate::viewpoint::session;
use anyhow::{Context as _, anyhow, bail, ensure};
use nalgebra::Isometry3;
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::{Map, Value};
use shared_mem::budget::Budget;
use shared_mem::cell::{Cell, Intrinsics};
use shared_mem::ending;
use shared_mem::hand_eye::{CalibratedCamera, Matrix};
use shared_mem::input::{self, Kind};
use shared_mem::json;
use shared_mem::lens::Distortion;
use shared_mem::lens::calibration::Calibration;
use shared_mem::lens::listed::{ListedCamera, Numbers};
use shared_mem::lens::spelling::Other;
use shared_mem::recording::{PictureKind, Session, picture_size};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use twin::arm::{ArmModel, Joints, MAX_JOINTS};

/// Where pictures and poses come from.
#[derive(Debug, Clone)]
pub struct Source {
    /// A folder of pictures, a session, or a clip.
    pub target: PathBuf,
    /// The cell: intrinsics, arm; a session brings its own.
    pub cell: Option<PathBuf>,
    /// The board in the pictures; lists that hold its corners need none.
    pub board: Option<Board>,
    /// fx, fy, cx, cy [pixel].
    pub intrinsics: Option<[f64; 4]>,
    /// At most so many pictures of a session.
    pub frames: usize,
}

/// Pictures that show the board, those that do not, and the camera.
#[derive(Debug, Clone)]
pub struct Taken {
    pub views: Vec<View>,
    /// Names of pictures that do not show it.
    pub without_board: Vec<String>,
    pub camera: CalibratedCamera,
    /// What was chosen where the files leave it open.
    pub remarks: Vec<String>,
}

/// A list of pictures, as a scan of a robot has it (docs/reconstruct.md). Pixels count from the picture's upper left corner.
#[derive(Debug, Deserialize)]
struct List {
    #[serde(flatten)]
    camera: Numbers,
    frames: Vec<Listed>,
    #[serde(flatten)]
    others: BTreeMap<String, Other>,
}

#[derive(Debug, Deserialize)]
#[allow(non_snake_case, reason = "O_T_EE is the Franka Control Interface's own symbol")]
struct Listed {
    file_path: PathBuf,
    O_T_EE: Option<Matrix>,
    /// Corners that another detector has found: x, y on the board [m], column, row [pixel].
    points: Option<Vec<[f64; 4]>>,
    #[serde(flatten)]
    camera: Numbers,
    #[serde(flatten)]
    others: BTreeMap<String, Other>,
}

/// The pixels of a picture, or what another detector has found in it.
enum Content {
    Picture(PathBuf),
    Pixels(Pixels),
    Points(Vec<[f64; 4]>),
}

struct Shot {
    name: String,
    base_from_end_effector: Isometry3<f64>,
    content: Content,
    /// Columns and rows that the intrinsics beside it are for.
    size: Option<[usize; 2]>,
}

/// Pictures with what the files beside them say of their camera.
struct Shots {
    camera: Option<CalibratedCamera>,
    shots: Vec<Shot>,
    remarks: Vec<String>,
}

/// From the middle of a pixel to the corner that lists count from.
const HALF: f64 = 0.5;
/// Reads the pictures and finds the board in them.
///
/// # Errors
/// One line: what is missing or does not fit together, and what to do.
pub fn taken(source: &Source) -> anyhow::Result<Taken> {
    let list = source.target.join("poses.json");
    let Shots { camera: own, shots, mut remarks } = if list.is_file() {
        listed(source, &list)?
    } else if source.target.is_dir() && source.cell.is_none() && !source.target.join("cell.toml").is_file()
        || has_pictures(&source.target)
    {
        beside(source)?
    } else {
        recorded(source)?
    };
    let camera = camera(source, own, &mut remarks)?;
    let lens = Lens::new(&camera.intrinsics);
    let found: Vec<Result<View, String>> =
        shots.into_par_iter().map(|shot| view(source, &camera, lens, shot)).collect::<anyhow::Result<_>>()?;
    let (mut views, mut without_board) = (Vec::new(), Vec::new());
    for found in found {
        match found {
            Ok(view) => views.push(view),
            Err(name) => without_board.push(name),
        }
    }
    Ok(Taken { views, without_board, camera, remarks })
}

fn is_picture(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    ["png", "jpg", "jpeg"].contains(&ending.as_str())
}

fn pictures(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<PathBuf> = entries.filter(|path| is_picture(path)).collect();
    found.sort();
    found
}

fn has_pictures(folder: &Path) -> bool {
    !pictures(folder).is_empty()
}

fn listed(source: &Source, path: &Path) -> anyhow::Result<Shots> {
    let folder = &source.target;
    let bytes = input::bytes(path, Kind::List)?;
    let list = parsed(path, &bytes, &Budget::of(bytes.len() as u64))?;
    let in_list = |what: String| anyhow!("{}: {what}", path.display());
    Numbers::none_unread(&list.others).map_err(in_list)?;
    let (mut camera, mut shots) = (None, Vec::new());
    for frame in list.frames {
        let name = frame.file_path.display().to_string();
        let in_frame = |what: String| in_list(format!("{name}: {what}"));
        Numbers::none_unread(&frame.others).map_err(in_frame)?;
        let picture = folder.join(&frame.file_path);
        let here = listed_camera(&frame.camera, &list.camera, &picture, source.intrinsics).map_err(in_frame)?;
        let camera_of_all = *camera.get_or_insert(here);
        ensure!(
            camera_of_all == here,
            "{}: the camera of {name} differs from that of the pictures before; give pictures of one camera",
            path.display()
        );
        let matrix = frame.O_T_EE.with_context(|| format!("{}: {name} has no `O_T_EE`", path.display()))?;
        let base_from_end_effector = matrix.isometry().map_err(in_frame)?;
        let content = frame.points.map_or(Content::Picture(picture), Content::Points);
        shots.push(Shot { name, base_from_end_effector, content, size: None });
    }
    Ok(Shots { camera: camera.flatten(), shots, remarks: Vec::new() })
}

fn parsed(path: &Path, bytes: &[u8], budget: &Budget) -> anyhow::Result<List> {
    json::read(bytes, budget).map_err(|what| anyhow!("{} {what}; docs/hand_eye.md has its keys", path.display()))
}

/// The camera of a frame; `None` where the list says nothing about it. A lens may stand there without its pinhole, which is `given`.
fn listed_camera(
    own: &Numbers,
    all: &Numbers,
    picture: &Path,
    given: Option<[f64; 4]>,
) -> Result<Option<CalibratedCamera>, String> {
    if !own.has_focal() && !all.has_focal() {
        if !own.has_lens() && !all.has_lens() {
            return Ok(None);
        }
        if let Some([fx, fy, cx, cy]) = given {
            let distortion = own.distortion(all)?;
            return Ok(Some(CalibratedCamera { intrinsics: Intrinsics { fx, fy, cx, cy }, distortion }));
        }
    }
    let size = || picture_size(picture).map_err(|error| format!("`w` and `h` are missing, and {error}"));
    let ListedCamera { focal: [fx, fy], centre: [cx, cy], lens } = own.camera(all, || own.size(all, size))?;
    let intrinsics = Intrinsics { fx, fy, cx: cx - HALF, cy: cy - HALF };
    Ok(Some(CalibratedCamera { intrinsics, distortion: lens }))
}

fn beside(source: &Source) -> anyhow::Result<Shots> {
    let folder = &source.target;
    let found = pictures(folder);
    ensure!(
        !found.is_empty(),
        "{}: neither poses.json nor pictures (png, jpg) with a JSON file beside each; docs/hand_eye.md has both forms",
        folder.display()
    );
    let mut out = Shots { camera: None, shots: Vec::new(), remarks: Vec::new() };
    for picture in &found {
        let path = json_of(picture, &found)?;
        let text = input::bytes(&path, Kind::List)
            .with_context(|| format!("{} needs `O_T_EE` in a JSON file of its name beside it", picture.display()))?;
        let in_file = |what: String| anyhow!("{}: {what}", path.display());
        let mut file: Map<String, Value> = json::read(&text, &Budget::of(text.len() as u64))
            .map_err(|what| anyhow!("{} {what}; docs/hand_eye.md has what stands beside a picture", path.display()))?;
        let matrix = file.remove("O_T_EE").with_context(|| format!("{} has no `O_T_EE`", path.display()))?;
        let matrix: Matrix = serde_json::from_value(matrix)
            .map_err(|_| in_file("`O_T_EE` is no matrix: 16 numbers, or four rows of four".into()))?;
        let pose = matrix.isometry().map_err(in_file)?;
        let here = Calibration::of(&file).map_err(in_file)?;
        if let Some(here) = &here {
            let [fx, fy, cx, cy] = here.pinhole.or(source.intrinsics).with_context(|| {
                format!("{} holds a lens and no `K`: add it, nine numbers, or give --intrinsics", path.display())
            })?;
            let camera = CalibratedCamera { intrinsics: Intrinsics { fx, fy, cx, cy }, distortion: here.distortion };
            ensure!(
                out.camera.is_none_or(|before| before == camera),
                "{}: intrinsics differ from those of the pictures before; give pictures of one camera",
                path.display()
            );
            if out.camera.is_none() {
                out.remarks.extend(here.remark());
            }
            out.camera = Some(camera);
        }
        out.shots.push(Shot {
            name: picture.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned()),
            base_from_end_effector: pose,
            content: Content::Picture(picture.clone()),
            size: here.and_then(|here| here.size),
        });
    }
    Ok(out)
}

/// The JSON file beside a picture: `a.jpg.json`, or `a.json` where no other picture is an `a`.
fn json_of(picture: &Path, all: &[PathBuf]) -> anyhow::Result<PathBuf> {
    let whole = PathBuf::from(format!("{}.json", picture.display()));
    if whole.is_file() {
        return Ok(whole);
    }
    let other = all.iter().find(|other| *other != picture && other.file_stem() == picture.file_stem());
    let short = picture.with_extension("json");
    ensure!(
        other.is_none(),
        "{} could be of {} or of {}: give each its own, {}",
        short.display(),
        picture.display(),
        other.map_or(picture, PathBuf::as_path).display(),
        whole.display()
    );
    Ok(short)
}

fn recorded(source: &Source) -> anyhow::Result<Shots> {
    let session = Session::open_with(&source.target, source.cell.as_deref())?;
    let arm = ArmModel::from_cell(&session.cell)?;
    let shots = session::shots(&session, PictureKind::Color, source.frames)?;
    ensure!(
        !shots.is_empty(),
        "{}: no clip holds colour pictures with joints at their time; record with `rt_bridge run --camera`",
        session.folder.display()
    );
    let shots = shots.into_iter().map(|shot| {
        let mut q: Joints = [0.0; MAX_JOINTS];
        ensure!(shot.q.len() == arm.dof(), "{}: {} joints, the arm has {}", shot.name, shot.q.len(), arm.dof());
        q[..shot.q.len()].copy_from_slice(&shot.q);
        let pose = arm.flange(&q).isometry();
        Ok(Shot { name: shot.name, base_from_end_effector: pose, content: Content::Pixels(shot.pixels), size: None })
    });
    let session::OwnCamera { camera: of_bag, remarks } = session::camera(&session, PictureKind::Color)?;
    let of_bag = of_bag.and_then(|camera| Some((camera.pinhole?, camera.distortion)));
    let camera = match of_bag {
        Some(([fx, fy, cx, cy], distortion)) => {
            Some(CalibratedCamera { intrinsics: Intrinsics { fx, fy, cx, cy }, distortion })
        }
        None => session
            .cell
            .camera
            .as_ref()
            .map(|camera| CalibratedCamera { intrinsics: camera.pinhole(), distortion: camera.distortion }),
    };
    Ok(Shots { camera, shots: shots.collect::<anyhow::Result<_>>()?, remarks })
}

/// The camera's numbers: those given, else those beside the pictures, else the cell's. Intrinsics that are given leave the lens as it is.
fn camera(
    source: &Source,
    own: Option<CalibratedCamera>,
    remarks: &mut Vec<String>,
) -> anyhow::Result<CalibratedCamera> {
    let of_cell = || -> anyhow::Result<Option<CalibratedCamera>> {
        let Some(path) = &source.cell else { return Ok(None) };
        let camera = Cell::read(path)?.camera;
        Ok(camera.map(|camera| CalibratedCamera { intrinsics: camera.pinhole(), distortion: camera.distortion }))
    };
    let known = own.map_or_else(of_cell, |own| Ok(Some(own)))?;
    let found = match source.intrinsics {
        Some([fx, fy, cx, cy]) => {
            if known.is_none() {
                remarks.push("no file says the lens: --intrinsics alone is a pinhole without distortion".into());
            }
            let distortion = known.map_or(Distortion::NONE, |known| known.distortion);
            Some(CalibratedCamera { intrinsics: Intrinsics { fx, fy, cx, cy }, distortion })
        }
        None => known,
    };
    let Some(camera) = found else {
        bail!(
            "no intrinsics: add `K` and `D` to the files beside the pictures, `fl_x` and `k1` to poses.json, or give --cell with a \
             `[camera]`; --intrinsics fx,fy,cx,cy is a pinhole without distortion where no file says the lens"
        )
    };
    let Intrinsics { fx, fy, cx, cy } = camera.intrinsics;
    ensure!(
        [fx, fy, cx, cy].iter().all(|v| v.is_finite()) && fx > 0.0 && fy > 0.0,
        "intrinsics {fx}, {fy}, {cx}, {cy} are none: focal lengths are above 0 [pixel]"
    );
    Ok(camera)
}

/// The board in a picture; the picture's name where it is not seen.
fn view(source: &Source, camera: &CalibratedCamera, lens: Lens, shot: Shot) -> anyhow::Result<Result<View, String>> {
    ensure!(!ending::asked(), "interrupted; nothing was written, start again");
    let Shot { name, base_from_end_effector, content, size } = shot;
    let pixels = match content {
        Content::Points(points) => {
            let seen = points.iter().map(|[x, y, u, v]| {
                let pixel = lens.straight(&camera.distortion, [u - HALF, v - HALF]);
                let pixel = pixel.with_context(|| format!("{name}: the lens shows nothing at the corner {u}, {v}"))?;
                Ok(Seen { place: [*x, *y], pixel })
            });
            let seen = seen.collect::<anyhow::Result<_>>()?;
            return Ok(Ok(View { name, base_from_end_effector, seen, lens }));
        }
        Content::Picture(path) => Pixels::read(&path)?,
        Content::Pixels(pixels) => pixels,
    };
    let Some(board) = &source.board else {
        bail!(
            "which board is it? give --board COLUMNSxROWS,SQUARE,MARKER,DICTIONARY, or corners as `points` in poses.json"
        )
    };
    ensure!(!pixels.is_depth(), "{name} holds depth; give colour pictures");
    if let Some([width, height]) = size.filter(|size| *size != pixels.size) {
        bail!(
            "{name} has {} x {} pixels, and its `K` is for {width} x {height}: give intrinsics of this resolution",
            pixels.size[0],
            pixels.size[1]
        );
    }
    let off = [(lens.centre[0], pixels.size[0]), (lens.centre[1], pixels.size[1])];
    ensure!(
        off.iter().all(|(at, size)| (0.2..0.8).contains(&(at / *size as f64))),
        "{name} has {} x {} pixels, and the principal point {:.0}, {:.0} is of another size: give intrinsics of this resolution",
        pixels.size[0],
        pixels.size[1],
        lens.centre[0],
        lens.centre[1]
    );
    let pixels = pixels.undistorted(&lens, &camera.distortion);
    Ok(match board.seen(&pixels, &lens)? {
        Some(reading) => Ok(View { name, base_from_end_effector, seen: reading.seen, lens }),
        None => Err(name),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_read_within_its_budget() {
        let frame = r#"{"file_path": "a.png", "points": [[0, 0, 1, 1], [1, 0, 2, 1]]}"#;
        let list = format!(r#"{{"fl_x": 600, "frames": [{}]}}"#, vec![frame; 50].join(","));
        let read = |room: u64| parsed(Path::new("poses.json"), list.as_bytes(), &Budget::with(room, 1 << 20));
        assert_eq!(read(1 << 20).expect("room enough").frames.len(), 50);
        let line = read(1 << 10).expect_err("too little room").to_string();
        assert!(line.contains("poses.json becomes more than"), "{line}");
    }
}
