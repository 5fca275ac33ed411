//! Object, contacts and camera in MJCF.

use super::super::cell_model::{CameraModel, CellModel, Object};
use super::super::known::{Line, number, numbers};
use super::{File, STEP, full, quaternion};
use nalgebra::{UnitQuaternion, Vector3};

/// Where the object stands on the table, for whoever uses the file to change [m].
pub(super) const OBJECT_AT: [f64; 2] = [0.5, 0.0];
/// Radius of the spheres on which the object stands [m].
const FOOT: f64 = 5e-4;
/// `solimp` of contacts: as hard as the solver stays calm with.
const HARD: &str = "0.98 0.995 0.0005";
/// Of the contact of feet and table [s]: nothing bounces there.
const FOOT_TIME: f64 = 2e-3;

impl File {
    pub(super) fn meshes(&mut self, model: &CellModel) {
        let hull = model.object.as_ref().filter(|object| object.half_extents.is_none());
        if hull.is_none() && model.look.is_none() {
            return;
        }
        self.sheet.xml.open("asset", &[]);
        if let Some(object) = hull {
            let corners = object.outline.corners.iter().flat_map(|corner| corner.iter().copied());
            self.sheet.xml.comment("convex hull of the object's mesh around its geometric centre [m], from cell.toml");
            self.sheet.xml.leaf("mesh", &[("name", "object".into()), ("vertex", numbers(corners))]);
        }
        self.files_of_shapes(model);
        self.sheet.xml.close();
    }

    pub(super) fn object(&mut self, object: &Object, table: f64) {
        let outline = &object.outline;
        let lines = [
            self.sheet.note("mass", Line::new("object", "mass", "kg", &object.mass)),
            self.sheet.note(
                "pos",
                Line {
                    values: object.centre_of_mass.iter().map(|c| c.value).collect(),
                    ..Line::new("object", "centre of mass from the geometric centre", "m", &object.centre_of_mass[0])
                },
            ),
            self.sheet.note(
                "fullinertia",
                Line {
                    values: vec![outline.inertia[(0, 0)], outline.inertia[(1, 1)], outline.inertia[(2, 2)]],
                    ..Line::new("object", "inertia about the centre of mass: xx, yy, zz", "kg m^2", &object.inertia)
                },
            ),
        ];
        self.sheet
            .xml
            .comment("the object; its frame is its geometric centre, and its place here is for you to choose");
        self.sheet.xml.open(
            "body",
            &[("name", "object".into()), ("pos", numbers([OBJECT_AT[0], OBJECT_AT[1], table + outline.depth]))],
        );
        self.sheet.xml.leaf("freejoint", &[("name", "object".into())]);
        lines.iter().for_each(|line| self.sheet.xml.comment(line));
        self.sheet.xml.leaf(
            "inertial",
            &[
                ("mass", number(object.mass.value)),
                ("pos", numbers(object.centre_of_mass.iter().map(|c| c.value))),
                ("fullinertia", full(&outline.inertia)),
            ],
        );
        match object.half_extents {
            Some(half) => self.sheet.xml.leaf(
                "geom",
                &[("name", "object".into()), ("type", "box".into()), ("size", numbers(half.iter().copied()))],
            ),
            None => self
                .sheet
                .xml
                .leaf("geom", &[("name", "object".into()), ("type", "mesh".into()), ("mesh", "object".into())]),
        }
        let reach = self
            .sheet
            .note("pos", Line::new("object", "where the base presses, over cell.toml's `support`", "1", &object.reach));
        self.sheet.xml.comment(&format!("feet, {reach}"));
        for (i, (foot, _)) in outline.places.iter().enumerate() {
            self.sheet.xml.leaf(
                "geom",
                &[
                    ("name", format!("object_foot_{i}")),
                    ("type", "sphere".into()),
                    ("size", number(FOOT)),
                    ("pos", numbers([foot.x, foot.y, FOOT - outline.depth])),
                ],
            );
        }
        self.sheet.xml.close();
        if outline.places.len() > 4 {
            self.sheet.lacks(
                "how the load is shared between the places of the base",
                "MuJoCo finds the load of each foot itself; with more than four it is one of many answers",
            );
        }
    }

    pub(super) fn contacts(&mut self, model: &CellModel) {
        let Some(object) = &model.object else { return };
        self.sheet.xml.open("contact", &[]);
        if model.arm.as_ref().is_some_and(|arm| arm.tool.is_some() && arm.has_geometry) {
            let mu = object.tip_friction.value;
            let friction = self.sheet.note(
                "friction",
                Line::new("tool, object", "Coulomb friction of tip and object", "1", &object.tip_friction),
            );
            let (frequency, ratio) = (object.hit.frequency(), object.hit.damping_ratio());
            let (time, from) = ((ratio * frequency).recip(), &object.hit_from);
            let hit = Line {
                values: vec![time, ratio],
                ..Line::new("tool, object", "time constant [s] and damping ratio of the contact", "1", from)
            };
            let hit = self.sheet.note("solref", hit);
            self.sheet.xml.comment(&friction);
            self.sheet.xml.comment(&format!(
                "{hit}: stiffness {} N/m with the object's mass, restitution {}",
                number(object.law.stiffness),
                number(object.law.restitution)
            ));
            self.pair("tool", "object", [mu, mu], &format!("{} {}", number(time), number(ratio)));
        }
        if model.table.is_some() {
            let [x, y] = [&object.friction[0], &object.friction[1]];
            let line = Line {
                values: vec![x.value, y.value],
                ..Line::new("object, table", "Coulomb friction of object and table along x and along y", "1", x)
            };
            let comment = self.sheet.note("friction", line);
            self.sheet.xml.comment(&format!("{comment}; MuJoCo's first axis on a level table is y"));
            for i in 0..object.outline.places.len() {
                self.pair(
                    &format!("object_foot_{i}"),
                    "table",
                    [y.value, x.value],
                    &format!("{} 1", number(FOOT_TIME)),
                );
            }
        }
        self.sheet.xml.close();
    }

    fn pair(&mut self, one: &str, other: &str, [first, second]: [f64; 2], solref: &str) {
        self.sheet.xml.leaf(
            "pair",
            &[
                ("name", format!("{one}-{other}")),
                ("geom1", one.into()),
                ("geom2", other.into()),
                ("condim", "3".into()),
                ("friction", format!("{} {} 1e-6 1e-6 1e-6", number(first.max(1e-6)), number(second.max(1e-6)))),
                ("solref", solref.into()),
                ("solimp", HARD.into()),
            ],
        );
    }

    pub(super) fn camera(&mut self, model: &CameraModel) {
        let (camera, pinhole) = (&model.camera, model.camera.pinhole());
        // MuJoCo's camera looks along -z with y up; an optical frame along z with y down.
        let turned = model.pose.rotation * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let line = Line {
            values: model.pose.translation.vector.iter().copied().collect(),
            ..Line::new("camera", "where the camera truly stands, in the base frame", "m", &model.pose_from)
        };
        let comment = self.sheet.note("pos", line);
        self.sheet.xml.comment(&comment);
        let fovy = 2.0 * (0.5 * f64::from(camera.height) / pinhole.fy).atan().to_degrees();
        self.sheet.xml.comment("quat: along -z with y up; fovy [degrees], from cell.toml");
        self.sheet.xml.leaf(
            "camera",
            &[
                ("name", "camera".into()),
                ("pos", numbers(model.pose.translation.vector.iter().copied())),
                ("quat", quaternion(&turned)),
                ("fovy", number(fovy)),
                ("resolution", format!("{} {}", camera.width, camera.height)),
            ],
        );
        let middle = [0.5 * f64::from(camera.width - 1), 0.5 * f64::from(camera.height - 1)];
        let off = (pinhole.cx - middle[0]).abs().max((pinhole.cy - middle[1]).abs());
        if off > 1.0 || (pinhole.fx - pinhole.fy).abs() > 1e-3 * pinhole.fy || camera.distortion.is_bent() {
            self.sheet.lacks(
                "the camera's principal point, distortion and unequal focal lengths",
                "fovy stands for a pinhole in the middle of the picture: correct the pictures instead",
            );
        }
    }

    pub(super) fn sensors(&mut self, model: &CellModel) {
        if model.object.is_none() {
            if model.latency.is_known() {
                let latency = number(model.latency.value);
                self.sheet
                    .lacks(format!("latency of poses {latency} s"), "cell.toml has no object whose pose could be late");
            }
            return;
        }
        self.sheet.xml.open("sensor", &[]);
        let mut late = Vec::new();
        if model.latency.is_known() {
            let delay = model.latency.value;
            let comment = self.sheet.note(
                "delay",
                Line::new("object", "how much older a tracked pose is than its stamp", "s", &model.latency),
            );
            self.sheet
                .xml
                .comment(&format!("{comment}; nsample: room for it at this file's timestep (MuJoCo 3.5 or newer)"));
            late.extend([("delay", number(delay)), ("nsample", format!("{}", (delay / STEP).ceil() as u64 + 2))]);
        }
        for (key, name) in [("framepos", "object_position"), ("framequat", "object_orientation")] {
            let mut attributes =
                vec![("name", name.to_owned()), ("objtype", "xbody".into()), ("objname", "object".into())];
            attributes.extend(late.iter().cloned());
            self.sheet.xml.leaf(key, &attributes);
        }
        self.sheet.xml.close();
    }
}
