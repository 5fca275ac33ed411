//! What libfranka's own log (`franka::logToCSV`) says about its columns: states, then the commands sent in the same cycle,
//! which older versions name alike.

use crate::log::{Column, Facts};

/// Facts about such a log; `None` for any other table. Columns of commands get `cmd.` before their names.
pub(super) fn recognise(columns: &mut [Column]) -> Option<Facts> {
    let has = |name: &str| columns.iter().any(|column| column.name == name);
    let newer = has("time") && has("success_rate") && has("state.q[0]") && has("state.tau_J[0]");
    let older = has("duration") && has("success rate") && has("q[0]") && has("tau_J[0]");
    if !newer && !older {
        return None;
    }
    for column in columns.iter_mut() {
        let command = column.name.strip_prefix("again.").map(str::to_owned);
        let alone = (older && column.name.starts_with("tau_J_d")).then(|| column.name.clone());
        if let Some(name) = command.or(alone) {
            column.name = format!("cmd.{name}");
        }
    }
    Some(Facts {
        stamp_unit: Some((1e-3, "libfranka logs milliseconds")),
        torque: Some((true, "libfranka's tau_J holds gravity")),
        torques_end_at_rows: true,
        franka: true,
        ..Facts::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(names: &[&str]) -> Vec<Column> {
        names.iter().map(|name| Column { name: (*name).into(), values: vec![0.0] }).collect()
    }

    #[test]
    fn commands_of_the_older_log_are_told_from_states() {
        let mut old =
            columns(&["duration", "success rate", "q[0]", "q_d[0]", "tau_J[0]", "again.q_d[0]", "tau_J_d[0]"]);
        assert!(recognise(&mut old).is_some_and(|facts| facts.franka));
        assert_eq!(
            (old[3].name.as_str(), old[5].name.as_str(), old[6].name.as_str()),
            ("q_d[0]", "cmd.q_d[0]", "cmd.tau_J_d[0]")
        );
        assert!(recognise(&mut columns(&["time", "success_rate", "state.q[0]", "state.tau_J[0]"])).is_some());
        assert_eq!(recognise(&mut columns(&["time", "q[0]", "tau_J[0]"])), None);
    }
}
