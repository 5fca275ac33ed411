//! The hit: how fast tool and object, once they touch, stop approaching and part again. Called by [`crate::sim`] in its
//! finest steps and solved by [`super::TableObject`] together with what the table answers.
//!
//! Law: the depth of the contact follows a damped oscillator, `depth'' = -2 zeta w depth' - w² depth`, `w² = k / m` with
//! the contact's stiffness and the object's mass, as long as that takes a push and no pull. `zeta` follows from the
//! restitution (Schwager, Pöschel 2007). The law states a motion, not a force: the force is whatever brings it about,
//! more of it where the table stands behind the object. Friction: Coulomb. Base frame, SI.
//!
//! Once the oscillation has died down the tool just pushes. A [`Press::steady`] contact then takes steps many times longer
//! than its oscillation: it goes to where it rests, and counts on what accelerates both sides meanwhile.

use super::touch::Touch;
use crate::contact_law::ContactLaw;
use nalgebra::Vector3;

/// Angle of the oscillator in a step [rad]. Half of it moves the mean gap of the clips in `tests/simulation/sliding_clips.rs` by 0.3 mm
/// at most, nearly all of it in one stroke of which every small change makes another.
const STEP_ANGLE: f64 = 0.15;

/// Friction on a table and an arm that slows down accelerate tool and object against each other by about this [m/s²]: a
/// steady contact rests at the depth where the spring answers to it.
const PUSHING: f64 = 3.0;
/// A contact is steady while its oscillation adds less than this [m/s²].
const CALM: f64 = 12.0;

/// The tool against one place of the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press {
    pub touch: Touch,
    /// Of the tool's point there [m/s].
    pub tool_velocity: Vector3<f64>,
    /// Of the same point, were it not for the object [m/s²].
    pub tool_acceleration: Vector3<f64>,
    /// What the law asks.
    pub motion: ContactMotion,
    /// The step is too long to follow the oscillation, of which nothing is left.
    pub steady: bool,
}

/// The law for one object: the oscillator that the depth follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactMotion {
    /// `w` [rad/s].
    frequency: f64,
    /// `zeta`.
    damping_ratio: f64,
    /// Coulomb friction between tool and object.
    pub(super) friction: f64,
}

impl ContactLaw {
    /// What it asks of an object of `mass` [kg].
    pub fn motion(&self, mass: f64) -> ContactMotion {
        ContactMotion {
            frequency: (self.stiffness / mass).sqrt(),
            damping_ratio: damping_ratio(self.restitution),
            friction: self.friction,
        }
    }
}

impl Press {
    /// Least speed at which the place has to part from the tool after `dt`, when it moves with `velocity` before [m/s].
    /// One that does not touch may approach at any speed.
    pub(super) fn least_parting(&self, velocity: &Vector3<f64>, dt: f64) -> f64 {
        if self.touch.depth <= 0.0 {
            return f64::NEG_INFINITY;
        }
        let rate = self.approach(velocity);
        let after = if self.steady { ContactMotion::approach_at_rest_after } else { ContactMotion::approach_after };
        -after(&self.motion, self.touch.depth, rate, dt)
    }

    /// Velocity of the tool's point against which the object parts after `dt` [m/s].
    pub(super) fn surface_velocity(&self, dt: f64) -> Vector3<f64> {
        if self.steady { self.tool_velocity + self.tool_acceleration * dt } else { self.tool_velocity }
    }

    /// Whether nothing is left of the hit, and within `dt` no other begins, where the place moves with `velocity` [m/s].
    pub fn is_calm(&self, velocity: &Vector3<f64>, dt: f64) -> bool {
        let (depth, rate) = (self.touch.depth, self.approach(velocity));
        if depth > 0.0 {
            self.motion.is_calm(depth, rate)
        } else {
            rate * dt < -depth || self.motion.is_calm(0.0, rate)
        }
    }

    fn approach(&self, velocity: &Vector3<f64>) -> f64 {
        (self.tool_velocity - velocity).dot(&self.touch.normal)
    }
}

impl ContactMotion {
    /// Of the undamped oscillation [rad/s].
    pub fn frequency(&self) -> f64 {
        self.frequency
    }

    /// Damping over the critical one.
    pub fn damping_ratio(&self) -> f64 {
        self.damping_ratio
    }

    /// A step that follows the contact: a twentieth of its duration [s].
    pub fn step(&self) -> f64 {
        STEP_ANGLE / self.frequency
    }

    /// Approach speed after `dt`, from depth [m] and approach speed [m/s] before.
    pub(super) fn approach_after(&self, depth: f64, rate: f64, dt: f64) -> f64 {
        let damping = self.damping_ratio * self.frequency * dt;
        // Spring by the depth before, damper by the mean speed: together with the depth that follows from the new speed
        // this neither feeds nor drains the oscillator.
        (rate * (1.0 - damping) - self.frequency * self.frequency * depth * dt) / (1.0 + damping)
    }

    /// The same for a step that may be longer than the oscillation: spring and damper by the end of the step, the way
    /// by the mean speed. Whatever it starts from, it ends up at the depth of [`PUSHING`].
    fn approach_at_rest_after(&self, depth: f64, rate: f64, dt: f64) -> f64 {
        let angle = self.frequency * dt;
        let half = 0.5 * angle * angle;
        let spring = (self.frequency * self.frequency * depth - PUSHING) * dt;
        (rate * (1.0 - half) - spring) / (1.0 + 2.0 * self.damping_ratio * angle + half)
    }

    fn is_calm(&self, depth: f64, rate: f64) -> bool {
        let spring = self.frequency * self.frequency * depth - PUSHING;
        spring * spring + (self.frequency * rate).powi(2) < CALM * CALM
    }
}

/// Damping ratio of a contact that cannot pull and returns `e` of the approach speed, by bisection: `e` falls with it.
fn damping_ratio(e: f64) -> f64 {
    let (mut low, mut high) = (0.0, 5.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if restitution_of(middle) > e {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Restitution of a spring and damper in parallel that part when the force would pull (Schwager, Pöschel 2007).
fn restitution_of(ratio: f64) -> f64 {
    let root = (1.0 - ratio * ratio).abs().sqrt();
    let exponent = if root < 1e-9 {
        2.0
    } else if ratio < 1.0 {
        ratio / root * (2.0 * ratio * root).atan2(2.0 * ratio * ratio - 1.0)
    } else {
        ratio / root * ((ratio + root) / (ratio - root)).ln()
    };
    (-exponent).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact_law::RESTITUTION_OF_ENGINES;
    use crate::physics::TableObject;
    use crate::physics::test_box::{box_model, nominal};
    use crate::physics::touch::Capsule;
    use crate::sliding::Coulomb;
    use nalgebra::{Isometry3, Point3};

    const TOOL: Capsule = Capsule { segment: 0.148, radius: 0.012 };
    const TOOL_MASS: f64 = 2.0;

    /// An upright tool of [`TOOL_MASS`] that only translates, `tip` being the end of its segment.
    fn upright(tip: Point3<f64>) -> Isometry3<f64> {
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Isometry3::from_parts((tip.coords + Vector3::z() * TOOL.segment).into(), turn)
    }

    fn press(touch: Touch, tool_velocity: Vector3<f64>, law: ContactLaw) -> Press {
        Press { touch, tool_velocity, tool_acceleration: Vector3::zeros(), motion: law.motion(0.3), steady: false }
    }

    /// Flies the tool against the box along x at `speed`; velocity of tool and box (its centre) afterwards, at `tip_height`
    /// over the box's centre. No table; gravity is taken out of the result.
    fn collide(
        law: ContactLaw,
        speed: f64,
        tip_height: f64,
        offset: f64,
        dt: f64,
    ) -> (Vector3<f64>, TableObject<Coulomb>, f64) {
        let mut object = nominal(&box_model(), None);
        let (mut tip, mut velocity) = (Point3::new(-0.054, offset, tip_height), Vector3::x() * speed);
        let (mut time, mut fallen) = (0.0, 0.0);
        while time < 0.03 {
            let tool_velocity = velocity - Vector3::z() * fallen;
            let touches = object.touches(&TOOL, &upright(tip));
            let presses = touches.map(|touch| press(touch, tool_velocity, law));
            let forces = object.step(dt, &presses);
            velocity -= (forces[0] + forces[1]) * (dt / TOOL_MASS);
            fallen += 9.81 * dt;
            tip += (velocity - Vector3::z() * fallen) * dt;
            time += dt;
        }
        (velocity, object, fallen)
    }

    fn centre_velocity(object: &TableObject<Coulomb>, fallen: f64) -> Vector3<f64> {
        object.velocity_at(&Point3::from(object.isometry().translation.vector)) + Vector3::z() * fallen
    }

    const FINE: f64 = 6.25e-5;

    #[test]
    fn contacts_of_engines_return_what_a_spring_and_a_damper_do() {
        let [low, high] = RESTITUTION_OF_ENGINES;
        let [critical, light] = [1.0, 0.6].map(restitution_of);
        assert!((critical - 0.02 - low).abs() < 2e-3 && (light + 0.02 - high).abs() < 2e-3, "{critical} {light}");
    }

    #[test]
    fn momentum_is_conserved_in_a_free_impact() {
        let law = ContactLaw::nominal(0.3);
        let (tool, object, fallen) = collide(law, 0.8, -0.02, 0.015, FINE);
        let total = tool * TOOL_MASS + centre_velocity(&object, fallen) * 0.3;
        assert!((total - Vector3::x() * 0.8 * TOOL_MASS).norm() < 1e-9, "{total}");
        assert!(object.angular_velocity().norm() > 0.5, "an off-centre hit turns the box");
    }

    #[test]
    fn the_two_part_with_the_restitution_times_the_approach_speed() {
        for restitution in [0.135, 0.5, 0.9] {
            let law = ContactLaw { restitution, ..ContactLaw::nominal(0.0) };
            // The tool reaches from below the box to above it: both ends of the touching line press alike.
            let (tool, object, fallen) = collide(law, 0.6, -0.074, 0.0, FINE);
            let parting = (centre_velocity(&object, fallen) - tool).x / 0.6;
            assert!((parting - restitution).abs() < 0.02, "{parting} instead of {restitution}");
        }
    }

    #[test]
    fn halving_the_step_changes_the_speed_after_the_hit_by_less_than_two_per_cent() {
        for (speed, offset) in [(0.2, 0.0), (0.6, 0.01), (1.2, 0.02)] {
            let law = ContactLaw::nominal(0.25);
            let [coarse, fine] = [FINE, FINE / 2.0].map(|dt| {
                let (_, object, fallen) = collide(law, speed, -0.02, offset, dt);
                (centre_velocity(&object, fallen), object.angular_velocity())
            });
            let change = (coarse.0 - fine.0).norm() / fine.0.norm();
            assert!(change < 0.02, "{speed} m/s: {change}");
            // Against 1 rad/s where the hit is central: what is left there is no spin to speak of.
            let change = (coarse.1 - fine.1).norm() / fine.1.norm().max(1.0);
            assert!(change < 0.04, "{speed} m/s: spin changes by {change}");
        }
    }

    #[test]
    fn the_damping_ratio_returns_the_restitution_it_was_made_from() {
        for e in [0.02, 0.135, 0.5, 0.9, 1.0] {
            assert!((restitution_of(damping_ratio(e)) - e).abs() < 1e-6, "{e}");
        }
    }

    #[test]
    fn a_table_behind_the_object_makes_the_same_touch_push_harder() {
        // High on the face: free, the box turns away; on the table its front edge holds against that.
        let peak = |table: Option<f64>| {
            let mut object = nominal(&box_model(), table);
            let touch = object.touch(&TOOL, &upright(Point3::new(-0.0519, 0.0, 0.045)));
            object.step(FINE, &[press(touch, Vector3::x() * 0.5, ContactLaw::nominal(0.0))])[0].x
        };
        assert!(peak(Some(-0.05)) > 1.5 * peak(None), "{} {}", peak(Some(-0.05)), peak(None));
    }
}
