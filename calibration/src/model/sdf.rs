//! SDF for Gazebo: a world with arm, object and table. Joint gains go into Gazebo's joint position controllers.

use super::cell_model::{Arm, CellModel, Joint, Object};
use super::known::{LEAST_MOMENT, Line, number, numbers};
use super::sheet::{Lacking, Sheet};
use nalgebra::{Isometry3, Vector3};
use twin::arm::MassProperties;

/// The file, what stands in it, and what it cannot hold.
pub(super) fn write(model: &CellModel) -> Sheet {
    let mut file = File { sheet: Sheet::new() };
    file.sheet.xml.open("sdf", &[("version", "1.9".into())]);
    file.sheet.xml.open("world", &[("name", "cell".into())]);
    if let Some(known) = model.gravity.iter().find(|known| known.is_known()) {
        let values: Vec<f64> = model.gravity.iter().map(|g| g.value).collect();
        let line = Line::list("world", "gravity in the base frame", "m/s^2", &values, &known.sources());
        let comment = file.sheet.note("gravity", line);
        file.sheet.xml.comment(&comment);
    }
    file.sheet.xml.text("gravity", &[], &numbers(model.gravity.iter().map(|g| g.value)));
    if let Some(height) = model.table {
        file.table(height, model.object.as_ref());
    }
    if let Some(arm) = &model.arm {
        file.arm(arm, model.object.as_ref());
    }
    if let Some(object) = &model.object {
        file.object(object, model.table.unwrap_or(0.0));
    }
    if let Some(camera) = &model.camera {
        let at = camera.pose.translation.vector;
        let line =
            Line::list("camera", "where the camera truly stands", "m", at.as_slice(), &camera.pose_from.sources());
        let comment = file.sheet.note("pose", line);
        file.sheet.xml.comment(&format!("{comment}; an optical frame: z forward, x right, y down"));
        file.sheet.xml.open("frame", &[("name", "camera_optical_frame".into())]);
        file.pose(&camera.pose, None);
        file.sheet.xml.close();
    }
    if model.latency.is_known() {
        let latency = number(model.latency.value);
        file.sheet.lacks(format!("latency of the camera {latency} s"), "SDF has no delays of sensors");
    }
    file.sheet
}

struct File {
    sheet: Sheet,
}

impl File {
    fn pose(&mut self, at: &Isometry3<f64>, relative_to: Option<&str>) {
        let (roll, pitch, yaw) = at.rotation.euler_angles();
        let attributes: Vec<_> = relative_to.map(|frame| ("relative_to", frame.to_owned())).into_iter().collect();
        let numbers = numbers(at.translation.vector.iter().copied().chain([roll, pitch, yaw]));
        self.sheet.xml.text("pose", &attributes, &numbers);
    }

    fn value(&mut self, key: &str, value: f64) {
        self.sheet.xml.text(key, &[], &number(value));
    }

    fn inertial(&mut self, body: &MassProperties) {
        let body = body.with_moments_from(LEAST_MOMENT);
        self.sheet.xml.open("inertial", &[]);
        self.pose(&Isometry3::translation(body.centre.x, body.centre.y, body.centre.z), None);
        self.value("mass", body.mass);
        self.sheet.xml.open("inertia", &[]);
        for (key, at) in
            [("ixx", (0, 0)), ("iyy", (1, 1)), ("izz", (2, 2)), ("ixy", (0, 1)), ("ixz", (0, 2)), ("iyz", (1, 2))]
        {
            self.value(key, body.inertia[at]);
        }
        self.sheet.xml.close();
        self.sheet.xml.close();
    }

    /// Of two surfaces the lesser friction counts.
    fn surface(&mut self, friction: [f64; 2], hit: Option<&Object>) {
        self.sheet.xml.open("surface", &[]);
        self.sheet.xml.open("friction", &[]);
        self.sheet.xml.open("ode", &[]);
        self.value("mu", friction[0]);
        self.value("mu2", friction[1]);
        self.sheet.xml.close();
        self.sheet.xml.close();
        if let Some(object) = hit {
            let (w, ratio, mass) = (object.hit.frequency(), object.hit.damping_ratio(), object.mass.value);
            self.sheet.xml.open("bounce", &[]);
            self.value("restitution_coefficient", object.law.restitution);
            self.sheet.xml.close();
            self.sheet.xml.open("contact", &[]);
            self.sheet.xml.open("ode", &[]);
            self.value("kp", object.law.stiffness);
            self.value("kd", 2.0 * ratio * w * mass);
            self.sheet.xml.close();
            self.sheet.xml.close();
        }
        self.sheet.xml.close();
    }

    fn table(&mut self, height: f64, object: Option<&Object>) {
        let friction = object.map_or([0.5; 2], |object| [object.friction[0].value, object.friction[1].value]);
        self.sheet.xml.comment("the table's surface [m], from cell.toml");
        self.sheet.xml.open("model", &[("name", "table".into())]);
        self.sheet.xml.text("static", &[], "true");
        self.pose(&Isometry3::translation(0.0, 0.0, height), None);
        self.sheet.xml.open("link", &[("name", "table".into())]);
        self.sheet.xml.open("collision", &[("name", "table".into())]);
        self.sheet.xml.open("geometry", &[]);
        self.sheet.xml.open("plane", &[]);
        self.sheet.xml.text("normal", &[], "0 0 1");
        self.sheet.xml.text("size", &[], "6 6");
        self.sheet.xml.close();
        self.sheet.xml.close();
        self.surface(friction, None);
        (0..3).for_each(|_| self.sheet.xml.close());
    }

    fn object(&mut self, object: &Object, table: f64) {
        let outline = &object.outline;
        let centre = Vector3::from([0, 1, 2].map(|i| object.centre_of_mass[i].value));
        self.sheet
            .xml
            .comment("the object; its frame is its geometric centre, and its place here is for you to choose");
        self.sheet.xml.open("model", &[("name", "object".into())]);
        self.pose(&Isometry3::translation(0.5, 0.0, table + outline.depth), None);
        self.sheet.xml.open("link", &[("name", "object".into())]);
        let diagonal = [0, 1, 2].map(|i| outline.inertia[(i, i)]);
        let lines = [
            ("mass", Line::new("object", "mass", "kg", &object.mass)),
            (
                "inertial pose",
                Line::list(
                    "object",
                    "centre of mass from the geometric centre",
                    "m",
                    centre.as_slice(),
                    &object.centre_of_mass[0].sources(),
                ),
            ),
            (
                "inertia",
                Line::list(
                    "object",
                    "inertia about the centre of mass: xx, yy, zz",
                    "kg m^2",
                    &diagonal,
                    &object.inertia.sources(),
                ),
            ),
        ];
        for (key, line) in lines {
            let comment = self.sheet.note(key, line);
            self.sheet.xml.comment(&comment);
        }
        self.inertial(&MassProperties { mass: object.mass.value, centre, inertia: outline.inertia });
        let Some(half) = object.half_extents else {
            self.sheet.lacks(
                "the shape of the object",
                "its mesh file belongs into <collision>, with the surface of the numbers in --json",
            );
            (0..2).for_each(|_| self.sheet.xml.close());
            return;
        };
        self.touches(object, half);
        (0..2).for_each(|_| self.sheet.xml.close());
    }

    /// The box of the object and its surface.
    fn touches(&mut self, object: &Object, half: Vector3<f64>) {
        let [x, y] = [&object.friction[0], &object.friction[1]];
        let tip = &object.tip_friction;
        let lines = [
            (
                "mu",
                Line::list(
                    "object, table",
                    "Coulomb friction of object and table along x and along y",
                    "1",
                    &[x.value, y.value],
                    &x.sources(),
                ),
            ),
            ("tool mu", Line::new("tool, object", "Coulomb friction of tip and object", "1", tip)),
            (
                "kp, kd, restitution_coefficient",
                Line::list(
                    "tool, object",
                    "stiffness [N/m] and restitution of the contact",
                    "1",
                    &[object.law.stiffness, object.law.restitution],
                    &object.hit_from.sources(),
                ),
            ),
        ];
        for (key, line) in lines {
            let comment = self.sheet.note(key, line);
            self.sheet.xml.comment(&comment);
        }
        self.sheet.xml.comment("of two surfaces the lesser friction counts: the object's is the larger of the two, table and tool have their own");
        self.sheet.xml.open("collision", &[("name", "object".into())]);
        self.sheet.xml.open("geometry", &[]);
        self.sheet.xml.open("box", &[]);
        self.sheet.xml.text("size", &[], &numbers(half.iter().map(|h| 2.0 * h)));
        self.sheet.xml.close();
        self.sheet.xml.close();
        self.surface([x.value.max(tip.value), y.value.max(tip.value)], Some(object));
        self.sheet.xml.close();
        if object.reach.value != 1.0 {
            self.sheet.lacks(
                format!(
                    "where the base presses: at {} times the distance of cell.toml's `support`",
                    number(object.reach.value)
                ),
                "the box here stands on its whole base; give it feet",
            );
        }
    }

    fn arm(&mut self, arm: &Arm, object: Option<&Object>) {
        self.sheet.xml.open("model", &[("name", "robot".into())]);
        self.sheet.xml.open("link", &[("name", arm.base_frame.clone())]);
        self.sheet.xml.close();
        self.sheet.xml.open("joint", &[("name", "base".into()), ("type", "fixed".into())]);
        self.sheet.xml.text("parent", &[], "world");
        self.sheet.xml.text("child", &[], &arm.base_frame);
        self.sheet.xml.close();
        let mut before = arm.base_frame.as_str();
        for joint in &arm.joints {
            let parent = if arm.has_geometry { before } else { arm.base_frame.as_str() };
            self.joint(joint, parent);
            self.link(&joint.part.link, &joint.part.joint, &joint.part.body, arm.compensates);
            self.sheet.xml.close();
            before = &joint.part.link;
        }
        if arm.has_geometry {
            self.flange(arm, before, object);
        } else {
            self.sheet.lacks("links, tool and object", "only the joints' names are known: each stands for itself");
        }
        self.gains(arm);
        self.sheet.xml.close();
        if arm.compensates {
            self.sheet.lacks(
                "the controller's compensation of Coriolis torques",
                "<gravity>false</gravity> compensates gravity alone",
            );
        }
        self.lacks_of_arm(arm);
    }

    /// Opens a link.
    fn link(&mut self, name: &str, at: &str, body: &MassProperties, compensated: bool) {
        self.sheet.xml.open("link", &[("name", name.into())]);
        self.pose(&Isometry3::identity(), Some(at));
        if compensated {
            self.sheet
                .xml
                .comment("gravity: the controller compensates this body's weight, from cell.toml (controller.kind)");
            self.sheet.xml.text("gravity", &[], "false");
        }
        if body.mass > 0.0 {
            self.inertial(body);
        }
    }

    fn fixed(&mut self, name: &str, parent: &str, child: &str, at: &Isometry3<f64>) {
        self.sheet.xml.open("joint", &[("name", name.into()), ("type", "fixed".into())]);
        self.pose(at, Some(parent));
        self.sheet.xml.text("parent", &[], parent);
        self.sheet.xml.text("child", &[], child);
        self.sheet.xml.close();
    }

    fn flange(&mut self, arm: &Arm, last: &str, object: Option<&Object>) {
        self.fixed("flange", last, "flange_link", &arm.flange);
        self.link("flange_link", "flange", &MassProperties::default(), false);
        self.sheet.xml.close();
        if let Some(tool) = &arm.tool {
            let at = Vector3::from([0, 1, 2].map(|i| arm.tool_at[i].value));
            self.sheet.xml.comment(
                "the tool: a capsule along the flange's z axis; mass [kg], radius and length [m], from cell.toml",
            );
            if let Some(known) = arm.tool_at.iter().find(|known| known.is_known()) {
                let line =
                    Line::list("tool", "place of the tool in the flange frame", "m", at.as_slice(), &known.sources());
                let comment = self.sheet.note("pose", line);
                self.sheet.xml.comment(&comment);
            }
            self.fixed("tool", "flange_link", "tool_link", &Isometry3::translation(at.x, at.y, at.z));
            let properties = MassProperties::of_tool(tool);
            let centre = properties.centre + at * (arm.carried - 1.0);
            self.link("tool_link", "tool", &MassProperties { centre, ..properties }, arm.compensates);
            self.sheet.xml.open("collision", &[("name", "tool".into())]);
            let length = tool.length - tool.radius;
            self.pose(&Isometry3::translation(0.0, 0.0, 0.5 * length), None);
            self.sheet.xml.open("geometry", &[]);
            self.sheet.xml.open("capsule", &[]);
            self.value("radius", tool.radius);
            self.value("length", length);
            self.sheet.xml.close();
            self.sheet.xml.close();
            if let Some(object) = object {
                self.surface([object.tip_friction.value; 2], Some(object));
            }
            (0..2).for_each(|_| self.sheet.xml.close());
        }
        for load in &arm.loads {
            let name = load.name.as_str();
            let comment = self
                .sheet
                .note("mass", Line::new(name, "a load that the controller does not compensate", "kg", &load.mass));
            self.sheet.xml.comment(&format!("{name} {comment}; pose [m] in the flange frame"));
            let link = format!("{name}_link");
            self.fixed(name, "flange_link", &link, &Isometry3::identity());
            let body = MassProperties::new(load.mass.value, load.centre, [1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0]);
            self.link(&link, name, &body, false);
            self.sheet.xml.close();
        }
    }

    fn joint(&mut self, joint: &Joint, parent: &str) {
        let part = &joint.part;
        let name = part.joint.as_str();
        let kind = if part.slides { "prismatic" } else { "revolute" };
        self.sheet.xml.open("joint", &[("name", name.into()), ("type", kind.into())]);
        self.pose(&part.origin, Some(parent));
        self.sheet.xml.text("parent", &[], parent);
        self.sheet.xml.text("child", &[], &part.link);
        self.sheet.xml.open("axis", &[]);
        self.sheet.xml.text("xyz", &[], &numbers(part.axis.iter().copied()));
        self.sheet.xml.open("limit", &[]);
        if part.range.iter().all(|end| end.is_finite()) {
            self.value("lower", part.range[0]);
            self.value("upper", part.range[1]);
        }
        if joint.torque_limit.is_known() && joint.torque_limit.value.is_finite() {
            let comment =
                self.sheet.note("effort", Line::new(name, "largest torque of the motor", "N m", &joint.torque_limit));
            self.sheet.xml.comment(&format!("{name} {comment}"));
            self.value("effort", joint.torque_limit.value);
        }
        if part.velocity.is_finite() {
            self.value("velocity", part.velocity);
        }
        self.sheet.xml.close();
        self.sheet.xml.open("dynamics", &[]);
        let values = [
            ("damping", "viscous friction", "N m s/rad", &joint.damping),
            ("friction", "dry friction", "N m", &joint.dry),
        ];
        for (key, what, unit, known) in values {
            if known.is_known() {
                let comment = self.sheet.note(key, Line::new(name, what, unit, known));
                self.sheet.xml.comment(&format!("{name} {comment}"));
                self.value(key, known.value);
            }
        }
        (0..3).for_each(|_| self.sheet.xml.close());
    }

    /// Gazebo's joint position controller: `p (q_d - q) + d d(q_d - q)/dt`.
    fn gains(&mut self, arm: &Arm) {
        for joint in arm.joints.iter().filter(|joint| joint.stiffness.is_known() && joint.gain_damping.is_known()) {
            let (name, gain) = (joint.part.joint.as_str(), joint.torque_gain.value);
            let lines = [
                ("p_gain", Line::new(name, "stiffness of the controller", "N m/rad", &joint.stiffness)),
                ("d_gain", Line::new(name, "damping of the controller", "N m s/rad", &joint.gain_damping)),
            ];
            for (key, line) in lines {
                let comment = self.sheet.note(key, line);
                self.sheet.xml.comment(&format!("{name} {comment}"));
            }
            self.sheet.xml.open(
                "plugin",
                &[
                    ("filename", "gz-sim-joint-position-controller-system".into()),
                    ("name", "gz::sim::systems::JointPositionController".into()),
                ],
            );
            self.sheet.xml.text("joint_name", &[], name);
            self.value("p_gain", gain * joint.stiffness.value);
            self.value("d_gain", gain * joint.gain_damping.value);
            self.sheet.xml.close();
        }
        if !arm.compensates {
            self.sheet
                .lacks("damping against the joint's own speed", "Gazebo's controller damps the difference of speeds");
        }
    }

    fn lacks_of_arm(&mut self, arm: &Arm) {
        let lists: [Lacking; 4] = [
            (
                "armature",
                "kg m^2",
                |j| &j.armature,
                "SDF has no rotor inertia: add it to the link's inertia about the joint's axis, if the simulator stays stable",
            ),
            ("constant torque", "N m", |j| &j.constant, "SDF has no key; apply it by a plugin"),
            (
                "what the encoder reads beyond the joint's position",
                "rad",
                |j| &j.encoder,
                "SDF has no key; add it to measured positions",
            ),
            (
                "gain of the motor's torque",
                "1",
                |j| &j.torque_gain,
                "it is in p_gain and d_gain, and not in the compensation of gravity",
            ),
        ];
        self.sheet.lacks_in_joints(arm, &lists);
        self.sheet.lacks_in_time(
            arm,
            ["SDF has no key; hold commands back before they are published", "SDF has one number for dry friction"],
        );
    }
}
