//! Every help text of every verb of every program, as a terminal of 80 columns shows it: no line is longer, examples can be
//! typed as they stand, placeholders are spelled alike. And what comes with it: version, completions, manual pages.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};
use tests::program_path;

const PROGRAMS: [&str; 3] = ["rt_bridge", "twin", "calibration"];
const COLUMNS: usize = 80;

fn run(program: &str, arguments: &[String]) -> Output {
    Command::new(program_path(program)).args(arguments).env("COLUMNS", "80").output().expect("the program runs")
}

fn help(program: &str, verb: &[String]) -> String {
    let output = run(program, &[verb, &["--help".to_owned()]].concat());
    assert!(output.status.success(), "{program} {verb:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The help of a program and of each of its verbs.
fn all() -> BTreeMap<String, String> {
    let mut texts = BTreeMap::new();
    for program in PROGRAMS {
        let mut open: Vec<Vec<String>> = vec![Vec::new()];
        while let Some(verb) = open.pop() {
            let text = help(program, &verb);
            let commands = text.split_once("\nCommands:\n").map_or("", |(_, rest)| rest);
            let names = commands.lines().take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("   "));
            for name in names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help") {
                open.push([&verb[..], &[name.to_owned()]].concat());
            }
            texts.insert([&[program.to_owned()], &verb[..]].concat().join(" "), text);
        }
    }
    texts
}

/// The examples below a help text, continued lines joined; everything else that stands among them is a comment.
fn examples(name: &str, text: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let Some((_, below)) = text.split_once("\nExample") else { return found };
    let mut goes_on = false;
    for line in below.lines().skip(1).take_while(|line| line.starts_with("  ")) {
        let (part, continued) = match line.strip_suffix(" \\") {
            Some(part) => (part, true),
            None => (line, false),
        };
        match found.last_mut() {
            Some(last) if goes_on => *last = format!("{last} {}", part.trim()),
            _ if line.trim_start().starts_with("# ") => {}
            // `man` is no program of this project.
            _ if line.trim_start().starts_with("man ") => {}
            _ => {
                let program = PROGRAMS.iter().any(|program| line.trim_start().starts_with(program));
                assert!(program, "{name}: `{line}` is neither an example nor a comment");
                found.push(part.trim().to_owned());
            }
        }
        goes_on = continued;
    }
    assert!(!goes_on, "{name}: an example breaks off");
    found
}

/// The words that a shell makes of an example, without what stands behind it for people or for the shell.
fn words(example: &str) -> Vec<String> {
    let command = example.split("  ").next().unwrap_or("").split(" > ").next().unwrap_or("");
    command.split(' ').map(str::to_owned).collect()
}

#[test]
fn no_line_is_longer_than_a_terminal_has_columns_and_every_example_is_accepted() {
    let texts = all();
    assert!(texts.len() > 30, "{} help texts", texts.len());
    let mut accepted = 0;
    for (name, text) in &texts {
        for line in text.lines() {
            assert!(line.chars().count() <= COLUMNS, "{name} --help has {} columns:\n{line}", line.chars().count());
        }
        let given = examples(name, text);
        assert!(!given.is_empty(), "{name} --help gives no example");
        for example in given {
            // With --help behind it an example does nothing; what no verb knows, and values that none takes, are refused before.
            let words = words(&example);
            let output = run(&words[0], &[&words[1..], &["--help".to_owned()]].concat());
            assert!(output.status.success(), "{name}: {example}\n{}", String::from_utf8_lossy(&output.stderr));
            accepted += 1;
        }
    }
    assert!(accepted > 50, "{accepted} examples");
}

#[test]
fn a_broken_example_would_be_noticed() {
    for wrong in ["--out", "--no-such-option", "--clips 0"] {
        let line = format!("capture excitation --cell cell.toml {wrong} --help");
        let arguments: Vec<String> = line.split(' ').map(str::to_owned).collect();
        assert_eq!(run("calibration", &arguments).status.code(), Some(2), "{line}");
    }
    let cut = "\nExamples:\n  twin replay session --out\n  simulated.mcap\n";
    assert!(std::panic::catch_unwind(|| examples("twin replay", cut)).is_err());
}

#[test]
fn one_option_has_one_placeholder_and_all_are_spelled_alike() {
    let mut placeholders: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
    for (name, text) in all() {
        for line in
            text.lines().map(str::trim_start).filter(|line| line.starts_with("--") || line.starts_with("-h, --"))
        {
            let mut words = line.split(['<', ' ']);
            let option = words.next().unwrap_or("").to_owned();
            for placeholder in line.split('<').skip(1).filter_map(|rest| rest.split_once('>')).map(|(inside, _)| inside)
            {
                let spelled = placeholder.split('|').all(|word| {
                    let stem = word.trim_end_matches(",...").rsplit_once('.').map_or(word, |(stem, _)| stem);
                    stem.chars().all(|c| c.is_ascii_uppercase() || "_,.".contains(c))
                });
                assert!(spelled, "{name}: {option} <{placeholder}>");
                placeholders.entry(option.clone()).or_default().insert(placeholder.to_owned(), name.clone());
            }
        }
    }
    // What is written, drawn or begun from differs from verb to verb; what is
    // read, and a budget, which is one of seconds, does not.
    for option in [
        "--cell",
        "--parameters",
        "--effects",
        "--duration",
        "--wait",
        "--seed",
        "--hand",
        "--arm",
        "--budget",
        "--points",
    ] {
        let names = placeholders.get(option).unwrap_or_else(|| panic!("no verb has {option}"));
        assert_eq!(names.len(), 1, "{option}: {names:?}");
    }
    assert!(placeholders["--cell"].contains_key("CELL.toml"), "{:?}", placeholders["--cell"]);
}

#[test]
fn the_version_names_commit_and_features() {
    for program in PROGRAMS {
        let output = run(program, &["--version".to_owned()]);
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        let (version, features) = text.trim_end().split_once("; features: ").unwrap_or_else(|| panic!("{text}"));
        let expected = format!("{program} {} (commit ", env!("CARGO_PKG_VERSION"));
        let commit = version.strip_prefix(&expected).unwrap_or_else(|| panic!("{text}"));
        let hash = commit.trim_end_matches("-modified");
        assert!(commit == "unknown" || hash.len() == 12 && hash.chars().all(|c| c.is_ascii_hexdigit()), "{text}");
        assert!(features.ends_with(')'), "{text}");
    }
}

#[test]
fn every_program_writes_completions_that_its_shell_reads_and_manual_pages_of_every_verb() {
    let folder = tempfile::tempdir().expect("a folder");
    for program in PROGRAMS {
        let script = run(program, &["completions".to_owned(), "bash".to_owned()]);
        assert!(script.status.success());
        let text = String::from_utf8(script.stdout).expect("UTF-8");
        assert!(text.contains("--cell") && text.contains("complete -F"), "{program}: {} bytes", text.len());
        let file = folder.path().join(program);
        std::fs::write(&file, &text).expect("a file");
        let read = Command::new("bash").arg("-n").arg(&file).output().expect("bash");
        assert!(read.status.success(), "{program}: {}", String::from_utf8_lossy(&read.stderr));
        let wrong = run(program, &["completions".to_owned(), "cmd".to_owned()]);
        assert_eq!(wrong.status.code(), Some(2), "{program}");
    }
    let pages = folder.path().join("man/man1");
    for program in PROGRAMS {
        let output = run(program, &["manpages".to_owned(), "--out".to_owned(), pages.display().to_string()]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    for (name, text) in all() {
        let page = pages.join(format!("{}.1", name.replace(' ', "-")));
        let written = std::fs::read_to_string(&page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        assert!(written.contains(".SH NAME") && written.contains(".SH OPTIONS"), "{name}");
        // What a shell gets from a page is what it gets from the help.
        for example in examples(&name, &text) {
            let first = words(&example).join(" ");
            let first = first.split(" --").next().unwrap_or("").replace('-', "\\-");
            assert!(written.contains(&first), "{name}: {first}");
        }
    }
    let names = Path::new(&pages).read_dir().expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let names: Vec<String> = names.map(|name| name.into_string().expect("UTF-8")).collect();
    assert!(names.len() > 30 && !names.iter().any(|name| name.contains("help")), "{names:?}");
}
