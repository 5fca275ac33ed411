//! Where shared memory lies: a folder and names in `/dev/shm` that belong to this user alone.
//!
//! iceoryx2 keeps sockets and book-keeping below a folder and the memory itself under flat names in `/dev/shm`. Where
//! another user owns or may write one of these, that user can keep everybody out or cut a file under a mapping short, which
//! kills the process that reads it (SIGBUS). So all of it is made for this user alone, and what is not is refused.

use super::{DOMAIN_VARIABLE, TransportError};
use crate::typed::Command;
use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path as IceoryxPath, SemanticString as _};
use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Where Linux keeps shared memory.
pub(super) const MEMORY: &str = "/dev/shm";
/// The variable that names a folder of this user alone (XDG Base Directory Specification).
const FOLDER_VARIABLE: &str = "XDG_RUNTIME_DIR";
/// Longest path of a socket that the kernel takes: `sun_path`, 108 bytes with the end mark.
const LONGEST_SOCKET: usize = 107;
/// What iceoryx2 appends to folder and prefix: a number of 128 bits and `.event`.
const SOCKET_NAME: usize = 39 + 6;

/// Something in the place is not this user's alone, or cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot use shared memory: {what}; {remedy}")]
pub struct PlaceError {
    /// Which path, whose it is, what is wrong with it.
    pub what: String,
    /// What a person does about it.
    pub remedy: String,
}

/// A file in `/dev/shm` under a name of ours that another user made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ForeignFile {
    /// The file.
    pub path: PathBuf,
    /// User id of its owner.
    pub owner: u32,
}

/// The folder and the names of one domain of one user.
#[derive(Debug)]
pub(super) struct Place {
    folder: PathBuf,
    /// Of all names in the folder and in `/dev/shm`.
    prefix: String,
    user: u32,
}

impl Place {
    /// The place of this user's `domain`; its folder is made where it is missing.
    pub(super) fn open(domain: &str) -> Result<Self, TransportError> {
        let short_name = !domain.is_empty() && domain.len() <= 24;
        if !short_name || !domain.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-') {
            let what = format!(
                "the domain {domain:?} (set by {DOMAIN_VARIABLE}) is no name of 1 to 24 letters, digits and dashes"
            );
            return Err(TransportError::Node { what });
        }
        let user = rustix::process::geteuid().as_raw();
        let prefix = format!("{}{domain}_", prefix_of(user));
        let place = Self { folder: folder(user)?, prefix, user };
        place.check_length()?;
        place.refuse_foreign_files()?;
        Ok(place)
    }

    /// iceoryx2's settings for this place, so that neither other programs nor other domains meet us.
    pub(super) fn configuration(&self) -> Result<Config, TransportError> {
        let mut config = Config::default();
        config.global.prefix = FileName::new(self.prefix.as_bytes()).map_err(TransportError::node)?;
        let folder = self.folder.as_os_str().as_encoded_bytes();
        config.global.set_root_path(&IceoryxPath::new(folder).map_err(TransportError::node)?);
        Ok(config)
    }

    /// Refuses to go on where another user made a file that could be taken for one of ours.
    pub(super) fn refuse_foreign_files(&self) -> Result<(), PlaceError> {
        match foreign_files(Path::new(MEMORY), &self.prefix, self.user).first() {
            None => Ok(()),
            Some(ForeignFile { path, owner }) => Err(PlaceError {
                what: format!("{} belongs to user {owner}, not to user {}", path.display(), self.user),
                remedy: format!(
                    "have that user or root remove it, or set {DOMAIN_VARIABLE} to another number for all programs of this cell"
                ),
            }),
        }
    }

    fn check_length(&self) -> Result<(), PlaceError> {
        let length = self.folder.as_os_str().len() + 1 + self.prefix.len() + SOCKET_NAME;
        if length <= LONGEST_SOCKET {
            return Ok(());
        }
        Err(PlaceError {
            what: format!(
                "sockets in {} under the name {}... would have paths of {length} bytes, and the kernel takes {LONGEST_SOCKET}",
                self.folder.display(),
                self.prefix
            ),
            remedy: format!("set {DOMAIN_VARIABLE} to a shorter name or {FOLDER_VARIABLE} to a shorter path"),
        })
    }
}

/// The beginning of all names of a user, whatever the domain.
fn prefix_of(user: u32) -> String {
    format!("twinalign_{user}_")
}

/// This user's folder, made where it is missing: below `$XDG_RUNTIME_DIR`; where that is not set, below the folder that it
/// names by custom, so that a program started by hand and one started by a service meet; else in `/tmp`.
///
/// # Errors
/// [`PlaceError`] when it, or the folder above it, is not this user's alone.
pub(super) fn folder(user: u32) -> Result<PathBuf, PlaceError> {
    let named = std::env::var_os(FOLDER_VARIABLE).map(PathBuf::from).filter(|path| path.is_absolute());
    folder_below(named.as_deref(), &PathBuf::from(format!("/run/user/{user}")), Path::new("/tmp"), user)
}

fn folder_below(named: Option<&Path>, usual: &Path, shared: &Path, user: u32) -> Result<PathBuf, PlaceError> {
    let path = match named {
        Some(named) => {
            refuse_unless_own(named, fs::metadata(named), user)?;
            named.join("twinalign")
        }
        None if refuse_unless_own(usual, fs::metadata(usual), user).is_ok() => usual.join("twinalign"),
        None => shared.join(format!("twinalign-{user}")),
    };
    match fs::DirBuilder::new().mode(0o700).create(&path) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists => return Err(unusable(&path, &e)),
        _ => {}
    }
    // Not followed: a link may be pointed elsewhere by whoever made it.
    refuse_unless_own(&path, fs::symlink_metadata(&path), user)?;
    Ok(path)
}

/// A folder that belongs to this user, into which nobody else may write; `found` is what is there.
fn refuse_unless_own(path: &Path, found: io::Result<fs::Metadata>, user: u32) -> Result<(), PlaceError> {
    let found = found.map_err(|e| unusable(path, &e))?;
    let refused = |what: String, remedy: String| Err(PlaceError { what: format!("{} {what}", path.display()), remedy });
    if found.uid() != user {
        let what = format!("belongs to user {}, not to user {user}", found.uid());
        return refused(
            what,
            format!("have that user or root remove it, or set {FOLDER_VARIABLE} to a folder of your own"),
        );
    }
    if !found.is_dir() {
        return refused("is no folder".into(), "remove it".into());
    }
    if found.mode() & 0o022 != 0 {
        let what = format!("of user {user} can be written by others (mode {:o})", found.mode() & 0o777);
        return refused(what, format!("take that right away: `{}`", Command::new("chmod go-w").path(path)));
    }
    Ok(())
}

fn unusable(path: &Path, error: &io::Error) -> PlaceError {
    PlaceError {
        what: format!("{}: {error}", path.display()),
        remedy: format!("make it a folder of your own, or set {FOLDER_VARIABLE} to one"),
    }
}

/// Files of other users under names of this user's, in every domain.
pub(super) fn all_foreign_files(user: u32) -> Vec<ForeignFile> {
    foreign_files(Path::new(MEMORY), &prefix_of(user), user)
}

fn foreign_files(memory: &Path, prefix: &str, user: u32) -> Vec<ForeignFile> {
    let foreign = files(memory, prefix).filter(|(_, found)| found.uid() != user);
    foreign.map(|(path, found)| ForeignFile { path, owner: found.uid() }).collect()
}

/// Files whose name begins so. One that goes away meanwhile is left out.
fn files(memory: &Path, prefix: &str) -> impl Iterator<Item = (PathBuf, fs::Metadata)> {
    let entries = fs::read_dir(memory).into_iter().flatten().flatten();
    let ours = entries.filter(move |entry| entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes()));
    ours.filter_map(|entry| Some((entry.path(), entry.metadata().ok()?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt as _, chown, symlink};

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).expect("it exists").mode() & 0o777
    }

    fn me() -> u32 {
        rustix::process::geteuid().as_raw()
    }

    /// A folder as the system gives one to each user.
    fn own(parent: &Path, name: &str) -> PathBuf {
        let path = parent.join(name);
        fs::DirBuilder::new().mode(0o700).create(&path).expect("a folder");
        path
    }

    #[test]
    fn the_folder_is_the_one_that_is_named_then_the_usual_one_then_one_in_tmp() {
        let scratch = tempfile::tempdir().expect("a folder");
        let [named, usual, shared] = ["named", "usual", "shared"].map(|name| own(scratch.path(), name));
        let missing = scratch.path().join("missing");
        let below = |named, usual| folder_below(named, usual, &shared, me()).expect("a folder");
        assert_eq!(below(Some(&named), &usual), named.join("twinalign"));
        assert_eq!(below(None, &usual), usual.join("twinalign"));
        let made = below(None, &missing);
        assert_eq!(made, shared.join(format!("twinalign-{}", me())));
        assert_eq!(mode(&made), 0o700);
        assert_eq!(below(None, &missing), made, "the second process takes the folder of the first");
    }

    #[test]
    fn a_folder_that_others_may_write_or_point_elsewhere_is_refused_with_the_cure() {
        let scratch = tempfile::tempdir().expect("a folder");
        let named = own(scratch.path(), "named");
        let refusal = || folder_below(Some(&named), Path::new("/none"), Path::new("/none"), me()).expect_err("refused");
        fs::set_permissions(&named, fs::Permissions::from_mode(0o777)).expect("its mode");
        assert!(refusal().to_string().contains("(mode 777); take that right away: `chmod go-w /"), "{}", refusal());
        fs::set_permissions(&named, fs::Permissions::from_mode(0o700)).expect("its mode");
        symlink(scratch.path(), named.join("twinalign")).expect("a link");
        assert!(refusal().to_string().contains("named/twinalign is no folder; remove it"), "{}", refusal());
    }

    #[test]
    fn files_and_folders_of_another_user_are_refused_by_name() {
        if me() != 0 {
            return; // only root can give files away
        }
        let scratch = tempfile::tempdir().expect("a folder");
        let shared = own(scratch.path(), "shared");
        let squatted = own(&shared, "twinalign-0");
        chown(&squatted, Some(12_345), None).expect("given away");
        let error = folder_below(None, Path::new("/none"), &shared, 0).expect_err("refused").to_string();
        assert!(error.contains("shared/twinalign-0 belongs to user 12345, not to user 0; have that user"), "{error}");
        for name in ["twinalign_0_7_a", "twinalign_0_7_b", "twinalign_0_71_c", "other"] {
            fs::write(shared.join(name), "").expect("a file");
        }
        chown(shared.join("twinalign_0_7_b"), Some(12_345), None).expect("given away");
        let expected = [ForeignFile { path: shared.join("twinalign_0_7_b"), owner: 12_345 }];
        assert_eq!(foreign_files(&shared, "twinalign_0_7_", 0), expected);
        assert_eq!(foreign_files(&shared, "twinalign_0_71_", 0), []);
    }

    #[test]
    fn paths_too_long_for_a_socket_are_refused_before_one_is_made() {
        let place =
            |folder: &str| Place { folder: folder.into(), prefix: "twinalign_1000_abcdefghij_".into(), user: 1000 };
        assert_eq!(place("/run/user/1000/twinalign").check_length(), Ok(()));
        let error = place("/home/somebody/a/long/way/to/the/folder").check_length().expect_err("too long").to_string();
        assert!(error.contains("bytes, and the kernel takes 107; set TWINALIGN_DOMAIN to a shorter name"), "{error}");
    }
}
