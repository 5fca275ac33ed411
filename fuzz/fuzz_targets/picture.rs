//! PNG and JPEG pictures.
#![no_main]

use libfuzzer_sys::fuzz_target;
use shared_mem::recording::{Picture, unpack_picture, write_png};

/// A grey square of 16 pixels with the shortest Huffman tables, as in the tests of `picture_file`.
fn jpeg() -> Vec<u8> {
    let mut out = vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0];
    out.extend([1; 64]);
    out.extend([0xff, 0xc0, 0, 11, 8, 0, 16, 0, 16, 1, 1, 0x11, 0]);
    out.extend([0xff, 0xc4, 0, 21, 0x00, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 8]);
    out.extend([0xff, 0xc4, 0, 20, 0x10, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    out.extend([0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0, 0x72, 0, 0, 0xff, 0xd9]);
    out
}

fn png() -> Vec<u8> {
    let path = fuzz::folder().join("seed.png");
    write_png(&path, 4, 3, &[7; 36]).expect("a file");
    std::fs::read(path).expect("a file")
}

fuzz_target!(
    init: fuzz::seeds([jpeg(), png()]),
    |bytes: &[u8]| {
        if let Some(Picture::Pixels { header, pixels }) = fuzz::accepted(unpack_picture(bytes, 0)) {
            assert!(pixels.len() >= header.stride as usize * header.height as usize, "{header:?}");
        }
    }
);
