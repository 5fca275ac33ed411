//! The arm's joints while the tool pushes the object. Under an impedance controller they yield to the contact force by
//! `J' F / K_P`: a push of 1 N moves an encoder by a hundred times its resolution. When and where the tool touches, and how
//! the object resists, shows there more sharply than in any tracked pose.
//!
//! They say nothing about what the arm itself feels: gains and friction are known from where it moves alone to a ten
//! thousandth, and no engine yields to a contact as another does, so the little by which the contact force is off would bend
//! them. Their slopes by what the arm feels count as zero (a cut, as in modular inference: Liu, Bayarri and Berger 2009).

use super::arm_clips::ArmClips;
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
        let dof = (rows.len() - first).checked_div(ones.count()).unwrap_or(0);
        Self { rows: first..rows.len(), sigma: arm.sigma()[..dof].to_vec() }
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
}

#[cfg(test)]
mod tests {
    use super::super::evidence::{Evidence, Group};
    use super::super::fit::Bench;
    use super::super::sweep::Precision;
    use super::super::test_bench::{on_strokes, shipped};
    use crate::benchmark::world::{Fault, Kind, World};

    /// The largest slope in a group of a number of the baseline, by its name [sigma for 1 % of it].
    fn slope<E: Evidence>(bench: &Bench<'_, E>, name: &str, group: Group) -> f64 {
        let k = bench.library.settings.settings().iter().position(|setting| setting.name() == name);
        let k = k.expect("a number of that name");
        let (numbers, clips) = (bench.library.start(), [(0, vec![0.0; bench.scatter.count()])]);
        let swept = bench.linearise(&numbers, &[k], &clips, Precision::Exact).expect("a stroke");
        let slopes = swept.clips[0].matrix.column(1);
        let rows = bench.evidence.rows(0).iter().zip(slopes.iter());
        let of_group = rows.filter(|(row, _)| bench.evidence.channels()[row.channel].group == group);
        of_group.fold(0.0, |largest: f64, (_, slope)| largest.max((0.01 * numbers[k] * slope).abs()))
    }

    #[test]
    fn the_joints_in_contact_tell_how_heavy_the_object_is_and_nothing_about_gains() {
        let cell = shipped();
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
        on_strokes((&cell, &world), |bench, _| {
            let in_contact = slope(bench, "mass", Group::Contact);
            assert!(in_contact > 3.0 && in_contact > slope(bench, "mass", Group::Object), "{in_contact}");
            assert_eq!(slope(bench, "mass", Group::Arm), 0.0);
            assert_eq!(slope(bench, "stiffness[1]", Group::Contact), 0.0);
            assert!(slope(bench, "stiffness[1]", Group::Arm) > 1.0);
        });
    }
}
