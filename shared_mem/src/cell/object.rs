//! `[object]`, or one of `[[object]]`: what stands on the table, and how well it is known.

use super::ranges::Range;
use super::within;
use crate::msg::object::{NAME_LENGTH, is_object_name};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The object. Ranges say where a parameter may lie; a plain `mass` says that it was weighed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "an [object] block")]
pub struct Object {
    /// Its name, of letters, digits and `_`: in topics (`/object/NAME/pose`) and theta.toml. Needed where there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Topic of a ROS 2 bag with its poses; by default `/object/NAME/pose`, without a name `object_pose` of `[topics]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub topic: Option<String>,
    /// `"box"`, with its `size`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<String>,
    /// Mesh file (obj, stl, ply), relative to cell.toml, instead of `shape`. Where in the file the origin lies does not matter:
    /// the object's is the geometric centre, the middle of the mesh's bounding box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<PathBuf>,
    /// URDF file of an object that moves in itself, relative to cell.toml, instead of `shape` or `mesh`: a laptop, a drawer. Needs a
    /// `name`; its links are `NAME_LINK` beside the root, which is `NAME`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf: Option<PathBuf>,
    /// Of the root of a `urdf`.
    #[serde(default, skip_serializing_if = "RootHold::is_free")]
    pub hold: RootHold,
    /// Where the joints of a `urdf` start in the simulated cell, by name [rad or m]; by default 0, or the limit nearest to it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joints: BTreeMap<String, f64>,
    /// Gaussian splats in the object's frame (3DGS PLY, or SuperSplat's compressed PLY), relative to cell.toml: pictures show them
    /// in place of `shape` or `mesh`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub splats: Option<PathBuf>,
    /// Edge lengths along the object's x, y, z [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 3]>,
    /// Where it starts in the simulated cell: x, y of the geometric centre in the base frame [m]. By default the first object is
    /// where `[simulation]` says, each other one 5 cm beside the one before it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<[f64; 2]>,
    /// Its rotation about z there [rad].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_yaw: Option<f64>,
    /// How the base carries the load.
    #[serde(default)]
    pub support: Support,
    /// Mass, where it was weighed [kg].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Where the mass may lie [kg].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_range: Option<Range>,
    /// Where the friction on the table may lie.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_range: Option<Range>,
    /// Where the centre of mass may lie, from the geometric centre along the object's axes [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_of_mass_range: Option<[Range; 3]>,
    /// Where the friction against the tool may lie.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tip_friction_range: Option<Range>,
    /// Where the restitution against the table may lie.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restitution_range: Option<Range>,
    /// From clip to clip: one sigma of ln(mu).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_scatter: Option<f64>,
    /// Noise of the tracker, one sigma.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_noise: Option<PoseNoise>,
}

/// What holds the root of an object that moves in itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RootHold {
    /// Nothing: it stands on the table.
    #[default]
    Free,
    /// It cannot move, as a drawer's cabinet.
    Fixed,
}

impl RootHold {
    fn is_free(&self) -> bool {
        *self == Self::Free
    }
}

/// How the base carries the load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Support {
    /// On its corners.
    #[default]
    Corners,
    /// Evenly over the base.
    Uniform,
    /// On the rim of the base.
    Ring,
}

/// Noise of the tracker, one sigma.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table of position [m] and rotation [rad]")]
pub struct PoseNoise {
    /// Of each coordinate [m].
    pub position: f64,
    /// About each axis [rad].
    pub rotation: f64,
}

impl Object {
    pub(super) fn check(&self) -> Result<(), String> {
        if let Some(name) = &self.name {
            check_name(name)?;
        }
        if self.urdf.is_some() {
            self.check_articulated()?;
        } else if self.hold != RootHold::Free || !self.joints.is_empty() {
            return Err("`object.hold` and `object.joints` are of an object with `urdf`; leave them out".into());
        }
        match (&self.shape, &self.mesh) {
            (None, None) if self.urdf.is_some() => {}
            _ if self.urdf.is_some() => {
                return Err("`object.urdf` stands in place of `shape` and `mesh`; leave those out".into());
            }
            (Some(shape), None) if shape == "box" => {
                let size = self.size.ok_or("`[object] shape = \"box\"` needs `size = [x, y, z]` in metres")?;
                within("object.size", &size, 1e-3, 10.0)?;
            }
            (None, Some(_)) => {}
            (Some(shape), None) => {
                return Err(format!(
                    "`object.shape = \"{shape}\"` is not known; use \"box\" with `size`, or `mesh = \"file\"`"
                ));
            }
            _ => {
                return Err(
                    "`[object]` needs exactly one of `shape = \"box\"`, `mesh = \"file\"` and `urdf = \"file\"`".into(),
                );
            }
        }
        within("object.start", self.start.as_ref().map_or(&[], |start| &start[..]), -10.0, 10.0)?;
        within("object.start_yaw", self.start_yaw.as_slice(), -10.0, 10.0)?;
        if let Some(mass) = self.mass {
            within("object.mass", &[mass], 1e-4, 1e3)?;
        }
        let ranges = [
            ("object.mass_range", self.mass_range),
            ("object.friction_range", self.friction_range),
            ("object.tip_friction_range", self.tip_friction_range),
            ("object.restitution_range", self.restitution_range),
        ];
        for (key, range) in ranges {
            if let Some([lo, hi]) = range
                && !(lo >= 0.0 && hi >= lo && hi.is_finite())
            {
                return Err(format!("`{key}` must be [low, high] with 0 <= low <= high"));
            }
        }
        Ok(())
    }

    fn check_articulated(&self) -> Result<(), String> {
        if self.name.is_none() {
            return Err("an `[object]` with `urdf` needs a `name`; its links are called NAME_LINK".into());
        }
        let of_rigid = [
            ("size", self.size.is_some()),
            ("splats", self.splats.is_some()),
            ("mass", self.mass.is_some()),
            ("mass_range", self.mass_range.is_some()),
            ("centre_of_mass_range", self.centre_of_mass_range.is_some()),
        ];
        if let Some((key, _)) = of_rigid.into_iter().find(|(_, given)| *given) {
            return Err(format!(
                "`object.{key}` is of a rigid object; leave it out, the links of `urdf` have their own"
            ));
        }
        match self.joints.iter().find(|(_, position)| !position.is_finite()) {
            Some((joint, position)) => {
                Err(format!("`object.joints` puts `{joint}` at {position}; give radians or metres"))
            }
            None => Ok(()),
        }
    }

    /// Mass to simulate with when nothing was identified: the weighed one, else the middle of its range, else a homogeneous 500 kg/m³ [kg].
    pub fn nominal_mass(&self) -> f64 {
        self.mass
            .or_else(|| self.mass_range.map(middle))
            .or_else(|| self.size.map(|s| 500.0 * s.iter().product::<f64>()))
            .unwrap_or(0.3)
    }

    /// Friction on the table when nothing was identified: the middle of its range, else 0.3.
    pub fn nominal_friction(&self) -> f64 {
        self.friction_range.map_or(0.3, middle)
    }

    /// Friction against the tool when nothing was identified: the middle of its range, else 0.2.
    pub fn nominal_tip_friction(&self) -> f64 {
        self.tip_friction_range.map_or(0.2, middle)
    }

    /// Restitution against the table when nothing was identified: the middle of its range, else 0.
    pub fn nominal_restitution(&self) -> f64 {
        self.restitution_range.map_or(0.0, middle)
    }
}

fn check_name(name: &str) -> Result<(), String> {
    if !is_object_name(name) {
        return Err(format!("`object.name = {name:?}` is no name; use up to {NAME_LENGTH} letters, digits and _"));
    }
    match name {
        "pose" | "target" => Err(format!("`object.name = \"{name}\"` is part of a topic; give it another name")),
        _ => Ok(()),
    }
}

fn middle([lo, hi]: Range) -> f64 {
    0.5 * (lo + hi)
}
