//! The one way in for files: only regular files are opened, and none is read beyond the size that its kind can have.
//!
//! A path given by mistake may name a folder, a pipe that nobody writes to, a device without an end, or a file of another
//! kind that is larger than the memory. Each is refused in one line before anything is read. Recordings are opened here
//! too, but read piece by piece, so that their size does not matter.
//!
//! | file | owns |
//! |---|---|
//! | `encoding` | which letters the bytes of a text are, and where its lines end |
//! | `decimal` | which sign is the decimal one of a table |
//! | `packing` | what is packed as a whole |

mod decimal;
mod encoding;
mod packing;

pub use decimal::{Decimal, Said};
pub use encoding::{Encoding, NoText, Text, decode};
pub use packing::Packing;

use rustix::fs::OFlags;
use std::fs::{File, OpenOptions};
use std::io::{self, Read as _};
use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

/// What a file that is read whole holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A cell.toml, a theta.toml, effects, or a camera's matrix.
    Configuration,
    /// A robot's description (URDF), without its meshes.
    Robot,
    /// The surface of an object.
    Mesh,
    /// Gaussian splats.
    Splats,
    /// A PNG or JPEG picture.
    Picture,
    /// Numbers as NumPy stores them.
    Array,
    /// A network of a policy.
    Network,
    /// Poses of pictures (JSON).
    Poses,
    /// Lists of commands, frames or states (JSON).
    List,
}

impl Kind {
    /// The largest file of this kind that is read [bytes].
    pub const fn limit(self) -> u64 {
        const MIB: u64 = 1 << 20;
        match self {
            // A session of 100 000 listed clips takes 8 MB.
            Self::Configuration => 16 * MIB,
            // Descriptions of whole humanoids stay below 1 MB.
            Self::Robot => 16 * MIB,
            // A scan of ten million triangles takes 500 MB as a binary stl.
            Self::Mesh => 512 * MIB,
            // 17 million splats of the third degree, 236 bytes each: a large hall.
            Self::Splats => 4096 * MIB,
            // Twice what the largest picture that is unpacked takes without any compression.
            Self::Picture => 256 * MIB,
            // Eight million poses of 16 doubles: three days at 30 Hz.
            Self::Array => 1024 * MIB,
            // Twice what a protocol buffer holds: larger networks have their weights elsewhere.
            Self::Network => 4096 * MIB,
            // A hundred thousand pictures with cameras of their own.
            Self::Poses => 64 * MIB,
            // An hour of seven joints at 1 kHz takes 600 MB.
            Self::List => 1024 * MIB,
        }
    }

    /// What it is, in an error.
    const fn name(self) -> &'static str {
        match self {
            Self::Configuration => "a configuration",
            Self::Robot => "a robot's description",
            Self::Mesh => "a mesh",
            Self::Splats => "splats",
            Self::Picture => "a picture",
            Self::Array => "an array",
            Self::Network => "a network",
            Self::Poses => "a list of poses",
            Self::List => "a list",
        }
    }

    /// How a file that is too large gets smaller.
    const fn remedy(self) -> &'static str {
        match self {
            Self::Configuration | Self::Robot => "look whether it is the right file",
            Self::Mesh => "reduce its triangles",
            Self::Splats => "crop the scan, or export it compressed",
            Self::Picture => "scale it down",
            Self::Network => "export it with its weights in a file of their own",
            Self::Poses => "leave pictures out that show nothing new",
            Self::Array | Self::List => "cut the clip into shorter ones",
        }
    }
}

/// A file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The file is missing or unreadable.
    #[error("cannot read {}: {source}; give the path of an existing file", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A folder, a pipe, a socket or a device.
    #[error("cannot read {}: it is {what}; give the path of a regular file", path.display())]
    NotAFile {
        /// What was named.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// More than a file of its kind can hold.
    #[error(
        "cannot read {}: it holds {}, and {} may have {} MiB at most; {}",
        path.display(),
        size.map_or_else(|| "more than that".to_owned(), |size| format!("{} MiB", size >> 20)),
        kind.name(),
        kind.limit() >> 20,
        kind.remedy()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its kind.
        kind: Kind,
        /// Its size [bytes]; `None` where the system does not tell it.
        size: Option<u64>,
    },
    /// The bytes are no text, or one in an encoding that is not known.
    #[error("cannot read {}: {what}", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// What it is.
        what: NoText,
    },
}

impl InputError {
    fn io(path: &Path) -> impl Fn(io::Error) -> Self + '_ {
        move |source| Self::Io { path: path.to_owned(), source }
    }
}

/// Opens a regular file for reading.
///
/// # Errors
/// [`InputError`] when it is missing, unreadable, or no regular file.
pub fn open(path: &Path) -> Result<File, InputError> {
    // To open a device may set it going, so it is looked at first. What is opened may be another file meanwhile: hence the
    // second look, and the flag without which opening a pipe waits for its writer.
    check(path, &std::fs::metadata(path).map_err(InputError::io(path))?)?;
    let flag = OFlags::NONBLOCK.bits().cast_signed();
    let file = OpenOptions::new().read(true).custom_flags(flag).open(path).map_err(InputError::io(path))?;
    check(path, &file.metadata().map_err(InputError::io(path))?)?;
    Ok(file)
}

/// The bytes of a regular file that is no larger than its kind can be.
///
/// # Errors
/// [`InputError`] when it cannot be opened or read, or is too large.
pub fn bytes(path: &Path, kind: Kind) -> Result<Vec<u8>, InputError> {
    let mut file = open(path)?;
    let size = file.metadata().map_err(InputError::io(path))?.len();
    let too_large = |size| InputError::TooLarge { path: path.to_owned(), kind, size };
    if size > kind.limit() {
        return Err(too_large(Some(size)));
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(size).unwrap_or(usize::MAX)).map_err(|_no_room| too_large(Some(size)))?;
    // Some file systems tell no size, and a file may grow.
    file.by_ref().take(kind.limit() + 1).read_to_end(&mut bytes).map_err(InputError::io(path))?;
    if bytes.len() as u64 > kind.limit() { Err(too_large(None)) } else { Ok(bytes) }
}

/// The text of a regular file that is no larger than its kind can be.
///
/// # Errors
/// As [`bytes`], and when it is neither UTF-8 nor UTF-16. What may be Windows-1252 alone is read where the text itself says so, as an
/// XML document does: elsewhere a name could come out wrong.
///
/// # Example
/// ```
/// use shared_mem::input::{self, Kind};
///
/// let folder = tempfile::tempdir()?;
/// let file = folder.path().join("cell.toml");
/// std::fs::write(&file, "[table]\nheight = 0.0\n")?;
/// assert!(input::text(&file, Kind::Configuration)?.starts_with("[table]"));
///
/// // What is no regular file is refused, instead of being waited for.
/// assert!(input::text(folder.path(), Kind::Configuration).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn text(path: &Path, kind: Kind) -> Result<String, InputError> {
    let bytes = bytes(path, kind)?;
    let is_no_text = |what| InputError::NotText { path: path.to_owned(), what };
    let first_other = bytes.iter().position(|byte| !byte.is_ascii());
    let line = 1 + bytes.iter().take(first_other.unwrap_or(0)).filter(|byte| **byte == b'\n').count();
    let Text { text, encoding } = decode(bytes).map_err(is_no_text)?;
    if encoding == Encoding::Windows1252 && !encoding::declares_latin(&text) {
        return Err(is_no_text(NoText::Encoding(line)));
    }
    Ok(text)
}

fn check(path: &Path, metadata: &std::fs::Metadata) -> Result<(), InputError> {
    let kind = metadata.file_type();
    if kind.is_file() {
        return Ok(());
    }
    let what = if kind.is_dir() {
        "a folder"
    } else if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    };
    Err(InputError::NotAFile { path: path.to_owned(), what })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regular_file_is_read_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "a = 1\n").expect("a file");
        assert_eq!(text(&path, Kind::Configuration).expect("text"), "a = 1\n");
        std::os::unix::fs::symlink(&path, folder.path().join("b.toml")).expect("a link");
        assert_eq!(bytes(&folder.path().join("b.toml"), Kind::Configuration).expect("bytes"), b"a = 1\n");
        std::fs::write(&path, [0xff, 0xfe, 0, 0]).expect("a file");
        assert!(matches!(text(&path, Kind::Configuration), Err(InputError::NotText { .. })));
    }

    #[test]
    fn a_text_of_another_system_is_read_or_has_to_be_saved_as_utf_8() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("cell.toml");
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("a file");
            text(&path, Kind::Configuration).map_err(|error| error.to_string())
        };
        let wide: Vec<u8> = "\u{feff}a = 1 # Größe\r\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(read(&wide), Ok("a = 1 # Größe\r\n".into()));
        let line = read(b"b = 2\na = 1 # Gr\xf6\xdfe\n").expect_err("another encoding");
        assert!(line.contains("cell.toml: line 2 is no UTF-8") && line.contains("save it as UTF-8"), "{line}");
        let document = b"<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><robot name=\"Gr\xf6\xdfe\"/>";
        assert!(read(document).is_ok_and(|text| text.contains("Größe")));
        let line = read(b"\x1f\x8b\x08\x00.....").expect_err("packed");
        assert!(line.contains("it is packed with gzip; unpack it with `gunzip`"), "{line}");
    }

    #[test]
    fn what_is_no_file_is_refused_in_one_line_before_it_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe");
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR).expect("a pipe");
        let (one, two) = (folder.path().join("one"), folder.path().join("two"));
        std::os::unix::fs::symlink(&two, &one).expect("a link");
        std::os::unix::fs::symlink(&one, &two).expect("a link");
        let cases = [
            (folder.path(), "it is a folder"),
            (&pipe, "it is a pipe"),
            (Path::new("/dev/zero"), "it is a device"),
            (&one, "ymbolic link"),
            (Path::new("/nothing/here"), "No such file"),
        ];
        for (path, what) in cases {
            for kind in [Kind::Configuration, Kind::Splats] {
                let error = bytes(path, kind).expect_err("no file").to_string();
                let named = error.contains(path.to_str().expect("a UTF-8 path")) && error.contains("give the path");
                assert!(error.contains(what) && named && !error.contains('\n'), "{error}");
            }
        }
    }

    #[test]
    fn a_file_larger_than_its_kind_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("cell.toml");
        // Without any bytes on the disk.
        File::create(&path).and_then(|file| file.set_len(1 << 40)).expect("a sparse file");
        let error = bytes(&path, Kind::Configuration).expect_err("too large").to_string();
        assert!(error.contains("cell.toml: it holds 1048576 MiB") && error.contains("16 MiB at most"), "{error}");
    }
}
