//! `twin reconstruct articulated`: an object with a part that moves, out of scans.

use super::asset_folder::{Outputs, kept, mass, metres, piece};
use crate::physics::convex_pieces;
use crate::scene::mesh_in_its_middle;
use anyhow::{Context as _, ensure};
use nalgebra::{Isometry3, Similarity3, Translation3};
use reconstruct::articulated::{self, Articulated, Joint, Marks};
use reconstruct::assets::{self, ArticulatedSummary, Labels};
use reconstruct::mesh::Mesh;
use reconstruct::object::{self, Options};
use reconstruct::scan::Scan;
use serde::Deserialize;
use shared_mem::input;
use shared_mem::output::OutputFolder;
use shared_mem::{answer, console, ending};
use splat::SplatCloud;
use std::path::{Path, PathBuf};

/// An object with a part that moves, out of two states of it: both parts, the hinge or slide between them, URDF, a report.
#[derive(clap::Args)]
#[command(after_help = "\
Each state is a scan, or a folder that `twin reconstruct object` has made of one, which is faster to try: the first closed, or nearly, the
second open as far as it goes. The scans may have frames of their own; what keeps its place, or else the larger part, is the base. A part
moved by 20 degrees or a fifth of its size is found well. With --marks one state is enough: a file with masks of the part and two
pixels of its axis (docs/reconstruct.md).

Writes articulated.urdf (position 0 is the first state), base.obj and part.obj (at most 700 triangles), base_fine.obj, part_fine.obj,
pieces/, base_splats.ply and part_splats.ply (of a folder: where it has splats.ply), task_articulated.toml (an [[articulated]] block for a task),
articulated.json and report.html.

Examples:
  twin reconstruct articulated laptop_closed laptop_open --out laptop
  twin reconstruct articulated drawer_scan_1 drawer_scan_2 --out drawer --mass 2.4
  twin reconstruct articulated laptop_open --marks marks.json --out laptop --json")]
pub(crate) struct ArticulatedVerb {
    /// Scan of the first state, or the folder of an object made of it
    #[arg(value_name = "FIRST")]
    first: PathBuf,
    /// Scan of the second state, or the folder of an object made of it
    #[arg(value_name = "SECOND", required_unless_present = "marks", conflicts_with = "marks")]
    second: Option<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
    /// JSON file that marks the part and its axis in pictures of the first state
    #[arg(long, value_name = "FILE")]
    marks: Option<PathBuf>,
    /// Metres for one unit of the poses of scans, 1e-6 to 1000 [default: as depth or the robot says]
    #[arg(long, value_name = "METRES", value_parser = metres)]
    scale: Option<f64>,
    /// Mass of the whole, where it was weighed [kg], 1e-4 to 1000 [default: 500 kg/m^3]
    #[arg(long, value_name = "MASS", value_parser = mass)]
    mass: Option<f64>,
    /// The object's name [default: the folder's]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

/// What every folder of this command holds, and appears last.
const LAST_FILE: &str = "articulated.json";
/// What is in a folder that `twin reconstruct object` has made.
const OBJECT: [&str; 3] = ["object.json", "object_fine.obj", "splats.ply"];
/// Nodes along each edge of the grid of a scan, were it a cube.
const GRID: u32 = 128;

/// One state: its mesh around the middle of its box, and where that is in the scan.
struct Given {
    mesh: Mesh,
    mesh_from_scan: Isometry3<f64>,
    /// Metres for one unit of the scan's poses.
    metres: f64,
    splats: Option<SplatCloud>,
    /// What an interrupted run would find again.
    kept: Option<PathBuf>,
}

/// What is needed of object.json.
#[derive(Deserialize)]
struct ObjectNumbers {
    origin_in_scan_m: [f64; 3],
    scale: ObjectScale,
}

#[derive(Deserialize)]
struct ObjectScale {
    metres: f64,
}

impl ArticulatedVerb {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        ctrlc::set_handler(ending::ask).context("cannot listen for Ctrl-C")?;
        let folder = self.outputs.folder(LAST_FILE)?;
        let first = self.given(&self.first, "first")?;
        let (object, splats, kept) = match (&self.second, &self.marks) {
            (Some(second), _) => {
                let second = self.given(second, "second")?;
                // Where both scans have one frame, what stays is then in its place.
                let placed = second.mesh_from_scan * first.mesh_from_scan.inverse();
                let object = articulated::between(assets::in_frame(&first.mesh, &placed), second.mesh)?;
                (object, second.splats, [first.kept, second.kept])
            }
            (None, Some(marks)) => (self.marked(&first, marks)?, first.splats, [first.kept, None]),
            (None, None) => unreachable!("one of the two is required"),
        };
        let frames = assets::links_from_mesh(&object);
        let mut pieces: [Vec<Mesh>; 2] = Default::default();
        for ((part, frame), pieces) in [&object.base, &object.part].into_iter().zip(&frames).zip(&mut pieces) {
            ensure!(!ending::asked(), "interrupted");
            let mesh = assets::in_frame(&part.fine, frame);
            *pieces = convex_pieces(&mesh.points, &mesh.triangles).into_iter().map(piece).collect();
        }
        ensure!(!ending::asked(), "interrupted");
        let labels = Labels { name: self.name(), mass: self.mass, command: self.command() };
        for (path, bytes) in assets::articulated_files(&object, &pieces, &labels) {
            folder.write(&path, &bytes)?;
        }
        if let Some(splats) = &splats {
            write_splats(&object, splats, &frames, &folder)?;
        }
        ensure!(!ending::asked(), "interrupted");
        folder.finish(LAST_FILE)?;
        kept.iter().flatten().try_for_each(|kept| object::forget(kept))?;
        let summary = ArticulatedSummary::of(&object, &labels);
        for remark in &summary.remarks {
            console::line(format_args!("note: {remark}"));
        }
        if self.outputs.json { Ok(answer::json(&summary)?) } else { Ok(answer::words(self.words(&object, &summary))?) }
    }

    fn name(&self) -> String {
        let named = || self.outputs.out.file_name().map(|name| name.to_string_lossy().into_owned());
        self.name.clone().or_else(named).unwrap_or_else(|| "articulated".into())
    }

    fn command(&self) -> String {
        let second = self.second.as_ref().map(|path| format!(" {}", path.display())).unwrap_or_default();
        let marks = self.marks.as_ref().map(|path| format!(" --marks {}", path.display())).unwrap_or_default();
        format!(
            "twin reconstruct articulated {}{second}{marks} --out {}",
            self.first.display(),
            self.outputs.out.display()
        )
    }

    /// A state out of the folder of an object, or out of a scan.
    fn given(&self, path: &Path, which: &str) -> anyhow::Result<Given> {
        let [numbers, mesh, splats] = OBJECT.map(|name| path.join(name));
        if numbers.is_file() {
            let text = input::text(&numbers, input::Kind::Configuration)?;
            let found: ObjectNumbers = serde_json::from_str(&text).with_context(|| {
                format!("{}: no numbers of an object; make it again with `twin reconstruct object`", numbers.display())
            })?;
            let (points, triangles) = mesh_in_its_middle(&mesh)?;
            let splats = splats.is_file().then(|| SplatCloud::read(&splats)).transpose()?;
            return Ok(Given {
                mesh: Mesh { points, triangles },
                mesh_from_scan: Translation3::from(found.origin_in_scan_m).inverse().into(),
                metres: found.scale.metres,
                splats,
                kept: None,
            });
        }
        let mut state = self.outputs.out.as_os_str().to_owned();
        state.push(format!(".{which}"));
        let state = kept(Path::new(&state));
        let object =
            object::reconstruct(Scan::open(path)?, &Options { scale: self.scale, edge: GRID, table: None }, &state)?;
        let middle = object.middle();
        Ok(Given {
            mesh: assets::centred(&object.fine, &middle),
            mesh_from_scan: Translation3::from(-middle.coords).into(),
            metres: object.scale.metres,
            splats: Some(assets::centred_splats(&object.splats, &middle)),
            kept: Some(state),
        })
    }

    /// The object as it is marked in pictures.
    fn marked(&self, state: &Given, file: &Path) -> anyhow::Result<Articulated> {
        let marks = Marks::read(file)?;
        let is_scan = !self.first.join(OBJECT[0]).is_file();
        let scan = marks.scan.clone().or_else(|| is_scan.then(|| self.first.clone())).with_context(|| {
            format!("{}: which scan it is about is not said; add `scan`, the path of its folder", file.display())
        })?;
        let scan = Scan::open(&scan)?.scaled(state.metres);
        let views = marks.views(&scan, &state.mesh_from_scan)?;
        Ok(articulated::marked(state.mesh.clone(), &views, marks.turns, marks.limits)?)
    }

    fn words(&self, object: &Articulated, summary: &ArticulatedSummary) -> String {
        let [lower, upper] = object.limits;
        let joint = match object.joint {
            Joint::Revolute { .. } => {
                format!("a hinge from {:.1} to {:.1} degrees", lower.to_degrees(), upper.to_degrees())
            }
            Joint::Prismatic { .. } => format!("a slide from {:.1} to {:.1} mm", lower * 1e3, upper * 1e3),
        };
        let [base, part] = [0, 1].map(|number| summary.parts[number].volume_m3 * 1e6);
        format!(
            "{}: {joint}; base {base:.1} cm^3, part {part:.1} cm^3, both closed; see {}",
            self.outputs.out.display(),
            self.outputs.out.join("report.html").display()
        )
    }
}

/// The splats of each part in its link's frame.
fn write_splats(
    object: &Articulated,
    splats: &SplatCloud,
    frames: &[Isometry3<f64>; 2],
    folder: &OutputFolder,
) -> anyhow::Result<()> {
    let moves: Vec<bool> = splats.splats.iter().map(|splat| object.moves(&splat.centre.cast())).collect();
    for (number, link) in assets::LINKS.iter().enumerate() {
        let own = splats.only(|splat| moves[splat] == (number == 1));
        let mut output = folder.file(Path::new(&format!("{link}_splats.ply")))?;
        own.moved(&Similarity3::from_isometry(frames[number], 1.0)).write_to(&mut output)?;
        output.finish()?;
    }
    Ok(())
}
