//! Tables with a row of each joint: stamps that repeat, and a column that names one joint after the other. They become a row of each
//! stamp.

use super::Text;
use crate::log::Column;
use crate::naming;

/// Words of a column that names joints.
const NAMES: [&str; 13] =
    ["joint", "joints", "name", "names", "axis", "motor", "dof", "id", "index", "number", "nr", "achse", "gelenk"];
/// More joints than any robot has.
const MOST: usize = 64;
/// Fewer rounds may repeat by chance.
const FEWEST_ROUNDS: usize = 3;

/// Makes a row of each round of joints; the table stays as it is where its rows are no joints.
pub(super) fn by_joint(table: &mut Text) {
    let Some((key, joints)) = joints(table) else { return };
    let count = joints.len();
    let rounds = table.columns.first().map_or(0, |column| column.values.len()) / count;
    let mut columns = Vec::new();
    for column in table.columns.drain(..).filter(|column| column.name != key) {
        let whole = column.values.get(..rounds * count).unwrap_or(&[]);
        if whole.chunks(count).all(|round| round.iter().all(|v| v.to_bits() == round[0].to_bits())) {
            columns.push(Column { values: whole.iter().step_by(count).copied().collect(), ..column });
            continue;
        }
        columns.extend(joints.iter().enumerate().map(|(at, joint)| Column {
            name: format!("{}[{joint}]", column.name),
            values: whole.iter().skip(at).step_by(count).copied().collect(),
        }));
    }
    table.columns = columns;
    table.words.clear();
    table.stamps_ns = table.stamps_ns.take().map(|stamps| stamps.into_iter().step_by(count).take(rounds).collect());
    table.warnings.push(format!(
        "each of its rows is one joint, by `{key}`: {count} of them are one row ({})",
        joints.join(", ")
    ));
}

/// The column that names one joint after the other, and those joints.
fn joints(table: &Text) -> Option<(String, Vec<String>)> {
    let names_joints = |name: &str| naming::words(name).iter().any(|word| NAMES.contains(&word.as_str()));
    let words = table.words.iter().map(|(name, cells)| (name.clone(), cells.clone()));
    let whole =
        |column: &&Column| column.values.iter().all(|v| v.fract() == 0.0 && (0.0..MOST as f64 + 1.0).contains(v));
    let numbers = table
        .columns
        .iter()
        .filter(whole)
        .map(|column| (column.name.clone(), column.values.iter().map(f64::to_string).collect()));
    words.chain(numbers).filter(|(name, _)| names_joints(name)).find_map(|(name, cells): (String, Vec<String>)| {
        let count = cells.iter().skip(1).position(|cell| *cell == cells[0])? + 1;
        let joints = cells.get(..count)?.to_vec();
        let distinct = (1..count).all(|at| !joints[..at].contains(&joints[at]));
        let cycles = cells.iter().enumerate().all(|(row, cell)| *cell == joints[row % count]);
        ((2..=MOST).contains(&count) && distinct && cycles && cells.len() >= FEWEST_ROUNDS * count)
            .then_some((name, joints))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_each_joint_becomes_a_row_of_each_stamp() {
        let column = |name: &str, of: fn(usize) -> f64| Column { name: name.into(), values: (0..11).map(of).collect() };
        let names = (0..11).map(|row| ["base", "elbow"][row % 2].to_owned()).collect();
        let columns = vec![column("time", |row| (row / 2) as f64), column("position", |row| row as f64)];
        let mut table = Text { columns, words: vec![("joint".into(), names)], ..Text::default() };
        by_joint(&mut table);
        let found: Vec<(&str, &[f64])> = table.columns.iter().map(|c| (c.name.as_str(), &c.values[..])).collect();
        assert_eq!(
            found,
            [
                ("time", &[0.0, 1.0, 2.0, 3.0, 4.0][..]),
                ("position[base]", &[0.0, 2.0, 4.0, 6.0, 8.0]),
                ("position[elbow]", &[1.0, 3.0, 5.0, 7.0, 9.0])
            ]
        );
        let mut numbered = Text {
            columns: vec![column("joint_id", |row| (row % 3) as f64), column("q", |row| row as f64)],
            ..Text::default()
        };
        by_joint(&mut numbered);
        assert_eq!(numbered.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["q[0]", "q[1]", "q[2]"]);
        let mut plain =
            Text { columns: vec![column("index", |row| row as f64), column("q", |row| row as f64)], ..Text::default() };
        by_joint(&mut plain);
        assert_eq!(plain.columns.len(), 2, "a counter of rows names no joints");
    }
}
