//! What a person reads: the help of every verb, the documents, and the texts in the sources.

use crate::program_path;
use crate::sources::{Source, product_without_tests};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

pub const PROGRAMS: [&str; 3] = ["rt_bridge", "twin", "calibration"];

/// The workspace's folder.
///
/// # Panics
/// When this crate lies in none.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_owned()
}

/// A verb, or a program with verbs, as its help shows it.
#[derive(Debug, Clone)]
pub struct Verb {
    /// Program and verbs: `["calibration", "identify", "arm"]`.
    pub path: Vec<String>,
    /// Flags without their dashes.
    pub flags: BTreeSet<String>,
    /// The whole of `--help`.
    pub help: String,
}

impl Verb {
    /// Examples of the help: indented, beginning with the program, and whole where the help breaks a long one.
    pub fn examples(&self) -> Vec<String> {
        let after = self.help.split_once("Example").map_or("", |(_, after)| after);
        let begin = format!("  {} ", self.path[0]);
        let mut found = Vec::<String>::new();
        let mut open = false;
        for line in after.lines() {
            let begins = line.starts_with(&begin);
            // A long one goes on in the next line, as for a shell.
            let text = line.trim().trim_end_matches('\\').trim_end();
            match found.last_mut().filter(|_| open) {
                Some(example) => *example = format!("{example} {text}"),
                None => found.extend(begins.then(|| text.to_owned())),
            }
            open = line.ends_with('\\') && (open || begins);
        }
        found
    }
}

/// Every program and verb, read from `--help`.
///
/// # Panics
/// When a program does not show its help.
pub fn verbs() -> Vec<Verb> {
    let mut found = Vec::new();
    let mut open: Vec<Vec<String>> = PROGRAMS.iter().map(|program| vec![(*program).to_owned()]).collect();
    while let Some(path) = open.pop() {
        let output = Command::new(program_path(&path[0])).args(&path[1..]).arg("--help").output().expect("it runs");
        assert!(output.status.success(), "{path:?} shows no help");
        let help = String::from_utf8(output.stdout).expect("UTF-8");
        let names = section(&help, "Commands:").into_iter().filter(|line| !line.starts_with("   "));
        let below = names.filter_map(|line| line.split_whitespace().next());
        open.extend(below.filter(|verb| *verb != "help").map(|verb| [&path[..], &[verb.to_owned()]].concat()));
        let flag = |line: &str| {
            let option = line.trim_start().strip_prefix("-").is_some() && line.starts_with("  ");
            option.then(|| flags_in(line).into_iter().next()).flatten()
        };
        let flags = section(&help, "Options:").into_iter().filter_map(flag).collect();
        found.push(Verb { path, flags, help });
    }
    found
}

/// The indented lines below a heading, up to the next line that is not indented. Deeper ones describe those before them.
fn section<'a>(help: &'a str, heading: &str) -> Vec<&'a str> {
    let lines = help.lines().skip_while(|line| *line != heading).skip(1);
    lines.take_while(|line| line.is_empty() || line.starts_with(' ')).filter(|line| !line.is_empty()).collect()
}

/// Names of the flags that a text mentions, without their dashes.
pub fn flags_in(text: &str) -> Vec<String> {
    let begins =
        |before: &str| before.ends_with(|c: char| c.is_whitespace() || "`(\"'".contains(c)) || before.is_empty();
    let pieces = text.match_indices("--").filter(|(at, _)| begins(&text[..*at]));
    let name = |(at, _): (usize, &str)| -> String {
        text[at + 2..].chars().take_while(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || *c == '-').collect()
    };
    pieces.map(name).filter(|name| name.starts_with(|c: char| c.is_ascii_lowercase())).collect()
}

/// README.md and docs, each with its name.
///
/// # Panics
/// When one cannot be read.
pub fn documents() -> Vec<(String, String)> {
    let docs = std::fs::read_dir(root().join("docs")).expect("docs").map(|entry| entry.expect("an entry").path());
    let all = docs.filter(|path| path.extension().is_some_and(|e| e == "md")).chain([root().join("README.md")]);
    let read = |path: PathBuf| {
        let name = path.strip_prefix(root()).expect("below the root").display().to_string();
        (name, std::fs::read_to_string(&path).expect("a readable document"))
    };
    all.map(read).collect()
}

/// The folders with the sources of the product.
pub const PRODUCT: [&str; 18] = [
    "shared_mem/src",
    "twin/splat/src",
    "twin/fusion/src",
    "twin/depth/src",
    "twin/reconstruct/src",
    "twin/urdf/src",
    "twin/src",
    "rt_bridge/link/src",
    "rt_bridge/src",
    "shared_mem/import/src",
    "calibration/evaluation/src",
    "calibration/inference/src",
    "calibration/vision/src",
    "calibration/capture/src",
    "calibration/worlds/src",
    "calibration/tools/src",
    "calibration/src",
    "twinalign/src",
];

/// Every string in the sources of the product, tests left out: its file, and the string with escaped line ends as spaces.
pub fn literals() -> Vec<(String, String)> {
    let of = |source: Source| strings(source.product()).into_iter().map(move |string| (source.file.clone(), string));
    product_without_tests(&root()).into_iter().flat_map(of).collect()
}

/// The string literals of Rust code.
fn strings(code: &str) -> Vec<String> {
    let (mut found, mut rest) = (Vec::new(), code);
    while let Some(c) = rest.chars().next() {
        let after = &rest[c.len_utf8()..];
        rest = match c {
            '/' if rest.starts_with("//") => rest.split_once('\n').map_or("", |(_, after)| after),
            '/' if rest.starts_with("/*") => rest.split_once("*/").map_or("", |(_, after)| after),
            // A character, not a lifetime.
            '\'' if after.starts_with('\\') => after.get(2..).and_then(|a| a.split_once('\'')).map_or("", |(_, a)| a),
            '\'' if after.chars().nth(1) == Some('\'') => &after[after.chars().next().map_or(0, char::len_utf8) + 1..],
            'r' if after.starts_with("#\"") => {
                let (raw, after) = after[2..].split_once("\"#").unwrap_or((&after[2..], ""));
                found.push(spaced(raw));
                after
            }
            '"' => {
                let mut escaped = false;
                let end = after.char_indices().find(|(_, c)| {
                    let ends = *c == '"' && !escaped;
                    escaped = *c == '\\' && !escaped;
                    ends
                });
                let (string, after) = end.map_or((after, ""), |(at, _)| (&after[..at], &after[at + 1..]));
                found.push(spaced(&string.replace("\\\n", " ").replace("\\n", "\n").replace("\\\"", "\"")));
                after
            }
            _ => after,
        };
    }
    found
}

/// One space between words; lines stay lines.
fn spaced(text: &str) -> String {
    text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect::<Vec<_>>().join("\n")
}

/// Pieces of code in a text: between backticks, and lines between fences.
pub fn code_in(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (number, part) in text.split("```").enumerate() {
        if number % 2 == 1 {
            found.extend(part.lines().map(|line| line.trim().to_owned()));
        } else {
            found.extend(part.split('`').skip(1).step_by(2).map(|code| code.replace('\n', " ")));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_are_found_between_comments_characters_and_lifetimes() {
        let code = "// \"no\"\nfn a<'a>(x: &'a str) { f(\"one \\\n    two\"); g('\"', '\\'', \"say \\\"it\\\"\", r#\"raw \"x\"\"#); }";
        assert_eq!(strings(code), ["one two", "say \"it\"", "raw \"x\""]);
    }

    #[test]
    fn flags_and_code_are_found_in_a_text() {
        assert_eq!(flags_in("give --start x, `--cell=a` or a--b; -- no"), ["start", "cell"]);
        assert_eq!(
            code_in("say `twin replay` or\n```sh\ncargo build\n```\n`x`"),
            ["twin replay", "sh", "cargo build", "x"]
        );
    }
}
