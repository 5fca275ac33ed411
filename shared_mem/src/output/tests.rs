//! Outputs on a real file system: what is there after success, failure and a killed writer.

use super::unfinished::clear;
use super::*;
use std::fs;
use std::os::unix::fs::{PermissionsExt as _, symlink};

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<_> = entries.map(|e| e.expect("an entry").file_name().into_string().expect("text")).collect();
    names.sort();
    names
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).expect("a file").permissions().mode() & 0o7777
}

#[test]
fn a_file_is_replaced_at_the_end_and_not_before() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("theta.toml");
    write(&path, "old").expect("written");
    let mut output = Output::create(&path).expect("begun");
    output.write_all(b"ne").expect("written");
    assert_eq!(fs::read(&path).expect("the old file"), b"old");
    assert!(names(folder.path()).iter().any(|name| name.starts_with(".unfinished-theta.toml-")));
    drop(output);
    assert_eq!((fs::read(&path).expect("the old file"), names(folder.path()).len()), (b"old".to_vec(), 1));
    write(&path, "new").expect("written");
    assert_eq!((fs::read(&path).expect("the new file"), names(folder.path()).len()), (b"new".to_vec(), 1));
}

#[test]
fn a_new_file_is_never_put_in_place_of_another() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mcap");
    let output = Output::create_new(&path).expect("begun");
    fs::write(&path, "of another program").expect("a file");
    let error = output.finish().expect_err("it appeared meanwhile").to_string();
    assert!(error.contains("clip.mcap: it exists") && error.ends_with("give a new name"), "{error}");
    assert!(Output::create_new(&path).is_err());
    assert_eq!(fs::read(&path).expect("a file"), b"of another program");
    assert_eq!(names(folder.path()).len(), 1);
}

#[test]
fn modes_are_those_of_the_umask_or_of_the_file_before() {
    let folder = tempfile::tempdir().expect("a folder");
    let [plain, own, secret] = ["plain", "own", "secret"].map(|name| folder.path().join(name));
    fs::write(&plain, "").expect("a file");
    write(&own, "").expect("written");
    assert_eq!(mode(&own), mode(&plain));
    fs::write(&secret, "").expect("a file");
    fs::set_permissions(&secret, fs::Permissions::from_mode(0o640)).expect("a mode");
    write(&secret, "new").expect("written");
    assert_eq!(mode(&secret), 0o640);
    let made = OutputFolder::create(&folder.path().join("made")).expect("begun");
    made.finish("").expect("there");
    fs::create_dir(folder.path().join("usual")).expect("a folder");
    assert_eq!(mode(&folder.path().join("made")), mode(&folder.path().join("usual")));
}

#[test]
fn a_link_stays_and_what_it_leads_to_is_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("far")).expect("a folder");
    let link = folder.path().join("link");
    symlink("far/file", &link).expect("a link");
    for text in ["made", "replaced"] {
        write(&link, text).expect("written");
        assert_eq!(fs::read_to_string(folder.path().join("far/file")).expect("the file"), text);
    }
    assert!(link.is_symlink());
    assert_eq!(names(&folder.path().join("far")), ["file"]);
    symlink("circle", folder.path().join("circle")).expect("a link");
    assert!(write(&folder.path().join("circle"), "").is_err());
}

#[test]
fn a_full_device_is_told_with_what_is_needed_and_a_device_is_never_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("full");
    symlink("/dev/full", &link).expect("a link");
    let error = write(&link, vec![0; 2_500_000]).expect_err("no room").to_string();
    assert!(error.contains("the disk is full: it needs 2.5 MB or more, and "), "{error}");
    assert!(error.contains("full: ") && error.ends_with("free some space there, or give another place"), "{error}");
    write(Path::new("/dev/null"), "gone").expect("a device takes all");
    assert!(!Path::new("/dev/null").is_file() && !Path::new("/dev/full").is_file());
}

#[test]
fn refusals_name_file_cause_and_remedy_in_a_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |name: &str| write(&folder.path().join(name), "x").expect_err("refused").to_string();
    let error = refused("missing/theta.toml");
    assert!(error.contains("there is no folder") && error.ends_with("make it, or give another place"), "{error}");
    let error = refused("");
    assert!(error.contains("it is a folder"), "{error}");
    let file = folder.path().join("file");
    write(&file, "x").expect("written");
    let error = OutputFolder::create(&file).expect_err("a file").to_string();
    assert!(error.contains("it is a file") && !error.contains('\n'), "{error}");
}

#[test]
fn what_killed_programs_left_is_removed_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let place = |name: &str| folder.path().join(name);
    for name in [".unfinished-a-AbCd12", ".unfinished-a-b.toml-000000", ".unfinished-a", ".unfinished-a-b/c-1", "a"] {
        let _parent = fs::create_dir_all(place(name).parent().expect("a folder"));
        fs::write(place(name), "").expect("a file");
    }
    fs::create_dir_all(place(".unfinished-f-123456/rgb")).expect("a folder");
    symlink("a", place(".unfinished-l-123456")).expect("a link");
    let running = File::create(place(".unfinished-r-123456")).expect("a file");
    running.lock().expect("a lock");
    let own = Output::create(&place("own")).expect("begun");
    let stay = [".unfinished-a", ".unfinished-a-b", ".unfinished-l-123456", ".unfinished-r-123456", "a", "own"];
    own.finish().expect("there");
    assert_eq!(names(folder.path()), stay);
    // Looked at once: a folder may hold many files.
    fs::write(place(".unfinished-a-AbCd12"), "").expect("a file");
    clear(folder.path());
    assert_eq!(names(folder.path()).len(), stay.len() + 1);
}

#[test]
fn a_folder_appears_at_once_or_not_at_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("in/between/session");
    let output = OutputFolder::create(&path).expect("begun");
    output.write(Path::new("rgb/00000.png"), b"x").expect("written");
    assert!(!path.exists());
    drop(output);
    assert_eq!(names(folder.path()), [""; 0], "folders on the way go with it");
    let output = OutputFolder::create(&path).expect("begun");
    output.write(Path::new("rgb/00000.png"), b"x").expect("written");
    let error = output.write(Path::new("rgb/00000.png"), b"y").expect_err("twice").to_string();
    assert!(error.contains(&*path.join("rgb/00000.png").to_string_lossy()), "{error}");
    output.finish("cell.toml").expect("there");
    assert_eq!(names(&folder.path().join("in/between")), ["session"]);
    assert_eq!(names(&path), ["rgb"]);
    let error = OutputFolder::create(&path).expect_err("not empty").to_string();
    assert!(error.contains("it is not empty; choose a new folder"), "{error}");
}

#[test]
fn an_empty_folder_that_exists_is_filled_at_the_end() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join(".unfinished-out-123456")).expect("left by a killed program");
    let output = OutputFolder::create(folder.path()).expect("begun");
    output.write(Path::new("cell.toml"), b"").expect("written");
    output.write(Path::new("traj/pose.npy"), b"").expect("written");
    let begun = names(folder.path());
    assert!(begun.len() == 1 && begun[0].starts_with(".unfinished-"), "{begun:?}");
    output.finish("cell.toml").expect("there");
    assert_eq!(names(folder.path()), ["cell.toml", "traj"]);
}
