//! Bytes as a recording: a clip of our own or a foreign bag, its messages and pictures, and what recovery makes of it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::arm::{ArmCommand, ArmState};
use shared_mem::msg::object::ObjectPose;
use shared_mem::recording::{
    ClipInfo, ClipMessages, ClipWriter, PictureKind, ReadError, for_pictures, read_arm_states, read_clip,
    read_clip_info, recover,
};
use std::path::Path;

/// A short clip in two chunks.
fn clip() -> Vec<u8> {
    let path = fuzz::folder().join("seed.mcap");
    let info = ClipInfo { cell_toml: Some(String::new()), configuration: String::new(), ..ClipInfo::default() };
    let mut writer = ClipWriter::create(&path, &info).expect("a new file");
    for i in 0..4 {
        let stamp_ns = 1_000_000_000 + i * 1_000_000;
        writer.arm_state(&ArmState { stamp_ns, cycle: i, dof: 2, ..ArmState::default() }).expect("room");
        writer.arm_command(&ArmCommand { stamp_ns, dof: 2, ..ArmCommand::default() }).expect("room");
        writer.object_pose(&ObjectPose { stamp_ns, ..ObjectPose::default() }).expect("room");
        if i == 2 {
            writer.flush().expect("room");
        }
    }
    writer.finish().expect("room");
    std::fs::read(&path).expect("a file")
}

fn cell() -> Cell {
    Cell::parse("[robot]\njoints = [\"a\", \"b\"]\n", Path::new("cell.toml")).expect("a valid cell")
}

fuzz_target!(
    init: fuzz::seeds([clip()]),
    |bytes: &[u8]| {
        let path = fuzz::file("clip.mcap", bytes);
        let cell = cell();
        for kind in [ClipKind::Excitation, ClipKind::ControlHitSlide, ClipKind::FreeMotion] {
            if let Some(clip) = fuzz::accepted(read_clip(&path, kind, &cell)) {
                assert!(clip.measured.q.len().is_multiple_of(clip.measured.len().max(1)));
            }
        }
        fuzz::accepted(read_clip_info(&path));
        fuzz::accepted(read_arm_states(&path));
        for kind in [PictureKind::Color, PictureKind::Depth] {
            fuzz::accepted(for_pictures::<ReadError>(&path, kind, |_, _| Ok(())));
        }
        let Some(messages) = fuzz::accepted(ClipMessages::open(&path, &[])) else { return };
        let readable = messages.filter(Result::is_ok).count() as u64;
        let copy = path.with_file_name("clip_recovered.mcap");
        let _none = std::fs::remove_file(&copy);
        if let Some(recovered) = fuzz::accepted(recover(&path)) {
            assert!(recovered.messages >= readable, "{recovered:?}, {readable} readable");
            let again = ClipMessages::open(&copy, &[]).expect("what was recovered is a recording");
            assert!(again.damage().is_none());
        }
    }
);
