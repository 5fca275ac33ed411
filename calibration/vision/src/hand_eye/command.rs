//! `calibration hand-eye`: from what was given to the answer.

use super::answer::{Answer, ViewAnswer, mounted, not_identifiable};
use super::fit::{Fit, Judged, fit};
use super::input::{self, Source, Taken};
use super::view::View;
use anyhow::ensure;
use shared_mem::ending;
use shared_mem::hand_eye::{HandEye, HandEyeResidual, Mount, MountedPose};
use shared_mem::output::Destination;
use std::time::Instant;

/// What was asked for.
#[derive(Debug, Clone)]
pub struct Options {
    /// Where pictures and poses come from.
    pub source: Source,
    /// Who holds the camera.
    pub mount: Mount,
    /// Where the mount goes.
    pub out: Option<Destination>,
}

/// An arm whose poses are off by more than this is not that of the pictures [m].
const ARM_OFF: f64 = 3e-3;
/// Fewer pictures than this are few.
const FEW_PICTURES: usize = 8;

/// Finds the mount, and writes it where it is identified.
///
/// # Errors
/// One line: what is missing or does not fit together, and what to do.
pub fn run(options: &Options) -> anyhow::Result<Answer> {
    let began = Instant::now();
    let Taken { views, without_board, camera, remarks } = input::taken(&options.source)?;
    ensure!(
        !views.is_empty() || without_board.is_empty(),
        "no picture shows the board: check --board, the light, and that the intrinsics are of this camera"
    );
    let found = fit(options.mount, &views)?;
    ensure!(!ending::asked(), "interrupted; nothing was written, start again");
    let board = Some(MountedPose::new(&found.chain.board));
    let (mounted, eye_in_hand) = (Some(mounted(&found)), options.mount == Mount::EyeInHand);
    let hand_eye = HandEye {
        mount: options.mount,
        EE_T_camera: mounted.filter(|_| eye_in_hand),
        O_T_camera: mounted.filter(|_| !eye_in_hand),
        O_T_board: board.filter(|_| eye_in_hand),
        EE_T_board: board.filter(|_| !eye_in_hand),
        camera: Some(camera),
        residual: Some(residual(&found, &views)),
    };
    let answer = Answer {
        warnings: remarks.into_iter().chain(warnings(&found, &without_board)).collect(),
        views: views.iter().zip(&found.views).map(|(view, judged)| view_answer(view, judged)).collect(),
        without_board,
        not_identifiable: found.open.iter().map(|open| not_identifiable(open, &found)).collect(),
        hand_eye,
        seconds: began.elapsed().as_secs_f64(),
    };
    if let Some(out) = options.out.as_ref().filter(|_| answer.not_identifiable.is_empty()) {
        out.write(answer.hand_eye.to_toml())?;
    }
    Ok(answer)
}

fn residual(found: &Fit, views: &[View]) -> HandEyeResidual {
    let used: Vec<&Judged> = found.views.iter().filter(|view| view.used).collect();
    let rms = |of: fn(&Judged) -> f64| {
        (used.iter().map(|view| of(view).powi(2)).sum::<f64>() / used.len().max(1) as f64).sqrt()
    };
    HandEyeResidual {
        pictures: used.len(),
        left_out: views.iter().zip(&found.views).filter(|(_, j)| !j.used).map(|(view, _)| view.name.clone()).collect(),
        reprojection_px: rms(|view| view.rms),
        held_out_px: rms(|view| view.held_out_rms),
        corner_sigma_px: found.pixel,
        arm_position_sigma: found.arm.position,
        arm_rotation_sigma: found.arm.rotation,
    }
}

fn view_answer(view: &View, judged: &Judged) -> ViewAnswer {
    let known = |value: f64| value.is_finite().then_some(value);
    ViewAnswer {
        name: view.name.clone(),
        used: judged.used,
        corners: view.seen.len(),
        reprojection_px: known(judged.rms),
        held_out_px: known(judged.held_out_rms),
        off_m: known(judged.off[1]),
        off_rad: known(judged.off[0]),
    }
}

fn warnings(found: &Fit, without_board: &[String]) -> Vec<String> {
    let mut out = Vec::new();
    let used = found.views.iter().filter(|view| view.used).count();
    if used < FEW_PICTURES {
        out.push(format!("{used} pictures are few: ten to twenty from different sides make the intervals narrower"));
    }
    if found.arm.position > ARM_OFF {
        out.push(format!(
            "the arm's poses and the board disagree by {:.1} mm: check that the arm was at rest in each picture, the board's square, and the intrinsics",
            found.arm.position * 1e3
        ));
    }
    if !without_board.is_empty() {
        let names = without_board.iter().take(3).cloned().collect::<Vec<_>>().join(", ");
        let more = if without_board.len() > 3 { " and others" } else { "" };
        out.push(format!("{} pictures do not show the board: {names}{more}", without_board.len()));
    }
    out
}
