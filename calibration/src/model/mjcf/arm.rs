//! The arm in MJCF: bodies, joints, tool and loads, and the actuators that are the controller.

use super::super::cell_model::{Arm, CellModel, Joint};
use super::super::known::{LEAST_MOMENT, Line, number, numbers};
use super::{File, STEP, full, place};
use nalgebra::Vector3;
use twin::arm::MassProperties;

/// `solimp` of dry friction. MuJoCo's own 0.9 gives a joint that begins to move nine times its inertia.
const FRICTION_IMPEDANCE: f64 = 0.5;
/// Of a body of which nothing is known, or nothing but its inertia [kg]: MuJoCo wants one.
const LEAST_MASS: f64 = 1e-6;

impl File {
    pub(super) fn arm(&mut self, arm: &Arm, model: &CellModel) {
        let compensated =
            if arm.compensates { arm.joints.iter().map(|j| j.torque_gain.value).fold(f64::NAN, f64::min) } else { 0.0 };
        if arm.compensates && arm.joints.iter().any(|joint| (joint.torque_gain.value - compensated).abs() > 1e-9) {
            self.sheet.lacks(
                "the gains of the joints' torques, as far as gravity compensation goes",
                "gravcomp is one number a body: the least of the gains stands there",
            );
        }
        if arm.compensates {
            self.sheet.lacks(
                "the controller's compensation of Coriolis torques",
                "MJCF compensates gravity alone: add them as qfrc_applied, as docs/export_model.md does",
            );
        }
        for (i, joint) in arm.joints.iter().enumerate() {
            let mut body = vec![("name", joint.part.link.clone())];
            body.extend(place(&joint.part.origin));
            if arm.compensates {
                self.sheet.xml.comment("gravcomp: share of the body's weight that the controller compensates, from cell.toml (controller.kind)");
                body.push(("gravcomp", number(compensated)));
            }
            self.sheet.xml.open("body", &body);
            self.inertial(&joint.part.body, arm.has_geometry);
            self.joint(joint, arm.compensates);
            self.shapes(model, i + 1);
            if !arm.has_geometry {
                self.sheet.xml.close();
            }
        }
        if !arm.has_geometry {
            self.sheet.lacks("links, tool and object", "only the joints' names are known: each stands for itself");
            return;
        }
        self.flange(arm, compensated);
        arm.joints.iter().for_each(|_| self.sheet.xml.close());
    }

    pub(super) fn inertial(&mut self, body: &MassProperties, is_known: bool) {
        // Of what is not known next to nothing stands there: what turns is the armature.
        let known = if is_known { *body } else { MassProperties::default() };
        let loads = known.with_moments_from(LEAST_MOMENT);
        self.sheet.xml.leaf(
            "inertial",
            &[
                ("mass", number(loads.mass.max(LEAST_MASS))),
                ("pos", numbers(loads.centre.iter().copied())),
                ("fullinertia", full(&loads.inertia)),
            ],
        );
    }

    fn joint(&mut self, joint: &Joint, compensates: bool) {
        let part = &joint.part;
        let name = part.joint.as_str();
        let kind = if part.slides { "slide" } else { "hinge" };
        let mut attributes =
            vec![("name", part.joint.clone()), ("type", kind.into()), ("axis", numbers(part.axis.iter().copied()))];
        if part.range.iter().all(|end| end.is_finite()) {
            attributes.push(("range", numbers(part.range.map(|end| end + joint.encoder.value))));
        }
        let values = [
            ("armature", "rotor inertia seen at the joint", "kg m^2", &joint.armature),
            ("frictionloss", "dry friction", "N m", &joint.dry),
            ("damping", "viscous friction", "N m s/rad", &joint.damping),
            ("ref", "what the encoder reads beyond the joint's position", "rad", &joint.encoder),
        ];
        for (key, what, unit, known) in values {
            if known.is_known() {
                let comment = self.sheet.note(key, Line::new(name, what, unit, known));
                self.sheet.xml.comment(&format!("{name} {comment}"));
                attributes.push((key, number(known.value)));
            }
        }
        if joint.dry.value > 0.0 && joint.creep > 0.0 {
            // In motion without acceleration the constraint gives `b v / R`, with b = 2 / (impedance time) and
            // R = (1 - impedance) / impedance times the joint's mobility, up to the whole friction: a ramp. One that ends at
            // 2 ln 2 times the creep of `tanh(v / creep)` lacks as much friction on the way as that does.
            let full_at = 2.0 * std::f64::consts::LN_2 * joint.creep;
            let time = 2.0 * full_at / (joint.dry.value * (1.0 - FRICTION_IMPEDANCE) * joint.mobility);
            let low = number(FRICTION_IMPEDANCE);
            self.sheet.xml.comment(&format!(
                "{name} solreffriction: dry friction builds up over {} rad/s, from the same",
                number(joint.creep)
            ));
            attributes.push(("solreffriction", format!("{} 1", number(time))));
            attributes.push(("solimpfriction", format!("{low} {low} 0.001")));
        }
        if joint.torque_limit.is_known() && joint.torque_limit.value.is_finite() {
            let limit = joint.torque_limit.value;
            let comment = self
                .sheet
                .note("actuatorfrcrange", Line::new(name, "largest torque of the motor", "N m", &joint.torque_limit));
            self.sheet.xml.comment(&format!("{name} {comment}"));
            attributes.push(("actuatorfrcrange", numbers([-limit, limit])));
            if compensates {
                attributes.push(("actuatorgravcomp", "true".into()));
            }
        }
        self.sheet.xml.leaf("joint", &attributes);
    }

    fn flange(&mut self, arm: &Arm, compensated: f64) {
        let mut body = vec![("name", "flange".into())];
        body.extend(place(&arm.flange));
        self.sheet.xml.open("body", &body);
        if let Some(tool) = &arm.tool {
            let at = Vector3::from([0, 1, 2].map(|i| arm.tool_at[i].value));
            if let Some(known) = arm.tool_at.iter().find(|known| known.is_known()) {
                let line = Line {
                    values: at.iter().copied().collect(),
                    ..Line::new("tool", "place of the tool in the flange frame", "m", known)
                };
                let comment = self.sheet.note("pos", line);
                self.sheet.xml.comment(&comment);
            }
            self.sheet
                .xml
                .comment("the tool: a capsule along the flange's z axis; mass [kg], size and ends [m], from cell.toml");
            self.sheet.xml.open("body", &[("name", "tool".into()), ("gravcomp", number(compensated))]);
            let properties = MassProperties::of_tool(tool);
            let carried = MassProperties { centre: properties.centre + at * arm.carried, ..properties };
            self.inertial(&carried, true);
            let end = at + Vector3::z() * (tool.length - tool.radius);
            self.sheet.xml.leaf(
                "geom",
                &[
                    ("name", "tool".into()),
                    ("type", "capsule".into()),
                    ("fromto", numbers(at.iter().chain(end.iter()).copied())),
                    ("size", number(tool.radius)),
                ],
            );
            self.sheet.xml.close();
        }
        for load in &arm.loads {
            let name = load.name.as_str();
            let comment = self
                .sheet
                .note("mass", Line::new(name, "a load that the controller does not compensate", "kg", &load.mass));
            self.sheet.xml.comment(&format!("{name} {comment}; pos [m] in the flange frame"));
            self.sheet.xml.open("body", &[("name", name.into())]);
            // A point, as far as MuJoCo allows one.
            self.sheet.xml.leaf(
                "inertial",
                &[
                    ("mass", number(load.mass.value)),
                    ("pos", numbers(load.centre)),
                    ("diaginertia", "1e-9 1e-9 1e-9".into()),
                ],
            );
            self.sheet.xml.close();
        }
        self.sheet.xml.close();
    }

    /// What holds the arm at `q`: one number for every actuator, in their order.
    pub(super) fn controls(arm: &Arm, q: &[f64]) -> Vec<f64> {
        let mut controls = Vec::new();
        if has_gains(arm) {
            controls.extend(q);
            controls.extend(arm.follows_velocity.then(|| vec![0.0; q.len()]).into_iter().flatten());
        }
        controls.extend(arm.joints.iter().filter(|joint| joint.constant.is_known()).map(|_| 0.0));
        controls
    }

    pub(super) fn actuators(&mut self, arm: &Arm) {
        let gains = has_gains(arm);
        if !gains && arm.joints.iter().all(|joint| !joint.constant.is_known()) {
            return;
        }
        self.sheet.xml.open("actuator", &[]);
        let (mut way, mut way_comments) = (Vec::new(), Vec::new());
        if arm.command_delay.is_known() {
            let delay = arm.command_delay.value;
            way_comments.push(
                self.sheet.note(
                    "delay",
                    Line::new("commands", "commands reach the controller later", "s", &arm.command_delay),
                ),
            );
            way_comments.push("nsample: room for the delay at this file's timestep; interp: a fraction of a step lies between two (MuJoCo 3.5 or newer)".into());
            way.extend([
                ("delay", number(delay)),
                ("nsample", format!("{}", (delay / STEP).ceil() as u64 + 2)),
                ("interp", "linear".into()),
            ]);
        }
        let lag = arm.command_lag.is_known().then_some(arm.command_lag.value).filter(|lag| *lag > 0.0);
        if lag.is_some() {
            way_comments.push(self.sheet.note(
                "dynprm",
                Line::new("commands", "time constant of a low-pass in the command's way", "s", &arm.command_lag),
            ));
        }
        way_comments.iter().for_each(|comment| self.sheet.xml.comment(comment));
        if gains {
            let law = if arm.follows_velocity {
                "k (q_d - q) + d (dq_d - dq): first all positions, then all velocities"
            } else {
                "k (q_d - q) - d dq"
            };
            self.sheet.xml.comment(&format!("control law of each joint: {law}"));
            arm.joints.iter().for_each(|joint| self.position(joint, arm.follows_velocity, &way, lag));
        }
        if gains && arm.follows_velocity {
            arm.joints.iter().for_each(|joint| self.velocity(joint, &way, lag));
        }
        for joint in arm.joints.iter().filter(|joint| joint.constant.is_known()) {
            let name = joint.part.joint.as_str();
            let comment = self.sheet.note(
                "biasprm",
                Line::new(name, "a constant torque; its control counts for nothing", "N m", &joint.constant),
            );
            self.sheet.xml.comment(&format!("{name} {comment}"));
            self.sheet.xml.leaf(
                "general",
                &[
                    ("name", format!("{name}_constant")),
                    ("joint", name.into()),
                    ("gainprm", "0".into()),
                    ("biastype", "affine".into()),
                    ("biasprm", number(joint.constant.value)),
                ],
            );
        }
        self.sheet.xml.close();
    }

    fn position(&mut self, joint: &Joint, follows_velocity: bool, way: &[(&'static str, String)], lag: Option<f64>) {
        let (name, gain) = (joint.part.joint.as_str(), joint.torque_gain.value);
        let mut attributes = vec![("name", format!("{name}_position")), ("joint", name.to_owned())];
        let comment =
            self.sheet.note("kp", Line::new(name, "stiffness of the controller", "N m/rad", &joint.stiffness));
        self.sheet.xml.comment(&format!("{name} {comment}"));
        if joint.torque_gain.is_known() {
            let line = Line::new(name, "gain of the motor's torque, a factor in kp and kv", "1", &joint.torque_gain);
            let comment = self.sheet.note("gain", line);
            self.sheet.xml.comment(&format!("{name} {comment}"));
        }
        attributes.push(("kp", number(gain * joint.stiffness.value)));
        if !follows_velocity {
            let comment =
                self.sheet.note("kv", Line::new(name, "damping of the controller", "N m s/rad", &joint.gain_damping));
            self.sheet.xml.comment(&format!("{name} {comment}"));
            attributes.push(("kv", number(gain * joint.gain_damping.value)));
        }
        attributes.extend(lag.map(|lag| ("timeconst", number(lag))));
        attributes.extend(way.iter().cloned());
        self.sheet.xml.leaf("position", &attributes);
    }

    fn velocity(&mut self, joint: &Joint, way: &[(&'static str, String)], lag: Option<f64>) {
        let (name, gain) = (joint.part.joint.as_str(), joint.torque_gain.value);
        let comment =
            self.sheet.note("kv", Line::new(name, "damping of the controller", "N m s/rad", &joint.gain_damping));
        self.sheet.xml.comment(&format!("{name} {comment}"));
        let kv = gain * joint.gain_damping.value;
        let mut attributes = vec![("name", format!("{name}_velocity")), ("joint", name.to_owned())];
        match lag {
            None => attributes.push(("kv", number(kv))),
            Some(lag) => attributes.extend([
                ("dyntype", "filterexact".to_owned()),
                ("dynprm", number(lag)),
                ("gainprm", number(kv)),
                ("biastype", "affine".to_owned()),
                ("biasprm", numbers([0.0, 0.0, -kv])),
            ]),
        }
        attributes.extend(way.iter().cloned());
        self.sheet.xml.leaf(if lag.is_some() { "general" } else { "velocity" }, &attributes);
    }
}

/// Whether the controller's law is known.
fn has_gains(arm: &Arm) -> bool {
    arm.joints.iter().all(|joint| joint.stiffness.is_known() && joint.gain_damping.is_known())
}
