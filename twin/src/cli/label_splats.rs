//! `twin label-splats`: the robot out of a scanned cell, one splat file for each link.

use super::look::joint;
use crate::arm::MAX_JOINTS;
use crate::reconstruct::{STARTS, SurfacePoints, align, label};
use crate::render::{Hand, RobotSurface};
use anyhow::{Context as _, bail, ensure};
use nalgebra::{Isometry3, Point3, Quaternion, Similarity3, Translation3, UnitQuaternion};
use shared_mem::answer;
use shared_mem::cell::Cell;
use shared_mem::output::{Destination, Output};
use shared_mem::progress::{Planned, Progress};
use shared_mem::quantity::number;
use splat::{SplatCloud, link_file};
use std::path::PathBuf;

/// Finds the robot in a scanned cell and parts the scan: one splat file for each link, in its frame, and the rest.
#[derive(clap::Args)]
#[command(after_help = "\
The scan is laid onto the robot's surface at the joint positions it stood at: turned, shifted and scaled, beginning with --start
and what lies within 15 degrees and 15 % of scale around it. Then each splat goes to the link whose surface is nearest.
Writes link0.ply to link7.ply (hand.ply with --hand) and scene.ply, which is the rest in the base frame.

Examples:
  twin label-splats scan.ply --cell cell.toml --joints 0,-0.78,0,-2.36,0,1.57,0.78 --out fr3_splats
  twin label-splats scan.ply --cell cell.toml --joints 0,-0.78,0,-2.36,0,1.57,0.78 --start 0.4,0,0.1,1,0,0,0,0.31 --out fr3_splats
  twin render session --splats fr3_splats --out frames")]
pub struct LabelSplats {
    /// The scan: 3DGS PLY, or SuperSplat's compressed PLY
    #[arg(value_name = "SCAN.ply")]
    scan: PathBuf,
    /// What the laboratory knows about its cell; its table is no robot
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    /// Joint positions of the robot in the scan [rad], with commas between them
    #[arg(long, value_name = "Q", allow_hyphen_values = true, value_delimiter = ',', required = true, value_parser = joint)]
    joints: Vec<f64>,
    /// Folder for the parts
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// Replaces parts that are in the folder already
    #[arg(long)]
    force: bool,
    /// Roughly where the scan's frame lies in the base: x,y,z,qw,qx,qy,qz, and metres for one of its units [default: at the
    /// base, in metres]
    #[arg(long, value_name = "POSE", allow_hyphen_values = true, value_delimiter = ',', value_parser = part_of_pose)]
    start: Option<Vec<f64>>,
    /// The Franka Hand is mounted, its fingers so far apart [m], 0 to 0.08
    #[arg(long, value_name = "WIDTH", value_parser = hand)]
    hand: Option<f64>,
    /// A splat belongs to a link whose surface is nearer than this [m], 0.0001 to 0.2
    #[arg(long, value_name = "DISTANCE", default_value_t = 0.015, value_parser = reach)]
    reach: f64,
    /// Prints one JSON object on stdout at the end
    #[arg(long)]
    json: bool,
}

/// One of the eight numbers of a pose with a scale.
fn part_of_pose(text: &str) -> Result<f64, String> {
    number(text, -1000.0..=1000.0, "m, or of a quaternion")
}

/// Opening of a Franka Hand [m].
fn hand(text: &str) -> Result<f64, String> {
    number(text, 0.0..=0.08, "m")
}

fn reach(text: &str) -> Result<f64, String> {
    number(text, 1e-4..=0.2, "m")
}

/// Splats fainter than this are haze and say nothing of a surface.
const FAINT: f32 = 0.3;
/// Nor do those that are as large as this [share of the arm's reach of about a metre].
const BLURRED: f64 = 0.05;
/// So near above the table a splat is the table's [m].
const ON_TABLE: f64 = 0.004;

/// Stages of the work, with how long they took of 600,000 splats [s].
const PLAN: [Planned; 4] = [("read", 0.4), (ALIGN, 15.0), (LABEL, 3.0), (WRITE, 1.0)];
const ALIGN: &str = "align";
const LABEL: &str = "label";
const WRITE: &str = "write";

/// What is no robot.
const REST: &str = "scene.ply";

impl LabelSplats {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        super::discard_on_signal()?;
        let mut cell = Cell::read(&self.cell)?;
        // The capsule that stands for the tool is not what was scanned.
        cell.tool = None;
        let hand = self.hand.map_or(Hand::None, |width| Hand::Franka { width });
        let robot = RobotSurface::new(&cell, hand)?;
        let dof = robot.model().dof();
        ensure!(self.joints.len() == dof, "--joints has {} values, the arm {dof} joints", self.joints.len());
        let mut q = [0.0; MAX_JOINTS];
        q[..dof].copy_from_slice(&self.joints);
        let start = self.start()?;
        let count = robot.links().into_iter().max().map_or(0, |most| most + 1);
        let links = (0..count).map(link_file);
        let place = |name: String| Destination::in_new_folder(&self.out.join(name), self.force);
        let mut places = links.chain([REST.to_owned()]).map(place).collect::<Result<Vec<_>, _>>()?.into_iter();
        let bar = Progress::planned("label-splats", &PLAN, 1);
        let scan = SplatCloud::read(&self.scan)?;
        let surface = SurfacePoints::new(&robot, &q, |_| true);
        let clear = scan
            .splats
            .iter()
            .filter(|splat| splat.opacity >= FAINT && f64::from(splat.sigma.max()) * start.scaling() < BLURRED);
        let points: Vec<Point3<f64>> = clear.map(|splat| splat.centre.cast()).collect();
        bar.stage(ALIGN, STARTS as u64);
        let found = align(&points, &surface, &start, |tried| bar.show(tried as u64, ALIGN))?;
        bar.stage(LABEL, 1);
        let table = cell.table.map(|table| table.height + ON_TABLE);
        let parts = label(&scan, &found.base_from_scan, &surface, self.reach, table);
        let (mut counts, mut outputs) = (Vec::new(), Vec::new());
        bar.stage(WRITE, places.len() as u64);
        let mut put = |splats: &SplatCloud| -> anyhow::Result<()> {
            let mut output = places.next().context("as many places as parts")?.begin()?;
            splats.write_to(&mut output)?;
            outputs.push(output);
            bar.show(outputs.len() as u64, WRITE);
            Ok(())
        };
        for (link, splats) in parts.links.iter().enumerate() {
            let link_from_base = robot.base_from_link(&q, link).inverse();
            put(&splats.moved(&Similarity3::from_isometry(link_from_base, 1.0)))?;
            counts.push(splats.splats.len());
        }
        put(&parts.rest)?;
        // Once there was room for all of them: the links of two scans make no robot.
        outputs.into_iter().try_for_each(Output::finish)?;
        drop(bar);
        let at = found.base_from_scan;
        let (place, turn) = (at.isometry.translation.vector, at.isometry.rotation.quaternion());
        let words = format!(
            "{} of {} splats are the robot, in {}; {:.0} % of its surface was scanned, {:.1} mm off (root mean square)",
            counts.iter().sum::<usize>(),
            scan.splats.len(),
            self.out.display(),
            found.seen * 100.0,
            found.rms * 1e3,
        );
        if self.json {
            let answer = serde_json::json!({
                "scale": at.scaling(), "position": [place.x, place.y, place.z],
                "orientation_wxyz": [turn.w, turn.i, turn.j, turn.k], "seen": found.seen, "rms_m": found.rms,
                "links": counts, "rest": parts.rest.splats.len(),
            });
            answer::json(&answer)?;
        } else {
            answer::words(words)?;
        }
        Ok(())
    }

    fn start(&self) -> anyhow::Result<Similarity3<f64>> {
        let (values, scale) = match self.start.as_deref() {
            None => return Ok(Similarity3::identity()),
            Some(values @ [_, _, _, _, _, _, _]) => (values, 1.0),
            Some([values @ .., scale]) if values.len() == 7 => (values, *scale),
            Some(values) => bail!("--start has {} values; it is x,y,z,qw,qx,qy,qz and a scale", values.len()),
        };
        let turn = Quaternion::new(values[3], values[4], values[5], values[6]);
        ensure!(turn.norm() > 1e-6 && scale > 0.0, "--start holds no pose: check its quaternion and its scale");
        let place = Translation3::new(values[0], values[1], values[2]);
        let pose = Isometry3::from_parts(place, UnitQuaternion::from_quaternion(turn));
        Ok(Similarity3::from_isometry(pose, scale))
    }
}
