//! What several passes over one recording brought, each in a file of its own, as one clip.

use crate::camera::ConvertError;
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::output::{Destination, Output};
use shared_mem::recording::{ClipInfo, ClipMessages, ClipWriter, Payload, Picture, ReadError};
use shared_mem::topics;
use std::iter::Peekable;
use std::path::Path;

/// A picture's header and its pixels.
pub(super) type Pixels = (ImageHeader, Vec<u8>);

/// Colour and depth of one moment.
pub(super) type Pair = [Pixels; 2];

/// What the passes brought, beside the clip that they become and without a name yet.
pub(super) struct Passes {
    out: Destination,
    files: Vec<Output>,
}

impl Passes {
    pub(super) fn new(out: Destination) -> Self {
        Self { out, files: Vec::new() }
    }

    /// Begins the clip of a pass.
    pub(super) fn begin(&self, info: &ClipInfo) -> Result<ClipWriter<Output>, ConvertError> {
        Ok(ClipWriter::whole(self.out.begin()?, info)?)
    }

    /// Keeps what a pass brought.
    pub(super) fn keep(&mut self, clip: ClipWriter<Output>) -> Result<(), ConvertError> {
        let (_, file) = clip.close()?;
        self.files.push(file);
        Ok(())
    }

    /// Makes them one clip, its pairs by the camera's clock; `camera` describes it.
    pub(super) fn finish(mut self, camera: &CameraInfo, info: &ClipInfo) -> Result<(), ConvertError> {
        if self.files.len() > 1 {
            return merge(&self.files, self.begin(info)?, camera);
        }
        self.files.pop().map_or(Ok(()), |only| Ok(only.finish()?))
    }
}

/// Writes a pair, with the description of the camera before the first.
pub(super) fn write(
    writer: &mut ClipWriter<Output>,
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

fn merge(files: &[Output], mut writer: ClipWriter<Output>, camera: &CameraInfo) -> Result<(), ConvertError> {
    let open = |file: &Output| Ok(Pairs::open(file.unfinished_path())?.peekable());
    let mut passes = files.iter().map(open).collect::<Result<Vec<_>, ReadError>>()?;
    let mut describe = Some(camera);
    while let Some(earliest) = earliest(&mut passes) {
        let Some(pair) = passes[earliest].next() else { continue };
        write(&mut writer, &pair?, describe.take())?;
    }
    writer.finish()?;
    Ok(())
}

/// The pass whose next pair is the earliest; one that cannot be read comes first, so that it is reported.
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
        let mut passes = Passes::new(Destination::new(&out, false).expect("a place"));
        for numbers in [&[2, 3, 6][..], &[4, 7], &[1, 5]] {
            let mut writer = passes.begin(&info).expect("a file");
            for number in numbers {
                write(&mut writer, &pair(*number), None).expect("written");
            }
            passes.keep(writer).expect("kept");
        }
        passes.finish(&camera, &info).expect("one clip");
        assert_eq!(pairs(&out), (1..=7).map(pair).collect::<Vec<_>>());
        assert_eq!(std::fs::read_dir(folder.path()).expect("the folder").count(), 1, "nothing else stays");
    }
}
