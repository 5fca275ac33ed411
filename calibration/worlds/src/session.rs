//! Records a session in a world: the clips that a cell with this world's truth would give, with the noise of its sensors.
//!
//! Excitations and strokes are drawn from the world's number, so no two worlds see the same motion.

use crate::world::{Kind, Outside, World};
use capture::body::Body;
use capture::program::{Program, SPEEDS, Standing, Wish};
use capture::request::{self, Request};
use capture::{limits, plan, stroke};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use shared_mem::cell::{ClipKind, PoseNoise};
use shared_mem::frames::Pose;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::msg::motion::SetPoint;
use shared_mem::origin::Origin;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use shared_mem::theta::{EffectTheta, Theta};
use std::f64::consts::PI;
use twin::arm::{JointState, ModelError};
use twin::control::CommandTrack;
use twin::rollout::{CellRollout, CellTrace, Course, ObjectState};
use twin::sim::SimError;

/// One sigma of what the arm reports: positions [rad], velocities [rad/s], torques [N m].
const ARM_NOISE: [f64; 3] = [4e-6, 1.5e-3, 0.04];
/// Poses a second.
const POSE_RATE: f64 = 60.0;
/// Length of an excitation [s].
const EXCITATION: f64 = 6.0;
/// Tries to find a stroke that the arm can do.
const TRIES: usize = 200;
/// An arm further than this from its command does not follow but hangs [rad].
const HANGING: f64 = 0.5;

/// A world gives no session.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The cell has no arm that can be planned for.
    #[error(transparent)]
    Arm(#[from] ModelError),
    /// It cannot be simulated.
    #[error(transparent)]
    Cell(#[from] SimError),
    /// No motion fits.
    #[error("no motion fits the cell ({0}); give a cell whose arm reaches its table")]
    Motion(String),
    /// The hidden effects let the arm fall.
    #[error("the arm of world {0} does not follow its commands; draw another world")]
    Hanging(u64),
}

/// The clips of a world, `count` of them.
///
/// # Errors
/// [`SessionError`] when the cell has no arm, or none that can do the motions.
pub fn record(world: &World, count: usize) -> Result<Vec<Clip>, SessionError> {
    record_paced(world, &vec![1.0; count])
}

/// The same with a clip for each pace: how many times as fast as planned its motion is played.
///
/// # Errors
/// As [`record`].
pub fn record_paced(world: &World, paces: &[f64]) -> Result<Vec<Clip>, SessionError> {
    let context = RecordingContext { world, body: Body::of(&world.cell)? };
    paces.iter().enumerate().map(|(i, pace)| context.clip(i, paces.len(), *pace)).collect()
}

struct RecordingContext<'a> {
    world: &'a World,
    body: Body,
}

impl RecordingContext<'_> {
    fn clip(&self, index: usize, count: usize, pace: f64) -> Result<Clip, SessionError> {
        let mut rng = Pcg64::seed_from_u64(self.world.number.wrapping_mul(1000) + index as u64);
        let object = self.place(&mut rng);
        let points = match self.world.kind {
            Kind::Excitation => self.excitation(index)?,
            Kind::Strokes => self.stroke(&object, &mut rng)?,
        };
        let points = if pace == 1.0 { points } else { paced(&points, pace) };
        let joints_ns: Vec<u64> = (0..points.len() as u64).map(|i| START_NS + i * 1_000_000).collect();
        let desired = self.desired(&points, &joints_ns);
        let acting = self.acting(&desired, &mut rng);
        let theta = self.theta(index as f64 / count as f64, &mut rng);
        let mut rollout = CellRollout::new(&self.world.cell, Some(&theta))?;
        rollout.refine(self.world.parts);
        let commands = CommandTrack::new(&acting).ok_or_else(|| SessionError::Motion("an empty plan".into()))?;
        let strokes = self.world.kind == Kind::Strokes;
        let standing = ObjectState::at_rest(Pose::from_isometry(object));
        let start = JointState::at_rest(points[0].q_d);
        rollout.start(START_NS, Some(&start), strokes.then_some(&standing), Some(&commands));
        let poses_ns = self.pose_stamps(&joints_ns, strokes, &mut rng);
        let mut trace = CellTrace::default();
        let course = Course { commands: Some(&commands), joints_ns: &joints_ns, poses_ns: &poses_ns };
        rollout.run(&course, &mut trace);
        self.reported(index, desired, &joints_ns, (&trace, &poses_ns), &mut rng)
    }

    fn excitation(&self, index: usize) -> Result<Vec<SetPoint>, SessionError> {
        let request = Request {
            start: *self.body.model().ready(),
            kind: request::Kind::Multisine,
            moving: [true; MAX_JOINTS],
            amplitude: 0.35,
            duration: EXCITATION,
            seed: self.world.number.wrapping_mul(1000) + 500 + index as u64,
            floor: 0.1,
        };
        let limits = limits::of(&self.world.cell, &self.body);
        let plan =
            plan::plan(&request, &limits, &self.body).map_err(|error| SessionError::Motion(error.to_string()))?;
        Ok(plan.set_points)
    }

    /// A stroke as a capture makes them: from any side, at any speed, somewhere on the object.
    fn stroke(&self, object: &Isometry3<f64>, rng: &mut Pcg64) -> Result<Vec<SetPoint>, SessionError> {
        let size = self.world.cell.object().and_then(|object| object.size).unwrap_or([0.1; 3]);
        let limits = limits::of(&self.world.cell, &self.body);
        let program = Program::of(&self.world.cell, size, &self.body, &limits);
        let (x, y) = (object.translation.x, object.translation.y);
        let standing = Standing { place: [x, y], yaw: object.rotation.euler_angles().2 };
        let mut refused = String::new();
        for _ in 0..TRIES {
            let wish = Wish {
                heading: rng.random_range(-PI..PI),
                speed: rng.random_range(SPEEDS[0]..SPEEDS[1]),
                aside: rng.random_range(-1.0..1.0),
                height: rng.random_range(0.0..1.0),
            };
            match stroke::plan(&program.stroke(&wish, &standing), self.body.model().ready(), &limits, &self.body) {
                Ok(plan) => return Ok(plan.set_points),
                Err(error) => refused = error.to_string(),
            }
        }
        Err(SessionError::Motion(refused))
    }

    /// Somewhere on the table in front of the arm, turned any way.
    fn place(&self, rng: &mut Pcg64) -> Isometry3<f64> {
        let height = self.world.cell.object().and_then(|object| object.size).map_or(0.0, |size| 0.5 * size[2]);
        let table = self.world.cell.table.as_ref().map_or(0.0, |table| table.height);
        let ([x, y], _) = self.world.cell.object_start();
        let place = [x + rng.random_range(-0.05..0.05), y + rng.random_range(-0.05..0.05)];
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rng.random_range(-PI..PI));
        Isometry3::from_parts(Translation3::new(place[0], place[1], table + height), turn)
    }

    fn desired(&self, points: &[SetPoint], stamps_ns: &[u64]) -> JointSeries {
        let dof = self.body.model().dof();
        let flat =
            |of: fn(&SetPoint) -> &[f64; MAX_JOINTS]| points.iter().flat_map(|p| of(p)[..dof].to_vec()).collect();
        JointSeries { stamps_ns: stamps_ns.to_vec(), dof, q: flat(|p| &p.q_d), dq: flat(|p| &p.dq_d), tau: Vec::new() }
    }

    /// The commands that reach the controller, where they are not the logged ones.
    fn acting(&self, desired: &JointSeries, rng: &mut Pcg64) -> JointSeries {
        let mut acting = desired.clone();
        let dof = desired.dof;
        match self.world.outside {
            Some(Outside::HeldCommands) => {
                let mut row = 0;
                while row < desired.len() {
                    let held = rng.random_range(5..60).min(desired.len() - row);
                    for i in 1..held {
                        acting.q.copy_within(row * dof..(row + 1) * dof, (row + i) * dof);
                        acting.dq.copy_within(row * dof..(row + 1) * dof, (row + i) * dof);
                    }
                    row += held + rng.random_range(20..200);
                }
            }
            Some(Outside::Hose) => {
                // A spring of a few N m/rad pulls back from half the excursion on; a command displaced by what the
                // controller yields to it does the same.
                let joint = rng.random_range(0..dof.min(4));
                let from = desired.q_row(0)[joint] + 0.05;
                for row in 0..desired.len() {
                    acting.q[row * dof + joint] -= 0.05 * (desired.q_row(row)[joint] - from).max(0.0);
                }
            }
            _ => {}
        }
        acting
    }

    /// The parameters of one clip; `share` of the session has passed.
    fn theta(&self, share: f64, rng: &mut Pcg64) -> Theta {
        let mut theta = self.world.hidden.clone();
        let scatter: f64 = StandardNormal.sample(rng);
        if let Some(friction) = theta.object.as_mut().and_then(|object| object.friction.as_mut()) {
            *friction *= (self.world.friction_scatter * scatter).exp();
            if self.world.outside == Some(Outside::Wear) {
                *friction *= 0.8 + 0.4 * share;
            }
        }
        match self.world.outside {
            Some(Outside::Cooling) => {
                theta.effects.push(effect("joint_viscous_friction", "viscous", 1.0 + 5.0 * share))
            }
            Some(Outside::Exposure) => {
                theta.effects.push(effect("camera_latency", "latency", rng.random_range(0.0..0.06)));
            }
            _ => {}
        }
        theta
    }

    fn pose_stamps(&self, joints_ns: &[u64], wanted: bool, rng: &mut Pcg64) -> Vec<u64> {
        let period_ns = (1e9 / POSE_RATE) as u64;
        let first = START_NS + rng.random_range(0..period_ns);
        let last = joints_ns.last().copied().unwrap_or(START_NS);
        (0..).map(|i| first + i * period_ns).take_while(|stamp| wanted && *stamp <= last).collect()
    }

    /// What the sensors make of it.
    fn reported(
        &self,
        index: usize,
        mut desired: JointSeries,
        joints_ns: &[u64],
        (trace, poses_ns): (&CellTrace, &[u64]),
        rng: &mut Pcg64,
    ) -> Result<Clip, SessionError> {
        let dof = desired.dof;
        let mut measured = JointSeries { stamps_ns: joints_ns.to_vec(), dof, ..JointSeries::default() };
        for reading in &trace.joints {
            for joint in 0..dof {
                let mut noise = |sigma: f64| {
                    sigma * <StandardNormal as rand_distr::Distribution<f64>>::sample(&StandardNormal, rng)
                };
                measured.q.push(reading.state.q[joint] + noise(ARM_NOISE[0]));
                measured.dq.push(reading.state.dq[joint] + noise(ARM_NOISE[1]));
                measured.tau.push(reading.tau_J[joint] + noise(ARM_NOISE[2]));
                desired.tau.push(reading.tau_J_d[joint]);
            }
        }
        let follows = measured.q.iter().zip(&desired.q).all(|(q, q_d)| (q - q_d).abs() < HANGING);
        if !follows {
            return Err(SessionError::Hanging(self.world.number));
        }
        let poses = trace.poses.iter().map(|pose| self.tracked(&pose.isometry(), rng)).collect();
        Ok(Clip {
            file: format!("clip_{index:02}.mcap").into(),
            kind: if poses_ns.is_empty() { ClipKind::Excitation } else { ClipKind::ControlHitSlide },
            // A reading tells the mean over the period that ends there.
            torques_end_at_rows: true,
            origins: Origin::Simulation.into(),
            joint_names: self.body.model().joint_names().to_vec(),
            desired,
            measured,
            object: ObjectSeries { stamps_ns: poses_ns.to_vec(), poses },
            others: Vec::new(),
            warnings: Vec::new(),
            damage: None,
        })
    }

    /// A pose as the tracker reports it.
    fn tracked<A, B>(&self, pose: &Isometry3<f64>, rng: &mut Pcg64) -> Pose<A, B> {
        let exact = PoseNoise { position: 0.0, rotation: 0.0 };
        let noise = self.world.cell.object().and_then(|object| object.pose_noise).unwrap_or(exact);
        let mut draw = |sigma: f64| {
            Vector3::from_fn(|_, _| {
                sigma * <StandardNormal as rand_distr::Distribution<f64>>::sample(&StandardNormal, rng)
            })
        };
        let (shift, turn) = (draw(noise.position), draw(noise.rotation));
        let mut place = pose.translation.vector;
        if self.world.outside == Some(Outside::Lens) {
            let ([x, y], _) = self.world.cell.object_start();
            let off = Vector3::new(place.x - x, place.y - y, 0.0);
            place += off * (3.0 * off.norm_squared());
        }
        let turned = UnitQuaternion::from_scaled_axis(turn) * pose.rotation;
        Pose::from_isometry(Isometry3::from_parts(Translation3::from(place + shift), turned))
    }
}

/// The same way, so many times as fast.
fn paced(points: &[SetPoint], pace: f64) -> Vec<SetPoint> {
    let rows = ((points.len() - 1) as f64 / pace) as usize + 1;
    let at = |row: usize| {
        let place = row as f64 * pace;
        let before = (place as usize).min(points.len() - 1);
        let (a, b) = (&points[before], &points[(before + 1).min(points.len() - 1)]);
        let share = place - before as f64;
        let mix = |of: fn(&SetPoint) -> &[f64; MAX_JOINTS], times: f64| {
            std::array::from_fn(|joint| times * (of(a)[joint] + share * (of(b)[joint] - of(a)[joint])))
        };
        SetPoint { q_d: mix(|p| &p.q_d, 1.0), dq_d: mix(|p| &p.dq_d, pace) }
    };
    (0..rows).map(at).collect()
}

/// Stamp of a clip's first row [ns].
const START_NS: u64 = 1_000_000_000;

fn effect(name: &str, parameter: &str, value: f64) -> EffectTheta {
    EffectTheta { name: name.to_owned(), parameters: [(parameter.to_owned(), value.into())].into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::world::Fault;
    use shared_mem::cell::Cell;
    use std::path::Path;

    fn shipped() -> Cell {
        let text = include_str!("../../../config/fr3_cell.toml");
        shared_mem::toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file")
    }

    fn session(kind: Kind, fault: Fault) -> Vec<Clip> {
        record(&World::draw(3, kind, fault, &shipped()), 2).expect("a session")
    }

    #[test]
    fn strokes_hit_the_object_and_it_slides_to_rest() {
        for clip in session(Kind::Strokes, Fault::Nothing) {
            let place = |i: usize| clip.object.poses[i].isometry().translation.vector;
            let last = clip.object.len() - 1;
            let (way, end) = ((place(last) - place(0)).norm(), (place(last) - place(last - 5)).norm());
            assert!(way > 0.03, "it was hit: {way} m");
            assert!(end < 0.006, "it rests: {end} m");
        }
    }

    #[test]
    fn the_same_world_gives_the_same_session_and_no_two_clips_are_alike() {
        let (once, again) = (session(Kind::Excitation, Fault::Single(3)), session(Kind::Excitation, Fault::Single(3)));
        assert!(once == again, "another session");
        assert!(once[0].measured.q != once[1].measured.q, "the same clip twice");
    }

    #[test]
    fn a_motion_at_half_its_pace_goes_the_same_way_in_twice_the_time() {
        let world = World::draw(3, Kind::Excitation, Fault::Nothing, &shipped());
        let (whole, half) = (record(&world, 1).expect("a session"), record_paced(&world, &[0.5]).expect("a session"));
        let (whole, half) = (&whole[0].desired, &half[0].desired);
        assert!(half.len().abs_diff(2 * whole.len()) <= 2);
        for row in (0..whole.len()).step_by(100) {
            for joint in 0..whole.dof {
                assert!((whole.q_row(row)[joint] - half.q_row(2 * row)[joint]).abs() < 1e-9);
                let [fast, slow] = [(whole, row), (half, 2 * row)].map(|(s, row)| s.dq_row(row).expect("dq")[joint]);
                assert!((0.5 * fast - slow).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_disturbance_outside_the_registry_changes_what_is_recorded() {
        for kind in [Kind::Excitation, Kind::Strokes] {
            let plain = session(kind, Fault::Nothing);
            for outside in Outside::of(kind) {
                let disturbed = session(kind, Fault::Outside(*outside));
                let same = (&plain[0].measured, &plain[0].object) == (&disturbed[0].measured, &disturbed[0].object);
                assert!(!same, "{}: nothing happens", outside.name());
                assert!(plain[0].desired.q == disturbed[0].desired.q, "{}: the log must not tell", outside.name());
            }
        }
    }
}
