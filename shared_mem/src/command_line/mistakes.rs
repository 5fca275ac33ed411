//! What is said of a command line that is wrong.

use clap::Command;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};

/// The text: the parser's own, but for a word that is no verb, and for a number outside of what is allowed.
pub(super) fn text(error: &Error, whole: &Command, words: &[String]) -> String {
    let said = error.render().to_string();
    let Some(ContextValue::String(wrong)) = error.get(ContextKind::InvalidSubcommand) else {
        return within(&said);
    };
    // The parser proposes verbs that are spelt alike; a path has none.
    if error.kind() != ErrorKind::InvalidSubcommand || error.get(ContextKind::SuggestedSubcommand).is_some() {
        return said;
    }
    let (mut command, mut name) = (whole, whole.get_name().to_owned());
    for word in words.iter().skip(1).take_while(|word| *word != wrong) {
        if let Some(verb) = command.find_subcommand(word) {
            name = format!("{name} {}", verb.get_name());
            command = verb;
        }
    }
    if wrong.starts_with('-') {
        let whole = whole.get_name();
        return format!("error: `{wrong}` is no verb of `{whole}`; `{whole} --help` lists all of them\n");
    }
    let verbs: Vec<&str> = command.get_subcommands().map(Command::get_name).filter(|verb| *verb != "help").collect();
    let verbs = verbs.join(", ");
    format!("error: `{wrong}` is no verb of `{name}`, which has {verbs}; `{name} --help` explains them\n")
}

/// Where a line says `0 is not in 1..=1000`, that as a sentence.
fn within(said: &str) -> String {
    said.split_inclusive('\n').map(|line| range(line).unwrap_or_else(|| line.to_owned())).collect()
}

fn range(line: &str) -> Option<String> {
    // From behind, and whole numbers alone: what was typed stands in the line, too.
    let (before, range) = line.trim_end().rsplit_once(" is not in ")?;
    let (least, most) = range.split_once("..=")?;
    let asked = before.rsplit_once(": ")?.0;
    let least = if least.is_empty() { 0 } else { least.parse::<i128>().ok()? };
    let most = most.parse::<i128>().ok()?;
    Some(format!("{asked}: give a whole number from {least} to {most}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Arg, value_parser};

    fn said(words: &[&str]) -> String {
        let clips = Arg::new("clips").long("clips").value_parser(value_parser!(u32).range(1..=1000));
        let identify = Command::new("identify")
            .subcommand_required(true)
            .subcommands([Command::new("arm").arg(clips), Command::new("object")]);
        let mut whole = Command::new("calibration").subcommand_required(true).subcommand(identify);
        let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        let error = whole.try_get_matches_from_mut(&words).expect_err("they are wrong");
        text(&error, &whole, &words)
    }

    #[test]
    fn a_path_in_the_place_of_a_verb_is_told_the_verbs() {
        assert_eq!(
            said(&["calibration", "identify", "monday"]),
            "error: `monday` is no verb of `calibration identify`, which has arm, object; `calibration identify --help` explains them\n"
        );
        assert_eq!(
            said(&["calibration", "help", "--help"]),
            "error: `--help` is no verb of `calibration`; `calibration --help` lists all of them\n"
        );
        assert!(said(&["calibration", "identify", "objet"]).contains("'object'"), "the nearest is proposed");
    }

    #[test]
    fn a_number_outside_of_its_range_is_told_the_range() {
        let typed = said(&["calibration", "identify", "arm", "--clips", "a is not in 1..=5"]);
        assert!(typed.contains("invalid digit"), "{typed}");
        let text = said(&["calibration", "identify", "arm", "--clips", "0"]);
        assert!(
            text.starts_with("error: invalid value '0' for '--clips <clips>': give a whole number from 1 to 1000\n"),
            "{text}"
        );
    }
}
