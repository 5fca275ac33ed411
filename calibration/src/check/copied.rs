//! Commands that are the measurements themselves: nobody was commanded so, and an arm that follows without error says nothing
//! about its controller.

use super::columns::Columns;
use super::limits::{COPIED, COPIED_WITHIN, FEWEST_ROWS};
use super::remark::{Fault, Remark, Size};

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
    // The command that was in force at each of them.
    let newest: Vec<usize> = rows.iter().map(|row| desired.t.partition_point(|t| *t <= measured.t[*row])).collect();
    let within = COPIED_WITHIN as isize;
    let copies = |shift: isize| {
        let same = |(row, newest): (&usize, &usize)| {
            let at = newest.checked_add_signed(shift).filter(|at| *at < desired.len());
            at.is_some_and(|at| (0..dof).all(|j| desired.q[j][at] == measured.q[j][*row]))
        };
        rows.iter().zip(&newest).filter(|pair| same(*pair)).count()
    };
    // The row in force is the one before the first later one.
    let all = (-within..=within).map(|later| (later, copies(later - 1)));
    let (later, count) = all.max_by_key(|(later, count)| (*count, -later.abs()))?;
    let share = count as f64 / rows.len() as f64;
    let where_from = match later {
        0 => String::new(),
        1.. => format!(" of {later} rows earlier"),
        _ => format!(" of {} rows later", -later),
    };
    (share >= COPIED).then(|| {
        let what = format!(
            "the commands are the measured positions{where_from} to the bit in {:.0} % of the rows in which the arm moves: they \
             were copied, and say nothing about how the arm follows",
            100.0 * share
        );
        Remark::new(Fault::CopiedCommands, &clip.file, "desired q", what)
            .sized(Size::count(share, "share of rows"))
            .mended_by("log what the controller was asked for; without it `calibration diagnose --torques` explains logged torques")
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
        assert!(of(&|q, i| q[i]).expect("a copy").contains("are the measured positions to the bit"));
        let later = of(&|q, i| q[(i + 1).min(399)]).expect("the next row");
        assert!(later.contains("1 rows later"), "{later}");
        assert_eq!(of(&|q, i| q[i] + 1e-6), None);
        assert_eq!(of(&|q, i| q[i.saturating_sub(40)]), None, "a delay of 0.4 s is no copy of a near row");
    }
}
