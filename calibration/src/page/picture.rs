//! A photograph or a drawing by pixels, inside the page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

/// A PNG file, with what it shows in words for those who cannot see it.
pub(crate) fn picture(png: &[u8], what: &str) -> Markup {
    html! { img src=(format!("data:image/png;base64,{}", STANDARD.encode(png))) alt=(what) style="max-width:100%;height:auto"; }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_lies_in_the_page_and_says_what_it_shows() {
        let markup = picture(b"\x89PNG", "a < b").into_string();
        assert!(markup.contains("data:image/png;base64,iVBORw==") && markup.contains("a &lt; b"), "{markup}");
    }
}
