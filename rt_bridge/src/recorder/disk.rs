//! How much room is left on the disk of a recording.

use std::path::Path;

/// Free space without which no recording starts [bytes]: a minute of arm and pictures, compressed.
pub(super) const NEEDED_TO_START: u64 = 200_000_000;
/// Free space below which a recording stops, so that other programs go on [bytes].
const NEEDED_TO_GO_ON: u64 = 50_000_000;

/// What the room allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Room {
    /// Start and go on.
    Enough,
    /// Go on, but not start.
    TooLittleToStart {
        /// Free [MB].
        megabytes: u64,
    },
    TooLittleToGoOn {
        /// Free [MB].
        megabytes: u64,
    },
}

/// The room on the disk that holds `file`'s folder. A folder that cannot be asked counts as roomy: writing will tell.
pub(super) fn room(file: &Path) -> Room {
    let folder = match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    match rustix::fs::statvfs(folder) {
        Ok(disk) => verdict(disk.f_bavail.saturating_mul(disk.f_frsize)),
        Err(_) => Room::Enough,
    }
}

fn verdict(free: u64) -> Room {
    let megabytes = free / 1_000_000;
    if free < NEEDED_TO_GO_ON {
        Room::TooLittleToGoOn { megabytes }
    } else if free < NEEDED_TO_START {
        Room::TooLittleToStart { megabytes }
    } else {
        Room::Enough
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn little_room_forbids_to_start_and_less_forbids_to_go_on() {
        assert_eq!(verdict(300_000_000), Room::Enough);
        assert_eq!(verdict(150_000_000), Room::TooLittleToStart { megabytes: 150 });
        assert_eq!(verdict(49_000_000), Room::TooLittleToGoOn { megabytes: 49 });
        assert_eq!(room(Path::new("/nowhere/at/all.mcap")), Room::Enough);
    }
}
