//! What several passes over one recording brought, each in a file of its own, as one clip.

use crate::camera::ConvertError;
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::recording::{ClipInfo, ClipMessages, ClipWriter, Payload, Picture, ReadError};
use shared_mem::topics;
use std::fs;
use std::iter::Peekable;
use std::path::{Path, PathBuf};

/// A picture's header and its pixels.
pub(super) type Pixels = (ImageHeader, Vec<u8>);

/// Colour and depth of one moment.
pub(super) type Pair = [Pixels; 2];

/// The files of the passes beside the clip that they become. They go when this goes.
pub(super) struct Passes {
    out: PathBuf,
    files: Vec<PathBuf>,
}

impl Passes {
    /// None yet.
    pub(super) fn new(out: &Path) -> Self {
        Self { out: out.to_owned(), files: Vec::new() }
    }

    /// The name of the next pass's file, which is free.
    pub(super) fn next_file(&mut self) -> Result<PathBuf, ConvertError> {
        let file = self.out.with_extension(format!("mcap.pass_{}", self.files.len() + 1));
        match fs::remove_file(&file) {
            Err(source) if file.exists() => return Err(ConvertError::File { path: file, source }),
            _ => {}
        }
        self.files.push(file.clone());
        Ok(file)
    }

    /// Forgets the last pass, which brought nothing.
    pub(super) fn forget_last(&mut self) {
        self.files.pop().map(fs::remove_file);
    }

    /// Makes them one clip, its pairs by the camera's clock; `camera` describes it.
    pub(super) fn finish(self, camera: &CameraInfo, info: &ClipInfo) -> Result<(), ConvertError> {
        let failed = |source| ConvertError::File { path: self.out.clone(), source };
        if let [only] = self.files.as_slice() {
            return fs::rename(only, &self.out).map_err(failed);
        }
        let unfinished = self.out.with_extension("mcap.unfinished");
        let _not_there = fs::remove_file(&unfinished);
        merge(&self.files, &unfinished, camera, info)
            .and_then(|()| fs::rename(&unfinished, &self.out).map_err(failed))
            .inspect_err(|_| drop(fs::remove_file(&unfinished)))
    }
}

impl Drop for Passes {
    fn drop(&mut self) {
        for file in &self.files {
            let _became_the_clip = fs::remove_file(file);
        }
    }
}

/// Writes a pair, with the description of the camera before the first.
pub(super) fn write(
    writer: &mut ClipWriter,
    [color, depth]: &Pair,
    describe: Option<&CameraInfo>,
) -> Result<(), ConvertError> {
    if let Some(camera) = describe {
        writer.camera_info(&CameraInfo { stamp_ns: depth.0.stamp_ns, ..*camera })?;
    }
    writer.image(topics::CAMERA_COLOR, &color.0, &color.1)?;
    writer.image(topics::CAMERA_DEPTH, &depth.0, &depth.1)?;
    Ok(())
}

fn merge(files: &[PathBuf], out: &Path, camera: &CameraInfo, info: &ClipInfo) -> Result<(), ConvertError> {
    let mut passes =
        files.iter().map(|file| Ok(Pairs::open(file)?.peekable())).collect::<Result<Vec<_>, ReadError>>()?;
    let mut writer = ClipWriter::create(out, info)?;
    let mut describe = Some(camera);
    while let Some(earliest) = earliest(&mut passes) {
        let Some(pair) = passes[earliest].next() else { continue };
        write(&mut writer, &pair?, describe.take())?;
    }
    writer.finish()?;
    Ok(())
}

/// The pass whose next pair is the earliest; one that cannot be read comes first, so that it is told.
fn earliest(passes: &mut [Peekable<Pairs>]) -> Option<usize> {
    let next = |(pass, pairs): (usize, &mut Peekable<Pairs>)| {
        let stamp = pairs.peek()?.as_ref().map_or(0, |[_, depth]| depth.0.device_ns);
        Some((stamp, pass))
    };
    passes.iter_mut().enumerate().filter_map(next).min().map(|(_, pass)| pass)
}

/// The pairs of a pass's file.
struct Pairs(ClipMessages);

impl Pairs {
    fn open(file: &Path) -> Result<Self, ReadError> {
        let topics = [topics::CAMERA_COLOR.name, topics::CAMERA_DEPTH.name];
        ClipMessages::open(file, &topics).map(Self)
    }

    fn picture(&mut self) -> Option<Result<Pixels, ReadError>> {
        loop {
            match self.0.next()? {
                Ok(message) => {
                    if let Payload::Picture(Picture::Pixels { header, pixels }) = message.payload {
                        return Some(Ok((header, pixels)));
                    }
                }
                Err(e) => return Some(Err(e)),
            }
        }
    }
}

impl Iterator for Pairs {
    type Item = Result<Pair, ReadError>;

    /// Colour, then depth: as [`write`] writes them.
    fn next(&mut self) -> Option<Self::Item> {
        let (color, depth) = (self.picture()?, self.picture()?);
        Some(color.and_then(|color| Ok([color, depth?])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::msg::image::PixelEncoding;

    fn pair(number: u64) -> Pair {
        let header = ImageHeader {
            stamp_ns: 5_000_000_000 + number,
            device_ns: 1_000 + number,
            sequence: number,
            width: 1,
            height: 1,
            ..ImageHeader::default()
        };
        let color = ImageHeader { encoding: PixelEncoding::Rgb8, stride: 3, ..header };
        let depth = ImageHeader { encoding: PixelEncoding::Depth16, stride: 2, ..header };
        [(color, vec![number as u8; 3]), (depth, vec![number as u8; 2])]
    }

    fn pairs(file: &Path) -> Vec<Pair> {
        Pairs::open(file).expect("a clip").collect::<Result<_, _>>().expect("pairs")
    }

    #[test]
    fn what_later_passes_brought_stands_where_the_camera_saw_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("clip.mcap");
        let (camera, info) = (CameraInfo::default(), ClipInfo::default());
        let mut passes = Passes::new(&out);
        for numbers in [&[2, 3, 6][..], &[4, 7], &[1, 5]] {
            let mut writer = ClipWriter::create(&passes.next_file().expect("a name"), &info).expect("a file");
            for number in numbers {
                write(&mut writer, &pair(*number), None).expect("written");
            }
            writer.finish().expect("finished");
        }
        passes.finish(&camera, &info).expect("one clip");
        assert_eq!(pairs(&out), (1..=7).map(pair).collect::<Vec<_>>());
        assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 1, "nothing else stays");
    }
}
