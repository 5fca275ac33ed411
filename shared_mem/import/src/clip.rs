//! A log by its mapping: a clip in SI, joints in one order, stamps in nanoseconds.

use crate::log::{Column, HEADER, Log, Table};
use crate::mapping::{Clock, Factor, JointColumns, Mapping, PoseColumns, Torque, TorquesAct};
use shared_mem::frames::Pose;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::origin::{Origin, Origins};
use shared_mem::recording::{Clip, JointSeries, ObjectSeries, few_rows};

/// Torques [N m] that hold the nominal model at positions [rad] against a free fall in its base frame [m/s²].
pub type Holds = Box<dyn Fn(&[f64], [f64; 3]) -> Option<Vec<f64>>>;

/// Torques of the nominal model's motion without gravity [N m]: at positions [rad], velocities [rad/s], accelerations [rad/s²].
pub type Moves = Box<dyn Fn(&[f64], &[f64], &[f64]) -> Option<Vec<f64>>>;

/// Gravity of the nominal model.
pub struct Gravity {
    /// Its free fall in the base frame [m/s²].
    pub falls: [f64; 3],
    /// What holds it.
    pub holds: Holds,
    /// What moves it.
    pub moves: Moves,
}

impl Gravity {
    /// Torques that hold the model still [N m] at positions [rad].
    pub(crate) fn torques(&self, q: &[f64]) -> Option<Vec<f64>> {
        (self.holds)(q, self.falls)
    }
}

/// Rows of one kind with stamps that may lie before the clip's beginning.
struct Rows {
    stamps_ns: Vec<i64>,
    /// Rows of the table.
    kept: Vec<usize>,
}

/// Puts the clip together; a sentence where the log lacks what the mapping names.
pub(crate) fn clip(log: &Log, mapping: &Mapping, gravity: Option<&Gravity>) -> Result<Clip, String> {
    let mut warnings = log.warnings.clone();
    let mut joints = [JointSeries::default(), JointSeries::default()];
    let mut stamps: [Vec<i64>; 3] = Default::default();
    for (at, columns) in [&mapping.measured, &mapping.desired].into_iter().enumerate() {
        if let Some(columns) = columns {
            let (series, rows) = series(log, columns, mapping.joints.len(), &mut warnings)?;
            joints[at] = series;
            stamps[at] = rows;
        }
    }
    let mut object = ObjectSeries::default();
    if let Some(columns) = &mapping.object {
        let (poses, rows) = poses(log, columns, &mut warnings)?;
        object.poses = poses;
        stamps[2] = rows;
    }
    // Stamps count from anywhere; a clip's never lie before 0.
    let first = stamps.iter().flatten().min().copied().unwrap_or(0).min(0);
    let [measured_ns, desired_ns, object_ns] =
        stamps.map(|list| list.into_iter().map(|stamp| stamp.abs_diff(first)).collect::<Vec<u64>>());
    let [mut measured, mut desired] = joints;
    (measured.stamps_ns, desired.stamps_ns, object.stamps_ns) = (measured_ns, desired_ns, object_ns);
    if let Some(columns) = &mapping.measured {
        torques(columns, &mut measured, gravity, &mut warnings);
    }
    let act = mapping.measured.as_ref().map_or(TorquesAct::default(), |columns| columns.torques_act);
    Ok(Clip {
        file: log.file.clone(),
        kind: mapping.kind,
        joint_names: mapping.joints.clone(),
        desired,
        measured,
        torques_end_at_rows: act == TorquesAct::UntilStamp,
        object,
        others: Vec::new(),
        origins: origins(log),
        warnings,
        damage: None,
    })
}

/// What the log says itself; else it is the log of another program.
fn origins(log: &Log) -> Origins {
    if log.origins.is_unknown() {
        Origin::import(&log.file.to_string_lossy(), log.format).into()
    } else {
        log.origins.clone()
    }
}

/// Positions, velocities and torques in SI, and the stamps of their rows [ns].
fn series(
    log: &Log,
    columns: &JointColumns,
    dof: usize,
    warnings: &mut Vec<String>,
) -> Result<(JointSeries, Vec<i64>), String> {
    let table = table(log, &columns.table)?;
    if dof == 0 || dof > MAX_JOINTS {
        return Err(format!("import.toml names {dof} joints; a clip has 1 to {MAX_JOINTS}: list those of one arm"));
    }
    let factors =
        [("q_factor", &columns.q_factor), ("dq_factor", &columns.dq_factor), ("tau_factor", &columns.tau_factor)];
    if let Some((key, why)) = factors.iter().find_map(|(key, factor)| Some((key, factor.refused(dof)?))) {
        return Err(format!("import.toml's `{key}` of `{}` {why}", columns.table));
    }
    if !columns.sign.is_empty() && columns.sign.len() != dof {
        let count = columns.sign.len();
        return Err(format!(
            "import.toml's `sign` of `{}` has {count} numbers for {dof} joints: give one a joint",
            columns.table
        ));
    }
    let sign = |i: usize| columns.sign.get(i).copied().unwrap_or(1.0);
    let pick = |key: &str, names: &[String]| -> Result<Vec<&[f64]>, String> {
        if names.len() != dof {
            return Err(format!(
                "import.toml gives {} columns for `{key}` and {dof} joints: give one a joint",
                names.len()
            ));
        }
        names.iter().map(|name| column(table, name).map(|c| c.values.as_slice())).collect()
    };
    let q = pick("q", &columns.q)?;
    let has_position = |row: &usize| q.iter().any(|values| values.get(*row).is_some_and(|v| !v.is_nan()));
    let rows = stamps(table, columns.clock(), has_position, warnings)?;
    let gather = |values: &[&[f64]], unit: f64, factor: &Factor| -> Vec<f64> {
        let row = |row: &usize| {
            let of = |(i, column): (usize, &&[f64])| {
                column.get(*row).map_or(f64::NAN, |v| v * unit * factor.of(i) * sign(i))
            };
            values.iter().enumerate().map(of).collect::<Vec<_>>()
        };
        rows.kept.iter().flat_map(row).collect()
    };
    let mut out = JointSeries { dof, q: gather(&q, columns.q_unit.si(), &columns.q_factor), ..JointSeries::default() };
    if !columns.dq.is_empty() {
        out.dq = gather(&pick("dq", &columns.dq)?, columns.dq_unit.si(), &columns.dq_factor);
    }
    if !columns.tau.is_empty() && columns.torque != Torque::NotKnown {
        let tau = pick("tau", &columns.tau)?;
        // What is no measurement must not be taken for one that lacks gravity.
        match still(&tau) {
            Some(what) => warnings.push(format!("torques of `{}` are left out: {what}", columns.table)),
            None => out.tau = gather(&tau, 1.0, &columns.tau_factor),
        }
    }
    Ok((out, rows.stamps_ns))
}

/// Why columns of a quantity that never rests are no measurement, where none of them is: each holds one or two numbers in all of
/// its rows, as drivers fill in that measure none.
pub(crate) fn still(columns: &[&[f64]]) -> Option<String> {
    let numbers = |values: &&[f64]| {
        let mut seen: Vec<f64> = Vec::new();
        for value in values.iter().filter(|v| v.is_finite()) {
            if !seen.contains(value) {
                seen.push(*value);
            }
            if seen.len() > 2 {
                return None;
            }
        }
        Some(seen)
    };
    let rows = columns.iter().map(|values| values.len()).max()?;
    if rows <= FEW_ROWS {
        return None;
    }
    let all: Vec<Vec<f64>> = columns.iter().map(numbers).collect::<Option<_>>()?;
    Some(match all.iter().flatten().copied().reduce(f64::max) {
        None => "no row holds a number".to_owned(),
        Some(_) if all.iter().flatten().all(|v| *v == 0.0) => {
            format!("they are 0 in all {rows} rows, which no joint measures")
        }
        Some(_) => format!("each holds one or two numbers in all {rows} rows, which no joint measures"),
    })
}

/// Fewer rows may hold one number by chance.
const FEW_ROWS: usize = 20;

/// Measured torques hold gravity: where it was taken off, the nominal model's is put back, or they are left out.
fn torques(columns: &JointColumns, measured: &mut JointSeries, gravity: Option<&Gravity>, warnings: &mut Vec<String>) {
    if columns.torque != Torque::WithoutGravity || measured.tau.is_empty() {
        return;
    }
    let still_joint = (0..measured.dof).find(|joint| {
        let column: Vec<f64> = measured.tau.iter().skip(*joint).step_by(measured.dof).copied().collect();
        still(&[&column]).is_some()
    });
    if let Some(joint) = still_joint {
        measured.tau.clear();
        warnings.push(format!(
            "torques are left out: that of joint {} holds one or two numbers in all rows, and gravity is not added to what was not \
             measured",
            joint + 1
        ));
        return;
    }
    let whole = (0..measured.len())
        .map(|row| gravity.and_then(|gravity| gravity.torques(measured.q_row(row))))
        .collect::<Option<Vec<_>>>();
    match whole {
        Some(rows) => {
            measured.tau.iter_mut().zip(rows.iter().flatten()).for_each(|(tau, g)| *tau += g);
            warnings
                .push("gravity of the nominal model was added to the torques, from which it had been taken off".into());
        }
        None => {
            measured.tau.clear();
            let what = "torques are left out: gravity was taken off, and no model is known that could put it back; give \
                        `--cell cell.toml` with a model or a URDF";
            warnings.push(what.into());
        }
    }
}

/// The object's poses, and their stamps [ns].
type Poses = (Vec<Pose<shared_mem::frames::Base, shared_mem::frames::Object>>, Vec<i64>);

fn poses(log: &Log, columns: &PoseColumns, warnings: &mut Vec<String>) -> Result<Poses, String> {
    let table = table(log, &columns.table)?;
    let pick = |names: &[String]| names.iter().map(|name| column(table, name)).collect::<Result<Vec<_>, _>>();
    let (position, orientation) = (pick(&columns.position)?, pick(&columns.orientation)?);
    let at = |columns: &[&Column], i: usize, row: usize| {
        columns.get(i).and_then(|c| c.values.get(row)).copied().unwrap_or(f64::NAN)
    };
    let metres = columns.position_unit.metres();
    let pose = |row: usize| {
        let p: [f64; 3] = std::array::from_fn(|i| at(&position, i, row) * metres);
        Pose::from_parts(p, std::array::from_fn(|i| at(&orientation, i, row)))
    };
    let rows = stamps(table, columns.clock(), |row| !at(&position, 0, *row).is_nan(), warnings)?;
    let (mut poses, mut kept) = (Vec::new(), Vec::new());
    for (row, stamp) in rows.kept.iter().zip(&rows.stamps_ns) {
        if let Some(pose) = pose(*row) {
            poses.push(pose);
            kept.push(*stamp);
        }
    }
    let bad = rows.kept.len() - poses.len();
    told(bad, rows.kept.len(), &columns.table, "are no pose (a quaternion of zeros, or no number)", warnings)?;
    Ok((poses, kept))
}

/// Stamps of the rows for which `is_there`.
fn stamps(
    table: &Table,
    Clock { stamps: name, unit, rate, shift }: Clock<'_>,
    is_there: impl Fn(&usize) -> bool,
    warnings: &mut Vec<String>,
) -> Result<Rows, String> {
    let shift_ns = (shift * 1e9).round() as i64;
    let all: Vec<Option<i64>> = match (name, rate) {
        (Some(name), _) if name == HEADER => {
            let given = table.stamps_ns.as_ref().ok_or_else(|| {
                format!(
                    "`{}` has no stamps of its own; name a column as `stamps`, or give a `rate`, in import.toml",
                    table.name
                )
            })?;
            given.iter().map(|stamp| i64::try_from(*stamp).ok()).collect()
        }
        (Some(name), _) => {
            let values = &column(table, name)?.values;
            let ns = |v: &f64| v * unit.nanoseconds();
            values.iter().map(|v| Some(ns(v)).filter(|ns| ns.abs() < 9e18).map(|ns| ns.round() as i64)).collect()
        }
        (None, Some(rate)) if rate > 0.0 && rate.is_finite() => {
            (0..table.rows()).map(|row| Some((row as f64 / rate * 1e9).round() as i64)).collect()
        }
        _ => return Err(format!("import.toml gives neither `stamps` nor a `rate` for `{}`", table.name)),
    };
    let there: Vec<usize> = (0..all.len()).filter(is_there).collect();
    let (stamps_ns, kept): (Vec<i64>, Vec<usize>) =
        there.iter().filter_map(|row| Some((all.get(*row).copied().flatten()?.checked_add(shift_ns)?, *row))).unzip();
    told(there.len() - kept.len(), there.len(), &table.name, "have no stamp", warnings)?;
    if kept.is_empty() {
        return Err(format!("`{}` has no row with numbers", table.name));
    }
    Ok(Rows { stamps_ns, kept })
}

/// Counts rows that are left out; a sentence where they are too many.
fn told(bad: usize, all: usize, table: &str, what: &str, warnings: &mut Vec<String>) -> Result<(), String> {
    if bad == 0 {
        return Ok(());
    }
    let line = format!("`{table}`: {bad} of {all} rows {what}");
    if bad > few_rows(all) {
        return Err(format!("{line}; at most 1 % may be left out: look at what wrote the log"));
    }
    warnings.push(format!("{line}; they are left out"));
    Ok(())
}

fn table<'a>(log: &'a Log, name: &str) -> Result<&'a Table, String> {
    log.table(name).ok_or_else(|| {
        let there: Vec<String> = log.tables.iter().map(|table| format!("`{}`", table.name)).collect();
        format!(
            "has no `{name}`, which import.toml names; it has {}: import it by itself, or leave it out",
            there.join(", ")
        )
    })
}

fn column<'a>(table: &'a Table, name: &str) -> Result<&'a Column, String> {
    table.column(name).ok_or_else(|| {
        let there: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        format!("`{}` has no column `{name}`, which import.toml names; it has {}", table.name, there.join(", "))
    })
}
