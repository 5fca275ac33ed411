//! Pictures of clips in one of two forms: pixels as the project uses them, or a JPEG as it was recorded.

use super::ros2::{CompressedImage, Image};
use crate::msg::image::{ImageHeader, PixelEncoding, StampDomain};

/// Largest picture that is unpacked [pixels]: more than any camera of a robot has, and 270 MB at 16 bits in four channels.
/// A compressed file of some kilobytes can claim thousands of times as many.
const LARGEST: u64 = 1 << 25;
/// How a PNG file starts.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";

/// One picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Picture {
    /// Colour (`Rgb8`) or depth (`Depth16`) pixels, rows of `header.stride` bytes.
    Pixels {
        /// Size, encoding and stamps.
        header: ImageHeader,
        /// The pixels.
        pixels: Vec<u8>,
    },
    /// A compressed picture that is not unpacked here (JPEG).
    Compressed {
        /// Stamp of its header [ns].
        stamp_ns: u64,
        /// Format as the bag names it: `"jpeg"`, `"rgb8; jpeg compressed bgr8"`.
        format: String,
        /// The file.
        bytes: Vec<u8>,
    },
}

/// How the bytes of a foreign pixel become one of ours.
#[derive(Debug, Clone, Copy)]
enum Pixel {
    /// Bytes a pixel, and which of them are red, green, blue.
    Colour(usize, [usize; 3]),
    /// 16-bit counts of a millimetre.
    Count,
    /// 32-bit floats in metres.
    Metres,
}

impl Picture {
    /// From an own clip; a sentence where the pixels are fewer than the header says.
    pub(super) fn from_own(header: ImageHeader, pixels: Vec<u8>) -> Result<Self, String> {
        let ImageHeader { width, height, stride, .. } = header;
        check_size(width, height)?;
        let bytes = if header.encoding == PixelEncoding::Rgb8 { 3 } else { 2 };
        let [row, needed] = [u64::from(width) * bytes, u64::from(stride) * u64::from(height)];
        if row > u64::from(stride) || needed > pixels.len() as u64 {
            let held = pixels.len();
            return Err(format!(
                "a picture of {width} x {height} pixels in rows of {stride} bytes holds only {held} bytes"
            ));
        }
        Ok(Self::Pixels { header, pixels })
    }

    /// From `sensor_msgs/Image`; a sentence for an encoding that has no meaning here.
    pub(super) fn from_image(image: &Image<'_>) -> Result<Self, String> {
        let pixel = match image.encoding {
            "rgb8" | "8UC3" => Pixel::Colour(3, [0, 1, 2]),
            "bgr8" => Pixel::Colour(3, [2, 1, 0]),
            "rgba8" => Pixel::Colour(4, [0, 1, 2]),
            "bgra8" => Pixel::Colour(4, [2, 1, 0]),
            "mono8" | "8UC1" => Pixel::Colour(1, [0, 0, 0]),
            "mono16" | "16UC1" => Pixel::Count,
            "32FC1" => Pixel::Metres,
            other => {
                return Err(format!(
                    "pictures are encoded as `{other}`; known are rgb8, bgr8, rgba8, bgra8, mono8, 16UC1 and 32FC1: \
                     convert the topic"
                ));
            }
        };
        let pixel_size = match pixel {
            Pixel::Colour(size, _) => size,
            Pixel::Count => 2,
            Pixel::Metres => 4,
        };
        let (width, height, step) = (image.width as usize, image.height as usize, image.step as usize);
        let row_size = width.saturating_mul(pixel_size);
        let fits = row_size <= step && step.checked_mul(height).is_some_and(|size| size <= image.data.len());
        check_size(image.width, image.height)?;
        if width == 0 || height == 0 || !fits {
            return Err(format!("a picture of {width} x {height} pixels holds only {} bytes", image.data.len()));
        }
        let rows = image.data.chunks_exact(step).take(height).filter_map(|row| row.get(..row_size));
        let source = rows.flat_map(|row| row.chunks_exact(pixel_size));
        let mut pixels = Vec::with_capacity(width * height * 3);
        for bytes in source {
            convert(pixel, bytes, image.is_big_endian, &mut pixels);
        }
        let encoding = if matches!(pixel, Pixel::Colour(..)) { PixelEncoding::Rgb8 } else { PixelEncoding::Depth16 };
        let header = header(image.stamp_ns, (image.width, image.height), encoding);
        Ok(Self::Pixels { header, pixels })
    }

    /// From `sensor_msgs/CompressedImage`: PNG is unpacked (also behind the 12 bytes that ROS puts before compressed
    /// depth), anything else is handed on.
    pub(super) fn from_compressed(image: &CompressedImage<'_>) -> Result<Self, String> {
        let behind_header = image.data.get(12..).filter(|bytes| bytes.starts_with(PNG));
        let png = if image.data.starts_with(PNG) { Some(image.data) } else { behind_header };
        match png {
            Some(bytes) => unpack_png(bytes, image.stamp_ns).map_err(|e| format!("a picture cannot be read: {e}")),
            None => Ok(Self::Compressed {
                stamp_ns: image.stamp_ns,
                format: image.format.to_owned(),
                bytes: image.data.to_vec(),
            }),
        }
    }
}

fn convert(pixel: Pixel, bytes: &[u8], big_endian: bool, out: &mut Vec<u8>) {
    match (pixel, bytes) {
        (Pixel::Colour(_, order), bytes) => out.extend(order.iter().map(|&i| bytes.get(i).copied().unwrap_or(0))),
        (Pixel::Count, &[a, b]) => out.extend(if big_endian { [b, a] } else { [a, b] }),
        (Pixel::Metres, &[a, b, c, d]) => {
            let metres = if big_endian { f32::from_be_bytes([a, b, c, d]) } else { f32::from_le_bytes([a, b, c, d]) };
            let millimetres = (f64::from(metres) * 1e3).round();
            // What cannot be a distance, or lies beyond the range, is no measurement.
            let count = if (0.0..=65535.0).contains(&millimetres) { millimetres as u16 } else { 0 };
            out.extend(count.to_le_bytes());
        }
        _ => {}
    }
}

/// Header of a tightly packed picture; depth counts are millimetres.
fn header(stamp_ns: u64, (width, height): (u32, u32), encoding: PixelEncoding) -> ImageHeader {
    let (bytes, depth_scale) = match encoding {
        PixelEncoding::Rgb8 => (3, 0.0),
        PixelEncoding::Depth16 => (2, 1e-3),
    };
    ImageHeader {
        stamp_ns,
        device_ns: stamp_ns,
        width,
        height,
        stride: width.saturating_mul(bytes),
        encoding,
        depth_scale,
        stamp_domain: StampDomain::SystemTime,
        ..ImageHeader::default()
    }
}

/// A sentence for a picture of more pixels than are unpacked.
pub(super) fn check_size(width: u32, height: u32) -> Result<(), String> {
    if u64::from(width) * u64::from(height) <= LARGEST {
        return Ok(());
    }
    Err(format!("a picture of {width} x {height} pixels is too large: {LARGEST} at most are unpacked; scale it down"))
}

/// The pixels of a PNG file; a sentence when it is damaged or too large.
pub(super) fn unpack_png(bytes: &[u8], stamp_ns: u64) -> Result<Picture, String> {
    let (frame, raw) = raw_png(bytes)?;
    let channels = frame.color_type.samples();
    let colours = if channels < 3 { [0, 0, 0] } else { [0, 1, 2] };
    let mut pixels = Vec::with_capacity(raw.len());
    let (pixel, size) = match (frame.bit_depth, channels) {
        (png::BitDepth::Sixteen, 1) => (Pixel::Count, 2),
        // Of 16-bit colour the upper byte is kept.
        (png::BitDepth::Sixteen, _) => (Pixel::Colour(channels * 2, colours.map(|c| c * 2)), channels * 2),
        _ => (Pixel::Colour(channels, colours), channels),
    };
    for bytes in raw.chunks_exact(size) {
        convert(pixel, bytes, true, &mut pixels);
    }
    let encoding = if matches!(pixel, Pixel::Count) { PixelEncoding::Depth16 } else { PixelEncoding::Rgb8 };
    Ok(Picture::Pixels { header: header(stamp_ns, (frame.width, frame.height), encoding), pixels })
}

/// Opacity of each pixel of a PNG file, 0 to 255; `None` where it has none.
pub(super) fn unpack_alpha(bytes: &[u8]) -> Result<Option<Vec<u8>>, String> {
    let (frame, raw) = raw_png(bytes)?;
    let channels = frame.color_type.samples();
    let size = channels * if frame.bit_depth == png::BitDepth::Sixteen { 2 } else { 1 };
    // Of 16 bits the upper byte, which stands first.
    let alpha = |pixel: &[u8]| pixel[size / channels * (channels - 1)];
    Ok(matches!(channels, 2 | 4).then(|| raw.chunks_exact(size).map(alpha).collect()))
}

/// The samples of a PNG file as they stand in it, palettes and few bits expanded.
fn raw_png(bytes: &[u8]) -> Result<(png::OutputInfo, Vec<u8>), String> {
    // What a PNG carries beside its pixels takes memory of its own.
    let limits = png::Limits { bytes: 64 << 20 };
    let mut decoder = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::EXPAND);
    let fail = |error: png::DecodingError| format!("the PNG is damaged ({error})");
    let mut reader = decoder.read_info().map_err(fail)?;
    check_size(reader.info().width, reader.info().height)?;
    let size = reader.output_buffer_size().ok_or("the PNG is damaged (its size makes no sense)")?;
    let mut raw = vec![0; size];
    let frame = reader.next_frame(&mut raw).map_err(fail)?;
    raw.truncate(frame.buffer_size());
    Ok((frame, raw))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image<'a>(encoding: &'a str, width: u32, step: u32, data: &'a [u8]) -> Image<'a> {
        Image { stamp_ns: 7, width, height: 1, encoding, is_big_endian: false, step, data }
    }

    fn pixels(image: &Image<'_>) -> (ImageHeader, Vec<u8>) {
        match Picture::from_image(image).expect("a known encoding") {
            Picture::Pixels { header, pixels } => (header, pixels),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn blue_first_pixels_and_padded_rows_become_tight_red_first_rows() {
        let (header, pixels) = pixels(&image("bgr8", 2, 8, &[3, 2, 1, 6, 5, 4, 0, 0]));
        assert_eq!(pixels, [1, 2, 3, 4, 5, 6]);
        assert_eq!((header.stride, header.stamp_ns), (6, 7));
    }

    #[test]
    fn depth_in_metres_becomes_millimetres_and_nonsense_becomes_no_measurement() {
        let mut data = Vec::new();
        for metres in [1.25f32, f32::NAN, 100.0, -1.0] {
            data.extend(metres.to_le_bytes());
        }
        let (header, pixels) = pixels(&image("32FC1", 4, 16, &data));
        assert_eq!(pixels, [0xe2, 0x04, 0, 0, 0, 0, 0, 0]);
        assert_eq!(header.depth_scale, 1e-3);
    }

    #[test]
    fn a_picture_that_is_shorter_than_its_size_says_is_refused() {
        assert!(Picture::from_image(&image("rgb8", 1000, 3000, &[0; 10])).is_err());
        assert!(Picture::from_image(&image("rgb8", u32::MAX, u32::MAX, &[0; 10])).is_err());
    }

    #[test]
    fn a_small_file_that_claims_a_huge_picture_is_refused_before_it_is_unpacked() {
        // The header of a PNG, with any size and without any pixels behind it.
        let png = |width: u32, height: u32| {
            let mut out = PNG.to_vec();
            let header = [b"IHDR", &width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 6, 0, 0, 0]].concat();
            out.extend(13_u32.to_be_bytes());
            out.extend(&header);
            out.extend(crc32fast::hash(&header).to_be_bytes());
            let data = [0x78, 0x9c, 0x03, 0x00, 0x00, 0x00, 0x00, 0x01];
            out.extend(8_u32.to_be_bytes());
            let part = [&b"IDAT"[..], &data].concat();
            out.extend(&part);
            out.extend(crc32fast::hash(&part).to_be_bytes());
            out
        };
        for (width, height) in [(1 << 16, 1 << 16), (i32::MAX as u32, i32::MAX as u32), (1 << 25, 2)] {
            let error = unpack_png(&png(width, height), 0).expect_err("too large");
            assert!(error.contains("too large") || error.contains("damaged"), "{error}");
            let bytes = [vec![0; 12], png(width, height)].concat();
            let compressed = CompressedImage { stamp_ns: 1, format: "16UC1; compressedDepth png", data: &bytes };
            assert!(Picture::from_compressed(&compressed).is_err());
        }
        let header = ImageHeader { width: 1 << 16, height: 1 << 16, stride: 3 << 16, ..ImageHeader::default() };
        assert!(Picture::from_own(header, vec![0; 64]).expect_err("too large").contains("too large"));
        let header = ImageHeader { width: 4, height: 4, stride: 12, ..ImageHeader::default() };
        assert!(Picture::from_own(header, vec![0; 47]).expect_err("too few").contains("only 47 bytes"));
        assert!(Picture::from_own(header, vec![0; 48]).is_ok());
    }

    #[test]
    fn compressed_depth_is_unpacked_behind_its_twelve_bytes() {
        let mut bytes = vec![0; 12];
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&[0x01, 0x02, 0xff, 0xfe]).expect("two pixels");
        writer.finish().expect("an end");
        let compressed = CompressedImage { stamp_ns: 1, format: "16UC1; compressedDepth png", data: &bytes };
        match Picture::from_compressed(&compressed).expect("a PNG") {
            Picture::Pixels { header, pixels } => {
                assert_eq!((header.width, header.encoding), (2, PixelEncoding::Depth16));
                assert_eq!(pixels, [0x02, 0x01, 0xfe, 0xff]);
            }
            other => panic!("{other:?}"),
        }
    }
}
