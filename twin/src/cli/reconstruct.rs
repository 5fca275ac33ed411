//! `twin reconstruct`: assets of a simulation out of scans.

use super::articulated::ArticulatedVerb;
use super::asset_folder::{Dataset, Outputs, kept, mass, metres, piece};
use crate::physics::convex_pieces;
use anyhow::{Context as _, ensure};
use nalgebra::Point3;
use reconstruct::assets::{self, Labels};
use reconstruct::mesh::Mesh;
use reconstruct::object::{self, Certainty, Object, Options};
use reconstruct::scan::{Scan, Table};
use reconstruct::scene;
use shared_mem::quantity::{number, numbers};
use shared_mem::{answer, console, ending};
use std::path::{Path, PathBuf};

/// Makes assets of a simulation out of scans: objects as closed meshes with their mass, scenes as surfaces and splats.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  twin reconstruct object scan --out mug
  twin reconstruct object scan --out mug --mass 0.118 --scale 0.0231
  twin reconstruct articulated laptop_closed laptop_open --out laptop
  twin reconstruct scene cell_scan --out cell_scene")]
pub struct Reconstruct {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Object(ObjectVerb),
    Articulated(ArticulatedVerb),
    Scene(SceneVerb),
}

/// An object out of pictures from all sides: a closed mesh, convex pieces, URDF, a block for cell.toml, a report.
#[derive(clap::Args)]
#[command(after_help = "\
A scan is a folder with pictures, masks of the object (masks/NAME.png, white is the object, or an alpha channel), and the poses:
transforms.json of nerfstudio, a COLMAP model in sparse/0, or poses.json of a robot that held the camera. Depth pictures
(depth/NAME.png, 16 bits, millimetres) make hollows and thin walls right, and give the scale; without any, depth is computed from the
pictures where they have texture, in some minutes. Forty to eighty pictures from all
around, above and below are good; every eighth is held out and shows in the report how good the result is.

Of an object on a table no picture shows the underside: it is closed in the plane of the table, and that is said to be a guess. Depth
around the object says where the table is, or COLMAP's points, else --table, in the frame and the unit of the poses: with z up its
height, and in any other frame NX,NY,NZ,D, the points x, y, z with NX x + NY y + NZ z = D, the normal from the table to the object. The
key `table` of the poses' file says the same. Without any of these the underside is a tip, on which the object cannot stand.

Writes object.obj (at most 700 triangles), object_fine.obj, object.ply (with colours; grey where no picture shows it), splats.ply
(Gaussian splats on its surface), pieces/, object.urdf, cell_object.toml (an [object] block for cell.toml), object.json and
report.html. After Ctrl-C the same command goes on.

Examples:
  twin reconstruct object scan --out mug
  twin reconstruct object scan --out mug --mass 0.118
  twin reconstruct object phone_scan --scale 0.0231 --table -1.35 --out mug
  twin reconstruct object phone_scan --scale 0.0231 --table 0,-1,0,0.82 --out mug
  twin reconstruct object scan --out mug --dataset
  twin reconstruct object phone_scan --scale 0.0231 --out box --json")]
pub(crate) struct ObjectVerb {
    /// Folder with the scan, or its transforms.json or poses.json
    #[arg(value_name = "SCAN")]
    scan: PathBuf,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    dataset: Dataset,
    /// Metres for one unit of the poses, 1e-6 to 1000 [default: as depth or the robot says]
    #[arg(long, value_name = "METRES", value_parser = metres)]
    scale: Option<f64>,
    /// The plane on which the object stands, in the frame and the unit of the poses: its height along z, or NX,NY,NZ,D: its normal,
    /// up to the object, and its distance from the origin along it [default: as the scan, depth or COLMAP's points say]
    #[arg(long, value_name = "PLANE", allow_hyphen_values = true, value_parser = table)]
    table: Option<Table>,
    /// Nodes along each edge of the grid, were it a cube, 24 to 256: 256 takes eight times as long and 1.5 GB
    #[arg(long, value_name = "NODES", default_value_t = 128, value_parser = clap::value_parser!(u32).range(24..=256))]
    grid: u32,
    /// Mass, where it was weighed [kg], 1e-4 to 1000 [default: 500 kg/m^3]
    #[arg(long, value_name = "MASS", value_parser = mass)]
    mass: Option<f64>,
    /// The object's name [default: the folder's]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

/// What every folder of these commands holds, and appears last.
const LAST_OF_OBJECT: &str = "object.json";
const LAST_OF_SCENE: &str = "scene.json";

/// A scene out of pictures: one surface, its table, splats, a mesh to collide with, a report.
#[derive(clap::Args)]
#[command(after_help = "\
A scan is a folder with pictures, depth pictures (depth/NAME.png, 16 bits, millimetres) and the poses: transforms.json of nerfstudio, a
COLMAP model in sparse/0, or poses.json of a robot that held the camera. Without any depth pictures depth is computed from the pictures
where they have texture, and --scale says how long one unit of the poses is. Masks are not needed. Views from around the scene that overlap
are good, fifty and more; every eighth is held out and shows in the report how good the result is.

Writes scene.ply (the surface in colours), scene.obj (the same in fewer triangles, to collide with), splats.ply, scene.json (the table's
height and normal, all levels), report.html, and cell_scene.toml (the [table] block of cell.toml) where a robot held the camera. All lies in
the scan's frame, in metres. After Ctrl-C the same command goes on.

Examples:
  twin reconstruct scene cell_scan --out cell_scene
  twin reconstruct scene phone_scan --scale 0.31 --voxel 0.006 --out room --json
  twin label-splats cell_scene/splats.ply --cell cell.toml --joints 0,-0.78,0,-2.36,0,1.57,0.78 --out fr3_splats")]
pub(crate) struct SceneVerb {
    /// Folder with the scan, or its transforms.json or poses.json
    #[arg(value_name = "SCAN")]
    scan: PathBuf,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    dataset: Dataset,
    /// Metres for one unit of the poses, 1e-6 to 1000 [default: as depth or the robot says]
    #[arg(long, value_name = "METRES", value_parser = metres)]
    scale: Option<f64>,
    /// Edge of a voxel of the fused depth [m], 0.001 to 0.05: half of it takes four times as long and as much memory
    #[arg(long, value_name = "METRES", default_value_t = 0.004, value_parser = voxel)]
    voxel: f64,
    /// Steps of the splats' training, of one picture each, 1 to 100000
    #[arg(long, value_name = "STEPS", default_value_t = 1500, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    steps: u32,
    /// Draws splats into planes: thinner ones, with normals as their depth has them
    #[arg(long)]
    planes: bool,
}

fn voxel(text: &str) -> Result<f64, String> {
    number(text, 1e-3..=0.05, "m")
}

fn table(text: &str) -> Result<Table, String> {
    const FARTHEST: f64 = 1e6;
    let said = if text.contains(',') {
        numbers::<4>(text, -FARTHEST..=FARTHEST, "").ok().and_then(Table::plane)
    } else {
        number(text, -FARTHEST..=FARTHEST, "").ok().map(Table::at_height)
    };
    said.ok_or_else(|| "give its height along z, or nx,ny,nz,d of a plane, of which nx, ny and nz are not all 0".into())
}

impl SceneVerb {
    fn run(&self) -> anyhow::Result<()> {
        ctrlc::set_handler(ending::ask).context("cannot listen for Ctrl-C")?;
        let folder = self.outputs.folder(LAST_OF_SCENE)?;
        let scan = Scan::open(&self.scan)?;
        let kept = kept(&self.outputs.out);
        let (scale, voxel) = (self.scale, self.voxel);
        let options = scene::Options { scale, voxel, planar: self.planes, steps: self.steps as usize };
        let scene = scene::reconstruct(scan, &options, &kept)?;
        let command = format!("twin reconstruct scene {} --out {}", self.scan.display(), self.outputs.out.display());
        let dataset = self.dataset.files(&scene.train, &scene.splats, &Point3::origin());
        for (path, bytes) in assets::scene_files(&scene, &command).into_iter().chain(dataset) {
            folder.write(&path, &bytes)?;
        }
        ensure!(!ending::asked(), "interrupted; the same command goes on from there");
        folder.finish(LAST_OF_SCENE)?;
        object::forget(&kept)?;
        for remark in &scene.remarks {
            console::line(format_args!("note: {}", remark.0));
        }
        let summary = assets::SceneSummary::of(&scene);
        if self.outputs.json { Ok(answer::json(&summary)?) } else { Ok(answer::words(self.words(&summary))?) }
    }

    fn words(&self, summary: &assets::SceneSummary) -> String {
        let table = summary.table.map_or("no table".to_owned(), |table| {
            let [x, y, z] = table.normal;
            format!(
                "table {:.1} mm along ({x:.4}, {y:.4}, {z:.4}) from the origin, {} points",
                1e3 * table.offset_m,
                table.points
            )
        });
        let depth = summary.computed_depth.map_or(String::new(), |share| {
            format!("; depth computed from the pictures on {:.0} % of their pixels", 100.0 * share)
        });
        format!(
            "{}: {} triangles, {} to collide with, {} splats{depth}; {table}; held-out views {:.1} dB; see {}",
            self.outputs.out.display(),
            summary.surface[1],
            summary.collision_triangles,
            summary.splats,
            summary.psnr_db,
            self.outputs.out.join("report.html").display()
        )
    }
}

impl Reconstruct {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        match &self.what {
            What::Object(verb) => verb.run(),
            What::Articulated(verb) => verb.run(),
            What::Scene(verb) => verb.run(),
        }
    }
}

impl ObjectVerb {
    fn run(&self) -> anyhow::Result<()> {
        ctrlc::set_handler(ending::ask).context("cannot listen for Ctrl-C")?;
        let folder = self.outputs.folder(LAST_OF_OBJECT)?;
        let scan = Scan::open(&self.scan)?;
        let kept = kept(&self.outputs.out);
        let object =
            object::reconstruct(scan, &Options { scale: self.scale, edge: self.grid, table: self.table }, &kept)?;
        let middle = object.middle();
        let fine = assets::centred(&object.fine, &middle);
        let pieces: Vec<Mesh> = convex_pieces(&fine.points, &fine.triangles).into_iter().map(piece).collect();
        let named = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
        let name = self.name.clone().or_else(|| named(&self.outputs.out)).unwrap_or_else(|| "object".into());
        let command = format!("twin reconstruct object {} --out {}", self.scan.display(), self.outputs.out.display());
        let labels = Labels { name, mass: self.mass, command };
        let dataset = self.dataset.files(&object.train, &object.splats, &middle);
        for (path, bytes) in assets::files(&object, &pieces, &labels).into_iter().chain(dataset) {
            folder.write(&path, &bytes)?;
        }
        ensure!(!ending::asked(), "interrupted; the same command goes on from there");
        folder.finish(LAST_OF_OBJECT)?;
        object::forget(&kept)?;
        for remark in &object.remarks {
            console::line(format_args!("note: {}", remark.0));
        }
        let summary = assets::Summary::of(&object, &pieces, &labels);
        if self.outputs.json {
            Ok(answer::json(&summary)?)
        } else {
            Ok(answer::words(self.words(&object, pieces.len()))?)
        }
    }

    fn words(&self, object: &Object, pieces: usize) -> String {
        let (low, high) = object.fine.bounds();
        let size = (high - low) * 1e3;
        let base = object.support.map_or(String::new(), |support| {
            format!(" (its base, which no picture shows, closed in the plane of the table: {})", support.source.words())
        });
        let depth = object.computed.map_or(String::new(), |computed| {
            let guess = 100.0 * (object.share(Certainty::Ambiguous) + object.share(Certainty::Contradicted));
            format!(
                "; depth computed from the pictures on {:.0} % of the object's pixels, {guess:.0} % of the surface a guess for want of texture",
                100.0 * computed.share
            )
        });
        format!(
            "{}: {:.0} x {:.0} x {:.0} mm, {:.1} cm^3, closed{base}, genus {}, {} convex pieces{depth}; held-out views {:.1} dB inside the mask, \
             {:.1} dB by {} splats; see {}",
            self.outputs.out.display(),
            size.x,
            size.y,
            size.z,
            object.solid.volume * 1e6,
            object.topology.genus,
            pieces,
            object.psnr(),
            object.psnr_splats(),
            object.splats.splats.len(),
            self.outputs.out.join("report.html").display()
        )
    }
}
