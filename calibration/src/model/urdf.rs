//! URDF: arm, tool and loads. It knows neither controllers nor contacts nor objects: what of them was found is left out, and said.

use super::cell_model::{Arm, CellModel, Joint};
use super::known::{LEAST_MOMENT, Line, number, numbers};
use super::sheet::{Lacking, Sheet};
use nalgebra::{Isometry3, Vector3};
use twin::arm::MassProperties;

/// The file, what stands in it, and what it cannot hold.
pub(super) fn write(model: &CellModel) -> Sheet {
    let mut file = File { sheet: Sheet::new() };
    file.sheet.xml.open("robot", &[("name", "cell".into())]);
    if let Some(arm) = &model.arm {
        file.arm(arm, model);
        file.lacks_of_arm(arm);
    }
    if let Some(camera) = &model.camera {
        let base = model.arm.as_ref().map_or("base", |arm| arm.base_frame.as_str());
        let at = camera.pose;
        let line = Line::list(
            "camera",
            "where the camera truly stands",
            "m",
            &[at.translation.x, at.translation.y, at.translation.z],
            &camera.pose_from.sources(),
        );
        let comment = file.sheet.note("origin", line);
        file.sheet.xml.comment(&format!("{comment}; an optical frame: z forward, x right, y down"));
        file.fixed("camera_optical_joint", base, "camera_optical_frame", &at);
        file.sheet.xml.leaf("link", &[("name", "camera_optical_frame".into())]);
    }
    file.lacks_of_cell(model);
    file.sheet
}

struct File {
    sheet: Sheet,
}

fn origin(at: &Isometry3<f64>) -> [(&'static str, String); 2] {
    let (roll, pitch, yaw) = at.rotation.euler_angles();
    [("xyz", numbers(at.translation.vector.iter().copied())), ("rpy", numbers([roll, pitch, yaw]))]
}

impl File {
    fn arm(&mut self, arm: &Arm, model: &CellModel) {
        let nothing = MassProperties::default();
        self.link(&arm.base_frame, &nothing, model, Some(0));
        let mut before = arm.base_frame.as_str();
        for (place, joint) in arm.joints.iter().enumerate() {
            // Where only names are known, each joint stands for itself.
            let parent = if arm.has_geometry { before } else { arm.base_frame.as_str() };
            self.joint(joint, parent);
            self.link(&joint.part.link, &joint.part.body, model, Some(place + 1));
            before = &joint.part.link;
        }
        if !arm.has_geometry {
            self.sheet.lacks("links and tool", "only the joints' names are known");
            return;
        }
        self.fixed("flange_joint", before, "flange", &arm.flange);
        self.sheet.xml.leaf("link", &[("name", "flange".into())]);
        if let Some(tool) = &arm.tool {
            let at = Vector3::from([0, 1, 2].map(|i| arm.tool_at[i].value));
            self.sheet.xml.comment("the tool: a capsule along the flange's z axis, mass [kg], from cell.toml");
            if let Some(known) = arm.tool_at.iter().find(|known| known.is_known()) {
                let sources = known.sources();
                let line = Line::list("tool", "place of the tool in the flange frame", "m", at.as_slice(), &sources);
                let comment = self.sheet.note("origin", line);
                self.sheet.xml.comment(&comment);
            }
            self.fixed("tool_joint", "flange", "tool", &Isometry3::translation(at.x, at.y, at.z));
            let properties = MassProperties::of_tool(tool);
            let centre = properties.centre + at * (arm.carried - 1.0);
            self.link("tool", &MassProperties { centre, ..properties }, model, Some(arm.joints.len() + 1));
        }
        for load in &arm.loads {
            let name = load.name.as_str();
            let comment = self
                .sheet
                .note("mass", Line::new(name, "a load that the controller does not compensate", "kg", &load.mass));
            self.sheet.xml.comment(&format!("{name} {comment}; origin [m] in the flange frame"));
            self.fixed(&format!("{name}_joint"), "flange", name, &Isometry3::identity());
            let point = MassProperties::new(load.mass.value, load.centre, [1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0]);
            self.link(name, &point, model, None);
        }
    }

    fn fixed(&mut self, name: &str, parent: &str, child: &str, at: &Isometry3<f64>) {
        self.sheet.xml.open("joint", &[("name", name.into()), ("type", "fixed".into())]);
        self.sheet.xml.leaf("parent", &[("link", parent.into())]);
        self.sheet.xml.leaf("child", &[("link", child.into())]);
        self.sheet.xml.leaf("origin", &origin(at));
        self.sheet.xml.close();
    }

    /// A link, with what is seen on it where that has a place among the arm's.
    fn link(&mut self, name: &str, body: &MassProperties, model: &CellModel, place: Option<usize>) {
        self.sheet.xml.open("link", &[("name", name.into())]);
        if body.mass > 0.0 || body.inertia.norm() > 0.0 {
            let body = body.with_moments_from(LEAST_MOMENT);
            let i = |r: usize, c: usize| number(body.inertia[(r, c)]);
            self.sheet.xml.open("inertial", &[]);
            self.sheet
                .xml
                .leaf("origin", &origin(&Isometry3::translation(body.centre.x, body.centre.y, body.centre.z)));
            self.sheet.xml.leaf("mass", &[("value", number(body.mass))]);
            self.sheet.xml.leaf(
                "inertia",
                &[
                    ("ixx", i(0, 0)),
                    ("iyy", i(1, 1)),
                    ("izz", i(2, 2)),
                    ("ixy", i(0, 1)),
                    ("ixz", i(0, 2)),
                    ("iyz", i(1, 2)),
                ],
            );
            self.sheet.xml.close();
        }
        for part in place.into_iter().flat_map(|place| model.look.iter().flat_map(move |look| look.on(place))) {
            self.sheet.xml.open("visual", &[]);
            self.sheet.xml.leaf("origin", &origin(&part.in_link));
            self.sheet.xml.open("geometry", &[]);
            self.sheet.xml.leaf("mesh", &[("filename", part.file.clone())]);
            self.sheet.xml.close();
            self.sheet.xml.open("material", &[("name", part.name.clone())]);
            self.sheet.xml.leaf("color", &[("rgba", numbers(part.rgba()))]);
            self.sheet.xml.close();
            self.sheet.xml.close();
        }
        self.sheet.xml.close();
    }

    fn joint(&mut self, joint: &Joint, parent: &str) {
        let part = &joint.part;
        let name = part.joint.as_str();
        let bounded = part.range.iter().all(|end| end.is_finite());
        let kind = match (part.slides, bounded) {
            (true, _) => "prismatic",
            (false, true) => "revolute",
            (false, false) => "continuous",
        };
        self.sheet.xml.open("joint", &[("name", name.into()), ("type", kind.into())]);
        self.sheet.xml.leaf("parent", &[("link", parent.into())]);
        self.sheet.xml.leaf("child", &[("link", part.link.clone())]);
        self.sheet.xml.leaf("origin", &origin(&part.origin));
        self.sheet.xml.leaf("axis", &[("xyz", numbers(part.axis.iter().copied()))]);
        let values = [
            ("damping", "viscous friction", "N m s/rad", &joint.damping),
            ("friction", "dry friction", "N m", &joint.dry),
        ];
        let mut dynamics = Vec::new();
        for (key, what, unit, known) in values {
            if known.is_known() {
                let comment = self.sheet.note(key, Line::new(name, what, unit, known));
                self.sheet.xml.comment(&format!("{name} {comment}"));
                dynamics.push((key, number(known.value)));
            }
        }
        if !dynamics.is_empty() {
            self.sheet.xml.leaf("dynamics", &dynamics);
        }
        let finite = |value: f64| value.is_finite().then(|| number(value));
        let mut limit = Vec::new();
        if bounded {
            limit.extend([("lower", number(part.range[0])), ("upper", number(part.range[1]))]);
        }
        if joint.torque_limit.is_known() && joint.torque_limit.value.is_finite() {
            let comment =
                self.sheet.note("effort", Line::new(name, "largest torque of the motor", "N m", &joint.torque_limit));
            self.sheet.xml.comment(&format!("{name} {comment}"));
        }
        // URDF asks for both where there is a limit at all.
        limit.push((
            "effort",
            finite(joint.torque_limit.value).filter(|_| joint.torque_limit.is_known()).unwrap_or_else(|| "1000".into()),
        ));
        limit.push(("velocity", finite(part.velocity).unwrap_or_else(|| "100".into())));
        self.sheet.xml.leaf("limit", &limit);
        self.sheet.xml.close();
    }

    /// What was found or stated of the arm and has no key here.
    fn lacks_of_arm(&mut self, arm: &Arm) {
        let lists: [Lacking; 6] = [
            (
                "armature",
                "kg m^2",
                |j| &j.armature,
                "URDF has no rotor inertia; give it to the simulator itself (MuJoCo: armature)",
            ),
            (
                "stiffness of the controller",
                "N m/rad",
                |j| &j.stiffness,
                "URDF has no controller; put it into the controller's own configuration",
            ),
            (
                "damping of the controller",
                "N m s/rad",
                |j| &j.gain_damping,
                "URDF has no controller; put it into the controller's own configuration",
            ),
            ("gain of the motor's torque", "1", |j| &j.torque_gain, "multiply by it what the controller commands"),
            ("constant torque", "N m", |j| &j.constant, "URDF has no key; add it to what the controller commands"),
            (
                "what the encoder reads beyond the joint's position",
                "rad",
                |j| &j.encoder,
                "URDF has no key; add it to measured positions",
            ),
        ];
        self.sheet.lacks_in_joints(arm, &lists);
        self.sheet.lacks_in_time(
            arm,
            ["URDF has no controller; hold commands back before it", "URDF has one number for dry friction"],
        );
    }

    fn lacks_of_cell(&mut self, model: &CellModel) {
        if model.gravity.iter().any(|known| known.is_known()) {
            let gravity = model.gravity.iter().map(|g| number(g.value)).collect::<Vec<_>>().join(", ");
            self.sheet
                .lacks(format!("gravity [{gravity}] m/s^2 in the base frame"), "it belongs to the simulator's world");
        }
        if let Some(object) = &model.object {
            let centre = object.centre_of_mass.iter().map(|c| number(c.value)).collect::<Vec<_>>().join(", ");
            self.sheet.lacks(
                format!(
                    "the object: mass {} kg, centre of mass [{centre}] m, inertia about z {} kg m^2, friction on the table [{}] along x and y \
                     and on the tip {}, contact of {} N/m with restitution {}, base presses at {} times the distance of `support`",
                    number(object.mass.value),
                    number(object.inertia.value),
                    object.friction.iter().map(|mu| number(mu.value)).collect::<Vec<_>>().join(", "),
                    number(object.tip_friction.value),
                    number(object.law.stiffness),
                    number(object.law.restitution),
                    number(object.reach.value)
                ),
                "a URDF is of one robot; write it with --to sdf or --to mjcf",
            );
        }
        if model.latency.is_known() {
            self.sheet.lacks(
                format!("latency of the camera {} s", number(model.latency.value)),
                "URDF has no sensors' delays",
            );
        }
    }
}
