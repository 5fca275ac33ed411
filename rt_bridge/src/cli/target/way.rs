//! The way to a goal, looked along before the arm goes it: by the player that the bridge plays it with, in the limits and over
//! the table of the same cell.

use crate::motion::{Player, Target};
use crate::remark::{BrakeReason, Remark};
use crate::safety::Guard;
use anyhow::{Result, bail};
use shared_mem::msg::Joints;
use std::time::Duration;

/// Positions that differ by less are the same [rad].
const SAME: f64 = 1e-6;

/// Whether an arm that holds at `from` gets to `target`, all the way inside what `guard` keeps, within `longest`.
///
/// # Errors
/// What is in the way.
pub(super) fn check(guard: Guard, from: &Joints, target: &Target, longest: Duration) -> Result<()> {
    let Some(goal) = target.q else { bail!("a target without joints is no goal") };
    let (dof, period_s) = (guard.limits.dof, guard.period_s);
    let mut player = Player::new(guard, *from);
    let periods = (longest.as_secs_f64() / period_s) as u64;
    for _ in 0..periods {
        // As if its sender repeated it without end.
        refused(player.aim(target))?;
        let (point, remark) = player.advance();
        refused(remark)?;
        let (q, dq) = (point.q_d.iter().zip(&goal).take(dof), point.dq_d.iter().take(dof));
        if q.into_iter().all(|(q, goal)| (q - goal).abs() < SAME) && dq.into_iter().all(|dq| dq.abs() < SAME) {
            return Ok(());
        }
    }
    bail!("nothing moved: the way there takes longer than {} s; give it more --speed", longest.as_secs())
}

fn refused(remark: Option<Remark>) -> Result<()> {
    match remark {
        Some(Remark::PassedOver { why, .. }) => bail!("nothing moved: at that goal {why}; ask for another"),
        Some(Remark::Braked { why: BrakeReason::Limit(why), .. }) => {
            bail!("nothing moved: on the way there {why}; go by way of another pose, or with another --speed")
        }
        Some(Remark::Braked { why, .. }) => bail!("nothing moved: {why}"),
        Some(Remark::Refused { why, .. }) => bail!("nothing moved: {why}"),
        _ => Ok(()),
    }
}
