//! The tool over one short stretch of time: where the arm takes it without contact, and how it gives way to the forces of
//! one. The arm's inertia as the tool feels it is taken once, at the start: within a millisecond it changes by less
//! than a hundredth, and what the contact does to the tool's speed is a tenth of that speed. Base frame, SI.

use crate::arm::{FlangeMotion, Joints, Yielding};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3, Vector6};

/// The way of the flange from one known motion to another, and its departure from it.
pub(super) struct ToolPath {
    from: FlangeMotion,
    to: FlangeMotion,
    /// From `from` to `to`, base axes [rad].
    turn: Vector3<f64>,
    length: f64,
    yielding: Yielding,
    time: f64,
    /// Departure from the way, and its rate: linear, then angular.
    shift: Vector6<f64>,
    rate: Vector6<f64>,
    /// Wrench of the contact on the tool, integrated once and twice over the stretch.
    impulse: Vector6<f64>,
    lasting: Vector6<f64>,
}

/// The tool at one moment.
pub(super) struct ToolMotion {
    pub(super) pose: Isometry3<f64>,
    velocity: Vector3<f64>,
    angular_velocity: Vector3<f64>,
}

impl ToolMotion {
    /// Velocity of the tool's point that is at `point` now [m/s].
    pub(super) fn velocity_at(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.velocity + self.angular_velocity.cross(&(point.coords - self.pose.translation.vector))
    }
}

impl From<FlangeMotion> for ToolMotion {
    fn from(motion: FlangeMotion) -> Self {
        Self { pose: motion.pose, velocity: motion.velocity, angular_velocity: motion.angular_velocity }
    }
}

/// What a contact did to the arm over the stretch.
pub(super) struct Reaction {
    /// Mean torque from outside [N m].
    pub(super) torque: Joints,
    /// Change of the joints' positions and velocities against the way without contact.
    pub(super) dq: Joints,
    pub(super) q: Joints,
}

impl ToolPath {
    pub(super) fn new(from: FlangeMotion, to: FlangeMotion, length: f64, yielding: Yielding) -> Self {
        let turn = (to.pose.rotation * from.pose.rotation.inverse()).scaled_axis();
        let zero = Vector6::zeros();
        Self { from, to, turn, length, yielding, time: 0.0, shift: zero, rate: zero, impulse: zero, lasting: zero }
    }

    /// Time since the start of the stretch [s].
    pub(super) fn time(&self) -> f64 {
        self.time
    }

    /// The whole stretch [s].
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// What is left of the stretch [s].
    pub(super) fn left(&self) -> f64 {
        self.length - self.time
    }

    /// Where the tool is now: the cubic through both ends, and the departure.
    pub(super) fn now(&self) -> ToolMotion {
        let Self { from, to, length, .. } = self;
        let s = self.time / length;
        let r = 1.0 - s;
        let (p, q) = (from.pose.translation.vector, to.pose.translation.vector);
        let (u, v) = (from.velocity * *length, to.velocity * *length);
        let place = p * (r * r * (1.0 + 2.0 * s)) + q * (s * s * (1.0 + 2.0 * r)) + (u * r - v * s) * (r * s);
        let velocity = ((q - p) * (6.0 * r * s) + u * (r * (r - 2.0 * s)) + v * (s * (s - 2.0 * r))) / *length;
        let (linear, angular): (Vector3<f64>, Vector3<f64>) = halves(&self.shift);
        let (linear_rate, angular_rate) = halves(&self.rate);
        let rotation = UnitQuaternion::from_scaled_axis(self.turn * s + angular) * from.pose.rotation;
        ToolMotion {
            pose: Isometry3::from_parts(Translation3::from(place + linear), rotation),
            velocity: velocity + linear_rate,
            angular_velocity: from.angular_velocity * r + to.angular_velocity * s + angular_rate,
        }
    }

    /// Acceleration of the tool's point that is at `point` now, were it not pushed; mean over the stretch [m/s²].
    pub(super) fn acceleration_at(&self, now: &ToolMotion, point: &Point3<f64>) -> Vector3<f64> {
        let linear = self.to.velocity - self.from.velocity;
        let angular = self.to.angular_velocity - self.from.angular_velocity;
        (linear + angular.cross(&(point.coords - now.pose.translation.vector))) / self.length
    }

    /// Lets `dt` pass while `forces` act on the tool at places in the base frame.
    pub(super) fn advance(&mut self, dt: f64, forces: &[(Point3<f64>, Vector3<f64>)], origin: &Vector3<f64>) {
        let before = self.rate;
        if !forces.is_empty() {
            let mut wrench = Vector6::zeros();
            for (point, force) in forces {
                let moment = (point.coords - origin).cross(force);
                wrench += Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
            }
            self.rate += self.yielding.flange * wrench * dt;
            self.impulse += wrench * dt;
            self.lasting += wrench * (dt * (self.left() - 0.5 * dt));
        }
        self.shift += (before + self.rate) * (0.5 * dt);
        self.time += dt;
    }

    /// Whether any force has acted.
    pub(super) fn was_pushed(&self) -> bool {
        self.impulse != Vector6::zeros()
    }

    pub(super) fn reaction(&self) -> Reaction {
        let mean = self.yielding.torques_under(&(self.impulse / self.length));
        Reaction {
            torque: mean,
            dq: self.yielding.joints_under(&self.impulse),
            q: self.yielding.joints_under(&self.lasting),
        }
    }
}

fn halves(v: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (v.fixed_rows::<3>(0).into_owned(), v.fixed_rows::<3>(3).into_owned())
}
