//! A TwinAligner clip folder. The first byte says which of its three files the rest is; the others are well-formed.
#![no_main]

use libfuzzer_sys::fuzz_target;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::read_clip;
use std::path::Path;

const CELL: &str = "[robot]\njoints = [\"a\", \"b\"]\n[camera]\npose = { position = [1.0, 0.0, 0.5], orientation = [0.0, 1.0, 0.0, 0.0] }\n";
const CONTROL: &str = r#"[{"ros_timestamp": 0.0, "cmd": [0.0, 0.1]}, {"ros_timestamp": 0.01, "cmd": [0.0, 0.2]}]"#;
const FRAME: &str = r#"[{"ros_timestamp": 0.0, "camera_timestamp": 0.0, "joint_state": [0.0, 0.1]}, {"ros_timestamp": 0.03, "camera_timestamp": 0.02, "joint_state": [0.0, 0.2]}]"#;

fn pose() -> Vec<u8> {
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 4, 4), }\n";
    let matrix = [1.0, 0.0, 0.0, 0.1, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.4, 0.0, 0.0, 0.0, 1.0_f32];
    let numbers = matrix.iter().chain(&matrix).flat_map(|value| value.to_le_bytes());
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((header.len() as u16).to_le_bytes());
    out.extend(header.bytes().chain(numbers));
    out
}

fuzz_target!(
    init: fuzz::seeds([[b"\0", CONTROL.as_bytes()].concat(), [b"\x01", FRAME.as_bytes()].concat(), [&[2][..], &pose()].concat()]),
    |bytes: &[u8]| {
        let Some((&first, bytes)) = bytes.split_first() else { return };
        let pose = pose();
        let mut files = [("control.json", CONTROL.as_bytes()), ("frame.json", FRAME.as_bytes()), ("pose.npy", &pose[..])];
        files[usize::from(first) % 3].1 = bytes;
        for (name, bytes) in files {
            fuzz::file(name, bytes);
        }
        let cell = Cell::parse(CELL, Path::new("cell.toml")).expect("a valid cell");
        if let Some(clip) = fuzz::accepted(read_clip(fuzz::folder(), ClipKind::ControlHitSlide, &cell)) {
            assert_eq!(clip.object.poses.len(), clip.object.stamps_ns.len());
        }
    }
);
