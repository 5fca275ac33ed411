//! `calibration viewpoint`: from what was given to the answer.

use super::answer::{FrameAnswer, Pose, Start, Viewpoint, cell_text};
use super::board::Board;
use super::fit::{Fit, Method, fit};
use super::frame::Frame;
use super::lens::Lens;
use super::moment::Moment;
use super::picture::Pixels;
use super::search::Reach;
use super::shape::Shape;
use super::{kept, overlay, refine, session, start, step};
use anyhow::{Context as _, bail, ensure};
use inference::interrupt::Interrupt;
use inference::kept::for_work;
use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion};
use shared_mem::cell::{Camera, CameraPose, Cell, Intrinsics, Robot};
use shared_mem::frames::{Base, Camera as CameraFrame, Pose as FramePose};
use shared_mem::lens::calibration::Calibration;
use shared_mem::output::Destination;
use shared_mem::recording::{PictureKind, Session, write_png_to};
use shared_mem::statistics::median;
use shared_mem::{ending, typed};
use std::path::{Path, PathBuf};
use std::time::Instant;
use twin::arm::{Joints, MAX_JOINTS};
use twin::render::{Hand, RobotSurface};

/// What was asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// A session folder, a clip, or pictures.
    pub targets: Vec<PathBuf>,
    /// The cell; of a session its own unless given.
    pub cell: Option<PathBuf>,
    /// Joints of every picture.
    pub joints: Vec<String>,
    /// Masks of the pictures.
    pub masks: Vec<PathBuf>,
    /// A picture without the robot.
    pub background: Option<PathBuf>,
    /// Which pictures of a session; unless given depth where there is some, which no light changes.
    pub kind: Option<PictureKind>,
    /// fx, fy, cx, cy.
    pub intrinsics: Option<[f64; 4]>,
    /// Where to begin.
    pub start: StartFrom,
    /// How far the start may be from the truth; by the kind of picture unless given.
    pub reach: Option<Reach>,
    /// Which way to go.
    pub method: Method,
    /// At most so many pictures of a session.
    pub frames: usize,
    /// The hand at the flange.
    pub hand: Hand,
    /// Seed of what is drawn by lot.
    pub seed: u64,
    /// Where the cell with the found pose goes.
    pub out: Option<Destination>,
    /// Where the pictures with the outline go.
    pub report: Option<Destination>,
}

/// Where to begin.
#[derive(Debug, Clone, PartialEq)]
pub enum StartFrom {
    /// The pose in cell.toml.
    Cell,
    /// This one: the optical frame in the base frame.
    Pose([f64; 3], [f64; 4]),
    /// Anywhere around the robot, the camera upright.
    Search,
    /// Wherever a board is seen from whose frame lies here in the base frame.
    Board(Board, [f64; 3], [f64; 4]),
}

/// How far a start is trusted where nothing was said [rad, m]: a silhouette draws from further away than a photo's edges.
const REACH_OF_MASKS: Reach = Reach { angle: 0.36, distance: 0.32 };
const REACH_OF_PHOTOS: Reach = Reach { angle: 0.25, distance: 0.15 };

/// Focal lengths of lenses, in widths and heights of a picture: from fisheyes to telescopes.
const FOCAL: std::ops::Range<f64> = 0.05..100.0;
/// A principal point further from the middle than this share of the picture is one of another resolution or crop.
const OFF_CENTRE: f64 = 0.12;

/// A picture with everything that belongs to it.
struct Taken {
    name: String,
    pixels: Pixels,
    moment: Moment,
}

/// What was given: the cell, the pictures, and what is to be said about their camera.
struct Gathered {
    cell: Cell,
    taken: Vec<Taken>,
    remarks: Vec<String>,
}

/// Everything that a pose is found from.
struct Prepared {
    cell: Cell,
    camera: Camera,
    lens: Lens,
    shape: Shape,
    frames: Vec<Frame>,
    pixels: Vec<Pixels>,
    warnings: Vec<String>,
}

/// Finds the pose.
///
/// # Errors
/// One line: what is missing or does not fit together, and what to do; after an interruption, what was kept.
pub fn run(options: &Options, interrupt: &Interrupt) -> anyhow::Result<Viewpoint> {
    let began = Instant::now();
    let Prepared { mut cell, camera, lens, shape, frames, pixels, mut warnings } = prepared(options)?;
    let method = options.method;
    let masked = frames.iter().all(Frame::has_mask);
    ensure!(
        masked || matches!(method, Method::Outline),
        "a particle swarm needs silhouettes: give --mask, --background or --depth, or use --method outline"
    );
    let reach = options.reach.unwrap_or(if masked { REACH_OF_MASKS } else { REACH_OF_PHOTOS });
    let start = match &options.start {
        StartFrom::Cell => cell.camera.as_ref().and_then(Camera::base_from_camera),
        StartFrom::Pose(position, wxyz) => FramePose::from_parts(*position, *wxyz),
        StartFrom::Board(board, position, [w, x, y, z]) => {
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(*w, *x, *y, *z));
            let base_from_board = Isometry3::from_parts((*position).into(), turn);
            let board_from_camera = board.camera_from_board(&pixels, &lens)?.inverse();
            Some(FramePose::from_isometry(base_from_board * board_from_camera))
        }
        StartFrom::Search => None,
    };
    let start = start.map(|pose| pose.inverse().isometry());
    let answer_file = options.out.as_ref().or(options.report.as_ref()).map(Destination::path);
    let set = format!("{:?}", (&options.start, reach, method, options.hand, options.seed, &camera));
    let beside = options.masks.iter().chain(&options.background);
    let asked = kept::question(&set, &cell, beside, &frames, &pixels);
    let work = for_work(answer_file, &options.targets[0], "viewpoint", &asked, interrupt);
    let found = match (&start, &options.start) {
        (Some(start), _) => fit(&frames, &shape, start, &reach, method, options.seed),
        (None, StartFrom::Search) => start::search(&frames, &shape, &lens, (method, options.seed), &work),
        (None, _) => {
            bail!(
                "no start: cell.toml has no `[camera] pose`; give --start x,y,z,qw,qx,qy,qz, --board, or --start search"
            )
        }
    };
    ensure!(!ending::asked(), "{}", work.farewell(&typed::command()));
    interrupt.work_is_over();
    let found = found?;
    if found.rival.is_some_and(|rival| rival > 0.95 * found.confirmed) {
        warnings.push("another pose explains the pictures nearly as well; add a picture of another arm pose".into());
    }
    let pictures = if pixels.iter().all(Pixels::is_depth) { "depth" } else { "color" };
    let answer = answer(&frames, &shape, &lens, &found, start.as_ref(), warnings, began, (method, pictures));
    if let Some(out) = &options.out {
        cell.camera = Some(Camera {
            pose: CameraPose { position: answer.camera.position, orientation: answer.camera.orientation },
            ..camera
        });
        out.write(cell_text(&cell, out.path()))?;
    }
    if let Some(report) = &options.report {
        let (width, height, rgb) = overlay::sheet(&frames, &pixels, &shape, &found.camera_from_base, start.as_ref());
        write_png_to(report, width, height, &rgb)?;
    }
    work.done();
    Ok(answer)
}

/// Kinds of pictures to try, the better first.
pub(super) fn kinds(options: &Options) -> Vec<PictureKind> {
    // A board is printed, and masks are drawn over what an eye sees.
    let beside = !options.masks.is_empty() || options.background.is_some();
    match options.kind {
        Some(kind) => vec![kind],
        None if beside || matches!(options.start, StartFrom::Board(..)) => vec![PictureKind::Color],
        None => vec![PictureKind::Depth, PictureKind::Color],
    }
}

/// With the first kind of pictures that can be used.
fn prepared(options: &Options) -> anyhow::Result<Prepared> {
    let kinds = kinds(options);
    let (mut why, last) = (None, kinds.len() - 1);
    for (number, kind) in kinds.into_iter().enumerate() {
        let gathered = gather(options, kind)?;
        if gathered.taken.is_empty() && number < last {
            continue;
        }
        match of_pictures(options, gathered) {
            Err(error) if number < last => why = Some(error),
            Err(error) => return Err(error),
            Ok(mut prepared) => {
                prepared.warnings.extend(why.map(|why| format!("colour was used, because depth cannot be: {why:#}")));
                return Ok(prepared);
            }
        }
    }
    bail!("no pictures")
}

fn of_pictures(options: &Options, gathered: Gathered) -> anyhow::Result<Prepared> {
    let Gathered { cell, taken, remarks: mut warnings } = gathered;
    let camera = camera(&cell, options, &taken)?;
    let own = own_camera(&taken)?;
    warnings.extend(own.and_then(|own| own.remark()));
    if options.intrinsics.is_some() && own.is_none() && cell.camera.is_none() {
        warnings.push("no file says the lens: --intrinsics alone is a pinhole without distortion".into());
    }
    let lens = Lens::new(&camera.pinhole());
    let surface = RobotSurface::new(&cell, options.hand)?;
    ensure!(
        !surface.parts().is_empty(),
        "the arm's shape is not known: give `robot.model = \"fr3\"` or a URDF in cell.toml"
    );
    if !surface.is_measured() {
        warnings.push("only the FR3's shape is known exactly; this arm is drawn as capsules along its links".into());
    }
    let shape = Shape::new(surface);
    let (frames, pixels) = frames(options, &camera, &lens, &shape, taken)?;
    Ok(Prepared { cell, camera, lens, shape, frames, pixels, warnings })
}

/// The cell and the pictures of a kind; files are of the kind they are.
fn gather(options: &Options, kind: PictureKind) -> anyhow::Result<Gathered> {
    let is_picture = |path: &Path| {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        ["png", "jpg", "jpeg"].contains(&ending.as_str())
    };
    if options.targets.iter().all(|path| is_picture(path)) {
        let cell = match &options.cell {
            Some(path) => Cell::read(path)?,
            None => Cell { robot: Some(Robot { model: Some("fr3".into()), ..Robot::default() }), ..Cell::default() },
        };
        let count = options.targets.len();
        ensure!(
            options.joints.len() == count,
            "{count} pictures need {count} --joints, one for each in their order; {} given",
            options.joints.len()
        );
        let taken = options.targets.iter().zip(&options.joints).map(|(path, joints)| {
            let name = path.display().to_string();
            let pixels = Pixels::read(path)?;
            let wanted = options.kind != Some(PictureKind::Depth) || pixels.is_depth();
            ensure!(wanted, "{name} shows colours: give depth pictures, or leave --depth out");
            Ok(Taken { name, pixels, moment: Moment::parse(joints)? })
        });
        return Ok(Gathered { cell, taken: taken.collect::<anyhow::Result<_>>()?, remarks: Vec::new() });
    }
    let [target] = &options.targets[..] else { bail!("give either one session or clip, or pictures (png, jpg)") };
    let session = Session::open_with(target, options.cell.as_deref())?;
    let shots = session::shots(&session, kind, options.frames)?;
    let given = options.kind.is_some() || kind == PictureKind::Color;
    ensure!(
        !shots.is_empty() || !given,
        "{}: no clip of the session holds {} pictures with joints at their time; record with `rt_bridge run --camera`, or give images",
        session.folder.display(),
        if kind == PictureKind::Color { "colour" } else { "depth" }
    );
    let known = session::camera(&session, kind)?;
    let taken = shots.into_iter().map(|shot| {
        let moment = Moment { q: shot.q, camera: known.camera };
        Taken { name: shot.name, pixels: shot.pixels, moment }
    });
    Ok(Gathered { taken: taken.collect(), cell: session.cell, remarks: known.remarks })
}

/// The camera that files beside the pictures name: one for all of them.
fn own_camera(taken: &[Taken]) -> anyhow::Result<Option<Calibration>> {
    let mut said = taken.iter().filter_map(|picture| Some((picture, picture.moment.camera?)));
    let Some((first, camera)) = said.next() else { return Ok(None) };
    let other = said.find(|(_, other)| *other != camera);
    ensure!(
        other.is_none(),
        "the camera of {} differs from that of {}: give pictures of one camera",
        other.map_or("", |(picture, _)| picture.name.as_str()),
        first.name
    );
    Ok(Some(camera))
}

/// The camera whose intrinsics hold for the pictures.
fn camera(cell: &Cell, options: &Options, taken: &[Taken]) -> anyhow::Result<Camera> {
    let mut camera = cell.camera.clone().unwrap_or_default();
    let first = taken.first().context("no pictures")?;
    let own = own_camera(taken)?;
    let mut size = [camera.width as usize, camera.height as usize];
    let pinhole = options.intrinsics.or(own.and_then(|own| own.pinhole));
    ensure!(
        pinhole.is_some() || own.is_none(),
        "the joint files hold a lens and no `K`: add it, nine numbers, or give --intrinsics"
    );
    if let Some([fx, fy, cx, cy]) = pinhole {
        ensure!(fx > 0.0 && fy > 0.0, "focal lengths must be above 0, not {fx} and {fy}");
        size = own.and_then(|own| own.size).unwrap_or(first.pixels.size);
        camera.intrinsics = Some(Intrinsics { fx, fy, cx, cy });
        if let Some(own) = own {
            camera.distortion = own.distortion;
        }
    } else if cell.camera.is_none() {
        bail!(
            "no intrinsics: give --cell with a `[camera]`, a joint file with `K` and `D`, or --intrinsics fx,fy,cx,cy without a lens"
        );
    }
    let pinhole = camera.pinhole();
    let off = [(pinhole.cx, size[0]), (pinhole.cy, size[1])].map(|(at, size)| (at / size as f64 - 0.5).abs());
    ensure!(
        off.iter().all(|off| *off < OFF_CENTRE),
        "the principal point {:.0}, {:.0} lies far from the middle of {} x {} pixels: give intrinsics of this resolution \
         (--intrinsics, `K` of the joint file, or `[camera]` of cell.toml)",
        pinhole.cx,
        pinhole.cy,
        size[0],
        size[1]
    );
    let focal = [(pinhole.fx, size[0]), (pinhole.fy, size[1])].map(|(focal, size)| focal / size as f64);
    ensure!(
        focal.iter().all(|focal| FOCAL.contains(focal)),
        "focal lengths of {} and {} pixels belong to no picture of {} x {} pixels: check --intrinsics, `K` of the joint file, or \
         `[camera]` of cell.toml",
        pinhole.fx,
        pinhole.fy,
        size[0],
        size[1]
    );
    for picture in taken {
        let [width, height] = picture.pixels.size;
        ensure!(
            picture.pixels.size == size,
            "{} has {width} x {height} pixels, the intrinsics are for {} x {}: give those of this resolution",
            picture.name,
            size[0],
            size[1]
        );
    }
    (camera.width, camera.height) = (size[0] as u32, size[1] as u32);
    Ok(camera)
}

fn frames(
    options: &Options,
    camera: &Camera,
    lens: &Lens,
    shape: &Shape,
    taken: Vec<Taken>,
) -> anyhow::Result<(Vec<Frame>, Vec<Pixels>)> {
    ensure!(
        options.masks.is_empty() || options.masks.len() == taken.len(),
        "{} pictures need as many --mask, one for each in their order; {} given",
        taken.len(),
        options.masks.len()
    );
    let background = options.background.as_ref().map(|path| Pixels::read(path)).transpose()?;
    let model = shape.surface().model();
    let (mut frames, mut all) = (Vec::new(), Vec::new());
    for (number, taken) in taken.into_iter().enumerate() {
        let Taken { name, pixels, moment } = taken;
        ensure!(
            moment.q.len() == model.dof(),
            "{name}: {} joint positions were given, the arm has {} joints",
            moment.q.len(),
            model.dof()
        );
        let mut q: Joints = [0.0; MAX_JOINTS];
        q[..moment.q.len()].copy_from_slice(&moment.q);
        let flat = |pixels: Pixels| pixels.undistorted(lens, &camera.distortion);
        // The difference is taken before the lens is undone: beyond the picture's edge there is nothing to compare.
        let evidence = match (options.masks.get(number), &background) {
            (Some(mask), _) => {
                let mask = Pixels::read(mask)?;
                ensure!(mask.size == pixels.size, "the mask of {name} is of another size than the picture");
                flat(mask).mask(&name)?
            }
            (None, Some(background)) => {
                pixels.against(background, &name)?.map(|grid| grid.undistorted(lens, &camera.distortion, 0.0))
            }
            (None, None) => flat(pixels.clone()).alone(lens, &name)?,
        };
        frames.push(Frame::new(name, q, *lens, &evidence, shape));
        all.push(flat(pixels));
    }
    Ok((frames, all))
}

#[allow(clippy::too_many_arguments, reason = "everything that the answer tells")]
fn answer(
    frames: &[Frame],
    shape: &Shape,
    lens: &Lens,
    found: &Fit,
    start: Option<&Isometry3<f64>>,
    warnings: Vec<String>,
    began: Instant,
    (method, pictures): (Method, &'static str),
) -> Viewpoint {
    let pose = |camera_from_base: &Isometry3<f64>| {
        let pose = FramePose::<Base, CameraFrame>::from_isometry(camera_from_base.inverse());
        Pose { position: pose.position(), orientation: pose.wxyz() }
    };
    let joints = |frame: &Frame, pose: &Isometry3<f64>| -> Vec<[f64; 2]> {
        let model = shape.surface().model();
        let origins = model.joint_origins(&frame.q)[..model.dof()].to_vec();
        let points = origins.into_iter().chain([model.flange(&frame.q).position()]);
        points.map(|p| pose * Point3::from(p)).filter(|p| p.z > 0.0).map(|p| lens.project(&p)).collect()
    };
    let start = start.map(|start| {
        let (distance_m, angle_rad) = step::apart(start, &found.camera_from_base);
        let off = (frames.iter())
            .flat_map(|frame| joints(frame, start).into_iter().zip(joints(frame, &found.camera_from_base)))
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
        let (from, to) = (pose(start), pose(&found.camera_from_base));
        let excluded = found
            .interval
            .is_some_and(|interval| (0..3).any(|i| (from.position[i] - to.position[i]).abs() > interval.position[i]));
        Start {
            camera: from,
            distance_m,
            angle_rad,
            reprojection_px: median(off).unwrap_or(f64::MAX),
            confirmed: refine::at(frames, shape, start).map_or(0.0, |there| 1.0 - there.cost),
            excluded,
        }
    });
    let frame_answer = |frame: &Frame| FrameAnswer {
        name: frame.name.clone(),
        loss: frame.wrong(Frame::FINEST, shape, &found.camera_from_base),
        joints_px: joints(frame, &found.camera_from_base),
    };
    Viewpoint {
        camera: pose(&found.camera_from_base),
        interval: found.interval,
        loss: found.loss,
        confirmed: found.confirmed,
        rival: found.rival,
        start,
        frames: frames.iter().map(frame_answer).collect(),
        method: if method == Method::Outline { "outline" } else { "swarm" },
        pictures,
        drawings: found.drawings,
        seconds: began.elapsed().as_secs_f64(),
        warnings,
    }
}
