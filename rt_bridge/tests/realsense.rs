//! A recording by librealsense through the real library: as a clip, and as a camera of a running bridge.
#![cfg(feature = "realsense")]
#![allow(missing_docs)]

use serde_json::Value;
use shared_mem::msg::image::StampDomain;
use shared_mem::recording::{ClipMessages, Payload, Picture};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const CELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/fr3_cell.toml");

fn bag() -> PathBuf {
    std::env::var_os("TWINALIGN_BAG").expect("TWINALIGN_BAG names a .bag with colour and depth").into()
}

fn bridge(arguments: &[&str]) -> (Output, Value) {
    let output = Command::new(env!("CARGO_BIN_EXE_rt_bridge"))
        .env("TWINALIGN_DOMAIN", format!("bag{}", std::process::id()))
        .args(arguments)
        .output()
        .expect("the program starts");
    let answer = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    (output, answer)
}

/// Numbers, device stamps and topic of all pictures, after looking at each.
fn pictures(clip: &Path) -> Vec<(String, u64, u64)> {
    let mut found = Vec::new();
    let mut described = false;
    for message in ClipMessages::open(clip, &[]).expect("a clip") {
        let message = message.expect("a message");
        match message.payload {
            Payload::CameraInfo(info) => {
                described = true;
                assert!(info.intrinsics.iter().all(|v| *v > 0.0), "{:?}", info.intrinsics);
            }
            Payload::Picture(Picture::Pixels { header, pixels }) => {
                assert_eq!(pixels.len(), (header.stride * header.height) as usize);
                assert_ne!(header.stamp_domain, StampDomain::SystemTime);
                if message.topic == "/camera/depth" {
                    let measured = pixels.chunks_exact(2).filter(|b| b != &[0, 0]).count();
                    assert!(measured > 1000 && header.depth_scale > 0.0, "{measured} pixels measured");
                }
                found.push((message.topic.clone(), header.sequence, header.device_ns));
            }
            _ => {}
        }
    }
    assert!(described, "intrinsics and pose are there");
    found
}

#[test]
#[ignore = "needs librealsense and a recording: TWINALIGN_BAG=FILE.bag cargo test --release -p rt_bridge --features realsense --test realsense -- --ignored"]
fn a_recording_becomes_a_clip_that_holds_each_pair_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let (bag, clip) = (bag(), folder.path().join("clip.mcap"));
    let (bag, path) = (bag.to_str().expect("a path"), clip.to_str().expect("a path"));
    let (_, answer) = bridge(&["convert", bag, "--cell", CELL, "--out", path, "--json"]);
    // librealsense gives out no pair for the very first picture.
    assert!(answer["unpaired"].as_u64().is_some_and(|unpaired| unpaired <= 1), "{answer}");
    let pictures = pictures(&clip);
    let of = |topic: &str| -> Vec<(u64, u64)> {
        pictures.iter().filter(|(t, ..)| t == topic).map(|(_, number, stamp)| (*number, *stamp)).collect()
    };
    let (color, depth) = (of("/camera/color"), of("/camera/depth"));
    assert_eq!(depth.len() as u64, answer["frames"].as_u64().expect("a number"), "{answer}");
    assert_eq!(color.len(), depth.len());
    assert!(depth.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 < pair[1].1), "in order");
    let gaps = depth.windows(2).map(|pair| pair[1].0 - pair[0].0 - 1).sum::<u64>();
    assert_eq!(gaps as usize, answer["missing"].as_array().expect("a list").len(), "{answer}");
    let again = Command::new(env!("CARGO_BIN_EXE_rt_bridge")).args(["convert", bag, "--out", path]).output();
    assert!(!again.expect("the program starts").status.success(), "a file is never overwritten");
}

#[test]
#[ignore = "needs librealsense and a recording: TWINALIGN_BAG=FILE.bag cargo test --release -p rt_bridge --features realsense --test realsense -- --ignored"]
fn a_recording_plays_as_the_camera_of_a_bridge() {
    let folder = tempfile::tempdir().expect("a folder");
    let clip = folder.path().join("clip.mcap");
    let (camera, path) = (format!("bag://{}", bag().display()), clip.to_str().expect("a path"));
    let run = ["run", "--cell", CELL, "--arm", "sim", "--realtime", "ignore", "--json", "--duration", "3"];
    let arguments: Vec<&str> = run.into_iter().chain(["--camera", &camera, "--record", path]).collect();
    let (_, answer) = bridge(&arguments);
    assert_eq!(answer["faults"].as_array().map(Vec::len), Some(0), "{answer}");
    assert!(pictures(&clip).len() > 20);
}
