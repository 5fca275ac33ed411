//! An error with its causes in one line, as every program ends with it.

use std::error::Error;

/// What the error says, and of its causes those that it does not already say.
pub fn error_line(error: &(dyn Error + 'static)) -> String {
    let (mut line, mut cause) = (error.to_string(), error.source());
    while let Some(error) = cause {
        let told = error.to_string();
        if !line.contains(&told) {
            line = format!("{line}: {told}");
        }
        cause = error.source();
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("{told}")]
    struct Told {
        told: &'static str,
        source: std::fmt::Error,
    }

    #[test]
    fn a_cause_is_said_once() {
        let cause = std::fmt::Error.to_string();
        let silent = Told { told: "cannot write", source: std::fmt::Error };
        assert_eq!(error_line(&silent), format!("cannot write: {cause}"));
        let full = format!("cannot write: {cause}; make room");
        let full = Told { told: full.leak(), source: std::fmt::Error };
        assert_eq!(error_line(&full), full.told);
    }
}
