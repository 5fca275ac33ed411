//! What a person reads is in terms of the field: no word of this project's own in help, documents, messages and reports, nor in
//! names and comments of `calibration`.

use tests::sources::{Source, below};
use tests::texts::{documents, literals, root, verbs};

/// Words that stand for something the field has a term for: predicts, log-likelihood, residual, identifiable, held-out.
const OWN: [&str; 10] =
    ["foretell", "foretells", "foretold", "told", "stray", "strays", "straying", "worthy", "freed", "flat"];
const OWN_BEGINNINGS: [&str; 2] = ["settl", "foretell"];

/// Words in the sources of `calibration`, and what the field calls it.
const IN_CODE: [(&str, &str); 20] = [
    ("own number", "nuisance parameter"),
    ("own numbers", "nuisance parameters"),
    ("own ones", "nuisance parameters"),
    ("own_fitted", "profiled"),
    ("met in practice", "plausible, with a source"),
    ("foretell", "predict"),
    ("foretells", "predicts"),
    ("foretold", "predicted"),
    ("told", "commanded, given, reported, known"),
    ("stray", "outlier"),
    ("strays", "deviates"),
    ("HEAT", "a screening pass"),
    ("relaxed", "projected"),
    ("rub", "friction"),
    ("rubs", "slides with friction"),
    ("rubbed", "slid with friction"),
    ("rubbing", "friction"),
    ("Desk", "the context of a capture"),
    ("Studio", "the context of a recording"),
    ("Court", "the context of a trial"),
];

/// Whether a line holds a phrase, whole words of it.
fn holds(line: &str, phrase: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let whole =
        |(at, _): (usize, &str)| !line[..at].ends_with(is_part) && !line[at + phrase.len()..].starts_with(is_part);
    line.match_indices(phrase).any(whole)
}

/// Words of [`IN_CODE`] before a file's tests, each with its line. What stands in quotation marks is looked at with the messages.
fn own_words_in(source: &Source) -> Vec<String> {
    let unquoted = |line: &str| line.split('"').step_by(2).collect::<Vec<_>>().join(" ");
    let mut found = Vec::new();
    for (number, line) in source.product().lines().map(unquoted).enumerate() {
        let words = IN_CODE.iter().filter(|(word, _)| holds(&line, word));
        found.extend(words.map(|(word, field)| format!("{}:{}: {word} ({field})", source.file, number + 1)));
    }
    found
}

fn own_word(text: &str) -> Option<String> {
    let words = text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_lowercase);
    words.into_iter().find(|word| OWN.contains(&word.as_str()) || OWN_BEGINNINGS.iter().any(|w| word.starts_with(w)))
}

/// A text without what it names of the code: between backticks, and between the braces of a format.
fn without(text: &str, [open, close]: [char; 2]) -> String {
    let (mut inside, mut out) = (false, String::new());
    for c in text.chars() {
        match (inside, c) {
            (false, c) if c == open => inside = true,
            (true, c) if c == close => inside = false,
            (true, _) => {}
            (false, c) => out.push(c),
        }
    }
    out
}

#[test]
fn help_documents_and_messages_speak_the_language_of_the_field() {
    let mut wrong = Vec::new();
    let mut look = |place: String, text: &str| wrong.extend(own_word(text).map(|word| format!("{place}: {word}")));
    for verb in verbs() {
        look(verb.path.join(" "), &verb.help);
    }
    for (name, text) in documents() {
        look(name, &without(&text, ['`', '`']));
    }
    for (file, text) in literals() {
        look(format!("{file}: {text:?}"), &without(&text, ['{', '}']));
    }
    assert!(wrong.is_empty(), "words of this project's own:\n{}", wrong.join("\n"));
}

#[test]
fn names_and_comments_of_calibration_speak_it_too() {
    let mut wrong = Vec::new();
    for source in below(&root(), "calibration").into_iter().filter(|source| !source.is_test()) {
        wrong.extend(own_words_in(&source));
    }
    assert!(wrong.is_empty(), "words of this project's own:\n{}", wrong.join("\n"));
}

#[test]
fn a_word_of_its_own_is_found_wherever_it_stands() {
    for text in ["the clips stray", "Foretells 3 clips", "as told.", "it settles"] {
        assert!(own_word(text).is_some(), "{text}");
    }
    assert!(holds("the clip's own numbers,", "own numbers") && !holds("its own numbers_of", "own numbers"));
    assert_eq!(own_word("identifiable from held-out clips"), None);
    assert_eq!(without("{told} of `straying.rs`", ['{', '}']), " of `straying.rs`");
}
