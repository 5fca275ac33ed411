//! PNG and JPEG pictures.
#![no_main]

use libfuzzer_sys::fuzz_target;
use shared_mem::recording::{Picture, unpack_picture, write_png};

/// A grey square of 16 pixels.
const JPEG: &[u8] = include_bytes!("../../shared_mem/tests/data/grey_16.jpg");

fn png() -> Vec<u8> {
    let path = fuzz::folder().join("seed.png");
    write_png(&path, 4, 3, &[7; 36]).expect("a file");
    std::fs::read(path).expect("a file")
}

fuzz_target!(
    init: fuzz::seeds([JPEG.to_vec(), png()]),
    |bytes: &[u8]| {
        if let Some(Picture::Pixels { header, pixels }) = fuzz::accepted(unpack_picture(bytes, 0)) {
            assert!(pixels.len() >= header.stride as usize * header.height as usize, "{header:?}");
        }
    }
);
