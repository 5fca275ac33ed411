//! The arm taken apart, joint by joint, in the frames of its source: what a model file for another simulator is written from.

use super::inertia::MassProperties;
use super::spatial::Rot3;
use super::{ArmModel, JointState, Joints, MAX_JOINTS};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// One joint and the body behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name of the joint in its source.
    pub joint: String,
    /// Name of the link that it carries.
    pub link: String,
    /// Whether it slides along its axis instead of turning about it.
    pub slides: bool,
    /// The joint's frame at 0 in the frame of the link before; of the first joint in the base frame [m].
    pub origin: Isometry3<f64>,
    /// In the joint's frame, which moves with the link.
    pub axis: Unit<Vector3<f64>>,
    /// The link and what is fixed to it, in the joint's frame.
    pub body: MassProperties,
    /// Rotor inertia seen at the joint [kg m²].
    pub rotor_inertia: f64,
    /// Lowest and highest position [rad, or m]; infinite where not known.
    pub range: [f64; 2],
    /// Highest speed [rad/s, or m/s]; infinite where not known.
    pub velocity: f64,
    /// Largest torque [N m, or N]; infinite where not known.
    pub torque: f64,
}

impl ArmModel {
    /// The joints from base to flange. What is mounted at the flange counts to the last link.
    pub fn parts(&self) -> Vec<Part> {
        let mut before = UnitQuaternion::identity();
        (0..self.dof.min(MAX_JOINTS))
            .map(|i| {
                let (link, turn) = (&self.links[i], self.turns()[i]);
                let step = Isometry3::from_parts(Translation3::from(link.translation), rotation(&link.rotation));
                let origin = before * step * turn.inverse();
                before = turn;
                let aligned = Isometry3::from_parts(Translation3::identity(), turn);
                Part {
                    joint: self.described_joint_names()[i].clone(),
                    link: self.link_names()[i].clone(),
                    slides: link.slides,
                    origin,
                    axis: turn * Vector3::z_axis(),
                    body: link.body.properties().seen_from(&aligned),
                    rotor_inertia: link.rotor,
                    range: [self.q_min()[i], self.q_max()[i]],
                    velocity: self.velocity_limit()[i],
                    torque: self.torque_limit()[i],
                }
            })
            .collect()
    }

    /// What one newton metre accelerates each joint by while all stand at 0 and the others are free [1/(kg m²)]: the diagonal
    /// of the inverse mass matrix.
    pub fn mobilities(&self) -> Joints {
        let (state, rest) =
            (JointState::at_rest([0.0; MAX_JOINTS]), self.bias(&JointState::at_rest([0.0; MAX_JOINTS])));
        std::array::from_fn(|i| {
            if i >= self.dof {
                return 0.0;
            }
            let mut torque = rest;
            torque[i] += 1.0;
            self.accelerations(&state, &torque)[i]
        })
    }

    /// The flange in the last part's frame.
    pub fn flange_on_last_part(&self) -> Isometry3<f64> {
        let turn = self.turns().last().copied().unwrap_or_else(UnitQuaternion::identity);
        Isometry3::from_parts(Translation3::identity(), turn) * self.flange
    }
}

fn rotation(rows: &Rot3) -> UnitQuaternion<f64> {
    let matrix = Matrix3::from_fn(|row, column| rows[row][column]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of the links that follow from the parts alone.
    fn frames(parts: &[Part], q: &Joints) -> Vec<Isometry3<f64>> {
        let mut at = Isometry3::identity();
        let next = |(part, q): (&Part, &f64)| {
            at *= part.origin
                * Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&part.axis, *q));
            at
        };
        parts.iter().zip(q).map(next).collect()
    }

    #[test]
    fn parts_put_links_flange_and_masses_where_the_arm_has_them() {
        let arm = ArmModel::fr3();
        let q = *arm.ready();
        let parts = arm.parts();
        let frames = frames(&parts, &q);
        for ((name, expected), (frame, part)) in arm.named_links(&q).zip(frames.iter().zip(&parts)) {
            assert_eq!(name, part.link);
            assert!((frame.translation.vector - expected.translation.vector).norm() < 1e-12, "{name}");
            assert!(frame.rotation.angle_to(&expected.rotation) < 1e-7, "{name}");
        }
        let flange = frames[6] * arm.flange_on_last_part();
        let expected = Vector3::from(arm.flange(&q).position());
        assert!((flange.translation.vector - expected).norm() < 1e-12);
        let matrix = arm.mass_matrix(&[0.0; MAX_JOINTS]);
        assert!(arm.mobilities().iter().zip(matrix).take(7).enumerate().all(|(i, (free, row))| *free >= 1.0 / row[i]));
        let weight: f64 = parts.iter().map(|part| part.body.mass).sum();
        assert!((weight - arm.moving_mass()).abs() < 1e-12);
        // The vendor's numbers of the second link.
        let centre = parts[1].body.centre - Vector3::new(0.003_182_886_4, -0.074_322_164_4, 0.008_814_608_4);
        assert!(centre.norm() < 1e-12 && (parts[1].body.inertia[(2, 2)] - 0.061_702_1).abs() < 1e-12);
    }
}
