//! `calibration export-model`.

use super::print;
use crate::model::{self, Base, Format, LeftOut, Line, Look, ModelFile};
use clap::{Args, ValueEnum};
use serde::Serialize;
use shared_mem::answer;
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::output::Destination;
use shared_mem::theta::Theta;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = "\
What was identified and diagnosed, in the keys of your simulator: rotor inertia, friction and limits of the joints,
gains and delay of the controller, loads, the object's mass, inertia and friction, the contact of tip and object, the
camera's true place. The file loads as it stands; above each number a comment says what it is, its unit and where it comes
from. With --base a model of your own is brought up to date: by the names of its joints, its shapes, names, order of controls and
keyframes kept, wherever its base stands (docs/export_model.md).

What the format has no key for is left out: it is named in the file, here, and in --json. Without a theta.toml the
numbers are those of cell.toml.

Examples:
  calibration export-model session --to mjcf --out cell.xml
  calibration export-model theta.toml --cell cell.toml --to urdf --out arm.urdf
  calibration export-model session --parameters theta.toml --to sdf --out world.sdf --json
  calibration export-model session --to mjcf --meshes meshes --out cell.xml
  calibration export-model session --to mjcf --base lab.xml --out lab_found.xml
  calibration export-model session --to mjcf --base two_arms.xml --base-joints l1,l2,l3,l4,l5,l6,l7 --out found.xml

JSON: to, file, lines [{of, what, values, unit, from}], left_out [{what, why}].")]
pub struct ExportModelArguments {
    /// Session folder, or a theta.toml.
    #[arg(value_name = "SESSION|THETA.TOML")]
    from: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml in the session, or beside theta.toml].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// What was identified in the session [default: theta.toml in its folder, where there is one].
    #[arg(long, value_name = "THETA.TOML")]
    parameters: Option<PathBuf>,
    /// The format.
    #[arg(long, value_enum)]
    to: Target,
    /// Your own model of the arm, MJCF or URDF: the answer is this model with what is known of the cell in it, its names, the order of its
    /// controls and its keyframes kept.
    #[arg(long, value_name = "MODEL")]
    base: Option<PathBuf>,
    /// Joints of --base that are the cell's, from base to flange [default: those of the same names].
    #[arg(long, requires = "base", value_name = "NAME,...", value_delimiter = ',')]
    base_joints: Vec<String>,
    /// Puts the arm's shape into this folder, an STL for every visible part, and shows it in the model: in MJCF with light, floor and a
    /// keyframe `home`.
    #[arg(long, value_name = "DIR", conflicts_with = "base", requires = "out")]
    meshes: Option<PathBuf>,
    /// Where the model goes [default: standard output].
    #[arg(long, value_name = "MODEL")]
    out: Option<PathBuf>,
    /// Replaces the file of --out and the meshes of --meshes.
    #[arg(long, requires = "out")]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long, requires = "out")]
    json: bool,
}

/// Formats by their names on the command line.
#[derive(Debug, Clone, Copy, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Target {
    /// MuJoCo.
    Mjcf,
    /// ROS: the arm alone.
    Urdf,
    /// Gazebo.
    Sdf,
}

#[derive(Serialize)]
struct Answer<'a> {
    to: Target,
    file: &'a Path,
    lines: &'a [Line],
    left_out: &'a [LeftOut],
}

pub(super) fn run(arguments: &ExportModelArguments) -> anyhow::Result<()> {
    let ExportModelArguments { from, cell, parameters, to, base, base_joints, meshes, out, force, json } = arguments;
    anyhow::ensure!(
        meshes.is_none() || !matches!(to, Target::Sdf),
        "--meshes shows the arm in MJCF and URDF; give --to mjcf, or leave --meshes out"
    );
    let place = Destination::of(out.as_deref(), *force)?;
    let is_session = from.is_dir();
    let folder = if is_session { from.as_path() } else { from.parent().unwrap_or(Path::new("")) };
    anyhow::ensure!(from.exists(), "there is no {}; give a session folder or a theta.toml", from.display());
    let stated = cell.clone().unwrap_or_else(|| folder.join("cell.toml"));
    anyhow::ensure!(
        cell.is_some() || stated.is_file(),
        "there is no {}; say with --cell which cell.toml it is",
        stated.display()
    );
    let cell = Cell::read(&stated)?;
    let beside = folder.join("theta.toml");
    let theta = match parameters {
        Some(file) => Theta::read(file)?,
        None if !is_session => Theta::read(from)?,
        None if beside.is_file() => Theta::read(&beside)?,
        None => Theta::default(),
    }
    .about(&cell);
    let format = match to {
        Target::Mjcf => Format::Mjcf,
        Target::Urdf => Format::Urdf,
        Target::Sdf => Format::Sdf,
    };
    let base = base.as_deref().map(|file| Base { file, joints: base_joints, out: out.as_deref() });
    let ModelFile { text, lines, left_out } = match &base {
        Some(base) => model::write_into(&cell, &theta, format, base)?,
        None => {
            let of = |folder: &PathBuf| Look::of(&cell, folder, out.as_deref().unwrap_or(Path::new("")));
            let look = meshes.as_ref().map(of).transpose()?;
            let file = model::write(&cell, &theta, format, look.clone())?;
            look.map_or(Ok(()), |look| look.write(*force))?;
            file
        }
    };
    let Some(place) = place else {
        left_out.iter().for_each(|LeftOut { what, why }| console::line(format_args!("left out: {what}: {why}")));
        return Ok(answer::bytes(text.as_bytes())?);
    };
    place.write(text)?;
    let mut words = format!("{} numbers in {}", lines.len(), place.path().display());
    for LeftOut { what, why } in &left_out {
        words += &format!("\nleft out: {what}: {why}");
    }
    print(*json, &Answer { to: *to, file: place.path(), lines: &lines, left_out: &left_out }, words)
}
