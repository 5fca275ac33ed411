//! The numbers of an object with a part that moves.

use super::{LINKS, in_frame, links_from_mesh};
use crate::articulated::{Articulated, Joint};
use crate::assets::{DENSITY, Labels};
use crate::mesh::{Solid, Topology};
use serde::Serialize;

/// Evidence below this (difference of BIC) is none.
const CLEAR: f64 = 10.0;
/// Standard deviations above these are remarked: direction [rad], place [m].
const UNSURE: [f64; 2] = [0.0175, 3e-3];

/// The numbers of an object with a part that moves.
#[derive(Debug, Clone, Serialize)]
pub struct ArticulatedSummary {
    pub name: String,
    pub joint: JointNumbers,
    /// Base and part.
    pub parts: [PartNumbers; 2],
    /// Whether it was weighed; else masses are the volume's at [`DENSITY`].
    pub weighed: bool,
    /// Lowest z of the base in its frame [m].
    pub low_m: f64,
    /// What a person should know.
    pub remarks: Vec<String>,
}

/// The joint in the base's frame, the part's frame on it.
#[derive(Debug, Clone, Serialize)]
pub struct JointNumbers {
    /// `revolute` or `prismatic`.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// Place of the part's frame at position 0 [m].
    pub origin_m: [f64; 3],
    /// Direction; the part turns right-handed about it or slides along it.
    pub axis: [f64; 3],
    /// Least and largest position [rad or m]; 0 is the first state.
    pub limits: [f64; 2],
    /// Where the joint was in the scan that the meshes are of [rad or m].
    pub position: f64,
    /// How much worse the other kind of joint explains two states (difference of BIC); `null` where it was given.
    pub evidence: Option<f64>,
    /// Standard deviation of the direction [rad].
    pub direction_sd_rad: Option<f64>,
    /// Standard deviation of the hinge's place across its axis [m].
    pub place_sd_m: Option<f64>,
    /// Standard deviation of the travel [rad or m].
    pub travel_sd: Option<f64>,
    /// Noise of both surfaces together, standard deviation [m].
    pub noise_m: Option<f64>,
    /// Share of both surfaces that neither stays nor moves along.
    pub unexplained: Option<f64>,
}

/// The numbers of a part, in its link's frame.
#[derive(Debug, Clone, Serialize)]
pub struct PartNumbers {
    pub link: &'static str,
    /// Volume [m³].
    pub volume_m3: f64,
    /// Mass [kg].
    pub mass_kg: f64,
    /// Centre of mass, as if of one material [m].
    pub centre_of_mass_m: [f64; 3],
    /// Inertia about it: xx, xy, xz, yy, yz, zz [kg m²].
    pub inertia_kg_m2: [f64; 6],
    /// The fine mesh.
    pub surface: Topology,
}

impl ArticulatedSummary {
    /// The numbers of an object; a mass that was weighed is shared out by volume.
    pub fn of(object: &Articulated, labels: &Labels) -> Self {
        let frames = links_from_mesh(object);
        let both = [&object.base, &object.part];
        let solids = [0, 1].map(|number| Solid::of(&in_frame(&both[number].fine, &frames[number])));
        let density = labels.mass.map_or(DENSITY, |mass| mass / (solids[0].volume + solids[1].volume));
        let parts = [0, 1].map(|number| {
            let solid = &solids[number];
            let inertia = solid.unit_inertia * (density * solid.volume);
            PartNumbers {
                link: LINKS[number],
                volume_m3: solid.volume,
                mass_kg: density * solid.volume,
                centre_of_mass_m: solid.centroid.coords.into(),
                inertia_kg_m2: [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| inertia[at]),
                surface: both[number].topology,
            }
        });
        let sure = object.certainty;
        let joint = JointNumbers {
            kind: match object.joint {
                Joint::Revolute { .. } => "revolute",
                Joint::Prismatic { .. } => "prismatic",
            },
            origin_m: super::origin(object, &object.joint.by(-object.position)).coords.into(),
            axis: object.joint.direction().into_inner().into(),
            limits: object.limits,
            position: object.position,
            evidence: sure.map(|sure| sure.evidence).filter(|evidence| evidence.is_finite()),
            direction_sd_rad: sure.map(|sure| sure.direction),
            place_sd_m: sure.map(|sure| sure.place),
            travel_sd: sure.map(|sure| sure.travel),
            noise_m: sure.map(|sure| sure.noise),
            unexplained: sure.map(|sure| sure.unexplained),
        };
        let remarks = remarks(&joint);
        let low_m = object.base.fine.bounds().0.z;
        Self { name: labels.name.clone(), joint, parts, weighed: labels.mass.is_some(), low_m, remarks }
    }

    pub(super) fn json(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec_pretty(self).unwrap_or_default();
        bytes.push(b'\n');
        bytes
    }
}

fn remarks(joint: &JointNumbers) -> Vec<String> {
    let mut remarks = Vec::new();
    if joint.evidence.is_some_and(|evidence| evidence < CLEAR) {
        let other = if joint.kind == "revolute" { "a slide" } else { "a hinge far away" };
        remarks.push(format!(
            "The two states are explained by {other} nearly as well: they are near to each other. A state that is further open decides."
        ));
    }
    let unsure = |sd: Option<f64>, most: f64| sd.is_some_and(|sd| sd > most);
    if unsure(joint.direction_sd_rad, UNSURE[0]) || unsure(joint.place_sd_m, UNSURE[1]) {
        remarks.push(format!(
            "The axis is known to {:.1} degrees and {:.1} mm only (standard deviations): open the part further between the scans.",
            joint.direction_sd_rad.unwrap_or(0.0).to_degrees(),
            joint.place_sd_m.unwrap_or(0.0) * 1e3
        ));
    }
    remarks
}
