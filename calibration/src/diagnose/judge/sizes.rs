//! How large the gap is in units of the hand, without effects and with what was found: joints, torques, the object.

use super::gap::{Residuals, explained};
use super::held_out::HeldOut;
use super::remainder::Left;
use super::tolerance::{self, Measured};
use crate::answer::diagnosis::{Change, Gap, Medians, TorqueRms};
use crate::diagnose::work::DiagnoseError;

use crate::diagnose::fit::bench::Bench;
use crate::words::in_unit;
use inference::admit::Admitted;
use inference::likelihood::object::Replays;
use inference::likelihood::{Evidence, setting};
use inference::statistics::median;
use shared_mem::cell::Tolerance;
use shared_mem::recording::Session;
use twin::replay;

/// Figures on held-out clips.
#[derive(Default)]
pub(in crate::diagnose) struct Sizes {
    /// Root mean square over joints and time [rad].
    pub(in crate::diagnose) joints: Change,
    /// Mean ADD [m].
    pub(in crate::diagnose) add: Change,
    /// Mean ADD-S [m].
    add_s: Change,
    median: Medians,
    /// Root mean square of each joint's torque beyond the predicted one [N m], along the measured motion.
    torque_rms: Option<TorqueRms>,
}

impl Sizes {
    /// Of two hypotheses, each with numbers that were not fitted to the clips that it is measured by.
    ///
    /// # Errors
    /// [`DiagnoseError`] when a clip cannot be replayed.
    pub(in crate::diagnose) fn of(
        bench: &Bench<'_>,
        both: [&HeldOut; 2],
        session: &Session,
        admitted: &Admitted,
    ) -> Result<Self, DiagnoseError> {
        match torque_rms(bench.evidence, both) {
            // Joints go where they were measured.
            Some(torque_rms) => Ok(Self { torque_rms: Some(torque_rms), ..Self::default() }),
            None => Self::replayed(bench, both, session, admitted),
        }
    }

    /// Without effects and with them; `of_object`: most of the gap is the object's.
    pub(in crate::diagnose) fn in_words(&self, of_object: bool) -> [String; 2] {
        let torques = self.torque_rms.as_ref().map(TorqueRms::over_joints).unwrap_or_default();
        [
            size_in_words(torques.before, self.joints.before, self.add.before.filter(|_| of_object)),
            size_in_words(torques.after, self.joints.after, self.add.after.filter(|_| of_object)),
        ]
    }

    /// Of clips at two hypotheses by the code of `twin replay`; of strokes by whoever simulates them.
    fn replayed(
        bench: &Bench<'_>,
        both: [&HeldOut; 2],
        session: &Session,
        admitted: &Admitted,
    ) -> Result<Self, DiagnoseError> {
        let [before, after] = both.map(|held_out| replayed(bench, held_out, session, admitted));
        let (before, after) = (before?, after?);
        let change = |of: &dyn Fn(&[replay::Gap]) -> Option<f64>| Change { before: of(&before), after: of(&after) };
        let mean = |of: fn(&replay::Gap) -> Option<f64>| {
            change(&|gaps| {
                let all: Vec<f64> = gaps.iter().filter_map(of).collect();
                (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
            })
        };
        let middle = |of: fn(&replay::Gap) -> Option<f64>| change(&|gaps| median(gaps.iter().filter_map(of)));
        let squares = mean(mean_square_of_joints);
        let rms = |gap: &replay::Gap| mean_square_of_joints(gap).map(f64::sqrt);
        Ok(Self {
            joints: Change { before: squares.before.map(f64::sqrt), after: squares.after.map(f64::sqrt) },
            add: mean(|gap| gap.object_add_m),
            add_s: mean(|gap| gap.object_add_s_m),
            median: Medians {
                joint_rms_rad: middle(rms),
                object_add_m: middle(|gap| gap.object_add_m),
                object_add_s_m: middle(|gap| gap.object_add_s_m),
            },
            torque_rms: None,
        })
    }

    /// With the gap in sigmas: what two hypotheses leave.
    pub(in crate::diagnose) fn gap(self, [before, shown]: [&Residuals; 2], left: Left, seed: u64) -> Gap {
        Gap {
            unit: "sigma",
            before: before.mean_square(),
            after: shown.mean_square(),
            floor: before.floor(),
            shrink: shown.shrink(before, seed),
            explainable_fraction: explained(before.mean_square(), shown.mean_square(), before.floor()),
            joint_rms_rad: self.joints,
            torque_rms: self.torque_rms,
            object_add_m: self.add,
            object_add_s_m: self.add_s,
            median: self.median,
            sensors: left.sensors,
            joints: left.joints,
        }
    }
}

/// Whether the gap is of no interest without effects and with them.
pub(in crate::diagnose) fn within_tolerance(
    bench: &Bench<'_>,
    both: [&HeldOut; 2],
    session: &Session,
    admitted: &Admitted,
) -> Result<[bool; 2], DiagnoseError> {
    let stated = &session.cell.tolerance;
    let of = |measured: [Measured; 2]| measured.map(|measured| tolerance::holds(stated, measured));
    if let Some(torques) = torque_rms(bench.evidence, both) {
        let Change { before, after } = torques.over_joints();
        return Ok(of([before, after].map(|torques| Measured { torques, ..Measured::default() })));
    }
    if *stated == Tolerance::default() {
        return Ok([false; 2]);
    }
    let Sizes { joints, add, .. } = Sizes::replayed(bench, both, session, admitted)?;
    let measured = |joints, object| Measured { joints, object, torques: None };
    Ok(of([measured(joints.before, add.before), measured(joints.after, add.after)]))
}

/// How large the gap is, in units of the hand: of the object where there is such a figure, else of the joints.
fn size_in_words(torques: Option<f64>, joints: Option<f64>, add: Option<f64>) -> String {
    if let Some(torques) = torques {
        return format!("{} RMS over all joints", in_unit("N m", torques));
    }
    match (joints, add) {
        (_, Some(add)) => format!("{} ADD", in_unit("m", add)),
        (Some(rms), None) => format!("{} RMS over all joints", in_unit("rad", rms)),
        (None, None) => "of unknown size".into(),
    }
}

/// What every clip leaves at numbers that were not fitted to it.
fn replayed(
    bench: &Bench<'_>,
    held_out: &HeldOut,
    session: &Session,
    admitted: &Admitted,
) -> Result<Vec<replay::Gap>, DiagnoseError> {
    let (engine, nominal) = (bench.evidence.engine(), setting::complete(&session.cell, None)?);
    let mut gaps = Vec::new();
    for (hypothesis, clips) in &held_out.fits {
        let replays = Replays::new(&session.cell, &bench.library.theta(&hypothesis.full), (engine, &nominal))?;
        for clip in clips {
            let (_, _, report) = replays.replay(admitted.clips[*clip].clone())?;
            gaps.push(report.gap);
        }
    }
    Ok(gaps)
}

/// Over joints and time [rad^2].
fn mean_square_of_joints(gap: &replay::Gap) -> Option<f64> {
    let rms = gap.joint_rms_rad.as_ref()?;
    Some(rms.iter().map(|rms| rms * rms).sum::<f64>() / rms.len() as f64)
}

/// Root mean square of each joint's torque beyond the predicted one at two hypotheses [N m]; `None` where torques are no channel
/// of their own.
fn torque_rms(evidence: &Evidence<'_>, both: [&HeldOut; 2]) -> Option<TorqueRms> {
    let sigma = evidence.torque_sigma()?;
    let [before, after] = both.map(|held_out| {
        let of = |(channel, sigma): (usize, &f64)| {
            let rows = held_out.left.clips.iter().flat_map(|(clip, values)| evidence.rows(*clip).iter().zip(values));
            let squares: Vec<f64> = rows
                .filter(|(row, _)| row.channel == channel)
                .map(|(_, residual)| (residual * sigma).powi(2))
                .collect();
            (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
        };
        sigma.iter().enumerate().map(of).collect()
    });
    Some(TorqueRms { before, after })
}
