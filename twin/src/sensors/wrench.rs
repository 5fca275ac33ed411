//! A force/torque sensor between flange and tool. It measures everything that holds the tool: the push of the object, the
//! tool's weight and its inertia, as a real one does, which knows of none of the three.
//!
//! With `c` the tool's centre of mass, `r` the way there from the flange's origin, `m`, `I` its mass and inertia, `a_c` and
//! `alpha` its accelerations and `F`, `M` what the object does to it about the flange's origin:
//! `f = F + m (g - a_c)`, `t = M + r x m (g - a_c) - I alpha - omega x I omega` (Newton and Euler), turned into the sensor's
//! frame, which is the flange's.

use crate::arm::{FlangeMotion, MassProperties};
use crate::sim::SimCell;
use nalgebra::Vector3;
use rand_distr::{Distribution as _, Normal};
use shared_mem::cell::{Cell, GRAVITY, WrenchSensor};
use shared_mem::msg::wrench::Wrench;
use shared_mem::time::TICK;

/// The simulated sensor.
#[derive(Debug, Clone)]
pub struct SimWrench {
    described: WrenchSensor,
    tool: MassProperties,
    noise: [Normal<f64>; 2],
    generator: rand_pcg::Pcg64,
    before: Option<FlangeMotion>,
    /// When the next sample is due [ns of simulated time].
    due_ns: u64,
    sequence: u64,
}

impl SimWrench {
    /// The sensor of a cell; as if it had the usual one where cell.toml has no `[wrench]`.
    pub fn new(cell: &Cell) -> Self {
        let described = cell.wrench.unwrap_or_default();
        let normal = |sigma: f64| Normal::new(0.0, sigma).unwrap_or_else(|_| Normal::new(0.0, 0.0).expect("zero"));
        Self {
            described,
            tool: cell.tool.as_ref().map(MassProperties::of_tool).unwrap_or_default(),
            noise: [normal(described.noise.force), normal(described.noise.torque)],
            generator: crate::sim::generator(cell, 4),
            before: None,
            due_ns: 0,
            sequence: 0,
        }
    }

    /// Looks at the cell after each of its periods; a sample where one is due. Its `stamp_ns` is 0, `device_ns` the
    /// simulated clock. `None` also for an arm of unknown shape, which has no flange to put a sensor on.
    pub fn observe(&mut self, cell: &SimCell) -> Option<Wrench> {
        let model = cell.arm_model().filter(|model| model.has_geometry())?;
        let now = model.flange_motion(&crate::arm::JointState { q: cell.q(), dq: cell.dq() });
        let before = self.before.replace(now).unwrap_or(now);
        let time_ns = cell.time_ns();
        if time_ns < self.due_ns {
            return None;
        }
        self.due_ns = self.due_ns.max(time_ns) + (1e9 / self.described.rate) as u64;
        let true_wrench = felt(&self.tool, &before, &now, cell.contact_wrench());
        self.sequence += 1;
        Some(self.sample(true_wrench, time_ns))
    }

    /// Adds the noise and cuts at the range's end.
    fn sample(&mut self, wrench: [Vector3<f64>; 2], time_ns: u64) -> Wrench {
        let mut out = Wrench { device_ns: time_ns, sequence: self.sequence, ..Wrench::default() };
        let ranges = [self.described.force_range, self.described.torque_range];
        for (part, values) in [&mut out.force, &mut out.torque].into_iter().enumerate() {
            for (axis, value) in values.iter_mut().enumerate() {
                let noisy = wrench[part][axis] + self.noise[part].sample(&mut self.generator);
                *value = noisy.clamp(-ranges[part], ranges[part]);
                out.saturated |= u32::from(*value != noisy) << (3 * part + axis);
            }
        }
        out
    }
}

/// Force and torque that a sensor without faults feels, flange frame.
fn felt(
    tool: &MassProperties,
    before: &FlangeMotion,
    now: &FlangeMotion,
    [push, moment_at_base]: [Vector3<f64>; 2],
) -> [Vector3<f64>; 2] {
    let rotation = now.pose.rotation;
    let (origin, omega) = (now.pose.translation.vector, now.angular_velocity);
    let acceleration = (now.velocity - before.velocity) / TICK;
    let alpha = (omega - before.angular_velocity) / TICK;
    let arm = rotation * tool.centre;
    let of_centre = acceleration + alpha.cross(&arm) + omega.cross(&omega.cross(&arm));
    let turn = rotation.to_rotation_matrix();
    let inertia = turn.matrix() * tool.inertia * turn.matrix().transpose();
    let carried = (Vector3::z() * -GRAVITY - of_centre) * tool.mass;
    let force = push + carried;
    let torque =
        moment_at_base - origin.cross(&push) + arm.cross(&carried) - inertia * alpha - omega.cross(&(inertia * omega));
    [rotation.inverse() * force, rotation.inverse() * torque]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Drive;
    use std::path::Path;

    const SHIPPED: &str = include_str!("../../../config/fr3_cell.toml");

    fn cell(more: &str) -> Cell {
        let text = format!("{SHIPPED}\n{more}");
        Cell::parse(&text, Path::new("cell.toml")).expect("the shipped cell")
    }

    fn holding(sim: &SimCell) -> Drive {
        Drive::JointImpedance { q_d: sim.q(), dq_d: [0.0; 8] }
    }

    #[test]
    fn at_rest_the_sensor_carries_the_tools_weight_and_nothing_else() {
        let cell = cell("");
        let mut sim = SimCell::new(&cell, None).expect("a cell");
        let (mut sensor, drive) = (SimWrench::new(&cell), holding(&sim));
        let mut last = None;
        for _ in 0..2000 {
            sim.step(&drive);
            last = sensor.observe(&sim).or(last);
        }
        let last = last.expect("samples");
        let weight = 0.25 * 9.81;
        assert!((Vector3::from(last.force).norm() - weight).abs() < 1e-3, "{last:?}");
        // The ready pose points the flange down: the weight pulls along its z axis.
        assert!((last.force[2] - weight).abs() < 0.01 && Vector3::from(last.torque).norm() < 0.02, "{last:?}");
        assert_eq!((last.sequence, last.saturated), (1000, 0), "500 Hz for two seconds");
    }

    #[test]
    fn a_push_at_the_tip_shows_as_its_force_and_its_moment_about_the_flange() {
        let still = FlangeMotion {
            pose: nalgebra::Isometry3::new(Vector3::new(0.4, 0.1, 0.3), Vector3::x() * std::f64::consts::PI),
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
        };
        let (tip, push) = (still.pose * nalgebra::Point3::new(0.0, 0.0, 0.16), Vector3::new(10.0, 0.0, 0.0));
        let wrench = [push, tip.coords.cross(&push)];
        let [force, torque] = felt(&MassProperties::default(), &still, &still, wrench);
        assert!((force - Vector3::new(10.0, 0.0, 0.0)).norm() < 1e-12);
        assert!((torque - Vector3::new(0.0, 1.6, 0.0)).norm() < 1e-12, "{torque}");
    }

    #[test]
    fn an_accelerated_tool_pulls_back_on_its_sensor() {
        let at = |velocity: f64| FlangeMotion {
            pose: nalgebra::Isometry3::identity(),
            velocity: Vector3::new(velocity, 0.0, 0.0),
            angular_velocity: Vector3::zeros(),
        };
        let tool = MassProperties::new(0.5, [0.0, 0.0, 0.1], [0.0; 6]);
        let [force, torque] = felt(&tool, &at(0.0), &at(2e-3), Default::default());
        assert!((force - Vector3::new(-1.0, 0.0, -4.905)).norm() < 1e-12, "{force}");
        assert!((torque - Vector3::new(0.0, -0.1, 0.0)).norm() < 1e-12, "{torque}");
    }

    #[test]
    fn beyond_its_range_the_sensor_says_so() {
        let cell = cell("[wrench]\nforce_range = 2.0\n");
        let mut sim = SimCell::new(&cell, None).expect("a cell");
        let (mut sensor, drive) = (SimWrench::new(&cell), holding(&sim));
        sim.step(&drive);
        let sample = sensor.observe(&sim).expect("the first sample");
        assert_eq!((sample.force[2], sample.saturated), (2.0, 0b100));
    }
}
