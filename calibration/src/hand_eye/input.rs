//! Pictures of the board with the arm's pose in each: a folder with `poses.json`, a folder of pictures with a JSON file beside each,
//! or a session whose clips hold pictures and joints.

use super::view::View;
use crate::viewpoint::board::Board;
use crate::viewpoint::lens::{Lens, distorted};
use crate::viewpoint::picture::Pixels;
use crate::viewpoint::planar::Seen;
use crate::viewpoint::session;
use anyhow::{Context as _, bail, ensure};
use nalgebra::Isometry3;
use rayon::prelude::*;
use serde::Deserialize;
use shared_mem::cell::{Cell, Intrinsics};
use shared_mem::ending;
use shared_mem::hand_eye::{CalibratedCamera, Matrix};
use shared_mem::input::{self, Kind};
use shared_mem::recording::{PictureKind, Session};
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
    /// The pictures.
    pub views: Vec<View>,
    /// Names of pictures that do not show it.
    pub without_board: Vec<String>,
    /// The camera.
    pub camera: CalibratedCamera,
}

/// A list of pictures, as a scan of a robot has it (docs/reconstruct.md). Pixels count from the picture's upper left corner.
#[derive(Debug, Deserialize)]
struct List {
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    #[serde(default)]
    k1: f64,
    #[serde(default)]
    k2: f64,
    #[serde(default)]
    p1: f64,
    #[serde(default)]
    p2: f64,
    #[serde(default)]
    k3: f64,
    frames: Vec<Listed>,
}

#[derive(Debug, Deserialize)]
#[allow(non_snake_case, reason = "O_T_EE is the Franka Control Interface's own symbol")]
struct Listed {
    file_path: PathBuf,
    O_T_EE: Option<Matrix>,
    /// Corners that another detector has found: x, y on the board [m], column, row [pixel].
    points: Option<Vec<[f64; 4]>>,
}

/// A file beside a picture; intrinsics as ROS and OpenCV name them, the first pixel's middle at 0, 0.
#[derive(Debug, Deserialize)]
#[allow(non_snake_case, reason = "names of ROS and of the Franka Control Interface")]
struct Beside {
    O_T_EE: Option<Matrix>,
    K: Option<[f64; 9]>,
    D: Option<Vec<f64>>,
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
}

/// From the middle of a pixel to the corner that lists count from.
const HALF: f64 = 0.5;
/// Rounds that take the lens's distortion back; each gains more than a digit within the picture.
const ROUNDS: usize = 20;

/// Reads the pictures and finds the board in them.
///
/// # Errors
/// One line: what is missing or does not fit together, and what to do.
pub fn taken(source: &Source) -> anyhow::Result<Taken> {
    let list = source.target.join("poses.json");
    let (own, shots) = if list.is_file() {
        listed(&source.target, &list)?
    } else if source.target.is_dir() && source.cell.is_none() && !source.target.join("cell.toml").is_file()
        || has_pictures(&source.target)
    {
        beside(&source.target)?
    } else {
        recorded(source)?
    };
    let camera = camera(source, own)?;
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
    Ok(Taken { views, without_board, camera })
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

fn listed(folder: &Path, path: &Path) -> anyhow::Result<(Option<CalibratedCamera>, Vec<Shot>)> {
    let text = input::text(path, Kind::List)?;
    let list: List = serde_json::from_str(&text)
        .with_context(|| format!("{} is no list of pictures; docs/hand_eye.md has its keys", path.display()))?;
    let camera = list.fl_x.map(|fx| CalibratedCamera {
        intrinsics: Intrinsics {
            fx,
            fy: list.fl_y.unwrap_or(fx),
            cx: list.cx.or(list.w.map(|w| w / 2.0)).unwrap_or(0.0) - HALF,
            cy: list.cy.or(list.h.map(|h| h / 2.0)).unwrap_or(0.0) - HALF,
        },
        distortion: [list.k1, list.k2, list.p1, list.p2, list.k3],
    });
    let shots = list.frames.into_iter().map(|frame| {
        let name = frame.file_path.display().to_string();
        let matrix = frame.O_T_EE.with_context(|| format!("{}: {name} has no `O_T_EE`", path.display()))?;
        let pose = matrix.isometry().map_err(|what| anyhow::anyhow!("{}: {name}: {what}", path.display()))?;
        let content = match frame.points {
            Some(points) => Content::Points(points),
            None => Content::Picture(folder.join(&frame.file_path)),
        };
        Ok(Shot { name, base_from_end_effector: pose, content })
    });
    Ok((camera, shots.collect::<anyhow::Result<_>>()?))
}

fn beside(folder: &Path) -> anyhow::Result<(Option<CalibratedCamera>, Vec<Shot>)> {
    let found = pictures(folder);
    ensure!(
        !found.is_empty(),
        "{}: neither poses.json nor pictures (png, jpg) with a JSON file beside each; docs/hand_eye.md has both forms",
        folder.display()
    );
    let (mut camera, mut shots) = (None, Vec::new());
    for picture in found {
        let path = picture.with_extension("json");
        let text = input::text(&path, Kind::List)
            .with_context(|| format!("{} needs `O_T_EE` in a JSON file of its name beside it", picture.display()))?;
        let file: Beside = serde_json::from_str(&text)
            .with_context(|| format!("{} is not what stands beside a picture; docs/hand_eye.md", path.display()))?;
        let matrix = file.O_T_EE.with_context(|| format!("{} has no `O_T_EE`", path.display()))?;
        let pose = matrix.isometry().map_err(|what| anyhow::anyhow!("{}: {what}", path.display()))?;
        if let Some(k) = file.K {
            let mut distortion = [0.0; 5];
            distortion.iter_mut().zip(file.D.unwrap_or_default()).for_each(|(to, from)| *to = from);
            let intrinsics = Intrinsics { fx: k[0], fy: k[4], cx: k[2], cy: k[5] };
            let here = CalibratedCamera { intrinsics, distortion };
            ensure!(
                camera.is_none_or(|before| before == here),
                "{}: intrinsics differ from those of the pictures before; give pictures of one camera",
                path.display()
            );
            camera = Some(here);
        }
        let name = picture.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        shots.push(Shot { name, base_from_end_effector: pose, content: Content::Picture(picture) });
    }
    Ok((camera, shots))
}

fn recorded(source: &Source) -> anyhow::Result<(Option<CalibratedCamera>, Vec<Shot>)> {
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
        Ok(Shot { name: shot.name, base_from_end_effector: pose, content: Content::Pixels(shot.pixels) })
    });
    let camera = session
        .cell
        .camera
        .as_ref()
        .map(|camera| CalibratedCamera { intrinsics: camera.pinhole(), distortion: camera.distortion });
    Ok((camera, shots.collect::<anyhow::Result<_>>()?))
}

/// The camera's numbers: those given, else those beside the pictures, else the cell's.
fn camera(source: &Source, own: Option<CalibratedCamera>) -> anyhow::Result<CalibratedCamera> {
    let of_cell = || -> anyhow::Result<Option<CalibratedCamera>> {
        let Some(path) = &source.cell else { return Ok(None) };
        let camera = Cell::read(path)?.camera;
        Ok(camera.map(|camera| CalibratedCamera { intrinsics: camera.pinhole(), distortion: camera.distortion }))
    };
    let found = match source.intrinsics {
        Some([fx, fy, cx, cy]) => {
            let distortion = own.map_or([0.0; 5], |own| own.distortion);
            Some(CalibratedCamera { intrinsics: Intrinsics { fx, fy, cx, cy }, distortion })
        }
        None => own.map_or_else(of_cell, |own| Ok(Some(own)))?,
    };
    let Some(camera) = found else {
        bail!("no intrinsics: give --intrinsics fx,fy,cx,cy, --cell with a `[camera]`, or `fl_x` in poses.json")
    };
    let Intrinsics { fx, fy, cx, cy } = camera.intrinsics;
    let finite = [fx, fy, cx, cy].iter().chain(&camera.distortion).all(|v| v.is_finite());
    ensure!(
        finite && fx > 0.0 && fy > 0.0,
        "intrinsics {fx}, {fy}, {cx}, {cy} are none: focal lengths are above 0 [pixel]"
    );
    Ok(camera)
}

/// The board in a picture; the picture's name where it is not seen.
fn view(source: &Source, camera: &CalibratedCamera, lens: Lens, shot: Shot) -> anyhow::Result<Result<View, String>> {
    ensure!(!ending::asked(), "interrupted; nothing was written, start again");
    let Shot { name, base_from_end_effector, content } = shot;
    let pixels = match content {
        Content::Points(points) => {
            let seen = points.iter().map(|[x, y, u, v]| Seen {
                place: [*x, *y],
                pixel: straight(&lens, &camera.distortion, [u - HALF, v - HALF]),
            });
            return Ok(Ok(View { name, base_from_end_effector, seen: seen.collect(), lens }));
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
    let off = [(lens.centre[0], pixels.size[0]), (lens.centre[1], pixels.size[1])];
    ensure!(
        off.iter().all(|(at, size)| (0.2..0.8).contains(&(at / *size as f64))),
        "{name} has {} x {} pixels, and the principal point {:.0}, {:.0} is of another size: give intrinsics of this resolution",
        pixels.size[0],
        pixels.size[1],
        lens.centre[0],
        lens.centre[1]
    );
    let pixels = if camera.distortion == [0.0; 5] { pixels } else { pixels.undistorted(&lens, &camera.distortion) };
    Ok(match board.seen(&pixels, &lens)? {
        Some(reading) => Ok(View { name, base_from_end_effector, seen: reading.seen, lens }),
        None => Err(name),
    })
}

/// Where a pixel would be without the lens's distortion.
fn straight(lens: &Lens, distortion: &[f64; 5], pixel: [f64; 2]) -> [f64; 2] {
    let mut at = pixel;
    for _ in 0..ROUNDS {
        let there = distorted(lens, distortion, at);
        at = [at[0] + pixel[0] - there[0], at[1] + pixel[1] - there[1]];
    }
    at
}
