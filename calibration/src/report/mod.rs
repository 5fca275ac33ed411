//! Reports: what was found, as one offline HTML file with pictures inside.
//!
//! | module | owns |
//! |---|---|
//! | [`diagnosis`] | the page of a diagnosis |
//! | [`against`] | the page of what changed between two sessions |
//! | [`check`] | the page of what is odd about a recording |
//! | [`benchmark`] | the page of how good the diagnosis is |
//! | [`demo_page`] | the page of the demo |
//! | [`evaluation`] | the page of an evaluation of policies |
//! | [`identification`] | the page of what was identified about arm or object |
//! | [`terminal`] | diagnosis, identification and benchmark in a few lines for a terminal |

pub mod against;
pub mod benchmark;
pub mod check;
pub mod demo_page;
pub mod diagnosis;
pub mod evaluation;
pub mod identification;
pub mod terminal;

pub use demo_page::Story;
