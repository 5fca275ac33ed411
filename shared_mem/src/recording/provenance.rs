//! Where the clips of a session come from, together. A session says nothing of its own about it: what its clips say counts.

use super::container::Messages;
use super::error::ReadError;
use super::messages::is_own;
use super::session::Session;
use super::{origins, own, twinaligner};
use crate::origin::{Origin, Origins, Source};
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Where the clips of a session come from. In JSON the list of clips.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Provenance {
    clips: Vec<ClipOrigins>,
}

/// Where a clip comes from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ClipOrigins {
    /// Its file, as cell.toml lists it.
    pub file: String,
    /// What it says; empty where it says nothing.
    pub origins: Origins,
}

/// Clips of one source.
struct Share<'a> {
    /// `None` of those that say nothing.
    source: Option<Source>,
    /// The first origin met.
    origin: Option<&'a Origin>,
    files: Vec<&'a str>,
}

impl Provenance {
    /// Reads what the clips of a session say about themselves, and nothing else of them. Clips that cannot be read are left out.
    pub fn of(session: &Session) -> Self {
        let clips = session.clips.iter().filter_map(|entry| {
            let origins = read_origins(&session.folder.join(&entry.file)).ok()?;
            Some(ClipOrigins { file: entry.file.display().to_string(), origins })
        });
        Self { clips: clips.collect() }
    }

    /// Of clips that were read.
    pub fn of_clips<'a>(clips: impl IntoIterator<Item = (&'a str, &'a Origins)>) -> Self {
        let clips = clips.into_iter();
        Self {
            clips: clips.map(|(file, origins)| ClipOrigins { file: file.into(), origins: origins.clone() }).collect(),
        }
    }

    /// The same with the clips of another session.
    pub fn with(mut self, other: Self) -> Self {
        self.clips.extend(other.clips);
        self
    }

    /// Its clips.
    pub fn clips(&self) -> &[ClipOrigins] {
        &self.clips
    }

    /// Clips that do not say where they come from.
    pub fn unknown(&self) -> usize {
        self.clips.iter().filter(|clip| clip.origins.is_unknown()).count()
    }

    /// Where the clips come from whose origin is known, if all of them have one source; the first one's words for it.
    pub fn source(&self) -> Option<&Origin> {
        match &self.known()[..] {
            [one] => one.origin,
            _ => None,
        }
    }

    /// Whether nobody knows where any of its clips comes from.
    pub fn is_unknown(&self) -> bool {
        self.known().is_empty()
    }

    /// What comes from where, in words, where the clips have several sources; `None` where they have one or say nothing.
    pub fn mixture(&self) -> Option<String> {
        let known = self.known();
        (known.len() > 1).then(|| known.iter().map(Share::in_words).collect::<Vec<_>>().join(", "))
    }

    /// Whether clips of `origin` would be of another source than these.
    pub fn differs_from(&self, origin: &Origin) -> bool {
        self.known().iter().any(|share| share.source.as_ref() != Some(&origin.source()))
    }

    /// All clips by their source. A clip of several stands in each.
    fn shares(&self) -> Vec<Share<'_>> {
        let mut shares: Vec<Share<'_>> = Vec::new();
        for clip in &self.clips {
            let known = clip.origins.iter().map(Some);
            let nobody_knows = clip.origins.is_unknown().then_some(None);
            for origin in known.chain(nobody_knows) {
                let source = origin.map(Origin::source);
                let share = match shares.iter_mut().position(|share| share.source == source) {
                    Some(at) => &mut shares[at],
                    None => {
                        shares.push(Share { source, origin, files: Vec::new() });
                        let last = shares.len() - 1;
                        &mut shares[last]
                    }
                };
                if share.files.last() != Some(&clip.file.as_str()) {
                    share.files.push(&clip.file);
                }
            }
        }
        shares
    }

    fn known(&self) -> Vec<Share<'_>> {
        let mut shares = self.shares();
        shares.retain(|share| share.source.is_some());
        shares
    }
}

impl Share<'_> {
    /// `clip_00.mcap and 3 more: the simulation`.
    fn in_words(&self) -> String {
        let files = match &self.files[..] {
            [] => String::new(),
            [one] => (*one).to_owned(),
            [first, more @ ..] => format!("{first} and {} more", more.len()),
        };
        format!("{files}: {}", self.origin_in_words())
    }

    fn origin_in_words(&self) -> String {
        self.origin.map_or_else(|| "unknown".to_owned(), ToString::to_string)
    }
}

/// `the simulation`, or which clips come from where.
impl fmt::Display for Provenance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.shares()[..] {
            [] => f.write_str("unknown"),
            [one] => f.write_str(&one.origin_in_words()),
            several => f.write_str(&several.iter().map(Share::in_words).collect::<Vec<_>>().join(", ")),
        }
    }
}

/// What a clip of any kind says about where it comes from; nothing else of it is read.
///
/// # Errors
/// [`ReadError`] when it is missing or of no known kind.
pub fn read_origins(path: &Path) -> Result<Origins, ReadError> {
    if twinaligner::is_clip_folder(path) {
        return Ok(origins::of_folder());
    }
    let mut messages = Messages::open(path)?;
    let is_own = messages.peek()?.is_some_and(|message| is_own(message.channel)) || own::is_own(&messages);
    messages.skim()?;
    Ok(origins::read(&messages, is_own))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(clips: &[(&str, &[&str])]) -> Provenance {
        let clips = clips.iter().map(|(file, arms)| {
            let mut origins = Origins::default();
            for arm in *arms {
                origins.add(arm.parse().expect("an arm"));
            }
            ClipOrigins { file: (*file).to_owned(), origins }
        });
        Provenance { clips: clips.collect() }
    }

    #[test]
    fn one_source_is_no_mixture_and_what_is_unknown_mixes_with_all() {
        let session = of(&[("a", &["fci://FR3"]), ("b", &["fci://fr3"]), ("old", &[])]);
        assert_eq!((session.mixture(), session.unknown()), (None, 1));
        assert_eq!(session.source().and_then(Origin::arm).as_deref(), Some("fci://FR3"));
        assert_eq!(session.to_string(), "a and 1 more: the robot at fci://FR3, old: unknown");
        assert!(of(&[("old", &[])]).is_unknown() && !of(&[("old", &[])]).differs_from(&Origin::Simulation));
        assert_eq!(of(&[("a", &["sim"]), ("b", &["sim"])]).to_string(), "the simulation");
        assert_eq!(Provenance::default().to_string(), "unknown");
    }

    #[test]
    fn robot_and_simulation_two_robots_and_two_origins_in_one_clip_are_mixtures() {
        let mixed = of(&[("a", &["fci://fr3"]), ("b", &["sim"]), ("c", &["sim"])]);
        assert_eq!(mixed.mixture().as_deref(), Some("a: the robot at fci://fr3, b and 1 more: the simulation"));
        assert!(mixed.source().is_none() && mixed.differs_from(&Origin::Simulation));
        assert!(of(&[("a", &["fci://one"]), ("b", &["fci://two"])]).mixture().is_some());
        let two = of(&[("a", &["sim", "fci://fr3"])]);
        assert_eq!(two.mixture().as_deref(), Some("a: the simulation, a: the robot at fci://fr3"));
        let beside = of(&[("a", &["sim"])]).with(of(&[("b", &["replay://x.mcap"])]));
        assert!(beside.mixture().is_some() && beside.clips().len() == 2);
    }
}
