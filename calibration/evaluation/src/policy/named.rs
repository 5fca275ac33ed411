//! A policy by its name on a command line: `expert`, `expert:noise=0.01`, `ws://HOST:PORT`, `FILE.onnx`, each also as `NAME=...`.

use std::path::PathBuf;
use std::str::FromStr;

/// Who acts.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// The task's scripted motion, with normal deviates of one sigma added to its way points along each axis [m].
    Expert {
        /// One sigma [m].
        noise: f64,
    },
    /// A policy that is served at this address, `ws://HOST:PORT`.
    Served(String),
    /// A policy in an ONNX file.
    Onnx(PathBuf),
}

/// A policy and what reports call it.
#[derive(Debug, Clone, PartialEq)]
pub struct Named {
    /// In reports, and in the files of other worlds.
    pub name: String,
    /// Who acts.
    pub source: Source,
}

/// No policy is called so.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no policy; give expert, expert:noise=METRES, ws://HOST:PORT or FILE.onnx, with a name of its own as NAME=ws://HOST:PORT"
)]
pub struct NamedError(String);

impl FromStr for Named {
    type Err = NamedError;

    fn from_str(text: &str) -> Result<Self, NamedError> {
        let wrong = || NamedError(text.to_owned());
        // A name of its own stands before the first `=`, unless that is the one of `noise`.
        let (name, source) = match text.split_once('=') {
            Some((name, rest)) if !name.contains(':') => (name, rest),
            _ => (text, text),
        };
        if name.is_empty() || name.contains([',', '"', '\n']) {
            return Err(wrong());
        }
        let source = if source == "expert" {
            Source::Expert { noise: 0.0 }
        } else if let Some(noise) = source.strip_prefix("expert:noise=") {
            let noise = noise.parse().ok().filter(|noise| (0.0..=1.0).contains(noise)).ok_or_else(wrong)?;
            Source::Expert { noise }
        } else if source.strip_prefix("ws://").is_some_and(|host| !host.is_empty()) {
            Source::Served(source.to_owned())
        } else if source.strip_suffix(".onnx").is_some_and(|stem| !stem.is_empty() && !stem.ends_with('/')) {
            Source::Onnx(source.into())
        } else {
            return Err(wrong());
        };
        Ok(Self { name: name.to_owned(), source })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn policies_are_called_as_they_are_given_unless_they_have_a_name() {
        let served = Source::Served("ws://host:8000".into());
        for (text, name, source) in [
            ("expert", "expert", Source::Expert { noise: 0.0 }),
            ("expert:noise=0.01", "expert:noise=0.01", Source::Expert { noise: 0.01 }),
            ("worse=expert:noise=0.01", "worse", Source::Expert { noise: 0.01 }),
            ("ws://host:8000", "ws://host:8000", served.clone()),
            ("mine=ws://host:8000", "mine", served.clone()),
            ("policies/act.onnx", "policies/act.onnx", Source::Onnx("policies/act.onnx".into())),
            ("act=act.onnx", "act", Source::Onnx("act.onnx".into())),
        ] {
            assert_eq!(text.parse(), Ok(Named { name: name.into(), source }), "{text}");
        }
        for wrong in ["", "expert:noise=-1", "expert:noise=x", "ws://", "=expert", "a,b=expert", ".onnx", "file.pt"] {
            assert!(wrong.parse::<Named>().is_err_and(|error| error.to_string().contains("ws://HOST:PORT")), "{wrong}");
        }
    }
}
