//! Topics of one number each, one a joint, as the table that they are together: `/joint1_position_controller/command` and so on.

use crate::log::{Column, Table};
use std::collections::BTreeMap;

/// What such a message calls its number.
const NUMBER: &str = "data";
/// What stands behind the joint's name in a topic.
const CONTROLLERS: [&str; 4] = ["_position_controller", "_velocity_controller", "_effort_controller", "_controller"];

/// A topic without the joint in one of its parts, and that joint.
fn without_joint(topic: &str, part: usize) -> Option<(String, String)> {
    let mut parts: Vec<String> = topic.split('/').map(str::to_owned).collect();
    let own = parts.get_mut(part).filter(|own| !own.is_empty())?;
    let ending = CONTROLLERS.iter().find(|ending| own.ends_with(**ending)).copied().unwrap_or("");
    let joint = own.strip_suffix(ending)?.to_owned();
    *own = format!("*{ending}");
    (!joint.is_empty()).then(|| (parts.join("/"), joint))
}

/// The tables, with those put together that are topics of one number each and differ in one part of their names. A row is there where
/// the last of them has one, and holds what each was sent last.
pub(super) fn joined(tables: Vec<Table>) -> Vec<Table> {
    let is_number = |table: &Table| {
        matches!(table.columns.as_slice(), [only] if only.name == NUMBER)
            && table.stamps_ns.as_ref().is_some_and(|s| s.len() > 1)
    };
    let (single, mut whole): (Vec<Table>, Vec<Table>) = tables.into_iter().partition(is_number);
    let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
    let keys = |table: &Table| -> Vec<(String, String)> {
        (0..table.name.split('/').count()).filter_map(|part| without_joint(&table.name, part)).collect()
    };
    for (key, _) in single.iter().flat_map(&keys) {
        *kinds.entry(key).or_default() += 1;
    }
    let mut groups: BTreeMap<String, Vec<(String, Table)>> = BTreeMap::new();
    for table in single {
        let best = keys(&table).into_iter().max_by_key(|(key, _)| kinds.get(key).copied().unwrap_or(0));
        match best.filter(|(key, _)| kinds.get(key).is_some_and(|count| *count > 1)) {
            Some((key, joint)) => groups.entry(key).or_default().push((joint, table)),
            None => whole.push(table),
        }
    }
    whole.extend(groups.into_iter().map(|(name, parts)| together(name, &parts)));
    whole
}

fn together(name: String, parts: &[(String, Table)]) -> Table {
    let stamps = |table: &Table| table.stamps_ns.clone().unwrap_or_default();
    let last =
        parts.iter().map(|(_, table)| stamps(table)).max_by_key(|stamps| stamps.first().copied()).unwrap_or_default();
    let column = |(joint, table): &(String, Table)| {
        let own = stamps(table);
        let values = table.columns.first().map_or(&[][..], |column| &column.values);
        let at = |stamp: &u64| {
            let before = own.partition_point(|own| own <= stamp).checked_sub(1);
            before.and_then(|before| values.get(before)).copied().unwrap_or(f64::NAN)
        };
        Column { name: format!("{NUMBER}[{joint}]"), values: last.iter().map(at).collect() }
    };
    let columns = parts.iter().map(column).collect();
    Table { name, stamps_ns: Some(last), columns }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_of_one_joint_each_are_one_table() {
        let topic = |name: &str, first: u64, value: f64| Table {
            name: name.into(),
            stamps_ns: Some((0..3).map(|k| first + 10 * k).collect()),
            columns: vec![Column { name: NUMBER.into(), values: (0..3).map(|k| value + f64::from(k)).collect() }],
        };
        let found = joined(vec![
            topic("/arm/joint1_position_controller/command", 0, 1.0),
            topic("/arm/joint2_position_controller/command", 2, 5.0),
            topic("/battery", 0, 24.0),
        ]);
        assert_eq!(found.len(), 2);
        let arm = &found[1];
        assert_eq!(
            (arm.name.as_str(), arm.stamps_ns.as_deref()),
            ("/arm/*_position_controller/command", Some(&[2, 12, 22][..]))
        );
        assert_eq!((arm.columns[0].name.as_str(), &arm.columns[0].values[..]), ("data[joint1]", &[1.0, 2.0, 3.0][..]));
        assert_eq!((arm.columns[1].name.as_str(), &arm.columns[1].values[..]), ("data[joint2]", &[5.0, 6.0, 7.0][..]));
    }
}
