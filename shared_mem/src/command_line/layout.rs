//! Texts below the options, in the columns there are. Their source is written as wide as the code; here paragraphs are
//! joined and wrapped, rows keep their second column, and an example that is too long is continued with `\` as a shell
//! takes it, what it is for on a line of its own above.

use clap::Command;

/// Columns between an example and what it is for.
const GAP: &str = "  ";
/// What stands before a usage.
const USAGE: &str = "Usage: ";
/// What a continued example begins with.
const CONTINUED: &str = "      ";

/// The command and its verbs with texts of at most so many columns.
pub(super) fn fitted(command: Command, width: usize) -> Command {
    let name = command.get_name().to_owned();
    // Only a command that is built knows how its verbs are called.
    let mut built = command.clone();
    built.build();
    fitted_below(command, &mut built, &name, width).term_width(width)
}

fn fitted_below(mut command: Command, built: &mut Command, program: &str, width: usize) -> Command {
    if let Some(text) = command.get_after_help().map(|text| text_of(&text.to_string(), program, width)) {
        command = command.after_help(text);
    }
    let usage = built.render_usage().to_string();
    if let Some(usage) = usage.strip_prefix(USAGE).filter(|usage| USAGE.len() + usage.trim_end().len() > width) {
        command = command.override_usage(usage_of(usage, width));
    }
    command.mut_subcommands(|verb| match built.find_subcommand_mut(verb.get_name()) {
        Some(built) => fitted_below(verb, built, program, width),
        None => verb,
    })
}

/// A line of usage, continued below its arguments.
fn usage_of(usage: &str, width: usize) -> String {
    let mut lines = Vec::new();
    let mut line = String::new();
    let mut words = usage.split_whitespace().peekable();
    while let Some(word) = words.next() {
        let mut part = word.to_owned();
        while let Some(value) = words.next_if(|next| word.starts_with('-') && next.starts_with('<')) {
            part = format!("{part} {value}");
        }
        if !line.is_empty() && USAGE.len() + line.len() + 1 + part.len() > width {
            lines.push(std::mem::take(&mut line));
        }
        line = if line.is_empty() { part } else { format!("{line} {part}") };
    }
    lines.push(line);
    lines.join(&format!("\n{}", " ".repeat(USAGE.len())))
}

/// A text laid out anew.
fn text_of(text: &str, program: &str, width: usize) -> String {
    let mut out = Vec::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if line.trim().is_empty() {
            out.push(String::new());
        } else if indent(line) == 0 {
            // A heading stays by itself, in front of what it is for.
            let mut paragraph = line.trim_end().to_owned();
            while let Some(next) = lines.next_if(|next| !next.trim().is_empty() && indent(next) == 0) {
                paragraph = format!("{paragraph} {}", next.trim_end());
            }
            wrap(&paragraph, 0, width, &mut out);
        } else {
            let mut rows = vec![line.trim_end().to_owned()];
            while let Some(next) = lines.next_if(|next| indent(next) > 0) {
                match rows.last_mut() {
                    // The text of a row goes on below it.
                    Some(row) if indent(next) > indent(row) => {
                        *row = format!("{} {}", row.trim_end_matches(['\\', ' ']), next.trim());
                    }
                    _ => rows.push(next.trim_end().to_owned()),
                }
            }
            block(&rows, program, width, &mut out);
        }
    }
    out.join("\n")
}

fn indent(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// Rows or examples that stand together.
fn block(rows: &[String], program: &str, width: usize, out: &mut Vec<String>) {
    let too_long = rows.iter().any(|row| row.chars().count() > width);
    for row in rows {
        let (text, remark) = match row.trim_start().split_once(GAP) {
            Some((text, remark)) => (text, remark.trim().trim_start_matches('#').trim_start()),
            None => (row.trim_start(), ""),
        };
        let margin = " ".repeat(indent(row));
        if !text.starts_with(program) {
            // The text of a row begins behind its gap.
            let column = row.trim_start().find(GAP).map_or(0, |gap| gap + indent(&row.trim_start()[gap..]));
            wrap(row, indent(row) + column, width, out);
        } else if too_long {
            if !remark.is_empty() {
                wrap(&format!("{margin}# {remark}"), indent(row), width, out);
            }
            example(text, &margin, width, out);
        } else {
            out.push(row.clone());
        }
    }
}

/// A command, continued at its options where it is too long.
fn example(command: &str, margin: &str, width: usize, out: &mut Vec<String>) {
    let mut words = command.split(' ').peekable();
    let mut line = margin.to_owned() + words.next().unwrap_or("");
    while let Some(word) = words.next() {
        // An option stays with its values.
        let mut part = word.to_owned();
        while let Some(value) = words.next_if(|next| word.starts_with('-') && !next.starts_with("--")) {
            part = format!("{part} {value}");
        }
        let goes_on = words.peek().is_some();
        let room = width - if goes_on { 2 } else { 0 };
        if line.chars().count() + 1 + part.chars().count() > room && line.trim() != "" {
            out.push(format!("{line} \\"));
            line = format!("{CONTINUED}{part}");
        } else {
            line = format!("{line} {part}");
        }
    }
    out.push(line);
}

/// Fills lines with words; those after the first begin at the column `hanging`.
fn wrap(text: &str, hanging: usize, width: usize, out: &mut Vec<String>) {
    if text.chars().count() <= width {
        out.push(text.to_owned());
        return;
    }
    // Columns of a row, up to where its text begins, stay as they are.
    let head = hanging.min(text.len());
    let (mut line, rest) = (text[..head].to_owned(), &text[head..]);
    let mut begun = false;
    for word in rest.split_whitespace() {
        if begun && line.chars().count() + 1 + word.chars().count() > width {
            out.push(std::mem::replace(&mut line, " ".repeat(hanging)));
            begun = false;
        }
        if begun {
            line.push(' ');
        }
        line.push_str(word);
        begun = true;
    }
    out.push(line);
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "\
The scan is laid onto the robot's surface at the joint positions it stood at: turned, shifted and scaled, beginning with
--start and what lies around it.

  multisine  all joints at once along sums of sines, 0.2 to 1.6 Hz, and a little more so that it is too long
  chirp      swings from the lower to the higher --frequency; above about 1 Hz they get smaller, so that the
             acceleration stays what it is

Examples:
  twin shadow --cell config/fr3_cell.toml                       until Ctrl-C, gap on the terminal
  twin label-splats scan.ply --cell cell.toml --joints 0,-0.78,0,-2.36,0,1.57,0.78 --frequency 0.2 10 --out fr3_splats
Every verb has its own --help.";

    #[test]
    fn no_line_is_longer_than_there_are_columns_and_examples_can_be_typed() {
        let text = text_of(SOURCE, "twin", 80);
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        let expected = "\
The scan is laid onto the robot's surface at the joint positions it stood at:
turned, shifted and scaled, beginning with --start and what lies around it.

  multisine  all joints at once along sums of sines, 0.2 to 1.6 Hz, and a little
             more so that it is too long
  chirp      swings from the lower to the higher --frequency; above about 1 Hz
             they get smaller, so that the acceleration stays what it is

Examples:
  # until Ctrl-C, gap on the terminal
  twin shadow --cell config/fr3_cell.toml
  twin label-splats scan.ply --cell cell.toml \\
      --joints 0,-0.78,0,-2.36,0,1.57,0.78 --frequency 0.2 10 --out fr3_splats
Every verb has its own --help.";
        assert_eq!(text, expected);
        assert_eq!(text_of(&text, "twin", 80), text, "what was laid out stays as it is");
    }

    #[test]
    fn a_usage_that_is_too_long_goes_on_below_its_arguments() {
        let verb = Command::new("control-hit-slide").args(
            ["cell", "out", "clips"]
                .map(|name| clap::Arg::new(name).long(name).value_name("A_LONG_NAME").required(true)),
        );
        let command = Command::new("calibration").subcommand(Command::new("capture").subcommand(verb));
        let mut command = fitted(command, 80);
        command.build();
        let verb =
            command.find_subcommand_mut("capture").and_then(|verb| verb.find_subcommand_mut("control-hit-slide"));
        let usage = verb.expect("it is there").render_usage().to_string();
        assert_eq!(
            usage.trim_end(),
            "Usage: calibration capture control-hit-slide --cell <A_LONG_NAME>\n       --out <A_LONG_NAME> --clips <A_LONG_NAME>"
        );
    }

    #[test]
    fn what_fits_stays_as_it_is() {
        let short = "Examples:\n  twin replay session       a whole session\n  twin render session --out frames";
        assert_eq!(text_of(short, "twin", 80), short);
    }
}
