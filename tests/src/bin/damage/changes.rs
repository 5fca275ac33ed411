//! Ways of damaging a file, drawn by lot: what disks, transfers, editors and other programs do to it.

use rand::RngExt as _;
use rand_pcg::Pcg64;

/// What programs write where a number has gone wrong, and numbers at the ends of their ranges.
const WORDS: [&str; 20] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "1e400",
    "nan",
    "-inf",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775808",
    "4294967296",
    "1000000000000",
    "0x10",
    "true",
    "\"\"",
    "[]",
    "{}",
    "null",
    "",
];

/// Damages a file; the bytes, and what was done.
pub(crate) fn damage(mut bytes: Vec<u8>, random: &mut Pcg64) -> (Vec<u8>, String) {
    let text = std::str::from_utf8(&bytes).is_ok();
    let ways = if text { 12 } else { 9 };
    let what = match random.random_range(0..ways) {
        0 => flip(&mut bytes, random),
        1 => {
            let left = random.random_range(0..=bytes.len());
            bytes.truncate(left);
            format!("cut to {left} bytes")
        }
        2 => insert(&mut bytes, random),
        3 => {
            let part = part(&bytes, random);
            bytes.drain(part.clone());
            format!("bytes {part:?} removed")
        }
        4 => {
            let part = part(&bytes, random);
            let (copy, at) = (bytes[part.clone()].to_vec(), part.end);
            bytes.splice(at..at, copy);
            format!("bytes {part:?} twice")
        }
        5 => {
            let (part, value) = (part(&bytes, random), [0, 0xff][random.random_range(0..2)]);
            bytes[part.clone()].fill(value);
            format!("bytes {part:?} are {value}")
        }
        6 | 7 => number(&mut bytes, random),
        8 => {
            let size = [0, 1, 3, 7, 8, 100, 100_000][random.random_range(0..7)];
            bytes = (0..size).map(|_| random.random()).collect();
            format!("{size} bytes by lot")
        }
        9 | 10 => word(&mut bytes, random),
        _ => nest(&mut bytes, random),
    };
    (bytes, what)
}

fn place(bytes: &[u8], random: &mut Pcg64) -> usize {
    // Half of the time near the beginning, where headers are.
    let near = bytes.len().min(if random.random() { 256 } else { usize::MAX });
    random.random_range(0..near.max(1))
}

fn part(bytes: &[u8], random: &mut Pcg64) -> std::ops::Range<usize> {
    let from = place(bytes, random).min(bytes.len());
    let longest = [4, 64, 4096][random.random_range(0..3)];
    from..(from + random.random_range(1..=longest)).min(bytes.len())
}

fn flip(bytes: &mut [u8], random: &mut Pcg64) -> String {
    let count = random.random_range(1..=8);
    for _ in 0..count {
        let (at, bit) = (place(bytes, random), random.random_range(0..8));
        if let Some(byte) = bytes.get_mut(at) {
            *byte ^= 1 << bit;
        }
    }
    format!("{count} bits changed")
}

fn insert(bytes: &mut Vec<u8>, random: &mut Pcg64) -> String {
    let (at, count) = (place(bytes, random).min(bytes.len()), random.random_range(1..=64));
    let new: Vec<u8> = (0..count).map(|_| random.random()).collect();
    bytes.splice(at..at, new);
    format!("{count} bytes put in at {at}")
}

/// Writes a number of two to eight bytes over what is there.
fn number(bytes: &mut [u8], random: &mut Pcg64) -> String {
    let doubles = [f64::NAN, f64::INFINITY, -1e300, 1e-320, -0.0, 1e9].map(|v| v.to_le_bytes().to_vec());
    let floats = [f32::NAN, f32::INFINITY, 1e38, -1e9].map(|v| v.to_le_bytes().to_vec());
    let whole = [u64::MAX, 0, 1 << 63, 1 << 40, 86_400_000_000_000].map(|v| v.to_le_bytes().to_vec());
    let half = [u32::MAX, 0, 1 << 31, 1 << 30, 65_536].map(|v| v.to_le_bytes().to_vec());
    let big_endian = [u32::MAX, 1 << 31, 100_000].map(|v| v.to_be_bytes().to_vec());
    let short = [u16::MAX, 0, 1 << 15].map(|v| v.to_le_bytes().to_vec());
    let all: Vec<Vec<u8>> = [&doubles[..], &floats, &whole, &half, &big_endian, &short].concat();
    let chosen = &all[random.random_range(0..all.len())];
    let mut at = place(bytes, random);
    if random.random() {
        at -= at % chosen.len();
    }
    if let Some(there) = bytes.get_mut(at..at + chosen.len()) {
        there.copy_from_slice(chosen);
    }
    format!("{chosen:?} at {at}")
}

/// Replaces a number of a text.
fn word(bytes: &mut Vec<u8>, random: &mut Pcg64) -> String {
    let is_number = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'e');
    let starts: Vec<usize> =
        (0..bytes.len()).filter(|i| bytes[*i].is_ascii_digit() && (*i == 0 || !is_number(&bytes[*i - 1]))).collect();
    if starts.is_empty() {
        return insert(bytes, random);
    }
    let from = starts[random.random_range(0..starts.len())];
    let to = from + bytes[from..].iter().take_while(|b| is_number(b)).count();
    let new = WORDS[random.random_range(0..WORDS.len())];
    let old = String::from_utf8_lossy(&bytes[from..to]).into_owned();
    bytes.splice(from..to, new.bytes());
    format!("`{old}` at {from} became `{new}`")
}

/// Opens so many brackets or elements within each other.
fn nest(bytes: &mut Vec<u8>, random: &mut Pcg64) -> String {
    let open = ["[", "{", "<a>", "a = [", "(", "[["][random.random_range(0..6)];
    let (count, at) = ([100, 10_000, 200_000][random.random_range(0..3)], place(bytes, random).min(bytes.len()));
    bytes.splice(at..at, open.repeat(count).bytes());
    format!("{count} times `{open}` at {at}")
}
