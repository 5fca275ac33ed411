//! Pictures and joints out of a session's clips: moments when the arm stands still, as different from each other as there
//! are.

use super::picture::Pixels;
use shared_mem::progress::Progress;
use shared_mem::recording::{PictureKind, Session, for_pictures};

/// A picture of a session.
#[derive(Debug)]
pub struct Shot {
    /// Clip and time in it.
    pub name: String,
    /// The pixels.
    pub pixels: Pixels,
    /// Joint positions [rad].
    pub q: Vec<f64>,
}

/// Joints slower than this stand still [rad/s].
const STILL: f64 = 0.03;

struct Known {
    clip: usize,
    stamp_ns: u64,
    q: Vec<f64>,
    speed: f64,
}

/// At most `wanted` pictures of a kind in the session; none where no clip holds such pictures with joints at their time.
///
/// # Errors
/// When a clip cannot be read.
pub fn shots(session: &Session, kind: PictureKind, wanted: usize) -> anyhow::Result<Vec<Shot>> {
    let latency_ns = session.cell.camera.as_ref().map_or(0, |camera| (camera.latency * 1e9) as u64);
    // Each clip is read twice.
    let clips = session.clips.len();
    let bar = Progress::new("pictures", 2 * clips as u64);
    let mut known = Vec::new();
    for (number, entry) in session.clips.iter().enumerate() {
        bar.show(number as u64, "");
        let path = session.folder.join(&entry.file);
        let clip = session.read(entry)?;
        for_pictures(&path, kind, |stamp_ns, _| {
            if let Some((q, speed)) = clip.measured.at(stamp_ns.saturating_sub(latency_ns)) {
                known.push(Known { clip: number, stamp_ns, q, speed });
            }
            anyhow::Ok(())
        })?;
    }
    let chosen = choose(known, wanted);
    let mut out = Vec::new();
    for (number, entry) in session.clips.iter().enumerate() {
        bar.show((clips + number) as u64, "");
        if !chosen.iter().any(|known| known.clip == number) {
            continue;
        }
        for_pictures(&session.folder.join(&entry.file), kind, |stamp_ns, picture| {
            if let Some(known) = chosen.iter().find(|known| (known.clip, known.stamp_ns) == (number, stamp_ns)) {
                let name = format!("{} at {:.3} s", entry.file.display(), stamp_ns as f64 * 1e-9);
                out.push(Shot { name, pixels: Pixels::new(picture)?, q: known.q.clone() });
            }
            anyhow::Ok(())
        })?;
    }
    Ok(out)
}

/// Those at rest, where there are any; of these one after the other the one that differs most from all chosen before.
fn choose(mut known: Vec<Known>, wanted: usize) -> Vec<Known> {
    let slowest = known.iter().map(|known| known.speed).fold(f64::INFINITY, f64::min);
    known.retain(|known| known.speed <= STILL.max(2.0 * slowest));
    let mut out: Vec<Known> = Vec::new();
    while out.len() < wanted.max(1) && !known.is_empty() {
        let apart = |known: &Known| {
            let to = |other: &Known| known.q.iter().zip(&other.q).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            out.iter().map(to).fold(f64::INFINITY, f64::min)
        };
        let furthest = (0..known.len()).max_by(|a, b| apart(&known[*a]).total_cmp(&apart(&known[*b])));
        let Some(furthest) = furthest else { break };
        // The same pose again adds nothing but its noise.
        if !out.is_empty() && apart(&known[furthest]) < 1e-4 {
            break;
        }
        out.push(known.swap_remove(furthest));
    }
    out.sort_by_key(|known| (known.clip, known.stamp_ns));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_at_rest_and_of_different_poses_are_chosen() {
        let known = |stamp_ns, q: f64, speed| Known { clip: 0, stamp_ns, q: vec![q], speed };
        let all =
            vec![known(1, 0.0, 0.0), known(2, 0.001, 0.0), known(3, 0.5, 1.0), known(4, 1.0, 0.01), known(5, 0.6, 0.0)];
        let chosen: Vec<u64> = choose(all, 4).iter().map(|known| known.stamp_ns).collect();
        assert_eq!(chosen.len(), 3, "{chosen:?}");
        assert!(chosen.contains(&4) && chosen.contains(&5) && !chosen.contains(&3), "{chosen:?}");
    }
}
