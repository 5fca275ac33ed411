//! The arm's joints while the tool pushes the object. Under an impedance controller they yield to the contact force by
//! `J' F / K_P`: a push of 1 N moves an encoder by a hundred times its resolution. When and where the tool touches, and how
//! the object resists, shows there more sharply than in any tracked pose.

use super::arm_clips::{Alone, ArmClips};
use super::evidence::{Row, StageName};
use crate::forward::object::{self, ObjectClips};
use shared_mem::theta::Theta;
use std::ops::Range;
use twin::rollout::TICK_NS;

/// The joints of a clip in contact: from when the tool may first touch until it has let go.
#[derive(Debug, Default)]
pub struct Contact {
    /// Which of [`ObjectClips::rows`] they are: one row for each joint, stamp by stamp, after all poses.
    pub rows: Range<usize>,
    /// Their stamps, one for all joints.
    pub stamps_ns: Vec<u64>,
    /// One sigma of each joint's encoder [rad].
    sigma: Vec<f64>,
}

impl Contact {
    /// Of a clip; nothing where there is no arm.
    pub fn of<F: Fn(&[f64]) -> Theta + Sync>(arm: Option<&ArmClips<F>>, object: &ObjectClips, clip: usize) -> Self {
        let Some(arm) = arm else { return Self::default() };
        let rows = object.rows(clip);
        // The last of the rows of the arm alone may be read a period late.
        let from_ns = arm.alone_until_ns(clip).saturating_add(TICK_NS);
        let is_joint = |row: &object::Row| matches!(row.channel, object::Channel::Joint(_));
        let first = rows.iter().position(|row| is_joint(row) && row.stamp_ns >= from_ns).unwrap_or(rows.len());
        let ones = rows[first..].iter().filter(|row| row.channel == object::Channel::Joint(0));
        let stamps_ns: Vec<u64> = ones.map(|row| row.stamp_ns).collect();
        let dof = (rows.len() - first).checked_div(stamps_ns.len()).unwrap_or(0);
        Self { rows: first..rows.len(), stamps_ns, sigma: arm.sigma()[..dof].to_vec() }
    }

    /// What its residuals are about. `all`: [`ObjectClips::rows`]; `first`: index of the first joint's channel.
    #[must_use]
    pub fn evidence(&self, all: &[object::Row], first: usize) -> Vec<Row> {
        let start_ns = all.first().map_or(0, |row| row.stamp_ns);
        let one = |(k, row): (usize, &object::Row)| {
            let time = row.stamp_ns.saturating_sub(start_ns) as f64 * 1e-9;
            Row { channel: first + k % self.sigma.len(), stage: StageName::Hit, regime: "in contact", time }
        };
        all[self.rows.clone()].iter().enumerate().map(one).collect()
    }

    /// Errors of the joints [rad] in sigmas of their encoders.
    pub fn in_sigmas(&self, errors: &[f64]) -> impl Iterator<Item = f64> {
        errors.iter().zip(self.sigma.iter().cycle()).map(|(error, sigma)| error / sigma)
    }

    /// The residuals in contact where the arm has turned from what it would do alone `before` to what it does `now`, while
    /// the contact force stays what it was: they change by as much as the arm alone. `known`: all residuals before, these last.
    pub fn moved(&self, known: &[f64], before: &Alone, now: &Alone) -> impl Iterator<Item = f64> {
        let change = |(was, is): (&twin::arm::Joints, &twin::arm::Joints)| -> Vec<f64> {
            self.sigma.iter().zip(was.iter().zip(is)).map(|(sigma, (was, is))| (was - is) / sigma).collect()
        };
        let changes: Vec<f64> = before.q.iter().zip(&now.q).flat_map(change).collect();
        known[known.len() - self.rows.len()..].iter().zip(changes).map(|(known, change)| known + change)
    }
}

#[cfg(test)]
mod tests {
    use super::super::evidence::{Base, Evidence, Group, Reach};
    use super::super::test_bench::{on_strokes, shipped};
    use crate::benchmark::world::{Fault, Kind, World};
    use crate::estimate::ClipModel;

    /// What the residuals of the group change by when a number of the baseline, by its name, is 2 % larger.
    fn changes(name: &str, group: Group, reach: Reach) -> Vec<f64> {
        let cell = shipped();
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
        on_strokes((&cell, &world), |bench, _| {
            let (evidence, library) = (bench.evidence, bench.library);
            let k = library.unknowns.iter().position(|unknown| unknown.name == name).expect("a number of that name");
            let own = vec![0.0; bench.scatter.count()];
            let mut numbers = library.start();
            let (mut before, mut after) = (Vec::new(), Vec::new());
            evidence.residuals(0, &numbers, &own, &mut before).expect("a stroke");
            let base = Base { numbers: &library.start(), residuals: &before };
            numbers[k] *= 1.02;
            evidence.changed(0, (&numbers, &own), (reach, base), &mut after).expect("a stroke");
            let of_group = |row: &super::Row| evidence.channels()[row.channel].group == group;
            let all = evidence.rows(0).iter().zip(after.iter().zip(&before));
            all.filter(|(row, _)| of_group(row)).map(|(_, (after, before))| after - before).collect()
        })
    }

    fn largest(values: &[f64]) -> f64 {
        values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()))
    }

    #[test]
    fn the_joints_feel_the_object_in_contact_and_only_there() {
        let felt = changes("mass", Group::Contact, Reach::All);
        assert!(felt.len() >= 7 * 5 && largest(&felt) > 3.0, "{} rows, {} sigmas", felt.len(), largest(&felt));
        assert_eq!(largest(&changes("mass", Group::Arm, Reach::All)), 0.0);
    }

    #[test]
    fn what_turns_the_arm_alone_turns_it_in_contact_about_as_much() {
        let whole = changes("stiffness[1]", Group::Contact, Reach::All);
        let alone = changes("stiffness[1]", Group::Contact, Reach::Arm);
        let off: Vec<f64> = whole.iter().zip(&alone).map(|(whole, alone)| whole - alone).collect();
        assert!(largest(&whole) > 10.0, "{}", largest(&whole));
        let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
        assert!(rms(&off) < 0.5 * rms(&whole), "{} of {}", rms(&off), rms(&whole));
    }
}
