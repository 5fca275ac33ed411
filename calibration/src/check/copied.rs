//! Commands that are the measurements themselves, to the bit or but for the rounding of a smaller number: nobody was commanded so,
//! and an arm that follows without error says nothing about its controller.

use super::columns::{Columns, Signals};
use super::limits::{COPIED, COPIED_ROUNDED, COPIED_WITHIN, FEWEST_ROWS};
use super::remark::{Fault, Remark, Severity, Size};

/// The remark on a clip.
pub(super) fn remark(clip: &Columns) -> Option<Remark> {
    let (measured, desired) = (&clip.measured, &clip.desired);
    let dof = measured.dof();
    if dof == 0 || desired.dof() != dof {
        return None;
    }
    let moves = |row: &usize| (0..dof).any(|j| measured.q[j][*row] != measured.q[j][row - 1]);
    let rows: Vec<usize> = (1..measured.len()).filter(moves).collect();
    if rows.len() < FEWEST_ROWS {
        return None;
    }
    let rounding: Vec<f64> = (0..dof).map(|j| rounding(&measured.q[j], &desired.q[j])).collect();
    let rounded = rounding.iter().any(|rounding| *rounding > 0.0);
    // The command that was in force at each of them.
    let newest: Vec<usize> = rows.iter().map(|row| desired.t.partition_point(|t| *t <= measured.t[*row])).collect();
    let within = COPIED_WITHIN as isize;
    let copies = |shift: isize| {
        let same = |(row, newest): (&usize, &usize)| {
            let at = newest.checked_add_signed(shift).filter(|at| *at < desired.len());
            at.is_some_and(|at| (0..dof).all(|j| alike(desired.q[j][at], measured.q[j][*row], rounding[j])))
        };
        rows.iter().zip(&newest).filter(|pair| same(*pair)).count()
    };
    // The row in force is the one before the first later one.
    let all = (-within..=within).map(|later| (later, copies(later - 1)));
    let (later, count) = all.max_by_key(|(later, count)| (*count, -later.abs()))?;
    let share = count as f64 / rows.len() as f64;
    // Any arm that follows well is near its rounded commands in most rows.
    let least = if rounded { COPIED_ROUNDED } else { COPIED };
    (share >= least).then(|| {
        let how = match (rounded, exact(measured, desired, later)) {
            (true, _) => "but for rounding",
            (_, true) => "to the bit",
            _ => "to the last digits of a single-precision number",
        };
        let (percent, rows) = (100.0 * share, if later.abs() == 1 { "row" } else { "rows" });
        let what = match later {
            0 => format!(
                "the commands are the measured positions {how} in {percent:.0} % of the rows in which the arm moves: they were copied"
            ),
            1.. => format!(
                "the commands are the measured positions of {later} {rows} earlier {how} in {percent:.0} % of the rows in which the \
                 arm moves: they were copied"
            ),
            _ => format!(
                "the measured positions are equal {how} to the commands {} {rows} before in {percent:.0} % of the rows in which the \
                 arm moves: a copy, or a simulator's arm without error",
                -later
            ),
        };
        let what = format!("{what}, and they say nothing about how the arm follows");
        // An arm without error and with a delay alone is what a simulated one may be.
        let severity = if later < 0 { Severity::Note } else { Severity::Wrong };
        Remark::new(Fault::CopiedCommands, &clip.file, "desired q", what)
            .sized(Size::count(share, "share of rows"))
            .weighed(severity)
            .mended_by("log what the controller was asked for; without it `calibration diagnose --torques` explains logged torques")
    })
}

/// Steps that positions may be rounded to [rad or degrees]: as many digits as people write.
const STEPS: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Half the step that commands are rounded to where measurements are not [rad]; 0 where none is seen.
fn rounding(measured: &[f64], desired: &[f64]) -> f64 {
    let on = |values: &[f64], step: f64| {
        values.iter().all(|v| (v / step - (v / step).round()).abs() < 1e-6 * (v / step).abs().max(1.0))
    };
    let whole = |unit: f64| STEPS.iter().map(|step| step * unit).find(|step| on(desired, *step));
    let step = [1.0, 1f64.to_radians()].into_iter().filter_map(whole).fold(0.0, f64::max);
    if step > 0.0 && !on(measured, step) { 0.5 * step } else { 0.0 }
}

/// Whether two numbers are one, but for single precision and for what one was rounded by.
fn alike(a: f64, b: f64, rounding: f64) -> bool {
    (a - b).abs() <= f64::from(f32::EPSILON) * a.abs().max(b.abs()) + rounding * (1.0 + 1e-6)
}

/// Whether the copy is one to the bit.
fn exact(measured: &Signals, desired: &Signals, later: isize) -> bool {
    let Some(middle) = measured.t.get(measured.len() / 2) else { return false };
    let [row, newest] = [&measured.t, &desired.t].map(|t| t.partition_point(|t| t <= middle));
    let pair = row.checked_sub(1).zip(newest.checked_add_signed(later - 1));
    pair.is_some_and(|(row, at)| {
        at < desired.len() && (0..measured.dof()).all(|j| desired.q[j][at] == measured.q[j][row])
    })
}

#[cfg(test)]
mod tests {
    use super::super::columns::Signals;
    use super::*;
    use shared_mem::cell::ClipKind;

    fn clip(command: impl Fn(&[f64], usize) -> f64) -> Columns {
        let q: Vec<f64> = (0..400).map(|i| (f64::from(i) * 0.02).sin()).collect();
        let t: Vec<f64> = (0..400).map(|i| f64::from(i) * 0.01).collect();
        let desired = (0..400).map(|i| command(&q, i)).collect();
        let signals = |q| Signals { t: t.clone(), q: vec![q], noise: vec![0.0], ..Signals::default() };
        Columns {
            file: "clip.mcap".into(),
            kind: ClipKind::Excitation,
            measured: signals(q.clone()),
            desired: signals(desired),
            pose_t: Vec::new(),
            object: shared_mem::recording::ObjectSeries::default(),
            names: Vec::new(),
            noticed: Vec::new(),
            damage: None,
        }
    }

    #[test]
    fn copies_are_found_whatever_row_they_are_of_and_commands_are_none() {
        let of = |command: &dyn Fn(&[f64], usize) -> f64| remark(&clip(command)).map(|remark| remark.what);
        let severity = |command: &dyn Fn(&[f64], usize) -> f64| remark(&clip(command)).map(|remark| remark.severity);
        assert_eq!(severity(&|q, i| q[i]), Some(Severity::Wrong));
        assert_eq!(severity(&|q, i| q[(i + 1).min(399)]), Some(Severity::Note));
        assert!(of(&|q, i| q[i]).expect("a copy").contains("are the measured positions to the bit"));
        let later = of(&|q, i| q[(i + 1).min(399)]).expect("the next row");
        assert!(later.contains("equal to the bit to the commands 1 row before"), "{later}");
        let single = of(&|q, i| f64::from(q[i] as f32)).expect("a copy in single precision");
        assert!(single.contains("single-precision"), "{single}");
        let rounded = of(&|q, i| (q[i] * 1e3).round() / 1e3).expect("a rounded copy");
        assert!(rounded.contains("but for rounding"), "{rounded}");
        assert_eq!(of(&|q, i| q[i] + 1e-6), None);
        assert_eq!(
            of(&|q, i| ((q[i] + 3e-5) * 1e3).round() / 1e3),
            None,
            "an arm that is 0.03 mrad off rounded commands"
        );
        assert_eq!(of(&|q, i| q[i.saturating_sub(40)]), None, "a delay of 0.4 s is no copy of a near row");
    }
}
