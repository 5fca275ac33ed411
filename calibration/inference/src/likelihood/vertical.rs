//! A vertical force at the tip of an arm that yields. A tip that pushes and does not slip may hold an object down or lift it by up to
//! its friction; how much, rigid bodies leave open, and two engines differ there by ten and more times the encoders' noise in
//! strokes whose objects go the same way (`tests/peers/README.md`). So joints in contact are asked about everything but that.

use twin::arm::{ArmModel, Joints, MAX_JOINTS};

/// By how much a vertical force of 1 N at the tip turns each joint at measured joints [N m]: `J_z'`.
pub(super) fn lever(arm: &ArmModel, measured: &[f64]) -> Joints {
    let mut q = [0.0; MAX_JOINTS];
    q[..measured.len()].copy_from_slice(measured);
    let tip = arm.tip(&q).position();
    arm.jacobian(&q, tip).map(|column| column[2])
}

/// How far joints of this stiffness [N m/rad] give way to such a force [rad]: `K_P^-1 J_z'`.
pub(super) fn yields(lever: &Joints, stiffness: &[f64]) -> impl Iterator<Item = f64> {
    // A joint that no spring holds shows no force by where it stands.
    lever.iter().zip(stiffness).map(|(lever, stiffness)| if *stiffness > 0.0 { lever / stiffness } else { 0.0 })
}

/// Takes out of `errors` what lies along a direction.
pub(super) fn take_out(errors: &mut [f64], along: &[f64]) {
    let square: f64 = along.iter().map(|x| x * x).sum();
    let share = errors.iter().zip(along).map(|(error, x)| error * x).sum::<f64>() / square.max(f64::MIN_POSITIVE);
    errors.iter_mut().zip(along).for_each(|(error, x)| *error -= share * x);
}
