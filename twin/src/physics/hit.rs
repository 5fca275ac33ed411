//! The hit: a compliant contact between the tool (a capsule) and the convex object. Own law, because rapier knows one
//! stiffness for the whole world and cannot push back on an arm that lives outside it. Base frame, SI. Called by
//! [`crate::sim`] in its finest steps; forces are equal and opposite by construction.
//!
//! Normal force: `F = k depth (1 + chi depth_rate)`, never pulling (Hunt and Crossley 1975). `chi` follows from the
//! restitution `e` and the approach speed `v` at touch: with `b = chi v`, energy balance of compression and rebound
//! gives `b (1 + e) = ln((1 + b) / (1 - b e))`, so the rebound is right whatever the two inertias and the stiffness are.
//! Tangential force: Coulomb, linear below a creep speed.

use super::{Push, TableObject, convert};
use nalgebra::{Isometry3, Point3, Vector3};

/// The tool: a segment along the flange's z axis with a radius around it [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// Flange to the far end of the segment: tool length minus radius.
    pub segment: f64,
    /// Radius.
    pub radius: f64,
}

/// Where the tool presses into the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Middle of the pressure, on the object's surface.
    pub point: Point3<f64>,
    /// Unit vector from the tool into the object.
    pub normal: Vector3<f64>,
    /// How deep [m]; negative is the gap between the two.
    pub depth: f64,
}

/// The law's numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLaw {
    /// Stiffness of tip and object in series [N/m].
    pub stiffness: f64,
    /// Share of the approach speed with which the two part again, 0 to 1.
    pub restitution: f64,
    /// Coulomb friction between tool and object.
    pub friction: f64,
}

/// A contact while it lasts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Contact {
    /// `chi` of the law [s/m]; set when the two touch, kept until they part.
    dissipation: Option<f64>,
}

/// Steel tip on a wooden or plastic box: a contact of about 5 ms for 0.3 kg, under 2 mm deep at 1 m/s.
pub const STIFFNESS: f64 = 1.0e5;
/// Nearly plastic: such tips and boxes hardly bounce.
pub const RESTITUTION: f64 = 0.1;
/// Below this sliding speed friction grows linearly [m/s], so that a sticking contact does not chatter.
const CREEP_SPEED: f64 = 5e-3;
/// Slower touches count as this fast [m/s]: `chi` grows without bound otherwise and a gentle push would be glued.
const LEAST_APPROACH: f64 = 0.05;
/// Samples along the tool's segment that find the deepest point and the middle of the pressure.
const SAMPLES: usize = 24;

impl ContactLaw {
    /// The nominal law with an object's friction.
    #[must_use]
    pub fn nominal(friction: f64) -> Self {
        Self { stiffness: STIFFNESS, restitution: RESTITUTION, friction }
    }
}

impl Contact {
    /// Force on the object for one step of `dt`, and the normal force [N]. `tool_velocity` is that of the tool's point
    /// at the touch [m/s].
    pub fn force(
        &mut self,
        law: &ContactLaw,
        touch: &Touch,
        tool_velocity: &Vector3<f64>,
        object: &TableObject,
        dt: f64,
    ) -> (Push, f64) {
        let relative = tool_velocity - object.velocity_at(&touch.point);
        let depth_rate = relative.dot(&touch.normal);
        if touch.depth <= 0.0 {
            self.dissipation = None;
            return (Push { force: Vector3::zeros(), point: touch.point }, 0.0);
        }
        let chi = *self
            .dissipation
            .get_or_insert_with(|| dissipation_number(law.restitution) / depth_rate.max(LEAST_APPROACH));
        let normal_force = (law.stiffness * touch.depth * (1.0 + chi * depth_rate)).max(0.0);
        let slip = relative - touch.normal * depth_rate;
        let force = touch.normal * normal_force + friction(law, normal_force, &slip, touch, object, dt);
        (Push { force, point: touch.point }, normal_force)
    }
}

fn friction(
    law: &ContactLaw,
    normal_force: f64,
    slip: &Vector3<f64>,
    touch: &Touch,
    object: &TableObject,
    dt: f64,
) -> Vector3<f64> {
    let speed = slip.norm();
    if speed < 1e-12 {
        return Vector3::zeros();
    }
    let direction = slip / speed;
    let coulomb = law.friction * normal_force * (speed / CREEP_SPEED).min(1.0);
    // No step may turn the slip around: half of what would stop it is the most.
    let stopping = 0.5 * object.effective_mass(&touch.point, &direction) * speed / dt;
    direction * coulomb.min(stopping)
}

/// `b = chi v` for a restitution `e`: root of `b (1 + e) - ln((1 + b) / (1 - b e))`, by bisection between 0 and `1/e`.
fn dissipation_number(e: f64) -> f64 {
    let e = e.clamp(0.02, 0.999);
    let residual = |b: f64| b * (1.0 + e) - ((1.0 + b) / (1.0 - b * e)).ln();
    // The residual is positive before the root and falls to minus infinity at 1/e.
    let (mut low, mut high) = (0.0, 1.0 / e);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if residual(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

impl TableObject {
    /// Where the tool touches the object or comes nearest, for a flange at `base_from_flange`.
    ///
    /// A tool that lies flat against a face touches along a line; the point is then the middle of the pressure, which
    /// moves to the deeper end as the line tilts.
    #[must_use]
    pub fn touch(&self, tool: &Capsule, base_from_flange: &Isometry3<f64>) -> Touch {
        let base_from_object = self.isometry();
        let object_from_flange = base_from_object.inverse() * base_from_flange;
        let on_axis = |share: f64| object_from_flange * Point3::new(0.0, 0.0, tool.segment * share);
        let mut depths = [0.0; SAMPLES];
        for (i, depth) in depths.iter_mut().enumerate() {
            *depth = tool.radius - self.signed_distance(&on_axis(share_of(i))).0;
        }
        let deepest = (0..SAMPLES).max_by(|a, b| depths[*a].total_cmp(&depths[*b])).unwrap_or(0);
        let share = self.refine(deepest, &on_axis);
        let (distance, surface, outwards) = self.signed_distance(&on_axis(share));
        let depth = tool.radius - distance;
        let (pressed, moment) = depths
            .iter()
            .enumerate()
            .filter(|(_, d)| **d > 0.0)
            .fold((depth.max(0.0), depth.max(0.0) * share), |(sum, moment), (i, d)| {
                (sum + d, moment + d * share_of(i))
            });
        let middle = if pressed > 0.0 { self.signed_distance(&on_axis(moment / pressed)).1 } else { surface };
        Touch { point: base_from_object * middle, normal: base_from_object.rotation * -outwards, depth }
    }

    /// Distance to the convex surface is convex along a segment: narrows the best sample's neighbourhood by thirds.
    fn refine(&self, deepest: usize, on_axis: &impl Fn(f64) -> Point3<f64>) -> f64 {
        let (mut low, mut high) = (share_of(deepest.saturating_sub(1)), share_of((deepest + 1).min(SAMPLES - 1)));
        for _ in 0..12 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if self.signed_distance(&on_axis(a)).0 <= self.signed_distance(&on_axis(b)).0 {
                high = b;
            } else {
                low = a;
            }
        }
        0.5 * (low + high)
    }

    /// Distance from the object's surface (negative inside), nearest point of it, and the outward direction; object frame.
    fn signed_distance(&self, point: &Point3<f64>) -> (f64, Point3<f64>, Vector3<f64>) {
        let projection = self.shape().project_local_point(convert::point(point), false);
        let surface = Point3::from(convert::to_vector(projection.point));
        let outwards = if projection.is_inside { surface - point } else { point - surface };
        let distance = outwards.norm();
        let unit = if distance > 1e-12 { outwards / distance } else { Vector3::z() };
        (if projection.is_inside { -distance } else { distance }, surface, unit)
    }
}

fn share_of(sample: usize) -> f64 {
    sample as f64 / (SAMPLES - 1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ObjectModel, ObjectShape};
    use shared_mem::frames::Pose;

    const TOOL: Capsule = Capsule { segment: 0.148, radius: 0.012 };
    const TOOL_MASS: f64 = 2.0;

    fn floating_box() -> TableObject {
        let model = ObjectModel {
            shape: ObjectShape::Box { half_extents: Vector3::new(0.04, 0.03, 0.05) },
            mass: 0.3,
            centre_of_mass: Vector3::zeros(),
            friction: 0.3,
            tip_friction: 0.2,
            restitution: 0.0,
        };
        TableObject::new(&model, None).expect("a box")
    }

    /// An upright tool of [`TOOL_MASS`] that only translates, `tip` being the end of its segment.
    fn upright(tip: Point3<f64>) -> Isometry3<f64> {
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        Isometry3::from_parts((tip.coords + Vector3::z() * TOOL.segment).into(), turn)
    }

    /// Flies the tool against the box along x at `speed`; velocity of tool and box (its centre) afterwards, at `tip_height`
    /// over the box's centre. No table; gravity is taken out of the result.
    fn collide(law: ContactLaw, speed: f64, tip_height: f64, offset: f64, dt: f64) -> (Vector3<f64>, TableObject, f64) {
        let mut object = floating_box();
        let mut contact = Contact::default();
        let (mut tip, mut velocity) = (Point3::new(-0.054, offset, tip_height), Vector3::x() * speed);
        let (mut time, mut fallen) = (0.0, 0.0);
        while time < 0.03 {
            let touch = object.touch(&TOOL, &upright(tip));
            let (push, _) = contact.force(&law, &touch, &(velocity - Vector3::z() * fallen), &object, dt);
            velocity -= push.force * (dt / TOOL_MASS);
            fallen += 9.81 * dt;
            tip += (velocity - Vector3::z() * fallen) * dt;
            object.step(dt, Some(push));
            time += dt;
        }
        (velocity, object, fallen)
    }

    fn centre_velocity(object: &TableObject, fallen: f64) -> Vector3<f64> {
        object.velocity_at(&Point3::from(object.isometry().translation.vector)) + Vector3::z() * fallen
    }

    const FINE: f64 = 6.25e-5;

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
        for restitution in [0.1, 0.5, 0.9] {
            let law = ContactLaw { restitution, ..ContactLaw::nominal(0.0) };
            // The tool reaches from below the box to above it, so the middle of the pressure is the box's centre.
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
            let change = (coarse.1 - fine.1).norm() / fine.1.norm();
            assert!(change < 0.04, "{speed} m/s: spin changes by {change}");
        }
    }

    #[test]
    fn a_tool_flat_against_a_face_presses_at_the_middle_of_what_it_covers() {
        let object = floating_box();
        // Segment from 0.02 below the centre upwards beyond the top at 0.05.
        let touch = object.touch(&TOOL, &upright(Point3::new(-0.0515, 0.0, -0.02)));
        assert!((touch.depth - 0.0005).abs() < 1e-9, "{}", touch.depth);
        assert!((touch.normal - Vector3::x()).norm() < 1e-6);
        assert!((touch.point.z - 0.015).abs() < 0.005, "{}", touch.point);
        // Tilted by 3 degrees the tip alone presses.
        let tilt = Isometry3::rotation(Vector3::y() * -0.05);
        let tip = Point3::new(-0.0515, 0.0, -0.02);
        let tilted = Isometry3::translation(tip.x, tip.y, tip.z) * tilt * upright(Point3::origin());
        let touch = object.touch(&TOOL, &tilted);
        assert!((touch.point.z + 0.02).abs() < 0.006, "{}", touch.point);
    }

    #[test]
    fn a_tool_away_from_the_object_reports_the_gap() {
        let mut object = floating_box();
        object.set(&Pose::from_isometry(Isometry3::translation(0.5, 0.0, 0.0)), Vector3::zeros(), Vector3::zeros());
        let touch = object.touch(&TOOL, &upright(Point3::new(0.348, 0.0, 0.0)));
        assert!((touch.depth + 0.1).abs() < 1e-9, "{}", touch.depth);
    }

    #[test]
    fn the_dissipation_number_solves_its_equation() {
        for e in [0.05, 0.1, 0.5, 0.9] {
            let b = dissipation_number(e);
            assert!((b * (1.0 + e) - ((1.0 + b) / (1.0 - b * e)).ln()).abs() < 1e-6, "e {e}: b {b}");
        }
    }
}
