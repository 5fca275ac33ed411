//! The tasks that ship with the project: each known by its name wherever no file is called so.

use std::path::Path;

/// Name and text of each.
const ALL: [(&str, &str); 4] = [
    ("push_milk", include_str!("../../tasks/push_milk.toml")),
    ("stack_boxes", include_str!("../../tasks/stack_boxes.toml")),
    ("pick_carrot", include_str!("../../tasks/pick_carrot.toml")),
    ("close_laptop", include_str!("../../tasks/close_laptop.toml")),
];

/// The text of a task that is built in, where `path` is its name and no file.
pub(super) fn text(path: &Path) -> Option<&'static str> {
    let named = ALL.iter().find(|(name, _)| path.as_os_str() == *name);
    named.filter(|_| !path.exists()).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use crate::task::Task;
    use std::path::Path;

    #[test]
    fn every_task_that_ships_is_known_by_its_name() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tasks");
        let mut shipped = 0;
        for entry in std::fs::read_dir(&folder).expect("the tasks") {
            let file = entry.expect("an entry").path();
            let name = file.file_stem().expect("a name").to_str().expect("UTF-8");
            let built_in = Task::read(Path::new(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
            let of_file = Task::read(&file).expect("a task");
            assert_eq!((built_in.name(), built_in.instruction()), (of_file.name(), of_file.instruction()));
            shipped += 1;
        }
        assert_eq!(shipped, super::ALL.len());
        assert!(Task::read(Path::new("push_mlik")).is_err());
    }
}
