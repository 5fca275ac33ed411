//! Cut and changed files: never a panic, never silently other data, everything in whole chunks comes back.

use proptest::prelude::*;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::recording::{
    ClipInfo, ClipMessages, ClipWriter, Payload, Picture, read_arm_states, read_clip_info, recover, unpack_picture,
    write_png,
};
use std::io::Write;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock};

fn state(i: u64) -> ArmState {
    let q = joints_from(&[0.1 * i as f64, 0.2, -0.3]);
    ArmState { stamp_ns: 1_000_000_000 + i * 1_000_000, cycle: i, dof: 3, q, ..ArmState::default() }
}

fn info() -> ClipInfo {
    ClipInfo {
        cell_toml: Some("[table]\nheight = 0.0\n".into()),
        configuration: "a = 1\n".into(),
        program: "t 1".into(),
        ..ClipInfo::default()
    }
}

/// A file in memory.
#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("one writer").extend(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A finished clip of four chunks, and how many states it holds up to which size of the file.
struct Sample {
    bytes: Vec<u8>,
    /// Size of the file behind a flush, states before it.
    flushed: Vec<(usize, u64)>,
}

const STATES: u64 = 24;

fn sample() -> &'static Sample {
    static SAMPLE: OnceLock<Sample> = OnceLock::new();
    SAMPLE.get_or_init(|| {
        let memory = Memory::default();
        let mut writer = ClipWriter::with_sink(memory.clone(), Path::new("memory"), &info()).expect("memory");
        let mut flushed = vec![(0, 0)];
        for i in 0..STATES {
            writer.arm_state(&state(i)).expect("memory");
            if i % 6 == 5 {
                writer.flush().expect("memory");
                flushed.push((memory.0.lock().expect("one writer").len(), i + 1));
            }
        }
        writer.close().expect("memory");
        let bytes = memory.0.lock().expect("one writer").clone();
        Sample { bytes, flushed }
    })
}

/// States and damage, or the error.
fn read(folder: &Path, bytes: &[u8]) -> Result<(Vec<ArmState>, Option<String>), String> {
    let path = folder.join("clip.mcap");
    // A new file each time: some file systems write a truncated one out at once.
    let _ = std::fs::remove_file(&path);
    std::fs::write(&path, bytes).expect("room");
    let mut messages = ClipMessages::open(&path, &[]).map_err(|e| e.to_string())?;
    let mut states = Vec::new();
    for message in messages.by_ref() {
        match message.map_err(|e| e.to_string())?.payload {
            Payload::ArmState(state) => states.push(*state),
            other => panic!("{other:?}"),
        }
    }
    Ok((states, messages.damage()))
}

fn all() -> Vec<ArmState> {
    (0..STATES).map(state).collect()
}

#[test]
fn a_file_cut_at_any_byte_yields_every_whole_chunk_and_says_that_it_is_cut() {
    let folder = tempfile::tempdir().expect("a folder");
    let sample = sample();
    for cut in 0..sample.bytes.len() {
        let Ok((states, damage)) = read(folder.path(), &sample.bytes[..cut]) else {
            assert!(cut < 8, "cut at byte {cut}: only a file without its first bytes is no clip");
            continue;
        };
        let whole = sample.flushed.iter().rfind(|(size, _)| *size <= cut).map_or(0, |(_, states)| *states);
        assert!(states.len() as u64 >= whole, "cut at byte {cut}: {} of {whole} states", states.len());
        assert!(all().starts_with(&states), "cut at byte {cut}");
        assert!(damage.is_some(), "cut at byte {cut}");
    }
}

#[test]
fn one_changed_bit_at_any_byte_never_yields_other_data_in_silence_and_costs_one_chunk() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bytes = sample().bytes.clone();
    let mut lost_most = (0, 0);
    for at in 0..bytes.len() {
        let bit = 1 << (at * 5 % 8);
        bytes[at] ^= bit;
        let (states, damage) = read(folder.path(), &bytes).unwrap_or_else(|e| (Vec::new(), Some(e)));
        bytes[at] ^= bit;
        assert!(damage.is_some() || states == all(), "byte {at}, bit {bit}: other data in silence");
        assert!(states.iter().all(|s| *s == state(s.cycle)), "byte {at}, bit {bit}: a wrong state");
        lost_most = lost_most.max((STATES as usize - states.len(), at));
    }
    let (lost, at) = lost_most;
    assert!((1..=6).contains(&lost), "a bit of byte {at} cost {lost} states; it may cost the 6 of its chunk");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn cuts_and_changes_together_never_panic_nor_lie(
        cut in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..12),
    ) {
        let folder = tempfile::tempdir().expect("a folder");
        let mut bytes = sample().bytes.clone();
        bytes.truncate(cut.index(bytes.len()) + 1);
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok((states, damage)) = read(folder.path(), &bytes) {
            prop_assert!(damage.is_some() || states == all());
            prop_assert!(states.iter().all(|s| *s == state(s.cycle)));
        }
    }

    #[test]
    fn bytes_that_are_no_recording_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), magic in any::<bool>()) {
        let folder = tempfile::tempdir().expect("a folder");
        let mut file = if magic { b"\x89MCAP0\r\n".to_vec() } else { Vec::new() };
        file.extend(bytes);
        let _ = read(folder.path(), &file);
    }
}

#[test]
fn a_recovered_file_opens_in_a_strict_reader_and_keeps_what_rode_along() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("clip.mcap");
    let sample = sample();
    let (size, states) = sample.flushed[2];
    std::fs::write(&path, &sample.bytes[..size + 40]).expect("room");
    let recovered = recover(&path).expect("a readable start");
    assert_eq!((recovered.messages, recovered.path.file_name()), (states, Some("clip_recovered.mcap".as_ref())));
    assert!(recovered.damage.is_some());
    let bytes = std::fs::read(&recovered.path).expect("the new file");
    let strict = mcap::MessageStream::new(&bytes).expect("a whole file");
    assert_eq!(strict.filter(|m| m.is_ok()).count() as u64, states);
    let summary = mcap::Summary::read(&bytes).expect("a summary").expect("a summary");
    assert_eq!(summary.stats.map(|s| s.message_count), Some(states));
    assert_eq!(read_arm_states(&recovered.path).expect("a clip").len() as u64, states);
    assert_eq!(read_clip_info(&recovered.path).expect("a clip"), Some(info()));
    assert!(recover(&path).is_err(), "a second run must not overwrite the first one's file");
}

proptest! {
    #[test]
    fn a_changed_or_cut_png_is_refused_or_has_all_its_pixels(
        cut in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
    ) {
        static PNG: OnceLock<Vec<u8>> = OnceLock::new();
        let mut bytes = PNG
            .get_or_init(|| {
                let folder = tempfile::tempdir().expect("a folder");
                let path = folder.path().join("a.png");
                write_png(&path, 9, 7, &[3; 9 * 7 * 3]).expect("room");
                std::fs::read(&path).expect("a file")
            })
            .clone();
        for (at, value) in &changes {
            let at = at.index(bytes.len());
            bytes[at] = *value;
        }
        if changes.len() % 2 == 1 {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(picture) = unpack_picture(&bytes, 0) {
            let Picture::Pixels { header, pixels } = &picture else { panic!("{picture:?}") };
            prop_assert_eq!(pixels.len(), header.stride as usize * header.height as usize);
        }
    }
}
