//! The arm's joints while the tool pushes the object. Under an impedance controller they yield to the contact force by
//! `J' F / K_P`: a push of 1 N moves an encoder by a hundred times its resolution. When and where the tool touches, and how
//! the object resists, shows there more sharply than in any tracked pose.
//!
//! They say nothing about what the arm itself feels: gains and friction are known from where it moves alone to a ten
//! thousandth, and no engine yields to a contact as another does, so the little by which the contact force is off would bend
//! them. Their slopes by what the arm feels count as zero (a cut, as in modular inference: Liu, Bayarri and Berger 2009).
//!
//! Nor do they say anything about a vertical force (`vertical.rs`).

use super::arm::ArmClips;
use super::object::{self, ObjectClips};
use super::{Row, StageName, vertical};
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;
use std::ops::Range;
use twin::arm::Joints;

/// The joints of a clip in contact: from when the tool may first touch until it has let go.
#[derive(Debug, Default)]
pub struct Contact {
    /// Which of [`ObjectClips::rows`] they are: one row for each joint, stamp by stamp, after all poses.
    pub rows: Range<usize>,
    /// One sigma of each joint's encoder [rad].
    sigma: Vec<f64>,
    /// For each stamp by how much a vertical force of 1 N at the tip turns each joint [N m].
    levers: Vec<Joints>,
}

impl Contact {
    /// Of a clip; nothing where there is no arm.
    pub fn of<F: Fn(&[f64]) -> Theta + Sync>(arm: Option<&ArmClips<F>>, object: &ObjectClips, clip: usize) -> Self {
        let Some(arm) = arm else { return Self::default() };
        let rows = object.rows(clip);
        // The last of the rows of the arm alone may be read a period late.
        let from_ns = arm.clip(clip).alone_until_ns.saturating_add(TICK_NS);
        let is_joint = |row: &object::Row| matches!(row.channel, object::Channel::Joint(_));
        let first = rows.iter().position(|row| is_joint(row) && row.stamp_ns >= from_ns).unwrap_or(rows.len());
        let ones = rows[first..].iter().filter(|row| row.channel == object::Channel::Joint(0));
        let measured = &object.clip(clip).measured;
        let lever = |row: &object::Row| {
            let place = measured.stamps_ns.partition_point(|stamp| *stamp < row.stamp_ns);
            arm.vertical_lever(measured.q_row(place.min(measured.len() - 1)))
        };
        let levers: Vec<Joints> = ones.map(lever).collect();
        let dof = (rows.len() - first).checked_div(levers.len()).unwrap_or(0);
        Self { rows: first..rows.len(), sigma: arm.sigma()[..dof].to_vec(), levers }
    }

    /// What its residuals are about. `all`: [`ObjectClips::rows`]; `first`: index of the first joint's channel.
    pub fn evidence(&self, all: &[object::Row], first: usize) -> Vec<Row> {
        let start_ns = all.first().map_or(0, |row| row.stamp_ns);
        let one = |(k, row): (usize, &object::Row)| {
            let time = row.stamp_ns.saturating_sub(start_ns) as f64 * 1e-9;
            Row { channel: first + k % self.sigma.len(), stage: StageName::Hit, regime: "in contact", time }
        };
        all[self.rows.clone()].iter().enumerate().map(one).collect()
    }

    /// Errors of the joints [rad] in sigmas of their encoders, but for what a vertical force would make of them under these
    /// gains [N m/rad].
    pub fn in_sigmas(&self, errors: &[f64], stiffness: &[f64]) -> Vec<f64> {
        let dof = self.sigma.len().max(1);
        let at = |(errors, lever): (&[f64], &Joints)| {
            let mut errors: Vec<f64> = errors.iter().zip(&self.sigma).map(|(error, sigma)| error / sigma).collect();
            let vertical = vertical::yields(lever, stiffness).zip(&self.sigma);
            vertical::take_out(&mut errors, &vertical.map(|(yields, sigma)| yields / sigma).collect::<Vec<_>>());
            errors
        };
        errors.chunks_exact(dof).zip(&self.levers).flat_map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use twin::arm::MAX_JOINTS;

    #[test]
    fn a_vertical_force_leaves_no_residual_and_a_horizontal_one_does() {
        let (stiffness, sigma) = ([600.0, 500.0, 50.0], vec![4e-6, 4e-6, 8e-6]);
        let mut lever = [0.0; MAX_JOINTS];
        lever[..3].copy_from_slice(&[0.02, -0.5, 0.1]);
        let contact = Contact { rows: 0..3, sigma, levers: vec![lever] };
        let turned = |lever: [f64; 3]| [0, 1, 2].map(|joint| 2.0 * lever[joint] / stiffness[joint]);
        let left = |lever| contact.in_sigmas(&turned(lever), &stiffness).iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        assert!(left([0.02, -0.5, 0.1]) < 1e-9);
        assert!(left([0.4, 0.1, 0.05]) > 100.0);
        let limp = contact.in_sigmas(&[4e-6, 8e-6, 8e-6], &[0.0; 3]);
        assert!(limp.iter().zip([1.0, 2.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{limp:?}");
    }
}
