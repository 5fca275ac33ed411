//! Paths that are copied from one file into another: where the copy is read, they lead to the same place.

use std::path::{Path, PathBuf, absolute};

/// `path` as it holds in every folder. However a file is spelt, it has one such path: its folder is the one that the system knows, with
/// no link in it. A link at the end stays, since its name, and not that of what it leads to, says what kind of file it is.
pub fn from_anywhere(path: &Path) -> PathBuf {
    // Of a file by its bare name, the parent has no name at all, and there is no absolute path to nothing.
    let named = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    let Ok(whole) = absolute(named) else { return path.to_owned() };
    match (whole.parent().map(Path::canonicalize), whole.file_name()) {
        (Some(Ok(folder)), Some(name)) => folder.join(name),
        _ => whole,
    }
}

/// `path` as a file in the folder of `file` may name it: from there where it lies there or below, else from anywhere.
pub fn beside(file: &Path, path: &Path) -> PathBuf {
    let (file, path) = (from_anywhere(file), from_anywhere(path));
    let within = file.parent().and_then(|folder| path.strip_prefix(folder).ok()).map(Path::to_owned);
    within.unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_has_one_path_however_it_is_spelt() {
        let here = std::env::current_dir().and_then(|here| here.canonicalize()).expect("a folder");
        let wanted = here.join("Cargo.toml");
        for spelt in ["Cargo.toml", "./Cargo.toml", "src/../Cargo.toml", "././Cargo.toml"] {
            assert_eq!(from_anywhere(Path::new(spelt)), wanted, "{spelt}");
        }
        assert_eq!(from_anywhere(&wanted), wanted);
        assert_eq!([from_anywhere(Path::new("")), from_anywhere(Path::new("."))], [here.clone(), here]);
    }

    #[test]
    fn a_link_keeps_its_name_and_links_on_the_way_are_followed() {
        let folder = tempfile::tempdir().expect("room");
        let at = folder.path().canonicalize().expect("a folder");
        std::fs::create_dir(at.join("store")).expect("room");
        std::fs::write(at.join("store/4f2a"), "").expect("room");
        std::os::unix::fs::symlink(at.join("store/4f2a"), at.join("store/mug.obj")).expect("a link");
        std::os::unix::fs::symlink(at.join("store"), at.join("lab")).expect("a link");
        assert_eq!(from_anywhere(&at.join("lab/mug.obj")), at.join("store/mug.obj"));
        assert_eq!(from_anywhere(Path::new("/no/such/folder/../mug.obj")), Path::new("/no/such/folder/../mug.obj"));
    }

    #[test]
    fn a_file_names_what_lies_below_its_folder_from_there() {
        let folder = tempfile::tempdir().expect("room");
        let at = folder.path().canonicalize().expect("a folder");
        assert_eq!(beside(&at.join("cell.toml"), &at.join("arm.urdf")), Path::new("arm.urdf"));
        assert_eq!(beside(&at.join("cell.toml"), Path::new("/elsewhere/arm.urdf")), Path::new("/elsewhere/arm.urdf"));
        assert_eq!(beside(Path::new("cell.toml"), Path::new("./arm.urdf")), Path::new("arm.urdf"));
    }
}
