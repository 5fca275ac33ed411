//! What looks like a number below zero is a value wherever a number is asked for: what may not be below zero says its range,
//! and not that there is no such option.

use clap::{Arg, Command};
use std::any::TypeId;
use std::time::Duration;

/// The command and its verbs so.
pub(super) fn below_zero(command: Command) -> Command {
    let command = command.mut_args(|argument| {
        if argument.get_action().takes_values() && wants_a_number(&argument) {
            return argument.allow_negative_numbers(true);
        }
        argument
    });
    command.mut_subcommands(below_zero)
}

fn wants_a_number(argument: &Arg) -> bool {
    let numbers = [
        TypeId::of::<f64>(),
        TypeId::of::<u8>(),
        TypeId::of::<u16>(),
        TypeId::of::<u32>(),
        TypeId::of::<u64>(),
        TypeId::of::<usize>(),
        TypeId::of::<i64>(),
        TypeId::of::<Duration>(),
    ];
    let parsed = argument.get_value_parser().type_id();
    numbers.iter().any(|number| parsed == *number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::value_parser;

    #[test]
    fn a_number_below_zero_is_told_its_range_and_a_flag_of_a_file_is_none() {
        let speed = Arg::new("speed").long("speed").value_parser(value_parser!(u16).range(1..=10));
        let verb = Command::new("verb").args([speed, Arg::new("out").long("out")]);
        let said = |words: &[&str]| {
            let program = below_zero(Command::new("program").subcommand(verb.clone()));
            program.try_get_matches_from([&["program", "verb"], words].concat()).expect_err("refused").to_string()
        };
        assert!(said(&["--speed", "-1"]).contains("-1 is not in 1..=10"), "{}", said(&["--speed", "-1"]));
        assert!(said(&["--out", "-1"]).contains("unexpected argument '-1'"), "{}", said(&["--out", "-1"]));
    }
}
