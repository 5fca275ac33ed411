//! Where the picture of a frame lies: programs leave the ending out, or write paths with the separators of another system.

use std::path::{Path, PathBuf};

/// Endings that a name may lack.
const ENDINGS: [&str; 6] = ["png", "jpg", "jpeg", "PNG", "JPG", "JPEG"];

/// A path as it was written, on Windows or elsewhere.
pub(super) fn path_of(written: &str) -> PathBuf {
    PathBuf::from(written.replace('\\', "/"))
}

/// The file of a picture that a list in `folder` names; the name itself where there is none.
pub(super) fn found(folder: &Path, picture: &Path) -> PathBuf {
    let whole = folder.join(picture);
    if whole.is_file() {
        return whole;
    }
    let ended = ENDINGS.iter().map(|ending| PathBuf::from(format!("{}.{ending}", whole.display())));
    ended.into_iter().find(|path| path.is_file()).unwrap_or(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_without_its_ending_and_one_of_another_system_are_found() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join("train")).expect("a folder");
        for name in ["r_0.png", "r_0.5.jpg", "b.png"] {
            std::fs::write(folder.path().join("train").join(name), b"").expect("a file");
        }
        for (written, name) in [
            ("./train/r_0", "r_0.png"),
            ("train/r_0.5", "r_0.5.jpg"),
            ("train\\b.png", "b.png"),
            (".\\train\\b", "b.png"),
        ] {
            let at = found(folder.path(), &path_of(written));
            assert_eq!(at.file_name().and_then(|n| n.to_str()), Some(name), "{written}");
            assert!(at.is_file());
        }
        assert_eq!(found(folder.path(), Path::new("c")), folder.path().join("c"));
    }
}
