//! Every threshold of the doctor of a recording, with its unit, what it means and where it comes from. Those in sigmas are of
//! the noise that a channel itself shows; the others separate a fault from the nearest thing that is none.

/// Distance between a joint and its commands that a fault must exceed, beyond noise, root mean square over a clip [rad]: three
/// steps of a coarse encoder (1.5 mrad). Joints whose commands are nearer to each other cannot be distinguished.
pub(super) const LEAST_MISMATCH: f64 = 5e-3;
/// A fit under the hypothesis of a fault leaves less than this share of the distance [1]. Two joints that move alike still
/// differ by more than a fifth of what separates either from a third.
pub(super) const BETTER_FIT: f64 = 0.2;

pub(super) use inference::likelihood::arm::velocity::{LEAST_MOTION, MOTION_OVER_NOISE, NOT_ITS_SLOPE};

/// A ratio of two quantities is a known conversion when it comes this near to it [1]: half-way between 57.3 and the next
/// conversion (60) is 2.3 %; the controller adds errors of some percent, and no other conversion is near any of these.
pub(super) const NEAR_CONVERSION: f64 = 0.12;
/// A velocity that is off its slope by a turn within a step, to this share [1], was computed across a wrap.
pub(super) const NEAR_TURN: f64 = 0.25;

/// A log with more rows a second was not stamped in nanoseconds [Hz]: the fastest controllers of arms run at 8 kHz...
pub(super) const FASTEST_LOG: f64 = 20_000.0;
/// ...and one with fewer shows no motion, unless its velocities say that its clock is another [Hz].
pub(super) const SLOWEST_LOG: f64 = 4.0;
/// A step is uneven when it differs from a whole number of usual steps by this share [1]...
pub(super) const UNEVEN_STEP: f64 = 0.1;
/// ...and a log is when more than this share of its steps are [1]: single late rows are no property of the log.
pub(super) const UNEVEN_SHARE: f64 = 0.02;

/// A jump exceeds this many lower quartiles of the changes from row to row [1]: six sigmas of their noise, which one of 10^9
/// rows exceeds. The motion counts among them: of a joint at 0.6 rad/s and 1 kHz jumps below 9 mrad are not seen...
pub(super) const JUMP_QUARTILES: f64 = 20.0;
/// ...and this many steps of the encoder [1].
pub(super) const JUMP_STEPS: f64 = 4.0;
/// A second publisher's rows are left again within so many rows...
pub(super) const JUMP_BACK_ROWS: usize = 8;
/// ...to within this share of the jump [1]...
pub(super) const JUMP_BACK: f64 = 0.3;
/// ...at least so often in a clip, and in this share of its rows [1]. Fewer are single spoilt rows.
pub(super) const JUMPS: usize = 5;
pub(super) const JUMP_SHARE: f64 = 2e-3;
/// Fewer are remarked alone where they are this far [rad], and this many times as far as 99 of 100 rows move [1].
pub(super) const SPIKE: f64 = 0.05;
pub(super) const SPIKE_MOTION: f64 = 5.0;
/// Rows of two publishers take turns for this many seconds at least, one after the other, with this many jumps in each...
pub(super) const TURNS_LAST: usize = 2;
pub(super) const TURNS_A_SECOND: usize = 2;
/// ...of which nearly all [1] last so many rows at most, as the slower of two publishers comes in between...
pub(super) const TURNS_ALIKE: f64 = 0.9;
pub(super) const TURN_ROWS: usize = 2;
/// ...and go to the same side as the jump before: another arm stands on one side of this one for a while, noise on either. Noise
/// has a share of a half.
pub(super) const SAME_SIDE: f64 = 0.8;
/// Commands are copies where this share of the rows of a moving arm [1] holds the measured positions to the bit, so many rows
/// earlier or later at most.
pub(super) const COPIED: f64 = 0.95;
/// ...or, but for the step that they are rounded to, nearly all: an arm that follows well is within it now and then.
pub(super) const COPIED_ROUNDED: f64 = 0.995;
pub(super) const COPIED_WITHIN: usize = 20;

/// Rows that repeat the one before to the bit while the joints move by more than so many steps of their encoders a row [1]...
pub(super) const REPEAT_MOTION: f64 = 3.0;
/// ...are held when they are more than this share of such rows [1]: a sensor whose rate is a tenth below the log's.
pub(super) const HELD_SHARE: f64 = 0.08;
/// Poses that repeat while the object moves by more than this from pose to pose before and behind [m].
pub(super) const POSE_MOTION: f64 = 1e-3;
/// Rows that tell whether a log repeats others: fewer say nothing.
pub(super) const FEWEST_ROWS: usize = 50;
/// Moving poses that tell the same.
pub(super) const FEWEST_POSES: usize = 8;
/// Rates whose ratio, of the larger to the smaller, lies this far from a whole number beat against each other [1]: usual steps
/// are known to a percent.
pub(super) const BEAT: f64 = 0.03;

/// Velocities that correlate less than this do not tell a lag [1]: an arm that does not follow, for which another motion is as
/// near.
pub(super) const LEAST_CORRELATION: f64 = 0.9;
/// Beyond this the arm follows closely enough for a lag to be held against the logs [1]: a servo that gives way under its load
/// moves otherwise than it is commanded to, and its best match may lie anywhere.
pub(super) const FOLLOWS: f64 = 0.97;
/// One sigma of a lag that dynamics leave beside the estimate's own [s]: half the range of the lags over the clips of one
/// simulated session is 4 to 7 ms, with and without effects.
pub(super) const LAG_SIGMA: f64 = 6e-3;
/// A measurement that comes this long before its command [s], or so many steps, was not caused by it.
pub(super) const LEAD: f64 = 0.015;
pub(super) const LEAD_STEPS: f64 = 3.0;
/// No delay of a controller is so long [s]: the twin's own range ends at 0.1 s, teleoperation across continents at 0.3 s.
pub(super) const LONGEST_DELAY: f64 = 0.5;
/// Clips differ in speed when the fastest has so many times the rate of the slowest [1].
pub(super) const SPEEDS_DIFFER: f64 = 1.3;
/// Lags that go with 1 / speed leave this share of what a constant lag leaves, squared [1].
pub(super) const GOES_WITH_SPEED: f64 = 0.1;
/// Lags of one session that differ by so many sigmas without any rule were not stamped by one clock.
pub(super) const LAGS_DIFFER: f64 = 8.0;

/// Torques over which the model's gravity is fitted are this large at least, root mean square [N m]: ten sigmas of a joint
/// torque sensor.
pub(super) const LEAST_GRAVITY: f64 = 0.4;
/// A log carries the arm's weight when the share of the model's gravity in it exceeds this [1]: an undeclared load of a
/// kilogram or a sensor's bias of 2 N m moves the share by less than 0.3.
pub(super) const CARRIES_GRAVITY: f64 = 0.5;
/// Rows of a clip at which torques are compared with the model: the inverse dynamics of some thousand hypotheses stay below
/// a tenth of a second.
pub(super) const TORQUE_ROWS: usize = 120;
/// Half the time over which accelerations are taken for it [s].
pub(super) const ACCELERATION: f64 = 0.02;
/// The torques contradict the model when it leaves more than this share of their squares [1], which is the noise of a torque
/// sensor of 1 % ten times over...
pub(super) const TORQUE_LEFT: f64 = 1e-3;
/// ...and another order or sign less than this share of that [1].
pub(super) const TORQUE_BETTER: f64 = 0.25;
/// ...and less than this share of all [1]: torques that the model does not explain after all are none of its arm's. Friction of a
/// joint and a load that is not in the model leave a tenth.
pub(super) const TORQUE_EXPLAINED: f64 = 0.2;
/// Positions may exceed a joint's range by this [rad]: readings at a stop.
pub(super) const RANGE_MARGIN: f64 = 0.05;
/// A share of a clip's rows that is most of them [1].
pub(super) const MOST: f64 = 0.5;
/// A share of a clip's rows that is nearly all of them [1].
pub(super) const NEARLY_ALL: f64 = 0.95;

/// A height over the table that is so many half heights of the object is a matter of units when it comes this near to it [1]:
/// 2 mm in 5 cm, several times what the mean of a tracker's poses at rest is off by.
pub(super) const NEAR_HEIGHT: f64 = 0.05;
/// A height that is off by less may be a camera's place as well [m]: the twin's own range of that effect is 30 mm.
pub(super) const CAMERA_OFF: f64 = 0.035;
/// An object stands when one of its faces looks down to this angle [rad], a sum of table, tracker and camera...
pub(super) const STANDS: f64 = 0.12;
/// ...and surely does not beyond this [rad]. As in the screening of clips for identification.
pub(super) const LEANS: f64 = 0.2;
/// Share of poses that stand in one order of the quaternion's parts only [1].
pub(super) const ORDER_SHARE: f64 = 0.2;
/// Poses at rest differ from one to the next by less than so many sigmas of the tracker [sigma]: one of 10^6 by more in space...
pub(super) const RESTS: f64 = 8.0;
/// ...so many of them.
pub(super) const REST_POSES: usize = 8;
/// A fall is off when its acceleration differs by this share [1], and by so many sigmas: drag on a cube of 0.1 m and 0.4 kg
/// at 3 m/s is 2 %, a tracker's scale 1 % again.
pub(super) const FALL_OFF: f64 = 0.04;
pub(super) const FALL_SIGMAS: f64 = 4.0;
/// A clip tells a fall when its acceleration is so many sigmas from none.
pub(super) const FALL_SURE: f64 = 10.0;
/// Poses in a fall: fewer do not tell its curvature.
pub(super) const FALL_POSES: usize = 7;
/// What flies is this far above where it could touch [m].
pub(super) const CLEAR: f64 = 5e-3;
/// Residuals of a fall in sigmas of the tracker, squared: more is no free fall.
pub(super) const FALL_FITS: f64 = 4.0;
