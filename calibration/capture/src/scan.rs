//! The verb `capture scan`: the arm carries the camera around a point, stops at each view, and what is seen there goes with the
//! arm's pose into a folder that `twin reconstruct` takes.

use super::admission::Admission;
use super::around::Around;
use super::body::Body;
use super::bridge::{Bridge, Wanted};
use super::cut::Cut;
use super::dome::{Dome, Views, apart};
use super::limits;
use super::link::Link;
use super::obstacle::{self, Blocked, Obstacle};
use super::shots::{Pixels, Shot, ShotError, Shots};
use super::stream::{Motion, Outcome, play};
use super::task::cause;
use anyhow::{Context as _, ensure};
use nalgebra::{Isometry3, Point3};
use serde::Serialize;
use serde_json::{Value, json};
use shared_mem::cell::{Cell, Intrinsics, Table};
use shared_mem::hand_eye::{HandEye, Matrix};
use shared_mem::interrupt::Interrupt;
use shared_mem::lens::Distortion;
use shared_mem::msg::Joints;
use shared_mem::msg::motion::SetPoint;
use shared_mem::progress::Progress;
use shared_mem::recording::pack_picture;
use shared_mem::{console, output};
use std::path::{Path, PathBuf};
use std::time::Duration;
use twin::arm::JointLimits;

/// What is asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// The laboratory's cell.toml.
    pub cell: PathBuf,
    /// How the camera is mounted.
    pub hand_eye: PathBuf,
    /// Name of the object that is scanned; default: the one that stands there. The arm keeps clear of the others.
    pub object: Option<String>,
    /// What is looked at: base frame [m].
    pub at: [f64; 3],
    /// From the camera to it [m].
    pub distance: f64,
    /// What is further from there is no part of it [m].
    pub radius: f64,
    pub views: usize,
    /// The scan's folder; new.
    pub out: PathBuf,
    /// Arm of a bridge that has to be started, as `rt_bridge run --arm` takes it.
    pub arm: Option<String>,
    /// Whether that bridge insists on real time, as `rt_bridge run --realtime` takes it; default: the bridge's own.
    pub realtime: Option<String>,
    /// Shared-memory domain; default: the one this process was started in.
    pub domain: Option<String>,
}

/// What was done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The scan's folder.
    pub scan: PathBuf,
    /// Pictures in it.
    pub pictures: usize,
    /// Of these with depth.
    pub with_depth: usize,
    /// Of these with an object in their mask.
    pub with_mask: usize,
    /// Views within reach of which no way inside every limit was found.
    pub without_way: usize,
    /// Views left out because another object is in the way, or in the camera's sight.
    pub blocked: usize,
    /// Whether the user ended it early.
    pub interrupted: bool,
    /// Whether the bridge was started, and ended, by this run.
    pub own_bridge: bool,
}

/// Fewer views make no scan.
const MIN_VIEWS: usize = 8;
/// Flange, tool and camera stay this far above the table [m].
const CLEARANCE: f64 = 0.05;
/// A mask with less of the picture is none [share]: 300 pixels of 640 x 480 are an object of 10 mm half a metre away.
const MIN_MASK: f64 = 1e-3;
/// From the middle of a pixel to the corner that lists of pictures count from.
const PIXEL_CORNER_OFFSET: f64 = 0.5;

/// Everything that stays the same from view to view.
struct CaptureContext<'a> {
    options: &'a Options,
    body: Body,
    limits: Vec<JointLimits>,
    list: Value,
    cut: Option<Cut>,
    mount: Isometry3<f64>,
    around: Option<Around>,
    shots: Shots,
    interrupt: &'a Interrupt,
}

/// Captures the scan until all views are there or the user ends it.
///
/// # Errors
/// One line with what happened and what to do; pictures that were complete before are in the folder.
pub fn capture(options: &Options, interrupt: &Interrupt) -> anyhow::Result<Summary> {
    let cell = Cell::read(&options.cell)?;
    let body = Body::of(&cell)?;
    ensure!(
        body.model().has_geometry(),
        "cell.toml gives no robot.model or robot.urdf: without it no view can be planned"
    );
    let hand_eye = HandEye::read(&options.hand_eye)?;
    let mount = hand_eye.end_effector_from_camera();
    let mount = mount.map_err(|what| anyhow::anyhow!("{} {what}", options.hand_eye.display()))?;
    let (mut list, pinhole) = list(&cell, &hand_eye)?;
    if let Some(table) = &cell.table {
        list["table"] = json!(table.height);
    }
    // Without a table everything in reach would be the object.
    let of_table = |table: &Table| Cut { at: options.at.into(), radius: options.radius, table: table.height, pinhole };
    let cut = cell.table.as_ref().map(of_table);
    let list_file = options.out.join("poses.json");
    ensure!(!list_file.exists(), "{} holds a scan already; give a new folder with --out", options.out.display());
    let around = Around::open(options.domain.as_deref(), &cell, options.object.as_deref())?;
    let latency = Duration::from_secs_f64(cell.camera.as_ref().map_or(0.0, |camera| camera.latency.max(0.0)));
    let mut link = Link::open(options.domain.as_deref())?;
    let (arm, realtime) = (options.arm.as_deref(), options.realtime.as_deref());
    let (hand_eye_file, domain) = (Some(options.hand_eye.as_path()), options.domain.as_deref());
    let wanted = Wanted { cell: &options.cell, arm, hand_eye: hand_eye_file, no_camera: false, realtime, domain };
    let mut bridge = Bridge::find_or_start(&mut link, &wanted, &Admission::default(), interrupt)?;
    let shots = Shots::open(options.domain.as_deref(), latency)?;
    let limits = limits::of(&cell, &body);
    let mut context = CaptureContext { options, body, limits, list, cut, mount, around, shots, interrupt };
    let floor = cell.table.as_ref().map_or(f64::NEG_INFINITY, |table| table.height + CLEARANCE);
    let done = context.all_views(&mut link, floor, &hand_eye);
    let summary = done.map_err(|error| cause(error, &mut bridge))?;
    let own_bridge = bridge.is_own();
    bridge.stop()?;
    Ok(Summary { own_bridge, ..summary })
}

/// The list of pictures without pictures: the camera's numbers.
fn list(cell: &Cell, hand_eye: &HandEye) -> anyhow::Result<(Value, Intrinsics)> {
    let of_cell = cell.camera.as_ref().map(|camera| (camera.pinhole(), camera.distortion));
    let calibrated = hand_eye.camera.map(|camera| (camera.intrinsics, camera.distortion));
    let (pinhole, distortion) =
        calibrated.or(of_cell).context("no intrinsics: neither hand_eye.toml nor cell.toml has a `[camera]`")?;
    let Intrinsics { fx, fy, cx, cy } = pinhole;
    let lens = match distortion {
        Distortion::Fisheye([k1, k2, k3, k4]) => {
            json!({ "camera_model": "OPENCV_FISHEYE", "k1": k1, "k2": k2, "k3": k3, "k4": k4 })
        }
        Distortion::Polynomial([k1, k2, p1, p2, k3, k4, k5, k6]) => {
            json!({ "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": k3, "k4": k4, "k5": k5, "k6": k6 })
        }
    };
    let mut list =
        json!({ "fl_x": fx, "fl_y": fy, "cx": cx + PIXEL_CORNER_OFFSET, "cy": cy + PIXEL_CORNER_OFFSET, "frames": [] });
    if let (Value::Object(list), Value::Object(lens)) = (&mut list, lens) {
        list.extend(lens);
    }
    Ok((list, pinhole))
}

impl CaptureContext<'_> {
    fn all_views(&mut self, link: &mut Link, floor: f64, hand_eye: &HandEye) -> anyhow::Result<Summary> {
        let Options { at, distance, views, out, .. } = self.options;
        let state = link.ready_arm(self.limits.len())?;
        // A robot may report another end effector than the flange.
        let reported = Matrix::Flat(state.O_T_EE).isometry().map_err(anyhow::Error::msg)?;
        let flange = self.body.model().flange(&state.q).isometry();
        let flange_from_camera = flange.inverse() * reported * self.mount;
        self.body = self.body.clone().with_camera(flange_from_camera);
        let (at, radius) = (Point3::from(*at), self.options.radius);
        if let Some(around) = &mut self.around {
            around.settle(&at, self.options.object.is_some())?;
        }
        let obstacles = self.obstacles()?;
        say_parts(&obstacles, &at, radius);
        let dome = Dome { at, distance: *distance, flange_from_camera, floor, radius, obstacles: &obstacles };
        let Views { free: mut open, blocked } = dome.views(&self.body, &self.limits, &state.q_d, *views);
        check(&at, &open, &blocked)?;
        for part in ["images", "depth", "masks"] {
            std::fs::create_dir_all(out.join(part))
                .with_context(|| format!("cannot make {}; give another folder with --out", out.join(part).display()))?;
        }
        output::write(&out.join("hand_eye.toml"), hand_eye.to_toml())?;
        let start = state.q_d;
        let progress = Progress::new("views", open.len() as u64);
        let mut summary = Summary {
            scan: out.clone(),
            pictures: 0,
            with_depth: 0,
            with_mask: 0,
            without_way: 0,
            blocked: blocked.len(),
            interrupted: false,
            own_bridge: false,
        };
        while !open.is_empty() && !self.interrupt.asked() {
            self.interrupt.wait_out_pause();
            progress.show(summary.pictures as u64, "");
            let from = link.ready_arm(self.limits.len())?.q_d;
            let now = self.obstacles()?;
            let dome = Dome { obstacles: &now, ..dome };
            let Some((next, legs)) = self.nearest(&dome, [&from, &start], &open) else {
                summary.without_way = open.len();
                break;
            };
            match self.go(link, &legs)? {
                Outcome::Done => {}
                Outcome::Paused => continue,
                Outcome::Stopped => break,
                Outcome::Reflex => {
                    anyhow::bail!("{}; recover the robot, then start again with a new folder", link.reason()?)
                }
            }
            open.swap_remove(next);
            match self.shots.take(link, self.interrupt) {
                Ok(shot) => {
                    let mask = self.keep(summary.pictures, &shot)?;
                    summary.pictures += 1;
                    summary.with_depth += usize::from(shot.depth.is_some());
                    summary.with_mask += usize::from(mask.is_some_and(|share| share > MIN_MASK));
                    ensure!(
                        summary.pictures > 1 || mask.is_none_or(|share| share > MIN_MASK),
                        "the first picture has no object in its mask: above the table nothing was measured within {radius:.2} m of --at; \
                         put it there, and further from the camera than that measures (a D455: 0.4 m), then start again with a new folder"
                    );
                }
                Err(ShotError::Interrupted) => break,
                Err(error) => return Err(error.into()),
            }
        }
        summary.interrupted = self.interrupt.asked();
        Ok(summary)
    }

    /// The other objects, where they stand now.
    fn obstacles(&mut self) -> anyhow::Result<Vec<Obstacle>> {
        let Some(around) = &mut self.around else { return Ok(Vec::new()) };
        around.look()?;
        Ok(around.obstacles())
    }

    /// The nearest of the open views that a way leads to: straight, or over where the arm was at the start, from where each is reached.
    fn nearest(
        &self,
        dome: &Dome<'_>,
        [from, start]: [&Joints; 2],
        open: &[Joints],
    ) -> Option<(usize, Vec<Vec<SetPoint>>)> {
        let mut order: Vec<usize> = (0..open.len()).collect();
        order.sort_by(|a, b| apart(from, &open[*a]).total_cmp(&apart(from, &open[*b])));
        let way = |from: &Joints, to: &Joints| dome.way(&self.body, &self.limits, from, to).ok();
        let straight = order.iter().find_map(|k| Some((*k, vec![way(from, &open[*k])?])));
        straight.or_else(|| {
            let back = way(from, start)?;
            order.iter().find_map(|k| Some((*k, vec![back.clone(), way(start, &open[*k])?])))
        })
    }

    /// Plays one way after the other; how the first that was not played to its end ended.
    fn go(&self, link: &mut Link, legs: &[Vec<SetPoint>]) -> anyhow::Result<Outcome> {
        for set_points in legs {
            let motion = Motion { set_points, dof: self.limits.len() };
            let outcome = play(link, motion, self.interrupt, |_| {})?;
            if !matches!(outcome, Outcome::Done) {
                return Ok(outcome);
            }
        }
        Ok(Outcome::Done)
    }

    /// Writes the pictures, then the list with them in it: what it names is there. The share of the picture that its mask covers, where
    /// there is one.
    fn keep(&mut self, number: usize, shot: &Shot) -> anyhow::Result<Option<f64>> {
        let mut covered = None;
        let name = format!("{number:03}.png");
        write(&self.options.out.join("images").join(&name), &shot.colour)?;
        let mut frame = json!({ "file_path": format!("images/{name}"), "O_T_EE": shot.state.O_T_EE });
        if let Some(depth) = &shot.depth {
            write(&self.options.out.join("depth").join(&name), depth)?;
            frame["depth_file_path"] = json!(format!("depth/{name}"));
            self.list["depth_unit_scale_factor"] = json!(depth.header.depth_scale);
            if let Some(cut) = &self.cut {
                let flange = Matrix::Flat(shot.state.O_T_EE).isometry().map_err(anyhow::Error::msg)?;
                let mask = cut.mask(depth, &(flange * self.mount));
                let white = mask.bytes.iter().filter(|value| **value > 0).count();
                covered = Some(white as f64 / mask.bytes.len().max(1) as f64);
                write(&self.options.out.join("masks").join(&name), &mask)?;
            }
        }
        (self.list["w"], self.list["h"]) = (json!(shot.colour.header.width), json!(shot.colour.header.height));
        if let Some(frames) = self.list["frames"].as_array_mut() {
            frames.push(frame);
        }
        let text = serde_json::to_string_pretty(&self.list)?;
        output::write(&self.options.out.join("poses.json"), text)?;
        Ok(covered)
    }
}

/// Says which objects reach into what is scanned.
fn say_parts(obstacles: &[Obstacle], at: &Point3<f64>, radius: f64) {
    for obstacle in obstacles.iter().filter(|obstacle| obstacle.gap(at, radius).0 < 0.0) {
        let (gap, _) = obstacle.gap(at, 0.0);
        console::line(format_args!(
            "`{}` stands {:.0} mm from --at, within --radius ({:.0} mm), and becomes a part of what is scanned; give a smaller --radius \
             or move it away, unless it is to be one",
            obstacle.name(),
            1e3 * gap.max(0.0),
            1e3 * radius
        ));
    }
}

/// Says which views are left out and why; an error where too few are free.
fn check(at: &Point3<f64>, free: &[Joints], blocked: &[Blocked]) -> anyhow::Result<()> {
    let all = free.len() + blocked.len();
    let place = format!("{}, {}, {} m", at.x, at.y, at.z);
    ensure!(
        all >= MIN_VIEWS,
        "of the views around {place} only {all} are within the arm's reach: move the object nearer, or give another --distance"
    );
    let mut said: Vec<&str> = Vec::new();
    for Blocked { name, .. } in blocked {
        if said.contains(&name.as_str()) {
            continue;
        }
        said.push(name);
        let of_this = || blocked.iter().filter(|blocked| blocked.name == *name).cloned();
        if let Some(worst) = of_this().reduce(obstacle::worse) {
            console::line(format_args!("{} of {all} views are left out: {worst}", of_this().count()));
        }
    }
    let worst = blocked.iter().cloned().reduce(obstacle::worse).filter(|_| free.len() < MIN_VIEWS);
    let left = free.len();
    worst.map_or(Ok(()), |worst| {
        Err(anyhow::anyhow!(
            "of the views around {place} only {left} are clear of other objects, and {MIN_VIEWS} are needed: {worst}"
        ))
    })
}

fn write(path: &Path, pixels: &Pixels) -> anyhow::Result<()> {
    let header = &pixels.header;
    let packed = pack_picture(header.encoding, header.width, header.height, &pixels.bytes);
    let packed = packed.map_err(|what| anyhow::anyhow!("{}: {what}", path.display()))?;
    Ok(output::write(path, packed)?)
}
