//! The way to a goal, looked along before the arm goes it: by the player that the bridge plays it with, in the limits and over
//! the table of the same cell.

use super::LONGEST;
use crate::motion::{Player, Target};
use crate::remark::{BrakeReason, Remark};
use crate::safety::Guard;
use anyhow::{Result, bail};
use shared_mem::msg::Joints;

/// Positions that differ by less are the same [rad].
const SAME_POSITION: f64 = 1e-6;

/// Whether an arm that holds at `from` gets to `goal` at this share of its highest speeds, all the way inside what `guard` keeps,
/// within [`LONGEST`].
///
/// # Errors
/// What is in the way.
pub(super) fn check(guard: Guard, from: &Joints, goal: &Joints, speed: f64) -> Result<()> {
    let target = Target { stream: 1, q: Some(*goal), speed };
    let (dof, period_s) = (guard.limits.dof, guard.period_s);
    let mut player = Player::new(guard, *from);
    let periods = (LONGEST.as_secs_f64() / period_s) as u64;
    for _ in 0..periods {
        // As if its sender repeated it without end.
        refused(player.aim(&target))?;
        let (point, remark) = player.advance();
        refused(remark)?;
        let (q, dq) = (point.q_d.iter().zip(goal).take(dof), point.dq_d.iter().take(dof));
        if q.into_iter().all(|(q, goal)| (q - goal).abs() < SAME_POSITION)
            && dq.into_iter().all(|dq| dq.abs() < SAME_POSITION)
        {
            return Ok(());
        }
    }
    bail!("nothing moved: the way there takes longer than {} s; give it more --speed", LONGEST.as_secs())
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
