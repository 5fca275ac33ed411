//! The list of a scan's pictures with their poses, as nerfstudio or a robot writes it. Whatever it says, there is a scan or one line.
#![no_main]

use libfuzzer_sys::fuzz_target;
use reconstruct::scan::Scan;

const MATRIX: &str = "[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5],[0,0,0,1]]";

fn seeds() -> Vec<Vec<u8>> {
    let frame = |i: usize| {
        format!(r#"{{"file_path": "images/{i}.png", "mask_path": "{i}.png", "transform_matrix": {MATRIX}}}"#)
    };
    let frames: Vec<String> = (0..8).map(frame).collect();
    let camera =
        r#""camera_model": "OPENCV", "fl_x": 600, "fl_y": 600, "cx": 320, "cy": 240, "w": 640, "h": 480, "k1": -0.1"#;
    let of_robot = r#""table": 0.1, "frames": [{"file_path": "a.png", "base_from_camera": [0,0,1,1,0,0,0]}]"#;
    let nerfstudio = format!(r#"{{{camera}, "depth_unit_scale_factor": 0.001, "frames": [{}]}}"#, frames.join(", "));
    vec![nerfstudio.into_bytes(), format!("{{{camera}, {of_robot}}}").into_bytes()]
}

fuzz_target!(
    init: fuzz::seeds(seeds()),
    |bytes: &[u8]| {
        for name in ["transforms.json", "poses.json"] {
            if let Some(scan) = fuzz::accepted(Scan::open(&fuzz::file(name, bytes))) {
                assert!(!scan.views.is_empty());
            }
        }
    }
);
