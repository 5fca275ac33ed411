//! Where a recording comes from: a simulated cell, a robot, another recording. What a file or another process says about it is
//! bounded and written out before it is kept, so that it can be shown anywhere.

use crate::printable::one_line;
use serde::{Serialize, Serializer};
use std::fmt;
use std::str::FromStr;

/// Longest name of a file or a format that is kept [characters]; what is longer is cut.
const LONGEST_NAME: usize = 200;
/// Longest name of a host, as that of the internet's name service.
const LONGEST_HOST: usize = 253;
/// Most origins of one recording that are kept.
const MOST: usize = 8;

/// Where a recording comes from.
///
/// ```
/// use shared_mem::origin::{Origin, Source};
///
/// // An arm, as `--arm` takes it.
/// let origin: Origin = "fci://172.16.0.2".parse().expect("the address of an arm");
/// assert_eq!(origin.source(), Source::Robot("172.16.0.2".into()));
/// assert_eq!(origin.to_string(), "the robot at fci://172.16.0.2");
/// assert_eq!("sim".parse(), Ok(Origin::Simulation));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Origin {
    /// A simulated cell.
    Simulation,
    /// A robot.
    Robot {
        /// Its address, as `--arm fci://HOST` takes it.
        host: String,
    },
    /// Another recording, played back as an arm.
    Replay {
        /// Its file, without folders.
        clip: String,
    },
    /// The log of another program, imported.
    Import {
        /// Its file or folder, without folders.
        file: String,
        /// Its format.
        format: String,
    },
    /// The recording of another program, read as it is.
    Elsewhere {
        /// Its format.
        format: String,
    },
}

/// What an origin is beside others: recordings of two sources are not explained together.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// The simulation, whatever acts in it.
    Simulation,
    /// The robot at this address, in small letters.
    Robot(String),
    /// Recordings played back.
    Replay,
    /// Recordings of other programs.
    Elsewhere,
}

impl Origin {
    /// The robot at `host`; `None` for a text that is no address.
    pub fn robot(host: &str) -> Option<Self> {
        let is_of_host = |c: char| c.is_ascii_alphanumeric() || "._-:[]%".contains(c);
        let is_host = !host.is_empty() && host.len() <= LONGEST_HOST && host.chars().all(is_of_host);
        is_host.then(|| Self::Robot { host: host.to_owned() })
    }

    /// A recording played back; of a path the last part. `None` without a name.
    pub fn replay(clip: &str) -> Option<Self> {
        Some(Self::Replay { clip: shown(last_part(clip))? })
    }

    /// An imported log; of a path the last part. `None` without a name.
    pub fn import(file: &str, format: &str) -> Option<Self> {
        Some(Self::Import { file: shown(last_part(file))?, format: shown(format).unwrap_or_else(|| "log".into()) })
    }

    /// The recording of another program in this format.
    pub fn elsewhere(format: &str) -> Self {
        Self::Elsewhere { format: shown(format).unwrap_or_else(|| "log".into()) }
    }

    /// What it is beside others.
    pub fn source(&self) -> Source {
        match self {
            Self::Simulation => Source::Simulation,
            Self::Robot { host } => Source::Robot(host.to_ascii_lowercase()),
            Self::Replay { .. } => Source::Replay,
            Self::Import { .. } | Self::Elsewhere { .. } => Source::Elsewhere,
        }
    }

    /// The arm that records more of it, as `--arm` takes it; `None` where no bridge drives that arm.
    pub fn arm(&self) -> Option<String> {
        match self {
            Self::Simulation => Some("sim".to_owned()),
            Self::Robot { host } => Some(format!("fci://{host}")),
            Self::Replay { .. } | Self::Import { .. } | Self::Elsewhere { .. } => None,
        }
    }
}

/// An arm, as `--arm` takes it.
impl FromStr for Origin {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        match text.split_once("://") {
            None if text == "sim" => Some(Self::Simulation),
            Some(("fci", host)) => Self::robot(host),
            Some(("replay", clip)) => Self::replay(clip),
            _ => None,
        }
        .ok_or(())
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Simulation => f.write_str("the simulation"),
            Self::Robot { host } => write!(f, "the robot at fci://{host}"),
            Self::Replay { clip } => write!(f, "a replay of {clip}"),
            Self::Import { file, format } => write!(f, "an import of {file} ({format})"),
            Self::Elsewhere { format } => write!(f, "another program ({format})"),
        }
    }
}

/// The last part of a path, whichever slash it has.
fn last_part(path: &str) -> &str {
    path.trim_end_matches(['/', '\\']).rsplit(['/', '\\']).next().unwrap_or("")
}

/// A name as it can be shown: one line, no control character, not endless. `None` where nothing is left.
fn shown(name: &str) -> Option<String> {
    let mut characters = name.trim().chars();
    let mut kept: String = characters.by_ref().take(LONGEST_NAME).collect();
    if characters.next().is_some() {
        kept.push('…');
    }
    (!kept.is_empty()).then(|| one_line(&kept))
}

/// Where a recording comes from, as far as it says: usually one origin. None: unknown. Several: the arm was another one in the
/// middle, or two recordings were put together.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Origins(Vec<Origin>);

impl Origins {
    /// Adds an origin, unless it is there or there are too many; whether it did.
    pub fn add(&mut self, origin: Origin) -> bool {
        let is_new = self.0.len() < MOST && !self.0.contains(&origin);
        if is_new {
            self.0.push(origin);
        }
        is_new
    }

    /// Whether nothing is known.
    pub fn is_unknown(&self) -> bool {
        self.0.is_empty()
    }

    /// Each of them, in the order in which they were met.
    pub fn iter(&self) -> impl Iterator<Item = &Origin> {
        self.0.iter()
    }
}

impl From<Option<Origin>> for Origins {
    fn from(origin: Option<Origin>) -> Self {
        Self(origin.into_iter().collect())
    }
}

impl From<Origin> for Origins {
    fn from(origin: Origin) -> Self {
        Self(vec![origin])
    }
}

/// A list; empty where nothing is known.
impl Serialize for Origins {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl fmt::Display for Origins {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0[..] {
            [] => f.write_str("unknown"),
            all => f.write_str(&all.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_is_an_origin_and_names_the_arm_that_records_more_of_it() {
        for arm in ["sim", "fci://172.16.0.2", "fci://[fe80::1%eth0]", "fci://fr3.local"] {
            let origin: Origin = arm.parse().expect("an arm");
            assert_eq!(origin.arm().as_deref(), Some(arm));
        }
        let replay: Origin = "replay:///data/monday/clip_03.mcap".parse().expect("an arm");
        assert_eq!((replay.to_string().as_str(), replay.arm()), ("a replay of clip_03.mcap", None));
        for wrong in ["", "simulation", "fci://", "fci://a b", "fci://x;rm", "fci://a\nb", "replay://", "ftp://x"] {
            assert!(wrong.parse::<Origin>().is_err(), "{wrong:?}");
        }
        assert!(Origin::robot(&"a".repeat(254)).is_none());
    }

    #[test]
    fn a_name_of_another_program_is_bounded_and_steers_no_terminal() {
        let long = Origin::import(&format!("{}\x1b[2J", "x".repeat(1 << 20)), "CSV").expect("a name");
        assert!(long.to_string().len() < 300, "{}", long.to_string().len());
        let steering = Origin::import("/a/run\x1b[31m\n.csv", "C\u{202e}SV").expect("a name");
        assert_eq!(steering.to_string(), "an import of run\\u{1b}[31m\\n.csv (C\\u{202e}SV)");
        assert_eq!(Origin::import(" ", "CSV"), None);
        assert_eq!(Origin::elsewhere(""), Origin::Elsewhere { format: "log".into() });
    }

    #[test]
    fn sources_tell_robots_apart_and_not_their_spelling() {
        let source = |arm: &str| arm.parse::<Origin>().expect("an arm").source();
        assert_eq!(source("fci://FR3.local"), source("fci://fr3.local"));
        assert_ne!(source("fci://172.16.0.2"), source("fci://172.16.0.3"));
        assert_eq!(source("replay://a.mcap"), source("replay://b.mcap"));
        assert_eq!(Origin::import("a.csv", "CSV").map(|o| o.source()), Some(Origin::elsewhere("ROS 2 bag").source()));
    }

    #[test]
    fn origins_are_kept_once_and_not_without_end() {
        let mut origins = Origins::default();
        assert_eq!((origins.to_string().as_str(), origins.is_unknown()), ("unknown", true));
        for n in 0..1000 {
            origins.add(Origin::Simulation);
            origins.add(Origin::Robot { host: format!("host{n}") });
        }
        assert_eq!(origins.iter().count(), MOST);
        assert!(origins.to_string().starts_with("the simulation and the robot at fci://host0"), "{origins}");
        let json = serde_json::to_value(&origins).expect("JSON");
        assert_eq!(json[1], serde_json::json!({"kind": "robot", "host": "host0"}));
    }
}
