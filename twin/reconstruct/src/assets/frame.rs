//! What all reports have in common: one HTML file that opens anywhere, without network and without scripts.

use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");

/// A whole page under a heading; `command` made what it shows.
pub(super) fn framed(heading: &str, content: &Markup, command: &str) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "twinalign: " (heading) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (heading) }
                (content)
                footer { "twinalign " (env!("CARGO_PKG_VERSION")) ". " (command) }
            }
        }
    };
    page.into_string()
}
