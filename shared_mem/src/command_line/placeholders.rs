//! One spelling of what stands for a value: capitals, a file's ending in small letters, `,...` behind what may be given
//! several times with commas, and one word for one thing over all programs.

use clap::Command;

/// Words that mean the same; the second is shown.
const SAME: [(&str, &str); 9] = [
    ("S", "SECONDS"),
    ("RAD", "RADIANS"),
    ("DEG", "DEGREES"),
    ("DEG[,DEG..]", "DEGREES,..."),
    ("N[,M..]", "N,..."),
    ("Q", "Q,..."),
    ("CELL", "CELL.toml"),
    ("PARAMETERS", "THETA.toml"),
    ("REPORT.html", "PAGE.html"),
];

/// The command and its verbs with that spelling.
pub(super) fn spelled(command: Command) -> Command {
    let command = command.mut_args(|argument| {
        if !argument.get_action().takes_values() {
            return argument;
        }
        let names: Vec<String> = match argument.get_value_names() {
            Some(names) => names.iter().map(|name| word(name)).collect(),
            None => vec![word(argument.get_id().as_str())],
        };
        argument.value_names(names)
    });
    command.mut_subcommands(spelled)
}

fn word(name: &str) -> String {
    let spelled = match name.rsplit_once('.') {
        Some((stem, ending)) if !ending.is_empty() && ending.chars().all(char::is_alphanumeric) => {
            format!("{}.{}", stem.to_uppercase(), ending.to_lowercase())
        }
        _ => name.to_uppercase(),
    };
    SAME.iter().find(|(other, _)| *other == spelled).map_or(spelled, |(_, shown)| (*shown).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Arg, ArgAction};

    #[test]
    fn one_thing_has_one_name() {
        for (written, shown) in [
            ("cell.toml", "CELL.toml"),
            ("CELL.TOML", "CELL.toml"),
            ("cell", "CELL.toml"),
            ("hidden.toml", "HIDDEN.toml"),
            ("CLIP.mcap", "CLIP.mcap"),
            ("REPORT.HTML", "PAGE.html"),
            ("S", "SECONDS"),
            ("SESSION|CLIP", "SESSION|CLIP"),
            ("NAME,...", "NAME,..."),
            ("N[,M..]", "N,..."),
        ] {
            assert_eq!(word(written), shown);
        }
        let verb = Command::new("verb").args([
            Arg::new("cell").long("cell"),
            Arg::new("frequency").long("frequency").value_names(["lo", "hi"]),
            Arg::new("json").long("json").action(ArgAction::SetTrue),
        ]);
        let help = spelled(Command::new("program").subcommand(verb))
            .find_subcommand_mut("verb")
            .expect("it is there")
            .render_help()
            .to_string();
        assert!(help.contains("--cell <CELL.toml>") && help.contains("--frequency <LO> <HI>"), "{help}");
        assert!(help.lines().any(|line| line.trim() == "--json"), "{help}");
    }
}
