//! What a person reads is in terms of the field: no word of this project's own in help, documents, messages and reports.

use tests::texts::{documents, literals, verbs};

/// Words that stand for something the field has a term for: predicts, log-likelihood, residual, identifiable, held-out.
const OWN: [&str; 10] =
    ["foretell", "foretells", "foretold", "told", "stray", "strays", "straying", "worthy", "freed", "flat"];
const OWN_BEGINNINGS: [&str; 2] = ["settl", "foretell"];

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
fn a_word_of_its_own_is_found_wherever_it_stands() {
    for text in ["the clips stray", "Foretells 3 clips", "as told.", "it settles"] {
        assert!(own_word(text).is_some(), "{text}");
    }
    assert_eq!(own_word("identifiable from held-out clips"), None);
    assert_eq!(without("{told} of `straying.rs`", ['{', '}']), " of `straying.rs`");
}
