//! Pictures as files: PNG and JPEG in, PNG out. Colour has three bytes a pixel, depth one little-endian `u16` of a
//! millimetre (a PNG with 16 bits of grey).

use super::error::ReadError;
use super::picture::{Picture, check_size, unpack_alpha, unpack_png};
use crate::input;
use crate::msg::image::{ImageHeader, PixelEncoding, StampDomain};
use crate::output::{self, Destination, OutputError};
use std::path::Path;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

/// Longest edge of a JPEG that is unpacked [pixel].
const LONGEST: usize = 16_384;

/// Reads a PNG or JPEG file.
///
/// # Errors
/// [`ReadError`] when the file is missing, cut short, or neither of both.
pub fn read_picture(path: &Path) -> Result<Picture, ReadError> {
    let bytes = input::bytes(path, input::Kind::Picture)?;
    unpack_picture(&bytes, 0).map_err(|what| ReadError::kind(path, what))
}

/// Columns and rows of a PNG or JPEG file.
///
/// # Errors
/// As [`read_picture`].
pub fn picture_size(path: &Path) -> Result<[u32; 2], ReadError> {
    let bytes = input::bytes(path, input::Kind::Picture)?;
    let size = if bytes.starts_with(b"\x89PNG") { png_size(&bytes) } else { jpeg_size(&bytes) };
    size.map_err(|what| ReadError::kind(path, what))
}

/// Opacity of each pixel of a PNG file, row by row, 0 to 255; `None` where the picture has no alpha channel.
///
/// # Errors
/// As [`read_picture`].
pub fn read_alpha(path: &Path) -> Result<Option<Vec<u8>>, ReadError> {
    let bytes = input::bytes(path, input::Kind::Picture)?;
    let alpha = if bytes.starts_with(b"\x89PNG") { unpack_alpha(&bytes) } else { Ok(None) };
    alpha.map_err(|what| ReadError::kind(path, what))
}

/// A picture from a file's bytes, as a clip's compressed picture holds them.
///
/// # Errors
/// A sentence when the bytes are cut short or neither PNG nor JPEG.
pub fn unpack_picture(bytes: &[u8], stamp_ns: u64) -> Result<Picture, String> {
    if bytes.starts_with(b"\x89PNG") {
        return unpack_png(bytes, stamp_ns);
    }
    unpack_jpeg(bytes, stamp_ns)
}

/// A JPEG of which the header is read, and its columns and rows.
type OpenedJpeg<'a> = (JpegDecoder<ZCursor<&'a [u8]>>, [u32; 2]);

fn opened_jpeg(bytes: &[u8]) -> Result<OpenedJpeg<'_>, String> {
    let options = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_max_width(LONGEST)
        .set_max_height(LONGEST)
        .set_strict_mode(true);
    if !bytes.starts_with(&[0xff, 0xd8]) {
        return Err("is neither a PNG nor a JPEG picture".into());
    }
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(damaged_jpeg)?;
    let (width, height) = decoder.dimensions().ok_or("the JPEG is damaged (it tells no size)")?;
    let size = [width, height].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    check_size(size[0], size[1])?;
    Ok((decoder, size))
}

fn damaged_jpeg(error: zune_jpeg::errors::DecodeErrors) -> String {
    format!("the JPEG is damaged ({error})").replace('\n', " ")
}

fn jpeg_size(bytes: &[u8]) -> Result<[u32; 2], String> {
    Ok(opened_jpeg(bytes)?.1)
}

/// Of the header's first part, which stands at one place in every PNG.
fn png_size(bytes: &[u8]) -> Result<[u32; 2], String> {
    let number = |at: usize| bytes.get(at..at + 4)?.try_into().ok().map(u32::from_be_bytes);
    let size = number(16).zip(number(20)).ok_or("the PNG is cut short")?;
    check_size(size.0, size.1)?;
    Ok([size.0, size.1])
}

fn unpack_jpeg(bytes: &[u8], stamp_ns: u64) -> Result<Picture, String> {
    let (mut decoder, [width, height]) = opened_jpeg(bytes)?;
    let pixels = decoder.decode().map_err(damaged_jpeg)?;
    if pixels.len() != width as usize * height as usize * 3 {
        return Err(format!("a picture of {width} x {height} pixels holds {} bytes", pixels.len()));
    }
    let header = ImageHeader {
        stamp_ns,
        device_ns: stamp_ns,
        width,
        height,
        stride: width * 3,
        encoding: PixelEncoding::Rgb8,
        stamp_domain: StampDomain::SystemTime,
        ..ImageHeader::default()
    };
    Ok(Picture::Pixels { header, pixels })
}

/// Writes `width * height` pixels of red, green, blue as a PNG.
///
/// # Errors
/// [`OutputError`] when the file cannot be written or the pixels are not that many.
pub fn write_png(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<(), OutputError> {
    let packed = pack_png(width, height, rgb, png::Compression::default());
    output::write(path, packed.map_err(|error| OutputError::of(path, error.into()))?)
}

/// The same to a place that was looked at before.
///
/// # Errors
/// As [`write_png`].
pub fn write_png_to(place: &Destination, width: u32, height: u32, rgb: &[u8]) -> Result<(), OutputError> {
    let packed = pack_png(width, height, rgb, png::Compression::default());
    place.write(packed.map_err(|error| OutputError::of(place.path(), error.into()))?)
}

/// A picture without gaps between its rows as the bytes of a PNG; depth as 16 bits of grey.
///
/// # Errors
/// A sentence when the pixels are not that many.
pub fn pack_picture(encoding: PixelEncoding, width: u32, height: u32, pixels: &[u8]) -> Result<Vec<u8>, String> {
    match encoding {
        PixelEncoding::Rgb8 => pack_png(width, height, pixels, png::Compression::default()),
        PixelEncoding::Depth16 => {
            let big_endian: Vec<u8> = pixels.chunks_exact(2).flat_map(|pair| [pair[1], pair[0]]).collect();
            pack(
                width,
                height,
                &big_endian,
                (png::ColorType::Grayscale, png::BitDepth::Sixteen),
                png::Compression::default(),
            )
        }
    }
    .map_err(|error| error.to_string())
}

/// `width * height` pixels of red, green, blue, alpha as the bytes of a PNG.
///
/// # Errors
/// A sentence when the pixels are not that many.
pub fn pack_with_alpha(width: u32, height: u32, rgba: &[u8]) -> Result<Vec<u8>, String> {
    let kind = (png::ColorType::Rgba, png::BitDepth::Eight);
    pack(width, height, rgba, kind, png::Compression::default()).map_err(|error| error.to_string())
}

/// `width * height` pixels of red, green, blue as the bytes of a PNG, in as little time as it takes: for pictures that are seen
/// once.
///
/// # Errors
/// A sentence when the pixels are not that many.
pub fn pack_quickly(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, String> {
    pack_png(width, height, rgb, png::Compression::Fastest).map_err(|error| error.to_string())
}

/// `width * height` pixels of red, green, blue as the bytes of a PNG.
pub(super) fn pack_png(
    width: u32,
    height: u32,
    rgb: &[u8],
    compression: png::Compression,
) -> Result<Vec<u8>, png::EncodingError> {
    pack(width, height, rgb, (png::ColorType::Rgb, png::BitDepth::Eight), compression)
}

fn pack(
    width: u32,
    height: u32,
    pixels: &[u8],
    (color, depth): (png::ColorType, png::BitDepth),
    compression: png::Compression,
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(compression);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A grey square of 16 pixels. Its only numbers: quantisation of 1, one coefficient a block, of which the first is 200.
    const JPEG: &[u8] = include_bytes!("../../tests/data/grey_16.jpg");

    #[test]
    fn a_jpeg_becomes_colour_pixels() {
        let Ok(Picture::Pixels { header, pixels }) = unpack_picture(JPEG, 3) else { panic!("no picture") };
        assert_eq!((header.width, header.height, header.stride, header.stamp_ns), (16, 16, 48, 3));
        // A mean of 200 / 8 over the middle grey of 128.
        assert!(pixels.iter().all(|v| v.abs_diff(153) <= 1), "{:?}", &pixels[..6]);
    }

    #[test]
    fn a_jpeg_that_claims_a_huge_picture_is_refused_before_it_is_unpacked() {
        let mut bytes = JPEG.to_vec();
        let frame = bytes.windows(2).position(|marker| marker == [0xff, 0xc0]).expect("a start of frame");
        bytes[frame + 5..frame + 9].copy_from_slice(&[0x3f, 0xff, 0x3f, 0xff]);
        let error = unpack_picture(&bytes, 0).expect_err("268 million pixels");
        assert!(error.contains("16383 x 16383 pixels is too large"), "{error}");
    }

    #[test]
    fn what_is_written_is_read_back() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let rgb: Vec<u8> = (0..2 * 3 * 3).collect();
        write_png(&path, 2, 3, &rgb).expect("a file");
        let Ok(Picture::Pixels { header, pixels }) = read_picture(&path) else { panic!("no picture") };
        assert_eq!((header.width, header.height, pixels), (2, 3, rgb));
        assert!(write_png(&path, 2, 2, &[0; 3]).is_err());
        let depth = [0x34, 0x12, 0xff, 0x00];
        let packed = pack_picture(PixelEncoding::Depth16, 2, 1, &depth).expect("a picture");
        let Ok(Picture::Pixels { header, pixels }) = unpack_picture(&packed, 0) else { panic!("no picture") };
        assert_eq!((header.encoding, &pixels[..]), (PixelEncoding::Depth16, &depth[..]));
        std::fs::write(&path, b"GIF89a").expect("a file");
        assert!(read_picture(&path).unwrap_err().to_string().contains("neither a PNG nor a JPEG"));
    }

    #[test]
    fn an_alpha_channel_is_read_where_there_is_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let pixels = [1, 2, 3, 0, 4, 5, 6, 255];
        let packed = pack(2, 1, &pixels, (png::ColorType::Rgba, png::BitDepth::Eight), png::Compression::default());
        std::fs::write(&path, packed.expect("a picture")).expect("a file");
        assert_eq!(read_alpha(&path).expect("a picture"), Some(vec![0, 255]));
        write_png(&path, 2, 1, &pixels[..6]).expect("a file");
        assert_eq!(read_alpha(&path).expect("a picture"), None);
    }

    proptest! {
        #[test]
        fn a_damaged_file_is_refused_or_read_but_never_a_panic(cut in 0usize..250, at in 0usize..200, value in any::<u8>()) {
            let mut bytes = JPEG.to_vec();
            let at = at.min(bytes.len() - 1);
            bytes[at] = value;
            bytes.truncate(cut);
            let _ = unpack_picture(&bytes, 0);
        }
    }
}
