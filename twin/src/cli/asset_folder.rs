//! Folders of assets that the verbs of `twin reconstruct` fill, and the numbers that these take.

use nalgebra::Point3;
use reconstruct::assets;
use reconstruct::mesh::Mesh;
use reconstruct::scan::Frame;
use shared_mem::output::OutputFolder;
use shared_mem::quantity::number;
use splat::SplatCloud;
use std::path::{Path, PathBuf};

/// Where a command of these writes.
#[derive(clap::Args)]
pub(super) struct Outputs {
    /// New folder for the files
    #[arg(long, value_name = "FOLDER")]
    pub(super) out: PathBuf,
    /// Replaces a folder that an earlier run has made
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end
    #[arg(long)]
    pub(super) json: bool,
}

/// What goes to other trainers of splats.
#[derive(clap::Args)]
pub(super) struct Dataset {
    /// Adds dataset/ for other trainers of splats, as brush: pictures with alpha, a COLMAP model, init.ply
    #[arg(long)]
    dataset: bool,
}

impl Dataset {
    /// Files of the dataset, where it is wanted, with `origin` as that of its frame.
    pub(super) fn files(&self, train: &[Frame], splats: &SplatCloud, origin: &Point3<f64>) -> Vec<(PathBuf, Vec<u8>)> {
        if self.dataset { assets::dataset_files(train, splats, origin) } else { Vec::new() }
    }
}

impl Outputs {
    /// The folder to fill. One of another command, without the file that comes last, is never replaced.
    pub(super) fn folder(&self, last: &str) -> anyhow::Result<OutputFolder> {
        if self.force && self.out.join(last).is_file() {
            return Ok(OutputFolder::replacing(&self.out)?);
        }
        Ok(OutputFolder::create(&self.out)?)
    }
}

/// Where an interrupted run leaves what it has: beside the folder.
pub(super) fn kept(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".state");
    PathBuf::from(name)
}

/// Metres for one unit of a scan, as an argument.
pub(super) fn metres(text: &str) -> Result<f64, String> {
    number(text, 1e-6..=1e3, "m")
}

/// A mass, as an argument.
pub(super) fn mass(text: &str) -> Result<f64, String> {
    number(text, 1e-4..=1e3, "kg")
}

/// A convex piece as a mesh.
pub(super) fn piece((points, triangles): (Vec<Point3<f64>>, Vec<[u32; 3]>)) -> Mesh {
    Mesh { points, triangles }
}
