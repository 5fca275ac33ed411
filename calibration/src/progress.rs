//! A progress bar on stderr; where stderr is no terminal, no bar.

use indicatif::{ProgressBar, ProgressStyle};

/// The bar of one piece of work; it disappears when dropped.
#[derive(Debug)]
pub struct Progress(ProgressBar);

impl Progress {
    /// A bar of `length` steps.
    ///
    /// # Panics
    /// Never: the template is fixed.
    #[must_use]
    pub fn new(title: &str, length: u64) -> Self {
        let template = "{prefix} [{bar:30}] {percent:>3} % {msg}";
        let style = ProgressStyle::with_template(template).expect("a valid template").progress_chars("=> ");
        Self(ProgressBar::new(length).with_style(style).with_prefix(title.to_owned()))
    }

    /// Moves the bar and changes the note behind it.
    pub fn show(&self, position: u64, note: &str) {
        self.0.set_position(position);
        self.0.set_message(note.to_owned());
    }

    /// Tells a line on stderr, above the bar where there is one.
    pub fn tell(&self, line: &str) {
        if self.0.is_hidden() { eprintln!("{line}") } else { self.0.println(line) }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
