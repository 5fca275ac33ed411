//! What a person typed as joints that the arm can get to, or what is wrong with it. A goal that is out of reach is no goal:
//! going to the nearest place instead is for streams, whose senders see the arm.

use super::way;
use crate::safety::{Guard, Limits, Workspace};
use anyhow::{Result, ensure};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use shared_mem::cell::Cell;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::{Joints, joints_from};
use shared_mem::time::TICK_NS;
use std::path::Path;
use twin::arm::ArmModel;

/// How far the flange may be from the pose that was asked for [m].
const MAX_MISS: f64 = 1e-3;
/// How far its axes may be turned from those that were asked for [rad].
const TURNED: f64 = 5e-3;

/// Where the arm is to go.
#[derive(Debug)]
pub(super) struct Goal {
    /// The joints [rad].
    pub(super) q: Joints,
    /// The flange's pose that was asked for, and the arm by which it is measured.
    pose: Option<(ArmModel, Isometry3<f64>)>,
}

impl Goal {
    /// Joints of an arm of which nothing else is known: the bridge looks whether it may rest there.
    ///
    /// # Errors
    /// Another number of joints than the arm has.
    pub(super) fn unseen(q: &[f64], first: &ArmState) -> Result<Self> {
        let has = first.dof as usize;
        ensure!(q.len() == has, "the arm has {has} joints and {} positions were given; give one for each", q.len());
        Ok(Self { q: joints_from(q), pose: None })
    }

    /// How far the flange of an arm at these joints is from the pose that was asked for [m].
    pub(super) fn off(&self, q: &Joints) -> Option<f64> {
        self.pose.as_ref().map(|(model, pose)| {
            let flange = model.flange(q).isometry();
            (flange.translation.vector - pose.translation.vector).norm()
        })
    }
}

/// The arm in its cell, and where it holds.
#[derive(Debug)]
pub(super) struct Place {
    model: ArmModel,
    guard: Guard,
    first: ArmState,
}

impl Place {
    /// In the cell of this file, which has to describe the arm that the bridge shows.
    ///
    /// # Errors
    /// The file is none, or describes another arm.
    pub(super) fn of(file: &Path, first: &ArmState) -> Result<Self> {
        let cell = Cell::read(file)?;
        let model = ArmModel::from_cell(&cell)?;
        ensure!(
            model.has_geometry() && model.dof() == first.dof as usize,
            "{} describes another arm than the bridge drives; give the bridge's own --cell",
            file.display()
        );
        let guard = Guard {
            limits: Limits::of(&cell, &model),
            workspace: Workspace::of(&cell, &model),
            // The way is that of the commands: how the arm comes after them is the bridge's to watch.
            trailing: None,
            period_s: TICK_NS as f64 * 1e-9,
        };
        Ok(Self { model, guard, first: *first })
    }

    /// Joints, at a share of the highest speeds.
    ///
    /// # Errors
    /// The arm cannot get there.
    pub(super) fn joints(self, q: &[f64], speed: f64) -> Result<Goal> {
        let goal = Goal::unseen(q, &self.first)?;
        self.reached(goal, speed)
    }

    /// A pose of the flange: position [m] and quaternion w, x, y, z.
    ///
    /// # Errors
    /// As above.
    pub(super) fn pose(self, [x, y, z, w, i, j, k]: &[f64; 7], speed: f64) -> Result<Goal> {
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(*w, *i, *j, *k));
        let pose = Isometry3::from_parts(Translation3::new(*x, *y, *z), turn);
        self.flange(pose, speed)
    }

    /// The flange's pose, moved along the axes of the base frame [m].
    ///
    /// # Errors
    /// As above.
    pub(super) fn shifted(self, by: &[f64; 3], speed: f64) -> Result<Goal> {
        let pose = Translation3::from(*by) * self.model.flange(&self.first.q_d).isometry();
        self.flange(pose, speed)
    }

    fn flange(self, pose: Isometry3<f64>, speed: f64) -> Result<Goal> {
        let nearest = self.model.nearest(&self.guard.limits, &self.first.q_d, &pose);
        ensure!(
            nearest.off <= MAX_MISS && nearest.turned <= TURNED,
            "nothing moved: that pose is out of reach from where the arm holds: the flange would be {:.1} mm and {:.1} degrees \
             from it; ask for another, or go by way of one between",
            1e3 * nearest.off,
            nearest.turned.to_degrees()
        );
        let goal = Goal { q: nearest.q, pose: Some((self.model.clone(), pose)) };
        self.reached(goal, speed)
    }

    fn reached(self, goal: Goal, speed: f64) -> Result<Goal> {
        way::check(self.guard, &self.first.q_d, &goal.q, speed)?;
        Ok(goal)
    }
}
